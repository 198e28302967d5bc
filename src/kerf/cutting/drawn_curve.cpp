#include "kerf/cutting/drawn_curve.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/journal.h"
#include "kerf/cutting/free_list.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/rest_point.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/cutting/visual_walk.h"

namespace kerf::cut {

namespace {

using H = CollisionHalfEdge;
using VV = VisualVertex;

/// A chord in the plane of its root, + side; local coordinates: metres along it, metres to its left. What lies beside it, in the faces of scratch.beside, may make
/// way.
class Chord {
 public:
  Chord(const CutContext& cut, H h)
      : cut_(cut), mesh_(cut.body.collision), faces_(cut.scratch.beside), h_(h), p_(mesh_.planar[h]) {
    const Vec2 d = mesh_.planar[CollisionMesh::next(h)] - p_;
    length_ = norm(d);
    x_ = (1 / length_) * d;
  }
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] Vec2 local(Vec2 u) const { return {dot(x_, u - p_), cross(x_, u - p_)}; }
  [[nodiscard]] Vec2 planar(Vec2 q) const { return p_ + q.x * x_ + q.y * Vec2{-x_.y, x_.x}; }

  /// Gathers the faces to both sides that come within `reach` metres of the chord, over edges that own no chain.
  static void gather(CutContext& cut, H h, double reach) {
    const CollisionMesh& mesh = cut.body.collision;
    std::vector<CollisionTriangle>& faces = cut.scratch.beside;
    cut.scratch.beside_reach = reach;
    faces.assign({CollisionMesh::face(h), CollisionMesh::face(mesh.twin[h])});
    const Chord chord(cut, h);
    for (std::size_t i = 0; i < faces.size() && faces.size() < kBesideFaces; ++i)
      for (int k = 0; k < 3; ++k) {
        const H e = CollisionMesh::corner(faces[i], k), t = mesh.twin[e];
        if (e == h || t == h || !t.valid() || mesh.has_chain(e)) continue;
        const CollisionTriangle beyond = CollisionMesh::face(t);
        if (std::find(faces.begin(), faces.end(), beyond) == faces.end() && chord.is_within(e, reach))
          faces.push_back(beyond);
      }
  }
  /// How far what lies to the left (> 0) and to the right (< 0) of a place on the chord may make way.
  [[nodiscard]] double room(bool to_left, double x) const {
    const double most = cut_.scratch.beside_reach;
    H e = to_left ? h_ : mesh_.twin[h_];
    double y = 0;
    for (std::size_t i = 0; i <= faces_.size(); ++i) {
      // Out of the face again over the edge that the line across the chord leaves by.
      const H next = CollisionMesh::next(e), prev = CollisionMesh::prev(e);
      const double apex = local(mesh_.planar[prev]).x;
      H out = (apex < x) == to_left ? next : prev;
      const Vec2 a = local(mesh_.planar[out]), b = local(mesh_.planar[CollisionMesh::next(out)]);
      y = a.x == b.x ? a.y : a.y + (b.y - a.y) * std::clamp((x - a.x) / (b.x - a.x), 0.0, 1.0);
      e = mesh_.twin[out];
      if (!e.valid() || mesh_.has_chain(out) ||
          std::find(faces_.begin(), faces_.end(), CollisionMesh::face(e)) == faces_.end() || std::abs(y) > most)
        break;
    }
    // At the chord's ends rounding may put what is left of it on its right.
    return to_left ? std::clamp(y, 0.0, most) : std::clamp(y, -most, 0.0);
  }

 private:
  /// Does an edge come so near to the chord, seen across it?
  [[nodiscard]] bool is_within(H e, double reach) const {
    Vec2 a = local(mesh_.planar[e]), b = local(mesh_.planar[CollisionMesh::next(e)]);
    if (a.x > b.x) std::swap(a, b);
    if (b.x <= 0 || a.x >= length_) return false;
    const auto y = [&](double x) {
      return a.x == b.x ? std::min(std::abs(a.y), std::abs(b.y))
                        : std::abs(a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x));
    };
    return std::min(y(std::max(a.x, 0.0)), y(std::min(b.x, length_))) < reach;
  }

  const CutContext& cut_;
  const CollisionMesh& mesh_;
  const std::vector<CollisionTriangle>& faces_;
  H h_;
  Vec2 p_, x_;
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
    const double t =
        std::clamp(dot(p - a, d) / std::max(dot(d, d), 1e-300), std::max(0.0, from - static_cast<double>(i)), 1.0);
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
      : cut_(cut), h_(h), side_(side), s_(static_cast<std::size_t>(index(side))), chord_(cut, h),
        patch_(Patch::of_root(cut.body.collision.root[CollisionMesh::face(h)], side)),
        p_(bound(cut.body.collision.from(h))), q_(bound(cut.body.collision.to(h))) {}

  /// Makes it a path of barrier edges, where it is.
  bool walk() {
    std::vector<VV>& path = scratch().curve_path;
    path.clear();
    VV last = p_;
    for (std::size_t i = 0; i <= scratch().curve.size(); ++i) {
      const VV to = i < scratch().curve.size()
                        ? insert_point(cut_, last, mirrored(chord_.planar(scratch().curve[i]), side_), patch_)
                        : q_;
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
    return std::all_of(joining.begin(), joining.end(), [&](VisualHalfEdge e) { return divide(e); });
  }

  /// Puts free vertices that have come into another face into its list.
  bool sort() {
    CellComplex& body = cut_.body;
    const std::vector<CollisionTriangle>& beside = scratch().beside;
    for (const auto& m : scratch().moved_parameter) {
      if (!m.face.valid()) continue;
      const auto holds = [&, u = mirrored(m.to, side_)](CollisionTriangle f) {
        for (int k = 0; k < 3; ++k)
          if (orient(body.collision.planar[CollisionMesh::corner(f, k)],
                     body.collision.planar[CollisionMesh::corner(f, (k + 1) % 3)], u) < 0)
            return false;
        return true;
      };
      if (holds(m.face)) continue;
      const auto to = std::find_if(beside.begin(), beside.end(), holds);
      if (to == beside.end()) return false;
      std::array<PoolRun, 2> lists = body.collision.free[m.face];
      PoolRun& run = lists[s_];
      std::int32_t i = 0;
      while (body.free_pool[run.at(i)] != m.vertex) ++i;
      const VV last = body.free_pool[run.at(--run.count)];
      body.free_pool.set(run.at(i), last);
      body.collision.free.set(m.face, lists);
      add_free(cut_, *to, side_, m.vertex);
    }
    return true;
  }

  /// Lays the curve onto the chord. Triangles too long to follow are divided.
  bool lay() {
    for (int round = 0; round < kLayRounds; ++round) {
      JournalMark mark;
      journal_mark(cut_.body, mark);
      if (move_parameters()) return true;
      journal_rollback(cut_.body, mark);
      if (scratch().faces.empty()) return false;
      for (const VisualTriangle f : scratch().faces)
        if (!divide_longest(f)) return false;
    }
    return false;
  }

  bool walk_chord_instead() { return walk_chord(cut_, p_, q_, patch_); }

 private:
  /// The curve goes onto the chord; what lies beside it follows, less the farther away it is. False: triangles would be turned over, those in scratch.faces, or, where there are none,
  /// the curve turns back.
  bool move_parameters() {
    std::vector<VisualTriangle>& turned = scratch().faces;
    turned.clear();
    std::vector<Vec2>& line = scratch().drawn;
    line.assign(1, Vec2{});
    for (const VV v : scratch().path) line.push_back(place(v));
    line.push_back({chord_.length(), 0});
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
      if (!(line[i].x < line[i + 1].x)) return false;
    auto& moved = scratch().moved_parameter;
    moved.clear();
    for (std::size_t i = 0; i < scratch().path.size(); ++i)
      moved.push_back({scratch().path[i], parameter({line[i + 1].x, 0}), {}});
    for (const CollisionTriangle f : scratch().beside) {
      const PoolRun run = cut_.body.collision.free[f][s_];
      for (std::int32_t i = 0; i < run.count; ++i) {
        const VV v = cut_.body.free_pool[run.at(i)];
        if (!mesh().free[v]) continue;
        const Vec2 u = place(v);
        if (!(u.x > 0 && u.x < chord_.length() && std::abs(u.y) < scratch().beside_reach)) continue;
        const double y = height(line, u.x), room = chord_.room(u.y > y, u.x);
        if (y != 0) moved.push_back({v, parameter({u.x, (u.y - y) * room / (room - y)}), f});
      }
    }

    auto& faces = scratch().laid_face;
    faces.clear();
    const auto area = [&](VisualHalfEdge e) {
      return orient(mesh().planar[e], mesh().planar[VisualMesh::next(e)], mesh().planar[VisualMesh::prev(e)]);
    };
    for (const auto& m : moved) for_each_in_patch(m.vertex, [&](VisualHalfEdge e) { faces.push_back({e, area(e)}); });
    for (const auto& m : moved) for_each_in_patch(m.vertex, [&](VisualHalfEdge e) { mesh().planar.set(e, m.to); });
    for (const auto& f : faces)
      if (!(area(f.corner) > kLaidKeepsArea * f.area)) turned.push_back(VisualMesh::face(f.corner));
    std::sort(turned.begin(), turned.end());
    turned.erase(std::unique(turned.begin(), turned.end()), turned.end());
    return turned.empty();
  }

  /// A free vertex in the middle of an edge.
  bool divide(VisualHalfEdge e) {
    const CollisionMesh& coarse = cut_.body.collision;
    const Vec2 u = lerp(mesh().planar[e], mesh().planar[VisualMesh::next(e)], 0.5);
    RestPoint at{CollisionMesh::face(h_), mirrored(u, side_)};
    const CollisionVertex nearer = chord_.local(at.at).x < 0.5 * chord_.length() ? coarse.from(h_) : coarse.to(h_);
    if (!edge_split_is_sound(mesh(), e, u, u) || !find_face(coarse, at, nearer, 0)) return false;
    const VV v = split_visual_edge(mesh(), e, 0.5, u, u, place_reach(cut_.body));
    mesh().free.set(v, 1);
    add_free(cut_, at.face, side_, v);
    return true;
  }
  bool divide_longest(VisualTriangle f) {
    VisualHalfEdge longest;
    double length = 0;
    for (int k = 0; k < 3; ++k) {
      const VisualHalfEdge e = VisualMesh::corner(f, k);
      const double here = norm(mesh().planar[VisualMesh::next(e)] - mesh().planar[e]);
      if (!mesh().barrier[e] && !mesh().is_border(e) && here > length) longest = e, length = here;
    }
    return longest.valid() && divide(longest);
  }

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
  if (cut.drawn.size() < 2) return;
  const Chord chord(cut, h);
  const double length = chord.length(), shows = kCurveShows * cut.body.mean_root_edge;
  const double reach = kCurveFar * (cut.options.path_tolerance + cut.options.minimum_feature) * cut.body.mean_root_edge;

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
  double highest = 0;
  for (Vec2& q : all) {
    const double x = q.x / length;
    q.y -= off_first * fade(x) + off_last * fade(1 - x);
    highest = std::max(highest, std::abs(q.y));
  }
  all.front().y = all.back().y = 0;
  if (highest < shows) return;
  Chord::gather(cut, h, kBesideCurve * highest);
  for (std::size_t i = 1; i + 1 < all.size(); ++i)
    all[i].y = std::clamp(all[i].y, kCurveRoom * chord.room(false, all[i].x), kCurveRoom * chord.room(true, all[i].x));
  keep_what_shows(all, shows, curve);
}

bool walk_curve(CutContext& cut, H h, Side side) {
  Curve curve(cut, h, side);
  if (cut.scratch.curve.empty()) return curve.walk_chord_instead();
  JournalMark mark;
  journal_mark(cut.body, mark);
  if (curve.walk() && curve.divide_caps() && curve.lay() && curve.sort()) return true;
  journal_rollback(cut.body, mark);
  return curve.walk_chord_instead();
}

}  // namespace kerf::cut
