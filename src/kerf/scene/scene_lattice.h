// From the [lattice] of a scene to a lattice frame.
#pragma once

#include <optional>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/lattice/lattice_frame.h"
#include "kerf/mesh/models.h"
#include "kerf/scene/scene.h"

namespace kerf {

/// The lattice that SceneLattice asks for, around an uncut body. `hint`: what the model recommends, if there
/// is one. Bad input: what choose_lattice refuses. A given lattice that the body sticks out of, or whose cells it
/// fills less than kLeastFill of one, is refused too, with the sizes.
Result<LatticeFrame> scene_lattice(const SceneLattice& wanted, const std::optional<LatticeHint>& hint,
                                   const CollisionMesh& mesh);

}  // namespace kerf
