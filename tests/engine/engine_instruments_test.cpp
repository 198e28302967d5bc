// The instruments of an operation as pages use them: punch, scissors, shaver, suction, taking away, probe, and the score.
#include <gtest/gtest.h>

#include <cmath>

#include "engine_table.h"
#include "kerf/scene/scene_shapes.h"
#include "kerf/session/body.h"

namespace kerf::engine_instruments_test {
namespace {

using namespace kerf::test;

constexpr std::uint32_t kPunch = 5, kScissors = 6, kShaver = 7, kSuction = 8, kTake = 9, kProbe = 10;
constexpr std::uint32_t kShiftKey = 1;

/// A meniscus with a lesion at the inner rim, as in scenes/trainer.toml, and a probe that waits above.
SceneSource trainer() {
  SceneSource source;
  source.name = "trainer";
  source.text = R"([body]
model = "meniscus"
[lesion]
sphere = { center = [0.0, 0.0130, 0.0], radius = 0.002 }
[simulation]
time_step = 0.004
gravity = [0, 0, 0]
[[fix]]
half_space = { point = [0, 0.027, 0], normal = [0, 1, 0] }
[[fix]]
half_space = { point = [0, 0.003, 0], normal = [0, -1, 0] }
[contact]
self = false
[[tool]]
id = "probe"
kind = "probe"
position = [0, 0.015, 0.012]
length = 0.06
radius = 0.0006
tip = 0.002
[[tool]]
id = "shaver"
kind = "shaver"
position = [0.01, 0.015, 0.012]
length = 0.06
radius = 0.001
)";
  return source;
}
constexpr Point kAbove{0.0, 0.02, 0.12};

/// Presses and lifts an instrument where these points of the middle plane are seen.
void use(Table& table, std::uint32_t page, std::uint32_t tool, const std::vector<Point>& points, float size,
         std::uint32_t modifiers = 0, int ticks = 1, Point eye = kAbove) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    table.tell(page, page_tool(7, tool, i == 0 ? kDown : kMove, {ray_between(eye, points[i])}, modifiers, size));
    table.tick(ticks);
  }
  table.tell(page, page_tool(8, tool, kUp, {ray_between(eye, points.back())}, modifiers, size));
  table.tick();
}

void expect_sound(Table& table, std::uint32_t page) {
  const Status valid = table.engine.session().validate();
  EXPECT_TRUE(valid.ok()) << valid.error().message;
  table.expect_mirrored(page);
  for (const auto& cut : table.pages[page].cuts) EXPECT_EQ(cut.invariants, 0u) << cut.text;
}

TEST(Instruments, APunchTakesItsBiteOutAndUndoBringsItBack) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  const BodyCounts whole = table.engine.session().counts();
  // Half over the rim, which is at y = 0.0130 there.
  use(table, page, kPunch, {{0, 0.0130, 0}}, 0.0016f);
  EXPECT_TRUE(table.pages[page].errors.empty());
  ASSERT_EQ(table.pages[page].cuts.size(), 1u);
  EXPECT_EQ(table.pages[page].cuts[0].outcome, 0u);
  EXPECT_EQ(table.pages[page].pieces, 1u);
  EXPECT_EQ(table.engine.session().undo_depth(), 2);  // bite, and what it cut loose
  expect_sound(table, page);
  const auto bitten = table.engine.session().score();
  ASSERT_TRUE(bitten);
  EXPECT_GT(bitten->lesion_removed, 0.2);
  EXPECT_GT(bitten->roughness, 0);
  table.tell(page, page_command(1, kUndo));
  table.tick();
  EXPECT_EQ(table.engine.session().undo_depth(), 0);
  EXPECT_TRUE(table.engine.session().counts() == whole);
  EXPECT_DOUBLE_EQ(table.engine.session().score()->lesion_removed, 0);
  table.tell(page, page_command(2, kRedo));
  table.tick();
  EXPECT_EQ(table.engine.session().undo_depth(), 2);
  EXPECT_NEAR(table.engine.session().score()->lesion_removed, bitten->lesion_removed, 1e-12);
  expect_sound(table, page);
}

/// What a page shows where a slanted ray meets the skin is the middle of the bite, along the normal there.
TEST(Instruments, APunchBitesWhereItIsSeenFromAside) {
  for (const Point eye : {Point{0.0, 0.09, 0.07}, Point{0.08, 0.02, 0.06}, Point{-0.05, -0.05, 0.08}}) {
    Table table({}, trainer());
    const auto page = table.join();
    table.tick();
    const Point at{0.012, 0.021, 0};
    constexpr float kRadius = 0.0012f;
    table.tell(page, page_ray(3, ray_between(eye, at)));
    ASSERT_EQ(table.pages[page].hits.size(), 1u);
    const auto& hit = table.pages[page].hits[0];
    ASSERT_GE(hit.triangle, 0);
    const Vec3 seen{hit.point[0], hit.point[1], hit.point[2]}, normal{hit.normal[0], hit.normal[1], hit.normal[2]};
    const std::size_t before = table.engine.session().counts().collision_vertices;
    use(table, page, kPunch, {at}, kRadius, kShiftKey, 1, eye);
    const auto& positions = table.engine.session().body().complex.collision.rest.raw();  // nothing moves here
    ASSERT_GT(positions.size(), before + 6);
    Vec3 middle;
    double reach = 0;
    for (std::size_t v = before; v < positions.size(); ++v) middle += positions[v] - seen;
    middle = (1 / static_cast<double>(positions.size() - before)) * middle;
    for (std::size_t v = before; v < positions.size(); ++v) {
      const Vec3 d = positions[v] - seen;
      reach = std::max(reach, norm(d - dot(d, normal) * normal));
    }
    const double off = norm(middle - dot(middle, normal) * normal);
    EXPECT_LT(off, 0.35 * static_cast<double>(kRadius)) << eye.x << " " << eye.y;
    EXPECT_LT(reach, 1.3 * static_cast<double>(kRadius)) << eye.x << " " << eye.y;
    expect_sound(table, page);
  }
}

TEST(Instruments, APunchBesideTheBodyReachesTheRimAndNoFarther) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  table.tell(page, page_ray(3, ray_between(kAbove, {0, 0.0150, 0})));
  table.tell(page, page_ray(4, ray_between(kAbove, {0, 0.0150, 0}), 0.003f));
  table.tell(page, page_ray(5, ray_between(kAbove, {0, 0.0240, 0}), 0.003f));
  const auto& hits = table.pages[page].hits;
  ASSERT_EQ(hits.size(), 3u);
  EXPECT_EQ(hits[0].triangle, -1);
  ASSERT_GE(hits[1].triangle, 0);
  EXPECT_GT(hits[1].beside, 1e-5f);
  EXPECT_LT(hits[1].beside, 0.003f);
  // The point is on the ray, and as far from the body as said.
  double least = 1;
  for (const Vec3 p : table.engine.session().visual_positions())
    least = std::min(least, norm(p - Vec3{hits[1].point[0], hits[1].point[1], hits[1].point[2]}));
  EXPECT_NEAR(least, static_cast<double>(hits[1].beside),
              0.0012);  // of the visual mesh's vertices, the rim's half thickness
  EXPECT_EQ(hits[2].triangle, -1);
  use(table, page, kPunch, {{0, 0.0240, 0}}, 0.0016f);
  EXPECT_TRUE(table.pages[page].cuts.empty());
  EXPECT_EQ(table.engine.session().undo_depth(), 0);
}

TEST(Instruments, ADraggedPunchBitesOnAndShiftLeavesThePieces) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  std::vector<Point> along;
  for (int i = 0; i <= 20; ++i) along.push_back({-0.004 + 0.0004 * i, 0.0132, 0});
  use(table, page, kPunch, along, 0.0012f);
  const std::size_t bites = table.pages[page].cuts.size();
  EXPECT_GE(bites, 4u);
  EXPECT_LE(bites, 7u);
  EXPECT_EQ(table.pages[page].pieces, 1u);
  expect_sound(table, page);
  use(table, page, kPunch, {{0.0075, 0.0125, 0}}, 0.0012f, kShiftKey);
  EXPECT_EQ(table.pages[page].pieces, 2u);
  expect_sound(table, page);
}

TEST(Instruments, APunchBitesOnBetweenTheSamplesOfAQuickDrag) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  use(table, page, kPunch, {{0, 0.0200, 0}, {0, 0.0110, 0}, {0, -0.0060, 0}}, 0.0012f);
  EXPECT_EQ(table.pages[page].pieces, 2u) << "no web is left between bites";
  EXPECT_TRUE(table.pages[page].errors.empty());
  const auto missed = [](const auto& cut) { return cut.outcome != 0; };
  EXPECT_EQ(std::count_if(table.pages[page].cuts.begin(), table.pages[page].cuts.end(), missed), 0);
  // Over the gap it has made: that is told once, when it is up.
  table.pages[page].cuts.clear();
  use(table, page, kPunch, {{0, 0.0150, 0}, {0, 0.0120, 0}}, 0.0004f);
  EXPECT_EQ(std::count_if(table.pages[page].cuts.begin(), table.pages[page].cuts.end(), missed), 0);
  EXPECT_EQ(table.pages[page].errors.size(), 1u);
  expect_sound(table, page);
}

TEST(Instruments, APunchThatComesFromBesideTheBodyBitesOnItsWay) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  use(table, page, kPunch, {{0, 0.0240, 0}}, 0.0016f);
  EXPECT_EQ(table.pages[page].errors.size(), 1u);  // nothing here to bite
  use(table, page, kPunch, {{0, 0.0240, 0}, {0, 0.0200, 0}, {0, 0.0130, 0}}, 0.0016f);
  EXPECT_EQ(table.pages[page].errors.size(), 1u);
  EXPECT_GE(table.pages[page].cuts.size(), 1u);
  expect_sound(table, page);
}

TEST(Instruments, SuctionTakesWhatIsLooseAndNothingElse) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  use(table, page, kSuction, {{0, 0.0115, 0}}, 0.002f);
  ASSERT_EQ(table.pages[page].errors.size(), 1u);  // nothing loose here
  use(table, page, kPunch, {{0, 0.0110, 0}}, 0.0012f, kShiftKey);
  ASSERT_EQ(table.pages[page].pieces, 2u);
  use(table, page, kSuction, {{0.012, 0.021, 0}}, 0.002f);
  EXPECT_EQ(table.pages[page].pieces, 2u);
  use(table, page, kSuction, {{0, 0.0110, 0}}, 0.002f, 0, 8);
  EXPECT_EQ(table.pages[page].pieces, 1u);
  EXPECT_EQ(table.engine.session().undo_depth(), 2);
  expect_sound(table, page);
  table.tick(20);
  ASSERT_GT(table.pages[page].scores, 0u);
  EXPECT_GT(table.pages[page].score[1], 0.1f);
  EXPECT_EQ(table.pages[page].score_pieces, 0u);
}

TEST(Instruments, APieceThatIsPulledOutAndLetGoIsTakenAway) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  use(table, page, kTake, {{0, 0.0110, 0}, {0, 0.0140, 0}}, 0);
  EXPECT_EQ(table.pages[page].errors.size(), 1u);  // one piece
  EXPECT_EQ(table.pages[page].grasps, 0u);
  table.tell(page, page_command(1, kReset));  // it still swings
  table.tick();
  use(table, page, kPunch, {{0, 0.0110, 0}}, 0.0012f, kShiftKey);
  use(table, page, kTake, {{0.012, 0.018, 0}, {0.011, 0.018, 0}}, 0);
  EXPECT_EQ(table.pages[page].errors.size(), 2u);  // attached
  EXPECT_EQ(table.pages[page].pieces, 2u);
  use(table, page, kTake, {{0, 0.0110, 0}, {0, 0.0130, 0}, {0, 0.0160, 0}}, 0);
  EXPECT_EQ(table.pages[page].errors.size(), 2u);
  EXPECT_EQ(table.pages[page].pieces, 1u);
  EXPECT_EQ(table.pages[page].grasps, 0u);
  expect_sound(table, page);
  table.tell(page, page_command(9, kUndo));
  table.tick();
  EXPECT_EQ(table.pages[page].pieces, 2u);
  EXPECT_EQ(table.pages[page].grasps, 0u) << "nothing holds what has come back";
  expect_sound(table, page);
}

TEST(Instruments, ScissorsCutInSnipsAsOneStroke) {
  Table table;
  const auto page = table.join();
  table.tick();
  std::vector<Point> across;
  for (int i = 0; i <= 40; ++i) across.push_back({0.0, -0.085 + 0.00425 * i, 0});
  use(table, page, kScissors, across, 0.02f, 0, 1, kEye);
  ASSERT_EQ(table.pages[page].cuts.size(), 1u);
  EXPECT_EQ(table.pages[page].pieces, 2u);
  EXPECT_EQ(table.engine.session().undo_depth(), 1);
  expect_sound(table, page);
}

TEST(Instruments, AShaverSmoothsWhatAPunchLeftJagged) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick();
  use(table, page, kPunch, {{-0.0015, 0.0130, 0}, {0.0015, 0.0130, 0}}, 0.0016f);
  const double jagged = table.engine.session().roughness();
  ASSERT_GT(jagged, 1e-5);
  double last = jagged;
  for (int pass = 0; pass < 3; ++pass) {
    std::vector<Point> along;
    for (int i = 0; i <= 12; ++i) along.push_back({-0.003 + 0.0005 * i, 0.0118, 0});
    use(table, page, kShaver, along, 0.0012f, 0, 2);
    const double now = table.engine.session().roughness();
    EXPECT_LE(now, last);
    last = now;
    expect_sound(table, page);
  }
  EXPECT_LT(last, 0.8 * jagged);
  EXPECT_EQ(table.engine.session().undo_depth(), 4 + 3);  // each stroke of the shaver is one
  table.tell(page, page_tool(9, kShaver, kDown, {ray_between(kAbove, {0, 0.0118, 0})}, 0, 0.0012f));
  table.tick(3);
  table.tell(page, page_tool(10, kShaver, kCancel, {}));
  table.tick();
  EXPECT_EQ(table.engine.session().roughness(), last);
  expect_sound(table, page);
}

TEST(Instruments, TheProbeFollowsThePointerAndFeels) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tick(2);
  table.tell(page, page_tool(5, kProbe, kDown, {ray_between(kAbove, {0, 0.008, 0})}, 0, 0.001f));
  table.tick(60);
  const auto pressed = table.engine.session().tools()[0];
  EXPECT_GT(norm(pressed.force), 1e-4);
  // The end of its hook is pressed into the place that is pointed at.
  const Vec3 hook = pressed.pose.to_world({0.002, 0, 0});
  EXPECT_NEAR(hook.x, 0, 1e-3);
  EXPECT_NEAR(hook.y, 0.008, 1e-3);
  table.tell(page, page_tool(6, kProbe, kUp, {}));
  table.tick(90);
  EXPECT_LT(norm(table.engine.session().tools()[0].pose.position - Vec3{0, 0.015, 0.012}),
            1e-9);  // back where it waited
  EXPECT_NEAR(norm(table.engine.session().tools()[0].force), 0, 1e-9);
  EXPECT_GT(table.engine.session().score()->largest_force, 1e-4);
}

// Paper, 5.3: the shaver smooths "while its contact pushes the meniscus".
TEST(Instruments, TheShaverPushesWhatItSmooths) {
  const auto most_moved = [](const Session& session) {
    const auto now = session.visual_positions();
    const auto& rest = session.body().complex.visual.rest;
    double most = 0;
    for (std::size_t v = 0; v < now.size(); ++v) most = std::max(most, norm(now[v] - rest[VisualVertex(v)]));
    return most;
  };
  SceneSource without = trainer();
  without.text.resize(without.text.rfind("[[tool]]"));
  for (const bool over : {false, true})
    for (const SceneSource& source : {trainer(), without}) {
      Table table({}, source);
      const auto page = table.join();
      table.tick(2);
      use(table, page, kPunch, {{-0.0012, 0.0130, 0}, {0.0012, 0.0130, 0}}, 0.0016f);
      const double jagged = table.engine.session().roughness();
      table.tell(page, page_tool(5, kShaver, kDown, {ray_between(kAbove, {0, over ? 0.0110 : 0.0118, 0})}, 0, 0.0012f));
      double force = 0, moved = 0;
      for (int i = 0; i < 60; ++i) {
        table.tick();
        if (table.engine.session().tools().size() > 1)
          force = std::max(force, norm(table.engine.session().tools()[1].force));
        moved = std::max(moved, most_moved(table.engine.session()));
        const Status valid = table.engine.session().validate();
        ASSERT_TRUE(valid.ok()) << valid.error().message;
      }
      EXPECT_LT(table.engine.session().roughness(), jagged);
      if (source.text == without.text) {
        EXPECT_LT(moved, 1e-6);
      } else {
        EXPECT_GT(force, 1e-3) << over;
        EXPECT_LT(force, 20) << over;
        EXPECT_GT(moved, 2e-5) << over;
        EXPECT_LT(moved, 2e-3) << over;
      }
      table.tell(page, page_tool(6, kShaver, kUp, {}));
      table.tick(120);
      expect_sound(table, page);
      if (source.text == without.text) continue;
      const auto parked = table.engine.session().tools()[1];
      EXPECT_LT(norm(parked.pose.position - Vec3{0.01, 0.015, 0.012}), 1e-9);
      EXPECT_NEAR(norm(parked.force), 0, 1e-9);
      EXPECT_LT(most_moved(table.engine.session()), 0.2 * moved);
    }
}

TEST(Instruments, AnOperationReplaysToTheBit) {
  Table table({}, trainer());
  const auto page = table.join();
  table.tell(page, page_command(1, kRecording, {1}));
  table.tick(3);
  use(table, page, kPunch, {{-0.0015, 0.0130, 0}, {0.0015, 0.0130, 0}}, 0.0016f);
  table.tell(page, page_command(2, kUndo));
  table.tell(page, page_command(3, kRedo));
  use(table, page, kPunch, {{0, 0.0095, 0}}, 0.001f, kShiftKey);
  use(table, page, kSuction, {{0, 0.0095, 0}}, 0.002f, 0, 3);
  use(table, page, kShaver, {{-0.002, 0.0118, 0}, {0, 0.0118, 0}, {0.002, 0.0118, 0}}, 0.0012f, 0, 4);
  use(table, page, kProbe, {{0, 0.007, 0}}, 0.001f, 0, 30);
  use(table, page, kScissors, {{0.006, 0.018, 0}, {0.006, 0.012, 0}}, 0.002f, 0, 2);
  EXPECT_TRUE(table.pages[page].errors.empty());
  const Recording made = table.engine.recording();
  auto read = parse_recording(recording_text(made), "operation");
  ASSERT_TRUE(read.ok()) << read.error().message;
  auto report = replay(*read);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->first_difference, -1);
  ASSERT_TRUE(report->score);
  EXPECT_EQ(report->score->lesion_removed, table.engine.session().score()->lesion_removed);
}

}  // namespace
}  // namespace kerf::engine_instruments_test
