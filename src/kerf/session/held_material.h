// What fixed regions hold of the material of a cell that their border crosses: such a cell moves with the rest of its material, from the border on.
#pragma once

#include <array>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/lattice/hex_mesh.h"
#include "kerf/mechanics/element.h"
#include "kerf/scene/scene.h"

namespace kerf {

/// Regions that were fixed, and let go, in order: the last that contains a place decides.
struct HeldRegions {
  struct Change {
    SceneRegion region;
    bool held = false;
  };
  std::vector<Change> changes;
  bool cross = false;         ///< a border crosses material of the body; else nodes say all
  std::vector<CellId> cells;  ///< that borders cross, then; ascending
  /// Is the material at a place at rest held?
  [[nodiscard]] bool contains(Vec3 rest) const;
};

enum class HeldPart {
  kNone,
  kSome,  ///< the border crosses the copy's cell
  kAll,
};
/// O(1) but for cells near a border, which take a few microseconds.
HeldPart held_part(const HexMesh& hex, const HeldRegions& held, HexId copy);

/// The material of a copy of a cell of which some is held.
struct HeldMaterial {
  std::vector<MaterialPoint> free;    ///< what may deform
  std::vector<MaterialPoint> border;  ///< places on the border; volume: share of a full cell's cross-section
};
/// In natural coordinates of its cell.
HeldMaterial held_material(const HexMesh& hex, const HeldRegions& held, HexId copy);

}  // namespace kerf
