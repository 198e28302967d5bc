#include "kerf/mechanics/element_wht.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kerf {
namespace {

double walsh(int mode, int corner) { return std::popcount(static_cast<unsigned>(mode & corner)) % 2 != 0 ? -1.0 : 1.0; }

// (H / 8) K (H / 8)'
ElementMatrix transformed(const ElementMatrix& k) {
  ElementMatrix half{}, out{};
  for (int m = 0; m < 8; ++m)
    for (int c = 0; c < 8; ++c)
      for (int a = 0; a < 3; ++a)
        for (int j = 0; j < 24; ++j) half[24 * (3 * m + a) + j] += walsh(m, c) / 8 * k[24 * (3 * c + a) + j];
  for (int i = 0; i < 24; ++i)
    for (int m = 0; m < 8; ++m)
      for (int c = 0; c < 8; ++c)
        for (int a = 0; a < 3; ++a) out[24 * i + 3 * m + a] += half[24 * i + 3 * c + a] * walsh(m, c) / 8;
  return out;
}

constexpr int block_dof(int p, int axis) { return 3 * (p ^ (1 << axis)) + axis; }

}  // namespace

WalshHadamardMatrix walsh_hadamard(const ElementMatrix& matrix) {
  const ElementMatrix t = transformed(matrix);
  WalshHadamardMatrix out;
  for (int p = 0; p < 8; ++p) {
    const auto entry = [&](int a, int b) { return t[24 * block_dof(p, a) + block_dof(p, b)]; };
    out.block[p] = {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(2, 0)};
  }
  out.corner = {matrix[0], matrix[24 + 1], matrix[48 + 2], matrix[1], matrix[24 + 2], matrix[2]};
  return out;
}

double walsh_hadamard_defect(const ElementMatrix& matrix) {
  const ElementMatrix t = transformed(matrix);
  double inside = 0, outside = 0;
  for (int i = 0; i < 24; ++i)
    for (int j = 0; j < 24; ++j) {
      const int p = i / 3 ^ (1 << i % 3), q = j / 3 ^ (1 << j % 3);
      double& largest = p == q ? inside : outside;
      largest = std::max(largest, std::abs(t[24 * i + j]));
    }
  return inside > 0 ? outside / inside : 0;
}

ElementMatrix dense(const WalshHadamardMatrix& matrix) {
  ElementMatrix k;
  for (int column = 0; column < 24; ++column) {
    double u[8][3] = {};
    u[column / 3][column % 3] = 1;
    walsh_hadamard_transform(u);
    apply_blocks(matrix, u);
    walsh_hadamard_transform(u);
    for (int row = 0; row < 24; ++row) k[24 * row + column] = u[row / 3][row % 3];
  }
  return k;
}

}  // namespace kerf
