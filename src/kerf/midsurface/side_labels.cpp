#include "kerf/midsurface/side_labels.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kerf/mesh/union_find.h"
#include "kerf/midsurface/laplacian.h"

namespace kerf::mid {
namespace {

constexpr double kLeastWeight = 0.02;  // of a "same" edge before its bend: rims are unsure, but connected
constexpr double kOpposite = 0.9;      // pairs count a little less than smooth neighbours
constexpr double kThinnest = 0.5;      // of the mean thickness: closer pairs are not trusted more
constexpr double kConfident = 0.1;     // faces that count when signs are compared between rounds
constexpr int kMaxRounds = 8;

/// Disjoint sets that know whether an element has the sign of its root.
class SignedSets {
 public:
  explicit SignedSets(std::size_t n) : parent_(n), sign_(n, 1), size_(n, 1) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  /// Root of i, and i's sign relative to it.
  std::pair<std::int32_t, std::int8_t> root(std::int32_t i) {
    std::int32_t r = i;
    std::int8_t s = 1;
    while (parent_[r] != r) {
      s = static_cast<std::int8_t>(s * sign_[r]);
      r = parent_[r];
    }
    for (std::int8_t left = s; parent_[i] != r && i != r;) {
      const std::int32_t up = parent_[i];
      const std::int8_t own = sign_[i];
      parent_[i] = r;
      sign_[i] = left;
      left = static_cast<std::int8_t>(left * own);
      i = up;
    }
    return {r, s};
  }
  void join(std::int32_t a, std::int32_t b, std::int8_t relation) {
    auto [ra, sa] = root(a);
    auto [rb, sb] = root(b);
    if (ra == rb) return;
    if (size_[ra] < size_[rb]) std::swap(ra, rb);
    parent_[rb] = ra;
    sign_[rb] = static_cast<std::int8_t>(sa * sb * relation);
    size_[ra] += size_[rb];
  }

 private:
  Column<std::int32_t> parent_;
  Column<std::int8_t> sign_;
  Column<std::int32_t> size_;
};

Column<std::int8_t> first_guess(const SurfaceMesh& m, const Pairing& p) {
  struct Edge {
    double weight;
    std::int32_t a, b;
    std::int8_t relation;
  };
  std::vector<Edge> edges;
  edges.reserve(m.origin.size() / 2 + p.pair.size());
  for (std::int32_t h = 0; h < m.origin.count(); ++h) {
    if (!m.is_edge(h)) continue;
    const std::int32_t f = h / 3, g = m.twin[h] / 3;
    const double bend = 0.5 * (1 + dot(p.normal[f], p.normal[g]));
    const double sure = std::max(kLeastWeight, std::min(p.pair[f].confidence, p.pair[g].confidence));
    edges.push_back({sure * bend * bend * bend * bend, f, g, 1});
  }
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const Pair& q = p.pair[f];
    if (q.face < 0) continue;
    const double sure = std::min(q.confidence, p.pair[q.face].confidence);
    if (sure > 0) edges.push_back({kOpposite * sure, f, q.face, -1});
  }
  std::vector<std::int32_t> order(edges.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::int32_t i, std::int32_t j) {
    const double x = edges[static_cast<std::size_t>(i)].weight, y = edges[static_cast<std::size_t>(j)].weight;
    return x != y ? x > y : i < j;
  });
  SignedSets sets(p.pair.size());
  for (const std::int32_t i : order) {
    const Edge& e = edges[static_cast<std::size_t>(i)];
    sets.join(e.a, e.b, e.relation);
  }
  Column<std::int8_t> sign(p.pair.size());
  for (std::int32_t f = 0; f < m.face_count(); ++f) sign[f] = sets.root(f).second;
  return sign;
}

/// The energy of the field as a matrix: gradient and data factored, the coupling of pairs by conjugate gradients.
class FieldSystem {
 public:
  FieldSystem(const SurfaceMesh& m, const Pairing& p, double thickness) : m_(m), p_(p) {
    const auto faces = static_cast<std::size_t>(m.face_count());
    data_.resize(faces, 0);
    coupling_.resize(faces, 0);
    for (std::int32_t f = 0; f < m.face_count(); ++f) {
      const Pair& q = p.pair[f];
      if (q.face < 0) continue;
      const double t = std::clamp(q.distance, kThinnest * thickness, 10 * thickness), unit = m.area(f) * 4 / (t * t);
      data_[f] = unit * std::max(q.confidence, p.of_facet[f]);
      coupling_[f] = unit * std::min(q.confidence, p.pair[q.face].confidence);
    }
    std::vector<SparseEntry> base;
    add_laplacian(m, cotangent_weights(m), base);
    const auto add = [&](std::vector<SparseEntry>& to, std::int32_t f, const std::array<double, 3>& b, double w) {
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const std::int32_t r = m.origin[3 * f + i], c = m.origin[3 * f + j];
          if (r >= c) to.push_back({r, c, w * b[static_cast<std::size_t>(i)] * b[static_cast<std::size_t>(j)]});
        }
    };
    constexpr std::array<double, 3> kThird{1.0 / 3, 1.0 / 3, 1.0 / 3};
    for (std::int32_t f = 0; f < m.face_count(); ++f)
      if (data_[f] > 0) add(base, f, kThird, data_[f]);
    for (std::int32_t v = 0; v < m.vertex_count(); ++v) base.push_back({v, v, 1e-9});
    // 2 w (x_f^2 + x_hit^2) bounds w (x_f + x_hit)^2 and does not couple the sides: no fill between them.
    std::vector<SparseEntry> bound = base;
    for (std::int32_t f = 0; f < m.face_count(); ++f) {
      if (!(coupling_[f] > 0)) continue;
      add(bound, f, kThird, 2 * coupling_[f]);
      add(bound, p.pair[f].face, p.pair[f].barycentric, 2 * coupling_[f]);
    }
    base_ = std::move(base);
    preconditioner_ = std::make_unique<SparseCholesky>(m.vertex_count(), bound);
  }

  [[nodiscard]] bool ok() const { return preconditioner_->ok(); }

  /// x: start and result.
  void solve(const Column<std::int8_t>& sign, std::vector<double>& x) const {
    const std::size_t n = x.size();
    std::vector<double> b(n, 0), r(n), z(n), d(n), q(n);
    for (std::int32_t f = 0; f < m_.face_count(); ++f)
      for (int k = 0; k < 3; ++k) b[static_cast<std::size_t>(m_.origin[3 * f + k])] += data_[f] * sign[f] / 3;
    multiply(x, q);
    for (std::size_t i = 0; i < n; ++i) r[i] = b[i] - q[i];
    preconditioner_->solve(r, z);
    d = z;
    double rz = dot(r, z);
    // Error in the energy norm relative to the solution's: the right-hand side's own norm is the scale.
    preconditioner_->solve(b, q);
    const double target = 1e-8 * dot(b, q);
    for (int iteration = 0; iteration < 100 && rz > target; ++iteration) {
      multiply(d, q);
      const double alpha = rz / dot(d, q);
      for (std::size_t i = 0; i < n; ++i) {
        x[i] += alpha * d[i];
        r[i] -= alpha * q[i];
      }
      preconditioner_->solve(r, z);
      const double next = dot(r, z), beta = next / rz;
      for (std::size_t i = 0; i < n; ++i) d[i] = z[i] + beta * d[i];
      rz = next;
    }
  }

 private:
  static double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  }
  void multiply(const std::vector<double>& x, std::vector<double>& y) const {
    std::fill(y.begin(), y.end(), 0.0);
    for (const SparseEntry& e : base_) {
      const auto r = static_cast<std::size_t>(e.row), c = static_cast<std::size_t>(e.column);
      y[r] += e.value * x[c];
      if (r != c) y[c] += e.value * x[r];
    }
    for (std::int32_t f = 0; f < m_.face_count(); ++f) {
      if (!(coupling_[f] > 0)) continue;
      const Pair& q = p_.pair[f];
      double sum = 0;
      for (int k = 0; k < 3; ++k) {
        sum += x[static_cast<std::size_t>(m_.origin[3 * f + k])] / 3;
        sum += q.barycentric[static_cast<std::size_t>(k)] * x[static_cast<std::size_t>(m_.origin[3 * q.face + k])];
      }
      sum *= coupling_[f];
      for (int k = 0; k < 3; ++k) {
        y[static_cast<std::size_t>(m_.origin[3 * f + k])] += sum / 3;
        y[static_cast<std::size_t>(m_.origin[3 * q.face + k])] += sum * q.barycentric[static_cast<std::size_t>(k)];
      }
    }
  }

  const SurfaceMesh& m_;
  const Pairing& p_;
  Column<double> data_, coupling_;
  std::vector<SparseEntry> base_;
  std::unique_ptr<SparseCholesky> preconditioner_;
};

/// Small areas of one sign get the other one: what a fold or a dent leaves.
void remove_islands(const SurfaceMesh& m, Column<double>& x, double smallest, Column<std::uint8_t>& island) {
  const Column<double> area = vertex_areas(m);
  for (int round = 0; round < 4; ++round) {
    UnionFind sets(x.size());
    for (std::int32_t h = 0; h < m.origin.count(); ++h)
      if (m.is_edge(h) && (x[m.from(h)] > 0) == (x[m.to(h)] > 0)) sets.join(m.from(h), m.to(h));
    Column<double> size(x.size(), 0);
    for (std::int32_t v = 0; v < m.vertex_count(); ++v) size[sets.root(v)] += area[v];
    double largest[2] = {0, 0};
    for (std::int32_t v = 0; v < m.vertex_count(); ++v)
      if (sets.is_root(static_cast<std::size_t>(v))) largest[x[v] > 0] = std::max(largest[x[v] > 0], size[v]);
    bool any = false;
    const Column<double> before = x;
    for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
      const double s = size[sets.root(v)];
      if (s >= smallest || s >= largest[before[v] > 0]) continue;
      x[v] = -x[v];
      island[v] = 1;
      any = true;
    }
    if (!any) return;
  }
}

}  // namespace

double field_at(const SurfaceMesh& m, const Column<double>& x, std::int32_t f) {
  return (x[m.origin[3 * f]] + x[m.origin[3 * f + 1]] + x[m.origin[3 * f + 2]]) / 3;
}

double field_at(const SurfaceMesh& m, const Column<double>& x, std::int32_t f, const std::array<double, 3>& b) {
  return b[0] * x[m.origin[3 * f]] + b[1] * x[m.origin[3 * f + 1]] + b[2] * x[m.origin[3 * f + 2]];
}

Result<SideLabels> label_sides(const SurfaceMesh& m, const Pairing& p, double thickness, const Progress& progress) {
  SideLabels out;
  Column<std::int8_t> sign = first_guess(m, p);
  std::vector<double> x(m.position.size(), 0);
  const FieldSystem system(m, p, thickness);
  const Column<double>& field = out.field;
  if (system.ok()) {
    for (out.rounds = 1; out.rounds <= kMaxRounds; ++out.rounds) {
      KERF_TRY(progress("mid-surface: sides", static_cast<double>(out.rounds) / (kMaxRounds + 1)));
      system.solve(sign, x);
      out.field = Column<double>(x);
      std::int32_t changed = 0;
      for (std::int32_t f = 0; f < m.face_count(); ++f) {
        const std::int8_t s = field_at(m, field, f) >= 0 ? 1 : -1;
        changed += s != sign[f] && p.pair[f].confidence > kConfident;
        sign[f] = s;
      }
      if (changed <= m.face_count() / 2000) break;
    }
  } else {
    out.field.assign(x.size(), 1);
  }
  out.island.assign(x.size(), 0);
  double total = total_area(m);
  remove_islands(m, out.field, std::max(4 * thickness * thickness, 0.01 * total), out.island);
  const Column<double> area = vertex_areas(m);
  double plus = 0;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) plus += out.field[v] > 0 ? area[v] : 0;
  const double turn = plus >= 0.5 * total ? 1 : -1;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    double& value = out.field[v];
    value *= turn;
    if (std::fabs(value) < 1e-6) value = value < 0 ? -1e-6 : 1e-6;
  }
  double all = 0, same = 0;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const Pair& q = p.pair[f];
    if (q.face < 0) continue;
    const double w = m.area(f) * std::min(q.confidence, p.pair[q.face].confidence);
    all += w;
    if ((field_at(m, field, f) > 0) == (field_at(m, field, q.face, q.barycentric) > 0)) same += w;
  }
  out.one_sided = all > 0 ? same / all : 1;
  return out;
}

}  // namespace kerf::mid
