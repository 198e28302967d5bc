// Contacts, tools and grasps as records of fixed layout: the dtypes of python/kerf/_records.py.
#pragma once

#include <array>
#include <cstdint>

#include "kerf/session/session.h"

namespace kerf::python {

/// Rows: x of the world comes from the first one.
using Rows = std::array<Vec3, 3>;
inline Rows rows(const Mat3& m) {
  Rows out;
  for (int i = 0; i < 3; ++i) out[static_cast<std::size_t>(i)] = {m.c[0][i], m.c[1][i], m.c[2][i]};
  return out;
}

struct ContactRecord {
  Vec3 point, normal, force;
  double gap, normal_force;
  std::int32_t obstacle, tool;
  std::uint8_t sliding;
  std::array<std::uint8_t, 7> unused;
};
static_assert(sizeof(ContactRecord) == 104);

struct ToolRecord {
  Vec3 position;
  Rows axes;
  Vec3 velocity, spin, pose_position;
  Rows pose_axes;
  double jaws;
  Vec3 force, torque, coupling_force, coupling_torque;
};
static_assert(sizeof(ToolRecord) == 43 * sizeof(double));

struct GraspRecord {
  Vec3 held, target, force;
  std::int64_t vertices;
};
static_assert(sizeof(GraspRecord) == 80);

inline ContactRecord record_of(const Session::ContactState& c) {
  return {c.point,
          c.normal,
          c.force,
          c.gap,
          c.normal_force,
          c.obstacle,
          c.tool,
          static_cast<std::uint8_t>(c.sliding ? 1 : 0),
          {}};
}
inline GraspRecord record_of(const Session::GraspState& g, Vec3 force) {
  return {g.held, g.target, force, static_cast<std::int64_t>(g.points.size())};
}
inline ToolRecord record_of(const Session::ToolState& t) {
  return {t.place.position, rows(t.place.axes), t.place.velocity, t.place.spin,
          t.pose.position,  rows(t.pose.axes),  t.jaws,           t.force,
          t.torque,         t.coupling_force,   t.coupling_torque};
}

}  // namespace kerf::python
