#include "kerf/midsurface/laplacian.h"

#include <algorithm>
#include <cmath>

namespace kerf::mid {

Column<double> cotangent_weights(const SurfaceMesh& mesh) {
  Column<double> half(mesh.origin.size(), 0), out(mesh.origin.size(), 0);
  for (std::int32_t h = 0; h < mesh.origin.count(); ++h) {
    if (mesh.origin[h] < 0) continue;
    const Vec3 p = mesh.position[mesh.apex(h)], a = mesh.position[mesh.from(h)] - p, b = mesh.position[mesh.to(h)] - p;
    const double area = norm(cross(a, b)), scale = std::max(dot(a, a), dot(b, b));
    half[h] = 0.5 * dot(a, b) / std::max(area, 1e-9 * scale + 1e-300);
  }
  for (std::int32_t h = 0; h < mesh.origin.count(); ++h) {
    if (mesh.origin[h] < 0) continue;
    const double sum = half[h] + (mesh.twin[h] >= 0 ? half[mesh.twin[h]] : 0);
    out[h] = std::clamp(sum, 0.02, 10.0);
  }
  return out;
}

void add_laplacian(const SurfaceMesh& mesh, const Column<double>& weights, std::vector<SparseEntry>& entries) {
  entries.reserve(entries.size() + mesh.origin.size() * 2);
  for (std::int32_t h = 0; h < mesh.origin.count(); ++h) {
    if (!mesh.is_edge(h)) continue;
    const std::int32_t a = mesh.from(h), b = mesh.to(h);
    entries.push_back({a, a, weights[h]});
    entries.push_back({b, b, weights[h]});
    entries.push_back({std::max(a, b), std::min(a, b), -weights[h]});
  }
}

Column<double> vertex_areas(const SurfaceMesh& mesh) {
  Column<double> out(mesh.position.size(), 0);
  for (std::int32_t f = 0; f < mesh.face_count(); ++f) {
    if (!mesh.has_face(f)) continue;
    const double third = mesh.area(f) / 3;
    for (int k = 0; k < 3; ++k) out[mesh.origin[3 * f + k]] += third;
  }
  return out;
}

namespace {

/// The common part: fields first to 3 of the data; `fixed` vertices have the given values.
std::vector<std::vector<double>> solve_fields(const SurfaceMesh& mesh, const Column<double>& weights,
                                              std::span<const FieldDatum> data, std::size_t first,
                                              const Column<std::uint8_t>& fixed, const Fields* given) {
  const std::int32_t n = mesh.vertex_count();
  std::vector<SparseEntry> all, entries;
  add_laplacian(mesh, weights, all);
  std::vector<std::vector<double>> fields(4 - first, std::vector<double>(static_cast<std::size_t>(n), 0));
  for (const FieldDatum& d : data) {
    const int count = d.vertex[1] < 0 ? 1 : 3;
    const double share = 1.0 / count;
    for (int i = 0; i < count; ++i) {
      const std::int32_t a = d.vertex[i];
      for (std::size_t k = first; k < 4; ++k)
        fields[k - first][static_cast<std::size_t>(a)] += d.weight * share * d.value[k];
      for (int j = 0; j < count; ++j)
        if (a >= d.vertex[j]) all.push_back({a, d.vertex[j], d.weight * share * share});
    }
  }
  // Fixed vertices are taken out of the system: row and column of the identity.
  entries.reserve(all.size() + static_cast<std::size_t>(n));
  for (const SparseEntry& e : all) {
    if (!fixed[e.row] && !fixed[e.column]) entries.push_back(e);
    if (given == nullptr || fixed[e.row] == fixed[e.column]) continue;
    const std::int32_t to = fixed[e.row] ? e.column : e.row, of = fixed[e.row] ? e.row : e.column;
    for (std::size_t k = first; k < 4; ++k)
      fields[k - first][static_cast<std::size_t>(to)] -= e.value * (*given)[of][k];
  }
  for (std::int32_t v = 0; v < n; ++v)
    entries.push_back({v, v, fixed[v] ? 1.0 : 1e-9});  // 1e-9: closed and without data
  const SparseCholesky system(n, entries);
  for (std::size_t k = first; k < 4; ++k) {
    std::vector<double>& f = fields[k - first];
    for (std::int32_t v = 0; v < n; ++v)
      if (fixed[v]) f[static_cast<std::size_t>(v)] = (*given)[v][k];
    system.solve(f, f);
  }
  return fields;
}

}  // namespace

Fields smooth_fields(const SurfaceMesh& mesh, const Column<double>& weights, std::span<const FieldDatum> data,
                     const Fields& border) {
  Column<std::uint8_t> fixed(mesh.position.size());
  for (std::int32_t v = 0; v < mesh.vertex_count(); ++v) fixed[v] = !mesh.has_vertex(v) || mesh.on_border(v);
  const auto fields = solve_fields(mesh, weights, data, 0, fixed, &border);
  Fields out(mesh.position.size());
  for (std::size_t v = 0; v < mesh.position.size(); ++v)
    for (std::size_t k = 0; k < 4; ++k) out[static_cast<std::int32_t>(v)][k] = fields[k][v];
  return out;
}

Column<double> smooth_free_field(const SurfaceMesh& mesh, const Column<double>& weights,
                                 std::span<const FieldDatum> data) {
  const Column<std::uint8_t> free(mesh.position.size(), 0);
  return Column<double>(solve_fields(mesh, weights, data, 3, free, nullptr)[0]);
}

void fill_positions(const SurfaceMesh& mesh, const Column<double>& weights, const Column<std::uint8_t>& kept,
                    Column<Vec3>& positions) {
  Fields given(mesh.position.size());
  for (std::int32_t v = 0; v < mesh.vertex_count(); ++v)
    if (kept[v]) given[v] = {positions[v].x, positions[v].y, positions[v].z, 0};
  const auto fields = solve_fields(mesh, weights, {}, 0, kept, &given);
  for (std::int32_t v = 0; v < mesh.vertex_count(); ++v) {
    const auto i = static_cast<std::size_t>(v);
    if (!kept[v]) positions[v] = {fields[0][i], fields[1][i], fields[2][i]};
  }
}

}  // namespace kerf::mid
