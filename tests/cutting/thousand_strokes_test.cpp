// Bodies that a thousand strokes have cut, most of them where others did: collision mesh and skin keep a shortest edge and a smallest angle.
// Walls have no such bound.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "cutting/stroke_body.h"

namespace kerf::thousand_strokes_test {
namespace {

using namespace testing_support;

/// Of the faces of a mesh at rest; edges in mean root edges, angles in degrees.
struct Shape {
  double edge = 0, angle = 0;                    ///< the least
  double edge_permille = 0, angle_permille = 0;  ///< a thousandth is less
};

template <class M, class Counts>
Shape shape_of(const M& mesh, double mean_edge, Counts&& counts) {
  std::vector<double> edges, angles;
  for (const auto f : ids<typename M::F>(mesh.face_count())) {
    if (!counts(f)) continue;
    const auto corner = [&](int i) { return mesh.rest[mesh.from(M::corner(f, i % 3))]; };
    for (int i = 0; i < 3; ++i) {
      const Vec3 u = corner(i + 1) - corner(i), v = corner(i + 2) - corner(i);
      edges.push_back(norm(u) / mean_edge);
      angles.push_back(std::atan2(norm(cross(u, v)), dot(u, v)) * 57.29578);
    }
  }
  std::sort(edges.begin(), edges.end());
  std::sort(angles.begin(), angles.end());
  const std::size_t few = edges.size() / 1000;
  return {edges.front(), angles.front(), edges[few], angles[few]};
}

enum class Kind { kAgain, kToAndFro };

/// A thousand strokes from about one place to about another; of kToAndFro five segments each.
void cut_a_thousand_times(StrokeBody& b, Kind kind, std::uint64_t seed) {
  Random random(seed);
  const double edge = b.body.mean_root_edge;
  const Vec3 centre = b.box.center(), size = b.box.size();
  const auto anywhere = [&] {
    return Vec2{centre.x + random.uniform(-0.55, 0.55) * size.x, centre.y + random.uniform(-0.55, 0.55) * size.y};
  };
  const auto about = [&](Vec2 p, double far) {
    return p + far * edge * Vec2{random.uniform(-1, 1), random.uniform(-1, 1)};
  };
  const Vec2 from = anywhere();
  Vec2 to = anywhere();
  while (norm(to - from) < 0.5 * std::max(size.x, size.y)) to = anywhere();
  for (int i = 0; i < 1000; ++i) {
    if (kind == Kind::kAgain) {
      b.cut({about(from, 0.05), about(to, 0.05)}, 8);
      continue;
    }
    const double turn[2] = {random.uniform(0.1, 0.5), random.uniform(0.5, 0.9)};
    Stroke stroke;
    for (int k = 0; k < 5; ++k) stroke.push_back(about(lerp(from, to, turn[k % 2] + random.uniform(-0.1, 0.1)), 0.03));
    b.cut(stroke, 6);
  }
}

void expect_bounds_after(StrokeBody&& b, Kind kind, std::uint64_t seed) {
  cut_a_thousand_times(b, kind, seed);
  const Shape collision = shape_of(b.body.collision, b.body.mean_root_edge, [](CollisionTriangle) { return true; });
  const Shape skin = shape_of(b.body.visual, b.body.mean_root_edge,
                              [&](VisualTriangle f) { return !b.body.visual.patch[f].is_wall(); });
  std::printf(
      "collision mesh: edge %.2g, angle %.2g (permille %.2g, %.2g); skin: edge %.2g, angle %.2g (permille %.2g, %.2g); %d pieces, %d refused\n",
      collision.edge, collision.angle, collision.edge_permille, collision.angle_permille, skin.edge, skin.angle,
      skin.edge_permille, skin.angle_permille, b.pieces(), b.refused);
  // What no cut goes below by default, but for rounding.
  EXPECT_GE(collision.edge, (1 - 1e-6) * 0.02 * 0.024);
  EXPECT_GE(collision.angle, 1e-4);
  EXPECT_GE(collision.angle_permille, 0.005);
  EXPECT_GE(skin.edge, 1e-6);
  EXPECT_GE(skin.angle, 1e-4);  // of one triangle; seven seeds to and fro in a meniscus: 1.9e-4
  EXPECT_GE(skin.angle_permille, 0.02);
  EXPECT_LE(b.refused, 8);  // paths of eight thousand and more, for want of room for a vertex; each is noted
  const Status valid = validate_complex(b.body, b.start);
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

TEST(ThousandStrokes, AgainInASheet) { expect_bounds_after(StrokeBody("closed-sheet", 2500), Kind::kAgain, 1); }
TEST(ThousandStrokes, ToAndFroInASheet) { expect_bounds_after(StrokeBody("closed-sheet", 2500), Kind::kToAndFro, 1); }
TEST(ThousandStrokes, AgainInASteak) { expect_bounds_after(StrokeBody("steak"), Kind::kAgain, 2); }
TEST(ThousandStrokes, ToAndFroInASteak) { expect_bounds_after(StrokeBody("steak"), Kind::kToAndFro, 1); }
TEST(ThousandStrokes, AgainInAMeniscus) { expect_bounds_after(StrokeBody("meniscus"), Kind::kAgain, 1); }
TEST(ThousandStrokes, ToAndFroInAMeniscus) { expect_bounds_after(StrokeBody("meniscus"), Kind::kToAndFro, 1); }

}  // namespace
}  // namespace kerf::thousand_strokes_test
