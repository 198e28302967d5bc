#include "kerf/mesh/mesh_file.h"

#include <fmt/format.h>

#include <cctype>
#include <cstring>
#include <optional>

#include "kerf/base/shown_text.h"
#include "kerf/base/text_encoding.h"
#include "kerf/mesh/text_scanner.h"
#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

enum class Format { kObj, kPly, kStl, kOff };
constexpr const char* kFormatNames[] = {"OBJ", "PLY", "STL", "OFF"};
constexpr const char* kExtensions[] = {"obj", "ply", "stl", "off"};

std::string lower_extension(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  const std::size_t slash = path.rfind('/');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return "";
  std::string extension = path.substr(dot + 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

std::optional<Format> format_of_extension(const std::string& extension) {
  for (int i = 0; i < 4; ++i) {
    if (extension == kExtensions[i]) return static_cast<Format>(i);
  }
  return std::nullopt;
}

// The format that the content shows beyond doubt, or none.
std::optional<Format> format_of_content(std::string_view bytes) {
  if (bytes.substr(0, 3) == "ply" && bytes.size() > 3 && TextScanner::is_break(bytes[3])) return Format::kPly;
  if (bytes.size() >= 84) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, 4);
    if (count > 0 && bytes.size() == 84 + std::size_t{50} * count) return Format::kStl;
  }
  TextScanner scanner(bytes.substr(0, 4096));
  scanner.skip_empty_lines('#');
  const std::string_view first = scanner.word();
  if (first == "OFF" || first == "COFF" || first == "NOFF" || first == "CNOFF" || first == "STOFF") return Format::kOff;
  if (first == "solid" && bytes.substr(0, 4096).find("facet") != std::string_view::npos) return Format::kStl;
  for (std::string_view word = first; !scanner.at_end(); word = scanner.word()) {
    double value = 0;
    if (word == "v" && scanner.number(value) && scanner.number(value) && scanner.number(value)) return Format::kObj;
    scanner.next_line();
    scanner.skip_empty_lines('#');
  }
  return std::nullopt;
}

Result<TriangleMesh> parse_mesh(std::string_view bytes, const std::string& path,
                                std::vector<std::string>* group_names) {
  if (bytes.substr(0, 3) == "\xEF\xBB\xBF") bytes.remove_prefix(3);  // editors may mark text as UTF-8
  const std::string extension = lower_extension(path);
  const std::optional<Format> format = format_of_extension(extension);
  const std::optional<Format> content = format_of_content(bytes);
  if (!format) {
    std::string message = extension.empty() ? fmt::format("{}: the file name has no extension", shown(path))
                                            : fmt::format("{}: '.{}' is not a mesh format that can be read",
                                                          shown(path), shown(extension));
    if (content) {
      const int i = static_cast<int>(*content);
      return bad_input(fmt::format("{}; the content looks like {}: rename it to end in .{}", message, kFormatNames[i],
                                   kExtensions[i]));
    }
    return bad_input(message + "; give an .obj, .ply, .stl or .off file");
  }
  if (!content && is_utf16(bytes)) return bad_input(fmt::format("{}: {}", shown(path), kIsUtf16));
  if (content && *content != *format) {
    const int i = static_cast<int>(*content);
    return bad_input(fmt::format("{}: the extension says {}, but the content is {}; rename it to end in .{}",
                                 shown(path), kFormatNames[static_cast<int>(*format)], kFormatNames[i],
                                 kExtensions[i]));
  }
  switch (*format) {
    case Format::kObj: return parse_obj(bytes, shown(path), group_names);
    case Format::kPly: return parse_ply(bytes, shown(path));
    case Format::kStl: return parse_stl(bytes, shown(path));
    case Format::kOff: return parse_off(bytes, shown(path));
  }
  return bad_input(shown(path) + ": unknown mesh format");
}

}  // namespace

Status check_writable(const std::string& path, const TriangleMesh& mesh) {
  const std::size_t n = mesh.triangles.size();
  if ((mesh.has_texture() && mesh.texture.size() != n) || (!mesh.group.empty() && mesh.group.size() != n)) {
    return failed(fmt::format("{}: {} triangles, but texture for {} and groups for {}; nothing was written",
                              shown(path), n, mesh.texture.size(), mesh.group.size()));
  }
  for (const Vec3& p : mesh.positions) {
    if (!is_finite(p)) return failed(fmt::format("{}: a position is not finite; nothing was written", shown(path)));
  }
  for (const auto& t : mesh.triangles) {
    for (const VertexId v : t) {
      if (!mesh.positions.contains(v)) {
        return failed(fmt::format("{}: a triangle names vertex {} of {}; nothing was written", shown(path), v.value,
                                  mesh.positions.size()));
      }
    }
  }
  return {};
}

Result<TriangleMesh> read_mesh(const std::string& path, std::vector<std::string>* group_names) {
  if (group_names != nullptr) group_names->clear();
  const Result<FileBytes> file = read_whole_file(path, kMeshFile);
  if (!file) return file.error();
  return within_memory(path, [&] { return parse_mesh(file->view(), path, group_names); });
}

}  // namespace kerf
