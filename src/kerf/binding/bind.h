// Pre-processing (section 4.1 of the paper): binds a fine visual surface to a coarse collision mesh.
#pragma once

#include <string>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/binding/displacement.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct BindOptions {
  bool exact = false;    ///< exact geodesic paths (Xin and Wang 2009) instead of locally shortest ones
  double thickness = 0;  ///< metres; open sheets only, must be > 0 there; a closed body has its own
  Progress progress = {};
  bool squash =
      true;  ///< false: paths and parameters of the surface as it stands, as the paper has them; walls near the rim are drawn beside the blade
  bool merge =
      true;  ///< false: vertices at one place are what check_surface left there, the lips of slits, and stay apart
  std::vector<CollisionVertex>* at_fault =
      nullptr;  ///< receives the collision vertices at what is refused, where it is one place
};

/// What was done. All counts and seconds; nothing that a later computation depends on.
struct BindReport {
  bool closed = false;               ///< the visual mesh has two sides
  bool flipped_collision = false;    ///< the collision mesh was turned over to agree with the open sheet
  bool flipped_visual = false;       ///< the closed visual mesh was turned inside out (its volume was negative)
  std::int64_t merged_vertices = 0;  ///< of the visual mesh, at equal positions
  std::int64_t unused_vertices = 0;  ///< of the visual mesh, left out
  std::int64_t input_vertices = 0;   ///< of the visual mesh, after welding
  std::int64_t input_triangles = 0;
  std::int64_t visual_vertices = 0;  ///< after re-meshing
  std::int64_t visual_triangles = 0;
  std::int64_t inserted_points = 0;  ///< bound points that became new vertices
  std::int64_t snapped_points = 0;   ///< bound points that took an existing vertex
  std::int64_t paths = 0;
  std::int64_t rim_followed = 0;     ///< rim paths that follow the mid-surface instead of the shortest way
  std::int64_t divided_edges = 0;    ///< edges split because they joined two vertices of one path
  std::int64_t led_vertices = 0;     ///< border vertices of the collision mesh that were led to the rim
  std::int64_t crossed_normals = 0;  ///< visual vertices where the normals of the collision mesh cross
  std::int64_t upright_patches =
      0;  ///< patches whose parameters are those of the surface as it stands, not as squashed
  std::int64_t uniform_patches = 0;  ///< patches parametrised with uniform weights
  bool upright =
      false;  ///< a closed body is bound on the surface as it stands: asked for, or paths or patches failed on the squashed one
  Displacement displacement;                   ///< of the result; measured again when a file is read; closed only
  double path_length = 0;                      ///< metres
  double area_before = 0, area_after = 0;      ///< metres^2
  double volume_before = 0, volume_after = 0;  ///< metres^3, closed only
  struct Seconds {
    double prepare = 0;     ///< weld, checks, half-edges, box tree
    double vertices = 0;    ///< bound points
    double paths = 0;       ///< geodesics and re-meshing
    double patches = 0;     ///< flood fill and verification
    double parameters = 0;  ///< mean value coordinates
    double assemble = 0;    ///< the cell complex
    double total = 0;
  } seconds;
  std::vector<std::string> warnings;  ///< one sentence each
};

struct BoundBody {
  CellComplex complex;
  BindReport report;
};

/// Binds `visual` to `collision`: bound vertices (4.1.1), paths (4.1.2), re-meshing that leaves the surface geometrically identical (4.1.3),
/// parameters (4.1.4), verification that every patch is a disc. Lips of slits are drawn back for all that (lips.h) and put together in the end. Paths and parameters of closed bodies are found on the surface squashed onto
/// the collision mesh, whose border is led to the rim. Visual vertices keep their ids (after merging equal positions), new
/// ones follow. Closed or open is derived from the visual mesh; the visual mesh itself may be the collision mesh.
///
/// Bad input gets an error that names the element: meshes that are no oriented manifolds, triangles without area, coordinates that are
/// not finite, borders that do not correspond, a collision mesh in several pieces, folded, or outside the visual mesh.
/// O((V + crossings) log V) apart from the systems (about V^1.5 per patch).
Result<BoundBody> bind(const TriangleMesh& visual, const TriangleMesh& collision, const BindOptions& options);

}  // namespace kerf
