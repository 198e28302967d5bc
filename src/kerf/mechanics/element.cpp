#include "kerf/mechanics/element.h"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

constexpr int kModes = 9;
// Strain mode k: strain component kModeStrain[k] varies with natural coordinate kModeCoordinate[k].
constexpr std::array<int, kModes> kModeStrain = {0, 1, 2, 3, 3, 4, 4, 5, 5};
constexpr std::array<int, kModes> kModeCoordinate = {0, 1, 2, 0, 1, 1, 2, 0, 2};

// Integrals over the material. Everything the matrix needs is linear in them, so no strain matrix is ever
// formed.
struct Moments {
  double volume = 0;
  std::array<double, 3> coordinate{};                   // int xi_k
  std::array<std::array<double, 3>, 3> product{};       // int xi_j xi_k
  std::array<double, 24> gradient{};                    // int dN_c/dx_a at 3 c + a
  std::array<std::array<double, 24>, 3> gradient_xi{};  // int dN_c/dx_a xi_k
  std::array<double, 576> gradient_pairs{};             // int dN_c/dx_a dN_d/dx_b, upper triangle by rows
};

Moments integrate(std::span<const MaterialPoint> points, Vec3 h) {
  Moments m;
  for (const MaterialPoint& point : points) {
    const double w = point.volume;
    const std::array<double, 3> xi = {point.xi.x, point.xi.y, point.xi.z};
    std::array<double, 24> g;
    for (int c = 0; c < 8; ++c) {
      const double fx = 1 + corner_sign(c, 0) * xi[0];
      const double fy = 1 + corner_sign(c, 1) * xi[1];
      const double fz = 1 + corner_sign(c, 2) * xi[2];
      g[3 * c + 0] = corner_sign(c, 0) * fy * fz / (4 * h.x);
      g[3 * c + 1] = corner_sign(c, 1) * fz * fx / (4 * h.y);
      g[3 * c + 2] = corner_sign(c, 2) * fx * fy / (4 * h.z);
    }
    m.volume += w;
    for (int k = 0; k < 3; ++k) {
      m.coordinate[k] += w * xi[k];
      for (int j = 0; j < 3; ++j) m.product[j][k] += w * xi[j] * xi[k];
    }
    for (int i = 0; i < 24; ++i) {
      const double wg = w * g[i];
      m.gradient[i] += wg;
      for (int k = 0; k < 3; ++k) m.gradient_xi[k][i] += wg * xi[k];
      // Start at a multiple of 4 so that the loop vectorises; what lies below the diagonal is not read.
      for (int j = i & ~3; j < 24; ++j) m.gradient_pairs[24 * i + j] += wg * g[j];
    }
  }
  return m;
}

double elasticity(int s, int t, double lambda, double mu) {
  if (s < 3 && t < 3) return lambda + (s == t ? 2 * mu : 0);
  return s == t ? mu : 0;
}

// B' C e_s for one corner with shape function gradient g and displacement axis a.
double stress_of_mode(const double* g, int a, int s, double lambda, double mu) {
  if (s < 3) return g[a] * (lambda + (a == s ? 2 * mu : 0));
  const int i = s - 3, j = (s - 2) % 3;  // xy, yz, zx
  if (a == i) return mu * g[j];
  if (a == j) return mu * g[i];
  return 0;
}

ElementMatrix matrix_of(const Moments& m, ElementFormulation formulation, const Material& material) {
  const double lambda = lame_lambda(material), mu = lame_mu(material);
  ElementMatrix k{};
  const auto pair = [&](int i, int j) { return m.gradient_pairs[i <= j ? 24 * i + j : 24 * j + i]; };
  for (int c = 0; c < 8; ++c)
    for (int d = c; d < 8; ++d) {
      double trace = 0;
      for (int a = 0; a < 3; ++a) trace += pair(3 * c + a, 3 * d + a);
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          k[24 * (3 * c + a) + 3 * d + b] = lambda * pair(3 * c + a, 3 * d + b) +
                                            mu * pair(3 * c + b, 3 * d + a) + (a == b ? mu * trace : 0);
    }
  if (formulation == ElementFormulation::kIncompatible && m.volume > 0) {
    // Mode k is e_s (xi_q - mean over the material of xi_q).
    std::array<double, 3> mean;
    for (int q = 0; q < 3; ++q) mean[q] = m.coordinate[q] / m.volume;
    std::array<std::array<double, 24>, 3> centred;  // int dN/dx (xi_q - mean_q)
    for (int q = 0; q < 3; ++q)
      for (int i = 0; i < 24; ++i) centred[q][i] = m.gradient_xi[q][i] - mean[q] * m.gradient[i];
    std::array<std::array<double, 24>, kModes> kau;
    std::array<std::array<double, kModes>, kModes> kaa;
    double largest = 0;
    for (int r = 0; r < kModes; ++r) {
      const int s = kModeStrain[r], q = kModeCoordinate[r];
      for (int c = 0; c < 8; ++c)
        for (int a = 0; a < 3; ++a) kau[r][3 * c + a] = stress_of_mode(&centred[q][3 * c], a, s, lambda, mu);
      for (int t = 0; t < kModes; ++t) {
        const int p = kModeCoordinate[t];
        kaa[r][t] =
            elasticity(s, kModeStrain[t], lambda, mu) * (m.product[q][p] - m.volume * mean[q] * mean[p]);
      }
      largest = std::max(largest, kaa[r][r]);
    }
    // Cholesky Kaa = L L', then K -= (L^-1 Kau)' (L^-1 Kau). A mode without material behind it is left out.
    for (int r = 0; r < kModes; ++r) kaa[r][r] += kCondensationRegularisation * largest;
    for (int r = 0; r < kModes; ++r) {
      for (int t = 0; t < r; ++t) {
        const double l = kaa[r][t];
        for (int i = 0; i < 24; ++i) kau[r][i] -= l * kau[t][i];
        kaa[r][r] -= l * l;
      }
      const double pivot = kaa[r][r];
      const double inverse = pivot > 0.5 * kCondensationRegularisation * largest ? 1 / std::sqrt(pivot) : 0;
      for (int i = 0; i < 24; ++i) kau[r][i] *= inverse;
      for (int u = r + 1; u < kModes; ++u) {
        double x = kaa[u][r];
        for (int t = 0; t < r; ++t) x -= kaa[u][t] * kaa[r][t];
        kaa[u][r] = x * inverse;
      }
    }
    for (int r = 0; r < kModes; ++r)
      for (int i = 0; i < 24; ++i) {
        const double x = kau[r][i];
        for (int j = i & ~3; j < 24; ++j) k[24 * i + j] -= x * kau[r][j];
      }
  }
  for (int i = 0; i < 24; ++i)
    for (int j = 0; j < i; ++j) k[24 * i + j] = k[24 * j + i];
  return k;
}

}  // namespace

std::array<double, 8> shape_functions(Vec3 xi) {
  std::array<double, 8> n;
  for (int c = 0; c < 8; ++c)
    n[c] = 0.125 * (1 + corner_sign(c, 0) * xi.x) * (1 + corner_sign(c, 1) * xi.y) *
           (1 + corner_sign(c, 2) * xi.z);
  return n;
}

std::array<MaterialPoint, 8> full_cell_points(Vec3 h) {
  const double g = 1 / std::sqrt(3.0), w = h.x * h.y * h.z / 8;
  std::array<MaterialPoint, 8> points;
  for (int c = 0; c < 8; ++c)
    points[c] = {g * Vec3{corner_sign(c, 0), corner_sign(c, 1), corner_sign(c, 2)}, w};
  return points;
}

std::array<MaterialPoint, 27> material_points_27(std::span<const double, 27> volumes) {
  const double g = std::sqrt(0.6);
  std::array<MaterialPoint, 27> points;
  for (int i = 0; i < 27; ++i) {
    const int x = i % 3 - 1, y = i / 3 % 3 - 1, z = i / 9 - 1;
    points[i] = {{g * x, g * y, g * z}, volumes[i]};
  }
  return points;
}

ElementMatrix element_matrix(ElementFormulation formulation, const Material& material, Vec3 h) {
  return matrix_of(integrate(full_cell_points(h), h), formulation, material);
}

ElementMatrix partly_filled_matrix(ElementFormulation formulation, const Material& material, Vec3 h,
                                   std::span<const MaterialPoint> points, double floor) {
  ElementMatrix k = matrix_of(integrate(points, h), formulation, material);
  if (floor > 0) {
    const ElementMatrix full = element_matrix(formulation, material, h);
    for (std::size_t i = 0; i < k.size(); ++i) k[i] += floor * full[i];
  }
  return k;
}

std::array<double, 8> lumped_masses(double density, std::span<const MaterialPoint> points) {
  std::array<double, 8> masses{};
  for (const MaterialPoint& point : points) {
    const std::array<double, 8> n = shape_functions(point.xi);
    for (int c = 0; c < 8; ++c) masses[c] += density * point.volume * n[c];
  }
  return masses;
}

std::array<double, 8> lumped_masses(double density, Vec3 h) {
  std::array<double, 8> masses;
  masses.fill(density * h.x * h.y * h.z / 8);
  return masses;
}

}  // namespace kerf
