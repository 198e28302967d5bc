// An edge that rests cuts what moves onto it, as if it had moved through the material itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kerf/cutting/pieces.h"
#include "kerf/session/session.h"
#include "session/blade_strip.h"
#include "session/make_session.h"
#include "session/session_measures.h"

namespace kerf::resting_edge_test {
namespace {

using test::cut_length;
using test::make;

using testing_support::kFacingY;
constexpr double kHere = 0.003;  // m, x of the cut
#ifdef __SANITIZE_ADDRESS__
const std::vector<double> kSteps{0.0167};
#else
const std::vector<double> kSteps{0.001, 0.005, 0.0167};
#endif

Scene strip_scene(double dt, double resistance) {
  Scene scene = testing_support::blade_strip(dt, kHere);
  scene.cut.resistance = resistance;
  return scene;
}

void apply(Session& session, SceneCommand command) {
  const Status done = session.apply(command);
  ASSERT_TRUE(done.ok()) << done.error().message;
}
void clamp(Session& session) {
  for (const double side : {-1.0, 1.0}) {
    std::vector<CollisionVertex> held;
    const auto& rest = session.body().complex.collision.rest;
    for (const CollisionVertex v : ids<CollisionVertex>(rest.size()))
      if (rest[v].x * side > 0.03) held.push_back(v);
    ASSERT_TRUE(session.grasp(side < 0 ? "left" : "right", held).ok());
  }
}
void move_clamps(Session& session, Vec3 by, double over) {
  for (const char* id : {"left", "right"}) {
    SceneCommand command;
    SceneMove move;
    move.id = id;
    move.by = by;
    move.over = over;
    command.what = move;
    apply(session, command);
  }
}
void lead(Session& session, Vec3 to, double over) {
  SceneCommand command;
  command.what = SceneToolMotion{"tool", {{over, to, kFacingY}}};
  apply(session, command);
}
int steps(const Session& session, double seconds) {
  return static_cast<int>(std::ceil(seconds / session.time_step() - 1e-9));
}

/// Areas of the pieces at rest, m^2, ascending.
std::vector<double> piece_areas(const Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  const Pieces pieces = collision_pieces(mesh);
  std::vector<double> areas(static_cast<std::size_t>(pieces.count), 0.0);
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const CollisionHalfEdge h = CollisionMesh::corner(f, 0);
    const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)], c = mesh.rest[mesh.apex(h)];
    areas[static_cast<std::size_t>(piece_of_triangle(pieces, f))] += 0.5 * norm(cross(b - a, c - a));
  }
  std::sort(areas.begin(), areas.end());
  return areas;
}
void expect_valid(const Session& session) {
  const Status valid = session.validate();
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

/// The strip and the edge have come together by `way` at 0.1 m/s: one moved, the other rested.
Session come_together(double dt, double resistance, double way, bool strip_moves) {
  Session session = make(strip_scene(dt, resistance));
  clamp(session);
  if (strip_moves) move_clamps(session, {0, -way, 0}, way / 0.1);
  else lead(session, {kHere, -0.02 + way, -0.012}, way / 0.1);
  EXPECT_TRUE(session.step(steps(session, way / 0.1 + 0.3)).ok());
  expect_valid(session);
  return session;
}

/// Places along it are farther apart than the strip is thick.
TEST(RestingEdge, ALongOneMissesNoThinMaterial) {
  for (const double tip : {0.02, 0.4, 3.0}) {
    Scene scene = testing_support::blade_strip(0.005, kHere);
    scene.tools[0].tip = tip;
    scene.tools[0].turning_stiffness = 1e4;
    Session session = make(scene);
    clamp(session);
    lead(session, {kHere, 0.03, -0.012}, 0.5);
    EXPECT_TRUE(session.step(steps(session, 0.6)).ok());
    EXPECT_EQ(session.counts().pieces, 2) << tip;
    expect_valid(session);
  }
}

TEST(RestingEdge, CutsAsOneThatMoves) {
  for (const double resistance : {0.0, 20.0})
    for (const double dt : kSteps) {
      {
        const Session blade = come_together(dt, resistance, 0.02, false),
                      strip = come_together(dt, resistance, 0.02, true);
        EXPECT_NEAR(cut_length(strip), 0.012, 0.0015) << resistance << " " << dt;
        EXPECT_NEAR(cut_length(strip), cut_length(blade), 0.0008) << resistance << " " << dt;
        EXPECT_TRUE(strip.in_stroke());
        EXPECT_EQ(strip.counts().pieces, 1);
        EXPECT_LT(strip.tools()[0].coupling_force.y, 1.3 * 0.003 * resistance + 0.001) << "no more than its resistance";
        EXPECT_GE(strip.tools()[0].coupling_force.y, 0.2 * 0.003 * resistance - 0.001)
            << "nor much less: it springs back a little";
      }
      Session blade = come_together(dt, resistance, 0.045, false), strip = come_together(dt, resistance, 0.045, true);
      ASSERT_EQ(blade.counts().pieces, 2) << resistance << " " << dt;
      ASSERT_EQ(strip.counts().pieces, 2) << resistance << " " << dt;
      EXPECT_FALSE(strip.in_stroke());
      EXPECT_NEAR(piece_areas(strip)[0], piece_areas(blade)[0], 0.0005 * 0.024) << resistance << " " << dt;
      EXPECT_EQ(strip.undo_depth(), 1);
      ASSERT_TRUE(strip.undo().ok());
      EXPECT_EQ(strip.counts().pieces, 1);
      expect_valid(strip);
    }
}

/// A blade that feels a resistance stretches the last strand before the rim, and is past the rim before that gives way.
TEST(RestingEdge, ALedBladePartsTheStrandThatItStretches) {
  struct Row {
    double dt, resistance;  // s, N/m
  };
  for (const Row& row : {Row{0.0009, 19}, Row{0.0009, 20}, Row{0.0009, 21}, Row{0.001, 20}, Row{0.001, 21},
                         Row{0.0011, 20}, Row{0.0011, 22}, Row{0.002, 19}, Row{0.002, 22}, Row{0.0021, 32},
                         Row{0.0036, 25.4}, Row{0.00132747, 18.3362}}) {
    const Session session = come_together(row.dt, row.resistance, 0.045, false);
    EXPECT_EQ(session.counts().pieces, 2) << row.dt << " " << row.resistance;
    EXPECT_NEAR(cut_length(session), 0.024, 0.0015) << row.dt << " " << row.resistance;
  }
}

TEST(RestingEdge, PressesBelowTheResistance) {
  for (const double dt : kSteps) {
    Session session = come_together(dt, 1e5, 0.01, true);
    EXPECT_EQ(session.undo_depth(), 0) << dt;
    EXPECT_FALSE(session.in_stroke()) << dt;
    EXPECT_GT(session.tools()[0].coupling_force.y, 0.05) << dt << ": it holds the strip back";
  }
}

/// What is held in a slit stays; what is pulled harder is cut on.
TEST(RestingEdge, CutsNothingAtRest) {
  for (const double resistance : {0.0, 20.0})
    for (const double dt : kSteps) {
      Session session = come_together(dt, resistance, 0.02, false);
      EXPECT_TRUE(session.in_stroke());
      const auto stays = [&](const char* when) {
        const double length = cut_length(session), force = session.tools()[0].coupling_force.y;
        const std::uint64_t version = session.topology_version();
        ASSERT_TRUE(session.step(steps(session, 1.0)).ok());
        EXPECT_EQ(session.topology_version(), version) << when << " " << resistance << " " << dt;
        EXPECT_EQ(cut_length(session), length);
        EXPECT_NEAR(session.tools()[0].coupling_force.y, force, 0.002) << when << " " << resistance << " " << dt;
        EXPECT_NEAR(session.tools()[0].force.y, -force, 0.002) << when << " " << resistance << " " << dt;
      };
      stays("as cut");
      const double before = cut_length(session);
      if (resistance > 0) {  // half as hard as it was cut, and harder again
        move_clamps(session, {0, 0.0005, 0}, 0.1);
        ASSERT_TRUE(session.step(steps(session, 0.3)).ok());
        move_clamps(session, {0, -0.0003, 0}, 0.1);
        ASSERT_TRUE(session.step(steps(session, 0.3)).ok());
        EXPECT_EQ(cut_length(session), before) << dt;
        stays("pulled a little");
        move_clamps(session, {0, -0.0002, 0}, 0.1);
      }
      move_clamps(session, {0, -0.004, 0}, 0.1);
      ASSERT_TRUE(session.step(steps(session, 0.4)).ok());
      EXPECT_NEAR(cut_length(session) - before, 0.004, 0.0008) << resistance << " " << dt;
      stays("cut on");
      expect_valid(session);
    }
}

/// A strip without holds falls on an edge below it that faces up and rises by `tilt` across the strip.
Session fallen(double dt, double resistance, double tilt) {
  Scene scene = strip_scene(dt, resistance);
  scene.simulation.gravity = {0, 0, -9.81};
  scene.material.young = 1e6;
  const Mat3 axes{{Vec3{0, std::sin(tilt), std::cos(tilt)}, Vec3{1, 0, 0}, Vec3{0, std::cos(tilt), -std::sin(tilt)}}};
  scene.tools[0].tip = 0.04;
  scene.tools[0].rotation = turn_of(axes);
  scene.tools[0].position = Vec3{0, 0, resistance > 0 ? -0.006 : -0.0085} - 0.02 * axes.c[2];
  Session session = make(scene);
  EXPECT_TRUE(session.step(steps(session, 0.25)).ok());
  expect_valid(session);
  return session;
}

/// In one step of 16.7 ms it falls by twice its thickness.
TEST(RestingEdge, CutsOrHoldsWhatFallsOnIt) {
  for (const double dt : kSteps) {
    for (const double tilt : {0.0, 0.01, 0.2, 0.4})
      EXPECT_NEAR(cut_length(fallen(dt, 0, tilt)), 0.024, 0.001) << dt << " " << tilt;
    const Session held = fallen(dt, 1e4, 0);
    EXPECT_FALSE(held.in_stroke()) << dt;
    EXPECT_EQ(held.undo_depth(), 0) << dt;
    EXPECT_EQ(held.counts().pieces, 1) << dt;
    EXPECT_GT(held.tools()[0].coupling_force.z, 0.05) << dt << ": it lies on the edge";
  }
}

enum class Moves { kBlade, kStrip, kStroke };

/// A whole edge, nearly parallel to the clamped strip, and the strip come together by `way`: the blade is lowered, the strip is, or a stroke is commanded.
Session landed(Scene scene, Moves moves, double speed, double tilt, double length, double way) {
  const double up = moves == Moves::kStrip ? 1 : -1;
  const Vec3 along{0, std::cos(tilt), std::sin(tilt)}, forward = up * Vec3{0, -std::sin(tilt), std::cos(tilt)};
  const Vec3 turned = turn_of(Mat3{{forward, cross(along, forward), along}}),
             at = Vec3{kHere, 0, -0.006 * up} - 0.5 * length * along;
  const Vec3 down{0, 0, -way};
  scene.tools[0].tip = length;
  scene.tools[0].rotation = turned;
  scene.tools[0].position = at;
  if (moves == Moves::kStroke) scene.tools.clear();
  Session session = make(scene);
  clamp(session);
  SceneCommand command;
  if (moves == Moves::kStrip) {
    move_clamps(session, down, way / speed);
  } else if (moves == Moves::kBlade) {
    command.what = SceneToolMotion{"tool", {{way / speed, at + down, turned}}};
    apply(session, command);
  } else {
    SceneBlade blade;
    blade.poses = {{0, at, at + length * along}, {way / speed, at + down, at + length * along + down}};
    command.what = blade;
    apply(session, command);
  }
  EXPECT_TRUE(session.step(steps(session, way / speed + 0.1)).ok());
  expect_valid(session);
  return session;
}

void expect_parted(Moves moves, double dt, double speed, double tilt) {
  Session session = landed(strip_scene(dt, 0), moves, speed, tilt, 0.04, 0.012);
  EXPECT_NEAR(cut_length(session), 0.024, 0.001) << static_cast<int>(moves) << " " << dt << " " << speed << " " << tilt;
  EXPECT_EQ(session.counts().pieces, 2) << static_cast<int>(moves) << " " << dt << " " << speed << " " << tilt;
}

TEST(RestingEdge, AnEdgeThatLandsFlatCuts) {
  for (const Moves moves : {Moves::kBlade, Moves::kStrip, Moves::kStroke})
    for (const double dt : kSteps)
      for (const double speed : {0.05, 0.2})
        for (const double tilt : {-0.02, -0.004, 0.0, 0.003, 0.012}) expect_parted(moves, dt, speed, tilt);
}

// The rim came within 0.01 mm of the edge; as the strip bent, it went by, and the next step took it for passed.
TEST(RestingEdge, ARimThatStoodJustBeforeTheEdgeIsCut) { expect_parted(Moves::kStrip, 0.001, 0.2, 0.003); }
// The edge touched a fold of the strip at one vertex; both fronts went off to the same side.
TEST(RestingEdge, FromAFoldItCutsToBothSides) { expect_parted(Moves::kStrip, 0.001, 0.226487, -0.0163636); }

/// A strip with weight sags by more than it is thick, swings, and springs off where it is cut: in a step of 16.7 ms by five times its thickness.
TEST(RestingEdge, WhatSagsAndSwingsIsCutOnce) {
  for (const Moves moves : {Moves::kBlade, Moves::kStrip})
    for (const double young : {5e4, 1e5})
      for (const double speed : {0.05, 0.2})
        for (const double tilt : {-0.02, 0.0, 0.012}) {
          Scene scene = strip_scene(0.0167, 0);
          scene.simulation.gravity = {0, 0, -9.81};
          scene.material.young = young;
          Session session = landed(scene, moves, speed, tilt, 0.04, moves == Moves::kStrip ? 0.012 : 0.018);
          EXPECT_NEAR(cut_length(session), 0.024, 0.0015)
              << static_cast<int>(moves) << " " << young << " " << speed << " " << tilt;
          EXPECT_EQ(session.counts().pieces, 2)
              << static_cast<int>(moves) << " " << young << " " << speed << " " << tilt;
        }
}

TEST(RestingEdge, TheSameBitsForAnyNumberOfThreadsAndAfterARestore) {
  // At 8 and 12 N/m a restored session went other ways: a radius that rounding had raised in a provisional cut was remembered.
  for (const double resistance : {8.0, 12.0, 20.0}) {
    std::uint64_t once = 0;
    for (const int threads : {1, 3}) {
      Scene scene = strip_scene(0.005, resistance);
      scene.simulation.threads = threads;
      Session session = make(scene);
      clamp(session);
      move_clamps(session, {0, -0.02, 0}, 0.2);
      ASSERT_TRUE(session.step(25).ok());
      ASSERT_TRUE(session.in_stroke());
      const auto snapshot = session.snapshot();
      ASSERT_TRUE(session.step(25).ok());
      const std::uint64_t hash = session.hash();
      session.restore(snapshot);
      ASSERT_TRUE(session.step(25).ok());
      EXPECT_EQ(session.hash(), hash);
      if (once == 0) once = hash;
      EXPECT_EQ(hash, once);
    }
  }
}

}  // namespace
}  // namespace kerf::resting_edge_test
