#include "command_bind.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "command_files.h"
#include "exit_status.h"
#include "folder.h"
#include "kerf/base/degrees.h"
#include "kerf/binding/bound_body_file.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/midsurface/diagnosis_file.h"
#include "kerf/scene/scene_body.h"
#include "kerf/session/scene_bodies.h"
#include "placement_text.h"
#include "progress_bar.h"
#include "terminal.h"

namespace kerf::app {
namespace {

Status save_collision(const std::filesystem::path& path, const TriangleMesh& mesh) {
  return ending_of(path) == ".ply" ? write_ply(path.string(), mesh) : write_obj(path.string(), mesh);
}

bool is_model(const BindOptions& options) {
  if (is_there(options.visual)) return false;
  const auto& names = model_names();
  return std::any_of(names.begin(), names.end(), [&](const ModelName& m) { return m.name == options.visual.string(); });
}

Result<SceneBodyLoaded> bind_and_save(const BindOptions& options, std::optional<Midsurface>& made) {
  const BodyNature said{options.young, options.poisson, options.density, {}};
  KERF_TRY(check_nature(said, "bind"));
  SceneBody body;
  if (is_model(options)) body.model = options.visual.string();
  else body.visual = options.visual.string();
  body.collision = options.collision.string();
  body.options.collision_triangles = options.triangles;
  body.scale = options.scale;
  body.thickness = options.thickness;
  body.weld = options.weld;
  body.exact_paths = options.exact_paths;
  std::vector<CommandFile> outputs{{"the body", options.out}};
  if (!options.write_collision.empty()) outputs.push_back({"the made collision mesh", options.write_collision});
  if (!options.diagnose.empty()) outputs.push_back({"the judged surface", options.diagnose});
  KERF_TRY(check_outputs(files_of(body), outputs));
  KERF_TRY(check_ending({"the body", options.out}, {".kerf", ""}));
  if (!options.write_collision.empty())
    KERF_TRY(check_ending({"the made collision mesh", options.write_collision}, {".obj", ".ply"}));
  if (!options.diagnose.empty()) KERF_TRY(check_ending({"the judged surface", options.diagnose}, {".ply"}));
  // Binding may take long: where its results go is looked at before, unless there is nothing to bind.
  for (const std::filesystem::path* file : {&options.out, &options.write_collision, &options.diagnose}) {
    if ((file->empty() && file != &options.out) || (body.model.empty() && !is_there(options.visual))) continue;
    if (file->has_parent_path()) KERF_TRY(make_folder(file->parent_path()));
    KERF_TRY(check_can_be_written(file->string()));
  }
  ProgressBar bar(options.quiet);
  Result<SceneBodyLoaded> loaded = load_scene_body(body, bar.callback(), &made);
  if (made && !options.diagnose.empty()) KERF_TRY(write_diagnosis(options.diagnose.string(), made->diagnosis));
  // One that does not bind is saved too, so that it can be looked at and mended.
  if (made && !made->collision.triangles.empty() && !options.write_collision.empty())
    KERF_TRY(save_collision(options.write_collision, made->collision));
  if (!loaded.ok()) return loaded;
  KERF_TRY(save_bound_body(loaded->bound, options.out, nature_to_keep(body, *loaded, said)));
  return loaded;
}

/// What the collision mesh that was made is like, one row each.
std::string quality_table(const Midsurface& m) {
  const MidsurfaceQuality& q = m.quality;
  const double h = q.mean_half_thickness;
  std::string out = fmt::format("collision mesh made in {:.3g} s: {} triangles (bends ask for {:.0f})\n",
                                m.seconds.total, m.collision.triangles.size(), q.need);
  const auto row = [&](const char* what, const std::string& value) { out += fmt::format("  {:<34}{}\n", what, value); };
  row("half thickness",
      fmt::format("{:.3g} mm on average; {:.2g} times as wide as thick", 1e3 * h, m.verdict.width_over_thickness));
  row("smallest angle",
      fmt::format("{:.0f} degrees, {:.0f} on average", kDegrees * q.smallest_angle, kDegrees * q.mean_smallest_angle));
  row("off the medial surface", fmt::format("{:.1f} % of the half thickness on average, {:.0f} % at most",
                                            100 * q.medial_mean, 100 * q.medial_max));
  row("error of the thickness",
      fmt::format("{:.1f} % on average, {:.0f} % at most", 100 * q.thickness_mean, 100 * q.thickness_max));
  row("surface to prisms",
      fmt::format("{:.2g} half thicknesses on average, {:.2g} at most", q.to_prisms_mean / h, q.to_prisms_max / h));
  row("prisms to surface", fmt::format("{:.2g} half thicknesses at most", q.to_visual_max / h));
  row("normals that meet both sides", fmt::format("{:.4g} %", 100 * q.good_rays));
  return out;
}

}  // namespace

int bind_meshes(const BindOptions& options) {
  if (is_model(options) && (options.scale != 1 || !options.collision.empty() || options.weld))
    return report(bad_input(fmt::format(
        "bind: {} is a model, in metres and with its own collision mesh; leave --scale, --weld and --collision out, or "
        "give a mesh file",
        options.visual.string())));
  std::optional<Midsurface> made;
  const Result<SceneBodyLoaded> loaded = bind_and_save(options, made);
  if (!loaded.ok()) return report(loaded.error());
  std::vector<std::string> notes = loaded->notes;
  if (const Status usable = check_alone(*loaded); !usable)
    notes.push_back(fmt::format("{}: kerf run, view and cut refuse this body as it is: {}", shown(options.out.string()),
                                usable.error().message));
  say_notes(notes);
  if (options.quiet) return kSuccess;
  if (made) put(stdout, quality_table(*made));
  const BindReport& r = loaded->bound.report;
  say("bound {} visual triangles to {} collision triangles ({}) in {:.3g} s; "
      "re-meshing added {} vertices and {} triangles\n",
      r.input_triangles, loaded->bound.complex.collision.face_count(), r.closed ? "closed" : "open sheet",
      r.seconds.total, r.visual_vertices - r.input_vertices, r.visual_triangles - r.input_triangles);
  if (r.closed) say("{}\n", placement_text(r));
  say("written to {}\n", options.out.string());
  return kSuccess;
}

}  // namespace kerf::app
