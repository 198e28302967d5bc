// How deep the two sides of a cut are in each other, by brute force over dense samples of their faces and walls: positions and offsets of the
// prisms are all that it takes from the code under test. Slow.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "support/contact_checker.h"

namespace kerf::testing_support {

/// The parts of a body on either side of a cut.
struct LipsView {
  PrismView prisms;
  std::vector<int> side;  ///< per triangle: 1, -1, or 0 for what does not matter
  struct Wall {
    std::int32_t from, to;  ///< corners of an edge made by the cut
    int side;
  };
  std::vector<Wall> walls;
};

/// Is a point in the prism over triangle f: x + l o for barycentric coordinates in the triangle and l from -1 to 1?
inline bool is_in_prism(const PrismView& body, std::size_t f, Vec3 p) {
  const auto& t = body.triangles[f];
  std::array<Vec3, 3> x, o;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = body.position[static_cast<std::size_t>(t[i])];
    o[i] = body.offset[static_cast<std::size_t>(t[i])];
  }
  double u = 1.0 / 3, v = 1.0 / 3, l = 0;
  for (int newton = 0; newton < 12; ++newton) {
    const Vec3 a = x[0] + l * o[0], up = (1 - u - v) * o[0] + u * o[1] + v * o[2];
    const Vec3 du = x[1] + l * o[1] - a, dv = x[2] + l * o[2] - a, rest = p - (a + u * du + v * dv);
    const double size = dot(du, cross(dv, up));
    if (size == 0) return false;
    const double step[3] = {dot(rest, cross(dv, up)) / size, dot(du, cross(rest, up)) / size,
                            dot(du, cross(dv, rest)) / size};
    u += step[0], v += step[1], l += step[2];
    const double moved = std::fabs(step[0]) + std::fabs(step[1]) + std::fabs(step[2]);
    if (moved < 1e-10) return u >= 0 && v >= 0 && u + v <= 1 && std::fabs(l) <= 1;
    if (!(std::fabs(u) + std::fabs(v) + std::fabs(l) < 40)) return false;
  }
  return false;  // it has not come to a place of the prism that is p
}

/// m from a point to a wall: 8 x 4 pieces of it, each as two triangles. (The wall is ruled; two triangles would leave it by up to a quarter of
/// what it is twisted by.)
inline double wall_distance(Vec3 p, Vec3 from_low, Vec3 to_low, Vec3 to_high, Vec3 from_high) {
  const auto at = [&](int i, int k) {
    return lerp(lerp(from_low, to_low, i / 8.0), lerp(from_high, to_high, i / 8.0), k / 4.0);
  };
  double least = HUGE_VAL;
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 4; ++k) {
      const Vec3 a = at(i, k), b = at(i + 1, k), c = at(i + 1, k + 1), d = at(i, k + 1);
      least = std::min({least, brute_triangle_distance(p, a, b, c), brute_triangle_distance(p, a, c, d)});
    }
  return least;
}

/// m from a point that is in the material of a side to its nearest face or wall; 0 where it is not in it.
inline double depth_in_side(const LipsView& lips, int side, Vec3 p) {
  const PrismView& body = lips.prisms;
  const auto corner = [&](std::int32_t v, double lift) {
    return body.position[static_cast<std::size_t>(v)] + lift * body.offset[static_cast<std::size_t>(v)];
  };
  std::vector<std::size_t> near;
  bool inside = false;
  for (std::size_t f = 0; f < body.triangles.size(); ++f) {
    if (lips.side[f] != side) continue;
    const Vec3 middle = body.at(f, 1.0 / 3, 1.0 / 3, 0);
    double size = 0;
    for (const std::int32_t v : body.triangles[f])
      size = std::max(size, norm(corner(v, 0) - middle) + 2 * norm(body.offset[static_cast<std::size_t>(v)]));
    if (norm(p - middle) > size) continue;
    near.push_back(f);
    inside = inside || is_in_prism(body, f, p);
  }
  if (!inside) return 0;
  double least = HUGE_VAL;
  for (const std::size_t f : near)
    for (const double lift : {-1.0, 1.0}) {
      const auto& t = body.triangles[f];
      least = std::min(least, brute_triangle_distance(p, corner(t[0], lift), corner(t[1], lift), corner(t[2], lift)));
    }
  for (const LipsView::Wall& w : lips.walls) {
    if (w.side != side) continue;
    least = std::min(least, wall_distance(p, corner(w.from, -1), corner(w.to, -1), corner(w.to, 1), corner(w.from, 1)));
  }
  return least;
}

/// The deepest that either side is in the other, m: 9 x 9 points of every wall, 15 of every face. May leave points out by their place at rest: beside
/// the end of a slit its sides hang together, and are no more apart than the material between them.
template <class Counts>
double deepest_between_sides(const LipsView& lips, std::span<const Vec3> rest, Counts&& counts) {
  const PrismView& body = lips.prisms;
  double deepest = 0;
  for (const LipsView::Wall& w : lips.walls)
    for (int i = 0; i <= 8; ++i) {
      const auto a = static_cast<std::size_t>(w.from), b = static_cast<std::size_t>(w.to);
      const double t = i / 8.0;
      if (!counts(lerp(rest[a], rest[b], t))) continue;
      for (double lift = -1; lift <= 1; lift += 0.25)
        deepest = std::max(deepest, depth_in_side(lips, -w.side,
                                                  lerp(body.position[a] + lift * body.offset[a],
                                                       body.position[b] + lift * body.offset[b], t)));
    }
  for (std::size_t f = 0; f < body.triangles.size(); ++f) {
    if (lips.side[f] == 0) continue;
    const auto& t = body.triangles[f];
    for_samples(4, [&](double u, double v) {
      const Vec3 at = (1 - u - v) * rest[static_cast<std::size_t>(t[0])] + u * rest[static_cast<std::size_t>(t[1])] +
                      v * rest[static_cast<std::size_t>(t[2])];
      if (!counts(at)) return;
      for (const double lift : {-1.0, 1.0})
        deepest = std::max(deepest, depth_in_side(lips, -lips.side[f], body.at(f, u, v, lift)));
    });
  }
  return deepest;
}

}  // namespace kerf::testing_support
