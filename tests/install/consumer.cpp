#include <cstdio>

#include "kerf/kerf.h"

int main() {
  kerf::Scene scene;
  scene.body.model = "steak";  // or mesh files, or a bound body
  kerf::Result<kerf::Session> session = kerf::Session::create(scene);
  if (!session.ok()) return std::puts(session.error().message.c_str()), 1;

  kerf::Status done = session->begin_stroke(kerf::SceneFrame::kRest, false);
  if (done.ok()) done = session->move_blade({0, -0.10, 0.05}, {0, -0.10, -0.05});  // base and tip of the edge, metres
  if (done.ok()) done = session->move_blade({0, 0.02, 0.05}, {0, 0.02, -0.05});
  if (done.ok()) done = session->end_stroke();
  if (done.ok()) done = session->step(100);
  if (!done.ok()) return std::puts(done.error().message.c_str()), 1;
  std::printf("%zu visual triangles\n", session->counts().visual_triangles);
}
