#include "kerf/lattice/lattice_build.h"

#include <fmt/format.h>

#include <cmath>

#include "kerf/lattice/lattice_adapt.h"

namespace kerf {

Result<HexMesh> build_lattice(const CollisionMesh& mesh, const LatticeFrame& frame, double volume) {
  return build_lattice(mesh, frame, std::vector<LatticeBody>{{RootId(0), volume, 1}});
}

Result<HexMesh> build_lattice(const CollisionMesh& mesh, const LatticeFrame& frame, std::vector<LatticeBody> bodies) {
  if (mesh.face_count() == 0) return bad_input("lattice: the collision mesh has no triangles");
  if (frame.cell_count() == 0 || frame.cell_count() > kMaxLatticeCells)
    return bad_input(
        fmt::format("lattice: {} x {} x {} cells can't be used", frame.count[0], frame.count[1], frame.count[2]));
  for (const LatticeBody& body : bodies)
    if (!(body.volume >= 0) || !std::isfinite(body.volume))
      return bad_input(fmt::format("lattice: a body can't have the volume {}", body.volume));

  HexMesh hex;
  hex.frame = frame;
  hex.bodies = std::move(bodies);
  hex.first_copy.grow(frame.cell_count());
  hex.members.grow(frame.cell_count());
  hex.first_tip.grow(frame.cell_count());
  hex.links.grow(3 * frame.cell_count());

  constexpr double kOutside = 1e-6;  // cells: rounding of a frame computed elsewhere
  std::vector<PrismCorners> corners;
  corners.reserve(mesh.vertex_count());
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) {
    const PrismCorners c = corners_of(mesh, frame, v);
    for (const Vec3& p : {c.minus, c.plus})
      for (int a = 0; a < 3; ++a)
        if (!(p[a] >= -kOutside && p[a] <= frame.count[static_cast<std::size_t>(a)] + kOutside))
          return bad_input(
              fmt::format("lattice: collision vertex {} (with its thickness) lies outside of the lattice; "
                          "give more cells or another origin",
                          v.value + 1));
    corners.push_back(c);
  }
  std::vector<double> prisms(hex.bodies.size());
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count()))
    prisms[static_cast<std::size_t>(hex.body_of(mesh.root[t]))] +=
        ruled_volume(prism_between(corners[mesh.origin[CollisionMesh::corner(t, 0)].index()],
                                   corners[mesh.origin[CollisionMesh::corner(t, 1)].index()],
                                   corners[mesh.origin[CollisionMesh::corner(t, 2)].index()]));
  for (std::size_t i = 0; i < prisms.size(); ++i) {
    prisms[i] *= frame.cell_volume();
    if (!(prisms[i] > 0)) return bad_input("lattice: the prisms of the body hold no volume; give it a thickness");
    LatticeBody& body = hex.bodies[i];
    if (body.volume > 0) body.scale = body.volume / prisms[i];
    else body.volume = prisms[i];
  }

  std::vector<CollisionTriangle> all;
  all.reserve(mesh.face_count());
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) all.push_back(t);
  LatticeScratch scratch;
  LatticeChange change;
  adapt_lattice(mesh, hex, all, scratch, change);
  return hex;
}

}  // namespace kerf
