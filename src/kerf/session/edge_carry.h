// How an edge that cuts goes along with the material at it, over a step.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/blade_sweep.h"

namespace kerf {

/// Motions of places at an edge: their mean, and a straight line through them over the edge's length.
class CarriedEdge {
 public:
  explicit CarriedEdge(const BladeEdge& edge)
      : base_(edge.base), along_(edge.tip - edge.base), squared_(dot(along_, along_)) {}
  /// A place that was `at` and has moved by `motion`, metres.
  void add(Vec3 at, Vec3 motion) {
    const double s = squared_ > 0 ? std::clamp(dot(at - base_, along_) / squared_, 0.0, 1.0) : 0;
    least_ = std::min(least_, s), most_ = std::max(most_, s);
    s_ += s, ss_ += s * s;
    m_ += motion, sm_ += s * motion;
    ++places;
  }
  /// All that another one has of the same edge.
  void add(const CarriedEdge& other) {
    least_ = std::min(least_, other.least_), most_ = std::max(most_, other.most_);
    s_ += other.s_, ss_ += other.ss_;
    m_ += other.m_, sm_ += other.sm_;
    places += other.places;
  }
  [[nodiscard]] Vec3 mean() const { return (1.0 / places) * m_; }
  /// Is the motion known along so much of the edge that this turns with the material?
  [[nodiscard]] bool turns() const { return most_ - least_ > kTurns; }
  [[nodiscard]] BladeEdge moved(const BladeEdge& edge) const {
    const double n = places, spread = n * ss_ - s_ * s_;
    const Vec3 slope = (1 / spread) * (n * sm_ - s_ * m_), first = (1 / n) * (m_ - s_ * slope);
    return {edge.base + first, edge.tip + first + slope};
  }

  int places = 0;

 private:
  static constexpr double kTurns = 0.25;  // of the length
  Vec3 base_, along_, m_, sm_;
  double squared_ = 0, least_ = HUGE_VAL, most_ = -HUGE_VAL, s_ = 0, ss_ = 0;
};

/// Adds the places of the middle surface that have crossed an edge, while vertices went straight from `before` to `after` and the edge from `from`
/// to `to`. `spacing`: of the points of the edge that are looked at, metres.
void add_crossings(const CollisionMesh& mesh, const std::vector<Vec3>& before, const std::vector<Vec3>& after,
                   const BladeEdge& from, const BladeEdge& to, double spacing, CarriedEdge& carried);

}  // namespace kerf
