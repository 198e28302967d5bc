// Ways led over the mesh, beside all edges that a segment meets, found one by one.
#include "kerf/cutting/lead_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "cutting/stroke_body.h"
#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "support/synthetic_complex.h"

namespace kerf::lead_path_test {
namespace {

using namespace testing_support;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using V = CollisionVertex;

constexpr double kStraight = 1e-9;  // metres

bool holds(const CollisionMesh& mesh, F f, Vec3 p) {
  for (int k = 0; k < 3; ++k) {
    const H h = CollisionMesh::corner(f, k);
    const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)];
    if (!(cross(b - a, p - a).z > 0)) return false;
  }
  return true;
}
F face_at(const CollisionMesh& mesh, Vec3 p) {
  for (const F f : ids<F>(mesh.face_count()))
    if (holds(mesh, f, p)) return f;
  return {};
}
/// Inner edges that the segment crosses, from its beginning on: of each pair of half-edges the one seen first.
std::vector<std::pair<double, H>> edges_met(const CollisionMesh& mesh, Vec3 from, Vec3 to) {
  std::vector<std::pair<double, H>> met;
  const Vec3 way = to - from;
  for (const H h : ids<H>(mesh.half_edge_count())) {
    if (mesh.is_border(h)) continue;
    const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)];
    const double sa = cross(way, a - from).z, sb = cross(way, b - from).z;
    if (!(sa < 0 && sb > 0)) continue;  // the half-edge whose face lies before it
    const Vec3 x = lerp(a, b, sa / (sa - sb));
    const double along = dot(x - from, way) / dot(way, way);
    if (along > 0 && along < 1) met.emplace_back(along, h);
  }
  std::sort(met.begin(), met.end());
  return met;
}
/// Does the way lead from face to face?
void expect_linked(const CollisionMesh& mesh, const std::vector<ArcCrossing>& way) {
  for (std::size_t i = 0; i < way.size(); ++i) {
    EXPECT_EQ(mesh.twin[way[i].near], way[i].far);
    if (i > 0) {
      EXPECT_EQ(CollisionMesh::face(way[i - 1].far), CollisionMesh::face(way[i].near));
    }
  }
}
CellComplex sheet_of(const TriangleMesh& surface) {
  SyntheticOptions options;
  options.subdivisions = 0;
  return make_synthetic_complex(surface, options);
}

TEST(LeadPath, CrossesWhatTheSegmentCrosses) {
  const CellComplex body = sheet_of(sheet_65_mesh());
  const CollisionMesh& mesh = body.collision;
  Random random(31);
  std::vector<ArcCrossing> way;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a{random.uniform(0.01, 0.99), random.uniform(0.01, 0.99), 0};
    const Vec3 b = a + Vec3{random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), 0};
    const F fa = face_at(mesh, a), fb = face_at(mesh, b);
    if (!fa.valid() || !fb.valid()) continue;
    ASSERT_TRUE(lead_path(mesh, {a, fa, {}}, {b, fb, {}}, kStraight, way)) << i;
    expect_linked(mesh, way);
    const auto met = edges_met(mesh, a, b);
    ASSERT_EQ(way.size(), met.size()) << i;
    for (std::size_t k = 0; k < way.size(); ++k) {
      EXPECT_EQ(way[k].near, met[k].second) << i;
      EXPECT_LT(norm(lerp(mesh.rest[mesh.from(way[k].near)], mesh.rest[mesh.to(way[k].near)], way[k].fraction) -
                     lerp(a, b, met[k].first)),
                1e-12)
          << i;
    }
  }
}

TEST(LeadPath, FromAndToACornerTakesTheFacesAroundIt) {
  const CellComplex body = sheet_of(sheet_65_mesh());
  const CollisionMesh& mesh = body.collision;
  Random random(32);
  std::vector<ArcCrossing> way, back;
  for (int i = 0; i < 500; ++i) {
    const V v(random.index(static_cast<int>(mesh.vertex_count())));
    const Vec3 a = mesh.rest[v], b = a + Vec3{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0};
    const F fb = face_at(mesh, b);
    if (!fb.valid()) continue;
    ASSERT_TRUE(lead_path(mesh, {a, {}, v}, {b, fb, {}}, kStraight, way)) << i;
    EXPECT_EQ(way.size(), edges_met(mesh, a + 1e-9 * (b - a), b).size()) << i;
    ASSERT_TRUE(lead_path(mesh, {b, fb, {}}, {a, {}, v}, kStraight, back)) << i;
    ASSERT_EQ(back.size(), way.size()) << i;
    for (std::size_t k = 0; k < way.size(); ++k) EXPECT_EQ(back[k].near, way[way.size() - 1 - k].far) << i;
  }
}

TEST(LeadPath, TurnsAroundAVertexThatItStandsOn) {
  const CellComplex body = sheet_of(sheet_65_mesh());
  const CollisionMesh& mesh = body.collision;
  std::vector<ArcCrossing> way;
  for (const V v : ids<V>(mesh.vertex_count())) {
    if (mesh.on_border(v)) continue;
    std::vector<F> around;
    mesh.for_each_outgoing(v, [&](H h) { return around.push_back(CollisionMesh::face(h)), true; });
    for (std::size_t k = 0; k < around.size(); ++k) {
      ASSERT_TRUE(lead_path(mesh, {mesh.rest[v], around[0], {}}, {mesh.rest[v], around[k], {}}, kStraight, way));
      EXPECT_EQ(way.size(), std::min(k, around.size() - k));
      expect_linked(mesh, way);
    }
  }
}

TEST(LeadPath, OverFoldsIsStraightWhenTheyAreLaidFlat) {
  // A strip folded along x = 0.5: straight from its first half to its second, as seen from the first.
  CellComplex body = sheet_of(sheet_65_mesh());
  const CellComplex flat = body;
  for (const V v : ids<V>(body.collision.vertex_count())) {
    Vec3 p = body.collision.rest[v];
    if (p.x > 0.5) p.z = 0.9 * (p.x - 0.5);
    body.collision.rest.set(v, p);
  }
  const CollisionMesh& mesh = body.collision;
  Random random(33);
  std::vector<ArcCrossing> way;
  int led = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3 a{random.uniform(0.3, 0.5), random.uniform(0.2, 0.8), 0},
        b{random.uniform(0.5, 0.7), random.uniform(0.2, 0.8), 0};
    const F fa = face_at(flat.collision, a), fb = face_at(flat.collision, b);
    if (!fa.valid() || !fb.valid()) continue;
    const H h = CollisionMesh::corner(fa, 0);
    const Vec3 up =
        cross(mesh.rest[mesh.to(h)] - mesh.rest[mesh.from(h)], mesh.rest[mesh.apex(h)] - mesh.rest[mesh.from(h)]);
    if (std::abs(up.x) > 1e-12) continue;  // begins beyond the fold
    ASSERT_TRUE(lead_path(mesh, {a, fa, {}}, {{b.x, b.y, 0.9 * (b.x - 0.5)}, fb, {}}, kStraight, way)) << i;
    EXPECT_EQ(way.size(), edges_met(flat.collision, a, b).size()) << i;
    ++led;
  }
  EXPECT_GT(led, 100);
}

TEST(LeadPath, ASlitBarsTheWay) {
  StrokeBody sheet("closed-sheet", 2500);
  sheet.make_whole();
  sheet.cut({{-0.6, 0.013}, {0.2, 0.013}});
  const CollisionMesh& mesh = sheet.body.collision;
  Random random(34);
  std::vector<ArcCrossing> way;
  int barred = 0, open = 0;
  for (int i = 0; i < 300; ++i) {
    const double x = random.uniform(-0.45, 0.45);
    const Vec3 a{x, 0.013 - random.uniform(0.02, 0.1), 0},
        b{x + random.uniform(-0.02, 0.02), 0.013 + random.uniform(0.02, 0.1), 0};
    const F fa = face_at(mesh, a), fb = face_at(mesh, b);
    if (!fa.valid() || !fb.valid()) continue;
    if (std::abs(x - 0.2) < 0.05) continue;  // at its end
    const bool led = lead_path(mesh, {a, fa, {}}, {b, fb, {}}, kStraight, way);
    EXPECT_EQ(led, x > 0.2) << x;
    EXPECT_TRUE(led || way.empty());
    (led ? open : barred)++;
  }
  EXPECT_GT(barred, 50);
  EXPECT_GT(open, 20);
}

TEST(LeadPath, GoesRoundWhatIsWithinReach) {
  const CellComplex body = sheet_of(sheet_65_mesh());
  const CollisionMesh& mesh = body.collision;
  std::vector<ArcCrossing> way;
  // To a face that lies beside the segment.
  const Vec3 a{0.31, 0.42, 0}, b{0.52, 0.43, 0};
  const F fa = face_at(mesh, a), fb = face_at(mesh, b);
  F beside;
  for (int k = 0; k < 3; ++k)
    if (const H t = mesh.twin[CollisionMesh::corner(fb, k)]; t.valid() && edges_met(mesh, a, b).back().second != t)
      beside = CollisionMesh::face(t);
  ASSERT_TRUE(beside.valid());
  ASSERT_TRUE(lead_path(mesh, {a, fa, {}}, {b, beside, {}}, 0.2, way));
  expect_linked(mesh, way);
  EXPECT_EQ(CollisionMesh::face(way.front().near), fa);
  EXPECT_EQ(CollisionMesh::face(way.back().far), beside);
}

}  // namespace
}  // namespace kerf::lead_path_test
