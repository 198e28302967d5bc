// Shaving: walls get smoother and never rougher, edges move back, volume falls by what was taken off, nothing turns over.
// KERF_FUZZ_SECONDS=n in the environment runs longer, KERF_FUZZ_SEED=s starts from another seed.
#include "kerf/cutting/shave.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <numbers>

#include "cutting/punch_body.h"
#include "kerf/base/hash.h"
#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/roughen.h"
#include "kerf/cutting/slide_vertex.h"

namespace kerf::shave_test {
namespace {

using namespace testing_support;

std::uint64_t bits_of(CellComplex& body) {
  Hash hash;
  hash.add(body.visual.rest.raw());
  hash.add(body.visual.planar.raw());
  hash.add(body.visual.texture.raw());
  hash.add(body.visual.normal.raw());
  hash.add(body.collision.rest.raw());
  hash.add(body.collision.offset.raw());
  hash.add(body.collision.planar.raw());
  hash.add(body.collision.origin.raw());
  hash.add(body.collision.twin.raw());
  return hash.value();
}

struct ShaveBody : PunchBody {
  using PunchBody::PunchBody;
  explicit ShaveBody(PunchBody b) : PunchBody(std::move(b)) {}
  ShavePass pass;
  /// One pass at rest; what the body should measure follows what the pass says it took.
  void shave_at(Vec3 at, double radius, const ShaveOptions& o) {
    position = body.collision.rest.raw();
    shave(body, position, {at, at, radius}, o, options, scratch, pass);
    ASSERT_EQ(position.size(), body.collision.vertex_count());
    start.volume -= pass.removed;
    start.skin_area += pass.skin_area;
    start.collision_area += pass.collision_area;
  }
  [[nodiscard]] std::vector<WallId> all_walls(const std::vector<CollisionHalfEdge>& lips) const {
    return walls_of(body, lips);
  }
};

ShaveBody rough_hole(double radius, double amplitude, int layers, std::vector<CollisionHalfEdge>& lips) {
  ShaveBody b(PunchBody(CutBody::sheet(3, true)));
  b.options.layers = layers;
  const auto cut = b.punch(circle({0.5, 0.5}, radius, 0.003));
  EXPECT_TRUE(cut);
  roughen_punch(b.body, *cut, amplitude, 3);
  lips = cut->lips;
  return b;
}

TEST(Shave, RoughnessFallsMonotonicallyToNothing) {
  std::vector<CollisionHalfEdge> lips;
  ShaveBody b = rough_hole(0.2, 0.012, 4, lips);
  const double before = wall_roughness(b.body, b.all_walls(lips));
  ASSERT_GT(before, 0.003);
  double last = before, volume = b.start.volume;
  ShaveOptions o;
  for (int pass = 0; pass < 120; ++pass) {
    const double a = 2 * std::numbers::pi * pass / 24;
    b.shave_at({0.5 + 0.2 * std::cos(a), 0.5 + 0.2 * std::sin(a), 0}, 0.04, o);
    EXPECT_GT(b.pass.edges, 0);
    EXPECT_LE(b.pass.roughness_after, b.pass.roughness_before);
    EXPECT_GE(b.pass.removed, -1e-15 * volume);
    b.expect_valid();
    const double now = wall_roughness(b.body, b.all_walls(lips));
    EXPECT_LT(now, last) << pass;
    EXPECT_LE(b.start.volume, volume * (1 + 1e-15));
    last = now;
    volume = b.start.volume;
    if (pass % 40 == 0) {
      EXPECT_EQ(crossing_pairs(b.body), 0);
    }
  }
  EXPECT_LT(last, 0.03 * before);
}

TEST(Shave, OnlyWhereItTouches) {
  std::vector<CollisionHalfEdge> lips;
  ShaveBody b = rough_hole(0.2, 0.012, 4, lips);
  const std::vector<Vec3> before = b.body.visual.rest.raw();
  ShaveOptions o;
  const double radius = 0.04;
  b.shave_at({0.7, 0.5, 0}, radius, o);
  ASSERT_FALSE(b.pass.vertices.empty());
  for (std::size_t v = 0; v < before.size(); ++v)
    if (!(before[v] == b.body.visual.rest[VisualVertex(v)])) {
      EXPECT_LT(norm(before[v] - Vec3{0.7, 0.5, 0}), radius + 0.06 + 0.03);  // half thickness, bump
    }
  b.shave_at({0.5, 0.5, 0}, 0.05, o);  // in the hole, touching nothing
  EXPECT_EQ(b.pass.edges, 0);
  EXPECT_TRUE(b.pass.vertices.empty());
}

// A pass that may move few vertices leaves the others to the next ones, which begin there: all have their turn.
TEST(Shave, WhatAPassLeavesComesFirstInTheNext) {
  std::vector<CollisionHalfEdge> lips;
  ShaveBody b = rough_hole(0.2, 0, 2, lips);
  ShaveOptions o;
  o.depth = 1e-4;
  ShaveBody whole = rough_hole(0.2, 0, 2, lips);
  whole.shave_at({0.5, 0.5, 0}, 0.25, o);
  o.moves = 1;
  EXPECT_FALSE(whole.pass.left.valid());
  const std::vector<CollisionVertex> all = whole.pass.collision_vertices;
  ASSERT_GT(all.size(), 4u);
  std::vector<CollisionVertex> moved;
  for (std::size_t pass = 0; pass < all.size(); ++pass) {
    b.shave_at({0.5, 0.5, 0}, 0.25, o);
    ASSERT_LT(b.pass.collision_vertices.size(), all.size());
    EXPECT_TRUE(b.pass.left.valid());
    moved.insert(moved.end(), b.pass.collision_vertices.begin(), b.pass.collision_vertices.end());
    o.until = o.first;
    o.first = b.pass.left;
  }
  b.expect_valid();
  for (const CollisionVertex v : all) EXPECT_NE(std::find(moved.begin(), moved.end(), v), moved.end()) << v.value;
}

TEST(Shave, EdgesMoveBackAndTheVolumeFallsByTheirArea) {
  // A flat slab: what goes is the area that the collision mesh loses, times the thickness.
  std::vector<CollisionHalfEdge> lips;
  ShaveBody b = rough_hole(0.2, 0, 2, lips);
  ShaveOptions o;
  o.depth = 0.002;
  double removed = 0, area = 0, volume = b.start.volume;
  int moved = 0;
  for (int pass = 0; pass < 150; ++pass) {
    const double a = 2 * std::numbers::pi * pass / 37;
    b.shave_at({0.5 + 0.2 * std::cos(a), 0.5 + 0.2 * std::sin(a), 0}, 0.05, o);
    b.expect_valid();
    EXPECT_LT(measure_complex(b.body).volume, volume * (1 + 1e-12));
    volume = measure_complex(b.body).volume;
    removed += b.pass.removed;
    area -= b.pass.collision_area;
    moved += b.pass.moved_back;
  }
  EXPECT_GT(moved, 300);
  EXPECT_GT(area, 0.005);
  const double thickness = 2 * norm(b.body.collision.offset[CollisionVertex(0)]);
  EXPECT_NEAR(removed, area * thickness, 0.02 * removed);
  EXPECT_EQ(crossing_pairs(b.body), 0);
}

/// Far past the edges of root triangles: a hole grows to twice its radius, and its rim is the circle that the shaver went along.
TEST(Shave, AHoleGrowsToTheCircleThatTheShaverWentAlong) {
  SyntheticOptions synthetic;
  synthetic.closed = true;
  synthetic.subdivisions = 2;
  ShaveBody b(PunchBody(CutBody(sheet_65_mesh(), synthetic)));
  const auto cut = b.punch(circle({0.5, 0.5}, 0.15, 0.01));
  ASSERT_TRUE(cut);
  ShaveOptions o;
  o.depth = 0.004;
  const double half = norm(b.body.collision.offset[CollisionVertex(0)]), radius = 0.06;
  double volume = b.start.volume;
  const int around = 24, turns = 36;
  double reach = 0;
  for (int pass = 0; pass < around * turns; ++pass) {
    const int turn = pass / around;
    const double a = 2 * std::numbers::pi * (pass % around + 0.5 * (turn % 2)) / around;
    reach = 0.15 + 0.15 * std::min(1.0, (turn + 1) / (turns - 8.0));
    const double centre = reach - radius - half;  // the window is wider than the shaver by the half thickness
    b.shave_at({0.5 + centre * std::cos(a), 0.5 + centre * std::sin(a), 0}, radius, o);
    const Status valid = pass % 4 == 0 ? validate_complex(b.body, b.start) : Status{};
    ASSERT_TRUE(valid.ok()) << "pass " << pass << ": " << valid.error().message;
    EXPECT_LE(b.start.volume, volume * (1 + 1e-12));
    volume = b.start.volume;
  }
  // The border is a circle, without thorns, a little inside the one that the shaver reaches: it takes less and less towards its end.
  const CollisionMesh& m = b.body.collision;
  const Pieces pieces = collision_pieces(b.body);
  const std::int32_t punched = piece_of_triangle(pieces, cut->loose.front());
  int vertices = 0;
  double least = 1, most = 0;
  for (const WallId w : ids<WallId>(b.body.wall_edge.size())) {
    const CollisionHalfEdge h = b.body.wall_edge[w];
    if (pieces.of_face[CollisionMesh::face(h).index()] == punched) continue;
    const double r = norm(m.rest[m.from(h)] - Vec3{0.5, 0.5, 0});
    least = std::min(least, r);
    most = std::max(most, r);
    ++vertices;
  }
  printf("%d vertices of the border between %.4f and %.4f of %.4f\n", vertices, least, most, reach);
  EXPECT_GT(vertices, 12);
  EXPECT_GT(least, 0.88 * reach);
  EXPECT_LT(most, reach);
  EXPECT_LT(most, 1.06 * least);
  EXPECT_EQ(crossing_pairs(b.body), 0);
}

TEST(Shave, RollsBackToTheBit) {
  std::vector<CollisionHalfEdge> lips;
  ShaveBody b = rough_hole(0.2, 0.004, 3, lips);
  const std::uint64_t bits = bits_of(b.body);
  JournalMark mark;
  journal_mark(b.body, mark);
  ShaveOptions o;
  o.depth = 0.003;
  for (int pass = 0; pass < 40; ++pass) b.shave_at({0.7, 0.5 + 0.01 * (pass % 5), 0}, 0.05, o);
  EXPECT_NE(bits_of(b.body), bits);
  journal_rollback(b.body, mark);
  EXPECT_EQ(bits_of(b.body), bits);
}

TEST(Shave, FuzzWithPunches) {
  const char* seconds = std::getenv("KERF_FUZZ_SECONDS");
  const char* first_seed = std::getenv("KERF_FUZZ_SEED");
  const std::uint64_t base = first_seed ? std::strtoull(first_seed, nullptr, 10) : 1;
  const auto begin = std::chrono::steady_clock::now();
  const auto spent = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  int passes = 0, moved = 0, stuck = 0, punches = 0;
  for (std::uint64_t seed = base; seconds ? spent() < std::atof(seconds) : seed < base + 4; ++seed) {
    SyntheticOptions o;
    o.closed = true;
    o.subdivisions = 2;
    o.jitter = 0.2;
    o.bump = 0.004;
    o.seed = seed;
    ShaveBody b(PunchBody(sheet_65_mesh(), o));
    b.options.layers = 1 + static_cast<int>(seed % 4);
    Random random(seed);
    for (int i = 0; i < 12; ++i) {
      const double tolerance = b.options.path_tolerance * b.body.mean_root_edge;
      const auto cut = b.punch(
          circle({random.uniform(-0.1, 1.1), random.uniform(-0.1, 1.1)}, random.uniform(0.06, 0.25), tolerance), false);
      if (!cut) continue;
      ++punches;
      roughen_punch(b.body, *cut, random.uniform(0, 0.02), seed);
      ShaveOptions options;
      options.depth = random.index(3) ? random.uniform(0, 0.01) : 0;
      options.smoothing = random.uniform(0, 1);
      for (int k = 0; k < 12 && !cut->lips.empty(); ++k) {
        const CollisionHalfEdge h =
            cut->lips[static_cast<std::size_t>(random.index(static_cast<int>(cut->lips.size())))];
        const CollisionMesh& m = b.body.collision;
        b.shave_at(lerp(m.rest[m.from(h)], m.rest[m.to(h)], random.uniform()), random.uniform(0.005, 0.1), options);
        ++passes;
        moved += b.pass.moved_back;
        stuck += b.pass.stuck;
        EXPECT_LE(b.pass.roughness_after, b.pass.roughness_before * (1 + 1e-9) + 1e-12);
      }
      const Status valid = validate_complex(b.body, b.start);
      ASSERT_TRUE(valid.ok()) << "seed " << seed << " punch " << i << ": " << valid.error().message;
    }
  }
  printf("%d punches, %d passes, %d vertices moved back, %d stuck\n", punches, passes, moved, stuck);
  EXPECT_GT(moved, 100);
}

}  // namespace
}  // namespace kerf::shave_test
