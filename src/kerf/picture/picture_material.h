// Solid textures: what a body and the ground under it look like at a point.
#pragma once

#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/picture/picture.h"

namespace kerf {

struct PictureSurface {
  Vec3 color;              ///< linear albedo
  double roughness = 0.5;  ///< of the gloss, 0 to 1
  double gloss = 0.04;     ///< reflectance at normal incidence
  double bump = 0;         ///< metres: height over the smooth surface
  double wrap = 0;         ///< 0 to 1: how much light creeps round edges, as in tissue
};

class BodyTexture {
 public:
  /// From the rest shape: the thin axis and the distance to the outline seen along it.
  BodyTexture(const PictureBody& body);

  [[nodiscard]] PictureSurface at(Vec3 rest, bool wall) const;
  /// Typical size of detail, metres.
  [[nodiscard]] double detail() const { return size_; }

 private:
  [[nodiscard]] PictureSurface meat(Vec3 q, Vec3 rest, bool wall) const;
  void soften();  ///< the mask of pixels makes the distance jagged
  [[nodiscard]] double distance_to_outline(Vec3 q) const;

  Look look_;
  Box3 box_;
  int axes_[3] = {0, 1, 2};  ///< long, middle, thin
  double size_ = 1;          ///< the longest extent / 20
  int grid_ = 0;
  std::vector<float> distance_;  ///< grid_ x grid_, metres from the outline, inside
};

PictureSurface thing_surface(PictureThing::Stuff stuff);

/// What lies under the body, at metres from its middle in a body of this size (longest extent); `edge` is the
/// distance beyond the board's edge.
PictureSurface ground_surface(Look look, Vec2 p, double size);
/// Metres outside of the ground's outline; negative on it.
double ground_outside(Look look, Vec2 p, double size);

}  // namespace kerf
