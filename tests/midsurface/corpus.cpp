#include "midsurface/corpus.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "kerf/base/random.h"
#include "kerf/mesh/models.h"

namespace kerf::corpus {
namespace {

constexpr double kPi = std::numbers::pi;

void quad(TriangleMesh& mesh, std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) {
  mesh.triangles.push_back({VertexId(a), VertexId(b), VertexId(c)});
  mesh.triangles.push_back({VertexId(a), VertexId(c), VertexId(d)});
}

Vec3 normal_at(const ThickSheet& s, double u, double v) {
  constexpr double e = 1e-5;
  const auto clamp = [](double x, bool closed) { return closed ? x : std::fmin(1, std::fmax(0, x)); };
  const Vec3 du = s.middle(clamp(u + e, s.closed_u), v) - s.middle(clamp(u - e, s.closed_u), v);
  const Vec3 dv = s.middle(u, clamp(v + e, s.closed_v)) - s.middle(u, clamp(v - e, s.closed_v));
  return normalized(cross(du, dv));
}

}  // namespace

TriangleMesh thicken(const ThickSheet& s) {
  TriangleMesh mesh;
  const int pu = s.closed_u ? s.nu : s.nu + 1, pv = s.closed_v ? s.nv : s.nv + 1;
  const auto wrap = [](int i, int n, bool closed) { return closed ? (i % n + n) % n : i; };
  const auto point = [&](int i, int j) { return wrap(i, s.nu, s.closed_u) * pv + wrap(j, s.nv, s.closed_v); };
  const auto there = [&](int i, int j) {
    if (!s.closed_u && (i < 0 || i >= s.nu)) return false;
    if (!s.closed_v && (j < 0 || j >= s.nv)) return false;
    return !s.hole || !s.hole(wrap(i, s.nu, s.closed_u), wrap(j, s.nv, s.closed_v));
  };
  std::vector<std::array<std::int32_t, 2>> side(static_cast<std::size_t>(pu * pv), {-1, -1});
  std::vector<Vec3> middle(side.size()), normal(side.size());
  for (int i = 0; i < pu; ++i)
    for (int j = 0; j < pv; ++j) {
      if (!there(i, j) && !there(i - 1, j) && !there(i, j - 1) && !there(i - 1, j - 1)) continue;
      const auto p = static_cast<std::size_t>(point(i, j));
      const double u = static_cast<double>(i) / s.nu, v = static_cast<double>(j) / s.nv;
      middle[p] = s.middle(u, v);
      normal[p] = normal_at(s, u, v);
      for (std::size_t k = 0; k < 2; ++k)
        side[p][k] = mesh.positions.push_back(middle[p] + (k == 0 ? 1 : -1) * s.half(u, v) * normal[p]).value;
    }
  // Border edges, the region on their left, and the mean outward direction at their ends.
  std::vector<std::array<std::int32_t, 2>> border;
  std::vector<Vec3> outward(side.size());
  for (int i = 0; i < s.nu; ++i)
    for (int j = 0; j < s.nv; ++j) {
      if (!there(i, j)) continue;
      const std::int32_t c[4] = {point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)};
      const int di[4] = {0, 1, 0, -1}, dj[4] = {-1, 0, 1, 0};
      const auto v = [&](int k, std::size_t which) { return side[static_cast<std::size_t>(c[k % 4])][which]; };
      // Diagonals that alternate, so that no direction is preferred.
      const int t = (i + j) % 2;
      quad(mesh, v(t, 0), v(t + 1, 0), v(t + 2, 0), v(t + 3, 0));
      quad(mesh, v(t, 1), v(t + 3, 1), v(t + 2, 1), v(t + 1, 1));
      for (int k = 0; k < 4; ++k) {
        if (there(i + di[k], j + dj[k])) continue;
        border.push_back({c[k], c[(k + 1) % 4]});
        const auto a = static_cast<std::size_t>(c[k]), b = static_cast<std::size_t>(c[(k + 1) % 4]);
        const Vec3 out = normalized(cross(middle[b] - middle[a], normal[a]));
        outward[a] += out;
        outward[b] += out;
      }
    }
  std::map<std::pair<std::int32_t, int>, std::int32_t> ring;
  const auto wall = [&](std::int32_t p, int row) {
    const auto i = static_cast<std::size_t>(p);
    if (row == 0) return side[i][0];
    if (row == s.wall_rows) return side[i][1];
    const auto [at, added] = ring.try_emplace({p, row}, -1);
    if (added) {
      const Vec3 top = mesh.positions[VertexId(side[i][0])], bottom = mesh.positions[VertexId(side[i][1])];
      const double f = static_cast<double>(row) / s.wall_rows, h = 0.5 * norm(top - bottom);
      Vec3 q = lerp(top, bottom, f);
      if (s.round_rim) q = middle[i] + h * (std::cos(f * kPi) * normal[i] + std::sin(f * kPi) * normalized(outward[i]));
      at->second = mesh.positions.push_back(q).value;
    }
    return at->second;
  };
  for (const auto& e : border)
    for (int row = 0; row < s.wall_rows; ++row)
      quad(mesh, wall(e[1], row), wall(e[0], row), wall(e[0], row + 1), wall(e[1], row + 1));
  return mesh;
}

std::vector<Vec3> sample_middle(const ThickSheet& s) {
  std::vector<Vec3> out;
  const int fine = 8;
  for (int i = 0; i <= fine * s.nu; ++i)
    for (int j = 0; j <= fine * s.nv; ++j) {
      const int qi = std::min(i / fine, s.nu - 1), qj = std::min(j / fine, s.nv - 1);
      if (s.hole && s.hole(qi, qj)) continue;
      out.push_back(s.middle(static_cast<double>(i) / (fine * s.nu), static_cast<double>(j) / (fine * s.nv)));
    }
  return out;
}

TriangleMesh closed_tube(int nu, int nv, const std::function<Vec3(double, double)>& point) {
  TriangleMesh mesh;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j)
      mesh.positions.push_back(point(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const int i1 = (i + 1) % nu, j1 = (j + 1) % nv;
      quad(mesh, i * nv + j, i1 * nv + j, i1 * nv + j1, i * nv + j1);
    }
  return mesh;
}

TriangleMesh turned(int around, int along, const std::function<Vec2(double)>& profile) {
  TriangleMesh mesh;
  mesh.positions.push_back({0, 0, profile(0).y});
  for (int k = 1; k < along; ++k)
    for (int i = 0; i < around; ++i) {
      const Vec2 p = profile(static_cast<double>(k) / along);
      const double a = 2 * kPi * i / around;
      mesh.positions.push_back({p.x * std::cos(a), p.x * std::sin(a), p.y});
    }
  const std::int32_t last = mesh.positions.push_back({0, 0, profile(1).y}).value;
  const auto at = [&](int k, int i) { return 1 + (k - 1) * around + i % around; };
  for (int i = 0; i < around; ++i) {
    mesh.triangles.push_back({VertexId(0), VertexId(at(1, i + 1)), VertexId(at(1, i))});
    mesh.triangles.push_back({VertexId(last), VertexId(at(along - 1, i)), VertexId(at(along - 1, i + 1))});
    for (int k = 1; k + 1 < along; ++k) quad(mesh, at(k, i), at(k, i + 1), at(k + 1, i + 1), at(k + 1, i));
  }
  return mesh;
}

TriangleMesh voxels(const std::vector<std::string>& rows, int columns, double size, int n) {
  // rows: layer after layer (z), each `rows.size() / layers` strings; a '|' alone starts a new layer.
  std::vector<std::vector<std::string>> layers(1);
  for (const std::string& r : rows) {
    if (r == "|") layers.emplace_back();
    else layers.back().push_back(r);
  }
  const auto filled = [&](int x, int y, int z) {
    if (z < 0 || z >= static_cast<int>(layers.size())) return false;
    const auto& layer = layers[static_cast<std::size_t>(z)];
    if (y < 0 || y >= static_cast<int>(layer.size()) || x < 0 || x >= columns) return false;
    return layer[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '#';
  };
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::int32_t> ids;
  const auto vertex = [&](std::array<int, 3> p) {
    const auto [at, added] = ids.try_emplace(p, -1);
    if (added) {
      const double s = size / n;
      at->second = mesh.positions.push_back({s * p[0], s * p[1], s * p[2]}).value;
    }
    return at->second;
  };
  for (int z = 0; z < static_cast<int>(layers.size()); ++z)
    for (int y = 0; y < static_cast<int>(layers[static_cast<std::size_t>(z)].size()); ++y)
      for (int x = 0; x < columns; ++x) {
        if (!filled(x, y, z)) continue;
        for (int axis = 0; axis < 3; ++axis)
          for (const int way : {-1, 1}) {
            int to[3] = {x, y, z};
            to[axis] += way;
            if (filled(to[0], to[1], to[2])) continue;
            const int a1 = (axis + 1) % 3, a2 = (axis + 2) % 3;
            for (int i = 0; i < n; ++i)
              for (int j = 0; j < n; ++j) {
                const auto corner = [&](int di, int dj) {
                  std::array<int, 3> p{n * x, n * y, n * z};
                  p[static_cast<std::size_t>(axis)] += way > 0 ? n : 0;
                  p[static_cast<std::size_t>(a1)] += i + di;
                  p[static_cast<std::size_t>(a2)] += j + dj;
                  return vertex(p);
                };
                if (way > 0) quad(mesh, corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
                else quad(mesh, corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0));
              }
          }
      }
  return mesh;
}

void rotate(TriangleMesh& mesh, std::uint64_t seed) {
  Random random(seed);
  const Vec3 axis = normalized({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  const double a = random.uniform(0, 2 * kPi), c = std::cos(a), s = std::sin(a);
  for (Vec3& p : mesh.positions) p = c * p + s * cross(axis, p) + (1 - c) * dot(axis, p) * axis;
}

void scale(TriangleMesh& mesh, double factor) {
  for (Vec3& p : mesh.positions) p = factor * p;
}

void shuffle(TriangleMesh& mesh, std::uint64_t seed) {
  Random random(seed);
  const auto n = mesh.positions.size();
  std::vector<std::int32_t> to(n);
  for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<std::int32_t>(i);
  for (std::size_t i = n; i-- > 1;)
    std::swap(to[i], to[static_cast<std::size_t>(random.index(static_cast<int>(i + 1)))]);
  TriangleMesh out;
  out.positions.resize(n);
  for (std::size_t i = 0; i < n; ++i) out.positions[VertexId(to[i])] = mesh.positions[VertexId(i)];
  out.triangles = mesh.triangles;
  auto& t = out.triangles.raw();
  for (auto& f : t) {
    for (VertexId& v : f) v = VertexId(to[v.index()]);
    const int turn = random.index(3);
    f = {f[static_cast<std::size_t>(turn)], f[static_cast<std::size_t>((turn + 1) % 3)],
         f[static_cast<std::size_t>((turn + 2) % 3)]};
  }
  for (std::size_t i = t.size(); i-- > 1;)
    std::swap(t[i], t[static_cast<std::size_t>(random.index(static_cast<int>(i + 1)))]);
  mesh = std::move(out);
}

void shake(TriangleMesh& mesh, double length, std::uint64_t seed) {
  Random random(seed);
  for (Vec3& p : mesh.positions)
    p += (length / std::sqrt(3.0)) * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

void add_spikes(TriangleMesh& mesh, int count, double height, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vec3> normal(mesh.positions.size());
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.positions[t[0]];
    for (const VertexId v : t) normal[v.index()] += cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
  }
  for (int i = 0; i < count; ++i) {
    const int v = random.index(static_cast<int>(normal.size()));
    mesh.positions[VertexId(v)] += height * normalized(normal[static_cast<std::size_t>(v)]);
  }
}

TriangleMesh subdivided(const TriangleMesh& mesh) {
  TriangleMesh out;
  out.positions = mesh.positions;
  std::map<std::pair<std::int32_t, std::int32_t>, VertexId> middles;
  const auto middle = [&](VertexId a, VertexId b) {
    const auto [at, added] = middles.try_emplace(std::minmax(a.value, b.value), VertexId());
    if (added) at->second = out.positions.push_back(0.5 * (mesh.positions[a] + mesh.positions[b]));
    return at->second;
  };
  for (const auto& t : mesh.triangles) {
    const VertexId m[3] = {middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    out.triangles.push_back({t[0], m[0], m[2]});
    out.triangles.push_back({m[0], t[1], m[1]});
    out.triangles.push_back({m[2], m[1], t[2]});
    out.triangles.push_back({m[0], m[1], m[2]});
  }
  return out;
}

namespace {

ThickSheet plate(double lx, double ly, double thickness, int nu, int nv) {
  ThickSheet s;
  s.nu = nu;
  s.nv = nv;
  s.middle = [=](double u, double v) { return Vec3{lx * (u - 0.5), ly * (v - 0.5), 0}; };
  s.half = [=](double, double) { return 0.5 * thickness; };
  return s;
}

/// A plane curve by its turning angle along x, extruded along y.
ThickSheet extruded(double length, double width, double thickness, int nu, int nv,
                    const std::function<double(double)>& angle) {
  ThickSheet s = plate(length, width, thickness, nu, nv);
  std::vector<Vec2> points{{0, 0}};
  constexpr int kFine = 8000;
  for (int i = 0; i < kFine; ++i) {
    const double a = angle((i + 0.5) / kFine);
    points.push_back(points.back() + (length / kFine) * Vec2{std::cos(a), std::sin(a)});
  }
  s.middle = [=](double u, double v) {
    const double x = std::fmin(1, std::fmax(0, u)) * kFine;
    const auto i = std::min<std::size_t>(static_cast<std::size_t>(x), kFine - 1);
    const Vec2 p = lerp(points[i], points[i + 1], x - static_cast<double>(i));
    return Vec3{p.x, width * (v - 0.5), p.y};
  };
  return s;
}

/// Square parameters onto a disc, smooth inside.
Vec2 disc(double u, double v) {
  const double x = 2 * u - 1, y = 2 * v - 1;
  return {x * std::sqrt(1 - 0.5 * y * y), y * std::sqrt(1 - 0.5 * x * x)};
}

class Collector {
 public:
  std::vector<Body> bodies;

  Body& sheet(const std::string& name, const ThickSheet& s, std::int64_t euler = 1, int loops = 1) {
    Body b;
    b.name = name;
    b.mesh = thicken(s);
    b.euler = euler;
    b.loops = loops;
    b.middle = sample_middle(s);
    bodies.push_back(std::move(b));
    return bodies.back();
  }
  Body& thin(const std::string& name, TriangleMesh mesh, std::int64_t euler = 1, int loops = 1) {
    Body b;
    b.name = name;
    b.mesh = std::move(mesh);
    b.euler = euler;
    b.loops = loops;
    bodies.push_back(std::move(b));
    return bodies.back();
  }
  Body& thick(const std::string& name, TriangleMesh mesh) {
    Body& b = thin(name, std::move(mesh));
    b.thin = false;
    return b;
  }
};

void add_thin(Collector& c) {
  const ThickSheet slab = plate(0.2, 0.16, 0.02, 40, 32);
  c.sheet("slab", slab);
  c.sheet("slab of 12 triangles", [] {
    ThickSheet s = plate(0.2, 0.16, 0.02, 1, 1);
    s.wall_rows = 1;
    return s;
  }());
  ThickSheet s = slab;
  s.round_rim = true;
  s.wall_rows = 6;
  c.sheet("slab with a round rim", s);
  s = plate(0.16, 0.16, 0.05, 24, 24);
  s.wall_rows = 6;
  c.sheet("stout slab", s);
  s = extruded(0.2, 0.1, 0.01, 60, 24, [](double u) { return 2.0 * u; });
  c.sheet("bent", s);
  s = extruded(0.3, 0.08, 0.01, 90, 20, [](double u) { return u < 0.5 ? 4 * u : 4 * (1 - u); });
  c.sheet("S", s);
  s = extruded(0.3, 0.08, 0.01, 100, 20, [](double u) { return u < 0.4 ? 0 : u > 0.6 ? kPi : kPi * (u - 0.4) / 0.2; });
  c.sheet("hairpin", s);
  s = plate(0.2, 0.15, 0.02, 60, 45);
  s.half = [](double u, double v) { return 0.01 + 0.003 * std::sin(9 * u) * std::cos(7 * v); };
  s.middle = [](double u, double v) {
    const Vec2 p = disc(u, v);
    return Vec3{0.1 * p.x * (1 + 0.2 * std::sin(3 * std::atan2(p.y, p.x))), 0.075 * p.y,
                0.006 * std::sin(20 * p.x * 0.1 + 30 * p.y * 0.075)};
  };
  c.sheet("bumpy steak", s);
  s = plate(0.2, 0.12, 0.02, 40, 24);
  s.half = [](double u, double) { return 0.0005 + 0.012 * u; };
  c.sheet("wedge", s);
  s = slab;
  s.hole = [](int i, int j) {
    return (i >= 6 && i < 14 && j >= 8 && j < 20) || (i >= 24 && i < 32 && j >= 10 && j < 24);
  };
  c.sheet("two holes", s, -1, 3);
  s.hole = [](int i, int j) { return i >= 12 && i < 28 && j >= 8 && j < 24; };
  c.sheet("frame", s, 0, 2);
  s = plate(0.1, 0.1, 0.004, 80, 30);
  s.closed_u = true;
  s.middle = [](double u, double v) {
    return Vec3{0.03 * std::cos(2 * kPi * u), 0.03 * std::sin(2 * kPi * u), 0.1 * v};
  };
  c.sheet("tube", s, 0, 2);
  s = plate(0.1, 0.1, 0.004, 40, 40);
  s.middle = [](double u, double v) {
    const Vec2 p = disc(u, v);
    const double r = norm(p), a = 1.2 * r;
    const Vec2 d = r > 0 ? (1 / r) * p : Vec2{};
    return 0.05 * Vec3{std::sin(a) * d.x, std::sin(a) * d.y, 1 - std::cos(a)};
  };
  c.sheet("bowl", s);
  s = plate(0.1, 0.05, 0.006, 80, 20);
  s.middle = [](double u, double v) {
    const double a = 2.5 * (u - 0.5), r = 0.06 * (v - 0.5);
    return Vec3{0.15 * u, r * std::cos(a), r * std::sin(a)};
  };
  c.sheet("helicoid", s);
  s = plate(0.1, 0.1, 0.004, 160, 16);
  s.closed_u = true;
  s.middle = [](double u, double v) {
    const double a = 2 * kPi * u, w = 0.03 * (v - 0.5), r = 0.05 + w * std::cos(a);
    return Vec3{r * std::cos(a), r * std::sin(a), w * std::sin(a)};
  };
  c.sheet("ring with a full twist", s, 0, 2);
  s = plate(0.24, 0.1, 0.01, 48, 20);
  s.hole = [](int i, int j) { return i >= 18 && i < 30 && (j < 6 || j >= 14); };
  c.sheet("dumbbell", s);
  c.sheet("strip 50 to 1", plate(0.5, 0.01, 0.002, 250, 5));
  c.sheet("skin 200 to 1", plate(0.2, 0.2, 0.001, 50, 50));
  s = plate(1, 1, 0.004, 60, 30);
  s.closed_u = true;
  s.middle = [](double u, double v) {
    const double a = 2 * kPi * u, b = 2 * kPi * v;
    return Vec3{(0.05 + 0.02 * std::cos(b)) * std::cos(a), (0.05 + 0.02 * std::cos(b)) * std::sin(a),
                0.02 * std::sin(b)};
  };
  s.closed_v = true;
  c.sheet("hollow torus", s, 0, 0);
  s = plate(0.1, 0.1, 0.008, 60, 24);
  s.closed_u = true;
  s.middle = [](double u, double v) {
    const double a = 2 * kPi * u, r = 0.02 + 0.06 * v;
    return Vec3{r * std::cos(a), r * std::sin(a), 0};
  };
  c.sheet("washer", s, 0, 2);
  s.middle = [](double u, double v) {
    const double a = 2 * kPi * u, r = 0.02 + 0.06 * v;
    return Vec3{r * std::cos(a), r * std::sin(a), 0.05 * v};
  };
  c.sheet("cone", s, 0, 2);
  s = plate(0.1, 0.1, 0.008, 80, 40);
  s.closed_u = true;
  s.middle = [](double u, double v) {
    const double a = 2 * kPi * u, b = 0.1 + 1.4 * v;
    return 0.03 * Vec3{std::cos(a) * std::sin(b), std::sin(a) * std::sin(b), std::cos(b)};
  };
  c.sheet("dome with a hole narrower than it is thick", s, 0, 2).middle.clear();
  s = plate(0.12, 0.12, 0.006, 48, 48);
  s.middle = [](double u, double v) {
    const double x = 0.12 * (u - 0.5), y = 0.12 * (v - 0.5);
    return Vec3{x, y, 6 * (x * x - y * y)};
  };
  c.sheet("saddle", s);
  s.middle = [](double u, double v) {
    const double x = 0.12 * (u - 0.5), y = 0.12 * (v - 0.5);
    return Vec3{x, y, 0.008 * std::sin(60 * x) * std::sin(60 * y)};
  };
  c.sheet("egg box", s);
  s = extruded(0.3, 0.06, 0.006, 120, 16, [](double u) { return 9.0 * std::sqrt(0.1 + 0.9 * u); });
  c.sheet("spiral", s).middle.clear();
  // The middle of a tray with sharp creases is known only away from them.
  s = extruded(0.2, 0.1, 0.008, 60, 24, [](double u) { return u < 0.3 ? -1.2 : u > 0.7 ? 1.2 : 0.0; });
  c.sheet("folded sheet with two creases", s).middle.clear();
  // Sharp inside and outside: as thick on both sides of a crease as elsewhere.
  s = extruded(0.1, 0.06, 0.003, 16, 12, [](double u) { return u < 0.5 ? 0.9599 : -0.9599; });
  s.half = [](double u, double) { return 0.0015 / (std::fabs(u - 0.5) < 1e-6 ? std::cos(0.9599) : 1); };
  c.sheet("roof that turns by 110 degrees", s).middle.clear();
  s = extruded(0.1, 0.08, 0.003, 20, 20, [](double u) { return u < 0.3 ? kPi / 2 : u < 0.7 ? 0 : -kPi / 2; });
  s.half = [](double u, double) {
    return 0.0015 / (std::fabs(std::fabs(u - 0.5) - 0.2) < 1e-6 ? std::cos(kPi / 4) : 1);
  };
  c.sheet("U channel", s).middle.clear();
  s = plate(0.2, 0.16, 0.02, 80, 64);
  s.half = [](double u, double v) { return std::hypot(u - 0.5, v - 0.5) < 0.2 ? 0.015 : 0.009; };
  c.sheet("plate with a boss", s).middle.clear();

  s = plate(0.1, 0.06, 0.002, 100, 60);
  s.hole = [](int i, int j) { return j >= 18 && i % 10 >= 5; };
  c.sheet("comb", s).middle.clear();
  // As segmented images come: steps of 90 degrees, and flat in between.
  std::vector<std::string> layers;
  for (int z = 0; z < 24; ++z) {
    if (z > 0) layers.emplace_back("|");
    for (int y = 0; y < 36; ++y) {
      std::string row;
      for (int x = 0; x < 48; ++x) row += std::fabs(z - 4 - 0.25 * x - 0.1 * y) < 3.2 ? '#' : '.';
      layers.push_back(row);
    }
  }
  c.thin("slanted slab of voxels", voxels(layers, 48, 0.001, 1));

  TriangleMesh shell = turned(48, 24, [](double t) {
    return Vec2{0.05 * std::sin(kPi * t), -0.05 * std::cos(kPi * t)};
  });
  const TriangleMesh inside = turned(48, 24, [](double t) {
    return Vec2{0.044 * std::sin(kPi * t), -0.044 * std::cos(kPi * t)};
  });
  const auto offset = static_cast<std::int32_t>(shell.positions.size());
  for (const Vec3 p : inside.positions) shell.positions.push_back(p);
  for (const auto& t : inside.triangles)
    shell.triangles.push_back(
        {VertexId(offset + t[0].value), VertexId(offset + t[2].value), VertexId(offset + t[1].value)});
  c.thin("hollow sphere", shell, 2, 0);
  c.thin("flat ellipsoid", turned(64, 32, [](double t) {
           return Vec2{0.1 * std::sin(kPi * t), -0.02 * std::cos(kPi * t)};
         }));
  c.thin("ellipsoid 3 to 1", turned(64, 32, [](double t) {
           return Vec2{0.03 * std::sin(kPi * t), -0.01 * std::cos(kPi * t)};
         }));
  c.thin("lens 3 to 1", turned(64, 32, [](double t) {  // two spherical caps of radius 5/3 of the lens's
           const double a = 0.6435011087932844 * (1 - std::fabs(1 - 2 * t)), r = 0.05;
           return Vec2{r * std::sin(a), (t < 0.5 ? -1 : 1) * (r * std::cos(a) - 0.04)};
         }));
  c.thin("coin", turned(60, 30, [](double t) {
           const double s3 = 3 * t;
           return s3 < 1   ? Vec2{0.03 * s3, -0.004}
                  : s3 < 2 ? Vec2{0.03, -0.004 + 0.008 * (s3 - 1)}
                           : Vec2{0.03 * (3 - s3), 0.004};
         }));
  // A tray: a box open at the top, sharp edges.
  c.thin("tray",
         voxels({"######", "######", "######", "######", "######", "######", "|",      "######", "#....#", "#....#",
                 "#....#", "#....#", "######", "|",      "######", "#....#", "#....#", "#....#", "#....#", "######"},
                6, 0.01, 5))
      .triangles = 300;
  c.thin("L profile", voxels({"######", "######", "######", "######", "|", "#.....", "#.....", "#.....", "#.....", "|",
                              "#.....", "#.....", "#.....", "#.....", "|", "#.....", "#.....", "#.....", "#....."},
                             6, 0.01, 5));

  for (const char* model : {"steak", "meniscus", "holed-slab", "two-holed-slab", "half-shell", "s-shape"}) {
    const auto made = make_model(model, {});
    if (!made.ok()) continue;
    const bool one = std::string(model) == "holed-slab", two = std::string(model) == "two-holed-slab";
    c.thin("model " + std::string(model), made->visual, one ? 0 : two ? -1 : 1, one ? 2 : two ? 3 : 1);
  }
}

void add_variants(Collector& c) {
  const std::vector<Body> clean = c.bodies;
  const auto find = [&](const std::string& name) {
    for (const Body& b : clean)
      if (b.name == name) return b;
    return Body{};
  };
  const auto variant = [&](const std::string& of, const std::string& what,
                           const std::function<void(TriangleMesh&)>& change) {
    Body b = find(of);
    b.name += ", " + what;
    b.middle.clear();
    change(b.mesh);
    c.bodies.push_back(std::move(b));
  };
  std::uint64_t seed = 1;
  for (const char* name : {"slab", "S", "model meniscus", "tube", "two holes", "bowl"}) {
    ++seed;
    variant(name, "rotated and shuffled", [&](TriangleMesh& m) {
      rotate(m, seed);
      shuffle(m, seed);
    });
  }
  variant("model meniscus", "in millimetres", [](TriangleMesh& m) { scale(m, 1000); });
  for (const char* name : {"slab", "bent", "tube", "model steak", "model meniscus"}) {
    ++seed;
    const double length = std::string(name) == "slab"             ? 1.5e-3
                          : std::string(name) == "model meniscus" ? 0.15e-3
                          : std::string(name) == "tube"           ? 0.3e-3
                                                                  : 0.8e-3;
    variant(name, "noisy", [&](TriangleMesh& m) {
      m = subdivided(m);
      shake(m, length, seed);
    });
  }
  variant("model steak", "with spikes", [](TriangleMesh& m) { add_spikes(m, 25, 0.03, 5); });
  variant("slab", "far from the origin", [](TriangleMesh& m) {
    for (Vec3& p : m.positions) p += {50, -30, 20};
  });
}

void add_thick(Collector& c) {
  const auto ball = [](double r, double h) {
    return [=](double t) { return Vec2{r * std::sin(kPi * t), -h * std::cos(kPi * t)}; };
  };
  c.thick("ball", turned(48, 24, ball(0.05, 0.05)));
  c.thick("egg", turned(48, 24, ball(0.05, 0.08)));
  c.thick("cigar", turned(32, 48, ball(0.02, 0.15)));
  c.thick("cube", voxels({"#"}, 1, 0.1, 12));
  c.thick("cube of 12 triangles", voxels({"#"}, 1, 0.1, 1));
  c.thick("rod", voxels({"#####"}, 5, 0.02, 5));
  c.thick("bar of 12 triangles", [] {
    ThickSheet s = plate(0.1, 0.004, 0.004, 1, 1);
    s.wall_rows = 1;
    return thicken(s);
  }());
  c.thick("solid torus", closed_tube(60, 24, [](double u, double v) {
            const double a = 2 * kPi * u, b = 2 * kPi * v, r = 0.05 + 0.02 * std::cos(b);
            return Vec3{r * std::cos(a), r * std::sin(a), 0.02 * std::sin(b)};
          }));
  c.thick(
      "trefoil knot", closed_tube(200, 16, [](double u, double v) {
        const auto at = [](double s) {
          const double a = 2 * kPi * s;
          return 0.02 * Vec3{std::sin(a) + 2 * std::sin(2 * a), std::cos(a) - 2 * std::cos(2 * a), -std::sin(3 * a)};
        };
        const Vec3 t = normalized(at(u + 1e-4) - at(u - 1e-4)), n = normalized(cross(t, {0, 0, 1})), b = cross(t, n);
        return at(u) + 0.007 * (std::cos(2 * kPi * v) * n + std::sin(2 * kPi * v) * b);
      }));
  c.thick(
      "cylinder", turned(48, 48, [](double t) {
        const double s = 4 * t;
        return s < 1 ? Vec2{0.03 * s, -0.06} : s < 3 ? Vec2{0.03, -0.06 + 0.06 * (s - 1)} : Vec2{0.03 * (4 - s), 0.06};
      }));
  c.thick("T beam", voxels({"######", "######", "######", "######", "######", "######", "|",      "..##..", "..##..",
                            "..##..", "..##..", "..##..", "..##..", "|",      "..##..", "..##..", "..##..", "..##..",
                            "..##..", "..##..", "|",      "..##..", "..##..", "..##..", "..##..", "..##..", "..##.."},
                           6, 0.01, 4));
  // Two thin plates that cross, and three that meet like a Y: each is thin, together they branch.
  c.thick(
      "cross of plates",
      voxels({".....#.....", ".....#.....", ".....#.....", ".....#.....", ".....#.....", "###########", ".....#.....",
              ".....#.....", ".....#.....", ".....#.....", ".....#.....", "|",           ".....#.....", ".....#.....",
              ".....#.....", ".....#.....", ".....#.....", "###########", ".....#.....", ".....#.....", ".....#.....",
              ".....#.....", ".....#.....", "|",           ".....#.....", ".....#.....", ".....#.....", ".....#.....",
              ".....#.....", "###########", ".....#.....", ".....#.....", ".....#.....", ".....#.....", ".....#.....",
              "|",           ".....#.....", ".....#.....", ".....#.....", ".....#.....", ".....#.....", "###########",
              ".....#.....", ".....#.....", ".....#.....", ".....#.....", ".....#....."},
             11, 0.01, 3));
  // A Moebius strip with thickness: one-sided.
  {
    const int nu = 120, nv = 12;
    const TriangleMesh strip = closed_tube(nu, 2 * nv, [&](double u, double v) {
      const double a = 2 * kPi * u, half = 0.5 * a, w = 0.02 * std::cos(2 * kPi * v), t = 0.002 * std::sin(2 * kPi * v);
      const Vec3 r{std::cos(a), std::sin(a), 0}, across = std::cos(half) * r + std::sin(half) * Vec3{0, 0, 1},
                                                 up = -std::sin(half) * r + std::cos(half) * Vec3{0, 0, 1};
      return 0.06 * r + w * across + t * up;
    });
    // After one turn the section has turned by half a turn: the seam joins v to v + 1/2.
    const int n = 2 * nv;
    TriangleMesh out;
    out.positions = strip.positions;
    for (int i = 0; i < nu; ++i)
      for (int j = 0; j < n; ++j) {
        const auto at = [&](int k, int l) {
          const int shift = k == nu ? nv : 0;
          return (k % nu) * n + (l + shift) % n;
        };
        quad(out, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    c.thick("Moebius strip", out);
  }
}

}  // namespace

std::vector<Body> bodies() {
  Collector c;
  add_thin(c);
  add_variants(c);
  add_thick(c);
  return std::move(c.bodies);
}

}  // namespace kerf::corpus
