#include "kerf/session/scene_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/binding/join_complexes.h"
#include "kerf/scene/rigid_motion.h"
#include "kerf/scene/scene_body.h"
#include "kerf/scene/scene_lattice.h"
#include "kerf/scene/scene_place.h"
#include "kerf/session/body_build.h"
#include "kerf/session/lattice_memory.h"

namespace kerf {
namespace {

constexpr double kInside = 1e-9;  // of a cell: where a body that fits exactly ends
constexpr double kFarthestCells =
    1e6;  // least cells: farther from the origin, doubles don't resolve where things are in a cell
constexpr double kMuchFiner = 2.5;  // cells along an axis where a body alone would have one

const SceneBody& body_at(const Scene& scene, std::size_t number) {
  return number == 0 ? scene.body : scene.more_bodies[number - 1];
}

/// Does the scene say where the lattice lies, or how large its cells are, along the scene's own axes?
bool lattice_is_given(const SceneLattice& wanted) {
  return wanted.cells || wanted.cell_size || wanted.origin || wanted.axes;
}

LatticeFrame placed(const LatticeFrame& frame, const RigidPlace& place) {
  LatticeFrame moved = frame;
  moved.origin = place.to_world(frame.origin);
  moved.axes = product(place.axes, frame.axes);
  return moved;
}

/// Length of a frame's cell along the axis of its own that lies nearest to this direction.
double cell_along(const LatticeFrame& frame, Vec3 direction) {
  int best = 0;
  for (int i = 1; i < 3; ++i)
    if (std::fabs(dot(frame.axes.c[static_cast<std::size_t>(i)], direction)) >
        std::fabs(dot(frame.axes.c[static_cast<std::size_t>(best)], direction)) + kInside)
      best = i;
  return frame.cell[best];
}

/// One lattice for all: the first one's axes and corners, the least cells, as many as hold the mesh.
Result<LatticeFrame> joined_frame(const std::vector<LatticeFrame>& frames, const CollisionMesh& mesh) {
  LatticeOptions options;
  options.given = true;
  options.axes = frames[0].axes;
  for (int i = 0; i < 3; ++i) {
    options.cell[i] = HUGE_VAL;
    for (const LatticeFrame& frame : frames)
      options.cell[i] = std::fmin(options.cell[i], cell_along(frame, options.axes.c[static_cast<std::size_t>(i)]));
  }
  Box3 box;
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
    for (const double side : {1.0, -1.0}) box.add(transposed_times(options.axes, mesh.rest[v] + side * mesh.offset[v]));
  Vec3 low = transposed_times(options.axes, frames[0].origin);
  for (int i = 0; i < 3; ++i) {
    const double cell = options.cell[i];
    low[i] -= cell * std::ceil((low[i] - box.min[i]) / cell - kInside);
    const double count = std::ceil((box.max[i] - low[i]) / cell - kInside);
    if (!(count < static_cast<double>(kMaxLatticeCells)))
      return bad_input(
          fmt::format("the bodies lie {:.3g} m apart, too far for cells of {:.3g} m; move them together or give "
                      "larger cells in [lattice]",
                      box.size()[i], cell));
    options.count[static_cast<std::size_t>(i)] = std::max(1, static_cast<int>(count));
  }
  options.origin = options.axes * low;
  return choose_lattice(mesh, options);
}

/// Refuses what lies so far off that its invariants would drown in rounding.
Status check_distance(const SceneBodies& bodies) {
  Box3 box;
  for (const Vec3 p : bodies.complex.collision.rest.raw()) box.add(p);
  double distance = 0;
  for (const Vec3 corner : {box.min, box.max})
    for (int i = 0; i < 3; ++i) distance = std::fmax(distance, std::fabs(corner[i]));
  const Vec3 cell = bodies.frame.cell;
  const double least = std::fmin(cell.x, std::fmin(cell.y, cell.z));
  if (distance <= kFarthestCells * least) return {};
  return bad_input(fmt::format(
      "the body lies {:.3g} m from the origin, too far for its cells of {:.3g} m ({:.3g} m is the farthest); give [body] a position "
      "nearer to the origin, or move its mesh there",
      distance, least, kFarthestCells * least));
}

Result<SceneBodies> gather_bodies(const Scene& scene, const Progress& progress) {
  SceneBodies out;
  std::vector<LatticeFrame> frames;
  std::vector<std::string> names;
  for (std::size_t i = 0; i <= scene.more_bodies.size(); ++i) {
    const SceneBody& body = body_at(scene, i);
    names.push_back(body_name(scene, i));
    auto loaded = load_scene_body(body, progress);
    // What is wrong with a file is said with its name; models have none.
    if (!loaded) return body.model.empty() ? loaded.error() : at_line(scene, body.line, loaded.error());
    for (std::string& note : loaded->notes) out.notes.push_back(std::move(note));
    CellComplex& complex = loaded->bound.complex;
    if (!lattice_is_given(scene.lattice)) {
      auto frame = scene_lattice(scene.lattice, loaded->lattice, complex.collision);
      if (!frame) return at_line(scene, scene.lattice.line, frame.error());
      frames.push_back(placed(*frame, place_of(body.position, body.rotation)));
    }
    if (body.position != Vec3{} || body.rotation != Vec3{})
      place_complex(place_of(body.position, body.rotation), complex);
    SceneBodyMaterial material;
    material.young = body.material.young ? body.material.young : scene.material.young.value_or(loaded->young);
    material.poisson = body.material.poisson ? body.material.poisson : scene.material.poisson.value_or(loaded->poisson);
    material.density = body.material.density ? body.material.density : scene.material.density.value_or(loaded->density);
    out.materials.push_back(material);
    if (i == 0) {
      out.bodies.push_back({RootId(0), body_volume(complex), 1});
      out.complex = std::move(complex);
      continue;
    }
    if (complex.closed != out.complex.closed)
      return bad_input(fmt::format("{} is {}, {} is {}: bodies of one scene must all be closed, or all open sheets",
                                   names[0], out.complex.closed ? "closed" : "an open sheet", names[i],
                                   complex.closed ? "closed" : "an open sheet"));
    out.bodies.push_back({RootId(root_count(out.complex)), body_volume(complex), 1});
    append_complex(complex, out.complex);
  }

  if (frames.empty()) {
    auto frame = scene_lattice(scene.lattice, {}, out.complex.collision);
    if (!frame) return at_line(scene, scene.lattice.line, frame.error());
    out.frame = *frame;
    return out;
  }
  if (frames.size() == 1) {
    out.frame = frames[0];
    return out;
  }
  auto frame = joined_frame(frames, out.complex.collision);
  if (!frame) return at_line(scene, scene.lattice.line, frame.error());
  out.frame = *frame;
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const Vec3 axis = out.frame.axes.c[static_cast<std::size_t>(k)];
      const double own = cell_along(frames[i], axis);
      if (own < kMuchFiner * out.frame.cell[k]) continue;
      out.notes.push_back(
          fmt::format("{} gets cells of {:.3g} m, because another body needs them, where {:.3g} m would do alone; "
                      "give cell_size in [lattice] if that is too slow",
                      names[i], out.frame.cell[k], own));
      break;
    }
  return out;
}

}  // namespace

std::string body_name(const Scene& scene, std::size_t number) {
  const SceneBody& body = body_at(scene, number);
  if (!body.name.empty()) return body.name;
  const std::string& what = !body.model.empty() ? body.model : !body.visual.empty() ? body.visual : body.bound;
  return fmt::format("body {} ({})", number + 1, what);
}

Result<SceneBodies> load_scene_bodies(const Scene& scene, const Progress& progress) {
  auto bodies = gather_bodies(scene, progress);
  if (bodies) KERF_TRY(check_distance(*bodies));
  if (bodies) KERF_TRY(check_lattice_memory(scene, bodies->complex.collision, bodies->frame));
  return bodies;
}

}  // namespace kerf
