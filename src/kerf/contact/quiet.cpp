#include "kerf/contact/quiet.h"

#include <algorithm>
#include <cmath>

#include "kerf/contact/detect_scratch.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Skin, and least deformation that is worth remembering, in parts of the greatest half thickness.
constexpr double kSkin = 0.5, kLeast = 2e-3;
/// Things come nearer by at most this part of their distance (twice it, from both sides) while they are quiet.
constexpr double kNearest = 0.25;
constexpr std::uint8_t kMostPatience = 15;
/// Leaves that settle in one call: one, and this part of all. What lies still after a cut is not all found out about in one step.
constexpr std::size_t kSettleAtOnce = 16;
/// Of every pair of leaves, so many vertices and edges are found out about in one call, in the mean: where the body begins to move, what is known of
/// all of it runs out at once.
constexpr std::size_t kBudget = 1;
/// Calls that a pair of leaves is followed after it was near for the last time.
constexpr std::uint32_t kFollow = 64;

/// The corners of a vertex, an edge or a face.
struct Hull {
  std::array<Vec3, 3> position, offset;
  std::size_t count = 0;
  void add(const BodyView& body, V v) {
    position[count] = body.position(v);
    offset[count++] = body.offset(v);
  }
};

/// Four numbers at once, whatever the machine has.
using Four = double __attribute__((vector_size(32)));
double least_of(Four v) { return std::min(std::min(v[0], v[1]), std::min(v[2], v[3])); }
double greatest_of(Four v) { return std::max(std::max(v[0], v[1]), std::max(v[2], v[3])); }
Four greater_of(Four a, Four b) { return a > b ? a : b; }

/// By how much two hulls may deform before a gap between them could be below `limit`; 0: now. thick: both half thicknesses at most.
double quiet_hulls(const Hull& a, const Hull& b, double limit, double thick) {
  // Between all their corners; spare places hold the last one again.
  Four x, y, z;
  int n = 0;
  Vec3 sum, d;
  for (std::size_t i = 0; i < a.count; ++i)
    for (std::size_t k = 0; k < b.count; ++k, ++n) {
      sum += d = a.position[i] - b.position[k];
      x[n] = d.x, y[n] = d.y, z[n] = d.z;
    }
  for (; n < 4; ++n) x[n] = d.x, y[n] = d.y, z[n] = d.z;
  const Four along = sum.x * x + sum.y * y + sum.z * z;
  const double length = norm(sum), least = least_of(along);
  if (!(least > limit * length) || !(least > 0)) return 0;
  const double distance = least / length;
  // A distance d between points of the hulls is a mean of those between corners, and so are o . d and the part of d along the axis, which |d|
  // is no less than: o . d / |d| is at most the greatest of their quotients.
  const Four inverse = length / along;
  const auto greatest_part = [&](const Hull& h) {
    Four most{};
    for (std::size_t k = 0; k < h.count; ++k) {
      const Four part = inverse * (h.offset[k].x * x + h.offset[k].y * y + h.offset[k].z * z);
      most = greater_of(most, greater_of(part, -part));
    }
    return most;
  };
  const Four mine = greatest_part(a), other = greatest_part(b);
  const double spare = distance - std::min(thick, greatest_of(mine) + greatest_of(other)) - limit;
  // Both points move and both offsets turn by as much: d changes by twice that, d / |d| by twice that over the distance left.
  return spare > 0 ? std::min(kNearest * distance, spare * distance / (2 * distance + 2.2 / (1 - kNearest) * thick))
                   : 0;
}

Vec3 lesser(Vec3 a, Vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
Vec3 greater(Vec3 a, Vec3 b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

/// Of a leaf since the last call. Vertices that are new don't count: their leaf has changed.
QuietBody::Motion motion_of(const BodyView& body, std::uint32_t leaf, const QuietBody& quiet) {
  QuietBody::Motion m{{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, 0};
  body.surface.tree.for_each_triangle(leaf, [&](F f) {
    for (const V v : body.surface.vertices(f)) {
      const std::size_t i = v.index();
      if (i >= quiet.position.size()) continue;
      const Vec3 d = body.state.position[i] - quiet.position[i], o = body.state.offset[i] - quiet.offset[i];
      m.least = lesser(m.least, d);
      m.most = greater(m.most, d);
      m.turn = std::max(m.turn, dot(o, o));
    }
  });
  m.turn = std::sqrt(m.turn);
  return m.least.x <= m.most.x ? m : QuietBody::Motion{};
}

/// Nothing is known of a leaf any more.
void forget(const BodyView& body, std::uint32_t leaf, QuietBody& quiet) {
  quiet.has_rim[leaf] = 0;
  body.surface.tree.for_each_triangle(leaf, [&](F f) {
    for (int i = 0; i < 3; ++i) {
      const H h = ContactSurface::corner(f, i);
      if (body.surface.cut[h] != 0) quiet.has_rim[leaf] = 1;
      quiet.vertex[body.surface.from(h).index()] = quiet.edge[h.index()] = {};
    }
  });
}

/// `pairs` join what is followed; afterwards quiet.fresh says what is new.
void follow_pairs(std::span<const LeafPair> pairs, QuietBody& quiet) {
  quiet.fresh.clear();
  quiet.merged.clear();
  const auto follow = [&](const LeafPair& leaves, std::uint32_t absent, bool known) {
    quiet.merged.push_back({leaves, absent});
    const std::uint8_t calm = quiet.calm[leaves[1]];
    quiet.fresh.push_back(calm == QuietBody::kSettled || (calm > QuietBody::kSettled && !known) ? 1 : 0);
  };
  auto old = quiet.followed.begin();
  const auto follow_before = [&](const LeafPair* next) {
    for (; old != quiet.followed.end() && (next == nullptr || by_first(old->leaves, *next)); ++old)
      if (old->absent < kFollow) follow(old->leaves, old->absent + 1, true);
  };
  for (const LeafPair& leaves : pairs) {
    follow_before(&leaves);
    const bool known = old != quiet.followed.end() && old->leaves == leaves;
    if (known) ++old;
    follow(leaves, 0, known);
  }
  follow_before(nullptr);
  std::swap(quiet.merged, quiet.followed);
}

/// What leaves and their partners have done since the last call, as far as they have settled.
void measure_motion(const BodyView& body, QuietBody& quiet) {
  const auto& pairs = quiet.followed;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (const std::uint32_t leaf = pairs[i].leaves[0];
        quiet.settled(leaf) && (i == 0 || leaf != pairs[i - 1].leaves[0]))
      quiet.motion[leaf] = motion_of(body, leaf, quiet);
  for (std::size_t i = 0; i < pairs.size();) {
    const std::uint32_t leaf = pairs[i].leaves[0];
    QuietBody::Motion all = quiet.motion[leaf];
    for (; i < pairs.size() && pairs[i].leaves[0] == leaf; ++i) {
      if (!quiet.settled(leaf) || !quiet.settled(pairs[i].leaves[1])) continue;
      const QuietBody::Motion& other = quiet.motion[pairs[i].leaves[1]];
      all = {lesser(all.least, other.least), greater(all.most, other.most), std::max(all.turn, other.turn)};
    }
    if (quiet.settled(leaf)) quiet.moved[leaf] += 0.5 * norm(all.most - all.least) + all.turn;
  }
}

/// The same but for gaps, which quiet places have none of.
bool same_contact(const RememberedContact& a, const RememberedContact& b) {
  return a.key == b.key && a.normal == b.normal && a.feature == b.feature;
}

}  // namespace

double quiet_skin(const BodyView& body) { return kSkin * body.frame.greatest_offset; }

void follow_body(const BodyView& body, std::span<const LeafPair> pairs, const DetectMemory& before, QuietBody& quiet) {
  const ContactSurface& s = body.surface;
  quiet.moved.resize(s.tree.nodes.size(), 0);
  quiet.motion.resize(s.tree.nodes.size());
  quiet.has_rim.resize(s.tree.nodes.size(), 0);
  const bool all_changed = quiet.changes.size() != s.node_changes.size();
  quiet.changes.resize(s.node_changes.size());
  // A memory that is not its own comes when a step is taken again, in parts or with other positions: not for long.
  const bool known = std::equal(quiet.memory.begin(), quiet.memory.end(), before.contacts.begin(),
                                before.contacts.end(), same_contact);
  const auto changed = [&](std::uint32_t leaf) { return all_changed || quiet.changes[leaf] != s.node_changes[leaf]; };
  quiet.calm.resize(s.tree.nodes.size(), 0);
  std::size_t may_settle = 1 + s.tree.nodes.size() / (2 * kSettleAtOnce);
  for (std::uint32_t n = 0; n < s.tree.nodes.size(); ++n) {
    if (s.tree.nodes[n].count == 0) continue;
    std::uint8_t& calm = quiet.calm[n];
    if (!known || changed(n)) calm = 0;
    else if (calm == QuietBody::kSettled - 1 ? may_settle > 0 : calm <= QuietBody::kSettled) ++calm;
    if (calm == QuietBody::kSettled) --may_settle;
  }
  follow_pairs(pairs, quiet);
  quiet.budget = kBudget * quiet.followed.size();
  measure_motion(body, quiet);
  quiet.position.assign(body.state.position.begin(), body.state.position.end());
  quiet.offset.assign(body.state.offset.begin(), body.state.offset.end());
  quiet.vertex.resize(s.vertex_count());
  quiet.edge.resize(s.origin.size());

  if (!known) {
    std::fill(quiet.vertex.begin(), quiet.vertex.end(), QuietUntil{});
    std::fill(quiet.edge.begin(), quiet.edge.end(), QuietUntil{});
  }
  for (std::uint32_t n = 0; n < s.tree.nodes.size(); ++n)
    if (s.tree.nodes[n].count > 0 && changed(n)) forget(body, n, quiet);
  std::copy(s.node_changes.begin(), s.node_changes.end(), quiet.changes.begin());
}

bool may_be_quiet(QuietUntil& it) {
  if (it.touched != 0) return false;
  if (it.patience == 0) return true;
  --it.patience;
  return false;
}

void give_up(QuietUntil& it) {
  it.moved = -1;
  it.failures = std::min<std::uint8_t>(kMostPatience, static_cast<std::uint8_t>(2 * it.failures + 1));
  it.patience = it.failures;
}

double quiet_vertex(const BodyView& body, V v, const LeafPair& leaves, double limit, double most,
                    NeighbourSearch& neighbours) {
  const ContactSurface& s = body.surface;
  const TreeBoxes& boxes = body.frame.boxes;
  const double thick = body.frame.thickness[v.index()] + body.frame.greatest_offset;
  const double far = thick + limit + quiet_skin(body) + 2 * boxes.slack, least = kLeast * body.frame.greatest_offset;
  const auto square = static_cast<float>(far * far);
  const TreeCorner p = boxes.points[v.index()];
  if (squared_distance(boxes.box[leaves[1]], p) > square) return most;
  Hull mine;
  mine.add(body, v);
  const bool together = hang_together(s, leaves[0], leaves[1]);
  if (!together) find_neighbours(s, v, neighbours);
  s.tree.for_each_triangle(leaves[1], [&](F f) {
    const auto c = s.vertices(f);
    if (!(most > 0) || c[0] == v || c[1] == v || c[2] == v ||
        (together ? is_clear_neighbour(s, v, f) : is_neighbour(neighbours, f)))
      return;
    const TreeCorner &x = boxes.points[c[0].index()], &y = boxes.points[c[1].index()], &z = boxes.points[c[2].index()];
    if (squared_distance(joined(joined({x, x}, {y, y}), {z, z}), p) > square) return;
    Hull face;
    for (const V w : c) face.add(body, w);
    const double here = quiet_hulls(mine, face, limit, thick);
    if (here < most && !(together && rest_distance(s, v, f) <= neighbour_distance(s, v, f)))
      most = here < least ? 0 : here;
  });
  return most;
}

double quiet_edges(const BodyView& body, H h, H g, bool hang_together, double limit, double most,
                   NeighbourSearch& neighbours) {
  const ContactSurface& s = body.surface;
  if (s.from(h) == s.from(g) || s.from(h) == s.to(g) || s.to(h) == s.from(g) || s.to(h) == s.to(g)) return most;
  if (hang_together && are_clear_neighbours(s, h, g)) return most;
  Hull one, other;
  for (const V v : {s.from(h), s.to(h)}) one.add(body, v);
  for (const V v : {s.from(g), s.to(g)}) other.add(body, v);
  const double here = quiet_hulls(one, other, limit, 2 * body.frame.greatest_offset);
  if (!(here < most) || rest_relation(s, h, g, neighbours) > 0) return most;
  return here < kLeast * body.frame.greatest_offset ? 0 : here;
}

}  // namespace kerf
