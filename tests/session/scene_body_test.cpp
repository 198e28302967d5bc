#include "kerf/session/scene_body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "kerf/binding/bound_body_file.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/mesh_file.h"

namespace kerf {
namespace {

using ::testing::HasSubstr;

class SceneBodyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("kerf_scene_body_test_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  void write_sheet() {
    const Result<Model> model = make_model("sheet", {});
    ASSERT_TRUE(model.ok());
    ASSERT_TRUE(write_obj(file("visual.obj"), model->visual).ok());
    ASSERT_TRUE(write_obj(file("collision.obj"), model->collision).ok());
    triangles_ = model->visual.triangles.size();
  }
  std::filesystem::path folder_;
  std::size_t triangles_ = 0;
};

TEST_F(SceneBodyTest, AModelBringsItsMaterialAndLattice) {
  SceneBody body;
  body.model = "sheet";
  const Result<SceneBodyLoaded> loaded = load_scene_body(body);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded->young, 5000);  // experiment 1: 5 kPa, 1 kg in 0.1 m3
  EXPECT_EQ(loaded->density, 10);
  ASSERT_TRUE(loaded->lattice.has_value());
  EXPECT_EQ(loaded->lattice->cells, (std::array<int, 3>{9, 9, 1}));
  EXPECT_TRUE(validate_binding(loaded->bound.complex).ok());
  // an open sheet takes its thickness from the model: offsets are half of 0.1 m
  EXPECT_NEAR(norm(loaded->bound.complex.collision.offset[CollisionVertex(0)]), 0.05, 1e-12);
}

TEST_F(SceneBodyTest, FilesAreScaledAndNeedAThickness) {
  write_sheet();
  SceneBody body;
  body.visual = file("visual.obj");
  body.collision = file("collision.obj");
  body.scale = 0.001;
  EXPECT_THAT(load_scene_body(body).error().message,
              HasSubstr("visual.obj is an open surface (192 of 10080 edges"));
  body.thickness = 0.0002;
  const Result<SceneBodyLoaded> loaded = load_scene_body(body);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_NEAR(loaded->bound.report.area_after, 1e-6, 1e-12);  // the sheet is 1 x 1 of its units
  EXPECT_NEAR(norm(loaded->bound.complex.collision.offset[CollisionVertex(0)]), 0.0001, 1e-12);
  EXPECT_EQ(loaded->young, kSceneYoung);
  EXPECT_FALSE(loaded->lattice.has_value());
}

TEST_F(SceneBodyTest, ABoundBodyComesBack) {
  SceneBody body;
  body.model = "sheet";
  const Result<SceneBodyLoaded> made = load_scene_body(body);
  ASSERT_TRUE(made.ok());
  ASSERT_TRUE(save_bound_body(made->bound, file("sheet.kerf")).ok());
  SceneBody again;
  again.bound = file("sheet.kerf");
  const Result<SceneBodyLoaded> loaded = load_scene_body(again);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded->bound.complex.visual.rest.raw(), made->bound.complex.visual.rest.raw());
}

TEST_F(SceneBodyTest, ErrorsNameTheFile) {
  write_sheet();
  SceneBody body;
  body.visual = file("visual.obj");
  body.collision = file("none.obj");
  body.thickness = 0.1;
  EXPECT_THAT(load_scene_body(body).error().message, HasSubstr("none.obj"));
  Result<Model> steak = make_model("steak", {});
  ASSERT_TRUE(steak.ok());
  ASSERT_TRUE(write_obj(file("closed.obj"), steak->visual).ok());
  body.collision = file("closed.obj");  // a mid-surface has a border
  EXPECT_THAT(load_scene_body(body).error().message, HasSubstr("closed.obj"));
  body = {};
  body.bound = file("visual.obj");
  EXPECT_THAT(load_scene_body(body).error().message, HasSubstr("visual.obj"));
}

}  // namespace
}  // namespace kerf
