#include "kerf/cutting/chain_split.h"

#include <utility>

#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/tolerances.h"

namespace kerf::cut {

namespace {
using CH = CollisionHalfEdge;
}

double chain_parameter(const CellComplex& body, CH h, Side side, VisualVertex v) {
  const CollisionMesh& coarse = body.collision;
  const Vec2 a = coarse.planar[h], b = coarse.planar[CollisionMesh::next(h)];
  const RootId root = coarse.root[CollisionMesh::face(h)];
  const Vec2 u = mirrored(planar_in(body.visual, v, Patch::of_root(root, side)), side);
  return dot(u - a, b - a) / dot(b - a, b - a);
}

VisualHalfEdge chain_half_edge(const VisualMesh& mesh, Side side, VisualVertex u, VisualVertex w) {
  if (side == Side::kMinus) std::swap(u, w);
  // A chord that has just been walked left every vertex with its edge back to the one before.
  if (const VisualHalfEdge h = mesh.outgoing[u]; mesh.to(h) == w) return h;
  if (const VisualHalfEdge g = mesh.outgoing[w]; mesh.to(g) == u && mesh.twin[g].valid()) return mesh.twin[g];
  VisualHalfEdge found;
  for_each_corner(mesh, u, [&](VisualHalfEdge h) {
    if (mesh.to(h) == w) found = h;
    return !found.valid();
  });
  return found;
}

VisualVertex insert_in_chain(CutContext& cut, CH h, Side side, VisualVertex u, VisualVertex w, double fraction,
                             Vec2 u_left, Vec2 u_right) {
  VisualMesh& mesh = cut.body.visual;
  const VisualHalfEdge e = chain_half_edge(mesh, side, u, w);
  if (!e.valid()) {
    cut.fail("a chain is broken", "collision half-edge", h.value);
    return {};
  }
  const double f = side == Side::kPlus ? fraction : 1 - fraction;
  const Vec2 left = mirrored(u_left, side);
  Vec2 right;
  if (const VisualHalfEdge g = mesh.twin[e]; g.valid()) {
    const Patch patch = mesh.patch[VisualMesh::face(g)];
    if (patch.is_wall()) right = lerp(mesh.planar[VisualMesh::next(g)], mesh.planar[g], f);
    else if (patch.side() != side)
      right = mirrored(u_left, patch.side());  // the rim: the other side of the same triangle
    else right = mirrored(u_right, side);
  }
  if (!edge_split_is_sound(mesh, e, left, right)) {
    cut.fail("two points of a chain coincide", "collision half-edge", h.value);
    return {};
  }
  return split_visual_edge(mesh, e, f, left, right, place_reach(cut.body));
}

ChainCut cut_chain(CutContext& cut, CH h, Side side, double t, Vec2 u_left, Vec2 u_right) {
  CellComplex& body = cut.body;
  const CollisionMesh& coarse = body.collision;
  const PoolRun run = coarse.chain[h][static_cast<std::size_t>(index(side))];
  const auto at = [&](std::int32_t i) { return body.chain_pool[run.at(i)]; };
  // First inner vertex beyond t.
  std::int32_t first = 0, count = run.count;
  double low = 0, high = 1;
  while (count > 0) {
    const std::int32_t half = count / 2, middle = first + half;
    const double s = chain_parameter(body, h, side, at(middle));
    if (s <= t) {
      low = s;
      first = middle + 1;
      count -= half + 1;
    } else {
      high = s;
      count = half;
    }
  }
  if (!(low <= t && t < high)) {
    cut.fail("the points of a chain are out of order", "collision half-edge", h.value);
    return {};
  }
  const CH g = coarse.twin[h];
  const RootId root = coarse.root[CollisionMesh::face(h)];
  const auto slide = [&](VisualVertex v) {
    const Patch patch = Patch::of_root(root, side);
    if (g.valid()) {
      const RootId other = coarse.root[CollisionMesh::face(g)];
      return warp(body.visual, v,
                  std::array<PlanarPoint, 2>{
                      {{patch, mirrored(u_left, side)}, {Patch::of_root(other, side), mirrored(u_right, side)}}},
                  kWarpKeepsArea);
    }
    const Side opposite = side == Side::kPlus ? Side::kMinus : Side::kPlus;  // matters on the rim only
    return warp(body.visual, v,
                std::array<PlanarPoint, 2>{
                    {{patch, mirrored(u_left, side)}, {Patch::of_root(root, opposite), mirrored(u_left, opposite)}}},
                kWarpKeepsArea);
  };
  const double gap = high - low;
  const auto s = static_cast<std::size_t>(index(side));
  const VisualVertex u = first > 0 ? at(first - 1) : coarse.bound[coarse.from(h)][s];
  const VisualVertex w = first < run.count ? at(first) : coarse.bound[coarse.to(h)][s];
  const double near = near_enough(body, u, w);
  if (first > 0 && t - low < near * gap && slide(u)) return {u, first - 1, first};
  if (first < run.count && high - t < near * gap && slide(w)) return {w, first, first + 1};
  return {insert_in_chain(cut, h, side, u, w, (t - low) / gap, u_left, u_right), first, first};
}

}  // namespace kerf::cut
