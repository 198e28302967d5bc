// All paths of the 65-vertex, 104-triangle collision disc (168 edges) on the open sheet, flat and bumpy, without walls;
// then building a BVH and asking it. One thread, its own time, median of some repeats. Where CGAL is installed its shortest paths are
// measured in the same run.
//
//   geodesic_bench [exact|local|cgal|bvh]    only that part
//   geodesic_bench --json FILE               all of the paths, as a file for `kerf bench page`
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <vector>

#ifdef KERF_BENCH_CGAL
#include <CGAL/version.h>

#include "geodesic/shortest_path_oracle.h"
#endif
#include "bench/bench_table.h"
#include "bench/machine.h"
#include "bench/timing.h"
#include "kerf/base/parallel.h"
#include "kerf/base/random.h"
#include "kerf/geodesic/path_scratch.h"
#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/models.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/spatial/bvh.h"

namespace {

using namespace kerf;

double seconds(auto&& work) {
  const double start = bench::thread_seconds();
  work();
  return bench::thread_seconds() - start;
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

enum class How { kLocal, kExact, kCgal };
constexpr const char* kHowNames[] = {"local", "exact", "cgal"};

bench::Table table{
    "geodesics",
    "Geodesic paths, beside CGAL's shortest paths",
    "The 168 paths of the 104-triangle collision mesh on the open sheet, flat and with bumps, without walls; milliseconds of the "
    "thread. CGAL's Surface_mesh_shortest_path over Simple_cartesian<double> has one sequence tree per source, asked for the lengths "
    "to its targets. Building its mesh is included. Lengths of local paths are never shorter than the exact ones.",
    {"visual vertices", "bumps (m)", "paths", "all 168 paths (ms)", "total length (m)"},
    {}};

#ifdef KERF_BENCH_CGAL
/// Sum of the lengths, by CGAL: one tree per source.
double cgal_length(const WalledSurface& m, const std::set<std::pair<std::int32_t, std::int32_t>>& edges) {
  WalledSurface open = m;
  std::fill(open.wall.begin(), open.wall.end(), std::uint8_t{0});
  const test::CutOpen cut(open);
  std::map<std::int32_t, std::int32_t> number;  // of surface vertices in the cut mesh
  for (std::size_t h = 0; h < m.origin.size(); ++h) number[m.origin[h]] = cut.vertex[h];
  double length = 0;
  for (auto it = edges.begin(); it != edges.end();) {
    const std::int32_t s = it->first;
    std::vector<std::int32_t> targets;
    for (; it != edges.end() && it->first == s; ++it) targets.push_back(number[it->second]);
    for (const double d : test::exact_distances_to(open, cut, number[s], targets)) length += d;
  }
  return length;
}
#endif

void paths(std::size_t triangles, double bumps, How how) {
  const bool exact = how == How::kExact;
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
#ifdef KERF_BENCH_CGAL
  if (how == How::kCgal) {
    const double time = median(triangles > 5'000 ? 1 : 3, [&] { length = cgal_length(m, edges); });
    fmt::print("{:>7} vertices, bumps {:.2f} m, {} paths, cgal : {:8.2f} ms, total length {:.9f} m\n",
               m.position.size(), bumps, edges.size(), 1e3 * time, length);
    table.rows.push_back(
        {static_cast<double>(m.position.size()), bumps, kHowNames[2], 1e3 * time, fmt::format("{:.9f}", length)});
    return;
  }
#endif
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
  fmt::print(
      "{:>7} vertices, bumps {:.2f} m, {} paths, {:5}: {:8.2f} ms, {:6.1f} stops and {:7.0f} windows a path, total length {:.9f} m\n",
      m.position.size(), bumps, edges.size(), exact ? "exact" : "local", 1e3 * time, stops / double(edges.size()),
      windows / double(edges.size()), length);
  std::fflush(stdout);
  table.rows.push_back({static_cast<double>(m.position.size()), bumps, kHowNames[static_cast<int>(how)], 1e3 * time,
                        fmt::format("{:.9f}", length)});
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
      sum += tree.closest(view, {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.1, 0.1)})
                 .distance;
  });
  fmt::print(
      "{:>8} triangles: build {:7.1f} ms, refit {:6.1f} ms, {:4.1f} bytes a triangle, first hit {:5.2f} us, closest point {:5.2f} us ({})\n",
      view.size(), 1e3 * build, 1e3 * refit, double(tree.bytes()) / double(view.size()), 1e6 * rays / n,
      1e6 * points / n, sum > 0);
}

}  // namespace

int main(int argc, char** argv) {
  const ThreadLimit one(1);
  const char* file = argc > 2 && std::strcmp(argv[1], "--json") == 0 ? argv[2] : nullptr;
  const auto wanted = [&](const char* part) {
    return argc < 2 || (file ? std::strcmp(part, "bvh") != 0 : std::strcmp(argv[1], part) == 0);
  };
  for (const double bumps : {0.0, 0.03})
    for (const std::size_t triangles : {1664u, 6656u, 26624u, 106496u})
      for (const How how : {How::kLocal, How::kExact, How::kCgal}) {
#ifndef KERF_BENCH_CGAL
        if (how == How::kCgal) continue;
#endif
        if (how == How::kCgal && triangles > 10'000) continue;  // minutes
        if (wanted(kHowNames[static_cast<int>(how)])) paths(triangles, bumps, how);
      }
  if (wanted("bvh"))
    for (const std::size_t triangles : {100000u, 1000000u}) bvh(triangles);
  if (!file) return 0;
#ifdef KERF_BENCH_CGAL
  table.note += " CGAL " CGAL_VERSION_STR ".";
#endif
  bench::Run run{"build/release/bench/geodesic_bench --json FILE", bench::machine_facts(), {table}, {}};
  if (const Status written = replace_file(file, bench::run_json(run)); !written) {
    fmt::print("{}\n", written.error().message);
    return 1;
  }
  return 0;
}
