// The keys of scene files: names, types, units, ranges and words, in one table per TOML table
// (scene_keys.cpp). The reader (scene_file.cpp) and `kerf info --schema` (scene_schema.cpp) both run over
// these tables; defaults are not repeated there but taken from the structs of scene.h through the member
// pointers.
#pragma once

#include <limits>
#include <span>
#include <string_view>
#include <variant>

#include "kerf/session/scene.h"

namespace kerf {

/// Allowed numbers, also of every component of a vector.
struct SceneRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;  ///< min itself is not allowed
  bool below_max = false;  ///< max itself is not allowed
  [[nodiscard]] bool contains(double x) const {
    return (above_min ? x > min : x >= min) && (below_max ? x < max : x <= max);
  }
};

/// One of several words: `get` and `set` work with the position in `words`.
template <class T>
struct SceneChoice {
  std::span<const std::string_view> words;
  int (*get)(const T&);
  void (*set)(T&, int);
};

/// A list of different words out of several.
template <class T>
struct SceneWords {
  std::span<const std::string_view> words;
  std::vector<std::string> T::*list;
};

/// A file: relative paths start at the folder of the scene.
template <class T>
struct SceneFilePath {
  std::string T::*path;
};

/// A table, a list of tables or anything else that the reader takes apart by itself; `type` is for the reader
/// of the documentation.
struct SceneNested {
  std::string_view type;
};

template <class T>
using SceneField =
    std::variant<double T::*, std::optional<double> T::*, int T::*, std::optional<int> T::*,
                 std::int64_t T::*, std::uint64_t T::*, bool T::*, std::optional<bool> T::*, std::string T::*, Vec3 T::*,
                 std::optional<Vec3> T::*, std::array<int, 2> T::*, std::optional<std::array<int, 3>> T::*,
                 std::optional<std::array<Vec3, 3>> T::*, SceneChoice<T>, SceneWords<T>, SceneFilePath<T>,
                 SceneNested>;

template <class T>
struct SceneKey {
  std::string_view name;
  SceneField<T> field;
  std::string_view unit;  ///< "" for pure numbers, words and tables
  SceneRange range;
  bool required = false;
  std::string_view doc;
};

/// The keys of the TOML tables that fill in a T.
template <class T>
std::span<const SceneKey<T>> scene_keys();

template <>
std::span<const SceneKey<Scene>> scene_keys<Scene>();
template <>
std::span<const SceneKey<SceneBody>> scene_keys<SceneBody>();
template <>
std::span<const SceneKey<ModelOptions>> scene_keys<ModelOptions>();
template <>
std::span<const SceneKey<SceneMaterial>> scene_keys<SceneMaterial>();
template <>
std::span<const SceneKey<SceneMaterialRegion>> scene_keys<SceneMaterialRegion>();
template <>
std::span<const SceneKey<SceneLattice>> scene_keys<SceneLattice>();
template <>
std::span<const SceneKey<SceneCut>> scene_keys<SceneCut>();
template <>
std::span<const SceneKey<SceneSimulation>> scene_keys<SceneSimulation>();
template <>
std::span<const SceneKey<SceneFix>> scene_keys<SceneFix>();
template <>
std::span<const SceneKey<SceneLoad>> scene_keys<SceneLoad>();
template <>
std::span<const SceneKey<SceneBodyMaterial>> scene_keys<SceneBodyMaterial>();
template <>
std::span<const SceneKey<SceneContact>> scene_keys<SceneContact>();
template <>
std::span<const SceneKey<SceneObstacle>> scene_keys<SceneObstacle>();
template <>
std::span<const SceneKey<ScenePose>> scene_keys<ScenePose>();
template <>
std::span<const SceneKey<SceneRigidTool>> scene_keys<SceneRigidTool>();
template <>
std::span<const SceneKey<SceneToolMotion>> scene_keys<SceneToolMotion>();
template <>
std::span<const SceneKey<SceneJaws>> scene_keys<SceneJaws>();
template <>
std::span<const SceneKey<SceneOutput>> scene_keys<SceneOutput>();
template <>
std::span<const SceneKey<SceneCamera>> scene_keys<SceneCamera>();
template <>
std::span<const SceneKey<SceneCommand>> scene_keys<SceneCommand>();  ///< what all commands share
template <>
std::span<const SceneKey<SceneBlade>> scene_keys<SceneBlade>();
template <>
std::span<const SceneKey<SceneBladePose>> scene_keys<SceneBladePose>();
template <>
std::span<const SceneKey<SceneGrasp>> scene_keys<SceneGrasp>();
template <>
std::span<const SceneKey<SceneMove>> scene_keys<SceneMove>();
template <>
std::span<const SceneKey<SceneRelease>> scene_keys<SceneRelease>();
template <>
std::span<const SceneKey<SceneFixCommand>> scene_keys<SceneFixCommand>();
template <>
std::span<const SceneKey<SceneUnfix>> scene_keys<SceneUnfix>();
template <>
std::span<const SceneKey<SceneUndo>> scene_keys<SceneUndo>();
template <>
std::span<const SceneKey<SceneRedo>> scene_keys<SceneRedo>();

template <>
std::span<const SceneKey<ScenePunch>> scene_keys<ScenePunch>();
template <>
std::span<const SceneKey<SceneArthroscope>> scene_keys<SceneArthroscope>();
/// Of [lesion].
std::span<const SceneKey<SceneRegion>> scene_lesion_keys();
template <>
std::span<const SceneKey<SceneShave>> scene_keys<SceneShave>();
template <>
std::span<const SceneKey<SceneRemove>> scene_keys<SceneRemove>();

/// Keys of the inline tables that describe a region: box = {min, max}, sphere = {center, radius},
/// half_space = {point, normal}.
std::span<const SceneKey<SceneRegion>> scene_box_keys();
std::span<const SceneKey<SceneRegion>> scene_sphere_keys();
std::span<const SceneKey<SceneRegion>> scene_half_space_keys();

/// Names of the command types, in the order of SceneCommand::what; "open" is the last one's other word.
inline constexpr std::string_view kSceneCommandTypes[] = {"blade", "grasp", "move", "release", "fix", "unfix",
                                                          "undo",  "redo",  "tool", "close",   "open", "punch",
                                                          "shave", "remove"};

}  // namespace kerf
