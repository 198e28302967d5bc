// What detection remembers of distances to meshes saves time only: with it and without it the contacts are the same, to the bit.
#include "kerf/contact/clearance.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

#include "contact/bare_surface.h"
#include "contact/shapes_for_tests.h"

namespace kerf::clearance_test {
namespace {

using testing_support::BareSurface;
using testing_support::plain_grid_mesh;
using testing_support::prepared;
using testing_support::random_rotation;
using testing_support::random_vector;
using testing_support::shape_of;

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

void expect_same(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].key, b[i].key);
    EXPECT_TRUE(same_bits(a[i].gap, b[i].gap) && same_bits(a[i].normal, b[i].normal) &&
                same_bits(a[i].point, b[i].point) && same_bits(a[i].a.weight, b[i].a.weight) &&
                same_bits(a[i].a.lift, b[i].a.lift))
        << "contact " << i;
    EXPECT_EQ(a[i].a.vertex, b[i].a.vertex);
  }
}

// Sheets of large and of small triangles, near meshes that move; slowly, fast, and by jumps; the meshes change places in the list, and bodies vertices.
TEST(Clearance, ChangesNoContact) {
  std::size_t contacts = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    Random random(seed);
    const auto sheet = [&](int n) { return BareSurface(plain_grid_mesh(n, n), seed % 2 == 0 ? 0.004 : 0.03); };
    BareSurface large = sheet(6), small = sheet(20);
    std::vector<RigidShape> shapes{
        shape_of(mesh_part(prepared(testing_support::ball_mesh(0.2)), {0.02, 0, 0}, random_rotation(random))),
        shape_of(mesh_part(prepared(testing_support::box_mesh({0.2, 0.1, 0.05})))),
        shape_of(mesh_part(prepared(testing_support::box_mesh({0.01, 0.01, 0.05})), {}, random_rotation(random)))};
    for (RigidShape& s : shapes) s.position = {0.5, 0.5, -0.2};
    shapes[1].position = {0.3, 0.6, 0.12};
    // A peg between the vertices of large triangles: at the middle of an edge, or of a face.
    shapes[2].position =
        seed % 4 < 2 ? Vec3{2.5 / 6, 4.0 / 6, -0.04} : Vec3{(2 + 1.0 / 3) / 6, (3 + 2.0 / 3) / 6, -0.04};
    DetectMemory memory;
    DetectWorkspace warm;
    const double pace = std::pow(10.0, random.uniform(-4.5, -2));
    for (int step = 0; step < 80; ++step) {
      BareSurface& body = step % 30 < 20 ? large : small;
      for (std::size_t v = 0; v < body.position.size(); ++v) {
        body.position[v] += random_vector(random, pace);
        body.predicted[v] = body.position[v] + random_vector(random, pace);
      }
      for (RigidShape& s : shapes) {
        s.velocity = random_vector(random, 100 * pace);
        s.position += random_vector(random, pace);
        if (random.uniform(0, 1) < 0.03) s.axes = random_rotation(random);
        if (random.uniform(0, 1) < 0.03) s.position += random_vector(random, 0.05);
      }
      if (step % 25 == 24) std::swap(shapes[0], shapes[1]);
      const SurfaceState state = body.state();
      DetectOptions options;
      options.self_contact = false;
      options.step = 1e-2;
      DetectMemory again = memory;
      DetectWorkspace cold;
      std::vector<Contact> expected, found;
      detect(std::span(&state, 1), shapes, {}, options, again, cold, expected);
      detect(std::span(&state, 1), shapes, {}, options, memory, warm, found);
      expect_same(expected, found);
      EXPECT_TRUE(again == memory);
      contacts += found.size();
      if (HasFailure()) FAIL() << "seed " << seed << " step " << step;
    }
  }
  EXPECT_GT(contacts, 20000u);
}

// Never more than there is, wherever the mesh lies and however far the vertex went.
TEST(Clearance, IsNoMoreThanTheDistance) {
  Random random(3);
  const auto mesh = prepared(testing_support::ball_mesh(0.2));
  const CollisionVertex v(0);
  int told = 0;
  for (int round = 0; round < 2000; ++round) {
    Clearance known;
    known.is_of(mesh, 1);
    EXPECT_FALSE(known.least(v, random_vector(random, 1)) > 0);
    Vec3 p = random_vector(random, 0.5);
    const auto distance = [&](Vec3 x) { return mesh->tree.closest(mesh->view(), x).distance; };
    known.set(v, p, distance(p), nullptr);
    for (int i = 0; i < 5; ++i) {
      const double least = known.least(v, p);
      EXPECT_LE(least, distance(p));
      told += least > 0.5 * distance(p) ? 1 : 0;
      p += random_vector(random, 0.02);
    }
    known.is_of(prepared(testing_support::ball_mesh(0.3)), 1);
    EXPECT_FALSE(known.least(v, p) > 0) << "of another mesh";
  }
  EXPECT_GT(told, 6000);
}

}  // namespace
}  // namespace kerf::clearance_test
