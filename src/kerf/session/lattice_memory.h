// What the hexahedra of a body will take of memory: asked for before any is made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "kerf/base/result.h"
#include "kerf/lattice/lattice_frame.h"
#include "kerf/scene/scene.h"

namespace kerf {

struct LatticeMemory {
  std::size_t cells = 0;      ///< of the box
  std::size_t hexahedra = 0;  ///< about
  std::uint64_t bytes = 0;    ///< with their nodes, matrices, the solver, and a copy of the state
};

/// An estimate, up to twice too much for bodies of one layer that lie in lattice planes. Cost: linear in collision triangles.
LatticeMemory lattice_memory(const CollisionMesh& mesh, const LatticeFrame& frame, ScenePreconditioner preconditioner);

/// Bad input where the models whose triangles the scene counts need more than memory_limit() together, with the line of the largest.
Status check_model_memory(const Scene& scene);

struct BodyMemory {
  LatticeFrame frame;
  LatticeMemory need;
};

/// Bad input where the bodies need more than memory_limit() together, with line, the numbers of the one that needs most, and the way
/// out.
Status check_lattice_memory(const Scene& scene, std::span<const BodyMemory> bodies);

/// What is said where memory ends while the bodies of a scene are made: the cells of the one that needs most, or, while none has any yet,
/// the body.
std::string lack_of_memory(const Scene& scene, std::span<const BodyMemory> bodies);

}  // namespace kerf
