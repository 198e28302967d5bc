#include "kerf/contact/leaf_boxes.h"

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

}  // namespace kerf
