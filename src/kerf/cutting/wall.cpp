#include "kerf/cutting/wall.h"

#include <algorithm>

#include "kerf/base/random.h"
#include "kerf/cutting/borders_near.h"
#include "kerf/cutting/chain_split.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/cutting/visual_walk.h"
#include "kerf/cutting/wall_bow.h"
#include "kerf/cutting/wall_room.h"

namespace kerf::cut {

namespace {
using CH = CollisionHalfEdge;
using VH = VisualHalfEdge;
using ColumnVertex = CutScratch::ColumnVertex;
}  // namespace

bool merge_columns(CutContext& cut, CH h, bool force_column) {
  CellComplex& body = cut.body;
  CollisionMesh& coarse = body.collision;
  const CH g = coarse.twin[h];
  const Vec2 ua = coarse.planar[h], ub = coarse.planar[CollisionMesh::next(h)];
  const Vec2 ua_right = coarse.planar[CollisionMesh::next(g)], ub_right = coarse.planar[g];
  auto& chain = cut.scratch.chain;
  auto& parameter = cut.scratch.parameter;
  for (int i = 0; i < 2; ++i) {
    const auto s = static_cast<std::size_t>(i);
    const PoolRun run = coarse.chain[h][s];
    chain[s].clear();
    parameter[s].clear();
    double last = 0;
    for (std::int32_t k = 0; k < run.count; ++k) {
      chain[s].push_back(body.chain_pool[run.at(k)]);
      parameter[s].push_back(chain_parameter(body, h, static_cast<Side>(i), chain[s].back()));
      if (!(parameter[s].back() > last))
        return cut.fail("the points of a chain are out of order", "collision half-edge", h.value);
      last = parameter[s].back();
    }
    if (!(last < 1)) return cut.fail("the points of a chain are out of order", "collision half-edge", h.value);
  }
  bool changed[2] = {false, false};
  const auto value = [&](int s, std::size_t k) { return k < parameter[s].size() ? parameter[s][k] : 1.0; };
  const auto insert = [&](int s, std::size_t k, double t) {
    const double low = k > 0 ? parameter[s][k - 1] : 0.0, high = value(s, k);
    const auto side = static_cast<std::size_t>(s);
    const VisualVertex u = k > 0 ? chain[s][k - 1] : coarse.bound[coarse.from(h)][side];
    const VisualVertex w = k < chain[s].size() ? chain[s][k] : coarse.bound[coarse.to(h)][side];
    const VisualVertex m = insert_in_chain(cut, h, static_cast<Side>(s), u, w, (t - low) / (high - low),
                                           lerp(ua, ub, t), lerp(ua_right, ub_right, t));
    if (!m.valid()) return false;
    chain[s].insert(chain[s].begin() + static_cast<std::ptrdiff_t>(k), m);
    parameter[s].insert(parameter[s].begin() + static_cast<std::ptrdiff_t>(k), t);
    changed[s] = true;
    return true;
  };
  std::size_t k = 0;
  for (; k < chain[0].size() || k < chain[1].size(); ++k) {
    const double p = value(0, k), m = value(1, k);
    if (p < 1 && m < 1) {
      const double previous_p = k > 0 ? parameter[0][k - 1] : 0.0, previous_m = k > 0 ? parameter[1][k - 1] : 0.0;
      const double gap =
          std::min(std::min(p - previous_p, m - previous_m), std::min(value(0, k + 1) - p, value(1, k + 1) - m));
      if (std::fabs(p - m) < kPairFraction * gap) continue;
    }
    if (p < m ? !insert(1, k, p) : !insert(0, k, m)) return false;
  }
  if (k == 0 && force_column)
    if (!insert(0, 0, 0.5) || !insert(1, 0, 0.5)) return false;
  std::array<PoolRun, 2> runs = coarse.chain[h];
  for (int i = 0; i < 2; ++i) {
    if (!changed[i]) continue;
    const auto s = static_cast<std::size_t>(i);
    runs[s] = {static_cast<std::int32_t>(body.chain_pool.size()), static_cast<std::int32_t>(chain[s].size()), false};
    for (const VisualVertex v : chain[s]) body.chain_pool.push_back(v);
  }
  if (changed[0] || changed[1]) {
    coarse.chain.set(h, runs);
    coarse.chain.set(g, {runs[0].flipped(), runs[1].flipped()});
  }
  return true;
}

namespace {

Vec3f direction_normal(Vec3 n) {
  const double length = norm(n);
  return length > 0 ? to_float((1 / length) * n) : Vec3f{0, 0, 1};
}

}  // namespace

PoolRun make_line(CutContext& cut, std::array<VisualVertex, 2> bound) {
  CellComplex& body = cut.body;
  const PoolRun run{static_cast<std::int32_t>(body.chain_pool.size()), cut.options.layers - 1, false};
  for (int i = 1; i < cut.options.layers; ++i) {
    const Vec3 p =
        lerp(body.visual.rest[bound[0]], body.visual.rest[bound[1]], static_cast<double>(i) / cut.options.layers);
    body.chain_pool.push_back(append_visual_vertex(body.visual, p, body.visual.normal[bound[0]]));
  }
  return run;
}

namespace {

/// One wall under construction.
struct WallStrip {
  CutContext& cut;
  CH edge;             // the border half-edge that the wall hangs on
  bool mirrored_ties;  // the twin of a wall has its diagonals mirrored
  WallId wall;

  /// Column k of the wall: k = 0 at the start of `edge`. New inner vertices get their 3D points from `displacement`.
  void fill_column(std::int32_t k, std::int32_t last, std::vector<ColumnVertex>& column, const Vec3* displacement,
                   Vec3f normal) {
    CellComplex& body = cut.body;
    CollisionMesh& coarse = body.collision;
    VisualMesh& mesh = body.visual;
    const double depth = cut.options.layers;
    column.clear();
    if (k == 0 || k == last) {
      const CollisionVertex v = k == 0 ? coarse.from(edge) : coarse.to(edge);
      const auto bound = coarse.bound[v];
      if (bound[0] == bound[1]) {
        column.push_back({bound[0], -0.5 * depth, 0});
      } else {
        const PoolRun line = coarse.line[v];
        const double step = depth / (line.count + 1);
        column.push_back({bound[0], 0, 0});
        for (std::int32_t i = 0; i < line.count; ++i)
          column.push_back({body.chain_pool[line.at(i)], -step * (i + 1), 0});
        column.push_back({bound[1], -depth, 0});
      }
    } else {
      const VisualVertex top = body.chain_pool[coarse.chain[edge][0].at(k - 1)];
      const VisualVertex bottom = body.chain_pool[coarse.chain[edge][1].at(k - 1)];
      column.push_back({top, 0, 0});
      for (int i = 1; i < cut.options.layers; ++i) {
        const Vec3 p = lerp(mesh.rest[top], mesh.rest[bottom], static_cast<double>(i) / cut.options.layers);
        const VisualVertex v = append_visual_vertex(mesh, p + displacement[i - 1], normal);
        mesh.free.set(v, 1);
        body.wall_pool.push_back(v);
        column.push_back({v, -static_cast<double>(i), 0});
      }
      column.push_back({bottom, -depth, 0});
    }
    float down = 0;
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (i > 0) down += static_cast<float>(norm(mesh.rest[column[i].vertex] - mesh.rest[column[i - 1].vertex]));
      column[i].depth = down;
    }
  }

  VisualTriangle add_face(double x_left, const ColumnVertex& a, bool a_left, const ColumnVertex& b, bool b_left,
                          const ColumnVertex& c, bool c_left, float u_left, float u_right) {
    VisualMesh& mesh = cut.body.visual;
    const auto at = [&](const ColumnVertex& v, bool is_left) { return Vec2{is_left ? x_left : x_left + 1, v.y}; };
    const VisualTriangle f =
        append_face(mesh, a.vertex, b.vertex, c.vertex, at(a, a_left), at(b, b_left), at(c, c_left));
    mesh.texture.push_back({a_left ? u_left : u_right, a.depth});
    mesh.texture.push_back({b_left ? u_left : u_right, b.depth});
    mesh.texture.push_back({c_left ? u_left : u_right, c.depth});
    for (int i = 0; i < 3; ++i) mesh.barrier.push_back(0);
    mesh.patch.push_back(Patch::of_wall(wall));
    int i = 0;
    for (const VisualVertex v : {a.vertex, b.vertex, c.vertex}) {
      if (!mesh.outgoing[v].valid()) mesh.outgoing.set(v, VisualMesh::corner(f, i));
      ++i;
    }
    return f;
  }
};

/// The line of a fresh tip bows as a column.
void bow_line(VisualMesh& mesh, const Journaled<PoolIndex, VisualVertex>& pool, PoolRun line, Vec3 bow) {
  if (bow == Vec3{}) return;
  for (std::int32_t i = 0; i < line.count; ++i) {
    const VisualVertex v = pool[line.at(i)];
    mesh.rest.set(v, mesh.rest[v] + bow_share((i + 1.0) / (line.count + 1)) * bow);
  }
}

/// Moves the points of the walls of h and g outwards, to the right of h: into the material of g, as far as there is room.
void add_roughness(CutContext& cut, CH h, CH g, Vec3 outward) {
  const CellComplex& body = cut.body;
  const CollisionMesh& coarse = body.collision;
  const auto layers = static_cast<std::size_t>(cut.options.layers);
  if (layers < 2) return;
  const auto end = [&](std::int32_t k, std::size_t side) {
    return body.visual.rest[body.chain_pool[coarse.chain[h][side].at(k)]];
  };
  const Vec3 a = coarse.rest[coarse.from(h)], b = coarse.rest[coarse.to(h)];
  const double thick = norm(coarse.offset[coarse.from(h)] + coarse.offset[coarse.to(h)]);
  std::vector<BorderSegment>& borders = cut.scratch.borders;
  borders.clear();
  const double reach = 0.5 * norm(b - a) + kRoughReach * cut.options.roughness * thick / static_cast<double>(layers);
  for_each_border_near(coarse, CollisionMesh::face(g), lerp(a, b, 0.5), reach, [&](CH border, double, double) {
    if (border != g && border != h)
      borders.push_back({coarse.rest[coarse.from(border)], coarse.rest[coarse.to(border)]});
  });
  Random random(cut.options.seed + 0x9e3779b97f4a7c15ull * static_cast<std::uint64_t>(h.value + 1));
  for (std::int32_t k = 0; k < coarse.chain[h][0].count; ++k) {
    const Vec3 top = end(k, 0), bottom = end(k, 1);
    const double amplitude = cut.options.roughness * norm(top - bottom) / static_cast<double>(layers);
    const Vec3 foot = foot_on(coarse, h, lerp(top, bottom, 0.5));
    for (std::size_t i = 1; i < layers; ++i) {
      const double across = static_cast<double>(i) / static_cast<double>(layers);
      const double room = wall_room(coarse, h, outward, {foot, across, false}, borders);
      cut.scratch.displacement[static_cast<std::size_t>(k) * (layers - 1) + i - 1] +=
          random.uniform(0, std::min(amplitude, room)) * outward;
    }
  }
}

void join(VisualMesh& mesh, VH a, VH b, bool barrier) {
  link(mesh, a, b);
  if (barrier) set_barrier(mesh, a);
}

}  // namespace

void build_walls(CutContext& cut, CH h, CH g) {
  CellComplex& body = cut.body;
  CollisionMesh& coarse = body.collision;
  VisualMesh& mesh = body.visual;
  CutScratch& scratch = cut.scratch;
  const std::int32_t inner = coarse.chain[h][0].count, last = inner + 1;
  const int layers = cut.options.layers;
  KERF_ASSERT(coarse.chain[h][1].count == inner && coarse.chain[g][0].count == inner &&
              coarse.chain[g][1].count == inner);

  // Both walls: the same points, so the same displacements.
  const Vec3 along = coarse.rest[coarse.to(h)] - coarse.rest[coarse.from(h)];
  const Vec3 up = coarse.offset[coarse.from(h)] + coarse.offset[coarse.to(h)];
  const Vec3 outward = normalized(cross(along, up));  // to the right of h
  find_wall_bows(cut, h);
  scratch.displacement.clear();
  for (std::int32_t k = 1; k <= inner; ++k)
    for (int i = 1; i < layers; ++i)
      scratch.displacement.push_back(bow_share(static_cast<double>(i) / layers) *
                                     to_double(scratch.bow[static_cast<std::size_t>(k)]));
  for (int e = 0; e < 2; ++e)
    if (scratch.up[e].empty() && scratch.down[e].empty())
      bow_line(mesh, body.chain_pool, coarse.line[e == 0 ? coarse.from(h) : coarse.to(h)],
               to_double(e == 0 ? scratch.bow.front() : scratch.bow.back()));
  if (cut.options.roughness > 0) add_roughness(cut, h, g, outward);

  for (int which = 0; which < 2; ++which) {
    const CH edge = which == 0 ? h : g;
    WallStrip strip{cut, edge, which == 1, WallId{}};
    strip.wall = body.wall_edge.push_back(edge);
    const auto first_inner = static_cast<std::int32_t>(body.wall_pool.size());
    coarse.wall.set(edge, strip.wall);
    const Vec3f normal = direction_normal(which == 0 ? outward : -outward);

    // The texture goes on where the wall at the start of h ends: u grows to the right as seen from outside.
    const VH old = which == 0 ? (scratch.up[0].empty() ? VH{} : scratch.up[0][0])
                              : (scratch.down[0].empty() ? VH{} : scratch.down[0][0]);
    double u_at_start = 0;
    if (old.valid()) u_at_start = mesh.texture[which == 0 ? VisualMesh::next(old) : old].x;

    // Lengths from the start of h to every column, the mean of both chains.
    auto& length = scratch.parameter[0];
    length.assign(1, 0.0);
    for (std::int32_t k = 0; k < last; ++k) {
      double sum = 0;
      for (std::size_t s = 0; s < 2; ++s) {
        const auto at = [&](std::int32_t i) {
          if (i == 0) return coarse.bound[coarse.from(h)][s];
          if (i == last) return coarse.bound[coarse.to(h)][s];
          return body.chain_pool[coarse.chain[h][s].at(i - 1)];
        };
        sum += 0.5 * norm(mesh.rest[at(k + 1)] - mesh.rest[at(k)]);
      }
      length.push_back(length.back() + sum);
    }
    const auto u_of = [&](std::int32_t column) {  // of this wall, counted from its left
      return static_cast<float>(which == 0 ? u_at_start + length[static_cast<std::size_t>(column)]
                                           : u_at_start - length[static_cast<std::size_t>(last - column)]);
    };
    const auto displacement_of = [&](std::int32_t column) -> const Vec3* {
      if (column == 0 || column == last || layers < 2) return nullptr;
      const std::int32_t k = which == 0 ? column - 1 : last - column - 1;
      return scratch.displacement.data() + k * (layers - 1);
    };

    auto& left = scratch.column;
    auto& right = scratch.next_column;
    scratch.wall_down[which].clear();
    strip.fill_column(0, last, left, displacement_of(0), normal);
    std::vector<VH>& pending = scratch.pending;  // upward half-edges of the left column, top to bottom
    pending.clear();
    for (std::int32_t k = 0; k < last; ++k) {
      strip.fill_column(k + 1, last, right, displacement_of(k + 1), normal);
      const std::int32_t along_h = which == 0 ? k : last - 1 - k;
      const VH top = (which == 0 ? scratch.left : scratch.right)[0][static_cast<std::size_t>(along_h)];
      const VH bottom = (which == 0 ? scratch.left : scratch.right)[1][static_cast<std::size_t>(along_h)];
      std::vector<VH>& rising = scratch.wall_up[which];
      rising.clear();
      VH lower = top;
      bool on_chain = true;
      std::size_t i = 0, j = 0;
      while (i + 1 < left.size() || j + 1 < right.size()) {
        bool advance_left = j + 1 >= right.size();
        if (!advance_left && i + 1 < left.size()) {
          const double yl = left[i + 1].y, yr = right[j + 1].y;
          advance_left = yl != yr ? yl > yr : !strip.mirrored_ties;
        }
        if (advance_left) {
          const VisualTriangle f =
              strip.add_face(k, left[i], true, left[i + 1], true, right[j], false, u_of(k), u_of(k + 1));
          join(mesh, VisualMesh::corner(f, 2), lower, on_chain);
          lower = VisualMesh::corner(f, 1);
          const VH falling = VisualMesh::corner(f, 0);
          if (k == 0) scratch.wall_down[which].push_back(falling);
          else join(mesh, falling, pending[i], false);
          ++i;
        } else {
          const VisualTriangle f =
              strip.add_face(k, left[i], true, right[j + 1], false, right[j], false, u_of(k), u_of(k + 1));
          join(mesh, VisualMesh::corner(f, 2), lower, on_chain);
          lower = VisualMesh::corner(f, 0);
          rising.push_back(VisualMesh::corner(f, 1));
          ++j;
        }
        on_chain = false;
      }
      join(mesh, lower, bottom, true);
      std::swap(pending, rising);
      std::swap(left, right);
    }
    std::swap(scratch.wall_up[which], pending);
    body.wall_inner.push_back({first_inner, static_cast<std::int32_t>(body.wall_pool.size()) - first_inner, false});
  }

  const auto join_lines = [&](const std::vector<VH>& one, const std::vector<VH>& two) {
    KERF_ASSERT(one.size() == two.size());
    for (std::size_t i = 0; i < one.size(); ++i) join(mesh, one[i], two[i], true);
  };
  // Start of h: the left end of h's wall, the right end of g's.
  if (scratch.up[0].empty() && scratch.down[0].empty()) {
    join_lines(scratch.wall_down[0],
               scratch.wall_up[1]);  // a tip: the two walls share its line; on the rim both are empty
  } else {
    join_lines(scratch.wall_down[0], scratch.up[0]);
    join_lines(scratch.wall_up[1], scratch.down[0]);
  }
  if (scratch.up[1].empty() && scratch.down[1].empty()) {
    join_lines(scratch.wall_up[0], scratch.wall_down[1]);
  } else {
    join_lines(scratch.wall_up[0], scratch.down[1]);
    join_lines(scratch.wall_down[1], scratch.up[1]);
  }
}

WallId cut_wall(CutContext& cut, WallId wall, std::array<VisualVertex, 2> bound, PoolRun& line) {
  CellComplex& body = cut.body;
  VisualMesh& mesh = body.visual;
  const Patch patch = Patch::of_wall(wall);
  if (!walk_chord(cut, bound[0], bound[1], patch)) return {};
  const auto& path = cut.scratch.path;
  line = {static_cast<std::int32_t>(body.chain_pool.size()), static_cast<std::int32_t>(path.size()), false};
  for (const VisualVertex v : path) body.chain_pool.push_back(v);

  // The faces left of the way down belong to the far half.
  const WallId far = body.wall_edge.push_back(body.wall_edge[wall]);  // the caller sets the right edge
  const Patch far_patch = Patch::of_wall(far);
  const VH down = mesh.find_half_edge(bound[0], path.empty() ? bound[1] : path[0]);
  if (!down.valid()) {
    cut.fail("a wall is broken", "wall", wall.value);
    return {};
  }
  auto& stack = cut.scratch.faces;
  stack.assign(1, VisualMesh::face(down));
  mesh.patch.set(VisualMesh::face(down), far_patch);
  while (!stack.empty()) {
    const VisualTriangle f = stack.back();
    stack.pop_back();
    for (int i = 0; i < 3; ++i) {
      const VH h = VisualMesh::corner(f, i);
      const VH t = mesh.twin[h];
      if (mesh.barrier[h] || !t.valid() || !(mesh.patch[VisualMesh::face(t)] == patch)) continue;
      mesh.patch.set(VisualMesh::face(t), far_patch);
      stack.push_back(VisualMesh::face(t));
    }
  }
  const PoolRun run = body.wall_inner[wall];
  auto& part = cut.scratch.part;
  part[0].clear();
  part[1].clear();
  for (std::int32_t i = 0; i < run.count; ++i) {
    const VisualVertex v = body.wall_pool[PoolIndex(run.first + i)];
    if (!mesh.free[v]) continue;
    part[mesh.patch[VisualMesh::face(mesh.outgoing[v])] == far_patch ? 1 : 0].push_back(v);
  }
  std::int32_t next = run.first;
  for (int k = 0; k < 2; ++k) {
    const PoolRun half{next, static_cast<std::int32_t>(part[k].size()), false};
    for (const VisualVertex v : part[k]) {
      const PoolIndex here(next++);
      if (body.wall_pool[here] != v) body.wall_pool.set(here, v);
    }
    if (k == 0) body.wall_inner.set(wall, half);
    else body.wall_inner.push_back(half);
  }
  return far;
}

}  // namespace kerf::cut
