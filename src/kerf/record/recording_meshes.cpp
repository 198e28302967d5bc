// The mesh files that a scene names, as recordings know them: bytes or at least their hash, and where they are for a replay.
#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "kerf/base/hash.h"
#include "kerf/base/shown_text.h"
#include "kerf/binding/bound_body_file.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/recording_meshes.h"
#include "kerf/scene/scene_body.h"

namespace kerf {
namespace {

SceneSource::Mesh mesh_of(const std::string& written, std::string_view bytes) {
  return {written, bytes.size(), bytes_hash(bytes), std::nullopt};
}

/// A body that a program has travels as the file that it would be saved to: no folder has it.
Status take_body(const SceneBody& body, SceneSource& source, std::size_t& room) {
  const auto taken = [&](const SceneSource::Mesh& mesh) { return mesh.written == body.bound; };
  if (!body.loaded || std::any_of(source.meshes.begin(), source.meshes.end(), taken)) return {};
  std::string bytes = bound_body_bytes(body.loaded->bound, nature_of(*body.loaded));
  if (bytes.size() > room)
    return bad_input(fmt::format(
        "{} has {} bytes, and bodies that are in no file travel up to {} altogether; save() it, and name its file in the scene",
        shown(body.bound), bytes.size(), kMostEmbedded));
  room -= bytes.size();
  source.meshes.push_back(mesh_of(body.bound, bytes));
  source.meshes.back().content = std::move(bytes);
  return {};
}

}  // namespace

std::uint64_t bytes_hash(std::string_view bytes) {
  Hash hash;
  hash.add_bytes(bytes.data(), bytes.size());
  return hash.value();
}

Status take_meshes(const Scene& scene, SceneSource& source, std::size_t most) {
  source.meshes.clear();
  std::size_t room = most;
  KERF_TRY(take_body(scene.body, source, room));
  for (const SceneBody& body : scene.more_bodies) KERF_TRY(take_body(body, source, room));
  for (const SceneFileUse& file : scene.files) {
    const bool uploaded = std::any_of(source.files.begin(), source.files.end(),
                                      [&](const SceneSource::File& f) { return f.name == file.written; });
    if (uploaded) continue;
    auto read = read_whole_file(file.path, kNamedFile);
    if (!read) return read.error();
    const std::string_view bytes = read->view();
    source.meshes.push_back(mesh_of(file.written, bytes));
    if (bytes.size() > room) continue;
    room -= bytes.size();
    source.meshes.back().content = std::string(bytes);
  }
  return {};
}

Status check_meshes(const Scene& scene, const SceneSource& source) {
  for (const SceneSource::Mesh& mesh : source.meshes) {
    const auto use = std::find_if(scene.files.begin(), scene.files.end(),
                                  [&](const SceneFileUse& f) { return f.written == mesh.written; });
    if (use == scene.files.end())
      return bad_input(fmt::format("{}: the recording has a mesh \"{}\" that its scene does not name",
                                   shown(source.name), shown(mesh.written)));
    auto read = read_whole_file(use->path, kNamedFile);
    if (!read) return read.error();
    if (read->view().size() == mesh.bytes && bytes_hash(read->view()) == mesh.hash) continue;
    return bad_input(fmt::format(
        "{}:{}: the mesh \"{}\" is not the one that was recorded ({} bytes with hash {:016x} instead of {} with {:016x}, in {}); "
        "{}",
        shown(source.name), use->line, shown(mesh.written), read->view().size(), bytes_hash(read->view()), mesh.bytes,
        mesh.hash, shown(use->path),
        mesh.content
            ? "it came with the recording, which is damaged: use another copy of it, or record it again"
            : "it was too large to travel in the recording: put the same file there, or give its folder with --meshes"));
  }
  return {};
}

Result<SceneFolders> unpack_meshes(const SceneSource& source, const std::filesystem::path& folder) {
  SceneFolders folders(source.folder);
  folders.meshes = source.mesh_folders;
  std::size_t number = 0;
  for (const SceneSource::Mesh& mesh : source.meshes) {
    if (!mesh.content) continue;
    // The ending says which format it is; nothing else of the name leads anywhere.
    const std::filesystem::path ending = std::filesystem::path(mesh.written).extension();
    const std::string name =
        fmt::format("mesh{}{}", number++, plain_file_name(fmt::format("x{}", ending.string())) ? ending.string() : "");
    KERF_TRY(replace_file((folder / name).string(), *mesh.content));
    folders.instead[mesh.written] = folder / name;
  }
  return folders;
}

}  // namespace kerf
