// Shadows.
#pragma once

#include <vector>

#include "kerf/base/vec.h"
#include "kerf/picture/picture.h"

namespace kerf {

/// How far light from one direction gets: a depth map seen from the light.
class LightMap {
 public:
  LightMap(const PictureBody& body, const Box3& box, Vec3 to_light, int resolution);
  /// 1 where light arrives, 0 in shadow, in between next to an edge of the shadow.
  [[nodiscard]] double light(Vec3 p, double bias) const;
  [[nodiscard]] Vec3 direction() const { return w_; }

 private:
  [[nodiscard]] Vec3 project(Vec3 p) const;
  Vec3 u_, v_, w_, center_;
  double scale_ = 1;
  int n_;
  std::vector<float> depth_;
};

}  // namespace kerf
