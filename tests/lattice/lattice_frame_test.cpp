#include "kerf/lattice/lattice_frame.h"

#include <gtest/gtest.h>

#include "lattice/lattice_bodies.h"

namespace kerf::lattice_frame_test {
namespace {

Vec3 turned(Vec3 p, double a, double b) {
  const Vec3 q{std::cos(a) * p.x - std::sin(a) * p.y, std::sin(a) * p.x + std::cos(a) * p.y, p.z};
  return {q.x, std::cos(b) * q.y - std::sin(b) * q.z, std::sin(b) * q.y + std::cos(b) * q.z};
}

TEST(LatticeFrame, AlignedBodyGetsAlignedCells) {
  for (int axis = 0; axis < 3; ++axis) {
    auto place = [axis](Vec3 p) { return axis == 2 ? p : axis == 0 ? Vec3{p.z, p.x, p.y} : Vec3{p.y, p.z, p.x}; };
    const CollisionMesh mesh = grid_body(4, 4, 2, 2, 0.25, place);
    LatticeOptions options;
    options.cells = 16;
    options.layers = 2;
    const auto frame = choose_lattice(mesh, options);
    ASSERT_TRUE(frame.ok());
    EXPECT_EQ(frame->axes, Mat3{});
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(frame->count[static_cast<std::size_t>(i)], i == axis ? 2 : 3);  // sqrt(16 / 2) = 2.8
      EXPECT_NEAR(frame->cell[i], i == axis ? 0.125 : 2.0 / 3, 1e-12);
    }
  }
}

TEST(LatticeFrame, TurnedBodyGetsTurnedCells) {
  for (const double a : {0.1, 0.4, 0.7, 1.2, -0.6})
    for (const double b : {0.3, -0.5, 1.0}) {
      const CollisionMesh mesh = grid_body(6, 4, 3, 2, 0.3, [&](Vec3 p) { return turned(p, a, b); });
      const auto frame = choose_lattice(mesh, {});
      ASSERT_TRUE(frame.ok());
      EXPECT_NEAR(dot(cross(frame->axes.c[0], frame->axes.c[1]), frame->axes.c[2]), 1, 1e-12);
      double extents[3];
      for (int i = 0; i < 3; ++i) extents[i] = frame->cell[i] * frame->count[static_cast<std::size_t>(i)];
      std::sort(extents, extents + 3);
      EXPECT_NEAR(extents[0], 0.3, 1e-9);
      EXPECT_NEAR(extents[1], 2, 1e-9);
      EXPECT_NEAR(extents[2], 3, 1e-9);
    }
}

TEST(LatticeFrame, SquareTurnedInItsPlaneIsFoundThroughItsRectangle) {
  const CollisionMesh mesh = grid_body(5, 5, 1, 1, 0.1, [&](Vec3 p) { return turned(p, 0.5, 0); });
  const auto frame = choose_lattice(mesh, {});
  ASSERT_TRUE(frame.ok());
  EXPECT_NEAR(frame->cell.x * frame->count[0], 1, 1e-9);
  EXPECT_NEAR(frame->cell.y * frame->count[1], 1, 1e-9);
  EXPECT_NEAR(std::fabs(frame->axes.c[2].z), 1, 1e-12);
}

TEST(LatticeFrame, SameMeshSameBitsAndPointsComeBack) {
  const CollisionMesh mesh = grid_body(6, 4, 3, 2, 0.3, [&](Vec3 p) { return turned(p, 0.3, 0.8); });
  const auto a = choose_lattice(mesh, {}), b = choose_lattice(mesh, {});
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->axes, b->axes);
  EXPECT_EQ(a->origin, b->origin);
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Vec3 p{random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)};
    EXPECT_LT(norm(a->to_world(a->to_lattice(p)) - p), 1e-13);
  }
}

TEST(LatticeFrame, RefusesWhatItCannotUse) {
  EXPECT_FALSE(choose_lattice(CollisionMesh{}, {}).ok());
  EXPECT_FALSE(choose_lattice(grid_body(2, 2, 1, 1, 0), {}).ok());  // no thickness
  LatticeOptions given;
  given.given = true;
  given.cell = {1, 0, 1};
  given.count = {1, 1, 1};
  EXPECT_FALSE(choose_lattice(grid_body(2, 2, 1, 1, 0.1), given).ok());
  given.cell = {1, 1, 1};
  given.axes.c[0] = {1, 1, 0};
  EXPECT_FALSE(choose_lattice(grid_body(2, 2, 1, 1, 0.1), given).ok());
  LatticeOptions many;
  many.cells = 2000000000;
  EXPECT_FALSE(choose_lattice(grid_body(2, 2, 1, 1, 0.1), many).ok());
}

}  // namespace
}  // namespace kerf::lattice_frame_test
