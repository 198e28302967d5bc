// validate_complex must see what it is there to see: every kind of damage is made on purpose.
#include <functional>

#include "cutting/cut_body.h"

namespace kerf::invariants_test {
namespace {

using namespace testing_support;

struct Damage {
  const char* name;
  std::function<void(CellComplex&)> make;
};

TEST(ValidateComplex, SeesEveryKindOfDamage) {
  using VH = VisualHalfEdge;
  using CH = CollisionHalfEdge;
  const auto first_border = [](const CellComplex& b) {
    for (std::int32_t i = 0;; ++i)
      if (b.collision.wall[CH(i)].valid()) return CH(i);
  };
  const Damage damages[] = {
      {"twin", [](CellComplex& b) { b.visual.twin.set(VH(7), VH{}); }},
      {"a fan that starts nowhere", [](CellComplex& b) { b.visual.outgoing.set(VisualVertex(7), VH{}); }},
      {"a collision fan that starts nowhere",
       [](CellComplex& b) { b.collision.outgoing.set(CollisionVertex(2), CH{}); }},
      {"twins parted",
       [](CellComplex& b) {
         b.visual.twin.set(b.visual.twin[VH(7)], VH{});
         b.visual.twin.set(VH(7), VH{});
       }},
      {"origin", [](CellComplex& b) { b.visual.origin.set(VH(7), b.visual.origin[VisualMesh::next(VH(7))]); }},
      {"planar moved at one corner",
       [](CellComplex& b) {
         b.visual.planar.set(VH(11), b.visual.planar[VH(11)] + Vec2{1e-15, 0});
       }},
      {"3D point moved",
       [](CellComplex& b) {
         b.visual.rest.set(VisualVertex(90), b.visual.rest[VisualVertex(90)] + Vec3{0, 0, 1e-2});
       }},
      {"not a number",
       [](CellComplex& b) {
         b.visual.rest.set(VisualVertex(90), Vec3{NAN, 0, 0});
       }},
      {"free flag", [](CellComplex& b) { b.visual.free.set(b.free_pool[PoolIndex(0)], 0); }},
      {"free vertex listed twice", [](CellComplex& b) { b.free_pool.set(PoolIndex(1), b.free_pool[PoolIndex(0)]); }},
      {"lists swapped",
       [](CellComplex& b) {
         const auto one = b.collision.free[CollisionTriangle(0)];
         b.collision.free.set(CollisionTriangle(0), b.collision.free[CollisionTriangle(1)]);
         b.collision.free.set(CollisionTriangle(1), one);
       }},
      {"chain order",
       [](CellComplex& b) {
         const VisualVertex v = b.chain_pool[PoolIndex(0)];
         b.chain_pool.set(PoolIndex(0), b.chain_pool[PoolIndex(1)]);
         b.chain_pool.set(PoolIndex(1), v);
       }},
      {"chain missing", [](CellComplex& b) { b.collision.chain.set(CH(0), {}); }},
      {"barrier missing",
       [](CellComplex& b) {
         for (std::int32_t i = 0;; ++i)
           if (b.visual.barrier[VH(i)]) return b.visual.barrier.set(VH(i), 0);
       }},
      {"bound swapped",
       [](CellComplex& b) {
         const auto v = b.collision.bound[CollisionVertex(0)];
         b.collision.bound.set(CollisionVertex(0), b.collision.bound[CollisionVertex(1)]);
         b.collision.bound.set(CollisionVertex(1), v);
       }},
      {"patch", [](CellComplex& b) { b.visual.patch.set(VisualTriangle(3), b.visual.patch[VisualTriangle(100)]); }},
      {"root", [](CellComplex& b) { b.collision.root.set(CollisionTriangle(3), RootId(4)); }},
      {"wall forgotten", [&](CellComplex& b) { b.collision.wall.set(first_border(b), WallId{}); }},
      {"wall on another edge", [&](CellComplex& b) { b.wall_edge.set(WallId(0), CH(0)); }},
      {"line forgotten", [&](CellComplex& b) { b.collision.line.set(b.collision.from(first_border(b)), PoolRun{}); }},
      {"wall list empty",
       [&](CellComplex& b) {
         b.wall_inner.set(WallId(0), PoolRun{0, 0, false});
       }},
      {"collision fan",
       [](CellComplex& b) { b.collision.outgoing.set(CollisionVertex(2), b.collision.outgoing[CollisionVertex(3)]); }},
      {"texture not finite",
       [](CellComplex& b) {
         b.visual.texture.set(VH(5), Vec2f{INFINITY, 0});
       }},
  };
  CutBody b = CutBody::sheet(3, true);
  b.cut({{0.2, 0.3, 0}, {0.8, 0.61, 0}});
  b.cut({{-0.1, 0.73, 0}, {1.1, 0.73, 0}});
  ASSERT_EQ(b.refused, 0);
  ASSERT_EQ(b.pieces(), 2);
  for (const Damage& damage : damages) {
    JournalMark mark;
    journal_mark(b.body, mark);
    damage.make(b.body);
    EXPECT_FALSE(validate_complex(b.body, b.start).ok()) << damage.name;
    journal_rollback(b.body, mark);
    b.expect_valid();
  }
  ComplexMeasures other = b.start;
  other.volume *= 1 + 1e-8;
  EXPECT_FALSE(validate_complex(b.body, other).ok());
  other = b.start;
  other.skin_area *= 1 + 1e-8;
  EXPECT_FALSE(validate_complex(b.body, other).ok());
}

}  // namespace
}  // namespace kerf::invariants_test
