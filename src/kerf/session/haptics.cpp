#include "kerf/session/haptics.h"

#include <algorithm>
#include <cmath>

#include "kerf/session/contact_step.h"

namespace kerf {
namespace {

/// The planes are this many times as stiff as a block of tissue as large as a cell. Too stiff is damping: what a step finds softer
/// reaches the device as planes that give way late. Too soft is the opposite, and shakes.
constexpr double kFirmer = 5;

/// N s/m: what takes back energy that was not paid for. A device of 50 g that is asked every millisecond stays stable with it.
constexpr double kMostDamping = 20;

}  // namespace

HapticModel haptic_model(const Session& session, std::size_t tool, double time) {
  HapticModel model;
  const Scene& scene = session.scene();
  const std::vector<Session::ToolState> tools = session.tools();
  if (tool >= tools.size() || tool >= scene.tools.size()) return model;
  const RigidTool coupling = rigid_tool(scene.tools[tool], tool_at_start(scene.tools[tool]), 0, session.time_step());
  model.time = time;
  model.period = session.time_step();
  model.tool = {tools[tool].place.position, tools[tool].place.axes};
  model.force = tools[tool].force;
  model.torque = tools[tool].torque;
  model.stiffness = coupling.stiffness;
  model.turning_stiffness = coupling.turning_stiffness;
  model.max_force = coupling.max_force;
  std::vector<HapticContact> contacts;
  for (const Session::ContactState& c : session.contacts())
    if (c.tool == static_cast<std::int32_t>(tool)) contacts.push_back({c.point, c.normal, c.normal_force, c.gap});
  const Vec3 cell = largest_cell(session.body().hex);
  const double tissue = kFirmer * session.material().young * std::max({cell.x, cell.y, cell.z});
  reduce_contacts(contacts, tissue, model);
  return model;
}

void publish_haptics(const Session& session, std::size_t tool, double time, HapticChannel& channel) {
  channel.write(haptic_model(session, tool, time));
}

SceneCommand tool_to(const std::string& id, const RigidPlace& place, double over) {
  SceneCommand command;
  command.what = SceneToolMotion{id, {{over, place.position, turn_of(place.axes)}}};
  return command;
}

Wrench HapticServo::wrench(const RigidPlace& device, double time) {
  bool fresh = false;
  const HapticModel& newest = channel_.read(fresh);
  if (fresh) {
    fading_ = any_;
    before_ = now_;
    now_ = newest;
    since_ = time;
    any_ = true;
  }
  if (!any_ || !is_finite(device.position) || !is_finite(turn_of(device.axes))) return {};
  HapticAnswer answer = solve_proxy(now_, device);
  double held = answer.coupling + answer.planes, most = answer.coupling + kFirmer * answer.planes;
  const double share = now_.period > 0 ? std::clamp((time - since_) / now_.period, 0.0, 1.0) : 1.0;
  if (fading_ && share < 1) {
    const HapticAnswer old = solve_proxy(before_, device);
    held += (1 - share) * (old.coupling + old.planes - held);
    most += (1 - share) * (old.coupling + kFirmer * old.planes - most);
    answer.wrench.force = lerp(old.wrench.force, answer.wrench.force, share);
    answer.wrench.torque = lerp(old.wrench.torque, answer.wrench.torque, share);
    answer.tool = between(old.tool, answer.tool, share);
  }
  tool_ = answer.tool;
  const double alive = std::clamp(2 - (time - now_.time) / kStale, 0.0, 1.0);
  Wrench out{alive * answer.wrench.force, alive * answer.wrench.torque};
  keep_passive(device, time, alive * held, alive * most, out);
  return out;
}

void HapticServo::keep_passive(const RigidPlace& device, double time, double held, double most, Wrench& answer) {
  const double tick = time - last_time_;
  if (booked_ && tick > 0) {
    const Vec3 move = device.position - last_device_.position,
               turned = turn_of(product(device.axes, transposed(last_device_.axes)));
    store_ = std::min(store_ - dot(last_.force, move) - dot(last_.torque, turned), most);
    const double power = (dot(answer.force, move) + dot(answer.torque, turned)) / tick;
    if (power > 0 && store_ < held) {
      const double paid = std::sqrt(std::fmax(0.0, store_) / held);
      const double size = norm(answer.force), speed = power / std::fmax(size, 1e-12);
      const double share = std::fmax(paid, 1 - kMostDamping * speed / std::fmax(size, 1e-12));
      answer = {share * answer.force, share * answer.torque};
    }
  }
  booked_ = true;
  last_device_ = device;
  last_ = answer;
  last_time_ = time;
}

}  // namespace kerf
