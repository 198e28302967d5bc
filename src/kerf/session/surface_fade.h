// Surface points don't jump in the frame of a cut (invariant 8).
//
// Where a cut makes a copy be absorbed, puts together again what had come apart ahead of a tip, or takes material from one copy to
// another, surface vertices follow other nodes than before, and in a deformed body those are elsewhere. What a vertex would
// jump by, in place and in velocity, stays with it as an offset that fades like a critically damped spring.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/session/body.h"
#include "kerf/session/node_memory.h"

namespace kerf {

/// What a vertex' place and velocity have in addition to those of its copy. Metres, m/s.
struct FadingVertex {
  std::int32_t vertex = 0;
  Vec3 offset, velocity;
  friend bool operator==(const FadingVertex&, const FadingVertex&) = default;
};

/// Part of a session's state. Both by ascending vertex; mostly empty.
struct SurfaceFade {
  std::vector<FadingVertex> visual, collision;
  [[nodiscard]] bool empty() const { return visual.empty() && collision.empty(); }
};

/// Rate of the fading, 1/s: a tenth is left after 20 ms, a thousandth after 50.
inline constexpr double kFadeRate = 200;

/// Time goes on by dt (s). Drops what is under `negligible` (m).
void fade_offsets(SurfaceFade& fade, double dt, double negligible);

/// The entry of a vertex, or null.
const FadingVertex* fading(std::span<const FadingVertex> list, std::size_t vertex);

/// Positions and velocities of surface vertices, by their copies alone, as they were before a cut, and of nodes that it has moved since.
/// Memory, no state.
struct SurfaceMemory {
  struct Vertex {
    std::int32_t vertex = 0;
    Vec3 rest, position, velocity;
  };
  std::vector<Vertex> visual, collision;  ///< each vertex once
  std::vector<NodeMotion> nodes;             ///< old values, in the order of the changes

  // private to surface_fade.cpp
  std::vector<std::uint32_t> seen_visual, seen_collision;
  std::uint32_t round = 0;
  std::vector<std::pair<std::int32_t, HexId>> old_visual, old_collision;
  std::vector<std::pair<HexId, std::array<NodeId, 8>>> old_nodes;
  std::vector<HexId> copies;
  std::vector<CellId> cells;
  std::vector<std::pair<std::int32_t, std::int32_t>> order;  // vertex, place in the list
  std::vector<FadingVertex> merged;
};

/// Where body and nodes are. The fade is that of before the cut.
struct MovingSurface {
  const Body& body;
  std::span<const Vec3> positions, velocities;  ///< of the nodes
  const SurfaceFade& fade;
};

/// A pose of a blade begins: nothing is remembered.
void begin_surface(SurfaceMemory& memory);

/// Before the body is rolled back to `mark`: remembers the vertices that this may move, those born since included.
void remember_surface(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory);

/// After hexahedra, embeddings and nodes have followed a cut: remembers the vertices that this may have moved since `mark`, where
/// they were then. memory.nodes: old values of the nodes that were there and have been moved.
void remember_surface_before(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory);

/// Before nodes are given other velocities: remembers the vertices around them.
void remember_surface_around(const MovingSurface& state, std::span<const NodeId> nodes, SurfaceMemory& memory);

/// Gives all remembered vertices that are still the same points of the material the offset that keeps them where they were.
/// Differences up to `negligible` (m, m/s) are rounding.
void hold_surface(const Body& body, std::span<const Vec3> positions, std::span<const Vec3> velocities, double negligible,
                  SurfaceMemory& memory, SurfaceFade& fade);

}  // namespace kerf
