// The generated models against counts, closed forms and brute force.
#include "kerf/mesh/models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "kerf/mesh/half_edge_build.h"

namespace kerf::models_test {
namespace {

std::vector<std::array<std::int32_t, 3>> index_triangles(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> out;
  for (const auto& t : mesh.triangles) out.push_back({t[0].value, t[1].value, t[2].value});
  return out;
}

struct Topology {
  std::size_t border_edges = 0, loops = 0;
  std::ptrdiff_t euler = 0;
  std::vector<bool> on_border;
};

Topology topology(const TriangleMesh& mesh) {
  const auto triangles = index_triangles(mesh);
  const auto he = build_half_edges(triangles, mesh.positions.size());
  EXPECT_TRUE(he.ok()) << (he.ok() ? "" : he.error().message);
  Topology out;
  if (!he.ok()) return out;
  out.on_border.assign(mesh.positions.size(), false);
  for (const std::int32_t h : he->outgoing) EXPECT_GE(h, 0) << "unused vertex";
  std::map<std::int32_t, std::int32_t> next;
  for (std::size_t h = 0; h < he->twin.size(); ++h)
    if (he->twin[h] < 0) {
      next[triangles[h / 3][h % 3]] = triangles[h / 3][(h + 1) % 3];
      out.on_border[static_cast<std::size_t>(triangles[h / 3][h % 3])] = true;
    }
  out.border_edges = next.size();
  while (!next.empty()) {
    ++out.loops;
    for (auto it = next.begin(); it != next.end();) {
      const std::int32_t to = it->second;
      next.erase(it);
      it = next.find(to);
    }
  }
  const auto edges = (triangles.size() * 3 + out.border_edges) / 2;
  out.euler =
      static_cast<std::ptrdiff_t>(mesh.positions.size() + triangles.size()) - static_cast<std::ptrdiff_t>(edges);
  return out;
}

std::array<Vec3, 3> corners(const TriangleMesh& mesh, TriangleId f) {
  const auto& t = mesh.triangles[f];
  return {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
}

double volume(const TriangleMesh& mesh) {
  double six = 0;
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size())) {
    const auto [a, b, c] = corners(mesh, f);
    six += dot(a, cross(b, c));
  }
  return six / 6;
}

double area(const TriangleMesh& mesh) {
  double two = 0;
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size())) {
    const auto [a, b, c] = corners(mesh, f);
    two += norm(cross(b - a, c - a));
  }
  return two / 2;
}

double smallest_angle_degrees(const TriangleMesh& mesh) {
  double smallest = 180;
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size())) {
    const auto p = corners(mesh, f);
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 u = p[(i + 1) % 3] - p[i], v = p[(i + 2) % 3] - p[i];
      smallest = std::min(smallest, std::atan2(norm(cross(u, v)), dot(u, v)) * 180 / M_PI);
    }
  }
  return smallest;
}

/// Parameters t of all hits of the line p + t d with the mesh; with slack, also of triangles missed by rounding.
std::vector<double> line_hits(const TriangleMesh& mesh, Vec3 p, Vec3 d, double slack = 0) {
  std::vector<double> hits;
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size())) {
    const auto [a, b, c] = corners(mesh, f);
    const Vec3 e1 = b - a, e2 = c - a, q = cross(d, e2);
    const double det = dot(e1, q);
    if (std::abs(det) < 1e-30) continue;
    const Vec3 s = p - a;
    const double u = dot(s, q) / det;
    if (u < -slack || u > 1 + slack) continue;
    const Vec3 r = cross(s, e1);
    const double v = dot(d, r) / det;
    if (v < -slack || u + v > 1 + slack) continue;
    hits.push_back(dot(e2, r) / det);
  }
  return hits;
}

bool inside(const TriangleMesh& mesh, Vec3 p) {
  const Vec3 d{0.312345, 0.123987, 0.941771};  // no mesh is aligned with it
  const auto hits = line_hits(mesh, p, d);
  return std::count_if(hits.begin(), hits.end(), [](double t) { return t > 0; }) % 2 == 1;
}

double distance(Vec3 p, const std::array<Vec3, 3>& t) {
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  bool over = true;
  double best = HUGE_VAL;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 a = t[i], e = t[(i + 1) % 3] - a;
    if (dot(cross(e, p - a), n) < 0) over = false;
    const double s = std::clamp(dot(p - a, e) / dot(e, e), 0.0, 1.0);
    best = std::min(best, norm(p - (a + s * e)));
  }
  return over ? std::abs(dot(p - t[0], normalized(n))) : best;
}

double distance(Vec3 p, const TriangleMesh& mesh) {
  double best = HUGE_VAL;
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size()))
    best = std::min(best, distance(p, corners(mesh, f)));
  return best;
}

std::vector<Vec3> normals(const TriangleMesh& mesh) {
  std::vector<Vec3> n(mesh.positions.size());
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size())) {
    const auto p = corners(mesh, f);
    for (const VertexId v : mesh.triangles[f]) n[v.index()] += cross(p[1] - p[0], p[2] - p[0]);
  }
  for (Vec3& v : n) v = normalized(v);
  return n;
}

// --- Lattice layout of a flat body by polygon clipping: how full each cell of the hint is. ---

using Polygon = std::vector<Vec3>;  // x, y, and the half thickness as z

Polygon clip(const Polygon& in, int axis, double limit, double sign) {
  Polygon out;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Vec3 a = in[i], b = in[(i + 1) % in.size()];
    const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
    if (da >= 0) out.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) out.push_back(lerp(a, b, da / (da - db)));
  }
  return out;
}

struct Layout {
  std::size_t cells = 0, corners = 0;
  std::vector<double> fill;
};

/// Fill of every cell of the one-layer hint by the prisms of a flat collision mesh, and the layout without the cells
/// under 5 %.
Layout lattice_layout(const Model& model) {
  const LatticeHint& hint = model.lattice;
  Layout out;
  out.fill.assign(static_cast<std::size_t>(hint.cells[0] * hint.cells[1]), 0);
  for (const TriangleId f : ids<TriangleId>(model.collision.triangles.size())) {
    Polygon triangle;
    for (const VertexId v : model.collision.triangles[f]) {
      Vec3 p = model.collision.positions[v];
      EXPECT_EQ(p.z, 0);
      p.z = model.half_thickness[v.index()];
      EXPECT_GE(-p.z, hint.origin.z - 1e-12);
      EXPECT_LE(p.z, hint.origin.z + hint.cell.z + 1e-12);
      triangle.push_back(p);
    }
    for (int j = 0; j < hint.cells[1]; ++j)
      for (int i = 0; i < hint.cells[0]; ++i) {
        const double x = hint.origin.x + i * hint.cell.x, y = hint.origin.y + j * hint.cell.y;
        const Polygon p =
            clip(clip(clip(clip(triangle, 0, x, 1), 0, x + hint.cell.x, -1), 1, y, 1), 1, y + hint.cell.y, -1);
        for (std::size_t k = 1; k + 1 < p.size(); ++k) {
          const double two_areas =
              (p[k].x - p[0].x) * (p[k + 1].y - p[0].y) - (p[k].y - p[0].y) * (p[k + 1].x - p[0].x);
          out.fill[static_cast<std::size_t>(j * hint.cells[0] + i)] += two_areas * (p[0].z + p[k].z + p[k + 1].z) / 3;
        }
      }
  }
  for (double& v : out.fill) v /= hint.cell.x * hint.cell.y * hint.cell.z;
  std::vector<bool> corner(static_cast<std::size_t>((hint.cells[0] + 1) * (hint.cells[1] + 1)), false);
  for (int j = 0; j < hint.cells[1]; ++j)
    for (int i = 0; i < hint.cells[0]; ++i) {
      if (out.fill[static_cast<std::size_t>(j * hint.cells[0] + i)] < 0.05) continue;
      ++out.cells;
      for (int c = 0; c < 4; ++c)
        corner[static_cast<std::size_t>((j + c / 2) * (hint.cells[0] + 1) + i + c % 2)] = true;
    }
  out.corners = static_cast<std::size_t>(std::count(corner.begin(), corner.end(), true));
  return out;
}

Model make(std::string_view name, const ModelOptions& options = {}) {
  auto model = make_model(name, options);
  EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
  return model.ok() ? std::move(*model) : Model{};
}

void expect_sound_surface(const TriangleMesh& mesh) {
  for (const Vec3 p : mesh.positions) ASSERT_TRUE(is_finite(p));
  ASSERT_EQ(mesh.texture.size(), mesh.triangles.size());
  for (const auto& t : mesh.texture) {
    for (const Vec2f p : t) {
      ASSERT_GE(p.x, 0);
      ASSERT_LE(p.x, 1);
      ASSERT_GE(p.y, 0);
      ASSERT_LE(p.y, 1);
    }
    const float area = (t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[1].y - t[0].y) * (t[2].x - t[0].x);
    ASSERT_NE(area, 0);
  }
}

/// Every point of the texture square belongs to one triangle at most, tried on a grid of points.
void expect_texture_without_overlap(const TriangleMesh& mesh) {
  constexpr int kGrid = 701;
  std::vector<int> covered(kGrid * kGrid, 0);
  auto sample = [](int i) { return (i + 0.4871) / kGrid; };
  for (const auto& t : mesh.texture) {
    std::array<Vec2, 3> p;
    for (std::size_t c = 0; c < 3; ++c) p[c] = {t[c].x, t[c].y};
    const double area = cross(p[1] - p[0], p[2] - p[0]);
    auto low = [](double a, double b, double c) {
      return std::max(0, static_cast<int>(std::min({a, b, c}) * kGrid) - 1);
    };
    auto high = [](double a, double b, double c) {
      return std::min(kGrid - 1, static_cast<int>(std::max({a, b, c}) * kGrid) + 1);
    };
    for (int j = low(p[0].y, p[1].y, p[2].y); j <= high(p[0].y, p[1].y, p[2].y); ++j)
      for (int i = low(p[0].x, p[1].x, p[2].x); i <= high(p[0].x, p[1].x, p[2].x); ++i) {
        const Vec2 q{sample(i), sample(j)};
        bool in = true;
        for (std::size_t c = 0; c < 3; ++c) in = in && cross(p[(c + 1) % 3] - p[c], q - p[c]) / area > 1e-6;
        if (in) ++covered[static_cast<std::size_t>(j * kGrid + i)];
      }
  }
  EXPECT_LE(*std::max_element(covered.begin(), covered.end()), 1);
  const auto used = std::count(covered.begin(), covered.end(), 1);
  EXPECT_GT(static_cast<double>(used), 0.1 * kGrid * kGrid);
}

/// Volume of the prisms of the collision mesh.
double prism_volume(const Model& model) {
  double sum = 0;
  for (const TriangleId f : ids<TriangleId>(model.collision.triangles.size())) {
    const auto [a, b, c] = corners(model.collision, f);
    double half = 0;
    for (const VertexId v : model.collision.triangles[f]) half += model.half_thickness[v.index()] / 3;
    sum += norm(cross(b - a, c - a)) * half;
  }
  return sum;
}

/// All that holds for every model whose visual mesh has no noise.
void expect_sound(const Model& model) {
  expect_sound_surface(model.visual);
  expect_sound_surface(model.collision);
  const Topology visual = topology(model.visual), collision = topology(model.collision);
  ASSERT_EQ(model.half_thickness.size(), model.collision.positions.size());
  for (const double h : model.half_thickness) EXPECT_GT(h, 0);
  EXPECT_EQ(model.closed, visual.loops == 0);
  EXPECT_GT(collision.loops, 0U);
  EXPECT_GT(model.young, 0);
  EXPECT_GT(model.density, 0);
  EXPECT_GT(smallest_angle_degrees(model.collision), 15);
  EXPECT_GT(smallest_angle_degrees(model.visual), 8);
  expect_texture_without_overlap(model.visual);
  if (model.closed) {
    EXPECT_EQ(visual.euler, 2 * collision.euler);  // the thickened surface is two copies glued along the border
    EXPECT_GT(volume(model.visual), 0);
    const auto n = normals(model.collision);
    for (const VertexId v : ids<VertexId>(model.collision.positions.size())) {
      const Vec3 p = model.collision.positions[v];
      const double h = model.half_thickness[v.index()];
      if (collision.on_border[v.index()]) {
        EXPECT_LT(distance(p, model.visual), 0.15 * h) << "border vertex " << v.value;
      } else {
        EXPECT_TRUE(inside(model.visual, p)) << "vertex " << v.value;
        const auto hits = line_hits(model.visual, p, n[v.index()], 1e-9);
        double above = HUGE_VAL, below = HUGE_VAL;
        for (const double t : hits) (t > 0 ? above : below) = std::min(t > 0 ? above : below, std::abs(t));
        EXPECT_NEAR(above, h, 0.25 * h) << "vertex " << v.value;
        EXPECT_NEAR(below, h, 0.25 * h) << "vertex " << v.value;
      }
    }
  }
  // No triangle has two border edges: there a cut would have no room.
  const auto he = build_half_edges(index_triangles(model.collision), model.collision.positions.size());
  for (std::size_t f = 0; 3 * f < he->twin.size(); ++f)
    EXPECT_LE((he->twin[3 * f] < 0) + (he->twin[3 * f + 1] < 0) + (he->twin[3 * f + 2] < 0), 1) << "triangle " << f;
}

void expect_layout(const Model& model, std::size_t cells, std::size_t corners) {
  const Layout layout = lattice_layout(model);
  EXPECT_EQ(layout.cells, cells);
  EXPECT_EQ(layout.corners, corners);
  for (const double f : layout.fill) EXPECT_TRUE(f < 0.03 || f > 0.08) << f;
}

TEST(Models, OpenSheetHasThePapersCounts) {
  for (const auto& [vertices, triangles] :
       {std::pair{881U, 1664U}, std::pair{3425U, 6656U}, std::pair{13505U, 26624U}, std::pair{53633U, 106496U}}) {
    ModelOptions options;
    options.visual_triangles = triangles;
    const Model model = make("sheet", options);
    EXPECT_EQ(model.visual.positions.size(), vertices);
    EXPECT_EQ(model.visual.triangles.size(), triangles);
    EXPECT_EQ(topology(model.visual).euler, 1);
    EXPECT_NEAR(area(model.visual), 1, 1e-10);
  }
  for (const auto& [vertices, triangles, border] : {std::array{65U, 104U, 24U}, std::array{280U, 500U, 58U},
                                                    std::array{796U, 1500U, 90U}, std::array{3425U, 6656U, 192U}}) {
    ModelOptions options;
    options.collision_triangles = triangles;
    const Model model = make("sheet", options);
    expect_sound(model);
    EXPECT_EQ(model.collision.positions.size(), vertices);
    EXPECT_EQ(model.collision.triangles.size(), triangles);
    const Topology t = topology(model.collision);
    EXPECT_EQ(t.border_edges, border);
    EXPECT_EQ(t.euler, 1);
    EXPECT_NEAR(area(model.collision), 1, 1e-12);
    expect_layout(model, 81, 100);
    EXPECT_NEAR(model.density * 1 * 1 * 0.1, 1, 1e-12);  // 1 kg
  }
}

TEST(Models, ClosedSheet) {
  for (const std::size_t wanted : {500U, 3000U, 12345U})
    for (const std::size_t collision : {104U, 500U, 50U, 1250U}) {
      ModelOptions options;
      options.visual_triangles = wanted;
      options.collision_triangles = collision;
      const Model model = make("closed-sheet", options);
      expect_sound(model);
      EXPECT_NEAR(static_cast<double>(model.visual.triangles.size()), static_cast<double>(wanted),
                  4 * std::sqrt(static_cast<double>(wanted)));
      EXPECT_NEAR(volume(model.visual), 0.1, 1e-12);
      EXPECT_NEAR(area(model.visual), 2.4, 1e-12);
      expect_layout(model, 81, 100);
    }
  ModelOptions rounded;
  rounded.visual_triangles = 20000;
  rounded.rim_radius = 0.02;
  const Model model = make("closed-sheet", rounded);
  expect_sound(model);
  // Six square frusta: side 0.96 + 0.04 sin t at height 0.05 cos t, t in steps of 30 degrees.
  double exact = 0;
  for (int i = 0; i < 6; ++i) {
    const double t = M_PI * i / 6, u = M_PI * (i + 1) / 6;
    const double s = 0.96 + 0.04 * std::sin(t), r = 0.96 + 0.04 * std::sin(u);
    exact += (s * s + s * r + r * r) / 3 * 0.05 * (std::cos(t) - std::cos(u));
  }
  EXPECT_NEAR(volume(model.visual), exact, 1e-12);
}

TEST(Models, Steak) {
  for (const auto& [vertices, triangles] : {std::pair{50U, 67U}, std::pair{85U, 137U}}) {
    ModelOptions options;
    options.collision_triangles = triangles;
    const Model model = make("steak", options);
    expect_sound(model);
    EXPECT_EQ(model.visual.positions.size(), 2641U);
    EXPECT_EQ(model.visual.triangles.size(), 5278U);
    EXPECT_EQ(model.collision.positions.size(), vertices);
    EXPECT_EQ(model.collision.triangles.size(), triangles);
    EXPECT_EQ(topology(model.collision).border_edges, 31U);
    EXPECT_EQ(topology(model.collision).euler, 1);
    Box3 box;
    for (const Vec3 p : model.visual.positions) box.add(p);
    EXPECT_NEAR(box.size().x, 0.20, 1e-4);
    EXPECT_NEAR(box.size().y, 0.16, 1e-4);
    EXPECT_NEAR(box.size().z, 0.02, 1e-9);
    expect_layout(model, 76, 95);
  }
}

TEST(Models, Meniscus) {
  const Model model = make("meniscus");
  expect_sound(model);
  EXPECT_EQ(model.visual.positions.size(), 2882U);
  EXPECT_EQ(model.visual.triangles.size(), 5760U);
  EXPECT_EQ(model.collision.positions.size(), 105U);
  EXPECT_EQ(model.collision.triangles.size(), 160U);
  EXPECT_EQ(topology(model.collision).border_edges, 48U);
  EXPECT_EQ(topology(model.collision).euler, 1);
  Box3 box;
  for (const Vec3 p : model.visual.positions) box.add(p);
  EXPECT_NEAR(box.size().x, 0.045, 1e-4);
  EXPECT_NEAR(box.size().z, 0.004, 1e-12);
  const auto [low, high] = std::minmax_element(model.half_thickness.begin(), model.half_thickness.end());
  EXPECT_NEAR(2 * *low, 0.001, 1e-12);
  EXPECT_NEAR(2 * *high, 0.004, 1e-12);
  expect_layout(model, 42, 60);
}

TEST(Models, VolumesOfSteakAndMeniscus) {
  // The prisms of a coarse mesh leave out slivers between the chords and the outline.
  for (const std::string_view name : {"steak", "meniscus"}) {
    const Model model = make(name);
    EXPECT_NEAR(prism_volume(model) / volume(model.visual), 1, 0.05) << name;
  }
}

TEST(Models, HoledSlabs) {
  const Model one = make("holed-slab"), two = make("two-holed-slab");
  expect_sound(one);
  expect_sound(two);
  EXPECT_EQ(topology(one.collision).loops, 2U);
  EXPECT_EQ(topology(two.collision).loops, 3U);
  EXPECT_EQ(topology(one.visual).euler, 0);
  EXPECT_EQ(topology(two.visual).euler, -2);
  EXPECT_NEAR(volume(one.visual), (0.16 * 0.16 - 0.04 * 0.04) * 0.02, 1e-12);
  EXPECT_NEAR(volume(two.visual), (0.26 * 0.16 - 2 * 0.04 * 0.04) * 0.02, 1e-12);
  expect_layout(one, 60, 80);
  expect_layout(two, 96, 124);
}

TEST(Models, Tube) {
  for (const std::size_t wanted : {std::size_t{1300}, std::size_t{5000}}) {
    ModelOptions options;
    options.visual_triangles = wanted;
    const Model model = make("tube", options);
    expect_sound(model);
    EXPECT_EQ(topology(model.visual).euler, 0);
    EXPECT_EQ(topology(model.collision).euler, 0);
    EXPECT_EQ(topology(model.collision).loops, 2U);
    std::vector<double> angles;  // the outer wall is a prism over a regular polygon
    double outer = 0;
    for (const Vec3 p : model.visual.positions) outer = std::max(outer, std::hypot(p.x, p.z));
    EXPECT_NEAR(outer, 0.032, 1e-12);
    for (const Vec3 p : model.visual.positions)
      if (p.y == -0.05 && std::hypot(p.x, p.z) > outer - 1e-9) angles.push_back(std::atan2(p.x, p.z));
    const double n = static_cast<double>(angles.size());
    EXPECT_NEAR(volume(model.visual), 0.5 * n * std::sin(2 * M_PI / n) * (0.032 * 0.032 - 0.028 * 0.028) * 0.1, 1e-15);
    for (const TriangleId f : ids<TriangleId>(model.collision.triangles.size())) {  // + side outside
      const auto [a, b, c] = corners(model.collision, f);
      const Vec3 middle = (1.0 / 3) * (a + b + c);
      EXPECT_GT(dot(cross(b - a, c - a), {middle.x, 0, middle.z}), 0);
    }
  }
}

TEST(Models, HalfShell) {
  const Model model = make("half-shell");
  expect_sound(model);
  EXPECT_EQ(topology(model.visual).euler, 2);
  // A strip of length L bent about its middle surface keeps its volume (Pappus); polygons cut corners.
  EXPECT_NEAR(volume(model.visual), 0.16 * 0.06 * 0.004, 2e-3 * 0.16 * 0.06 * 0.004);
  const double radius = 0.16 / M_PI;
  for (const Vec3 p : model.collision.positions) EXPECT_NEAR(std::hypot(p.x, p.z + radius), radius, 1e-12);
  Box3 box;
  for (const Vec3 p : model.collision.positions) box.add(p);
  EXPECT_NEAR(box.size().x, 2 * radius, 1e-12);
  EXPECT_NEAR(box.size().z, radius, 1e-12);
}

TEST(Models, SShape) {
  const Model model = make("s-shape");
  expect_sound(model);
  EXPECT_EQ(topology(model.visual).euler, 2);
  const double exact = 2 * (210 * M_PI / 180) * 0.04 * 0.024 * 0.006;  // two sectors of rings
  EXPECT_NEAR(volume(model.visual), exact, 5e-3 * exact);
}

TEST(Models, BentAndBumpyVersionsStaySound) {
  for (const ModelName& m : model_names()) {
    ModelOptions options;
    const double length = m.name == "sheet" || m.name == "closed-sheet" ? 1.0 : m.name == "meniscus" ? 0.045 : 0.2;
    options.bumps = 0.02 * length;
    options.seed = 7;
    if (m.name != "tube" && m.name != "half-shell") options.bend = 1.2;
    SCOPED_TRACE(m.name);
    const Model model = make(m.name, options), flat = make(m.name);
    expect_sound(model);
    EXPECT_EQ(model.visual.triangles, flat.visual.triangles);
    EXPECT_NE(model.visual.positions, flat.visual.positions);
    EXPECT_NE(model.collision.positions, flat.collision.positions);
    Box3 box;
    for (const Vec3 p : model.visual.positions) box.add(p);
    for (const Vec3 p : model.collision.positions) box.add(p);
    const LatticeHint& hint = model.lattice;
    for (int k = 0; k < 3; ++k) {
      EXPECT_LE(hint.origin[k], box.min[k] + 1e-9);
      EXPECT_GE(hint.origin[k] + hint.cells[static_cast<std::size_t>(k)] * hint.cell[k], box.max[k] - 1e-9);
    }
  }
}

TEST(Models, BendKeepsLengthsAndBumpsMoveAlongZ) {
  Model model = make("closed-sheet");
  const Model flat = model;
  ASSERT_TRUE(bend(model, 2.0).ok());
  const double radius = 1 / 2.0;
  for (const VertexId v : ids<VertexId>(flat.collision.positions.size())) {
    const Vec3 p = flat.collision.positions[v], q = model.collision.positions[v];
    EXPECT_EQ(p.y, q.y);
    EXPECT_NEAR(radius * std::atan2(q.x, q.z + radius), p.x, 1e-12);
  }
  EXPECT_FALSE(bend(model, std::nan("")).ok());
  EXPECT_FALSE(bend(model, 7).ok());

  Model thick = make("meniscus");
  for (Vec3& p : thick.visual.positions) p.z *= 10;
  const Model before = thick;
  EXPECT_FALSE(bend(thick, 3).ok());  // would fold through its axis
  EXPECT_EQ(thick.visual.positions, before.visual.positions);

  Model bumpy = flat;
  add_bumps(bumpy, 0.03, 0.3, 5);
  double highest = 0;
  for (const VertexId v : ids<VertexId>(flat.visual.positions.size())) {
    const Vec3 d = bumpy.visual.positions[v] - flat.visual.positions[v];
    EXPECT_EQ(d.x, 0);
    EXPECT_EQ(d.y, 0);
    highest = std::max(highest, std::abs(d.z));
  }
  EXPECT_LE(highest, 0.03);
  EXPECT_GT(highest, 0.01);
  EXPECT_NEAR(volume(bumpy.visual), volume(flat.visual), 1e-12);  // a shear
}

TEST(Models, NoiseMovesVisualVerticesOnly) {
  for (const std::string_view name : {"steak", "sheet"}) {
    ModelOptions options;
    options.noise = 2e-4;
    options.seed = 3;
    const Model plain = make(name), noisy = make(name, options);
    EXPECT_EQ(plain.collision.positions, noisy.collision.positions);
    const Topology t = topology(plain.visual);
    Vec3 mean;
    double far = 0;
    for (const VertexId v : ids<VertexId>(plain.visual.positions.size())) {
      const Vec3 d = noisy.visual.positions[v] - plain.visual.positions[v];
      EXPECT_TRUE(!t.on_border[v.index()] || norm(d) == 0);
      EXPECT_LE(norm(d), options.noise * (1 + 1e-9));
      far = std::max(far, norm(d));
      mean += (1.0 / static_cast<double>(plain.visual.positions.size())) * d;
    }
    EXPECT_GT(far, 0.95 * options.noise);
    EXPECT_LT(norm(mean), 0.05 * options.noise);
    options.seed = 4;
    EXPECT_NE(make(name, options).visual.positions, noisy.visual.positions);
  }
}

TEST(Models, SameOptionsGiveTheSameBits) {
  for (const ModelName& m : model_names()) {
    ModelOptions options;
    options.noise = 1e-5;
    options.bumps = 1e-4;
    const Model a = make(m.name, options), b = make(m.name, options);
    EXPECT_EQ(a.visual.positions, b.visual.positions) << m.name;
    EXPECT_EQ(a.visual.triangles, b.visual.triangles) << m.name;
    EXPECT_EQ(a.visual.texture, b.visual.texture) << m.name;
    EXPECT_EQ(a.collision.positions, b.collision.positions) << m.name;
    EXPECT_EQ(a.half_thickness, b.half_thickness) << m.name;
  }
}

TEST(Models, BadOptionsAreRefused) {
  ModelOptions options;
  EXPECT_THAT(make_model("staek", options).error().message, testing::HasSubstr("sheet"));
  options.visual_triangles = 7;
  EXPECT_THAT(make_model("sheet", options).error().message, testing::HasSubstr("1664"));
  EXPECT_FALSE(make_model("closed-sheet", options).ok());
  options = {};
  options.rim_radius = std::nan("");
  EXPECT_FALSE(make_model("closed-sheet", options).ok());
  options.rim_radius = 0.06;
  EXPECT_FALSE(make_model("closed-sheet", options).ok());
  options.rim_radius = 0.01;
  EXPECT_FALSE(make_model("steak", options).ok());
  options = {};
  options.noise = -1;
  EXPECT_FALSE(make_model("steak", options).ok());
  options.noise = 1e300;
  EXPECT_THAT(make_model("steak", options).error().message, testing::HasSubstr("farther than the body"));
  options = {};
  options.bumps = 1;
  EXPECT_FALSE(make_model("steak", options).ok());
  options = {};
  options.collision_triangles = 68;
  for (const ModelName& m : model_names()) EXPECT_FALSE(make_model(m.name, options).ok()) << m.name;
  options = {};
  options.visual_triangles = 1000000000;
  for (const ModelName& m : model_names()) EXPECT_FALSE(make_model(m.name, options).ok()) << m.name;
  options = {};
  options.bend = 1;
  EXPECT_FALSE(make_model("tube", options).ok());
  options = {};
  options.bend = 7;
  EXPECT_FALSE(make_model("sheet", options).ok());
}

}  // namespace
}  // namespace kerf::models_test
