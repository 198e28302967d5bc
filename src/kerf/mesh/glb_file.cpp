#include "kerf/mesh/glb_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kLargestFile = 0xffffffffull - 64;  // the header holds the length in 32 bits
constexpr int kGlFloat = 5126;
constexpr int kUint = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementBuffer = 34963;

bool finite(Vec3f p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

std::vector<Vec3f> unit_normals(const GlbFrame& frame) {
  std::vector<Vec3> sums(frame.positions.size());
  if (!frame.normals.empty()) {
    for (std::size_t v = 0; v < sums.size(); ++v) sums[v] = to_double(frame.normals[v]);
  } else {
    for (const GlbPrimitive& primitive : frame.primitives) {
      for (const auto& t : primitive.triangles) {
        const auto at = [&](std::size_t i) { return to_double(frame.positions[static_cast<std::size_t>(t[i])]); };
        const Vec3 n = cross(at(1) - at(0), at(2) - at(0));
        for (const std::int32_t v : t) sums[static_cast<std::size_t>(v)] += n;
      }
    }
  }
  std::vector<Vec3f> normals(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    const double length = norm(sums[v]);
    // The format asks for unit vectors; a vertex without a direction gets any.
    normals[v] = length > 0 && std::isfinite(length) ? to_float((1 / length) * sums[v]) : Vec3f{0, 0, 1};
  }
  return normals;
}

Json vector_json(Vec3f v) { return Json::array({v.x, v.y, v.z}); }

void append_word(std::string& bytes, std::uint32_t word) {
  bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}

}  // namespace

int GlbBuilder::add_material(const GlbMaterial& material) {
  materials_.push_back(material);
  return static_cast<int>(materials_.size()) - 1;
}

std::size_t GlbBuilder::add_view(const void* data, std::size_t size, bool indices) {
  views_.push_back({bytes_.size(), size, indices});
  bytes_.append(static_cast<const char*>(data), size);
  return views_.size() - 1;
}

bool GlbBuilder::same_bytes(std::size_t view, const void* data, std::size_t size) const {
  return views_[view].size == size && std::memcmp(bytes_.data() + views_[view].offset, data, size) == 0;
}

Status GlbBuilder::add_frame(const GlbFrame& frame) {
  const std::size_t number = frame_count_ + 1;
  const std::size_t n = frame.positions.size();
  const auto refuse = [&](const std::string& why) { return bad_input(fmt::format("frame {}: {}", number, why)); };
  if (!std::isfinite(frame.seconds) || (frame_count_ > 0 && static_cast<float>(frame.seconds - first_time_) <=
                                                                static_cast<float>(last_time_ - first_time_))) {
    return refuse(fmt::format("its time {} s is not later than the last frame's, {} s", frame.seconds, last_time_));
  }
  if ((!frame.normals.empty() && frame.normals.size() != n) || (!frame.texture.empty() && frame.texture.size() != n)) {
    return refuse(fmt::format("{} positions, {} normals and {} texture coordinates do not match", n,
                              frame.normals.size(), frame.texture.size()));
  }
  for (std::size_t v = 0; v < n; ++v) {
    if (!finite(frame.positions[v])) return refuse(fmt::format("position {} is not finite", v + 1));
    if (!frame.texture.empty() && (!std::isfinite(frame.texture[v].x) || !std::isfinite(frame.texture[v].y))) {
      return refuse(fmt::format("texture coordinate {} is not finite", v + 1));
    }
  }
  std::uint64_t bytes = n * (sizeof(Vec3f) * 2 + sizeof(Vec2f));
  std::size_t triangle_count = 0;
  for (const GlbPrimitive& primitive : frame.primitives) {
    if (primitive.material < 0 || static_cast<std::size_t>(primitive.material) >= materials_.size()) {
      return refuse(fmt::format("material {} was not added", primitive.material));
    }
    for (const auto& t : primitive.triangles) {
      for (const std::int32_t v : t) {
        if (v < 0 || static_cast<std::size_t>(v) >= n)
          return refuse(fmt::format("a triangle names vertex {} of {}", v, n));
      }
    }
    triangle_count += primitive.triangles.size();
  }
  if (triangle_count == 0) return refuse("no triangles");
  bytes += triangle_count * 12;
  if (bytes_.size() + bytes + 2048 * (states_.size() + 1) > kLargestFile) {
    return refuse("the file would exceed 4 GiB, which .glb can't; write fewer frames");
  }

  const std::vector<Vec3f> normals = unit_normals(frame);
  std::vector<Vec2f> texture(frame.texture.begin(), frame.texture.end());
  for (Vec2f& uv : texture) uv.y = 1 - uv.y;  // glTF counts v downwards

  const State* last = states_.empty() ? nullptr : &states_.back();
  State state;
  state.start = frame_count_ == 0 ? 0 : frame.seconds - first_time_;
  state.vertex_count = n;
  std::vector<const GlbPrimitive*> filled;
  for (const GlbPrimitive& primitive : frame.primitives) {
    if (!primitive.triangles.empty()) filled.push_back(&primitive);
  }
  bool same = last != nullptr && last->vertex_count == n && last->primitives.size() == filled.size();
  for (std::size_t i = 0; i < filled.size(); ++i) {
    const auto& triangles = filled[i]->triangles;
    const bool shared = last != nullptr && i < last->primitives.size() &&
                        same_bytes(last->primitives[i].view, triangles.data(), triangles.size_bytes());
    same = same && shared && last->primitives[i].material == filled[i]->material;
    state.primitives.push_back(
        {filled[i]->material,
         shared ? last->primitives[i].view : add_view(triangles.data(), triangles.size_bytes(), true),
         3 * triangles.size()});
  }
  const auto share_or_add = [&](const State* source, std::size_t State::*view, const void* data, std::size_t size) {
    if (source != nullptr && same_bytes(source->*view, data, size)) return source->*view;
    same = false;
    return add_view(data, size, false);
  };
  state.position_view = share_or_add(last, &State::position_view, frame.positions.data(), frame.positions.size_bytes());
  state.normal_view = share_or_add(last, &State::normal_view, normals.data(), n * sizeof(Vec3f));
  if (!texture.empty()) {
    const std::size_t size = n * sizeof(Vec2f);
    if (last != nullptr && last->texture_view >= 0 &&
        same_bytes(static_cast<std::size_t>(last->texture_view), texture.data(), size)) {
      state.texture_view = last->texture_view;
    } else {
      same = false;
      state.texture_view = static_cast<std::ptrdiff_t>(add_view(texture.data(), size, false));
    }
  } else {
    same = same && last->texture_view < 0;
  }
  state.low = state.high = frame.positions[0];
  for (const Vec3f& p : frame.positions) {
    state.low = {std::min(state.low.x, p.x), std::min(state.low.y, p.y), std::min(state.low.z, p.z)};
    state.high = {std::max(state.high.x, p.x), std::max(state.high.y, p.y), std::max(state.high.z, p.z)};
  }
  if (!same) states_.push_back(std::move(state));
  if (frame_count_ == 0) first_time_ = frame.seconds;
  last_step_ = frame_count_ == 0 ? 0 : frame.seconds - last_time_;
  last_time_ = frame.seconds;
  ++frame_count_;
  return {};
}

Status GlbBuilder::write(const std::string& path) const {
  if (states_.empty()) return bad_input(path + ": no frames were added; add at least one");

  Json accessors = Json::array();
  std::vector<View> views = views_;
  std::string extra;  // key times and scales, behind the frames' data
  const auto add_accessor = [&](std::size_t view, int component, std::size_t count, const char* type) -> Json& {
    accessors.push_back({{"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}});
    return accessors.back();
  };
  // One accessor for every view, made when it is first used.
  std::vector<std::ptrdiff_t> accessor_of(views_.size(), -1);
  const auto accessor = [&](std::size_t view, int component, std::size_t count, const char* type) {
    if (accessor_of[view] < 0) {
      add_accessor(view, component, count, type);
      accessor_of[view] = static_cast<std::ptrdiff_t>(accessors.size()) - 1;
    }
    return accessor_of[view];
  };

  Json materials = Json::array();
  for (const GlbMaterial& m : materials_) {
    const auto unit = [](float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : 0.0f; };
    Json color = Json::array();
    for (const float c : m.base_color) color.push_back(unit(c));
    Json json = {
        {"name", m.name},
        {"pbrMetallicRoughness",
         {{"baseColorFactor", color}, {"metallicFactor", unit(m.metallic)}, {"roughnessFactor", unit(m.roughness)}}}};
    if (m.base_color[3] < 1) json["alphaMode"] = "BLEND";
    if (m.double_sided) json["doubleSided"] = true;
    materials.push_back(std::move(json));
  }

  Json meshes = Json::array();
  Json nodes = Json::array();
  Json children = Json::array();
  nodes.push_back(nullptr);  // the root, filled in below
  Json samplers = Json::array();
  Json channels = Json::array();
  const double end = last_time_ - first_time_ + last_step_;  // the last frame is shown as long as the one before it
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const State& state = states_[i];
    Json attributes;
    attributes["POSITION"] = accessor(state.position_view, kGlFloat, state.vertex_count, "VEC3");
    Json& positions = accessors[static_cast<std::size_t>(accessor_of[state.position_view])];
    positions["min"] = vector_json(state.low);
    positions["max"] = vector_json(state.high);
    attributes["NORMAL"] = accessor(state.normal_view, kGlFloat, state.vertex_count, "VEC3");
    if (state.texture_view >= 0) {
      attributes["TEXCOORD_0"] =
          accessor(static_cast<std::size_t>(state.texture_view), kGlFloat, state.vertex_count, "VEC2");
    }
    Json primitives = Json::array();
    for (const StatePrimitive& p : state.primitives) {
      primitives.push_back({{"attributes", attributes},
                            {"indices", accessor(p.view, kUint, p.count, "SCALAR")},
                            {"material", p.material}});
    }
    meshes.push_back({{"name", fmt::format("state {}", i)}, {"primitives", std::move(primitives)}});
    Json node = {{"name", fmt::format("state {}", i)}, {"mesh", i}};
    if (i > 0) node["scale"] = vector_json({0, 0, 0});  // without the animation, the first state is seen
    nodes.push_back(std::move(node));
    children.push_back(i + 1);
    if (states_.size() == 1) continue;

    std::vector<float> times;
    std::vector<Vec3f> scales;
    const auto key = [&](double seconds, float scale) {
      times.push_back(static_cast<float>(seconds));
      scales.push_back({scale, scale, scale});
    };
    if (i > 0) key(0, 0);
    key(state.start, 1);
    const bool ends = i + 1 < states_.size();
    if (ends) key(states_[i + 1].start, 0);
    if (static_cast<float>(end) > times.back()) key(end, ends ? 0.0f : 1.0f);
    const auto add_keys = [&](const void* data, std::size_t size) {
      views.push_back({bytes_.size() + extra.size(), size, false});
      extra.append(static_cast<const char*>(data), size);
      return views.size() - 1;
    };
    Json& input = add_accessor(add_keys(times.data(), times.size() * sizeof(float)), kGlFloat, times.size(), "SCALAR");
    input["min"] = Json::array({times.front()});
    input["max"] = Json::array({times.back()});
    add_accessor(add_keys(scales.data(), scales.size() * sizeof(Vec3f)), kGlFloat, scales.size(), "VEC3");
    samplers.push_back({{"input", accessors.size() - 2}, {"interpolation", "STEP"}, {"output", accessors.size() - 1}});
    channels.push_back({{"sampler", samplers.size() - 1}, {"target", {{"node", i + 1}, {"path", "scale"}}}});
  }
  // Kerf's z is up, glTF's y: a quarter turn around x.
  nodes[0] = {
      {"name", "body"}, {"rotation", {-0.70710678118654752, 0, 0, 0.70710678118654752}}, {"children", children}};

  Json buffer_views = Json::array();
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (v < views_.size() && accessor_of[v] < 0) continue;
    Json json = {{"buffer", 0}, {"byteOffset", views[v].offset}, {"byteLength", views[v].size}};
    if (v < views_.size()) json["target"] = views[v].indices ? kElementBuffer : kArrayBuffer;
    buffer_views.push_back(std::move(json));
  }
  Json root = {{"asset", {{"version", "2.0"}, {"generator", "Kerf"}}},
               {"scene", 0},
               {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
               {"nodes", std::move(nodes)},
               {"meshes", std::move(meshes)},
               {"materials", std::move(materials)},
               {"accessors", std::move(accessors)},
               {"bufferViews", std::move(buffer_views)},
               {"buffers", Json::array({{{"byteLength", bytes_.size() + extra.size()}}})}};
  if (!channels.empty()) {
    root["animations"] =
        Json::array({{{"name", "run"}, {"samplers", std::move(samplers)}, {"channels", std::move(channels)}}});
  }

  std::string text = root.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.append((4 - text.size() % 4) % 4, ' ');
  const std::uint64_t binary_size = bytes_.size() + extra.size();
  const std::uint64_t size = 12 + 8 + text.size() + 8 + binary_size;
  if (size > kLargestFile)
    return bad_input(path + ": the file would exceed 4 GiB, which .glb can't; write fewer frames");
  ReplacingFile file(path);
  std::string header = "glTF";
  append_word(header, 2);
  append_word(header, static_cast<std::uint32_t>(size));
  append_word(header, static_cast<std::uint32_t>(text.size()));
  header += "JSON";
  file.write(header);
  file.write(text);
  header.clear();
  append_word(header, static_cast<std::uint32_t>(binary_size));
  header += std::string_view("BIN\0", 4);
  file.write(header);
  file.write(bytes_);
  file.write(extra);
  return file.commit();
}

}  // namespace kerf
