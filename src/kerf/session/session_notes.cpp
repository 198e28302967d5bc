// Notes for whoever wrote the scene: what marks, holds or cuts nothing, and what a blade went through without cutting it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/shown_text.h"
#include "kerf/scene/scene_place.h"
#include "kerf/session/scene_bodies.h"
#include "kerf/session/session_impl.h"
#include "kerf/session/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

/// Mean collision edges that a point on the surface may lie away from the nearest collision vertex, beside the half thickness there.
constexpr double kNearVertex = 2;
/// Mean collision edges, beside the half thickness: what a blade goes through nearer to a front of its cut is the layer that it cuts.
constexpr double kSameLayer = 1;
/// Strokes whose uncut parts are noted one by one.
constexpr int kMostUncutNotes = 20;
/// As many whose blades lean.
constexpr int kMostLeaningNotes = 20;
/// On the way of a stroke that has cut nothing, where it is asked whether the edge ends in material.
constexpr int kPlacesLookedAt = 32;

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
  if (const auto* move = std::get_if<SceneMove>(&c.what))
    return Leading{&move->id, "grasp", "moves", c.at + move->over};
  return {};
}

}  // namespace

void Session::Impl::add_note(std::string note) {
  std::vector<std::string>& texts = said.texts;
  if (std::find(texts.begin(), texts.end(), note) == texts.end()) texts.push_back(std::move(note));
}

std::string Session::Impl::name_of_body(std::int32_t body) const {
  return body_name(scene, static_cast<std::size_t>(body));
}

void Session::Impl::note_idle_parts() {
  const HexMesh& hex = state.body.hex;
  const std::vector<SceneRegion>& regions = state.materials.regions;
  std::vector<std::uint8_t> counts(regions.size(), 0);
  for (const HexId h : ids<HexId>(regions.empty() ? 0 : hex.hex_count())) {
    if (!state.model.has_element(h)) continue;
    const auto material = static_cast<std::size_t>(state.model.element(h).material),
               plain = state.materials.of(hex.material[h].body);
    if (material > plain) counts[material - plain - 1] = 1;
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (counts[i]) continue;
    bool covers = false;
    for (const HexId h : ids<HexId>(hex.hex_count())) {
      const LatticeIndex c = hex.cell[h];
      covers = covers ||
               (hex.alive(h) && regions[i].contains(hex.frame_at(c).to_world({c[0] + 0.5, c[1] + 0.5, c[2] + 0.5})));
    }
    const Vec3 cell = largest_cell(hex);
    const std::string name = fmt::format("{}[[material.region]] number {}", scene_place(scene, regions[i].line), i + 1);
    add_note(
        covers
            ? fmt::format("{} changes nothing: later regions have all of its cells, and later ones win", name)
            : fmt::format(
                  "{} marks nothing: the middle of no cell of the body lies in it (rest coordinates, metres); move it onto the body, or make it "
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
    add_note(fmt::format(
        "contact is off (enabled = false in [contact]), so obstacles and tools press on nothing: the scene has {} and {}; "
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
      if (before->end > commands[i].at * (1 + kSameTime))
        add_note(fmt::format(
            "{}this command {} {} '{}' from {} s on, and breaks off the one {}that would have led it until {:.6g} s",
            scene_place(scene, commands[i].line), now->verb, now->what, *now->id, commands[i].at,
            commands[k].line > 0 ? fmt::format("of line {} ", commands[k].line) : "", before->end));
      break;
    }
  }
}

void Session::Impl::note_far_point(const std::string& what, const std::vector<Vec3>& positions,
                                   std::span<const CollisionVertex> points, Vec3 point, double radius,
                                   SceneFrame frame) {
  if (points.size() != 1) return;  // those lie within the radius
  const CollisionVertex v = points[0];
  const Vec3 at = positions[v.index()];
  const double far = norm(at - point);
  if (far <= radius ||
      far <= kNearVertex * state.body.complex.mean_root_edge + norm(state.body.complex.collision.offset[v]))
    return;
  add_note(fmt::format(
      "{} {:.3g} m away from its point: nothing of the body is there, and the nearest vertex is at ({:.4g}, {:.4g}, {:.4g}) ({} coordinates, "
      "metres); move the point onto the body",
      what, far, at.x, at.y, at.z, frame == SceneFrame::kRest ? "rest" : "world"));
}

void Session::Impl::note_uncut(const UncutPath& path) {
  if (path.reason == UncutReason::kNone || !state.stroke || state.stroke->uncut_noted) return;
  state.stroke->uncut_noted = true;
  if (++said.uncut > kMostUncutNotes)
    return add_note(fmt::format(
        "parts of cuts were left uncut in more than {} strokes: see their counts of refused steps", kMostUncutNotes));
  add_note(fmt::format(
      "{}a part of a cut near ({:.4g}, {:.4g}, {:.4g}) (rest coordinates, metres) was left uncut: {}; lead the blade there again, a little beside, "
      "or make minimum_feature in [cut] smaller",
      state.stroke->place, path.at.x, path.at.y, path.at.z, text_of(path.reason)));
}

void Session::Impl::note_leaning() {
  const LeaningCut& leaning = state.stroke->leaning;
  if (leaning.distance <= kBesideBlade * leaning.thickness) return;
  if (++said.leaning > kMostLeaningNotes)
    return add_note(
        fmt::format("blades leaned in more than {} strokes: walls stand square on the mid-surface", kMostLeaningNotes));
  add_note(fmt::format(
      "{}the blade leaned: near ({:.4g}, {:.4g}, {:.4g}) (rest coordinates, metres) the cut opens the skin up to {:.2g} m, {:.2g} of the "
      "thickness, beside where the blade passed it, as walls stand square on the mid-surface; hold the edge square on the surface",
      state.stroke->place, leaning.at.x, leaning.at.y, leaning.at.z, leaning.distance,
      leaning.distance / leaning.thickness));
}

void Session::Impl::note_idle_stroke() {
  const ActiveStroke& stroke = *state.stroke;
  // Who leads a blade by hand sees what it meets; what was refused has a note of its own.
  if (!stroke.from_command || state.strokes.back().refused > 0) return;
  std::string_view what = "the blade cut nothing: its edge passes through no uncut material on its way",
                   way_out = "move its poses onto the body";
  if (stroke.shaving) {
    what = "the shaver took nothing off: it meets no cut surface on its way";
    way_out = "move its poses onto the wall of a cut";
  } else if (ends_in_thickness(stroke)) {
    what = "the blade cut nothing: its edge ends in the thickness, and passes through no uncut middle of it on its way";
    way_out = "lead it deeper, or beside what is cut";
  }
  add_note(fmt::format("{}{} ({} coordinates, metres); {}", stroke.place, what,
                       stroke.frame == SceneFrame::kRest ? "rest" : "world", way_out));
}

bool Session::Impl::ends_in_thickness(const ActiveStroke& stroke) {
  const CollisionMesh& mesh = state.body.complex.collision;
  const std::vector<Vec3>& positions = stroke.frame == SceneFrame::kRest ? mesh.rest.raw() : deformed_collision();
  const auto near = [&](Vec3 p) {
    for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
      std::array<Vec3, 3> x;
      double half = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const CollisionVertex v = mesh.origin[CollisionMesh::corner(f, static_cast<int>(k))];
        x[k] = positions[v.index()];
        half = std::max(half, norm(mesh.offset[v]));
      }
      ClosestPoint found;
      closest_point(p, x, found);
      if (found.distance < half) return true;
    }
    return false;
  };
  const auto& poses = stroke.command.poses;
  if (stroke.command.tool == SceneTool::kLine) return false;  // it has no end
  const double last = static_cast<double>(poses.size() - 1);
  for (int k = 0; k <= kPlacesLookedAt; ++k) {
    const double at = last * k / kPlacesLookedAt;
    const std::size_t i = std::min(static_cast<std::size_t>(at), poses.size() - 1),
                      next = std::min(i + 1, poses.size() - 1);
    const double t = at - static_cast<double>(i);
    if (near(lerp(poses[i].base, poses[next].base, t)) || near(lerp(poses[i].tip, poses[next].tip, t))) return true;
  }
  return false;
}

void Session::Impl::note_slowing(const StepReport& report) {
  if (report.slowed_nodes == 0 || said.slowing) return;
  said.slowing = true;
  add_note(fmt::format(
      "at {:.6g} s nodes moved at {:.3g} m/s, faster than a time step of {:.4g} s can follow, and were slowed down "
      "(slowed_nodes in report.json counts them); take a shorter time_step, or look for a load, a gravity, a move or a stiffness (young) that is out of scale",
      state.time, report.fastest_slowed, step_options.dt));
}

void Session::Impl::note_passed(const BladeEdge& edge) {
  const ActiveStroke& stroke = *state.stroke;
  // A line of sight goes on behind what it should cut, and who leads a blade by hand sees what it does.
  const bool command = stroke.from_command && stroke.command.tool != SceneTool::kLine;
  if (stroke.blade.through || stroke.blade.fronts.empty() || (!command && stroke.tool < 0)) return;
  const CollisionMesh& mesh = state.body.complex.collision;
  const auto body_at = [&](CollisionTriangle f) { return state.body.hex.body_of(mesh.root[f]); };
  const auto body_of = [&](CollisionVertex v) { return body_at(CollisionMesh::face(mesh.outgoing[v])); };
  const auto place = [&](CollisionVertex v) { return sweep_positions[v.index()]; };
  const std::int32_t own = body_of(stroke.blade.fronts[0]);

  Box3 near;
  near.add(edge.base);
  near.add(edge.tip);
  const RayFrame ray({edge.base, edge.tip - edge.base});
  std::vector<std::uint8_t> passed(state.body.hex.bodies.size(), 0);
  sweep_boxes.refresh(mesh, sweep_positions);
  sweep_boxes.for_each(
      [&](const Box3& box) { return boxes_meet(box, near); },
      [&](CollisionTriangle f) {
        std::array<CollisionVertex, 3> v;
        std::array<Vec3, 3> x;
        double radius = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          v[k] = mesh.origin[CollisionMesh::corner(f, static_cast<int>(k))];
          x[k] = place(v[k]);
          radius = std::max(radius, norm(mesh.offset[v[k]]));
        }
        RayHit hit;
        hit.t = 1;
        if (!intersect(ray, x, hit) || hit.t < 0 || hit.t > 1) return;
        const Vec3 p = lerp(edge.base, edge.tip, hit.t);
        const double layer = kSameLayer * state.body.complex.mean_root_edge + 2 * radius;
        const bool cut =
            std::any_of(stroke.blade.fronts.begin(), stroke.blade.fronts.end(), [&](CollisionVertex front) {
              return body_of(front) == body_at(f) && (body_at(f) != own || norm(place(front) - p) < layer);
            });
        if (!cut) passed[static_cast<std::size_t>(body_at(f))] = 1;
      });

  const std::string who = command ? "the blade"
                                  : fmt::format("the edge of tool '{}'",
                                                kerf::shown(scene.tools[static_cast<std::size_t>(stroke.tool)].id));
  for (std::size_t b = 0; b < passed.size(); ++b) {
    if (!passed[b]) continue;
    const std::string what =
        static_cast<std::int32_t>(b) == own ? "another layer of it" : name_of_body(static_cast<std::int32_t>(b));
    add_note(fmt::format(
        "{}while it cut {}, {} went through {} without cutting that: a blade cuts the first layer that it meets; {}",
        stroke.place, name_of_body(own), who, what,
        command ? "through = true cuts all that its edge meets"
                : "cut one after the other, or with an edge that does not reach so far"));
  }
}

}  // namespace kerf
