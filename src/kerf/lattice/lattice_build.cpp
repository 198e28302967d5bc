#include "kerf/lattice/lattice_build.h"

#include <fmt/format.h>

#include <cmath>

#include "kerf/base/at.h"
#include "kerf/lattice/lattice_adapt.h"

namespace kerf {
namespace {

/// Gives the bodies' cells and corners indices and numbers of their own.
Status lay_side_by_side(std::vector<LatticeBody>& bodies) {
  std::size_t cells = 0, corners = 0;
  std::int32_t x = 0;
  for (LatticeBody& body : bodies) {
    const LatticeIndex n = body.frame.count;
    const std::size_t own = n[0] > 0 && n[1] > 0 && n[2] > 0 ? body.frame.cell_count() : 0;
    if (own == 0 || own > kMaxLatticeCells - cells)
      return bad_input(fmt::format("lattice: {} x {} x {} cells can't be used", n[0], n[1], n[2]));
    body.frame.first = {x, 0, 0};
    body.first_cell = CellId(cells);
    body.first_corner = static_cast<std::int32_t>(corners);
    cells += own;
    corners += (at(n[0]) + 1) * (at(n[1]) + 1) * (at(n[2]) + 1);
    x += n[0] + 1;
  }
  return {};
}

}  // namespace

Result<HexMesh> build_lattice(const CollisionMesh& mesh, const LatticeFrame& frame, double volume) {
  LatticeBody body;
  body.first = RootId(0);
  body.volume = volume;
  body.frame = frame;
  return build_lattice(mesh, {body});
}

Result<HexMesh> build_lattice(const CollisionMesh& mesh, std::vector<LatticeBody> bodies) {
  if (mesh.face_count() == 0) return bad_input("lattice: the collision mesh has no triangles");
  for (const LatticeBody& body : bodies)
    if (!(body.volume >= 0) || !std::isfinite(body.volume))
      return bad_input(fmt::format("lattice: a body can't have the volume {}", body.volume));

  HexMesh hex;
  hex.bodies = std::move(bodies);
  KERF_TRY(lay_side_by_side(hex.bodies));
  const std::size_t cells = hex.cell_count();
  hex.first_copy.grow(cells);
  hex.members.grow(cells);
  hex.first_tip.grow(cells);
  hex.links.grow(3 * cells);

  constexpr double kOutside = 1e-6;  // cells: rounding of a frame computed elsewhere
  std::vector<PrismCorners> corners;
  corners.reserve(mesh.vertex_count());
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) {
    const LatticeFrame& frame = frame_around(mesh, hex, v);
    const PrismCorners c = corners_of(mesh, frame, v);
    for (const Vec3& p : {c.minus, c.plus})
      for (int a = 0; a < 3; ++a)
        if (!(p[a] >= frame.first[at(a)] - kOutside && p[a] <= frame.first[at(a)] + frame.count[at(a)] + kOutside))
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
    prisms[i] *= hex.bodies[i].frame.cell_volume();
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
