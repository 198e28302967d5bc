// Where the lattice of box cells lies: origin, axes, cell size, cells along each axis (4.2.1).
//
// Lattice coordinates count cells: the point (i, j, k) is a lattice corner, cell (i, j, k) reaches to (i+1, j+1, k+1).
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
  Vec3 origin;                  ///< metres: lattice corner (0, 0, 0)
  Mat3 axes;                    ///< unit columns, right-handed
  Vec3 cell{1, 1, 1};           ///< metres, edge lengths of a cell
  LatticeIndex count{0, 0, 0};  ///< cells along each axis; the body lies inside

  /// Metres to lattice coordinates.
  [[nodiscard]] Vec3 to_lattice(Vec3 p) const {
    const Vec3 d = transposed_times(axes, p - origin);
    return {d.x / cell.x, d.y / cell.y, d.z / cell.z};
  }
  /// Lattice coordinates to metres.
  [[nodiscard]] Vec3 to_world(Vec3 q) const { return origin + axes * Vec3{q.x * cell.x, q.y * cell.y, q.z * cell.z}; }
  [[nodiscard]] double cell_volume() const { return cell.x * cell.y * cell.z; }
  [[nodiscard]] std::size_t cell_count() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) * static_cast<std::size_t>(count[2]);
  }
  [[nodiscard]] bool contains(LatticeIndex c) const {
    return c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && c[0] < count[0] && c[1] < count[1] && c[2] < count[2];
  }
  [[nodiscard]] CellId cell_id(LatticeIndex c) const { return CellId((c[2] * count[1] + c[1]) * count[0] + c[0]); }
  [[nodiscard]] LatticeIndex index_of(CellId c) const {
    return {c.value % count[0], c.value / count[0] % count[1], c.value / count[0] / count[1]};
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
