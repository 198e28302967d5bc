// Why a body has no collision mesh: the true reason, for bodies that are flat.
#include "kerf/scene/automatic_body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/mesh/models.h"
#include "support/extruded_mesh.h"

namespace kerf::automatic_body_test {
namespace {

/// A flat star; every triangle is divided in four, `times` times.
TriangleMesh star(int tips, double outer, double inner, double thickness, int times) {
  TriangleMesh flat;
  flat.positions.push_back(Vec3{});
  for (int i = 0; i < 2 * tips; ++i) {
    const double a = std::numbers::pi * i / tips, r = i % 2 == 0 ? outer : inner;
    flat.positions.push_back({r * std::cos(a), r * std::sin(a), 0});
  }
  for (int i = 1; i <= 2 * tips; ++i)
    flat.triangles.push_back({VertexId(0), VertexId(i), VertexId(i % (2 * tips) + 1)});
  TriangleMesh body = testing_support::extruded(flat, 1, [&](Vec3) { return 0.5 * thickness; });
  for (; times > 0; --times) {
    TriangleMesh fine;
    fine.positions = body.positions;
    std::map<std::pair<VertexId, VertexId>, VertexId> middle;
    const auto between = [&](VertexId a, VertexId b) {
      const auto [at, made] = middle.try_emplace(std::minmax(a, b));
      if (made) at->second = fine.positions.push_back(lerp(body.positions[a], body.positions[b], 0.5));
      return at->second;
    };
    for (const auto& t : body.triangles) {
      const VertexId x = between(t[0], t[1]), y = between(t[1], t[2]), z = between(t[2], t[0]);
      for (const auto& part :
           {std::array{t[0], x, z}, std::array{x, t[1], y}, std::array{z, y, t[2]}, std::array{x, y, z}})
        fine.triangles.push_back(part);
    }
    body = std::move(fine);
  }
  return body;
}

/// Made and bound, with the thickness that the body has.
void expect_bound(const char* name, const TriangleMesh& body, double thickness) {
  SCOPED_TRACE(name);
  const auto made = make_automatic_body(body, 0, {});
  ASSERT_TRUE(made.ok()) << made.error().message;
  ASSERT_FALSE(made->refused) << made->refused->message;
  EXPECT_NEAR(2 * made->midsurface.quality.mean_half_thickness, thickness, 0.08 * thickness);
  EXPECT_NEAR(made->midsurface.verdict.volume_ratio, 1, 0.05);
  for (const Vec3 p : made->midsurface.collision.positions) EXPECT_NEAR(p.z, 0, 0.3 * thickness) << p.x << ", " << p.y;
}

// The tips of these stars are narrower than they are thick: there the walls face each other as the sides do.
TEST(AutomaticBody, AFlatStarIsBound) { expect_bound("12 tips", star(12, 0.06, 0.03, 0.003, 1), 0.003); }
TEST(AutomaticBody, AFlatStarIsBoundHoweverItIsDivided) {
  for (const double valleys : {0.02, 0.03})
    for (const int times : {0, 2, 4})
      expect_bound(std::to_string(times).c_str(), star(12, 0.06, valleys, 0.003, times), 0.003);
}

// What lies beyond the collision mesh can't be cut.
TEST(AutomaticBody, ItsCornersReachThoseOfTheBody) {
  struct Case {
    int tips;
    double inner, thickness;
  };
  for (const Case& c : {Case{6, 0.02, 0.004}, Case{6, 0.035, 0.004}, Case{5, 0.023, 0.003}, Case{4, 0.03, 0.003}}) {
    SCOPED_TRACE(std::to_string(c.tips) + " tips, valleys at " + std::to_string(c.inner));
    const TriangleMesh body = star(c.tips, 0.06, c.inner, c.thickness, 2);
    const auto made = make_automatic_body(body, 0, {});
    ASSERT_TRUE(made.ok()) << made.error().message;
    ASSERT_FALSE(made->refused) << made->refused->message;
    const auto& mesh = made->midsurface.collision;
    double edges = 0;
    for (const auto& t : mesh.triangles) edges += norm(mesh.positions[t[1]] - mesh.positions[t[0]]);
    const double edge = edges / static_cast<double>(mesh.triangles.size());
    for (int i = 0; i < c.tips; ++i) {
      const double a = 2 * std::numbers::pi * i / c.tips;
      double nearest = HUGE_VAL;
      for (const Vec3 p : mesh.positions)
        nearest = std::min(nearest, std::hypot(p.x - 0.06 * std::cos(a), p.y - 0.06 * std::sin(a)));
      EXPECT_LT(nearest, 0.007 * edge) << "tip " << i;  // 0.3 of the minimum feature
    }
  }
}

TriangleMesh plate(const testing_support::Outline& outline, const std::vector<testing_support::Outline>& holes,
                   double thickness) {
  return testing_support::extruded(testing_support::cut_in_ears(outline, holes), 1,
                                   [&](Vec3) { return 0.5 * thickness; });
}

// Each of 48 holes asks for some hundred triangles.
TEST(AutomaticBody, ManyRoundHolesAskForNoMoreThanBendsMay) {
  std::vector<testing_support::Outline> holes;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 6; ++j)
      holes.push_back(testing_support::circle({0.015 + 0.03 * i, 0.015 + 0.03 * j, 0}, 0.006, 48));
  const auto made = make_midsurface(plate({{0, 0, 0}, {0.24, 0, 0}, {0.24, 0.18, 0}, {0, 0.18, 0}}, holes, 0.002));
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_EQ(made->verdict.thinness, Thinness::kThin);
  EXPECT_GT(made->collision.triangles.size(), 1000U);
  EXPECT_LT(made->collision.triangles.size(), 1700U);
}

// Corners of long thin triangles are no spikes.
TEST(AutomaticBody, AGasketFromCadIsBound) {
  using testing_support::circle;
  std::vector<testing_support::Outline> holes{circle({}, 0.027, 96)};
  for (int i = 0; i < 8; ++i) {
    const double a = 0.01 + std::numbers::pi * i / 4;
    holes.push_back(circle(Vec3{0.0285 * std::cos(a), 0.0285 * std::sin(a), 0}, 0.0006, 24));
  }
  const TriangleMesh gasket = plate(circle({}, 0.03, 96), holes, 0.001);
  const std::size_t corners = 96 + 96 + 8 * 24;
  EXPECT_EQ(gasket.triangles.size(), 2 * (corners - 2 + 2 * holes.size()) + 2 * corners);
  expect_bound("gasket", gasket, 0.001);
}

// Between the holes and the corners this plate is narrower (4.8 mm) than thick (6 mm); no sheet leads straight on across a hole.
TEST(AutomaticBody, AThickSpacerIsBound) {
  testing_support::Outline outline;
  for (int corner = 0; corner < 4; ++corner)
    for (int i = 0; i <= 8; ++i) {
      const double a = std::numbers::pi / 2 * (corner + i / 8.0), x = corner == 0 || corner == 3 ? 0.02 : -0.02;
      outline.push_back({x + 0.005 * std::cos(a), (corner < 2 ? 0.02 : -0.02) + 0.005 * std::sin(a), 0});
    }
  std::vector<testing_support::Outline> holes;
  for (const double x : {-0.018, 0.018})
    for (const double y : {-0.018, 0.018}) holes.push_back(testing_support::circle({x, y, 0}, 0.003, 32));
  expect_bound("spacer", plate(outline, holes, 0.006), 0.006);
}

// Teeth 2 mm wide and 1.6 mm thick are narrow, but not as narrow as thick.
TEST(AutomaticBody, AThickCombIsBound) {
  testing_support::Outline outline{{0, 0, 0}, {0.022, 0, 0}};
  for (int tooth = 5; tooth >= 0; --tooth)
    for (const auto& [x, y] :
         {std::pair{0.002, 0.008}, std::pair{0.002, 0.02}, std::pair{0.0, 0.02}, std::pair{0.0, 0.008}})
      if (tooth < 5 || y > 0.008 || x == 0.0)
        if (tooth > 0 || y > 0.008 || x > 0) outline.push_back({0.004 * tooth + x, y, 0});
  expect_bound("comb", plate(outline, {}, 0.0016), 0.0016);
}

/// How often each stage of making a body begins.
std::map<std::string, int, std::less<>> stages_of(const TriangleMesh& body, std::size_t triangles, bool refused) {
  std::map<std::string, int, std::less<>> begun;
  BindOptions options;
  options.progress = [&](std::string_view stage, double fraction) { begun[std::string(stage)] += fraction == 0; };
  const auto made = make_automatic_body(body, triangles, options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  EXPECT_EQ(made.ok() && made->refused, refused);
  return begun;
}

// The search for sides and middle doesn't depend on the number of triangles. So few do not go round two holes.
TEST(AutomaticBody, WhatDependsOnNoTryIsFoundOnce) {
  ModelOptions coarse;
  coarse.visual_triangles = 2000;
  auto begun = stages_of(make_model("two-holed-slab", coarse)->visual, 16, false);
  EXPECT_GE(begun["mid-surface: triangles"], 2);
  EXPECT_EQ(begun["mid-surface: divide"], 1);
  EXPECT_EQ(begun["mid-surface: sheet"], 1);
}

// Vertices astray let no mesh bind, however many triangles it has: the surface passes through itself beside them.
TEST(AutomaticBody, VerticesAstrayAreRefusedAtTheFirstTry) {
  ModelOptions fine;
  fine.visual_triangles = 2000;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    TriangleMesh body = make_model("closed-sheet", fine)->visual;
    Random random(seed);
    for (Vec3& p : body.positions)
      if (random.uniform() < 0.03) p += 0.2 * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    EXPECT_LE(stages_of(body, 0, true)["mid-surface: triangles"], 1);
  }
}

// A strip 2 mm thick bent back onto itself, its legs 1.6 mm apart from middle to middle. More triangles don't mend that: one try says so.
TEST(AutomaticBody, WhatPassesThroughItselfIsRefusedAtTheFirstTry) {
  constexpr int kAlong = 96, kAcross = 16;
  TriangleMesh flat;
  for (int j = 0; j <= kAcross; ++j)
    for (int i = 0; i <= kAlong; ++i) flat.positions.push_back({0.12 * i / kAlong, 0.02 * j / kAcross, 0});
  for (int j = 0; j < kAcross; ++j)
    for (int i = 0; i < kAlong; ++i) {
      const VertexId a(j * (kAlong + 1) + i), b(a.value + 1), c(a.value + kAlong + 1), d(c.value + 1);
      flat.triangles.push_back({a, b, d});
      flat.triangles.push_back({a, d, c});
    }
  TriangleMesh body = testing_support::extruded(flat, 1, [](Vec3) { return 0.001; });
  constexpr double kLeg = 0.06, kRadius = 0.0008;
  for (Vec3& p : body.positions) {
    const double bent = std::clamp((p.x - kLeg) / kRadius, 0.0, std::numbers::pi), r = kRadius - p.z;
    const double rest = std::max(0.0, p.x - kLeg - std::numbers::pi * kRadius);
    p = {std::min(p.x, kLeg) + r * std::sin(bent) - rest, p.y, kRadius - r * std::cos(bent)};
  }
  int tries = 0;
  BindOptions options;
  options.progress = [&](std::string_view stage, double) -> Status {
    tries += stage == "mid-surface: triangles";
    return {};
  };
  const auto made = make_automatic_body(body, 0, options);
  ASSERT_TRUE(made.ok()) << made.error().message;
  ASSERT_TRUE(made->refused);
  EXPECT_LE(tries, 1);
  EXPECT_NE(made->refused->message.find("(the surface passes through itself at "), std::string::npos)
      << made->refused->message;
}

/// A prism of n sides along x, its skin in squares.
TriangleMesh rod(int sides, double radius, double length, int parts) {
  TriangleMesh mesh;
  const auto turned = [&](int i, double x) {
    const double a = 2 * std::numbers::pi * (i + 0.5) / sides;
    return Vec3{x, radius * std::cos(a), radius * std::sin(a)};
  };
  for (int k = 0; k <= parts; ++k)
    for (int i = 0; i < sides; ++i) mesh.positions.push_back(turned(i, length * k / parts));
  const auto at = [&](int k, int i) { return VertexId(k * sides + i % sides); };
  for (int k = 0; k < parts; ++k)
    for (int i = 0; i < sides; ++i) {
      mesh.triangles.push_back({at(k, i), at(k, i + 1), at(k + 1, i + 1)});
      mesh.triangles.push_back({at(k, i), at(k + 1, i + 1), at(k + 1, i)});
    }
  const VertexId low = mesh.positions.push_back(Vec3{}), high = mesh.positions.push_back(Vec3{length, 0, 0});
  for (int i = 0; i < sides; ++i) {
    mesh.triangles.push_back({low, at(0, i + 1), at(0, i)});
    mesh.triangles.push_back({high, at(parts, i), at(parts, i + 1)});
  }
  return mesh;
}

TEST(AutomaticBody, RodsAndBarsAreToldByTheirOutline) {
  for (const auto& [name, body] : {std::pair{"round", rod(32, 0.005, 0.1, 40)},
                                   {"thin", rod(16, 0.001, 0.1, 150)},
                                   {"square", rod(4, 0.005, 0.1, 20)},
                                   {"turned", rod(8, 0.005, 0.02, 4)}}) {
    SCOPED_TRACE(name);
    const auto made = make_automatic_body(body, 0, {});
    ASSERT_TRUE(made.ok()) << made.error().message;
    ASSERT_FALSE(made->bound);
    ASSERT_FALSE(made->refused) << made->refused->message;
    EXPECT_EQ(made->midsurface.verdict.reasons.size(), 1u);
    const std::string said = not_thin_message(made->midsurface);
    EXPECT_NE(said.find("times as wide as thick; below 2 it is not thin"), std::string::npos) << said;
    EXPECT_NE(said.find("a rod or a bar: the body is"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace kerf::automatic_body_test
