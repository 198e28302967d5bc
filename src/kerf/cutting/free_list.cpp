#include "kerf/cutting/free_list.h"

#include <algorithm>

#include "kerf/cutting/orient.h"

namespace kerf::cut {

void divide_free_lists(CutContext& cut, std::array<PoolRun, 2> lists, const CollisionTriangle* into, int n, Vec2 m,
                       const Vec2* corner) {
  CellComplex& body = cut.body;
  std::array<PoolRun, 2> result[3];
  for (int s = 0; s < side_count(body); ++s) {
    const PoolRun run = lists[static_cast<std::size_t>(s)];
    const auto count = static_cast<std::size_t>(std::max(run.count, 0));
    for (auto& part : cut.scratch.part)
      if (part.size() < count) part.resize(count);
    VisualVertex* const part[3] = {nullptr, cut.scratch.part[1].data(), cut.scratch.part[2].data()};
    std::size_t parts[3] = {};
    // What goes into the first stays in place, but for gaps that close; the others follow it.
    std::int32_t next = run.first;
    const auto put = [&](VisualVertex v) {
      const PoolIndex here(next++);
      if (body.free_pool[here] != v) body.free_pool.set(here, v);
    };
    for (std::size_t i = 0; i < count; ++i) {
      const VisualVertex v = body.free_pool[PoolIndex(static_cast<std::size_t>(run.first) + i)];
      if (!body.visual.free[v]) continue;
      const Vec2 u = mirrored(body.visual.planar[body.visual.outgoing[v]], static_cast<Side>(s));
      int k = 0;
      if (n == 2) {
        k = orient(m, corner[1], u) > 0 ? 1 : 0;
      } else {
        const bool left0 = orient(m, corner[0], u) >= 0, left1 = orient(m, corner[1], u) >= 0;
        if (left0 && !left1)
          k = 0;
        else
          k = left1 && orient(m, corner[2], u) < 0 ? 1 : 2;
      }
      if (k == 0) put(v);
      else part[k][parts[k]] = v;
      ++parts[k];
    }
    std::int32_t first = run.first;
    for (int k = 0; k < n; ++k) {
      if (k > 0)
        for (std::size_t i = 0; i < parts[k]; ++i) put(part[k][i]);
      result[k][static_cast<std::size_t>(s)] = {first, static_cast<std::int32_t>(parts[k]), false};
      first = next;
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
