// Paths between bound points that are off by up to 90 % of a collision edge: the regions must be discs all the same, because
// the construction does not depend on where the points lie.
#include "kerf/binding/path_network.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/base/random.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/binding/parametrize.h"
#include "kerf/binding/patches.h"
#include "kerf/mesh/models.h"

namespace kerf::path_network_test {
namespace {

SplitSurface surface_of(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (const auto& t : mesh.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
  return make_split_surface(mesh.positions.raw(), triangles, *build_half_edges(triangles, mesh.positions.size()),
                            smooth_normals(mesh.positions.raw(), triangles), {});
}

/// Area of the surface, corner by corner.
double area_of(const SplitSurface& s) {
  double area = 0;
  for (std::int32_t h = 0; h < 3 * s.face_count(); h += 3) {
    const Vec3 a = s.walled.at(s.walled.from(h)), b = s.walled.at(s.walled.from(h + 1)),
               c = s.walled.at(s.walled.from(h + 2));
    area += 0.5 * norm(cross(b - a, c - a));
  }
  return area;
}

void expect_consistent(const SplitSurface& s) {
  const WalledSurface& w = s.walled;
  for (std::int32_t h = 0; h < 3 * s.face_count(); ++h) {
    const std::int32_t t = w.opposite(h);
    if (t < 0) continue;
    ASSERT_EQ(w.opposite(t), h);
    ASSERT_EQ(w.from(t), w.to(h));
    ASSERT_EQ(w.to(t), w.from(h));
    ASSERT_EQ(w.wall[static_cast<std::size_t>(t)], w.wall[static_cast<std::size_t>(h)]);
  }
  for (std::int32_t v = 0; v < s.vertex_count(); ++v) ASSERT_EQ(w.from(w.outgoing[static_cast<std::size_t>(v)]), v);
}

TEST(SplitSurface, SplitsKeepTheSurface) {
  const Model model = *make_model("meniscus", {});
  SplitSurface s = surface_of(model.visual);
  const double before = area_of(s);
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    if (i % 3 == 0) {
      split_face(s, random.index(s.face_count()), {0.2, 0.5, 0.3});
    } else {
      split_edge(s, random.index(3 * s.face_count()), random.uniform(0.2, 0.8));
    }
  }
  expect_consistent(s);
  EXPECT_NEAR(area_of(s) / before, 1, 1e-12);
  EXPECT_EQ(s.face_count() - 2 * s.vertex_count(), -4);  // a closed surface of genus 0
}

TEST(SplitSurface, BorderEdgesSplit) {
  const Model model = *make_model("sheet", {});
  SplitSurface s = surface_of(model.visual);
  const double before = area_of(s);
  for (std::int32_t h = 0; h < 3 * static_cast<std::int32_t>(model.visual.triangles.size()); ++h)
    if (s.walled.opposite(h) < 0) {
      const std::int32_t m = split_edge(s, h, 0.3);
      EXPECT_TRUE(s.walled.wall_vertex[static_cast<std::size_t>(m)]);
    }
  expect_consistent(s);
  EXPECT_NEAR(area_of(s) / before, 1, 1e-12);
}

struct Outcome {
  int discs = 0, refused = 0;
};

/// Binds a model's collision vertices to random vertices of the visual mesh near the right ones, and runs everything after.
Outcome displaced_bindings(const char* name, std::size_t triangles, int runs) {
  ModelOptions options;
  options.visual_triangles = triangles;
  const Model model = *make_model(name, options);
  const bool closed = model.closed;
  const auto collision = build_collision_mesh(model.collision, model.half_thickness);
  const std::vector<Vec3> normals = vertex_normals(model.collision);
  Outcome outcome;
  for (int run = 0; run < runs; ++run) {
    SplitSurface s = surface_of(model.visual);
    Random random(static_cast<std::uint64_t>(1000 + run));
    BoundVertices bound;
    bound.bound.assign(collision->vertex_count(), {-1, -1});
    bound.half_thickness = model.half_thickness;
    std::vector<Vec3f> skin = s.normal;
    const double off = 0.9 * (run % 10 + 1) / 10;
    for (const CollisionVertex v : ids<CollisionVertex>(collision->vertex_count())) {
      const bool rim = collision->on_border(v);
      double edge = 0;
      collision->for_each_outgoing(v, [&](CollisionHalfEdge h) {
        edge = std::max(edge, norm(collision->rest[collision->to(h)] - collision->rest[v]));
        return true;
      });
      for (std::size_t side = 0; side < (closed && !rim ? 2u : 1u); ++side) {
        // The free vertex nearest to a displaced target on this side; rim points stay.
        const Vec3 n = normals[v.index()];
        Vec3 target = collision->rest[v] + (side == 0 ? 1.0 : -1.0) * (rim ? 0.0 : 1.0) * collision->offset[v];
        if (!rim) {
          const Vec3 d{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
          target += off * edge * 0.6 * (d - dot(d, n) * n);
        }
        std::int32_t best = -1;
        double distance = HUGE_VAL;
        for (std::int32_t i = 0; i < s.vertex_count(); ++i) {
          const auto u = static_cast<std::size_t>(i);
          if (closed ? s.walled.wall_vertex[u]
                     : (rim ? fan_start(s.walled, i) >= 0 && s.walled.opposite(fan_start(s.walled, i)) >= 0
                            : s.walled.wall_vertex[u] != 0))
            continue;
          if (closed && !rim && dot(to_double(skin[u]), n) * (side == 0 ? 1 : -1) < 0.5) continue;
          const double x = norm(s.walled.at(i) - target);
          if (x >= distance) continue;
          distance = x;
          best = i;
        }
        EXPECT_GE(best, 0) << name;
        if (best < 0) return outcome;
        bound.bound[v.index()][side] = best;
        s.walled.wall_vertex[static_cast<std::size_t>(best)] = 1;
      }
      if (closed && rim) bound.bound[v.index()][1] = bound.bound[v.index()][0];
    }
    const double before = area_of(s);
    const auto network = insert_paths(s, *collision, bound, closed, {});
    if (!network) {
      ++outcome.refused;
      EXPECT_NE(network.error().message.find("collision edge"), std::string::npos);
      ADD_FAILURE() << name << " run " << run << ": " << network.error().message;
      continue;
    }
    split_dividing_edges(s, *collision, bound, *network);
    expect_consistent(s);
    EXPECT_NEAR(area_of(s) / before, 1, 1e-12);
    const auto patches = find_patches(s, *collision, bound, *network, closed);
    EXPECT_TRUE(patches.ok()) << name << " run " << run << ": " << (patches ? "" : patches.error().message);
    if (!patches) continue;
    const auto parameters = parametrize(s, *collision, bound, *network, *patches, closed, {}, {});
    EXPECT_TRUE(parameters.ok()) << name << " run " << run << ": " << (parameters ? "" : parameters.error().message);
    if (!parameters) continue;
    EXPECT_EQ(parameters->uniform_patches, 0) << name << " run " << run;
    ++outcome.discs;
  }
  return outcome;
}

TEST(PathNetwork, DisplacedBindingsStillGiveDiscs) {
  for (const auto& [name, triangles, runs] : {std::tuple{"sheet", 6656, 30},
                                              {"closed-sheet", 6000, 30},
                                              {"steak", 0, 20},
                                              {"meniscus", 0, 20},
                                              {"two-holed-slab", 0, 10}}) {
    const Outcome outcome = displaced_bindings(name, static_cast<std::size_t>(triangles), runs);
    EXPECT_EQ(outcome.discs, runs) << name;
  }
}

}  // namespace
}  // namespace kerf::path_network_test
