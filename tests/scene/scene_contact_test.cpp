// Scene files: contact, obstacles, tools, several bodies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kerf/scene/scene_file.h"

namespace kerf::scene_contact_test {
namespace {

using ::testing::HasSubstr;

constexpr std::string_view kBody = "[body]\nmodel = \"sheet\"\n";

std::string error_of(std::string_view rest) {
  const Result<Scene> scene = parse_scene(std::string(kBody) + std::string(rest), "scene.toml");
  if (scene.ok()) return "no error";
  EXPECT_EQ(scene.error().kind, ErrorKind::kBadInput);
  return scene.error().message;
}
Scene scene_of(std::string_view rest) {
  Result<Scene> scene = parse_scene(std::string(kBody) + std::string(rest), "scene.toml");
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  return scene.ok() ? *scene : Scene{};
}

TEST(SceneContact, IsOnWhereThereIsSomethingToTouch) {
  EXPECT_FALSE(wants_contact(scene_of("")));
  EXPECT_TRUE(wants_contact(scene_of("[contact]\n")));
  EXPECT_TRUE(wants_contact(scene_of("[[obstacle]]\nshape = \"plane\"\n")));
  EXPECT_TRUE(wants_contact(scene_of("[[tool]]\nid = \"a\"\nkind = \"probe\"\n")));
  EXPECT_FALSE(wants_contact(scene_of("[contact]\nenabled = false\n[[obstacle]]\nshape = \"plane\"\n")));
  const Result<Scene> two = parse_scene("[[body]]\nmodel = \"sheet\"\n[[body]]\nmodel = \"steak\"\n", "two.toml");
  ASSERT_TRUE(two.ok()) << two.error().message;
  EXPECT_TRUE(wants_contact(*two));
}

TEST(SceneContact, ShapesTakeTheirOwnKeys) {
  EXPECT_EQ(error_of("[[obstacle]]\nshape = \"sphere\"\n"), "scene.toml:3: [[obstacle]]: a sphere needs radius");
  EXPECT_EQ(error_of("[[obstacle]]\nshape = \"plane\"\nradius = 1\n"),
            "scene.toml:5: radius of [[obstacle]] does not go with plane");
  EXPECT_EQ(error_of("[[obstacle]]\nshape = \"capsule\"\nradius = 1\n"),
            "scene.toml:3: [[obstacle]]: a capsule needs length");
  EXPECT_EQ(error_of("[[obstacle]]\nshape = \"box\"\nsize = [1, 0, 1]\n"),
            "scene.toml:5: size of [[obstacle]] must be more than 0, but is 0");
  EXPECT_THAT(error_of("[[obstacle]]\nshape = \"mesh\"\n"), HasSubstr("either mesh"));
  EXPECT_THAT(error_of("[[obstacle]]\nshape = \"mesh\"\nmodel = \"bal\"\n"), HasSubstr("did you mean \"ball\"?"));
  EXPECT_THAT(error_of("[[obstacle]]\nshape = \"mesh\"\nmesh = \"none.obj\"\n"), HasSubstr("there is no file"));
  EXPECT_THAT(error_of("[[obstacle]]\nshape = \"spere\"\n"), HasSubstr("did you mean \"sphere\"?"));
  EXPECT_THAT(error_of("[[obstacle]]\nshape = \"plane\"\nfirction = 1\n"), HasSubstr("did you mean \"friction\"?"));
  EXPECT_EQ(error_of("[contact]\nfriction = -1\n"),
            "scene.toml:4: friction of [contact] must be at least 0, but is -1");
}

TEST(SceneContact, MovesAscend) {
  constexpr std::string_view start = "[[obstacle]]\nshape = \"plane\"\n";
  EXPECT_EQ(error_of(std::string(start) +
                     "moves = [{ time = 1, position = [0, 0, 0] }, { time = 1, position = [0, 0, 1] }]\n"),
            "scene.toml:5: times of moves must increase, but 1 follows 1");
  EXPECT_THAT(error_of(std::string(start) + "moves = []\n"), HasSubstr("moves is empty"));
  EXPECT_THAT(error_of(std::string(start) + "moves = [{ time = 1 }]\n"), HasSubstr("needs the key \"position\""));
}

TEST(SceneContact, ToolsAreNamedAndHaveWhatTheyNeed) {
  constexpr std::string_view probe = "[[tool]]\nid = \"probe\"\nkind = \"probe\"\n";
  EXPECT_EQ(error_of(std::string(probe) + std::string(probe)),
            "scene.toml:6: there is a tool \"probe\" already; give this one another id");
  EXPECT_EQ(error_of("[[tool]]\nid = \"b\"\nkind = \"sphere\"\nsharp = true\n"),
            "scene.toml:6: sharp of [[tool]] does not go with sphere");
  EXPECT_EQ(error_of("[[tool]]\nid = \"b\"\nkind = \"mesh\"\n"), "scene.toml:3: [[tool]]: a mesh needs mesh");
  EXPECT_EQ(
      error_of(std::string(probe) +
               "[[command]]\nat = 0\ntype = \"tool\"\nid = \"prob\"\nposes = [{ time = 1, position = [0, 0, 0] }]\n"),
      "scene.toml:6: tool at 0 s: there is no tool \"prob\"; did you mean \"probe\"?");
  EXPECT_EQ(error_of(std::string(probe) + "[[command]]\nat = 0\ntype = \"close\"\nid = \"probe\"\n"),
            "scene.toml:6: close at 0 s: \"probe\" has no jaws; graspers and scissors have");
  EXPECT_THAT(
      error_of(std::string(probe) +
               "[[command]]\nat = 0\ntype = \"tool\"\nid = \"probe\"\nposes = [{ time = 3, position = [0, 0, 0] }]\n"),
      HasSubstr("after the end of the run"));
}

}  // namespace
}  // namespace kerf::scene_contact_test
