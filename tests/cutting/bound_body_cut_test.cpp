// Cuts through real bound bodies: the models of the paper, harder ones, and a scanned meniscus.
#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "cutting/cut_body.h"
#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"
#include "support/source_dir.h"

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
