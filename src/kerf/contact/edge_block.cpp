#include "kerf/contact/edge_block.h"

#include <algorithm>

#include "kerf/contact/detect_scratch.h"

namespace kerf {
namespace {

/// Places from the centre are exact to this part of the extent, and so is where they lie along a direction.
constexpr float kBlockRounding = 2e-6f;
/// Rounding of the products that say where two lines are nearest, over the extent's third power and the length of one edge.
constexpr float kFeetRounding = 2.5e-4f;
constexpr float kFarEdge = 1e30f;

inline Eight all(float x) { return all_eight(x); }
inline Eight dot3(const Eight (&a)[3], const Eight (&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Farther apart than `reach` along an axis?
inline EightBits apart(const EdgeBlock& block, const EdgeProbe& probe) {
  const Eight reach = all(probe.reach + kBlockRounding * probe.extent);
  EightBits out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float low = std::min(probe.a.x[k], probe.b.x[k]), high = std::max(probe.a.x[k], probe.b.x[k]);
    out |= lesser(block.a[k], block.b[k]) - all(high) > reach;
    out |= all(low) - greater(block.a[k], block.b[k]) > reach;
  }
  return out;
}

/// Is each of two edges seen from the other in a direction that points into one of its faces, whichever sign it has?
inline EightBits beside(const EdgeBlock& block, const EdgeProbe& probe) {
  const Eight margin = all(static_cast<float>(kOffFaces) * probe.reach + kBlockRounding * probe.extent);
  EightBits above{}, below{}, over{}, under{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& n = probe.into[i].x;
    const Eight first = n[0] * block.a[0] + n[1] * block.a[1] + n[2] * block.a[2] - probe.at[i];
    const Eight last = n[0] * block.b[0] + n[1] * block.b[1] + n[2] * block.b[2] - probe.at[i];
    above |= lesser(first, last) > margin;
    below |= greater(first, last) < -margin;
    const auto& m = block.into[i];
    const Eight start = m[0] * probe.a.x[0] + m[1] * probe.a.x[1] + m[2] * probe.a.x[2] - block.at[i];
    const Eight end = m[0] * probe.b.x[0] + m[1] * probe.b.x[1] + m[2] * probe.b.x[2] - block.at[i];
    over |= lesser(start, end) > margin;
    under |= greater(start, end) < -margin;
  }
  return (above & below) | (over & under);
}

/// Are the lines nearest to each other outside of one of the edges? inner_feet(), with what rounding may add.
inline EightBits feet_outside(const EdgeBlock& block, const EdgeProbe& probe) {
  Eight u[3], v[3], w[3];
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = all(probe.b.x[k] - probe.a.x[k]);
    v[k] = block.b[k] - block.a[k];
    w[k] = probe.a.x[k] - block.a[k];
  }
  const Eight uu = dot3(u, u), vv = dot3(v, v), uv = dot3(u, v), uw = dot3(u, w), vw = dot3(v, w);
  const Eight det = uu * vv - uv * uv, s = uv * vw - vv * uw, t = uu * vw - uv * uw;
  const float size = kFeetRounding * probe.extent * probe.extent * probe.extent;
  const Eight slack_s = size * block.length, slack_t = all(size * probe.length);
  return (s < -slack_s) | (s > det + slack_s) | (t < -slack_t) | (t > det + slack_t);
}

}  // namespace

EdgeBlock empty_edges() {
  EdgeBlock block{};
  for (std::size_t k = 0; k < 3; ++k) block.a[k] = block.b[k] = all(kFarEdge);
  return block;
}

PointBlock empty_points() {
  PointBlock block{};
  for (Eight& p : block.p) p = all(kFarEdge);
  return block;
}

void set_point(Vec3 p, std::int32_t vertex, Vec3 centre, std::size_t i, PointBlock& block) {
  for (int k = 0; k < 3; ++k) block.p[k][i] = static_cast<float>(p[k] - centre[k]);
  block.vertex[i] = vertex;
}

unsigned near_box(const PointBlock& block, const TreeBox& box, float reach) {
  Eight square{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Eight d = greater(greater(all(box.min.x[k]) - block.p[k], block.p[k] - all(box.max.x[k])), Eight{});
    square += d * d;
  }
  return zeros(square > all(reach * reach));
}

void set_edge(const ObstacleLeaves::Edge& edge, std::uint32_t place, Vec3 centre, std::size_t i, EdgeBlock& block) {
  const Vec3 a = edge.a - centre, b = edge.b - centre;
  for (int k = 0; k < 3; ++k) {
    const auto n = static_cast<std::size_t>(k);
    block.a[n][i] = static_cast<float>(a[k]);
    block.b[n][i] = static_cast<float>(b[k]);
    for (std::size_t j = 0; j < 2; ++j) block.into[j][n][i] = static_cast<float>(edge.into[j][k]);
  }
  for (std::size_t j = 0; j < 2; ++j) block.at[j][i] = static_cast<float>(dot(edge.into[j], a));
  block.length[i] = edge.length;
  block.edge[i] = place;
}

unsigned may_touch(const EdgeBlock& block, const EdgeProbe& probe) {
  EightBits out = apart(block, probe);
  if (zeros(out) == 0) return 0;
  out |= beside(block, probe);
  if (zeros(out) == 0) return 0;
  out |= feet_outside(block, probe);
  return zeros(out);
}

}  // namespace kerf
