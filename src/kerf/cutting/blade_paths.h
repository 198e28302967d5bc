// What a blade cuts becomes paths on the mesh: each arc of a move (blade_arcs.h) is rounded (path_rounding.h) and opened (path_opening.h). A path that ends
// where the blade is leaves a front there (blade_front.h), and an arc of the next move goes on from it.
#pragma once

#include <span>
#include <vector>

#include "kerf/cutting/blade_arcs.h"
#include "kerf/cutting/blade_front.h"
#include "kerf/cutting/blade_sweep.h"
#include "kerf/cutting/path_opening.h"
#include "kerf/cutting/path_rounding.h"

namespace kerf {

/// How far the path of a front has been cut.
struct PathEnd {
  CollisionVertex vertex, before;
  bool made = false;       ///< something was cut; else the front's start, or a vertex beside it
  bool on_border = false;  ///< not its own lip
};

/// The paths of one move.
class BladePaths {
 public:
  /// `others`: where vertices are at other times.
  BladePaths(BladeStroke& stroke, SweepTarget& target, std::span<std::vector<Vec3>* const> others);

  /// Takes the fronts off the stroke; paths that end at the blade leave new ones there. What is cut is not provisional until `finish`.
  void start();
  void finish() { leads_ = false; }
  /// Cuts an arc. `along`: it, or its front, has come through a sheet that lies along the blade.
  void cut(BladeArc& arc, bool along);
  /// Cuts up to where a front's blade is, or to a border near it. `needed`: what can't be cut is a refusal.
  PathEnd make_end(const BladeFront& f, bool needed = true);

  /// At the last pose.
  [[nodiscard]] std::vector<BladeFront>& fronts() { return old_; }
  /// Has an arc begun or ended at that front?
  [[nodiscard]] bool is_used(std::size_t front) const { return used_[front] != 0; }
  [[nodiscard]] CutStop stop_of(const ArcEnd& e) const;
  [[nodiscard]] bool has_cut() const { return dirty_; }
  [[nodiscard]] const PathRounding& rounding() const { return rounding_; }
  [[nodiscard]] const FrontFinder& finder() const { return finder_; }
  [[nodiscard]] PathOpening& opening() { return opening_; }

 private:
  [[nodiscard]] const CollisionMesh& mesh() const { return target_.complex.collision; }
  void cut_loop(const BladeArc& arc);
  /// The edge comes down on its length: two fronts.
  void cut_to_both_sides(const BladeArc& arc);
  /// The parts of a path that holds a crumb, from one border to the next: those without a crumb part the body.
  /// A stab whose vertex would be moved aside begins farther along its path, by less than a feature.
  void begin_with_room(CutStop& begin) const;
  void part_by_parts(std::span<const CutStop> stops);
  /// A path that comes back to the chained edge which it begins on goes by the place of its trail farthest from there: that chain can't be drawn elsewhere.
  void go_round_edge(std::vector<CutStop>& stops, CollisionTriangle face, const std::vector<Vec3>& trail) const;
  [[nodiscard]] bool comes_back(const CutStop& first, const CutStop& next, CollisionTriangle face) const;
  bool open(std::span<const CutStop> stops, std::span<const Vec3> drawn, bool closed = false, bool needed = true);
  [[nodiscard]] CollisionVertex before_last() const;
  /// The front that an arc begins at, the arc led to where its path begins; or null, if none leads there: the arc lies on the other lip of the slit that the
  /// front waits in, and begins where the edge was.
  const BladeFront* take(BladeArc& arc, ArcEnd& begin);
  /// Has the stroke come back to where it began? Then that is where it ends, whatever runs beside it.
  [[nodiscard]] bool closes(const BladeFront& f) const;

  BladeStroke& stroke_;
  SweepTarget& target_;
  cut::CutContext cut_;
  PathRounding rounding_;
  FrontFinder finder_;
  PathOpening opening_;
  bool dirty_ = false;
  bool leads_ = false;           // what is opened is not provisional
  bool along_ = false;           // of the arc or the front at work
  std::vector<BladeFront> old_;  // at the last pose
  std::vector<char> used_;       // of old_
  std::vector<Vec3> drawn_;      // of one arc
};

}  // namespace kerf
