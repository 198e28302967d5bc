#include "kerf/record/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "kerf/base/shown_text.h"
#include "kerf/mesh/base64.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/json_value.h"
#include "kerf/record/recording_meshes.h"
#include "kerf/scene/body_nature.h"
#include "kerf/scene/scene_limits.h"

namespace kerf {
namespace {

using Json = nlohmann::ordered_json;
using Kind = SessionChange::Kind;

constexpr int kRecordingVersion = 1;
constexpr const char* kNoRecording = "this is no recording of kerf; kerf run SCENE --out DIR --record FILE makes one";
constexpr std::uint64_t kMostSteps = 1'000'000'000;
constexpr std::size_t kDeepest = 16;  // four levels are in a recording; a value is taken apart as deep as it is nested

struct KindWord {
  Kind kind;
  const char* word;
  int values;  ///< how many; -1: a region, -2: a punch
};
constexpr std::array<KindWord, 20> kKinds{{
    {Kind::kBeginStroke, "begin_stroke", 1},
    {Kind::kBlade, "blade", 6},
    {Kind::kEndStroke, "end_stroke", 0},
    {Kind::kCancelStroke, "cancel_stroke", 0},
    {Kind::kUndo, "undo", 0},
    {Kind::kRedo, "redo", 0},
    {Kind::kGrasp, "grasp", 0},
    {Kind::kMove, "move", 4},
    {Kind::kRelease, "release", 0},
    {Kind::kFix, "fix", -1},
    {Kind::kUnfix, "unfix", -1},
    {Kind::kGravity, "gravity", 3},
    {Kind::kMaterial, "material", 3},
    {Kind::kPunch, "punch", -2},
    {Kind::kShave, "shave", 10},
    {Kind::kRemove, "remove", 0},
    {Kind::kSuck, "suck", -1},
    {Kind::kTool, "tool", 7},
    {Kind::kJaws, "jaws", 2},
    {Kind::kLift, "lift", 0},
}};
const KindWord& word_of(Kind kind) { return kKinds[static_cast<std::size_t>(kind)]; }
bool has_id(Kind kind) {
  return kind == Kind::kGrasp || kind == Kind::kMove || kind == Kind::kRelease || kind == Kind::kTool ||
         kind == Kind::kJaws;
}

}  // namespace

bool plain_file_name(const std::string& name) {
  return !name.empty() && name.size() < 200 && name != "." && name != ".." && name.find('/') == std::string::npos &&
         name.find('\\') == std::string::npos && name.find('\0') == std::string::npos;
}

namespace {

/// Places, gravity and materials as scenes may have them.
Status check_limits(const SessionChange& c) {
  const auto places = [&](std::size_t from, std::size_t to) -> Status {
    for (std::size_t i = from; i < std::min(to, c.values.size()); ++i)
      if (std::abs(c.values[i]) > kFarthestPlace)
        return bad_input(fmt::format("\"{}\" names a place {:g} m from the origin; {:g} m is the farthest",
                                     word_of(c.kind).word, std::abs(c.values[i]), kFarthestPlace));
    return {};
  };
  const auto range = [&](std::size_t i, const char* what, const char* unit, double least, double most) -> Status {
    if (c.values[i] >= least && c.values[i] <= most) return {};
    return bad_input(fmt::format("{} goes from {:g} to {:g}{}{}, but is {:g}", what, least, most, *unit ? " " : "",
                                 unit, c.values[i]));
  };
  switch (c.kind) {
    case Kind::kBlade: return places(0, 6);
    case Kind::kMove:
    case Kind::kTool: return places(0, 3);
    case Kind::kShave: return places(1, 8);
    case Kind::kPunch: KERF_TRY(places(3, 6)); return places(12, c.values.size());
    case Kind::kFix:
    case Kind::kUnfix:
    case Kind::kSuck: return places(1, c.values[0] == 2 ? 4 : 1);  // boxes and balls may be as large as anybody likes
    case Kind::kGravity:
      for (std::size_t i = 0; i < 3; ++i) KERF_TRY(range(i, "gravity", "m/s2", -kMostGravity, kMostGravity));
      return {};
    case Kind::kMaterial: return check_nature({c.values[0], c.values[1], c.values[2], {}}, "material");
    default: return {};
  }
}

}  // namespace

Status check(const SessionChange& c) {
  const int wanted = word_of(c.kind).values;
  if (c.kind == Kind::kRemove && c.vertices.size() != 1) return bad_input("\"remove\" names one collision triangle");
  for (const double v : c.values)
    if (!std::isfinite(v))
      return bad_input(fmt::format("\"{}\" has a value that is not finite; give numbers", word_of(c.kind).word));
  if (wanted >= 0) {
    // A stroke's frame came later: without it, the world's.
    const bool framed = c.kind == Kind::kBeginStroke && c.values.size() == 2;
    if (!framed && c.values.size() != static_cast<std::size_t>(wanted))
      return bad_input(
          fmt::format("\"{}\" has {} values instead of {}", word_of(c.kind).word, c.values.size(), wanted));
    return check_limits(c);
  }
  if (wanted == -2) {
    if (c.values.size() < 12 + 6 || c.values.size() % 2 != 0 ||
        (c.values[0] != 0 && c.values[0] != 1 && c.values[0] != 2 && c.values[0] != 3))
      return bad_input("a punch is frame, reach, roughness, centre, axis, across and three or more corners x, y");
    return check_limits(c);
  }
  const double shape = c.values.empty() ? -1 : c.values[0];
  const std::size_t size = shape == 1 ? 5 : 7;
  if ((shape != 0 && shape != 1 && shape != 2) || c.values.size() != size)
    return bad_input("a region is [0, min, max], [1, centre, radius] or [2, point, normal]");
  return check_limits(c);
}

namespace {

std::string to_base64(std::string_view bytes) {
  std::string out;
  Base64Encoder encoder;
  encoder.add(bytes.data(), bytes.size(), out);
  encoder.finish(out);
  return out;
}

bool from_base64(std::string_view text, std::string& out) {
  if (text.size() % 4 != 0) return false;
  std::uint32_t word = 0;
  int digits = 0, padding = 0;
  for (const char c : text) {
    std::uint32_t digit = 0;
    if (c >= 'A' && c <= 'Z') digit = static_cast<std::uint32_t>(c - 'A');
    else if (c >= 'a' && c <= 'z') digit = static_cast<std::uint32_t>(c - 'a' + 26);
    else if (c >= '0' && c <= '9') digit = static_cast<std::uint32_t>(c - '0' + 52);
    else if (c == '+') digit = 62;
    else if (c == '/') digit = 63;
    else if (c == '=') ++padding;
    else return false;
    if (padding > 0 && c != '=') return false;
    word = word << 6 | digit;
    if (++digits < 4) continue;
    out += static_cast<char>(word >> 16 & 255);
    out += static_cast<char>(word >> 8 & 255);
    out += static_cast<char>(word & 255);
    word = 0;
    digits = 0;
  }
  if (padding > 2) return false;
  out.resize(out.size() - static_cast<std::size_t>(padding));
  return true;
}

std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

std::string other_version() {
  return fmt::format("this recording is of another version than {}; replay it with the kerf that made it",
                     kRecordingVersion);
}

/// What stands in the file, for messages.
std::string written(const JsonValue& value) {
  if (value.text() != nullptr) return fmt::format("\"{}\"", shown(*value.text()));
  if (const std::optional<double> number = value.number()) return fmt::format("{}", *number);
  if (value.array() != nullptr) return "a list";
  if (value.object() != nullptr) return "a table";
  return value.is_null() ? "null" : value.is_true() ? "true" : "false";
}

/// Reads the parts of a recording; the first trouble is kept, with the entry of a list that it is in.
class RecordingReader {
 public:
  RecordingReader(const JsonValue& root, std::string_view name) : root_(root), name_(name) {}

  Result<Recording> read() {
    const JsonValue* version = root_.find("kerf_recording");
    if (version == nullptr) return trouble(kNoRecording);
    if (version->number() != kRecordingVersion) return trouble(other_version());
    Recording out;
    const JsonValue& scene = member(root_, "scene");
    out.source.name = text(scene, "name");
    out.source.text = text(scene, "text");
    out.source.folder = text(scene, "folder");
    for (const JsonValue& file : array(scene, "files")) {
      entry_ = {"files", out.source.files.size()};
      SceneSource::File f;
      f.name = text(file, "name");
      if (!plain_file_name(f.name))
        fail(fmt::format("\"name\" must be the name of a file without a folder, but is \"{}\"", shown(f.name)));
      if (!from_base64(text(file, "base64"), f.bytes)) fail("\"base64\" is not base64");
      out.source.files.push_back(std::move(f));
    }
    entry_ = {};
    read_meshes(scene, out.source);
    out.instructions = text(root_, "instructions");
    out.overrides.scripted = member(root_, "scripted").is_true();
    out.overrides.time_step = number(member(root_, "time_step"), "time_step");
    if (out.overrides.time_step < 0) fail("time_step is negative");
    read_dust(out.overrides);
    out.last_step = step(member(root_, "last_step"), "\"last_step\"");
    std::int64_t last = 0;
    for (const JsonValue& item : array(root_, "changes")) {
      entry_ = {"changes", out.changes.size()};
      SessionChange c;
      const JsonValue::Array* parts = item.array();
      if (parts == nullptr || parts->size() < 2 || (*parts)[1].text() == nullptr) {
        fail(fmt::format("a change is [step, \"kind\", ...], but this is {}", written(item)));
        break;
      }
      c.step = step((*parts)[0], "its step");
      if (c.step < last) fail(fmt::format("changes are in the order of their steps, but {} follows {}", c.step, last));
      last = c.step;
      if (!read_change(*parts, c)) break;
      out.changes.push_back(std::move(c));
    }
    entry_ = {};
    last = 0;
    for (const JsonValue& item : array(root_, "hashes")) {
      entry_ = {"hashes", out.hashes.size()};
      StateHash h;
      const JsonValue::Array* parts = item.array();
      if (parts == nullptr || parts->size() != 2 || (*parts)[1].text() == nullptr) {
        fail(fmt::format("a hash is [step, \"hex\"], but this is {}", written(item)));
        break;
      }
      h.step = step((*parts)[0], "its step");
      if (h.step < last) fail(fmt::format("hashes are in the order of their steps, but {} follows {}", h.step, last));
      last = h.step;
      h.hash = hash((*parts)[1], "its hash");
      out.hashes.push_back(h);
    }
    entry_ = {};
    out.end_hash = hash(member(root_, "end"), "\"end\"");
    if (!trouble_.empty()) return trouble(trouble_);
    if (!out.changes.empty() && out.changes.back().step > out.last_step)
      return trouble("there are changes after the last step");
    if (!out.hashes.empty() && out.hashes.back().step > out.last_step)
      return trouble("there are hashes after the last step");
    return out;
  }

 private:
  /// Recordings of before dust was swept up have none, and nothing of it went.
  void read_dust(SceneOverrides& overrides) {
    const JsonValue* dust = root_.find("dust");
    if (dust == nullptr) overrides.dust = 0;
    if (dust == nullptr || dust->is_null()) return;
    overrides.dust = number(*dust, "dust");
    if (*overrides.dust < 0 || *overrides.dust > kMostDust)
      fail(fmt::format("dust goes from 0 to {:g}, but is {:g}", kMostDust, *overrides.dust));
  }
  /// Recordings of before meshes travelled have none.
  void read_meshes(const JsonValue& scene, SceneSource& source) {
    if (scene.find("meshes") == nullptr) return;
    for (const JsonValue& mesh : array(scene, "meshes")) {
      entry_ = {"meshes", source.meshes.size()};
      SceneSource::Mesh m;
      m.written = text(mesh, "file");
      m.hash = hash(member(mesh, "hash"), "\"hash\"");
      const std::optional<std::uint64_t> bytes = member(mesh, "bytes").whole();
      if (!bytes) {
        fail(fmt::format("\"bytes\" must be a whole number, but is {}", written(member(mesh, "bytes"))));
        return;
      }
      m.bytes = *bytes;
      if (mesh.find("base64") != nullptr) {
        m.content.emplace();
        if (!from_base64(text(mesh, "base64"), *m.content)) fail("\"base64\" is not base64");
        if (m.content->size() != m.bytes)
          fail(fmt::format("\"bytes\" is {}, but \"base64\" has {}", m.bytes, m.content->size()));
        if (bytes_hash(*m.content) != m.hash)
          fail(fmt::format(
              "\"{}\" is damaged: its bytes do not have the hash that was recorded; use another copy of the recording, or record it again",
              shown(m.written)));
      }
      source.meshes.push_back(std::move(m));
    }
    entry_ = {};
  }
  bool read_change(const JsonValue::Array& item, SessionChange& c) {
    const std::string& word = *item[1].text();
    bool known = false;
    for (const KindWord& k : kKinds)
      if (word == k.word) {
        c.kind = k.kind;
        known = true;
      }
    if (!known) return fail(fmt::format("there is no change \"{}\"", shown(word)));
    std::size_t at = 2;
    if (has_id(c.kind)) {
      if (item.size() < 3 || item[2].text() == nullptr)
        return fail(fmt::format("\"{}\" names a grasp or a tool third, but {} stands there", word,
                                item.size() < 3 ? "nothing" : written(item[2])));
      c.id = *item[2].text();
      at = 3;
    }
    for (; at < item.size(); ++at) {
      const std::optional<double> value = item[at].number();
      if (!value)
        return fail(fmt::format("\"{}\" has numbers only, but {} stands at place {}", word, written(item[at]), at + 1));
      if (c.kind == Kind::kGrasp || c.kind == Kind::kRemove) {
        const std::optional<std::uint64_t> element = item[at].whole();
        if (!element || *element > INT32_MAX)
          return fail(fmt::format("\"{}\" names elements by whole numbers, but {} stands at place {}", word,
                                  written(item[at]), at + 1));
        c.vertices.push_back(static_cast<std::int32_t>(*element));
      } else {
        c.values.push_back(*value);
      }
    }
    if (const Status ok = check(c); !ok) return fail(ok.error().message);
    return true;
  }
  const JsonValue& member(const JsonValue& of, const char* key) {
    static const JsonValue kNothing;
    const JsonValue* found = of.find(key);
    if (found == nullptr) fail(fmt::format("\"{}\" is missing", key));
    return found == nullptr ? kNothing : *found;
  }
  const std::string& text(const JsonValue& of, const char* key) {
    static const std::string kNothing;
    const std::string* found = member(of, key).text();
    if (found == nullptr) fail(fmt::format("\"{}\" must be a text, but is {}", key, written(member(of, key))));
    return found == nullptr ? kNothing : *found;
  }
  const JsonValue::Array& array(const JsonValue& of, const char* key) {
    static const JsonValue::Array kNothing;
    const JsonValue::Array* found = member(of, key).array();
    if (found == nullptr) fail(fmt::format("\"{}\" must be a list, but is {}", key, written(member(of, key))));
    return found == nullptr ? kNothing : *found;
  }
  double number(const JsonValue& m, const char* key) {
    const std::optional<double> value = m.number();
    if (value && std::isfinite(*value)) return *value;
    fail(fmt::format("\"{}\" must be a number, but is {}", key, written(m)));
    return 0;
  }
  std::int64_t step(const JsonValue& m, const char* what) {
    const std::optional<std::uint64_t> value = m.whole();
    if (value && *value <= kMostSteps) return static_cast<std::int64_t>(*value);
    fail(fmt::format("{} must be a whole number from 0 to {}, but is {}", what, kMostSteps, written(m)));
    return 0;
  }
  std::uint64_t hash(const JsonValue& m, const char* what) {
    std::uint64_t value = 0;
    const std::string_view digits = m.text() == nullptr ? std::string_view() : *m.text();
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (digits.empty() || error != std::errc() || end != digits.data() + digits.size())
      fail(fmt::format("{} must be a text of at most 16 hexadecimal digits, but is {}", what, written(m)));
    return value;
  }
  bool fail(std::string what) {
    if (!trouble_.empty()) return false;
    trouble_ = entry_.list == nullptr ? std::move(what) : fmt::format("{}[{}]: {}", entry_.list, entry_.index, what);
    return false;
  }
  Error trouble(const std::string& what) const { return bad_input(fmt::format("{}: {}", shown(name_), what)); }

  /// What is being read of a list.
  struct Entry {
    const char* list = nullptr;
    std::size_t index = 0;
  };

  const JsonValue& root_;
  std::string_view name_;
  std::string trouble_;
  Entry entry_;
};

}  // namespace

std::string_view change_word(Kind kind) { return word_of(kind).word; }

SessionChange region_change(Kind kind, const SceneRegion& region) {
  SessionChange c;
  c.kind = kind;
  const auto put = [&](Vec3 v) { c.values.insert(c.values.end(), {v.x, v.y, v.z}); };
  switch (region.shape) {
    case SceneRegion::Shape::kBox:
      c.values.push_back(0);
      put(region.min);
      put(region.max);
      break;
    case SceneRegion::Shape::kSphere:
      c.values.push_back(1);
      put(region.center);
      c.values.push_back(region.radius);
      break;
    case SceneRegion::Shape::kHalfSpace:
      c.values.push_back(2);
      put(region.point);
      put(region.normal);
      break;
  }
  return c;
}

std::string_view instruction_set() {
#if defined(__AVX512F__)
  return "x86-64 with AVX-512";
#elif defined(__AVX2__) && defined(__FMA__)
  return "x86-64-v3";
#elif defined(__x86_64__)
  return "x86-64";
#elif defined(__aarch64__)
  return "arm64";
#elif defined(__wasm_simd128__)
  return "wasm32 with SIMD";
#else
  return "unknown";
#endif
}

std::string recording_text(const Recording& r) {
  // Value by value: one that has others in it asks for memory to be taken apart, and where memory ends on the way so would the program.
  std::string out;
  const auto put = [&](std::string_view before, const Json& value) {
    out += before;
    out += value.dump(-1, ' ', false, Json::error_handler_t::replace);  // bytes that are not UTF-8 (in a file's name)
  };
  const auto list = [&](const auto& items, const auto& put_item) {
    out += '[';
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (i > 0) out += ',';
      put_item(items[i]);
    }
    out += ']';
  };
  put("{\"kerf_recording\":", kRecordingVersion);
  put(",\"instructions\":", r.instructions);
  put(",\"scene\":{\"name\":", r.source.name);
  put(",\"folder\":", r.source.folder.string());
  put(",\"text\":", r.source.text);
  out += ",\"files\":";
  list(r.source.files, [&](const SceneSource::File& f) {
    put("{\"name\":", f.name);
    out += fmt::format(",\"base64\":\"{}\"}}", to_base64(f.bytes));
  });
  out += ",\"meshes\":";
  list(r.source.meshes, [&](const SceneSource::Mesh& m) {
    put("{\"file\":", m.written);
    out += fmt::format(",\"bytes\":{},\"hash\":\"{}\"", m.bytes, hex(m.hash));
    if (m.content) out += fmt::format(",\"base64\":\"{}\"", to_base64(*m.content));
    out += '}';
  });
  put("},\"scripted\":", r.overrides.scripted);
  put(",\"time_step\":", r.overrides.time_step);
  put(",\"dust\":", r.overrides.dust ? Json(*r.overrides.dust) : Json());
  put(",\"last_step\":", r.last_step);
  out += ",\"changes\":";
  list(r.changes, [&](const SessionChange& c) {
    out += fmt::format("[{},\"{}\"", c.step, word_of(c.kind).word);
    if (has_id(c.kind)) put(",", c.id);
    for (const std::int32_t v : c.vertices) out += fmt::format(",{}", v);
    for (const double v : c.values) put(",", v);
    out += ']';
  });
  out += ",\"hashes\":";
  list(r.hashes, [&](const StateHash& h) { out += fmt::format("[{},\"{}\"]", h.step, hex(h.hash)); });
  return out + fmt::format(",\"end\":\"{}\"}}\n", hex(r.end_hash));
}

Result<Recording> parse_recording(std::string_view text, std::string_view name) {
  const std::optional<JsonValue> root = parse_json(text, kDeepest);
  if (!root)
    return bad_input(fmt::format(
        "{}: this is not JSON, is cut off, or is no recording of kerf; give one that kerf wrote, or record it again",
        shown(name)));
  return RecordingReader(*root, name).read();
}

namespace {

/// JSON that is an object, before it is read to its end. The version stands first in what recording_text writes.
Status check_start(std::string_view first, const std::string& path) {
  const std::size_t begin = first.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos || first[begin] != '{')
    return bad_input(fmt::format("{}: {}", shown(path), kNoRecording));
  const std::string key = "\"kerf_recording\":";
  const std::size_t at = first.find_first_not_of(" \t\r\n", begin + 1);
  if (at == std::string_view::npos || !first.substr(at).starts_with(key)) return {};  // the whole says what it is
  const std::size_t number = first.find_first_not_of(" \t\r\n", at + key.size());
  int version = 0;
  if (number == std::string_view::npos) return {};
  const auto [end, error] = std::from_chars(first.data() + number, first.data() + first.size(), version);
  if (error == std::errc() && version == kRecordingVersion) return {};
  return bad_input(fmt::format("{}: {}", shown(path), other_version()));
}

}  // namespace

Result<Recording> read_recording(const std::string& path) {
  const FileKind kind{"a recording", kMostRecordingBytes, "record a shorter session", check_start};
  const auto text = read_whole_file(path, kind);
  if (!text) return text.error();
  return within_memory(path, [&] { return parse_recording(text->view(), path); });
}

}  // namespace kerf
