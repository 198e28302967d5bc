// One implicit Euler step of co-rotated elasticity.
//
//   A v1 = M v + dt (f_ext + f_int),   A = (1 + dt a) M + (dt^2 + dt b) K,   x1 = x + dt v1,   K = sum R Ke
//   R'
//
// linearised once per step. The unknown is the *new velocity, started from zero*: what a loose solve leaves
// undone then acts as damping and not as flight. Solved by conjugate gradients with block-Jacobi plus an
// additive coarse space of the rigid motions of groups of nodes (coarse_space.h). Contacts and rigid tools are part of
// the same system (contact_response.h).
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/mechanics/coarse_space.h"
#include "kerf/mechanics/contact_response.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step_report.h"

namespace kerf {

/// What a step changes; copy it to keep it, put it back and the next step gives the same bits.
struct MechanicsState {
  std::vector<Vec3> positions;   ///< per node, m
  std::vector<Vec3> velocities;  ///< per node, m/s
  std::vector<Mat3>
      rotations;  ///< per element, lattice frame to world; followed from step to step, so part of the state
  std::int32_t two_level_steps = 0;     ///< steps left in which the coarse space is used at once (adaptive choice)
  std::vector<RigidState> tools;        ///< as many as the contact set has
  std::vector<ContactMemory> contacts;  ///< by ascending key
  std::vector<double> bond_damage;      ///< per point of the model's bonds, 0 whole to 1 torn; it never decreases
  double bond_dissipated = 0;           ///< J that tearing bonds has taken
  friend bool operator==(const MechanicsState&, const MechanicsState&) = default;
};

/// At rest: rest positions, zero velocities, the lattice's axes.
MechanicsState rest_state(const MechanicsModel& model);

enum class Preconditioner {
  kBlockJacobi,
  kTwoLevel,  ///< block-Jacobi and coarse space in every step
  kAdaptive,  ///< block-Jacobi first; the coarse space joins when that takes too long
};
enum class SolverKind {
  kConjugateGradients,
  kDirect,  ///< sparse LDL'; an oracle for tests and for small, badly conditioned set-ups. Allocates.
};

struct StepOptions {
  double dt = 1.0 / 60;       ///< s
  double part_of = 0;         ///< s: the time step that this is a part of, as messages name it; 0: it is whole
  Vec3 gravity{0, 0, -9.81};  ///< m/s^2
  /// Residual relative to the right-hand side with the coarse space. Block-Jacobi alone leaves smooth errors
  /// that such a residual does not see, so it goes kBlockJacobiFactor further.
  double tolerance = 1e-2;
  /// The solver also stops at this share of the mean weight of a node per step, dt g m_total / sqrt(nodes):
  /// at rest a relative residual alone would chase rounding.
  double residual_floor = 1e-6;
  int max_iterations = 1000;
  Preconditioner preconditioner = Preconditioner::kAdaptive;
  SolverKind solver = SolverKind::kConjugateGradients;
  bool parallel = false;  ///< use kerf::parallel_for; the result has the same bits
};

/// Block-Jacobi alone is solved to this share of the tolerance.
inline constexpr double kBlockJacobiFactor = 0.1;
/// Iterations block-Jacobi alone may take before the coarse space joins (adaptive).
inline constexpr int kBlockJacobiPatience = 25;
/// Steps with the coarse space before block-Jacobi alone is tried again (adaptive).
inline constexpr std::int32_t kTwoLevelSteps = 32;
/// The solver goes on until no node alone would still change by more than this share of the body's speed (root mean square) plus
/// kStillAtRest of a step's free fall: slivers that weigh next to nothing do not show in a residual. At most kMostSettling
/// iterations more.
inline constexpr double kNodeTolerance = 0.2, kStillAtRest = 0.01;
inline constexpr int kMostSettling = 100;
/// E dt^2 / (rho h^2) from which on the residual is measured by the momentum of the body and not by the right-hand side: elastic forces exceed that by about this
/// ratio, and a hundredth of them would be a motion of whole pieces, and then more energy from step to step (seen from 1.5e6 on).
inline constexpr double kStiffByMomentum = 1e5;
/// Steps whose iterations come to no end are factorised, in models of up to this many nodes.
inline constexpr std::size_t kMostFactorisedNodes = 20'000;
/// Gravity used for the residual's floor when the scene has less, m/s^2.
inline constexpr double kFloorGravity = 9.81;

/// Memory of the step; grows on demand and is reused. Holds no state that a result depends on.
struct StepWorkspace {
  struct alignas(32) Quad {
    double v[4];
  };
  // Node vectors are (x, y, z, 0) per node.
  std::vector<Quad> position, velocity, right_side, solution, residual, search, product, preconditioned;
  std::vector<Quad> start_solution, start_residual;  // as the present pass began (pass_length.h)
  std::vector<Quad> slot;                            // one force per (element, corner) and (spring, node)
  std::vector<double> mass_diagonal;                 // (1 + dt a) m, per node
  std::vector<Quad> diagonal;                        // two per node: xx yy zz xy, yz zx - -; without contacts
  std::vector<Quad> inverse_diagonal;                // three columns per node
  std::vector<Quad> diagonal_slot;                   // two per slot: xx yy zz xy, yz zx - -
  std::vector<Quad> rotation;                        // nine per batch
  std::vector<Quad> scaled_rotation;                 // nine per batch: times the square root of (dt^2 + dt b) E-scale
  std::vector<Quad>
      tension;  // per batch: volume times stress against turns, then what the matrix has of it over the scale's square
  std::vector<double> spring_scale;    // dt^2 k + dt c, per live spring
  std::vector<double> sprung;          // matrices with springs in them (cell_springs.h)
  std::vector<Quad> partial;           // per chunk of nodes
  std::vector<double> cell_mass;       // per cell of the model
  std::vector<std::int32_t> inverted;  // per chunk of batches
  std::vector<Quad> arm;               // (x - centre of the node's group) / length, per node
  struct alignas(16) Single {
    float v[4];
  };
  std::vector<NodeBlockPair> node_blocks;  // (dt^2 + dt b) K between pairs of nodes (node_matrix.h)
  std::vector<Single> single;              // the search direction
  std::vector<double> node_diagonal;       // mass_diagonal with what translations do to springs in node_blocks
  bool node_matrix = false;                // node_blocks are those of this step
  CoarseSpace coarse;
  BondWork bonds;
  ContactWork contact;  // results of the last step's contacts in it
  /// Sums over the nodes of a piece.
  struct TurningPiece {
    Quad momentum{}, moment{};   // m v, m x
    double mass = 0;             // kg
    double moves = 0, size = 0;  // m v^2, m x^2 about its centre
    double brought = 0;          // square of the momentum that the nodes bring
    double left = 0;             // square of the residual
    bool turns = false;          // by more than kTurn in this step
  };
  std::vector<TurningPiece> turning;  // per piece
  bool any_turning = false;
};

/// Advances the state by one step. Bad options, a state of the wrong size or one that is not finite, or a
/// result that is not finite: an Error with a suggestion, state unchanged. In steady state (same model) it
/// allocates nothing. contacts: what touches, or nothing; forces on rows and tools are in workspace.contact afterwards.
Result<StepReport> step(MechanicsModel& model, MechanicsState& state, const StepOptions& options,
                        StepWorkspace& workspace, const ContactSet* contacts = nullptr);

/// Elastic forces on the nodes (N) at these positions with the state's rotations updated once: |nodes|.
std::vector<Vec3> internal_forces(MechanicsModel& model, const MechanicsState& state);

/// After a step: force (N) of the support on a fixed node, inertia and damping included; zero for free nodes.
Vec3 reaction(const MechanicsModel& model, const StepWorkspace& workspace, const StepOptions& options, NodeId node);
/// After a step: force (N) of a spring on its point.
Vec3 spring_force(const MechanicsModel& model, const MechanicsState& state, SpringId spring);

}  // namespace kerf
