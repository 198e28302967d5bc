// A bound body cut by strokes of an upright blade, one after another, without mechanics; and a judge of what should have come apart, who
// knows nothing of meshes.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/validate.h"
#include "kerf/mesh/models.h"

#include "cutting/move_blade.h"
#include "support/plane_faces.h"

namespace kerf::testing_support {

/// A polyline in the plane, metres.
using Stroke = std::vector<Vec2>;

struct StrokeBody {
  CellComplex body;
  std::vector<Vec3> position, posed;
  FaceBoxes boxes;
  CutScratch scratch;
  CutOptions options;
  BladeStroke stroke;
  ComplexMeasures start;
  JournalMark uncut;
  Box3 box;
  std::vector<std::array<Vec2, 2>> outline;  ///< of the uncut body
  double reach = 0;                          ///< of the blade to both sides of z = 0, metres
  double tilt = 0;                           ///< so much the blade leans over to +x at its end
  Vec3 (*deform)(Vec3) = [](Vec3 p) { return p; };
  Vec3 trembling;  ///< metres: so far all of it goes to and fro, with each pose
  int refused = 0;
  LeaningCut leaning;  ///< the most since the body was whole

  explicit StrokeBody(std::string_view name, std::size_t visual_triangles = 0) {
    ModelOptions size;
    size.visual_triangles = visual_triangles;
    const auto model = make_model(name, size);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
    begin(model->visual, model->collision);
  }
  StrokeBody(const TriangleMesh& visual, const TriangleMesh& collision) { begin(visual, collision); }
  void begin(const TriangleMesh& visual, const TriangleMesh& collision) {
    auto bound = bind(visual, collision, {});
    EXPECT_TRUE(bound.ok()) << (bound.ok() ? "" : bound.error().message);
    body = std::move(bound->complex);
    const CollisionMesh& mesh = body.collision;
    for (const Vec3& p : mesh.rest.raw()) box.add(p);
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count())) {
      const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)];
      if (mesh.is_border(h)) outline.push_back({{{a.x, a.y}, {b.x, b.y}}});
    }
    reach = 0.25 * norm(box.max - box.min);
    start = measure_complex(body);
    journal_mark(body, uncut);
    place();
  }
  void place() {
    position.clear();
    boxes.forget();
    for (const Vec3& p : body.collision.rest.raw()) position.push_back(deform(p));
  }
  void tremble() {
    for (Vec3& p : position) p += trembling;
    trembling = -1 * trembling;
    boxes.forget();
  }
  void make_whole() {
    lift_blade(stroke);
    journal_rollback(body, uncut);
    place();
    refused = 0;
    leaning = {};
  }
  [[nodiscard]] BladeEdge edge_at(Vec2 p) const { return {{p.x - tilt, p.y, reach}, {p.x + tilt, p.y, -reach}}; }
  void move(Vec2 p) {
    const SweepReport report = move_blade(*this, edge_at(p));
    refused += report.refused;
    if (report.leaning.distance > leaning.distance) leaning = report.leaning;
  }
  /// So many poses for each segment.
  void cut(const Stroke& path, int poses = 40) {
    place();
    move(path[0]);
    for (std::size_t k = 0; k + 1 < path.size(); ++k)
      for (int i = 1; i <= poses; ++i) {
        if (norm(trembling) > 0) tremble();
        move(lerp(path[k], path[k + 1], static_cast<double>(i) / poses));
      }
    lift_blade(stroke);
  }
  [[nodiscard]] int pieces() const { return collision_pieces(body).count; }
  /// Edges that were cut, at rest.
  [[nodiscard]] std::vector<std::array<Vec2, 2>> cut_edges() const {
    std::vector<std::array<Vec2, 2>> edges;
    const CollisionMesh& m = body.collision;
    for (const CollisionHalfEdge h : body.wall_edge.raw()) {
      const Vec3 a = m.rest[m.from(h)], b = m.rest[m.to(h)];
      edges.push_back({{{a.x, a.y}, {b.x, b.y}}});
    }
    return edges;
  }
};

inline std::string text_of(const std::vector<Stroke>& strokes) {
  std::string text;
  for (const Stroke& s : strokes) {
    text += " |";
    for (const Vec2 p : s) text += fmt::format(" {},{}", p.x, p.y);
  }
  return text;
}

/// What strokes part, on a grid of points; where the grid says that something should have come apart, the exact faces between strokes and outline decide. Within `margin` metres of a stroke, or of its ends, cuts snap: there anything goes. A stroke that ends where it began is closed.
struct StrokeJudge {
  static constexpr int kPoints = 160;                    ///< along the longer side
  static constexpr int kFew = kPoints * kPoints / 5000;  ///< points that make no part of their own
  double margin = 0;
  double joined = 0;  ///< a turn nearer than this to the rim or to an earlier stroke is joined to it, metres
  struct Verdict {
    int bridges = 0;  ///< parts that the strokes make, but in one piece with another
    int severed = 0;  ///< pieces in one part, joined by a channel at least 2 margins wide
  };

  static double cross_of(Vec2 a, Vec2 b, Vec2 c) { return cross(b - a, c - a); }
  static bool meet(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
    return (cross_of(a, b, c) > 0) != (cross_of(a, b, d) > 0) && (cross_of(c, d, a) > 0) != (cross_of(c, d, b) > 0);
  }
  static double distance(Vec2 p, Vec2 a, Vec2 b) {
    const double t = std::clamp(dot(p - a, b - a) / std::max(dot(b - a, b - a), 1e-300), 0.0, 1.0);
    return norm(p - lerp(a, b, t));
  }
  static std::size_t root(std::vector<std::size_t>& parent, std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }

  /// How far cuts lie from the strokes that made them, metres.
  struct Deviation {
    double stray = 0;   ///< of the farthest place of a cut, to the nearest stroke
    double missed = 0;  ///< of the farthest place of a stroke inside the body, to the nearest cut or the outline
  };
  [[nodiscard]] static Deviation deviation(const StrokeBody& b, const std::vector<Stroke>& strokes) {
    std::vector<std::array<Vec2, 2>> cuts = b.cut_edges(), paths;
    for (const Stroke& s : strokes) {
      Box3 box;
      for (const Vec2 p : s) box.add({p.x, p.y, 0});
      if (norm(box.size()) < b.options.minimum_feature * b.body.mean_root_edge) continue;  // too short to be cut
      for (std::size_t k = 0; k + 1 < s.size(); ++k) paths.push_back({s[k], s[k + 1]});
    }
    const auto farthest = [](const auto& of, const auto& from, double step, auto&& counts) {
      double far = 0;
      for (const auto& [p, q] : of) {
        const int parts = std::max(1, static_cast<int>(std::ceil(norm(q - p) / step)));
        for (int i = 0; i <= parts; ++i) {
          const Vec2 x = lerp(p, q, static_cast<double>(i) / parts);
          if (!counts(x)) continue;
          double near = HUGE_VAL;
          for (const auto& [a, c] : from) near = std::min(near, distance(x, a, c));
          far = std::max(far, near);
        }
      }
      return far;
    };
    const double step = 0.05 * b.body.mean_root_edge;
    Deviation d;
    d.stray = farthest(cuts, paths, step, [](Vec2) { return true; });
    cuts.insert(cuts.end(), b.outline.begin(), b.outline.end());
    d.missed = farthest(paths, cuts, step, [&](Vec2 p) {
      return p.x > b.box.min.x && p.x < b.box.max.x && p.y > b.box.min.y && p.y < b.box.max.y;
    });
    return d;
  }

  [[nodiscard]] Verdict judge(const StrokeBody& b, const std::vector<Stroke>& strokes) const {
    std::vector<std::array<Vec2, 2>> whole, shortened;
    for (Stroke s : strokes) {
      for (std::size_t k = 0; k + 1 < s.size(); ++k) whole.push_back({s[k], s[k + 1]});
      const auto shorten = [&](Vec2& end, Vec2 to) {
        end = lerp(end, to, std::min(1.0, margin / std::max(norm(to - end), 1e-300)));
      };
      if (!(s.front() == s.back())) {
        shorten(s.front(), s[1]);
        shorten(s.back(), s[s.size() - 2]);
      }
      for (std::size_t k = 0; k + 1 < s.size(); ++k) shortened.push_back({s[k], s[k + 1]});
    }
    const double step = std::max(b.box.max.x - b.box.min.x, b.box.max.y - b.box.min.y) / kPoints;
    constexpr std::size_t kN = kPoints;
    const auto point = [&](std::size_t i) {
      return Vec2{b.box.min.x + step * (static_cast<double>(i / kN) + 0.5037),
                  b.box.min.y + step * (static_cast<double>(i % kN) + 0.4971)};
    };
    const std::vector<int> piece = pieces_at(b, step);
    std::vector<std::uint8_t> near(kN * kN);
    std::vector<std::size_t> part(kN * kN), channel(kN * kN);
    std::iota(part.begin(), part.end(), std::size_t{0});
    channel = part;
    for (std::size_t i = 0; i < kN * kN; ++i)
      near[i] = std::any_of(whole.begin(), whole.end(),
                            [&](const auto& s) { return distance(point(i), s[0], s[1]) < margin; });
    for (std::size_t i = 0; i < kN * kN; ++i)
      for (const std::size_t j : {i + 1, i + kN}) {
        if (j >= kN * kN || (j == i + 1 && j % kN == 0) || piece[i] < 0 || piece[j] < 0) continue;
        if (std::none_of(shortened.begin(), shortened.end(),
                         [&](const auto& s) { return meet(point(i), point(j), s[0], s[1]); }))
          part[root(part, i)] = root(part, j);
        if (!near[i] && !near[j]) channel[root(channel, i)] = root(channel, j);
      }
    std::map<std::pair<int, std::size_t>, int> parts_of_piece;
    std::map<std::pair<std::size_t, int>, int> pieces_of_channel;
    for (std::size_t i = 0; i < kN * kN; ++i) {
      if (near[i] || piece[i] < 0) continue;
      ++parts_of_piece[{piece[i], root(part, i)}];
      ++pieces_of_channel[{root(channel, i), piece[i]}];
    }
    const int severed = surplus(pieces_of_channel);
    if (surplus(parts_of_piece) == 0) return {0, severed};

    // The point of each part that is farthest from all strokes.
    std::map<std::pair<int, std::size_t>, std::pair<double, std::size_t>> middles;
    for (std::size_t i = 0; i < kN * kN; ++i) {
      if (near[i] || piece[i] < 0 || parts_of_piece[{piece[i], root(part, i)}] <= kFew) continue;
      double far = HUGE_VAL;
      for (const auto& s : whole) far = std::min(far, distance(point(i), s[0], s[1]));
      auto& [farthest, middle] = middles[{piece[i], root(part, i)}];
      if (far > farthest) farthest = far, middle = i;
    }
    std::vector<std::array<Vec2, 2>> lines = b.outline;
    lines.insert(lines.end(), shortened.begin(), shortened.end());
    join_turns(b, strokes, lines);
    const PlaneFaces faces(lines);
    std::map<std::pair<int, const void*>, int> faces_of_piece;
    for (const auto& [key, middle] : middles)
      faces_of_piece[{key.first, faces.face_of(point(middle.second))}] = kFew + 1;
    return {surplus(faces_of_piece), severed};
  }

  /// Lines from turns to what they are joined to.
  void join_turns(const StrokeBody& b, const std::vector<Stroke>& strokes,
                  std::vector<std::array<Vec2, 2>>& lines) const {
    std::vector<std::array<Vec2, 2>> earlier = b.outline;
    const auto join = [&](Vec2 p) {
      for (const auto& [from, to] : earlier) {
        const double t = std::clamp(dot(p - from, to - from) / std::max(dot(to - from, to - from), 1e-300), 0.0, 1.0);
        const Vec2 way = lerp(from, to, t) - p;
        if (norm(way) > 0 && norm(way) < joined) lines.push_back({p, p + 1.01 * way});
      }
    };
    for (const Stroke& s : strokes)
      for (std::size_t k = 0; k + 1 < s.size(); ++k) {
        if (k + 2 < s.size()) join(s[k + 1]);
        earlier.push_back({s[k], s[k + 1]});
      }
  }

  /// How many more entries there are than first keys, counting those of more than a few points.
  template <class Count>
  static int surplus(const Count& count) {
    std::set<std::remove_const_t<decltype(count.begin()->first.first)>> first;
    int entries = 0;
    for (const auto& [key, n] : count)
      if (n > kFew) first.insert(key.first), ++entries;
    return entries - static_cast<int>(first.size());
  }

  /// The piece that each point of the grid lies in; -1: none.
  static std::vector<int> pieces_at(const StrokeBody& b, double step) {
    const CollisionMesh& m = b.body.collision;
    const Pieces pieces = collision_pieces(b.body);
    std::vector<int> piece(static_cast<std::size_t>(kPoints) * kPoints, -1);
    for (const CollisionTriangle f : ids<CollisionTriangle>(m.face_count())) {
      std::array<Vec2, 3> p;
      Vec2 least{HUGE_VAL, HUGE_VAL}, most{-HUGE_VAL, -HUGE_VAL};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 x = m.rest[m.from(CollisionMesh::corner(f, static_cast<int>(k)))];
        p[k] = {x.x, x.y};
        least = {std::min(least.x, x.x), std::min(least.y, x.y)};
        most = {std::max(most.x, x.x), std::max(most.y, x.y)};
      }
      const auto cell = [&](double x, double from) {
        return std::clamp(static_cast<int>((x - from) / step), 0, kPoints - 1);
      };
      for (int i = cell(least.x, b.box.min.x); i <= cell(most.x, b.box.min.x); ++i)
        for (int j = cell(least.y, b.box.min.y); j <= cell(most.y, b.box.min.y); ++j) {
          const Vec2 q{b.box.min.x + step * (i + 0.5037), b.box.min.y + step * (j + 0.4971)};
          if (cross_of(p[0], p[1], q) >= 0 && cross_of(p[1], p[2], q) >= 0 && cross_of(p[2], p[0], q) >= 0)
            piece[static_cast<std::size_t>(i * kPoints + j)] = static_cast<int>(pieces.of_face[f.index()]);
        }
    }
    return piece;
  }
};

}  // namespace kerf::testing_support
