#include "kerf/cutting/rest_cut.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kerf/base/indexed.h"
#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"

namespace kerf {

namespace {

using namespace cut;
using H = CollisionHalfEdge;
using V = CollisionVertex;
using F = CollisionTriangle;

/// Barycentric weights of the point of triangle a b c nearest to p.
std::array<double, 3> nearest_weights(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) { const double t = d1 / (d1 - d3); return {1 - t, t, 0}; }
  const Vec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) { const double t = d2 / (d2 - d6); return {1 - t, 0, t}; }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

Vec3 face_normal(const CollisionMesh& mesh, F f) {
  const Vec3 a = mesh.rest[mesh.origin[CollisionMesh::corner(f, 0)]];
  const Vec3 b = mesh.rest[mesh.origin[CollisionMesh::corner(f, 1)]];
  const Vec3 c = mesh.rest[mesh.origin[CollisionMesh::corner(f, 2)]];
  return normalized(cross(b - a, c - a));
}

/// The plane in which one segment of the path is followed.
struct Chart {
  Vec3 origin, x, y;
  static Chart along(Vec3 origin, Vec3 normal) {
    const Vec3 helper = std::fabs(normal.y) < 0.9 ? Vec3{0, 1, 0} : Vec3{0, 0, normal.y > 0 ? -1.0 : 1.0};
    const Vec3 x = normalized(cross(helper, normal));
    return {origin, x, cross(normal, x)};
  }
  [[nodiscard]] Vec2 operator()(Vec3 p) const { return {dot(p - origin, x), dot(p - origin, y)}; }
};

struct Wedge {
  H out;  ///< tip -> a of the face that the path leads into; none: out of the body
  double oa = 0, ob = 0;
};

class Tracer {
 public:
  Tracer(CellComplex& body, const CutOptions& options, CutScratch& scratch)
      : body_(body), mesh_(body.collision), options_(options), scratch_(scratch),
        feature_(std::max(options.minimum_feature, kLeastFeature) * body.mean_root_edge) {}

  Status start(Vec3 p) {
    position_ = p;
    double distance = 0;
    const FacePoint at = nearest_rest_point(body_, p, distance);
    Vec3 away = p;
    for (int i = 0; i < 3; ++i)
      away -= at.weights[static_cast<std::size_t>(i)] * mesh_.rest[mesh_.origin[CollisionMesh::corner(at.face, i)]];
    const Vec3 normal = face_normal(mesh_, at.face);
    away -= dot(away, normal) * normal;
    if (norm(away) > feature_) return {};  // beside the body: the path enters later
    auto v = start_cut(body_, at, options_, scratch_);
    if (!v) return v.error();
    result.tip = *v;
    return {};
  }

  Status go_to(Vec3 goal) {
    double distance = 0;
    const Vec3 from = result.tip.valid() ? mesh_.rest[result.tip] : position_;
    const Vec3 normal = normalized(face_normal(mesh_, nearest_rest_point(body_, goal, distance).face) +
                                   face_normal(mesh_, nearest_rest_point(body_, from, distance).face));
    if (!(norm(normal) > 0.5))
      return failed("cut: the path turns over the body between two of its points; give it more points");
    chart_ = Chart::along(from, normal);
    const Vec2 q = chart_(goal);
    position_ = from;
    left_at_ = result.tip;
    double beyond = kAtOnce;
    bool entered = false;
    // How far along the segment the last entry was: a path that snaps back to the border it came from must not enter
    // at the same place for ever.
    entry_start_ = chart_(from);
    least_progress_ = -std::numeric_limits<double>::infinity();
    int opened_at_entry = -1;
    const std::size_t limit = 8 * mesh_.face_count() + 1000;
    for (std::size_t step = 0; step < limit; ++step) {
      if (!result.tip.valid()) {
        FacePoint entry;
        if (opened_at_entry == result.opened_edges) least_progress_ = last_progress_ + feature_;
        if (!find_entry(q, beyond, entry)) {
          position_ = goal;
          return {};
        }
        opened_at_entry = result.opened_edges;
        auto v = start_cut(body_, entry, options_, scratch_);
        if (!v) return v.error();
        result.tip = *v;
        entered = true;
      }
      if (norm(chart_(mesh_.rest[result.tip]) - q) < feature_) return {};
      const Wedge wedge = find_wedge(q);
      if (!wedge.out.valid()) {  // out of the body; an entry that led nowhere leaves the ray as it was
        if (!entered) {
          position_ = mesh_.rest[result.tip];
          left_at_ = result.tip;
          beyond = kAtOnce;
        }
        result.tip = V{};
        continue;
      }
      if (entered) ++result.entries;
      entered = false;
      const H across = CollisionMesh::next(wedge.out), in = CollisionMesh::prev(wedge.out);
      const Vec2 c = at(wedge.out), a = at(across), b = at(in);
      const double area = orient(c, a, b), wc = orient(q, a, b) / area;
      const bool reaches = wc > 0;
      const double f = wedge.oa / (wedge.oa - wedge.ob);
      const double w[3] = {reaches ? wc : 0, reaches ? -wedge.ob / area : 1 - f, reaches ? wedge.oa / area : f};
      FacePoint target;
      target.face = CollisionMesh::face(wedge.out);
      for (int i = 0; i < 3; ++i)
        target.weights[static_cast<std::size_t>((wedge.out.value + i) % 3)] = std::clamp(w[i], 0.0, 1.0);
      auto advanced = advance_cut(body_, result.tip, target, options_, scratch_);
      if (!advanced) return advanced.error();
      ++result.steps;
      if (advanced->opened) ++result.opened_edges;
      if (advanced->kind == Advance::Kind::kRanOut) ++result.ran_out;
      result.tip = advanced->tip;
      if (advanced->kind == Advance::Kind::kInside || advanced->kind == Advance::Kind::kNothing) return {};
      beyond = kAtOnce;
    }
    return failed(fmt::format("cut: the path does not end after {} steps; move it a little", limit));
  }

  RestCut result;

 private:
  /// A border may be entered where the ray starts: both lips of a slit coincide at rest.
  static constexpr double kAtOnce = -1e-9;

  [[nodiscard]] Vec2 at(H h) const { return chart_(mesh_.rest[mesh_.from(h)]); }

  /// The face of the tip or one of its twins that the way to q leads into; the tip becomes that twin.
  Wedge find_wedge(Vec2 q) {
    Wedge found;
    const auto search = [&](V v) {
      for_each_corner(mesh_, v, [&](H h) {
        const Vec2 c = at(h), a = at(CollisionMesh::next(h)), b = at(CollisionMesh::prev(h));
        if (!(orient(c, a, b) > 0)) return true;
        const double oa = orient(c, a, q), ob = orient(c, b, q);
        if (oa >= 0 && ob <= 0 && oa - ob > 0) found = {h, oa, ob};
        return !found.out.valid();
      });
    };
    const V tip = result.tip;
    search(tip);
    if (found.out.valid() || !mesh_.on_border(tip)) return found;
    for_each_twin(body_, tip, [&](V twin) {
      if (found.out.valid()) return;
      search(twin);
      if (found.out.valid()) result.tip = twin;
    });
    return found;
  }

  /// Is v the vertex at which the path left the body, or a twin? Its edges were no way on, and rounding must not make them one.
  [[nodiscard]] bool is_left_at(V v) const { return left_at_.valid() && mesh_.ancestor[v] == mesh_.ancestor[left_at_]; }

  /// The nearest border, from `beyond` (part of the way) on, that the ray from position_ to q crosses inwards.
  bool find_entry(Vec2 q, double& beyond, FacePoint& entry) {
    const Vec2 x = chart_(position_), d = q - x;
    double nearest = 2, last = 0;
    for (const H h : ids<H>(mesh_.half_edge_count())) {
      if (!mesh_.is_border(h) || is_left_at(mesh_.from(h)) || is_left_at(mesh_.to(h))) continue;
      const Vec2 a = at(h), b = at(CollisionMesh::next(h)), e = b - a;
      const double facing = cross(e, d);
      if (!(facing > 0) || !(orient(a, b, at(CollisionMesh::prev(h))) > 0)) continue;
      const double s = -cross(e, x - a) / facing;
      if (!(s > beyond) || !(s < nearest) || s > 1) continue;
      const double progress = dot(x + s * d - entry_start_, q - entry_start_) / norm(q - entry_start_);
      if (progress < least_progress_) continue;
      const double t = cross(d, a - x) / facing;
      if (t < -1e-12 || t > 1 + 1e-12) continue;
      nearest = s;
      last = progress;
      entry.face = CollisionMesh::face(h);
      entry.weights = {};
      const double u = std::clamp(t, 0.0, 1.0);
      entry.weights[static_cast<std::size_t>(h.value % 3)] = 1 - u;
      entry.weights[static_cast<std::size_t>((h.value + 1) % 3)] = u;
    }
    if (nearest > 1) return false;
    beyond = std::max(nearest + 1e-9, beyond);
    last_progress_ = last;
    return true;
  }

  CellComplex& body_;
  CollisionMesh& mesh_;
  const CutOptions& options_;
  CutScratch& scratch_;
  double feature_;
  V left_at_;
  Vec3 position_;  ///< where the ray starts while the path is outside
  Chart chart_{};
  Vec2 entry_start_;
  double least_progress_ = 0, last_progress_ = 0;  ///< metres along the segment
};

}  // namespace

FacePoint nearest_rest_point(const CellComplex& body, Vec3 p, double& distance) {
  const CollisionMesh& mesh = body.collision;
  FacePoint best;
  distance = std::numeric_limits<double>::infinity();
  for (const F f : ids<F>(mesh.face_count())) {
    const Vec3 a = mesh.rest[mesh.origin[CollisionMesh::corner(f, 0)]];
    const Vec3 b = mesh.rest[mesh.origin[CollisionMesh::corner(f, 1)]];
    const Vec3 c = mesh.rest[mesh.origin[CollisionMesh::corner(f, 2)]];
    const auto w = nearest_weights(p, a, b, c);
    const double d = norm(p - (w[0] * a + w[1] * b + w[2] * c));
    if (d < distance) {
      distance = d;
      best = {f, w};
    }
  }
  return best;
}

Result<RestCut> cut_rest_polyline(CellComplex& body, std::span<const Vec3> points, const CutOptions& options,
                                  CutScratch& scratch) {
  if (points.size() < 2) return bad_input("cut: a path needs at least two points");
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!is_finite(points[i])) return bad_input(fmt::format("cut: point {} of the path is not finite", i + 1));
  Tracer tracer(body, options, scratch);
  KERF_TRY(tracer.start(points[0]));
  const double tolerance = options.path_tolerance * body.mean_root_edge;
  std::size_t last = 0;
  while (last + 1 < points.size()) {
    // As far as all points skipped stay within the tolerance of the chord.
    std::size_t next = last + 1;
    for (bool fits = true; fits && next + 1 < points.size();) {
      const Vec3 a = points[last], d = points[next + 1] - a;
      const double length = dot(d, d);
      for (std::size_t i = last + 1; i <= next && fits; ++i) {
        const double s = length > 0 ? std::clamp(dot(points[i] - a, d) / length, 0.0, 1.0) : 0.0;
        fits = norm(points[i] - (a + s * d)) < tolerance;
      }
      if (fits) ++next;
    }
    KERF_TRY(tracer.go_to(points[next]));
    last = next;
  }
  return tracer.result;
}

}  // namespace kerf
