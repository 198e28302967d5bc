// Cuts across sheets on 104 collision triangles, open and closed, in the rest configuration: collision mesh, visual mesh
// and walls, without cells and embeddings. One thread, thread time; memory touched beforehand.
// Prints microseconds per collision triangle (median, 99th percentile), per border-to-border cut (median), per undo, and of a
// provisional tip walked again.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/cutting/cut_memory.h"
#include "kerf/cutting/cut_path.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/rest_cut.h"
#include "kerf/cutting/topology_change.h"
#include "kerf/mesh/models.h"

namespace {

using namespace kerf;

double now() {  // microseconds of this thread
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

double percentile(std::vector<double> v, double p) {
  if (v.empty()) return 0;
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(p * static_cast<double>(v.size() - 1))];
}

Vec2 flat(const CollisionMesh& mesh, CollisionVertex v) { return {mesh.rest[v].x, mesh.rest[v].y}; }

/// The target of the next step from `tip` towards q on a flat sheet; false: out of the sheet.
bool next_target(const CellComplex& body, CollisionVertex tip, Vec2 q, FacePoint& target) {
  const CollisionMesh& mesh = body.collision;
  bool found = false;
  cut::for_each_corner(mesh, tip, [&](CollisionHalfEdge h) {
    const Vec2 c = flat(mesh, mesh.from(h)), a = flat(mesh, mesh.to(h)), b = flat(mesh, mesh.apex(h));
    const double oa = cut::orient(c, a, q), ob = cut::orient(c, b, q);
    if (!(oa >= 0 && ob <= 0 && oa > ob)) return true;
    const double area = cut::orient(c, a, b), wc = cut::orient(q, a, b) / area, f = oa / (oa - ob);
    const double w[3] = {wc > 0 ? wc : 0, wc > 0 ? -ob / area : 1 - f, wc > 0 ? oa / area : f};
    target.face = CollisionMesh::face(h);
    for (int i = 0; i < 3; ++i) target.weights[static_cast<std::size_t>((h.value + i) % 3)] = std::clamp(w[i], 0.0, 1.0);
    found = true;
    return false;
  });
  return found;
}

void measure(const std::string& name, CellComplex body) {
  reserve_cut_memory(body, 60000);
  CutOptions options;
  CutScratch scratch;
  TopologyChange change;
  Random random(7);
  std::vector<double> step, whole, undo, again, collect;
  Box3 box;
  for (const Vec3& p : body.collision.rest.raw()) box.add(p);
  const auto at = [&](double x, double y) { return Vec3{box.min.x + x * box.size().x, box.min.y + y * box.size().y, 0}; };
  JournalMark clean;
  journal_mark(body, clean);
  for (int i = 0; i < 22; ++i) {
    const double a = random.uniform(0.05, 0.95), b = random.uniform(0.05, 0.95);
    const Vec3 from = i % 2 ? at(0, a) : at(a, 0), to = i % 2 ? at(1.2, b) : at(b, 1.2);
    double distance = 0;
    const FacePoint start = nearest_rest_point(body, from, distance);
    double cut_time = 0;
    double t0 = now();
    auto tip = start_cut(body, start, options, scratch);
    cut_time += now() - t0;
    bool fine = tip.ok();
    while (fine) {
      FacePoint target;
      if (!next_target(body, *tip, {to.x, to.y}, target)) break;
      t0 = now();
      const auto advance = advance_cut(body, *tip, target, options, scratch);
      const double t = now() - t0;
      fine = advance.ok();
      if (!fine) break;
      if (i >= 2) step.push_back(t);
      cut_time += t;
      *tip = advance->tip;
      if (advance->kind == Advance::Kind::kRanOut) break;
    }
    if (!fine) {
      fmt::print("{}: refused\n", name);
      return;
    }
    t0 = now();
    collect_topology_change(body, clean, scratch, change);
    const double collect_time = now() - t0;
    t0 = now();
    journal_rollback(body, clean);
    const double undo_time = now() - t0;
    if (i < 2) continue;
    whole.push_back(cut_time);
    undo.push_back(undo_time);
    collect.push_back(collect_time);
  }
  // A blade that moves on inside: from the same stab to a new point every pose.
  for (int i = 0; i < 20; ++i) {
    const Vec3 p = at(random.uniform(0.2, 0.8), random.uniform(0.2, 0.8));
    for (int k = 1; k <= 5; ++k) {
      const double t0 = now();
      journal_rollback(body, clean);
      const Vec3 path[2] = {p, p + Vec3{0.012 * k, 0.007 * k, 0}};
      if (!cut_rest_polyline(body, path, options, scratch)) return;
      again.push_back(now() - t0);
    }
    journal_rollback(body, clean);
  }
  fmt::print("{:<16}{:>9.1f}{:>9.1f}{:>12.3f}{:>10.1f}{:>10.1f}{:>10.1f}{:>10.1f}{:>8}\n", name, percentile(step, 0.5),
             percentile(step, 0.99), 1e-3 * percentile(whole, 0.5), percentile(collect, 0.5), percentile(undo, 0.5),
             percentile(again, 0.5), percentile(again, 0.99), step.size());
}

}  // namespace

int main() {
  fmt::print("{:<16}{:>9}{:>9}{:>12}{:>10}{:>10}{:>10}{:>10}{:>8}\n", "", "tri p50", "tri p99", "cut p50 ms", "change us",
             "undo us", "tip p50", "tip p99", "steps");
  for (const bool closed : {false, true})
    for (const std::size_t triangles : {1664u, 6656u, 26624u, 106496u}) {
      ModelOptions options;
      options.visual_triangles = triangles;
      auto model = make_model(closed ? "closed-sheet" : "sheet", options);
      if (!model) {
        fmt::print("{}\n", model.error().message);
        continue;
      }
      BindOptions bind_options;
      if (!closed) bind_options.thickness = 0.1;
      auto body = bind(model->visual, model->collision, bind_options);
      if (!body) {
        fmt::print("{}\n", body.error().message);
        continue;
      }
      const std::string name = fmt::format("{} {}", closed ? "closed" : "sheet", body->complex.visual.vertex_count());
      measure(name, std::move(body->complex));
    }
}
