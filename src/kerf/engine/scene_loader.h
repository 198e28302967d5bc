// Scenes made ready to be shown, on a thread of their own: the engine that shows another one meanwhile goes on.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/base/threads.h"
#include "kerf/engine/drawn_body.h"
#include "kerf/engine/drawn_things.h"
#include "kerf/engine/scene_script.h"
#include "kerf/record/recording.h"
#include "kerf/scene/temporary_folder.h"
#include "kerf/session/session.h"

namespace kerf {

/// Meshes that a page has sent, by their names in `source.files`. Lengths in them have some unit.
struct UploadedMeshes {
  std::string visual, collision;  ///< no collision mesh: it is made from the visual one
  std::string bound;              ///< instead: a bound body
  double thickness = 0;           ///< in the mesh's unit; 0: not given
  double thickness_share = 0;     ///< instead: of the visual mesh's diagonal
  double unit = 0;                ///< metres; 0: guessed from the size
  bool guessed = false;
};
/// Metres per unit of a mesh of this size (its box's diagonal): millimetres when it would be larger than bodies are.
double guess_unit(double size);

/// What to load.
struct SceneRequest {
  SceneSource source;
  std::optional<UploadedMeshes> meshes;  ///< then source.text is made from them
  SceneOverrides overrides;
  std::optional<TemporaryFolder> folder;  ///< of an upload: source.files are written there, and nothing else is read
  std::uint32_t client = 0, input = 0;    ///< of the page that asked for it
};

/// Everything that a scene needs to be shown.
struct LoadedScene {
  SceneSource source;
  SceneOverrides overrides;
  std::optional<TemporaryFolder> folder;
  std::optional<UploadedMeshes> meshes;
  std::shared_ptr<Session> session;
  std::shared_ptr<const SessionSnapshot> initial;
  DrawnBody drawn;
  DrawnThings things;
  SceneScript script;  ///< of its own commands, whether they run or not
  Box3 box;            ///< of the visual mesh at rest, metres
};

/// Does it here and now. Errors as of parse_scene and Session::create; an upload that names files is bad input.
Result<std::unique_ptr<LoadedScene>> load_scene(SceneRequest request, const Progress& progress = {});

/// A session that somebody else has, as it is, without the commands of its scene. It is not the LoadedScene's. Errors as of DrawnThings::create.
Result<std::unique_ptr<LoadedScene>> scene_of_session(Session& session, SceneSource source);

/// Loads one scene at a time in the background; the newest request wins. Used by one thread.
class SceneLoader {
 public:
  SceneLoader() = default;
  SceneLoader(const SceneLoader&) = delete;
  SceneLoader& operator=(const SceneLoader&) = delete;
  ~SceneLoader();  ///< stops what is under way and waits for it

  /// Begins with this one as soon as what is under way, which is stopped, has ended.
  void start(SceneRequest request);
  /// Nothing is wanted any more.
  void stop();
  /// Is anything wanted that has not been taken yet?
  [[nodiscard]] bool busy() const { return wanted_; }
  /// Who asked for it.
  [[nodiscard]] std::uint32_t client() const { return client_; }
  [[nodiscard]] std::uint32_t input() const { return input_; }

  struct Where {
    std::string stage;
    double fraction = 0;
  };
  [[nodiscard]] Where where() const;
  /// What has been loaded, once; nothing as long as there is nothing. Begins with what waits. Never blocks for long.
  std::optional<Result<std::unique_ptr<LoadedScene>>> take();
  /// Frees a scene in the background: a large one takes a while.
  void dispose(std::unique_ptr<LoadedScene> scene);

 private:
  struct Job {
    std::atomic<bool> stop = false, done = false;
    mutable Mutex mutex;  ///< of `where`
    Where where;
    std::optional<Result<std::unique_ptr<LoadedScene>>> outcome;  ///< read when done
    Thread thread;
  };
  void begin(SceneRequest request);

  std::unique_ptr<Job> job_;
  std::optional<SceneRequest> next_;
  bool wanted_ = false;
  std::uint32_t client_ = 0, input_ = 0;
  Thread disposer_;
};

}  // namespace kerf
