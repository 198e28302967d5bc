#include "kerf/lattice/hex_mesh.h"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

constexpr double kPoint = 0.774596669241483377;  // sqrt(3/5)

}  // namespace

HexMesh::HexMesh() = default;
HexMesh::HexMesh(const HexMesh&) = default;
HexMesh::HexMesh(HexMesh&&) noexcept = default;
HexMesh& HexMesh::operator=(const HexMesh&) = default;
HexMesh& HexMesh::operator=(HexMesh&&) noexcept = default;
HexMesh::~HexMesh() = default;

const LatticeFrame& frame_around(const CollisionMesh& mesh, const HexMesh& hex, CollisionVertex v) {
  return hex.bodies.size() == 1 ? hex.bodies[0].frame : hex.frame_of(mesh.root[CollisionMesh::face(mesh.outgoing[v])]);
}

PrismCorners corners_of(const CollisionMesh& mesh, const HexMesh& hex, CollisionVertex v) {
  return corners_of(mesh, frame_around(mesh, hex, v), v);
}

Vec3 largest_cell(const HexMesh& hex) {
  Vec3 largest;
  for (const LatticeBody& body : hex.bodies) {
    const Vec3 c = body.frame.cell;
    if (c.x * c.y * c.z > largest.x * largest.y * largest.z) largest = c;
  }
  return largest;
}

double shortest_cell_edge(const HexMesh& hex) {
  double shortest = HUGE_VAL;
  for (const LatticeBody& body : hex.bodies)
    shortest = std::min({shortest, body.frame.cell.x, body.frame.cell.y, body.frame.cell.z});
  return shortest;
}

std::size_t count_alive(const HexMesh& hex) {
  return static_cast<std::size_t>(std::count(hex.state.raw().begin(), hex.state.raw().end(), HexState::kAlive));
}

std::size_t count_active_nodes(const HexMesh& hex) {
  const auto& uses = hex.node_uses.raw();
  return static_cast<std::size_t>(std::count_if(uses.begin(), uses.end(), [](std::int32_t n) { return n > 0; }));
}

const std::array<Vec3, 27>& quadrature_points() {
  static constexpr std::array<Vec3, 27> points = [] {
    std::array<Vec3, 27> p{};
    constexpr double x[3] = {-kPoint, 0, kPoint};
    for (std::size_t i = 0; i < 27; ++i) p[i] = {x[i % 3], x[i / 3 % 3], x[i / 9]};
    return p;
  }();
  return points;
}

const std::array<double, 27>& full_weights() {
  static constexpr std::array<double, 27> weights = [] {
    std::array<double, 27> w{};
    constexpr double g[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    for (std::size_t i = 0; i < 27; ++i) w[i] = g[i % 3] * g[i / 3 % 3] * g[i / 9];
    return w;
  }();
  return weights;
}

namespace {

/// Along one axis: weights at (-p, 0, p) with the moments m0, m1, m2 of 1, x, x^2.
template <std::size_t kStep>
void moments_to_weights(std::array<double, 27>& w) {
  for (std::size_t block = 0; block < 27; block += 3 * kStep)
    for (std::size_t i = block; i < block + kStep; ++i) {
      const double m0 = w[i], m1 = w[i + kStep], m2 = w[i + 2 * kStep];
      const double even = m2 / (kPoint * kPoint), odd = m1 / kPoint;
      w[i] = 0.5 * (even - odd);
      w[i + kStep] = m0 - even;
      w[i + 2 * kStep] = 0.5 * (even + odd);
    }
}

}  // namespace

std::array<double, 27> weights_of(const Moments& moments) {
  std::array<double, 27> w = moments;
  moments_to_weights<1>(w);
  moments_to_weights<3>(w);
  moments_to_weights<9>(w);
  return w;
}

}  // namespace kerf
