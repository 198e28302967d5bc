// Punches: what is inside the outline comes loose, whatever it overlaps, and every invariant holds.
// KERF_FUZZ_SECONDS=n in the environment runs longer, KERF_FUZZ_SEED=s starts from another seed.
#include "kerf/cutting/punch.h"

#include <chrono>
#include <cstdlib>
#include <numbers>

#include "cutting/punch_body.h"
#include "kerf/base/random.h"
#include "kerf/cutting/roughen.h"
#include "kerf/cutting/wall_points.h"

namespace kerf::punch_test {
namespace {

using namespace testing_support;

double polygon_area(const std::vector<Vec2>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += 0.5 * cross(p[i], p[(i + 1) % p.size()]);
  return std::fabs(sum);
}

bool inside_polygon(const std::vector<Vec2>& outline, Vec2 p, double& distance) {
  bool inside = false;
  distance = HUGE_VAL;
  for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Vec2 a = outline[i], b = outline[j], d = b - a;
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) inside = !inside;
    const double s = std::clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0);
    distance = std::min(distance, norm(p - (a + s * d)));
  }
  return inside;
}

/// Do two outlines, or two sides of a corner of more than 30 degrees, come within `reach` of a point? Cuts so near to each other are rounded.
bool two_cuts_meet(const std::vector<std::vector<Vec2>>& outlines, Vec2 x, double reach) {
  const std::vector<Vec2>* first = nullptr;
  Vec2 way;
  for (const std::vector<Vec2>& outline : outlines)
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vec2 a = outline[i], b = outline[(i + 1) % outline.size()], side = b - a;
      const double t = std::clamp(dot(x - a, side) / dot(side, side), 0.0, 1.0);
      if (norm(x - lerp(a, b, t)) >= reach) continue;
      if (first && (first != &outline || dot(way, side) < 0.866 * norm(way) * norm(side))) return true;
      first = &outline;
      way = side;
    }
  return false;
}

/// Brute force: the pieces that hold the points of a grid; points on both sides of an outline, both well away from it,
/// must be in different pieces. Returns a pair that is not, as text.
std::string still_hanging(const CellComplex& body, const std::vector<Vec2>& outline, double margin, int n = 60) {
  const CollisionMesh& mesh = body.collision;
  const Pieces pieces = collision_pieces(body);
  std::vector<std::int8_t> where(static_cast<std::size_t>(pieces.count),
                                 0);  // bit 0: holds points inside, bit 1: outside
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    Vec2 p[3];
    Vec2 low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 3; ++i) {
      const Vec3 x = mesh.rest[mesh.origin[CollisionMesh::corner(CollisionTriangle(f), i)]];
      p[i] = {x.x, x.y};
      low = {std::min(low.x, x.x), std::min(low.y, x.y)};
      high = {std::max(high.x, x.x), std::max(high.y, x.y)};
    }
    for (int i = static_cast<int>(std::ceil(low.x * n)); i <= high.x * n; ++i)
      for (int j = static_cast<int>(std::ceil(low.y * n)); j <= high.y * n; ++j) {
        const Vec2 q{i / static_cast<double>(n), j / static_cast<double>(n)};
        if (cross(p[1] - p[0], q - p[0]) < 0 || cross(p[2] - p[1], q - p[1]) < 0 || cross(p[0] - p[2], q - p[2]) < 0)
          continue;
        double distance = 0;
        const bool inside = inside_polygon(outline, q, distance);
        if (distance < margin) continue;
        auto& mask = where[static_cast<std::size_t>(pieces.of_face[f])];
        mask = static_cast<std::int8_t>(mask | (inside ? 1 : 2));
        if (mask == 3)
          return "piece " + std::to_string(pieces.of_face[f]) + " near " + std::to_string(q.x) + ", " +
                 std::to_string(q.y);
      }
  }
  return {};
}

TEST(Punch, InsideLeavesARoundHole) {
  for (const bool closed : {false, true}) {
    PunchBody b(CutBody::sheet(3, closed));
    const Punch p = circle({0.43, 0.52}, 0.17);
    const auto cut = b.punch(p);
    ASSERT_TRUE(cut) << b.last_error;
    EXPECT_EQ(b.pieces(), 2);
    EXPECT_NEAR(b.area(cut->loose), polygon_area(p.outline), 0.02 * polygon_area(p.outline));
    EXPECT_EQ(still_hanging(b.body, placed(p), 0.01), "");
    EXPECT_FALSE(cut->lips.empty());
    for (const CollisionHalfEdge h : cut->lips) EXPECT_TRUE(b.body.collision.is_border(h));
  }
}

TEST(Punch, OverTheRimTakesABite) {
  PunchBody b(CutBody::sheet(3, true));
  const Punch p = circle({1.02, 0.5}, 0.2);
  const auto cut = b.punch(p);
  ASSERT_TRUE(cut) << b.last_error;
  EXPECT_EQ(b.pieces(), 2);
  // The part of the disc with x < 1.
  const double h = 0.02, r = 0.2, expected = r * r * std::acos(h / r) - h * std::sqrt(r * r - h * h);
  EXPECT_NEAR(b.area(cut->loose), expected, 0.05 * expected);  // a polygon in the disc, corners that snap
}

TEST(Punch, OverAllFourRims) {
  PunchBody b(CutBody::sheet(3, true));
  const Punch p = circle({0.5, 0.5}, 0.55);  // the corners of the square stick out
  const auto cut = b.punch(p);
  ASSERT_TRUE(cut) << b.last_error;
  EXPECT_EQ(b.pieces(), 5);
}

TEST(Punch, AsLargeAsTheBodyOrBesideItCutsNothing) {
  PunchBody b(CutBody::sheet(3, true));
  for (const Punch& p : {circle({0.5, 0.5}, 2, 0.05), circle({3, 0.5}, 0.3)}) {
    const auto cut = b.punch(p);
    ASSERT_TRUE(cut) << b.last_error;
    EXPECT_EQ(cut->opened_edges, 0);
    EXPECT_TRUE(cut->loose.empty());
    EXPECT_EQ(b.pieces(), 1);
  }
}

TEST(Punch, TinyOrBadOutlinesAreRefusedAndChangeNothing) {
  PunchBody b(CutBody::sheet(3, true));
  const std::size_t vertices = b.body.visual.vertex_count();
  const auto refused = [&](Punch p, const char* why) {
    EXPECT_FALSE(b.punch(p));
    EXPECT_NE(b.last_error.find(why), std::string::npos) << b.last_error;
    EXPECT_EQ(b.body.visual.vertex_count(), vertices);
  };
  refused(circle({0.5, 0.5}, 1e-4), "too small");
  refused(circle({0.5, 0.5}, 1e-300), "radius 0 m");
  Punch p = circle({0.5, 0.5}, 0.2);
  for (const double reach :
       {1e-300, 1e-18}) {  // the square of one is 0; the other is lost beside the height of the centre
    p.centre.z = 0.5;
    p.reach = reach;
    refused(p, "too short");
  }
  p = circle({0.5, 0.5}, 0.2);
  p.axis = {};
  refused(p, "axis");
  p = circle({0.5, 0.5}, 0.2);
  p.across = {0, 0, 2};
  refused(p, "across");
  p = circle({0.5, 0.5}, 0.2);
  p.centre.x = std::nan("");
  refused(p, "finite");
  p.centre.x = 0.5;
  p.outline = {{0, 0}, {0.2, 0.2}, {0.2, 0}, {0, 0.2}};
  refused(p, "touches itself");
  p.outline = {{0, 0}, {0.2, 0.2}};
  refused(p, "2 points");
  p.outline = {{0, 0}, {0, 0}, {0.2, 0.2}};
  refused(p, "the same");
  p.outline = {{0, 0}, {0.2, std::nan("")}, {0.2, 0.2}};
  refused(p, "not finite");
}

TEST(Punch, TheLeastRadiusWorks) {
  PunchBody b(CutBody::sheet(3, true));
  const double least = 3 * b.options.minimum_feature * b.body.mean_root_edge;
  int loose = 0;
  Random random(5);
  for (int i = 0; i < 40; ++i)
    if (const auto cut =
            b.punch(circle({random.uniform(0.1, 0.9), random.uniform(0.1, 0.9)}, 1.15 * least, 0.1 * least)))
      loose += cut->loose.empty() ? 0 : 1;
  EXPECT_EQ(loose, 40) << b.last_error;
}

TEST(Punch, OverAHoleOverAnEarlierBiteOnItsEdgeAndAgain) {
  TriangleMesh mesh = annulus_mesh(0.15, 0.5, 12, 3);
  for (Vec3& p : mesh.positions) p += Vec3{0.5, 0.5, 0};
  SyntheticOptions o;
  o.closed = true;
  o.subdivisions = 2;
  PunchBody b{mesh, o};
  const Punch over_hole = circle({0.5, 0.5}, 0.3), on_edge = circle({0.5, 0.36}, 0.1), bite = circle({0.8, 0.5}, 0.15);
  for (const Punch& p : {over_hole, on_edge, bite, bite, over_hole}) {
    const auto cut = b.punch(p);
    ASSERT_TRUE(cut) << b.last_error;
    EXPECT_EQ(still_hanging(b.body, placed(p), 0.02), "");
  }
}

TEST(Punch, OnABentBodyInAnyDirection) {
  // The outline is a circle in the plane of the deformed body; the cut at rest is its image.
  PunchBody b(CutBody::sheet(3, true));
  const double stretch = 1.3;
  const auto bend = [&](Vec3 p) {
    const double a = 0.8 * (p.x - 0.5);
    return Vec3{std::sin(a) / 0.8, stretch * p.y, 0.3 + (1 - std::cos(a)) / 0.8 + p.z};
  };
  b.position.clear();
  for (const Vec3 p : b.body.collision.rest.raw()) b.position.push_back(bend(p));
  Punch p = circle({0, 0}, 0.2);
  p.centre = bend({0.5, 0.5, 0});
  p.axis = {0, 0, -3};
  auto cut = cut_punch(b.body, b.position, p, b.options, b.scratch);
  ASSERT_TRUE(cut) << cut.error().message;
  b.expect_valid();
  EXPECT_EQ(b.pieces(), 2);
  EXPECT_NEAR(b.area(cut->loose), polygon_area(p.outline) / stretch, 0.03 * polygon_area(p.outline));
}

TEST(Punch, ReachLeavesOtherLayersAlone) {
  PunchBody b(CutBody::sheet(3, true));
  Punch p = circle({0.5, 0.5}, 0.2);
  p.centre.z = 0.5;
  p.reach = 0.4;
  const auto cut = b.punch(p);
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->opened_edges, 0);
  p.reach = 0.6;
  const auto deeper = b.punch(p);
  ASSERT_TRUE(deeper);
  EXPECT_EQ(b.pieces(), 2);
}

TEST(Punch, AWallDeeperThanTheReachStaysAttached) {
  // A sheet on edge, a metre high; the outline meets it along two upright lines.
  for (const bool through : {false, true}) {
    PunchBody b(CutBody::sheet(3, true));
    b.position.clear();
    for (const Vec3 p : b.body.collision.rest.raw()) b.position.push_back({p.x, 0.013, p.y});
    Punch p = circle({0.5, 0}, 0.2);
    p.centre.z = 0.5;
    p.reach = through ? 0.6 : 0.3;
    const auto cut = cut_punch(b.body, b.position, p, b.options, b.scratch);
    ASSERT_TRUE(cut) << cut.error().message;
    b.expect_valid();
    EXPECT_GT(cut->opened_edges, 0);
    EXPECT_EQ(b.pieces(), through ? 3 : 1);
    EXPECT_NEAR(b.area(cut->loose), through ? 0.4 : 0, 0.02);
  }
}

TEST(Roughness, IsSeededInMetresWatertightAndLeavesTheVolume) {
  PunchBody one(CutBody::sheet(3, true));
  one.options.layers = 4;
  PunchBody two = one;
  const Punch p = circle({0.45, 0.55}, 0.22, 0.003);
  const double amplitude = 0.01;
  for (PunchBody* b : {&one, &two}) {
    const auto cut = b->punch(p);
    ASSERT_TRUE(cut);
    EXPECT_LT(wall_roughness(b->body, walls_of(b->body, cut->lips)), 1e-15);
    roughen_punch(b->body, *cut, amplitude, b == &one ? 7 : 8);
    b->expect_valid();  // volume and all
    EXPECT_EQ(crossing_pairs(b->body), 0);
    const double rms = wall_roughness(b->body, walls_of(b->body, cut->lips));
    EXPECT_LT(rms, amplitude);
    EXPECT_GT(rms, 0.35 * amplitude);  // uniform in [0, a]: 0.577 a
  }
  EXPECT_FALSE(one.body.visual.rest.raw() == two.body.visual.rest.raw());
}

class PunchFuzz : public ::testing::TestWithParam<int> {};

TEST_P(PunchFuzz, EveryPunchLoosensWhatItHoldsAndEveryInvariantHolds) {
  const int kind = GetParam();
  const char* seconds = std::getenv("KERF_FUZZ_SECONDS");
  const char* first_seed = std::getenv("KERF_FUZZ_SEED");
  const std::uint64_t base = first_seed ? std::strtoull(first_seed, nullptr, 10) : 1;
  const auto begin = std::chrono::steady_clock::now();
  const auto spent = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  int punches = 0, retries = 0, refused = 0, loose = 0, crossed = 0;
  for (std::uint64_t seed = base; seconds ? spent() < std::atof(seconds) : seed < base + 3; ++seed) {
    SyntheticOptions o;
    o.closed = kind % 2 == 1;
    o.subdivisions = o.closed ? 2 : 3;
    o.jitter = 0.2;
    o.bump = 0.004;
    o.seed = seed;
    TriangleMesh mesh = sheet_65_mesh();
    if (kind / 2 % 2 == 1) {
      mesh = annulus_mesh(0.15, 0.5, 12, 3);
      for (Vec3& p : mesh.positions) p += Vec3{0.5, 0.5, 0};
    }
    PunchBody b{mesh, o};
    b.options.layers = 1 + static_cast<int>(seed % 4);
    Random random(1000 * static_cast<std::uint64_t>(kind) + seed);
    const double tolerance = b.options.path_tolerance * b.body.mean_root_edge;
    Punch last = circle({0.5, 0.5}, 0.1, tolerance);
    std::vector<std::vector<Vec2>> outlines;
    for (int i = 0; i < 30; ++i) {
      Punch p = circle({random.uniform(-0.1, 1.1), random.uniform(-0.1, 1.1)}, random.uniform(0.02, 0.3), tolerance);
      switch (random.index(6)) {
        case 0: p.outline = d_outline(random.uniform(0.03, 0.3), tolerance); break;
        case 1: {  // a star
          const int n = 5 + random.index(8);
          const double r = random.uniform(0.05, 0.3);
          p.outline.clear();
          for (int k = 0; k < n; ++k) {
            const double a = 2 * std::numbers::pi * k / n, q = r * random.uniform(0.5, 1);
            p.outline.push_back({q * std::cos(a), q * std::sin(a)});
          }
          break;
        }
        case 2: {  // beside an earlier one, again or moved a little
          const double r = random.index(2) ? std::pow(10, random.uniform(-12, -1)) : 0;
          p = last;
          p.centre += r * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), 0};
          break;
        }
        case 3: {  // around a vertex
          const CollisionMesh& m = b.body.collision;
          p.centre =
              m.rest[CollisionVertex(static_cast<std::int32_t>(random.index(static_cast<int>(m.vertex_count()))))];
          break;
        }
        default: break;
      }
      if (random.index(3) == 0) p.axis = {0, 0, -1};
      if (random.index(3) == 0) p.across = {random.uniform(-1, 1), random.uniform(0.1, 1), 0};
      const int refused_before = b.refused;
      const auto cut = b.punch(p, false);
      ++punches;
      if (b.refused > refused_before) {
        if (b.last_error.find("too small") == std::string::npos) {
          ++refused;
          ADD_FAILURE() << "kind " << kind << " seed " << seed << " punch " << i << ": " << b.last_error;
        }
        continue;
      }
      retries += cut->retries > 0 ? 1 : 0;
      loose += cut->loose.empty() ? 0 : 1;
      if (i % 2 == 0) roughen_punch(b.body, *cut, std::pow(10, random.uniform(-4, -1)), seed);
      const Status status = validate_complex(b.body, b.start);
      ASSERT_TRUE(status.ok()) << "kind " << kind << " seed " << seed << " punch " << i << ": "
                               << status.error().message;
      const double margin =
          1.5 * (4 * b.options.minimum_feature + 2 * b.options.path_tolerance) * b.body.mean_root_edge;
      const std::string hanging = still_hanging(b.body, placed(p), margin);
      ASSERT_EQ(hanging, "") << "kind " << kind << " seed " << seed << " punch " << i;
      outlines.push_back(placed(p));
      if (kind == 1 && i == 7) {  // an annulus is soon in parts, each of them loose
        const double reach = (2 * b.options.minimum_feature + b.options.path_tolerance) * b.body.mean_root_edge;
        for (const Vec3 x : crossing_places(b.body)) crossed += !two_cuts_meet(outlines, {x.x, x.y}, reach);
      }
      last = p;
    }
  }
  RecordProperty("punches", punches);
  printf("kind %d: %d punches, %d with something loose, %d retried, %d refused\n", kind, punches, loose, retries,
         refused);
  EXPECT_GT(loose, punches / 2);
  EXPECT_LE(crossed, 2);  // beside where cuts meet: about one in two bodies that are punched so often
}

INSTANTIATE_TEST_SUITE_P(Bodies, PunchFuzz, ::testing::Values(0, 1, 2, 3));

}  // namespace
}  // namespace kerf::punch_test
