#include "kerf/cutting/drawn_curve.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/journal.h"
#include "kerf/cutting/free_list.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/cutting/visual_walk.h"

namespace kerf::cut {

namespace {

using H = CollisionHalfEdge;
using VV = VisualVertex;

/// A chord in the plane of its root, + side; local coordinates: metres along it, metres to its left.
class Chord {
 public:
  Chord(const CollisionMesh& mesh, H h) : p_(mesh.planar[h]) {
    const Vec2 d = mesh.planar[CollisionMesh::next(h)] - p_;
    length_ = norm(d);
    x_ = (1 / length_) * d;
    left_ = local(mesh.planar[CollisionMesh::prev(h)]);
    right_ = local(mesh.planar[CollisionMesh::prev(mesh.twin[h])]);
  }
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] Vec2 local(Vec2 u) const { return {dot(x_, u - p_), cross(x_, u - p_)}; }
  [[nodiscard]] Vec2 planar(Vec2 q) const { return p_ + q.x * x_ + q.y * Vec2{-x_.y, x_.x}; }
  /// The border of the faces beside the chord, to the left (> 0) and to the right (< 0) of a place on it.
  [[nodiscard]] double room(bool to_left, double x) const {
    const Vec2 apex = to_left ? left_ : right_;
    const double up = apex.x > 0 ? x / apex.x : HUGE_VAL, down = apex.x < length_ ? (length_ - x) / (length_ - apex.x) : HUGE_VAL;
    return apex.y * std::min({up, down});
  }

 private:
  Vec2 p_, x_, left_, right_;
  double length_;
};

/// Height of a polyline of rising x.
double height(std::span<const Vec2> line, double x) {
  const auto after = std::lower_bound(line.begin(), line.end(), x, [](Vec2 q, double at) { return q.x < at; });
  if (after == line.begin()) return line.front().y;
  if (after == line.end()) return line.back().y;
  const Vec2 a = after[-1], b = *after;
  return a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x);
}

/// 1 at x = 0, 0 at x = 1, level at both.
double fade(double x) { return 1 - x * x * (3 - 2 * x); }

/// Where a polyline comes nearest to a point: `at` counts its points.
struct Foot {
  double at = -1, distance = HUGE_VAL, height = 0;
};
Foot foot_of(std::span<const Vec2> line, Vec2 p, double from) {
  Foot best;
  for (std::size_t i = static_cast<std::size_t>(from); i + 1 < line.size(); ++i) {
    const Vec2 a = line[i], d = line[i + 1] - a;
    const double t = std::clamp(dot(p - a, d) / std::max(dot(d, d), 1e-300), std::max(0.0, from - static_cast<double>(i)), 1.0);
    const Vec2 q = a + t * d;
    if (const double far = norm(q - p); far < best.distance) best = {static_cast<double>(i) + t, far, q.y};
  }
  return best;
}

/// Leaves out what lies within `tolerance` of the line through what stays: Ramer, Douglas and Peucker. Recursive.
void keep_what_shows(std::span<const Vec2> line, double tolerance, std::vector<Vec2>& kept) {
  if (line.size() < 3) return;
  const Vec2 a = line.front(), d = line.back() - a;
  const double length = std::max(norm(d), 1e-300);
  std::size_t farthest = 0;
  double most = tolerance;
  for (std::size_t i = 1; i + 1 < line.size(); ++i)
    if (const double far = std::abs(cross(d, line[i] - a)) / length; far > most) most = far, farthest = i;
  if (farthest == 0) return;
  keep_what_shows(line.first(farthest + 1), tolerance, kept);
  kept.push_back(line[farthest]);
  keep_what_shows(line.subspan(farthest), tolerance, kept);
}

/// A curve on one side of a body, on its way into the visual mesh.
class Curve {
 public:
  Curve(CutContext& cut, H h, Side side)
      : cut_(cut), h_(h), side_(side), s_(static_cast<std::size_t>(index(side))), chord_(cut.body.collision, h),
        patch_(Patch::of_root(cut.body.collision.root[CollisionMesh::face(h)], side)), p_(bound(cut.body.collision.from(h))), q_(bound(cut.body.collision.to(h))) {}

  /// Makes it a path of barrier edges, where it is.
  bool walk() {
    std::vector<VV>& path = scratch().curve_path;
    path.clear();
    VV last = p_;
    for (std::size_t i = 0; i <= scratch().curve.size(); ++i) {
      const VV to = i < scratch().curve.size() ? insert_point(cut_, last, mirrored(chord_.planar(scratch().curve[i]), side_), patch_) : q_;
      if (!to.valid() || !walk_chord(cut_, last, to, patch_)) return false;
      path.insert(path.end(), scratch().path.begin(), scratch().path.end());
      if (to != q_) path.push_back(to);
      last = to;
    }
    scratch().path = path;
    return true;
  }

  /// A triangle between three vertices of the curve would be laid flat: edges that join two of them get a vertex in the middle.
  bool divide_caps() {
    const std::vector<VV>& path = scratch().path;
    const std::size_t last = path.size() + 1;
    const auto vertex = [&](std::size_t i) { return i == 0 ? p_ : i == last ? q_ : path[i - 1]; };
    std::vector<VisualHalfEdge>& joining = scratch().pending;
    joining.clear();
    for (std::size_t i = 1; i <= last; ++i)
      for_each_in_patch(vertex(i), [&](VisualHalfEdge e) {
        const VV to = mesh().to(e);
        if (mesh().barrier[e] || mesh().free[to]) return;
        for (std::size_t k = 0; k < i; ++k)
          if (vertex(k) == to) joining.push_back(e);
      });
    for (const VisualHalfEdge e : joining) {
      const Vec2 u = lerp(mesh().planar[e], mesh().planar[VisualMesh::next(e)], 0.5);
      if (!edge_split_is_sound(mesh(), e, u, u)) return false;
      const VV middle = split_visual_edge(mesh(), e, 0.5, u, u, place_reach(cut_.body));
      mesh().free.set(middle, 1);
      scratch().born_free[s_].push_back(middle);
    }
    return true;
  }

  /// Moves parameters: the curve goes onto the chord, and what lies beside it follows, less the nearer it is to the border of the faces beside the chord.
  bool lay() {
    std::vector<Vec2>& line = scratch().drawn;
    line.assign(1, Vec2{});
    for (const VV v : scratch().path) line.push_back(place(v));
    line.push_back({chord_.length(), 0});
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
      if (!(line[i].x < line[i + 1].x)) return false;
    auto& moved = scratch().moved_parameter;
    moved.clear();
    for (std::size_t i = 0; i < scratch().path.size(); ++i) moved.push_back({scratch().path[i], parameter({line[i + 1].x, 0})});
    const auto follow = [&](VV v) {
      const Vec2 u = place(v);
      if (!mesh().free[v] || !(u.x > 0 && u.x < chord_.length())) return;
      const double y = height(line, u.x), room = chord_.room(u.y > y, u.x);
      if (y != 0) moved.push_back({v, parameter({u.x, (u.y - y) * room / (room - y)})});
    };
    const CollisionMesh& coarse = cut_.body.collision;
    for (const H e : {h_, coarse.twin[h_]}) {
      const PoolRun run = coarse.free[CollisionMesh::face(e)][s_];
      for (std::int32_t i = 0; i < run.count; ++i) follow(cut_.body.free_pool[run.at(i)]);
    }
    for (const VV v : scratch().born_free[s_]) follow(v);

    auto& faces = scratch().laid_face;
    faces.clear();
    const auto area = [&](VisualHalfEdge e) { return orient(mesh().planar[e], mesh().planar[VisualMesh::next(e)], mesh().planar[VisualMesh::prev(e)]); };
    for (const auto& [v, u] : moved) for_each_in_patch(v, [&](VisualHalfEdge e) { faces.push_back({e, area(e)}); });
    for (const auto& [v, u] : moved) for_each_in_patch(v, [&, to = u](VisualHalfEdge e) { mesh().planar.set(e, to); });
    return std::all_of(faces.begin(), faces.end(), [&](const auto& f) { return area(f.corner) > kLaidKeepsArea * f.area; });
  }

  bool walk_chord_instead() { return walk_chord(cut_, p_, q_, patch_); }

 private:
  CutScratch& scratch() { return cut_.scratch; }
  VisualMesh& mesh() { return cut_.body.visual; }
  VV bound(CollisionVertex v) const { return cut_.body.collision.bound[v][s_]; }
  Vec2 place(VV v) { return chord_.local(mirrored(planar_in(mesh(), v, patch_), side_)); }
  Vec2 parameter(Vec2 local) const { return mirrored(chord_.planar(local), side_); }
  template <class Fn>
  void for_each_in_patch(VV v, Fn&& fn) {
    for_each_corner(mesh(), v, [&](VisualHalfEdge e) {
      if (mesh().patch[VisualMesh::face(e)] == patch_) fn(e);
      return true;
    });
  }

  CutContext& cut_;
  H h_;
  Side side_;
  std::size_t s_;
  Chord chord_;
  Patch patch_;
  VV p_, q_;
};

}  // namespace

void find_drawn_curve(CutContext& cut, H h) {
  const CollisionMesh& mesh = cut.body.collision;
  std::vector<Vec2>& curve = cut.scratch.curve;
  std::vector<Vec2>& line = cut.scratch.drawn;
  curve.clear();
  for (auto& born : cut.scratch.born_free) born.clear();
  if (cut.drawn.size() < 2) return;
  const Chord chord(mesh, h);
  const double length = chord.length(), shows = kCurveShows * cut.body.mean_root_edge;
  const double reach = 2 * (cut.options.path_tolerance + cut.options.minimum_feature) * cut.body.mean_root_edge;

  // Planes of roots are isometric to their triangles.
  const Vec3 origin = mesh.rest[mesh.from(h)], along = normalized(mesh.rest[mesh.to(h)] - origin);
  const Vec3 to_left = mesh.rest[mesh.apex(h)] - origin, to_right = mesh.rest[mesh.apex(mesh.twin[h])] - origin;
  const Vec3 side = normalized(cross(cross(along, to_left) - cross(along, to_right), along));
  line.clear();
  for (const Vec3 p : cut.drawn) line.push_back({dot(along, p - origin), dot(side, p - origin)});

  const Foot first = foot_of(line, {}, 0), last = foot_of(line, {length, 0}, std::max(first.at, 0.0));
  if (first.distance > reach || last.distance > reach || last.at <= first.at) return;
  const auto at_end = [&](const Foot& f) { return f.at <= 0 || f.at >= static_cast<double>(line.size() - 1); };
  const double off_first = at_end(first) ? 0 : first.height, off_last = at_end(last) ? 0 : last.height;

  std::vector<Vec2>& all = cut.scratch.curve_all;
  all.assign(1, Vec2{});
  for (auto i = static_cast<std::size_t>(std::floor(first.at)) + 1; static_cast<double>(i) < last.at; ++i)
    if (line[i].x > all.back().x && line[i].x < length) all.push_back(line[i]);
  all.push_back({length, 0});
  all.front().y = off_first;
  all.back().y = off_last;
  // The way back to the vertices is bent: between far points too.
  const bool bends = std::max(std::abs(off_first), std::abs(off_last)) > shows;
  if (bends) {
    line = all;
    for (int i = 1; i < kFadePoints; ++i) {
      const double x = length * i / kFadePoints;
      all.push_back({x, height(line, x)});
    }
    std::sort(all.begin(), all.end(), [](Vec2 a, Vec2 b) { return a.x < b.x; });
    all.erase(std::unique(all.begin(), all.end(), [](Vec2 a, Vec2 b) { return a.x == b.x; }), all.end());
  }
  for (Vec2& q : all) {
    const double x = q.x / length;
    q.y -= off_first * fade(x) + off_last * fade(1 - x);
    q.y = std::clamp(q.y, kCurveRoom * chord.room(false, q.x), kCurveRoom * chord.room(true, q.x));
  }
  all.front().y = all.back().y = 0;
  keep_what_shows(all, shows, curve);
}

bool walk_curve(CutContext& cut, H h, Side side) {
  Curve curve(cut, h, side);
  if (cut.scratch.curve.empty()) return curve.walk_chord_instead();
  JournalMark mark;
  journal_mark(cut.body, mark);
  if (curve.walk() && curve.divide_caps() && curve.lay()) return true;
  journal_rollback(cut.body, mark);
  cut.scratch.born_free[static_cast<std::size_t>(index(side))].clear();
  return curve.walk_chord_instead();
}

void sort_free_beside(CutContext& cut, H h) {
  CellComplex& body = cut.body;
  const CollisionMesh& mesh = body.collision;
  const CollisionTriangle into[2] = {CollisionMesh::face(mesh.twin[h]), CollisionMesh::face(h)};
  const Vec2 p = mesh.planar[h], q = mesh.planar[CollisionMesh::next(h)], corner[2] = {p, q};
  std::array<PoolRun, 2> lists = joined_free_lists(cut, into[0], into[1]);
  for (std::size_t s = 0; s < 2; ++s) {
    const std::vector<VV>& born = cut.scratch.born_free[s];
    if (born.empty()) continue;
    const PoolRun run = lists[s];
    lists[s] = {static_cast<std::int32_t>(body.free_pool.size()), run.count + static_cast<std::int32_t>(born.size()), false};
    for (std::int32_t i = 0; i < run.count; ++i) {
      const VV v = body.free_pool[run.at(i)];
      body.free_pool.push_back(v);
    }
    for (const VV v : born) body.free_pool.push_back(v);
  }
  divide_free_lists(cut, lists, into, 2, p, corner);
}

}  // namespace kerf::cut
