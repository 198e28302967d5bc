#include "kerf/contact/surface_tree.h"

#include <cfloat>
#include <cmath>

#include "kerf/base/check.h"

namespace kerf {
namespace {

constexpr std::size_t kLeafRoots = 8;
constexpr TreeBox kEmpty{{{FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX}}, {{-FLT_MAX, -FLT_MAX, -FLT_MAX, -FLT_MAX}}};

void add(TreeBox& box, const TreeCorner& p) { box = joined(box, {p, p}); }

}  // namespace

SurfaceTree make_surface_tree(std::span<const Box3> root_boxes) {
  SurfaceTree tree;
  const auto n = static_cast<std::uint32_t>(root_boxes.size());
  tree.first.resize(n);
  if (n == 0) return tree;
  for (std::uint32_t i = 0; i < n; ++i) tree.roots.push_back(RootId(std::size_t{i}));
  // Halves by count along the longest side of the centres: the triangles of a surface are of about one size.
  struct Task {
    std::uint32_t node, begin, end;
  };
  std::vector<Task> tasks{{0, 0, n}};
  tree.nodes.emplace_back();
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    if (task.end - task.begin <= kLeafRoots) {
      tree.nodes[task.node] = {task.begin, task.end - task.begin};
      continue;
    }
    const auto centre = [&](RootId r) {
      return root_boxes[r.index()].empty() ? Vec3{} : root_boxes[r.index()].center();
    };
    Box3 box;
    for (std::uint32_t i = task.begin; i < task.end; ++i) box.add(centre(tree.roots[i]));
    const Vec3 size = box.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t middle = task.begin + (task.end - task.begin) / 2;
    std::nth_element(tree.roots.begin() + task.begin, tree.roots.begin() + middle, tree.roots.begin() + task.end,
                     [&](RootId a, RootId b) {
                       const double x = centre(a)[axis], y = centre(b)[axis];
                       return x != y ? x < y : a < b;
                     });
    const auto children = static_cast<std::uint32_t>(tree.nodes.size());
    tree.nodes[task.node] = {children, 0};
    tree.nodes.emplace_back();
    tree.nodes.emplace_back();
    tasks.push_back({children + 1, middle, task.end});
    tasks.push_back({children, task.begin, middle});
  }
  return tree;
}

void refit(const SurfaceTree& tree, std::span<const CollisionVertex> corners, std::span<const Vec3> positions,
           TreeBoxes& boxes) {
  boxes.points.resize(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) boxes.points[v] = to_corner(positions[v]);
  boxes.box.resize(tree.nodes.size());
  for (std::size_t n = tree.nodes.size(); n-- > 0;) {
    const SurfaceTreeNode node = tree.nodes[n];
    TreeBox box = kEmpty;
    if (node.count == 0) {
      box = joined(boxes.box[node.first], boxes.box[node.first + 1]);
    } else {
      tree.for_each_triangle(static_cast<std::uint32_t>(n), [&](CollisionTriangle f) {
        for (std::size_t i = 0; i < 3; ++i) add(box, boxes.points[corners[3 * f.index() + i].index()]);
      });
    }
    boxes.box[n] = box;
  }
  float largest = 0;
  if (!boxes.box.empty())
    for (std::size_t k = 0; k < 3; ++k)
      largest = std::max({largest, std::fabs(boxes.box[0].min.x[k]), std::fabs(boxes.box[0].max.x[k])});
  boxes.slack = 4 * double{FLT_EPSILON} * (largest < FLT_MAX ? largest : 0);
}

void refit_directions(const SurfaceTree& tree, std::span<const CollisionVertex> corners, std::span<const Vec3> offsets,
                      const TreeBoxes& boxes, std::vector<TreeCorner>& unit, std::vector<TreeBox>& directions) {
  unit.resize(offsets.size());
  for (std::size_t v = 0; v < offsets.size(); ++v) {
    TreeCorner o = to_corner(offsets[v]);
    const float size = std::sqrt(o.x[0] * o.x[0] + o.x[1] * o.x[1] + o.x[2] * o.x[2]);
    const float scale = size > 0 ? 1 / size : 0;
    unit[v] = {{o.x[0] * scale, o.x[1] * scale, o.x[2] * scale, size}};
  }
  directions.resize(tree.nodes.size());
  for (std::size_t n = tree.nodes.size(); n-- > 0;) {
    const SurfaceTreeNode node = tree.nodes[n];
    TreeBox box = kEmpty;
    if (node.count == 0) {
      box = joined(directions[node.first], directions[node.first + 1]);
    } else {
      tree.for_each_triangle(static_cast<std::uint32_t>(n), [&](CollisionTriangle f) {
        std::array<std::size_t, 3> v;
        for (std::size_t i = 0; i < 3; ++i) v[i] = corners[3 * f.index() + i].index();
        const auto &a = boxes.points[v[0]].x, &b = boxes.points[v[1]].x, &c = boxes.points[v[2]].x;
        const float ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
        const float vx = c[0] - a[0], vy = c[1] - a[1], vz = c[2] - a[2];
        const float x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
        const float size = x * x + y * y + z * z;
        const float scale = size > FLT_MIN ? 1 / std::sqrt(size) : 0;
        for (const std::size_t i : v) add(box, unit[i]);
        add(box, {{x * scale, y * scale, z * scale, unit[v[0]].x[3]}});
      });
    }
    directions[n] = box;
  }
}

bool is_narrow(const TreeBox& directions) {
  float centre[3], half[3], size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    centre[k] = 0.5f * (directions.min.x[k] + directions.max.x[k]);
    half[k] = 0.5f * (directions.max.x[k] - directions.min.x[k]);
    size += centre[k] * centre[k];
  }
  // The least product of any direction in the box with its middle, against cos 45 degrees times the middle's length.
  float least = size;
  for (std::size_t k = 0; k < 3; ++k) least -= half[k] * std::fabs(centre[k]);
  return least > 0 && least * least > 0.5f * size;
}

}  // namespace kerf
