#include "support/synthetic_complex.h"

#include <gtest/gtest.h>

namespace kerf::synthetic_complex_test {
namespace {

using namespace testing_support;

TEST(SyntheticComplex, SheetHasThePapersCounts) {
  const TriangleMesh sheet = sheet_65_mesh();
  EXPECT_EQ(sheet.positions.size(), 65u);
  EXPECT_EQ(sheet.triangles.size(), 104u);
  const std::size_t vertices[] = {881, 3425}, faces[] = {1664, 6656};
  for (int n = 2; n <= 3; ++n) {
    SyntheticOptions options;
    options.subdivisions = n;
    const CellComplex body = make_synthetic_complex(sheet, options);
    EXPECT_EQ(body.visual.vertex_count(), vertices[n - 2]);
    EXPECT_EQ(body.visual.face_count(), faces[n - 2]);
  }
}

TEST(SyntheticComplex, ClosedBodyIsClosed) {
  SyntheticOptions options;
  options.closed = true;
  for (const TriangleMesh& mesh : {sheet_65_mesh(), disc_mesh(1, 8, 3), annulus_mesh(0.4, 1, 10, 2)}) {
    const CellComplex body = make_synthetic_complex(mesh, options);
    for (const VisualHalfEdge t : body.visual.twin.raw()) ASSERT_TRUE(t.valid());
    const auto chi = [](const auto& m) {
      std::size_t borders = 0;
      for (const auto t : m.twin.raw()) borders += t.valid() ? 0 : 1;
      return static_cast<long>(m.vertex_count()) - static_cast<long>((m.half_edge_count() + borders) / 2) +
             static_cast<long>(m.face_count());
    };
    EXPECT_EQ(chi(body.visual), 2 * chi(body.collision));
  }
}

}  // namespace
}  // namespace kerf::synthetic_complex_test
