#include "kerf/contact/lips.h"

#include <algorithm>
#include <cmath>

#include "kerf/spatial/segment_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;

/// Rims are smooth up to this cosine between the conormals of neighbouring edges; lips face below the second, or below the third if their walls do, below
/// the fourth.
constexpr double kSmooth = 0.5, kFacing = -0.3, kTurned = 0.2, kFacingWalls = -0.7;
/// The edges of a rim lie on each other at a vertex from this cosine of their conormals on: at the tip of a cut, or in a pointed corner.
constexpr double kFoldedBack = -0.9, kHalfTurn = 3.141592653589793;
/// Borders of a strip narrower than this many thicknesses may be taken for lips; one is behind the other beyond this cosine.
constexpr double kNarrow = 2, kBehind = 0.5;
/// What is nearer to an edge at rest than this part of the thickness is on it, but for rounding.
constexpr double kLipRounding = 1e-6;
/// Walls stand along each other as long as one's thickness has this part of itself along the other's.
constexpr double kLeastUpright = 0.2;

/// The edges made by cuts that leave v and arrive at it along the border of its fan; none where it is no rim.
struct RimEdges {
  H out, in;
};
RimEdges rim_edges(const ContactSurface& s, V v) {
  RimEdges r;
  s.for_each_outgoing(v, [&](H h) {
    if (s.cut[h] != 0) r.out = h;
    if (s.cut[ContactSurface::prev(h)] != 0) r.in = ContactSurface::prev(h);
    return true;
  });
  return r;
}

/// Does the material round a border vertex reach around more than half a turn at rest, as at the tip of a cut? A pointed corner does not.
bool is_reflex(const ContactSurface& s, V v) {
  double angle = 0;
  s.for_each_outgoing(v, [&](H h) {
    const Vec3 a = s.rest[s.to(h)] - s.rest[v], b = s.rest[s.from(ContactSurface::prev(h))] - s.rest[v];
    angle += std::atan2(norm(cross(a, b)), dot(a, b));
    return true;
  });
  return angle > kHalfTurn;
}

/// Is v behind edge h at rest, with no more than narrow material between? Such a strip has its other border at its back, however it is bent.
bool back_to_back(const ContactSurface& s, const BodyPoint& v, H h) {
  Vec3 p;
  for (std::size_t k = 0; k < 3; ++k)
    if (v.where.vertex[k].valid()) p += v.where.weight[k] * s.rest[v.where.vertex[k]];
  const Vec3 a = s.rest[s.from(h)], b = s.rest[s.to(h)];
  const Vec3 d = p - lerp(a, b, closest_on_segment(p, a, b));
  const double distance = norm(d), thickness = norm(v.offset) + s.radius[s.from(h)];
  if (distance > kNarrow * thickness || distance < kLipRounding * thickness) return false;
  const Vec3 apex = s.rest[s.from(ContactSurface::prev(h))] - a;
  const Vec3 inward = apex - (dot(apex, b - a) / dot(b - a, b - a)) * (b - a);
  return dot(inward, d) > kBehind * norm(inward) * distance;
}

/// Do lips face each other? Where faces have turned to each other and offsets lean, conormals may not, and yet the walls do.
bool are_facing(Vec3 conormal, Vec3 offset, Vec3 other_conormal, Vec3 other_offset) {
  const double along = dot(conormal, other_conormal);
  return along < kFacing || (along < kTurned && dot(wall_normal(conormal, offset),
                                                    wall_normal(other_conormal, other_offset)) < kFacingWalls);
}

/// The number of an edge in the memory of this call.
std::size_t known_edge(const BodyView& body, H h) {
  RimMemory& rims = body.frame.rims;
  std::int32_t& number = rims.edge[h.index()];
  if (number == RimMemory::kUnknown) {
    number = static_cast<std::int32_t>(rims.edges.size());
    rims.edges.push_back({-body.into(h), {}, false});
  }
  return static_cast<std::size_t>(number);
}

/// The conormal that edge h has at one of its ends: smooth rims share it.
Vec3 conormal_at(const BodyView& body, H h, Vec3 own, bool at_end) {
  const RimEdges rim = rim_edges(body.surface, at_end ? body.surface.to(h) : body.surface.from(h));
  const H other = at_end ? rim.out : rim.in;
  if (!other.valid() || other == h) return own;
  const Vec3 c = out_of_rim(body, other);
  return dot(c, own) > kSmooth ? normalized(c + own) : own;
}

RimVertex find_rim(const BodyView& body, V v) {
  const RimEdges edges = rim_edges(body.surface, v);
  const Vec3 x = body.position(v);
  RimVertex r;
  if (edges.out.valid())
    r.end[0] = {out_of_rim(body, edges.out), {normalized(body.position(body.surface.to(edges.out)) - x)}};
  if (edges.in.valid())
    r.end[1] = {out_of_rim(body, edges.in), {normalized(body.position(body.surface.from(edges.in)) - x)}};
  if (!edges.out.valid()) std::swap(r.end[0], r.end[1]);
  r.count = edges.out.valid() && edges.in.valid() ? 2 : edges.out.valid() || edges.in.valid() ? 1 : 0;
  if (r.count < 2) return r;
  const double turn = dot(r.end[0].conormal, r.end[1].conormal);
  if (turn < kFoldedBack && is_reflex(body.surface, v)) r.count = 0;  // the tip: both lips are its own
  if (turn > kSmooth) {
    r.end[0].conormal = normalized(r.end[0].conormal + r.end[1].conormal);
    r.end[0].along[1] = r.end[1].along[0];
    r.count = 1;
  }
  return r;
}

}  // namespace

Vec3 wall_normal(Vec3 conormal, Vec3 offset) {
  const double size = dot(offset, offset);
  return size > 0 ? normalized(conormal - (dot(conormal, offset) / size) * offset) : conormal;
}

Vec3 out_of_rim(const BodyView& body, H h) { return body.frame.rims.edges[known_edge(body, h)].conormal; }

Vec3 out_of_rim_at(const BodyView& body, H h, double t) {
  const std::size_t number = known_edge(body, h);
  std::vector<RimEdge>& edges = body.frame.rims.edges;
  if (!edges[number].ends_known) {
    const Vec3 own = edges[number].conormal;
    for (const bool at_end : {false, true}) {
      const Vec3 c = conormal_at(body, h, own, at_end);  // may find other edges
      edges[number].at[at_end ? 1 : 0] = c;
    }
    edges[number].ends_known = true;
  }
  return normalized(lerp(edges[number].at[0], edges[number].at[1], t));
}

const RimVertex& rim_at(const BodyView& body, V v) {
  RimMemory& rims = body.frame.rims;
  if (rims.vertex[v.index()] == RimMemory::kUnknown) {
    const RimVertex r = find_rim(body, v);
    rims.vertex[v.index()] = static_cast<std::int32_t>(rims.vertices.size());
    rims.vertices.push_back(r);
  }
  return rims.vertices[static_cast<std::size_t>(rims.vertex[v.index()])];
}

void offer_lip(const BodyView& body, const BodyPoint& v, const RimEnd& rim, H h, LipFoot& best) {
  const Vec3 a = body.position(body.surface.from(h)), b = body.position(body.surface.to(h));
  const double t = closest_on_segment(v.position, a, b);
  const BodyPoint foot = edge_point(body, h, t);
  const Vec3 d = v.position - foot.position;
  const double distance = norm(d);
  if (!(distance <= best.score)) return;
  const Vec3 c = out_of_rim_at(body, h, t);
  if (!are_facing(c, foot.offset, rim.conormal, v.offset) || back_to_back(body.surface, v, h)) return;
  const Vec3 n = normalized(c - rim.conormal);
  // Walls that don't overlap along the thickness pass over each other.
  const Vec3 upright = normalized(v.offset + foot.offset);
  const double height = dot(upright, d), thickness = norm(v.offset) + norm(foot.offset);
  if (!(std::fabs(height) < thickness) && thickness > 0) return;
  // Beyond the end of a rim there is no wall.
  const double beside = std::fabs(dot(d, normalized(b - a)));
  if (!(beside <= std::fabs(dot(n, d)) + 0.25 * thickness)) return;
  // Where two cuts cross, four lips meet in one point: the one that runs along with the rim faces it.
  double score = distance;
  if (!(t > 0 && t < 1)) {
    const Vec3 run = t > 0 ? a - b : b - a;
    if (!(dot(run, rim.along[0]) > 0 || dot(run, rim.along[1]) > 0)) score += 0.01 * norm(b - a);
  }
  if (score < best.score || (score == best.score && h < best.edge)) best = {h, t, score, c};
}

LipEnd lip_end(const BodyView& body, const BodyPoint& v, const RimEnd& rim, const LipFoot& foot, int end) {
  const auto& s = body.surface;
  const Vec3 a = body.position(s.from(foot.edge)), b = body.position(s.to(foot.edge));
  const Vec3 oa = body.offset(s.from(foot.edge)), ob = body.offset(s.to(foot.edge));
  LipEnd e;
  double t = foot.t;
  const double wanted = end == 0 ? 1 : -1;
  for (int pass = 0;; ++pass) {
    e.foot = edge_point(body, foot.edge, t);
    // Heights on the other wall are linear in those on this one: own lift m is at A + m B there.
    const Vec3 o = e.foot.offset;
    const double size = dot(o, o);
    e.lift = e.other_lift = wanted;
    e.gap = 0;
    if (size > 0) {
      const double A = dot(v.position - e.foot.position, o) / size, B = dot(v.offset, o) / size;
      if (B > kLeastUpright) {
        if (std::fabs(A) >= 1 + B) e.gap = HUGE_VAL;
        const double at = A + wanted * B;
        e.other_lift = std::clamp(at, -1.0, 1.0);
        if (e.other_lift != at) e.lift = std::clamp((e.other_lift - A) / B, -1.0, 1.0);
      }
    }
    if (pass == 1) break;
    const Vec3 p = v.position + e.lift * v.offset;
    const double next = closest_on_segment(p, a + e.other_lift * oa, b + e.other_lift * ob);
    if (next == t) break;
    t = next;
  }
  const double share = std::clamp(0.5 + 2 * (std::fabs(e.lift) - std::fabs(e.other_lift)), 0.0, 1.0);
  e.normal =
      normalized(share * wall_normal(foot.conormal, e.foot.offset) - (1 - share) * wall_normal(rim.conormal, v.offset));
  if (e.gap > 0 || !(norm(e.normal) > 0.5)) {
    e.gap = HUGE_VAL;
    return e;
  }
  e.gap = dot(e.normal, v.position + e.lift * v.offset - (e.foot.position + e.other_lift * e.foot.offset));
  return e;
}

namespace {

/// Which of v's rims the first and the second rim of a corner face, as the corner across from it; -1: it is not.
std::array<int, 2> faced_rims(const RimVertex& rim, const RimVertex& other) {
  const auto faces = [&](std::size_t i, std::size_t k) {
    return dot(rim.end[i].conormal, other.end[k].conormal) < kFacing;
  };
  if (faces(0, 0) && faces(1, 1)) return {0, 1};
  if (faces(1, 0) && faces(0, 1)) return {1, 0};
  return {-1, -1};
}

}  // namespace

bool is_outer_corner(const RimVertex& rim) {
  return rim.count == 2 && dot(rim.end[0].conormal, rim.end[1].along[0]) < 0;
}

bool LipRun::has(H h) const { return std::find(edge.begin(), edge.begin() + count, h) != edge.begin() + count; }

LipRun lip_run(const BodyView& body, H h) {
  const ContactSurface& s = body.surface;
  LipRun run;
  run.edge[static_cast<std::size_t>(run.count++)] = h;
  for (const bool forward : {true, false}) {
    H g = h;
    for (int i = 0; i < LipRun::kMost; ++i) {
      const V v = forward ? s.to(g) : s.from(g);
      if (rim_at(body, v).count != 1) break;
      const RimEdges edges = rim_edges(s, v);
      g = forward ? edges.out : edges.in;
      if (!g.valid() || g == h) break;
      run.edge[static_cast<std::size_t>(run.count++)] = g;
    }
  }
  return run;
}

void offer_second_lip(const BodyView& body, const BodyPoint& v, const RimEnd& rim, H h, const LipRun& first,
                      LipFoot& best) {
  LipFoot foot = best;
  offer_lip(body, v, rim, h, foot);
  if (foot.edge != h || foot.edge == best.edge || first.has(h)) return;
  if (!(foot.t > 0 && foot.t < 1)) {
    const RimVertex& end = rim_at(body, foot.t > 0 ? body.surface.to(h) : body.surface.from(h));
    if (end.count != 1 || end.end[0].along[1] == Vec3{}) return;
  }
  best = foot;
}

void offer_corner(const BodyView& body, const BodyPoint& v, const RimVertex& rim, V c, CornerFoot& best) {
  const Vec3 d = v.position - body.position(c);
  const double distance = norm(d), thickness = norm(v.offset) + norm(body.offset(c));
  if (!(distance < best.score || (distance == best.score && c < best.corner)) || !(distance < thickness) ||
      c == v.where.vertex[0])
    return;
  const RimVertex& other = rim_at(body, c);
  if (!is_outer_corner(rim) || !is_outer_corner(other) || faced_rims(rim, other)[0] < 0) return;
  const RimEdges edges = rim_edges(body.surface, c);
  if (back_to_back(body.surface, v, edges.out) || back_to_back(body.surface, v, edges.in)) return;
  best = {c, distance};
}

std::array<CornerWall, 2> corner_walls(const BodyView& body, const BodyPoint& v, const RimVertex& rim, V corner) {
  const RimEdges edges = rim_edges(body.surface, corner);
  const std::array<int, 2> faced = faced_rims(rim, rim_at(body, corner));
  std::array<CornerWall, 2> walls;
  for (std::size_t k = 0; k < 2; ++k) {
    CornerWall& w = walls[k];
    const H h = k == 0 ? edges.out : edges.in;
    const double t =
        closest_on_segment(v.position, body.position(body.surface.from(h)), body.position(body.surface.to(h)));
    w.foot = {h, t, norm(v.position - edge_point(body, h, t).position), out_of_rim_at(body, h, t)};
    for (std::size_t end = 0; end < 2; ++end) {
      w.ends[end] = lip_end(body, v, rim.end[static_cast<std::size_t>(faced[k])], w.foot, static_cast<int>(end));
      w.later[end] = w.ends[end].gap + dot(w.ends[end].normal, v.travel - w.ends[end].foot.travel);
    }
  }
  return walls;
}

}  // namespace kerf
