// The mesh files that a scene names, as recordings know them: bytes or at least their hash, and where they are for a replay.
#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "kerf/base/hash.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/recording_meshes.h"

namespace kerf {

std::uint64_t bytes_hash(std::string_view bytes) {
  Hash hash;
  hash.add_bytes(bytes.data(), bytes.size());
  return hash.value();
}

Status take_meshes(const Scene& scene, SceneSource& source, std::size_t most) {
  source.meshes.clear();
  std::size_t taken = 0;
  for (const SceneFileUse& file : scene.files) {
    const bool uploaded = std::any_of(source.files.begin(), source.files.end(),
                                      [&](const SceneSource::File& f) { return f.name == file.written; });
    if (uploaded) continue;
    auto read = read_whole_file(file.path, kNamedFile);
    if (!read) return read.error();
    const std::string_view bytes = read->view();
    SceneSource::Mesh& mesh = source.meshes.emplace_back();
    mesh.written = file.written;
    mesh.bytes = bytes.size();
    mesh.hash = bytes_hash(bytes);
    if (bytes.size() > most - taken) continue;
    taken += bytes.size();
    mesh.content = std::string(bytes);
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
