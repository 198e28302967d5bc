// The instruments of an operation: punch, scissors, shaver, suction, taking away, probe. View rays in, changes of the session out.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/engine/engine_impl.h"
#include "kerf/engine/tolerances.h"
#include "kerf/scene/scene_shapes.h"

namespace kerf {
namespace {

using protocol::Outcome;
using protocol::Phase;
using protocol::Tool;
using protocol::ViewRay;
using Kind = SessionChange::Kind;

/// Of an instrument whose page gives none, as a part of the body's diagonal.
constexpr double kOwnSize = 0.035;
/// Scissors that are lifted this part of their blades' length on still cut.
constexpr double kLastSnip = 0.1;
/// What a shaver takes off: bumps, 1/s, and smooth edges, radii a second.
constexpr double kSmoothing = 30, kShaving = 0.6;
constexpr double kLongestPass = 0.05;   ///< s
constexpr std::size_t kMostPasses = 8;  ///< per tick
constexpr double kSuckEvery = 0.1;      ///< s
/// A probe comes down from this many sizes above, and goes back to where it was.
constexpr double kApproach = 0.25, kRetreat = 0.4, kLift = 3;  ///< s, s, sizes
/// A probe's shaft leans this much aside of the view.
constexpr double kLean = 0.5;
/// A shaver that is pressed fully goes this many sizes deep into the surface under the pointer.
constexpr double kShaverPress = 1;

void put(std::vector<double>& values, Vec3 v) { values.insert(values.end(), {v.x, v.y, v.z}); }

/// On the ray, where what it met or passed by is nearest.
Vec3 beside(const ViewRay& ray, const Picked& p) {
  return ray.origin + dot(p.middle - ray.origin, ray.direction) * ray.direction;
}

/// Between both sides of the body, along the normal from where the page shows an instrument: on the skin.
Vec3 below(const Picked& p) { return p.point - dot(p.point - p.middle, p.normal) * p.normal; }

/// The axes of a probe that is looked at along `view`: its hook points away from the eye, its shaft leans towards it.
Mat3 probe_axes(Vec3 view) {
  const Vec3 up = std::abs(view.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
  Mat3 axes;
  axes.c[2] = normalized(kLean * normalized(cross(view, up)) - view);
  axes.c[0] = normalized(view - dot(view, axes.c[2]) * axes.c[2]);
  axes.c[1] = cross(axes.c[2], axes.c[0]);
  return axes;
}

}  // namespace

std::optional<Picked> Engine::Impl::aim(const ViewRay& ray, double near) {
  return pick_near(session->body().complex.collision, session->collision_positions(), ray.origin, ray.direction, near);
}

Status Engine::Impl::use_instrument(const protocol::ToolInput& input) {
  if (input.phase == Phase::kDown) put_down(input);
  if (!instrument) return {};
  instrument->size = input.size > 0 ? static_cast<double>(input.size) : kOwnSize * rest_box.diagonal();
  switch (input.tool) {
    case Tool::kPunch: return bite(input);
    case Tool::kScissors: return snip(input);
    default: break;
  }
  for (const protocol::ToolSample& s : input.samples) instrument->rays.push_back(s.ray);
  if (!input.samples.empty() && input.samples.back().pressure > 0)
    instrument->pressure = std::min(1.0, static_cast<double>(input.samples.back().pressure));
  if (input.tool == Tool::kSuction && (input.phase == Phase::kDown || input.phase == Phase::kUp)) {
    KERF_TRY(suck(true));
    if (input.phase == Phase::kUp && !instrument->any) return bad_input("There is nothing loose here.");
  }
  if (input.phase != Phase::kUp) return {};
  lift_tool();
  if (input.tool == Tool::kShaver) {
    KERF_TRY(shave(0));
    if (session->in_stroke()) KERF_TRY(perform(Kind::kEndStroke));
    report_strokes(input.input, instrument->strokes, instrument->before, std::max(1, instrument->passes));
  }
  return {};
}

void Engine::Impl::put_down(const protocol::ToolInput& input) {
  send_pending_report();
  HandInstrument& i = instrument.emplace();
  i.strokes = session->strokes().size();
  i.before = current_counts();
  if (input.tool != Tool::kProbe && input.tool != Tool::kShaver) return;
  const SceneToolKind kind = input.tool == Tool::kProbe ? SceneToolKind::kProbe : SceneToolKind::kShaver;
  const auto& tools = session->scene().tools;
  const auto found = std::find_if(tools.begin(), tools.end(), [&](const SceneRigidTool& t) { return t.kind == kind; });
  if (found == tools.end()) {
    if (kind == SceneToolKind::kProbe) instrument.reset();
    return;
  }
  i.tool = static_cast<std::uint32_t>(found - tools.begin());
  i.surface = session->collision_positions();
  i.parked = session->tools()[*i.tool].pose;
}

Vec3 Engine::Impl::at_depth(const ViewRay& ray) {
  const auto at = aim(ray, kBesideSizes * instrument->size);
  const auto& last = instrument->last;
  const double depth = at     ? dot(at->middle - ray.origin, ray.direction)
                       : last ? dot(*last - ray.origin, ray.direction)
                              : norm(rest_box.center() - ray.origin);
  return ray.origin + depth * ray.direction;
}

Status Engine::Impl::bite(const protocol::ToolInput& input) {
  HandInstrument& i = *instrument;
  for (const protocol::ToolSample& s : input.samples) {
    // A quick drag has few samples: it bites on the way between them, too.
    const ViewRay from = i.rays.empty() ? s.ray : i.rays.back();
    const double way = norm(at_depth(s.ray) - at_depth(from));
    const double parts = std::min(kMostLooks, std::max(1.0, std::ceil(way / (kLookOn * i.size))));
    for (double k = 1; k < parts; ++k) KERF_TRY(bite_at(between(from, s.ray, k / parts), kPassing * i.size, input));
    KERF_TRY(bite_at(s.ray, input.phase == Phase::kMove ? kPassing * i.size : i.size, input));
    i.rays.assign(1, s.ray);
  }
  if (input.phase == Phase::kUp && !i.any) return bad_input("There is nothing here to bite.");
  return {};
}

Status Engine::Impl::bite_at(const ViewRay& ray, double near, const protocol::ToolInput& input) {
  HandInstrument& i = *instrument;
  const auto at = aim(ray, near);
  if (!at) return {};
  const Vec3 centre = below(*at);
  if (i.last && norm(centre - *i.last) < kNextBite * i.size) return {};
  send_pending_report();
  const BodyCounts before = current_counts();
  const std::size_t first = session->strokes().size();
  SessionChange punch;
  punch.kind = Kind::kPunch;
  const bool take = !(input.modifiers & protocol::kShift);
  punch.values = {take ? 2.0 : 0.0, 2 * at->half + i.size, kJagged * i.size};
  put(punch.values, centre);
  put(punch.values, at->normal);
  put(punch.values, std::abs(at->normal.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
  ScenePunch circle;
  circle.radius = i.size;
  for (const Vec2 corner : session->outline_of(circle)) {
    punch.values.push_back(corner.x);
    punch.values.push_back(corner.y);
  }
  Status done = perform(std::move(punch));
  const auto& strokes = session->strokes();
  if (strokes.size() == first + 2 && strokes.back().kind == StrokeRecord::Kind::kRemoval) taken_with.insert(first + 1);
  // Of a drag that has cut, a bite that met a hole is no news.
  if (strokes.size() > first) {
    i.any = true;
    i.last = centre;
    report_strokes(input.input, first, before);
  }
  return done;
}

Status Engine::Impl::snip(const protocol::ToolInput& input) {
  HandInstrument& i = *instrument;
  protocol::ToolInput snips = input;
  snips.samples.clear();
  const auto close = [&](const protocol::ToolSample& s, double least) {
    const Vec3 here = at_depth(s.ray);
    if (i.last && norm(here - *i.last) < least) return;
    i.last = here;
    snips.samples.push_back(s);
  };
  for (const protocol::ToolSample& s : input.samples) close(s, i.size);
  if (input.phase == Phase::kUp && snips.samples.empty() && !input.samples.empty())
    close(input.samples.back(), kLastSnip * i.size);
  if (snips.samples.empty() && input.phase != Phase::kUp) return {};
  return scalpel(snips);
}

Status Engine::Impl::shave(double real_seconds) {
  HandInstrument& i = *instrument;
  i.since_work += real_seconds;
  if (i.rays.empty()) return {};
  if (i.rays.size() > kMostPasses) i.rays.erase(i.rays.begin(), i.rays.end() - kMostPasses);
  const double seconds = std::min(i.since_work, kLongestPass) / static_cast<double>(i.rays.size());
  i.since_work = 0;
  if (!(seconds > 0)) return {};
  for (const ViewRay& ray : i.rays) {
    const auto at = aim(ray, 2 * i.size);
    if (!at) continue;
    const Vec3 middle = below(*at), along = (at->half + 0.3 * i.size) * at->normal;
    SessionChange pass;
    pass.kind = Kind::kShave;
    pass.values = {0};
    put(pass.values, middle + along);
    put(pass.values, middle - along);
    pass.values.insert(pass.values.end(), {i.size, 1 - std::exp(-kSmoothing * seconds), kShaving * i.size * seconds});
    KERF_TRY(perform(std::move(pass)));
    ++i.passes;
  }
  i.rays.erase(i.rays.begin(), i.rays.end() - 1);
  return i.tool ? push_shaver(real_seconds) : Status{};
}

/// The shaver of the scene goes where the page's is. Over the body its round end presses on what is under the pointer; beside a rim its shaft
/// goes past the thickness. Measured by the surface before it gave way, or the shaver would run after it.
Status Engine::Impl::push_shaver(double real_seconds) {
  HandInstrument& i = *instrument;
  i.time += real_seconds;
  const CollisionMesh& mesh = session->body().complex.collision;
  const std::vector<Vec3>& now = session->collision_positions();
  while (i.surface.size() < now.size()) i.surface.push_back(now[i.surface.size()]);  // long edges are divided
  if (i.surface.size() != now.size()) return {};
  const ViewRay& ray = i.rays.back();
  const auto at = pick_near(mesh, i.surface, ray.origin, ray.direction, 2 * i.size);
  if (!at) return {};
  i.any = true;
  const bool over = at->beside == 0;
  const double deep = over ? kShaverPress * i.pressure * i.size : at->half;
  const Vec3 end = (over ? at->point : beside(ray, *at)) + deep * ray.direction;
  return lead_in_hand(ray.direction, end);
}

/// Leads the tool in hand to `tip`, from above as it comes down.
Status Engine::Impl::lead_in_hand(Vec3 view, Vec3 tip) {
  const HandInstrument& i = *instrument;
  const double s = std::min(1.0, i.time / kApproach), down = s * s * (3 - 2 * s);
  SessionChange lead;
  lead.kind = Kind::kTool;
  lead.id = session->scene().tools[*i.tool].id;
  put(lead.values, tip - (1 - down) * kLift * i.size * view);
  put(lead.values, turn_of(probe_axes(view)));
  lead.values.push_back(speed / options.tick);  // as long as a tick: no jumps
  return perform(std::move(lead));
}

Status Engine::Impl::suck(bool now) {
  HandInstrument& i = *instrument;
  if (i.rays.empty() || (!now && i.since_work < kSuckEvery)) return {};
  i.since_work = 0;
  const ViewRay ray = i.rays.back();
  i.rays.assign(1, ray);
  if (current_counts().pieces < 2) return {};
  const auto at = aim(ray, i.size);
  if (!at) return {};
  SceneRegion ball;
  ball.shape = SceneRegion::Shape::kSphere;
  ball.center = beside(ray, *at);
  ball.radius = i.size + at->half;
  const std::size_t first = session->strokes().size();
  const BodyCounts before = current_counts();
  KERF_TRY(perform(region_change(Kind::kSuck, ball)));
  if (session->strokes().size() == first) return {};
  i.any = true;
  report_strokes(last_input, first, before);
  return {};
}

Status Engine::Impl::probe(double real_seconds) {
  HandInstrument& i = *instrument;
  const CollisionMesh& mesh = session->body().complex.collision;
  if (i.rays.empty() || i.surface.size() != mesh.vertex_count()) return {};
  i.time += real_seconds;
  const ViewRay ray = i.rays.back();
  i.rays.assign(1, ray);
  if (const auto at = pick(mesh, i.surface, ray.origin, ray.direction)) {
    i.point = at->point;
    i.normal = -1.0 * ray.direction;
    i.any = true;
  } else if (i.any) {
    const double along = dot(ray.direction, i.normal);
    if (std::abs(along) > 1e-3) i.point = ray.origin + dot(i.point - ray.origin, i.normal) / along * ray.direction;
  } else {
    return {};
  }
  const double press = 2 * i.pressure * i.size;
  const double hook = tool_sizes(session->scene().tools[*i.tool]).tip;
  return lead_in_hand(ray.direction, i.point + press * ray.direction - hook * probe_axes(ray.direction).c[0]);
}

void Engine::Impl::lift_tool() {
  const HandInstrument& i = *instrument;
  if (!i.tool || !i.any) return;
  SessionChange lift;
  lift.kind = Kind::kTool;
  lift.id = session->scene().tools[*i.tool].id;
  put(lift.values, i.parked.position);
  put(lift.values, turn_of(i.parked.axes));
  lift.values.push_back(kRetreat);
  (void)perform(std::move(lift)).ok();  // it stays where it is when it can't be led
}

void Engine::Impl::work_instrument(double real_seconds) {
  if (!instrument || !tool) return;
  Status done;
  switch (*tool) {
    case Tool::kShaver: done = shave(real_seconds); break;
    case Tool::kSuction:
      instrument->since_work += real_seconds;
      done = suck(false);
      break;
    case Tool::kProbe: done = probe(real_seconds); break;
    default: return;
  }
  if (!done) {
    error(holder, last_input,
          done.error().kind == ErrorKind::kBadInput ? protocol::ErrorCode::kBadArgument : protocol::ErrorCode::kFailed,
          done.error().message);
    cancel_tool();
  }
  publish(last_input);
}

Status Engine::Impl::take_away(CollisionTriangle triangle, std::uint32_t input) {
  if (!triangle.valid()) return {};
  if (current_counts().pieces < 2) return bad_input("The body is in one piece; cut loose what shall go.");
  if (session->held_by_supports(triangle)) return bad_input("This piece is attached; cut it loose first.");
  send_pending_report();
  const BodyCounts before = current_counts();
  const std::size_t first = session->strokes().size();
  SessionChange remove;
  remove.kind = Kind::kRemove;
  remove.vertices = {triangle.value};
  Status done = perform(std::move(remove));
  report_strokes(input, first, before);
  return done;
}

bool Engine::Impl::holds(const std::string& grasp) {
  const auto now = session->grasps();
  return std::any_of(now.begin(), now.end(), [&](const Session::GraspState& g) { return g.id == grasp; });
}

std::size_t Engine::Impl::finished_strokes() const {
  return session->strokes().size() - (session->in_stroke() ? 1 : 0);
}

void Engine::Impl::report_strokes(std::uint32_t input, std::size_t first, const BodyCounts& before, int parts) {
  send_pending_report();
  PendingReport pending;
  protocol::CutReport& r = pending.report;
  const BodyCounts& now = current_counts();
  r.input = input;
  for (std::size_t k = first; k < finished_strokes(); ++k) {
    const StrokeRecord& s = session->strokes()[k];
    r.triangles += static_cast<std::uint32_t>(s.triangles);
    r.cut_and_binding_ms += static_cast<float>(1e3 * s.times.cut_and_binding / parts);
    r.embedding_ms += static_cast<float>(1e3 * s.times.embedding / parts);
    r.cut_surface_ms += static_cast<float>(1e3 * s.times.cut_surface / parts);
    r.total_ms += static_cast<float>(1e3 * s.times.total / parts);
  }
  r.outcome = r.triangles > 0 || !(now == before) ? Outcome::kCut : Outcome::kNothingMet;
  r.pieces = static_cast<std::uint32_t>(now.pieces);
  r.counts = to_message(now);
  pending_report = std::move(pending);
}

void Engine::Impl::send_score() {
  const auto score = session->score();
  if (!score) return;
  protocol::Score m;
  m.lesion_volume = static_cast<float>(score->lesion_volume);
  m.lesion_removed = static_cast<float>(score->lesion_removed);
  m.healthy_removed = static_cast<float>(score->healthy_removed);
  m.healthy_share = static_cast<float>(score->healthy_share);
  m.roughness = static_cast<float>(score->roughness);
  m.largest_force = static_cast<float>(score->largest_force);
  m.time = static_cast<float>(score->time);
  m.loose_pieces = static_cast<std::uint32_t>(score->loose_pieces);
  broadcast(std::make_shared<const protocol::Bytes>(protocol::encode(m)));
}

}  // namespace kerf
