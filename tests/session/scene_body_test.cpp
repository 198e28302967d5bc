#include "kerf/scene/scene_body.h"
#include "kerf/session/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "kerf/binding/bound_body_file.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/scene_file.h"

namespace kerf::scene_body_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class SceneBodyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("kerf_scene_body_test_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
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

TEST_F(SceneBodyTest, WhatIsWrongWithAFileNamesTheScenesLineToo) {
  write_sheet();
  const auto error_of = [&](const std::string& keys) {
    const auto scene = parse_scene("[body]\nvisual = \"visual.obj\"\n" + keys, "scene.toml", folder_);
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    const auto session = Session::create(*scene);
    return session.ok() ? "no error" : session.error().message;
  };
  const std::string place = "scene.toml:2: " + file("visual.obj");
  EXPECT_THAT(error_of("thickness = 1e9\n"), StartsWith(place + ": thickness is 1e+09 m, but the surface is 1.41 m"));
  EXPECT_THAT(error_of("thickness = 0.1\nscale = 1e300\n"), StartsWith(place + ", scaled by 1e+300: the surface is"));
  EXPECT_THAT(error_of(""), StartsWith(place + " is an open surface"));
}

TEST_F(SceneBodyTest, FilesAreScaledAndNeedAThickness) {
  write_sheet();
  SceneBody body;
  body.visual = file("visual.obj");
  body.collision = file("collision.obj");
  body.scale = 0.001;
  EXPECT_THAT(load_scene_body(body).error().message, HasSubstr("visual.obj is an open surface (192 of 10080 edges"));
  body.thickness = 0.0002;
  const Result<SceneBodyLoaded> loaded = load_scene_body(body);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_NEAR(loaded->bound.report.area_after, 1e-6, 1e-12);  // the sheet is 1 x 1 of its units
  EXPECT_NEAR(norm(loaded->bound.complex.collision.offset[CollisionVertex(0)]), 0.0001, 1e-12);
  EXPECT_EQ(loaded->young, kSceneYoung);
  EXPECT_FALSE(loaded->lattice.has_value());
}

// What is drawn finely gets a collision mesh of its own; what is coarse is one.
TEST_F(SceneBodyTest, AnOpenMeshAloneIsEnough) {
  write_sheet();
  SceneBody body;
  body.visual = file("visual.obj");
  body.thickness = 0.2;
  Result<SceneBodyLoaded> loaded = load_scene_body(body);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_NEAR(static_cast<double>(loaded->bound.complex.collision.face_count()), 160, 30);
  EXPECT_TRUE(validate_binding(loaded->bound.complex).ok());
  body.collision_triangles = 400;
  loaded = load_scene_body(body);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_NEAR(static_cast<double>(loaded->bound.complex.collision.face_count()), 400, 50);
  body.collision_triangles = 0;
  body.visual = file("collision.obj");
  loaded = load_scene_body(body);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded->bound.complex.collision.face_count(), 104);
}

// A scene on a bound model that says nothing else is the scene on the model, to the bit.
TEST_F(SceneBodyTest, ABoundModelKnowsItsMaterialAndLattice) {
  Scene model;
  model.body.model = "steak";
  const Result<SceneBodyLoaded> made = load_scene_body(model.body);
  ASSERT_TRUE(made.ok());
  ASSERT_TRUE(
      save_bound_body(made->bound, file("steak.kerf"), {made->young, made->poisson, made->density, made->lattice})
          .ok());
  ASSERT_TRUE(save_bound_body(made->bound, file("plain.kerf")).ok());
  const auto hash_of = [&](const Scene& scene) {
    auto session = Session::create(scene);
    EXPECT_TRUE(session.ok());
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(session->step().ok());
    return session->hash();
  };
  Scene bound, plain;
  bound.body.bound = file("steak.kerf");
  plain.body.bound = file("plain.kerf");
  EXPECT_EQ(hash_of(bound), hash_of(model));
  EXPECT_NE(hash_of(plain), hash_of(model));
}

// A file may hold what no scene takes: programs of other versions wrote it.
TEST_F(SceneBodyTest, ABoundBodyOfAMaterialThatScenesRefuse) {
  SceneBody body;
  body.model = "strip";
  const Result<SceneBodyLoaded> made = load_scene_body(body);
  ASSERT_TRUE(made.ok());
  BodyNature nature;
  nature.young = 1e300;
  ASSERT_TRUE(save_bound_body(made->bound, file("hard.kerf"), nature).ok());
  SceneBody hard;
  hard.bound = file("hard.kerf");
  const Result<SceneBodyLoaded> loaded = load_scene_body(hard);
  ASSERT_FALSE(loaded.ok());
  EXPECT_THAT(loaded.error().message, HasSubstr("hard.kerf: young must be at most 10000000000000, but is 1e+300"));
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

// Surfaces that a program has give the body of the files with the same numbers, to the bit; messages have the names that were given.
TEST_F(SceneBodyTest, SurfacesInMemoryStandForFiles) {
  write_sheet();
  const Result<Model> model = make_model("sheet", {});
  ASSERT_TRUE(model.ok());
  SurfacesInMemory given;
  given.visual = model->visual;
  given.collision = model->collision;
  SceneBody body;
  body.visual = "skin";
  body.collision = "middle";
  body.scale = 0.5;
  EXPECT_THAT(load_scene_body(body, {}, nullptr, given).error().message, HasSubstr("skin is an open surface"));
  body.thickness = 0.05;
  const Result<SceneBodyLoaded> loaded = load_scene_body(body, {}, nullptr, given);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  body.visual = file("visual.obj");
  body.collision = file("collision.obj");
  const Result<SceneBodyLoaded> read = load_scene_body(body);
  ASSERT_TRUE(read.ok());
  ASSERT_TRUE(save_bound_body(loaded->bound, file("memory.kerf"), nature_to_keep(body, *loaded, {})).ok());
  ASSERT_TRUE(save_bound_body(read->bound, file("files.kerf")).ok());
  const auto bytes = [](const std::string& path) { return std::string(read_whole_file(path, kNamedFile)->view()); };
  EXPECT_EQ(bytes(file("memory.kerf")), bytes(file("files.kerf")));
  given.collision->triangles.push_back({VertexId(0), VertexId(1), VertexId(1000000)});
  body.collision = "middle";
  EXPECT_THAT(load_scene_body(body, {}, nullptr, given).error().message, HasSubstr("middle"));
}

// A body that a program has is what a scene finds under its name: no file of that name is looked for, and the bits are those of its file.
TEST_F(SceneBodyTest, ABodyInMemoryStandsInAScene) {
  SceneBody body;
  body.model = "steak";
  const Result<SceneBodyLoaded> made = load_scene_body(body);
  ASSERT_TRUE(made.ok());
  BodyNature said;
  said.young = 7e4;
  const BodyNature nature = nature_to_keep(body, *made, said);
  ASSERT_TRUE(save_bound_body(made->bound, file("steak.kerf"), nature).ok());
  SceneFolders folders(folder_);
  folders.bodies["mine"] = std::make_shared<const SceneBodyLoaded>(with_nature(made->bound, nature));
  const auto hash_of = [&](const std::string& text) {
    auto scene = parse_scene(text, "scene", folders);
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    auto session = Session::create(*scene);
    EXPECT_TRUE(session.ok()) << session.error().message;
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(session->step().ok());
    return session->hash();
  };
  const std::string text = body_scene_text("steak", "mine", made->bound.complex);
  EXPECT_EQ(hash_of(text), hash_of(*scene_text_in(file("steak.kerf"))));
  EXPECT_EQ(hash_of("[[body]]\nbound = \"mine\"\n[[body]]\nbound = \"mine\"\nposition = [0, 0, 0.1]\n"),
            hash_of("[[body]]\nbound = \"mine\"\n[[body]]\nbound = \"steak.kerf\"\nposition = [0, 0, 0.1]\n"));
  EXPECT_THAT(parse_scene("body.bound = \"other\"", "scene", folders).error().message, HasSubstr("no file \"other\""));
  EXPECT_THAT(parse_scene("[body]\nbound = \"mine\"\nscale = 2", "scene", folders).error().message, HasSubstr("scale"));
}

TEST_F(SceneBodyTest, AClosedMeshAloneIsEnough) {
  const Result<Model> steak = make_model("steak", {});
  ASSERT_TRUE(steak.ok());
  ASSERT_TRUE(write_obj(file("steak.obj"), steak->visual).ok());
  SceneBody body;
  body.visual = file("steak.obj");
  body.options.collision_triangles = 120;
  std::optional<Midsurface> made;
  const Result<SceneBodyLoaded> loaded = load_scene_body(body, {}, &made);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  ASSERT_TRUE(made.has_value());
  EXPECT_EQ(made->verdict.thinness, Thinness::kThin);
  EXPECT_NEAR(static_cast<double>(loaded->bound.complex.collision.face_count()), 120, 6);
  EXPECT_TRUE(validate_binding(loaded->bound.complex).ok());
}

TEST_F(SceneBodyTest, ABodyThatIsNotThinIsRefusedWithReasons) {
  TriangleMesh cube;
  for (int i = 0; i < 8; ++i)
    cube.positions.push_back(
        {static_cast<double>(i & 1), static_cast<double>(i >> 1 & 1), static_cast<double>(i >> 2)});
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& f : faces) cube.triangles.push_back({VertexId(f[0]), VertexId(f[1]), VertexId(f[2])});
  ASSERT_TRUE(write_obj(file("cube.obj"), cube).ok());
  SceneBody body;
  body.visual = file("cube.obj");
  std::optional<Midsurface> made;
  const Result<SceneBodyLoaded> loaded = load_scene_body(body, {}, &made);
  ASSERT_FALSE(loaded.ok());
  EXPECT_THAT(loaded.error().message, HasSubstr("no collision mesh could be made"));
  EXPECT_THAT(loaded.error().message, HasSubstr("--collision"));
  ASSERT_TRUE(made.has_value());
  EXPECT_FALSE(made->diagnosis.surface.triangles.empty());
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
}  // namespace kerf::scene_body_test
