#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/picture/picture.h"
#include "kerf/picture/picture_raster.h"

namespace kerf {
namespace {

using Triangle = std::array<std::int32_t, 3>;

}  // namespace

std::vector<PictureLine> triangle_edges(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                                        Vec3f color, float width, float opacity) {
  std::vector<std::pair<std::int32_t, std::int32_t>> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::vector<PictureLine> out;
  out.reserve(edges.size());
  for (const auto& [a, b] : edges)
    out.push_back({positions[picture_index(a)], positions[picture_index(b)], color, width, opacity});
  return out;
}

std::vector<PictureLine> hexahedron_edges(std::span<const Vec3> positions,
                                          std::span<const std::array<std::int32_t, 8>> hexahedra, float width,
                                          float opacity) {
  constexpr double kShrink = 0.04;
  std::vector<PictureLine> out;
  out.reserve(12 * hexahedra.size());
  for (std::size_t h = 0; h < hexahedra.size(); ++h) {
    const double hue = std::fmod(0.61803398875 * static_cast<double>(h), 1.0) * 6;  // golden ratio: neighbours differ
    const auto channel = [&](double shift) {
      return static_cast<float>(std::clamp(std::abs(std::fmod(hue + shift, 6.0) - 3) - 1, 0.05, 0.9));
    };
    const Vec3f color{channel(0), channel(4), channel(2)};
    Vec3 middle;
    for (std::int32_t v : hexahedra[h]) middle += 0.125 * positions[picture_index(v)];
    const auto corner = [&](std::size_t c) { return lerp(positions[picture_index(hexahedra[h][c])], middle, kShrink); };
    for (std::size_t c = 0; c < 8; ++c) {
      for (std::size_t bit : {1u, 2u, 4u}) {
        if ((c & bit) == 0) out.push_back({corner(c), corner(c | bit), color, width, opacity});
      }
    }
  }
  return out;
}

}  // namespace kerf
