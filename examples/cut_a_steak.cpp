// Cuts a steak in two while it falls, and says what became of it.
#include <cstdio>

#include "kerf/kerf.h"

int main() {
  kerf::Scene scene;
  scene.body.model = "steak";
  scene.simulation.time_step = 0.002;

  kerf::Result<kerf::Session> session = kerf::Session::create(scene);
  if (!session.ok()) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;

  // The blade's edge stands upright and moves along y, 2 mm a step, while the steak falls.
  kerf::Status done = session->begin_stroke(kerf::SceneFrame::kWorld, false);
  for (int i = 0; done.ok() && i <= 100; ++i) {
    const double y = -0.1 + 0.002 * i;
    done = session->move_blade({0.01, y, 0.5}, {0.01, y, -0.5});
    if (done.ok()) done = session->step(1);
  }
  if (done.ok()) done = session->end_stroke();
  if (done.ok()) done = session->validate();  // closed, oriented, nothing lost
  if (!done.ok()) return std::fprintf(stderr, "%s\n", done.error().message.c_str()), 1;

  const kerf::BodyCounts counts = session->counts();
  std::printf("%d pieces, %zu visual triangles, %zu hexahedra\n", counts.pieces, counts.visual_triangles,
              counts.hexahedra);
  return counts.pieces == 2 ? 0 : 1;
}
