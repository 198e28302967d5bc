#include "cutting/cut_body.h"
#include "kerf/cutting/joined_lips.h"
#include "kerf/cutting/topology_change.h"
#include "kerf/embedding/owned_vertices.h"

namespace kerf::cut_journal_test {
namespace {

using namespace testing_support;

const std::vector<std::vector<Vec3>> kCuts = {
    {{-0.1, 0.43, 0}, {1.1, 0.47, 0}}, {{0.31, 0.63, 0}, {0.77, 0.2, 0}}, circle_points({0.5, 0.5, 0}, 0.3, 40),
    {{0.5, 0.5, 0}, {0.5, 1.2, 0}},    {{0.1, 0.1, 0}, {0.13, 0.12, 0}},  {{0.9, 0.9, 0}, {0.1, 0.1, 0}},
};

TEST(CutJournal, UndoAndRedoOfCutsRestoreTheBits) {
  for (const bool closed : {false, true}) {
    CutBody b = CutBody::sheet(3, closed);
    std::vector<std::uint64_t> states{hash_of(b.body)};
    std::vector<JournalStep> steps;
    for (const auto& path : kCuts) {
      JournalMark mark;
      journal_mark(b.body, mark);
      b.cut(path, false);
      steps.push_back(journal_take(b.body, mark));
      states.push_back(hash_of(b.body));
      EXPECT_NE(states.back(), states[states.size() - 2]);
    }
    for (std::size_t i = steps.size(); i-- > 1;) {
      journal_undo(b.body, steps[i]);
      EXPECT_EQ(hash_of(b.body), states[i]);
      b.expect_valid();
    }
    for (std::size_t i = 1; i < steps.size(); ++i) {
      journal_redo(b.body, steps[i]);
      EXPECT_EQ(hash_of(b.body), states[i + 1]);
    }
    b.expect_valid();
    for (std::size_t i = steps.size(); i-- > 0;) journal_undo(b.body, steps[i]);
    EXPECT_EQ(hash_of(b.body), states[0]);
  }
}

TEST(CutJournal, AProvisionalTipWalkedAgainLeavesNoTrace) {
  CutBody b = CutBody::sheet(3, true);
  CutBody direct = CutBody::sheet(3, true);
  JournalMark mark;
  journal_mark(b.body, mark);
  for (int i = 1; i <= 5; ++i) {
    journal_rollback(b.body, mark);
    b.cut({{0.3, 0.3, 0}, {0.3 + 0.08 * i, 0.3 + 0.03 * i, 0}}, false);
  }
  direct.cut({{0.3, 0.3, 0}, {0.3 + 0.08 * 5, 0.3 + 0.03 * 5, 0}});
  EXPECT_EQ(hash_of(b.body), hash_of(direct.body));
}

// A cut goes on from its tip, and one lip moves aside. Joined again, the tip lies midway.
TEST(CutJournal, JoinedLipsLieBetweenTheirPlaces) {
  CutBody b = CutBody::sheet(3, true);
  b.cut({{-0.1, 0.43, 0}, {0.4, 0.45, 0}}, false);
  CollisionMesh& mesh = b.body.collision;
  const std::size_t vertices = mesh.vertex_count();
  const auto origin = mesh.origin.mark();
  JournalMark mark;
  journal_mark(b.body, mark);
  b.cut({{0.4, 0.45, 0}, {0.7, 0.46, 0}}, false);
  const Vec3 aside{0.01, 0.04, 0};
  std::vector<Vec3> position = mesh.rest.raw();
  for (std::size_t v = vertices; v < position.size(); ++v) position[v] += aside;
  const auto lips = find_joined_lips(mesh, origin, vertices, position);
  journal_rollback(b.body, mark);
  position.resize(vertices);
  ASSERT_EQ(lips.size(), 1U);
  const CollisionVertex tip = lips[0].vertex;
  EXPECT_NEAR(norm(mesh.rest[tip] - Vec3{0.4, 0.45, 0}), 0, 1e-9);

  std::vector<Vec3> at = position;
  place_joined_lips(lips, at);
  for (CollisionVertex v(0); v.index() < vertices; ++v.value)
    EXPECT_TRUE(v == tip || at[v.index()] == position[v.index()]) << v.value;
  EXPECT_NEAR(norm(at[tip.index()] - position[tip.index()] - 0.5 * aside), 0, 1e-12);
}

/// Everything about a triangle that others may depend on, by value.
struct TriangleState {
  std::array<std::int32_t, 3> corner, twin;
  std::array<std::vector<std::int32_t>, 8> owned;
  bool operator==(const TriangleState&) const = default;
};
TriangleState state_of(const CellComplex& b, CollisionTriangle f) {
  TriangleState s;
  for (int i = 0; i < 3; ++i) {
    const CollisionHalfEdge h = CollisionMesh::corner(f, i);
    s.corner[static_cast<std::size_t>(i)] = b.collision.origin[h].value;
    s.twin[static_cast<std::size_t>(i)] = b.collision.twin[h].value;
    for (std::size_t side = 0; side < 2; ++side) {
      const PoolRun run = b.collision.chain[h][side];
      auto& list = s.owned[static_cast<std::size_t>(2 * i) + side];
      list.push_back(run.count);
      for (std::int32_t k = 0; k < run.count; ++k) list.push_back(b.chain_pool[run.at(k)].value);
    }
  }
  for (std::size_t side = 0; side < 2; ++side) {
    const PoolRun run = b.collision.free[f][side];
    for (std::int32_t k = 0; k < run.count; ++k) s.owned[6 + side].push_back(b.free_pool[run.at(k)].value);
    std::sort(s.owned[6 + side].begin(), s.owned[6 + side].end());
  }
  return s;
}

TEST(TopologyChange, NamesExactlyWhatDiffers) {
  for (const bool closed : {false, true}) {
    CutBody b = CutBody::sheet(3, closed);
    TopologyChange change;
    for (const auto& path : kCuts) {
      const CellComplex before = b.body;
      JournalMark mark;
      journal_mark(b.body, mark);
      b.cut(path, false);
      collect_topology_change(b.body, mark, b.scratch, change);
      EXPECT_EQ(change.triangles, changed_triangles(b.body, mark));
      EXPECT_EQ(change.first_new_collision_vertex.index(), before.collision.vertex_count());
      EXPECT_EQ(change.first_new_visual_vertex.index(), before.visual.vertex_count());
      for (std::size_t f = 0; f < b.body.collision.face_count(); ++f) {
        const CollisionTriangle t(f);
        const bool named = std::binary_search(change.triangles.begin(), change.triangles.end(), t);
        if (f >= before.collision.face_count()) {
          EXPECT_TRUE(named);
        } else if (!named) {
          EXPECT_TRUE(state_of(before, t) == state_of(b.body, t)) << "triangle " << f;
        }
      }
      // A cut is local.
      if (path.size() == 2 && norm(path[1] - path[0]) < 0.05) {
        EXPECT_LT(change.triangles.size(), 20u);
      }
      // Births: every new vertex once, and its rest position is the blend of its parents'.
      ASSERT_EQ(change.births.size(), b.body.collision.vertex_count() - before.collision.vertex_count());
      for (std::size_t i = 0; i < change.births.size(); ++i) {
        const VertexBirth& birth = change.births[i];
        EXPECT_EQ(birth.vertex.index(), before.collision.vertex_count() + i);
        Vec3 p;
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
          if (birth.parent[k].valid()) {
            EXPECT_LT(birth.parent[k], birth.vertex);
            p += birth.weight[k] * b.body.collision.rest[birth.parent[k]];
            sum += birth.weight[k];
          }
        EXPECT_NEAR(sum, 1, 1e-12);
        EXPECT_LT(norm(p - b.body.collision.rest[birth.vertex]), 1e-12);
      }
      // Every new visual vertex has an owner among the changed triangles.
      std::vector<bool> owned(b.body.visual.vertex_count(), false);
      for (const CollisionTriangle t : change.triangles)
        for_each_owned(b.body, t, [&](VisualVertex v, Ownership, CollisionHalfEdge) { owned[v.index()] = true; });
      for (std::size_t v = before.visual.vertex_count(); v < b.body.visual.vertex_count(); ++v)
        EXPECT_TRUE(owned[v]) << v;
      // Faces that are not named have the corners they had.
      for (std::size_t f = 0; f < before.visual.face_count(); ++f) {
        if (std::binary_search(change.visual_triangles.begin(), change.visual_triangles.end(), VisualTriangle(f)))
          continue;
        for (std::size_t i = 0; i < 3; ++i) {
          const VisualHalfEdge h(3 * f + i);
          EXPECT_EQ(before.visual.origin[h], b.body.visual.origin[h]);
          EXPECT_EQ(before.visual.texture[h], b.body.visual.texture[h]);
        }
      }
      // The undone step names the same old triangles.
      const std::vector<CollisionTriangle> forward = change.triangles;
      JournalStep step = journal_take(b.body, mark);
      journal_undo(b.body, step);
      collect_topology_change(b.body, step, b.scratch, change);
      for (const CollisionTriangle t : forward) {
        if (t.index() >= before.collision.face_count()) continue;
        EXPECT_TRUE(std::binary_search(change.triangles.begin(), change.triangles.end(), t));
      }
      journal_redo(b.body, step);
      collect_topology_change(b.body, step, b.scratch, change);
      EXPECT_EQ(change.triangles, forward);
      EXPECT_EQ(change.first_new_visual_vertex.index(), before.visual.vertex_count());
    }
  }
}

}  // namespace
}  // namespace kerf::cut_journal_test
