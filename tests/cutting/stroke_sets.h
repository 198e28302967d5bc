// Sets of strokes for a flat body, made up from a seed: what hands draw, and what is hard.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "cutting/stroke_body.h"

namespace kerf::testing_support {

enum class SetKind {
  kLines,
  kTurns,
  kStars,
  kZigzags,
  kSpirals,
  kDice,
  kLoops,
  kCombs,
  kBeside,
  kThroughVertices,
  kAlongEdges,
  kPolylines
};
inline constexpr const char* kSetKinds[] = {"lines", "turns", "stars",  "zigzags",          "spirals",     "dice",
                                            "loops", "combs", "beside", "through vertices", "along edges", "polylines"};

/// The body's plane, and the mesh that the strokes may follow. The body is a square of `size` metres about the origin.
class StrokeSets {
 public:
  StrokeSets(const CollisionMesh& mesh, double size, double edge) : mesh_(mesh), size_(size), edge_(edge) {}

  [[nodiscard]] std::vector<Stroke> make(SetKind kind, Random& random) const {
    switch (kind) {
      case SetKind::kLines:
        return several(1 + random.index(5), [&] { return Stroke{anywhere(random), anywhere(random)}; });
      case SetKind::kTurns: return several(1 + random.index(2), [&] { return turn(random); });
      case SetKind::kStars: return star(random);
      case SetKind::kZigzags: return several(1 + random.index(2), [&] { return zigzag(random); });
      case SetKind::kSpirals: return {spiral(random)};
      case SetKind::kDice: return dice(random);
      case SetKind::kLoops: return loops(random);
      case SetKind::kCombs: return comb(random);
      case SetKind::kBeside: return beside(random);
      case SetKind::kThroughVertices: return several(1 + random.index(3), [&] { return through_vertices(random); });
      case SetKind::kAlongEdges: return several(1 + random.index(3), [&] { return along_edges(random); });
      case SetKind::kPolylines:
        return several(2 + random.index(3), [&] { return polyline(random, 2 + random.index(5)); });
    }
    return {};
  }

 private:
  static constexpr double kPi = std::numbers::pi;

  template <class Make>
  static std::vector<Stroke> several(int count, Make&& make) {
    std::vector<Stroke> strokes;
    for (int i = 0; i < count; ++i) strokes.push_back(make());
    return strokes;
  }
  [[nodiscard]] Vec2 anywhere(Random& random, double share = 0.65) const {
    return {random.uniform(-share, share) * size_, random.uniform(-share, share) * size_};
  }
  static Vec2 heading(double angle) { return {std::cos(angle), std::sin(angle)}; }
  /// A billionth to a tenth of an edge, either way; now and then nothing.
  [[nodiscard]] double little(Random& random) const {
    if (random.index(6) == 0) return 0;
    return (random.index(2) ? 1 : -1) * edge_ * std::pow(10, random.uniform(-9, -1));
  }
  [[nodiscard]] Vec2 vertex(Random& random) const {
    const Vec3 v = mesh_.rest[CollisionVertex(random.index(static_cast<int>(mesh_.vertex_count())))];
    return {v.x, v.y};
  }

  [[nodiscard]] Stroke polyline(Random& random, int points) const {
    Stroke s;
    for (int i = 0; i < points; ++i) s.push_back(anywhere(random));
    return s;
  }
  [[nodiscard]] Stroke turn(Random& random) const {
    const Vec2 corner = anywhere(random, 0.4);
    const double angle = random.uniform(0, 2 * kPi), inner = random.uniform(5, 170) * kPi / 180;
    return {corner + 1.5 * size_ * heading(angle), corner, corner + 1.5 * size_ * heading(angle + inner)};
  }
  [[nodiscard]] std::vector<Stroke> star(Random& random) const {
    const Vec2 middle = random.index(2) ? vertex(random) : anywhere(random, 0.3);
    const int lines = 2 + random.index(4);
    const double first = random.uniform(0, kPi), spread = random.uniform(0.5, 1) * kPi / lines;
    std::vector<Stroke> strokes;
    for (int i = 0; i < lines; ++i) {
      const Vec2 along = 1.5 * size_ * heading(first + i * spread), at = middle + Vec2{little(random), little(random)};
      strokes.push_back({at - along, at + along});
    }
    return strokes;
  }
  [[nodiscard]] Stroke zigzag(Random& random) const {
    const double angle = random.uniform(0, 2 * kPi), step = edge_ * random.uniform(0.2, 2),
                 wide = edge_ * random.uniform(0.2, 3);
    const Vec2 along = heading(angle), across{-along.y, along.x};
    Vec2 p = anywhere(random, 0.2) - 0.8 * size_ * along;
    Stroke s;
    for (int i = 0; i * step < 1.6 * size_; ++i) s.push_back(p + i * step * along + (i % 2 ? wide : 0) * across);
    return s;
  }
  [[nodiscard]] Stroke spiral(Random& random) const {
    const Vec2 middle = anywhere(random, 0.1);
    const double gap = edge_ * random.uniform(0.3, 1.5), first = random.uniform(0, 2 * kPi);
    Stroke s;
    for (int i = 0; i < 120; ++i) {
      const double angle = 0.3 * i, radius = 0.2 * edge_ + gap * angle / (2 * kPi);
      if (radius > 0.45 * size_) break;
      s.push_back(middle + radius * heading(first + angle));
    }
    if (random.index(2)) std::reverse(s.begin(), s.end());
    return s;
  }
  [[nodiscard]] std::vector<Stroke> dice(Random& random) const {
    const int columns = 1 + random.index(9), rows = 1 + random.index(9);
    const double angle = random.index(3) ? random.uniform(0, kPi) : 0, off = little(random);
    const Vec2 x = heading(angle), y{-x.y, x.x};
    std::vector<Stroke> strokes;
    for (int i = 1; i <= columns; ++i) {
      const double at = size_ * (static_cast<double>(i) / (columns + 1) - 0.5) + off;
      strokes.push_back({at * x - 0.9 * size_ * y, at * x + 0.9 * size_ * y});
    }
    for (int i = 1; i <= rows; ++i) {
      const double at = size_ * (static_cast<double>(i) / (rows + 1) - 0.5) - off;
      strokes.push_back({at * y + 0.9 * size_ * x, at * y - 0.9 * size_ * x});
    }
    return strokes;
  }
  [[nodiscard]] std::vector<Stroke> loops(Random& random) const {
    const Vec2 middle = anywhere(random, 0.15);
    const double shrink = random.uniform(0.5, 0.85);
    std::vector<Stroke> strokes;
    double radius = random.uniform(0.1, 0.33) * size_;
    for (int i = 1 + random.index(4); i > 0 && radius > 0.3 * edge_; --i, radius *= shrink) {
      const int corners = 3 + random.index(30);
      const double first = random.uniform(0, 2 * kPi), way = random.index(2) ? 1 : -1;
      Stroke s;
      for (int k = 0; k < corners; ++k) s.push_back(middle + radius * heading(first + way * 2 * kPi * k / corners));
      s.push_back(s.front());
      strokes.push_back(s);
    }
    return strokes;
  }
  /// Parallel lines from over the rim: right through, or open at one end.
  [[nodiscard]] std::vector<Stroke> comb(Random& random) const {
    const int lines = 2 + random.index(6);
    const double angle = random.uniform(0, 2 * kPi), gap = edge_ * std::pow(10, random.uniform(-1.5, 0.2)),
                 far = random.index(2) ? 0.9 : random.uniform(-0.3, 0.3);
    const Vec2 y = heading(angle), x{-y.y, y.x}, middle = anywhere(random, 0.15);
    std::vector<Stroke> strokes;
    for (int i = 0; i < lines; ++i) {
      const Vec2 at = middle + (i - 0.5 * lines) * gap * x;
      strokes.push_back({at - 0.9 * size_ * y, at + far * size_ * y});
      if (random.index(2) && far == 0.9) std::swap(strokes.back()[0], strokes.back()[1]);
    }
    return strokes;
  }
  /// A stroke, and others that run beside it, on it or over its ends.
  [[nodiscard]] std::vector<Stroke> beside(Random& random) const {
    const Stroke first = polyline(random, 2 + random.index(2));
    std::vector<Stroke> strokes{first};
    for (int i = 1 + random.index(2); i > 0; --i) {
      const std::size_t k = static_cast<std::size_t>(random.index(static_cast<int>(first.size()) - 1));
      const Vec2 a = first[k], d = first[k + 1] - a, n = (1 / norm(d)) * Vec2{-d.y, d.x};
      const double s = random.uniform(-0.4, 0.6), t = random.uniform(0.4, 1.4);
      Stroke other{a + s * d + little(random) * n, a + t * d + little(random) * n};
      if (random.index(2)) std::swap(other[0], other[1]);
      if (random.index(2)) other.push_back(anywhere(random));
      strokes.push_back(other);
    }
    return strokes;
  }
  [[nodiscard]] Stroke through_vertices(Random& random) const {
    Stroke s;
    for (int i = 2 + random.index(4); i > 0; --i) s.push_back(vertex(random) + Vec2{little(random), little(random)});
    if (random.index(2)) s.insert(s.begin(), anywhere(random));
    return s;
  }
  [[nodiscard]] Stroke along_edges(Random& random) const {
    CollisionVertex v(random.index(static_cast<int>(mesh_.vertex_count())));
    Stroke s;
    for (int i = 2 + random.index(8); i > 0; --i) {
      const Vec2 p{mesh_.rest[v].x, mesh_.rest[v].y};
      if (s.empty() || norm(p - s.back()) > 0.1 * edge_) s.push_back(p);
      const std::vector<CollisionVertex> next = neighbours(v);
      v = next[static_cast<std::size_t>(random.index(static_cast<int>(next.size())))];
    }
    if (s.size() < 2) s.push_back(anywhere(random));
    const Vec2 off{little(random), little(random)};
    for (Vec2& p : s) p = p + off;
    return s;
  }
  [[nodiscard]] std::vector<CollisionVertex> neighbours(CollisionVertex v) const {
    std::vector<CollisionVertex> found;
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh_.half_edge_count())) {
      if (mesh_.from(h) == v) found.push_back(mesh_.to(h));
      if (mesh_.to(h) == v && mesh_.is_border(h)) found.push_back(mesh_.from(h));
    }
    return found;
  }

  const CollisionMesh& mesh_;
  double size_, edge_;
};

}  // namespace kerf::testing_support
