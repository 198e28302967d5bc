#include "kerf/mesh/polygon_faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/mesh/mesh_limits.h"

namespace kerf {
namespace {

double orient(Vec2 a, Vec2 b, Vec2 c) { return cross(b - a, c - a); }

/// Of a face, its length twice the area.
Vec3 normal_of(std::span<const Vec3> p) {
  Vec3 normal;
  for (std::size_t i = 2; i < p.size(); ++i) normal += cross(p[i - 1] - p[0], p[i] - p[0]);
  return normal;
}

bool fan_covers(std::span<const Vec3> p, Vec3 normal) {
  for (std::size_t i = 2; i < p.size(); ++i)
    if (dot(cross(p[i - 1] - p[0], p[i] - p[0]), normal) < 0) return false;
  return true;
}

/// The corners as seen from where they turn to the left.
std::vector<Vec2> flattened(std::span<const Vec3> corners, Vec3 normal) {
  int up = 0;
  for (const int k : {1, 2})
    if (std::fabs(normal[k]) > std::fabs(normal[up])) up = k;
  int x = (up + 1) % 3, y = (up + 2) % 3;
  if (normal[up] < 0) std::swap(x, y);
  std::vector<Vec2> flat;
  flat.reserve(corners.size());
  for (const Vec3 p : corners) flat.push_back({p[x], p[y]});
  return flat;
}

/// Cuts ears off a ring of corners that turns to the left.
class Ears {
 public:
  explicit Ears(std::vector<Vec2> points) : p_(std::move(points)), before_(p_.size()), after_(p_.size()) {
    const auto n = static_cast<std::int32_t>(p_.size());
    for (std::int32_t i = 0; i < n; ++i) before_[at(i)] = (i + n - 1) % n, after_[at(i)] = (i + 1) % n;
    for (std::int32_t i = 0; i < n; ++i)
      if (!turns_left(i)) dents_.push_back(i);
    std::sort(dents_.begin(), dents_.end(), [&](std::int32_t a, std::int32_t b) { return p_[at(a)].x < p_[at(b)].x; });
    left_ = dents_.size();
  }

  PolygonTriangles cut() {
    std::vector<std::array<std::int32_t, 3>> triangles;
    std::int32_t i = 0;
    for (std::size_t ring = p_.size(), since = 0; ring > 2;) {
      if (tests_ > kMostEarTests) return {{}, true};
      if (since > ring) return {};
      if (!is_ear(i)) {
        ++since;
        i = after_[at(i)];
        continue;
      }
      const std::int32_t a = before_[at(i)], c = after_[at(i)];
      triangles.push_back({a, i, c});
      const bool dented[2] = {!turns_left(a), !turns_left(c)};
      after_[at(a)] = c;
      before_[at(c)] = a;
      before_[at(i)] = kGone;
      left_ -=
          static_cast<std::size_t>(dented[0] && turns_left(a)) + static_cast<std::size_t>(dented[1] && turns_left(c));
      if (2 * left_ < dents_.size()) forget_old_dents();
      --ring;
      since = 0;
      i = after_[at(c)];  // ears side by side would be a fan of needles
    }
    return {std::move(triangles), false};
  }

 private:
  static constexpr std::int32_t kGone = -1;
  static std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }
  Vec2 point(std::int32_t i) const { return p_[at(i)]; }
  bool turns_left(std::int32_t i) const { return orient(point(before_[at(i)]), point(i), point(after_[at(i)])) > 0; }
  bool is_dent(std::int32_t i) const { return before_[at(i)] != kGone && !turns_left(i); }
  void forget_old_dents() {
    std::erase_if(dents_, [&](std::int32_t i) { return !is_dent(i); });
    left_ = dents_.size();
  }
  /// Only dents can lie in the triangle of a corner that turns to the left.
  bool is_ear(std::int32_t i) {
    if (!turns_left(i)) return false;
    const Vec2 a = point(before_[at(i)]), b = point(i), c = point(after_[at(i)]);
    const double low = std::min({a.x, b.x, c.x}), high = std::max({a.x, b.x, c.x});
    const auto first =
        std::lower_bound(dents_.begin(), dents_.end(), low, [&](std::int32_t d, double x) { return point(d).x < x; });
    for (auto d = first; d != dents_.end() && point(*d).x <= high; ++d) {
      ++tests_;
      const Vec2 q = point(*d);
      if (q == a || q == b || q == c || !is_dent(*d)) continue;
      if (orient(a, b, q) >= 0 && orient(b, c, q) >= 0 && orient(c, a, q) >= 0) return false;
    }
    return true;
  }

  std::vector<Vec2> p_;
  std::vector<std::int32_t> before_, after_;
  std::vector<std::int32_t> dents_;  ///< by x; some of them may be gone, or dents no longer
  std::size_t left_ = 0;             ///< that are dents, or more
  std::size_t tests_ = 0;
};

}  // namespace

PolygonTriangles triangulate_polygon(std::span<const Vec3> corners) {
  const Vec3 normal = normal_of(corners);
  if (!fan_covers(corners, normal)) return Ears(flattened(corners, normal)).cut();
  PolygonTriangles fan;
  for (std::int32_t i = 2; i < static_cast<std::int32_t>(corners.size()); ++i) fan.corners.push_back({0, i - 1, i});
  return fan;
}

const PolygonFace* fit_polygon_faces(std::span<const PolygonFace> faces, TriangleMesh& mesh) {
  std::vector<Vec3> corners;
  for (const PolygonFace& face : faces) {
    // The fan's corner i is the last of its triangle i - 2.
    const auto corner = [&](const auto& of_triangles, std::int32_t i) {
      return i < 2 ? of_triangles[face.first][static_cast<std::size_t>(i)]
                   : of_triangles[face.first + static_cast<std::size_t>(i) - 2][2];
    };
    corners.clear();
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(face.corners); ++i)
      corners.push_back(mesh.positions[corner(mesh.triangles.raw(), i)]);
    if (fan_covers(corners, normal_of(corners))) continue;
    const auto [ears, too_long] = triangulate_polygon(corners);
    if (too_long) return &face;
    if (ears.empty()) continue;
    const auto replace = [&, &cut = ears](auto& of_triangles) {
      auto replaced = std::vector(of_triangles.begin() + static_cast<std::ptrdiff_t>(face.first),
                                  of_triangles.begin() + static_cast<std::ptrdiff_t>(face.first + cut.size()));
      for (std::size_t t = 0; t < cut.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) replaced[t][k] = corner(of_triangles, cut[t][k]);
      std::copy(replaced.begin(), replaced.end(), of_triangles.begin() + static_cast<std::ptrdiff_t>(face.first));
    };
    replace(mesh.triangles.raw());
    if (!mesh.texture.empty()) replace(mesh.texture.raw());
  }
  return nullptr;
}

std::string too_many_corners(const PolygonFace& face) {
  return fmt::format(
      "a face with {} corners is not convex, and takes too long to be divided; export the mesh with triangles",
      face.corners);
}

}  // namespace kerf
