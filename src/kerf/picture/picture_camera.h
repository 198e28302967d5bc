// Where a picture is taken from.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/picture/picture.h"

namespace kerf {

/// A pinhole camera.
struct PictureCamera {
  Vec3 eye, right, up, back;
  double focal = 1;  ///< pixels
  double half_width = 0, half_height = 0;

  /// x, y in pixels from the top left, z the distance along the view; z <= 0 is behind the eye.
  [[nodiscard]] Vec3 project(Vec3 p) const {
    const Vec3 d = p - eye;
    const double z = -dot(d, back);
    const double s = focal / std::max(z, 1e-30);
    return {half_width + s * dot(d, right), half_height - s * dot(d, up), z};
  }
  [[nodiscard]] Vec3 ray(double x, double y) const {
    return normalized((x - half_width) * right + (half_height - y) * up - focal * back);
  }
};

/// Has all positions in a picture of so many pixels, with a margin. Zoomed in it comes closer to the first `of_body` of them: to their middle.
PictureCamera fitted_camera(std::span<const Vec3> positions, std::size_t of_body, const PictureOptions& options,
                            int width, int height);

/// Can pictures be taken from there? Bad input: numbers that are not finite or larger than 1e9, an eye at its target, up along the view, an
/// opening that is none.
Status check_view(const PictureView& view);

/// Of a view that check_view() takes.
PictureCamera camera_of(const PictureView& view, int width, int height);

/// The same camera as a view; its target is the point nearest to `middle`.
PictureView view_of(const PictureCamera& camera, Vec3 middle, double field_of_view);

/// Any two unit vectors at right angles to w and to each other.
std::pair<Vec3, Vec3> perpendicular(Vec3 w);

}  // namespace kerf
