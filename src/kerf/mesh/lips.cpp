#include "kerf/mesh/lips.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <queue>

#include "kerf/mesh/first_seen.h"
#include "kerf/mesh/lip_vertices.h"
#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/surface_tolerances.h"

namespace kerf {
namespace {

/// Neighbours of every vertex along edges, ascending.
class Neighbours {
 public:
  Neighbours(std::span<const EdgeUse> uses, std::size_t vertices) : start_(vertices + 1, 0) {
    const auto each = [&](auto&& f) {
      for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        f(edge[0].low, edge[0].high);
        f(edge[0].high, edge[0].low);
      });
    };
    each([&](std::int32_t a, std::int32_t) { ++start_[static_cast<std::size_t>(a) + 1]; });
    for (std::size_t v = 0; v < vertices; ++v) start_[v + 1] += start_[v];
    to_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    each([&](std::int32_t a, std::int32_t b) { to_[next[static_cast<std::size_t>(a)]++] = b; });
  }
  [[nodiscard]] std::span<const std::int32_t> of(std::size_t v) const {
    return std::span(to_).subspan(start_[v], start_[v + 1] - start_[v]);
  }

 private:
  std::vector<std::size_t> start_;
  std::vector<std::int32_t> to_;
};

/// What is left of `value` on the way from its sources along edges; most first.
struct Left {
  double value;
  std::int32_t vertex;
  bool operator<(const Left& other) const { return value != other.value ? value < other.value : vertex > other.vertex; }
};

class LipsOf {
 public:
  explicit LipsOf(const TriangleMesh& mesh) : mesh_(mesh) {
    std::vector<std::uint8_t> used(mesh.positions.size(), 0);
    for (const auto& t : mesh.triangles)
      for (const VertexId v : t) used[v.index()] = 1;
    Box3 box;
    for (std::size_t v = 0; v < used.size(); ++v)
      if (used[v] != 0) box.add(mesh.positions.raw()[v]);
    LipVertices found = find_lip_vertices(mesh, first_at_place(mesh.positions.raw()), box.diagonal());
    is_lip_ = std::move(found.lip);
    is_tip_ = std::move(found.tip);
    gap_ = kLipGap * box.diagonal();
  }
  [[nodiscard]] bool any() const { return !is_lip_.empty(); }

  [[nodiscard]] std::vector<Vec3> drawn_back() const {
    const std::vector<EdgeUse> uses = edge_uses(mesh_.triangles.raw(), is_lip_.size());
    const Neighbours around(uses, is_lip_.size());
    const std::vector<Vec3> inward = averaged(directions(uses), around);
    // Towards the tips by less and less.
    std::vector<Left> sources;
    for (std::size_t v = 0; v < is_lip_.size(); ++v)
      if (is_tip_[v] != 0) sources.push_back({gap_, static_cast<std::int32_t>(v)});
    const std::vector<double> near_tip = spread(sources, around).first;
    sources.clear();
    for (std::size_t v = 0; v < is_lip_.size(); ++v)
      if (is_lip_[v] != 0) sources.push_back({gap_ - near_tip[v], static_cast<std::int32_t>(v)});
    const auto [left, source] = spread(sources, around);
    std::vector<Vec3> out(is_lip_.size());
    for (std::size_t v = 0; v < out.size(); ++v)
      if (left[v] > 0) out[v] = left[v] * inward[static_cast<std::size_t>(source[v])];
    for (int round = 0; round < kMostHalvings && halve_where_turned(out); ++round) {}
    return out;
  }

 private:
  [[nodiscard]] Vec3 at(VertexId v) const { return mesh_.positions[v]; }
  [[nodiscard]] bool lip(VertexId v) const { return is_lip_[v.index()] != 0; }

  /// Unit vectors of lips into their own material: away from the wall between them, or from the border edge of a sheet.
  [[nodiscard]] std::vector<Vec3> directions(std::span<const EdgeUse> uses) const {
    std::vector<Vec3> wall(is_lip_.size()), any(is_lip_.size());
    bool closed = true;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
      if (edge.size() != 1) return;
      closed = false;
      const auto& t = mesh_.triangles.raw()[static_cast<std::size_t>(edge[0].half_edge / 3)];
      const auto k = static_cast<std::size_t>(edge[0].half_edge % 3);
      const VertexId a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      if (!lip(a) || !lip(b)) return;
      const Vec3 along = at(b) - at(a), in = at(c) - at(a);
      const Vec3 inward = dot(along, along) * in - dot(in, along) * along;
      const Vec3 weighted = norm(along) * normalized(inward);
      wall[a.index()] += weighted;
      wall[b.index()] += weighted;
    });
    for (const auto& t : mesh_.triangles) {
      if (!lip(t[0]) && !lip(t[1]) && !lip(t[2])) continue;
      const Vec3 n = cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0])),
                 middle = (1.0 / 3) * (at(t[0]) + at(t[1]) + at(t[2]));
      const bool whole = lip(t[0]) && lip(t[1]) && lip(t[2]);
      for (const VertexId v : t) {
        if (closed) any[v.index()] -= normalized(n);
        else any[v.index()] += normalized(middle - at(v));
        if (closed && whole) wall[v.index()] -= n;
      }
    }
    for (std::size_t v = 0; v < wall.size(); ++v) {
      if (is_lip_[v] == 0) continue;
      if (norm(wall[v]) > 0) wall[v] = normalized(wall[v]);
      else wall[v] = norm(any[v]) > 0 ? normalized(any[v]) : Vec3{};
    }
    return wall;
  }

  /// Directions change along a lip by no more than amounts do: means over as much of it as the gap reaches. Where it turns back they are short.
  [[nodiscard]] std::vector<Vec3> averaged(const std::vector<Vec3>& direction, const Neighbours& around) const {
    const double reach = gap_ / kLipSlope;
    std::vector<Vec3> out(direction.size());
    std::vector<double> way(direction.size(), HUGE_VAL);
    std::vector<std::int32_t> seen;
    for (std::size_t v = 0; v < out.size(); ++v) {
      if (is_lip_[v] == 0) continue;
      std::priority_queue<Left> next;  // by what is left of the reach
      seen.assign(1, static_cast<std::int32_t>(v));
      way[v] = 0;
      next.push({reach, static_cast<std::int32_t>(v)});
      Vec3 sum;
      double weights = 0;
      while (!next.empty()) {
        const Left top = next.top();
        next.pop();
        const auto u = static_cast<std::size_t>(top.vertex);
        if (reach - top.value > way[u]) continue;
        sum += top.value * direction[u];
        weights += top.value;
        if (seen.size() > kMostAveraged) continue;
        for (const std::int32_t w : around.of(u)) {
          const auto to = static_cast<std::size_t>(w);
          const double there = way[u] + norm(mesh_.positions.raw()[to] - mesh_.positions.raw()[u]);
          if (is_lip_[to] == 0 || !(there < std::fmin(way[to], reach))) continue;
          if (way[to] == HUGE_VAL) seen.push_back(w);
          way[to] = there;
          next.push({reach - there, w});
        }
      }
      out[v] = (1 / weights) * sum;
      for (const std::int32_t u : seen) way[static_cast<std::size_t>(u)] = HUGE_VAL;
    }
    return out;
  }

  /// Slivers can turn over all the same; their corners move half as far. False: there were none.
  bool halve_where_turned(std::vector<Vec3>& back) const {
    std::vector<std::uint8_t> halve(back.size(), 0);
    bool any = false;
    for (const auto& t : mesh_.triangles) {
      const auto moved = [&](VertexId v) { return back[v.index()] != Vec3{}; };
      if (!moved(t[0]) && !moved(t[1]) && !moved(t[2])) continue;
      const auto there = [&](VertexId v) { return at(v) + back[v.index()]; };
      const Vec3 before = cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
      const Vec3 after = cross(there(t[1]) - there(t[0]), there(t[2]) - there(t[0]));
      if (dot(before, after) > kTurnedCosine * norm(before) * norm(after)) continue;
      any = true;
      for (const VertexId v : t) halve[v.index()] = 1;
    }
    for (std::size_t v = 0; v < back.size(); ++v)
      if (halve[v] != 0) back[v] = 0.5 * back[v];
    return any;
  }

  /// Of each vertex the most that comes from a source, which loses kLipSlope of the way, and that source.
  [[nodiscard]] std::pair<std::vector<double>, std::vector<std::int32_t>> spread(const std::vector<Left>& sources,
                                                                                 const Neighbours& around) const {
    std::vector<double> left(is_lip_.size(), 0);
    std::vector<std::int32_t> source(is_lip_.size(), -1);
    std::priority_queue<Left> next;
    for (const Left& s : sources) {
      if (!(s.value > 0)) continue;
      left[static_cast<std::size_t>(s.vertex)] = s.value;
      source[static_cast<std::size_t>(s.vertex)] = s.vertex;
      next.push(s);
    }
    while (!next.empty()) {
      const Left top = next.top();
      next.pop();
      const auto v = static_cast<std::size_t>(top.vertex);
      if (top.value < left[v]) continue;
      for (const std::int32_t u : around.of(v)) {
        const auto to = static_cast<std::size_t>(u);
        const double value = top.value - kLipSlope * norm(mesh_.positions.raw()[to] - mesh_.positions.raw()[v]);
        if (!(value > left[to])) continue;
        left[to] = value;
        source[to] = source[v];
        next.push({value, u});
      }
    }
    return {std::move(left), std::move(source)};
  }

  const TriangleMesh& mesh_;
  std::vector<std::uint8_t> is_lip_, is_tip_;
  double gap_ = 0;
};

}  // namespace

std::vector<std::int32_t> first_at_place(std::span<const Vec3> positions) {
  std::vector<std::int32_t> map(positions.size());
  std::vector<std::int32_t> first;
  FirstSeen<3> seen(positions.size());
  for (std::size_t v = 0; v < map.size(); ++v) {
    const Vec3 p = positions[v] + Vec3{};  // -0 becomes 0
    const auto n = static_cast<std::size_t>(seen.number(
        {std::bit_cast<std::uint64_t>(p.x), std::bit_cast<std::uint64_t>(p.y), std::bit_cast<std::uint64_t>(p.z)}));
    if (n == first.size()) first.push_back(static_cast<std::int32_t>(v));
    map[v] = first[n];
  }
  return map;
}

std::vector<Vec3> draw_lips_back(const TriangleMesh& mesh) {
  const LipsOf lips(mesh);
  return lips.any() ? lips.drawn_back() : std::vector<Vec3>();
}

TriangleMesh with_lips_drawn_back(const TriangleMesh& mesh) {
  TriangleMesh out = mesh;
  const std::vector<Vec3> back = draw_lips_back(mesh);
  for (std::size_t v = 0; v < back.size(); ++v) out.positions.raw()[v] += back[v];
  return out;
}

}  // namespace kerf
