// Shapes beyond discs: shells, single triangles, thin discs whose rim a shortest path would leave.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "kerf/binding/bind.h"
#include "kerf/binding/validate_binding.h"

namespace kerf::bind_shapes_test {
namespace {

/// Octahedron subdivided n times and pushed onto a sphere.
TriangleMesh sphere(int subdivisions, double radius) {
  TriangleMesh m;
  for (const Vec3 p : {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}})
    m.positions.push_back(p);
  const int faces[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (const auto& f : faces) m.triangles.push_back({VertexId(f[0]), VertexId(f[1]), VertexId(f[2])});
  for (int i = 0; i < subdivisions; ++i) {
    std::map<std::pair<std::int32_t, std::int32_t>, VertexId> middle;
    IndexedArray<TriangleId, std::array<VertexId, 3>> finer;
    for (const auto& t : m.triangles) {
      VertexId mid[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const VertexId a = t[k], b = t[(k + 1) % 3];
        const auto key = std::minmax(a.value, b.value);
        const auto [it, is_new] = middle.try_emplace({key.first, key.second}, VertexId(m.positions.size()));
        if (is_new) m.positions.push_back(0.5 * (m.positions[a] + m.positions[b]));
        mid[k] = it->second;
      }
      finer.push_back({t[0], mid[0], mid[2]});
      finer.push_back({mid[0], t[1], mid[1]});
      finer.push_back({mid[2], mid[1], t[2]});
      finer.push_back({mid[0], mid[1], mid[2]});
    }
    m.triangles = finer;
  }
  for (Vec3& p : m.positions) p = radius * normalized(p);
  return m;
}

void append(TriangleMesh& m, const TriangleMesh& other, bool turned) {
  const auto n = static_cast<std::int32_t>(m.positions.size());
  for (const Vec3 p : other.positions) m.positions.push_back(p);
  for (auto t : other.triangles) {
    if (turned) std::swap(t[1], t[2]);
    m.triangles.push_back({VertexId(t[0].value + n), VertexId(t[1].value + n), VertexId(t[2].value + n)});
  }
}

/// Closed round plate of radius 1: rings of n vertices on top and bottom, joined by a wall with a middle ring; turned by a little, so
/// that nothing lines up with the collision mesh.
TriangleMesh plate(int n, int rings, double half) {
  TriangleMesh m;
  const auto at = [&](int layer, int ring, int i) {  // layer 0: top, 1: bottom
    return ring == 0 ? VertexId(layer * (1 + rings * n))
                     : VertexId(layer * (1 + rings * n) + 1 + (ring - 1) * n + (i % n));
  };
  for (int layer = 0; layer < 2; ++layer) {
    const double z = layer == 0 ? half : -half;
    m.positions.push_back({0, 0, z});
    for (int r = 1; r <= rings; ++r)
      for (int i = 0; i < n; ++i) {
        const double a = 2 * M_PI * (i + 0.37) / n, s = static_cast<double>(r) / rings;
        m.positions.push_back({s * std::cos(a), s * std::sin(a), z});
      }
  }
  const auto add = [&](VertexId a, VertexId b, VertexId c, bool turned) {
    if (turned) std::swap(b, c);
    m.triangles.push_back({a, b, c});
  };
  for (int layer = 0; layer < 2; ++layer)
    for (int i = 0; i < n; ++i) {
      add(at(layer, 0, 0), at(layer, 1, i), at(layer, 1, i + 1), layer == 1);
      for (int r = 1; r < rings; ++r) {
        add(at(layer, r, i), at(layer, r + 1, i), at(layer, r + 1, i + 1), layer == 1);
        add(at(layer, r, i), at(layer, r + 1, i + 1), at(layer, r, i + 1), layer == 1);
      }
    }
  const auto middle = static_cast<std::int32_t>(m.positions.size());
  for (int i = 0; i < n; ++i) {
    const double a = 2 * M_PI * (i + 0.37) / n;
    m.positions.push_back({std::cos(a), std::sin(a), 0});
  }
  for (int i = 0; i < n; ++i) {
    const VertexId p = VertexId(middle + i), q = VertexId(middle + (i + 1) % n);
    add(at(0, rings, i), p, q, false);
    add(at(0, rings, i), q, at(0, rings, i + 1), false);
    add(p, at(1, rings, i), at(1, rings, i + 1), false);
    add(p, at(1, rings, i + 1), q, false);
  }
  return m;
}

/// Regular polygon with k corners on the unit circle: a fan around the centre.
TriangleMesh polygon(int k) {
  TriangleMesh m;
  m.positions.push_back({0, 0, 0});
  for (int i = 0; i < k; ++i) m.positions.push_back({std::cos(2 * M_PI * i / k), std::sin(2 * M_PI * i / k), 0});
  for (int i = 0; i < k; ++i) m.triangles.push_back({VertexId(0), VertexId(1 + i), VertexId(1 + (i + 1) % k)});
  return m;
}

void expect_valid(const Result<BoundBody>& body, std::size_t triangles, const std::string& what) {
  ASSERT_TRUE(body.ok()) << what << ": " << body.error().message;
  const Status valid = validate_binding(body->complex);
  ASSERT_TRUE(valid.ok()) << what << ": " << valid.error().message;
  EXPECT_EQ(body->complex.collision.face_count(), triangles);
  EXPECT_NEAR(body->report.area_after / body->report.area_before, 1, 1e-12) << what;
  EXPECT_NEAR(body->report.volume_after / body->report.volume_before, 1, 1e-12) << what;
}

TEST(BindShapes, HollowSphere) {
  TriangleMesh skin = sphere(4, 1.05);
  append(skin, sphere(4, 0.95), true);
  for (const int level : {0, 1, 2}) {
    TriangleMesh middle = sphere(level, 1.0);
    for (Vec3& p : middle.positions)
      p = {p.x * std::cos(0.3) - p.y * std::sin(0.3), p.x * std::sin(0.3) + p.y * std::cos(0.3), p.z};
    const auto body = bind(skin, middle, {});
    expect_valid(body, middle.triangles.size(), fmt::format("sphere {}", level));
    if (!body) continue;
    for (const Vec3 offset : body->complex.collision.offset.raw()) EXPECT_NEAR(norm(offset), 0.05, 0.005);
  }
}

TEST(BindShapes, OneTriangle) {
  const TriangleMesh skin = plate(60, 8, 0.05);
  TriangleMesh one;
  for (int i = 0; i < 3; ++i) one.positions.push_back({std::cos(2 * M_PI * i / 3), std::sin(2 * M_PI * i / 3), 0});
  one.triangles.push_back({VertexId(0), VertexId(1), VertexId(2)});
  expect_valid(bind(skin, one, {}), 1, "closed");
  // The top alone: an open sheet.
  TriangleMesh sheet;
  for (std::size_t v = 0; v < 1 + 8 * 60; ++v) sheet.positions.push_back(skin.positions[VertexId(v)]);
  for (const auto& t : skin.triangles)
    if (t[0].index() < sheet.positions.size() && t[1].index() < sheet.positions.size() &&
        t[2].index() < sheet.positions.size())
      sheet.triangles.push_back(t);
  const auto body = bind(sheet, one, {.thickness = 0.1});
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_TRUE(validate_binding(body->complex).ok());
}

// The shortest way between rim points of a thin plate crosses its top when the points are far apart
// (s > about 4.6 sqrt(R t)); the binding follows the rim, so that both sides keep their half of the wall.
TEST(BindShapes, ThinPlateKeepsItsRim) {
  for (const int corners : {3, 5, 8, 16})
    for (const double half : {0.002, 0.01, 0.05}) {
      const auto body = bind(plate(97, 12, half), polygon(corners), {});
      const std::string what = fmt::format("{} corners, half thickness {}", corners, half);
      expect_valid(body, static_cast<std::size_t>(corners), what);
      if (!body) continue;
      const CellComplex& x = body->complex;
      for (std::int32_t h = 0; h < static_cast<std::int32_t>(x.collision.half_edge_count()); ++h) {
        const CollisionHalfEdge edge(h);
        if (!x.collision.is_border(edge)) continue;
        const PoolRun run = x.collision.chain[edge][0];
        for (std::int32_t i = 0; i < run.count; ++i)
          EXPECT_LT(std::fabs(x.visual.rest[x.chain_pool[run.at(i)]].z), 0.75 * half) << what;
      }
      // The rim corners of the prisms have the plate's half thickness.
      for (const Vec3 offset : x.collision.offset.raw()) EXPECT_NEAR(offset.z, half, 1e-9) << what;
    }
}

TEST(BindShapes, TextureOfNewVerticesIsInterpolated) {
  TriangleMesh skin = plate(40, 6, 0.05);
  const auto uv = [](Vec3 p) {
    return Vec2f{static_cast<float>(0.5 + 0.4 * p.x - 0.1 * p.z), static_cast<float>(0.5 + 0.3 * p.y + 0.2 * p.z)};
  };
  for (const auto& t : skin.triangles)
    skin.texture.push_back({uv(skin.positions[t[0]]), uv(skin.positions[t[1]]), uv(skin.positions[t[2]])});
  const auto body = bind(skin, polygon(9), {});
  expect_valid(body, 9, "plate");
  const VisualMesh& v = body->complex.visual;
  EXPECT_GT(v.vertex_count(), skin.positions.size());
  for (std::int32_t h = 0; h < static_cast<std::int32_t>(v.half_edge_count()); ++h) {
    const Vec2f expected = uv(v.rest[v.from(VisualHalfEdge(h))]), got = v.texture[VisualHalfEdge(h)];
    EXPECT_NEAR(got.x, expected.x, 1e-5);
    EXPECT_NEAR(got.y, expected.y, 1e-5);
  }
  for (const Vec3f n : v.normal.raw()) EXPECT_NEAR(norm(to_double(n)), 1, 1e-5);
}

}  // namespace
}  // namespace kerf::bind_shapes_test
