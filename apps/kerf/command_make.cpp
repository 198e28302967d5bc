#include "command_make.h"

#include <fmt/format.h>

#include <cstdio>

#include "command_files.h"
#include "exit_status.h"
#include "folder.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/whole_file.h"
#include "terminal.h"

namespace kerf::app {
namespace {

std::string count_text(const TriangleMesh& mesh) {
  return fmt::format("{} vertices, {} triangles", mesh.positions.size(), mesh.triangles.size());
}

/// A scene in which the model does nothing yet: to be filled by the person.
std::string scene_text(const MakeOptions& options, const Model& model) {
  std::string out = fmt::format("title = \"{}\"\n\n[body]\nvisual = \"visual.{}\"\ncollision = \"collision.{}\"\n",
                                options.model, options.format, options.format);
  if (!model.closed) out += fmt::format("thickness = {}\n", 2 * model.half_thickness.front());
  out +=
      fmt::format("\n[material]\nyoung = {}\npoisson = {}\ndensity = {}\n", model.young, model.poisson, model.density);
  const LatticeHint& l = model.lattice;
  out += fmt::format(
      "\n[lattice]\norigin = [{}, {}, {}]\ncell_size = [{}, {}, {}]\ncells = [{}, {}, {}]\naxes = [[1, 0, "
      "0], [0, 1, 0], [0, 0, 1]]\n",
      l.origin.x, l.origin.y, l.origin.z, l.cell.x, l.cell.y, l.cell.z, l.cells[0], l.cells[1], l.cells[2]);
  out += "\n# Next: [[fix]] regions and [[command]] entries; kerf info --schema explains them.\n";
  return out;
}

/// Work that somebody has put into a file since is not lost unasked.
Status check_kept(const MakeOptions& options, const Model& model, const std::vector<CommandFile>& outputs) {
  const bool obj = options.format == "obj";
  const auto holds = [&](const std::string& file, const TriangleMesh& mesh) {
    return obj ? holds_obj(file, mesh) : holds_ply(file, mesh);
  };
  const auto is_as_made = [&](std::size_t i, const std::string& file) {
    if (i < 2) return holds(file, i == 0 ? model.visual : model.collision);
    ComparedFile scene(file);
    scene.write(scene_text(options, model));
    return scene.is_same();
  };
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    std::error_code code;
    if (!std::filesystem::is_regular_file(outputs[i].path, code)) continue;  // check_places has a word for what is none
    const std::string file = outputs[i].path.string();
    if (!is_as_made(i, file))
      return bad_input(fmt::format(
          "{}: is there already, and is not what would be written; give another folder (--out), or let it be replaced (--replace)",
          shown(file)));
  }
  return {};
}

Status write(const MakeOptions& options, const Model& model) {
  const auto name_of = [&](const char* mesh) { return fmt::format("{}.{}", mesh, options.format); };
  const auto file = [&](const char* mesh) { return (options.out / name_of(mesh)).string(); };
  const std::vector<CommandFile> outputs =
      results_in(options.out, {name_of("visual"), name_of("collision"), "scene.toml"});
  KERF_TRY(check_outputs({}, outputs));
  if (!options.replace) KERF_TRY(check_kept(options, model, outputs));
  KERF_TRY(make_folder(options.out));
  KERF_TRY(check_places(outputs));
  const bool obj = options.format == "obj";
  KERF_TRY(obj ? write_obj(file("visual"), model.visual) : write_ply(file("visual"), model.visual));
  KERF_TRY(obj ? write_obj(file("collision"), model.collision) : write_ply(file("collision"), model.collision));
  return replace_file((options.out / "scene.toml").string(), scene_text(options, model));
}

}  // namespace

int make_meshes(const MakeOptions& options) {
  const Result<Model> model = make_model(options.model, options.options);
  if (!model.ok()) return report(model.error());
  if (const Status status = write(options, *model); !status.ok()) return report(status.error());
  const LatticeHint& l = model->lattice;
  say("{}: visual mesh {} ({}), collision mesh {}, lattice {} x {} x {} cells\nwritten to {}\n", options.model,
      count_text(model->visual), model->closed ? "closed" : "open", count_text(model->collision), l.cells[0],
      l.cells[1], l.cells[2], options.out.string());
  return kSuccess;
}

}  // namespace kerf::app
