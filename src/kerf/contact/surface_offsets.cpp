#include "kerf/contact/surface_offsets.h"

#include <array>

namespace kerf {
namespace {

/// Half the difference of the weights at the + and at the - corner of a vertex's prism.
std::array<double, 8> offset_weights(const LatticeFrame& frame, Vec3 local, Vec3 rest_offset) {
  const Vec3 o = transposed_times(frame.axes, rest_offset);
  const Vec3 d{2 * o.x / frame.cell.x, 2 * o.y / frame.cell.y, 2 * o.z / frame.cell.z};
  const auto plus = trilinear_weights(local + d), minus = trilinear_weights(local - d);
  std::array<double, 8> w;
  for (std::size_t i = 0; i < 8; ++i) w[i] = 0.5 * (plus[i] - minus[i]);
  return w;
}

}  // namespace

void surface_offsets(const HexMesh& hex, const Embedding& embedding, const ContactSurface& surface,
                     std::span<const Vec3> nodes, std::span<Vec3> out) {
  KERF_ASSERT(out.size() == surface.vertex_count() && out.size() == embedding.collision.size());
  for (const CollisionVertex v : ids<CollisionVertex>(out.size())) {
    const HexId copy = embedding.collision[v];
    const auto w = offset_weights(hex.frame_of(copy), embedding.collision_local[v], surface.offset[v]);
    const auto& corner = hex.nodes[copy];
    Vec3 sum;
    for (std::size_t i = 0; i < 8; ++i) sum += w[i] * nodes[corner[i].index()];
    out[v.index()] = sum;
  }
}

}  // namespace kerf
