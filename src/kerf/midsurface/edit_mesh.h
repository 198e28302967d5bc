// Collapse, flip and split on a SurfaceMesh. Each keeps the topology, an oriented manifold with border.
#pragma once

#include "kerf/midsurface/surface_mesh.h"

namespace kerf::mid {

/// Scratch for the link condition; one for each mesh that is edited.
struct LinkScratch {
  Column<std::int32_t> mark;  ///< |V|
  std::int32_t stamp = 0;
};

/// May from(h) and to(h) become one vertex? No where the surface would be pinched, a border loop would get fewer than
/// four edges, or an inner edge joins two border vertices.
[[nodiscard]] bool can_collapse(const SurfaceMesh& mesh, std::int32_t h, LinkScratch& scratch);
/// from(h) goes, to(h) stays where it is; the faces at h are removed.
void collapse(SurfaceMesh& mesh, std::int32_t h);

/// Is there no edge yet between the apexes of inner edge h?
[[nodiscard]] bool can_flip(const SurfaceMesh& mesh, std::int32_t h);
/// Turns inner edge h, so that it joins the two apexes; keeps both faces' numbers.
void flip(SurfaceMesh& mesh, std::int32_t h);

/// A new vertex at `place` on edge h; returns it. Half-edge h then ends there. New faces come at the end.
std::int32_t split(SurfaceMesh& mesh, std::int32_t h, Vec3 place);

}  // namespace kerf::mid
