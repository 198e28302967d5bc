// Bodies against rigid shapes.
#include <gtest/gtest.h>

#include <cmath>

#include "contact/bare_surface.h"

namespace kerf {
namespace {

using testing_support::BareSurface;
using testing_support::plain_grid_mesh;

RigidShape shape_of(ShapePart part) {
  RigidShape s;
  s.parts.push_back(std::move(part));
  s.friction = 0.3;
  return s;
}

struct Detection {
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  DetectReport run(const BareSurface& body, std::span<const RigidShape> obstacles, std::span<const RigidShape> tools = {},
                   const DetectOptions& options = {}) {
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
    if (i > 0) { EXPECT_LT(contacts[i - 1].key, c.key); }
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

}  // namespace
}  // namespace kerf
