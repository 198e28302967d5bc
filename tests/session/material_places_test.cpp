// Places of the material, from rest to now and back.
#include "kerf/session/material_places.h"

#include <gtest/gtest.h>

#include <random>

#include "session/make_session.h"

namespace kerf::material_places_test {
namespace {

using test::make;

/// The sheet of 1 x 1 x 0.1 m, held along two sides where asked for.
Scene sheet(bool held) {
  Scene scene;
  scene.body.model = "sheet";
  scene.simulation.time_step = 0.005;
  scene.material.damping_mass = 0;
  for (const double side : {-1.0, 1.0}) {
    if (!held) break;
    SceneFix fix;
    fix.region.shape = SceneRegion::Shape::kHalfSpace;
    fix.region.point = {0.45 * side, 0, 0};
    fix.region.normal = {side, 0, 0};
    scene.fixes.push_back(fix);
  }
  return scene;
}

std::vector<Vec3> random_places(std::size_t count, double half, double thick) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> flat(-half, half), across(-thick, thick);
  std::vector<Vec3> places;
  for (std::size_t i = 0; i < count; ++i) places.push_back({flat(random), flat(random), across(random)});
  return places;
}

TEST(MaterialPlaces, AtRestAreThemselves) {
  Session session = make(sheet(true));
  const std::vector<Vec3> rest = random_places(200, 0.5, 0.2);
  const std::vector<Vec3> now = places_now(session, rest);
  for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_LT(norm(now[i] - rest[i]), 1e-12);
}

TEST(MaterialPlaces, FallWithTheBody) {
  Session session = make(sheet(false));
  ASSERT_TRUE(session.step(20).ok());
  // The sum of speeds g h, 2 g h, ... over steps of h.
  const double h = 0.005, fallen = 9.81 * h * h * 20 * 21 / 2;
  const std::vector<Vec3> rest = random_places(50, 0.5, 0.2);
  const std::vector<Vec3> now = places_now(session, rest);
  for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_LT(norm(now[i] - rest[i] - Vec3{0, 0, -fallen}), 1e-6);
  for (const MiddlePlace& place : places_at_rest(session, now)) EXPECT_LT(place.distance, 0.2 + 1e-6);
}

TEST(MaterialPlaces, OfVerticesAreWhereTheyAreDrawn) {
  Session session = make(sheet(true));
  ASSERT_TRUE(session.step(100).ok());
  const std::vector<Vec3>& rest = session.body().complex.visual.rest.raw();
  const std::vector<Vec3> now = places_now(session, rest), drawn = session.visual_positions();
  double sagged = 0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    EXPECT_LT(norm(now[i] - drawn[i]), 1e-9) << i;
    sagged = std::max(sagged, norm(drawn[i] - rest[i]));
  }
  EXPECT_GT(sagged, 0.01);
}

TEST(MaterialPlaces, GoThereAndBack) {
  Session session = make(sheet(true));
  ASSERT_TRUE(session.step(100).ok());
  const std::vector<Vec3> rest = random_places(200, 0.49, 0);
  const std::vector<MiddlePlace> back = places_at_rest(session, places_now(session, rest));
  for (std::size_t i = 0; i < rest.size(); ++i) {
    // The middle surface is flat between its vertices, the material is not.
    EXPECT_LT(back[i].distance, 5e-3);
    EXPECT_LT(norm(back[i].rest - rest[i]), 5e-3);
  }
}

TEST(MaterialPlaces, BesideACutGoWithTheirOwnLip) {
  Session session = make(sheet(true));
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (const double y : {-0.6, 0.6}) ASSERT_TRUE(session.move_blade({0.013, y, 0.2}, {0.013, y, -0.2}).ok());
  ASSERT_TRUE(session.end_stroke().ok());
  ASSERT_EQ(session.counts().pieces, 2);
  ASSERT_TRUE(session.step(40).ok());
  // Held at its outer side each half hangs down at the cut, so the lips turn away from each other below.
  const std::vector<Vec3> rest = {{0.012, 0.1, 0}, {0.014, 0.1, 0}};
  const std::vector<Vec3> now = places_now(session, rest);
  EXPECT_LT(now[0].z, -0.05);
  EXPECT_LT(now[1].z, -0.05);
  const std::vector<MiddlePlace> back = places_at_rest(session, now);
  EXPECT_LT(back[0].rest.x, 0.013);
  EXPECT_GT(back[1].rest.x, 0.013);
}

TEST(MaterialPlaces, OfNothingAreNone) {
  Session session = make(sheet(true));
  EXPECT_TRUE(places_now(session, {}).empty());
  EXPECT_TRUE(places_at_rest(session, {}).empty());
}

}  // namespace
}  // namespace kerf::material_places_test
