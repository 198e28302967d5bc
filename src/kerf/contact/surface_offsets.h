// How the prism of a body moves with its hexahedra: offsets of its corners.
#pragma once

#include <span>

#include "kerf/contact/contact_surface.h"
#include "kerf/embedding/embedding.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

/// Deformed offsets of all collision vertices: half of the way from the - corner of the prism to its + corner. nodes: |N|
/// positions, out: |V_c|, metres. Twins of a fresh cut get the same bits' worth: the lips' corners coincide.
void surface_offsets(const HexMesh& hex, const Embedding& embedding, const ContactSurface& surface,
                     std::span<const Vec3> nodes, std::span<Vec3> out);

}  // namespace kerf
