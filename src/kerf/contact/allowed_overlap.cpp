#include "kerf/contact/allowed_overlap.h"

#include <algorithm>

#include "kerf/contact/tolerances.h"

namespace kerf {
namespace {

bool at_cut(const ContactSurface& s, const SurfacePoint& p) {
  return std::any_of(p.vertex.begin(), p.vertex.end(),
                     [&](CollisionVertex v) { return v.valid() && s.on_cut[v] != 0; });
}

Vec3 place_at_rest(const ContactSurface& s, const SurfacePoint& p) {
  Vec3 x;
  for (std::size_t k = 0; k < 3; ++k)
    if (p.vertex[k].valid()) x += p.weight[k] * (s.rest[p.vertex[k]] + p.lift * s.offset[p.vertex[k]]);
  return x;
}

/// Axes of the material at a point: along an edge there, and upright to that towards the + side.
Mat3 axes_at(const ContactSurface& s, const SurfacePoint& p, std::span<const Vec3> position,
             std::span<const Vec3> offset) {
  const CollisionVertex from = p.vertex[0], to = p.vertex[1].valid() ? p.vertex[1] : s.to(s.outgoing[from]);
  Vec3 up;
  for (std::size_t k = 0; k < 3; ++k)
    if (p.vertex[k].valid()) up += p.weight[k] * offset[p.vertex[k].index()];
  const Vec3 along = normalized(position[to.index()] - position[from.index()]);
  const Vec3 upright = normalized(up - dot(up, along) * along);
  return {{along, upright, cross(along, upright)}};
}

/// The gap that the contact has at rest, m: seen from b, which may have turned.
double gap_at_rest(const SurfaceState& body, const Contact& c) {
  const ContactSurface& s = *body.surface;
  const Mat3 then = axes_at(s, c.b, s.rest.raw(), s.offset.raw()), now = axes_at(s, c.b, body.position, body.offset);
  return dot(c.normal, now * transposed_times(then, place_at_rest(s, c.a) - place_at_rest(s, c.b)));
}

}  // namespace

double allowed_overlap(const DetectRun& run, const Contact& c, std::uint64_t key, std::int32_t feature) {
  if (!(c.gap < 0) || run.options.strayed != nullptr) return 0;
  const SurfaceState& body = run.bodies[static_cast<std::size_t>(c.a.body)];
  const ContactSurface& s = *body.surface;
  if (!at_cut(s, c.a) || !at_cut(s, c.b)) return 0;
  const double overlap = -c.gap;
  if (const RememberedContact* was = recall(run, key)) {
    const double deeper = std::max(0.0, overlap + std::min(was->gap, 0.0));
    if (was->feature != feature || run.before.cut) return deeper;
    return std::max(std::min(was->allowed, overlap), deeper - kJump * s.radius[c.a.vertex[0]]);
  }
  if (!run.before.cut && !run.before.contacts.empty()) return overlap;
  const double near = kNearAtRest * (s.radius[c.a.vertex[0]] + s.radius[c.b.vertex[0]]);
  if (norm(place_at_rest(s, c.a) - place_at_rest(s, c.b)) > near) return overlap;
  return std::clamp(-gap_at_rest(body, c), 0.0, overlap);
}

}  // namespace kerf
