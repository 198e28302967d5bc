#include "kerf/picture/picture_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

constexpr double kMargin = 1.10;                    // free space around the body
constexpr double kFarthest = 1e9;                   // m: a mesh is 1e6 m across at most
constexpr double kNearest = 1e-9;                   // m: a mesh is 1e-6 m across at least
constexpr double kParallel = 1e-6;                  // rad between up and the view
constexpr double kNarrowest = 0.02, kWidest = 2.5;  // rad, as the cameras of scenes

double largest(Vec3 v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Also of vectors whose square is no number; zero stays zero.
Vec3 unit(Vec3 v) {
  const double scale = largest(v);
  return scale > 0 ? normalized({v.x / scale, v.y / scale, v.z / scale}) : Vec3{};
}

}  // namespace

std::pair<Vec3, Vec3> perpendicular(Vec3 w) {
  const Vec3 u = normalized(cross(std::abs(w.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, w));
  return {u, cross(w, u)};
}

PictureCamera fitted_camera(std::span<const Vec3> positions, std::size_t of_body, const PictureOptions& options,
                            int width, int height) {
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
  if (options.zoom > 1) {
    Box3 body;
    for (const Vec3 p : positions.first(of_body)) body.add(p);
    // What lies beside it goes out of the picture twice as fast as it grows.
    if (!body.empty()) center = lerp(body.center(), center, 1 / (options.zoom * options.zoom));
  }
  camera.eye = center + (distance * kMargin / options.zoom) * camera.back;
  return camera;
}

Status check_view(const PictureView& view) {
  struct Place {
    const char* name;
    Vec3 value;
  };
  for (const Place& place : {Place{"eye", view.eye}, Place{"target", view.target}, Place{"up", view.up}}) {
    if (!is_finite(place.value)) return bad_input(fmt::format("{} must be finite", place.name));
    if (largest(place.value) > kFarthest)
      return bad_input(fmt::format("{} must be three numbers of at most {:g}", place.name, kFarthest));
  }
  const Vec3 way = view.target - view.eye;
  if (!(norm(way) >= kNearest))
    return bad_input(fmt::format("eye and target must be {:g} m apart or more; move one of them", kNearest));
  const Vec3 up = unit(view.up);
  if (!(norm(up) > 0)) return bad_input("up must not be zero; give it a direction");
  if (!(norm(cross(up, unit(way))) > kParallel))
    return bad_input("up must not be along the view from eye to target; give it another direction");
  if (!(view.field_of_view >= kNarrowest && view.field_of_view <= kWidest))
    return bad_input(
        fmt::format("field_of_view must be {:g} to {:g} radians, not {:g}", kNarrowest, kWidest, view.field_of_view));
  return {};
}

PictureCamera camera_of(const PictureView& view, int width, int height) {
  PictureCamera camera;
  camera.eye = view.eye;
  camera.back = unit(view.eye - view.target);
  camera.right = normalized(cross(unit(view.up), camera.back));
  camera.up = cross(camera.back, camera.right);
  camera.half_width = 0.5 * width;
  camera.half_height = 0.5 * height;
  camera.focal = camera.half_height / std::tan(0.5 * view.field_of_view);
  return camera;
}

PictureView view_of(const PictureCamera& camera, Vec3 middle, double field_of_view) {
  const double distance = std::max(kNearest, dot(camera.eye - middle, camera.back));
  return {camera.eye, camera.eye - distance * camera.back, camera.up, field_of_view};
}

}  // namespace kerf
