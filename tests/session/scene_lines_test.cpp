// What is found wrong only when the bodies of a scene are made names its line too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "kerf/scene/scene_file.h"
#include "kerf/session/session.h"

namespace kerf::scene_lines_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string error_of(const std::string& text) {
  const auto scene = parse_scene(text, "scene.toml");
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  if (!scene.ok()) return "not read";
  const auto session = Session::create(*scene);
  return session.ok() ? "no error" : session.error().message;
}

TEST(SceneLines, WhatAModelOrALatticeCannotBeNamesItsLine) {
  const std::string strip = "[body]\nmodel = \"strip\"\n";
  EXPECT_EQ(error_of("[body]\nmodel = \"strip\"\noptions = { collision_triangles = 7 }\n"),
            "scene.toml:3: model strip has 150 collision triangles, not 7");
  EXPECT_EQ(error_of("[body]\nmodel = \"strip\"\noptions = { rim_radius = 0.1 }\n"),
            "scene.toml:3: model strip has no rim radius, only closed-sheet has");
  EXPECT_THAT(error_of("[body]\nmodel = \"strip\"\noptions = { noise = 0.1 }\n"),
              AllOf(StartsWith("scene.toml:3: strip: "), HasSubstr("noise of 0.1 m")));
  EXPECT_THAT(
      error_of("[[body]]\nmodel = \"strip\"\n[[body]]\nmodel = \"steak\"\noptions = { collision_triangles = 7 }\n"),
      StartsWith("scene.toml:5: model steak has"));
  EXPECT_THAT(
      error_of("[body]\nmodel = \"strip\"\n[lattice]\ncells = [1000, 1000, 1000]\n"),
      AllOf(StartsWith("scene.toml:4: lattice: 1000 x 1000 x 1000 cells are too many"), HasSubstr("are the most")));
  EXPECT_THAT(error_of(strip + "position = [1e6, 0, 0]\n"),
              AllOf(StartsWith("scene.toml:2: the body lies 1e+06 m"), HasSubstr("give [body] a position")));
  EXPECT_THAT(error_of("[[body]]\nmodel = \"steak\"\n[[body]]\nmodel = \"sheet\"\n"),
              StartsWith("scene.toml:4: body 1 (steak) is closed, body 2 (sheet) is an open sheet"));
  EXPECT_THAT(error_of("[body]\nmodel = \"sheet\"\nthickness = 1e9\n"),
              StartsWith("scene.toml:2: sheet: thickness is 1e+09 m, but the surface is 1.41 m across"));
  EXPECT_THAT(error_of(strip + "[[fix]]\nsphere = { center = [9, 9, 9], radius = 1 }\n"),
              StartsWith("scene.toml:4: [[fix]] number 1 holds nothing"));
  EXPECT_THAT(error_of(strip + "[lesion]\nsphere = { center = [9, 9, 9], radius = 1 }\n"),
              StartsWith("scene.toml:4: [lesion] marks nothing"));
}

}  // namespace
}  // namespace kerf::scene_lines_test
