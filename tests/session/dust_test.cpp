// Dust: what strokes one beside the other leave, measured on the drawn surface.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/cutting/pieces.h"
#include "kerf/record/recording.h"
#include "kerf/scene/scene_limits.h"
#include "kerf/session/session.h"
#include "session/make_session.h"
#include "session/session_measures.h"
#include "support/piece_volumes.h"

namespace kerf::dust_test {
namespace {

using testing::HasSubstr;
using testing_support::piece_volumes;

constexpr int kStrokes = 20;
constexpr double kJitter = 0.05;  // mean edges
constexpr Vec3 kFacingY{0, 0, std::numbers::pi / 2};

Scene steak(double dust) {
  Scene scene;
  scene.name = "steak";
  scene.body.model = "steak";
  scene.simulation.time_step = 0.002;
  scene.simulation.gravity = {};
  scene.cut.dust = dust;
  return scene;
}
Session steak_session(double dust) { return test::make(steak(dust)); }

double sum_of(const std::vector<double>& volumes) {
  double sum = 0;
  for (const double v : volumes) sum += v;
  return sum;
}
std::vector<double> volumes_of(const Session& session) { return piece_volumes(session.body().complex); }

/// One stroke across the middle of the body, somewhat beside the last.
struct Saw {
  explicit Saw(Session& session) : box(test::box_of(session)), edge(session.body().complex.mean_root_edge) {}
  struct Pose {
    Vec3 base, tip;
  };
  std::vector<Pose> next() {
    const double high = box.max.z + box.size().z, low = box.min.z - box.size().z, over = 0.1 * box.size().x;
    const double from = random.uniform(-kJitter, kJitter) * edge, to = random.uniform(-kJitter, kJitter) * edge;
    const double y = 0.5 * (box.min.y + box.max.y);
    std::vector<Pose> poses;
    for (int i = 0; i <= 8; ++i) {
      const double s = i / 8.0, x = box.min.x - over + s * (box.size().x + 2 * over);
      poses.push_back({{x, y + from + s * (to - from), high}, {x, y + from + s * (to - from), low}});
    }
    return poses;
  }
  Random random{7};
  Box3 box;
  double edge;
};

void cut(Session& session, const std::vector<Saw::Pose>& poses) {
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  for (const Saw::Pose& p : poses) ASSERT_TRUE(session.move_blade(p.base, p.tip).ok());
  ASSERT_TRUE(session.end_stroke().ok());
}

void expect_valid(const Session& session) {
  const Status valid = session.validate();
  ASSERT_TRUE(valid.ok()) << valid.error().message;
}

/// The session after the first stroke of a saw that leaves pieces below `share`, and how many.
int cut_until_dust(Session& session, Saw& saw, double share) {
  const double whole = sum_of(volumes_of(session));
  for (int i = 0; i < kStrokes; ++i) {
    cut(session, saw.next());
    const std::vector<double> v = volumes_of(session);
    const auto below = std::count_if(v.begin(), v.end(), [&](double x) { return x < share * whole; });
    if (below > 0) return static_cast<int>(below);
  }
  return 0;
}

TEST(Dust, StrokesBesideEachOtherLeaveNone) {
  const double share = SceneCut{}.dust;
  Session session = steak_session(share);
  const double whole = sum_of(volumes_of(session));
  Saw saw(session);
  int swept = 0, cuts = 0;
  std::set<std::string> told;  // each text once
  for (int i = 0; i < kStrokes; ++i) {
    const double before = sum_of(volumes_of(session));
    cut(session, saw.next());
    const std::vector<double> after = volumes_of(session);
    const StrokeRecord& record = session.strokes().back();
    EXPECT_GE(after.front(), share * whole) << "stroke " << i;
    EXPECT_NEAR(sum_of(after) + record.removed.volume, before, 1e-9 * whole) << "stroke " << i;
    EXPECT_NEAR(record.removed.share, record.removed.volume / whole, 1e-9) << "stroke " << i;
    EXPECT_EQ(static_cast<int>(after.size()), record.after.pieces);
    swept += record.removed.pieces;
    if (record.removed.pieces > 0)
      told.insert(fmt::format("{} {:.3g} {:.2g}", record.removed.pieces, record.removed.volume, record.removed.share));
    cuts += record.triangles > 0;
  }
  expect_valid(session);
  EXPECT_GE(swept, 4);
  EXPECT_EQ(session.undo_depth(), cuts) << "no steps of their own";
  const auto notes = std::count_if(session.notes().begin(), session.notes().end(), [](const std::string& n) {
    return n.find("swept up as dust") != std::string::npos;
  });
  EXPECT_EQ(notes, static_cast<std::ptrdiff_t>(told.size()));
}

TEST(Dust, IsLeftWhereTheSceneSaysSo) {
  Session session = steak_session(0);
  const double whole = sum_of(volumes_of(session));
  Saw saw(session);
  EXPECT_GT(cut_until_dust(session, saw, SceneCut{}.dust), 0);
  EXPECT_NEAR(sum_of(volumes_of(session)), whole, 1e-9 * whole);
  for (const StrokeRecord& record : session.strokes()) EXPECT_EQ(record.removed.pieces, 0);
}

// One undo takes the stroke and its dust back, in a body that moves.
TEST(Dust, GoesAndComesBackWithItsStroke) {
  Scene scene = steak(SceneCut{}.dust);
  scene.simulation.gravity = {0, 0, -1};
  Session session = test::make(scene);
  Saw saw(session);
  ASSERT_TRUE(session.step(3).ok());
  std::vector<std::uint64_t> hashes{session.hash()};
  int swept = 0;
  for (int i = 0; i < 20; ++i) {
    const int depth = session.undo_depth();
    cut(session, saw.next());
    if (session.undo_depth() == depth) continue;  // all of it was along a lip
    hashes.push_back(session.hash());
    swept += session.strokes().back().removed.pieces;
  }
  ASSERT_GT(swept, 2);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = hashes.size() - 1; i-- > 0;) {
      ASSERT_TRUE(session.undo().ok());
      ASSERT_EQ(session.hash(), hashes[i]) << i;
    }
    EXPECT_EQ(session.counts().pieces, 1);
    expect_valid(session);
    for (std::size_t i = 1; i < hashes.size(); ++i) {
      ASSERT_TRUE(session.redo().ok());
      ASSERT_EQ(session.hash(), hashes[i]) << i;
    }
    expect_valid(session);
  }
}

TEST(Dust, WhatIsHeldStays) {
  const double share = SceneCut{}.dust;
  for (const bool fixed : {false, true}) {
    // Where dust will lie is known from a session that leaves it.
    Session first = steak_session(0);
    Saw saw(first);
    const int left = cut_until_dust(first, saw, share);
    ASSERT_GT(left, 0);
    const std::size_t strokes = first.strokes().size();
    const CollisionMesh& mesh = first.body().complex.collision;
    const Pieces pieces = collision_pieces(mesh);
    std::vector<double> area(static_cast<std::size_t>(pieces.count), 0);
    for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
      const CollisionHalfEdge h = CollisionMesh::corner(f, 0);
      const Vec3 a = mesh.rest[mesh.from(h)];
      area[static_cast<std::size_t>(pieces.of_face[f.index()])] +=
          0.5 * norm(cross(mesh.rest[mesh.to(h)] - a, mesh.rest[mesh.apex(h)] - a));
    }
    const auto smallest = static_cast<std::int32_t>(std::min_element(area.begin(), area.end()) - area.begin());
    std::vector<CollisionVertex> of_dust;
    for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count()))
      if (pieces.of_face[f.index()] == smallest) of_dust.push_back(mesh.origin[CollisionMesh::corner(f, 0)]);

    Session session = steak_session(share);
    Saw again(session);
    for (std::size_t i = 0; i + 1 < strokes; ++i) cut(session, again.next());
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    for (const Saw::Pose& p : again.next()) ASSERT_TRUE(session.move_blade(p.base, p.tip).ok());
    if (fixed) {
      SceneFixCommand fix;
      fix.region.shape = SceneRegion::Shape::kSphere;
      fix.region.center = mesh.rest[of_dust.front()];
      fix.region.radius = 1e-6;
      ASSERT_TRUE(session.apply({0, fix}).ok());
    } else {
      ASSERT_TRUE(session.grasp("forceps", {of_dust.front()}).ok());
    }
    ASSERT_TRUE(session.end_stroke().ok());
    EXPECT_EQ(session.strokes().back().removed.pieces, left - 1);
    EXPECT_LT(volumes_of(session).front(), share * sum_of(volumes_of(first)));
    EXPECT_EQ(session.grasps().size(), fixed ? 0u : 1u);
  }
}

// A triangle that is named while the stroke goes on is the same piece after its dust has gone.
TEST(Dust, LeavesToRemovalsTheirPiece) {
  const double share = SceneCut{}.dust;
  Session first = steak_session(share);
  Saw saw(first);
  std::size_t strokes = 0;
  while (first.strokes().empty() || first.strokes().back().removed.pieces == 0) {
    ASSERT_LT(++strokes, 20u);
    cut(first, saw.next());
  }
  Session session = steak_session(share);
  Saw again(session);
  for (std::size_t i = 0; i + 1 < strokes; ++i) cut(session, again.next());
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  for (const Saw::Pose& p : again.next()) ASSERT_TRUE(session.move_blade(p.base, p.tip).ok());
  const CollisionMesh& mesh = session.body().complex.collision;
  const CollisionTriangle last(mesh.face_count() - 1);
  const std::int32_t pieces = session.counts().pieces;
  const auto gone = session.remove_piece(last);
  ASSERT_TRUE(gone.ok()) << gone.error().message;
  EXPECT_EQ(session.counts().pieces, pieces - first.strokes().back().removed.pieces - gone->pieces);
  expect_valid(session);
}

TEST(Dust, IsTheSameWhenReplayed) {
  Recording r;
  r.source.name = "steak";
  r.source.text = "[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.002\n";
  const auto record = [&](SessionChange::Kind kind, std::vector<double> values) {
    SessionChange c;
    c.kind = kind;
    c.values = std::move(values);
    r.changes.push_back(std::move(c));
  };
  auto session = Session::create(*scene_of(r.source, r.overrides));
  ASSERT_TRUE(session.ok());
  Saw saw(*session);
  int swept = 0;
  for (int i = 0; i < 6; ++i) {
    record(SessionChange::Kind::kBeginStroke, {1, 1});
    for (const Saw::Pose& p : saw.next())
      record(SessionChange::Kind::kBlade, {p.base.x, p.base.y, p.base.z, p.tip.x, p.tip.y, p.tip.z});
    record(SessionChange::Kind::kEndStroke, {});
  }
  for (const SessionChange& c : r.changes) ASSERT_TRUE(apply(*session, c).ok());
  for (const StrokeRecord& s : session->strokes()) swept += s.removed.pieces;
  ASSERT_GT(swept, 0);
  r.end_hash = session->hash();
  r.overrides.dust = session->scene().cut.dust;
  const auto read = parse_recording(recording_text(r), "new");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(replay(*read)->first_difference, -1);

  // One that does not know of dust has left it.
  auto left = Session::create(*scene_of(r.source, {true, 0, 0.0}));
  for (const SessionChange& c : r.changes) ASSERT_TRUE(apply(*left, c).ok());
  EXPECT_NE(left->hash(), r.end_hash);
  r.end_hash = left->hash();
  std::string old = recording_text(r);
  const std::size_t at = old.find("\"dust\":");
  ASSERT_NE(at, std::string::npos);
  old.erase(at, old.find(',', at) + 1 - at);
  const auto read_old = parse_recording(old, "old");
  ASSERT_TRUE(read_old.ok()) << read_old.error().message;
  EXPECT_EQ(replay(*read_old)->first_difference, -1);
}

TEST(Dust, AStripOfAHundredthStays) {
  Session session = steak_session(SceneCut{}.dust);
  const double whole = sum_of(volumes_of(session));
  const Box3 box = test::box_of(session);
  const double high = box.max.z + box.size().z, low = box.min.z - box.size().z;
  const double x = box.min.x + 0.015 * box.size().x;
  cut(session, {{{x, box.min.y - 0.01, high}, {x, box.min.y - 0.01, low}},
                {{x, box.max.y + 0.01, high}, {x, box.max.y + 0.01, low}}});
  const std::vector<double> volumes = volumes_of(session);
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_LT(volumes.front(), 0.02 * whole);
  EXPECT_EQ(session.strokes().back().removed.pieces, 0);
}

TEST(Dust, AnOpenSheetHasNone) {
  Scene scene = steak(kMostDust);
  scene.body.model = "sheet";
  Session session = test::make(scene);
  Saw saw(session);
  for (int i = 0; i < 6; ++i) cut(session, saw.next());
  EXPECT_GT(session.counts().pieces, 2);
  for (const StrokeRecord& record : session.strokes()) EXPECT_EQ(record.removed.pieces, 0);
}

// Bites of a punch close beside each other leave slivers, and a bite may be so small itself.
TEST(Dust, PunchesLeaveNone) {
  const double share = 0.002;
  Session session = steak_session(share);
  const double whole = sum_of(volumes_of(session));
  const Box3 box = test::box_of(session);
  Random random(3);
  int swept = 0;
  for (int i = 0; i < 8; ++i) {
    Punch punch;
    punch.centre = box.center() + Vec3{random.uniform(-0.002, 0.002), random.uniform(-0.002, 0.002), 0};
    punch.outline = circle_outline((i == 7 ? 0.02 : 0.1) * box.size().y, 1e-4);
    const double before = sum_of(volumes_of(session));
    const auto cut = session.punch(punch, SceneFrame::kRest);
    ASSERT_TRUE(cut.ok()) << cut.error().message;
    const CollisionMesh& mesh = session.body().complex.collision;
    for (const CollisionTriangle f : cut->loose) ASSERT_TRUE(mesh.root.contains(f));
    for (const CollisionHalfEdge h : cut->lips) ASSERT_TRUE(mesh.is_border(h));
    const std::vector<double> after = volumes_of(session);
    EXPECT_GE(after.front(), share * whole) << i;
    EXPECT_NEAR(sum_of(after) + session.strokes().back().removed.volume, before, 1e-9 * whole) << i;
    swept += session.strokes().back().removed.pieces;
  }
  EXPECT_GT(swept, 3);
  expect_valid(session);
}

/// A strip along x, 0.2 m long, held at one end, with a scalpel that faces +y at `x`.
Scene strip_with_scalpel(double x) {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 1000;
  scene.simulation.time_step = 0.002;
  scene.simulation.gravity = {};
  scene.cut.dust = kMostDust;
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {-0.095, 0, 0};
  fix.region.normal = {-1, 0, 0};
  scene.fixes.push_back(fix);
  SceneRigidTool tool;
  tool.id = "knife";
  tool.kind = SceneToolKind::kScalpel;
  tool.position = {x, -0.03, -0.012};
  tool.rotation = kFacingY;
  scene.tools = {tool};
  return scene;
}
void lead(Session& session, double x, double y) {
  SceneCommand command;
  command.what = SceneToolMotion{"knife", {{0.4 * (y + 0.03) / 0.06, {x, y, -0.012}, kFacingY}}};
  const Status done = session.apply(command);
  ASSERT_TRUE(done.ok()) << done.error().message;
}

// The stroke of a tool ends within a step, which goes on without what is swept up.
TEST(Dust, GoesWhenAToolHasCutItOff) {
  std::vector<std::uint64_t> hashes;
  for (int round = 0; round < 2; ++round) {
    Session session = test::make(strip_with_scalpel(0.085));
    const double whole = sum_of(volumes_of(session));
    lead(session, 0.085, 0.03);
    ASSERT_TRUE(session.step(250).ok());
    expect_valid(session);
    ASSERT_FALSE(session.in_stroke());
    ASSERT_EQ(session.strokes().size(), 1u);
    const StrokeRecord& record = session.strokes().front();
    EXPECT_EQ(record.removed.pieces, 1);
    EXPECT_NEAR(record.removed.share, 0.075, 0.01);
    EXPECT_NEAR(sum_of(volumes_of(session)) + record.removed.volume, whole, 1e-9 * whole);
    EXPECT_EQ(session.counts().pieces, 1);
    hashes.push_back(session.hash());
    ASSERT_EQ(session.undo_depth(), 1);
    ASSERT_TRUE(session.undo().ok());
    EXPECT_NEAR(sum_of(volumes_of(session)), whole, 1e-9 * whole);
    expect_valid(session);
    ASSERT_TRUE(session.redo().ok());
    expect_valid(session);
    ASSERT_TRUE(session.step(5).ok());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(Dust, StaysWhereABladeStands) {
  for (const bool beside : {false, true}) {
    Session session = test::make(strip_with_scalpel(0.05));
    lead(session, 0.05, 0);
    ASSERT_TRUE(session.step(150).ok());
    ASSERT_TRUE(session.in_stroke());
    Punch punch;
    punch.centre = {beside ? -0.03 : 0.05, 0, 0};
    punch.outline = circle_outline(0.01, 1e-4);
    const auto cut = session.punch(punch, SceneFrame::kRest);
    ASSERT_TRUE(cut.ok()) << cut.error().message;
    ASSERT_TRUE(cut->cut);
    EXPECT_EQ(session.strokes().back().removed.pieces > 0, beside);
    EXPECT_EQ(cut->loose.empty(), beside);
    expect_valid(session);
    ASSERT_TRUE(session.step(5).ok());
  }
}

TEST(Dust, SharesOutOfRangeAreRefused) {
  for (const double bad : {-1e-9, 2 * kMostDust, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    const auto session = Session::create(steak(bad));
    ASSERT_FALSE(session.ok()) << bad;
    EXPECT_THAT(session.error().message, HasSubstr("from 0, which leaves every piece, to 0.1"));
  }
}

}  // namespace
}  // namespace kerf::dust_test
