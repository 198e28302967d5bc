// Splitting edges and faces of the visual mesh: topology, corner data, 3D point, texture and normal.
#pragma once

#include <algorithm>
#include <array>

#include "kerf/cutting/cut_context.h"
#include "kerf/cutting/half_edge_split.h"
#include "kerf/cutting/tolerances.h"

namespace kerf::cut {

/// Position of v in the plane of a patch; v must have a face of it.
Vec2 planar_in(const VisualMesh& mesh, VisualVertex v, Patch patch);

/// A vertex with this rest data and no half-edge yet, not free.
VisualVertex append_visual_vertex(VisualMesh& mesh, Vec3 rest, Vec3f normal);

/// Would splitting h at these planar points leave only faces with more than `keep` of their parent's area, and > 0?
bool edge_split_is_sound(const VisualMesh& mesh, VisualHalfEdge h, Vec2 u_left, Vec2 u_right, double keep = 0);

/// Splits h = a -> b. The planar points are the true ones; the 3D point, the texture and the normal are taken at
/// `fraction` (from a, kept off the ends by 5 %, `reach` metres at most): any point of the edge leaves area, volume and the texture
/// map as they are.
VisualVertex split_visual_edge(VisualMesh& mesh, VisualHalfEdge h, double fraction, Vec2 u_left, Vec2 u_right,
                               double reach);

/// Asks for the memory that splitting h and walking on behind it will need.
void prefetch_split(const VisualMesh& mesh, VisualHalfEdge h);

/// Splits a face at a planar point, the 3D point at barycentric weights (normalised and kept off the edges, by `reach` metres at most).
VisualVertex split_visual_face(VisualMesh& mesh, VisualTriangle f, std::array<double, 3> weights, Vec2 u, double reach);

/// Metres by which a vertex may lie off the place of its parameter.
inline double place_reach(const CellComplex& body) { return kPlaceReach * body.mean_root_edge; }
/// A crossing of the edge between two vertices that is nearer to one of them than this part of the edge may take that vertex.
inline double near_enough(const CellComplex& body, VisualVertex a, VisualVertex b) {
  return std::min(kWarpFraction, place_reach(body) / std::max(norm(body.visual.rest[b] - body.visual.rest[a]), 1e-300));
}

/// Marks an edge as part of a chain, line or border.
void set_barrier(VisualMesh& mesh, VisualHalfEdge h);

/// Turns the inner edge h = a -> b of the faces a b c and b a d into d -> c, with corner data and marks; afterwards next(h) is d -> c. The caller knows
/// that both faces stay sound and that no texture seam runs along h.
void flip_visual_edge(VisualMesh& mesh, VisualHalfEdge h);

struct PlanarPoint {
  Patch patch;
  Vec2 at;
};
/// Moves the parameter of v to the points given for some of its patches, if every face of those patches keeps more
/// than `keep` of its planar area. The 3D position stays. False and nothing done otherwise.
template <std::size_t N>
bool warp(VisualMesh& mesh, VisualVertex v, const std::array<PlanarPoint, N>& to, double keep);

}  // namespace kerf::cut
