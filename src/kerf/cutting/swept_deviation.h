// What a blade sweeps beside the walls that it left: two sets of places, compared without any path.
//
//   swept    the quads between one pose and the next, as they lie in the body at rest
//   walls    the visual triangles that were grown
//
//        swept  ----.---------------.----
//                   | stray         | missed
//        walls  ----'----      -----'----
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/spatial/bvh.h"

namespace kerf {

/// Triangles to look places up on; metres.
class TriangleSoup {
 public:
  void add(Vec3 a, Vec3 b, Vec3 c);
  /// After the last triangle, before the first look.
  void build();
  [[nodiscard]] std::size_t size() const { return corners_.size() / 3; }
  /// To the nearest triangle; infinite if there is none.
  [[nodiscard]] double distance(Vec3 p) const;
  /// Of a closed surface: does it go round p?
  [[nodiscard]] bool encloses(Vec3 p) const;
  /// Calls fn(Vec3) with places of every triangle at most `step` metres apart, its corners among them.
  template <class Fn>
  void for_each_place(double step, Fn&& fn) const {
    for (std::size_t t = 0; t + 2 < points_.size(); t += 3) {
      const Vec3 a = points_[t], b = points_[t + 1], c = points_[t + 2];
      const int n = std::max(1, static_cast<int>(std::ceil(std::max({norm(b - a), norm(c - b), norm(a - c)}) / step)));
      for (int i = 0; i <= n; ++i)
        for (int k = 0; i + k <= n; ++k)
          fn(a + (static_cast<double>(i) / n) * (b - a) + (static_cast<double>(k) / n) * (c - a));
    }
  }

 private:
  std::vector<Vec3> points_;
  std::vector<std::int32_t> corners_;
  Box3 box_;
  TriangleBvh tree_;
};

/// Visual triangles at rest: the skin, or the walls.
TriangleSoup skin_of(const CellComplex& body);
TriangleSoup walls_of(const CellComplex& body);
/// Each wall by itself.
std::vector<TriangleSoup> each_wall_of(const CellComplex& body);

struct FarthestPlace {
  double distance = 0;  ///< metres
  Vec3 at;
};
/// Of the walls, from the swept surface: something is drawn where no blade was. `step`: between the places that are compared, metres.
FarthestPlace stray_of(const TriangleSoup& walls, const TriangleSoup& swept, double step);
/// Of the swept surface inside the body, from the walls and the skin: something is left out. `skin`: of the body before it was cut. Not for use where a
/// blade cuts only the first of several layers.
FarthestPlace missed_of(const TriangleSoup& swept, const TriangleSoup& walls, const TriangleSoup& skin, double step);

/// Of the walls outside the body, from its skin before it was cut: a wall goes through the skin.
FarthestPlace outside_of(const TriangleSoup& walls, const TriangleSoup& skin, double step);

}  // namespace kerf
