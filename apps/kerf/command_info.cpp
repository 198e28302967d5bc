#include "command_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <variant>

#include "exit_status.h"
#include "folder.h"
#include "kerf/base/shown_text.h"
#include "kerf/binding/bound_body_file.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/scene/scene_file.h"
#include "kerf/scene/scene_schema.h"
#include "mesh_folders.h"
#include "placement_text.h"
#include "scene_search.h"
#include "terminal.h"

namespace kerf::app {
namespace {

/// What a command does. Every kind has its own line: a new one does not compile without it.
struct CommandText {
  std::string operator()(const SceneBlade& blade) const {
    return fmt::format("blade, {} poses in {:g} s, {} frame", blade.poses.size(), blade.poses.back().time,
                       frame(blade.frame));
  }
  std::string operator()(const SceneGrasp& grasp) const { return fmt::format("grasp \"{}\"", shown(grasp.id)); }
  std::string operator()(const SceneMove& move) const { return fmt::format("move \"{}\"", shown(move.id)); }
  std::string operator()(const SceneRelease& release) const { return fmt::format("release \"{}\"", shown(release.id)); }
  std::string operator()(const SceneFixCommand&) const { return "fix"; }
  std::string operator()(const SceneUnfix&) const { return "unfix"; }
  std::string operator()(const SceneUndo& undo) const { return fmt::format("undo {}", undo.count); }
  std::string operator()(const SceneRedo& redo) const { return fmt::format("redo {}", redo.count); }
  std::string operator()(const SceneToolMotion& motion) const {
    return fmt::format("tool {} through {} poses", shown(motion.id), motion.poses.size());
  }
  std::string operator()(const SceneJaws& jaws) const {
    return fmt::format("{} {}", jaws.close ? "close" : "open", shown(jaws.id));
  }
  std::string operator()(const ScenePunch& punch) const {
    const std::string outline =
        punch.shape == ScenePunchShape::kPolygon
            ? fmt::format("{} corners", punch.points.size())
            : fmt::format("{} of radius {:g} m", punch.shape == ScenePunchShape::kD ? "half disc" : "circle",
                          punch.radius);
    return fmt::format("punch, {}, {} frame{}", outline, frame(punch.frame),
                       punch.take ? ", takes what comes loose" : "");
  }
  std::string operator()(const SceneShave& shave) const {
    return fmt::format("shave, {} poses in {:g} s, radius {:g} m, {} frame", shave.poses.size(),
                       shave.poses.back().time, shave.radius, frame(shave.frame));
  }
  std::string operator()(const SceneRemove& remove) const {
    return remove.grasp.empty() ? fmt::format("remove loose pieces in a region, {} frame", frame(remove.frame))
                                : fmt::format("remove what \"{}\" holds", shown(remove.grasp));
  }
  static const char* frame(SceneFrame frame) { return frame == SceneFrame::kRest ? "rest" : "world"; }
};

std::string body_text(const SceneBody& body) {
  if (!body.model.empty()) return fmt::format("body      model {}\n", shown(body.model));
  if (!body.visual.empty()) return fmt::format("body      {} bound to {}\n", shown(body.visual), shown(body.collision));
  return fmt::format("body      {}\n", shown(body.bound));
}

int show_scene(const std::filesystem::path& path) {
  const Result<Scene> read = read_scene(path, mesh_folders({}));
  if (!read.ok()) return report(read.error());
  const Scene& scene = *read;
  std::string out = fmt::format("scene     {}\n", shown(path.string()));
  if (!scene.title.empty()) out += fmt::format("title     {}\n", shown(scene.title));
  out += body_text(scene.body);
  for (const SceneBody& body : scene.more_bodies) out += body_text(body);
  out += fmt::format("time      {:g} s in steps of {:g} s\n", scene.simulation.duration, scene.simulation.time_step);
  out += fmt::format("fixed     {} regions\nloads     {}\n", scene.fixes.size(), scene.loads.size());
  out += fmt::format("contact   {}, {} obstacles, {} tools\n", wants_contact(scene) ? "on" : "off",
                     scene.obstacles.size(), scene.tools.size());
  for (const SceneCommand& command : scene.commands)
    out += fmt::format("{:7.3f} s {}\n", command.at, std::visit(CommandText{}, command.what));
  put(stdout, out);
  return kSuccess;
}

std::string length_text(double metres) {
  if (metres >= 1) return fmt::format("{:.4g} m", metres);
  if (metres >= 0.01) return fmt::format("{:.4g} cm", 100 * metres);
  return fmt::format("{:.4g} mm", 1000 * metres);
}

/// Whether a surface has a border; one whose triangles do not fit together may have none and enclose nothing.
std::string kind_of_surface(const SurfaceMeasures& m) {
  if (m.closed) return "closed";
  if (m.border_edges > 0) return "open";
  return fmt::format("neither open nor closed ({} edges with more than two triangles, {} whose two run the same way)",
                     m.non_manifold_edges, m.unoriented_edges);
}

int show_mesh(const InfoOptions& options) {
  const std::string& file = options.file;
  Result<TriangleMesh> mesh = read_mesh(file);
  if (!mesh.ok()) return report(mesh.error());
  if (options.scale != 1)
    for (Vec3& p : mesh->positions) p = options.scale * p;
  MeshInfo info = mesh_info(*mesh);
  // The judge of kerf bind; what only single bodies must not have is said below.
  SurfaceRequirements requirements;
  requirements.bindable = true;
  requirements.single_body = false;
  requirements.weld = options.weld;
  const Result<SurfaceReport> checked = check_surface(*mesh, requirements);
  const bool mended = checked.ok() && !checked->repairs.empty();
  if (mended) info = mesh_info(*mesh);
  const SurfaceMeasures& m = info.measures;
  const Vec3 size = m.box.size();
  std::string out = fmt::format("mesh       {}\n", shown(file));
  if (mended) {
    for (const std::string& repair : checked->repairs) out += fmt::format("repair     {}\n", repair);
    out += "           all that follows is of the surface as repaired\n";
  }
  out += fmt::format("counts     {} vertices, {} edges, {} triangles\n", m.vertices + m.unused_vertices, m.edges,
                     m.triangles);
  // Lengths that doubles can't square have no area; the checks say how large such a surface is.
  if (!std::isfinite(m.area) || !std::isfinite(info.longest_edge) || !std::isfinite(m.volume) || !is_finite(size)) {
    out += fmt::format("unusable   {}\n",
                       checked.ok() ? "its lengths are too large to compute with" : checked.error().message);
    put(stdout, out);
    return kSuccess;
  }
  out += fmt::format("size       {:.6g} x {:.6g} x {:.6g}, centre {:.6g}, {:.6g}, {:.6g}\n", size.x, size.y, size.z,
                     m.box.center().x, m.box.center().y, m.box.center().z);
  out += fmt::format("           if it is in metres: {} long\n", length_text(std::max({size.x, size.y, size.z})));
  out += fmt::format("edges      {:.4g} to {:.4g}, mean {:.4g}; triangle areas {:.4g} to {:.4g}\n", info.shortest_edge,
                     info.longest_edge, info.mean_edge, info.smallest_area, info.largest_area);
  out += fmt::format("surface    {}, {} piece{}, Euler characteristic {}, area {:.6g}", kind_of_surface(m),
                     m.components, m.components == 1 ? "" : "s", m.euler, m.area);
  if (m.closed) out += fmt::format(", volume {:.6g}", m.volume);
  out += fmt::format("\nborders    {} in all {} edges\n", m.border_loops, m.border_edges);
  out += fmt::format("textures   {}; {} group{}\n", info.has_texture ? "yes" : "no", info.groups,
                     info.groups == 1 ? "" : "s");
  if (!checked.ok()) {
    out += fmt::format("unusable   {}\n", checked.error().message);
  } else {
    for (const std::string& warning : checked->warnings) out += fmt::format("warning    {}\n", warning);
    if (!checked->several.empty()) out += fmt::format("unusable   {}\n", checked->several);
    else if (checked->repairs.empty() && checked->warnings.empty()) out += "checks     nothing to mend\n";
    out += "unchecked  whether the body is thin, and whether it passes through itself; kerf bind checks that\n";
  }
  put(stdout, out);
  return kSuccess;
}

int show_bound_body(const std::string& file) {
  BodyNature nature;
  const Result<BoundBody> body = load_bound_body(file, &nature);
  if (!body.ok()) return report(body.error());
  const BindReport& r = body->report;
  std::string out = fmt::format("body       {}\n", shown(file));
  out += fmt::format("visual     {} vertices, {} triangles, {}; before re-meshing {} and {}\n", r.visual_vertices,
                     r.visual_triangles, r.closed ? "closed" : "open sheet", r.input_vertices, r.input_triangles);
  out += fmt::format("collision  {} vertices, {} triangles, mean edge {}\n", body->complex.collision.vertex_count(),
                     body->complex.collision.face_count(), length_text(body->complex.mean_root_edge));
  out += fmt::format("paths      {}, together {}\n", r.paths, length_text(r.path_length));
  if (r.closed) out += fmt::format("placement  {}\n", placement_text(r));
  out += fmt::format("area       {:.6g} m2", r.area_after);
  if (r.closed) out += fmt::format(", volume {:.6g} m3", r.volume_after);
  out += "\nmaterial  ";
  const auto number = [&](const char* what, const std::optional<double>& x, const char* unit) {
    if (x) out += fmt::format(" {} {:.6g}{}{}", what, *x, *unit ? " " : "", unit);
  };
  number("Young's modulus", nature.young, "Pa");
  number("Poisson's ratio", nature.poisson, "");
  number("density", nature.density, "kg/m3");
  if (!nature.young && !nature.poisson && !nature.density) out += " not said; scenes do";
  if (nature.lattice)
    out += fmt::format("\nlattice    {} x {} x {} cells", nature.lattice->cells[0], nature.lattice->cells[1],
                       nature.lattice->cells[2]);
  out += '\n';
  for (const std::string& warning : r.warnings) out += fmt::format("warning    {}\n", warning);
  put(stdout, out);
  return kSuccess;
}

}  // namespace

int show_info(const InfoOptions& options) {
  if (options.schema) {
    put(stdout, options.markdown ? scene_schema_markdown() : scene_schema_text());
    return kSuccess;
  }
  if (options.scenes) {
    for (const std::string& name : shipped_scenes()) say("{}\n", name);
    return kSuccess;
  }
  if (options.file.empty())
    return report(bad_input("info: name a file, or say --schema or --scenes; see kerf info --help"));
  const std::filesystem::path path = options.file;
  const std::string ending = path.extension().string();
  const bool scene = ending == ".toml" || (ending.empty() && !is_there(path));
  if ((scene || ending == ".kerf") && (options.scale != 1 || options.weld))
    return report(
        bad_input(fmt::format("info: {} is no mesh file; leave --scale and --weld out", shown(options.file))));
  if (scene) {
    const Result<std::filesystem::path> found = find_scene(options.file);
    if (!found.ok()) return report(found.error());
    return show_scene(*found);
  }
  if (ending == ".kerf") return show_bound_body(options.file);
  return show_mesh(options);
}

}  // namespace kerf::app
