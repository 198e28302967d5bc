#include "kerf/mesh/lip_vertices.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/base/at.h"
#include "kerf/mesh/nested_boxes.h"
#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/surface_tolerances.h"

namespace kerf {
namespace {

/// What a lip is made of: a triangle of a closed body, or an edge of a sheet's border.
struct Side {
  std::array<std::int32_t, 3> corners;  // of an edge the last two are the same
  Vec3 direction;                       // unit normal, or along the edge
  [[nodiscard]] bool is_edge() const { return corners[1] == corners[2]; }
  [[nodiscard]] bool has(std::int32_t v) const { return v == corners[0] || v == corners[1] || v == corners[2]; }
};

bool face_each_other(const Side& s, const Side& t) { return dot(s.direction, t.direction) < -kFacingCosine; }

bool lie_on_each_other(const Side& s, const Side& t) {
  return face_each_other(s, t) && norm(cross(s.direction, t.direction)) < kSameAngle;
}

class Sides {
 public:
  Sides(const TriangleMesh& mesh, std::span<const EdgeUse> uses, double near)
      : mesh_(mesh), near_(near), sides_(all(mesh, uses)), boxes_(boxes()), start_(mesh.positions.size() + 1, 0) {
    const auto each = [&](auto&& f) {
      for (std::size_t s = 0; s < sides_.size(); ++s)
        for (std::size_t k = 0; k < (sides_[s].is_edge() ? 2u : 3u); ++k) f(s, at(sides_[s].corners[k]));
    };
    each([&](std::size_t, std::size_t v) { ++start_[v + 1]; });
    for (std::size_t v = 0; v + 1 < start_.size(); ++v) start_[v + 1] += start_[v];
    around_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    each([&](std::size_t s, std::size_t v) { around_[next[v]++] = s; });
  }

  /// Calls f(side) for the sides at a vertex.
  template <class F>
  void for_each_around(std::int32_t v, F&& f) const {
    for (std::size_t i = start_[at(v)]; i < start_[at(v) + 1]; ++i) f(sides_[around_[i]]);
  }

  /// Calls f(side, side, vertex) for sides that meet at an edge, at both of its ends, or at a vertex of the border.
  template <class F>
  void for_each_pair(std::span<const EdgeUse> uses, F&& f) const {
    if (!sides_.front().is_edge()) {
      for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 2) return;
        for (const std::int32_t v : {edge[0].low, edge[0].high})
          f(sides_[at(edge[0].half_edge / 3)], sides_[at(edge[1].half_edge / 3)], v);
      });
      return;
    }
    for (std::size_t v = 0; v + 1 < start_.size(); ++v)
      if (start_[v + 1] - start_[v] == 2)
        f(sides_[around_[start_[v]]], sides_[around_[start_[v] + 1]], static_cast<std::int32_t>(v));
  }

  /// Whether the vertex lies on a side that faces one of its own.
  [[nodiscard]] bool lies_on_another(std::int32_t v) const {
    const Vec3 p = mesh_.positions[VertexId(v)];
    bool found = false;
    boxes_.for_each_around({p, p}, [&](std::size_t i) {
      const Side& other = sides_[i];
      if (found || other.has(v) || !lies_on(p, other)) return;
      for_each_around(v, [&](const Side& own) { found = found || face_each_other(own, other); });
    });
    return found;
  }

 private:
  static std::vector<Side> all(const TriangleMesh& mesh, std::span<const EdgeUse> uses) {
    std::vector<Side> sides;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
      if (edge.size() != 1) return;
      const auto& t = mesh.triangles.raw()[at(edge[0].half_edge / 3)];
      const auto k = at(edge[0].half_edge % 3);
      const VertexId a = t[k], b = t[(k + 1) % 3];
      sides.push_back({{a.value, b.value, b.value}, normalized(mesh.positions[b] - mesh.positions[a])});
    });
    if (!sides.empty()) return sides;
    for (const auto& t : mesh.triangles) {
      const Vec3 a = mesh.positions[t[0]];
      sides.push_back({{t[0].value, t[1].value, t[2].value},
                       normalized(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a))});
    }
    return sides;
  }
  [[nodiscard]] NestedBoxes boxes() const {
    std::vector<NestedBoxes::Item> items;
    const Vec3 margin{near_, near_, near_};
    for (std::size_t s = 0; s < sides_.size(); ++s) {
      Box3 box;
      for (const std::int32_t v : sides_[s].corners) box.add(mesh_.positions[VertexId(v)]);
      items.push_back({{box.min - margin, box.max + margin}, s});
    }
    return NestedBoxes(std::move(items));
  }
  [[nodiscard]] bool lies_on(Vec3 p, const Side& side) const {
    std::array<Vec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) corner[k] = mesh_.positions[VertexId(side.corners[k])];
    if (side.is_edge()) {
      const double along = std::clamp(dot(p - corner[0], side.direction), 0.0, norm(corner[1] - corner[0]));
      return norm(p - (corner[0] + along * side.direction)) <= near_;
    }
    if (std::fabs(dot(p - corner[0], side.direction)) > near_) return false;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 inward = cross(side.direction, normalized(corner[(k + 1) % 3] - corner[k]));
      if (dot(p - corner[k], inward) < -near_) return false;
    }
    return true;
  }

  const TriangleMesh& mesh_;
  double near_;  // metres
  std::vector<Side> sides_;
  NestedBoxes boxes_;
  std::vector<std::size_t> start_, around_;  // sides of each vertex
};

}  // namespace

LipVertices find_lip_vertices(const TriangleMesh& mesh, std::span<const std::int32_t> first, double diagonal) {
  std::vector<std::uint8_t> used(first.size(), 0);
  for (const auto& t : mesh.triangles)
    for (const VertexId v : t) used[v.index()] = 1;
  std::vector<std::int32_t> at_place(first.size(), 0);
  for (std::size_t v = 0; v < first.size(); ++v) at_place[at(first[v])] += used[v];
  LipVertices out;
  std::vector<std::int32_t> next;
  for (std::size_t v = 0; v < first.size(); ++v)
    if (used[v] != 0 && at_place[at(first[v])] > 1) next.push_back(static_cast<std::int32_t>(v));
  if (next.empty()) return out;
  out.lip.assign(first.size(), 0);
  out.tip.assign(first.size(), 0);
  for (const std::int32_t v : next) out.lip[at(v)] = 1;

  const std::vector<EdgeUse> uses = edge_uses(mesh.triangles.raw(), first.size());
  const Sides sides(mesh, uses, kOnLip * diagonal);
  std::vector<std::uint8_t> looked_at = out.lip;
  while (!next.empty()) {
    const std::int32_t v = next.back();
    next.pop_back();
    sides.for_each_around(v, [&](const Side& side) {
      for (const std::int32_t u : side.corners) {
        if (looked_at[at(u)] != 0) continue;
        looked_at[at(u)] = 1;
        if (!sides.lies_on_another(u)) continue;
        out.lip[at(u)] = 1;
        next.push_back(u);
      }
    });
  }

  const auto could_be_tip = [&](std::int32_t v) { return looked_at[at(v)] != 0 && out.lip[at(v)] == 0; };
  sides.for_each_pair(uses, [&](const Side& s, const Side& t, std::int32_t v) {
    if (could_be_tip(v) && lie_on_each_other(s, t)) out.tip[at(v)] = 1;
  });
  // Walls that are twisted have other normals where their diagonals differ.
  std::vector<std::array<std::int32_t, 2>> leads;  // vertex, place
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    const std::int32_t a = edge[0].low, b = edge[0].high;
    if (could_be_tip(a) && out.lip[at(b)] != 0) leads.push_back({a, first[at(b)]});
    if (could_be_tip(b) && out.lip[at(a)] != 0) leads.push_back({b, first[at(a)]});
  });
  std::sort(leads.begin(), leads.end());
  for (std::size_t i = 1; i < leads.size(); ++i)
    if (leads[i] == leads[i - 1]) out.tip[at(leads[i][0])] = 1;
  return out;
}

}  // namespace kerf
