#include "kerf/binding/m_matrix_lu.h"

#include <algorithm>

#include "kerf/base/at.h"
#include "kerf/base/lanes.h"

namespace kerf {
namespace {

constexpr std::size_t kLanes = 4;

/// Parts of a mesh with at most so many rows are one dense matrix (measured: 8 to 32 hardly differ).
constexpr std::size_t kLeaf = 12;

std::size_t padded(std::size_t n) { return (n + kLanes - 1) / kLanes * kLanes; }

/// c(r, j) -= sum over k of a(k, r) b(k, j): four rows of c and eight or four columns.
inline void subtract_wide_tile(double* c, std::size_t stride_c, const double* a, std::size_t stride_a, const double* b,
                               std::size_t stride_b, std::size_t depth) {
  double* const c1 = c + stride_c;
  double* const c2 = c1 + stride_c;
  double* const c3 = c2 + stride_c;
  Lanes l0 = load_lanes(c), r0 = load_lanes(c + kLanes), l1 = load_lanes(c1), r1 = load_lanes(c1 + kLanes),
        l2 = load_lanes(c2), r2 = load_lanes(c2 + kLanes), l3 = load_lanes(c3), r3 = load_lanes(c3 + kLanes);
  for (std::size_t k = 0; k < depth; ++k, a += stride_a, b += stride_b) {
    const Lanes left = load_lanes(b), right = load_lanes(b + kLanes);
    l0 -= all_lanes(a[0]) * left, r0 -= all_lanes(a[0]) * right;
    l1 -= all_lanes(a[1]) * left, r1 -= all_lanes(a[1]) * right;
    l2 -= all_lanes(a[2]) * left, r2 -= all_lanes(a[2]) * right;
    l3 -= all_lanes(a[3]) * left, r3 -= all_lanes(a[3]) * right;
  }
  store_lanes(c, l0), store_lanes(c + kLanes, r0);
  store_lanes(c1, l1), store_lanes(c1 + kLanes, r1);
  store_lanes(c2, l2), store_lanes(c2 + kLanes, r2);
  store_lanes(c3, l3), store_lanes(c3 + kLanes, r3);
}
inline void subtract_tile(double* c, std::size_t stride_c, const double* a, std::size_t stride_a, const double* b,
                          std::size_t stride_b, std::size_t depth) {
  double* const c1 = c + stride_c;
  double* const c2 = c1 + stride_c;
  double* const c3 = c2 + stride_c;
  Lanes s0 = load_lanes(c), s1 = load_lanes(c1), s2 = load_lanes(c2), s3 = load_lanes(c3);
  for (std::size_t k = 0; k < depth; ++k, a += stride_a, b += stride_b) {
    const Lanes row = load_lanes(b);
    s0 -= all_lanes(a[0]) * row, s1 -= all_lanes(a[1]) * row, s2 -= all_lanes(a[2]) * row, s3 -= all_lanes(a[3]) * row;
  }
  store_lanes(c, s0), store_lanes(c1, s1), store_lanes(c2, s2), store_lanes(c3, s3);
}

/// c -= transposed(a) b; rows and columns of c are whole lanes.
void subtract_product(double* c, std::size_t stride_c, const double* a, std::size_t stride_a, const double* b,
                      std::size_t stride_b, std::size_t rows, std::size_t columns, std::size_t depth) {
  std::size_t j = 0;
  for (; j + 2 * kLanes <= columns; j += 2 * kLanes)
    for (std::size_t r = 0; r < rows; r += kLanes)
      subtract_wide_tile(c + r * stride_c + j, stride_c, a + r, stride_a, b + j, stride_b, depth);
  if (j < columns)
    for (std::size_t r = 0; r < rows; r += kLanes)
      subtract_tile(c + r * stride_c + j, stride_c, a + r, stride_a, b + j, stride_b, depth);
}

/// Eliminates four pivots: u, l: their rows of U and columns of L from the diagonal on, `width` long. L is scaled to a unit
/// diagonal, the reciprocals of the pivots come on U's. What lies on the wrong side of the diagonal becomes 0.
bool eliminate_four(double* u, double* l, std::size_t stride, std::size_t width) {
  Lanes inverse{};
  for (std::size_t k = 0; k < kLanes; ++k) {
    const double pivot = u[k * stride + k];
    if (!(pivot > 0)) return false;
    inverse[k] = 1 / pivot;
    for (std::size_t i = k + 1; i < kLanes; ++i) l[k * stride + i] *= inverse[k];
    for (std::size_t i = k + 1; i < kLanes; ++i)
      for (std::size_t j = i; j < kLanes; ++j) {
        u[i * stride + j] -= l[k * stride + i] * u[k * stride + j];
        if (j > i) l[i * stride + j] -= u[k * stride + i] * l[k * stride + j];
      }
  }
  const auto u_at = [&](std::size_t i, std::size_t j) { return all_lanes(u[i * stride + j]); };
  const auto l_at = [&](std::size_t i, std::size_t j) { return all_lanes(l[i * stride + j]); };
  const Lanes u01 = u_at(0, 1), u02 = u_at(0, 2), u03 = u_at(0, 3), u12 = u_at(1, 2), u13 = u_at(1, 3),
              u23 = u_at(2, 3);
  const Lanes l01 = l_at(0, 1), l02 = l_at(0, 2), l03 = l_at(0, 3), l12 = l_at(1, 2), l13 = l_at(1, 3),
              l23 = l_at(2, 3);
  const Lanes d0 = all_lanes(inverse[0]), d1 = all_lanes(inverse[1]), d2 = all_lanes(inverse[2]),
              d3 = all_lanes(inverse[3]);
  for (std::size_t j = kLanes; j < width; j += kLanes) {
    const Lanes u0 = load_lanes(u + j), u1 = load_lanes(u + stride + j) - l01 * u0,
                u2 = load_lanes(u + 2 * stride + j) - l02 * u0 - l12 * u1;
    store_lanes(u + stride + j, u1);
    store_lanes(u + 2 * stride + j, u2);
    store_lanes(u + 3 * stride + j, load_lanes(u + 3 * stride + j) - l03 * u0 - l13 * u1 - l23 * u2);
    const Lanes l0 = d0 * load_lanes(l + j), l1 = d1 * (load_lanes(l + stride + j) - u01 * l0),
                l2 = d2 * (load_lanes(l + 2 * stride + j) - u02 * l0 - u12 * l1);
    store_lanes(l + j, l0);
    store_lanes(l + stride + j, l1);
    store_lanes(l + 2 * stride + j, l2);
    store_lanes(l + 3 * stride + j, d3 * (load_lanes(l + 3 * stride + j) - u03 * l0 - u13 * l1 - u23 * l2));
  }
  for (std::size_t k = 0; k < kLanes; ++k) {
    u[k * stride + k] = inverse[k];
    for (std::size_t j = 0; j < k; ++j) u[k * stride + j] = 0;
    for (std::size_t j = 0; j <= k; ++j) l[k * stride + j] = 0;
  }
  return true;
}

}  // namespace

std::vector<double>& MMatrixLu::remainder_of(std::size_t node) {
  const Dissection::Node& n = dissection_.nodes()[node];
  return remainder_[at(2 * n.depth + n.side)];
}

bool MMatrixLu::solve(const SparseRows& a, std::span<const Vec3> points, std::vector<Vec2>& x) {
  analyse(a, points);
  const std::vector<Dissection::Node>& nodes = dissection_.nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    assemble(a, x, i);
    const Front& front = fronts_[i];
    const std::size_t own = padded(front.own()), others = padded(at(front.other_count) + 2);
    std::vector<double>& remainder = remainder_of(i);
    remainder.assign(others * others, 0);
    for (const std::int32_t child : nodes[i].children)
      if (child >= 0) add_child(fronts_[at(child)], front, remainder_of(at(child)).data(), remainder.data());
    if (own > 0 && !eliminate(front, remainder.data())) return false;
  }
  solution_.resize(x.size());
  for (std::size_t i = nodes.size(); i-- > 0;) substitute(fronts_[i]);
  for (std::size_t i = 0; i < x.size(); ++i) x[at(dissection_.order()[i])] = solution_[i];
  return true;
}

void MMatrixLu::analyse(const SparseRows& a, std::span<const Vec3> points) {
  const std::size_t n = a.diagonal.size();
  dissection_.run({a.first, a.column}, points, kLeaf);
  const std::vector<std::int32_t>& order = dissection_.order();
  rank_.resize(n);
  for (std::size_t i = 0; i < n; ++i) rank_[at(order[i])] = static_cast<std::int32_t>(i);

  // Rows are sorted, so a sweep over rows meets the entries of every column in order.
  transposed_.resize(a.value.size());
  place_.assign(a.first.begin(), a.first.end() - 1);
  for (std::size_t i = 0; i < n; ++i)
    for (std::int32_t k = a.first[i]; k < a.first[i + 1]; ++k)
      transposed_[at(place_[at(a.column[at(k)])]++)] = a.value[at(k)];

  mark_.assign(n, -1);
  others_.clear();
  fronts_.clear();
  std::size_t upper = 0, depth = 0;
  for (std::size_t i = 0; i < dissection_.nodes().size(); ++i) {
    find_others(a, i);
    depth = std::max(depth, at(dissection_.nodes()[i].depth));
    Front& front = fronts_.back();
    front.upper = upper;
    const std::size_t own = padded(front.own());
    upper += own * (own + padded(at(front.other_count) + 2));
  }
  if (upper_.size() < upper) upper_.resize(upper);
  if (remainder_.size() < 2 * depth + 2) remainder_.resize(2 * depth + 2);
}

void MMatrixLu::find_others(const SparseRows& a, std::size_t node) {
  const Dissection::Node& n = dissection_.nodes()[node];
  Front front{n.begin, n.end, static_cast<std::int32_t>(others_.size()), 0, 0};
  const auto add = [&](std::int32_t rank) {
    if (rank < n.end || mark_[at(rank)] == static_cast<std::int32_t>(node)) return;
    mark_[at(rank)] = static_cast<std::int32_t>(node);
    others_.push_back(rank);
  };
  for (const std::int32_t child : n.children) {
    if (child < 0) continue;
    const Front& c = fronts_[at(child)];
    for (std::int32_t k = 0; k < c.other_count; ++k) add(others_[at(c.others + k)]);
  }
  for (std::int32_t r = n.begin; r < n.end; ++r) {
    const std::size_t row = at(dissection_.order()[at(r)]);
    for (std::int32_t k = a.first[row]; k < a.first[row + 1]; ++k) add(rank_[at(a.column[at(k)])]);
  }
  std::sort(others_.begin() + front.others, others_.end());
  front.other_count = static_cast<std::int32_t>(others_.size()) - front.others;
  fronts_.push_back(front);
}

/// Entries of the node's own rows and columns.
void MMatrixLu::assemble(const SparseRows& a, const std::vector<Vec2>& x, std::size_t node) {
  const Front& front = fronts_[node];
  const std::size_t count = front.own(), own = padded(count), stride = own + padded(at(front.other_count) + 2);
  double* const upper = upper_.data() + front.upper;
  std::fill_n(upper, own * stride, 0);
  lower_.assign(own * stride, 0);
  for (std::int32_t k = 0; k < front.other_count; ++k)
    place_[at(others_[at(front.others + k)])] = static_cast<std::int32_t>(own) + k;
  for (std::int32_t r = front.begin; r < front.end; ++r) place_[at(r)] = r - front.begin;
  for (std::size_t i = count; i < own; ++i) upper[i * stride + i] = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t r = front.begin + static_cast<std::int32_t>(i);
    const std::size_t row = at(dissection_.order()[at(r)]), right = i * stride + own + at(front.other_count);
    upper[i * stride + i] = a.diagonal[row];
    upper[right] = x[row].x;
    upper[right + 1] = x[row].y;
    for (std::int32_t k = a.first[row]; k < a.first[row + 1]; ++k) {
      const std::int32_t other = rank_[at(a.column[at(k)])];
      if (other < r) continue;  // entered with its own row, or a descendant's
      const std::size_t j = i * stride + at(place_[at(other)]);
      upper[j] = a.value[at(k)];
      lower_[j] = transposed_[at(k)];
    }
  }
}

/// Adds what a child has left over to the parent's front at work, whose columns place_ knows.
void MMatrixLu::add_child(const Front& child, const Front& parent, const double* from, double* remainder) {
  const std::size_t own = padded(parent.own()), others = padded(at(parent.other_count) + 2), stride = own + others;
  const std::size_t count = at(child.other_count), from_stride = padded(count + 2);
  double* const upper = upper_.data() + parent.upper;
  const std::int32_t* const ranks = others_.data() + child.others;
  std::size_t mine = 0;
  while (mine < count && ranks[mine] < parent.end) ++mine;
  // Columns of the child in the parent, the right-hand sides too.
  target_.resize(count + 2);
  for (std::size_t i = 0; i < count; ++i) target_[i] = static_cast<std::uint32_t>(place_[at(ranks[i])]);
  for (std::size_t i = 0; i < 2; ++i) target_[count + i] = static_cast<std::uint32_t>(own + at(parent.other_count) + i);
  const std::uint32_t* const column = target_.data();
  for (std::size_t i = 0; i < mine; ++i) {
    double* const u = upper + column[i] * stride;
    for (std::size_t j = i; j < count + 2; ++j) u[column[j]] += from[i * from_stride + j];
    double* const l = lower_.data() + column[i] * stride;
    for (std::size_t j = i + 1; j < count; ++j) l[column[j]] += from[j * from_stride + i];
  }
  for (std::size_t i = mine; i < count; ++i) {
    double* const to = remainder + (column[i] - own) * others - own;
    for (std::size_t j = mine; j < count + 2; ++j) to[column[j]] += from[i * from_stride + j];
  }
}

bool MMatrixLu::eliminate(const Front& front, double* remainder) {
  const std::size_t own = padded(front.own()), others = padded(at(front.other_count) + 2), stride = own + others;
  double* const upper = upper_.data() + front.upper;
  double* const lower = lower_.data();
  for (std::size_t k = 0; k < own; k += kLanes) {
    double* const u = upper + k * stride + k;
    double* const l = lower + k * stride + k;
    if (k > 0) {
      subtract_product(u, stride, lower + k, stride, upper + k, stride, kLanes, stride - k, k);
      subtract_product(l, stride, upper + k, stride, lower + k, stride, kLanes, stride - k, k);
    }
    if (!eliminate_four(u, l, stride, stride - k)) return false;
  }
  subtract_product(remainder, others, lower + own, stride, upper + own, stride, others, others, own);
  return true;
}

void MMatrixLu::substitute(const Front& front) {
  const std::size_t own = padded(front.own()), others = at(front.other_count), stride = own + padded(others + 2);
  const double* const upper = upper_.data() + front.upper;
  // Both solutions along the front's columns.
  column_.assign(2 * stride, 0);
  double* const x = column_.data();
  double* const y = x + stride;
  for (std::size_t i = 0; i < others; ++i) {
    const Vec2 s = solution_[at(others_[at(front.others) + i])];
    x[own + i] = s.x;
    y[own + i] = s.y;
  }
  const double* right = upper + own + others;
  for (std::size_t i = own; i-- > 0;) {
    const double* const u = upper + i * stride;
    Lanes sum_x{}, sum_y{};
    for (std::size_t j = (i + 1) / kLanes * kLanes; j < stride; j += kLanes) {
      sum_x += load_lanes(u + j) * load_lanes(x + j);
      sum_y += load_lanes(u + j) * load_lanes(y + j);
    }
    x[i] = u[i] * (right[i * stride] - (sum_x[0] + sum_x[1] + sum_x[2] + sum_x[3]));
    y[i] = u[i] * (right[i * stride + 1] - (sum_y[0] + sum_y[1] + sum_y[2] + sum_y[3]));
  }
  for (std::size_t i = 0; i < front.own(); ++i) solution_[at(front.begin) + i] = {x[i], y[i]};
}

}  // namespace kerf
