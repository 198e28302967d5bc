// The regions between the paths (4.1.3): one per collision triangle and side.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/binding/path_network.h"

namespace kerf {

struct PatchMap {
  std::vector<std::int32_t> label;  ///< |F visual|: 2 collision triangle + side (Patch::value)
  std::vector<std::int32_t> first;  ///< faces of patch p: faces[first[p]] .. faces[first[p + 1]]; 2 |F collision| + 1
  std::vector<std::int32_t> faces;  ///< ascending in each patch
};

/// Fills the regions from their walls and verifies each: V - E + F = 1, bounded by exactly the three chains of its collision
/// triangle, in order, each once: a disc. Every face and every wall vertex must belong. Linear time. Fails, naming the
/// collision triangle and side.
Result<PatchMap> find_patches(const SplitSurface& surface, const CollisionMesh& collision,
                              const BoundVertices& vertices, const PathNetwork& network, bool closed,
                              std::vector<CollisionVertex>* at_fault = nullptr);

}  // namespace kerf
