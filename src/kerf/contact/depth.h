// How deep points of a body are in its material, seen from outside.
//
// Detection chooses contacts by rules (who lies beside whom, what was seen coming), and what the rules don't know is no contact. This knows
// none of them: material is where the prisms are, and a point's depth is its least way out through a face or the wall over a border.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/contact/contact.h"
#include "kerf/contact/detect.h"
#include "kerf/contact/rest_neighbours.h"

namespace kerf {

/// Memory of searches in one body; nothing in it is state.
struct DepthSearch {
  struct Deep {
    SurfacePoint point;
    double depth = 0;  ///< m
    WayOut out;
  };
  std::vector<Deep> deep;  ///< what find_deep_walls() found
  // Private.
  TreeBoxes boxes;
  double reach = 0;  ///< m: of prisms around their mid-surface
  std::vector<std::uint32_t> stack;
  std::vector<CollisionTriangle> near;
  NeighbourSearch neighbours;
};

/// m: where a vertex is, lifted off the mid-surface (SurfacePoint::lift).
inline Vec3 lifted_corner(const SurfaceState& body, CollisionVertex v, double lift) {
  return body.position[v.index()] + lift * body.offset[v.index()];
}
/// m: where a point of the body is.
Vec3 place_of(const SurfaceState& body, const SurfacePoint& point);

/// Where the body is now, for the calls below. O(n).
void prepare_depths(const SurfaceState& body, DepthSearch& search);

/// m that a point of the body is deep in what is not neighbour to it; 0: in nothing, or not deeper than `least`.
double depth_of(const SurfaceState& body, const SurfacePoint& point, double least, DepthSearch& search);

/// Points of the walls that cuts have left (8 x 5 on each, and the middle of what its five lines have in a face's prism) that are deeper than `least`
/// metres. Walls with nothing near cost a look into the tree.
void find_deep_walls(const SurfaceState& body, double least, DepthSearch& search);

}  // namespace kerf
