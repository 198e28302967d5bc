// The flanks and the back of a blade in the slit that its edge has cut.
//
// The blade is in the material, so its nearest surface says nothing. A lip touches the flank that its material lies behind: the
// direction from its rim into the material says which, however deep it is, and never flips. The lips start out together, nearer
// than the blade is thick: they are opened slowly, as far as the body lets them come apart. Ahead of where the blade is as
// thick as it gets, it is a wedge; around the edge itself, where uncut material begins, nothing touches. The end of the slit
// behind the blade touches its back, and the end ahead does not come past the edge uncut. They slide without friction: what drags along a blade in its slit is the resistance to cutting.
#pragma once

#include <vector>

#include "kerf/contact/detect.h"

namespace kerf {

/// A blade in the frame of its tool: the edge from (0, 0, 0) to (0, 0, length), facing +x, its back at x = -width.
struct Blade {
  const RigidShape* shape = nullptr;  ///< its frame and motion; parts do not matter
  std::int32_t tool = 0;
  double length = 0, width = 0, thickness = 0;  ///< m
  double stray = 0;                             ///< m: a cut may run this far beside the blade's plane
  double margin = 0;                            ///< m: what is farther from touching is left out, but for its motion
  double speed = 0;                             ///< m/s: of any of its points, at most
  double step = 1e-3;                           ///< h, s
};

/// A vertex of a rim beside the blade.
struct SlitVertex {
  CollisionVertex vertex;
  int side = 0;            ///< 1: its material lies towards +y of the blade, -1: -y; 0: both (a slit that turns back)
  int end = 0;             ///< of the slit: -1 behind the blade, both lips lead forward from it, 1 ahead
  Vec3 local, offset;      ///< m, in the blade's frame; offset to the + corner
  CollisionVertex facing;  ///< the nearest one of the other lip at rest; none
  double freedom = 1;      ///< 0: the two can't come apart, 1: they can. Whoever knows what carries them fills it in
  RememberedRim known;
};
struct SlitEdge {
  CollisionHalfEdge edge;
  std::int32_t from = 0, to = 0;  ///< numbers of its ends in Slit::vertices
  int side = 0;
  /// m, in the blade's frame: from a tip to where this lip has it, at each end. Whoever knows what carries them fills it in.
  Vec3 from_shift, to_shift;
};
struct Slit {
  std::vector<SlitVertex> vertices;  ///< by id
  std::vector<SlitEdge> edges;
};

/// The lips beside a blade. O(edges of the body's rims).
void find_slit(const SurfaceState& body, const Blade& blade, const DetectMemory& memory, Slit& slit);

/// Appends the contacts of a blade with its slit, in any order; what they are to be known by goes to the memory.
void detect_flanks(const SurfaceState& body, const Blade& blade, Slit& slit, DetectMemory& memory,
                   std::vector<Contact>& contacts);

}  // namespace kerf
