#include "kerf/binding/split_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <queue>

#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

/// Appends a face without neighbours; returns its first half-edge.
std::int32_t append_face(SplitSurface& s, std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t parent) {
  WalledSurface& w = s.walled;
  const auto first = static_cast<std::int32_t>(w.origin.size());
  w.origin.insert(w.origin.end(), {a, b, c});
  w.twin.insert(w.twin.end(), {-1, -1, -1});
  w.wall.insert(w.wall.end(), {0, 0, 0});
  if (!s.texture.empty()) s.texture.resize(s.texture.size() + 3);
  s.parent.push_back(parent);
  return first;
}

void connect(WalledSurface& w, std::int32_t h, std::int32_t g) {
  w.twin[at(h)] = g;
  if (g >= 0) w.twin[at(g)] = h;
}

/// Moves what belongs to edge `from` (twin, wall flag, texture of its origin, its origin's outgoing) to the new slot `to`.
void move_edge(SplitSurface& s, std::int32_t from, std::int32_t to) {
  WalledSurface& w = s.walled;
  connect(w, to, w.opposite(from));
  w.wall[at(to)] = w.wall[at(from)];
  if (!s.texture.empty()) s.texture[at(to)] = s.texture[at(from)];
  if (w.outgoing[at(w.from(from))] == from) w.outgoing[at(w.from(from))] = to;
}

/// The angle with this sine >= 0 and cosine, to a common scale: good to 2e-8 (Abramowitz and Stegun 4.4.49), which is a float's.
double angle_of(double sine, double cosine) {
  const double size = std::fabs(cosine), low = sine < size ? sine : size, high = sine < size ? size : sine;
  const double t = low / high, q = t * t;
  double p = 0.0028662257;
  for (const double c : {-0.0161657367, 0.0429096138, -0.0752896400, 0.1065626393, -0.1420889944, 0.1999355085, -0.3333314528, 1.0}) p = p * q + c;
  const double acute = sine < size ? p * t : 0.5 * std::numbers::pi - p * t;
  return cosine < 0 ? std::numbers::pi - acute : acute;
}

Vec3f blended_normal(Vec3f a, Vec3f b, double t) { return to_float(normalized(lerp(to_double(a), to_double(b), t))); }

double length_of(const WalledSurface& w, std::int32_t h) { return norm(w.at(w.to(h)) - w.at(w.from(h))); }

/// The faces become their own parents; which faces of the input they are part of is kept.
void become_parents(SplitSurface& s) {
  std::vector<std::int32_t> input(s.parent.size());
  for (std::size_t f = 0; f < input.size(); ++f) input[f] = s.input_face(static_cast<std::int32_t>(f));
  s.input = std::move(input);
  std::iota(s.parent.begin(), s.parent.end(), 0);
}

/// Is the edge so long and one of its triangles so thin that it should not be there, if another could be?
bool is_long_and_thin(const WalledSurface& w, std::int32_t h, double limit) {
  const auto thin = [&](std::int32_t e) {
    const Vec3 a = w.at(w.from(e)), along = w.at(w.to(e)) - a;
    return norm(cross(along, w.at(w.apex(e)) - a)) < kThinFan * dot(along, along);
  };
  return w.opposite(h) >= 0 && length_of(w, h) > limit && (thin(h) || thin(w.opposite(h)));
}

/// Do the triangles at edge h lie in one plane and in one texture map, so that the other diagonal would do as well?
bool is_in_flat_part(const SplitSurface& s, std::int32_t h) {
  const WalledSurface& w = s.walled;
  const std::int32_t g = w.opposite(h);
  if (g < 0 || w.wall[at(h)]) return false;
  const Vec3 a = w.at(w.from(h)), b = w.at(w.to(h)), c = w.at(w.apex(h)), d = w.at(w.apex(g));
  const Vec3 n = cross(b - a, c - a), m = cross(a - b, d - b);
  const double longest = std::max({norm(b - a), norm(c - a), norm(d - a), norm(c - b), norm(d - b)});
  const double off = std::max(std::fabs(dot(d - a, n)) / norm(n), std::fabs(dot(c - a, m)) / norm(m));
  if (!(dot(n, m) > 0) || !(off <= kFlatPart * longest)) return false;
  if (s.texture.empty()) return true;
  // The far corner's texture must be where the map of h's triangle puts it.
  const auto uv = [&](std::int32_t e) { return s.texture[at(e)]; };
  const Vec2f ta = uv(h), tb = uv(WalledSurface::next(h)), tc = uv(WalledSurface::prev(h)), td = uv(WalledSurface::prev(g));
  const double wb = dot(cross(d - a, c - a), n) / dot(n, n), wc = dot(cross(b - a, d - a), n) / dot(n, n);
  const auto apart = [](Vec2f p, Vec2f q) { return std::fabs(p.x - q.x) + std::fabs(p.y - q.y); };
  const auto mapped = [&](float x, float y, float z) { return static_cast<float>(x + wb * (y - x) + wc * (z - x)); };
  return apart(ta, uv(WalledSurface::next(g))) + apart(tb, uv(g)) < kSameTexture &&
         apart(td, {mapped(ta.x, tb.x, tc.x), mapped(ta.y, tb.y, tc.y)}) < kSameTexture;
}

/// Would the other diagonal of the quadrilateral around h be the Delaunay one? By the cotangents of the angles opposite to h.
bool is_worse_diagonal(const WalledSurface& w, std::int32_t h) {
  const auto cotangent = [&](std::int32_t e) {
    const Vec3 c = w.at(w.apex(e)), u = w.at(w.from(e)) - c, v = w.at(w.to(e)) - c;
    return dot(u, v) / norm(cross(u, v));
  };
  return cotangent(h) + cotangent(w.opposite(h)) < -kDelaunayGain;
}

/// Turns edge h = a->b between triangles (a, b, c) and (b, a, d) into d->c between (d, c, a) and (c, d, b). The faces keep their numbers.
void flip_edge(SplitSurface& s, std::int32_t h) {
  WalledSurface& w = s.walled;
  const std::int32_t g = w.opposite(h);
  const std::array<std::int32_t, 4> inner{WalledSurface::next(h), WalledSurface::prev(h), WalledSurface::next(g), WalledSurface::prev(g)};
  const std::int32_t a = w.from(h), b = w.from(g), c = w.from(inner[1]), d = w.from(inner[3]);
  std::array<std::int32_t, 4> outer;
  std::array<std::uint8_t, 4> wall;
  for (std::size_t i = 0; i < 4; ++i) outer[i] = w.opposite(inner[i]), wall[i] = w.wall[at(inner[i])];
  // The outer edges bc, ca, ad, db move on by one slot.
  w.origin[at(h)] = d, w.origin[at(inner[0])] = c, w.origin[at(inner[1])] = a;
  w.origin[at(g)] = c, w.origin[at(inner[2])] = d, w.origin[at(inner[3])] = b;
  for (std::size_t i = 0; i < 4; ++i) {
    connect(w, inner[i], outer[(i + 1) % 4]);
    w.wall[at(inner[i])] = wall[(i + 1) % 4];
  }
  w.outgoing[at(a)] = inner[1], w.outgoing[at(b)] = inner[3], w.outgoing[at(c)] = inner[0], w.outgoing[at(d)] = inner[2];
  if (s.texture.empty()) return;
  const Vec2f ta = s.texture[at(h)], tb = s.texture[at(g)], tc = s.texture[at(inner[1])], td = s.texture[at(inner[3])];
  s.texture[at(h)] = td, s.texture[at(inner[0])] = tc, s.texture[at(inner[1])] = ta;
  s.texture[at(g)] = tc, s.texture[at(inner[2])] = td, s.texture[at(inner[3])] = tb;
}

}  // namespace

std::vector<Vec3f> smooth_normals(std::span<const Vec3> positions, std::span<const std::array<std::int32_t, 3>> triangles, HalfEdgeRoom room) {
  std::vector<Vec3> sum(positions.size());
  for (const auto& t : triangles) {
    const Vec3 a = positions[at(t[0])], b = positions[at(t[1])], c = positions[at(t[2])];
    const Vec3 u = b - a, v = c - b, w = a - c, area = cross(u, v);
    const double twice = norm(area);
    const Vec3 n = (1 / twice) * area;
    sum[at(t[0])] += angle_of(twice, -dot(u, w)) * n;
    sum[at(t[1])] += angle_of(twice, -dot(v, u)) * n;
    sum[at(t[2])] += angle_of(twice, -dot(w, v)) * n;
  }
  std::vector<Vec3f> normals;
  normals.reserve(sum.size() + room.vertices);
  for (const Vec3 n : sum) normals.push_back(to_float(normalized(n)));
  return normals;
}

SplitSurface make_split_surface(std::span<const Vec3> positions, std::span<const std::array<std::int32_t, 3>> triangles,
                                HalfEdgeArrays connected, std::vector<Vec3f> normals, std::vector<Vec2f> texture, HalfEdgeRoom room) {
  SplitSurface s;
  WalledSurface& w = s.walled;
  const std::size_t vertices = positions.size() + room.vertices, faces = triangles.size() + room.triangles;
  w.position.reserve(vertices);
  w.wall_vertex.reserve(vertices);
  w.origin.reserve(3 * faces);
  w.wall.reserve(3 * faces);
  s.parent.reserve(faces);
  w.position.assign(positions.begin(), positions.end());
  w.outgoing = std::move(connected.outgoing);
  w.twin = std::move(connected.twin);
  for (const auto& t : triangles) w.origin.insert(w.origin.end(), t.begin(), t.end());
  w.wall.assign(w.origin.size(), 0);
  w.wall_vertex.assign(positions.size(), 0);
  for (std::int32_t h = 0; h < static_cast<std::int32_t>(w.twin.size()); ++h)
    if (w.opposite(h) < 0) w.wall_vertex[at(w.from(h))] = w.wall_vertex[at(w.to(h))] = 1;
  s.normal = std::move(normals);
  s.texture = std::move(texture);
  s.parent.resize(triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f) s.parent[f] = static_cast<std::int32_t>(f);
  return s;
}

std::int32_t split_edge(SplitSurface& s, std::int32_t h, double t) {
  WalledSurface& w = s.walled;
  const std::int32_t g = w.opposite(h);
  const std::int32_t a = w.from(h), b = w.to(h), c = w.apex(h);
  const std::int32_t m = s.vertex_count();
  w.position.push_back(lerp(w.at(a), w.at(b), t));
  if (!s.upright.empty()) s.upright.push_back(lerp(s.upright[at(a)], s.upright[at(b)], t));
  s.normal.push_back(blended_normal(s.normal[at(a)], s.normal[at(b)], t));
  const std::uint8_t wall = w.wall[at(h)];
  w.wall_vertex.push_back(wall != 0 || g < 0);

  // h's face (a, b, c) becomes (a, m, c); the new face is (m, b, c) with half-edges n, n+1, n+2.
  const std::int32_t hn = WalledSurface::next(h);
  const std::int32_t n = append_face(s, m, b, c, s.parent[at(h / 3)]);
  move_edge(s, hn, n + 1);
  w.origin[at(hn)] = m;
  w.wall[at(hn)] = 0;
  connect(w, hn, n + 2);
  w.wall[at(n)] = wall;
  if (!s.texture.empty()) {
    const Vec2f uv = lerp(s.texture[at(h)], s.texture[at(n + 1)], t);
    s.texture[at(hn)] = s.texture[at(n)] = uv;
    s.texture[at(n + 2)] = s.texture[at(WalledSurface::prev(h))];
  }
  w.outgoing.push_back(n);
  if (g < 0) return m;

  // g's face (b, a, d) becomes (m, a, d); the new face is (b, m, d) with half-edges k, k+1, k+2.
  const std::int32_t gp = WalledSurface::prev(g), d = w.from(gp);
  const std::int32_t k = append_face(s, b, m, d, s.parent[at(g / 3)]);
  if (!s.texture.empty()) {
    const Vec2f uv_b = s.texture[at(g)], uv_d = s.texture[at(gp)];
    const Vec2f uv = lerp(s.texture[at(WalledSurface::next(g))], uv_b, t);
    s.texture[at(k)] = uv_b;
    s.texture[at(k + 1)] = uv;
    s.texture[at(k + 2)] = uv_d;
    s.texture[at(g)] = uv;
  }
  connect(w, k + 2, w.opposite(gp));
  w.wall[at(k + 2)] = w.wall[at(gp)];
  w.wall[at(gp)] = 0;
  connect(w, gp, k + 1);
  w.origin[at(g)] = m;
  connect(w, k, n);
  w.wall[at(k)] = wall;
  if (w.outgoing[at(b)] == g) w.outgoing[at(b)] = k;
  return m;
}

bool split_long_edges(SplitSurface& s, double limit, std::size_t most_faces) {
  const WalledSurface& w = s.walled;
  struct Long {
    double length;
    std::int32_t h;
  };
  const std::size_t before = s.parent.size();
  for (std::vector<Long> edges; s.parent.size() < most_faces; edges.clear()) {
    for (std::int32_t h = 0; h < static_cast<std::int32_t>(w.origin.size()); ++h)
      if (w.opposite(h) < h && length_of(w, h) > limit) edges.push_back({length_of(w, h), h});
    if (edges.empty()) break;
    std::sort(edges.begin(), edges.end(), [](const Long& x, const Long& y) { return x.length != y.length ? x.length > y.length : x.h < y.h; });
    // A split before this one may have changed which edge the number stands for.
    for (const Long& e : edges)
      if (s.parent.size() < most_faces && length_of(w, e.h) > limit) split_edge(s, e.h, 0.5);
  }
  if (s.parent.size() == before) return false;
  become_parents(s);
  return true;
}

bool triangulate_flat_parts(SplitSurface& s, double limit, std::size_t most_faces) {
  const WalledSurface& w = s.walled;
  struct Long {
    double length;
    std::int32_t from, to;
    bool operator<(const Long& o) const { return length != o.length ? length < o.length : from != o.from ? from > o.from : to > o.to; }
  };
  std::priority_queue<Long> to_halve;
  std::vector<std::int32_t> to_flip;
  for (std::int32_t h = 0; h < static_cast<std::int32_t>(w.origin.size()); ++h)
    if (w.opposite(h) < h && is_long_and_thin(w, h, limit) && is_in_flat_part(s, h)) to_flip.push_back(h);
  if (to_flip.empty()) return false;
  // Creases of a flat part are halved with it, or the triangles along them would stay thin.
  const auto bounds_flat_part = [&](std::int32_t h) {
    for (const std::int32_t e : {h, w.opposite(h)})
      if (e >= 0 && (is_in_flat_part(s, e) || is_in_flat_part(s, WalledSurface::next(e)) || is_in_flat_part(s, WalledSurface::prev(e)))) return true;
    return false;
  };
  bool changed = false;
  std::size_t flips = kMostFlips * std::max(s.parent.size(), most_faces);
  const auto flip_all = [&] {
    while (!to_flip.empty()) {
      const std::int32_t h = to_flip.back();
      to_flip.pop_back();
      const std::int32_t g = w.opposite(h);
      if (flips > 0 && is_in_flat_part(s, h) && is_worse_diagonal(w, h) && find_half_edge(w, w.apex(h), w.apex(g)) < 0) {
        --flips;
        changed = true;
        flip_edge(s, h);
        for (const std::int32_t e : {WalledSurface::next(h), WalledSurface::prev(h), WalledSurface::next(g), WalledSurface::prev(g)}) to_flip.push_back(e);
      }
      if (length_of(w, h) > limit) to_halve.push({length_of(w, h), w.from(h), w.to(h)});
    }
  };
  flip_all();
  while (!to_halve.empty() && s.parent.size() < most_faces) {
    const Long e = to_halve.top();
    to_halve.pop();
    const std::int32_t h = find_half_edge(w, e.from, e.to);
    if (h < 0 || !bounds_flat_part(h)) continue;
    const std::int32_t m = split_edge(s, h, 0.5), start = fan_start(w, m);
    changed = true;
    std::int32_t out = start;
    do {
      to_flip.push_back(WalledSurface::next(out));
      if (length_of(w, out) > limit) to_halve.push({length_of(w, out), w.from(out), w.to(out)});
      out = ccw(w, out);
    } while (out >= 0 && out != start);
    flip_all();
  }
  if (changed) become_parents(s);
  return changed;
}

std::int32_t split_face(SplitSurface& s, std::int32_t f, std::array<double, 3> weights) {
  WalledSurface& w = s.walled;
  const std::int32_t h0 = 3 * f, h1 = h0 + 1, h2 = h0 + 2;
  const std::int32_t a = w.from(h0), b = w.from(h1), c = w.from(h2);
  const std::int32_t m = s.vertex_count();
  KERF_ASSERT(s.upright.empty());
  // Relative to corner a: a far origin must not cost digits.
  w.position.push_back(w.at(a) + (weights[1] * (w.at(b) - w.at(a)) + weights[2] * (w.at(c) - w.at(a))));
  s.normal.push_back(to_float(normalized(weights[0] * to_double(s.normal[at(a)]) + weights[1] * to_double(s.normal[at(b)]) +
                                         weights[2] * to_double(s.normal[at(c)]))));
  w.wall_vertex.push_back(0);
  const std::int32_t p = s.parent[at(f)];
  const std::int32_t n = append_face(s, b, c, m, p), k = append_face(s, c, a, m, p);
  move_edge(s, h1, n);
  move_edge(s, h2, k);
  if (!s.texture.empty()) {
    auto& uv = s.texture;
    const Vec2f ua = uv[at(h0)], ub = uv[at(h1)], uc = uv[at(h2)];
    const auto mix = [&](float x, float y, float z) {
      return static_cast<float>(weights[0] * x + weights[1] * y + weights[2] * z);
    };
    const Vec2f um{mix(ua.x, ub.x, uc.x), mix(ua.y, ub.y, uc.y)};
    uv[at(n)] = ub;
    uv[at(n + 1)] = uc;
    uv[at(k)] = uc;
    uv[at(k + 1)] = ua;
    uv[at(n + 2)] = uv[at(k + 2)] = uv[at(h2)] = um;
  }
  w.wall[at(h1)] = w.wall[at(h2)] = 0;
  w.origin[at(h2)] = m;
  connect(w, h1, n + 2);      // b -> m, m -> b
  connect(w, n + 1, k + 2);   // c -> m, m -> c
  connect(w, k + 1, h2);      // a -> m, m -> a
  w.outgoing.push_back(h2);
  return m;
}

std::int32_t find_half_edge(const WalledSurface& s, std::int32_t a, std::int32_t b) {
  const std::int32_t start = s.outgoing[at(a)];
  std::int32_t h = start;
  do {
    if (s.to(h) == b) return h;
    h = ccw(s, h);
  } while (h >= 0 && h != start);
  if (h == start) return -1;
  for (h = cw(s, start); h >= 0; h = cw(s, h))
    if (s.to(h) == b) return h;
  return -1;
}

std::int32_t fan_start(const WalledSurface& s, std::int32_t v) {
  const std::int32_t start = s.outgoing[at(v)];
  for (std::int32_t h = start;;) {
    const std::int32_t c = cw(s, h);
    if (c < 0 || c == start) return h;
    h = c;
  }
}

void mark_wall(WalledSurface& s, std::int32_t h) {
  s.wall[at(h)] = 1;
  if (s.opposite(h) >= 0) s.wall[at(s.opposite(h))] = 1;
  s.wall_vertex[at(s.from(h))] = s.wall_vertex[at(s.to(h))] = 1;
}

}  // namespace kerf
