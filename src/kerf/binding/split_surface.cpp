#include "kerf/binding/split_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "kerf/base/at.h"
#include "kerf/base/check.h"

namespace kerf {
namespace {

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
  for (const double c :
       {-0.0161657367, 0.0429096138, -0.0752896400, 0.1065626393, -0.1420889944, 0.1999355085, -0.3333314528, 1.0})
    p = p * q + c;
  const double acute = sine < size ? p * t : 0.5 * std::numbers::pi - p * t;
  return cosine < 0 ? std::numbers::pi - acute : acute;
}

Vec3f blended_normal(Vec3f a, Vec3f b, double t) { return to_float(normalized(lerp(to_double(a), to_double(b), t))); }

}  // namespace

std::vector<Vec3f> smooth_normals(std::span<const Vec3> positions,
                                  std::span<const std::array<std::int32_t, 3>> triangles, HalfEdgeRoom room) {
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
                                HalfEdgeArrays connected, std::vector<Vec3f> normals, std::vector<Vec2f> texture,
                                HalfEdgeRoom room) {
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
  if (!s.drawn_back.empty()) s.drawn_back.push_back(lerp(s.drawn_back[at(a)], s.drawn_back[at(b)], t));
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
  const auto length = [&](std::int32_t h) { return norm(w.at(w.to(h)) - w.at(w.from(h))); };
  struct Long {
    double length;
    std::int32_t h;
  };
  const std::size_t before = s.parent.size();
  for (std::vector<Long> edges; s.parent.size() < most_faces; edges.clear()) {
    for (std::int32_t h = 0; h < static_cast<std::int32_t>(w.origin.size()); ++h)
      if (w.opposite(h) < h && length(h) > limit) edges.push_back({length(h), h});
    if (edges.empty()) break;
    std::sort(edges.begin(), edges.end(),
              [](const Long& x, const Long& y) { return x.length != y.length ? x.length > y.length : x.h < y.h; });
    // A split before this one may have changed which edge the number stands for.
    for (const Long& e : edges)
      if (s.parent.size() < most_faces && length(e.h) > limit) split_edge(s, e.h, 0.5);
  }
  if (s.parent.size() == before) return false;
  make_own_parents(s);
  return true;
}

void make_own_parents(SplitSurface& s) {
  std::vector<std::int32_t> input(s.parent.size());
  for (std::size_t f = 0; f < input.size(); ++f) input[f] = s.input_face(static_cast<std::int32_t>(f));
  s.input = std::move(input);
  if (!s.flat.empty()) {
    std::vector<std::uint8_t> flat(s.parent.size());
    for (std::size_t f = 0; f < flat.size(); ++f) flat[f] = s.flat[at(s.parent[f])];
    s.flat = std::move(flat);
  }
  std::iota(s.parent.begin(), s.parent.end(), 0);
}

void flip_edge(SplitSurface& s, std::int32_t h) {
  WalledSurface& w = s.walled;
  const std::int32_t g = w.opposite(h), hn = WalledSurface::next(h), hp = WalledSurface::prev(h),
                     gn = WalledSurface::next(g), gp = WalledSurface::prev(g);
  const std::int32_t a = w.from(h), b = w.to(h), c = w.from(hp), d = w.from(gp);
  // (a, b, c) and (b, a, d) become (d, c, a) and (c, d, b).
  const std::array<std::int32_t, 4> outer{w.opposite(hp), w.opposite(gn), w.opposite(gp),
                                          w.opposite(hn)};  // of c-a, a-d, d-b, b-c
  if (!s.texture.empty()) {
    const Vec2f ua = s.texture[at(h)], ub = s.texture[at(g)], uc = s.texture[at(hp)], ud = s.texture[at(gp)];
    s.texture[at(h)] = s.texture[at(gn)] = ud;
    s.texture[at(hn)] = s.texture[at(g)] = uc;
    s.texture[at(hp)] = ua;
    s.texture[at(gp)] = ub;
  }
  w.origin[at(h)] = w.origin[at(gn)] = d;
  w.origin[at(hn)] = w.origin[at(g)] = c;
  w.origin[at(hp)] = a;
  w.origin[at(gp)] = b;
  connect(w, hn, outer[0]);
  connect(w, hp, outer[1]);
  connect(w, gn, outer[2]);
  connect(w, gp, outer[3]);
  w.outgoing[at(a)] = hp;
  w.outgoing[at(b)] = gp;
  w.outgoing[at(c)] = hn;
  w.outgoing[at(d)] = gn;
}

std::int32_t split_face(SplitSurface& s, std::int32_t f, std::array<double, 3> weights) {
  KERF_ASSERT(s.upright.empty());
  WalledSurface& w = s.walled;
  const std::int32_t h0 = 3 * f, h1 = h0 + 1, h2 = h0 + 2;
  const std::int32_t a = w.from(h0), b = w.from(h1), c = w.from(h2);
  const std::int32_t m = s.vertex_count();
  // Relative to corner a: a far origin must not cost digits.
  w.position.push_back(w.at(a) + (weights[1] * (w.at(b) - w.at(a)) + weights[2] * (w.at(c) - w.at(a))));
  if (const auto& back = s.drawn_back; !back.empty())
    s.drawn_back.push_back(weights[0] * back[at(a)] + weights[1] * back[at(b)] + weights[2] * back[at(c)]);
  s.normal.push_back(
      to_float(normalized(weights[0] * to_double(s.normal[at(a)]) + weights[1] * to_double(s.normal[at(b)]) +
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
  connect(w, h1, n + 2);     // b -> m, m -> b
  connect(w, n + 1, k + 2);  // c -> m, m -> c
  connect(w, k + 1, h2);     // a -> m, m -> a
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
