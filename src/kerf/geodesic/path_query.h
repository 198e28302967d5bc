// One request for a path: the surface, the two ends and their sectors, and what may be crossed.
#pragma once

#include <array>
#include <cstdint>

#include "kerf/geodesic/walled_surface.h"

namespace kerf {

/// Next outgoing half-edge of the same vertex, counter-clockwise / clockwise; -1 beyond a border.
inline std::int32_t rotate_ccw(const WalledSurface& m, std::int32_t h) { return m.opposite(WalledSurface::prev(h)); }
inline std::int32_t rotate_cw(const WalledSurface& m, std::int32_t h) {
  const std::int32_t o = m.opposite(h);
  return o < 0 ? -1 : WalledSurface::next(o);
}

/// Calls visit(h) for the outgoing half-edges of v inside the sector, counter-clockwise (all: from any border on),
/// until it returns false.
template <class Visit>
void for_each_in_sector(const WalledSurface& m, std::int32_t v, Sector sector, Visit&& visit) {
  std::int32_t first = sector.first;
  if (first < 0) {
    const std::int32_t start = m.outgoing[static_cast<std::size_t>(v)];
    if (start < 0) return;
    first = start;
    for (std::int32_t h = rotate_cw(m, start); h >= 0 && h != start; h = rotate_cw(m, h)) first = h;
    // On a closed fan this walked once around and stopped just counter-clockwise of start: any start will do.
  }
  std::int32_t h = first;
  do {
    if (!visit(h)) return;
    if (h == sector.last) return;
    h = rotate_ccw(m, h);
  } while (h >= 0 && h != first);
}

struct PathQuery {
  const WalledSurface& surface;
  std::int32_t s = -1, t = -1;
  Sector at_s, at_t;

  PathQuery(const WalledSurface& m, std::int32_t from, std::int32_t to, Sector sector_s, Sector sector_t)
      : surface(m), s(from), t(to), at_s(sector_s), at_t(sector_t) {
    block_sides(sector_s);
    block_sides(sector_t);
  }

  /// May a path cross the edge of half-edge h (or, between free vertices, run along it)?
  [[nodiscard]] bool passable(std::int32_t h) const {
    if (surface.twin[static_cast<std::size_t>(h)] < 0 || surface.wall[static_cast<std::size_t>(h)] != 0) return false;
    for (int i = 0; i < blocked_count_; ++i)
      if (blocked_[static_cast<std::size_t>(i)] == h) return false;
    return true;
  }
  /// May a path pass through v?
  [[nodiscard]] bool free(std::int32_t v) const {
    return surface.wall_vertex[static_cast<std::size_t>(v)] == 0 && v != s && v != t;
  }
  [[nodiscard]] bool in_sector(std::int32_t v, Sector sector, std::int32_t outgoing) const {
    if (sector.first < 0) return true;
    bool found = false;
    for_each_in_sector(surface, v, sector, [&](std::int32_t h) { return !(found = h == outgoing); });
    return found;
  }

 private:
  // The two sides of a sector are walls as a rule; if not, they are treated as such.
  void block_sides(Sector sector) {
    if (sector.first < 0) return;
    block(sector.first);
    block(WalledSurface::prev(sector.last));
  }
  void block(std::int32_t h) {
    if (!passable(h)) return;
    blocked_[static_cast<std::size_t>(blocked_count_++)] = h;
    blocked_[static_cast<std::size_t>(blocked_count_++)] = surface.opposite(h);
  }
  std::array<std::int32_t, 8> blocked_{};
  int blocked_count_ = 0;
};

}  // namespace kerf
