#include "kerf/contact/shape_features.h"

#include <cmath>

namespace kerf {
namespace {

void box_features(const PlacedPart& part, ShapeFeatures& features) {
  const Vec3 half = part.part->half;
  const auto corner = [&](int bits) {
    Vec3 local;
    for (int k = 0; k < 3; ++k) local[k] = (bits >> k & 1) != 0 ? half[k] : -half[k];
    return part.centre + part.axes * local;
  };
  const auto axis = [&](int k, int bits) {
    return ((bits >> k & 1) != 0 ? 1.0 : -1.0) * part.axes.c[static_cast<std::size_t>(k)];
  };
  for (int bits = 0; bits < 8; ++bits) {
    const Vec3 outward = normalized(axis(0, bits) + axis(1, bits) + axis(2, bits));
    features.points.push_back({corner(bits), outward, part.part->radius, bits});
    for (int k = 0; k < 3; ++k) {
      if ((bits >> k & 1) != 0) continue;
      const Vec3 y = axis((k + 1) % 3, bits), z = axis((k + 2) % 3, bits);
      features.edges.push_back(
          {corner(bits), corner(bits | 1 << k), std::sqrt(0.5) * (y + z), {-y, -z}, part.part->radius, 3 * bits + k});
    }
  }
}

}  // namespace

void all_features(const PlacedPart& part, ShapeFeatures& features) {
  features.clear();
  const double radius = part.part->radius;
  switch (part.part->kind) {
    case PartKind::kSphere: features.points.push_back({part.centre, {}, radius, 0}); break;
    case PartKind::kCapsule:
      features.points.push_back({part.centre, {}, radius, 0});
      features.points.push_back({part.end, {}, radius, 1});
      features.edges.push_back({part.centre, part.end, {}, {}, radius, 0});
      break;
    case PartKind::kBox: box_features(part, features); break;
    case PartKind::kPlane:
    case PartKind::kMesh: break;
  }
}

ShapePoint mesh_point(const PlacedPart& part, std::int32_t v) {
  const ObstacleMesh& mesh = *part.part->mesh;
  const auto i = static_cast<std::size_t>(v);
  return {part.centre + part.axes * mesh.positions[i], mesh.closed ? part.axes * mesh.vertex_normal[i] : Vec3{}, 0, v};
}

ShapeEdge mesh_edge(const PlacedPart& part, const ObstacleLeaves::Edge& edge) {
  const ObstacleMesh& mesh = *part.part->mesh;
  return {part.centre + part.axes * edge.a,
          part.centre + part.axes * edge.b,
          mesh.closed ? part.axes * mesh.edge_normal[static_cast<std::size_t>(edge.half_edge)] : Vec3{},
          {part.axes * edge.into[0], part.axes * edge.into[1]},
          0,
          edge.half_edge};
}

}  // namespace kerf
