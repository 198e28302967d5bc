#include <fmt/format.h>

#include <cctype>
#include <cstring>

#include "kerf/mesh/first_seen.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/mesh_limits.h"
#include "kerf/mesh/text_scanner.h"

namespace kerf {
namespace {

constexpr std::size_t kHeaderBytes = 84;    // 80 of comment, 4 of count
constexpr std::size_t kTriangleBytes = 50;  // 12 floats and 2 bytes of attributes

// Corners at the very same place become one vertex; 0 and -0 are the same place.
class CornerWelder {
 public:
  explicit CornerWelder(std::size_t triangles) : seen_(triangles / 2 + 8) { mesh_.triangles.reserve(triangles); }
  VertexId vertex(Vec3 p) {
    p = p + Vec3{};
    const std::size_t known = seen_.keys().size();
    const std::int32_t number = seen_.number(
        {std::bit_cast<std::uint64_t>(p.x), std::bit_cast<std::uint64_t>(p.y), std::bit_cast<std::uint64_t>(p.z)});
    if (seen_.keys().size() > known) mesh_.positions.push_back(p);
    return VertexId(number);
  }
  TriangleMesh& mesh() { return mesh_; }

 private:
  FirstSeen<3> seen_;
  TriangleMesh mesh_;
};

// Binary files may begin with "solid" too: the size decides, then whether the text goes on as STL text does.
bool is_text(std::string_view bytes) {
  if (bytes.size() >= kHeaderBytes) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, 4);
    if (bytes.size() == kHeaderBytes + kTriangleBytes * std::size_t{count}) return false;
  }
  const std::string_view head = bytes.substr(0, 1024);
  if (head.find('\0') != std::string_view::npos) return false;
  TextScanner scanner(head);
  scanner.skip_empty_lines(0);
  std::string first(scanner.word());
  for (char& c : first) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return first.substr(0, 5) == "solid";
}

Result<TriangleMesh> parse_binary(std::string_view bytes, const std::string& name) {
  if (bytes.size() < kHeaderBytes) {
    return bad_input(
        fmt::format("{}: {} bytes are too few for an STL file, which has a header of 84; the file is truncated "
                    "or not STL",
                    name, bytes.size()));
  }
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  const std::size_t expected = kHeaderBytes + kTriangleBytes * std::size_t{count};
  if (bytes.size() != expected) {
    return bad_input(
        fmt::format("{}: byte 80: the header promises {} triangles, which makes {} bytes, but the file has {}; "
                    "the file is truncated, the count wrong, or it is not STL",
                    name, count, expected, bytes.size()));
  }
  if (count == 0) return bad_input(fmt::format("{}: byte 80: no triangles; export the mesh again", name));
  if (count > kMaxTriangles) return bad_input(name + ": more triangles than 32-bit ids can name; split the mesh");
  CornerWelder welder(count);
  for (std::size_t t = 0; t < count; ++t) {
    const std::size_t at = kHeaderBytes + kTriangleBytes * t;
    float values[12];
    std::memcpy(values, bytes.data() + at, sizeof values);
    std::array<VertexId, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 p{values[3 + 3 * i], values[4 + 3 * i], values[5 + 3 * i]};
      if (!is_finite(p)) {
        return bad_input(
            fmt::format("{}: byte {}: triangle {} has a coordinate that is not a finite number; export it again", name,
                        at + 12 + 12 * i, t + 1));
      }
      corners[i] = welder.vertex(p);
    }
    welder.mesh().triangles.push_back(corners);
  }
  return std::move(welder.mesh());
}

bool same_keyword(std::string_view word, std::string_view lower) {
  if (word.size() != lower.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (std::tolower(static_cast<unsigned char>(word[i])) != lower[i]) return false;
  }
  return true;
}

Result<TriangleMesh> parse_text(std::string_view bytes, const std::string& name) {
  TextScanner scanner(bytes);
  CornerWelder welder(bytes.size() / 200 + 8);
  const auto error = [&](const std::string& message) {
    return bad_input(fmt::format("{}:{}: {}", name, scanner.line(), message));
  };
  const auto next_word = [&] {
    scanner.skip_empty_lines(0);
    return scanner.word();
  };
  const auto expect = [&](std::string_view keyword) -> Status {
    scanner.skip_empty_lines(0);
    if (scanner.at_end()) {
      return error(fmt::format("the file ends in triangle {} where '{}' should stand; it is truncated: write it again",
                               welder.mesh().triangles.size() + 1, keyword));
    }
    const std::string_view word = scanner.word();
    if (same_keyword(word, keyword)) return {};
    return error(fmt::format("triangle {} needs '{}' here, not {}; correct the line",
                             welder.mesh().triangles.size() + 1, keyword, TextScanner::shown(word)));
  };
  bool inside = false;
  for (;;) {
    const std::string_view word = next_word();
    if (word.empty()) break;
    if (same_keyword(word, "solid") || same_keyword(word, "endsolid")) {
      const bool opens = same_keyword(word, "solid");
      if (inside == opens) return error(fmt::format("'{}' stands where it can't; correct the line", word));
      inside = opens;
      scanner.next_line();  // the rest is a name
      continue;
    }
    if (!inside || !same_keyword(word, "facet")) {
      return error(fmt::format("'{}' or the end of the solid must stand here, not {}; correct the line",
                               inside ? "facet" : "solid", TextScanner::shown(word)));
    }
    KERF_TRY(expect("normal"));
    for (int i = 0; i < 3; ++i) {  // not used, and often wrong
      if (scanner.word().empty()) return error("a normal needs three numbers; correct the line");
    }
    KERF_TRY(expect("outer"));
    KERF_TRY(expect("loop"));
    std::array<VertexId, 3> corners;
    for (VertexId& corner : corners) {
      KERF_TRY(expect("vertex"));
      Vec3 p;
      if (!scanner.number(p.x) || !scanner.number(p.y) || !scanner.number(p.z)) {
        return error(fmt::format("triangle {}: a vertex needs three numbers, but {} stands there; correct the line",
                                 welder.mesh().triangles.size() + 1, scanner.word_ahead()));
      }
      if (!is_finite(p)) {
        return error(fmt::format("triangle {} has a coordinate that is not a finite number; correct it",
                                 welder.mesh().triangles.size() + 1));
      }
      corner = welder.vertex(p);
    }
    KERF_TRY(expect("endloop"));
    KERF_TRY(expect("endfacet"));
    if (welder.mesh().triangles.size() >= kMaxTriangles)
      return error("more triangles than 32-bit ids can name; split the mesh");
    welder.mesh().triangles.push_back(corners);
  }
  if (inside) return error("the file ends without 'endsolid'; it is truncated: write it again");
  if (welder.mesh().triangles.empty()) return bad_input(name + ": no triangles; export the mesh again");
  return std::move(welder.mesh());
}

}  // namespace

Result<TriangleMesh> parse_stl(std::string_view bytes, const std::string& name) {
  return is_text(bytes) ? parse_text(bytes, name) : parse_binary(bytes, name);
}

}  // namespace kerf
