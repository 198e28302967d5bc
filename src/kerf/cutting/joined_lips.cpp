#include "kerf/cutting/joined_lips.h"

#include <algorithm>
#include <utility>

namespace kerf {
namespace {

using V = CollisionVertex;

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

void place_joined_lips(std::span<const JoinedLips> lips, std::span<Vec3> position) {
  for (const JoinedLips& l : lips) position[l.vertex.index()] = 0.5 * (position[l.vertex.index()] + l.other);
}

}  // namespace kerf
