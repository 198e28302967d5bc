// The prism of a collision triangle and its exact overlap with lattice cells (4.2.1).
//
// A prism has the corners rest - offset and rest + offset of the triangle's three vertices and is cut into three
// tetrahedra. The diagonals of its walls follow the order of the vertices' ancestors, so neighbours tile without gaps
// and the two lips of a cut choose the same diagonals. All coordinates here are lattice coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kerf/lattice/lattice_frame.h"

namespace kerf {

/// 27 moments of material in a cell: [a + 3 b + 9 c] = integral of x^a y^b z^c over the material, x, y, z in [-1, 1]
/// across the cell, divided by 8: the first is the share of the cell that is filled.
using Moments = std::array<double, 27>;

/// What a collision vertex adds to the prisms around it.
struct PrismCorners {
  Vec3 minus, plus;      ///< rest -+ offset
  CollisionVertex root;  ///< the first ancestor: orders the vertices of a triangle
};

struct Prism {
  std::array<Vec3, 3> minus, plus;  ///< sorted by ancestor id
  [[nodiscard]] Box3 box() const {
    Box3 b;
    for (const Vec3& p : minus) b.add(p);
    for (const Vec3& p : plus) b.add(p);
    return b;
  }
};

/// A wall of a prism: the quad over one edge, as two triangles with the prism's diagonal.
struct PrismWall {
  std::array<Vec3, 4>
      p;  ///< minus and plus of the lower id, minus and plus of the higher; the diagonal joins p[0], p[3]
};

/// Lattice coordinates of a point, put onto lattice planes nearer than kPlaneSnap.
Vec3 snapped_to_lattice(const LatticeFrame& frame, Vec3 p);

/// The id that orders a vertex: that of its first ancestor.
CollisionVertex first_ancestor(const CollisionMesh& mesh, CollisionVertex v);

PrismCorners corners_of(const CollisionMesh& mesh, const LatticeFrame& frame, CollisionVertex v);
Prism prism_between(const PrismCorners& a, const PrismCorners& b, const PrismCorners& c);
PrismWall wall_between(const PrismCorners& a, const PrismCorners& b);

/// Volume between the lower and upper triangle with ruled walls, in cells, signed. Adds up exactly however a triangle
/// is subdivided, which the three tetrahedra do not when walls are twisted.
double ruled_volume(const Prism& prism);

struct CellVolume {
  LatticeIndex cell;
  double volume;  ///< in cells
};

/// Volumes of the prism in the cells of the lattice, in the order of the cells' ids, those above kOverlapVolume only.
/// Appends to `out`. `scratch` keeps memory between calls.
void prism_in_cells(const Prism& prism, const LatticeFrame& frame, std::vector<double>& scratch,
                    std::vector<CellVolume>& out);

/// Volume of the prism in one cell, in cells.
double prism_in_cell(const Prism& prism, LatticeIndex cell);

/// Adds the prism's moments in one cell.
void add_prism_moments(const Prism& prism, LatticeIndex cell, Moments& moments);

/// The same for the parts of the prism on the two sides of a plane; normal points left.
void add_prism_moments_beside(const Prism& prism, LatticeIndex cell, Vec3 point, Vec3 normal, Moments& left,
                              Moments& right);

/// Has the prism material in the cell on this side (+1 where normal points, -1) of a plane?
bool prism_beside(const Prism& prism, LatticeIndex cell, Vec3 point, Vec3 normal, int side);

/// Does the wall meet the closed cell, inflated by kWallReach?
bool wall_meets_cell(const PrismWall& wall, LatticeIndex cell);

/// Does the wall lie in the face between `cell` and the next cell along `axis` with some of its area, up to kWallReach?
bool wall_lies_in_face(const PrismWall& wall, LatticeIndex cell, int axis);

}  // namespace kerf
