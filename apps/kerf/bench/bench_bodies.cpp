#include "bench/bench_bodies.h"

#include "bench/timing.h"

namespace kerf::bench {
namespace {

ModelOptions model_options(const BenchBody& body) {
  ModelOptions options;
  options.visual_triangles = body.visual;
  options.collision_triangles = body.collision;
  return options;
}

double mean_visual_vertices(const CellComplex& body) {
  const CollisionMesh& mesh = body.collision;
  double sum = 0;
  const int sides = body.closed ? 2 : 1;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const CollisionTriangle triangle(f);
    for (int side = 0; side < sides; ++side) {
      const auto s = static_cast<std::size_t>(side);
      sum += mesh.free[triangle][s].count + 3;
      for (int i = 0; i < 3; ++i) {
        const PoolRun& chain = mesh.chain[CollisionMesh::corner(triangle, i)][s];
        if (chain.exists()) sum += chain.count;
      }
    }
  }
  return sum / static_cast<double>(mesh.face_count());
}

}  // namespace

Scene bench_scene(const BenchBody& body) {
  Scene scene;
  scene.name = scene.body.model = body.model;
  scene.body.options = model_options(body);
  scene.simulation.time_step = kBenchStep;
  if (body.cells > 0) scene.lattice.cells = {body.cells, body.cells, 1};
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  const double length = body.model == "meniscus" ? 0.045 : body.model == "steak" ? 0.2 : 1.0;
  fix.region.point = {-0.45 * length, 0, 0};
  fix.region.normal = {-1, 0, 0};
  scene.fixes.push_back(fix);
  return scene;
}

Result<Session> bench_session(const BenchBody& body, std::optional<double> dust) {
  Scene scene = bench_scene(body);
  if (dust) scene.cut.dust = *dust;
  return Session::create(scene);
}

Scene haptic_scene(const std::string& model) {
  Scene scene = bench_scene({model, 0, 0});
  scene.simulation.time_step = 0.001;
  SceneObstacle& plane = scene.obstacles.emplace_back();
  plane.shape = SceneShape::kPlane;
  plane.position = {0, 0, model == "meniscus" ? -0.0045 : -0.0125};
  return scene;
}

Scene sheet_over_balls(std::size_t collision, double mass) {
  Scene scene = bench_scene({"sheet", 6656, collision});
  scene.fixes.clear();
  scene.material.density = mass / 0.1;
  for (const double x : {-0.25, 0.25})
    for (const double y : {-0.25, 0.25}) {
      SceneObstacle& ball = scene.obstacles.emplace_back();
      ball.shape = SceneShape::kMesh;
      ball.model = "ball";
      ball.scale = 0.18;
      ball.position = {x, y, -0.24};
    }
  return scene;
}

Result<BindTiming> time_binding(const BenchBody& body, int repeats, bool exact_paths, bool local_paths) {
  const auto model = make_model(body.model, model_options(body));
  if (!model) return model.error();
  BindTiming timing;
  for (const bool exact : {true, false}) {
    if (!(exact ? exact_paths : local_paths)) continue;
    Sample times;
    for (int i = 0; i < repeats; ++i) {
      BindOptions options;
      options.exact = exact;
      options.thickness = 2 * model->half_thickness.front();
      const double start = thread_seconds();
      const auto bound = bind(model->visual, model->collision, options);
      times.add(thread_seconds() - start);
      if (!bound) return bound.error();
      if (i + 1 < repeats) continue;
      timing.report = bound->report;
      timing.collision_vertices = bound->complex.collision.vertex_count();
      timing.collision_triangles = bound->complex.collision.face_count();
      timing.visual_vertices_per_triangle = mean_visual_vertices(bound->complex);
      timing.visual_triangles_per_triangle =
          static_cast<double>(bound->complex.visual.face_count()) / static_cast<double>(timing.collision_triangles);
    }
    (exact ? timing.exact : timing.local) = times.median();
  }
  return timing;
}

}  // namespace kerf::bench
