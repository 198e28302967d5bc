#include "kerf/binding/join_complexes.h"

#include <algorithm>

#include "kerf/base/indexed.h"

namespace kerf {
namespace {

/// How many ids of each kind come before those of the part.
struct Offsets {
  std::int32_t coarse_vertex, coarse_face, fine_vertex, fine_face, root, wall, chain_pool, free_pool, wall_pool;

  [[nodiscard]] CollisionVertex operator()(CollisionVertex v) const { return shifted(v, coarse_vertex); }
  [[nodiscard]] CollisionHalfEdge operator()(CollisionHalfEdge h) const { return shifted(h, 3 * coarse_face); }
  [[nodiscard]] VisualVertex operator()(VisualVertex v) const { return shifted(v, fine_vertex); }
  [[nodiscard]] VisualHalfEdge operator()(VisualHalfEdge h) const { return shifted(h, 3 * fine_face); }
  [[nodiscard]] RootId operator()(RootId r) const { return shifted(r, root); }
  [[nodiscard]] WallId operator()(WallId w) const { return shifted(w, wall); }
  [[nodiscard]] Patch operator()(Patch p) const {
    return p.is_wall() ? Patch::of_wall((*this)(p.wall())) : Patch::of_root((*this)(p.root()), p.side());
  }
  template <class Id>
  [[nodiscard]] static Id shifted(Id id, std::int32_t by) {
    return id.valid() ? Id(id.value + by) : id;
  }
  [[nodiscard]] static PoolRun shifted(PoolRun run, std::int32_t by) {
    if (run.exists()) run.first += by;
    return run;
  }
  [[nodiscard]] static std::array<PoolRun, 2> shifted(const std::array<PoolRun, 2>& runs, std::int32_t by) {
    return {shifted(runs[0], by), shifted(runs[1], by)};
  }
};

/// Appends an array, item by item through f.
template <class Array, class Fn>
void append(const Array& part, Array& whole, Fn&& f) {
  for (const auto& item : part.raw()) whole.push_back(f(item));
}
template <class Array>
void append(const Array& part, Array& whole) {
  append(part, whole, [](const auto& item) { return item; });
}

}  // namespace

void place_complex(const RigidPlace& place, CellComplex& complex) {
  CollisionMesh& c = complex.collision;
  for (const CollisionVertex v : ids<CollisionVertex>(c.vertex_count())) {
    c.rest.set(v, place.to_world(c.rest[v]));
    c.offset.set(v, place.axes * c.offset[v]);
  }
  VisualMesh& m = complex.visual;
  for (const VisualVertex v : ids<VisualVertex>(m.vertex_count())) {
    m.rest.set(v, place.to_world(m.rest[v]));
    m.normal.set(v, to_float(place.axes * to_double(m.normal[v])));
  }
}

std::int32_t root_count(const CellComplex& complex) {
  std::int32_t n = 0;
  for (const RootId r : complex.collision.root.raw()) n = std::max(n, r.value + 1);
  return n;
}

void append_complex(const CellComplex& part, CellComplex& whole) {
  const auto size = [](const auto& array) { return static_cast<std::int32_t>(array.size()); };
  CollisionMesh& c = whole.collision;
  VisualMesh& m = whole.visual;
  const Offsets o{size(c.outgoing),       size(c.origin) / 3,    size(m.outgoing),
                  size(m.origin) / 3,     root_count(whole),     size(whole.wall_edge),
                  size(whole.chain_pool), size(whole.free_pool), size(whole.wall_pool)};
  const auto same = [](const auto& item) { return item; };
  whole.mean_root_edge = std::min(whole.mean_root_edge, part.mean_root_edge);

  const CollisionMesh& pc = part.collision;
  append(pc.origin, c.origin, o);
  append(pc.twin, c.twin, o);
  append(pc.planar, c.planar, same);
  append(pc.outgoing, c.outgoing, o);
  append(pc.chain, c.chain, [&](const auto& runs) { return Offsets::shifted(runs, o.chain_pool); });
  append(pc.wall, c.wall, o);
  append(pc.rest, c.rest);
  append(pc.offset, c.offset);
  append(pc.bound, c.bound, [&](const auto& b) { return std::array<VisualVertex, 2>{o(b[0]), o(b[1])}; });
  append(pc.line, c.line, [&](const PoolRun& run) { return Offsets::shifted(run, o.chain_pool); });
  append(pc.ancestor, c.ancestor, o);
  append(pc.root, c.root, o);
  append(pc.free, c.free, [&](const auto& runs) { return Offsets::shifted(runs, o.free_pool); });

  const VisualMesh& pm = part.visual;
  append(pm.origin, m.origin, o);
  append(pm.twin, m.twin, o);
  append(pm.planar, m.planar);
  append(pm.outgoing, m.outgoing, o);
  append(pm.texture, m.texture);
  append(pm.barrier, m.barrier);
  append(pm.rest, m.rest);
  append(pm.normal, m.normal);
  append(pm.free, m.free);
  append(pm.patch, m.patch, o);

  append(part.chain_pool, whole.chain_pool, o);
  append(part.free_pool, whole.free_pool, o);
  append(part.wall_edge, whole.wall_edge, o);
  append(part.wall_inner, whole.wall_inner, [&](const PoolRun& run) { return Offsets::shifted(run, o.wall_pool); });
  append(part.wall_pool, whole.wall_pool, o);
}

}  // namespace kerf
