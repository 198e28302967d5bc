// Animated binary glTF 2.0 of a surface whose topology changes over time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"

namespace kerf {

struct GlbMaterial {
  std::string name;
  std::array<float, 4> base_color{0.8f, 0.8f, 0.8f, 1.0f};  ///< linear red, green, blue, and opacity; 0 to 1
  float metallic = 0;
  float roughness = 0.8f;
  bool double_sided = false;
};

/// Triangles of one material over the vertices of a frame, counter-clockwise from outside.
struct GlbPrimitive {
  int material = 0;
  std::span<const std::array<std::int32_t, 3>> triangles;
};

/// One state of the surface. Everything is copied; the spans need not outlive add_frame.
struct GlbFrame {
  double seconds = 0;
  std::span<const Vec3f> positions;          ///< |V| x 3, metres, z up
  std::span<const Vec3f> normals;            ///< |V| x 3, any length; empty: computed, weighted by area
  std::span<const Vec2f> texture;            ///< |V| x 2, v up as in OBJ; empty: none
  std::span<const GlbPrimitive> primitives;  ///< the skin and the cut walls, say; empty ones are left out
};

/// Collects frames and writes them. Every frame becomes a mesh and a node, which is visible (its scale is 1,
/// else 0) from its time to that of the next one; frames of one topology share indices and texture
/// coordinates, and a frame equal to the one before costs nothing. (Morph targets would need all frames of a
/// topology on the GPU at once.) Memory: 24 bytes a vertex and frame until the builder is gone; a file ends
/// at 4 GiB, the limit of the format.
class GlbBuilder {
 public:
  /// The number by which primitives name the material.
  int add_material(const GlbMaterial& material);
  /// Adds a frame later than the last one. Refused, with nothing added: times that do not grow (as floats),
  /// missing materials or vertices, positions that are not finite, arrays of the wrong length, no triangles
  /// at all.
  Status add_frame(const GlbFrame& frame);
  [[nodiscard]] std::size_t frame_count() const { return frame_count_; }
  /// Writes what was added so far, replacing the file in one go. Refused without a frame.
  Status write(const std::string& path) const;

 private:
  struct View {  // a range of bytes_ that one accessor reads
    std::size_t offset = 0, size = 0;
    bool indices = false;
  };
  struct StatePrimitive {
    int material = 0;
    std::size_t view = 0, count = 0;
  };
  struct State {
    double start = 0;
    std::size_t vertex_count = 0;
    std::size_t position_view = 0, normal_view = 0;
    std::ptrdiff_t texture_view = -1;
    Vec3f low, high;
    std::vector<StatePrimitive> primitives;
  };

  std::size_t add_view(const void* data, std::size_t size, bool indices);
  [[nodiscard]] bool same_bytes(std::size_t view, const void* data, std::size_t size) const;

  std::vector<GlbMaterial> materials_;
  std::vector<State> states_;
  std::vector<View> views_;
  std::string bytes_;
  std::size_t frame_count_ = 0;
  double first_time_ = 0, last_time_ = 0, last_step_ = 0;
};

}  // namespace kerf
