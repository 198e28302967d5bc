// Places of the material: from the shape at rest to the shape now, and back.
#pragma once

#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/session/session.h"

namespace kerf {

/// Where the material that is at these places at rest is now, metres. Each place goes along with the triangle of the collision mesh that is
/// nearest to it at rest, so places beside the body move as if they were fastened to it. Cost: linear in the body once, then the logarithm of
/// it for each place.
std::vector<Vec3> places_now(const Session& session, std::span<const Vec3> rest);

/// A place of the middle surface.
struct MiddlePlace {
  Vec3 rest;            ///< metres, at rest
  double distance = 0;  ///< metres, from what was asked for, as the body is now
};

/// The places of the middle surface that are now nearest to these, metres. Cost: as places_now().
std::vector<MiddlePlace> places_at_rest(Session& session, std::span<const Vec3> now);

}  // namespace kerf
