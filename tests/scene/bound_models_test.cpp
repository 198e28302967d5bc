// Models that a process keeps bound.
#include "kerf/scene/bound_models.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "kerf/scene/tolerances.h"

namespace kerf::bound_models_test {
namespace {

SceneBody model(std::string name, std::uint64_t triangles = 0) {
  SceneBody body;
  body.model = std::move(name);
  body.options.visual_triangles = triangles;
  return body;
}
std::string bytes_of(const SceneBodyLoaded& loaded) { return bound_body_bytes(loaded.bound); }
std::string bytes_of(const SceneBody& body) {
  const auto loaded = bound_model(body);
  EXPECT_TRUE(loaded.ok());
  return loaded.ok() ? bytes_of(*loaded) : std::string();
}

TEST(BoundModels, AreThoseThatAreBoundAnew) {
  std::vector<SceneBody> bodies;
  for (const ModelName& name : model_names()) bodies.push_back(model(std::string(name.name)));
  bodies.push_back(model("sheet"));
  bodies.back().thickness = 0.003;
  bodies.push_back(model("closed-sheet"));
  bodies.back().size = Vec3{0.1, 0.08, 0.004};
  bodies.push_back(model("closed-sheet"));
  bodies.back().options.bend = 0.5;
  for (int round = 0; round < 2; ++round)
    for (const SceneBody& body : bodies) {
      const auto anew = load_scene_body(body);
      ASSERT_TRUE(anew.ok()) << anew.error().message;
      EXPECT_EQ(bytes_of(body), bytes_of(*anew)) << body.model << ", round " << round;
    }
  EXPECT_GT(kept_model_bytes(), 0u);
  EXPECT_LE(kept_model_bytes(), kMostKeptModels);
}

TEST(BoundModels, TakeNoMoreThanTheirShare) {
  for (std::uint64_t triangles = 20000; triangles < 60000; triangles += 5000) {
    ASSERT_TRUE(bound_model(model("closed-sheet", triangles)).ok());
    EXPECT_LE(kept_model_bytes(), kMostKeptModels);
  }
  EXPECT_GT(kept_model_bytes(), kMostKeptModels / 2);
}

TEST(BoundModels, ThatAreRefusedAreRefusedAgain) {
  for (int i = 0; i < 2; ++i) {
    EXPECT_FALSE(bound_model(model("nosuch")).ok());
    SceneBody body = model("steak");
    body.size = Vec3{1, 1, 1};
    EXPECT_FALSE(bound_model(body).ok());
  }
}

TEST(BoundModels, ComeToAllThreads) {
  const std::string expected = bytes_of(model("meniscus"));
  std::vector<std::string> got(8);
  std::vector<std::thread> threads;
  for (std::string& bytes : got)
    threads.emplace_back([&bytes] { bytes = bytes_of(model("meniscus")) + bytes_of(model("tube")); });
  for (std::thread& t : threads) t.join();
  for (const std::string& bytes : got) EXPECT_EQ(bytes, expected + bytes_of(model("tube")));
}

}  // namespace
}  // namespace kerf::bound_models_test
