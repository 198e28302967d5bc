#include "kerf/cutting/shave.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kerf/base/indexed.h"
#include "kerf/base/journal.h"
#include "kerf/cutting/collision_split.h"
#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/cut_scratch.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/rim_vertex.h"
#include "kerf/cutting/slide_vertex.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/cutting/wall_points.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using namespace cut;
using H = CollisionHalfEdge;
using V = CollisionVertex;
using F = CollisionTriangle;
using VV = VisualVertex;
using VH = VisualHalfEdge;

/// A bump is cut down to this part of what its neighbours stand out on the mean, if it stands out more.
constexpr double kNeighbours = 0.5;
/// An edge moves back where its walls stray less than this part of the half thickness.
constexpr double kSmoothEnough = 0.05;
/// Slides are tried as far as wanted, then half as far, and so on.
constexpr int kHalvings = 4;
/// A corner that stands out moves back by up to this many times the depth of a pass; one that lies back by this angle beyond
/// straight waits for its neighbours.
constexpr double kMostAtCorners = 2, kWaits = 1.0;
/// What lies in front of a vertex makes way when it is nearer than kMakeWay (part of the mean root edge), and by kMakeWayBy times the
/// way of the vertex when it is nearer than kMustMakeWay; so many rings ahead; not if it is less than kLeastPush of a pass's depth.
constexpr double kMakeWay = 0.12, kMustMakeWay = 0.04, kMakeWayBy = 1.25, kLeastPush = 0.02;
constexpr int kRings = 3;
/// A strip of material between two borders gets no narrower than this part of the mean root edge; it gets shorter.
constexpr double kStrip = 0.12;
/// Bumps lower than this part of the mean root edge are rounding.
constexpr double kRounding = 1e-12;
/// An edge is divided where it is met at least so far from its ends: in radii of the shaver, in minimum features.
constexpr double kLeastSpacing = 0.75, kLeastFeatures = 4;

/// Nearest points of two segments, as parameters of the first.
double segment_distance(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1, double& s) {
  const Vec3 d1 = p1 - p0, d2 = q1 - q0, r = p0 - q0;
  const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r);
  double t = 0;
  if (!(a > 0)) {
    s = 0;
    t = e > 0 ? std::clamp(f / e, 0.0, 1.0) : 0.0;
  } else {
    const double c = dot(d1, r);
    if (!(e > 0)) {
      s = std::clamp(-c / a, 0.0, 1.0);
    } else {
      const double b = dot(d1, d2), denominator = a * e - b * b;
      s = denominator > 1e-12 * a * e ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
      t = (b * s + f) / e;
      if (t < 0 || t > 1) {
        t = std::clamp(t, 0.0, 1.0);
        s = std::clamp((b * t - c) / a, 0.0, 1.0);
      }
    }
  }
  return norm((p0 + s * d1) - (q0 + t * d2));
}

/// Where the shaver meets a wall's edge.
struct Contact {
  WallId wall;
  H edge;
  double middle = 0, half = 0;  ///< parameters of the edge
  /// 1 in the middle, 0 at the ends.
  [[nodiscard]] double weight(double t) const {
    const double x = (t - middle) / half;
    return x * x < 1 ? 1 - x * x : 0;
  }
};

class ShavingPass {
 public:
  ShavingPass(CellComplex& body, std::vector<Vec3>& position, const Shaver& shaver, const ShaveOptions& options,
              const CutOptions& cut_options, CutScratch& scratch, ShavePass& pass)
      : body_(body), coarse_(body.collision), mesh_(body.visual), position_(position), shaver_(shaver),
        options_(options), cut_options_(cut_options), scratch_(scratch), pass_(pass) {}

  void run() {
    find_contacts();
    if (options_.depth > 0 && divide_long_edges()) find_contacts();
    for (const Contact& c : contacts_) pass_.walls.push_back(c.wall);
    if (contacts_.empty()) return;
    pass_.roughness_before = wall_roughness(body_, pass_.walls);
    smooth();
    if (options_.depth > 0) move_back();
    pass_.removed = books_.removed;
    pass_.turned = books_.turned;
    pass_.skin_area = books_.skin_area;
    pass_.collision_area = books_.collision_area;
    pass_.prisms = std::move(books_.prisms);
    pass_.vertices = std::move(books_.vertices);
    std::sort(pass_.vertices.begin(), pass_.vertices.end());
    pass_.roughness_after = wall_roughness(body_, pass_.walls);
  }

 private:
  template <class T>
  static void sort_unique(std::vector<T>& v) {
    std::sort(v.begin(), v.end());
    v.erase(std::unique(v.begin(), v.end()), v.end());
  }
  [[nodiscard]] double half_thickness(V v) const { return norm(coarse_.offset[v]); }
  /// No vector is longer.
  static double at_most(Vec3 v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }
  /// Along one of the axes an edge is farther than `reach` from the shaver.
  [[nodiscard]] bool is_far(Vec3 a, Vec3 b, double reach) const {
    const Vec3 c = shaver_.base, d = shaver_.tip;
    const auto apart = [reach](double p, double q, double r, double s) {
      return std::min(p, q) > std::max(r, s) + reach || std::max(p, q) < std::min(r, s) - reach;
    };
    return apart(a.x, b.x, c.x, d.x) || apart(a.y, b.y, c.y, d.y) || apart(a.z, b.z, c.z, d.z);
  }

  void find_contacts() {
    contacts_.clear();
    pass_.edges = 0;
    for (const WallId w : ids<WallId>(body_.wall_edge.size())) {
      const H h = body_.wall_edge[w];
      const V a = coarse_.from(h), b = coarse_.to(h);
      const Vec3 pa = position_[a.index()], pb = position_[b.index()];
      if (is_far(pa, pb, shaver_.radius + std::max(at_most(coarse_.offset[a]), at_most(coarse_.offset[b])))) continue;
      const double reach = shaver_.radius + std::max(half_thickness(a), half_thickness(b));
      double s = 0;
      const double d = segment_distance(pa, pb, shaver_.base, shaver_.tip, s);
      if (!(d < reach)) continue;
      const double length = norm(pb - pa);
      contacts_.push_back({w, h, s, std::sqrt(reach * reach - d * d) / std::max(length, 1e-300)});
      ++pass_.edges;
    }
  }

  /// An edge moves back at its ends only, so one that is met far from both gets a vertex there.
  bool divide_long_edges() {
    const double feature = std::max(cut_options_.minimum_feature, kLeastFeature) * body_.mean_root_edge;
    const double least = std::max(kLeastSpacing * shaver_.radius, kLeastFeatures * feature);
    bool divided = false;
    for (const Contact& c : contacts_) {
      const double length = norm(coarse_.rest[coarse_.to(c.edge)] - coarse_.rest[coarse_.from(c.edge)]);
      if (!(length * std::min(c.middle, 1 - c.middle) > least)) continue;
      JournalMark mark;
      journal_mark(body_, mark);
      CutContext cut{body_, cut_options_, scratch_};
      scratch_.flip_stack.clear();
      const V a = coarse_.from(c.edge), b = coarse_.to(c.edge);
      const V v = split_collision_edge(cut, c.edge, c.middle);
      if (!v.valid()) {
        journal_rollback(body_, mark);
        continue;
      }
      flip_to_delaunay(cut);
      position_.push_back(lerp(position_[a.index()], position_[b.index()], c.middle));
      KERF_ASSERT(position_.size() == coarse_.vertex_count());
      divided = true;
    }
    return divided;
  }

  // ---------------------------------------------------------------- bumps

  void smooth() {
    struct Bump {
      VV vertex;
      Vec3 smooth, stray;
      double weight = 0;
      bool operator<(const Bump& o) const { return vertex < o.vertex; }
    };
    std::vector<Bump> bumps;
    for (const Contact& c : contacts_) {
      const Vec3 a = coarse_.rest[coarse_.from(c.edge)], e = coarse_.rest[coarse_.to(c.edge)] - a;
      wall_points(body_, c.wall, points_);
      for (const WallPoint& p : points_)
        bumps.push_back({p.vertex, p.smooth, mesh_.rest[p.vertex] - p.smooth,
                         c.weight(std::clamp(dot(p.smooth - a, e) / dot(e, e), 0.0, 1.0))});
    }
    std::stable_sort(bumps.begin(), bumps.end());
    std::vector<Bump> one;  // a vertex of a line is seen from two walls: the stronger contact counts
    for (const Bump& b : bumps)
      if (one.empty() || one.back().vertex != b.vertex) one.push_back(b);
      else one.back().weight = std::max(one.back().weight, b.weight);
    std::vector<VertexSlider::Move> moves;
    for (const Bump& b : one) {
      const double height = norm(b.stray);
      if (!(b.weight > 0) || !(height > kRounding * body_.mean_root_edge)) continue;
      double around = 0;
      int n = 0;
      for_each_corner(mesh_, b.vertex, [&](VH h) {
        const auto it = std::lower_bound(one.begin(), one.end(), Bump{mesh_.to(h), {}, {}, 0});
        around += it != one.end() && it->vertex == mesh_.to(h) ? norm(it->stray) : 0;
        ++n;
        return true;
      });
      const double excess = height - kNeighbours * around / n;
      if (!(excess > 0)) continue;
      const double left = std::max(0.0, 1 - options_.smoothing * b.weight * excess / height);
      moves.push_back({b.vertex, b.smooth + left * b.stray});
    }
    slider_.apply(moves, books_);
  }

  // ---------------------------------------------------------------- edges that move back

  struct Touched {
    V vertex;
    double weight;
    bool operator<(const Touched& o) const { return vertex != o.vertex ? vertex < o.vertex : weight < o.weight; }
    bool operator==(const Touched& o) const { return vertex == o.vertex; }
  };

  void move_back() {
    std::vector<Touched> touched;
    for (const Contact& c : contacts_)
      for (const V v : {coarse_.from(c.edge), coarse_.to(c.edge)}) {
        const double reach = shaver_.radius + half_thickness(v);
        const double d = distance_to_segment(position_[v.index()], shaver_.base, shaver_.tip);
        if (d < reach) touched.push_back({v, 1 - d * d / (reach * reach)});
      }
    sort_unique(touched);
    if (options_.first.valid())
      std::rotate(touched.begin(), std::lower_bound(touched.begin(), touched.end(), Touched{options_.first, 0}),
                  touched.end());
    for (const Touched& t : touched) {
      if (options_.moves > 0 && moves_ >= options_.moves) {
        pass_.left = t.vertex;
        break;
      }
      if (is_end_of_slit(t.vertex)) {
        ++pass_.stuck;
        continue;
      }
      if (!is_smooth_around(t.vertex)) continue;
      const double way = (has_waited(t.vertex) ? 2 : 1) * options_.depth * t.weight * share(t.vertex);
      if (!(way > 0)) continue;
      if (slide_back(t.vertex, way)) {
        slid_.push_back(t.vertex);
        ++pass_.moved_back;
      } else {
        ++pass_.stuck;
      }
    }
    sort_unique(slid_);
    pass_.collision_vertices = std::move(slid_);
  }

  /// Both border edges lead to the same place.
  [[nodiscard]] bool is_end_of_slit(V v) const {
    const auto [out, in] = border_edges(coarse_, v);
    return coarse_.ancestor[coarse_.to(out)] == coarse_.ancestor[coarse_.from(in)];
  }

  /// How much of a pass's depth a border vertex takes: corners that stand out more, those that lie back less, so that a lip gets
  /// straighter.
  [[nodiscard]] double share(V v) const {
    const double bend = fan_angle(coarse_, v) - std::numbers::pi;  // > 0: lies back
    if (bend > 0) return std::max(0.0, 1 - bend / kWaits);
    return std::min(kMostAtCorners, 1 / std::max(std::cos(bend / 2), 1e-3));
  }

  [[nodiscard]] bool has_waited(V v) const {
    const V first = options_.first, until = options_.until;
    if (!first.valid()) return false;
    if (!until.valid()) return !(v < first);
    return first < until ? !(v < first) && v < until : !(v < first) || v < until;
  }

  bool slide(V v, const SlideTarget& to, const SlideRules& rules) {
    ++moves_;
    return slider_.slide(v, to, rules, books_);
  }

  bool slide_back(V v, double way) {
    const auto [out, in] = border_edges(coarse_, v);
    const bool rim_out = is_rim_edge(coarse_, out), rim_in = is_rim_edge(coarse_, in);
    if (coarse_.on_rim(v) && !rim_out && !rim_in && !split_rim_vertex(body_, v)) return false;
    const double whole = fan_angle(coarse_, v);
    if (rim_out || rim_in)
      return slide_towards(v, way, {true, 0}, [&](double d) { return point_on_rim(coarse_, v, rim_out ? d : -d); });
    // The sides of a narrow strip don't come nearer to each other, or a fin would be left; its end moves back along them. What is one
    // triangle alone may get flat.
    const double strip = coarse_.ccw(out).valid() ? kStrip * body_.mean_root_edge : 0;
    if (slide_towards(v, way, {true, strip}, [&](double d) { return point_in_fan(coarse_, v, whole / 2, d); }))
      return true;
    return whole < std::numbers::pi &&
           (slide_towards(v, way, {true, 0}, [&](double d) { return point_in_fan(coarse_, v, 0, d); }) ||
            slide_towards(v, way, {true, 0}, [&](double d) { return point_in_fan(coarse_, v, whole, d); }));
  }
  template <class Target>
  bool slide_towards(V v, double way, const SlideRules& rules, Target&& target) {
    for (int i = 0; i <= kHalvings; ++i, way *= 0.5) {
      const SlideTarget to = target(way);
      if (i == 0) make_way(v, to, kRings);
      if (slide(v, to, rules)) return true;
    }
    return false;
  }

  /// Walls on both sides of v, their lines and columns, as far as the shaver goes.
  [[nodiscard]] bool is_smooth_around(V v) {
    const double limit = kSmoothEnough * half_thickness(v);
    const double reach = shaver_.radius + half_thickness(v);
    walls_at(coarse_, v, walls_);
    for (const WallId w : walls_) {
      wall_points(body_, w, points_);
      for (const WallPoint& p : points_)
        if (norm(mesh_.rest[p.vertex] - p.smooth) > limit && norm(p.smooth - coarse_.rest[v]) < reach) return false;
    }
    return true;
  }

  // ---------------------------------------------------------------- vertices that make way

  /// Where the slide of v makes it narrow, the ends of the opposite edges are pushed ahead first, and what is narrow before them.
  void make_way(V v, const SlideTarget& target, int rings) {
    std::vector<Push> pushes;
    slider_.for_each_face(v, target, [&](H h, Vec2 from, Vec2 to) {
      const H n = CollisionMesh::next(h), p = CollisionMesh::prev(h);
      const Vec2 a = coarse_.planar[n], b = coarse_.planar[p], d = to - from;
      const double height = orient(to, a, b) / norm(b - a);
      const double wanted = kMakeWay * body_.mean_root_edge, least = kMustMakeWay * body_.mean_root_edge;
      if (!(height < wanted) || !(height < orient(from, a, b) / norm(b - a))) return;
      const double share = kMakeWayBy * std::min(1.0, (wanted - height) / (wanted - least));
      const double t = std::clamp(dot(to - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
      pushes.push_back({n, (std::min(1.0, 2 * (1 - t)) * share) * d, height < least});
      pushes.push_back({p, (std::min(1.0, 2 * t) * share) * d, height < least});
    });
    // An end that two triangles push takes the longer way.
    std::sort(pushes.begin(), pushes.end(), [&](const Push& a, const Push& b) {
      const V va = coarse_.from(a.corner), vb = coarse_.from(b.corner);
      return va != vb ? va < vb : dot(a.way, a.way) > dot(b.way, b.way);
    });
    for (std::size_t i = 0; i < pushes.size(); ++i)
      if (i == 0 || coarse_.from(pushes[i].corner) != coarse_.from(pushes[i - 1].corner))
        push(pushes[i], target.along_rim != 0, rings);
  }
  struct Push {
    H corner;            ///< of the vertex to push
    Vec2 way;            ///< in the plane of that corner
    bool close = false;  ///< it must
  };

  /// A vertex of the rim is pushed along the rim only, by another one. One on a lip is pushed into its own material where it is so close that
  /// neither could move alone: the tip of a thorn goes back as a whole.
  void push(const Push& p, bool along_rim, int rings) {
    const V v = coarse_.from(p.corner);
    double distance = norm(p.way);
    if (!(distance > kLeastPush * options_.depth)) return;
    SlideTarget target;
    for (int i = 0; i <= 2; ++i, distance *= 0.5) {
      if (coarse_.on_border(v)) {
        const auto [out, in] = border_edges(coarse_, v);
        if (!is_rim_edge(coarse_, out) && !is_rim_edge(coarse_, in)) {
          target = push_lip(p, distance);
          if (i == 0 && rings > 0) make_way(v, target, rings - 1);
          if (slide(v, target, {true, 0})) {
            slid_.push_back(v);
            return;
          }
          continue;
        }
        if (!along_rim || !is_rim_edge(coarse_, out) || !is_rim_edge(coarse_, in)) return;
        // Along the rim, as far as the push leads that way.
        const double along = std::cos(angle_to(p)), back = std::cos(angle_to(p) - fan_angle(coarse_, v));
        target =
            point_on_rim(coarse_, v, along > back ? distance * std::max(0.0, along) : -distance * std::max(0.0, back));
        if (target.along_rim == 0) return;
      } else {
        target =
            point_in_fan(coarse_, v, std::fmod(angle_to(p) + 4 * std::numbers::pi, fan_angle(coarse_, v)), distance);
      }
      if (i == 0 && rings > 0) make_way(v, target, rings - 1);
      if (slide(v, target, {})) {
        slid_.push_back(v);
        return;
      }
    }
  }
  SlideTarget push_lip(const Push& p, double distance) {
    const V v = coarse_.from(p.corner);
    if (!p.close || coarse_.on_rim(v) || is_end_of_slit(v)) return {};
    // Nothing is taken where the shaver does not reach.
    if (!(distance_to_segment(position_[v.index()], shaver_.base, shaver_.tip) < shaver_.radius + half_thickness(v)))
      return {};
    const double whole = fan_angle(coarse_, v), middle = whole / 2;
    const double angle = middle + std::remainder(angle_to(p) - middle, 2 * std::numbers::pi),
                 inside = std::clamp(angle, 0.0, whole);
    // One that lies back waits, as when it is met itself: else it would be pushed into a notch.
    const double along = std::cos(angle - inside) * std::clamp(1 - (whole - std::numbers::pi) / kWaits, 0.0, 1.0);
    return along > 0 ? point_in_fan(coarse_, v, inside, along * distance) : SlideTarget{};
  }
  /// The angle of a push, counter-clockwise from the vertex's first edge.
  [[nodiscard]] double angle_to(const Push& p) const {
    double angle = 0;
    coarse_.for_each_outgoing(coarse_.from(p.corner), [&](H h) {
      const Vec2 o = coarse_.planar[h], a = coarse_.planar[CollisionMesh::next(h)] - o,
                 b = coarse_.planar[CollisionMesh::prev(h)] - o;
      if (h == p.corner) {
        angle += std::atan2(cross(a, p.way), dot(a, p.way));
        return false;
      }
      angle += std::atan2(cross(a, b), dot(a, b));
      return true;
    });
    return angle;
  }

  CellComplex& body_;
  CollisionMesh& coarse_;
  VisualMesh& mesh_;
  std::vector<Vec3>& position_;
  const Shaver& shaver_;
  const ShaveOptions& options_;
  const CutOptions& cut_options_;
  CutScratch& scratch_;
  ShavePass& pass_;
  std::vector<Contact> contacts_;
  std::vector<WallPoint> points_;
  std::vector<WallId> walls_;
  VertexSlider slider_{body_, scratch_};
  SlideBooks books_;
  std::vector<V> slid_;
  int moves_ = 0;
};

}  // namespace

void shave(CellComplex& body, std::vector<Vec3>& position, const Shaver& shaver, const ShaveOptions& options,
           const CutOptions& cut_options, CutScratch& scratch, ShavePass& pass) {
  pass = {};
  if (!body.closed) return;
  KERF_ASSERT(position.size() == body.collision.vertex_count());
  ShavingPass(body, position, shaver, options, cut_options, scratch, pass).run();
}

}  // namespace kerf
