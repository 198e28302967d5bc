#include "kerf/binding/bound_vertices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "kerf/base/at.h"
#include "kerf/base/indexed.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/binding/margins.h"
#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

using CV = CollisionVertex;
using CH = CollisionHalfEdge;
using CT = CollisionTriangle;

/// Vertices that a warning names before it says "...".
constexpr std::size_t kNamedVertices = 5;

/// Barycentric weights of p's projection to face f.
std::array<double, 3> weights_in(const WalledSurface& w, std::int32_t f, Vec3 p) {
  const Vec3 a = w.at(w.from(3 * f)), b = w.at(w.from(3 * f + 1)), c = w.at(w.from(3 * f + 2));
  const Vec3 n = cross(b - a, c - a);
  const double nn = dot(n, n);
  const double wb = dot(cross(p - a, c - a), n) / nn, wc = dot(cross(b - a, p - a), n) / nn;
  return {1 - wb - wc, wb, wc};
}

/// Makes the point p of the original face `face` a bound vertex: an existing free vertex nearby, or a new one.
std::int32_t insert_bound_point(SplitSurface& s, std::int32_t face, Vec3 p, double mean_edge, BoundVertices& out) {
  WalledSurface& w = s.walled;
  // Earlier points may have split the face: walk to the part that holds p.
  std::int32_t f = face;
  std::array<double, 3> b = weights_in(w, f, p);
  for (int step = 0; step < 64; ++step) {
    const auto k = static_cast<std::int32_t>(std::min_element(b.begin(), b.end()) - b.begin());
    if (b[at(k)] >= -1e-12) break;
    const std::int32_t t = w.opposite(3 * f + (k + 1) % 3);
    if (t < 0 || s.parent[at(t / 3)] != face) break;
    f = t / 3;
    b = weights_in(w, f, p);
  }
  double sum = 0;
  for (double& x : b) sum += x = std::max(x, 0.0);
  for (double& x : b) x /= sum;

  // Corner k lies between the edges h_k (leaving) and h_{k-1} (arriving); weight k is the height over h_{k+1}.
  std::array<Vec3, 3> x;
  std::array<double, 3> length;  // of h_k
  for (std::int32_t k = 0; k < 3; ++k) x[at(k)] = w.at(w.from(3 * f + k));
  for (std::size_t k = 0; k < 3; ++k) length[k] = norm(x[(k + 1) % 3] - x[k]);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t v = w.from(3 * f + static_cast<std::int32_t>(k));
    if (w.wall_vertex[at(v)]) continue;
    const Vec3 q = b[0] * (x[0] - x[k]) + b[1] * (x[1] - x[k]) + b[2] * (x[2] - x[k]);
    const double shorter = std::min(length[k], length[(k + 2) % 3]);
    if (norm(q) < Margins::of(shorter, mean_edge).snap * shorter) {
      w.wall_vertex[at(v)] = 1;
      ++out.snapped;
      return v;
    }
  }
  const auto k = static_cast<std::int32_t>(std::min_element(b.begin(), b.end()) - b.begin());
  const std::int32_t h = 3 * f + (k + 1) % 3;
  std::int32_t m;
  const double longest = *std::max_element(length.begin(), length.end()), inside = Margins::of(longest, mean_edge).snap;
  if (b[at(k)] < inside && w.opposite(h) >= 0) {
    const Margins margins = Margins::of(length[at((k + 1) % 3)], mean_edge);
    double t = b[at((k + 2) % 3)] / (b[at((k + 1) % 3)] + b[at((k + 2) % 3)]);
    t = std::clamp(t, w.wall_vertex[at(w.from(h))] ? margins.wall : margins.snap,
                   1 - (w.wall_vertex[at(w.to(h))] ? margins.wall : margins.snap));
    m = split_edge(s, h, t);
  } else {
    // Away from the corners and (border edges only come here) from the sides.
    sum = 0;
    for (double& weight : b) sum += weight = std::max(weight, inside);
    for (double& weight : b) weight /= sum;
    m = split_face(s, f, b);
  }
  w.wall_vertex[at(m)] = 1;
  ++out.inserted;
  return m;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Bound points that turn a collision triangle over make badly shaped patches, but no wrong topology.
void warn_flipped(const SplitSurface& s, const CollisionMesh& c, BoundVertices& out) {
  int flipped = 0;
  std::int32_t first = -1;
  for (std::size_t f = 0; f < c.face_count(); ++f) {
    const auto id = static_cast<std::int32_t>(3 * f);
    const CV v[3] = {c.from(CH(id)), c.from(CH(id + 1)), c.from(CH(id + 2))};
    const Vec3 n = cross(c.rest[v[1]] - c.rest[v[0]], c.rest[v[2]] - c.rest[v[0]]);
    for (std::size_t side = 0; side < 2; ++side) {
      if (out.bound[v[0].index()][side] < 0) continue;
      const Vec3 p0 = s.walled.at(out.bound[v[0].index()][side]), p1 = s.walled.at(out.bound[v[1].index()][side]),
                 p2 = s.walled.at(out.bound[v[2].index()][side]);
      if (dot(cross(p1 - p0, p2 - p0), n) > 0) continue;
      if (flipped++ == 0) first = static_cast<std::int32_t>(f);
    }
  }
  if (flipped > 0)
    out.warnings.push_back(
        fmt::format("{} collision triangle(s) are turned over by their bound points, the first is triangle {}: "
                    "the collision mesh fits badly there",
                    flipped, first + 1));
}

/// Directions at a border vertex: out of the body within the mid-surface, and the mean length of its two border edges.
struct BorderFrame {
  Vec3 outward;
  double length = 0;
};
BorderFrame border_frame(const CollisionMesh& c, CV v, Vec3 normal) {
  const CH out = c.fan_start(v);
  CH in = out;
  while (c.ccw(in).valid()) in = c.ccw(in);
  const Vec3 after = c.rest[c.to(out)] - c.rest[v], before = c.rest[v] - c.rest[c.from(CollisionMesh::prev(in))];
  return {normalized(cross(normalized(after), normal) + cross(normalized(before), normal)),
          0.5 * (norm(after) + norm(before))};
}

/// Exits of the rays of inner vertices along +- normal.
using Exits = std::vector<std::array<std::optional<SkinPoint>, 2>>;
void cast_both_ways(const SkinSearch& search, const CollisionMesh& c, CV v, Vec3 normal, Exits& hit) {
  for (std::size_t side = 0; side < 2; ++side)
    hit[v.index()][side] = search.first_exit(c.rest[v], side == 0 ? normal : -normal, HUGE_VAL);
}

/// Triangles finer than the body is thick have rays that cross before they leave it; smoother normals don't.
void uncross(const SkinSearch& search, const CollisionMesh& c, const std::vector<std::uint8_t>& border,
             std::span<Vec3> normals, Exits& hit) {
  const auto crossed = [&](CT f) {
    CV v[3];
    for (int k = 0; k < 3; ++k) v[k] = c.from(CollisionMesh::corner(f, k));
    const Vec3 n = cross(c.rest[v[1]] - c.rest[v[0]], c.rest[v[2]] - c.rest[v[0]]);
    for (std::size_t side = 0; side < 2; ++side) {
      Vec3 p[3];
      for (int k = 0; k < 3; ++k) {
        const auto& q = hit[v[k].index()][side];
        if (!border[v[k].index()] && !q) return false;
        p[k] = q ? q->position : c.rest[v[k]];
      }
      if (!(dot(cross(p[1] - p[0], p[2] - p[0]), n) > 0)) return true;
    }
    return false;
  };
  std::vector<std::uint8_t> rough(c.vertex_count());
  std::vector<Vec3> smooth(normals.begin(), normals.end());
  for (int round = 0; round < kMostUncrossings; ++round) {
    std::fill(rough.begin(), rough.end(), std::uint8_t{0});
    bool any = false;
    for (const CT f : ids<CT>(c.face_count())) {
      if (!crossed(f)) continue;
      any = true;
      for (int k = 0; k < 3; ++k) rough[c.from(CollisionMesh::corner(f, k)).index()] = 1;
    }
    if (!any) return;
    for (const CV v : ids<CV>(c.vertex_count())) {
      if (!rough[v.index()] || border[v.index()]) continue;
      Vec3 sum = normals[v.index()];
      c.for_each_outgoing(v, [&](CH h) {
        sum += normals[c.to(h).index()];
        return true;
      });
      smooth[v.index()] = normalized(sum);
    }
    for (const CV v : ids<CV>(c.vertex_count())) {
      if (!rough[v.index()] || border[v.index()]) continue;
      normals[v.index()] = smooth[v.index()];
      cast_both_ways(search, c, v, normals[v.index()], hit);
    }
  }
}

}  // namespace

Status check_folds(const CollisionMesh& c, std::vector<CollisionVertex>* at_fault) {
  const auto normal = [&](CH h) {
    const Vec3 a = c.rest[c.from(h)], b = c.rest[c.to(h)], d = c.rest[c.apex(h)];
    return normalized(cross(b - a, d - a));
  };
  for (const CH h : ids<CH>(c.half_edge_count())) {
    const CH t = c.twin[h];
    if (!t.valid() || t < h) continue;
    if (!(dot(normal(h), normal(t)) < kFoldCosine)) continue;
    if (at_fault != nullptr) *at_fault = {c.from(h), c.to(h)};
    return bad_input(
        fmt::format("collision mesh: folded over itself at the edge between vertices {} and {}; unfold it, "
                    "every part of the body needs one layer of triangles",
                    c.from(h).value + 1, c.to(h).value + 1));
  }
  return {};
}

/// A collision mesh inside the body sees the surface on both sides. One that is beside the body would bind to something all
/// the same, and the hexahedra would lie where nothing is.
Status check_inside(const SkinSearch& search, const CollisionMesh& c, const std::vector<std::uint8_t>& border,
                    const std::vector<std::array<std::optional<SkinPoint>, 2>>& hit, BoundVertices& out) {
  std::size_t blind = 0;
  CT first;
  for (const CT f : ids<CT>(c.face_count())) {
    const CH h = CollisionMesh::corner(f, 0);
    const Vec3 p = c.rest[c.from(h)], q = c.rest[c.to(h)], r = c.rest[c.apex(h)];
    const Vec3 n = normalized(cross(q - p, r - p)), middle = (1.0 / 3) * (p + q + r);
    if (search.first_exit(middle, n, HUGE_VAL) && search.first_exit(middle, -n, HUGE_VAL)) continue;
    if (blind++ == 0) first = f;
  }
  if (2 * blind > c.face_count())
    return bad_input(fmt::format(
        "the collision mesh lies outside the visual mesh: {} of its {} triangles (the first is triangle {}, at "
        "collision vertex {}) do not have the surface on both sides; put it half-way through the thickness, "
        "in the same place and unit",
        blind, c.face_count(), first.value + 1, c.from(CollisionMesh::corner(first, 0)).value + 1));
  std::string names;
  std::size_t outside = 0;
  for (const CV v : ids<CV>(c.vertex_count())) {
    if (border[v.index()] || (hit[v.index()][0] && hit[v.index()][1])) continue;
    if (++outside <= kNamedVertices) names += (names.empty() ? "" : ", ") + std::to_string(v.value + 1);
  }
  if (outside > 0)
    out.warnings.push_back(
        fmt::format("{} inner collision vertices ({}{}) lie outside the visual mesh and were bound to the closest "
                    "points; move them between the two sides of the body",
                    outside, names, outside > kNamedVertices ? ", ..." : ""));
  return {};
}

Result<BoundVertices> bind_closed(SplitSurface& s, const SkinSearch& search, const CollisionMesh& c,
                                  std::span<Vec3> normals, std::vector<CollisionVertex>* at_fault) {
  const std::size_t nv = c.vertex_count();
  const double edge = mean_edge(c);
  BoundVertices out;
  const auto refuse = [&](CV v, std::string why) {
    if (at_fault != nullptr) *at_fault = {v};
    return bad_input(std::move(why));
  };
  out.bound.assign(nv, {-1, -1});
  out.half_thickness.assign(nv, 0);
  std::vector<std::uint8_t> border(nv);
  for (const CV v : ids<CV>(nv)) border[v.index()] = c.on_border(v);

  // Inner vertices: rays both ways, then a plausible reach from the neighbourhood.
  Exits hit(nv);
  for (const CV v : ids<CV>(nv))
    if (!border[v.index()]) cast_both_ways(search, c, v, normals[v.index()], hit);
  uncross(search, c, border, normals, hit);
  std::vector<double> all;
  for (const CV v : ids<CV>(nv))
    for (std::size_t side = 0; side < 2; ++side)
      if (hit[v.index()][side]) all.push_back(hit[v.index()][side]->distance);
  KERF_TRY(check_inside(search, c, border, hit, out));
  const double overall = all.empty() ? 0 : median(all);
  std::vector<double> typical(nv, overall), ring;
  for (const CV v : ids<CV>(nv)) {
    ring.clear();
    const auto add = [&](CV u) {
      for (std::size_t side = 0; side < 2; ++side)
        if (hit[u.index()][side]) ring.push_back(hit[u.index()][side]->distance);
    };
    add(v);
    c.for_each_outgoing(v, [&](CH h) {
      add(c.to(h));
      if (!c.ccw(h).valid()) add(c.apex(h));
      return true;
    });
    if (!ring.empty()) typical[v.index()] = median(ring);
  }

  std::vector<BorderFrame> frame(nv);
  std::vector<std::array<SkinPoint, 2>> chosen(nv);
  std::size_t far_rim = 0;
  CV far_rim_vertex;
  for (const CV v : ids<CV>(nv)) {
    const Vec3 p = c.rest[v], n = normals[v.index()];
    if (border[v.index()]) {
      frame[v.index()] = border_frame(c, v, n);
      const auto [outward, length] = frame[v.index()];
      std::optional<SkinPoint> q = search.closest(p, {}, 2 * length);
      if (!q)
        return refuse(
            v, fmt::format("collision vertex {}: the visual mesh is farther away than two edges; are both meshes "
                           "in the same place and in the same unit?",
                           v.value + 1));
      // A border that ends inside the body: its rim lies straight ahead, the closest point may be on the top or bottom.
      if (q->distance > 1e-3 * length) {
        if (const auto ahead = search.first_exit(p, outward, 2 * length)) {
          q = ahead;
        } else if (search.first_exit(p, n, 2 * length) && search.first_exit(p, -n, 2 * length)) {
          if (far_rim++ == 0) far_rim_vertex = v;  // deep inside, no rim in sight
        }
      }
      chosen[v.index()][0] = *q;
      continue;
    }
    for (std::size_t side = 0; side < 2; ++side) {
      const Vec3 direction = side == 0 ? n : -n;
      std::optional<SkinPoint> q = hit[v.index()][side];
      if (!q || q->distance > kReachFactor * typical[v.index()])
        q = search.closest(p, direction, kOutsideFactor * typical[v.index()]);
      if (!q)
        return refuse(
            v, fmt::format("collision vertex {} lies outside the visual mesh: nothing within reach on its {} side; "
                           "move it between the two sides of the body",
                           v.value + 1, side == 0 ? "+" : "-"));
      chosen[v.index()][side] = *q;
    }
  }

  if (far_rim > 0)
    out.warnings.push_back(
        fmt::format("{} border vertices of the collision mesh (the first is {}) lie deep inside the body, "
                    "with no rim ahead of them; extend the collision mesh to the rim",
                    far_rim, far_rim_vertex.value + 1));

  for (const CV v : ids<CV>(nv)) {
    const auto& q = chosen[v.index()];
    auto& bound = out.bound[v.index()];
    if (border[v.index()]) {
      bound[0] = bound[1] = insert_bound_point(s, q[0].face, q[0].position, edge, out);
      continue;
    }
    for (std::size_t side = 0; side < 2; ++side)
      bound[side] = insert_bound_point(s, q[side].face, q[side].position, edge, out);
    const double across = dot(s.walled.at(bound[0]) - s.walled.at(bound[1]), normals[v.index()]);
    if (!(across > 0))
      return refuse(
          v, fmt::format("collision vertex {}: its + side lies below its - side; the collision mesh is outside the "
                         "visual mesh or folded over it there",
                         v.value + 1));
    out.half_thickness[v.index()] = 0.5 * across;
  }

  // Rim corners of the prisms: the half thickness found one half thickness inside the rim (a fixed point).
  for (const CV v : ids<CV>(nv)) {
    if (!border[v.index()]) continue;
    const Vec3 n = normals[v.index()], rim = s.walled.at(out.bound[v.index()][0]);
    double x = typical[v.index()] > 0 ? typical[v.index()] : 0.25 * frame[v.index()].length, half = 0;
    for (int round = 0; round < 8; ++round) {
      const Vec3 q = rim - x * frame[v.index()].outward;
      const auto up = search.first_exit(q, n, 2 * frame[v.index()].length + 4 * x);
      const auto down = search.first_exit(q, -n, 2 * frame[v.index()].length + 4 * x);
      half = up && down ? 0.5 * (up->distance + down->distance) : 0;
      if (half > 0 && std::fabs(half - x) < 1e-3 * half) break;
      x = half > 0 ? std::min(half, 2 * x) : 0.5 * x;
    }
    out.half_thickness[v.index()] = half;
  }
  warn_flipped(s, c, out);
  return out;
}

std::vector<std::vector<std::int32_t>> border_loops(std::span<const std::int32_t> origin,
                                                    std::span<const std::int32_t> twin) {
  // The only border half-edge that leaves a border vertex, found by turning clockwise around the end of the last one.
  std::vector<std::vector<std::int32_t>> loops;
  std::vector<std::uint8_t> done;
  for (std::size_t start = 0; start < twin.size(); ++start) {
    if (twin[start] >= 0) continue;
    if (done.empty()) done.assign(twin.size(), 0);
    if (done[start]) continue;
    std::vector<std::int32_t> loop;
    auto h = static_cast<std::int32_t>(start);
    do {
      done[at(h)] = 1;
      loop.push_back(origin[at(h)]);
      std::int32_t g = WalledSurface::next(h);
      while (twin[at(g)] >= 0) g = WalledSurface::next(twin[at(g)]);
      h = g;
    } while (h != static_cast<std::int32_t>(start));
    loops.push_back(std::move(loop));
  }
  return loops;
}

namespace {

/// Position on a closed polyline: segment i runs from loop[i] to loop[i + 1].
struct LoopPoint {
  std::int32_t segment = -1;
  double t = 0, distance = HUGE_VAL;
};

LoopPoint closest_on_loop(const WalledSurface& w, const std::vector<std::int32_t>& loop, Vec3 p) {
  LoopPoint best;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3 a = w.at(loop[i]), b = w.at(loop[(i + 1) % loop.size()]);
    const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
    const double d = norm(lerp(a, b, t) - p);
    if (d < best.distance) best = {static_cast<std::int32_t>(i), t, d};
  }
  return best;
}

/// Arc-length positions of consecutive collision vertices along the visual border, made increasing over one turn: the
/// nearest non-decreasing sequence, ties spread out. Returns false if they do not go round once.
bool order_on_loop(std::vector<double>& s, double perimeter, bool& moved) {
  const std::size_t n = s.size();
  // Unwrap with the shorter way each time, starting behind the longest gap.
  std::vector<double> step(n);
  double total = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double d = std::fmod(s[(i + 1) % n] - s[i], perimeter);
    if (d < 0) d += perimeter;
    if (n > 2 && d > 0.5 * perimeter + 1e-9 * perimeter) d -= perimeter;
    step[i] = d;
    total += d;
  }
  if (std::fabs(total - perimeter) > 1e-6 * perimeter) return false;
  std::size_t first = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (step[i] > step[(first + n - 1) % n]) first = (i + 1) % n;
  struct Block {
    double mean;
    std::size_t count;
  };
  std::vector<Block> blocks;
  double x = s[first];
  for (std::size_t i = 0; i < n; ++i) {
    blocks.push_back({x, 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean >= blocks.back().mean) {
      const Block b = blocks.back();
      blocks.pop_back();
      Block& a = blocks.back();
      a.mean = (a.mean * static_cast<double>(a.count) + b.mean * static_cast<double>(b.count)) /
               static_cast<double>(a.count + b.count);
      a.count += b.count;
    }
    x += step[(first + i) % n];
  }
  moved = blocks.size() < n;
  std::size_t i = 0;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const double previous = k > 0 ? blocks[k - 1].mean : blocks.back().mean - perimeter;
    const double following = k + 1 < blocks.size() ? blocks[k + 1].mean : blocks[0].mean + perimeter;
    const double room = 0.4 * std::min(blocks[k].mean - previous, following - blocks[k].mean);
    for (std::size_t j = 0; j < blocks[k].count; ++j, ++i) {
      const double shift =
          blocks[k].count == 1 ? 0 : -1 + 2 * static_cast<double>(j) / static_cast<double>(blocks[k].count - 1);
      double value = std::fmod(blocks[k].mean + shift * room, perimeter);
      if (value < 0) value += perimeter;
      s[(first + i) % n] = value;
    }
  }
  return true;
}

}  // namespace

Result<BoundVertices> bind_open(SplitSurface& s, const SkinSearch& search, const CollisionMesh& c, double thickness) {
  const std::size_t nv = c.vertex_count();
  const double mean = mean_edge(c);
  BoundVertices out;
  out.bound.assign(nv, {-1, -1});
  out.half_thickness.assign(nv, 0.5 * thickness);
  WalledSurface& w = s.walled;

  std::vector<std::int32_t> origin, twin;
  for (const CH h : ids<CH>(c.half_edge_count())) {
    origin.push_back(c.from(h).value);
    twin.push_back(c.twin[h].value);
  }
  const auto coarse = border_loops(origin, twin), fine = border_loops(w.origin, w.twin);
  if (coarse.size() != fine.size())
    return bad_input(
        fmt::format("the visual mesh is an open sheet with {} border(s), the collision mesh has {}: every border "
                    "of the sheet needs one in the collision mesh (and a closed body a closed visual mesh)",
                    fine.size(), coarse.size()));

  // Each collision loop takes the visual loop that most of its vertices are closest to.
  std::vector<std::int32_t> owner(fine.size(), -1);
  for (std::size_t l = 0; l < coarse.size(); ++l) {
    std::vector<std::size_t> votes(fine.size(), 0);
    for (const std::int32_t v : coarse[l]) {
      std::size_t best = 0;
      double distance = HUGE_VAL;
      for (std::size_t k = 0; k < fine.size(); ++k) {
        const double d = fine.size() == 1 ? 0 : closest_on_loop(w, fine[k], c.rest[CV(v)]).distance;
        if (d < distance) {
          distance = d;
          best = k;
        }
      }
      ++votes[best];
    }
    const auto k = static_cast<std::size_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
    if (owner[k] >= 0)
      return bad_input(
          fmt::format("two borders of the collision mesh (at vertices {} and {}) lie at the same border of the visual "
                      "mesh",
                      coarse[at(owner[k])][0] + 1, coarse[l][0] + 1));
    owner[k] = static_cast<std::int32_t>(l);

    // Arc-length positions along the loop.
    const std::vector<std::int32_t>& loop = fine[k];
    std::vector<double> start(loop.size() + 1, 0);
    for (std::size_t i = 0; i < loop.size(); ++i)
      start[i + 1] = start[i] + norm(w.at(loop[(i + 1) % loop.size()]) - w.at(loop[i]));
    std::vector<double> position;
    for (const std::int32_t v : coarse[l]) {
      const LoopPoint q = closest_on_loop(w, loop, c.rest[CV(v)]);
      const double edge = border_frame(c, CV(v), {0, 0, 1}).length;
      if (q.distance > 2 * edge)
        return bad_input(
            fmt::format("collision vertex {}: the border of the visual mesh is farther away than two edges; are "
                        "both meshes in the same place and in the same unit?",
                        v + 1));
      position.push_back(start[at(q.segment)] + q.t * (start[at(q.segment) + 1] - start[at(q.segment)]));
    }
    const double perimeter = start.back();
    bool moved = false;
    if (!order_on_loop(position, perimeter, moved))
      return bad_input(
          fmt::format("the border of the collision mesh at vertex {} does not follow the border of the visual mesh "
                      "once around; move its vertices near the border, in order",
                      coarse[l][0] + 1));
    if (moved)
      out.warnings.push_back(
          fmt::format("border vertices of the collision mesh near vertex {} are out of order along the visual "
                      "border and were moved apart",
                      coarse[l][0] + 1));

    // Into the mesh, in order: snap to a border vertex that is not taken yet, else split.
    std::vector<std::size_t> by_position(position.size());
    for (std::size_t i = 0; i < by_position.size(); ++i) by_position[i] = i;
    std::stable_sort(by_position.begin(), by_position.end(),
                     [&](std::size_t i, std::size_t j) { return position[i] < position[j]; });
    std::vector<std::uint8_t> taken(loop.size(), 0);
    std::size_t segment = 0;
    std::vector<std::pair<double, std::size_t>> split;  // (t, index) of the current segment
    const auto flush = [&] {
      if (split.empty()) return;
      const std::int32_t a = loop[segment];
      double end = 1;
      for (std::size_t i = split.size(); i-- > 0;) {
        // Even spacing where points crowd: each keeps a margin to the one split off before it.
        const double t = std::clamp(split[i].first / end, kSnapFraction, 1 - kSnapFraction);
        out.bound[at(coarse[l][split[i].second])][0] = split_edge(s, fan_start(w, a), t);
        end *= t;
        ++out.inserted;
      }
      split.clear();
    };
    for (std::size_t j = 0; j < by_position.size(); ++j) {
      const std::size_t i = by_position[j];
      while (segment + 1 < loop.size() && position[i] >= start[segment + 1]) {
        flush();
        ++segment;
      }
      const double t = (position[i] - start[segment]) / (start[segment + 1] - start[segment]);
      const std::size_t nearest = t < 0.5 ? segment : (segment + 1) % loop.size();
      // The order must survive: no other point of this segment between this one and the vertex.
      const bool alone =
          t < 0.5 ? split.empty() : j + 1 == by_position.size() || position[by_position[j + 1]] >= start[segment + 1];
      if (std::min(t, 1 - t) < kSnapFraction && alone && !taken[nearest]) {
        taken[nearest] = 1;
        out.bound[at(coarse[l][i])][0] = loop[nearest];
        ++out.snapped;
        continue;
      }
      split.emplace_back(t, i);
    }
    flush();
  }

  // Inner vertices: closest points. Border vertices of the sheet are wall vertices already, so none is taken.
  for (const CV v : ids<CV>(nv)) {
    if (out.bound[v.index()][0] >= 0) continue;
    double edge = 0;
    c.for_each_outgoing(v, [&](CH h) {
      edge = std::max(edge, norm(c.rest[c.to(h)] - c.rest[v]));
      return true;
    });
    const auto q = search.closest(c.rest[v], {}, edge);
    if (!q)
      return bad_input(
          fmt::format("collision vertex {}: the visual mesh is farther away than its longest edge; are both meshes in "
                      "the same place and in the same unit?",
                      v.value + 1));
    out.bound[v.index()][0] = insert_bound_point(s, q->face, q->position, mean, out);
  }
  warn_flipped(s, c, out);
  return out;
}

}  // namespace kerf
