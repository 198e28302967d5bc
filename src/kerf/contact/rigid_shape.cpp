#include "kerf/contact/rigid_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/spatial/segment_queries.h"

namespace kerf {
namespace {

Mat3 times(const Mat3& a, const Mat3& b) { return {{a * b.c[0], a * b.c[1], a * b.c[2]}}; }

/// Some unit vector perpendicular to d, which may be zero.
Vec3 any_normal(Vec3 d) {
  const Vec3 axis = std::fabs(d.x) <= std::fabs(d.y) && std::fabs(d.x) <= std::fabs(d.z) ? Vec3{1, 0, 0}
                    : std::fabs(d.y) <= std::fabs(d.z)                                   ? Vec3{0, 1, 0}
                                                                                         : Vec3{0, 0, 1};
  const Vec3 n = cross(d, axis);
  const double size = norm(n);
  return size > 0 ? (1 / size) * n : Vec3{0, 0, 1};
}

/// A ball around p, which is one of the nearest points of the part's axis.
bool from_axis(Vec3 x, Vec3 p, Vec3 axis, double radius, double reach, Proximity& r) {
  const Vec3 d = x - p;
  const double size = norm(d);
  if (!(size - radius < reach)) return false;
  r.normal = size > 0 ? (1 / size) * d : any_normal(axis);
  r.distance = size - radius;
  r.point = p + radius * r.normal;
  return true;
}

bool from_box(const PlacedPart& placed, Vec3 x, double reach, Proximity& r) {
  const Vec3 half = placed.part->half;
  const Vec3 local = transposed_times(placed.axes, x - placed.centre);
  Vec3 clamped, beyond;
  double outside = 0;
  for (int k = 0; k < 3; ++k) {
    clamped[k] = std::clamp(local[k], -half[k], half[k]);
    beyond[k] = local[k] - clamped[k];
    outside += beyond[k] * beyond[k];
  }
  outside = std::sqrt(outside);
  if (outside - placed.part->radius >= reach) return false;
  Vec3 normal;
  double distance;
  if (outside > 0) {
    normal = (1 / outside) * beyond;
    distance = outside;
  } else {
    int face = 0;
    for (int k = 1; k < 3; ++k)
      if (half[k] - std::fabs(local[k]) < half[face] - std::fabs(local[face])) face = k;
    normal[face] = local[face] < 0 ? -1 : 1;
    distance = std::fabs(local[face]) - half[face];
  }
  r.normal = placed.axes * normal;
  r.distance = distance - placed.part->radius;
  r.point = x - r.distance * r.normal;
  return true;
}

bool from_mesh(const PlacedPart& placed, Vec3 x, double reach, Proximity& r) {
  const ObstacleMesh& mesh = *placed.part->mesh;
  const Vec3 local = transposed_times(placed.axes, x - placed.centre);
  const ClosestPoint best = mesh.tree.closest(mesh.view(), local, reach);
  if (!best.valid()) return false;
  proximity_of_foot(placed, local, best, r);
  return true;
}

bool is_rotation(const Mat3& m) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (!(std::fabs(dot(m.c[i], m.c[j]) - (i == j ? 1 : 0)) < 1e-6)) return false;
  return dot(cross(m.c[0], m.c[1]), m.c[2]) > 0;
}

}  // namespace

ShapePart plane_part(Vec3 point, Vec3 normal) {
  ShapePart p;
  p.kind = PartKind::kPlane;
  p.centre = point;
  p.axes.c[2] = normalized(normal);
  p.axes.c[0] = any_normal(p.axes.c[2]);
  p.axes.c[1] = cross(p.axes.c[2], p.axes.c[0]);
  return p;
}
ShapePart sphere_part(Vec3 centre, double radius) {
  ShapePart p;
  p.centre = centre;
  p.radius = radius;
  return p;
}
ShapePart capsule_part(Vec3 a, Vec3 b, double radius) {
  ShapePart p;
  p.kind = PartKind::kCapsule;
  p.centre = a;
  p.end = b;
  p.radius = radius;
  return p;
}
ShapePart box_part(Vec3 centre, Vec3 half_sizes, const Mat3& axes, double rounding) {
  ShapePart p;
  p.kind = PartKind::kBox;
  p.centre = centre;
  p.half = half_sizes;
  p.axes = axes;
  p.radius = rounding;
  return p;
}
ShapePart mesh_part(std::shared_ptr<const ObstacleMesh> mesh, Vec3 origin, const Mat3& axes) {
  ShapePart p;
  p.kind = PartKind::kMesh;
  p.centre = origin;
  p.axes = axes;
  p.mesh = std::move(mesh);
  return p;
}

Status validate_shape(const RigidShape& shape) {
  if (!is_finite(shape.position) || !is_finite(shape.velocity) || !is_finite(shape.spin))
    return bad_input("rigid shape: position, velocity and spin must be finite");
  if (!is_rotation(shape.axes))
    return bad_input("rigid shape: its axes are not three perpendicular, right-handed unit vectors");
  if (!(shape.friction >= 0 && std::isfinite(shape.friction)))
    return bad_input(
        fmt::format("rigid shape: a friction coefficient of {} makes no sense; give 0 or more", shape.friction));
  for (std::size_t i = 0; i < shape.parts.size(); ++i) {
    const ShapePart& p = shape.parts[i];
    const auto bad = [&](const char* what) { return bad_input(fmt::format("rigid shape, part {}: {}", i + 1, what)); };
    if (!is_finite(p.centre) || !is_finite(p.end)) return bad("its place is not finite");
    if (!(p.radius >= 0 && std::isfinite(p.radius))) return bad("the radius must be finite and not negative");
    if (!is_finite(p.half) || p.half.x < 0 || p.half.y < 0 || p.half.z < 0)
      return bad("the sizes must be finite and not negative");
    if (p.kind == PartKind::kPlane && !(norm(p.axes.c[2]) > 0.5)) return bad("the plane's normal has no length");
    if (!is_rotation(p.axes)) return bad("its axes are not three perpendicular, right-handed unit vectors");
    if (p.kind == PartKind::kMesh && !p.mesh) return bad("there is no mesh");
  }
  return {};
}

double thinnest_radius(const RigidShape& shape) {
  double least = HUGE_VAL;
  for (const ShapePart& p : shape.parts) {
    double r = HUGE_VAL;
    if (p.kind == PartKind::kSphere || p.kind == PartKind::kCapsule) r = p.radius;
    if (p.kind == PartKind::kBox) r = p.radius + std::min({p.half.x, p.half.y, p.half.z});
    if (p.kind == PartKind::kMesh) r = 0;
    least = std::min(least, r);
  }
  return least;
}

double greatest_speed(const RigidShape& shape) {
  double arm = 0;
  for (const ShapePart& p : shape.parts) {
    double reach = norm(p.centre) + p.radius + norm(p.half);
    if (p.kind == PartKind::kCapsule) reach = std::max(norm(p.centre), norm(p.end)) + p.radius;
    if (p.kind == PartKind::kMesh) reach += 0.5 * p.mesh->box.diagonal() + norm(p.mesh->box.center());
    arm = std::max(arm, reach);
  }
  return norm(shape.velocity) + norm(shape.spin) * arm;
}

PlacedPart place(const RigidShape& shape, const ShapePart& part) {
  PlacedPart p;
  p.part = &part;
  p.centre = shape.position + shape.axes * part.centre;
  p.end = shape.position + shape.axes * part.end;
  p.axes = times(shape.axes, part.axes);
  return p;
}

double distance_along(const PlacedPart& placed, Vec3 x, Vec3 n) {
  double support = placed.part->radius + dot(n, placed.centre);
  switch (placed.part->kind) {
    case PartKind::kCapsule: support = placed.part->radius + std::max(dot(n, placed.centre), dot(n, placed.end)); break;
    case PartKind::kBox:
      for (int k = 0; k < 3; ++k)
        support += placed.part->half[k] * std::fabs(dot(n, placed.axes.c[static_cast<std::size_t>(k)]));
      break;
    case PartKind::kPlane:
    case PartKind::kSphere:
    case PartKind::kMesh: break;
  }
  return dot(n, x) - support;
}

void proximity_of_foot(const PlacedPart& placed, Vec3 local, const ClosestPoint& best, Proximity& r) {
  const ObstacleMesh& mesh = *placed.part->mesh;
  const auto f = static_cast<std::size_t>(best.triangle);
  int zeros = 0;
  std::size_t zero = 0, full = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (best.barycentric[i] > 0) full = i;
    else ++zeros, zero = i;
  }
  // The normal of the feature: its sign tells inside from outside (Baerentzen and Aanaes 2005).
  const Vec3 feature = zeros == 0   ? mesh.face_normal[f]
                       : zeros == 1 ? mesh.edge_normal[3 * f + (zero + 1) % 3]
                                    : mesh.vertex_normal[static_cast<std::size_t>(mesh.corners[3 * f + full])];
  const Vec3 d = local - best.point;
  const bool behind = dot(d, feature) < 0;
  r.two_sided = !mesh.closed;
  const bool inside = behind && mesh.closed;
  Vec3 normal = behind ? -feature : feature;
  // A distance that is nothing but rounding has no direction.
  const double scale = norm(local) + norm(best.point) + mesh.box.diagonal();
  if (zeros > 0 && best.distance > 1e-12 * scale) normal = (1 / best.distance) * d;
  if (inside) normal = -normal;
  r.normal = placed.axes * normal;
  r.distance = inside ? -best.distance : best.distance;
  r.point = placed.centre + placed.axes * best.point;
}

bool closest_on_part(const PlacedPart& placed, Vec3 x, double reach, Proximity& r) {
  r.two_sided = false;
  switch (placed.part->kind) {
    case PartKind::kPlane: {
      r.normal = placed.axes.c[2];
      r.distance = dot(x - placed.centre, r.normal);
      r.point = x - r.distance * r.normal;
      return r.distance < reach;
    }
    case PartKind::kSphere: return from_axis(x, placed.centre, {}, placed.part->radius, reach, r);
    case PartKind::kCapsule: {
      const double t = closest_on_segment(x, placed.centre, placed.end);
      return from_axis(x, lerp(placed.centre, placed.end, t), placed.end - placed.centre, placed.part->radius, reach,
                       r);
    }
    case PartKind::kBox: return from_box(placed, x, reach, r);
    case PartKind::kMesh: return from_mesh(placed, x, reach, r);
  }
  return false;
}

}  // namespace kerf
