// Hexahedra and triangles with fields, for ParaView: VTU files and time series of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// VTK's numbers of the cells that can be written.
enum class VtuCell : std::uint8_t { kVertex = 1, kLine = 3, kTriangle = 5, kHexahedron = 12 };

/// A named array over all points or all cells: components values for each, one after the other.
struct VtuField {
  std::string name;
  int components = 1;  ///< 1: scalar, 3: vector, 9: tensor
  std::vector<double> values;
};

/// What a VTU file holds. corners holds VTK's order; add_hexahedra and add_triangles take Kerf's.
struct VtuMesh {
  std::vector<Vec3> points;  ///< metres
  std::vector<std::int32_t> corners;
  std::vector<VtuCell> cells;
  std::vector<VtuField> point_fields;
  std::vector<VtuField> cell_fields;
};

/// Appends hexahedra over points first_point + index. Kerf numbers corners by bits, VTK around the bottom and
/// the top:
///
///        6------7               7------6
///       /|     /|              /|     /|
///      4------5 |     ->      4------5 |       z   y
///      | 2----|-3             | 3----|-2       |  /
///      |/     |/              |/     |/        | /
///      0------1               0------1         |/___ x
void add_hexahedra(VtuMesh& mesh, std::span<const std::array<std::int32_t, 8>> hexahedra, std::int32_t first_point = 0);
/// Appends the points and triangles of a surface.
void add_triangles(VtuMesh& mesh, const TriangleMesh& surface);

/// Writes inline base64 with 64-bit headers and doubles, uncompressed: opens in ParaView, VTK and meshio.
/// Corners without a point, points that are not finite and fields of the wrong length are refused. Replaces
/// in one go.
Status write_vtu(const std::string& path, const VtuMesh& mesh);

/// Is this the name of a frame of the series NAME.pvd?
bool is_series_frame(std::string_view file, std::string_view name);

/// Frames of one run: NAME.pvd and, beside it, NAME_000000.vtu, NAME_000001.vtu ... The .pvd is complete
/// after every frame, so that a run that is stopped leaves a series that opens.
class VtuSeries {
 public:
  /// path: the .pvd file; its extension may be left out.
  explicit VtuSeries(std::string path);
  /// Writes the next frame; seconds must not decrease.
  Status add(double seconds, const VtuMesh& mesh);
  [[nodiscard]] std::size_t frame_count() const { return times_.size(); }

 private:
  std::string stem_;
  std::vector<double> times_;
};

}  // namespace kerf
