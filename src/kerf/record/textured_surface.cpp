#include "kerf/record/textured_surface.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <tuple>

namespace kerf {

TexturedSurface textured_surface(const RenderSurface& surface, const VisualMesh& mesh) {
  struct Corner {
    RenderVertex vertex;
    std::uint32_t u, v;  // bits of the texture coordinates
    std::int32_t half_edge;
    [[nodiscard]] auto key() const { return std::tuple(vertex, u, v); }
  };
  std::vector<Corner> corners;
  corners.reserve(mesh.half_edge_count());
  for (const VisualHalfEdge h : ids<VisualHalfEdge>(mesh.half_edge_count())) {
    const Vec2f t = mesh.texture[h];
    corners.push_back(
        {surface.corner[h], std::bit_cast<std::uint32_t>(t.x), std::bit_cast<std::uint32_t>(t.y), h.value});
  }
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return std::tuple(a.key(), a.half_edge) < std::tuple(b.key(), b.half_edge);
  });
  TexturedSurface out;
  std::vector<std::int32_t> at(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i == 0 || corners[i].key() != corners[i - 1].key()) {
      out.vertex.push_back(corners[i].vertex);
      out.texture.push_back(mesh.texture[VisualHalfEdge(corners[i].half_edge)]);
    }
    at[static_cast<std::size_t>(corners[i].half_edge)] = static_cast<std::int32_t>(out.vertex.size()) - 1;
  }
  for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count())) {
    const std::size_t h = VisualMesh::corner(f, 0).index();
    (mesh.patch[f].is_wall() ? out.walls : out.skin).push_back({at[h], at[h + 1], at[h + 2]});
  }
  return out;
}

}  // namespace kerf
