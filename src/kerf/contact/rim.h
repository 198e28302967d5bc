// What is known of a body's rims (edges made by cuts) in one call of detection: found as it is asked for, each thing once.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/base/vec.h"

namespace kerf {

/// One smooth piece of rim at a vertex. Where a rim turns sharply (two cuts cross) the vertex has two.
struct RimEnd {
  Vec3 conormal;              ///< unit, out of the material
  std::array<Vec3, 2> along;  ///< along the rim's edges, away from the vertex; zero: none
};
struct RimVertex {
  std::array<RimEnd, 2> end;
  int count = 0;  ///< 0: no rim, or the tip of a cut
};
/// An edge made by a cut.
struct RimEdge {
  Vec3 conormal;           ///< unit, out of the material
  std::array<Vec3, 2> at;  ///< at its ends: smooth rims share it
  bool ends_known = false;
};

/// Memory of one body. References that it hands out are good until it is asked about something new.
struct RimMemory {
  static constexpr std::int32_t kUnknown = -1;
  std::vector<std::int32_t> vertex, edge;  ///< by id: numbers in the lists
  std::vector<RimVertex> vertices;
  std::vector<RimEdge> edges;

  void clear(std::size_t vertex_count, std::size_t half_edge_count) {
    vertex.assign(vertex_count, kUnknown);
    edge.assign(half_edge_count, kUnknown);
    vertices.clear();
    edges.clear();
  }
};

}  // namespace kerf
