// Walls that sank into material are held where they went in, and nowhere else.
#include "kerf/contact/sunk_walls.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "contact/bare_surface.h"

namespace kerf::sunk_walls_test {
namespace {

using testing_support::BareSurface;

constexpr double kRadius = 0.02, kMargin = 0.2 * kRadius, kDeep = 0.05 * kRadius;
/// Walls of the upright plate's lower border, each of which is in the other plate for all of its length.
constexpr std::size_t kWalls = 5;

/// A plate of 5 x 5 cells in z = 0, and one that never hung together with it and stands on it, its lower border `depth` in the first.
struct Plates {
  BareSurface body;
  DepthSearch search;
  DetectMemory memory;
  std::vector<Contact> contacts;

  Plates() : body(testing_support::two_plates(5), kRadius) { testing_support::count_as_cut(body.surface); }
  /// Upright, its lower border from x = 0.25 + shift to 0.75 + shift at y = 0.43.
  void stand(double depth, double shift = 0) {
    body.deform([&](Vec3 p) { return p.z < 0.5 ? p : Vec3{0.25 + 0.5 * p.x + shift, 0.43, p.y + kRadius - depth}; });
  }
  void remember() {
    prepare_depths(body.state(), search);
    find_deep_walls(body.state(), kDeep, search);
    remember_sunk_walls(body.surface, search.deep, memory);
  }
  void find() {
    contacts.clear();
    add_sunk_walls(body.state(), kMargin, 0.3, memory, contacts);
  }
  [[nodiscard]] bool is_of_second(const SurfacePoint& p) const { return body.surface.rest[p.vertex[0]].z > 0.5; }
  /// Contacts of the second plate's lower border.
  [[nodiscard]] std::size_t of_lower_border() const {
    return static_cast<std::size_t>(std::count_if(contacts.begin(), contacts.end(), [&](const Contact& c) {
      return std::max(body.surface.rest[c.a.vertex[0]].y, body.surface.rest[c.a.vertex[1]].y) < 1e-9;
    }));
  }
};

TEST(SunkWalls, AreHeldByTheWayThatTheyCameIn) {
  Plates plates;
  plates.stand(0.2 * kRadius);
  plates.remember();
  plates.find();
  std::set<CollisionVertex> ends;
  for (const Contact& c : plates.contacts) {
    ends.insert(c.a.vertex[0]);
    const Vec3 at = plates.body.point(c.a);
    EXPECT_NEAR(c.gap, at.z - kRadius, 1e-12);
    EXPECT_LT(norm(c.normal - Vec3{0, 0, 1}), 1e-12);
    EXPECT_LT(norm(at - c.gap * c.normal - plates.body.point(c.b)), 1e-12);
    EXPECT_EQ(c.b.lift, 1);
    EXPECT_EQ(c.friction, 0.3);
  }
  EXPECT_GE(ends.size(), kWalls);
  EXPECT_GE(plates.of_lower_border(), 8 * kWalls);
  // The same places are remembered once, and places that slide along a wall take the place of others.
  for (int i = 0; i < 4; ++i) {
    plates.stand(0.2 * kRadius + 1e-6 * i, 0.01 * i);
    plates.remember();
    plates.find();
  }
  EXPECT_LE(plates.of_lower_border(), 17 * kWalls);
  EXPECT_EQ(plates.memory.walls.size(), plates.contacts.size());
  for (std::size_t i = 1; i < plates.contacts.size(); ++i)
    EXPECT_LT(plates.contacts[i - 1].key, plates.contacts[i].key);
}

TEST(SunkWalls, FromBelowTheyGoOutBelow) {
  Plates plates;
  plates.body.deform([](Vec3 p) { return p.z < 0.5 ? p : Vec3{0.25 + 0.5 * p.x, 0.43, p.y - 1 - 0.8 * kRadius}; });
  plates.remember();
  plates.find();
  ASSERT_GE(plates.contacts.size(), 8 * kWalls);
  for (const Contact& c : plates.contacts) {
    EXPECT_NEAR(c.gap, -kRadius - plates.body.point(c.a).z, 1e-12);
    EXPECT_LT(norm(c.normal - Vec3{0, 0, -1}), 1e-12);
    EXPECT_EQ(c.b.lift, -1);
  }
}

TEST(SunkWalls, TheyFollowFromFaceToFaceAndAreForgottenFarOff) {
  Plates plates;
  plates.stand(0.2 * kRadius);
  plates.remember();
  plates.find();
  const std::size_t held = plates.of_lower_border();
  ASSERT_GE(held, 8 * kWalls);
  for (const double shift : {0.0, 0.07, 0.14, 0.21}) {  // over faces of 0.2
    plates.stand(0.1 * kRadius, shift);
    plates.find();
    ASSERT_EQ(plates.of_lower_border(), held) << shift;
    for (const Contact& c : plates.contacts) {
      EXPECT_NEAR(c.gap, plates.body.point(c.a).z - kRadius, 1e-12);
      EXPECT_LT(norm(plates.body.point(c.b) - c.point), 1e-12);
    }
  }
  plates.stand(-0.9 * kMargin, 0.21);
  plates.find();
  EXPECT_EQ(plates.of_lower_border(), held);
  plates.stand(-1.1 * kMargin, 0.21);
  plates.find();
  EXPECT_TRUE(plates.contacts.empty());
  EXPECT_TRUE(plates.memory.walls.empty());
  plates.stand(0.2 * kRadius, 0.21);
  plates.find();
  EXPECT_TRUE(plates.contacts.empty());
}

TEST(SunkWalls, UnderAValleyTheyGoOutThroughItsBottom) {
  // The first plate is folded upwards along a line of its vertices; the other one's lower border runs along above it, a little aside. Somewhere the edge
  // between the faces is nearest of both.
  const double rise = std::tan(20 * M_PI / 180);
  for (int i = -20; i <= 20; ++i) {
    Plates plates;
    plates.body.deform([&](Vec3 p) {
      return p.z < 0.5 ? Vec3{p.x, p.y, rise * std::fabs(p.y - 0.4)}
                       : Vec3{0.3 + 0.4 * p.x, 0.4 + 0.02 * i * kRadius + 0.3 * p.y, 0.85 * kRadius + p.y};
    });
    plates.remember();
    plates.find();
    EXPECT_GE(plates.of_lower_border(), 8 * kWalls) << i;
    for (const Contact& c : plates.contacts) {
      EXPECT_LT(c.gap, 0);
      EXPECT_GT(c.gap, -0.3 * kRadius);
      EXPECT_GT(c.normal.z, 0.9);
    }
  }
}

TEST(SunkWalls, BesideTheMaterialNothingHoldsThem) {
  Plates plates;
  plates.stand(0.2 * kRadius);
  plates.remember();
  ASSERT_FALSE(plates.memory.walls.empty());
  plates.body.deform([](Vec3 p) { return p.z < 0.5 ? p : Vec3{0.25 + 0.5 * p.x, 1.001, p.y + 0.8 * kRadius}; });
  plates.find();
  EXPECT_TRUE(plates.contacts.empty());
}

TEST(SunkWalls, ThroughTheWallOfABorderTheyGoOutThere) {
  // The second plate lies level with the first, its border a little within the other's.
  Plates plates;
  plates.body.deform([](Vec3 p) {
    return p.z < 0.5 ? p : Vec3{1 - 0.2 * kRadius + p.x, 0.1 + 0.8 * p.y, 0.05 * kRadius};
  });
  plates.remember();
  plates.find();
  std::set<bool> of;
  for (const Contact& c : plates.contacts) {
    const Vec3 at = plates.body.point(c.a);
    if (std::fabs(at.y - 0.5) > 0.4 - kRadius || std::fabs(c.a.lift) > 0.5)
      continue;  // corners, and what is nearer to the top
    const bool second = plates.is_of_second(c.a);
    of.insert(second);
    EXPECT_NEAR(c.gap, second ? at.x - 1 : 1 - 0.2 * kRadius - at.x, 1e-9);
    EXPECT_LT(norm(c.normal - Vec3{second ? 1.0 : -1.0, 0, 0}), 1e-9);
    EXPECT_LT(norm(plates.body.point(c.b) - c.point), 1e-12);
    EXPECT_FALSE(c.b.vertex[2].valid());
  }
  EXPECT_EQ(of.size(), 2u);  // each is in the other
}

TEST(SunkWalls, AlongABorderTheyFollowFromWallToWall) {
  Plates plates;
  const auto slide = [&](double by) {
    plates.body.deform([&](Vec3 p) {
      return p.z < 0.5 ? p : Vec3{1 - 0.2 * kRadius + p.x, 0.25 + by + 0.5 * p.y, 0.05 * kRadius};
    });
  };
  slide(0);
  plates.remember();
  const auto of_second = [&] {  // in the wall of the first plate's border, away from the second one's corners
    plates.find();
    return std::count_if(plates.contacts.begin(), plates.contacts.end(), [&](const Contact& c) {
      const double up =
          plates.body.surface.rest[c.a.vertex[0]].y +
          c.a.weight[1] * (plates.body.surface.rest[c.a.vertex[1]].y - plates.body.surface.rest[c.a.vertex[0]].y);
      return plates.is_of_second(c.a) && !c.b.vertex[2].valid() && std::fabs(up - 0.5) < 0.45;
    });
  };
  const auto held = of_second();
  ASSERT_GT(held, 8);
  for (int i = 1; i <= 20; ++i) {  // borders of 0.2
    slide(0.01 * i);
    EXPECT_EQ(of_second(), held) << i;
  }
}

TEST(SunkWalls, BothRimsOfAWallAreHeld) {
  // The lower border of the second plate lies in a steep valley of the first, wider than the plate is thick, and both its rims are in the slopes.
  Plates plates;
  const double rise = std::tan(30 * M_PI / 180);
  plates.body.deform([&](Vec3 p) {
    return p.z < 0.5 ? Vec3{p.x, p.y, rise * std::fabs(p.y - 0.4)} : Vec3{0.3 + 0.4 * p.x, 0.4, p.y + 1.42 * kRadius};
  });
  plates.remember();
  plates.find();
  int rims[2] = {0, 0};
  for (const Contact& c : plates.contacts) {
    if (std::fabs(c.a.lift) < 1) continue;
    ++rims[c.a.lift > 0 ? 1 : 0];
    EXPECT_NE(c.normal.y > 0, plates.body.point(c.a).y > 0.4);  // off the slope that it is in
  }
  EXPECT_GE(rims[0], 20);
  EXPECT_GE(rims[1], 20);
}

TEST(SunkWalls, WhatIsHeldGoesOnAsItHasBegun) {
  Plates plates;
  plates.stand(0.2 * kRadius);
  plates.remember();
  plates.find();
  const SunkWall held = plates.memory.walls.front();
  ASSERT_TRUE(held.held);
  // Deeper places beside it, with another way out: the last of them takes its place, but not its own way.
  std::vector<DepthSearch::Deep> deep;
  for (const double along : {held.along - 0.05, held.along + 0.05, held.along}) {
    DepthSearch::Deep& d = deep.emplace_back();
    d.point.vertex = {plates.body.surface.from(held.edge), plates.body.surface.to(held.edge), CollisionVertex()};
    d.point.weight = {1 - along, along, 0};
    d.point.lift = held.lift;
    d.depth = held.depth + 0.01 * kRadius * static_cast<double>(deep.size());
    d.out = {held.out.edge, -held.out.side};
  }
  plates.memory.walls = {held};
  remember_sunk_walls(plates.body.surface, deep, plates.memory);
  ASSERT_EQ(plates.memory.walls.size(), 1u);
  EXPECT_EQ(plates.memory.walls[0].out, held.out);
  EXPECT_TRUE(plates.memory.walls[0].held);
  EXPECT_EQ(plates.memory.walls[0].along, held.along);
}

TEST(SunkWalls, OnlyWhatACutChangesIsForgotten) {
  Plates plates;
  plates.stand(0.2 * kRadius);
  plates.remember();
  const std::vector<SunkWall> before = plates.memory.walls;
  const SunkWall first = before.front();
  std::vector<CollisionTriangle> changed{ContactSurface::face(first.edge)};
  forget_sunk_walls(plates.body.surface, changed, plates.memory);
  EXPECT_LT(plates.memory.walls.size(), before.size());
  EXPECT_FALSE(plates.memory.walls.empty());
  for (const SunkWall& w : plates.memory.walls) EXPECT_NE(ContactSurface::face(w.edge), changed[0]);
  const std::size_t left = plates.memory.walls.size();
  changed = {ContactSurface::face(plates.memory.walls.front().out.edge)};
  forget_sunk_walls(plates.body.surface, changed, plates.memory);
  EXPECT_LT(plates.memory.walls.size(), left);
  for (const SunkWall& w : plates.memory.walls) EXPECT_NE(ContactSurface::face(w.out.edge), changed[0]);
}

TEST(SunkWalls, WhatIsTooDeepForThatIsLeftAlone) {
  Plates plates;
  plates.stand(0.4 * kRadius);
  plates.remember();
  for (const SunkWall& w : plates.memory.walls)
    EXPECT_LT(w.depth, 0.3 * kRadius);  // of the walls that go up from there
  plates.find();
  EXPECT_EQ(plates.of_lower_border(), 0u);
  plates.stand(0.2 * kRadius);
  plates.remember();
  plates.find();
  EXPECT_GE(plates.of_lower_border(), 8 * kWalls);
  plates.stand(0.4 * kRadius);
  plates.find();
  EXPECT_EQ(plates.of_lower_border(), 0u);
}

TEST(SunkWalls, WhatIsNoWallAnyMoreIsForgotten) {
  Plates plates;
  plates.stand(0.2 * kRadius);
  plates.remember();
  ASSERT_FALSE(plates.memory.walls.empty());
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(plates.body.surface.cut.size()))
    plates.body.surface.cut[h] = 0;
  plates.find();
  EXPECT_TRUE(plates.contacts.empty());
  EXPECT_TRUE(plates.memory.walls.empty());
}

}  // namespace
}  // namespace kerf::sunk_walls_test
