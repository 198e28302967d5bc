// Where an arc is cut: its crossings and ends rounded so that nothing short is left over, without touching or missing any border that the arc does not
// (docs/cutting.md, "From tool motion to a cut path").
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "kerf/cutting/beside_border.h"
#include "kerf/cutting/blade_arcs.h"
#include "kerf/cutting/cut_options.h"
#include "kerf/cutting/cut_stop.h"
#include "kerf/cutting/lead_path.h"

namespace kerf {

/// A point of a border near a point of the material, straight over the mesh from it.
struct BorderFoot {
  CollisionHalfEdge border;  ///< none: no border is near
  double fraction = 0;
  [[nodiscard]] bool exists() const { return border.valid(); }
};

/// Looks at the mesh at rest, and changes arcs, never the mesh. Distances in metres.
class PathRounding {
 public:
  PathRounding(const CollisionMesh& mesh, const CutOptions& options, double mean_edge);

  [[nodiscard]] double feature() const { return feature_; }  ///< nothing shorter is cut
  [[nodiscard]] double near() const {
    return near_;
  }  ///< an arc so near to a lip is that lip, an end so near to a border is on it
  [[nodiscard]] double outside() const { return outside_; }  ///< what rounding may put a point outside of its face
  [[nodiscard]] double beside() const { return beside_; }    ///< a border so near to a path runs beside it

  [[nodiscard]] Vec3 rest(CollisionVertex v) const { return mesh_.rest[v]; }
  [[nodiscard]] Vec3 rest(const RestPoint& p) const { return place_of(mesh_, p, mesh_.rest.raw()); }
  [[nodiscard]] Vec3 rest(const CutStop& s) const { return s.place(mesh_); }
  [[nodiscard]] Vec3 rest(const ArcCrossing& c) const {
    return lerp(rest(mesh_.from(c.near)), rest(mesh_.to(c.near)), c.fraction);
  }

  [[nodiscard]] double distance(CollisionHalfEdge h, Vec3 x) const;  ///< of a place from an edge

  /// The stop on a border edge; near an end of it the vertex there.
  [[nodiscard]] CutStop on_border(CollisionHalfEdge border, double fraction) const;
  /// The nearest point of a border within `near` of a point of a face to which the material leads straight.
  [[nodiscard]] BorderFoot nearest_border(CollisionTriangle face, Vec3 x) const;
  /// The same of the lip that a path begins on, whatever other border is nearer.
  [[nodiscard]] BorderFoot own_lip(const CutStop& start, CollisionTriangle face, Vec3 x) const;
  /// Is a border edge one of the next along the border from a stop, which runs within `near` of the segment from - to until there?
  [[nodiscard]] bool same_lip(const CutStop& stop, CollisionHalfEdge border, Vec3 from, Vec3 to) const;

  /// The end of an arc inside a face, `near` a border, is on it. `start`: the lip on which its path begins does not count; or null. Nor do borders that run
  /// `beside` it. `in_slit`: nor does the border around the mouth of its slit, as nothing has passed between.
  void join_end(BladeArc& arc, const CutStop* start, const BesideBorder& beside, bool in_slit = false) const;
  /// The same for where it begins, with no lip left out.
  void join_begin(BladeArc& arc) const;
  /// The arc begins elsewhere: led from there to `x` in its first face. False: no way leads there.
  bool lead(BladeArc& arc, const CutStop& from, Vec3 x) const;
  /// Is a stop `near` a place? On a border it may be rounded to a vertex that is not.
  [[nodiscard]] bool is_near(const CutStop& stop, Vec3 x) const { return norm(rest(stop) - x) < near_; }
  /// Takes out what leads over an edge and back again.
  static void reduce(BladeArc& arc);
  struct Slid {
    bool all = false;
    Vec3 left;  ///< where the arc, not its lip, is when it leaves; its end if it does not
  };
  /// Takes off the beginning of an arc that runs `near` the lip which it begins on; it begins where it leaves it, if it does so before `last`, on the border
  /// `end` or inside.
  Slid slide(BladeArc& arc, CutStop& begin, Vec3 last, const CutStop& end) const;
  /// A stab less than a feature from the first edge that the arc crosses is on that edge, where the arc crosses it if that is as near; on an end of it only if
  /// that is.
  void begin_on_edge(BladeArc& arc, CutStop& begin) const;
  /// Takes off what an arc crosses last, less than a feature before the blade, its `goal`, at vertices of a border: the path may be about to end there. The
  /// goal is the first of these crossings.
  void hold_at_border(BladeArc& arc, RestPoint& goal) const;
  /// Metres by which a vertex that a path from a stop makes inside a face is moved aside, onto an edge or a corner.
  [[nodiscard]] double moved_aside(const RestPoint& p, const CutStop& start) const {
    return near_in_face(mesh_, p, feature_, start.vertex).distance;
  }
  /// The path of an arc: its beginning and end, if they exist, and where its crossings go. They go onto an end of their edge, if that is inside the material
  /// and nearer than a feature, or if the next edge there is crossed so near that a feature would be left over; else away from both ends. What is crossed at
  /// the vertex that the path begins or ends at is left out. They go to no vertex of a border that runs `beside` the path. What crosses a short edge goes onto an end of it, whatever that is.
  std::vector<CutStop> stops_of(const CutStop& begin, const BladeArc& arc, const CutStop& end,
                                const BesideBorder& beside = kNone) const;

 private:
  /// A path may go through an inner vertex, and through the tip or a corner of a slit.
  [[nodiscard]] bool may_pass(CollisionVertex v) const;
  [[nodiscard]] double length(CollisionHalfEdge h) const { return norm(rest(mesh_.to(h)) - rest(mesh_.from(h))); }
  [[nodiscard]] double foot(CollisionHalfEdge h, Vec3 x) const;
  [[nodiscard]] double snap(CollisionHalfEdge h) const;
  /// Too short to be divided: a path that crosses it goes through one of its ends, though that be on a border.
  [[nodiscard]] bool is_short(CollisionHalfEdge h) const { return length(h) < short_; }
  /// The end of a short edge that a crossing goes through, of those that are free: one that a path may pass, else the nearer one.
  template <class Fn>
  [[nodiscard]] CollisionVertex end_of_short(const ArcCrossing& c, Fn&& is_free) const;
  /// The end of its edge that a crossing is nearer to, and how far it is from there.
  [[nodiscard]] CollisionVertex near_end(const ArcCrossing& c) const {
    return c.fraction < 0.5 ? mesh_.from(c.near) : mesh_.to(c.near);
  }
  [[nodiscard]] double off_end(const ArcCrossing& c) const {
    return std::min(c.fraction, 1 - c.fraction) * length(c.near);
  }
  /// Where a crossing goes that is rounded to no vertex: at least a feature away from both ends of its edge.
  [[nodiscard]] CutStop on_edge(const ArcCrossing& c) const;
  /// The vertex that a crossing is rounded to, or none. `from`: where the arc begins.
  [[nodiscard]] CollisionVertex vertex_of_crossing(const BladeArc& arc, std::size_t i, Vec3 from,
                                                   const BesideBorder& beside = kNone) const;
  [[nodiscard]] double material_around(CollisionVertex v) const;
  [[nodiscard]] PathPlace path_place(const CutStop& s) const;
  /// Calls fn with the border edges next to a stop, both ways along the border for as long as it runs `near` the segment from - to.
  template <class Fn>
  void for_each_of_lip(const CutStop& stop, Vec3 from, Vec3 to, Fn&& fn) const;
  /// These edges, and those `around` metres along the border on both sides of `to`.
  [[nodiscard]] std::vector<CollisionHalfEdge> lip_edges(const CutStop& start, Vec3 to, double around) const;
  /// `counts`: of a border edge and a fraction of it.
  template <class Counts>
  [[nodiscard]] BorderFoot border_within(CollisionTriangle face, Vec3 x, Counts&& counts) const;
  void join(ArcEnd& end, BladeArc& arc, bool last, const CutStop* start, const BesideBorder& beside,
            bool in_slit) const;

  const CollisionMesh& mesh_;
  double feature_, near_, beside_, short_, outside_, mouth_, fan_;
  static constexpr BesideBorder kNone = BesideBorder::none();
};

}  // namespace kerf
