// The haptic channel: force and torque for whoever holds a tool, at the rate of a device (1 kHz), while the simulation runs at
// its own. The simulation publishes a HapticModel after every step; the device's thread solves for the tool between
// its pose and that model. A force held from step to step would be unstable; this is not, since each answer is that of springs, and
// what a new model would give to a device beyond what it has paid is damped away.
//
//   simulation                                   device, every millisecond
//   session.step();                              Wrench w = servo.wrench(pose, now);
//   publish_haptics(session, 0, now, channel);   device.give(w);
//   session.apply(tool_to(...device's pose))
//
// What a device feels are contacts. What resists an edge that cuts, and what jaws hold, is in HapticModel::force, but not in wrench().
//
// No device drivers here. Everything is plain memory: no locks, no allocation, on both sides.
#pragma once

#include <memory>

#include "kerf/base/latest.h"
#include "kerf/session/haptic_model.h"
#include "kerf/session/session.h"

namespace kerf {

using HapticChannel = Latest<HapticModel>;

/// What the last step leaves of a tool, by its number in the scene; `time`: of the clock that the servo's thread reads.
HapticModel haptic_model(const Session& session, std::size_t tool, double time);

/// The same into a channel. After every step.
void publish_haptics(const Session& session, std::size_t tool, double time, HapticChannel& channel);

/// A command that leads the tool's pose to a place within `over` seconds, straight and evenly: the time of a step, where a device
/// tells its pose before each.
SceneCommand tool_to(const std::string& id, const RigidPlace& place, double over);

/// The device's side; one thread.
class HapticServo {
 public:
  explicit HapticServo(HapticChannel& channel) : channel_(channel) {}

  /// Force and torque on the device's handle at this pose, N and N m; nothing before the first model. A new model is faded in over
  /// its period; one older than kStale fades out. The cost is that of two solve_proxy. Poses that are not finite get nothing.
  /// To be asked every millisecond or so: how the device moves is taken from its poses.
  Wrench wrench(const RigidPlace& device, double time);
  /// Where the tool would be, for whoever draws it at the device's rate.
  [[nodiscard]] const RigidPlace& tool() const { return tool_; }

  static constexpr double kStale = 0.050;  ///< s after which a model fades, within as long again

 private:
  /// Books the work that the last answer did on the way to this pose, and takes back what an answer would give beyond what was paid for.
  void keep_passive(const RigidPlace& device, double time, double held, double most, Wrench& answer);

  HapticChannel& channel_;
  HapticModel now_, before_;
  double since_ = 0;  ///< when now_ came
  bool any_ = false, fading_ = false;
  RigidPlace tool_;
  double store_ = 0;  ///< J that the device has given and not got back, as far as springs can hold it
  RigidPlace last_device_;
  Wrench last_;  ///< the last answer
  double last_time_ = 0;
  bool booked_ = false;  ///< there is a last answer
};

}  // namespace kerf
