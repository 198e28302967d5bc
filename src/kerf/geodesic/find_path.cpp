#include <fmt/format.h>

#include "kerf/base/check.h"
#include "kerf/geodesic/path_query.h"
#include "kerf/geodesic/path_scratch.h"
#include "kerf/geodesic/straighten.h"
#include "kerf/geodesic/strip.h"
#include "kerf/geodesic/tolerances.h"
#include "kerf/geodesic/validate_path.h"
#include "kerf/geodesic/walled_surface.h"

namespace kerf {
namespace {

// s and t are neighbours: along their edge or, where that is a wall, beside it.
bool step_to_neighbour(const PathQuery& query, SurfacePath& path) {
  const WalledSurface& m = query.surface;
  path.length = norm(m.at(query.t) - m.at(query.s));
  bool found = false;
  for_each_in_sector(m, query.s, query.at_s, [&](std::int32_t h) {
    if (m.to(h) != query.t || !query.passable(h) || !query.in_sector(query.t, query.at_t, m.opposite(h))) return true;
    path.stops = {{query.s, -1, 0}, {query.t, -1, 0}};
    found = true;
    return false;
  });
  if (found) return true;
  // A face with s, t and a third corner on the right side of the wall: through a point of one of its other two edges.
  for_each_in_sector(m, query.s, query.at_s, [&](std::int32_t h) {
    const std::int32_t back = WalledSurface::prev(h), across = WalledSurface::next(h);
    std::int32_t spoke_s, spoke_t, at_t;  // half-edges of this face
    if (m.to(h) == query.t) spoke_s = back, spoke_t = across, at_t = across;
    else if (m.apex(h) == query.t) spoke_s = h, spoke_t = across, at_t = back;
    else return true;
    if (!query.in_sector(query.t, query.at_t, at_t)) return true;
    if (query.passable(spoke_s)) path.stops = {{query.s, -1, 0}, {-1, m.opposite(spoke_s), 0.5}, {query.t, -1, 0}};
    else if (query.passable(spoke_t)) path.stops = {{query.s, -1, 0}, {-1, spoke_t, 0.5}, {query.t, -1, 0}};
    else return true;
    found = true;
    return false;
  });
  return found;
}

// Every crossing at its middle: valid whatever the coordinates are.
void write_middles(const PathQuery& query, const Strip& strip, SurfacePath& path) {
  const WalledSurface& m = query.surface;
  path.stops.assign(1, {query.s, -1, 0});
  path.length = 0;
  Vec3 last = m.at(query.s);
  for (std::int32_t h : strip) {
    path.stops.push_back({-1, h, 0.5});
    const Vec3 here = lerp(m.at(m.from(h)), m.at(m.to(h)), 0.5);
    path.length += norm(here - last);
    last = here;
  }
  path.stops.push_back({query.t, -1, 0});
  path.length += norm(m.at(query.t) - last);
}

// A shortest path visits no face twice, but walls, rounding and folded corridors can leave a loop in a strip.
void straighten_without_loops(const PathQuery& query, Strip& strip, Straightener& scratch) {
  straighten(query, strip, scratch);
  for (int round = 0; round < kLoopRounds && remove_loops(query.surface, strip, scratch.faces); ++round)
    straighten(query, strip, scratch);
}

}  // namespace

Result<SurfacePath> find_path(const WalledSurface& surface, std::int32_t s, std::int32_t t, Sector sector_s,
                              Sector sector_t, const PathOptions& options, PathScratch& scratch) {
  KERF_ASSERT(s >= 0 && static_cast<std::size_t>(s) < surface.position.size());
  KERF_ASSERT(t >= 0 && static_cast<std::size_t>(t) < surface.position.size());
  if (s == t) return bad_input(fmt::format("a path needs two different ends, both are vertex {}", s + 1));
  const PathQuery query(surface, s, t, sector_s, sector_t);
  SurfacePath path;
  if (step_to_neighbour(query, path)) {
    path.exact = options.exact;
    return path;
  }

  Strip& strip = scratch.strip;
  Straightener& straightener = scratch.straightener;
  const bool by_plane = cut_strip_by_plane(query, strip);
  if (!by_plane && !search_corridor(query, strip, scratch.corridor))
    return failed(
        fmt::format("no path from vertex {} to vertex {}: earlier paths or borders separate them; check that "
                    "both lie on the same side and piece of the surface, in the order of the collision mesh",
                    s + 1, t + 1));
  straighten_without_loops(query, strip, straightener);
  Strip& other = scratch.other_strip;
  const auto try_other = [&] {
    const double known = straightener.length;
    straighten_without_loops(query, other, straightener);
    if (straightener.length < known) strip.swap(other);
    else pull_tight(query, strip, straightener);
  };
  if (by_plane && straightener.length > kSecondSeed * norm(surface.at(t) - surface.at(s)) &&
      search_corridor(query, other, scratch.corridor))
    try_other();
  const bool doubtful =
      strip.size() <= kFewCrossings && straightener.length > kDoubtfulDetour * norm(surface.at(t) - surface.at(s));
  if (options.exact || doubtful) {
    const ExactOutcome outcome = search_exact(query, straightener.length, other, scratch.exact);
    if (outcome == ExactOutcome::kShorter) try_other();
    path.exact = options.exact && outcome != ExactOutcome::kGaveUp;
  }
  write_stops(query, strip, straightener, path);
  if (!validate_path(query, path)) {
    write_middles(query, strip, path);
    path.exact = false;
  }
  return path;
}

}  // namespace kerf
