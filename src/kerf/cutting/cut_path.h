// The front of cutting: start a path and lead it on, one triangle at a time, on the live mesh in the rest
// configuration (4.2.1, 4.2.2). Collision mesh, visual mesh, walls and ownership are changed together.
#pragma once

#include <array>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_options.h"
#include "kerf/cutting/cut_scratch.h"

namespace kerf {

/// A point of the collision mesh: barycentric weights (sum 1, >= 0) at the corners of a triangle.
struct FacePoint {
  CollisionTriangle face;
  std::array<double, 3> weights{};
};

/// Where a stab enters: the corner, edge point or new inner vertex at `at`, by the tolerances: within the minimum feature
/// of a corner that corner (twice that for a point on a border, or the repeat of a cut would shave off a sliver),
/// within it of an edge a new vertex on the edge, on a border the one to start from. Nothing is opened yet.
/// Error: a point outside the mesh, a refused degenerate case; then roll the journal back.
Result<CollisionVertex> start_cut(CellComplex& body, const FacePoint& at, const CutOptions& options, CutScratch& scratch);

struct Advance {
  enum class Kind {
    kNothing,  ///< the blade moved too little
    kInside,   ///< the tip is a new vertex inside the triangle
    kAtEdge,   ///< the tip is a vertex on the triangle's boundary (an edge was crossed, or a corner or border reached)
    kRanOut,   ///< the tip was on a border, so it fell apart: the path ends here (see for_each_twin to go on)
  };
  CollisionVertex tip;
  Kind kind = Kind::kNothing;
  bool opened = false;     ///< an edge was opened; false also when the path ran along a border
  bool on_border = false;  ///< the tip is on a border other than its own path's end
};

/// Leads the path from `tip` to `target`, a point of a triangle of tip's fan: inside it, or on the edge opposite to tip
/// (weight of tip 0; then the path crosses that edge). Snaps to corners and edges by the tolerances and opens the new
/// path edge at once. Cost: local.
/// Error: target's triangle does not touch tip, NaN weights, a refused degenerate case; then roll the journal back.
Result<Advance> advance_cut(CellComplex& body, CollisionVertex tip, const FacePoint& target, const CutOptions& options,
                            CutScratch& scratch);

/// Calls f(w) for every other vertex that was split off from the same place as v: the same point on the other lips.
/// Cost: one look at every collision vertex.
template <class Fn>
void for_each_twin(const CellComplex& body, CollisionVertex v, Fn&& f) {
  const CollisionMesh& mesh = body.collision;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(mesh.vertex_count()); ++i)
    if (i != v.value && mesh.ancestor[CollisionVertex(i)] == mesh.ancestor[v]) f(CollisionVertex(i));
}

}  // namespace kerf
