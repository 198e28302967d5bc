// Loose pieces taken away: what stays is what it was, undo brings everything back to the bit.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "kerf/base/random.h"
#include "kerf/cutting/pieces.h"
#include "kerf/session/session.h"
#include "kerf/session/surface_fade.h"
#include "session/session_measures.h"

namespace kerf::session_remove_test {
namespace {

using test::box_of;
using test::enclosed_volume;
using test::mass;
using test::model_session;

Session make_session(const char* model, int layers = 3) { return model_session(model, -1, layers); }

Punch round_punch(Session& session, Random& random, double share) {
  const Box3 box = box_of(session);
  const auto& p = session.collision_positions();
  Punch punch;
  const double radius = share * std::min(box.size().x, box.size().y);
  punch.centre = p[static_cast<std::size_t>(random.index(static_cast<int>(p.size())))];
  punch.outline = circle_outline(radius, 0.05 * radius);
  return punch;
}

void expect_valid(const Session& session, const char* where) {
  const Status valid = session.validate();
  ASSERT_TRUE(valid.ok()) << where << ": " << valid.error().message;
}

TEST(Removal, MassAndVolumeFallByThePiecesOwn) {
  for (const char* model : {"meniscus", "steak", "tube"}) {
    Session session = make_session(model);
    Random random(11);
    std::vector<std::uint64_t> hashes;
    int removed = 0;
    for (int i = 0; i < 8; ++i) {
      const auto cut = session.punch(round_punch(session, random, 0.13), SceneFrame::kWorld, 1e-4);
      ASSERT_TRUE(cut.ok()) << model << cut.error().message;
      ASSERT_TRUE(session.step(2).ok());
      if (!cut->cut) continue;
      const double v = enclosed_volume(session), m = mass(session);
      const BodyCounts before = session.counts();
      hashes.push_back(session.hash());
      const auto gone = session.remove_piece(cut->loose[0]);
      ASSERT_TRUE(gone.ok()) << model << gone.error().message;
      ++removed;
      expect_valid(session, model);
      const BodyCounts after = session.counts();
      EXPECT_EQ(after.pieces, before.pieces - 1);
      EXPECT_LT(after.visual_triangles, before.visual_triangles);
      EXPECT_LT(after.collision_triangles, before.collision_triangles);
      EXPECT_GT(gone->mass, 0);
      EXPECT_GT(gone->volume, 0);
      EXPECT_NEAR(enclosed_volume(session), v - gone->volume, 1e-12 * v);
      EXPECT_NEAR(mass(session), m - gone->mass, 1e-12 * m);
      // To the bit there and back, and on from there.
      const std::uint64_t hash = session.hash();
      ASSERT_TRUE(session.undo().ok());
      EXPECT_EQ(session.hash(), hashes.back()) << model;
      expect_valid(session, "undo");
      ASSERT_TRUE(session.redo().ok());
      EXPECT_EQ(session.hash(), hash) << model;
      expect_valid(session, "redo");
      ASSERT_TRUE(session.step(2).ok());
    }
    EXPECT_GT(removed, 4);
  }
}

TEST(Removal, WhatStaysMovesOnAsBefore) {
  // A piece that touches nothing else takes nothing with it: positions of what stays are those of the session in which
  // the piece was left alone, to the bit at first and as long as the solver's sums agree.
  Session session = make_session("meniscus");
  Random random(5);
  const auto cut = session.punch(round_punch(session, random, 0.15), SceneFrame::kWorld);
  ASSERT_TRUE(cut.ok() && cut->cut);
  ASSERT_TRUE(session.step(5).ok());
  std::vector<Vec3> before;
  const Pieces pieces = collision_pieces(session.body().complex);
  const auto gone = pieces.of_face[cut->loose[0].index()];
  const CollisionMesh& mesh = session.body().complex.collision;
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
    if (pieces.of_face[CollisionMesh::face(mesh.outgoing[CollisionVertex(v)]).index()] != gone)
      before.push_back(session.collision_positions()[v]);
  ASSERT_TRUE(session.remove_piece(cut->loose[0]).ok());
  const std::vector<Vec3> after = session.collision_positions();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) EXPECT_EQ(norm(after[i] - before[i]), 0);
  ASSERT_TRUE(session.step(5).ok());
}

/// Where the surface's points are, by their place at rest (twins share one).
std::map<std::array<double, 3>, std::vector<Vec3>> places(const Session& session) {
  std::map<std::array<double, 3>, std::vector<Vec3>> out;
  const auto& rest = session.body().complex.visual.rest.raw();
  const std::vector<Vec3> now = session.visual_positions();
  for (std::size_t i = 0; i < rest.size(); ++i) out[{rest[i].x, rest[i].y, rest[i].z}].push_back(now[i]);
  return out;
}

// In a stretched body the punch leaves vertices beside their hexahedra; they fade on from there without the piece.
TEST(Removal, AtOnceAfterThePunchMovesNoSurface) {
  Session session = make_session("steak");
  const Box3 box = box_of(session);
  const double size = box.diagonal();
  SceneRegion held;
  held.shape = SceneRegion::Shape::kSphere;
  held.center = box.min;
  held.radius = 0.4 * size;
  ASSERT_TRUE(session.apply({0, SceneFixCommand{held}}).ok());
  SceneGrasp grasp;
  grasp.id = "g";
  grasp.point = box.max;
  grasp.radius = 0.1 * size;
  SceneMove move;
  move.id = "g";
  move.by = Vec3{0.2 * size, 0.2 * size, 0.1 * size};
  move.over = 0.05;
  ASSERT_TRUE(session.apply({0, grasp}).ok());
  ASSERT_TRUE(session.apply({0, move}).ok());
  ASSERT_TRUE(session.step(40).ok());
  Random random(3);
  int removed = 0;
  std::size_t fading = 0;
  for (int i = 0; i < 12; ++i) {
    const auto cut = session.punch(round_punch(session, random, 0.08), SceneFrame::kWorld, 1e-4);
    if (!cut.ok() || !cut->cut) continue;
    const auto before = places(session);
    const std::uint64_t hash = session.hash();
    if (!session.remove_piece(cut->loose[0]).ok()) continue;
    ++removed;
    fading += session.fading_visual().size();
    expect_valid(session, "removal");
    for (const auto& [rest, after] : places(session)) {
      const auto was = before.find(rest);
      ASSERT_NE(was, before.end());
      for (const Vec3 p : after) {
        double nearest = HUGE_VAL;
        for (const Vec3 q : was->second) nearest = std::min(nearest, norm(p - q));
        ASSERT_LE(nearest, 1e-12 * size) << "removal " << removed;
      }
    }
    ASSERT_TRUE(session.undo().ok());
    EXPECT_EQ(session.hash(), hash);
    ASSERT_TRUE(session.redo().ok());
    ASSERT_TRUE(session.step(2).ok());
  }
  EXPECT_GT(removed, 5);
  EXPECT_GT(fading, 20u);
}

TEST(Removal, BySuctionAndByGrasp) {
  Session session = make_session("meniscus");
  Random random(8);
  int loose = 0;
  std::vector<Punch> punches;
  for (int i = 0; i < 12 && loose < 4; ++i) {
    punches.push_back(round_punch(session, random, 0.1));
    const auto cut = session.punch(punches.back(), SceneFrame::kWorld);
    ASSERT_TRUE(cut.ok());
    loose += cut->cut;
  }
  const int pieces = session.counts().pieces;
  ASSERT_GT(pieces, 3);
  SceneRegion far;
  far.shape = SceneRegion::Shape::kSphere;
  far.center = {10, 0, 0};
  far.radius = 0.001;
  const auto nothing = session.remove_pieces(far, SceneFrame::kWorld);
  ASSERT_TRUE(nothing.ok());
  EXPECT_EQ(nothing->pieces, 0);

  // By grasp, and the grasp goes with it.
  ASSERT_TRUE(session.step(1).ok());
  const auto cut = session.punch(round_punch(session, random, 0.12), SceneFrame::kWorld);
  ASSERT_TRUE(cut.ok() && cut->cut);
  const CollisionVertex held = session.body().complex.collision.origin[CollisionMesh::corner(cut->loose[0], 0)];
  ASSERT_TRUE(session.grasp("forceps", {held}).ok());
  const std::uint64_t hash = session.hash();
  EXPECT_FALSE(session.remove_grasped("nobody").ok());
  ASSERT_TRUE(session.remove_grasped("forceps").ok());
  EXPECT_TRUE(session.grasps().empty());
  expect_valid(session, "grasp");
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.hash(), hash);
  ASSERT_EQ(session.grasps().size(), 1u);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_TRUE(session.grasps().empty());

  // All that is loose, at once; what stays is the heaviest.
  SceneRegion all = far;
  all.center = {};
  all.radius = 10;
  const auto swept = session.remove_pieces(all, SceneFrame::kWorld);
  ASSERT_TRUE(swept.ok());
  EXPECT_GE(swept->pieces, 3);
  EXPECT_EQ(session.counts().pieces, 1);
  expect_valid(session, "suction");
  EXPECT_FALSE(session.remove_piece(CollisionTriangle(0)).ok()) << "the last piece stays";
  EXPECT_FALSE(session.remove_piece(CollisionTriangle(1 << 20)).ok());
}

TEST(Removal, WorksOnAndIsUndoneAmongStrokes) {
  for (const char* model : {"meniscus", "sheet", "steak"}) {
    Session session = make_session(model);
    Random random(21);
    std::vector<std::uint64_t> hashes{session.hash()};
    SceneRegion all;
    all.shape = SceneRegion::Shape::kSphere;
    all.radius = 100;
    for (int i = 0; i < 20; ++i) {
      const int depth = session.undo_depth();
      if (i % 3 == 2) {
        ASSERT_TRUE(session.remove_pieces(all, SceneFrame::kRest).ok());
      } else {
        const auto cut = session.punch(round_punch(session, random, 0.11), SceneFrame::kRest, 2e-4);
        ASSERT_TRUE(cut.ok()) << model << ": " << cut.error().message;
      }
      expect_valid(session, model);
      if (session.undo_depth() > depth) hashes.push_back(session.hash());
    }
    for (std::size_t i = hashes.size(); i-- > 1;) {
      ASSERT_EQ(session.hash(), hashes[i]) << model << " " << i;
      ASSERT_TRUE(session.undo().ok());
    }
    ASSERT_EQ(session.hash(), hashes[0]);
    for (std::size_t i = 1; i < hashes.size(); ++i) {
      ASSERT_TRUE(session.redo().ok());
      ASSERT_EQ(session.hash(), hashes[i]) << model << " " << i;
      expect_valid(session, model);
    }
  }
}

// What a command is for may have gone by then: that is told of, and the run goes on.
TEST(Removal, CommandsForAGraspWhosePieceWasTakenAreNoted) {
  Session session = make_session("steak");
  SceneGrasp grasp;
  grasp.id = "g";
  grasp.point = {0.05, 0, 0};
  ScenePunch punch;
  punch.frame = SceneFrame::kRest;
  punch.point = grasp.point;
  punch.radius = 0.012;
  punch.take = true;
  SceneMove move;
  move.id = "g";
  move.by = Vec3{0, 0, 0.001};
  SceneRemove remove;
  remove.grasp = "g";
  ASSERT_TRUE(session.apply({0, grasp}).ok());
  ASSERT_TRUE(session.apply({0, move}).ok());
  ASSERT_TRUE(session.apply({0, punch}).ok());
  ASSERT_TRUE(session.grasps().empty());
  for (const SceneCommand& command :
       {SceneCommand{0, move}, SceneCommand{0, remove}, SceneCommand{0, SceneRelease{"g"}}}) {
    const std::size_t notes = session.notes().size();
    ASSERT_TRUE(session.apply(command).ok());
    ASSERT_EQ(session.notes().size(), notes + 1);
    EXPECT_NE(session.notes().back().find("grasp 'g' held had been taken away"), std::string::npos)
        << session.notes().back();
  }
  move.id = "nobody";
  EXPECT_FALSE(session.apply({0, move}).ok()) << "there never was one";
  // It comes back with its piece, and its id may be used again.
  move.id = "g";
  const std::size_t notes = session.notes().size();
  ASSERT_TRUE(session.undo().ok());
  ASSERT_TRUE(session.apply({0, move}).ok());
  ASSERT_TRUE(session.redo().ok());
  grasp.point = {-0.05, 0, 0};
  ASSERT_TRUE(session.apply({0, grasp}).ok());
  ASSERT_TRUE(session.apply({0, move}).ok());
  EXPECT_EQ(session.notes().size(), notes);
}

}  // namespace
}  // namespace kerf::session_remove_test
