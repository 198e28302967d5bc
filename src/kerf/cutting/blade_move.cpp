#include "kerf/cutting/blade_move.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/rotation.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

double square(double x) { return x * x; }

/// Coordinates that something may have.
struct Range {
  double middle, half;
  [[nodiscard]] double least() const { return middle - half; }
  [[nodiscard]] double most() const { return middle + half; }
};

/// Least squares over vertices, of which each counts by weight_of(before, now).
template <class Weight>
MaterialMotion fit(const MovedMaterial& material, Weight&& weight_of) {
  MaterialMotion motion;
  if (material.is_still()) return motion;
  const auto for_each = [&](auto&& fn) {
    for (std::size_t i = 0; i < material.before.size(); ++i) {
      const Vec3 a = material.before[i], b = material.now[i];
      fn(a, b, weight_of(a, b));
    }
  };
  double sum = 0;
  Vec3 was, is;
  for_each([&](Vec3 a, Vec3 b, double weight) {
    sum += weight;
    was += weight * a;
    is += weight * b;
  });
  if (!(sum > 0)) return motion;
  motion.was = (1 / sum) * was, motion.is = (1 / sum) * is;
  double spread = 0;
  Mat3 moved{{Vec3{}, Vec3{}, Vec3{}}};
  for_each([&](Vec3 a, Vec3 b, double weight) {
    const Vec3 p = a - motion.was, q = weight * (b - motion.is);
    spread += weight * dot(p, p);
    moved.c[0] += p.x * q, moved.c[1] += p.y * q, moved.c[2] += p.z * q;
  });
  if (!(spread > 0)) return motion;
  for (Vec3& column : moved.c) column = (1 / spread) * column;
  const Mat3 rotation = followed_rotation(moved, {}, cut::kMoveIterations), still;
  double turned = 0;
  for (std::size_t k = 0; k < 3; ++k) turned = std::max(turned, norm(rotation.c[k] - still.c[k]));
  if (!(turned < cut::kMoveStill)) motion.rotation = rotation;
  return motion;
}

}  // namespace

BladeFrame frame_of(const BladeEdge& edge) {
  BladeFrame f;
  f.base = edge.base;
  f.length = norm(edge.tip - edge.base);
  f.along = (1 / f.length) * (edge.tip - edge.base);
  const Vec3 any = std::abs(f.along.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  f.aside = normalized(any - dot(any, f.along) * f.along);
  f.ahead = cross(f.along, f.aside);
  return f;
}

BladeMove BladeMove::through(const MovedMaterial& material, const BladeFrame& from, const BladeEdge& to, double reach) {
  BladeMove m = make(from, to, motion_near(material, from.edge(), to, reach).rotation);
  m.go_along(material, reach);
  return m;
}

BladeMove BladeMove::make(const BladeFrame& from, const BladeEdge& to, const Mat3& rotation) {
  BladeMove m;
  m.was = from;
  m.is = frame_of(to);
  // By the shortest turn from one edge to the other; if they are opposite, there is none.
  const Vec3 along = rotation * from.along, beside = rotation * from.aside, sum = along + m.is.along;
  if (!(dot(sum, sum) > 0)) return m;
  const Vec3 aside = beside - (2 * dot(beside, m.is.along) / dot(sum, sum)) * sum;
  m.is.aside = normalized(aside - dot(aside, m.is.along) * m.is.along);
  m.is.ahead = cross(m.is.along, m.is.aside);
  return m;
}

PassedBoxes::Axis PassedBoxes::axis(const BladeMove& move, Vec2 across) const {
  Axis a;
  a.was = across.x * move.was.aside + across.y * move.was.ahead;
  a.is = across.x * move.is.aside + across.y * move.is.ahead;
  a.offset_was = dot(move.was.base, a.was), a.offset_is = dot(move.is.base, a.is);
  return a;
}

PassedBoxes::PassedBoxes(const BladeMove& move, double farthest)
    : length_(std::max(move.was.length, move.is.length)), farthest_(farthest),
      rounding_(cut::kMoveRounding * (norm(move.was.base) + norm(move.is.base))) {
  along_ = {move.was.along, move.is.along, dot(move.was.base, move.was.along), dot(move.is.base, move.is.along)};
  const Vec2 way = move.was.across(move.is.base + 0.5 * move.is.length * move.is.along);
  const double far = norm(way);
  const Vec2 ahead = far > 0 ? (1 / far) * way : Vec2{1, 0}, beside{-ahead.y, ahead.x};
  across_[0] = axis(move, ahead), across_[1] = axis(move, beside);
  const Vec2 to[2] = {move.turn(ahead), move.turn(beside)};
  for (int k = 0; k < 2; ++k) turned_[0][k] = dot(ahead, to[k]), turned_[1][k] = dot(beside, to[k]);
}

bool PassedBoxes::may_pass(const Box3& box) const {
  const Vec3 middle = box.center(), half = 0.5 * (box.max - box.min);
  const auto range = [&](Vec3 axis, double offset, double more) {
    return Range{dot(middle, axis) - offset,
                 std::abs(axis.x) * half.x + std::abs(axis.y) * half.y + std::abs(axis.z) * half.z + more + rounding_};
  };
  const auto was = [&](const Axis& a) { return range(a.was, a.offset_was, farthest_); };
  const auto is = [&](const Axis& a) { return range(a.is, a.offset_is, 0); };
  const Range before[2] = {was(across_[0]), was(across_[1])};
  for (int k = 1; k >= 0; --k) {
    const double(&row)[2] = turned_[k];
    const Range now = is(across_[k]), between{row[0] * before[0].middle + row[1] * before[1].middle,
                                              std::abs(row[0]) * before[0].half + std::abs(row[1]) * before[1].half};
    if (std::min({before[k].least(), between.least(), now.least()}) > 0 ||
        std::max({before[k].most(), between.most(), now.most()}) < 0)
      return false;
  }
  const Range first = was(along_), last = is(along_);
  return std::min(first.least(), last.least()) <= length_ && std::max(first.most(), last.most()) >= 0;
}

double MovedMaterial::farthest() const {
  double most = 0;
  for (std::size_t i = 0; i < now.size() && !is_still(); ++i)
    most = std::max(most, dot(now[i] - before[i], now[i] - before[i]));
  return std::sqrt(most);
}

void BladeMove::go_along(const MovedMaterial& material, double reach) {
  if (material.is_still()) return;
  const auto for_each = [&](auto&& fn) {
    for (std::size_t i = 0; i < material.before.size(); ++i) {
      const Vec2 a = was.across(material.before[i]), b = is.across(material.now[i]);
      fn(a, b, 1 / square(reach * reach + dot(a, a) + dot(b, b)));
    }
  };
  double sum = 0;
  Vec2 mean_was, mean_is;
  for_each([&](Vec2 a, Vec2 b, double weight) {
    sum += weight;
    mean_was = mean_was + weight * a;
    mean_is = mean_is + weight * b;
  });
  if (!(sum > 0)) return;
  mean_was = (1 / sum) * mean_was, mean_is = (1 / sum) * mean_is;
  // Least squares: is = turned was, about the means.
  double xx = 0, xy = 0, yy = 0;
  Vec2 x, y;
  for_each([&](Vec2 a, Vec2 b, double weight) {
    const Vec2 p = a - mean_was, q = b - mean_is;
    xx += weight * p.x * p.x, xy += weight * p.x * p.y, yy += weight * p.y * p.y;
    x = x + weight * p.x * q, y = y + weight * p.y * q;
  });
  const double area = xx * yy - xy * xy;
  if (!(area > cut::kMoveFlat * (xx + yy) * (xx + yy))) return;
  const Vec2 first = (1 / area) * (yy * x - xy * y), second = (1 / area) * (xx * y - xy * x);
  if (!(cross(first, second) > cut::kMoveSqueezes) || !(std::max(norm(first), norm(second)) * cut::kMoveSqueezes < 1))
    return;
  // What keeps still does so to the bit.
  if (std::max(norm(first - turned[0]), norm(second - turned[1])) < cut::kMoveStill) return;
  turned[0] = first, turned[1] = second;
}

MaterialMotion motion_near(const MovedMaterial& material, const BladeEdge& was, const BladeEdge& is, double reach) {
  return fit(material, [&](Vec3 a, Vec3 b) {
    return 1 / square(reach * reach + square(distance_to_segment(a, was.base, was.tip)) +
                      square(distance_to_segment(b, is.base, is.tip)));
  });
}

MaterialMotion motion_of(const MovedMaterial& material, const BladeEdge& was, double reach) {
  return fit(material, [&](Vec3 a, Vec3) {
    return 1 / square(reach * reach + square(distance_to_segment(a, was.base, was.tip)));
  });
}

}  // namespace kerf
