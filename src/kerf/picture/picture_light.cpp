#include "kerf/picture/picture_light.h"

#include <algorithm>
#include <cmath>

#include "kerf/picture/picture_noise.h"
#include "kerf/picture/picture_raster.h"

namespace kerf {
namespace {

constexpr double kCreaseCosine = 0.64;  // 50 degrees: sharper edges stay sharp
constexpr double kExposure = 0.60;

using Triangle = std::array<std::int32_t, 3>;

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

/// What a mirror would show: a dark floor, a bright ceiling, a window behind the body.
Vec3 mirrored_light(Vec3 d, Vec3 window) {
  const Vec3 ceiling = Vec3{0.16, 0.155, 0.15} + smooth_step(-0.2, 0.9, d.z) * Vec3{0.50, 0.53, 0.57};
  return ceiling + (5.0 * smooth_step(0.90, 0.985, dot(d, window))) * Vec3{1.0, 1.02, 1.05};
}

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

double film(double x) {  // Narkowicz's fit of the ACES curve
  x = std::max(0.0, x * kExposure * 0.8);
  return std::clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}
std::uint8_t to_srgb(double x) {
  const double s = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::clamp(s * 255 + 0.5, 0.0, 255.0));
}

StageLights::StageLights(const PictureCamera& camera)
    : key(normalized(-0.62 * camera.right + 0.30 * camera.back + Vec3{0, 0, 1.0})),
      rim(normalized(0.75 * camera.right - 1.0 * camera.back + Vec3{0, 0, 0.9})),
      window(normalized(Vec3{-camera.back.x, -camera.back.y, camera.back.z} - 0.45 * camera.right + Vec3{0, 0, 0.12})) {
}

Vec3 StageLights::lit(const PictureSurface& s, Vec3 n, Vec3 view, double key_share, double sky) const {
  constexpr Vec3 kKeyColor{2.55, 2.42, 2.25}, kRimColor{0.85, 0.92, 1.05};
  const auto wrapped = [&](Vec3 l) { return std::max(0.0, (dot(n, l) + s.wrap) / ((1 + s.wrap) * (1 + s.wrap))); };
  const Vec3 skylight = sky * (Vec3{0.20, 0.205, 0.215} + (0.5 + 0.5 * n.z) * Vec3{0.36, 0.375, 0.40});
  Vec3 diffuse = (key_share * wrapped(key)) * kKeyColor + skylight + (0.35 * sky * wrapped(rim)) * kRimColor;
  Vec3 out{s.color.x * diffuse.x, s.color.y * diffuse.y, s.color.z * diffuse.z};
  const double shine = key_share * gloss_of_light(n, view, key, s.roughness, s.gloss);
  const double back = sky * gloss_of_light(n, view, rim, s.roughness, s.gloss);
  out += (3.0 * shine) * kKeyColor + (2.0 * back) * kRimColor;
  const Vec3 mirror = (2 * dot(n, view)) * n - view;
  const double fresnel = s.gloss + (1 - s.gloss) * std::pow(1 - std::clamp(dot(n, view), 0.0, 1.0), 5);
  return out + (sky * sky * fresnel * std::pow(1 - s.roughness, 2) * 2.2) * mirrored_light(mirror, window);
}

Vec3 backdrop(Look look, double y) {
  const Vec3 far = look == Look::kSheet ? Vec3{0.50, 0.52, 0.54} : Vec3{0.17, 0.185, 0.20};
  return (1.10 - 0.35 * y) * far;
}

}  // namespace kerf
