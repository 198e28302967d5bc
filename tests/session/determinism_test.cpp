// Same scene, same commands, same bits: for any number of threads, from a recording, from the middle of one, and from a snapshot.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "kerf/base/parallel.h"
#include "kerf/base/random.h"
#include "kerf/record/recording.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/session.h"
#include "support/source_dir.h"

namespace kerf::determinism_test {
namespace {

constexpr std::int64_t kMostSteps = 500;  ///< of a shipped scene

std::vector<std::filesystem::path> shipped_scenes() {
  std::vector<std::filesystem::path> found;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(test::source_dir()) / "scenes"))
    if (entry.path().extension() == ".toml") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

std::int64_t steps_of(const Scene& scene) {
  return std::min(kMostSteps, static_cast<std::int64_t>(scene.simulation.duration / scene.simulation.time_step));
}

/// Hashes every hundred steps and at the end.
std::vector<std::uint64_t> trace(const Scene& scene, int threads) {
  const ThreadLimit limit(threads);
  std::vector<std::uint64_t> hashes;
  auto session = Session::create(scene);
  EXPECT_TRUE(session.ok()) << (session.ok() ? "" : session.error().message);
  if (!session.ok()) return hashes;
  const std::int64_t steps = steps_of(scene);
  for (std::int64_t i = 1; i <= steps; ++i) {
    const auto step = session->step();
    EXPECT_TRUE(step.ok()) << "step " << i << ": " << (step.ok() ? "" : step.error().message);
    if (!step.ok()) break;
    if (i % 100 == 0 || i == steps) hashes.push_back(session->hash());
  }
  return hashes;
}

TEST(Determinism, ThereAreShippedScenes) { EXPECT_GE(shipped_scenes().size(), 5U); }

class ShippedScene : public ::testing::TestWithParam<std::filesystem::path> {};

TEST_P(ShippedScene, DoesNotDependOnThreads) {
  const auto scene = read_scene(GetParam(), {test::source_dir() + "/../shared/meshes"});
  if (!scene.ok() && scene.error().message.find("--meshes") != std::string::npos) GTEST_SKIP() << scene.error().message;
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  const auto one = trace(*scene, 1), two = trace(*scene, 2);
  EXPECT_FALSE(one.empty());
  EXPECT_EQ(one, two);
}

INSTANTIATE_TEST_SUITE_P(Determinism, ShippedScene, ::testing::ValuesIn(shipped_scenes()), [](const auto& scene) {
  std::string name = scene.param.stem().string();
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// Shipped scenes are too small for most parallel loops; this one is not.
TEST(Determinism, ALargeBodyDoesNotDependOnThreads) {
  Scene scene;
  scene.name = scene.body.model = "closed-sheet";
  scene.body.options.visual_triangles = 60000;
  scene.body.options.collision_triangles = 1250;
  scene.lattice.cells = {50, 50, 1};
  scene.simulation.time_step = 0.01;
  scene.simulation.duration = 0.06;
  std::vector<std::uint64_t> hashes[2];
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    auto session = Session::create(scene);
    ASSERT_TRUE(session.ok()) << session.error().message;
    auto& out = hashes[threads - 1];
    out.push_back(session->hash());
    for (int i = 0; i < 3; ++i) {
      const Vec3 up{0, 0, 1};
      ASSERT_TRUE(session->begin_stroke(SceneFrame::kRest, true).ok());
      for (const Vec3 p : {Vec3{-0.6, -0.2 + 0.2 * i, 0}, Vec3{0.3, 0.1 * i, 0}})
        ASSERT_TRUE(session->move_blade(p + up, p - up).ok());
      ASSERT_TRUE(session->end_stroke().ok());
      ASSERT_TRUE(session->step(2).ok());
      out.push_back(session->hash());
    }
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

SessionChange change(std::int64_t step, SessionChange::Kind kind, std::vector<double> values = {},
                     std::string id = "") {
  SessionChange c;
  c.step = step;
  c.kind = kind;
  c.id = std::move(id);
  c.values = std::move(values);
  return c;
}

/// A life of 60 steps with everything that can be recorded.
Recording eventful() {
  using Kind = SessionChange::Kind;
  Recording r;
  r.source.name = "eventful";
  r.source.text = "[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.002\n";
  r.last_step = 60;
  SessionChange grasp = change(2, Kind::kGrasp, {}, "g");
  grasp.vertices = {3, 4, 5};
  r.changes = {change(1, Kind::kFix, {2, 0, 0.05, 0, 0, 1, 0}), grasp,
               change(3, Kind::kMove, {0.02, -0.05, 0.03, 0.02}, "g"), change(5, Kind::kBeginStroke, {1})};
  for (int i = 0; i < 10; ++i)
    r.changes.push_back(change(5 + i, Kind::kBlade, {0.01, -0.1 + 0.012 * i, 0.05, 0.01, -0.1 + 0.012 * i, -0.05}));
  for (auto c : {change(16, Kind::kEndStroke), change(20, Kind::kUndo), change(25, Kind::kRedo),
                 change(30, Kind::kGravity, {0, 1, -5}), change(33, Kind::kMaterial, {30e3, 0.4, 900}),
                 change(36, Kind::kBeginStroke, {0}), change(36, Kind::kBlade, {-0.1, -0.02, 0.05, -0.1, -0.02, -0.05}),
                 change(37, Kind::kBlade, {0.05, -0.03, 0.05, 0.05, -0.03, -0.05}), change(39, Kind::kEndStroke),
                 change(45, Kind::kRelease, {}, "g"), change(50, Kind::kUnfix, {2, 0, 0.05, 0, 0, 1, 0})})
    r.changes.push_back(c);
  return r;
}

/// From step `from` to step `to`, the changes of `to` left out.
void live(Session& session, const Recording& r, std::int64_t from, std::int64_t to) {
  for (std::int64_t step = from; step < to; ++step) {
    for (const SessionChange& c : r.changes)
      if (c.step == step) {
        const Status done = apply(session, c);
        EXPECT_TRUE(done.ok()) << "step " << step << ": " << (done.ok() ? "" : done.error().message);
      }
    ASSERT_TRUE(session.step(1).ok()) << step;
  }
}

// There is no file that holds a session's state: what is saved is a recording, and going on from a part of it equals going on.
TEST(Determinism, SavedLoadedAndGoneOnIsGoneOn) {
  Recording whole = eventful();
  const auto scene = scene_of(whole.source, whole.overrides);
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  auto straight = Session::create(*scene);
  ASSERT_TRUE(straight.ok());
  live(*straight, whole, 0, whole.last_step);
  EXPECT_GT(straight->counts().collision_triangles, 150U);

  for (const std::int64_t middle : {4, 11, 22, 38, 55}) {
    Recording part = whole;
    std::erase_if(part.changes, [&](const SessionChange& c) { return c.step >= middle; });
    part.last_step = middle;
    {
      auto until = Session::create(*scene);
      ASSERT_TRUE(until.ok());
      live(*until, whole, 0, middle);
      part.end_hash = until->hash();
    }
    const auto loaded = parse_recording(recording_text(part), "part");
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    const auto played = replay(*loaded);
    ASSERT_TRUE(played.ok());
    EXPECT_EQ(played->first_difference, -1) << middle;
    auto again = Session::create(*scene_of(loaded->source, loaded->overrides));
    ASSERT_TRUE(again.ok());
    live(*again, *loaded, 0, middle);
    live(*again, whole, middle, whole.last_step);
    EXPECT_EQ(again->hash(), straight->hash()) << "from step " << middle;
  }
}

TEST(Determinism, ASnapshotGoesOnAsTheSessionDid) {
  const Recording whole = eventful();
  auto session = Session::create(*scene_of(whole.source, whole.overrides));
  ASSERT_TRUE(session.ok());
  std::int64_t at = 0;
  for (const std::int64_t middle : {4, 11, 22, 38, 55}) {
    live(*session, whole, at, middle);
    at = middle;
    const auto kept = session->snapshot();
    live(*session, whole, middle, whole.last_step);
    const std::uint64_t end = session->hash();
    session->restore(kept);
    live(*session, whole, middle, whole.last_step);
    EXPECT_EQ(session->hash(), end) << "from step " << middle;
    session->restore(kept);
  }
}

TEST(Determinism, WhatIsKeptBetweenStrokesIsWhatWouldBeFoundAnew) {
  // One session keeps boxes, positions and pieces from stroke to stroke, the other is set back to its own snapshot all the time.
  Scene scene;
  scene.name = scene.body.model = "closed-sheet";
  scene.body.options.visual_triangles = 3000;
  scene.body.options.collision_triangles = 392;
  auto one = Session::create(scene), other = Session::create(scene);
  ASSERT_TRUE(one.ok()) << one.error().message;
  ASSERT_TRUE(other.ok());
  Box3 box;
  for (const Vec3 p : one->body().complex.collision.rest.raw()) box.add(p);
  const Vec3 size = box.size(), up{0, 0, 1};
  Random random(8);
  int travelled = 0;
  for (int i = 0; i < 60; ++i) {
    const SceneFrame frame = random.next() % 4 == 0 ? SceneFrame::kWorld : SceneFrame::kRest;
    const bool through = random.next() % 2 == 0;
    const std::uint64_t what = random.next() % 6;
    const Vec3 from = box.center() + Vec3{size.x * random.uniform(-0.6, 0.6), size.y * random.uniform(-0.6, 0.6), 0};
    const Vec3 step{size.x * random.uniform(-0.06, 0.06), size.y * random.uniform(-0.06, 0.06), 0};
    for (Session* session : {&*one, &*other}) {
      const auto again = [&] {
        if (session == &*other) session->restore(session->snapshot());
      };
      again();
      if (what == 0 && session->undo_depth() > 0) {
        ASSERT_TRUE(session->undo().ok());
        ++travelled;
      } else if (what == 1 && session->redo_depth() > 0) {
        ASSERT_TRUE(session->redo().ok());
        ++travelled;
      } else {
        ASSERT_TRUE(session->begin_stroke(frame, through).ok());
        for (int k = 0; k <= 10; ++k) {
          const Vec3 p = from + k * step;
          ASSERT_TRUE(session->move_blade(p + up, p - up).ok());
          if (k % 3 == 1) again();
        }
        ASSERT_TRUE(session->end_stroke().ok());
      }
    }
    ASSERT_EQ(one->hash(), other->hash()) << "after " << i;
    ASSERT_EQ(one->strokes().size(), other->strokes().size());
    if (!one->strokes().empty()) {
      ASSERT_EQ(one->strokes().back().after.pieces, other->strokes().back().after.pieces);
    }
  }
  EXPECT_GT(travelled, 6);
  EXPECT_GT(one->counts().pieces, 1);
  EXPECT_TRUE(one->validate().ok());
}

}  // namespace
}  // namespace kerf::determinism_test
