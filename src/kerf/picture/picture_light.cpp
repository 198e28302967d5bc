#include "kerf/picture/picture_light.h"

#include <algorithm>
#include <cmath>

#include "kerf/picture/picture_raster.h"

namespace kerf {
namespace {

constexpr double kCreaseCosine = 0.64;  // 50 degrees: sharper edges stay sharp
constexpr double kExposure = 0.60;

using Triangle = std::array<std::int32_t, 3>;

}  // namespace

std::vector<std::array<Vec3, 3>> corner_normals(const PictureBody& body) {
  const std::size_t n = body.triangles.size();
  std::vector<Vec3> face(n);  // length: twice the area
  std::vector<std::int32_t> first(body.positions.size() + 1, 0);
  for (std::size_t t = 0; t < n; ++t) {
    const Triangle& tri = body.triangles[t];
    face[t] = cross(body.positions[picture_index(tri[1])] - body.positions[picture_index(tri[0])],
                    body.positions[picture_index(tri[2])] - body.positions[picture_index(tri[0])]);
    for (std::int32_t v : tri) ++first[picture_index(v) + 1];
  }
  for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
  std::vector<std::int32_t> around(3 * n), next = first;
  for (std::size_t t = 0; t < n; ++t) {
    for (std::int32_t v : body.triangles[t])
      around[picture_index(next[picture_index(v)]++)] = static_cast<std::int32_t>(t);
  }
  std::vector<std::array<Vec3, 3>> out(n);
  for (std::size_t t = 0; t < n; ++t) {
    const Vec3 own = normalized(face[t]);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t v = body.triangles[t][k];
      Vec3 sum;
      for (std::int32_t i = first[picture_index(v)]; i < first[picture_index(v) + 1]; ++i) {
        const std::size_t other = picture_index(around[picture_index(i)]);
        if (!body.wall.empty() && body.wall[other] != body.wall[t]) continue;
        if (dot(normalized(face[other]), own) >= kCreaseCosine) sum += face[other];
      }
      out[t][k] = norm(sum) > 0 ? normalized(sum) : own;
    }
  }
  return out;
}

double gloss_of_light(Vec3 n, Vec3 v, Vec3 l, double roughness, double f0) {
  const Vec3 h = normalized(v + l);
  const double nl = dot(n, l), nv = std::max(1e-3, dot(n, v)), nh = dot(n, h), vh = std::max(0.0, dot(v, h));
  if (nl <= 0) return 0;
  const double a = roughness * roughness, a2 = a * a;
  const double d = a2 / (M_PI * std::pow(nh * nh * (a2 - 1) + 1, 2));
  const double k = (roughness + 1) * (roughness + 1) / 8;
  const double g = 1 / ((nl * (1 - k) + k) * (nv * (1 - k) + k));
  const double f = f0 + (1 - f0) * std::pow(1 - vh, 5);
  return 0.25 * d * g * f * nl;
}

double film(double x) {  // Narkowicz's fit of the ACES curve
  x = std::max(0.0, x * kExposure * 0.8);
  return std::clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}
std::uint8_t to_srgb(double x) {
  const double s = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::clamp(s * 255 + 0.5, 0.0, 255.0));
}

}  // namespace kerf
