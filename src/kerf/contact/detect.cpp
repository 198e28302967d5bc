#include "kerf/contact/detect.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "kerf/contact/allowed_overlap.h"
#include "kerf/contact/near_shape.h"

namespace kerf {
namespace {

/// Gaps below minus this part of the radius at first sight are bodies that were placed into each other.
constexpr double kDeep = 0.2;

/// A body without thickness has contacts' margins as if its radius were this part of its size.
constexpr double kThinnest = 1e-3;

/// Normals are longer or shorter than 1 by no more than this, squared.
constexpr double kNotUnit = 1e-9;

std::uint64_t mix(std::uint64_t z) {  // splitmix64: one to one
  z += 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

bool in_range(Vec3 v) {
  return std::fabs(v.x) <= kFarthest && std::fabs(v.y) <= kFarthest && std::fabs(v.z) <= kFarthest;
}

/// Everything that boxes and distances are made of is a number, and not too large a one?
bool in_range(std::span<const SurfaceState> bodies) {
  for (const SurfaceState& body : bodies)
    for (const std::span<const Vec3> places : {body.position, body.offset, body.predicted})
      if (!std::all_of(places.begin(), places.end(), [](Vec3 v) { return in_range(v); })) return false;
  return true;
}
bool in_range(std::span<const RigidShape> shapes, double h) {
  return std::all_of(shapes.begin(), shapes.end(), [&](const RigidShape& shape) {
    return in_range(shape.position) && is_finite(shape.axes.c[0] + shape.axes.c[1] + shape.axes.c[2]) &&
           h * greatest_speed(shape) <= kFarthest;
  });
}

void prepare(const SurfaceState& state, bool between_bodies, BodyFrame& frame) {
  const ContactSurface& s = *state.surface;
  KERF_ASSERT(state.position.size() == s.vertex_count() && state.offset.size() == s.vertex_count() &&
              state.predicted.size() == s.vertex_count());
  refit(s.tree, s.origin.raw(), state.position, frame.boxes);
  frame.normals.clear();
  if (std::find(s.coarse.begin(), s.coarse.end(), 1) != s.coarse.end()) {
    frame.normals.resize(s.face_count());
    for (const CollisionTriangle f : ids<CollisionTriangle>(s.face_count())) {
      const auto v = s.vertices(f);
      const Vec3 a = state.position[v[0].index()];
      frame.normals[f.index()] = normalized(cross(state.position[v[1].index()] - a, state.position[v[2].index()] - a));
    }
  }
  frame.rims.clear(s.vertex_count(), s.origin.size());
  frame.thickness.resize(s.vertex_count());
  frame.travel.resize(s.vertex_count());
  frame.sway.resize(s.vertex_count());
  double travel = 0, sway = 0, offset = 0;
  Vec3 mean;
  for (std::size_t v = 0; v < s.vertex_count(); ++v) {
    const Vec3 d = state.predicted[v] - state.position[v];
    frame.travel[v] = norm(d);
    mean += d;
    travel = std::max(travel, frame.travel[v]);
    frame.thickness[v] = norm(state.offset[v]);
    offset = std::max(offset, frame.thickness[v]);
  }
  if (s.vertex_count() > 0) mean = (1 / static_cast<double>(s.vertex_count())) * mean;
  for (std::size_t v = 0; v < s.vertex_count(); ++v) {
    frame.sway[v] = norm(state.predicted[v] - state.position[v] - mean);
    sway = std::max(sway, frame.sway[v]);
  }
  if (between_bodies) refit_directions(s.tree, s.origin.raw(), state.offset, frame.boxes, frame.unit, frame.directions);
  frame.greatest_travel = travel;
  frame.greatest_sway = sway;
  frame.greatest_offset = offset;
}

void detect_shape(DetectRun& run, const ShapeRef& ref) {
  const RigidShape& shape = *ref.shape;
  const double speed = greatest_speed(shape);
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(run.bodies.size()); ++body) {
    const auto b = static_cast<std::size_t>(body);
    const ContactSurface& surface = *run.bodies[b].surface;
    if (surface.tree.empty()) continue;
    const BodyFrame& frame = run.scratch.bodies[b];
    const double reach = frame.greatest_offset + run.margin +
                         kApproach * (frame.greatest_travel + run.options.step * speed) +
                         (run.bodies[b].sides != nullptr ? run.bodies[b].sides->bulge : 0);
    for (std::size_t i = 0; i < shape.parts.size(); ++i) {
      const PlacedPart placed = place(shape, shape.parts[i]);
      const BodyView view = kerf::view(run, body);
      const NearShape near{run, view, ref, static_cast<std::int32_t>(i), placed, run.options.step * speed};
      if (placed.part->kind == PartKind::kMesh) detect_mesh(near, reach);
      else detect_simple(near, reach);
    }
  }
}

/// Fills scratch.order. Keys are as good as random: by their first bits each has a place of about its own, and is moved on from there.
void sort_found(DetectScratch& scratch) {
  using FoundKey = DetectScratch::FoundKey;
  const std::vector<Contact>& found = scratch.found;
  const int bits = 1 + static_cast<int>(std::bit_width(found.size()));
  const auto bucket = [&](std::uint64_t key) { return static_cast<std::size_t>(key >> (64 - bits)); };
  auto& begin = scratch.order_begin;
  begin.assign((std::size_t{1} << bits) + 1, 0);
  for (const Contact& c : found) ++begin[bucket(c.key) + 1];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  scratch.order.resize(found.size());
  for (std::uint32_t i = 0; i < found.size(); ++i) scratch.order[begin[bucket(found[i].key)]++] = {found[i].key, i};
  const auto before = [&](const FoundKey& a, const FoundKey& b) {
    if (a.key != b.key) return a.key < b.key;
    const double x = found[a.found].gap, y = found[b.found].gap;
    return x != y ? x < y : a.found < b.found;
  };
  for (std::size_t i = 1; i < scratch.order.size(); ++i) {
    const FoundKey it = scratch.order[i];
    std::size_t at = i;
    for (; at > 0 && before(it, scratch.order[at - 1]); --at) scratch.order[at] = scratch.order[at - 1];
    scratch.order[at] = it;
  }
}

/// By key, each once (features that were found twice are the same contact).
void deliver(DetectScratch& scratch, DetectMemory& memory, std::vector<Contact>& contacts) {
  sort_found(scratch);
  contacts.clear();
  memory.contacts.clear();
  memory.cut = false;
  for (const auto& [key, i] : scratch.order) {
    if (!contacts.empty() && contacts.back().key == key) continue;
    contacts.push_back(scratch.found[i]);
    memory.contacts.push_back(scratch.remembered[i]);
  }
}

}  // namespace

DetectWorkspace::DetectWorkspace() : scratch_(new DetectScratch) {}
DetectWorkspace::~DetectWorkspace() { delete scratch_; }
DetectWorkspace::DetectWorkspace(const DetectWorkspace&) : DetectWorkspace() {}
// NOLINTNEXTLINE(bugprone-unhandled-self-assignment): nothing is copied
DetectWorkspace& DetectWorkspace::operator=(const DetectWorkspace&) { return *this; }
DetectWorkspace::DetectWorkspace(DetectWorkspace&& other) noexcept : scratch_(std::exchange(other.scratch_, nullptr)) {}
DetectWorkspace& DetectWorkspace::operator=(DetectWorkspace&& other) noexcept {
  std::swap(scratch_, other.scratch_);
  return *this;
}
DetectScratch& DetectWorkspace::scratch() {
  if (scratch_ == nullptr) scratch_ = new DetectScratch;
  return *scratch_;
}

std::uint64_t contact_key(const ContactName& n) {
  const auto bits = [](std::int32_t x) { return std::uint64_t{static_cast<std::uint32_t>(x)}; };
  std::uint64_t key = mix(static_cast<std::uint64_t>(n.kind) << 32 | bits(n.slot));
  key = mix(key ^ (bits(n.body) << 32 | bits(n.other)));
  key = mix(key ^ bits(n.part));
  return mix(key ^ (bits(n.feature) << 32 | bits(n.other_feature)));
}

/// In a list by key; null: it is not there.
template <class T>
static const T* with_key(const std::vector<T>& list, std::uint64_t key) {
  const auto at =
      std::lower_bound(list.begin(), list.end(), key, [](const T& t, std::uint64_t k) { return t.key < k; });
  return at != list.end() && at->key == key ? &*at : nullptr;
}

const RememberedContact* remembered_contact(const DetectMemory& memory, std::uint64_t key) {
  return with_key(memory.contacts, key);
}

bool is_passing(const DetectMemory& memory, std::uint64_t key) { return with_key(memory.passing, key) != nullptr; }

const RememberedContact* recall(const DetectRun& run, std::uint64_t key) {
  return run.scratch.sieve.may_have(key) ? remembered_contact(run.before, key) : nullptr;
}

const RememberedContact* recall_either_end(const DetectRun& run, ContactName name) {
  name.slot *= 2;
  for (int end = 0; end < 2; ++end, ++name.slot) {
    const RememberedContact* r = recall(run, contact_key(name));
    if (r != nullptr && !is_passing(run.before, r->key)) return r;
  }
  return nullptr;
}

void hand_out(DetectRun& run, std::uint64_t key, const Contact& contact, std::int32_t feature, double radius,
              double allowed) {
  run.scratch.found.push_back(contact);
  Contact& found = run.scratch.found.back();
  found.key = key;
  // A distance that is hardly more than rounding does not fit the direction that was divided by it.
  if (std::fabs(dot(found.normal, found.normal) - 1) > kNotUnit) found.normal = normalized(found.normal);
  run.scratch.remembered.push_back({key, found.normal, feature, allowed, contact.gap});
  if (contact.gap >= 0) return;
  const double depth = radius > 0 ? -contact.gap / radius : 0;
  run.report.deepest = std::max(run.report.deepest, depth);
  if (depth > kDeep) ++run.report.deep;
}

/// Gap below which a contact with a shape is worth handing out.
static double shape_limit(const DetectRun& run, const Contact& c, Vec3 travel) {
  // Where the body would go without contacts says little of what already lies on something: that does not get out of the way.
  const Vec3 comes = -run.options.step * c.other_velocity,
             held = travel - std::max(0.0, dot(c.normal, travel)) * c.normal;
  return std::max(gap_limit(run, c.normal, travel + comes), gap_limit(run, c.normal, held + comes));
}

/// A place of a face or an edge between points of its sides, where the cell that it lies in has it.
static bool carry(const DetectRun& run, const BodyPoint& a, Contact& c) {
  const SurfaceState& body = run.bodies[static_cast<std::size_t>(a.where.body)];
  if (body.sides == nullptr || !a.face.valid() || body.sides->pieces[a.face] < 2) return false;
  Vec3 rest;
  for (std::size_t k = 0; k < 3; ++k)
    if (const CollisionVertex v = a.where.vertex[k]; v.valid())
      rest += a.where.weight[k] * (body.surface->rest[v] + c.a.lift * body.surface->offset[v]);
  if (body.sides->holds(rest)) return false;
  c.carrier = embed_point(*body.hex, a.face, rest);
  if (!c.carrier.copy.valid()) return false;
  c.gap = dot(c.normal, place_of(*body.hex, c.carrier, body.nodes).now - c.point);
  return true;
}

void hand_out_shape(DetectRun& run, ContactName name, const ShapeRef& ref, const BodyPoint& a, Vec3 point, Vec3 normal,
                    double distance, std::int32_t feature) {
  // A prism that stands on its edge touches with both ends.
  constexpr double kUpright = 0.3;
  const RigidShape& shape = *ref.shape;
  Contact c;
  c.a = a.where;
  c.obstacle = ref.obstacle;
  c.tool = ref.tool;
  c.point = point;
  c.normal = normal;
  c.other_velocity = shape.velocity_at(point);
  c.friction = shape.friction;
  const double limit = shape_limit(run, c, a.travel);
  const double along = dot(normal, a.offset), radius = norm(a.offset);
  const double nearer = along > 0 ? -1 : 1;
  const std::int32_t slot = name.slot;
  for (const double lift : {nearer, -nearer}) {
    if (lift != nearer && !(std::fabs(along) < kUpright * radius)) continue;
    c.a.lift = lift;
    if (!carry(run, a, c)) c.gap = distance + lift * along;
    if (!(c.gap < limit)) continue;
    name.slot = 2 * slot + (lift > 0 ? 1 : 0);
    hand_out(run, contact_key(name), c, feature, radius);
  }
}

void hand_out_place(DetectRun& run, std::uint64_t key, const ShapeRef& ref, const BodyPoint& a, const SidePoint& at,
                    Vec3 place, Vec3 travel, const Proximity& nearest) {
  const RigidShape& shape = *ref.shape;
  Contact c;
  c.a = a.where;
  c.a.lift = at.lift;
  c.carrier = at.carrier;
  c.obstacle = ref.obstacle;
  c.tool = ref.tool;
  c.point = nearest.point;
  c.normal = nearest.normal;
  c.gap = dot(c.normal, place - c.point);
  c.other_velocity = shape.velocity_at(c.point);
  c.friction = shape.friction;
  if (c.gap < shape_limit(run, c, travel)) hand_out(run, key, c, -1, norm(a.offset));
}

void hand_out_pair(DetectRun& run, const ContactName& name, const BodyPoint& a, double lift_a, const BodyPoint& b,
                   double lift_b, Vec3 normal, std::int32_t feature) {
  Contact c;
  c.a = a.where;
  c.a.lift = lift_a;
  c.b = b.where;
  c.b.lift = lift_b;
  c.point = b.position + lift_b * b.offset;
  c.normal = normal;
  c.gap = dot(normal, a.position + lift_a * a.offset - c.point);
  c.friction = run.options.body_friction;
  const std::uint64_t key = contact_key(name);
  const double allowed = name.body == name.other ? allowed_overlap(run, c, key, feature) : 0;
  c.gap += allowed;
  if (c.gap < gap_limit(run, normal, a.travel - b.travel))
    hand_out(run, key, c, feature, 0.5 * (norm(a.offset) + norm(b.offset)), allowed);
}

DetectReport detect(std::span<const SurfaceState> bodies, std::span<const RigidShape> obstacles,
                    std::span<const RigidShape> tools, const DetectOptions& options, DetectMemory& memory,
                    DetectWorkspace& workspace, std::vector<Contact>& contacts) {
  DetectScratch& scratch = workspace.scratch();
  DetectReport report;
  if (!in_range(bodies) || !in_range(obstacles, options.step) || !in_range(tools, options.step)) {
    report.out_of_range = true;
    contacts.clear();
    return report;
  }
  scratch.found.clear();
  scratch.meshes = 0;
  scratch.remembered.clear();
  scratch.sieve = {};
  for (const RememberedContact& r : memory.contacts) scratch.sieve.add(r.key);
  scratch.bodies.resize(bodies.size());
  scratch.quiet.resize(bodies.size());
  double radius = 0, size = 0;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    prepare(bodies[b], options.self_contact || bodies.size() > 1, scratch.bodies[b]);
    report.sway = std::max(report.sway, scratch.bodies[b].greatest_sway);
    radius = std::max(radius, bodies[b].surface->largest_radius);
    size = std::max(size, bodies[b].surface->size);
  }
  if (!(radius > 0)) radius = kThinnest * size;
  DetectRun run{bodies, options, memory, scratch, report, options.margin * radius};
  for (std::size_t i = 0; i < obstacles.size(); ++i)
    detect_shape(run, {&obstacles[i], static_cast<std::int32_t>(i), -1});
  for (std::size_t i = 0; i < tools.size(); ++i) detect_shape(run, {&tools[i], -1, static_cast<std::int32_t>(i)});
  scratch.neighbours.vertex = {};  // what it found may have been cut since
  const auto count = static_cast<std::int32_t>(bodies.size());
  for (std::int32_t a = 0; a < count; ++a)
    for (std::int32_t b = options.self_contact ? a : a + 1; b < count; ++b) detect_bodies(run, a, b);
  deliver(scratch, memory, contacts);
  for (QuietBody& quiet : scratch.quiet) quiet.memory = memory.contacts;
  return report;
}

int substeps(std::span<const SurfaceState> bodies, std::span<const RigidShape> shapes, double h, int most) {
  double parts = 1;
  for (const SurfaceState& body : bodies)
    for (const RigidShape& shape : shapes) {
      const double thin = thinnest_radius(shape);
      const double size = body.surface->largest_radius + (thin < HUGE_VAL ? thin : 0);
      if (size > 0) parts = std::max(parts, std::ceil(h * greatest_speed(shape) / (0.5 * size)));
    }
  return static_cast<int>(std::min(parts, static_cast<double>(most)));
}

}  // namespace kerf
