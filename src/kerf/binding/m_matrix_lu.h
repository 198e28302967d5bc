// Solves with a sparse diagonally dominant M-matrix with symmetric pattern by LU: the systems of the parametrisation (4.1.4). No
// pivoting is needed. Multifrontal (Duff and Reid 1983) on a nested dissection: small dense matrices, many entries at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/binding/dissection.h"

namespace kerf {

/// Row i: diagonal[i] and off-diagonal entries column[k], value[k] for k in first[i] .. first[i + 1], columns ascending. Where
/// there is an entry (i, j) there is one (j, i).
struct SparseRows {
  std::vector<std::int32_t> first, column;
  std::vector<double> value, diagonal;
};

/// Keeps its memory from one system to the next.
class MMatrixLu {
 public:
  /// Solves for two right-hand sides at once, in place. `points`: one per row, near each other where the rows are connected.
  /// Returns false if a pivot is not positive (then the matrix is no non-singular M-matrix); x is left alone.
  bool solve(const SparseRows& a, std::span<const Vec3> points, std::vector<Vec2>& x);

 private:
  /// A dense matrix: a node's own rows (padded to whole lanes), then rows of its ancestors that they are coupled to, then the
  /// right-hand sides as two more columns.
  struct Front {
    std::int32_t begin, end;           ///< own rows, by rank
    std::int32_t others, other_count;  ///< ranks of the ancestors' rows: others_[others] ..., ascending
    std::size_t upper;                 ///< where its rows of U are kept
    [[nodiscard]] std::size_t own() const { return static_cast<std::size_t>(end - begin); }
  };
  void analyse(const SparseRows& a, std::span<const Vec3> points);
  void find_others(const SparseRows& a, std::size_t node);
  void assemble(const SparseRows& a, const std::vector<Vec2>& x, std::size_t node);
  void add_child(const Front& child, const Front& parent, const double* from, double* remainder);
  bool eliminate(const Front& front, double* remainder);
  void substitute(const Front& front);
  std::vector<double>& remainder_of(std::size_t node);

  Dissection dissection_;
  std::vector<std::int32_t> rank_, place_, mark_, others_;  ///< place_: column of a rank in the front at work
  std::vector<double> transposed_;                          ///< value of the entry (j, i) for the entry (i, j)
  std::vector<Front> fronts_;
  std::vector<double> upper_;                   ///< rows of U of all fronts, with 1 / pivot on the diagonal
  std::vector<double> lower_;                   ///< columns of L of the front at work, as rows
  std::vector<std::vector<double>> remainder_;  ///< what is left for the parent: one per depth and side
  std::vector<std::uint32_t> target_;           ///< columns of a child's front in its parent's
  std::vector<double> column_;                  ///< scratch of the last step
  std::vector<Vec2> solution_;                  ///< by rank
};

}  // namespace kerf
