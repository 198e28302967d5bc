// What fixed regions hold of the material of a cell that their border crosses: such a cell moves with the rest of its material, from the border on.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/lattice/hex_mesh.h"
#include "kerf/mechanics/element.h"
#include "kerf/scene/scene.h"

namespace kerf {

struct TracedCell;

/// Regions that were fixed, and let go, in order: the last that contains a place decides.
struct HeldRegions {
  struct Change {
    SceneRegion region;
    bool held = false;
  };
  std::vector<Change> changes;
  bool cross = false;                                     ///< a border crosses material of the body; else nodes say all
  std::vector<CellId> cells;                              ///< that borders cross, then; ascending
  std::shared_ptr<const std::vector<TracedCell>> traced;  ///< cells near borders, ascending; never changed once made
  /// What the last region says that a place at rest lies in; none does.
  [[nodiscard]] std::optional<bool> says(Vec3 rest) const;
  /// Is the material at a place at rest held?
  [[nodiscard]] bool contains(Vec3 rest) const { return says(rest).value_or(false); }
  /// To be called when `changes` has changed: looks at every cell with material once, so that cuts need not.
  void trace(const HexMesh& hex);
};

enum class HeldPart {
  kNone,
  kSome,  ///< the border crosses the copy's cell
  kAll,
};
/// O(log cells near borders); a few microseconds where a cell near a border was not traced.
HeldPart held_part(const HexMesh& hex, const HeldRegions& held, HexId copy);

/// The material of a copy of a cell of which some is held.
struct HeldMaterial {
  std::vector<MaterialPoint> free;  ///< what may deform
  /// Where it is held: held places on the border, volume: share of a full cell's cross-section; or, of a copy that the border does not divide and that is held, all of it,
  /// volume: share of the cell.
  std::vector<MaterialPoint> held;
};
/// In natural coordinates of its cell. A copy that the border does not divide, cut off on one side of it, is held or free as its middle is.
HeldMaterial held_material(const HexMesh& hex, const HeldRegions& held, HexId copy);

/// Where a place of a cell, in natural coordinates, is at rest.
Vec3 rest_place(const HexMesh& hex, LatticeIndex cell, Vec3 xi);

/// One of the fewest springs that hold a cell's corners as all points of a border do.
struct BorderRow {
  std::array<double, 8> weights{};  ///< of the corners; their sum is not 1
};
/// At most four where the border is a plane across an axis, else at most eight. Each point is (weights of the corners, share).
std::vector<BorderRow> border_rows(const std::vector<std::pair<std::array<double, 8>, double>>& points);

}  // namespace kerf
