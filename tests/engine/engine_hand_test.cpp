// A hand carries what lies free to where the pointer is, and pulls what supports hold in the plane across the view.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine_table.h"
#include "kerf/session/body.h"

namespace kerf::engine_hand_test {
namespace {

using namespace kerf::test;

/// Looks down on the board from the front, as the page does.
constexpr Point kFront{-0.15, -0.42, 0.5};
constexpr double kTrayTop = -0.0225;

SceneSource board(const std::string& more = "") {
  SceneSource source;
  source.name = "board";
  source.text = R"([body]
model = "steak"
[simulation]
time_step = 0.005
[[obstacle]]
name = "board"
shape = "box"
size = [0.30, 0.24, 0.02]
position = [0, 0, -0.0205]
friction = 0.6
[[obstacle]]
name = "table"
shape = "plane"
position = [0, 0, -0.0305]
friction = 0.6
[[obstacle]]
name = "tray"
shape = "box"
size = [0.20, 0.13, 0.008]
position = [0.01, 0.20, -0.0265]
friction = 0.6
)" + more;
  return source;
}

/// The steak on its board, cut along x = 0.03, lies still; then the hand goes from one place to another, waits, and lets go.
struct Carried : Table {
  std::uint32_t page;
  explicit Carried(const SceneSource& source) : Table({}, source), page(join()) {
    tick(30);
    for (int k = 0; k <= 40; ++k) {
      const Point p{0.03, 0.12 - 0.006 * k, 0};
      tell(page, page_tool(1, kScalpel, k == 0 ? kDown : k == 40 ? kUp : kMove, {ray_between(kEye, p)}));
    }
    tick(30);
  }
  void lead(Point from, Point to, bool let_go = true) {
    tell(page, page_tool(2, kGrasp, kDown, {ray_between(kFront, from)}));
    for (int k = 1; k <= 60; ++k) {
      const double s = k / 60.0;
      const Point p{from.x + s * (to.x - from.x), from.y + s * (to.y - from.y), from.z + s * (to.z - from.z)};
      tell(page, page_tool(2, kGrasp, kMove, {ray_between(kFront, p)}));
      tick(2);
    }
    tick(60);
    if (!let_go) return;
    tell(page, page_tool(2, kGrasp, kUp, {ray_between(kFront, to)}));
    tick(120);
  }
  /// Of the piece beyond the cut, or of the other.
  [[nodiscard]] Box3 box_of(bool beyond) {
    Box3 box;
    each(beyond, [&](Vec3 p) { box.add(p); });
    return box;
  }
  [[nodiscard]] Vec3 middle_of(bool beyond) {
    Vec3 sum;
    double n = 0;
    each(beyond, [&](Vec3 p) { sum += p, ++n; });
    return (1 / n) * sum;
  }

  /// Where the only grasp pulls to.
  [[nodiscard]] Vec3 target() const {
    const auto& all = pages.at(page).grasp_places;
    EXPECT_EQ(all.size(), 1u);
    return all.empty() ? Vec3{} : Vec3{all[0][3], all[0][4], all[0][5]};
  }

 private:
  template <class Use>
  void each(bool beyond, Use&& use) {
    const Session& session = engine.session();
    const std::vector<Vec3> now = session.visual_positions();
    const auto& rest = session.body().complex.visual.rest;
    for (const VisualVertex v : ids<VisualVertex>(now.size()))
      if (beyond ? rest[v].x > 0.035 : rest[v].x < 0.025) use(now[v.index()]);
  }
};

TEST(EngineHand, LaysAPieceOnTheTrayUnderThePointer) {
  Carried t(board());
  ASSERT_EQ(t.pages[t.page].masses.size(), 2u);
  const Vec3 before = t.middle_of(false);
  t.lead({0.07, 0.02, 0}, {0.02, 0.21, 0});
  const Vec3 at = t.middle_of(true);
  EXPECT_NEAR(at.x, 0.02, 0.06);
  EXPECT_NEAR(at.y, 0.20, 0.065) << "within the tray";
  const Box3 box = t.box_of(true);
  EXPECT_GT(box.min.z, kTrayTop - 0.002);
  EXPECT_LT(box.min.z, kTrayTop + 0.015);
  EXPECT_LT(norm(t.middle_of(false) - before), 0.03) << "the other piece stays";
  EXPECT_TRUE(t.pages[t.page].errors.empty());
}

TEST(EngineHand, LaysAPieceOnAnother) {
  Carried t(board());
  t.lead({0.07, 0.02, 0}, {-0.03, 0.02, 0});
  const Vec3 at = t.middle_of(true), under = t.middle_of(false);
  EXPECT_GT(at.z, under.z + 0.01);
  EXPECT_LT(std::hypot(at.x + 0.03, at.y - 0.02), 0.06);
}

TEST(EngineHand, PullsWhatSupportsHoldAcrossTheView) {
  Carried t(board("[[fix]]\nhalf_space = { point = [0, 0.055, 0], normal = [0, 1, 0] }\n"));
  const Point from{0.07, -0.02, 0};
  t.lead(from, {0.07, 0.1, 0}, false);
  const Vec3 way = t.target() - Vec3{from.x, from.y, from.z};
  const Vec3 view = normalized(Vec3{from.x - kFront.x, from.y - kFront.y, from.z - kFront.z});
  EXPECT_LT(std::abs(dot(way, view)), 0.012) << "off by no more than the held corners' middle lies from the pointer";
  EXPECT_GT(way.z, 0.04);
}

TEST(EngineHand, StaysWhereTheRayLeavesTheTable) {
  Carried t(board());
  t.lead({0.07, 0.02, 0}, {0.02, 0.1, 0}, false);
  const Vec3 before = t.target();
  for (const double z : {0.5, 0.6, 3.0}) {  // level with the eye, and above
    t.tell(t.page, page_tool(2, kGrasp, kMove, {ray_between(kFront, {0.02, 0.2, z})}));
    t.tick();
    EXPECT_EQ(t.target(), before) << z;
  }
  // All but level: no farther than a hand reaches.
  t.tell(t.page, page_tool(2, kGrasp, kMove, {ray_between(kFront, {0.02, 0.2, 0.49})}));
  t.tick(4);
  EXPECT_LT(norm(t.target()), 2.5 * 0.26);
  EXPECT_TRUE(t.engine.session().validate().ok());
}

TEST(EngineHand, PullsAcrossTheViewWithoutWeight) {
  Carried t(board());
  t.tell(t.page, page_command(7, kGravity, {0, 0, 0}));
  t.tick(2);
  const Point from{0.07, 0.02, 0};
  t.lead(from, {0.07, 0.14, 0}, false);
  EXPECT_GT(t.target().z, 0.04);
}

}  // namespace
}  // namespace kerf::engine_hand_test
