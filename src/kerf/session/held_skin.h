// Surface vertices of held material. Nodes of their cells move where a border crosses a cell, or one beside it; held material does not:
//
//     held      :  free
//     x----x----:----x----x     x  surface vertices at rest
//     o----------------o        o  nodes: both move with what is free
//               :
//
// Whoever shows, touches or holds such a vertex finds it at its place at rest.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/mechanics/mechanics_model.h"
#include "kerf/session/body.h"
#include "kerf/session/fading_vertex.h"
#include "kerf/session/held_material.h"

namespace kerf {

/// Collision vertices in held material whose copies have nodes that are not fixed, ascending. Empty where no border crosses material. Cost: cells that a
/// border crosses, and a look at each collision vertex.
void find_held_vertices(const Body& body, const HeldRegions& held, const MechanicsModel& model,
                        std::vector<CollisionVertex>& out);
/// The same of visual vertices. Cost: a look at each collision triangle, and at the visual vertices of those near a border.
void find_held_vertices(const Body& body, const HeldRegions& held, const MechanicsModel& model,
                        std::vector<VisualVertex>& out);

/// Nodes as they are shown, |N|: m and m/s.
struct ShownNodes {
  std::span<const Vec3> positions, velocities;
};
/// What takes vertices from where nodes put them to where they are held, and stops them, in place of what `fades` at them. Lists ascend.
void add_held(const Body& body, ShownNodes nodes, std::span<const VisualVertex> held,
              std::span<const FadingVertex> fades, std::vector<FadingVertex>& out);
void add_held(const Body& body, ShownNodes nodes, std::span<const CollisionVertex> held,
              std::span<const FadingVertex> fades, std::vector<FadingVertex>& out);

}  // namespace kerf
