// A body against a rigid triangle mesh, in the frame of the mesh. Both trees are walked together; what a leaf of the body has
// to do with is then a few leaves of the mesh.
#include <algorithm>
#include <cmath>

#include "kerf/contact/near_shape.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Leaves = std::span<const std::array<std::uint32_t, 2>>;  // (body leaf, mesh leaf)

Vec3 absolute(Vec3 v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }

TreeBox box_of(const TriangleBvh::Node& node) {
  return {{{node.min[0], node.min[1], node.min[2]}}, {{node.max[0], node.max[1], node.max[2]}}};
}
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
      if (kerf::near(box, box_of(nodes[list[i]]), r)) list.push_back(list[i]);
    // Nodes of the mesh that are larger than that of the body are replaced by their children.
    std::size_t kept = task.end;
    for (std::size_t i = task.end; i < list.size(); ++i) {
      const TriangleBvh::Node& target = nodes[list[i]];
      if (target.count > 0 || (node.count == 0 && widest(box_of(target)) < coarse)) {
        std::swap(list[kept++], list[i]);
        continue;
      }
      for (const std::uint32_t child : {target.first, target.first + 1})
        if (kerf::near(box, box_of(nodes[child]), r)) list.push_back(child);
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

/// The point of a triangle nearest to p: a + v (b - a) + w (c - a), and its squared distance. Weights on edges and corners
/// are exact. Of a triangle without area it is some point nearby.
struct TriangleFoot {
  double square = 0, v = 0, w = 0;
};
TriangleFoot nearest_foot(Vec3 p, const std::array<Vec3, 3>& t) {
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {dot(ap, ap), 0, 0};
  const Vec3 bp = p - t[1];
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {dot(bp, bp), 1, 0};
  const Vec3 cp = p - t[2];
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {dot(cp, cp), 0, 1};
  const auto at = [&](double v, double w) {
    const Vec3 d = ap - v * ab - w * ac;
    return TriangleFoot{dot(d, d), v, w};
  };
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return at(d1 / (d1 - d3), 0);
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return at(0, d2 / (d2 - d6));
  const double e = d4 - d3, f = d5 - d6;
  if (va <= 0 && e >= 0 && f >= 0 && e + f > 0) {
    const double w = e / (e + f);
    return at(1 - w, w);
  }
  const double sum = va + vb + vc;
  return sum > 0 ? at(vb / sum, vc / sum) : TriangleFoot{dot(ap, ap), 0, 0};
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
    if (squared_distance(box_of(mesh.tree.nodes()[m]), p) > limit) continue;
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
  std::array<Vec3, 2> into;  ///< unit, from the edge into its faces; zero: none
  double reach = 0;          ///< m
};

/// Is all of a box seen from the edge in directions that point into a face of the body, from above and from below? Then
/// nothing in it can touch the edge before a face: the test of off_faces(), for a whole box.
bool beside(const LocalEdge& edge, const TreeBox& b) {
  const auto margin = static_cast<float>(kOffFaces * edge.reach);
  bool above = false, below = false;
  for (const Vec3& into : edge.into) {
    float middle = 0, half = 0;
    const float origin = static_cast<float>(dot(into, edge.a));
    for (std::size_t k = 0; k < 3; ++k) {
      const auto c = static_cast<float>(into[static_cast<int>(k)]);
      middle += 0.5f * c * (b.min.x[k] + b.max.x[k]);
      half += 0.5f * std::fabs(c) * (b.max.x[k] - b.min.x[k]);
    }
    above = above || middle - origin - half > margin;
    below = below || middle - origin + half < -margin;
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
  const double vw[2] = {place.foot.v, place.foot.w};
  ClosestPoint foot;
  foot.triangle = place.triangle->id;
  foot.distance = std::sqrt(place.foot.square);
  foot.barycentric = {vw[0] + vw[1] >= 1 ? 0 : 1 - vw[0] - vw[1], vw[0], vw[1]};
  foot.point = foot.barycentric[0] * c[0] + vw[0] * c[1] + vw[1] * c[2];
  Proximity proximity;
  proximity_of_foot(part, local, foot, proximity);
  hand_out_vertex_contact(near, v, proximity);
  return place.triangle;
}

void search_points(const NearShape& near, F f, const TreeBox& box, double reach, Leaves leaves) {
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const std::array<Vec3, 3> corner = near.body.corners(f);
  const auto limit = static_cast<float>(reach * reach);
  for (const auto& [leaf, m] : leaves) {
    const ObstacleLeaves::Range range = mesh.leaves.range[m];
    for (std::uint32_t i = range.vertex; i < range.vertex_end; ++i) {
      const std::int32_t v = mesh.leaves.vertices[i];
      if (squared_distance(box, to_corner(mesh.positions[static_cast<std::size_t>(v)])) > limit) continue;
      offer_point(near, f, corner, reach, mesh_point(near.placed, v));
    }
  }
}

void search_edges(const NearShape& near, const LocalEdge& mine, Leaves leaves) {
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const auto r = static_cast<float>(mine.reach);
  for (const auto& [leaf, m] : leaves) {
    const TreeBox box = box_of(mesh.tree.nodes()[m]);
    if (!kerf::near(mine.box, box, r) || beside(mine, box)) continue;
    const ObstacleLeaves::Range range = mesh.leaves.range[m];
    for (std::uint32_t i = range.edge; i < range.edge_end; ++i) {
      const ObstacleLeaves::Edge& edge = mesh.leaves.edges[i];
      if (!kerf::near(mine.box, edge.box, r) || beside(mine, edge.box)) continue;
      const SegmentPair feet = closest_of_segments(mine.a, mine.b, edge.a, edge.b);
      if (!feet.inside()) continue;
      const Vec3 d = lerp(mine.a, mine.b, feet.s) - lerp(edge.a, edge.b, feet.t);
      if (dot(d, d) < mine.reach * mine.reach) hand_out_edges(near, mine.edge, mesh_edge(near.placed, edge), feet);
    }
  }
}

void search_leaf(const NearShape& near, std::uint32_t leaf, Leaves leaves) {
  const ContactSurface& surface = near.body.surface;
  const PlacedPart& part = near.placed;
  const double rounding = 1e-6 * (norm(part.centre) + part.part->mesh->box.diagonal()) + near.body.frame.boxes.slack;
  const ObstacleLeaves::Triangle* guess = nullptr;
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
      LocalEdge edge{h, joined({p[i], p[i]}, {p[k], p[k]}), local[i], local[k], {}, reach};
      edge.into[0] = transposed_times(part.axes, near.body.into(h));
      if (surface.twin[h].valid()) edge.into[1] = transposed_times(part.axes, near.body.into(surface.twin[h]));
      search_edges(near, edge, leaves);
    }
  });
}

}  // namespace

void detect_mesh(const NearShape& near, double reach) {
  find_pairs(near, reach);
  const auto& pairs = near.run.scratch.leaf_pairs;
  for (std::size_t i = 0; i < pairs.size();) {
    std::size_t end = i + 1;
    while (end < pairs.size() && pairs[end][0] == pairs[i][0]) ++end;
    search_leaf(near, pairs[i][0], std::span(pairs).subspan(i, end - i));
    i = end;
  }
  hand_out_points(near);
}

}  // namespace kerf
