// Closed bodies over a flat mesh: its triangles above and below at a height of one's own, and a straight side along its border.
#pragma once

#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "kerf/mesh/triangle_mesh.h"

namespace kerf::testing_support {

/// half(p): half the thickness over a point of the flat mesh (in the plane z = 0, counter-clockwise). The side has `layers` rows of two triangles an edge.
template <class Half>
TriangleMesh extruded(const TriangleMesh& flat, int layers, Half&& half) {
  TriangleMesh body;
  const auto n = static_cast<std::int32_t>(flat.positions.size());
  for (const double sign : {1.0, -1.0})
    for (const Vec3 p : flat.positions) body.positions.push_back({p.x, p.y, sign * half(p)});
  std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
  for (const auto& t : flat.triangles) {
    body.triangles.push_back(t);
    body.triangles.push_back({VertexId(t[0].value + n), VertexId(t[2].value + n), VertexId(t[1].value + n)});
    for (std::size_t k = 0; k < 3; ++k) edges[{t[k].value, t[(k + 1) % 3].value}] = 1;
  }
  std::map<std::int32_t, std::vector<VertexId>> column;  // of border vertices, from the top down
  const auto column_of = [&](std::int32_t v) -> const std::vector<VertexId>& {
    auto& c = column[v];
    if (!c.empty()) return c;
    c.push_back(VertexId(v));
    const Vec3 p = flat.positions[VertexId(v)];
    for (int l = 1; l < layers; ++l)
      c.push_back(body.positions.push_back({p.x, p.y, half(p) * (1 - 2.0 * l / layers)}));
    c.push_back(VertexId(v + n));
    return c;
  };
  for (const auto& [edge, once] : edges) {
    if (edges.contains({edge.second, edge.first})) continue;
    const auto a = column_of(edge.first), b = column_of(edge.second);
    for (std::size_t l = 0; l + 1 < a.size(); ++l) {
      body.triangles.push_back({a[l], a[l + 1], b[l + 1]});
      body.triangles.push_back({a[l], b[l + 1], b[l]});
    }
  }
  return body;
}

using Outline = std::vector<Vec3>;  ///< in the plane z = 0, counter-clockwise

inline Outline circle(Vec3 middle, double radius, int corners, double from = 0) {
  Outline out;
  for (int i = 0; i < corners; ++i) {
    const double a = from + 2 * 3.14159265358979323846 * i / corners;
    out.push_back(middle + Vec3{radius * std::cos(a), radius * std::sin(a), 0});
  }
  return out;
}

/// A flat part as CAD programs triangulate it, by cutting ears off: no vertex but the corners, fans of long thin triangles.
inline TriangleMesh cut_in_ears(const Outline& outline, const std::vector<Outline>& holes) {
  TriangleMesh flat;
  const auto add = [&](const Outline& loop, std::vector<VertexId>& ids) {
    for (const Vec3 p : loop) ids.push_back(flat.positions.push_back(p));
  };
  std::vector<VertexId> polygon;
  add(outline, polygon);
  std::vector<std::vector<VertexId>> left(holes.size());
  for (std::size_t h = 0; h < holes.size(); ++h) add({holes[h].rbegin(), holes[h].rend()}, left[h]);
  while (!left.empty()) {  // a slit to the nearest hole, which nothing can lie across
    std::size_t hole = 0, from = 0, to = 0;
    double least = HUGE_VAL;
    for (std::size_t h = 0; h < left.size(); ++h)
      for (std::size_t i = 0; i < polygon.size(); ++i)
        for (std::size_t j = 0; j < left[h].size(); ++j)
          if (const double d = norm(flat.positions[polygon[i]] - flat.positions[left[h][j]]); d < least) {
            least = d;
            hole = h;
            from = i;
            to = j;
          }
    std::vector<VertexId> way;
    for (std::size_t j = 0; j <= left[hole].size(); ++j) way.push_back(left[hole][(to + j) % left[hole].size()]);
    way.push_back(polygon[from]);
    polygon.insert(polygon.begin() + static_cast<std::ptrdiff_t>(from) + 1, way.begin(), way.end());
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(hole));
  }
  const auto turn = [&](VertexId a, VertexId b, VertexId c) {
    return cross(flat.positions[b] - flat.positions[a], flat.positions[c] - flat.positions[a]).z;
  };
  for (std::size_t i = 0, tried = 0; polygon.size() > 2 && tried <= polygon.size(); ++i, ++tried) {
    const std::size_t n = polygon.size();
    const VertexId a = polygon[i % n], b = polygon[(i + 1) % n], c = polygon[(i + 2) % n];
    bool ear = turn(a, b, c) > 0;
    for (const VertexId v : polygon)
      ear = ear && (v == a || v == b || v == c || turn(a, b, v) < 0 || turn(b, c, v) < 0 || turn(c, a, v) < 0);
    if (!ear) continue;
    flat.triangles.push_back({a, b, c});
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>((i + 1) % n));
    i = i % n - ((i + 1) % n < i % n ? 1 : 0) - 1;  // the same corner again: fans
    tried = 0;
  }
  return flat;
}

/// A round plate whose caps are one fan each, from a vertex of the rim, as CAD programs write them: 4 n - 4 triangles.
inline TriangleMesh fan_plate(int n, double radius, double half) {
  TriangleMesh cap;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * 3.14159265358979323846 * i / n;
    cap.positions.push_back({radius * std::cos(a), radius * std::sin(a), 0});
  }
  for (int i = 1; i + 1 < n; ++i) cap.triangles.push_back({VertexId(0), VertexId(i), VertexId(i + 1)});
  return extruded(cap, 1, [&](Vec3) { return half; });
}

}  // namespace kerf::testing_support
