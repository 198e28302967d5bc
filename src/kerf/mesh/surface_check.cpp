#include "kerf/mesh/surface_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <tuple>

#include "kerf/mesh/lips.h"
#include "kerf/mesh/mesh_limits.h"
#include "kerf/mesh/needles.h"
#include "kerf/mesh/nested_boxes.h"
#include "kerf/mesh/surface_edges.h"
#include "kerf/mesh/surface_tolerances.h"
#include "kerf/mesh/union_find.h"

namespace kerf {
namespace {

constexpr std::size_t kNamed = 3;  // so many offenders are named in an error

std::string prefix(const SurfaceRequirements& requirements) {
  return requirements.name.empty() ? std::string() : requirements.name + ": ";
}
std::string counted(std::size_t n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}
std::string place(Vec3 p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z); }

// Steps before any topology: elements that make no sense, sizes that doubles can't carry.
Status check_elements(const TriangleMesh& mesh, const std::string& who) {
  if (mesh.triangles.empty()) return bad_input(who + "the surface has no triangles; give a mesh with faces");
  if (mesh.triangles.size() > kMaxTriangles || mesh.positions.size() > kMaxVertices) {
    return bad_input(who + "the surface has more elements than 32-bit ids can name; give a coarser mesh");
  }
  if ((!mesh.texture.empty() && mesh.texture.size() != mesh.triangles.size()) ||
      (!mesh.group.empty() && mesh.group.size() != mesh.triangles.size())) {
    return bad_input(who +
                     "texture coordinates or groups are not one for every triangle; leave them out or complete them");
  }
  for (const TriangleId t : ids<TriangleId>(mesh.triangles.size())) {
    for (const VertexId v : mesh.triangles[t]) {
      if (mesh.positions.contains(v)) continue;
      return bad_input(fmt::format("{}triangle {} names vertex {}, but there are {}; correct the index", who,
                                   t.value + 1, std::int64_t{v.value} + 1, mesh.positions.size()));
    }
  }
  for (const VertexId v : ids<VertexId>(mesh.positions.size())) {
    if (is_finite(mesh.positions[v])) continue;
    return bad_input(
        fmt::format("{}vertex {} has a coordinate that is not a finite number; correct it", who, v.value + 1));
  }
  return {};
}

Result<Box3> check_scale(const TriangleMesh& mesh, const std::string& who, std::vector<std::string>& warnings) {
  std::vector<char> used(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (const VertexId v : t) used[v.index()] = 1;
  }
  Box3 box;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] != 0) box.add(mesh.positions.raw()[v]);
  }
  if (box.size() == Vec3{}) return bad_input(who + "all vertices lie at one place; give a surface with an extent");
  if (const auto fault = extent_fault(box))
    return bad_input(fmt::format("{}the surface is {}; {}", who, fault->what, fault->otherwise));
  const double diagonal = box.diagonal();
  if (norm(box.center()) > kUsualDistance * diagonal) {
    warnings.push_back(
        fmt::format("{}the surface is {:.3g} m across but lies {:.3g} m from the origin; moving it nearer keeps "
                    "more digits",
                    who, diagonal, norm(box.center())));
  }
  if (diagonal > kUsualLargest || diagonal < kUsualSmallest) {
    warnings.push_back(
        fmt::format("{}the surface is {:.3g} m across; if the file is not in metres, give `scale` ({})", who, diagonal,
                    diagonal > kUsualLargest ? "--scale 0.001 for millimetres" : "--scale 1000 for kilometres, say"));
  }
  return box;
}

// For every vertex the one that it becomes.
std::vector<std::int32_t> roots_of(UnionFind& same) {
  std::vector<std::int32_t> map(same.size());
  for (std::size_t v = 0; v < map.size(); ++v) map[v] = same.root(static_cast<std::int32_t>(v));
  return map;
}

struct Edges {
  double shortest = HUGE_VAL, mean = 0;  // metres
};
Edges edges_of(const TriangleMesh& mesh) {
  Edges out;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double length = norm(mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]]);
      out.shortest = std::min(out.shortest, length);
      out.mean += length;
    }
  }
  out.mean /= static_cast<double>(3 * mesh.triangles.size());
  return out;
}

// Vertices that are within the tolerance of each other become the first of them.
std::vector<std::int32_t> weld_within(const TriangleMesh& mesh, const Box3& box, double tolerance) {
  // Cells of twice the tolerance: a vertex can only meet others in its own cell and in those that its half
  // touches.
  struct Entry {
    std::array<std::int64_t, 3> cell;
    std::int32_t vertex;
  };
  const double cell_size = 2 * tolerance;
  const auto scaled = [&](Vec3 p) { return (1 / cell_size) * (p - box.min); };
  std::vector<Entry> entries(mesh.positions.size());
  for (std::size_t v = 0; v < entries.size(); ++v) {
    const Vec3 s = scaled(mesh.positions.raw()[v]);
    for (int k = 0; k < 3; ++k) {
      // Unused vertices may lie far outside of the box.
      entries[v].cell[static_cast<std::size_t>(k)] =
          static_cast<std::int64_t>(std::floor(std::clamp(s[k], -1e17, 1e17)));
    }
    entries[v].vertex = static_cast<std::int32_t>(v);
  }
  // Of vertices at the very same place the first stands for all: the corners of a soup of triangles around one place are many.
  const std::vector<std::int32_t> first = first_at_place(mesh.positions.raw());
  UnionFind places(entries.size());
  std::vector<Entry> sorted;
  for (const Entry& e : entries) {
    const std::int32_t same = first[static_cast<std::size_t>(e.vertex)];
    if (same == e.vertex) sorted.push_back(e);
    else places.join(same, e.vertex);
  }
  const auto before = [](const Entry& a, const Entry& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.vertex < b.vertex;
  };
  std::sort(sorted.begin(), sorted.end(), before);
  for (std::size_t v = 0; v < entries.size(); ++v) {
    if (first[v] != static_cast<std::int32_t>(v)) continue;
    const Vec3 p = mesh.positions.raw()[v];
    const Vec3 s = scaled(p);
    for (int corner = 0; corner < 8; ++corner) {
      Entry probe{entries[v].cell, -1};
      for (int k = 0; k < 3; ++k) {
        if (((corner >> k) & 1) == 0) continue;
        probe.cell[static_cast<std::size_t>(k)] += s[k] - std::floor(s[k]) < 0.5 ? -1 : 1;
      }
      for (auto e = std::lower_bound(sorted.begin(), sorted.end(), probe, before);
           e != sorted.end() && e->cell == probe.cell; ++e) {
        if (e->vertex < static_cast<std::int32_t>(v) &&
            norm(mesh.positions.raw()[static_cast<std::size_t>(e->vertex)] - p) <= tolerance) {
          places.join(e->vertex, static_cast<std::int32_t>(v));
        }
      }
    }
  }
  return roots_of(places);
}

// A connected part of the surface.
struct Part {
  std::size_t triangles = 0;
  std::size_t first_triangle = 0;
  std::size_t border_edges = 0;
  Box3 box;
  double volume = 0;
  double area = 0;
  int depth = 0;  ///< so many other closed parts lie around it
};

// One pass over the surface with a given welding. Works on copies; the caller decides what to keep.
class SurfacePass {
 public:
  SurfacePass(const TriangleMesh& input, const SurfaceRequirements& requirements, const Box3& box,
              const std::vector<std::int32_t>* weld)
      : input_(input), requirements_(requirements), who_(prefix(requirements)), box_(box) {
    triangles_ = input.triangles.raw();
    source_.resize(triangles_.size());
    for (std::size_t t = 0; t < source_.size(); ++t) source_[t] = static_cast<std::int32_t>(t);
    turned_.assign(triangles_.size(), 0);
    positions_ = input.positions.raw();
    origin_.resize(positions_.size());
    for (std::size_t v = 0; v < origin_.size(); ++v) origin_[v] = static_cast<std::int32_t>(v);
    if (weld == nullptr) return;
    std::vector<char> used(positions_.size(), 0);
    for (auto& t : triangles_) {
      for (VertexId& v : t) {
        used[v.index()] = 1;
        v = VertexId((*weld)[v.index()]);
      }
    }
    for (std::size_t v = 0; v < used.size(); ++v) {
      if (used[v] != 0 && (*weld)[v] != static_cast<std::int32_t>(v)) ++welded_;
    }
  }

  Status run() {
    if (welded_ > 0) {
      repair(fmt::format("welded {} that lay at the same place as others", counted(welded_, "vertex", "vertices")));
    }
    drop_collapsed();
    KERF_TRY(drop_duplicates());
    KERF_TRY(drop_flat());
    KERF_TRY(check_fans());
    KERF_TRY(connect());
    KERF_TRY(orient());
    split_touching();
    measure_parts();
    KERF_TRY(check_closedness());
    nest_parts();
    KERF_TRY(turn_inside_out());
    count_bodies();
    return {};
  }
  /// Whether it may be of several bodies, if it is. `way_out`: what else to say where it may not.
  [[nodiscard]] Status allow_several(const std::string& way_out) const {
    if (report_.several.empty() || !requirements_.single_body) return {};
    return refuse(report_.several + (way_out.empty() ? "" : "; ") + way_out);
  }

  [[nodiscard]] bool closed() const { return closed_; }
  [[nodiscard]] std::size_t welded() const { return welded_; }
  /// Each triangle was there from both sides.
  [[nodiscard]] bool doubled() const { return doubled_; }
  [[nodiscard]] std::size_t bodies() const { return report_.bodies; }
  [[nodiscard]] std::size_t collapsed() const { return collapsed_; }
  /// Whether anything hangs together; unknown before the pass got so far.
  [[nodiscard]] bool is_soup() const {
    return parts_.empty() || static_cast<double>(triangles_.size()) < kSoup * static_cast<double>(parts_.size());
  }
  [[nodiscard]] std::size_t border_edges() const {
    std::size_t n = 0;
    for (const Part& part : parts_) n += part.border_edges;
    return n;
  }

  // Vertices that `weld` merges and this pass kept apart come to lie where the first of them lies, to the bit: that tells lips. A triangle
  // that would turn over or lose its area keeps its corners where they are.
  void put_at_one_place(const std::vector<std::int32_t>& weld) {
    std::vector<char> stays(weld.size(), 0);
    const auto root = [&](VertexId v) {
      return static_cast<std::size_t>(weld[static_cast<std::size_t>(origin_[v.index()])]);
    };
    const auto there = [&](VertexId v) {
      return stays[root(v)] != 0 ? positions_[v.index()] : input_.positions.raw()[root(v)];
    };
    const auto turns = [&](const std::array<VertexId, 3>& t) {
      const Vec3 a = positions_[t[0].index()], b = positions_[t[1].index()], c = positions_[t[2].index()];
      const Vec3 p = there(t[0]), q = there(t[1]), r = there(t[2]);
      if (p == a && q == b && r == c) return false;
      const Vec3 before = cross(b - a, c - a), after = cross(q - p, r - p);
      return !(dot(before, after) > kTurnedCosine * norm(before) * norm(after));
    };
    for (bool again = true; again;) {
      again = false;
      for (const auto& t : triangles_) {
        if (!turns(t)) continue;
        again = true;
        for (const VertexId v : t) stays[root(v)] = 1;
      }
    }
    std::vector<Vec3> moved(positions_.size());
    for (std::size_t v = 0; v < moved.size(); ++v) moved[v] = there(VertexId(v));
    positions_ = std::move(moved);
  }

  // The checked surface with unused vertices dropped.
  SurfaceReport finish(TriangleMesh& mesh) {
    TriangleMesh out;
    std::vector<std::int32_t> number(positions_.size(), -1);
    for (const auto& t : triangles_) {
      for (const VertexId v : t) number[v.index()] = 0;
    }
    std::size_t unused = 0;
    for (std::size_t v = 0; v < number.size(); ++v) {
      if (number[v] < 0) {
        ++unused;
        continue;
      }
      number[v] = out.positions.push_back(positions_[v]).value;
    }
    unused -= std::min(unused, welded_);
    if (unused > 0) repair(fmt::format("dropped {} that no triangle uses", counted(unused, "vertex", "vertices")));
    out.triangles.reserve(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      std::array<VertexId, 3> corners = triangles_[t];
      for (VertexId& v : corners) v = VertexId(number[v.index()]);
      out.triangles.push_back(corners);
      if (input_.has_texture()) {
        std::array<Vec2f, 3> uv = input_.texture[TriangleId(source_[t])];
        if (turned_[t] != 0) std::swap(uv[1], uv[2]);
        out.texture.push_back(uv);
      }
      if (!input_.group.empty()) out.group.push_back(input_.group[TriangleId(source_[t])]);
    }
    report_.measures = surface_measures(out);
    mesh = std::move(out);
    return std::move(report_);
  }

 private:
  void repair(const std::string& what) { report_.repairs.push_back(who_ + what); }
  [[nodiscard]] Error refuse(const std::string& why) const {
    return bad_input(fmt::format("{}{}{}", who_, why, done_so_far_.empty() ? "" : " (after " + done_so_far_ + ")"));
  }
  [[nodiscard]] std::string vertex_text(std::int32_t v) const {
    return fmt::format("vertex {} at {}", origin_[static_cast<std::size_t>(v)] + 1,
                       place(positions_[static_cast<std::size_t>(v)]));
  }
  [[nodiscard]] std::string edge_text(std::int32_t a, std::int32_t b) const {
    return fmt::format("{}-{} at {}", origin_[static_cast<std::size_t>(a)] + 1,
                       origin_[static_cast<std::size_t>(b)] + 1, place(positions_[static_cast<std::size_t>(a)]));
  }
  [[nodiscard]] std::int32_t triangle_number(std::size_t t) const { return source_[t] + 1; }

  void drop(const std::vector<char>& gone) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (gone[t] != 0) continue;
      triangles_[kept] = triangles_[t];
      source_[kept] = source_[t];
      turned_[kept] = turned_[t];
      ++kept;
    }
    triangles_.resize(kept);
    source_.resize(kept);
    turned_.resize(kept);
  }

  void drop_collapsed() {
    std::vector<char> gone(triangles_.size(), 0);
    std::size_t count = 0;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const auto& c = triangles_[t];
      if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) continue;
      gone[t] = 1;
      ++count;
    }
    if (count == 0) return;
    drop(gone);
    collapsed_ = count;
    repair(fmt::format("dropped {} with corners at the same place", counted(count, "triangle", "triangles")));
  }

  Status drop_duplicates() {
    uses_ = edge_uses(triangles_, positions_.size());
    std::vector<char> gone;
    std::size_t count = 0;
    std::vector<std::pair<std::int32_t, std::int32_t>> apexes;
    // Triangles on the same corners share an edge and the corner opposite to it.
    for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      if (edge.size() < 2) return;
      apexes.clear();
      for (const EdgeUse& use : edge) {
        const std::int32_t t = use.half_edge / 3;
        apexes.emplace_back(
            triangles_[static_cast<std::size_t>(t)][static_cast<std::size_t>((use.half_edge + 2 - 3 * t) % 3)].value,
            t);
      }
      if (apexes.size() == 2 && apexes[0].first != apexes[1].first) return;
      std::sort(apexes.begin(), apexes.end());
      for (std::size_t i = 1; i < apexes.size(); ++i) {
        if (apexes[i].first != apexes[i - 1].first) continue;
        if (gone.empty()) gone.assign(triangles_.size(), 0);
        char& flag = gone[static_cast<std::size_t>(apexes[i].second)];
        count += flag == 0 ? 1 : 0;
        flag = 1;
      }
    });
    if (count > 0) {
      doubled_ = 2 * count == triangles_.size();
      if (!doubled_) {
        // Walls of lips lie on each other back to back.
        if (pair_by_material(nullptr)) return {};
        KERF_TRY(check_folds(gone));
      }
      drop(gone);
      uses_ = edge_uses(triangles_, positions_.size());
      const std::string what = counted(count, "duplicate triangle", "duplicate triangles");
      repair("dropped " + what);
      done_so_far_ = "dropping " + what;
    }
    if (triangles_.empty()) return refuse("all triangles have corners at the same place; give a surface with an area");
    return {};
  }

  // Triangles back to back that hang together are a fold: without one of them the other would be loose. Only
  // where all are double (a sheet exported with both sides) one side can go.
  Status check_folds(const std::vector<char>& gone) const {
    std::optional<Error> fold;
    for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      if (fold || edge.size() != 2) return;
      const auto first = static_cast<std::size_t>(edge[0].half_edge / 3);
      const auto second = static_cast<std::size_t>(edge[1].half_edge / 3);
      if (gone[first] == gone[second] || from(edge[0].half_edge) == from(edge[1].half_edge)) return;
      fold =
          refuse(fmt::format("triangles {} and {} lie back to back, folded at edge {}; remove both, or give the part a "
                             "thickness",
                             triangle_number(first), triangle_number(second), edge_text(edge[0].low, edge[0].high)));
    });
    if (fold) return *fold;
    return {};
  }

  [[nodiscard]] bool is_flat(const std::array<VertexId, 3>& t) const {
    const Vec3 a = positions_[t[0].index()];
    const Vec3 b = positions_[t[1].index()];
    const Vec3 c = positions_[t[2].index()];
    const double longest = std::max({norm(b - a), norm(c - b), norm(a - c)});
    return norm(cross(b - a, c - a)) <= kFlatTriangle * longest * longest;
  }

  // The place in uses_ of the first use of the edge that begins at this corner.
  [[nodiscard]] std::size_t first_use(std::int32_t h) const {
    const VertexId a = from(h), b = from(h % 3 == 2 ? h - 2 : h + 1);
    const EdgeUse key{std::min(a, b).value, std::max(a, b).value, 0};
    const auto first = std::lower_bound(uses_.begin(), uses_.end(), key, [](const EdgeUse& x, const EdgeUse& y) {
      return x.low != y.low ? x.low < y.low : x.high < y.high;
    });
    return static_cast<std::size_t>(first - uses_.begin());
  }

  // A flat triangle with a free edge can go without a trace; one with three neighbours would leave a slit. An edge that is free stays
  // free, so the order in which they go does not matter.
  Status drop_flat() {
    std::vector<std::size_t> flat;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (is_flat(triangles_[t])) flat.push_back(t);
    }
    if (flat.empty()) return {};
    // Of an edge, at its first use: triangles that are left, and the sum of their numbers, which names the last one.
    std::vector<std::int32_t> alive(uses_.size(), 0);
    std::vector<std::int64_t> sum(uses_.size(), 0);
    for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      const auto first = static_cast<std::size_t>(edge.data() - uses_.data());
      alive[first] = static_cast<std::int32_t>(edge.size());
      for (const EdgeUse& use : edge) sum[first] += use.half_edge / 3;
    });
    std::vector<char> may_go(triangles_.size(), 0), gone(triangles_.size(), 0);
    for (const std::size_t t : flat) may_go[t] = 1;
    std::size_t count = 0;
    std::vector<std::size_t> next = flat;
    while (!next.empty()) {
      const std::size_t t = next.back();
      next.pop_back();
      if (may_go[t] == 0 || gone[t] != 0) continue;
      std::array<std::size_t, 3> edge;
      for (std::size_t i = 0; i < 3; ++i) edge[i] = first_use(static_cast<std::int32_t>(3 * t + i));
      if (alive[edge[0]] != 1 && alive[edge[1]] != 1 && alive[edge[2]] != 1) continue;
      gone[t] = 1;
      ++count;
      for (const std::size_t e : edge) {
        sum[e] -= static_cast<std::int64_t>(t);
        if (--alive[e] == 1) next.push_back(static_cast<std::size_t>(sum[e]));
      }
    }
    std::vector<std::size_t> left;
    for (const std::size_t t : flat) {
      if (gone[t] == 0) left.push_back(t);
    }
    if (!left.empty()) {
      std::string named;
      for (std::size_t i = 0; i < std::min(left.size(), kNamed); ++i) {
        named += fmt::format("{}{}", i == 0 ? "" : ", ", triangle_number(left[i]));
      }
      return refuse(
          fmt::format("{} no area, and dropping would tear the surface: triangle {} ({}){}; collapse or flip "
                      "the longest edge in a mesh editor",
                      left.size() == 1 ? "a triangle has" : counted(left.size(), "triangle has", "triangles have"),
                      named, vertex_text(triangles_[left[0]][0].value), left.size() > kNamed ? ", ..." : ""));
    }
    drop(gone);
    if (triangles_.empty()) return refuse("no triangle has an area; give a surface, not lines");
    uses_ = edge_uses(triangles_, positions_.size());
    const std::string what = counted(count, "triangle without area", "triangles without area");
    repair("dropped " + what);
    done_so_far_ += (done_so_far_.empty() ? "dropping " : " and ") + what;
    return {};
  }

  Status check_fans() const {
    if (!requirements_.bindable) return {};
    const LargestFan fan = largest_fan(triangles_, positions_.size());
    if (fan.triangles <= kMostAround) return {};
    return refuse(large_fan_text(vertex_text(fan.vertex.value), fan.triangles));
  }

  // Around an edge the two triangles with material between them belong together: the wall of a lip and the side behind it, two faces of
  // one body. False where they don't alternate: an edge with an odd number, a sheet on a sheet, a fin outside of a body.
  bool pair_by_material(std::vector<std::int32_t>* across) const {
    double volume = 0;
    for (const auto& t : triangles_)
      volume += dot(positions_[t[0].index()] - box_.center(),
                    cross(positions_[t[1].index()] - box_.center(), positions_[t[2].index()] - box_.center()));
    bool fits = true;
    for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      if (edge.size() > 2 && fits) fits = pair_edge(edge, volume < 0, across);
    });
    return fits;
  }

  bool pair_edge(std::span<const EdgeUse> edge, bool inside_out, std::vector<std::int32_t>* across) const {
    struct Around {
      double angle;
      bool opens;  // material begins here, seen counter-clockwise around the way from low to high
      std::int32_t half_edge;
    };
    if (edge.size() % 2 != 0) return false;
    const Vec3 low = positions_[static_cast<std::size_t>(edge[0].low)];
    const Vec3 axis = normalized(positions_[static_cast<std::size_t>(edge[0].high)] - low);
    std::vector<Around> around;
    Vec3 x, y;
    for (const EdgeUse& use : edge) {
      const std::int32_t h = use.half_edge;
      const VertexId apex = triangles_[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>((h % 3 + 2) % 3)];
      const Vec3 to = positions_[apex.index()] - low;
      const Vec3 out = to - dot(to, axis) * axis;
      if (!(norm(out) > 0)) return false;
      if (around.empty()) {
        x = normalized(out);
        y = cross(axis, x);
      }
      double angle = std::atan2(dot(out, y), dot(out, x));
      if (angle < -0.5 * kSameAngle) angle += 2 * std::numbers::pi;
      // The triangle (low, high, apex) has its front counter-clockwise of it, so material ends there.
      around.push_back({angle, (from(h).value == use.low) == inside_out, h});
    }
    std::sort(around.begin(), around.end(), [](const Around& a, const Around& b) {
      return a.angle != b.angle ? a.angle < b.angle : a.half_edge < b.half_edge;
    });
    // At one angle what ends goes before what begins: the lips of a slit.
    for (std::size_t i = 0; i < around.size();) {
      std::size_t j = i + 1;
      while (j < around.size() && around[j].angle - around[i].angle < kSameAngle) ++j;
      std::stable_partition(around.begin() + static_cast<std::ptrdiff_t>(i),
                            around.begin() + static_cast<std::ptrdiff_t>(j), [](const Around& a) { return !a.opens; });
      i = j;
    }
    for (std::size_t i = 0; i < around.size(); ++i)
      if (around[i].opens == around[(i + 1) % around.size()].opens) return false;
    if (across == nullptr) return true;
    for (std::size_t i = around[0].opens ? 0 : 1; i < around.size(); i += 2) {
      const std::int32_t h = around[i].half_edge, g = around[(i + 1) % around.size()].half_edge;
      (*across)[static_cast<std::size_t>(h)] = g;
      (*across)[static_cast<std::size_t>(g)] = h;
    }
    return true;
  }

  Status connect() {
    across_.assign(3 * triangles_.size(), -1);
    std::size_t count = 0;
    std::string named;
    for_each_edge(uses_, [&](std::span<const EdgeUse> edge) {
      if (edge.size() == 2) {
        across_[static_cast<std::size_t>(edge[0].half_edge)] = edge[1].half_edge;
        across_[static_cast<std::size_t>(edge[1].half_edge)] = edge[0].half_edge;
      } else if (edge.size() > 2) {
        if (count < kNamed) {
          named += fmt::format("{}{} ({} triangles)", count == 0 ? "" : ", ", edge_text(edge[0].low, edge[0].high),
                               edge.size());
        }
        ++count;
      }
    });
    if (count > 0 && !pair_by_material(&across_)) {
      return refuse(
          fmt::format("the surface is not a manifold: {} more than two triangles: {}{}; separate or remove the "
                      "extra faces",
                      counted(count, "edge has", "edges have"), named, count > kNamed ? ", ..." : ""));
    }
    parted_edges_ = count;
    uses_ = {};
    return {};
  }

  [[nodiscard]] VertexId from(std::int32_t h) const {
    return triangles_[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)];
  }

  // Flood fill over edges: every part gets one orientation, the one that turns fewer triangles.
  Status orient() {
    part_.assign(triangles_.size(), -1);
    std::vector<char> flip(triangles_.size(), 0);
    std::vector<std::int32_t> queue;
    std::size_t turned = 0;
    for (std::size_t seed = 0; seed < triangles_.size(); ++seed) {
      if (part_[seed] >= 0) continue;
      const auto part = static_cast<std::int32_t>(parts_.size());
      parts_.push_back({});
      parts_.back().first_triangle = seed;
      queue.assign(1, static_cast<std::int32_t>(seed));
      part_[seed] = part;
      std::size_t flipped = 0;
      for (std::size_t k = 0; k < queue.size(); ++k) {
        const std::int32_t t = queue[k];
        for (std::int32_t i = 0; i < 3; ++i) {
          const std::int32_t h = 3 * t + i;
          const std::int32_t other = across_[static_cast<std::size_t>(h)];
          if (other < 0) continue;
          const auto u = static_cast<std::size_t>(other / 3);
          const bool agree = from(h) != from(other);
          const char wanted =
              static_cast<char>(agree ? flip[static_cast<std::size_t>(t)] : 1 - flip[static_cast<std::size_t>(t)]);
          if (part_[u] < 0) {
            part_[u] = part;
            flip[u] = wanted;
            flipped += static_cast<std::size_t>(wanted);
            queue.push_back(static_cast<std::int32_t>(u));
          } else if (flip[u] != wanted) {
            const VertexId a = from(h);
            const VertexId b = triangles_[static_cast<std::size_t>(t)][static_cast<std::size_t>((i + 1) % 3)];
            return refuse(fmt::format(
                "the surface is one-sided, like a Moebius strip: no orientation suits triangles {} and {} "
                "at edge {} together with the rest; give a surface with two sides",
                triangle_number(static_cast<std::size_t>(t)), triangle_number(u), edge_text(a.value, b.value)));
          }
        }
      }
      const bool invert = 2 * flipped > queue.size();
      parts_.back().triangles = queue.size();
      turned += invert ? queue.size() - flipped : flipped;
      if (flipped == 0) continue;
      for (const std::int32_t t : queue) {
        if ((flip[static_cast<std::size_t>(t)] != 0) != invert) turn(static_cast<std::size_t>(t));
      }
      // Turned triangles keep their edges, under other numbers.
    }
    if (turned > 0) {
      repair(fmt::format("turned {} that faced the other way than their neighbours",
                         counted(turned, "triangle", "triangles")));
    }
    return {};
  }

  // Corners a b c become a c b; edges 0 1 2 (ab bc ca) become 2 1 0.
  void turn(std::size_t t) {
    std::swap(triangles_[t][1], triangles_[t][2]);
    turned_[t] = static_cast<char>(1 - turned_[t]);
    std::swap(across_[3 * t], across_[3 * t + 2]);
    for (const std::size_t h : {3 * t, 3 * t + 2}) {
      // Links to itself would be edges of a triangle with two equal corners; those are gone.
      if (across_[h] >= 0) across_[static_cast<std::size_t>(across_[h])] = static_cast<std::int32_t>(h);
    }
  }

  // Every vertex gets one fan: parts that only touch in a point get vertices of their own.
  void split_touching() {
    std::vector<std::int32_t> fan(3 * triangles_.size(), -1);  // of every corner
    std::vector<char> taken(positions_.size(), 0);
    std::size_t count = 0;
    std::vector<std::int32_t> corners;
    const std::size_t corner_count = fan.size();
    for (std::size_t c = 0; c < corner_count; ++c) {
      if (fan[c] >= 0) continue;
      const VertexId v = triangles_[c / 3][c % 3];
      corners.assign(1, static_cast<std::int32_t>(c));
      fan[c] = 0;
      for (std::size_t k = 0; k < corners.size(); ++k) {
        // A corner's two edges are its own half-edge and the one before; the corner across is at the same
        // vertex.
        const std::int32_t h = corners[k];
        const std::int32_t before = h % 3 == 0 ? h + 2 : h - 1;
        for (const std::int32_t edge : {h, before}) {
          const std::int32_t other = across_[static_cast<std::size_t>(edge)];
          if (other < 0) continue;
          const std::int32_t next = other % 3 == 2 ? other - 2 : other + 1;
          const std::int32_t corner = from(other) == v ? other : next;
          if (fan[static_cast<std::size_t>(corner)] >= 0) continue;
          fan[static_cast<std::size_t>(corner)] = 0;
          corners.push_back(corner);
        }
      }
      if (taken[v.index()] == 0) {
        taken[v.index()] = 1;
        continue;
      }
      ++count;
      const VertexId copy(positions_.size());
      const Vec3 p = positions_[v.index()];
      positions_.push_back(p);
      origin_.push_back(origin_[v.index()]);
      for (const std::int32_t h : corners)
        triangles_[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)] = copy;
    }
    if (parted_edges_ > 0) {
      repair(fmt::format("took {} and {} apart where lips of a slit, or bodies, lie on each other",
                         counted(parted_edges_, "edge", "edges"), counted(count, "vertex", "vertices")));
    } else if (count > 0) {
      repair(fmt::format("split {} where parts of the surface touch in a single point",
                         counted(count, "vertex", "vertices")));
    }
  }

  void measure_parts() {
    const Vec3 center = box_.center();
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      Part& part = parts_[static_cast<std::size_t>(part_[t])];
      const Vec3 a = positions_[triangles_[t][0].index()];
      const Vec3 b = positions_[triangles_[t][1].index()];
      const Vec3 c = positions_[triangles_[t][2].index()];
      const Vec3 n = cross(b - a, c - a);
      part.area += 0.5 * norm(n);
      part.volume += dot(a - center, n) / 6;
      if (parts_.size() > 1) {  // only nesting needs the boxes
        for (const Vec3 p : {a, b, c}) part.box.add(p);
      }
      for (std::size_t i = 0; i < 3; ++i) part.border_edges += across_[3 * t + i] < 0 ? 1 : 0;
    }
    closed_ = true;
    for (const Part& part : parts_) closed_ = closed_ && part.border_edges == 0;
  }

  Status check_closedness() const {
    if (requirements_.closedness == Closedness::kOpen && closed_) {
      return refuse(
          "the surface is closed, but an open one with a border is needed here; remove the faces of one side "
          "and the rim");
    }
    if (requirements_.closedness != Closedness::kClosed || closed_) return {};
    UnionFind loops(positions_.size());
    std::vector<char> on_border(positions_.size(), 0);
    std::size_t edges = 0;
    std::int32_t first = -1;
    for (std::size_t h = 0; h < across_.size(); ++h) {
      if (across_[h] >= 0) continue;
      ++edges;
      const std::int32_t a = from(static_cast<std::int32_t>(h)).value;
      const std::int32_t b = triangles_[h / 3][(h % 3 + 1) % 3].value;
      loops.join(a, b);
      on_border[static_cast<std::size_t>(a)] = on_border[static_cast<std::size_t>(b)] = 1;
      if (first < 0) first = static_cast<std::int32_t>(h);
    }
    std::size_t loop_count = 0;
    for (std::size_t v = 0; v < on_border.size(); ++v) loop_count += on_border[v] != 0 && loops.is_root(v) ? 1 : 0;
    const std::int32_t a = from(first).value;
    const std::int32_t b =
        triangles_[static_cast<std::size_t>(first / 3)][static_cast<std::size_t>((first % 3 + 1) % 3)].value;
    return refuse(fmt::format(
        "the surface is open, but a closed one is needed here: {} with {}, the first is edge {} of triangle "
        "{}; fill the holes, or give a weld tolerance if the borders nearly touch",
        counted(loop_count, "border", "borders"), counted(edges, "edge", "edges"), edge_text(a, b),
        triangle_number(static_cast<std::size_t>(first / 3))));
  }

  void list_triangles_of_parts() {
    part_start_.assign(parts_.size() + 1, 0);
    for (std::size_t i = 0; i < parts_.size(); ++i) part_start_[i + 1] = part_start_[i] + parts_[i].triangles;
    part_triangles_.resize(triangles_.size());
    std::vector<std::size_t> next(part_start_.begin(), part_start_.end() - 1);
    for (std::size_t t = 0; t < triangles_.size(); ++t) part_triangles_[next[static_cast<std::size_t>(part_[t])]++] = t;
  }
  [[nodiscard]] std::span<const std::size_t> triangles_of(std::size_t part) const {
    return std::span(part_triangles_).subspan(part_start_[part], part_start_[part + 1] - part_start_[part]);
  }

  // How often a closed part winds around a point: 0 outside, 1 or -1 inside.
  [[nodiscard]] double winding(std::size_t part, Vec3 p) const {
    double sum = 0;
    for (const std::size_t t : triangles_of(part)) {
      const Vec3 a = positions_[triangles_[t][0].index()] - p;
      const Vec3 b = positions_[triangles_[t][1].index()] - p;
      const Vec3 c = positions_[triangles_[t][2].index()] - p;
      const double la = norm(a);
      const double lb = norm(b);
      const double lc = norm(c);
      // Half of the solid angle of the triangle (van Oosterom and Strackee 1983).
      sum += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return sum / (2 * std::numbers::pi);
  }

  [[nodiscard]] bool is_inside(std::size_t inner, std::size_t outer) const {
    // The parity of the winding number at corners of the inner part, until one is clearly off the outer
    // surface.
    int tries = 0;
    for (const std::size_t t : triangles_of(inner)) {
      if (++tries > 8) break;
      const Vec3 center = (1.0 / 3) * (positions_[triangles_[t][0].index()] + positions_[triangles_[t][1].index()] +
                                       positions_[triangles_[t][2].index()]);
      const double w = winding(outer, center);
      const double nearest = std::round(w);
      if (std::abs(w - nearest) < 0.05) return std::abs(nearest - 2 * std::floor(nearest / 2)) > 0.5;
    }
    return false;
  }

  void nest_parts() {
    if (parts_.size() < 2) return;
    list_triangles_of_parts();
    std::vector<NestedBoxes::Item> closed;
    for (std::size_t i = 0; i < parts_.size(); ++i)
      if (parts_[i].border_edges == 0) closed.push_back({parts_[i].box, i});
    const NestedBoxes boxes(std::move(closed));
    // Parts do not cross each other, so what holds the smallest part round another one holds that too.
    const auto larger = [&](std::size_t i, std::size_t j) {
      const double a = std::abs(parts_[i].volume), b = std::abs(parts_[j].volume);
      return a != b ? a > b : i < j;
    };
    std::vector<std::size_t> order(parts_.size()), around;
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), larger);
    for (const std::size_t i : order) {
      if (parts_[i].border_edges > 0) continue;
      around.clear();
      boxes.for_each_around(parts_[i].box, [&](std::size_t j) {
        if (larger(j, i)) around.push_back(j);
      });
      std::sort(around.begin(), around.end(), larger);
      while (!around.empty() && !is_inside(i, around.back())) around.pop_back();
      if (!around.empty()) parts_[i].depth = parts_[around.back()].depth + 1;
    }
  }

  Status turn_inside_out() {
    const double diagonal = box_.diagonal();
    std::vector<char> wrong(parts_.size(), 0);
    std::size_t outer = 0;
    std::size_t cavities = 0;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      if (part.border_edges > 0) continue;
      if (std::abs(part.volume) <= kNoVolume * part.area * diagonal) {
        return refuse(fmt::format(
            "the closed part of {} around {} encloses no volume; give it a thickness, or remove it",
            counted(part.triangles, "triangle", "triangles"), vertex_text(triangles_[part.first_triangle][0].value)));
      }
      const bool is_cavity = part.depth % 2 == 1;
      if ((part.volume < 0) == is_cavity) continue;
      wrong[i] = 1;
      ++(is_cavity ? cavities : outer);
    }
    if (outer + cavities == 0) return {};
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (wrong[static_cast<std::size_t>(part_[t])] != 0) turn(t);
    }
    if (outer > 0) {
      repair(parts_.size() == 1 ? std::string("turned the whole surface, which was inside out")
                                : fmt::format("turned {} inside out",
                                              counted(outer, "closed part that was", "closed parts that were")));
    }
    if (cavities > 0) {
      repair(fmt::format("turned {} so that it faces the hollow",
                         counted(cavities, "wall of a cavity", "walls of cavities")));
    }
    return {};
  }

  void count_bodies() {
    std::vector<std::size_t> sizes;
    for (const Part& part : parts_) {
      if (part.border_edges == 0 && part.depth % 2 == 1) {
        ++report_.cavities;
      } else {
        sizes.push_back(part.triangles);
      }
    }
    report_.bodies = sizes.size();
    if (sizes.size() == 1) return;
    std::sort(sizes.begin(), sizes.end(), std::greater<>());
    std::string list;
    for (std::size_t i = 0; i < std::min<std::size_t>(sizes.size(), 5); ++i)
      list += fmt::format("{}{}", i == 0 ? "" : ", ", sizes[i]);
    report_.several =
        fmt::format("{} separate bodies in one surface, of {}{} triangles; keep one, or give each a file of its own",
                    sizes.size(), list, sizes.size() > 5 ? ", ..." : "");
  }

  const TriangleMesh& input_;
  const SurfaceRequirements& requirements_;
  std::string who_;
  Box3 box_;
  std::vector<Vec3> positions_;
  std::vector<std::int32_t> origin_;  // 0-based vertex of the input
  std::vector<std::array<VertexId, 3>> triangles_;
  std::vector<std::int32_t> source_;  // 0-based triangle of the input
  std::vector<char> turned_;
  std::vector<EdgeUse> uses_;
  std::vector<std::int32_t> across_;  // per half-edge, by vertices whichever way they run
  std::vector<std::int32_t> part_;
  std::vector<Part> parts_;
  std::vector<std::size_t> part_start_, part_triangles_;  // only where there are several parts
  std::size_t welded_ = 0, collapsed_ = 0, parted_edges_ = 0;
  bool closed_ = false, doubled_ = false;
  std::string done_so_far_;
  SurfaceReport report_;
};

}  // namespace

std::optional<ExtentFault> extent_fault(const Box3& box) {
  const Vec3 size = box.size();
  const double largest = std::max({size.x, size.y, size.z});
  const double diagonal = largest > 0 && std::isfinite(largest)
                              ? largest * norm({size.x / largest, size.y / largest, size.z / largest})
                              : largest;
  if (!(diagonal >= kSmallestDiagonal && diagonal <= kLargestDiagonal)) {
    return ExtentFault{
        fmt::format("{}{:.3g} m across, and sizes from {:g} to {:g} m can be worked with",
                    std::isfinite(diagonal) ? "" : "more than ",
                    std::fmin(diagonal, std::numeric_limits<double>::max()), kSmallestDiagonal, kLargestDiagonal),
        "give `scale` (--scale) the factor that turns the file's units into metres"};
  }
  double distance = 0;
  for (const double c : {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z}) {
    distance = std::max(distance, std::abs(c));
  }
  if (distance * std::numeric_limits<double>::epsilon() > kPositionSpacing * diagonal) {
    return ExtentFault{
        fmt::format("{:.3g} m across but lies {:.3g} m from the origin, where positions are only good to {:.1g} m",
                    diagonal, distance, distance * std::numeric_limits<double>::epsilon()),
        "move it to the origin"};
  }
  return {};
}

/// Before anything is welded: stray vertices are what sets the size of the surface then, and with it what lies at one place.
static Status check_needles(const TriangleMesh& mesh, const std::string& who) {
  const std::vector<VertexId> needles = find_needles(mesh, first_at_place(mesh.positions.raw()));
  if (needles.empty()) return {};
  const VertexId v = needles.front();
  const std::string first = fmt::format("vertex {} at {}", v.value + 1, place(mesh.positions[v]));
  if (needles.size() == 1)
    return bad_input(
        fmt::format("{}{} sticks out of the surface like a needle; put it back, or remove it", who, first));
  return bad_input(
      fmt::format("{}{} vertices stick out of the surface like needles, the first is {}; put them back, or remove them",
                  who, needles.size(), first));
}

/// Whether used vertices lie at the very same place.
static bool has_lips(const TriangleMesh& mesh, const std::vector<char>& used) {
  const std::vector<std::int32_t> first = first_at_place(mesh.positions.raw());
  std::vector<char> taken(first.size(), 0);
  for (std::size_t v = 0; v < first.size(); ++v) {
    if (used[v] == 0) continue;
    char& there = taken[static_cast<std::size_t>(first[v])];
    if (there != 0) return true;
    there = 1;
  }
  return false;
}

/// Of the vertices that `weld` merges those at a seam of the texture, where corners at one place have different texture coordinates on
/// its two sides. Lips of a cut have the same. Each vertex of a place is compared with each; places with more than kMostAround corners stay as they are.
static std::vector<std::int32_t> weld_seams(const TriangleMesh& mesh, const std::vector<std::int32_t>& weld) {
  UnionFind same(mesh.positions.size());
  struct Corner {
    std::int32_t place, vertex;
    float u, v;
  };
  std::vector<std::int32_t> members(mesh.positions.size(), 0);
  for (std::size_t v = 0; v < weld.size(); ++v) ++members[static_cast<std::size_t>(weld[v])];
  std::vector<Corner> corners;
  for (const TriangleId t : ids<TriangleId>(mesh.triangles.size()))
    for (std::size_t k = 0; k < 3; ++k) {
      const VertexId v = mesh.triangles[t][k];
      if (members[static_cast<std::size_t>(weld[v.index()])] < 2) continue;
      const Vec2f uv = mesh.texture[t][k];
      corners.push_back({weld[v.index()], v.value, uv.x, uv.y});
    }
  const auto key = [](const Corner& c) { return std::tie(c.place, c.vertex, c.u, c.v); };
  std::sort(corners.begin(), corners.end(), [&](const Corner& a, const Corner& b) { return key(a) < key(b); });
  const auto end =
      std::unique(corners.begin(), corners.end(), [&](const Corner& a, const Corner& b) { return key(a) == key(b); });
  corners.erase(end, corners.end());
  const auto shares = [&](std::span<const Corner> a, std::span<const Corner> b) {
    for (const Corner& x : a)
      for (const Corner& y : b)
        if (x.u == y.u && x.v == y.v) return true;
    return false;
  };
  std::vector<std::span<const Corner>> here;
  for (std::size_t i = 0; i < corners.size();) {
    here.clear();
    std::size_t j = i;
    while (j < corners.size() && corners[j].place == corners[i].place) {
      std::size_t k = j;
      while (k < corners.size() && corners[k].place == corners[i].place && corners[k].vertex == corners[j].vertex) ++k;
      here.push_back(std::span<const Corner>(corners).subspan(j, k - j));
      j = k;
    }
    const std::size_t compared = j - i > kMostAround ? 0 : here.size();
    for (std::size_t a = 0; a < compared; ++a)
      for (std::size_t b = a + 1; b < compared; ++b)
        if (!shares(here[a], here[b])) same.join(here[a][0].vertex, here[b][0].vertex);
    i = j;
  }
  return roots_of(same);
}

/// Corners that miss each other by more than the tolerance are the most frequent fault of files in float32: the distance that would do, in
/// metres. `shortest`: edge; from there on triangles collapse. `tried`: the welding that was made.
static std::optional<double> weld_that_would_do(const TriangleMesh& mesh, const SurfaceRequirements& requirements,
                                                const Box3& box, double shortest, std::vector<std::int32_t> tried,
                                                bool closed, std::size_t bodies) {
  std::vector<double> distances;
  for (const double fraction : kWeldsToTry)
    if (fraction * box.diagonal() < shortest) distances.push_back(fraction * box.diagonal());
  if (distances.empty()) return std::nullopt;
  // The largest merges all that the others do: for most surfaces nothing.
  if (weld_within(mesh, box, distances.back()) == tried) return std::nullopt;
  SurfaceRequirements any = requirements;
  any.closedness = Closedness::kAny;
  std::optional<double> best;
  for (const double distance : distances) {
    std::vector<std::int32_t> weld = weld_within(mesh, box, distance);
    if (weld == tried) continue;
    SurfacePass pass(mesh, any, box, &weld);
    tried = std::move(weld);
    if (!pass.run() || pass.collapsed() > 0) continue;
    if (!(pass.closed() && !closed) && !(pass.closed() >= closed && pass.bodies() < bodies)) continue;
    best = distance;
    closed = pass.closed();
    bodies = pass.bodies();
  }
  return best;
}

Result<SurfaceReport> check_surface(TriangleMesh& mesh, const SurfaceRequirements& requirements) {
  const std::string who = prefix(requirements);
  KERF_TRY(check_elements(mesh, who));
  if (!(requirements.weld_tolerance >= 0 && requirements.weld_tolerance < 0.01)) {
    return bad_input(fmt::format("{}the weld tolerance is {}, but must be a fraction of the diagonal from 0 to 0.01",
                                 who, requirements.weld_tolerance));
  }
  std::vector<std::string> warnings;
  const Result<Box3> box = check_scale(mesh, who, warnings);
  if (!box) return box.error();
  if (requirements.weld && !(*requirements.weld >= 0 && *requirements.weld < kMostWeld * box->diagonal())) {
    return bad_input(fmt::format(
        "{}weld is {:g} m, but the surface is {:.3g} m across: vertices further apart than a hundredth of that are "
        "no copies of each other; give a smaller distance, or 0 to merge none",
        who, *requirements.weld, box->diagonal()));
  }
  const Edges edges = edges_of(mesh);
  if (requirements.weld && *requirements.weld > edges.mean) {
    return bad_input(fmt::format(
        "{}weld is {:g} m, but the mean edge is {:.3g} m: triangles would collapse; give a smaller distance", who,
        *requirements.weld, edges.mean));
  }

  if (requirements.bindable) KERF_TRY(check_needles(mesh, who));
  const auto deliver = [&](SurfacePass& pass, const std::string& way_out = {}) -> Result<SurfaceReport> {
    KERF_TRY(pass.allow_several(way_out));
    SurfaceReport report = pass.finish(mesh);
    report.warnings = warnings;
    return report;
  };
  const bool asked = requirements.weld.has_value();
  const double tolerance = asked ? *requirements.weld : requirements.weld_tolerance * box->diagonal();
  std::vector<std::int32_t> weld;
  if (tolerance > 0) weld = weld_within(mesh, *box, tolerance);
  else if (!asked) weld = first_at_place(mesh.positions.raw());
  std::vector<char> used(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (const VertexId v : t) used[v.index()] = 1;
  }
  std::size_t coinciding = 0;
  for (std::size_t v = 0; v < weld.size(); ++v) {
    coinciding += used[v] != 0 && weld[v] != static_cast<std::int32_t>(v) ? 1 : 0;
  }
  const auto judged = [&](SurfacePass& pass, const Status& status) -> Result<SurfaceReport> {
    const bool alone = pass.closed() || pass.bodies() == 0;
    std::optional<double> distance;
    if (!asked && (pass.bodies() > 1 || (pass.bodies() == 1 && !alone)))
      distance = weld_that_would_do(mesh, requirements, *box, edges.shortest, weld, pass.closed(), pass.bodies());
    const std::string way =
        distance ? fmt::format(
                       "corners that should be one lie up to {:.2g} m apart; a weld distance of that joins them "
                       "(--weld {:.2g})",
                       *distance, *distance)
                 : std::string();
    if (!status) {
      Error error = status.error();
      if (distance) error.message += "; " + way;
      return error;
    }
    if (distance) warnings.push_back(who + way);
    return deliver(pass, way);
  };
  if (coinciding == 0 || asked) {
    SurfacePass pass(mesh, requirements, *box, coinciding == 0 ? nullptr : &weld);
    const Status status = pass.run();
    return judged(pass, status);
  }

  // Some vertices coincide. A surface that is closed without welding has them apart on purpose, and one that
  // welding breaks or joins nowhere along an edge too; one that welding closes has seams, and so has one of loose triangles.
  const auto at_one_place = [&](std::size_t count) {
    return fmt::format("{} at the same place as others", counted(count, "vertex lies", "vertices lie"));
  };
  std::size_t welded_bodies = 0;  // 0: welding breaks it
  const auto deliver_apart = [&](SurfacePass& pass) {
    std::string way_out;
    if (const std::size_t stayed = coinciding - pass.welded(); stayed > 0) {
      warnings.push_back(who + at_one_place(stayed) + " and stayed apart");
      pass.put_at_one_place(weld);
      if (!pass.closed() && welded_bodies > 0 && welded_bodies < pass.bodies())
        way_out = fmt::format("{}: if those are seams, a weld distance joins them (--weld {:.2g})",
                              at_one_place(stayed), tolerance);
    }
    return deliver(pass, way_out);
  };
  SurfacePass apart(mesh, requirements, *box, nullptr);
  const Status apart_status = apart.run();
  const bool lips = has_lips(mesh, used);
  if (apart.closed() && lips) {
    if (!apart_status) return apart_status.error();
    return deliver_apart(apart);
  }
  SurfacePass welded(mesh, requirements, *box, &weld);
  const Status welded_status = welded.run();
  if (welded_status) welded_bodies = welded.bodies();
  if (apart.closed()) {
    // Nearly equal corners of slivers.
    if (welded_status && welded.closed() && welded.bodies() == apart.bodies()) return deliver(welded);
    if (!apart_status) return apart_status.error();
    return deliver_apart(apart);
  }
  if (welded.closed() || welded.doubled() || apart.is_soup()) return judged(welded, welded_status);
  if (apart_status && welded_status && welded.border_edges() == apart.border_edges()) return deliver_apart(apart);
  std::optional<SurfacePass> sewn;
  Status kept_status = apart_status;
  if (mesh.has_texture()) {
    const std::vector<std::int32_t> seams = weld_seams(mesh, weld);
    sewn.emplace(mesh, requirements, *box, &seams);
    kept_status = sewn->run();
  }
  SurfacePass& kept = sewn ? *sewn : apart;
  if (kept_status) return deliver_apart(kept);
  if (!welded_status) {
    if (apart_status) return deliver_apart(apart);
    return welded_status.error();
  }
  return deliver(welded);
}

}  // namespace kerf
