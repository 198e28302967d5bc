#include "kerf/scene/bound_models.h"

#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "kerf/base/threads.h"
#include "kerf/scene/tolerances.h"

namespace kerf {
namespace {

/// What a model's body follows from.
struct ModelKey {
  std::string model;
  ModelOptions options;
  std::optional<Vec3> size;
  std::optional<double> thickness;
  bool exact_paths = false;
  friend bool operator==(const ModelKey&, const ModelKey&) = default;
};

std::size_t bytes_of(const SceneBodyLoaded& loaded) {
  std::size_t bytes = sizeof loaded;
  // Only reads: arrays are visited through the one function that lists them.
  const_cast<CellComplex&>(loaded.bound.complex).for_each_array([&](auto& array) {
    bytes += array.size() * sizeof(array.raw()[0]);
  });
  return bytes;
}

class KeptModels {
 public:
  std::shared_ptr<const SceneBodyLoaded> find(const ModelKey& key) {
    // A fork may have left the lock to a thread that is not there. Then nothing is found and nothing is kept.
    const Lock lock(mutex_, kTryToLock);
    if (!lock) return nullptr;
    for (auto one = kept_.begin(); one != kept_.end(); ++one)
      if (one->key == key) {
        kept_.splice(kept_.begin(), kept_, one);
        return one->loaded;
      }
    return nullptr;
  }
  void keep(const ModelKey& key, const SceneBodyLoaded& loaded) {
    const std::size_t bytes = bytes_of(loaded);
    if (bytes > kMostKeptModels) return;
    auto copy = std::make_shared<const SceneBodyLoaded>(loaded);
    const Lock lock(mutex_, kTryToLock);
    if (!lock) return;
    for (const Kept& one : kept_)
      if (one.key == key) return;  // of another thread
    while (bytes_ + bytes > kMostKeptModels) {
      bytes_ -= kept_.back().bytes;
      kept_.pop_back();
    }
    kept_.push_front({key, std::move(copy), bytes});
    bytes_ += bytes;  // after what can fail
  }
  std::size_t bytes() {
    const Lock lock(mutex_);
    return bytes_;
  }

 private:
  struct Kept {
    ModelKey key;
    std::shared_ptr<const SceneBodyLoaded> loaded;
    std::size_t bytes = 0;
  };
  Mutex mutex_;
  std::list<Kept> kept_;  // by use, the latest first
  std::size_t bytes_ = 0;
};

KeptModels& kept_models() {
  static auto* const kept = new KeptModels;  // as long as the process: sessions may end after static objects
  return *kept;
}

}  // namespace

Result<SceneBodyLoaded> bound_model(const SceneBody& body, const Progress& progress) {
  const ModelKey key{body.model, body.options, body.size, body.thickness, body.exact_paths};
  if (const auto kept = kept_models().find(key)) return *kept;
  Result<SceneBodyLoaded> loaded = load_scene_body(body, progress);
  if (loaded) kept_models().keep(key, *loaded);
  return loaded;
}

std::size_t kept_model_bytes() { return kept_models().bytes(); }

}  // namespace kerf
