#include "kerf/cutting/visual_split.h"

#include <algorithm>

#include "kerf/base/prefetch.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/tolerances.h"

namespace kerf::cut {

namespace {
using H = VisualHalfEdge;

Vec3f blended_normal(const VisualMesh& mesh, const VisualVertex* v, const double* w, int n) {
  Vec3 sum;
  for (int i = 0; i < n; ++i) sum += w[i] * to_double(mesh.normal[v[i]]);
  const double length = norm(sum);
  return length > 0 ? to_float((1 / length) * sum) : mesh.normal[v[0]];
}
}  // namespace

Vec2 planar_in(const VisualMesh& mesh, VisualVertex v, Patch patch) {
  Vec2 result;
  [[maybe_unused]] bool found = false;
  for_each_corner(mesh, v, [&](H h) {
    if (!(mesh.patch[VisualMesh::face(h)] == patch)) return true;
    result = mesh.planar[h];
    found = true;
    return false;
  });
  KERF_ASSERT(found);
  return result;
}

VisualVertex append_visual_vertex(VisualMesh& mesh, Vec3 rest, Vec3f normal) {
  const VisualVertex v = mesh.outgoing.push_back(H{});
  mesh.rest.push_back(rest);
  mesh.normal.push_back(normal);
  mesh.free.push_back(0);
  return v;
}

bool edge_split_is_sound(const VisualMesh& mesh, H h, Vec2 u_left, Vec2 u_right, double keep) {
  const auto side_is_sound = [&](H e, Vec2 u) {
    const Vec2 a = mesh.planar[e], b = mesh.planar[VisualMesh::next(e)], c = mesh.planar[VisualMesh::prev(e)];
    const double first = orient(a, u, c), second = orient(u, b, c);
    if (!(first > 0) || !(second > 0)) return false;
    if (keep == 0) return true;
    const double least = keep * orient(a, b, c);
    return first > least && second > least;
  };
  if (!side_is_sound(h, u_left)) return false;
  const H g = mesh.twin[h];
  return !g.valid() || side_is_sound(g, u_right);
}

void prefetch_split(const VisualMesh& mesh, H h) {
  for (const VisualVertex v : {mesh.from(h), mesh.to(h)}) {
    prefetch(mesh.free, v);
    prefetch(mesh.rest, v);
    prefetch(mesh.normal, v);
  }
  prefetch(mesh.texture, h);
  prefetch(mesh.barrier, h);
  const H g = mesh.twin[h];
  if (!g.valid()) return;
  prefetch(mesh.origin, g);
  prefetch(mesh.twin, g);
  prefetch(mesh.planar, g);
  prefetch(mesh.texture, g);
  prefetch(mesh.barrier, g);
  prefetch(mesh.patch, VisualMesh::face(g));
}

VisualVertex split_visual_edge(VisualMesh& mesh, H h, double fraction, Vec2 u_left, Vec2 u_right, double reach) {
  const double length = norm(mesh.rest[mesh.to(h)] - mesh.rest[mesh.from(h)]);
  const double least = std::min(kClampFraction, reach / std::max(length, 1e-300));
  const double f = std::clamp(fraction, least, 1 - least);
  const H g = mesh.twin[h], hn = VisualMesh::next(h), hp = VisualMesh::prev(h);
  const VisualVertex a = mesh.origin[h], b = mesh.origin[hn];
  const VisualVertex ends[2] = {a, b};
  const double weights[2] = {1 - f, f};
  const VisualVertex m =
      append_visual_vertex(mesh, lerp(mesh.rest[a], mesh.rest[b], f), blended_normal(mesh, ends, weights, 2));

  const Vec2f texture_left = lerp(mesh.texture[h], mesh.texture[hn], f);
  const Vec2f texture_b = mesh.texture[hn], texture_c = mesh.texture[hp];
  const std::uint8_t along = mesh.barrier[h], moved = mesh.barrier[hn];
  const Patch patch_left = mesh.patch[VisualMesh::face(h)];
  const EdgeSplit<VisualMesh> split = split_edge_topology(mesh, h, m, u_left, u_right);
  mesh.texture.push_back(texture_left);
  mesh.texture.push_back(texture_b);
  mesh.texture.push_back(texture_c);
  mesh.texture.set(hn, texture_left);
  mesh.barrier.push_back(along);
  mesh.barrier.push_back(moved);
  mesh.barrier.push_back(0);
  if (moved) mesh.barrier.set(hn, 0);
  mesh.patch.push_back(patch_left);
  if (split.right.valid()) {
    // texture[g] still belongs to b; g now starts at m.
    const H gn = VisualMesh::next(g), gp = VisualMesh::prev(g);
    const Vec2f b_right = mesh.texture[g], d_right = mesh.texture[gp];
    const Vec2f texture_right = lerp(mesh.texture[gn], b_right, f);
    const std::uint8_t moved_right = mesh.barrier[gp];
    mesh.texture.push_back(b_right);
    mesh.texture.push_back(texture_right);
    mesh.texture.push_back(d_right);
    mesh.texture.set(g, texture_right);
    mesh.barrier.push_back(along);
    mesh.barrier.push_back(0);
    mesh.barrier.push_back(moved_right);
    if (moved_right) mesh.barrier.set(gp, 0);
    mesh.patch.push_back(mesh.patch[VisualMesh::face(g)]);
  }
  return m;
}

VisualVertex split_visual_face(VisualMesh& mesh, VisualTriangle f, std::array<double, 3> weights, Vec2 u,
                               double reach) {
  const H h[3] = {VisualMesh::corner(f, 0), VisualMesh::corner(f, 1), VisualMesh::corner(f, 2)};
  double sum = 0;
  double longest = 1e-300;
  for (const H e : h) longest = std::max(longest, norm(mesh.rest[mesh.to(e)] - mesh.rest[mesh.from(e)]));
  for (double& w : weights) sum += w = std::max(w, std::min(kNearEdgeWeight, reach / longest));
  VisualVertex v[3];
  Vec3 rest;
  Vec2f texture{};
  for (std::size_t i = 0; i < 3; ++i) {
    weights[i] /= sum;
    v[i] = mesh.origin[h[i]];
    rest += weights[i] * mesh.rest[v[i]];
    texture.x += static_cast<float>(weights[i]) * mesh.texture[h[i]].x;
    texture.y += static_cast<float>(weights[i]) * mesh.texture[h[i]].y;
  }
  const VisualVertex m = append_visual_vertex(mesh, rest, blended_normal(mesh, v, weights.data(), 3));
  const Vec2f corner[3] = {mesh.texture[h[0]], mesh.texture[h[1]], mesh.texture[h[2]]};
  const std::uint8_t barrier[2] = {mesh.barrier[h[1]], mesh.barrier[h[2]]};
  const Patch patch = mesh.patch[f];
  split_face_topology(mesh, f, m, u);
  for (const Vec2f& t : {corner[1], corner[2], texture, corner[2], corner[0], texture}) mesh.texture.push_back(t);
  mesh.texture.set(h[2], texture);
  for (const std::uint8_t b :
       {barrier[0], std::uint8_t{0}, std::uint8_t{0}, barrier[1], std::uint8_t{0}, std::uint8_t{0}})
    mesh.barrier.push_back(b);
  if (barrier[0]) mesh.barrier.set(h[1], 0);
  if (barrier[1]) mesh.barrier.set(h[2], 0);
  mesh.patch.push_back(patch);
  mesh.patch.push_back(patch);
  return m;
}

void set_barrier(VisualMesh& mesh, H h) {
  if (!mesh.barrier[h]) mesh.barrier.set(h, 1);
  const H g = mesh.twin[h];
  if (g.valid() && !mesh.barrier[g]) mesh.barrier.set(g, 1);
}

void flip_visual_edge(VisualMesh& mesh, H h) {
  const H g = mesh.twin[h], hn = VisualMesh::next(h), gn = VisualMesh::next(g);
  const Vec2f texture_c = mesh.texture[VisualMesh::prev(h)], texture_d = mesh.texture[VisualMesh::prev(g)];
  const std::uint8_t along_h = mesh.barrier[gn], along_g = mesh.barrier[hn];
  flip_edge_topology(mesh, h);
  mesh.texture.set(hn, texture_d);
  mesh.texture.set(gn, texture_c);
  mesh.barrier.set(h, along_h);
  mesh.barrier.set(g, along_g);
  mesh.barrier.set(hn, 0);
  mesh.barrier.set(gn, 0);
}

template <std::size_t N>
bool warp(VisualMesh& mesh, VisualVertex v, const std::array<PlanarPoint, N>& to, double keep) {
  const auto target = [&](H h) -> const Vec2* {
    for (const PlanarPoint& p : to)
      if (p.patch == mesh.patch[VisualMesh::face(h)]) return &p.at;
    return nullptr;
  };
  bool sound = true;
  for_each_corner(mesh, v, [&](H h) {
    const Vec2* u = target(h);
    if (!u) return true;
    const Vec2 p = mesh.planar[VisualMesh::next(h)], q = mesh.planar[VisualMesh::prev(h)];
    const double after = orient(*u, p, q);
    sound = after > 0 && after > keep * orient(mesh.planar[h], p, q);
    return sound;
  });
  if (!sound) return false;
  for_each_corner(mesh, v, [&](H h) {
    if (const Vec2* u = target(h)) mesh.planar.set(h, *u);
    return true;
  });
  return true;
}

template bool warp<1>(VisualMesh&, VisualVertex, const std::array<PlanarPoint, 1>&, double);
template bool warp<2>(VisualMesh&, VisualVertex, const std::array<PlanarPoint, 2>&, double);

}  // namespace kerf::cut
