// How good an automatic collision mesh is.
#pragma once

#include "kerf/midsurface/midsurface.h"
#include "kerf/midsurface/remesh.h"
#include "kerf/midsurface/side_labels.h"

namespace kerf::mid {

struct QualityInput {
  const SurfaceMesh& work;
  const TriangleBvh& bvh;  ///< of work
  const SideLabels& labels;
  const std::vector<Vec3>& visual;  ///< its vertices
};

/// Everything but `need` and `good_rays`.
MidsurfaceQuality measure_quality(const CoarseMesh& mesh, const QualityInput& in);

/// The closed surface of the prisms: corners at position +- normal x half thickness, walls along the border.
TriangleMesh prism_surface(const SurfaceMesh& mesh, const Column<double>& half_thickness);

}  // namespace kerf::mid
