// A body against a rigid triangle mesh, in the frame of the mesh. Both trees are walked together; what a leaf of the body has
// to do with is then a few leaves of the mesh.
#include <algorithm>
#include <cmath>

#include "kerf/contact/near_shape.h"
#include "kerf/contact/triangle_foot.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Leaves = std::span<const std::array<std::uint32_t, 2>>;  // (body leaf, mesh leaf)

Vec3 absolute(Vec3 v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }

float widest(const TreeBox& b) {
  return std::max({b.max.x[0] - b.min.x[0], b.max.x[1] - b.min.x[1], b.max.x[2] - b.min.x[2]});
}

/// Fills scratch.leaf_pairs with leaves of the body and of the mesh that come within `reach`, those of one leaf of the body
/// together. Goes down the body's tree with a list of what is near in the mesh's.
void find_pairs(const NearShape& near, double reach) {
  const SurfaceTree& tree = near.body.surface.tree;
  const auto& boxes = near.body.frame.boxes;
  const PlacedPart& part = near.placed;
  const std::vector<TriangleBvh::Node>& nodes = part.part->mesh->tree.nodes();
  const std::vector<TreeBox>& targets = part.part->mesh->leaves.box;
  const Mat3 size{{absolute(part.axes.c[0]), absolute(part.axes.c[1]), absolute(part.axes.c[2])}};
  const double rounding = boxes.slack + 1e-6 * (norm(part.centre) + part.part->mesh->box.diagonal());
  const auto r = static_cast<float>(reach + rounding);
  auto& found = near.run.scratch.leaf_pairs;
  auto& list = near.run.scratch.stack;
  auto& tasks = near.run.scratch.tasks;
  found.clear();
  list.assign(1, 0);
  tasks.assign(1, {0, 0, 1});
  while (!tasks.empty()) {
    const TreeTask task = tasks.back();
    tasks.pop_back();
    list.resize(task.end);  // what lies behind belonged to subtrees that are done
    const TreeBox& b = boxes.box[task.node];
    Vec3 lo, hi;
    for (std::size_t k = 0; k < 3; ++k) lo[static_cast<int>(k)] = b.min.x[k], hi[static_cast<int>(k)] = b.max.x[k];
    const Vec3 centre = transposed_times(part.axes, 0.5 * (lo + hi) - part.centre);
    const Vec3 half = transposed_times(size, 0.5 * (hi - lo));
    const TreeBox box{to_corner(centre - half), to_corner(centre + half)};
    const float coarse = widest(box);
    const SurfaceTreeNode node = tree.nodes[task.node];
    for (std::uint32_t i = task.begin; i < task.end; ++i)
      if (kerf::near(box, targets[list[i]], r)) list.push_back(list[i]);
    // Nodes of the mesh that are larger than that of the body are replaced by their children.
    std::size_t kept = task.end;
    for (std::size_t i = task.end; i < list.size(); ++i) {
      const TriangleBvh::Node& target = nodes[list[i]];
      if (target.count > 0 || (node.count == 0 && widest(targets[list[i]]) < coarse)) {
        std::swap(list[kept++], list[i]);
        continue;
      }
      for (const std::uint32_t child : {target.first, target.first + 1})
        if (kerf::near(box, targets[child], r)) list.push_back(child);
    }
    list.resize(kept);
    if (kept == task.end) continue;
    if (node.count > 0) {
      for (std::size_t i = task.end; i < kept; ++i) found.push_back({task.node, list[i]});
      continue;
    }
    const auto end = static_cast<std::uint32_t>(kept);
    tasks.push_back({node.first + 1, task.end, end});
    tasks.push_back({node.first, task.end, end});
  }
}

/// The nearest place on the given leaves within `reach` of a point in the mesh's frame; triangle null: there is none. The
/// guess, which may be null, only saves time.
struct NearestPlace {
  const ObstacleLeaves::Triangle* triangle = nullptr;
  TriangleFoot foot;
};
NearestPlace nearest(const ObstacleMesh& mesh, Leaves leaves, Vec3 local, double reach,
                     const ObstacleLeaves::Triangle* guess) {
  const TreeCorner p = to_corner(local);
  const double rounding = 1e-6 * (norm(local) + mesh.box.diagonal());
  NearestPlace best{nullptr, {reach * reach, 0, 0}};
  auto limit = static_cast<float>((reach + rounding) * (reach + rounding));
  const auto take = [&](const ObstacleLeaves::Triangle& t) {
    const TriangleFoot foot = nearest_foot(local, t.corner);
    if (foot.square > best.foot.square) return;
    if (foot.square == best.foot.square && best.triangle != nullptr && t.id >= best.triangle->id) return;
    best = {&t, foot};
    const double r = std::sqrt(foot.square) + rounding;
    limit = static_cast<float>(r * r);
  };
  if (guess != nullptr) take(*guess);
  for (const auto& [leaf, m] : leaves) {
    if (squared_distance(mesh.leaves.box[m], p) > limit) continue;
    const ObstacleLeaves::Range range = mesh.leaves.range[m];
    for (std::uint32_t i = range.triangle; i < range.triangle_end; ++i) {
      const ObstacleLeaves::Triangle& t = mesh.leaves.triangles[i];
      if (!(squared_distance(t.box, p) > limit)) take(t);
    }
  }
  return best;
}

/// An edge of the body in the mesh's frame.
struct LocalEdge {
  H edge;
  TreeBox box;
  Vec3 a, b;
  double reach = 0;     ///< m
  bool has_faces = false;  ///< the rest is known
  std::array<TreeCorner, 2> into{};  ///< unit, from the edge into its faces; zero: none
  std::array<float, 2> origin{};     ///< of the edge along these
};

void add_faces(const NearShape& near, LocalEdge& edge) {
  edge.has_faces = true;
  const H twin = near.body.surface.twin[edge.edge];
  const Vec3 into[2] = {near.body.into(edge.edge), twin.valid() ? near.body.into(twin) : Vec3{}};
  for (std::size_t i = 0; i < 2; ++i) {
    const Vec3 local = transposed_times(near.placed.axes, into[i]);
    edge.into[i] = to_corner(local);
    edge.origin[i] = static_cast<float>(dot(local, edge.a));
  }
}

/// Is all of a box seen from the edge in directions that point into a face of the body, from above and from below? Then
/// nothing in it can touch the edge before a face: the test of off_faces(), for a whole box.
bool beside(const LocalEdge& edge, const TreeBox& b) {
  const auto margin = static_cast<float>(kOffFaces * edge.reach);
  bool above = false, below = false;
  const TreeLanes sum = lanes(b.min) + lanes(b.max), size = lanes(b.max) - lanes(b.min);
  for (std::size_t i = 0; i < 2; ++i) {
    const TreeLanes into = lanes(edge.into[i]);
    const float middle = 0.5f * sum_of_three(into * sum) - edge.origin[i];
    const float half = 0.5f * sum_of_three((into < TreeLanes{} ? -into : into) * size);
    above = above | (middle - half > margin);
    below = below | (middle + half < -margin);
  }
  return above && below;
}

const ObstacleLeaves::Triangle* search_vertex(const NearShape& near, V v, Leaves leaves,
                                              const ObstacleLeaves::Triangle* guess) {
  const PlacedPart& part = near.placed;
  const Vec3 local = transposed_times(part.axes, near.body.position(v) - part.centre);
  const NearestPlace place = nearest(*part.part->mesh, leaves, local, near.reach(v), guess);
  if (place.triangle == nullptr) return nullptr;
  const auto& c = place.triangle->corner;
  ClosestPoint foot;
  foot.triangle = place.triangle->id;
  foot.distance = std::sqrt(place.foot.square);
  foot.barycentric = place.foot.weights();
  foot.point = foot.barycentric[0] * c[0] + foot.barycentric[1] * c[1] + foot.barycentric[2] * c[2];
  Proximity proximity;
  proximity_of_foot(part, local, foot, proximity);
  hand_out_vertex_contact(near, v, proximity);
  return place.triangle;
}

void search_points(const NearShape& near, F f, const TreeBox& box, double reach, Leaves leaves) {
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const std::array<Vec3, 3> corner = near.body.corners(f);
  const auto r = static_cast<float>(reach), limit = static_cast<float>(reach * reach);
  for (const auto& [leaf, m] : leaves) {
    if (!kerf::near(box, mesh.leaves.box[m], r)) continue;
    const ObstacleLeaves::Range range = mesh.leaves.range[m];
    for (std::uint32_t i = range.vertex; i < range.vertex_end; ++i) {
      const std::int32_t v = mesh.leaves.vertices[i];
      if (squared_distance(box, to_corner(mesh.positions[static_cast<std::size_t>(v)])) > limit) continue;
      offer_point(near, f, corner, reach, mesh_point(near.placed, v));
    }
  }
}

void search_edges(const NearShape& near, LocalEdge& mine, Leaves leaves) {
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const auto r = static_cast<float>(mine.reach);
  for (const auto& [leaf, m] : leaves) {
    const TreeBox box = mesh.leaves.box[m];
    if (!kerf::near(mine.box, box, r)) continue;
    if (!mine.has_faces) add_faces(near, mine);
    if (beside(mine, box)) continue;
    const ObstacleLeaves::Range range = mesh.leaves.range[m];
    for (std::uint32_t i = range.edge; i < range.edge_end; ++i) {
      const ObstacleLeaves::Edge& edge = mesh.leaves.edges[i];
      if (!kerf::near(mine.box, edge.box, r) || beside(mine, edge.box)) continue;
      SegmentFeet feet;
      if (!inner_feet(mine.a, mine.b, edge.a, edge.b, feet)) continue;
      const Vec3 d = lerp(mine.a, mine.b, feet.s) - lerp(edge.a, edge.b, feet.t);
      if (dot(d, d) < mine.reach * mine.reach) hand_out_edges(near, mine.edge, mesh_edge(near.placed, edge), feet);
    }
  }
}

void search_leaf(const NearShape& near, std::uint32_t leaf, Leaves leaves, const ObstacleLeaves::Triangle*& guess) {
  const ContactSurface& surface = near.body.surface;
  const PlacedPart& part = near.placed;
  const double rounding = 1e-6 * (norm(part.centre) + part.part->mesh->box.diagonal()) + near.body.frame.boxes.slack;
  surface.tree.for_each_triangle(leaf, [&](F f) {
    bool coarse = false;
    for (int i = 0; i < 3; ++i) {
      const H h = ContactSurface::corner(f, i);
      coarse = coarse || is_coarse_edge(surface, h);
      if (!surface.owns_vertex(h)) continue;
      const ObstacleLeaves::Triangle* found = search_vertex(near, surface.origin[h], leaves, guess);
      if (found != nullptr) guess = found;
    }
    if (!coarse) return;
    const auto v = surface.vertices(f);
    const double reach = near.reach(v) + rounding;
    std::array<Vec3, 3> local;
    for (std::size_t i = 0; i < 3; ++i) local[i] = transposed_times(part.axes, near.body.position(v[i]) - part.centre);
    const std::array<TreeCorner, 3> p{to_corner(local[0]), to_corner(local[1]), to_corner(local[2])};
    if (surface.coarse[f] != 0)
      search_points(near, f, joined(joined({p[0], p[0]}, {p[1], p[1]}), {p[2], p[2]}), reach, leaves);
    for (std::size_t i = 0; i < 3; ++i) {
      const H h = ContactSurface::corner(f, static_cast<int>(i));
      if (!surface.owns_edge(h) || !is_coarse_edge(surface, h)) continue;
      const std::size_t k = (i + 1) % 3;
      LocalEdge edge{h, joined({p[i], p[i]}, {p[k], p[k]}), local[i], local[k], reach};
      search_edges(near, edge, leaves);
    }
  });
}

}  // namespace

void detect_mesh(const NearShape& near, double reach) {
  find_pairs(near, reach);
  const auto& pairs = near.run.scratch.leaf_pairs;
  const ObstacleLeaves::Triangle* guess = nullptr;  // neighbours among vertices have neighbours for nearest triangles
  for (std::size_t i = 0; i < pairs.size();) {
    std::size_t end = i + 1;
    while (end < pairs.size() && pairs[end][0] == pairs[i][0]) ++end;
    search_leaf(near, pairs[i][0], std::span(pairs).subspan(i, end - i), guess);
    i = end;
  }
  hand_out_points(near);
}

}  // namespace kerf
