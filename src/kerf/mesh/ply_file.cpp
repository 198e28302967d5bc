#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <optional>
#include <set>

#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/mesh_limits.h"
#include "kerf/mesh/polygon_faces.h"
#include "kerf/mesh/text_scanner.h"
#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

static_assert(std::endian::native == std::endian::little, "the readers and writers assume a little-endian machine");

enum class Type : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::size_t size_of(Type type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<int>(type)];
}
bool is_integer(Type type) { return type < Type::kFloat; }

std::optional<Type> type_named(std::string_view name) {
  constexpr const char* kNames[] = {"char", "uchar", "short", "ushort", "int", "uint", "float", "double"};
  constexpr const char* kSizedNames[] = {"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"};
  for (int i = 0; i < 8; ++i) {
    if (name == kNames[i] || name == kSizedNames[i]) return static_cast<Type>(i);
  }
  return std::nullopt;
}

// What a property means to the mesh.
enum class Role : std::uint8_t { kNone, kX, kY, kZ, kU, kV, kCorners, kTexture, kGroup };

struct Property {
  Type type = Type::kFloat;
  bool is_list = false;
  Type count_type = Type::kUint8;
  Role role = Role::kNone;
  std::string name;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] bool has(Role role) const {
    for (const Property& p : properties) {
      if (p.role == role) return true;
    }
    return false;
  }
};

enum class Encoding { kText, kLittle, kBig };

struct Header {
  Encoding encoding = Encoding::kText;
  std::vector<Element> elements;
};

Role role_of(const Element& element, const std::string& property, bool is_list) {
  if (element.name == "vertex" && !is_list) {
    if (property == "x") return Role::kX;
    if (property == "y") return Role::kY;
    if (property == "z") return Role::kZ;
    for (const char* u : {"u", "s", "texture_u", "texture_s"}) {
      if (property == u && !element.has(Role::kU)) return Role::kU;
    }
    for (const char* v : {"v", "t", "texture_v", "texture_t"}) {
      if (property == v && !element.has(Role::kV)) return Role::kV;
    }
  }
  if (element.name == "face") {
    if (is_list && (property == "vertex_indices" || property == "vertex_index")) return Role::kCorners;
    if (is_list && property == "texcoord") return Role::kTexture;
    if (!is_list && property == "group") return Role::kGroup;
  }
  return Role::kNone;
}

// Values of the body, one after the other; ok() turns false at the end of the bytes.
class BinarySource {
 public:
  BinarySource(std::string_view all, std::size_t offset, bool big)
      : all_(all), at_(offset), begin_(offset), big_(big) {}

  /// Where the current element begins.
  [[nodiscard]] std::string place() const { return fmt::format("byte {}", begin_); }
  bool begin_element() {
    begin_ = at_;
    return !at_end();
  }
  [[nodiscard]] bool at_end() const { return at_ == all_.size(); }
  bool end_element() {
    begin_ = at_;
    return true;
  }
  [[nodiscard]] std::size_t bytes_left() const { return all_.size() - at_; }
  static std::uint64_t smallest(Type type) { return size_of(type); }
  static constexpr bool kHasLines = false;

  bool integer(Type type, std::int64_t& value) {
    switch (type) {
      case Type::kInt8: return read<std::int8_t>(value);
      case Type::kUint8: return read<std::uint8_t>(value);
      case Type::kInt16: return read<std::int16_t>(value);
      case Type::kUint16: return read<std::uint16_t>(value);
      case Type::kInt32: return read<std::int32_t>(value);
      case Type::kUint32: return read<std::uint32_t>(value);
      default: return false;
    }
  }
  bool number(Type type, double& value) {
    if (type == Type::kFloat) return read<float>(value);
    if (type == Type::kDouble) return read<double>(value);
    std::int64_t whole = 0;
    if (!integer(type, whole)) return false;
    value = static_cast<double>(whole);
    return true;
  }
  bool skip(Type type, std::uint64_t n) {
    if (n > bytes_left() / size_of(type)) return false;
    at_ += n * size_of(type);
    return true;
  }
  // Some writers end binary files with a line break.
  bool only_blanks_left() {
    while (at_ < all_.size() && (TextScanner::is_blank(all_[at_]) || TextScanner::is_break(all_[at_]))) ++at_;
    begin_ = at_;
    return at_ == all_.size();
  }

 private:
  template <class Stored, class Value>
  bool read(Value& value) {
    if (sizeof(Stored) > bytes_left()) return false;
    char raw[sizeof(Stored)];
    std::memcpy(raw, all_.data() + at_, sizeof raw);
    if (big_) {
      for (std::size_t i = 0; i < sizeof raw / 2; ++i) std::swap(raw[i], raw[sizeof raw - 1 - i]);
    }
    Stored stored;
    std::memcpy(&stored, raw, sizeof raw);
    value = static_cast<Value>(stored);
    at_ += sizeof(Stored);
    return true;
  }

  std::string_view all_;
  std::size_t at_;
  std::size_t begin_;
  bool big_;
};

class TextSource {
 public:
  TextSource(std::string_view all, std::size_t offset, std::size_t line) : scanner_(all.substr(offset), line) {}

  [[nodiscard]] std::string place() const { return std::to_string(scanner_.line()); }
  // Every element has a line of its own.
  bool begin_element() {
    scanner_.skip_empty_lines(0);
    return !scanner_.at_end();
  }
  [[nodiscard]] bool at_end() const { return scanner_.at_end(); }
  bool end_element() {
    if (!scanner_.at_line_end()) return false;
    scanner_.next_line();
    return true;
  }
  [[nodiscard]] std::size_t bytes_left() const { return scanner_.bytes_left() + 1; }  // the last line break may lack
  static std::uint64_t smallest(Type) { return 2; }                                   // a digit and a blank
  static constexpr bool kHasLines = true;

  bool integer(Type, std::int64_t& value) { return scanner_.integer_word(value); }
  bool number(Type, double& value) { return scanner_.number(value); }
  bool skip(Type, std::uint64_t n) {
    for (; n > 0; --n) {
      if (scanner_.word().empty()) return false;
    }
    return true;
  }
  bool only_blanks_left() {
    scanner_.skip_empty_lines(0);
    return scanner_.at_end();
  }

 private:
  TextScanner scanner_;
};

class PlyReader {
 public:
  PlyReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Result<TriangleMesh> read() {
    KERF_TRY(read_header());
    KERF_TRY(check_header());
    if (header_.encoding == Encoding::kText) {
      TextSource source(bytes_, body_, body_line_);
      KERF_TRY(read_body(source));
    } else {
      BinarySource source(bytes_, body_, header_.encoding == Encoding::kBig);
      KERF_TRY(read_body(source));
    }
    return finish();
  }

 private:
  [[nodiscard]] Error error_at(std::size_t line, const std::string& message) const {
    return bad_input(fmt::format("{}:{}: {}", name_, line, message));
  }
  template <class Source>
  [[nodiscard]] Error error_in(const Source& source, const std::string& message) const {
    return bad_input(Source::kHasLines ? fmt::format("{}:{}: {}", name_, source.place(), message)
                                       : fmt::format("{}: {}: {}", name_, source.place(), message));
  }

  Status read_header() {
    TextScanner scanner(bytes_);
    const auto error = [&](const std::string& message) { return error_at(scanner.line(), message); };
    if (scanner.rest_of_line() != "ply") {
      return error("a PLY file begins with the line 'ply', but this one doesn't; is it a PLY file?");
    }
    bool has_format = false;
    for (;;) {
      scanner.next_line();
      if (scanner.at_end()) return error("the file ends inside its header; it is truncated: write it again");
      const std::string_view keyword = scanner.word();
      if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
      if (keyword == "end_header") break;
      if (keyword == "format") {
        const std::string_view encoding = scanner.word();
        if (encoding == "ascii") {
          header_.encoding = Encoding::kText;
        } else if (encoding == "binary_little_endian") {
          header_.encoding = Encoding::kLittle;
        } else if (encoding == "binary_big_endian") {
          header_.encoding = Encoding::kBig;
        } else {
          return error(fmt::format("format {} is not known; ascii, binary_little_endian and binary_big_endian are",
                                   TextScanner::shown(encoding)));
        }
        has_format = true;
      } else if (keyword == "element") {
        Element element;
        element.name = std::string(scanner.word());
        std::int64_t count = 0;
        if (element.name.empty() || !scanner.integer_word(count) || count < 0) {
          return error("an element needs a name and a count; correct the header");
        }
        element.count = static_cast<std::uint64_t>(count);
        header_.elements.push_back(std::move(element));
        property_names_.clear();
      } else if (keyword == "property") {
        KERF_TRY(read_property(scanner));
      } else {
        return error(fmt::format("{} is not known in a PLY header; correct the line", TextScanner::shown(keyword)));
      }
    }
    if (!has_format) return error("the header has no 'format' line; add one");
    if (!scanner.at_line_end()) return error("'end_header' must stand alone; correct the line");
    scanner.next_line();
    body_ = static_cast<std::size_t>(scanner.position() - bytes_.data());
    body_line_ = scanner.line();
    return {};
  }

  Status read_property(TextScanner& scanner) {
    const auto error = [&](const std::string& message) { return error_at(scanner.line(), message); };
    if (header_.elements.empty()) return error("a property stands before the first element; correct the header");
    Element& element = header_.elements.back();
    Property property;
    std::string_view word = scanner.word();
    if (word == "list") {
      property.is_list = true;
      const std::string_view count_word = scanner.word();
      const std::optional<Type> count_type = type_named(count_word);
      if (!count_type || !is_integer(*count_type)) {
        return error(fmt::format("a list is counted by an integer type, not by {}; correct the header",
                                 TextScanner::shown(count_word)));
      }
      property.count_type = *count_type;
      word = scanner.word();
    }
    const std::optional<Type> type = type_named(word);
    if (!type) {
      return error(
          fmt::format("property type {} is not known; use char, uchar, short, ushort, int, uint, float or double",
                      TextScanner::shown(word)));
    }
    property.type = *type;
    const std::string_view name = scanner.word();
    property.name = std::string(name);
    if (property.name.empty()) return error("a property needs a name; correct the header");
    property.role = role_of(element, property.name, property.is_list);
    if (property.role == Role::kCorners && !is_integer(property.type)) {
      return error("vertex indices must have an integer type; correct the header");
    }
    if (!property_names_.insert(name).second) {
      return error(fmt::format("element '{}' has property '{}' twice; remove one", element.name, property.name));
    }
    element.properties.push_back(std::move(property));
    return {};
  }

  Status check_header() {
    const Element* vertex = nullptr;
    const Element* face = nullptr;
    for (const Element& element : header_.elements) {
      const Element** slot = element.name == "vertex" ? &vertex : element.name == "face" ? &face : nullptr;
      if (slot == nullptr) {
        if (element.name == "tristrips") {
          return bad_input(name_ + ": triangle strips ('tristrips') are not read; export the mesh with faces");
        }
        continue;
      }
      if (*slot != nullptr)
        return bad_input(fmt::format("{}: element '{}' stands twice in the header", name_, element.name));
      *slot = &element;
    }
    if (vertex == nullptr || !vertex->has(Role::kX) || !vertex->has(Role::kY) || !vertex->has(Role::kZ)) {
      return bad_input(name_ + ": the header has no element 'vertex' with x, y and z; export positions");
    }
    if (face == nullptr || !face->has(Role::kCorners) || face->count == 0) {
      return bad_input(name_ + ": no faces; export the mesh with element 'face' and its vertex_indices");
    }
    vertex_count_ = vertex->count;
    has_vertex_texture_ = vertex->has(Role::kU) && vertex->has(Role::kV);
    has_face_texture_ = face->has(Role::kTexture);
    has_group_ = face->has(Role::kGroup);
    return {};
  }

  template <class Source>
  Status read_body(Source& source) {
    for (const Element& element : header_.elements) {
      // A count that lies must not allocate: every element has a smallest size.
      std::uint64_t smallest = 0;
      for (const Property& p : element.properties) smallest += source.smallest(p.is_list ? p.count_type : p.type);
      if (element.name == "face" && !source.kHasLines) {
        for (const Property& p : element.properties) {
          if (p.role == Role::kCorners) smallest += 3 * size_of(p.type);
        }
      }
      if (smallest == 0) continue;
      if (element.count > source.bytes_left() / smallest) {
        return error_in(source,
                        fmt::format("the header promises {} of element '{}', but only {} bytes are left; the file is "
                                    "truncated or the count is wrong",
                                    element.count, element.name, source.bytes_left()));
      }
      if (element.name == "vertex") {
        KERF_TRY(read_vertices(source, element));
      } else if (element.name == "face") {
        KERF_TRY(read_faces(source, element));
      } else {
        KERF_TRY(skip_elements(source, element));
      }
    }
    if (!source.only_blanks_left()) {
      return error_in(source, "all promised elements are read, but more follows; correct the counts in the header");
    }
    return {};
  }

  template <class Source>
  [[nodiscard]] Error broken(const Source& source, const Element& element, std::uint64_t i) const {
    if (source.at_end()) {
      return error_in(source, fmt::format("the file ends in {} {} of {}; it is truncated: write it again", element.name,
                                          i + 1, element.count));
    }
    return error_in(source,
                    fmt::format("{} {} does not have the values that the header promises; correct it, or the file is "
                                "truncated",
                                element.name, i + 1));
  }

  template <class Source>
  static bool skip_property(Source& source, const Property& property) {
    if (!property.is_list) return source.skip(property.type, 1);
    std::int64_t n = 0;
    return source.integer(property.count_type, n) && n >= 0 &&
           source.skip(property.type, static_cast<std::uint64_t>(n));
  }

  template <class Source>
  Status skip_elements(Source& source, const Element& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      bool good = source.begin_element();
      for (std::size_t k = 0; good && k < element.properties.size(); ++k)
        good = skip_property(source, element.properties[k]);
      if (!good || !source.end_element()) return broken(source, element, i);
    }
    return {};
  }

  template <class Source>
  Status read_vertices(Source& source, const Element& element) {
    if (element.count > kMaxVertices) return error_in(source, "more vertices than 32-bit ids can name; split the mesh");
    positions_.reserve(element.count);
    if (has_vertex_texture_) vertex_texture_.reserve(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      bool good = source.begin_element();
      Vec3 p;
      double u = 0;
      double v = 0;
      double* const targets[] = {nullptr, &p.x, &p.y, &p.z, &u, &v};
      for (std::size_t k = 0; good && k < element.properties.size(); ++k) {
        const Property& property = element.properties[k];
        double* target = targets[static_cast<int>(property.role)];  // roles of vertices come first
        good = target != nullptr ? source.number(property.type, *target) : skip_property(source, property);
      }
      if (!good) return broken(source, element, i);
      if (!is_finite(p)) {
        return error_in(source,
                        fmt::format("vertex {} has a coordinate that is not a finite number; correct it", i + 1));
      }
      positions_.push_back(p);
      if (has_vertex_texture_) {
        const Vec2f uv{static_cast<float>(u), static_cast<float>(v)};
        if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
          return error_in(
              source, fmt::format("vertex {} has a texture coordinate that is not a finite number; correct it", i + 1));
        }
        if (!is_texture_coordinate(uv.x) || !is_texture_coordinate(uv.y)) {
          return error_in(
              source, fmt::format("vertex {} has a texture coordinate beyond {:g}; correct it", i + 1, kMostTexture));
        }
        vertex_texture_.push_back(uv);
      }
      if (!source.end_element()) return broken(source, element, i);
    }
    return {};
  }

  template <class Source>
  Status read_faces(Source& source, const Element& element) {
    triangles_.reserve(element.count);
    std::vector<std::int32_t> corners;
    std::vector<double> uvs;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      bool good = source.begin_element();
      corners.clear();
      uvs.clear();
      std::int64_t group = 0;
      for (std::size_t k = 0; good && k < element.properties.size(); ++k) {
        const Property& property = element.properties[k];
        std::int64_t n = 0;
        if (property.role == Role::kCorners) {
          good = source.integer(property.count_type, n) && n >= 0;
          for (; good && n > 0; --n) {
            std::int64_t index = 0;
            good = source.integer(property.type, index);
            if (!good) break;
            if (index < 0 || static_cast<std::uint64_t>(index) >= vertex_count_) {
              return error_in(source,
                              fmt::format("face {} names vertex {}, but the file has {} and they count from 0; correct "
                                          "the index",
                                          i + 1, index, vertex_count_));
            }
            corners.push_back(static_cast<std::int32_t>(index));
          }
        } else if (property.role == Role::kTexture) {
          good = source.integer(property.count_type, n) && n >= 0;
          for (; good && n > 0; --n) {
            double value = 0;
            good = source.number(property.type, value);
            if (good && !std::isfinite(static_cast<float>(value))) {
              return error_in(
                  source,
                  fmt::format("face {} has a texture coordinate that is not a finite number; correct it", i + 1));
            }
            if (good && !is_texture_coordinate(static_cast<float>(value))) {
              return error_in(
                  source, fmt::format("face {} has a texture coordinate beyond {:g}; correct it", i + 1, kMostTexture));
            }
            if (good) uvs.push_back(value);
          }
        } else if (property.role == Role::kGroup) {
          double value = 0;
          good = source.number(property.type, value);
          // Written so that nan fails too.
          if (good && !(value >= 0 && value <= 2147483647.0)) {
            return error_in(source,
                            fmt::format("face {} has a group that is not a number from 0 up; correct it", i + 1));
          }
          if (good) group = static_cast<std::int64_t>(value);
        } else {
          good = skip_property(source, property);
        }
      }
      if (!good) return broken(source, element, i);
      if (corners.size() < 3) {
        return error_in(source, fmt::format("face {} has {} corners, but a face needs at least three; remove it", i + 1,
                                            corners.size()));
      }
      if (has_face_texture_ && !uvs.empty() && uvs.size() != 2 * corners.size()) {
        return error_in(
            source, fmt::format("face {} has {} texture numbers for {} corners, which need two each; correct it", i + 1,
                                uvs.size(), corners.size()));
      }
      if (triangles_.size() + corners.size() - 2 > kMaxTriangles) {
        return error_in(source, "more triangles than 32-bit ids can name; split the mesh");
      }
      if (corners.size() > 3) polygons_.push_back({triangles_.size(), corners.size(), static_cast<std::size_t>(i) + 1});
      for (std::size_t c = 2; c < corners.size(); ++c) {
        const std::size_t fan[3] = {0, c - 1, c};
        triangles_.push_back({VertexId(corners[fan[0]]), VertexId(corners[fan[1]]), VertexId(corners[fan[2]])});
        if (has_group_) groups_.push_back(static_cast<std::int32_t>(group));
        if (!has_face_texture_) continue;
        std::array<Vec2f, 3> texture{};
        for (std::size_t j = 0; j < 3 && !uvs.empty(); ++j) {
          texture[j] = {static_cast<float>(uvs[2 * fan[j]]), static_cast<float>(uvs[2 * fan[j] + 1])};
        }
        face_texture_.push_back(texture);
      }
      if (!source.end_element()) return broken(source, element, i);
    }
    return {};
  }

  Result<TriangleMesh> finish() {
    if (positions_.size() != vertex_count_ || triangles_.empty())
      return bad_input(name_ + ": no faces; export the mesh again");
    TriangleMesh mesh;
    mesh.positions.raw() = std::move(positions_);
    mesh.triangles.raw() = std::move(triangles_);
    mesh.group.raw() = std::move(groups_);
    if (has_face_texture_) {
      mesh.texture.raw() = std::move(face_texture_);
    } else if (has_vertex_texture_) {
      mesh.texture.resize(mesh.triangles.size());
      for (const TriangleId t : ids<TriangleId>(mesh.triangles.size())) {
        for (std::size_t i = 0; i < 3; ++i) mesh.texture[t][i] = vertex_texture_[mesh.triangles[t][i].index()];
      }
    }
    if (const PolygonFace* face = fit_polygon_faces(polygons_, mesh))
      return bad_input(fmt::format("{}: face {}: {}", name_, face->place, too_many_corners(*face)));
    return mesh;
  }

  std::string_view bytes_;
  const std::string& name_;
  Header header_;
  std::set<std::string_view> property_names_;  ///< of the last element
  std::size_t body_ = 0;
  std::size_t body_line_ = 1;
  std::uint64_t vertex_count_ = 0;
  bool has_vertex_texture_ = false, has_face_texture_ = false, has_group_ = false;
  std::vector<Vec3> positions_;
  std::vector<Vec2f> vertex_texture_;
  std::vector<std::array<VertexId, 3>> triangles_;
  std::vector<std::array<Vec2f, 3>> face_texture_;
  std::vector<std::int32_t> groups_;
  std::vector<PolygonFace> polygons_;  ///< of more than three corners
};

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Gives the bytes to a ReplacingFile or a ComparedFile, piece by piece.
template <class File>
void put_ply(File& file, const TriangleMesh& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty double x\nproperty "
      "double y\n"
      "property double z\nelement face {}\nproperty list uchar int vertex_indices\n{}{}end_header\n",
      mesh.positions.size(), mesh.triangles.size(), mesh.has_texture() ? "property list uchar float texcoord\n" : "",
      mesh.group.empty() ? "" : "property int group\n");
  constexpr std::size_t kChunk = std::size_t{1} << 18;
  const auto drain = [&] {
    file.write(bytes);
    bytes.clear();
  };
  for (const Vec3& p : mesh.positions) {
    append(bytes, std::array<double, 3>{p.x, p.y, p.z});
    if (bytes.size() >= kChunk) drain();
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    bytes += '\3';
    const auto& c = mesh.triangles.raw()[t];
    append(bytes, std::array<std::int32_t, 3>{c[0].value, c[1].value, c[2].value});
    if (mesh.has_texture()) {
      bytes += '\6';
      for (const Vec2f& uv : mesh.texture.raw()[t]) append(bytes, std::array<float, 2>{uv.x, uv.y});
    }
    if (!mesh.group.empty()) append(bytes, mesh.group.raw()[t]);
    if (bytes.size() >= kChunk) drain();
  }
  drain();
}

}  // namespace

Result<TriangleMesh> parse_ply(std::string_view bytes, const std::string& name) {
  return PlyReader(bytes, name).read();
}

Status write_ply(const std::string& path, const TriangleMesh& mesh) {
  KERF_TRY(check_writable(path, mesh));
  ReplacingFile file(path);
  put_ply(file, mesh);
  return file.commit();
}

bool holds_ply(const std::string& path, const TriangleMesh& mesh) {
  ComparedFile file(path);
  put_ply(file, mesh);
  return file.is_same();
}

Status write_coloured_ply(const std::string& path, const TriangleMesh& mesh,
                          const std::vector<std::array<std::uint8_t, 3>>& colours,
                          const std::vector<TriangleColumn>& columns) {
  KERF_TRY(check_writable(path, mesh));
  const std::size_t n = mesh.triangles.size();
  bool complete = colours.size() == n;
  std::string properties;
  for (const TriangleColumn& c : columns) {
    complete = complete && c.values.size() == n;
    properties += fmt::format("property float {}\n", c.name);
  }
  if (!complete) return failed(path + ": colours or columns are not one for every triangle");
  ReplacingFile file(path);
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\n"
      "property list uchar int vertex_indices\n{}end_header\n",
      3 * n, n, properties);
  for (std::size_t t = 0; t < n; ++t)
    for (const VertexId v : mesh.triangles.raw()[t]) {
      const Vec3f p = to_float(mesh.positions[v]);
      append(bytes, std::array<float, 3>{p.x, p.y, p.z});
      append(bytes, colours[t]);
    }
  for (std::size_t t = 0; t < n; ++t) {
    bytes += '\3';
    const auto first = static_cast<std::int32_t>(3 * t);
    append(bytes, std::array<std::int32_t, 3>{first, first + 1, first + 2});
    for (const TriangleColumn& c : columns) append(bytes, c.values[t]);
  }
  file.write(bytes);
  return file.commit();
}

}  // namespace kerf
