#include "kerf/cutting/joined_lips.h"

#include <algorithm>
#include <utility>

#include "kerf/cutting/tolerances.h"

namespace kerf {
namespace {

using V = CollisionVertex;

/// How much of a vertex a place of a face is; 0: it is not of the face.
double share_of(const CollisionMesh& mesh, V v, const RestPoint& p) {
  const CollisionHalfEdge h = CollisionMesh::corner(p.face, 0);
  const V corners[] = {mesh.from(h), mesh.to(h), mesh.apex(h)};
  for (std::size_t k = 0; k < 3; ++k)
    if (corners[k] == v) return weights_of(mesh, p)[k];
  return 0;
}

/// What of the way between its lips a vertex goes, so that the end of its cut comes as near to the edge as it can.
double fraction_of(const CellComplex& complex, const BladeFront& front, Vec3 way, const BladeEdge& edge,
                   std::span<const Vec3> position) {
  constexpr double kMiddle = 0.5;
  const CollisionMesh& mesh = complex.collision;
  RestPoint end = front.end;
  if (!find_face(mesh, end, front.start.vertex, cut::kPathOutside * complex.mean_root_edge)) return kMiddle;
  const Vec3 along = normalized(edge.tip - edge.base);
  const auto across = [&](Vec3 v) { return v - dot(v, along) * along; };
  const Vec3 goes = share_of(mesh, front.start.vertex, end) * across(way);
  if (!(dot(goes, goes) > 0)) return kMiddle;
  return std::clamp(dot(across(edge.base - place_of(mesh, end, position)), goes) / dot(goes, goes), 0.0, 1.0);
}

}  // namespace

std::vector<JoinedLips> find_joined_lips(const CollisionMesh& mesh, decltype(CollisionMesh::origin)::Mark origin,
                                         std::size_t vertices, std::span<const Vec3> position) {
  std::vector<std::pair<V, V>> twins;  // that stays and that goes
  mesh.origin.for_each_logged(origin, [&](CollisionHalfEdge h, V was) {
    const V is = mesh.origin[h];
    if (was.index() < vertices && is.index() >= vertices && mesh.rest[is] == mesh.rest[was])
      twins.emplace_back(was, is);
  });
  std::sort(twins.begin(), twins.end());
  twins.erase(std::unique(twins.begin(), twins.end()), twins.end());
  std::vector<JoinedLips> lips;
  for (auto first = twins.begin(); first != twins.end();) {
    const auto last = std::find_if(first, twins.end(), [&](const auto& t) { return t.first != first->first; });
    Vec3 sum;
    for (auto t = first; t != last; ++t) sum += position[t->second.index()];
    lips.push_back({first->first, (1.0 / static_cast<double>(last - first)) * sum});
    first = last;
  }
  return lips;
}

void place_joined_lips(const CellComplex& complex, std::span<const JoinedLips> lips, const BladeStroke& stroke,
                       std::span<Vec3> position) {
  for (const JoinedLips& l : lips) {
    const Vec3 way = l.other - position[l.vertex.index()];
    double fraction = 0.5;
    for (const BladeFront& f : stroke.ends)
      if (f.start.kind == CutStop::Kind::kVertex && f.start.vertex == l.vertex)
        fraction = fraction_of(complex, f, way, stroke.edge, position);
    position[l.vertex.index()] += fraction * way;
  }
}

}  // namespace kerf
