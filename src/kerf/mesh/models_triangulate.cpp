// Triangulation of an outline with a given number of inner vertices: ears, insertion, Lawson flips, relaxation.
#include <algorithm>
#include <cmath>

#include "kerf/base/at.h"
#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/models_planar.h"

namespace kerf::models {
namespace {

constexpr int kRelaxations = 150;       // sweeps; the smallest angles stop growing after about 100
constexpr double kFlipMargin = 1e-10;   // relative to the fourth power of the edges: cocircular points are left alone
constexpr double kWallDistance = 0.55;  // of the spacing: first distance of inner vertices from the outline

using Index = std::int32_t;
double turn(Vec2 a, Vec2 b, Vec2 c) { return cross(b - a, c - a); }

class Builder {
 public:
  explicit Builder(const std::vector<Vec2>& outline) : points_(outline), outline_(outline.size()) {}

  void clip_ears() {
    std::vector<Index> left(outline_);
    for (std::size_t i = 0; i < outline_; ++i) left[i] = static_cast<Index>(i);
    while (left.size() > 2) {
      std::size_t best = 0;
      double best_angle = -1;  // of all ears the one with the largest smallest angle
      for (std::size_t i = 0; i < left.size(); ++i) {
        const Index a = left[(i + left.size() - 1) % left.size()], b = left[i], c = left[(i + 1) % left.size()];
        if (turn(points_[at(a)], points_[at(b)], points_[at(c)]) <= 0) continue;
        const bool free = std::none_of(left.begin(), left.end(), [&](Index v) {
          if (v == a || v == b || v == c) return false;
          const Vec2 p = points_[at(v)];
          return turn(points_[at(a)], points_[at(b)], p) >= 0 && turn(points_[at(b)], points_[at(c)], p) >= 0 &&
                 turn(points_[at(c)], points_[at(a)], p) >= 0;
        });
        const double angle = smallest_angle(a, b, c);
        if (free && angle > best_angle) {
          best_angle = angle;
          best = i;
        }
      }
      KERF_ASSERT(best_angle >= 0);  // the outline crosses itself
      triangles_.push_back({left[(best + left.size() - 1) % left.size()], left[best], left[(best + 1) % left.size()]});
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    }
    connect();
    flip_all();
  }

  void insert(Vec2 p) {
    for (std::size_t f = 0; f < triangles_.size(); ++f) {
      const auto t = triangles_[f];
      if (turn(points_[at(t[0])], points_[at(t[1])], p) < 0 || turn(points_[at(t[1])], points_[at(t[2])], p) < 0 ||
          turn(points_[at(t[2])], points_[at(t[0])], p) < 0)
        continue;
      const auto v = static_cast<Index>(points_.size());
      points_.push_back(p);
      const auto f0 = static_cast<Index>(f), f1 = static_cast<Index>(triangles_.size()), f2 = f1 + 1;
      const std::array<Index, 3> outer{twin_[3 * f], twin_[3 * f + 1], twin_[3 * f + 2]};
      triangles_[f] = {t[0], t[1], v};
      triangles_.push_back({t[1], t[2], v});
      triangles_.push_back({t[2], t[0], v});
      twin_.resize(3 * triangles_.size(), -1);
      const std::array<Index, 3> faces{f0, f1, f2};
      for (std::size_t i = 0; i < 3; ++i) {
        join(3 * faces[i], outer[i]);
        join(3 * faces[i] + 1, 3 * faces[(i + 1) % 3] + 2);
      }
      legalize({3 * f0, 3 * f1, 3 * f2});
      return;
    }
    KERF_ASSERT(false);  // p is outside
  }

  /// Moves every inner vertex towards the area centroid of its fan, then flips.
  void relax() {
    std::vector<Vec2> sum(points_.size());
    std::vector<double> weight(points_.size(), 0);
    for (const auto& t : triangles_) {
      const Vec2 a = points_[at(t[0])], b = points_[at(t[1])], c = points_[at(t[2])];
      const double area = turn(a, b, c);
      for (const Index v : t) {
        sum[at(v)] = sum[at(v)] + (area / 3) * (a + b + c);
        weight[at(v)] += area;
      }
    }
    std::vector<Vec2> before = points_;
    for (std::size_t v = outline_; v < points_.size(); ++v)
      points_[v] = lerp(points_[v], (1 / weight[v]) * sum[v], 0.8);
    for (bool turned = true; turned;) {  // take back what would turn a triangle over
      turned = false;
      for (const auto& t : triangles_)
        if (turn(points_[at(t[0])], points_[at(t[1])], points_[at(t[2])]) <= 0) {
          turned = true;
          for (const Index v : t) points_[at(v)] = before[at(v)];
        }
    }
    flip_all();
  }

  /// Turns the inner edge of triangles with two border edges, so that every border vertex has an inner edge.
  void open_corners() {
    for (std::size_t f = 0; f < triangles_.size(); ++f) {
      const auto h = static_cast<Index>(3 * f);
      if ((twin_[at(h)] < 0) + (twin_[at(h + 1)] < 0) + (twin_[at(h + 2)] < 0) != 2) continue;
      for (Index i = 0; i < 3; ++i)
        if (twin_[at(h + i)] >= 0 && convex(h + i)) {
          flip(h + i);
          break;
        }
    }
  }

  PlanarMesh take() {
    PlanarMesh mesh;
    mesh.points = std::move(points_);
    mesh.triangles = std::move(triangles_);
    find_loops(mesh);
    return mesh;
  }

 private:
  static Index next(Index h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static Index prev(Index h) { return h % 3 == 0 ? h + 2 : h - 1; }
  [[nodiscard]] Index origin(Index h) const { return triangles_[at(h / 3)][at(h % 3)]; }
  [[nodiscard]] Vec2 place(Index h) const { return points_[at(origin(h))]; }

  [[nodiscard]] double smallest_angle(Index a, Index b, Index c) const {
    double smallest = M_PI;
    const std::array<Vec2, 3> p{points_[at(a)], points_[at(b)], points_[at(c)]};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec2 u = p[(i + 1) % 3] - p[i], v = p[(i + 2) % 3] - p[i];
      smallest = std::min(smallest, std::atan2(cross(u, v), dot(u, v)));
    }
    return smallest;
  }

  void connect() {
    auto built = build_half_edges(triangles_, points_.size());
    KERF_ASSERT(built.ok());
    twin_ = std::move(built->twin);
  }
  void join(Index h, Index g) {
    twin_[at(h)] = g;
    if (g >= 0) twin_[at(g)] = h;
  }

  /// Whether both triangles of h stay counter-clockwise when h is flipped.
  [[nodiscard]] bool convex(Index h) const {
    const Index g = twin_[at(h)];
    const Vec2 a = place(h), b = place(g), c = place(prev(h)), d = place(prev(g));
    return turn(a, d, c) > 0 && turn(d, b, c) > 0;
  }
  [[nodiscard]] bool should_flip(Index h) const {
    const Index g = twin_[at(h)];
    if (g < 0 || !convex(h)) return false;
    const Vec2 a = place(h), b = place(g), d = place(prev(g)), c = place(prev(h));
    const Vec2 u = a - d, v = b - d, w = c - d;
    const double det = dot(u, u) * cross(v, w) + dot(v, v) * cross(w, u) + dot(w, w) * cross(u, v);
    const double size = dot(u, u) + dot(v, v) + dot(w, w);
    return det > kFlipMargin * size * size;
  }
  /// h = a b with apex c, twin b a with apex d, become d c.
  void flip(Index h) {
    const Index g = twin_[at(h)], f = h / 3, e = g / 3;
    const Index a = origin(h), b = origin(g), c = origin(prev(h)), d = origin(prev(g));
    const Index bc = twin_[at(next(h))], ca = twin_[at(prev(h))], ad = twin_[at(next(g))], db = twin_[at(prev(g))];
    triangles_[at(f)] = {a, d, c};
    triangles_[at(e)] = {d, b, c};
    join(3 * f, ad);
    join(3 * f + 2, ca);
    join(3 * e, db);
    join(3 * e + 1, bc);
    join(3 * f + 1, 3 * e + 2);
  }
  void legalize(std::vector<Index> edges) {
    while (!edges.empty()) {
      const Index h = edges.back();
      edges.pop_back();
      if (twin_[at(h)] < 0 || !should_flip(h)) continue;
      const Index f = h / 3, e = twin_[at(h)] / 3;
      flip(h);
      for (const Index k : {3 * f, 3 * f + 2, 3 * e, 3 * e + 1}) edges.push_back(k);
    }
  }
  void flip_all() {
    std::vector<Index> edges(twin_.size());
    for (std::size_t h = 0; h < edges.size(); ++h) edges[h] = static_cast<Index>(h);
    legalize(std::move(edges));
  }

  std::vector<Vec2> points_;
  std::size_t outline_;
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<Index> twin_;
};

/// Points of a triangular grid that lie inside the outline and not too near to it.
std::vector<Vec2> grid_inside(const std::vector<Vec2>& outline, double spacing) {
  Vec2 lo = outline[0], hi = outline[0];
  for (const Vec2 p : outline) {
    lo = {std::min(lo.x, p.x), std::min(lo.y, p.y)};
    hi = {std::max(hi.x, p.x), std::max(hi.y, p.y)};
  }
  std::vector<Vec2> inside;
  const double row = spacing * std::sqrt(0.75);
  int parity = 0;
  for (double y = lo.y + 0.37 * row; y < hi.y; y += row, parity ^= 1)
    for (double x = lo.x + (parity ? 0.81 : 0.31) * spacing; x < hi.x; x += spacing) {
      const Vec2 p{x, y};
      bool in = false;
      double nearest = HUGE_VAL;
      for (std::size_t i = 0; i < outline.size(); ++i) {
        const Vec2 a = outline[i], b = outline[(i + 1) % outline.size()], e = b - a;
        if ((a.y > y) != (b.y > y) && x < a.x + (y - a.y) / (b.y - a.y) * e.x) in = !in;
        const double t = std::clamp(dot(p - a, e) / dot(e, e), 0.0, 1.0);
        nearest = std::min(nearest, norm(p - lerp(a, b, t)));
      }
      if (in && nearest > kWallDistance * spacing) inside.push_back(p);
    }
  return inside;
}

}  // namespace

PlanarMesh triangulate(const std::vector<Vec2>& outline, int inner) {
  // The widest grid with enough points; the surplus is dropped evenly and the relaxation closes the gaps.
  double area = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) area += cross(outline[i], outline[(i + 1) % outline.size()]) / 2;
  double spacing = 1.3 * std::sqrt(area / (inner + 1.0));
  std::vector<Vec2> inside = grid_inside(outline, spacing);
  while (inside.size() < static_cast<std::size_t>(inner)) inside = grid_inside(outline, spacing *= 0.995);

  Builder builder(outline);
  builder.clip_ears();
  const std::size_t have = inside.size(), want = static_cast<std::size_t>(inner);
  for (std::size_t i = 0; i < have; ++i)
    if ((i + 1) * want / have > i * want / have) builder.insert(inside[i]);
  for (int i = 0; i < kRelaxations; ++i) builder.relax();
  builder.open_corners();
  return builder.take();
}

}  // namespace kerf::models
