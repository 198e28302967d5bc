// Arcs of a blade and a mesh that both move, beside where the blade is in the mesh at many moments between the two poses.
#include "kerf/cutting/space_time_arcs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "support/synthetic_complex.h"

namespace kerf::space_time_arcs_test {
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
  Vec3 rest(const ArcCrossing& c) const {
    return lerp(mesh().rest[mesh().from(c.near)], mesh().rest[mesh().to(c.near)], c.fraction);
  }
  std::vector<Vec3> points(const BladeArc& arc) const {
    std::vector<Vec3> out;
    if (!arc.closed) out.push_back(rest(arc.begin.point));
    for (const ArcCrossing& c : arc.crossings) out.push_back(rest(c));
    out.push_back(arc.closed ? out.front() : rest(arc.end.point));
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

std::vector<BladeArc> by_space_time(const Sheet& s, const BladeEdge& from, const BladeEdge& to, const Truth& truth) {
  std::vector<MovingFront> fronts;
  for (const FacePoint& p : truth.first) fronts.push_back({s.place(p, s.now)});
  return find_space_time_arcs(s.mesh(), s.before, s.now, BladeMove::make(frame_of(from), to), fronts, 1e-6 * s.edge);
}
/// A plane through the new edge and the fronts, as the material has carried them.
std::vector<BladeArc> by_plane(const Sheet& s, const BladeEdge& from, const BladeEdge& to, const Truth& truth) {
  std::vector<ArcFront> fronts;
  std::vector<Vec3> places;
  for (const FacePoint& p : truth.first) {
    places.push_back(s.place(p, s.now));
    fronts.push_back({p.face, places.back(), {}});
  }
  FaceBoxes boxes;
  boxes.refresh(s.mesh(), s.now);
  return find_arcs(s.mesh(), s.now, boxes, Strip::make(from, to, places, 1e-9 * s.edge), fronts, 0.5 * s.edge);
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
    const std::vector<BladeArc> arcs = by_space_time(s, from, to, truth);
    const Off off = compare(s, arcs, truth);
    EXPECT_LT(off.stray, tolerance) << "move " << i;
    EXPECT_LT(off.missed, tolerance) << "move " << i;
    std::size_t fronts = 0, is = 0;
    for (const BladeArc& a : arcs) {
      ASSERT_EQ(a.crossings.size() + (a.closed ? 0 : 1), a.faces.size());
      for (std::size_t k = 0; k < a.crossings.size(); ++k) {
        EXPECT_EQ(CollisionMesh::face(a.crossings[k].near), a.faces[k]);
        EXPECT_EQ(CollisionMesh::face(a.crossings[k].far), a.faces[(k + 1) % a.faces.size()]);
        EXPECT_EQ(s.mesh().twin[a.crossings[k].near], a.crossings[k].far);
      }
      for (const ArcEnd* e : {&a.begin, &a.end}) {
        if (a.closed) continue;
        EXPECT_TRUE(e->kind != Kind::kBorder || s.mesh().is_border(e->border)) << "move " << i;
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

TEST(SpaceTimeArcs, OfASheetThatBends) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(moving_sheet(edges, 3, 0), 12, 1, kNear);
  expect_where_the_blade_was(moving_sheet(1.4, 3, 0), 12, 1, 3 * kNear);
}
TEST(SpaceTimeArcs, OfABladeThatTurns) {
  for (const double edges : {0.0, 0.2}) expect_where_the_blade_was(moving_sheet(edges, 3, 0.05), 12, 2, kNear);
}
TEST(SpaceTimeArcs, OfMaterialThatMovesOntoABlade) {
  for (const double edges : {0.2, 0.7}) {
    expect_where_the_blade_was(moving_sheet(edges, 0, 0), 12, 3, 2 * kNear);
    expect_where_the_blade_was(moving_sheet(edges, 0.1, 0), 12, 4, 2 * kNear);
  }
}
TEST(SpaceTimeArcs, OfTwoLayers) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(folded(edges, 3), 12, 5, 2 * kNear);
}
TEST(SpaceTimeArcs, OfABladeThatComesDownOnAVault) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(vault(edges), 6, 6, 3 * kNear, 4000);
}
TEST(SpaceTimeArcs, OfATipInsideTheMaterial) {
  for (const double edges : {0.0, 0.2, 0.7}) expect_where_the_blade_was(tip_inside(edges), 12, 8, 2 * kNear);
}
TEST(SpaceTimeArcs, OfASheetThatTurnsAboutTheBlade) {
  for (const double way : {0.1, 3.0}) expect_where_the_blade_was(turning_sheet(0.2, way), 12, 9, 3 * kNear);
}

// Of material that keeps still they are those of the plane.
TEST(SpaceTimeArcs, AtRestAreThoseOfThePlane) {
  Sheet s(plain_grid_mesh(14, 14));
  Random random(12);
  for (int i = 0; i < 40; ++i) {
    BladeEdge from, to;
    moving_sheet(0, 3, 0)(s, random, from, to);
    const Truth truth = truth_of(s, from, to, 10);
    const std::vector<BladeArc> arcs = by_space_time(s, from, to, truth), plane = by_plane(s, from, to, truth);
    ASSERT_EQ(arcs.size(), plane.size());
    for (std::size_t k = 0; k < arcs.size(); ++k) {
      EXPECT_EQ(arcs[k].faces, plane[k].faces);
      const std::vector<Vec3> p = s.points(arcs[k]), q = s.points(plane[k]);
      ASSERT_EQ(p.size(), q.size());
      for (std::size_t n = 1; n < p.size(); ++n) EXPECT_LT(norm(p[n] - q[n]), 1e-9 * s.edge);
    }
  }
}

// What turns and stretches evenly is passed on a straight line, however much it does so in one move.
TEST(SpaceTimeArcs, ThroughWhatStretchesEvenlyAreStraight) {
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
    move.go_along(s.before, s.now, s.edge);
    for (const BladeArc& arc : find_space_time_arcs(s.mesh(), s.before, s.now, move, {}, 0)) {
      const std::vector<Vec3> p = s.points(arc);
      for (const Vec3 x : p) EXPECT_LT(distance(x, p.front(), p.back()), 1e-6 * s.edge) << "move " << i;
    }
  }
}

// All on one grid: the blade goes through vertices and along edges, vertices go through the blade. What goes into a face comes out of it, and what was the end of
// an arc inside the material is the beginning of one in the next move.
TEST(SpaceTimeArcs, NeitherBreakOffNorGetLostOnAGrid) {
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
      if (i % 2 == 1) move.go_along(s.before, s.now, 0.25);
      const std::vector<BladeArc> arcs = find_space_time_arcs(s.mesh(), s.before, s.now, move, {}, 0);
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
}  // namespace kerf::space_time_arcs_test
