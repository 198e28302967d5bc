// A ball in a hand: the simulation runs at its own rate, a second thread asks for the force a thousand times a second.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "kerf/kerf.h"

namespace {

/// Where the hand is: it comes down onto the steak and stays there.
kerf::RigidPlace hand(double time) {
  kerf::RigidPlace place;
  place.position = {0, 0, 0.06 - 0.05 * std::min(1.0, time / 0.5)};
  return place;
}

}  // namespace

int main() {
  kerf::Scene scene;
  scene.body.model = "steak";
  scene.simulation.gravity = {};
  scene.simulation.time_step = 0.01;
  scene.fixes.push_back({});  // a box that holds the far side
  scene.fixes[0].region.min = {-1, 0.05, -1};
  scene.fixes[0].region.max = {1, 1, 1};
  kerf::SceneRigidTool ball;
  ball.id = "ball";
  ball.kind = kerf::SceneToolKind::kSphere;
  ball.radius = 0.01;
  ball.position = hand(0).position;
  scene.tools.push_back(ball);
  kerf::Result<kerf::Session> session = kerf::Session::create(scene);
  if (!session.ok()) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;

  kerf::HapticChannel channel;
  std::atomic<bool> over = false;
  const auto begin = std::chrono::steady_clock::now();
  const auto now = [begin] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  int asked = 0;
  double most = 0;
  std::thread device([&] {
    kerf::HapticServo servo(channel);
    for (; !over; ++asked) {
      const kerf::Wrench w = servo.wrench(hand(now()), now());  // a device is given this
      most = std::max(most, kerf::norm(w.force));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  kerf::Status done;
  while (done.ok() && now() < 1) {
    done = session->apply(kerf::tool_to("ball", hand(now()), session->time_step()));
    if (done.ok()) done = session->step(1);
    kerf::publish_haptics(*session, 0, now(), channel);
    std::this_thread::sleep_for(std::chrono::milliseconds(8));
  }
  over = true;
  device.join();
  if (!done.ok()) return std::fprintf(stderr, "%s\n", done.error().message.c_str()), 1;
  std::printf("%d answers, %.3f N at most\n", asked, most);
  return most > 0 ? 0 : 1;
}
