// A blade in the slit that it cuts: its flanks open the lips, push them aside and do not pass them; its back meets the end of the slit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/base/rigid_place.h"
#include "kerf/cutting/pieces.h"
#include "kerf/session/session.h"
#include "session/blade_strip.h"
#include "session/make_session.h"

namespace kerf::blade_flanks_test {
namespace {

using test::make;

using testing_support::kFacingY;
constexpr double kHere = 0.002;  // m, x of the cut
/// Short steps take long under a sanitizer.
#ifdef __SANITIZE_ADDRESS__
const std::vector<double> kSteps{0.0167};
#else
const std::vector<double> kSteps{0.002, 0.0167};
#endif

/// Held at both ends.
Scene strip_scene(double time_step = 0.002) {
  Scene scene = testing_support::blade_strip(time_step, kHere);
  for (const double side : {-1.0, 1.0}) {
    SceneFix fix;
    fix.region.shape = SceneRegion::Shape::kHalfSpace;
    fix.region.point = {0.095 * side, 0, 0};
    fix.region.normal = {side, 0, 0};
    scene.fixes.push_back(fix);
  }
  scene.tools[0].thickness = 0.001;
  return scene;
}

void lead(Session& session, double over, Vec3 to) {
  SceneCommand command;
  command.what = SceneToolMotion{"tool", {{over, to, kFacingY}}};
  const Status done = session.apply(command);
  ASSERT_TRUE(done.ok()) << done.error().message;
}
int steps(const Session& session, double seconds) {
  return static_cast<int>(std::ceil(seconds / session.time_step() - 1e-9));
}

/// Where the lips of the slit are beside the blade, in its own frame (y), by linear interpolation along the rims; HUGE_VAL: none is there.
struct Lips {
  double left = -HUGE_VAL, right = HUGE_VAL;  ///< the nearest on the side of -y and of +y, by where their material lies
};
Lips lips_at(Session& session, double x) {
  const CollisionMesh& mesh = session.body().complex.collision;
  const std::vector<Vec3>& positions = session.collision_positions();
  const RigidPlace place{session.tools()[0].place.position, session.tools()[0].place.axes};
  Lips lips;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count()))
    for (int k = 0; k < 3; ++k) {
      const CollisionHalfEdge h = CollisionMesh::corner(f, k), n = CollisionMesh::next(h);
      if (mesh.twin[h].valid()) continue;
      const Vec3 a = place.to_local(positions[mesh.origin[h].index()]),
                 b = place.to_local(positions[mesh.origin[n].index()]);
      const Vec3 c = place.to_local(positions[mesh.origin[CollisionMesh::next(n)].index()]);
      if ((a.x < x) == (b.x < x) || std::fabs(b.y - a.y) > std::fabs(b.x - a.x)) continue;
      const double y = a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y);
      if (std::fabs(y) > 0.02) continue;
      if (c.y > std::max(a.y, b.y)) lips.right = std::min(lips.right, y);
      if (c.y < std::min(a.y, b.y)) lips.left = std::max(lips.left, y);
    }
  return lips;
}

constexpr double kWidth = 0.006;  // m, of the blade, from its edge to its back
/// How long a part of the blade's middle, from its edge to its back, lies in material, metres. Between the lips of an open slit none does.
double in_material(Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  const std::vector<Vec3>& positions = session.collision_positions();
  const RigidPlace place{session.tools()[0].place.position, session.tools()[0].place.axes};
  double sum = 0;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    std::vector<double> crossed;
    for (int k = 0; k < 3; ++k) {
      const CollisionHalfEdge h = CollisionMesh::corner(f, k);
      const Vec3 a = place.to_local(positions[mesh.from(h).index()]), b = place.to_local(positions[mesh.to(h).index()]);
      if ((a.y > 0) == (b.y > 0)) continue;
      const Vec3 p = lerp(a, b, a.y / (a.y - b.y));
      if (std::fabs(p.z) < 0.03) crossed.push_back(std::clamp(p.x, -kWidth, 0.0));
    }
    if (crossed.size() == 2) sum += std::fabs(crossed[1] - crossed[0]);
  }
  return sum;
}

void cut_half_way(Session& session) {
  lead(session, 0.2, {kHere, 0.004, -0.012});
  ASSERT_TRUE(session.step(steps(session, 0.3)).ok());
  ASSERT_TRUE(session.in_stroke());
  ASSERT_TRUE(session.validate().ok()) << session.validate().error().message;
}

/// Steps, and the greatest kinetic energy on the way, J.
double run(Session& session, double seconds) {
  double most = 0;
  for (int i = 0; i < steps(session, seconds); ++i) {
    const auto done = session.step();
    EXPECT_TRUE(done.ok());
    if (!done) return HUGE_VAL;
    most = std::max(most, done->mechanics.kinetic_energy);
  }
  return most;
}

TEST(BladeFlanks, OpenTheLips) {
  for (const double dt : kSteps) {
    Session session = make(strip_scene(dt));
    cut_half_way(session);
    const double most = run(session, 0.5);
    const Lips back = lips_at(session, -0.0055);
    const Vec3 f = session.tools()[0].force;
    EXPECT_LT(most, 2e-5) << dt << ": J; nothing jumps open";
    EXPECT_NEAR(back.right - back.left, 0.001 * 5.5 / 6, 0.0001) << dt << ": as far as the blade is thick there";
    EXPECT_LT(std::fabs(f.x), 0.025) << dt
                                     << ": with 0.01 to 0.05 N from either side; what is left over bends the strip";
    EXPECT_NEAR(f.x, session.support_force().x, 0.005) << dt << ": and its supports hold that";
  }
}

TEST(BladeFlanks, PushTheLipsAside) {
  for (const double dt : kSteps) {
    Scene scene = strip_scene(dt);
    scene.cut.resistance = 10;  // else the strip bows onto the edge, and is cut in a hook
    Session session = make(scene);
    cut_half_way(session);
    for (const double way : {0.003, -0.003}) {
      lead(session, 0.1, {kHere + way, 0.004, -0.012});
      const double most = run(session, 1.5);
      const Session::ToolState tool = session.tools()[0];
      const Vec3 held = session.support_force();
      const Lips back = lips_at(session, -0.0055);
      EXPECT_LT(most, 0.001) << dt << ": J; its 14 g would have 0.6 mJ at 0.3 m/s";
      EXPECT_LT(back.left, -0.0003) << dt;
      EXPECT_GT(back.right, 0.0003) << dt;
      EXPECT_LT(tool.force.x * way, -0.04 * std::fabs(way))
          << dt << ": the strip pushes back, with its slit a little longer: it bows onto the edge";
      EXPECT_NEAR(-tool.coupling_force.x, held.x, 0.002) << dt << ": with what its supports hold";
    }
    lead(session, 0.3, {kHere, 0.03, -0.012});
    const double most = run(session, 0.5);
    EXPECT_LT(most, 0.001) << dt;
    ASSERT_FALSE(session.in_stroke()) << dt;
    EXPECT_EQ(session.counts().pieces, 2) << dt;
    const Status valid = session.validate();
    EXPECT_TRUE(valid.ok()) << valid.error().message;
    // The stroke can be taken back and made again.
    const std::vector<Vec3> cut = session.node_positions();
    ASSERT_EQ(session.undo_depth(), 1);
    ASSERT_TRUE(session.undo().ok());
    EXPECT_EQ(session.counts().pieces, 1);
    EXPECT_TRUE(session.validate().ok());
    ASSERT_TRUE(session.redo().ok());
    EXPECT_EQ(session.counts().pieces, 2);
    EXPECT_EQ(session.node_positions(), cut);
    EXPECT_TRUE(session.step(5).ok());
  }
}

// A strand that is thinner than the strip is thick bows over the edge until its mid-surface turns over, with the border behind the end of the cut: nothing led on, and the blade
// left through it.
/// Areas of the pieces of the collision mesh, parts of the whole, largest first.
std::vector<double> shares(const Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  const Pieces pieces = collision_pieces(mesh);
  std::vector<double> area(static_cast<std::size_t>(pieces.count), 0.0);
  double whole = 0;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const auto at = [&](int k) { return mesh.rest[mesh.from(CollisionMesh::corner(f, k))]; };
    const double part = 0.5 * norm(cross(at(1) - at(0), at(2) - at(0)));
    area[static_cast<std::size_t>(piece_of_triangle(pieces, f))] += part;
    whole += part;
  }
  for (double& x : area) x /= whole;
  std::sort(area.rbegin(), area.rend());
  return area;
}

TEST(BladeFlanks, CutTheLastStrandToo) {
  for (const double over : {0.12, 0.15, 0.2, 0.3, 0.4}) {
    Scene scene = strip_scene(0.0167);
    scene.cut.resistance = 10;
    Session session = make(scene);
    cut_half_way(session);
    for (const double way : {0.003, -0.003}) {
      lead(session, 0.1, {kHere + way, 0.004, -0.012});
      run(session, 1.5);
    }
    lead(session, over, {kHere, 0.03, -0.012});
    run(session, 0.5);
    EXPECT_FALSE(session.in_stroke()) << over;
    // A strand that bows over the edge may leave a crumb, of the minimum feature's size.
    const std::vector<double> pieces = shares(session);
    ASSERT_GE(pieces.size(), 2u) << over;
    EXPECT_GT(pieces[1], 0.45) << over;
    EXPECT_GT(pieces[0] + pieces[1], 1 - 1e-4) << over;
    const Status valid = session.validate();
    EXPECT_TRUE(valid.ok()) << valid.error().message;
  }
}

/// A mat of 200 x 200 x 3 mm, held all around, with a slit in its middle and the scalpel at its end.
Session cut_mat(double dt) {
  Scene scene = strip_scene(dt);
  scene.body.model = "mat";
  scene.lattice.cells.reset();
  scene.material.young = 2e5;
  for (const double side : {-1.0, 1.0}) {
    SceneFix fix;
    fix.region.shape = SceneRegion::Shape::kHalfSpace;
    fix.region.point = {0, 0.095 * side, 0};
    fix.region.normal = {0, side, 0};
    scene.fixes.push_back(fix);
  }
  scene.tools[0].position = {kHere, -0.02, 0.03};
  scene.cut.resistance = 10;  // or the mat, pushed aside, would be cut on where it comes onto the edge
  scene.tools[0].stiffness = 5000;
  Session session = make(scene);
  lead(session, 0.2, {kHere, -0.02, -0.012});
  run(session, 0.3);
  EXPECT_TRUE(session.in_stroke());
  lead(session, 0.2, {kHere, 0.01, -0.012});
  run(session, 0.4);
  return session;
}

TEST(BladeFlanks, LetNoLipThrough) {
  for (const double dt : kSteps) {
    Session session = cut_mat(dt);
    for (const double way : {0.008, -0.008, 0.006}) {
      lead(session, 0.02, {kHere + way, 0.01, -0.012});
      const double most = run(session, 0.3);
      // The end of the slit lies beside the edge; lips that let the blade through lie in all of it.
      EXPECT_LT(in_material(session), 0.8 * kWidth) << dt << " " << way;
      EXPECT_LT(session.tools()[0].force.x * way, -1.0 * std::fabs(way)) << dt << " " << way << ": N, the mat holds it";
      EXPECT_LT(most, 0.02) << dt << ": J, as 0.12 kg of mat would have at 0.6 m/s";
    }
  }
}

/// The back meets the beginning of a slit when the blade is drawn back.
TEST(BladeFlanks, TheBackMeetsTheEndOfTheSlit) {
  Session session = cut_mat(0.0167);
  double touching = 0;
  for (const Session::ContactState& c : session.contacts()) touching -= c.force.y;
  EXPECT_LT(std::fabs(touching), 0.01);
  EXPECT_LT(std::fabs(session.tools()[0].force.y), 1.1 * 10 * 0.003)
      << "its edge alone is held back: resistance x thickness";
  lead(session, 0.2, {kHere, -0.02, -0.012});
  run(session, 0.4);
  const double force = session.tools()[0].force.y;
  EXPECT_GT(force, 0.1);
  EXPECT_NEAR(force, session.support_force().y, 0.05 * force);
}

TEST(BladeFlanks, TheSameBitsForAnyNumberOfThreadsAndAfterARestore) {
  std::uint64_t once = 0;
  for (const int threads : {1, 3}) {
    Scene scene = strip_scene();
    scene.simulation.threads = threads;
    Session session = make(scene);
    lead(session, 0.2, {kHere, 0.004, -0.012});
    run(session, 0.15);
    const auto snapshot = session.snapshot();
    const auto rest = [&] {
      run(session, 0.1);
      lead(session, 0.05, {kHere + 0.002, 0.004, -0.012});
      run(session, 0.2);
      return session.hash();
    };
    const std::uint64_t hash = rest();
    session.restore(snapshot);
    EXPECT_EQ(rest(), hash);
    if (once == 0) once = hash;
    EXPECT_EQ(hash, once);
  }
}

}  // namespace
}  // namespace kerf::blade_flanks_test
