#include "kerf/midsurface/remesh.h"

#include <algorithm>
#include <cmath>

#include "kerf/midsurface/edit_mesh.h"
#include "kerf/midsurface/tolerances.h"
#include "kerf/midsurface/triangle_shape.h"

namespace kerf::mid {
namespace {

constexpr double kCollapse = 0.78, kSplit = 1.35;  // of the wanted length
constexpr double kLongest = 1.7;                   // of the wanted length: no collapse makes a longer edge
constexpr double kRemeshTurn = 0.31,
                 kTurnFirst = -0.17;     // cosines: 72 degrees; 100 while the squeezed wall is still there
constexpr double kGuarded = 0.4;         // of the wanted length: faces with longer edges are guarded
constexpr double kAgree = 0.26;          // cosine between a face and the sheet
constexpr double kSagittaOfEdge = 0.25;  // how far a border edge's middle may be off its curve, of its length
constexpr double kCornerReach = 0.35;
constexpr double kCoarsen = 1.5;  // from level to level

class Remesher {
 public:
  Remesher(const SheetSampler& sampler, const SheetSizes& sizes) : r_(sampler), sizes_(sizes.size) {
    const MidSheet& sheet = r_.sheet();
    m_.mesh = sheet.mesh;
    m_.normal = sheet.normal;
    m_.half_thickness = sheet.half_thickness;
    m_.size = sizes.size;
    m_.curve.assign(m_.size.size(), -1);
    m_.along.assign(m_.size.size(), 0);
    m_.fixed.assign(m_.size.size(), 0);
    for (std::size_t l = 0; l < r_.loops().size(); ++l)
      for (std::size_t i = 0; i < r_.loops()[l].size(); ++i) {
        const std::int32_t v = r_.loops()[l][i];
        m_.curve[v] = static_cast<std::int32_t>(l);
        m_.along[v] = r_.curves()[l].start(i);
      }
    find_corners();
  }

  CoarseMesh run(double target) {
    double ratio = 0;
    std::size_t edges = 0;
    for (std::int32_t h = 0; h < m_.mesh.origin.count(); ++h)
      if (m_.mesh.is_edge(h)) {
        ratio += m_.mesh.length(h) / wanted(h);
        ++edges;
      }
    level_ = std::min(1.0, ratio / static_cast<double>(edges));
    for (first_stage_ = true; level_ < 1; level_ = std::min(1.0, kCoarsen * level_)) {
      pass(false, level_ > 0.4 ? 2 : 1);
      compact();
    }
    level_ = 1;
    pass(false, 2);
    first_stage_ = false;
    for (int i = 0; i < 4; ++i) pass(true, 2);
    for (int i = 0; i < 10; ++i) {
      compact();
      const double n = m_.mesh.face_count();
      if (std::fabs(n - target) <= 0.03 * target) break;
      level_ *= std::clamp(std::sqrt(n / target), 0.7, 1.4);
      for (int k = 0; k < 3; ++k) pass(true, 2);
    }
    compact();
    return std::move(m_);
  }

 private:
  [[nodiscard]] double wanted(std::int32_t h) const {
    return 0.5 * level_ * (m_.size[m_.mesh.from(h)] + m_.size[m_.mesh.to(h)]);
  }
  [[nodiscard]] const BorderCurve& curve_of(std::int32_t v) const {
    return r_.curves()[static_cast<std::size_t>(m_.curve[v])];
  }

  void find_corners() {
    for (std::size_t l = 0; l < r_.loops().size(); ++l) {
      const BorderCurve& c = r_.curves()[l];
      const std::vector<std::int32_t>& loop = r_.loops()[l];
      const std::size_t n = loop.size();
      std::vector<double> turn(n);
      for (std::size_t i = 0; i < n; ++i) turn[i] = c.turn(c.start(i), kCornerReach * m_.size[loop[i]]);
      for (std::size_t i = 0; i < n; ++i) {
        if (turn[i] <= kCornerTurn) continue;
        const double reach = kCornerReach * m_.size[loop[i]];
        bool largest = true;
        for (std::size_t k = 1; k < n && largest; ++k) {
          const std::size_t j = (i + k) % n;
          if (c.ahead(c.start(i), c.start(j)) > reach) break;
          largest = turn[j] < turn[i];
        }
        for (std::size_t k = 1; k < n && largest; ++k) {
          const std::size_t j = (i + n - k) % n;
          if (c.ahead(c.start(j), c.start(i)) > reach) break;
          largest = turn[j] <= turn[i];
        }
        m_.fixed[loop[i]] = largest;
      }
    }
  }

  void pass(bool with_splits, int smoothings) {
    if (with_splits) split_long();
    collapse_short();
    flip_for_angles(m_);
    for (int i = 0; i < smoothings; ++i) smooth();
    flip_for_angles(m_);
  }

  struct Ranked {
    double ratio;
    std::int32_t h;
  };
  template <class Keep>
  std::vector<Ranked> ranked_edges(Keep&& keep) const {
    std::vector<Ranked> out;
    for (std::int32_t h = 0; h < m_.mesh.origin.count(); ++h) {
      if (!m_.mesh.is_edge(h)) continue;
      const double ratio = m_.mesh.length(h) / wanted(h);
      if (keep(ratio)) out.push_back({ratio, h});
    }
    return out;
  }

  void collapse_short() {
    std::vector<Ranked> edges = ranked_edges([](double ratio) { return ratio < kCollapse; });
    std::sort(edges.begin(), edges.end(),
              [](const Ranked& a, const Ranked& b) { return a.ratio != b.ratio ? a.ratio < b.ratio : a.h < b.h; });
    for (const Ranked& e : edges)
      if (m_.mesh.origin[e.h] >= 0 && m_.mesh.length(e.h) < kCollapse * wanted(e.h)) try_collapse(e.h);
  }

  /// What the vertex that remains of edge h becomes.
  struct Merged {
    SheetSampler::Sample sample;
    std::int32_t curve = -1;
    double along = 0;
    std::uint8_t fixed = 0;
  };

  bool merged_border(std::int32_t a, std::int32_t b, Merged& out) const {
    if (m_.fixed[a] && m_.fixed[b]) return false;
    out.curve = m_.curve[a];
    out.fixed = m_.fixed[a] || m_.fixed[b];
    const BorderCurve& c = curve_of(a);
    if (m_.fixed[a]) out.along = m_.along[a];
    else if (m_.fixed[b]) out.along = m_.along[b];
    else out.along = c.wrap(m_.along[a] + 0.5 * c.ahead(m_.along[a], m_.along[b]));
    out.sample = at_border(c.at(out.along), a);
    return true;
  }

  [[nodiscard]] SheetSampler::Sample at_border(Vec3 p, std::int32_t like) const {
    SheetSampler::Sample s = r_.closest(p, m_.normal[like], sizes_);
    if (s.distance == HUGE_VAL) s = {p, m_.normal[like], 0, m_.size[like], 0, false};
    s.point = p;
    return s;
  }

  void try_collapse(std::int32_t h) {
    SurfaceMesh& m = m_.mesh;
    std::int32_t a = m.from(h), b = m.to(h);
    if (m_.curve[a] >= 0 && m_.curve[b] < 0) {  // the border's vertex stays
      h = m.twin[h];
      std::swap(a, b);
    }
    if (!can_collapse(m, h, scratch_)) return;
    Merged to;
    if (m_.curve[a] >= 0) {
      if (!merged_border(a, b, to)) return;
    } else if (m_.curve[b] >= 0) {
      to = {{m.position[b], m_.normal[b], m_.half_thickness[b], m_.size[b], 0, false},
            m_.curve[b],
            m_.along[b],
            m_.fixed[b]};
    } else {
      to.sample = r_.closest(0.5 * (m.position[a] + m.position[b]), m_.normal[b], sizes_);
      if (to.sample.distance == HUGE_VAL) return;
    }
    if (!keeps_shape(a, b, to) || !keeps_shape(b, a, to)) return;
    collapse(m, h);
    m.position[b] = to.sample.point;
    m_.normal[b] = to.sample.normal;
    m_.half_thickness[b] = to.sample.half_thickness;
    m_.size[b] = to.sample.size;
    m_.curve[b] = to.curve;
    m_.along[b] = to.along;
    m_.fixed[b] = to.fixed;
  }

  /// Would the faces around v, but for those at `other`, be good with v moved?
  [[nodiscard]] bool keeps_shape(std::int32_t v, std::int32_t other, const Merged& to) const {
    const SurfaceMesh& m = m_.mesh;
    const Vec3 place = to.sample.point;
    bool good = true;
    m.for_each_outgoing(v, [&](std::int32_t e) {
      const std::int32_t x = m.to(e), y = m.apex(e);
      if (!good) return;
      const Vec3 p = m.position[x], q = m.position[y];
      for (const std::int32_t u : {x, y}) {
        if (u == other) continue;
        const double length = norm(m.position[u] - place), limit = 0.5 * level_ * (m_.size[u] + to.sample.size);
        if (length > kLongest * limit && length > norm(m.position[u] - m.position[v])) good = false;
      }
      if (x == other || y == other || !good) return;
      const Vec3 old = cross(p - m.position[v], q - m.position[v]), now = cross(p - place, q - place);
      const double old_size = norm(old), longest = std::max(norm(p - m.position[v]), norm(q - m.position[v]));
      if (old_size > 1e-3 * longest * longest) {
        if (dot(old, now) <= (first_stage_ ? kTurnFirst : kRemeshTurn) * old_size * norm(now)) good = false;
      }
      if (good && !on_sheet(place, p, q, to.sample.normal + m_.normal[x] + m_.normal[y],
                            level_ * (to.sample.size + m_.size[x] + m_.size[y]) / 3))
        good = false;
      // New border edges follow their curve.
      if (good && m.twin[e] < 0 && to.curve >= 0) good = follows_curve(place, to.along, p, m_.along[x], to.curve);
      if (good && m.twin[SurfaceMesh::prev(e)] < 0 && to.curve >= 0)
        good = follows_curve(q, m_.along[y], place, to.along, to.curve);
    });
    return good;
  }

  [[nodiscard]] bool follows_curve(Vec3 p, double s, Vec3 q, double t, std::int32_t curve) const {
    const BorderCurve& c = r_.curves()[static_cast<std::size_t>(curve)];
    const double length = norm(q - p);
    const Vec3 middle = c.at(s + 0.5 * c.ahead(s, t));
    return norm(0.5 * (p + q) - middle) <= kSagittaOfEdge * length + 1e-3 * level_ * length;
  }

  /// Does a large face lie along the sheet, and not across to another layer?
  [[nodiscard]] bool on_sheet(Vec3 a, Vec3 b, Vec3 c, Vec3 normal, double size) const {
    if (std::max({norm(b - a), norm(c - b), norm(a - c)}) <= kGuarded * size) return true;
    const Vec3 centre = (1.0 / 3) * (a + b + c);
    const SheetSampler::Sample s = r_.closest(centre, normal, sizes_);
    if (s.distance > std::min(0.35 * size, std::max(0.6 * s.half_thickness, 0.1 * size))) return false;
    const Vec3 n = cross(b - a, c - a);
    return dot(n, s.normal) > kAgree * norm(n);
  }

  void split_long() {
    std::vector<Ranked> edges = ranked_edges([](double ratio) { return ratio > kSplit; });
    std::sort(edges.begin(), edges.end(),
              [](const Ranked& a, const Ranked& b) { return a.ratio != b.ratio ? a.ratio > b.ratio : a.h < b.h; });
    for (const Ranked& e : edges) {
      SurfaceMesh& m = m_.mesh;
      if (m.length(e.h) <= kSplit * wanted(e.h)) continue;
      const std::int32_t a = m.from(e.h), b = m.to(e.h);
      Merged to;
      if (m.twin[e.h] < 0) {
        const BorderCurve& c = curve_of(a);
        to.curve = m_.curve[a];
        to.along = c.wrap(m_.along[a] + 0.5 * c.ahead(m_.along[a], m_.along[b]));
        to.sample = at_border(c.at(to.along), a);
      } else {
        to.sample = r_.closest(0.5 * (m.position[a] + m.position[b]), m_.normal[a] + m_.normal[b], sizes_);
        if (to.sample.distance == HUGE_VAL) continue;
      }
      split(m, e.h, to.sample.point);
      m_.normal.push_back(to.sample.normal);
      m_.half_thickness.push_back(to.sample.half_thickness);
      m_.size.push_back(to.sample.size);
      m_.curve.push_back(to.curve);
      m_.along.push_back(to.along);
      m_.fixed.push_back(0);
    }
  }

  void smooth() {
    for (std::int32_t v = 0; v < m_.mesh.vertex_count(); ++v) {
      if (!m_.mesh.has_vertex(v) || m_.fixed[v]) continue;
      if (m_.curve[v] >= 0) slide(v);
      else relax(v);
    }
  }

  void slide(std::int32_t v) {
    SurfaceMesh& m = m_.mesh;
    const BorderCurve& c = curve_of(v);
    std::int32_t before = -1;
    m.for_each_outgoing(v, [&](std::int32_t e) {
      if (m.twin[SurfaceMesh::prev(e)] < 0) before = m.apex(e);
    });
    const std::int32_t after = m.to(m.outgoing[v]);
    if (before < 0 || before == after) return;
    const double back = c.ahead(m_.along[before], m_.along[v]), forth = c.ahead(m_.along[v], m_.along[after]);
    // Lengths on both sides in proportion to the wanted ones.
    const double wanted_back = m_.size[before] + m_.size[v], wanted_forth = m_.size[after] + m_.size[v];
    const double ideal = (back + forth) * wanted_back / (wanted_back + wanted_forth);
    const double along = c.wrap(m_.along[v] + 0.5 * (ideal - back));
    const Vec3 place = c.at(along);
    if (!may_move(v, place)) return;
    m.position[v] = place;
    m_.along[v] = along;
  }

  void relax(std::int32_t v) {
    SurfaceMesh& m = m_.mesh;
    Vec3 sum;
    double weight = 0;
    m.for_each_outgoing(v, [&](std::int32_t e) {
      const Vec3 p = m.position[m.to(e)], q = m.position[m.apex(e)], o = m.position[v];
      const double s = m_.size[v] + m_.size[m.to(e)] + m_.size[m.apex(e)];
      const double w = norm(cross(p - o, q - o)) / (s * s);
      sum += (w / 3) * (o + p + q);
      weight += w;
    });
    if (!(weight > 0)) return;
    const Vec3 n = m_.normal[v];
    Vec3 move = (1 / weight) * sum - m.position[v];
    move = move - dot(move, n) * n;
    const SheetSampler::Sample s = r_.closest(m.position[v] + move, n, sizes_);
    if (s.distance == HUGE_VAL || !may_move(v, s.point)) return;
    m.position[v] = s.point;
    m_.normal[v] = s.normal;
    m_.half_thickness[v] = s.half_thickness;
    m_.size[v] = s.size;
  }

  /// No face turns over or gets a sharper angle than 10 degrees that was blunter.
  [[nodiscard]] bool may_move(std::int32_t v, Vec3 place) const {
    constexpr double kSharp = 10 * 0.017453292519943295;
    const SurfaceMesh& m = m_.mesh;
    const Vec3 o = m.position[v];
    bool good = true;
    m.for_each_outgoing(v, [&](std::int32_t e) {
      if (!good) return;
      const Vec3 p = m.position[m.to(e)], q = m.position[m.apex(e)];
      const Vec3 old = cross(p - o, q - o), now = cross(p - place, q - place);
      if (dot(old, now) <= kRemeshTurn * norm(old) * norm(now) && !(norm(old) == 0)) good = false;
      if (!first_stage_ && good) {
        const double angle = smallest_angle(place, p, q);
        if (angle < kSharp && angle < smallest_angle(o, p, q)) good = false;
      }
    });
    return good;
  }

  void compact() {
    std::vector<std::int32_t> from;
    m_.mesh = compacted(m_.mesh, &from);
    const auto gather = [&](auto& column) {
      std::remove_reference_t<decltype(column)> out;
      out.reserve(from.size());
      for (const std::int32_t v : from) out.push_back(column[v]);
      column = std::move(out);
    };
    gather(m_.normal);
    gather(m_.half_thickness);
    gather(m_.size);
    gather(m_.curve);
    gather(m_.along);
    gather(m_.fixed);
    scratch_ = {};
  }

  const SheetSampler& r_;
  const Column<double>& sizes_;
  CoarseMesh m_;
  LinkScratch scratch_;
  double level_ = 1;  ///< lengths in units of size are counted with this factor
  bool first_stage_ = true;
};

}  // namespace

SheetSampler::SheetSampler(const MidSheet& sheet)
    : sheet_(sheet), view_(sheet.mesh.view()), bvh_(view_), loops_(border_loops(sheet.mesh)) {
  face_normal_.resize(static_cast<std::size_t>(sheet.mesh.face_count()));
  for (std::int32_t f = 0; f < sheet.mesh.face_count(); ++f) {
    Vec3 sum;
    for (int k = 0; k < 3; ++k) sum += sheet.normal[sheet.mesh.origin[3 * f + k]];
    face_normal_[f] = normalized(sum);
  }
  for (const auto& loop : loops_) {
    std::vector<Vec3> points;
    points.reserve(loop.size());
    for (const std::int32_t v : loop) points.push_back(sheet.mesh.position[v]);
    curves_.emplace_back(std::move(points));
  }
}

SheetSampler::Sample SheetSampler::closest(Vec3 p, Vec3 normal, const Column<double>& size) const {
  const ClosestPoint c = bvh_.closest(view_, p, HUGE_VAL, [&](const ClosestPoint& candidate) {
    return dot(face_normal_[candidate.triangle], normal) > 0;
  });
  Sample out;
  if (!c.valid()) return out;
  out.point = c.point;
  out.distance = c.distance;
  double trust = 0;
  for (int k = 0; k < 3; ++k) {
    const std::int32_t v = sheet_.mesh.origin[3 * c.triangle + k];
    const double b = c.barycentric[static_cast<std::size_t>(k)];
    out.normal += b * sheet_.normal[v];
    out.half_thickness += b * sheet_.half_thickness[v];
    out.size += b * size[v];
    trust += b * sheet_.trusted[v];
  }
  out.trusted = trust > 0.5;
  out.normal = normalized(out.normal);
  return out;
}

CoarseMesh remesh(const SheetSampler& sheet, const SheetSizes& sizes, double target) {
  return Remesher(sheet, sizes).run(target);
}

void flip_for_angles(CoarseMesh& coarse) {
  SurfaceMesh& m = coarse.mesh;
  for (int round = 0; round < 3; ++round) {
    int flipped = 0;
    for (std::int32_t h = 0; h < m.origin.count(); ++h) {
      if (m.origin[h] < 0 || m.twin[h] < h) continue;
      const std::int32_t t = m.twin[h];
      const std::int32_t ia = m.from(h), ib = m.to(h), ic = m.apex(h), id = m.apex(t);
      const Vec3 a = m.position[ia], b = m.position[ib], c = m.position[ic], d = m.position[id];
      const double now = std::min(smallest_angle(a, b, c), smallest_angle(b, a, d)),
                   then = std::min(smallest_angle(d, c, a), smallest_angle(c, d, b));
      if (then <= now * (1 + 1e-9) || !can_flip(m, h)) continue;
      const Vec3 n = cross(b - a, c - a) + cross(a - b, d - b), n1 = cross(c - d, a - d), n2 = cross(d - c, b - c);
      if (dot(n1, n) <= kRemeshTurn * norm(n) * norm(n1) || dot(n2, n) <= kRemeshTurn * norm(n) * norm(n2)) continue;
      const Vec3 sheet = coarse.normal[ia] + coarse.normal[ib] + coarse.normal[ic] + coarse.normal[id];
      if (dot(n1, sheet) <= 0 || dot(n2, sheet) <= 0) continue;
      // An edge that cuts a corner of the sheet off or joins two layers is longer and far from the old one.
      if (norm(0.5 * (a + b) - 0.5 * (c + d)) > 0.7 * std::max(norm(b - a), norm(d - c))) continue;
      // No inner edge between two border vertices unless there is one already.
      if (coarse.curve[ic] >= 0 && coarse.curve[id] >= 0 && !(coarse.curve[ia] >= 0 && coarse.curve[ib] >= 0)) continue;
      flip(m, h);
      ++flipped;
    }
    if (flipped == 0) return;
  }
}

}  // namespace kerf::mid
