// Degenerate and extreme input, repeatability, and memory in steady state.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "contact/bare_surface.h"
#include "contact/shapes_for_tests.h"
#include "kerf/base/parallel.h"
#include "support/counted_new.h"

namespace kerf::robustness_test {
namespace {

using testing_support::BareSurface;
using testing_support::plain_grid_mesh;

void expect_sane(const std::vector<Contact>& contacts) {
  for (const Contact& c : contacts) {
    EXPECT_NEAR(norm(c.normal), 1, 1e-6);
    EXPECT_TRUE(std::isfinite(c.gap));
    EXPECT_TRUE(is_finite(c.point));
    EXPECT_TRUE(is_finite(c.other_velocity));
    double sum = 0;
    for (const double w : c.a.weight) sum += w;
    EXPECT_NEAR(sum, 1, 1e-9);
  }
}

TEST(Robustness, SizesFromTinyToHuge) {
  for (const double scale : {1e-9, 1e-3, 1.0, 1e6, 1e12}) {
    Random random(7);
    TriangleMesh mesh = plain_grid_mesh(8, 8, scale, scale);
    BareSurface sheet(mesh, 0.03 * scale);
    sheet.deform([&](Vec3 p) { return p + Vec3{0, 0, 0.1 * scale * std::sin(9 * p.x / scale)}; });
    auto shapes = testing_support::one_of_each(random, {0.5 * scale, 0.5 * scale, 0.1 * scale}, 0.2 * scale);
    const SurfaceState state = sheet.state();
    DetectMemory memory;
    DetectWorkspace workspace;
    std::vector<Contact> contacts;
    detect(std::span(&state, 1), shapes, {}, {}, memory, workspace, contacts);
    EXPECT_GT(contacts.size(), 20u) << scale;
    expect_sane(contacts);
  }
}

/// A body bent over itself that flies apart at this speed, met by a shape of each kind.
void flies_apart(double at, double way, DetectReport& report, std::vector<Contact>& contacts) {
  Random random(3);
  BareSurface sheet(plain_grid_mesh(10, 6), 0.03);
  sheet.deform([&](Vec3 p) { return Vec3{at + std::cos(4 * p.x), p.y, std::sin(4 * p.x)}; });
  for (Vec3& p : sheet.predicted) p += way * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
  const auto shapes = testing_support::one_of_each(random, {at, 0.5, 0}, 0.2);
  const SurfaceState state = sheet.state();
  DetectMemory memory;
  DetectWorkspace workspace;
  report = detect(std::span(&state, 1), shapes, {}, {}, memory, workspace, contacts);
}

TEST(Robustness, WhatFliesApartOrIsFarAwayIsFoundOrRefused) {
  for (const double way : {1e3, 1e6, 1e9, 1e12, 1e15, 1e17, 1e18, 1e20, 1e40, 1e300, double{HUGE_VAL}, std::nan("")})
    for (const bool far : {false, true}) {
      DetectReport report;
      std::vector<Contact> contacts(1);
      flies_apart(far ? way : 0, far ? 0 : way, report, contacts);
      EXPECT_EQ(report.out_of_range, !(way <= kFarthest)) << way;
      EXPECT_TRUE(contacts.empty() || !report.out_of_range) << way;
      EXPECT_TRUE(contacts.size() > 100 || far || !(way <= 1e12)) << way;
      expect_sane(contacts);
    }
}

TEST(Robustness, ShapesThatAreTooFastAreRefused) {
  BareSurface sheet(plain_grid_mesh(4, 4), 0.03);
  const SurfaceState state = sheet.state();
  for (const double speed : {1e6, 1e30, double{HUGE_VAL}, std::nan("")}) {
    RigidShape shape = testing_support::shape_of(sphere_part({0.5, 0.5, 0}, 0.1));
    shape.velocity = {0, 0, speed};
    DetectMemory memory;
    DetectWorkspace workspace;
    std::vector<Contact> contacts;
    const DetectReport report = detect(std::span(&state, 1), std::span(&shape, 1), {}, {}, memory, workspace, contacts);
    EXPECT_EQ(report.out_of_range, !(speed < 1e10)) << speed;
    EXPECT_EQ(contacts.empty(), report.out_of_range) << speed;
  }
}

TEST(Robustness, WhateverCoincidesGivesUnitNormals) {
  for (const double r : {0.0, 0.05}) {
    BareSurface sheet(plain_grid_mesh(4, 4), r);
    std::vector<RigidShape> shapes;
    using testing_support::shape_of;
    shapes.push_back(shape_of(sphere_part({0.5, 0.5, 0}, 0)));  // on a vertex, no size
    shapes.push_back(shape_of(sphere_part({0.5, 0.5, 0}, 0.1)));
    shapes.push_back(shape_of(sphere_part({0.3, 0.4, 0}, 0.1)));                  // centre in the surface
    shapes.push_back(shape_of(capsule_part({0.5, 0.5, 0}, {0.5, 0.5, 0}, 0.1)));  // no length
    shapes.push_back(shape_of(capsule_part({0, 0.5, 0}, {1, 0.5, 0}, 0)));        // along edges
    shapes.push_back(shape_of(capsule_part({0.5, 0.1, -1}, {0.5, 0.1, 1}, 0.01)));
    shapes.push_back(shape_of(box_part({0.5, 0.5, 0}, {})));
    shapes.push_back(shape_of(box_part({0.5, 0.5, 0}, {0.25, 0.25, 0})));  // its edges on those of the mesh
    shapes.push_back(shape_of(plane_part({}, {0, 0, 1})));
    shapes.push_back(shape_of(mesh_part(testing_support::prepared(plain_grid_mesh(4, 4)))));  // the sheet itself
    TriangleMesh flat = plain_grid_mesh(2, 2);
    for (Vec3& p : flat.positions) p.y = 0.5;  // no area
    shapes.push_back(shape_of(mesh_part(testing_support::prepared(flat))));
    const SurfaceState state = sheet.state();
    DetectMemory memory;
    DetectWorkspace workspace;
    std::vector<Contact> contacts;
    for (int k = 0; k < 3; ++k) {  // with memory too
      detect(std::span(&state, 1), shapes, {}, {}, memory, workspace, contacts);
      expect_sane(contacts);
      EXPECT_GT(contacts.size(), 20u);
    }
  }
}

// Two bodies in one place, and an obstacle that is the body's own mid-surface: distances are nothing but rounding, and what was divided by them was no unit vector. The step refused it.
TEST(Robustness, WhatLiesInOneAnotherButForRounding) {
  Random random(5);
  TriangleMesh mesh = plain_grid_mesh(4, 4);
  for (Vec3& p : mesh.positions) p += Vec3{-0.5, -0.5, 0};
  const RigidShape shape = testing_support::shape_of(mesh_part(testing_support::prepared(mesh)));
  for (const double noise : {0.0, 1e-18, 1e-17, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-10}) {
    BareSurface sheet(mesh, 0.05), twin(mesh, 0.05);
    for (BareSurface* body : {&sheet, &twin}) {
      for (Vec3& p : body->position) p += testing_support::random_vector(random, noise);
      body->predicted = body->position;
    }
    const std::array<SurfaceState, 2> states{sheet.state(), twin.state()};
    DetectMemory memory;
    DetectWorkspace workspace;
    std::vector<Contact> contacts;
    for (int k = 0; k < 3; ++k) {
      detect(states, std::span(&shape, 1), {}, {}, memory, workspace, contacts);
      expect_sane(contacts);
      EXPECT_GT(contacts.size(), 20u) << noise;
      for (const Contact& c : contacts) EXPECT_NEAR(norm(c.normal), 1, 1e-9) << noise;
    }
  }
}

TEST(Robustness, CollapsedBodies) {
  BareSurface sheet(plain_grid_mesh(6, 6), 0.02);
  Random random(3);
  auto shapes = testing_support::one_of_each(random, {0, 0, 0.01}, 0.2);
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  for (int k = 0; k < 5; ++k) {
    for (std::size_t v = 0; v < sheet.position.size(); ++v) {
      const Vec3 p = sheet.surface.rest.raw()[v];
      sheet.position[v] = k == 0   ? Vec3{}
                          : k == 1 ? Vec3{p.x, 0, 0}
                          : k == 2 ? Vec3{std::floor(3 * p.x), p.y, 0}
                                   : 1e-200 * p;
      if (k == 4) sheet.offset[v] = {};
    }
    sheet.predicted = sheet.position;
    const SurfaceState state = sheet.state();
    detect(std::span(&state, 1), shapes, {}, {}, memory, workspace, contacts);
    expect_sane(contacts);
  }
}

TEST(Robustness, NoBodiesNoShapesNoTriangles) {
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  detect({}, {}, {}, {}, memory, workspace, contacts);
  EXPECT_TRUE(contacts.empty());
  const ContactSurface empty = make_contact_surface(CollisionMesh{});
  const SurfaceState state{&empty, {}, {}, {}};
  RigidShape nothing;
  detect(std::span(&state, 1), std::span(&nothing, 1), {}, {}, memory, workspace, contacts);
  EXPECT_TRUE(contacts.empty());
}

/// Everything at once, moving.
struct Scenery {
  BareSurface sheet{plain_grid_mesh(30, 30), 0.02};
  std::vector<RigidShape> shapes;
  Scenery() {
    Random random(11);
    shapes = testing_support::one_of_each(random, {0.5, 0.5, 0.1}, 0.2);
  }
  void at(int step) {
    const double t = 0.02 * step;
    sheet.deform([&](Vec3 p) {
      return Vec3{0.2 * std::cos(7 * p.x) * (1 + 0.25 * p.x), p.y,
                  0.2 * std::sin(7 * p.x) * (1 + 0.25 * p.x) + 0.02 * std::sin(9 * p.y + t)};
    });
    for (RigidShape& s : shapes) s.position.z = 0.1 + 0.01 * std::sin(t);
  }
};

TEST(Robustness, SameBitsWhateverTheThreads) {
  std::vector<std::vector<Contact>> runs;
  std::vector<DetectMemory> memories;
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    Scenery scenery;
    DetectMemory memory;
    DetectWorkspace workspace;
    std::vector<Contact> contacts;
    for (int k = 0; k < 5; ++k) {
      scenery.at(k);
      const SurfaceState state = scenery.sheet.state();
      detect(std::span(&state, 1), scenery.shapes, {}, {}, memory, workspace, contacts);
    }
    EXPECT_GT(contacts.size(), 500u);
    runs.push_back(contacts);
    memories.push_back(memory);
  }
  for (std::size_t i = 1; i < runs.size(); ++i) {
    ASSERT_EQ(runs[i].size(), runs[0].size());
    EXPECT_EQ(memories[i], memories[0]);
    for (std::size_t k = 0; k < runs[0].size(); ++k) {
      EXPECT_EQ(runs[i][k].key, runs[0][k].key);
      EXPECT_EQ(runs[i][k].gap, runs[0][k].gap);
      EXPECT_EQ(runs[i][k].normal, runs[0][k].normal);
    }
  }
}

TEST(Robustness, KeysStayWhileFeaturesTouch) {
  Scenery scenery;
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  std::vector<std::uint64_t> before;
  std::size_t kept = 0, all = 0;
  for (int k = 0; k < 10; ++k) {
    scenery.at(k);
    const SurfaceState state = scenery.sheet.state();
    detect(std::span(&state, 1), scenery.shapes, {}, {}, memory, workspace, contacts);
    std::vector<std::uint64_t> now, both;
    for (const Contact& c : contacts) now.push_back(c.key);
    std::set_intersection(before.begin(), before.end(), now.begin(), now.end(), std::back_inserter(both));
    kept += both.size();
    all += before.size();
    before = now;
  }
  EXPECT_GT(static_cast<double>(kept), 0.9 * static_cast<double>(all));
}

TEST(Robustness, SteadyStateAllocatesNothing) {
  Scenery scenery;
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  const auto once = [&] {
    const SurfaceState state = scenery.sheet.state();
    detect(std::span(&state, 1), scenery.shapes, {}, {}, memory, workspace, contacts);
  };
  for (int k = 0; k < 20; ++k) {
    scenery.at(k % 4);
    once();
  }
  for (int k = 0; k < 8; ++k) {
    scenery.at(k % 4);
    const long before = allocations.load();
    once();
    EXPECT_EQ(allocations.load() - before, 0);
  }
}

}  // namespace
}  // namespace kerf::robustness_test
