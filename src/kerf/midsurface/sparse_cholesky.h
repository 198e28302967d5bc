// Symmetric positive definite systems, factored once and solved often.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace kerf::mid {

struct SparseEntry {
  std::int32_t row, column;
  double value;
};

class SparseCholesky {
 public:
  /// entries: the lower triangle (row >= column); values at the same place are added.
  SparseCholesky(std::int32_t size, const std::vector<SparseEntry>& entries);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// False if the matrix was not positive definite.
  [[nodiscard]] bool ok() const;
  /// x := A^-1 b, both of the matrix's size; may be the same memory.
  void solve(std::span<const double> b, std::span<double> x) const;
  /// y := A x.
  void multiply(std::span<const double> x, std::span<double> y) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf::mid
