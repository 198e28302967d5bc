#include "kerf/binding/surface_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

constexpr std::size_t kLeafFaces = 4;

std::uint64_t spread(std::uint64_t x) {  // 10 bits to every third bit
  x &= 0x3ff;
  x = (x | (x << 16)) & 0x30000ff;
  x = (x | (x << 8)) & 0x300f00f;
  x = (x | (x << 4)) & 0x30c30c3;
  x = (x | (x << 2)) & 0x9249249;
  return x;
}

/// Sorts by key in three passes of 10 bits; stable.
void radix_sort(std::vector<std::uint64_t>& items, int first_bit) {
  std::vector<std::uint64_t> other(items.size());
  for (int pass = 0; pass < 3; ++pass) {
    const int shift = first_bit + 10 * pass;
    std::array<std::size_t, 1025> start{};
    for (const std::uint64_t x : items) ++start[((x >> shift) & 0x3ff) + 1];
    for (std::size_t i = 0; i < 1024; ++i) start[i + 1] += start[i];
    for (const std::uint64_t x : items) other[start[(x >> shift) & 0x3ff]++] = x;
    items.swap(other);
  }
}

}  // namespace

Vec3 closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  // Voronoi regions of the corners and edges, then the inside (Ericson, Real-Time Collision Detection, 5.1.5).
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return lerp(a, b, d1 / (d1 - d3));
  const Vec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return lerp(a, c, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return lerp(b, c, (d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double inverse = 1 / (va + vb + vc);
  return a + (vb * inverse * ab + vc * inverse * ac);
}

SurfaceTree::SurfaceTree(std::span<const Vec3> positions, std::span<const std::array<std::int32_t, 3>> triangles)
    : positions_(positions), triangles_(triangles) {
  Box3 bounds;
  for (const Vec3 p : positions) bounds.add(p);
  const Vec3 size = bounds.size();
  const auto cell = [](double x, double low, double extent) {
    return extent > 0 ? static_cast<std::uint64_t>(std::clamp(1024 * (x - low) / extent, 0.0, 1023.0)) : 0;
  };
  std::vector<std::uint64_t> keys(triangles.size());  // face in the low 32 bits, Morton code above
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto [a, b, c] = corners(static_cast<std::int32_t>(f));
    const Vec3 m = (1.0 / 3) * (a + b + c);
    const std::uint64_t code = spread(cell(m.x, bounds.min.x, size.x)) | spread(cell(m.y, bounds.min.y, size.y)) << 1 |
                               spread(cell(m.z, bounds.min.z, size.z)) << 2;
    keys[f] = code << 32 | f;
  }
  radix_sort(keys, 32);
  order_.resize(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order_[i] = static_cast<std::int32_t>(keys[i] & 0xffffffff);

  leaves_ = 1;
  while (leaves_ * kLeafFaces < order_.size()) leaves_ *= 2;
  constexpr float kInf = std::numeric_limits<float>::infinity();
  boxes_.assign(2 * leaves_ - 1, Box{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}});
  for (std::size_t i = 0; i < order_.size(); ++i) {
    Box& box = boxes_[leaves_ - 1 + i / kLeafFaces];
    for (const Vec3 p : corners(order_[i]))
      for (int k = 0; k < 3; ++k) {
        const auto x = static_cast<float>(p[k]);  // widened by one step: rounding must not leave the point outside
        auto& low = box.min[static_cast<std::size_t>(k)];
        auto& high = box.max[static_cast<std::size_t>(k)];
        if (x <= low) low = std::nextafter(x, -kInf);
        if (x >= high) high = std::nextafter(x, kInf);
      }
  }
  for (std::size_t i = leaves_ - 1; i-- > 0;)
    for (std::size_t k = 0; k < 3; ++k) {
      boxes_[i].min[k] = std::min(boxes_[2 * i + 1].min[k], boxes_[2 * i + 2].min[k]);
      boxes_[i].max[k] = std::max(boxes_[2 * i + 1].max[k], boxes_[2 * i + 2].max[k]);
    }
}

std::array<Vec3, 3> SurfaceTree::corners(std::int32_t f) const {
  const auto& t = triangles_[static_cast<std::size_t>(f)];
  return {positions_[static_cast<std::size_t>(t[0])], positions_[static_cast<std::size_t>(t[1])],
          positions_[static_cast<std::size_t>(t[2])]};
}

std::optional<SurfacePoint> SurfaceTree::closest(Vec3 p, Vec3 facing, double reach) const {
  std::optional<SurfacePoint> best;
  double best2 = reach < 1e150 ? reach * reach : HUGE_VAL;
  const bool any = facing == Vec3{};
  const auto distance2 = [&](const Box& box) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double low = box.min[static_cast<std::size_t>(k)], high = box.max[static_cast<std::size_t>(k)];
      const double d = p[k] < low ? low - p[k] : p[k] > high ? p[k] - high : 0;
      sum += d * d;
    }
    return sum;
  };
  struct Entry {
    std::size_t node;
    double d2;
  };
  std::array<Entry, 128> stack;
  std::size_t top = 0;
  stack[top++] = {0, distance2(boxes_[0])};
  while (top > 0) {
    const Entry e = stack[--top];
    if (e.d2 > best2) continue;
    if (e.node + 1 >= leaves_) {
      const std::size_t first = (e.node + 1 - leaves_) * kLeafFaces;
      for (std::size_t i = first; i < std::min(first + kLeafFaces, order_.size()); ++i) {
        const auto [a, b, c] = corners(order_[i]);
        if (!any && !(dot(cross(b - a, c - a), facing) > 0)) continue;
        const Vec3 q = closest_on_triangle(p, a, b, c);
        const double d2 = dot(q - p, q - p);
        if (d2 < best2 || (d2 == best2 && (!best || order_[i] < best->face))) {
          best2 = d2;
          best = SurfacePoint{order_[i], q, 0};
        }
      }
      continue;
    }
    const std::size_t l = 2 * e.node + 1, r = l + 1;
    const double dl = distance2(boxes_[l]), dr = distance2(boxes_[r]);
    if (dl <= dr) {
      stack[top++] = {r, dr};
      stack[top++] = {l, dl};
    } else {
      stack[top++] = {l, dl};
      stack[top++] = {r, dr};
    }
  }
  if (best) best->distance = std::sqrt(best2);
  return best;
}

std::optional<SurfacePoint> SurfaceTree::first_exit(Vec3 origin, Vec3 direction, double reach) const {
  std::optional<SurfacePoint> best;
  double limit = reach;
  const Vec3 inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};
  const auto entry = [&](const Box& box) {  // distance at which the ray enters, or infinity
    double enter = 0, leave = limit;
    for (int k = 0; k < 3; ++k) {
      const double low = box.min[static_cast<std::size_t>(k)], high = box.max[static_cast<std::size_t>(k)];
      if (direction[k] == 0) {
        if (origin[k] < low || origin[k] > high) return HUGE_VAL;
        continue;
      }
      const double t0 = (low - origin[k]) * inverse[k], t1 = (high - origin[k]) * inverse[k];
      enter = std::max(enter, std::min(t0, t1));
      leave = std::min(leave, std::max(t0, t1) * (1 + 1e-12));
    }
    return enter <= leave ? enter : HUGE_VAL;
  };
  struct Entry {
    std::size_t node;
    double t;
  };
  std::array<Entry, 128> stack;
  std::size_t top = 0;
  stack[top++] = {0, entry(boxes_[0])};
  while (top > 0) {
    const Entry e = stack[--top];
    if (!(e.t <= limit)) continue;
    if (e.node + 1 >= leaves_) {
      const std::size_t first = (e.node + 1 - leaves_) * kLeafFaces;
      for (std::size_t i = first; i < std::min(first + kLeafFaces, order_.size()); ++i) {
        const auto [a, b, c] = corners(order_[i]);
        const Vec3 e1 = b - a, e2 = c - a, n = cross(e1, e2);
        const double facing = dot(n, direction);
        if (!(facing > 0)) continue;
        const Vec3 ao = origin - a, m = cross(direction, ao);
        // Cramer's rule on a + u e1 + v e2 = origin + t direction.
        const double t = -dot(n, ao) / facing;
        const double u = dot(e2, m) / facing, v = -dot(e1, m) / facing;
        if (u < -kRaySlack || v < -kRaySlack || u + v > 1 + kRaySlack) continue;
        if (t < 0 || t > limit || (best && t == limit && order_[i] > best->face)) continue;
        limit = t;
        best = SurfacePoint{order_[i], origin + t * direction, t};
      }
      continue;
    }
    const std::size_t l = 2 * e.node + 1, r = l + 1;
    const double tl = entry(boxes_[l]), tr = entry(boxes_[r]);
    if (tl <= tr) {
      stack[top++] = {r, tr};
      stack[top++] = {l, tl};
    } else {
      stack[top++] = {l, tl};
      stack[top++] = {r, tr};
    }
  }
  return best;
}

}  // namespace kerf
