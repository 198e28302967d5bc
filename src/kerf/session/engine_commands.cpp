// The commands of a page.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/surface_measures.h"
#include "kerf/mesh/surface_tolerances.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/session/engine_impl.h"
#include "kerf/session/run_outputs.h"
#include "kerf/session/scene_file.h"

namespace kerf {
namespace {

using protocol::CommandCode;
using protocol::Outcome;
using Kind = SessionChange::Kind;

constexpr double kSlowest = 1e-3, kFastest = 10;   ///< of real time
constexpr int kMostSingleSteps = 1000;
constexpr double kMostGravity = 1e3;               ///< m/s^2
/// Without supports in the scene, "the far rim" is this share of the body's length along y.
constexpr double kRimShare = 0.15;
/// What uploaded meshes are simulated with: nothing holds them yet, so they float until gravity is turned on.
constexpr const char* kUploadSimulation = "[simulation]\ntime_step = 0.005\ngravity = [0, 0, 0]\n";
constexpr std::size_t kMostUploadParts = 16;

std::string lower_extension(const std::string& name) {
  std::string out = std::filesystem::path(name).extension().string();
  std::transform(out.begin(), out.end(), out.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

/// A page's file name as the name of a scene.
std::string plain_stem(const std::string& name) {
  std::string out = std::filesystem::path(name).stem().string();
  for (char& c : out)
    if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 32) c = '_';
  return out.empty() ? "upload" : out.substr(0, 80);
}

bool inside(const std::filesystem::path& path, const std::filesystem::path& folder) {
  return path.empty() || path.lexically_normal().parent_path() == folder.lexically_normal();
}

/// A page can't ask for the unit before it has seen the body, and files that others made are mostly in millimetres: larger
/// bodies than anyone cuts are.
bool is_in_millimetres(const std::string& file) {
  const auto mesh = read_mesh(file);
  return mesh.ok() && surface_measures(*mesh).box.diagonal() > kUsualLargest;
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
      const int n = static_cast<int>(std::clamp(c.value[0], 1.0, static_cast<double>(kMostSingleSteps)));
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
      KERF_TRY(perform(undo ? Kind::kUndo : Kind::kRedo));
      report_history(c.input, undo ? Outcome::kUndone : Outcome::kRedone);
      return {};
    }
    case CommandCode::kScene: {
      const auto scene = std::find_if(options.scenes.begin(), options.scenes.end(), [&](const OfferedScene& s) { return s.name == c.text; });
      if (scene == options.scenes.end()) return bad_input(fmt::format("There is no scene \"{}\".", c.text));
      auto text = read_whole_file(scene->path);
      if (!text) return text.error();
      cancel_tool();
      SceneSource from;
      from.text = text->view();
      from.name = scene->name;
      from.folder = std::filesystem::path(scene->path).parent_path();
      KERF_TRY(load(from, options.overrides, {}));
      folder.reset();
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
      client.overlay = c.value[0] != 0;
      client.feet = c.value[0] == 2;
      if (client.overlay) send_overlay();
      return {};
    }
    case CommandCode::kLoadUpload: {
      if (!(c.value[0] >= 0 && c.value[0] <= 4294967295.0)) return bad_input("There is no such upload.");
      return load_upload(client, static_cast<std::uint32_t>(c.value[0]), c.text);
    }
    case CommandCode::kFixAll: {
      if (c.value[0] == 1) return fix_rim();
      Box3 box;
      for (const Vec3 p : session->body().complex.visual.rest.raw()) box.add(p);
      SceneRegion all;
      all.shape = SceneRegion::Shape::kSphere;
      all.center = box.center();
      all.radius = 4 * box.diagonal();  // the lattice reaches beyond the body
      return perform(region_change(Kind::kUnfix, all));
    }
  }
  return {};
}

Status Engine::Impl::fix_rim() {
  const Scene& scene = session->scene();
  if (!scene.fixes.empty()) {
    for (const SceneFix& fix : scene.fixes) KERF_TRY(perform(region_change(Kind::kFix, fix.region)));
    return {};
  }
  Box3 box;
  for (const Vec3 p : session->body().complex.visual.rest.raw()) box.add(p);
  SceneRegion far;
  far.shape = SceneRegion::Shape::kHalfSpace;
  far.point = {box.center().x, box.max.y - kRimShare * box.size().y, box.center().z};
  far.normal = {0, 1, 0};
  return perform(region_change(Kind::kFix, far));
}

Status Engine::Impl::export_files(std::uint32_t client, std::uint32_t request, const std::string& kind) {
  const auto send_file = [&](const std::string& name, std::string_view bytes) {
    send(client, protocol::encode(protocol::File{request, name, bytes}));
  };
  if (kind == "scene") {
    send_file(source.name + ".toml", source.text);
    return {};
  }
  std::vector<std::string> wanted;
  if (kind == "obj") wanted = {"visual", "collision"};
  if (kind == "vtu") wanted = {"hexahedra"};
  if (wanted.empty()) return bad_input(fmt::format("\"{}\" can't be exported; obj, vtu and scene can.", kind));
  auto place = TemporaryFolder::create();
  if (!place) return place.error();
  KERF_TRY(write_final_meshes(*session, wanted, place->path()));
  for (const char* name : {"visual.obj", "collision.obj", "hexahedra.vtu"}) {
    const std::filesystem::path path = place->path() / name;
    std::error_code code;
    if (!std::filesystem::exists(path, code)) continue;
    auto bytes = read_whole_file(path.string());
    if (!bytes) return bytes.error();
    send_file(source.name + "_" + name, bytes->view());
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
  const bool small = m.total <= options.most_upload && client.upload_bytes + m.bytes.size() <= options.most_upload;
  if (!fits || !small) {
    client.upload_bytes -= file.bytes.size();
    client.uploads.erase(found);
    return bad_input(fits ? fmt::format("Uploads have up to {} MiB.", options.most_upload >> 20)
                          : std::string("The chunks of an upload came in the wrong order; send it again."));
  }
  file.bytes += m.bytes;
  client.upload_bytes += m.bytes.size();
  return {};
}

Status Engine::Impl::load_upload(EngineClient& client, std::uint32_t upload, const std::string& thickness) {
  std::array<std::optional<UploadedFile>, 3> parts;
  for (std::uint32_t part = 0; part < 3; ++part) {
    const auto found = client.uploads.find({upload, part});
    if (found == client.uploads.end()) continue;
    if (found->second.bytes.size() != found->second.total) return bad_input("The upload is not complete; send it again.");
    client.upload_bytes -= found->second.bytes.size();
    parts[part] = std::move(found->second);
    client.uploads.erase(found);
  }
  auto place = TemporaryFolder::create();
  if (!place) return place.error();
  SceneSource from;
  from.folder = place->path();
  SceneOverrides with = options.overrides;
  const bool meshes = !parts[2] && parts[0];

  if (parts[2] && lower_extension(parts[2]->name) == ".toml") {
    from.text = parts[2]->bytes;
    from.name = plain_stem(parts[2]->name);
  } else if (parts[2] && lower_extension(parts[2]->name) == ".kerf") {
    from.files.push_back({"body.kerf", std::move(parts[2]->bytes)});
    from.name = plain_stem(parts[2]->name);
    from.text = fmt::format("title = \"{}\"\n[body]\nbound = \"body.kerf\"\n", from.name) + kUploadSimulation;
  } else if (parts[0]) {
    const std::string visual = "visual" + lower_extension(parts[0]->name);
    std::string collision;
    from.name = plain_stem(parts[0]->name);
    from.files.push_back({visual, std::move(parts[0]->bytes)});
    if (parts[1]) {
      collision = "collision" + lower_extension(parts[1]->name);
      from.files.push_back({collision, std::move(parts[1]->bytes)});
      collision = fmt::format("collision = \"{}\"\n", collision);
    }
    from.text = fmt::format("title = \"{}\"\n[body]\nvisual = \"{}\"\n{}", from.name, visual, collision);
    if (!thickness.empty()) {
      double metres = 0;
      const auto [end, error] = std::from_chars(thickness.data(), thickness.data() + thickness.size(), metres);
      if (error != std::errc() || end != thickness.data() + thickness.size() || !(metres > 0 && metres < 1e6))
        return bad_input("The thickness is a positive number of metres.");
      from.text += fmt::format("thickness = {}\n", metres);
    }
    from.text += kUploadSimulation;
  } else {
    return bad_input("There is no such upload: send a visual mesh, a scene (.toml) or a bound body (.kerf) first.");
  }
  for (const char* known : {".obj", ".ply", ".stl", ".off", ".kerf"})
    for (const SceneSource::File& f : from.files)
      if (lower_extension(f.name) == known) KERF_TRY(replace_file((place->path() / f.name).string(), f.bytes));
  if (meshes && is_in_millimetres((place->path() / from.files[0].name).string())) {
    from.text.insert(from.text.find(kUploadSimulation), "scale = 0.001\n");
    from.text.replace(0, from.text.find('\n'), fmt::format("title = \"{} (taken to be in millimetres)\"", from.name));
  }
  for (const SceneSource::File& f : from.files) {
    std::error_code code;
    if (!std::filesystem::exists(place->path() / f.name, code))
      return bad_input("Meshes are OBJ, PLY, STL or OFF files.");
  }
  // A page may send a scene, not read this machine's files through one.
  auto scene = scene_of(from, with);
  if (!scene) return scene.error();
  for (const std::string& file : scene_files(*scene))
    if (!inside(file, place->path()))
      return bad_input("A scene that is uploaded can't name files; use a model, or drop the meshes themselves.");
  cancel_tool();
  KERF_TRY(load(from, with, {}));
  folder.emplace(std::move(*place));
  return {};
}

}  // namespace kerf
