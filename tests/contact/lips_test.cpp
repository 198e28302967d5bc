// The two lips of a cut: at rest, pressed, pulled, sheared, one lifted over the other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/random.h"
#include "kerf/base/rigid_place.h"

#include "contact/bare_surface.h"
#include "cutting/cut_body.h"
#include "kerf/cutting/topology_change.h"

namespace kerf::lips_test {
namespace {

using testing_support::CutBody;
using testing_support::plain_grid_mesh;
using testing_support::SyntheticOptions;

constexpr double kRadius = 0.05;

/// A body that is cut, deformed and looked at.
struct LipBody {
  CutBody cut;
  ContactSurface surface;
  std::vector<Vec3> position, offset, predicted;
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;

  explicit LipBody(int grid = 6, double radius = kRadius, bool closed = true)
      : cut(plain_grid_mesh(grid, grid), options(radius, closed)) {
    surface = make_contact_surface(cut.body.collision);
  }
  static SyntheticOptions options(double radius, bool closed) {
    SyntheticOptions o;
    o.subdivisions = 2;
    o.closed = closed;
    o.thickness = 2 * radius;
    return o;
  }
  void make_cut(const std::vector<Vec3>& points) {
    JournalMark mark;
    journal_mark(cut.body, mark);
    cut.cut(points);
    update_contact_surface(cut.body.collision, changed_triangles(cut.body, mark), surface);
    place([](Vec3 p, int) { return p; });
    detect();
  }
  /// side: +1 for triangles with their middle at x > 0.5, else -1.
  template <class Fn>
  void place(Fn&& f) {
    position.assign(surface.vertex_count(), {});
    for (const CollisionTriangle t : ids<CollisionTriangle>(surface.face_count())) {
      const auto c = surface.vertices(t);
      const double middle = (surface.rest[c[0]].x + surface.rest[c[1]].x + surface.rest[c[2]].x) / 3;
      for (const CollisionVertex v : c) position[v.index()] = f(surface.rest[v], middle > 0.5 ? 1 : -1);
    }
    offset = surface.offset.raw();
    predicted = position;
  }
  /// Contacts come along with the body, as a step of mechanics would take them.
  DetectReport detect() {
    const auto place_of = [&](const SurfacePoint& p) {
      Vec3 x;
      for (std::size_t k = 0; k < 3; ++k)
        if (p.vertex[k].valid())
          x += p.weight[k] * (position[p.vertex[k].index()] + p.lift * offset[p.vertex[k].index()]);
      return x;
    };
    for (std::size_t i = 0; i < memory.contacts.size(); ++i) {
      const Contact& c = contacts[i];
      memory.contacts[i].gap = dot(c.normal, place_of(c.a) - place_of(c.b)) + memory.contacts[i].allowed;
    }
    const SurfaceState state{&surface, position, offset, predicted};
    return kerf::detect(std::span(&state, 1), {}, {}, {}, memory, workspace, contacts);
  }
  [[nodiscard]] double least_gap() const {
    double least = HUGE_VAL;
    for (const Contact& c : contacts) least = std::min(least, c.gap);
    return least;
  }
};

TEST(Lips, UncutSheetHasNoContacts) {
  LipBody body;
  body.place([](Vec3 p, int) { return p; });
  body.detect();
  EXPECT_TRUE(body.contacts.empty());
}

TEST(Lips, FreshCutHasGapsOfExactlyZero) {
  for (const bool closed : {true, false})
    for (const double end : {0.62, 1.1}) {
      LipBody body(6, kRadius, closed);
      body.make_cut({{0.47, -0.1, 0},
                     {0.54, 0.3, 0},
                     {0.45, end, 0}});  // no vertex of the grid so near that the path is rounded to it
      const DetectReport report = body.detect();
      ASSERT_FALSE(body.contacts.empty());
      for (const Contact& c : body.contacts) {
        EXPECT_EQ(c.gap, 0) << c.a.vertex[0].value;
        EXPECT_LT(std::fabs(c.normal.z), 1e-12);
        EXPECT_GT(std::fabs(c.normal.x), 0.9);
      }
      EXPECT_EQ(report.deep, 0);
    }
}

// Walls are met that stand before a place at rest, where cuts turn. However the body has been turned since, that is no overlap.
TEST(Lips, OfAJaggedCutOverlapNothingHoweverTheBodyIsTurned) {
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    LipBody body(8);
    std::vector<Vec3> points;
    for (int k = 0; k <= 24; ++k) points.push_back({0.1 + 0.033 * k, 0.5 + random.uniform(-0.06, 0.06), 0});
    body.make_cut(points);
    for (const Contact& c : body.contacts) EXPECT_GT(c.gap, -1e-12) << i;
    EXPECT_GT(body.contacts.size(), 20u);
    const Mat3 turned = turn({random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)});
    for (std::vector<Vec3>* list : {&body.position, &body.offset})
      for (Vec3& p : *list) p = turned * p;
    body.predicted = body.position;
    body.memory = {};
    body.detect();
    for (const Contact& c : body.contacts) EXPECT_GT(c.gap, -1e-12) << i;
    EXPECT_GT(body.contacts.size(), 20u);
  }
}

TEST(Lips, PressedOverlapByWhatTheyArePressed) {
  LipBody body;
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  for (const double press : {0.001, 0.01, 0.05, 0.2}) {
    body.place([&](Vec3 p, int side) { return p - Vec3{0.5 * press * kRadius * side, 0, 0}; });
    body.detect();
    ASSERT_FALSE(body.contacts.empty());
    for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, -press * kRadius, 1e-12);
  }
}

TEST(Lips, PulledApartLetGo) {
  LipBody body;
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  body.place([&](Vec3 p, int side) { return p + Vec3{0.05 * kRadius * side, 0, 0}; });
  body.detect();
  for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, 0.1 * kRadius, 1e-12);
  EXPECT_FALSE(body.contacts.empty());
  body.place([&](Vec3 p, int side) { return p + Vec3{0.5 * kRadius * side, 0, 0}; });
  body.detect();
  EXPECT_TRUE(body.contacts.empty());
}

TEST(Lips, ShearedAlongStayInTouch) {
  LipBody body;
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  body.place([&](Vec3 p, int side) { return p + Vec3{-0.01 * kRadius * side, 0.04 * side, 0}; });
  body.detect();
  ASSERT_GT(body.contacts.size(), 10u);
  for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, -0.02 * kRadius, 1e-12);
}

TEST(Lips, RimsThatCrossTouchBetweenTheirVertices) {
  // One lip lies on the other at one end and beside it at the other: in between only its lower rim and the other's upper one touch.
  const double r = kRadius, depth = 0.02 * r;
  for (const double side_up : {1.0, -1.0}) {
    LipBody body;
    body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
    for (const double gap : {0.1 * r, 0.0, -depth}) {
      body.place([&](Vec3 p, int side) {
        if (side < 0) return p;
        const double along = 0.2 * (p.y - 0.43);
        return p + Vec3{gap / std::sqrt(2) + along, 0, side_up * (2 * r + gap / std::sqrt(2) - along)};
      });
      body.detect();
      int crossings = 0;
      for (const Contact& c : body.contacts) {
        EXPECT_GT(c.gap, gap - 1e-9);
        if (std::fabs(c.normal.x) < 0.6 || std::fabs(c.normal.z) < 0.6) continue;
        ++crossings;
        EXPECT_NEAR(c.gap, gap, 1e-9);
        EXPECT_NEAR(std::fabs(c.normal.x + side_up * c.normal.z), std::sqrt(2), 1e-9);
        EXPECT_NEAR(c.point.y, 0.43, 0.02);
      }
      EXPECT_EQ(crossings, 1) << gap;
    }
  }
}

TEST(Lips, RimsGoOnToCrossWhenTheEndOfOneIsOnTheCrestOfTheOther) {
  // Held by the face below it, a corner that has come down to the other lip's upper rim comes no lower. Then the rims met just beyond that end, so not at all,
  // and the rest of the wall went into the other one by 0.2 half thicknesses in a step.
  const double r = kRadius, slope = 0.2, end = 0;
  for (const double beyond : {-0.3, 0.02, 0.06, 0.15}) {  // parts of r, the place of the corner along the other normal
    LipBody body;
    body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
    const auto cross_at = [&](double y, double gap) {
      body.place([&](Vec3 p, int side) {
        if (side < 0) return p;
        const double along = slope * (p.y - y);
        return p + Vec3{gap / std::sqrt(2) + along, 0, 2 * r + gap / std::sqrt(2) - along};
      });
      body.detect();
      int crossings = 0;
      for (const Contact& c : body.contacts) {
        if (std::fabs(c.normal.x) < 0.6 || std::fabs(c.normal.z) < 0.6) continue;
        ++crossings;
        EXPECT_NEAR(c.gap, gap, 1e-9);
        EXPECT_NEAR(c.point.y, std::max(end, y), 0.02) << beyond;
      }
      return crossings;
    };
    const double there = end - beyond * r / (std::sqrt(2) * slope);
    EXPECT_EQ(cross_at(there, 0.001 * r), beyond < 0 ? 1 : 0) << beyond;  // who never crossed doesn't begin to there
    EXPECT_EQ(cross_at(0.05, 0.001 * r), 1) << beyond;
    EXPECT_EQ(cross_at(there, -0.01 * r), beyond < 0.1 ? 1 : 0) << beyond;
    EXPECT_EQ(cross_at(there, -0.02 * r), beyond < 0.1 ? 1 : 0) << beyond;
    EXPECT_EQ(cross_at(there, 0.03 * r), beyond < 0 ? 1 : 0) << beyond;  // with air between, nothing has to be held
  }
}

TEST(Lips, TwistedWallsTouchBetweenTheirCorners) {
  // A lip that rises along an edge of the rim while its wall leans over to the other one. At height l on it, s along the edge, the wall is at
  //   x = -0.3 r s - 0.6 r s l,   and what faces it ends at l = 1 - 1.5 s
  // so it touches in the corners, s = 0 and 1, and is 0.9 r s (1 - s) deep in between. Part by part, since what is deep at first sight has passed over.
  constexpr double kThin = 0.004;
  LipBody body(2, kThin);
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  double low = 0, high = 1;  // of the edge in the middle of the rim
  for (const CollisionVertex v : ids<CollisionVertex>(body.surface.vertex_count()))
    if (const double y = body.surface.rest[v].y; body.surface.on_cut[v] != 0)
      (y < 0.3 ? low : high) = y < 0.3 ? std::max(low, y) : std::min(high, y);
  ASSERT_GT(high - low, 0.2);
  for (double part = 0; part < 1.01; part += 0.1) {
    const auto along = [&](Vec3 p) { return std::clamp((p.y - low) / (high - low), 0.0, 1.0); };
    body.place([&](Vec3 p, int side) {
      return side < 0 ? p : p + Vec3{-0.3 * part * kThin * along(p), 0, 1.5 * kThin * along(p)};
    });
    for (const CollisionTriangle t : ids<CollisionTriangle>(body.surface.face_count())) {
      const auto c = body.surface.vertices(t);
      if (body.surface.rest[c[0]].x + body.surface.rest[c[1]].x + body.surface.rest[c[2]].x < 1.5) continue;
      for (const CollisionVertex v : c) body.offset[v.index()].x = -0.6 * part * kThin * along(body.surface.rest[v]);
    }
    if (part < 0.25) body.memory = {};  // these places have no contact while the wall is hardly twisted
    body.detect();
    EXPECT_NEAR(body.least_gap(), -0.225 * part * kThin, 0.03 * kThin) << part;
  }
}

TEST(Lips, AThinOneThatLiesFlatOnTheOtherTouchesItWithAllItsRim) {
  // Faces that are near the rim at rest, on the other side of the cut, are no neighbours of it, however flat the sheet is.
  constexpr double kThin = 0.008;
  for (const int grid : {9, 13, 21}) {
    LipBody body(grid, kThin, false);
    body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
    for (double moved = 0.04; moved < 0.4; moved += 0.03) {
      body.place([&](Vec3 p, int side) { return side > 0 ? p + Vec3{-moved, 0, 2.05 * kThin} : p; });
      body.detect();
      std::vector<int> touched(body.surface.vertex_count(), 0);
      for (const Contact& c : body.contacts)
        if (c.b.vertex[0].valid() && std::fabs(c.normal.z) > 0.99)
          for (const SurfacePoint* p : {&c.a, &c.b})
            if (p->vertex[0].valid() && !p->vertex[1].valid()) touched[p->vertex[0].index()] = 1;
      int rim = 0;
      for (const CollisionVertex v : ids<CollisionVertex>(body.surface.vertex_count()))
        if (body.surface.on_cut[v] != 0 && body.position[v.index()].z == 0) {
          EXPECT_EQ(touched[v.index()], 1) << grid << " moved by " << moved << " at " << body.surface.rest[v].y;
          ++rim;
        }
      EXPECT_GE(rim, grid);
    }
  }
}

TEST(Lips, LiftedOverAndBack) {
  LipBody body;
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  const auto at = [&](double apart, double height) {
    body.place([&](Vec3 p, int side) { return p + (side > 0 ? Vec3{apart, 0, height} : Vec3{}); });
    body.detect();
  };
  const double r = kRadius;
  // Up, in steps.
  for (const double h : {0.0, 0.5, 1.0, 1.5, 1.9}) {
    at(0.001 * r, h * r);
    for (const Contact& c : body.contacts) EXPECT_GT(c.gap, -0.01 * r) << h;
  }
  // Over the other, then down on it: contacts along z, none sideways.
  for (const double x : {0.0, -0.2, -0.5, -1.0, -2.0}) {
    at(x * r, 2.02 * r);
    for (const Contact& c : body.contacts) {
      EXPECT_NEAR(c.gap, 0.02 * r, 1e-9) << x;
    }
  }
  EXPECT_FALSE(body.contacts.empty());
  at(-2 * r, 1.9 * r);
  ASSERT_FALSE(body.contacts.empty());
  for (const Contact& c : body.contacts) {
    EXPECT_NEAR(c.gap, -0.1 * r, 1e-9);
    EXPECT_GT(std::fabs(c.normal.z), 0.999);
  }
  // Pressed much too hard it still knows which one is above.
  for (const double h : {1.5, 1.0, 0.5, 0.1}) {
    at(-2 * r, h * r);
    ASSERT_FALSE(body.contacts.empty());
    for (const Contact& c : body.contacts) {
      const bool right = body.position[c.a.vertex[0].index()].z == h * r;
      EXPECT_NEAR(c.normal.z, right ? 1 : -1, 1e-9) << h;
      EXPECT_NEAR(c.gap, (h - 2) * r, 1e-9);
    }
  }
  // And back.
  at(-2 * r, 2.02 * r);
  at(0.01 * r, 2.02 * r);
  at(0.01 * r, 1.0 * r);
  for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, 0.01 * r, 1e-9);
  at(-0.01 * r, 0);
  ASSERT_FALSE(body.contacts.empty());
  for (const Contact& c : body.contacts) {
    EXPECT_NEAR(c.gap, -0.01 * r, 1e-9);
    EXPECT_LT(std::fabs(c.normal.z), 1e-9);
  }
}

TEST(Lips, TwoCutsThatCross) {
  LipBody body;
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  body.make_cut({{-0.1, 0.44, 0}, {1.1, 0.49, 0}});
  body.detect();
  ASSERT_FALSE(body.contacts.empty());
  for (const Contact& c : body.contacts) EXPECT_EQ(c.gap, 0);
  // All four quarters pushed to the middle.
  const double push = 0.02 * kRadius;
  body.position = body.predicted;
  body.place([](Vec3 p, int) { return p; });
  for (const CollisionTriangle t : ids<CollisionTriangle>(body.surface.face_count())) {
    const auto c = body.surface.vertices(t);
    Vec3 middle;
    for (const CollisionVertex v : c) middle += (1.0 / 3) * body.surface.rest[v];
    const double cut_y = 0.44 + 0.05 * (middle.x + 0.1) / 1.2;
    for (const CollisionVertex v : c)
      body.position[v.index()] =
          body.surface.rest[v] - 0.5 * push * Vec3{middle.x > 0.5 ? 1.0 : -1.0, middle.y > cut_y ? 1.0 : -1.0, 0};
  }
  body.predicted = body.position;
  body.detect();
  ASSERT_FALSE(body.contacts.empty());
  // In the corner the smoothed conormal is a little off.
  for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, -push, 0.1 * push) << c.a.vertex[0].value;
}

/// Two cuts that cross, and the four quarters moved one by one: (x, y) = (1, -1) is that of large x and small y.
struct Quarters : LipBody {
  static constexpr Vec3 kMiddle{0.5, 0.5, 0};
  Quarters() : LipBody(8) {
    make_cut({{kMiddle.x, -0.1, 0}, {kMiddle.x, 1.1, 0}});
    make_cut({{1.1, kMiddle.y, 0}, {-0.11, kMiddle.y, 0}});
  }
  template <class Fn>
  void move(Fn&& f) {
    place([](Vec3 p, int) { return p; });
    for (const CollisionTriangle t : ids<CollisionTriangle>(surface.face_count())) {
      const auto c = surface.vertices(t);
      const Vec3 middle = (1.0 / 3) * (surface.rest[c[0]] + surface.rest[c[1]] + surface.rest[c[2]]);
      for (const CollisionVertex v : c)
        position[v.index()] = surface.rest[v] + f(middle.x > kMiddle.x ? 1 : -1, middle.y > kMiddle.y ? 1 : -1);
    }
    predicted = position;
    detect();
  }
};

TEST(Lips, CornersAcrossACrossingKeepOutOfEachOther) {
  Quarters body;
  const double r = kRadius;
  const auto away = [&](int x, int y) { return 5 * r * Vec3{static_cast<double>(x), static_cast<double>(y), 0}; };
  for (int k = -3; k < 4; ++k) {
    // The corners go into each other by d along x and e along y: apart the shorter way, or not at all.
    for (int l = -3; l < 4; ++l) {
      const double d = 0.02 * k * r, e = 0.02 * l * r;
      body.memory = {};
      for (const double part : {0.25, 0.5, 0.75, 1.0})
        body.move([&](int x, int y) { return x != y ? away(x, y) : x < 0 ? Vec3{} : Vec3{-part * d, -part * e, 0}; });
      if (std::min(d, e) <= 0) {
        for (const Contact& c : body.contacts) EXPECT_GE(c.gap, -1e-9) << k << " " << l;
        continue;
      }
      ASSERT_FALSE(body.contacts.empty()) << k << " " << l;
      EXPECT_NEAR(body.least_gap(), -std::min(d, e), 0.02 * std::min(d, e)) << k << " " << l;
      for (const Contact& c : body.contacts)
        EXPECT_NEAR(std::max(std::fabs(c.normal.x), std::fabs(c.normal.y)), 1, 1e-3);
    }
  }
}

TEST(Lips, ACornerLiesOnThePieceAcrossThoughItsOwnLipsAreClosed) {
  Quarters body;
  const double r = kRadius;
  for (const double height : {2.02, 1.98, 1.95, 1.92}) {
    // Both quarters of large x rise together, and slide over those of small x.
    body.move([&](int x, int y) {
      return x > 0 ? Vec3{-0.6 * r, -0.6 * r, height * r} : y > 0 ? 4 * r * Vec3{-1, 1, 0} : Vec3{};
    });
    int on_top = 0;
    for (const Contact& c : body.contacts) {
      const bool corner = norm(body.surface.rest[c.a.vertex[0]] - Quarters::kMiddle) < 1e-9 && !c.a.vertex[1].valid() &&
                          body.position[c.a.vertex[0].index()].z > r;
      if (!corner || std::fabs(c.normal.z) < 0.99) continue;
      ++on_top;
      EXPECT_NEAR(c.gap, (height - 2) * r, 1e-9);
    }
    EXPECT_EQ(on_top, 2) << height;  // of the upper quarter and of the lower one
  }
}

TEST(Lips, ABorderMeetsTheWallOfALipThatLeans) {
  // The wall over the left lip leans until it is a plate under which the right side comes with its outer border: no rim, so no lip. On the way from its foot,
  // straight up, it would be deep in the prism long before it touches the plate, and has had no contact then.
  LipBody body;
  const double r = kRadius;
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  const Vec3 lean{1.7 * r, 0, 0.4 * r}, down = normalized(Vec3{0.4, 0, -1.7});
  for (const double height : {-1.2, -1.1, -1.03, -1.0, -0.98}) {
    body.place([&](Vec3 p, int side) { return side > 0 ? Vec3{1.5 - p.x, p.y, height * r} : p; });
    for (std::size_t v = 0; v < body.offset.size(); ++v)
      if (body.position[v].z == 0) body.offset[v] = lean;
    body.detect();
    int met = 0;
    for (const Contact& c : body.contacts) {
      if (c.a.vertex[1].valid() || body.surface.rest[c.a.vertex[0]].x != 1 || c.normal.z > 0.5) continue;
      ++met;
      EXPECT_LT(norm(c.normal - down), 1e-9);
      EXPECT_NEAR(c.gap, down.z * (height + 1) * r, 1e-9);
      // It is met where it is, halfway up the wall, not at an end of that: the force would turn both.
      const std::size_t v = c.a.vertex[0].index();
      EXPECT_LT(norm(cross(c.normal, body.position[v] + c.a.lift * body.offset[v] - c.point)), 1e-9);
      EXPECT_LT(std::fabs(c.b.lift), 0.1);
    }
    EXPECT_GE(met, 5) << height;
  }
}

TEST(Lips, WedgeShapedRim) {
  TriangleMesh mesh = plain_grid_mesh(6, 6);
  LipBody body;
  // Thickness falls to a tenth along the cut.
  for (const CollisionVertex v : ids<CollisionVertex>(body.cut.body.collision.vertex_count())) {
    const double y = body.cut.body.collision.rest[v].y;
    body.cut.body.collision.offset.set(v, {0, 0, kRadius * (1 - 0.9 * y)});
  }
  body.surface = make_contact_surface(body.cut.body.collision);
  body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  body.detect();
  ASSERT_FALSE(body.contacts.empty());
  for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, 0, 1e-15);
  body.place([&](Vec3 p, int side) { return p + Vec3{-0.005 * kRadius * side, 0.03 * side, 0}; });
  body.detect();
  ASSERT_GT(body.contacts.size(), 10u);
  for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, -0.01 * kRadius, 1e-12);
}

TEST(Lips, APointedCornerIsNoTip) {
  // Two cuts that cross at 8 degrees leave two pointed corners: the walls at either lie nearly back to back, as those at the tip of a slit do.
  LipBody body(6, 0.02);
  body.make_cut({{0.42, -0.1, 0}, {0.50, 0.9, 0}, {0.516, 1.1, 0}});
  body.make_cut({{0.50, -0.1, 0}, {0.42, 0.9, 0}, {0.404, 1.1, 0}});
  const ContactSurface& s = body.surface;
  body.detect();
  int pointed = 0;
  for (const CollisionVertex v : ids<CollisionVertex>(s.vertex_count())) {
    if (norm(s.rest[v] - Vec3{0.46, 0.4, 0}) > 0.02) continue;
    double angle = 0;
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(s.origin.size()))
      if (s.from(h) == v) {
        const Vec3 a = s.rest[s.to(h)] - s.rest[v], b = s.rest[s.from(ContactSurface::prev(h))] - s.rest[v];
        angle += std::acos(dot(a, b) / (norm(a) * norm(b)));
      }
    if (angle > 0.3) continue;
    ++pointed;
    const auto is_its = [&](const Contact& c) { return c.a.vertex[0] == v && !c.a.vertex[1].valid(); };
    EXPECT_GE(std::count_if(body.contacts.begin(), body.contacts.end(), is_its), 2) << v.value;  // of either wall
  }
  EXPECT_EQ(pointed, 2);
  for (const Contact& c : body.contacts) EXPECT_NEAR(c.gap, 0, 1e-9);
}

TEST(Lips, MadeDeepInEachOtherTheyComeApart) {
  // Ahead of a tip the two sides of a cell may move into each other; a cut that goes on makes lips that overlap. But lips that share little height have
  // passed over each other, and nothing says which way is back.
  for (const double deep : {0.3, 0.6}) {
    LipBody body;
    body.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
    body.memory = {};
    body.place([&](Vec3 p, int side) { return p - Vec3{0.5 * deep * kRadius * side, 0, 0}; });
    body.detect();
    ASSERT_GT(body.contacts.size(), 10u);
    for (const Contact& c : body.contacts) {
      EXPECT_NEAR(c.gap, -deep * kRadius, 1e-12);
      EXPECT_GT(std::fabs(c.normal.x), 0.999);
    }
  }
  LipBody over;
  over.make_cut({{0.5, -0.1, 0}, {0.5, 1.1, 0}});
  over.memory = {};
  over.place([&](Vec3 p, int side) { return p + Vec3{-0.3 * kRadius * side, 0, 0.85 * kRadius * side}; });
  over.detect();
  for (const Contact& c : over.contacts) EXPECT_LT(std::fabs(c.normal.x), 0.1);
}

}  // namespace
}  // namespace kerf::lips_test
