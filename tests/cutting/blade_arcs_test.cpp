// Arcs of a move: at rest beside every face cut by the plane and clipped to what the edge swept by itself; of a mesh that moves too beside where the blade is in it
// at many moments between the two poses.
#include "kerf/cutting/blade_arcs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "support/synthetic_complex.h"

namespace kerf::blade_arcs_test {
namespace {

using namespace testing_support;
using Kind = ArcEnd::Kind;
using F = CollisionTriangle;
using V = CollisionVertex;

constexpr double kPi = 3.14159265358979323846;

/// A mesh, where its vertices were and are.
struct Sheet {
  CellComplex body;
  std::vector<Vec3> before, now;
  double edge = 0;

  explicit Sheet(const TriangleMesh& surface) {
    SyntheticOptions options;
    options.subdivisions = 0;
    body = make_synthetic_complex(surface, options);
    edge = body.mean_root_edge;
    before = now = body.collision.rest.raw();
  }
  const CollisionMesh& mesh() const { return body.collision; }
  V corner(F f, int k) const { return mesh().from(CollisionMesh::corner(f, k)); }
  Vec3 rest(const FacePoint& p) const { return place(p, mesh().rest.raw()); }
  Vec3 place(const FacePoint& p, const std::vector<Vec3>& at) const {
    Vec3 x;
    for (int k = 0; k < 3; ++k) x += p.weights[static_cast<std::size_t>(k)] * at[corner(p.face, k).index()];
    return x;
  }
  std::vector<BladeArc> find(const BladeMove& move, std::span<const MovingFront> fronts, double near) const {
    FaceBoxes boxes;
    boxes.refresh(mesh(), now);
    return find_arcs(mesh(), boxes, {before, now}, move, fronts, near);
  }
  std::vector<Vec3> points(const BladeArc& arc) const { return points_at(arc, mesh().rest.raw()); }
  std::vector<Vec3> places(const BladeArc& arc) const { return points_at(arc, now); }
  std::vector<Vec3> points_at(const BladeArc& arc, const std::vector<Vec3>& at) const {
    std::vector<Vec3> out;
    if (!arc.closed) out.push_back(place(arc.begin.point, at));
    for (const ArcCrossing& c : arc.crossings)
      out.push_back(lerp(at[mesh().from(c.near).index()], at[mesh().to(c.near).index()], c.fraction));
    out.push_back(arc.closed ? out.front() : place(arc.end.point, at));
    return out;
  }
  /// Where an edge goes through faces, at any positions.
  std::vector<FacePoint> met(const BladeEdge& e, const std::vector<Vec3>& at) const {
    std::vector<FacePoint> out;
    const Vec3 d = e.tip - e.base;
    for (const F f : ids<F>(mesh().face_count())) {
      std::array<double, 3> w{};
      std::array<Vec3, 3> x;
      for (int k = 0; k < 3; ++k) x[static_cast<std::size_t>(k)] = at[corner(f, k).index()] - e.base;
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += w[k] = dot(d, cross(x[(k + 1) % 3], x[(k + 2) % 3]));
      if (sum == 0) continue;
      Vec3 hit;
      bool inside = true;
      for (std::size_t k = 0; k < 3; ++k) {
        w[k] /= sum;
        inside = inside && w[k] >= 0;
        hit += w[k] * x[k];
      }
      const double depth = dot(hit, d) / dot(d, d);
      if (inside && depth >= 0 && depth <= 1) out.push_back({f, w});
    }
    return out;
  }
};

/// From face to face over edges that both have; ends on borders are there.
void expect_whole(const Sheet& s, const BladeArc& a) {
  ASSERT_EQ(a.crossings.size() + (a.closed ? 0 : 1), a.faces.size());
  for (std::size_t k = 0; k < a.crossings.size(); ++k) {
    EXPECT_EQ(CollisionMesh::face(a.crossings[k].near), a.faces[k]);
    EXPECT_EQ(CollisionMesh::face(a.crossings[k].far), a.faces[(k + 1) % a.faces.size()]);
    EXPECT_EQ(s.mesh().twin[a.crossings[k].near], a.crossings[k].far);
  }
  for (const ArcEnd* e : {&a.begin, &a.end})
    EXPECT_TRUE(a.closed || e->kind != Kind::kBorder || s.mesh().is_border(e->border));
}

double distance(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 d = b - a;
  const double t = dot(d, d) > 0 ? std::clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0) : 0;
  return norm(p - a - t * d);
}

/// What the edge meets of the material, at many moments, at rest.
struct Truth {
  std::vector<Vec3> points;
  std::vector<FacePoint> first, last;
};
Truth truth_of(const Sheet& s, const BladeEdge& from, const BladeEdge& to, int moments) {
  Truth truth;
  std::vector<Vec3> at(s.now.size());
  for (int i = 0; i <= moments; ++i) {
    const double t = static_cast<double>(i) / moments;
    for (std::size_t v = 0; v < at.size(); ++v) at[v] = lerp(s.before[v], s.now[v], t);
    std::vector<FacePoint> met = s.met({lerp(from.base, to.base, t), lerp(from.tip, to.tip, t)}, at);
    for (const FacePoint& p : met) truth.points.push_back(s.rest(p));
    if (i == 0) truth.first = met;
    if (i == moments) truth.last = met;
  }
  return truth;
}

struct Off {
  double stray = 0, missed = 0;  ///< mean edges
};
Off compare(const Sheet& s, const std::vector<BladeArc>& arcs, const Truth& truth) {
  Off off;
  std::vector<std::vector<Vec3>> paths;
  for (const BladeArc& a : arcs) paths.push_back(s.points(a));
  for (const auto& path : paths)
    for (const Vec3 p : path) {
      double near = HUGE_VAL;
      for (const Vec3 q : truth.points) near = std::min(near, norm(p - q));
      off.stray = std::max(off.stray, std::min(near, 9 * s.edge));
    }
  for (const Vec3 q : truth.points) {
    double near = 9 * s.edge;
    for (const auto& path : paths)
      for (std::size_t k = 0; k + 1 < path.size(); ++k) near = std::min(near, distance(q, path[k], path[k + 1]));
    off.missed = std::max(off.missed, near);
  }
  return {off.stray / s.edge, off.missed / s.edge};
}

std::vector<BladeArc> arcs_of(const Sheet& s, const BladeEdge& from, const BladeEdge& to, const Truth& truth) {
  std::vector<MovingFront> fronts;
  for (const FacePoint& p : truth.first) fronts.push_back({s.place(p, s.mesh().rest.raw()), s.place(p, s.now)});
  return s.find(BladeMove::make(frame_of(from), to), fronts, 1e-6 * s.edge);
}
/// A smooth field: four random waves.
struct Waves {
  std::array<Vec2, 4> k;
  std::array<Vec3, 4> size;
  std::array<double, 4> phase{};
  Waves(Random& random, double amount, double most) {
    for (std::size_t i = 0; i < 4; ++i) {
      k[i] = {random.uniform(-most, most), random.uniform(-most, most)};
      size[i] = 0.5 * amount * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
      phase[i] = random.uniform(0, 2 * kPi);
    }
  }
  Vec3 at(Vec3 p) const {
    Vec3 sum;
    for (std::size_t i = 0; i < 4; ++i) sum += std::sin(k[i].x * p.x + k[i].y * p.y + phase[i]) * size[i];
    return sum;
  }
};

/// A scene: sets where the sheet was and is, and the two edges.
using Scene = std::function<void(Sheet&, Random&, BladeEdge&, BladeEdge&)>;

BladeEdge upright(Vec3 p, double reach, Vec3 lean = {}) {
  return {p + reach * (Vec3{0, 0, 1} + lean), p - reach * (Vec3{0, 0, 1} + lean)};
}

Scene moving_sheet(double amount_edges, double way, double turn) {
  return [=](Sheet& s, Random& random, BladeEdge& from, BladeEdge& to) {
    const Waves first(random, 0.1, 6), second(random, amount_edges * s.edge, 6);
    for (std::size_t i = 0; i < s.now.size(); ++i) {
      const Vec3 p = s.mesh().rest[V(i)];
      s.before[i] = p + first.at(p);
      s.now[i] = s.before[i] + second.at(p);
    }
    const double heading = random.uniform(0, 2 * kPi);
    const Vec3 middle{random.uniform(0.3, 0.7), random.uniform(0.3, 0.7), 0},
        half = 0.5 * way * s.edge * Vec3{std::cos(heading), std::sin(heading), 0};
    const auto lean = [&] { return Vec3{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 0}; };
    const Vec3 leans = lean(), more = turn * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), 0};
    from = upright(middle - half, 1, leans);
    to = upright(middle + half, 1, leans + more);
  };
}

/// Two layers: the sheet is folded over.
Scene folded(double amount_edges, double way) {
  return [=](Sheet& s, Random& random, BladeEdge& from, BladeEdge& to) {
    moving_sheet(amount_edges, way, 0)(s, random, from, to);
    for (std::vector<Vec3>* at : {&s.before, &s.now})
      for (Vec3& p : *at) p = {1 - std::abs(p.x - 0.5), p.y, p.z + 0.3 * (p.x - 0.5)};
    for (BladeEdge* e : {&from, &to}) e->base.x += 0.25, e->tip.x += 0.25;
  };
}
/// The blade comes down on its length.
Scene vault(double amount_edges) {
  return [=](Sheet& s, Random& random, BladeEdge& from, BladeEdge& to) {
    moving_sheet(amount_edges, 1, 0)(s, random, from, to);
    for (std::vector<Vec3>* at : {&s.before, &s.now})
      for (Vec3& p : *at) p.z += 0.5 * std::sin(kPi * p.x) * std::sin(kPi * p.y);
    const double y = random.uniform(0.2, 0.8), z = random.uniform(0.1, 0.3);
    from = {{-0.3, y, 0.6}, {1.3, y + random.uniform(-0.2, 0.2), 0.6}};
    to = {from.base - Vec3{0, 0, 0.6 - z}, from.tip - Vec3{0, 0, 0.6 - z}};
  };
}
/// The blade's tip is inside the material, now above, now below the sheet.
Scene tip_inside(double amount_edges) {
  return [=](Sheet& s, Random& random, BladeEdge& from, BladeEdge& to) {
    moving_sheet(amount_edges, 3, 0)(s, random, from, to);
    for (BladeEdge* e : {&from, &to}) e->tip = lerp(e->base, e->tip, 0.5 + random.uniform(-0.01, 0.01));
  };
}
/// The sheet turns about a place near the blade.
Scene turning_sheet(double angle, double way) {
  return [=](Sheet& s, Random& random, BladeEdge& from, BladeEdge& to) {
    moving_sheet(0, way, 0)(s, random, from, to);
    const Vec3 pivot = from.base + Vec3{random.uniform(-1, 1) * s.edge, random.uniform(-1, 1) * s.edge, 0};
    const double c = std::cos(angle), a = std::sin(angle);
    for (std::size_t i = 0; i < s.now.size(); ++i) {
      const Vec3 p = s.before[i] - pivot;
      s.now[i] = pivot + Vec3{c * p.x - a * p.y, a * p.x + c * p.y, p.z};
    }
  };
}

/// Random moves of a scene. Arcs lie where the blade has been, to within `tolerance` mean edges, and nothing is left out.
void expect_where_the_blade_was(const Scene& scene, int moves, std::uint64_t seed, double tolerance,
                                int moments = 1000) {
  Sheet s(plain_grid_mesh(14, 14));
  Random random(seed);
  int met = 0;
  for (int i = 0; i < moves; ++i) {
    BladeEdge from, to;
    scene(s, random, from, to);
    const Truth truth = truth_of(s, from, to, moments);
    if (truth.points.empty()) continue;
    ++met;
    const std::vector<BladeArc> arcs = arcs_of(s, from, to, truth);
    const Off off = compare(s, arcs, truth);
    EXPECT_LT(off.stray, tolerance) << "move " << i;
    EXPECT_LT(off.missed, tolerance) << "move " << i;
    std::size_t fronts = 0, is = 0;
    for (const BladeArc& a : arcs) {
      expect_whole(s, a);
      for (const ArcEnd* e : {&a.begin, &a.end}) {
        if (a.closed) continue;
        fronts += e->kind == Kind::kFront;
        is += e->kind == Kind::kIs;
      }
    }
    // Where the blade was there is a front, and where it is an end, in each layer.
    EXPECT_EQ(fronts, truth.first.size()) << "move " << i;
    EXPECT_EQ(is, truth.last.size()) << "move " << i;
  }
  EXPECT_GT(2 * met, moves);
}

// Half as much as a path may be off its arc; a chord of a face is off the curve there by as much as material bends in it.
constexpr double kNear = 0.012;

TEST(BladeArcs, OfASheetThatBends) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(moving_sheet(edges, 3, 0), 12, 1, kNear);
  expect_where_the_blade_was(moving_sheet(1.4, 3, 0), 12, 1, 3 * kNear);
}
TEST(BladeArcs, OfABladeThatTurns) {
  for (const double edges : {0.0, 0.2}) expect_where_the_blade_was(moving_sheet(edges, 3, 0.05), 12, 2, kNear);
}
TEST(BladeArcs, OfMaterialThatMovesOntoABlade) {
  for (const double edges : {0.2, 0.7}) {
    expect_where_the_blade_was(moving_sheet(edges, 0, 0), 12, 3, 2 * kNear);
    expect_where_the_blade_was(moving_sheet(edges, 0.1, 0), 12, 4, 2 * kNear);
  }
}
TEST(BladeArcs, OfTwoLayers) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(folded(edges, 3), 12, 5, 2 * kNear);
}
TEST(BladeArcs, OfABladeThatComesDownOnAVault) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(vault(edges), 6, 6, 3 * kNear, 4000);
}
TEST(BladeArcs, OfATipInsideTheMaterial) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(tip_inside(edges), 12, 8, 2 * kNear);
}
TEST(BladeArcs, OfASheetThatTurnsAboutTheBlade) {
  for (const double way : {0.1, 3.0}) expect_where_the_blade_was(turning_sheet(0.2, way), 12, 9, 3 * kNear);
}

// ---- material that keeps still: each face cut by the plane of the move, and clipped to what the edge sweeps in it

/// A move in a plane: from (x0, -d0) - (x1, -d1) to (0, 0) - (length, 0), in units of `along` and `motion` from `origin`.
struct Move {
  Vec3 origin, along, motion;
  double length, x0, x1, d0, d1;

  Vec3 place(double x, double y) const { return origin + x * along + y * motion; }
  BladeEdge from() const { return {place(x0, -d0), place(x1, -d1)}; }
  BladeEdge to() const { return {place(0, 0), place(length, 0)}; }
  Vec2 in_plane(Vec3 p) const { return {dot(p - origin, along), dot(p - origin, motion)}; }
  std::array<Vec2, 4> swept() const {
    return {Vec2{x0, -d0}, Vec2{x1, -d1}, Vec2{length, 0}, Vec2{0, 0}};
  }  // counter-clockwise
};

Move random_move(Random& random, bool turning) {
  const auto direction = [&] {
    return normalized(Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  };
  Move m;
  m.along = direction();
  const Vec3 any = direction();
  m.motion = normalized(any - dot(any, m.along) * m.along);
  m.length = turning ? 6 : random.uniform(0.2, 2);  // where it turns, its ends pass outside
  const Vec3 middle{random.uniform(0.1, 0.9), random.uniform(0.1, 0.9), random.uniform(-0.1, 0.1)};
  m.origin = middle - random.uniform(0.2, 0.8) * m.length * m.along;
  m.d0 = random.uniform(0.02, 0.8);
  m.d1 = turning ? m.d0 + random.uniform(-0.5, 0.5) * m.d0 : m.d0;
  m.x0 = turning ? 0 : random.uniform(-0.3, 0.3);
  m.x1 = m.x0 + m.length;
  return m;
}

struct Expected {
  double length = 0;
  int arcs = 0;  ///< connected ones, longer than rounding
};

/// The part of a - b in a convex polygon, as fractions; none: from > to.
std::pair<double, double> clipped(Vec2 a, Vec2 b, const std::array<Vec2, 4>& polygon) {
  double from = 0, to = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2 p = polygon[i], side = polygon[(i + 1) % 4] - p;
    const double at_a = cross(side, a - p), at_b = cross(side, b - p);
    if (at_a < 0 && at_b < 0) return {1, 0};
    if (at_a < 0) from = std::max(from, at_a / (at_a - at_b));
    if (at_b < 0) to = std::min(to, at_a / (at_a - at_b));
  }
  return {from, to};
}

Expected brute_force(const Sheet& sheet, const Move& move) {
  const CollisionMesh& mesh = sheet.mesh();
  const Vec3 normal = cross(move.along, move.motion);
  const std::array<Vec2, 4> swept = move.swept();
  std::vector<double> part(mesh.face_count(), 0);
  std::vector<std::size_t> root(mesh.face_count());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i];
    return i;
  };
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    std::vector<Vec2> ends;
    for (int k = 0; k < 3; ++k) {
      const CollisionHalfEdge h = CollisionMesh::corner(f, k);
      const Vec3 a = sheet.now[mesh.from(h).index()], b = sheet.now[mesh.to(h).index()];
      const double above = dot(a - move.origin, normal), below = dot(b - move.origin, normal);
      if ((above > 0) == (below > 0)) continue;
      ends.push_back(move.in_plane(a + above / (above - below) * (b - a)));
      const auto [from, to] = clipped(ends.back(), ends.back(), swept);
      if (from <= to && mesh.twin[h].valid()) root[find(f.index())] = find(CollisionMesh::face(mesh.twin[h]).index());
    }
    if (ends.empty()) continue;
    const auto [from, to] = clipped(ends[0], ends[1], swept);
    if (from < to) part[f.index()] = (to - from) * norm(ends[1] - ends[0]);
  }
  Expected expected;
  std::vector<double> together(mesh.face_count(), 0);
  for (std::size_t f = 0; f < part.size(); ++f) together[find(f)] += part[f];
  for (const double length : together) {
    expected.length += length;
    expected.arcs += length > 1e-9;
  }
  return expected;
}

double length_of(const std::vector<Vec3>& points) {
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += norm(points[i] - points[i - 1]);
  return sum;
}

void expect_as_brute_force(Sheet sheet, bool turning, std::uint64_t seed, int moves) {
  Random random(seed);
  int met = 0, most = 0;
  for (int i = 0; i < moves; ++i) {
    const Move move = random_move(random, turning);
    const std::vector<BladeArc> arcs = sheet.find(BladeMove::make(frame_of(move.from()), move.to()), {}, 0);
    const Expected expected = brute_force(sheet, move);
    double length = 0;
    int longer = 0;
    for (const BladeArc& arc : arcs) {
      expect_whole(sheet, arc);
      const std::vector<Vec3> points = sheet.places(arc);
      for (const Vec3 p : points) EXPECT_NEAR(dot(p - move.origin, cross(move.along, move.motion)), 0, 1e-12);
      length += length_of(points);
      longer += length_of(points) > 1e-9;
    }
    EXPECT_NEAR(length, expected.length, 1e-9) << "move " << i;
    EXPECT_EQ(longer, expected.arcs) << "move " << i;
    met += expected.arcs > 0;
    most = std::max(most, expected.arcs);
  }
  EXPECT_GT(met, moves / 2);
  EXPECT_GT(most, 1);
}

Sheet sheet_at_rest(const TriangleMesh& surface, const std::function<Vec3(Vec3)>& deform) {
  Sheet s(surface);
  for (Vec3& p : s.now) p = deform(p);
  s.before = s.now;
  return s;
}
Vec3 wavy(Vec3 p) { return {p.x, p.y, 0.15 * std::sin(9 * p.x) * std::cos(7 * p.y)}; }

TEST(BladeArcs, AtRestAreWhatEachFaceHasOfTheSweptStrip) {
  expect_as_brute_force(sheet_at_rest(plain_grid_mesh(14, 14), wavy), false, 1, 400);
}
TEST(BladeArcs, AtRestOfATurningEdgeAsWell) {
  expect_as_brute_force(sheet_at_rest(plain_grid_mesh(14, 14), wavy), true, 2, 400);
}

TEST(BladeArcs, NeitherBranchNorBreakOffAtVerticesAndAlongEdges) {
  const Sheet sheet(sheet_65_mesh());
  // The plane holds a row of vertices and the edges between them, or goes through vertices from corner to corner.
  for (const Vec3 along : {Vec3{0, 0, 1}, Vec3{0, 0, -1}})
    for (const auto& [from, to] :
         {std::pair{Vec3{-0.2, 0.5, 0}, Vec3{1.2, 0.5, 0}}, std::pair{Vec3{-0.2, -0.2, 0}, Vec3{1.2, 1.2, 0}},
          std::pair{Vec3{1.0 / 3, 1.3, 0}, Vec3{1.0 / 3, -0.1, 0}}}) {
      const std::vector<BladeArc> arcs =
          sheet.find(BladeMove::make(frame_of({from - along, from + along}), {to - along, to + along}), {}, 0);
      ASSERT_EQ(arcs.size(), 1u);
      expect_whole(sheet, arcs[0]);
      EXPECT_EQ(arcs[0].begin.kind, Kind::kBorder);
      EXPECT_EQ(arcs[0].end.kind, Kind::kBorder);
      const bool slanting = from.x != to.x && from.y != to.y;
      EXPECT_NEAR(length_of(sheet.places(arcs[0])), slanting ? std::sqrt(2.0) : 1, 1e-12);
    }
}

TEST(BladeArcs, RoundAVaultAreClosed) {
  const Sheet vault_at_rest = sheet_at_rest(plain_grid_mesh(12, 12), [](Vec3 p) {
    return Vec3{p.x, p.y, 0.5 * std::sin(kPi * p.x) * std::sin(kPi * p.y)};
  });
  const std::vector<BladeArc> arcs = vault_at_rest.find(
      BladeMove::make(frame_of({{-0.5, -0.5, 0.3}, {1.5, -0.5, 0.3}}), {{-0.5, 1.5, 0.3}, {1.5, 1.5, 0.3}}), {}, 0);
  ASSERT_EQ(arcs.size(), 1u);
  EXPECT_TRUE(arcs[0].closed);
  expect_whole(vault_at_rest, arcs[0]);
  BladeArc back = arcs[0];
  back.reverse();
  expect_whole(vault_at_rest, back);
  EXPECT_NEAR(length_of(vault_at_rest.places(back)), length_of(vault_at_rest.places(arcs[0])), 1e-12);
}

// ---- material that moves

// What turns and stretches evenly is passed on a straight line, however much it does so in one move.
TEST(BladeArcs, ThroughWhatStretchesEvenlyAreStraight) {
  Sheet s(plain_grid_mesh(14, 14));
  Random random(13);
  for (int i = 0; i < 40; ++i) {
    BladeEdge from, to;
    moving_sheet(0, 3, 0)(s, random, from, to);
    const double angle = random.uniform(-1, 1), more = random.uniform(0.6, 1.5), shear = random.uniform(-0.4, 0.4);
    for (std::size_t v = 0; v < s.now.size(); ++v) {
      s.before[v] = s.mesh().rest[V(v)];
      const Vec3 p = s.before[v] - Vec3{0.5, 0.5, 0};
      const double x = more * p.x + shear * p.y;
      s.now[v] = Vec3{0.5, 0.5, 0} +
                 Vec3{std::cos(angle) * x - std::sin(angle) * p.y, std::sin(angle) * x + std::cos(angle) * p.y, p.z};
    }
    BladeMove move = BladeMove::make(frame_of(from), to);
    move.go_along({s.before, s.now}, s.edge);
    for (const BladeArc& arc : s.find(move, {}, 0)) {
      const std::vector<Vec3> p = s.points(arc);
      for (const Vec3 x : p) EXPECT_LT(distance(x, p.front(), p.back()), 1e-6 * s.edge) << "move " << i;
    }
  }
}

// A front may stand a feature beside where the blade was, at rest, however far the material is stretched.
TEST(BladeArcs, BeginAtFrontsThatAreNearAtRest) {
  Sheet s(plain_grid_mesh(8, 8));
  for (std::size_t v = 0; v < s.now.size(); ++v) s.before[v] = s.now[v] = 3 * s.mesh().rest[V(v)];
  const double near = 0.02 * s.edge;
  const auto edge_at = [](Vec3 rest) { return BladeEdge{3 * rest - Vec3{0, 0, 1}, 3 * rest + Vec3{0, 0, 1}}; };
  const Vec3 from{0.31, 0.33, 0}, to{0.7, 0.66, 0};
  for (const double off : {-1.1, -0.9, 0.0, 0.9, 1.1}) {
    const Vec3 rest = from + off * near * Vec3{0.6, -0.8, 0};
    const std::vector<MovingFront> fronts{{rest, 3 * rest}};
    const std::vector<BladeArc> arcs = s.find(BladeMove::make(frame_of(edge_at(from)), edge_at(to)), fronts, near);
    ASSERT_EQ(arcs.size(), 1u);
    EXPECT_EQ(arcs[0].begin.kind, std::abs(off) < 1 ? Kind::kFront : Kind::kWas) << off;
  }
}

// All on one grid: the blade goes through vertices and along edges, vertices go through the blade. What goes into a face comes out of it, and what was the end of
// an arc inside the material is the beginning of one in the next move.
TEST(BladeArcs, NeitherBreakOffNorGetLostOnAGrid) {
  Sheet s(plain_grid_mesh(8, 8));
  Random random(11);
  const auto step = [&](int most) { return 0.125 * static_cast<double>(random.index(2 * most + 1) - most); };
  int ends = 0;
  for (int i = 0; i < 300; ++i) {
    for (std::size_t v = 0; v < s.before.size(); ++v) s.before[v] = s.mesh().rest[V(v)];
    const auto edge = [&](double x, double y) { return BladeEdge{{x, y, 1}, {x, y, -1}}; };
    double x = 0.5, y = 0.5;
    BladeMove move = BladeMove::make(frame_of(edge(x, y)), edge(x, y));
    std::size_t open = 1, was = 0;
    for (int k = 0; k < 6; ++k) {
      s.now = s.before;
      for (Vec3& p : s.now)
        if (random.index(3) == 0) p += Vec3{step(1), step(1), 0};
      const double nx = x + step(2), ny = y + step(2);
      move = BladeMove::make(move.is, edge(nx, ny));
      if (i % 2 == 1) move.go_along({s.before, s.now}, 0.25);
      const std::vector<BladeArc> arcs = s.find(move, {}, 0);
      std::size_t next = 0;
      was = 0;
      for (const BladeArc& a : arcs)
        for (const ArcEnd* e : {&a.begin, &a.end}) {
          if (a.closed) continue;
          EXPECT_TRUE(e->kind == Kind::kWas || e->kind == Kind::kIs ||
                      (e->kind == Kind::kBorder && s.mesh().is_border(e->border)));
          was += e->kind == Kind::kWas;
          next += e->kind == Kind::kIs;
          ++ends;
        }
      EXPECT_TRUE(k == 0 || was == open) << i << " " << k;
      open = next;
      s.before = s.now;
      x = nx, y = ny;
    }
  }
  EXPECT_GT(ends, 1000);
}

}  // namespace
}  // namespace kerf::blade_arcs_test
