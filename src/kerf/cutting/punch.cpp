#include "kerf/cutting/punch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "kerf/base/indexed.h"
#include "kerf/base/journal.h"
#include "kerf/cutting/collision_split.h"
#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/pieces.h"

namespace kerf {
namespace {

using namespace cut;
using H = CollisionHalfEdge;
using V = CollisionVertex;
using F = CollisionTriangle;

/// Corners of an outline, and how wide it must be at least, in minimum features (2 x area / perimeter: a circle's radius).
constexpr std::size_t kMostCorners = 2000;
constexpr double kLeastRadius = 3;
/// Outlines that met a degenerate case are moved by these parts of the minimum feature.
constexpr double kRetries[] = {0, 0.6, -0.6, 1.3, -1.3, 2.1};
/// A triangle is well inside from this part of the outline's radius (2 x area / perimeter) on.
constexpr double kWellInside = 0.3;
constexpr int kMostLayers = 64;
/// Cosine between a border and a part of it.
constexpr double kSameDirection = 0.9999;
/// Where a border was crossed already, in minimum features.
constexpr double kSamePlace = 1.5;

double double_area(const std::vector<Vec2>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += cross(p[i] - p[0], p[(i + 1) % p.size()] - p[0]);
  return sum;
}
double perimeter(const std::vector<Vec2>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += norm(p[(i + 1) % p.size()] - p[i]);
  return sum;
}

bool sides_touch(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  const double abc = orient(a, b, c), abd = orient(a, b, d), cda = orient(c, d, a), cdb = orient(c, d, b);
  if (abc == 0 && abd == 0) {
    const Vec2 e = b - a;
    const double s = dot(c - a, e), t = dot(d - a, e);
    return std::max(s, t) >= 0 && std::min(s, t) <= dot(e, e);
  }
  return (abc >= 0) != (abd > 0) && (cda >= 0) != (cdb > 0);
}

Status check_punch(const Punch& punch, double feature) {
  const std::vector<Vec2>& p = punch.outline;
  if (!is_finite(punch.centre) || !is_finite(punch.axis) || !is_finite(punch.across) || !(punch.reach > 0))
    return bad_input("punch: centre, axis and across must be finite numbers, reach above 0");
  if (!(norm(punch.axis) > 0)) return bad_input("punch: the axis has no direction");
  if (!(norm(cross(punch.axis, punch.across)) > 1e-9 * norm(punch.axis) * norm(punch.across)))
    return bad_input("punch: across must not point along the axis");
  if (p.size() < 3 || p.size() > kMostCorners)
    return bad_input(fmt::format("punch: an outline of {} points; give it 3 to {}", p.size(), kMostCorners));
  for (std::size_t i = 0; i < p.size(); ++i)
    if (!std::isfinite(p[i].x) || !std::isfinite(p[i].y)) return bad_input(fmt::format("punch: point {} of the outline is not finite", i + 1));
  for (std::size_t i = 0; i < p.size(); ++i) {
    const std::size_t j = (i + 1) % p.size();
    if (p[i] == p[j]) return bad_input(fmt::format("punch: points {} and {} of the outline are the same", i + 1, j + 1));
    for (std::size_t k = i + 2; k < p.size(); ++k)
      if ((k + 1) % p.size() != i && sides_touch(p[i], p[j], p[k], p[(k + 1) % p.size()]))
        return bad_input(fmt::format("punch: the outline touches itself: its sides from point {} and from point {}", i + 1, k + 1));
  }
  const double radius = std::fabs(double_area(p)) / perimeter(p);
  if (!(radius >= kLeastRadius * feature))
    return bad_input(fmt::format("punch: too small to be cut into this collision mesh; its outline is as wide as a circle of radius {:.3g} m, and "
                                 "{:.3g} m is the least (or choose a smaller minimum_feature)",
                                 radius, kLeastRadius * feature));
  return {};
}

/// The plane of the outline as seen by material that faces one way: positively oriented triangles only.
struct Chart {
  Vec3 origin, x, y, axis;
  [[nodiscard]] Vec2 operator()(Vec3 p) const { return {dot(p - origin, x), dot(p - origin, y)}; }
  [[nodiscard]] double depth(Vec3 p) const { return dot(p - origin, axis); }
  [[nodiscard]] Chart from_behind() const { return {origin, x, -y, -axis}; }
};

double distance_to_segment(Vec2 p, Vec2 a, Vec2 b) {
  const Vec2 d = b - a;
  const double s = std::clamp(dot(p - a, d) / std::max(dot(d, d), 1e-300), 0.0, 1.0);
  return norm(p - (a + s * d));
}

/// > 0 inside, by the distance to the outline.
double depth_inside(const std::vector<Vec2>& outline, Vec2 p) {
  bool inside = false;
  double nearest = HUGE_VAL;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Vec2 a = outline[i], b = outline[j];
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) inside = !inside;
    nearest = std::min(nearest, distance_to_segment(p, a, b));
  }
  return inside ? nearest : -nearest;
}

/// Where the outline gets into the material over a border, or out of it.
struct Crossing {
  std::size_t side = 0;  ///< of the outline
  double along = 0;      ///< part of the side
  Vec3 place, border;    ///< metres: the point, and the border edge that it lies on
};

class PunchTracer {
 public:
  PunchTracer(CellComplex& body, std::vector<Vec3>& position, const Chart& chart, std::vector<Vec2> outline, double reach,
              const CutOptions& options, CutScratch& scratch)
      : body_(body), mesh_(body.collision), position_(position), chart_(chart), outline_(std::move(outline)), reach_(reach),
        options_(options), scratch_(scratch), feature_(std::max(options.minimum_feature, kLeastFeature) * body.mean_root_edge) {
    if (double_area(outline_) > 0) std::reverse(outline_.begin(), outline_.end());  // what is inside lies on the right
  }

  Status run() {
    find_crossings();
    for (const Crossing& e : entries_) {
      double fraction = 0;
      const H h = relocate(e, fraction);
      if (!h.valid() || gone_over(h, fraction)) continue;
      KERF_TRY(start_on_border(h, fraction));
      KERF_TRY(follow_arc(e.side));
    }
    // What has no border on the outline: a loop in every layer that holds the first corner and has not been cut there.
    for (int layer = 0; layer < kMostLayers; ++layer) {
      const auto at = uncut_layer(outline_[0]);
      if (!at) return {};
      KERF_TRY(start(*at));
      KERF_TRY(close_loop());
    }
    return {};
  }

  PunchCut result;

 private:
  [[nodiscard]] Vec3 place(V v) const { return position_[v.index()]; }
  [[nodiscard]] Vec2 at(H h) const { return chart_(place(mesh_.from(h))); }
  [[nodiscard]] bool within_reach(Vec3 p) const { return std::fabs(chart_.depth(p)) <= reach_; }

  void find_crossings() {
    Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
    for (const Vec2 p : outline_) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    for (const H h : ids<H>(mesh_.half_edge_count())) {
      if (!mesh_.is_border(h)) continue;
      const Vec2 a = at(h), b = at(CollisionMesh::next(h));
      if (std::max(a.x, b.x) < low.x || std::min(a.x, b.x) > high.x || std::max(a.y, b.y) < low.y || std::min(a.y, b.y) > high.y) continue;
      if (!(orient(a, b, at(CollisionMesh::prev(h))) > 0)) continue;
      for (std::size_t i = 0; i < outline_.size(); ++i) {
        const Vec2 p = outline_[i], q = outline_[(i + 1) % outline_.size()];
        // One rule for zero, so that neighbours agree: what is not left of a line is right of it.
        const double sp = orient(a, b, p), sq = orient(a, b, q), ta = orient(p, q, a), tb = orient(p, q, b);
        if ((sp > 0) == (sq > 0) || (ta > 0) == (tb > 0)) continue;
        const double t = std::fabs(ta) / (std::fabs(ta) + std::fabs(tb));
        Crossing c;
        c.side = i;
        c.along = std::fabs(sp) / (std::fabs(sp) + std::fabs(sq));
        c.place = lerp(place(mesh_.from(h)), place(mesh_.to(h)), t);
        c.border = place(mesh_.to(h)) - place(mesh_.from(h));
        if (within_reach(c.place)) (sq > 0 ? entries_ : exits_).push_back(c);
      }
    }
    std::stable_sort(entries_.begin(), entries_.end(),
                     [](const Crossing& a, const Crossing& b) { return a.side != b.side ? a.side < b.side : a.along < b.along; });
  }

  /// Has an arc gone on over this border, here?
  [[nodiscard]] bool gone_over(H h, double fraction) const {
    const double length = norm(place(mesh_.to(h)) - place(mesh_.from(h)));
    const auto is_crossed = [&](V v) {
      return std::any_of(crossed_.begin(), crossed_.end(), [&](V w) { return mesh_.ancestor[w] == mesh_.ancestor[v]; });
    };
    return (fraction * length < kSamePlace * feature_ && is_crossed(mesh_.from(h))) ||
           ((1 - fraction) * length < kSamePlace * feature_ && is_crossed(mesh_.to(h)));
  }

  /// The same point on the mesh as it is now: part `fraction` of the nearest border edge that the outline runs into.
  [[nodiscard]] H relocate(const Crossing& e, double& fraction) const {
    H found;
    double nearest = 0.1 * feature_;
    for (const H h : ids<H>(mesh_.half_edge_count())) {
      if (!mesh_.is_border(h)) continue;
      const Vec3 a = place(mesh_.from(h)), b = place(mesh_.to(h)), d = b - a;
      const double t = std::clamp(dot(e.place - a, d) / std::max(dot(d, d), 1e-300), 0.0, 1.0);
      const double distance = norm(e.place - (a + t * d));
      if (!(distance < nearest) || !(orient(at(h), at(CollisionMesh::next(h)), at(CollisionMesh::prev(h))) > 0)) continue;
      // Other borders may lie there too: the other lip of a slit, and the lips that this punch has made.
      if (!(dot(d, e.border) > kSameDirection * norm(d) * norm(e.border))) continue;
      nearest = distance;
      found = h;
      fraction = t;
    }
    return found;
  }

  /// A triangle over the outline's first corner, in a layer that no path has cut there.
  [[nodiscard]] std::optional<FacePoint> uncut_layer(Vec2 q) {
    const double cut_already = 2 * feature_ + 2 * options_.path_tolerance * body_.mean_root_edge;
    for (const F f : ids<F>(mesh_.face_count())) {
      const H h = CollisionMesh::corner(f, 0);
      const Vec2 a = at(h), b = at(CollisionMesh::next(h)), c = at(CollisionMesh::prev(h));
      const double area = orient(a, b, c);
      if (!(area > 0)) continue;
      const double wa = orient(b, c, q), wb = orient(c, a, q), wc = orient(a, b, q);
      if (wa < 0 || wb < 0 || wc < 0) continue;
      FacePoint p{f, {wa / area, wb / area, wc / area}};
      Vec3 x;
      for (int i = 0; i < 3; ++i) x += p.weights[static_cast<std::size_t>(i)] * place(mesh_.origin[CollisionMesh::corner(f, i)]);
      if (!within_reach(x)) continue;
      if (std::any_of(track_.begin(), track_.end(), [&](const Stretch& s) { return distance(x, s) < cut_already; })) continue;
      track_.push_back({x, x});
      return p;
    }
    return std::nullopt;
  }

  struct Stretch { Vec3 a, b; };
  static double distance(Vec3 p, const Stretch& s) {
    const Vec3 d = s.b - s.a;
    const double t = std::clamp(dot(p - s.a, d) / std::max(dot(d, d), 1e-300), 0.0, 1.0);
    return norm(p - (s.a + t * d));
  }

  void place_new() {
    for (std::size_t i = position_.size(); i < mesh_.vertex_count(); ++i) {
      const V v(i);
      const auto birth = std::lower_bound(scratch_.births.begin(), scratch_.births.end(), v,
                                          [](const VertexBirth& b, V id) { return b.vertex < id; });
      KERF_ASSERT(birth != scratch_.births.end() && birth->vertex == v);
      Vec3 p;
      for (std::size_t k = 0; k < 3; ++k)
        if (birth->parent[k].valid()) p += birth->weight[k] * place(birth->parent[k]);
      position_.push_back(p);
    }
  }

  /// The path begins on the border, not at a vertex behind it, or what is inside would hang on there.
  Status start_on_border(H h, double fraction) {
    const double length = norm(mesh_.planar[CollisionMesh::next(h)] - mesh_.planar[h]);
    V v = fraction * length < feature_ ? mesh_.from(h) : (1 - fraction) * length < feature_ ? mesh_.to(h) : V{};
    if (!v.valid()) {
      CutContext cut{body_, options_, scratch_};
      scratch_.flip_stack.clear();
      v = split_collision_edge(cut, h, fraction);
      if (!v.valid()) return cut.error();
      flip_to_delaunay(cut);
    }
    return begin_at(v);
  }
  Status start(const FacePoint& at) {
    auto v = start_cut(body_, at, options_, scratch_);
    return v ? begin_at(*v) : Status(v.error());
  }
  Status begin_at(V v) {
    place_new();
    tip_ = v;
    ran_out_ = false;
    crossed_.push_back(tip_);
    track_.push_back({place(tip_), place(tip_)});
    return {};
  }

  /// From the entry on side `side` until the outline is out of the material again.
  Status follow_arc(std::size_t side) {
    for (std::size_t i = 1; i <= outline_.size() + 1; ++i) {
      auto stays = go_to(outline_[(side + i) % outline_.size()]);
      if (!stays) return stays.error();
      if (!*stays) return {};
    }
    return {};
  }

  Status close_loop() {
    const V first = tip_;
    for (std::size_t i = 1; i < outline_.size(); ++i) {
      auto stays = go_to(outline_[i]);
      if (!stays) return stays.error();
      if (!*stays) return {};
    }
    const std::size_t limit = 4 * mesh_.face_count() + 100;
    for (std::size_t i = 0; i < limit; ++i) {
      const V tip = tip_;
      if (mesh_.ancestor[tip] == mesh_.ancestor[first]) return {};
      FacePoint target;
      for_each_corner(mesh_, tip, [&](H h) {
        for (const H end : {CollisionMesh::next(h), CollisionMesh::prev(h)})
          if (mesh_.ancestor[mesh_.from(end)] == mesh_.ancestor[first]) {
            target.face = CollisionMesh::face(h);
            target.weights = {};
            target.weights[static_cast<std::size_t>(end.value % 3)] = 1;
          }
        return !target.face.valid();
      });
      const Vec2 goal = chart_(place(first));
      if (!target.face.valid() && !find_target(goal, target)) return {};
      auto moved = advance(target);
      if (!moved) return moved.error();
      if (*moved == Advance::Kind::kNothing || (*moved == Advance::Kind::kInside && tip_ == tip)) return {};
    }
    return {};
  }

  /// True while the path is still in the material.
  Result<bool> go_to(Vec2 q) {
    const std::size_t limit = 4 * mesh_.face_count() + 100;
    const Vec2 way = q - chart_(place(tip_));
    for (std::size_t i = 0; i < limit; ++i) {
      // There, or past it: a path that meets an edge at a small angle is led on to it.
      const Vec2 left = q - chart_(place(tip_));
      if (norm(left) < feature_ || dot(left, way) <= 0) return true;
      FacePoint target;
      if (!find_target(q, target)) {
        if (!run_along_border(q)) return false;
        continue;
      }
      auto moved = advance(target);
      if (!moved) return moved.error();
      if (*moved == Advance::Kind::kNothing || *moved == Advance::Kind::kInside) return true;
    }
    return failed("punch: the path around the outline does not end; move the punch a little");
  }

  Result<Advance::Kind> advance(const FacePoint& target) {
    const Vec3 from = place(tip_);
    auto step = advance_cut(body_, tip_, target, options_, scratch_);
    if (!step) return step.error();
    place_new();
    tip_ = step->tip;
    ++result.steps;
    if (step->opened) ++result.opened_edges;
    ran_out_ = step->kind == Advance::Kind::kRanOut;
    track_.push_back({from, place(tip_)});
    return step->kind;
  }

  /// The point of a triangle around the tip, or around another lip at the same place, that the way to q leads to; false
  /// out of the material. The tip becomes that lip.
  bool find_target(Vec2 q, FacePoint& target) {
    H out;
    double oa = 0, ob = 0;
    const auto search = [&](V v) {
      for_each_corner(mesh_, v, [&](H h) {
        const Vec2 c = at(h), a = at(CollisionMesh::next(h)), b = at(CollisionMesh::prev(h));
        if (!(orient(c, a, b) > 0)) return true;
        oa = orient(c, a, q), ob = orient(c, b, q);
        if (oa >= 0 && ob <= 0 && oa - ob > 0) out = h;
        return !out.valid();
      });
    };
    const V tip = tip_;
    search(tip);
    if (!out.valid() && mesh_.on_border(tip))
      for_each_twin(body_, tip, [&](V twin) {
        if (out.valid() || norm(place(twin) - place(tip)) > 1e-3 * feature_) return;
        search(twin);
        if (out.valid()) tip_ = twin;
      });
    if (!out.valid()) return false;
    if (ran_out_) crossed_.push_back(tip_);  // and on beyond the border
    ran_out_ = false;
    const Vec2 c = at(out), a = at(CollisionMesh::next(out)), b = at(CollisionMesh::prev(out));
    const double area = orient(c, a, b), wc = orient(q, a, b) / area;
    const bool reaches = wc > 0;
    const double f = oa / (oa - ob);
    const double w[3] = {reaches ? wc : 0, reaches ? -ob / area : 1 - f, reaches ? oa / area : f};
    double sum = 0;
    target.face = CollisionMesh::face(out);
    for (int i = 0; i < 3; ++i) sum += target.weights[static_cast<std::size_t>((out.value + i) % 3)] = std::clamp(w[i], 0.0, 1.0);
    for (double& x : target.weights) x /= sum;
    return true;
  }

  /// A path that has snapped to a border where the outline does not leave the material has to go on along it: to the next
  /// border vertex that is nearer to q and within the tolerance of the straight way.
  bool run_along_border(Vec2 q) {
    if (!mesh_.on_border(tip_)) return false;
    const double tolerance = 2 * options_.path_tolerance * body_.mean_root_edge + feature_;
    for (const Crossing& exit : exits_)
      if (norm(exit.place - place(tip_)) < tolerance) return false;
    const Vec2 here = chart_(place(tip_));
    V next;
    double nearest = norm(q - here);
    const H out = mesh_.fan_start(tip_);
    H last = out;
    for (H h = out; h.valid(); h = mesh_.ccw(h)) last = h;
    for (const V v : {mesh_.to(out), mesh_.from(CollisionMesh::prev(last))}) {
      const Vec2 p = chart_(place(v));
      if (distance_to_segment(p, here, q) > tolerance || !(norm(q - p) < nearest)) continue;
      nearest = norm(q - p);
      next = v;
    }
    if (!next.valid()) return false;
    tip_ = next;
    ran_out_ = true;
    return true;
  }

  CellComplex& body_;
  CollisionMesh& mesh_;
  std::vector<Vec3>& position_;
  Chart chart_;
  std::vector<Vec2> outline_;    ///< clockwise
  double reach_;
  const CutOptions& options_;
  CutScratch& scratch_;
  double feature_;
  V tip_;
  bool ran_out_ = false;         ///< the last step ended on a border
  std::vector<Crossing> entries_, exits_;  ///< of the outline, as it was before
  std::vector<V> crossed_;       ///< where arcs have begun, or gone on over a border
  std::vector<Stretch> track_;
};

/// Connected pieces of the collision mesh, and which of them lie inside an outline.
struct Inside {
  std::vector<std::int32_t> piece;      ///< of every triangle
  std::vector<std::uint8_t> is_inside;  ///< of every piece
  bool hangs_on = false;                ///< a piece reaches from well inside to well outside
};

/// A triangle is well outside farther than `margin` from the outline, well inside nearer to its middle than that.
Inside find_inside(const CellComplex& body, const std::vector<Vec3>& position, const Chart& chart,
                   const std::vector<Vec2>& outline, double reach, double margin) {
  const CollisionMesh& mesh = body.collision;
  Inside result;
  Pieces pieces = collision_pieces(body);
  result.piece = std::move(pieces.of_face);
  const auto n = static_cast<std::size_t>(pieces.count);
  std::vector<std::uint8_t> outside(n, 0), deep(n, 0);
  result.is_inside.assign(n, 0);
  const double well_inside = std::min(margin, kWellInside * std::fabs(double_area(outline)) / perimeter(outline));
  for (const F f : ids<F>(mesh.face_count())) {
    Vec3 corner[3];
    for (int i = 0; i < 3; ++i) corner[i] = position[mesh.origin[CollisionMesh::corner(f, i)].index()];
    const Vec3 middle = (1.0 / 3) * (corner[0] + corner[1] + corner[2]);
    const auto p = static_cast<std::size_t>(result.piece[f.index()]);
    if (std::fabs(chart.depth(middle)) > reach) {
      outside[p] = 1;
      continue;
    }
    const double depth = depth_inside(outline, chart(middle));
    double least = depth, most = depth;
    for (int i = 0; i < 3; ++i)
      for (const Vec3 x : {corner[i], 0.5 * (corner[i] + corner[(i + 1) % 3])}) {
        const double d = depth_inside(outline, chart(x));
        least = std::min(least, d);
        most = std::max(most, d);
      }
    if (least < -margin) outside[p] = 1;
    if (depth > well_inside || most > margin) deep[p] = 1;
    if (depth > 0) result.is_inside[p] = 1;
  }
  for (std::size_t p = 0; p < n; ++p) {
    result.hangs_on = result.hangs_on || (deep[p] && outside[p]);
    if (outside[p]) result.is_inside[p] = 0;
  }
  return result;
}

/// Corners nearer than the tolerance to the line between their neighbours are left out.
std::vector<Vec2> simplified(const std::vector<Vec2>& outline, double feature) {
  std::vector<Vec2> kept;
  for (const Vec2 p : outline)
    if (kept.empty() || norm(p - kept.back()) >= feature) kept.push_back(p);
  while (kept.size() > 3 && norm(kept.back() - kept.front()) < feature) kept.pop_back();
  return kept.size() >= 3 ? kept : outline;
}

}  // namespace

std::vector<Vec2> circle_outline(double radius, double tolerance) {
  const double angle = std::acos(1 - std::clamp(tolerance / std::max(radius, 1e-300), 1e-4, 0.3));
  const int n = std::clamp(static_cast<int>(std::ceil(std::numbers::pi / angle)), 8, 200);
  std::vector<Vec2> points;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * (i + 0.5) / n;
    points.push_back({radius * std::cos(a), radius * std::sin(a)});
  }
  return points;
}

std::vector<Vec2> d_outline(double radius, double tolerance) {
  const double angle = std::acos(1 - std::clamp(tolerance / std::max(radius, 1e-300), 1e-4, 0.3));
  const int n = std::clamp(static_cast<int>(std::ceil(0.5 * std::numbers::pi / angle)), 4, 100);
  std::vector<Vec2> points;
  for (int i = 0; i <= n; ++i) {
    const double a = std::numbers::pi * (static_cast<double>(i) / n - 0.5);
    points.push_back({radius * std::max(0.0, std::cos(a)), radius * std::sin(a)});
  }
  points.front().x = points.back().x = 0;
  return points;
}

Result<PunchCut> cut_punch(CellComplex& body, std::vector<Vec3>& position, const Punch& punch, const CutOptions& options,
                           CutScratch& scratch) {
  const double feature = std::max(options.minimum_feature, kLeastFeature) * body.mean_root_edge;
  KERF_TRY(check_punch(punch, feature));
  const CollisionMesh& mesh = body.collision;
  KERF_ASSERT(position.size() == mesh.vertex_count());
  Chart chart{punch.centre, {}, {}, normalized(punch.axis)};
  chart.x = normalized(punch.across - dot(punch.across, chart.axis) * chart.axis);
  chart.y = cross(chart.axis, chart.x);
  std::vector<Vec2> outline = simplified(punch.outline, feature);
  if (double_area(outline) < 0) std::reverse(outline.begin(), outline.end());
  const std::size_t old_vertices = mesh.vertex_count(), old_half_edges = mesh.half_edge_count();
  std::vector<std::uint8_t> was_border(old_half_edges, 0);
  for (const H h : ids<H>(old_half_edges)) was_border[h.index()] = mesh.is_border(h) ? 1 : 0;

  JournalMark mark;
  journal_mark(body, mark);
  Error trouble = failed("punch: what is inside the outline still hangs on; move the punch a little");
  for (std::size_t attempt = 0; attempt < std::size(kRetries); ++attempt) {
    if (attempt > 0) {
      journal_rollback(body, mark);
      position.resize(old_vertices);
    }
    // Wider or narrower, and begun at another corner.
    std::vector<Vec2> corners;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const std::size_t k = (i + attempt * outline.size() / std::size(kRetries)) % outline.size();
      const Vec2 before = outline[(k + outline.size() - 1) % outline.size()], after = outline[(k + 1) % outline.size()];
      const Vec2 d = after - before;
      const Vec2 outwards = norm(d) > 0 ? (1 / norm(d)) * Vec2{d.y, -d.x} : Vec2{};
      corners.push_back(outline[k] + kRetries[attempt] * feature * outwards);
    }
    PunchTracer front(body, position, chart, corners, punch.reach, options, scratch);
    Status done = front.run();
    std::vector<Vec2> mirrored_corners = corners;
    for (Vec2& p : mirrored_corners) p.y = -p.y;
    PunchTracer back(body, position, chart.from_behind(), mirrored_corners, punch.reach, options, scratch);
    if (done) done = back.run();
    if (!done) {
      trouble = done.error();
      continue;
    }
    PunchCut cut;
    cut.opened_edges = front.result.opened_edges + back.result.opened_edges;
    cut.steps = front.result.steps + back.result.steps;
    cut.retries = static_cast<int>(attempt);
    if (cut.opened_edges == 0) {  // vertices where it would have begun are of no use
      journal_rollback(body, mark);
      position.resize(old_vertices);
      return cut;
    }
    const double margin = 4 * feature + 2 * options.path_tolerance * body.mean_root_edge;
    const Inside pieces = find_inside(body, position, chart, corners, punch.reach, margin);
    if (pieces.hangs_on) continue;
    const auto is_inside = [&](F f) { return pieces.is_inside[static_cast<std::size_t>(pieces.piece[f.index()])] != 0; };
    // Loose by this punch: the pieces with a new lip. What stays has the others.
    std::vector<std::uint8_t> loose(pieces.is_inside.size(), 0);
    for (const H h : ids<H>(mesh.half_edge_count())) {
      if (!mesh.is_border(h) || (h.index() < old_half_edges && was_border[h.index()])) continue;
      // Parts of older borders have new ids, too.
      const Vec2 m = 0.5 * (chart(position[mesh.from(h).index()]) + chart(position[mesh.to(h).index()]));
      if (std::fabs(depth_inside(corners, m)) > margin) continue;
      const F f = CollisionMesh::face(h);
      if (is_inside(f)) loose[static_cast<std::size_t>(pieces.piece[f.index()])] = 1;
      else cut.lips.push_back(h);
    }
    for (const F f : ids<F>(mesh.face_count()))
      if (loose[static_cast<std::size_t>(pieces.piece[f.index()])]) cut.loose.push_back(f);
    return cut;
  }
  return trouble;
}

}  // namespace kerf
