// Contact rows made by hand for the tests of the response: points of box bodies against planes and against each other.
#pragma once

#include <algorithm>
#include <vector>

#include "kerf/mechanics/step.h"
#include "mechanics/test_bodies.h"

namespace kerf::test {

struct Plane {
  Vec3 point, normal{0, 0, 1};
  Vec3 velocity;
  double friction = 0;
};

/// One row per point of an element, given in natural coordinates, against a plane.
inline void add_plane_row(const MechanicsModel& model, const MechanicsState& state, HexId cell, Vec3 xi,
                          const Plane& plane, std::uint64_t key, ContactSet& set, double offset = 0) {
  ContactRow row;
  row.key = key;
  row.cell = cell;
  row.first = static_cast<std::int32_t>(set.entries.size());
  row.count = 8;
  const std::array<double, 8> weights = shape_functions(xi);
  Vec3 at;
  for (int c = 0; c < 8; ++c) {
    const NodeId node = model.element(cell).nodes[c];
    set.entries.push_back({node, weights[c]});
    at += weights[c] * state.positions[node.index()];
  }
  row.normal = plane.normal;
  row.gap = dot(at - plane.point, plane.normal) - offset;
  row.other_velocity = plane.velocity;
  row.friction = plane.friction;
  set.rows.push_back(row);
}

/// The lower corners of a grid's bottom cells, one row per node.
inline void bottom_rows(const MechanicsModel& model, const MechanicsState& state, const Grid& g, const Plane& plane,
                        ContactSet& set) {
  for (int y = 0; y <= g.ny; ++y)
    for (int x = 0; x <= g.nx; ++x) {
      const int cx = std::min(x, g.nx - 1), cy = std::min(y, g.ny - 1);
      add_plane_row(model, state, g.cell(cx, cy, 0), {x > cx ? 1.0 : -1.0, y > cy ? 1.0 : -1.0, -1.0}, plane,
                    static_cast<std::uint64_t>(y * (g.nx + 1) + x), set);
    }
}

inline void clear(ContactSet& set) {
  set.rows.clear();
  set.entries.clear();
}

inline Vec3 momentum(MechanicsModel& model, const MechanicsState& state) {
  Vec3 sum;
  for (std::size_t i = 0; i < state.velocities.size(); ++i) sum += model.node_mass(NodeId(i)) * state.velocities[i];
  return sum;
}

inline double rms_speed(const MechanicsState& state) {
  double sum = 0;
  for (Vec3 v : state.velocities) sum += dot(v, v);
  return std::sqrt(sum / static_cast<double>(state.velocities.size()));
}

}  // namespace kerf::test
