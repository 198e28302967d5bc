// Round punches take what lies in their tool. The tool is a prism of 720 sides; volumes are exact (support/prism_volume.h).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/cutting/punch.h"

#include "cutting/stroke_body.h"
#include "support/prism_volume.h"

namespace kerf::punch_volume_test {
namespace {

using namespace testing_support;

using Triangles = std::vector<std::array<Vec3, 3>>;

std::vector<Vec2> disc(double radius, int corners = 720) {
  std::vector<Vec2> outline;
  for (int i = 0; i < corners; ++i) {
    const double a = 2 * std::numbers::pi * i / corners;
    outline.push_back({radius * std::cos(a), radius * std::sin(a)});
  }
  return outline;
}
double area_of(const std::vector<Vec2>& p) {
  double twice = 0;
  for (std::size_t i = 0; i < p.size(); ++i) twice += cross(p[i], p[(i + 1) % p.size()]);
  return 0.5 * twice;
}
double volume_of(const Triangles& surface, Vec3 origin) {
  double sum = 0;
  for (const auto& [a, b, c] : surface) sum += dot(a - origin, cross(b - origin, c - origin)) / 6;
  return sum;
}
/// The drawn triangles of each piece.
std::vector<Triangles> pieces_of(const CellComplex& body) {
  const Pieces pieces = visual_pieces(body);
  std::vector<Triangles> parts(static_cast<std::size_t>(pieces.count));
  for (std::size_t f = 0; f < body.visual.face_count(); ++f) {
    std::array<Vec3, 3> corner;
    for (std::size_t i = 0; i < 3; ++i) corner[i] = body.visual.rest[body.visual.origin[VisualHalfEdge(3 * f + i)]];
    parts[static_cast<std::size_t>(pieces.of_face[f])].push_back(corner);
  }
  return parts;
}

/// A bite of the model meniscus, beside a vertex of its rim or inside, up to 0.4 radians or upright.
struct Bite {
  Punch punch;
  Prism tool;
  double radius = 0;
};
Bite random_bite(const StrokeBody& b, Random& random, bool at_rim, double most_tilt) {
  const CollisionMesh& m = b.body.collision;
  const double edge = b.body.mean_root_edge;
  CollisionHalfEdge h(0);
  do h = CollisionHalfEdge(random.index(static_cast<int>(m.half_edge_count())));
  while (m.is_border(h) != at_rim);
  Vec3 normal;
  for (const CollisionHalfEdge k : ids<CollisionHalfEdge>(m.half_edge_count()))
    if (m.from(k) == m.from(h))
      normal += cross(m.rest[m.to(k)] - m.rest[m.from(k)], m.rest[m.apex(k)] - m.rest[m.from(k)]);
  normal = normalized(normal);
  const Vec3 any{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)},
      aside = normalized(any - dot(any, normal) * normal);
  Bite bite;
  bite.radius = random.uniform(0.6, 1.3) * edge;
  bite.punch.axis = normalized(normal + random.uniform(0, most_tilt) * aside);
  bite.punch.across = cross(bite.punch.axis, aside);
  bite.punch.centre = m.rest[m.from(h)] + edge * Vec3{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0};
  bite.punch.outline = circle_outline(bite.radius, 0.25 * b.options.path_tolerance * edge);
  bite.tool = {bite.punch.centre, normalized(bite.punch.across), {}, bite.punch.axis, disc(bite.radius)};
  bite.tool.y = cross(bite.tool.axis, bite.tool.x);
  return bite;
}

/// Of the volume in the tool: what came loose. And how far walls lie off the tool, metres.
struct Taken {
  double part = 0, off = 0;
};
Taken take(StrokeBody& b, const Bite& bite) {
  b.make_whole();
  double in_tool = 0, loose = 0, off = 0;
  for (const Triangles& part : pieces_of(b.body)) in_tool += volume_in_prism(part, bite.tool);
  std::vector<Vec3> position = b.body.collision.rest.raw();
  const auto cut = cut_punch(b.body, position, bite.punch, b.options, b.scratch);
  EXPECT_TRUE(cut) << cut.error().message;
  for (const Triangles& part : pieces_of(b.body))
    if (const double volume = volume_of(part, bite.punch.centre); volume_in_prism(part, bite.tool) > 0.5 * volume)
      loose += volume;
  for (std::size_t f = 0; f < b.body.visual.face_count(); ++f) {
    if (!b.body.visual.patch[VisualTriangle(f)].is_wall()) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 d = b.body.visual.rest[b.body.visual.origin[VisualHalfEdge(3 * f + i)]] - bite.punch.centre;
      off = std::max(off, std::fabs(std::hypot(dot(d, bite.tool.x), dot(d, bite.tool.y)) - bite.radius));
    }
  }
  return {loose / in_tool, off};
}

TEST(PunchVolume, OutlinesHaveTheAreaOfTheirCurveAndStayNearIt) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const double radius = std::pow(10, random.uniform(-4, 1)),
                 tolerance = std::pow(10, random.uniform(-3.8, -1.4)) * radius;
    const double area = std::numbers::pi * radius * radius;
    const std::vector<Vec2> circle = circle_outline(radius, tolerance), half = d_outline(radius, tolerance);
    EXPECT_NEAR(area_of(circle), area, 1e-12 * area);
    EXPECT_NEAR(area_of(half), 0.5 * area, 1e-12 * area);
    EXPECT_EQ(half.front().x, 0);
    EXPECT_EQ(half.back().x, 0);
    for (const auto* outline : {&circle, &half})
      for (std::size_t k = 0; k + 1 < outline->size(); ++k) {
        EXPECT_NEAR(norm((*outline)[k]), radius, 1.1 * tolerance);
        EXPECT_NEAR(norm(0.5 * ((*outline)[k] + (*outline)[k + 1])), radius, 1.1 * tolerance);
      }
  }
}

TEST(PunchVolume, OfAPrismInABoxIsKnown) {  // the judge itself
  const auto box = [](Vec3 low, Vec3 high) {
    const auto at = [&](int i) { return Vec3{i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z}; };
    Triangles t;
    for (const auto [a, b, c, d] :
         {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
      t.push_back({at(a), at(b), at(c)});
      t.push_back({at(a), at(c), at(d)});
    }
    return t;
  };
  const Triangles b = box({-1, -2, -0.5}, {3, 2, 0.7});
  EXPECT_NEAR(volume_of(b, {0.3, 7, 1}), 4 * 4 * 1.2, 1e-12);
  Prism p{{}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, disc(0.8, 24)};
  EXPECT_NEAR(volume_in_prism(b, p), 1.2 * area_of(p.outline), 1e-12);
  p.centre = {-1, 0, 5};  // half of it
  EXPECT_NEAR(volume_in_prism(b, p), 0.6 * area_of(p.outline), 1e-12);
  const double c = std::cos(0.3), s = std::sin(0.3);  // oblique: base times height, but the base is longer
  p = {{1, 0, 0}, {c, 0, -s}, {0, 1, 0}, {s, 0, c}, disc(0.5, 24)};
  EXPECT_NEAR(volume_in_prism(b, p), 1.2 / c * area_of(p.outline), 1e-12);
}

TEST(PunchVolume, IsThatInTheTool) {
  StrokeBody b("meniscus");
  Random random(7);
  std::vector<double> parts, upright;
  for (int i = 0; i < 40; ++i) parts.push_back(take(b, random_bite(b, random, i % 2 == 0, 0.4)).part);
  for (int i = 0; i < 40; ++i) {
    const Bite bite = random_bite(b, random, i % 2 == 0, 0);
    const Taken taken = take(b, bite);
    parts.push_back(taken.part);
    upright.push_back(taken.off / b.body.mean_root_edge);
  }
  std::sort(parts.begin(), parts.end());
  std::sort(upright.begin(), upright.end());
  EXPECT_NEAR(parts[parts.size() / 2], 1, 0.004);
  EXPECT_GT(parts[4], 0.97);  // nine of ten
  EXPECT_LT(parts[parts.size() - 5], 1.03);
  EXPECT_GT(parts.front(), 0.92);  // a bite that leans at the rim
  EXPECT_LT(parts.back(), 1.04);
  EXPECT_LT(upright[upright.size() / 2], b.options.path_tolerance + 0.5 * b.options.minimum_feature);
  EXPECT_LT(upright.back(), 3 * (b.options.path_tolerance + b.options.minimum_feature));
}

}  // namespace
}  // namespace kerf::punch_volume_test
