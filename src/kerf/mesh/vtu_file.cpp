#include "kerf/mesh/vtu_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "kerf/base/shown_text.h"
#include "kerf/mesh/base64.h"
#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

constexpr int kVtkFromKerf[8] = {0, 1, 3, 2, 4, 5, 7, 6};  // corner i of VTK is this one of Kerf

std::size_t corner_count(VtuCell cell) {
  switch (cell) {
    case VtuCell::kVertex: return 1;
    case VtuCell::kLine: return 2;
    case VtuCell::kTriangle: return 3;
    case VtuCell::kHexahedron: return 8;
  }
  return 0;
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += static_cast<unsigned char>(c) < 32 ? ' ' : c;
    }
  }
  return out;
}

// One array: its length in bytes as UInt64 and its values in a single base64 stream.
void write_array(ReplacingFile& file, const char* type, const std::string& name, int components, const void* data,
                 std::uint64_t bytes) {
  file.write(fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"binary\">\n", type,
                         escaped(name), components));
  Base64Encoder encoder;
  std::string text;
  encoder.add(&bytes, sizeof bytes, text);
  constexpr std::uint64_t kChunk = std::uint64_t{1} << 20;
  for (std::uint64_t at = 0; at < bytes; at += kChunk) {
    encoder.add(static_cast<const char*>(data) + at, std::min(kChunk, bytes - at), text);
    file.write(text);
    text.clear();
  }
  encoder.finish(text);
  file.write(text + "\n</DataArray>\n");
}

Status check_fields(const std::string& path, const std::vector<VtuField>& fields, std::size_t count, const char* what) {
  for (const VtuField& field : fields) {
    if (field.components > 0 && field.values.size() == count * static_cast<std::size_t>(field.components)) continue;
    return bad_input(fmt::format("{}: field '{}' has {} values, but {} {} with {} components each need {}", shown(path),
                                 field.name, field.values.size(), count, what, field.components,
                                 count * static_cast<std::size_t>(std::max(field.components, 0))));
  }
  return {};
}

void write_fields(ReplacingFile& file, const char* tag, const std::vector<VtuField>& fields) {
  file.write(fmt::format("<{}>\n", tag));
  for (const VtuField& field : fields) {
    write_array(file, "Float64", field.name, field.components, field.values.data(),
                field.values.size() * sizeof(double));
  }
  file.write(fmt::format("</{}>\n", tag));
}

}  // namespace

void add_hexahedra(VtuMesh& mesh, std::span<const std::array<std::int32_t, 8>> hexahedra, std::int32_t first_point) {
  for (const auto& hexahedron : hexahedra) {
    for (const int corner : kVtkFromKerf)
      mesh.corners.push_back(first_point + hexahedron[static_cast<std::size_t>(corner)]);
    mesh.cells.push_back(VtuCell::kHexahedron);
  }
}

void add_triangles(VtuMesh& mesh, const TriangleMesh& surface) {
  const auto first = static_cast<std::int32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), surface.positions.begin(), surface.positions.end());
  for (const auto& t : surface.triangles) {
    for (const VertexId v : t) mesh.corners.push_back(first + v.value);
    mesh.cells.push_back(VtuCell::kTriangle);
  }
}

Status write_vtu(const std::string& path, const VtuMesh& mesh) {
  std::vector<std::int64_t> offsets;
  offsets.reserve(mesh.cells.size());
  std::size_t end = 0;
  for (const VtuCell cell : mesh.cells) {
    end += corner_count(cell);
    offsets.push_back(static_cast<std::int64_t>(end));
  }
  if (end != mesh.corners.size()) {
    return bad_input(fmt::format("{}: {} cells need {} corners, but there are {}", shown(path), mesh.cells.size(), end,
                                 mesh.corners.size()));
  }
  for (std::size_t i = 0; i < mesh.corners.size(); ++i) {
    if (mesh.corners[i] >= 0 && static_cast<std::size_t>(mesh.corners[i]) < mesh.points.size()) continue;
    return bad_input(fmt::format("{}: corner {} names point {}, but there are {}", shown(path), i + 1, mesh.corners[i],
                                 mesh.points.size()));
  }
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (!is_finite(mesh.points[i])) return bad_input(fmt::format("{}: point {} is not finite", shown(path), i + 1));
  }
  KERF_TRY(check_fields(path, mesh.point_fields, mesh.points.size(), "points"));
  KERF_TRY(check_fields(path, mesh.cell_fields, mesh.cells.size(), "cells"));

  static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(VtuCell) == 1);
  const std::vector<std::int64_t> corners(mesh.corners.begin(), mesh.corners.end());
  ReplacingFile file(path);
  file.write(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n");
  file.write(
      fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", mesh.points.size(), mesh.cells.size()));
  write_fields(file, "PointData", mesh.point_fields);
  write_fields(file, "CellData", mesh.cell_fields);
  file.write("<Points>\n");
  write_array(file, "Float64", "Points", 3, mesh.points.data(), mesh.points.size() * sizeof(Vec3));
  file.write("</Points>\n<Cells>\n");
  write_array(file, "Int64", "connectivity", 1, corners.data(), corners.size() * sizeof(std::int64_t));
  write_array(file, "Int64", "offsets", 1, offsets.data(), offsets.size() * sizeof(std::int64_t));
  write_array(file, "UInt8", "types", 1, mesh.cells.data(), mesh.cells.size());
  file.write("</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
  return file.commit();
}

bool is_series_frame(std::string_view file, std::string_view name) {
  constexpr std::string_view kEnding = ".vtu";
  constexpr std::size_t kDigits = 6;  // or more
  if (!file.starts_with(name) || !file.ends_with(kEnding) || file.size() < name.size() + 1 + kDigits + kEnding.size())
    return false;
  const std::string_view middle = file.substr(name.size(), file.size() - name.size() - kEnding.size());
  return middle.front() == '_' && middle.find_first_not_of("0123456789", 1) == std::string_view::npos;
}

VtuSeries::VtuSeries(std::string path) : stem_(std::move(path)) {
  if (stem_.size() > 4 && stem_.substr(stem_.size() - 4) == ".pvd") stem_.resize(stem_.size() - 4);
}

Status VtuSeries::add(double seconds, const VtuMesh& mesh) {
  if (!std::isfinite(seconds) || (!times_.empty() && seconds < times_.back())) {
    return bad_input(fmt::format("{}.pvd: time {} of frame {} is not finite or lies before the last one", stem_,
                                 seconds, times_.size() + 1));
  }
  const auto frame_path = [&](std::size_t i) { return fmt::format("{}_{:06}.vtu", stem_, i); };
  KERF_TRY(write_vtu(frame_path(times_.size()), mesh));
  times_.push_back(seconds);
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t i = 0; i < times_.size(); ++i) {
    const std::string file = frame_path(i);
    const std::size_t slash = file.rfind('/');  // names are relative to the .pvd
    text += fmt::format("<DataSet timestep=\"{:.17g}\" part=\"0\" file=\"{}\"/>\n", times_[i],
                        escaped(slash == std::string::npos ? file : file.substr(slash + 1)));
  }
  return replace_file(stem_ + ".pvd", text + "</Collection>\n</VTKFile>\n");
}

}  // namespace kerf
