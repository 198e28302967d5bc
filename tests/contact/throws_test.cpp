// Things thrown at a thin sheet that does not give way: they are seen before they are through, and afterwards it is still known
// from which side they came. The side is checked by counting how often their way crosses the sheet.
#include <gtest/gtest.h>

#include <cmath>

#include "contact/bare_surface.h"
#include "contact/shapes_for_tests.h"

namespace kerf::throws_test {
namespace {

using testing_support::BareSurface;
using testing_support::shape_of;

/// Does the segment cross the triangle? (Signed volumes.)
bool crosses(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const auto volume = [](Vec3 o, Vec3 x, Vec3 y, Vec3 z) { return dot(cross(x - o, y - o), z - o); };
  if ((volume(a, b, c, p) > 0) == (volume(a, b, c, q) > 0)) return false;
  const bool s = volume(p, q, a, b) > 0;
  return (volume(p, q, b, c) > 0) == s && (volume(p, q, c, a) > 0) == s;
}

struct Throw {
  int crossings = 0;
  int seen_late = 0, wrong_side = 0, checked = 0;
};

/// Flies a tool from `start` through the sheet and compares the side of its contacts with the count of crossings.
/// Looks until its centre is `far` metres beyond.
Throw fly(const BareSurface& sheet, RigidShape shape, double far, double dt) {
  Throw result;
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  const SurfaceState state = sheet.state();
  const int parts = substeps(std::span(&state, 1), std::span(&shape, 1), dt);
  DetectOptions options;
  options.step = dt / parts;
  const Vec3 start = shape.position;
  bool odd = false, touched = false;
  const double from = start.z > 0 ? 1 : -1;
  for (int i = 0; i < 4000; ++i) {
    detect(std::span(&state, 1), {}, std::span(&shape, 1), options, memory, workspace, contacts);
    touched = touched || !contacts.empty();
    if (odd) {
      // Beyond the sheet by no more than a response could ever let it: pushed back to where it came from.
      if (std::fabs(shape.position.z) > far) return result;
      ++result.checked;
      if (!touched) ++result.seen_late;
      double push = 0;  // of penalties of stiffness 1, on the sheet
      for (const Contact& c : contacts) push += std::max(0.0, -c.gap) * c.normal.z * from;
      if (!(push < 0)) ++result.wrong_side;
    }
    const Vec3 next = shape.position + options.step * shape.velocity;
    for (const CollisionTriangle f : ids<CollisionTriangle>(sheet.surface.face_count())) {
      const auto c = sheet.surface.vertices(f);
      if (crosses(shape.position, next, sheet.position[c[0].index()], sheet.position[c[1].index()],
                  sheet.position[c[2].index()])) {
        odd = !odd;
        ++result.crossings;
      }
    }
    shape.position = next;
    for (Mat3* axes : {&shape.axes})
      for (Vec3& a : axes->c) a = normalized(a + options.step * cross(shape.spin, a));
    if (std::fabs(shape.position.z) > 0.2) break;
  }
  return result;
}

TEST(Throws, NothingPassesUnseenAndSidesAreKept) {
  const double r = 0.001, R = 0.002;
  int flown = 0, checked = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    Random random(seed);
    const int grid = seed % 3 == 0 ? 40 : seed % 3 == 1 ? 8 : 80;
    BareSurface sheet(testing_support::plain_grid_mesh(grid, grid, 0.1, 0.1), r);
    RigidShape shape;
    switch (seed % 4) {
      case 0: shape = shape_of(sphere_part({}, R)); break;
      case 1: shape = shape_of(capsule_part({-2 * R, 0, 0}, {2 * R, 0, 0}, R)); break;
      case 2: shape = shape_of(box_part({}, {R, 1.5 * R, 2 * R})); break;
      default: shape = shape_of(box_part({}, {R, R, R}, {}, 0.3 * R)); break;
    }
    shape.axes = testing_support::random_rotation(random);
    const double speed = std::pow(10, random.uniform(-0.5, 1)), side = random.uniform() < 0.5 ? 1 : -1;
    const Vec3 target{random.uniform(0.03, 0.07), random.uniform(0.03, 0.07), 0};
    const Vec3 way = normalized(Vec3{random.uniform(-0.7, 0.7), random.uniform(-0.7, 0.7), -side});
    shape.position = target - (0.02 / -way.z * side) * way;
    shape.velocity = speed * way;
    // When its middle is well through, vertices beside it see it from the other side whatever is remembered.
    const Throw t = fly(sheet, shape, 0.1 * (R + r), 0.0167);
    flown += t.crossings > 0 ? 1 : 0;
    checked += t.checked;
    EXPECT_EQ(t.seen_late, 0) << "seed " << seed;
    EXPECT_EQ(t.wrong_side, 0) << "seed " << seed << " kind " << seed % 4 << " grid " << grid << " speed " << speed;
  }
  EXPECT_GT(flown, 140);
  EXPECT_GT(checked, 20);
}

// One number for all: 10 m/s at 60 Hz against a millimetre.
TEST(Throws, Substeps) {
  BareSurface sheet(testing_support::plain_grid_mesh(4, 4), 0.001);
  RigidShape ball = shape_of(sphere_part({}, 0.002));
  const SurfaceState state = sheet.state();
  EXPECT_EQ(substeps(std::span(&state, 1), std::span(&ball, 1), 0.0167), 1);
  ball.velocity = {10, 0, 0};
  EXPECT_EQ(substeps(std::span(&state, 1), std::span(&ball, 1), 0.0167, 1000),
            static_cast<int>(std::ceil(0.0167 * 10 / 0.0015)));
  EXPECT_EQ(substeps(std::span(&state, 1), std::span(&ball, 1), 0.0167, 8), 8);
  ball.velocity = {};
  ball.spin = {0, 0, 100};  // about its own centre, but nobody looks that closely
  EXPECT_GE(substeps(std::span(&state, 1), std::span(&ball, 1), 0.0167, 1000), 1);
}

}  // namespace
}  // namespace kerf::throws_test
