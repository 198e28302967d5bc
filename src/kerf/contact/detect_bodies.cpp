// Bodies against each other and against themselves.
#include <algorithm>
#include <bit>
#include <cmath>

#include "kerf/contact/detect_scratch.h"
#include "kerf/contact/lips.h"
#include "kerf/contact/segment_queries.h"
#include "kerf/contact/triangle_foot.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Where the distance from a vertex to a lip's edge is this level (a cosine), the walls meet, not the faces.
constexpr double kSideBySide = 0.7;
/// What did not touch across a cut a step ago is never deeper in each other than this part of the radius: it would have been seen
/// coming. It lies side by side, or has passed over.
constexpr double kPassed = 0.1;
/// Walls of lips that share so many times as much height as they overlap beside each other are side by side, however deep.
constexpr double kClearly = 3;
/// A vertex stays with the lip or the face that it touched unless the other is better by this part of the radius.
constexpr double kStay = 0.1;
/// Edges whose nearest points move towards each other by less than this part of the radius in a step hardly move.
constexpr double kHardly = 0.3;
/// Rims cross from this sine of their angle on, with a normal that leaves the cones of both by no more than this; and deeper in each other than this
/// part of the radius they have lost each other. (Far more than kPassed: the cones say which way out is.)
constexpr double kCrossing = 0.005, kOffCone = 0.2, kLostRims = 0.5;

/// What has strayed towards each other by less than this part of the margin was seen coming.
constexpr double kForeseen = 0.5;

/// Walls whose offsets turn by more than this part of the radius along their edges meet in between, too: so many pieces.
constexpr double kTwisted = 0.1;
constexpr int kWallPieces = 4;

/// A face that a vertex touches or might touch.
struct FaceFoot {
  F face;
  BodyPoint foot;
  Vec3 normal;        ///< unit, from the face to the vertex
  double gap = HUGE_VAL;
  bool across = false;  ///< a neighbour at rest but for a cut
};

/// Vertices of one body against faces of another, or of the same.
struct Pair {
  DetectRun& run;
  const BodyView& a;
  const BodyView& b;
  bool self;
  double most_sway;  ///< of the other body
  QuietBody* quiet;  ///< of a body with itself; else null
  std::array<std::array<LipEnd, 2>, 2>& lip_ends;  ///< of the vertex at work: of its lips' feet, upper and lower
  [[nodiscard]] double sway(std::size_t v) const { return self ? a.frame.sway[v] : a.frame.travel[v]; }
};

ContactName vertex_name(const Pair& pair, V v, int slot) {
  return {ContactKind::kVertexFace, slot, pair.a.index, pair.b.index, 0, v.value, 0};
}
ContactName lip_name(const Pair& pair, V v, int rim, int end) {
  return {ContactKind::kLip, 2 * rim + end, pair.a.index, pair.a.index, 0, v.value, 0};
}

bool share_vertex(const ContactSurface& s, F f, std::int32_t g) {
  if (g < 0 || static_cast<std::size_t>(g) >= s.face_count()) return false;
  const auto p = s.vertices(f), q = s.vertices(F(g));
  return std::find_first_of(p.begin(), p.end(), q.begin(), q.end()) != p.end();
}

/// One vertex at work.
struct VertexSearch {
  V v;
  BodyPoint point;
  double reach = 0;     ///< of mid-surfaces
  double far = 0;       ///< no gap matters that is larger than this
  double radius = 0;    ///< half thickness
  double from_origin = 0;
  std::array<const RememberedContact*, 2> remembered{};  ///< by slot
  [[nodiscard]] bool is_remembered() const { return remembered[0] != nullptr || remembered[1] != nullptr; }
  std::array<FaceFoot, 2> best;                           ///< by slot: on the vertex's + and - side
  RimVertex rim;
  std::array<LipFoot, 2> lip;
  double lip_gap = -HUGE_VAL;  ///< of the lip that is farther away, with patience if it touched; none: nothing faces the rim
};

/// Which way a direction (unit, up to its sign) points from the face to the vertex: as in the last step, else by where it is.
double side_of(const Pair& pair, const VertexSearch& search, F f, Vec3 direction, Vec3 d, bool& known) {
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

/// How far a point of a prism is from a wall, along the wall's conormal (out of its material) or along the direction
/// next to it that the point's own prism is upright to: whichever is more; negative: behind it.
double beside_wall(const BodyPoint& wall, Vec3 conormal, const BodyPoint& p) {
  const Vec3 d = p.position - wall.position;
  const auto along = [&](Vec3 n) { return dot(n, d) - std::fabs(dot(n, p.offset)) - std::fabs(dot(n, wall.offset)); };
  const double size = dot(p.offset, p.offset);
  if (!(size > 0)) return along(conormal);
  return std::max(along(conormal), along(normalized(conormal - (dot(conormal, p.offset) / size) * p.offset)));
}

/// The same for the walls at a vertex of a rim: of an outer corner the farther one, of an inner corner the nearer.
double beside_rim(const BodyView& body, V v, const BodyPoint& p) {
  const RimVertex& rim = rim_at(body, v);
  if (rim.count == 0) return -HUGE_VAL;
  const BodyPoint wall = vertex_point(body, v);
  const double first = beside_wall(wall, rim.end[0].conormal, p);
  if (rim.count == 1) return first;
  const double second = beside_wall(wall, rim.end[1].conormal, p);
  return dot(rim.end[0].conormal, rim.end[1].along[0]) < 0 ? std::max(first, second) : std::min(first, second);
}

/// How far a point is beside the walls that a cut left on a face: the farthest.
double beside_walls(const BodyView& body, F f, const BodyPoint& p) {
  double beside = -HUGE_VAL;
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    const V v = body.surface.from(h);
    if (body.surface.cut[h] != 0) {
      const double t = closest_on_segment(p.position, body.position(v), body.position(body.surface.to(h)));
      beside = std::max(beside, beside_wall(edge_point(body, h, t), out_of_rim(body, h), p));
    } else if (body.surface.on_cut[v] != 0) {
      beside = std::max(beside, beside_rim(body, v, p));
    }
  }
  return beside;
}

/// Is another face round the foot (on an edge or a corner of f) nearer? Direction: unit, from the foot to the point.
bool is_nearer_elsewhere(const BodyView& body, F f, const std::array<double, 3>& foot, Vec3 direction) {
  const ContactSurface& s = body.surface;
  if (const int opposite = opposite_corner(foot); opposite >= 0) {
    const H g = s.twin[ContactSurface::corner(f, (opposite + 1) % 3)];
    return g.valid() && dot(direction, body.into(g)) > kOffFaces;
  }
  const int at = foot[0] == 1 ? 0 : foot[1] == 1 ? 1 : 2;
  const V v = s.from(ContactSurface::corner(f, at));
  const auto leads_to = [&](V w) { return dot(direction, normalized(body.position(w) - body.position(v))) > kOffFaces; };
  const H start = s.outgoing[v];
  H h = start;
  do {
    if (leads_to(s.to(h)) || leads_to(s.from(ContactSurface::prev(h)))) return true;
    h = s.twin[ContactSurface::prev(h)];
  } while (h.valid() && h != start);
  if (h.valid()) return false;
  for (H g = s.twin[start]; g.valid(); g = s.twin[g]) {
    g = ContactSurface::next(g);
    if (leads_to(s.to(g))) return true;
  }
  return false;
}

/// Is a face on the lip that faces the vertex, however far the lips have slid over each other?
bool lies_by_lip(const Pair& pair, const VertexSearch& search, F f) {
  const ContactSurface& s = pair.b.surface;
  for (int k = 0; k < search.rim.count; ++k) {
    const LipFoot& lip = search.lip[static_cast<std::size_t>(k)];
    if (lip.edge.valid() && rest_distance(s, s.from(lip.edge), f) <= 2 * lip.score + neighbour_distance(s, s.from(lip.edge), f)) return true;
  }
  return false;
}

/// Does beside_walls() find a wall at a face?
bool has_walls(const BodyView& body, F f) {
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    const V v = body.surface.from(h);
    if (body.surface.cut[h] != 0 || (body.surface.on_cut[v] != 0 && rim_at(body, v).count > 0)) return true;
  }
  return false;
}

/// hang_together: near at rest means neighbours.
void offer_face(const Pair& pair, VertexSearch& search, F f, bool hang_together) {
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
      const double beside = c.across && search.lip_gap > -HUGE_VAL ? search.lip_gap : walls - (known ? kStay * radius : 0);
      if (beside > c.gap) return;
    }
  }
  best = c;
}

void offer_lips(const Pair& pair, VertexSearch& search, F f) {
  const ContactSurface& s = pair.b.surface;
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    if (s.cut[h] == 0 || s.from(h) == search.v || s.to(h) == search.v) continue;
    for (int k = 0; k < search.rim.count; ++k)
      offer_lip(pair.b, search.point, search.rim.end[static_cast<std::size_t>(k)], h,
                search.lip[static_cast<std::size_t>(k)]);
  }
}

/// How far walls are from each other along the thickness, m; negative: the height that they share.
double above_wall(const BodyPoint& x, const BodyPoint& y) {
  return std::fabs(dot(normalized(x.offset + y.offset), x.position - y.position)) - norm(x.offset) - norm(y.offset);
}

/// Walls that are deep in each other at first sight have passed over each other, unless beside is clearly the shorter way out: a cut has just made them,
/// of what had moved together where its tip was.
bool have_passed(double gap, double above, double radius) { return gap < -kPassed * radius && !(above < kClearly * gap); }

/// How far the lips of a vertex are from those that face them; one that touched counts as nearly closed a little longer.
void measure_lips(const Pair& pair, VertexSearch& search) {
  const double radius = search.radius;
  for (int k = 0; k < search.rim.count; ++k) {
    LipFoot& lip = search.lip[static_cast<std::size_t>(k)];
    if (!lip.edge.valid()) continue;
    const bool was = recall(pair.run, contact_key(lip_name(pair, search.v, k, 0))) != nullptr ||
                     recall(pair.run, contact_key(lip_name(pair, search.v, k, 1))) != nullptr;
    const RimEnd& rim = search.rim.end[static_cast<std::size_t>(k)];
    auto& ends = pair.lip_ends[static_cast<std::size_t>(k)];
    ends = {lip_end(pair.b, search.point, rim, lip, 0), lip_end(pair.b, search.point, rim, lip, 1)};
    const double gap = std::min(ends[0].gap, ends[1].gap);
    if (!(gap < HUGE_VAL) || (!was && have_passed(gap, above_wall(search.point, edge_point(pair.b, lip.edge, lip.t)), radius))) lip.edge = H();
    else search.lip_gap = std::max(search.lip_gap, gap + (was ? kStay * radius : 0));
  }
}

/// Lips keep each other apart sideways, or lie on each other: whichever way they are farther apart. Are there contacts with faces?
bool hand_out_vertex(const Pair& pair, VertexSearch& search) {
  const bool on_top = search.best[0].across || search.best[1].across;
  for (int k = 0; k < search.rim.count && !on_top; ++k) {
    const LipFoot& lip = search.lip[static_cast<std::size_t>(k)];
    if (!lip.edge.valid()) continue;
    for (int end = 0; end < 2; ++end) {
      const LipEnd& e = pair.lip_ends[static_cast<std::size_t>(k)][static_cast<std::size_t>(end)];
      if (e.gap < HUGE_VAL) hand_out_pair(pair.run, lip_name(pair, search.v, k, end), search.point, e.lift, e.foot, e.other_lift, e.normal, lip.edge.value);
    }
  }
  bool touches = false;
  for (int slot = 0; slot < 2; ++slot) {
    const FaceFoot& c = search.best[static_cast<std::size_t>(slot)];
    if (!(c.gap < HUGE_VAL)) continue;
    const double lift = slot == 0 ? 1 : -1, other = dot(c.normal, c.foot.offset) > 0 ? 1 : -1;
    hand_out_pair(pair.run, vertex_name(pair, search.v, slot), search.point, lift, c.foot, other, c.normal, c.face.value);
    touches = true;
  }
  return touches;
}

void list_faces(const BodyView& body, std::uint32_t leaf, LeafBoxes& list) {
  const auto& points = body.frame.boxes.points;
  list.list(leaf, [&](auto&& add) {
    body.surface.tree.for_each_triangle(leaf, [&](F f) {
      const auto c = body.surface.vertices(f);
      const TreeCorner &x = points[c[0].index()], &y = points[c[1].index()], &z = points[c[2].index()];
      add(f.value, joined(joined({x, x}, {y, y}), {z, z}));
    });
  });
}

/// Pairs with the same first leaf; and, of a body with itself, what it has followed so far.
struct LeafGroup {
  std::span<const LeafPair> pairs;
  std::span<const QuietBody::Followed> followed;
  std::span<const std::uint8_t> fresh;  ///< of these
  bool any_fresh = true;
};

/// The second leaves of a group, eight at a time.
std::span<const LeafBlock> list_partners(const Pair& pair, const LeafGroup& group) {
  auto& blocks = pair.run.scratch.partners;
  if (!blocks.empty()) return blocks;
  blocks.resize((group.pairs.size() + 7) / 8, no_leaves());
  for (std::size_t i = 0; i < group.pairs.size(); ++i) {
    const std::uint32_t leaf = group.pairs[i][1];
    set_leaf(pair.b.frame.boxes.box[leaf], pair.b.frame.directions[leaf], i % 8, blocks[i / 8]);
  }
  return blocks;
}

/// Calls visit(pair, is it one of `some`?) for the pairs of a group whose bit select(block of partners) sets. `some` are in the order of the group.
template <class Select, class Visit>
void for_each_near_leaf(const Pair& pair, const LeafGroup& group, std::span<const LeafPair> some, Select&& select, Visit&& visit) {
  const std::span<const LeafBlock> blocks = list_partners(pair, group);
  auto tested = some.begin();
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (unsigned bits = select(blocks[b]); bits != 0; bits &= bits - 1) {
      const std::size_t i = 8 * b + static_cast<std::size_t>(std::countr_zero(bits));
      if (i >= group.pairs.size()) break;
      const LeafPair& leaves = group.pairs[i];
      while (tested != some.end() && (*tested)[1] < leaves[1]) ++tested;
      visit(leaves, tested != some.end() && *tested == leaves);
    }
}

/// Fills scratch.near_faces with the faces that a vertex may touch, or whose rims it may face.
void find_near_faces(const Pair& pair, V v, double reach, double approach, const LeafGroup& group, std::span<const LeafPair> some, bool has_rim) {
  const BodyView& other = pair.b;
  const double slack = other.frame.boxes.slack + pair.a.frame.boxes.slack, r = reach + slack;
  const auto square = static_cast<float>(r * r), limit = static_cast<float>(approach + slack);
  const TreeCorner p = pair.a.frame.boxes.points[v.index()], direction = pair.a.frame.unit[v.index()];
  const TreeBox here{p, p}, mine{direction, direction};
  LeafBoxes& faces = pair.run.scratch.leaf_faces;
  auto& near = pair.run.scratch.near_faces;
  near.clear();
  const auto select_leaves = [&](const LeafBlock& leaves) { return leaves_near_point(leaves, p, direction, square, limit); };
  for_each_near_leaf(pair, group, some, select_leaves, [&](const LeafPair& leaves, bool test) {
    const std::uint32_t partner = leaves[1];
    const bool rims = has_rim && (pair.quiet == nullptr || pair.quiet->has_rim[partner] != 0);
    if (!test && !rims) return;
    const bool neighbours = pair.self && hang_together(pair.a.surface, leaves[0], partner);
    const auto select = [&](std::uint32_t block) {
      const unsigned bits = near_point(faces.block[block], p, square);
      return bits == 0 ? 0 : bits & not_side_by_side(here, mine, faces.block[block], other.frame.directions[partner], limit);
    };
    list_faces(other, partner, faces);
    faces.for_each(partner, select, [&](std::uint32_t i) {
      const F f(faces.item[i]);
      const auto c = other.surface.vertices(f);
      const bool own = pair.self && (c[0] == v || c[1] == v || c[2] == v);
      if ((rims || !own) && (!neighbours || !is_clear_neighbour(pair.a.surface, v, f))) near.push_back({f, rims, test && !own, neighbours});
    });
  });
}

/// A vertex against the rims of all leaves that its own leaf has to do with, and against the faces of some of them.
void search_vertex(const Pair& pair, V v, const LeafGroup& group, std::span<const LeafPair> some) {
  const bool on_cut = pair.self && pair.a.surface.on_cut[v] != 0;
  if (some.empty() && !on_cut) return;
  const int rims = on_cut ? rim_at(pair.a, v).count : 0;
  const double approach = pair.run.margin + kApproach * (pair.sway(v.index()) + pair.most_sway);
  const double reach = pair.a.frame.thickness[v.index()] + pair.b.frame.greatest_offset + approach;
  find_near_faces(pair, v, reach, approach, group, some, rims > 0);
  const auto& near = pair.run.scratch.near_faces;
  bool touches = false;
  if (!near.empty()) {
    VertexSearch search;
    search.v = v;
    search.point = vertex_point(pair.a, v);
    search.reach = reach;
    search.radius = pair.a.frame.thickness[v.index()];
    search.from_origin = norm(search.point.position);
    search.far = (1 + 1e-9) * approach + 1e-12 * search.from_origin;
    for (int slot = 0; slot < 2; ++slot)
      search.remembered[static_cast<std::size_t>(slot)] = recall(pair.run, contact_key(vertex_name(pair, v, slot)));
    if (on_cut) search.rim = rim_at(pair.a, v);
    if (rims > 0) {
      for (const auto& it : near)
        if (it.rims) offer_lips(pair, search, it.face);
      measure_lips(pair, search);
    }
    for (const auto& it : near)
      if (it.test) offer_face(pair, search, it.face, it.hang_together);
    touches = hand_out_vertex(pair, search);
  }
  if (pair.quiet != nullptr) pair.quiet->vertex[v.index()].touched = touches ? 1 : 0;
}

template <class Visit>
void for_each_group(const Pair& pair, Visit&& visit) {
  const std::span<const LeafPair> pairs = pair.run.scratch.leaf_pairs;
  std::size_t at = 0;
  for (std::size_t i = 0; i < pairs.size();) {
    const std::uint32_t leaf = pairs[i][0];
    std::size_t end = i + 1;
    while (end < pairs.size() && pairs[end][0] == leaf) ++end;
    LeafGroup group{pairs.subspan(i, end - i), {}, {}};
    if (pair.quiet != nullptr) {
      QuietBody& quiet = *pair.quiet;
      const std::span<const QuietBody::Followed> followed = quiet.followed;
      while (followed[at].leaves[0] != leaf) ++at;
      std::size_t behind = at + 1;
      while (behind < followed.size() && followed[behind].leaves[0] == leaf) ++behind;
      group.followed = followed.subspan(at, behind - at);
      group.fresh = std::span<const std::uint8_t>(quiet.fresh).subspan(at, behind - at);
      quiet.unsettled.clear();
      for (const LeafPair& leaves : group.pairs)
        if (!quiet.settled(leaves[1])) quiet.unsettled.push_back(leaves);
      group.any_fresh = std::find(group.fresh.begin(), group.fresh.end(), 1) != group.fresh.end();
    }
    pair.run.scratch.partners.clear();
    visit(group);
    i = end;
  }
}

/// The pairs of a group that a vertex or an edge has to be tested with in this call. deform(pair of leaves, limit, most): how much it may deform
/// towards that leaf, if less than `most`; 0: test it.
template <class Deform>
std::span<const LeafPair> pairs_to_test(const Pair& pair, const LeafGroup& group, double approach, QuietUntil& known, Deform&& deform) {
  const std::uint32_t leaf = group.pairs[0][0];
  if (!pair.quiet->settled(leaf)) return group.pairs;
  const bool quiet = is_quiet(*pair.quiet, known, leaf, approach);
  if (!quiet || group.any_fresh) {
    if (!may_be_quiet(known)) return group.pairs;
    std::size_t& budget = pair.quiet->budget;
    if (budget == 0) {
      known.moved = -1;
      return group.pairs;
    }
    const double limit = quiet ? known.approach : quiet_limit(approach, pair.run.margin);
    QuietUntil found = quiet ? known : QuietUntil();
    double most = 0.5 * quiet_skin(pair.a);
    for (std::size_t i = 0; i < group.followed.size(); ++i) {
      const LeafPair& leaves = group.followed[i].leaves;
      const auto end = found.near.begin() + found.near_count;
      if ((quiet && group.fresh[i] == 0) || !pair.quiet->settled(leaves[1]) || std::find(found.near.begin(), end, leaves[1]) != end) continue;
      if (budget > 0) --budget;
      if (const double d = deform(leaves, limit, most); d > 0) {
        most = d;
      } else if (found.near_count < QuietUntil::kMostNear) {
        found.near[found.near_count++] = leaves[1];
      } else {
        give_up(known);
        return group.pairs;
      }
    }
    most += pair.quiet->moved[leaf];
    known = found;
    known.moved = quiet ? std::min(known.moved, most) : most;
    known.approach = limit;
    known.leaf = leaf;
  }
  if (known.near_count == 0) return pair.quiet->unsettled;
  std::vector<LeafPair>& near = pair.quiet->near;
  near.clear();
  for (const LeafPair& leaves : group.pairs) {
    const auto end = known.near.begin() + known.near_count;
    if (!pair.quiet->settled(leaves[1]) || std::find(known.near.begin(), end, leaves[1]) != end) near.push_back(leaves);
  }
  return near;
}

std::span<const LeafPair> vertex_pairs(const Pair& pair, V v, const LeafGroup& group) {
  // Which side a vertex is on of what it touches says so of the faces around it as well: those have to be looked at.
  if (pair.quiet == nullptr || pair.quiet->vertex[v.index()].touched != 0) return group.pairs;
  const double approach = pair.run.margin + kApproach * (pair.sway(v.index()) + pair.most_sway);
  return pairs_to_test(pair, group, approach, pair.quiet->vertex[v.index()], [&](const LeafPair& leaves, double limit, double most) {
    return quiet_vertex(pair.a, v, leaves, limit, most, pair.run.scratch.neighbours);
  });
}

/// All pairs by their first leaf: its vertices against the second leaves.
void search_vertices(const Pair& pair) {
  const ContactSurface& surface = pair.a.surface;
  pair.run.scratch.leaf_faces.clear(pair.b.surface.tree.nodes.size());
  for_each_group(pair, [&](const LeafGroup& group) {
    surface.tree.for_each_triangle(group.pairs[0][0], [&](F f) {
      for (int k = 0; k < 3; ++k)
        if (const H h = ContactSurface::corner(f, k); surface.owns_vertex(h)) {
          const V v = surface.origin[h];
          search_vertex(pair, v, group, vertex_pairs(pair, v, group));
        }
    });
  });
}

bool is_coarse(const ContactSurface& s, H h) {
  return s.coarse[ContactSurface::face(h)] != 0 || (s.twin[h].valid() && s.coarse[ContactSurface::face(s.twin[h])] != 0);
}

/// How far all that stands over an edge is from the wall over another: beside it along `conormal` or next to that, upright to either end of the first,
/// or over or under it. One direction for all four ends: offsets may turn along an edge, and what is beside at its ends may cross in between.
double apart_from_wall(const BodyPoint& wall_first, const BodyPoint& wall_last, Vec3 conormal, const BodyPoint& first, const BodyPoint& last) {
  const auto along = [&](Vec3 n) {
    const auto nearest = [&](const BodyPoint& p) { return dot(n, p.position) - std::fabs(dot(n, p.offset)); };
    const auto farthest = [&](const BodyPoint& p) { return dot(n, p.position) + std::fabs(dot(n, p.offset)); };
    return std::min(nearest(first), nearest(last)) - std::max(farthest(wall_first), farthest(wall_last));
  };
  double apart = along(conormal);
  for (const BodyPoint* p : {&first, &last, &wall_first, &wall_last}) {
    const double size = dot(p->offset, p->offset);
    if (!(size > 0)) continue;
    const Vec3 up = (1 / std::sqrt(size)) * p->offset;
    apart = std::max({apart, along(up), along(-up)});
    if (p == &first || p == &last) apart = std::max(apart, along(normalized(conormal - dot(conormal, up) * up)));
  }
  return apart;
}

/// How far all of edge h is beside the walls at edge g: the farthest.
double edge_beside_walls(const BodyView& a, H h, const BodyView& b, H g) {
  const BodyPoint first = vertex_point(a, a.surface.from(h)), last = vertex_point(a, a.surface.to(h));
  if (b.surface.cut[g] != 0)
    return apart_from_wall(vertex_point(b, b.surface.from(g)), vertex_point(b, b.surface.to(g)), out_of_rim(b, g), first, last);
  double beside = -HUGE_VAL;
  for (const V v : {b.surface.from(g), b.surface.to(g)})
    if (b.surface.on_cut[v] != 0) beside = std::max(beside, std::min(beside_rim(b, v, first), beside_rim(b, v, last)));
  return beside;
}

/// Rims of two lips, as far as those that cross say what is between them.
struct CrossingRims {
  bool known = false;        ///< they cross in no other way, and have not lost each other
  double apart = -HUGE_VAL;  ///< m where they cross, negative: overlap
};

/// Rims of lips that lie on each other at one end and side by side at the other: the upper rim of one crosses the lower rim of the other. The
/// normal is upright to both; it points out of wall and face of either.
CrossingRims test_rims(const Pair& pair, H h, H g) {
  const ContactSurface& s = pair.a.surface;
  const Vec3 out = out_of_rim(pair.a, h), other_out = out_of_rim(pair.b, g);
  CrossingRims rims;
  if (!(dot(out, other_out) < 0)) return rims;
  rims.known = true;
  for (const double lift : {1.0, -1.0}) {
    const auto corner = [&](const BodyView& body, V v, double l) { return body.position(v) + l * body.offset(v); };
    const Vec3 a = corner(pair.a, s.from(h), lift), b = corner(pair.a, s.to(h), lift);
    const Vec3 c = corner(pair.b, s.from(g), -lift), e = corner(pair.b, s.to(g), -lift);
    SegmentFeet feet;
    if (!inner_feet(a, b, c, e, feet)) continue;
    const Vec3 across = cross(b - a, e - c);
    const double size = norm(across);
    if (!(size > kCrossing * norm(b - a) * norm(e - c))) continue;
    const BodyPoint x = edge_point(pair.a, h, feet.s), y = edge_point(pair.b, g, feet.t);
    Vec3 n = (1 / size) * across;
    if (dot(n, other_out - out) < 0) n = -n;
    const ContactName name{ContactKind::kEdgeEdge, lift > 0 ? 1 : 2, pair.a.index, pair.b.index, 0, h.value, g.value};
    const double gap = dot(n, x.position + lift * x.offset - y.position + lift * y.offset), radius = norm(x.offset);
    // Deep at first sight, they crossed in this step, or the normal is wrong: it has to leave no cone.
    const double off = gap < -kPassed * radius && recall(pair.run, contact_key(name)) == nullptr ? 0 : kOffCone;
    const double over = -lift * dot(n, y.offset), under = -lift * dot(n, x.offset);
    if (!(dot(n, other_out) >= -off && -dot(n, out) >= -off && over >= -off * norm(y.offset) && under >= -off * norm(x.offset)) ||
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
void test_walls(const Pair& pair, H h, H g) {
  for (int k = 1; k < kWallPieces; ++k) {
    const double t = k / static_cast<double>(kWallPieces);
    const BodyPoint x = edge_point(pair.a, h, t);
    const RimEnd rim{out_of_rim_at(pair.a, h, t), {}};
    LipFoot foot;
    offer_lip(pair.b, x, rim, g, foot);
    if (!foot.edge.valid() || !(foot.t > 0 && foot.t < 1)) continue;  // what is nearest to a corner is that one's business
    const auto name = [&](int end) { return ContactName{ContactKind::kWall, 2 * k + end, pair.a.index, pair.b.index, 0, h.value, g.value}; };
    const std::array<LipEnd, 2> ends{lip_end(pair.b, x, rim, foot, 0), lip_end(pair.b, x, rim, foot, 1)};
    const double gap = std::min(ends[0].gap, ends[1].gap), radius = norm(x.offset);
    const bool was = recall(pair.run, contact_key(name(0))) != nullptr || recall(pair.run, contact_key(name(1))) != nullptr;
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
bool are_side_by_side(const Pair& pair, H h, const BodyPoint& x, H g, const BodyPoint& y) {
  const double travel = norm(x.travel - y.travel);
  if (!(travel < kHardly * norm(x.offset))) return false;
  return (pair.b.surface.cut[g] != 0 && beside_wall(y, out_of_rim(pair.b, g), x) > travel) ||
         (pair.a.surface.cut[h] != 0 && beside_wall(x, out_of_rim(pair.a, h), y) > travel);
}

void test_edges(const Pair& pair, H h, H g, double reach) {
  const ContactSurface &s = pair.a.surface, &o = pair.b.surface;
  const V p = s.from(h), q = s.to(h), u = o.from(g), w = o.to(g);
  if (pair.self && (p == u || p == w || q == u || q == w)) return;
  const Vec3 a = pair.a.position(p), b = pair.a.position(q), c = pair.b.position(u), e = pair.b.position(w);
  const CrossingRims rims = pair.self && s.cut[h] != 0 && o.cut[g] != 0 ? test_rims(pair, h, g) : CrossingRims();
  if (pair.self && s.cut[h] != 0 && o.cut[g] != 0 && twist_of(pair.a, h) + twist_of(pair.b, g) > kTwisted * norm(pair.a.offset(p))) {
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
    const int relation = are_strangers(s, p, ContactSurface::face(g)) ? 0 : rest_relation(s, h, g, pair.run.scratch.neighbours);
    if (relation > 0) return;
    if (rims.known && are_side_by_side(pair, h, x, g, y)) return;
    const double walls = std::max({edge_beside_walls(pair.a, h, pair.b, g), edge_beside_walls(pair.b, g, pair.a, h), rims.apart});
    if (relation < 0 || walls > -HUGE_VAL) {
      // Of two rims all directions are known in which they might have passed each other.
      if (r == nullptr && gap < -(s.cut[h] != 0 && o.cut[g] != 0 ? kLostRims : kPassed) * norm(x.offset)) return;
      if (walls - (r != nullptr ? kStay * norm(x.offset) : 0) > gap) return;
    }
  }
  hand_out_pair(pair.run, name, x, over > 0 ? -1 : 1, y, under > 0 ? 1 : -1, n, -1);
}

void list_edges(const BodyView& body, std::uint32_t leaf, LeafEdges& list) {
  const auto& points = body.frame.boxes.points;
  list.list(leaf, [&](auto&& add) {
    body.surface.tree.for_each_triangle(leaf, [&](F f) {
      for (int i = 0; i < 3; ++i) {
        const H h = ContactSurface::corner(f, i);
        if (!body.surface.owns_edge(h) || !is_coarse(body.surface, h)) continue;
        const TreeCorner &a = points[body.surface.from(h).index()], &b = points[body.surface.to(h).index()];
        add(h.value, joined({a, a}, {b, b}));
        list.set_last(a, b, body.surface.from(h).value, body.surface.to(h).value, body.surface.cut[h] != 0, leaf);
      }
    });
  });
}

/// Calls visit(edge of the other leaf, which comes near) for all of them that edge `i` has to do with and that select(list, number of a block, bits)
/// leaves of those that are near.
template <class Select, class Visit>
void for_each_edge(const Pair& pair, std::uint32_t i, const LeafPair& leaves, float reach, Select&& select, Visit&& visit) {
  const auto [leaf, other] = leaves;
  LeafEdges &mine = pair.run.scratch.leaf_edges, &others = pair.self ? mine : pair.run.scratch.other_leaf_edges;
  const TreeBox box = mine.box[i];
  list_edges(pair.b, other, others);
  const std::uint32_t first = leaf == other && pair.self ? i + 1 : 0;  // of one leaf with itself, each pair once
  const auto chosen = [&](std::uint32_t block) {
    const unsigned bits = near_box(others.block[block], box, reach);
    return bits == 0 ? 0 : select(others, block, bits);
  };
  others.for_each(other, chosen, [&](std::uint32_t k) {
    if (k >= first) visit(H(others.item[k]));
  });
}

/// Towards leaves that come later in their order.
std::span<const LeafPair> edge_pairs(const Pair& pair, std::uint32_t i, const LeafGroup& group, double approach) {
  if (pair.quiet == nullptr) return group.pairs;
  const H h(pair.run.scratch.leaf_edges.item[i]);
  const double reach = 2 * pair.a.frame.greatest_offset + quiet_skin(pair.a) + 2 * pair.a.frame.boxes.slack;
  return pairs_to_test(pair, group, approach, pair.quiet->edge[h.index()], [&](const LeafPair& leaves, double limit, double most) {
    const auto far = static_cast<float>(reach + limit);
    if (leaves[1] < leaves[0] || !near(pair.run.scratch.leaf_edges.box[i], pair.b.frame.boxes.box[leaves[1]], far)) return most;
    const bool together = hang_together(pair.a.surface, leaves[0], leaves[1]);
    const auto all = [](const LeafEdges&, std::uint32_t, unsigned near) { return near; };
    for_each_edge(pair, i, leaves, far, all, [&](H g) {
      if (most > 0) most = quiet_edges(pair.a, h, g, together, limit, most, pair.run.scratch.neighbours);
    });
    return most;
  });
}

/// So few leaves are not worth looking at eight at a time.
constexpr std::size_t kFewLeaves = 3;

/// A coarse edge against those of other leaves.
void search_edge(const Pair& pair, std::uint32_t i, const LeafGroup& group, std::span<const LeafPair> some, double reach, double approach) {
  const double slack = pair.a.frame.boxes.slack + pair.b.frame.boxes.slack;
  const auto r = static_cast<float>(reach + slack), limit = static_cast<float>(approach + slack);
  const H h(pair.run.scratch.leaf_edges.item[i]);
  const TreeBox box = pair.run.scratch.leaf_edges.box[i];
  const V from = pair.a.surface.from(h), to = pair.a.surface.to(h);
  const auto& points = pair.a.frame.boxes.points;
  SegmentProbe probe{points[from.index()], points[to.index()], -1, -1, static_cast<float>(slack)};
  if (pair.self) probe.from = from.value, probe.to = to.value;
  const bool rim = pair.self && pair.a.surface.cut[h] != 0;
  const TreeBox& directions = pair.a.frame.directions[group.pairs[0][0]];
  const auto search_leaf = [&](const LeafPair& leaves, bool test) {
    if (!test || (pair.self && leaves[1] < leaves[0])) return;
    const TreeBox& other_directions = pair.b.frame.directions[leaves[1]];
    const bool neighbours = pair.self && hang_together(pair.a.surface, leaves[0], leaves[1]);
    const auto select = [&](const LeafEdges& others, std::uint32_t block, unsigned near) {
      const SegmentBlock& ends = others.ends[block];
      const unsigned bits = near & (may_have_inner_feet(ends, probe) | (rim ? ends.rims : 0));
      return bits == 0 ? 0 : bits & not_side_by_side(box, directions, others.block[block], other_directions, limit);
    };
    for_each_edge(pair, i, leaves, r, select, [&](H g) {
      if (!neighbours || !are_clear_neighbours(pair.a.surface, h, g)) test_edges(pair, h, g, reach);
    });
  };
  if (some.size() > kFewLeaves) {
    for_each_near_leaf(pair, group, some, [&](const LeafBlock& leaves) { return leaves_near_box(leaves, box, directions, r, limit); }, search_leaf);
  } else {
    for (const LeafPair& leaves : some)
      if (near(box, pair.b.frame.boxes.box[leaves[1]], r)) search_leaf(leaves, true);
  }
}

void search_edges(const Pair& pair, double reach, double approach) {
  LeafEdges &mine = pair.run.scratch.leaf_edges, &others = pair.self ? mine : pair.run.scratch.other_leaf_edges;
  mine.clear(pair.a.surface.tree.nodes.size());
  others.clear(pair.b.surface.tree.nodes.size());
  for_each_group(pair, [&](const LeafGroup& group) {
    const std::uint32_t leaf = group.pairs[0][0];
    list_edges(pair.a, leaf, mine);
    if (pair.quiet != nullptr)
      for (std::uint32_t i = mine.leaf[leaf].begin; i < mine.leaf[leaf].end; ++i) __builtin_prefetch(&pair.quiet->edge[H(mine.item[i]).index()]);
    for (std::uint32_t i = mine.leaf[leaf].begin; i < mine.leaf[leaf].end; ++i) {
      const H h(mine.item[i]);
      const std::span<const LeafPair> some = edge_pairs(pair, i, group, approach);
      if (some.empty()) continue;
      const std::size_t before = pair.run.scratch.found.size();
      search_edge(pair, i, group, some, reach, approach);
      if (pair.quiet != nullptr) pair.quiet->edge[h.index()].touched = pair.run.scratch.found.size() > before ? 1 : 0;
    }
  });
}

}  // namespace

void detect_bodies(DetectRun& run, std::int32_t first, std::int32_t second) {
  const BodyView a = view(run, first), b = view(run, second);
  const bool self = first == second;
  const double sway_a = self ? a.frame.greatest_sway : a.frame.greatest_travel;
  const double sway_b = self ? sway_a : b.frame.greatest_travel;
  const double reach = a.frame.greatest_offset + b.frame.greatest_offset + run.margin + kApproach * (sway_a + sway_b);
  const double approach = run.margin + kApproach * (sway_a + sway_b);
  find_leaf_pairs(a, b, reach, approach, run.scratch);
  const Strayed* strayed = self ? run.options.strayed : nullptr;
  if (strayed != nullptr) leave_out_foreseen(a, *strayed, kForeseen * run.margin, run.scratch);
  QuietBody* quiet = self && strayed == nullptr ? &run.scratch.quiet[static_cast<std::size_t>(first)] : nullptr;
  if (quiet != nullptr) follow_body(a, run.scratch.leaf_pairs, run.before, *quiet);
  std::array<std::array<LipEnd, 2>, 2> lip_ends;
  const Pair pair{run, a, b, self, sway_b, quiet, lip_ends};
  if (run.scratch.leaf_pairs.empty()) return;
  search_vertices(pair);
  search_edges(pair, reach, approach);
  if (self) return;
  for (auto& [leaf, other] : run.scratch.leaf_pairs) std::swap(leaf, other);
  std::sort(run.scratch.leaf_pairs.begin(), run.scratch.leaf_pairs.end(), by_first);
  search_vertices({run, b, a, false, sway_a, nullptr, lip_ends});
}

}  // namespace kerf
