#include "kerf/midsurface/midsurface.h"

#include <gtest/gtest.h>

#include "kerf/mesh/models.h"
#include "kerf/mesh/surface_measures.h"

namespace kerf {
namespace {

TEST(Midsurface, Slab) {
  ModelOptions options;
  options.visual_triangles = 3000;
  auto model = make_model("closed-sheet", options);
  ASSERT_TRUE(model.ok());
  const auto mid = make_midsurface(model->visual);
  ASSERT_TRUE(mid.ok()) << mid.error().message;
  EXPECT_EQ(mid->verdict.thinness, Thinness::kThin);
}

}  // namespace
}  // namespace kerf
