// Cutting along stops: vertices made where they are wanted, and what lies between them opened.
#pragma once

#include <span>
#include <vector>

#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/cut_stop.h"
#include "kerf/cutting/face_boxes.h"
#include "kerf/cutting/uncut_path.h"

namespace kerf {

/// What paths are cut in. `position`: of all collision vertices, metres; those of new vertices are appended, here and to `others`. `boxes`: there; faces
/// that are cut are marked.
struct PathGround {
  cut::CutContext& cut;
  std::vector<Vec3>& position;
  FaceBoxes& boxes;
  std::span<std::vector<Vec3>* const> others{};  ///< of the same vertices at other times
};

class PathOpening {
 public:
  /// `feature`, `outside`: metres, as in PathRounding.
  PathOpening(PathGround ground, double feature, double outside)
      : ground_(ground), feature_(feature), outside_(outside) {}

  /// Makes the vertices of a path, whose neighbours share a face each, and opens what lies between, but for edges that hold a crumb (crumb.h). `closed`: the last stop is
  /// the first. False: refused as degenerate, and nothing is changed. `made()`: the vertices. `drawn`: where the blade was, in order, at rest.
  bool open(std::span<const CutStop> stops, std::span<const Vec3> drawn, bool closed = false);
  /// The same for what need not be cut: a refusal is not counted.
  bool open_if_possible(std::span<const CutStop> stops, std::span<const Vec3> drawn);
  [[nodiscard]] const std::vector<CollisionVertex>& made() const { return made_; }
  /// The last path was not made, as only crumbs would have come off.
  [[nodiscard]] bool only_crumbs() const { return only_crumbs_; }
  /// Turns edges where paths have been cut (Delaunay), but not those of the faces `keep`.
  void turn_edges(std::span<const CollisionTriangle> keep);

  /// Has a path divided this face?
  [[nodiscard]] bool divided(CollisionTriangle f) const;
  void forget_divided() { divided_.clear(); }
  [[nodiscard]] int opened() const { return opened_; }             ///< edges
  [[nodiscard]] int refused() const { return refused_; }           ///< paths
  [[nodiscard]] const UncutPath& uncut() const { return uncut_; }  ///< the first path that was refused
  [[nodiscard]] int retried() const { return retried_; }  ///< vertices made a minimum feature or two beside their place

 private:
  CollisionMesh& mesh() const { return ground_.cut.body.collision; }
  UncutPath attempt(std::span<const CutStop> stops, std::span<const Vec3> drawn, bool closed);
  UncutReason open_made();
  UncutReason unlink_all();
  [[nodiscard]] double made_length() const;  // metres
  CollisionVertex make(const CutStop& s, CollisionVertex before);
  CollisionVertex make_inside(RestPoint p, CollisionVertex before);
  /// The fraction of an edge nearest to this one at which a vertex is far enough from both ends and both apexes; if there is none, this one.
  [[nodiscard]] double far_enough(CollisionHalfEdge h, double fraction) const;
  CollisionVertex make_on_edge(const CutStop& s);
  CollisionVertex split(CollisionHalfEdge h, double fraction);
  [[nodiscard]] double length(CollisionHalfEdge h) const {
    return norm(mesh().rest[mesh().to(h)] - mesh().rest[mesh().from(h)]);
  }
  void begin();
  void end();

  PathGround ground_;
  double feature_, outside_;
  std::vector<CollisionVertex> made_;
  struct Division {
    CollisionVertex a, b;
    double fraction;
    CollisionVertex vertex;
  };
  std::vector<Division> divisions_;  // of edges, by the path's stops
  std::vector<CollisionHalfEdge> edges_, twins_;
  std::vector<CollisionTriangle> divided_;
  bool only_crumbs_ = false;
  int opened_ = 0, refused_ = 0, retried_ = 0;
  UncutPath uncut_;
  JournalMark mark_;
  Journaled<CollisionHalfEdge, CollisionVertex>::Mark origin_mark_;
};

}  // namespace kerf
