#include "kerf/picture/light_map.h"

#include <array>
#include <cmath>
#include <tuple>

#include "kerf/picture/picture_camera.h"
#include "kerf/picture/picture_raster.h"

namespace kerf {

LightMap::LightMap(const PictureBody& body, const Box3& box, Vec3 to_light, int resolution)
    : w_(to_light), n_(resolution) {
  std::tie(u_, v_) = perpendicular(w_);
  center_ = box.center();
  scale_ = 0.5 * n_ / (0.51 * box.diagonal() + 1e-30);
  depth_.assign(picture_index(n_) * picture_index(n_), -1e30f);
  for (const auto& t : body.triangles) {
    const Vec3 a = project(body.positions[picture_index(t[0])]), b = project(body.positions[picture_index(t[1])]),
               c = project(body.positions[picture_index(t[2])]);
    fill_triangle({a.x, a.y}, {b.x, b.y}, {c.x, c.y}, n_, 0, n_, [&](int x, int y, double wa, double wb, double wc) {
      float& d = depth_[picture_index(y) * picture_index(n_) + picture_index(x)];
      d = std::max(d, static_cast<float>(wa * a.z + wb * b.z + wc * c.z));
    });
  }
}

double LightMap::light(Vec3 p, double bias) const {
  const Vec3 q = project(p);
  const double x = q.x - 0.5, y = q.y - 0.5;
  if (!(x >= 0 && y >= 0 && x < n_ - 1 && y < n_ - 1)) return 1;
  const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
  const double u = x - std::floor(x), v = y - std::floor(y);
  const auto lit = [&](std::size_t a, std::size_t b) {
    return static_cast<double>(depth_[b * picture_index(n_) + a]) > q.z + bias ? 0.0 : 1.0;
  };
  return (1 - v) * ((1 - u) * lit(i, j) + u * lit(i + 1, j)) + v * ((1 - u) * lit(i, j + 1) + u * lit(i + 1, j + 1));
}

Vec3 LightMap::project(Vec3 p) const {
  const Vec3 d = p - center_;
  return {dot(d, u_) * scale_ + 0.5 * n_, dot(d, v_) * scale_ + 0.5 * n_, dot(d, w_)};
}

}  // namespace kerf
