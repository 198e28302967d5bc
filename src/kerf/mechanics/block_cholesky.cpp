#include "kerf/mechanics/block_cholesky.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/check.h"
#include "kerf/base/lanes.h"

namespace kerf {
namespace {

// c -= a b'
inline void subtract_product(double* c, const double* a, const double* b) {
  for (int j = 0; j < 6; ++j) {
    Lanes low = load_lanes(c + 8 * j), high = load_lanes(c + 8 * j + 4);
    for (int k = 0; k < 6; ++k) {
      const double x = b[8 * k + j];
      low -= x * load_lanes(a + 8 * k);
      high -= x * load_lanes(a + 8 * k + 4);
    }
    store_lanes(c + 8 * j, low);
    store_lanes(c + 8 * j + 4, high);
  }
}

// c <- c m' with lower triangular m
inline void times_transposed(double* c, const double* m) {
  double out[kBlockDoubles];
  for (int j = 0; j < 6; ++j) {
    Lanes low = all_lanes(0), high = all_lanes(0);
    for (int k = 0; k <= j; ++k) {
      const double x = m[8 * k + j];
      low += x * load_lanes(c + 8 * k);
      high += x * load_lanes(c + 8 * k + 4);
    }
    store_lanes(out + 8 * j, low);
    store_lanes(out + 8 * j + 4, high);
  }
  std::copy(out, out + kBlockDoubles, c);
}

inline double sum_of(const Lanes& v) { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace

void factor_block(double* a) {
  double l[6][6] = {}, diagonal[6], inverse[6];
  for (int i = 0; i < 6; ++i) diagonal[i] = a[8 * i + i];
  for (int j = 0; j < 6; ++j) {
    double pivot = a[8 * j + j];
    for (int k = 0; k < j; ++k) pivot -= l[j][k] * l[j][k];
    inverse[j] = pivot > kDroppedPivot * diagonal[j] && pivot > 0 ? 1 / std::sqrt(pivot) : 0;
    for (int i = j + 1; i < 6; ++i) {
      double x = a[8 * j + i];
      for (int k = 0; k < j; ++k) x -= l[i][k] * l[j][k];
      l[i][j] = x * inverse[j];
    }
  }
  std::fill(a, a + kBlockDoubles, 0.0);
  for (int j = 0; j < 6; ++j) {
    a[8 * j + j] = inverse[j];
    for (int i = j + 1; i < 6; ++i) {
      double x = 0;
      for (int k = j; k < i; ++k) x += l[i][k] * a[8 * j + k];
      a[8 * j + i] = -inverse[i] * x;
    }
  }
}

void solve_block(const double* m, double* x) {
  double y[6];
  for (int i = 0; i < 6; ++i) {
    y[i] = 0;
    for (int k = 0; k <= i; ++k) y[i] += m[8 * k + i] * x[k];
  }
  for (int i = 0; i < 6; ++i) {
    x[i] = 0;
    for (int k = i; k < 6; ++k) x[i] += m[8 * i + k] * y[k];
  }
}

std::int32_t BlockCholeskyStructure::block(std::int32_t i, std::int32_t j) const {
  const std::int32_t found = find_block(position[i], position[j]);
  KERF_ASSERT(found >= 0);
  return found;
}

std::int32_t BlockCholeskyStructure::find_block(std::int32_t p, std::int32_t q) const {
  if (p == q) return p;
  KERF_ASSERT(p > q);
  const auto begin = block_row.begin() + column_begin[q], end = block_row.begin() + column_begin[q + 1];
  const auto at = std::lower_bound(begin, end, p);
  if (at == end || *at != p) return -1;
  return rows + static_cast<std::int32_t>(at - block_row.begin());
}

namespace {

/// Columns (sorted places below the diagonal, fill included) into the structure, with the list of updates.
void store_columns(const std::vector<std::vector<std::int32_t>>& column, BlockCholeskyStructure& s) {
  s.column_begin.push_back(0);
  for (const auto& list : column) {
    s.block_row.insert(s.block_row.end(), list.begin(), list.end());
    s.column_begin.push_back(static_cast<std::int32_t>(s.block_row.size()));
  }
  s.update_begin.push_back(0);
  for (std::int32_t q = 0; q < s.rows; ++q) {
    for (std::int32_t a = s.column_begin[q]; a < s.column_begin[q + 1]; ++a)
      for (std::int32_t b = s.column_begin[q]; b <= a; ++b)
        s.updates.push_back({s.find_block(s.block_row[a], s.block_row[b]), s.rows + a, s.rows + b});
    s.update_begin.push_back(static_cast<std::int32_t>(s.updates.size()));
  }
}

}  // namespace

BlockCholeskyStructure extended(const BlockCholeskyStructure& base, std::int32_t more_rows,
                                const std::vector<std::pair<std::int32_t, std::int32_t>>& places) {
  BlockCholeskyStructure s;
  s.rows = base.rows + more_rows;
  s.position = base.position;
  s.order = base.order;
  for (std::int32_t r = base.rows; r < s.rows; ++r) {
    s.position.push_back(r);
    s.order.push_back(r);
  }
  std::vector<std::vector<std::int32_t>> column(static_cast<std::size_t>(s.rows));
  for (std::int32_t q = 0; q < base.rows; ++q)
    column[q].assign(base.block_row.begin() + base.column_begin[q], base.block_row.begin() + base.column_begin[q + 1]);
  for (const auto& [p, q] : places) column[q].push_back(p);
  for (auto& list : column) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  // Fill: what is below the first entry of a column gets the rest of it.
  std::vector<std::int32_t> merged;
  for (auto& list : column) {
    if (list.size() < 2) continue;
    auto& parent = column[list.front()];
    merged.clear();
    std::set_union(parent.begin(), parent.end(), list.begin() + 1, list.end(), std::back_inserter(merged));
    parent = merged;
  }
  store_columns(column, s);
  return s;
}

BlockCholeskyStructure block_cholesky_structure(std::int32_t rows,
                                                const std::vector<std::pair<std::int32_t, std::int32_t>>& pairs) {
  BlockCholeskyStructure s;
  s.rows = rows;
  std::vector<std::vector<std::int32_t>> neighbours(rows);  // in the graph of what is not yet eliminated, sorted
  for (const auto& [i, j] : pairs) {
    neighbours[i].push_back(j);
    neighbours[j].push_back(i);
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  s.position.assign(rows, -1);
  std::vector<std::vector<std::int32_t>> column(rows);  // per place, rows at first
  std::vector<std::int32_t> merged;
  for (std::int32_t place = 0; place < rows; ++place) {
    std::int32_t best = -1;
    for (std::int32_t i = 0; i < rows; ++i)
      if (s.position[i] < 0 && (best < 0 || neighbours[i].size() < neighbours[best].size())) best = i;
    s.position[best] = place;
    s.order.push_back(best);
    const std::vector<std::int32_t> clique = std::move(neighbours[best]);
    for (std::int32_t i : clique) {
      merged.clear();
      std::set_union(neighbours[i].begin(), neighbours[i].end(), clique.begin(), clique.end(),
                     std::back_inserter(merged));
      neighbours[i].clear();
      for (std::int32_t k : merged)
        if (k != i && k != best) neighbours[i].push_back(k);
    }
    column[place] = clique;
  }
  for (auto& list : column) {
    for (std::int32_t& i : list) i = s.position[i];
    std::sort(list.begin(), list.end());
  }
  store_columns(column, s);
  return s;
}

void block_cholesky_factor(const BlockCholeskyStructure& s, std::vector<double>& blocks) {
  double* const data = blocks.data();
  for (std::int32_t q = 0; q < s.rows; ++q) {
    double* diagonal = data + kBlockDoubles * q;
    factor_block(diagonal);
    for (std::int32_t b = s.column_begin[q]; b < s.column_begin[q + 1]; ++b)
      times_transposed(data + kBlockDoubles * (s.rows + b), diagonal);
    for (std::int32_t u = s.update_begin[q]; u < s.update_begin[q + 1]; ++u) {
      const BlockCholeskyStructure::Update& update = s.updates[u];
      subtract_product(data + kBlockDoubles * update.target, data + kBlockDoubles * update.left,
                       data + kBlockDoubles * update.right);
    }
  }
}

void block_cholesky_solve(const BlockCholeskyStructure& s, const std::vector<double>& blocks, std::vector<double>& x) {
  for (std::int32_t q = 0; q < s.rows; ++q) {
    double* y = x.data() + kBlockRow * q;
    const double* m = blocks.data() + kBlockDoubles * q;
    Lanes low = all_lanes(0), high = all_lanes(0);
    for (int k = 0; k < 6; ++k) {
      low += y[k] * load_lanes(m + 8 * k);
      high += y[k] * load_lanes(m + 8 * k + 4);
    }
    store_lanes(y, low);
    store_lanes(y + 4, high);
    for (std::int32_t b = s.column_begin[q]; b < s.column_begin[q + 1]; ++b) {
      double* z = x.data() + kBlockRow * s.block_row[b];
      const double* g = blocks.data() + kBlockDoubles * (s.rows + b);
      Lanes zl = load_lanes(z), zh = load_lanes(z + 4);
      for (int k = 0; k < 6; ++k) {
        zl -= y[k] * load_lanes(g + 8 * k);
        zh -= y[k] * load_lanes(g + 8 * k + 4);
      }
      store_lanes(z, zl);
      store_lanes(z + 4, zh);
    }
  }
  for (std::int32_t q = s.rows - 1; q >= 0; --q) {
    double* y = x.data() + kBlockRow * q;
    Lanes sum[6];
    for (Lanes& v : sum) v = all_lanes(0);
    for (std::int32_t b = s.column_begin[q]; b < s.column_begin[q + 1]; ++b) {
      const double* z = x.data() + kBlockRow * s.block_row[b];
      const double* g = blocks.data() + kBlockDoubles * (s.rows + b);
      const Lanes zl = load_lanes(z), zh = load_lanes(z + 4);
      for (int k = 0; k < 6; ++k) sum[k] += load_lanes(g + 8 * k) * zl + load_lanes(g + 8 * k + 4) * zh;
    }
    for (int k = 0; k < 6; ++k) y[k] -= sum_of(sum[k]);
    const double* m = blocks.data() + kBlockDoubles * q;
    const Lanes yl = load_lanes(y), yh = load_lanes(y + 4);
    for (int k = 0; k < 6; ++k) y[k] = sum_of(load_lanes(m + 8 * k) * yl + load_lanes(m + 8 * k + 4) * yh);
  }
}

}  // namespace kerf
