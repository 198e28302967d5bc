// The commands of a page.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "kerf/base/stopwatch.h"
#include "kerf/engine/engine_impl.h"
#include "kerf/engine/tolerances.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/run_outputs.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/scene_file.h"

namespace kerf {
namespace {

using protocol::CommandCode;
using protocol::Outcome;
using Kind = SessionChange::Kind;

constexpr double kSlowest = 1e-3, kFastest = 10;  ///< of real time
constexpr int kMostSingleSteps = 1000;
constexpr double kMostGravity = 1e3;                  ///< m/s^2
constexpr double kLeastUnit = 1e-9, kMostUnit = 1e3;  ///< metres
constexpr std::size_t kMostUploadParts = 16;
constexpr std::size_t kMostNameBytes = 80;  ///< of an upload's scene: names of files have 255, with an ending
constexpr std::array<std::string_view, 5> kMeshEndings{".obj", ".ply", ".stl", ".off", ".kerf"};

std::string lower_extension(const std::string& name) {
  std::string out = std::filesystem::path(name).extension().string();
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

/// A page's file name as the name of a scene.
std::string plain_stem(const std::string& name) {
  std::string out = std::filesystem::path(name).stem().string();
  for (char& c : out)
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 32 || c == 127) c = '_';
  std::size_t end = std::min(out.size(), kMostNameBytes);
  while (end < out.size() && (static_cast<unsigned char>(out[end]) & 0xC0) == 0x80) --end;  // not inside a character
  return end == 0 ? "upload" : out.substr(0, end);
}

/// Whole numbers from `least` to `most`.
Status check_whole(double value, const char* what, int least, int most) {
  if (value >= least && value <= most && value == std::floor(value)) return {};
  return bad_input(fmt::format("{} is a whole number from {} to {}, but {:g} came.", what, least, most, value));
}

Status check_unit(double unit) {
  if (unit >= kLeastUnit && unit <= kMostUnit) return {};
  return bad_input(fmt::format("The unit of a mesh goes from {} to {} metres.", kLeastUnit, kMostUnit));
}

}  // namespace

Status Engine::Impl::command(std::uint32_t id, const protocol::Command& c) {
  EngineClient& client = clients.at(id);
  switch (c.code) {
    case CommandCode::kPlay:
      playing = true;
      owed = 0;
      frame_due = true;
      return {};
    case CommandCode::kPause:
      playing = false;
      frame_due = true;
      send_frame();
      return {};
    case CommandCode::kStep: {
      KERF_TRY(check_whole(c.value[0], "The number of steps", 1, kMostSingleSteps));
      const int n = static_cast<int>(c.value[0]);
      for (int i = 0; i < n; ++i)
        if (!single_step()) break;
      return {};
    }
    case CommandCode::kSpeed:
      if (!(c.value[0] >= kSlowest && c.value[0] <= kFastest))
        return bad_input(fmt::format("The speed goes from {} to {} times real time.", kSlowest, kFastest));
      speed = c.value[0];
      frame_due = true;
      return {};
    case CommandCode::kReset:
      session->restore(initial);
      KERF_TRY(session->set_gravity(initial_gravity));
      drawn.reset(session->body());
      start_over();
      return {};
    case CommandCode::kUndo:
    case CommandCode::kRedo: {
      const bool undo = c.code == CommandCode::kUndo;
      // In a stroke, undo takes this stroke back.
      if (undo && session->in_stroke()) {
        cancel_tool();
        return {};
      }
      if (undo ? session->undo_depth() == 0 : session->redo_depth() == 0)
        return bad_input(undo ? "There is no cut to undo." : "There is no cut to redo.");
      const auto taken = [&] {
        // A bite and what it cut loose are one to a person.
        const auto& strokes = session->strokes();
        const auto last =
            std::find_if(strokes.rbegin(), strokes.rend(), [](const StrokeRecord& s) { return !s.undone; });
        const auto next = static_cast<std::size_t>(strokes.rend() - last);
        return undo ? next > 0 && taken_with.contains(next - 1) : taken_with.contains(next);
      };
      const bool before = undo && taken();
      KERF_TRY(perform(undo ? Kind::kUndo : Kind::kRedo));
      if (undo ? before && session->undo_depth() > 0 : taken() && session->redo_depth() > 0)
        KERF_TRY(perform(undo ? Kind::kUndo : Kind::kRedo));
      report_history(c.input, undo ? Outcome::kUndone : Outcome::kRedone);
      return {};
    }
    case CommandCode::kScene: {
      const auto scene = std::find_if(options.scenes.begin(), options.scenes.end(),
                                      [&](const OfferedScene& s) { return s.name == c.text; });
      if (scene == options.scenes.end()) return bad_input(fmt::format("There is no scene \"{}\".", c.text));
      KERF_TRY(check_whole(c.value[0], "The value of the scene (0 without its commands, 1 with them)", 0, 1));
      auto text = read_whole_file(scene->path, kSceneFile);
      if (!text) return text.error();
      SceneRequest request;
      request.source.text = text->view();
      request.source.name = scene->name;
      request.source.folder = std::filesystem::path(scene->path).parent_path();
      request.source.mesh_folders = options.mesh_folders;
      request.overrides = options.overrides;
      request.overrides.scripted = c.value[0] == 1;  // --scripted is of the scene that the program began with
      begin_loading(std::move(request), id, c.input);
      return {};
    }
    case CommandCode::kGravity: {
      for (int i = 0; i < 3; ++i)
        if (std::abs(c.value[static_cast<std::size_t>(i)]) > kMostGravity)
          return bad_input(fmt::format("Gravity goes up to {} m/s2.", kMostGravity));
      return perform(Kind::kGravity, {c.value[0], c.value[1], c.value[2]});
    }
    case CommandCode::kMaterial: return perform(Kind::kMaterial, {c.value[0], c.value[1], c.value[2]});
    case CommandCode::kExport: return export_files(id, c.input, c.text);
    case CommandCode::kRecording: {
      KERF_TRY(check_whole(c.value[0], "The value of recording (1 start, 0 stop)", 0, 1));
      if (too_long) {
        recording = false;
        return bad_input(
            "So much has happened since the start that it is no longer kept; start again (reset) to record.");
      }
      if (c.value[0] != 0) {
        recording = true;
        return {};
      }
      if (!recording) return bad_input("No recording was started.");
      recording = false;
      const std::string text = recording_text(make_recording());
      send(id, protocol::encode(protocol::File{c.input, source.name + ".kerfrec", text}));
      return {};
    }
    case CommandCode::kOverlay: {
      KERF_TRY(check_whole(c.value[0], "The value of the overlay (0 no, 1 yes, 2 with feet)", 0, 2));
      client.overlay = c.value[0] != 0;
      client.feet = c.value[0] == 2;
      if (client.overlay) client.queue.push(overlay_now(client.feet));
      return {};
    }
    case CommandCode::kLoadUpload: {
      if (!(c.value[0] >= 0 && c.value[0] <= 4294967295.0)) return bad_input("There is no such upload.");
      auto request = upload_request(client, static_cast<std::uint32_t>(c.value[0]), c.value[1], c.text);
      if (!request) return request.error();
      request->overrides = options.overrides;
      begin_loading(std::move(request).value(), id, c.input);
      return {};
    }
    case CommandCode::kContacts:
      KERF_TRY(check_whole(c.value[0], "The value of contacts (0 no, 1 yes)", 0, 1));
      client.contacts = c.value[0] != 0;
      frame_due = true;
      return {};
    case CommandCode::kUnit: {
      auto request = other_unit(c.value[0]);
      if (!request) return request.error();
      request->overrides = options.overrides;
      begin_loading(std::move(request).value(), id, c.input);
      return {};
    }
    case CommandCode::kStopLoading:
      if (!loader.busy()) return {};
      loader.stop();
      tell_loading(protocol::LoadState::kStopped, {}, 0);
      return {};
    case CommandCode::kFixAll: {
      KERF_TRY(check_whole(c.value[0], "The value of fix all (0 nothing, 1 the far rim)", 0, 1));
      if (c.value[0] == 1) return fix_rim();
      SceneRegion all;
      all.shape = SceneRegion::Shape::kSphere;
      all.center = rest_box.center();
      all.radius = 4 * rest_box.diagonal();  // the lattice reaches beyond the body
      return perform(region_change(Kind::kUnfix, all));
    }
  }
  return {};
}

Result<SceneRequest> Engine::Impl::other_unit(double unit) const {
  if (!meshes || !meshes->bound.empty())
    return bad_input("Only meshes that were opened in the page have a unit to choose.");
  KERF_TRY(check_unit(unit));
  auto place = TemporaryFolder::create();
  if (!place) return place.error();
  SceneRequest request;
  request.source = source;
  request.source.folder = place->path();
  request.folder.emplace(std::move(*place));
  request.meshes = meshes;
  request.meshes->unit = unit;
  request.meshes->guessed = false;
  return request;
}

void Engine::Impl::begin_loading(SceneRequest request, std::uint32_t client, std::uint32_t input) {
  request.client = client;
  request.input = input;
  loader.start(std::move(request));
  tell_loading(protocol::LoadState::kUnderWay, {}, 0);
}

Status Engine::Impl::fix_rim() {
  const Scene& scene = session->scene();
  if (!scene.fixes.empty()) {
    for (const SceneFix& fix : scene.fixes) KERF_TRY(perform(region_change(Kind::kFix, fix.region)));
    return {};
  }
  SceneRegion far;
  far.shape = SceneRegion::Shape::kHalfSpace;
  far.point = {rest_box.center().x, rest_box.max.y - kRimShare * rest_box.size().y, rest_box.center().z};
  far.normal = {0, 1, 0};
  return perform(region_change(Kind::kFix, far));
}

Status Engine::Impl::export_files(std::uint32_t client, std::uint32_t request, const std::string& kind) {
  if (clients.at(client).queue.unread() > options.most_answers || unread() > options.most_together)
    return bad_input("Files that were asked for before are still on their way.");
  if (kind == "scene") {
    send(client, protocol::encode(protocol::File{request, source.name + ".toml", source.text}));
    return {};
  }
  PendingExport wanted;
  wanted.request = request;
  if (kind == "obj") wanted.meshes = {"visual", "collision"};
  if (kind == "vtu") wanted.meshes = {"hexahedra"};
  if (wanted.meshes.empty()) return bad_input(fmt::format("\"{}\" can't be exported; obj, vtu and scene can.", kind));
  std::optional<PendingExport>& pending = clients.at(client).exporting;
  if (pending) return bad_input("Another export of this page is being made; ask again when its files have come.");
  pending = std::move(wanted);
  return {};
}

void Engine::Impl::export_next() {
  export_rest = std::max(0.0, export_rest - tick_seconds);
  if (export_rest > 0) return;
  const auto wants = [](const auto& c) { return c.second.exporting.has_value(); };
  auto next = std::find_if(clients.upper_bound(exported_last), clients.end(), wants);
  if (next == clients.end()) next = std::find_if(clients.begin(), clients.end(), wants);
  if (next == clients.end()) return;
  std::optional<LedSession::Look> look;
  if (led && !look.emplace(*led)) return;
  exported_last = next->first;
  const PendingExport wanted = *std::exchange(next->second.exporting, std::nullopt);
  const auto start = Clock::now();
  if (const Status made = make_export(next->first, wanted); !made)
    error(next->first, wanted.request, protocol::ErrorCode::kFailed, made.error().message);
  export_rest = kExportRest * seconds_since(start);
}

Status Engine::Impl::make_export(std::uint32_t client, const PendingExport& wanted) {
  auto place = TemporaryFolder::create();
  if (!place) return place.error();
  KERF_TRY(write_final_meshes(*session, wanted.meshes, place->path()));
  for (const char* name : {"visual.obj", "collision.obj", "hexahedra.vtu"}) {
    const std::string path = (place->path() / name).string();
    if (!is_there(path)) continue;
    auto bytes = read_whole_file(path, kOtherFile);
    if (!bytes) return bytes.error();
    send(client, protocol::encode(protocol::File{wanted.request, source.name + "_" + name, bytes->view()}));
  }
  return {};
}

Status Engine::Impl::take_upload(EngineClient& client, const protocol::Upload& m) {
  const std::pair key{m.upload, static_cast<std::uint32_t>(m.part)};
  if (m.offset == 0) {
    const auto old = client.uploads.find(key);
    if (old != client.uploads.end()) {
      client.upload_bytes -= old->second.bytes.size();
      client.uploads.erase(old);
    }
    if (client.uploads.size() >= kMostUploadParts) {
      // Loads that were never asked for: the oldest go.
      client.upload_bytes -= client.uploads.begin()->second.bytes.size();
      client.uploads.erase(client.uploads.begin());
    }
    client.uploads[key] = {m.name, {}, m.total};
  }
  const auto found = client.uploads.find(key);
  if (found == client.uploads.end()) return bad_input("A chunk of an upload came without its beginning.");
  UploadedFile& file = found->second;
  const bool fits = m.offset == file.bytes.size() && m.total == file.total;
  std::size_t all = 0;
  for (const auto& [id, c] : clients) all += c.upload_bytes;
  const bool small = m.total <= options.most_upload && all + m.bytes.size() <= options.most_upload;
  if (!fits || !small) {
    client.upload_bytes -= file.bytes.size();
    client.uploads.erase(found);
    return bad_input(
        fits ? fmt::format("Uploads have up to {} MiB, those of all pages together.", options.most_upload >> 20)
             : std::string("The chunks of an upload came in the wrong order; send it again."));
  }
  file.bytes += m.bytes;
  client.upload_bytes += m.bytes.size();
  return {};
}

Result<SceneRequest> Engine::Impl::upload_request(EngineClient& client, std::uint32_t upload, double unit,
                                                  const std::string& thickness) {
  if (unit != 0) KERF_TRY(check_unit(unit));
  std::array<std::optional<UploadedFile>, 3> parts;
  for (std::uint32_t part = 0; part < 3; ++part) {
    const auto found = client.uploads.find({upload, part});
    if (found == client.uploads.end()) continue;
    if (found->second.bytes.size() != found->second.total)
      return bad_input("The upload is not complete; send it again.");
    client.upload_bytes -= found->second.bytes.size();
    parts[part] = std::move(found->second);
    client.uploads.erase(found);
  }
  auto place = TemporaryFolder::create();
  if (!place) return place.error();
  SceneRequest request;
  SceneSource& from = request.source;
  from.folder = place->path();

  if (parts[2] && lower_extension(parts[2]->name) == ".toml") {
    from.text = parts[2]->bytes;
    from.name = plain_stem(parts[2]->name);
  } else if (parts[2] && lower_extension(parts[2]->name) == ".kerf") {
    from.name = plain_stem(parts[2]->name);
    const std::string& file = request.meshes.emplace().bound = from.name + ".kerf";
    from.files.push_back({file, std::move(parts[2]->bytes)});
  } else if (parts[0]) {
    UploadedMeshes& own = request.meshes.emplace();
    own.visual = "visual" + lower_extension(parts[0]->name);
    own.unit = unit;
    from.name = plain_stem(parts[0]->name);
    from.files.push_back({own.visual, std::move(parts[0]->bytes)});
    if (parts[1]) {
      own.collision = "collision" + lower_extension(parts[1]->name);
      from.files.push_back({own.collision, std::move(parts[1]->bytes)});
    }
    if (!thickness.empty()) {
      const bool share = thickness.back() == '%';
      const char* const last = thickness.data() + thickness.size() - (share ? 1 : 0);
      double value = 0;
      const auto [end, error] = std::from_chars(thickness.data(), last, value);
      if (error != std::errc() || end != last || !(value > 0 && value < 1e9))
        return bad_input("The thickness is a positive number in the unit of the mesh, or one with % of its size.");
      (share ? own.thickness_share : own.thickness) = share ? value / 100 : value;
    }
  } else {
    return bad_input("There is no such upload: send a visual mesh, a scene (.toml) or a bound body (.kerf) first.");
  }
  for (const SceneSource::File& f : from.files)
    if (std::find(kMeshEndings.begin(), kMeshEndings.end(), lower_extension(f.name)) == kMeshEndings.end())
      return bad_input("Meshes are OBJ, PLY, STL or OFF files.");
  request.folder.emplace(std::move(*place));
  return request;
}

}  // namespace kerf
