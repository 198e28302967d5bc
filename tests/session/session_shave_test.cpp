// Shaving in a session: smoother and lighter pass by pass, everything follows, one undo step; commands and recordings.
#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/random.h"
#include "kerf/record/recording.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/session.h"
#include "session/session_measures.h"

namespace kerf::session_shave_test {
namespace {

using test::enclosed_volume;
using test::mass;
using test::model_session;

Session make_session(const char* model) { return model_session(model, -1, 4); }

/// A rough bite at the thin rim of the meniscus, taken away; the middles of its lips.
std::vector<Vec3> bite(Session& session, double roughness) {
  Punch p;
  p.centre = {0, 0.013, 0};
  p.outline = circle_outline(0.003, 5e-5);
  const auto cut = session.punch(p, SceneFrame::kRest, roughness);
  EXPECT_TRUE(cut.ok() && cut->cut);
  EXPECT_TRUE(session.remove_piece(cut->loose[0]).ok());
  std::vector<Vec3> middles;
  const CollisionMesh& m = session.body().complex.collision;
  for (std::size_t h = 0; h < m.half_edge_count(); ++h)
    if (m.wall[CollisionHalfEdge(h)].valid())
      middles.push_back(lerp(m.rest[m.from(CollisionHalfEdge(h))], m.rest[m.to(CollisionHalfEdge(h))], 0.5));
  return middles;
}

TEST(SessionShave, SmootherLighterAndUndoneToTheBit) {
  Session session = make_session("meniscus");
  const std::vector<Vec3> lips = bite(session, 2e-4);
  ASSERT_GT(lips.size(), 4u);
  ASSERT_TRUE(session.step(3).ok());
  const std::uint64_t hash = session.hash();
  const int depth = session.undo_depth();
  const double m0 = mass(session), v0 = enclosed_volume(session);
  double roughness = session.roughness(), removed = 0, m = m0;
  ASSERT_GT(roughness, 2e-5);
  for (int pass = 0; pass < 60; ++pass) {
    const Vec3 at = lips[static_cast<std::size_t>(pass) % lips.size()];
    const auto done = session.shave({at, at, 0.001}, SceneFrame::kRest, 0.6, 3e-5);
    ASSERT_TRUE(done.ok()) << done.error().message;
    EXPECT_GT(done->edges, 0);
    removed += done->removed;
    const Status valid = session.validate();
    ASSERT_TRUE(valid.ok()) << "pass " << pass << ": " << valid.error().message;
    EXPECT_LE(session.roughness(), roughness * (1 + 1e-12));
    EXPECT_LE(mass(session), m * (1 + 1e-12));
    roughness = session.roughness();
    m = mass(session);
  }
  EXPECT_NEAR(enclosed_volume(session), v0 - removed, 1e-12 * v0);
  EXPECT_GT(removed, 0);
  EXPECT_LT(m, m0);
  ASSERT_TRUE(session.end_stroke().ok());
  EXPECT_EQ(session.undo_depth(), depth + 1);
  const std::uint64_t shaved = session.hash();
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.hash(), hash);
  EXPECT_TRUE(session.validate().ok());
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.hash(), shaved);
  EXPECT_TRUE(session.validate().ok());
  ASSERT_TRUE(session.step(5).ok());
  EXPECT_TRUE(session.validate().ok());
  // A cut and a punch through what was shaved.
  Punch p;
  p.centre = {0.002, 0.011, 0};
  p.outline = circle_outline(0.002, 5e-5);
  const auto cut = session.punch(p, SceneFrame::kWorld, 1e-4);
  ASSERT_TRUE(cut.ok()) << cut.error().message;
  EXPECT_TRUE(session.validate().ok());
}

TEST(SessionShave, OfNothingLeavesNothing) {
  Session session = make_session("meniscus");
  const std::uint64_t hash = session.hash();
  const auto done = session.shave({{1, 1, 1}, {1, 1, 2}, 0.001}, SceneFrame::kWorld, 0.5, 1e-4);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->edges, 0);
  ASSERT_TRUE(session.end_stroke().ok());
  EXPECT_EQ(session.hash(), hash);
  EXPECT_EQ(session.undo_depth(), 0);
  EXPECT_FALSE(session.shave({{}, {}, 0}, SceneFrame::kWorld, 0.5, 0).ok());
  EXPECT_FALSE(session.shave({{}, {}, 0.1}, SceneFrame::kWorld, 2, 0).ok());
  EXPECT_FALSE(session.shave({{}, {}, 0.1}, SceneFrame::kWorld, 0.5, -1).ok());
  EXPECT_FALSE(session.shave({{std::nan(""), 0, 0}, {}, 0.1}, SceneFrame::kWorld, 0.5, 0).ok());
}

TEST(SessionShave, ACancelledShaveLeavesNoTrace) {
  Session session = make_session("meniscus");
  const std::vector<Vec3> lips = bite(session, 1e-4);
  const std::uint64_t hash = session.hash();
  for (const Vec3 at : lips) ASSERT_TRUE(session.shave({at, at, 0.001}, SceneFrame::kRest, 0.6, 5e-5).ok());
  EXPECT_NE(session.hash(), hash);
  ASSERT_TRUE(session.cancel_stroke().ok());
  EXPECT_EQ(session.hash(), hash);
  const Status valid = session.validate();
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

const char* kScript = R"(
title = "Bites and a shaver"
[body]
model = "meniscus"
[cut]
layers = 4
[simulation]
time_step = 0.002
duration = 0.4
gravity = [0, 0, 0]
[[fix]]
half_space = { point = [0, 0.027, 0], normal = [0, 1, 0] }
[[command]]
at = 0.01
type = "punch"
frame = "rest"
point = [0, 0.013, 0]
radius = 0.003
roughness = 0.0002
take = true
[[command]]
at = 0.02
type = "punch"
shape = "polygon"
frame = "rest"
point = [0.008, 0.01, 0]
points = [[-0.002, -0.002], [0.002, -0.002], [0.002, 0.002], [-0.002, 0.002]]
[[command]]
at = 0.04
type = "remove"
frame = "rest"
sphere = { center = [0.008, 0.01, 0], radius = 0.001 }
[[command]]
at = 0.05
type = "punch"
shape = "d"
point = [-0.006, 0.015, 0]
across = [0, -1, 0]
radius = 0.002
reach = 0.01
[[command]]
at = 0.1
type = "shave"
frame = "rest"
radius = 0.0012
poses = [
  { time = 0.0, base = [-0.003, 0.0125, 0.001], tip = [-0.003, 0.0125, -0.001] },
  { time = 0.1, base = [0.0, 0.0100, 0.001], tip = [0.0, 0.0100, -0.001] },
  { time = 0.2, base = [0.003, 0.0125, 0.001], tip = [0.003, 0.0125, -0.001] },
]
)";

TEST(SessionShave, CommandsOfASceneDoTheSame) {
  auto scene = parse_scene(kScript, "script.toml");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  std::uint64_t hashes[2];
  for (std::uint64_t& hash : hashes) {
    auto session = Session::create(*scene);
    ASSERT_TRUE(session.ok());
    const Status ran = session->step(200);
    ASSERT_TRUE(ran.ok()) << ran.error().message;
    const Status valid = session->validate();
    EXPECT_TRUE(valid.ok()) << valid.error().message;
    hash = session->hash();
    std::vector<StrokeRecord::Kind> kinds;
    for (const StrokeRecord& s : session->strokes()) kinds.push_back(s.kind);
    using K = StrokeRecord::Kind;
    EXPECT_EQ(kinds, (std::vector<K>{K::kPunch, K::kRemoval, K::kPunch, K::kRemoval, K::kPunch, K::kShave}));
    EXPECT_EQ(session->counts().pieces, 2);  // the last bite lies where it was
    EXPECT_EQ(session->undo_depth(), 6);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(SessionShave, BadCommandsAreNamed) {
  const auto problem = [&](const std::string& from, const std::string& to) {
    std::string text = kScript;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    const auto scene = parse_scene(text, "s.toml");
    return scene.ok() ? std::string("read") : scene.error().message;
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_PRED2(has, problem("radius = 0.003\n", ""), "a round punch needs a radius");
  EXPECT_PRED2(has, problem("radius = 0.003\n", "radius = -1\n"), "radius of punch");
  EXPECT_PRED2(has, problem("[-0.002, -0.002], [0.002, -0.002], [0.002, 0.002], [-0.002, 0.002]", "[0, 0], [1, 0]"),
               "at least three points");
  EXPECT_PRED2(has, problem("[-0.002, -0.002],", "[-0.002],"), "[x, y]");
  EXPECT_PRED2(has, problem("shape = \"d\"", "shape = \"dee\""), "dee");
  EXPECT_PRED2(has, problem("across = [0, -1, 0]", "across = [0, 0, 1]"), "across");
  EXPECT_PRED2(has, problem("across = [0, -1, 0]", "axis = [0, 0, 0]"), "axis");
  EXPECT_PRED2(has, problem("sphere = { center = [0.008, 0.01, 0], radius = 0.001 }", ""),
               "either a grasp or one region");
  EXPECT_PRED2(has, problem("sphere = { center = [0.008, 0.01, 0], radius = 0.001 }", "grasp = \"hand\""), "hand");
  EXPECT_PRED2(has, problem("time = 0.2, base = [0.003", "time = 2, base = [0.003"), "after the end of the run");
  EXPECT_PRED2(has, problem("roughness = 0.0002", "rougness = 0.0002"), "did you mean");
}

TEST(SessionShave, ChangesOfARecordingComeBackToTheBit) {
  Recording r;
  r.source.text = kScript;
  r.source.name = "script.toml";
  r.overrides.scripted = false;
  r.instructions = instruction_set();
  using K = SessionChange::Kind;
  const auto add = [&](std::int64_t step, K kind, std::vector<double> values, std::vector<std::int32_t> elements = {}) {
    SessionChange c;
    c.step = step;
    c.kind = kind;
    c.values = std::move(values);
    c.vertices = std::move(elements);
    r.changes.push_back(c);
  };
  std::vector<double> punch{1, -1, 2e-4, 0, 0.013, 0, 0, 0, 1, 1, 0, 0};
  for (const Vec2 p : circle_outline(0.003, 5e-5)) punch.insert(punch.end(), {p.x, p.y});
  add(2, K::kPunch, punch);
  add(3, K::kShave, {1, 0, 0.0103, 0.001, 0, 0.0103, -0.001, 0.001, 0.5, 2e-5});
  add(4, K::kShave, {1, 0, 0.0102, 0.001, 0, 0.0102, -0.001, 0.001, 0.5, 2e-5});
  add(5, K::kEndStroke, {});
  auto scene = scene_of(r.source, r.overrides);
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  auto session = Session::create(*scene);
  ASSERT_TRUE(session.ok());
  std::size_t next = 0;
  for (int step = 0; step <= 8; ++step) {
    if (step == 6)
      add(6, K::kRemove, {}, {static_cast<std::int32_t>(session->body().complex.collision.face_count()) - 1});
    for (; next < r.changes.size() && r.changes[next].step == step; ++next) {
      const Status done = apply(*session, r.changes[next]);
      ASSERT_TRUE(done.ok()) << step << ": " << done.error().message;
    }
    if (step == 8) break;
    ASSERT_TRUE(session->step().ok());
  }
  r.last_step = 8;
  r.end_hash = session->hash();
  const auto back = parse_recording(recording_text(r), "r.kerfrec");
  ASSERT_TRUE(back.ok()) << back.error().message;
  const auto report = replay(*back);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->first_difference, -1);
  EXPECT_EQ(report->first_refused, "");
}

}  // namespace
}  // namespace kerf::session_shave_test
