// The track of a blade between two poses, as one front of a cut sees it (docs/cutting.md, "From tool motion to a cut path").
#pragma once

#include <cmath>
#include <optional>

#include "kerf/cutting/blade_sweep.h"
#include "kerf/spatial/predicates.h"

namespace kerf {

inline constexpr double kLeastProgress = 0.02; // cosine to the blade's motion below which a direction does not lead on
inline constexpr double kFlat = 0.1;           // the same, below which a direction lies along the blade
inline constexpr double kOnTheLine = 1e-12;    // of coordinates: nearer to the blade's line, rounding would say which way it moves
inline constexpr double kShort = 1e-4;          // of the way to the blade's base: so near, the direction is made upright again
inline constexpr double kLengthSlack = 1e-9;   // of the edge's length: the ends of a blade belong to it

/// The plane that holds the point where a front is and the edge where the blade is going, with progress measured
/// along it: negative behind the blade, zero at it.
struct TrackPlane {
  Vec3 a, b, c;  // three points of the plane, for exact signs
  Vec3 origin, along, motion;
  double along_squared = 0;

  /// Plane through `from` and the line of `edge`; none if `from` is on that line, but for rounding.
  static std::optional<TrackPlane> make(Vec3 from, const BladeEdge& edge) {
    TrackPlane p;
    p.a = from;
    p.b = edge.base;
    p.c = edge.tip;
    p.origin = edge.base;
    p.along = edge.tip - edge.base;
    p.along_squared = dot(p.along, p.along);
    const Vec3 back = from - edge.base;
    const Vec3 off = back - (dot(back, p.along) / p.along_squared) * p.along;
    const double distance = norm(off);
    if (!(distance > kOnTheLine * (norm(from) + norm(edge.base) + norm(back)))) return std::nullopt;
    p.motion = (-1 / distance) * off;
    // What rounding leaves of the blade's own direction weighs much where the rest is short.
    if (distance < kShort * norm(back)) p.motion = normalized(p.motion - (dot(p.motion, p.along) / p.along_squared) * p.along);
    return p;
  }
  /// True above the plane. Zero counts as below, for everybody, so that neighbours agree.
  [[nodiscard]] bool above(Vec3 p) const { return orient3d(a, b, c, p) > 0; }
  [[nodiscard]] double height(Vec3 p) const { return std::abs(orient3d_value(p)); }
  [[nodiscard]] double orient3d_value(Vec3 p) const { return dot(cross(b - a, c - a), p - a); }
  [[nodiscard]] double progress(Vec3 p) const { return dot(p - origin, motion); }
  /// Position along the blade: 0 at the base, 1 at the tip.
  [[nodiscard]] double along_blade(Vec3 p) const { return dot(p - origin, along) / along_squared; }
  /// Fraction from p to q, which lie on different sides, at which the plane is crossed.
  [[nodiscard]] double crossing(Vec3 p, Vec3 q) const {
    const double hp = height(p), hq = height(q);
    return hp + hq > 0 ? hp / (hp + hq) : 0.5;
  }
};

/// Which part of the blade passed a point, and when.
struct Passing {
  double depth = 0;  // 0 at the base, 1 at the tip
  double time = 0;   // 0 .. 1 of the move
  [[nodiscard]] bool in_blade() const { return depth >= -kLengthSlack && depth <= 1 + kLengthSlack; }
};

}  // namespace kerf
