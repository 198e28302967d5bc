#include "kerf/cutting/cut_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/cutting/collision_split.h"
#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/unlink.h"

namespace kerf {

namespace {

using namespace cut;
using H = CollisionHalfEdge;
using V = CollisionVertex;

double least_feature(const CellComplex& body, const CutOptions& options) {
  return std::max(options.minimum_feature, kLeastFeature) * body.mean_root_edge;
}

Status check(const CellComplex& body, const FacePoint& p, const CutOptions& options) {
  if (!p.face.valid() || p.face.index() >= body.collision.face_count())
    return bad_input(fmt::format("cut: there is no collision triangle {}", p.face.value));
  double sum = 0;
  for (const double w : p.weights) {
    if (!(w >= -1e-6) || !(w <= 1 + 1e-6))
      return bad_input(fmt::format("cut: weight {} lies outside collision triangle {}", w, p.face.value));
    sum += w;
  }
  if (!(std::fabs(sum - 1) < 1e-6))
    return bad_input(fmt::format("cut: the weights in collision triangle {} sum up to {}, not 1", p.face.value, sum));
  if (options.layers < 1 || options.layers > 1000)
    return bad_input(fmt::format("cut: {} layers of cut surface; choose 1 to 1000", options.layers));
  if (!(options.minimum_feature >= 0) || !(options.snap >= 0 && options.snap <= 0.45) ||
      !(options.minimum_feature <= 0.25) || !(options.roughness >= 0 && options.roughness <= 0.5))
    return bad_input(fmt::format("cut: minimum_feature must lie in [0, 0.25], snap in [0, 0.45], roughness in [0, 0.5], not "
                                 "{}, {} and {}", options.minimum_feature, options.snap, options.roughness));
  return {};
}

Vec2 planar_point(const CollisionMesh& mesh, H first, const std::array<double, 3>& w) {
  return w[0] * mesh.planar[first] + w[1] * mesh.planar[CollisionMesh::next(first)] + w[2] * mesh.planar[CollisionMesh::prev(first)];
}

/// Weights in the triangle's corner order, given in the order first, next, prev.
std::array<double, 3> clamped(std::array<double, 3> w) {
  double sum = 0;
  for (double& x : w) sum += x = std::clamp(x, 0.0, 1.0);
  for (double& x : w) x /= sum;
  return w;
}

/// Opens the edge tip - end if it is not open yet, and tells how the path stands.
Result<Advance> open_edge(CutContext& cut, V tip, V end, Advance::Kind kind) {
  const CollisionMesh& mesh = cut.body.collision;
  Advance result{end, kind, false, false};
  H h = mesh.find_half_edge(tip, end);
  if (!h.valid()) {
    const H g = mesh.find_half_edge(end, tip);
    if (g.valid()) h = mesh.twin[g].valid() ? mesh.twin[g] : g;
  }
  if (!h.valid()) {
    cut.fail("the path edge is missing", "collision vertex", tip.value);
    return cut.error();
  }
  const bool was_on_border = mesh.on_border(end);
  result.on_border = was_on_border;
  if (!mesh.is_border(h)) {
    if (!was_on_border && !mesh.on_border(tip)) {
      // A slit of one edge would have both lips between the same two vertices: not a simplicial complex, and whoever
      // reads the triangles alone would see it closed. So the first edge of a slit is two.
      const V middle = split_collision_edge(cut, h, 0.5);
      if (!middle.valid() || !unlink_edge(cut, h)) return cut.error();
      h = mesh.find_half_edge(middle, end);
      KERF_ASSERT(h.valid() && !mesh.is_border(h));
    }
    if (!unlink_edge(cut, h)) return cut.error();
    result.opened = true;
    if (was_on_border) result.kind = Advance::Kind::kRanOut;
  }
  flip_to_delaunay(cut);
  return result;
}

}  // namespace

Result<V> start_cut(CellComplex& body, const FacePoint& at, const CutOptions& options, CutScratch& scratch) {
  KERF_TRY(check(body, at, options));
  CutContext cut{body, options, scratch};
  scratch.flip_stack.clear();
  const CollisionMesh& mesh = body.collision;
  const double feature = least_feature(body, options);
  const H h0 = CollisionMesh::corner(at.face, 0);
  const std::array<double, 3> w = clamped(at.weights);
  const Vec2 t = planar_point(mesh, h0, w);
  H h = h0, nearest;
  bool enters = false;  // over a border
  for (std::size_t i = 0; i < 3; ++i) enters |= w[(i + 2) % 3] <= 0 && mesh.is_border(CollisionMesh::corner(at.face, static_cast<int>(i)));
  double least = (enters ? 2 : 1) * feature;
  for (int i = 0; i < 3; ++i, h = CollisionMesh::next(h))
    if (const double d = norm(t - mesh.planar[h]); d < least) {
      least = d;
      nearest = h;
    }
  if (nearest.valid()) return mesh.from(nearest);
  least = feature;
  double fraction = 0;
  for (int i = 0; i < 3; ++i, h = CollisionMesh::next(h)) {
    const Vec2 a = mesh.planar[h], b = mesh.planar[CollisionMesh::next(h)];
    const double d = cross(b - a, t - a) / norm(b - a);
    if (d < least) {
      least = d;
      nearest = h;
      fraction = dot(t - a, b - a) / dot(b - a, b - a);
    }
  }
  V v;
  if (nearest.valid()) {
    const H next = CollisionMesh::next(nearest);
    const double length = norm(mesh.planar[next] - mesh.planar[nearest]);
    if (fraction * length < feature) return mesh.from(nearest);
    if ((1 - fraction) * length < feature) return mesh.to(nearest);
    v = split_collision_edge(cut, nearest, fraction);
  } else {
    v = split_collision_face(cut, at.face, t, w);
  }
  if (!v.valid()) return cut.error();
  flip_to_delaunay(cut);
  return v;
}

Result<Advance> advance_cut(CellComplex& body, V tip, const FacePoint& target, const CutOptions& options,
                            CutScratch& scratch) {
  KERF_TRY(check(body, target, options));
  CutContext cut{body, options, scratch};
  scratch.flip_stack.clear();
  const CollisionMesh& mesh = body.collision;
  const double feature = least_feature(body, options);

  // Corners in the order tip, a, b.
  int corner = -1;
  for (int i = 0; i < 3; ++i)
    if (mesh.from(CollisionMesh::corner(target.face, i)) == tip) corner = i;
  if (corner < 0)
    return bad_input(fmt::format("cut: collision triangle {} does not touch the tip, vertex {}", target.face.value, tip.value));
  const std::array<double, 3> raw = clamped(target.weights);
  const std::array<double, 3> w{raw[static_cast<std::size_t>(corner)], raw[static_cast<std::size_t>((corner + 1) % 3)],
                                raw[static_cast<std::size_t>((corner + 2) % 3)]};
  const H out = CollisionMesh::corner(target.face, corner);  // tip -> a
  const H across = CollisionMesh::next(out);                 // a -> b
  const H in = CollisionMesh::prev(out);                     // b -> tip
  const V a = mesh.from(across), b = mesh.to(across);
  const Vec2 p0 = mesh.planar[out], pa = mesh.planar[across], pb = mesh.planar[in];
  const Vec2 t = planar_point(mesh, out, w);
  const bool crosses = w[0] <= 0;  // the blade is at the far edge or beyond it
  if ((!crosses && norm(t - p0) < feature) || !(w[1] + w[2] > 0)) return Advance{tip, Advance::Kind::kNothing, false, false};

  const double crossing = w[2] / (w[1] + w[2]);  // of the ray tip -> target, along a -> b
  const double length = norm(pb - pa);
  // A path near a lip runs along it, or the repeat of a cut that snapped to a corner would shave off a sliver.
  const double near_lip = kLipAttraction * std::max(options.snap * body.mean_root_edge, feature);
  const auto near_end = [&](H edge) {
    return std::min(0.45 * length, std::max({options.snap * length, feature, mesh.is_border(edge) ? near_lip : 0.0}));
  };

  const auto follow = [&](H edge, bool outgoing, Vec2 end_point, V end) -> Result<Advance> {
    const double edge_length = norm(end_point - p0);
    const double s = dot(t - p0, end_point - p0) / (edge_length * edge_length);
    if (crosses) return open_edge(cut, tip, end, Advance::Kind::kAtEdge);
    if (edge_length - s * edge_length > feature && s * edge_length > feature) {
      const V m = split_collision_edge(cut, edge, outgoing ? s : 1 - s);
      if (!m.valid()) return cut.error();
      return open_edge(cut, tip, m, Advance::Kind::kAtEdge);
    }
    if (s * edge_length <= feature) return Advance{tip, Advance::Kind::kNothing, false, false};
    return open_edge(cut, tip, end, Advance::Kind::kAtEdge);
  };
  if (crossing * length < near_end(out)) return follow(out, true, pa, a);
  if ((1 - crossing) * length < near_end(in)) return follow(in, false, pb, b);
  const double to_across = cross(pb - pa, t - pa) / length;
  if (crosses || to_across < feature) {
    const V m = split_collision_edge(cut, across, crossing);
    if (!m.valid()) return cut.error();
    return open_edge(cut, tip, m, Advance::Kind::kAtEdge);
  }
  const double to_out = cross(pa - p0, t - p0) / norm(pa - p0), to_in = cross(t - p0, pb - p0) / norm(pb - p0);
  const auto near_edge = [&](H edge) { return mesh.is_border(edge) ? std::max(near_lip, feature) : feature; };
  if (to_out < near_edge(out) && to_out <= to_in) return follow(out, true, pa, a);
  if (to_in < near_edge(in)) return follow(in, false, pb, b);
  const V m = split_collision_face(cut, target.face, t, raw);
  if (!m.valid()) return cut.error();
  return open_edge(cut, tip, m, Advance::Kind::kInside);
}

}  // namespace kerf
