// Which side of a thin body a point of its surface lies on: a field that is +1 on one side, -1 on the other, and passes
// zero in the middle of the rim.
#pragma once

#include "kerf/midsurface/pairing.h"

namespace kerf::mid {

struct SideLabels {
  Column<double> field;         ///< |V|, never 0
  Column<std::uint8_t> island;  ///< |V|: 1 where a small area was given the sign of what is around it
  double one_sided = 0;         ///< share of the confident pairs that join a side to itself
  int rounds = 0;
};

/// First guess: a maximum spanning forest of "same side" (neighbours) and "other side" (pairs) edges. Then the minimum of
/// sum cot |grad x|^2 + sum w (x - sign)^2 + sum w' (x + x opposite)^2 with the signs brought up to date in between. The
/// larger side becomes the + side. `progress` is asked before each minimum.
Result<SideLabels> label_sides(const SurfaceMesh& mesh, const Pairing& pairing, double thickness,
                               const Progress& progress = {});

/// Value at the centroid.
double field_at(const SurfaceMesh& mesh, const Column<double>& field, std::int32_t face);
/// Value at barycentric coordinates.
double field_at(const SurfaceMesh& mesh, const Column<double>& field, std::int32_t face,
                const std::array<double, 3>& barycentric);

}  // namespace kerf::mid
