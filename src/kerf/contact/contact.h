// One contact between a body and something: what detection finds and the session turns into rows for the time step.
//
// The body is a prism (mid-surface plus and minus the half thickness along the normal), not a ball swept over the
// mid-surface: the two lips of a fresh cut touch with a gap of exactly zero.
#pragma once

#include <array>
#include <cstdint>

#include "kerf/base/ids.h"
#include "kerf/base/vec.h"
#include "kerf/embedding/embedding.h"

namespace kerf {

/// A point of a body: on one collision triangle, edge or vertex, lifted off the mid-surface. It lies at
///   sum w (position + lift offset),   offset: from a vertex to the + corner of its prism, deformed.
struct SurfacePoint {
  std::int32_t body = 0;                  ///< which one, where there are several
  std::array<CollisionVertex, 3> vertex;  ///< unused ones, at the end, are invalid
  std::array<double, 3> weight{};         ///< sum 1 over the used ones
  double lift = 0;                        ///< 1: on the + side, -1: on the - side, 0: on the mid-surface
};

struct Contact {
  std::uint64_t key = 0;       ///< features that touch (kind, obstacle, vertex or edge or face on each side); unique
  SurfacePoint a;              ///< the body's point
  CollisionHalfEdge lip;       ///< on this lip of a slit: its tip is carried as this lip is. None: as all are
  EmbeddedPoint carrier;       ///< a's place where one cell carries it, and not its vertices; else without a copy
  SurfacePoint b;              ///< the other point of a body, if vertex[0] is valid
  std::int32_t obstacle = -1;  ///< else: index of the obstacle
  std::int32_t tool = -1;      ///< or of the tool, whose freedoms are solved for
  Vec3 point;                  ///< where they touch, on the other side, m
  Vec3 normal;                 ///< unit, from the other side to a
  double gap = 0;              ///< at the start of the step, m
  Vec3 other_velocity;         ///< of the obstacle at `point`, m/s
  double friction = 0;
};

}  // namespace kerf
