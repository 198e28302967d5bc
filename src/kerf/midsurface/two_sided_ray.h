// From a point inside the body to both of its sides along one line.
#pragma once

#include <optional>

#include "kerf/midsurface/side_labels.h"

namespace kerf::mid {

struct TwoSidedHit {
  double plus = 0, minus = 0;  ///< metres to the + side along `direction`, to the - side against it
  Vec3 direction;              ///< unit
  double facing = 0;           ///< how well the two faces are opposite: -cosine of their normals
};

class TwoSidedRays {
 public:
  /// Surface, its tree, |V| field and |F| normals; all are referred to.
  TwoSidedRays(const SurfaceMesh& surface, const TriangleBvh& bvh, const Column<double>& field,
               const Column<Vec3>& normal)
      : surface_(surface), view_(surface.view()), bvh_(bvh), field_(field), normal_(normal) {}

  /// Nothing unless the first hits lie on the right sides and face away. The line is then turned to the bisector of the
  /// two faces' normals, where that line does as well: across a wedge it is the medial direction.
  [[nodiscard]] std::optional<TwoSidedHit> cast(Vec3 p, Vec3 direction) const;

 private:
  struct Ends {
    TwoSidedHit hit;
    Vec3 bisector;
  };
  [[nodiscard]] std::optional<Ends> both(Vec3 p, Vec3 direction) const;

  const SurfaceMesh& surface_;
  TriangleView view_;
  const TriangleBvh& bvh_;
  const Column<double>& field_;
  const Column<Vec3>& normal_;
};

}  // namespace kerf::mid
