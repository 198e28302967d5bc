#include "kerf/contact/flanks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/contact/detect_scratch.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;

/// How far behind the edge nothing touches, in thicknesses and as a part of the width at most.
constexpr double kWedge = 2, kLongestWedge = 0.5;
/// Rims that run across the blade at more than this cosine between its flank and the direction into their material are no lips of it.
constexpr double kBeside = 0.3;
/// Lips are opened by at most so many half thicknesses of the body a second.
constexpr double kOpening = 20;
/// How far a cut runs beside the blade that makes it grows by at most so many half thicknesses a second: a lip that slides along the edge while the
/// blade is pushed into it does not run farther beside it by that.
constexpr double kDrift = 2;
/// What did not touch a step ago and is deeper than so many half thicknesses has come into the blade where nothing touches (about its edge, or
/// beyond its ends): it is let through until it has come out. So is what got deeper than kLostDepth: the rim has turned past the blade.
constexpr double kUnseenDepth = 0.2, kLostDepth = 0.5;

double wedge_of(const Blade& b) { return std::min(kWedge * b.thickness, kLongestWedge * b.width); }

Vec3 to_blade(const Blade& b, Vec3 x) { return transposed_times(b.shape->axes, x - b.shape->position); }

const RememberedRim* recall_rim(const DetectMemory& memory, std::int32_t tool, V v) {
  const auto key = std::pair(tool, v);
  const auto at =
      std::lower_bound(memory.rims.begin(), memory.rims.end(), key,
                       [](const RememberedRim& r, const auto& k) { return std::pair(r.tool, r.vertex) < k; });
  return at != memory.rims.end() && at->tool == tool && at->vertex == v ? &*at : nullptr;
}

/// May the rim from a to b (in the blade's frame, with half thickness r) touch the blade?
bool near_blade(const Blade& b, Vec3 p, Vec3 q, double r, double reach) {
  const double wide = 0.5 * b.thickness + b.stray + r + reach;
  return std::max(p.x, q.x) > -b.width - reach && std::min(p.x, q.x) < reach && std::max(p.y, q.y) > -wide &&
         std::min(p.y, q.y) < wide && std::max(p.z, q.z) > -r && std::min(p.z, q.z) < b.length + r;
}

/// The side that a rim's ends were on, if they agree: it may have turned about the blade since.
int side_known(const RememberedRim* from, const RememberedRim* to) {
  const int a = from ? from->side : 0, b = to ? to->side : 0;
  return a * b < 0 ? 0 : a != 0 ? a : b;
}

/// From a rim that runs `along` with its material on the left, seen from where its skin faces; unit, or zero where it has no length.
Vec3 into_material(Vec3 skin, Vec3 along) {
  const Vec3 into = cross(skin, along);
  const double length = norm(into);
  return length > 0 ? (1 / length) * into : Vec3{};
}

std::int32_t number_of(const Slit& slit, V v) {
  const auto at = std::lower_bound(slit.vertices.begin(), slit.vertices.end(), v,
                                   [](const SlitVertex& s, V id) { return s.vertex < id; });
  return static_cast<std::int32_t>(at - slit.vertices.begin());
}

/// Of an end of the slit whose middle is at x, where its wall is `offset` from there. The wall behind the blade stands as it was cut; the one ahead
/// is what the edge is cutting, and leans as the edge does.
double end_gap(const Blade& b, int end, double x, double offset) {
  return end < 0 ? -b.width - (x + offset) : x + wedge_of(b) + b.stray;
}

/// What is known of a rim's vertex: as it lies while the edge passes, as it was, or as it is when the blade comes to an old cut.
/// Overlap alone counts: a lip that has been opened must not be taken for one that lies farther out.
void know(const Blade& b, double radius, const DetectMemory& memory, SlitVertex& s) {
  const RememberedRim* before = recall_rim(memory, b.tool, s.vertex);
  if (before && before->side != s.side) before = nullptr;
  if (before) s.known = *before;
  s.known.tool = b.tool;
  s.known.vertex = s.vertex;
  s.known.side = s.side;
  s.known.end = s.end;
  const bool fresh = s.local.x > -wedge_of(b), same_end = before && before->end == s.end;
  for (std::size_t k = 0; k < 2; ++k) {
    const double lift = k == 0 ? -1 : 1;
    const Vec3 x = s.local + lift * s.offset;
    const double most = b.stray + std::fabs(s.offset.y), drift = kDrift * radius * b.step;
    double beside =
        std::clamp(x.y, s.side < 0 ? 0.0 : -most, s.side > 0 ? 0.0 : most);  // of a tip, for the lip that lies inside
    if (before) {
      const double known = before->beside[k];
      beside = fresh ? std::clamp(beside, std::min(known, 0.0) - drift, std::max(known, 0.0) + drift) : known;
    }
    s.known.beside[k] = beside;
    const double deep =
        std::max(0.0, -end_gap(b, s.end, s.local.x, lift * s.offset.x));  // material that the blade has not left yet
    s.known.deep[k] = same_end ? std::min(before->deep[k], deep) : deep;
  }
  const double wanted = s.side == 0 ? 0 : 0.5 * b.thickness * s.freedom;
  s.known.open = std::min(wanted, s.known.open + kOpening * radius * b.step);
}

/// A place of a rim: a vertex, or between the two ends of an edge.
struct RimPlace {
  SurfacePoint where;
  CollisionHalfEdge lip;  ///< as in Contact
  Vec3 local, offset;     ///< in the blade's frame
  std::array<double, 2> beside{}, deep{};
  double open = 0;
  Vec3 travel;  ///< world
};

/// Of the lip on a side.
RimPlace place_between(const SurfaceState& body, int side, const SlitVertex& a, const SlitVertex& b, double t) {
  RimPlace p;
  p.where.vertex = {a.vertex, b.vertex, {}};
  p.where.weight = {1 - t, t, 0};
  p.local = lerp(a.local, b.local, t);
  p.offset = lerp(a.offset, b.offset, t);
  for (std::size_t k = 0; k < 2; ++k)
    p.beside[k] = (1 - t) * std::max(0.0, -side * a.known.beside[k]) + t * std::max(0.0, -side * b.known.beside[k]);
  p.deep = a.known.deep;
  p.open = (1 - t) * a.known.open + t * b.known.open;
  const auto travel = [&](V v) { return body.predicted[v.index()] - body.position[v.index()]; };
  p.travel = lerp(travel(a.vertex), travel(b.vertex), t);
  return p;
}
RimPlace place_at(const SurfaceState& body, const SlitVertex& a) {
  RimPlace p = place_between(body, a.side, a, a, 0);
  p.where.vertex = {a.vertex, {}, {}};
  p.where.weight = {1, 0, 0};
  return p;
}

/// The part of the wall at a place that stands beside the blade, as lifts; false: none does.
bool wall(const Blade& b, const RimPlace& p, double& low, double& high) {
  low = -1, high = 1;
  if (std::fabs(p.offset.z) > 0) {
    double from = -p.local.z / p.offset.z, to = (b.length - p.local.z) / p.offset.z;
    if (from > to) std::swap(from, to);
    low = std::max(low, from), high = std::min(high, to);
  } else if (p.local.z < 0 || p.local.z > b.length) {
    return false;
  }
  return low <= high;
}

void hand_out_wall(const Blade& b, const ContactName& name, const RimPlace& p, Vec3 normal,
                   std::vector<Contact>& contacts, double low_gap, double high_gap, double low, double high) {
  for (int end = 0; end < 2; ++end) {
    Contact c;
    c.gap = end == 0 ? low_gap : high_gap;
    c.a = p.where;
    c.lip = p.lip;
    c.a.lift = end == 0 ? low : high;
    c.tool = b.tool;
    c.normal = b.shape->axes * normal;
    c.point = b.shape->position + b.shape->axes * (p.local + c.a.lift * p.offset) - c.gap * c.normal;
    c.other_velocity = b.shape->velocity_at(c.point);
    const Vec3 relative = p.travel - b.step * c.other_velocity;
    const double closing = -dot(c.normal, relative);
    if (!(c.gap < b.margin + std::max(0.0, closing) + kSideways * norm(relative + closing * c.normal))) continue;
    ContactName own = name;
    own.slot = 2 * name.slot + end;
    c.key = contact_key(own);
    contacts.push_back(c);
  }
}

void touch_flank(const Blade& b, ContactName name, int side, const RimPlace& p, std::vector<Contact>& contacts) {
  double low = 0, high = 0;
  if (!wall(b, p, low, high)) return;
  const double opened = p.open * std::clamp(-p.local.x / b.width, 0.0, 1.0);
  const auto gap = [&](double lift) {
    const double t = 0.5 * (1 + lift);
    return side * (p.local.y + lift * p.offset.y) + (1 - t) * p.beside[0] + t * p.beside[1] - opened;
  };
  hand_out_wall(b, name, p, {0, static_cast<double>(side), 0}, contacts, gap(low), gap(high), low, high);
}

void touch_end(const Blade& b, const ContactName& name, int end, const RimPlace& p, std::vector<Contact>& contacts) {
  double low = 0, high = 0;
  if (!wall(b, p, low, high)) return;
  const auto gap = [&](double lift) {
    const double t = 0.5 * (1 + lift);
    return end_gap(b, end, p.local.x, lift * p.offset.x) + (1 - t) * p.deep[0] + t * p.deep[1];
  };
  hand_out_wall(b, name, p, {static_cast<double>(end), 0, 0}, contacts, gap(low), gap(high), low, high);
}

/// Takes contacts from `first` on out again that are deep and new, or lost. `known`: those of the last step, replaced by these.
void let_through(const ContactSurface& s, const Blade& b, std::size_t first, std::vector<ToolContact>& known,
                 std::vector<Contact>& contacts) {
  const auto before = static_cast<std::ptrdiff_t>(known.size());
  const auto is_new = [&](const Contact& c) {
    return std::find(known.begin(), known.begin() + before, ToolContact{c.key, b.tool}) == known.begin() + before;
  };
  std::size_t kept = first;
  for (std::size_t i = first; i < contacts.size(); ++i) {
    const Contact c = contacts[i];
    const double radius = s.radius[c.a.vertex[0]], deep = -c.gap / (radius > 0 ? radius : 0.5 * b.thickness);
    if (deep > kLostDepth || (deep > kUnseenDepth && is_new(c))) continue;
    known.push_back({c.key, b.tool});
    contacts[kept++] = c;
  }
  contacts.resize(kept);
  known.erase(
      std::remove_if(known.begin(), known.begin() + before, [&](const ToolContact& k) { return k.tool == b.tool; }),
      known.begin() + before);
}

/// Where both lips meet, and lead away to the same side of it.
void find_ends(const Blade& b, Slit& slit) {
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(slit.vertices.size()); ++i) {
    SlitVertex& v = slit.vertices[static_cast<std::size_t>(i)];
    if (v.side != 0) continue;
    bool forward = false, backward = false;
    for (const SlitEdge& e : slit.edges) {
      if (e.from != i && e.to != i) continue;
      const double x = slit.vertices[static_cast<std::size_t>(e.from == i ? e.to : e.from)].local.x;
      (x > v.local.x ? forward : backward) = true;
    }
    if (forward == backward) continue;
    const bool behind = v.local.x < -0.5 * b.width;
    if (forward == behind) v.end = forward ? -1 : 1;
  }
}

}  // namespace

void find_slit(const SurfaceState& body, const Blade& b, const DetectMemory& memory, Slit& slit) {
  const ContactSurface& s = *body.surface;
  slit.vertices.clear();
  slit.edges.clear();
  const double reach = b.margin + kApproach * b.step * b.speed;
  for (const H h : ids<H>(s.origin.size())) {
    if (s.cut[h] == 0) continue;
    const V from = s.from(h), to = s.to(h);
    const Vec3 p = to_blade(b, body.position[from.index()]), q = to_blade(b, body.position[to.index()]);
    if (!near_blade(b, p, q, std::max(s.radius[from], s.radius[to]), reach)) continue;
    const RememberedRim *known_from = recall_rim(memory, b.tool, from), *known_to = recall_rim(memory, b.tool, to);
    // Where its material lies says the side of what has just been cut: its other end may be the corner of a strip between two slits. Triangles at the tip may be
    // turned over, so the skin tells it, and which way round the rim runs.
    const bool just_cut = (!known_from && p.x > -wedge_of(b)) || (!known_to && q.x > -wedge_of(b));
    int side = just_cut ? 0 : side_known(known_from, known_to);
    if (side == 0) {
      const Vec3 into =
          into_material(transposed_times(b.shape->axes, body.offset[from.index()] + body.offset[to.index()]), q - p);
      if (!(std::fabs(into.y) > kBeside)) continue;
      side = into.y > 0 ? 1 : -1;
    }
    // Deep at first sight: the far border of a strip beside the slit.
    const double deep = -(0.5 * b.thickness + b.stray);
    if ((!known_from && side * p.y < deep) || (!known_to && side * q.y < deep)) continue;
    slit.edges.push_back({h, 0, 0, side, {}, {}});
    for (const auto& [v, x] : {std::pair(from, p), std::pair(to, q)})
      slit.vertices.push_back({v, side, 0, x, transposed_times(b.shape->axes, body.offset[v.index()]), {}, 1, {}});
  }
  std::sort(slit.vertices.begin(), slit.vertices.end(),
            [](const SlitVertex& x, const SlitVertex& y) { return x.vertex < y.vertex; });
  std::size_t kept = 0;
  for (const SlitVertex& v : slit.vertices) {
    if (kept > 0 && slit.vertices[kept - 1].vertex == v.vertex) {
      if (slit.vertices[kept - 1].side != v.side) slit.vertices[kept - 1].side = 0;
    } else {
      slit.vertices[kept++] = v;
    }
  }
  slit.vertices.resize(kept);
  for (SlitEdge& e : slit.edges) e.from = number_of(slit, s.from(e.edge)), e.to = number_of(slit, s.to(e.edge));
  find_ends(b, slit);
  for (SlitVertex& v : slit.vertices) {
    double best = HUGE_VAL;
    for (const SlitVertex& w : slit.vertices) {
      const double d = norm(s.rest[v.vertex] - s.rest[w.vertex]);
      if (v.side * w.side < 0 && d < best) best = d, v.facing = w.vertex;
    }
  }
}

void detect_flanks(const SurfaceState& body, const Blade& b, Slit& slit, DetectMemory& memory,
                   std::vector<Contact>& contacts) {
  const ContactSurface& s = *body.surface;
  for (SlitVertex& v : slit.vertices) know(b, s.radius[v.vertex], memory, v);
  std::erase_if(memory.rims, [&](const RememberedRim& r) { return r.tool == b.tool; });
  const auto at = std::lower_bound(memory.rims.begin(), memory.rims.end(), b.tool,
                                   [](const RememberedRim& r, std::int32_t t) { return r.tool < t; });
  const auto first = at - memory.rims.begin();
  memory.rims.insert(at, slit.vertices.size(), {});
  for (std::size_t i = 0; i < slit.vertices.size(); ++i)
    memory.rims[static_cast<std::size_t>(first) + i] = slit.vertices[i].known;

  const std::size_t first_contact = contacts.size();
  ContactName name{ContactKind::kFlank, 0, 0, -1 - b.tool, 0, 0, 0};
  const double wedge = wedge_of(b);
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(slit.vertices.size()); ++i) {
    const SlitVertex& v = slit.vertices[static_cast<std::size_t>(i)];
    name.feature = v.vertex.value;
    if (v.end != 0) touch_end(b, name, v.end, place_at(body, v), contacts);
    if (v.side != 0 && v.local.x <= -wedge && v.local.x >= -b.width)
      touch_flank(b, name, v.side, place_at(body, v), contacts);
  }
  for (const SlitEdge& e : slit.edges) {
    const SlitVertex &from = slit.vertices[static_cast<std::size_t>(e.from)],
                     &to = slit.vertices[static_cast<std::size_t>(e.to)];
    const Vec3 p = from.local + e.from_shift, q = to.local + e.to_shift;
    name.feature = e.edge.value;
    name.other_feature = 0;
    for (const double station : {-wedge, -b.width}) {
      ++name.other_feature;
      if ((p.x < station) == (q.x < station)) continue;
      const double t = (station - p.x) / (q.x - p.x);
      RimPlace place = place_between(body, e.side, from, to, t);
      place.local = lerp(p, q, t);
      place.lip = e.edge;
      touch_flank(b, name, e.side, place, contacts);
    }
  }
  let_through(s, b, first_contact, memory.flanks, contacts);
}

}  // namespace kerf
