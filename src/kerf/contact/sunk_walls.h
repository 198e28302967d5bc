// Walls of cuts that sank into material where detection knows of no contact: held from then on by a contact of their own.
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

/// Remembers what find_deep_walls() found, places of a wall that are near each other once.
void remember_sunk_walls(const ContactSurface& surface, std::span<const DepthSearch::Deep> deep, DetectMemory& memory);

/// Adds the contacts of walls that are remembered, sorted by key with the others, and forgets those that are farther away than `margin` (m), beside what
/// held them, or no walls any more. Faces and borders are those of now: forget all of them when a cut has changed these. O(walls remembered).
void add_sunk_walls(const SurfaceState& body, double margin, double friction, DetectMemory& memory, std::vector<Contact>& contacts);

}  // namespace kerf
