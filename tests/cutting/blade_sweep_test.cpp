// Blades through deformed, moving meshes: where they cut, that nothing breaks, and that what is provisional leaves no trace.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cutting/move_blade.h"
#include "kerf/base/random.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/validate.h"
#include "kerf/spatial/triangle_queries.h"
#include "support/synthetic_complex.h"

namespace kerf::blade_sweep_test {
namespace {

using namespace testing_support;

struct Bench {
  CellComplex body;
  std::vector<Vec3> position, posed;
  FaceBoxes boxes;
  CutScratch scratch;
  CutOptions options;
  BladeStroke stroke;
  ComplexMeasures start;
  Vec3 (*deform)(Vec3) = [](Vec3 p) { return p; };

  explicit Bench(const TriangleMesh& surface, bool closed = true, int subdivisions = 2) {
    SyntheticOptions o;
    o.closed = closed;
    o.subdivisions = subdivisions;
    body = make_synthetic_complex(surface, o);
    start = measure_complex(body);
    place();
  }
  void place() {
    position.clear();
    boxes.forget();
    for (const Vec3& p : body.collision.rest.raw()) position.push_back(deform(p));
  }
  SweepReport move(Vec3 base, Vec3 tip) {
    const SweepReport report = move_blade(*this, {base, tip});
    const Status valid = validate_complex(body, start);
    EXPECT_TRUE(valid.ok()) << (valid.ok() ? "" : valid.error().message);
    EXPECT_EQ(position.size(), body.collision.vertex_count());
    return report;
  }
  SweepReport vertical(double x, double y) { return move({x, y, 1}, {x, y, -1}); }
  int pieces() const { return collision_pieces(body).count; }
};

/// Length of all borders made by cuts, at rest; each cut has two lips.
double lip_length(const CellComplex& body) {
  double sum = 0;
  const CollisionMesh& m = body.collision;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(m.half_edge_count()))
    if (m.is_border(h) && !(m.on_rim(m.from(h)) && m.on_rim(m.to(h)) && !m.wall[h].valid()))
      sum += norm(m.rest[m.to(h)] - m.rest[m.from(h)]);
  return sum;
}

TEST(BladeSweep, StraightAcrossASheetMakesTwoPieces) {
  for (const bool closed : {false, true}) {
    Bench b(sheet_65_mesh(), closed);
    b.vertical(-0.2, 0.43);
    b.vertical(1.2, 0.47);
    EXPECT_EQ(b.pieces(), 2);
  }
}

// A stroke that crosses a cut divides both of its lips. Contact takes vertices of lips at one place for one place.
TEST(BladeSweep, CrossesBothLipsAtOnePlaceToTheBit) {
  Random random(4);
  for (int i = 0; i < 40; ++i) {
    Bench b(sheet_65_mesh());
    for (int k = 0; k < 4; ++k) {
      const bool across = k % 2 == 0;
      for (const double end : {-0.1, 1.1}) {
        const double other = random.uniform(0.1, 0.9);
        b.vertical(across ? end : other, across ? other : end);
      }
      lift_blade(b.stroke);
    }
    std::vector<Vec3> places = b.body.collision.rest.raw();
    std::sort(places.begin(), places.end(), is_less);
    for (std::size_t v = 1; v < places.size(); ++v)
      for (std::size_t w = v; w-- > 0 && places[v].x - places[w].x < 1e-12;)
        EXPECT_TRUE(places[v] == places[w] || norm(places[v] - places[w]) > 1e-12) << i;
  }
}

TEST(BladeSweep, TheCutEndsWhereTheBladeIs) {
  Bench b(sheet_65_mesh());
  b.vertical(-0.1, 0.41);
  for (int i = 1; i <= 40; ++i) {
    const double x = -0.1 + 0.02 * i;
    b.vertical(x, 0.41);
    if (x > 0.05) {
      ASSERT_EQ(b.stroke.fronts.size(), 1u);
      const Vec3 tip = b.position[b.stroke.fronts[0].index()];
      EXPECT_NEAR(tip.x, x, 2 * b.options.minimum_feature * b.body.mean_root_edge + 0.05 * b.body.mean_root_edge);
      EXPECT_NEAR(tip.y, 0.41, 0.05 * b.body.mean_root_edge);
    }
  }
  EXPECT_EQ(b.pieces(), 1);
  EXPECT_NEAR(lip_length(b.body), 2 * 0.7, 0.03);
}

TEST(BladeSweep, CoarseAndFinePosesCutTheSameLength) {
  for (const int n : {1, 3, 17, 120}) {
    Bench b(sheet_65_mesh());
    b.vertical(-0.1, 0.37);
    for (int i = 1; i <= n; ++i) b.vertical(-0.1 + 0.8 * i / n, 0.37 + 0.1 * i / n);
    EXPECT_NEAR(lip_length(b.body), 2 * 0.706, 0.03) << n << " poses";
    EXPECT_EQ(b.pieces(), 1);
  }
}

TEST(BladeSweep, StabInTheMiddleAndPullOut) {
  Bench b(sheet_65_mesh());
  b.move({0.45, 0.52, 1}, {0.45, 0.52, 0.3});   // above
  b.move({0.45, 0.52, 1}, {0.45, 0.52, -0.3});  // through
  EXPECT_EQ(b.stroke.fronts.size(), 1u);
  for (int i = 1; i <= 10; ++i) b.move({0.45 + 0.02 * i, 0.52, 1}, {0.45 + 0.02 * i, 0.52, -0.3});
  EXPECT_NEAR(lip_length(b.body), 0.4, 0.03);
  b.move({0.65, 0.52, 1}, {0.65, 0.52, 0.3});  // out again
  b.move({0.75, 0.52, 1}, {0.75, 0.52, 0.3});  // and on, in the air
  EXPECT_TRUE(b.stroke.fronts.empty());
  EXPECT_NEAR(lip_length(b.body), 0.4, 0.03);
}

TEST(BladeSweep, LiftingTheBladeKeepsTheEndOfTheCut) {
  for (int k = 0; k < 24; ++k) {  // the end anywhere in a triangle
    const double end = 0.45 + 0.013 * k;
    Bench b(sheet_65_mesh());
    b.vertical(-0.1, 0.53);
    for (int i = 1; i <= 9; ++i) b.vertical(-0.1 + (end + 0.1) * i / 9, 0.53);
    const double length = lip_length(b.body);
    EXPECT_NEAR(length, 2 * end, 0.03);
    b.move({end, 0.53, 1}, {end, 0.53, 0.5});  // lifted
    b.move({end + 0.2, 0.53, 1}, {end + 0.2, 0.53, 0.5});
    EXPECT_NEAR(lip_length(b.body), length, 1e-9) << "end at " << end;
  }
}

TEST(BladeSweep, BackAndForthInItsOwnSlitCutsNothingMore) {
  for (const bool through : {false, true})
    for (const double aside : {0.0, 1e-9, 0.002}) {
      SCOPED_TRACE(testing::Message() << "through " << through << ", aside " << aside);
      Bench b(sheet_65_mesh());
      b.stroke.through = through;
      const auto go = [&](double from, double to, double y) {
        for (int i = 0; i <= 17; ++i) b.vertical(from + (to - from) * i / 17, y);
      };
      go(-0.1, 0.6, 0.43);
      const double length = lip_length(b.body);
      go(0.6, 0.2, 0.43 + aside);
      EXPECT_NEAR(lip_length(b.body), length, 1e-9);
      EXPECT_EQ(b.stroke.fronts.size(), 1u);
      go(0.2, 0.6, 0.43);
      EXPECT_NEAR(lip_length(b.body), length, 0.01);
      go(0.6, 0.8, 0.43);  // and on
      EXPECT_NEAR(lip_length(b.body), length + 0.4, 0.01);
      go(0.8, 0.3, 0.43);
      for (int i = 1; i <= 5; ++i) b.vertical(0.3, 0.43 + 0.05 * i);  // a branch
      EXPECT_NEAR(lip_length(b.body), length + 0.4 + 0.5, 0.02);
      EXPECT_EQ(b.pieces(), 1);
    }
}

TEST(BladeSweep, CurvedCutFollowsTheBlade) {
  Bench b(sheet_65_mesh());
  const double r = 0.3;
  for (int i = 0; i <= 60; ++i) {
    const double a = 1.5 * 3.14159265 * i / 60;
    b.vertical(0.5 + r * std::cos(a), 0.5 + r * std::sin(a));
  }
  EXPECT_NEAR(lip_length(b.body), 2 * 1.5 * 3.14159265 * r, 0.06 * 2 * 1.5 * 3.14159265 * r);
  // Every lip vertex is near the circle.
  for (const CollisionVertex v : ids<CollisionVertex>(b.body.collision.vertex_count()))
    if (b.body.collision.on_border(v) && !b.body.collision.on_rim(v)) {
      const Vec3 p = b.body.collision.rest[v];
      EXPECT_NEAR(std::hypot(p.x - 0.5, p.y - 0.5), r, 0.08 * b.body.mean_root_edge);
    }
}

TEST(BladeSweep, AClosedLoopCutsAnIslandLoose) {
  Bench b(sheet_65_mesh());
  for (int i = 0; i <= 52; ++i) {
    const double a = 2 * 3.14159265 * i / 48;
    b.vertical(0.5 + 0.27 * std::cos(a), 0.52 + 0.27 * std::sin(a));
  }
  EXPECT_EQ(b.pieces(), 2);
}

// A long blade meets the sheet near one end, and leans another way at each corner: the strips twist, and both ends of each must lie where the blade was.
TEST(BladeSweep, OutlinesOfALeaningBladeClose) {
  for (const bool through : {false, true})
    for (unsigned seed = 1; seed <= 40; ++seed) {
      Bench b(sheet_65_mesh());
      b.stroke.through = through;
      Random random(seed);
      const double turned = random.uniform(0, 2 * std::numbers::pi), radius = random.uniform(0.2, 0.35);
      std::vector<BladeEdge> corners;
      for (int i = 0; i < 5; ++i) {
        const double angle = turned + 0.4 * std::numbers::pi * i;
        const Vec3 p{0.5 + radius * std::cos(angle), 0.5 + radius * std::sin(angle), 0};
        const Vec3 down = normalized(Vec3{random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03), -1});
        corners.push_back({p - 0.1 * down, p + 4 * down});
      }
      corners.push_back(corners.front());
      for (const BladeEdge& e : corners) b.move(e.base, e.tip);
      lift_blade(b.stroke);
      EXPECT_EQ(b.pieces(), 2) << "seed " << seed << (through ? ", through" : "");
    }
}

TEST(BladeSweep, CrossingCutsMakeFourPieces) {
  for (const bool closed : {false, true}) {
    Bench b(sheet_65_mesh(), closed);
    b.vertical(-0.1, 0.41);
    b.vertical(1.1, 0.46);
    lift_blade(b.stroke);
    b.vertical(0.47, -0.1);
    b.vertical(0.52, 1.1);
    EXPECT_EQ(b.pieces(), 4);
  }
}

TEST(BladeSweep, ReentersTheOtherLipOfAnOpenSlit) {
  Bench b(sheet_65_mesh());
  b.vertical(-0.1, 0.5);
  b.vertical(0.83, 0.5);
  lift_blade(b.stroke);
  // The slit gapes: everything above it is pushed away.
  for (std::size_t i = 0; i < b.position.size(); ++i) {
    const CollisionVertex v(i);
    bool above = false;
    b.body.collision.for_each_outgoing(v, [&](CollisionHalfEdge h) {
      const auto& m = b.body.collision;
      const Vec3 c = (1.0 / 3) * (m.rest[m.from(h)] + m.rest[m.to(h)] + m.rest[m.apex(h)]);
      above |= c.y > 0.5 && m.rest[v].x < 0.82;
      return true;
    });
    const Vec3 p = b.body.collision.rest[v];
    if (above && p.y >= 0.499) b.position[i].y += 0.15 * (0.83 - p.x);
  }
  b.vertical(0.3, -0.1);
  for (int i = 1; i <= 14; ++i) b.vertical(0.3, -0.1 + 0.1 * i);
  EXPECT_EQ(b.pieces(), 3);
}

TEST(BladeSweep, ScreenStrokeCutsTheFirstLayerOnlyUnlessThrough) {
  for (const bool through : {false, true}) {
    // Half a cylinder, its axis along y: seen from above, one half of the sheet lies over the other.
    Bench b(bent_mesh(plain_grid_mesh(12, 4, 3.0, 1.0), 3.0 / 3.14159265), true);
    b.stroke.through = through;
    b.move({0.5, -0.1, 5}, {0.5, -0.1, -5});
    b.move({0.5, 1.1, 5}, {0.5, 1.1, -5});
    EXPECT_EQ(b.pieces(), through ? 3 : 2);
    if (!through)  // the upper one
      for (const CollisionVertex v : ids<CollisionVertex>(b.body.collision.vertex_count()))
        if (b.body.collision.ancestor[v] != v) {
          EXPECT_GT(b.body.collision.rest[v].z, -0.9);
        }
  }
}

/// A long blade comes down on its whole length at once.
TEST(BladeSweep, ChopThroughAFlatSheet) {
  for (const bool through : {false, true})
    for (const int poses : {1, 7})
      for (const double tilt : {0.0, 1e-12, -1e-6, 0.01, -0.3}) {
        SCOPED_TRACE(testing::Message() << poses << " poses, tilt " << tilt << ", through " << through);
        Bench b(sheet_65_mesh());
        b.stroke.through = through;
        for (int i = 0; i <= poses; ++i) {
          const double z = 0.5 - 1.0 * i / poses;
          b.move({-0.3, 0.43, z - 0.8 * tilt}, {1.3, 0.45, z + 0.8 * tilt});
        }
        EXPECT_EQ(b.pieces(), 2);
        EXPECT_NEAR(lip_length(b.body), 2, 0.01);
        EXPECT_TRUE(b.stroke.fronts.empty());
      }
}

/// A short one cuts as far as it is long, whichever end comes first.
TEST(BladeSweep, ShortBladePressedIntoASheetCutsItsLength) {
  for (const double tilt : {0.0, 1e-9, 0.02, -0.02, 0.2, -0.2}) {
    SCOPED_TRACE(tilt);
    Bench b(sheet_65_mesh());
    for (int i = 0; i <= 5; ++i) {
      const double z = 0.25 - 0.1 * i;
      b.move({0.31, 0.43, z - 0.2 * tilt}, {0.69, 0.47, z + 0.2 * tilt});
    }
    EXPECT_EQ(b.pieces(), 1);
    EXPECT_NEAR(lip_length(b.body), 2 * 0.382, 0.03);
  }
}

/// A blade that comes down nearly parallel to a sheet, flat or slightly wavy, in steps of any size, straight or slanting and sliding, longer or shorter
/// than the sheet. Where it passes the sheet is known: the sheet is cut there, and nowhere else.
TEST(BladeSweep, LandsFlatAndCutsWhereItPasses) {
  int too_long = 0;
  for (int seed = 0; seed < 240; ++seed) {
    SCOPED_TRACE(seed);
    Random random(static_cast<std::uint64_t>(seed) + 4000);
    Bench b(sheet_65_mesh(), true, 1);
    b.stroke.through = seed % 2 == 1;
    const bool is_short = seed % 4 >= 2;
    const double heading = random.uniform(0, 2 * std::numbers::pi), half = is_short ? random.uniform(0.15, 0.35) : 1.2;
    const double tilt = seed % 5 == 0 ? 0 : random.uniform(-0.03, 0.03);
    const Vec3 along{std::cos(heading), std::sin(heading), 0}, aside{-along.y, along.x, 0};
    const Vec3 motion = Vec3{0, 0, -1} + (seed % 3 == 0 ? random.uniform(-0.7, 0.7) : 0) * aside +
                        (is_short ? 0 : random.uniform(-0.5, 0.5)) * along;
    const Vec3 middle{0.5 + random.uniform(-0.15, 0.15), 0.5 + random.uniform(-0.15, 0.15), 0},
        edge = along + Vec3{0, 0, tilt};
    const double wave = seed % 8 >= 4 ? random.uniform(0, 0.006) : 0, phase = random.uniform(0, 6),
                 kx = random.uniform(2, 9), ky = random.uniform(2, 9);
    const auto height = [&](Vec3 p) {
      return wave * (std::sin(kx * p.x + phase) + 0.7 * std::cos(ky * p.y + 2 * phase));
    };
    for (Vec3& p : b.position) p.z += height(p);
    const double step = std::pow(10, random.uniform(-2.5, -0.7)), far = 0.05 + std::abs(tilt) * half + 2 * wave;
    for (double t = -far; t < far + step; t += step * random.uniform(0.3, 1)) {
      const Vec3 p = middle + t * motion;
      move_blade(b, {p - half * edge, p + half * edge});
    }
    const Status valid = validate_complex(b.body, b.start);
    ASSERT_TRUE(valid.ok()) << valid.error().message;

    const CollisionMesh& m = b.body.collision;
    double length = 0, farthest = 0;
    for (int i = 0; i <= 400; ++i) {
      const Vec3 at = middle + half * (i / 200.0 - 1) * edge;
      double t = at.z;
      for (int k = 0; k < 20; ++k) t = at.z - height(at + t * motion);
      Vec3 p = at + t * motion;
      p.z = 0;
      if (p.x < 0.01 || p.x > 0.99 || p.y < 0.01 || p.y > 0.99) continue;
      double nearest = HUGE_VAL;
      for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(m.half_edge_count()))
        if (m.is_border(h) && m.wall[h].valid())
          nearest = std::min(nearest, distance_to_segment(p, m.rest[m.from(h)], m.rest[m.to(h)]));
      farthest = std::max(farthest, nearest);
      length += norm(half / 200 * (edge + tilt * motion));
    }
    EXPECT_LT(farthest, 5 * b.options.minimum_feature * b.body.mean_root_edge);
    if (0.5 * lip_length(b.body) > length + 0.07) {
      ++too_long;
      EXPECT_TRUE(b.stroke.through) << 0.5 * lip_length(b.body) << " of " << length;
    }
  }
  EXPECT_LE(too_long, 2) << "two fronts that meet may pass each other beside a corner to which one of them snapped";
}

/// A wavy sheet that goes down a step as steep as the blade, and on, every third one up again: in any number of moves the blade comes out at its far rim.
//   ______             ____
//         |           |
//         |___________|     blade --->
TEST(BladeSweep, DownAStepAndOnToTheRim) {
  for (int seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    Random random(static_cast<std::uint64_t>(seed) + 9100);
    Bench b(sheet_65_mesh(), seed % 2 == 1, 1);
    const double first = random.uniform(0.25, 0.45), last = first + random.uniform(0.15, 0.35),
                 lean = random.uniform(0, 0.3);
    const double wave = random.uniform(0, 0.03), kx = random.uniform(3, 12), ky = random.uniform(3, 12),
                 phase = random.uniform(0, 6);
    for (Vec3& p : b.position) {
      const double down = std::clamp(p.x, first, last) - first;
      p = {p.x - (1 - lean) * down, p.y,
           wave * std::sin(kx * p.x + ky * p.y + phase) - std::sqrt(1 - lean * lean) * down};
    }
    const Vec3 from{-0.1, random.uniform(0.3, 0.7), 0},
        to{1.1 - (1 - lean) * (last - first), random.uniform(0.3, 0.7), 0}, up{0, 0, 1};
    const int moves = 1 + static_cast<int>(random.uniform(0, 40));
    for (int i = 0; i <= moves; ++i) {
      const Vec3 p = lerp(from, to, static_cast<double>(i) / moves);
      (void)move_blade(b, {p + up, p - up});
    }
    const Status valid = validate_complex(b.body, b.start);
    ASSERT_TRUE(valid.ok()) << valid.error().message;
    EXPECT_GE(b.pieces(), 2) << moves << " moves, lean " << lean << ", wave " << wave;
  }
}

/// A tube along y, between 0.5 and 1.5: a ring in the plane, rolled.
Vec3 rolled(Vec3 p) {
  const double angle = std::atan2(p.y, p.x);
  return {0.3 * std::cos(angle), std::hypot(p.x, p.y), 0.3 * std::sin(angle)};
}

TEST(BladeSweep, ChopThroughATube) {
  for (const int poses : {1, 2, 9, 60})
    for (const double wobble : {0.0, 0.02}) {
      SCOPED_TRACE(testing::Message() << poses << " poses, wobble " << wobble);
      Bench b(annulus_mesh(0.5, 1.5, 24, 6));
      b.stroke.through = true;
      b.deform = rolled;
      b.place();
      for (int i = 0; i <= poses; ++i) {
        const double z = 0.5 - 1.0 * i / poses, y = 0.93 + wobble * std::sin(7 * z);
        b.move({-1, y, z}, {1, y + 0.02, z});
        if (poses == 60 && std::abs(z) < 0.25) {
          EXPECT_EQ(b.stroke.fronts.size(), 2u) << "at z = " << z;
        }
      }
      EXPECT_EQ(b.pieces(), 2);
    }
}

/// Half way through a tube, and out again the way it came.
TEST(BladeSweep, ANotchInATube) {
  Bench b(annulus_mesh(0.5, 1.5, 24, 6));
  b.stroke.through = true;
  b.deform = rolled;
  b.place();
  for (int i = 0; i <= 20; ++i) b.move({-1, 0.93, 0.5 - 0.025 * i}, {1, 0.94, 0.5 - 0.025 * i});
  EXPECT_EQ(b.stroke.fronts.size(), 2u);
  const double half_ring = lip_length(b.body);
  for (int i = 20; i >= 0; --i) b.move({-1, 0.93, 0.5 - 0.025 * i}, {1, 0.94, 0.5 - 0.025 * i});
  EXPECT_EQ(b.pieces(), 1);
  EXPECT_NEAR(lip_length(b.body), half_ring, 1e-12);
  // At rest, a ring of radius 0.93.
  EXPECT_NEAR(half_ring, 2 * std::numbers::pi * 0.935, 0.06);
}

TEST(BladeSweep, PressedOntoADome) {
  Bench b(sheet_65_mesh());
  b.stroke.through = true;
  b.deform = [](Vec3 p) { return Vec3{p.x, p.y, 0.3 - 1.2 * ((p.x - 0.5) * (p.x - 0.5) + (p.y - 0.5) * (p.y - 0.5))}; };
  b.place();
  for (int i = 0; i <= 10; ++i) b.move({-1, 0.48, 0.5 - 0.03 * i}, {2, 0.49, 0.5 - 0.03 * i});  // down to 0.2
  EXPECT_EQ(b.stroke.fronts.size(), 2u);
  EXPECT_EQ(b.pieces(), 1);
  EXPECT_NEAR(lip_length(b.body), 2 * 2 * std::sqrt(0.1 / 1.2), 0.05);
  for (int i = 11; i <= 40; ++i) b.move({-1, 0.48, 0.5 - 0.03 * i}, {2, 0.49, 0.5 - 0.03 * i});
  EXPECT_EQ(b.pieces(), 2);
}

/// The material comes to the blade, whose own moves are small.
TEST(BladeSweep, ADomeThatRisesAgainstTheBlade) {
  static double height;
  height = 0;
  Bench b(sheet_65_mesh());
  b.stroke.through = true;
  b.deform = [](Vec3 p) {
    return Vec3{p.x, p.y, height - 1.2 * ((p.x - 0.5) * (p.x - 0.5) + (p.y - 0.5) * (p.y - 0.5))};
  };
  for (int i = 0; i <= 40; ++i) {
    height = 0.01 * i;
    b.place();
    b.move({-1, 0.48, 0.2 - 1e-4 * i}, {2, 0.49, 0.2 - 1e-4 * i});
  }
  // A parabola up to 0.204 above the edge, in six flat pieces; the cut is one bit and reaches from side to side.
  EXPECT_EQ(b.pieces(), 1);
  EXPECT_NEAR(lip_length(b.body), 2 * 2 * std::sqrt(0.204 / 1.2), 0.16);
  EXPECT_EQ(b.stroke.fronts.size(), 2u);
}

TEST(BladeSweep, TurningScalpelOnABentSheet) {
  Bench b(sheet_65_mesh());
  b.deform = [](Vec3 p) { return Vec3{p.x, p.y, 0.15 * std::sin(4 * p.x) + 0.1 * p.y * p.y}; };
  b.place();
  for (int i = 0; i <= 30; ++i) {
    const double t = i / 30.0, tilt = 0.5 * std::sin(5 * t);
    b.move({-0.1 + 1.2 * t + tilt, 0.3 + 0.3 * t, 1}, {-0.1 + 1.2 * t - tilt, 0.3 + 0.3 * t, -1});
  }
  EXPECT_EQ(b.pieces(), 2);
}

TEST(BladeSweep, ProvisionalEndsLeaveNoTrace) {
  Bench b(sheet_65_mesh());
  b.vertical(-0.1, 0.41);
  b.vertical(0.30, 0.41);
  const std::size_t vertices = b.body.collision.vertex_count();
  const std::size_t triangles = b.body.visual.face_count();
  Random random(3);
  for (int i = 0; i < 200; ++i) b.vertical(0.30 + 0.012 * random.uniform(), 0.41);
  b.vertical(0.30, 0.41);
  EXPECT_NEAR(static_cast<double>(b.body.collision.vertex_count()), static_cast<double>(vertices), 3);
  EXPECT_NEAR(static_cast<double>(b.body.visual.face_count()), static_cast<double>(triangles), 60);
}

/// Seed 7410000391 of the session's storms: at a vertex that the blade ends on to the last bit, the front turned round, came back
/// and turned round, until memory ran out.
TEST(BladeSweep, EndsOnAVertexToTheLastBit) {
  Random random(12);
  for (int i = 0; i < 150; ++i) {
    Bench b(sheet_65_mesh(), i % 2 == 1, 1);
    const CollisionVertex v(static_cast<std::size_t>(random.index(static_cast<int>(b.body.collision.vertex_count()))));
    const Vec3 p = b.position[v.index()], lean{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 1};
    const double angle = random.uniform(0, 2 * std::numbers::pi), far = random.uniform(0.1, 1.5);
    const Vec3 back = far * Vec3{std::cos(angle), std::sin(angle), 0};
    const double up = random.uniform(0.1, 0.9), down = random.uniform(0.1, 0.9);
    const std::size_t triangles = b.body.visual.face_count();
    b.move(p - back + up * lean, p - back - down * lean);
    int steps = b.move(p + up * lean, p - down * lean).steps;
    for (int turn = 1; turn <= 3; ++turn) {  // on the spot, about that vertex
      const Vec3 turned = lean + 0.1 * turn * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), 0};
      steps += b.move(p + up * turned, p - down * turned).steps;
    }
    EXPECT_LT(steps, 60) << i;
    EXPECT_LT(b.body.visual.face_count(), 4 * triangles) << i;
  }
}

TEST(BladeSweep, RandomStrokesOnAMovingSheetKeepEveryInvariant) {
  for (int seed = 0; seed < 12; ++seed) {
    Random random(static_cast<std::uint64_t>(seed) + 100);
    Bench b(sheet_65_mesh(), seed % 2 == 1, 1);
    for (int stroke = 0; stroke < 5; ++stroke) {
      double x = random.uniform(-0.2, 1.2), y = random.uniform(-0.2, 1.2), heading = random.uniform(0, 6.28);
      for (int i = 0; i < 25; ++i) {
        // The body sways between poses.
        const double sway = 0.05 * std::sin(0.7 * i + seed);
        const CollisionMesh& m = b.body.collision;
        for (std::size_t k = 0; k < b.position.size(); ++k) {
          const Vec3 p = m.rest[CollisionVertex(k)];
          b.position[k] = {p.x + sway * p.y, p.y, sway * std::sin(3 * p.x)};
        }
        heading += random.uniform(-0.8, 0.8);
        const double step = random.uniform(0, 0.12);
        x += step * std::cos(heading);
        y += step * std::sin(heading);
        const double lean = random.uniform(-0.3, 0.3);
        b.move({x + lean, y, 1}, {x - lean, y, random.index(8) == 0 ? 0.3 : -1});
      }
      lift_blade(b.stroke);
    }
    EXPECT_EQ(collision_pieces(b.body).count, visual_pieces(b.body).count);
  }
}

// A long edge slices off the top of a dome in one move: its cut is a loop that neither begins nor ends.
TEST(BladeSweep, ASliceOffADomeInOneMove) {
  Random random(7);
  for (int i = 0; i < 60; ++i) {
    Bench b(sheet_65_mesh());
    b.stroke.through = true;
    const Vec3 top{0.5 + random.uniform(-0.1, 0.1), 0.5 + random.uniform(-0.1, 0.1), 0};
    const double radius = random.uniform(0.15, 0.35), z = -radius * radius;
    for (Vec3& p : b.position) p.z = -dot(p - top, p - top);
    b.move({-2, -2, z}, {2, -2, z});
    const SweepReport cut = b.move({-2, 2, z}, {2, 2, z});
    EXPECT_EQ(cut.refused, 0) << i;
    ASSERT_EQ(b.pieces(), 2) << i;
    // Two lips. Flat faces lie below the dome by the square of their circumradius at most, 0.118 m.
    EXPECT_LT(lip_length(b.body), 4 * std::numbers::pi * radius) << i;
    EXPECT_GT(lip_length(b.body), 4 * std::numbers::pi * std::sqrt(radius * radius - 0.118 * 0.118)) << i;
  }
}

TEST(BladeSweep, RefusesEdgesWithoutLengthAndNumbersThatAreNone) {
  EXPECT_TRUE(check_edge({{0, 0, 0}, {0, 0, 1e-9}}).ok());
  EXPECT_FALSE(check_edge({{0, 0, 0}, {0, 0, 0}}).ok());
  EXPECT_FALSE(check_edge({{0, 0, 0}, {0, NAN, 1}}).ok());
}

}  // namespace
}  // namespace kerf::blade_sweep_test
