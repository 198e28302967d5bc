// How the prism of a body moves with its hexahedra: offsets of its corners, and weights of points lifted off the mid-surface.
#pragma once

#include <array>
#include <span>

#include "kerf/contact/contact_surface.h"
#include "kerf/embedding/embedding.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

/// Weights of the 8 corners of a collision vertex's copy for the point position + lift offset of a contact. They add up to 1.
std::array<double, 8> lifted_weights(const HexMesh& hex, const Embedding& embedding, const ContactSurface& surface,
                                     CollisionVertex v, double lift);

/// Deformed offsets of all collision vertices: half of the way from the - corner of the prism to its + corner. nodes: |N|
/// positions, out: |V_c|, metres. Twins of a fresh cut get the same bits' worth: the lips' corners coincide.
void surface_offsets(const HexMesh& hex, const Embedding& embedding, const ContactSurface& surface,
                     std::span<const Vec3> nodes, std::span<Vec3> out);

}  // namespace kerf
