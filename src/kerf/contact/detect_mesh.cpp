// A body against a rigid triangle mesh, in the frame of the mesh. Both trees are walked together; what a leaf of the body has
// to do with is then a few leaves of the mesh.
#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>

#include "kerf/contact/near_shape.h"
#include "kerf/contact/search_sides.h"
#include "kerf/contact/triangle_foot.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Leaves = std::span<const std::array<std::uint32_t, 2>>;  // (body leaf, mesh leaf)

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

/// Balls are made to last for so many steps, or not at all: making one costs more than a search among the leaves.
constexpr double kStepsToLast = 4;

/// A vertex in the frame of the mesh, with how far it is from the mesh at least.
PlacedVertex& placed(const NearShape& near, V v) {
  DetectScratch& scratch = near.run.scratch;
  PlacedVertex& p = scratch.placed[v.index()];
  if (p.call == scratch.mesh_calls) return p;
  p.local = transposed_times(near.placed.axes, near.body.position(v) - near.placed.centre);
  p.least = scratch.clearances[scratch.meshes].least(v, p.local);
  p.call = scratch.mesh_calls;
  return p;
}

/// Fills scratch.leaf_list with the leaves of the mesh within `reach` of a place in its frame.
Leaves leaves_around(const NearShape& near, Vec3 local, double reach) {
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const TreeCorner p = to_corner(local);
  const double rounded = reach + 1e-6 * (norm(local) + mesh.box.diagonal());
  const auto limit = static_cast<float>(rounded * rounded);
  auto& found = near.run.scratch.leaf_list;
  auto& stack = near.run.scratch.stack;
  found.clear();
  stack.assign(1, 0);
  while (!stack.empty()) {
    const std::uint32_t n = stack.back();
    stack.pop_back();
    if (squared_distance(mesh.leaves.box[n], p) > limit) continue;
    const TriangleBvh::Node& node = mesh.tree.nodes()[n];
    if (node.count > 0) found.push_back({0, n});
    else stack.insert(stack.end(), {node.first + 1, node.first});
  }
  return found;
}

/// There is nothing within `reach` of a vertex: how much farther is it? Up to as much again.
void find_clearance(const NearShape& near, V v, double reach, Clearance& known, PlacedVertex& p) {
  p.least = reach;
  if (!(reach > kStepsToLast * (near.approach(v) - near.run.margin))) return;
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const ObstacleLeaves::Triangle* guess = known.guess(v);
  const double far =
      guess == nullptr ? 2 * reach : std::min(2 * reach, std::sqrt(nearest_foot(p.local, guess->corner).square));
  const NearestPlace place = nearest(mesh, leaves_around(near, p.local, far), p.local, far, guess);
  p.least = place.triangle == nullptr ? far : std::sqrt(place.foot.square);
  known.set(v, p.local, p.least, place.triangle);
}

Proximity proximity_of(const PlacedPart& part, Vec3 local, const NearestPlace& place) {
  const auto& c = place.triangle->corner;
  ClosestPoint foot;
  foot.triangle = place.triangle->id;
  foot.distance = std::sqrt(place.foot.square);
  foot.barycentric = place.foot.weights();
  foot.point = foot.barycentric[0] * c[0] + foot.barycentric[1] * c[1] + foot.barycentric[2] * c[2];
  Proximity proximity;
  proximity_of_foot(part, local, foot, proximity);
  return proximity;
}

MeshFace mesh_face(const NearShape& near, F f, double rounding) {
  MeshFace face{f, {}, {}, {}, 0};
  const auto v = near.body.surface.vertices(f);
  for (std::size_t i = 0; i < 3; ++i) {
    const PlacedVertex& p = placed(near, v[i]);
    face.local[i] = p.local;
    face.least[i] = p.least;
  }
  for (std::size_t i = 0; i < 3; ++i) face.length[i] = norm(face.local[(i + 1) % 3] - face.local[i]);
  face.reach = near.reach(v) + rounding;
  return face;
}

void search_vertex(const NearShape& near, V v, Leaves leaves) {
  const PlacedPart& part = near.placed;
  const ObstacleMesh& mesh = *part.part->mesh;
  PlacedVertex& p = placed(near, v);
  const double reach = near.reach(v);
  if (p.least > reach) return;
  Clearance& known = near.run.scratch.clearances[near.run.scratch.meshes];
  const NearestPlace place = nearest(mesh, leaves, p.local, reach, known.guess(v));
  if (place.triangle == nullptr) return find_clearance(near, v, reach, known, p);
  p.least = std::sqrt(place.foot.square);
  known.set(v, p.local, p.least, place.triangle);
  hand_out_vertex_contact(near, v, proximity_of(part, p.local, place));
}

/// The sides of a face, unless the mesh is too far from its corners.
void search_mesh_sides(const NearShape& near, F f, Leaves leaves) {
  const SidePoints& sides = *near.body.state.sides;
  if (!sides.has_points(f)) return;
  const PlacedPart& part = near.placed;
  MeshFace face = mesh_face(near, f, 0);
  face.reach += sides.bulge;
  if (face.is_clear()) return;
  // Mostly it is the triangle of the point before.
  const ObstacleLeaves::Triangle* guess =
      near.run.scratch.clearances[near.run.scratch.meshes].guess(near.body.surface.vertices(f)[0]);
  search_sides(near, f, [&](Vec3 place, double far, Proximity& proximity) {
    const Vec3 local = transposed_times(part.axes, place - part.centre);
    const NearestPlace found = nearest(*part.part->mesh, leaves, local, far, guess);
    if (found.triangle == nullptr) return false;
    guess = found.triangle;
    proximity = proximity_of(part, local, found);
    return true;
  });
}

/// Corners and edges of a mesh near a leaf of the body.
struct Gathered {
  Vec3 centre;  ///< of the blocks
  TreeBox box;  ///< of it all, in the mesh's frame
};

/// Fills the blocks of scratch with what stands on leaves and is near scratch.mesh_faces.
Gathered gather(const NearShape& near, Leaves leaves) {
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const ObstacleLeaves& all = mesh.leaves;
  DetectScratch& scratch = near.run.scratch;
  auto& edges = scratch.mesh_edges;
  auto& points = scratch.mesh_points;
  edges.clear();
  points.clear();
  const Vec3 centre = scratch.mesh_faces.front().local[0];
  TreeBox around = box_of(scratch.mesh_faces.front().local);
  double reach = 0;
  for (const MeshFace& face : scratch.mesh_faces) {
    around = joined(around, box_of(face.local));
    reach = std::fmax(reach, face.reach);
  }
  const auto r = static_cast<float>(reach);
  Gathered out{centre, {{{FLT_MAX, FLT_MAX, FLT_MAX, 0}}, {{-FLT_MAX, -FLT_MAX, -FLT_MAX, 0}}}};
  std::size_t edge_count = 0, point_count = 0;
  for (const auto& [leaf, m] : leaves) {
    if (!kerf::near(around, all.box[m], r)) continue;
    const ObstacleLeaves::Range range = all.range[m];
    for (std::uint32_t i = range.edge; i < range.edge_end; ++i) {
      if (!kerf::near(around, all.edges[i].box, r)) continue;
      if (edge_count % 8 == 0) edges.push_back(empty_edges());
      set_edge(all.edges[i], i, centre, edge_count++ % 8, edges.back());
      out.box = joined(out.box, all.edges[i].box);
    }
    for (std::uint32_t i = range.vertex; i < range.vertex_end; ++i) {
      const std::int32_t v = all.vertices[i];
      const Vec3 p = mesh.positions[static_cast<std::size_t>(v)];
      if (squared_distance(around, to_corner(p)) > r * r) continue;
      if (point_count % 8 == 0) points.push_back(empty_points());
      set_point(p, v, centre, point_count++ % 8, points.back());
    }
  }
  return out;
}

/// The largest coordinate in a box, as seen from a centre.
float extent_of(const TreeBox& box, Vec3 centre) {
  const TreeCorner c = to_corner(centre);
  float most = 0;
  for (std::size_t k = 0; k < 3; ++k)
    most = std::max({most, std::fabs(box.min.x[k] - c.x[k]), std::fabs(box.max.x[k] - c.x[k])});
  return most;
}

void search_points(const NearShape& near, F f, const TreeBox& box, double reach) {
  const std::array<Vec3, 3> corner = near.body.corners(f);
  for (const PointBlock& block : near.run.scratch.mesh_points)
    for (unsigned mask = near_box(block, box, static_cast<float>(reach)); mask != 0; mask &= mask - 1)
      offer_point(near, f, corner, reach,
                  mesh_point(near.placed, block.vertex[static_cast<std::size_t>(std::countr_zero(mask))]));
}

/// An edge of the body, with its ends in the mesh's frame, against the gathered edges.
void search_edges(const NearShape& near, H h, const std::array<Vec3, 2>& ends, Vec3 centre, double reach,
                  float extent) {
  const ObstacleMesh& mesh = *near.placed.part->mesh;
  const H twin = near.body.surface.twin[h];
  EdgeProbe probe;
  const Vec3 a = ends[0] - centre, b = ends[1] - centre, along = b - a;
  const double length = norm(along);
  for (std::size_t i = 0; i < 2 && length > 0; ++i) {
    if (i == 1 && !twin.valid()) break;
    const Vec3 normal = transposed_times(near.placed.axes, near.body.normal(ContactSurface::face(i == 0 ? h : twin)));
    const Vec3 into = ((i == 0 ? 1 : -1) / length) * cross(normal, along);
    probe.into[i] = to_corner(into);
    probe.at[i] = static_cast<float>(dot(into, a));
  }
  probe.a = to_corner(a);
  probe.b = to_corner(b);
  probe.reach = static_cast<float>(reach);
  probe.length = static_cast<float>(length);
  probe.extent = extent;
  for (const EdgeBlock& block : near.run.scratch.mesh_edges)
    for (unsigned mask = may_touch(block, probe); mask != 0; mask &= mask - 1) {
      const ObstacleLeaves::Edge& edge =
          mesh.leaves.edges[block.edge[static_cast<std::size_t>(std::countr_zero(mask))]];
      SegmentFeet feet;
      if (!inner_feet(ends[0], ends[1], edge.a, edge.b, feet)) continue;
      const Vec3 d = lerp(ends[0], ends[1], feet.s) - lerp(edge.a, edge.b, feet.t);
      if (dot(d, d) < reach * reach) hand_out_edges(near, h, mesh_edge(near.placed, edge), feet);
    }
}

/// Against corners and edges of the mesh.
void search_face(const NearShape& near, const MeshFace& face, const Gathered& gathered) {
  const ContactSurface& surface = near.body.surface;
  const auto r = static_cast<float>(face.reach);
  if (surface.coarse[face.face] != 0) {
    const Vec3 c = gathered.centre;
    search_points(near, face.face, box_of(std::array<Vec3, 3>{face.local[0] - c, face.local[1] - c, face.local[2] - c}),
                  face.reach);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(face.face, static_cast<int>(i));
    if (!surface.owns_edge(h) || !surface.is_coarse_edge(h) || face.is_clear(i)) continue;
    const std::array<Vec3, 2> ends{face.local[i], face.local[(i + 1) % 3]};
    const TreeBox box = box_of(ends);
    if (kerf::near(box, gathered.box, r))
      search_edges(near, h, ends, gathered.centre, face.reach, extent_of(joined(box, gathered.box), gathered.centre));
  }
}

void search_leaf(const NearShape& near, std::uint32_t leaf, Leaves leaves) {
  const ContactSurface& surface = near.body.surface;
  const PlacedPart& part = near.placed;
  const double rounding = 1e-6 * (norm(part.centre) + part.part->mesh->box.diagonal()) + near.body.frame.boxes.slack;
  surface.tree.for_each_triangle(leaf, [&](F f) {
    for (int i = 0; i < 3; ++i)
      if (const H h = ContactSurface::corner(f, i); surface.owns_vertex(h))
        search_vertex(near, surface.origin[h], leaves);
    if (near.body.state.sides != nullptr) search_mesh_sides(near, f, leaves);
  });
  if (near.body.frame.normals.empty()) return;  // no coarse triangles
  auto& faces = near.run.scratch.mesh_faces;
  faces.clear();
  surface.tree.for_each_triangle(leaf, [&](F f) {
    bool coarse = false;
    for (int i = 0; i < 3; ++i) coarse = coarse || surface.is_coarse_edge(ContactSurface::corner(f, i));
    if (!coarse) return;
    const MeshFace face = mesh_face(near, f, rounding);
    if (!face.is_clear()) faces.push_back(face);
  });
  if (faces.empty()) return;
  const Gathered gathered = gather(near, leaves);
  for (const MeshFace& face : faces) search_face(near, face, gathered);
}

}  // namespace

void detect_mesh(const NearShape& near, double reach) {
  find_pairs(near, reach);
  DetectScratch& scratch = near.run.scratch;
  const auto& pairs = scratch.leaf_pairs;
  const std::size_t vertices = near.body.surface.vertex_count();
  if (scratch.clearances.size() <= scratch.meshes) scratch.clearances.resize(scratch.meshes + 1);
  scratch.clearances[scratch.meshes].is_of(near.placed.part->mesh, vertices);
  if (scratch.placed.size() < vertices) scratch.placed.resize(vertices);
  ++scratch.mesh_calls;
  for (std::size_t i = 0; i < pairs.size();) {
    std::size_t end = i + 1;
    while (end < pairs.size() && pairs[end][0] == pairs[i][0]) ++end;
    search_leaf(near, pairs[i][0], std::span(pairs).subspan(i, end - i));
    i = end;
  }
  hand_out_points(near);
  ++scratch.meshes;
}

}  // namespace kerf
