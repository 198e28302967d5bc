#include "kerf/binding/path_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kerf/base/at.h"
#include "kerf/base/indexed.h"
#include "kerf/base/parallel.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/binding/margins.h"
#include "kerf/binding/tolerances.h"
#include "kerf/geodesic/path_scratch.h"

namespace kerf {
namespace {

using CV = CollisionVertex;
using CH = CollisionHalfEdge;

/// The order in which paths end around every bound vertex, counter-clockwise seen from outside. A hub is a bound visual
/// vertex: two for an inner collision vertex, one for a border vertex. With d collision edges, the hub of the + side has
/// slots 0 .. d-1 in the collision mesh's order (border: first the edge to the next border vertex, last the one from the
/// previous), the - side has them reversed. On the rim of a closed body both follow one another: 2 d - 2 slots.
class PathOrder {
 public:
  PathOrder(const CollisionMesh& c, bool closed) : collision_(c), position_(c.half_edge_count()) {
    const std::size_t nv = c.vertex_count();
    degree_.resize(nv);
    border_.resize(nv);
    first_.resize(2 * nv + 1);
    std::int32_t total = 0;
    for (const CV v : ids<CV>(nv)) {
      std::int32_t d = 0;
      c.for_each_outgoing(v, [&](CH h) {
        position_[h.index()] = d++;
        return true;
      });
      border_[v.index()] = c.on_border(v);
      if (border_[v.index()]) ++d;
      degree_[v.index()] = d;
      first_[2 * v.index()] = total;
      total += border_[v.index()] ? (closed ? 2 * d - 2 : d) : d;
      first_[2 * v.index() + 1] = total;
      if (!border_[v.index()] && closed) total += d;
    }
    first_.back() = total;
    neighbour_.assign(at(total), -1);
    closed_ = closed;
  }

  struct Slot {
    std::int32_t begin = 0, end = 0;  ///< of the hub
    std::int32_t index = 0;           ///< absolute
    bool circular = true;
  };
  /// Where the path of half-edge h leaves its origin, or (reverse) where it arrives at its end.
  [[nodiscard]] Slot slot(CH h, int side, bool at_end) const {
    const CH twin = collision_.twin[h];
    const CV v = at_end ? collision_.to(h) : collision_.from(h);
    const std::int32_t d = degree_[v.index()];
    const std::int32_t k = !at_end ? position_[h.index()] : twin.valid() ? position_[twin.index()] : d - 1;
    const bool border = border_[v.index()];
    const std::size_t hub = 2 * v.index() + (!border && side == 1 ? 1 : 0);
    Slot s;
    s.begin = first_[hub];
    s.end = first_[hub + 1];
    s.circular = !border || closed_;
    std::int32_t i = k;
    if (side == 1) i = !border ? d - 1 - k : k == 0 || k == d - 1 ? k : 2 * d - 2 - k;
    s.index = s.begin + i;
    return s;
  }
  void set(const Slot& s, std::int32_t neighbour) { neighbour_[at(s.index)] = neighbour; }

  /// The faces around x between the neighbours of the slot that are already there.
  [[nodiscard]] Sector sector(const WalledSurface& w, std::int32_t x, const Slot& s) const {
    const std::int32_t clockwise = inserted(s, -1), counter = inserted(s, +1);
    if (clockwise < 0 && counter < 0) return {};
    Sector result;
    result.first = clockwise >= 0 ? find_half_edge(w, x, clockwise) : fan_start(w, x);
    const std::int32_t end = counter >= 0 ? find_half_edge(w, x, counter) : -1;
    if (end >= 0) {
      result.last = cw(w, end);
    } else {  // up to the border
      result.last = result.first;
      for (std::int32_t h = ccw(w, result.last); h >= 0; h = ccw(w, h)) result.last = h;
    }
    return result;
  }

 private:
  [[nodiscard]] std::int32_t inserted(const Slot& s, std::int32_t step) const {
    const std::int32_t n = s.end - s.begin;
    for (std::int32_t k = 1; k <= n; ++k) {
      std::int32_t i = s.index + step * k;
      if (i < s.begin || i >= s.end) {
        if (!s.circular) return -1;
        i += i < s.begin ? n : -n;
      }
      if (neighbour_[at(i)] >= 0) return neighbour_[at(i)];
    }
    return -1;
  }
  const CollisionMesh& collision_;
  std::vector<std::int32_t> position_, degree_, first_;
  std::vector<std::uint8_t> border_;
  std::vector<std::int32_t> neighbour_;  ///< per slot: the visual vertex that the inserted path goes to, or -1
  bool closed_ = false;
};

/// One stop of a path, by vertices, which stay valid while the path is inserted.
struct PlannedStop {
  std::int32_t a = -1, b = -1;  ///< b = -1: vertex a; else a point of edge a-b
  double t = 0;
};

bool touches(const PlannedStop& s, std::int32_t v) { return s.a == v || s.b == v; }

/// Moves crossings to free vertices nearby and away from walls (Margins).
void plan_stops(WalledSurface& w, const SurfacePath& path, double mean_edge, std::vector<PlannedStop>& plan) {
  plan.clear();
  std::int32_t snapped = -1;  // the vertex that the last stop was moved to
  for (const PathStop& stop : path.stops) {
    if (stop.vertex >= 0) {
      if (snapped != stop.vertex) plan.push_back({stop.vertex, -1, 0});
      w.wall_vertex[at(stop.vertex)] = 1;
      snapped = -1;
      continue;
    }
    PlannedStop p{w.from(stop.half_edge), w.to(stop.half_edge), stop.t};
    if (snapped >= 0 && touches(p, snapped)) continue;
    const std::int32_t near = p.t < 0.5 ? p.a : p.b;
    const Margins margins = Margins::of(norm(w.at(p.b) - w.at(p.a)), mean_edge);
    if (std::min(p.t, 1 - p.t) < margins.snap && !w.wall_vertex[at(near)]) {
      while (plan.back().b >= 0 && touches(plan.back(), near)) plan.pop_back();
      plan.push_back({near, -1, 0});
      w.wall_vertex[at(near)] = 1;
      snapped = near;
      continue;
    }
    snapped = -1;
    p.t = std::clamp(p.t, w.wall_vertex[at(p.a)] ? margins.wall : margins.snap,
                     1 - (w.wall_vertex[at(p.b)] ? margins.wall : margins.snap));
    plan.push_back(p);
  }
}

/// Splits the crossed edges in turn; the path's own edges appear by themselves and become walls. Appends the inner vertices.
/// Fails only on stops that are no path.
bool insert_stops(SplitSurface& s, const std::vector<PlannedStop>& plan, std::vector<std::int32_t>& inner) {
  WalledSurface& w = s.walled;
  std::int32_t current = plan.front().a;
  for (std::size_t i = 1; i < plan.size(); ++i) {
    const PlannedStop& p = plan[i];
    std::int32_t reached = p.a;
    if (p.b >= 0) {
      std::int32_t edge = -1;
      if (touches(p, current)) {  // beside a wall that joins both ends: through a point of an edge at this end
        edge = find_half_edge(w, current, p.a == current ? p.b : p.a);
      } else {
        const std::int32_t start = fan_start(w, current);
        std::int32_t h = start;
        do {
          const std::int32_t e = WalledSurface::next(h);
          if ((w.from(e) == p.a && w.to(e) == p.b) || (w.from(e) == p.b && w.to(e) == p.a)) edge = e;
          h = ccw(w, h);
        } while (edge < 0 && h >= 0 && h != start);
      }
      if (edge < 0 || w.wall[at(edge)] || w.opposite(edge) < 0) return false;
      reached = split_edge(s, edge, w.from(edge) == p.a ? p.t : 1 - p.t);
    }
    std::int32_t h = find_half_edge(w, current, reached);
    if (h < 0 || w.wall[at(h)]) return false;
    mark_wall(w, h);
    if (i + 1 < plan.size()) inner.push_back(reached);
    current = reached;
  }
  return true;
}

/// Is face f among the faces of the sector of v?
bool in_sector(const WalledSurface& w, std::int32_t v, Sector sector, std::int32_t f) {
  const std::int32_t start = sector.first >= 0 ? sector.first : fan_start(w, v);
  std::int32_t h = start;
  do {
    if (h / 3 == f) return true;
    if (h == sector.last) return false;
    h = ccw(w, h);
  } while (h >= 0 && h != start);
  return false;
}

/// The section of the surface with the plane through s and t with this normal, from s towards t. On the rim of a closed body
/// with the mid-surface's normal this is the rim itself. Empty if it meets a wall or does not arrive.
SurfacePath trace_section(const WalledSurface& w, std::int32_t s, std::int32_t t, Vec3 normal, Sector at_s,
                          Sector at_t) {
  const Vec3 origin = w.at(s), chord = w.at(t) - origin;
  const auto height = [&](std::int32_t v) { return dot(w.at(v) - origin, normal); };
  const double limit = 3 * norm(chord);

  // Out of s through the opposite edge that the plane crosses towards t.
  std::int32_t crossing = -1;
  double best = 0;
  const std::int32_t start = fan_start(w, s);
  std::int32_t h = start;
  do {
    const std::int32_t e = WalledSurface::next(h);
    const double ha = height(w.from(e)), hb = height(w.to(e));
    if ((ha >= 0) != (hb >= 0) && in_sector(w, s, at_s, h / 3)) {
      const Vec3 p = lerp(w.at(w.from(e)), w.at(w.to(e)), ha / (ha - hb));
      const double ahead = dot(p - origin, chord) / norm(p - origin);
      if (ahead > best) {
        best = ahead;
        crossing = e;
      }
    }
    h = ccw(w, h);
  } while (h >= 0 && h != start);

  SurfacePath path;
  path.stops.push_back({s, -1, 0});
  Vec3 last = origin;
  while (crossing >= 0 && path.length < limit) {
    const std::int32_t twin = w.opposite(crossing);
    if (twin < 0 || w.wall[at(crossing)]) break;
    const double ha = height(w.from(crossing)), hb = height(w.to(crossing));
    const double u = ha / (ha - hb);
    const Vec3 p = lerp(w.at(w.from(crossing)), w.at(w.to(crossing)), u);
    path.length += norm(p - last);
    last = p;
    path.stops.push_back({-1, crossing, u});
    const std::int32_t apex = w.apex(twin);
    if (apex == t) {
      if (!in_sector(w, t, at_t, twin / 3)) break;
      path.stops.push_back({t, -1, 0});
      path.length += norm(w.at(t) - last);
      return path;
    }
    const bool apex_above = height(apex) >= 0;
    crossing = apex_above == (height(w.from(twin)) >= 0) ? WalledSurface::next(twin) : WalledSurface::prev(twin);
  }
  return {};
}

double greatest_height(const WalledSurface& w, const SurfacePath& path, Vec3 origin, Vec3 normal) {
  double highest = 0;
  for (const PathStop& stop : path.stops) {
    const Vec3 p =
        stop.vertex >= 0 ? w.at(stop.vertex) : lerp(w.at(w.from(stop.half_edge)), w.at(w.to(stop.half_edge)), stop.t);
    highest = std::max(highest, std::fabs(dot(p - origin, normal)));
  }
  return highest;
}

/// Union-find.
class Pieces {
 public:
  explicit Pieces(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::size_t find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  bool join(std::size_t i, std::size_t j) {
    i = find(i);
    j = find(j);
    if (i == j) return false;
    parent_[std::max(i, j)] = std::min(i, j);
    return true;
  }

 private:
  std::vector<std::size_t> parent_;
};

class PathInserter {
 public:
  PathInserter(SplitSurface& s, const CollisionMesh& c, const BoundVertices& vertices, bool closed,
               const PathNetworkOptions& options)
      : surface_(s), collision_(c), vertices_(vertices), closed_(closed), mean_edge_(mean_edge(c)), options_(options),
        order_(c, closed) {
    network_.chain.assign(c.half_edge_count(), {PoolRun{}, PoolRun{}});
  }

  Result<PathNetwork> run() {
    const CollisionMesh& c = collision_;
    if (!closed_) {
      is_bound_.assign(surface_.walled.position.size(), 0);
      for (const auto& b : vertices_.bound) is_bound_[at(b[0])] = 1;
    }
    Pieces pieces(c.vertex_count());
    std::vector<CH> inner;
    for (const CH h : ids<CH>(c.half_edge_count())) {
      const CH t = c.twin[h];
      if (t.valid()) {
        if (h < t) inner.push_back(h);
        continue;
      }
      KERF_TRY(closed_ ? insert_rim(h) : walk_border(h));
      pieces.join(c.from(h).index(), c.to(h).index());
    }
    if (options_.after_rim) options_.after_rim();

    // A spanning tree of short edges, links between two borders first; then the others, short ones first.
    std::vector<double> length(c.half_edge_count());
    for (const CH h : inner) length[h.index()] = norm(c.rest[c.to(h)] - c.rest[c.from(h)]);
    std::vector<std::uint8_t> rank(c.half_edge_count(), 1);
    for (const CH h : inner)
      if (c.on_border(c.from(h)) && c.on_border(c.to(h)) &&
          pieces.find(c.from(h).index()) != pieces.find(c.to(h).index()))
        rank[h.index()] = 0;
    std::stable_sort(inner.begin(), inner.end(), [&](CH a, CH b) {
      return rank[a.index()] != rank[b.index()] ? rank[a.index()] < rank[b.index()]
                                                : length[a.index()] < length[b.index()];
    });
    std::vector<CH> tree, others;
    for (const CH h : inner) (pieces.join(c.from(h).index(), c.to(h).index()) ? tree : others).push_back(h);
    std::stable_sort(others.begin(), others.end(), [&](CH a, CH b) { return length[a.index()] < length[b.index()]; });
    std::size_t done = 0;
    for (const auto* list : {&tree, &others})
      for (const CH h : *list) {
        KERF_TRY(closed_ ? insert_both(h) : insert(h, 0));
        if (++done % 64 == 0)
          KERF_TRY(options_.progress("paths", static_cast<double>(done) / static_cast<double>(inner.size())));
      }
    return std::move(network_);
  }

 private:
  [[nodiscard]] std::int32_t bound(CV v, int side) const { return vertices_.bound[v.index()][at(side)]; }

  void store(CH h, int side, std::int32_t first) {
    const PoolRun run{first, static_cast<std::int32_t>(network_.pool.size()) - first, false};
    const CH t = collision_.twin[h];
    network_.chain[h.index()][at(side)] = run;
    if (t.valid()) network_.chain[t.index()][at(side)] = run.flipped();
    else if (closed_) network_.chain[h.index()] = {run, run};
    const std::int32_t s = bound(collision_.from(h), side), e = bound(collision_.to(h), side);
    order_.set(order_.slot(h, side, false), run.count > 0 ? network_.pool[at(first)] : e);
    order_.set(order_.slot(h, side, true), run.count > 0 ? network_.pool.back() : s);
    ++network_.paths;
  }

  Error edge_error(CH h, int side, const std::string& reason) const {
    if (options_.at_fault != nullptr) *options_.at_fault = {collision_.from(h), collision_.to(h)};
    return failed(fmt::format("collision edge {}-{} ({} side): {}", collision_.from(h).value + 1,
                              collision_.to(h).value + 1, side == 0 ? "+" : "-", reason));
  }

  /// On an open sheet the border itself is the path; a chord would leave a slice that belongs to no patch.
  Status walk_border(CH h) {
    WalledSurface& w = surface_.walled;
    const auto first = static_cast<std::int32_t>(network_.pool.size());
    const std::int32_t goal = bound(collision_.to(h), 0);
    std::int32_t v = bound(collision_.from(h), 0);
    for (;;) {
      const std::int32_t e = fan_start(w, v), next = w.to(e);
      if (w.wall[at(e)] || w.opposite(e) >= 0 || (next != goal && is_bound_[at(next)]))
        return edge_error(h, 0, "its ends do not follow one another on the border of the visual mesh");
      mark_wall(w, e);
      if (next == goal) break;
      network_.pool.push_back(next);
      v = next;
    }
    store(h, 0, first);
    return {};
  }

  Status insert_path(CH h, int side, const SurfacePath& path) {
    const double edge = norm(collision_.rest[collision_.to(h)] - collision_.rest[collision_.from(h)]);
    const double ends =
        norm(surface_.walled.at(bound(collision_.to(h), side)) - surface_.walled.at(bound(collision_.from(h), side)));
    if (path.length > kWinding * std::max(edge, ends))
      return edge_error(
          h, side,
          fmt::format(
              "its path winds around earlier ones, {:.0f} times as long as the edge; the collision mesh is folded "
              "there, or fits the body badly",
              path.length / std::max(edge, ends)));
    const auto first = static_cast<std::int32_t>(network_.pool.size());
    plan_stops(surface_.walled, path, mean_edge_, plan_);
    if (!insert_stops(surface_, plan_, network_.pool))
      return edge_error(h, side, "its path runs over itself; is the visual mesh badly folded there?");
    store(h, side, first);
    return {};
  }

  struct Ends {
    Sector at_s, at_t;
  };
  [[nodiscard]] Ends ends_of(CH h, int side) const {
    const WalledSurface& w = surface_.walled;
    return {order_.sector(w, bound(collision_.from(h), side), order_.slot(h, side, false)),
            order_.sector(w, bound(collision_.to(h), side), order_.slot(h, side, true))};
  }
  Result<SurfacePath> find(CH h, int side, const Ends& ends, PathScratch& scratch) const {
    return find_path(surface_.walled, bound(collision_.from(h), side), bound(collision_.to(h), side), ends.at_s,
                     ends.at_t, {options_.exact}, scratch);
  }

  /// Both sides of a closed body: the two paths are looked for side by side. Where the first one is in the way of the second, that is
  /// looked for again: the paths of the rim, which are in by then, keep the sides apart, but for a handle that the collision mesh lacks.
  Status insert_both(CH h) {
    std::array<Result<SurfacePath>, 2> path{SurfacePath{}, SurfacePath{}};
    const std::array<Ends, 2> ends{ends_of(h, 0), ends_of(h, 1)};
    parallel_for(2, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t side = begin; side < end; ++side)
        path[side] = find(h, static_cast<int>(side), ends[side], side == 0 ? scratch_ : other_scratch_);
    });
    if (!path[0]) return edge_error(h, 0, path[0].error().message);
    const bool apart = path[1].ok() && are_apart(*path[0], *path[1]);
    KERF_TRY(insert_path(h, 0, *path[0]));
    return apart && still_leads(*path[1], ends[1], ends_of(h, 1)) ? insert_path(h, 1, *path[1]) : insert(h, 1);
  }

  /// Do the paths run through different triangles? Then inserting one splits none that the other names.
  bool are_apart(const SurfacePath& a, const SurfacePath& b) {
    list_faces(a, near_[0]);
    list_faces(b, near_[1]);
    for (auto i = near_[0].begin(), j = near_[1].begin(); i != near_[0].end() && j != near_[1].end();
         *i < *j ? ++i : ++j)
      if (*i == *j) return false;
    return true;
  }
  void list_faces(const SurfacePath& path, std::vector<std::int32_t>& faces) const {
    const WalledSurface& w = surface_.walled;
    faces.clear();
    for (std::size_t i = 0; i < path.stops.size(); ++i) {
      std::int32_t h = path.stops[i].half_edge;
      if (h < 0 && i > 0 && path.stops[i - 1].vertex >= 0)
        h = find_half_edge(w, path.stops[i - 1].vertex, path.stops[i].vertex);  // along an edge
      if (h < 0) continue;
      faces.push_back(h / 3);
      if (w.opposite(h) >= 0) faces.push_back(w.opposite(h) / 3);
    }
    std::sort(faces.begin(), faces.end());
  }
  /// After the insertion of a path that is apart from this one: does it still leave and arrive between the same neighbours, through
  /// vertices that are still free?
  [[nodiscard]] bool still_leads(const SurfacePath& path, const Ends& before, const Ends& now) const {
    const auto same = [](Sector a, Sector b) { return a.first == b.first && a.last == b.last; };
    if (!same(before.at_s, now.at_s) || !same(before.at_t, now.at_t)) return false;
    for (std::size_t i = 1; i + 1 < path.stops.size(); ++i)
      if (path.stops[i].vertex >= 0 && surface_.walled.wall_vertex[at(path.stops[i].vertex)]) return false;
    return true;
  }

  Status insert(CH h, int side) {
    auto path = find(h, side, ends_of(h, side), scratch_);
    if (!path) return edge_error(h, side, path.error().message);
    return insert_path(h, side, *path);
  }

  /// The rim of a closed body: the shortest path unless it leaves the rim for the top or bottom.
  Status insert_rim(CH h) {
    const CollisionMesh& c = collision_;
    const WalledSurface& w = surface_.walled;
    const CV u = c.from(h), v = c.to(h);
    const std::int32_t s = bound(u, 0), t = bound(v, 0);
    const Sector at_s = order_.sector(w, s, order_.slot(h, 0, false));
    const Sector at_t = order_.sector(w, t, order_.slot(h, 0, true));
    auto path = find_path(w, s, t, at_s, at_t, {options_.exact}, scratch_);
    const Vec3 chord = w.at(t) - w.at(s);
    Vec3 normal = cross(c.rest[v] - c.rest[u], c.rest[c.apex(h)] - c.rest[u]);
    normal = normalized(normal - (dot(normal, chord) / dot(chord, chord)) * chord);
    const double half = 0.5 * (vertices_.half_thickness[u.index()] + vertices_.half_thickness[v.index()]);
    if (!path || greatest_height(w, *path, w.at(s), normal) > kRimHeight * half) {
      SurfacePath along = trace_section(w, s, t, normal, at_s, at_t);
      if (!along.stops.empty() && (!path || along.length <= kRimDetour * path->length)) {
        ++network_.rim_followed;
        return insert_path(h, 0, along);
      }
    }
    if (!path) return edge_error(h, 0, path.error().message);
    return insert_path(h, 0, *path);
  }

  SplitSurface& surface_;
  const CollisionMesh& collision_;
  const BoundVertices& vertices_;
  bool closed_;
  double mean_edge_;
  const PathNetworkOptions& options_;
  PathOrder order_;
  PathNetwork network_;
  PathScratch scratch_, other_scratch_;
  std::array<std::vector<std::int32_t>, 2> near_;
  std::vector<PlannedStop> plan_;
  std::vector<std::uint8_t> is_bound_;  ///< |V visual|, open sheets only
};

}  // namespace

Result<PathNetwork> insert_paths(SplitSurface& surface, const CollisionMesh& collision, const BoundVertices& vertices,
                                 bool closed, const PathNetworkOptions& options) {
  return PathInserter(surface, collision, vertices, closed, options).run();
}

int split_dividing_edges(SplitSurface& s, const CollisionMesh& c, const BoundVertices& vertices,
                         const PathNetwork& network) {
  WalledSurface& w = s.walled;
  // Which chain a vertex lies inside of (numbered 2 half-edge + side), and for bound vertices: -2.
  constexpr std::int32_t kNone = -1, kBound = -2;
  std::vector<std::int32_t> owner(w.position.size(), kNone);
  for (const auto& bound : vertices.bound)
    for (const std::int32_t v : bound)
      if (v >= 0) owner[at(v)] = kBound;
  const auto ends = [&](std::int32_t chain) {
    const CH h(chain / 2);
    return std::array<std::int32_t, 2>{vertices.bound[c.from(h).index()][at(chain % 2)],
                                       vertices.bound[c.to(h).index()][at(chain % 2)]};
  };
  for (std::size_t h = 0; h < network.chain.size(); ++h)
    for (std::size_t side = 0; side < 2; ++side) {
      const PoolRun run = network.chain[h][side];
      for (std::int32_t i = 0; i < run.count; ++i) {
        std::int32_t& o = owner[at(network.pool[run.at(i).index()])];
        if (o == kNone) o = static_cast<std::int32_t>(2 * h + side);
      }
    }
  int count = 0;
  // A split moves one edge of each face to a higher id, which this loop still reaches.
  for (std::int32_t h = 0; h < static_cast<std::int32_t>(w.origin.size()); ++h) {
    if (w.wall[at(h)] || w.opposite(h) < h) continue;  // borders are walls
    const std::int32_t a = w.from(h), b = w.to(h);
    if (!w.wall_vertex[at(a)] || !w.wall_vertex[at(b)]) continue;
    const std::int32_t oa = owner[at(a)], ob = owner[at(b)];
    bool divides = oa == ob && oa != kNone;  // of one chain, or two corners of a patch
    if (!divides && (oa == kBound) != (ob == kBound)) {
      const std::int32_t corner = oa == kBound ? a : b, chain = oa == kBound ? ob : oa;
      if (chain >= 0) divides = ends(chain)[0] == corner || ends(chain)[1] == corner;
    }
    if (!divides) continue;
    split_edge(s, h, 0.5);
    ++count;
  }
  return count;
}

}  // namespace kerf
