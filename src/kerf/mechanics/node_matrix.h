// The elastic part of a small body's matrix put together, in single precision: for products with search directions inside conjugate gradients.
// Partly filled cells have matrices of their own; a product that goes through all of them reads each node as often as cells meet there and turns it
// there and back, while this one touches every pair of nodes once, in a quarter of the bytes.
//
//   y_i = m_i x_i + sum over j of A_ij (x_j - x_i)
//
// Since translations strain nothing, the diagonal blocks are not needed, and translations strain nothing here to the last bit, however light a
// node is. Mass stays in double precision, and so does what translations do to springs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "kerf/base/lanes.h"

namespace kerf {

class MechanicsModel;
struct StepWorkspace;

struct NodeMatrixStructure {
  static constexpr int kLanes = 4;
  std::vector<std::int32_t>
      row_begin;  ///< per node its blocks, in pairs: the last may be the node itself, with nothing in it
  std::vector<std::int32_t> column;  ///< per block a node
  /// Live elements by ascending id, four at a time: the order of all sums, which must not depend on where a matrix lies in the pool.
  struct Four {
    std::array<std::int32_t, kLanes> batch{},
        lane{};  ///< where their numbers are in a step; lane -1: none, as the first
  };
  std::vector<Four> fours;
  std::vector<std::int32_t>
      target;  ///< per four: [pair of corners c < d][lane] the blocks (c, d), then the same of (d, c)
  std::vector<std::array<double, 300>> full;  ///< per material: upper triangle of a full cell's matrix, by rows
  /// A spring whose nodes all hang together in pairs, as those of a cell do. It adds to blocks that are there.
  struct Spring {
    std::int32_t spring = 0;                             ///< in Structure::springs
    std::array<std::array<std::int32_t, 8>, 8> block{};  ///< [row][column]; -1: no such pair
  };
  std::vector<Spring> springs;
  std::vector<std::int32_t> rows;  ///< the other springs, which stay rows; in Structure::springs
};

/// Pairs of corners c < d of an element.
inline constexpr std::size_t kCornerPairs = 28;

/// Builds all of it. O(elements).
void node_matrix_structure(const MechanicsModel& model, NodeMatrixStructure& out);

/// Bodies with more nodes than this, with fewer partly filled batches than full ones, or stiffer for their time step (E dt^2 / (rho h^2)) are multiplied
/// cell by cell: their matrix would not stay in the cache, gains nothing, or has not enough digits.
inline constexpr std::size_t kMostMatrixNodes = 2000;
inline constexpr double kStiffestMatrix = 1e3;

/// Two blocks side by side: three columns of (x, y, z, 0) of the one, then of the other.
struct alignas(32) NodeBlockPair {
  float v[3][8];
};

/// Column `k` of a block, as (x, y, z, 0).
inline Lanes node_block_column(const NodeBlockPair* blocks, std::int32_t block, int k) {
  float __attribute__((vector_size(16))) v;
  std::memcpy(&v, blocks[block / 2].v[k] + 4 * (block % 2), sizeof v);
  return __builtin_convertvector(v, Lanes);
}

/// workspace.node_blocks for a prepared step (scaled rotations, tension); springs and contacts are left out.
void assemble_node_matrix(const MechanicsModel& model, StepWorkspace& workspace);

/// Adds springs to the blocks that they have, and to workspace.node_diagonal. After prepare_coarse_space(), which takes springs as rows.
void add_springs_to_node_matrix(const MechanicsModel& model, StepWorkspace& workspace);

/// workspace.single: the search direction, before a product with it.
void narrow_search(StepWorkspace& workspace);

/// product = A search for the nodes begin to end, without springs that are rows, bonds and contacts; returns their share of search' A search.
double multiply_node_matrix(const MechanicsModel& model, StepWorkspace& workspace, std::size_t begin, std::size_t end);

}  // namespace kerf
