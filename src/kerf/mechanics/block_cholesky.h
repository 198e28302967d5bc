// Cholesky factorisation of a sparse symmetric matrix of 6 x 6 blocks: the coarse problem of the solver.
//
// Structure (elimination order, fill, list of updates) and numbers are apart: the structure changes with a
// cut, the numbers every step. A pivot that has lost all its digits is dropped, which leaves its freedom out:
// a group of nodes in a line has no rotation about it.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace kerf {

/// Doubles per stored block: 6 columns of 8, the last two rows are padding and stay zero.
inline constexpr std::size_t kBlockDoubles = 48;
/// Doubles per stored vector of one block row.
inline constexpr std::size_t kBlockRow = 8;
/// A pivot below this share of its diagonal entry is rounding.
inline constexpr double kDroppedPivot = 1e-10;

/// Replaces a symmetric positive block by the inverse of its lower triangular factor, and solves with that,
/// in place.
void factor_block(double* block);
void solve_block(const double* block, double* x);

struct BlockCholeskyStructure {
  struct Update {
    std::int32_t target, left, right;
  };  ///< target -= left right'
  std::int32_t rows = 0;
  std::vector<std::int32_t> position;      ///< row -> place in the elimination order
  std::vector<std::int32_t> order;         ///< place -> row
  std::vector<std::int32_t> column_begin;  ///< per place: its blocks below the diagonal; block b is b + rows in storage
  std::vector<std::int32_t> block_row;     ///< place of each of them, ascending within a column
  std::vector<std::int32_t> update_begin;  ///< per place
  std::vector<Update> updates;             ///< storage indices
  [[nodiscard]] std::size_t block_count() const { return static_cast<std::size_t>(rows) + block_row.size(); }
  /// Storage index of block (i, j); position[i] >= position[j]. The diagonal block of place p is p.
  [[nodiscard]] std::int32_t block(std::int32_t i, std::int32_t j) const;
  /// The same by places p >= q; -1 when it is not stored.
  [[nodiscard]] std::int32_t find_block(std::int32_t p, std::int32_t q) const;
};

/// Minimum degree order and fill for a graph given as pairs i < j, sorted, without repeats. O(rows^2 + fill).
BlockCholeskyStructure block_cholesky_structure(std::int32_t rows,
                                                const std::vector<std::pair<std::int32_t, std::int32_t>>& pairs);

/// The same with more rows at the end and more blocks, given as pairs of places p > q, in any order. The elimination order
/// of the old rows stays, so blocks that are zero change no bit of the others.
BlockCholeskyStructure extended(const BlockCholeskyStructure& base, std::int32_t more_rows,
                                const std::vector<std::pair<std::int32_t, std::int32_t>>& places);

/// Factors in place. blocks: block_count() x kBlockDoubles, column-major, the diagonal ones full; afterwards
/// the diagonal holds the inverse of its triangular factor.
void block_cholesky_factor(const BlockCholeskyStructure& structure, std::vector<double>& blocks);

/// Solves in place; x: rows x kBlockRow *by place in the elimination order*, padding zero.
void block_cholesky_solve(const BlockCholeskyStructure& structure, const std::vector<double>& blocks,
                          std::vector<double>& x);

}  // namespace kerf
