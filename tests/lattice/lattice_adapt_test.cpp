#include "kerf/lattice/lattice_adapt.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/hash.h"
#include "kerf/lattice/lattice_build.h"
#include "kerf/lattice/lattice_validate.h"
#include "lattice/lattice_bodies.h"
#include "lattice/lattice_canonical.h"

namespace kerf::lattice_adapt_test {
namespace {

/// A rotated, curved, jittered strip in a lattice that does not know about it.
struct RandomBody {
  CollisionMesh mesh;
  LatticeFrame frame;
};
RandomBody random_body(Random& random) {
  const double ax = random.uniform(0, 6.28), ay = random.uniform(0, 6.28), curve = random.uniform(0, 0.15);
  const double jitter = random.uniform(0, 0.25);
  auto place = [&](Vec3 p) {
    p.x += jitter * random.uniform(-1, 1);
    p.y += jitter * random.uniform(-1, 1);
    p.z += curve * (p.x - 3) * (p.x - 3) + 0.2 * jitter * random.uniform(-1, 1);
    const Vec3 q{std::cos(ax) * p.x - std::sin(ax) * p.z, p.y, std::sin(ax) * p.x + std::cos(ax) * p.z};
    return Vec3{q.x, std::cos(ay) * q.y - std::sin(ay) * q.z, std::sin(ay) * q.y + std::cos(ay) * q.z};
  };
  RandomBody body;
  body.mesh = grid_body(8, 5, 8, 5, random.uniform(0.3, 1.2), place);
  Box3 box;
  for (const CollisionVertex v : ids<CollisionVertex>(body.mesh.vertex_count())) {
    box.add(body.mesh.rest[v] - body.mesh.offset[v]);
    box.add(body.mesh.rest[v] + body.mesh.offset[v]);
  }
  const double h = random.uniform(0.7, 2);
  body.frame.origin = box.min - Vec3{h * random.uniform(), h * random.uniform(), h * random.uniform()};
  body.frame.cell = {h, h * random.uniform(0.6, 1.4), h * random.uniform(0.6, 1.4)};
  for (int i = 0; i < 3; ++i)
    body.frame.count[static_cast<std::size_t>(i)] =
        1 + static_cast<int>((box.max[i] - body.frame.origin[i]) / body.frame.cell[i]);
  return body;
}

TEST(LatticeAdapt, RandomBodiesWithRandomWalkCutsEqualAFreshLatticeAndHaveThePiecesOfTheCollisionMesh) {
  int several = 0, absorbed = 0, copies = 0;
  for (std::uint64_t seed = 0; seed < 80; ++seed) {
    Random random(seed);
    RandomBody body = random_body(random);
    auto built = build_lattice(body.mesh, body.frame, 0);
    ASSERT_TRUE(built.ok()) << built.error().message;
    HexMesh hex = std::move(built).value();
    ASSERT_TRUE(validate_lattice(body.mesh, hex).ok())
        << seed << ": " << validate_lattice(body.mesh, hex).error().message;
    LatticeScratch scratch;
    LatticeChange change;
    for (int cut = 0; cut < 4; ++cut) {
      std::vector<CollisionTriangle> changed;
      random_walk_cut(body.mesh, random, 1 + random.index(9), changed);
      adapt_lattice(body.mesh, hex, changed, scratch, change);
      const Status valid = validate_lattice(body.mesh, hex);
      ASSERT_TRUE(valid.ok()) << seed << ": " << valid.error().message;
      const Status pieces = validate_lattice_pieces(body.mesh, hex);
      EXPECT_TRUE(pieces.ok()) << seed << " cut " << cut << ": " << pieces.error().message;
      auto fresh = build_lattice(body.mesh, body.frame, 0);
      ASSERT_TRUE(fresh.ok());
      ASSERT_TRUE(same_lattice(*fresh, hex)) << seed << " cut " << cut;
    }
    several += count_collision_pieces(body.mesh) > 1 ? 1 : 0;
    copies += static_cast<int>(hex.hex_count());
    absorbed += static_cast<int>(hex.hex_count() - count_alive(hex));
  }
  EXPECT_GT(several, 10);  // the cuts do separate
  EXPECT_GT(absorbed, copies / 20);
}

// Each list and link of the lattice, made wrong once in a lattice that is right: it is told, and no loop is followed for ever.
TEST(LatticeValidate, TellsEveryListThatIsWrong) {
  Random random(1003);
  RandomBody body = random_body(random);
  HexMesh right = std::move(build_lattice(body.mesh, body.frame, 1.5)).value();
  LatticeScratch scratch;
  LatticeChange change;
  for (int cut = 0; cut < 5; ++cut) {
    std::vector<CollisionTriangle> changed;
    random_walk_cut(body.mesh, random, 6, changed);
    adapt_lattice(body.mesh, right, changed, scratch, change);
  }
  ASSERT_TRUE(validate_lattice(body.mesh, right).ok());
  const auto told = [&](const char* what, auto&& spoil) {
    HexMesh wrong = right;
    ASSERT_TRUE(spoil(wrong)) << what << ": the body has none";
    EXPECT_FALSE(validate_lattice(body.mesh, wrong).ok()) << what;
  };
  told("a cell's copies loop", [](HexMesh& hex) {
    hex.next_in_cell.set(HexId(0), HexId(0));
    return true;
  });
  const auto spoil_tip = [](HexMesh& hex, auto&& change_tip) {
    for (const TipId t : ids<TipId>(hex.tips.size())) {
      TipCell tip = hex.tips[t];
      if (!tip.active) continue;
      change_tip(t, tip);
      hex.tips.set(t, tip);
      return true;
    }
    return false;
  };
  told("a vertex's tips loop",
       [&](HexMesh& hex) { return spoil_tip(hex, [](TipId t, TipCell& tip) { tip.next_of_vertex = t; }); });
  told("a cell's tips loop",
       [&](HexMesh& hex) { return spoil_tip(hex, [](TipId t, TipCell& tip) { tip.next_in_cell = t; }); });
  told("a tip is another vertex's", [&](HexMesh& hex) {
    return spoil_tip(hex, [](TipId, TipCell& tip) { tip.vertex = CollisionVertex(tip.vertex.value == 0 ? 1 : 0); });
  });
  told("a tip is in no list",
       [&](HexMesh& hex) { return spoil_tip(hex, [&](TipId, TipCell& tip) { hex.first_tip.set(tip.cell, {}); }); });
  told("a tip is nowhere",
       [&](HexMesh& hex) { return spoil_tip(hex, [](TipId, TipCell& tip) { tip.point.x = std::nan(""); }); });
  told("guests loop", [](HexMesh& hex) {
    for (const HexId h : ids<HexId>(hex.hex_count()))
      if (const HexId g = hex.first_guest[h]; g.valid()) {
        hex.next_guest.set(g, g);
        return true;
      }
    return false;
  });
  told("absorbers loop", [](HexMesh& hex) {
    for (const HexId h : ids<HexId>(hex.hex_count()))
      if (hex.absorber[h].valid()) {
        hex.absorber.set(h, h);
        return true;
      }
    return false;
  });
  told("a link ends nowhere", [](HexMesh& hex) {
    for (const LatticeRun& run : hex.links.raw())
      if (run.count > 0) {
        hex.link_pool.set(LatticePoolIndex(run.first), HexLink{HexId(0), HexId{}});
        return true;
      }
    return false;
  });
  told("a prism is nowhere", [](HexMesh& hex) {
    PrismCorners corners = hex.prism_corner[CollisionVertex(0)];
    corners.plus.y = std::nan("");
    hex.prism_corner.set(CollisionVertex(0), corners);
    return true;
  });
}

TEST(LatticeAdapt, CutsThatSplitTrianglesEqualAFreshLattice) {
  std::size_t split = 0, made = 0, pieces_lost = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(1000 + seed);
    RandomBody body = random_body(random);
    auto built = build_lattice(body.mesh, body.frame, 1.5);
    ASSERT_TRUE(built.ok()) << built.error().message;
    HexMesh hex = std::move(built).value();
    LatticeScratch scratch;
    LatticeChange change;
    for (int cut = 0; cut < 5; ++cut) {
      std::vector<CollisionTriangle> changed;
      if (cut % 2 == 0) random_splitting_cut(body.mesh, random, 1 + random.index(7), changed);
      else random_walk_cut(body.mesh, random, 1 + random.index(9), changed);
      adapt_lattice(body.mesh, hex, changed, scratch, change);
      const Status valid = validate_lattice(body.mesh, hex);
      ASSERT_TRUE(valid.ok()) << seed << ": " << valid.error().message;
      const Status pieces = validate_lattice_pieces(body.mesh, hex);
      EXPECT_TRUE(pieces.ok()) << seed << " cut " << cut << ": " << pieces.error().message;
      auto fresh = build_lattice(body.mesh, body.frame, 1.5);
      ASSERT_TRUE(fresh.ok());
      ASSERT_TRUE(same_lattice(*fresh, hex)) << seed << " cut " << cut;
      made += change.new_copies.size();
      pieces_lost += change.dead_copies.size();
      for (const CollisionTriangle t : ids<CollisionTriangle>(body.mesh.face_count()))
        for (const Piece& p : hex.pieces_of(t)) split += p.side != 0 ? 1 : 0;
      for (const HexId h : change.new_copies) {
        ASSERT_TRUE(hex.parent[h].valid()) << seed;
        ASSERT_EQ(hex.cell[hex.parent[h]], hex.cell[h]);
      }
      for (const NodeId n : change.new_nodes) {
        ASSERT_TRUE(hex.node_parent[n].valid()) << seed;
        ASSERT_EQ(hex.corner[hex.node_parent[n]], hex.corner[n]);
      }
    }
  }
  EXPECT_GT(split, 100u);  // tips inside cells did split prisms
  EXPECT_GT(made, 100u);
  EXPECT_LT(pieces_lost, made);
}

/// Cells of these triangles' pieces and of those around.
std::vector<std::uint8_t> cells_around(const HexMesh& hex, const std::vector<CollisionTriangle>& triangles,
                                       std::vector<std::uint8_t> near) {
  for (const CollisionTriangle t : triangles) {
    if (t.index() >= hex.pieces.size()) continue;
    for (const Piece& p : hex.pieces_of(t)) {
      const LatticeIndex c = hex.index_of(p.cell);
      for (int k = 0; k < 27; ++k) {
        const LatticeIndex d{c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1};
        if (hex.contains(d)) near[hex.cell_id(d).index()] = 1;
      }
    }
  }
  return near;
}

// Each tip's prism was made whole in all its cells, which touched them and the prisms of other tips there, and so on.
TEST(LatticeAdapt, AmongManyTipsACutTouchesTheCellsAroundIt) {
  Random random(21);
  CollisionMesh mesh = grid_body(16, 16, 32, 32, 0.9);
  LatticeFrame frame;
  frame.origin = {-0.3, -0.4, -0.5};
  frame.cell = {1.1, 1.1, 1.1};
  frame.count = {30, 30, 1};
  auto built = build_lattice(mesh, frame, 1.5);
  ASSERT_TRUE(built.ok()) << built.error().message;
  HexMesh hex = std::move(built).value();
  LatticeScratch scratch;
  LatticeChange change;
  std::size_t cut_in_two = 0, touched = 0;
  for (int cut = 0; cut < 120; ++cut) {
    std::vector<CollisionTriangle> changed;
    random_splitting_cut(mesh, random, 2, changed);
    std::vector<std::uint8_t> near = cells_around(hex, changed, std::vector<std::uint8_t>(900));
    adapt_lattice(mesh, hex, changed, scratch, change);
    near = cells_around(hex, changed, std::move(near));
    for (const auto* copies : {&change.new_copies, &change.dead_copies, &change.changed_copies})
      for (const HexId h : *copies) {
        ++touched;
        EXPECT_TRUE(near[hex.cell_id(hex.cell[h]).index()]) << "cut " << cut << ", copy " << h.value;
      }
    for (const CollisionTriangle t : change.triangles) {
      bool beside = false;
      for (const Piece& p : hex.pieces_of(t)) beside = beside || near[p.cell.index()] != 0;
      EXPECT_TRUE(beside) << "cut " << cut << ", triangle " << t.value;
    }
  }
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count()))
    for (const Piece& p : hex.pieces_of(t)) cut_in_two += p.side != 0 ? 1 : 0;
  EXPECT_GT(cut_in_two, 100u);
  EXPECT_GT(touched, 500u);
  const Status valid = validate_lattice(mesh, hex);
  EXPECT_TRUE(valid.ok()) << valid.error().message;
  const auto fresh = build_lattice(mesh, frame, 1.5);
  ASSERT_TRUE(fresh.ok());
  EXPECT_TRUE(same_lattice(*fresh, hex));
}

TEST(LatticeAdapt, RollsBackAndUndoesToTheBit) {
  Random random(5);
  RandomBody body = random_body(random);
  HexMesh hex = std::move(build_lattice(body.mesh, body.frame, 0)).value();
  auto hash = [](HexMesh& m) {
    Hash h;
    m.for_each_array([&](const auto& a) {
      h.add(a.size());
      h.add_bytes(a.raw().data(), 0);
    });
    for (const auto& nodes : m.nodes.raw())
      for (const NodeId n : nodes) h.add(n);
    for (const auto& m2 : m.material.raw()) h.add(m2.fill), h.add(m2.mass_volume);
    for (const auto& w : m.weights.raw()) h.add(w);
    for (const auto& s : m.state.raw()) h.add(s);
    for (const auto& s : m.host.raw()) h.add(s);
    for (const auto& p : m.piece_pool.raw()) h.add(p.copy), h.add(p.volume);
    return h.value();
  };
  const std::uint64_t before = hash(hex);
  JournalMark mesh_mark, hex_mark;
  journal_mark(body.mesh, mesh_mark);
  journal_mark(hex, hex_mark);
  LatticeScratch scratch;
  LatticeChange change;
  auto cut = [&] {
    Random r(17);
    std::vector<CollisionTriangle> changed;
    random_splitting_cut(body.mesh, r, 6, changed);
    adapt_lattice(body.mesh, hex, changed, scratch, change);
  };
  cut();
  const std::uint64_t after = hash(hex);
  EXPECT_NE(after, before);
  journal_rollback(hex, hex_mark);
  journal_rollback(body.mesh, mesh_mark);
  EXPECT_EQ(hash(hex), before);
  cut();
  EXPECT_EQ(hash(hex), after);
  JournalStep step = journal_take(hex, hex_mark);
  journal_undo(hex, step);
  EXPECT_EQ(hash(hex), before);
  journal_redo(hex, step);
  EXPECT_EQ(hash(hex), after);
}

}  // namespace
}  // namespace kerf::lattice_adapt_test
