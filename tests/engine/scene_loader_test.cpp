// Scenes that are loaded in the background, where the system gives no thread for it.
#include "kerf/engine/scene_loader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <chrono>
#include <thread>

namespace kerf::scene_loader_test {
namespace {

/// Threads ask for a stack that no machine has: none can be made.
class NoThreads {
 public:
  NoThreads() {
    pthread_getattr_default_np(&before_);
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, std::size_t{1} << 47);
    pthread_setattr_default_np(&attributes);
    pthread_attr_destroy(&attributes);
  }
  ~NoThreads() {
    pthread_setattr_default_np(&before_);
    pthread_attr_destroy(&before_);
  }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  pthread_attr_t before_;
};

SceneRequest sheet() {
  SceneRequest request;
  request.source.text = "[body]\nmodel = \"sheet\"\n";
  request.source.name = "sheet";
  return request;
}

std::optional<Result<std::unique_ptr<LoadedScene>>> wait_for(SceneLoader& loader) {
  for (int i = 0; i < 6000; ++i) {
    if (auto outcome = loader.take()) return outcome;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return {};
}

TEST(SceneLoader, WithoutAThreadTheSceneFailsAndTheNextOneLoads) {
  SceneLoader loader;
  {
    const NoThreads none;
    loader.start(sheet());
  }
  const auto refused = wait_for(loader);
  ASSERT_TRUE(refused.has_value());
  ASSERT_FALSE(refused->ok());
  EXPECT_EQ(refused->error().kind, ErrorKind::kFailed);
  EXPECT_THAT(refused->error().message, testing::HasSubstr("what was shown stays"));
  EXPECT_FALSE(loader.busy());
  loader.start(sheet());
  auto loaded = wait_for(loader);
  ASSERT_TRUE(loaded.has_value());
  ASSERT_TRUE(loaded->ok()) << loaded->error().message;
  const NoThreads none;
  loader.dispose(std::move(*loaded).value());  // freed here
}

TEST(SceneLoader, EndsWhileNoThreadCouldBeMade) {
  const NoThreads none;
  SceneLoader loader;
  loader.start(sheet());
}

}  // namespace
}  // namespace kerf::scene_loader_test
