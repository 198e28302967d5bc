#include "kerf/mesh/rigid_models.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "kerf/mesh/models_planar.h"

namespace kerf {
namespace {

/// Four of these are the obstacle of the paper's table 6, 672 triangles.
constexpr int kBallSectors = 12, kBallRings = 8;

TriangleMesh ball() {
  TriangleMesh mesh;
  mesh.positions.push_back({0, 0, 1});
  for (int ring = 1; ring < kBallRings; ++ring) {
    const double polar = std::numbers::pi * ring / kBallRings;
    for (int k = 0; k < kBallSectors; ++k) {
      const double around = 2 * std::numbers::pi * k / kBallSectors;
      mesh.positions.push_back(
          {std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), std::cos(polar)});
    }
  }
  mesh.positions.push_back({0, 0, -1});
  const auto at = [](int ring, int k) { return VertexId(1 + (ring - 1) * kBallSectors + k % kBallSectors); };
  const VertexId south(mesh.positions.size() - 1);
  for (int k = 0; k < kBallSectors; ++k) {
    mesh.triangles.push_back({VertexId(0), at(1, k), at(1, k + 1)});
    for (int ring = 1; ring + 1 < kBallRings; ++ring) {
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)});
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)});
    }
    mesh.triangles.push_back({at(kBallRings - 1, k + 1), at(kBallRings - 1, k), south});
  }
  return mesh;
}

/// A block whose top is dished like the plateau of a tibia, deepest at the origin.
TriangleMesh plateau() {
  constexpr int nx = 24, ny = 20;
  constexpr double width = 0.072, depth = 0.060, floor = -0.012, dish = 0.004, reach = 0.036;  // metres
  models::PlanarMesh planar = models::quad_grid(
      nx, ny,
      [&](int i, int j) {
        return Vec2{width * (i - nx / 2.0) / nx, depth * (j - ny / 2.0) / ny};
      },
      [&](int i, int j) { return models::alternating_split(i, j, nx, ny); });
  models::find_loops(planar);
  models::ThickShape shape;
  shape.top = [&](std::size_t i) {
    const Vec2 p = planar.points[i];
    return dish * (dot(p, p) / (reach * reach));
  };
  shape.bottom = [](std::size_t) { return floor; };
  TriangleMesh mesh = models::thicken(planar, shape);
  mesh.texture = {};
  return mesh;
}

}  // namespace

const std::vector<RigidModelName>& rigid_model_names() {
  static const std::vector<RigidModelName> names{
      {"ball", "sphere of 168 triangles, radius 1 m: four are the obstacle of the paper's second sheet experiment"},
      {"plateau", "block 72 x 60 x 12 mm with a dished top, deepest at the origin, as on top of a tibia"},
  };
  return names;
}

Result<TriangleMesh> make_rigid_model(std::string_view name, double scale) {
  if (!(scale > 0) || !std::isfinite(scale)) return bad_input("the scale of a generated surface must be positive");
  TriangleMesh mesh;
  if (name == "ball") mesh = ball();
  else if (name == "plateau") mesh = plateau();
  else {
    std::string known;
    for (const RigidModelName& n : rigid_model_names()) known += (known.empty() ? "" : ", ") + std::string(n.name);
    return bad_input(fmt::format("there is no rigid model \"{}\"; there are {}", name, known));
  }
  for (Vec3& p : mesh.positions) p = scale * p;
  return mesh;
}

}  // namespace kerf
