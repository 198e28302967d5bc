// From tool motion to a cut (paper 4.2.1; docs/cutting.md, "From tool motion to a cut path").
//
// A blade is a sharp edge, the segment base - tip. Between two poses it sweeps a surface; where that surface meets the
// deformed collision mesh, the mesh is cut. The cut follows the blade progressively: it ends where the blade is, inside
// a triangle if need be. That last bit is provisional. A move is three steps, and what follows the mesh (positions, boxes,
// hexahedra) is brought up to date by the caller after each:
//
//   take back    if `provisional`: the journal is rolled back to `mark`
//   lead_blade   cuts up to the last edges that the paths cross; then the journal is marked
//   make_ends    cuts on from there to where the blade is
//
// Parameters carry over from the deformed mesh to the rest configuration unchanged (affine in every triangle).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kerf/base/journal.h"
#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/cutting/blade_edge.h"
#include "kerf/cutting/blade_front.h"
#include "kerf/cutting/blade_move.h"
#include "kerf/cutting/cut_options.h"
#include "kerf/cutting/cut_scratch.h"
#include "kerf/cutting/face_boxes.h"
#include "kerf/cutting/leaning_cut.h"
#include "kerf/cutting/uncut_path.h"

namespace kerf {

/// One stroke of a blade: its state between poses. Plain data.
struct BladeStroke {
  BladeFrame posed;       ///< the last pose that it was led to, when vertices were `SweepTarget::before`
  bool started = false;   ///< `posed` holds a pose
  bool standing = false;  ///< it is the first one: what the blade goes through there is stabbed by the first move
  bool through = false;   ///< cut every layer the blade meets, not only the first from its base
  std::vector<CollisionVertex> fronts;  ///< where the cut has got to, one per layer; provisional ends included
  std::vector<BladeFront> ends;         ///< the same as seen from `mark`
  std::vector<std::array<Vec3, 2>>
      cut_along;             ///< chords, at rest, of sheets that lie along the blade, but for provisional ones
  std::vector<Vec3> began;   ///< places inside the body, at rest, where paths of the stroke began
  bool provisional = false;  ///< there is work after `mark`, to be taken back before the next pose
  JournalMark mark;          ///< of the caller's journal
};

/// What one step of a move did.
struct SweepReport {
  int steps = 0;       ///< collision edges that were opened or run along, provisional ones included
  int refused = 0;     ///< paths that were rolled back, as were all tries beside them; their front stopped there
  int retried = 0;     ///< points of paths that were refused and then made a minimum feature or two beside their place
  UncutPath uncut;     ///< the first of the refused
  LeaningCut leaning;  ///< of closed bodies, but for sheets that lie along the blade
  bool changed = false;  ///< the complex is not what it was before the step

  SweepReport& operator+=(const SweepReport& other);
};

/// What the sweep works on. `position` holds the deformed position of every collision vertex, metres; the sweep appends
/// those of new vertices, to `before` too.
struct SweepTarget {
  CellComplex& complex;
  std::vector<Vec3>& position;
  FaceBoxes& boxes;  ///< at `position`; the sweep marks what it cuts, the caller what rolling back and others change
  CutScratch& scratch;
  const CutOptions& options;
  std::vector<Vec3>* before =
      nullptr;  ///< `position` at the last pose (BladeStroke::posed), of the first vertices or all; null: nothing has moved since
};

/// Moves the blade from its last pose to `edge` (see check_edge), and cuts what it meets on the way up to the last edges that the paths
/// cross. Nothing may be provisional. The first call places the blade; material that it pierces from then on is stabbed, and where its length comes down
/// on a vault two fronts go off to both sides. Without `through` the one towards the base leads: the other is where the edge comes out again. A
/// path that can't be cut without breaking an invariant is rolled back and counted. Turning moves are divided, so that the
/// swept surface is nearly flat in each part.
SweepReport lead_blade(BladeStroke& stroke, const BladeEdge& edge, SweepTarget& target);

/// Cuts on to where the blade is: what is cut here is provisional. `stroke.mark` has been set since lead_blade.
SweepReport make_ends(BladeStroke& stroke, SweepTarget& target);

/// Does a blade meet the mid-surface on its way from one edge to another, while vertices go from `target.before` to `target.position`? Ends in the material
/// count.
bool meets_material(SweepTarget& target, const BladeEdge& from, const BladeEdge& to);

/// Ends the stroke; what was provisional stays.
void lift_blade(BladeStroke& stroke);

}  // namespace kerf
