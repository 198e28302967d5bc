// How light leaves a surface, and what film makes of it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/picture/picture.h"
#include "kerf/picture/picture_camera.h"
#include "kerf/picture/picture_material.h"

namespace kerf {

/// Three normals per triangle: smooth over neighbours of the same kind across edges that are not too sharp.
std::vector<std::array<Vec3, 3>> corner_normals(const PictureBody& body);

/// The lights of a stage; they go with the camera.
struct StageLights {
  Vec3 key, rim, window;  ///< unit, to the light

  StageLights() = default;
  explicit StageLights(const PictureCamera& camera);
  /// What shines to `view` (unit) from a surface with normal n that these shares of key light and sky reach.
  [[nodiscard]] Vec3 lit(const PictureSurface& s, Vec3 n, Vec3 view, double key_share, double sky) const;
};

/// Behind everything; y: 0 at the top of the picture, 1 at its foot.
Vec3 backdrop(Look look, double y);

/// 0 to 1, still linear, of an amount of light.
double film(double x);
std::uint8_t to_srgb(double x);

}  // namespace kerf
