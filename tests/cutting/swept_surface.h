// What a blade sweeps beside the walls that it left: two point sets that know nothing of paths.
//
//   swept    the quads between one pose and the next
//   walls    the visual triangles that were grown
//   stray    of the farthest place of a wall, to the swept surface: nothing is drawn where the blade was not
//   missed   of the farthest swept place inside the body, to a wall or the skin: nothing is left out
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/blade_edge.h"
#include "kerf/spatial/bvh.h"

namespace kerf::testing_support {

/// Triangles to look places up on.
class Sheet {
 public:
  void add(Vec3 a, Vec3 b, Vec3 c) {
    for (const Vec3 p : {a, b, c}) {
      corners_.push_back(static_cast<std::int32_t>(points_.size()));
      points_.push_back(p);
    }
  }
  void build() { tree_ = TriangleBvh(TriangleView(points_, corners_)); }
  [[nodiscard]] bool empty() const { return points_.empty(); }
  [[nodiscard]] double distance(Vec3 p) const { return empty() ? HUGE_VAL : tree_.closest(TriangleView(points_, corners_), p).distance; }
  /// Of a closed sheet.
  [[nodiscard]] bool encloses(Vec3 p) const {
    std::vector<RayHit> hits;
    tree_.all_hits(TriangleView(points_, corners_), Ray{p, Vec3{0.0137, 0.0071, 0.99988}}, hits);
    return hits.size() % 2 == 1;
  }
  /// Places at most `step` apart in each triangle.
  template <class Fn>
  void for_each_place(double step, Fn&& fn) const {
    for (std::size_t t = 0; t + 2 < points_.size(); t += 3) {
      const Vec3 a = points_[t], b = points_[t + 1], c = points_[t + 2];
      const int n = std::max(1, static_cast<int>(std::ceil(std::max({norm(b - a), norm(c - b), norm(a - c)}) / step)));
      for (int i = 0; i <= n; ++i)
        for (int k = 0; i + k <= n; ++k) fn(a + (static_cast<double>(i) / n) * (b - a) + (static_cast<double>(k) / n) * (c - a));
    }
  }

 private:
  std::vector<Vec3> points_;
  std::vector<std::int32_t> corners_;
  TriangleBvh tree_;
};

inline Sheet swept_by(std::span<const std::vector<BladeEdge>> strokes) {
  Sheet sheet;
  for (const std::vector<BladeEdge>& s : strokes)
    for (std::size_t i = 0; i + 1 < s.size(); ++i) {
      sheet.add(s[i].base, s[i].tip, s[i + 1].tip);
      sheet.add(s[i].base, s[i + 1].tip, s[i + 1].base);
    }
  sheet.build();
  return sheet;
}
/// Visual triangles at rest.
inline Sheet sheet_of(const CellComplex& body, bool walls) {
  Sheet sheet;
  const VisualMesh& m = body.visual;
  for (const VisualTriangle f : ids<VisualTriangle>(m.face_count())) {
    if (m.patch[f].is_wall() != walls) continue;
    const auto at = [&](int k) { return m.rest[m.origin[VisualMesh::corner(f, k)]]; };
    sheet.add(at(0), at(1), at(2));
  }
  sheet.build();
  return sheet;
}

struct SweptDeviation {
  double stray = 0, missed = 0;  // metres
  Vec3 stray_at, missed_at;
};
/// `skin`: of the body before it was cut.
inline SweptDeviation swept_deviation(const CellComplex& body, const Sheet& skin, std::span<const std::vector<BladeEdge>> strokes, double step) {
  const Sheet swept = swept_by(strokes), walls = sheet_of(body, true);
  SweptDeviation d;
  walls.for_each_place(step, [&](Vec3 p) {
    if (const double far = swept.distance(p); far > d.stray) d.stray = far, d.stray_at = p;
  });
  swept.for_each_place(step, [&](Vec3 p) {
    if (!skin.encloses(p)) return;
    const double far = std::min(walls.distance(p), skin.distance(p));
    if (far > d.missed) d.missed = far, d.missed_at = p;
  });
  return d;
}

}  // namespace kerf::testing_support
