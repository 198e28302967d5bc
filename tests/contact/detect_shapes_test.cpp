// Bodies against rigid shapes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact/bare_surface.h"
#include "contact/shapes_for_tests.h"
#include "kerf/base/random.h"
#include "kerf/base/rigid_place.h"
#include "kerf/contact/triangle_foot.h"
#include "support/contact_checker.h"

namespace kerf::detect_shapes_test {
namespace {

using testing_support::BareSurface;
using testing_support::plain_grid_mesh;
using testing_support::shape_of;

PlacedPart place_part(const RigidShape& shape) { return place(shape, shape.parts[0]); }

struct Detection {
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  DetectReport run(const BareSurface& body, std::span<const RigidShape> obstacles,
                   std::span<const RigidShape> tools = {}, const DetectOptions& options = {}) {
    const SurfaceState state = body.state();
    return detect(std::span(&state, 1), obstacles, tools, options, memory, workspace, contacts);
  }
};

// Whatever is handed out: unit normals, gaps that match the points, keys that rise.
void expect_consistent(const BareSurface& body, const std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    EXPECT_NEAR(norm(c.normal), 1, 1e-12);
    EXPECT_NEAR(dot(body.point(c.a) - c.point, c.normal), c.gap, 1e-12);
    if (i > 0) {
      EXPECT_LT(contacts[i - 1].key, c.key);
    }
  }
}

TEST(DetectShapes, SheetOverPlane) {
  BareSurface sheet(plain_grid_mesh(4, 4), 0.05);
  const RigidShape floor = shape_of(plane_part({0, 0, -0.055}, {0, 0, 2}));
  Detection d;
  d.run(sheet, std::span(&floor, 1));
  ASSERT_EQ(d.contacts.size(), 25u);
  expect_consistent(sheet, d.contacts);
  for (const Contact& c : d.contacts) {
    EXPECT_NEAR(c.gap, 0.005, 1e-15);
    EXPECT_EQ(c.normal, (Vec3{0, 0, 1}));
    EXPECT_EQ(c.a.lift, -1);
    EXPECT_EQ(c.obstacle, 0);
    EXPECT_EQ(c.tool, -1);
    EXPECT_EQ(c.friction, 0.3);
  }
}

TEST(DetectShapes, SheetStandingOnItsEdgeTouchesWithBothEnds) {
  BareSurface sheet(plain_grid_mesh(4, 4), 0.05);
  sheet.deform([](Vec3 p) { return Vec3{p.x, 0, p.y}; });
  const RigidShape floor = shape_of(plane_part({0, 0, 0}, {0, 0, 1}));
  Detection d;
  d.run(sheet, std::span(&floor, 1));
  EXPECT_EQ(d.contacts.size(), 10u);
  expect_consistent(sheet, d.contacts);
}

TEST(DetectShapes, FarShapesCostNoContacts) {
  BareSurface sheet(plain_grid_mesh(4, 4), 0.05);
  std::vector<RigidShape> shapes;
  shapes.push_back(shape_of(plane_part({0, 0, -0.2}, {0, 0, 1})));
  shapes.push_back(shape_of(sphere_part({0.5, 0.5, 0.4}, 0.3)));
  shapes.push_back(shape_of(capsule_part({-1, 0.5, 0.4}, {2, 0.5, 0.4}, 0.3)));
  shapes.push_back(shape_of(box_part({0.5, 0.5, 0.4}, {1, 1, 0.3})));
  Detection d;
  d.run(sheet, shapes);
  EXPECT_TRUE(d.contacts.empty());
  // What falls will be there by the end of the step.
  sheet.move({0, 0, -0.2});
  d.run(sheet, shapes);
  EXPECT_EQ(d.contacts.size(), 25u);
  // And so will what comes.
  sheet.rest();
  for (RigidShape& s : shapes) s.velocity = {0, 0, -100};
  d.run(sheet, std::span(shapes).subspan(1), {}, {.step = 1e-3});
  EXPECT_GT(d.contacts.size(), 25u);
}

// Without contacts what lies on a floor would fall, away from what comes down on it more slowly. It does not: a ball was 0.6 half thicknesses deep for a step of 16.7 ms.
TEST(DetectShapes, WhatMayBeHeldDoesNotGetOutOfTheWay) {
  BareSurface sheet(plain_grid_mesh(4, 4), 0.05);
  RigidShape ball = shape_of(sphere_part({0.52, 0.47, 0.37}, 0.3));  // 0.02 above the sheet
  ball.velocity = {0, 0, -30};
  sheet.move({0, 0, -0.05});
  Detection d;
  d.run(sheet, {}, std::span(&ball, 1), {.step = 1e-3});
  ASSERT_FALSE(d.contacts.empty());
  expect_consistent(sheet, d.contacts);
  double least = HUGE_VAL;
  for (const Contact& c : d.contacts) least = std::min(least, c.gap);
  EXPECT_NEAR(least, 0.02, 1e-12);
}

/// A coarse sheet falls fast on boxes below it: edges at their undersides are within reach, but it is not in them. Nor is it if it touches them from above.
TEST(DetectShapes, WhatIsAboveABoxIsNotInIt) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    BareSurface sheet(plain_grid_mesh(3, 3), 0.02);
    const Vec3 half{random.uniform(0.03, 0.3), random.uniform(0.03, 0.3), random.uniform(0.03, 0.3)};
    RigidShape box = shape_of(box_part({}, half)),
               mesh = shape_of(mesh_part(testing_support::prepared(testing_support::box_mesh(half))));
    for (RigidShape* shape : {&box, &mesh}) {
      shape->axes = testing_support::random_rotation(random);
      double high = 0;
      for (int k = 0; k < 3; ++k) high += std::fabs(shape->axes.c[static_cast<std::size_t>(k)].z) * half[k];
      const double gap = seed % 2 == 0 ? 0.001 : random.uniform(0.001, 0.05);
      shape->position = {random.uniform(0.2, 0.8), random.uniform(0.2, 0.8), -0.02 - gap - high};
      sheet.rest();
      sheet.move({0, 0, -random.uniform(0.02, 0.5)});
      Detection d;
      d.run(sheet, std::span(shape, 1));
      expect_consistent(sheet, d.contacts);
      for (const Contact& c : d.contacts) {
        EXPECT_GE(c.gap, 0) << seed;
        EXPECT_GT(c.normal.z, -0.1) << seed;
      }
    }
  }
}

// Between two faces of a crease a ball comes down on the farther one within a step, so that is a contact before it touches; nearest faces that took
// turns once let it sink in by more than the half thickness.
TEST(DetectShapes, ABallInACreaseMeetsBothFaces) {
  for (const double degrees : {30.0, 40.0, 50.0, 58.0}) {
    BareSurface crease(plain_grid_mesh(2, 1), 0.02);
    const double slope = std::tan(0.5 * degrees * 3.14159265358979323846 / 180);
    crease.deform([&](Vec3 p) { return Vec3{p.x, p.y, slope * std::fabs(p.x - 0.5)}; });
    const double flat = 1 / std::sqrt(1 + slope * slope);
    RigidShape ball = shape_of(sphere_part({}, 0.12));
    // On the bisector it touches both at this height; a little to one side it is nearer to one.
    for (const double aside : {0.0, 0.001}) {
      ball.position = {0.5 + aside, 0.45, (0.12 + 0.02 + 0.001) / flat};
      Detection d;
      d.run(crease, std::span(&ball, 1));
      bool left = false, right = false;
      for (const Contact& c : d.contacts) {
        if (!c.a.vertex[2].valid()) continue;
        left = left || c.normal.x < -0.5 * slope * flat;
        right = right || c.normal.x > 0.5 * slope * flat;
      }
      EXPECT_TRUE(left && right) << degrees << " degrees, " << aside << " m to one side";
    }
  }
}

// A body that lies round a ball lies against it with many faces at once; three of them were contacts, others in turn from step to step, and the ball was in the rest by a fifth
// of the half thickness for good.
TEST(DetectShapes, ABallThatABodyLiesRoundTouchesEveryFace) {
  const double r = 0.01, kBall = 0.11;
  int deep = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    BareSurface sheet(plain_grid_mesh(6, 6, 0.3, 0.3), r);
    // Rolled onto a ball that is a little larger or smaller, with bumps: some faces are in the ball, some out of it.
    const double radius = kBall + r * random.uniform(0.9, 1.1);
    const Vec3 middle{random.uniform(0.12, 0.18), random.uniform(0.12, 0.18), 0};
    sheet.deform([&](Vec3 p) {
      const Vec3 d{p.x - middle.x, p.y - middle.y, 0};
      const double angle = norm(d) / radius, high = radius + r * random.uniform(-0.1, 0.1);
      return high * (std::sin(angle) * normalized(d) + Vec3{0, 0, std::cos(angle)});
    });
    const RigidShape ball = shape_of(sphere_part({}, kBall));
    Detection d;
    for (int call = 0; call < 2; ++call) {  // with and without memory
      d.run(sheet, std::span(&ball, 1));
      expect_consistent(sheet, d.contacts);
      for (const CollisionTriangle f : ids<CollisionTriangle>(sheet.surface.face_count())) {
        const auto v = sheet.surface.vertices(f);
        const std::array<Vec3, 3> corner{sheet.position[v[0].index()], sheet.position[v[1].index()],
                                         sheet.position[v[2].index()]};
        const Vec3 normal = normalized(cross(corner[1] - corner[0], corner[2] - corner[0]));
        const std::array<double, 3> w = nearest_foot({}, corner).weights();
        if (w[0] == 0 || w[1] == 0 || w[2] == 0) continue;
        Vec3 offset;
        for (std::size_t i = 0; i < 3; ++i) offset += w[i] * sheet.offset[v[i].index()];
        const double gap = std::fabs(dot(normal, corner[0])) - kBall - std::fabs(dot(normal, offset));
        if (gap > -0.01 * r) continue;
        ++deep;
        EXPECT_TRUE(std::any_of(d.contacts.begin(), d.contacts.end(),
                                [&](const Contact& c) {
                                  return c.a.vertex == v && std::fabs(c.gap - gap) < 1e-12 &&
                                         dot(c.normal, corner[0]) > 0;
                                }))
            << "seed " << seed << " face " << f.value << " gap " << gap;
      }
    }
  }
  EXPECT_GT(deep, 500);
}

// A body that is not as thick everywhere, or leans, is nearest to a ball elsewhere than over the foot on its mid-surface. A ball that was pressed into a strip was in it by 0.15 half
// thicknesses beside that foot, and soft mats that hung over a ball by 0.04 to 0.07 at rest.
TEST(DetectShapes, ABallTouchesFacesWhereTheirSidesComeNearest) {
  const double r = 0.01, kBall = 0.11;
  int deep = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    BareSurface sheet(plain_grid_mesh(6, 6, 0.3, 0.3), r);
    const Vec3 middle{random.uniform(0.12, 0.18), random.uniform(0.12, 0.18), 0};
    sheet.deform([&](Vec3 p) {
      const Vec3 d{p.x - middle.x, p.y - middle.y, 0};
      const double angle = norm(d) / kBall, high = kBall + 0.6 * r;
      return high * (std::sin(angle) * normalized(d) + Vec3{0, 0, std::cos(angle)});
    });
    for (Vec3& o : sheet.offset)
      o = random.uniform(0.2, 1) * (o + random.uniform(0, 0.6) * testing_support::random_vector(random, r));
    const RigidShape ball = shape_of(sphere_part({}, kBall));
    Detection d;
    d.run(sheet, std::span(&ball, 1));
    expect_consistent(sheet, d.contacts);
    for (const CollisionTriangle f : ids<CollisionTriangle>(sheet.surface.face_count())) {
      const auto v = sheet.surface.vertices(f);
      const auto corner = [&](std::size_t i) { return sheet.position[v[i].index()] - sheet.offset[v[i].index()]; };
      const std::array<double, 3> w = nearest_foot({}, {corner(0), corner(1), corner(2)}).weights();
      if (w[0] == 0 || w[1] == 0 || w[2] == 0) continue;
      const double gap = norm(w[0] * corner(0) + w[1] * corner(1) + w[2] * corner(2)) - kBall;
      if (gap > -0.01 * r) continue;
      ++deep;
      EXPECT_TRUE(std::any_of(
          d.contacts.begin(), d.contacts.end(),
          [&](const Contact& c) { return c.a.vertex == v && c.a.lift == -1 && std::fabs(c.gap - gap) < 1e-12; }))
          << "seed " << seed << " face " << f.value << " gap " << gap;
    }
  }
  EXPECT_GT(deep, 300);
}

// A soft body hangs over the corner of a box by one vertex, which has been crushed there, as a tent over its pole. A moment later the corner has come out of the tent by a little, and
// the nearest place of all faces is that vertex. Its own contact says nothing of where the faces lie: without theirs it slid off, and the corner went in between them.
TEST(DetectShapes, ACornerThatHasCrushedAVertexStillPressesOnTheFacesRoundIt) {
  const double r = 0.01;
  BareSurface sheet(plain_grid_mesh(2, 2, 0.2, 0.2), r);
  const auto middle =
      static_cast<std::size_t>(std::min_element(sheet.position.begin(), sheet.position.end(),
                                                [](Vec3 a, Vec3 b) {
                                                  return norm(a - Vec3{0.1, 0.1, 0}) < norm(b - Vec3{0.1, 0.1, 0});
                                                }) -
                               sheet.position.begin());
  const auto hang = [&](double apex) {
    sheet.deform([&](Vec3 p) {
      return norm(p - Vec3{0.1, 0.1, 0}) < 1e-9 ? Vec3{0.1, 0.1, apex} : Vec3{p.x, p.y, -0.06 - 0.1 * p.x - 0.2 * p.y};
    });
    sheet.offset[middle] = 0.05 * sheet.offset[middle];
  };
  RigidShape box = shape_of(box_part({}, {0.2, 0.2, 0.2}));
  const Vec3 diagonal = normalized(Vec3{1, 1, 1}), across = cross(diagonal, {0, 0, 1});
  box.axes = turn(std::acos(diagonal.z) / norm(across) * across);
  box.position = Vec3{0.1, 0.1, 0} - box.axes * Vec3{0.2, 0.2, 0.2};
  Detection d;
  hang(0.02 * r);
  d.run(sheet, std::span(&box, 1));
  expect_consistent(sheet, d.contacts);
  // Of the corner with three faces, at that vertex.
  const auto pressing = [&] {
    return std::count_if(d.contacts.begin(), d.contacts.end(), [&](const Contact& c) {
      return norm(c.point - Vec3{0.1, 0.1, 0}) < 1e-12 && norm(sheet.point(c.a) - sheet.position[middle]) < 0.1 * r;
    });
  };
  EXPECT_GE(pressing(), 3);
  for (int call = 0; call < 2; ++call) {  // and it goes on to
    hang(-0.02 * r);
    d.run(sheet, std::span(&box, 1));
    expect_consistent(sheet, d.contacts);
    EXPECT_GE(pressing(), 3);
  }
}

// A blade that stands in a sheet, thin to one side of the sheet's edge: that has not come in over
// the end of the blade, which is farther off than anything moves in a step.
TEST(DetectShapes, WhatIsInAThinPlateHasNotComeInOverItsEnd) {
  for (const double deep : {0.012, 0.016, 0.02}) {
    BareSurface sheet(plain_grid_mesh(2, 2), 0.02);
    // Nearly upright, its upper end `deep` above the sheet, across the sheet's edges along x.
    RigidShape plate = shape_of(box_part({}, {0.004, 0.15, 0.3}));
    plate.axes = turn({0, 0.02, 0});
    plate.position = Vec3{0.3, 0.5, deep} - 0.3 * plate.axes.c[2];
    Detection d;
    d.run(sheet, std::span(&plate, 1));
    for (const Contact& c : d.contacts) EXPECT_GT(c.gap, -0.02) << deep << ", " << c.normal.z;
  }
}

/// A sheet folded at random: smooth waves of all directions.
BareSurface folded_sheet(Random& random, int grid, double radius) {
  BareSurface sheet(plain_grid_mesh(grid, grid), radius);
  const Vec3 k = testing_support::random_vector(random, 8), l = testing_support::random_vector(random, 8);
  const double high = random.uniform(0, 0.15);
  sheet.deform([&](Vec3 p) {
    return p + Vec3{0.3 * high * std::cos(dot(l, p)), 0.3 * high * std::sin(dot(k, p)),
                    high * std::sin(dot(k, p)) + high * std::cos(dot(l, p))};
  });
  return sheet;
}

// Every vertex against every part, by brute force: who is near has a contact with that distance, nobody else.
TEST(DetectShapes, VerticesEqualBruteForce) {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    BareSurface sheet = folded_sheet(random, 10, 0.02);
    const Vec3 place{random.uniform(0, 1), random.uniform(0, 1), random.uniform(-0.2, 0.2)};
    auto shapes = testing_support::one_of_each(random, place, 0.15);
    Detection d;
    d.run(sheet, shapes);
    expect_consistent(sheet, d.contacts);
    const double margin = 0.2 * 0.02;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      for (std::size_t v = 0; v < sheet.position.size(); ++v) {
        const Vec3 x = sheet.position[v];
        const double distance = testing_support::brute_distance(shapes[i], shapes[i].parts[0], x);
        const Contact* found = nullptr;
        for (const Contact& c : d.contacts)
          if (c.obstacle == static_cast<int>(i) && c.a.vertex[0] == CollisionVertex(v) && !c.a.vertex[1].valid() &&
              (found == nullptr || c.gap < found->gap))
            found = &c;
        if (found == nullptr) {
          // Out of reach outside, or in the depth of a mesh, where only what is near the surface is known.
          if (distance < 0) {
            EXPECT_TRUE(shapes[i].parts[0].kind == PartKind::kMesh && distance < -0.02) << i;
            continue;
          }
          // The gap is at least the distance less the radius, and the margin was not reached with the true normal.
          Proximity p;
          const PlacedPart part = place_part(shapes[i]);
          ASSERT_TRUE(closest_on_part(part, x, HUGE_VAL, p));
          EXPECT_NEAR(p.distance, distance, 1e-9);
          EXPECT_GE(p.distance - std::fabs(dot(p.normal, sheet.offset[v])), margin - 1e-12) << i;
          continue;
        }
        ++compared;
        EXPECT_NEAR(dot(x - found->point, found->normal), distance, 1e-9) << "shape " << i << " vertex " << v;
        EXPECT_NEAR(found->gap, distance - std::fabs(dot(found->normal, sheet.offset[v])), 1e-9);
      }
    }
  }
  EXPECT_GT(compared, 500);
}

// What pokes into a sheet between its vertices is found, as deep as it is.
TEST(DetectShapes, CoarseTrianglesMissNothing) {
  const double r = 0.03;
  int deep = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    Random random(seed);
    BareSurface sheet(plain_grid_mesh(4, 4), r);
    const auto triangles = testing_support::triangles_of(sheet.surface);
    const double size = random.uniform(0.02, 0.1);
    auto shapes = testing_support::one_of_each(random, {random.uniform(0.2, 0.8), random.uniform(0.2, 0.8), 0}, size);
    for (std::size_t i = 1; i < shapes.size(); ++i) {
      // Lowered onto the sheet until a tenth of the radius is in it.
      const auto depth_at = [&](double z, int n) {
        shapes[i].position.z = z;
        return testing_support::deepest_in_shape({sheet.position, sheet.offset, triangles}, shapes[i], n);
      };
      double low = 0, high = 0.5;
      for (int k = 0; k < 12; ++k) (depth_at(0.5 * (low + high), 8) > 0 ? low : high) = 0.5 * (low + high);
      const double depth = depth_at(high - 0.1 * r, 24);
      const std::vector<RigidShape> one{shapes[i]};
      Detection d;
      d.run(sheet, one);
      expect_consistent(sheet, d.contacts);
      double least = 0;
      for (const Contact& c : d.contacts) least = std::min(least, c.gap);
      if (depth < 0.05 * r) continue;
      ++deep;
      EXPECT_LT(least, -0.9 * depth) << "seed " << seed << " shape " << i << " depth " << depth;
    }
  }
  EXPECT_GT(deep, 100);
}

}  // namespace
}  // namespace kerf::detect_shapes_test
