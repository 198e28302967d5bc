// What a blade cuts of a mesh while both move from one pose to the next: arcs from end to end (docs/cutting.md, "From tool motion to a cut path"). They follow from
// where each vertex is beside the blade's line before and now. Seen along the blade, which is the origin, a vertex goes straight from `was` to `is`:
//
//        was o---.                   An edge sweeps a loop was - was - is - is. The blade crosses the edge as often as the loop
//           |     '---o is           winds round the origin: -1, 0 or 1 times.
//           |    x     \             A face has the blade in it, before or now, if its corners wind round the origin then.
//        was o---.      \            All loops are made of the same segments, and a segment says one thing: whether it crosses
//                 '------o is        the ray from the origin. So as much goes into a face as comes out of it, however numbers
//                                    are rounded: arcs neither branch nor break off, and moves that follow each other pass
//                                    each point of the material once.
//
// When the blade crosses an edge, and where on it, is a root of a quadratic.
#pragma once

#include <span>
#include <vector>

#include "kerf/cutting/blade_move.h"
#include "kerf/cutting/face_boxes.h"
#include "kerf/cutting/rest_point.h"

namespace kerf {

/// Does a face lie along a blade's edge (a unit vector), by less than this cosine between its normal and the edge?
bool lies_along(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionTriangle face, Vec3 edge,
                double cosine);

/// One end of an arc.
struct ArcEnd {
  enum class Kind {
    kBorder,  ///< a border edge of the mesh
    kWas,     ///< where the edge was
    kIs,      ///< where it is
    kBase,    ///< where the blade's base goes through a face
    kTip,     ///< where its tip does
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

/// A front of a stroke.
struct MovingFront {
  Vec3 rest, position;  ///< metres: at rest, and now
};

/// All arcs of a move, each goes on in time. An arc that begins where a front is, to within `near` metres at rest, begins with that front; of several the
/// one that is nearest now. Ends of the kind kBorder lie on borders. `boxes`: where vertices are now. Cost: what the blade comes near to; all
/// vertices, where they have moved.
std::vector<BladeArc> find_arcs(const CollisionMesh& mesh, const FaceBoxes& boxes, const MovedMaterial& material,
                                const BladeMove& move, std::span<const MovingFront> fronts, double near);

}  // namespace kerf
