// Surface points don't jump in the frame of a cut (invariant 8).
//
// A cut gives nodes another motion; what they would jump by stays with them (node_fade.h), and a vertex that goes on with its nodes stays
// where it was. Where a cut makes a copy be absorbed, puts together again what had come apart ahead of a tip, or takes material from one
// copy to another, vertices follow other nodes than before, and in a deformed body those are elsewhere. What a vertex would
// jump by then, in place and in velocity, stays with the vertex. Both fade.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kerf/session/body.h"
#include "kerf/session/fading_vertex.h"
#include "kerf/session/node_fade.h"

namespace kerf {

/// Part of a session's state; mostly empty. Vertices ascend.
struct SurfaceFade {
  NodeFade nodes;
  std::vector<FadingVertex> visual, collision;
  [[nodiscard]] bool empty() const { return nodes.empty() && visual.empty() && collision.empty(); }
  [[nodiscard]] std::size_t bytes() const;
};

/// Time goes on by dt (s). Drops what is under `negligible` (m).
void fade_offsets(SurfaceFade& fade, double dt, double negligible);

/// The entry of a vertex, or null.
const FadingVertex* fading(std::span<const FadingVertex> list, std::size_t vertex);

/// What a pose of the blade has touched, as it was before: copies with the motion that their nodes were shown with, and vertices that
/// have left them, or were about to be rolled back. Memory, no state.
struct SurfaceMemory {
  struct Copy {
    HexId copy;  ///< none: rolled back since, its number may be another's
    LatticeIndex cell{};
    std::array<Vec3, 8> position, velocity;  ///< of the corners
    bool same = false;                       ///< at the end of the pose
  };
  struct Vertex {
    std::int32_t vertex = 0;
    Vec3 rest;
    std::int32_t copy = 0;  ///< in copies
  };
  std::vector<Copy> copies;
  std::vector<Vertex> visual, collision;  ///< each vertex once
  std::vector<NodeMotion> nodes;          ///< old values of nodes that were moved, in the order of the changes

  // private to surface_fade.cpp
  struct Seen {
    std::uint32_t round = 0;
    std::int32_t place = -1;
  };
  std::uint32_t round = 0;
  std::size_t visual_count = 0, collision_count = 0;  ///< when the pose began
  std::vector<std::uint32_t> seen_visual, seen_collision;
  std::vector<Seen> seen_copy;
  std::vector<HexId> queue;
  std::vector<CellId> cells;
  std::vector<FadingVertex> changes, merged;
};

/// Where body and nodes are.
struct MovingSurface {
  const Body& body;
  std::span<const Vec3> positions, velocities;  ///< of the nodes
  const SurfaceFade& fade;
};

/// A pose of a blade begins: nothing is remembered.
void begin_surface(const Body& body, SurfaceMemory& memory);

/// Before the body is rolled back to `mark`: remembers what this may move, vertices born since included.
void remember_rollback(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory);

/// After hexahedra and embeddings have followed a cut, before nodes do: remembers what has changed since `mark`, as it was then.
void remember_change(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory);

/// After nodes have been moved, from entry `first` of memory.nodes on: leaves those where they were shown that most of the material around
/// was shown with, and remembers the copies around the others. Copies from `old_copies` on are new.
void remember_moved(const MovingSurface& state, std::size_t first, std::size_t old_copies, SurfaceMemory& memory,
                    NodeFade& fade);

/// The pose is over. Gives vertices that follow other nodes, and are still the same points of the material, the offset that keeps them where
/// they were. Differences up to `negligible` (m) are rounding. Cost: what was remembered, and the vertices of copies whose nodes are
/// shown elsewhere than before.
void hold_surface(const MovingSurface& state, double negligible, SurfaceMemory& memory, SurfaceFade& fade);

}  // namespace kerf
