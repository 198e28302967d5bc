// Punches in a session: everything follows, one undo step, to the bit.
#include <gtest/gtest.h>

#include <numbers>

#include "kerf/base/random.h"
#include "kerf/session/session.h"
#include "session/make_session.h"
#include "session/session_measures.h"

namespace kerf::session_punch_test {
namespace {

using test::box_of;
using test::model_session;

Session make_session(const char* model, double time_step = 0.002) { return model_session(model, 0, 4, time_step); }

/// A place on the mid-surface of the body.
Vec3 somewhere(Session& session, Random& random) {
  const auto& p = session.collision_positions();
  return p[static_cast<std::size_t>(random.index(static_cast<int>(p.size())))];
}

TEST(SessionPunch, IsOneUndoStepToTheBit) {
  for (const char* model : {"meniscus", "steak", "sheet", "tube"}) {
    Session session = make_session(model);
    const Box3 box = box_of(session);
    ASSERT_TRUE(session.step(3).ok());
    const double radius = 0.12 * std::min(box.size().x, box.size().y);
    Random random(3);
    std::vector<std::uint64_t> hashes{session.hash()};
    for (int i = 0; i < 12; ++i) {
      Punch p;
      p.centre = somewhere(session, random);
      p.outline = circle_outline(radius, 0.05 * radius);
      p.reach = 0.3 * box.size().z + radius;
      const auto done = session.punch(p, SceneFrame::kWorld, 0.1 * radius);
      ASSERT_TRUE(done) << model << ": " << done.error().message;
      const Status valid = session.validate();
      ASSERT_TRUE(valid.ok()) << model << " punch " << i << ": " << valid.error().message;
      if (done->cut) hashes.push_back(session.hash());
      EXPECT_EQ(session.undo_depth(), static_cast<int>(hashes.size()) - 1);
    }
    EXPECT_GT(hashes.size(), 6u) << model;
    EXPECT_GT(session.counts().pieces, 3) << model;
    for (std::size_t i = hashes.size(); i-- > 1;) {
      EXPECT_EQ(session.hash(), hashes[i]) << model;
      ASSERT_TRUE(session.undo().ok());
    }
    EXPECT_EQ(session.hash(), hashes[0]) << model;
    for (std::size_t i = 1; i < hashes.size(); ++i) {
      ASSERT_TRUE(session.redo().ok());
      EXPECT_EQ(session.hash(), hashes[i]) << model;
    }
    ASSERT_TRUE(session.step(5).ok());
    EXPECT_TRUE(session.validate().ok());
  }
}

// Punches that cross an earlier one at a small angle roughen their own walls only, and all is drawn where it is.
TEST(SessionPunch, LeavesTheWallsOfEarlierCutsAsTheyAre) {
  Random random(8);
  int tried = 0;
  for (int set = 0; set < 8; ++set) {
    Scene scene;
    scene.body.model = "steak";
    scene.cut.dust = 0;  // ids stay
    Session session = test::make(scene);
    const Box3 box = box_of(session);
    const double edge = session.body().complex.mean_root_edge, radius = random.uniform(0.5, 3) * edge;
    for (int i = 0; i < 4; ++i) {
      const VisualMesh& mesh = session.body().complex.visual;
      const std::vector<Vec3> before = mesh.rest.raw();
      Punch p;
      p.centre = box.center() + 0.2 * edge * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), 0};
      p.outline = circle_outline(radius + random.uniform(-0.2, 0.2) * edge, 0.02 * radius);
      p.reach = box.size().z;
      const auto done = session.punch(p, SceneFrame::kWorld, 0.1 * radius);
      if (!done || !done->cut) continue;
      ++tried;
      int moved = 0;
      for (const VisualVertex v : ids<VisualVertex>(before.size()))
        if (mesh.patch[VisualMesh::face(mesh.outgoing[v])].is_wall() && mesh.rest[v] != before[v.index()]) ++moved;
      EXPECT_EQ(moved, 0) << set << ", punch " << i;
      const std::vector<Vec3> drawn = session.visual_positions();
      double beside = 0;
      for (const VisualVertex v : ids<VisualVertex>(mesh.vertex_count()))
        beside = std::max(beside, norm(drawn[v.index()] - mesh.rest[v]));
      EXPECT_LT(beside, 1e-9 * box.diagonal()) << set << ", punch " << i;
    }
  }
  EXPECT_GT(tried, 16);
}

// Two bites over a straight rim that meet deeper than the rim leave a sliver between them. It goes with the bite that cuts it loose.
TEST(SessionPunch, TheScrapBetweenTwoBitesGoesWithTheSecond) {
  for (const bool take : {false, true}) {
    Session session = make_session("sheet");
    const Box3 box = box_of(session);
    const double r = 0.1 * box.size().x, deep = 0.6 * r;
    const Vec3 rim{box.center().x, box.min.y, box.center().z};
    for (const double x : {-0.93 * r, 0.93 * r}) {
      SceneCommand command;
      ScenePunch punch;
      punch.frame = SceneFrame::kRest;
      punch.shape = ScenePunchShape::kCircle;
      punch.point = rim + Vec3{x, deep, 0};
      punch.radius = r;
      punch.take = take || x < 0;
      command.what = punch;
      const Status done = session.apply(command);
      ASSERT_TRUE(done.ok()) << done.error().message;
      const Status valid = session.validate();
      ASSERT_TRUE(valid.ok()) << valid.error().message;
    }
    EXPECT_EQ(session.counts().pieces, take ? 1 : 3);  // the sheet, the bite and the scrap
  }
}

// What a scene calls round has the area of its curve, and stays within a quarter of the path tolerance of it.
TEST(SessionPunch, OutlinesOfScenesAreAsLargeAsTheirCircles) {
  Session session = make_session("meniscus");
  ScenePunch punch;
  punch.radius = 0.003;
  for (const ScenePunchShape shape : {ScenePunchShape::kCircle, ScenePunchShape::kD}) {
    punch.shape = shape;
    const std::vector<Vec2> p = session.outline_of(punch);
    const double area = (shape == ScenePunchShape::kD ? 0.5 : 1) * std::numbers::pi * punch.radius * punch.radius;
    double twice = 0, off = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      twice += cross(p[i], p[(i + 1) % p.size()]);
      off = std::max(off, std::fabs(norm(p[i]) - punch.radius));
    }
    EXPECT_NEAR(0.5 * twice, area, 1e-9 * area);
    EXPECT_LT(off, 0.25 * session.scene().cut.path_tolerance * session.body().complex.mean_root_edge);
  }
}

TEST(SessionPunch, BadInputAndAirLeaveEverythingAsItWas) {
  Session session = make_session("meniscus");
  Punch p;
  p.centre = {1, 1, 0};
  p.outline = circle_outline(0.003, 1e-4);
  Random random(1);
  Punch good = p;
  good.centre = somewhere(session, random);
  ASSERT_TRUE(session.punch(good, SceneFrame::kWorld).ok());
  ASSERT_TRUE(session.undo().ok());
  const std::uint64_t hash = session.hash();
  const auto air = session.punch(p, SceneFrame::kWorld);
  ASSERT_TRUE(air);
  EXPECT_FALSE(air->cut);
  EXPECT_FALSE(session.punch(good, SceneFrame::kWorld, -1).ok());
  good.outline.resize(2);
  EXPECT_FALSE(session.punch(good, SceneFrame::kWorld).ok());
  EXPECT_EQ(session.hash(), hash);
  EXPECT_EQ(session.redo_depth(), 1);
  ASSERT_TRUE(session.redo().ok());
}

}  // namespace
}  // namespace kerf::session_punch_test
