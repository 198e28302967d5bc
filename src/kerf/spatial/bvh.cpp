#include "kerf/spatial/bvh.h"

#include <cfloat>

#include "kerf/base/check.h"
#include "kerf/base/parallel.h"

namespace kerf {
namespace {

constexpr std::uint32_t kLeafSize = 4;
constexpr std::size_t kBins = 16;
constexpr int kHeuristicDepth = 64;       // deeper parts are halved by count, which adds at most 31 levels
constexpr std::uint32_t kPart = 1 << 16;  // so many triangles are one thread's
constexpr std::uint32_t kSmall = 12;      // below this many triangles halving is as good as the heuristic
constexpr double kLongestRun = 16,
                 kRunsForQueries =
                     0.6;  // building costs triangles / run, a query costs run: the sum is least at a root

float round_down(double x) {
  const auto f = static_cast<float>(std::clamp(x, -double{FLT_MAX}, double{FLT_MAX}));
  return static_cast<double>(f) > x ? std::nextafterf(f, -HUGE_VALF) : f;
}

using FloatBox = std::array<float, 6>;  // min, -max: one operation joins both
constexpr FloatBox kEmptyBox{HUGE_VALF, HUGE_VALF, HUGE_VALF, HUGE_VALF, HUGE_VALF, HUGE_VALF};
void join(FloatBox& a, const FloatBox& b) {
  for (std::size_t k = 0; k < 6; ++k) a[k] = b[k] < a[k] ? b[k] : a[k];
}
/// The same of exact numbers. Several triangles are joined in it and rounded once, to the box that their rounded boxes have together.
using ExactBox = std::array<double, 6>;
constexpr ExactBox kEmptyExactBox{HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL};
void join(ExactBox& a, const ExactBox& b) {
  for (std::size_t k = 0; k < 6; ++k) a[k] = b[k] < a[k] ? b[k] : a[k];
}
ExactBox triangle_box(const std::array<Vec3, 3>& t) {
  ExactBox box{t[0].x, t[0].y, t[0].z, -t[0].x, -t[0].y, -t[0].z};
  for (std::size_t i = 1; i < 3; ++i) join(box, {t[i].x, t[i].y, t[i].z, -t[i].x, -t[i].y, -t[i].z});
  return box;
}
FloatBox rounded(const ExactBox& box) {
  FloatBox out;
  for (std::size_t k = 0; k < 6; ++k) out[k] = round_down(box[k]);
  return out;
}
double diagonal(const ExactBox& b) {
  const double x = b[0] + b[3], y = b[1] + b[4], z = b[2] + b[5];
  return std::sqrt(x * x + y * y + z * z);
}
float half_area(const FloatBox& b) {
  const float x = -b[3] - b[0], y = -b[4] - b[1], z = -b[5] - b[2];
  return x * y + y * z + z * x;
}

}  // namespace

struct TriangleBvh::Builder {
  struct Item {
    FloatBox box;
    std::int32_t triangle;  ///< or the number of the run
    [[nodiscard]] float middle(std::size_t axis) const { return 0.5f * box[axis] - 0.5f * box[axis + 3]; }
  };
  struct Task {
    std::uint32_t node, begin, end;
    int depth;
  };
  TriangleBvh& bvh;
  std::vector<Item> items;

  /// One item for every run of so many consecutive triangles. False if the triangles of a run are not near each other.
  bool collect(const TriangleView& triangles, std::size_t run) {
    const std::size_t runs = (triangles.size() + run - 1) / run;
    items.resize(runs);
    struct Lengths {
      double runs = 0, triangles = 0;
    };
    std::vector<Lengths> lengths((runs + kPart - 1) / kPart);
    parallel_for(runs, kPart, [&](std::size_t begin, std::size_t end) {
      Lengths& sum = lengths[begin / kPart];
      for (std::size_t i = begin; i < end; ++i) {
        ExactBox box = kEmptyExactBox;
        for (std::size_t t = i * run; t < std::min(triangles.size(), (i + 1) * run); ++t) {
          const ExactBox b = triangle_box(triangles[static_cast<std::int32_t>(t)]);
          join(box, b);
          if (run > 1) sum.triangles += diagonal(b);
        }
        if (run > 1) sum.runs += diagonal(box);
        items[i] = {rounded(box), static_cast<std::int32_t>(i)};
      }
    });
    Lengths all;
    for (const Lengths& part : lengths) all.runs += part.runs, all.triangles += part.triangles;
    // Triangles that hang together are no longer than the sum of them; the ends of rows cost a little.
    return run == 1 || all.runs <= 2 * all.triangles;
  }

  /// From runs to triangles.
  void expand(std::size_t triangles, std::size_t run) {
    bvh.order_.resize(triangles);
    if (run == 1) {
      for (std::size_t i = 0; i < triangles; ++i) bvh.order_[i] = items[i].triangle;
      return;
    }
    std::vector<std::uint32_t> place(items.size() + 1, 0);  // of the items' triangles
    for (std::size_t i = 0; i < items.size(); ++i) {
      const std::size_t first = static_cast<std::size_t>(items[i].triangle) * run,
                        end = std::min(triangles, first + run);
      for (std::size_t t = first; t < end; ++t) bvh.order_[place[i] + (t - first)] = static_cast<std::int32_t>(t);
      place[i + 1] = place[i] + static_cast<std::uint32_t>(end - first);
    }
    for (Node& node : bvh.nodes_)
      if (node.count > 0) {
        node.count = place[node.first + node.count] - place[node.first];
        node.first = place[node.first];
      }
  }

  static void set_box(const FloatBox& box, Node& node) {
    node.min = {box[0], box[1], box[2]};
    node.max = {-box[3], -box[4], -box[5]};
  }
  static void join_children(const std::vector<Node>& nodes, Node& node) {
    FloatBox box = kEmptyBox;
    for (std::uint32_t k = 0; k < 2; ++k) {
      const Node& child = nodes[node.first + k];
      join(box, {child.min[0], child.min[1], child.min[2], -child.max[0], -child.max[1], -child.max[2]});
    }
    set_box(box, node);
  }

  // Position of the split; [begin, end) is then partitioned there.
  std::uint32_t split(std::uint32_t begin, std::uint32_t end, int depth) {
    float low[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF}, high[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
    for (std::uint32_t i = begin; i < end; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const float c = items[i].middle(k);
        low[k] = c < low[k] ? c : low[k];
        high[k] = c > high[k] ? c : high[k];
      }
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    const auto first = items.begin() + begin, last = items.begin() + end;
    const float scale = static_cast<float>(kBins) / (high[axis] - low[axis]);
    if (end - begin > kSmall && depth < kHeuristicDepth && scale > 0 && scale < HUGE_VALF) {
      const auto bin_of = [&](const Item& item) {
        return std::min(kBins - 1, static_cast<std::size_t>((item.middle(axis) - low[axis]) * scale));
      };
      std::array<FloatBox, kBins> boxes;
      std::array<std::uint32_t, kBins> counts{};
      boxes.fill(kEmptyBox);
      for (auto i = first; i != last; ++i) {
        const std::size_t b = bin_of(*i);
        join(boxes[b], i->box);
        ++counts[b];
      }
      std::array<float, kBins> cost_right{};
      FloatBox box = kEmptyBox;
      std::uint32_t count = 0;
      for (std::size_t b = kBins - 1; b > 0; --b) {
        join(box, boxes[b]);
        count += counts[b];
        cost_right[b] = count > 0 ? static_cast<float>(count) * half_area(box) : 0;
      }
      box = kEmptyBox;
      count = 0;
      float best = HUGE_VALF;
      std::size_t best_bin = 0;
      for (std::size_t b = 0; b + 1 < kBins; ++b) {
        join(box, boxes[b]);
        count += counts[b];
        if (count == 0 || count == end - begin) continue;
        const float cost = static_cast<float>(count) * half_area(box) + cost_right[b + 1];
        if (cost < best) best = cost, best_bin = b;
      }
      if (best < HUGE_VALF) {
        const auto cut = std::partition(first, last, [&](const Item& item) { return bin_of(item) <= best_bin; });
        return static_cast<std::uint32_t>(cut - items.begin());
      }
    }
    const std::uint32_t half = begin + (end - begin) / 2;
    std::nth_element(first, items.begin() + half, last, [&](const Item& a, const Item& b) {
      const float x = a.middle(axis), y = b.middle(axis);
      return x != y ? x < y : a.triangle < b.triangle;
    });
    return half;
  }

  /// The tree of a task, root first. Children come after their parents; their numbers count from the root.
  std::vector<Node> build_part(const Task& whole) {
    std::vector<Node> nodes;
    nodes.reserve(whole.end - whole.begin);  // about 0.8 of them are used
    nodes.emplace_back();
    std::vector<Task> tasks{{0, whole.begin, whole.end, whole.depth}};
    while (!tasks.empty()) {
      const Task task = tasks.back();
      tasks.pop_back();
      if (task.end - task.begin <= kLeafSize) {
        Node& leaf = nodes[task.node];
        leaf.first = task.begin;
        leaf.count = task.end - task.begin;
        FloatBox box = kEmptyBox;
        for (std::uint32_t i = task.begin; i < task.end; ++i) join(box, items[i].box);
        set_box(box, leaf);
        continue;
      }
      divide(task, nodes, tasks);
    }
    for (std::size_t n = nodes.size(); n-- > 0;)
      if (nodes[n].count == 0) join_children(nodes, nodes[n]);
    return nodes;
  }

  void divide(const Task& task, std::vector<Node>& nodes, std::vector<Task>& tasks) {
    const std::uint32_t middle = split(task.begin, task.end, task.depth);
    const auto children = static_cast<std::uint32_t>(nodes.size());
    nodes[task.node].first = children;
    nodes.emplace_back();
    nodes.emplace_back();
    tasks.push_back({children + 1, middle, task.end, task.depth + 1});
    tasks.push_back({children, task.begin, middle, task.depth + 1});
  }

  /// The top one after the other, the parts below it side by side. Which is which, sizes alone say: the tree is the same for any number of threads.
  void build() {
    const auto n = static_cast<std::uint32_t>(items.size());
    std::vector<Node>& nodes = bvh.nodes_;
    nodes.emplace_back();
    std::vector<Task> tasks{{0, 0, n, 0}}, parts;
    while (!tasks.empty()) {
      const Task task = tasks.back();
      tasks.pop_back();
      if (task.end - task.begin <= kPart) parts.push_back(task);
      else divide(task, nodes, tasks);
    }
    const std::size_t top = nodes.size();
    std::vector<std::vector<Node>> built(parts.size());
    parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) built[i] = build_part(parts[i]);
    });
    std::size_t all = top;
    for (const std::vector<Node>& part : built) all += part.size() - 1;
    nodes.reserve(all);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const auto shift = static_cast<std::uint32_t>(nodes.size() - 1);  // its root stands among the top
      for (Node& node : built[i])
        if (node.count == 0) node.first += shift;
      nodes[parts[i].node] = built[i][0];
      nodes.insert(nodes.end(), built[i].begin() + 1, built[i].end());
      built[i] = {};
    }
    std::vector<char> is_root(top, 0);
    for (const Task& part : parts) is_root[part.node] = 1;
    for (std::size_t i = top; i-- > 0;)
      if (is_root[i] == 0) join_children(nodes, nodes[i]);
  }
};

TriangleBvh::TriangleBvh(const TriangleView& triangles, std::size_t queries) {
  if (triangles.size() == 0) return;
  Builder builder{*this, {}};
  const double share = static_cast<double>(triangles.size()) / static_cast<double>(std::max<std::size_t>(queries, 1));
  auto run = static_cast<std::size_t>(std::clamp(std::sqrt(kRunsForQueries * share), 1.0, kLongestRun));
  if (!builder.collect(triangles, run)) builder.collect(triangles, run = 1);
  builder.build();
  builder.expand(triangles.size(), run);
}

void TriangleBvh::refit(const TriangleView& triangles) {
  KERF_ASSERT(triangles.size() == order_.size());
  for (std::size_t n = nodes_.size(); n-- > 0;) {  // children come after their parents
    Node& node = nodes_[n];
    if (node.count == 0) {
      Builder::join_children(nodes_, node);
      continue;
    }
    ExactBox box = kEmptyExactBox;
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) join(box, triangle_box(triangles[order_[i]]));
    Builder::set_box(rounded(box), node);
  }
}

}  // namespace kerf
