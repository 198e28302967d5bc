#include "kerf/midsurface/border_curve.h"

#include <algorithm>
#include <cmath>

namespace kerf::mid {

BorderCurve::BorderCurve(std::vector<Vec3> points) : points_(std::move(points)) {
  start_.reserve(points_.size() + 1);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    start_.push_back(length_);
    length_ += norm(points_[(i + 1) % points_.size()] - points_[i]);
  }
  start_.push_back(length_);
}

double BorderCurve::wrap(double s) const {
  if (!(length_ > 0)) return 0;
  s -= std::floor(s / length_) * length_;
  return s >= length_ || s < 0 ? 0 : s;
}

Vec3 BorderCurve::at(double s) const {
  s = wrap(s);
  const auto above = std::upper_bound(start_.begin(), start_.end() - 1, s);
  const auto i = static_cast<std::size_t>(above - start_.begin()) - 1;
  const double span = start_[i + 1] - start_[i];
  return lerp(points_[i], points_[(i + 1) % points_.size()], span > 0 ? (s - start_[i]) / span : 0);
}

double BorderCurve::turn(double s, double reach) const {
  const Vec3 p = at(s), before = normalized(p - at(s - reach)), after = normalized(at(s + reach) - p);
  return std::acos(std::clamp(dot(before, after), -1.0, 1.0));
}

}  // namespace kerf::mid
