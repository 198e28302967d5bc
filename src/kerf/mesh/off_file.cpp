#include <fmt/format.h>

#include <algorithm>

#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/mesh_limits.h"
#include "kerf/mesh/polygon_faces.h"
#include "kerf/mesh/text_scanner.h"

namespace kerf {

Result<TriangleMesh> parse_off(std::string_view bytes, const std::string& name) {
  TextScanner scanner(bytes);
  const auto error = [&](const std::string& message) {
    return bad_input(fmt::format("{}:{}: {}", name, scanner.line(), message));
  };
  scanner.skip_empty_lines('#');
  const std::string_view first = scanner.word();
  // ModelNet's files have the first count right behind the word.
  const std::size_t letters = std::min(first.find_first_of("0123456789"), first.size());
  if (letters < first.size() && letters > 0) scanner.back_to(first, letters);
  const std::string header(first.substr(0, letters));
  bool has_texture = false;
  std::string_view flags = header;
  if (flags.substr(0, 2) == "ST") {
    has_texture = true;
    flags.remove_prefix(2);
  }
  if (flags.substr(0, 1) == "C") flags.remove_prefix(1);
  if (flags.substr(0, 1) == "N") flags.remove_prefix(1);
  if (flags != "OFF") {
    return error(
        fmt::format("an OFF file begins with OFF (or COFF, NOFF, STOFF), but this one with {}; export it as "
                    "three-dimensional text OFF",
                    TextScanner::shown(first)));
  }
  if (TextScanner ahead = scanner; ahead.word() == "BINARY")
    return error("binary OFF is not read; export it as text OFF or PLY");

  std::int64_t counts[2] = {0, 0};
  for (std::int64_t& count : counts) {
    for (;;) {  // the counts may stand on the first line or below comments
      if (!scanner.at_line_end() && *scanner.position() != '#') break;
      if (scanner.at_end()) return error("the file ends before the counts of vertices and faces; write it again");
      scanner.next_line();
    }
    if (!scanner.integer_word(count) || count < 0) {
      return error(fmt::format("the counts of vertices and faces must stand here, not {}; correct the header",
                               scanner.word_ahead()));
    }
  }
  scanner.next_line();
  const auto vertex_count = static_cast<std::uint64_t>(counts[0]);
  const auto face_count = static_cast<std::uint64_t>(counts[1]);
  // Shortest vertex "0 0 0\n", shortest face "3 0 0 0\n"; the last may lack its line break.
  const std::uint64_t room = scanner.bytes_left() + 1;
  if (vertex_count > room / 6 || face_count > (room - 6 * vertex_count) / 8) {
    return error(
        fmt::format("the header promises {} vertices and {} faces, but only {} bytes follow; the file is truncated "
                    "or the counts are wrong",
                    vertex_count, face_count, scanner.bytes_left()));
  }
  if (face_count == 0) return error("no faces; export the mesh with its faces");
  if (vertex_count > kMaxVertices) return error("more vertices than 32-bit ids can name; split the mesh");

  TriangleMesh mesh;
  mesh.positions.reserve(vertex_count);
  std::vector<Vec2f> vertex_texture;
  for (std::uint64_t v = 0; v < vertex_count; ++v) {
    scanner.skip_empty_lines('#');
    double c[3] = {0, 0, 0};
    for (double& value : c) {
      if (scanner.number(value)) continue;
      if (scanner.at_end()) {
        return error(
            fmt::format("the file ends at vertex {} of {}; it is truncated: write it again", v + 1, vertex_count));
      }
      return error(fmt::format("vertex {} needs three numbers, but {} stands there; correct the line", v + 1,
                               scanner.word_ahead()));
    }
    const Vec3 p{c[0], c[1], c[2]};
    if (!is_finite(p)) {
      return error(fmt::format("vertex {} has a coordinate that is not a finite number; correct it", v + 1));
    }
    mesh.positions.push_back(p);
    if (has_texture) {  // the last two numbers of the line
      double uv[2] = {0, 0};
      int extra = 0;
      for (double value = 0; scanner.number(value); ++extra) {
        uv[0] = uv[1];
        uv[1] = value;
      }
      const Vec2f texture{static_cast<float>(uv[0]), static_cast<float>(uv[1])};
      if (extra < 2 || !std::isfinite(texture.x) || !std::isfinite(texture.y)) {
        return error(fmt::format(
            "vertex {} has no finite texture coordinates, but the header says {}; correct the line", v + 1, header));
      }
      if (!is_texture_coordinate(texture.x) || !is_texture_coordinate(texture.y)) {
        return error(fmt::format("vertex {} has a texture coordinate beyond {:g}; correct it", v + 1, kMostTexture));
      }
      vertex_texture.push_back(texture);
    }
    scanner.next_line();
  }
  mesh.triangles.reserve(face_count);
  std::vector<VertexId> face;
  std::vector<PolygonFace> polygons;  // of more than three corners
  for (std::uint64_t f = 0; f < face_count; ++f) {
    scanner.skip_empty_lines('#');
    if (scanner.at_end()) {
      return error(fmt::format("the file ends at face {} of {}; it is truncated: write it again", f + 1, face_count));
    }
    std::int64_t corners = 0;
    if (!scanner.integer_word(corners) || corners < 3) {
      return error(fmt::format("face {} must begin with its number of corners, at least 3; correct the line", f + 1));
    }
    face.clear();
    // A face may go over several lines, which hold its corners and nothing else then.
    const TextScanner begin = scanner;
    bool goes_on = false;
    for (std::int64_t i = 0; i < corners; ++i) {
      std::int64_t index = 0;
      if (scanner.at_line_end()) {
        TextScanner ahead = scanner;
        ahead.skip_empty_lines('#');
        if (!ahead.at_end()) {
          scanner = ahead;
          goes_on = true;
        }
      }
      if (!scanner.integer_word(index)) {
        return error(fmt::format("face {} has {} corners, but {} stands where corner {} should; correct the line",
                                 f + 1, corners, scanner.word_ahead(), i + 1));
      }
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertex_count) {
        return error(
            fmt::format("face {} names vertex {}, but the file has {} and they count from 0; correct the index", f + 1,
                        index, vertex_count));
      }
      face.emplace_back(static_cast<std::int32_t>(index));
    }
    if (goes_on && !scanner.at_line_end()) {
      scanner = begin;
      return error(fmt::format(
          "face {} has {} corners, but its line has fewer, and the next one is no rest of it; correct the line", f + 1,
          corners));
    }
    if (mesh.triangles.size() + face.size() - 2 > kMaxTriangles) {
      return error("more triangles than 32-bit ids can name; split the mesh");
    }
    if (face.size() > 3) polygons.push_back({mesh.triangles.size(), face.size(), static_cast<std::size_t>(f + 1)});
    for (std::size_t i = 2; i < face.size(); ++i) {
      mesh.triangles.push_back({face[0], face[i - 1], face[i]});
      if (has_texture) {
        mesh.texture.push_back(
            {vertex_texture[face[0].index()], vertex_texture[face[i - 1].index()], vertex_texture[face[i].index()]});
      }
    }
    scanner.next_line();
  }
  scanner.skip_empty_lines('#');
  if (!scanner.at_end()) {
    return error(fmt::format("{} faces were promised and read, but more follows; correct the counts", face_count));
  }
  if (const PolygonFace* late = fit_polygon_faces(polygons, mesh))
    return bad_input(fmt::format("{}: face {}: {}", name, late->place, too_many_corners(*late)));
  return mesh;
}

}  // namespace kerf
