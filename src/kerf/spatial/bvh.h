// A bounding volume hierarchy over triangles: ray hits, closest points, box overlaps.
//
// It holds boxes and indices only; every query is given the triangles again. Boxes are floats rounded outward, 32
// bytes a node and about 70 to 90 bytes a triangle in all. Results do not depend on the shape of the tree: equal
// distances go to the smallest triangle.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/spatial/triangle_queries.h"
#include "kerf/spatial/triangle_view.h"

namespace kerf {

/// Accepts every candidate.
struct AcceptAll {
  template <class Candidate>
  bool operator()(const Candidate&) const {
    return true;
  }
};

class TriangleBvh {
 public:
  TriangleBvh() = default;
  /// O(n log n): binned surface-area heuristic. Positions must be finite; triangles may be degenerate.
  /// For few queries of many triangles (`queries` counted roughly), runs of consecutive triangles are kept together where they are as near
  /// each other as in most files: the tree is smaller, sooner there, and the results are the same.
  explicit TriangleBvh(const TriangleView& triangles, std::size_t queries = SIZE_MAX);

  /// Fits the boxes to moved vertices (the same triangles). O(n); queries slow down with the amount of reshuffling.
  void refit(const TriangleView& triangles);

  /// The hit with the smallest t in [t_min, t_max] that accept(const RayHit&) is true for; not valid() if none.
  template <class Accept = AcceptAll>
  [[nodiscard]] RayHit first_hit(const TriangleView& triangles, const Ray& ray, Accept&& accept = {}) const;

  /// Replaces `hits` by all hits by t, then triangle. A ray through an edge or corner hits every triangle there.
  template <class Accept = AcceptAll>
  void all_hits(const TriangleView& triangles, const Ray& ray, std::vector<RayHit>& hits, Accept&& accept = {}) const;

  /// The closest point no farther than max_distance (metres) that accept(const ClosestPoint&) is true for; not valid()
  /// if none. accept sees the closest point of one triangle after another.
  template <class Accept = AcceptAll>
  [[nodiscard]] ClosestPoint closest(const TriangleView& triangles, Vec3 p, double max_distance = HUGE_VAL,
                                     Accept&& accept = {}) const;

  /// Calls visit(std::int32_t triangle) for every triangle whose bounding box touches `box`, in no particular (but
  /// always the same) order.
  template <class Visit>
  void for_each_in_box(const TriangleView& triangles, const Box3& box, Visit&& visit) const;

  struct Node {
    std::array<float, 3> min, max;
    std::uint32_t first = 0;  ///< leaf: position in order(); inner: its children are nodes first and first + 1
    std::uint32_t count = 0;  ///< triangles of a leaf, 0 for an inner node
  };
  /// The tree itself, for traversals of two trees at once. Children come after their parents; node 0 is the root.
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<std::int32_t>& order() const { return order_; }

  [[nodiscard]] std::size_t size() const { return order_.size(); }
  [[nodiscard]] std::size_t bytes() const { return nodes_.size() * sizeof(Node) + order_.size() * sizeof(order_[0]); }

 private:
  // The builder halves by count below a fixed depth, so that no path is longer.
  static constexpr std::size_t kStack = 128;
  struct Builder;

  struct RaySlabs {
    Vec3 origin, inverse;
    explicit RaySlabs(const Ray& ray)
        : origin(ray.origin), inverse{1 / ray.direction.x, 1 / ray.direction.y, 1 / ray.direction.z} {}
    // Entry parameter, or HUGE_VAL if the ray misses the box within [t_min, t_max]. Slabs are widened by a few
    // roundings; a ray inside a slab's own plane gives 0 x inf, and the slab is ignored: its other end is infinite.
    [[nodiscard]] double enter(const Node& node, double t_min, double t_max) const {
      constexpr double kWiden = 4e-15;
      double near = t_min, far = t_max;
      for (int k = 0; k < 3; ++k) {
        const double a = (node.min[static_cast<std::size_t>(k)] - origin[k]) * inverse[k];
        const double b = (node.max[static_cast<std::size_t>(k)] - origin[k]) * inverse[k];
        if (std::isnan(a) || std::isnan(b)) continue;
        const double lo = std::min(a, b), hi = std::max(a, b);
        near = std::max(near, lo * (lo > 0 ? 1 - kWiden : 1 + kWiden));
        far = std::min(far, hi * (hi > 0 ? 1 + kWiden : 1 - kWiden));
      }
      return near <= far ? near : HUGE_VAL;
    }
  };
  static double squared_distance(const Node& node, Vec3 p) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double lo = node.min[static_cast<std::size_t>(k)] - p[k], hi = p[k] - node.max[static_cast<std::size_t>(k)];
      const double d = std::max({0.0, lo, hi});
      sum += d * d;
    }
    return sum;
  }

  std::vector<Node> nodes_;
  std::vector<std::int32_t> order_;
};

template <class Accept>
RayHit TriangleBvh::first_hit(const TriangleView& triangles, const Ray& ray, Accept&& accept) const {
  RayHit best;
  if (nodes_.empty()) return best;
  const RaySlabs slabs(ray);
  const RayFrame frame(ray);
  double t_max = ray.t_max;
  struct Entry {
    double near;
    std::uint32_t node;
  };
  std::array<Entry, kStack> stack;
  std::size_t depth = 0;
  const double root = slabs.enter(nodes_[0], ray.t_min, ray.t_max);
  if (root < HUGE_VAL) stack[depth++] = {root, 0};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.near > t_max) continue;
    const Node& node = nodes_[entry.node];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      RayHit hit;
      if (!intersect(frame, triangles[order_[i]], hit) || hit.t < ray.t_min || hit.t > t_max) continue;
      hit.triangle = order_[i];
      if (best.valid() && hit.t == best.t && hit.triangle > best.triangle) continue;
      if (!accept(static_cast<const RayHit&>(hit))) continue;
      best = hit;
      t_max = hit.t;
    }
    if (node.count > 0) continue;
    Entry children[2];
    for (std::uint32_t k = 0; k < 2; ++k)
      children[k] = {slabs.enter(nodes_[node.first + k], ray.t_min, t_max), node.first + k};
    if (children[0].near < children[1].near) std::swap(children[0], children[1]);  // the nearer one on top
    for (const Entry& child : children)
      if (child.near < HUGE_VAL) stack[depth++] = child;
  }
  return best;
}

template <class Accept>
void TriangleBvh::all_hits(const TriangleView& triangles, const Ray& ray, std::vector<RayHit>& hits,
                           Accept&& accept) const {
  hits.clear();
  if (nodes_.empty()) return;
  const RaySlabs slabs(ray);
  const RayFrame frame(ray);
  std::array<std::uint32_t, kStack> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (!(slabs.enter(node, ray.t_min, ray.t_max) < HUGE_VAL)) continue;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      RayHit hit;
      if (!intersect(frame, triangles[order_[i]], hit) || hit.t < ray.t_min || hit.t > ray.t_max) continue;
      hit.triangle = order_[i];
      if (accept(static_cast<const RayHit&>(hit))) hits.push_back(hit);
    }
    if (node.count > 0) continue;
    stack[depth++] = node.first + 1;
    stack[depth++] = node.first;
  }
  std::sort(hits.begin(), hits.end(),
            [](const RayHit& a, const RayHit& b) { return a.t != b.t ? a.t < b.t : a.triangle < b.triangle; });
}

template <class Accept>
ClosestPoint TriangleBvh::closest(const TriangleView& triangles, Vec3 p, double max_distance, Accept&& accept) const {
  // Box distances are rounded differently from triangle distances: a box is dropped only if clearly farther.
  constexpr double kSlack = 1 + 1e-12;
  if (nodes_.empty()) return {};
  ClosestPoint best;
  best.distance = max_distance;
  double limit = max_distance * max_distance * kSlack;
  struct Entry {
    double distance;
    std::uint32_t node;
  };
  std::array<Entry, kStack> stack;
  std::size_t depth = 0;
  stack[depth++] = {squared_distance(nodes_[0], p), 0};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.distance > limit) continue;
    const Node& node = nodes_[entry.node];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      ClosestPoint candidate;
      closest_point(p, triangles[order_[i]], candidate);
      candidate.triangle = order_[i];
      if (candidate.distance > best.distance) continue;
      if (best.valid() && candidate.distance == best.distance && candidate.triangle > best.triangle) continue;
      if (!accept(static_cast<const ClosestPoint&>(candidate))) continue;
      best = candidate;
      limit = best.distance * best.distance * kSlack;
    }
    if (node.count > 0) continue;
    Entry children[2];
    for (std::uint32_t k = 0; k < 2; ++k) children[k] = {squared_distance(nodes_[node.first + k], p), node.first + k};
    if (children[0].distance < children[1].distance) std::swap(children[0], children[1]);
    for (const Entry& child : children)
      if (child.distance <= limit) stack[depth++] = child;
  }
  if (!best.valid()) best.distance = HUGE_VAL;
  return best;
}

template <class Visit>
void TriangleBvh::for_each_in_box(const TriangleView& triangles, const Box3& box, Visit&& visit) const {
  if (nodes_.empty() || box.empty()) return;
  const auto apart = [&](const auto& min, const auto& max) {
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (min[i] > box.max[k] || max[i] < box.min[k]) return true;
    }
    return false;
  };
  std::array<std::uint32_t, kStack> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (apart(node.min, node.max)) continue;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const std::array<Vec3, 3> t = triangles[order_[i]];
      std::array<double, 3> min, max;
      for (std::size_t k = 0; k < 3; ++k) {
        const int axis = static_cast<int>(k);
        min[k] = std::min({t[0][axis], t[1][axis], t[2][axis]});
        max[k] = std::max({t[0][axis], t[1][axis], t[2][axis]});
      }
      if (!apart(min, max)) visit(order_[i]);
    }
    if (node.count > 0) continue;
    stack[depth++] = node.first + 1;
    stack[depth++] = node.first;
  }
}

}  // namespace kerf
