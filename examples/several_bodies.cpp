// Three strips fall onto a board, one over the other, and all are cut at once.
#include <cstdio>

#include "kerf/kerf.h"

int main() {
  kerf::Scene scene;
  scene.body.model = "strip";
  for (int i = 1; i < 3; ++i) {
    kerf::SceneBody& more = scene.more_bodies.emplace_back();
    more.model = "strip";
    more.position = {0, 0, 0.008 * i};
    more.rotation = {0, 0, 0.6 * i};  // radians about z
  }
  scene.more_bodies[1].material.young = 1e6;  // pascals; the others are as [material] says
  kerf::SceneObstacle& board = scene.obstacles.emplace_back();
  board.shape = kerf::SceneShape::kPlane;
  board.position = {0, 0, -0.01};
  scene.simulation.time_step = 0.005;
  kerf::Result<kerf::Session> session = kerf::Session::create(scene);
  if (!session.ok()) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;

  kerf::Status done = session->step(60);
  // A blade cuts every layer that it meets where `through` is set, else only the first.
  if (done.ok()) done = session->begin_stroke(kerf::SceneFrame::kWorld, true);
  for (int i = 0; done.ok() && i <= 50; ++i) {
    const double y = -0.05 + 0.004 * i;
    done = session->move_blade({0.03, y, 0.05}, {0.03, y, -0.05});
  }
  if (done.ok()) done = session->end_stroke();
  if (done.ok()) done = session->step(20);
  if (done.ok()) done = session->validate();
  if (!done.ok()) return std::fprintf(stderr, "%s\n", done.error().message.c_str()), 1;
  int pressing = 0;
  for (const kerf::Session::ContactState& c : session->contacts()) pressing += c.normal_force > 0 ? 1 : 0;
  std::printf("%d pieces, %d contacts press\n", session->counts().pieces, pressing);
  return session->counts().pieces == 6 && pressing > 0 ? 0 : 1;
}
