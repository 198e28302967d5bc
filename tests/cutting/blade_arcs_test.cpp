// Arcs of a move, beside every face cut by the plane and clipped to what the edge swept by itself.
#include "kerf/cutting/blade_arcs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "support/synthetic_complex.h"

namespace kerf::blade_arcs_test {
namespace {

using namespace testing_support;
using Kind = ArcEnd::Kind;

constexpr double kPi = 3.14159265358979323846;
constexpr double kLeast = 1e-9;  // metres: no move here is shorter
constexpr double kNear = 0.1;    // metres

/// A mesh where it is now.
struct Sheet {
  CellComplex body;
  std::vector<Vec3> position;
  FaceBoxes boxes;

  explicit Sheet(
      const TriangleMesh& surface, const std::function<Vec3(Vec3)>& deform = [](Vec3 p) { return p; }) {
    SyntheticOptions options;
    options.subdivisions = 0;
    body = make_synthetic_complex(surface, options);
    for (const Vec3& p : body.collision.rest.raw()) position.push_back(deform(p));
    boxes.refresh(body.collision, position);
  }
  const CollisionMesh& mesh() const { return body.collision; }
  Vec3 at(CollisionVertex v) const { return position[v.index()]; }
  Vec3 at(const FacePoint& p) const {
    Vec3 x;
    for (int k = 0; k < 3; ++k)
      x += p.weights[static_cast<std::size_t>(k)] * at(mesh().from(CollisionMesh::corner(p.face, k)));
    return x;
  }
  std::vector<BladeArc> arcs(const Strip& strip, std::span<const ArcFront> fronts = {}) const {
    return find_arcs(mesh(), position, boxes, strip, fronts, kNear);
  }
  std::vector<Vec3> points(const BladeArc& arc) const {
    std::vector<Vec3> out;
    if (!arc.closed) out.push_back(at(arc.begin.point));
    for (const ArcCrossing& c : arc.crossings)
      out.push_back(lerp(at(mesh().from(c.near)), at(mesh().to(c.near)), c.fraction));
    out.push_back(arc.closed ? out.front() : at(arc.end.point));
    return out;
  }
};

double length_of(const std::vector<Vec3>& points) {
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += norm(points[i] - points[i - 1]);
  return sum;
}

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
      const Vec3 a = sheet.at(mesh.from(h)), b = sheet.at(mesh.to(h));
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

/// From face to face over edges that both have, from one end to the other; each end is where it says.
void expect_whole(const Sheet& sheet, const Strip& strip, const BladeArc& arc) {
  const CollisionMesh& mesh = sheet.mesh();
  ASSERT_EQ(arc.crossings.size() + (arc.closed ? 0 : 1), arc.faces.size());
  for (std::size_t i = 0; i < arc.crossings.size(); ++i) {
    EXPECT_EQ(CollisionMesh::face(arc.crossings[i].near), arc.faces[i]);
    EXPECT_EQ(CollisionMesh::face(arc.crossings[i].far), arc.faces[(i + 1) % arc.faces.size()]);
    EXPECT_EQ(mesh.twin[arc.crossings[i].near], arc.crossings[i].far);
  }
  double first = 1;
  for (const Vec3 p : sheet.points(arc)) {
    EXPECT_NEAR(strip.height(p), 0, 1e-12);
    first = std::min(first, strip.time(strip.local(p)));
  }
  EXPECT_NEAR(arc.first, first, 1e-9);
  if (arc.closed) return;
  for (const ArcEnd* end : {&arc.begin, &arc.end}) {
    const Vec2 q = strip.local(sheet.at(end->point));
    if (end->kind == Kind::kBorder) {
      EXPECT_TRUE(mesh.is_border(end->border));
    } else if (end->kind != Kind::kFront) {
      const int line = end->kind == Kind::kWas ? 0 : end->kind == Kind::kIs ? 1 : end->kind == Kind::kBase ? 2 : 3;
      EXPECT_NEAR(strip.side(line, q), 0, 1e-9);
    }
  }
}

void expect_as_brute_force(const Sheet& sheet, bool turning, std::uint64_t seed, int moves) {
  Random random(seed);
  int met = 0, most = 0;
  for (int i = 0; i < moves; ++i) {
    const Move move = random_move(random, turning);
    const Strip strip = Strip::make(move.from(), move.to(), {}, kLeast);
    const std::vector<BladeArc> arcs = sheet.arcs(strip);
    const Expected expected = brute_force(sheet, move);
    double length = 0;
    int longer = 0;
    for (const BladeArc& arc : arcs) {
      expect_whole(sheet, strip, arc);
      const double own = length_of(sheet.points(arc));
      length += own;
      longer += own > 1e-9;
    }
    EXPECT_NEAR(length, expected.length, 1e-9) << "move " << i;
    EXPECT_EQ(longer, expected.arcs) << "move " << i;
    met += expected.arcs > 0;
    most = std::max(most, expected.arcs);
  }
  EXPECT_GT(met, moves / 2);
  EXPECT_GT(most, 1);
}

Vec3 wavy(Vec3 p) { return {p.x, p.y, 0.15 * std::sin(9 * p.x) * std::cos(7 * p.y)}; }

TEST(BladeArcs, AreWhatEachFaceHasOfTheSweptStrip) {
  expect_as_brute_force(Sheet(plain_grid_mesh(14, 14), wavy), false, 1, 400);
}

TEST(BladeArcs, OfATurningEdgeAsWell) { expect_as_brute_force(Sheet(plain_grid_mesh(14, 14), wavy), true, 2, 400); }

TEST(BladeArcs, NeitherBranchNorBreakOffAtVerticesAndAlongEdges) {
  const Sheet sheet(sheet_65_mesh());
  // The plane holds a row of vertices and the edges between them, or goes through vertices from corner to corner.
  for (const Vec3 along : {Vec3{0, 0, 1}, Vec3{0, 0, -1}})
    for (const auto& [from, to] :
         {std::pair{Vec3{-0.2, 0.5, 0}, Vec3{1.2, 0.5, 0}}, std::pair{Vec3{-0.2, -0.2, 0}, Vec3{1.2, 1.2, 0}},
          std::pair{Vec3{1.0 / 3, 1.3, 0}, Vec3{1.0 / 3, -0.1, 0}}}) {
      const Strip strip = Strip::make({from - along, from + along}, {to - along, to + along}, {}, kLeast);
      const std::vector<BladeArc> arcs = sheet.arcs(strip);
      ASSERT_EQ(arcs.size(), 1u);
      expect_whole(sheet, strip, arcs[0]);
      EXPECT_EQ(arcs[0].begin.kind, Kind::kBorder);
      EXPECT_EQ(arcs[0].end.kind, Kind::kBorder);
      const bool slanting = from.x != to.x && from.y != to.y;
      EXPECT_NEAR(length_of(sheet.points(arcs[0])), slanting ? std::sqrt(2.0) : 1, 1e-12);
    }
}

TEST(BladeArcs, RoundAVaultAreClosed) {
  const Sheet vault(plain_grid_mesh(12, 12), [](Vec3 p) {
    return Vec3{p.x, p.y, 0.5 * std::sin(kPi * p.x) * std::sin(kPi * p.y)};
  });
  const Strip strip =
      Strip::make({{-0.5, -0.5, 0.3}, {1.5, -0.5, 0.3}}, {{-0.5, 1.5, 0.3}, {1.5, 1.5, 0.3}}, {}, kLeast);
  const std::vector<BladeArc> arcs = vault.arcs(strip);
  ASSERT_EQ(arcs.size(), 1u);
  EXPECT_TRUE(arcs[0].closed);
  expect_whole(vault, strip, arcs[0]);
  BladeArc back = arcs[0];
  back.reverse();
  expect_whole(vault, strip, back);
  EXPECT_NEAR(length_of(vault.points(back)), length_of(vault.points(arcs[0])), 1e-12);
}

TEST(BladeArcs, BehindAFrontNothingIsLeft) {
  // From border to border, so that neither end is where the edge was: the way on which the front came says which side is cut already.
  const Sheet sheet(sheet_65_mesh());
  const Strip strip =
      Strip::make({{-0.5, 0.37, -0.1}, {-0.5, 0.37, 0.1}}, {{1.5, 0.37, -0.1}, {1.5, 0.37, 0.1}}, {}, kLeast);
  const std::vector<BladeArc> whole = sheet.arcs(strip);
  ASSERT_EQ(whole.size(), 1u);
  for (const double x : {0.21, 0.43, 0.77})
    for (const double way : {-1.0, 1.0}) {
      const Vec3 at{x, 0.37, 0};
      CollisionTriangle face;
      for (const CollisionTriangle f : whole[0].faces) {
        const Vec3 a = sheet.at(sheet.mesh().from(CollisionMesh::corner(f, 0))),
                   b = sheet.at(sheet.mesh().from(CollisionMesh::corner(f, 1))),
                   c = sheet.at(sheet.mesh().from(CollisionMesh::corner(f, 2)));
        if (cross(b - a, at - a).z > 0 && cross(c - b, at - b).z > 0 && cross(a - c, at - c).z > 0) face = f;
      }
      ASSERT_TRUE(face.valid());
      const std::vector<ArcFront> fronts{{face, at, Vec3{way, 0, 0}}};
      const std::vector<BladeArc> arcs = sheet.arcs(strip, fronts);
      ASSERT_EQ(arcs.size(), 1u) << x << " " << way;
      EXPECT_EQ(arcs[0].begin.kind, Kind::kFront);
      EXPECT_EQ(arcs[0].faces.front(), face);
      EXPECT_EQ(arcs[0].end.kind, Kind::kBorder);
      EXPECT_NEAR(sheet.at(arcs[0].end.point).x, way > 0 ? 1 : 0, 1e-12);
    }
}

TEST(BladeArcs, BetweenTwoFrontsThatMeetAreAllThatIsLeft) {
  const Sheet sheet(plain_grid_mesh(10, 10));
  const Strip strip =
      Strip::make({{-0.5, 0.37, -0.1}, {-0.5, 0.37, 0.1}}, {{1.5, 0.37, -0.1}, {1.5, 0.37, 0.1}}, {}, kLeast);
  const std::vector<BladeArc> whole = sheet.arcs(strip);
  ASSERT_EQ(whole.size(), 1u);
  const std::vector<CollisionTriangle>& faces = whole[0].faces;
  const auto front = [&](std::size_t i, double way) {
    return ArcFront{faces[i], sheet.at(FacePoint{faces[i], {1.0 / 3, 1.0 / 3, 1.0 / 3}}), Vec3{way, 0, 0}};
  };
  const double onward = sheet.at(whole[0].end.point).x - sheet.at(whole[0].begin.point).x;
  for (const bool swapped : {false, true}) {
    std::vector<ArcFront> fronts{front(5, onward), front(faces.size() - 6, -onward)};
    if (swapped) std::swap(fronts[0], fronts[1]);
    const std::vector<BladeArc> arcs = sheet.arcs(strip, fronts);
    ASSERT_EQ(arcs.size(), 1u) << swapped;
    EXPECT_EQ(arcs[0].begin.kind, Kind::kFront);
    EXPECT_EQ(arcs[0].end.kind, Kind::kFront);
    EXPECT_EQ(arcs[0].faces.size(), faces.size() - 10);
  }
}

TEST(BladeArcs, OfAFrontGoTheWayItCameAtRest) {
  // The face of the front has turned over since: in space the way from the beginning of its path to it says nothing.
  const auto folded = [](Vec3 p) {
    return p.x < 0.3 ? p : p.x < 0.6 ? Vec3{0.6 - p.x, p.y, p.x - 0.3} : Vec3{p.x - 0.6, p.y, 0.3};
  };
  const Sheet sheet(plain_grid_mesh(10, 10), folded);
  const Strip strip =
      Strip::make({{-0.5, 0.37, -0.1}, {-0.5, 0.37, 0.5}}, {{1.5, 0.37, -0.1}, {1.5, 0.37, 0.5}}, {}, kLeast);
  const std::vector<BladeArc> whole = sheet.arcs(strip);
  ASSERT_EQ(whole.size(), 1u);
  const auto rest = [&](const FacePoint& p) {
    Vec3 x;
    for (int k = 0; k < 3; ++k)
      x += p.weights[static_cast<std::size_t>(k)] *
           sheet.mesh().rest[sheet.mesh().from(CollisionMesh::corner(p.face, k))];
    return x;
  };
  for (const CollisionTriangle face : whole[0].faces)
    for (const double way : {-1.0, 1.0}) {
      const FacePoint middle{face, {1.0 / 3, 1.0 / 3, 1.0 / 3}};
      const std::vector<ArcFront> fronts{{face, sheet.at(middle), Vec3{way, 0, 0}}};
      const std::vector<BladeArc> arcs = sheet.arcs(strip, fronts);
      ASSERT_EQ(arcs.size(), 1u);
      EXPECT_EQ(arcs[0].begin.kind, Kind::kFront);
      EXPECT_EQ(arcs[0].end.kind, Kind::kBorder);
      EXPECT_NEAR(rest(arcs[0].end.point).x, way > 0 ? 1 : 0, 1e-12) << rest(middle).x << " " << way;
    }
}

TEST(BladeArcs, OfAFrontGoOnFromIt) {
  const Sheet sheet(sheet_65_mesh());
  const auto edge = [](double x) { return BladeEdge{{x, 0.37, -0.1}, {x, 0.37, 0.1}}; };
  std::vector<ArcFront> fronts;
  double begun = -0.1;
  for (const double x : {0.13, 0.131, 0.5, 0.96}) {  // from the border on, once within a face
    std::vector<Vec3> places;
    for (const ArcFront& f : fronts) places.push_back(f.position);
    const Strip strip = Strip::make(edge(begun), edge(x), places, kLeast);
    const std::vector<BladeArc> arcs = sheet.arcs(strip, fronts);
    ASSERT_EQ(arcs.size(), 1u) << x;
    expect_whole(sheet, strip, arcs[0]);
    // Faces are whole ones: the arc of a front begins at the beginning of its face's segment, or where the edge was.
    const bool first = fronts.empty();
    const ArcEnd& start = arcs[0].end.kind == Kind::kIs ? arcs[0].begin : arcs[0].end;
    const ArcEnd& end = arcs[0].end.kind == Kind::kIs ? arcs[0].end : arcs[0].begin;
    EXPECT_EQ(start.kind, first ? Kind::kBorder : Kind::kFront) << x;
    EXPECT_EQ(start.front, first ? -1 : 0) << x;
    ASSERT_EQ(end.kind, Kind::kIs) << x;
    EXPECT_NEAR(sheet.at(end.point).x, x, 1e-12);
    fronts = {{end.point.face, sheet.at(end.point), Vec3{1, 0, 0}}};
    begun = x;
  }
}

}  // namespace
}  // namespace kerf::blade_arcs_test
