#include "kerf/cutting/piece_labels.h"
#include "cutting/cut_polyline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/topology_change.h"
#include "support/synthetic_complex.h"

namespace kerf::piece_labels_test {
namespace {

using namespace testing_support;

TEST(PieceLabels, CountWhatGoingOverTheWholeMeshCounts) {
  int most = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SyntheticOptions options;
    options.subdivisions = 1;
    CellComplex body = make_synthetic_complex(sheet_65_mesh(), options);
    CutScratch scratch;
    Random random(seed);
    PieceLabels labels;
    EXPECT_EQ(labels.count(body.collision, {}), 1);
    std::vector<CollisionTriangle> changed;
    for (int i = 0; i < 60; ++i) {
      JournalMark mark;
      journal_mark(body, mark);
      const double angle = random.uniform(0, 2 * std::numbers::pi),
                   length = random.uniform(0.05, i % 10 == 9 ? 2 : 0.5);
      const Vec3 middle{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0},
          half{0.5 * length * std::cos(angle), 0.5 * length * std::sin(angle), 0};
      const Vec3 path[] = {middle - half, middle + half};
      cut_polyline(body, path, {}, scratch);
      for (const CollisionTriangle f : changed_triangles(body, mark)) changed.push_back(f);
      // Numbers of triangles come and go between two counts.
      if (random.next() % 5 == 0) journal_rollback(body, mark);
      if (random.next() % 3 == 0) continue;  // several cuts at once
      ASSERT_EQ(labels.count(body.collision, changed), collision_pieces(body).count) << "seed " << seed << " cut " << i;
      changed.clear();
    }
    most = std::max(most, collision_pieces(body).count);
  }
  EXPECT_GT(most, 8);
}

}  // namespace
}  // namespace kerf::piece_labels_test
