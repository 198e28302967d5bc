// Triangles with neighbours in flat arrays, as every step of this module sees them. Half-edge h = 3 face + corner runs
// from origin[h] to origin[next(h)], its face on the left; twin[h] is -1 on a border. outgoing[v] is the first half-edge
// of v's fan (the border one, if v lies on a border), -1 for a vertex without faces. A face that was removed has
// origin -1 (edit_mesh.h).
#pragma once

#include <array>
#include <cstdint>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/mesh/triangle_mesh.h"
#include "kerf/midsurface/column.h"
#include "kerf/spatial/triangle_view.h"

namespace kerf::mid {

struct SurfaceMesh {
  Column<Vec3> position;          ///< |V|
  Column<std::int32_t> origin;    ///< 3 |F|
  Column<std::int32_t> twin;      ///< 3 |F|
  Column<std::int32_t> outgoing;  ///< |V|

  static constexpr std::int32_t next(std::int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static constexpr std::int32_t prev(std::int32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

  [[nodiscard]] std::int32_t vertex_count() const { return position.count(); }
  [[nodiscard]] std::int32_t face_count() const { return origin.count() / 3; }
  [[nodiscard]] bool has_face(std::int32_t f) const { return origin[3 * f] >= 0; }
  [[nodiscard]] bool has_vertex(std::int32_t v) const { return outgoing[v] >= 0; }
  [[nodiscard]] std::int32_t from(std::int32_t h) const { return origin[h]; }
  [[nodiscard]] std::int32_t to(std::int32_t h) const { return origin[next(h)]; }
  [[nodiscard]] std::int32_t apex(std::int32_t h) const { return origin[prev(h)]; }
  [[nodiscard]] bool on_border(std::int32_t v) const { return twin[outgoing[v]] < 0; }
  [[nodiscard]] double length(std::int32_t h) const { return norm(position[to(h)] - position[from(h)]); }
  /// Of each edge one half-edge: the border one or the one with the smaller number.
  [[nodiscard]] bool is_edge(std::int32_t h) const { return origin[h] >= 0 && (twin[h] < 0 || h < twin[h]); }
  [[nodiscard]] std::array<Vec3, 3> corners(std::int32_t f) const {
    return {position[origin[3 * f]], position[origin[3 * f + 1]], position[origin[3 * f + 2]]};
  }
  [[nodiscard]] Vec3 centroid(std::int32_t f) const {
    const auto [a, b, c] = corners(f);
    return (1.0 / 3) * (a + b + c);
  }
  /// Twice the area along the counter-clockwise normal.
  [[nodiscard]] Vec3 area_vector(std::int32_t f) const {
    const auto [a, b, c] = corners(f);
    return cross(b - a, c - a);
  }
  [[nodiscard]] Vec3 normal(std::int32_t f) const { return normalized(area_vector(f)); }
  [[nodiscard]] double area(std::int32_t f) const { return 0.5 * norm(area_vector(f)); }
  [[nodiscard]] TriangleView view() const { return {position, std::span<const std::int32_t>(origin)}; }

  /// Calls f(h) for every outgoing half-edge of v, one for each face, counter-clockwise.
  template <class Fn>
  void for_each_outgoing(std::int32_t v, Fn&& f) const {
    const std::int32_t start = outgoing[v];
    for (std::int32_t h = start; h >= 0;) {
      const std::int32_t next_one = twin[prev(h)];
      f(h);
      h = next_one;
      if (h == start) break;
    }
  }
  /// Calls f(vertex) for every neighbour of v.
  template <class Fn>
  void for_each_neighbour(std::int32_t v, Fn&& f) const {
    for_each_outgoing(v, [&](std::int32_t h) {
      f(to(h));
      if (twin[prev(h)] < 0) f(apex(h));
    });
  }
};

/// Connects triangles of an oriented manifold. Refuses what build_half_edges refuses.
Result<SurfaceMesh> connect(Column<Vec3> positions, const std::vector<std::array<std::int32_t, 3>>& triangles);
Result<SurfaceMesh> connect(const TriangleMesh& mesh);
/// The faces that are there; vertices without faces are dropped. vertex_of: receives for each new vertex the old one.
TriangleMesh to_triangle_mesh(const SurfaceMesh& mesh, std::vector<std::int32_t>* vertex_of = nullptr);
/// Renumbers: removed faces and vertices without faces go. Keeps the order of the others.
SurfaceMesh compacted(const SurfaceMesh& mesh, std::vector<std::int32_t>* vertex_of = nullptr);

struct Topology {
  std::int64_t euler = 0;  ///< vertices - edges + faces
  std::int32_t loops = 0;  ///< borders
  std::int32_t components = 0;
  friend bool operator==(const Topology&, const Topology&) = default;
};
Topology topology(const SurfaceMesh& mesh);
/// Border loops as vertices in the order of the border half-edges (faces on the left).
std::vector<std::vector<std::int32_t>> border_loops(const SurfaceMesh& mesh);

double total_area(const SurfaceMesh& mesh);
/// Metres; 0 without edges.
double mean_edge(const SurfaceMesh& mesh);
/// Signed, of a closed mesh.
double enclosed_volume(const SurfaceMesh& mesh);
/// Angle-weighted unit normals of the vertices.
Column<Vec3> vertex_normals(const SurfaceMesh& mesh);
Vec3 vertex_normal(const SurfaceMesh& mesh, std::int32_t v);

}  // namespace kerf::mid
