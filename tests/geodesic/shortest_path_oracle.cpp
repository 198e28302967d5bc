#include "shortest_path_oracle.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_shortest_path.h>

#include <numeric>

namespace kerf::test {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Traits = CGAL::Surface_mesh_shortest_path_traits<Kernel, Mesh>;
using ShortestPath = CGAL::Surface_mesh_shortest_path<Traits>;

}  // namespace

CutOpen::CutOpen(const WalledSurface& m) {
  std::vector<std::int32_t> root(m.origin.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::int32_t h) {
    while (root[std::size_t(h)] != h) h = root[std::size_t(h)] = root[std::size_t(root[std::size_t(h)])];
    return h;
  };
  for (std::int32_t h = 0; h < std::int32_t(m.origin.size()); ++h) {
    const std::int32_t o = m.opposite(h);
    if (o < 0 || m.wall[std::size_t(h)] != 0) continue;
    root[std::size_t(find(h))] = find(WalledSurface::next(o));
    root[std::size_t(find(WalledSurface::next(h)))] = find(o);
  }
  vertex.resize(m.origin.size());
  std::vector<std::int32_t> number(m.origin.size(), -1);
  for (std::int32_t h = 0; h < std::int32_t(m.origin.size()); ++h) {
    std::int32_t& n = number[std::size_t(find(h))];
    if (n < 0) {
      n = std::int32_t(position.size());
      position.push_back(m.at(m.from(h)));
    }
    vertex[std::size_t(h)] = n;
  }
}

std::vector<double> exact_distances(const WalledSurface& m, const CutOpen& cut, std::int32_t s) {
  std::vector<std::int32_t> all(cut.position.size());
  std::iota(all.begin(), all.end(), 0);
  return exact_distances_to(m, cut, s, all);
}

std::vector<double> exact_distances_to(const WalledSurface& m, const CutOpen& cut, std::int32_t s,
                                       const std::vector<std::int32_t>& targets) {
  Mesh mesh;
  for (Vec3 p : cut.position) mesh.add_vertex({p.x, p.y, p.z});
  for (std::size_t h = 0; h < m.origin.size(); h += 3)
    mesh.add_face(Mesh::Vertex_index(unsigned(cut.vertex[h])), Mesh::Vertex_index(unsigned(cut.vertex[h + 1])),
                  Mesh::Vertex_index(unsigned(cut.vertex[h + 2])));
  ShortestPath paths(mesh);
  paths.add_source_point(Mesh::Vertex_index(unsigned(s)));
  std::vector<double> distances;
  for (const std::int32_t v : targets)
    distances.push_back(paths.shortest_distance_to_source_points(Mesh::Vertex_index(unsigned(v))).first);
  return distances;
}

}  // namespace kerf::test
