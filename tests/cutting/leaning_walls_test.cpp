// Walls of a blade that leans: at rest, in a plate, a steak, a bent sheet and a meniscus.
#include <cmath>
#include <numbers>

#include "kerf/cutting/crossings.h"

#include "cutting/swept_surface.h"

namespace kerf::leaning_walls_test {
namespace {

using namespace testing_support;

constexpr double kDegree = std::numbers::pi / 180;

/// "bent sheet": round a cylinder, by 1.2 radians.
StrokeBody body_of(std::string_view name) {
  ModelOptions options;
  if (name == "bent sheet") options.bend = 1.2;
  const bool is_sheet = name == "plate" || name == "bent sheet";
  if (is_sheet) options.visual_triangles = 5000;
  const auto model = make_model(is_sheet ? "closed-sheet" : name, options);
  EXPECT_TRUE(model.ok());
  return {model->visual, model->collision};
}

/// Across the body, at a slant, and round a bend; the blade leans to +x.
std::vector<Stroke> strokes_of(const StrokeBody& b) {
  const Vec3 m = b.box.center(), s = 0.65 * b.box.size();
  const auto at = [&](double x, double y) { return Vec2{m.x + x * s.x, m.y + y * s.y}; };
  Stroke bend;
  for (int i = 0; i <= 20; ++i) {
    const double a = 0.1 * i - 1;
    bend.push_back(at(0.35 - 0.3 * a * a, a));
  }
  return {{at(0.07, -1), at(0.07, 1)}, {at(-0.45, -1), at(0.55, 1)}, bend};
}

/// How far walls lie beside what the blade swept, mean edges: of walls and of the swept surface.
struct Beside {
  double stray = 0, missed = 0;
};
Beside measure(StrokeBody& b, const Stroke& s, int poses) {
  const TriangleSoup skin = [&] {
    b.make_whole();
    return skin_of(b.body);
  }();
  const double edge = b.body.mean_root_edge;
  b.cut(s, poses);
  EXPECT_EQ(b.refused, 0);
  const std::vector<std::vector<BladeEdge>> edges{edges_of(b, s, poses)};
  const TriangleSoup swept = swept_at_rest(edges, kAsItIs, 0.25 * edge), walls = walls_of(b.body);
  return {stray_of(walls, swept, 0.1 * edge).distance / edge,
          missed_of(swept, walls, skin, 0.1 * edge).distance / edge};
}

// Cuts of upright blades are drawn to within the path tolerance and the minimum feature.
TEST(LeaningWalls, LieNoFartherBesideTheBladeThanIsReported) {
  for (const char* name : {"plate", "steak", "bent sheet", "meniscus"}) {
    StrokeBody b = body_of(name);
    const double drawn = b.options.path_tolerance + b.options.minimum_feature;
    for (const double lean : {0, 10, 30, 50}) {
      b.tilt = std::tan(lean * kDegree) * b.reach;
      int i = 0;
      for (const Stroke& s : strokes_of(b)) {
        const Beside beside = measure(b, s, s.size() > 2 ? 2 : 20);
        const double most = drawn + b.leaning.distance / b.body.mean_root_edge;
        EXPECT_LT(beside.stray, most) << name << ", " << lean << " degrees, stroke " << i;
        EXPECT_LT(beside.missed, most) << name << ", " << lean << " degrees, stroke " << i;
        const Status valid = validate_complex(b.body, b.start);
        EXPECT_TRUE(valid.ok()) << (valid.ok() ? "" : valid.error().message);
        ++i;
      }
    }
  }
}

}  // namespace
}  // namespace kerf::leaning_walls_test
