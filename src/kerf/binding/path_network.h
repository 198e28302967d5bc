// The net of paths that divides the visual surface along the collision edges (4.1.2, 4.1.3).
//
// Paths are inserted one after another, and earlier ones are walls. Around every bound vertex the paths must end in the order
// of the collision edges, so each path starts and ends between the neighbours that are already there: no two paths can
// cross, and on a body of genus 0 every region ends up a disc.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/binding/bound_vertices.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/binding/split_surface.h"

namespace kerf {

struct PathNetwork {
  std::vector<std::int32_t> pool;             ///< inner visual vertices of all chains
  std::vector<std::array<PoolRun, 2>> chain;  ///< per collision half-edge and side, as CollisionMesh::chain
  int paths = 0;
  int rim_followed = 0;  ///< rim paths that follow the mid-surface because the shortest one left the rim
};

struct PathNetworkOptions {
  bool exact = false;  ///< exact geodesics instead of locally shortest paths
  std::function<void()> after_rim =
      {};  ///< called when the paths of a closed body's rim are in; may move the surface's vertices
  Progress progress = {};
  std::vector<CollisionVertex>* at_fault = nullptr;  ///< receives the ends of the edge that has no path
};

/// Finds a path for every collision edge and side, and re-meshes `surface` along it: rim first, then a spanning tree, then the
/// others, short ones first. Path edges become walls. Cost: the length of the paths, apart from the searches.
/// Fails, naming the collision edge, where earlier paths leave no way.
Result<PathNetwork> insert_paths(SplitSurface& surface, const CollisionMesh& collision, const BoundVertices& vertices,
                                 bool closed, const PathNetworkOptions& options);

/// Splits at its middle every edge that joins two vertices of one chain without being part of it: such an edge would be
/// flattened by the parametrisation (Floater, Math. Comp. 72, 2003). Returns how many.
int split_dividing_edges(SplitSurface& surface, const CollisionMesh& collision, const BoundVertices& vertices,
                         const PathNetwork& network);

}  // namespace kerf
