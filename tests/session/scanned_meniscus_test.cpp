// A scanned meniscus, bound to its mid-surface as it comes, with dozens of random, curved and crossing cuts.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "kerf/base/random.h"
#include "kerf/cutting/crossings.h"
#include "kerf/cutting/swept_deviation.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/run_outputs.h"
#include "kerf/record/run_report.h"
#include "kerf/session/session.h"
#include "session/make_session.h"
#include "support/source_dir.h"

namespace kerf::scanned_meniscus_test {
namespace {

void cut_at_random(int cuts) {
  const std::filesystem::path folder = std::filesystem::path(test::source_dir()) / "../shared/meshes";
  if (!std::filesystem::exists(folder / "medial-meniscus.obj")) GTEST_SKIP() << "no ../shared/meshes beside the source";
  Scene scene;
  scene.name = "scan";
  scene.body.visual = (folder / "medial-meniscus.obj").string();
  scene.body.collision = (folder / "medial-meniscus-collision.obj").string();
  scene.material.young = 3.85e6;
  scene.material.poisson = 0.29;
  scene.material.density = 1090;
  scene.simulation.time_step = 0.001;
  auto made = Session::create(scene);
  ASSERT_TRUE(made.ok()) << made.error().message;
  Session& session = *made;
  Box3 box;
  for (const Vec3 p : session.collision_positions()) box.add(p);
  const Vec3 c = box.center(), s = box.size();
  // Seen along the direction in which the body is thinnest.
  const Vec3 thin = s.x < s.y && s.x < s.z ? Vec3{1, 0, 0} : s.y < s.z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  Random random(5);
  const std::vector<Vec3> rest = session.body().complex.collision.rest.raw();
  const auto point = [&] {
    const Vec3 p = rest[static_cast<std::size_t>(random.index(static_cast<int>(rest.size())))] +
                   0.1 * Vec3{s.x * random.uniform(-1, 1), s.y * random.uniform(-1, 1), s.z * random.uniform(-1, 1)};
    return p - dot(p - c, thin) * thin;
  };
  int met = 0, refused = 0;
  for (int cut = 0; cut < cuts; ++cut) {
    const Vec3 p[4] = {point(), point(), point(), point()};
    ASSERT_TRUE(session.begin_stroke(cut % 3 ? SceneFrame::kRest : SceneFrame::kWorld, cut % 4 == 0).ok());
    const int kind = random.index(3), n = 8;
    for (int i = 0; i <= n; ++i) {
      const double t = static_cast<double>(i) / n;
      Vec3 at = lerp(p[0], p[1], t);
      if (kind == 1) at = lerp(lerp(p[0], p[1], t), lerp(p[1], p[2], t), t);
      if (kind == 2) {  // a loop
        const double radius = 0.1 * box.diagonal();
        const Vec3 x = normalized(cross(thin, Vec3{0.3, 0.5, 0.8})), y = cross(thin, x);
        at = p[0] + radius * (std::cos(7 * t) * x + std::sin(7 * t) * y);
      }
      const Status moved = session.move_blade(at + box.diagonal() * thin, at - box.diagonal() * thin);
      ASSERT_TRUE(moved.ok()) << "cut " << cut << ": " << moved.error().message;
    }
    ASSERT_TRUE(session.end_stroke().ok());
    met += session.strokes().back().triangles > 0 ? 1 : 0;
    refused += session.strokes().back().refused;
    const Status valid = session.validate();
    ASSERT_TRUE(valid.ok()) << "after cut " << cut << ": " << valid.error().message;
    ASSERT_TRUE(session.step(2).ok());
  }
  const Status valid = session.validate();
  ASSERT_TRUE(valid.ok()) << valid.error().message;
  std::printf("%d of %d cuts met the meniscus, %d steps refused, %d pieces\n", met, cuts, refused,
              session.counts().pieces);
  EXPECT_GT(met, cuts * 4 / 5);
  EXPECT_GT(session.counts().pieces, cuts / 10);

  if (std::system("python3 --version > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "no python3 to check the exported files with";
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / ("kerf_scanned_meniscus_" + std::to_string(cuts));
  std::filesystem::create_directories(out);
  ASSERT_TRUE(write_final_meshes(session, {"visual", "collision"}, out).ok());
  ASSERT_TRUE(replace_file((out / "report.json").string(), run_report_json(session, {})).ok());
  const std::string check = "python3 " + test::source_dir() + "/tests/end_to_end/check_export.py " + out.string() +
                            " --pieces " + std::to_string(session.counts().pieces);
  EXPECT_EQ(std::system(check.c_str()), 0);
  std::filesystem::remove_all(out);
}

// Walls stand on the mid-surface along its offsets, however the blade leans to it: the figures are those of that rule.
TEST(ScannedMeniscus, WallsStandWhereTheBladeWas) {
  const std::filesystem::path folder = std::filesystem::path(test::source_dir()) / "../shared/meshes";
  if (!std::filesystem::exists(folder / "medial-meniscus.obj")) GTEST_SKIP() << "no ../shared/meshes beside the source";
  Scene scene;
  scene.body.visual = (folder / "medial-meniscus.obj").string();
  scene.body.collision = (folder / "medial-meniscus-collision.obj").string();
  Session session = test::make(scene);
  const CellComplex& body = session.body().complex;
  const double edge = body.mean_root_edge;
  const TriangleSoup skin = skin_of(body);
  Box3 box;
  for (const Vec3 p : body.visual.rest.raw()) box.add(p);
  const Vec3 size = box.size(), up = 2 * norm(size) * Vec3{0, 1, 0};  // it is thinnest along y
  Random random(3);
  TriangleSoup swept;
  for (int i = 0; i < 10; ++i) {
    const auto somewhere = [&] {
      return box.center() + Vec3{random.uniform(-0.6, 0.6) * size.x, 0, random.uniform(-0.6, 0.6) * size.z};
    };
    const Vec3 a = somewhere(), b = somewhere();
    TriangleSoup last;
    for (TriangleSoup* soup : {&swept, &last}) {
      soup->add(a + up, a - up, b - up);
      soup->add(a + up, b - up, b + up);
      soup->build();
    }
    ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    for (int k = 0; k <= 8; ++k)
      ASSERT_TRUE(session.move_blade(lerp(a, b, k / 8.0) + up, lerp(a, b, k / 8.0) - up).ok());
    ASSERT_TRUE(session.end_stroke().ok());
    const TriangleSoup walls = walls_of(body);
    EXPECT_LT(stray_of(walls, swept, 0.2 * edge).distance, 0.3 * edge) << i;
    EXPECT_LT(missed_of(last, walls, skin, 0.2 * edge).distance, 0.2 * edge) << i;
    EXPECT_LT(outside_of(walls, skin, 0.2 * edge).distance, 0.02 * edge) << i;
    EXPECT_LT(crossings_of(body).deepest, 0.02 * edge) << i;
  }
}

/// Walls with a place outside the body by more than 1e-6 of its diagonal, after 15 strokes across it.
struct WallsOutside {
  int walls = 0, outside = 0;
};
WallsOutside walls_outside(const std::string& collision, std::uint64_t seed) {
  const std::string folder = test::source_dir() + "/../shared/meshes/";
  Scene scene;
  scene.body.visual = folder + "medial-meniscus.obj";
  if (!collision.empty()) scene.body.collision = folder + collision;
  Session session = test::make(scene);
  const CellComplex& body = session.body().complex;
  const TriangleSoup skin = skin_of(body);
  Box3 box;
  for (const Vec3 p : body.visual.rest.raw()) box.add(p);
  const Vec3 size = box.size(), up = 2 * norm(size) * Vec3{0, 1, 0};
  Random random(seed);
  for (int i = 0; i < 15; ++i) {
    const auto somewhere = [&] {
      return box.center() + Vec3{random.uniform(-0.6, 0.6) * size.x, 0, random.uniform(-0.6, 0.6) * size.z};
    };
    const Vec3 a = somewhere(), b = somewhere();
    EXPECT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
    for (int k = 0; k <= 8; ++k)
      EXPECT_TRUE(session.move_blade(lerp(a, b, k / 8.0) + up, lerp(a, b, k / 8.0) - up).ok());
    EXPECT_TRUE(session.end_stroke().ok());
  }
  WallsOutside found;
  for (const TriangleSoup& wall : each_wall_of(body)) {
    ++found.walls;
    found.outside += outside_of(wall, skin, 0.1 * body.mean_root_edge).distance > 1e-6 * norm(size) ? 1 : 0;
  }
  return found;
}

// The sides of a meniscus are hollow, and its inner edge is sharp. With straight columns 93 of these 2,739 walls leave it.
TEST(ScannedMeniscus, FewWallsLeaveIt) {
  const std::filesystem::path folder = std::filesystem::path(test::source_dir()) / "../shared/meshes";
  if (!std::filesystem::exists(folder / "medial-meniscus.obj")) GTEST_SKIP() << "no ../shared/meshes beside the source";
  WallsOutside all;
  for (const char* collision : {"medial-meniscus-collision.obj", ""})
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      const WallsOutside one = walls_outside(collision, seed);
      all.walls += one.walls;
      all.outside += one.outside;
    }
  std::printf("%d of %d walls leave the meniscus\n", all.outside, all.walls);
  EXPECT_GT(all.walls, 2000);
  EXPECT_LE(all.outside, all.walls / 200);
}

TEST(ScannedMeniscus, TwelveRandomCuts) { cut_at_random(12); }
TEST(ScannedMeniscus, FiftyRandomCuts) { cut_at_random(50); }

}  // namespace
}  // namespace kerf::scanned_meniscus_test
