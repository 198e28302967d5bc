// From a closed surface alone to a bound body: the collision mesh is made, bound, and made again with more triangles
// where that fails.
#pragma once

#include <optional>

#include "kerf/binding/bind.h"
#include "kerf/midsurface/midsurface.h"

namespace kerf {

struct AutomaticBody {
  Midsurface midsurface;
  bool slits = false;              ///< vertices lie at one place and are apart
  std::optional<BoundBody> bound;  ///< none if the body is not thin, or does not bind
  std::optional<Error>
      refused;  ///< why it does not bind, with the place, which is marked in the mid-surface's diagnosis
};

/// Bad input: more collision triangles are wanted than the surface has, and more than bends ask for (mid::kMostByNeed). They would follow
/// the flat triangles of the surface, not the body. 0 asks for none.
Status check_wanted_triangles(std::size_t wanted, const TriangleMesh& visual);

/// triangles: wanted of the collision mesh, 0: as many as it needs. Bad input: what check_wanted_triangles, make_midsurface and bind refuse.
Result<AutomaticBody> make_automatic_body(const TriangleMesh& visual, std::size_t triangles,
                                          const BindOptions& options);

/// One message for a body that is not thin: the reasons, where, and the way out.
std::string not_thin_message(const Midsurface& midsurface);

}  // namespace kerf
