#include "command_cut.h"

#include <fmt/format.h>

#include "command_files.h"
#include "exit_status.h"
#include "folder.h"
#include "kerf/base/indexed.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/models.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/run_outputs.h"
#include "kerf/record/run_report.h"
#include "kerf/spatial/triangle_queries.h"
#include "progress_bar.h"
#include "result_folder.h"
#include "terminal.h"

namespace kerf::app {
namespace {

/// What the person named: a model, a saved body, or a mesh file.
SceneBody body_named(const CutOptions& options) {
  SceneBody body;
  const std::filesystem::path path(options.body);
  if (!is_there(path))
    for (const ModelName& model : model_names())
      if (model.name == options.body) body.model = options.body;
  if (body.model.empty()) {
    if (path.extension() == ".kerf") body.bound = options.body;
    else body.visual = options.body;
  }
  body.collision = options.collision.string();
  body.thickness = options.thickness;
  body.scale = options.scale;
  body.weld = options.weld;
  return body;
}

/// Meshes that a cut leaves.
std::vector<std::string> cut_meshes() { return {"visual", "collision", "hexahedra"}; }

/// Names of the files that a cut leaves in its folder.
std::vector<std::string> cut_files() {
  std::vector<std::string> names = final_mesh_files(cut_meshes());
  names.emplace_back("report.json");
  return names;
}

/// Of the face of the mid-surface at rest that is nearest to a point.
Vec3 normal_near(const CollisionMesh& mesh, Vec3 p) {
  Vec3 normal;
  double nearest = HUGE_VAL;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const auto corner = [&](int i) { return mesh.rest[mesh.from(CollisionMesh::corner(f, i))]; };
    ClosestPoint there;
    closest_point(p, {corner(0), corner(1), corner(2)}, there);
    if (!(there.distance < nearest)) continue;
    nearest = there.distance;
    normal = normalized(cross(corner(1) - corner(0), corner(2) - corner(0)));
  }
  return normal;
}

/// Cuts, and writes the meshes.
Status cut_once(const CutOptions& options, Session& session, RunLog& log) {
  Box3 box;
  for (const Vec3 p : session.collision_positions()) box.add(p);
  // Default: the blade stands on the surface where the cut begins.
  Vec3 edge = options.along.value_or(Vec3{});
  if (!options.along) {
    edge = normal_near(session.body().complex.collision, options.from);
    const Vec3 path = normalized(options.to - options.from);
    edge = edge - dot(edge, path) * path;
    // The sine of the angle between cut and normal, below which the normal says nothing about the edge.
    constexpr double kLeastSine = 0.1;
    if (!(norm(edge) > kLeastSine))
      return bad_input(
          "cut: at --from the cut runs along the surface's normal, so the blade's edge can't stand on the "
          "surface; say how it stands with --along X,Y,Z, or choose other points");
  }
  edge = (2 * box.diagonal() + norm(options.from - box.center()) + norm(options.to - box.center())) * normalized(edge);
  KERF_TRY(session.begin_stroke(SceneFrame::kRest, options.through));
  KERF_TRY(session.move_blade(options.from + edge, options.from - edge));
  KERF_TRY(session.move_blade(options.to + edge, options.to - edge));
  KERF_TRY(session.end_stroke());

  Status valid = session.validate();
  log.checks.push_back({0, "cut", valid ? "" : valid.error().message});
  KERF_TRY(write_final_meshes(session, cut_meshes(), options.out));
  const StrokeRecord& stroke = session.strokes().back();
  const BodyCounts now = session.counts();
  if (stroke.triangles == 0)
    return bad_input(fmt::format(
        "cut: the blade met nothing between --from and --to. The collision mesh reaches from {:.4g},{:.4g},{:.4g} "
        "to {:.4g},{:.4g},{:.4g} m; --along turns the blade's edge",
        box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z));
  say("{} cut in {:.2f} ms: {}; results: {}\n", counted(stroke.triangles, "collision triangle"),
      1e3 * stroke.times.total, counted(now.pieces, "piece"), options.out.string());
  return valid;
}

}  // namespace

int cut_body(const CutOptions& options) {
  if (!(norm(options.to - options.from) > 0))
    return report(bad_input("cut: --from and --to are the same point; a cut needs some length"));
  if (options.along && !(norm(cross(*options.along, options.to - options.from)) > 0))
    return report(
        bad_input("cut: --along has no length or points along the cut itself; the blade's edge must cross its path"));
  if (const SceneBody named = body_named(options); named.visual.empty() && (options.scale != 1 || options.weld))
    return report(bad_input(fmt::format(
        "cut: \"{}\" is in metres already, and its vertices are joined; --scale and --weld are for mesh files",
        shown(options.body))));
  if (const SceneBody named = body_named(options); !named.visual.empty() && named.collision.empty()) {
    if (!is_there(named.visual)) {
      std::string models;
      for (const ModelName& model : model_names()) models += (models.empty() ? "" : ", ") + std::string(model.name);
      return report(bad_input(fmt::format("cut: there is no file \"{}\", and no model of that name (models: {})",
                                          shown(options.body), models)));
    }
  }
  Scene scene;
  scene.name = std::filesystem::path(options.body).stem().string();
  scene.title = "one cut of " + options.body;
  scene.body = body_named(options);
  scene.simulation.gravity = {};
  const std::vector<CommandFile> inputs = files_of(scene.body);
  const std::vector<CommandFile> outputs = results_in(options.out, cut_files());
  if (const Status apart = check_outputs(inputs, outputs); !apart) return report(apart.error());
  const Result<FolderLock> folder = take_result_folder(options.out);
  if (!folder) return report(folder.error());
  if (const Status possible = check_places(outputs); !possible) return report(possible.error());
  std::optional<Session> session;
  RunLog log;
  const Status prepared = prepare_reported({scene, options.out, cut_files()}, [&]() -> Status {
    Result<Session> made = [&] {
      ProgressBar bar;
      return Session::create(scene, bar.callback());
    }();
    if (!made.ok()) {
      Error why = made.error();
      if (const std::string name = shown(options.body); why.message.find(name) == std::string::npos)
        why.message = fmt::format("{}: {}", name, why.message);
      return why;
    }
    session.emplace(std::move(made).value());
    say_notes(session->notes());
    log.counts_before = session->counts();
    return {};
  });
  if (!prepared) return report(prepared.error());
  return work_reported({*session, log, options.out, cut_files(), paths_of(inputs)},
                       [&] { return cut_once(options, *session, log); });
}

}  // namespace kerf::app
