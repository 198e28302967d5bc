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
