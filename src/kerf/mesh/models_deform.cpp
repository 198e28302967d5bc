// Bent, bumpy and noisy versions of any model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/random.h"
#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/models_planar.h"

namespace kerf {

Status bend(Model& model, double angle) {
  if (angle == 0) return {};
  if (!(std::abs(angle) <= 2 * M_PI))
    return bad_input(fmt::format("a bend of {} radians is more than a full turn", angle));
  Box3 box = models::bounding_box(model.visual);
  for (const Vec3 p : model.collision.positions) box.add(p);
  const double radius = box.size().x / angle, middle = box.center().x;  // signed: a negative angle bends the other way
  const double reach = angle > 0 ? -box.min.z : box.max.z;
  if (reach >= 0.999 * std::abs(radius))
    return bad_input(
        fmt::format("a bend of {} radians needs a radius of {} m, less than the body's thickness on the inner "
                    "side; bend it less",
                    angle, std::abs(radius)));
  auto move = [&](Vec3& p) {
    const double a = (p.x - middle) / radius, r = radius + p.z;
    p = {middle + r * std::sin(a), p.y, r * std::cos(a) - radius};
  };
  for (Vec3& p : model.visual.positions) move(p);
  for (Vec3& p : model.collision.positions) move(p);
  Box3 bent = models::bounding_box(model.visual);
  for (const Vec3 p : model.collision.positions) bent.add(p);
  model.lattice = models::lattice_around(bent, model.lattice.cell);
  return {};
}

void add_bumps(Model& model, double amplitude, double wavelength, std::uint64_t seed) {
  if (amplitude == 0) return;
  constexpr int kWaves = 6;
  struct Wave {
    double x, y, phase;
  };
  std::array<Wave, kWaves> waves{};
  Random random(seed);
  for (Wave& w : waves) {
    const double direction = random.uniform(0, 2 * M_PI), k = 2 * M_PI / (wavelength * random.uniform(1, 2));
    w = {k * std::cos(direction), k * std::sin(direction), random.uniform(0, 2 * M_PI)};
  }
  auto move = [&](Vec3& p) {
    double sum = 0;
    for (const Wave& w : waves) sum += std::sin(w.x * p.x + w.y * p.y + w.phase);
    p.z += amplitude * sum / kWaves;
  };
  for (Vec3& p : model.visual.positions) move(p);
  for (Vec3& p : model.collision.positions) move(p);
  Box3 box = models::bounding_box(model.visual);
  for (const Vec3 p : model.collision.positions) box.add(p);
  LatticeHint& lattice = model.lattice;
  if (lattice.cells[2] == 1) {  // one layer stays one layer
    const double low = std::min(lattice.origin.z, box.min.z),
                 high = std::max(lattice.origin.z + lattice.cell.z, box.max.z);
    lattice.origin.z = low;
    lattice.cell.z = high - low;
  } else {
    lattice = models::lattice_around(box, lattice.cell);
  }
}

void add_noise(Model& model, double amplitude, std::uint64_t seed) {
  if (amplitude == 0) return;
  std::vector<bool> fixed(model.visual.positions.size(), false);
  if (!model.closed) {
    std::vector<std::array<std::int32_t, 3>> triangles;
    for (const auto& t : model.visual.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
    const auto built = build_half_edges(triangles, model.visual.positions.size());
    KERF_ASSERT(built.ok());
    for (std::size_t h = 0; h < built->twin.size(); ++h)
      if (built->twin[h] < 0) {
        fixed[static_cast<std::size_t>(triangles[h / 3][h % 3])] = true;
        fixed[static_cast<std::size_t>(triangles[h / 3][(h + 1) % 3])] = true;
      }
  }
  Random random(seed);
  auto& positions = model.visual.positions.raw();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    Vec3 d;
    do {  // uniform in the unit ball
      d.x = random.uniform(-1, 1);
      d.y = random.uniform(-1, 1);
      d.z = random.uniform(-1, 1);
    } while (dot(d, d) > 1);
    if (!fixed[v]) positions[v] += amplitude * d;
  }
}

}  // namespace kerf
