#include "kerf/cutting/crumb.h"

#include <array>

#include "kerf/base/at.h"
#include "kerf/cutting/tolerances.h"

namespace kerf {
namespace {

using F = CollisionTriangle;

/// Puts the faces of a mesh that are joined with `seed` into `faces`, until `more` says no. `seen`: what is in there.
template <class Mesh, class More>
bool flood(const Mesh& mesh, typename Mesh::F seed, DenseIndex& seen, std::vector<typename Mesh::F>& faces,
           More&& more) {
  seen.reset(mesh.face_count());
  faces.assign(1, seed);
  seen.insert(seed.value);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (!more(faces[i])) return false;
    for (int k = 0; k < 3; ++k) {
      const auto t = mesh.twin[Mesh::corner(faces[i], k)];
      if (!t.valid() || seen.find(Mesh::face(t).value) >= 0) continue;
      seen.insert(Mesh::face(t).value);
      faces.push_back(Mesh::face(t));
    }
  }
  return true;
}

}  // namespace

double enclosed_by(const CellComplex& body, F of_piece, CutScratch& scratch) {
  const VisualMesh& mesh = body.visual;
  const CollisionVertex v = body.collision.from(CollisionMesh::corner(of_piece, 0));
  const Vec3 origin = body.collision.rest[v];
  double volume = 0;
  flood(mesh, VisualMesh::face(mesh.outgoing[body.collision.bound[v][0]]), scratch.crumb_seen, scratch.crumb_skin,
        [&](VisualTriangle f) {
          const auto p = [&](int k) { return mesh.rest[mesh.from(VisualMesh::corner(f, k))] - origin; };
          volume += dot(p(0), cross(p(1), p(2))) / 6;
          return true;
        });
  return volume;
}

bool is_in_crumb(const CellComplex& body, std::span<const F> faces, double width, CutScratch& scratch) {
  const CollisionMesh& mesh = body.collision;
  const double edge = body.mean_root_edge, most = cut::kCrumbArea * edge * edge,
               least = cut::kCrumbVolume * edge * edge * edge;
  for (const F seed : faces) {
    double area = 0, border = 0;
    const bool small = flood(mesh, seed, scratch.crumb_seen, scratch.crumb_faces, [&](F f) {
      std::array<Vec3, 3> p;
      for (int k = 0; k < 3; ++k) p[kerf::at(k)] = mesh.rest[mesh.from(CollisionMesh::corner(f, k))];
      area += 0.5 * norm(cross(p[1] - p[0], p[2] - p[0]));
      for (int k = 0; k < 3; ++k)
        if (mesh.is_border(CollisionMesh::corner(f, k))) border += norm(p[kerf::at((k + 1) % 3)] - p[kerf::at(k)]);
      return area <= most;
    });
    if (small && (2 * area < width * border || (body.closed && !(enclosed_by(body, seed, scratch) > least))))
      return true;
  }
  return false;
}

}  // namespace kerf
