// The meniscus of the paper (5.3): a punch with everything that follows it, along the inner rim as in figure 23; loose pieces taken
// away; passes of a shaver over the jagged edge, as in figure 24.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/session/session.h"

namespace {

using namespace kerf;
/// Milliseconds of this thread: what else the machine does doesn't count.
double now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double quantile(std::vector<double> v, double p) {
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(std::ceil(p * static_cast<double>(v.size()))) - 1)];
}

/// Places along the inner rim: border vertices nearer to the middle of the box than the mean.
std::vector<Vec3> inner_rim(const Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  std::vector<Vec3> border;
  Box3 box;
  for (std::size_t i = 0; i < mesh.vertex_count(); ++i) {
    const CollisionVertex v(i);
    box.add(mesh.rest[v]);
    if (mesh.on_border(v)) border.push_back(mesh.rest[v]);
  }
  double mean = 0;
  for (const Vec3 p : border) mean += norm(p - box.center()) / static_cast<double>(border.size());
  std::erase_if(border, [&](Vec3 p) { return norm(p - box.center()) > 0.8 * mean; });
  return border;
}

/// The meniscus; `held`: by its horns, to move in steps of 2 ms.
Result<Session> meniscus(bool held) {
  Scene scene;
  scene.name = "meniscus";
  scene.body.model = "meniscus";
  if (held) {
    scene.simulation.time_step = 0.002;
    SceneFix horns;
    horns.region.shape = SceneRegion::Shape::kHalfSpace;
    horns.region.point = {0, 0.027, 0};
    horns.region.normal = {0, 1, 0};
    scene.fixes.push_back(horns);
  }
  return Session::create(scene);
}

/// A jagged bite; those of every run lie and measure otherwise.
Result<PunchReport> bite(Session& session, Vec3 place, int run) {
  Punch p;
  p.centre = place + Vec3{1e-4 * run, 0, 0};
  p.outline = circle_outline(0.0015 + 1e-4 * run, 5e-5);
  return session.punch(p, SceneFrame::kRest, 1e-4);
}

/// The middles of all edges that are cut.
std::vector<Vec3> cut_edges(const Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  std::vector<Vec3> middles;
  for (const CollisionHalfEdge h : session.body().complex.wall_edge.raw())
    middles.push_back(lerp(mesh.rest[mesh.from(h)], mesh.rest[mesh.to(h)], 0.5));
  return middles;
}

/// A pass of a shaver of 1 mm; depth 0 takes bumps only.
Result<ShaveReport> pass(Session& session, Vec3 at, double depth) {
  return session.shave({at + Vec3{0, 0, 1e-3}, at - Vec3{0, 0, 1e-3}, 1e-3}, SceneFrame::kRest, 0.3, depth);
}

}  // namespace

int main() {
  std::vector<double> all, cut, wall, follow, pieces, removal, bumps, edges, moving, moving_punch, steps;
  int refused = 0, retries = 0;
  for (int run = 0; run < 12; ++run) {
    auto made = meniscus(false);
    if (!made.ok()) return fmt::print("{}\n", made.error().message), 1;
    Session session = std::move(made).value();
    if (run == 0) {
      const BodyCounts c = session.counts();
      fmt::print("meniscus: {} / {} visual, {} / {} collision vertices / triangles, {} nodes, {} hexahedra\n",
                 c.visual_vertices, c.visual_triangles, c.collision_vertices, c.collision_triangles, c.nodes,
                 c.hexahedra);
    }
    const std::vector<Vec3> places = inner_rim(session);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double start = now();
      const auto done = bite(session, places[i], run);
      const double ms = now() - start;
      if (!done.ok()) {
        ++refused;
        continue;
      }
      if (!done->cut) continue;
      all.push_back(ms);
      cut.push_back(1e3 * done->times.cut_and_binding);
      wall.push_back(1e3 * done->times.cut_surface);
      follow.push_back(1e3 * done->times.embedding);
      pieces.push_back(session.strokes().back().triangles);
      retries += session.strokes().back().refused > 0 ? 1 : 0;
      const double before = now();
      const auto gone = session.remove_piece(done->loose[0]);
      if (gone.ok()) removal.push_back(now() - before);
    }
    // A shaver of 1 mm along the cut edges, first for the bumps only.
    const std::vector<Vec3> lips = cut_edges(session);
    for (std::size_t i = 0; i < 2 * lips.size(); ++i) {
      const Vec3 at = lips[i % lips.size()];
      const bool deep = i >= lips.size();
      const double before = now();
      const auto done = pass(session, at, deep ? 1e-5 : 0);
      if (done.ok()) (deep ? edges : bumps).push_back(now() - before);
    }
  }
  // The same in a body that moves: a probe's press has gone through it, and a step follows every pass.
  for (int run = 0; run < 6; ++run) {
    auto made = meniscus(true);
    if (!made.ok()) return fmt::print("{}\n", made.error().message), 1;
    Session session = std::move(made).value();
    for (int i = 0; i < 5; ++i) (void)session.step();
    const std::vector<Vec3> places = inner_rim(session);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double start = now();
      const auto done = bite(session, places[i], run);
      if (!done.ok() || !done->cut) continue;
      moving_punch.push_back(now() - start);
      (void)session.remove_piece(done->loose[0]);
      (void)session.step();
    }
    const std::vector<Vec3> lips = cut_edges(session);
    for (std::size_t i = 0; i < 2 * lips.size(); ++i) {
      const Vec3 at = lips[i % lips.size()];
      const double before = now();
      const auto done = pass(session, at, 1e-5);
      if (done.ok()) moving.push_back(now() - before);
      const double stepped = now();
      (void)session.step();
      steps.push_back(now() - stepped);
    }
  }
  fmt::print("{} punches, {} retried, {} refused; {:.0f} collision triangles each\n", all.size(), retries, refused,
             quantile(pieces, 0.5));
  fmt::print("milliseconds of this thread (stages: wall)\n                         median    99 %    most\n");
  const auto row = [](const char* name, const std::vector<double>& v) {
    fmt::print("{:<22} {:8.3f} {:7.3f} {:7.3f}\n", name, quantile(v, 0.5), quantile(v, 0.99), quantile(v, 1));
  };
  row("everything", all);
  row("cut and binding", cut);
  row("cut surface", wall);
  row("lattice, embedding", follow);
  row("taking it away", removal);
  row("shaving bumps", bumps);
  row("shaving edges back", edges);
  row("everything, moving", moving_punch);
  row("shaving edges, moving", moving);
  row("a step between them", steps);
}
