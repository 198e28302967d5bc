// Tools at work: edges that cut where the tool has got to, jaws that hold what they close on.
//
// A sharp edge goes through stages. Outside it is a blunt part of its tool: it presses. Where material resists
// (SceneCut::resistance), it presses on until its force per length is exceeded; where none does, it enters at once. Inside it
// cuts: a stroke begins, the blade touches the lips that it leaves (contact/flanks.h) and what lies far from them, and the
// resistance holds both. It is the edge's motion in the material that cuts, whichever of the two moves. When the whole blade is out of the
// thickness the stroke ends. Blades cut forward only, and one at a time.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "kerf/session/session_impl.h"
#include "kerf/session/tolerances.h"
#include "kerf/spatial/segment_queries.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

constexpr int kEdgeSamples = 9;    // along an edge at least; a blade is looked at in a few such lines
constexpr int kMostSamples = 128;  // along an edge; no nearer to each other than half the half thickness
constexpr int kScalpelLines = 3, kScissorsLines = 5;
constexpr double kEdgeFirst = 0.5;  // cosine between forward and the push of what an edge meets
constexpr double kForward = 0.2;    // share of an edge's motion that must go forward for it to cut
constexpr double kPress = 0.02;  // mean collision edges that an edge goes into material before that gives way, at least
constexpr double kLeastWay =
    1e-3;                        // mean collision edges: an edge that is no farther into what is uncut does not cut on
constexpr double kAcross = 0.5;  // cosine between an edge and the way from a lip to a place beside it, at most
constexpr double kFrontNear =
    0.3;  // mean collision edges: a front that lies farther beside an edge is not where it cuts
constexpr double kOut =
    0.05;  // half thicknesses: what overlaps by no more has come out of a blade or jaw that let it pass
constexpr double kUnseenDepth =
    0.2;  // and what is as deep when it is first met, by a tool that lets something pass, has come along with it
constexpr double kBladeZone = 0.15;  // of a blade's width, behind its edge: what touches there touches the edge

bool is_blade(const SceneRigidTool& tool) { return has_edge(tool); }

/// The material near a box: does a point lie in it?
class Thickness {
 public:
  Thickness(const CollisionMesh& mesh, const std::vector<Vec3>& positions, const Box3& near)
      : mesh_(mesh), positions_(positions) {
    for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
      Box3 box;
      double radius = 0;
      for (int k = 0; k < 3; ++k) {
        const CollisionVertex v = mesh.origin[CollisionMesh::corner(t, k)];
        box.add(positions[v.index()]);
        radius = std::max(radius, norm(mesh.offset[v]));
      }
      bool apart = false;
      for (int i = 0; i < 3; ++i)
        apart = apart || box.min[i] > near.max[i] + radius || box.max[i] < near.min[i] - radius;
      if (apart) continue;
      triangles_.push_back(t);
      thinnest_ = std::min(thinnest_, radius);
    }
  }
  [[nodiscard]] bool empty() const { return triangles_.empty(); }
  [[nodiscard]] const std::vector<CollisionTriangle>& triangles() const { return triangles_; }
  /// A place of the middle surface.
  struct Place {
    std::array<CollisionVertex, 3> vertex;
    std::array<double, 3> weight;
    [[nodiscard]] CollisionVertex closest() const {
      return vertex[static_cast<std::size_t>(std::max_element(weight.begin(), weight.end()) - weight.begin())];
    }
  };
  /// m to the thickness; 0 in it. `closest` gets a place of the material that it lies in, or that is nearest to it.
  [[nodiscard]] double clearance(Vec3 p, Place* closest = nullptr) const {
    double least = HUGE_VAL;
    for (const CollisionTriangle t : triangles_) {
      std::array<CollisionVertex, 3> v;
      std::array<Vec3, 3> x;
      for (std::size_t k = 0; k < 3; ++k) {
        v[k] = mesh_.origin[CollisionMesh::corner(t, static_cast<int>(k))];
        x[k] = positions_[v[k].index()];
      }
      ClosestPoint found;
      closest_point(p, x, found);
      double radius = 0;
      for (std::size_t k = 0; k < 3; ++k) radius += found.barycentric[k] * norm(mesh_.offset[v[k]]);
      if (found.distance - radius >= least) continue;
      least = found.distance - radius;
      if (closest) *closest = {v, {found.barycentric[0], found.barycentric[1], found.barycentric[2]}};
      if (least <= 0) return 0;
    }
    return least;
  }
  [[nodiscard]] bool holds(Vec3 p, double extra) const { return clearance(p) <= extra; }
  /// Is any of it in a blade, from its edge to its back?
  [[nodiscard]] bool lies_within(const BladeEdge& edge, Vec3 back, double extra) const {
    if (empty()) return false;
    const double lines =
        std::clamp(std::ceil(norm(back) / std::max(thinnest_ + extra, 1e-300)), 1.0, static_cast<double>(kMostSamples));
    bool any = false;
    for (int line = 0; !any && line <= static_cast<int>(lines); ++line) {
      const Vec3 aside = (line / lines) * back;
      walk(edge.base + aside, edge.tip + aside, extra, [&](const Place&) { any = true; });
    }
    return any;
  }
  /// Calls look(place) for places along a line that lie in the material, or no farther from it than `extra`, as near to each other as the
  /// material is thick; returns the length of the line in there. What is far from the material is passed over.
  template <class Look>
  double walk(Vec3 from, Vec3 to, double extra, Look&& look) const {
    const double length = norm(to - from);
    if (empty() || !(length > 0)) return 0;
    const double step = std::clamp(0.5 * thinnest_, length / kMostSamples, length / kEdgeSamples);
    // From outside no step leads over the material, however long the edge is.
    const double step_outside = std::clamp(0.5 * thinnest_, length / kStepsOutside, step);
    const auto place = [&](double at) { return lerp(from, to, at / length); };
    const auto border = [&](double outside, double in) {
      for (int i = 0; i < kBorderHalvings; ++i) {
        const double middle = 0.5 * (outside + in);
        (holds(place(middle), extra) ? in : outside) = middle;
      }
      return 0.5 * (outside + in);
    };
    bool in = false;
    double inside = 0, entered = 0, last = 0;  // m; `last` is where the line was looked at last
    for (double at = 0; at < length + step;) {
      const double here = std::min(at, length);
      Place closest;
      const double far = clearance(place(here), &closest) - extra;
      const bool was_in = std::exchange(in, far <= 0);
      if (in) look(closest);
      if (in && !was_in) entered = here > 0 ? border(last, here) : 0;
      if (was_in && !in) inside += border(here, last) - entered;
      last = here;
      at += std::max(in ? step : step_outside, far);
    }
    return in ? inside + length - entered : inside;
  }

 private:
  const CollisionMesh& mesh_;
  const std::vector<Vec3>& positions_;
  std::vector<CollisionTriangle> triangles_;
  double thinnest_ = HUGE_VAL;  ///< m: the least of their greatest half thicknesses
};

/// Does a blade that moves so cut, forward or with its tip?
bool leads(Vec3 way, const Mat3& axes, Vec3 forward) {
  return std::max(dot(way, axes * forward), -dot(way, axes.c[2])) > kForward * norm(way);
}

/// What an edge that cuts presses against: m of the edge, and the vertices that carry its force, each as often as it has shares.
struct EdgeHold {
  double length = 0;
  std::vector<CollisionVertex> carriers;
};
/// At the ends of its cut that are no farther than `near` from the edge, and ahead of them. Lips that stand beside the edge neither count nor carry: they would be dragged along.
/// The ends alone do not carry it: they hang on the copies of one cell, and give way by twice as much where the cut comes to the next one. Nothing where there is no cut
/// yet, or where the edge lies along the material. `into`: unit, where the material is uncut.
EdgeHold hold_at_fronts(const CollisionMesh& mesh, const std::vector<Vec3>& positions,
                        const std::vector<CollisionVertex>& fronts, const BladeEdge& edge, Vec3 into, double near) {
  EdgeHold hold;
  const double length = norm(edge.tip - edge.base);
  const Vec3 along = (1 / length) * (edge.tip - edge.base);
  for (const CollisionVertex v : fronts) {
    const Vec3 front = positions[v.index()];
    if (distance_to_segment(front, edge.base, edge.tip) > near) continue;
    Vec3 normal;
    mesh.for_each_outgoing(v, [&](CollisionHalfEdge h) {
      normal += cross(positions[mesh.to(h).index()] - front, positions[mesh.apex(h).index()] - front);
      return true;
    });
    const double upright = std::fabs(dot(normal, along));
    if (!(upright > kUpright * norm(normal))) return {};
    const double middle = dot(front - edge.base, along), reach = norm(mesh.offset[v]) * norm(normal) / upright;
    const double inside = std::min(middle + reach, length) - std::max(middle - reach, 0.0);
    if (!(inside > 0)) continue;
    hold.length += inside;
    hold.carriers.push_back(v);
    const auto is_ahead = [&](CollisionVertex other) {
      const Vec3 way = positions[other.index()] - front;
      return (!mesh.on_border(other) || mesh.on_rim(other)) && dot(way, into) > kAhead * norm(way);
    };
    mesh.for_each_outgoing(v, [&](CollisionHalfEdge h) {
      for (const CollisionVertex other : {mesh.to(h), mesh.apex(h)})
        if (is_ahead(other)) hold.carriers.push_back(other);
      return true;
    });
  }
  return hold;
}
/// The vertices nearest to where an edge meets the middle of the material.
std::vector<CollisionVertex> nearest_along(const CollisionMesh& mesh, const std::vector<Vec3>& positions,
                                           const BladeEdge& edge) {
  std::vector<CollisionVertex> nearest;
  Box3 near;
  near.add(edge.base);
  near.add(edge.tip);
  const Thickness material(mesh, positions, near);
  material.walk(edge.base, edge.tip, 0, [&](const Thickness::Place& p) { nearest.push_back(p.closest()); });
  return nearest;
}

/// Places beside lips, across an edge: cuts run a little beside the blade, and what stands between them and the edge is cut.
class BesideLips {
 public:
  /// Of all lips that come nearer than `near` to a box.
  BesideLips(const CollisionMesh& mesh, const std::vector<Vec3>& positions, Box3 box, double near) : near_(near) {
    box.min -= Vec3{near, near, near};
    box.max += Vec3{near, near, near};
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count())) {
      if (!mesh.is_lip(h)) continue;
      const Vec3 a = positions[mesh.from(h).index()], b = positions[mesh.to(h).index()];
      Box3 of_lip;
      of_lip.add(a);
      of_lip.add(b);
      if (boxes_meet(of_lip, box)) lips_.push_back({a, b});
    }
  }
  /// `along`: unit, the edge.
  [[nodiscard]] bool holds(Vec3 p, Vec3 along) const {
    return std::any_of(lips_.begin(), lips_.end(), [&](const std::array<Vec3, 2>& lip) {
      const Vec3 off = p - lerp(lip[0], lip[1], closest_on_segment(p, lip[0], lip[1]));
      return norm(off) < near_ && std::fabs(dot(off, along)) <= kAcross * norm(off);
    });
  }

 private:
  double near_;
  std::vector<std::array<Vec3, 2>> lips_;
};

/// m that uncut material lies behind an edge, in the plane of its blade, where the edge lies along it: `reach` at most, and 0 where none does. Nothing where the edge lies along no
/// material. `material`: near the blade. `mean_edge`: of the collision mesh, m.
std::optional<double> passed_along(const Thickness& material, const CollisionMesh& mesh,
                                   const std::vector<Vec3>& positions, const BladeEdge& edge, Vec3 into, double reach,
                                   double mean_edge) {
  const double length = norm(edge.tip - edge.base), step = kLook * mean_edge;
  const Vec3 along = (1 / length) * (edge.tip - edge.base);
  const Vec3 beside = normalized(cross(along, into));
  using Line = std::array<Vec2, 2>;  // where a face crosses the plane of the blade: m along the edge, and behind it
  std::vector<Line> across;          // of faces that the edge lies along, and would come down on
  for (const CollisionTriangle t : material.triangles()) {
    std::array<Vec3, 3> off;
    for (std::size_t k = 0; k < 3; ++k)
      off[k] = positions[mesh.origin[CollisionMesh::corner(t, static_cast<int>(k))].index()] - edge.base;
    const Vec3 normal = cross(off[1] - off[0], off[2] - off[0]);
    const double size = norm(normal);
    if (!(size > 0) || std::fabs(dot(normal, along)) > kLies * size || std::fabs(dot(normal, into)) < kLandsOn * size)
      continue;
    Line line;
    std::size_t ends = 0;
    for (std::size_t k = 0; k < 3 && ends < 2; ++k) {
      const Vec3 a = off[k], b = off[(k + 1) % 3];
      const double from = dot(a, beside), to = dot(b, beside);
      if ((from < 0) == (to < 0)) continue;
      const Vec3 x = lerp(a, b, from / (from - to));
      line[ends++] = {dot(x, along), -dot(x, into)};
    }
    if (ends == 2) across.push_back(line);
  }
  if (across.empty()) return std::nullopt;
  Box3 swept;
  for (const Vec3 p : {edge.base, edge.tip, edge.base - reach * into, edge.tip - reach * into}) swept.add(p);
  const BesideLips cut(mesh, positions, swept, kBesideCut * mean_edge);
  std::optional<double> most;
  for (const Line& line : across) {
    const int parts =
        static_cast<int>(std::clamp(std::ceil(norm(line[1] - line[0]) / step), 1.0, double{kMostSamples}));
    for (int i = 0; i <= parts; ++i) {
      const Vec2 p = lerp(line[0], line[1], static_cast<double>(i) / parts);
      if (p.x < 0 || p.x > length || !(std::fabs(p.y) <= reach) || (most && p.y <= *most)) continue;
      if (!most) most = 0;
      if (p.y > *most && !cut.holds(edge.base + p.x * along - p.y * into, along)) most = p.y;
    }
  }
  return most;
}

}  // namespace

Status Session::Impl::use_tools(double until) {
  edge_presses.clear();
  cut_through.clear();
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    ToolMotion& motion = state.tools[i];
    motion.force = motion.torque = motion.resistance = motion.resistance_torque = {};
    if (is_blade(scene.tools[i])) KERF_TRY(cut_with(i, until));
    if (scene.tools[i].kind == SceneToolKind::kGrasper) KERF_TRY(close_on(i));
  }
  if (std::any_of(scene.tools.begin(), scene.tools.end(), is_blade)) state.seen = deformed_collision();
  return {};
}

Status Session::Impl::cut_with(std::size_t i, double until) {
  const SceneRigidTool& tool = scene.tools[i];
  ToolMotion& motion = state.tools[i];
  const RigidState& at = state.mechanics.tools[i];
  const RigidPlace place{at.position, at.axes};
  const ToolEdge edge = tool_edge(tool, motion.jaws(until));
  const BladeEdge now{place.to_world(edge.base), place.to_world(edge.tip)};
  const BladeEdge last = motion.placed ? BladeEdge{motion.base, motion.tip} : now;
  motion.base = now.base;
  motion.tip = now.tip;
  motion.placed = true;
  const bool own = state.stroke && state.stroke->tool == static_cast<std::int32_t>(i);
  const bool another = state.stroke && !own;
  if (another && !motion.in_slit) return {};  // another blade is at work

  const bool closing = motion.jaws_to <= 0 && motion.jaws(until) > 0;

  // How much of the blade is in the thickness: its edge, its back, and lines between them.
  // Scissors that have cut stay in their slit while they open, as far as their tips reach.
  const bool scissors = tool.kind == SceneToolKind::kScissors, resisted = scene.cut.resistance > 0 && !scissors;
  const double reach = motion.in_slit ? 0 : motion.jaws(until);
  const ToolBlade blade = tool_blade(tool, reach);
  const ToolEdge front = tool_edge(tool, reach);
  const BladeEdge first{place.to_world(front.base), place.to_world(front.tip)};
  const Vec3 back = -blade.width * (place.axes * edge.forward);
  Box3 near;
  for (const Vec3 p : {first.base, first.tip, first.base + back, first.tip + back}) near.add(p);
  // Lips that swing off shut scissors come back to their sides, unless they are far.
  const double extra = motion.in_slit ? tool_sizes(tool).width : blade.thickness;
  if (motion.in_slit) near.min -= Vec3{extra, extra, extra}, near.max += Vec3{extra, extra, extra};
  const Thickness material(state.body.complex.collision, deformed_collision(), near);
  bool blade_in = false;
  double edge_in = 0;  // m
  const CollisionMesh& mesh = state.body.complex.collision;
  const int lines = scissors ? kScissorsLines : kScalpelLines;
  for (int line = 0; line < lines; ++line) {
    const Vec3 aside = (static_cast<double>(line) / (lines - 1)) * back;
    const double in = material.walk(first.base + aside, first.tip + aside, line == 0 ? 0 : extra,
                                    [&](const Thickness::Place& place_in) {
                                      blade_in = true;
                                      cut_through.push_back(mesh.rest[place_in.closest()]);
                                    });
    if (line == 0) edge_in = in;
  }
  if (motion.in_slit) edge_in = material.walk(now.base, now.tip, 0, [](const Thickness::Place&) {});
  // Material that went a long way in one step may lie between those lines.
  if (motion.inside && !blade_in && material.lies_within(now, back, extra)) blade_in = true;
  motion.in_slit = motion.in_slit && blade_in;
  if (another) return {};

  if (motion.inside && (!blade_in || (scissors && !closing))) {
    motion.inside = false;
    motion.in_slit = scissors && blade_in;
    const bool went_by =
        own && !scissors &&
        leads(way_through(state.stroke->blade.posed.edge(), state.stroke->places, now), place.axes, edge.forward);
    if (own && (blade_in || went_by)) KERF_TRY(move_blade(now));
    if (own) return end_stroke();
    return {};
  }
  if (!motion.inside) {
    // What went by in one step may be in its thickness neither before nor after.
    const bool enters =
        resisted ? motion.edge_force > scene.cut.resistance * motion.edge_length  // it has given way
                 : (!scissors || closing) &&
                       (edge_in > 0 || (leads(way_through(last, state.seen, now), place.axes, edge.forward) &&
                                        passes_material(last, now)));
    if (!enters) return {};
    motion.inside = true;
  }
  if (!own) {
    KERF_TRY(begin_stroke(SceneFrame::kWorld, false));
    state.stroke->tool = static_cast<std::int32_t>(i);
    KERF_TRY(move_blade(last));
    state.stroke->places = state.seen;
    // What it pressed with until the material gave way it goes on to press with: else it would fall into the cut.
    motion.press = resisted ? kPress * state.body.complex.mean_root_edge * (place.axes * edge.forward) : Vec3{};
    motion.pressed = false;
  }
  if (motion.pressed) {  // but for the jaws
    const ToolEdge was = tool_edge(tool, motion.jaws(state.time));
    motion.press += 0.5 * (place.axes * (edge.base + edge.tip - was.base - was.tip));
  } else {
    motion.press += way_through(last, state.seen, now);
  }
  // Pressed into what has not given way, an edge cuts nothing; where it gives way the cut comes up to the edge. Behind the end of its cut nothing
  // holds it but the lips, to the side.
  const Vec3 way = way_through(state.stroke->blade.posed.edge(), state.stroke->places, now);
  const Vec3 forward = place.axes * edge.forward, down = -1.0 * place.axes.c[2], aside = place.axes.c[1];
  const double ahead = std::max(dot(way, forward), dot(way, down)), most = kPress * state.body.complex.mean_root_edge;
  const bool tip_in = !scissors && material.holds(now.tip, 0);
  const auto along = [&](Vec3 direction) {
    return std::max(dot(motion.press, direction), std::min(0.0, dot(way, direction)));
  };
  const double pressed = along(forward), pressed_down = tip_in ? along(down) : 0;
  const Vec3 into = std::max(0.0, pressed) * forward + std::max(0.0, pressed_down) * down,
             beside = dot(motion.press, aside) * aside;
  const double press = norm(into + beside), kept = press > most ? most / press : 1;
  const bool resists = scene.cut.resistance * edge_in > 0, gives_way = press > most || !resists;
  motion.press = {};
  if (resists)
    motion.press = kept * (into + beside) + std::min(0.0, pressed) * forward + std::min(0.0, pressed_down) * down;
  // Along a sheet no front says where the edge was, and the mean press says nothing of a place: what lies uncut behind the edge, in the plane of its blade, has been passed.
  std::optional<double> passed;
  if (resisted && pressed >= pressed_down) {  // tip first no face lies across its way along the edge
    passed = passed_along(material, mesh, deformed_collision(), now, forward, blade.width,
                          state.body.complex.mean_root_edge);
    const std::vector<BladeFront>& ends = state.stroke->blade.ends;
    if (passed || std::any_of(ends.begin(), ends.end(), [](const BladeFront& f) { return f.along; }))
      passed = std::max(passed.value_or(0), fronts_behind(now, forward, blade.width));
  }
  const bool comes_up =
      passed ? *passed > most
             : gives_way && ahead > std::max(kForward * norm(way), kLeastWay * state.body.complex.mean_root_edge);
  if (comes_up) KERF_TRY(move_blade(now));
  resist(i, now, norm(into) > 0 ? normalized(into) : forward, edge_in);
  return {};
}

double Session::Impl::fronts_behind(const BladeEdge& now, Vec3 into, double reach) {
  const double length = norm(now.tip - now.base);
  const Vec3 along = (1 / length) * (now.tip - now.base), aside = cross(along, into);
  double most = 0;
  for (const CollisionVertex v : state.stroke->blade.fronts) {
    const Vec3 off = now.base - deformed_collision()[v.index()];
    const double behind = dot(off, into);
    if (-dot(off, along) < 0 || -dot(off, along) > length || behind > reach) continue;
    if (std::fabs(dot(off, aside)) <= kFrontNear * state.body.complex.mean_root_edge) most = std::max(most, behind);
  }
  return most;
}

MaterialMotion Session::Impl::motion_at(const BladeEdge& was, const std::vector<Vec3>& places) {
  const std::span<const Vec3> before = places, now = deformed_collision();
  const std::size_t known = std::min(before.size(), now.size());
  return motion_of({before.first(known), now.first(known)}, was, kAtEdge * state.body.complex.mean_root_edge);
}

Vec3 Session::Impl::way_through(const BladeEdge& was, const std::vector<Vec3>& places, const BladeEdge& now) {
  const MaterialMotion motion = motion_at(was, places);
  const double s = closest_on_segment(motion.was, was.base, was.tip);
  return lerp(now.base, now.tip, s) - motion.moved(lerp(was.base, was.tip, s));
}

bool Session::Impl::passes_material(const BladeEdge& last, const BladeEdge& now) {
  place_for_sweep(SceneFrame::kWorld);
  std::vector<Vec3> before = state.seen;
  before.resize(std::min(before.size(), sweep_positions.size()));
  SweepTarget target{state.body.complex, sweep_positions, sweep_boxes, cut_scratch, cut_options, &before};
  return meets_material(target, last, now);
}

void Session::Impl::feel_tools() {
  const std::vector<ContactResult>& results = workspace.contact.results;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const SceneRigidTool& tool = scene.tools[i];
    ToolMotion& motion = state.tools[i];
    motion.edge_force = motion.edge_length = 0;
    motion.jaw_pushes[0] = motion.jaw_pushes[1] = false;
    if (!contact.on || (!is_blade(tool) && tool.kind != SceneToolKind::kGrasper)) continue;
    const RigidState& at = state.mechanics.tools[i];
    const ToolSizes sizes = tool_sizes(tool);
    double low = HUGE_VAL, high = -HUGE_VAL;
    // m along the edge: how far apart contacts are sampled, along the surface and not across its thickness, and how high the
    // wall is that one of them stands for.
    double between = 0, wall = 0;
    for (std::size_t k = 0; k < results.size() && k < contact.contacts.size(); ++k) {
      const Contact& c = contact.contacts[k];
      if (c.tool != static_cast<std::int32_t>(i) || results[k].normal_force <= 0) continue;
      const Vec3 local = transposed_times(at.axes, c.point - at.position), push = transposed_times(at.axes, c.normal);
      if (local.z > sizes.tip) continue;
      motion.jaw_pushes[0] = motion.jaw_pushes[0] || push.x > kEdgeFirst;
      motion.jaw_pushes[1] = motion.jaw_pushes[1] || push.x < -kEdgeFirst;
      if (std::max(push.x, -push.z) < kEdgeFirst) continue;
      motion.edge_force += results[k].normal_force;
      low = std::min(low, local.z);
      high = std::max(high, local.z);
      const Vec3 offset = contact.offsets[c.a.vertex[0].index()];
      const double upright = std::fabs(dot(normalized(offset), at.axes.c[2])),
                   flat = std::sqrt(std::max(0.0, 1 - upright * upright));
      between = std::max(between, kSampled * state.body.complex.mean_root_edge * flat);
      wall = std::max(wall, 2 * norm(offset) * upright);
    }
    if (high >= low) motion.edge_length = std::min(sizes.tip, std::max(high - low + between, wall));
  }
}

void Session::Impl::resist(std::size_t i, const BladeEdge& now, Vec3 into, double inside) {
  if (!(scene.cut.resistance * inside > 0)) return;
  ToolMotion& motion = state.tools[i];
  const CollisionMesh& mesh = state.body.complex.collision;
  const RigidState& at = state.mechanics.tools[i];
  const RigidPlace place{at.position, at.axes};
  EdgeHold hold = hold_at_fronts(mesh, deformed_collision(), state.stroke->blade.fronts, now, into,
                                 kFrontNear * state.body.complex.mean_root_edge);
  if (hold.carriers.empty()) hold = {inside, nearest_along(mesh, deformed_collision(), now)};
  std::vector<CollisionVertex>& carriers = hold.carriers;
  const double limit = scene.cut.resistance * std::min(hold.length, inside);
  std::sort(carriers.begin(), carriers.end());
  for (std::size_t k = 0; k < carriers.size();) {
    const CollisionVertex v = carriers[k];
    const std::size_t first = k;
    while (k < carriers.size() && carriers[k] == v) ++k;
    const double share = static_cast<double>(k - first) / static_cast<double>(carriers.size());
    EdgePress press{static_cast<std::int32_t>(i), v, share, {}, transposed_times(at.axes, into), {}, 0, share * limit};
    press.stiffness = press.limit / (kPress * state.body.complex.mean_root_edge);
    const Embedding& e = state.body.embedding;
    const Vec3 x = point_position(state.body.hex, {e.collision[v], e.collision_local[v]}, state.mechanics.positions),
               along = now.tip - now.base;
    const Vec3 on_edge = now.base + std::clamp(dot(x - now.base, along) / dot(along, along), 0.0, 1.0) * along;
    press.local = place.to_local(on_edge);
    press.offset = on_edge - motion.press - x;
    edge_presses.push_back(press);
    const Vec3 aside = at.axes.c[1];
    const auto held = [&](Vec3 direction) {
      return std::clamp(press.stiffness * dot(motion.press, direction), -press.limit, press.limit) * direction;
    };
    const Vec3 back = -1.0 * (std::max(0.0, dot(held(into), into)) * into + held(aside));
    motion.resistance += back;
    motion.resistance_torque += cross(on_edge - at.position, back);
    press.share = 0;  // to the side it is held both ways
    for (const double side : {1.0, -1.0}) {
      press.direction = {0, side, 0};
      edge_presses.push_back(press);
    }
  }
}

void Session::Impl::press_edges() {
  for (ToolMotion& motion : state.tools) motion.pressed = false;
  for (const EdgePress& p : edge_presses) {
    ToolMotion& motion = state.tools[static_cast<std::size_t>(p.tool)];
    if (!motion.pressed) motion.press = {};
    motion.pressed = true;
    motion.press += p.share * pressed(state.body, state.mechanics, p);
  }
}

Status Session::Impl::close_on(std::size_t i) {
  const SceneRigidTool& tool = scene.tools[i];
  ToolMotion& motion = state.tools[i];
  const RigidState& at = state.mechanics.tools[i];
  if (motion.holding) {
    KERF_TRY(fresh_springs());
    for (const Grasp& g : state.grasps) {
      if (g.tool != static_cast<std::int32_t>(i)) continue;
      for (std::size_t k = 0; k < g.springs.size(); ++k) {
        const Vec3 pull = -1.0 * pull_of(g, k);
        if (pull == Vec3{}) continue;
        motion.force += pull;
        motion.torque += cross(g.centre + g.turned * g.offset[k] - at.position, pull);
      }
    }
    return {};
  }
  if (motion.jaws_to > 0) return {};
  // Tissue on both jaws, or jaws that are shut.
  const double jaws = motion.jaws(state.time);
  const bool both = motion.jaw_pushes[0] && motion.jaw_pushes[1];
  const RigidPlace place{at.position, at.axes};
  const ToolSizes sizes = tool_sizes(tool);
  if (!both && jaws > 0) return {};
  const std::vector<Vec3>& positions = deformed_collision();
  const double reach = sizes.tip * std::tan(tool.opening / 2), pad = 0.5 * state.body.complex.mean_root_edge;
  std::vector<CollisionVertex> held;
  CollisionVertex closest;
  double nearest = HUGE_VAL;
  for (const CollisionVertex v : ids<CollisionVertex>(positions.size())) {
    const Vec3 p = place.to_local(positions[v.index()]);
    const double thick = norm(state.body.complex.collision.offset[v]);
    const double distance = norm(p - Vec3{0, 0, 0.5 * sizes.tip});
    if (distance < nearest) nearest = distance, closest = v;
    if (std::fabs(p.x) <= reach + thick && std::fabs(p.y) <= 0.5 * sizes.width + pad && p.z >= -pad &&
        p.z <= sizes.tip + thick)
      held.push_back(v);
  }
  if (held.empty() && nearest <= 0.5 * sizes.tip + 2 * pad) held.push_back(closest);
  if (held.empty()) return {};
  if (!both) {  // shut: only what is really between them
    const Thickness material(state.body.complex.collision, positions, [&] {
      Box3 box;
      box.add(place.position);
      box.add(place.to_world({0, 0, sizes.tip}));
      return box;
    }());
    if (!material.holds(place.to_world({0, 0, 0.5 * sizes.tip}), 0.5 * sizes.radius)) return {};
  }
  KERF_TRY(hold(fmt::format("tool {}", tool.id), held, {}));
  Grasp& g = state.grasps.back();
  g.tool = static_cast<std::int32_t>(i);
  g.local = place.to_local(g.centre);
  g.axes_then = at.axes;
  motion.holding = true;
  motion.jaws_from = motion.jaws_to = jaws;  // tissue stops them
  motion.jaws_over = 0;
  return {};
}

Status Session::Impl::let_go(std::size_t i) {
  state.tools[i].holding = false;
  const auto before = state.grasps.size();
  std::erase_if(state.grasps, [&](const Grasp& g) { return g.tool == static_cast<std::int32_t>(i); });
  return state.grasps.size() == before ? Status{} : renew_springs();
}

bool Session::Impl::is_near_cut(const Contact& c, const ToolSizes& sizes) const {
  const ContactSurface& s = contact.surface;
  Vec3 rest;
  double radius = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!c.a.vertex[k].valid()) continue;
    rest += c.a.weight[k] * s.rest[c.a.vertex[k]];
    radius = std::max(radius, s.radius[c.a.vertex[k]]);
  }
  // The places are half a width apart, and vertices nearest to them.
  const double reach = sizes.width + sizes.thickness + radius + state.body.complex.mean_root_edge;
  return std::any_of(cut_through.begin(), cut_through.end(), [&](Vec3 p) { return norm(p - rest) < reach; });
}

bool Session::Impl::leaves_out(const Contact& c) const {
  if (c.tool < 0) return false;
  const auto i = static_cast<std::size_t>(c.tool);
  const SceneRigidTool& tool = scene.tools[i];
  const ToolMotion& motion = state.tools[i];
  if (!motion.holding && !is_blade(tool)) return false;
  const ToolSizes sizes = tool_sizes(tool);
  const RigidState& at = state.mechanics.tools[i];
  const Vec3 local = transposed_times(at.axes, c.point - at.position);
  if (local.z > sizes.tip * (1 + 1e-9)) return false;  // the shaft
  if (motion.holding) return true;
  if (motion.inside || motion.in_slit) return is_near_cut(c, sizes);
  if (tool.kind == SceneToolKind::kScissors) {  // half open, with material between them
    const double jaws = motion.jaws(state.time);
    return jaws > 0 && jaws < 1;
  }
  if (scene.cut.resistance > 0) return false;
  const Vec3 push = transposed_times(at.axes, c.normal);
  const bool on_edge = local.x > -kBladeZone * sizes.width || local.z < kBladeZone * sizes.tip;
  return on_edge && std::max(push.x, -push.z) >= kEdgeFirst;
}

bool Session::Impl::lets_pass(const Contact& c) {
  if (c.tool < 0) return false;
  const SceneRigidTool& tool = scene.tools[static_cast<std::size_t>(c.tool)];
  if (!is_blade(tool) && tool.kind != SceneToolKind::kGrasper) return false;
  const ContactSurface& s = contact.surface;
  double radius = 0;
  for (std::size_t k = 0; k < 3; ++k)
    if (c.a.vertex[k].valid()) radius = std::max(radius, s.radius[c.a.vertex[k]]);
  const bool left_out = leaves_out(c);
  if (!(radius > 0) || c.gap >= -kOut * radius) return left_out;
  bool pass = left_out || is_passing(touched_part, c.key);
  const auto of_tool = [&](const ToolContact& p) { return p.tool == c.tool; };
  if (!pass && c.gap < -kUnseenDepth * radius &&
      std::any_of(touched_part.passing.begin(), touched_part.passing.end(), of_tool)) {
    // A point of a tool that meets another face has the same key.
    const RememberedContact *was = remembered_contact(touched_part, c.key),
                            *is = remembered_contact(state.touching, c.key);
    pass = was == nullptr || is == nullptr || was->feature != is->feature;
  }
  if (pass) passing.push_back({c.key, c.tool});
  return pass;
}

}  // namespace kerf
