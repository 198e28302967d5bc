// Walls stand where the blade was, on flat, curved, bent and stretched bodies. KERF_FUZZ_SECONDS=n in the environment: n times as many sets, KERF_FUZZ_SEED=s
// from another seed.
#include <array>
#include <cmath>
#include <cstdlib>

#include "kerf/cutting/crossings.h"
#include "kerf/cutting/swept_deviation.h"

#include "cutting/swept_surface.h"

namespace kerf::swept_walls_test {
namespace {

using namespace testing_support;

constexpr Pose kPulledApart{[](Vec3 p) {
                              return Vec3{1.5 * p.x, 0.8 * p.y, 0.8 * p.z};
                            },
                            [](Vec3 p) {
                              return Vec3{p.x / 1.5, p.y / 0.8, p.z / 0.8};
                            },
                            0};
constexpr Pose kSheared{[](Vec3 p) {
                          return Vec3{p.x + 0.4 * p.y, p.y, p.z};
                        },
                        [](Vec3 p) {
                          return Vec3{p.x - 0.4 * p.y, p.y, p.z};
                        },
                        0};
constexpr Pose kSagging{[](Vec3 p) {
                          return Vec3{p.x, p.y, p.z - 0.3 * p.x * p.x};
                        },
                        [](Vec3 p) {
                          return Vec3{p.x, p.y, p.z + 0.3 * p.x * p.x};
                        },
                        0};
constexpr Pose kWavy{
    [](Vec3 p) {
      return Vec3{p.x + 0.03 * std::sin(7 * p.y), p.y, p.z + 0.05 * std::sin(9 * p.x) * std::cos(8 * p.y)};
    },
    [](Vec3 p) {
      const double x = p.x - 0.03 * std::sin(7 * p.y);
      return Vec3{x, p.y, p.z - 0.05 * std::sin(9 * x) * std::cos(8 * p.y)};
    },
    0.02};

/// Edges by which walls may lie farther off in a body that is not flat: they stand square on a mid-surface that slopes, and go on at a slant to skin that
/// bulges out beyond its rim. The worst of 400 sets in the steak is 0.03, of 60 in the meniscus 0.033.
constexpr double kSlope = 0.04;

/// Of the body's diagonal: by so much triangles may pass through each other. Rounding alone makes 1e-15.
constexpr double kThrough = 1e-6;

void expect_walls_where_the_blade_was(std::string_view model, const Pose& pose, double lean, int sets,
                                      std::uint64_t seed) {
  StrokeBody b(model, model == "closed-sheet" ? 2500 : 0);
  const double edge = b.body.mean_root_edge, thickness = b.start.size.z;
  b.deform = pose.forward;
  b.tilt = lean * b.reach;
  b.make_whole();
  const TriangleSoup skin = skin_of(b.body);
  const Vec3 size = b.box.size(), middle = b.box.center();
  // Walls stand upright on the mid-surface, however the blade leans. Paths are rounded by a minimum feature, and straight to within their tolerance.
  const double drawn = b.options.path_tolerance + b.options.minimum_feature + (model == "closed-sheet" ? 0 : kSlope);
  const double most = (drawn + pose.slack) * edge + 0.5 * lean * thickness;
  const char *more = std::getenv("KERF_FUZZ_SECONDS"), *first = std::getenv("KERF_FUZZ_SEED");
  Random random(first ? std::strtoull(first, nullptr, 10) : seed);
  for (int i = 0; i < (more ? sets * std::atoi(more) : sets); ++i) {
    std::vector<Stroke> strokes(1 + static_cast<std::size_t>(random.index(2)));
    for (Stroke& s : strokes)
      for (int k = 2 + random.index(3); k > 0; --k) {
        const Vec3 p =
            pose.forward(middle + Vec3{random.uniform(-0.65, 0.65) * size.x, random.uniform(-0.65, 0.65) * size.y, 0});
        s.push_back({p.x, p.y});
      }
    constexpr int kPoses[] = {1, 4, 40};
    const int poses = kPoses[random.index(3)];
    b.make_whole();
    std::vector<std::vector<BladeEdge>> edges;
    for (const Stroke& s : strokes) {
      b.cut(s, poses);
      edges.push_back(edges_of(b, s, poses));
    }
    ASSERT_EQ(b.refused, 0) << text_of(strokes);
    const TriangleSoup swept = swept_at_rest(edges, pose, 0.25 * edge), walls = walls_of(b.body);
    const FarthestPlace stray = stray_of(walls, swept, 0.15 * edge),
                        missed = missed_of(swept, walls, skin, 0.15 * edge);
    EXPECT_LT(stray.distance / edge, most / edge) << "a wall at " << stray.at.x << " " << stray.at.y << " "
                                                  << stray.at.z << ", " << poses << " poses:" << text_of(strokes);
    const SelfIntersections through = crossings_of(b.body);
    EXPECT_LT(through.deepest, kThrough * b.box.diagonal())
        << through.deepest / edge << " edges, " << poses << " poses:" << text_of(strokes);
    EXPECT_LT(missed.distance / edge, most / edge) << "nothing at " << missed.at.x << " " << missed.at.y << " "
                                                   << missed.at.z << ", " << poses << " poses:" << text_of(strokes);
  }
}

// The yardstick itself: walls beside their place, a part of the sweep that was not cut, and a blade that left nothing.
TEST(SweptWalls, AreMeasured) {
  StrokeBody b("closed-sheet", 2500);
  const TriangleSoup skin = skin_of(b.body);
  const double edge = b.body.mean_root_edge, step = 0.1 * edge;
  const auto swept = [&](Vec2 from, Vec2 to) {
    const std::vector<std::vector<BladeEdge>> edges{edges_of(b, {from, to}, 1)};
    return swept_at_rest(edges, kAsItIs, step);
  };
  const auto missed = [&](const TriangleSoup& soup) { return missed_of(soup, walls_of(b.body), skin, step).distance; };
  const auto stray = [&](const TriangleSoup& soup) { return stray_of(walls_of(b.body), soup, step).distance; };
  const TriangleSoup across = swept({-0.6, 0.1}, {0.6, 0.1}), beside = swept({-0.6, 0.14}, {0.6, 0.14});
  EXPECT_GT(missed(across), 0.04);  // half the sheet's thickness from the skin
  EXPECT_EQ(stray(across), 0);
  b.cut({{-0.6, 0.1}, {0.6, 0.1}}, 4);
  EXPECT_LT(std::max(stray(across), missed(across)), 0.03 * edge);
  EXPECT_NEAR(stray(beside), 0.04, 0.03 * edge);
  EXPECT_NEAR(missed(beside), 0.04, 0.03 * edge);
  EXPECT_GT(stray(swept({-0.6, 0.1}, {0, 0.1})), 0.49);
  EXPECT_GT(missed(swept({-0.6, 0.1}, {0.6, 0.3})), 0.04);
}
TEST(SweptWalls, OfASheet) { expect_walls_where_the_blade_was("closed-sheet", kAsItIs, 0, 10, 1); }
TEST(SweptWalls, OfASheetWithALeaningBlade) { expect_walls_where_the_blade_was("closed-sheet", kAsItIs, 0.3, 10, 2); }
// How far beside a leaning blade the lips will lie is reported, as far as what it swept lies from the walls at the skin.
TEST(SweptWalls, OfALeaningBladeLieBesideItByWhatIsReported) {
  for (const char* model : {"closed-sheet", "steak"}) {
    StrokeBody b(model, model == std::string_view("closed-sheet") ? 2500 : 0);
    const TriangleSoup skin = skin_of(b.body);
    const double edge = b.body.mean_root_edge, step = 0.05 * edge, y = 0.3 * b.box.size().y;
    const auto cut = [&](double lean, Vec2 from, Vec2 to) {
      b.make_whole();
      b.tilt = lean * b.reach;
      b.cut({from, to}, 10);
      const std::vector<std::vector<BladeEdge>> edges{edges_of(b, {from, to}, 10)};
      return missed_of(swept_at_rest(edges, kAsItIs, step), walls_of(b.body), skin, step).distance;
    };
    const Vec2 middle{b.box.center().x, b.box.center().y};
    for (const double lean : {0.1, 0.4, 0.8}) {
      const double missed = cut(lean, middle - Vec2{0, y}, middle + Vec2{0, y});
      // What is as far from the skin as from the upright wall: half (1 - s) = half s lean, of the thickness, at a share s of the height.
      EXPECT_NEAR(b.leaning.distance / (1 + lean), missed, 0.02 * edge) << model << ", a lean of " << lean;
      EXPECT_GT(b.leaning.distance, 0.4 * lean * b.start.size.z) << model << ", a lean of " << lean;
      EXPECT_LT(norm(Vec2{b.leaning.at.x - middle.x, 0}), 2 * edge);
      (void)cut(lean, middle - Vec2{y, 0}, middle + Vec2{y, 0});
      EXPECT_LT(b.leaning.distance, 1e-9) << model << ": a blade that leans along its way sweeps an upright plane";
    }
  }
}
TEST(SweptWalls, OfASteak) { expect_walls_where_the_blade_was("steak", kAsItIs, 0, 10, 3); }
TEST(SweptWalls, OfAMeniscus) { expect_walls_where_the_blade_was("meniscus", kAsItIs, 0, 10, 4); }
TEST(SweptWalls, OfASheetThatIsPulledApart) {
  expect_walls_where_the_blade_was("closed-sheet", kPulledApart, 0, 10, 5);
}
TEST(SweptWalls, OfASheetThatIsSheared) { expect_walls_where_the_blade_was("closed-sheet", kSheared, 0, 10, 6); }
TEST(SweptWalls, OfASheetThatSags) { expect_walls_where_the_blade_was("closed-sheet", kSagging, 0, 10, 7); }
TEST(SweptWalls, OfAWavySheet) { expect_walls_where_the_blade_was("closed-sheet", kWavy, 0, 10, 8); }

}  // namespace
}  // namespace kerf::swept_walls_test
