// Scalpels and scissors that are pushed into a steak along their own edge, and drawn out, part nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string_view>

#include "kerf/base/random.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/session.h"
#include "session/make_session.h"
#include "session/session_measures.h"
#include "support/rotation_about.h"

namespace kerf::tool_stabs_test {
namespace {

constexpr int kStabs = 12;

/// Down the edge from 5 cm above a place of the steak to 2.5 cm below it, and up again. A tool that nothing turned has its edge downwards.
Scene stab(const char* kind, Vec3 place, Vec3 rotation, bool yields) {
  const double angle = norm(rotation);
  const Vec3 down = testing_support::rotation_about(rotation, angle) * Vec3{0, 0, -1}, from = place - 0.05 * down,
             to = place + 0.025 * down;
  const bool scalpel = std::string_view(kind) == "scalpel";
  auto scene =
      parse_scene(fmt::format(R"([body]
model = "steak"
[cut]
dust = 0
[simulation]
gravity = [0, 0, 0]
time_step = 0.002
[[fix]]
half_space = {{ point = [0, 0.05, 0], normal = [0, 1, 0] }}
[[tool]]
id = "k"
kind = "{}"
{}
max_force = {}
position = [{}, {}, {}]
rotation = [{}, {}, {}]
[[command]]
at = 0.02
type = "tool"
id = "k"
poses = [
  {{ time = 0.2, position = [{}, {}, {}] }},
  {{ time = 0.4, position = [{}, {}, {}] }},
]
)",
                              kind, scalpel ? "tip = 0.06\nlength = 0.1" : "", yields ? 20 : 0, from.x, from.y, from.z,
                              rotation.x, rotation.y, rotation.z, to.x, to.y, to.z, from.x, from.y, from.z),
                  "stab");
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  return std::move(scene).value();
}

TEST(ToolStabs, PartNothing) {
  for (int i = 0; i < kStabs; ++i) {
    Random random(static_cast<std::uint64_t>(i + 1));
    const Vec3 place{random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.02), 0};
    const double most = i % 2 == 1 ? 0.3 : 0;  // radians that it leans
    const Vec3 rotation{random.uniform(-most, most), random.uniform(-most, most), random.uniform(-1.5, 1.5)};
    const bool scissors = i % 3 == 2, yields = i % 4 < 2;
    Session session = test::make(stab(scissors ? "scissors" : "scalpel", place, rotation, yields));
    const std::size_t strokes = scissors ? 0 : 1;  // open jaws cut nothing
    ASSERT_TRUE(session.step(210).ok());
    EXPECT_EQ(session.counts().pieces, 1) << i;
    EXPECT_EQ(test::cut_length(session), 0) << i;
    EXPECT_EQ(session.strokes().size(), strokes) << i;
    EXPECT_TRUE(session.validate().ok()) << i;
  }
}

}  // namespace
}  // namespace kerf::tool_stabs_test
