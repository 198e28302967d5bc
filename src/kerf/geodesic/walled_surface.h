// The visual surface while paths are being inserted (4.1.2, 4.1.3): a triangle mesh in half-edge form whose walls
// (edges of earlier paths) later paths must not cross. Plain growing arrays: pre-processing needs no undo.
//
// Half-edge h = 3 face + corner; twin -1 on a border. Walls and borders are never crossed; wall vertices (ends of
// wall edges, bound vertices) are never passed through, only started from or ended at.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"

namespace kerf {

struct WalledSurface {
  std::vector<Vec3> position;             ///< |V|, metres
  std::vector<std::int32_t> outgoing;     ///< |V|, any one half-edge of the vertex's fan
  std::vector<std::uint8_t> wall_vertex;  ///< |V|, 1: bound vertex or on a wall or border; paths only end there
  std::vector<std::int32_t> origin;       ///< 3 |F|
  std::vector<std::int32_t> twin;         ///< 3 |F|, -1 on a border
  std::vector<std::uint8_t> wall;         ///< 3 |F|, 1 on both half-edges of a wall edge

  static std::int32_t next(std::int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static std::int32_t prev(std::int32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
  [[nodiscard]] std::int32_t from(std::int32_t h) const { return origin[static_cast<std::size_t>(h)]; }
  [[nodiscard]] std::int32_t to(std::int32_t h) const { return from(next(h)); }
  [[nodiscard]] std::int32_t apex(std::int32_t h) const { return from(prev(h)); }
  [[nodiscard]] std::int32_t opposite(std::int32_t h) const { return twin[static_cast<std::size_t>(h)]; }
  [[nodiscard]] Vec3 at(std::int32_t v) const { return position[static_cast<std::size_t>(v)]; }
};

/// Faces around vertex v that a path may start in, as outgoing half-edges of v: `first`, then counter-clockwise up to
/// and including `last`. first = last = -1: all faces.
struct Sector {
  std::int32_t first = -1, last = -1;
};

/// One stop of a path: a vertex (half_edge = -1), or the point from(h) + t (to(h) - from(h)) with 0 < t < 1.
struct PathStop {
  std::int32_t vertex = -1;
  std::int32_t half_edge = -1;
  double t = 0;
};

/// A path over the surface from stops.front() to stops.back() (both vertices); consecutive stops share a face or an
/// edge. An edge stop names the half-edge whose face the path comes from (it leaves into the twin's face).
struct SurfacePath {
  std::vector<PathStop> stops;
  double length = 0;   ///< metres; of the limit that touches wall vertices where the stops keep off them
  bool exact = false;  ///< asked for, and the search was not given up: no allowed path is shorter
};

struct PathOptions {
  bool exact = false;  ///< window propagation instead of local straightening only
};

/// Shortest path from s to t that crosses no wall and no border, leaves s inside its sector and reaches t inside its
/// sector (4.1.2). Local by default: a strip of faces is found (plane cut, then A* over edge mid-points), straightened
/// and switched to the other side of bend vertices until no switch shortens it. exact: the strip of the exact geodesic
/// (Xin and Wang 2009) under the same constraints. Fails, naming s and t, when walls separate them.
///
/// `scratch` keeps memory between calls; contents are private to the implementation.
struct PathScratch;
Result<SurfacePath> find_path(const WalledSurface& surface, std::int32_t s, std::int32_t t, Sector sector_s,
                              Sector sector_t, const PathOptions& options, PathScratch& scratch);

}  // namespace kerf
