// Where two edges of bodies touch: where they are nearest; and rims of lips where they cross, or along walls that are twisted.
#include <algorithm>
#include <cmath>

#include "kerf/contact/body_pair.h"
#include "kerf/contact/walls.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;

/// Edges whose nearest points move towards each other by less than this part of the radius in a step hardly move.
constexpr double kHardly = 0.3;
/// Rims cross from this sine of their angle on, with a normal that leaves the cones of both by no more than this; and deeper in each other than this
/// part of the radius they have lost each other. (Far more than kPassed: the cones say which way out is.)
constexpr double kCrossing = 0.005, kOffCone = 0.2, kLostRims = 0.5;
/// Rims that crossed and press (no more than the second part of the radius apart) go on to while the end of one is no farther than the first from where it
/// would cross the other: its corner is on the crest then, held by the face below it, and all that keeps the rest of its wall beside the other one is that the
/// rims still meet.
constexpr double kOnCrest = 0.1, kPressing = 0.02;
/// Walls whose offsets turn by more than this part of the radius along their edges meet in between, too: so many pieces.
constexpr double kTwisted = 0.1;
constexpr int kWallPieces = 4;

/// Rims of two lips, as far as those that cross say what is between them.
struct CrossingRims {
  bool known = false;        ///< they cross in no other way, and have not lost each other
  double apart = -HUGE_VAL;  ///< m where they cross, negative: overlap
};

/// Where segments a b and c d come nearest seen along n (unit), if that is less than `reach`: at one of their ends, as they do not cross.
bool nearest_ends(Vec3 a, Vec3 b, Vec3 c, Vec3 d, Vec3 n, double reach, SegmentFeet& feet) {
  const auto seen = [n](Vec3 p) { return p - dot(p, n) * n; };
  const Vec3 sa = seen(a - c), sb = seen(b - c), sc = {}, sd = seen(d - c);
  double least = reach * reach;
  const auto offer = [&](double along, double other) {
    const Vec3 between = lerp(sa, sb, along) - lerp(sc, sd, other);
    if (!(dot(between, between) < least)) return;
    least = dot(between, between);
    feet = {along, other};
  };
  offer(0, closest_on_segment(sa, sc, sd));
  offer(1, closest_on_segment(sb, sc, sd));
  offer(closest_on_segment(sc, sa, sb), 0);
  offer(closest_on_segment(sd, sa, sb), 1);
  return least < reach * reach;
}

/// Rims of lips that lie on each other at one end and side by side at the other: the upper rim of one crosses the lower rim of the other. The
/// normal is upright to both; it points out of wall and face of either.
CrossingRims test_rims(const BodyPair& pair, H h, H g) {
  const ContactSurface& s = pair.a.surface;
  const Vec3 out = out_of_rim(pair.a, h), other_out = out_of_rim(pair.b, g);
  CrossingRims rims;
  if (!(dot(out, other_out) < 0)) return rims;
  rims.known = true;
  for (const double lift : {1.0, -1.0}) {
    const auto corner = [&](const BodyView& body, V v, double l) { return body.position(v) + l * body.offset(v); };
    const Vec3 a = corner(pair.a, s.from(h), lift), b = corner(pair.a, s.to(h), lift);
    const Vec3 c = corner(pair.b, s.from(g), -lift), e = corner(pair.b, s.to(g), -lift);
    const ContactName name{ContactKind::kEdgeEdge, lift > 0 ? 1 : 2, pair.a.index, pair.b.index, 0, h.value, g.value};
    SegmentFeet feet;
    const bool inside = inner_feet(a, b, c, e, feet), crossed = recall(pair.run, contact_key(name)) != nullptr;
    if (!inside && !crossed) continue;
    const Vec3 across = cross(b - a, e - c);
    const double size = norm(across), r = norm(pair.a.offset(s.from(h)));
    if (!(size > kCrossing * norm(b - a) * norm(e - c))) continue;
    Vec3 n = (1 / size) * across;
    if (dot(n, other_out - out) < 0) n = -n;
    if (!inside && !(dot(n, a - c) < kPressing * r && nearest_ends(a, b, c, e, n, kOnCrest * r, feet))) continue;
    const BodyPoint x = edge_point(pair.a, h, feet.s), y = edge_point(pair.b, g, feet.t);
    const double gap = dot(n, x.position + lift * x.offset - y.position + lift * y.offset), radius = norm(x.offset);
    // Deep at first sight, they crossed in this step, or the normal is wrong: it has to leave no cone.
    const double off = gap < -kPassed * radius && !crossed ? 0 : kOffCone;
    const double over = -lift * dot(n, y.offset), under = -lift * dot(n, x.offset);
    if (!(dot(n, other_out) >= -off && -dot(n, out) >= -off && over >= -off * norm(y.offset) &&
          under >= -off * norm(x.offset)) ||
        gap < -kLostRims * radius) {
      rims.known = false;
      continue;
    }
    rims.apart = std::max(rims.apart, gap);
    hand_out_pair(pair.run, name, x, lift, y, -lift, n, -1);
  }
  return rims;
}

/// By how much the offset of a wall turns out of it from one end of an edge to the other, m.
double twist_of(const BodyView& body, H h) {
  return std::fabs(dot(out_of_rim(body, h), body.offset(body.surface.to(h)) - body.offset(body.surface.from(h))));
}

/// Coarse walls that are twisted bulge between their corners: places along the rim of one are as corners to the other.
void test_walls(const BodyPair& pair, H h, H g) {
  for (int k = 1; k < kWallPieces; ++k) {
    const double t = k / static_cast<double>(kWallPieces);
    const BodyPoint x = edge_point(pair.a, h, t);
    const RimEnd rim{out_of_rim_at(pair.a, h, t), {}};
    LipFoot foot;
    offer_lip(pair.b, x, rim, g, foot);
    if (!foot.edge.valid() || !(foot.t > 0 && foot.t < 1))
      continue;  // what is nearest to a corner is that one's business
    const auto name = [&](int end) {
      return ContactName{ContactKind::kWall, 2 * k + end, pair.a.index, pair.b.index, 0, h.value, g.value};
    };
    const std::array<LipEnd, 2> ends{lip_end(pair.b, x, rim, foot, 0), lip_end(pair.b, x, rim, foot, 1)};
    const double gap = std::min(ends[0].gap, ends[1].gap), radius = norm(x.offset);
    const bool was =
        recall(pair.run, contact_key(name(0))) != nullptr || recall(pair.run, contact_key(name(1))) != nullptr;
    const double above = above_wall(x, edge_point(pair.b, g, foot.t));
    if (!(gap < HUGE_VAL) || (!was && have_passed(gap, above, radius))) continue;
    // Deeper in each other sideways than along the thickness: they lie on each other.
    if (above > gap + (was ? kStay * radius : 0)) continue;
    for (int end = 0; end < 2; ++end) {
      const LipEnd& e = ends[static_cast<std::size_t>(end)];
      if (e.gap < HUGE_VAL) hand_out_pair(pair.run, name(end), x, e.lift, e.foot, e.other_lift, e.normal, -1);
    }
  }
}

/// Rims of lips may lie over each other at one end and side by side, with air between, where they are nearest (x on h, y on g): rims that cross
/// are all that touches there. Only where they hardly move in the step: fast ones may be over each other at its end.
bool are_side_by_side(const BodyPair& pair, H h, const BodyPoint& x, H g, const BodyPoint& y) {
  const double travel = norm(x.travel - y.travel);
  if (!(travel < kHardly * norm(x.offset))) return false;
  return (pair.b.surface.cut[g] != 0 && beside_wall(y, out_of_rim(pair.b, g), x) > travel) ||
         (pair.a.surface.cut[h] != 0 && beside_wall(x, out_of_rim(pair.a, h), y) > travel);
}

}  // namespace

void test_edges(const BodyPair& pair, H h, H g, double reach) {
  const ContactSurface &s = pair.a.surface, &o = pair.b.surface;
  const V p = s.from(h), q = s.to(h), u = o.from(g), w = o.to(g);
  if (pair.self && (p == u || p == w || q == u || q == w)) return;
  const Vec3 a = pair.a.position(p), b = pair.a.position(q), c = pair.b.position(u), e = pair.b.position(w);
  const CrossingRims rims = pair.self && s.cut[h] != 0 && o.cut[g] != 0 ? test_rims(pair, h, g) : CrossingRims();
  if (pair.self && s.cut[h] != 0 && o.cut[g] != 0 &&
      twist_of(pair.a, h) + twist_of(pair.b, g) > kTwisted * norm(pair.a.offset(p))) {
    test_walls(pair, h, g);
    test_walls(pair, g, h);
  }
  SegmentFeet feet;
  if (!inner_feet(a, b, c, e, feet)) return;
  const BodyPoint x = edge_point(pair.a, h, feet.s), y = edge_point(pair.b, g, feet.t);
  const Vec3 d = x.position - y.position;
  const double size = norm(d);
  if (!(size < reach)) return;
  const ContactName name{ContactKind::kEdgeEdge, 0, pair.a.index, pair.b.index, 0, h.value, g.value};
  Vec3 n = size > 1e-9 * (norm(b - a) + norm(e - c)) ? (1 / size) * d : normalized(cross(b - a, e - c));
  if (!(norm(n) > 0.5)) return;
  const RememberedContact* r = recall(pair.run, contact_key(name));
  if (r != nullptr && dot(r->normal, n) < 0) n = -n;
  if (!pair.a.off_faces(h, -n) || !pair.b.off_faces(g, n)) return;
  const double gap = prism_gap(x, y, n);
  if (!(gap < gap_limit(pair.run, n, x.travel - y.travel))) return;
  const double over = dot(n, x.offset), under = dot(n, y.offset);
  if (pair.self) {
    const int relation =
        are_strangers(s, p, ContactSurface::face(g)) ? 0 : rest_relation(s, h, g, pair.run.scratch.neighbours);
    if (relation > 0) return;
    if (rims.known && are_side_by_side(pair, h, x, g, y)) return;
    const double walls =
        std::max({edge_beside_walls(pair.a, h, pair.b, g), edge_beside_walls(pair.b, g, pair.a, h), rims.apart});
    if (relation < 0 || walls > -HUGE_VAL) {
      // Of two rims all directions are known in which they might have passed each other.
      if (r == nullptr && gap < -(s.cut[h] != 0 && o.cut[g] != 0 ? kLostRims : kPassed) * norm(x.offset)) return;
      if (walls - (r != nullptr ? kStay * norm(x.offset) : 0) > gap) return;
    }
  }
  hand_out_pair(pair.run, name, x, over > 0 ? -1 : 1, y, under > 0 ? 1 : -1, n, -1);
}

}  // namespace kerf
