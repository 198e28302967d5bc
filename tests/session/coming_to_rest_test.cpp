// What lies on something else, freely, comes to rest: whatever the steps and however much one is stiffer than the other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/session/session.h"
#include "session/make_session.h"

namespace kerf::coming_to_rest_test {
namespace {

using test::make;

#ifdef __SANITIZE_ADDRESS__
const std::vector<double> kSteps{0.0167};
#else
const std::vector<double> kSteps{0.005, 0.0167};
#endif

/// m/s, root mean square over the nodes, at its greatest in `seconds`.
double liveliest(Session& session, double seconds) {
  double most = 0;
  for (int i = 0; i < static_cast<int>(std::ceil(seconds / session.time_step())); ++i) {
    const auto done = session.step();
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
    if (!done) return HUGE_VAL;
    double sum = 0;
    for (const Vec3& v : session.node_velocities()) sum += dot(v, v);
    most = std::max(most, std::sqrt(sum / static_cast<double>(session.node_velocities().size())));
  }
  return most;
}
double deepest(const Session& session) {
  double most = 0;
  for (const Session::ContactState& c : session.contacts()) most = std::max(most, -c.gap);
  return most;
}

// Contacts were as stiff as the mean of both sides, thousands of times too much for the softer one: the first pair exploded, the last two went on at 4 to 40 mm/s.
TEST(ComingToRest, StiffOnSoftAndSoftOnStiff) {
  struct Pair {
    double lower, upper;
  };
  for (const double dt : kSteps)
    for (const Pair young : {Pair{3e3, 1e9}, Pair{1e9, 3e3}, Pair{1e4, 1e7}, Pair{1e7, 1e4}}) {
      Scene scene;
      scene.simulation.time_step = dt;
      scene.body.model = "strip";
      scene.body.options.visual_triangles = 0;
      scene.body.position = {0, 0, 0.0016};
      scene.body.material.young = young.lower;
      SceneBody& upper = scene.more_bodies.emplace_back();
      upper.model = "strip";
      upper.options.visual_triangles = 0;
      upper.position = {0.01, 0, 0.0048};
      upper.rotation = {0, 0, 0.3};
      upper.material.young = young.upper;
      scene.obstacles.emplace_back();
      Session session = make(scene);
      liveliest(session, 1.5);
      EXPECT_LT(liveliest(session, 0.2), 2e-4) << dt << " " << young.lower << " " << young.upper;
      EXPECT_LT(deepest(session), 0.02 * 0.0015) << dt << " " << young.lower << " " << young.upper;
    }
}

// It went on at 13 mm/s in steps of 16.7 ms: light rims opened and closed without end, since contacts that had just closed set the solver's tolerance.
TEST(ComingToRest, AFreeMeniscusOnAPlateau) {
  for (const double dt : kSteps) {
    Scene scene;
    scene.simulation.time_step = dt;
    scene.body.model = "meniscus";
    scene.body.options.visual_triangles = 0;
    SceneObstacle tibia;
    tibia.shape = SceneShape::kMesh;
    tibia.model = "plateau";
    tibia.position = {0, 0.017, -0.0040};
    scene.obstacles = {tibia};
    Session session = make(scene);
    liveliest(session, 2);
    EXPECT_LT(liveliest(session, 0.2), 2e-4) << dt;
  }
}

}  // namespace
}  // namespace kerf::coming_to_rest_test
