// The rotation of a cell: the orthogonal polar factor of its deformation gradient, followed from step to
// step.
//
// Newton's method on the rotation: S = R'F, n = axial vector of S, H = tr(S) I - sym(S), w = H^-1 n, R <- R
// Cayley(w). Where H is not positive definite (near inversion) the step is n / (|tr S| + eps), after Mueller
// et al. 2016, "A robust method to extract the rotational part of deformations", which is slower and safer.
// |w| is capped. Two iterations per time step are wanted, not convergence: converging through an inversion
// freezes tangles that two iterations resolve.
#pragma once

#include <cmath>

#include "kerf/base/lanes.h"
#include "kerf/base/vec.h"

namespace kerf {

/// Longest rotation vector of one iteration, radians.
inline constexpr double kMaxRotationStep = 1.0;
/// Smallest pivot of H (which is dimensionless and 2 I at rest) that counts as positive definite.
inline constexpr double kMinRotationPivot = 1e-6;
/// Keeps the safe step finite for a vanishing deformation gradient.
inline constexpr double kRotationEpsilon = 1e-9;
/// Iterations per time step.
inline constexpr int kRotationIterations = 2;

namespace rotation_detail {
inline double select(bool m, double a, double b) { return m ? a : b; }
template <class Mask>
inline Lanes select(Mask m, const Lanes& a, const Lanes& b) {
  return m ? a : b;
}
inline double square_root(double x) { return std::sqrt(x); }
inline Lanes square_root(const Lanes& x) {
  return Lanes{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}
}  // namespace rotation_detail

/// One guarded Newton step of R (row, column) towards the polar factor of F; T is double or Lanes (four cells
/// at once).
template <class T>
inline void improve_rotation(const T (&f)[3][3], T (&r)[3][3]) {
  using rotation_detail::select;
  using rotation_detail::square_root;
  T s[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) s[i][j] = r[0][i] * f[0][j] + r[1][i] * f[1][j] + r[2][i] * f[2][j];
  const T n0 = s[2][1] - s[1][2], n1 = s[0][2] - s[2][0], n2 = s[1][0] - s[0][1];
  const T trace = s[0][0] + s[1][1] + s[2][2];
  const T h00 = trace - s[0][0], h11 = trace - s[1][1], h22 = trace - s[2][2];
  const T h01 = -0.5 * (s[0][1] + s[1][0]), h12 = -0.5 * (s[1][2] + s[2][1]), h02 = -0.5 * (s[2][0] + s[0][2]);
  // H^-1 n by cofactors; the leading minors tell whether H is positive definite.
  const T c00 = h11 * h22 - h12 * h12, c01 = h02 * h12 - h01 * h22, c02 = h01 * h12 - h02 * h11;
  const T c11 = h00 * h22 - h02 * h02, c12 = h01 * h02 - h00 * h12, c22 = h00 * h11 - h01 * h01;
  const T det = h00 * c00 + h01 * c01 + h02 * c02;
  const auto definite = (h00 > kMinRotationPivot) & (c22 > kMinRotationPivot * kMinRotationPivot) &
                        (det > kMinRotationPivot * kMinRotationPivot * kMinRotationPivot);
  const T absolute_trace = select(trace < 0.0 * trace, -trace, trace);
  const T one = 0.0 * trace + 1.0;
  const T newton = one / select(definite, det, one);
  const T safe = one / (absolute_trace + kRotationEpsilon);
  T w0 = select(definite, newton * (c00 * n0 + c01 * n1 + c02 * n2), safe * n0);
  T w1 = select(definite, newton * (c01 * n0 + c11 * n1 + c12 * n2), safe * n1);
  T w2 = select(definite, newton * (c02 * n0 + c12 * n1 + c22 * n2), safe * n2);
  const T length = square_root(w0 * w0 + w1 * w1 + w2 * w2);
  const T shrink = select(length > kMaxRotationStep * one, kMaxRotationStep / (length + kRotationEpsilon), one);
  // Cayley: the unit quaternion along (1, w / 2).
  w0 = 0.5 * shrink * w0;
  w1 = 0.5 * shrink * w1;
  w2 = 0.5 * shrink * w2;
  const T q2 = w0 * w0 + w1 * w1 + w2 * w2;
  const T scale = 2.0 / (1.0 + q2);
  const T w[3] = {w0, w1, w2};
  for (int i = 0; i < 3; ++i) {
    // r_i <- r_i Cayley: a row vector times the matrix, v + scale ((v x w)  ... ) written out with cross
    // products.
    const T v0 = r[i][0], v1 = r[i][1], v2 = r[i][2];
    const T x0 = v1 * w[2] - v2 * w[1], x1 = v2 * w[0] - v0 * w[2], x2 = v0 * w[1] - v1 * w[0];
    r[i][0] = v0 + scale * (x0 + (x1 * w[2] - x2 * w[1]));
    r[i][1] = v1 + scale * (x1 + (x2 * w[0] - x0 * w[2]));
    r[i][2] = v2 + scale * (x2 + (x0 * w[1] - x1 * w[0]));
  }
}

/// Removes the rounding that products of rotations collect: one step of R <- R (3 I - R'R) / 2.
template <class T>
inline void orthonormalise(T (&r)[3][3]) {
  T g[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      g[i][j] = -0.5 * (r[0][i] * r[0][j] + r[1][i] * r[1][j] + r[2][i] * r[2][j]) + (i == j ? 1.5 : 0.0);
  for (int i = 0; i < 3; ++i) {
    const T v0 = r[i][0], v1 = r[i][1], v2 = r[i][2];
    for (int j = 0; j < 3; ++j) r[i][j] = v0 * g[0][j] + v1 * g[1][j] + v2 * g[2][j];
  }
}

/// Polar factor of F starting from R: `iterations` guarded Newton steps and a clean-up.
Mat3 followed_rotation(const Mat3& deformation, const Mat3& start, int iterations = kRotationIterations);

}  // namespace kerf
