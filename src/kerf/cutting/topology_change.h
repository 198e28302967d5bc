// What a cut changed, read from the journal: what lattice, embeddings, contact and viewer apply.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/journal.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_scratch.h"

namespace kerf {

struct TopologyChange {
  /// New triangles and those whose corners, twins, chains, walls, lines or lists changed; rising, no repeats.
  std::vector<CollisionTriangle> triangles;
  CollisionVertex first_new_collision_vertex;  ///< this and all above are new
  CollisionTriangle first_new_collision_triangle;
  std::vector<VertexBirth> births;  ///< of the new collision vertices, by rising vertex
  VisualVertex first_new_visual_vertex;
  VisualTriangle first_new_visual_triangle;
  WallId first_new_wall;
  /// Visual triangles that are not new but whose corners, texture or patch changed; rising, no repeats.
  std::vector<VisualTriangle> visual_triangles;

  // Memory kept between calls: rounds in which an element was last seen.
  std::vector<std::uint32_t> seen_triangle, seen_visual_triangle;
  std::uint32_t round = 0;
};

/// Fills `change` with what happened since `since`. Reuses its memory. Births come from the scratch that the cuts were
/// made with. Cost: proportional to the log.
void collect_topology_change(const CellComplex& body, const JournalMark& since, const CutScratch& scratch,
                             TopologyChange& change);

/// The same after journal_undo or journal_redo of a step: `step` as it is afterwards. After an undo nothing is new.
void collect_topology_change(const CellComplex& body, const JournalStep& step, const CutScratch& scratch,
                             TopologyChange& change);

/// Only the collision triangles: new, or changed in any way since `since`; rising, no repeats.
std::vector<CollisionTriangle> changed_triangles(const CellComplex& body, const JournalMark& since);

}  // namespace kerf
