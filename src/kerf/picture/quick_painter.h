// Pictures and depth fast enough to learn from: one sample a pixel, no shadows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/picture/picture.h"
#include "kerf/picture/picture_camera.h"
#include "kerf/picture/picture_light.h"
#include "kerf/picture/picture_material.h"

namespace kerf {

/// What there is to see.
struct QuickStage {
  PictureBody body;
  const BodyTexture* texture = nullptr;  ///< of this body; needed for colours only
  std::span<const PictureThing> things;  ///< beside it
  std::optional<double> ground_at;       ///< metres: height of a level plane without end
};

/// Where a picture goes, rows from top to bottom. What is empty is not drawn.
struct QuickTarget {
  int width = 0, height = 0;    ///< pixels, 1 or more
  std::span<std::uint8_t> rgb;  ///< 3 width height, sRGB
  std::span<float> depth;  ///< width height: metres along the view at the middle of each pixel, inf where nothing is
};

/// Draws one picture after the other and keeps its memory from one to the next. What is seen at the middle of a pixel is the pixel: a ray's
/// first hit, of triangles to the last bit, however near the eye they are. Triangles are seen from both sides. The same input gives the
/// same bytes, whatever was drawn before and on any number of threads. Cost: linear in triangles, and in pixels that show something.
class QuickPainter {
 public:
  /// The view is one that check_view() takes.
  void draw(const QuickStage& stage, const PictureView& view, const QuickTarget& target);

 private:
  using Triangle = std::array<std::int32_t, 3>;
  /// Triangles that lie one behind the other in the numbering of what is seen.
  struct Part {
    std::span<const Vec3> positions;
    std::span<const Triangle> triangles;
    std::size_t first_vertex = 0, first_triangle = 0;
  };
  /// Where a ray meets a triangle: shares of its corners.
  struct Hit {
    double a = 0, b = 0, c = 0;
  };

  void gather(const QuickStage& stage);
  void rasterise(int width, int height);
  void rasterise(const Part& part, int width, int height);
  void see_ground(const QuickStage& stage, const QuickTarget& target);
  void find_normals(std::span<const std::uint8_t> wall);
  [[nodiscard]] static bool is_wall(const Part& part, std::size_t triangle, std::span<const std::uint8_t> wall);
  void shade(const QuickStage& stage, const QuickTarget& target) const;
  [[nodiscard]] Hit hit(Vec3 a, Vec3 b, Vec3 c, int x, int y) const;
  [[nodiscard]] Vec3 triangle_color(const QuickStage& stage, std::int32_t id, int x, int y) const;
  [[nodiscard]] Vec3 ground_color(const QuickStage& stage, int x, int y, double depth) const;

  PictureCamera camera_;
  StageLights lights_;
  Box3 rest_box_;
  std::vector<Part> parts_;        ///< the body, then the things
  std::vector<Vec3> seen_;         ///< by vertex: x and y times focal length, z along the view
  std::vector<Vec3> normals_;      ///< by vertex: of the skin, or of a thing
  std::vector<std::int32_t> ids_;  ///< by pixel: a triangle, kNothing or kGround
  std::vector<float> depth_;       ///< by pixel
};

}  // namespace kerf
