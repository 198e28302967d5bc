#include "kerf/session/scene_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/base/shown_text.h"
#include "kerf/binding/join_complexes.h"
#include "kerf/scene/bound_models.h"
#include "kerf/scene/rigid_motion.h"
#include "kerf/scene/scene_body.h"
#include "kerf/scene/scene_lattice.h"
#include "kerf/scene/scene_place.h"
#include "kerf/session/body_build.h"
#include "kerf/session/lattice_memory.h"

namespace kerf {
namespace {

constexpr double kFarthestCells =
    1e6;  // least cells: farther from the origin, doubles don't resolve where things are in a cell

const SceneBody& body_at(const Scene& scene, std::size_t number) {
  return number == 0 ? scene.body : scene.more_bodies[number - 1];
}

/// Does the scene say where cells lie, or how large they are, along the scene's own axes?
bool lattice_is_given(const SceneLattice& wanted) {
  return wanted.cells || wanted.cell_size || wanted.origin || wanted.axes;
}

LatticeFrame placed(const LatticeFrame& frame, const RigidPlace& place) {
  LatticeFrame moved = frame;
  moved.origin = place.to_world(frame.origin);
  moved.axes = product(place.axes, frame.axes);
  return moved;
}

/// Refuses what lies so far off that its invariants would drown in rounding.
Status check_distance(const CollisionMesh& mesh, const LatticeFrame& frame) {
  double distance = 0;
  for (const Vec3 p : mesh.rest.raw())
    for (int i = 0; i < 3; ++i) distance = std::fmax(distance, std::fabs(p[i]));
  const double least = std::fmin(frame.cell.x, std::fmin(frame.cell.y, frame.cell.z));
  if (distance <= kFarthestCells * least) return {};
  return bad_input(fmt::format(
      "the body lies {:.3g} m from the origin, too far for its cells of {:.3g} m ({:.3g} m is the farthest); give [body] a position "
      "nearer to the origin, or move its mesh there",
      distance, least, kFarthestCells * least));
}

/// The cells of a body, which goes to its place.
Result<LatticeFrame> place_body(const Scene& scene, const SceneBody& body, const std::optional<LatticeHint>& hint,
                                CellComplex& complex) {
  const bool moves = body.position != Vec3{} || body.rotation != Vec3{};
  const RigidPlace place = place_of(body.position, body.rotation);
  if (lattice_is_given(scene.lattice)) {
    if (moves) place_complex(place, complex);
    return scene_lattice(scene.lattice, {}, complex.collision);
  }
  auto frame = scene_lattice(scene.lattice, hint, complex.collision);
  if (frame) frame = placed(*frame, place);
  if (moves) place_complex(place, complex);
  return frame;
}

}  // namespace

std::string body_name(const Scene& scene, std::size_t number) {
  const SceneBody& body = body_at(scene, number);
  if (!body.name.empty()) return shown(body.name);
  const std::string& what = !body.model.empty() ? body.model : !body.visual.empty() ? body.visual : body.bound;
  return fmt::format("body {} ({})", number + 1, shown(what));
}

Status check_alone(const SceneBodyLoaded& loaded) {
  const CollisionMesh& mesh = loaded.bound.complex.collision;
  const auto frame = scene_lattice({}, loaded.lattice, mesh);
  if (!frame) return frame.error();
  return check_distance(mesh, *frame);
}

Result<SceneBodies> load_scene_bodies(const Scene& scene, const Progress& progress) {
  SceneBodies out;
  std::vector<std::string> names;
  KERF_TRY(check_model_memory(scene));
  for (std::size_t i = 0; i <= scene.more_bodies.size(); ++i) {
    const SceneBody& body = body_at(scene, i);
    names.push_back(body_name(scene, i));
    auto loaded = body.model.empty() || body.loaded ? load_scene_body(body, progress) : bound_model(body, progress);
    if (!loaded) return at_line(scene, body.line, loaded.error());
    for (std::string& note : loaded->notes) out.notes.push_back(std::move(note));
    CellComplex& complex = loaded->bound.complex;
    const auto frame = place_body(scene, body, loaded->lattice, complex);
    if (!frame) return at_line(scene, scene.lattice.line > 0 ? scene.lattice.line : body.line, frame.error());
    if (const Status near = check_distance(complex.collision, *frame); !near)
      return at_line(scene, body.line, near.error());
    out.memory.push_back({*frame, lattice_memory(complex.collision, *frame, scene.simulation.preconditioner)});
    LatticeBody own;
    own.first = RootId(i == 0 ? 0 : root_count(out.complex));
    own.volume = body_volume(complex);
    own.frame = *frame;
    out.bodies.push_back(own);
    SceneBodyMaterial material;
    material.young = body.material.young ? body.material.young : scene.material.young.value_or(loaded->young);
    material.poisson = body.material.poisson ? body.material.poisson : scene.material.poisson.value_or(loaded->poisson);
    material.density = body.material.density ? body.material.density : scene.material.density.value_or(loaded->density);
    material.prestretch = body.material.prestretch;
    out.materials.push_back(material);
    if (i == 0) {
      out.complex = std::move(complex);
      continue;
    }
    if (complex.closed != out.complex.closed)
      return at_line(
          scene, body.line,
          bad_input(fmt::format("{} is {}, {} is {}: bodies of one scene must all be closed, or all open sheets",
                                names[0], out.complex.closed ? "closed" : "an open sheet", names[i],
                                complex.closed ? "closed" : "an open sheet")));
    append_complex(complex, out.complex);
  }
  KERF_TRY(check_lattice_memory(scene, out.memory));
  return out;
}

}  // namespace kerf
