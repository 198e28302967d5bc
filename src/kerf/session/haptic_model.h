// What a haptic device is told of the simulation: the tool, what it touches and how stiff that is, good for a few
// milliseconds around it. And the static problem that the device's thread solves with it (haptics.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kerf/base/rigid_place.h"
#include "kerf/base/vec.h"

namespace kerf {

/// A place of tissue that the tool touches, or nearly: it pushes back with stiffness x depth along -normal. Depth grows as
/// the tool's point moves along the normal.
struct HapticPlane {
  Vec3 arm;              ///< from the tool's centre, m, world axes as of the model
  Vec3 normal;           ///< unit, from the tool into the tissue
  double depth = 0;      ///< m, where the tool was; negative: a gap
  double stiffness = 0;  ///< N/m
};

inline constexpr std::size_t kHapticPlanes = 12;

/// Trivially copyable: it travels between threads.
struct HapticModel {
  double time = 0;    ///< s, of the clock that the device's thread reads
  double period = 0;  ///< s to the next model, about: a new one is faded in over it
  RigidPlace tool;    ///< where the tool was
  Vec3 force,
      torque;  ///< N, N m: of the body on the tool, with what resists an edge and what jaws hold, which are no planes
  double stiffness = 0, turning_stiffness = 0;  ///< of the coupling, N/m and N m/rad
  double max_force = 0;                         ///< N that the device is given at most; 0: no limit
  std::int32_t plane_count = 0;
  std::array<HapticPlane, kHapticPlanes> planes{};
};

struct Wrench {
  Vec3 force;   ///< N
  Vec3 torque;  ///< N m
};

/// A contact as the simulation left it.
struct HapticContact {
  Vec3 point;        ///< m
  Vec3 normal;       ///< unit, from the tool into the tissue
  double force = 0;  ///< N, normal, >= 0
  double gap = 0;    ///< m; counts where the force is 0
};

/// Reduces any number of contacts to at most kHapticPlanes: first those that push, then the nearest ones; the force of one that
/// is left out goes to the plane that it is most like. `tissue`: N/m of the tissue about the tool altogether, > 0.
void reduce_contacts(std::span<const HapticContact> contacts, double tissue, HapticModel& model);

/// Where the tool would come to rest between the device's pose and the planes, and the force and torque of the coupling on the
/// device there. Strictly convex: there is one answer. A dozen active-set steps of 6 unknowns.
struct HapticAnswer {
  RigidPlace tool;
  Wrench wrench;
  double coupling = 0, planes = 0;  ///< J that the springs of the coupling and of the planes hold there
};
HapticAnswer solve_proxy(const HapticModel& model, const RigidPlace& device);

}  // namespace kerf
