// What is drawn near the rim lies where its parameters say: a wall that is cut there is drawn where the blade was.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"
#include "support/drawn_place.h"
#include "support/extruded_mesh.h"
#include "support/source_dir.h"
#include "support/synthetic_complex.h"

namespace kerf::drawn_place_test {
namespace {

using namespace testing_support;

struct Limits {
  double mean, rim_mean,
      largest;  ///< parts of the mean collision edge; rim: -1 where the side is not steep, so that no corner is near the rim
};

BoundBody expect_drawn(const TriangleMesh& visual, const TriangleMesh& collision, const std::string& what,
                       Limits limits) {
  auto body = bind(visual, collision, {});
  EXPECT_TRUE(body.ok()) << what << ": " << (body.ok() ? "" : body.error().message);
  if (!body.ok()) return {};
  const Status valid = validate_binding(body->complex);
  EXPECT_TRUE(valid.ok()) << what << ": " << (valid.ok() ? "" : valid.error().message);
  EXPECT_NEAR(body->report.area_after / body->report.area_before, 1, 1e-12) << what;
  EXPECT_NEAR(body->report.volume_after / body->report.volume_before, 1, 1e-12) << what;
  EXPECT_FALSE(body->report.upright) << what;
  EXPECT_EQ(body->report.upright_patches + body->report.uniform_patches, 0) << what;
  const DrawnPlace place = drawn_place(body->complex);
  EXPECT_LT(place.mean, limits.mean) << what;
  if (limits.rim_mean > 0) {
    EXPECT_GT(place.rim_corners, 100) << what;
    EXPECT_LT(place.rim_mean, limits.rim_mean) << what;
  }
  EXPECT_LT(place.largest, limits.largest) << what;
  // What the report says is the same figure, found another way.
  EXPECT_NEAR(body->report.displacement.mean, place.mean, 0.02 * place.mean + 1e-6) << what;
  EXPECT_NEAR(body->report.displacement.largest, place.largest, 0.02 * place.largest + 1e-6) << what;
  ::testing::Test::RecordProperty(what, fmt::format("mean {:.5f} largest {:.4f} rim mean {:.5f} largest {:.4f}",
                                                    place.mean, place.largest, place.rim_mean, place.rim_largest));
  return std::move(*body);
}

Model model(std::string_view name, std::size_t triangles = 0) {
  auto m = make_model(name, {.visual_triangles = triangles});
  EXPECT_TRUE(m.ok());
  return std::move(*m);
}

TEST(DrawnPlace, PlatesAndModels) {
  const Model plate = model("closed-sheet", 20000), steak = model("steak"), meniscus = model("meniscus"),
              holes = model("two-holed-slab");
  expect_drawn(plate.visual, plate.collision, "closed-sheet", {0.001, 0.001, 0.01});
  expect_drawn(steak.visual, steak.collision, "steak", {0.003, -1, 0.06});
  expect_drawn(meniscus.visual, meniscus.collision, "meniscus", {0.008, 0.03, 0.1});
  expect_drawn(holes.visual, holes.collision, "two-holed-slab", {0.001, 0.002, 0.01});
  Model bent = model("closed-sheet", 20000);
  ASSERT_TRUE(bend(bent, 1.5).ok());
  expect_drawn(bent.visual, bent.collision, "bent sheet", {0.002, 0.006, 0.05});
}

TEST(DrawnPlace, AnnulusWedgeAndDisc) {
  const auto flat = [](Vec3) { return 0.03; };
  expect_drawn(extruded(annulus_mesh(0.15, 0.5, 97, 11), 3, flat), annulus_mesh(0.15, 0.5, 24, 4), "annulus",
               {0.01, 0.04, 0.1});
  const auto rising = [](Vec3 p) { return 0.005 + 0.035 * p.x; };  // 1 : 8
  expect_drawn(extruded(plain_grid_mesh(53, 47), 4, rising), plain_grid_mesh(7, 8), "wedge", {0.001, 0.002, 0.01});
  expect_drawn(extruded(disc_mesh(0.5, 89, 12), 2, flat), disc_mesh(0.5, 20, 4), "disc", {0.01, 0.04, 0.1});
}

// Boxes of 12 to 44 triangles under collision meshes with shorter edges: paths between two sides at a corner were drawn around it, below the top.
TEST(DrawnPlace, BoxesOfFewTriangles) {
  Random random(1);
  for (int box = 0; box < 200; ++box) {
    const Vec3 size{0.1, 0.1 * random.uniform(0.3, 1), 0.1 * random.uniform(0.01, 0.08)};
    const int nx = 2 + static_cast<int>(random.index(8)), ny = 2 + static_cast<int>(random.index(6));
    TriangleMesh collision = plain_grid_mesh(nx, ny);
    for (Vec3& p : collision.positions) {
      const bool inside = p.x > 1e-9 && p.x < 1 - 1e-9 && p.y > 1e-9 && p.y < 1 - 1e-9;
      if (inside) p += Vec3{random.uniform(-0.25, 0.25) / nx, random.uniform(-0.25, 0.25) / ny, 0};
      p = {size.x * p.x, size.y * p.y, 0};
    }
    TriangleMesh drawn = plain_grid_mesh(1 + static_cast<int>(random.index(3)), 1 + static_cast<int>(random.index(2)));
    for (Vec3& p : drawn.positions) p = {size.x * p.x, size.y * p.y, 0};
    expect_drawn(extruded(drawn, 1, [&](Vec3) { return 0.5 * size.z; }), collision, fmt::format("box {}", box),
                 {0.02, -1, 0.05});
  }
}

// The border of a collision mesh that stops short of the rim is led there.
TEST(DrawnPlace, ACollisionMeshThatStopsShort) {
  TriangleMesh inner = plain_grid_mesh(8, 8);
  for (Vec3& p : inner.positions) p = Vec3{0.5, 0.5, 0} + 0.96 * (p - Vec3{0.5, 0.5, 0});
  const TriangleMesh visual = extruded(plain_grid_mesh(47, 53), 3, [](Vec3) { return 0.04; });
  const BoundBody body = expect_drawn(visual, inner, "short", {0.001, 0.001, 0.01});
  EXPECT_EQ(body.report.led_vertices, 32);
  for (const Vec3 p : {Vec3{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}) {
    double nearest = HUGE_VAL;
    for (const Vec3 q : body.complex.collision.rest.raw()) nearest = std::min(nearest, norm(p - q));
    EXPECT_LT(nearest, 1e-3);
  }
}

TEST(DrawnPlace, TheScannedMeniscus) {
  const std::filesystem::path folder = test::source_dir() + "/../shared/meshes";
  if (!std::filesystem::exists(folder / "medial-meniscus.obj"))
    GTEST_SKIP() << "needs " << folder << "/medial-meniscus.obj";
  const auto visual = read_mesh(folder / "medial-meniscus.obj"),
             collision = read_mesh(folder / "medial-meniscus-collision.obj");
  ASSERT_TRUE(visual.ok() && collision.ok());
  expect_drawn(*visual, *collision, "medial meniscus", {0.025, 0.06, 0.35});
}

// A disc whose caps are fans of 718 triangles: each path crossed hundreds of spokes.
TEST(DrawnPlace, FansDoNotGrow) {
  TriangleMesh fan = fan_plate(720, 0.5, 0.03);
  const auto uv = [](Vec3 p) {
    return Vec2f{static_cast<float>(0.5 + 0.6 * p.x - 0.2 * p.y), static_cast<float>(0.5 + 0.3 * p.x + 0.5 * p.y)};
  };
  for (const auto& t : fan.triangles)
    fan.texture.push_back({uv(fan.positions[t[0]]), uv(fan.positions[t[1]]), uv(fan.positions[t[2]])});
  ASSERT_EQ(fan.triangles.size(), 2876u);
  const BoundBody body = expect_drawn(fan, disc_mesh(0.5, 24, 4), "fan-720", {0.01, 0.03, 0.1});
  EXPECT_LT(body.report.visual_triangles, 4 * 2876);
  // Vertices keep their numbers, and the texture is where it was.
  const VisualMesh& v = body.complex.visual;
  for (std::size_t i = 0; i < fan.positions.size(); ++i) EXPECT_EQ(v.rest[VisualVertex(i)], fan.positions[VertexId(i)]);
  for (std::int32_t h = 0; h < static_cast<std::int32_t>(v.half_edge_count()); ++h) {
    const Vec2f expected = uv(v.rest[v.origin[VisualHalfEdge(h)]]), got = v.texture[VisualHalfEdge(h)];
    ASSERT_NEAR(got.x, expected.x, 1e-5);
    ASSERT_NEAR(got.y, expected.y, 1e-5);
  }
}

// Faces with a texture of their own each can't be put together anew without moving it.
TEST(DrawnPlace, FansOfChartsKeepTheirTexture) {
  TriangleMesh fan = fan_plate(120, 0.5, 0.03);
  for (std::size_t f = 0; f < fan.triangles.size(); ++f) {
    const auto u = static_cast<float>(f);
    fan.texture.push_back({Vec2f{u, 0}, Vec2f{u + 0.5f, 0}, Vec2f{u, 0.5f}});
  }
  const auto body = bind(fan, disc_mesh(0.5, 16, 3), {});
  ASSERT_TRUE(body.ok()) << body.error().message;
  const VisualMesh& v = body->complex.visual;
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(v.face_count()); ++f) {
    const float first = std::floor(v.texture[VisualHalfEdge(3 * f)].x);
    for (std::int32_t k = 0; k < 3; ++k) {
      const Vec2f t = v.texture[VisualHalfEdge(3 * f + k)];
      EXPECT_EQ(std::floor(t.x), first);  // all corners of one chart
      EXPECT_LE(t.x - first, 0.5f);
    }
  }
}

}  // namespace
}  // namespace kerf::drawn_place_test
