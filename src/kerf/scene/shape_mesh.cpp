#include "kerf/scene/shape_mesh.h"

#include <cmath>
#include <numbers>

namespace kerf {
namespace {

constexpr int kAround = 48, kCap = 12;  // corners around, rings of a hemisphere

Mat3 axes_along(Vec3 w) {
  const Vec3 z = norm(w) > 0 ? normalized(w) : Vec3{0, 0, 1};
  const Vec3 x = normalized(cross(std::fabs(z.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, z));
  Mat3 m;
  m.c = {x, cross(z, x), z};
  return m;
}

/// A capsule from a to b; a ball where they are the same.
void add_capsule(Vec3 a, Vec3 b, double radius, ShapeMesh& out) {
  const Mat3 axes = axes_along(b - a);
  const auto first = static_cast<std::int32_t>(out.positions.size());
  const auto ring = [&](Vec3 centre, double polar) {  // from the pole at b
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * std::numbers::pi * k / kAround;
      out.positions.push_back(centre + radius * (axes * Vec3{std::sin(polar) * std::cos(angle),
                                                             std::sin(polar) * std::sin(angle), std::cos(polar)}));
    }
  };
  for (int i = 1; i <= kCap; ++i) ring(b, std::numbers::pi / 2 * i / kCap);
  for (int i = 0; i < kCap; ++i) ring(a, std::numbers::pi / 2 * (1 + static_cast<double>(i) / kCap));
  const auto at = [&](int r, int k) { return first + static_cast<std::int32_t>(r * kAround + k % kAround); };
  for (int r = 0; r + 1 < 2 * kCap; ++r)
    for (int k = 0; k < kAround; ++k) {
      out.triangles.push_back({at(r, k), at(r + 1, k), at(r + 1, k + 1)});
      out.triangles.push_back({at(r, k), at(r + 1, k + 1), at(r, k + 1)});
    }
  const auto top = static_cast<std::int32_t>(out.positions.size());
  out.positions.push_back(b + radius * axes.c[2]);
  out.positions.push_back(a - radius * axes.c[2]);
  for (int k = 0; k < kAround; ++k) {
    out.triangles.push_back({top, at(0, k), at(0, k + 1)});
    out.triangles.push_back({top + 1, at(2 * kCap - 1, k + 1), at(2 * kCap - 1, k)});
  }
}

void add_box(const ShapePart& part, ShapeMesh& out) {
  const auto first = static_cast<std::int32_t>(out.positions.size());
  const Vec3 half = part.half + Vec3{part.radius, part.radius, part.radius};
  for (int c = 0; c < 8; ++c)
    out.positions.push_back(part.centre + part.axes * Vec3{(c & 1) ? half.x : -half.x, (c & 2) ? half.y : -half.y,
                                                           (c & 4) ? half.z : -half.z});
  constexpr std::int32_t kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : kFaces) {
    out.triangles.push_back({first + f[0], first + f[1], first + f[2]});
    out.triangles.push_back({first + f[0], first + f[2], first + f[3]});
  }
}

void add_plane(const ShapePart& part, double size, ShapeMesh& out) {
  const auto first = static_cast<std::int32_t>(out.positions.size());
  const double h = size / 2;
  for (const Vec2 p : {Vec2{-h, -h}, Vec2{h, -h}, Vec2{h, h}, Vec2{-h, h}})
    out.positions.push_back(part.centre + p.x * part.axes.c[0] + p.y * part.axes.c[1]);
  out.triangles.push_back({first, first + 1, first + 2});
  out.triangles.push_back({first, first + 2, first + 3});
}

void add_mesh(const ShapePart& part, ShapeMesh& out) {
  const auto first = static_cast<std::int32_t>(out.positions.size());
  for (const Vec3 p : part.mesh->positions) out.positions.push_back(part.centre + part.axes * p);
  const std::vector<std::int32_t>& c = part.mesh->corners;
  for (std::size_t i = 0; i + 2 < c.size(); i += 3)
    out.triangles.push_back({first + c[i], first + c[i + 1], first + c[i + 2]});
}

}  // namespace

ShapeMesh shape_mesh(std::span<const ShapePart> parts, double plane_size) {
  ShapeMesh out;
  for (const ShapePart& part : parts) {
    switch (part.kind) {
      case PartKind::kPlane: add_plane(part, plane_size, out); break;
      case PartKind::kSphere: add_capsule(part.centre, part.centre, part.radius, out); break;
      case PartKind::kCapsule: add_capsule(part.centre, part.end, part.radius, out); break;
      case PartKind::kBox: add_box(part, out); break;
      case PartKind::kMesh: add_mesh(part, out); break;
    }
  }
  return out;
}

}  // namespace kerf
