// Checks and repairs of the surfaces that people bring: everything behind it may rely on an oriented
// manifold.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/mesh/surface_measures.h"
#include "kerf/mesh/surface_tolerances.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

enum class Closedness { kAny, kClosed, kOpen };

struct SurfaceRequirements {
  std::string name;  ///< what errors and repairs call the surface, such as its file; may be empty
  Closedness closedness = Closedness::kAny;
  bool single_body = true;  ///< false: any number of separate pieces
  bool bindable = false;    ///< no vertex with more than kMostAround triangles, and none like a needle (needles.h)
  double weld_tolerance = kWeldTolerance;  ///< fraction of the diagonal; 0: only the very same positions
  std::optional<double>
      weld;  ///< metres, at most the mean edge: all vertices this close are one; 0: none are. None: weld_tolerance, and lips stay apart
};

struct SurfaceReport {
  std::vector<std::string> repairs;   ///< what was changed, one sentence each; empty: nothing
  std::vector<std::string> warnings;  ///< what is odd but was left, with the way out
  SurfaceMeasures measures;           ///< of the checked surface
  std::size_t bodies = 0;             ///< separate pieces; the walls of cavities belong to the body around them
  std::size_t cavities = 0;
  std::string several;  ///< what single_body would refuse; empty: nothing
};

/// What about the box of a surface doubles can't carry.
struct ExtentFault {
  std::string what;       ///< after "the surface is"
  std::string otherwise;  ///< the way out, for a mesh
};
/// None: a size and a distance from the origin that can be worked with (surface_tolerances.h).
std::optional<ExtentFault> extent_fault(const Box3& box);

/// Makes `mesh` an oriented manifold whose closed parts enclose a positive volume, or refuses it. In this
/// order: refuses no triangles, missing corners, positions that are not finite, a size or distance from the
/// origin that doubles can't carry; welds vertices at one place (below); drops triangles with coinciding corners, duplicate triangles,
/// and flat triangles on a border; refuses other flat triangles; takes apart edges with more than two triangles where lips of a slit or
/// bodies lie on each other, so that each edge keeps the two with material between them, and refuses others; turns
/// triangles to agree with their neighbours, refuses one-sided surfaces; splits vertices where parts touch in
/// a single point; turns closed parts that are inside out (walls of cavities: that are not); refuses closed
/// parts without volume, borders or their lack against `closedness`, and several bodies; drops unused
/// vertices. Texture coordinates and groups stay with their triangles. On an Error, which names triangles and
/// vertices by their 1-based numbers in the input, mesh is untouched. Near linear time; several closed parts
/// inside each other's boxes cost parts x triangles.
///
/// Which vertices are welded, unless `weld` says it: what a mesh keeps apart stays apart, but where welding closes it, where its texture says
/// that it is a seam, and where nothing hangs together (kSoup). Vertices at one place that stay apart get the same bits, where no triangle turns by that.
Result<SurfaceReport> check_surface(TriangleMesh& mesh, const SurfaceRequirements& requirements = {});

}  // namespace kerf
