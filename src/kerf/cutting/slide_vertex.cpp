#include "kerf/cutting/slide_vertex.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/binding/tolerances.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/orient.h"
#include "kerf/cutting/visual_split.h"
#include "kerf/lattice/prism.h"

namespace kerf::cut {
namespace {

using H = CollisionHalfEdge;
using V = CollisionVertex;
using F = CollisionTriangle;
using VV = VisualVertex;
using VH = VisualHalfEdge;
using VF = VisualTriangle;

/// A collision vertex keeps this distance (part of the mean root edge) from the opposite edges.
constexpr double kLeastHeight = 0.005;
/// Collision triangles keep this part of their planar area in one slide, and this area, part of the mean root edge squared.
constexpr double kKeepsArea = 0.5, kLeastArea = 1e-6;
/// Visual faces keep this area. Below these (part of what it was; of the mean root edge squared) an edge of the face is turned.
constexpr double kLeastVisualArea = 1e-11, kThinVisual = 0.3, kSmallVisual = 1e-7;
constexpr int kMostTurns = 200;
/// Cosines: of the angle by which the skin turns at a sharp edge, and between the two parts of one that a vertex may slide along. It
/// goes this part of the way to the next vertex at most.
constexpr double kCrease = 0.85, kStraightCrease = -0.5, kAlongCrease = 0.9;
/// Cosine: a sharp edge within 45 degrees of the way along the rim goes along with it.
constexpr double kAlongWay = 0.7;
/// Heights of the body's side at the rim: the side is kSquash of them wide in the plane, twice that where it leans.
constexpr double kSideStrip = 2 * kSquash;
constexpr double kInsideOwner = 1e-6;  // of its area: a free vertex stays so far inside its triangle
constexpr int kLongestWalk = 1000;
constexpr double kFarTexture = 2;  ///< largest barycentric coordinate by which a texture goes on beyond a seam

Vec2 turned(Vec2 d, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * d.x - s * d.y, s * d.x + c * d.y};
}
/// The similarity that takes a to a2 and b to b2, at u.
Vec2 carried(Vec2 u, Vec2 a, Vec2 b, Vec2 a2, Vec2 b2) {
  const Vec2 d = b - a, d2 = b2 - a2, w = u - a;
  const double n = dot(d, d);
  if (!(n > 0)) return a2;
  const double re = dot(d, d2) / n, im = cross(d, d2) / n;
  return a2 + Vec2{re * w.x - im * w.y, im * w.x + re * w.y};
}

double corner_angle(const CollisionMesh& mesh, H h) {
  const Vec2 p = mesh.planar[h], a = mesh.planar[CollisionMesh::next(h)] - p,
             b = mesh.planar[CollisionMesh::prev(h)] - p;
  return std::atan2(cross(a, b), dot(a, b));
}

}  // namespace

double fan_angle(const CollisionMesh& mesh, V v) {
  double sum = 0;
  mesh.for_each_outgoing(v, [&](H h) {
    sum += corner_angle(mesh, h);
    return true;
  });
  return sum;
}

SlideTarget point_in_fan(const CollisionMesh& mesh, V v, double angle, double distance) {
  SlideTarget target;
  mesh.for_each_outgoing(v, [&](H h) {
    const double here = corner_angle(mesh, h);
    const Vec2 p = mesh.planar[h], d = mesh.planar[CollisionMesh::next(h)] - p;
    target = {h, p + (distance / norm(d)) * turned(d, std::min(angle, here))};
    angle -= here;
    return angle > 0;
  });
  return target;
}

BorderEdges border_edges(const CollisionMesh& mesh, V v) {
  const H out = mesh.fan_start(v);
  H last = out;
  for (H h = out; h.valid(); h = mesh.ccw(h)) last = h;
  return {out, CollisionMesh::prev(last)};
}

SlideTarget point_on_rim(const CollisionMesh& mesh, V v, double distance) {
  const auto [out, in] = border_edges(mesh, v);
  const H e = distance > 0 ? out : in, corner = distance > 0 ? out : CollisionMesh::next(in);
  if (!is_rim_edge(mesh, e)) return {};
  const Vec2 from = mesh.planar[corner], to = distance > 0 ? mesh.planar[CollisionMesh::next(out)] : mesh.planar[in];
  return {corner, lerp(from, to, std::fabs(distance) / norm(to - from)), distance};
}

void walls_at(const CollisionMesh& mesh, V v, std::vector<WallId>& walls) {
  walls.clear();
  for_each_corner(mesh, v, [&](H h) {
    for (const H e : {h, CollisionMesh::prev(h)})
      if (mesh.is_border(e) && mesh.wall[e].valid()) walls.push_back(mesh.wall[e]);
    return true;
  });
}

/// A point of the skin: the face that holds it, with weights of its corners, and one to read the texture from.
struct VertexSlider::Place {
  VF face, texture_face;
  std::array<double, 3> weight, texture_weight;
};

bool VertexSlider::slide(V v, const SlideTarget& target, const SlideRules& rules, SlideBooks& books) {
  if (!target.corner.valid() || (coarse_.on_rim(v) && target.along_rim == 0) || !chart(v, target) ||
      !collision_faces_stay_sound(rules))
    return false;
  // Sharp edges of the skin stay where they are, unless they are in the way.
  any_crease_ = false;
  keep_creases_ = true;
  if (!collect_shifts(v, target) || !nothing_turns_over(books)) {
    if (!any_crease_) return false;
    keep_creases_ = false;
    if (!collect_shifts(v, target) || !nothing_turns_over(books)) return false;
  }
  // Where walls stray from their smooth shape, they go on doing so.
  walls_at(coarse_, v, walls_);
  strays_.clear();
  for (const WallId w : walls_) {
    wall_points(body_, w, points_);
    for (const WallPoint& p : points_) strays_.emplace_back(p, mesh_.rest[p.vertex] - p.smooth);
  }
  for (const H h : fan_)
    books.prisms.emplace_back(coarse_.root[CollisionMesh::face(h)], -prism_volume(CollisionMesh::face(h)));
  move_collision_vertex(v, target);
  for (const H h : fan_)
    books.prisms.emplace_back(coarse_.root[CollisionMesh::face(h)], prism_volume(CollisionMesh::face(h)));
  write_shifts(books);
  moves_.clear();
  std::size_t next = 0;
  for (const WallId w : walls_) {
    wall_points(body_, w, points_);
    for (const WallPoint& p : points_) {
      KERF_ASSERT(next < strays_.size() && strays_[next].first.vertex == p.vertex);
      const bool again = std::any_of(moves_.begin(), moves_.end(), [&](const Move& m) { return m.vertex == p.vertex; });
      if (!again)
        moves_.push_back({p.vertex, lerp(p.top, p.bottom, strays_[next].first.across) + strays_[next].second});
      ++next;
    }
  }
  apply(moves_, books);
  books.collision_area += area_;
  return true;
}

/// Places of the vertex in all planes around it, before and after: carried over from the target's plane, edge by edge.
bool VertexSlider::chart(V v, const SlideTarget& target) {
  fan_.clear();
  corners_.clear();
  coarse_.for_each_outgoing(v, [&](H h) {
    fan_.push_back(h);
    return true;
  });
  const auto at = std::find(fan_.begin(), fan_.end(), target.corner);
  if (at == fan_.end()) return false;
  const auto start = static_cast<std::size_t>(at - fan_.begin());
  const auto note = [&](H h, Vec2 to) {
    const RootId root = coarse_.root[CollisionMesh::face(h)];
    if (!corner_of(root)) corners_.push_back({root, coarse_.planar[h], to});
    return corner_of(root)->to;
  };
  Vec2 u = note(target.corner, target.to);
  for (std::size_t i = start; i + 1 < fan_.size(); ++i) {  // counter-clockwise, over the edge that ends at the apex
    const H h = fan_[i], n = fan_[i + 1];
    u = note(n, carried(u, coarse_.planar[h], coarse_.planar[CollisionMesh::prev(h)], coarse_.planar[n],
                        coarse_.planar[CollisionMesh::next(n)]));
  }
  u = target.to;
  for (std::size_t i = start; i > 0; --i) {
    const H h = fan_[i], n = fan_[i - 1];
    u = note(n, carried(u, coarse_.planar[h], coarse_.planar[CollisionMesh::next(h)], coarse_.planar[n],
                        coarse_.planar[CollisionMesh::prev(n)]));
  }
  std::sort(fan_.begin(), fan_.end());
  return true;
}

const VertexSlider::Corner* VertexSlider::corner_of(RootId root) const {
  for (const Corner& c : corners_)
    if (c.root == root) return &c;
  return nullptr;
}

bool VertexSlider::collision_faces_stay_sound(const SlideRules& rules) {
  area_ = 0;
  const double unit = body_.mean_root_edge;
  for (const H h : fan_) {
    const Vec2 a = coarse_.planar[CollisionMesh::next(h)], b = coarse_.planar[CollisionMesh::prev(h)];
    const Corner& c = *corner_of(coarse_.root[CollisionMesh::face(h)]);
    const double before = orient(c.from, a, b), after = orient(c.to, a, b);
    if (!(after > 0)) return false;
    if (after < before &&
        !(after > kKeepsArea * before && after > kLeastArea * unit * unit && after > kLeastHeight * unit * norm(b - a)))
      return false;
    if (after < before && after < rules.strip * norm(b - a) && coarse_.on_border(coarse_.to(h)) &&
        coarse_.on_border(coarse_.apex(h)))
      return false;
    area_ += 0.5 * (after - before);
  }
  return !rules.only_less || area_ < 0;
}

/// The rim on both sides of a vertex that lies on it, by length from the vertex.
void VertexSlider::collect_rim(V v) {
  rim_.clear();
  const auto [out, in] = border_edges(coarse_, v);
  const auto length = [&](H e) { return norm(coarse_.planar[CollisionMesh::next(e)] - coarse_.planar[e]); };
  const auto add_inner = [&](H e, double from) {
    const Vec2 a = coarse_.planar[e], d = coarse_.planar[CollisionMesh::next(e)] - a;
    const Patch patch = Patch::of_root(coarse_.root[CollisionMesh::face(e)], Side::kPlus);
    const PoolRun run = coarse_.chain[e][0];
    for (std::int32_t k = 0; k < run.count; ++k) {
      const VV x = body_.chain_pool[run.at(k)];
      rim_.push_back({from + dot(planar_in(mesh_, x, patch) - a, d) / norm(d), x});
    }
  };
  if (is_rim_edge(coarse_, in)) {
    rim_.push_back({-length(in), coarse_.bound[coarse_.from(in)][0]});
    add_inner(in, -length(in));
  }
  rim_.push_back({0, coarse_.bound[v][0]});
  if (is_rim_edge(coarse_, out)) {
    add_inner(out, 0);
    rim_.push_back({length(out), coarse_.bound[coarse_.to(out)][0]});
  }
}

/// Everything that the triangles around v own, with its new place.
bool VertexSlider::collect_shifts(V v, const SlideTarget& target) {
  shifts_.clear();
  shift_of_.reset(mesh_.vertex_count());
  planes_.clear();
  const bool on_rim = coarse_.on_rim(v);
  if (on_rim) collect_rim(v);
  along_rim_ = target.along_rim;
  for (int i = 0; i < side_count(body_); ++i) {
    const auto s = static_cast<std::size_t>(i);
    const Side side = static_cast<Side>(i);
    if (!(i == 1 && on_rim) && !add_shift(coarse_.bound[v][s], 1, on_rim ? Of::kRim : Of::kEnd, 0)) return false;
    for (const H h : fan_) {
      for (const H e : {h, CollisionMesh::prev(h)}) {
        const bool rim = is_rim_edge(coarse_, e);
        if ((coarse_.twin[e].valid() && coarse_.twin[e] < e) || (rim && i == 1)) continue;  // seen twice
        const PoolRun run = coarse_.chain[e][s];
        const Patch patch = Patch::of_root(coarse_.root[CollisionMesh::face(e)], side);
        const Vec2 from = coarse_.planar[e], d = coarse_.planar[CollisionMesh::next(e)] - from;
        for (std::int32_t k = 0; k < run.count; ++k) {
          const VV x = body_.chain_pool[run.at(k)];
          const double t = dot(mirrored(planar_in(mesh_, x, patch), side) - from, d) / dot(d, d);
          if (!add_shift(x, e == h ? 1 - t : t, rim ? Of::kRim : Of::kChain, e == h ? t * norm(d) : (t - 1) * norm(d)))
            return false;
        }
      }
      const PoolRun list = coarse_.free[CollisionMesh::face(h)][s];
      const Vec2 a = coarse_.planar[CollisionMesh::next(h)], b = coarse_.planar[CollisionMesh::prev(h)];
      const double whole = orient(coarse_.planar[h], a, b);
      owner_ = {corner_of(coarse_.root[CollisionMesh::face(h)])->to, a, b};
      const double strip =
          on_rim ? 0 : std::max(side_strip(coarse_.to(h)), side_strip(coarse_.apex(h))) * norm(b - a) / whole;
      for (std::int32_t k = 0; k < list.count; ++k) {
        const VV x = body_.free_pool[list.at(k)];
        if (!mesh_.free[x]) continue;
        const Vec2 u = mirrored(mesh_.planar[mesh_.outgoing[x]], side);
        const double height = std::clamp(orient(u, a, b) / whole, 0.0, 1.0);
        // The edges around move by the whole hat: beside them the side would be left in another triangle.
        const double held = std::max(0.0, (height - strip) / (1 - strip));
        const bool stays_inside = strip == 0 || is_inside_owner(u + held * (owner_[0] - coarse_.planar[h]));
        if (!add_shift(x, stays_inside ? held : height, Of::kInside, 0)) return false;
      }
    }
  }
  return true;
}

/// How far the body's side reaches in from a vertex, in the plane; 0: the vertex is not on the rim. What lies there stays: a side is hardly
/// wider than a line there (binding/squash.h), and stretched like the rest its sharp edges would be cut off.
double VertexSlider::side_strip(V v) const { return coarse_.on_rim(v) ? kSideStrip * norm(coarse_.offset[v]) : 0; }

/// Well inside the collision triangle as it will be?
bool VertexSlider::is_inside_owner(Vec2 u) const {
  const double least = kInsideOwner * orient(owner_[0], owner_[1], owner_[2]);
  for (std::size_t i = 0; i < 3; ++i)
    if (!(orient(u, owner_[i], owner_[(i + 1) % 3]) > least)) return false;
  return true;
}

/// Does the skin bend sharply at an edge?
bool VertexSlider::is_crease(VH h) const {
  const VH t = mesh_.twin[h];
  if (!t.valid()) return false;
  const VF f = VisualMesh::face(h), g = VisualMesh::face(t);
  if (mesh_.patch[f].is_wall() || mesh_.patch[g].is_wall()) return false;
  const Vec3 a = mesh_.rest[mesh_.origin[h]], along = mesh_.rest[mesh_.origin[t]] - a;
  const Vec3 n = cross(along, mesh_.rest[mesh_.apex(h)] - a), m = cross(mesh_.rest[mesh_.apex(t)] - a, along);
  const double d = dot(n, m);
  return !(d > 0) || d * d < kCrease * kCrease * dot(n, n) * dot(m, m);
}

/// A free vertex on a sharp edge of the skin goes along it, as far as its place in the plane leads that way: elsewhere the skin
/// between it and its neighbours would cut the edge off. False where it is on none.
bool VertexSlider::shift_along_crease(VV x, Shift& shift) {
  if (shift.planes != 1) return false;
  ShiftPlane& plane = planes_[shift.first];
  VH edge[2];
  int n = 0;
  for_each_corner(mesh_, x, [&](VH h) {
    if (is_crease(h)) {
      if (n < 2) edge[n] = h;
      ++n;
    }
    return n <= 2;
  });
  if (n != 2) return false;
  const Vec3 here = mesh_.rest[x], one = mesh_.rest[mesh_.to(edge[0])] - here,
             other = mesh_.rest[mesh_.to(edge[1])] - here;
  if (!(dot(one, other) < kStraightCrease * norm(one) * norm(other))) return false;
  const Vec2 from = mesh_.planar[edge[0]];
  double best = 0;
  int which = 0;
  for (int i = 0; i < 2; ++i) {
    const Vec2 d = mesh_.planar[VisualMesh::next(edge[i])] - from;
    if (const double along = dot(plane.planar - from, d) / dot(d, d); along > best) best = along, which = i;
  }
  best = std::min(best, kAlongCrease);
  const VH e = edge[which], to = VisualMesh::next(e);
  const Vec2 planar = lerp(from, mesh_.planar[to], best), own = mirrored(planar, plane.patch.side());
  if (!is_inside_owner(own)) return false;
  any_crease_ = true;
  plane.planar = planar;
  plane.texture = lerp(mesh_.texture[e], mesh_.texture[to], best);
  const Vec3 normal = (1 - best) * to_double(mesh_.normal[x]) + best * to_double(mesh_.normal[mesh_.origin[to]]);
  shift.rest = lerp(here, mesh_.rest[mesh_.origin[to]], best);
  shift.normal = norm(normal) > 1e-6 ? to_float(normalized(normal)) : mesh_.normal[x];
  return true;
}

/// The next vertex on the sharp edge of the skin that x lies on, on the side that `way` points to; none where x is on no edge that goes on there.
VV VertexSlider::next_on_crease(VV x, Vec3 way) const {
  VV next;
  int n = 0;
  double best = 0;
  for_each_corner(mesh_, x, [&](VH h) {
    if (!is_crease(h)) return true;
    const Vec3 edge = mesh_.rest[mesh_.to(h)] - mesh_.rest[x];
    if (const double along = dot(edge, way) / norm(edge); along > best) best = along, next = mesh_.to(h);
    return ++n <= 2;
  });
  return n == 2 && best > kAlongWay * norm(way) ? next : VV{};
}

/// A visual vertex that moves by `hat` times the way of the collision vertex, in all root planes that it has; on the rim
/// along the rim, where it lies at `s`.
bool VertexSlider::add_shift(VV x, double hat, Of owner, double s) {
  if (!x.valid() || !(hat > 0)) return true;
  if (shift_of_.insert(x.value) != static_cast<std::int32_t>(shifts_.size())) return false;  // seen twice
  Shift shift;
  shift.vertex = x;
  shift.first = planes_.size();
  bool found = false, ok = true;
  for_each_corner(mesh_, x, [&](VH h) {
    const Patch patch = mesh_.patch[VisualMesh::face(h)];
    if (patch.is_wall()) return true;
    for (std::size_t k = shift.first; k < planes_.size(); ++k)
      if (planes_[k].patch == patch) {
        planes_[k].seam = planes_[k].seam || !(planes_[k].texture == mesh_.texture[h]);
        return true;
      }
    const Corner* corner = corner_of(patch.root());
    if (!corner) return ok = false;
    // The bound vertex keeps the bits of the collision vertex.
    const Vec2 to = mirrored(corner->to, patch.side());
    planes_.push_back({patch, hat == 1 ? to : mesh_.planar[h] + hat * (to - mirrored(corner->from, patch.side())),
                       mesh_.texture[h], false});
    return true;
  });
  shift.planes = static_cast<int>(planes_.size() - shift.first);
  if (!ok) return false;
  const auto set_rest = [&](Vec3 rest, Vec3 normal) {
    shift.rest = rest;
    shift.normal = norm(normal) > 1e-6 ? to_float(normalized(normal)) : mesh_.normal[x];
    found = true;
  };
  if (keep_creases_ && owner == Of::kInside && along_rim_ == 0 && shift_along_crease(x, shift)) {
    shifts_.push_back(shift);
    return true;
  }
  if (owner == Of::kRim) {
    const double to = s + hat * along_rim_;
    const auto it = std::upper_bound(rim_.begin(), rim_.end(), to, [](double a, const RimPoint& p) { return a < p.s; });
    const auto next = std::clamp<std::ptrdiff_t>(it - rim_.begin(), 1, static_cast<std::ptrdiff_t>(rim_.size()) - 1);
    const RimPoint &a = rim_[static_cast<std::size_t>(next) - 1], &b = rim_[static_cast<std::size_t>(next)];
    const double w = std::clamp((to - a.s) / (b.s - a.s), 0.0, 1.0);
    set_rest(lerp(mesh_.rest[a.vertex], mesh_.rest[b.vertex], w),
             (1 - w) * to_double(mesh_.normal[a.vertex]) + w * to_double(mesh_.normal[b.vertex]));
    const VH e = mesh_.find_half_edge(a.vertex, b.vertex), t = e.valid() ? mesh_.twin[e] : VH{};
    if (!e.valid() || !t.valid()) return false;
    for (std::size_t k = shift.first; k < planes_.size(); ++k)
      planes_[k].texture = planes_[k].patch.side() == Side::kPlus
                               ? lerp(mesh_.texture[e], mesh_.texture[VisualMesh::next(e)], w)
                               : lerp(mesh_.texture[VisualMesh::next(t)], mesh_.texture[t], w);
    shifts_.push_back(shift);
    return true;
  }
  if (keep_creases_ && along_rim_ != 0 && owner != Of::kEnd) {
    // Beside a rim vertex that slides, sharp edges of the skin run along the rim: what is on one stays on it.
    const Vec3 whole_way = shifts_.front().rest - mesh_.rest[shifts_.front().vertex], here = mesh_.rest[x];
    if (const VV next = next_on_crease(x, whole_way); next.valid()) {
      any_crease_ = true;
      const double t = std::min(kAlongCrease, hat * norm(whole_way) / norm(mesh_.rest[next] - here));
      set_rest(lerp(here, mesh_.rest[next], t),
               (1 - t) * to_double(mesh_.normal[x]) + t * to_double(mesh_.normal[next]));
    }
  }
  for (std::size_t k = shift.first; k < planes_.size(); ++k) {
    VH corner;
    for_each_corner(mesh_, x, [&](VH h) {
      corner = h;
      return !(mesh_.patch[VisualMesh::face(h)] == planes_[k].patch);
    });
    const Place place = find_place(corner, planes_[k].planar);
    Vec2f texture{};
    Vec3 rest, normal;
    for (int i = 0; i < 3; ++i) {
      const VH e = VisualMesh::corner(place.face, i), te = VisualMesh::corner(place.texture_face, i);
      const double w = place.weight[static_cast<std::size_t>(i)],
                   tw = place.texture_weight[static_cast<std::size_t>(i)];
      rest += w * mesh_.rest[mesh_.origin[e]];
      normal += w * to_double(mesh_.normal[mesh_.origin[e]]);
      texture.x += static_cast<float>(tw) * mesh_.texture[te].x;
      texture.y += static_cast<float>(tw) * mesh_.texture[te].y;
    }
    planes_[k].texture = texture;
    if (!found) set_rest(rest, normal);
  }
  if (!found) return false;
  shifts_.push_back(shift);
  return true;
}

/// The face of the skin that holds u, by a walk from h, whose patch u belongs to; over edges of roots their planes are unfolded. Where
/// the skin ends, the nearest point of its last face.
VertexSlider::Place VertexSlider::find_place(VH h, Vec2 u) const {
  VF f = VisualMesh::face(h);
  const Patch start = mesh_.patch[f];
  // The face around the vertex that looks towards u, to begin with.
  for_each_corner(mesh_, mesh_.from(h), [&](VH e) {
    if (!(mesh_.patch[VisualMesh::face(e)] == start)) return true;
    const Vec2 c = mesh_.planar[e], a = mesh_.planar[VisualMesh::next(e)], b = mesh_.planar[VisualMesh::prev(e)];
    if (orient(c, a, u) < 0 || orient(c, b, u) > 0) return true;
    f = VisualMesh::face(e);
    return false;
  });
  const auto weights = [&](VF face, Vec2 at, bool inside) {
    const VH e = VisualMesh::corner(face, 0);
    const Vec2 p[3] = {mesh_.planar[e], mesh_.planar[VisualMesh::next(e)], mesh_.planar[VisualMesh::prev(e)]};
    std::array<double, 3> w{};
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      w[i] = orient(at, p[(i + 1) % 3], p[(i + 2) % 3]);
      if (inside) w[i] = std::max(0.0, w[i]);
      sum += w[i];
    }
    if (!(sum > 0)) return std::array<double, 3>{1, 0, 0};
    for (double& x : w) x /= sum;
    return w;
  };
  Place place;
  bool seam = false;
  for (int step = 0; step < kLongestWalk; ++step) {
    const Patch patch = mesh_.patch[f];
    VH worst;
    double most = 0;
    for (int i = 0; i < 3; ++i) {
      const VH e = VisualMesh::corner(f, i), t = mesh_.twin[e];
      const double out = orient(mesh_.planar[e], mesh_.planar[VisualMesh::next(e)], u);
      if (!(out < most) || !t.valid()) continue;
      const Patch beyond = mesh_.patch[VisualMesh::face(t)];
      if (!(beyond == patch) && (beyond.is_wall() || beyond.side() != patch.side())) continue;
      most = out;
      worst = e;
    }
    if (!worst.valid()) break;
    const VH t = mesh_.twin[worst], wn = VisualMesh::next(worst), tn = VisualMesh::next(t);
    if (!seam && !(mesh_.texture[worst] == mesh_.texture[tn] && mesh_.texture[wn] == mesh_.texture[t])) {
      seam = true;  // the texture goes on as it was before
      place.texture_face = f;
      place.texture_weight = weights(f, u, false);
      // A sliver says nothing about what lies far beside it; passes on passes would carry the texture away without end.
      if (std::any_of(place.texture_weight.begin(), place.texture_weight.end(),
                      [](double w) { return std::fabs(w) > kFarTexture; }))
        place.texture_weight = weights(f, u, true);
    }
    f = VisualMesh::face(t);
    if (!(mesh_.patch[f] == patch))
      u = carried(u, mesh_.planar[worst], mesh_.planar[wn], mesh_.planar[tn], mesh_.planar[t]);
  }
  place.face = f;
  place.weight = weights(f, u, true);
  if (!seam) {
    place.texture_face = f;
    place.texture_weight = place.weight;
  }
  return place;
}

Vec2 VertexSlider::planar_after(VH h) const {
  if (const std::int32_t i = shift_of_.find(mesh_.origin[h].value); i >= 0) {
    const Shift& s = shifts_[static_cast<std::size_t>(i)];
    const Patch patch = mesh_.patch[VisualMesh::face(h)];
    for (int k = 0; k < s.planes; ++k)
      if (const ShiftPlane& p = planes_[s.first + static_cast<std::size_t>(k)]; p.patch == patch) return p.planar;
  }
  return mesh_.planar[h];
}

/// Adds the faces around v to faces_ that are not among them.
void VertexSlider::faces_around(VV v, bool walls_too) {
  for_each_corner(mesh_, v, [&](VH h) {
    const VF f = VisualMesh::face(h);
    if ((walls_too || !mesh_.patch[f].is_wall()) &&
        face_seen_.insert(f.value) == static_cast<std::int32_t>(faces_.size()))
      faces_.push_back(f);
    return true;
  });
}

/// Visual faces that would turn over or nearly vanish have their longest edge turned, where that helps.
bool VertexSlider::nothing_turns_over(SlideBooks& books) {
  const double unit = body_.mean_root_edge * body_.mean_root_edge;
  faces_.clear();
  face_seen_.reset(mesh_.face_count());
  for (const Shift& s : shifts_) faces_around(s.vertex, false);
  std::vector<VF>& todo = todo_;
  todo.assign(faces_.rbegin(), faces_.rend());
  int turns = kMostTurns;
  while (!todo.empty()) {
    const VF f = todo.back();
    todo.pop_back();
    const VH h = VisualMesh::corner(f, 0), n = VisualMesh::next(h), p = VisualMesh::prev(h);
    const double before = orient(mesh_.planar[h], mesh_.planar[n], mesh_.planar[p]);
    const double after = orient(planar_after(h), planar_after(n), planar_after(p));
    if (after > kThinVisual * before && after > kSmallVisual * unit) continue;
    if (turns > 0 && after < before)
      if (const VH e = turn_longest_edge(f, books); e.valid()) {
        --turns;
        todo.push_back(f);
        todo.push_back(VisualMesh::face(mesh_.twin[VisualMesh::next(e)]));
        continue;
      }
    if (!(after > 0) || (!(after > kLeastVisualArea * unit) && after < before)) return false;
  }
  return true;
}

/// Turns the edge of f that will be longest, if what is left and right of it is of one patch and both faces are better for it
/// afterwards, and valid now. The half-edge that was turned, or none. Books what that does to the surface.
VH VertexSlider::turn_longest_edge(VF f, SlideBooks& books) {
  VH h;
  double longest = 0;
  for (int i = 0; i < 3; ++i) {
    const VH e = VisualMesh::corner(f, i);
    const Vec2 d = planar_after(VisualMesh::next(e)) - planar_after(e);
    if (dot(d, d) > longest) longest = dot(d, d), h = e;
  }
  if (!h.valid()) return {};
  const VH g = mesh_.twin[h];
  if (!g.valid() || mesh_.barrier[h] || mesh_.barrier[g] || !(mesh_.patch[f] == mesh_.patch[VisualMesh::face(g)]))
    return {};
  if (keep_creases_ && is_crease(h)) {
    any_crease_ = true;
    return {};
  }
  const VH hn = VisualMesh::next(h), hp = VisualMesh::prev(h), gn = VisualMesh::next(g), gp = VisualMesh::prev(g);
  if (!(mesh_.texture[h] == mesh_.texture[gn] && mesh_.texture[hn] == mesh_.texture[g])) return {};
  const Vec2 a = mesh_.planar[h], b = mesh_.planar[hn], c = mesh_.planar[hp], d = mesh_.planar[gp];
  if (!(orient(a, d, c) > 0) || !(orient(b, c, d) > 0)) return {};
  const Vec2 a1 = planar_after(h), b1 = planar_after(hn), c1 = planar_after(hp), d1 = planar_after(gp);
  if (!(std::min(orient(a1, d1, c1), orient(b1, c1, d1)) > std::min(orient(a1, b1, c1), orient(b1, a1, d1)))) return {};
  const VV vc = mesh_.origin[hp], vd = mesh_.origin[gp];
  if (mesh_.find_half_edge(vc, vd).valid() || mesh_.find_half_edge(vd, vc).valid()) return {};
  faces_ = {f, VisualMesh::face(g)};
  const Vec3 origin = mesh_.rest[vc];
  book_faces(origin, -1, books);
  flip_visual_edge(mesh_, h);
  ++books.turned;
  book_faces(origin, 1, books);
  return h;
}

void VertexSlider::move_collision_vertex(V v, const SlideTarget& target) {
  // Affine in the triangle that holds the new place.
  const H h = target.corner, next = CollisionMesh::next(h), prev = CollisionMesh::prev(h);
  const Vec2 u = target.to, p = coarse_.planar[h], a = coarse_.planar[next], b = coarse_.planar[prev];
  const double whole = orient(p, a, b), wa = cross(u - p, b - p) / whole, wb = cross(a - p, u - p) / whole;
  const auto mix = [&](const auto& array) {
    const Vec3 x = array[v];
    return x + wa * (array[coarse_.from(next)] - x) + wb * (array[coarse_.from(prev)] - x);
  };
  const Vec3 rest = mix(coarse_.rest), offset = mix(coarse_.offset);
  coarse_.rest.set(v, rest);
  coarse_.offset.set(v, offset);
  for (const H e : fan_) coarse_.planar.set(e, corner_of(coarse_.root[CollisionMesh::face(e)])->to);
}

void VertexSlider::write_shifts(SlideBooks& books) {
  moves_.clear();
  for (const Shift& s : shifts_) moves_.push_back({s.vertex, s.rest});
  apply(moves_, books);
  for (const Shift& s : shifts_) {
    mesh_.normal.set(s.vertex, s.normal);
    for_each_corner(mesh_, s.vertex, [&](VH h) {
      for (int k = 0; k < s.planes; ++k)
        if (const ShiftPlane& p = planes_[s.first + static_cast<std::size_t>(k)];
            mesh_.patch[VisualMesh::face(h)] == p.patch) {
          mesh_.planar.set(h, p.planar);
          if (!p.seam) mesh_.texture.set(h, p.texture);
        }
      return true;
    });
  }
}

void VertexSlider::book_faces(Vec3 origin, double sign, SlideBooks& books) const {
  for (const VF f : faces_) {
    Vec3 p[3];
    for (int i = 0; i < 3; ++i) p[i] = mesh_.rest[mesh_.origin[VisualMesh::corner(f, i)]] - origin;
    const Vec3 n = cross(p[1] - p[0], p[2] - p[0]);
    books.removed -= sign * dot(p[0], n) / 6;
    if (!mesh_.patch[f].is_wall()) books.skin_area += sign * 0.5 * norm(n);
  }
}

void VertexSlider::apply(const std::vector<Move>& moves, SlideBooks& books) {
  faces_.clear();
  face_seen_.reset(mesh_.face_count());
  for (const Move& m : moves) faces_around(m.vertex, true);
  if (faces_.empty()) return;
  const Vec3 origin = mesh_.rest[mesh_.origin[VisualMesh::corner(faces_[0], 0)]];
  book_faces(origin, -1, books);
  for (const Move& m : moves) {
    mesh_.rest.set(m.vertex, m.rest);
    if (books.moved.insert(m.vertex.value) == static_cast<std::int32_t>(books.vertices.size()))
      books.vertices.push_back(m.vertex);
  }
  book_faces(origin, 1, books);
}

/// As the hexahedra see it (lattice/prism.h), in metres.
double VertexSlider::prism_volume(F f) const {
  PrismCorners c[3];
  for (int i = 0; i < 3; ++i) {
    const V v = coarse_.origin[CollisionMesh::corner(f, i)];
    c[i] = {coarse_.rest[v] - coarse_.offset[v], coarse_.rest[v] + coarse_.offset[v], first_ancestor(coarse_, v)};
  }
  return ruled_volume(prism_between(c[0], c[1], c[2]));
}

}  // namespace kerf::cut
