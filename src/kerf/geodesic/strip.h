// A strip of faces from s to t, given by the half-edges that it crosses, and how the first one is found (4.1.2).
#pragma once

#include <cstdint>
#include <vector>

#include "kerf/geodesic/path_query.h"
#include "kerf/geodesic/sparse_index.h"

namespace kerf {

/// Crossed half-edges in order: each lies in the face the path comes from; the next one lies in its twin's face.
/// s is the apex of the first, t the apex of the last one's twin.
using Strip = std::vector<std::int32_t>;

/// Appends a crossing; a crossing straight back cancels the one before.
inline void append_crossing(const WalledSurface& m, Strip& strip, std::int32_t h) {
  if (!strip.empty() && m.opposite(strip.back()) == h) strip.pop_back();
  else strip.push_back(h);
}

/// Drops crossings at both ends that only turn around s or t. An empty strip: s and t share a face.
void trim_strip(const PathQuery& query, Strip& strip);

/// Cuts out what lies between two visits of the same face. Returns whether there was such a loop.
bool remove_loops(const WalledSurface& m, Strip& strip, SparseIndex& faces);

/// The strip cut by the plane through s, t and the mean of their normals. False when the cut meets a wall or border,
/// leaves through a sector's side or wanders off. Time proportional to the strip.
bool cut_strip_by_plane(const PathQuery& query, Strip& strip);

struct CorridorSearch {
  struct Edge {
    std::int32_t half_edge, parent;  ///< crossed half-edge; position of the one before, or -1
    double length;                   ///< from s over edge mid-points
    Vec3 middle;
    bool settled;
  };
  struct Entry {
    double estimate;
    std::int32_t edge;
  };
  SparseIndex index;
  std::vector<Edge> edges;
  std::vector<Entry> heap;
};

/// A strip found by A* over the mid-points of passable edges: there is one unless walls separate s from t.
bool search_corridor(const PathQuery& query, Strip& strip, CorridorSearch& scratch);

}  // namespace kerf
