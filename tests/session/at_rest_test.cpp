// What is cut while it is at rest stays at rest, and what hangs is not torn about: lips push only what presses them. KERF_FUZZ_SECONDS=n in the environment: so
// long for each kind, KERF_FUZZ_SEED=s from another seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "kerf/session/session.h"

#include "cutting/stroke_sets.h"
#include "session/make_session.h"

namespace kerf::at_rest_test {
namespace {

using namespace testing_support;

constexpr double kReach = 0.3;  // m, of the blade to both sides

Scene plate() {
  Scene scene;
  scene.body.model = "closed-sheet";
  scene.body.options.visual_triangles = 2500;
  scene.simulation.gravity = {};
  scene.contact.enabled = true;
  return scene;
}

struct Seen {
  double fastest = 0;  ///< of any node, m/s
  int inverted = 0;    ///< cells, at most
};
void run(Session& session, int steps, Seen& seen) {
  for (int i = 0; i < steps; ++i) {
    const Result<SessionStep> step = session.step();
    ASSERT_TRUE(step.ok()) << step.error().message;
    seen.inverted = std::max(seen.inverted, step->mechanics.inverted_elements);
    for (const Vec3 v : session.node_velocities()) seen.fastest = std::max(seen.fastest, norm(v));
  }
}

/// Cuts a set in 1 to 40 poses a segment, with steps between them.
void cut(Session& session, SceneFrame frame, const std::vector<Stroke>& strokes, int poses, int between, Seen& seen) {
  const auto move = [&](Vec2 p) {
    ASSERT_TRUE(session.move_blade({p.x, p.y, kReach}, {p.x, p.y, -kReach}).ok());
    run(session, between, seen);
  };
  for (const Stroke& s : strokes) {
    ASSERT_TRUE(session.begin_stroke(frame, false).ok());
    move(s[0]);
    for (std::size_t k = 0; k + 1 < s.size(); ++k)
      for (int i = 1; i <= poses; ++i) move(lerp(s[k], s[k + 1], static_cast<double>(i) / poses));
    ASSERT_TRUE(session.end_stroke().ok());
  }
}

class AtRest : public ::testing::TestWithParam<int> {
 protected:
  /// Calls try_set(session, strokes, poses, what) for `sets` of them.
  template <class TrySet>
  void for_sets(const Scene& scene, std::uint64_t sets, TrySet&& try_set) {
    const auto kind = static_cast<SetKind>(GetParam());
    const char *seconds = std::getenv("KERF_FUZZ_SECONDS"), *first_seed = std::getenv("KERF_FUZZ_SEED");
    const std::uint64_t first = first_seed ? std::strtoull(first_seed, nullptr, 10) : 1;
    const auto begin = std::chrono::steady_clock::now();
    const auto spent = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
    for (std::uint64_t seed = first; seconds ? spent() < std::atof(seconds) : seed < first + sets; ++seed) {
      Session session = test::make(scene);
      const CellComplex& body = session.body().complex;
      const StrokeSets made(body.collision, 1, body.mean_root_edge);
      Random random(1000 * seed + static_cast<std::uint64_t>(GetParam()));
      const std::vector<Stroke> strokes = made.make(kind, random);
      constexpr int kPoses[] = {1, 2, 3, 8, 40};
      const int poses = kPoses[random.index(5)];
      try_set(session, strokes, poses,
              "seed " + std::to_string(seed) + ", " + std::to_string(poses) + " poses:" + text_of(strokes));
    }
  }
};

TEST_P(AtRest, NothingMoves) {
  for (const int between : {0, 1})
    for_sets(plate(), 1, [&](Session& session, const std::vector<Stroke>& strokes, int poses, const std::string& what) {
      Seen seen;
      cut(session, SceneFrame::kRest, strokes, poses, between, seen);
      run(session, 5, seen);
      EXPECT_LT(seen.fastest, 1e-9) << between << " steps a pose, " << what;
    });
}

// A plate between two walls sags and is cut. Pieces that come off fall for less than half a second, at 2 m/s2; what springs back was bent by its own weight.
TEST_P(AtRest, WhatHangsIsNotTornAbout) {
  Scene scene = plate();
  scene.simulation.gravity = {0, 0, -2};
  scene.material.young = 20000;
  scene.material.density = 200;
  for (const double side : {-1.0, 1.0}) {
    SceneFix& wall = scene.fixes.emplace_back();
    wall.region.shape = SceneRegion::Shape::kHalfSpace;
    wall.region.point = {0.42 * side, 0, 0};
    wall.region.normal = {side, 0, 0};
  }
  scene.simulation.time_step = 0.005;
  for_sets(scene, 1, [&](Session& session, const std::vector<Stroke>& strokes, int poses, const std::string& what) {
    Seen seen;
    run(session, 100, seen);
    seen = {};
    cut(session, SceneFrame::kWorld, strokes, poses, 0, seen);
    run(session, 60, seen);
    EXPECT_LT(seen.fastest, 6) << what;
    EXPECT_EQ(seen.inverted, 0) << what;
  });
}

std::string name_of(const ::testing::TestParamInfo<int>& info) {
  std::string name = kSetKinds[info.param];
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Sets, AtRest, ::testing::Range(0, static_cast<int>(std::size(kSetKinds))), name_of);

}  // namespace
}  // namespace kerf::at_rest_test
