// The score of the trainer: against closed forms and against what was done.
#include "kerf/session/score.h"

#include <gtest/gtest.h>

#include <numbers>

#include "kerf/scene/scene_file.h"
#include "kerf/session/session.h"

namespace kerf::score_test {
namespace {

Scene slab(double radius) {
  Scene scene;
  scene.name = "slab";
  scene.body.model = "closed-sheet";  // 1 x 1 x 0.1 m
  scene.body.options.visual_triangles = 800;
  scene.simulation.gravity = {};
  SceneRegion lesion;
  lesion.shape = SceneRegion::Shape::kSphere;
  lesion.center = {0.1, -0.05, 0};
  lesion.radius = radius;
  scene.lesion = lesion;
  return scene;
}

Punch punch_at(Vec3 centre, double radius) {
  Punch p;
  p.centre = centre;
  p.outline = circle_outline(radius, 0.002);
  return p;
}

TEST(Score, TheVolumeOfALesionIsThatOfADiscOfTheSlab) {
  auto session = Session::create(slab(0.2));
  ASSERT_TRUE(session.ok()) << session.error().message;
  const auto score = session->score();
  ASSERT_TRUE(score.has_value());
  const double disc = std::numbers::pi * 0.04 * 0.1;
  EXPECT_NEAR(score->lesion_volume, disc, 2e-4 * disc);
  EXPECT_EQ(score->lesion_removed, 0);
  EXPECT_EQ(score->healthy_removed, 0);
  EXPECT_EQ(score->loose_pieces, 0);
}

TEST(Score, FollowsWhatIsTakenOut) {
  auto session = Session::create(slab(0.2));
  ASSERT_TRUE(session.ok());
  // A wider bite: all of the lesion, and a ring around it.
  const auto cut = session->punch(punch_at({0.1, -0.05, 0}, 0.26), SceneFrame::kRest);
  ASSERT_TRUE(cut.ok() && cut->cut);
  auto score = session->score();
  EXPECT_NEAR(score->lesion_removed, 0, 2e-4) << "it still lies there";
  EXPECT_EQ(score->loose_pieces, 1);
  ASSERT_TRUE(session->remove_piece(cut->loose[0]).ok());
  score = session->score();
  EXPECT_NEAR(score->lesion_removed, 1, 2e-4);
  const double ring = std::numbers::pi * (0.26 * 0.26 - 0.04) * 0.1;
  EXPECT_NEAR(score->healthy_removed, ring, 0.06 * ring);
  EXPECT_EQ(score->loose_pieces, 0);
  ASSERT_TRUE(session->undo().ok());
  EXPECT_NEAR(session->score()->lesion_removed, 0, 2e-4);
}

TEST(Score, HalfOfTheLesionAndNothingElse) {
  auto session = Session::create(slab(0.3));
  ASSERT_TRUE(session.ok());
  const auto cut = session->punch(punch_at({0.1, -0.05, 0}, 0.3 / std::sqrt(2.0)), SceneFrame::kRest);
  ASSERT_TRUE(cut.ok() && cut->cut);
  ASSERT_TRUE(session->remove_piece(cut->loose[0]).ok());
  const auto score = session->score();
  EXPECT_NEAR(score->lesion_removed, 0.5, 0.03);
  EXPECT_LT(score->healthy_share, 2e-4);
}

TEST(Score, SlitsBesideABiteAreNotPartOfItsRoughness) {
  auto session = Session::create(slab(0.1));
  ASSERT_TRUE(session.ok());
  const auto slash = [&](double x) {
    ASSERT_TRUE(session->begin_stroke(SceneFrame::kRest, false).ok());
    for (int i = 0; i <= 10; ++i)
      ASSERT_TRUE(session->move_blade({x, -0.3 + 0.06 * i, 0.2}, {x, -0.3 + 0.06 * i, -0.2}).ok());
    ASSERT_TRUE(session->end_stroke().ok());
  };
  slash(-0.3);
  EXPECT_EQ(session->score()->roughness, 0) << "nothing is gone yet";
  const auto cut = session->punch(punch_at({0.1, -0.05, 0}, 0.12), SceneFrame::kRest, 0.01);
  ASSERT_TRUE(cut.ok() && cut->cut);
  EXPECT_EQ(session->score()->roughness, 0) << "it still lies there";
  ASSERT_TRUE(session->remove_piece(cut->loose[0]).ok());
  const double rough = session->score()->roughness;
  EXPECT_GT(rough, 1e-3);
  EXPECT_LT(rough, 1e-2);
  const double all = session->roughness();
  EXPECT_LT(all, 0.95 * rough) << "the slit's walls are smooth";
  slash(-0.4);
  slash(0.4);
  EXPECT_LT(session->roughness(), 0.95 * all);
  EXPECT_EQ(session->score()->roughness, rough);
}

TEST(Score, NoLesionNoScoreAndALesionBesideTheBodyIsRefused) {
  Scene scene = slab(0.2);
  scene.lesion.reset();
  auto session = Session::create(scene);
  ASSERT_TRUE(session.ok());
  EXPECT_FALSE(session->score().has_value());
  scene = slab(0.2);
  scene.lesion->center = {5, 0, 0};
  const auto refused = Session::create(scene);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("[lesion]"), std::string::npos);
  const auto bad = parse_scene("[body]\nmodel = \"sheet\"\n[lesion]\nbal = 3\n", "s.toml");
  ASSERT_FALSE(bad.ok());
  EXPECT_NE(bad.error().message.find("bal"), std::string::npos);
}

}  // namespace
}  // namespace kerf::score_test
