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
  std::array<std::int8_t, kSize> side[3];  ///< sign of orient() against up to three lines
  std::size_t count = 0;

  /// side[which] = sign of orient(a, b, vertex), as in orient.h.
  void tell_sides(std::size_t which, Vec2 a, Vec2 b) {
    std::int8_t* const sign = side[which].data();
    std::size_t doubtful = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double left = (a.x - x[i]) * (b.y - y[i]), right = (a.y - y[i]) * (b.x - x[i]), det = left - right;
      const double error = exact::kFilter2d * (std::fabs(left) + std::fabs(right)) + exact::kUnderflow;
      const int told = static_cast<int>(det > error) - static_cast<int>(-det > error);
      sign[i] = static_cast<std::int8_t>(told);
      doubtful += told == 0 ? 1 : 0;
    }
    for (std::size_t i = 0; doubtful > 0; ++i)
      if (sign[i] == 0) {
        sign[i] = static_cast<std::int8_t>(exact::orient2d(a, b, {x[i], y[i]}));
        --doubtful;
      }
  }
};

/// Reads list items [first, last) into the batch.
void read_batch(const CellComplex& body, std::span<const VisualVertex> list, std::size_t first, std::size_t last, Side side, Batch& batch) {
  batch.count = 0;
  for (std::size_t i = first; i < last; ++i) {
    if (i + 2 * kPrefetchAhead < list.size()) {
      prefetch(body.visual.outgoing, list[i + 2 * kPrefetchAhead]);
      prefetch(body.visual.free, list[i + 2 * kPrefetchAhead]);
    }
    if (i + kPrefetchAhead < list.size()) prefetch(body.visual.planar, body.visual.outgoing[list[i + kPrefetchAhead]]);
    const VisualVertex v = list[i];
    const Vec2 u = mirrored(body.visual.planar[body.visual.outgoing[v]], side);
    batch.vertex[batch.count] = v;
    batch.x[batch.count] = u.x;
    batch.y[batch.count] = u.y;
    batch.count += body.visual.free[v] != 0 ? 1 : 0;  // others moved to a chain meanwhile
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
      read_batch(body, list, i, std::min(count, i + Batch::kSize), static_cast<Side>(s), batch);
      if (n == 2) {
        batch.tell_sides(1, m, corner[1]);
      } else {
        for (std::size_t k = 0; k < 3; ++k) batch.tell_sides(k, m, corner[k]);
      }
      for (std::size_t j = 0; j < batch.count; ++j) {
        std::size_t k = batch.side[1][j] > 0 ? 1 : 0;
        if (n == 3) {
          const bool left0 = batch.side[0][j] >= 0, left1 = batch.side[1][j] >= 0;
          k = left0 && !left1 ? 0 : left1 && batch.side[2][j] < 0 ? 1 : 2;
        }
        part[k][parts[k]++] = batch.vertex[j];
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

}  // namespace kerf::cut
