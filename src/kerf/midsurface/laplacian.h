// The cotangent Laplacian, as weights of edges and as matrix entries, and smooth fields from scattered data.
#pragma once

#include <span>

#include "kerf/midsurface/sparse_cholesky.h"
#include "kerf/midsurface/surface_mesh.h"

namespace kerf::mid {

/// |half-edges|: (cot + cot) / 2 of the two angles opposite to the edge, kept within 0.02 and 10, so that slivers and
/// obtuse triangles leave an M-matrix. Both half-edges of an edge have the same value.
Column<double> cotangent_weights(const SurfaceMesh& mesh);

/// Appends w (x_a - x_b)^2 of every edge to a lower triangle.
void add_laplacian(const SurfaceMesh& mesh, const Column<double>& weights, std::vector<SparseEntry>& entries);

/// |V|: a third of the area around each vertex.
Column<double> vertex_areas(const SurfaceMesh& mesh);

/// Data that a smooth field should come near to: at the mean of some vertices, or at one.
struct FieldDatum {
  std::int32_t vertex[3];  ///< the last two may be -1: data at one vertex
  double weight;           ///< >= 0, in units of the Laplacian
  double value[4];
};

/// Minimises sum cot |grad x|^2 + sum weight (x - value)^2 for four fields at once (|V| x 4), with the values of `border`
/// at border vertices (those at others don't count).
using Fields = Column<std::array<double, 4>>;
Fields smooth_fields(const SurfaceMesh& mesh, const Column<double>& weights, std::span<const FieldDatum> data,
                     const Fields& border);
/// The same for value[3] alone and with a free border.
Column<double> smooth_free_field(const SurfaceMesh& mesh, const Column<double>& weights,
                                 std::span<const FieldDatum> data);

/// Makes the positions of vertices that are not `kept` harmonic between those that are: a soap film in between.
void fill_positions(const SurfaceMesh& mesh, const Column<double>& weights, const Column<std::uint8_t>& kept,
                    Column<Vec3>& positions);

}  // namespace kerf::mid
