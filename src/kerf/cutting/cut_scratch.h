// Memory that cutting reuses between calls, and what it notes about births of collision vertices.
#pragma once

#include <array>
#include <vector>

#include "kerf/base/dense_index.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/wall_room.h"

namespace kerf {

/// Where a new collision vertex came from: rest = sum of weight[i] x rest of parent[i]; unused parents are none. A
/// vertex that was split off has one parent (its twin) of weight 1.
struct VertexBirth {
  CollisionVertex vertex;
  std::array<CollisionVertex, 3> parent;
  std::array<double, 3> weight{};
};

/// One per thread of cutting; contents are private but for `births`.
struct CutScratch {
  std::vector<VertexBirth> births;  ///< by rising vertex; those of vertices that were rolled back are dropped lazily

  double wall_seconds = 0;  ///< time spent on walls; the caller sets it back

  std::vector<VisualVertex> path, curve_path;
  std::vector<CollisionTriangle> beside;      // a curve
  double beside_reach = 0;                    // of its chord, metres
  std::vector<Vec2> curve, curve_all, drawn;  // along the chord, to its left
  struct MovedParameter {
    VisualVertex vertex;
    Vec2 to;
    CollisionTriangle face;
  };  // of a free vertex: the face it was in
  std::vector<MovedParameter> moved_parameter;
  struct LaidFace {
    VisualHalfEdge corner;
    double area;
  };
  std::vector<LaidFace> laid_face;
  std::array<std::vector<VisualVertex>, 2> chain, chain_right;
  std::array<std::vector<double>, 2> parameter;
  std::array<std::vector<VisualHalfEdge>, 2> left, right;  // along the chains: on the side of h and of its twin
  std::array<std::vector<VisualHalfEdge>, 2> down, up;     // along the opened lines at the start and the end
  std::array<std::vector<VisualVertex>, 2> line, line_right;
  struct ColumnVertex {
    VisualVertex vertex;
    double y;
    float depth;
  };
  std::vector<ColumnVertex> column, next_column;
  std::vector<VisualVertex> wall_inner;
  std::array<std::vector<VisualHalfEdge>, 2> wall_down, wall_up;
  std::vector<VisualHalfEdge> pending;
  std::vector<VisualTriangle> faces;
  std::array<std::vector<VisualVertex>, 3> part;
  std::vector<CollisionHalfEdge> flip_stack;
  std::vector<Vec3> displacement;
  std::vector<Vec3f> bow;              // of the columns of a new wall
  std::vector<BorderSegment> borders;  // near a new rough wall
  std::vector<double> bow_along, bow_across;
  std::vector<Vec3> bow_middle, bow_skin;
  DenseIndex slid_vertex, slid_face;
  DenseIndex crumb_seen;
  std::vector<CollisionTriangle> crumb_faces;
  std::vector<VisualTriangle> crumb_skin;

  /// Births of vertices from `first` on.
  void note_birth(const VertexBirth& birth) {
    while (!births.empty() && births.back().vertex >= birth.vertex) births.pop_back();
    births.push_back(birth);
  }
};

}  // namespace kerf
