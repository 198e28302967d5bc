#include "kerf/cutting/shave.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "kerf/base/indexed.h"
#include "kerf/base/journal.h"
#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/collision_split.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/visual_split.h"
#include "kerf/cutting/wall_points.h"

namespace kerf {
namespace {

using namespace cut;
using H = CollisionHalfEdge;
using V = CollisionVertex;
using F = CollisionTriangle;
using VV = VisualVertex;
using VH = VisualHalfEdge;
using VF = VisualTriangle;

/// A bump is cut down to this part of what its neighbours stand out on the mean, if it stands out more.
constexpr double kNeighbours = 0.5;
/// An edge moves back where its walls stray less than this part of the half thickness.
constexpr double kSmoothEnough = 0.05;
/// A collision vertex keeps this distance (part of the mean root edge) from edges with chains.
constexpr double kLeastHeight = 0.03;
/// Faces keep this part of their planar area in one pass.
constexpr double kKeepsArea = 0.5;
/// And this area at least, part of the mean root edge squared: visual, collision.
constexpr double kLeastVisualArea = 1e-7, kLeastArea = 1e-4;
constexpr int kHalvings = 4;
/// An edge is divided where it is met at least so far from its ends: in radii of the shaver, in minimum features.
constexpr double kLeastSpacing = 0.75, kLeastFeatures = 4;

/// Nearest points of two segments, as parameters of the first.
double segment_distance(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1, double& s) {
  const Vec3 d1 = p1 - p0, d2 = q1 - q0, r = p0 - q0;
  const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r);
  double t = 0;
  if (!(a > 0)) {
    s = 0;
    t = e > 0 ? std::clamp(f / e, 0.0, 1.0) : 0.0;
  } else {
    const double c = dot(d1, r);
    if (!(e > 0)) {
      s = std::clamp(-c / a, 0.0, 1.0);
    } else {
      const double b = dot(d1, d2), denominator = a * e - b * b;
      s = denominator > 1e-12 * a * e ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
      t = (b * s + f) / e;
      if (t < 0 || t > 1) {
        t = std::clamp(t, 0.0, 1.0);
        s = std::clamp((b * t - c) / a, 0.0, 1.0);
      }
    }
  }
  return norm((p0 + s * d1) - (q0 + t * d2));
}
double point_distance(Vec3 p, Vec3 q0, Vec3 q1) {
  const Vec3 d = q1 - q0;
  const double e = dot(d, d), t = e > 0 ? std::clamp(dot(p - q0, d) / e, 0.0, 1.0) : 0.0;
  return norm(p - (q0 + t * d));
}

/// Where the shaver meets a wall's edge.
struct Contact {
  WallId wall;
  H edge;
  double middle = 0, half = 0;  ///< parameters of the edge
  /// 1 in the middle, 0 at the ends.
  [[nodiscard]] double weight(double t) const {
    const double x = (t - middle) / half;
    return x * x < 1 ? 1 - x * x : 0;
  }
};

class ShavingPass {
 public:
  ShavingPass(CellComplex& body, std::vector<Vec3>& position, const Shaver& shaver, const ShaveOptions& options,
              const CutOptions& cut_options, CutScratch& scratch, ShavePass& pass)
      : body_(body), coarse_(body.collision), mesh_(body.visual), position_(position), shaver_(shaver), options_(options),
        cut_options_(cut_options), scratch_(scratch), pass_(pass) {}

  void run() {
    find_contacts();
    if (options_.depth > 0 && divide_long_edges()) find_contacts();
    for (const Contact& c : contacts_) pass_.walls.push_back(c.wall);
    if (contacts_.empty()) return;
    pass_.roughness_before = wall_roughness(body_, pass_.walls);
    smooth();
    if (options_.depth > 0) move_back();
    sort_unique(pass_.vertices);
    sort_unique(pass_.collision_vertices);
    pass_.roughness_after = wall_roughness(body_, pass_.walls);
  }

 private:
  template <class T>
  static void sort_unique(std::vector<T>& v) {
    std::sort(v.begin(), v.end());
    v.erase(std::unique(v.begin(), v.end()), v.end());
  }
  [[nodiscard]] double half_thickness(V v) const { return norm(coarse_.offset[v]); }

  void find_contacts() {
    contacts_.clear();
    pass_.edges = 0;
    for (const WallId w : ids<WallId>(body_.wall_edge.size())) {
      const H h = body_.wall_edge[w];
      const V a = coarse_.from(h), b = coarse_.to(h);
      const Vec3 pa = position_[a.index()], pb = position_[b.index()];
      const double reach = shaver_.radius + std::max(half_thickness(a), half_thickness(b));
      double s = 0;
      const double d = segment_distance(pa, pb, shaver_.base, shaver_.tip, s);
      if (!(d < reach)) continue;
      const double length = norm(pb - pa);
      contacts_.push_back({w, h, s, std::sqrt(reach * reach - d * d) / std::max(length, 1e-300)});
      ++pass_.edges;
    }
  }

  /// An edge moves back at its ends only, so one that is met far from both gets a vertex there.
  bool divide_long_edges() {
    const double feature = std::max(cut_options_.minimum_feature, kLeastFeature) * body_.mean_root_edge;
    const double least = std::max(kLeastSpacing * shaver_.radius, kLeastFeatures * feature);
    bool divided = false;
    for (const Contact& c : contacts_) {
      const double length = norm(coarse_.rest[coarse_.to(c.edge)] - coarse_.rest[coarse_.from(c.edge)]);
      if (!(length * std::min(c.middle, 1 - c.middle) > least)) continue;
      JournalMark mark;
      journal_mark(body_, mark);
      CutContext cut{body_, cut_options_, scratch_};
      scratch_.flip_stack.clear();
      const V a = coarse_.from(c.edge), b = coarse_.to(c.edge);
      const V v = split_collision_edge(cut, c.edge, c.middle);
      if (!v.valid()) {
        journal_rollback(body_, mark);
        continue;
      }
      flip_to_delaunay(cut);
      position_.push_back(lerp(position_[a.index()], position_[b.index()], c.middle));
      KERF_ASSERT(position_.size() == coarse_.vertex_count());
      divided = true;
    }
    return divided;
  }

  /// Writes new places of visual vertices and books what that does to volume and skin.
  struct Move { VV vertex; Vec3 rest; };
  void apply(const std::vector<Move>& moves) {
    faces_.clear();
    for (const Move& m : moves)
      for_each_corner(mesh_, m.vertex, [&](VH h) {
        faces_.push_back(VisualMesh::face(h));
        return true;
      });
    sort_unique(faces_);
    if (faces_.empty()) return;
    const Vec3 origin = mesh_.rest[mesh_.origin[VisualMesh::corner(faces_[0], 0)]];
    const auto book = [&](double sign) {
      for (const VF f : faces_) {
        Vec3 p[3];
        for (int i = 0; i < 3; ++i) p[i] = mesh_.rest[mesh_.origin[VisualMesh::corner(f, i)]] - origin;
        const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
        pass_.removed -= sign * dot(p[0], n) / 6;
        if (!mesh_.patch[f].is_wall()) pass_.skin_area += sign * 0.5 * norm(n);
      }
    };
    book(-1);
    for (const Move& m : moves) {
      mesh_.rest.set(m.vertex, m.rest);
      pass_.vertices.push_back(m.vertex);
    }
    book(1);
  }

  // ---------------------------------------------------------------- bumps

  void smooth() {
    struct Bump {
      VV vertex;
      Vec3 smooth, stray;
      double weight = 0;
      bool operator<(const Bump& o) const { return vertex < o.vertex; }
    };
    std::vector<Bump> bumps;
    for (const Contact& c : contacts_) {
      const Vec3 a = coarse_.rest[coarse_.from(c.edge)], e = coarse_.rest[coarse_.to(c.edge)] - a;
      wall_points(body_, c.wall, points_);
      for (const WallPoint& p : points_)
        bumps.push_back({p.vertex, p.smooth, mesh_.rest[p.vertex] - p.smooth, c.weight(std::clamp(dot(p.smooth - a, e) / dot(e, e), 0.0, 1.0))});
    }
    std::stable_sort(bumps.begin(), bumps.end());
    std::vector<Bump> one;  // a vertex of a line is seen from two walls: the stronger contact counts
    for (const Bump& b : bumps)
      if (one.empty() || one.back().vertex != b.vertex) one.push_back(b);
      else one.back().weight = std::max(one.back().weight, b.weight);
    std::vector<Move> moves;
    for (const Bump& b : one) {
      const double height = norm(b.stray);
      if (!(b.weight > 0) || !(height > 0)) continue;
      double around = 0;
      int n = 0;
      for_each_corner(mesh_, b.vertex, [&](VH h) {
        const auto it = std::lower_bound(one.begin(), one.end(), Bump{mesh_.to(h), {}, {}, 0});
        around += it != one.end() && it->vertex == mesh_.to(h) ? norm(it->stray) : 0;
        ++n;
        return true;
      });
      const double excess = height - kNeighbours * around / n;
      if (!(excess > 0)) continue;
      const double left = std::max(0.0, 1 - options_.smoothing * b.weight * excess / height);
      moves.push_back({b.vertex, b.smooth + left * b.stray});
    }
    apply(moves);
  }

  // ---------------------------------------------------------------- edges that move back

  void move_back() {
    std::vector<std::pair<V, double>> touched;
    for (const Contact& c : contacts_)
      for (const V v : {coarse_.from(c.edge), coarse_.to(c.edge)}) {
        const double reach = shaver_.radius + half_thickness(v);
        const double d = point_distance(position_[v.index()], shaver_.base, shaver_.tip);
        if (d < reach) touched.emplace_back(v, 1 - d * d / (reach * reach));
      }
    sort_unique(touched);
    for (const auto& [v, weight] : touched) {
      const auto way = way_back(v);
      if (!way) {
        ++pass_.stuck;
        continue;
      }
      if (!is_smooth_around(v)) continue;
      bool moved = false;
      double part = std::min(1.0, options_.depth * weight / std::max(way->length, 1e-300));
      for (int i = 0; i <= kHalvings && !moved; ++i, part *= 0.5) moved = move(v, *way, part);
      if (moved) {
        ++pass_.moved_back;
        pass_.collision_vertices.push_back(v);
      } else {
        ++pass_.stuck;
      }
    }
  }

  /// Walls on both sides of v, their lines and columns.
  [[nodiscard]] bool is_smooth_around(V v) {
    const double limit = kSmoothEnough * half_thickness(v);
    for (const WallId w : walls_at(v)) {
      wall_points(body_, w, points_);
      for (const WallPoint& p : points_)
        if (norm(mesh_.rest[p.vertex] - p.smooth) > limit) return false;
    }
    return true;
  }
  [[nodiscard]] std::vector<WallId> walls_at(V v) const {
    std::vector<WallId> walls;
    for_each_corner(coarse_, v, [&](H h) {
      for (const H e : {h, CollisionMesh::prev(h)})
        if (coarse_.is_border(e) && coarse_.wall[e].valid()) walls.push_back(coarse_.wall[e]);
      return true;
    });
    return walls;
  }

  /// Where a vertex may move to: along one edge (of the rim, or of a root triangle), or freely in the plane of its one root.
  struct Way {
    V along;              ///< the other end of that edge; none: freely
    Vec2 direction;       ///< then: in the root's plane, towards the material; as long as `length`
    double length = 0;    ///< metres of the whole way
  };
  [[nodiscard]] std::optional<Way> way_back(V v) const {
    if (!coarse_.on_border(v)) return std::nullopt;
    const H out = coarse_.fan_start(v);
    H last = out;
    for (H h = out; h.valid(); h = coarse_.ccw(h)) last = h;
    const H in = CollisionMesh::prev(last);
    if (coarse_.ancestor[coarse_.to(out)] == coarse_.ancestor[coarse_.from(in)]) return std::nullopt;  // the end of a slit
    H slide;
    int slides = 0;
    for (const H h : {out, in})
      if (!coarse_.wall[h].valid()) slide = h, ++slides;
    const RootId root = coarse_.root[CollisionMesh::face(out)];
    bool one_root = true;
    for (H h = out; h.valid(); h = coarse_.ccw(h)) {
      one_root = one_root && coarse_.root[CollisionMesh::face(h)] == root;
      if (h != out && coarse_.has_chain(h)) slide = h, ++slides;
    }
    Way way;
    if (slides > 1 || (slides == 0 && !one_root)) return std::nullopt;
    // One visual vertex serves both sides on the rim, and goes on doing so.
    if (coarse_.on_rim(v) && (slides == 0 || !coarse_.is_border(slide))) return std::nullopt;
    if (slides == 1) {
      way.along = coarse_.from(slide) == v ? coarse_.to(slide) : coarse_.from(slide);
      way.length = norm(coarse_.rest[way.along] - coarse_.rest[v]);
      return way;
    }
    const Vec2 p = coarse_.planar[out];
    const Vec2 a = coarse_.planar[CollisionMesh::next(out)], b = coarse_.planar[in];
    const auto inward = [](Vec2 from, Vec2 to) {  // the material is on the left
      const Vec2 d = to - from;
      return (1 / norm(d)) * Vec2{-d.y, d.x};
    };
    const Vec2 n = inward(p, a) + inward(b, p);
    if (!(norm(n) > 1e-3)) return std::nullopt;
    way.direction = (1 / norm(n)) * n;
    way.length = 1;
    return way;
  }

  struct Corner { RootId root; Vec2 from, to; };  ///< of the moving vertex, in one plane
  struct Shift {
    VV vertex;
    std::array<Patch, 2> patch;
    std::array<Vec2, 2> planar;
    int planes = 0;
    Vec3 rest;
    Vec3f normal;
    std::array<Vec2f, 2> texture;
  };

  /// Moves v by a part of its way, and what hangs on it; false and nothing done if anything would turn over.
  bool move(V v, const Way& way, double part) {
    corners_.clear();
    fan_.clear();
    for_each_corner(coarse_, v, [&](H h) {
      fan_.push_back(h);
      const RootId root = coarse_.root[CollisionMesh::face(h)];
      for (const Corner& c : corners_)
        if (c.root == root) return true;
      corners_.push_back({root, coarse_.planar[h], coarse_.planar[h]});
      return true;
    });
    std::sort(fan_.begin(), fan_.end());
    if (way.along.valid()) {
      for (Corner& c : corners_)
        for (const H h : fan_)
          for (const H e : {CollisionMesh::next(h), CollisionMesh::prev(h)})
            if (coarse_.root[CollisionMesh::face(h)] == c.root && coarse_.from(e) == way.along) c.to = lerp(c.from, coarse_.planar[e], part);
    } else {
      corners_[0].to = corners_[0].from + part * way.direction;
    }
    // The collision triangles around it.
    double area = 0;
    for (const H h : fan_) {
      const Vec2 a = coarse_.planar[CollisionMesh::next(h)], b = coarse_.planar[CollisionMesh::prev(h)];
      const Corner& c = corner_of(coarse_.root[CollisionMesh::face(h)]);
      const double before = orient(c.from, a, b), after = orient(c.to, a, b);
      const double unit = body_.mean_root_edge * body_.mean_root_edge;
      if (!(after > kKeepsArea * before && after > kLeastArea * unit)) return false;
      if (coarse_.has_chain(CollisionMesh::next(h)) && !(after > kLeastHeight * body_.mean_root_edge * norm(b - a)) && after < before) return false;
      area += 0.5 * (after - before);
    }
    if (!(area < 0)) return false;

    // Everything that the triangles around it own moves with it: by as much as the vertex's hat function says.
    shifts_.clear();
    for (int i = 0; i < 2; ++i) {
      const auto s = static_cast<std::size_t>(i);
      const Side side = static_cast<Side>(i);
      if (!(i == 1 && coarse_.on_rim(v)) && !add_shift(coarse_.bound[v][s], side, 1)) return false;
      for (const H h : fan_) {
        for (const H e : {h, CollisionMesh::prev(h)}) {
          const PoolRun run = coarse_.chain[e][s];
          const bool rim = coarse_.is_border(e) && !coarse_.wall[e].valid();
          const bool twice = (coarse_.twin[e].valid() && coarse_.twin[e] < e) || (rim && i == 1);
          if (twice) continue;
          const RootId root = coarse_.root[CollisionMesh::face(e)];
          const Vec2 from = coarse_.planar[e], to = coarse_.planar[CollisionMesh::next(e)], d = to - from;
          for (std::int32_t k = 0; k < run.count; ++k) {
            const VV x = body_.chain_pool[run.at(k)];
            const Vec2 u = mirrored(planar_in(mesh_, x, Patch::of_root(root, side)), side);
            const double t = dot(u - from, d) / dot(d, d);
            if (!add_shift(x, side, e == h ? 1 - t : t)) return false;
          }
        }
        const PoolRun list = coarse_.free[CollisionMesh::face(h)][s];
        const Vec2 a = coarse_.planar[CollisionMesh::next(h)], b = coarse_.planar[CollisionMesh::prev(h)];
        const double whole = orient(coarse_.planar[h], a, b);
        for (std::int32_t k = 0; k < list.count; ++k) {
          const VV x = body_.free_pool[list.at(k)];
          if (!mesh_.free[x]) continue;
          const Vec2 u = mirrored(mesh_.planar[mesh_.outgoing[x]], side);
          if (!add_shift(x, side, std::clamp(orient(u, a, b) / whole, 0.0, 1.0))) return false;
        }
      }
    }
    if (!nothing_turns_over()) return false;

    // Where walls stray from their smooth shape, they go on doing so.
    std::vector<std::pair<WallPoint, Vec3>> strays;
    for (const WallId w : walls_at(v)) {
      wall_points(body_, w, points_);
      for (const WallPoint& p : points_) strays.emplace_back(p, mesh_.rest[p.vertex] - p.smooth);
    }
    move_collision_vertex(v, way, part);
    std::vector<Move> moves;
    for (const Shift& s : shifts_) moves.push_back({s.vertex, s.rest});
    apply(moves);
    for (const Shift& s : shifts_) {
      mesh_.normal.set(s.vertex, s.normal);
      for_each_corner(mesh_, s.vertex, [&](VH h) {
        for (int k = 0; k < s.planes; ++k)
          if (mesh_.patch[VisualMesh::face(h)] == s.patch[static_cast<std::size_t>(k)]) {
            mesh_.planar.set(h, s.planar[static_cast<std::size_t>(k)]);
            mesh_.texture.set(h, s.texture[static_cast<std::size_t>(k)]);
          }
        return true;
      });
    }
    moves.clear();
    std::size_t next = 0;
    for (const WallId w : walls_at(v)) {
      wall_points(body_, w, points_);
      for (const WallPoint& p : points_) {
        KERF_ASSERT(next < strays.size() && strays[next].first.vertex == p.vertex);
        const bool again = std::any_of(moves.begin(), moves.end(), [&](const Move& m) { return m.vertex == p.vertex; });
        if (!again) moves.push_back({p.vertex, lerp(p.top, p.bottom, strays[next].first.across) + strays[next].second});
        ++next;
      }
    }
    apply(moves);
    pass_.collision_area += area;
    return true;
  }

  [[nodiscard]] const Corner& corner_of(RootId root) const {
    for (const Corner& c : corners_)
      if (c.root == root) return c;
    KERF_ASSERT(false);
    return corners_[0];
  }

  void move_collision_vertex(V v, const Way& way, double part) {
    if (way.along.valid()) {
      coarse_.rest.set(v, lerp(coarse_.rest[v], coarse_.rest[way.along], part));
      coarse_.offset.set(v, lerp(coarse_.offset[v], coarse_.offset[way.along], part));
    } else {
      // Affine in the root's plane; the largest triangle around tells it best.
      H best;
      double most = 0;
      for (const H h : fan_) {
        const double a = orient(coarse_.planar[h], coarse_.planar[CollisionMesh::next(h)], coarse_.planar[CollisionMesh::prev(h)]);
        if (a > most) most = a, best = h;
      }
      const H next = CollisionMesh::next(best), prev = CollisionMesh::prev(best);
      const Vec2 u = corners_[0].to, p = coarse_.planar[best], a = coarse_.planar[next], b = coarse_.planar[prev];
      const double wa = cross(u - p, b - p) / most, wb = cross(a - p, u - p) / most;
      const auto mix = [&](const auto& array) {
        const Vec3 x = array[v];
        return x + wa * (array[coarse_.from(next)] - x) + wb * (array[coarse_.from(prev)] - x);
      };
      coarse_.rest.set(v, mix(coarse_.rest));
      coarse_.offset.set(v, mix(coarse_.offset));
    }
    for (const H h : fan_) coarse_.planar.set(h, corner_of(coarse_.root[CollisionMesh::face(h)]).to);
  }

  /// A visual vertex that moves by `hat` times the way of the collision vertex, in all root planes that it has. Its new place on the
  /// skin is where the skin was there; false: not found.
  bool add_shift(VV x, Side side, double hat) {
    if (!x.valid() || !(hat > 0)) return true;
    Shift s;
    s.vertex = x;
    bool found_rest = false, ok = true;
    for_each_corner(mesh_, x, [&](VH h) {
      const Patch patch = mesh_.patch[VisualMesh::face(h)];
      if (patch.is_wall() || std::find(s.patch.begin(), s.patch.begin() + s.planes, patch) != s.patch.begin() + s.planes) return true;
      const auto corner = std::find_if(corners_.begin(), corners_.end(), [&](const Corner& c) { return c.root == patch.root(); });
      if (corner == corners_.end() || s.planes == 2) return ok = false;
      const auto k = static_cast<std::size_t>(s.planes++);
      s.patch[k] = patch;
      // The bound vertex keeps the bits of the collision vertex.
      s.planar[k] = hat == 1 ? mirrored(corner->to, patch.side())
                             : mesh_.planar[h] + hat * (mirrored(corner->to, patch.side()) - mirrored(corner->from, patch.side()));
      std::array<double, 3> w{};
      const VF f = find_face(h, s.planar[k], w);
      Vec2f texture{};
      Vec3 rest, normal;
      for (int i = 0; i < 3; ++i) {
        const VH e = VisualMesh::corner(f, i);
        const double weight = w[static_cast<std::size_t>(i)];
        rest += weight * mesh_.rest[mesh_.origin[e]];
        normal += weight * to_double(mesh_.normal[mesh_.origin[e]]);
        texture.x += static_cast<float>(weight) * mesh_.texture[e].x;
        texture.y += static_cast<float>(weight) * mesh_.texture[e].y;
      }
      s.texture[k] = texture;
      if (!found_rest) {
        s.rest = rest;
        s.normal = norm(normal) > 1e-6 ? to_float(normalized(normal)) : mesh_.normal[x];
        found_rest = true;
      }
      return true;
    });
    (void)side;
    if (!ok || !found_rest) return false;
    shifts_.push_back(s);
    return true;
  }

  /// The face of the patch of h that holds u, by a walk from h; where rounding leads out of the patch, its nearest face.
  VF find_face(VH h, Vec2 u, std::array<double, 3>& w) const {
    VF f = VisualMesh::face(h);
    const Patch patch = mesh_.patch[f];
    // The face around the vertex that looks towards u, to begin with.
    for_each_corner(mesh_, mesh_.from(h), [&](VH e) {
      if (!(mesh_.patch[VisualMesh::face(e)] == patch)) return true;
      const Vec2 c = mesh_.planar[e], a = mesh_.planar[VisualMesh::next(e)], b = mesh_.planar[VisualMesh::prev(e)];
      if (orient(c, a, u) < 0 || orient(c, b, u) > 0) return true;
      f = VisualMesh::face(e);
      return false;
    });
    for (int step = 0; step < 1000; ++step) {
      VH worst;
      double most = 0;
      for (int i = 0; i < 3; ++i) {
        const VH e = VisualMesh::corner(f, i);
        const double out = orient(mesh_.planar[e], mesh_.planar[VisualMesh::next(e)], u);
        const VH t = mesh_.twin[e];
        if (!(out < most) || !t.valid() || !(mesh_.patch[VisualMesh::face(t)] == patch)) continue;
        most = out;
        worst = e;
      }
      if (!worst.valid()) break;
      f = VisualMesh::face(mesh_.twin[worst]);
    }
    double sum = 0;
    const VH e = VisualMesh::corner(f, 0);
    const Vec2 p[3] = {mesh_.planar[e], mesh_.planar[VisualMesh::next(e)], mesh_.planar[VisualMesh::prev(e)]};
    for (std::size_t i = 0; i < 3; ++i) sum += w[i] = std::max(0.0, orient(u, p[(i + 1) % 3], p[(i + 2) % 3]));
    if (!(sum > 0)) w = {1, 0, 0}, sum = 1;
    for (double& x : w) x /= sum;
    return f;
  }

  [[nodiscard]] bool nothing_turns_over() {
    std::sort(shifts_.begin(), shifts_.end(), [](const Shift& a, const Shift& b) { return a.vertex < b.vertex; });
    for (std::size_t i = 1; i < shifts_.size(); ++i)
      if (shifts_[i].vertex == shifts_[i - 1].vertex) return false;
    const double least = kLeastVisualArea * body_.mean_root_edge * body_.mean_root_edge;
    faces_.clear();
    for (const Shift& s : shifts_)
      for_each_corner(mesh_, s.vertex, [&](VH h) {
        if (!mesh_.patch[VisualMesh::face(h)].is_wall()) faces_.push_back(VisualMesh::face(h));
        return true;
      });
    sort_unique(faces_);
    for (const VF f : faces_) {
      Vec2 before[3], after[3];
      for (int i = 0; i < 3; ++i) {
        const VH h = VisualMesh::corner(f, i);
        before[i] = after[i] = mesh_.planar[h];
        const auto it = std::lower_bound(shifts_.begin(), shifts_.end(), mesh_.origin[h], [](const Shift& s, VV v) { return s.vertex < v; });
        if (it == shifts_.end() || it->vertex != mesh_.origin[h]) continue;
        for (int k = 0; k < it->planes; ++k)
          if (it->patch[static_cast<std::size_t>(k)] == mesh_.patch[f]) after[i] = it->planar[static_cast<std::size_t>(k)];
      }
      const double a0 = orient(before[0], before[1], before[2]), a1 = orient(after[0], after[1], after[2]);
      if (!(a1 > kKeepsArea * a0) || (!(a1 > least) && a1 < a0) || !(a1 > 0)) return false;
    }
    return true;
  }

  CellComplex& body_;
  CollisionMesh& coarse_;
  VisualMesh& mesh_;
  std::vector<Vec3>& position_;
  const Shaver& shaver_;
  const ShaveOptions& options_;
  const CutOptions& cut_options_;
  CutScratch& scratch_;
  ShavePass& pass_;
  std::vector<Contact> contacts_;
  std::vector<WallPoint> points_;
  std::vector<VF> faces_;
  std::vector<Corner> corners_;
  std::vector<H> fan_;
  std::vector<Shift> shifts_;
};

}  // namespace

void shave(CellComplex& body, std::vector<Vec3>& position, const Shaver& shaver, const ShaveOptions& options,
           const CutOptions& cut_options, CutScratch& scratch, ShavePass& pass) {
  pass = {};
  if (!body.closed) return;
  KERF_ASSERT(position.size() == body.collision.vertex_count());
  ShavingPass(body, position, shaver, options, cut_options, scratch, pass).run();
}

}  // namespace kerf
