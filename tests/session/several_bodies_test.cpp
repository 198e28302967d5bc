// Several bodies in one session: each behaves as it would alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "kerf/base/random.h"
#include "kerf/base/rigid_place.h"
#include "kerf/contact/depth.h"
#include "kerf/session/session.h"
#include "session/make_session.h"
#include "session/session_measures.h"

namespace kerf::several_bodies_test {
namespace {

using test::make;

using ::testing::HasSubstr;

void expect_valid(const Session& session) {
  const Status valid = session.validate();
  EXPECT_TRUE(valid.ok()) << valid.error().message;
}

SceneBody body_of(const char* model, Vec3 position = {}, Vec3 rotation = {}) {
  SceneBody body;
  body.model = model;
  body.position = position;
  body.rotation = rotation;
  return body;
}

/// Held at one end, no contact, solved tightly.
Scene scene_of(std::vector<SceneBody> bodies) {
  Scene scene;
  scene.body = bodies[0];
  scene.more_bodies.assign(bodies.begin() + 1, bodies.end());
  scene.contact.enabled = false;
  scene.simulation.time_step = 0.005;
  scene.simulation.tolerance = 1e-11;
  return scene;
}

SceneFix below_x(double x) {
  SceneFix fix;
  fix.region.shape = SceneRegion::Shape::kHalfSpace;
  fix.region.point = {x, 0, 0};
  fix.region.normal = {-1, 0, 0};
  return fix;
}

double greatest_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b, std::size_t b_first, Vec3 b_moved) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, norm(b[b_first + i] - b_moved - a[i]));
  return most;
}

TEST(SeveralBodies, MoveAsEachAlone) {
  Scene alone = scene_of({body_of("steak")});
  alone.fixes = {below_x(-0.08)};
  Session one = make(alone);
  const Vec3 cell = one.body().hex.bodies[0].frame.cell;
  const Vec3 moved{0, 0, 3 * cell.z};  // the lattice fits both as it fits one

  Scene both = scene_of({body_of("steak"), body_of("steak", moved)});
  both.fixes = {below_x(-0.08)};
  Session two = make(both);
  expect_valid(two);
  EXPECT_EQ(two.counts().pieces, 2);
  EXPECT_EQ(two.counts().nodes, 2 * one.counts().nodes);
  EXPECT_EQ(two.counts().hexahedra, 2 * one.counts().hexahedra);
  EXPECT_EQ(two.counts().visual_triangles, 2 * one.counts().visual_triangles);

  ASSERT_TRUE(one.step(100).ok());
  ASSERT_TRUE(two.step(100).ok());
  const auto& a = one.collision_positions();
  const auto& b = two.collision_positions();
  ASSERT_EQ(b.size(), 2 * a.size());
  double bent = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    bent = std::max(bent, norm(a[i] - one.body().complex.collision.rest.raw()[i]));
  EXPECT_GT(bent, 0.005) << "it sags";
  EXPECT_LT(greatest_distance(a, b, 0, {}), 1e-6 * bent);
  EXPECT_LT(greatest_distance(a, b, a.size(), moved), 1e-6 * bent);
}

TEST(SeveralBodies, AreCutOneByOne) {
  Scene scene = scene_of({body_of("steak"), body_of("meniscus", {0, 0, 0.05}, {0.3, 0, 0.5})});
  scene.simulation.gravity = {};
  Session session = make(scene);
  expect_valid(session);
  const std::uint64_t before = session.hash();
  const BodyCounts counts = session.counts();
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  for (int i = 0; i <= 30; ++i) {
    const double y = -0.12 + 0.24 * i / 30;
    ASSERT_TRUE(session.move_blade({0.003, y, 0.1}, {0.003, y, 0.03}).ok());
  }
  ASSERT_TRUE(session.end_stroke().ok());
  expect_valid(session);
  EXPECT_EQ(session.counts().pieces, counts.pieces + 1) << "the upper one is in two, the lower one whole";
  const std::uint64_t cut = session.hash();
  ASSERT_TRUE(session.undo().ok());
  EXPECT_EQ(session.hash(), before);
  ASSERT_TRUE(session.redo().ok());
  EXPECT_EQ(session.hash(), cut);
  expect_valid(session);
  ASSERT_TRUE(session.step(20).ok());
  expect_valid(session);
}

TEST(SeveralBodies, HaveMaterialsOfTheirOwn) {
  SceneBody light = body_of("steak"), heavy = body_of("steak", {0, 0, 0.05}, {0, 0, 0.4});
  light.material.density = 500;
  heavy.material.density = 2000;
  heavy.material.young = 1e6;
  Session session = make(scene_of({light, heavy}));
  expect_valid(session);  // masses among other things
  const HexMesh& hex = session.body().hex;
  ASSERT_EQ(hex.bodies.size(), 2u);
  EXPECT_NEAR(hex.bodies[0].volume, hex.bodies[1].volume, 1e-12);
  double volume[2] = {0, 0};
  for (const HexId h : ids<HexId>(hex.hex_count()))
    if (hex.alive(h)) volume[hex.material[h].body] += hex.material[h].mass_volume;
  EXPECT_NEAR(volume[0], hex.bodies[0].volume, 1e-9 * hex.bodies[0].volume);
  EXPECT_NEAR(volume[1], hex.bodies[1].volume, 1e-9 * hex.bodies[1].volume);
}

TEST(SeveralBodies, FallFreelyWhateverTheirCells) {
  Scene scene = scene_of({body_of("steak"), body_of("s-shape", {0.01, 0.02, 0.033}, {0.2, 0.3, 0.4})});
  scene.material.damping_mass = 0;
  Session session = make(scene);
  const std::vector<Vec3> before = session.collision_positions();
  ASSERT_TRUE(session.step(40).ok());
  const double dt = 0.005, t = 40 * dt;
  const double fallen = 0.5 * 9.81 * t * (t + dt);  // of implicit Euler
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_NEAR(norm(session.collision_positions()[i] - (before[i] - Vec3{0, 0, fallen})), 0, 1e-7);
}

TEST(SeveralBodies, APlacedBodyIsTheSameBody) {
  const Vec3 position{0.3, -0.2, 0.1}, rotation{0, 0, 1.1};
  Session still = make(scene_of({body_of("steak")}));
  Scene scene = scene_of({body_of("steak", position, rotation)});
  Session moved = make(scene);
  expect_valid(moved);
  EXPECT_EQ(moved.counts(), still.counts()) << "the lattice moves along";
  const RigidPlace place{position, turn(rotation)};
  for (const CollisionVertex v : ids<CollisionVertex>(still.body().complex.collision.vertex_count()))
    EXPECT_NEAR(norm(moved.body().complex.collision.rest[v] - place.to_world(still.body().complex.collision.rest[v])),
                0, 1e-15);
}

TEST(SeveralBodies, BadInput) {
  const auto error_of = [](const Scene& scene) {
    auto session = Session::create(scene);
    return session.ok() ? std::string("no error") : session.error().message;
  };
  EXPECT_EQ(
      error_of(scene_of({body_of("sheet"), body_of("steak")})),
      "body 1 (sheet) is an open sheet, body 2 (steak) is closed: bodies of one scene must all be closed, or all open sheets");
  EXPECT_THAT(error_of(scene_of({body_of("steak"), body_of("steak", {1e9, 0, 0})})), HasSubstr("too far"));
  // Alone it would be gone in the rounding, too.
  EXPECT_THAT(error_of(scene_of({body_of("steak", {1e7, 0, 0})})),
              HasSubstr("give [body] a position nearer to the origin"));
  EXPECT_THAT(error_of(scene_of({body_of("meniscus", {0, 0, -1e4})})), HasSubstr("too far for its cells"));
  EXPECT_EQ(error_of(scene_of({body_of("meniscus", {0, 0, -1e3})})), "no error");
  EXPECT_EQ(error_of(scene_of({body_of("steak"), body_of("steak", {300, 300, 300})})), "no error");
}

/// A sheet of one metre, a meniscus of some centimetres and a strip, each turned in its own way.
std::vector<SceneBody> unlike_bodies() {
  return {body_of("closed-sheet"), body_of("meniscus", {0.3, 0.7, 0.4}, {0.4, -0.3, 0.9}),
          body_of("strip", {-0.4, 0.3, -0.5}, {0, 0.2, 1.2})};
}

Scene alone_of(Scene scene, const SceneBody& body) {
  scene.body = body;
  scene.more_bodies.clear();
  if (body.model == "meniscus") scene.fixes.clear();
  return scene;
}

TEST(SeveralBodies, OfUnlikeSizesHaveCellsOfTheirOwn) {
  const std::vector<SceneBody> bodies = unlike_bodies();
  Scene scene = scene_of(bodies);
  scene.fixes = {below_x(-0.42)};  // holds the sheet and the end of the strip; the meniscus falls
  Session together = make(scene);
  expect_valid(together);
  ASSERT_TRUE(together.step(60).ok());
  expect_valid(together);
  BodyCounts sum;
  std::size_t first = 0;
  for (const SceneBody& body : bodies) {
    Session alone = make(alone_of(scene, body));
    sum.hexahedra += alone.counts().hexahedra;
    sum.nodes += alone.counts().nodes;
    ASSERT_TRUE(alone.step(60).ok());
    const std::vector<Vec3>& rest = alone.body().complex.collision.rest.raw();
    const auto& a = alone.collision_positions();
    const auto& b = together.collision_positions();
    double moved = 0;
    for (std::size_t i = 0; i < a.size(); ++i) moved = std::max(moved, norm(a[i] - rest[i]));
    EXPECT_GT(moved, 1e-4) << body.model;
    EXPECT_LT(greatest_distance(a, b, first, {}), 1e-6 * moved) << body.model;
    first += a.size();
  }
  EXPECT_EQ(together.counts().hexahedra, sum.hexahedra);
  EXPECT_EQ(together.counts().nodes, sum.nodes);
}

TEST(SeveralBodies, OfUnlikeSizesAreDrawnAsAlone) {
  const std::vector<SceneBody> bodies = unlike_bodies();
  Scene scene = scene_of(bodies);
  scene.fixes = {below_x(-0.42)};
  Session together = make(scene);
  ASSERT_TRUE(together.step(30).ok());
  std::vector<Vec3f> at, normals;
  const Body& all = together.body();
  evaluate_render_surface(all.surface, all.complex.visual, all.hex, all.embedding, together.node_positions(), at,
                          normals);
  std::size_t first = 0, turned = 0;
  for (const SceneBody& body : bodies) {
    Session alone = make(alone_of(scene, body));
    ASSERT_TRUE(alone.step(30).ok());
    std::vector<Vec3f> own, own_normals;
    const Body& b = alone.body();
    evaluate_render_surface(b.surface, b.complex.visual, b.hex, b.embedding, alone.node_positions(), own, own_normals);
    for (std::size_t i = 0; i < own.size(); ++i) {
      ASSERT_LT(norm(to_double(own[i]) - to_double(at[first + i])), 1e-6) << body.model << ' ' << i;
      if (norm(to_double(own_normals[i]) - to_double(normals[first + i])) > 1e-4) ++turned;
    }
    first += own.size();
  }
  ASSERT_EQ(first, at.size());
  EXPECT_LT(turned, at.size() / 500) << "vertices on a face between cells may go with either";
}

TEST(SeveralBodies, OfUnlikeSizesAreCutAsAlone) {
  const std::vector<SceneBody> bodies = unlike_bodies();
  for (std::size_t which = 0; which < bodies.size(); ++which) {
    // Across the middle of one of them, through it along its own axes.
    const RigidPlace place{bodies[which].position, turn(bodies[which].rotation)};
    const auto cut = [&](Session& session) {
      ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
      const double reach = which == 0 ? 0.8 : 0.2;
      for (int i = 0; i <= 40; ++i) {
        const double s = reach * (i / 20.0 - 1);
        ASSERT_TRUE(session.move_blade(place.to_world({0.0021, s, 0.1}), place.to_world({0.0021, s, -0.1})).ok());
      }
      ASSERT_TRUE(session.end_stroke().ok());
    };
    Scene scene = scene_of(bodies);
    scene.simulation.gravity = {};
    Session together = make(scene);
    const BodyCounts before = together.counts();
    cut(together);
    expect_valid(together);
    Session alone = make(alone_of(scene, bodies[which]));
    const BodyCounts whole = alone.counts();
    cut(alone);
    EXPECT_GT(alone.counts().pieces, 1) << bodies[which].model;
    EXPECT_EQ(together.counts().pieces - before.pieces, alone.counts().pieces - whole.pieces) << bodies[which].model;
    EXPECT_EQ(together.counts().hexahedra - before.hexahedra, alone.counts().hexahedra - whole.hexahedra);
    EXPECT_EQ(together.counts().nodes - before.nodes, alone.counts().nodes - whole.nodes);
  }
}

TEST(SeveralBodies, ACoarseOneBesideMakesCutsOfAFineOneNoCoarser) {
  const std::vector<SceneBody> bodies = unlike_bodies();
  Scene scene = scene_of(bodies);
  scene.simulation.gravity = {};
  Session together = make(scene), alone = make(alone_of(scene, bodies[1]));
  EXPECT_EQ(together.body().complex.mean_root_edge, alone.body().complex.mean_root_edge);
  const RigidPlace place{bodies[1].position, turn(bodies[1].rotation)};
  const auto clean = together.snapshot(), clean_alone = alone.snapshot();
  const BodyCounts before = together.counts(), whole = alone.counts();
  for (int k = 0; k < 30; ++k) {
    Random random(static_cast<std::uint64_t>(k) + 1);
    // Two wavy strokes across.
    std::vector<std::pair<Vec3, Vec3>> edges;
    for (int stroke = 0; stroke < 2; ++stroke) {
      const double a = random.uniform(0, 2 * M_PI), b = a + M_PI + random.uniform(-1, 1),
                   wave = random.uniform(0, 0.005);
      for (int i = 0; i <= 20; ++i) {
        const double t = i / 20.0;
        const Vec3 p = 0.03 * ((1 - t) * Vec3{std::cos(a), std::sin(a), 0} + t * Vec3{std::cos(b), std::sin(b), 0}) +
                       wave * std::sin(6 * t) * Vec3{-std::sin(a), std::cos(a), 0};
        edges.emplace_back(place.to_world(p + Vec3{0, 0, 0.02}), place.to_world(p - Vec3{0, 0, 0.02}));
      }
    }
    for (Session* session : {&together, &alone})
      for (std::size_t stroke = 0; stroke < 2; ++stroke) {
        ASSERT_TRUE(session->begin_stroke(SceneFrame::kRest, true).ok());
        for (std::size_t i = 0; i < 21; ++i)
          ASSERT_TRUE(session->move_blade(edges[21 * stroke + i].first, edges[21 * stroke + i].second).ok());
        ASSERT_TRUE(session->end_stroke().ok());
      }
    expect_valid(together);
    EXPECT_EQ(together.counts().pieces - before.pieces, alone.counts().pieces - whole.pieces) << k;
    EXPECT_EQ(together.counts().collision_triangles - before.collision_triangles,
              alone.counts().collision_triangles - whole.collision_triangles)
        << k;
    together.restore(clean);
    alone.restore(clean_alone);
  }
}

TEST(SeveralBodies, ASmallOneComesToLieOnALargeOneAsOnAPlane) {
  const SceneBody small = body_of("meniscus", {0.2, 0.1, 0.08}, {0, 0, 0.5});
  Scene scene = scene_of({body_of("closed-sheet"), small});
  scene.contact.enabled = true;
  scene.simulation.tolerance = 1e-4;
  SceneFix sheet;
  sheet.region.shape = SceneRegion::Shape::kHalfSpace;
  sheet.region.point = {0, 0, 0.055};
  sheet.region.normal = {0, 0, -1};
  scene.fixes = {sheet};
  Session both = make(scene);
  Scene plain = scene;
  plain.body = small;
  plain.more_bodies.clear();
  plain.fixes.clear();
  SceneObstacle plane;
  plane.position = {0, 0, 0.05};
  plain.obstacles = {plane};
  Session alone = make(plain);
  ASSERT_TRUE(both.step(200).ok());
  ASSERT_TRUE(alone.step(200).ok());
  expect_valid(both);
  const std::size_t own = alone.collision_positions().size(), first = both.collision_positions().size() - own;
  double lower = 0, height[2] = {0, 0};
  for (std::size_t i = 0; i < own; ++i) {
    const double rest = alone.body().complex.collision.rest.raw()[i].z;
    lower += (rest - alone.collision_positions()[i].z) / static_cast<double>(own);
    height[0] += alone.collision_positions()[i].z / static_cast<double>(own);
    height[1] += both.collision_positions()[first + i].z / static_cast<double>(own);
  }
  EXPECT_GT(lower, 0.02) << "it fell";
  EXPECT_NEAR(height[1], height[0], 2e-4);
  for (std::size_t i = 0; i < first; ++i)
    ASSERT_LT(norm(both.collision_positions()[i] - both.body().complex.collision.rest.raw()[i]), 1e-9);
}

template <class Which>
std::vector<CollisionVertex> vertices_where(const Session& session, Which&& which) {
  std::vector<CollisionVertex> found;
  const auto& rest = session.body().complex.collision.rest;
  for (const CollisionVertex v : ids<CollisionVertex>(rest.size()))
    if (which(rest[v])) found.push_back(v);
  return found;
}

TEST(SeveralBodies, OneIsDraggedEvenlyWhileOthersHitEachOther) {
  // Bodies that come together fast divide a step; what is held elsewhere must not be at the end of the whole step in the first part of it.
  constexpr double kSpeed = 0.5;
  Scene scene =
      scene_of({body_of("strip"), body_of("strip", {0, 0, 0.04}, {0, 0, M_PI / 2}), body_of("strip", {0, 1, 0})});
  scene.contact.enabled = true;
  scene.simulation.gravity = {};
  Session session = make(scene);
  const std::vector<CollisionVertex> apart = vertices_where(session, [](Vec3 p) { return p.y > 0.5; });
  ASSERT_TRUE(session.grasp("below", vertices_where(session, [](Vec3 p) { return p.y < 0.5 && p.z < 0.02; })).ok());
  ASSERT_TRUE(session.grasp("above", vertices_where(session, [](Vec3 p) { return p.y < 0.5 && p.z > 0.02; })).ok());
  ASSERT_TRUE(session.grasp("apart", apart).ok());
  const auto move = [&](const char* name, Vec3 by, double over) {
    SceneCommand c;
    c.what = SceneMove{name, by, {}, over};
    ASSERT_TRUE(session.apply(c).ok());
  };
  move("above", {0, 0, -0.06}, 0.06);  // at 1 m/s onto the one below
  move("apart", {kSpeed, 0, 0}, 1);
  const auto middle = [&] {
    Vec3 sum;
    for (const CollisionVertex v : apart) sum += session.collision_positions()[v.index()];
    return (1.0 / static_cast<double>(apart.size())) * sum;
  };
  int divided = 0;
  for (int i = 0; i < 16; ++i) {
    const auto step = session.step();
    ASSERT_TRUE(step.ok()) << step.error().message;
    if (i < 4) continue;  // it gathers speed
    divided += step->parts > 1 ? 1 : 0;
    for (const NodeId n : session.body().hex.nodes[session.body().embedding.collision[apart[0]]])
      EXPECT_NEAR(session.node_velocities()[n.index()].x, kSpeed, 0.02 * kSpeed)
          << "step " << i << " of " << step->parts;
  }
  EXPECT_GT(divided, 2);
  EXPECT_NEAR(middle().x, kSpeed * 0.08, 1e-4);
}

/// How deep walls of cuts are in material, seen from outside, parts of the half thickness; what is not deeper than a twentieth counts as 0.
double deepest_wall(Session& session) {
  const test::SurfaceNow now = test::surface_now(session);
  const SurfaceState state{&now.surface, now.positions, now.offsets, now.positions};
  DepthSearch search;
  prepare_depths(state, search);
  find_deep_walls(state, 0.05 * now.surface.largest_radius, search);
  double deepest = 0;
  for (const DepthSearch::Deep& d : search.deep) deepest = std::max(deepest, d.depth / now.surface.largest_radius);
  return deepest;
}

TEST(SeveralBodies, LipsOfAStripUnderAnotherStayApartWhileBothAreSawn) {
  // The strip above is as near to the lips at rest as its own lips would be. It was taken for the lip across, which a vertex lay on: such a vertex has no contact
  // with walls, and the lips went up to 0.58 into each other.
  // In long steps a saw may leave a crumb between the lips, on which they stand 0.24 off. At 20 N/m the strip slides along with it.
  struct Saw {
    double dt, resistance, seconds, deepest;
  };
  for (const Saw saw : {Saw{0.005, 10, 1.0, 0}, Saw{0.0167, 15, 1.5, 0.3}}) {
    Scene scene;
    scene.body = body_of("strip");
    scene.body.options.visual_triangles = 1000;
    scene.more_bodies = {scene.body};
    scene.more_bodies[0].position = {0, 0, 0.0031};
    scene.simulation.time_step = saw.dt;
    scene.material.young = 1e5;
    scene.contact.friction = 0.5;
    scene.cut.resistance = saw.resistance;
    SceneObstacle& table = scene.obstacles.emplace_back();
    table.position = {0, 0, -0.0016};
    SceneRigidTool& knife = scene.tools.emplace_back();
    knife.id = "knife";
    knife.kind = SceneToolKind::kScalpel;
    knife.thickness = 0.001;
    knife.rotation = {0, 0, std::numbers::pi / 2};
    knife.position = {0.002, -0.03, -0.012};
    Session session = make(scene);
    ASSERT_TRUE(session.step(static_cast<int>(0.2 / saw.dt)).ok());
    SceneToolMotion motion{"knife", {}};
    Vec3 at = knife.position;
    double t = 0;
    for (int i = 0; i < 12; ++i)
      for (const auto& [over, by] : {std::pair{0.15, 0.02}, std::pair{0.1, -0.012}}) {
        at.y += by;
        t += over;
        motion.poses.push_back({t, at, knife.rotation});
      }
    SceneCommand command;
    command.what = motion;
    ASSERT_TRUE(session.apply(command).ok());
    double deepest = 0;
    for (int i = 0; i * saw.dt < saw.seconds || (session.counts().pieces < 3 && i * saw.dt < motion.poses.back().time);
         ++i) {
      ASSERT_TRUE(session.step().ok());
      if (i % 4 == 3) deepest = std::max(deepest, deepest_wall(session));
    }
    EXPECT_GE(session.counts().pieces, 3) << "it cuts";
    EXPECT_LE(deepest, saw.deepest) << saw.dt;
  }
}

}  // namespace
}  // namespace kerf::several_bodies_test
