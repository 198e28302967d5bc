// The inverse of the nodes' diagonals together with the rows that press on them: first level of the preconditioner where things touch. Rows are
// much stiffer than the body, and the diagonal alone does not know that what one node gives, its neighbours may take.
//
//   M = D + J' P J,   M^-1 = D^-1 - D^-1 J' R S^-1 R J D^-1,   R = sqrt(P),   S = 1 + R J D^-1 J' R
//
// D and P are taken as diagonal in one frame for the whole body, the principal axes of the sum of all P. So S falls into three matrices with a
// number for each pair of rows, and M stays positive definite: its parts along an axis are parts of a positive definite matrix.
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/base/lanes.h"
#include "kerf/base/vec.h"

namespace kerf {

class MechanicsModel;
struct StepWorkspace;

/// Where more rows than this press, all are left to the diagonals: the factor of S is dense.
inline constexpr std::size_t kMostInverseRows = 128;
/// And so is a row that is stiffer than its nodes by more than this: S is in single precision.
inline constexpr double kStiffestInverse = 1e4;

struct ContactInverse {
  struct Touch {
    std::int32_t node = 0, slot = 0;  ///< slot: of `nodes`
    double weight = 0;
  };
  struct Share {
    std::int32_t row = 0;  ///< in `rows`
    float along[3] = {};   ///< weight times R, per axis
    double weight = 0;
  };
  struct alignas(32) Quad {
    double v[4];
  };
  bool used = false;
  Vec3 axes[3];                                       ///< the frame
  std::vector<std::int32_t> rows;                     ///< of the contact set, ascending
  std::vector<std::uint8_t> has;                      ///< per row of the contact set
  std::vector<std::uint8_t> phases;                   ///< of all those rows when it was made
  std::vector<std::int32_t> begin;                    ///< per row its touches
  std::vector<Touch> touches;                         ///< of nodes that move
  std::vector<Vec3> root;                             ///< R per row, by axis
  std::vector<std::int32_t> nodes;                    ///< that have touches
  std::vector<std::int32_t> slot_of;                  ///< per node of ContactWork::nodes, -1
  std::vector<std::int32_t> share_begin, share_next;  ///< per slot
  std::vector<Share> shares;
  struct alignas(32) Eight {
    float v[8];
  };
  std::size_t stride = 0;  ///< rows, up to the next eight
  std::vector<Eight>
      factor;  ///< per axis: Cholesky factor L of S by columns; on the diagonal the inverse of its pivots
  std::vector<Eight> inverse;              ///< per axis: L^-1 by rows
  std::vector<Eight> value, half, solved;  ///< per axis: v, L^-1 v, S^-1 v
  std::vector<Quad> force;                 ///< per row: J' of it is taken off
};

/// Lists the rows and chooses the frame. False if there are none, or too many.
bool choose_inverse_rows(const MechanicsModel& model, StepWorkspace& workspace);

/// D^-1 of a node in that frame as three columns, from its block (xx yy zz xy, yz zx - -).
void store_framed_inverse(const ContactInverse& inverse, const Lanes& first, const Lanes& second, double* columns);

/// Factors S; the nodes' inverse diagonals are those of the frame.
void factor_contact_inverse(StepWorkspace& workspace);

/// preconditioned = D^-1 residual -> M^-1 residual. Returns what that adds to residual' preconditioned.
double apply_contact_inverse(StepWorkspace& workspace);

}  // namespace kerf
