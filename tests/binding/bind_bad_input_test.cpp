// Every kind of bad input gets an error that names the element, or a stated repair.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kerf/binding/bind.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/models.h"

namespace kerf::bind_bad_input_test {
namespace {

Model make(std::string_view name) { return *make_model(name, {}); }

void expect_error(const TriangleMesh& visual, const TriangleMesh& collision, std::initializer_list<std::string> parts,
                  double thickness = 0.1) {
  const auto body = bind(visual, collision, {.thickness = thickness});
  ASSERT_FALSE(body.ok());
  for (const std::string& part : parts)
    EXPECT_NE(body.error().message.find(part), std::string::npos) << body.error().message;
}

TEST(BindBadInput, Meshes) {
  const Model good = make("steak");
  const TriangleMesh empty;
  expect_error(empty, good.collision, {"visual mesh", "no triangles"});
  expect_error(good.visual, empty, {"collision mesh", "no triangles"});

  Model m = good;
  m.visual.positions[VertexId(41)].y = NAN;
  expect_error(m.visual, m.collision, {"visual mesh", "vertex 42", "finite"});
  m = good;
  m.collision.positions[VertexId(3)].x = INFINITY;
  expect_error(m.visual, m.collision, {"collision mesh", "vertex 4", "finite"});
  m = good;
  m.visual.triangles[TriangleId(6)][1] = VertexId(99999);
  expect_error(m.visual, m.collision, {"triangle 7", "100000"});
  m = good;
  m.visual.triangles[TriangleId(6)][1] = m.visual.triangles[TriangleId(6)][0];
  expect_error(m.visual, m.collision, {"triangle 7", "no area"});
  m = good;
  {
    auto& t = m.visual.triangles[TriangleId(6)];
    m.visual.positions[t[2]] = lerp(m.visual.positions[t[0]], m.visual.positions[t[1]], 0.5);
    expect_error(m.visual, m.collision, {"triangle", "no area"});
  }
  m = good;
  m.visual.triangles.push_back(m.visual.triangles[TriangleId(0)]);
  m.visual.texture.push_back(m.visual.texture[TriangleId(0)]);
  expect_error(m.visual, m.collision, {"visual mesh", "duplicate"});
  m = good;
  std::swap(m.visual.triangles[TriangleId(10)][0], m.visual.triangles[TriangleId(10)][1]);
  expect_error(m.visual, m.collision, {"visual mesh", "oriented"});
  m = good;
  for (Vec3& p : m.visual.positions) p = 1e150 * p;
  expect_error(m.visual, m.collision, {"visual mesh", "size"});
}

TEST(BindBadInput, AFanThatWouldTakeMinutesIsRefusedAtOnce) {
  constexpr int kSpokes = 200000;
  TriangleMesh wheel;
  wheel.positions.push_back({});
  for (int i = 0; i < kSpokes; ++i) {
    const double a = 2 * std::numbers::pi * i / kSpokes;
    wheel.positions.push_back({std::cos(a), std::sin(a), 0});
    wheel.triangles.push_back({VertexId(0), VertexId(i + 1), VertexId((i + 1) % kSpokes + 1)});
  }
  expect_error(wheel, make("steak").collision, {"visual mesh", "vertex 1 has 200000 triangles", "5000", "re-mesh"});
  expect_error(make("steak").visual, wheel, {"collision mesh", "vertex 1 has 200000 triangles"});
}

TEST(BindBadInput, BordersThatDoNotCorrespond) {
  // A closed body with one triangle missing is open: its border has no partner of the right shape.
  Model m = make("two-holed-slab");
  m.visual.triangles.raw().pop_back();
  m.visual.texture.raw().pop_back();
  expect_error(m.visual, m.collision, {"open sheet with 1 border", "collision mesh has 3"});
  const Model sheet = make("sheet");
  expect_error(sheet.visual, sheet.collision, {"thickness"}, 0);
  // Two bodies in one file.
  m = make("steak");
  const std::size_t n = m.collision.positions.size();
  for (std::size_t v = 0; v < n; ++v)
    m.collision.positions.push_back(m.collision.positions[VertexId(v)] + Vec3{1, 0, 0});
  const std::size_t faces = m.collision.triangles.size();
  for (std::size_t f = 0; f < faces; ++f) {
    auto t = m.collision.triangles[TriangleId(f)];
    for (VertexId& v : t) v = VertexId(v.index() + n);
    m.collision.triangles.push_back(t);
    if (m.collision.has_texture()) m.collision.texture.push_back(m.collision.texture[TriangleId(f)]);
  }
  expect_error(m.visual, m.collision, {"collision mesh", "2 separate pieces"});
  m = make("steak");
  const std::size_t nv = m.visual.positions.size(), nf = m.visual.triangles.size();
  for (std::size_t v = 0; v < nv; ++v) m.visual.positions.push_back(m.visual.positions[VertexId(v)] + Vec3{1, 0, 0});
  for (std::size_t f = 0; f < nf; ++f) {
    auto t = m.visual.triangles[TriangleId(f)];
    for (VertexId& v : t) v = VertexId(v.index() + nv);
    m.visual.triangles.push_back(t);
    m.visual.texture.push_back(m.visual.texture[TriangleId(f)]);
  }
  expect_error(m.visual, m.collision, {"belongs to no collision triangle"});
}

TEST(BindBadInput, CollisionMeshElsewhere) {
  // Far away, above the body, in another unit, folded over.
  Model m = make("steak");
  for (Vec3& p : m.collision.positions) p = p + Vec3{10, 0, 0};
  expect_error(m.visual, m.collision, {"collision vertex"});
  m = make("steak");
  for (Vec3& p : m.collision.positions) p = p + Vec3{0, 0, 0.2};
  expect_error(m.visual, m.collision, {"collision vertex"});
  m = make("steak");
  for (Vec3& p : m.collision.positions) p = 1000.0 * p;
  expect_error(m.visual, m.collision, {"collision vertex"});
  m = make("sheet");
  for (Vec3& p : m.collision.positions) p = p + Vec3{0, 3, 0};
  expect_error(m.visual, m.collision, {"collision"});
  m = make("closed-sheet");
  for (Vec3& p : m.collision.positions)
    if (p.x > 0.2) p.x = 0.4 - p.x;
  expect_error(m.visual, m.collision, {"folded", "vertices"});
}

TEST(BindBadInput, CollisionMeshBesideTheBody) {
  // Near enough to bind to something, but outside: the surface is on one side only.
  for (const double height : {0.014, 0.03}) {
    Model m = make("steak");
    for (Vec3& p : m.collision.positions) p.z += height;
    expect_error(m.visual, m.collision, {"outside the visual mesh", "triangle"});
  }
  Model small = make("steak");
  for (Vec3& p : small.collision.positions) p = 0.5 * p;
  const auto bound = bind(small.visual, small.collision, {});
  ASSERT_TRUE(bound.ok()) << bound.error().message;
  ASSERT_FALSE(bound->report.warnings.empty());
  EXPECT_NE(bound->report.warnings[0].find("rim"), std::string::npos);
}

TEST(BindRepairs, TurnedMeshesAreTurnedBackAndReported) {
  Model m = make("sheet");
  for (auto& t : m.collision.triangles) std::swap(t[0], t[1]);
  auto body = bind(m.visual, m.collision, {.thickness = 0.1});
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_TRUE(body->report.flipped_collision);
  EXPECT_EQ(body->report.warnings.size(), 1u);
  EXPECT_TRUE(validate_binding(body->complex).ok());

  m = make("steak");
  for (auto& t : m.visual.triangles) std::swap(t[0], t[1]);
  for (auto& uv : m.visual.texture) std::swap(uv[0], uv[1]);
  body = bind(m.visual, m.collision, {});
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_TRUE(body->report.flipped_visual);
  EXPECT_GT(body->report.volume_after, 0);
  EXPECT_TRUE(validate_binding(body->complex).ok());
}

TEST(BindRepairs, SeamsAreWelded) {
  // Every triangle with vertices of its own, as in STL, plus an unused vertex.
  const Model m = make("steak");
  TriangleMesh soup;
  for (std::size_t f = 0; f < m.visual.triangles.size(); ++f) {
    std::array<VertexId, 3> t;
    for (std::size_t k = 0; k < 3; ++k)
      t[k] = soup.positions.push_back(m.visual.positions[m.visual.triangles[TriangleId(f)][k]]);
    soup.triangles.push_back(t);
  }
  soup.positions.push_back({7, 7, 7});
  const auto body = bind(soup, m.collision, {});
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_EQ(body->report.input_vertices, static_cast<std::int64_t>(m.visual.positions.size()));
  EXPECT_EQ(body->report.merged_vertices,
            static_cast<std::int64_t>(soup.positions.size() - 1 - m.visual.positions.size()));
  EXPECT_EQ(body->report.unused_vertices, 1);
  EXPECT_TRUE(validate_binding(body->complex).ok());
}

TEST(BindRepairs, FarFromTheOriginAndTinyAndHuge) {
  for (const double scale : {1e-6, 1e6}) {
    Model m = make("meniscus");
    for (Vec3& p : m.visual.positions) p = scale * p;
    for (Vec3& p : m.collision.positions) p = scale * p;
    const auto body = bind(m.visual, m.collision, {});
    ASSERT_TRUE(body.ok()) << scale << body.error().message;
    EXPECT_TRUE(validate_binding(body->complex).ok());
  }
  Model m = make("steak");
  for (Vec3& p : m.visual.positions) p = p + Vec3{1e6, -1e6, 1e6};
  for (Vec3& p : m.collision.positions) p = p + Vec3{1e6, -1e6, 1e6};
  const auto body = bind(m.visual, m.collision, {});
  ASSERT_TRUE(body.ok()) << body.error().message;
  const Status valid = validate_binding(body->complex);
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

}  // namespace
}  // namespace kerf::bind_bad_input_test
