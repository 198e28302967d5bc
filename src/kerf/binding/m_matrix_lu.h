// LU factors of a sparse diagonally dominant M-matrix with symmetric pattern: the systems of the parametrisation (4.1.4).
// No pivoting is needed. Rows are ordered by approximate minimum degree, or nested dissection in large systems. About twice as fast as a general sparse LU.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/vec.h"

namespace kerf {

/// Row i: diagonal[i] and off-diagonal entries column[k], value[k] for k in first[i] .. first[i + 1], columns ascending. Where
/// there is an entry (i, j) there is one (j, i).
struct SparseRows {
  std::vector<std::int32_t> first, column;
  std::vector<double> value, diagonal;
};

class MMatrixLu {
 public:
  /// `points`: one per row, near each other where the rows are connected; large systems are ordered by halving space
  /// (nested dissection), which also keeps the work in cache. Returns false if a pivot is not positive (then the matrix is no
  /// non-singular M-matrix).
  bool factor(const SparseRows& a, std::span<const Vec3> points);
  /// Solves for two right-hand sides at once, in place.
  void solve(std::vector<Vec2>& x) const;

 private:
  struct Entry {
    double upper, lower;  ///< U(j, i) and L(i, j)
  };
  std::vector<std::int32_t> order_, first_, index_;  ///< order_: new -> old
  std::vector<Entry> entry_;
  std::vector<double> pivot_;
  mutable std::vector<Vec2> work_;
};

}  // namespace kerf
