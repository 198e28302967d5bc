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
      features.edges.push_back({corner(bits), corner(bits | 1 << k), std::sqrt(0.5) * (y + z), {-y, -z},
                                part.part->radius, 3 * bits + k});
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

void mesh_features(const PlacedPart& part, const std::array<Vec3, 3>& points, double reach, ShapeFeatures& features) {
  features.clear();
  const ObstacleMesh& mesh = *part.part->mesh;
  Box3 box;
  for (const Vec3 p : points) box.add(transposed_times(part.axes, p - part.centre));
  box.min -= {reach, reach, reach};
  box.max += {reach, reach, reach};
  const auto world = [&](std::size_t v) { return part.centre + part.axes * mesh.positions[v]; };
  mesh.tree.for_each_in_box(mesh.view(), box, [&](std::int32_t triangle) {
    for (std::int32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) {
      const auto i = static_cast<std::size_t>(h), next = i % 3 == 2 ? i - 2 : i + 1;
      const auto v = static_cast<std::size_t>(mesh.corners[i]), w = static_cast<std::size_t>(mesh.corners[next]);
      if (mesh.vertex_owner[v] == h)
        features.points.push_back({world(v), mesh.closed ? part.axes * mesh.vertex_normal[v] : Vec3{}, 0, mesh.corners[i]});
      if (mesh.convex_edge[i] == 0) continue;
      ShapeEdge edge{world(v), world(w), mesh.closed ? part.axes * mesh.edge_normal[i] : Vec3{}, {}, 0, h};
      const Vec3 along = mesh.positions[w] - mesh.positions[v];
      edge.into[0] = part.axes * normalized(cross(mesh.face_normal[i / 3], along));
      if (mesh.twin[i] >= 0) {
        const auto g = static_cast<std::size_t>(mesh.twin[i]);
        edge.into[1] = part.axes * normalized(cross(along, mesh.face_normal[g / 3]));
      }
      features.edges.push_back(edge);
    }
  });
}

}  // namespace kerf
