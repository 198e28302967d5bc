#include "kerf/scene/scene_lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kerf/binding/collision_mesh_build.h"
#include "kerf/session/session.h"

namespace kerf::scene_lattice_test {
namespace {

using ::testing::HasSubstr;

/// The collision mesh of the 1 x 1 x 0.1 m sheet, or of a thinner one.
CollisionMesh sheet(std::optional<LatticeHint>* hint = nullptr, double half_thickness = 0.05) {
  const Result<Model> model = make_model("sheet", {});
  EXPECT_TRUE(model.ok());
  if (hint) *hint = model->lattice;
  const std::vector<double> half(model->collision.positions.size(), half_thickness);
  Result<CollisionMesh> mesh = build_collision_mesh(model->collision, half);
  EXPECT_TRUE(mesh.ok());
  return std::move(*mesh);
}

TEST(SceneLattice, TheModelsOwnLattice) {
  std::optional<LatticeHint> hint;
  const CollisionMesh mesh = sheet(&hint);
  const Result<LatticeFrame> frame = scene_lattice({}, hint, mesh);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->count, (LatticeIndex{9, 9, 1}));
  EXPECT_EQ(frame->origin, hint->origin);
}

/// The lattice of a model that was bent, got bumps or noise holds the body it became.
TEST(SceneLattice, AModelsOwnLatticeHoldsWhatBecameOfIt) {
  const auto deformed = [](const char* model, double bend, double bumps, double noise) {
    Scene scene;
    scene.name = scene.body.model = model;
    scene.body.options.bend = bend;
    scene.body.options.bumps = bumps;
    scene.body.options.noise = noise;
    return scene;
  };
  for (const Scene& scene :
       {deformed("meniscus", 0, 2.8e-5, 8.8e-5), deformed("sheet", -2, 0, 0), deformed("strip", -1.94, 1.2e-4, 9.7e-5),
        deformed("half-shell", 0, 3e-3, 0), deformed("two-holed-slab", -1.09, 1.4e-3, 0)}) {
    const auto session = Session::create(scene);
    EXPECT_TRUE(session.ok()) << scene.name << ": " << (session.ok() ? "" : session.error().message);
  }
}

TEST(SceneLattice, LayersAreChosenByTheBody) {
  std::optional<LatticeHint> hint;
  const CollisionMesh mesh = sheet(&hint);
  SceneLattice wanted;
  wanted.layers = 2;
  const Result<LatticeFrame> frame = scene_lattice(wanted, hint, mesh);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->count[2], 2);
  EXPECT_NEAR(frame->cell.z, 0.05, 1e-9);
}

TEST(SceneLattice, CellsDivideTheBodysBox) {
  SceneLattice wanted;
  wanted.cells = {{4, 8, 1}};
  const Result<LatticeFrame> frame = scene_lattice(wanted, std::nullopt, sheet());
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->count, (LatticeIndex{4, 8, 1}));
  EXPECT_NEAR(frame->cell.x, 0.25, 1e-12);
  EXPECT_NEAR(frame->cell.y, 0.125, 1e-12);
  EXPECT_NEAR(frame->cell.z, 0.1, 1e-12);
  EXPECT_NEAR(norm(frame->origin - Vec3{-0.5, -0.5, -0.05}), 0, 1e-12);
}

TEST(SceneLattice, CellSizePutsTheBodyInTheMiddle) {
  SceneLattice wanted;
  wanted.cell_size = Vec3{0.3, 0.5, 0.2};
  const double c = std::sqrt(0.5);
  wanted.axes = {{Vec3{c, c, 0}, Vec3{-c, c, 0}, Vec3{0, 0, 1}}};
  const Result<LatticeFrame> frame = scene_lattice(wanted, std::nullopt, sheet());
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->count, (LatticeIndex{5, 3, 1}));               // the diagonal is 1.414 m long
  EXPECT_NEAR(norm(frame->to_world({2.5, 1.5, 0.5})), 0, 1e-12);  // the sheet's middle
}

TEST(SceneLattice, AGivenLatticeMustHoldTheBody) {
  SceneLattice wanted;
  wanted.cell_size = Vec3{0.2, 0.2, 0.2};
  wanted.cells = {{6, 6, 1}};
  wanted.origin = Vec3{-0.6, -0.6, -0.1};
  const CollisionMesh mesh = sheet();
  Result<LatticeFrame> frame = scene_lattice(wanted, std::nullopt, mesh);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  EXPECT_EQ(frame->origin, *wanted.origin);
  EXPECT_EQ(frame->cell, *wanted.cell_size);
  wanted.origin = Vec3{-0.4, -0.6, -0.1};
  frame = scene_lattice(wanted, std::nullopt, mesh);
  ASSERT_FALSE(frame.ok());
  EXPECT_THAT(frame.error().message, HasSubstr("sticks out"));
}

/// Far larger cells lose the prisms of the body: each is less than counts as being in a cell.
TEST(SceneLattice, CellsFarLargerThanTheBodyAreRefused) {
  SceneLattice wanted;
  const CollisionMesh mesh = sheet();
  const auto error_with = [&](double size) {
    wanted.cell_size = Vec3{size, size, size};
    const Result<LatticeFrame> frame = scene_lattice(wanted, std::nullopt, mesh);
    return frame.ok() ? std::string() : frame.error().message;
  };
  EXPECT_EQ(error_with(4), "");
  for (const double size : {10.0, 1e3, 1e9}) {
    EXPECT_THAT(error_with(size), HasSubstr("[lattice]: cell_size makes cells"));
    EXPECT_THAT(error_with(size), HasSubstr("the body is 1 x 1 x 0.1 m"));
  }
  wanted.cells = {{1, 1, 1}};
  wanted.origin = Vec3{-500, -500, -500};
  EXPECT_THAT(error_with(1e3), HasSubstr("no larger than the body"));
  Scene scene;
  scene.file = "a.toml";
  scene.body.model = "sheet";
  scene.lattice.line = 3;
  scene.lattice.cell_size = Vec3{1e3, 1e3, 1e3};
  const auto session = Session::create(scene);
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().message.find("a.toml:3: [lattice]: cell_size"), 0U) << session.error().message;

  SceneLattice one;  // a cell around a thin sheet that lies aslant in it
  one.cells = {{1, 1, 1}};
  const double half = std::sqrt(0.5);
  one.axes = {{Vec3{1, 0, 0}, Vec3{0, half, half}, Vec3{0, -half, half}}};
  const Result<LatticeFrame> frame = scene_lattice(one, std::nullopt, sheet(nullptr, 1e-4));
  ASSERT_FALSE(frame.ok());
  EXPECT_THAT(frame.error().message, HasSubstr("[lattice]: cells makes cells"));
  EXPECT_THAT(frame.error().message, HasSubstr("ask for more cells"));
}

}  // namespace
}  // namespace kerf::scene_lattice_test
