// What binds bodies: points at which the material of one sticks to that of another, until it is torn off.
//
// A point is two places that coincide at rest, each in an element of its own. It has an area, and a traction against the gap u between
// them, in its own frame: `opening` along the normal (what presses counts as none), `slip` across it.
//
//   traction = (1 - d) k u,   opening^2 + slip^2 = l^2,   d = lf (l - l0) / (l (lf - l0)) from l0 to lf, and never less than it was
//
//     traction
//      ^
//    s |    .             l0: strength s over stiffness k
//      |   / `.           lf: where the area under the curve is the toughness G, 2 G / s
//      |  /    `.
//      | /       `.
//      +----.------`--> l
//          l0      lf
//
// l0 and lf depend on the share of shear by Benzeggagh and Kenane's criterion (1996), as in Turon, Camanho, Costa and Davila, A damage model for the
// simulation of delamination in advanced composites under variable-mode loading, Mechanics of Materials 38 (2006), equations 20 to 29. The stiffness is
// the same in all directions, as there: so a bond pulls along its gap, and turns nothing by itself.
//
// Elements with incompatible modes bend between their nodes. So does a point: it has what its element is off the trilinear surface (`bubble`). Without that, bent cells
// of unlike length would be far too stiff together.
//
// Points between the same two elements make a *pair*. Its stiffness is A x 1, with A = sum (1 - d) k area w w' of 20 x 20 numbers, 16 nodes and 4 bubbles, and 1
// the unit matrix of three directions, however many points there are.
//
// A step solves with a damage that only grows, from what it was, until what more damage changes is less than the solve's tolerance. Every solve is an
// implicit step of a positive semi-definite stiffness, and damage takes energy away. So no step gains any.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/base/result.h"
#include "kerf/base/vec.h"

namespace kerf {

class MechanicsModel;
struct MechanicsState;
struct StepWorkspace;

struct BondLaw {
  double stiffness = 0;               ///< Pa/m, > 0
  std::array<double, 2> strength{};   ///< Pa: against opening and slip, > 0
  std::array<double, 2> toughness{};  ///< J/m^2: of opening and slip, > strength^2 / (2 stiffness)
  double mixing = 2;                  ///< exponent of Benzeggagh and Kenane, > 0
};

/// Bad input: what is not in the ranges above.
Status validate(const BondLaw& law);

/// 0 (whole) to 1 (torn) of a bond that was never as far apart as this. Metres, >= 0.
double bond_damage(const BondLaw& law, double opening, double slip);

/// Pa: the most strength whose tearing zone is kTearingCells cells long in a layer of this thickness (m) that is bent off. The zone of a slender layer is
/// (E G / s^2)^(1/4) t^(3/4) long (Yang and Cox 2005); Turon, Davila, Camanho and Costa (2007) lower strengths in this way.
double resolved_strength(double young, double thickness, double toughness, double cell);
/// One cell: the front of a peel hangs and snaps a little. Four: what it takes does not depend on cells, but bonds of thin skins on coarse cells would be far too weak.
inline constexpr double kTearingCells = 1;

struct BondPoint {
  std::array<HexId, 2> element;  ///< of the lower and the upper body; an invalid one: the point is gone
  std::array<Vec3, 2> local;     ///< where in their cells, -1 to 1
  Vec3 normal;                   ///< at rest, unit, from the lower body to the upper one
  double area = 0;               ///< m^2
  std::int32_t law = 0;          ///< index into the laws
};

inline constexpr std::size_t kBondSide = 20;
/// What a point's gap is of: the nodes of the lower element and of the upper one, their bubbles along the axes `along` of each.
using BondRow = std::array<double, kBondSide>;

/// Points between the same two elements.
struct BondPair {
  std::array<std::int32_t, 16> node{};  ///< of the lower element, then of the upper one
  std::array<HexId, 2> element;
  std::array<std::array<std::int8_t, 3>, 2> axis{};  ///< of each cell: two along the bond, and the one across
  std::int32_t first = 0, count = 0;                 ///< of BondStructure::order
};

struct BondStructure {
  std::vector<BondPair> pairs;      ///< ascending by elements
  std::vector<std::int32_t> order;  ///< points by pair, ascending
  std::vector<BondRow> rows;        ///< in that order
  std::uint64_t version = 0;        ///< hash of all that matrices are made of but the damage
};

/// Memory of a step. Holds no state that a result depends on.
struct BondWork {
  /// Directions of a pair in the step, (x, y, z, 0): of each element the axes of BondPair::axis.
  struct alignas(32) Frame {
    double axis[2][3][4];
  };
  std::vector<double> damage;     ///< of each point, in this pass
  std::vector<double> assembled;  ///< damage that a pair's matrix was put together with, by place in `order`
  std::vector<double> matrix;     ///< A of each pair, 20 x 20, N/m
  std::vector<double> stiffness;  ///< sum of (1 - d) k area of each pair; 0: torn
  std::vector<Frame> frame;
  std::uint64_t version = 0;  ///< of the structure that `assembled` belongs to
  int broken = 0;             ///< points that tore in this step
  double dissipated = 0;      ///< J, at all times
};

BondStructure bond_structure(const MechanicsModel& model);

/// Takes the state's damage over and puts together what changed since the last step. Rotations are those of the step.
void begin_bonds(const MechanicsModel& model, const MechanicsState& state, StepWorkspace& w);
/// Forces at the start of the step into their slots, N.
void bond_force_pass(const MechanicsModel& model, StepWorkspace& w);

/// dt^2 A p of each pair into its slots.
void bond_stiffness_pass(const MechanicsModel& model, StepWorkspace& w, const double* p, double dt);
/// dt^2 A between two nodes of a pair, 3 x 3 by rows.
std::array<double, 9> bond_block(const MechanicsModel& model, const StepWorkspace& w, std::size_t pair, std::size_t row,
                                 std::size_t column, double dt);
/// What node `corner` of a pair has of dt^2 A on the diagonal.
double bond_diagonal(const StepWorkspace& w, std::size_t pair, std::size_t corner, double dt);
/// Weights of the middle of a pair's points, for the coarse space.
std::array<double, 16> middle_of_bonds(const StepWorkspace& w, std::size_t pair);
/// product += dt^2 A search; returns search' dt^2 A search.
double add_bond_products(const MechanicsModel& model, StepWorkspace& w, double dt);
/// Damage at the end of the step as it is solved now. Where it grows, matrices, the right-hand side and the residual follow. Returns the norm of what the
/// residual changed by over the nodes that move.
double grow_bond_damage(const MechanicsModel& model, StepWorkspace& w, double dt);

/// J that is stored in all bonds.
double bond_energy(const MechanicsModel& model, const MechanicsState& state);
}  // namespace kerf
