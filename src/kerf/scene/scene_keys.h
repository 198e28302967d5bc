// The keys of scene files: names, types, units, ranges and words, in one table per TOML table
// (scene_keys.cpp). The reader (scene_file.cpp) and `kerf info --schema` (scene_schema.cpp) both run over
// these tables; defaults are not repeated there but taken from the structs of scene.h through the member
// pointers.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "kerf/scene/scene.h"

namespace kerf {

/// The words of scene files for a kind.
std::string_view word_of(SceneShape shape);
std::string_view word_of(SceneToolKind kind);

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

/// What is wrong with a number, in a sentence that begins with its name; empty: nothing.
std::string range_fault(std::string_view what, const SceneRange& range, double x);

/// Where the value of a key goes: a V in the struct that a table fills in. `of` takes the struct's address; SceneKeys says which struct that is.
template <class V>
struct SceneMember {
  V& (*of)(void* table);
};

/// One of several words: `get` and `set` work with the position in `words`.
struct SceneChoice {
  std::span<const std::string_view> words;
  int (*get)(const void* table);
  void (*set)(void* table, int position);
};

/// A list of different words out of several.
struct SceneWords {
  std::span<const std::string_view> words;
  SceneMember<std::vector<std::string>> list;
};

/// A file: relative paths start at the folder of the scene.
struct SceneFilePath {
  SceneMember<std::string> path;
};

/// A table, a list of tables or anything else that the reader takes apart by itself; `type` is for the reader
/// of the documentation.
struct SceneNested {
  std::string_view type;
};

using SceneField =
    std::variant<SceneMember<double>, SceneMember<std::optional<double>>, SceneMember<int>,
                 SceneMember<std::optional<int>>, SceneMember<std::int64_t>, SceneMember<std::uint64_t>,
                 SceneMember<bool>, SceneMember<std::optional<bool>>, SceneMember<std::string>, SceneMember<Vec3>,
                 SceneMember<std::optional<Vec3>>, SceneMember<std::array<int, 2>>,
                 SceneMember<std::optional<std::array<int, 3>>>, SceneMember<std::optional<std::array<Vec3, 3>>>,
                 SceneChoice, SceneWords, SceneFilePath, SceneNested>;

struct SceneKey {
  std::string_view name;
  SceneField field;
  std::string_view unit;  ///< "" for pure numbers, words and tables
  SceneRange range;
  bool required = false;
  std::string_view doc;
};

/// The keys of a TOML table that fills in a T. Fields don't know T, so that what reads and describes them is compiled once and not for each T.
template <class T>
struct SceneKeys {
  std::span<const SceneKey> all;
};

/// The keys of the TOML tables that fill in a T.
template <class T>
SceneKeys<T> scene_keys();

template <>
SceneKeys<Scene> scene_keys<Scene>();
template <>
SceneKeys<SceneBody> scene_keys<SceneBody>();
template <>
SceneKeys<ModelOptions> scene_keys<ModelOptions>();
template <>
SceneKeys<SceneMaterial> scene_keys<SceneMaterial>();
template <>
SceneKeys<SceneMaterialRegion> scene_keys<SceneMaterialRegion>();
template <>
SceneKeys<SceneLattice> scene_keys<SceneLattice>();
template <>
SceneKeys<SceneCut> scene_keys<SceneCut>();
template <>
SceneKeys<SceneSimulation> scene_keys<SceneSimulation>();
template <>
SceneKeys<SceneFix> scene_keys<SceneFix>();
template <>
SceneKeys<SceneLoad> scene_keys<SceneLoad>();
template <>
SceneKeys<SceneBodyMaterial> scene_keys<SceneBodyMaterial>();
template <>
SceneKeys<SceneBond> scene_keys<SceneBond>();
template <>
SceneKeys<SceneContact> scene_keys<SceneContact>();
template <>
SceneKeys<SceneObstacle> scene_keys<SceneObstacle>();
template <>
SceneKeys<ScenePose> scene_keys<ScenePose>();
template <>
SceneKeys<SceneRigidTool> scene_keys<SceneRigidTool>();
template <>
SceneKeys<SceneToolMotion> scene_keys<SceneToolMotion>();
template <>
SceneKeys<SceneJaws> scene_keys<SceneJaws>();
template <>
SceneKeys<SceneOutput> scene_keys<SceneOutput>();
template <>
SceneKeys<SceneCamera> scene_keys<SceneCamera>();
template <>
SceneKeys<SceneCommand> scene_keys<SceneCommand>();  ///< what all commands share
template <>
SceneKeys<SceneBlade> scene_keys<SceneBlade>();
template <>
SceneKeys<SceneBladePose> scene_keys<SceneBladePose>();
template <>
SceneKeys<SceneGrasp> scene_keys<SceneGrasp>();
template <>
SceneKeys<SceneMove> scene_keys<SceneMove>();
template <>
SceneKeys<SceneRelease> scene_keys<SceneRelease>();
template <>
SceneKeys<SceneFixCommand> scene_keys<SceneFixCommand>();
template <>
SceneKeys<SceneUnfix> scene_keys<SceneUnfix>();
template <>
SceneKeys<SceneUndo> scene_keys<SceneUndo>();
template <>
SceneKeys<SceneRedo> scene_keys<SceneRedo>();

template <>
SceneKeys<ScenePunch> scene_keys<ScenePunch>();
template <>
SceneKeys<SceneArthroscope> scene_keys<SceneArthroscope>();
/// Of [lesion].
SceneKeys<SceneRegion> scene_lesion_keys();
template <>
SceneKeys<SceneShave> scene_keys<SceneShave>();
template <>
SceneKeys<SceneRemove> scene_keys<SceneRemove>();

/// Keys of the inline tables that describe a region: box = {min, max}, sphere = {center, radius},
/// half_space = {point, normal}.
SceneKeys<SceneRegion> scene_box_keys();
SceneKeys<SceneRegion> scene_sphere_keys();
SceneKeys<SceneRegion> scene_half_space_keys();

/// Names of the command types, in the order of SceneCommand::what; "open" is the last one's other word.
inline constexpr std::string_view kSceneCommandTypes[] = {"blade", "grasp", "move",  "release", "fix",
                                                          "unfix", "undo",  "redo",  "tool",    "close",
                                                          "open",  "punch", "shave", "remove"};

}  // namespace kerf
