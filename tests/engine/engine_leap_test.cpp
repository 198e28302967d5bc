// A scalpel's stroke over the end of the skin, behind which another part of it is seen: both are cut under the pointer, nothing else is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine_table.h"
#include "kerf/session/body.h"

namespace kerf::engine_leap_test {
namespace {

using namespace kerf::test;

constexpr std::uint32_t kScalpelTool = 0;

SceneSource tube() {
  SceneSource source;
  source.name = "tube";
  source.text = R"([body]
model = "tube"
[simulation]
time_step = 0.002
gravity = [0, 0, 0]
[cut]
dust = 0
)";
  return source;
}

double off_segment(Vec3 d, Vec3 a, Vec3 b) {
  const double t = std::clamp(dot(d - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
  return norm(d - (a + t * (b - a)));
}

class Mouth : public testing::TestWithParam<int> {};

/// From the wall that faces the eye over its rim into the mouth of the tube, on the slant; in few rays, as a quick hand leaves them, or many.
TEST_P(Mouth, IsCutUnderThePointerOnBothWalls) {
  const int rays = GetParam();
  for (const double slant : {0.004, -0.007, 0.012}) {
    Table table({}, tube());
    const auto page = table.join();
    table.tick();
    const CollisionMesh& mesh = table.engine.session().body().complex.collision;
    Box3 box;
    for (const Vec3 p : mesh.rest.raw()) box.add(p);
    const Vec3 eye{0.02, box.max.y + 0.18, box.max.z + 0.12};
    const std::size_t before = mesh.vertex_count();
    const auto to = [&](Vec3 p) { return normalized(p - eye); };
    // On the top of the wall, and on the floor of the tube.
    const Vec3 first = to({-slant, box.max.y - 0.025, box.max.z}), last = to({slant, box.max.y - 0.02, box.min.z});
    for (int i = 0; i <= rays; ++i) {
      const Vec3 d = normalized(lerp(first, last, static_cast<double>(i) / rays)), at = eye + d;
      // The camera comes to rest meanwhile.
      const double drift = 1e-7 * i;
      const PageRay ray = ray_between({eye.x + drift, eye.y, eye.z}, {at.x + drift, at.y, at.z});
      table.tell(page, page_tool(5, kScalpelTool, i == 0 ? kDown : i == rays ? kUp : kMove, {ray}));
      if (rays > 10) table.tick();
    }
    table.tick();
    EXPECT_TRUE(table.engine.session().validate().ok());
    EXPECT_TRUE(table.pages[page].errors.empty());
    const double edge = table.engine.session().body().complex.mean_root_edge;
    double worst = 0;
    bool at_rim = false, above = false, below = false;
    for (std::size_t v = before; v < mesh.vertex_count(); ++v) {
      const Vec3 p = mesh.rest[CollisionVertex(v)], from_eye = p - eye;
      worst = std::max(worst, norm(from_eye) * off_segment(normalized(from_eye), first, last));
      at_rim = at_rim || p.y > box.max.y - 1e-6;
      above = above || p.z > 0.8 * box.max.z;
      below = below || p.z < 0.8 * box.min.z;
    }
    EXPECT_TRUE(above && below);
    EXPECT_TRUE(at_rim) << "the near wall is cut to its rim";
    EXPECT_LT(worst, 0.5 * edge) << "slant " << slant << ", edge " << edge;
    EXPECT_EQ(table.engine.session().undo_depth(), 1);
    table.tell(page, page_command(9, kUndo));
    table.tick();
    EXPECT_EQ(mesh.vertex_count(), before);
  }
}
INSTANTIATE_TEST_SUITE_P(Strokes, Mouth, testing::Values(4, 16, 60));

}  // namespace
}  // namespace kerf::engine_leap_test
