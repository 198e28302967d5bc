#include "kerf/session/scene_lattice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kerf/binding/collision_mesh_build.h"

namespace kerf {
namespace {

using ::testing::HasSubstr;

/// The collision mesh of the 1 x 1 x 0.1 m sheet.
CollisionMesh sheet(std::optional<LatticeHint>* hint = nullptr) {
  const Result<Model> model = make_model("sheet", {});
  EXPECT_TRUE(model.ok());
  if (hint) *hint = model->lattice;
  const std::vector<double> half(model->collision.positions.size(), 0.05);
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

}  // namespace
}  // namespace kerf
