#include "kerf/binding/parametrize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "kerf/base/at.h"
#include "kerf/base/indexed.h"
#include "kerf/base/parallel.h"
#include "kerf/base/threads.h"
#include "kerf/binding/m_matrix_lu.h"
#include "kerf/spatial/predicates.h"

namespace kerf {
namespace {

/// tan(angle / 2) between u and v, without trigonometric functions.
double tan_half(Vec3 u, Vec3 v, double length_u, double length_v) {
  const double c = norm(cross(u, v)), d = dot(u, v), m = length_u * length_v;
  return d >= 0 ? c / (m + d) : (m - d) / c;
}

struct BoundaryPoint {
  std::int32_t vertex;
  Vec2 planar;
};

enum class Weights {
  kMeanValue,
  kUpright,
  kUniform
};  // tried in this order; kUpright: mean value, of the real positions

/// Memory of one patch's system.
struct PatchSystem {
  std::vector<BoundaryPoint> boundary;  ///< ascending by vertex
  std::vector<std::int32_t> inner;      ///< vertices by local index
  SparseRows rows;
  std::vector<Vec3> points;  ///< of the inner vertices
  std::vector<Vec2> x;
  MMatrixLu lu;
  struct Spoke {
    std::int32_t vertex;
    Vec3 direction;
    double length, weight;
  };
  std::vector<Spoke> spokes;
};

/// Memory that one thread after another works in: new memory for every few patches would cost more than what is done in it.
class PatchSystems {
 public:
  std::unique_ptr<PatchSystem> take() {
    const Lock lock(mutex_);
    if (idle_.empty()) return std::make_unique<PatchSystem>();
    auto system = std::move(idle_.back());
    idle_.pop_back();
    return system;
  }
  void give_back(std::unique_ptr<PatchSystem> system) {
    const Lock lock(mutex_);
    idle_.push_back(std::move(system));
  }

 private:
  Mutex mutex_;
  std::vector<std::unique_ptr<PatchSystem>> idle_;
};

class Parametrizer {
 public:
  Parametrizer(const SplitSurface& s, const CollisionMesh& c, const BoundVertices& vertices, const PathNetwork& network,
               const PatchMap& patches, std::vector<Vec2> memory)
      : planar(std::move(memory)), w_(s.walled), upright_(s.upright), c_(c), vertices_(vertices), network_(network),
        patches_(patches), local_(s.walled.position.size(), -1) {
    planar.resize(s.walled.origin.size());
  }

  std::vector<Vec2> planar;

  /// Arc-length parameters of all chain vertices, in the direction of their pool.
  Status measure_chains() {
    t_.resize(network_.pool.size());
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(c_.half_edge_count()))
      for (std::size_t side = 0; side < 2; ++side) {
        const PoolRun run = network_.chain[h.index()][side];
        if (!run.exists() || run.reversed) continue;
        const Vec3 start = w_.at(vertices_.bound[c_.from(h).index()][side]),
                   end = w_.at(vertices_.bound[c_.to(h).index()][side]);
        double length = 0;
        Vec3 last = start;
        for (std::int32_t i = 0; i < run.count; ++i) {
          const Vec3 p = w_.at(network_.pool[run.at(i).index()]);
          t_[run.at(i).index()] = length += norm(p - last);
          last = p;
        }
        length += norm(end - last);
        double previous = 0;
        for (std::int32_t i = 0; i < run.count; ++i) {
          double& t = t_[run.at(i).index()];
          t /= length;
          if (!(t > previous && t < 1))
            return failed(fmt::format(
                "collision edge {}-{}: two points of its path coincide at visual vertex {}; the visual mesh has "
                "triangles too thin for double precision there",
                c_.from(h).value + 1, c_.to(h).value + 1, network_.pool[run.at(i).index()] + 1));
          previous = t;
        }
      }
    return {};
  }

  /// Fills `planar` of one patch; false if some triangle is not positively oriented.
  bool solve(std::size_t patch, Weights weights, PatchSystem& p) {
    place_boundary(patch, p);
    p.inner.clear();
    const std::span<const std::int32_t> faces(patches_.faces.data() + patches_.first[patch],
                                              at(patches_.first[patch + 1] - patches_.first[patch]));
    if (weights != Weights::kMeanValue)  // tried before with others
      for (const std::int32_t f : faces)
        for (std::int32_t h = 3 * f; h < 3 * f + 3; ++h) local_[at(w_.from(h))] = -1;
    for (const std::int32_t f : faces)
      for (std::int32_t h = 3 * f; h < 3 * f + 3; ++h) {
        const std::int32_t v = w_.from(h);
        if (w_.wall_vertex[at(v)] || local_[at(v)] >= 0) continue;
        local_[at(v)] = static_cast<std::int32_t>(p.inner.size());
        p.inner.push_back(v);
      }
    if (!p.inner.empty()) {
      assemble(weights, p);
      p.points.clear();
      for (const std::int32_t v : p.inner) p.points.push_back(w_.at(v));
      if (!p.lu.solve(p.rows, p.points, p.x)) return false;
    }
    for (const std::int32_t f : faces) {
      std::array<Vec2, 3> q;
      for (std::int32_t k = 0; k < 3; ++k) {
        const std::int32_t v = w_.from(3 * f + k);
        q[at(k)] = planar[at(3 * f + k)] = w_.wall_vertex[at(v)] ? boundary_point(p, v) : p.x[at(local_[at(v)])];
      }
      if (!(std::isfinite(q[0].x + q[1].x + q[2].x + q[0].y + q[1].y + q[2].y)) || orient2d(q[0], q[1], q[2]) <= 0)
        return false;
    }
    return true;
  }

 private:
  void place_boundary(std::size_t patch, PatchSystem& p) const {
    const std::size_t side = patch % 2;
    const double mirror = side == 0 ? 1 : -1;
    p.boundary.clear();
    for (std::size_t k = 0; k < 3; ++k) {
      const CollisionHalfEdge h(3 * (patch / 2) + k);
      const Vec2 a = c_.planar[h], b = c_.planar[CollisionMesh::next(h)];
      p.boundary.push_back({vertices_.bound[c_.from(h).index()][side], {a.x, mirror * a.y}});
      const PoolRun run = network_.chain[h.index()][side];
      for (std::int32_t i = 0; i < run.count; ++i) {
        const double t = t_[run.at(i).index()];
        const Vec2 q = run.reversed ? lerp(b, a, t) : lerp(a, b, t);
        p.boundary.push_back({network_.pool[run.at(i).index()], {q.x, mirror * q.y}});
      }
    }
    std::sort(p.boundary.begin(), p.boundary.end(),
              [](const BoundaryPoint& a, const BoundaryPoint& b) { return a.vertex < b.vertex; });
  }

  static Vec2 boundary_point(const PatchSystem& p, std::int32_t v) {
    return std::lower_bound(p.boundary.begin(), p.boundary.end(), v,
                            [](const BoundaryPoint& a, std::int32_t b) { return a.vertex < b; })
        ->planar;
  }

  void assemble(Weights weights, PatchSystem& p) const {
    const std::size_t n = p.inner.size();
    SparseRows& rows = p.rows;
    rows.first.assign(1, 0);
    rows.column.clear();
    rows.value.clear();
    rows.diagonal.resize(n);
    p.x.assign(n, Vec2{});
    for (std::size_t i = 0; i < n; ++i) {
      const std::int32_t v = p.inner[i];
      p.spokes.clear();
      const std::int32_t start = w_.outgoing[at(v)];
      std::int32_t h = start;
      do {  // inner vertices have a closed fan
        const Vec3 d =
            weights == Weights::kUpright ? upright_[at(w_.to(h))] - upright_[at(v)] : w_.at(w_.to(h)) - w_.at(v);
        p.spokes.push_back({w_.to(h), d, norm(d), 1});
        h = w_.opposite(WalledSurface::prev(h));
      } while (h != start);
      const std::size_t m = p.spokes.size();
      if (weights != Weights::kUniform) {
        double before =
            tan_half(p.spokes[m - 1].direction, p.spokes[0].direction, p.spokes[m - 1].length, p.spokes[0].length);
        for (std::size_t k = 0; k < m; ++k) {
          const auto& next = p.spokes[(k + 1) % m];
          const double after = tan_half(p.spokes[k].direction, next.direction, p.spokes[k].length, next.length);
          p.spokes[k].weight = (before + after) / p.spokes[k].length;
          before = after;
        }
      }
      double sum = 0;
      for (const auto& spoke : p.spokes) sum += spoke.weight;
      // Rows of sum 1: all systems have the same scale.
      rows.diagonal[i] = 1;
      const std::size_t first = rows.column.size();
      for (const auto& spoke : p.spokes) {
        const double share = spoke.weight / sum;
        if (w_.wall_vertex[at(spoke.vertex)]) {
          p.x[i] = p.x[i] + share * boundary_point(p, spoke.vertex);
          continue;
        }
        std::size_t k = rows.column.size();
        rows.column.push_back(0);
        rows.value.push_back(0);
        const std::int32_t column = local_[at(spoke.vertex)];
        for (; k > first && rows.column[k - 1] > column; --k) {
          rows.column[k] = rows.column[k - 1];
          rows.value[k] = rows.value[k - 1];
        }
        rows.column[k] = column;
        rows.value[k] = -share;
      }
      rows.first.push_back(static_cast<std::int32_t>(rows.column.size()));
    }
  }

  const WalledSurface& w_;
  const std::vector<Vec3>& upright_;  ///< empty: as in w_
  const CollisionMesh& c_;
  const BoundVertices& vertices_;
  const PathNetwork& network_;
  const PatchMap& patches_;
  std::vector<double> t_;            ///< per pool item
  std::vector<std::int32_t> local_;  ///< per free vertex: index in its patch's system; each belongs to one patch
};

}  // namespace

Result<Parametrization> parametrize(const SplitSurface& surface, const CollisionMesh& collision,
                                    const BoundVertices& vertices, const PathNetwork& network, const PatchMap& patches,
                                    bool closed, std::vector<Vec2> planar, const Progress& progress) {
  Parametrizer parametrizer(surface, collision, vertices, network, patches, std::move(planar));
  KERF_TRY(parametrizer.measure_chains());
  const std::size_t step = closed ? 1 : 2, count = 2 * collision.face_count() / step;
  enum : std::uint8_t { kMean, kUpright, kUniform, kBad };
  const bool squashed = !surface.upright.empty();
  std::vector<std::uint8_t> outcome(count, kMean);
  PatchSystems systems;
  // In slices, so that progress can be told between them.
  const std::size_t slice = progress ? std::max<std::size_t>(64, count / 16) : count;
  for (std::size_t begin = 0; begin < count; begin += slice) {
    const std::size_t end = std::min(count, begin + slice);
    parallel_for(end - begin, 4, [&](std::size_t first, std::size_t last) {
      auto system = systems.take();
      for (std::size_t i = begin + first; i < begin + last; ++i) {
        if (parametrizer.solve(step * i, Weights::kMeanValue, *system)) continue;
        outcome[i] = squashed && parametrizer.solve(step * i, Weights::kUpright, *system) ? kUpright
                     : parametrizer.solve(step * i, Weights::kUniform, *system)           ? kUniform
                                                                                          : kBad;
      }
      systems.give_back(std::move(system));
    });
    KERF_TRY(progress("parameters", static_cast<double>(end) / static_cast<double>(count)));
  }
  Parametrization result;
  for (std::size_t i = 0; i < count; ++i) {
    if (outcome[i] == kBad)
      return failed(fmt::format(
          "collision triangle {} ({} side): its part of the visual mesh has triangles too thin to be laid out in double "
          "precision; remesh the visual mesh there",
          step * i / 2 + 1, step * i % 2 == 0 ? "+" : "-"));
    result.upright_patches += outcome[i] == kUpright;
    result.uniform_patches += outcome[i] == kUniform;
  }
  result.planar = std::move(parametrizer.planar);
  return result;
}

}  // namespace kerf
