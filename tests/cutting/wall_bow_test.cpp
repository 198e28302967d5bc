// Walls in a disc with a hollow side, and beside an upright one: they stay in the body, and every face has an area.
#include <cmath>
#include <numbers>

#include "kerf/cutting/swept_deviation.h"

#include "cutting/stroke_body.h"
#include "support/extruded_mesh.h"

namespace kerf::wall_bow_test {
namespace {

using namespace testing_support;

constexpr double kHalf = 0.2;  // thickness, metres; the disc has a radius of 1

/// Rings around the origin, counter-clockwise.
TriangleMesh disc(double radius, int rings, int spokes) {
  TriangleMesh mesh;
  mesh.positions.push_back(Vec3{});
  const auto at = [&](int ring, int k) { return VertexId(ring == 0 ? 0 : 1 + (ring - 1) * spokes + k % spokes); };
  for (int r = 1; r <= rings; ++r)
    for (int k = 0; k < spokes; ++k) {
      const double a = 2 * std::numbers::pi * k / spokes;
      mesh.positions.push_back({radius * r / rings * std::cos(a), radius * r / rings * std::sin(a), 0});
    }
  for (int r = 0; r < rings; ++r)
    for (int k = 0; k < spokes; ++k) {
      mesh.triangles.push_back({at(r, k), at(r + 1, k), at(r + 1, k + 1)});
      if (r > 0) mesh.triangles.push_back({at(r, k), at(r + 1, k + 1), at(r, k + 1)});
    }
  return mesh;
}

/// The side lies back by `hollow` of the radius half-way down, as a circle's arc nearly.
StrokeBody spool(double hollow) {
  const TriangleMesh flat = disc(1, 20, 96);
  TriangleMesh body = extruded(flat, 12, [](Vec3) { return kHalf; });
  for (std::size_t v = 2 * flat.positions.size(); v < body.positions.size(); ++v) {  // of the side alone
    Vec3& p = body.positions[VertexId(v)];
    const double s = p.z / kHalf, in = 1 - hollow * (1 - s * s);
    p = {in * p.x, in * p.y, p.z};
  }
  return {body, disc(1 - hollow, 4, 24)};
}

struct Walls {
  int count = 0, outside = 0, flat = 0;  // walls; of them outside; faces without area
  double farthest = 0;                   // outside, metres
};
Walls look_at_walls(const CellComplex& body, const TriangleSoup& skin) {
  Walls w;
  const VisualMesh& m = body.visual;
  for (const VisualTriangle f : ids<VisualTriangle>(m.face_count())) {
    if (!m.patch[f].is_wall()) continue;
    const auto at = [&](int k) { return m.rest[m.origin[VisualMesh::corner(f, k)]]; };
    w.flat += norm(cross(at(1) - at(0), at(2) - at(0))) < 1e-9 * body.mean_root_edge * body.mean_root_edge ? 1 : 0;
  }
  for (const TriangleSoup& wall : each_wall_of(body)) {
    ++w.count;
    const double distance = outside_of(wall, skin, 0.1 * body.mean_root_edge).distance;
    w.outside += distance > 1e-6 ? 1 : 0;
    w.farthest = std::max(w.farthest, distance);
  }
  return w;
}

/// Strokes right across, where nothing but the side decides.
Walls cut_across(StrokeBody& b, int strokes, std::uint64_t seed) {
  const TriangleSoup skin = skin_of(b.body);
  Random random(seed);
  for (int i = 0; i < strokes; ++i) {
    const double a = random.uniform(0, 2 * std::numbers::pi), d = random.uniform(-0.6, 0.6);
    const Vec2 along{std::cos(a), std::sin(a)}, beside{-along.y, along.x};
    b.cut(Stroke{d * beside + -1.3 * along, d * beside + 1.3 * along}, 4);
  }
  EXPECT_TRUE(validate_complex(b.body, b.start).ok());
  return look_at_walls(b.body, skin);
}

// Straight columns leave these bodies by the whole depth of the hollow: 30, 37 and 59 walls.
TEST(WallBow, WallsStayInASpool) {
  struct Case {
    double hollow;
    int outside;
    double farthest;
  };
  for (const Case& c : {Case{0.02, 2, 5e-5}, Case{0.1, 24, 0.008}, Case{0.2, 50, 0.02}}) {
    StrokeBody b = spool(c.hollow);
    const Walls w = cut_across(b, 6, 1);
    EXPECT_GT(w.count, 300);
    EXPECT_LE(w.outside, c.outside) << c.hollow;
    EXPECT_LT(w.farthest, c.farthest) << c.hollow;
    EXPECT_EQ(w.flat, 0);
  }
}

TEST(WallBow, FacesBesideAnUprightSideHaveAnArea) {
  for (const char* name : {"closed-sheet", "meniscus"}) {
    StrokeBody b(name);
    const TriangleSoup skin = skin_of(b.body);
    Random random(2);
    const Vec3 size = b.box.size(), c = b.box.center();
    for (int i = 0; i < 10; ++i) {
      const auto somewhere = [&] {
        return Vec2{c.x + random.uniform(-0.7, 0.7) * size.x, c.y + random.uniform(-0.7, 0.7) * size.y};
      };
      b.cut(Stroke{somewhere(), somewhere()}, 4);
    }
    const Walls w = look_at_walls(b.body, skin);
    EXPECT_GT(w.count, 60) << name;
    EXPECT_EQ(w.flat, 0) << name;
    EXPECT_EQ(w.outside, 0) << name;
  }
}

}  // namespace
}  // namespace kerf::wall_bow_test
