// The tools of a page: view rays in, changes of the session out.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/engine/engine_impl.h"
#include "kerf/engine/tolerances.h"

namespace kerf {
namespace {

using protocol::Outcome;
using protocol::Phase;
using protocol::Tool;
using protocol::ViewRay;
using Kind = SessionChange::Kind;

/// A stroke ignores rays that turn less than this since the last one that cut (radians): below a pixel on any screen.
constexpr double kLeastTurn = 2e-4;
/// Strokes may begin and end over a rim within this part of the distance from the eye: farther is no finger.
constexpr double kFarthestRim = 0.2;
/// Brushes reach this many cell diagonals: every cell that a point lies in has a node nearer than half of one.
constexpr double kBrush = 0.6;
/// Kept grasps whose held point is nearer to the release brush than this many brush radii are let go.
constexpr double kReleaseGrasp = 1;

bool same_ray(const ViewRay& a, const ViewRay& b) {
  return a.origin == b.origin && norm(cross(a.direction, b.direction)) < kLeastTurn &&
         dot(a.direction, b.direction) > 0;
}

}  // namespace

ViewRay between(const ViewRay& a, const ViewRay& b, double t) {
  return {lerp(a.origin, b.origin, t), normalized(lerp(a.direction, b.direction, t))};
}

Status Engine::Impl::perform(SessionChange change) {
  KERF_TRY(check(change));  // no recording may have it
  change.step = session->step_count();
  if (!too_long) {
    recorded_bytes += sizeof change + change.id.capacity() + 4 * change.vertices.size() + 8 * change.values.size();
    if (recorded_bytes <= options.most_recorded) {
      changes.push_back(change);
    } else {
      too_long = true;
      changes = {};
      hashes = {};
    }
  }
  return apply(*session, change);
}
Status Engine::Impl::perform(Kind kind, std::vector<double> values) {
  SessionChange change;
  change.kind = kind;
  change.values = std::move(values);
  return perform(std::move(change));
}

std::optional<Picked> Engine::Impl::pick_ray(const ViewRay& ray) {
  return pick(session->body().complex.collision, session->collision_positions(), ray.origin, ray.direction);
}

double Engine::Impl::brush_radius(CollisionTriangle triangle) const {
  const Body& whole = session->body();
  return kBrush * norm(whole.hex.frame_of(whole.complex.collision.root[triangle]).cell);
}

Status Engine::Impl::use_tool(const protocol::ToolInput& input) {
  if (input.phase == Phase::kDown) {
    cancel_tool();  // a page that lost its way begins anew
    tool = input.tool;
  } else if (tool != input.tool) {
    return {};  // cancelled meanwhile: what is still under way means nothing
  }
  if (input.phase == Phase::kCancel) {
    cancel_tool();
    return {};
  }
  Status done;
  switch (input.tool) {
    case Tool::kScalpel: done = scalpel(input); break;
    case Tool::kLine: done = straight_cut(input); break;
    case Tool::kGrasp:
    case Tool::kTake: done = pull(input); break;
    case Tool::kFix:
    case Tool::kRelease: done = brush(input); break;
    case Tool::kPunch:
    case Tool::kScissors:
    case Tool::kShaver:
    case Tool::kSuction:
    case Tool::kProbe: done = use_instrument(input); break;
  }
  if (input.phase == Phase::kUp || !done) {
    if (!done) cancel_tool();
    tool.reset();
    line_from.reset();
    instrument.reset();
  }
  return done;
}

void Engine::Impl::cancel_tool() {
  if (instrument) lift_tool();
  tool.reset();
  line_from.reset();
  instrument.reset();
  // Nothing is lost here: both take back what is unfinished.
  if (session->in_stroke()) (void)perform(Kind::kCancelStroke).ok();
  if (hand) {
    SessionChange release;
    release.kind = Kind::kRelease;
    release.id = hand->id;
    hand.reset();
    (void)perform(std::move(release)).ok();
  }
}

void Engine::Impl::leave_tool() {
  if (tool == Tool::kScalpel && session->in_stroke() && finish_stroke(last_input)) {
    tool.reset();
    line_from.reset();
  }
  cancel_tool();
}

UprightBlade Engine::Impl::upright(const ViewRay& ray, Vec3 above) {
  auto at =
      pick_near(session->body().complex.collision, session->collision_positions(), ray.origin, ray.direction, HUGE_VAL);
  const double edge = session->body().complex.mean_root_edge;
  if (!at) return {ray.origin, ray.origin, ray.origin + edge * ray.direction};  // the body lies behind the eye
  Vec3 normal =
      lie_around(session->body().complex.collision, session->collision_positions(), at->rest, kBladeStands * edge);
  if (!(norm(normal) > 0)) normal = at->normal;
  if (at->beside > 0) go_on(*at, normal, ray.origin, ray.direction);
  // Where the skin turns over, or goes on beside the body, its far side may face the eye: a blade that cuts does not turn over with it.
  const Vec3 out = dot(normal, above) > 0 ? normal : -1.0 * normal;
  const double reach = kBladeReach * (at->half + edge);
  return {at->point, at->point + reach * out, at->point - (2 * at->half + reach) * out};
}

UprightBlade Engine::Impl::upright(const ViewRay& ray) {
  return upright(ray, line_from ? scalpel_out : -1.0 * ray.direction);
}

Status Engine::Impl::place_scalpel(const UprightBlade& blade) {
  scalpel_at = blade.skin;
  scalpel_out = normalized(blade.base - blade.tip);
  return perform(Kind::kBlade, {blade.base.x, blade.base.y, blade.base.z, blade.tip.x, blade.tip.y, blade.tip.z});
}

Status Engine::Impl::lead_scalpel(const ViewRay& ray) {
  if (!line_from) {
    const UprightBlade blade = upright(ray);
    line_from = ray;
    return place_scalpel(blade);
  }
  // Between two rays the skin may bend.
  const double way = norm(upright(ray).skin - scalpel_at) / (kScalpelWay * session->body().complex.mean_root_edge);
  const int parts = static_cast<int>(std::ceil(std::min(way, static_cast<double>(kMostParts))));
  const ViewRay first = *line_from;
  for (int i = 1; i < parts; ++i) KERF_TRY(move_scalpel(between(first, ray, static_cast<double>(i) / parts)));
  return move_scalpel(ray);
}

/// Where the skin ends in the picture and another part of it is seen behind, the blade is lifted from the end and put in behind it: what lies
/// in space between the two is not under the pointer.
//   eye *- - - - near (lifted)        skin  =======.
//        ` - - - - - - - - - - far (put in)                =======  skin behind
Status Engine::Impl::move_scalpel(const ViewRay& ray) {
  const double leap = kLeap * session->body().complex.mean_root_edge;
  const ViewRay first = std::exchange(*line_from, ray);
  UprightBlade to = upright(ray);
  if (norm(to.skin - scalpel_at) <= leap) return place_scalpel(to);
  UprightBlade from = upright(first);
  if (norm(from.skin - scalpel_at) > leap)
    return place_scalpel(to);  // the skin has left the blade: it is not there any more
  ViewRay start = first;
  for (int ends = 0; ends < kMostEnds && norm(to.skin - from.skin) > leap; ++ends) {
    ViewRay near = start, far = ray;
    UprightBlade at_near = from, at_far = to;
    for (int i = 0; i < kHalvings && norm(at_far.skin - at_near.skin) > leap; ++i) {
      const ViewRay middle = between(near, far, 0.5);
      const UprightBlade at = upright(middle);
      const bool behind = norm(at.skin - at_near.skin) > norm(at.skin - at_far.skin);
      (behind ? far : near) = middle;
      (behind ? at_far : at_near) = at;
    }
    if (norm(at_far.skin - at_near.skin) <= leap) break;
    if (!same_ray(near, first)) KERF_TRY(place_scalpel(at_near));
    KERF_TRY(perform(Kind::kLift));
    start = far;
    from = upright(far, -1.0 * far.direction);
    KERF_TRY(place_scalpel(from));
    to = upright(ray);
  }
  return place_scalpel(to);
}

bool Engine::Impl::meets(const UprightBlade& blade) {
  const Vec3 along = blade.tip - blade.base;
  const double length = norm(along);
  if (!(length > 0)) return false;
  const auto hit =
      pick(session->body().complex.collision, session->collision_positions(), blade.base, (1 / length) * along);
  return hit && norm(hit->middle - blade.base) <= length;
}

std::optional<ViewRay> Engine::Impl::over_rim(const ViewRay& ray, Vec3 towards) {
  if (!(rim.reach > 0)) return std::nullopt;
  std::vector<RimPlace> places =
      rim_near(session->body().complex.collision, session->collision_positions(), ray.origin, ray.direction, rim.reach);
  if (places.empty() || !meets(upright(ray))) return std::nullopt;
  if (places.size() > kMostRimPlaces) places.resize(kMostRimPlaces);
  const Vec3 way = towards - dot(towards, ray.direction) * ray.direction;
  for (const RimPlace& p : places) {
    const ViewRay over{ray.origin, normalized(ray.direction + (p.off + kOverRim * rim.reach) * p.out)};
    if (meets(upright(over))) continue;
    if (dot(way, p.out) > kLeadsOverRim * norm(way)) return std::nullopt;
    return over;
  }
  return std::nullopt;
}

Status Engine::Impl::leave_over_rim(const ViewRay& ray, Vec3 before) {
  const auto over = over_rim(ray, before);
  return over ? lead_scalpel(*over) : Status{};
}

Status Engine::Impl::follow_scalpel(const ViewRay& ray) {
  const double way = kRimWay * rim.reach;
  if (!rim.begun) {
    rim.rays.push_back(ray);
    const ViewRay first = rim.rays.front();
    rim.here = rim.before = first.direction;
    if (norm(ray.direction - first.direction) < way && (rim.rays.size() > 1 || over_rim(first, first.direction)))
      return {};
    rim.begun = true;
    KERF_TRY(leave_over_rim(first, ray.direction));
    for (const ViewRay& r : std::exchange(rim.rays, {})) KERF_TRY(follow_scalpel(r));
    return {};
  }
  if (norm(ray.direction - rim.here) >= way) rim.before = std::exchange(rim.here, ray.direction);
  if (line_from && same_ray(*line_from, ray)) return {};
  return lead_scalpel(ray);
}

Status Engine::Impl::scalpel(const protocol::ToolInput& input) {
  if (input.phase == Phase::kDown) {
    send_pending_report();
    rim = {};
    rim.reach = std::clamp(static_cast<double>(input.size), 0.0, kFarthestRim);
    KERF_TRY(perform(Kind::kBeginStroke, {0}));
  }
  // Each ray counts, however many come at once: the cut is the same whether the engine was busy or not.
  for (const protocol::ToolSample& sample : input.samples) KERF_TRY(follow_scalpel(sample.ray));
  if (input.phase != Phase::kUp) return {};
  if (rim.begun && line_from) KERF_TRY(leave_over_rim(*line_from, rim.before));
  return finish_stroke(input.input);
}

Status Engine::Impl::straight_cut(const protocol::ToolInput& input) {
  if (input.phase == Phase::kDown) line_from = input.samples.front().ray;
  if (input.phase != Phase::kUp || input.samples.empty() || !line_from) return {};
  send_pending_report();
  const ViewRay from = *line_from, to = input.samples.back().ray;
  line_from.reset();
  rim = {};
  rim.reach = std::clamp(static_cast<double>(input.size), 0.0, kFarthestRim);
  KERF_TRY(perform(Kind::kBeginStroke, {0}));
  KERF_TRY(leave_over_rim(from, to.direction));
  KERF_TRY(lead_scalpel(from));
  KERF_TRY(lead_scalpel(to));
  KERF_TRY(leave_over_rim(to, from.direction));
  return finish_stroke(input.input);
}

Status Engine::Impl::finish_stroke(std::uint32_t input) {
  const StrokeRecord before = session->strokes().back();
  const BodyCounts now = session->counts();
  PendingReport pending;
  protocol::CutReport& r = pending.report;
  r.input = input;
  r.outcome = !(now == before.before) ? Outcome::kCut : before.refused > 0 ? Outcome::kRefused : Outcome::kNothingMet;
  KERF_TRY(perform(Kind::kEndStroke));
  if (before.refused > 0)
    pending.text =
        fmt::format("{} degenerate {} refused", before.refused, before.refused == 1 ? "step was" : "steps were");
  const BodyCounts& after = current_counts();
  r.pieces = static_cast<std::uint32_t>(after.pieces);
  r.triangles = static_cast<std::uint32_t>(before.triangles);
  r.cut_and_binding_ms = static_cast<float>(1e3 * before.times.cut_and_binding);
  r.embedding_ms = static_cast<float>(1e3 * before.times.embedding);
  r.cut_surface_ms = static_cast<float>(1e3 * before.times.cut_surface);
  r.total_ms = static_cast<float>(1e3 * before.times.total);
  r.counts = to_message(after);
  pending_report = std::move(pending);  // the next tick checks the invariants and sends it: the patch goes first
  return {};
}

void Engine::Impl::send_pending_report() {
  if (!pending_report) return;
  PendingReport pending = std::move(*pending_report);
  pending_report.reset();
  protocol::CutReport& r = pending.report;
  if (r.outcome == Outcome::kNothingMet) {
    // nothing changed
  } else if (r.counts.visual_triangles > options.most_checked) {
    r.invariants = protocol::Invariants::kNotChecked;
  } else if (const Status valid = session->validate(); !valid) {
    r.invariants = protocol::Invariants::kBroken;
    if (!pending.text.empty()) pending.text += "; ";
    pending.text += valid.error().message;
  }
  r.text = pending.text;
  broadcast(std::make_shared<const protocol::Bytes>(protocol::encode(r)));
}

void Engine::Impl::report_history(std::uint32_t input, Outcome outcome) {
  send_pending_report();
  PendingReport pending;
  protocol::CutReport& r = pending.report;
  r.input = input;
  r.outcome = outcome;
  const BodyCounts& now = current_counts();
  r.pieces = static_cast<std::uint32_t>(now.pieces);
  r.counts = to_message(now);
  pending_report = std::move(pending);
}

Status Engine::Impl::lead_tool(const protocol::Device& device) {
  if (device.tool >= things.tool_count()) return bad_input(fmt::format("The scene has no tool {}.", device.tool));
  const SceneRigidTool& rigid = session->scene().tools[device.tool];
  const double over = speed / options.tick;  // as long as a tick: no jumps
  SessionChange lead;
  lead.kind = Kind::kTool;
  lead.id = rigid.id;
  const Vec3 p = device.position, r = device.rotation;
  lead.values = {p.x, p.y, p.z, r.x, r.y, r.z, over};
  KERF_TRY(perform(std::move(lead)));
  const bool close = device.jaws < 0.5;
  if (!has_jaws(rigid) || close == jaws_closed[device.tool]) return {};
  SessionChange jaws;
  jaws.kind = Kind::kJaws;
  jaws.id = rigid.id;
  jaws.values = {close ? 1.0 : 0.0, SceneJaws{}.over};
  KERF_TRY(perform(std::move(jaws)));
  jaws_closed[device.tool] = close;
  return {};
}

Status Engine::Impl::brush(const protocol::ToolInput& input) {
  for (std::size_t i = 0; i < input.samples.size(); ++i) {
    const auto picked = pick_ray(input.samples[i].ray);
    if (!picked) continue;
    const double radius = brush_radius(picked->triangle);
    const bool first = input.phase == Phase::kDown && i == 0;
    if (!first && norm(picked->rest - last_brush) < 0.3 * radius) continue;
    last_brush = picked->rest;
    SceneRegion region;
    region.shape = SceneRegion::Shape::kSphere;
    region.center = picked->rest;
    region.radius = radius;
    if (input.tool == Tool::kFix) {
      KERF_TRY(perform(region_change(Kind::kFix, region)));
      continue;
    }
    KERF_TRY(perform(region_change(Kind::kUnfix, region)));
    for (const Session::GraspState& g : session->grasps()) {
      if (norm(g.held - picked->middle) > kReleaseGrasp * radius) continue;
      SessionChange release;
      release.kind = Kind::kRelease;
      release.id = g.id;
      KERF_TRY(perform(std::move(release)));
    }
  }
  return {};
}

}  // namespace kerf
