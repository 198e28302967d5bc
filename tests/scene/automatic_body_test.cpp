// Why a body has no collision mesh: the true reason, for bodies that are flat.
#include "kerf/scene/automatic_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "kerf/binding/bind.h"

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

// The tips of this star are narrower than it is thick. It is flat: nobody says that it is folded.
TEST(AutomaticBody, AFlatStarIsBoundOrItsTipsAreNamed) {
  const auto made = make_automatic_body(star(12, 0.06, 0.02, 0.003, 1), 0, {});
  ASSERT_TRUE(made.ok()) << made.error().message;
  if (!made->refused) GTEST_SKIP() << "it is bound";
  const std::string& why = made->refused->message;
  EXPECT_NE(why.find("of the body are narrower than 1.5 thicknesses, most of it at ("), std::string::npos) << why;
  EXPECT_EQ(why.find("a body that is folded by 120 degrees"), std::string::npos) << why;
  EXPECT_GT(norm(made->midsurface.verdict.narrowest), 0.03) << "in a tip";
}

}  // namespace
}  // namespace kerf::automatic_body_test
