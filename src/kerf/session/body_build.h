// From a bound body to a body at run time: hexahedra, embeddings, the surface as it is drawn.
#pragma once

#include <optional>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/mesh/models.h"
#include "kerf/scene/scene.h"
#include "kerf/session/body.h"

namespace kerf {

/// Refuses what build_lattice refuses.
Result<Body> build_body(CellComplex bound, std::vector<LatticeBody> bodies, const Progress& progress = {});
/// One body. hint: the lattice that a model recommends. Refuses what scene_lattice and build_lattice refuse.
Result<Body> build_body(CellComplex bound, const SceneLattice& lattice, const std::optional<LatticeHint>& hint,
                        const Progress& progress = {});

/// m^3 at rest: what the visual mesh encloses; of an open sheet, area times thickness.
double body_volume(const CellComplex& complex);

}  // namespace kerf
