#include "kerf/record/saved_session.h"

#include <fmt/format.h>

#include <utility>

#include "kerf/base/bytes.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/recording_meshes.h"

namespace kerf {
namespace {

constexpr std::string_view kMagic = "KERFSTAT";

struct Head {
  std::uint32_t version = 0, zero = 0;
  std::uint64_t hash = 0;
};
constexpr std::size_t kHeadBytes = kMagic.size() + sizeof(Head);

/// Enough of it to say what it is.
Result<Head> read_head(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(kMagic) || bytes.size() < kHeadBytes)
    return bad_input(fmt::format("{}: this is no saved state of kerf; kerf run --save writes one", shown(name)));
  Head head;
  ByteReader reader(bytes.substr(kMagic.size()));
  reader(head);
  if (head.version == kSavedSessionVersion) return head;
  return bad_input(fmt::format(
      "{}: this state is of version {}, and this kerf reads version {}; go on with the kerf that saved it, or replay a recording of it",
      shown(name), head.version, kSavedSessionVersion));
}

}  // namespace

Result<std::string> saved_session_bytes(const Session& session, const Recording& scene) {
  const auto state = session.state_bytes();
  if (!state) return state.error();
  return saved_state_bytes(*state, scene);
}

std::string saved_state_bytes(const std::string& state, const Recording& scene) {
  Recording begin;
  begin.source = scene.source;
  begin.overrides = scene.overrides;
  begin.instructions = instruction_set();
  std::string inside;
  ByteWriter writer(inside);
  writer(recording_text(begin));
  writer(state);
  std::string out(kMagic);
  ByteWriter{out}(Head{kSavedSessionVersion, 0, bytes_hash(inside)});
  return out + inside;
}

Result<SavedSession> parse_saved_session(std::string_view bytes, const std::string& name) {
  const auto head = read_head(bytes, name);
  if (!head) return head.error();
  const std::string_view inside = bytes.substr(kHeadBytes);
  ByteReader reader(inside);
  std::string text;
  SavedSession saved;
  reader(text), reader(saved.state);
  if (head->hash != bytes_hash(inside) || head->zero != 0 || !reader.ok() || reader.left() > 0)
    return bad_input(
        fmt::format("{}: this state is cut off or damaged; use another copy of it, or save it again", shown(name)));
  auto scene = parse_recording(text, name);
  if (!scene) return scene.error();
  saved.scene = std::move(*scene);
  if (saved.scene.instructions != instruction_set())
    return bad_input(fmt::format(
        "{}: this state was saved by a kerf for {}, and this one is for {}: it would not go on to the same bits; go on with that one, or replay a recording of it",
        shown(name), shown(saved.scene.instructions), instruction_set()));
  return saved;
}

Result<SavedSession> read_saved_session(const std::string& path) {
  const FileKind kind{"a saved state", kMostStateBytes, "save a smaller body",
                      [](std::string_view first, const std::string& file) {
                        const auto head = read_head(first, file);
                        return head ? Status{} : Status{head.error()};
                      }};
  const auto bytes = read_whole_file(path, kind);
  if (!bytes) return bytes.error();
  return within_memory(path, [&] { return parse_saved_session(bytes->view(), path); });
}

Result<Session> go_on(const SavedSession& saved, const Progress& progress,
                      const std::vector<std::filesystem::path>& mesh_folders, const std::string& file) {
  auto session = session_of(saved.scene, progress, mesh_folders, file);
  if (!session) return session;
  if (const Status taken = session->take_state(saved.state); !taken)
    return bad_input(
        fmt::format("{}: {}", shown(file.empty() ? saved.scene.source.name : file), taken.error().message));
  return session;
}

}  // namespace kerf
