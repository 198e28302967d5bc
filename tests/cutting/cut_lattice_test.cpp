// Real cuts, followed by lattice, embeddings and skin: each local update against a fresh start.
#include <gtest/gtest.h>

#include <cmath>

#include "cutting/cut_body.h"
#include "cutting/cut_polyline.h"
#include "kerf/base/random.h"
#include "kerf/cutting/topology_change.h"
#include "kerf/cutting/validate.h"
#include "kerf/embedding/embedding_validate.h"
#include "kerf/embedding/skin.h"
#include "kerf/lattice/lattice_adapt.h"
#include "kerf/lattice/lattice_build.h"
#include "kerf/lattice/lattice_validate.h"
#include "lattice/lattice_canonical.h"
#include "support/synthetic_complex.h"

namespace kerf::cut_lattice_test {
namespace {

using namespace testing_support;

std::vector<Vec3> random_path(Random& random) {
  std::vector<Vec3> path;
  const int kind = random.index(4);
  if (kind == 0) {  // across
    const double y0 = random.uniform(), y1 = random.uniform();
    path = {{-0.2, y0, 0}, {1.2, y1, 0}};
  } else if (kind == 1) {  // from the rim into the body
    path = {{random.uniform(), -0.2, 0}, {random.uniform(0.2, 0.8), random.uniform(0.2, 0.8), 0}};
  } else if (kind == 2) {  // a closed loop or an arc
    const double cx = random.uniform(0.3, 0.7), cy = random.uniform(0.3, 0.7), r = random.uniform(0.1, 0.28);
    const double end = random.uniform() < 0.5 ? 6.2831853071795862 : random.uniform(1, 5);
    for (int i = 0; i <= 24; ++i) path.push_back({cx + r * std::cos(end * i / 24), cy + r * std::sin(end * i / 24), 0});
  } else {  // a stab
    const Vec3 p{random.uniform(0.1, 0.9), random.uniform(0.1, 0.9), 0};
    path = {p, p + Vec3{random.uniform(-.3, .3), random.uniform(-.3, .3), 0}};
  }
  return path;
}

struct Everything {
  CellComplex body;
  HexMesh hex;
  Embedding embedding;
  Skin skin;
  CutScratch cut_scratch;
  LatticeScratch lattice_scratch;
  EmbeddingScratch embedding_scratch;
  TopologyChange change;
  LatticeChange lattice_change;
  std::vector<VisualVertex> moved;

  void update(const JournalMark& since) {
    collect_topology_change(body, since, cut_scratch, change);
    adapt_lattice(body.collision, hex, change.triangles, lattice_scratch, lattice_change);
    moved.clear();
    embed_triangles(body, hex, lattice_change.triangles, embedding, embedding_scratch, moved);
    note_moved(skin, moved);
    refresh_skin(body, hex, embedding, skin);
  }
};

Everything make_body(bool closed, double bend_radius, double volume, int cells, int subdivisions) {
  Everything e;
  SyntheticOptions options;
  options.closed = closed;
  options.subdivisions = subdivisions;
  options.bump = closed ? 0.01 : 0;
  TriangleMesh mesh = sheet_65_mesh();
  if (bend_radius > 0) mesh = bent_mesh(std::move(mesh), bend_radius);
  e.body = make_synthetic_complex(mesh, options);
  LatticeOptions lattice;
  lattice.cells = cells;
  lattice.layers = bend_radius > 0 ? 0 : 1;
  const auto frame = choose_lattice(e.body.collision, lattice);
  EXPECT_TRUE(frame.ok());
  e.hex = std::move(build_lattice(e.body.collision, *frame, volume)).value();
  EXPECT_TRUE(embed_all(e.body, e.hex, e.embedding).ok());
  build_skin(e.body, e.hex, e.embedding, e.skin);
  return e;
}

void expect_consistent(Everything& e, double volume, std::uint64_t seed) {
  const Status lattice = validate_lattice(e.body.collision, e.hex);
  ASSERT_TRUE(lattice.ok()) << seed << ": " << lattice.error().message;
  const Status pieces = validate_lattice_pieces(e.body.collision, e.hex);
  EXPECT_TRUE(pieces.ok()) << seed << ": " << pieces.error().message;
  const Status embedded = validate_embedding(e.body, e.hex, e.embedding);
  ASSERT_TRUE(embedded.ok()) << seed << ": " << embedded.error().message;
  const auto fresh = build_lattice(e.body.collision, e.hex.bodies[0].frame, volume);
  ASSERT_TRUE(fresh.ok());
  ASSERT_TRUE(same_lattice(*fresh, e.hex)) << seed;
  Skin skin;
  build_skin(e.body, e.hex, e.embedding, skin);
  Random random(seed);
  std::vector<Vec3> nodes;
  for (const NodeId n : ids<NodeId>(e.hex.node_count()))
    nodes.push_back(e.hex.rest(n) +
                    Vec3{random.uniform(-.01, .01), random.uniform(-.01, .01), random.uniform(-.01, .01)});
  const std::size_t n = e.body.visual.vertex_count();
  std::vector<Vec3f> p(n), q(n), pn(n), qn(n);
  evaluate_skin(e.hex, skin, nodes, p, pn);
  evaluate_skin(e.hex, e.skin, nodes, q, qn);
  EXPECT_TRUE(p == q) << seed;  // the skin kept step by step gives the same bits
  EXPECT_TRUE(pn == qn) << seed;
}

TEST(CutLattice, RandomCutsEqualAFreshStart) {
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    Random random(seed);
    const bool closed = seed % 2 == 0;
    const double bend = seed % 3 == 2 ? 0.5 : 0, volume = seed % 4 == 0 ? 0.1 : 0.097;
    Everything e = make_body(closed, bend, volume, seed % 5 == 4 ? 20 : 81, 2);
    for (int cut = 0; cut < 4; ++cut) {
      JournalMark mark, hex_mark, embedding_mark;
      journal_mark(e.body, mark);
      journal_mark(e.hex, hex_mark);
      journal_mark(e.embedding, embedding_mark);
      std::vector<Vec3> path = random_path(random);
      if (bend > 0)
        for (Vec3& p : path) p = {bend * std::sin(p.x / bend), p.y, bend * (std::cos(p.x / bend) - 1)};
      cut_polyline(e.body, path, {}, e.cut_scratch);
      e.update(mark);
      expect_consistent(e, volume, seed);
      if (::testing::Test::HasFatalFailure()) return;
      if (cut == 1) {  // take it back: everything is as before
        note_rollback(e.skin, e.embedding, {embedding_mark.arrays[0].first, embedding_mark.arrays[0].second});
        journal_rollback(e.body, mark);
        journal_rollback(e.hex, hex_mark);
        journal_rollback(e.embedding, embedding_mark);
        refresh_skin(e.body, e.hex, e.embedding, e.skin);
        expect_consistent(e, volume, seed);
        if (::testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

TEST(CutLattice, UndoAndRedoOfWholeCuts) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Random random(300 + seed);
    Everything e = make_body(seed % 2 == 0, 0, 0.1, 81, 2);
    std::vector<std::array<JournalStep, 3>> steps;
    for (int cut = 0; cut < 3; ++cut) {
      JournalMark marks[3];
      journal_mark(e.body, marks[0]);
      journal_mark(e.hex, marks[1]);
      journal_mark(e.embedding, marks[2]);
      cut_polyline(e.body, random_path(random), {}, e.cut_scratch);
      e.update(marks[0]);
      steps.push_back(
          {journal_take(e.body, marks[0]), journal_take(e.hex, marks[1]), journal_take(e.embedding, marks[2])});
    }
    ASSERT_FALSE(steps.empty());
    for (std::size_t i = steps.size(); i-- > 0;) {
      note_step(e.skin, steps[i][2]);
      journal_undo(e.body, steps[i][0]);
      journal_undo(e.hex, steps[i][1]);
      journal_undo(e.embedding, steps[i][2]);
      refresh_skin(e.body, e.hex, e.embedding, e.skin);
      expect_consistent(e, 0.1, seed);
      if (::testing::Test::HasFatalFailure()) return;
    }
    EXPECT_EQ(e.hex.hex_count(), 81u);
    for (auto& step : steps) {
      note_step(e.skin, step[2]);
      journal_redo(e.body, step[0]);
      journal_redo(e.hex, step[1]);
      journal_redo(e.embedding, step[2]);
      refresh_skin(e.body, e.hex, e.embedding, e.skin);
      expect_consistent(e, 0.1, seed);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(CutLattice, PointsDoNotJumpWhenTheBodyIsCut) {
  // New nodes stand where their parents stand, so a cut moves no point in the frame in which it happens. Only the points of
  // copies that a neighbouring cell absorbs go by that cell's extrapolation from then on: curvature times cell size squared.
  std::size_t points = 0, in_other_cells = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(100 + seed);
    Everything e = make_body(seed % 2 == 0, 0, 0.1, 81, 3);
    std::vector<Vec3> nodes;
    for (const NodeId n : ids<NodeId>(e.hex.node_count())) {
      const Vec3 r = e.hex.rest(n);
      nodes.push_back({r.x, r.y, r.z + 0.2 * r.x * r.x * r.y});
    }
    for (int cut = 0; cut < 3; ++cut) {
      std::vector<Vec3f> before(e.body.visual.vertex_count());
      std::vector<LatticeIndex> cell;
      for (const HexId h : e.embedding.visual.raw()) cell.push_back(e.hex.cell[h]);
      evaluate_skin(e.hex, e.skin, nodes, before, {});
      JournalMark mark;
      journal_mark(e.body, mark);
      cut_polyline(e.body, random_path(random), {}, e.cut_scratch);
      e.update(mark);
      for (std::size_t n = nodes.size(); n < e.hex.node_count(); ++n) {
        const NodeId parent = e.hex.node_parent[NodeId(n)];
        ASSERT_TRUE(parent.valid());
        nodes.push_back(nodes[parent.index()]);
      }
      std::vector<Vec3f> after(e.body.visual.vertex_count());
      evaluate_skin(e.hex, e.skin, nodes, after, {});
      for (std::size_t v = 0; v < before.size(); ++v) {
        const bool same_cell = e.hex.cell[e.embedding.visual[VisualVertex(v)]] == cell[v];
        ++points;
        in_other_cells += same_cell ? 0 : 1;
        ASSERT_LT(norm(to_double(after[v]) - to_double(before[v])), same_cell ? 2e-6 : 0.4 / 81)
            << seed << " vertex " << v;
      }
    }
  }
  EXPECT_LT(in_other_cells, points / 100);
}

}  // namespace
}  // namespace kerf::cut_lattice_test
