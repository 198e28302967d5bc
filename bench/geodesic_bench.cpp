// All paths of the 65-vertex, 104-triangle collision disc (168 edges) on the open sheet, flat and bumpy, without walls;
// then building a BVH and asking it. One thread, median of some repeats.
//
//   geodesic_bench [exact|local|bvh]    only that part
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <set>
#include <vector>

#include "kerf/base/parallel.h"
#include "kerf/base/random.h"
#include "kerf/geodesic/path_scratch.h"
#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/models.h"
#include "kerf/spatial/bvh.h"

namespace {

using namespace kerf;

double seconds(auto&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}
double median(int repeats, auto&& work) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) times.push_back(seconds(work));
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

WalledSurface surface_of(const TriangleMesh& mesh) {
  WalledSurface m;
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (const auto& t : mesh.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
  auto arrays = build_half_edges(triangles, mesh.positions.size());
  if (!arrays) std::abort();
  m.position = mesh.positions.raw();
  m.outgoing = arrays->outgoing;
  m.twin = arrays->twin;
  for (const auto& t : triangles) m.origin.insert(m.origin.end(), t.begin(), t.end());
  m.wall.assign(m.origin.size(), 0);
  m.wall_vertex.assign(m.position.size(), 0);
  for (std::int32_t h = 0; h < std::int32_t(m.origin.size()); ++h)
    if (m.opposite(h) < 0) m.wall_vertex[std::size_t(m.from(h))] = m.wall_vertex[std::size_t(m.to(h))] = 1;
  return m;
}

void paths(std::size_t triangles, double bumps, bool exact) {
  ModelOptions options;
  options.visual_triangles = triangles;
  options.collision_triangles = 104;
  options.bumps = bumps;
  const auto model = make_model("sheet", options);
  if (!model) {
    fmt::print("{}\n", model.error().message);
    return;
  }
  WalledSurface m = surface_of(model->visual);
  std::vector<std::int32_t> bound;
  for (const Vec3 p : model->collision.positions) {
    std::int32_t best = 0;
    for (std::int32_t v = 0; v < std::int32_t(m.position.size()); ++v)
      if (norm(m.at(v) - p) < norm(m.at(best) - p)) best = v;
    bound.push_back(best);
    m.wall_vertex[std::size_t(best)] = 1;
  }
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  for (const auto& t : model->collision.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = bound[t[k].index()], b = bound[t[(k + 1) % 3].index()];
      edges.insert({std::min(a, b), std::max(a, b)});
    }
  PathScratch scratch;
  double length = 0, stops = 0, windows = 0;
  const double time = median(exact ? 3 : 11, [&] {
    length = stops = windows = 0;
    for (const auto& [s, t] : edges) {
      const auto path = find_path(m, s, t, {}, {}, {exact}, scratch);
      if (!path) {
        fmt::print("{}\n", path.error().message);
        continue;
      }
      length += path->length;
      stops += double(path->stops.size());
      windows += double(scratch.exact.windows.size());
    }
  });
  fmt::print("{:>7} vertices, bumps {:.2f} m, {} paths, {:5}: {:8.2f} ms, {:6.1f} stops and {:7.0f} windows a path, total length {:.9f} m\n",
             m.position.size(), bumps, edges.size(), exact ? "exact" : "local", 1e3 * time, stops / double(edges.size()),
             windows / double(edges.size()), length);
}

void bvh(std::size_t triangles) {
  ModelOptions options;
  options.visual_triangles = triangles;
  options.bumps = 0.05;
  const auto model = make_model("closed-sheet", options);
  if (!model) return;
  const TriangleView view(model->visual);
  TriangleBvh tree;
  const double build = median(3, [&] { tree = TriangleBvh(view); });
  const double refit = median(3, [&] { tree.refit(view); });
  Random random(1);
  const int n = 100000;
  double sum = 0;
  const double rays = seconds([&] {
    for (int i = 0; i < n; ++i)
      sum += tree.first_hit(view, {{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 1}, {0.01, 0.02, -1}}).t;
  });
  const double points = seconds([&] {
    for (int i = 0; i < n; ++i)
      sum += tree.closest(view, {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.1, 0.1)}).distance;
  });
  fmt::print("{:>8} triangles: build {:7.1f} ms, refit {:6.1f} ms, {:4.1f} bytes a triangle, first hit {:5.2f} us, closest point {:5.2f} us ({})\n",
             view.size(), 1e3 * build, 1e3 * refit, double(tree.bytes()) / double(view.size()), 1e6 * rays / n,
             1e6 * points / n, sum > 0);
}

}  // namespace

int main(int argc, char** argv) {
  const ThreadLimit one(1);
  const auto wanted = [&](const char* part) { return argc < 2 || std::strcmp(argv[1], part) == 0; };
  for (const bool exact : {false, true})
    if (wanted(exact ? "exact" : "local"))
      for (const double bumps : {0.0, 0.03})
        for (const std::size_t triangles : {1664u, 6656u, 26624u, 106496u}) paths(triangles, bumps, exact);
  if (wanted("bvh"))
    for (const std::size_t triangles : {100000u, 1000000u}) bvh(triangles);
}
