// Moving a collision vertex within the surface of a closed body, with everything that hangs on it (past the paper's 5.3).
//
// The triangles around the vertex change their shape and nothing else changes: no triangle is split, and the skin stays the
// surface that it was, but for visual edges that are turned where visual triangles get thin. Every visual vertex that these triangles own moves along with the vertex by its hat function, in the
// planes of the root triangles, and takes the place, normal and texture that the skin had there. So what a visual vertex is bound
// to, and with which weights, stays as it is, and the cut surface goes to where the lips are now.
//
// A move may lead across the edges of root triangles: their planes are unfolded around the vertex, and the skin is looked up beyond
// the edge.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/wall_points.h"
#include "kerf/geodesic/sparse_index.h"

namespace kerf::cut {

/// Where a vertex is to go: a point in the plane of one of the triangles around it, in that triangle.
struct SlideTarget {
  CollisionHalfEdge corner;  ///< of the vertex, in that triangle; none: nowhere
  Vec2 to;
  double along_rim = 0;  ///< of a vertex on the rim: metres along the rim, > 0 along its outgoing edge
};

/// What a slide must not do.
struct SlideRules {
  bool only_less = false;  ///< the collision mesh has to lose area
  double strip = 0;        ///< metres: no nearer than this to an opposite edge between two border vertices
};

/// What slides did, summed up.
struct SlideBooks {
  double removed = 0;                             ///< m^3: by how much the enclosed volume fell
  double skin_area = 0;                           ///< m^2: change of the skin's area
  double collision_area = 0;                      ///< m^2: change of the collision mesh's area in its root planes
  std::vector<std::pair<RootId, double>> prisms;  ///< m^3: changes of the prisms' volumes, by root
  std::vector<VisualVertex> vertices;             ///< visual vertices that moved, each once
  int turned = 0;                                 ///< visual edges; slides that come to nothing leave them turned
  SparseIndex moved;                              ///< the same, to be looked up
};

/// The angle of material around a border vertex, or all around an inner one (radians, in the root planes).
double fan_angle(const CollisionMesh& mesh, CollisionVertex v);
/// The point at `distance` from v (metres) in the direction `angle` counter-clockwise from its first edge (fan_start).
SlideTarget point_in_fan(const CollisionMesh& mesh, CollisionVertex v, double angle, double distance);
/// The point at `distance` from v along the rim edge that leaves v, or, if it is negative, that comes to v.
SlideTarget point_on_rim(const CollisionMesh& mesh, CollisionVertex v, double distance);
/// The border edges that leave a border vertex and come to it.
struct BorderEdges {
  CollisionHalfEdge out, in;
};
BorderEdges border_edges(const CollisionMesh& mesh, CollisionVertex v);
/// Is the border edge one of the rim's: without a wall?
inline bool is_rim_edge(const CollisionMesh& mesh, CollisionHalfEdge h) {
  return mesh.is_border(h) && !mesh.wall[h].valid();
}

class VertexSlider {
 public:
  VertexSlider(CellComplex& body, CutScratch& scratch)
      : body_(body), coarse_(body.collision), mesh_(body.visual), shift_of_(scratch.slid_vertex),
        face_seen_(scratch.slid_face) {}

  /// Moves v. A vertex on the rim goes along a rim edge only. False, and nothing done but visual edges turned, if a triangle of either mesh would turn over
  /// or get too small, or if the rules forbid it. Journaled. Cost: what the triangles around own.
  bool slide(CollisionVertex v, const SlideTarget& target, const SlideRules& rules, SlideBooks& books);

  /// Calls f(corner of v, from, to) for the triangles around v, with the slide's ends in their planes.
  template <class Fn>
  void for_each_face(CollisionVertex v, const SlideTarget& target, Fn&& f) {
    if (!target.corner.valid() || !chart(v, target)) return;
    for (const CollisionHalfEdge h : fan_) {
      const Corner& c = *corner_of(coarse_.root[CollisionMesh::face(h)]);
      f(h, c.from, c.to);
    }
  }

  struct Move {
    VisualVertex vertex;
    Vec3 rest;
  };
  /// Writes new places of visual vertices and books what that does to volume and skin.
  void apply(const std::vector<Move>& moves, SlideBooks& books);

 private:
  struct Corner {
    RootId root;
    Vec2 from, to;
  };  // of the moving vertex, in one plane
  struct ShiftPlane {
    Patch patch;
    Vec2 planar;
    Vec2f texture;
    bool seam;
  };
  struct Shift {
    VisualVertex vertex;
    std::size_t first = 0;  // in planes_
    int planes = 0;
    Vec3 rest;
    Vec3f normal;
  };
  [[nodiscard]] double side_strip(CollisionVertex v) const;
  struct RimPoint {
    double s;
    VisualVertex vertex;
  };
  struct Place;

  bool chart(CollisionVertex v, const SlideTarget& target);
  bool collision_faces_stay_sound(const SlideRules& rules);
  bool collect_shifts(CollisionVertex v, const SlideTarget& target);
  void collect_rim(CollisionVertex v);
  enum class Of {
    kEnd,
    kChain,
    kRim,
    kInside
  };  // what owns a visual vertex: the moving vertex, an edge, a rim edge, a triangle
  bool add_shift(VisualVertex x, double hat, Of owner, double s);
  [[nodiscard]] bool is_inside_owner(Vec2 u) const;
  [[nodiscard]] bool is_crease(VisualHalfEdge h) const;
  bool shift_along_crease(VisualVertex x, Shift& shift);
  [[nodiscard]] VisualVertex next_on_crease(VisualVertex x, Vec3 way) const;
  Place find_place(VisualHalfEdge h, Vec2 u) const;
  bool nothing_turns_over(SlideBooks& books);
  VisualHalfEdge turn_longest_edge(VisualTriangle f, SlideBooks& books);
  void faces_around(VisualVertex v, bool walls_too);
  void book_faces(Vec3 origin, double sign, SlideBooks& books) const;
  [[nodiscard]] Vec2 planar_after(VisualHalfEdge h) const;
  void write_shifts(SlideBooks& books);
  void move_collision_vertex(CollisionVertex v, const SlideTarget& target);
  [[nodiscard]] double prism_volume(CollisionTriangle f) const;
  [[nodiscard]] const Corner* corner_of(RootId root) const;

  CellComplex& body_;
  CollisionMesh& coarse_;
  VisualMesh& mesh_;
  std::vector<CollisionHalfEdge> fan_;
  std::vector<Corner> corners_;
  std::vector<Shift> shifts_;
  std::vector<ShiftPlane> planes_;
  std::vector<RimPoint> rim_;
  std::array<Vec2, 3> owner_;  // of a vertex inside a triangle: that triangle as it will be
  double along_rim_ = 0;
  bool keep_creases_ = true, any_crease_ = false;
  double area_ = 0;
  DenseIndex& shift_of_;  // number in shifts_, by vertex
  DenseIndex& face_seen_;
  std::vector<VisualTriangle> faces_, todo_;
  std::vector<Move> moves_;
  std::vector<WallId> walls_;
  std::vector<WallPoint> points_;
  std::vector<std::pair<WallPoint, Vec3>> strays_;
};

/// Walls on both sides of a border vertex.
void walls_at(const CollisionMesh& mesh, CollisionVertex v, std::vector<WallId>& walls);

}  // namespace kerf::cut
