// Where the box cells of a body lie: origin, axes, cell size, cells along each axis (4.2.1).
//
// Lattice coordinates count cells: the point (i, j, k) is a lattice corner, cell (i, j, k) reaches to (i+1, j+1, k+1).
// Each body has cells of its own. Their indices lie side by side along x, with one left out between two bodies, so an
// index belongs to one body:
//
//        first = (0, 0, 0)     first = (5, 0, 0)
//        +--+--+--+--+   .    +--+--+
//        |  |  |  |  |   .    |  |  |
//        +--+--+--+--+   .    +--+--+
//        0  1  2  3  4        5  6  7
//
// The 8 corners of a cell are numbered in bits: x = c & 1, y = c >> 1 & 1, z = c >> 2 & 1.
//
//        6-------7
//       /|      /|      z
//      4-------5 |      |  y
//      | 2-----|-3      | /
//      |/      |/       |/
//      0-------1        0----x
#pragma once

#include <array>
#include <cstdint>

#include "kerf/base/ids.h"
#include "kerf/base/indexed.h"
#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

using LatticeIndex = std::array<std::int32_t, 3>;

struct LatticeFrame {
  Vec3 origin;                  ///< metres: lattice corner `first`
  Mat3 axes;                    ///< unit columns, right-handed
  Vec3 cell{1, 1, 1};           ///< metres, edge lengths of a cell
  LatticeIndex count{0, 0, 0};  ///< cells along each axis; the body lies inside
  LatticeIndex first{0, 0, 0};  ///< the least index of a cell

  /// Metres to lattice coordinates.
  [[nodiscard]] Vec3 to_lattice(Vec3 p) const {
    const Vec3 d = transposed_times(axes, p - origin);
    return {first[0] + d.x / cell.x, first[1] + d.y / cell.y, first[2] + d.z / cell.z};
  }
  /// Lattice coordinates to metres.
  [[nodiscard]] Vec3 to_world(Vec3 q) const {
    return origin + axes * Vec3{(q.x - first[0]) * cell.x, (q.y - first[1]) * cell.y, (q.z - first[2]) * cell.z};
  }
  /// Metres: of the box of all cells.
  [[nodiscard]] Vec3 size() const { return {cell.x * count[0], cell.y * count[1], cell.z * count[2]}; }
  [[nodiscard]] double cell_volume() const { return cell.x * cell.y * cell.z; }
  [[nodiscard]] std::size_t cell_count() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) * static_cast<std::size_t>(count[2]);
  }
  [[nodiscard]] bool contains(LatticeIndex c) const {
    for (std::size_t a = 0; a < 3; ++a)
      if (c[a] < first[a] || c[a] >= first[a] + count[a]) return false;
    return true;
  }
  /// Number of a cell, and of a corner, among its own: x fastest.
  [[nodiscard]] std::int32_t cell_number(LatticeIndex c) const {
    return ((c[2] - first[2]) * count[1] + c[1] - first[1]) * count[0] + c[0] - first[0];
  }
  [[nodiscard]] std::int32_t corner_number(LatticeIndex q) const {
    return ((q[2] - first[2]) * (count[1] + 1) + q[1] - first[1]) * (count[0] + 1) + q[0] - first[0];
  }
  /// The cell, and the corner, of a number.
  [[nodiscard]] LatticeIndex cell_at(std::int32_t number) const {
    return {first[0] + number % count[0], first[1] + number / count[0] % count[1],
            first[2] + number / count[0] / count[1]};
  }
  [[nodiscard]] LatticeIndex corner_at(std::int32_t number) const {
    const std::int32_t nx = count[0] + 1, ny = count[1] + 1;
    return {first[0] + number % nx, first[1] + number / nx % ny, first[2] + number / nx / ny};
  }
  /// Lattice corner c (0..7) of a cell.
  static constexpr LatticeIndex corner(LatticeIndex cell, int c) {
    return {cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2 & 1)};
  }
};

struct LatticeOptions {
  /// Wanted number of cells in the body's bounding box, all layers together; 0: in-plane cell size = mean collision
  /// edge length.
  int cells = 0;
  int layers = 1;  ///< cells across the thickness; 0: as many as keep the cells near cubes (bent bodies)

  // Given explicitly instead of chosen: all three of origin, cell and count (and axes, if not the world's).
  bool given = false;
  Vec3 origin;
  Mat3 axes;
  Vec3 cell;
  LatticeIndex count{0, 0, 0};
};

/// Most cells that a lattice may have; a bounding box with more is refused.
inline constexpr std::size_t kMaxLatticeCells = std::size_t{1} << 26;

/// Chooses the lattice of a body from its prisms. Thickness along the smallest principal axis of the material; in the
/// plane the smallest bounding rectangle. The principal axes, and before them the world's, are preferred while their
/// box is at most 2 % larger. Order and signs as near to the world's as possible, right-handed. Cells are square in the
/// plane as far as a whole number of them allows, `layers` of them across the thickness. The lattice
/// encloses the bounding box of the prisms exactly. Or takes the lattice given.
/// Refuses: an empty mesh, coordinates that are not finite, a body without thickness, a given lattice with
/// axes that are not orthonormal or cells of no size, and more than kMaxLatticeCells cells. Cost: linear.
Result<LatticeFrame> choose_lattice(const CollisionMesh& mesh, const LatticeOptions& options);

}  // namespace kerf
