// Nested dissection: an order of elimination in which halves of a mesh come before the rows that separate them (George 1973).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/vec.h"

namespace kerf {

/// Neighbours of row i: column[first[i]] .. column[first[i + 1] - 1]; if j is one of i, then i is one of j.
struct RowGraph {
  std::span<const std::int32_t> first, column;
};

/// A tree of rows. No row of one child is a neighbour of a row of the other.
class Dissection {
 public:
  struct Node {
    std::int32_t begin, end;   ///< its own rows: order()[begin .. end); its children's rows come before them
    std::int32_t children[2];  ///< numbers of nodes, -1: none
    std::int32_t depth, side;  ///< root: 0, 0; side: which child of its parent it is
  };

  /// Halves space across its longest direction until no part has more than `most` rows. `points`: one per row, near each other where
  /// rows are neighbours (a bad guess costs time, not correctness).
  void run(const RowGraph& graph, std::span<const Vec3> points, std::size_t most);

  [[nodiscard]] const std::vector<std::int32_t>& order() const { return order_; }  ///< new -> old
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }  ///< children before their parents, root last

 private:
  struct Item {
    float p[3];
    float reach;  ///< no neighbour is farther away in any direction
    std::int32_t row;
  };
  std::int32_t divide(std::size_t begin, std::size_t end, std::int32_t depth, std::int32_t side);
  std::size_t halve(std::size_t begin, std::size_t end);
  std::size_t separate(std::size_t begin, std::size_t middle, std::size_t end);

  RowGraph graph_;
  std::size_t most_ = 0;
  std::vector<Item> items_, moved_;
  std::vector<std::int32_t> order_, half_;  ///< half_: per row: stamp of the first half it was in last
  std::int32_t stamp_ = 0;
  int axis_ = 0;   ///< of the last halving
  float cut_ = 0;  ///< no row of the second half lies below it, but for ties
  std::vector<Node> nodes_;
};

}  // namespace kerf
