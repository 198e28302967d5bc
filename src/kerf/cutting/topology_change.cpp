#include "kerf/cutting/topology_change.h"

#include <algorithm>

#include "kerf/base/indexed.h"
#include "kerf/cutting/half_edge_split.h"

namespace kerf {

namespace {

/// Calls visit(array, number) for every journaled array, const.
template <class Fn>
void visit_arrays(const CellComplex& body, Fn&& visit) {
  // for_each_array only hands out references; nothing is written here.
  std::size_t number = 0;
  const_cast<CellComplex&>(body).for_each_array([&](const auto& array) { visit(array, number++); });
}

/// Number of an array in the order of for_each_array.
std::size_t number_of(const CellComplex& body, const void* which) {
  std::size_t found = 0;
  visit_arrays(body, [&](const auto& array, std::size_t number) {
    if (static_cast<const void*>(&array) == which) found = number;
  });
  return found;
}

template <class Array>
struct IdOf;
template <class Id, class T>
struct IdOf<Journaled<Id, T>> {
  using type = Id;
};

/// A journal mark or a finished step: for an array, the size it had and the indices written to since.
struct SinceMark {
  const CellComplex& body;
  const JournalMark& mark;
  template <class Array>
  std::size_t size(const Array& array) const {
    return mark.arrays[number_of(body, &array)].first;
  }
  template <class Array, class Fn>
  void for_each(const Array& array, Fn&& f) const {
    const auto& m = mark.arrays[number_of(body, &array)];
    array.for_each_changed({m.first, m.second}, f);
  }
};
struct SinceStep {
  const CellComplex& body;
  const JournalStep& step;
  template <class Array>
  std::size_t size(const Array& array) const {
    return std::min(array.size(), step.arrays[number_of(body, &array)].base_size);
  }
  template <class Array, class Fn>
  void for_each(const Array& array, Fn&& f) const {
    using Id = typename IdOf<Array>::type;
    for (const std::uint32_t i : step.arrays[number_of(body, &array)].indices)
      if (i < array.size()) f(Id(static_cast<std::size_t>(i)));
  }
};

template <class Since, class Touch>
void for_each_changed_triangle(const CellComplex& body, const Since& since, Touch&& touch) {
  const CollisionMesh& mesh = body.collision;
  const auto half_edge = [&](CollisionHalfEdge h) { touch(CollisionMesh::face(h)); };
  since.for_each(mesh.origin, half_edge);
  since.for_each(mesh.twin, half_edge);
  since.for_each(mesh.planar, half_edge);
  since.for_each(mesh.chain, half_edge);
  since.for_each(mesh.wall, half_edge);
  since.for_each(mesh.root, touch);
  since.for_each(mesh.free, touch);
  const auto vertex = [&](CollisionVertex v) {
    cut::for_each_corner(mesh, v, [&](CollisionHalfEdge h) {
      touch(CollisionMesh::face(h));
      return true;
    });
  };
  since.for_each(mesh.line, vertex);
  since.for_each(mesh.bound, vertex);
  const auto wall = [&](WallId w) { touch(CollisionMesh::face(body.wall_edge[w])); };
  since.for_each(body.wall_edge, wall);
  since.for_each(body.wall_inner, wall);
  for (std::size_t f = since.size(mesh.root); f < mesh.face_count(); ++f) touch(CollisionTriangle(f));
}

template <class Since>
void collect(const CellComplex& body, const Since& since, const CutScratch& scratch, TopologyChange& change) {
  const CollisionMesh& mesh = body.collision;
  const VisualMesh& fine = body.visual;
  ++change.round;
  const auto first_time = [&](std::vector<std::uint32_t>& seen, std::size_t i) {
    if (seen.size() <= i) seen.resize(std::max(i + 1, 2 * seen.size()), 0);
    if (seen[i] == change.round) return false;
    seen[i] = change.round;
    return true;
  };
  change.triangles.clear();
  for_each_changed_triangle(body, since, [&](CollisionTriangle f) {
    if (first_time(change.seen_triangle, f.index())) change.triangles.push_back(f);
  });
  std::sort(change.triangles.begin(), change.triangles.end());

  change.first_new_collision_vertex = CollisionVertex(since.size(mesh.outgoing));
  change.first_new_collision_triangle = CollisionTriangle(since.size(mesh.root));
  change.first_new_visual_vertex = VisualVertex(since.size(fine.outgoing));
  change.first_new_visual_triangle = VisualTriangle(since.size(fine.patch));
  change.first_new_wall = WallId(since.size(body.wall_edge));
  change.births.clear();
  auto birth = std::lower_bound(scratch.births.begin(), scratch.births.end(), change.first_new_collision_vertex,
                                [](const VertexBirth& b, CollisionVertex v) { return b.vertex < v; });
  for (; birth != scratch.births.end() && birth->vertex.index() < mesh.vertex_count(); ++birth)
    change.births.push_back(*birth);

  change.visual_triangles.clear();
  const auto face = [&](VisualTriangle f) {
    if (f < change.first_new_visual_triangle && first_time(change.seen_visual_triangle, f.index()))
      change.visual_triangles.push_back(f);
  };
  const auto half_edge = [&](VisualHalfEdge h) { face(VisualMesh::face(h)); };
  since.for_each(fine.origin, half_edge);
  since.for_each(fine.texture, half_edge);
  since.for_each(fine.patch, face);
  std::sort(change.visual_triangles.begin(), change.visual_triangles.end());
}

}  // namespace

void collect_topology_change(const CellComplex& body, const JournalMark& since, const CutScratch& scratch,
                             TopologyChange& change) {
  collect(body, SinceMark{body, since}, scratch, change);
}

void collect_topology_change(const CellComplex& body, const JournalStep& step, const CutScratch& scratch,
                             TopologyChange& change) {
  collect(body, SinceStep{body, step}, scratch, change);
}

std::vector<CollisionTriangle> changed_triangles(const CellComplex& body, const JournalMark& since) {
  std::vector<CollisionTriangle> result;
  for_each_changed_triangle(body, SinceMark{body, since}, [&](CollisionTriangle f) { result.push_back(f); });
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace kerf
