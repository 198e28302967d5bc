#include "kerf/binding/displacement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kerf/base/indexed.h"
#include "kerf/base/parallel.h"
#include "kerf/binding/parameters_in.h"

namespace kerf {
namespace {

struct Sum {
  double area = 0, displaced = 0, largest = 0;
};

/// Adds one face: a third of its area for each of its corners.
void add(const CellComplex& body, VisualTriangle f, Sum& sum) {
  const CollisionMesh& c = body.collision;
  const VisualMesh& m = body.visual;
  const CollisionTriangle t(m.patch[f].root().value);
  std::array<double, 3> off;
  Vec3 upright;
  for (int k = 0; k < 3; ++k) {
    const VisualHalfEdge corner = VisualMesh::corner(f, k);
    const auto weights = parameters_in(body, corner, t);
    Vec3 place, line;
    for (int i = 0; i < 3; ++i) {
      const CollisionVertex v = c.from(CollisionMesh::corner(t, i));
      place += weights[static_cast<std::size_t>(i)] * c.rest[v];
      line += weights[static_cast<std::size_t>(i)] * c.offset[v];
    }
    if (!(norm(line) > 0)) return;
    line = normalized(line);
    upright += line;
    off[static_cast<std::size_t>(k)] = norm(cross(m.rest[m.from(corner)] - place, line));
  }
  const Vec3 a = m.rest[m.from(VisualMesh::corner(f, 0))], b = m.rest[m.from(VisualMesh::corner(f, 1))], d = m.rest[m.from(VisualMesh::corner(f, 2))];
  const Vec3 normal = cross(b - a, d - a);
  const double area = 0.5 * norm(normal);
  if (!(std::fabs(dot(normal, upright)) > 0.5 * norm(normal) * norm(upright))) return;
  sum.area += area;
  for (const double x : off) {
    sum.displaced += area / 3 * x;
    sum.largest = std::max(sum.largest, x);
  }
}

}  // namespace

Displacement measure_displacement(const CellComplex& body) {
  // Sums of blocks, added in order.
  constexpr std::size_t kBlock = 1024, kBlocks = 32;  // so many at a time
  const std::size_t faces = body.visual.face_count();
  std::vector<Sum> blocks((faces + kBlock - 1) / kBlock);
  parallel_for(blocks.size(), kBlocks, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t f = i * kBlock; f < std::min(faces, (i + 1) * kBlock); ++f) add(body, VisualTriangle(f), blocks[i]);
  });
  Sum all;
  for (const Sum& block : blocks) {
    all.area += block.area;
    all.displaced += block.displaced;
    all.largest = std::max(all.largest, block.largest);
  }
  const double edge = body.mean_root_edge;
  return {all.area > 0 ? all.displaced / (all.area * edge) : 0, all.largest / edge};
}

}  // namespace kerf
