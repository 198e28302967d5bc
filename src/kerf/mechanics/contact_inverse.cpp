#include "kerf/mechanics/contact_inverse.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kerf/base/eight.h"
#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

constexpr int kSweeps = 4;  // of Jacobi's rotations: more than a frame needs to be good

inline double dot3(const double* block, Vec3 q) {  // q' block q
  return q.x * q.x * block[0] + q.y * q.y * block[1] + q.z * q.z * block[2] +
         2 * (q.x * q.y * block[3] + q.y * q.z * block[4] + q.z * q.x * block[5]);
}

inline double dot_lanes(const Lanes& a, const Lanes& b) {
  const Lanes p = a * b;
  return (p[0] + p[1]) + p[2];
}

/// Principal axes of a positive semidefinite block: its columns are turned until they are upright to each other (Hestenes). All in whole columns: GCC 12
/// makes fused multiply-adds of the rotation of two numbers, whatever -ffp-contract says.
void principal_axes(const double* block, Vec3* axes) {
  Lanes a[3] = {
      {block[0], block[3], block[5], 0}, {block[3], block[1], block[4], 0}, {block[5], block[4], block[2], 0}};
  Lanes q[3] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  const auto turn = [](Lanes& x, Lanes& y, double c, double s) {
    const Lanes before = x;
    x = c * before - s * y;
    y = s * before + c * y;
  };
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int i = 0; i < 2; ++i)
      for (int j = i + 1; j < 3; ++j) {
        const double xx = dot_lanes(a[i], a[i]), yy = dot_lanes(a[j], a[j]), xy = dot_lanes(a[i], a[j]);
        if (!(std::abs(xy) > 1e-12 * (xx + yy))) continue;
        const double theta = (yy - xx) / (2 * xy);
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        turn(a[i], a[j], c, s);
        turn(q[i], q[j], c, s);
      }
  for (int k = 0; k < 3; ++k) axes[k] = {q[k][0], q[k][1], q[k][2]};
}

/// Shares of the rows by slot, rows ascending.
void sort_shares(ContactInverse& c, std::size_t slots) {
  c.share_begin.assign(slots + 1, 0);
  for (const ContactInverse::Touch& t : c.touches) ++c.share_begin[t.slot + 1];
  for (std::size_t i = 0; i < slots; ++i) c.share_begin[i + 1] += c.share_begin[i];
  c.share_next.assign(c.share_begin.begin(), c.share_begin.end() - 1);
  c.shares.resize(c.touches.size());
  for (std::size_t i = 0; i < c.rows.size(); ++i)
    for (std::int32_t k = c.begin[i]; k < c.begin[i + 1]; ++k) {
      const ContactInverse::Touch& t = c.touches[k];
      c.shares[c.share_next[t.slot]++] = {
          static_cast<std::int32_t>(i),
          {static_cast<float>(t.weight * c.root[i].x), static_cast<float>(t.weight * c.root[i].y),
           static_cast<float>(t.weight * c.root[i].z)},
          t.weight};
    }
}

inline Eight load_eight(const float* p) {
  Eight v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store_eight(float* p, const Eight& v) { std::memcpy(p, &v, sizeof v); }

/// Eight by eight: v[c] are eight rows of column c of L, or eight columns of row c of L^-1. Both are made a tile at a time, which never leaves the registers.
struct Tile {
  Eight v[8];
};
inline Tile load_tile(const float* p, std::size_t stride) {
  Tile t;
#pragma GCC unroll 8
  for (std::size_t c = 0; c < 8; ++c) t.v[c] = load_eight(p + c * stride);
  return t;
}
inline void store_tile(float* p, std::size_t stride, const Tile& t) {
#pragma GCC unroll 8
  for (std::size_t c = 0; c < 8; ++c) store_eight(p + c * stride, t.v[c]);
}

/// t -= what lies before it: sum over first <= k < last of factor(k)[c] v(k), which of one k lie `stride` after those of the one before.
inline void subtract_products(const float* factor, const float* v, std::size_t stride, std::size_t first,
                              std::size_t last, Tile& t) {
  for (std::size_t k = first; k < last; ++k) {
    const float* f = factor + k * stride;
    const Eight x = load_eight(v + k * stride);
#pragma GCC unroll 8
    for (std::size_t c = 0; c < 8; ++c) t.v[c] -= f[c] * x;
  }
}

/// And what lies in the eight columns of the tile itself: those of L on the diagonal, with the inverse of the pivots there.
inline void solve_tile(const float* l, std::size_t stride, Tile& t) {
#pragma GCC unroll 8
  for (std::size_t c = 0; c < 8; ++c) {
    t.v[c] *= l[c * stride + c];
#pragma GCC unroll 8
    for (std::size_t d = c + 1; d < 8; ++d) t.v[d] -= l[c * stride + d] * t.v[c];
  }
}

/// A tile on the diagonal to its factor. No pivot of 1 + B is less than 1.
inline void factor_tile(Tile& t) {
#pragma GCC unroll 8
  for (std::size_t c = 0; c < 8; ++c) {
    const float inverse = 1 / std::sqrt(std::max(1.0F, t.v[c][c]));
    t.v[c] *= inverse;
#pragma GCC unroll 8
    for (std::size_t d = c + 1; d < 8; ++d) t.v[d] -= t.v[c][d] * t.v[c];
    t.v[c][c] = inverse;
  }
}

/// Lower triangle of 1 + B, by columns, in place to its factor L; on its diagonal the inverse of the pivots.
void factor_columns(float* s, std::size_t stride) {
  for (std::size_t j = 0; j < stride; j += 8) {
    float* corner = s + j * stride + j;
    Tile t = load_tile(corner, stride);
    subtract_products(s + j, s + j, stride, 0, j, t);
    factor_tile(t);
    store_tile(corner, stride, t);
    for (std::size_t i = j + 8; i < stride; i += 8) {
      t = load_tile(s + j * stride + i, stride);
      subtract_products(s + j, s + i, stride, 0, j, t);
      solve_tile(corner, stride, t);
      store_tile(s + j * stride + i, stride, t);
    }
  }
}

/// L^-1 by rows.
void invert_columns(const float* l, std::size_t stride, float* out) {
  for (std::size_t i = 0; i < stride; i += 8) {
    const float* corner = l + i * stride + i;
    for (std::size_t j = 0; j < i; j += 8) {
      Tile t = {};
      subtract_products(l + i, out + j, stride, j, i, t);
      solve_tile(corner, stride, t);
      store_tile(out + i * stride + j, stride, t);
    }
    Tile t = {};
#pragma GCC unroll 8
    for (std::size_t c = 0; c < 8; ++c) {
      t.v[c] *= corner[c * stride + c];
      t.v[c][c] = corner[c * stride + c];
#pragma GCC unroll 8
      for (std::size_t d = c + 1; d < 8; ++d) t.v[d] -= corner[c * stride + d] * t.v[c];
    }
    store_tile(out + i * stride + i, stride, t);
  }
}

inline Eight added_pairs(const Eight& a, const Eight& b) {
  return __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14) +
         __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15);
}

/// out = W' W v with lower triangular W by rows; half = W v.
void multiply_inverse(const float* w, std::size_t stride, const float* v, float* half, float* out) {
  for (std::size_t i = 0; i < stride; i += 8) {
    Eight sum[8];
    for (Eight& x : sum) x = all_eight(0);
    for (std::size_t j = 0; j <= i; j += 8) {
      const Eight x = load_eight(v + j);
      for (std::size_t k = 0; k < 8; ++k) sum[k] += x * load_eight(w + (i + k) * stride + j);
    }
    store_eight(half + i, added_pairs(added_pairs(added_pairs(sum[0], sum[1]), added_pairs(sum[2], sum[3])),
                                      added_pairs(added_pairs(sum[4], sum[5]), added_pairs(sum[6], sum[7]))));
  }
  for (std::size_t j = 0; j < stride; j += 8) {
    Eight even = all_eight(0), odd = all_eight(0);
    for (std::size_t i = j; i < stride; i += 2) {
      even += half[i] * load_eight(w + i * stride + j);
      odd += half[i + 1] * load_eight(w + (i + 1) * stride + j);
    }
    store_eight(out + j, even + odd);
  }
}

/// How many times as stiff as its nodes a row is.
double relative_stiffness(const MechanicsModel& model, const ContactRow& row, const double* block,
                          const StepWorkspace& w) {
  const ContactSet& set = *w.contact.set;
  double sum = 0;
  for (std::int32_t k = row.first; k < row.first + row.count; ++k) {
    const std::size_t node = set.entries[k].node.index();
    if (model.structure().free[node] == 0) continue;
    const double* d = w.diagonal[2 * node].v;
    sum += set.entries[k].weight * set.entries[k].weight / (d[0] + d[1] + d[2]);
  }
  return sum * (block[0] + block[1] + block[2]);
}

}  // namespace

bool choose_inverse_rows(const MechanicsModel& model, StepWorkspace& w) {
  const ContactWork& work = w.contact;
  ContactInverse& c = w.contact.inverse;
  c.rows.clear();
  c.has.assign(work.rows.size(), 0);
  double sum[6] = {};
  for (const std::int32_t r : work.pressing) {
    const ContactRow& row = work.set->rows[r];
    if (row.rigid >= 0 || relative_stiffness(model, row, work.rows[r].block, w) > kStiffestInverse) continue;
    c.rows.push_back(r);
    c.has[r] = 1;
    for (int k = 0; k < 6; ++k) sum[k] += work.rows[r].block[k];
  }
  if (c.rows.empty() || c.rows.size() > kMostInverseRows) return false;
  principal_axes(sum, c.axes);
  c.root.resize(c.rows.size());
  for (std::size_t i = 0; i < c.rows.size(); ++i)
    for (int a = 0; a < 3; ++a) c.root[i][a] = std::sqrt(std::max(0.0, dot3(work.rows[c.rows[i]].block, c.axes[a])));
  return true;
}

void store_framed_inverse(const ContactInverse& c, const Lanes& first, const Lanes& second, double* columns) {
  const double block[6] = {first[0], first[1], first[2], first[3], second[0], second[1]};
  Lanes out[3] = {all_lanes(0), all_lanes(0), all_lanes(0)};
  for (const Vec3& q : c.axes) {
    const Lanes along = (1 / dot3(block, q)) * Lanes{q.x, q.y, q.z, 0};
    for (int k = 0; k < 3; ++k) out[k] += q[k] * along;
  }
  for (int k = 0; k < 3; ++k) store_lanes(columns + 4 * k, out[k]);
}

void factor_contact_inverse(StepWorkspace& w) {
  const ContactWork& work = w.contact;
  ContactInverse& c = w.contact.inverse;
  const ContactSet& set = *work.set;
  c.begin.assign(1, 0);
  c.touches.clear();
  c.nodes.clear();
  c.slot_of.assign(work.nodes.size(), -1);
  for (const std::int32_t r : c.rows) {
    for (std::int32_t k = set.rows[r].first; k < set.rows[r].first + set.rows[r].count; ++k) {
      const auto node = static_cast<std::int32_t>(set.entries[k].node.index());
      if (work.node_slot[node] < 0) continue;
      std::int32_t& slot = c.slot_of[work.node_slot[node]];
      if (slot < 0) {
        slot = static_cast<std::int32_t>(c.nodes.size());
        c.nodes.push_back(node);
      }
      c.touches.push_back({node, slot, set.entries[k].weight});
    }
    c.begin.push_back(static_cast<std::int32_t>(c.touches.size()));
  }
  const std::size_t n = c.rows.size(), slots = c.nodes.size();
  sort_shares(c, slots);
  c.force.resize(n);
  c.stride = (n + 7) / 8 * 8;
  const std::size_t size = c.stride * c.stride;
  c.factor.assign(3 * size / 8, {});
  c.inverse.assign(3 * size / 8, {});
  for (std::vector<ContactInverse::Eight>* v : {&c.value, &c.half, &c.solved}) v->assign(3 * c.stride / 8, {});
  float* s = c.factor.data()->v;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const double* columns = w.inverse_diagonal[3 * static_cast<std::size_t>(c.nodes[slot])].v;
    const double block[6] = {columns[0], columns[5], columns[10], columns[1], columns[6], columns[2]};
    float d[3];
    for (int a = 0; a < 3; ++a) d[a] = static_cast<float>(dot3(block, c.axes[a]));
    for (std::int32_t k = c.share_begin[slot]; k < c.share_begin[slot + 1]; ++k) {
      const float x = d[0] * c.shares[k].along[0], y = d[1] * c.shares[k].along[1], z = d[2] * c.shares[k].along[2];
      float* column = s + static_cast<std::size_t>(c.shares[k].row) * c.stride;
      for (std::int32_t l = k; l < c.share_begin[slot + 1]; ++l) {
        float* out = column + c.shares[l].row;
        out[0] += x * c.shares[l].along[0];
        out[size] += y * c.shares[l].along[1];
        out[2 * size] += z * c.shares[l].along[2];
      }
    }
  }
  float* inverse = c.inverse.data()->v;
  for (int a = 0; a < 3; ++a, s += size, inverse += size) {
    for (std::size_t j = 0; j < n; ++j) s[j * c.stride + j] += 1;
    factor_columns(s, c.stride);
    invert_columns(s, c.stride, inverse);
  }
}

double apply_contact_inverse(StepWorkspace& w) {
  ContactInverse& c = w.contact.inverse;
  const std::size_t n = c.rows.size(), stride = c.stride;
  float *x = c.value.data()->v, *y = x + stride, *z = y + stride;
  const Lanes turned[3] = {Lanes{c.axes[0].x, c.axes[1].x, c.axes[2].x, 0},
                           Lanes{c.axes[0].y, c.axes[1].y, c.axes[2].y, 0},
                           Lanes{c.axes[0].z, c.axes[1].z, c.axes[2].z, 0}};
  StepWorkspace::Quad* settled = w.preconditioned.data();
  const StepWorkspace::Quad* diagonal = w.inverse_diagonal.data();
  const Vec3* root = c.root.data();
  const ContactInverse::Touch* touch = c.touches.data();
  for (std::size_t i = 0; i < n; ++i) {
    Lanes even = all_lanes(0), odd = all_lanes(0);
    const ContactInverse::Touch* end = c.touches.data() + c.begin[i + 1];
    for (; touch + 1 < end; touch += 2) {
      even += touch[0].weight * load_lanes(settled[touch[0].node].v);
      odd += touch[1].weight * load_lanes(settled[touch[1].node].v);
    }
    if (touch < end) even += touch->weight * load_lanes(settled[touch->node].v);
    touch = end;
    const Lanes u = even + odd, v = u[0] * turned[0] + u[1] * turned[1] + u[2] * turned[2];
    x[i] = static_cast<float>(v[0] * root[i].x);
    y[i] = static_cast<float>(v[1] * root[i].y);
    z[i] = static_cast<float>(v[2] * root[i].z);
  }
  for (std::size_t a = 0; a < 3; ++a)
    multiply_inverse(c.inverse.data()->v + a * stride * stride, stride, x + a * stride, c.half.data()->v,
                     c.solved.data()->v + a * stride);
  const float *p = c.solved.data()->v, *q = p + stride, *r = q + stride;
  double sum = 0;
  const Lanes axes[3] = {Lanes{c.axes[0].x, c.axes[0].y, c.axes[0].z, 0},
                         Lanes{c.axes[1].x, c.axes[1].y, c.axes[1].z, 0},
                         Lanes{c.axes[2].x, c.axes[2].y, c.axes[2].z, 0}};
  ContactInverse::Quad* force = c.force.data();
  for (std::size_t i = 0; i < n; ++i) {
    const double px = p[i], qy = q[i], rz = r[i];
    sum += px * x[i] + qy * y[i] + rz * z[i];
    store_lanes(force[i].v, (px * root[i].x) * axes[0] + (qy * root[i].y) * axes[1] + (rz * root[i].z) * axes[2]);
  }
  const ContactInverse::Share *share = c.shares.data(), *all = share;
  for (std::size_t slot = 0; slot < c.nodes.size(); ++slot) {
    Lanes f = all_lanes(0);
    for (const ContactInverse::Share* end = all + c.share_begin[slot + 1]; share != end; ++share)
      f += share->weight * load_lanes(force[share->row].v);
    const auto node = static_cast<std::size_t>(c.nodes[slot]);
    const StepWorkspace::Quad* d = diagonal + 3 * node;
    double* out = settled[node].v;
    store_lanes(out,
                load_lanes(out) - (f[0] * load_lanes(d[0].v) + f[1] * load_lanes(d[1].v) + f[2] * load_lanes(d[2].v)));
  }
  return -sum;
}

}  // namespace kerf
