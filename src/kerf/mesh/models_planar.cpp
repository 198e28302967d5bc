#include "kerf/mesh/models_planar.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/at.h"
#include "kerf/mesh/half_edge_build.h"

namespace kerf::models {
namespace {

// Where the parts of a closed body lie in the unit square of its texture.
constexpr double kTextureMargin = 0.01;  // free strip around each part, so that filtering does not mix them
constexpr double kRimBand = 0.12;        // the rim strips lie in 1 - kRimBand .. 1
constexpr double kRimStretch = 1 - 2 * kTextureMargin;

Vec2f to_texture(Vec2 p) { return {static_cast<float>(p.x), static_cast<float>(p.y)}; }

struct TextureMap {
  Vec2 origin, min;
  double scale = 1, mirror = 1;
  [[nodiscard]] Vec2f operator()(Vec2 p) const {
    return to_texture({origin.x + mirror * scale * (p.x - min.x), origin.y + scale * (p.y - min.y)});
  }
};

/// Maps the box lo..hi into the rectangle rlo..rhi with one scale, centred.
TextureMap fit(Vec2 lo, Vec2 hi, Vec2 rlo, Vec2 rhi, bool mirrored) {
  const Vec2 size = hi - lo, room = rhi - rlo;
  TextureMap map;
  map.scale = std::min(room.x / size.x, room.y / size.y);
  const Vec2 rest = room - map.scale * size;
  map.min = lo;
  map.origin = rlo + 0.5 * rest;
  if (mirrored) {
    map.mirror = -1;
    map.origin.x += map.scale * size.x;
  }
  return map;
}

void planar_box(const PlanarMesh& mesh, Vec2& lo, Vec2& hi) {
  lo = {HUGE_VAL, HUGE_VAL};
  hi = {-HUGE_VAL, -HUGE_VAL};
  auto add = [&](Vec2 p) {
    lo = {std::min(lo.x, p.x), std::min(lo.y, p.y)};
    hi = {std::max(hi.x, p.x), std::max(hi.y, p.y)};
  };
  if (mesh.corners.empty())
    for (const Vec2 p : mesh.points) add(p);
  for (const auto& t : mesh.corners)
    for (const Vec2 p : t) add(p);
}

}  // namespace

PlanarMesh quad_grid(int nx, int ny, const std::function<Vec2(int, int)>& point,
                     const std::function<QuadSplit(int, int)>& split) {
  PlanarMesh mesh;
  const auto quads = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  mesh.points.reserve(at(nx + 1) * at(ny + 1));
  mesh.triangles.reserve(2 * quads);
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) mesh.points.push_back(point(i, j));
  bool holes = false;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const std::int32_t a = j * (nx + 1) + i, b = a + 1, d = a + nx + 1, c = d + 1;
      switch (split(i, j)) {
        case QuadSplit::kNone: holes = true; break;
        case QuadSplit::kSlash:
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({a, c, d});
          break;
        case QuadSplit::kBackslash:
          mesh.triangles.push_back({a, b, d});
          mesh.triangles.push_back({b, c, d});
          break;
        case QuadSplit::kCross: {
          const auto m = static_cast<std::int32_t>(mesh.points.size());
          mesh.points.push_back(0.25 *
                                (mesh.points[at(a)] + mesh.points[at(b)] + mesh.points[at(c)] + mesh.points[at(d)]));
          mesh.triangles.push_back({a, b, m});
          mesh.triangles.push_back({b, c, m});
          mesh.triangles.push_back({c, d, m});
          mesh.triangles.push_back({d, a, m});
        }
      }
    }
  if (holes) {  // drop the corners that no quad uses
    std::vector<std::int32_t> renamed(mesh.points.size(), -1);
    for (const auto& t : mesh.triangles)
      for (const std::int32_t v : t) renamed[at(v)] = 0;
    std::int32_t count = 0;
    for (std::size_t v = 0; v < renamed.size(); ++v)
      if (renamed[v] == 0) {
        mesh.points[at(count)] = mesh.points[v];
        renamed[v] = count++;
      }
    mesh.points.resize(at(count));
    for (auto& t : mesh.triangles)
      for (std::int32_t& v : t) v = renamed[at(v)];
    find_loops(mesh);
  } else {  // the outer loop is known, and big grids need not be searched for it
    std::vector<std::int32_t> loop;
    loop.reserve(2 * at(nx + ny));
    for (int i = 0; i < nx; ++i) loop.push_back(i);
    for (int j = 0; j < ny; ++j) loop.push_back(j * (nx + 1) + nx);
    for (int i = nx; i > 0; --i) loop.push_back(ny * (nx + 1) + i);
    for (int j = ny; j > 0; --j) loop.push_back(j * (nx + 1));
    mesh.loops.push_back(std::move(loop));
  }
  return mesh;
}

QuadSplit alternating_split(int i, int j, int nx, int ny) {
  const bool first_x = i == 0, first_y = j == 0, last_x = i == nx - 1, last_y = j == ny - 1;
  if ((first_x || last_x) && (first_y || last_y)) return first_x == first_y ? QuadSplit::kSlash : QuadSplit::kBackslash;
  return (i + j) % 2 == 0 ? QuadSplit::kSlash : QuadSplit::kBackslash;
}

void find_loops(PlanarMesh& mesh) {
  mesh.loops.clear();
  const auto built = build_half_edges(mesh.triangles, mesh.points.size());
  KERF_ASSERT(built.ok());
  const HalfEdgeArrays& he = *built;
  std::vector<std::int32_t> next(mesh.points.size(), -1);
  for (std::size_t h = 0; h < he.twin.size(); ++h)
    if (he.twin[h] < 0) next[at(mesh.triangles[h / 3][h % 3])] = mesh.triangles[h / 3][(h + 1) % 3];
  for (std::size_t v = 0; v < next.size(); ++v) {
    if (next[v] < 0) continue;
    std::vector<std::int32_t> loop;
    for (auto w = static_cast<std::int32_t>(v); next[at(w)] >= 0;) {
      loop.push_back(w);
      const std::int32_t to = next[at(w)];
      next[at(w)] = -1;
      w = to;
    }
    mesh.loops.push_back(std::move(loop));
  }
}

PlanarMesh subdivide(const PlanarMesh& mesh) {
  PlanarMesh fine;
  fine.points = mesh.points;
  const auto built = build_half_edges(mesh.triangles, mesh.points.size());
  KERF_ASSERT(built.ok());
  const HalfEdgeArrays& he = *built;
  std::vector<std::int32_t> middle(he.twin.size(), -1);
  for (std::size_t h = 0; h < middle.size(); ++h) {
    if (middle[h] >= 0) continue;
    const auto& t = mesh.triangles[h / 3];
    middle[h] = static_cast<std::int32_t>(fine.points.size());
    if (he.twin[h] >= 0) middle[at(he.twin[h])] = middle[h];
    fine.points.push_back(lerp(mesh.points[at(t[h % 3])], mesh.points[at(t[(h + 1) % 3])], 0.5));
  }
  fine.triangles.reserve(4 * mesh.triangles.size());
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& t = mesh.triangles[f];
    const std::int32_t a = middle[3 * f], b = middle[3 * f + 1], c = middle[3 * f + 2];
    fine.triangles.push_back({t[0], a, c});
    fine.triangles.push_back({t[1], b, a});
    fine.triangles.push_back({t[2], c, b});
    fine.triangles.push_back({a, b, c});
  }
  find_loops(fine);
  return fine;
}

TriangleMesh flat_surface(const PlanarMesh& mesh) {
  TriangleMesh out;
  out.positions.reserve(mesh.points.size());
  for (const Vec2 p : mesh.points) out.positions.push_back({p.x, p.y, 0});
  Vec2 lo, hi;
  planar_box(mesh, lo, hi);
  const TextureMap map = fit(lo, hi, {0, 0}, {1, 1}, false);
  out.triangles.reserve(mesh.triangles.size());
  out.texture.reserve(mesh.triangles.size());
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& t = mesh.triangles[f];
    out.triangles.push_back({VertexId(t[0]), VertexId(t[1]), VertexId(t[2])});
    std::array<Vec2f, 3> uv;
    for (std::size_t c = 0; c < 3; ++c) uv[c] = map(mesh.corners.empty() ? mesh.points[at(t[c])] : mesh.corners[f][c]);
    out.texture.push_back(uv);
  }
  return out;
}

TriangleMesh thicken(const PlanarMesh& mesh, const ThickShape& shape) {
  TriangleMesh out;
  const std::size_t n = mesh.points.size();
  std::size_t border = 0;
  for (const auto& loop : mesh.loops) border += loop.size();
  const auto rings = at(shape.rim_rings);
  const std::size_t faces = 2 * mesh.triangles.size() + 2 * border * (rings + 1);
  out.positions.reserve(2 * n + rings * border);
  out.triangles.reserve(faces);
  out.texture.reserve(faces);

  for (std::size_t i = 0; i < n; ++i) out.positions.push_back({mesh.points[i].x, mesh.points[i].y, shape.top(i)});
  for (std::size_t i = 0; i < n; ++i) out.positions.push_back({mesh.points[i].x, mesh.points[i].y, shape.bottom(i)});

  Vec2 lo, hi;
  planar_box(mesh, lo, hi);
  const double m = kTextureMargin;
  const TextureMap top = fit(lo, hi, {m, m}, {0.5 - m, 1 - kRimBand - m}, false);
  const TextureMap bottom = fit(lo, hi, {0.5 + m, m}, {1 - m, 1 - kRimBand - m}, true);
  const auto offset = static_cast<std::int32_t>(n);
  for (int side = 0; side < 2; ++side)
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const auto& t = mesh.triangles[f];
      auto uv = [&](std::size_t c) {
        const Vec2 p = mesh.corners.empty() ? mesh.points[at(t[c])] : mesh.corners[f][c];
        return side == 0 ? top(p) : bottom(p);
      };
      if (side == 0) {
        out.triangles.push_back({VertexId(t[0]), VertexId(t[1]), VertexId(t[2])});
        out.texture.push_back({uv(0), uv(1), uv(2)});
      } else {
        out.triangles.push_back({VertexId(t[0] + offset), VertexId(t[2] + offset), VertexId(t[1] + offset)});
        out.texture.push_back({uv(0), uv(2), uv(1)});
      }
    }

  const double band = kRimBand / static_cast<double>(mesh.loops.size());
  for (std::size_t l = 0; l < mesh.loops.size(); ++l) {
    const auto& loop = mesh.loops[l];
    const std::size_t first = out.positions.size(), count = loop.size();
    for (std::size_t r = 1; r <= rings; ++r) {
      const double t = static_cast<double>(r) / static_cast<double>(rings + 1);
      for (const std::int32_t v : loop) {
        const double z0 = shape.top(at(v)), z1 = shape.bottom(at(v));
        Vec2 p = mesh.points[at(v)];
        double z = z0 + t * (z1 - z0);
        if (shape.bulge) {  // half an ellipse; exact where its middle ring is
          const bool middle = 2 * r == rings + 1;
          p = p + (middle ? 1 : std::sin(M_PI * t)) * shape.bulge(at(v));
          if (!middle) z = 0.5 * (z0 + z1) + 0.5 * (z0 - z1) * std::cos(M_PI * t);
        }
        out.positions.push_back({p.x, p.y, z});
      }
    }
    std::vector<double> along(count + 1, 0);
    for (std::size_t i = 0; i < count; ++i) {
      double step = norm(mesh.points[at(loop[(i + 1) % count])] - mesh.points[at(loop[i])]);
      if (!mesh.corners.empty()) step = 1;  // the points jump where the region closes on itself
      along[i + 1] = along[i] + step;
    }
    const double v0 = 1 - band * static_cast<double>(l) - m, v1 = 1 - band * static_cast<double>(l + 1) + m;
    auto vertex = [&](std::size_t ring, std::size_t i) {
      const std::size_t k = i % count;
      if (ring == 0) return VertexId(loop[k]);
      if (ring == rings + 1) return VertexId(loop[k] + offset);
      return VertexId(first + (ring - 1) * count + k);
    };
    auto uv = [&](std::size_t ring, std::size_t i) {
      return to_texture({m + kRimStretch * along[i] / along[count],
                         v0 + (v1 - v0) * static_cast<double>(ring) / static_cast<double>(rings + 1)});
    };
    for (std::size_t r = 0; r <= rings; ++r)
      for (std::size_t i = 0; i < count; ++i) {
        const VertexId a = vertex(r + 1, i), b = vertex(r + 1, i + 1), c = vertex(r, i + 1), d = vertex(r, i);
        const Vec2f ta = uv(r + 1, i), tb = uv(r + 1, i + 1), tc = uv(r, i + 1), td = uv(r, i);
        if ((r + i) % 2 == 0) {
          out.triangles.push_back({a, b, c});
          out.texture.push_back({ta, tb, tc});
          out.triangles.push_back({a, c, d});
          out.texture.push_back({ta, tc, td});
        } else {
          out.triangles.push_back({a, b, d});
          out.texture.push_back({ta, tb, td});
          out.triangles.push_back({b, c, d});
          out.texture.push_back({tb, tc, td});
        }
      }
  }
  return out;
}

Box3 bounding_box(const TriangleMesh& mesh) {
  Box3 box;
  for (const Vec3 p : mesh.positions) box.add(p);
  return box;
}

LatticeHint lattice_around(const Box3& box, Vec3 cell) {
  LatticeHint hint;
  hint.cell = cell;
  const Vec3 size = box.size(), center = box.center();
  for (int k = 0; k < 3; ++k) {
    // A body that fills a whole number of cells up to rounding gets that number.
    const int count = std::max(1, static_cast<int>(std::ceil(size[k] / cell[k] - 1e-9)));
    hint.cells[static_cast<std::size_t>(k)] = count;
    hint.origin[k] = center[k] - 0.5 * count * cell[k];
  }
  return hint;
}

}  // namespace kerf::models
