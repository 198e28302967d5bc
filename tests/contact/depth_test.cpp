// How deep points of a body are in its material: against a search over everything.
#include "kerf/contact/depth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact/bare_surface.h"
#include "kerf/base/random.h"
#include "support/lips_checker.h"

namespace kerf::depth_test {
namespace {

using testing_support::BareSurface;
using testing_support::count_as_cut;
using testing_support::LipsView;
using testing_support::plain_grid_mesh;
using testing_support::two_plates;

constexpr double kRadius = 0.02;

/// The same for the brute search: every triangle on its plate's side, every border a wall.
LipsView whole(const BareSurface& body, const std::vector<std::array<std::int32_t, 3>>& triangles) {
  LipsView view{{body.position, body.offset, triangles}, {}, {}};
  const ContactSurface& s = body.surface;
  for (const CollisionTriangle f : ids<CollisionTriangle>(s.face_count())) {
    view.side.push_back(s.rest[s.vertices(f)[0]].z > 0.5 ? 1 : -1);
    for (int i = 0; i < 3; ++i)
      if (const CollisionHalfEdge h = ContactSurface::corner(f, i); !s.twin[h].valid())
        view.walls.push_back({s.from(h).value, s.to(h).value, view.side.back()});
  }
  return view;
}

/// The second plate stands upright with its lower border `depth` in the first, which may be wavy.
void sink(BareSurface& body, double depth, double x, double turn, double waves) {
  body.deform([&](Vec3 p) {
    const auto wave = [waves](double u, double v) { return waves * std::sin(3 * u) * std::cos(2 * v); };
    if (p.z < 0.5) return Vec3{p.x, p.y, wave(p.x, p.y)};
    const double across = 0.8 * (p.y - 0.5), u = x + across * std::sin(turn), v = 0.5 + across * std::cos(turn);
    return Vec3{u, v, wave(u, v) + kRadius - depth + 0.8 * p.x};
  });
}

TEST(Depth, IsTheLeastWayOutOfWhatIsNoNeighbour) {
  BareSurface body(two_plates(5), kRadius);
  const auto triangles = testing_support::triangles_of(body.surface);
  int compared = 0, through_walls = 0;
  for (const double x : {0.37, 0.993})
    for (const double turn : {0.1, 0.6, 1.4}) {
      sink(body, 0.7 * kRadius, x, turn, 0.03);
      const LipsView view = whole(body, triangles);
      DepthSearch search;
      prepare_depths(body.state(), search);
      for (const LipsView::Wall& w : view.walls)
        for (int i = 0; i <= 6; ++i)
          for (const double lift : {-1.0, -0.3, 1.0}) {
            SurfacePoint p;
            p.vertex = {CollisionVertex(w.from), CollisionVertex(w.to), CollisionVertex()};
            p.weight = {1 - i / 6.0, i / 6.0, 0};
            p.lift = lift;
            const double wanted = testing_support::depth_in_side(view, -w.side, body.point(p)),
                         found = depth_of(body.state(), p, 0, search);
            // Walls are ruled, and two triangles here: they leave each other where the border is twisted.
            EXPECT_NEAR(found, wanted, 0.02 * kRadius) << x << " " << turn;
            if (wanted > 0.02 * kRadius) ++compared;
            if (wanted > 0.02 * kRadius && x > 0.9) ++through_walls;
            EXPECT_EQ(depth_of(body.state(), p, 1.1 * wanted + 1e-9, search), 0);
          }
    }
  EXPECT_GT(compared, 100);
  EXPECT_GT(through_walls, 10);
}

// Offsets of material that is sheared and crumpled point anywhere; for places beside such a prism Newton's method finds no root, and says so.
TEST(Depth, NothingIsInACrookedPrismThatIsNoPlaceOfIt) {
  BareSurface body(two_plates(1), kRadius);
  const ContactSurface& s = body.surface;
  const CollisionVertex probe([&] {
    for (const CollisionVertex v : ids<CollisionVertex>(s.vertex_count()))
      if (s.rest[v].z > 0.5) return v.value;
    return 0;
  }());
  int inside = 0, outside = 0;
  DepthSearch search;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    Random random(seed);
    const auto any = [&](double size) {
      return Vec3{random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
    };
    for (const CollisionVertex v : ids<CollisionVertex>(s.vertex_count())) {
      body.position[v.index()] =
          s.rest[v].z > 0.5 ? any(2 * kRadius) : 4 * kRadius * (s.rest[v] - Vec3{0.5, 0.5, 0}) + any(kRadius);
      body.offset[v.index()] = kRadius * random.uniform(0.5, 2.5) * normalized(any(1) + Vec3{0, 0, 0.3});
    }
    prepare_depths(body.state(), search);
    SurfacePoint at;
    at.vertex[0] = probe;
    at.weight[0] = 1;
    at.lift = random.uniform(-1, 1);
    const double depth = depth_of(body.state(), at, 0, search);
    if (!(depth > 0)) {
      ++outside;
      continue;
    }
    ++inside;
    // The nearest of a grid of places of the prisms.
    const Vec3 p = body.point(at);
    double nearest = HUGE_VAL, coarse = 0;
    for (const CollisionTriangle f : ids<CollisionTriangle>(s.face_count())) {
      const auto c = s.vertices(f);
      if (s.rest[c[0]].z > 0.5) continue;
      constexpr int kGrid = 20;
      for (int i = 0; i <= kGrid; ++i)
        for (int k = 0; i + k <= kGrid; ++k)
          for (int l = -kGrid / 2; l <= kGrid / 2; ++l) {
            Vec3 x;
            const double w[3] = {1 - (i + k) / double{kGrid}, i / double{kGrid}, k / double{kGrid}};
            for (std::size_t m = 0; m < 3; ++m)
              x += w[m] * (body.position[c[m].index()] + 2 * l / double{kGrid} * body.offset[c[m].index()]);
            nearest = std::min(nearest, norm(x - p));
          }
      coarse = std::max(coarse, (norm(body.position[c[1].index()] - body.position[c[0].index()]) +
                                 norm(body.position[c[2].index()] - body.position[c[0].index()]) + 10 * kRadius) /
                                    kGrid);
    }
    EXPECT_LT(nearest, coarse) << seed;
  }
  EXPECT_GT(inside, 100);
  EXPECT_GT(outside, 100);
}

TEST(Depth, WallsThatSinkInAreFoundAndNoOthers) {
  BareSurface body(two_plates(5), kRadius);
  count_as_cut(body.surface);
  DepthSearch search;
  for (const double turn : {0.0, 0.3, 1.1}) {
    sink(body, 0.4 * kRadius, 0.41, turn, 0);
    prepare_depths(body.state(), search);
    find_deep_walls(body.state(), 0.1 * kRadius, search);
    EXPECT_GT(search.deep.size(), 20u);
    double deepest = 0;
    for (const DepthSearch::Deep& d : search.deep) {
      deepest = std::max(deepest, d.depth);
      const Vec3 a = body.surface.rest[d.point.vertex[0]], b = body.surface.rest[d.point.vertex[1]];
      EXPECT_TRUE(a.z > 0.5 && std::min(a.x, b.x) < 1e-9);  // at the lower border of the upright plate
    }
    EXPECT_NEAR(deepest, 0.4 * kRadius, 1e-9);
    find_deep_walls(body.state(), 0.5 * kRadius, search);
    EXPECT_TRUE(search.deep.empty());
    sink(body, -0.05 * kRadius, 0.41, turn, 0);
    prepare_depths(body.state(), search);
    find_deep_walls(body.state(), 0.02 * kRadius, search);
    EXPECT_TRUE(search.deep.empty());
  }
}

TEST(Depth, RimsThatCrossInAPointAreFoundWhereverThatIs) {
  // Walls 50 half thicknesses long. The second plate stands upright and comes down steeply onto the border of the first, in which it has 0.4 half thicknesses
  // of its lower rim: somewhere along it.
  BareSurface body(two_plates(1), kRadius);
  count_as_cut(body.surface);
  DepthSearch search;
  for (int i = 1; i < 50; ++i) {
    const double along = i / 50.0, steep = M_PI / 4;
    body.deform([&](Vec3 p) {
      if (p.z < 0.5) return p;
      const double
          u = p.x - along,
          up = p.y;  // the place `along` its rim is at (1, 0.43), 0.4 half thicknesses under the first plate's side
      return Vec3{1 + std::cos(steep) * u + std::sin(steep) * up, 0.43,
                  kRadius - 0.4 * kRadius - std::sin(steep) * u + std::cos(steep) * up};
    });
    prepare_depths(body.state(), search);
    find_deep_walls(body.state(), 0.05 * kRadius, search);
    ASSERT_FALSE(search.deep.empty()) << i;
    for (const DepthSearch::Deep& d : search.deep)
      EXPECT_LT(norm(body.point(d.point) - Vec3{1, 0.43, kRadius}), 2 * kRadius);
  }
}

TEST(Depth, NeighboursAreNoMaterialToBeIn) {
  // A plate rolled into a ring: its ends pass each other, one through the other.
  BareSurface body(plain_grid_mesh(24, 3, 1, 0.1), kRadius);
  count_as_cut(body.surface);
  DepthSearch search;
  const auto roll = [&](double turns, double shift) {
    body.deform([&](Vec3 p) {
      const double a = 2 * M_PI * turns * p.x, r = 0.16 + shift * p.x;
      return Vec3{r * std::cos(a), p.y, r * std::sin(a)};
    });
    prepare_depths(body.state(), search);
    find_deep_walls(body.state(), 0.1 * kRadius, search);
    return search.deep.size();
  };
  EXPECT_EQ(roll(0.9, 0), 0u);
  EXPECT_GT(roll(1.02, 0), 0u);
  EXPECT_EQ(roll(1.02, 2.5 * kRadius), 0u);
  EXPECT_GT(roll(1.02, 1.5 * kRadius), 0u);
}

}  // namespace
}  // namespace kerf::depth_test
