#include "kerf/binding/weld.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

std::uint64_t hash_position(Vec3 p) {
  std::uint64_t h = 0;
  for (int k = 0; k < 3; ++k) {
    h = (h ^ std::bit_cast<std::uint64_t>(p[k] + 0.0)) * 0x9e3779b97f4a7c15ull;  // + 0.0: -0 and 0 are one place
    h ^= h >> 32;
  }
  return h;
}

}  // namespace

Result<WeldedSurface> weld(const TriangleMesh& mesh, std::string_view name) {
  const std::size_t nv = mesh.positions.size();
  if (mesh.triangles.empty()) return bad_input(fmt::format("{}: it has no triangles", name));
  if (mesh.has_texture() && mesh.texture.size() != mesh.triangles.size())
    return bad_input(fmt::format("{}: {} triangles, but texture coordinates for {}", name, mesh.triangles.size(), mesh.texture.size()));
  Box3 bounds;
  for (std::size_t v = 0; v < nv; ++v) {
    const Vec3 p = mesh.positions[VertexId(v)];
    if (!is_finite(p)) return bad_input(fmt::format("{}: vertex {} has a coordinate that is not a finite number", name, v + 1));
    bounds.add(p);
  }
  if (!(bounds.diagonal() > 1e-100 && bounds.diagonal() < 1e100))
    return bad_input(fmt::format("{}: its size is {:g} m; scale it to metres", name, bounds.diagonal()));
  std::vector<std::uint8_t> used(nv, 0);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (const VertexId v : mesh.triangles[TriangleId(f)]) {
      if (!v.valid() || v.index() >= nv)
        return bad_input(fmt::format("{}: triangle {} refers to vertex {}, but there are {} vertices", name, f + 1, v.value + 1, nv));
      used[v.index()] = 1;
    }

  WeldedSurface out;
  std::size_t capacity = 16;
  while (capacity < 2 * nv) capacity *= 2;
  std::vector<std::int32_t> table(capacity, -1), rename(nv, -1);
  out.positions.reserve(nv);
  for (std::size_t v = 0; v < nv; ++v) {
    if (!used[v]) {
      ++out.unused;
      continue;
    }
    const Vec3 p = mesh.positions[VertexId(v)];
    std::size_t slot = hash_position(p) & (capacity - 1);
    while (table[slot] >= 0 && !(out.positions[at(table[slot])] == p)) slot = (slot + 1) & (capacity - 1);
    if (table[slot] < 0) {
      table[slot] = static_cast<std::int32_t>(out.positions.size());
      out.positions.push_back(p);
      out.original.push_back(static_cast<std::int32_t>(v));
    } else {
      ++out.merged;
    }
    rename[v] = table[slot];
  }
  out.triangles.reserve(mesh.triangles.size());
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& t = mesh.triangles[TriangleId(f)];
    const std::array<std::int32_t, 3> r{rename[t[0].index()], rename[t[1].index()], rename[t[2].index()]};
    const Vec3 a = out.positions[at(r[0])], b = out.positions[at(r[1])], c = out.positions[at(r[2])];
    const double longest = std::max({norm(b - a), norm(c - a), norm(c - b)});
    if (!(norm(cross(b - a, c - a)) > kZeroAreaFraction * longest * longest))
      return bad_input(fmt::format("{}: triangle {} (vertices {}, {}, {}) has no area; remove it or move its vertices apart", name, f + 1,
                                   t[0].value + 1, t[1].value + 1, t[2].value + 1));
    out.triangles.push_back(r);
  }
  return out;
}

}  // namespace kerf
