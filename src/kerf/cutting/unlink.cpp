#include "kerf/cutting/unlink.h"

#include "kerf/base/stopwatch.h"
#include "kerf/cutting/chain_split.h"
#include "kerf/cutting/drawn_curve.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/wall.h"

namespace kerf::cut {

namespace {

using CH = CollisionHalfEdge;
using VH = VisualHalfEdge;

/// An open sheet: the slit of one edge that is there for a moment needs a vertex on its lips, or both are the same edge.
bool add_middle_vertex(CutContext& cut, CH h) {
  CellComplex& body = cut.body;
  CollisionMesh& coarse = body.collision;
  const CH g = coarse.twin[h];
  const VisualVertex m =
      insert_in_chain(cut, h, Side::kPlus, coarse.bound[coarse.from(h)][0], coarse.bound[coarse.to(h)][0], 0.5,
                      lerp(coarse.planar[h], coarse.planar[CollisionMesh::next(h)], 0.5),
                      lerp(coarse.planar[CollisionMesh::next(g)], coarse.planar[g], 0.5));
  if (!m.valid()) return false;
  PoolRun run{static_cast<std::int32_t>(body.chain_pool.size()), 1, false};
  body.chain_pool.push_back(m);
  coarse.chain.set(h, {run, PoolRun{}});
  coarse.chain.set(g, {run.flipped(), PoolRun{}});
  return true;
}

/// Splits v in two: the fan component of `right` gets a new vertex, `left` is a half-edge of what keeps the name.
VisualVertex fall_apart(VisualMesh& mesh, VisualVertex v, VH left, VH right) {
  KERF_ASSERT(mesh.origin[left] == v && mesh.origin[right] == v);
  const VisualVertex twin = append_visual_vertex(mesh, mesh.rest[v], mesh.normal[v]);
  rename_fan(mesh, right, twin);
  mesh.outgoing.set(v, left);
  mesh.outgoing.set(twin, right);
  return twin;
}

}  // namespace

bool make_chains(CutContext& cut, CH h) {
  CellComplex& body = cut.body;
  CollisionMesh& coarse = body.collision;
  std::array<PoolRun, 2> runs{};
  find_drawn_curve(cut, h);
  for (int i = 0; i < side_count(body); ++i) {
    const auto s = static_cast<std::size_t>(i);
    if (!walk_curve(cut, h, static_cast<Side>(i))) return false;
    runs[s] = {static_cast<std::int32_t>(body.chain_pool.size()), static_cast<std::int32_t>(cut.scratch.path.size()),
               false};
    for (const VisualVertex v : cut.scratch.path) body.chain_pool.push_back(v);
  }
  coarse.chain.set(h, runs);
  for (PoolRun& r : runs)
    if (r.exists()) r = r.flipped();
  coarse.chain.set(coarse.twin[h], runs);
  return true;
}

bool unlink_edge(CutContext& cut, CH h) {
  CellComplex& body = cut.body;
  CollisionMesh& coarse = body.collision;
  VisualMesh& mesh = body.visual;
  CutScratch& scratch = cut.scratch;
  const CH g = coarse.twin[h];
  KERF_ASSERT(g.valid());
  const CollisionVertex end[2] = {coarse.from(h), coarse.to(h)};
  const bool splits[2] = {coarse.on_border(end[0]), coarse.on_border(end[1])};
  const bool rim[2] = {body.closed && coarse.on_rim(end[0]), body.closed && coarse.on_rim(end[1])};

  if (!coarse.has_chain(h) && !make_chains(cut, h)) return false;
  if (body.closed) {
    if (!merge_columns(cut, h, (!splits[0] && !splits[1]) || (rim[0] && rim[1]))) return false;
  } else if (!splits[0] && !splits[1] && coarse.chain[h][0].count == 0) {
    if (!add_middle_vertex(cut, h)) return false;
  }

  // Open the visual mesh along the chains and along the lines of ends that fall apart.
  const int sides = side_count(body);
  const std::int32_t inner = coarse.chain[h][0].count;
  for (int i = 0; i < sides; ++i) {
    const auto s = static_cast<std::size_t>(i);
    auto& chain = scratch.chain[s];
    chain.assign(1, coarse.bound[end[0]][s]);
    const PoolRun run = coarse.chain[h][s];
    for (std::int32_t k = 0; k < run.count; ++k) chain.push_back(body.chain_pool[run.at(k)]);
    chain.push_back(coarse.bound[end[1]][s]);
    scratch.left[s].clear();
    scratch.right[s].clear();
    for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
      const VH x = chain_half_edge(mesh, static_cast<Side>(i), chain[k], chain[k + 1]);
      if (!x.valid() || !mesh.twin[x].valid()) return cut.fail("a chain is broken", "collision half-edge", h.value);
      scratch.left[s].push_back(x);
      scratch.right[s].push_back(mesh.twin[x]);
    }
  }
  for (std::size_t e = 0; e < 2; ++e) {
    scratch.down[e].clear();
    scratch.up[e].clear();
    if (!body.closed || !splits[e] || rim[e]) continue;
    auto& line = scratch.line[e];
    line.assign(1, coarse.bound[end[e]][0]);
    const PoolRun run = coarse.line[end[e]];
    for (std::int32_t k = 0; k < run.count; ++k) line.push_back(body.chain_pool[run.at(k)]);
    line.push_back(coarse.bound[end[e]][1]);
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
      const VH d = mesh.find_half_edge(line[k], line[k + 1]);
      if (!d.valid() || !mesh.twin[d].valid()) return cut.fail("a line is broken", "collision vertex", end[e].value);
      scratch.down[e].push_back(d);
      scratch.up[e].push_back(mesh.twin[d]);
    }
  }
  for (std::size_t s = 0; s < static_cast<std::size_t>(sides); ++s)
    for (const auto* edges : {&scratch.left[s], &scratch.right[s]})
      for (const VH x : *edges) mesh.twin.set(x, VH{});
  for (std::size_t e = 0; e < 2; ++e)
    for (const auto* edges : {&scratch.down[e], &scratch.up[e]})
      for (const VH x : *edges) mesh.twin.set(x, VH{});
  coarse.twin.set(h, CH{});
  coarse.twin.set(g, CH{});

  // Right-hand names on the visual mesh: inner chain vertices, then the ends that fall apart.
  std::array<std::array<VisualVertex, 2>, 2> right_bound;  // [end][side]
  std::array<PoolRun, 2> right_runs{};
  const auto outgoing_left = [&](std::size_t s, std::int32_t k) {  // at chain vertex k, counting the ends
    if (s == 0)
      return k <= inner ? scratch.left[0][static_cast<std::size_t>(k)]
                        : VisualMesh::next(scratch.left[0][static_cast<std::size_t>(inner)]);
    return k > 0 ? scratch.left[1][static_cast<std::size_t>(k - 1)] : VisualMesh::next(scratch.left[1][0]);
  };
  const auto outgoing_right = [&](std::size_t s, std::int32_t k) {
    if (s == 0)
      return k > 0 ? scratch.right[0][static_cast<std::size_t>(k - 1)] : VisualMesh::next(scratch.right[0][0]);
    return k <= inner ? scratch.right[1][static_cast<std::size_t>(k)]
                      : VisualMesh::next(scratch.right[1][static_cast<std::size_t>(inner)]);
  };
  for (std::size_t s = 0; s < static_cast<std::size_t>(sides); ++s) {
    right_runs[s] = {static_cast<std::int32_t>(body.chain_pool.size()), inner, true};
    for (std::int32_t k = 1; k <= inner; ++k)
      body.chain_pool.push_back(
          fall_apart(mesh, scratch.chain[s][static_cast<std::size_t>(k)], outgoing_left(s, k), outgoing_right(s, k)));
  }
  coarse.chain.set(g, right_runs);
  for (std::size_t e = 0; e < 2; ++e) {
    if (!splits[e]) continue;
    const std::int32_t k = e == 0 ? 0 : inner + 1;
    for (std::size_t s = 0; s < static_cast<std::size_t>(sides); ++s)
      right_bound[e][s] = rim[e] && s == 1
                              ? right_bound[e][0]
                              : fall_apart(mesh, coarse.bound[end[e]][s], outgoing_left(s, k), outgoing_right(s, k));
    PoolRun right_line{};
    if (body.closed && !rim[e]) {
      right_line = {static_cast<std::int32_t>(body.chain_pool.size()), coarse.line[end[e]].count, false};
      for (std::size_t i = 1; i + 1 < scratch.line[e].size(); ++i) {
        // At the start the old border out-edge (down) goes to the right, at the end the in-edge (up).
        const VH down = scratch.down[e][i], up = scratch.up[e][i - 1];
        body.chain_pool.push_back(fall_apart(mesh, scratch.line[e][i], e == 0 ? up : down, e == 0 ? down : up));
      }
    }
    // And on the collision mesh.
    const CollisionVertex v = end[e];
    const CollisionVertex twin = coarse.outgoing.push_back(CH{});
    coarse.rest.push_back(coarse.rest[v]);
    coarse.offset.push_back(coarse.offset[v]);
    coarse.bound.push_back(right_bound[e]);
    coarse.line.push_back(right_line);
    coarse.ancestor.push_back(coarse.ancestor[v]);
    const CH right = e == 0 ? CollisionMesh::next(g) : g;
    rename_fan(coarse, right, twin);
    coarse.outgoing.set(twin, right);
    coarse.outgoing.set(v, e == 0 ? h : CollisionMesh::next(h));
    scratch.note_birth({twin, {v, CollisionVertex{}, CollisionVertex{}}, {1, 0, 0}});
  }
  if (!body.closed) return true;
  for (std::size_t e = 0; e < 2; ++e)
    if (!splits[e]) coarse.line.set(end[e], make_line(cut, coarse.bound[end[e]]));
  const auto start = Clock::now();
  build_walls(cut, h, g);
  cut.scratch.wall_seconds += seconds_since(start);
  return true;
}

}  // namespace kerf::cut
