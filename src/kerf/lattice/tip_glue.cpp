#include "kerf/lattice/tip_glue.h"

#include <algorithm>
#include <cmath>

#include "kerf/lattice/lattice_tolerances.h"

namespace kerf {
namespace {

/// The copy of a triangle's material on one side of the tip: in the tip's cell, or (a slit in a face of the lattice) in
/// the cell next to it that the slit's other side lies in.
HexId copy_beside(const HexMesh& hex, const TipCell& tip, CollisionTriangle t, int side) {
  if (!t.valid()) return {};
  const LatticeIndex c = hex.index_of(tip.cell);
  HexId best;
  double nearest = HUGE_VAL;
  for (const Piece& p : hex.pieces_of(t)) {
    if (p.side != 0) {
      const TipCell& splitter = hex.tips[p.tip];
      if (splitter.vertex == tip.vertex) {
        if (p.side != side) continue;
      } else if ((dot(splitter.normal, tip.point - splitter.point) >= 0) != (p.side > 0)) {
        continue;  // split by another tip: the part that this tip lies in
      }
    }
    if (p.cell == tip.cell) return p.copy;
    const LatticeIndex d = hex.index_of(p.cell);
    const int steps = std::abs(d[0] - c[0]) + std::abs(d[1] - c[1]) + std::abs(d[2] - c[2]);
    if (steps != 1) continue;
    double distance = 0;  // of the face between from the tip: zero if the slit runs in it
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      if (d[i] != c[i]) distance = std::fabs(tip.point[a] - std::max(c[i], d[i])) + std::fabs(tip.direction[a]);
    }
    if (distance < 1e-6 && distance < nearest) nearest = distance, best = p.copy;
  }
  return best;
}

}  // namespace

TipCopies tip_copies(const HexMesh& hex, TipId id) {
  const TipCell& tip = hex.tips[id];
  if (!tip.active) return {};
  // A slit in a face of the lattice is seen from the cells on both sides: the left one has the say.
  bool left_here = false;
  if (tip.left.valid())
    for (const Piece& p : hex.pieces_of(tip.left)) {
      const bool own = p.side != 0 && hex.tips[p.tip].vertex == tip.vertex;
      left_here = left_here || (p.cell == tip.cell && (!own || p.side > 0));
    }
  if (!left_here) return {};
  return {copy_beside(hex, tip, tip.left, 1), copy_beside(hex, tip, tip.right, -1)};
}

TipCopies copies_of_lips(const HexMesh& hex, CollisionVertex tip, Vec3 rest_point) {
  TipCopies nearest;
  double least = HUGE_VAL;
  for (TipId id = hex.vertex_tip[tip]; id.valid(); id = hex.tips[id].next_of_vertex) {
    const TipCopies copies = tip_copies(hex, id);
    if (!copies.left.valid() || !copies.right.valid()) continue;
    const Vec3 local = hex.local(copies.left, rest_point);
    const double far = std::max({std::fabs(local.x), std::fabs(local.y), std::fabs(local.z)});
    if (!(far < least)) continue;
    least = far;
    nearest = {hex.host[copies.left], hex.host[copies.right]};
  }
  return nearest;
}

void tip_glue(const HexMesh& hex, std::vector<TipGlue>& out) {
  out.clear();
  for (const TipId id : ids<TipId>(hex.tips.size())) {
    const TipCopies copies = tip_copies(hex, id);
    if (!copies.left.valid() || !copies.right.valid() || copies.left == copies.right) continue;
    const TipCell& tip = hex.tips[id];
    const std::size_t first = out.size();
    for (int k = 0; k < 8; ++k)
      for (int l = 0; l < 8; ++l) {
        if (LatticeFrame::corner(hex.cell[copies.left], k) != LatticeFrame::corner(hex.cell[copies.right], l)) continue;
        const NodeId a = hex.nodes[copies.left][static_cast<std::size_t>(k)],
                     b = hex.nodes[copies.right][static_cast<std::size_t>(l)];
        if (a != b && hex.active(a) && hex.active(b)) out.push_back({a, b, copies.left, 0});
      }
    const PrismCorners& corners = hex.prism_corner[tip.vertex];
    Vec3 line = corners.plus - corners.minus;
    const Vec3 cell = hex.frame_of(copies.left).cell;
    double most = -1, thickness = 0;
    for (int a = 0; a < 3; ++a) {
      const double extent = std::fabs(line[a]) * cell[a];
      if (extent > most) most = extent, thickness = cell[a];
    }
    const double total = kTipGlue * thickness * (1 - tip.passed) / tip.passed;
    for (std::size_t i = first; i < out.size(); ++i)
      out[i].stiffness_over_e = total / static_cast<double>(out.size() - first);
  }
}

}  // namespace kerf
