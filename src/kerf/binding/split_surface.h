// The visual surface while it is re-meshed (4.1.3): the walled surface with what new vertices inherit. Splitting leaves
// the surface geometrically identical.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/geodesic/walled_surface.h"
#include "kerf/mesh/half_edge_build.h"

namespace kerf {

struct SplitSurface {
  WalledSurface walled;
  std::vector<Vec2f> texture;        ///< 3 |F| corners, or empty
  std::vector<Vec3f> normal;         ///< |V|, unit
  std::vector<Vec3> upright;         ///< |V|: real positions while `walled` has squashed ones; else empty
  std::vector<Vec3> drawn_back;      ///< |V|: what was added to real positions so that lips lie apart; else empty
  std::vector<std::int32_t> parent;  ///< |F|: the face before any bound point was inserted that a face is part of
  std::vector<std::int32_t> input;   ///< of those faces: the face of the input; empty: the same
  std::vector<std::uint8_t> flat;    ///< of those faces: 1: of a flat part that was triangulated anew; empty: none

  [[nodiscard]] std::int32_t vertex_count() const { return static_cast<std::int32_t>(walled.position.size()); }
  [[nodiscard]] std::int32_t input_face(std::int32_t f) const {
    const std::int32_t p = parent[static_cast<std::size_t>(f)];
    return input.empty() ? p : input[static_cast<std::size_t>(p)];
  }
  [[nodiscard]] std::int32_t face_count() const { return static_cast<std::int32_t>(parent.size()); }
};

/// Unit normals of the vertices: those of the triangles, weighted by their angles.
std::vector<Vec3f> smooth_normals(std::span<const Vec3> positions,
                                  std::span<const std::array<std::int32_t, 3>> triangles, HalfEdgeRoom room = {});

/// The surface before any split: no walls, border vertices are wall vertices. `texture`: 3 |F| or empty. `room`: memory for what splits
/// will add; what is given should have it too.
SplitSurface make_split_surface(std::span<const Vec3> positions, std::span<const std::array<std::int32_t, 3>> triangles,
                                HalfEdgeArrays connected, std::vector<Vec3f> normals, std::vector<Vec2f> texture,
                                HalfEdgeRoom room = {});

/// Splits edge h = a->b (and its twin) at a + t (b - a); returns the new vertex m. h becomes a->m in place and the edge c->a
/// of its face keeps its id; only the edge from b to the apex moves to a new face, on both sides. Both halves keep the wall flag.
std::int32_t split_edge(SplitSurface& s, std::int32_t h, double t);

/// Replaces inner edge h by the other diagonal of its two faces, whose numbers stay: h becomes the new edge, from the apex beyond it to its own. The
/// quad must be convex, without walls.
void flip_edge(SplitSurface& s, std::int32_t h);

/// Makes the faces their own parents; `input` and `flat` follow.
void make_own_parents(SplitSurface& s);

/// Halves edges longer than `limit`, longest first, until there are none or `most_faces` are reached; the faces of the result are their
/// own parents. Bound points and paths of many collision triangles in one visual triangle would leave slivers. False if nothing was long.
bool split_long_edges(SplitSurface& s, double limit, std::size_t most_faces);

/// Splits face f into three at the point with these barycentric weights; returns the new vertex. The first edge of f stays. Real positions only.
std::int32_t split_face(SplitSurface& s, std::int32_t f, std::array<double, 3> weights);

/// The half-edge a -> b, or -1. Cost: the valence of a.
std::int32_t find_half_edge(const WalledSurface& s, std::int32_t a, std::int32_t b);

/// The outgoing half-edge of v with nothing clockwise of it, or any when v is inner.
std::int32_t fan_start(const WalledSurface& s, std::int32_t v);

inline std::int32_t ccw(const WalledSurface& s, std::int32_t h) { return s.opposite(WalledSurface::prev(h)); }
inline std::int32_t cw(const WalledSurface& s, std::int32_t h) {
  const std::int32_t t = s.opposite(h);
  return t < 0 ? -1 : WalledSurface::next(t);
}

/// Marks edge h and its twin as a wall, and its ends as wall vertices.
void mark_wall(WalledSurface& s, std::int32_t h);

}  // namespace kerf
