// Is the body thin? Each test alone is fooled by something; together they are right on everything tried.
#pragma once

#include "kerf/midsurface/mid_sheet.h"
#include "kerf/midsurface/midsurface.h"

namespace kerf::mid {

/// Before there is a sheet: two sides at all, and the exact test of their topology. Appends reasons; true if the sheet can
/// be made.
bool judge_sides(const SurfaceMesh& work, const Pairing& pairing, const SideLabels& labels, const SurfaceMesh& plus,
                 const SurfaceMesh& minus, double thickness, MidsurfaceVerdict& verdict, std::vector<std::uint8_t>& flag);

/// Width over thickness, narrow parts, volume.
void judge_sheet(const MidSheet& sheet, const WorkingMesh& work, MidsurfaceVerdict& verdict);

}  // namespace kerf::mid
