// Whole sessions: bind, simulate, cut, undo, on the demo models.
#include "kerf/session/session.h"

#include <gtest/gtest.h>

#include "kerf/base/parallel.h"
#include "kerf/record/run_report.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/body_mechanics.h"
#include "session/make_session.h"

namespace kerf::session_test {
namespace {

using test::make;

Scene scene_of(const char* model) {
  Scene scene;
  scene.name = model;
  scene.body.model = model;
  scene.simulation.time_step = 0.005;
  scene.simulation.gravity = {0, 0, -1};
  return scene;
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
  struct Row {
    const char* model;
    std::size_t visual, triangles, collision, collision_triangles, nodes, hexahedra;
  };
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

TEST(Session, AStrokeThroughASlitGoesOnFromItsEnd) {
  // The second stroke begins outside, follows the slit of the first one and cuts the rest: no bridge is left where the first one ended.
  for (const auto& [model, half_of_it] : {std::pair{"strip", 0.012}, std::pair{"sheet", 0.5}, std::pair{"steak", 0.09}})
    for (const double end : {-0.11, 0.0, 0.17, 0.42})
      for (const int poses : {3, 12, 200}) {
        const double half = half_of_it;  // clang captures no structured binding
        Scene scene = scene_of(model);
        scene.contact.enabled = false;
        Session session = make(scene);
        const auto stroke = [&](double to) {
          ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
          for (int i = 0; i <= poses; ++i) {
            const Vec3 p{0.1 * half, (-1.7 + (to + 1.7) * i / poses) * half, 0};
            ASSERT_TRUE(session.move_blade(p + Vec3{0, 0, 0.3}, p - Vec3{0, 0, 0.3}).ok());
          }
          ASSERT_TRUE(session.end_stroke().ok());
        };
        stroke(end);
        ASSERT_EQ(session.counts().pieces, 1);
        stroke(1.7);
        EXPECT_EQ(session.counts().pieces, 2) << model << " " << end << " " << poses;
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
/// Cuts at both sides of a sheet in one stroke: what lies between them stays whole, and one undo takes both back.
TEST(Session, ALiftedBladeCutsOnWhereItIsPutIn) {
  Scene scene = scene_of("sheet");
  scene.contact.enabled = false;
  Session session = make(scene);
  session.lift_blade();  // nobody has one
  const std::uint64_t before = body_hash(session.body());
  const std::size_t vertices = session.counts().collision_vertices;
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (const double x : {-0.3, 0.28}) {
    session.lift_blade();
    for (int i = 0; i <= 10; ++i)
      ASSERT_TRUE(session.move_blade({x, -0.6 + 0.12 * i, 0.3}, {x, -0.6 + 0.12 * i, -0.3}).ok());
  }
  session.lift_blade();
  ASSERT_TRUE(session.end_stroke().ok());
  EXPECT_EQ(session.counts().pieces, 3);
  expect_valid(session);
  const auto& rest = session.body().complex.collision.rest;
  ASSERT_GT(rest.size(), vertices + 10);
  for (std::size_t v = vertices; v < rest.size(); ++v)
    EXPECT_LT(std::min(std::fabs(rest[CollisionVertex(v)].x + 0.3), std::fabs(rest[CollisionVertex(v)].x - 0.28)),
              0.02);
  EXPECT_EQ(session.undo_depth(), 1);
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(body_hash(session.body()), before);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.counts().pieces, 3);
}

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
      const Status moved = session.move_blade({c.x + 0.03 * size.x, y, box.max.z + size.x},
                                              {c.x + 0.03 * size.x, y, box.min.z - size.x});
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

/// Cuts from border to border along y at this x, in `poses` poses.
void cut_along_y(Session& session, double x, int poses) {
  Box3 box;
  for (const Vec3 p : session.body().complex.collision.rest.raw()) box.add(p);
  const double reach = 2 * norm(box.size());
  for (int i = 0; i <= poses; ++i) {
    const double y = box.min.y - 0.1 * box.size().y + 1.2 * box.size().y * i / poses;
    ASSERT_TRUE(session.move_blade({x, y, reach}, {x, y, -reach}).ok());
  }
}

TEST(Session, AfterUndoTimeGoesOnAsIfNothingHadBeenCut) {
  for (const char* model : {"steak", "closed-sheet"}) {
    Session session = make(scene_of(model)), untouched = make(scene_of(model));
    ASSERT_TRUE(session.step(5).ok());
    ASSERT_TRUE(untouched.step(5).ok());
    for (const double x : {0.013, -0.021, 0.0131}) {
      ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
      cut_along_y(session, x, 9);
      ASSERT_TRUE(session.end_stroke().ok());
    }
    ASSERT_TRUE(session.undo().ok());
    ASSERT_TRUE(session.redo().ok());
    while (session.undo_depth() > 0) ASSERT_TRUE(session.undo().ok());
    ASSERT_TRUE(session.step(7).ok());
    ASSERT_TRUE(untouched.step(7).ok());
    EXPECT_EQ(session.node_positions(), untouched.node_positions()) << model;
    EXPECT_EQ(session.node_velocities(), untouched.node_velocities()) << model;
    // What a redo brings back moves on too.
    ASSERT_TRUE(session.redo().ok());
    EXPECT_EQ(session.undo_depth(), 1);
    ASSERT_TRUE(session.step(3).ok());
    expect_valid(session);
  }
}

TEST(Session, CancelledStrokesLeaveNoTrace) {
  Scene scene = scene_of("steak");
  Session session = make(scene);
  ASSERT_TRUE(session.step(10).ok());
  const std::uint64_t before = session.hash();
  const std::vector<Vec3> positions = session.node_positions();
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  cut_along_y(session, 0.013, 12);
  EXPECT_EQ(session.counts().pieces, 2);
  ASSERT_TRUE(session.cancel_stroke().ok());
  EXPECT_EQ(session.hash(), before);
  EXPECT_EQ(session.undo_depth(), 0);

  // Halves that fell apart while the blade was in are together again, where they were.
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  cut_along_y(session, 0.013, 12);
  ASSERT_TRUE(session.step(50).ok());
  ASSERT_TRUE(session.cancel_stroke().ok());
  EXPECT_EQ(session.node_positions(), positions);
  expect_valid(session);
}

TEST(Session, GraspsOnUndoneCutsHoldWhatTheCutWasMadeIn) {
  Scene scene = scene_of("sheet");
  scene.simulation.gravity = {};
  Session session = make(scene);
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  cut_along_y(session, 0.21, 8);
  ASSERT_TRUE(session.end_stroke().ok());
  SceneCommand grasp;
  grasp.what = SceneGrasp{"g", {0.21, 0.02, 0}, SceneFrame::kRest, 0.12, std::nullopt};
  ASSERT_TRUE(session.apply(grasp).ok());
  ASSERT_TRUE(session.undo().ok());
  // The ids of the first cut's vertices are used again, elsewhere: nobody pulls at them.
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  cut_along_y(session, -0.23, 8);
  ASSERT_TRUE(session.end_stroke().ok());
  const std::vector<Vec3> before = session.visual_positions();
  ASSERT_TRUE(session.step(40).ok());
  double farthest = 0;
  const std::vector<Vec3> after = session.visual_positions();
  for (std::size_t i = 0; i < after.size(); ++i) farthest = std::max(farthest, norm(after[i] - before[i]));
  EXPECT_LT(farthest, 1e-6);
}

// Points that the cut made are held again after a redo, and none of them by a grasp of the same name that was taken in between.
TEST(Session, GraspsOnRedoneCutsHoldWhatTheyHeld) {
  Scene scene = scene_of("sheet");
  scene.simulation.gravity = {};
  Session session = make(scene);
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  cut_along_y(session, 0.21, 8);
  ASSERT_TRUE(session.end_stroke().ok());
  const SceneGrasp at_cut{"g", {0.21, 0.02, 0}, SceneFrame::kRest, 0.12, std::nullopt};
  SceneCommand command;
  command.what = at_cut;
  ASSERT_TRUE(session.apply(command).ok());
  const std::vector<CollisionVertex> held = session.grasps()[0].points;
  const std::uint64_t hash = session.hash();
  ASSERT_TRUE(session.undo().ok());
  EXPECT_LT(session.grasps()[0].points.size(), held.size());
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.grasps()[0].points, held);
  EXPECT_EQ(session.hash(), hash);

  ASSERT_TRUE(session.undo().ok());
  command.what = SceneRelease{"g"};
  ASSERT_TRUE(session.apply(command).ok());
  SceneGrasp elsewhere = at_cut;
  elsewhere.point = {-0.3, 0, 0};
  command.what = elsewhere;
  ASSERT_TRUE(session.apply(command).ok());
  const std::vector<CollisionVertex> others = session.grasps()[0].points;
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.grasps()[0].points, others);
}

TEST(Session, SettingsOfCutsThatCannotBeAreRefused) {
  const auto refusal = [](auto change) {
    Scene scene;
    scene.body.model = "sheet";
    change(scene.cut);
    const auto made = Session::create(scene);
    return made.ok() ? std::string() : made.error().message;
  };
  EXPECT_EQ(refusal([](SceneCut&) {}), "");
  EXPECT_NE(refusal([](SceneCut& c) { c.layers = 0; }).find("0 layers"), std::string::npos);
  EXPECT_NE(refusal([](SceneCut& c) { c.minimum_feature = 0.3; }).find("minimum_feature of 0.3"), std::string::npos);
  EXPECT_NE(refusal([](SceneCut& c) { c.path_tolerance = -1; }).find("path_tolerance of -1"), std::string::npos);
  EXPECT_NE(refusal([](SceneCut& c) { c.roughness = NAN; }).find("roughness of nan"), std::string::npos);
}

TEST(Session, RoughnessIsAPartOfARowsHeight) {
  std::vector<std::uint64_t> hashes;
  for (const double roughness : {0.0, 0.1, 0.4}) {
    Scene scene = scene_of("steak");
    scene.cut.roughness = roughness;
    Session session = make(scene);
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
    cut_along_y(session, 0.013, 3);
    ASSERT_TRUE(session.end_stroke().ok());
    expect_valid(session);
    hashes.push_back(body_hash(session.body()));
  }
  EXPECT_NE(hashes[0], hashes[1]);
  EXPECT_NE(hashes[1], hashes[2]);
}

/// Whoever keeps a copy of the body's arrays and applies what take_changes names has the body's arrays.
TEST(Session, ChangesNameEverythingThatChanged) {
  Session session = make(scene_of("steak"));
  session.watch_changes(true);
  const auto triangle = [&](VisualTriangle f) {
    const VisualMesh& mesh = session.body().complex.visual;
    return std::array<std::int32_t, 4>{mesh.origin[VisualMesh::corner(f, 0)].value,
                                       mesh.origin[VisualMesh::corner(f, 1)].value,
                                       mesh.origin[VisualMesh::corner(f, 2)].value, mesh.patch[f].value};
  };
  std::vector<std::array<std::int32_t, 4>> triangles;
  std::vector<HexId> copies;
  const auto read_all = [&](auto& t, auto& c) {
    t.clear();
    c.clear();
    for (const VisualTriangle f : ids<VisualTriangle>(session.body().complex.visual.face_count()))
      t.push_back(triangle(f));
    c = session.body().embedding.visual.raw();
  };
  read_all(triangles, copies);
  const auto apply_changes = [&](const std::string& when) {
    const SessionChanges changes = session.take_changes();
    EXPECT_FALSE(changes.everything);
    triangles.resize(session.body().complex.visual.face_count());
    copies.resize(session.body().complex.visual.vertex_count());
    for (const VisualTriangle f : changes.visual_triangles)
      if (f.index() < triangles.size()) triangles[f.index()] = triangle(f);
    for (const VisualVertex v : changes.moved)
      if (v.index() < copies.size()) copies[v.index()] = session.body().embedding.visual[v];
    std::vector<std::array<std::int32_t, 4>> now;
    std::vector<HexId> copies_now;
    read_all(now, copies_now);
    ASSERT_EQ(triangles, now) << when;
    ASSERT_EQ(copies, copies_now) << when;
  };
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (int i = 0; i <= 40; ++i) {
    const double y = -0.1 + 0.005 * i;
    ASSERT_TRUE(session.move_blade({0.01 + 0.1 * y, y, 1}, {0.01 + 0.1 * y, y, -1}).ok());
    apply_changes("pose " + std::to_string(i));
  }
  ASSERT_TRUE(session.end_stroke().ok());
  apply_changes("end of the stroke");
  ASSERT_TRUE(session.undo().ok());
  apply_changes("undo");
  ASSERT_TRUE(session.redo().ok());
  apply_changes("redo");
  const auto snapshot = session.snapshot();
  session.restore(snapshot);
  EXPECT_TRUE(session.take_changes().everything);
}

/// Slivers of a cut weigh next to nothing; a loose solve once let one fly off at 1e150 m/s and stopped the simulation.
TEST(Session, LightNodesAreCalmed) {
  HexMesh hex;
  hex.bodies.resize(1);
  hex.bodies[0].frame.cell = {0.01, 0.01, 0.002};
  const double dt = 1e-3;
  const std::vector<double> masses{1e-3, 1e-3, 1e-12, 1e-12, 0};
  MechanicsState state;
  state.velocities = {{0.1, 0, 0}, {0, 0.2, 0}, {0, 0, 1e12}, {0.3, 0, 0}, {5, 0, 0}};
  state.positions.resize(5);
  for (std::size_t i = 0; i < 5; ++i) state.positions[i] = dt * state.velocities[i];  // from the origin
  const MechanicsState before = state;
  calm_light_nodes(hex, masses, dt, state);
  const double limit = kLightSpeed * 0.2 + 0.01 * 0.002 / dt;
  EXPECT_NEAR(state.velocities[2].z, limit, 1e-12);
  EXPECT_NEAR(state.positions[2].z, dt * limit, 1e-6);
  for (const std::size_t i : {0u, 1u, 3u, 4u}) {
    EXPECT_EQ(state.velocities[i], before.velocities[i]);
    EXPECT_EQ(state.positions[i], before.positions[i]);
  }
}

}  // namespace
}  // namespace kerf::session_test
