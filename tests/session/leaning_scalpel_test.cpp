// A scalpel that leans in the plane of its travel meets a sheet along a slope. Where nothing resists, it parts the sheet without a force.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "kerf/base/rigid_place.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/scene/scene_file.h"
#include "kerf/scene/temporary_folder.h"
#include "session/make_session.h"
#include "support/extruded_mesh.h"
#include "support/synthetic_complex.h"

namespace kerf::leaning_scalpel_test {
namespace {

constexpr double kLong = 0.1, kWide = 0.04, kHalf = 0.0015;  // m, the strip; its half thickness
constexpr double kBlade = 0.08;                              // m, length of the edge

struct Pass {
  double young, step, speed;  // Pa, s, m/s
  double x, lean;             // m; radians, with the upper end ahead
};
struct Outcome {
  int pieces = 0;
  double force = 0;  // N, the greatest
};

/// A strip that is held 20 mm from the blade on both sides. The blade is led across it along +y.
class Strip {
 public:
  Strip() : folder_(TemporaryFolder::create()) {
    EXPECT_TRUE(folder_.ok());
    const TriangleMesh flat = testing_support::plain_grid_mesh(40, 16, kLong, kWide);
    EXPECT_TRUE(write_obj(file("collision.obj"), flat).ok());
    EXPECT_TRUE(
        write_obj(file("visual.obj"), testing_support::extruded(flat, 1, [](Vec3) { return kHalf; })).ok());
  }
  [[nodiscard]] Outcome after(const Pass& p) const {
    const Vec3 edge{0, std::sin(p.lean), std::cos(p.lean)}, forward{0, std::cos(p.lean), -std::sin(p.lean)};
    const Vec3 rotation = turn_of({{forward, cross(edge, forward), edge}});
    const Vec3 from = Vec3{p.x, -0.05, 0} - 0.5 * kBlade * edge;
    const auto scene = parse_scene(
        fmt::format(R"([body]
visual = "{}"
collision = "{}"
[material]
young = {}
[cut]
resistance = 0
[contact]
[simulation]
time_step = {}
gravity = [0, 0, 0]
[[fix]]
half_space = {{ point = [0.03, 0, 0], normal = [-1, 0, 0] }}
[[fix]]
half_space = {{ point = [0.07, 0, 0], normal = [1, 0, 0] }}
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
                    file("visual.obj"), file("collision.obj"), p.young, p.step, kBlade, from.x, from.y, from.z,
                    rotation.x, rotation.y, rotation.z),
        "leaning");
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    Session session = test::make(*scene);
    const double over = (kWide + 0.1) / p.speed;
    SceneCommand lead;
    lead.what = SceneToolMotion{"k", {{over, from + Vec3{0, kWide + 0.1, 0}, rotation}}};
    EXPECT_TRUE(session.apply(lead).ok());
    Outcome out;
    for (int i = 0; i < static_cast<int>(over / p.step) + 5; ++i) {
      EXPECT_TRUE(session.step().ok());
      out.force = std::max(out.force, norm(session.tools()[0].force));
    }
    out.pieces = session.counts().pieces;
    return out;
  }

 private:
  [[nodiscard]] std::string file(const char* name) const { return (folder_->path() / name).string(); }
  Result<TemporaryFolder> folder_;
};

TEST(LeaningScalpel, PartsAStripWithoutAForce) {
  const Strip strip;
  const double soft = 1e5, stiff = 1e6;
  for (const Pass& p : {Pass{soft, 0.0025, 0.15, 0.0487, 1.0}, Pass{soft, 0.0025, 0.15, 0.0487, 1.2},
                        Pass{soft, 0.005, 0.4, 0.0487, 0.8}, Pass{soft, 0.005, 0.05, 0.0451, -1.1},
                        Pass{stiff, 0.0025, 0.4, 0.0524, 0.8}, Pass{stiff, 0.005, 0.05, 0.0494, 1.1}}) {
    const Outcome out = strip.after(p);
    EXPECT_EQ(out.pieces, 2) << p.lean;
    EXPECT_LT(out.force, 0.01 * p.young * kWide * kHalf) << p.lean;
  }
}

}  // namespace
}  // namespace kerf::leaning_scalpel_test
