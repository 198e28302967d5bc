#include "kerf/lattice/prism.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kerf/lattice/lattice_tolerances.h"

namespace kerf {
namespace {

struct Tetrahedron {
  Vec3 p[4];
};

double volume_of(const Tetrahedron& t) {
  return std::fabs(dot(cross(t.p[1] - t.p[0], t.p[2] - t.p[0]), t.p[3] - t.p[0])) / 6;
}

/// The at most three tetrahedra that one side of a plane leaves of one.
struct Pieces {
  union Slot {  // left uninitialised: zeroing the slots would cost more than filling them
    Tetrahedron t;
    Slot() {}
  };
  Slot slot[3];
  int n = 0;
  void add(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    slot[n].t = Tetrahedron{{a, b, c, d}};
    if (volume_of(slot[n].t) > 0) ++n;
  }
  void add_wedge(const Vec3& a0, const Vec3& a1, const Vec3& a2, const Vec3& b0, const Vec3& b1, const Vec3& b2) {
    add(a0, a1, a2, b2);
    add(a0, a1, b1, b2);
    add(a0, b0, b1, b2);
  }
};

Vec3 crossing(const Vec3& a, const Vec3& b, double da, double db, int axis, double k) {
  Vec3 p = lerp(a, b, da / (da - db));
  if (axis >= 0) p[axis] = k;
  return p;
}

/// The parts of a tetrahedron below and above a plane, d: heights of its corners over it; either part may be left out
/// (null). axis >= 0: the plane is x[axis] = k, and points on it get exactly k.
void split(const Tetrahedron& t, const double d[4], int axis, double k, Pieces* below, Pieces* above) {
  int order[4] = {0, 1, 2, 3};
  for (int i = 1; i < 4; ++i)  // stable: the same tetrahedron always falls into the same pieces
    for (int j = i; j > 0 && d[order[j]] < d[order[j - 1]]; --j) std::swap(order[j], order[j - 1]);
  const Vec3 p[4] = {t.p[order[0]], t.p[order[1]], t.p[order[2]], t.p[order[3]]};
  const double e[4] = {d[order[0]], d[order[1]], d[order[2]], d[order[3]]};
  if (e[3] <= 0) {
    if (below) below->add(p[0], p[1], p[2], p[3]);
    return;
  }
  if (e[0] >= 0) {
    if (above) above->add(p[0], p[1], p[2], p[3]);
    return;
  }
  auto cut = [&](int i, int j) { return crossing(p[i], p[j], e[i], e[j], axis, k); };
  if (e[1] >= 0) {  // one below
    const Vec3 a = cut(0, 1), b = cut(0, 2), c = cut(0, 3);
    if (below) below->add(p[0], a, b, c);
    if (above) above->add_wedge(a, b, c, p[1], p[2], p[3]);
  } else if (e[2] <= 0) {  // one above
    const Vec3 a = cut(0, 3), b = cut(1, 3), c = cut(2, 3);
    if (above) above->add(p[3], a, b, c);
    if (below) below->add_wedge(a, b, c, p[0], p[1], p[2]);
  } else {
    const Vec3 a = cut(0, 2), b = cut(0, 3), c = cut(1, 2), f = cut(1, 3);
    if (below) below->add_wedge(p[0], a, b, p[1], c, f);
    if (above) above->add_wedge(p[2], a, c, p[3], b, f);
  }
}

void split(const Tetrahedron& t, int axis, double k, Pieces* below, Pieces* above) {
  const double d[4] = {t.p[0][axis] - k, t.p[1][axis] - k, t.p[2][axis] - k, t.p[3][axis] - k};
  split(t, d, axis, k, below, above);
}

/// Calls leaf(piece, cell) for the parts of a tetrahedron in each cell.
template <class Leaf>
void slice(const Tetrahedron& t, int axis, LatticeIndex cell, Leaf&& leaf) {
  if (axis == 3) {
    leaf(t, cell);
    return;
  }
  const auto a = static_cast<std::size_t>(axis);
  const double lo = std::min(std::min(t.p[0][axis], t.p[1][axis]), std::min(t.p[2][axis], t.p[3][axis]));
  const double hi = std::max(std::max(t.p[0][axis], t.p[1][axis]), std::max(t.p[2][axis], t.p[3][axis]));
  const auto first = static_cast<std::int32_t>(std::floor(lo)), last = static_cast<std::int32_t>(std::ceil(hi)) - 1;
  if (first >= last) {
    cell[a] = first;
    slice(t, axis + 1, cell, leaf);
    return;
  }
  if (last == first + 1) {
    Pieces below, above;
    split(t, axis, last, &below, &above);
    cell[a] = first;
    for (int i = 0; i < below.n; ++i) slice(below.slot[i].t, axis + 1, cell, leaf);
    cell[a] = last;
    for (int i = 0; i < above.n; ++i) slice(above.slot[i].t, axis + 1, cell, leaf);
    return;
  }
  for (std::int32_t k = first; k <= last; ++k) {  // each slab from the whole tetrahedron: the pieces stay few
    Pieces above;
    split(t, axis, k, nullptr, &above);
    cell[a] = k;
    for (int i = 0; i < above.n; ++i) {
      Pieces slab;
      split(above.slot[i].t, axis, k + 1, &slab, nullptr);
      for (int j = 0; j < slab.n; ++j) slice(slab.slot[j].t, axis + 1, cell, leaf);
    }
  }
}

void tetrahedra_of(const Prism& p, Tetrahedron out[3]) {
  out[0] = {{p.minus[0], p.minus[1], p.minus[2], p.plus[2]}};
  out[1] = {{p.minus[0], p.minus[1], p.plus[1], p.plus[2]}};
  out[2] = {{p.minus[0], p.plus[0], p.plus[1], p.plus[2]}};
}

/// Calls leaf(piece) for the parts of a tetrahedron in one cell; planes step .. 5 are still to be cut with.
template <class Leaf>
void slice_in_cell(const Tetrahedron& t, int step, LatticeIndex cell, Leaf&& leaf) {
  for (; step < 6; ++step) {
    const int axis = step / 2;
    const double low = std::min(std::min(t.p[0][axis], t.p[1][axis]), std::min(t.p[2][axis], t.p[3][axis]));
    const double high = std::max(std::max(t.p[0][axis], t.p[1][axis]), std::max(t.p[2][axis], t.p[3][axis]));
    const double plane = cell[static_cast<std::size_t>(axis)] + step % 2;
    if (step % 2 == 0 ? high <= plane : low >= plane) return;
    if (step % 2 == 0 ? low >= plane : high <= plane) continue;
    Pieces kept;
    if (step % 2 == 0) split(t, axis, plane, nullptr, &kept);
    else split(t, axis, plane, &kept, nullptr);
    for (int i = 0; i < kept.n; ++i) slice_in_cell(kept.slot[i].t, step + 1, cell, leaf);
    return;
  }
  leaf(t);
}

template <class Leaf>
void slice_in_cell(const Prism& prism, LatticeIndex cell, Leaf&& leaf) {
  Tetrahedron tets[3];
  tetrahedra_of(prism, tets);
  for (const Tetrahedron& t : tets) slice_in_cell(t, 0, cell, leaf);
}

// Keast's rule of degree 6 with 24 points: the moments have degree 2 along each axis, 6 in all. Points in groups of four
// that are summed apart, so that the loops over them become vector instructions without reordering any sum.
constexpr std::size_t kLanes = 4, kGroups = 6;
struct KeastRule {
  double b[kGroups][4][kLanes];
  double w[kGroups][kLanes];
};
constexpr KeastRule keast() {
  KeastRule r{};
  std::size_t n = 0;
  auto add = [&](double weight, const double(&b)[4]) {
    for (std::size_t i = 0; i < 4; ++i) r.b[n / kLanes][i][n % kLanes] = b[i];
    r.w[n / kLanes][n % kLanes] = weight;
    ++n;
  };
  constexpr double kA[3] = {0.214602871259152029, 0.0406739585346113531, 0.322337890142275510};
  constexpr double kW[3] = {0.0399227502581674920, 0.0100772110553206429, 0.0553571815436547220};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 4; ++i) {
      double b[4] = {kA[k], kA[k], kA[k], kA[k]};
      b[i] = 1 - 3 * kA[k];
      add(kW[k], b);
    }
  constexpr double kB = 0.0636610018750175252, kC = 0.603005664791649142, kD = 1 - 2 * kB - kC;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      if (i == j) continue;
      double b[4] = {kB, kB, kB, kB};
      b[i] = kC;
      b[j] = kD;
      add(27.0 / 560, b);
    }
  return r;
}
constexpr KeastRule kKeast = keast();

/// Four doubles in a vector register (of g++ and clang; two smaller ones where the machine has none so wide). Written out, since loops
/// over lanes are made into shuffles.
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

class MomentSum {
 public:
  void add(const Tetrahedron& t, LatticeIndex cell) {
    double p[4][3];
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t a = 0; a < 3; ++a) p[i][a] = 2 * (t.p[i][static_cast<int>(a)] - cell[a]) - 1;
    const double volume = volume_of(t);
    // Points first, then moment by moment: a sum stays in a register while all groups go into it, one after the other.
    Lanes x[kGroups], y[kGroups], z[kGroups], wz[kGroups], wy[kGroups];
    for (std::size_t g = 0; g < kGroups; ++g) {
      Lanes b[4], w;
      std::memcpy(b, kKeast.b[g], sizeof b);
      std::memcpy(&w, kKeast.w[g], sizeof w);
      x[g] = b[0] * p[0][0] + b[1] * p[1][0] + b[2] * p[2][0] + b[3] * p[3][0];
      y[g] = b[0] * p[0][1] + b[1] * p[1][1] + b[2] * p[2][1] + b[3] * p[3][1];
      z[g] = b[0] * p[0][2] + b[1] * p[1][2] + b[2] * p[2][2] + b[3] * p[3][2];
      wz[g] = volume * w;
    }
    Lanes* m = sum_;
    for (int k = 0; k < 3; ++k) {
      for (std::size_t g = 0; g < kGroups; ++g) wy[g] = wz[g];
      for (int j = 0; j < 3; ++j, m += 3) {
        Lanes m0 = m[0], m1 = m[1], m2 = m[2];
        for (std::size_t g = 0; g < kGroups; ++g) {
          const Lanes v = wy[g], vx = v * x[g];
          m0 += v;
          m1 += vx;
          m2 += vx * x[g];
          wy[g] = v * y[g];
        }
        m[0] = m0, m[1] = m1, m[2] = m2;
      }
      for (std::size_t g = 0; g < kGroups; ++g) wz[g] *= z[g];
    }
  }
  void add_to(Moments& moments) const {
    for (std::size_t i = 0; i < moments.size(); ++i)
      moments[i] += (sum_[i][0] + sum_[i][1]) + (sum_[i][2] + sum_[i][3]);
  }

 private:
  Lanes sum_[27] = {};
};

/// A prism that stands upright on a lattice plane with a flat top, as those of flat bodies in an aligned lattice: its moments
/// are those of a polygon times those of an interval, at a fraction of the cost.
struct UprightPrism {
  int axis = -1;  ///< -1: it is none
  double low = 0, high = 0;
};
UprightPrism upright(const Prism& p) {
  auto same = [](double a, double b) { return std::fabs(a - b) <= kUprightPrism; };
  for (int axis = 2; axis >= 0; --axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    bool yes = same(p.minus[1][axis], p.minus[0][axis]) && same(p.minus[2][axis], p.minus[0][axis]) &&
               same(p.plus[1][axis], p.plus[0][axis]) && same(p.plus[2][axis], p.plus[0][axis]);
    for (std::size_t i = 0; i < 3 && yes; ++i)
      yes = same(p.minus[i][u], p.plus[i][u]) && same(p.minus[i][v], p.plus[i][v]);
    if (yes) return {axis, std::min(p.minus[0][axis], p.plus[0][axis]), std::max(p.minus[0][axis], p.plus[0][axis])};
  }
  return {};
}

/// A convex polygon in the plane across an upright prism.
struct FlatPolygon {
  double u[12], v[12];
  int n = 0;
  /// Keeps the part where a u + b v + c >= 0.
  void clip(double a, double b, double c) {
    double nu[12], nv[12];
    int m = 0;
    for (int i = 0; i < n; ++i) {
      const int j = i + 1 < n ? i + 1 : 0;
      const double di = a * u[i] + b * v[i] + c, dj = a * u[j] + b * v[j] + c;
      if (di >= 0) nu[m] = u[i], nv[m++] = v[i];
      if ((di > 0 && dj < 0) || (di < 0 && dj > 0)) {
        const double t = di / (di - dj);
        nu[m] = u[i] + t * (u[j] - u[i]), nv[m++] = v[i] + t * (v[j] - v[i]);
      }
    }
    n = m;
    std::copy(nu, nu + m, u);
    std::copy(nv, nv + m, v);
  }
  /// [a + 3 b] = integral of u^a v^b, by Green's theorem: along an edge a polynomial of degree 5, three Gauss points.
  [[nodiscard]] std::array<double, 9> moments() const {
    constexpr double kGauss[3] = {0.112701665379258311, 0.5, 0.887298334620741689},
                     kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    std::array<double, 9> m{};
    for (int i = 0; i < n; ++i) {
      const int j = i + 1 < n ? i + 1 : 0;
      const double dv = v[j] - v[i];
      if (dv == 0) continue;
      for (int g = 0; g < 3; ++g) {
        const double x = u[i] + kGauss[g] * (u[j] - u[i]), y = v[i] + kGauss[g] * dv;
        const double f[3] = {x, x * x / 2, x * x * x / 3};
        double w = kWeight[g] * dv;
        for (std::size_t b = 0; b < 3; ++b, w *= y)
          for (std::size_t a = 0; a < 3; ++a) m[a + 3 * b] += w * f[a];
      }
    }
    if (m[0] < 0)  // clockwise
      for (double& x : m) x = -x;
    return m;
  }
};

/// The upright prism's cross-section in a cell, in the cell's local coordinates.
FlatPolygon cross_section(const Prism& p, const UprightPrism& up, LatticeIndex cell) {
  const int u = (up.axis + 1) % 3, v = (up.axis + 2) % 3;
  FlatPolygon polygon;
  polygon.n = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    polygon.u[i] = 2 * (p.minus[i][u] - cell[static_cast<std::size_t>(u)]) - 1;
    polygon.v[i] = 2 * (p.minus[i][v] - cell[static_cast<std::size_t>(v)]) - 1;
  }
  polygon.clip(1, 0, 1);
  polygon.clip(-1, 0, 1);
  polygon.clip(0, 1, 1);
  polygon.clip(0, -1, 1);
  return polygon;
}

/// Keeps what of it lies above the upright plane through a point.
void clip_beside(FlatPolygon& polygon, const UprightPrism& up, LatticeIndex cell, Vec3 point, Vec3 normal) {
  // height = normal . (x - point), x = cell + (local + 1) / 2
  const int u = (up.axis + 1) % 3, v = (up.axis + 2) % 3;
  polygon.clip(normal[u] / 2, normal[v] / 2,
               normal[u] * (cell[static_cast<std::size_t>(u)] + 0.5 - point[u]) +
                   normal[v] * (cell[static_cast<std::size_t>(v)] + 0.5 - point[v]));
}

void add_upright_moments(const FlatPolygon& polygon, const UprightPrism& up, LatticeIndex cell, Moments& moments) {
  if (polygon.n < 3) return;
  const double base = cell[static_cast<std::size_t>(up.axis)];
  const double low = std::max(2 * (up.low - base) - 1, -1.0), high = std::min(2 * (up.high - base) - 1, 1.0);
  if (high <= low) return;
  const std::array<double, 9> flat = polygon.moments();
  const double along[3] = {(high - low) / 8, (high * high - low * low) / 16,
                           (high * high * high - low * low * low) / 24};
  constexpr std::size_t kStride[3] = {1, 3, 9};
  const std::size_t su = kStride[(up.axis + 1) % 3], sv = kStride[(up.axis + 2) % 3], sw = kStride[up.axis];
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t a = 0; a < 3; ++a) moments[a * su + b * sv + c * sw] += flat[a + 3 * b] * along[c];
}

/// Polygon of at most 3 + 6 corners, clipped in place to x[axis] >= k (sign 1) or <= k (sign -1).
struct Polygon {
  Vec3 p[10];
  int n = 0;
  void clip(int axis, double k, double sign) {
    Vec3 out[10];
    int m = 0;
    for (int i = 0; i < n; ++i) {
      const Vec3 &a = p[i], &b = p[i + 1 < n ? i + 1 : 0];
      const double da = sign * (a[axis] - k), db = sign * (b[axis] - k);
      if (da >= 0) out[m++] = a;
      if ((da > 0 && db < 0) || (da < 0 && db > 0)) out[m++] = lerp(a, b, da / (da - db));
    }
    n = m;
    std::copy(out, out + m, p);
  }
};

}  // namespace

Vec3 snapped_to_lattice(const LatticeFrame& frame, Vec3 p) {
  Vec3 q = frame.to_lattice(p);
  for (int i = 0; i < 3; ++i) {
    const double r = std::nearbyint(q[i]);
    if (std::fabs(q[i] - r) < kPlaneSnap) q[i] = r;
  }
  return q;
}

CollisionVertex first_ancestor(const CollisionMesh& mesh, CollisionVertex v) {
  while (mesh.ancestor[v] != v) v = mesh.ancestor[v];
  return v;
}

PrismCorners corners_of(const CollisionMesh& mesh, const LatticeFrame& frame, CollisionVertex v) {
  return {snapped_to_lattice(frame, mesh.rest[v] - mesh.offset[v]),
          snapped_to_lattice(frame, mesh.rest[v] + mesh.offset[v]), first_ancestor(mesh, v)};
}

Prism prism_between(const PrismCorners& a, const PrismCorners& b, const PrismCorners& c) {
  const PrismCorners* v[3] = {&a, &b, &c};
  if (v[1]->root < v[0]->root) std::swap(v[0], v[1]);
  if (v[2]->root < v[1]->root) std::swap(v[1], v[2]);
  if (v[1]->root < v[0]->root) std::swap(v[0], v[1]);
  return {{v[0]->minus, v[1]->minus, v[2]->minus}, {v[0]->plus, v[1]->plus, v[2]->plus}};
}

PrismWall wall_between(const PrismCorners& a, const PrismCorners& b) {
  if (b.root < a.root) return {{b.minus, b.plus, a.minus, a.plus}};
  return {{a.minus, a.plus, b.minus, b.plus}};
}

double ruled_volume(const Prism& prism) {
  // X(u, v, t) = P(u, v) + t O(u, v): the determinant is a quadratic in t whose coefficients are linear in (u, v).
  Vec3 p[3], o[3];
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = 0.5 * (prism.plus[i] + prism.minus[i]);
    o[i] = 0.5 * (prism.plus[i] - prism.minus[i]);
  }
  const Vec3 mean = (1.0 / 3) * (o[0] + o[1] + o[2]);
  return std::fabs(dot(cross(p[1] - p[0], p[2] - p[0]), mean) + dot(cross(o[1] - o[0], o[2] - o[0]), mean) / 3);
}

void prism_in_cells(const Prism& prism, const LatticeFrame& frame, std::vector<double>& scratch,
                    std::vector<CellVolume>& out) {
  const Box3 box = prism.box();
  LatticeIndex lo, size;
  for (int i = 0; i < 3; ++i) {
    const auto a = static_cast<std::size_t>(i);
    const int low = frame.first[a], high = low + frame.count[a] - 1;
    const int last = std::clamp(static_cast<int>(std::ceil(box.max[i])) - 1, low, high);
    lo[a] = std::clamp(static_cast<int>(std::floor(box.min[i])), low, high);
    size[a] = std::max(last - lo[a], 0) + 1;
  }
  Tetrahedron tets[3];
  tetrahedra_of(prism, tets);
  if (size[0] * size[1] * size[2] == 1) {
    const double v = volume_of(tets[0]) + volume_of(tets[1]) + volume_of(tets[2]);
    if (v > kOverlapVolume) out.push_back({lo, v});
    return;
  }
  scratch.assign(
      static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]), 0);
  auto slot = [&](LatticeIndex c) -> double& {
    std::size_t k[3];
    for (std::size_t a = 0; a < 3; ++a)  // what sticks out of the lattice by rounding counts to the last cell
      k[a] = static_cast<std::size_t>(std::clamp(c[a] - lo[a], 0, size[a] - 1));
    return scratch[(k[2] * static_cast<std::size_t>(size[1]) + k[1]) * static_cast<std::size_t>(size[0]) + k[0]];
  };
  for (const Tetrahedron& t : tets)
    if (volume_of(t) > 0)
      slice(t, 0, lo, [&](const Tetrahedron& piece, LatticeIndex c) { slot(c) += volume_of(piece); });
  std::size_t i = 0;
  for (std::int32_t z = 0; z < size[2]; ++z)
    for (std::int32_t y = 0; y < size[1]; ++y)
      for (std::int32_t x = 0; x < size[0]; ++x, ++i)
        if (scratch[i] > kOverlapVolume) out.push_back({{lo[0] + x, lo[1] + y, lo[2] + z}, scratch[i]});
}

double prism_in_cell(const Prism& prism, LatticeIndex cell) {
  double v = 0;
  slice_in_cell(prism, cell, [&](const Tetrahedron& t) { v += volume_of(t); });
  return v;
}

void add_prism_moments(const Prism& prism, LatticeIndex cell, Moments& moments) {
  if (const UprightPrism up = upright(prism); up.axis >= 0) {
    add_upright_moments(cross_section(prism, up, cell), up, cell, moments);
    return;
  }
  MomentSum sum;
  slice_in_cell(prism, cell, [&](const Tetrahedron& t) { sum.add(t, cell); });
  sum.add_to(moments);
}

void add_prism_moments_beside(const Prism& prism, LatticeIndex cell, Vec3 point, Vec3 normal, Moments& left,
                              Moments& right) {
  if (const UprightPrism up = upright(prism); up.axis >= 0 && std::fabs(normal[up.axis]) <= kUprightPrism) {
    FlatPolygon on_left = cross_section(prism, up, cell), on_right = on_left;
    clip_beside(on_left, up, cell, point, normal);
    clip_beside(on_right, up, cell, point, -normal);
    add_upright_moments(on_left, up, cell, left);
    add_upright_moments(on_right, up, cell, right);
    return;
  }
  MomentSum sum_left, sum_right;
  slice_in_cell(prism, cell, [&](const Tetrahedron& t) {
    double d[4];
    for (int i = 0; i < 4; ++i) d[i] = dot(normal, t.p[i] - point);
    Pieces below, above;
    split(t, d, -1, 0, &below, &above);
    for (int i = 0; i < below.n; ++i) sum_right.add(below.slot[i].t, cell);
    for (int i = 0; i < above.n; ++i) sum_left.add(above.slot[i].t, cell);
  });
  sum_left.add_to(left);
  sum_right.add_to(right);
}

bool prism_beside(const Prism& prism, LatticeIndex cell, Vec3 point, Vec3 normal, int side) {
  const auto is_beside = [&](const Vec3& p) { return side * dot(normal, p - point) > 0; };
  if (std::ranges::none_of(prism.minus, is_beside) && std::ranges::none_of(prism.plus, is_beside)) return false;
  if (const UprightPrism up = upright(prism); up.axis >= 0 && std::fabs(normal[up.axis]) <= kUprightPrism) {
    FlatPolygon polygon = cross_section(prism, up, cell);
    clip_beside(polygon, up, cell, point, side * normal);
    Moments moments{};
    add_upright_moments(polygon, up, cell, moments);
    return moments[0] > kOverlapVolume;
  }
  double volume = 0;
  slice_in_cell(prism, cell, [&](const Tetrahedron& t) {
    double d[4];
    for (int i = 0; i < 4; ++i) d[i] = side * dot(normal, t.p[i] - point);
    Pieces above;
    split(t, d, -1, 0, nullptr, &above);
    for (int i = 0; i < above.n; ++i) volume += volume_of(above.slot[i].t);
  });
  return volume > kOverlapVolume;
}

bool wall_meets_cell(const PrismWall& wall, LatticeIndex cell) {
  Vec3 lo, hi;
  for (int a = 0; a < 3; ++a) {
    lo[a] = cell[static_cast<std::size_t>(a)] - kWallReach;
    hi[a] = cell[static_cast<std::size_t>(a)] + 1 + kWallReach;
    double least = wall.p[0][a], most = least;
    for (std::size_t i = 1; i < 4; ++i) least = std::min(least, wall.p[i][a]), most = std::max(most, wall.p[i][a]);
    if (least > hi[a] || most < lo[a]) return false;
  }
  for (const Vec3& p : wall.p)
    if (p.x >= lo.x && p.x <= hi.x && p.y >= lo.y && p.y <= hi.y && p.z >= lo.z && p.z <= hi.z) return true;
  for (int half = 0; half < 2; ++half) {
    Polygon polygon;
    polygon.n = 3;
    polygon.p[0] = wall.p[0], polygon.p[1] = wall.p[half == 0 ? 1 : 2], polygon.p[2] = wall.p[3];
    for (int a = 0; a < 3 && polygon.n > 0; ++a) {
      polygon.clip(a, lo[a], 1);
      polygon.clip(a, hi[a], -1);
    }
    if (polygon.n > 0) return true;
  }
  return false;
}

bool wall_lies_in_face(const PrismWall& wall, LatticeIndex cell, int axis) {
  const double plane = cell[static_cast<std::size_t>(axis)] + 1;
  for (int half = 0; half < 2; ++half) {
    Polygon polygon;
    polygon.n = 3;
    polygon.p[0] = wall.p[0], polygon.p[1] = wall.p[half == 0 ? 1 : 2], polygon.p[2] = wall.p[3];
    for (int a = 0; a < 3 && polygon.n > 2; ++a) {
      const double lo = a == axis ? plane - kWallReach : cell[static_cast<std::size_t>(a)];
      const double hi = a == axis ? plane + kWallReach : lo + 1;
      polygon.clip(a, lo, 1);
      polygon.clip(a, hi, -1);
    }
    Vec3 area{};
    for (int i = 1; i + 1 < polygon.n; ++i) area += cross(polygon.p[i] - polygon.p[0], polygon.p[i + 1] - polygon.p[0]);
    if (norm(area) > 1e-14) return true;
  }
  return false;
}

}  // namespace kerf
