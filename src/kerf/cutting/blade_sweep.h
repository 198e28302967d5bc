// From tool motion to a cut (paper 4.2.1; docs/cutting.md, "From tool motion to a cut path").
//
// A blade is a sharp edge, the segment base - tip. Between two poses it sweeps a surface; where that surface meets the
// deformed collision mesh, the mesh is cut. The cut follows the blade progressively: it ends where the blade is, inside
// a triangle if need be. That last bit is provisional: at the next pose it is rolled back and walked again, until the
// path crosses an edge or bends too much, and is committed.
//
// Parameters carry over from the deformed mesh to the rest configuration unchanged (affine in every triangle).
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "kerf/base/journal.h"
#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/cutting/blade_edge.h"
#include "kerf/cutting/cut_path.h"
#include "kerf/cutting/face_boxes.h"
#include "kerf/cutting/cut_stop.h"

namespace kerf {

/// Where a blade has come so near to a border that a cut which ends there is joined to it.
struct BladeTouch {
  RestPoint at;
  Vec3 border;  ///< the point of the border, at rest
};

/// Where the cut has got to in one layer, on the mesh without what is provisional: inside a face that its path began in or came into.
struct BladeFront {
  CutStop start;           ///< where its path goes on: its last vertex, or a point of a border that is not yet divided
  CollisionVertex before;   ///< the path's vertex before the last one, or none
  RestPoint end;        ///< where the blade was at the last pose
  Vec3 came;                ///< where the blade was when its path last went on, at rest
  bool in_slit = false;     ///< near the lip that its path begins on: it begins beside the end, maybe some faces away
  std::vector<Vec3> trail;  ///< the places of the end since the start, at rest
  std::optional<BladeTouch> touch;  ///< the nearest since the start
};

/// One stroke of a blade: its state between poses. Plain data.
struct BladeStroke {
  BladeEdge edge;                          ///< the last pose
  bool started = false;                    ///< `edge` holds a pose
  bool standing = false;                   ///< `edge` is the first pose: what it goes through there is stabbed by the first move
  bool through = false;                    ///< cut every layer the blade meets, not only the first from its base
  std::vector<CollisionVertex> fronts;     ///< where the cut has got to, one per layer; provisional ends included
  std::vector<BladeFront> ends;            ///< the same as seen from `mark`
  bool provisional = false;                ///< there is work after `mark` that the next pose may undo
  JournalMark mark;
};

/// What one pose did.
struct SweepReport {
  int steps = 0;         ///< collision triangles walked into, provisional ones included
  int refused = 0;       ///< degenerate steps that were rolled back, and all tries beside them; the front stopped there
  int retried = 0;       ///< steps that were refused and then done a minimum feature or two beside their place
  bool changed = false;  ///< the complex is not what it was before
};

/// What the sweep works on. `position` holds the deformed position of every collision vertex, metres; the sweep appends
/// those of new vertices.
struct SweepTarget {
  CellComplex& complex;
  std::vector<Vec3>& position;
  FaceBoxes& boxes;  ///< at `position`; the sweep marks what it cuts, the caller what `rollback` and others change
  CutScratch& scratch;
  const CutOptions& options;
  /// Brings all that follows the complex (hexahedra, embeddings) up to date and marks the journal there.
  std::function<JournalMark()> commit;
  /// Rolls everything back to a mark that `commit` returned.
  std::function<void(const JournalMark&)> rollback;
};

/// Moves the blade from its last pose to `edge`, cutting what it meets on the way. The first call places it; material
/// that it pierces from then on is stabbed, and where its length comes down on a vault two fronts go off to both sides (without `through`
/// the one towards the base: the other is where the edge comes out again). A step that can't be done without breaking an invariant is rolled back and
/// counted. Turning moves are divided, so that the swept surface is nearly flat in each part. After it returns, the
/// caller brings hexahedra and embeddings up to date (the provisional end included). Bad input: an edge without length
/// or with a coordinate that is not finite.
Result<SweepReport> move_blade(BladeStroke& stroke, const BladeEdge& edge, SweepTarget& target);

/// Ends the stroke; what was provisional stays.
void lift_blade(BladeStroke& stroke);

}  // namespace kerf
