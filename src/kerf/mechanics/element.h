// The 8-node box element: stiffness of full and of partly filled lattice cells.
//
//        6--------7        node c sits at the corner with bits
//       /|       /|          x = c & 1,  y = c >> 1 & 1,  z = c >> 2 & 1
//      4--------5 |        natural coordinates xi = (xi, eta, zeta) in [-1, 1]^3,
//      | |      | |          corner c at (2x-1, 2y-1, 2z-1)
//      | 2------|-3        degree of freedom 3 c + axis
//   z  |/       |/         strains in the order xx yy zz xy yz zx (engineering shear)
//   | /y        |
//   |/ 0--------1
//   +---x
//
// Default are Taylor's incompatible modes in the strain form (QM6, the same as nine enhanced strains),
// condensed: K = Kuu - Kua Kaa^-1 Kua'. Plain integration is there to compare with the paper's platform.
#pragma once

#include <array>
#include <span>

#include "kerf/base/vec.h"
#include "kerf/mechanics/material.h"

namespace kerf {

enum class ElementFormulation {
  kIncompatible,  ///< QM6: bends and shears right; the default
  kPlain,         ///< full integration of the trilinear field: too stiff in bending, locks in flat cells
};

/// Row-major 24 x 24, symmetric, N/m.
using ElementMatrix = std::array<double, 576>;

/// A quadrature point of the material in a cell: where (natural coordinates) and how much (m^3).
struct MaterialPoint {
  Vec3 xi;
  double volume = 0;
};

/// Share of the full cell's stiffness that a partly filled cell gets on top of its own: bounds the local
/// softness under a point load. Mass has no such floor.
inline constexpr double kStiffnessFloor = 1e-3;
/// Share of the largest diagonal of Kaa added to its diagonal, so that slivers can be condensed.
inline constexpr double kCondensationRegularisation = 1e-12;

/// Sign of corner c along an axis: -1 or +1.
constexpr double corner_sign(int corner, int axis) { return (corner >> axis & 1) != 0 ? 1.0 : -1.0; }

/// The eight trilinear shape functions at xi.
std::array<double, 8> shape_functions(Vec3 xi);

/// Stiffness of a full cell of this size (m), integrated with 2 x 2 x 2 Gauss points.
ElementMatrix element_matrix(ElementFormulation formulation, const Material& material, Vec3 cell_size);

/// Stiffness of a partly filled cell: the integral over the material points, with enhanced strains that are
/// mean-free over the *material* (else the patch test fails), plus `floor` times the full cell's stiffness.
/// Any number of points; no points give the floor alone. About 2 microseconds for 27 points.
ElementMatrix partly_filled_matrix(ElementFormulation formulation, const Material& material, Vec3 cell_size,
                                   std::span<const MaterialPoint> points, double floor = kStiffnessFloor);
/// The same with these volumes at material_points_27, the usual floor, and the full cell's stiffness, which is known.
ElementMatrix partly_filled_matrix(ElementFormulation formulation, const Material& material, Vec3 cell_size,
                                   const std::array<double, 27>& volumes, const ElementMatrix& full);

/// Mass (kg) of each corner: row sums of the consistent mass matrix, density times the integral of each shape
/// function.
std::array<double, 8> lumped_masses(double density, std::span<const MaterialPoint> points);
std::array<double, 8> lumped_masses(double density, const std::array<double, 27>& volumes);  ///< at material_points_27
/// Mass of each corner of a full cell.
std::array<double, 8> lumped_masses(double density, Vec3 cell_size);

/// 3 x 3 x 3 Gauss points, x fastest, with these volumes (m^3; from fitted moments they may be negative).
std::array<MaterialPoint, 27> material_points_27(std::span<const double, 27> volumes);
/// 2 x 2 x 2 Gauss points of a full cell.
std::array<MaterialPoint, 8> full_cell_points(Vec3 cell_size);

}  // namespace kerf
