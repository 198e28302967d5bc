#include "kerf/midsurface/mid_sheet.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "kerf/base/parallel.h"
#include "kerf/midsurface/laplacian.h"
#include "kerf/midsurface/two_sided_ray.h"

namespace kerf::mid {
namespace {

constexpr double kReach = 0.35;     // of a thickness: how far a datum speaks
constexpr double kAlmost = 0.97;    // of the way to the middle: the wall that collapses keeps a little area
constexpr double kMargin = 1.4;     // half thicknesses from the rim: nearer, rays meet its wall
constexpr double kUpright = 0.5;    // cosine between a face and the smooth normal
constexpr double kSureWedge = 0.1;  // confidence of a wedge of 44 degrees
constexpr int kBorderSteps = 6;
constexpr int kMoveSteps = 40;
constexpr double kBorderLeash = 2.5;  // of the half thickness: how far the border moves in a round
constexpr double kSameWall = 0.5;     // cosine between the wall at the border and where the sheet would meet it
constexpr double kFilledHole = 1;     // thicknesses around: holes much narrower than the body is thick
constexpr int kRefinements = 3;
constexpr double kRayFacing = 4;  // power of the cosine between the sides that a ray meets
constexpr std::size_t kSheetGrain = 512;

/// Evens out the staircase that the marching triangles leave; the border stays on the surface.
void smooth_border(SurfaceMesh& m, const SheetInput& in) {
  const TriangleView view = in.work.mesh.view();
  for (const std::vector<std::int32_t>& loop : border_loops(m)) {
    const std::size_t n = loop.size();
    std::vector<Vec3> p(n), q(n);
    for (std::size_t i = 0; i < n; ++i) p[i] = m.position[loop[i]];
    for (int step = 0; step < kBorderSteps; ++step) {
      for (std::size_t i = 0; i < n; ++i) {
        const Vec3 mean = 0.25 * p[(i + n - 1) % n] + 0.5 * p[i] + 0.25 * p[(i + 1) % n];
        const ClosestPoint c = in.bvh.closest(view, mean, 4 * in.work.thickness);
        q[i] = c.valid() ? c.point : mean;
      }
      p.swap(q);
    }
    for (std::size_t i = 0; i < n; ++i) m.position[loop[i]] = p[i];
  }
}

/// |V| of the sheet: mean confidence of the faces around.
Column<double> vertex_confidence(const SideSheet& side, const Pairing& pairing) {
  const SurfaceMesh& m = side.mesh;
  Column<double> sum(m.position.size(), 0), area(m.position.size(), 0);
  for (std::int32_t f = 0; f < m.face_count(); ++f)
    for (int k = 0; k < 3; ++k) {
      const std::int32_t v = m.origin[3 * f + k];
      const double a = m.area(f);
      sum[v] += a * pairing.pair[side.parent[f]].confidence;
      area[v] += a;
    }
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) sum[v] = area[v] > 0 ? sum[v] / area[v] : 0;
  return sum;
}

/// Vertices on whose faces normals mean something: far enough from the rim, whose squeezed wall is full of folds, and sure
/// of what lies opposite, which the wall of a wedge is not.
Column<std::uint8_t> trusted_vertices(const SurfaceMesh& m, const Column<double>& from_border,
                                      const Column<double>& half_thickness, const Column<double>& confidence,
                                      double edge, double margin) {
  Column<std::uint8_t> out(m.position.size(), 0);
  std::size_t count = 0;
  std::vector<double> sorted(confidence);
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double least = std::min(kSureWedge, *middle);
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    out[v] = confidence[v] >= least && from_border[v] > std::max(margin * half_thickness[v], 1.5 * edge);
    count += out[v];
  }
  if (count == 0) {  // a very narrow body: what is farthest from the border will have to do
    double farthest = 0;
    for (const double d : from_border) farthest = std::max(farthest, d);
    for (std::int32_t v = 0; v < m.vertex_count(); ++v) out[v] = from_border[v] >= 0.5 * farthest;
  }
  return out;
}

/// Slivers of the surface fold over when they are moved: what they say about normals is noise.
bool distrust_folds(MidSheet& sheet);

/// (M + h^2/2 L) N = M n with masses from trusted faces only: smooth over a thickness, filled into the rim.
Column<Vec3> smooth_normals(const SurfaceMesh& m, const Column<double>& cot, const Column<std::uint8_t>& trusted,
                            double mean_half) {
  const std::int32_t n = m.vertex_count();
  std::vector<SparseEntry> entries;
  Column<double> weights = cot;
  for (double& w : weights) w *= 0.5 * mean_half * mean_half;
  add_laplacian(m, weights, entries);
  std::vector<double> right[3];
  for (auto& r : right) r.assign(static_cast<std::size_t>(n), 0);
  double largest = 0;
  for (std::int32_t f = 0; f < m.face_count(); ++f) largest = std::max(largest, m.area(f));
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    bool use = true;
    for (int k = 0; k < 3; ++k) use = use && trusted[m.origin[3 * f + k]];
    if (!use) continue;
    const Vec3 a = m.area_vector(f);
    for (int k = 0; k < 3; ++k) {
      const std::int32_t v = m.origin[3 * f + k];
      entries.push_back({v, v, norm(a) / 6});
      for (int i = 0; i < 3; ++i) right[i][static_cast<std::size_t>(v)] += a[i] / 6;
    }
  }
  for (std::int32_t v = 0; v < n; ++v) entries.push_back({v, v, 1e-6 * largest});
  const SparseCholesky system(n, entries);
  for (auto& r : right) system.solve(r, r);
  Column<Vec3> out(m.position.size());
  for (std::int32_t v = 0; v < n; ++v) {
    const auto i = static_cast<std::size_t>(v);
    out[v] = normalized({right[0][i], right[1][i], right[2][i]});
  }
  return out;
}

bool distrust_folds(MidSheet& sheet) {
  const SurfaceMesh& m = sheet.mesh;
  std::vector<std::int32_t> folded;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    Vec3 n;
    bool all = true;
    for (int k = 0; k < 3; ++k) {
      n += sheet.normal[m.origin[3 * f + k]];
      all = all && sheet.trusted[m.origin[3 * f + k]];
    }
    if (all && dot(m.normal(f), normalized(n)) < kUpright) folded.push_back(f);
  }
  for (const std::int32_t f : folded)
    for (int k = 0; k < 3; ++k) sheet.trusted[m.origin[3 * f + k]] = 0;
  return !folded.empty();
}

/// Moves of the border to where the sheet, straightened out, meets the wall of the rim: the zero line lies in the middle of
/// the uncertain band, which on a slanted wall is beside the sheet. Smooth along the border; zero elsewhere.
Fields border_moves(const MidSheet& sheet, const SheetInput& in) {
  const SurfaceMesh& m = sheet.mesh;
  Fields out(m.position.size());
  const TriangleView view = in.work.mesh.view();
  const Column<std::int32_t> source = nearest_trusted(m, sheet.trusted);
  for (const std::vector<std::int32_t>& loop : border_loops(m)) {
    const std::size_t n = loop.size();
    double length = 0;
    for (std::size_t i = 0; i < n; ++i) length += norm(m.position[loop[(i + 1) % n]] - m.position[loop[i]]);
    if (length < kFilledHole * in.work.thickness) continue;  // straight on from all around would meet in a point
    std::vector<Vec3> move(n), smooth(n);
    std::vector<std::uint8_t> known(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
      const std::int32_t b = loop[i], q = source[b];
      if (q < 0) continue;
      const Vec3 to = m.position[b] - m.position[q], normal = sheet.normal[q];
      const Vec3 along = to - dot(to, normal) * normal;
      const double reach = norm(along);
      if (!(reach > 0)) continue;
      // Across a hole the wall looks back, and beside it the next wall is met: no part of the sheet leads to this one from q.
      const ClosestPoint wall = in.bvh.closest(view, m.position[b], in.work.thickness);
      if (wall.valid() && dot(in.pairing.normal[wall.triangle], along) <= 0) continue;
      const RayHit hit = in.bvh.first_hit(view, {m.position[q], (1 / reach) * along, 0, 3 * reach});
      if (!hit.valid() || dot(in.pairing.normal[hit.triangle], along) <= 0.5 * reach) continue;
      if (wall.valid() && dot(in.pairing.normal[hit.triangle], in.pairing.normal[wall.triangle]) <= kSameWall) continue;
      move[i] = m.position[q] + (hit.t / reach) * along - m.position[b];
      known[i] = norm(move[i]) <= kBorderLeash * sheet.half_thickness[q];
      if (!known[i]) move[i] = {};
    }
    if (std::find(known.begin(), known.end(), 1) == known.end()) continue;
    // Unknown moves from their neighbours', then all of them smooth along the border.
    for (int step = 0; step < kMoveSteps; ++step) {
      std::vector<std::uint8_t> next = known;
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t a = (i + n - 1) % n, b = (i + 1) % n;
        const double wa = known[a], wb = known[b], wi = 2.0 * known[i], sum = wa + wb + wi;
        if (sum == 0) continue;
        smooth[i] = (1 / sum) * (wa * move[a] + wi * move[i] + wb * move[b]);
        next[i] = 1;
      }
      move.swap(smooth);
      known.swap(next);
    }
    for (std::size_t i = 0; i < n; ++i) {
      const ClosestPoint c = in.bvh.closest(view, m.position[loop[i]] + move[i], 4 * in.work.thickness);
      if (c.valid()) move[i] = c.point - m.position[loop[i]];
      out[loop[i]] = {move[i].x, move[i].y, move[i].z, 0};
    }
  }
  return out;
}

/// Half thickness, smooth, with a free border: what is known goes on to the rim.
Column<double> free_half_thickness(const SurfaceMesh& m, const Column<double>& cot, std::span<const FieldDatum> data) {
  Column<double> out = smooth_free_field(m, cot, data);
  for (double& h : out) h = std::max(h, 0.0);
  return out;
}

/// Moves the trusted part of the sheet along its normals to where rays to both sides are equally long.
void centre(MidSheet& sheet, const SheetInput& in, const Column<double>& cot) {
  SurfaceMesh& m = sheet.mesh;
  const TwoSidedRays rays(in.work.mesh, in.bvh, in.labels.field, in.pairing.normal);
  const Column<double> area = vertex_areas(m);
  std::vector<FieldDatum> move(m.position.size(), FieldDatum{{-1, -1, -1}, 0, {}}), half = move;
  parallel_for(move.size(), kSheetGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto v = static_cast<std::int32_t>(i);
      if (!sheet.trusted[v]) continue;
      const auto hit = rays.cast(m.position[v], sheet.normal[v]);
      if (!hit) continue;
      const double t = hit->plus + hit->minus, reach = kReach * std::max(t, 1e-3 * in.work.thickness);
      const double w = std::pow(std::max(hit->facing, 0.0), kRayFacing) * area[v] / (reach * reach);
      const double along = 0.5 * (hit->plus - hit->minus) * std::max(dot(hit->direction, sheet.normal[v]), 0.5);
      move[i] = {{v, -1, -1}, w, {0, 0, 0, along}};
      half[i] = {{v, -1, -1}, w, {0, 0, 0, 0.5 * t}};
    }
  });
  std::erase_if(move, [](const FieldDatum& d) { return d.vertex[0] < 0; });
  std::erase_if(half, [](const FieldDatum& d) { return d.vertex[0] < 0; });
  const Column<double> by = smooth_free_field(m, cot, move);
  for (std::int32_t v = 0; v < m.vertex_count(); ++v)
    if (sheet.trusted[v]) m.position[v] += by[v] * sheet.normal[v];
  sheet.half_thickness = free_half_thickness(m, cot, half);
}

/// Takes the sheet straight on to the wall of the rim, and spans what lies between like a soap film.
void extend_to_rim(MidSheet& sheet, const SheetInput& in, const Column<double>& cot) {
  SurfaceMesh& m = sheet.mesh;
  const Fields move = border_moves(sheet, in);
  Column<std::uint8_t> kept = sheet.trusted;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (!m.on_border(v)) continue;
    m.position[v] += {move[v][0], move[v][1], move[v][2]};
    kept[v] = 1;
  }
  fill_positions(m, cot, kept, m.position);
  // A soap film on the tall wall of a narrow hole hangs into the hole.
  const TriangleView view = in.work.mesh.view();
  parallel_for(kept.size(), kSheetGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto v = static_cast<std::int32_t>(i);
      if (kept[v]) continue;
      const ClosestPoint wall = in.bvh.closest(view, m.position[v], 4 * in.work.thickness);
      if (wall.valid() && dot(m.position[v] - wall.point, in.pairing.normal[wall.triangle]) > 0)
        m.position[v] = wall.point;
    }
  });
}

/// Shortest ways along edges from some vertices: how far it is (infinite where none leads), and from which one (-1).
struct EdgeWays {
  Column<double> distance;
  Column<std::int32_t> source;
};

template <class IsSource>
EdgeWays ways_from(const SurfaceMesh& m, IsSource&& is_source) {
  EdgeWays ways{Column<double>(m.position.size(), HUGE_VAL), Column<std::int32_t>(m.position.size(), -1)};
  using Entry = std::pair<double, std::int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    if (!is_source(v)) continue;
    ways.distance[v] = 0;
    ways.source[v] = v;
    queue.emplace(0, v);
  }
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > ways.distance[v]) continue;
    m.for_each_neighbour(v, [&, from = d, at = v](std::int32_t u) {
      const double next = from + norm(m.position[u] - m.position[at]);
      if (next >= ways.distance[u]) return;
      ways.distance[u] = next;
      ways.source[u] = ways.source[at];
      queue.emplace(next, u);
    });
  }
  return ways;
}

}  // namespace

Column<std::int32_t> nearest_trusted(const SurfaceMesh& m, const Column<std::uint8_t>& trusted) {
  return ways_from(m, [&](std::int32_t v) { return trusted[v] != 0; }).source;
}

Column<double> distance_from_border(const SurfaceMesh& m) {
  return ways_from(m, [&](std::int32_t v) { return m.has_vertex(v) && m.on_border(v); }).distance;
}

MidSheet make_mid_sheet(SideSheet side, const SheetInput& in) {
  MidSheet out;
  const Column<double> confidence = vertex_confidence(side, in.pairing);
  out.mesh = std::move(side.mesh);
  SurfaceMesh& m = out.mesh;
  smooth_border(m, in);
  const Column<double> cot = cotangent_weights(m);
  out.from_border = distance_from_border(m);

  std::vector<FieldDatum> data;
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    const std::int32_t parent = side.parent[f];
    const Pair& q = in.pairing.pair[parent];
    if (!side.whole[f] || q.face < 0 || !(q.confidence > 0)) continue;
    if (field_at(in.work.mesh, in.labels.field, q.face, q.barycentric) > 0) continue;
    const double reach = kReach * std::max(q.distance, 0.05 * in.work.thickness);
    const Vec3 move = -0.5 * q.distance * in.pairing.normal[parent];
    data.push_back({{m.origin[3 * f], m.origin[3 * f + 1], m.origin[3 * f + 2]},
                    m.area(f) * q.confidence * q.confidence / (reach * reach),
                    {move.x, move.y, move.z, 0.5 * q.distance}});
  }
  const Fields field = smooth_fields(m, cot, data, Fields(m.position.size()));
  out.half_thickness = free_half_thickness(m, cot, data);
  double sum = 0;
  for (std::int32_t v = 0; v < m.vertex_count(); ++v) {
    const auto& x = field[v];
    m.position[v] += kAlmost * Vec3{x[0], x[1], x[2]};
    sum += out.half_thickness[v];
  }
  const double mean_half = std::max(sum / m.vertex_count(), 1e-3 * in.work.thickness);
  for (int round = 0; round <= kRefinements; ++round) {
    // At first the + side still has its half of the wall, which is about a half thickness high.
    if (round > 0) out.from_border = distance_from_border(m);
    const double margin = round > 0 ? kMargin : kMargin + 1;
    out.trusted = trusted_vertices(m, out.from_border, out.half_thickness, confidence, in.work.edge, margin);
    out.normal = smooth_normals(m, cot, out.trusted, mean_half);
    if (distrust_folds(out)) out.normal = smooth_normals(m, cot, out.trusted, mean_half);
    if (round == kRefinements) break;
    centre(out, in, cot);
    extend_to_rim(out, in, cot);
  }
  return out;
}

}  // namespace kerf::mid
