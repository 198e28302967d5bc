// What binding falls back on where squashed positions are useless: for a patch the weights of the surface as it stands, then uniform ones; for a body
// paths and parameters of the surface as it stands.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/binding/bind.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/binding/parametrize.h"
#include "kerf/binding/patches.h"
#include "kerf/binding/skin_search.h"
#include "kerf/binding/validate_binding.h"
#include "kerf/mesh/models.h"

namespace kerf::fallbacks_test {
namespace {

/// A plate up to its patches; nothing is squashed.
struct Plate {
  Model model = *make_model("closed-sheet", {.visual_triangles = 6000});
  CollisionMesh collision = *build_collision_mesh(model.collision, model.half_thickness);
  SplitSurface surface;
  BoundVertices vertices;
  PathNetwork network;
  PatchMap patches;

  Plate() {
    std::vector<std::array<std::int32_t, 3>> triangles;
    for (const auto& t : model.visual.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
    const std::vector<Vec3>& positions = model.visual.positions.raw();
    surface = make_split_surface(positions, triangles, *build_half_edges(triangles, positions.size()),
                                 smooth_normals(positions, triangles), {});
    const SkinSearch search(positions, triangles, collision.vertex_count());
    std::vector<Vec3> normals(collision.vertex_count(), Vec3{0, 0, 1});
    vertices = *bind_closed(surface, search, collision, normals);
    network = *insert_paths(surface, collision, vertices, true, {});
    split_dividing_edges(surface, collision, vertices, network);
    patches = *find_patches(surface, collision, vertices, network, true);
  }
  [[nodiscard]] Parametrization parameters() const {
    auto result = parametrize(surface, collision, vertices, network, patches, true, {}, {});
    EXPECT_TRUE(result.ok()) << (result ? "" : result.error().message);
    return result ? std::move(*result) : Parametrization{};
  }
  /// Vertices inside a patch.
  [[nodiscard]] std::vector<std::int32_t> inside(std::size_t patch) const {
    std::vector<std::int32_t> found;
    for (std::int32_t i = patches.first[patch]; i < patches.first[patch + 1]; ++i)
      for (std::int32_t k = 0; k < 3; ++k) {
        const std::int32_t v = surface.walled.from(3 * patches.faces[static_cast<std::size_t>(i)] + k);
        if (!surface.walled.wall_vertex[static_cast<std::size_t>(v)]) found.push_back(v);
      }
    return found;
  }
};

/// Every image is positively oriented.
void expect_one_to_one(const Parametrization& p) {
  for (std::size_t h = 0; h < p.planar.size(); h += 3)
    EXPECT_GT(cross(p.planar[h + 1] - p.planar[h], p.planar[h + 2] - p.planar[h]), 0) << "face " << h / 3;
}

constexpr std::size_t kPatch = 41;

/// All vertices inside the patch come to one place, which has no directions.
void crush(std::vector<Vec3>& positions, const std::vector<std::int32_t>& vertices) {
  for (const std::int32_t v : vertices)
    positions[static_cast<std::size_t>(v)] = positions[static_cast<std::size_t>(vertices[0])];
}

TEST(Fallbacks, APatchThatIsCrushedTakesTheWeightsOfTheSurfaceAsItIs) {
  Plate plate;
  const Parametrization expected = plate.parameters();
  EXPECT_EQ(expected.upright_patches + expected.uniform_patches, 0);
  const std::vector<std::int32_t> inside = plate.inside(kPatch);
  ASSERT_GT(inside.size(), 20u);
  plate.surface.upright = plate.surface.walled.position;
  crush(plate.surface.walled.position, inside);
  const Parametrization got = plate.parameters();
  EXPECT_EQ(got.upright_patches, 1);
  EXPECT_EQ(got.uniform_patches, 0);
  expect_one_to_one(got);
  for (std::size_t h = 0; h < expected.planar.size(); ++h)
    ASSERT_LT(norm(got.planar[h] - expected.planar[h]), 1e-12) << h;
}

TEST(Fallbacks, OneThatIsCrushedAsItIsTakesUniformWeights) {
  Plate plate;
  const std::vector<std::int32_t> inside = plate.inside(kPatch);
  crush(plate.surface.walled.position, inside);
  for (const bool squashed : {false, true}) {
    if (squashed) plate.surface.upright = plate.surface.walled.position;
    const Parametrization got = plate.parameters();
    EXPECT_EQ(got.upright_patches, 0);
    EXPECT_EQ(got.uniform_patches, 1);
    expect_one_to_one(got);
  }
}

// No body is known whose paths fail on the squashed surface alone: what a retry does is asked for here.
TEST(Fallbacks, ModelsBindOnTheSurfaceAsItStands) {
  for (const auto& [name, what] : model_names()) {
    const Model model = *make_model(name, {});
    const auto pressed = bind(model.visual, model.collision, {.thickness = 0.1}),
               upright = bind(model.visual, model.collision, {.thickness = 0.1, .squash = false});
    ASSERT_TRUE(pressed.ok() && upright.ok()) << name;
    const Status valid = validate_binding(upright->complex);
    EXPECT_TRUE(valid.ok()) << name << ": " << (valid ? "" : valid.error().message);
    EXPECT_FALSE(pressed->report.upright) << name;
    EXPECT_EQ(upright->report.upright, model.closed) << name;
    EXPECT_NEAR(upright->report.volume_after, pressed->report.volume_after, 1e-12 * pressed->report.volume_before)
        << name;
    if (!model.closed) continue;
    EXPECT_GT(upright->report.displacement.largest, 2 * pressed->report.displacement.largest) << name;
    ASSERT_FALSE(upright->report.warnings.empty()) << name;
    EXPECT_NE(upright->report.warnings.back().find("beside the blade"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace kerf::fallbacks_test
