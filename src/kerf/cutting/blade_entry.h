// Where a moving blade gets into the material: stabs, borders with material ahead, and what its length comes down on
// (docs/cutting.md, "From tool motion to a cut path").
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kerf/cutting/blade_sweep.h"

namespace kerf {

/// Where a blade gets into the material.
struct BladeEntry {
  double time = 0;  // 0 .. 1 of the move
  double depth = 0; // along the blade
  FacePoint point;
  Vec3 position;
  bool standing = false;  // the edge was there before it moved
  bool slit_end = false;  // where a slit goes on
  // An edge of the mesh that the blade's whole length comes down on: the ways into the faces on both sides. Zero: all ways.
  std::array<Vec3, 2> ways{};
};

/// What is looked at: the deformed mesh and one move of the blade.
struct BladeMove {
  const CellComplex& complex;
  std::span<const Vec3> position;  ///< of collision vertices, deformed, metres
  const FaceBoxes& boxes;          ///< there, up to date
  const BladeEdge &from, &to;
  bool through = false;   ///< as in BladeStroke
  bool standing = false;  ///< as in BladeStroke
  std::span<const CollisionVertex> fronts;  ///< of the stroke, what is provisional rolled back
  std::span<const Vec3> ends;               ///< where they were at the last pose
};

/// A border made by a cut, not an edge of the rim.
bool is_lip(const CollisionMesh& mesh, CollisionHalfEdge h);

/// What a vertex says of a slit.
struct SlitCorner {
  double angle = 0;  ///< rad, of the material around the vertex
  Vec3 lips;         ///< the sum of the directions of its borders
  bool cut = false;  ///< one of them was made by a cut
  [[nodiscard]] bool turns_back() const;  ///< the border turns back here
  [[nodiscard]] bool ends() const { return cut && turns_back(); }  ///< it is where a slit ends
  [[nodiscard]] bool ran_out() const { return cut && !turns_back(); }  ///< where one has come out at the rim
};
SlitCorner slit_at(const CollisionMesh& mesh, std::span<const Vec3> position, CollisionVertex v);

/// Everything the blade runs into during a move, first things first. Cost: what its strip comes near.
std::vector<BladeEntry> find_blade_entries(const BladeMove& move);

}  // namespace kerf
