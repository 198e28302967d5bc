// Where the strip that a blade sweeps in one move meets the deformed collision mesh: arcs from end to end (docs/cutting.md, "From tool
// motion to a cut path"). Which faces an arc passes and which edges it crosses follows from the vertices' sides of one plane alone, so arcs
// neither branch nor break off; numbers only say where on an edge it crosses.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kerf/cutting/blade_edge.h"
#include "kerf/cutting/face_boxes.h"
#include "kerf/cutting/rest_point.h"

namespace kerf {

/// The plane of one move, and what the edge passes in it. Coordinates in the plane: x along the edge's new place, y with its motion.
struct Strip {
  Vec3 origin, along, motion, normal;
  double length = 0;             ///< of the edge at its new place, which is y = 0, from x = 0 on
  Vec2 base, tip;                ///< of the edge at its last place
  double offset = 0, slope = 0;  ///< the line of that place: y = offset + slope x
  std::vector<std::array<Vec2, 2>>
      done;  ///< boxes where the stroke has cut a sheet that lies along the edge; of such sheets nothing there is passed again
  bool stands = false;  ///< it has not moved across itself: `motion` is any way

  /// `fronts`: where the cut has got to; the last place is moved to where they are, as the material has carried it. `least`: metres, a move that is
  /// shorter counts as that long.
  static Strip make(const BladeEdge& from, const BladeEdge& to, std::span<const Vec3> fronts, double least);

  /// The last place is so many metres farther back.
  void set_back(double distance) {
    offset -= distance;
    base.y -= distance;
    tip.y -= distance;
  }

  [[nodiscard]] double height(Vec3 p) const { return dot(p - origin, normal); }
  [[nodiscard]] Vec2 local(Vec3 p) const { return {dot(p - origin, along), dot(p - origin, motion)}; }
  /// How far a point is ahead of the edge's last place, and of its new one.
  [[nodiscard]] double ahead_of_last(Vec2 q) const { return q.y - offset - slope * q.x; }
  [[nodiscard]] double time(Vec2 q) const;  ///< 0 .. 1 of the move, when the edge's line passes
  [[nodiscard]] bool passed(Vec2 q) const;
  /// Four lines that bound what is passed, zero on them: last place, new place, track of the base, of the tip.
  [[nodiscard]] double side(int line, Vec2 q) const;
};

/// Does a face lie along a blade's edge (a unit vector), by less than this cosine between its normal and the edge?
bool lies_along(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionTriangle face, Vec3 edge,
                double cosine);

/// One end of an arc.
struct ArcEnd {
  enum class Kind {
    kBorder,  ///< a border edge of the mesh
    kWas,     ///< the edge's last place
    kIs,      ///< its new place
    kBase,    ///< the track of the blade's base
    kTip,     ///< of its tip
    kFront,   ///< a front of the stroke
  };
  Kind kind = Kind::kBorder;
  CollisionHalfEdge border;  ///< kBorder: which
  double fraction = 0;       ///< along it
  FacePoint point;           ///< else
  double time = 0, depth = 0;
  int front = -1;
};

/// An inner edge that an arc crosses, seen from the face before it and the one behind; at `fraction` of `near`.
struct ArcCrossing {
  CollisionHalfEdge near, far;
  double fraction = 0;
};

/// Through faces[0], crossings[0], faces[1], ..
struct BladeArc {
  ArcEnd begin, end;
  std::vector<CollisionTriangle> faces;
  std::vector<ArcCrossing>
      crossings;  ///< one less than faces; of a closed arc as many, the last leads back into faces[0]
  bool closed = false;
  double first = 1;  ///< 0 .. 1 of the move, when the edge comes to it
  void reverse();
};

/// A front as the search sees it: a face, where in space, and on what way its path came there at rest (zero: not known).
struct ArcFront {
  CollisionTriangle face;
  Vec3 position, way;
};

/// All arcs of a move. What lies ahead of a front is an arc that begins (or ends) there; if the strip misses a front's face by rounding, its arc begins in a
/// face within `near` metres. `ahead_only`: nothing else than what lies ahead of the fronts, and the boxes are not asked. Cost: what the strip comes near.
std::vector<BladeArc> find_arcs(const CollisionMesh& mesh, std::span<const Vec3> position, const FaceBoxes& boxes,
                                const Strip& strip, std::span<const ArcFront> fronts, double near,
                                bool ahead_only = false);

}  // namespace kerf
