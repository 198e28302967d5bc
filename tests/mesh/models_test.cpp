// The generated models against counts, closed forms and brute force.
#include "kerf/mesh/models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "kerf/mesh/half_edge_build.h"

namespace kerf {
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
  out.euler = static_cast<std::ptrdiff_t>(mesh.positions.size() + triangles.size()) - static_cast<std::ptrdiff_t>(edges);
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

/// Parameters t of all hits of the line p + t d with the mesh.
std::vector<double> line_hits(const TriangleMesh& mesh, Vec3 p, Vec3 d) {
  std::vector<double> hits;
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size())) {
    const auto [a, b, c] = corners(mesh, f);
    const Vec3 e1 = b - a, e2 = c - a, q = cross(d, e2);
    const double det = dot(e1, q);
    if (std::abs(det) < 1e-30) continue;
    const Vec3 s = p - a;
    const double u = dot(s, q) / det;
    if (u < 0 || u > 1) continue;
    const Vec3 r = cross(s, e1);
    const double v = dot(d, r) / det;
    if (v < 0 || u + v > 1) continue;
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
  for (const TriangleId f : ids<TriangleId>(mesh.triangles.size())) best = std::min(best, distance(p, corners(mesh, f)));
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
        const Polygon p = clip(clip(clip(clip(triangle, 0, x, 1), 0, x + hint.cell.x, -1), 1, y, 1), 1, y + hint.cell.y, -1);
        for (std::size_t k = 1; k + 1 < p.size(); ++k) {
          const double two_areas = (p[k].x - p[0].x) * (p[k + 1].y - p[0].y) - (p[k].y - p[0].y) * (p[k + 1].x - p[0].x);
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
        const auto hits = line_hits(model.visual, p, n[v.index()]);
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
  for (const auto& [vertices, triangles, border] :
       {std::array{65U, 104U, 24U}, std::array{280U, 500U, 58U}, std::array{796U, 1500U, 90U}, std::array{3425U, 6656U, 192U}}) {
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
    for (const std::size_t collision : {104U, 500U}) {
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
  options = {};
  options.bend = 7;
  EXPECT_FALSE(make_model("sheet", options).ok());
}

}  // namespace
}  // namespace kerf
