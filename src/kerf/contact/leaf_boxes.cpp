#include "kerf/contact/leaf_boxes.h"

#include <cfloat>
#include <cmath>

#ifdef __AVX__
#include <immintrin.h>
#endif

namespace kerf {
namespace {

constexpr float kFarBox = 1e18f;  // its square is finite

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

LeafBlock no_leaves() {
  LeafBlock block{};
  for (std::size_t k = 0; k < 3; ++k) block.min[k] = block.max[k] = all_eight(kFarBox);
  return block;
}

void set_leaf(const TreeBox& box, const TreeBox& directions, std::size_t i, LeafBlock& block) {
  for (std::size_t k = 0; k < 3; ++k) {
    block.min[k][i] = box.min.x[k];
    block.max[k][i] = box.max.x[k];
    block.centre[k][i] = 0.5f * (directions.min.x[k] + directions.max.x[k]);
    block.width[k][i] = 0.5f * (directions.max.x[k] - directions.min.x[k]);
  }
  block.size[i] = directions.max.x[3];
}

namespace {

/// What is computed here is right to this part of it.
constexpr float kBoxRounding = 1e-5f;

/// Where a box lies from eight leaves: the box of all differences, and the least distance.
struct Between {
  Eight middle[3], half[3], farthest[3], square, distance;
};
inline Between between(const LeafBlock& block, const TreeBox& a) {
  Between it;
  it.square = Eight{};
  for (std::size_t k = 0; k < 3; ++k) {
    it.middle[k] = 0.5f * (a.min.x[k] + a.max.x[k] - block.min[k] - block.max[k]);
    it.half[k] = 0.5f * (a.max.x[k] - a.min.x[k] + block.max[k] - block.min[k]);
    it.farthest[k] = absolute(it.middle[k]) + it.half[k];
    const Eight beyond = greater(absolute(it.middle[k]) - it.half[k], Eight{});
    it.square += beyond * beyond;
  }
  it.distance = root(it.square);
  return it;
}

/// side_by_side(), by so much more that rounding can't make it true of a leaf and not of what is in it.
inline EightBits clearly_side_by_side(const LeafBlock& block, const Between& it, const TreeBox& a_directions,
                                      float limit) {
  Eight along[3], spread[3], other_along[3], other_spread[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const float centre = 0.5f * (a_directions.min.x[k] + a_directions.max.x[k]),
                width = 0.5f * (a_directions.max.x[k] - a_directions.min.x[k]);
    along[k] = centre * it.middle[k];
    spread[k] = std::fabs(centre) * it.half[k] + width * it.farthest[k];
    other_along[k] = block.centre[k] * it.middle[k];
    other_spread[k] = absolute(block.centre[k]) * it.half[k] + block.width[k] * it.farthest[k];
  }
  const Eight inverse = 1 / it.distance, one = all_eight(1);
  const Eight part = (absolute(along[0] + along[1] + along[2]) + (spread[0] + spread[1] + spread[2])) * inverse;
  const Eight other = (absolute(other_along[0] + other_along[1] + other_along[2]) +
                       (other_spread[0] + other_spread[1] + other_spread[2])) *
                      inverse;
  const float size = a_directions.max.x[3];
  const Eight gap = it.distance - size * lesser(part, one) - block.size * lesser(other, one);
  // Where the distance is zero, the quotients are not numbers, and so is the gap: not side by side.
  return (it.distance > all_eight(limit * (1 + kBoxRounding))) &
         (gap > limit + kBoxRounding * (it.distance + size + block.size));
}

}  // namespace

unsigned leaves_near_point(const LeafBlock& block, const TreeCorner& p, const TreeCorner& direction, float square,
                           float limit) {
  const Between it = between(block, {p, p});
  const EightBits far = it.square > all_eight(square * (1 + kBoxRounding));
  const unsigned near = zeros(far);
  return near == 0 ? 0 : near & zeros(clearly_side_by_side(block, it, {direction, direction}, limit));
}

unsigned leaves_near_box(const LeafBlock& block, const TreeBox& a, const TreeBox& a_directions, float reach,
                         float limit) {
  EightBits far{};
  for (std::size_t k = 0; k < 3; ++k)
    far |= greater(block.min[k] - a.max.x[k], a.min.x[k] - block.max[k]) > all_eight(reach);
  const unsigned near = zeros(far);
  return near == 0 ? 0 : near & zeros(clearly_side_by_side(block, between(block, a), a_directions, limit));
}

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

unsigned not_side_by_side(const TreeBox& a, const TreeBox& a_directions, const BoxBlock& block,
                          const TreeBox& directions, float limit) {
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
  float u[3], uu = 0, size = 0;
  Eight w[3], between = all_eight(0);
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = probe.b.x[k] - probe.a.x[k];
    uu += u[k] * u[k];
    size += std::fabs(u[k]);
    w[k] = probe.a.x[k] - block.a[k];
    between += absolute(w[k]);
  }
  const Eight &vv = block.square, &other = block.size, (&v)[3] = block.along;
  const Eight uv = u[0] * v[0] + u[1] * v[1] + u[2] * v[2], uw = u[0] * w[0] + u[1] * w[1] + u[2] * w[2],
              vw = v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
  const Eight det = uu * vv - uv * uv, s = uv * vw - vv * uw, t = uu * vw - uv * uw;
  // Ends are rounded by a part of `slack`: with lengths of at most M, s and t change by 8 of that, det by 4, times M squared and one length.
  const Eight all = size + other + between, error = all * all * (8 * probe.slack + (64 * FLT_EPSILON) * all);
  const Eight slack_s = error * other, slack_t = error * size;
  const EightBits outside = (s < -slack_s) | (s > det + slack_s) | (t < -slack_t) | (t > det + slack_t);
  const EightBits joined =
      (block.from == probe.from) | (block.from == probe.to) | (block.to == probe.from) | (block.to == probe.to);
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
    for (std::size_t k = 0; k < 3; ++k) fresh.min[k] = fresh.max[k] = all_eight(kFarBox);
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

void LeafEdges::set_last(const TreeCorner& a, const TreeCorner& b, std::int32_t from, std::int32_t to, bool rim,
                         std::uint32_t n) {
  const std::size_t lane = (item.size() - 1 - leaf[n].begin) % 8;
  if (lane == 0) ends.emplace_back();
  SegmentBlock& it = ends.back();
  for (std::size_t k = 0; k < 3; ++k) {
    const float along = b.x[k] - a.x[k];
    it.a[k][lane] = a.x[k];
    it.along[k][lane] = along;
    it.square[lane] += along * along;
    it.size[lane] += std::fabs(along);
  }
  it.from[lane] = from;
  it.to[lane] = to;
  if (rim) it.rims |= 1u << lane;
}

}  // namespace kerf
