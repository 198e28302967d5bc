// The loop of a game: frames of any length, steps of one length, a surface for drawing, cuts by a blade that is swung.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "kerf/kerf.h"

int main() {
  kerf::Scene scene;
  scene.body.model = "steak";
  scene.simulation.time_step = 1.0 / 120;
  scene.fixes.push_back({});
  scene.fixes[0].region.min = {-1, 0.05, -1};
  scene.fixes[0].region.max = {1, 1, 1};
  kerf::Result<kerf::Session> session = kerf::Session::create(scene);
  if (!session.ok()) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;

  std::vector<kerf::Vec3f> positions, normals;  // by visual vertex: what a renderer uploads
  std::uint64_t drawn = ~std::uint64_t{0};      // version of the triangles that it has
  double owed = 0, clock = 0;
  int uploads = 0;
  const auto frame = [&](double seconds) -> kerf::Status {
    clock += seconds;
    // A slow frame may owe many steps; after a long pause time is dropped.
    for (owed = std::min(owed + seconds, 0.1); owed >= session->time_step(); owed -= session->time_step()) {
      if (clock > 0.3 && clock < 0.8) {  // swung through the steak
        if (!session->in_stroke()) KERF_TRY(session->begin_stroke(kerf::SceneFrame::kWorld, false));
        const double x = -0.15 + 0.6 * (clock - 0.3);
        KERF_TRY(session->move_blade({x, 0, 0.3}, {x, -0.02, -0.5}));
      } else if (session->in_stroke()) {
        KERF_TRY(session->end_stroke());
      }
      const kerf::Result<kerf::SessionStep> step = session->step();
      if (!step.ok()) return step.error();
    }
    session->visual_skin(positions, normals);
    if (drawn != session->topology_version()) {  // new triangles too: body().complex.visual
      drawn = session->topology_version();
      ++uploads;
    }
    return {};
  };
  for (int i = 0; i < 90; ++i) {
    const kerf::Status done = frame(i % 30 == 7 ? 0.05 : 1.0 / 60);  // now and then a slow one
    if (!done.ok()) return std::fprintf(stderr, "%s\n", done.error().message.c_str()), 1;
  }
  std::printf("%d pieces, %zu vertices, triangles sent %d times\n", session->counts().pieces, positions.size(),
              uploads);
  return session->counts().pieces == 2 ? 0 : 1;
}
