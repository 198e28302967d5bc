#include "kerf/contact/leaf_boxes.h"

#include <cfloat>
#include <cmath>

#ifdef __AVX__
#include <immintrin.h>
#endif

namespace kerf {
namespace {

constexpr float kFar = 1e18f;  // its square is finite

inline Eight absolute(const Eight& v) { return v < Eight{} ? -v : v; }
inline Eight root(const Eight& v) {
#ifdef __AVX__
  return _mm256_sqrt_ps(v);
#else
  Eight r;
  for (std::size_t i = 0; i < 8; ++i) r[i] = std::sqrt(v[i]);
  return r;
#endif
}

}  // namespace

unsigned near_point(const BoxBlock& block, const TreeCorner& p, float square) {
  Eight d[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const Eight gap = greater(greater(block.min[k] - p.x[k], p.x[k] - block.max[k]), Eight{});
    d[k] = gap * gap;
  }
  return zeros(d[0] + d[1] + d[2] > all_eight(square));
}

unsigned near_box(const BoxBlock& block, const TreeBox& box, float reach) {
  EightBits apart{};
  for (std::size_t k = 0; k < 3; ++k)
    apart |= greater(block.min[k] - box.max.x[k], box.min.x[k] - block.max[k]) > all_eight(reach);
  return zeros(apart);
}

unsigned not_side_by_side(const TreeBox& a, const TreeBox& a_directions, const BoxBlock& block, const TreeBox& directions, float limit) {
  Eight middle[3], half[3], farthest[3], square[3];
  for (std::size_t k = 0; k < 3; ++k) {
    middle[k] = 0.5f * (a.min.x[k] + a.max.x[k] - block.min[k] - block.max[k]);
    half[k] = 0.5f * (a.max.x[k] - a.min.x[k] + block.max[k] - block.min[k]);
    farthest[k] = absolute(middle[k]) + half[k];
    const Eight beyond = greater(absolute(middle[k]) - half[k], Eight{});
    square[k] = beyond * beyond;
  }
  const Eight sum = square[0] + square[1] + square[2], least = all_eight(limit);
  const EightBits may_be = sum > least * least;
  const Eight distance = root(sum);
  Eight gap = distance;
  for (const TreeBox* it : {&a_directions, &directions}) {
    Eight along[3], spread[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const float centre = 0.5f * (it->min.x[k] + it->max.x[k]), width = 0.5f * (it->max.x[k] - it->min.x[k]);
      along[k] = centre * middle[k];
      spread[k] = std::fabs(centre) * half[k] + width * farthest[k];
    }
    const Eight part = (absolute(along[0] + along[1] + along[2]) + (spread[0] + spread[1] + spread[2])) / distance;
    gap -= it->max.x[3] * lesser(part, all_eight(1));
  }
  return zeros(may_be & (gap > least));
}

unsigned may_have_inner_feet(const SegmentBlock& block, const SegmentProbe& probe) {
  Eight u[3], v[3], w[3], size = all_eight(0), other = all_eight(0), between = all_eight(0);
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = all_eight(probe.b.x[k] - probe.a.x[k]);
    v[k] = block.b[k] - block.a[k];
    w[k] = probe.a.x[k] - block.a[k];
    size += absolute(u[k]), other += absolute(v[k]), between += absolute(w[k]);
  }
  const auto product = [](const Eight(&a)[3], const Eight(&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const Eight uu = product(u, u), vv = product(v, v), uv = product(u, v), uw = product(u, w), vw = product(v, w);
  const Eight det = uu * vv - uv * uv, s = uv * vw - vv * uw, t = uu * vw - uv * uw;
  // Ends are rounded by a part of `slack`: with lengths of at most M, s and t change by 8 of that, det by 4, times M squared and one length.
  const Eight all = size + other + between, error = all * all * (8 * probe.slack + (64 * FLT_EPSILON) * all);
  const Eight slack_s = error * other, slack_t = error * size;
  const EightBits outside = (s < -slack_s) | (s > det + slack_s) | (t < -slack_t) | (t > det + slack_t);
  const EightBits joined = (block.from == probe.from) | (block.from == probe.to) | (block.to == probe.from) | (block.to == probe.to);
  return zeros(outside | joined);
}

void LeafBoxes::clear(std::size_t nodes) {
  item.clear();
  box.clear();
  block.clear();
  leaf.assign(nodes, {});
}

void LeafBoxes::add(std::uint32_t begin, std::int32_t i, const TreeBox& b) {
  const std::size_t lane = (item.size() - begin) % 8;
  if (lane == 0) {
    BoxBlock& fresh = block.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) fresh.min[k] = fresh.max[k] = all_eight(kFar);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    block.back().min[k][lane] = b.min.x[k];
    block.back().max[k][lane] = b.max.x[k];
  }
  item.push_back(i);
  box.push_back(b);
}

void LeafEdges::clear(std::size_t nodes) {
  LeafBoxes::clear(nodes);
  ends.clear();
}

void LeafEdges::set_last(const TreeCorner& a, const TreeCorner& b, std::int32_t from, std::int32_t to, bool rim, std::uint32_t n) {
  const std::size_t lane = (item.size() - 1 - leaf[n].begin) % 8;
  if (lane == 0) ends.emplace_back();
  SegmentBlock& it = ends.back();
  for (std::size_t k = 0; k < 3; ++k) {
    it.a[k][lane] = a.x[k];
    it.b[k][lane] = b.x[k];
  }
  it.from[lane] = from;
  it.to[lane] = to;
  if (rim) it.rims |= 1u << lane;
}

}  // namespace kerf
