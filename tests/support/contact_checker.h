// How deep bodies are in rigid shapes and in themselves, by brute force over dense samples and nothing of the code under
// test but its data: no tree, no memory, no speculation. Slow.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "kerf/contact/contact_surface.h"
#include "kerf/contact/rigid_shape.h"

namespace kerf::testing_support {

struct PrismView {
  std::span<const Vec3> position, offset;  ///< |V|
  std::span<const std::array<std::int32_t, 3>> triangles;

  [[nodiscard]] Vec3 at(std::size_t f, double u, double v, double lift) const {
    const double w[3] = {1 - u - v, u, v};
    Vec3 p;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto c = static_cast<std::size_t>(triangles[f][i]);
      p += w[i] * (position[c] + lift * offset[c]);
    }
    return p;
  }
};

inline std::vector<std::array<std::int32_t, 3>> triangles_of(const ContactSurface& surface) {
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (const CollisionTriangle f : ids<CollisionTriangle>(surface.face_count())) {
    const auto c = surface.vertices(f);
    triangles.push_back({c[0].value, c[1].value, c[2].value});
  }
  return triangles;
}

/// Closest point of a triangle by trying its plane, its edges and its corners.
inline double brute_triangle_distance(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const auto segment = [&](Vec3 s, Vec3 e) {
    const Vec3 d = e - s;
    const double l = dot(d, d), t = l > 0 ? std::clamp(dot(p - s, d) / l, 0.0, 1.0) : 0;
    return norm(p - s - t * d);
  };
  double best = std::min({segment(a, b), segment(b, c), segment(c, a)});
  const Vec3 n = cross(b - a, c - a);
  if (const double l = norm(n); l > 0) {
    const Vec3 u = (1 / l) * n;
    const double height = dot(p - a, u);
    const Vec3 q = p - height * u;
    if (dot(cross(b - a, q - a), n) >= 0 && dot(cross(c - b, q - b), n) >= 0 && dot(cross(a - c, q - c), n) >= 0)
      best = std::min(best, std::fabs(height));
  }
  return best;
}

/// How often a closed mesh goes round a point (van Oosterom and Strackee 1983).
inline double winding_number(const ObstacleMesh& mesh, Vec3 p) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    std::array<Vec3, 3> d;
    for (std::size_t i = 0; i < 3; ++i) d[i] = mesh.positions[static_cast<std::size_t>(mesh.corners[3 * t + i])] - p;
    const double a = norm(d[0]), b = norm(d[1]), c = norm(d[2]);
    sum += 2 * std::atan2(dot(d[0], cross(d[1], d[2])),
                          a * b * c + dot(d[0], d[1]) * c + dot(d[1], d[2]) * a + dot(d[2], d[0]) * b);
  }
  return sum / (4 * 3.14159265358979323846);
}

/// Signed distance of a point from one part of a shape, m; negative inside. An open mesh has no inside.
inline double brute_distance(const RigidShape& shape, const ShapePart& part, Vec3 world) {
  const Vec3 x = transposed_times(shape.axes, world - shape.position);
  switch (part.kind) {
    case PartKind::kPlane: return dot(x - part.centre, part.axes.c[2]);
    case PartKind::kSphere: return norm(x - part.centre) - part.radius;
    case PartKind::kCapsule: {
      const Vec3 d = part.end - part.centre;
      const double l = dot(d, d), t = l > 0 ? std::clamp(dot(x - part.centre, d) / l, 0.0, 1.0) : 0;
      return norm(x - part.centre - t * d) - part.radius;
    }
    case PartKind::kBox: {
      const Vec3 l = transposed_times(part.axes, x - part.centre);
      const Vec3 q{std::fabs(l.x) - part.half.x, std::fabs(l.y) - part.half.y, std::fabs(l.z) - part.half.z};
      const Vec3 out{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
      return norm(out) + std::min(std::max({q.x, q.y, q.z}), 0.0) - part.radius;
    }
    case PartKind::kMesh: {
      const Vec3 l = transposed_times(part.axes, x - part.centre);
      const ObstacleMesh& m = *part.mesh;
      double best = HUGE_VAL;
      for (std::size_t t = 0; t < m.triangle_count(); ++t) {
        const auto c = [&](std::size_t i) { return m.positions[static_cast<std::size_t>(m.corners[3 * t + i])]; };
        best = std::min(best, brute_triangle_distance(l, c(0), c(1), c(2)));
      }
      return m.closed && winding_number(m, l) > 0.5 ? -best : best;
    }
  }
  return HUGE_VAL;
}

/// Calls f(u, v) for the points of a regular grid over a triangle, n + 1 along each edge.
template <class Fn>
void for_samples(int n, Fn&& f) {
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j) f(static_cast<double>(i) / n, static_cast<double>(j) / n);
}

/// The deepest that the two faces of a body are in a shape, m (at least 0), over (n + 1)(n + 2) / 2 samples a triangle and side.
inline double deepest_in_shape(const PrismView& body, const RigidShape& shape, int n) {
  double deepest = 0, size = 0;  // of a ball around the shape
  for (const ShapePart& part : shape.parts)
    size = std::max({size, norm(part.centre) + part.radius + norm(part.half), norm(part.end) + part.radius,
                     part.mesh ? norm(part.centre) + norm(part.mesh->box.center()) + part.mesh->box.diagonal() : 0});
  for (std::size_t f = 0; f < body.triangles.size(); ++f)
    for_samples(n, [&](double u, double v) {
      for (const double lift : {-1.0, 1.0})
        for (const ShapePart& part : shape.parts) {
          const Vec3 p = body.at(f, u, v, lift);
          if (norm(p - shape.position) < size || part.kind == PartKind::kPlane)
            deepest = std::max(deepest, -brute_distance(shape, part, p));
        }
    });
  return deepest;
}

/// How deep a point is in the prism over one triangle, along the triangle's normal, m; 0 or less: it is not.
inline double depth_in_prism(const PrismView& body, std::size_t f, Vec3 p) {
  const auto& t = body.triangles[f];
  const auto x = [&](std::size_t i) { return body.position[static_cast<std::size_t>(t[i])]; };
  const auto o = [&](std::size_t i) { return body.offset[static_cast<std::size_t>(t[i])]; };
  const Vec3 ab = x(1) - x(0), ac = x(2) - x(0), n = cross(ab, ac);
  const double area = dot(n, n);
  if (!(area > 0)) return 0;
  const double wb = dot(n, cross(p - x(0), ac)) / area, wc = dot(n, cross(ab, p - x(0))) / area, wa = 1 - wb - wc;
  if (wa < 0 || wb < 0 || wc < 0) return 0;
  const Vec3 unit = (1 / std::sqrt(area)) * n;
  return std::fabs(dot(unit, wa * o(0) + wb * o(1) + wc * o(2))) - std::fabs(dot(unit, p - x(0)));
}

/// The deepest that a face of a body is in its own prisms elsewhere, m: where the rest distance is over `apart` metres.
inline double deepest_in_itself(const PrismView& body, std::span<const Vec3> rest, double apart, int n) {
  double deepest = 0;
  for (std::size_t f = 0; f < body.triangles.size(); ++f) {
    const auto middle = [&](std::size_t t) {
      Vec3 m;
      for (const std::int32_t c : body.triangles[t]) m += (1.0 / 3) * rest[static_cast<std::size_t>(c)];
      return m;
    };
    for (std::size_t g = 0; g < body.triangles.size(); ++g) {
      if (norm(middle(f) - middle(g)) < apart) continue;
      for_samples(n, [&](double u, double v) {
        for (const double lift : {-1.0, 1.0})
          deepest = std::max(deepest, depth_in_prism(body, g, body.at(f, u, v, lift)));
      });
    }
  }
  return deepest;
}

}  // namespace kerf::testing_support
