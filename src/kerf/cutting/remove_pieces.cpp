#include "kerf/cutting/remove_pieces.h"

#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/cutting/topology_change.h"

namespace kerf {
namespace {

/// Area and volume of the triangles that go.
ComplexMeasures measure_removed(const CellComplex& body, const std::vector<std::uint8_t>& remove,
                                const std::vector<std::uint8_t>& remove_visual) {
  ComplexMeasures m;
  const VisualMesh& mesh = body.visual;
  for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count())) {
    if (!remove_visual[f.index()]) continue;
    const VisualHalfEdge h = VisualMesh::corner(f, 0);
    const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)], c = mesh.rest[mesh.apex(h)];
    if (!mesh.patch[f].is_wall()) m.skin_area += 0.5 * norm(cross(b - a, c - a));
    if (body.closed) m.volume += dot(a, cross(b, c)) / 6;
  }
  for (const CollisionTriangle f : ids<CollisionTriangle>(body.collision.face_count())) {
    if (!remove[f.index()]) continue;
    const CollisionHalfEdge h = CollisionMesh::corner(f, 0);
    const auto& p = body.collision.planar;
    m.collision_area += 0.5 * cross(p[CollisionMesh::next(h)] - p[h], p[CollisionMesh::prev(h)] - p[h]);
  }
  return m;
}

/// Visual triangles of the pieces: all that are connected with what the collision triangles own.
std::vector<std::uint8_t> visual_triangles_of(const CellComplex& body, const std::vector<std::uint8_t>& remove) {
  const VisualMesh& mesh = body.visual;
  std::vector<std::uint8_t> taken(mesh.face_count(), 0);
  std::vector<VisualTriangle> stack;
  const auto take = [&](VisualTriangle f) {
    if (taken[f.index()]) return;
    taken[f.index()] = 1;
    stack.push_back(f);
  };
  const CollisionMesh& coarse = body.collision;
  for (const CollisionTriangle t : ids<CollisionTriangle>(coarse.face_count())) {
    if (!remove[t.index()]) continue;
    for (int i = 0; i < 3; ++i)
      for (const VisualVertex b : coarse.bound[coarse.origin[CollisionMesh::corner(t, i)]])
        if (b.valid()) take(VisualMesh::face(mesh.outgoing[b]));
  }
  while (!stack.empty()) {
    const VisualTriangle f = stack.back();
    stack.pop_back();
    for (int i = 0; i < 3; ++i)
      if (const VisualHalfEdge t = mesh.twin[VisualMesh::corner(f, i)]; t.valid()) take(VisualMesh::face(t));
  }
  return taken;
}

template <class Mesh, class VMap, class HMap>
void keep_topology(Mesh& mesh, const VMap& vertex, const HMap& half_edge) {
  keep_items(mesh.origin, half_edge, vertex);
  keep_items(mesh.twin, half_edge, half_edge);
  keep_items(mesh.planar, half_edge);
  keep_items(mesh.outgoing, vertex, half_edge);
}

/// A pool of visual vertices in which only the items of the runs that are kept stay.
class PoolKeeper {
 public:
  explicit PoolKeeper(const Journaled<PoolIndex, VisualVertex>& pool) : keep_(pool.size(), 0) {}
  void mark(const PoolRun& run) {
    for (std::int32_t i = 0; i < run.count; ++i)
      keep_[static_cast<std::size_t>(run.first) + static_cast<std::size_t>(i)] = 1;
  }
  void apply(Journaled<PoolIndex, VisualVertex>& pool, const IdMap<VisualVertex>& vertex) {
    std::vector<VisualVertex> items;
    start_.reserve(keep_.size() + 1);
    for (std::size_t i = 0; i < keep_.size(); ++i) {
      start_.push_back(static_cast<std::int32_t>(items.size()));
      if (keep_[i]) items.push_back(vertex(pool[PoolIndex(i)]));
    }
    start_.push_back(static_cast<std::int32_t>(items.size()));
    pool = Journaled<PoolIndex, VisualVertex>(std::move(items));
  }
  [[nodiscard]] PoolRun operator()(PoolRun run) const {
    if (run.exists()) run.first = start_[static_cast<std::size_t>(run.first)];
    return run;
  }

 private:
  std::vector<std::uint8_t> keep_;
  std::vector<std::int32_t> start_;
};

/// Runs that may list vertices that are no longer theirs: only free ones stay.
PoolRun keep_free(const CellComplex& body, const Journaled<PoolIndex, VisualVertex>& pool, const PoolRun& run,
                  const IdMap<VisualVertex>& vertex, std::vector<VisualVertex>& items) {
  if (!run.exists()) return run;
  PoolRun kept{static_cast<std::int32_t>(items.size()), 0, false};
  for (std::int32_t i = 0; i < run.count; ++i) {
    const VisualVertex v = pool[run.at(i)];
    if (!body.visual.free[v] || !vertex.keeps(v)) continue;
    items.push_back(vertex(v));
    ++kept.count;
  }
  return kept;
}

}  // namespace

ComplexRenaming remove_pieces(CellComplex& body, const std::vector<std::uint8_t>& remove) {
  CollisionMesh& coarse = body.collision;
  VisualMesh& mesh = body.visual;
  KERF_ASSERT(remove.size() == coarse.face_count());
  const std::vector<std::uint8_t> remove_visual = visual_triangles_of(body, remove);
  ComplexRenaming r;
  r.removed = measure_removed(body, remove, remove_visual);
  r.collision_triangle =
      id_map<CollisionTriangle>(coarse.face_count(), [&](CollisionTriangle f) { return !remove[f.index()]; });
  r.collision_half_edge = id_map<CollisionHalfEdge>(
      coarse.half_edge_count(), [&](CollisionHalfEdge h) { return !remove[CollisionMesh::face(h).index()]; });
  r.collision_vertex = id_map<CollisionVertex>(coarse.vertex_count(), [&](CollisionVertex v) {
    return !remove[CollisionMesh::face(coarse.outgoing[v]).index()];
  });
  r.visual_triangle =
      id_map<VisualTriangle>(mesh.face_count(), [&](VisualTriangle f) { return !remove_visual[f.index()]; });
  r.visual_half_edge = id_map<VisualHalfEdge>(
      mesh.half_edge_count(), [&](VisualHalfEdge h) { return !remove_visual[VisualMesh::face(h).index()]; });
  r.visual_vertex = id_map<VisualVertex>(
      mesh.vertex_count(), [&](VisualVertex v) { return !remove_visual[VisualMesh::face(mesh.outgoing[v]).index()]; });
  r.wall =
      id_map<WallId>(body.wall_edge.size(), [&](WallId w) { return r.collision_half_edge.keeps(body.wall_edge[w]); });

  // Pools: chains and lines hold just what is theirs, lists of free vertices are made anew.
  PoolKeeper chains(body.chain_pool);
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(coarse.half_edge_count()))
    if (r.collision_half_edge.keeps(h))
      for (const PoolRun& run : coarse.chain[h]) chains.mark(run);
  for (const CollisionVertex v : ids<CollisionVertex>(coarse.vertex_count()))
    if (r.collision_vertex.keeps(v)) chains.mark(coarse.line[v]);
  chains.apply(body.chain_pool, r.visual_vertex);
  std::vector<VisualVertex> free_items, wall_items;
  keep_items(coarse.free, r.collision_triangle, [&](std::array<PoolRun, 2> runs) {
    for (PoolRun& run : runs) run = keep_free(body, body.free_pool, run, r.visual_vertex, free_items);
    return runs;
  });
  keep_items(body.wall_inner, r.wall,
             [&](const PoolRun& run) { return keep_free(body, body.wall_pool, run, r.visual_vertex, wall_items); });
  body.free_pool = Journaled<PoolIndex, VisualVertex>(std::move(free_items));
  body.wall_pool = Journaled<PoolIndex, VisualVertex>(std::move(wall_items));
  keep_items(body.wall_edge, r.wall, r.collision_half_edge);

  // Vertices whose common ancestor goes: the first that stays stands for it.
  std::vector<CollisionVertex> stands_for(coarse.vertex_count());
  for (const CollisionVertex v : ids<CollisionVertex>(coarse.vertex_count())) {
    CollisionVertex& first = stands_for[coarse.ancestor[v].index()];
    if (r.collision_vertex.keeps(v) && !first.valid()) first = v;
  }
  for (const CollisionVertex v : ids<CollisionVertex>(coarse.vertex_count()))
    if (r.collision_vertex.keeps(coarse.ancestor[v])) stands_for[coarse.ancestor[v].index()] = coarse.ancestor[v];
    else if (r.collision_vertex.keeps(v)) r.new_ancestor.push_back(r.collision_vertex(v));
  keep_items(coarse.ancestor, r.collision_vertex,
             [&](CollisionVertex a) { return r.collision_vertex(stands_for[a.index()]); });
  keep_items(coarse.rest, r.collision_vertex);
  keep_items(coarse.offset, r.collision_vertex);
  keep_items(coarse.bound, r.collision_vertex, [&](std::array<VisualVertex, 2> b) {
    for (VisualVertex& v : b) v = r.visual_vertex(v);
    return b;
  });
  keep_items(coarse.line, r.collision_vertex, chains);
  keep_items(coarse.chain, r.collision_half_edge, [&](std::array<PoolRun, 2> runs) {
    for (PoolRun& run : runs) run = chains(run);
    return runs;
  });
  keep_items(coarse.wall, r.collision_half_edge, r.wall);
  keep_items(coarse.root, r.collision_triangle);
  keep_topology(coarse, r.collision_vertex, r.collision_half_edge);

  keep_items(mesh.texture, r.visual_half_edge);
  keep_items(mesh.barrier, r.visual_half_edge);
  keep_items(mesh.rest, r.visual_vertex);
  keep_items(mesh.normal, r.visual_vertex);
  keep_items(mesh.free, r.visual_vertex);
  keep_items(mesh.patch, r.visual_triangle,
             [&](Patch p) { return p.is_wall() ? Patch::of_wall(r.wall(p.wall())) : p; });
  keep_topology(mesh, r.visual_vertex, r.visual_half_edge);
  return r;
}

}  // namespace kerf
