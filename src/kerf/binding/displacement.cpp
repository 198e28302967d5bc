#include "kerf/binding/displacement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "kerf/base/parallel.h"
#include "kerf/binding/parameters_in.h"
#include "kerf/binding/tolerances.h"

namespace kerf {
namespace {

struct Part {
  double area = 0, sum = 0, largest = 0;
};

void add_face(const CellComplex& x, VisualTriangle face, Part& part) {
  const VisualMesh& v = x.visual;
  const CollisionMesh& c = x.collision;
  const CollisionTriangle t(v.patch[face].root().value);  // no cut yet: triangles are their own roots
  std::array<Vec3, 3> place, rest, offset;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto corner = static_cast<int>(k);
    place[k] = v.rest[v.from(VisualMesh::corner(face, corner))];
    rest[k] = c.rest[c.from(CollisionMesh::corner(t, corner))];
    offset[k] = c.offset[c.from(CollisionMesh::corner(t, corner))];
  }
  const Vec3 area = cross(place[1] - place[0], place[2] - place[0]);
  const Vec3 flat = cross(rest[1] - rest[0], rest[2] - rest[0]);
  if (!(std::fabs(dot(area, flat)) > kDrawnCosine * norm(area) * norm(flat))) return;
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto w = parameters_in(x, VisualMesh::corner(face, static_cast<int>(k)), t);
    // Relative to a corner: a far origin must not cost digits.
    Vec3 off = place[k] - rest[0] - (w[1] * (rest[1] - rest[0]) + w[2] * (rest[2] - rest[0]));
    Vec3 n = normalized(w[0] * offset[0] + w[1] * offset[1] + w[2] * offset[2]);
    if (n == Vec3{}) n = normalized(flat);
    off = off - dot(off, n) * n;
    part.largest = std::max(part.largest, norm(off));
    sum += norm(off) / 3;
  }
  part.area += norm(area);
  part.sum += norm(area) * sum;
}

}  // namespace

Displacement measure_displacement(const CellComplex& x) {
  constexpr std::size_t kBlock = 1024, kBlocks = 32;  // so many at a time
  const std::size_t faces = x.visual.face_count();
  std::vector<Part> blocks((faces + kBlock - 1) / kBlock);
  parallel_for(blocks.size(), kBlocks, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t f = i * kBlock; f < std::min(faces, (i + 1) * kBlock); ++f)
        add_face(x, VisualTriangle(f), blocks[i]);
  });
  Part total;
  for (const Part& b : blocks) {
    total.area += b.area;
    total.sum += b.sum;
    total.largest = std::max(total.largest, b.largest);
  }
  if (!(total.area > 0)) return {};
  return {total.sum / total.area / x.mean_root_edge, total.largest / x.mean_root_edge};
}

}  // namespace kerf
