// The meshes of a body as plain triangle surfaces, for files and pictures.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "kerf/binding/cell_complex.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// Groups of visual_surface(): the skin, and the walls that cuts made.
inline constexpr std::int32_t kSkinGroup = 0;
inline constexpr std::int32_t kCutGroup = 1;
/// Their names in files.
std::vector<std::string> surface_group_names();

/// The visual mesh with texture coordinates and groups. positions: one per visual vertex, metres; empty for the rest
/// configuration. Vertex and triangle ids are those of the complex.
TriangleMesh visual_surface(const CellComplex& complex, std::span<const Vec3> positions = {});

/// The collision mesh. positions: one per collision vertex, metres; empty for the rest configuration.
TriangleMesh collision_surface(const CellComplex& complex, std::span<const Vec3> positions = {});

}  // namespace kerf
