#include "kerf/binding/m_matrix_lu.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

#include <algorithm>

namespace kerf {
namespace {

/// Rows from which nested dissection beats minimum degree (measured on patches of sheets), and where it stops halving.
constexpr std::size_t kDissect = 600, kLeaf = 8;

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

void minimum_degree(const SparseRows& a, std::vector<std::int32_t>& order) {
  const auto n = static_cast<std::int32_t>(a.diagonal.size());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, std::int32_t> p;
  Eigen::SparseMatrix<double, Eigen::ColMajor, std::int32_t> pattern(n, n);
  pattern.reserve(static_cast<Eigen::Index>(a.column.size()));
  for (std::int32_t j = 0; j < n; ++j) {
    pattern.startVec(j);
    for (std::int32_t k = a.first[at(j)]; k < a.first[at(j) + 1]; ++k) pattern.insertBack(a.column[at(k)], j) = 1;
  }
  pattern.finalize();
  Eigen::AMDOrdering<std::int32_t> amd;
  amd(pattern.selfadjointView<Eigen::Lower>(), p);  // only one triangle is read: the pattern is symmetric
  order.assign(p.indices().data(), p.indices().data() + n);
}

/// Halves the rows at the median of their longest direction; rows of the second half next to the first separate them and
/// come last.
class NestedDissection {
 public:
  NestedDissection(const SparseRows& a, std::span<const Vec3> points, std::vector<std::int32_t>& order)
      : a_(a), points_(points), order_(order), part_(points.size(), 0) {}

  void run() {
    order_.resize(points_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<std::int32_t>(i);
    order(0, order_.size());
  }

 private:
  void order(std::size_t begin, std::size_t end) {
    while (end - begin > kLeaf) {
      Box3 box;
      for (std::size_t i = begin; i < end; ++i) box.add(points_[at(order_[i])]);
      const Vec3 size = box.size();
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      const auto less = [&](std::int32_t i, std::int32_t j) {
        const double x = points_[at(i)][axis], y = points_[at(j)][axis];
        return x != y ? x < y : i < j;
      };
      const std::size_t middle = begin + (end - begin) / 2;
      const auto first = order_.begin();
      std::nth_element(first + static_cast<std::ptrdiff_t>(begin), first + static_cast<std::ptrdiff_t>(middle),
                       first + static_cast<std::ptrdiff_t>(end), less);
      ++stamp_;
      for (std::size_t i = begin; i < middle; ++i) part_[at(order_[i])] = stamp_;
      const auto apart = [&](std::int32_t row) {
        for (std::int32_t k = a_.first[at(row)]; k < a_.first[at(row) + 1]; ++k)
          if (part_[at(a_.column[at(k)])] == stamp_) return false;
        return true;
      };
      const auto separator = std::stable_partition(first + static_cast<std::ptrdiff_t>(middle), first + static_cast<std::ptrdiff_t>(end), apart);
      order(begin, middle);
      begin = middle;
      end = static_cast<std::size_t>(separator - first);
    }
  }
  const SparseRows& a_;
  std::span<const Vec3> points_;
  std::vector<std::int32_t>& order_;
  std::vector<std::int32_t> part_;
  std::int32_t stamp_ = 0;
};

}  // namespace

bool MMatrixLu::factor(const SparseRows& a, std::span<const Vec3> points) {
  const auto n = static_cast<std::int32_t>(a.diagonal.size());
  const std::size_t un = a.diagonal.size();
  if (un < kDissect) {
    minimum_degree(a, order_);
  } else {
    NestedDissection(a, points, order_).run();
  }
  std::vector<std::int32_t> rank(un);
  for (std::int32_t k = 0; k < n; ++k) rank[at(order_[at(k)])] = k;

  // Value of the transposed entry: rows are sorted, so a sweep over rows meets the entries of every column in order.
  std::vector<double> transposed(a.value.size());
  {
    std::vector<std::int32_t> cursor(a.first.begin(), a.first.end() - 1);
    for (std::int32_t i = 0; i < n; ++i)
      for (std::int32_t k = a.first[at(i)]; k < a.first[at(i) + 1]; ++k) transposed[at(cursor[at(a.column[at(k)])]++)] = a.value[at(k)];
  }

  // Elimination tree and column counts (Davis, Direct Methods for Sparse Linear Systems, chapter 4).
  std::vector<std::int32_t> parent(un, -1), mark(un, -1), count(un, 0);
  for (std::int32_t k = 0; k < n; ++k) {
    mark[at(k)] = k;
    const std::int32_t row = order_[at(k)];
    for (std::int32_t p = a.first[at(row)]; p < a.first[at(row) + 1]; ++p)
      for (std::int32_t i = rank[at(a.column[at(p)])]; i < k && mark[at(i)] != k; i = parent[at(i)]) {
        if (parent[at(i)] < 0) parent[at(i)] = k;
        ++count[at(i)];
        mark[at(i)] = k;
      }
  }
  first_.assign(un + 1, 0);
  for (std::size_t i = 0; i < un; ++i) first_[i + 1] = first_[i] + count[i];
  index_.resize(at(first_.back()));
  entry_.resize(at(first_.back()));
  pivot_.assign(un, 0);

  // Up-looking: row k of L and column k of U together; their patterns are the same.
  struct Pair {
    double row = 0, column = 0;
  };
  std::vector<Pair> work(un);
  std::vector<std::int32_t> pattern(un), end(first_.begin(), first_.end() - 1);
  std::fill(mark.begin(), mark.end(), -1);
  for (std::int32_t k = 0; k < n; ++k) {
    mark[at(k)] = k;
    std::int32_t top = n;
    const std::int32_t row = order_[at(k)];
    for (std::int32_t p = a.first[at(row)]; p < a.first[at(row) + 1]; ++p) {
      std::int32_t i = rank[at(a.column[at(p)])];
      if (i > k) continue;
      work[at(i)] = {a.value[at(p)], transposed[at(p)]};
      std::int32_t length = 0;
      for (; mark[at(i)] != k; i = parent[at(i)]) {
        pattern[at(length++)] = i;
        mark[at(i)] = k;
      }
      while (length > 0) pattern[at(--top)] = pattern[at(--length)];
    }
    double d = a.diagonal[at(row)];
    for (std::int32_t q = top; q < n; ++q) {
      const std::int32_t j = pattern[at(q)];
      const double l = work[at(j)].row / pivot_[at(j)], u = work[at(j)].column;
      work[at(j)] = {};
      const std::int32_t stop = end[at(j)];
      for (std::int32_t p = first_[at(j)]; p < stop; ++p) {
        Pair& target = work[at(index_[at(p)])];
        target.row -= l * entry_[at(p)].upper;
        target.column -= entry_[at(p)].lower * u;
      }
      d -= l * u;
      index_[at(stop)] = k;
      entry_[at(stop)] = {u, l};
      ++end[at(j)];
    }
    if (!(d > 0)) return false;
    pivot_[at(k)] = d;
  }
  return true;
}

void MMatrixLu::solve(std::vector<Vec2>& x) const {
  const std::size_t n = pivot_.size();
  work_.resize(n);
  for (std::size_t k = 0; k < n; ++k) work_[k] = x[at(order_[k])];
  for (std::size_t j = 0; j < n; ++j)
    for (std::int32_t p = first_[j]; p < first_[j + 1]; ++p) work_[at(index_[at(p)])] = work_[at(index_[at(p)])] - entry_[at(p)].lower * work_[j];
  for (std::size_t j = n; j-- > 0;) {
    Vec2 sum = work_[j];
    for (std::int32_t p = first_[j]; p < first_[j + 1]; ++p) sum = sum - entry_[at(p)].upper * work_[at(index_[at(p)])];
    work_[j] = (1 / pivot_[j]) * sum;
  }
  for (std::size_t k = 0; k < n; ++k) x[at(order_[k])] = work_[k];
}

}  // namespace kerf
