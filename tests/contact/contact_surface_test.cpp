// The surface follows cuts locally: equal to one made anew, to the bit, after cuts, undo and redo.
#include <gtest/gtest.h>

#include <cmath>

#include "contact/shapes_for_tests.h"
#include "cutting/cut_body.h"
#include "kerf/contact/detect.h"
#include "kerf/contact/rest_neighbours.h"
#include "kerf/cutting/topology_change.h"

namespace kerf::contact_surface_test {
namespace {

using testing_support::CutBody;
using testing_support::SyntheticOptions;

void expect_equal(const ContactSurface& a, const ContactSurface& b) {
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.twin, b.twin);
  EXPECT_EQ(a.outgoing, b.outgoing);
  EXPECT_EQ(a.rest, b.rest);
  EXPECT_EQ(a.offset, b.offset);
  EXPECT_EQ(a.radius, b.radius);
  EXPECT_EQ(a.root, b.root);
  EXPECT_EQ(a.cut, b.cut);
  EXPECT_EQ(a.on_cut, b.on_cut);
  EXPECT_EQ(a.coarse, b.coarse);
  EXPECT_EQ(a.node_open, b.node_open);
  EXPECT_EQ(a.tree.first, b.tree.first);
  EXPECT_EQ(a.tree.next, b.tree.next);
}

std::vector<Contact> contacts_of(const ContactSurface& surface, std::uint64_t seed) {
  Random random(seed);
  std::vector<Vec3> position = surface.rest.raw(), offset = surface.offset.raw();
  for (Vec3& p : position) p.z += 0.1 * std::sin(9 * p.x) * std::cos(7 * p.y);
  const auto shapes = testing_support::one_of_each(random, {0.5, 0.5, 0.05}, 0.2);
  const SurfaceState state{&surface, position, offset, position};
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  detect(std::span(&state, 1), shapes, {}, {}, memory, workspace, contacts);
  return contacts;
}

void expect_same(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].key, b[i].key);
    EXPECT_EQ(a[i].gap, b[i].gap);
    EXPECT_EQ(a[i].normal, b[i].normal);
    EXPECT_EQ(a[i].point, b[i].point);
    EXPECT_EQ(a[i].a.vertex, b[i].a.vertex);
    EXPECT_EQ(a[i].b.weight, b[i].b.weight);
  }
}

TEST(ContactSurface, FollowsRandomCutsUndoAndRedo) {
  int cuts = 0, rims = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    SyntheticOptions options;
    options.subdivisions = 2;
    options.closed = seed % 2 == 0;
    options.thickness = random.uniform(0.02, 0.2);
    CutBody cut(testing_support::sheet_65_mesh(), options);
    ContactSurface surface = make_contact_surface(cut.body.collision);
    const ContactSurface uncut = surface;
    JournalMark start;
    journal_mark(cut.body, start);
    for (int k = 0; k < 8; ++k) {
      JournalMark mark;
      journal_mark(cut.body, mark);
      std::vector<Vec3> path;
      for (int i = 0; i < 3; ++i) path.push_back({random.uniform(-0.1, 1.1), random.uniform(-0.1, 1.1), 0});
      cut.cut(path, false);
      const auto changed = changed_triangles(cut.body, mark);
      update_contact_surface(cut.body.collision, changed, surface);
      cuts += changed.empty() ? 0 : 1;
      ContactSurface anew = uncut;
      rebuild_contact_surface(cut.body.collision, anew);
      expect_equal(surface, anew);
      // Every second provisional cut is taken back again.
      if (k % 2 == 1) {
        journal_rollback(cut.body, mark);
        update_contact_surface(cut.body.collision, changed, surface);
        anew = uncut;
        rebuild_contact_surface(cut.body.collision, anew);
        expect_equal(surface, anew);
      }
      if (HasFailure()) return;
    }
    expect_same(contacts_of(surface, seed), [&] {
      ContactSurface anew = uncut;
      rebuild_contact_surface(cut.body.collision, anew);
      return contacts_of(anew, seed);
    }());
    for (const std::uint8_t c : surface.cut) rims += c;
    // Back to the beginning: nothing is left of the cuts.
    const auto changed = changed_triangles(cut.body, start);
    JournalStep step = journal_take(cut.body, start);
    journal_undo(cut.body, step);
    update_contact_surface(cut.body.collision, changed, surface);
    expect_equal(surface, uncut);
    expect_same(contacts_of(surface, seed), contacts_of(uncut, seed));
    journal_redo(cut.body, step);
    update_contact_surface(cut.body.collision, changed, surface);
    ContactSurface anew = uncut;
    rebuild_contact_surface(cut.body.collision, anew);
    expect_equal(surface, anew);
  }
  EXPECT_GT(cuts, 60);
  EXPECT_GT(rims, 300);
}

TEST(ContactSurface, OnlyCutEdgesAreRims) {
  for (const bool closed : {false, true}) {
    SyntheticOptions options;
    options.subdivisions = 2;
    options.closed = closed;
    CutBody cut(testing_support::plain_grid_mesh(6, 6), options);
    ContactSurface surface = make_contact_surface(cut.body.collision);
    for (const std::uint8_t c : surface.cut) EXPECT_EQ(c, 0);
    JournalMark mark;
    journal_mark(cut.body, mark);
    cut.cut({{0.31, -0.1, 0}, {0.37, 1.1, 0}});
    update_contact_surface(cut.body.collision, changed_triangles(cut.body, mark), surface);
    double length = 0;
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(surface.origin.size())) {
      if (surface.cut[h] == 0) continue;
      EXPECT_FALSE(surface.twin[h].valid());
      length += norm(surface.rest[surface.to(h)] - surface.rest[surface.from(h)]);
    }
    EXPECT_NEAR(length, 2 * std::hypot(1, 0.05), 0.02);
  }
}

}  // namespace
}  // namespace kerf::contact_surface_test
