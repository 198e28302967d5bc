// validate_binding must notice every single broken promise.
#include "kerf/binding/validate_binding.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/binding/bind.h"
#include "kerf/mesh/models.h"

namespace kerf::validate_binding_test {
namespace {

class ValidateBinding : public ::testing::Test {
 protected:
  static const CellComplex& good() {
    static const CellComplex complex = [] {
      const Model m = *make_model("steak", {});
      return bind(m.visual, m.collision, {})->complex;
    }();
    return complex;
  }
  template <class Damage>
  static std::string error_after(Damage&& damage) {
    CellComplex x = good();
    damage(x);
    const Status s = validate_binding(x);
    return s ? "" : s.error().message;
  }
  /// An inner collision half-edge with at least three inner chain vertices.
  static CollisionHalfEdge long_chain(const CellComplex& x) {
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(x.collision.half_edge_count()))
      if (x.collision.twin[h].valid() && x.collision.chain[h][0].count >= 3 && !x.collision.chain[h][0].reversed)
        return h;
    return {};
  }
  static VisualVertex free_vertex(const CellComplex& x) {
    for (const VisualVertex v : ids<VisualVertex>(x.visual.vertex_count()))
      if (x.visual.free[v]) return v;
    return {};
  }
};

TEST_F(ValidateBinding, AcceptsAFreshBody) {
  const Status s = validate_binding(good());
  EXPECT_TRUE(s.ok()) << s.error().message;
}

TEST_F(ValidateBinding, NoticesEveryDamage) {
  const auto contains = [](const std::string& message, const char* part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  contains(error_after([](CellComplex& x) {  // one unit in the last place, at one corner only
             const VisualHalfEdge h = x.visual.outgoing[free_vertex(x)];
             Vec2 p = x.visual.planar[h];
             p.x = std::nextafter(p.x, 10.0);
             x.visual.planar.set(h, p);
           }),
           "differ in one plane");
  contains(error_after([](CellComplex& x) {  // a whole vertex moved out of its fan
             const VisualVertex v = free_vertex(x);
             x.visual.for_each_outgoing(v, [&](VisualHalfEdge h) {
               x.visual.planar.set(h, {1, 1});
               return true;
             });
           }),
           "positively oriented");
  contains(error_after([](CellComplex& x) {
             const PoolRun run = x.collision.chain[long_chain(x)][0];
             const VisualVertex a = x.chain_pool[run.at(0)], b = x.chain_pool[run.at(1)];
             x.chain_pool.set(run.at(0), b);
             x.chain_pool.set(run.at(1), a);
           }),
           "neighbours");
  contains(error_after([](CellComplex& x) {
             const CollisionHalfEdge h = long_chain(x);
             auto chain = x.collision.chain[h];
             chain[0] = chain[0].flipped();
             x.collision.chain.set(h, chain);
           }),
           "twin has another chain");
  contains(error_after([](CellComplex& x) {
             const CollisionHalfEdge h = long_chain(x);
             auto chain = x.collision.chain[h];
             chain[1] = PoolRun{};
             x.collision.chain.set(h, chain);
           }),
           "chain missing");
  contains(error_after([](CellComplex& x) {
             const VisualHalfEdge h = x.visual.outgoing[free_vertex(x)];
             x.visual.barrier.set(h, 1);
             x.visual.barrier.set(x.visual.twin[h], 1);
           }),
           "barrier edges");
  contains(error_after([](CellComplex& x) { x.visual.free.set(free_vertex(x), 0); }), "free flag");
  contains(error_after([](CellComplex& x) {
             const PoolRun run = x.collision.free[CollisionTriangle(0)][0];
             x.free_pool.set(run.at(0), x.free_pool[run.at(1)]);
           }),
           "in two lists");
  contains(error_after([](CellComplex& x) {
             auto bound = x.collision.bound[CollisionVertex(0)];
             std::swap(bound[0], bound[1]);
             for (const CollisionVertex v : ids<CollisionVertex>(x.collision.vertex_count()))
               if (!x.collision.on_border(v)) {
                 bound = x.collision.bound[v];
                 std::swap(bound[0], bound[1]);
                 x.collision.bound.set(v, bound);
                 return;
               }
           }),
           "neighbours");
  contains(error_after([](CellComplex& x) { x.visual.twin.set(VisualHalfEdge(3), VisualHalfEdge(-1)); }), "twin");
  contains(error_after([](CellComplex& x) { x.closed = false; }), "side");
  contains(error_after([](CellComplex& x) { x.collision.planar.set(CollisionHalfEdge(1), {0, 0}); }), "oriented");
  contains(error_after([](CellComplex& x) {
             Vec2 p = x.collision.planar[CollisionHalfEdge(1)];
             p.x = std::nextafter(p.x, 10.0);
             x.collision.planar.set(CollisionHalfEdge(1), p);
           }),
           "not at its collision corner");
  EXPECT_NE(error_after([](CellComplex& x) {
              x.visual.patch.set(VisualTriangle(0), Patch{(x.visual.patch[VisualTriangle(0)].value + 2) % 20});
            }),
            "");
}

}  // namespace
}  // namespace kerf::validate_binding_test
