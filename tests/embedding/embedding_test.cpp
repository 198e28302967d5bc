#include "kerf/embedding/embedding.h"

#include <gtest/gtest.h>

#include "kerf/base/random.h"
#include "kerf/embedding/embedding_validate.h"
#include "kerf/embedding/skin.h"
#include "kerf/lattice/lattice_build.h"
#include "support/synthetic_complex.h"

namespace kerf::embedding_test {
namespace {

using namespace testing_support;

struct Embedded {
  CellComplex body;
  HexMesh hex;
  Embedding embedding;
};

Embedded embedded_sheet(bool closed, double bump, int cells = 81, int subdivisions = 3) {
  Embedded e;
  SyntheticOptions options;
  options.closed = closed;
  options.bump = bump;
  options.subdivisions = subdivisions;
  e.body = make_synthetic_complex(sheet_65_mesh(), options);
  LatticeOptions lattice;
  lattice.cells = cells;
  const auto frame = choose_lattice(e.body.collision, lattice);
  EXPECT_TRUE(frame.ok());
  auto hex = build_lattice(e.body.collision, *frame, 0.1);
  EXPECT_TRUE(hex.ok());
  e.hex = std::move(hex).value();
  EXPECT_TRUE(embed_all(e.body, e.hex, e.embedding).ok());
  return e;
}

std::vector<Vec3> rest_nodes(const HexMesh& hex) {
  std::vector<Vec3> x;
  for (const NodeId n : ids<NodeId>(hex.node_count())) x.push_back(hex.rest(n));
  return x;
}

TEST(Embedding, EveryVertexReproducesItsRestPosition) {
  for (const bool closed : {false, true})
    for (const double bump : {0.0, 0.03}) {
      const Embedded e = embedded_sheet(closed, bump);
      const Status valid = validate_embedding(e.body, e.hex, e.embedding);
      EXPECT_TRUE(valid.ok()) << valid.error().message;
      const EmbeddingReach reach = embedding_reach(e.body, e.hex, e.embedding);
      if (bump == 0) {
        EXPECT_EQ(reach.outside, 0u);
      } else if (closed) {
        EXPECT_GT(reach.outside, 0u);  // the bumps leave the lattice
        EXPECT_LT(reach.farthest, 0.31);
      }
    }
}

TEST(Embedding, AnAffineMapMovesPointsAndNormalsExactly) {
  Embedded e = embedded_sheet(true, 0.02);
  const Mat3 a{{Vec3{1.2, 0.3, -0.1}, Vec3{-0.2, 0.8, 0.4}, Vec3{0.1, -0.3, 1.5}}};
  const Vec3 shift{3, -2, 1};
  std::vector<Vec3> nodes = rest_nodes(e.hex);
  for (Vec3& x : nodes) x = a * x + shift;
  Skin skin;
  build_skin(e.body, e.hex, e.embedding, skin);
  std::vector<Vec3f> positions(e.body.visual.vertex_count()), normals(positions.size());
  evaluate_skin(e.hex, skin, nodes, positions, normals);
  for (const VisualVertex v : ids<VisualVertex>(positions.size())) {
    const Vec3 expected = a * e.body.visual.rest[v] + shift;
    EXPECT_LT(norm(to_double(positions[v.index()]) - expected), 2e-6);
    const Vec3 n = to_double(e.body.visual.normal[v]);
    const Vec3 turned =
        normalized(n.x * cross(a.c[1], a.c[2]) + n.y * cross(a.c[2], a.c[0]) + n.z * cross(a.c[0], a.c[1]));
    EXPECT_LT(norm(to_double(normals[v.index()]) - turned), 1e-5);
    const EmbeddedPoint p{e.embedding.visual[v], e.hex.local(e.embedding.visual[v], e.body.visual.rest[v])};
    EXPECT_LT(norm(deformed_normal(e.hex, p, n, nodes) - turned), 1e-6);
    const Mat3 f = deformation_gradient(e.hex, p, nodes);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(norm(f.c[i] - a.c[i]), 1e-11);
  }
  std::vector<Vec3> collision(e.body.collision.vertex_count());
  collision_positions(e.hex, e.embedding, nodes, collision);
  for (const CollisionVertex v : ids<CollisionVertex>(collision.size()))
    EXPECT_LT(norm(collision[v.index()] - (a * e.body.collision.rest[v] + shift)), 1e-12);
}

TEST(Embedding, SkinEqualsThePlainFormulaInAnyDeformation) {
  Embedded e = embedded_sheet(true, 0.02);
  Random random(7);
  std::vector<Vec3> nodes = rest_nodes(e.hex);
  for (Vec3& x : nodes) x += Vec3{random.uniform(-.03, .03), random.uniform(-.03, .03), random.uniform(-.03, .03)};
  Skin skin;
  build_skin(e.body, e.hex, e.embedding, skin);
  std::vector<Vec3f> positions(e.body.visual.vertex_count()), normals(positions.size());
  evaluate_skin(e.hex, skin, nodes, positions, normals);
  for (const VisualVertex v : ids<VisualVertex>(positions.size())) {
    const HexId h = e.embedding.visual[v];
    const EmbeddedPoint p{h, e.hex.local(h, e.body.visual.rest[v])};
    EXPECT_LT(norm(to_double(positions[v.index()]) - point_position(e.hex, p, nodes)), 1e-6);
    EXPECT_LT(
        norm(to_double(normals[v.index()]) - deformed_normal(e.hex, p, to_double(e.body.visual.normal[v]), nodes)),
        1e-4);
  }
}

TEST(Embedding, GradientIsTheDerivativeOfThePosition) {
  Embedded e = embedded_sheet(false, 0);
  Random random(8);
  std::vector<Vec3> nodes = rest_nodes(e.hex);
  for (Vec3& x : nodes) x += Vec3{random.uniform(-.03, .03), random.uniform(-.03, .03), random.uniform(-.03, .03)};
  for (int i = 0; i < 50; ++i) {
    const HexId h(random.index(81));
    const Vec3 rest =
        e.hex.rest(e.hex.nodes[h][0]) + Vec3{random.uniform(0, .1), random.uniform(0, .1), random.uniform(0, .1)};
    const Mat3 f = deformation_gradient(e.hex, {h, e.hex.local(h, rest)}, nodes);
    for (int j = 0; j < 3; ++j) {
      Vec3 step;
      step[j] = 1e-6;
      const Vec3 d = point_position(e.hex, {h, e.hex.local(h, rest + step)}, nodes) -
                     point_position(e.hex, {h, e.hex.local(h, rest - step)}, nodes);
      EXPECT_LT(norm((1 / 2e-6) * d - f.c[static_cast<std::size_t>(j)]), 1e-8);
    }
  }
}

TEST(Embedding, ForcesKeepSumMomentAndWork) {
  const Embedded e = embedded_sheet(true, 0.05);
  Random random(2);
  const std::vector<Vec3> nodes = rest_nodes(e.hex);
  for (int i = 0; i < 200; ++i) {
    const VisualVertex v(random.index(static_cast<int>(e.body.visual.vertex_count())));
    const Vec3 rest = e.body.visual.rest[v], force{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const EmbeddedPoint p{e.embedding.visual[v], e.hex.local(e.embedding.visual[v], rest)};
    const NodeForces spread = spread_force(e.hex, p, force);
    Vec3 sum{}, moment{};
    std::vector<Vec3> moved(nodes.size());
    double work = 0;
    for (std::size_t c = 0; c < 8; ++c) {
      sum += spread.force[c];
      moment += cross(e.hex.rest(spread.node[c]), spread.force[c]);
      moved[spread.node[c].index()] = Vec3{random.uniform(), random.uniform(), random.uniform()};
      work += dot(moved[spread.node[c].index()], spread.force[c]);
    }
    EXPECT_LT(norm(sum - force), 1e-13);
    EXPECT_LT(norm(moment - cross(rest, force)), 1e-12);
    EXPECT_NEAR(work, dot(point_position(e.hex, p, moved), force), 1e-12);
  }
}

TEST(Embedding, PointsArePlacedToTheBitsOfThePlainSum) {
  const Embedded e = embedded_sheet(true, 0.02);
  Random random(12);
  std::vector<Vec3> nodes = rest_nodes(e.hex);
  for (Vec3& x : nodes) x += Vec3{random.uniform(-.03, .03), random.uniform(-.03, .03), random.uniform(-.03, .03)};
  std::vector<Vec3> places(e.body.collision.vertex_count());
  collision_positions(e.hex, e.embedding, nodes, places);
  for (const CollisionVertex v : ids<CollisionVertex>(places.size())) {
    const std::array<double, 8> w = trilinear_weights(e.embedding.collision_local[v]);
    Vec3 x{};
    for (std::size_t c = 0; c < 8; ++c) x += w[c] * nodes[e.hex.nodes[e.embedding.collision[v]][c].index()];
    EXPECT_EQ(places[v.index()], x);
    EXPECT_EQ(point_position(e.hex, {e.embedding.collision[v], e.embedding.collision_local[v]}, nodes), x);
  }
}

TEST(Embedding, AVertexThatMovesOftenIsNotedOnce) {
  Embedded e = embedded_sheet(true, 0);
  Skin skin;
  build_skin(e.body, e.hex, e.embedding, skin);
  std::vector<VisualVertex> all;
  for (const VisualVertex v : ids<VisualVertex>(e.body.visual.vertex_count())) all.push_back(v);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 5; ++i) note_moved(skin, all);
    EXPECT_EQ(skin.dirty.size(), all.size());
    refresh_skin(e.body, e.hex, e.embedding, skin);
    EXPECT_TRUE(skin.dirty.empty());
    std::size_t lanes = 0;
    for (const SkinBlock& b : skin.blocks) lanes += static_cast<std::size_t>(b.count);
    EXPECT_EQ(lanes, all.size());
  }
}

TEST(Embedding, NothingIsOwnedTwiceInTheCountOfLanes) {
  Embedded e = embedded_sheet(true, 0);
  Skin skin;
  build_skin(e.body, e.hex, e.embedding, skin);
  std::size_t lanes = 0;
  for (const SkinBlock& b : skin.blocks) lanes += static_cast<std::size_t>(b.count);
  EXPECT_EQ(lanes, e.body.visual.vertex_count());
}

}  // namespace
}  // namespace kerf::embedding_test
