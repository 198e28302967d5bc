// How light leaves a surface, and what film makes of it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/picture/picture.h"

namespace kerf {

/// Three normals per triangle: smooth over neighbours of the same kind across edges that are not too sharp.
std::vector<std::array<Vec3, 3>> corner_normals(const PictureBody& body);

/// Light from l that shines to v (unit vectors), of a surface with normal n, as a share.
double gloss_of_light(Vec3 n, Vec3 v, Vec3 l, double roughness, double f0);

/// 0 to 1, still linear, of an amount of light.
double film(double x);
std::uint8_t to_srgb(double x);

}  // namespace kerf
