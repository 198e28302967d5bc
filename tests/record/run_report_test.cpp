// What a run's report says of tools and contact.
#include "kerf/record/run_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "session/make_session.h"

namespace kerf::run_report_test {
namespace {

using ::testing::HasSubstr;

constexpr double kHalf = 0.0015;  // m, of the strip

/// A strip on a board, and a ball above it.
Scene strip_on_a_board() {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 1000;
  scene.body.position = {0, 0, 0.0016};
  scene.simulation.time_step = 0.005;
  SceneObstacle& board = scene.obstacles.emplace_back();
  board.name = "board";
  SceneRigidTool& ball = scene.tools.emplace_back();
  ball.id = "ball";
  ball.kind = SceneToolKind::kSphere;
  ball.radius = 0.005;
  ball.position = {0, 0, 0.012};
  return scene;
}

RunLog with_overlaps(std::vector<double> shares) {
  RunLog log;
  for (const double share : shares) {
    log.steps.emplace_back();
    log.steps.back().time = 0.01 * static_cast<double>(log.steps.size());
    log.steps.back().overlap = share * kHalf;
  }
  return log;
}

TEST(RunReport, SaysHowDeepThingsWereInEachOther) {
  const Session session = test::make(strip_on_a_board());
  EXPECT_EQ(overlap_note(session, {}), "");
  EXPECT_EQ(overlap_note(session, with_overlaps({0, 0.01, 0.04})), "");
  const std::string deep = overlap_note(session, with_overlaps({0, 0.2, 0.3, 0.01}));
  EXPECT_THAT(deep, HasSubstr("0.45 mm"));
  EXPECT_THAT(deep, HasSubstr("at 0.03 s"));
  EXPECT_THAT(deep, HasSubstr("time_step"));
  EXPECT_THAT(deep, HasSubstr("substeps"));
  // What starts inside is told of at the start.
  EXPECT_EQ(overlap_note(session, with_overlaps({0.9, 0.5, 0.04, 0.01})), "");
  EXPECT_THAT(overlap_note(session, with_overlaps({0.9, 0.5, 0.04, 0.1})), HasSubstr("at 0.04 s"));
  EXPECT_THAT(overlap_note(session, with_overlaps({0.9, 0.5, 0.6})), HasSubstr("at 0.03 s")) << "it never came out";
  EXPECT_NEAR(deepest_overlap(session, with_overlaps({0.9, 0.5})).share, 0.9, 1e-9);
}

TEST(RunReport, HasWhatToolsFeltAndWhatObstaclesBear) {
  Session session = test::make(strip_on_a_board());
  SceneCommand down;
  down.what = SceneToolMotion{"ball", {{0.2, {0, 0, 0.006}, {}}}};
  ASSERT_TRUE(session.apply(down).ok());
  RunLog log;
  double most = 0, when = 0;
  for (int i = 0; i < 200; ++i) {
    const auto step = session.step();
    ASSERT_TRUE(step.ok()) << step.error().message;
    log.add(session, *step);
    const double force = norm(session.tools()[0].force);
    if (force > most) most = force, when = session.time();
  }
  const auto report = nlohmann::json::parse(run_report_json(session, log));
  const auto& tool = report["tools"][0];
  EXPECT_EQ(tool["id"], "ball");
  EXPECT_GT(most, 0.1);
  EXPECT_EQ(tool["largest_force"]["newtons"], most);
  EXPECT_EQ(tool["largest_force"]["time"], when);
  EXPECT_TRUE(tool["largest_torque"].contains("newton_metres"));
  const Session::ToolState now = session.tools()[0];
  EXPECT_EQ(tool["end"]["position"][2], now.place.position.z);
  EXPECT_EQ(tool["end"]["force"][2], now.force.z);
  EXPECT_EQ(tool["end"]["torque"][0], now.torque.x);
  EXPECT_EQ(tool["end"]["coupling_force"][2], now.coupling_force.z);
  // The board carries the strip's weight and the press.
  const auto& contact = report["contact"];
  const double weight = 0.2 * 0.024 * 0.003 * session.material().density * 9.81,
               on_board = contact["obstacles"][0]["force_end"][2];
  EXPECT_EQ(contact["obstacles"][0]["name"], "board");
  EXPECT_NEAR(on_board, -(weight + now.force.z), 0.03 * (weight + now.force.z));
  EXPECT_GT(contact["pressing_most"], 0);
  EXPECT_GE(contact["contacts_most"], contact["pressing_most"]);
  const auto deepest = std::max_element(log.steps.begin(), log.steps.end(),
                                        [](const auto& a, const auto& b) { return a.overlap < b.overlap; });
  EXPECT_EQ(contact["deepest_overlap"]["metres"], deepest->overlap);
  EXPECT_EQ(contact["deepest_overlap"]["time"], deepest->time);
  EXPECT_NEAR(contact["deepest_overlap"]["share_of_half_thickness"], deepest->overlap / kHalf, 1e-9);
}

TEST(RunReport, IsSilentWhereNothingTouches) {
  Scene scene = strip_on_a_board();
  scene.obstacles.clear();
  scene.tools.clear();
  const Session session = test::make(scene);
  const auto report = nlohmann::json::parse(run_report_json(session, {}));
  EXPECT_FALSE(report.contains("tools"));
  EXPECT_FALSE(report.contains("contact"));
}

}  // namespace
}  // namespace kerf::run_report_test
