// Keeps the mechanical model of a body in step with its hexahedra: which elements there are, what they are made of, and
// what new nodes and elements inherit at a cut (4.2.1).
#pragma once

#include <span>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/lattice/hex_mesh.h"
#include "kerf/lattice/lattice_adapt.h"
#include "kerf/mechanics/step.h"
#include "kerf/scene/scene.h"
#include "kerf/session/held_material.h"
#include "kerf/session/node_memory.h"

namespace kerf {

/// Materials: for each body its own, then one per region in order.
struct BodyMaterials {
  std::vector<SceneRegion> regions;  ///< rest coordinates; a later one wins
  HeldRegions held;
  /// Index of the material at a rest position of a body.
  [[nodiscard]] std::int32_t at(Vec3 rest, std::int32_t body) const;
  /// Index of a body's material outside of all regions.
  [[nodiscard]] std::size_t of(std::int32_t body) const {
    return static_cast<std::size_t>(body) * (regions.size() + 1);
  }
};

/// The mechanical model with all materials and no elements yet. `bodies`: where one differs, body by body; none: one body.
/// Bad input: a material that can't be simulated.
Result<MechanicsModel> make_mechanics(const HexMesh& hex, const SceneMaterial& material, SceneFormulation formulation,
                                      BodyMaterials& materials, std::span<const SceneBodyMaterial> bodies = {});

/// Does a support hold some of this copy's material, or nodes of it?
bool is_held(const HexMesh& hex, const BodyMaterials& materials, const MechanicsModel& model, HexId copy);

/// Sets the element of one copy (or removes it, if it is dead or absorbed).
Status sync_hex(const HexMesh& hex, const BodyMaterials& materials, HexId id, MechanicsModel& model);

/// Those that have absorbed any of these copies, whose elements have their material, too. Ascending.
std::vector<HexId> hosts_of(const HexMesh& hex, std::span<const HexId> copies);

/// After a cut: new nodes and elements with what they inherit - position, velocity, offset, fixed flag, rotation - and changed
/// ones. A node that carries material of several old ones moves as most of it did;
/// the motion that it had goes to `old`.
Status sync_change(const HexMesh& hex, const BodyMaterials& materials, const LatticeChange& change,
                   MechanicsModel& model, MechanicsState& state, NodeFade& fade, std::vector<NodeMotion>& old);

/// Lets nodes that no element uses move with the body, where the mechanics leaves them behind: those of absorbed copies with
/// the copies that absorbed them, extrapolated; others with the nodes that were split off from
/// them or that they were split off from. Whoever uses such a node
/// again (after a later cut, or when a provisional tip is rolled back) or splits one off from it finds it where the material
/// is. Supports hold fixed ones still. After every step; linear. `carried` is memory.
void carry_unused_nodes(const HexMesh& hex, const MechanicsModel& model, MechanicsState& state,
                        std::vector<std::uint8_t>& carried);

/// Gives fixed nodes the velocity that their support prescribes, whoever moved them before.
void hold_fixed_nodes(const MechanicsModel& model, MechanicsState& state);

/// Makes the model match the hexahedra, comparing all of them. The state keeps its first node_count and hex_count entries;
/// new nodes have no offsets.
Status sync_all(const HexMesh& hex, const BodyMaterials& materials, MechanicsModel& model, MechanicsState& state);
/// The same after rolling back, undoing or redoing, where only these copies, and those that came or went, may differ. Ascending.
Status sync_copies(const HexMesh& hex, const BodyMaterials& materials, std::span<const HexId> changed,
                   MechanicsModel& model, MechanicsState& state);

/// How fast the body turns and deforms where it does so most: the greatest Frobenius norm of the rate of the deformation gradient in
/// a living copy, 1/s. Cost: every node, and every copy where nodes are fast enough against each other for `least` (1/s) to be reached.
double deformation_rate(const HexMesh& hex, std::span<const Vec3> velocities, double least);

/// A cut can leave slivers that weigh next to nothing. What a loose solve leaves undone there is a tiny force and a huge
/// velocity, which the next step takes for real. After a step: nodes under kLightNode of the mean mass are slowed
/// down to kLightSpeed times the fastest of the others, and a hundredth of a cell a step; their positions with them.
/// Momentum is kept to the same share. masses: kg per node, of the step. Linear.
void calm_light_nodes(const HexMesh& hex, std::span<const double> masses, double dt, MechanicsState& state);
inline constexpr double kLightNode = 1e-3;
inline constexpr double kLightSpeed = 10;

}  // namespace kerf
