// Contact inside the implicit step: a unilateral penalty on the gap at the *end* of the step, with friction as an elastic
// spring that slips, in the same linear system as everything else.
//
//   A += h^2 sum J' P J,   P = k n n' + ks (I - n n') - (1 - theta) ks t t' [sliding]
//   b += h sum J' [-k (g0 - h n . v_o) n + ks (...) (h v_o - s) - (1 - theta) mu lambda t [sliding]]
//
// J takes velocities of nodes and tools to the row's relative velocity, g0 is its gap at the start, s the stretch of its
// friction spring. Which rows press and which slide is found in a few passes. A row with a limit (material that is cut) is a spring k along n that gives
// way at that force: it slides then. The stiffness is relative: k = kappa times
// the local diagonal of M / h^2 + K, divided by how many contacts lean on the same nodes.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/mechanics/contact_inverse.h"
#include "kerf/mechanics/contact_rows.h"
#include "kerf/mechanics/rigid_tools.h"

namespace kerf {

class MechanicsModel;
struct MechanicsState;
struct StepWorkspace;

enum class ContactPhase : std::uint8_t { kOpen, kStick, kSlide };

/// Memory of the contact response. Holds no state that a result depends on.
struct ContactWork {
  struct Row {
    double gap = 0;        // at the start, clamped: overlap is pushed out at a bounded speed
    double stiffness = 0;  // k, N/m
    double inertia = 0;    // N/m: mass over h^2, shared as the stiffness is
    double weights = 0;    // sum of the squares, of what moves
    double force = 0;      // lambda of the last iterate, N
    double held = 0;       // what of it acted in the last pass: it limits friction, N
    Vec3 slip;             // stretch of the friction spring at the start, m
    Vec3 stretch;          // and at the end, by the last iterate
    Vec3 along;            // direction of sliding
    ContactPhase phase = ContactPhase::kOpen;
    bool slid = false;     // in the pass before, too
    double block[8] = {};  // h^2 P of this pass: xx yy zz xy, yz zx - -
    Vec3 impulse;          // its share of the right-hand side, h [...]
    Vec3 motion;           // J v when the pass before was over, or as the step began
    Vec3 way;              // how the present pass changed it
    Vec3 used;             // impulse in it, with that motion
  };
  struct alignas(32) Quad {
    double v[4];
  };
  /// Pressing rows of one element, summed: 36 pairs of corners (i <= j) of 8 numbers as in Row::block, and as 24 columns of
  /// 8 quads.
  struct Cell {
    std::int32_t element = -1, rows = 0;
  };
  const ContactSet* set = nullptr;  // null: no contact in this step
  int pass = 0;                     // of this step, from 1
  double unforced = 0;              // norm of the residual without contacts, when the first pass begins, N s
  double asked = 0;  // norm of what contacts should change in the next pass, as far as mass must be stopped, N s
  std::vector<Row> rows;
  std::vector<std::int32_t> pressing;   // rows, ascending
  std::vector<std::int32_t> single;     // those of them that are applied one by one
  std::vector<Cell> cells;              // with enough rows to be summed, by first row
  std::vector<std::int32_t> cell_of;    // per element: rows counted, then place in `cells`; -1 between uses
  std::vector<Quad> sums, matrices;     // 72 and 192 quads per cell
  std::vector<double> share;            // per node: sum of |weights| of likely rows
  std::vector<std::int32_t> node_slot;  // per node, -1
  std::vector<std::int32_t> nodes;      // whose diagonal block has contacts in it, and was without in the last pass
  std::vector<Quad> node_block;         // two quads per entry of `nodes`
  ContactInverse inverse;
  std::vector<std::uint8_t> touched_free;  // per free piece: something presses on it
  bool any_free_touched = false;
  std::vector<ToolWork> tools;
  std::vector<ContactResult> results;         // per row, of the last step
  std::vector<RigidToolResult> tool_results;  // per tool
};

/// Cells with at least so many pressing rows are summed.
inline constexpr std::int32_t kSummedRows = 5;

/// Refuses what can't be computed with: rows out of order, weights or gaps that are not finite, tools without mass ...
Status check_contacts(const MechanicsModel& model, const MechanicsState& state, const ContactSet& set);

/// Before the first pass: memory of the last step, stiffness, tools. Needs a prepared step (positions, velocities,
/// diagonal blocks).
void prepare_contacts(const MechanicsModel& model, const MechanicsState& state, const ContactSet& set, Vec3 gravity,
                      double h, StepWorkspace& workspace);

/// Before each pass: blocks, impulses, sums over cells, diagonals. last: sliding friction as a secant, which never drives.
/// coupled: with the rows' inverse (contact_inverse.h) where it pays.
void assemble_contacts(const MechanicsModel& model, double h, bool last, bool coupled, StepWorkspace& workspace);

enum class SystemVector { kSolution, kSearch };
/// product += contacts and tools of A p; returns their p' A p.
double multiply_contacts(const MechanicsModel& model, SystemVector p, StepWorkspace& workspace);

/// residual += contacts and tools of the right-hand side.
void add_contact_impulses(StepWorkspace& workspace);

/// residual += what this pass changed in the contacts' impulses at the present solution, which is that of the last update.
void add_impulse_changes(StepWorkspace& workspace);

/// After a pass: which rows press and slide now. Returns the norm of the residual that this makes, N s; infinite if a row that
/// was open overlaps by more than options.unseen.
double update_contacts(double h, StepWorkspace& workspace);

/// What the report says.
struct ContactSummary {
  int pressing = 0, sliding = 0;
  double deepest = 0;  ///< m of overlap at the end of the step
};
/// After the last pass: results into the workspace.
ContactSummary finish_contacts(double h, StepWorkspace& workspace);
/// Memory and tools of the next state.
void store_contacts(double h, const StepWorkspace& workspace, MechanicsState& state);

}  // namespace kerf
