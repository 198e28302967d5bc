// How many borders a cut body has.
#pragma once

#include <cstdint>
#include <map>

#include "kerf/session/body.h"
#include "kerf/session/session.h"

namespace kerf::test {

/// Loops of edges with one triangle: a slit that reaches the rim is part of the rim's loop.
inline int border_loops(const Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  std::map<std::uint32_t, std::uint32_t> next;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count()))
    if (mesh.is_border(h)) next[mesh.from(h).value] = mesh.to(h).value;
  int loops = 0;
  for (; !next.empty(); ++loops)
    for (auto at = next.begin(); at != next.end();) {
      const std::uint32_t to = at->second;
      next.erase(at);
      at = next.find(to);
    }
  return loops;
}

}  // namespace kerf::test
