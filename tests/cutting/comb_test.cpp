// A comb's teeth hang on its back, however near its cuts are to each other. Cuts nearer than two minimum features are rounded onto each other, and one such
// comb in fifty still loses a tooth where rounding makes its cuts cross. KERF_FUZZ_SECONDS=n in the environment: n times as many combs, KERF_FUZZ_SEED=s
// from another seed.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "cutting/stroke_body.h"

namespace kerf::comb_test {
namespace {

using namespace testing_support;

/// Cuts side by side, `pitch` mean edges apart, in from outside and up to a line across the body's middle.
std::vector<Stroke> comb(const StrokeBody& b, double pitch, double angle, int teeth) {
  const Vec3 size = b.box.size(), centre = b.box.center();
  const Vec2 middle{centre.x, centre.y}, along{std::cos(angle), std::sin(angle)}, across{-along.y, along.x};
  const double reach = 0.6 * std::hypot(size.x, size.y), step = pitch * b.body.mean_root_edge;
  std::vector<Stroke> strokes;
  for (int i = 0; i < teeth; ++i) {
    const Vec2 end = middle + (i - 0.5 * teeth) * step * across;
    strokes.push_back({end - reach * along, end + 0.11 * reach * along});
  }
  return strokes;
}

int severed_by(StrokeBody& b, double pitch, double angle, int teeth, int poses) {
  b.make_whole();
  for (const Stroke& s : comb(b, pitch, angle, teeth)) b.cut(s, poses);
  EXPECT_LE(b.refused, 1) << "pitch " << pitch << " edges, angle " << angle << ", " << poses << " poses";
  const Status valid = validate_complex(b.body, b.start);
  EXPECT_TRUE(valid.ok()) << valid.error().message;
  return b.pieces() - 1;
}

TEST(Comb, OfEveryPitch) {
  for (const char* model : {"closed-sheet", "steak"}) {
    StrokeBody b(model, std::string_view(model) == "closed-sheet" ? 2500 : 0);
    for (const double pitch : {0.02, 0.03, 0.04, 0.05, 0.08})
      EXPECT_EQ(severed_by(b, pitch, 0, 12, 8), 0) << model << ", pitch " << pitch << " edges";
  }
}

TEST(Comb, AtRandom) {
  const char *more = std::getenv("KERF_FUZZ_SECONDS"), *first = std::getenv("KERF_FUZZ_SEED");
  Random random(first ? std::strtoull(first, nullptr, 10) : 1);
  StrokeBody b("closed-sheet", 2500);
  constexpr int kPoses[] = {1, 8, 40};
  const int combs = 40 * (more ? std::atoi(more) : 1);
  int severed = 0;
  for (int i = 0; i < combs; ++i)
    severed +=
        severed_by(b, std::pow(10, random.uniform(-1.7, -1)), random.uniform(0, 6.28), 12, kPoses[random.index(3)]) > 0;
  std::printf("%d combs, %d with a tooth severed\n", combs, severed);
  EXPECT_LE(severed, combs / 20);
}

}  // namespace
}  // namespace kerf::comb_test
