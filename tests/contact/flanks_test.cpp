// Which side of a blade a lip lies on.
#include "kerf/contact/flanks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "cutting/cut_body.h"

namespace kerf::flanks_test {
namespace {

using testing_support::CutBody;
using testing_support::plain_grid_mesh;
using testing_support::SyntheticOptions;

constexpr double kRadius = 0.01, kTip = 0.62;  // m; a unit square is slit from its side y = 0 up to kTip

struct SlitSheet {
  CutBody cut;
  ContactSurface surface;
  std::vector<Vec3> position, offset;

  SlitSheet() : cut(plain_grid_mesh(6, 6), options()) {
    cut.cut({{0.47, -0.1, 0}, {0.52, 0.3, 0}, {0.48, kTip, 0}});
    surface = make_contact_surface(cut.body.collision);
    position = surface.rest.raw();
    offset = surface.offset.raw();
  }
  static SyntheticOptions options() {
    SyntheticOptions o;
    o.subdivisions = 2;
    o.closed = false;
    o.thickness = 2 * kRadius;
    return o;
  }
  [[nodiscard]] bool turned_over(CollisionTriangle t) const {
    const auto v = surface.vertices(t);
    const Vec3 a = position[v[0].index()];
    return cross(position[v[1].index()] - a, position[v[2].index()] - a).z < 0;
  }
};

// Where a cut has just been led on, triangles at its tip are small. Lips that spring apart turn them over.
TEST(Flanks, TrianglesThatTurnOverAtTheTipDoNotChangeALipsSide) {
  SlitSheet sheet;
  const ContactSurface& s = sheet.surface;
  // Upright, its edge at the tip, facing along the slit: +y of the blade is -x of the sheet.
  RigidShape shape;
  shape.position = {0.48, kTip, -2 * kRadius};
  shape.axes = {{Vec3{0, 1, 0}, Vec3{-1, 0, 0}, Vec3{0, 0, 1}}};
  Blade blade{&shape, 0, 4 * kRadius, 0.5, 0.1};
  blade.margin = kRadius;
  blade.stray = 0.1;
  const auto sides = [&] {
    Slit slit;
    find_slit({&s, sheet.position, sheet.offset, sheet.position}, blade, {}, slit);
    return slit.edges;
  };
  const std::vector<SlitEdge> at_rest = sides();
  ASSERT_GT(at_rest.size(), 4u);
  for (const SlitEdge& e : at_rest) {
    const Vec3 from = s.rest[s.from(e.edge)], to = s.rest[s.to(e.edge)],
               apex = s.rest[s.to(ContactSurface::next(e.edge))];
    EXPECT_EQ(e.side, apex.x < lerp(from, to, (apex.y - from.y) / (to.y - from.y)).x ? 1 : -1);
  }

  CollisionVertex tip;
  for (const CollisionVertex v : ids<CollisionVertex>(s.vertex_count()))
    if (s.on_cut[v] != 0 && (!tip.valid() || s.rest[v].y > s.rest[tip].y)) tip = v;
  int turned = 0;
  for (const double x : {-0.03, -0.01, 0.01, 0.03}) {
    sheet.position = s.rest.raw();
    sheet.position[tip.index()] += Vec3{x, -0.1, 0};
    for (const CollisionTriangle t : ids<CollisionTriangle>(s.face_count())) turned += sheet.turned_over(t) ? 1 : 0;
    for (const SlitEdge& e : sides())
      for (const SlitEdge& was : at_rest)
        if (was.edge == e.edge) {
          EXPECT_EQ(e.side, was.side) << x;
        }
  }
  EXPECT_GT(turned, 0);
}

// The edge passes the end of the slit at every lean, and only in the middle surface: above and below, a slanting edge is ahead of the wall or
// behind it.
TEST(Flanks, ASlantingEdgeMeetsTheEndAheadWhereItIsCut) {
  SlitSheet sheet;
  const SurfaceState state{&sheet.surface, sheet.position, sheet.offset, sheet.position};
  constexpr double kStray = 5 * kRadius;
  for (const double lean : {-1.2, -0.6, 0.0, 0.6, 1.2}) {
    const Vec3 edge{0, std::sin(lean), std::cos(lean)}, forward{0, std::cos(lean), -std::sin(lean)};
    const double length = 6 * kRadius;
    const auto gaps = [&](double past) {
      RigidShape shape;
      shape.position = Vec3{0.48, kTip, 0} + past * forward - 0.5 * length * edge;
      shape.axes = {{forward, cross(edge, forward), edge}};
      Blade blade{&shape, 0, length, 0.5, 0.1 * kRadius};
      blade.margin = 10 * kRadius;
      blade.stray = kStray;
      Slit slit;
      DetectMemory memory;
      find_slit(state, blade, memory, slit);
      // Known for long: what the blade comes past at first sight is let be.
      for (SlitVertex& v : slit.vertices)
        memory.rims.push_back({.tool = 0, .vertex = v.vertex, .side = v.side, .end = v.end});
      std::vector<Contact> contacts;
      detect_flanks(state, blade, slit, memory, contacts);
      std::vector<double> found;
      for (const Contact& c : contacts)
        if (dot(c.normal, forward) > 0.99) found.push_back(c.gap);
      return found;
    };
    const double least = 0.2 * kRadius + kStray;  // the wedge is two thicknesses long
    for (const double past : {0.0, 0.5 * least, 0.9 * least, least + 0.1 * kRadius}) {
      const std::vector<double> found = gaps(past);
      ASSERT_EQ(found.size(), 2u) << lean;
      for (const double gap : found) EXPECT_NEAR(gap, least - past, 1e-12) << lean;
    }
  }
}

}  // namespace
}  // namespace kerf::flanks_test
