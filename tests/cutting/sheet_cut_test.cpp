#include "cutting/cut_body.h"

namespace kerf::sheet_cut_test {
namespace {

using namespace testing_support;

TEST(SheetCut, UncutBodiesAreValid) {
  for (const TriangleMesh& mesh :
       {sheet_65_mesh(), disc_mesh(1, 8, 3), annulus_mesh(0.4, 1, 10, 2), bent_mesh(sheet_65_mesh(), 0.5)})
    for (const bool closed : {false, true}) {
      SyntheticOptions o;
      o.closed = closed;
      o.jitter = 0.2;
      o.bump = 0.005;
      CutBody b(mesh, o);
      b.expect_valid();
    }
}

TEST(SheetCut, AStraightCutAcrossMakesTwoPiecesOfExactArea) {
  CutBody b = CutBody::sheet();
  b.cut({{-0.1, 0.43, 0}, {1.1, 0.43, 0}});
  EXPECT_EQ(b.refused, 0);
  EXPECT_EQ(b.pieces(), 2);
  auto area = b.piece_areas();
  ASSERT_EQ(area.size(), 2u);
  std::sort(area.begin(), area.end());
  EXPECT_NEAR(area[0], 0.43, 1e-3);
  EXPECT_NEAR(area[1], 0.57, 1e-3);
}

TEST(SheetCut, AStabStaysOnePiece) {
  CutBody b = CutBody::sheet();
  b.cut({{0.31, 0.43, 0}, {0.37, 0.47, 0}});
  EXPECT_EQ(b.refused, 0);
  EXPECT_EQ(b.pieces(), 1);
  b.cut({{0.31, 0.63, 0}, {0.77, 0.47, 0}});
  EXPECT_EQ(b.refused, 0);
  EXPECT_EQ(b.pieces(), 1);
}

TEST(SheetCut, AClosedLoopLeavesAnIsland) {
  CutBody b = CutBody::sheet();
  b.cut(circle_points({0.52, 0.47, 0}, 0.3, 60));
  EXPECT_EQ(b.refused, 0);
  EXPECT_EQ(b.pieces(), 2);
}

}  // namespace
}  // namespace kerf::sheet_cut_test
