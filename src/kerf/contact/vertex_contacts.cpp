// What one vertex of a body touches: faces, and lips that face its own.
#include <algorithm>
#include <cmath>

#include "kerf/contact/body_pair.h"
#include "kerf/contact/triangle_foot.h"
#include "kerf/contact/walls.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Where the distance from a vertex to a lip's edge is this level (a cosine), the walls meet, not the faces.
constexpr double kSideBySide = 0.7;
/// A corner stays with the wall of the corner across that it touched unless the other is better by this part of the radius.
constexpr double kStayAtWall = 0.02;

/// A face that a vertex touches or might touch.
struct FaceFoot {
  F face;
  BodyPoint foot;
  Vec3 normal;  ///< unit, from the face to the vertex
  double gap = HUGE_VAL;
  double other_lift = 0;  ///< of the place that is met: an end, or somewhere on a wall
  bool across = false;    ///< a neighbour at rest but for a cut
};

/// One vertex at work.
struct VertexSearch {
  V v;
  BodyPoint point;
  double reach = 0;   ///< of mid-surfaces
  double far = 0;     ///< no gap matters that is larger than this
  double radius = 0;  ///< half thickness
  double from_origin = 0;
  std::array<const RememberedContact*, 2> remembered{};  ///< by slot
  [[nodiscard]] bool is_remembered() const { return remembered[0] != nullptr || remembered[1] != nullptr; }
  std::array<FaceFoot, 2> best;  ///< by slot: on the vertex's + and - side
  RimVertex rim;
  std::array<LipFoot, 2> lip;
  std::array<LipFoot, 2> second;  ///< on other lips, where cuts cross
  CornerFoot corner;
  bool near_crossing = false;  ///< is there a corner of a piece near?
  double lip_gap =
      -HUGE_VAL;  ///< of the lip that is farther away, with patience if it touched; none: nothing faces the rim
};

ContactName vertex_name(const BodyPair& pair, V v, int slot) {
  return {ContactKind::kVertexFace, slot, pair.a.index, pair.b.index, 0, v.value, 0};
}
/// Behind its rims (0 and 1) a vertex has names for the corner across, and for what its rims face beyond a crossing.
constexpr int kCornerAcross = 2, kSecondLips = 3;
ContactName lip_name(const BodyPair& pair, V v, int rim, int end) {
  return {ContactKind::kLip, 2 * rim + end, pair.a.index, pair.a.index, 0, v.value, 0};
}

bool share_vertex(const ContactSurface& s, F f, std::int32_t g) {
  if (g < 0 || static_cast<std::size_t>(g) >= s.face_count()) return false;
  const auto p = s.vertices(f), q = s.vertices(F(g));
  return std::find_first_of(p.begin(), p.end(), q.begin(), q.end()) != p.end();
}

/// Which way a direction (unit, up to its sign) points from the face to the vertex: as in the last step, else by where it is.
double side_of(const BodyPair& pair, const VertexSearch& search, F f, Vec3 direction, Vec3 d, bool& known) {
  known = false;
  double nearest = 0.3;  // cosine: beyond, the other contact says nothing about this one
  double side = dot(direction, d) < 0 ? -1 : 1;
  for (const RememberedContact* r : search.remembered) {
    if (r == nullptr || !share_vertex(pair.b.surface, f, r->feature)) continue;
    const double along = dot(r->normal, direction);
    if (std::fabs(along) <= nearest) continue;
    nearest = std::fabs(along);
    known = true;
    side = along < 0 ? -1 : 1;
  }
  return side;
}

/// The edge of f that a foot on its border lies on, or the one that leaves the corner where it lies.
H border_at(F f, const std::array<double, 3>& foot) {
  const int opposite = opposite_corner(foot);
  return ContactSurface::corner(f, opposite >= 0 ? (opposite + 1) % 3 : foot[0] == 1 ? 0 : foot[1] == 1 ? 1 : 2);
}

/// Is another face round the foot (on an edge or a corner of f) nearer? Direction: unit, from the foot to the point.
bool is_nearer_elsewhere(const BodyView& body, F f, const std::array<double, 3>& foot, Vec3 direction) {
  const ContactSurface& s = body.surface;
  const H at = border_at(f, foot);
  if (opposite_corner(foot) >= 0) {
    const H g = s.twin[at];
    return g.valid() && dot(direction, body.into(g)) > kOffFaces;
  }
  const V v = s.from(at);
  const auto leads_to = [&](V w) {
    return dot(direction, normalized(body.position(w) - body.position(v))) > kOffFaces;
  };
  bool nearer = false;
  s.for_each_outgoing(v, [&](H h) {
    nearer = leads_to(s.to(h)) || leads_to(s.from(ContactSurface::prev(h)));
    return !nearer;
  });
  return nearer;
}

/// Is a face on the lip that faces the vertex, however far the lips have slid over each other? What never hung together with it, such as a strip that lies on
/// another one, is not, however near it was at rest.
bool lies_by_lip(const BodyPair& pair, const VertexSearch& search, F f) {
  const ContactSurface& s = pair.b.surface;
  if (are_strangers(s, search.v, f)) return false;
  for (int k = 0; k < search.rim.count; ++k) {
    const LipFoot& lip = search.lip[static_cast<std::size_t>(k)];
    if (lip.edge.valid() &&
        rest_distance(s, s.from(lip.edge), f) <= 2 * lip.score + neighbour_distance(s, s.from(lip.edge), f))
      return true;
  }
  return false;
}

/// A vertex that has no rim of its own meets the wall over an edge made by a cut, where that separates it better than the way from its foot: where offsets
/// lean, the prism over the foot reaches far to the side.
void meet_wall(const BodyView& other, const BodyPoint& point, const std::array<double, 3>& weights, FaceFoot& c) {
  const H h = border_at(c.face, weights);
  const V corner = other.surface.from(h);
  Vec3 conormal;
  if (opposite_corner(weights) >= 0) {
    if (other.surface.cut[h] == 0) return;
    conormal = out_of_rim(other, h);
  } else {
    if (other.surface.on_cut[corner] == 0 || rim_at(other, corner).count != 1) return;
    conormal = rim_at(other, corner).end[0].conormal;
  }
  const Vec3 wall = wall_normal(conormal, c.foot.offset);
  const double gap = prism_gap(point, c.foot, wall);
  if (!(gap > c.gap)) return;
  const Vec3 end = point.position - std::copysign(1, dot(wall, point.offset)) * point.offset, o = c.foot.offset;
  c.gap = gap;
  c.normal = wall;
  c.other_lift = dot(o, o) > 0 ? std::clamp(dot(end - c.foot.position, o) / dot(o, o), -1.0, 1.0) : 1;
}

/// hang_together: near at rest means neighbours.
void offer_face(const BodyPair& pair, VertexSearch& search, F f, bool hang_together) {
  const BodyView& other = pair.b;
  const TriangleFoot nearest = nearest_foot(search.point.position, other.corners(f));
  if (!(nearest.square < search.reach * search.reach)) return;
  const double distance = std::sqrt(nearest.square);
  const std::array<double, 3> weights = nearest.weights();
  FaceFoot c;
  c.face = f;
  c.foot = face_point(other, f, weights);
  const Vec3 d = search.point.position - c.foot.position;
  Vec3 direction = other.normal(f);
  // Beside the face the direction of the distance counts, if there is any.
  const double rounding = 1e-12 * (search.from_origin + norm(c.foot.position));
  const bool on_border = !is_inside(weights) && distance > rounding;
  if (on_border) direction = (1 / distance) * d;
  const double lying = std::fabs(dot(direction, search.point.offset)) + std::fabs(dot(direction, c.foot.offset));
  if (!search.is_remembered() && std::fabs(dot(direction, d)) - lying > search.far) return;
  if (!(dot(direction, direction) > 0.25)) return;
  bool known = false;
  c.normal = side_of(pair, search, f, direction, d, known) * direction;
  c.gap = prism_gap(search.point, c.foot, c.normal);
  c.other_lift = dot(c.normal, c.foot.offset) > 0 ? 1 : -1;
  if (on_border && pair.self && pair.a.surface.on_cut[search.v] == 0) meet_wall(other, search.point, weights, c);
  if (!(c.gap < gap_limit(pair.run, c.normal, search.point.travel - c.foot.travel))) return;
  FaceFoot& best = search.best[dot(c.normal, search.point.offset) > 0 ? 1 : 0];
  if (!(c.gap < best.gap || (c.gap == best.gap && f < best.face))) return;
  if (pair.self) {
    const ContactSurface& s = other.surface;
    const double radius = search.radius;
    if (!known && c.gap < -kPassed * radius && has_walls(other, f)) return;
    // On the border of what lies across a cut, level with it: the business of the lips.
    const bool level = on_border && lying < kSideBySide * (radius + norm(c.foot.offset));
    if (!are_strangers(s, search.v, f) && rest_distance(s, search.v, f) <= neighbour_distance(s, search.v, f)) {
      if (hang_together || level) return;  // neighbours have none either
      find_neighbours(s, search.v, pair.run.scratch.neighbours);
      if (is_neighbour(pair.run.scratch.neighbours, f)) return;
      c.across = true;
    }
    c.across = c.across || lies_by_lip(pair, search, f);
    if (c.across && level) return;
    const double walls = beside_walls(other, f, search.point);
    if (c.across || walls > -HUGE_VAL) {
      if (on_border && is_nearer_elsewhere(other, f, weights, direction)) return;
      if (!known && c.gap < -kPassed * radius) return;
      // Farther apart sideways than they are deep: side by side, the business of the lips.
      double beside = walls - (known ? kStay * radius : 0);
      // Where cuts cross, the lips that are nearest may be others than the face's own.
      if (c.across && search.lip_gap > -HUGE_VAL)
        beside = search.near_crossing && walls > -HUGE_VAL ? std::min(beside, search.lip_gap) : search.lip_gap;
      if (beside > c.gap) return;
    }
  }
  best = c;
}

void offer_lips(const BodyPair& pair, VertexSearch& search, F f) {
  const ContactSurface& s = pair.b.surface;
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    if (s.cut[h] == 0 || s.from(h) == search.v || s.to(h) == search.v) continue;
    for (int k = 0; k < search.rim.count; ++k)
      offer_lip(pair.b, search.point, search.rim.end[static_cast<std::size_t>(k)], h,
                search.lip[static_cast<std::size_t>(k)]);
    for (const V c : {s.from(h), s.to(h)}) {
      if (!is_outer_corner(rim_at(pair.b, c))) continue;
      search.near_crossing = true;
      offer_corner(pair.b, search.point, search.rim, c, search.corner);
    }
  }
}

/// The lips beyond the crossing of two cuts that the rims of a vertex face as well, when those on this side are known.
void offer_second_lips(const BodyPair& pair, VertexSearch& search) {
  const ContactSurface& s = pair.b.surface;
  for (int k = 0; k < search.rim.count; ++k) {
    const H first = search.lip[static_cast<std::size_t>(k)].edge;
    if (!first.valid()) continue;
    const LipRun run = lip_run(pair.b, first);
    for (const auto& it : pair.run.scratch.near_faces)
      for (int i = 0; i < 3 && it.rims; ++i) {
        const H h = ContactSurface::corner(it.face, i);
        if (s.cut[h] != 0 && s.from(h) != search.v && s.to(h) != search.v)
          offer_second_lip(pair.b, search.point, search.rim.end[static_cast<std::size_t>(k)], h, run,
                           search.second[static_cast<std::size_t>(k)]);
      }
  }
}

/// Did either end of a rim touch in the last step?
bool touched(const BodyPair& pair, V v, int rim) {
  return recall(pair.run, contact_key(lip_name(pair, v, rim, 0))) != nullptr ||
         recall(pair.run, contact_key(lip_name(pair, v, rim, 1))) != nullptr;
}

void hand_out_ends(const BodyPair& pair, const VertexSearch& search, int rim, const std::array<LipEnd, 2>& ends,
                   H edge) {
  for (int end = 0; end < 2; ++end) {
    const LipEnd& e = ends[static_cast<std::size_t>(end)];
    if (e.gap < HUGE_VAL)
      hand_out_pair(pair.run, lip_name(pair, search.v, rim, end), search.point, e.lift, e.foot, e.other_lift, e.normal,
                    edge.value);
  }
}

/// How far the lips of a vertex are from those that face them; one that touched counts as nearly closed a little longer.
void measure_lips(const BodyPair& pair, VertexSearch& search) {
  const double radius = search.radius;
  for (int k = 0; k < search.rim.count; ++k) {
    LipFoot& lip = search.lip[static_cast<std::size_t>(k)];
    if (!lip.edge.valid()) continue;
    const bool was = touched(pair, search.v, k);
    const RimEnd& rim = search.rim.end[static_cast<std::size_t>(k)];
    auto& ends = pair.lip_ends[static_cast<std::size_t>(k)];
    ends = {lip_end(pair.b, search.point, rim, lip, 0), lip_end(pair.b, search.point, rim, lip, 1)};
    const double gap = std::min(ends[0].gap, ends[1].gap);
    if (!(gap < HUGE_VAL) ||
        (!was && have_passed(gap, above_wall(search.point, edge_point(pair.b, lip.edge, lip.t)), radius)))
      lip.edge = H();
    else search.lip_gap = std::max(search.lip_gap, gap + (was ? kStay * radius : 0));
  }
}

/// Does a lip end at the corner across, which has a say of its own?
bool ends_at_corner(const BodyView& body, const VertexSearch& search, const LipFoot& lip) {
  const V corner = search.corner.corner;
  if (!corner.valid()) return false;
  const LipRun run = lip_run(body, lip.edge);
  return std::any_of(run.edge.begin(), run.edge.begin() + run.count,
                     [&](H g) { return body.surface.from(g) == corner || body.surface.to(g) == corner; });
}

/// Lips beyond a crossing: as those on this side.
void hand_out_second_lips(const BodyPair& pair, const VertexSearch& search) {
  for (int k = 0; k < search.rim.count; ++k) {
    const LipFoot& lip = search.second[static_cast<std::size_t>(k)];
    if (!lip.edge.valid() || ends_at_corner(pair.b, search, lip)) continue;
    const RimEnd& rim = search.rim.end[static_cast<std::size_t>(k)];
    const std::array<LipEnd, 2> ends{lip_end(pair.b, search.point, rim, lip, 0),
                                     lip_end(pair.b, search.point, rim, lip, 1)};
    const bool was = touched(pair, search.v, kSecondLips + k);
    const double gap = std::min(ends[0].gap, ends[1].gap);
    if (!(gap < HUGE_VAL) ||
        (!was && have_passed(gap, above_wall(search.point, edge_point(pair.b, lip.edge, lip.t)), search.radius)))
      continue;
    hand_out_ends(pair, search, kSecondLips + k, ends, lip.edge);
  }
}

/// The corner of the piece across, where two cuts cross, is left by whichever wall is nearer as things move, at either height.
void hand_out_corner(const BodyPair& pair, const VertexSearch& search) {
  if (!search.corner.corner.valid()) return;
  const std::array<CornerWall, 2> walls = corner_walls(pair.b, search.point, search.rim, search.corner.corner);
  const BodyPoint corner = vertex_point(pair.b, search.corner.corner);
  const std::array<const RememberedContact*, 2> was{
      recall(pair.run, contact_key(lip_name(pair, search.v, kCornerAcross, 0))),
      recall(pair.run, contact_key(lip_name(pair, search.v, kCornerAcross, 1)))};
  for (std::size_t end = 0; end < 2; ++end) {
    const auto out = [&](const CornerWall& w) {
      return w.later[end] +
             (was[end] != nullptr && was[end]->feature == w.foot.edge.value ? kStayAtWall * search.radius : 0);
    };
    const CornerWall& wall = out(walls[0]) < out(walls[1]) ? walls[1] : walls[0];
    const LipEnd& e = wall.ends[end];
    if (!(e.gap < HUGE_VAL)) continue;
    if (was[0] == nullptr && was[1] == nullptr && have_passed(e.gap, above_wall(search.point, corner), search.radius))
      continue;
    hand_out_pair(pair.run, lip_name(pair, search.v, kCornerAcross, static_cast<int>(end)), search.point, e.lift,
                  e.foot, e.other_lift, e.normal, wall.foot.edge.value);
  }
}

/// Lips keep each other apart sideways, or lie on each other: whichever way they are farther apart. Are there contacts with faces?
bool hand_out_vertex(const BodyPair& pair, VertexSearch& search) {
  const bool on_top = search.best[0].across || search.best[1].across;
  for (int k = 0; k < search.rim.count && !on_top; ++k) {
    const LipFoot& lip = search.lip[static_cast<std::size_t>(k)];
    if (!lip.edge.valid() || ends_at_corner(pair.b, search, lip)) continue;
    hand_out_ends(pair, search, k, pair.lip_ends[static_cast<std::size_t>(k)], lip.edge);
  }
  if (!on_top && search.near_crossing) {
    hand_out_second_lips(pair, search);
    hand_out_corner(pair, search);
  }
  bool touches = false;
  for (int slot = 0; slot < 2; ++slot) {
    const FaceFoot& c = search.best[static_cast<std::size_t>(slot)];
    if (!(c.gap < HUGE_VAL)) continue;
    hand_out_pair(pair.run, vertex_name(pair, search.v, slot), search.point, slot == 0 ? 1 : -1, c.foot, c.other_lift,
                  c.normal, c.face.value);
    touches = true;
  }
  return touches;
}

}  // namespace

bool test_vertex(const BodyPair& pair, V v) {
  const auto& near = pair.run.scratch.near_faces;
  VertexSearch search;
  search.v = v;
  search.point = vertex_point(pair.a, v);
  search.reach = pair.reach(v);
  search.radius = pair.a.frame.thickness[v.index()];
  search.from_origin = norm(search.point.position);
  search.far = (1 + 1e-9) * pair.approach(v) + 1e-12 * search.from_origin;
  for (int slot = 0; slot < 2; ++slot)
    search.remembered[static_cast<std::size_t>(slot)] = recall(pair.run, contact_key(vertex_name(pair, v, slot)));
  if (pair.self && pair.a.surface.on_cut[v] != 0) search.rim = rim_at(pair.a, v);
  if (search.rim.count > 0) {
    for (const auto& it : near)
      if (it.rims) offer_lips(pair, search, it.face);
    if (search.near_crossing) offer_second_lips(pair, search);
    measure_lips(pair, search);
  }
  for (const auto& it : near)
    if (it.test) offer_face(pair, search, it.face, it.hang_together);
  return hand_out_vertex(pair, search);
}

}  // namespace kerf
