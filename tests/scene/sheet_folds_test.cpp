#include "kerf/scene/sheet_folds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kerf/scene/scene_body.h"

namespace kerf::sheet_folds_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kSide = 40;  // squares of 1 mm

/// A square of 4 x 4 cm. Collision meshes of 160 and 1500 triangles have edges of 4.8 and 1.6 mm.
TriangleMesh cloth() {
  TriangleMesh sheet;
  for (int i = 0; i <= kSide; ++i)
    for (int j = 0; j <= kSide; ++j) sheet.positions.push_back({0.001 * i, 0.001 * j, 0});
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j) {
      const int a = i * (kSide + 1) + j;
      sheet.triangles.push_back({VertexId(a), VertexId(a + kSide + 1), VertexId(a + kSide + 2)});
      sheet.triangles.push_back({VertexId(a), VertexId(a + kSide + 2), VertexId(a + 1)});
    }
  return sheet;
}
Vec3& at(TriangleMesh& sheet, int i, int j) { return sheet.positions[VertexId(i * (kSide + 1) + j)]; }

/// A ridge along y, so steep that the sheet lies back on itself at its edge.
void raise(TriangleMesh& sheet, int i, int from, int to) {
  for (int j = from; j <= to; ++j) at(sheet, i, j).z = 0.003;
}

TEST(SheetFolds, OneOfASheetThatIsItsOwnCollisionMeshIsNone) {
  TriangleMesh sheet = cloth();
  EXPECT_TRUE(check_sheet_folds(sheet, 0));
  raise(sheet, 20, 20, 22);
  EXPECT_THAT(check_sheet_folds(sheet, 0).error().message,
              AllOf(HasSubstr("folded back on itself, by 14"), HasSubstr("at (0.02, 0.02")));
}

TEST(SheetFolds, AreMeasuredByTheMeshThatIsMade) {
  TriangleMesh sheet = cloth();
  raise(sheet, 20, 16, 24);
  EXPECT_TRUE(check_sheet_folds(sheet, 160));
  EXPECT_FALSE(check_sheet_folds(sheet, 1500));
}

/// Many short folds in a small spot are no long fold.
TEST(SheetFolds, OfANoisySpotAreAsLongAsTheSpotIsWide) {
  TriangleMesh sheet = cloth();
  raise(sheet, 18, 16, 20);  // with what follows 12 mm, in a square of 4 mm
  raise(sheet, 22, 16, 20);
  for (int i = 18; i <= 22; ++i) at(sheet, i, 20).z = 0.003;
  EXPECT_FALSE(check_sheet_folds(sheet, 0));
  EXPECT_TRUE(check_sheet_folds(sheet, 160));
}

/// A sliver that is turned over in a corner has nothing to do with what does not bind elsewhere.
TEST(SheetFolds, ElsewhereAreNotAtFault) {
  TriangleMesh sheet = cloth();
  at(sheet, 30, 30).x -= 0.0015;
  ASSERT_FALSE(check_sheet_folds(sheet, 0));
  EXPECT_TRUE(check_sheet_folds_near(sheet, 1500, {0.005, 0.005, 0}));
  EXPECT_THAT(check_sheet_folds_near(sheet, 1500, {0.0285, 0.0285, 0}).error().message,
              AllOf(HasSubstr("by 180 degrees"), HasSubstr("at (0.029")));
}

Result<SceneBodyLoaded> bound(const TriangleMesh& sheet, int triangles) {
  SceneBody body;
  body.visual = "cloth";
  body.thickness = 0.0005;
  body.collision_triangles = triangles;
  return load_scene_body(body, {}, nullptr, {sheet, std::nullopt});
}

TEST(SheetFolds, AreRoundedOffByAMeshThatIsAskedFor) {
  TriangleMesh sheet = cloth();
  raise(sheet, 20, 16, 24);
  const auto body = bound(sheet, 160);
  ASSERT_TRUE(body.ok()) << body.error().message;
}

/// Short folds are found after one mesh was made: a trench in a bump.
TEST(SheetFolds, AtFaultAreNamedWithTheirPlace) {
  TriangleMesh sheet = cloth();
  for (int i = 15; i <= 25; ++i)
    for (int j = 15; j <= 25; ++j)
      if (j != 20 || i < 19 || i > 21) at(sheet, i, j).z = 0.01;
  ASSERT_TRUE(check_sheet_folds(sheet, 1500));
  const auto body = bound(sheet, 0);
  ASSERT_FALSE(body.ok());
  EXPECT_THAT(body.error().message,
              AllOf(HasSubstr("cloth: the sheet is folded back on itself, by 16"),
                    HasSubstr("0.02, 0), at 2 of its edges"), HasSubstr("134 degrees are the most")));
}

}  // namespace
}  // namespace kerf::sheet_folds_test
