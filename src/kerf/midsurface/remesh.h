// A coarse mesh with well-shaped triangles on a dense sheet: collapse, flip, split and smooth (Botsch and Kobbelt 2004),
// with lengths counted in wanted sizes, borders that slide on their curves and guards against jumps between layers.
#pragma once

#include "kerf/midsurface/border_curve.h"
#include "kerf/midsurface/sheet_sizes.h"
#include "kerf/spatial/bvh.h"

namespace kerf::mid {

struct CoarseMesh {
  SurfaceMesh mesh;
  Column<Vec3> normal;            ///< |V|, of the sheet
  Column<double> half_thickness;  ///< |V|, of the sheet, metres
  Column<double> size;            ///< |V|, wanted edge length, metres
  Column<std::int32_t> curve;     ///< |V|: border curve, or -1
  Column<double> along;           ///< |V|: metres along it
  Column<std::uint8_t> fixed;     ///< |V|: corners of the border
};

/// The sheet and what is needed to ask it for closest points.
class SheetSampler {
 public:
  /// Refers to the sheet.
  explicit SheetSampler(const MidSheet& sheet);

  struct Sample {
    Vec3 point, normal;
    double half_thickness = 0, size = 0, distance = HUGE_VAL;
    bool trusted = false;  ///< away from the rim, where rays mean something
  };
  /// Closest point on the layer that looks the same way as `normal`. size: |V| of the sheet.
  [[nodiscard]] Sample closest(Vec3 p, Vec3 normal, const Column<double>& size) const;

  [[nodiscard]] const MidSheet& sheet() const { return sheet_; }
  [[nodiscard]] const std::vector<BorderCurve>& curves() const { return curves_; }
  [[nodiscard]] const std::vector<std::vector<std::int32_t>>& loops() const { return loops_; }

 private:
  const MidSheet& sheet_;
  TriangleView view_;
  TriangleBvh bvh_;
  Column<Vec3> face_normal_;
  std::vector<std::vector<std::int32_t>> loops_;
  std::vector<BorderCurve> curves_;
};

/// About `target` triangles (within 3 % where the shape lets it).
CoarseMesh remesh(const SheetSampler& sheet, const SheetSizes& sizes, double target);

/// Flips every inner edge that makes the smaller angle at it larger and does not fold the surface.
void flip_for_angles(CoarseMesh& mesh);

}  // namespace kerf::mid
