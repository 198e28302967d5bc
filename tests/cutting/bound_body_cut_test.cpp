// Cuts through real bound bodies: the models of the paper, harder ones, and a scanned meniscus.
#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "cutting/cut_body.h"
#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"
#include "support/extruded_mesh.h"
#include "support/piece_volumes.h"
#include "support/source_dir.h"
#include "support/synthetic_complex.h"

namespace kerf::bound_body_cut_test {
namespace {

using namespace testing_support;

Vec3 random_point(const CellComplex& body, Random& random) {
  const CollisionMesh& mesh = body.collision;
  const CollisionTriangle f(random.index(static_cast<int>(mesh.face_count())));
  double u = random.uniform(), v = random.uniform();
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  const auto p = [&](int i) { return mesh.rest[mesh.origin[CollisionMesh::corner(f, i)]]; };
  return (1 - u - v) * p(0) + u * p(1) + v * p(2);
}

/// Random cuts on the body's own scale: stabs, chords, walks over the surface, circles in a tangent plane.
void cut_at_random(CellComplex& body, std::uint64_t seed, int cuts, const std::string& name) {
  const ComplexMeasures start = measure_complex(body);
  const Status before = validate_complex(body, start);
  ASSERT_TRUE(before.ok()) << name << ": " << before.error().message;
  CutOptions options;
  options.layers = 1 + static_cast<int>(seed % 3);
  CutScratch scratch;
  Random random(seed);
  const double edge = body.mean_root_edge;
  long opened = 0;
  int refused = 0;
  for (int i = 0; i < cuts; ++i) {
    std::vector<Vec3> path{random_point(body, random)};
    switch (random.index(4)) {
      case 0:
        path.push_back(path[0] + random.uniform(0.1, 3) * edge * normalized(random_point(body, random) - path[0]));
        break;
      case 1: path.push_back(random_point(body, random)); break;
      case 2:
        for (int k = 0; k < 8; ++k) {
          const Vec3 to = random_point(body, random);
          path.push_back(path.back() + 0.7 * edge * normalized(to - path.back()));
        }
        break;
      default: {
        const SurfacePoint at = nearest_on_surface(body.collision, path[0]);
        const CollisionMesh& m = body.collision;
        const auto p = [&](int k) { return m.rest[m.origin[CollisionMesh::corner(at.face, k)]]; };
        const Vec3 x = normalized(p(1) - p(0)), y = normalized(cross(cross(x, p(2) - p(0)), x));
        const Vec3 centre = path[0];
        const double r = random.uniform(0.2, 1.2) * edge;
        path.clear();
        for (int k = 0; k <= 16; ++k) {
          const double angle = 2 * 3.14159265358979323846 * (k % 16) / 16;
          path.push_back(centre + r * std::cos(angle) * x + r * std::sin(angle) * y);
        }
      }
    }
    const PolylineCut cut = cut_polyline(body, path, options, scratch);
    opened += cut.opened_edges;
    refused += cut.refused;
    const Status status = validate_complex(body, start);
    ASSERT_TRUE(status.ok()) << name << " seed " << seed << " cut " << i << ": " << status.error().message;
    const Status volumes = validate_piece_volumes(body, start);
    ASSERT_TRUE(volumes.ok()) << name << " seed " << seed << " cut " << i << ": " << volumes.error().message;
  }
  EXPECT_GT(opened, cuts) << name;
  EXPECT_LE(refused, cuts / 2) << name;
}

CellComplex bound(const TriangleMesh& visual, const TriangleMesh& collision, bool closed) {
  BindOptions options;
  if (!closed) options.thickness = 0.01;
  auto body = bind(visual, collision, options);
  EXPECT_TRUE(body.ok()) << (body.ok() ? "" : body.error().message);
  return body.ok() ? std::move(body->complex) : CellComplex{};
}

// Corners off a box of 12 triangles, drawn as prisms: walls ran from the cut to the box's own edge, and a 30th of the corner came off.
TEST(BoundBodyCut, CornersOfABoxOfTwelveTriangles) {
  const Vec3 size{0.1, 0.06, 0.004};
  TriangleMesh collision, drawn = plain_grid_mesh(1, 1);
  for (const auto& [x, y] : std::vector<std::array<double, 2>>{{0, 0},
                                                               {25, 0},
                                                               {50, 0},
                                                               {75, 0},
                                                               {100, 0},
                                                               {100, 30},
                                                               {100, 60},
                                                               {75, 60},
                                                               {50, 60},
                                                               {25, 60},
                                                               {0, 60},
                                                               {0, 30},
                                                               {40.6, 16.2},
                                                               {64.3, 24.6},
                                                               {86.2, 21.7},
                                                               {30.9, 40.8},
                                                               {75.6, 42.3}})
    collision.positions.push_back({1e-3 * x, 1e-3 * y, 0});
  for (const auto& [a, b, c] : std::vector<std::array<int, 3>>{
           {16, 5, 6},   {7, 16, 6},   {11, 15, 10}, {1, 11, 0}, {15, 9, 10}, {14, 16, 13}, {16, 14, 5},
           {3, 14, 13},  {14, 3, 4},   {5, 14, 4},   {8, 16, 7}, {8, 9, 15},  {8, 15, 13},  {16, 8, 13},
           {15, 12, 13}, {11, 12, 15}, {1, 12, 11},  {2, 3, 13}, {12, 2, 13}, {2, 12, 1}})
    collision.triangles.push_back({VertexId(a), VertexId(b), VertexId(c)});
  for (Vec3& p : drawn.positions) p = {size.x * p.x, size.y * p.y, 0};
  const auto box = bind(extruded(drawn, 1, [&](Vec3) { return 0.5 * size.z; }), collision, {});
  ASSERT_TRUE(box.ok()) << box.error().message;
  Random random(3);
  for (int i = 0; i < 40; ++i) {
    CellComplex body = box->complex;
    const double edge = body.mean_root_edge, x = random.uniform(0.15, 0.8) * edge, y = random.uniform(0.15, 0.8) * edge;
    const Vec3 corner{i % 2 ? size.x : 0, i / 2 % 2 ? size.y : 0, 0};
    const Vec3 a = corner + Vec3{i % 2 ? -x : x, 0, 0}, b = corner + Vec3{0, i / 2 % 2 ? -y : y, 0};
    CutScratch scratch;
    cut_polyline(body, std::vector<Vec3>{a + 0.2 * (a - b), b + 0.2 * (b - a)}, CutOptions{}, scratch);
    const std::vector<double> volumes = piece_volumes(body);
    ASSERT_EQ(volumes.size(), 2u) << i;
    const double wanted = 0.5 * x * y * size.z;
    EXPECT_NEAR(volumes[0] / wanted, 1, 0.1) << i << ": legs " << x / edge << " and " << y / edge << " edges";
    EXPECT_NEAR(volumes[0] + volumes[1], size.x * size.y * size.z, 1e-12) << i;
  }
}

TEST(BoundBodyCut, EveryModelStaysValid) {
  const char* long_run = std::getenv("KERF_FUZZ_SECONDS");
  const int cuts = long_run ? 60 : 12;
  for (const ModelName& m : model_names())
    for (const double bumps : {0.0, 0.02}) {
      ModelOptions options;
      auto model = make_model(m.name, options);
      if (!model.ok()) {
        ADD_FAILURE() << model.error().message;
        continue;
      }
      if (model->visual.triangles.size() > 20000) continue;
      if (bumps > 0) {
        Box3 box;
        for (const Vec3& p : model->visual.positions) box.add(p);
        add_bumps(*model, bumps * box.size().z, 0.3 * box.diagonal(), 3);
      }
      CellComplex body = bound(model->visual, model->collision, model->closed);
      if (body.collision.face_count() == 0) continue;
      cut_at_random(body, 17, cuts, std::string(m.name));
    }
}

TEST(BoundBodyCut, TheScannedMeniscusStaysValid) {
  const std::string folder = test::source_dir() + "/../shared/meshes/";
  if (!std::filesystem::exists(folder + "medial-meniscus.obj")) GTEST_SKIP() << "no ../shared/meshes beside the source";
  const auto visual = read_mesh(folder + "medial-meniscus.obj");
  const auto collision = read_mesh(folder + "medial-meniscus-collision.obj");
  ASSERT_TRUE(visual.ok() && collision.ok());
  CellComplex body = bound(*visual, *collision, true);
  ASSERT_GT(body.collision.face_count(), 0u);
  cut_at_random(body, 5, std::getenv("KERF_FUZZ_SECONDS") ? 150 : 25, "scanned meniscus");
}

}  // namespace
}  // namespace kerf::bound_body_cut_test
