#include "kerf/scene/scene_schema.h"

#include <fmt/format.h>

#include "kerf/base/overloaded.h"
#include "kerf/scene/scene_keys.h"

namespace kerf {
namespace {

std::string in_quotes(std::string_view s) { return fmt::format("\"{}\"", s); }
std::string text(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }
std::string joined(std::span<const std::string_view> words) { return fmt::format("{}", fmt::join(words, ", ")); }

std::string type_text(const SceneKey& key) {
  return std::visit(
      Overloaded{
          [](SceneMember<double>) { return std::string("number"); },
          [](SceneMember<std::optional<double>>) { return std::string("number"); },
          [](SceneMember<int>) { return std::string("whole number"); },
          [](SceneMember<std::optional<int>>) { return std::string("whole number"); },
          [](SceneMember<std::int64_t>) { return std::string("whole number"); },
          [](SceneMember<std::uint64_t>) { return std::string("whole number"); },
          [](SceneMember<bool>) { return std::string("true or false"); },
          [](SceneMember<std::optional<bool>>) { return std::string("true or false"); },
          [](SceneMember<std::string>) { return std::string("text"); },
          [](SceneMember<Vec3>) { return std::string("[x, y, z]"); },
          [](SceneMember<std::optional<Vec3>>) { return std::string("[x, y, z]"); },
          [](SceneMember<std::array<int, 2>>) { return std::string("[i, j]"); },
          [](SceneMember<std::optional<std::array<int, 3>>>) { return std::string("[i, j, k]"); },
          [](SceneMember<std::optional<std::array<Vec3, 3>>>) { return std::string("[[x, y, z], [..], [..]]"); },
          [](const SceneChoice& c) { return "one of " + joined(c.words); },
          [](const SceneWords& w) { return "list of " + joined(w.words); },
          [](const SceneFilePath&) { return std::string("file"); },
          [](const SceneNested& n) { return std::string(n.type); },
      },
      key.field);
}

/// `table` is a struct as it is where a scene says nothing.
std::string default_text(const SceneKey& key, void* table) {
  if (key.required) return "required";
  return std::visit(
      Overloaded{
          [&](SceneMember<double> m) { return fmt::format("{}", m.of(table)); },
          [](SceneMember<std::optional<double>>) { return std::string("-"); },
          [&](SceneMember<int> m) { return fmt::format("{}", m.of(table)); },
          [](SceneMember<std::optional<int>>) { return std::string("-"); },
          [&](SceneMember<std::int64_t> m) { return fmt::format("{}", m.of(table)); },
          [&](SceneMember<std::uint64_t> m) { return fmt::format("{}", m.of(table)); },
          [&](SceneMember<bool> m) { return fmt::format("{}", m.of(table)); },
          [](SceneMember<std::optional<bool>>) { return std::string("-"); },
          [&](SceneMember<std::string> m) { return m.of(table).empty() ? std::string("-") : in_quotes(m.of(table)); },
          [&](SceneMember<Vec3> m) { return text(m.of(table)); },
          [](SceneMember<std::optional<Vec3>>) { return std::string("-"); },
          [&](SceneMember<std::array<int, 2>> m) { return fmt::format("[{}, {}]", m.of(table)[0], m.of(table)[1]); },
          [](SceneMember<std::optional<std::array<int, 3>>>) { return std::string("-"); },
          [](SceneMember<std::optional<std::array<Vec3, 3>>>) { return std::string("-"); },
          [&](const SceneChoice& c) { return in_quotes(c.words[static_cast<std::size_t>(c.get(table))]); },
          [&](const SceneWords& w) {
            std::vector<std::string> words;
            for (const std::string& word : w.list.of(table)) words.push_back(in_quotes(word));
            return fmt::format("[{}]", fmt::join(words, ", "));
          },
          [](const SceneFilePath&) { return std::string("-"); },
          [](const SceneNested&) { return std::string("-"); },
      },
      key.field);
}

std::string range_text(const SceneRange& r) {
  const bool low = r.min > -std::numeric_limits<double>::infinity();
  const bool high = r.max < std::numeric_limits<double>::infinity();
  std::string out;
  if (low) out += fmt::format("{} {}", r.above_min ? ">" : ">=", r.min);
  if (low && high) out += " and ";
  if (high) out += fmt::format("{} {}", r.below_max ? "<" : "<=", r.max);
  return out;
}

template <class T>
void add(std::vector<SceneKeyDoc>& out, std::string table, SceneKeys<T> keys) {
  T as_it_comes{};
  for (const SceneKey& key : keys.all) {
    out.push_back({table, std::string(key.name), type_text(key), std::string(key.unit), range_text(key.range),
                   default_text(key, &as_it_comes), std::string(key.doc)});
  }
}

constexpr std::string_view kIntroduction =
    "A scene is a TOML file. Lengths are metres, times seconds, angles radians. z is up. Coordinates are\n"
    "those of the body at rest unless a key says otherwise. \"-\" as a default means that nothing is given;\n"
    "the description says what happens then.\n";

/// By this name a link in Markdown finds a heading: small letters, "-" for a blank, no signs but "_" and "-".
std::string anchor(std::string_view heading) {
  std::string out;
  for (const char c : heading) {
    if (c == ' ') out += '-';
    else if (c >= 'A' && c <= 'Z') out += static_cast<char>(c - 'A' + 'a');
    else if (c == '_' || c == '-' || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) out += c;
  }
  return out;
}

/// Breaks text at blanks so that no line is longer than width; every line starts with `indent` blanks.
std::string wrapped(std::string_view words, std::size_t indent, std::size_t width) {
  std::string out, line(indent, ' ');
  while (!words.empty()) {
    const std::size_t end = std::min(words.find(' '), words.size());
    const std::string_view word = words.substr(0, end);
    if (line.size() > indent && line.size() + 1 + word.size() > width) {
      out += line + "\n";
      line.assign(indent, ' ');
    }
    if (line.size() > indent) line += ' ';
    line += word;
    words.remove_prefix(std::min(end + 1, words.size()));
  }
  return out + line + "\n";
}

}  // namespace

std::vector<SceneKeyDoc> scene_schema() {
  std::vector<SceneKeyDoc> out;
  add(out, "", scene_keys<Scene>());
  add(out, "[body]", scene_keys<SceneBody>());
  add(out, "options = {...}", scene_keys<ModelOptions>());
  add(out, "[material]", scene_keys<SceneMaterial>());
  add(out, "[[material.region]]", scene_keys<SceneMaterialRegion>());
  add(out, "[body.material]", scene_keys<SceneBodyMaterial>());
  add(out, "[lattice]", scene_keys<SceneLattice>());
  add(out, "[cut]", scene_keys<SceneCut>());
  add(out, "[simulation]", scene_keys<SceneSimulation>());
  add(out, "[[fix]]", scene_keys<SceneFix>());
  add(out, "[[load]]", scene_keys<SceneLoad>());
  add(out, "[[bond]]", scene_keys<SceneBond>());
  add(out, "[lesion]", scene_lesion_keys());
  add(out, "[arthroscope]", scene_keys<SceneArthroscope>());
  add(out, "[contact]", scene_keys<SceneContact>());
  add(out, "[[obstacle]]", scene_keys<SceneObstacle>());
  add(out, "[[tool]]", scene_keys<SceneRigidTool>());
  add(out, "moves = [{...}], poses of tools", scene_keys<ScenePose>());
  add(out, "[[command]]", scene_keys<SceneCommand>());
  add(out, "[[command]] type = \"blade\"", scene_keys<SceneBlade>());
  add(out, "poses = [{...}]", scene_keys<SceneBladePose>());
  add(out, "[[command]] type = \"punch\"", scene_keys<ScenePunch>());
  add(out, "[[command]] type = \"shave\"", scene_keys<SceneShave>());
  add(out, "[[command]] type = \"remove\"", scene_keys<SceneRemove>());
  add(out, "[[command]] type = \"grasp\"", scene_keys<SceneGrasp>());
  add(out, "[[command]] type = \"move\"", scene_keys<SceneMove>());
  add(out, "[[command]] type = \"release\"", scene_keys<SceneRelease>());
  add(out, "[[command]] type = \"fix\"", scene_keys<SceneFixCommand>());
  add(out, "[[command]] type = \"unfix\"", scene_keys<SceneUnfix>());
  add(out, "[[command]] type = \"undo\"", scene_keys<SceneUndo>());
  add(out, "[[command]] type = \"redo\"", scene_keys<SceneRedo>());
  add(out, "[[command]] type = \"tool\"", scene_keys<SceneToolMotion>());
  add(out, "[[command]] type = \"close\" or \"open\"", scene_keys<SceneJaws>());
  add(out, "box = {...}", scene_box_keys());
  add(out, "sphere = {...}", scene_sphere_keys());
  add(out, "half_space = {...}", scene_half_space_keys());
  add(out, "[output]", scene_keys<SceneOutput>());
  add(out, "[output.camera]", scene_keys<SceneCamera>());
  return out;
}

std::string scene_schema_text() {
  std::string out(kIntroduction);
  std::string table = "?";
  for (const SceneKeyDoc& k : scene_schema()) {
    if (k.table != table) {
      table = k.table;
      out += fmt::format("\n{}\n", table.empty() ? "Top level" : table);
    }
    std::string what = k.type;
    if (!k.unit.empty()) what += ", " + k.unit;
    if (!k.range.empty()) what += ", " + k.range;
    out += wrapped(
        fmt::format("{}: {}; {}{}", k.key, what, k.default_value == "required" ? "" : "default ", k.default_value), 2,
        100);
    out += wrapped(k.doc, 6, 100);
  }
  return out;
}

std::string scene_schema_markdown() {
  std::string out = "# Scene files\n\n";
  out += kIntroduction;
  out += "\nThis page is what `kerf info --schema --markdown` prints. Tables, after the [top level](#top-level):\n\n";
  const std::vector<SceneKeyDoc> keys = scene_schema();
  std::string listed;
  for (const SceneKeyDoc& k : keys) {
    if (k.table == listed) continue;
    listed = k.table;
    out += fmt::format("* [`{}`](#{})\n", listed, anchor(listed));
  }
  std::string table = "?";
  for (const SceneKeyDoc& k : keys) {
    if (k.table != table) {
      table = k.table;
      out += table.empty() ? "\n## Top level\n" : fmt::format("\n## `{}`\n", table);
      out += "\n| key | type | unit | range | default | |\n|---|---|---|---|---|---|\n";
    }
    const std::string value = k.default_value == "required" || k.default_value == "-"
                                  ? k.default_value
                                  : fmt::format("`{}`", k.default_value);
    out += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", k.key, k.type, k.unit, k.range, value, k.doc);
  }
  return out;
}

}  // namespace kerf
