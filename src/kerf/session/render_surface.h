// The visual mesh as it is drawn. A visual vertex that lies on the skin and on walls has one render vertex for the skin
// and one per wall, so that every cut surface has normals of its own; texture seams need none (textures are solid, and
// files carry them per corner). Kept up to date locally after a cut, and journaled, so that undo takes it back too.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/base/journal.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/embedding/embedding.h"
#include "kerf/lattice/hex_mesh.h"

namespace kerf {

struct RenderTag;
using RenderVertex = Id<RenderTag>;

struct RenderSurface {
  Journaled<RenderVertex, VisualVertex> vertex;    ///< where it is
  Journaled<RenderVertex, Patch> patch;            ///< a wall, or any skin patch (then it serves the whole skin)
  Journaled<RenderVertex, Vec3f> normal;           ///< at rest, unit
  Journaled<VisualVertex, RenderVertex> skin;      ///< none until a skin triangle uses the vertex
  Journaled<VisualHalfEdge, RenderVertex> corner;  ///< of every corner of every visual triangle

  template <class Fn>
  void for_each_array(Fn&& f) {
    f(vertex);
    f(patch);
    f(normal);
    f(skin);
    f(corner);
  }
  [[nodiscard]] std::size_t size() const { return vertex.size(); }
};

/// Brings the surface up to date with the visual triangles in `changed` (new ones included, in any order, repeats
/// allowed). Call it once with all triangles at the start. Local cost.
void update_render_surface(const VisualMesh& mesh, std::span<const VisualTriangle> changed, RenderSurface& surface);

/// Deformed render vertices: metres and unit normals (cofactor of the deformation gradient), |surface| each.
void evaluate_render_surface(const RenderSurface& surface, const VisualMesh& mesh, const HexMesh& hex,
                             const Embedding& embedding, std::span<const Vec3> node_positions,
                             std::vector<Vec3f>& positions, std::vector<Vec3f>& normals);

}  // namespace kerf
