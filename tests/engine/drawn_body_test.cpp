// What pages are sent of a cut: the local update finds the same as a comparison of the whole body.
#include "kerf/engine/drawn_body.h"

#include <gtest/gtest.h>

#include "kerf/base/random.h"
#include "kerf/scene/scene_file.h"

namespace kerf::drawn_body_test {
namespace {

Session make(const std::string& body) {
  auto scene = parse_scene("[body]\n" + body + "\n[simulation]\ntime_step = 0.005\ngravity = [0, 0, 0]\n", "test", "");
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  auto session = Session::create(*scene);
  EXPECT_TRUE(session.ok()) << (session.ok() ? "" : session.error().message);
  session->watch_changes(true);
  return std::move(session).value();
}

/// Two views of one body: one looks at what the session noted, the other at everything.
struct Both {
  Session session;
  DrawnBody local, whole;
  std::uint32_t patches = 0, undone = 0, redone = 0;
  std::size_t shrunk = 0, grown = 0, known_vertices = 0;

  explicit Both(Session s) : session(std::move(s)) {
    local.reset(session.body());
    whole.reset(session.body());
  }
  void compare(const std::string& when) {
    local.update(session.body(), session.take_changes());
    whole.update(session.body());
    ASSERT_EQ(local.changed(), whole.changed()) << when;
    ASSERT_EQ(protocol::encode(local.body_message()), protocol::encode(whole.body_message())) << when;
    const protocol::Patch patch = local.patch_message();
    ASSERT_EQ(protocol::encode(patch), protocol::encode(whole.patch_message())) << when;
    if (local.changed()) ++patches;
    if (patch.totals.nv < known_vertices) ++shrunk;
    if (patch.totals.nv > known_vertices) ++grown;
    known_vertices = patch.totals.nv;
  }
};

/// Strokes, straight and wild, with all that goes with them; compared now and then, so that changes also come together.
void cut_at_random(const std::string& body, std::uint64_t seed, int strokes) {
  Both both(make(body));
  Random random(seed);
  Session& session = both.session;
  Box3 box;
  for (const Vec3 p : session.body().complex.visual.rest.raw()) box.add(p);
  const Vec3 half = 0.5 * box.size(), middle = box.center();
  const auto place = [&](double reach) {
    return middle + Vec3{reach * half.x * (2 * random.uniform() - 1), reach * half.y * (2 * random.uniform() - 1), 0};
  };
  for (int k = 0; k < strokes; ++k) {
    const std::string stroke = body + ", stroke " + std::to_string(k);
    ASSERT_TRUE(
        session.begin_stroke(random.uniform() < 0.5 ? SceneFrame::kRest : SceneFrame::kWorld, random.uniform() < 0.3)
            .ok());
    Vec3 at = place(1.2), to = place(1.2);
    const int poses = 4 + static_cast<int>(20 * random.uniform());
    const double wild = random.uniform() < 0.5 ? 0 : 0.1;
    for (int i = 0; i <= poses; ++i) {
      const Vec3 p = at + (static_cast<double>(i) / poses) * (to - at) + wild * (place(1) - middle);
      const Vec3 up{0.1 * half.x * random.uniform(), 0, 2 * box.diagonal()};
      (void)session.move_blade(p + up, p - up).ok();  // refused ones change nothing
      if (random.uniform() < 0.7) {
        ASSERT_NO_FATAL_FAILURE(both.compare(stroke + ", pose " + std::to_string(i)));
      }
      if (random.uniform() < 0.2) {
        ASSERT_TRUE(session.step(1).ok());
      }
    }
    const bool cancelled = random.uniform() < 0.2;
    ASSERT_TRUE((cancelled ? session.cancel_stroke() : session.end_stroke()).ok());
    if (random.uniform() < 0.7) {
      ASSERT_NO_FATAL_FAILURE(both.compare(stroke + ", its end"));
    }
    while (random.uniform() < 0.4) {
      const bool back = random.uniform() < 0.6;
      if (back ? session.undo_depth() == 0 : session.redo_depth() == 0) break;
      ASSERT_TRUE((back ? session.undo() : session.redo()).ok());
      ++(back ? both.undone : both.redone);
      if (random.uniform() < 0.7) {
        ASSERT_NO_FATAL_FAILURE(both.compare(stroke + (back ? ", undone" : ", redone")));
      }
    }
  }
  ASSERT_NO_FATAL_FAILURE(both.compare("the end"));
  // It has looked at what it is about.
  EXPECT_GT(both.patches, 20u);
  EXPECT_GT(both.shrunk, 0u);
  EXPECT_GT(both.grown, 10u);
  EXPECT_GT(both.undone, 0u);
}

TEST(DrawnBody, LocalUpdateIsTheWholeOneOnTheSteak) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) cut_at_random("model = \"steak\"", seed, 25);
}
TEST(DrawnBody, LocalUpdateIsTheWholeOneOnTheMeniscus) { cut_at_random("model = \"meniscus\"", 4, 25); }
TEST(DrawnBody, LocalUpdateIsTheWholeOneOnSheets) {
  cut_at_random("model = \"closed-sheet\"\noptions = { visual_triangles = 8000 }", 5, 20);
  cut_at_random("model = \"sheet\"\noptions = { visual_triangles = 6656 }", 6, 20);
}

TEST(DrawnBody, LocalUpdateIsTheWholeOneWhereAShaverWorks) {
  Both both(make("model = \"meniscus\""));
  Session& session = both.session;
  Punch punch;
  punch.centre = {0, 0.013, 0};
  punch.outline = circle_outline(0.003, 5e-5);
  ASSERT_TRUE(session.punch(punch, SceneFrame::kRest, 2e-4).ok());
  ASSERT_NO_FATAL_FAILURE(both.compare("a punch"));
  for (int pass = 0; pass < 60; ++pass) {
    const double a = 0.13 * pass;
    const Vec3 at{0.003 * std::cos(a), 0.013 - 0.003 * std::fabs(std::sin(a)), 0};
    ASSERT_TRUE(session.shave({at, at, 0.001}, SceneFrame::kRest, 0.6, pass < 20 ? 0 : 4e-5).ok());
    ASSERT_NO_FATAL_FAILURE(both.compare("pass " + std::to_string(pass)));
    if (pass == 30) {
      ASSERT_TRUE(session.end_stroke().ok());
    }
  }
  ASSERT_TRUE(session.cancel_stroke().ok());
  ASSERT_NO_FATAL_FAILURE(both.compare("cancelled"));
  ASSERT_TRUE(session.undo().ok());
  ASSERT_NO_FATAL_FAILURE(both.compare("undone"));
  ASSERT_TRUE(session.redo().ok());
  ASSERT_NO_FATAL_FAILURE(both.compare("redone"));
  EXPECT_GT(both.patches, 50u);
}

TEST(DrawnBody, ARestoredBodyIsComparedAsAWhole) {
  Both both(make("model = \"steak\""));
  const auto start = both.session.snapshot();
  ASSERT_TRUE(both.session.begin_stroke(SceneFrame::kRest, false).ok());
  ASSERT_TRUE(both.session.move_blade({0, -0.2, 0.1}, {0, -0.2, -0.1}).ok());
  ASSERT_TRUE(both.session.move_blade({0, 0.2, 0.1}, {0, 0.2, -0.1}).ok());
  ASSERT_TRUE(both.session.end_stroke().ok());
  both.compare("cut");
  both.session.restore(start);
  both.compare("restored");
  EXPECT_EQ(both.patches, 2u);
}

}  // namespace
}  // namespace kerf::drawn_body_test
