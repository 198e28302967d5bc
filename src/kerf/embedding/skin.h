// Positions and normals of all visual vertices from the nodes, fast (4.2.5).
//
// Vertices are grouped by copy in blocks of eight; a block is evaluated with the copy's trilinear polynomial
// x = a0 + a1 xi + a2 eta + a3 xi eta + a4 zeta + ... and its gradient, in float. A cut moves single vertices between blocks.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/journal.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/embedding/embedding.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

inline constexpr int kSkinLanes = 8;

struct alignas(32) SkinBlock {
  std::array<float, kSkinLanes> x{}, y{}, z{};     ///< local coordinates
  std::array<float, kSkinLanes> nx{}, ny{}, nz{};  ///< rest normals, scaled to the cell
  std::array<std::int32_t, kSkinLanes> vertex{};   ///< visual vertices
  HexId copy;
  std::int32_t count = 0;  ///< lanes in use; 0: a free block
  std::int32_t next = -1;  ///< the copy's next block (all full but the first), or the next free one
};

/// Derived data: not journaled, brought up to date from the embedding.
struct Skin {
  std::vector<SkinBlock> blocks;
  std::vector<std::int32_t> slot;         ///< per visual vertex: 8 block + lane, or -1
  std::vector<std::int32_t> first_block;  ///< per copy: -1 none
  std::int32_t free_block = -1;
  std::vector<VisualVertex> dirty;                  ///< to be looked at by the next refresh, each once
  std::vector<std::uint8_t> noted;                  ///< per visual vertex: 1 while it is in `dirty`
  std::vector<std::array<float, 24>> coefficients;  ///< per copy, scratch of evaluation
  std::vector<std::uint8_t> wanted;
};

/// Groups all vertices. Linear.
void build_skin(const CellComplex& body, const HexMesh& hex, const Embedding& embedding, Skin& skin);

/// Notes vertices that embed_triangles moved.
void note_moved(Skin& skin, std::span<const VisualVertex> moved);
/// Notes what will change when the embedding's visual array goes back to a mark: call it before rolling back.
void note_rollback(Skin& skin, const Embedding& embedding, Journaled<VisualVertex, HexId>::Mark to);
/// Notes what an undone or redone step of the embedding changed: call it before or after journal_undo or journal_redo.
void note_step(Skin& skin, const JournalStep& embedding_step);

/// Brings the noted vertices, and those that are new or gone, to their blocks. Cost: proportional to them.
void refresh_skin(const CellComplex& body, const HexMesh& hex, const Embedding& embedding, Skin& skin);

/// Positions and unit normals of all visual vertices (|V_v| each), from the positions of all nodes (|N|, metres). `normals`
/// may be empty: positions only. A vertex in a flattened cell keeps a finite normal. The skin must be refreshed.
void evaluate_skin(const HexMesh& hex, Skin& skin, std::span<const Vec3> nodes, std::span<Vec3f> positions,
                   std::span<Vec3f> normals);

}  // namespace kerf
