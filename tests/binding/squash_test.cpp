// Parameters are places in the mid-surface: what is drawn of a cut is where the collision mesh is cut.
#include "kerf/binding/squash.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/binding/bind.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/binding/tolerances.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/models.h"

namespace kerf::squash_test {
namespace {

Model make(std::string_view name, std::size_t visual = 0) {
  ModelOptions options;
  options.visual_triangles = visual;
  auto model = make_model(name, options);
  EXPECT_TRUE(model.ok()) << (model ? "" : model.error().message);
  return std::move(*model);
}

/// Bound, valid, neither a patch nor the whole by a fallback.
BoundBody bound(const Model& model, const std::string& what) {
  auto body = bind(model.visual, model.collision, {.thickness = 0.1});
  EXPECT_TRUE(body.ok()) << what << ": " << (body ? "" : body.error().message);
  if (!body) return {};
  const Status valid = validate_binding(body->complex);
  EXPECT_TRUE(valid.ok()) << what << ": " << (valid ? "" : valid.error().message);
  EXPECT_FALSE(body->report.upright) << what;
  EXPECT_EQ(body->report.upright_patches, 0) << what;
  EXPECT_EQ(body->report.uniform_patches, 0) << what;
  return std::move(*body);
}

// Without squashing: 0.01 to 0.1 edge on average, 0.13 to 0.4 at most; plates like closed-sheet 0.07 and 0.29.
TEST(Squash, ModelsAreWhereTheirParametersAre) {
  for (const auto& [name, what] : model_names()) {
    const std::string text(name);
    const Displacement d = bound(make(name), text).report.displacement;
    EXPECT_LT(d.mean, name == "sheet" ? 1e-12 : name == "closed-sheet" ? 0.002 : 0.01) << name;
    EXPECT_LT(d.largest, name == "sheet" ? 1e-12 : name == "closed-sheet" ? 0.03 : 0.13) << name;
  }
}

// The mid-surface's normals turn, so that places are found in prisms, not in the triangles' planes; and those of the last triangles do not lie in
// the body's side, so that they lean: without that, 0.007 edge and 0.11 for closed-sheet.
TEST(Squash, BentModelsToo) {
  for (const auto& [name, what] : model_names()) {
    Model model = make(name);
    if (!bend(model, 1.5).ok()) continue;
    const Displacement d = bound(model, std::string(name)).report.displacement;
    EXPECT_LT(d.mean, name == "closed-sheet" ? 0.003 : 0.015) << name;
    EXPECT_LT(d.largest, name == "closed-sheet" ? 0.05 : 0.15) << name;
  }
}

// Scanned bodies stick out over given collision meshes by 0.1 to 0.2 edge, which the last triangles had to take in.
TEST(Squash, TheBorderIsLedOutToTheRim) {
  for (const double short_by : {0.0, 0.01, 0.03}) {
    Model model = make("closed-sheet", 6000);
    for (Vec3& p : model.collision.positions) p = {(1 - 2 * short_by) * p.x, (1 - 2 * short_by) * p.y, p.z};
    const BoundBody body = bound(model, std::to_string(short_by));
    const CollisionMesh& c = body.complex.collision;
    std::int64_t border = 0;
    for (const CollisionVertex v : ids<CollisionVertex>(c.vertex_count())) {
      const double off = norm(c.rest[v] - model.collision.positions[VertexId(v.value)]);
      if (!c.on_border(v)) {
        EXPECT_EQ(off, 0);
        continue;
      }
      ++border;
      EXPECT_LT(norm(body.complex.visual.rest[c.bound[v][0]] - c.rest[v]), 1e-3 * body.complex.mean_root_edge);
    }
    EXPECT_EQ(body.report.led_vertices, short_by > 0 ? border : 0);
    EXPECT_LT(body.report.displacement.mean, 0.006);
  }
}

// A plate around z = 0: every height becomes a thousandth, also beyond the collision mesh; and comes back.
TEST(Squash, APlateBecomesAFilm) {
  const Model model = make("closed-sheet", 2500);
  TriangleMesh middle = model.collision;
  for (Vec3& p : middle.positions) p = {0.9 * p.x, 0.9 * p.y, 0};
  const auto collision = build_collision_mesh(middle, model.half_thickness);
  ASSERT_TRUE(collision.ok());
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (const auto& t : model.visual.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
  const std::vector<Vec3>& positions = model.visual.positions.raw();
  SplitSurface s = make_split_surface(positions, triangles, *build_half_edges(triangles, positions.size()),
                                      smooth_normals(positions, triangles), {});
  BoundVertices vertices;  // any vertex will do to begin at
  vertices.bound.assign(collision->vertex_count(), {0, 0});
  const std::vector<Vec3> normals(collision->vertex_count(), Vec3{0, 0, 1});
  squash(s, *collision, vertices, normals);
  EXPECT_EQ(s.upright, positions);
  for (std::size_t i = 0; i < positions.size(); ++i)
    EXPECT_LT(norm(s.walled.position[i] - Vec3{positions[i].x, positions[i].y, kSquash * positions[i].z}), 1e-12);
  // What is split meanwhile comes back to where it would have been.
  const Vec3 a = positions[static_cast<std::size_t>(triangles[0][0])],
             b = positions[static_cast<std::size_t>(triangles[0][1])];
  split_edge(s, 0, 0.25);
  stand_up(s);
  EXPECT_TRUE(s.upright.empty());
  EXPECT_EQ(s.walled.position.back(), lerp(a, b, 0.25));
  s.walled.position.pop_back();
  EXPECT_EQ(s.walled.position, positions);
}

}  // namespace
}  // namespace kerf::squash_test
