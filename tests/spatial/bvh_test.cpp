// Every query against the same question asked of all triangles one by one.
#include "kerf/spatial/bvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/parallel.h"
#include "kerf/base/random.h"

namespace kerf::bvh_test {
namespace {

struct Soup {
  std::vector<Vec3> positions;
  std::vector<std::int32_t> corners;
  [[nodiscard]] TriangleView view() const { return {positions, corners}; }
};

Vec3 draw(Random& random, double size = 1) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

Soup random_soup(int n, std::uint64_t seed, double triangle_size) {
  Random random(seed);
  Soup soup;
  for (int i = 0; i < n; ++i) {
    const Vec3 centre = draw(random);
    for (int k = 0; k < 3; ++k) {
      soup.corners.push_back(std::int32_t(soup.positions.size()));
      soup.positions.push_back(centre + draw(random, triangle_size));
    }
    const std::size_t last = soup.positions.size() - 1;
    if (i % 17 == 0) soup.positions[last] = soup.positions[last - 1];  // a segment
    if (i % 51 == 0) soup.positions[last - 2] = soup.positions[last];  // a point
  }
  return soup;
}

Soup closed_grid_box(int n) {  // the six sides of a cube, n x n quads each, vertices not shared
  Soup soup;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto at = [&](int a, int b) {
            Vec3 p;
            p[axis] = side;
            p[(axis + 1) % 3] = double(a) / n;
            p[(axis + 2) % 3] = double(b) / n;
            soup.corners.push_back(std::int32_t(soup.positions.size()));
            soup.positions.push_back(p);
          };
          at(i, j), at(i + 1, j), at(i + 1, j + 1);
          at(i, j), at(i + 1, j + 1), at(i, j + 1);
        }
  return soup;
}

TEST(TriangleQueries, ClosestPointBeatsASampledTriangle) {
  Random random(1);
  for (int round = 0; round < 2000; ++round) {
    std::array<Vec3, 3> t{draw(random), draw(random), draw(random)};
    if (round % 5 == 0) t[2] = lerp(t[0], t[1], random.uniform(-1, 2));
    if (round % 7 == 0) t[1] = t[0];
    const Vec3 p = draw(random, 2);
    ClosestPoint c;
    closest_point(p, t, c);
    Vec3 q;
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GE(c.barycentric[k], 0);
      q += c.barycentric[k] * t[k];
      sum += c.barycentric[k];
    }
    EXPECT_NEAR(sum, 1, 1e-14);
    EXPECT_LT(norm(q - c.point), 1e-12);
    EXPECT_NEAR(norm(p - c.point), c.distance, 1e-14);
    const int n = 24;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const Vec3 sample = (double(i) / n) * t[0] + (double(j) / n) * t[1] + (double(n - i - j) / n) * t[2];
        ASSERT_LE(c.distance, norm(p - sample) + 1e-14);
      }
    // The closest point of a convex set: the set lies behind the plane through it.
    for (const Vec3& corner : t) EXPECT_LE(dot(corner - c.point, p - c.point), 1e-12);
  }
}

TEST(TriangleBvh, MatchesBruteForce) {
  for (const int n : {0, 1, 2, 5, 63, 1000}) {
    Soup soup = random_soup(n, 100 + std::uint64_t(n), n > 100 ? 0.1 : 0.7);
    TriangleBvh bvh(soup.view());
    Random random(5);
    for (int moved = 0; moved < 2; ++moved) {
      const TriangleView view = soup.view();
      for (int round = 0; round < 200; ++round) {
        Ray ray{draw(random, 2), draw(random)};
        if (round % 4 == 0) ray.direction[random.index(3)] = 0;
        if (round % 8 == 0) ray.direction = {0, 0, -1};
        if (round % 3 == 0) ray.t_min = -1, ray.t_max = 1;
        const auto accept = [&](const RayHit& h) { return h.triangle % 3 != round % 5; };
        std::vector<RayHit> brute, hits;
        for (std::int32_t t = 0; t < n; ++t) {
          RayHit hit;
          hit.triangle = t;
          if (intersect(RayFrame(ray), view[t], hit) && hit.t >= ray.t_min && hit.t <= ray.t_max && accept(hit))
            brute.push_back(hit);
        }
        std::sort(brute.begin(), brute.end(),
                  [](const RayHit& a, const RayHit& b) { return a.t != b.t ? a.t < b.t : a.triangle < b.triangle; });
        bvh.all_hits(view, ray, hits, accept);
        ASSERT_EQ(hits.size(), brute.size());
        for (std::size_t i = 0; i < hits.size(); ++i) {
          EXPECT_EQ(hits[i].triangle, brute[i].triangle);
        }
        const RayHit first = bvh.first_hit(view, ray, accept);
        EXPECT_EQ(first.triangle, brute.empty() ? -1 : brute[0].triangle);
        if (first.valid()) {
          const auto t = view[first.triangle];
          const Vec3 on_triangle =
              first.barycentric[0] * t[0] + first.barycentric[1] * t[1] + first.barycentric[2] * t[2];
          EXPECT_LT(norm(ray.origin + first.t * ray.direction - on_triangle), 1e-9);
        }

        const Vec3 p = draw(random, 1.5);
        const double reach = round % 2 == 0 ? HUGE_VAL : 0.3;
        const auto near = [&](const ClosestPoint& c) { return c.triangle % 4 != round % 6; };
        ClosestPoint best;
        best.distance = reach;
        for (std::int32_t t = 0; t < n; ++t) {
          ClosestPoint c;
          closest_point(p, view[t], c);
          c.triangle = t;
          if (near(c) && (c.distance < best.distance || (!best.valid() && c.distance == best.distance))) best = c;
        }
        const ClosestPoint found = bvh.closest(view, p, reach, near);
        EXPECT_EQ(found.triangle, best.triangle);
        EXPECT_EQ(found.distance, found.valid() ? best.distance : HUGE_VAL);

        Box3 box;
        box.add(draw(random));
        box.add(draw(random));
        std::vector<std::int32_t> inside, expected;
        bvh.for_each_in_box(view, box, [&](std::int32_t t) { inside.push_back(t); });
        std::sort(inside.begin(), inside.end());
        for (std::int32_t t = 0; t < n; ++t) {
          Box3 b;
          for (Vec3 corner : view[t]) b.add(corner);
          if (b.min.x <= box.max.x && b.max.x >= box.min.x && b.min.y <= box.max.y && b.max.y >= box.min.y &&
              b.min.z <= box.max.z && b.max.z >= box.min.z)
            expected.push_back(t);
        }
        EXPECT_EQ(inside, expected);
      }
      for (Vec3& p : soup.positions) p = {p.y + 0.2 * p.x, p.z, p.x};
      bvh.refit(soup.view());
    }
  }
}

TEST(TriangleBvh, TiesGoToTheSmallestTriangleAndNoRaySlipsThrough) {
  const Soup soup = closed_grid_box(8);
  const TriangleBvh bvh(soup.view());
  Random random(9);
  for (int round = 0; round < 3000; ++round) {
    // From inside towards lattice vertices and edge points: several triangles share them.
    Vec3 target;
    const int axis = random.index(3);
    target[axis] = random.index(2);
    target[(axis + 1) % 3] = random.index(9) / 8.0;
    target[(axis + 2) % 3] = round % 2 == 0 ? random.index(9) / 8.0 : random.uniform();
    const Vec3 origin{random.uniform(0.3, 0.7), random.uniform(0.3, 0.7), random.uniform(0.3, 0.7)};
    std::vector<RayHit> hits;
    bvh.all_hits(soup.view(), {origin, target - origin}, hits);
    EXPECT_GE(hits.size(), 1u) << "slipped through near a shared edge";

    const ClosestPoint found = bvh.closest(soup.view(), target);
    EXPECT_EQ(found.distance, 0);
    for (std::int32_t t = 0; t < found.triangle; ++t) {
      ClosestPoint c;
      closest_point(target, soup.view()[t], c);
      ASSERT_GT(c.distance, 0);
    }
  }
}

// Axis-parallel rays in the planes that separate boxes: 0 x infinity must not lose a box.
TEST(TriangleBvh, AxisParallelRaysThroughBoxFaces) {
  constexpr int kFan = 97;
  TriangleMesh mesh;
  mesh.positions.push_back({0, 0, 0.5});
  for (int i = 0; i < kFan; ++i)
    mesh.positions.push_back({std::cos(2 * M_PI * (i + 0.37) / kFan), std::sin(2 * M_PI * (i + 0.37) / kFan), 0.5});
  for (int i = 0; i < kFan; ++i) mesh.triangles.push_back({VertexId(0), VertexId(1 + i), VertexId(1 + (i + 1) % kFan)});
  const TriangleView view(mesh);
  const TriangleBvh bvh(view);
  for (const double z : {-1.0, 1.0}) {
    const RayHit hit = bvh.first_hit(view, {{0, 0, 0.5 - z}, {0, 0, z}});
    EXPECT_TRUE(hit.valid());
    EXPECT_NEAR(hit.t, 1, 1e-12);
  }
}

TEST(TriangleBvh, EqualCentresAndHugeCoordinates) {
  Soup soup;  // all triangles in one place: no split by position exists
  for (int i = 0; i < 1000; ++i)
    for (int k = 0; k < 3; ++k) {
      soup.corners.push_back(std::int32_t(soup.positions.size()));
      soup.positions.push_back({double(k == 1), double(k == 2), 0});
    }
  soup.corners.insert(soup.corners.end(), {0, 1, 2});
  soup.positions[0] = {-1e300, 0, 0};
  const TriangleBvh bvh(soup.view());
  EXPECT_EQ(bvh.closest(soup.view(), {0.2, 0.2, 1}).distance, 1);
  std::vector<RayHit> hits;
  bvh.all_hits(soup.view(), {{0.2, 0.2, 1}, {0, 0, -1}}, hits);
  std::erase_if(hits, [](const RayHit& hit) { return hit.triangle == 0 || hit.triangle == 1000; });  // the huge ones
  EXPECT_EQ(hits.size(), 999u);
  EXPECT_TRUE(std::is_sorted(hits.begin(), hits.end(), [](auto& a, auto& b) { return a.triangle < b.triangle; }));
}

TEST(TriangleView, ReadsMeshesAndTypedIds) {
  TriangleMesh mesh;
  EXPECT_EQ(TriangleView(mesh).size(), 0u);
  EXPECT_FALSE(TriangleBvh(mesh).closest(mesh, {}).valid());
  std::vector<VisualVertex> origins;
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{1, 1, 0.5}}) mesh.positions.push_back(p);
  for (const auto& t : {std::array{0, 1, 2}, std::array{1, 3, 2}}) {
    mesh.triangles.push_back({VertexId(t[0]), VertexId(t[1]), VertexId(t[2])});
    for (int v : t) origins.push_back(VisualVertex(v));
  }
  const TriangleView by_mesh(mesh), by_ids(mesh.positions.raw(), std::span<const VisualVertex>(origins));
  for (const TriangleView& view : {by_mesh, by_ids}) {
    ASSERT_EQ(view.size(), 2u);
    EXPECT_EQ(view[1][1], (Vec3{1, 1, 0.5}));
    const ClosestPoint c = TriangleBvh(view).closest(view, {2, 2, 0.5});
    EXPECT_EQ(c.triangle, 1);
    EXPECT_EQ(c.point, (Vec3{1, 1, 0.5}));
    EXPECT_EQ(c.barycentric[1], 1);
  }
}

TEST(TriangleBvh, LargeGridIsLean) {
  Soup soup;
  const int n = 300;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      soup.positions.push_back({double(i) / n, double(j) / n, 0.1 * std::sin(0.1 * i + 0.2 * j)});
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i;
      soup.corners.insert(soup.corners.end(), {a, a + 1, a + n + 2, a, a + n + 2, a + n + 1});
    }
  const TriangleBvh bvh(soup.view());
  EXPECT_LT(double(bvh.bytes()), 50.0 * double(soup.view().size()));
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const Ray ray{{random.uniform(), random.uniform(), 1}, {0, 0, -1}};
    const RayHit hit = bvh.first_hit(soup.view(), ray);
    ASSERT_TRUE(hit.valid());
    EXPECT_NEAR(1 - hit.t, 0, 0.11);
  }
}

/// Large trees are built in parts, side by side.
TEST(TriangleBvh, ATreeOfRunsAnswersAsOneOfTriangles) {
  Soup shuffled = closed_grid_box(40);
  for (std::size_t t = 0; t < shuffled.corners.size() / 3; ++t) {  // runs of it would be as long as the box
    const std::size_t other = (t * 7919) % (shuffled.corners.size() / 3);
    for (std::size_t k = 0; k < 3; ++k) std::swap(shuffled.corners[3 * t + k], shuffled.corners[3 * other + k]);
  }
  for (const Soup& soup :
       {closed_grid_box(40), closed_grid_box(3), shuffled, random_soup(1001, 4, 0.05), random_soup(7, 4, 0.5)}) {
    const TriangleBvh fine(soup.view());
    for (const std::size_t queries : {1u, 30u, 300u}) {
      const TriangleBvh coarse(soup.view(), queries);
      EXPECT_LE(coarse.nodes().size(), fine.nodes().size());
      std::vector<std::int32_t> order = coarse.order();
      std::sort(order.begin(), order.end());
      for (std::size_t t = 0; t < order.size(); ++t) ASSERT_EQ(order[t], static_cast<std::int32_t>(t));
      Random random(5);
      std::vector<RayHit> some, same;
      for (int round = 0; round < 200; ++round) {
        const Vec3 p = draw(random, 2), d = normalized(draw(random));
        const ClosestPoint a = fine.closest(soup.view(), p), b = coarse.closest(soup.view(), p);
        EXPECT_EQ(a.triangle, b.triangle);
        EXPECT_EQ(a.point, b.point);
        const RayHit h = fine.first_hit(soup.view(), {p, d, 0, 10}), g = coarse.first_hit(soup.view(), {p, d, 0, 10});
        EXPECT_EQ(h.triangle, g.triangle);
        EXPECT_EQ(h.t, g.t);
        fine.all_hits(soup.view(), {p, d, 0, 10}, some);
        coarse.all_hits(soup.view(), {p, d, 0, 10}, same);
        ASSERT_EQ(some.size(), same.size());
        for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i].triangle, same[i].triangle);
      }
    }
  }
  // A box of 9600 triangles in order for few queries: a tree of a tenth of the size. Out of order: no smaller.
  EXPECT_LT(10 * TriangleBvh(closed_grid_box(40).view(), 10).nodes().size(),
            TriangleBvh(closed_grid_box(40).view()).nodes().size());
  EXPECT_EQ(TriangleBvh(shuffled.view(), 10).nodes().size(), TriangleBvh(shuffled.view()).nodes().size());
}

TEST(TriangleBvh, LargeTreesAreTheSameForAnyNumberOfThreads) {
  const Soup soup = random_soup(300'000, 5, 0.004);
  const auto made_with = [&](int threads) {
    const ThreadLimit limit(threads);
    return TriangleBvh(soup.view());
  };
  const TriangleBvh one = made_with(1), four = made_with(4);
  ASSERT_EQ(one.order(), four.order());
  ASSERT_EQ(one.nodes().size(), four.nodes().size());
  TriangleBvh again = four;
  again.refit(soup.view());  // finds the boxes from the triangles
  std::vector<int> seen(one.size(), 0);
  for (std::size_t n = 0; n < one.nodes().size(); ++n) {
    const TriangleBvh::Node &a = one.nodes()[n], &b = four.nodes()[n], &c = again.nodes()[n];
    ASSERT_TRUE(a.min == b.min && a.max == b.max && a.first == b.first && a.count == b.count) << n;
    ASSERT_TRUE(a.min == c.min && a.max == c.max) << n;
    if (a.count == 0) {
      ASSERT_GT(a.first, n);
    }
    for (std::uint32_t i = a.first; i < a.first + a.count; ++i) ++seen[static_cast<std::size_t>(one.order()[i])];
  }
  EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int k) { return k == 1; }));
  Random random(6);
  for (int i = 0; i < 20; ++i) {
    const Vec3 p = draw(random);
    double best = HUGE_VAL;
    for (std::int32_t t = 0; t < std::int32_t(soup.view().size()); ++t) {
      ClosestPoint found;
      closest_point(p, soup.view()[t], found);
      best = std::min(best, found.distance);
    }
    EXPECT_EQ(one.closest(soup.view(), p).distance, best);
  }
}

}  // namespace
}  // namespace kerf::bvh_test
