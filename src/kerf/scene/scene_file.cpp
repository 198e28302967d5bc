#include "kerf/scene/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <utility>

#include "kerf/base/overloaded.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/rigid_models.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/scene/closest_word.h"
#include "kerf/scene/scene_keys.h"
#include "kerf/scene/scene_limits.h"
#include "kerf/scene/scene_schema.h"
#include "kerf/scene/time_step_fault.h"
#include "kerf/scene/toml_text.h"

// Header-only. With exceptions: without them its functions are noexcept, and memory that ends in one of them ends the program. Floating-point
// numbers by <charconv>: streams take memory that ends for a number that is wrong. toml++ 3.3.0 asserts, and in release builds promises the compiler, that a table header
// starts with a key character, before it has looked: "[=" would be undefined. Its assertions are turned off, so that the
// check that follows them reports the error (found by the test of damaged texts).
#undef TOML_HEADER_ONLY
#undef TOML_SHARED_LIB
#define TOML_HEADER_ONLY 1
#ifndef TOML_EXCEPTIONS  // 0 where exceptions end the program
#define TOML_EXCEPTIONS 1
#endif
#define TOML_FLOAT_CHARCONV 1
#define TOML_ASSERT(expression) static_assert(true)
#pragma push_macro("NDEBUG")
#undef NDEBUG
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

namespace kerf {
namespace {

constexpr std::size_t kMaxProblems = 10;            // a screenful; more of them seldom help
constexpr double kOrthonormalTolerance = 1e-6;      // axes typed with seven digits pass
constexpr int kPlainExponent = 19;                  // of 2: products of four such components have all their digits
constexpr double kWholeNumbers = 9007199254740992;  // 2^53: doubles below have every digit of theirs
constexpr double kTimeTolerance = 1e-9;             // relative: sums of decimal fractions end a few bits late

/// Is it a whole number with all its digits?
bool is_whole(double x) { return std::abs(x) < kWholeNumbers && x == std::trunc(x); }

std::string_view type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table: return "a table";
    case toml::node_type::array: return "a list";
    case toml::node_type::string: return "text";
    case toml::node_type::integer: return "a whole number";
    case toml::node_type::floating_point: return "a number";
    case toml::node_type::boolean: return "true or false";
    default: return "a date or time";
  }
}

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }
int line_of(const toml::key& key) { return static_cast<int>(key.source().begin.line); }

/// Where to look for what is wrong with the first of these keys that is there; the table's line without any.
int line_of(const toml::table& table, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys)
    if (const toml::node* node = table.get(key)) return line_of(*node);
  return std::max(1, line_of(static_cast<const toml::node&>(table)));
}

void add_names(std::vector<std::string_view>& out, std::span<const SceneKey> keys) {
  for (const SceneKey& key : keys) out.push_back(key.name);
}
std::vector<std::string_view> names(std::span<const SceneKey> keys) {
  std::vector<std::string_view> out;
  add_names(out, keys);
  return out;
}

/// The same direction at a length whose square is a number, and that recordings can hold. Powers of two leave its unit vector the same bits.
Vec3 of_plain_length(Vec3 v) {
  int exponent = 0;
  std::frexp(std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}), &exponent);
  if (std::abs(exponent) <= kPlainExponent) return v;
  return {std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent), std::ldexp(v.z, -exponent)};
}

class SceneReader {
 public:
  SceneReader(std::string_view file, const SceneFolders& folders) : file_(file), folders_(folders) {}

  Result<Scene> read(const toml::table& root) {
    Scene scene;
    read_plain(root, "", scene_keys<Scene>(), scene);
    read_bodies(root, scene);
    if (const toml::table* t = table_at(root, "material")) read_material(*t, scene.material);
    if (const toml::table* t = table_at(root, "lattice")) read_lattice(*t, scene.lattice);
    if (const toml::table* t = table_at(root, "cut")) read_plain(*t, "[cut]", scene_keys<SceneCut>(), scene.cut);
    if (const toml::table* t = table_at(root, "simulation")) {
      read_plain(*t, "[simulation]", scene_keys<SceneSimulation>(), scene.simulation);
    }
    if (const toml::table* t = table_at(root, "lesion")) {
      check_known(*t, "[lesion]", names(scene_lesion_keys().all));
      read_region(*t, "[lesion]", scene.lesion.emplace());
    }
    if (const toml::table* t = table_at(root, "arthroscope")) {
      SceneArthroscope& scope = scene.arthroscope.emplace();
      read_plain(*t, "[arthroscope]", scene_keys<SceneArthroscope>(), scope);
      if (scope.entry == scope.target && problems_.empty())
        problem(line_of(*t, {"target"}), "[arthroscope]: entry and target are the same point");
    }
    for (const toml::table* t : tables_at(root, "fix")) {
      SceneFix& fix = scene.fixes.emplace_back();
      read_plain(*t, "[[fix]]", scene_keys<SceneFix>(), fix);
      read_region(*t, "[[fix]]", fix.region);
    }
    for (const toml::table* t : tables_at(root, "load")) read_load(*t, scene.loads.emplace_back());
    for (const toml::table* t : tables_at(root, "bond")) {
      SceneBond& bond = scene.bonds.emplace_back();
      read_plain(*t, "[[bond]]", scene_keys<SceneBond>(), bond);
      bond.line = line_of(*t);
    }
    if (const toml::table* t = table_at(root, "contact")) {
      read_plain(*t, "[contact]", scene_keys<SceneContact>(), scene.contact);
      if (!scene.contact.enabled) scene.contact.enabled = true;
    }
    for (const toml::table* t : tables_at(root, "obstacle")) read_obstacle(*t, scene.obstacles.emplace_back());
    for (const toml::table* t : tables_at(root, "tool")) read_tool(*t, scene.tools.emplace_back());
    for (const toml::table* t : tables_at(root, "command")) read_command(*t, scene);
    if (const toml::table* t = table_at(root, "output")) read_output(*t, scene);

    std::stable_sort(scene.commands.begin(), scene.commands.end(),
                     [](const SceneCommand& a, const SceneCommand& b) { return a.at < b.at; });
    if (problems_.empty()) {  // these look across tables, and would only repeat other problems
      check_grasps(scene);
      check_tools(scene);
      check_times(root, scene);
    }
    if (!problems_.empty()) return bad_input(message());
    scene.files = std::move(files_);
    return scene;
  }

  Result<SceneCommand> read_alone(toml::table root, double now, std::span<const SceneRigidTool> tools) {
    Scene around;
    around.tools.assign(tools.begin(), tools.end());
    if (root.contains("at"))
      problem(line_of(root, {"at"}), "a command that is given while the session runs has no at; it is done at once");
    else root.insert("at", now);
    read_command(root, around);
    if (problems_.empty()) check_tools(around);
    if (!problems_.empty()) return bad_input(message());
    around.commands[0].line = 0;
    return std::move(around.commands[0]);
  }

 private:
  // --- Problems
  // ---------------------------------------------------------------------------------------------------

  void problem(int line, std::string_view text) { problems_.push_back({line, shown(text, kMostOfSentence)}); }

  std::string message() {
    std::stable_sort(problems_.begin(), problems_.end(),
                     [](const Problem& a, const Problem& b) { return a.line < b.line; });
    // x, y and z that are wrong in the same way are one problem.
    const auto same = [](const Problem& a, const Problem& b) { return a.line == b.line && a.text == b.text; };
    problems_.erase(std::unique(problems_.begin(), problems_.end(), same), problems_.end());
    std::string out;
    for (std::size_t i = 0; i < std::min(problems_.size(), kMaxProblems); ++i) {
      if (i > 0) out += '\n';
      out += fmt::format("{}:{}: {}", file_, problems_[i].line, problems_[i].text);
    }
    if (problems_.size() > kMaxProblems) out += fmt::format("\nand {} more problems", problems_.size() - kMaxProblems);
    return out;
  }

  /// Complains about every key of the table that is not in `known`.
  void check_known(const toml::table& table, std::string_view where, std::span<const std::string_view> known) {
    for (const auto& [key, node] : table) {
      const std::string_view name = key.str();
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      std::string text = fmt::format("unknown key \"{}\"{}{}", shown(name), where.empty() ? "" : " in ", where);
      if (names_what_id_names(name) && std::find(known.begin(), known.end(), "id") != known.end()) {
        text += "; did you mean \"id\"?";
      } else if (const std::string_view closest = closest_word(name, known); !closest.empty()) {
        text += fmt::format("; did you mean \"{}\"?", closest);
      } else if (const std::string home = table_that_knows(name); !home.empty()) {
        text += fmt::format("; it belongs in {}", home);
      } else {
        text += fmt::format("; known are {}", fmt::join(known, ", "));
      }
      problem(line_of(key), text);
    }
  }

  /// Commands that work on a tool or a grasp name it by its id.
  static bool names_what_id_names(std::string_view key) { return key == "tool" || key == "grasp"; }

  static std::string table_that_knows(std::string_view key) {
    for (const SceneKeyDoc& doc : scene_schema()) {
      if (doc.key == key) return doc.table.empty() ? "the top level, before the first [table]" : doc.table;
    }
    return {};
  }

  // --- Values
  // -----------------------------------------------------------------------------------------------------

  static std::string label(std::string_view where, std::string_view key) {
    return where.empty() ? std::string(key) : fmt::format("{} of {}", key, where);
  }

  void wrong_type(const toml::node& node, std::string_view what, std::string_view wanted) {
    problem(line_of(node), fmt::format("{} must be {}, but is {}", what, wanted, type_name(node)));
  }

  bool in_range(const toml::node& node, std::string_view what, const SceneRange& range, double x) {
    const std::string fault = range_fault(what, range, x);
    if (fault.empty()) return true;
    problem(line_of(node), fault);
    return false;
  }

  bool get(const toml::node& node, std::string_view what, const SceneRange& range, double& out) {
    if (!node.is_number()) {
      wrong_type(node, what, "a number");
      return false;
    }
    const double x =
        node.is_integer() ? static_cast<double>(node.as_integer()->get()) : node.as_floating_point()->get();
    if (!in_range(node, what, range, x)) return false;
    out = x;
    return true;
  }
  bool get(const toml::node& node, std::string_view what, const SceneRange& range, std::int64_t& out) {
    if (const auto* real = node.as_floating_point(); real && is_whole(real->get())) {
      problem(line_of(node), fmt::format("{} must be written as a whole number: {:.0f}", what, real->get()));
      return false;
    }
    if (!node.is_integer()) {
      wrong_type(node, what, "a whole number");
      return false;
    }
    const std::int64_t x = node.as_integer()->get();
    if (!in_range(node, what, range, static_cast<double>(x))) return false;
    out = x;
    return true;
  }
  bool get(const toml::node& node, std::string_view what, const SceneRange& range, int& out) {
    std::int64_t wide = 0;
    if (!get(node, what, range, wide)) return false;
    if (wide != static_cast<std::int64_t>(static_cast<int>(wide))) {
      problem(line_of(node), fmt::format("{} is too large: {}", what, wide));
      return false;
    }
    out = static_cast<int>(wide);
    return true;
  }
  bool get(const toml::node& node, std::string_view what, const SceneRange& range, Vec3& out) {
    const toml::array* list = list_of(node, what, 3, "numbers [x, y, z]");
    if (!list) return false;
    bool good = true;
    Vec3 v;
    for (int i = 0; i < 3; ++i) good = get((*list)[static_cast<std::size_t>(i)], what, range, v[i]) && good;
    if (good) out = v;
    return good;
  }
  template <std::size_t N>
  bool get(const toml::node& node, std::string_view what, const SceneRange& range, std::array<int, N>& out) {
    const toml::array* list = list_of(node, what, N, "whole numbers");
    if (!list) return false;
    bool good = true;
    for (std::size_t i = 0; i < N; ++i) good = get((*list)[i], what, range, out[i]) && good;
    return good;
  }
  bool get(const toml::node& node, std::string_view what, const SceneRange& range, std::array<Vec3, 3>& out) {
    const toml::array* list = list_of(node, what, 3, "vectors [[x, y, z], [x, y, z], [x, y, z]]");
    if (!list) return false;
    bool good = true;
    for (std::size_t i = 0; i < 3; ++i) good = get((*list)[i], what, range, out[i]) && good;
    return good;
  }
  bool get(const toml::node& node, std::string_view what, std::string& out) {
    if (!node.is_string()) {
      wrong_type(node, what, "text in quotes");
      return false;
    }
    out = node.as_string()->get();
    if (!out.empty()) return true;
    problem(line_of(node), fmt::format("{} is empty", what));
    return false;
  }
  /// Position of a word in a list of words, or -1.
  int get_word(const toml::node& node, std::string_view what, std::span<const std::string_view> words) {
    if (!node.is_string()) {
      wrong_type(node, what, fmt::format("one of \"{}\"", fmt::join(words, "\", \"")));
      return -1;
    }
    const std::string& word = node.as_string()->get();
    const auto found = std::find(words.begin(), words.end(), word);
    if (found != words.end()) return static_cast<int>(found - words.begin());
    std::string text = fmt::format("{} can't be \"{}\"; ", what, word);
    if (const std::string_view closest = closest_word(word, words); !closest.empty()) {
      text += fmt::format("did you mean \"{}\"?", closest);
    } else {
      text += fmt::format("known are {}", fmt::join(words, ", "));
    }
    problem(line_of(node), std::move(text));
    return -1;
  }

  const toml::array* list_of(const toml::node& node, std::string_view what, std::size_t n, std::string_view items) {
    const toml::array* list = node.as_array();
    if (!list) {
      wrong_type(node, what, fmt::format("a list of {} {}", n, items));
      return nullptr;
    }
    if (list->size() != n) {
      problem(line_of(node), fmt::format("{} must be a list of {} {}, but has {}", what, n, items, list->size()));
      return nullptr;
    }
    return list;
  }

  void get_file(const toml::node& node, std::string_view what, std::string& out) {
    std::string written;
    if (!get(node, what, written)) return;
    if (folders_.bodies.count(written) > 0) {
      out = written;
      return;
    }
    if (folders_.only && std::find(folders_.only->begin(), folders_.only->end(), written) == folders_.only->end())
      return problem(
          line_of(node),
          fmt::format("{}: a scene that is uploaded can't name files; use a model, or drop the meshes themselves",
                      what));
    std::filesystem::path path = std::filesystem::path(written).is_absolute()
                                     ? std::filesystem::path(written)
                                     : (folders_.scene / written).lexically_normal();
    if (const auto instead = folders_.instead.find(written); instead != folders_.instead.end()) path = instead->second;
    std::string looked = path.string();
    if (std::filesystem::path(written).is_relative())
      for (const std::filesystem::path& folder : folders_.meshes) {
        if (is_there(path.string())) break;
        path = (folder / written).lexically_normal();
        looked += ", " + path.string();
      }
    if (!is_there(path.string())) {
      problem(
          line_of(node),
          fmt::format(
              "{}: there is no file \"{}\" (looked for {}); --meshes FOLDER or KERF_MESHES=FOLDER says where else meshes are",
              what, shown(written), looked));
      return;
    }
    if (!is_regular_file(path.string())) {
      problem(line_of(node), fmt::format("{}: {} is not a file", what, path.string()));
      return;
    }
    out = path.string();
    const bool known =
        std::any_of(files_.begin(), files_.end(), [&](const SceneFileUse& f) { return f.written == written; });
    if (!known) files_.push_back({written, out, line_of(node)});
  }

  void get_field(const toml::node& node, const std::string& what, const SceneKey& key, void* out) {
    std::visit(
        Overloaded{
            [&](SceneMember<double> m) { get(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::optional<double>> m) { get_optional(node, what, key.range, m.of(out)); },
            [&](SceneMember<int> m) { get(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::optional<int>> m) { get_optional(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::int64_t> m) { get(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::uint64_t> m) {
              std::int64_t x = 0;  // the ranges of these keys start at 0
              if (get(node, what, key.range, x)) m.of(out) = static_cast<std::uint64_t>(x);
            },
            [&](SceneMember<bool> m) {
              if (node.is_boolean()) m.of(out) = node.as_boolean()->get();
              else wrong_type(node, what, "true or false");
            },
            [&](SceneMember<std::optional<bool>> m) {
              if (node.is_boolean()) m.of(out) = node.as_boolean()->get();
              else wrong_type(node, what, "true or false");
            },
            [&](SceneMember<std::string> m) { get(node, what, m.of(out)); },
            [&](SceneMember<Vec3> m) { get(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::optional<Vec3>> m) { get_optional(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::array<int, 2>> m) { get(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::optional<std::array<int, 3>>> m) { get_optional(node, what, key.range, m.of(out)); },
            [&](SceneMember<std::optional<std::array<Vec3, 3>>> m) { get_optional(node, what, key.range, m.of(out)); },
            [&](const SceneChoice& choice) {
              if (const int i = get_word(node, what, choice.words); i >= 0) choice.set(out, i);
            },
            [&](const SceneWords& words) { get_words(node, what, words.words, words.list.of(out)); },
            [&](const SceneFilePath& file) { get_file(node, what, file.path.of(out)); },
            [](const SceneNested&) {},  // its own reader takes it apart
        },
        key.field);
  }
  template <class V>
  void get_optional(const toml::node& node, std::string_view what, const SceneRange& range, std::optional<V>& out) {
    V value{};
    if (get(node, what, range, value)) out = value;
  }
  void get_words(const toml::node& node, std::string_view what, std::span<const std::string_view> words,
                 std::vector<std::string>& out) {
    const toml::array* list = node.as_array();
    if (!list) return wrong_type(node, what, "a list of words");
    out.clear();
    for (const toml::node& item : *list) {
      const int i = get_word(item, what, words);
      if (i < 0) continue;
      std::string word(words[static_cast<std::size_t>(i)]);
      if (std::find(out.begin(), out.end(), word) == out.end()) out.push_back(std::move(word));
    }
  }

  // --- Tables
  // -----------------------------------------------------------------------------------------------------

  /// Fills in everything but nested tables; true when nothing required is missing.
  template <class T>
  bool fill(const toml::table& table, std::string_view where, SceneKeys<T> keys, T& out) {
    return fill(table, where, keys.all, static_cast<void*>(&out));
  }
  bool fill(const toml::table& table, std::string_view where, std::span<const SceneKey> keys, void* out) {
    bool complete = true;
    for (const SceneKey& key : keys) {
      const toml::node* node = table.get(key.name);
      if (node) {
        get_field(*node, label(where, key.name), key, out);
      } else if (key.required) {
        const std::string missing = where.empty() ? fmt::format("[{}] is missing", key.name)
                                                  : fmt::format("{} needs the key \"{}\"", where, key.name);
        problem(std::max(1, line_of(table)), fmt::format("{}: {}", missing, key.doc));
        complete = false;
      }
    }
    return complete;
  }
  /// check_known and fill.
  template <class T>
  bool read_plain(const toml::table& table, std::string_view where, SceneKeys<T> keys, T& out) {
    check_known(table, where, names(keys.all));
    return fill(table, where, keys, out);
  }

  const toml::table* table_at(const toml::table& parent, std::string_view key) {
    const toml::node* node = parent.get(key);
    if (!node) return nullptr;
    if (const toml::table* table = node->as_table()) return table;
    if (node->is_array_of_tables()) {
      problem(line_of(*node), fmt::format("there is only one {}: write [{}], not [[{}]]", key, key, key));
    } else {
      wrong_type(*node, key, "a table");
    }
    return nullptr;
  }
  std::vector<const toml::table*> tables_at(const toml::table& parent, std::string_view key) {
    std::vector<const toml::table*> out;
    const toml::node* node = parent.get(key);
    if (!node) return out;
    if (node->is_table()) {
      problem(line_of(*node), fmt::format("there may be several of {0}: write it in double brackets, [[{0}]]", key));
      return out;
    }
    const toml::array* list = node->as_array();
    if (!list) {
      wrong_type(*node, key, "a list of tables");
      return out;
    }
    for (const toml::node& item : *list) {
      if (const toml::table* table = item.as_table()) out.push_back(table);
      else wrong_type(item, fmt::format("an item of {}", key), "a table");
    }
    return out;
  }

  void read_region(const toml::table& table, std::string_view where, SceneRegion& out) {
    out.line = line_of(table, {"box", "sphere", "half_space"});
    int found = 0;
    if (const toml::node* node = table.get("box")) {
      ++found;
      out.shape = SceneRegion::Shape::kBox;
      if (read_shape(*node, label(where, "box"), scene_box_keys(), out) &&
          (out.min.x >= out.max.x || out.min.y >= out.max.y || out.min.z >= out.max.z)) {
        problem(line_of(*node), fmt::format("box of {}: min must be less than max in every coordinate", where));
      }
    }
    if (const toml::node* node = table.get("sphere")) {
      ++found;
      out.shape = SceneRegion::Shape::kSphere;
      read_shape(*node, label(where, "sphere"), scene_sphere_keys(), out);
    }
    if (const toml::node* node = table.get("half_space")) {
      ++found;
      out.shape = SceneRegion::Shape::kHalfSpace;
      if (read_shape(*node, label(where, "half_space"), scene_half_space_keys(), out)) {
        read_direction(*node->as_table(), "normal", label(where, "half_space"), out.normal);
      }
    }
    if (found != 1) {
      problem(
          out.line,
          fmt::format("{} needs exactly one region: box = {{ min = [x, y, z], max = [x, y, z] }}, sphere = {{ center "
                      "= [x, y, z], radius = r }} or half_space = {{ point = [x, y, z], normal = [x, y, z] }}",
                      where));
    }
  }
  bool read_shape(const toml::node& node, const std::string& where, SceneKeys<SceneRegion> keys, SceneRegion& out) {
    const toml::table* table = node.as_table();
    if (!table) {
      wrong_type(node, where, "a table in braces");
      return false;
    }
    const std::size_t before = problems_.size();
    read_plain(*table, where, keys, out);
    return problems_.size() == before;
  }
  void read_direction(const toml::table& table, std::string_view key, std::string_view where, Vec3& v) {
    v = of_plain_length(v);
    if (!(norm(v) > 0)) problem(line_of(table, {key}), fmt::format("{} must not be zero", label(where, key)));
  }

  /// [body], or [[body]] several times.
  void read_bodies(const toml::table& root, Scene& scene) {
    const toml::node* node = root.get("body");
    if (!node) return;
    if (!node->is_array_of_tables()) {
      if (const toml::table* t = table_at(root, "body")) read_body(*t, scene.body);
      return;
    }
    bool first = true;
    for (const toml::table* t : tables_at(root, "body")) {
      read_body(*t, first ? scene.body : scene.more_bodies.emplace_back());
      first = false;
    }
  }

  void read_body(const toml::table& table, SceneBody& out) {
    read_plain(table, "[body]", scene_keys<SceneBody>(), out);
    if (const toml::table* t = table_at(table, "material"))
      read_plain(*t, "[body.material]", scene_keys<SceneBodyMaterial>(), out.material);
    if (const auto body = folders_.bodies.find(out.bound); body != folders_.bodies.end()) out.loaded = body->second;
    const bool model = table.contains("model"), visual = table.contains("visual"), bound = table.contains("bound");
    out.line = line_of(table, {"options", "model", "visual", "bound"});
    if (model + visual + bound != 1) {
      problem(line_of(table),
              "[body] needs exactly one of model = \"steak\", visual = \"file.obj\" or bound = \"file.kerf\"");
    }
    if (table.contains("collision") && !visual)
      problem(line_of(*table.get("collision")), "collision of [body] goes with visual");
    if (table.contains("collision_triangles") && (!visual || table.contains("collision")))
      problem(line_of(*table.get("collision_triangles")),
              "collision_triangles of [body] goes with visual alone: they are of the mesh that is made");
    if (table.contains("scale") && !visual) {
      problem(line_of(*table.get("scale")), "scale of [body] goes with visual: models and bound bodies are in metres");
    }
    if (table.contains("weld") && !visual)
      problem(line_of(*table.get("weld")),
              "weld of [body] goes with visual: models and bound bodies have no loose corners");
    if (const toml::node* size = table.get("size"); size != nullptr && out.model != "closed-sheet")
      problem(line_of(*size), "size of [body] goes with model = \"closed-sheet\"");
    for (const std::string_view key : {"thickness", "exact_paths"})
      if (bound && table.contains(key))
        problem(line_of(*table.get(key)),
                fmt::format("{} of [body] does not go with bound: a bound body has been through all that", key));
    if (model && !out.model.empty()) check_model(*table.get("model"));
    const toml::node* options = table.get("options");
    if (!options) return;
    if (!model) problem(line_of(*options), "options of [body] goes with model");
    const toml::table* table_of_options = table_at(table, "options");
    if (table_of_options) read_plain(*table_of_options, "options of [body]", scene_keys<ModelOptions>(), out.options);
  }

  void check_model(const toml::node& node) {
    std::vector<std::string_view> known;
    for (const ModelName& m : model_names()) known.push_back(m.name);
    get_word(node, "model of [body]", known);
  }

  void read_material(const toml::table& table, SceneMaterial& out) {
    read_plain(table, "[material]", scene_keys<SceneMaterial>(), out);
    for (const toml::table* t : tables_at(table, "region")) {
      constexpr std::string_view where = "[[material.region]]";
      SceneMaterialRegion& region = out.regions.emplace_back();
      read_plain(*t, where, scene_keys<SceneMaterialRegion>(), region);
      read_region(*t, where, region.region);
      if (!t->contains("young") && !t->contains("poisson") && !t->contains("density")) {
        problem(line_of(*t), fmt::format("{} changes nothing: give young, poisson or density", where));
      }
    }
  }

  void read_lattice(const toml::table& table, SceneLattice& out) {
    read_plain(table, "[lattice]", scene_keys<SceneLattice>(), out);
    const bool cells = table.contains("cells"), size = table.contains("cell_size"), origin = table.contains("origin");
    out.line = line_of(table, {"cells", "cell_size", "layers"});
    if (cells && size && !origin)
      problem(line_of(*table.get("cell_size")), "[lattice] takes cells or cell_size; both only with origin");
    if (origin && !(cells && size))
      problem(line_of(*table.get("origin")), "origin of [lattice] goes with both cells and cell_size");
    if (table.contains("axes") && !cells && !size)
      problem(line_of(*table.get("axes")), "axes of [lattice] goes with cells or cell_size");
    if (table.contains("layers") && (cells || size))
      problem(line_of(*table.get("layers")), "layers of [lattice] stands instead of cells and cell_size");
    if (!out.axes) return;
    const std::array<Vec3, 3>& a = *out.axes;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = i; j < 3; ++j) {
        if (std::abs(dot(a[i], a[j]) - (i == j ? 1 : 0)) > kOrthonormalTolerance) {
          return problem(line_of(*table.get("axes")), "axes of [lattice] must be unit vectors at right angles");
        }
      }
    }
    if (dot(cross(a[0], a[1]), a[2]) < 0)
      problem(line_of(*table.get("axes")), "axes of [lattice] must be right-handed: swap two of them");
  }

  void read_load(const toml::table& table, SceneLoad& out) {
    read_plain(table, "[[load]]", scene_keys<SceneLoad>(), out);
    out.line = line_of(table, {"point"});
    if (out.until && *out.until <= out.from)
      problem(
          line_of(table, {"until"}),
          fmt::format("until of [[load]] must be later than from, but {} is not later than {}", *out.until, out.from));
  }

  // --- Obstacles and tools
  // --------------------------------------------------------------------------------------------------

  /// Refuses keys of other shapes and kinds, and asks for those that this one needs.
  void check_keys_of(const toml::table& table, std::string_view where, std::string_view kind,
                     std::initializer_list<std::string_view> takes, std::initializer_list<std::string_view> needs,
                     std::initializer_list<std::string_view> all) {
    const auto in = [](std::string_view key, std::initializer_list<std::string_view> list) {
      return std::find(list.begin(), list.end(), key) != list.end();
    };
    for (const std::string_view key : all)
      if (const toml::node* node = table.get(key); node && !in(key, takes) && !in(key, needs))
        problem(line_of(*node), fmt::format("{} of {} does not go with {}", key, where, kind));
    for (const std::string_view key : needs)
      if (!table.contains(key)) problem(line_of(table), fmt::format("{}: a {} needs {}", where, kind, key));
  }

  /// Poses whose times ascend; the turn of one without rotation is that of the one before.
  void read_timed(const toml::table& table, std::string_view key, Vec3 rotation, std::vector<ScenePose>& out) {
    const std::size_t before_all = problems_.size();
    for (const toml::table* t : tables_at(table, key)) {
      const std::size_t before = problems_.size();
      ScenePose pose;
      pose.rotation = out.empty() ? rotation : out.back().rotation;
      read_plain(*t, fmt::format("a pose of {}", key), scene_keys<ScenePose>(), pose);
      if (problems_.size() > before) continue;
      if (!out.empty() && pose.time <= out.back().time) {
        problem(line_of(*t),
                fmt::format("times of {} must increase, but {} follows {}", key, pose.time, out.back().time));
      }
      out.push_back(pose);
    }
    if (out.empty() && table.contains(key) && problems_.size() == before_all)
      problem(line_of(*table.get(key)), fmt::format("{} is empty: give at least one pose", key));
  }

  void read_obstacle(const toml::table& table, SceneObstacle& out) {
    constexpr std::string_view where = "[[obstacle]]";
    out.line = line_of(table);
    const std::size_t before = problems_.size();
    read_plain(table, where, scene_keys<SceneObstacle>(), out);
    read_timed(table, "moves", out.rotation, out.moves);
    if (problems_.size() > before) return;
    const auto check = [&](std::string_view kind, std::initializer_list<std::string_view> takes,
                           std::initializer_list<std::string_view> needs) {
      check_keys_of(table, where, kind, takes, needs, {"radius", "length", "size", "mesh", "model", "scale"});
    };
    switch (out.shape) {
      case SceneShape::kPlane: return check("plane", {}, {});
      case SceneShape::kSphere: return check("sphere", {}, {"radius"});
      case SceneShape::kCapsule: return check("capsule", {}, {"radius", "length"});
      case SceneShape::kBox: return check("box", {}, {"size"});
      case SceneShape::kMesh: break;
    }
    check("mesh", {"mesh", "model", "scale"}, {});
    if (table.contains("mesh") == table.contains("model"))
      return problem(line_of(table, {"model", "shape"}),
                     "[[obstacle]] of shape mesh needs either mesh = \"file.obj\" or model = \"ball\"");
    if (out.model.empty()) return;
    std::vector<std::string_view> known;
    for (const RigidModelName& m : rigid_model_names()) known.push_back(m.name);
    get_word(*table.get("model"), "model of [[obstacle]]", known);
  }

  void read_tool(const toml::table& table, SceneRigidTool& out) {
    constexpr std::string_view where = "[[tool]]";
    out.line = line_of(table);
    const std::size_t before = problems_.size();
    read_plain(table, where, scene_keys<SceneRigidTool>(), out);
    if (problems_.size() > before) return;
    const auto check = [&](std::string_view kind, std::initializer_list<std::string_view> takes,
                           std::initializer_list<std::string_view> needs) {
      check_keys_of(table, where, kind, takes, needs,
                    {"length", "radius", "tip", "width", "thickness", "opening", "sharp", "mesh", "scale"});
    };
    switch (out.kind) {
      case SceneToolKind::kProbe:
        if (!out.mesh.empty()) return check("probe with a mesh", {"mesh", "scale"}, {});
        return check("probe", {"length", "radius", "tip"}, {});
      case SceneToolKind::kGrasper: return check("grasper", {"length", "radius", "tip", "width", "opening"}, {});
      case SceneToolKind::kScalpel:
        return check("scalpel", {"length", "radius", "tip", "width", "thickness", "sharp"}, {});
      case SceneToolKind::kScissors:
        return check("pair of scissors", {"length", "radius", "tip", "width", "thickness", "opening", "sharp"}, {});
      case SceneToolKind::kSphere: return check("sphere", {"radius"}, {});
      case SceneToolKind::kMesh: return check("mesh", {"scale"}, {"mesh"});
      case SceneToolKind::kShaver: return check("shaver", {"length", "radius"}, {});
    }
  }

  /// Ids of tools are different, and commands name tools that there are.
  void check_tools(const Scene& scene) {
    std::vector<std::string_view> ids;
    for (const SceneRigidTool& tool : scene.tools) {
      if (std::find(ids.begin(), ids.end(), tool.id) != ids.end())
        problem(tool.line, fmt::format("there is a tool \"{}\" already; give this one another id", tool.id));
      ids.push_back(tool.id);
    }
    const auto check = [&](const SceneCommand& c, std::string_view verb,
                           const std::string& id) -> const SceneRigidTool* {
      const auto found = std::find(ids.begin(), ids.end(), id);
      if (found != ids.end()) return &scene.tools[static_cast<std::size_t>(found - ids.begin())];
      std::string text = fmt::format("{} at {} s: there is no tool \"{}\"", verb, c.at, id);
      if (const std::string_view closest = closest_word(id, ids); !closest.empty())
        text += fmt::format("; did you mean \"{}\"?", closest);
      else text += ids.empty() ? "; make one with [[tool]]" : fmt::format("; known are {}", fmt::join(ids, ", "));
      problem(c.line, std::move(text));
      return nullptr;
    };
    for (const SceneCommand& c : scene.commands) {
      if (const auto* motion = std::get_if<SceneToolMotion>(&c.what)) {
        check(c, "tool", motion->id);
      } else if (const auto* jaws = std::get_if<SceneJaws>(&c.what)) {
        const std::string_view verb = jaws->close ? "close" : "open";
        const SceneRigidTool* tool = check(c, verb, jaws->id);
        if (tool && !has_jaws(*tool))
          problem(c.line,
                  fmt::format("{} at {} s: \"{}\" has no jaws; graspers and scissors have", verb, c.at, jaws->id));
      }
    }
  }

  void read_output(const toml::table& table, Scene& scene) {
    read_plain(table, "[output]", scene_keys<SceneOutput>(), scene.output);
    const toml::table* t = table_at(table, "camera");
    if (!t) return;
    SceneCamera& camera = scene.output.camera;
    read_plain(*t, "[output.camera]", scene_keys<SceneCamera>(), camera);
    read_direction(*t, "direction", "[output.camera]", camera.direction);
    read_direction(*t, "up", "[output.camera]", camera.up);
    if (norm(camera.direction) > 0 && norm(camera.up) > 0 &&
        norm(cross(normalized(camera.direction), normalized(camera.up))) < 1e-6) {
      problem(line_of(*t, {"up", "direction"}),
              fmt::format("up of [output.camera] must not be parallel to direction{}",
                          t->contains("up") ? "" : "; give another up, by default it is [0, 0, 1]"));
    }
  }

  // --- Commands
  // ---------------------------------------------------------------------------------------------------

  template <class T>
  T read_one_command(const toml::table& table, std::string_view where) {
    std::vector<std::string_view> known = names(scene_keys<SceneCommand>().all);
    add_names(known, scene_keys<T>().all);
    check_known(table, where, known);
    T out;
    fill(table, where, scene_keys<T>(), out);
    return out;
  }

  void read_command(const toml::table& table, Scene& scene) {
    SceneCommand command;
    command.line = line_of(table);
    if (!fill(table, "[[command]]", scene_keys<SceneCommand>(), command)) return;
    const int type = get_word(*table.get("type"), "type of [[command]]", kSceneCommandTypes);
    if (type < 0) return;
    const std::string where(kSceneCommandTypes[type]);
    switch (type) {
      case 0: {
        SceneBlade blade = read_one_command<SceneBlade>(table, where);
        if (table.contains("poses")) read_poses(table, blade.poses, "blade");
        command.what = std::move(blade);
        break;
      }
      case 1: command.what = read_one_command<SceneGrasp>(table, where); break;
      case 2:
        command.what = read_one_command<SceneMove>(table, where);
        if (table.contains("by") && table.contains("to"))
          problem(line_of(table, {"to", "by"}), "move has both by and to; leave one of them out");
        else if (!table.contains("by") && !table.contains("to")) problem(line_of(table), "move needs either by or to");
        break;
      case 3: command.what = read_one_command<SceneRelease>(table, where); break;
      case 4: {
        SceneFixCommand fix = read_one_command<SceneFixCommand>(table, where);
        read_region(table, where, fix.region);
        command.what = fix;
        break;
      }
      case 5: {
        SceneUnfix unfix = read_one_command<SceneUnfix>(table, where);
        read_region(table, where, unfix.region);
        command.what = unfix;
        break;
      }
      case 6: command.what = read_one_command<SceneUndo>(table, where); break;
      case 7: command.what = read_one_command<SceneRedo>(table, where); break;
      case 8: {
        SceneToolMotion motion = read_one_command<SceneToolMotion>(table, where);
        read_tool_poses(table, scene, motion);
        command.what = std::move(motion);
        break;
      }
      case 11: {
        ScenePunch punch = read_one_command<ScenePunch>(table, where);
        read_punch(table, punch);
        command.what = std::move(punch);
        break;
      }
      case 12: {
        SceneShave shave = read_one_command<SceneShave>(table, where);
        if (table.contains("poses")) read_poses(table, shave.poses, "shaver");
        command.what = std::move(shave);
        break;
      }
      case 13: {
        SceneRemove remove = read_one_command<SceneRemove>(table, where);
        const bool region = table.contains("box") || table.contains("sphere") || table.contains("half_space");
        if (region && table.contains("grasp"))
          problem(line_of(table, {"grasp"}), "remove has both a grasp and a region; leave one of them out");
        else if (!region && !table.contains("grasp"))
          problem(line_of(table), "remove needs either a grasp or one region: box, sphere or half_space");
        else if (region) read_region(table, where, remove.region);
        command.what = std::move(remove);
        break;
      }
      default: {
        SceneJaws jaws = read_one_command<SceneJaws>(table, where);
        jaws.close = where == "close";
        command.what = std::move(jaws);
        break;
      }
    }
    scene.commands.push_back(std::move(command));
  }

  /// A first pose without rotation keeps the tool's, as the scene left it: that of its last pose above in the file.
  void read_tool_poses(const toml::table& table, const Scene& scene, SceneToolMotion& out) {
    Vec3 rotation;
    for (const SceneRigidTool& tool : scene.tools)
      if (tool.id == out.id) rotation = tool.rotation;
    for (const SceneCommand& c : scene.commands)
      if (const auto* before = std::get_if<SceneToolMotion>(&c.what);
          before && before->id == out.id && !before->poses.empty())
        rotation = before->poses.back().rotation;
    read_timed(table, "poses", rotation, out.poses);
  }

  void read_poses(const toml::table& table, std::vector<SceneBladePose>& out, std::string_view tool) {
    const toml::node& node = *table.get("poses");
    int number = 0;
    for (const toml::table* t : tables_at(table, "poses")) {
      const std::size_t before = problems_.size();
      ++number;
      SceneBladePose pose;
      read_plain(*t, "a pose", scene_keys<SceneBladePose>(), pose);
      if (problems_.size() > before) continue;
      if (!(norm(pose.tip - pose.base) > 0)) {
        problem(line_of(*t),
                fmt::format("the {} has zero length: base and tip of pose {} are the same point", tool, number));
      }
      if (!out.empty() && pose.time <= out.back().time) {
        problem(line_of(*t),
                fmt::format("times of poses must increase, but {} follows {}", pose.time, out.back().time));
      }
      out.push_back(pose);
    }
    if (const toml::array* list = node.as_array(); list && list->size() < 2) {
      problem(line_of(node),
              fmt::format("a {} needs at least two poses to sweep between, but has {}", tool, list->size()));
    }
  }

  void read_punch(const toml::table& table, ScenePunch& out) {
    const bool polygon = out.shape == ScenePunchShape::kPolygon;
    if (!table.contains(polygon ? "points" : "radius"))
      problem(line_of(table, {"shape", "type"}),
              polygon ? "a polygon punch needs points" : "a round punch needs a radius");
    if (table.contains(polygon ? "radius" : "points"))
      problem(line_of(table, {polygon ? "radius" : "points"}),
              polygon ? "a polygon punch has no radius, its points say how large it is"
                      : "a round punch has no points; with them give shape = \"polygon\"");
    read_direction(table, "axis", "punch", out.axis);
    const Vec3 a = std::exchange(out.across, of_plain_length(out.across));
    if (norm(out.axis) > 0 && !(norm(cross(normalized(out.axis), out.across)) > 1e-9 * norm(out.across))) {
      problem(
          line_of(table, {"across", "axis"}),
          fmt::format(
              "across of punch must have a part across the axis, but {} [{}, {}, {}]; give across = another direction, where the outline's x points",
              table.contains("across") ? "is" : "is by default", a.x, a.y, a.z));
    }
    const toml::node* node = table.get("points");
    if (!node) return;
    const toml::array* list = node->as_array();
    if (!list) return wrong_type(*node, "points of punch", "a list of [x, y]");
    for (const toml::node& item : *list) {
      const toml::array* pair = item.as_array();
      Vec2 p;
      bool good = pair && pair->size() == 2;
      for (std::size_t i = 0; good && i < 2; ++i) {
        const auto number = (*pair)[i].value<double>();
        good = number && std::fabs(*number) <= kFarthestPlace;
        if (good) (i == 0 ? p.x : p.y) = *number;
      }
      if (!good) return problem(line_of(item), "a point of a punch is [x, y], two numbers in metres, up to 1e6");
      out.points.push_back(p);
    }
    if (out.points.size() < 3)
      problem(line_of(*node), fmt::format("a polygon needs at least three points, but has {}", out.points.size()));
  }

  void check_grasps(const Scene& scene) {
    std::map<std::string, int, std::less<>> held;  // id -> line
    std::vector<std::string_view> known;
    for (const SceneCommand& c : scene.commands) {
      if (const auto* grasp = std::get_if<SceneGrasp>(&c.what)) known.push_back(grasp->id);
    }
    const auto check = [&](const SceneCommand& c, std::string_view verb, const std::string& id) {
      if (held.count(id) > 0) return;
      std::string text = fmt::format("{} at {} s: nothing is held as \"{}\" then", verb, c.at, id);
      if (std::find(known.begin(), known.end(), id) == known.end()) {
        if (const std::string_view closest = closest_word(id, known); !closest.empty()) {
          text += fmt::format("; did you mean \"{}\"?", closest);
        } else {
          text += "; no grasp command has this id";
        }
      } else {
        text += "; its grasp comes later, or it has been released";
      }
      problem(c.line, std::move(text));
    };
    for (const SceneCommand& c : scene.commands) {
      if (const auto* grasp = std::get_if<SceneGrasp>(&c.what)) {
        if (!held.emplace(grasp->id, c.line).second) {
          problem(c.line, fmt::format("grasp at {} s: \"{}\" already holds something (line {}); release it "
                                      "first or take another id",
                                      c.at, grasp->id, held.find(grasp->id)->second));
        }
      } else if (const auto* move = std::get_if<SceneMove>(&c.what)) {
        check(c, "move", move->id);
      } else if (const auto* release = std::get_if<SceneRelease>(&c.what)) {
        check(c, "release", release->id);
        held.erase(release->id);
      } else if (const auto* remove = std::get_if<SceneRemove>(&c.what); remove && !remove->grasp.empty()) {
        check(c, "remove", remove->grasp);
        held.erase(remove->grasp);
      }
    }
  }

  void check_times(const toml::table& root, const Scene& scene) {
    const double end = scene.simulation.duration * (1 + kTimeTolerance) + kTimeTolerance;
    for (const SceneCommand& c : scene.commands) {
      double last = c.at;
      if (const auto* blade = std::get_if<SceneBlade>(&c.what)) last += blade->poses.back().time;
      if (const auto* shave = std::get_if<SceneShave>(&c.what)) last += shave->poses.back().time;
      if (const auto* move = std::get_if<SceneMove>(&c.what)) last += move->over;
      if (const auto* motion = std::get_if<SceneToolMotion>(&c.what); motion && !motion->poses.empty())
        last += motion->poses.back().time;
      if (const auto* jaws = std::get_if<SceneJaws>(&c.what)) last += jaws->over;
      if (last > end) {
        problem(c.line,
                fmt::format("this command ends at {:.6g} s, after the end of the run; duration of [simulation] is {} s",
                            last, scene.simulation.duration));
      }
    }
    if (const std::string fault = time_step_fault(scene.simulation); !fault.empty())
      problem(line_in(root, "simulation", {"time_step", "duration"}), fault);
    if (scene.output.picture_at && *scene.output.picture_at > end) {
      problem(line_in(root, "output", {"picture_at"}),
              fmt::format("picture_at of [output] ({} s) is after the end of the run ({} s)", *scene.output.picture_at,
                          scene.simulation.duration));
    }
  }

  static int line_in(const toml::table& root, std::string_view table, std::initializer_list<std::string_view> keys) {
    const toml::node* node = root.get(table);
    return node && node->is_table() ? line_of(*node->as_table(), keys) : 1;
  }

  struct Problem {
    int line;
    std::string text;
  };
  std::string file_;
  const SceneFolders& folders_;
  std::vector<SceneFileUse> files_;
  std::vector<Problem> problems_;
};

/// What the library says, without names of its own source, and with what to do about it.
std::string toml_fault(std::string_view description) {
  std::string text(description);
  if (const std::size_t macro = text.find(" (TOML_"); macro != std::string::npos)
    text.erase(macro, text.find(')', macro) + 1 - macro);
  if (text.find("end-of-file") != std::string::npos) text += "; the file may be cut off";
  return text;
}

Error toml_error(const toml::parse_error& error, std::string_view name) {
  return bad_input(fmt::format("{}:{}: {}", shown(name), error.source().begin.line,
                               shown(toml_fault(error.description()), kMostOfSentence)));
}

Result<toml::table> parse_toml(std::string_view text, std::string_view name) {
#if TOML_EXCEPTIONS
  try {
    return toml::table(toml::parse(text));  // its reader takes memory for a name where it may not throw
  } catch (const toml::parse_error& error) {
    return toml_error(error, name);
  }
#else
  toml::parse_result parsed = toml::parse(text);
  if (!parsed) return toml_error(parsed.error(), name);
  return std::move(parsed).table();
#endif
}

}  // namespace

Result<Scene> parse_scene(std::string_view text, std::string_view name, const SceneFolders& folders) {
  KERF_TRY(check_toml_characters(text, name));
  const Result<toml::table> parsed = parse_toml(text, name);
  if (!parsed) return parsed.error();
  Result<Scene> scene = SceneReader(shown(name), folders).read(*parsed);
  if (scene.ok()) {
    scene->name = std::filesystem::path(std::string(name)).stem().string();
    scene->file = std::string(name);
  }
  return scene;
}

Result<SceneCommand> parse_command(std::string_view text, std::string_view name, double now,
                                   std::span<const SceneRigidTool> tools) {
  KERF_TRY(check_toml_characters(text, name));
  Result<toml::table> parsed = parse_toml(text, name);
  if (!parsed) return parsed.error();
  const SceneFolders nowhere;  // commands name no files
  return SceneReader(shown(name), nowhere).read_alone(std::move(*parsed), now, tools);
}

Result<Scene> read_scene(const std::filesystem::path& path, const std::vector<std::filesystem::path>& meshes) {
  const auto text = read_whole_file(path.string(), kSceneFile);
  if (!text) return text.error();
  SceneFolders folders(path.parent_path());
  folders.meshes = meshes;
  return within_memory(path.string(), [&] { return parse_scene(text->view(), path.string(), folders); });
}

}  // namespace kerf
