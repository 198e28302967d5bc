// Pictures of bodies without a graphics card: a small rasteriser with soft shadows and solid textures.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "kerf/base/vec.h"

namespace kerf {

/// How a body looks. Solid textures are evaluated at rest positions, so that they run on into cut surfaces
/// and move with the body.
enum class Look {
  kMeat,       ///< red, marbled, with a cap of fat; on a wooden board
  kCartilage,  ///< off-white and glossy
  kSheet,      ///< light blue, matt
};

struct PictureBody {
  std::span<const Vec3> positions;  ///< |V|, metres
  std::span<const Vec3> rest;       ///< |V|, metres
  std::span<const std::array<std::int32_t, 3>> triangles;
  std::span<const std::uint8_t> wall;  ///< per triangle, 1: cut surface; empty: none
  Look look = Look::kSheet;
};

/// A rigid thing beside the body.
struct PictureThing {
  enum class Stuff { kSteel, kStone, kBone, kWood };
  std::vector<Vec3> positions;  ///< |V|, metres
  std::vector<std::array<std::int32_t, 3>> triangles;
  Stuff stuff = Stuff::kStone;
  bool framed = true;  ///< the camera takes all of it in
};

/// A line drawn over the body where nothing hides it.
struct PictureLine {
  Vec3 a, b;
  Vec3f color;      ///< linear, 0 to 1
  float width = 1;  ///< pixels
  float opacity = 1;
};

/// A pinhole camera. The middle of the picture is where it looks.
struct PictureView {
  Vec3 eye, target;            ///< metres
  Vec3 up{0, 0, 1};            ///< upwards in the picture; any length
  double field_of_view = 0.5;  ///< radians, vertical
};

struct PictureOptions {
  int width = 1600, height = 1000;
  Vec3 direction{-0.45, -0.8, 0.62};  ///< from the body to the eye
  Vec3 up{0, 0, 1};
  double field_of_view = 0.5;       ///< radians, vertical
  double zoom = 1;                  ///< 1: the body fills the picture
  std::optional<PictureView> view;  ///< instead of these four
  bool ground = true;               ///< something to lie on, at the lowest point of the body, with the body's shadow
  bool two_sided = false;           ///< light the backs of triangles too (open sheets)
  std::optional<double> ground_at;  ///< metres: height of the ground instead
  std::function<bool()> stop;       ///< asked by several threads at once: is the picture of no use any more?
};

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 width height, sRGB, rows from top to bottom
};

/// Draws the body and things beside it; empty bodies give an empty stage. The same input gives the same bytes. A picture that was stopped has
/// black left in it.
Picture draw_picture(const PictureBody& body, std::span<const PictureLine> lines, const PictureOptions& options,
                     std::span<const PictureThing> things = {});

/// Edges of triangles, each once, in one colour.
std::vector<PictureLine> triangle_edges(std::span<const Vec3> positions,
                                        std::span<const std::array<std::int32_t, 3>> triangles, Vec3f color,
                                        float width, float opacity);

/// The twelve edges of every hexahedron (corners numbered in bits: x = c & 1, y = c >> 1 & 1, z = c >> 2), a
/// colour for each, shrunk a little towards its middle so that copies of one cell can be told apart.
std::vector<PictureLine> hexahedron_edges(std::span<const Vec3> positions,
                                          std::span<const std::array<std::int32_t, 8>> hexahedra, float width,
                                          float opacity);

}  // namespace kerf
