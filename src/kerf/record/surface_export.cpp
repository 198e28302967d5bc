#include "kerf/record/surface_export.h"

namespace kerf {
namespace {

template <class Mesh>
TriangleMesh plain_surface(const Mesh& mesh, std::span<const Vec3> positions) {
  KERF_ASSERT(positions.empty() || positions.size() == mesh.vertex_count());
  TriangleMesh out;
  out.positions.reserve(mesh.vertex_count());
  if (positions.empty()) out.positions = IndexedArray<VertexId, Vec3>(mesh.rest.raw());
  else out.positions = IndexedArray<VertexId, Vec3>(std::vector<Vec3>(positions.begin(), positions.end()));
  out.triangles.reserve(mesh.face_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    std::array<VertexId, 3> corners;
    for (int i = 0; i < 3; ++i)
      corners[static_cast<std::size_t>(i)] = VertexId(mesh.origin[Mesh::corner(typename Mesh::F(f), i)].value);
    out.triangles.push_back(corners);
  }
  return out;
}

}  // namespace

std::vector<std::string> surface_group_names() { return {"skin", "cut"}; }

TriangleMesh visual_surface(const CellComplex& complex, std::span<const Vec3> positions) {
  const VisualMesh& mesh = complex.visual;
  TriangleMesh out = plain_surface(mesh, positions);
  out.texture.reserve(mesh.face_count());
  out.group.reserve(mesh.face_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const VisualTriangle face(f);
    out.texture.push_back({mesh.texture[VisualMesh::corner(face, 0)], mesh.texture[VisualMesh::corner(face, 1)],
                           mesh.texture[VisualMesh::corner(face, 2)]});
    out.group.push_back(mesh.patch[face].is_wall() ? kCutGroup : kSkinGroup);
  }
  return out;
}

TriangleMesh collision_surface(const CellComplex& complex, std::span<const Vec3> positions) {
  return plain_surface(complex.collision, positions);
}

}  // namespace kerf
