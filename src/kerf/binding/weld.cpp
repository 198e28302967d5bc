#include "kerf/binding/weld.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>

#include "kerf/base/at.h"
#include "kerf/base/parallel.h"
#include "kerf/base/prefetch.h"
#include "kerf/binding/tolerances.h"
#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/surface_tolerances.h"

namespace kerf {
namespace {

std::uint64_t hash_position(Vec3 p) {
  std::uint64_t h = 0;
  for (int k = 0; k < 3; ++k) {
    h = (h ^ std::bit_cast<std::uint64_t>(p[k] + 0.0)) * 0x9e3779b97f4a7c15ull;  // + 0.0: -0 and 0 are one place
    h ^= h >> 32;
  }
  return h;
}

struct Range {
  Box3 box;
  std::size_t not_finite;  ///< the first such vertex; the mesh's vertex count: none
};
Range range_of(const TriangleMesh& mesh, std::size_t begin, std::size_t end) {
  Vec3 low = mesh.positions[VertexId(begin)], high = low;
  for (std::size_t v = begin; v < end; ++v) {
    const Vec3 p = mesh.positions[VertexId(v)];
    if (!is_finite(p)) return {{}, v};
    low = {p.x < low.x ? p.x : low.x, p.y < low.y ? p.y : low.y, p.z < low.z ? p.z : low.z};
    high = {p.x > high.x ? p.x : high.x, p.y > high.y ? p.y : high.y, p.z > high.z ? p.z : high.z};
  }
  return {{low, high}, mesh.positions.size()};
}

bool is_flat(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 u = b - a, v = c - a, w = c - b;
  return !(norm(cross(u, v)) > kZeroAreaFraction * std::max({dot(u, u), dot(v, v), dot(w, w)}));
}

constexpr std::size_t kChunk = 1 << 16;  // vertices or triangles

}  // namespace

Result<WeldedSurface> weld(const TriangleMesh& mesh, std::string_view name, bool merge) {
  const std::size_t nv = mesh.positions.size();
  if (mesh.triangles.empty()) return bad_input(fmt::format("{}: it has no triangles", name));
  if (mesh.has_texture() && mesh.texture.size() != mesh.triangles.size())
    return bad_input(fmt::format("{}: {} triangles, but texture coordinates for {}", name, mesh.triangles.size(),
                                 mesh.texture.size()));
  std::vector<Range> ranges((nv + kChunk - 1) / kChunk, Range{{}, nv});
  parallel_for(nv, kChunk,
               [&](std::size_t begin, std::size_t end) { ranges[begin / kChunk] = range_of(mesh, begin, end); });
  Box3 bounds;
  for (const Range& range : ranges) {
    if (range.not_finite != nv)
      return bad_input(
          fmt::format("{}: vertex {} has a coordinate that is not a finite number", name, range.not_finite + 1));
    bounds.add(range.box.min);
    bounds.add(range.box.max);
  }
  if (!(bounds.diagonal() > 1e-100 && bounds.diagonal() < 1e100))
    return bad_input(fmt::format("{}: its size is {:g} m; scale it to metres", name, bounds.diagonal()));
  std::vector<std::uint8_t> used(nv, 0);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    for (const VertexId v : mesh.triangles[TriangleId(f)]) {
      if (!v.valid() || v.index() >= nv)
        return bad_input(fmt::format("{}: triangle {} refers to vertex {}, but there are {} vertices", name, f + 1,
                                     v.value + 1, nv));
      used[v.index()] = 1;
    }

  WeldedSurface out;
  std::size_t capacity = 16;
  while (capacity < 2 * nv) capacity *= 2;
  std::vector<std::int32_t> table(capacity, -1), rename(nv, -1);
  out.positions.reserve(nv);
  out.original.reserve(nv);
  std::array<std::uint64_t, kPrefetchAhead> hashes{};  // of the next vertices: their slots are asked for early
  const auto ask = [&](std::size_t v) {
    const std::uint64_t hash = hash_position(mesh.positions[VertexId(v)]);
    __builtin_prefetch(table.data() + (hash & (capacity - 1)));
    hashes[v % kPrefetchAhead] = hash;
  };
  for (std::size_t v = 0; v < std::min(nv, kPrefetchAhead); ++v) ask(v);
  for (std::size_t v = 0; v < nv; ++v) {
    const std::uint64_t hash = hashes[v % kPrefetchAhead];
    if (v + kPrefetchAhead < nv) ask(v + kPrefetchAhead);
    if (!used[v]) {
      ++out.unused;
      continue;
    }
    const Vec3 p = mesh.positions[VertexId(v)];
    std::size_t slot = hash & (capacity - 1);
    while (table[slot] >= 0 && !(out.positions[at(table[slot])] == p)) slot = (slot + 1) & (capacity - 1);
    if (table[slot] < 0) {
      table[slot] = static_cast<std::int32_t>(out.positions.size());
      out.positions.push_back(p);
      out.original.push_back(static_cast<std::int32_t>(v));
    } else if (merge) {
      ++out.merged;
    } else {
      ++out.apart;
      rename[v] = static_cast<std::int32_t>(out.positions.size());
      out.positions.push_back(p);
      out.original.push_back(static_cast<std::int32_t>(v));
      continue;
    }
    rename[v] = table[slot];
  }
  const std::size_t nf = mesh.triangles.size();
  out.triangles.resize(nf);
  std::vector<std::size_t> flat((nf + kChunk - 1) / kChunk, nf);  // the first one of every chunk
  parallel_for(nf, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto& t = mesh.triangles[TriangleId(f)];
      const std::array<std::int32_t, 3> r{rename[t[0].index()], rename[t[1].index()], rename[t[2].index()]};
      out.triangles[f] = r;
      if (flat[begin / kChunk] == nf &&
          is_flat(out.positions[at(r[0])], out.positions[at(r[1])], out.positions[at(r[2])]))
        flat[begin / kChunk] = f;
    }
  });
  for (const std::size_t f : flat) {
    if (f == nf) continue;
    const auto& t = mesh.triangles[TriangleId(f)];
    return bad_input(
        fmt::format("{}: triangle {} (vertices {}, {}, {}) has no area; remove it or move its vertices apart", name,
                    f + 1, t[0].value + 1, t[1].value + 1, t[2].value + 1));
  }
  std::vector<std::size_t> around(out.positions.size(), 0);
  for (const auto& t : out.triangles)
    for (const std::int32_t v : t) ++around[at(v)];
  const auto most = std::max_element(around.begin(), around.end());
  if (*most > kMostAround) {
    const std::int32_t vertex = out.original[static_cast<std::size_t>(most - around.begin())];
    return bad_input(fmt::format("{}: {}", name, large_fan_text(fmt::format("vertex {}", vertex + 1), *most)));
  }
  return out;
}

}  // namespace kerf
