// Triangle meshes in files: OBJ, PLY, STL and OFF in; OBJ and PLY out.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// Reads a mesh; the extension (.obj, .ply, .stl, .off, any case) names the format, and the content must
/// agree. Polygons become triangles (polygon_faces.h). Texture coordinates and groups (OBJ: usemtl, or g where there is
/// no usemtl; PLY: the face property `group`) are kept per triangle; STL corners at the very same place
/// become one vertex. The mesh is as the file has it, unchecked but for this: there are triangles, all
/// corners exist, all positions are finite. Everything else, with repairs: check_surface. Bad input gets an
/// Error with file and line (text) or byte (binary). Linear in the file's size; memory: the file and the
/// mesh. group_names: receives the names of the groups in the order of their numbers, where the format has
/// them.
Result<TriangleMesh> read_mesh(const std::string& path, std::vector<std::string>* group_names = nullptr);

/// Writes an OBJ that reads back to the same bits (17 significant digits). Equal texture coordinates share a
/// vt. Where the mesh has groups, every run of triangles of one group follows a `usemtl NAME` and `g NAME`; a
/// group without a name in group_names is called group_N. An existing file is replaced in one go.
Status write_obj(const std::string& path, const TriangleMesh& mesh, const std::vector<std::string>& group_names = {});

/// Writes a binary little-endian PLY with positions in doubles, texture coordinates per corner (`texcoord`)
/// and groups
/// (`group`) where the mesh has them. An existing file is replaced in one go.
Status write_ply(const std::string& path, const TriangleMesh& mesh);

/// Has the file every byte that write_obj or write_ply would write, and no more? False where it can't be read.
bool holds_obj(const std::string& path, const TriangleMesh& mesh, const std::vector<std::string>& group_names = {});
bool holds_ply(const std::string& path, const TriangleMesh& mesh);

/// Numbers of every triangle, for write_coloured_ply.
struct TriangleColumn {
  std::string name;  ///< a word
  std::vector<float> values;
};
/// Writes a binary PLY for looking at: every triangle has corners of its own in its colour (red, green, blue), and
/// properties of the columns' names. An existing file is replaced in one go.
Status write_coloured_ply(const std::string& path, const TriangleMesh& mesh,
                          const std::vector<std::array<std::uint8_t, 3>>& colours,
                          const std::vector<TriangleColumn>& columns);

/// What both writers refuse before they touch the disk: corners that don't exist, positions that are not
/// finite, texture or groups that are not one for every triangle.
Status check_writable(const std::string& path, const TriangleMesh& mesh);

/// The readers behind read_mesh, on text or bytes already in memory; `name` stands for the file in errors.
Result<TriangleMesh> parse_obj(std::string_view bytes, const std::string& name,
                               std::vector<std::string>* group_names = nullptr);
Result<TriangleMesh> parse_ply(std::string_view bytes, const std::string& name);
Result<TriangleMesh> parse_stl(std::string_view bytes, const std::string& name);
Result<TriangleMesh> parse_off(std::string_view bytes, const std::string& name);

}  // namespace kerf
