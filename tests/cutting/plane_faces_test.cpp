#include "support/plane_faces.h"

#include <gtest/gtest.h>

#include <vector>

namespace kerf::plane_faces_test {
namespace {

using testing_support::PlaneFaces;
using Segments = std::vector<std::array<Vec2, 2>>;

TEST(PlaneFaces, CountsWhatSegmentsEnclose) {
  Segments lines;
  for (int i = 0; i < 4; ++i) {
    const double at = 0.1 + 0.3 * i;
    lines.push_back({{{at, -1}, {at, 2}}});
    lines.push_back({{{-1, at}, {2, at}}});
  }
  EXPECT_EQ(PlaneFaces(lines).count(), 10u);
  lines.push_back({{{0.2, 0.2}, {0.25, 0.25}}});  // encloses nothing
  EXPECT_EQ(PlaneFaces(lines).count(), 10u);
}

TEST(PlaneFaces, AStrandOfABillionthIsAStrand) {
  Segments open{{{{0, 0}, {1, 0}}}, {{{1, 0}, {1, 1}}}, {{{1, 1}, {0, 1}}}, {{{0, 1}, {0, 1e-9}}}};
  const PlaneFaces one(open);
  EXPECT_EQ(one.face_of({0.5, 0.5}), one.face_of({-1, 0.5}));
  open.back()[1].y = 0;
  const PlaneFaces two(open);
  EXPECT_NE(two.face_of({0.5, 0.5}), two.face_of({-1, 0.5}));
  EXPECT_EQ(two.face_of({0.5, 0.5}), two.face_of({0.9, 0.1}));
  EXPECT_EQ(two.face_of({0.5, 0}), nullptr);
}

}  // namespace
}  // namespace kerf::plane_faces_test
