#include "kerf/lattice/lattice_build.h"

#include <gtest/gtest.h>

#include "lattice/lattice_bodies.h"

namespace kerf {
namespace {

TEST(LatticeBuild, PaperSheetHas81HexahedraAnd200Nodes) {
  const CollisionMesh mesh = grid_body(6, 6, 1, 1, 0.1);
  LatticeOptions options;
  options.cells = 81;
  const auto frame = choose_lattice(mesh, options);
  ASSERT_TRUE(frame.ok());
  EXPECT_EQ(frame->count, (LatticeIndex{9, 9, 1}));
  const auto hex = build_lattice(mesh, *frame, 0.1);
  ASSERT_TRUE(hex.ok());
  EXPECT_EQ(count_alive(*hex), 81u);
  EXPECT_EQ(hex->hex_count(), 81u);
  EXPECT_EQ(count_active_nodes(*hex), 200u);
  EXPECT_EQ(hex->node_count(), 200u);
  for (const HexId h : ids<HexId>(hex->hex_count())) {
    EXPECT_TRUE(hex->material[h].full);
    EXPECT_NEAR(hex->material[h].volume, 0.1 / 81, 1e-15);
  }
}

}  // namespace
}  // namespace kerf
