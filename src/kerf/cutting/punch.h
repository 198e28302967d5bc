// A punch: a closed outline with a cutting edge all around, pressed through the body along its axis (paper 5.3).
//
// The outline is one stroke of a blade that stands along the axis and cuts every layer. Everything inside the outline comes loose, however
// much of it meets material: a loop inside the body, arcs from rim to rim, or over earlier bites, holes and slits.
#pragma once

#include <limits>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_options.h"

namespace kerf {

struct CutScratch;

struct Punch {
  Vec3 centre;           ///< metres, in the frame of the positions that it meets
  Vec3 axis{0, 0, 1};    ///< along which it is pressed; any length > 0
  Vec3 across{1, 0, 0};  ///< where the outline's x points; its part along the axis does not count
  double reach = std::numeric_limits<
      double>::infinity();    ///< metres from the centre, along the axis to both sides; material beyond stays whole
  std::vector<Vec2> outline;  ///< simple polygon around or beside the centre, metres, in either direction of turn
};

/// A circle's outline: a polygon with the circle's area that stays within `tolerance` (metres) of it, corners outside, sides inside; 8 to 200
/// corners. Radius in metres.
std::vector<Vec2> circle_outline(double radius, double tolerance);
/// Half a disc: the flat side on x = 0, the round one towards x > 0.
std::vector<Vec2> d_outline(double radius, double tolerance);

struct PunchCut {
  int opened_edges = 0;    ///< collision edges that were opened; 0: nothing to cut
  bool surrounds = false;  ///< nothing was opened, and material within reach lies inside the outline
  int retries = 0;         ///< times that the outline was moved by part of the minimum feature and cut again
  std::vector<CollisionTriangle> loose;  ///< the triangles that came loose; rising
  std::vector<CollisionHalfEdge> lips;   ///< new border half-edges on what stays; rising
  VisualVertex first_new;                ///< from here on the cut has made them
};

/// Cuts along the outline through every layer within reach. `position`: of every collision vertex, metres; those of
/// new vertices are appended.
/// Bad input: an outline that is no simple polygon, or too small for the minimum feature; an axis without direction; a
/// reach that leaves the edge no length; numbers that are not finite. Failure: what is inside the outline still hangs on (a surface that folds over itself on the
/// outline); roll the journal back. Cost: a look at every collision triangle, then local steps.
Result<PunchCut> cut_punch(CellComplex& body, std::vector<Vec3>& position, const Punch& punch,
                           const CutOptions& options, CutScratch& scratch);

}  // namespace kerf
