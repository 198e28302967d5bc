// The corpus: the right verdict, the right topology, and a binding whose patches are 2 F discs: all of the thin bodies,
// none of the others.
#include "midsurface/corpus.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <set>

#include "kerf/binding/bind.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/midsurface/midsurface.h"

namespace kerf::corpus_test {
namespace {

const std::vector<corpus::Body>& all_bodies() {
  static const std::vector<corpus::Body> bodies = corpus::bodies();
  return bodies;
}

/// A row of the table in docs/midsurface.md.
void print_row(const corpus::Body& body, const Midsurface& made) {
  const MidsurfaceQuality& q = made.quality;
  const double degrees = 57.29577951308232, h = q.mean_half_thickness;
  std::fprintf(stderr, "| %s | %zu | %zu | %.0f / %.0f | %.3f / %.3f | %.2f / %.2f | %.1f |\n", body.name.c_str(),
               body.mesh.triangles.size(), made.collision.triangles.size(), degrees * q.smallest_angle,
               degrees * q.mean_smallest_angle, q.medial_mean, q.medial_max, q.to_prisms_mean / h, q.to_prisms_max / h,
               made.verdict.width_over_thickness);
}

class MidsurfaceCorpus : public ::testing::TestWithParam<std::size_t> {};

TEST_P(MidsurfaceCorpus, IsRight) {
  const corpus::Body& body = all_bodies()[GetParam()];
  SCOPED_TRACE(body.name);
  TriangleMesh mesh = body.mesh;
  SurfaceRequirements requirements;
  requirements.closedness = Closedness::kClosed;
  const auto checked = check_surface(mesh, requirements);
  ASSERT_TRUE(checked.ok()) << checked.error().message;
  MidsurfaceOptions options;
  options.triangles = body.triangles;
  const auto made = make_midsurface(mesh, options);
  ASSERT_TRUE(made.ok()) << made.error().message;
  const MidsurfaceVerdict& v = made->verdict;
  std::string why;
  for (const std::string& r : v.reasons) why += r + "; ";
  if (!body.thin) {
    EXPECT_EQ(v.thinness, Thinness::kNotThin)
        << "width/thickness " << v.width_over_thickness << ", volume " << v.volume_ratio << ", narrow "
        << v.narrow_share << ", one-sided " << v.one_sided;
    EXPECT_FALSE(v.reasons.empty());
    EXPECT_TRUE(made->collision.triangles.empty());
    return;
  }
  ASSERT_NE(v.thinness, Thinness::kNotThin) << why;
  const SurfaceMeasures m = surface_measures(made->collision);
  EXPECT_EQ(m.euler, body.euler);
  EXPECT_EQ(m.border_loops, static_cast<std::size_t>(body.loops));
  EXPECT_EQ(m.components, 1u);
  EXPECT_EQ(m.non_manifold_edges + m.unoriented_edges, 0u);
  const auto bound = bind(mesh, made->collision, {});
  ASSERT_TRUE(bound.ok()) << bound.error().message;
  const Status valid = validate_binding(bound->complex);
  EXPECT_TRUE(valid.ok()) << (valid.ok() ? "" : valid.error().message);
  std::set<std::int32_t> patches;
  for (const Patch p : bound->complex.visual.patch.raw()) patches.insert(p.value);
  EXPECT_EQ(patches.size(), 2 * made->collision.triangles.size());
  if (std::getenv("KERF_CORPUS_TABLE") != nullptr) print_row(body, *made);
}

std::string test_name(const ::testing::TestParamInfo<std::size_t>& info) {
  std::string out;
  for (const char c : all_bodies()[info.param].name) out += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return out;
}
INSTANTIATE_TEST_SUITE_P(Bodies, MidsurfaceCorpus, ::testing::Range<std::size_t>(0, all_bodies().size()), test_name);

}  // namespace
}  // namespace kerf::corpus_test
