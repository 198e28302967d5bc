// Strips along the rim come off as wide as they were cut, and no piece is without volume.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "cutting/cut_polyline.h"
#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/cutting/validate.h"
#include "kerf/mesh/models.h"
#include "support/extruded_mesh.h"
#include "support/piece_volumes.h"
#include "support/synthetic_complex.h"

namespace kerf::rim_strip_test {
namespace {

using namespace testing_support;

CellComplex bound(const TriangleMesh& visual, const TriangleMesh& collision) {
  auto body = bind(visual, collision, {});
  EXPECT_TRUE(body.ok()) << (body.ok() ? "" : body.error().message);
  return body.ok() ? std::move(body->complex) : CellComplex{};
}

/// Cuts a copy along the points and returns the share of its smaller piece; expects two.
double share_cut_off(const CellComplex& body, const std::vector<Vec3>& points, const std::string& what) {
  CellComplex cut = body;
  CutScratch scratch;
  EXPECT_EQ(cut_polyline(cut, points, {}, scratch).refused, 0) << what;
  const std::vector<double> volumes = piece_volumes(cut);
  EXPECT_EQ(volumes.size(), 2u) << what;
  if (volumes.size() != 2) return 0;
  return volumes[0] / (volumes[0] + volumes[1]);
}

TEST(RimStrip, OfAPlate) {
  const auto model = make_model("closed-sheet", {.visual_triangles = 20000});
  ASSERT_TRUE(model.ok());
  const CellComplex body = bound(model->visual, model->collision);
  // At 0.47 a column of visual vertices is 5 % of a visual edge beside the blade, and the walk takes what is nearer than 10 %.
  for (const auto& [x, within] :
       {std::pair{0.30, 0.02}, {0.40, 0.02}, {0.43, 0.02}, {0.45, 0.02}, {0.47, 0.025}, {0.48, 0.02}, {0.49, 0.02}}) {
    const double share = share_cut_off(body, {{x, -0.6, 0}, {x, 0.6, 0}}, fmt::format("x = {}", x));
    EXPECT_NEAR(share / (0.5 - x), 1, within) << "x = " << x;
  }
}

// Along both sides of a wedge of 1 : 8.
TEST(RimStrip, OfAWedge) {
  const double thin = 0.005, slope = 0.035;  // half the thickness at x is thin + slope x
  const CellComplex body =
      bound(extruded(plain_grid_mesh(53, 47), 4, [&](Vec3 p) { return thin + slope * p.x; }), plain_grid_mesh(7, 8));
  const auto below = [&](double x) { return (thin * x + 0.5 * slope * x * x) / (thin + 0.5 * slope); };
  for (const double width : {0.2, 0.1, 0.05, 0.03, 0.013}) {
    EXPECT_NEAR(share_cut_off(body, {{width, -0.2, 0}, {width, 1.2, 0}}, "thin side") / below(width), 1, 0.03) << width;
    EXPECT_NEAR(share_cut_off(body, {{1 - width, -0.2, 0}, {1 - width, 1.2, 0}}, "thick side") / (1 - below(1 - width)),
                1, 0.03)
        << width;
  }
}

TEST(RimStrip, OfADisc) {
  const int corners = 88;
  const CellComplex body =
      bound(extruded(disc_mesh(0.5, corners, 12), 2, [](Vec3) { return 0.03; }), disc_mesh(0.5, 22, 4));
  for (const double d : {0.3, 0.4, 0.44, 0.46}) {
    // The part of the polygon with x > d.
    double part = 0, whole = 0;
    for (int i = 0; i < corners; ++i) {
      const auto p = [&](int k) {
        return Vec2{0.5 * std::cos(2 * 3.14159265358979323846 * k / corners),
                    0.5 * std::sin(2 * 3.14159265358979323846 * k / corners)};
      };
      Vec2 a = p(i), b = p(i + 1);
      whole += 0.5 * cross(a, b);
      if (a.x < d && b.x < d) continue;
      if (a.x < d) a = lerp(a, b, (d - a.x) / (b.x - a.x));
      if (b.x < d) b = lerp(a, b, (d - a.x) / (b.x - a.x));
      part += 0.5 * cross(a - Vec2{d, 0}, b - Vec2{d, 0});
    }
    // The collision mesh's border is a chord of the rim, up to 0.005 m off: what is beyond it is drawn in, and the wall with it.
    EXPECT_NEAR(share_cut_off(body, {{d, -0.6, 0}, {d, 0.6, 0}}, "disc") / (part / whole), 1, 0.003 / (0.5 - d)) << d;
  }
}

/// A stroke that people make: straight through, along the rim near it, crossing the last one, or curved.
std::vector<Vec3> stroke(Random& random, const CollisionMesh& mesh) {
  const auto on_border = [&] {
    for (;;) {
      const CollisionHalfEdge h(random.index(static_cast<int>(mesh.half_edge_count())));
      if (!mesh.twin[h].valid() && mesh.on_rim(mesh.from(h)) && mesh.on_rim(mesh.to(h))) return h;
    }
  };
  const auto inside = [&](CollisionHalfEdge h, double depth, double along) {
    const Vec3 a = mesh.rest[mesh.from(h)], b = mesh.rest[mesh.to(h)], c = mesh.rest[mesh.apex(h)];
    const Vec3 in = normalized((c - a) - (dot(c - a, b - a) / dot(b - a, b - a)) * (b - a));
    return lerp(a, b, along) + depth * norm(b - a) * in;
  };
  std::vector<Vec3> points;
  switch (random.index(3)) {
    case 0: {  // straight, in and out over the rim
      const CollisionHalfEdge from = on_border(), to = on_border();
      points = {inside(from, -0.5, random.uniform()), inside(from, 0.2, random.uniform()),
                inside(to, 0.2, random.uniform()), inside(to, -0.5, random.uniform())};
      break;
    }
    case 1: {  // along the rim over some of its edges
      CollisionHalfEdge h = on_border();
      const double depth = std::pow(10.0, random.uniform(-1.3, 0));
      points.push_back(inside(h, -0.3, 0.2));
      const int edges = 1 + random.index(5);
      for (int i = 0; i < edges; ++i) {
        points.push_back(inside(h, depth, 0.5));
        CollisionHalfEdge g = CollisionMesh::next(h);
        while (mesh.twin[g].valid()) g = CollisionMesh::next(mesh.twin[g]);
        h = g;
      }
      points.push_back(inside(h, -0.3, 0.8));
      break;
    }
    default: {  // a curve
      const CollisionHalfEdge from = on_border(), to = on_border();
      const Vec3 a = inside(from, -0.4, 0.5), b = inside(to, -0.4, 0.5),
                 middle = mesh.rest[CollisionVertex(random.index(static_cast<int>(mesh.vertex_count())))];
      for (int i = 0; i <= 8; ++i) points.push_back(lerp(lerp(a, middle, i / 8.0), lerp(middle, b, i / 8.0), i / 8.0));
    }
  }
  return points;
}

TEST(RimStrip, RandomStrokesLeaveNoPieceWithoutVolume) {
  const auto model = [](std::string_view name) {
    const auto m = make_model(name, {});
    return bound(m->visual, m->collision);
  };
  const auto flat = [](Vec3) { return 0.03; };
  struct Named {
    const char* name;
    CellComplex body;
  };
  std::vector<Named> bodies;
  bodies.push_back({"closed-sheet", model("closed-sheet")});
  bodies.push_back({"steak", model("steak")});
  bodies.push_back({"meniscus", model("meniscus")});
  // With visual edges of 0.4 of a collision edge the walk takes vertices with four fifths of a face for a piece's tip, and empties it.
  bodies.push_back(
      {"annulus", bound(extruded(annulus_mesh(0.15, 0.5, 193, 31), 3, flat), annulus_mesh(0.15, 0.5, 24, 4))});
  bodies.push_back({"wedge", bound(extruded(plain_grid_mesh(53, 47), 4, [](Vec3 p) { return 0.005 + 0.035 * p.x; }),
                                   plain_grid_mesh(7, 8))});
  const int scenes = std::getenv("KERF_FUZZ_SECONDS") ? 100 : 10;
  for (Named& b : bodies) {
    const ComplexMeasures start = measure_complex(b.body);
    double least = 1;
    std::size_t pieces = 0;
    for (int scene = 0; scene < scenes; ++scene) {
      CellComplex body = b.body;
      Random random(static_cast<std::uint64_t>(scene) + 1);
      CutScratch scratch;
      for (int i = 0; i < 4; ++i) cut_polyline(body, stroke(random, body.collision), {}, scratch);
      const std::vector<double> volumes = piece_volumes(body);
      pieces += volumes.size();
      EXPECT_GT(volumes[0], 5e-7 * start.volume)
          << b.name << " scene " << scene << " of " << volumes.size() << " pieces";
      least = std::min(least, volumes[0] / start.volume);
      const Status valid = validate_piece_volumes(body, start);
      EXPECT_TRUE(valid.ok()) << b.name << " scene " << scene << ": " << (valid.ok() ? "" : valid.error().message);
    }
    EXPECT_GT(pieces, static_cast<std::size_t>(2 * scenes)) << b.name;
    RecordProperty(b.name, fmt::format("{} pieces, the least {:.2g} of the volume", pieces, least));
  }
}

}  // namespace
}  // namespace kerf::rim_strip_test
