// Thin bodies that fall on shapes and stay lying on them, looked at from outside: how deep their faces are in what they lie on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "kerf/scene/scene_shapes.h"
#include "kerf/session/session.h"
#include "session/session_measures.h"
#include "support/contact_checker.h"

namespace kerf::lying_on_shapes_test {
namespace {

using test::make;

/// Parts of the half thickness.
double deepest_in(Session& session, std::span<const RigidShape> shapes) {
  const test::SurfaceNow now = test::surface_now(session);
  const auto triangles = testing_support::triangles_of(now.surface);
  double deepest = 0;
  for (const RigidShape& shape : shapes)
    deepest = std::max(deepest, testing_support::deepest_in_shape({now.positions, now.offsets, triangles}, shape, 8));
  return deepest / now.surface.largest_radius;
}

Scene strip_falls(double dt, double young) {
  Scene scene;
  scene.body.model = "strip";
  scene.body.options.visual_triangles = 1000;
  scene.simulation.time_step = dt;
  scene.material.young = young;
  scene.material.damping_mass = 2;
  return scene;
}

SceneObstacle ball(Vec3 position, double radius) {
  SceneObstacle o;
  o.shape = SceneShape::kSphere;
  o.position = position;
  o.radius = radius;
  return o;
}

struct Fall {
  const char* what;
  std::vector<SceneObstacle> obstacles;
};

std::vector<Fall> falls() {
  SceneObstacle capsule;
  capsule.shape = SceneShape::kCapsule;
  capsule.position = {0.002, 0.003, -0.012};
  capsule.rotation = {0.4, 1.3, 0.2};
  capsule.radius = 0.006;
  capsule.length = 0.02;
  SceneObstacle box;
  box.shape = SceneShape::kBox;
  box.position = {-0.003, 0.002, -0.02};
  box.rotation = {0.5, 0.7, 0.1};
  box.size = {0.02, 0.025, 0.015};
  return {{"a ball", {ball({0.002, -0.001, -0.02}, 0.0165)}},
          {"two balls", {ball({-0.006, 0.003, -0.02}, 0.0165), ball({0.02, -0.002, -0.02}, 0.0119)}},
          {"a capsule", {capsule}},
          {"a box", {box}}};
}

// They come at 0.5 m/s, 5 half thicknesses in a step of 16.7 ms. Balls were in the strip by 0.2 to 0.6 half thicknesses then, and by 0.02 to 0.5 for good.
TEST(LyingOnShapes, OfAnyKindNothingSinksIn) {
  for (const Fall& fall : falls())
    for (const double dt : {0.005, 0.0167})
      for (const double young : {2e4, 1e5}) {
        Scene scene = strip_falls(dt, young);
        scene.obstacles = fall.obstacles;
        scene.obstacles.emplace_back().position = {0, 0, -0.06};
        std::vector<std::string> notes;
        const auto shapes = load_scene_shapes(scene, notes);
        ASSERT_TRUE(shapes.ok());
        Session session = make(scene);
        double falling = 0;
        const int steps = static_cast<int>(0.8 / dt);
        for (int i = 0; i < steps; ++i) {
          ASSERT_TRUE(session.step().ok());
          if (i * dt < 0.3) falling = std::max(falling, deepest_in(session, shapes->obstacles));
        }
        EXPECT_LT(falling, dt > 0.01 ? 0.15 : 0.05) << fall.what << " " << dt << " " << young;
        EXPECT_LT(deepest_in(session, shapes->obstacles), 0.02) << fall.what << " " << dt << " " << young;
      }
}

// A strip that lies on a floor was expected to fall out of the way of what comes down on it, at less than a step's weight makes it: the ball was in it by 0.6 half thicknesses, and nothing said so.
TEST(LyingOnShapes, WhatComesDownOnThemIsSeenComing) {
  for (const double dt : {0.005, 0.0167})
    for (const double speed : {0.05, 0.13, 0.3}) {
      Scene scene = strip_falls(dt, 2.7e5);
      scene.obstacles.emplace_back().position = {0, 0, -0.00152};
      SceneRigidTool& tool = scene.tools.emplace_back();
      tool.id = "ball";
      tool.kind = SceneToolKind::kSphere;
      tool.radius = 0.0061;
      tool.position = {0.003, -0.004, 0.0198};
      tool.stiffness = 340;
      Session session = make(scene);
      SceneCommand command;
      const double down = 0.0068;
      command.what =
          SceneToolMotion{"ball", {{(tool.position.z - down) / speed, {tool.position.x, tool.position.y, down}, {}}}};
      ASSERT_TRUE(session.apply(command).ok());
      double deepest = 0;
      const double end = (tool.position.z - down) / speed + 0.2;
      for (int i = 0; i * dt < end; ++i) {
        ASSERT_TRUE(session.step().ok());
        RigidShape ball;
        ball.position = session.tools()[0].place.position;
        ball.axes = session.tools()[0].place.axes;
        ball.parts = tool_parts(tool, 1);
        deepest = std::max(deepest, deepest_in(session, std::span(&ball, 1)));
      }
      EXPECT_GT(norm(session.tools()[0].force), 0.1) << dt << " " << speed;
      EXPECT_LT(deepest, 0.05) << dt << " " << speed;
    }
}

// A mat as soft as jelly comes down on a corner of a box, which stretches and crushes it until it is all but nothing there. The corner went in by 3.2 half thicknesses for good.
TEST(LyingOnShapes, ACornerThatCrushesASoftMatDoesNotGoIn) {
  Scene scene;
  scene.body.model = "mat";
  scene.body.options.visual_triangles = 1000;
  scene.simulation.time_step = 0.0167;
  scene.material.young = 13588.6;
  scene.material.damping_mass = 2;
  scene.contact.friction = 0.0843;
  SceneObstacle& box = scene.obstacles.emplace_back();
  box.shape = SceneShape::kBox;
  box.position = {-0.011164, 0.014501, -0.034};
  box.rotation = {1.953823, -1.659079, 0.990451};
  box.size = {0.037402, 0.029933, 0.015674};
  scene.obstacles.emplace_back().position = {0, 0, -0.084};
  std::vector<std::string> notes;
  const auto shapes = load_scene_shapes(scene, notes);
  ASSERT_TRUE(shapes.ok());
  Session session = make(scene);
  for (int i = 0; i < 36; ++i) {
    ASSERT_TRUE(session.step().ok());
    EXPECT_LT(deepest_in(session, shapes->obstacles), 0.1) << i;
  }
  EXPECT_LT(deepest_in(session, shapes->obstacles), 0.05);
}

// Contacts give way by force over stiffness, and the load of all that lies above is a force: five soft strips lay 0.04 half thicknesses in each other, and of six every step was
// taken in four parts for that.
TEST(LyingOnShapes, APileIsHeldWhereItLies) {
  Scene scene = strip_falls(0.0167, 2e4);
  for (int i = 1; i < 5; ++i) {
    SceneBody& upper = scene.more_bodies.emplace_back(scene.body);
    upper.position = {0.003 * (i % 2), -0.002 * (i % 3), i * 0.0032};
    upper.rotation = {0, 0, 0.9 * i};
  }
  scene.obstacles.emplace_back().position = {0, 0, -0.0017};
  Session session = make(scene);
  SessionStep last;
  for (int i = 0; i < 60; ++i) {
    auto step = session.step();
    ASSERT_TRUE(step.ok());
    last = *step;
  }
  EXPECT_EQ(last.parts, 1);
  EXPECT_LT(last.mechanics.deepest_overlap, 0.02 * 0.0015);
  EXPECT_GT(last.mechanics.pressing, 200);
}

}  // namespace
}  // namespace kerf::lying_on_shapes_test
