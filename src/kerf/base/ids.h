// Typed indices. Every mesh element has an index type of its own, so that a visual vertex can't be used
// where a collision vertex is meant. An id is a position in an array; -1 means "none".
#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace kerf {

template <class Tag>
struct Id {
  std::int32_t value = -1;

  constexpr Id() = default;
  constexpr explicit Id(std::int32_t v) : value(v) {}
  constexpr explicit Id(std::size_t v) : value(static_cast<std::int32_t>(v)) {}

  [[nodiscard]] constexpr bool valid() const { return value >= 0; }
  /// Position in an array; only for valid ids.
  [[nodiscard]] constexpr std::size_t index() const { return static_cast<std::size_t>(value); }

  friend constexpr auto operator<=>(Id, Id) = default;
};

/// Ids of a triangle mesh: V vertices, H half-edges (h = 3 face + corner), F faces.
template <class Mesh>
struct MeshIds {
  struct VertexTag;
  struct HalfEdgeTag;
  struct FaceTag;
  using Vertex = Id<VertexTag>;
  using HalfEdge = Id<HalfEdgeTag>;
  using Face = Id<FaceTag>;
};

struct SurfaceTag;    ///< a plain triangle surface (files, generators)
struct CollisionTag;  ///< the coarse mid-surface
struct VisualTag;     ///< the fine surface that is drawn, cut walls included

using VertexId = MeshIds<SurfaceTag>::Vertex;
using TriangleId = MeshIds<SurfaceTag>::Face;

using CollisionVertex = MeshIds<CollisionTag>::Vertex;
using CollisionHalfEdge = MeshIds<CollisionTag>::HalfEdge;
using CollisionTriangle = MeshIds<CollisionTag>::Face;

using VisualVertex = MeshIds<VisualTag>::Vertex;
using VisualHalfEdge = MeshIds<VisualTag>::HalfEdge;
using VisualTriangle = MeshIds<VisualTag>::Face;

struct RootTag;
struct WallTag;
struct NodeTag;
struct HexTag;
struct CellTag;
using RootId = Id<RootTag>;  ///< a collision triangle of the pre-processing; its plane lives for ever
using WallId = Id<WallTag>;  ///< the cut surface strip of one border edge made by a cut
using NodeId = Id<NodeTag>;  ///< a node of the hexahedral mesh
using HexId = Id<HexTag>;    ///< a hexahedron: one copy of a lattice cell
using CellId = Id<CellTag>;  ///< a cell of the regular lattice

}  // namespace kerf

template <class Tag>
struct std::hash<kerf::Id<Tag>> {
  std::size_t operator()(kerf::Id<Tag> id) const noexcept { return std::hash<std::int32_t>{}(id.value); }
};
