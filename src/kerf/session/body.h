// A body at run time: the three meshes and what ties them together, in one journal.
#pragma once

#include "kerf/base/hash.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/embedding/embedding.h"
#include "kerf/lattice/hex_mesh.h"
#include "kerf/session/render_surface.h"

namespace kerf {

/// Everything a cut changes. A plain value: a copy is a snapshot.
struct Body {
  CellComplex complex;    ///< collision mesh, visual mesh, walls
  HexMesh hex;            ///< the simulated hexahedra
  Embedding embedding;    ///< collision and visual vertices in hexahedra
  RenderSurface surface;  ///< the visual mesh as it is drawn

  // Copies and moves are compiled once, in body.cpp.
  Body();
  Body(const Body&);
  Body(Body&&) noexcept;
  Body& operator=(const Body&);
  Body& operator=(Body&&) noexcept;
  ~Body();

  template <class Fn>
  void for_each_array(Fn&& f) {
    complex.for_each_array(f);
    hex.for_each_array(f);
    embedding.for_each_array(f);
    surface.for_each_array(f);
  }
};

extern template void journal_mark(Body&, JournalMark&);
extern template void journal_rollback(Body&, const JournalMark&);
extern template bool journal_compact(Body&, const JournalMark&);
extern template JournalStep journal_take(Body&, const JournalMark&);
extern template void journal_undo(Body&, JournalStep&);
extern template void journal_redo(Body&, JournalStep&);

/// Numbers of vertices and elements of the three meshes (figure 16 of the paper), and of connected pieces.
struct BodyCounts {
  std::size_t visual_vertices = 0, visual_triangles = 0;
  std::size_t collision_vertices = 0, collision_triangles = 0;
  std::size_t nodes = 0, hexahedra = 0;  ///< the living ones
  int pieces = 0;
  friend bool operator==(const BodyCounts&, const BodyCounts&) = default;
};

BodyCounts count_body(const Body& body);
/// The same where the number of pieces is known.
BodyCounts count_body(const Body& body, int pieces);

/// Hash of all arrays: two bodies with the same hash hold the same bits.
std::uint64_t body_hash(const Body& body);

}  // namespace kerf
