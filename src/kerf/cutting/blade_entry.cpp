#include "kerf/cutting/blade_entry.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "kerf/cutting/blade_track.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

constexpr double kMargin = 1e-9;        // of the coordinates: rounding of distances to the strip
constexpr double kMoments = 1e7;        // parts of a move that count as different times
constexpr double kLeastRise = 1e-6;     // cosine: an edge of the mesh stands out towards the blade
constexpr double kAcrossLip = 0.1;      // sine of the angle to a lip; a blade that moves along it doesn't cut it
constexpr double kNearLip = 0.1;        // of the mean edge: nearer to a lip the blade stands in the slit, not in the material
constexpr double kNearFront = 0.3;      // of the mean edge: what meets a lip so near to a front is cut by that front
constexpr double kOnwards = 0.7;         // cosine: a blade that goes so straight on from the end of a slit lengthens it
constexpr double kSlitEnd = 1.5 * std::numbers::pi;  // rad; a border vertex with more material around it is where a slit ends
constexpr double kMissed = 0.5;         // mean edges that material may have come towards the blade since its last pose

class EntrySearch {
 public:
  explicit EntrySearch(const BladeMove& move) : move_(move) {}

  /// Everything the blade runs into during this move, first things first.
  std::vector<BladeEntry> run() const {
    const BladeEdge &from = move_.from, &to = move_.to;
    std::vector<BladeEntry> entries;
    for_each_near({from.base, from.tip, to.base, to.tip}, [&](F face) {
      const H h0 = CollisionMesh::corner(face, 0);
      const Vec3 p[3] = {at(mesh().from(h0)), at(mesh().to(h0)), at(mesh().apex(h0))};
      // An end of the edge, or the edge as it stood at first, goes through the face: a stab.
      const std::pair<Vec3, Vec3> tracks[3] = {{from.tip, to.tip}, {from.base, to.base}, {from.base, from.tip}};
      for (int k = 0; k < 3; ++k) {
        double t = 0;
        FacePoint point;
        if (!pierce(face, p, tracks[k].first, tracks[k].second, t, point)) continue;
        // Where the edge stands already is mostly where a front of its own is, before what is provisional was rolled back.
        if (k == 2 && !move_.standing && in_a_slit(face, point)) continue;
        const double time = k == 2 ? 0 : t;
        entries.push_back({time, k == 2 ? t : k == 0 ? 1.0 : 0.0, point, lerp(tracks[k].first, tracks[k].second, t), k == 2, {}});
        if (k == 2) entries.back().ways = ways_along(p, from);
      }
      for (int k = 0; k < 3; ++k) {
        const H h = CollisionMesh::corner(face, k);
        if (mesh().is_border(h) || h < mesh().twin[h]) meet_edge(h, from, to, entries);
        if (mesh().on_border(mesh().from(h))) meet_slit_end(h, entries);
      }
    });
    // Layers met at the same moment but for rounding: the one nearer to the base is the first.
    std::stable_sort(entries.begin(), entries.end(), [](const BladeEntry& a, const BladeEntry& b) {
      const auto ta = std::llround(a.time * kMoments), tb = std::llround(b.time * kMoments);
      return ta != tb ? ta < tb : a.depth < b.depth;
    });
    if (!move_.standing && std::any_of(entries.begin(), entries.end(), [](const BladeEntry& e) { return e.standing; })) add_missed(entries);
    return entries;
  }

 private:
  const CollisionMesh& mesh() const { return move_.complex.collision; }
  Vec3 at(V v) const { return move_.position[v.index()]; }

  /// Calls fn(face) for the faces near a strip, base and tip of its first edge, then of its last, by rising number.
  template <class Fn>
  void for_each_near(const std::array<Vec3, 4>& strip, Fn&& fn) const {
    Box3 box;
    // The strip is nearly flat: most faces that its box meets lie on one side of it.
    const Vec3 flat = cross(strip[1] + strip[3] - strip[0] - strip[2], strip[2] + strip[3] - strip[0] - strip[1]);
    const Vec3 normal = norm(flat) > 0 ? normalized(flat) : Vec3{};
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (const Vec3 p : strip) {
      box.add(p);
      least = std::min(least, dot(normal, p));
      most = std::max(most, dot(normal, p));
    }
    const double margin = kMargin * (norm(box.min) + norm(box.max));
    box.min -= Vec3{margin, margin, margin};
    box.max += Vec3{margin, margin, margin};
    const auto meets = [&](const Box3& b) {
      if (!boxes_meet(b, box)) return false;
      const double middle = 0.5 * dot(normal, b.min + b.max);
      const Vec3 size = b.max - b.min;
      const double reach = 0.5 * (std::abs(normal.x) * size.x + std::abs(normal.y) * size.y + std::abs(normal.z) * size.z) + margin;
      return middle + reach >= least && middle - reach <= most;
    };
    move_.boxes.for_each(meets, [&](F face) {
      Box3 of_face;
      for (int k = 0; k < 3; ++k) of_face.add(at(mesh().from(CollisionMesh::corner(face, k))));
      if (meets(of_face)) fn(face);
    });
  }

  /// Where an edge of the mesh goes through the strip that the blade sweeps, and the track begins there: at a border whose face lies ahead,
  /// or along the blade; at an inner edge with both its faces ahead.
  void meet_edge(H h, const BladeEdge& from, const BladeEdge& to, std::vector<BladeEntry>& entries) const {
    const Vec3 a = at(mesh().from(h)), b = at(mesh().to(h));
    const Vec3 strip[2][3] = {{from.base, from.tip, to.tip}, {from.base, to.tip, to.base}};
    for (const auto& triangle : strip) {
      double f = 0;
      Vec3 bary;
      if (!segment_triangle(a, b, triangle[0], triangle[1], triangle[2], f, bary)) continue;
      BladeEntry e;
      e.time = &triangle == &strip[0] ? bary.z : bary.y + bary.z;
      e.position = lerp(a, b, f);
      const Vec3 base = lerp(from.base, to.base, e.time), along = lerp(from.tip, to.tip, e.time) - base;
      const double along_squared = std::max(dot(along, along), 1e-300);
      e.depth = dot(e.position - base, along) / along_squared;
      Vec3 motion = lerp(to.base - from.base, to.tip - from.tip, e.depth);
      motion -= (dot(motion, along) / along_squared) * along;
      const Vec3 across = cross(along, motion);
      if (is_lip(mesh(), h) && std::abs(dot(b - a, across)) < kAcrossLip * norm(b - a) * norm(across)) continue;
      if (is_lip(mesh(), h) && near_front(e.position)) continue;
      const auto way = way_into(h, along, motion);
      if (!way) continue;
      e.ways[0] = *way;
      double progress = dot(*way, motion);
      if (mesh().is_border(h)) {
        if (!(progress > -kLeastProgress * norm(motion))) continue;
      } else {
        const auto other = way_into(mesh().twin[h], along, motion);
        if (!other) continue;
        e.ways[1] = *other;
        const double steeper = std::max(progress, dot(*other, motion));
        progress = std::min(progress, dot(*other, motion));
        // One of them may be level: the edge of the mesh is where a plateau ends.
        if (!(progress > -kLeastRise * norm(motion) && steeper > kLeastRise * norm(motion))) continue;
        if (!move_.through) {  // the first layer from the base; a sheet that the blade lies along is one layer
          if (dot(e.ways[1] - e.ways[0], along) < 0) std::swap(e.ways[0], e.ways[1]);
          if (steeper > kFlat * norm(motion)) e.ways[1] = {};
        }
      }
      e.point.face = mesh().face(h);
      e.point.weights = {0, 0, 0};
      e.point.weights[static_cast<std::size_t>(h.value % 3)] = 1 - f;
      e.point.weights[static_cast<std::size_t>((h.value + 1) % 3)] = f;
      entries.push_back(e);
    }
  }
  /// The end of a slit, where h begins: a blade that has gone through the slit without a front, because a stroke before cut it, goes on from
  /// there. Lips that it moves along are no entries, and the rim is cut already.
  void meet_slit_end(H h, std::vector<BladeEntry>& entries) const {
    const V v = mesh().from(h);
    const BladeEdge &from = move_.from, &to = move_.to;
    const SlitCorner slit = slit_at(mesh(), move_.position, v);
    if (!slit.ends() || near_front(at(v))) return;
    if (std::any_of(entries.begin(), entries.end(), [&](const BladeEntry& e) { return e.slit_end && e.position == at(v); })) return;
    BladeEntry e;
    e.slit_end = true;
    e.position = at(v);
    const auto depth_in = [&](const BladeEdge& edge) {
      return dot(e.position - edge.base, edge.tip - edge.base) / std::max(dot(edge.tip - edge.base, edge.tip - edge.base), 1e-300);
    };
    const auto ahead = [&](const BladeEdge& edge, Vec3 motion) { return dot(e.position - lerp(edge.base, edge.tip, depth_in(edge)), motion); };
    const Vec3 along = to.tip - to.base;
    Vec3 motion = lerp(to.base - from.base, to.tip - from.tip, depth_in(to));
    motion -= (dot(motion, along) / std::max(dot(along, along), 1e-300)) * along;
    if (!(dot(slit.lips, motion) < -kOnwards * norm(slit.lips) * norm(motion))) return;
    // The material may have brought it past the blade's last pose.
    const double near = kNearLip * move_.complex.mean_root_edge, first = ahead(from, motion), last = ahead(to, motion);
    if (!(first >= -near * norm(motion) && last < 0)) return;
    e.time = std::max(0.0, first / (first - last));
    const BladeEdge there{lerp(from.base, to.base, e.time), lerp(from.tip, to.tip, e.time)};
    e.depth = depth_in(there);
    const Vec3 beside = e.position - lerp(there.base, there.tip, e.depth);
    if (!(e.depth >= 0 && e.depth <= 1 && norm(beside) < near)) return;
    e.ways[0] = -1.0 * normalized(slit.lips);
    e.point.face = mesh().face(h);
    e.point.weights = {0, 0, 0};
    e.point.weights[static_cast<std::size_t>(h.value % 3)] = 1;
    entries.push_back(e);
  }
  /// Along a blade that lies along a face: what it has gone through may lie to both sides. Zero for one that stands upright.
  static std::array<Vec3, 2> ways_along(const Vec3 p[3], const BladeEdge& edge) {
    const Vec3 normal = normalized(cross(p[1] - p[0], p[2] - p[0])), along = normalized(edge.tip - edge.base);
    if (!(std::abs(dot(normal, along)) < kFlat)) return {};
    const Vec3 way = normalized(along - dot(along, normal) * normal);
    return {-1.0 * way, way};
  }
  /// Direction of the track from edge h into its face: where the face's plane meets the strip's.
  std::optional<Vec3> way_into(H h, Vec3 along, Vec3 motion) const {
    const Vec3 a = at(mesh().from(h)), b = at(mesh().to(h)), c = at(mesh().apex(h));
    const Vec3 normal = cross(b - a, c - a), line = cross(cross(along, motion), normal);
    if (!(norm(line) > 0)) return std::nullopt;
    return (dot(line, cross(normal, b - a)) > 0 ? 1 / norm(line) : -1 / norm(line)) * line;
  }

  /// Material has moved onto the standing edge. Where that happened on its length, what lies between the points where the edge goes through
  /// now is cut too: the ridge is looked for a little behind the edge, and its fronts come first.
  void add_missed(std::vector<BladeEntry>& entries) const {
    const Vec3 along = move_.from.tip - move_.from.base;
    Vec3 motion = lerp(move_.to.base, move_.to.tip, 0.5) - lerp(move_.from.base, move_.from.tip, 0.5);
    motion -= (dot(motion, along) / dot(along, along)) * along;
    if (!(norm(motion) > 0)) return;
    const Vec3 back = (kMissed * move_.complex.mean_root_edge / norm(motion)) * motion;
    std::vector<BladeEntry> ridges;
    const BladeEdge behind{move_.from.base - back, move_.from.tip - back};
    for_each_near({behind.base, behind.tip, move_.from.base, move_.from.tip}, [&](F face) {
      for (int k = 0; k < 3; ++k)
        if (const H h = CollisionMesh::corner(face, k); h < mesh().twin[h]) meet_edge(h, behind, move_.from, ridges);
    });
    entries.insert(entries.begin(), ridges.begin(), ridges.end());
  }

  static bool segment_triangle(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c, double& t, Vec3& bary) {
    const int sp = orient3d(a, b, c, p), sq = orient3d(a, b, c, q);
    if ((sp > 0) == (sq > 0)) return false;
    const Vec3 n = cross(b - a, c - a);
    const double hp = std::abs(dot(n, p - a)), hq = std::abs(dot(n, q - a));
    t = hp + hq > 0 ? hp / (hp + hq) : 0.5;
    const Vec3 x = lerp(p, q, t);
    const double n2 = dot(n, n);
    if (!(n2 > 0)) return false;
    const double wa = dot(cross(b - x, c - x), n) / n2, wb = dot(cross(c - x, a - x), n) / n2;
    const double wc = 1 - wa - wb;
    if (wa < -1e-12 || wb < -1e-12 || wc < -1e-12) return false;
    bary = {wa, wb, wc};
    return true;
  }

  /// Is a point of a face so near to a front or a lip that a blade there stands in a slit?
  bool in_a_slit(F face, const FacePoint& point) const {
    const double near = kNearLip * move_.complex.mean_root_edge;
    Vec3 x;
    for (int i = 0; i < 3; ++i) x += point.weights[static_cast<std::size_t>(i)] * at(mesh().from(CollisionMesh::corner(face, i)));
    if (near_front(x)) return true;
    for (int i = 0; i < 3; ++i) {
      const H h = CollisionMesh::corner(face, i);
      const Vec3 a = at(mesh().from(h)), edge = at(mesh().to(h)) - a;
      if (std::find(move_.fronts.begin(), move_.fronts.end(), mesh().from(h)) != move_.fronts.end()) return true;
      if (mesh().on_border(mesh().from(h)) && norm(x - a) < near) return true;
      if (mesh().is_border(h) && norm(cross(edge, x - a)) < near * norm(edge)) return true;
    }
    return false;
  }
  bool near_front(Vec3 x) const {
    const double near = kNearFront * move_.complex.mean_root_edge;
    return std::any_of(move_.ends.begin(), move_.ends.end(), [&](Vec3 end) { return norm(end - x) < near; });
  }
  static bool pierce(F face, const Vec3 p[3], Vec3 from, Vec3 to, double& t, FacePoint& point) {
    Vec3 bary;
    if (!segment_triangle(from, to, p[0], p[1], p[2], t, bary)) return false;
    point.face = face;
    point.weights = {std::max(bary.x, 0.0), std::max(bary.y, 0.0), std::max(bary.z, 0.0)};
    const double sum = point.weights[0] + point.weights[1] + point.weights[2];
    for (double& w : point.weights) w /= sum;
    return true;
  }

  const BladeMove& move_;
};

}  // namespace

bool is_lip(const CollisionMesh& mesh, CollisionHalfEdge h) {
  return mesh.is_border(h) && (mesh.wall[h].valid() || !mesh.on_rim(mesh.from(h)) || !mesh.on_rim(mesh.to(h)));
}

bool SlitCorner::turns_back() const { return angle > kSlitEnd; }

SlitCorner slit_at(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex v) {
  SlitCorner slit;
  const Vec3 x = position[v.index()];
  mesh.for_each_outgoing(v, [&](H h) {
    const Vec3 a = normalized(position[mesh.to(h).index()] - x), b = normalized(position[mesh.apex(h).index()] - x);
    slit.angle += std::acos(std::clamp(dot(a, b), -1.0, 1.0));
    if (mesh.is_border(h)) slit.lips += a;
    if (mesh.is_border(CollisionMesh::prev(h))) slit.lips += b;
    slit.cut = slit.cut || is_lip(mesh, h) || is_lip(mesh, CollisionMesh::prev(h));
    return true;
  });
  return slit;
}

std::vector<BladeEntry> find_blade_entries(const BladeMove& move) { return EntrySearch(move).run(); }

}  // namespace kerf
