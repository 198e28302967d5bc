// Springs between corners of one partly filled cell: in products they are part of that cell's matrix.
//
//   R K R' + s w w' (x) I  =  R (K + s w w' (x) I) R'
//
// A point of a cell is the same weighted sum of corners in every direction, so it is no matter how the cell has turned. What a border holds then costs
// nothing in an iteration. Forces take springs one by one.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kerf {

class MechanicsModel;
struct StepWorkspace;

struct CellSprings {
  struct Spring {
    std::int32_t spring = 0;            ///< in Structure::springs
    std::array<double, 8> by_corner{};  ///< its weights, per corner of the cell
  };
  struct Cell {
    std::int32_t block = 0, lane = 0;   ///< place among `batches`
    std::int32_t first = 0, count = 0;  ///< of `springs`
  };
  std::vector<Spring> springs;  ///< cell by cell, in the order of their numbers there
  std::vector<Cell> cells;
  std::vector<std::int32_t> batches;  ///< that have springs, in Structure::batches
  std::vector<std::int32_t> rows;     ///< the other springs, which stay rows; in Structure::springs
  std::vector<std::uint8_t> is_row;   ///< per spring of Structure::springs
};

/// Finds the cells of the live springs: of those that have all of a spring's nodes, the element of least id. Needs batches and slots.
void place_springs_in_cells(const MechanicsModel& model, CellSprings& out);

/// workspace.sprung: the matrices of CellSprings::batches with the springs of this step in them. They are multiplied by workspace.scaled_rotation like those
/// without. Needs workspace.spring_scale.
void add_springs_to_cells(const MechanicsModel& model, StepWorkspace& workspace, double dt);

}  // namespace kerf
