// A scalpel that leans in the plane of its travel meets a sheet along a slope, and lips that hang lead the last strand astray. Where nothing resists,
// it parts the sheet without a force.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "kerf/base/rigid_place.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/scene/scene_file.h"
#include "kerf/scene/temporary_folder.h"
#include "session/make_session.h"
#include "support/extruded_mesh.h"
#include "support/synthetic_complex.h"

namespace kerf::leaning_scalpel_test {
namespace {

constexpr unsigned kStrips = 40;
constexpr double kBlade = 0.08;  // m, length of the edge

struct Pass {
  double young, step, speed;  // Pa, s, m/s
  double x, lean;             // m; radians, with the upper end ahead
  double gravity = 0;         // m/s^2, down
};
struct Outcome {
  std::ptrdiff_t pieces = 0;  // that weigh more than a hundredth of the strip
  double force = 0;           // N, the greatest
};

/// A strip in the plane z = 0, from the origin along x, that is held beyond two places. The blade is led across it along +y.
class Strip {
 public:
  Strip(const TriangleMesh& flat, double wide, double half, std::array<double, 2> held)
      : folder_(TemporaryFolder::create()), wide_(wide), held_(held) {
    EXPECT_TRUE(folder_.ok());
    EXPECT_TRUE(write_obj(file("collision.obj"), flat).ok());
    EXPECT_TRUE(write_obj(file("visual.obj"), testing_support::extruded(flat, 1, [&](Vec3) { return half; })).ok());
  }
  [[nodiscard]] Outcome after(const Pass& p) const {
    const Vec3 edge{0, std::sin(p.lean), std::cos(p.lean)}, forward{0, std::cos(p.lean), -std::sin(p.lean)};
    const Vec3 rotation = turn_of({{forward, cross(edge, forward), edge}});
    const Vec3 from = Vec3{p.x, -0.05, 0} - 0.5 * kBlade * edge;
    const auto scene =
        parse_scene(fmt::format(R"([body]
visual = "{}"
collision = "{}"
[material]
young = {}
[cut]
resistance = 0
[contact]
[simulation]
time_step = {}
gravity = [0, 0, {}]
[[fix]]
half_space = {{ point = [{}, 0, 0], normal = [-1, 0, 0] }}
[[fix]]
half_space = {{ point = [{}, 0, 0], normal = [1, 0, 0] }}
[[tool]]
id = "k"
kind = "scalpel"
tip = {}
width = 0.004
thickness = 0.0004
stiffness = 20000
turning_stiffness = 50
max_force = 500
position = [{}, {}, {}]
rotation = [{}, {}, {}]
)",
                                file("visual.obj"), file("collision.obj"), p.young, p.step, -p.gravity, held_[0],
                                held_[1], kBlade, from.x, from.y, from.z, rotation.x, rotation.y, rotation.z),
                    "leaning");
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    Session session = test::make(*scene);
    const double way = wide_ + 0.1, over = way / p.speed;
    SceneCommand lead;
    lead.what = SceneToolMotion{"k", {{over, from + Vec3{0, way, 0}, rotation}}};
    EXPECT_TRUE(session.apply(lead).ok());
    Outcome out;
    for (int i = 0; i < static_cast<int>(over / p.step) + 5; ++i) {
      EXPECT_TRUE(session.step().ok());
      out.force = std::max(out.force, norm(session.tools()[0].force));
    }
    const std::vector<double> masses = session.piece_masses().mass;
    const double most = 0.01 * std::accumulate(masses.begin(), masses.end(), 0.0);
    out.pieces = std::count_if(masses.begin(), masses.end(), [&](double m) { return m > most; });
    return out;
  }

 private:
  [[nodiscard]] std::string file(const char* name) const { return (folder_->path() / name).string(); }
  Result<TemporaryFolder> folder_;
  double wide_;                 // m
  std::array<double, 2> held_;  // m, along x
};

/// No two triangles are alike.
TriangleMesh shaken_grid(int nx, int ny, double length, double width, unsigned seed) {
  TriangleMesh mesh = testing_support::plain_grid_mesh(nx, ny, length, width);
  std::mt19937 random(seed);
  const auto shake = [&](double& x, double size, int cells) {
    const double by = 0.6 * (static_cast<double>(random()) / 4294967296.0 - 0.5) * size / cells;
    if (x > 1e-9 && x < size - 1e-9) x += by;
  };
  for (Vec3& p : mesh.positions) shake(p.x, length, nx), shake(p.y, width, ny);
  return mesh;
}

TEST(LeaningScalpel, PartsAStripWithoutAForce) {
  const double wide = 0.04, half = 0.0015;
  const Strip strip(testing_support::plain_grid_mesh(40, 16, 0.1, wide), wide, half, {0.03, 0.07});
  const double soft = 1e5, stiff = 1e6;
  for (const Pass& p : {Pass{soft, 0.0025, 0.15, 0.0487, 1.0}, Pass{soft, 0.0025, 0.15, 0.0487, 1.2},
                        Pass{soft, 0.005, 0.4, 0.0487, 0.8}, Pass{soft, 0.005, 0.05, 0.0451, -1.1},
                        Pass{stiff, 0.0025, 0.4, 0.0524, 0.8}, Pass{stiff, 0.005, 0.05, 0.0494, 1.1}}) {
    const Outcome out = strip.after(p);
    EXPECT_EQ(out.pieces, 2) << p.lean;
    EXPECT_LT(out.force, 0.01 * p.young * wide * half) << p.lean;
  }
}

// The halves fall to both sides of the last strand, and turn it about the blade. Single passes say little.
TEST(LeaningScalpel, PartsAStripThatSags) {
  std::string others;
  int left = 0;
  for (unsigned seed = 0; seed < kStrips; ++seed) {
    const Strip strip(shaken_grid(12, 3, 0.098, 0.024, seed), 0.024, 0.0025, {0.012, 0.086});
    if (strip.after({2e4, 0.0025, 0.15, 0.0561, 0.6, 9.81}).pieces != 2) ++left, others += fmt::format(" {}", seed);
  }
  EXPECT_LE(left, 1) << "of 40 strips these are not in two:" << others;
}

}  // namespace
}  // namespace kerf::leaning_scalpel_test
