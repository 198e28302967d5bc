#include "kerf/session/body_build.h"

#include "kerf/lattice/lattice_build.h"
#include "kerf/scene/scene_lattice.h"

namespace kerf {

Result<Body> build_body(CellComplex bound, const SceneLattice& lattice, const std::optional<LatticeHint>& hint,
                        const Progress& progress) {
  auto frame = scene_lattice(lattice, hint, bound.collision);
  if (!frame) return frame.error();
  LatticeBody body;
  body.first = RootId(0);
  body.volume = body_volume(bound);
  body.frame = *frame;
  return build_body(std::move(bound), std::vector{body}, progress);
}

Result<Body> build_body(CellComplex bound, std::vector<LatticeBody> bodies, const Progress& progress) {
  Body body;
  body.complex = std::move(bound);
  KERF_TRY(progress("hexahedra", 0));
  auto hex = build_lattice(body.complex.collision, std::move(bodies));
  if (!hex) return hex.error();
  body.hex = std::move(*hex);
  KERF_TRY(progress("hexahedra", 0.5));
  KERF_TRY(embed_all(body.complex, body.hex, body.embedding));
  std::vector<VisualTriangle> all;
  all.reserve(body.complex.visual.face_count());
  for (const VisualTriangle f : ids<VisualTriangle>(body.complex.visual.face_count())) all.push_back(f);
  update_render_surface(body.complex.visual, all, body.surface);
  KERF_TRY(progress("hexahedra", 1));
  return body;
}

double body_volume(const CellComplex& complex) {
  double volume = 0;
  if (complex.closed) {
    const VisualMesh& mesh = complex.visual;
    for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count())) {
      const VisualHalfEdge h = VisualMesh::corner(f, 0);
      volume += dot(mesh.rest[mesh.from(h)], cross(mesh.rest[mesh.to(h)], mesh.rest[mesh.apex(h)])) / 6;
    }
    return volume;
  }
  // An open sheet: area times thickness, triangle by triangle.
  const CollisionMesh& mesh = complex.collision;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const CollisionHalfEdge h = CollisionMesh::corner(f, 0);
    const CollisionVertex v[3] = {mesh.from(h), mesh.to(h), mesh.apex(h)};
    const double area = 0.5 * norm(cross(mesh.rest[v[1]] - mesh.rest[v[0]], mesh.rest[v[2]] - mesh.rest[v[0]]));
    volume += area * 2 * (norm(mesh.offset[v[0]]) + norm(mesh.offset[v[1]]) + norm(mesh.offset[v[2]])) / 3;
  }
  return volume;
}

}  // namespace kerf
