// Passes over contacts come to their end: rows push or are open, none pulls, however many lean on the same nodes.
#include "kerf/mechanics/pass_length.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/random.h"
#include "mechanics/contact_bodies.h"

namespace kerf::pass_length_test {
namespace {

using test::Grid;
using test::Plane;

constexpr Vec3 kCell{0.01, 0.01, 0.01};

Vec3 unit(Random& random) {
  for (;;) {
    const Vec3 v{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (dot(v, v) > 0.01 && dot(v, v) < 1) return normalized(v);
  }
}

/// A free block that flies into planes from all sides, with two to ten rows a node.
struct Cage {
  Grid g{3, 2, 1};
  MechanicsModel model;
  MechanicsState state;
  ContactSet set;

  Cage(Random& random, double friction) : model(test::make_box(g, kCell, material(random))) {
    state = rest_state(model);
    for (Vec3& v : state.velocities)
      v = {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
    set.options.stiffness = random.uniform(10, 300);
    for (std::uint64_t key = 0; key < 80; ++key) {
      Plane plane;
      plane.normal = unit(random);
      plane.friction = friction;
      const HexId cell = g.cell(random.index(g.nx), random.index(g.ny), 0);
      const Vec3 xi{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
      test::add_plane_row(model, state, cell, xi, plane, key, set);
      set.rows.back().gap = random.uniform(0, 1e-3);
    }
  }
  static Material material(Random& random) {
    Material m;
    m.young = 1e4 * std::pow(10, random.uniform(0, 2));
    return m;
  }
};

struct Outcome {
  double pull = 0;        ///< the most that a row pulls with, parts of the most that one pushes with
  double overlooked = 0;  ///< m: the deepest overlap of a row that pushes with nothing
  int passes = 0;
};
Outcome outcome(Cage& cage, const StepOptions& o) {
  StepWorkspace w;
  const Result<StepReport> report = step(cage.model, cage.state, o, w, &cage.set);
  EXPECT_TRUE(report.ok());
  Outcome out;
  double most = 0, pull = 0;
  for (std::size_t r = 0; r < cage.set.rows.size(); ++r) {
    const ContactResult& result = w.contact.results[r];
    const double push = dot(result.force, cage.set.rows[r].normal);
    most = std::max(most, push);
    pull = std::max(pull, -push);
    if (push == 0) out.overlooked = std::max(out.overlooked, -result.end_gap);
  }
  if (most > 0) out.pull = pull / most;
  out.passes = report->passes;
  return out;
}

/// Solved directly, passes end only where nothing changes by more than rounding: then there is one solution, and it is found.
TEST(PassLength, WithoutFrictionEveryRowPushesOrIsOpen) {
  Random random(3);
  for (int trial = 0; trial < 300; ++trial) {
    Cage cage(random, 0);
    cage.set.options.passes = 16;
    StepOptions o;
    o.dt = random.uniform(0.001, 0.0167);
    o.solver = SolverKind::kDirect;
    const Outcome out = outcome(cage, o);
    EXPECT_LT(out.pull, 1e-6) << trial;
    EXPECT_LT(out.overlooked, 1e-9) << trial;
    EXPECT_LT(out.passes, 48) << trial;
  }
}

/// As steps are solved. Limits of friction change with every pass, so some rows pull in the end.
TEST(PassLength, WithFrictionFewRowsPull) {
  Random random(4);
  int pulled = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Cage cage(random, 0.3);
    StepOptions o;
    o.dt = random.uniform(0.001, 0.0167);
    o.tolerance = 1e-3;  // of points of bodies that touch each other
    const Outcome out = outcome(cage, o);
    pulled += out.pull > 0.02 ? 1 : 0;
  }
  EXPECT_LE(pulled, 60);  // 170 where each pass goes all of its way, and rows only join from the seventh on
}

}  // namespace
}  // namespace kerf::pass_length_test
