#include "kerf/scene/scene_lattice.h"

#include <fmt/format.h>

#include <cmath>

#include "kerf/base/indexed.h"
#include "kerf/lattice/lattice_tolerances.h"
#include "kerf/lattice/prism.h"

namespace kerf {
namespace {

constexpr double kFlat = 3;            // box over body thickness: more is bent
constexpr double kStickingOut = 1e-6;  // of a cell: a body may stick out of a given lattice by rounding only

/// Box of the prisms (rest positions plus and minus offset) along the axes.
Box3 prism_box(const CollisionMesh& mesh, const Mat3& axes) {
  Box3 box;
  for (CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) {
    box.add(transposed_times(axes, mesh.rest[v] + mesh.offset[v]));
    box.add(transposed_times(axes, mesh.rest[v] - mesh.offset[v]));
  }
  return box;
}

LatticeOptions given(Vec3 origin, const Mat3& axes, Vec3 cell, LatticeIndex count) {
  LatticeOptions options;
  options.given = true;
  options.origin = origin;
  options.axes = axes;
  options.cell = cell;
  options.count = count;
  return options;
}

/// A model's own lattice, stretched where the body reaches past it: bends, bumps and noise move its surface.
LatticeOptions around(const LatticeHint& hint, const Box3& body) {
  Vec3 origin = hint.origin, cell = hint.cell;
  for (int i = 0; i < 3; ++i) {
    const int count = hint.cells[static_cast<std::size_t>(i)];
    const double low = origin[i], high = low + count * cell[i], slack = kStickingOut * cell[i];
    if (body.min[i] >= low - slack && body.max[i] <= high + slack) continue;
    origin[i] = std::fmin(low, body.min[i]);
    cell[i] = (std::fmax(high, body.max[i]) - origin[i]) / count;
  }
  return given(origin, Mat3{}, cell, {hint.cells[0], hint.cells[1], hint.cells[2]});
}

/// Mean over the vertices, metres.
double mean_thickness(const CollisionMesh& mesh) {
  double sum = 0;
  for (CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) sum += 2 * norm(mesh.offset[v]);
  return sum / static_cast<double>(mesh.vertex_count());
}

/// Extent of the lattice along the axis with a single cell.
double thinnest(Vec3 cell, const LatticeIndex& count) {
  double out = HUGE_VAL;
  for (int i = 0; i < 3; ++i)
    if (count[static_cast<std::size_t>(i)] == 1) out = std::fmin(out, cell[i]);
  return out;
}

/// Refuses a frame that does not hold the whole body.
Result<LatticeFrame> holding(const CollisionMesh& mesh, const Result<LatticeFrame>& frame) {
  if (!frame.ok()) return frame;
  for (CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) {
    for (double side : {1.0, -1.0}) {
      const Vec3 p = mesh.rest[v] + side * mesh.offset[v];
      const Vec3 q = frame->to_lattice(p);
      for (int i = 0; i < 3; ++i) {
        if (q[i] >= -kStickingOut && q[i] <= frame->count[static_cast<std::size_t>(i)] + kStickingOut) continue;
        const Box3 box = prism_box(mesh, frame->axes);
        return bad_input(
            fmt::format("[lattice]: the body sticks out of the lattice at ({:.6g}, {:.6g}, {:.6g}); along "
                        "the lattice's axes the body reaches from ({:.6g}, "
                        "{:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})",
                        p.x, p.y, p.z, box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z));
      }
    }
  }
  return frame;
}

/// Refuses cells that are far larger than the body. `sized`: their size was given, not their number.
Result<LatticeFrame> filled(const CollisionMesh& mesh, const Result<LatticeFrame>& frame, bool sized) {
  if (!frame.ok()) return frame;
  double fill = 0;
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count()))
    fill += ruled_volume(prism_between(corners_of(mesh, *frame, mesh.origin[CollisionMesh::corner(f, 0)]),
                                       corners_of(mesh, *frame, mesh.origin[CollisionMesh::corner(f, 1)]),
                                       corners_of(mesh, *frame, mesh.origin[CollisionMesh::corner(f, 2)])));
  if (fill >= kLeastFill) return frame;
  const Vec3 cell = frame->cell, body = prism_box(mesh, frame->axes).size();
  return bad_input(fmt::format(
      "[lattice]: {} makes cells of {:.4g} x {:.4g} x {:.4g} m, but the body is {:.4g} x {:.4g} x {:.4g} m along "
      "their axes and fills {:.2g} of one, where {:g} is the least; {}",
      sized ? "cell_size" : "cells", cell.x, cell.y, cell.z, body.x, body.y, body.z, fill, kLeastFill,
      sized ? "make the cells no larger than the body" : "ask for more cells"));
}

}  // namespace

Result<LatticeFrame> scene_lattice(const SceneLattice& wanted, const std::optional<LatticeHint>& hint,
                                   const CollisionMesh& mesh) {
  LatticeOptions automatic;
  automatic.layers = wanted.layers.value_or(1);
  if (!wanted.cells && !wanted.cell_size) {
    if (wanted.layers) return choose_lattice(mesh, automatic);
    if (!hint) {
      // One layer of cells suits a flat body. A bent one's box is much thicker than the body: cells near cubes then.
      Result<LatticeFrame> flat = choose_lattice(mesh, automatic);
      if (!flat.ok() || thinnest(flat->cell, flat->count) <= kFlat * mean_thickness(mesh)) return flat;
      automatic.layers = 0;
      return choose_lattice(mesh, automatic);
    }
    return choose_lattice(mesh, around(*hint, prism_box(mesh, Mat3{})));
  }
  Mat3 axes;
  if (wanted.axes) {
    axes.c = *wanted.axes;
  } else if (!wanted.origin) {
    Result<LatticeFrame> chosen = choose_lattice(mesh, automatic);
    if (!chosen.ok()) return chosen;
    axes = chosen->axes;
  }
  LatticeIndex count{};
  if (wanted.cells) count = {(*wanted.cells)[0], (*wanted.cells)[1], (*wanted.cells)[2]};
  if (wanted.origin && wanted.cells && wanted.cell_size) {
    return filled(mesh, holding(mesh, choose_lattice(mesh, given(*wanted.origin, axes, *wanted.cell_size, count))),
                  true);
  }
  const Box3 box = prism_box(mesh, axes);
  if (box.empty()) return bad_input("[lattice]: the body is empty");
  Vec3 cell, low = box.min;
  const Vec3 size = box.size();
  for (int i = 0; i < 3; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    if (wanted.cells) {
      cell[i] = size[i] / count[k];
      continue;
    }
    cell[i] = (*wanted.cell_size)[i];
    const double n = std::ceil(size[i] / cell[i] - kStickingOut);
    if (!(n < 1e6))
      return bad_input(
          fmt::format("[lattice]: cell_size makes {:.6g} cells along axis {}; make the cells larger", n, i + 1));
    count[k] = n < 1 ? 1 : static_cast<std::int32_t>(n);
    low[i] -= 0.5 * (count[k] * cell[i] - size[i]);  // the body in the middle
  }
  return filled(mesh, choose_lattice(mesh, given(axes * low, axes, cell, count)), wanted.cell_size.has_value());
}

}  // namespace kerf
