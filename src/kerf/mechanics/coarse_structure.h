// Which nodes move together in the solver's coarse space: groups of neighbouring nodes ("aggregates"), each
// with the six rigid motions. A group is a block of the lattice, a few cells wide, split into the parts that
// elements connect: a group must not reach across a cut, where its two halves move apart.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kerf/mechanics/block_cholesky.h"

namespace kerf {

class MechanicsModel;

/// Width of the groups in nodes: narrow ones for few iterations, wide ones for a coarse matrix that is cheap
/// to make. The best for clamped sheets, measured with mechanics_bench.
constexpr int group_width(std::size_t free_nodes) {
  if (free_nodes < 2000) return 3;
  if (free_nodes < 8000) return 4;
  return free_nodes < 30000 ? 5 : 6;
}

struct CoarseStructure {
  std::int32_t groups = 0;
  double length = 1;                                ///< m; scales rotations to the size of translations
  std::vector<std::int32_t> group;                  ///< per node; -1: held or unused
  std::vector<std::int32_t> place;                  ///< per node: its group's place in the elimination order, or -1
  std::vector<std::int32_t> member_begin, members;  ///< per *place*: nodes, ascending

  /// An element that touches several groups (or a held node). The others do nothing in the coarse space:
  /// their nodes move rigidly there.
  struct Crossing {
    std::int32_t batch = 0, lane = 0;
    std::int32_t parts = 0;  ///< groups it touches, by descending place
    std::array<std::int32_t, 8> place{};
    std::int32_t matrix = 0;     ///< first of its parts (parts + 1) / 2 local matrices
    std::int32_t target = 0;     ///< first of as many target blocks
    bool antisymmetric = false;  ///< two parts and no held node: all three matrices are +-the first
  };
  std::vector<Crossing> crossings;  ///< only after add_crossings()
  /// Element stiffness between the rigid motions of its parts in its own frame, 6 x 6 row-major, pairs (row
  /// >= column).
  std::vector<std::array<double, 36>> matrices;
  std::vector<std::int32_t> targets;  ///< storage blocks, one per pair of each crossing

  /// Springs that touch a group: their pairs' target blocks, in the same order.
  struct SpringParts {
    std::int32_t spring = 0;  ///< index into Structure::springs
    std::int32_t parts = 0;
    std::array<std::int32_t, 8> place{};
    std::array<std::int32_t, 8> part{};  ///< per node of the row: its part, -1 held
    std::int32_t target = 0;
  };
  std::vector<SpringParts> springs;

  /// The same for pairs of bonds. Each counts as a row in the middle of its points.
  struct BondParts {
    std::int32_t pair = 0;
    std::int32_t parts = 0;
    std::array<std::int32_t, 16> place{};
    std::array<std::int32_t, 16> part{};
    std::int32_t target = 0;
  };
  std::vector<BondParts> bonds;

  BlockCholeskyStructure cholesky;
};

/// Builds all of it but the crossings. O(elements).
CoarseStructure coarse_structure(const MechanicsModel& model);

/// The crossings: where the matrix is not put together (node_matrix.h), the coarse one comes from the elements.
void add_crossings(const MechanicsModel& model, CoarseStructure& structure);

}  // namespace kerf
