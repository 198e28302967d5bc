#include "kerf/binding/dissection.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/base/at.h"

namespace kerf {
namespace {

constexpr std::size_t kBins = 64;
constexpr float kRounding = 4e-7f;  // of a sum or two of floats

}  // namespace

void Dissection::run(const RowGraph& graph, std::span<const Vec3> points, std::size_t most) {
  graph_ = graph;
  most_ = most;
  const std::size_t n = points.size();
  items_.resize(n);
  moved_.resize(n);
  order_.resize(n);
  half_.assign(n, 0);
  stamp_ = 0;
  nodes_.clear();
  // Floats of the body's own place and size: neither a far origin nor an odd unit costs digits.
  Box3 box;
  for (const Vec3 p : points) box.add(p);
  const Vec3 size = box.size();
  const double largest = std::max({size.x, size.y, size.z}), scale = largest > 0 ? 1 / largest : 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p = scale * (points[i] - box.min);
    items_[i] = {
        {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}, 0, static_cast<std::int32_t>(i)};
  }
  for (std::size_t i = 0; i < n; ++i) {
    float reach = 0;
    for (std::int32_t k = graph.first[i]; k < graph.first[i + 1]; ++k)
      for (int axis = 0; axis < 3; ++axis) {
        const float a = items_[i].p[axis], b = items_[at(graph.column[at(k)])].p[axis];
        const float d = std::fabs(b - a) + kRounding * (std::fabs(a) + std::fabs(b));
        reach = d < reach ? reach : d;
      }
    items_[i].reach = reach;
  }
  if (n > 0) divide(0, n, 0, 0);
  for (std::size_t i = 0; i < n; ++i) order_[i] = items_[i].row;
}

std::int32_t Dissection::divide(std::size_t begin, std::size_t end, std::int32_t depth, std::int32_t side) {
  Node node{static_cast<std::int32_t>(begin), static_cast<std::int32_t>(end), {-1, -1}, depth, side};
  if (end - begin > most_) {
    const std::size_t middle = halve(begin, end), separator = separate(begin, middle, end);
    node.begin = static_cast<std::int32_t>(separator);
    node.children[0] = divide(begin, middle, depth + 1, 0);
    if (separator > middle) node.children[1] = divide(middle, separator, depth + 1, 1);
  }
  nodes_.push_back(node);
  return static_cast<std::int32_t>(nodes_.size()) - 1;
}

/// Near the median: what lies below a bin's end comes first. Returns where the second half begins.
std::size_t Dissection::halve(std::size_t begin, std::size_t end) {
  float low[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF}, high[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
  for (std::size_t i = begin; i < end; ++i)
    for (int k = 0; k < 3; ++k) {
      const float x = items_[i].p[k];
      low[k] = x < low[k] ? x : low[k];
      high[k] = x > high[k] ? x : high[k];
    }
  axis_ = 0;
  for (int k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis_] - low[axis_]) axis_ = k;
  const float start = low[axis_], scale = static_cast<float>(kBins) / (high[axis_] - start);
  const auto bin_of = [&](const Item& item) {
    return std::min(kBins - 1, static_cast<std::size_t>((item.p[axis_] - start) * scale));
  };
  const std::size_t half = (end - begin) / 2;
  cut_ = HUGE_VALF;
  if (!(scale > 0 && scale < HUGE_VALF)) return begin + half;  // all in one place
  std::array<std::uint32_t, kBins> count{};
  for (std::size_t i = begin; i < end; ++i) ++count[bin_of(items_[i])];
  // The lowest and the highest row are in the first and the last bin, so that neither half is empty.
  std::size_t bins = 1, below = count[0];
  while (bins + 1 < kBins && below + count[bins] / 2 < half) below += count[bins++];
  std::size_t first = begin, second = 0;
  float lowest = HUGE_VALF;
  for (std::size_t i = begin; i < end; ++i) {  // without branches: which half is next can't be foretold
    const Item item = items_[i];
    const bool is_second = bin_of(item) >= bins;
    items_[first] = item;
    moved_[second] = item;
    first += is_second ? 0 : 1;
    second += is_second ? 1 : 0;
    lowest = is_second && item.p[axis_] < lowest ? item.p[axis_] : lowest;
  }
  std::copy_n(moved_.begin(), second, items_.begin() + static_cast<std::ptrdiff_t>(first));
  cut_ = lowest;
  return first;
}

/// Moves rows of the second half that have neighbours in the first to the end; returns where they begin.
std::size_t Dissection::separate(std::size_t begin, std::size_t middle, std::size_t end) {
  ++stamp_;
  for (std::size_t i = begin; i < middle; ++i) half_[at(items_[i].row)] = stamp_;
  std::size_t inner = middle, separator = 0;
  for (std::size_t i = middle; i < end; ++i) {
    const Item item = items_[i];
    bool near = false;
    if (!(item.p[axis_] - item.reach > cut_))
      for (std::int32_t k = graph_.first[at(item.row)]; k < graph_.first[at(item.row) + 1] && !near; ++k)
        near = half_[at(graph_.column[at(k)])] == stamp_;
    if (near) moved_[separator++] = item;
    else items_[inner++] = item;
  }
  std::copy_n(moved_.begin(), separator, items_.begin() + static_cast<std::ptrdiff_t>(inner));
  return inner;
}

}  // namespace kerf
