#include "kerf/session/edge_carry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "kerf/base/indexed.h"
#include "kerf/cutting/face_boxes.h"

namespace kerf {
namespace {

constexpr int kLeastPoints = 9, kMostPoints = 128;  // of an edge
constexpr double kOutside = 1e-9;                   // of a face: a place on its border belongs to it

using Corners = std::array<Vec3, 3>;

Vec3 area_normal(const Corners& x) { return cross(x[1] - x[0], x[2] - x[0]); }

/// Weights of the place of a face that meets a point while both move evenly; the moment is that of heights over the face's own plane.
std::optional<std::array<double, 3>> meeting(const Corners& before, const Corners& after, Vec3 from, Vec3 to) {
  const Vec3 upright[2] = {area_normal(before), area_normal(after)};
  const double squared[2] = {dot(upright[0], upright[0]), dot(upright[1], upright[1])};
  if (!(squared[0] > 0 && squared[1] > 0)) return std::nullopt;
  const double height[2] = {dot(upright[0], from - before[0]) / std::sqrt(squared[0]),
                            dot(upright[1], to - after[0]) / std::sqrt(squared[1])};
  if ((height[0] > 0) == (height[1] > 0)) return std::nullopt;
  const double when = height[0] / (height[0] - height[1]);
  Corners x;
  for (std::size_t k = 0; k < 3; ++k) x[k] = lerp(before[k], after[k], when);
  const Vec3 p = lerp(from, to, when), n = area_normal(x);
  const double n2 = dot(n, n);
  if (!(n2 > 0)) return std::nullopt;
  const double a = dot(cross(x[1] - p, x[2] - p), n) / n2, b = dot(cross(x[2] - p, x[0] - p), n) / n2, c = 1 - a - b;
  if (std::min({a, b, c}) < -kOutside) return std::nullopt;
  return std::array<double, 3>{a, b, c};
}

}  // namespace

void add_crossings(const CollisionMesh& mesh, const std::vector<Vec3>& before, const std::vector<Vec3>& after,
                   const BladeEdge& from, const BladeEdge& to, double spacing, CarriedEdge& carried) {
  Box3 swept;
  for (const Vec3 p : {from.base, from.tip, to.base, to.tip}) swept.add(p);
  const double length = std::max(norm(from.tip - from.base), norm(to.tip - to.base));
  const int points = static_cast<int>(
      std::clamp(std::ceil(length / spacing), static_cast<double>(kLeastPoints), static_cast<double>(kMostPoints)));
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    Corners x0, x1;
    Box3 box;
    for (std::size_t k = 0; k < 3; ++k) {
      const CollisionVertex v = mesh.origin[CollisionMesh::corner(t, static_cast<int>(k))];
      box.add(x0[k] = before[v.index()]);
      box.add(x1[k] = after[v.index()]);
    }
    if (!boxes_meet(box, swept)) continue;
    for (int i = 0; i <= points; ++i) {
      const double s = static_cast<double>(i) / points;
      const auto weights = meeting(x0, x1, lerp(from.base, from.tip, s), lerp(to.base, to.tip, s));
      if (!weights) continue;
      Vec3 was, motion;
      for (std::size_t k = 0; k < 3; ++k) {
        was += (*weights)[k] * x0[k];
        motion += (*weights)[k] * (x1[k] - x0[k]);
      }
      carried.add(was, motion);
    }
  }
}

}  // namespace kerf
