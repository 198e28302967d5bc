// The stiffness of a full cell in Walsh-Hadamard form.
//
// A box has three mirror planes. In the modes u_m = sum over corners c of (-1)^popcount(m & c) u_c its 24 x
// 24 matrix falls into eight symmetric 3 x 3 blocks: block p couples (mode p^1, x), (mode p^2, y), (mode p^4,
// z). 48 numbers instead of 576, and 216 operations instead of 1152 for a product.
#pragma once

#include <array>

#include "kerf/mechanics/element.h"

namespace kerf {

/// Block p as xx, yy, zz, xy, yz, zx. K = H' blocks H, where H is the transform above (the 1/64 is inside).
struct WalshHadamardMatrix {
  std::array<std::array<double, 6>, 8> block{};
  /// K of corner 0 with itself, xx yy zz xy yz zx; corner c has the signs s_x s_y, s_y s_z, s_z s_x of its
  /// corner.
  std::array<double, 6> corner{};
};

/// Transforms a matrix with the box's three mirror symmetries; entries outside the blocks are dropped.
WalshHadamardMatrix walsh_hadamard(const ElementMatrix& matrix);
/// Largest entry outside the blocks relative to the largest inside: 0 but for rounding for any full box.
double walsh_hadamard_defect(const ElementMatrix& matrix);
/// Back to 24 x 24.
ElementMatrix dense(const WalshHadamardMatrix& matrix);

/// In-place transform of eight values per axis, u[corner][axis]; twice gives 8 u.
template <class T>
inline void walsh_hadamard_transform(T (&u)[8][3]) {
  for (int bit = 1; bit < 8; bit *= 2)
    for (int c = 0; c < 8; ++c)
      if ((c & bit) == 0)
        for (int a = 0; a < 3; ++a) {
          const T low = u[c][a], high = u[c | bit][a];
          u[c][a] = low + high;
          u[c | bit][a] = low - high;
        }
}

/// In-place product of the blocks with modes u[mode][axis].
template <class T>
inline void apply_blocks(const WalshHadamardMatrix& k, T (&u)[8][3]) {
  for (int p = 0; p < 8; ++p) {
    const std::array<double, 6>& b = k.block[p];
    const T x = u[p ^ 1][0], y = u[p ^ 2][1], z = u[p ^ 4][2];
    u[p ^ 1][0] = b[0] * x + b[3] * y + b[5] * z;
    u[p ^ 2][1] = b[3] * x + b[1] * y + b[4] * z;
    u[p ^ 4][2] = b[5] * x + b[4] * y + b[2] * z;
  }
}

}  // namespace kerf
