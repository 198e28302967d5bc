// Notes for whoever wrote the scene: what marks, holds or cuts nothing, and what a blade went through without cutting it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/session/scene_bodies.h"
#include "kerf/session/scene_place.h"
#include "kerf/session/session_impl.h"

namespace kerf {
namespace {

/// Mean collision edges that a point on the surface may lie away from the nearest collision vertex, beside the half thickness there.
constexpr double kNearVertex = 2;
/// Relative: sums of decimal fractions end a few bits late.
constexpr double kTimeTolerance = 1e-9;

/// What leads one thing along a path, from `began` to `end`.
struct Leading {
  const std::string* id;
  std::string_view what, verb;
  double end;
};

/// The tool or grasp that a command leads, and until when.
std::optional<Leading> leading(const SceneCommand& c) {
  if (const auto* motion = std::get_if<SceneToolMotion>(&c.what); motion && !motion->poses.empty())
    return Leading{&motion->id, "tool", "leads", c.at + motion->poses.back().time};
  if (const auto* move = std::get_if<SceneMove>(&c.what)) return Leading{&move->id, "grasp", "moves", c.at + move->over};
  return {};
}

}  // namespace

void Session::Impl::add_note(std::string note) {
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(std::move(note));
}

std::string Session::Impl::name_of_body(std::int32_t body) const { return body_name(scene, static_cast<std::size_t>(body)); }

void Session::Impl::note_idle_parts() {
  const HexMesh& hex = state.body.hex;
  // A cell is of one material: that of its middle.
  const std::vector<SceneMaterialRegion>& regions = scene.material.regions;
  std::vector<std::uint8_t> covers(regions.size(), 0), counts(regions.size(), 0);
  for (const HexId h : ids<HexId>(regions.empty() ? 0 : hex.hex_count())) {
    if (!hex.alive(h)) continue;
    const LatticeIndex c = hex.cell[h];
    const Vec3 middle = hex.frame.to_world({c[0] + 0.5, c[1] + 0.5, c[2] + 0.5});
    bool first = true;
    for (std::size_t i = regions.size(); i-- > 0;) {
      if (!regions[i].region.contains(middle)) continue;
      covers[i] = 1;
      if (first) counts[i] = 1;
      first = false;
    }
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (counts[i]) continue;
    const Vec3 cell = hex.frame.cell;
    const std::string name = fmt::format("{}[[material.region]] number {}", scene_place(scene, regions[i].region.line), i + 1);
    add_note(covers[i] ? fmt::format("{} changes nothing: later regions have all of its cells, and later ones win", name)
                       : fmt::format("{} marks nothing: the middle of no cell of the body lies in it (rest coordinates, metres); move it onto the body, or make it "
                                     "larger or the cells smaller (they are {:.3g} x {:.3g} x {:.3g} m)",
                                     name, cell.x, cell.y, cell.z));
  }

  const std::vector<Vec3>& rest = state.body.complex.collision.rest.raw();
  for (std::size_t i = 0; i < scene.loads.size(); ++i) {
    const SceneLoad& load = scene.loads[i];
    note_far_point(fmt::format("{}[[load]] number {} acts", scene_place(scene, load.line), i + 1), rest,
                   vertices_near(rest, load.point, load.radius), load.point, load.radius, SceneFrame::kRest);
  }

  if (!wants_contact(scene) && (!scene.tools.empty() || !scene.obstacles.empty()))
    add_note(fmt::format("contact is off (enabled = false in [contact]), so obstacles and tools press on nothing: the scene has {} and {}; "
                         "edges still cut and shut jaws still hold",
                         scene.obstacles.size() == 1 ? "1 obstacle" : fmt::format("{} obstacles", scene.obstacles.size()),
                         scene.tools.size() == 1 ? "1 tool" : fmt::format("{} tools", scene.tools.size())));

  const std::vector<SceneCommand>& commands = scene.commands;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const auto now = leading(commands[i]);
    if (!now) continue;
    for (std::size_t k = i; k-- > 0;) {
      const auto before = leading(commands[k]);
      if (!before || before->what != now->what || *before->id != *now->id) continue;
      if (before->end > commands[i].at * (1 + kTimeTolerance))
        add_note(fmt::format("{}this command {} {} '{}' from {} s on, and breaks off the one {}that would have led it until {:.6g} s",
                             scene_place(scene, commands[i].line), now->verb, now->what, *now->id, commands[i].at,
                             commands[k].line > 0 ? fmt::format("of line {} ", commands[k].line) : "", before->end));
      break;
    }
  }
}

void Session::Impl::note_far_point(const std::string& what, const std::vector<Vec3>& positions, std::span<const CollisionVertex> points, Vec3 point,
                                   double radius, SceneFrame frame) {
  if (points.size() != 1) return;  // those lie within the radius
  const CollisionVertex v = points[0];
  const Vec3 at = positions[v.index()];
  const double far = norm(at - point);
  if (far <= radius || far <= kNearVertex * state.body.complex.mean_root_edge + norm(state.body.complex.collision.offset[v])) return;
  add_note(fmt::format("{} {:.3g} m away from its point: nothing of the body is there, and the nearest vertex is at ({:.4g}, {:.4g}, {:.4g}) ({} coordinates, "
                       "metres); move the point onto the body",
                       what, far, at.x, at.y, at.z, frame == SceneFrame::kRest ? "rest" : "world"));
}

}  // namespace kerf
