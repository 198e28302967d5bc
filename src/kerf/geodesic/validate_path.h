// Is a path fit for insertion?
#pragma once

#include "kerf/geodesic/path_query.h"
#include "kerf/geodesic/walled_surface.h"

namespace kerf {

/// Do the stops lead from s to t, each strictly inside an edge or at a free vertex, consecutive ones sharing a face or
/// a passable edge, no face crossed twice? Empty when so, else what is wrong and where. Time proportional to the path
/// times the valence.
Status validate_path(const PathQuery& query, const SurfacePath& path);

}  // namespace kerf
