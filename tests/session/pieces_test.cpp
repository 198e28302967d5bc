// Lives in which a slit's tip lay in a face of the lattice and its continuation, along that face, cut off what its glue did
// not hold: the hexahedra came apart before the body did.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/lattice/lattice_validate.h"
#include "kerf/session/session.h"

namespace kerf::pieces_test {
namespace {

TEST(Pieces, ATipInAFaceOfTheLatticeCutsNothingOff) {
  struct Kind {
    const char* model;
    std::size_t triangles;
  };
  static constexpr Kind kinds[] = {
      {"closed-sheet", 800}, {"steak", 0}, {"meniscus", 0}, {"holed-slab", 800}, {"two-holed-slab", 800}};
  for (const std::uint64_t seed : {46, 82, 180, 452, 1157, 1226, 1280, 1408}) {
    Random random(seed);
    const Kind& kind = kinds[random.index(5)];
    Scene scene;
    scene.body.model = kind.model;
    scene.body.options.visual_triangles = kind.triangles;
    auto made = Session::create(scene);
    ASSERT_TRUE(made.ok()) << made.error().message;
    Session session = std::move(made).value();
    Box3 box;
    for (const Vec3 p : session.collision_positions()) box.add(p);
    const double size = box.diagonal();
    for (int cut = 0; cut < 6; ++cut) {
      const std::vector<Vec3> rest = session.body().complex.collision.rest.raw();
      const auto point = [&] {
        const Vec3 a = rest[static_cast<std::size_t>(random.index(static_cast<int>(rest.size())))];
        const Vec3 b = rest[static_cast<std::size_t>(random.index(static_cast<int>(rest.size())))];
        return lerp(a, b, random.uniform(-.2, 1.2));
      };
      std::vector<Vec3> path;
      const Vec3 a = point(), b = point(), c = point();
      const int n = 4 + random.index(14);
      if (random.index(4) == 0) {
        const double radius = size * random.uniform(.02, .2);
        for (int i = 0; i <= 20; ++i) {
          const double angle = 2 * std::numbers::pi * 1.1 * i / 20;
          path.push_back(a + Vec3{radius * std::cos(angle), radius * std::sin(angle), 0});
        }
      } else {
        for (int i = 0; i <= n; ++i) {
          const double t = i / static_cast<double>(n);
          path.push_back(lerp(lerp(a, b, t), lerp(b, c, t), t));
        }
      }
      ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
      for (const Vec3 p : path) {
        ASSERT_TRUE(session.move_blade(p + Vec3{0, 0, 2 * size}, p - Vec3{0, 0, 2 * size}).ok());
        const Status valid = validate_lattice_pieces(session.body().complex.collision, session.body().hex);
        ASSERT_TRUE(valid.ok()) << seed << ", " << kind.model << ", cut " << cut << ": " << valid.error().message;
      }
      ASSERT_TRUE(session.end_stroke().ok());
    }
  }
}

}  // namespace
}  // namespace kerf::pieces_test
