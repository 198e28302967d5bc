// Building blocks of the model generators: triangulated regions of the plane, and closed bodies made of two of them
// and a rim.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "kerf/mesh/models.h"

namespace kerf::models {

/// A triangulated region of the plane.
struct PlanarMesh {
  std::vector<Vec2> points;
  std::vector<std::array<std::int32_t, 3>> triangles;  ///< counter-clockwise
  std::vector<std::vector<std::int32_t>> loops;        ///< border vertices, the region on the left of each loop
  /// |F| x 3 points that texture coordinates are made from where `points` does not do (a region that closes on itself),
  /// or empty.
  std::vector<std::array<Vec2, 3>> corners;
};

enum class QuadSplit {
  kNone,       ///< no quad: a hole
  kSlash,      ///< diagonal from corner (i, j) to (i+1, j+1)
  kBackslash,  ///< diagonal from corner (i+1, j) to (i, j+1)
  kCross,      ///< four triangles around a vertex in the middle
};

/// nx x ny quads; point(i, j) places the corners, split(i, j) says how a quad is split.
PlanarMesh quad_grid(int nx, int ny, const std::function<Vec2(int, int)>& point,
                     const std::function<QuadSplit(int, int)>& split);

/// Diagonals that alternate, and at the four corners start at the corner, so that no triangle has two border edges there.
QuadSplit alternating_split(int i, int j, int nx, int ny);

/// Fills in mesh.loops from the triangles.
void find_loops(PlanarMesh& mesh);

/// Splits every triangle in four at the middles of its edges.
PlanarMesh subdivide(const PlanarMesh& mesh);

/// Delaunay-like triangulation of a simple polygon (counter-clockwise) with exactly `inner` vertices inside, evenly spread.
/// The outline is kept as it is: outline.size() + inner vertices.
PlanarMesh triangulate(const std::vector<Vec2>& outline, int inner);

/// How two copies of a planar region become a closed body.
struct ThickShape {
  std::function<double(std::size_t)> top, bottom;  ///< z of planar vertex i on the + and on the - side
  /// From planar border vertex i to the body's outline: the rim bulges that far. Empty: a sharp, straight rim.
  std::function<Vec2(std::size_t)> bulge;
  int rim_rings = 1;  ///< vertex rings inside the rim strip; odd puts one of them on the outline
};

/// + side, - side and rim strips. With n = |points| and b border vertices: 2 n + rim_rings b vertices, + side first, then
/// - side in the same order, then the rings.
TriangleMesh thicken(const PlanarMesh& mesh, const ThickShape& shape);

/// The region as an open surface, in the plane z = 0, with texture coordinates.
TriangleMesh flat_surface(const PlanarMesh& mesh);

/// The least grid of `cell` boxes around a mesh, centred.
LatticeHint lattice_around(const Box3& box, Vec3 cell);

Box3 bounding_box(const TriangleMesh& mesh);

/// The collision meshes of the paper's sheets, 1 x 1 m about the origin, with 104, 500 or 1500 triangles, and plain grids of
/// 2 n^2. Only for counts that are offered.
PlanarMesh sheet_collision(std::size_t triangles);
bool offers_collision(std::size_t triangles);

Result<Model> make_sheet(const ModelOptions& options);
Result<Model> make_closed_sheet(const ModelOptions& options);
Result<Model> make_steak(const ModelOptions& options);
Result<Model> make_meniscus(const ModelOptions& options);
Result<Model> make_holed_slab(const ModelOptions& options, int holes);
Result<Model> make_tube(const ModelOptions& options);
Result<Model> make_half_shell(const ModelOptions& options);
Result<Model> make_s_shape(const ModelOptions& options);
Result<Model> make_strip(const ModelOptions& options);
Result<Model> make_mat(const ModelOptions& options);

}  // namespace kerf::models
