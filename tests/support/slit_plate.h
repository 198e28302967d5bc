// A thin plate, or a sheet, with a slit whose lips lie on each other: what a cut that does not go through leaves.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// 12 x 8 cm in squares of 1 cm, flat. Slit along x = 6 cm over the first `rows` of 8 squares: all of them cut it in two.
inline TriangleMesh slit_sheet(int rows) {
  constexpr int kAlong = 12, kAcross = 8, kMiddle = kAlong / 2;
  TriangleMesh mesh;
  for (int i = 0; i <= kAlong; ++i)
    for (int j = 0; j <= kAcross; ++j) mesh.positions.push_back({0.01 * i, 0.01 * j, 0});
  std::map<int, int> lip;
  for (int j = 0; j < (rows < kAcross ? rows : kAcross + 1); ++j) {
    lip[j] = static_cast<int>(mesh.positions.size());
    mesh.positions.push_back({0.01 * kMiddle, 0.01 * j, 0});
  }
  for (int i = 0; i < kAlong; ++i)
    for (int j = 0; j < kAcross; ++j) {
      const auto at = [&](int a, int b) {
        const auto other = lip.find(b);
        return VertexId(a == kMiddle && i >= kMiddle && other != lip.end() ? other->second : a * (kAcross + 1) + b);
      };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

/// The same, 4 mm thick and closed: 3.84e-5 m3. The walls of the two lips have other diagonals.
inline TriangleMesh slit_plate(int rows) {
  const TriangleMesh sheet = slit_sheet(rows);
  const auto n = static_cast<int>(sheet.positions.size());
  TriangleMesh mesh;
  for (const double z : {0.002, -0.002})
    for (const Vec3 p : sheet.positions) mesh.positions.push_back({p.x, p.y, z});
  const auto below = [&](VertexId v) { return VertexId(v.value + n); };
  std::map<std::pair<int, int>, bool> edges;
  for (const auto& t : sheet.triangles) {
    mesh.triangles.push_back(t);
    mesh.triangles.push_back({below(t[2]), below(t[1]), below(t[0])});
    for (std::size_t k = 0; k < 3; ++k) edges[{t[k].value, t[(k + 1) % 3].value}] = true;
  }
  for (const auto& [edge, _] : edges) {
    if (edges.contains({edge.second, edge.first})) continue;
    const VertexId a(edge.first), b(edge.second);
    mesh.triangles.push_back({b, a, below(a)});
    mesh.triangles.push_back({b, below(a), below(b)});
  }
  return mesh;
}

/// Divides the edge between two vertices, at a part of the way from the first; returns the new vertex.
inline VertexId divide_edge(TriangleMesh& mesh, VertexId a, VertexId b, double part) {
  const VertexId middle = mesh.positions.push_back(lerp(mesh.positions[a], mesh.positions[b], part));
  std::vector<std::array<VertexId, 3>> others;
  for (auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const VertexId p = t[k], q = t[(k + 1) % 3], apex = t[(k + 2) % 3];
      if (!((p == a && q == b) || (p == b && q == a))) continue;
      others.push_back({middle, q, apex});
      t = {p, middle, apex};
      break;
    }
  for (const auto& t : others) mesh.triangles.push_back(t);
  return middle;
}

}  // namespace kerf
