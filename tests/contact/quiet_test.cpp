// What detection knows of the calls before must not change what it finds: every call is repeated with a workspace that knows nothing.
#include <gtest/gtest.h>

#include <cmath>

#include "cutting/cut_body.h"
#include "kerf/base/random.h"
#include "kerf/contact/detect.h"
#include "kerf/cutting/topology_change.h"

namespace kerf::quiet_test {
namespace {

using testing_support::CutBody;
using testing_support::plain_grid_mesh;
using testing_support::SyntheticOptions;

struct MovingBody {
  CutBody cut;
  ContactSurface surface;
  std::vector<Vec3> position, offset, predicted;
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts, anew;
  std::size_t most = 0;

  MovingBody(int grid, double radius) : cut(plain_grid_mesh(grid, grid), options(radius)) {
    surface = make_contact_surface(cut.body.collision);
  }
  static SyntheticOptions options(double radius) {
    SyntheticOptions o;
    o.subdivisions = 2;
    o.closed = false;
    o.thickness = 2 * radius;
    return o;
  }
  void make_cut(const std::vector<Vec3>& points) {
    JournalMark mark;
    journal_mark(cut.body, mark);
    cut.cut(points);
    update_contact_surface(cut.body.collision, changed_triangles(cut.body, mark), surface);
  }
  /// f(rest, side of the cut): where a vertex is; offsets follow the normals.
  template <class Fn>
  void place(Fn&& f) {
    const std::vector<Vec3> before = position;
    position.assign(surface.vertex_count(), {});
    std::vector<Vec3> normal(surface.vertex_count());
    for (const CollisionTriangle t : ids<CollisionTriangle>(surface.face_count())) {
      const auto c = surface.vertices(t);
      const double middle = (surface.rest[c[0]].x + surface.rest[c[1]].x + surface.rest[c[2]].x) / 3;
      std::array<Vec3, 3> p;
      for (std::size_t i = 0; i < 3; ++i) position[c[i].index()] = p[i] = f(surface.rest[c[i]], middle > 0.5 ? 1 : -1);
      for (const CollisionVertex v : c) normal[v.index()] += cross(p[1] - p[0], p[2] - p[0]);
    }
    offset.resize(position.size());
    predicted = position;
    for (std::size_t v = 0; v < position.size(); ++v) {
      offset[v] = surface.radius.raw()[v] * normalized(normal[v]);
      if (v < before.size()) predicted[v] += position[v] - before[v];
    }
  }
  /// As when a step is taken again in parts: from the same places, with the memory from before.
  void detect_again(double part) {
    const DetectMemory before = memory;
    const std::vector<Vec3> end = predicted;
    detect_twice();
    for (const double some : {part, 1.3 * part}) {
      memory = before;
      for (std::size_t v = 0; v < position.size(); ++v) predicted[v] = lerp(position[v], end[v], some);
      detect_twice();
    }
  }
  void detect_twice() {
    const SurfaceState state{&surface, position, offset, predicted};
    DetectMemory other = memory;
    DetectWorkspace fresh;
    const DetectReport a = detect(std::span(&state, 1), {}, {}, {}, memory, workspace, contacts);
    const DetectReport b = detect(std::span(&state, 1), {}, {}, {}, other, fresh, anew);
    ASSERT_EQ(contacts.size(), anew.size());
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Contact &x = contacts[i], &y = anew[i];
      ASSERT_EQ(x.key, y.key);
      if (i > 0) {
        ASSERT_LT(contacts[i - 1].key, x.key);
      }
      ASSERT_EQ(x.gap, y.gap);
      ASSERT_EQ(x.normal, y.normal);
      ASSERT_EQ(x.point, y.point);
    }
    ASSERT_EQ(memory, other);
    ASSERT_EQ(a.deepest, b.deepest);
    most = std::max(most, contacts.size());
  }
};

/// Lips that are pulled apart, lifted, pushed over each other, pressed and put back, on a sheet that bends and trembles.
TEST(Quiet, FindsTheSameContactsAsAWorkspaceThatKnowsNothing) {
  for (const auto& [radius, grid] : {std::pair{0.004, 6}, std::pair{0.03, 10}, std::pair{0.1, 6}}) {
    MovingBody body(grid, radius);
    Random random(static_cast<std::uint64_t>(1000 * radius) + static_cast<std::uint64_t>(grid));
    body.make_cut({{0.47, -0.1, 0}, {0.52, 0.3, 0}, {0.48, 0.62, 0}});
    Vec3 lift, lift_to;
    double bend = 0, bend_to = 0;
    for (int i = 0; i < 160; ++i) {
      if (i % 20 == 0) {
        const double far = 3 * radius;
        lift_to = {random.uniform(-far, far), random.uniform(-far, far), random.uniform(-far, far)};
        bend_to = random.uniform(-3, 3);
        if (i % 60 == 40) lift_to = {}, bend_to = 0;
      }
      if (i == 70) body.make_cut({{-0.1, 0.55, 0}, {0.5, 0.5, 0}, {1.1, 0.45, 0}});
      if (i == 110) body.memory.contacts.clear();
      lift = lerp(lift, lift_to, 0.1);
      bend = 0.9 * bend + 0.1 * bend_to;
      const double tremble = 0.002 * radius;
      body.place([&](Vec3 p, int side) {
        const double open = std::max(0.0, 0.62 - p.y);
        Vec3 x =
            p + (side * open) * lift + Vec3{tremble * std::sin(40 * p.x + i), 0, tremble * std::sin(50 * p.y + 2 * i)};
        const double a = bend * (x.x - 0.5);
        const double height = x.z;
        if (std::fabs(bend) > 1e-3)
          x = Vec3{0.5 + std::sin(a) / bend - height * std::sin(a), x.y,
                   (1 - std::cos(a)) / bend + height * std::cos(a)};
        return x;
      });
      if (i % 5 == 2) body.detect_again(i % 3 == 0 ? 1.5 : 0.25);
      else body.detect_twice();
      if (testing::Test::HasFatalFailure()) FAIL() << "radius " << radius << ", grid " << grid << ", call " << i;
    }
    EXPECT_GT(body.most, 10u) << radius << " " << grid;
  }
}

/// Cuts that are made one after the other with pauses of all lengths, so that leaves change, settle and change again, while the body bends and
/// opens: what is known of one side of a pair must not outlive a change of the other.
TEST(Quiet, FindsTheSameContactsWhileCutsAreMade) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const double radius = 0.03;
    MovingBody body(9, radius);
    Random random(seed);
    body.make_cut({{0.47, -0.1, 0}, {0.52, 0.3, 0}, {0.48, 0.62, 0}});
    int next = 0, cuts = 0;
    double bend = 0;
    for (int i = 0; i < 150; ++i) {
      if (i == next) {
        const Vec3 at{random.uniform(0.3, 0.7), random.uniform(0.2, 0.8), 0};
        const double angle = random.uniform(0, 6.28), length = random.uniform(0.02, 0.3);
        body.make_cut({at, at + length * Vec3{std::cos(angle), std::sin(angle), 0}});
        next = i + 1 + static_cast<int>(random.uniform(0, ++cuts % 3 == 0 ? 20 : 4));
      }
      bend = 0.95 * bend + 0.05 * random.uniform(-3, 3);
      body.place([&](Vec3 p, int side) {
        Vec3 x = p + (side * 3 * radius * std::max(0.0, 0.62 - p.y)) * Vec3{std::sin(0.11 * i), 0, std::sin(0.07 * i)};
        const double a = bend * (x.x - 0.5), height = x.z;
        if (std::fabs(bend) > 1e-3)
          x = Vec3{0.5 + std::sin(a) / bend - height * std::sin(a), x.y,
                   (1 - std::cos(a)) / bend + height * std::cos(a)};
        return x;
      });
      body.detect_twice();
      if (testing::Test::HasFatalFailure()) FAIL() << "seed " << seed << ", call " << i;
    }
    EXPECT_GT(body.most, 10u) << seed;
    EXPECT_GT(cuts, 15) << seed;
  }
}

/// A coil that winds up until its layers touch, without any cut.
TEST(Quiet, SeesACoilClose) {
  for (const double radius : {0.01, 0.03}) {
    MovingBody body(10, radius);
    for (int i = 0; i < 150; ++i) {
      const double pitch = radius * (8 - 0.042 * i) / (2 * 3.14159265358979), inner = 3 * radius;
      body.place([&](Vec3 p, int) {
        const double angle = (-inner + std::sqrt(inner * inner + 2 * pitch * p.x)) / pitch, r = inner + pitch * angle;
        return Vec3{r * std::cos(angle), p.y, r * std::sin(angle)};
      });
      body.detect_twice();
      if (testing::Test::HasFatalFailure()) FAIL() << "radius " << radius << ", call " << i;
    }
    EXPECT_GT(body.most, 10u);
  }
}

}  // namespace
}  // namespace kerf::quiet_test
