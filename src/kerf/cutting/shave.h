// Shaving the surface of a cut (paper 5.3, figure 24): where the shaver touches collision edges made by a cut, the walls that hang
// on them are smoothed around the parameters at which it meets them. No collision triangle is cut.
//
// Past the paper: where a wall is smooth, the collision vertices themselves move back into the material (slide_vertex.h), and those in
// front of them make way; both meshes, chains, lines and walls move with them.
#pragma once

#include <utility>
#include <vector>

#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_options.h"

namespace kerf {

struct CutScratch;

/// The cutting window of a shaver: everything within `radius` of a segment.
struct Shaver {
  Vec3 base, tip;     ///< metres, in the frame of the positions that it meets; may be the same point
  double radius = 0;  ///< metres, > 0
};

struct ShaveOptions {
  double smoothing = 0.5;  ///< part of a bump that one pass takes off where the shaver touches fully, 0 to 1
  double depth = 0;        ///< metres by which smooth edges move back in one pass where it touches fully; 0: walls only
  int moves = 0;  ///< about as many collision vertices are moved in one pass, so that it takes no longer; 0: all
  /// What the pass before had no time for: from `first` on, round to before `until` (none: to the end). The pass begins with them, and
  /// they go twice as far.
  CollisionVertex first, until;
};

struct ShavePass {
  int edges = 0;         ///< collision edges that the shaver meets
  int moved_back = 0;    ///< collision vertices that moved
  int stuck = 0;         ///< collision vertices that could not: at the end of a slit, or where nothing is left to take
  int turned = 0;        ///< visual edges; also for vertices that could not move in the end
  CollisionVertex left;  ///< the first vertex that is left for the next pass; none: all had their turn
  double removed = 0;    ///< m^3: by how much the enclosed volume fell
  double skin_area = 0;  ///< m^2: change of the skin's area
  double collision_area = 0;  ///< m^2: change of the collision mesh's area in its root planes
  std::vector<std::pair<RootId, double>>
      prisms;  ///< m^3: changes of the volumes of collision triangles' prisms, by root
  double roughness_before = 0, roughness_after = 0;  ///< metres: of the walls that it meets (wall_roughness)
  std::vector<WallId> walls;                         ///< that it meets; rising
  std::vector<VisualVertex> vertices;                ///< visual vertices that moved; rising
  std::vector<CollisionVertex> collision_vertices;   ///< collision vertices that moved; rising
};

/// One pass of the shaver over a closed body. `position`: of every collision vertex, metres; where an edge that moves back is
/// met far from its ends, it gets a vertex there, which is appended. Walls only lose material, and only
/// towards their smooth shape; no face of either mesh turns over in its plane. Journaled. Cost: a look at the box of every edge that is
/// cut, then what hangs on those that are met.
void shave(CellComplex& body, std::vector<Vec3>& position, const Shaver& shaver, const ShaveOptions& options,
           const CutOptions& cut_options, CutScratch& scratch, ShavePass& pass);

}  // namespace kerf
