#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <unordered_map>

#include "kerf/mesh/first_seen.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/mesh_limits.h"
#include "kerf/mesh/polygon_faces.h"
#include "kerf/mesh/text_scanner.h"
#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

struct Corner {
  std::int32_t vertex;
  std::int32_t texture;  ///< -1: none
};

// The largest index of a file so far that names something not yet defined, with its line; later ones only
// matter when they are larger.
struct ForwardReferences {
  std::vector<std::pair<std::int64_t, std::size_t>> seen;
  void add(std::int64_t index, std::size_t line) {
    if (seen.empty() || index > seen.back().first) seen.emplace_back(index, line);
  }
};

// Groups are numbered by the first appearance of their names, which are views of the file.
class GroupNumbers {
 public:
  std::int32_t number(std::string_view name) {
    const auto [at, is_new] = numbers_.emplace(name, static_cast<std::int32_t>(names_.size()));
    if (is_new) names_.emplace_back(name);
    return at->second;
  }
  std::vector<std::string> take_names() { return std::move(names_); }

 private:
  std::unordered_map<std::string_view, std::int32_t> numbers_;
  std::vector<std::string> names_;
};

class ObjReader {
 public:
  ObjReader(std::string_view bytes, const std::string& name) : scanner_(bytes), name_(name) {
    // About 30 bytes a line: enough to grow the arrays once or twice at most.
    positions_.reserve(bytes.size() / 90 + 8);
    triangles_.reserve(bytes.size() / 60 + 8);
  }

  Result<TriangleMesh> read(std::vector<std::string>* group_names) {
    while (!scanner_.at_end()) {
      const std::string_view keyword = scanner_.word();
      if (keyword == "v") {
        KERF_TRY(read_vertex());
      } else if (keyword == "f") {
        KERF_TRY(read_face());
      } else if (keyword == "vt") {
        KERF_TRY(read_texture());
      } else if (keyword == "usemtl") {
        uses_materials_ = true;
        material_ = materials_.number(scanner_.rest_of_line());
      } else if (keyword == "g" || keyword == "o") {
        object_ = objects_.number(scanner_.rest_of_line());
      } else if (!keyword.empty() && keyword[0] != '#' && first_unknown_ == 0 && !is_known(keyword)) {
        first_unknown_ = scanner_.line();
        unknown_word_ = TextScanner::shown(keyword);
      }
      skip_line();
    }
    return finish(group_names);
  }

 private:
  Error error(const std::string& message) const {
    return error_at(scanner_.line(),
                    is_last_line() ? message + "; it is the last line: the file may be cut off" : message);
  }
  [[nodiscard]] bool is_last_line() const {
    TextScanner after = scanner_;
    (void)after.rest_of_line();
    after.next_line();
    after.skip_empty_lines('#');
    return after.at_end();
  }
  Error error_at(std::size_t line, const std::string& message) const {
    return bad_input(fmt::format("{}:{}: {}", name_, line, message));
  }
  static bool is_known(std::string_view keyword) {
    for (const char* known :
         {"vn",    "vp",    "s",      "l",      "p",        "mtllib",   "mg",   "cstype",     "deg",
          "bmat",  "step",  "curv",   "curv2",  "surf",     "parm",     "trim", "hole",       "scrv",
          "sp",    "end",   "con",    "bevel",  "c_interp", "d_interp", "lod",  "shadow_obj", "trace_obj",
          "ctech", "stech", "maplib", "usemap", "call",     "csh"}) {
      if (keyword == known) return true;
    }
    return false;
  }

  // To the next line, over lines joined by a backslash.
  void skip_line() {
    for (;;) {
      const std::string_view rest = scanner_.rest_of_line();
      scanner_.next_line();
      if (rest.empty() || rest.back() != '\\') return;
    }
  }
  // At the end of the line, where a joined line doesn't end.
  bool at_line_end() {
    for (;;) {
      if (scanner_.at_line_end()) return true;
      if (*scanner_.position() != '\\') return false;
      TextScanner ahead = scanner_;
      ahead.step();
      if (!ahead.at_line_end() || ahead.at_end()) return false;
      ahead.next_line();
      scanner_ = ahead;
    }
  }

  Status read_vertex() {
    double c[3];
    for (double& value : c) {
      if (at_line_end() || !scanner_.number(value)) {
        return error(fmt::format("vertex {} needs three numbers, but {} stands there; correct the line",
                                 positions_.size() + 1, scanner_.word_ahead()));
      }
    }
    if (!std::isfinite(c[0]) || !std::isfinite(c[1]) || !std::isfinite(c[2])) {
      return error(fmt::format("vertex {} has a coordinate that is not a finite number; correct or remove it",
                               positions_.size() + 1));
    }
    if (positions_.size() >= kMaxVertices) return error("more vertices than 32-bit ids can name; split the mesh");
    positions_.push_back({c[0], c[1], c[2]});
    return {};
  }

  Status read_texture() {
    double u = 0;
    double v = 0;
    if (at_line_end() || !scanner_.number(u) || (!at_line_end() && !scanner_.number(v))) {
      return error(fmt::format("texture coordinate {} needs two numbers, but {} stands there; correct the line",
                               texture_.size() + 1, scanner_.word_ahead()));
    }
    const Vec2f uv{static_cast<float>(u), static_cast<float>(v)};
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
      return error(
          fmt::format("texture coordinate {} is not a finite number; correct or remove it", texture_.size() + 1));
    }
    if (!is_texture_coordinate(uv.x) || !is_texture_coordinate(uv.y)) {
      return error(
          fmt::format("texture coordinate {} is beyond {:g}; correct or remove it", texture_.size() + 1, kMostTexture));
    }
    texture_.push_back(uv);
    return {};
  }

  // One index of a corner: 1-based from the front, or negative from the back of what is defined so far.
  Status resolve(std::int64_t raw, std::size_t defined, const char* what, ForwardReferences& forward,
                 std::int32_t& index) {
    std::int64_t resolved = raw;
    if (raw < 0) resolved = static_cast<std::int64_t>(defined) + raw + 1;
    if (raw == 0 || resolved < 1 || resolved > static_cast<std::int64_t>(kMaxVertices)) {
      return error(fmt::format("face names {} {}, but {} are defined and they count from 1; correct the index", what,
                               raw, defined));
    }
    if (resolved > static_cast<std::int64_t>(defined)) forward.add(resolved, scanner_.line());
    index = static_cast<std::int32_t>(resolved - 1);
    return {};
  }

  Status read_face() {
    face_.clear();
    while (!at_line_end()) {
      std::int64_t raw = 0;
      Corner corner{-1, -1};
      if (*scanner_.position() == '#') break;
      if (!scanner_.integer(raw)) {
        return error(fmt::format("face corner must be a vertex number, but {} stands there; correct the line",
                                 scanner_.word_ahead()));
      }
      KERF_TRY(resolve(raw, positions_.size(), "vertex", forward_vertices_, corner.vertex));
      if (scanner_.skip('/')) {
        if (scanner_.integer(raw)) {
          KERF_TRY(resolve(raw, texture_.size(), "texture coordinate", forward_texture_, corner.texture));
        }
        if (scanner_.skip('/')) (void)scanner_.integer(raw);  // normals are not used
      }
      if (!scanner_.at_end() && !TextScanner::is_blank(*scanner_.position()) && !scanner_.at_line_end()) {
        return error(fmt::format("face corner {} ends in {}; write corners as v, v/vt, v//vn or v/vt/vn",
                                 face_.size() + 1, scanner_.word_ahead()));
      }
      face_.push_back(corner);
    }
    if (face_.size() < 3) {
      return error(
          fmt::format("a face needs at least three corners, this one has {}; complete or remove it", face_.size()));
    }
    if (triangles_.size() + face_.size() - 2 > kMaxTriangles) {
      return error("more triangles than 32-bit ids can name; split the mesh");
    }
    if (face_.size() > 3) polygons_.push_back({triangles_.size(), face_.size(), scanner_.line()});
    for (std::size_t i = 2; i < face_.size(); ++i) {
      const Corner corners[3] = {face_[0], face_[i - 1], face_[i]};
      triangles_.push_back({VertexId(corners[0].vertex), VertexId(corners[1].vertex), VertexId(corners[2].vertex)});
      const bool textured = corners[0].texture >= 0 || corners[1].texture >= 0 || corners[2].texture >= 0;
      if (textured && texture_corners_.empty()) texture_corners_.resize(triangles_.size() - 1, {-1, -1, -1});
      if (textured || !texture_corners_.empty()) {
        texture_corners_.push_back({corners[0].texture, corners[1].texture, corners[2].texture});
      }
      // Most files have one group: nothing is stored until a second one appears.
      if (material_groups_.empty() && material_ > 0) material_groups_.resize(triangles_.size() - 1, 0);
      if (object_groups_.empty() && object_ > 0) object_groups_.resize(triangles_.size() - 1, 0);
      if (!material_groups_.empty() || material_ > 0) material_groups_.push_back(std::max(material_, 0));
      if (!object_groups_.empty() || object_ > 0) object_groups_.push_back(std::max(object_, 0));
    }
    return {};
  }

  Status check_forward(const ForwardReferences& forward, std::size_t defined, const char* what) const {
    for (const auto& [index, line] : forward.seen) {
      if (index <= static_cast<std::int64_t>(defined)) continue;
      return error_at(
          line, fmt::format("face names {} {}, but the file has {}; correct the index, or the file is truncated", what,
                            index, defined));
    }
    return {};
  }

  Result<TriangleMesh> finish(std::vector<std::string>* group_names) {
    if (triangles_.empty()) {
      if (first_unknown_ != 0) {
        return error_at(
            first_unknown_,
            fmt::format("{} is not an OBJ keyword and the file has no faces; is it an OBJ file?", unknown_word_));
      }
      return bad_input(fmt::format("{}: {} vertices, but no faces ('f' lines); export the mesh with its faces", name_,
                                   positions_.size()));
    }
    KERF_TRY(check_forward(forward_vertices_, positions_.size(), "vertex"));
    // Some exporters write v/vt where they have no texture: without any vt line there is none.
    if (texture_.empty()) texture_corners_ = {};
    else KERF_TRY(check_forward(forward_texture_, texture_.size(), "texture coordinate"));
    TriangleMesh mesh;
    mesh.positions.raw() = std::move(positions_);
    mesh.triangles.raw() = std::move(triangles_);
    if (!texture_corners_.empty()) {
      mesh.texture.resize(texture_corners_.size());
      for (std::size_t t = 0; t < texture_corners_.size(); ++t) {
        for (std::size_t i = 0; i < 3; ++i) {
          const std::int32_t k = texture_corners_[t][i];
          if (k >= 0) mesh.texture.raw()[t][i] = texture_[static_cast<std::size_t>(k)];
        }
      }
    }
    if (const PolygonFace* face = fit_polygon_faces(polygons_, mesh))
      return error_at(face->place, too_many_corners(*face));
    mesh.group.raw() = std::move(uses_materials_ ? material_groups_ : object_groups_);
    if (group_names != nullptr) *group_names = (uses_materials_ ? materials_ : objects_).take_names();
    return mesh;
  }

  TextScanner scanner_;
  const std::string& name_;
  std::vector<Vec3> positions_;
  std::vector<Vec2f> texture_;
  std::vector<std::array<VertexId, 3>> triangles_;
  std::vector<std::array<std::int32_t, 3>> texture_corners_;
  std::vector<PolygonFace> polygons_;  // of more than three corners
  std::vector<std::int32_t> material_groups_, object_groups_;
  GroupNumbers materials_, objects_;
  std::int32_t material_ = -1, object_ = -1;
  bool uses_materials_ = false;
  ForwardReferences forward_vertices_, forward_texture_;
  std::vector<Corner> face_;
  std::size_t first_unknown_ = 0;
  std::string unknown_word_;
};

std::string group_name(std::int32_t group, const std::vector<std::string>& names) {
  const auto i = static_cast<std::size_t>(group);
  std::string name = group >= 0 && i < names.size() && !names[i].empty() ? names[i] : fmt::format("group_{}", group);
  for (char& c : name) {
    if (TextScanner::is_break(c) || TextScanner::is_blank(c)) c = '_';  // a name ends at the first blank
  }
  return name;
}

/// Gives the text to a ReplacingFile or a ComparedFile, piece by piece.
template <class File>
void put_obj(File& file, const TriangleMesh& mesh, const std::vector<std::string>& group_names) {
  fmt::memory_buffer text;
  auto out = std::back_inserter(text);
  const auto drain = [&](std::size_t limit) {
    if (text.size() < limit) return;
    file.write({text.data(), text.size()});
    text.clear();
  };
  constexpr std::size_t kChunk = std::size_t{1} << 18;
  fmt::format_to(out, "# {} vertices, {} triangles, metres\n", mesh.positions.size(), mesh.triangles.size());
  for (const Vec3& p : mesh.positions) {
    fmt::format_to(out, "v {:.17g} {:.17g} {:.17g}\n", p.x, p.y, p.z);
    drain(kChunk);
  }
  std::vector<std::array<std::int32_t, 3>> texture_corners(mesh.texture.size());
  if (mesh.has_texture()) {
    FirstSeen<1> seen(mesh.positions.size());
    for (std::size_t t = 0; t < mesh.texture.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec2f uv = mesh.texture.raw()[t][i];
        const std::uint64_t key =
            (std::uint64_t{std::bit_cast<std::uint32_t>(uv.x)} << 32) | std::bit_cast<std::uint32_t>(uv.y);
        const std::size_t known = seen.keys().size();
        texture_corners[t][i] = seen.number({key});
        if (seen.keys().size() == known) continue;
        fmt::format_to(out, "vt {:.9g} {:.9g}\n", uv.x, uv.y);  // nine digits name every float
        drain(kChunk);
      }
    }
  }
  std::int32_t group = -1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.group.empty() && (t == 0 || mesh.group.raw()[t] != group)) {
      group = mesh.group.raw()[t];
      const std::string name = group_name(group, group_names);
      fmt::format_to(out, "g {}\nusemtl {}\n", name, name);
    }
    const auto& c = mesh.triangles.raw()[t];
    if (texture_corners.empty()) {
      fmt::format_to(out, "f {} {} {}\n", c[0].value + 1, c[1].value + 1, c[2].value + 1);
    } else {
      const auto& k = texture_corners[t];
      fmt::format_to(out, "f {}/{} {}/{} {}/{}\n", c[0].value + 1, k[0] + 1, c[1].value + 1, k[1] + 1, c[2].value + 1,
                     k[2] + 1);
    }
    drain(kChunk);
  }
  drain(0);
}

}  // namespace

Result<TriangleMesh> parse_obj(std::string_view bytes, const std::string& name, std::vector<std::string>* group_names) {
  return ObjReader(bytes, name).read(group_names);
}

Status write_obj(const std::string& path, const TriangleMesh& mesh, const std::vector<std::string>& group_names) {
  KERF_TRY(check_writable(path, mesh));
  ReplacingFile file(path);
  put_obj(file, mesh, group_names);
  return file.commit();
}

bool holds_obj(const std::string& path, const TriangleMesh& mesh, const std::vector<std::string>& group_names) {
  ComparedFile file(path);
  put_obj(file, mesh, group_names);
  return file.is_same();
}

}  // namespace kerf
