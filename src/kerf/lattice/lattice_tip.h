// Tips of slits inside a cell, and how their cells are split as if the slit ran on to the far face (4.2.1).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "kerf/lattice/hex_mesh.h"
#include "kerf/lattice/lattice_tolerances.h"

namespace kerf {

/// Is v the tip of a slit: a border vertex whose two border edges are the two lips of one cut?
bool is_tip(const CollisionMesh& mesh, CollisionVertex v);

/// A tip and the cells that its line through the thickness passes, brought up to date. Calls touch(cell) for every cell
/// whose split may have changed. Returns whether there was or is any.
template <class Touch>
bool update_tip(const CollisionMesh& mesh, HexMesh& hex, CollisionVertex v, Touch&& touch);

/// Where the continuation crosses an edge.
struct TipCrossing {
  CollisionHalfEdge edge;  ///< from the right to the left of it
  double t = 0;            ///< share of the edge
};
/// A triangle that the continuation passes through.
struct SplitTriangle {
  CollisionTriangle triangle;
  TipId tip;
  std::array<std::int8_t, 3> edge_side{};  ///< +1: edge on the left, -1 on the right, 0 crossed
};

/// Follows the continuation of a slit from its tip, triangle by triangle, in the plane of `tip`. Asks may_enter(triangle)
/// before it enters one, and reports on_split(split, exit crossing or null). Where it runs along an edge it asks
/// in_reach(edge), and reports on_along(edge), which may refuse to go on. Ends at borders.
template <class MayEnter, class InReach, class OnSplit, class OnAlong>
void continue_tip(const CollisionMesh& mesh, const HexMesh& hex, const TipCell& tip, MayEnter&& may_enter,
                  InReach&& in_reach, OnSplit&& on_split, OnAlong&& on_along);

// ---- implementation

/// The cells that a tip's line passes, with everything but their links filled in. Appends at most 8 to out.
struct TipCells {
  std::array<TipCell, 8> items;
  std::size_t count = 0;
};
TipCells cells_of_tip(const CollisionMesh& mesh, const HexMesh& hex, CollisionVertex v);

template <class Touch>
bool update_tip(const CollisionMesh& mesh, HexMesh& hex, CollisionVertex v, Touch&& touch) {
  const TipId first = hex.vertex_tip[v];
  if (!first.valid() && !is_tip(mesh, v)) return false;
  TipCells now;
  if (is_tip(mesh, v)) now = cells_of_tip(mesh, hex, v);
  bool any = now.count > 0;
  for (TipId t = first; t.valid(); t = hex.tips[t].next_of_vertex) {  // out of the lists of their cells
    TipCell record = hex.tips[t];
    if (!record.active) continue;
    any = true;
    touch(record.cell);
    TipId before = hex.first_tip[record.cell];
    if (before == t) {
      hex.first_tip.set(record.cell, record.next_in_cell);
    } else {
      while (hex.tips[before].next_in_cell != t) before = hex.tips[before].next_in_cell;
      TipCell p = hex.tips[before];
      p.next_in_cell = record.next_in_cell;
      hex.tips.set(before, p);
    }
    record.active = false;
    hex.tips.set(t, record);
  }
  TipId t = first, last;
  for (std::size_t i = 0; i < now.count; ++i) {
    TipCell record = now.items[i];
    touch(record.cell);
    record.active = true;
    record.next_in_cell = hex.first_tip[record.cell];
    if (t.valid()) {  // an old slot of this vertex
      record.next_of_vertex = hex.tips[t].next_of_vertex;
      hex.tips.set(t, record);
    } else {
      t = hex.tips.push_back(record);
      if (last.valid()) {
        TipCell p = hex.tips[last];
        p.next_of_vertex = t;
        hex.tips.set(last, p);
      } else {
        hex.vertex_tip.set(v, t);
      }
    }
    hex.first_tip.set(record.cell, t);
    last = t;
    t = record.next_of_vertex;
  }
  return any;
}

template <class MayEnter, class InReach, class OnSplit, class OnAlong>
void continue_tip(const CollisionMesh& mesh, const HexMesh& hex, const TipCell& tip, MayEnter&& may_enter,
                  InReach&& in_reach, OnSplit&& on_split, OnAlong&& on_along) {
  using H = CollisionHalfEdge;
  auto middle = [&](CollisionVertex v) {
    const PrismCorners& c = hex.prism_corner[v];
    return 0.5 * (c.minus + c.plus);
  };
  auto height = [&](CollisionVertex v) { return dot(tip.normal, middle(v) - tip.point); };
  auto split_of = [](H h, int side, int next, int prev) {
    SplitTriangle s;
    s.triangle = CollisionMesh::face(h);
    s.edge_side[static_cast<std::size_t>(h.value % 3)] = static_cast<std::int8_t>(side);
    s.edge_side[static_cast<std::size_t>(CollisionMesh::next(h).value % 3)] = static_cast<std::int8_t>(next);
    s.edge_side[static_cast<std::size_t>(CollisionMesh::prev(h).value % 3)] = static_cast<std::int8_t>(prev);
    return s;
  };
  auto crossing = [&](H e) {
    const double a = height(mesh.from(e)), b = height(mesh.to(e));
    const double t = a != b ? a / (a - b) : 0.5;
    return TipCrossing{e, std::clamp(t, kCrossingMargin, 1 - kCrossingMargin)};
  };
  constexpr int kMostSteps = 4096;  // ends by itself; a bound all the same
  CollisionVertex v = tip.vertex;
  for (int steps = 0; steps < kMostSteps;) {
    // From a vertex: along an edge, or into the triangle whose wedge holds the direction.
    H along, into;
    const Vec3 p = middle(v);
    mesh.for_each_outgoing(v, [&](H h) {
      const Vec3 a = middle(mesh.to(h)) - p;
      const double ha = dot(tip.normal, a), hb = dot(tip.normal, middle(mesh.apex(h)) - p);
      if (std::fabs(ha) <= kAlongEdge * norm(a) && dot(tip.direction, a) > 0) along = h;
      else if (ha < 0 && hb > 0 && !into.valid()) into = h;
      return true;
    });
    if (along.valid()) {
      if (mesh.is_border(along) || !in_reach(along) || !on_along(along)) return;
      v = mesh.to(along);
      ++steps;
      continue;
    }
    if (!into.valid() || !may_enter(CollisionMesh::face(into))) return;
    TipCrossing exit = crossing(CollisionMesh::next(into));
    on_split(split_of(into, -1, 0, 1), &exit);
    bool at_vertex = false;
    while (!at_vertex && steps++ < kMostSteps) {
      const H g = mesh.twin[exit.edge];  // from left to right
      if (!g.valid() || !may_enter(CollisionMesh::face(g))) return;
      const CollisionVertex w = mesh.apex(g);
      const Vec3 a = middle(w) - tip.point;
      const double hw = dot(tip.normal, a);
      if (std::fabs(hw) <= kAlongEdge * norm(a)) {
        on_split(split_of(g, 0, -1, 1), nullptr);
        v = w;
        at_vertex = true;
      } else if (hw > 0) {
        exit = crossing(CollisionMesh::next(g));
        on_split(split_of(g, 0, 0, 1), &exit);
      } else {
        exit = crossing(CollisionMesh::prev(g));
        on_split(split_of(g, 0, -1, 0), &exit);
      }
    }
  }
}

}  // namespace kerf
