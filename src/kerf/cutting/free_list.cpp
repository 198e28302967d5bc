#include "kerf/cutting/free_list.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "kerf/base/prefetch.h"
#include "kerf/cutting/orient.h"

namespace kerf::cut {

namespace {

/// Some of the free vertices of a list and where they lie in the plane, so that telling their sides is arithmetic alone.
struct Batch {
  static constexpr std::size_t kSize = 128;
  std::array<VisualVertex, kSize> vertex;
  std::array<double, kSize> x, y;
  std::array<double, kSize>
      told[3];  ///< sign of orient() against up to three lines; 0: too near to tell by rounded arithmetic
  std::size_t count = 0;

  void tell_sides(std::size_t line, Vec2 a, Vec2 b) {
    double* const sign = told[line].data();
    for (std::size_t i = 0; i < count; ++i) {
      const double left = (a.x - x[i]) * (b.y - y[i]), right = (a.y - y[i]) * (b.x - x[i]), det = left - right;
      const double error = exact::kFilter2d * (std::fabs(left) + std::fabs(right)) + exact::kUnderflow;
      const double negative = -det > error ? -1.0 : 0.0;
      sign[i] = det > error ? 1.0 : negative;
    }
  }
  /// The sign of orient(a, b, vertex i), as in orient.h; tell_sides() has looked at that line.
  [[nodiscard]] double side(std::size_t line, std::size_t i, Vec2 a, Vec2 b) const {
    const double sign = told[line][i];
    return sign != 0 ? sign : exact::orient2d(a, b, {x[i], y[i]});
  }
};

/// Reads a part of a list into the batch.
void read_batch(const CellComplex& body, std::span<const VisualVertex> list, Side side, Batch& batch) {
  const VisualMesh& mesh = body.visual;
  for (const VisualVertex v : list) {
    prefetch(mesh.outgoing, v);
    prefetch(mesh.free, v);
  }
  for (const VisualVertex v : list) prefetch(mesh.planar, mesh.outgoing[v]);
  batch.count = 0;
  for (const VisualVertex v : list) {
    const Vec2 u = mirrored(mesh.planar[mesh.outgoing[v]], side);
    batch.vertex[batch.count] = v;
    batch.x[batch.count] = u.x;
    batch.y[batch.count] = u.y;
    batch.count += mesh.free[v] != 0 ? 1 : 0;  // others moved to a chain meanwhile
  }
}

}  // namespace

void divide_free_lists(CutContext& cut, std::array<PoolRun, 2> lists, const CollisionTriangle* into, int n, Vec2 m,
                       const Vec2* corner) {
  CellComplex& body = cut.body;
  std::array<PoolRun, 2> result[3];
  Batch batch;
  for (int s = 0; s < side_count(body); ++s) {
    const PoolRun run = lists[static_cast<std::size_t>(s)];
    const auto count = static_cast<std::size_t>(std::max(run.count, 0));
    for (auto& part : cut.scratch.part)
      if (part.size() < count) part.resize(count);
    VisualVertex* const part[3] = {cut.scratch.part[0].data(), cut.scratch.part[1].data(), cut.scratch.part[2].data()};
    std::size_t parts[3] = {};
    const std::span<const VisualVertex> list =
        count > 0 ? body.free_pool.slice(static_cast<std::size_t>(run.first), count) : std::span<const VisualVertex>{};
    for (std::size_t i = 0; i < count; i += Batch::kSize) {
      read_batch(body, list.subspan(i, std::min(Batch::kSize, count - i)), static_cast<Side>(s), batch);
      if (n == 2) {
        batch.tell_sides(1, m, corner[1]);
        for (std::size_t j = 0; j < batch.count; ++j) {
          const bool second = batch.side(1, j, m, corner[1]) > 0;
          part[0][parts[0]] = part[1][parts[1]] = batch.vertex[j];  // the one that is not its own is overwritten
          parts[0] += second ? 0 : 1;
          parts[1] += second ? 1 : 0;
        }
      } else {
        for (std::size_t line = 0; line < 3; ++line) batch.tell_sides(line, m, corner[line]);
        for (std::size_t j = 0; j < batch.count; ++j) {
          const bool left0 = batch.side(0, j, m, corner[0]) >= 0, left1 = batch.side(1, j, m, corner[1]) >= 0;
          const std::size_t k = left0 && !left1 ? 0 : left1 && batch.side(2, j, m, corner[2]) < 0 ? 1 : 2;
          part[k][parts[k]++] = batch.vertex[j];
        }
      }
    }
    // What goes into the first stays in place, but for gaps that close; the others follow it.
    std::int32_t next = run.first;
    for (int k = 0; k < n; ++k) {
      result[k][static_cast<std::size_t>(s)] = {next, static_cast<std::int32_t>(parts[k]), false};
      for (std::size_t i = 0; i < parts[k]; ++i) {
        const PoolIndex here(next++);
        if (body.free_pool[here] != part[k][i]) body.free_pool.set(here, part[k][i]);
      }
    }
  }
  for (int k = 0; k < n; ++k) body.collision.free.set(into[k], result[k]);
}

std::array<PoolRun, 2> joined_free_lists(CutContext& cut, CollisionTriangle a, CollisionTriangle b) {
  CellComplex& body = cut.body;
  std::array<PoolRun, 2> result;
  for (std::size_t s = 0; s < static_cast<std::size_t>(side_count(body)); ++s) {
    const PoolRun one = body.collision.free[a][s], two = body.collision.free[b][s];
    if (two.count == 0 || one.first + one.count == two.first) {
      result[s] = {one.first, one.count + two.count, false};
    } else if (one.count == 0 || two.first + two.count == one.first) {
      result[s] = {two.first, one.count + two.count, false};
    } else {
      result[s] = {static_cast<std::int32_t>(body.free_pool.size()), one.count + two.count, false};
      for (const PoolRun& run : {one, two})
        for (std::int32_t i = 0; i < run.count; ++i) {
          const VisualVertex v = body.free_pool[PoolIndex(run.first + i)];
          body.free_pool.push_back(v);
        }
    }
  }
  return result;
}

void add_free(CutContext& cut, CollisionTriangle f, Side side, VisualVertex v) {
  CellComplex& body = cut.body;
  std::array<PoolRun, 2> lists = body.collision.free[f];
  PoolRun& run = lists[static_cast<std::size_t>(index(side))];
  const auto end = static_cast<std::int32_t>(body.free_pool.size());
  if (run.first + run.count != end) {
    const PoolRun old = run;
    run.first = end;
    for (std::int32_t i = 0; i < old.count; ++i) {
      const VisualVertex u = body.free_pool[PoolIndex(old.first + i)];
      body.free_pool.push_back(u);
    }
  }
  body.free_pool.push_back(v);
  ++run.count;
  body.collision.free.set(f, lists);
}

}  // namespace kerf::cut
