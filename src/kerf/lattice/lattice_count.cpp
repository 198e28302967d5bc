#include "kerf/lattice/lattice_count.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/lattice/prism.h"

namespace kerf {
namespace {

/// Areas of a triangle seen along the three axes, together.
double seen(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 n = cross(b - a, c - a);
  return 0.5 * (std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z));
}

}  // namespace

std::size_t count_material_cells(const CollisionMesh& mesh, const LatticeFrame& frame) {
  std::vector<PrismCorners> corners;
  corners.reserve(mesh.vertex_count());
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
    corners.push_back(corners_of(mesh, frame, v));
  const auto at = [&](CollisionHalfEdge h) -> const PrismCorners& { return corners[mesh.from(h).index()]; };
  double cells = 1;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    const CollisionHalfEdge h[3] = {CollisionMesh::corner(t, 0), CollisionMesh::corner(t, 1),
                                    CollisionMesh::corner(t, 2)};
    cells += std::fabs(ruled_volume(prism_between(at(h[0]), at(h[1]), at(h[2]))));
    // Each direction sees one of the two sides: half of both.
    cells += 0.5 *
             (seen(at(h[0]).minus, at(h[1]).minus, at(h[2]).minus) + seen(at(h[0]).plus, at(h[1]).plus, at(h[2]).plus));
    for (int i = 0; i < 3; ++i) {
      if (mesh.twin[h[i]].valid()) continue;
      const PrismCorners &a = at(h[i]), &b = at(h[(i + 1) % 3]);
      cells += 0.5 * (seen(a.minus, b.minus, b.plus) + seen(a.minus, b.plus, a.plus));
    }
  }
  const auto all = static_cast<double>(frame.cell_count());
  return static_cast<std::size_t>(std::isfinite(cells) ? std::min(cells, all) : all);
}

}  // namespace kerf
