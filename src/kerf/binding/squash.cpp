#include "kerf/binding/squash.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kerf/base/at.h"
#include "kerf/base/indexed.h"
#include "kerf/base/parallel.h"
#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

/// x(b, c, h) = origin + b u + c v + h (m + b mu + c mv): a prism over a collision triangle, whose normals are interpolated.
struct Prism {
  Vec3 origin, u, v, m, mu, mv;
  Vec3 up;                       ///< unit normal of the triangle
  double area = 0;               ///< twice
  std::array<double, 3> height;  ///< of the triangle, from each corner
};

struct PrismPoint {
  double b = 0, c = 0, h = 0;
  bool crossed = false;  ///< the normals cross before they get there
  [[nodiscard]] double weight(std::size_t corner) const { return corner == 0 ? 1 - b - c : corner == 1 ? b : c; }
};

PrismPoint projected(const Prism& p, Vec3 x) {
  const Vec3 d = x - p.origin;
  return {dot(cross(d, p.v), p.up) / p.area, dot(cross(p.u, d), p.up) / p.area, dot(d, p.up)};
}

PrismPoint locate(const Prism& p, Vec3 x) {
  const PrismPoint start = projected(p, x);
  PrismPoint q = start;
  const Vec3 d = x - p.origin;
  const double exact = kNewtonExact * std::sqrt(p.area);
  for (int step = 0; step <= kMostNewtonSteps; ++step) {
    const Vec3 m = p.m + q.b * p.mu + q.c * p.mv;
    const Vec3 off = d - (q.b * p.u + q.c * p.v + q.h * m);
    if (norm(off) <= exact) return q;
    const Vec3 along_b = p.u + q.h * p.mu, along_c = p.v + q.h * p.mv;
    const double det = dot(cross(along_b, along_c), m);
    if (!(det > kLeastPrismArea * p.area)) break;
    q.b += dot(cross(off, along_c), m) / det;
    q.c += dot(cross(along_b, off), m) / det;
    q.h += dot(cross(along_b, along_c), off) / det;
  }
  q = start;
  q.crossed = true;
  return q;
}

class Squasher {
 public:
  Squasher(const WalledSurface& w, const CollisionMesh& c, std::span<const Vec3> normals) : w_(w), c_(c) {
    prisms_.reserve(c.face_count());
    for (const CollisionTriangle f : ids<CollisionTriangle>(c.face_count())) {
      std::array<Vec3, 3> r, m;
      for (int k = 0; k < 3; ++k) {
        const CollisionVertex v = c.from(CollisionMesh::corner(f, k));
        r[at(k)] = c.rest[v];
        m[at(k)] = normals[v.index()];
      }
      Prism p{r[0], r[1] - r[0], r[2] - r[0], m[0], m[1] - m[0], m[2] - m[0], {}, 0, {}};
      const Vec3 n = cross(p.u, p.v);
      p.area = norm(n);
      p.up = (1 / p.area) * n;
      for (std::size_t k = 0; k < 3; ++k) p.height[k] = p.area / norm(r[(k + 2) % 3] - r[(k + 1) % 3]);
      prisms_.push_back(p);
    }
  }

  /// Every vertex after the one it is reached from, in levels of equal distance; false at vertices that are not reached.
  void order_vertices(const BoundVertices& vertices) {
    from_.assign(w_.position.size(), -1);
    prism_.assign(w_.position.size(), -1);
    order_.reserve(w_.position.size());
    for (const CollisionVertex v : ids<CollisionVertex>(c_.vertex_count()))
      for (const std::int32_t b : vertices.bound[v.index()]) {
        if (b < 0 || from_[at(b)] >= 0) continue;
        from_[at(b)] = b;
        prism_[at(b)] = CollisionMesh::face(c_.outgoing[v]).value;
        order_.push_back(b);
      }
    level_.push_back(0);
    for (std::size_t begin = 0; begin < order_.size(); begin = level_.back()) {
      const std::size_t end = order_.size();
      level_.push_back(end);
      for (std::size_t i = begin; i < end; ++i) {
        const std::int32_t v = order_[i], first = w_.outgoing[at(v)];
        std::int32_t h = first;
        do {  // the surface is closed
          const std::int32_t u = w_.to(h);
          if (from_[at(u)] < 0) {
            from_[at(u)] = v;
            order_.push_back(u);
          }
          h = w_.opposite(WalledSurface::prev(h));
        } while (h != first);
      }
    }
  }

  std::int64_t place_all(std::vector<Vec3>& place) {
    std::vector<std::uint8_t> crossed(w_.position.size(), 0);
    for (std::size_t l = 0; l + 1 < level_.size(); ++l) {
      constexpr std::size_t kVertices = 512;  // so many at a time
      parallel_for(level_[l + 1] - level_[l], kVertices, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = level_[l] + begin; i < level_[l] + end; ++i) {
          const std::int32_t v = order_[i];
          std::int32_t& prism = prism_[at(v)];
          prism = prism_[at(from_[at(v)])];
          const PrismPoint q = walk(w_.at(v), prism);
          const Prism& p = prisms_[at(prism)];
          place[at(v)] = p.origin + (q.b * p.u + q.c * p.v + (kSquash * q.h) * p.up);
          crossed[at(v)] = q.crossed;
        }
      });
    }
    return std::count(crossed.begin(), crossed.end(), std::uint8_t{1});
  }

 private:
  /// From prism to prism over the side that x is farthest beyond, in metres; the one that x is least out of. Weights would end the walk early: those
  /// of triangles that are small or thin are large.
  PrismPoint walk(Vec3 x, std::int32_t& prism) const {
    std::array<std::int32_t, kMostPrisms> tried;
    std::size_t count = 0;
    PrismPoint best;
    double least = HUGE_VAL;
    for (std::int32_t f = prism; f >= 0 && count < tried.size();) {
      tried[count++] = f;
      const Prism& p = prisms_[at(f)];
      const PrismPoint q = locate(p, x);
      std::int32_t next = -1;
      double out = 0, farthest = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double beyond = -q.weight(k) * p.height[k];
        out = std::max(out, beyond);
        if (!(beyond > farthest)) continue;
        const CollisionHalfEdge across = c_.twin[CollisionHalfEdge(3 * f + static_cast<std::int32_t>((k + 1) % 3))];
        if (!across.valid()) continue;
        const std::int32_t g = CollisionMesh::face(across).value;
        if (std::find(tried.begin(), tried.begin() + static_cast<std::ptrdiff_t>(count), g) !=
            tried.begin() + static_cast<std::ptrdiff_t>(count))
          continue;
        farthest = beyond;
        next = g;
      }
      if (out < least) {
        least = out;
        best = q;
        prism = f;
      }
      f = next;
    }
    return best;
  }

  const WalledSurface& w_;
  const CollisionMesh& c_;
  std::vector<Prism> prisms_;
  std::vector<std::int32_t> from_, prism_, order_;
  std::vector<std::size_t> level_;  ///< where levels begin in order_, and its end
};

}  // namespace

std::int64_t squash(SplitSurface& s, const CollisionMesh& c, const BoundVertices& vertices,
                    std::span<const Vec3> normals) {
  WalledSurface& w = s.walled;
  std::vector<Vec3> place;
  place.reserve(w.position.capacity());
  place = w.position;
  Squasher squasher(w, c, normals);
  squasher.order_vertices(vertices);
  const std::int64_t crossed = squasher.place_all(place);
  s.upright = std::move(w.position);
  w.position = std::move(place);
  return crossed;
}

void stand_up(SplitSurface& s) {
  if (s.upright.empty()) return;
  s.walled.position = std::move(s.upright);
  s.upright = {};
}

}  // namespace kerf
