// Scenes are read, and bodies made for them, while memory runs out: requests are refused once, one after the other.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>

#include "kerf/base/parallel.h"
#include "kerf/mesh/models.h"
#include "kerf/scene/automatic_body.h"
#include "kerf/scene/scene_body.h"
#include "kerf/scene/scene_file.h"
#include "support/source_dir.h"

#include "mesh/temporary_folder.h"
#include "support/counted_new.h"

namespace kerf::no_memory_test {
namespace {

/// Of numbers and names that a scene has.
auto gist(const Scene& s) {
  return std::tuple(s.body.model, s.simulation.duration, s.simulation.gravity.z, s.fixes.size(), s.commands.size(),
                    s.obstacles.size(), s.tools.size(), s.output.camera.direction.x, s.title);
}

/// Refuses every `step`-th request while a scene is read: it is right, or an error names it.
void read_with_refusals(const std::string& path, long step) {
  const auto whole = read_scene(path);
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  const auto expected = gist(*whole);
  const long refusals = test::with_requests_refused(
      0, step,
      [&] {
        const auto read = read_scene(path);
        const test::NothingRefused here;
        if (read.ok()) {
          EXPECT_EQ(gist(*read), expected);
        } else {
          EXPECT_TRUE(read.error().message.find("not enough memory") != std::string::npos) << read.error().message;
          EXPECT_TRUE(read.error().message.starts_with(path)) << read.error().message;
        }
      },
      [](bool, bool) {});
  EXPECT_GT(refusals, 10);
}

TEST(SceneNoMemory, AShippedSceneIsReadOrNamed) {
  for (const char* name : {"sheet", "scissors", "trainer", "steak-on-a-board"})
    read_with_refusals(test::source_dir() + "/scenes/" + name + ".toml", 13);
}

TEST(SceneNoMemory, EveryRequestOfAScene) {
  const test::TemporaryFolder folder;
  read_with_refusals(folder.put("a.toml",
                                "title = \"A\"\n[body]\nmodel = \"strip\"\n[simulation]\nduration = 0.25\n"
                                "gravity = [0, 0, -1]\n[[fix]]\nsphere = { center = [0, 0, 0], radius = 1 }\n"
                                "[[command]]\nat = 0.01\ntype = \"blade\"\nposes = [\n"
                                "  { time = 0.0, base = [0, 0, 1], tip = [0, 0, -1] },\n"
                                "  { time = 0.1, base = [0, 1, 1], tip = [0, 1, -1] },\n]\n"),
                     1);
}

TEST(SceneNoMemory, AWrongSceneIsRefusedOrNamed) {
  const test::TemporaryFolder folder;
  const std::string path = folder.put(
      "a.toml", "[body]\nmodle = \"strip\"\n[simulation]\nduration = -1\n[[fix]]\n[[command]]\nat = \"x\"\n");
  const auto right = read_scene(path);
  ASSERT_FALSE(right.ok());
  const std::string expected = right.error().message;
  test::with_requests_refused(
      0, 1,
      [&] {
        const auto read = read_scene(path);
        const test::NothingRefused here;
        ASSERT_FALSE(read.ok());
        EXPECT_TRUE(read.error().message == expected ||
                    read.error().message.find("not enough memory") != std::string::npos)
            << read.error().message;
      },
      [](bool, bool) {});
}

/// From a closed surface alone: the mid-surface, and what is bound to it.
void make_with_refusals(long step) {
  const ThreadLimit one(1);
  const auto model = make_model("closed-sheet", {.visual_triangles = 800});
  ASSERT_TRUE(model.ok());
  const auto gist_of = [](const AutomaticBody& b) {
    std::array<std::size_t, 4> sizes{};
    if (b.bound)
      sizes = {b.bound->complex.visual.vertex_count(), b.bound->complex.visual.face_count(),
               b.bound->complex.collision.vertex_count(), b.bound->complex.collision.face_count()};
    return std::pair(sizes, b.bound ? b.bound->report.volume_after : 0.0);
  };
  const auto whole = make_automatic_body(model->visual, 60, {});
  ASSERT_TRUE(whole.ok() && whole->bound);
  const auto expected = gist_of(*whole);
  const long refusals = test::with_requests_refused(
      0, step,
      [&] {
        const auto made = make_automatic_body(model->visual, 60, {});
        const test::NothingRefused here;
        ASSERT_TRUE(made.ok()) << made.error().message;
        EXPECT_EQ(gist_of(*made), expected) << (made->refused ? made->refused->message : "");
      },
      [](bool, bool) {});
  EXPECT_GT(refusals, 3);
}

TEST(AutomaticBodyNoMemory, PartsOfItCanFail) { make_with_refusals(1201); }
TEST(AutomaticBodyNoMemory, EveryPartOfItCanFail) { make_with_refusals(101); }

}  // namespace
}  // namespace kerf::no_memory_test
