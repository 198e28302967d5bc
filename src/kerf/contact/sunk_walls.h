// Walls of cuts that have sunk into material in spite of all contacts that detection has found: held from then on by contacts of their own.
//
// Detection chooses contacts by rules; rims that twist while they pass each other find gaps in any rules. What then comes to lie in material is
// seen from outside (depth.h), and goes out again the way it came in.
#pragma once

#include <span>
#include <vector>

#include "kerf/contact/contact.h"
#include "kerf/contact/depth.h"
#include "kerf/contact/detect.h"

namespace kerf {

/// Remembers what find_deep_walls() found: of places at the same rim of a wall that are near each other the deepest.
void remember_sunk_walls(const ContactSurface& surface, std::span<const DepthSearch::Deep> deep, DetectMemory& memory);

/// Forgets what stands on triangles that a cut has changed (ascending), or goes out through them.
void forget_sunk_walls(const ContactSurface& surface, std::span<const CollisionTriangle> changed, DetectMemory& memory);

/// Adds the contacts of walls that are remembered, sorted by key with the others, and forgets those that are farther away than `margin` (m), beside what
/// held them, too deep to be held, or no walls any more. O(walls remembered).
void add_sunk_walls(const SurfaceState& body, double margin, double friction, DetectMemory& memory,
                    std::vector<Contact>& contacts);

}  // namespace kerf
