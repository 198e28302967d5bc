#include "kerf/midsurface/sparse_cholesky.h"

#include <Eigen/SparseCholesky>

namespace kerf::mid {

struct SparseCholesky::Impl {
  Eigen::SparseMatrix<double> lower;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor;
};

SparseCholesky::SparseCholesky(std::int32_t size, const std::vector<SparseEntry>& entries)
    : impl_(std::make_unique<Impl>()) {
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(entries.size());
  for (const SparseEntry& e : entries) triplets.emplace_back(e.row, e.column, e.value);
  impl_->lower.resize(size, size);
  impl_->lower.setFromTriplets(triplets.begin(), triplets.end());
  impl_->factor.compute(impl_->lower);
}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

bool SparseCholesky::ok() const {
  return impl_->factor.info() == Eigen::Success && (impl_->factor.vectorD().array() > 0).all();
}

void SparseCholesky::solve(std::span<const double> b, std::span<double> x) const {
  const Eigen::Map<const Eigen::VectorXd> right(b.data(), static_cast<Eigen::Index>(b.size()));
  Eigen::Map<Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size())) = impl_->factor.solve(right).eval();
}

void SparseCholesky::multiply(std::span<const double> x, std::span<double> y) const {
  const Eigen::Map<const Eigen::VectorXd> v(x.data(), static_cast<Eigen::Index>(x.size()));
  Eigen::Map<Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size())).noalias() =
      impl_->lower.selfadjointView<Eigen::Lower>() * v;
}

}  // namespace kerf::mid
