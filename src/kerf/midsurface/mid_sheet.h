// The mid-surface as a dense sheet: the + side of the surface moved half-way to the - side, its border the middle of the
// rim. The remesher samples it.
#pragma once

#include "kerf/midsurface/side_cut.h"
#include "kerf/midsurface/side_labels.h"
#include "kerf/midsurface/working_mesh.h"

namespace kerf::mid {

struct MidSheet {
  SurfaceMesh mesh;               ///< the sheet of side_cut, moved
  Column<Vec3> normal;            ///< |V|, unit, smooth, towards the + side
  Column<double> half_thickness;  ///< |V|, metres; on the border as nearby
  Column<double> from_border;     ///< |V|, metres along edges, HUGE_VAL on a surface without border
  Column<std::uint8_t> trusted;   ///< |V|: away from the rim, where normals mean something
};

struct SheetInput {
  const WorkingMesh& work;
  const TriangleBvh& bvh;  ///< of the working mesh
  const Pairing& pairing;
  const SideLabels& labels;
};

/// Displacements are smoothed over the sheet from confident pairs, zero on the border; then twice corrected by rays along
/// smooth normals to both sides. `side` is the + sheet of cut_side.
MidSheet make_mid_sheet(SideSheet side, const SheetInput& in);

/// Shortest ways along edges from any border vertex, |V|.
Column<double> distance_from_border(const SurfaceMesh& mesh);

/// For every vertex the nearest trusted one along edges; -1 where none can be reached.
Column<std::int32_t> nearest_trusted(const SurfaceMesh& mesh, const Column<std::uint8_t>& trusted);

}  // namespace kerf::mid
