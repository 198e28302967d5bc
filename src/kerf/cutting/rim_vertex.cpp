#include "kerf/cutting/rim_vertex.h"

#include <algorithm>
#include <vector>

#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/slide_vertex.h"
#include "kerf/cutting/visual_split.h"

namespace kerf::cut {
namespace {

using VH = VisualHalfEdge;
using VV = VisualVertex;

/// A face a b c of a wall, with the wall's texture at p everywhere.
VisualTriangle append_wall_face(VisualMesh& mesh, WallId wall, const VV (&v)[3], const Vec2 (&at)[3], Vec2f texture,
                                int chain_edge, int line_edge) {
  const VisualTriangle f = append_face(mesh, v[0], v[1], v[2], at[0], at[1], at[2]);
  for (int i = 0; i < 3; ++i) {
    mesh.texture.push_back(texture);
    mesh.barrier.push_back(i == chain_edge || i == line_edge ? 1 : 0);
  }
  mesh.patch.push_back(Patch::of_wall(wall));
  return f;
}

}  // namespace

bool split_rim_vertex(CellComplex& body, CollisionVertex v) {
  CollisionMesh& coarse = body.collision;
  VisualMesh& mesh = body.visual;
  if (!body.closed || !coarse.on_border(v) || !coarse.on_rim(v)) return false;
  const auto [out, in] = border_edges(coarse, v);
  const WallId wall_out = coarse.wall[out], wall_in = coarse.wall[in];
  if (!wall_out.valid() || !wall_in.valid()) return false;
  const VV p = coarse.bound[v][0];

  // The - side's faces at p, and the two chain edges that part them from the walls: b -> p and p -> r.
  std::vector<VH> minus;
  VH to_p, from_p;
  for_each_corner(mesh, p, [&](VH h) {
    const Patch patch = mesh.patch[VisualMesh::face(h)];
    if (patch.is_wall() || patch.side() != Side::kMinus) return true;
    minus.push_back(h);
    if (mesh.patch[VisualMesh::face(mesh.twin[h])].is_wall()) from_p = h;
    if (const VH into = VisualMesh::prev(h); mesh.patch[VisualMesh::face(mesh.twin[into])].is_wall()) to_p = into;
    return true;
  });
  if (!to_p.valid() || !from_p.valid()) return false;
  const VH wall_to_b = mesh.twin[to_p], wall_from_r = mesh.twin[from_p];  // p -> b in one wall, r -> p in the other
  if (!(mesh.patch[VisualMesh::face(wall_to_b)] == Patch::of_wall(wall_out)) ||
      !(mesh.patch[VisualMesh::face(wall_from_r)] == Patch::of_wall(wall_in)))
    return false;
  const VV b = mesh.from(to_p), r = mesh.to(from_p);
  const VH p_in = VisualMesh::next(wall_from_r);
  const Vec2 p_out_at = mesh.planar[wall_to_b], b_at = mesh.planar[VisualMesh::next(wall_to_b)];
  const Vec2 p_in_at = mesh.planar[p_in], r_at = mesh.planar[wall_from_r];
  const Vec2 q_out_at{p_out_at.x, std::min(b_at.y, p_out_at.y - 0.5)},
      q_in_at{p_in_at.x, std::min(r_at.y, p_in_at.y - 0.5)};

  const VV q = append_visual_vertex(mesh, mesh.rest[p], mesh.normal[p]);
  for (const VH h : minus) mesh.origin.set(h, q);
  mesh.outgoing.set(q, from_p);
  mesh.outgoing.set(p, wall_to_b);
  const VisualTriangle first =
      append_wall_face(mesh, wall_out, {b, p, q}, {b_at, p_out_at, q_out_at}, mesh.texture[wall_to_b], 2, 1);
  const VisualTriangle second =
      append_wall_face(mesh, wall_in, {p, r, q}, {p_in_at, r_at, q_in_at}, mesh.texture[p_in], 1, 2);
  link(mesh, wall_to_b, VisualMesh::corner(first, 0));
  link(mesh, VisualMesh::corner(first, 2), to_p);
  link(mesh, wall_from_r, VisualMesh::corner(second, 0));
  link(mesh, VisualMesh::corner(second, 1), from_p);
  link(mesh, VisualMesh::corner(first, 1), VisualMesh::corner(second, 2));
  mesh.barrier.set(wall_to_b, 0);
  mesh.barrier.set(wall_from_r, 0);
  coarse.bound.set(v, {p, q});
  coarse.line.set(v, {static_cast<std::int32_t>(body.chain_pool.size()), 0, false});
  return true;
}

}  // namespace kerf::cut
