// A border loop of the mid-surface as a curve by arc length. Border vertices of the coarse mesh slide on it by their
// parameter, so that two borders that come close are never taken for each other.
#pragma once

#include <vector>

#include "kerf/base/vec.h"

namespace kerf::mid {

class BorderCurve {
 public:
  explicit BorderCurve(std::vector<Vec3> points);

  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] std::size_t size() const { return points_.size(); }
  /// Arc length up to point i.
  [[nodiscard]] double start(std::size_t i) const { return start_[i]; }
  [[nodiscard]] Vec3 at(double s) const;
  /// Into [0, length).
  [[nodiscard]] double wrap(double s) const;
  /// Way forward from a to b, in [0, length).
  [[nodiscard]] double ahead(double a, double b) const { return wrap(b - a); }
  /// Angle, radians, by which the curve turns between `reach` before s and `reach` behind it.
  [[nodiscard]] double turn(double s, double reach) const;

 private:
  std::vector<Vec3> points_;
  std::vector<double> start_;
  double length_ = 0;
};

}  // namespace kerf::mid
