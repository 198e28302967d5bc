#include "kerf/mechanics/element.h"

#include <algorithm>
#include <cmath>

namespace kerf {
namespace {

const double kPoint = std::sqrt(0.6);  // of the three-point Gauss rule
constexpr int kModes = 9;
// Strain mode k: strain component kModeStrain[k] varies with natural coordinate kModeCoordinate[k].
constexpr std::array<int, kModes> kModeStrain = {0, 1, 2, 3, 3, 4, 4, 5, 5};
constexpr std::array<int, kModes> kModeCoordinate = {0, 1, 2, 0, 1, 1, 2, 0, 2};

// The element is set up for the amplitudes of the eight products P_m = xi^i eta^j zeta^k, with i, j, k the bits of m, instead of the
// corners: N_c is an eighth of their sum with the signs of corner c. There a pair of shape function gradients is one
// monomial, so the integrals over the material are its 27 moments, and the way back to the corners adds and subtracts.
// Amplitude 3 m + axis; those of m = 0 are rigid motions.

// int xi^i eta^j zeta^k at i + 3 j + 9 k, i, j, k <= 2; the last stays zero.
using Moments = std::array<double, 28>;
constexpr std::size_t kNothing = 27;
constexpr std::array<std::size_t, 3> kStride = {1, 3, 9};

// P_m's exponents in a moment's number.
constexpr std::size_t exponents(std::size_t m) { return (m & 1) * 1 + (m >> 1 & 1) * 3 + (m >> 2 & 1) * 9; }
// Does P_m vary along xi_a?
constexpr bool varies(std::size_t m, std::size_t a) { return (m >> a & 1) != 0; }
// The number of int dP_m/dxi_a dP_n/dxi_b, at [3 m + a][3 n + b].
constexpr auto kPair = [] {
  std::array<std::array<std::uint8_t, 24>, 24> t{};
  for (std::size_t i = 0; i < 24; ++i)
    for (std::size_t j = 0; j < 24; ++j) {
      const std::size_t m = i / 3, a = i % 3, n = j / 3, b = j % 3;
      t[i][j] = static_cast<std::uint8_t>(
          varies(m, a) && varies(n, b) ? exponents(m) - kStride[a] + exponents(n) - kStride[b] : kNothing);
    }
  return t;
}();

Moments moments_of(std::span<const MaterialPoint> points) {
  std::array<std::array<double, 4>, 9> sum{};  // the fourth lane is idle
  for (const MaterialPoint& point : points) {
    const std::array<double, 4> x = {1, point.xi.x, point.xi.x * point.xi.x, 0};
    double wz = point.volume;
    for (std::size_t k = 0; k < 3; ++k, wz *= point.xi.z) {
      double wyz = wz;
      for (std::size_t j = 0; j < 3; ++j, wyz *= point.xi.y)
        for (std::size_t i = 0; i < 4; ++i) sum[3 * k + j][i] += wyz * x[i];
    }
  }
  Moments m{};
  for (std::size_t i = 0; i < 27; ++i) m[i] = sum[i / 3][i % 3];
  return m;
}

// Values at the three Gauss points along one axis to moments along it.
template <std::size_t kStep>
void values_to_moments(Moments& m) {
  for (std::size_t block = 0; block < 27; block += 3 * kStep)
    for (std::size_t i = block; i < block + kStep; ++i) {
      const double low = m[i], middle = m[i + kStep], high = m[i + 2 * kStep];
      m[i] = low + middle + high;
      m[i + kStep] = kPoint * (high - low);
      m[i + 2 * kStep] = kPoint * kPoint * (high + low);
    }
}

Moments moments_of(const std::array<double, 27>& volumes) {
  Moments m{};
  std::copy(volumes.begin(), volumes.end(), m.begin());
  values_to_moments<kStride[0]>(m);
  values_to_moments<kStride[1]>(m);
  values_to_moments<kStride[2]>(m);
  return m;
}

// From amplitudes to corners, along the rows of a matrix [8][kWidth].
template <std::size_t kWidth>
void to_corners(double* rows) {
  for (std::size_t bit = 1; bit < 8; bit *= 2)
    for (std::size_t m = 0; m < 8; ++m) {
      if ((m & bit) != 0) continue;
      double *one = rows + m * kWidth, *other = rows + (m | bit) * kWidth;
      for (std::size_t i = 0; i < kWidth; ++i) {
        const double even = one[i], odd = other[i];
        one[i] = even - odd;
        other[i] = even + odd;
      }
    }
}

// Row sums of the consistent mass matrix.
std::array<double, 8> masses_of(double density, const Moments& m) {
  std::array<double, 8> masses;
  for (std::size_t p = 0; p < 8; ++p) masses[p] = 0.125 * density * m[exponents(p)];
  to_corners<1>(masses.data());
  return masses;
}

double elasticity(int s, int t, double lambda, double mu) {
  if (s < 3 && t < 3) return lambda + (s == t ? 2 * mu : 0);
  return s == t ? mu : 0;
}

// B' C e_s for one amplitude with gradient g and displacement axis a.
double stress_of_mode(const double* g, int a, int s, double lambda, double mu) {
  if (s < 3) return g[a] * (lambda + (a == s ? 2 * mu : 0));
  const int i = s - 3, j = (s - 2) % 3;  // xy, yz, zx
  if (a == i) return mu * g[j];
  if (a == j) return mu * g[i];
  return 0;
}

// Takes the enhanced strains of the incompatible modes out of the matrix; m is not empty.
void condense(const Moments& m, Vec3 slope, double lambda, double mu, ElementMatrix& k) {
  // Mode r is e_s (xi_q - mean over the material of xi_q).
  std::array<double, 3> mean;
  for (std::size_t q = 0; q < 3; ++q) mean[q] = m[kStride[q]] / m[0];
  std::array<std::array<double, 24>, 3> centred{};  // int dP/dx (xi_q - mean_q)
  for (std::size_t q = 0; q < 3; ++q)
    for (std::size_t i = 3; i < 24; ++i) {
      const std::size_t a = i % 3;
      if (!varies(i / 3, a)) continue;
      const std::size_t gradient = exponents(i / 3) - kStride[a];
      centred[q][i] = slope[static_cast<int>(a)] * (m[gradient + kStride[q]] - mean[q] * m[gradient]);
    }
  std::array<std::array<double, 24>, kModes> kau;
  std::array<std::array<double, kModes>, kModes> kaa;
  double largest = 0;
  for (int r = 0; r < kModes; ++r) {
    const int s = kModeStrain[r], q = kModeCoordinate[r];
    for (int n = 0; n < 8; ++n)
      for (int a = 0; a < 3; ++a) kau[r][3 * n + a] = stress_of_mode(&centred[q][3 * n], a, s, lambda, mu);
    for (int t = 0; t < kModes; ++t) {
      const int p = kModeCoordinate[t];
      kaa[r][t] = elasticity(s, kModeStrain[t], lambda, mu) * (m[kStride[q] + kStride[p]] - m[0] * mean[q] * mean[p]);
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
  for (int i = 3; i < 24; ++i)  // the first three are zero
    for (int r = 0; r < kModes; ++r) {
      const double x = kau[r][i];
      // Start at a multiple of 4 so that the loop vectorises; what lies below the diagonal is not read.
      for (int j = i & ~3; j < 24; ++j) k[24 * i + j] -= x * kau[r][j];
    }
}

ElementMatrix matrix_of(Moments m, ElementFormulation formulation, const Material& material, Vec3 h) {
  const double lambda = lame_lambda(material), mu = lame_mu(material);
  for (double& x : m) x *= 1.0 / 64;  // of N_c N_d
  const Vec3 slope{2 / h.x, 2 / h.y, 2 / h.z};
  std::array<double, 9> first, second;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      first[3 * a + b] = lambda * (slope[a] * slope[b]);
      second[3 * a + b] = mu * (slope[a] * slope[b]);
    }
  ElementMatrix k{};
  for (std::size_t p = 1; p < 8; ++p)
    for (std::size_t n = p; n < 8; ++n) {
      double trace = 0;
      for (std::size_t a = 0; a < 3; ++a) trace += second[4 * a] * m[kPair[3 * p + a][3 * n + a]];
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
          k[24 * (3 * p + a) + 3 * n + b] = first[3 * a + b] * m[kPair[3 * p + a][3 * n + b]] +
                                            second[3 * a + b] * m[kPair[3 * p + b][3 * n + a]] + (a == b ? trace : 0);
    }
  if (formulation == ElementFormulation::kIncompatible && m[0] > 0) condense(m, slope, lambda, mu, k);
  for (int i = 0; i < 24; ++i)
    for (int j = 0; j < i; ++j) k[24 * i + j] = k[24 * j + i];
  to_corners<72>(k.data());
  ElementMatrix turned;
  for (int i = 0; i < 24; ++i)
    for (int j = 0; j < 24; ++j) turned[24 * j + i] = k[24 * i + j];
  to_corners<72>(turned.data());
  for (int i = 0; i < 24; ++i)
    for (int j = 0; j < i; ++j) turned[24 * i + j] = turned[24 * j + i];
  return turned;
}

void add(double factor, const ElementMatrix& from, ElementMatrix& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += factor * from[i];
}

}  // namespace

std::array<double, 8> shape_functions(Vec3 xi) {
  std::array<double, 8> n;
  for (int c = 0; c < 8; ++c)
    n[c] = 0.125 * (1 + corner_sign(c, 0) * xi.x) * (1 + corner_sign(c, 1) * xi.y) * (1 + corner_sign(c, 2) * xi.z);
  return n;
}

std::array<MaterialPoint, 8> full_cell_points(Vec3 h) {
  const double g = 1 / std::sqrt(3.0), w = h.x * h.y * h.z / 8;
  std::array<MaterialPoint, 8> points;
  for (int c = 0; c < 8; ++c) points[c] = {g * Vec3{corner_sign(c, 0), corner_sign(c, 1), corner_sign(c, 2)}, w};
  return points;
}

std::array<MaterialPoint, 27> material_points_27(std::span<const double, 27> volumes) {
  const double g = kPoint;
  std::array<MaterialPoint, 27> points;
  for (int i = 0; i < 27; ++i) {
    const int x = i % 3 - 1, y = i / 3 % 3 - 1, z = i / 9 - 1;
    points[i] = {{g * x, g * y, g * z}, volumes[i]};
  }
  return points;
}

ElementMatrix element_matrix(ElementFormulation formulation, const Material& material, Vec3 h) {
  return matrix_of(moments_of(full_cell_points(h)), formulation, material, h);
}

ElementMatrix partly_filled_matrix(ElementFormulation formulation, const Material& material, Vec3 h,
                                   std::span<const MaterialPoint> points, double floor) {
  ElementMatrix k = matrix_of(moments_of(points), formulation, material, h);
  if (floor > 0) add(floor, element_matrix(formulation, material, h), k);
  return k;
}

ElementMatrix partly_filled_matrix(ElementFormulation formulation, const Material& material, Vec3 h,
                                   const std::array<double, 27>& volumes, const ElementMatrix& full) {
  ElementMatrix k = matrix_of(moments_of(volumes), formulation, material, h);
  add(kStiffnessFloor, full, k);
  return k;
}

std::array<double, 8> lumped_masses(double density, std::span<const MaterialPoint> points) {
  return masses_of(density, moments_of(points));
}

std::array<double, 8> lumped_masses(double density, const std::array<double, 27>& volumes) {
  return masses_of(density, moments_of(volumes));
}

std::array<double, 8> lumped_masses(double density, Vec3 h) {
  std::array<double, 8> masses;
  masses.fill(density * h.x * h.y * h.z / 8);
  return masses;
}

}  // namespace kerf
