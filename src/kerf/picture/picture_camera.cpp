#include "kerf/picture/picture_camera.h"

#include <cmath>

namespace kerf {
namespace {

constexpr double kMargin = 1.10;  // free space around the body

}  // namespace

std::pair<Vec3, Vec3> perpendicular(Vec3 w) {
  const Vec3 u = normalized(cross(std::abs(w.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, w));
  return {u, cross(w, u)};
}

PictureCamera fitted_camera(std::span<const Vec3> positions, const PictureOptions& options, int width, int height) {
  PictureCamera camera;
  camera.back = normalized(options.direction);
  Vec3 up = options.up;
  if (!(norm(cross(up, camera.back)) > 1e-9 * norm(up))) up = perpendicular(camera.back).first;
  camera.right = normalized(cross(up, camera.back));
  camera.up = cross(camera.back, camera.right);
  camera.half_width = 0.5 * width;
  camera.half_height = 0.5 * height;
  camera.focal = camera.half_height / std::tan(0.5 * options.field_of_view);
  const double tan_y = camera.half_height / camera.focal, tan_x = camera.half_width / camera.focal;
  Box3 box;
  for (Vec3 p : positions) box.add(p);
  Vec3 center = box.empty() ? Vec3{} : box.center();
  double distance = 1;
  for (int round = 0; round < 6; ++round) {  // distance for this centre, then the centre of what is seen
    distance = 1e-9;
    for (Vec3 p : positions) {
      const Vec3 d = p - center;
      const double z = dot(d, camera.back);
      distance =
          std::max({distance, z + std::abs(dot(d, camera.right)) / tan_x, z + std::abs(dot(d, camera.up)) / tan_y});
    }
    double low_x = 0, high_x = 0, low_y = 0, high_y = 0;
    for (Vec3 p : positions) {
      const Vec3 d = p - center;
      const double z = distance - dot(d, camera.back);
      const double x = dot(d, camera.right) / z, y = dot(d, camera.up) / z;
      low_x = std::min(low_x, x), high_x = std::max(high_x, x), low_y = std::min(low_y, y),
      high_y = std::max(high_y, y);
    }
    center += (0.5 * (low_x + high_x) * distance) * camera.right + (0.5 * (low_y + high_y) * distance) * camera.up;
  }
  camera.eye = center + (distance * kMargin / options.zoom) * camera.back;
  return camera;
}

}  // namespace kerf
