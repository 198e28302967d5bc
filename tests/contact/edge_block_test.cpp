// What eight edges at a time leave out could not have touched, by exact arithmetic; and most of what cannot touch is left out.
#include "kerf/contact/edge_block.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/random.h"
#include "kerf/contact/detect_scratch.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf::edge_block_test {
namespace {

struct BodyEdge {
  Vec3 a, b;
  std::array<Vec3, 2> into;
};

Vec3 random_vec(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

/// Two unit vectors upright to an edge, or one.
std::array<Vec3, 2> random_faces(Random& random, Vec3 along) {
  const Vec3 side = normalized(cross(along, random_vec(random, 1)));
  const double bend = random.uniform(-1, 1);
  const Vec3 other = -std::cos(bend) * side + std::sin(bend) * normalized(cross(along, side));
  return {side, random.uniform(0, 1) < 0.2 ? Vec3{} : other};
}

/// Is a direction, or its reverse, off the faces?
bool off(Vec3 n, const std::array<Vec3, 2>& into) {
  return (dot(n, into[0]) <= kOffFaces && dot(n, into[1]) <= kOffFaces) ||
         (dot(-n, into[0]) <= kOffFaces && dot(-n, into[1]) <= kOffFaces);
}

bool touches(const BodyEdge& mine, const ObstacleLeaves::Edge& edge, double reach) {
  SegmentFeet feet;
  if (!inner_feet(mine.a, mine.b, edge.a, edge.b, feet)) return false;
  const Vec3 d = lerp(mine.a, mine.b, feet.s) - lerp(edge.a, edge.b, feet.t);
  return norm(d) < reach && off(normalized(d), mine.into) && off(normalized(d), edge.into);
}

TEST(EdgeBlock, LeavesOutOnlyWhatCannotTouch) {
  Random random(5);
  int touching = 0, kept = 0, all = 0;
  for (int round = 0; round < 60000; ++round) {
    const double size = std::pow(10.0, random.uniform(-4, 3)), far = random.uniform(0, 1) < 0.5 ? 0 : 1000 * size;
    const Vec3 place = random_vec(random, far);
    BodyEdge mine{place + random_vec(random, 0.3 * size), place + random_vec(random, 0.3 * size), {}};
    mine.into = random_faces(random, mine.b - mine.a);
    const double reach = random.uniform(0.05, 0.5) * size, length = std::pow(10.0, random.uniform(-2, 0));
    EdgeBlock block = empty_edges();
    std::array<ObstacleLeaves::Edge, 8> edges{};
    const std::size_t count = 1 + static_cast<std::size_t>(random.uniform(0, 7.99));
    EdgeProbe probe;
    double extent = std::max(norm(mine.a - place), norm(mine.b - place));
    for (std::size_t i = 0; i < count; ++i) {
      ObstacleLeaves::Edge& e = edges[i];
      const Vec3 middle = place + random_vec(random, 0.5 * size), half = random_vec(random, 0.3 * length * size);
      e.a = middle - half;
      e.b = middle + half;
      // Nearly parallel ones too: there rounding is worst.
      if (random.uniform(0, 1) < 0.2) e.b = e.a + length * (mine.b - mine.a) + random_vec(random, 1e-4 * size);
      e.into = random_faces(random, e.b - e.a);
      e.length = static_cast<float>(1.000001 * norm(e.b - e.a));
      extent = std::max({extent, norm(e.a - place), norm(e.b - place)});
      set_edge(e, static_cast<std::uint32_t>(10 + i), place, i, block);
      EXPECT_EQ(block.edge[i], 10 + i);
    }
    probe.a = to_corner(mine.a - place);
    probe.b = to_corner(mine.b - place);
    for (std::size_t i = 0; i < 2; ++i) {
      probe.into[i] = to_corner(mine.into[i]);
      probe.at[i] = static_cast<float>(dot(mine.into[i], mine.a - place));
    }
    probe.reach = static_cast<float>(reach);
    probe.length = static_cast<float>(norm(mine.b - mine.a));
    probe.extent = static_cast<float>(1.01 * extent);
    const unsigned mask = may_touch(block, probe);
    EXPECT_EQ(mask >> count, 0u);  // unused lanes
    for (std::size_t i = 0; i < count; ++i) {
      const bool exact = touches(mine, edges[i], reach), found = (mask >> i & 1) != 0;
      EXPECT_TRUE(found || !exact) << round << " " << i;
      touching += exact ? 1 : 0;
      kept += found ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(touching, 500);
  EXPECT_LT(kept, touching + all / 8);
}

TEST(EdgeBlock, PointsNearABox) {
  Random random(6);
  for (int round = 0; round < 500; ++round) {
    const Vec3 centre = random_vec(random, 10);
    PointBlock block = empty_points();
    std::array<Vec3, 5> p;
    for (std::size_t i = 0; i < p.size(); ++i) {
      p[i] = centre + random_vec(random, 1);
      set_point(p[i], static_cast<std::int32_t>(i), centre, i, block);
    }
    const TreeCorner a = to_corner(random_vec(random, 0.5)), b = to_corner(random_vec(random, 0.5));
    const TreeBox box = joined({a, a}, {b, b});
    const float reach = 0.3f;
    const unsigned mask = near_box(block, box, reach);
    EXPECT_EQ(mask >> p.size(), 0u);
    for (std::size_t i = 0; i < p.size(); ++i) {
      const double distance = std::sqrt(squared_distance(box, to_corner(p[i] - centre)));
      if (std::fabs(distance - double{reach}) > 1e-5) {
        EXPECT_EQ((mask >> i & 1) != 0, distance < double{reach});
      }
    }
  }
}

}  // namespace
}  // namespace kerf::edge_block_test
