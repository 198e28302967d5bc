#include "kerf/scene/scene_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "kerf/base/shown_text.h"
#include "kerf/mesh/lips.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/surface_tolerances.h"
#include "kerf/midsurface/coarse_sheet.h"
#include "kerf/midsurface/tolerances.h"
#include "kerf/scene/automatic_body.h"
#include "kerf/scene/sheet_folds.h"
#include "kerf/scene/tolerances.h"
#include "kerf/scene/ways_out.h"

namespace kerf {
namespace {

void add_notes(std::vector<std::string>& notes, const std::string& file, const std::vector<std::string>& sentences) {
  const std::string name = shown(file);
  for (const std::string& sentence : sentences) {
    notes.push_back(sentence.find(name) == std::string::npos ? fmt::format("{}: {}", name, sentence) : sentence);
  }
}

/// A surface that was given goes before the file.
Result<TriangleMesh> read_surface(const std::string& file, std::optional<TriangleMesh> given, double scale,
                                  const SurfaceRequirements& wanted, const Progress& progress,
                                  std::vector<std::string>& notes) {
  KERF_TRY(progress("read", 0));
  Result<TriangleMesh> mesh = given ? Result<TriangleMesh>(std::move(*given)) : read_mesh(file);
  if (!mesh.ok()) return mesh.error();
  if (scale != 1) {
    for (Vec3& p : mesh->positions) p = scale * p;
  }
  KERF_TRY(progress("check", 0));
  SurfaceRequirements requirements = wanted;
  requirements.name = scale == 1 ? shown(file) : fmt::format("{}, scaled by {:g}", shown(file), scale);
  requirements.bindable = true;
  const Result<SurfaceReport> checked = check_surface(*mesh, requirements);
  if (!checked.ok()) return checked.error();
  add_notes(notes, file, checked->repairs);
  add_notes(notes, file, checked->warnings);
  return mesh;
}

/// The middle of the first border edge.
std::string first_border(const TriangleMesh& mesh) {
  const auto uses = edge_uses(mesh.triangles.raw(), mesh.positions.size());
  std::string out = "nowhere";
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() != 1 || out != "nowhere") return;
    const Vec3 p = 0.5 * (mesh.positions[VertexId(edge[0].low)] + mesh.positions[VertexId(edge[0].high)]);
    out = fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x, p.y, p.z);
  });
  return out;
}

Error named(Error error, const std::string& name) {
  error.message = fmt::format("{}: {}", shown(name), error.message);
  return error;
}

/// What people should know about a collision mesh that was made for them.
std::vector<std::string> remarks(const Midsurface& m) {
  std::vector<std::string> out = m.notes;
  out.insert(out.end(), m.verdict.warnings.begin(), m.verdict.warnings.end());
  return out;
}

/// A closed surface says itself how thick it is.
void note_unused_thickness(const SceneBody& body, const CellComplex& complex, const std::string& name,
                           std::vector<std::string>& notes) {
  if (body.thickness && complex.closed)
    notes.push_back(fmt::format(
        "{}: the thickness of {} m that was given is not used: the {} is closed and says itself how thick it is", name,
        *body.thickness, body.model.empty() ? "surface" : "model"));
}

/// A closed body with a triangle missing is a sheet to those who look at its border alone.
void note_few_holes(const TriangleMesh& visual, const std::string& name, std::vector<std::string>& notes) {
  const SurfaceMeasures m = surface_measures(visual);
  const auto open = static_cast<double>(m.border_edges), all = static_cast<double>(m.edges);
  if (open > kFewOpenEdges * all || !(open * open < kRoundBorder * all)) return;
  notes.push_back(fmt::format(
      "{}: only {} of {} edges lie on a border, the first near {}: it is taken as a sheet. If it should be a closed body, {}",
      name, m.border_edges, m.edges, first_border(visual), kCloseTheHoles.command_line));
}

/// Refuses a sheet that is thicker than its surface is across.
Status check_thickness(const SceneBody& body, const TriangleMesh& visual, const std::string& name) {
  Box3 box;
  for (const Vec3 p : visual.positions) box.add(p);
  if (!body.thickness || *body.thickness <= box.diagonal() || surface_measures(visual).closed) return {};
  return bad_input(fmt::format(
      "{}: thickness is {:g} m, but the surface is {:.3g} m across, and a sheet is thinner than that; give thickness in metres",
      name, *body.thickness, box.diagonal()));
}

/// Wanted by the scene; 0: as many as it takes.
std::size_t collision_triangles(const SceneBody& body) {
  return body.collision_triangles > 0 ? static_cast<std::size_t>(body.collision_triangles)
                                      : body.options.collision_triangles;
}

/// People have not seen the mesh that was made: they are told where in the sheet it does not bind.
Error about_made_mesh(Error error, const std::optional<Vec3>& at_fault) {
  std::string where;
  if (at_fault) where = fmt::format(" near ({:.4g}, {:.4g}, {:.4g})", at_fault->x, at_fault->y, at_fault->z);
  error.message = fmt::format("the collision mesh that was made of the sheet does not bind{} ({}); {}", where,
                              error.message, kGiveCollisionMesh.command_line);
  return error;
}

std::optional<Vec3> middle_of(const std::vector<CollisionVertex>& vertices, const TriangleMesh& mesh) {
  if (vertices.empty()) return std::nullopt;
  Box3 box;
  for (const CollisionVertex v : vertices) box.add(mesh.positions[VertexId(v.value)]);
  return box.center();
}

/// An open sheet is its own collision mesh, or one with fewer triangles is made of it.
Result<BoundBody> bind_sheet(const TriangleMesh& visual, std::size_t triangles, const BindOptions& options) {
  const bool own = triangles == 0 && !is_too_fine(visual.triangles.size());
  const std::size_t expected = triangles > 0 ? triangles : static_cast<std::size_t>(mid::kMostByNeed);
  KERF_TRY(check_sheet_folds(visual, own ? 0 : expected));
  if (own) return bind(visual, visual, options);
  KERF_TRY(check_wanted_triangles(triangles, visual));
  MidsurfaceOptions wanted;
  wanted.triangles = triangles;
  wanted.progress = options.progress;
  const TriangleMesh apart = with_lips_drawn_back(visual);
  for (int i = 0;; ++i) {
    Result<TriangleMesh> coarse = make_coarse_sheet(apart, options.thickness, wanted);
    if (!coarse.ok()) return coarse.error();
    std::vector<CollisionVertex> at_fault;
    BindOptions binding = options;
    binding.at_fault = &at_fault;
    Result<BoundBody> bound = bind(visual, *coarse, binding);
    if (bound.ok()) return bound;
    const std::optional<Vec3> place = middle_of(at_fault, *coarse);
    // More triangles mend no fold of the sheet itself.
    if (place) KERF_TRY(check_sheet_folds_near(visual, coarse->triangles.size(), *place));
    if (i + 1 == kTriesOfSheet) {
      KERF_TRY(check_sheet_folds(visual, 0));
      return about_made_mesh(bound.error(), place);
    }
    wanted.triangles = 2 * coarse->triangles.size();
  }
}

Result<BoundBody> bind_automatically(const SceneBody& body, const TriangleMesh& visual, const BindOptions& options,
                                     std::vector<std::string>& notes, std::optional<Midsurface>* made) {
  Result<AutomaticBody> automatic = make_automatic_body(visual, collision_triangles(body), options);
  if (!automatic.ok()) return automatic.error();
  add_notes(notes, body.visual, remarks(automatic->midsurface));
  std::optional<Error> refused = std::move(automatic->refused);
  if (!automatic->bound && !refused) refused = bad_input(not_thin_message(automatic->midsurface));
  if (made != nullptr) *made = std::move(automatic->midsurface);
  if (refused && automatic->slits)
    refused->message +=
        "; the body has slits: one that Kerf cut has its collision mesh beside it (collision_rest.obj), for --collision";
  if (refused) return *refused;
  return std::move(*automatic->bound);
}

/// A flat sheet of another size. Cells as many as before, about square.
Status resize(Vec3 size, const std::string& name, Model& model) {
  if (name != "closed-sheet")
    return bad_input(fmt::format("size of [body] goes with model closed-sheet, not with {}", shown(name)));
  if (!(size.x > 0 && size.y > 0 && size.z > 0)) return bad_input("size of [body]: all three must be positive");
  Box3 box;
  for (const Vec3 p : model.visual.positions) box.add(p);
  const Vec3 was = box.size(), scale{size.x / was.x, size.y / was.y, size.z / was.z};
  for (auto* positions : {&model.visual.positions, &model.collision.positions})
    for (Vec3& p : *positions) p = {scale.x * p.x, scale.y * p.y, scale.z * p.z};
  for (double& half : model.half_thickness) half *= scale.z;
  LatticeHint& l = model.lattice;
  const double edge = std::sqrt(size.x * size.y / (l.cells[0] * l.cells[1]));
  l.cells = {std::max(1, static_cast<int>(std::lround(size.x / edge))),
             std::max(1, static_cast<int>(std::lround(size.y / edge))), l.cells[2]};
  l.cell = {size.x / l.cells[0], size.y / l.cells[1], size.z / l.cells[2]};
  l.origin = -0.5 * size;
  return {};
}

}  // namespace

Result<SceneBodyLoaded> load_scene_body(const SceneBody& body, const Progress& progress,
                                        std::optional<Midsurface>* made, SurfacesInMemory given) {
  if (body.loaded) return *body.loaded;
  SceneBodyLoaded out;
  if (!body.bound.empty()) {
    KERF_TRY(progress("load", 0));
    BodyNature nature;
    Result<BoundBody> bound = load_bound_body(body.bound, &nature);
    if (!bound.ok()) return bound.error();
    if (Status sound = check_nature(nature, shown(body.bound)); !sound) {
      Error error = sound.error();
      error.message += "; bind it again with another one";
      return error;
    }
    return with_nature(std::move(*bound), nature);
  }
  TriangleMesh visual, collision;
  BindOptions options;
  options.exact = body.exact_paths;
  options.thickness = body.thickness.value_or(0);
  options.merge = !body.model.empty();  // files were merged when they were judged
  options.progress = progress;
  std::string name;
  if (!body.model.empty()) {
    KERF_TRY(progress("make", 0));
    Result<Model> model = make_model(body.model, body.options);
    if (!model.ok()) return model.error();
    if (body.size) KERF_TRY(resize(*body.size, body.model, *model));
    out.lattice = model->lattice;
    out.young = model->young;
    out.poisson = model->poisson;
    out.density = model->density;
    if (!body.thickness && !model->half_thickness.empty()) options.thickness = 2 * model->half_thickness.front();
    visual = std::move(model->visual);
    collision = std::move(model->collision);
    name = body.model;
  } else {
    SurfaceRequirements wanted;
    wanted.weld = body.weld;
    Result<TriangleMesh> read =
        read_surface(body.visual, std::move(given.visual), body.scale, wanted, progress, out.notes);
    if (!read.ok()) return read.error();
    visual = std::move(*read);
    if (const SurfaceMeasures m = surface_measures(visual); !body.thickness && !m.closed) {
      return bad_input(fmt::format(
          "{} is an open surface ({} of {} edges lie on a border, the first near {}). If it should be closed, {}; if it "
          "is meant as a sheet, {}",
          shown(body.visual), m.border_edges, m.edges, first_border(visual), kCloseTheHoles.command_line,
          kGiveThickness.command_line));
    }
    if (body.collision.empty()) {
      if (surface_measures(visual).closed) {
        Result<BoundBody> bound = bind_automatically(body, visual, options, out.notes, made);
        if (!bound.ok()) return named(bound.error(), body.visual);
        out.bound = std::move(*bound);
        add_notes(out.notes, body.visual, out.bound.report.warnings);
        note_unused_thickness(body, out.bound.complex, body.visual, out.notes);
        return out;
      }
      name = body.visual;
      KERF_TRY(check_thickness(body, visual, name));
      note_few_holes(visual, name, out.notes);
      Result<BoundBody> bound = bind_sheet(visual, collision_triangles(body), options);
      if (!bound.ok()) return named(bound.error(), name);
      out.bound = std::move(*bound);
      add_notes(out.notes, name, out.bound.report.warnings);
      return out;
    } else {
      wanted.closedness = Closedness::kOpen;
      read = read_surface(body.collision, std::move(given.collision), body.scale, wanted, progress, out.notes);
      if (!read.ok()) return read.error();
      collision = std::move(*read);
      name = body.visual + " with " + body.collision;
    }
  }
  KERF_TRY(check_thickness(body, visual, name));
  Result<BoundBody> bound = bind(visual, collision, options);
  if (!bound.ok()) {
    Error error = named(bound.error(), name);
    if (body.options.noise > 0)
      error.message += fmt::format("; noise of {} m moves the visual mesh that far, give less", body.options.noise);
    return error;
  }
  out.bound = std::move(*bound);
  add_notes(out.notes, name, out.bound.report.warnings);
  note_unused_thickness(body, out.bound.complex, name, out.notes);
  return out;
}

BodyNature nature_to_keep(const SceneBody& body, const SceneBodyLoaded& loaded, const BodyNature& said) {
  BodyNature nature = said;
  nature.lattice = loaded.lattice;
  if (body.model.empty()) return nature;
  nature.young = said.young.value_or(loaded.young);
  nature.poisson = said.poisson.value_or(loaded.poisson);
  nature.density = said.density.value_or(loaded.density);
  return nature;
}

SceneBodyLoaded with_nature(BoundBody bound, const BodyNature& nature) {
  SceneBodyLoaded out;
  out.bound = std::move(bound);
  out.young = nature.young.value_or(out.young);
  out.poisson = nature.poisson.value_or(out.poisson);
  out.density = nature.density.value_or(out.density);
  out.lattice = nature.lattice;
  return out;
}

BodyNature nature_of(const SceneBodyLoaded& loaded) {
  return {loaded.young, loaded.poisson, loaded.density, loaded.lattice};
}

}  // namespace kerf
