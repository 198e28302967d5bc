// Where a blade's cut has got to: its place on the mesh without what is provisional, and how the path of an arc begins there.
//
//      start o~~~~~~x end       path: from the start, by the end, along the arc
//     (vertex)  trail \___ arc
//
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "kerf/cutting/beside_border.h"
#include "kerf/cutting/blade_arcs.h"
#include "kerf/cutting/cut_stop.h"
#include "kerf/cutting/path_rounding.h"

namespace kerf {

/// Where a blade has come so near to a border that a cut which ends there is joined to it.
struct BladeTouch {
  RestPoint at;
  Vec3 border;  ///< the point of the border, at rest
  bool needed =
      true;  ///< false: the path has gone back into its own slit since, and is joined to it only where it can be
};

/// Where the cut has got to in one layer, on the mesh without what is provisional: inside a face that its path began in or came into.
struct BladeFront {
  CutStop start;           ///< where its path goes on: its last vertex, or a point of a border that is not yet divided
  CollisionVertex before;  ///< the path's vertex before the last one, or none
  RestPoint end;           ///< where the blade was at the last pose
  Vec3 came;               ///< where the blade was when its path last went on, at rest
  bool in_slit = false;    ///< near the lip that its path begins on: it begins beside the end, maybe some faces away
  std::vector<Vec3>
      trail;  ///< the places of the end since the start, at rest, but for those too near to the one before
  std::optional<BladeTouch> touch;  ///< the nearest since the start
  BesideBorder beside{};            ///< of the path, up to the end
  bool along = false;               ///< its path has come through a sheet that lies along the blade
};

/// Finds fronts again on a mesh that the move at work has cut. It looks at the mesh at rest.
class FrontFinder {
 public:
  /// Before the move cuts anything.
  FrontFinder(const CellComplex& complex, const PathRounding& rounding);

  /// Sets a front's face. False: it is not found.
  [[nodiscard]] bool locate(BladeFront& f) const;
  /// The same for a point; it is looked for around a vertex first, if there is one.
  [[nodiscard]] bool locate(RestPoint& p, CollisionVertex around) const;
  /// Puts the end of a front at a place of its trail. False: it is not found there, and stays.
  [[nodiscard]] bool move_to(BladeFront& f, Vec3 place) const;
  /// The last place of a front's trail where a vertex of its path is moved aside least, and by less than `aside` metres, which becomes that; or its end. A
  /// path that goes on from there to `to` leaves what lies between by `tolerance` at most.
  [[nodiscard]] std::vector<Vec3>::const_iterator least_moved(const BladeFront& f, Vec3 to, double tolerance,
                                                              double& aside) const;
  /// A path that has run into a border has left two vertices there, one of them made since there were `vertices`: the one from which a point can be reached.
  [[nodiscard]] CollisionVertex twin_towards(CollisionVertex v, std::size_t vertices, const RestPoint& point) const;
  /// The path of a front begins at its start, and leads by its end: the arc may begin in another face (by rounding, or as the material has moved). False: the
  /// arc can't be led there, and is what it was.
  [[nodiscard]] bool begin_at(BladeArc& arc, const BladeFront& f) const;
  /// Does a path from a stop lead into a face?
  [[nodiscard]] bool begins_in(const CutStop& s, CollisionTriangle face) const;
  /// What an arc comes to first, at rest.
  [[nodiscard]] Vec3 next_of(const BladeArc& arc) const;
  /// Notes where a front is now. Near the lip that it began on, its path begins where it is.
  void note(BladeFront& f) const;

 private:
  const CollisionMesh& mesh_;
  const PathRounding& rounding_;
  double trail_step_;         // metres: the next place of a trail is farther off
  std::size_t faces_before_;  // the move
};

}  // namespace kerf
