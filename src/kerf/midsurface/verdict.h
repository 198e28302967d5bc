// Is the body thin? Each test alone is fooled by something; together they are right on everything tried.
#pragma once

#include "kerf/midsurface/mid_sheet.h"
#include "kerf/midsurface/midsurface.h"

namespace kerf::mid {

/// What was found out about the sides of a body. `origin`: where the meshes' origin lies in the person's frame.
struct SidesFound {
  const WorkingMesh& work;
  const Pairing& pairing;
  const SideLabels& labels;
  const SurfaceMesh &plus, &minus;
  Vec3 origin;
};

/// Too little wider than thick to be cut as a sheet: that is the one reason to give.
bool is_stout(const MidsurfaceVerdict& verdict);

/// Before there is a sheet: two sides at all, and the exact test of their topology. Appends reasons, places (in the
/// person's frame) and flags (|F| of the working mesh); true if the sheet can be made.
bool judge_sides(const SidesFound& found, MidsurfaceVerdict& verdict, std::vector<std::uint8_t>& flag);

/// Width over thickness, narrow parts, volume. `bvh`: of the working mesh.
void judge_sheet(const MidSheet& sheet, const WorkingMesh& work, const TriangleBvh& bvh, Vec3 origin,
                 MidsurfaceVerdict& verdict);

}  // namespace kerf::mid
