#include "kerf/cutting/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/pieces.h"

namespace kerf {

namespace {

using namespace cut;
using CH = CollisionHalfEdge;
using CV = CollisionVertex;
using CF = CollisionTriangle;
using VH = VisualHalfEdge;
using VV = VisualVertex;
using VF = VisualTriangle;

constexpr double kRelative = 1e-9;
/// Of the box at the start: what is taken away is subtracted from the whole, whose rounding stays when next to nothing is left.
constexpr double kRounding = 1e-13;

template <class... Args>
Error broken(fmt::format_string<Args...> text, Args&&... args) {
  return failed("cell complex: " + fmt::format(text, std::forward<Args>(args)...));
}

/// Twins, fans, planar orientation; the same for both meshes. `plane(f)` tells which plane a face lies in.
template <class M, class Plane>
Status check_topology(const M& mesh, const char* name, Plane&& plane) {
  using H = typename M::H;
  using V = typename M::V;
  const std::size_t nh = mesh.half_edge_count();
  if (mesh.twin.size() != nh || mesh.planar.size() != nh || nh % 3 != 0) return broken("{}: array sizes differ", name);
  std::vector<std::int32_t> first(mesh.vertex_count() + 1,
                                  0);  // of every vertex, among the half-edges sorted by where they start
  for (const H h : ids<H>(nh)) {
    const V a = mesh.from(h), b = mesh.to(h);
    if (!mesh.outgoing.contains(a)) return broken("{}: half-edge {} starts nowhere", name, h.value);
    if (a == b) return broken("{}: face {} repeats vertex {}", name, M::face(h).value, a.value);
    ++first[a.index() + 1];
    if (const H t = mesh.twin[h]; t.valid()) {
      if (mesh.twin[t] != h) return broken("{}: twin of the twin of half-edge {} is another", name, h.value);
      if (mesh.from(t) != b || mesh.to(t) != a)
        return broken("{}: half-edge {} and its twin join other vertices", name, h.value);
    }
    if (!std::isfinite(mesh.planar[h].x) || !std::isfinite(mesh.planar[h].y))
      return broken("{}: half-edge {} has no finite planar position", name, h.value);
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<H> leaving(nh);
  {
    std::vector<std::int32_t> next(first.begin(), first.end() - 1);
    for (const H h : ids<H>(nh)) leaving[static_cast<std::size_t>(next[mesh.from(h).index()]++)] = h;
  }
  std::vector<std::int32_t> reached(mesh.vertex_count(), -1);  // the last vertex with an edge to it, of those looked at
  for (const V v : ids<V>(mesh.vertex_count())) {
    const std::span<const H> star(leaving.data() + first[v.index()],
                                  static_cast<std::size_t>(first[v.index() + 1] - first[v.index()]));
    for (const H h : star) {
      std::int32_t& by = reached[mesh.to(h).index()];
      if (by == v.value) return broken("{}: two half-edges {} -> {}", name, v.value, mesh.to(h).value);
      by = v.value;
    }
    for (const H h : star) {  // a simplicial complex: one edge between two vertices
      const H in = M::prev(h);
      if (!mesh.twin[in].valid() && reached[mesh.from(in).index()] == v.value)
        return broken("{}: two edges join vertices {} and {}", name, mesh.from(in).value, v.value);
    }
    if (star.empty()) return broken("{}: vertex {} belongs to no face", name, v.value);
    if (!mesh.twin.contains(mesh.outgoing[v]) || mesh.from(mesh.outgoing[v]) != v)
      return broken("{}: outgoing half-edge of vertex {} starts elsewhere", name, v.value);
    std::size_t count = 0;
    bool one_name = true;
    for_each_corner(mesh, v, [&](H h) {
      ++count;
      one_name = one_name && mesh.from(h) == v;
      return count <= star.size();
    });
    if (!one_name || count != star.size()) return broken("{}: vertex {} has more than one fan", name, v.value);
    // Same bits at all corners in one plane.
    for (std::size_t i = 1; i < star.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        if (plane(M::face(star[i])) == plane(M::face(star[k])) && !(mesh.planar[star[i]] == mesh.planar[star[k]]))
          return broken("{}: vertex {} has two positions in one plane", name, v.value);
  }
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const H h = M::corner(typename M::F(f), 0);
    if (!(orient(mesh.planar[h], mesh.planar[M::next(h)], mesh.planar[M::prev(h)]) > 0))
      return broken("{}: planar image of face {} is not positively oriented", name, f);
  }
  return {};
}

template <class M>
std::int64_t euler_characteristic(const M& mesh) {
  std::int64_t borders = 0;
  for (const auto t : mesh.twin.raw()) borders += t.valid() ? 0 : 1;
  const auto h = static_cast<std::int64_t>(mesh.half_edge_count());
  return static_cast<std::int64_t>(mesh.vertex_count()) - (h + borders) / 2 +
         static_cast<std::int64_t>(mesh.face_count());
}

/// What the visual mesh should look like, noted while walking over the collision mesh.
struct Expected {
  std::vector<std::int32_t> places;   // per visual vertex: how many collision elements own it
  std::vector<std::uint8_t> barrier;  // per visual half-edge
};

class Checker {
 public:
  Checker(const CellComplex& body) : body_(body), coarse_(body.collision), mesh_(body.visual) {
    expected_.places.assign(mesh_.vertex_count(), 0);
    expected_.barrier.assign(mesh_.half_edge_count(), 0);
  }

  Status check_vertices() {
    for (const CV v : ids<CV>(coarse_.vertex_count())) {
      const auto bound = coarse_.bound[v];
      if (!is_finite(coarse_.rest[v]) || !is_finite(coarse_.offset[v]))
        return broken("collision vertex {} is not finite", v.value);
      if (!mesh_.outgoing.contains(bound[0])) return broken("collision vertex {} has no bound vertex", v.value);
      if (body_.closed != bound[1].valid()) return broken("collision vertex {}: bound vertex of the - side", v.value);
      if (!coarse_.ancestor.contains(coarse_.ancestor[v]))
        return broken("collision vertex {} has no ancestor", v.value);
      ++expected_.places[bound[0].index()];
      if (body_.closed && bound[1] != bound[0]) ++expected_.places[bound[1].index()];
      for (int s = 0; s < side_count(body_); ++s)
        if (mesh_.free[bound[static_cast<std::size_t>(s)]])
          return broken("bound vertex {} is marked free", bound[static_cast<std::size_t>(s)].value);
      // Bound vertices lie where their collision vertex does, in every plane.
      Status status;
      for_each_corner(coarse_, v, [&](CH h) {
        const RootId root = coarse_.root[CollisionMesh::face(h)];
        for (int i = 0; i < side_count(body_); ++i) {
          const Side side = static_cast<Side>(i);
          bool met = false;
          for_each_corner(mesh_, bound[static_cast<std::size_t>(i)], [&](VH x) {
            if (!(mesh_.patch[VisualMesh::face(x)] == Patch::of_root(root, side))) return true;
            met = true;
            if (!(mesh_.planar[x] == mirrored(coarse_.planar[h], side)))
              status = broken("collision vertex {} and its bound vertex lie apart in root {}", v.value, root.value);
            return true;
          });
          if (!met) status = broken("bound vertex of collision vertex {} has no face in root {}", v.value, root.value);
        }
        return status.ok();
      });
      if (!status) return status;
      const bool cut_border = body_.closed && coarse_.on_border(v) && bound[0] != bound[1];
      if (body_.closed && !coarse_.on_border(v) && bound[0] == bound[1])
        return broken("inner collision vertex {} has one bound vertex", v.value);
      const PoolRun line = coarse_.line[v];
      if (cut_border != line.exists()) return broken("collision vertex {}: its line", v.value);
      if (!cut_border) continue;
      VV last = bound[0];
      for (std::int32_t i = 0; i <= line.count; ++i) {
        const VV next = i < line.count ? body_.chain_pool[line.at(i)] : bound[1];
        const VH h = mesh_.find_half_edge(last, next);
        if (!h.valid() || !mesh_.twin[h].valid()) return broken("line of collision vertex {} is broken", v.value);
        for (const VH x : {h, mesh_.twin[h]}) {
          if (!mesh_.patch[VisualMesh::face(x)].is_wall())
            return broken("line of collision vertex {} leaves the walls", v.value);
          expected_.barrier[x.index()] = 1;
        }
        if (i < line.count) ++expected_.places[next.index()];
        last = next;
      }
    }
    return {};
  }

  Status check_edges() {
    for (const CH h : ids<CH>(coarse_.half_edge_count())) {
      const CH g = coarse_.twin[h];
      const bool has = coarse_.has_chain(h);
      const RootId root = coarse_.root[CollisionMesh::face(h)];
      const WallId wall = coarse_.wall[h];
      const bool rim = body_.closed && !g.valid() && !wall.valid();
      if (!has) {
        if (!g.valid() || coarse_.root[CollisionMesh::face(g)] != root)
          return broken("collision half-edge {} has no chain", h.value);
        if (coarse_.has_chain(g)) return broken("collision half-edge {}: only its twin has a chain", h.value);
        if (wall.valid()) return broken("collision half-edge {} has a wall and no chain", h.value);
        continue;
      }
      if (wall.valid()) {
        if (g.valid() || !body_.closed) return broken("collision half-edge {} should have no wall", h.value);
        if (!body_.wall_edge.contains(wall) || body_.wall_edge[wall] != h)
          return broken("wall {} and half-edge {} disagree", wall.value, h.value);
      }
      if (rim && !(same_run(coarse_.chain[h][0], coarse_.chain[h][1]) && coarse_.on_rim(coarse_.from(h)) &&
                   coarse_.on_rim(coarse_.to(h))))
        return broken("rim half-edge {} has two chains", h.value);
      if (body_.closed != coarse_.chain[h][1].exists())
        return broken("collision half-edge {}: chain of the - side", h.value);
      for (int i = 0; i < side_count(body_); ++i) {
        const auto s = static_cast<std::size_t>(i);
        const PoolRun run = coarse_.chain[h][s];
        if (g.valid()) {
          const PoolRun other = coarse_.chain[g][s];
          if (!same_run(run, other.flipped()))
            return broken("collision half-edge {} and its twin have different chains", h.value);
        }
        VV last = coarse_.bound[coarse_.from(h)][s];
        double parameter = 0;
        for (std::int32_t k = 0; k <= run.count; ++k) {
          const VV next = k < run.count ? body_.chain_pool[run.at(k)] : coarse_.bound[coarse_.to(h)][s];
          const VH x = i == 0 ? mesh_.find_half_edge(last, next) : mesh_.find_half_edge(next, last);
          if (!x.valid())
            return broken("chain of collision half-edge {} is not connected at visual vertex {}", h.value, last.value);
          if (!(mesh_.patch[VisualMesh::face(x)] == Patch::of_root(root, static_cast<Side>(i))))
            return broken("chain of collision half-edge {} leaves its patch", h.value);
          const VH t = mesh_.twin[x];
          if (t.valid() != (g.valid() || body_.closed))
            return broken("chain of collision half-edge {} on a border", h.value);
          if (t.valid()) {
            const Patch beyond = mesh_.patch[VisualMesh::face(t)];
            const Patch wanted = g.valid() ? Patch::of_root(coarse_.root[CollisionMesh::face(g)], static_cast<Side>(i))
                                 : wall.valid() ? Patch::of_wall(wall)
                                                : Patch::of_root(root, static_cast<Side>(1 - i));
            if (!(beyond == wanted))
              return broken("beyond the chain of collision half-edge {} lies another patch", h.value);
            expected_.barrier[t.index()] = 1;
          }
          expected_.barrier[x.index()] = 1;
          if (k < run.count) {
            const double at = chain_position(h, i, next);
            if (!(at > parameter) || !(at < 1))
              return broken("chain of collision half-edge {} is out of order", h.value);
            parameter = at;
            if ((!g.valid() || h < g) && !(rim && i == 1)) ++expected_.places[next.index()];
            if (mesh_.free[next]) return broken("chain vertex {} is marked free", next.value);
          }
          last = next;
        }
      }
    }
    for (const WallId w : ids<WallId>(body_.wall_edge.size())) {
      const CH h = body_.wall_edge[w];
      if (!coarse_.wall.contains(h) || coarse_.wall[h] != w)
        return broken("wall {} hangs on half-edge {}, which does not know", w.value, h.value);
    }
    return {};
  }

  Status check_lists(const Pieces& coarse_pieces, const Pieces& fine_pieces) {
    std::vector<std::int32_t> piece_of(static_cast<std::size_t>(fine_pieces.count), -1);
    for (const CF f : ids<CF>(coarse_.face_count())) {
      const Vec2 p[3] = {coarse_.planar[CollisionMesh::corner(f, 0)], coarse_.planar[CollisionMesh::corner(f, 1)],
                         coarse_.planar[CollisionMesh::corner(f, 2)]};
      for (int i = 0; i < side_count(body_); ++i) {
        const PoolRun run = coarse_.free[f][static_cast<std::size_t>(i)];
        for (std::int32_t k = 0; k < run.count; ++k) {
          const VV v = body_.free_pool[run.at(k)];
          if (!mesh_.free[v]) continue;
          ++expected_.places[v.index()];
          const VF face = VisualMesh::face(mesh_.outgoing[v]);
          if (!(mesh_.patch[face] == Patch::of_root(coarse_.root[f], static_cast<Side>(i))))
            return broken("free visual vertex {} is listed by triangle {} of another patch", v.value, f.value);
          const Vec2 u = mirrored(mesh_.planar[mesh_.outgoing[v]], static_cast<Side>(i));
          for (int e = 0; e < 3; ++e)
            if (cross(p[(e + 1) % 3] - p[e], u - p[e]) <
                -kRelative * body_.mean_root_edge * norm(p[(e + 1) % 3] - p[e]))
              return broken("free visual vertex {} lies outside its triangle {}", v.value, f.value);
          std::int32_t& piece = piece_of[static_cast<std::size_t>(fine_pieces.of_face[face.index()])];
          if (piece < 0) piece = coarse_pieces.of_face[f.index()];
          if (piece != coarse_pieces.of_face[f.index()])
            return broken("free visual vertex {} lies in another piece than its triangle {}", v.value, f.value);
        }
      }
    }
    for (const WallId w : ids<WallId>(body_.wall_inner.size())) {
      const PoolRun run = body_.wall_inner[w];
      for (std::int32_t k = 0; k < run.count; ++k) {
        const VV v = body_.wall_pool[run.at(k)];
        if (!mesh_.free[v]) return broken("visual vertex {} is listed by wall {} but not free", v.value, w.value);
        ++expected_.places[v.index()];
        if (!(mesh_.patch[VisualMesh::face(mesh_.outgoing[v])] == Patch::of_wall(w)))
          return broken("visual vertex {} is listed by wall {} but lies elsewhere", v.value, w.value);
      }
    }
    for (const CV v : ids<CV>(coarse_.vertex_count()))
      for (int i = 0; i < side_count(body_); ++i) {
        const VV b = coarse_.bound[v][static_cast<std::size_t>(i)];
        const std::int32_t fine = fine_pieces.of_face[VisualMesh::face(mesh_.outgoing[b]).index()];
        std::int32_t& piece = piece_of[static_cast<std::size_t>(fine)];
        const std::int32_t mine = coarse_pieces.of_face[CollisionMesh::face(coarse_.outgoing[v]).index()];
        if (piece < 0) piece = mine;
        if (piece != mine)
          return broken("bound visual vertex {} lies in another piece than collision vertex {}", b.value, v.value);
      }
    return {};
  }

  Status check_visual() {
    for (const VV v : ids<VV>(mesh_.vertex_count())) {
      if (expected_.places[v.index()] != 1)
        return broken("visual vertex {} has {} owners instead of one", v.value, expected_.places[v.index()]);
      if (!is_finite(mesh_.rest[v])) return broken("visual vertex {} is not finite", v.value);
      if (!is_finite(to_double(mesh_.normal[v]))) return broken("normal of visual vertex {} is not finite", v.value);
    }
    for (const VH h : ids<VH>(mesh_.half_edge_count())) {
      if (!std::isfinite(mesh_.texture[h].x) || !std::isfinite(mesh_.texture[h].y))
        return broken("texture of visual half-edge {} is not finite", h.value);
      if (mesh_.barrier[h] != expected_.barrier[h.index()])
        return broken("visual half-edge {} ({} -> {}): barrier is {}", h.value, mesh_.from(h).value, mesh_.to(h).value,
                      mesh_.barrier[h]);
      const VH t = mesh_.twin[h];
      if (!t.valid()) {
        if (body_.closed) return broken("the visual mesh of a closed body has a border at half-edge {}", h.value);
        continue;
      }
      const Patch here = mesh_.patch[VisualMesh::face(h)], there = mesh_.patch[VisualMesh::face(t)];
      if (!mesh_.barrier[h] && !(here == there)) return broken("visual half-edge {} joins two patches", h.value);
      if (here.is_wall()) {
        if (!body_.wall_edge.contains(here.wall()))
          return broken("visual face {} lies in no known wall", VisualMesh::face(h).value);
      } else if (!body_.closed && here.side() == Side::kMinus) {
        return broken("visual face {} of an open sheet lies on the - side", VisualMesh::face(h).value);
      }
    }
    return {};
  }

 private:
  static bool same_run(const PoolRun& a, const PoolRun& b) {
    if (a.count != b.count) return false;
    return a.count <= 0 || (a.first == b.first && (a.count == 1 || a.reversed == b.reversed));
  }
  double chain_position(CH h, int side, VV v) {
    const Vec2 a = coarse_.planar[h], b = coarse_.planar[CollisionMesh::next(h)];
    const Patch patch = Patch::of_root(coarse_.root[CollisionMesh::face(h)], static_cast<Side>(side));
    Vec2 u{};
    for_each_corner(mesh_, v, [&](VH x) {
      if (!(mesh_.patch[VisualMesh::face(x)] == patch)) return true;
      u = mirrored(mesh_.planar[x], static_cast<Side>(side));
      return false;
    });
    return dot(u - a, b - a) / dot(b - a, b - a);
  }

  const CellComplex& body_;
  const CollisionMesh& coarse_;
  const VisualMesh& mesh_;
  Expected expected_;
};

}  // namespace

ComplexMeasures measure_complex(const CellComplex& body) {
  ComplexMeasures m;
  Box3 box;
  const VisualMesh& mesh = body.visual;
  for (const Vec3& p : mesh.rest.raw()) box.add(p);
  const Vec3 centre = box.center();
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    Vec3 p[3];
    for (int i = 0; i < 3; ++i) p[i] = mesh.rest[mesh.origin[VisualMesh::corner(VF(f), i)]] - centre;
    const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
    if (!mesh.patch[VF(f)].is_wall()) m.skin_area += 0.5 * norm(n);
    if (body.closed) m.volume += dot(p[0], n) / 6;
  }
  const CollisionMesh& coarse = body.collision;
  for (std::size_t f = 0; f < coarse.face_count(); ++f) {
    const CH h = CollisionMesh::corner(CF(f), 0);
    m.collision_area +=
        0.5 * orient(coarse.planar[h], coarse.planar[CollisionMesh::next(h)], coarse.planar[CollisionMesh::prev(h)]);
  }
  m.size = box.size();
  return m;
}

Status validate_complex(const CellComplex& body, const ComplexMeasures& at_start) {
  const CollisionMesh& coarse = body.collision;
  const VisualMesh& mesh = body.visual;
  if (coarse.chain.size() != coarse.half_edge_count() || coarse.wall.size() != coarse.half_edge_count() ||
      coarse.rest.size() != coarse.vertex_count() || coarse.offset.size() != coarse.vertex_count() ||
      coarse.bound.size() != coarse.vertex_count() || coarse.line.size() != coarse.vertex_count() ||
      coarse.ancestor.size() != coarse.vertex_count() || coarse.root.size() != coarse.face_count() ||
      coarse.free.size() != coarse.face_count())
    return broken("collision mesh: array sizes differ");
  if (mesh.texture.size() != mesh.half_edge_count() || mesh.barrier.size() != mesh.half_edge_count() ||
      mesh.rest.size() != mesh.vertex_count() || mesh.normal.size() != mesh.vertex_count() ||
      mesh.free.size() != mesh.vertex_count() || mesh.patch.size() != mesh.face_count() ||
      body.wall_edge.size() != body.wall_inner.size())
    return broken("visual mesh: array sizes differ");
  KERF_TRY(check_topology(coarse, "collision mesh", [&](CF f) { return coarse.root[f].value; }));
  KERF_TRY(check_topology(mesh, "visual mesh", [&](VF f) { return mesh.patch[f].value; }));
  Checker checker(body);
  KERF_TRY(checker.check_vertices());
  KERF_TRY(checker.check_edges());
  const Pieces coarse_pieces = collision_pieces(body), fine_pieces = visual_pieces(body);
  KERF_TRY(checker.check_lists(coarse_pieces, fine_pieces));
  KERF_TRY(checker.check_visual());
  // A shell's two walls count apart until a cut joins them, so pieces are compared through check_lists' map there.
  if (coarse_pieces.count > fine_pieces.count || (!body.closed && coarse_pieces.count != fine_pieces.count))
    return broken("{} collision pieces, but {} visual pieces", coarse_pieces.count, fine_pieces.count);
  if (body.closed && fine_pieces.count > coarse_pieces.count) {
    std::vector<std::uint8_t> has_border(static_cast<std::size_t>(coarse_pieces.count), 0);
    std::int32_t shells = 0;
    for (const CH h : ids<CH>(coarse.half_edge_count()))
      if (!coarse.twin[h].valid())
        has_border[static_cast<std::size_t>(coarse_pieces.of_face[CollisionMesh::face(h).index()])] = 1;
    for (const auto b : has_border) shells += b ? 0 : 1;
    if (fine_pieces.count != coarse_pieces.count + shells)
      return broken("{} collision pieces, but {} visual pieces", coarse_pieces.count, fine_pieces.count);
  }
  const std::int64_t chi_coarse = euler_characteristic(coarse), chi_fine = euler_characteristic(mesh);
  if (chi_fine != (body.closed ? 2 : 1) * chi_coarse)
    return broken("Euler characteristic {} of the visual mesh, {} of the collision mesh", chi_fine, chi_coarse);
  const ComplexMeasures now = measure_complex(body);
  const double box_area = dot(at_start.size, at_start.size),
               box_volume = at_start.size.x * at_start.size.y * at_start.size.z;
  const auto same = [](double a, double b, double whole) {
    return std::fabs(a - b) <= std::max(kRelative * std::fabs(b), kRounding * whole);
  };
  if (!same(now.skin_area, at_start.skin_area, box_area))
    return broken("skin area {} instead of {} m2", now.skin_area, at_start.skin_area);
  if (!same(now.collision_area, at_start.collision_area, box_area))
    return broken("collision area {} instead of {} m2", now.collision_area, at_start.collision_area);
  if (!same(now.volume, at_start.volume, box_volume))
    return broken("volume {} instead of {} m3", now.volume, at_start.volume);
  return {};
}

Status validate_piece_volumes(const CellComplex& body, const ComplexMeasures& at_start) {
  if (!body.closed) return {};
  const CollisionMesh& coarse = body.collision;
  const VisualMesh& mesh = body.visual;
  const Pieces pieces = collision_pieces(body), fine = visual_pieces(body);
  // A shell without a rim has two visual pieces to one of the collision mesh: the bound vertices tell whose they are.
  std::vector<std::int32_t> owner(static_cast<std::size_t>(fine.count), -1);
  std::vector<Vec3> origin(
      static_cast<std::size_t>(pieces.count));  // near by: far from zero, products of coordinates lose digits
  for (const CV v : ids<CV>(coarse.vertex_count())) {
    const std::int32_t piece = piece_of_triangle(pieces, CollisionMesh::face(coarse.outgoing[v]));
    origin[static_cast<std::size_t>(piece)] = coarse.rest[v];
    for (const VV u : coarse.bound[v])
      owner[static_cast<std::size_t>(fine.of_face[VisualMesh::face(mesh.outgoing[u]).index()])] = piece;
  }
  std::vector<double> volume(static_cast<std::size_t>(pieces.count), 0.0);
  for (const VF f : ids<VF>(mesh.face_count())) {
    const std::int32_t piece = owner[static_cast<std::size_t>(fine.of_face[f.index()])];
    if (piece < 0) return broken("visual piece {} belongs to no collision piece", fine.of_face[f.index()]);
    const auto p = [&](int k) {
      return mesh.rest[mesh.from(VisualMesh::corner(f, k))] - origin[static_cast<std::size_t>(piece)];
    };
    volume[static_cast<std::size_t>(piece)] += dot(p(0), cross(p(1), p(2))) / 6;
  }
  const double rounding = kRounding * at_start.size.x * at_start.size.y * at_start.size.z;
  for (std::size_t i = 0; i < volume.size(); ++i)
    if (!(volume[i] > rounding)) return broken("piece {} of {} has a volume of {} m3", i, volume.size(), volume[i]);
  return {};
}

}  // namespace kerf
