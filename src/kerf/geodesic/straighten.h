// The shortest path within a strip, and moving the strip until the path is locally shortest on the surface (4.1.2).
//
// The strip is unfolded into the plane, a funnel (Lee and Preparata 1984) pulls the path tight, and wherever it bends
// around a vertex whose other side is smaller than pi, the strip moves to that side. Every move shortens the path.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kerf/geodesic/path_query.h"
#include "kerf/geodesic/strip.h"

namespace kerf {

/// A bend of the pulled path: it turns around `vertex`, an end of the crossings first .. last of the strip.
struct Bend {
  Vec2 at;
  std::int32_t vertex = -1;
  std::int32_t first = 0, last = 0;
  bool left = false;
};

struct Straightener {
  // The unfolded strip: both ends of every crossing, and where s and t come to lie.
  std::vector<Vec2> left, right;
  Vec2 s, t;
  std::vector<Bend> bends;
  double length = 0;

  struct FunnelPoint {
    Vec2 at;
    std::int32_t crossing;
  };
  std::vector<FunnelPoint> left_chain, right_chain;
  Strip next_strip, way;
  SparseIndex faces;
};

/// Unfolds a strip that is not empty and pulls the path tight: fills the unfolding, bends and length.
void pull_tight(const PathQuery& query, const Strip& strip, Straightener& scratch);

/// Moves the strip until no bend can be moved with a gain; the unfolding, bends and length are then those of `strip`.
/// Time per round proportional to the strip.
void straighten(const PathQuery& query, Strip& strip, Straightener& scratch);

/// The stops of a pulled path. Bends around wall vertices become crossings close to them.
void write_stops(const PathQuery& query, const Strip& strip, const Straightener& pulled, SurfacePath& path);

}  // namespace kerf
