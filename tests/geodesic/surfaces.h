// Surfaces for the geodesic tests: generators, walls, and the insertion of a path by splitting what it crosses.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/geodesic/path_query.h"
#include "kerf/geodesic/walled_surface.h"
#include "kerf/mesh/half_edge_build.h"

namespace kerf::test {

using Triangles = std::vector<std::array<std::int32_t, 3>>;

inline WalledSurface make_surface(std::vector<Vec3> positions, const Triangles& triangles) {
  WalledSurface m;
  auto arrays = build_half_edges(triangles, positions.size());
  EXPECT_TRUE(arrays.ok()) << (arrays.ok() ? "" : arrays.error().message);
  m.position = std::move(positions);
  m.outgoing = arrays->outgoing;
  m.twin = arrays->twin;
  for (const auto& t : triangles) m.origin.insert(m.origin.end(), t.begin(), t.end());
  m.wall.assign(m.origin.size(), 0);
  m.wall_vertex.assign(m.position.size(), 0);
  for (std::size_t h = 0; h < m.twin.size(); ++h)
    if (m.twin[h] < 0) {
      m.wall_vertex[static_cast<std::size_t>(m.from(static_cast<std::int32_t>(h)))] = 1;
      m.wall_vertex[static_cast<std::size_t>(m.to(static_cast<std::int32_t>(h)))] = 1;
    }
  return m;
}

/// nx x ny quads over [0, 1] x [0, ny / nx], mapped by f(u, v); diagonals alternate by a hash so that they are irregular.
template <class F>
WalledSurface grid(int nx, int ny, F&& f, bool closed_u = false) {
  std::vector<Vec3> p;
  Triangles t;
  const int columns = closed_u ? nx : nx + 1;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i < columns; ++i) p.push_back(f(double(i) / nx, double(j) / nx));
  const auto id = [&](int i, int j) { return j * columns + (closed_u ? i % nx : i); };
  Random random(7);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const int a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
      if (random.index(2) == 0) {
        t.push_back({a, b, c});
        t.push_back({a, c, d});
      } else {
        t.push_back({a, b, d});
        t.push_back({b, c, d});
      }
    }
  return make_surface(std::move(p), t);
}

/// Subdivided octahedron pushed out to radius r(direction).
template <class R>
WalledSurface ball(int n, R&& r) {
  std::vector<Vec3> p;
  Triangles t;
  const Vec3 axes[6] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  const int faces[8][3] = {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2}, {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
  std::vector<std::pair<std::array<int, 3>, int>> known;  // lattice point on the octahedron -> vertex
  const auto vertex = [&](Vec3 q) {
    const std::array<int, 3> key{int(std::lround(q.x * n)), int(std::lround(q.y * n)), int(std::lround(q.z * n))};
    for (const auto& k : known)
      if (k.first == key) return k.second;
    const Vec3 d = normalized(q);
    p.push_back(r(d) * d);
    known.push_back({key, int(p.size()) - 1});
    return int(p.size()) - 1;
  };
  for (const auto& f : faces)
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        const auto at = [&](int a, int b) {
          return vertex((double(n - a - b) / n) * axes[f[0]] + (double(a) / n) * axes[f[1]] +
                        (double(b) / n) * axes[f[2]]);
        };
        t.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        if (i + j + 1 < n) t.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
  return make_surface(std::move(p), t);
}

inline double polyline_length(const WalledSurface& m, const SurfacePath& path) {
  const auto at = [&](const PathStop& s) {
    return s.half_edge < 0 ? m.at(s.vertex) : lerp(m.at(m.from(s.half_edge)), m.at(m.to(s.half_edge)), s.t);
  };
  double sum = 0;
  for (std::size_t i = 1; i < path.stops.size(); ++i) sum += norm(at(path.stops[i]) - at(path.stops[i - 1]));
  return sum;
}

inline std::int32_t nearest_vertex(const WalledSurface& m, Vec3 p) {
  std::int32_t best = 0;
  for (std::int32_t v = 0; v < std::int32_t(m.position.size()); ++v)
    if (norm(m.at(v) - p) < norm(m.at(best) - p)) best = v;
  return best;
}

inline void check_manifold(const WalledSurface& m) {
  for (std::int32_t h = 0; h < std::int32_t(m.origin.size()); ++h) {
    const std::int32_t o = m.opposite(h);
    if (o < 0) continue;
    ASSERT_EQ(m.opposite(o), h);
    ASSERT_EQ(m.from(o), m.to(h));
    ASSERT_EQ(m.wall[std::size_t(o)], m.wall[std::size_t(h)]);
  }
  for (std::int32_t v = 0; v < std::int32_t(m.position.size()); ++v) ASSERT_EQ(m.from(m.outgoing[std::size_t(v)]), v);
}

/// Splits the edge of h at fraction t; returns the new vertex. Old half-edges keep the part at from(h) of h and the
/// faces keep their numbers; two faces are appended.
inline std::int32_t split_edge(WalledSurface& m, std::int32_t h, double t) {
  const auto v = std::int32_t(m.position.size());
  m.position.push_back(lerp(m.at(m.from(h)), m.at(m.to(h)), t));
  m.wall_vertex.push_back(m.wall[std::size_t(h)]);
  m.outgoing.push_back(-1);
  const std::int32_t g = m.opposite(h);
  const auto link = [&](std::int32_t a, std::int32_t b) {
    m.twin[std::size_t(a)] = b;
    if (b >= 0) m.twin[std::size_t(b)] = a;
  };
  // Face of h (a, b, c) becomes (a, v, c); the appended face is (v, b, c).
  const auto split_face = [&](std::int32_t e) {
    const std::int32_t n = WalledSurface::next(e), b = m.from(n), c = m.apex(e);
    const auto f = std::int32_t(m.origin.size());
    m.origin.insert(m.origin.end(), {v, b, c});
    m.twin.insert(m.twin.end(), {-1, -1, -1});
    m.wall.insert(m.wall.end(), {m.wall[std::size_t(e)], m.wall[std::size_t(n)], 0});
    m.origin[std::size_t(n)] = v;
    link(f + 1, m.opposite(n));
    m.wall[std::size_t(n)] = 0;
    link(n, f + 2);
    if (m.outgoing[std::size_t(b)] == n) m.outgoing[std::size_t(b)] = f + 1;
    m.outgoing[std::size_t(v)] = f;
    return f;
  };
  // (a -> b) is h; g runs (b -> a): its first part stays b -> v, the appended one is v -> a.
  const std::int32_t fh = split_face(h);
  if (g < 0) {
    m.twin[std::size_t(fh)] = -1;
    return v;
  }
  const std::int32_t fg = split_face(g);
  link(h, fg);
  link(fh, g);
  return v;
}

/// The sector between walls that the face of outgoing half-edge h lies in; all faces if no wall meets the vertex.
inline Sector sector_of(const WalledSurface& m, std::int32_t h) {
  const auto passable = [&](std::int32_t e) { return m.opposite(e) >= 0 && m.wall[std::size_t(e)] == 0; };
  Sector sector{h, h};
  while (passable(sector.first)) {
    sector.first = rotate_cw(m, sector.first);
    if (sector.first == h) return {};
  }
  while (passable(WalledSurface::prev(sector.last))) sector.last = rotate_ccw(m, sector.last);
  return sector;
}

/// Inserts a path as a wall, crossing by crossing. A crossing is moved away from its ends by `margin`.
inline void insert_path(WalledSurface& m, const SurfacePath& path, double margin = 0.1) {
  std::vector<std::int32_t> chain;
  // A split keeps half-edge numbers of the remaining parts, so edges are named by their end vertices.
  std::vector<std::array<std::int32_t, 2>> ends;
  for (const PathStop& s : path.stops)
    ends.push_back(s.half_edge < 0 ? std::array{s.vertex, -1} : std::array{m.from(s.half_edge), m.to(s.half_edge)});
  const auto edge_between = [&](std::int32_t a, std::int32_t b) {
    std::int32_t found = -1;
    for_each_in_sector(m, a, {}, [&](std::int32_t h) {
      if (m.to(h) == b) found = h;
      if (m.apex(h) == b)
        found = m.opposite(WalledSurface::prev(h)) < 0 ? WalledSurface::prev(h) : m.opposite(WalledSurface::prev(h));
      return found < 0;
    });
    return found;
  };
  for (std::size_t i = 0; i < path.stops.size(); ++i) {
    if (ends[i][1] < 0) {
      chain.push_back(ends[i][0]);
      continue;
    }
    const std::int32_t h = edge_between(ends[i][0], ends[i][1]);
    ASSERT_GE(h, 0);
    ASSERT_EQ(m.wall[std::size_t(h)], 0);
    double t = std::clamp(path.stops[i].t, margin, 1 - margin);
    if (m.from(h) != ends[i][0]) t = 1 - t;
    chain.push_back(split_edge(m, h, t));
  }
  for (std::size_t i = 0; i < chain.size(); ++i) {
    m.wall_vertex[std::size_t(chain[i])] = 1;
    if (i == 0) continue;
    const std::int32_t h = edge_between(chain[i - 1], chain[i]);
    ASSERT_GE(h, 0) << "the path's own edge did not appear, step " << i << " of " << chain.size() - 1;
    ASSERT_EQ(m.wall[std::size_t(h)], 0);
    m.wall[std::size_t(h)] = 1;
    if (m.opposite(h) >= 0) m.wall[std::size_t(m.opposite(h))] = 1;
  }
}

}  // namespace kerf::test
