// Whole sessions: bind, simulate, cut, undo, on the demo models.
#include "kerf/session/session.h"

#include <gtest/gtest.h>

#include "kerf/base/parallel.h"
#include "kerf/session/run_report.h"
#include "kerf/session/scene_file.h"

namespace kerf {
namespace {

Scene scene_of(const char* model) {
  Scene scene;
  scene.name = model;
  scene.body.model = model;
  scene.simulation.time_step = 0.005;
  scene.simulation.gravity = {0, 0, -1};
  return scene;
}

Session make(const Scene& scene) {
  auto session = Session::create(scene);
  EXPECT_TRUE(session.ok()) << (session.ok() ? "" : session.error().message);
  return std::move(session).value();
}

void expect_valid(const Session& session) {
  const Status valid = session.validate();
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

SceneFix half_space(Vec3 point, Vec3 normal) {
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = point;
  fix.region.normal = normal;
  return fix;
}

TEST(Session, ModelsHaveThePapersCounts) {
  struct Row { const char* model; std::size_t visual, triangles, collision, collision_triangles, nodes, hexahedra; };
  for (const Row& row : {Row{"sheet", 3425, 6656, 65, 104, 200, 81}, Row{"steak", 2641, 5278, 85, 137, 190, 76},
                         Row{"meniscus", 2882, 5760, 105, 160, 120, 42}}) {
    const Session session = make(scene_of(row.model));
    const BodyCounts c = session.counts();
    EXPECT_EQ(c.collision_vertices, row.collision) << row.model;
    EXPECT_EQ(c.collision_triangles, row.collision_triangles) << row.model;
    EXPECT_EQ(c.nodes, row.nodes) << row.model;
    EXPECT_EQ(c.hexahedra, row.hexahedra) << row.model;
    EXPECT_GE(c.visual_vertices, row.visual) << row.model;
    EXPECT_EQ(c.pieces, 1);
    expect_valid(session);
  }
}

TEST(Session, FreeFallIsExact) {
  Scene scene = scene_of("steak");
  scene.material.damping_mass = 0;
  scene.simulation.tolerance = 1e-8;
  Session session = make(scene);
  const Vec3 before = session.node_positions()[0];
  ASSERT_TRUE(session.step(100).ok());
  // Implicit Euler: sum of g dt k dt.
  const double dt = scene.simulation.time_step;
  EXPECT_NEAR(session.node_positions()[0].z - before.z, -1 * dt * dt * 100 * 101 / 2, 1e-6 * dt * dt * 5050);
}

TEST(Session, HangingBodyPullsOnItsSupportsWithItsWeight) {
  Scene scene = scene_of("sheet");
  scene.simulation.time_step = 0.02;
  scene.material.damping_mass = 5;
  scene.simulation.tolerance = 1e-6;
  scene.fixes.push_back(half_space({-0.45, 0, 0}, {-1, 0, 0}));
  Session session = make(scene);
  ASSERT_TRUE(session.step(1500).ok());
  EXPECT_NEAR(session.support_force().z, 1.0, 0.01);  // 1 kg at 1 m/s2
  expect_valid(session);
}

/// A cut across the middle while the body moves, and undo and redo to the bit.
TEST(Session, CutUndoRedo) {
  for (const char* model : {"sheet", "closed-sheet", "steak", "meniscus"}) {
    Scene scene = scene_of(model);
    Session session = make(scene);
    Box3 box;
    for (const Vec3 p : session.collision_positions()) box.add(p);
    ASSERT_TRUE(session.step(5).ok());
    const std::uint64_t before = session.hash();
    const std::uint64_t body_before = body_hash(session.body());
    const Vec3 size = box.size(), c = box.center();
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
    for (int i = 0; i <= 20; ++i) {
      const double y = c.y + size.y * (-0.6 + 1.2 * i / 20);
      const Status moved = session.move_blade({c.x + 0.03 * size.x, y, box.max.z + size.x}, {c.x + 0.03 * size.x, y, box.min.z - size.x});
      ASSERT_TRUE(moved.ok()) << moved.error().message;
      expect_valid(session);
    }
    ASSERT_TRUE(session.end_stroke().ok());
    EXPECT_EQ(session.counts().pieces, 2) << model;
    EXPECT_GT(session.counts().nodes, 0u);
    const std::uint64_t cut = session.hash();
    ASSERT_TRUE(session.undo().ok());
    EXPECT_EQ(body_hash(session.body()), body_before) << model;
    EXPECT_EQ(session.hash(), before) << model;
    expect_valid(session);
    ASSERT_TRUE(session.redo().ok());
    EXPECT_EQ(session.hash(), cut) << model;
    expect_valid(session);
    ASSERT_TRUE(session.step(20).ok());
    expect_valid(session);
    ASSERT_TRUE(session.undo().ok());
    EXPECT_EQ(body_hash(session.body()), body_before) << model;
    ASSERT_TRUE(session.step(5).ok());
    expect_valid(session);
  }
}

}  // namespace
}  // namespace kerf
