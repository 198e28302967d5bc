// Cutting along a polyline given in the rest configuration: for blades in the rest frame, one-cut commands and tests.
#pragma once

#include <span>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_options.h"
#include "kerf/cutting/cut_path.h"
#include "kerf/cutting/cut_scratch.h"

namespace kerf {

struct RestCut {
  int opened_edges = 0;   ///< collision edges that were opened
  int steps = 0;          ///< calls of advance_cut
  int ran_out = 0;        ///< times the path reached a border
  int entries = 0;        ///< times it entered over a border (the rim, a hole, the other lip of a slit)
  CollisionVertex tip;    ///< where the path ended inside the body; none if it ended outside
};

/// Cuts along the points (metres, rest frame, at least two; projected onto the collision mesh along its normal, segment
/// by segment). Points nearer than the path tolerance to the chord of their neighbours are skipped. Where the
/// path runs out it goes on from the next border that it enters over: across a slit, a hole, or back over the rim.
/// Error: bad points, a refused degenerate case; roll the journal back. Cost: local steps, but stabs and entries look
/// at every collision triangle.
Result<RestCut> cut_rest_polyline(CellComplex& body, std::span<const Vec3> points, const CutOptions& options,
                                  CutScratch& scratch);

/// The point of the collision mesh at rest that is nearest to p, and its distance in metres. Cost: every triangle.
FacePoint nearest_rest_point(const CellComplex& body, Vec3 p, double& distance);

}  // namespace kerf
