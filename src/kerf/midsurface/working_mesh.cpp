#include "kerf/midsurface/working_mesh.h"

#include <algorithm>
#include <cmath>

#include "kerf/midsurface/edit_mesh.h"
#include "kerf/midsurface/surface_filter.h"

namespace kerf::mid {
namespace {

constexpr double kFewest = 8000, kMost = 50000;
constexpr double kCollapseTurn = 0.2;  // cosine: a collapse may turn a face by 78 degrees
constexpr double kDeviation = 0.02;    // of the mean thickness
constexpr double kShort = 0.8, kLong = 1.5;
constexpr double kTooMany = 1.5;   // times kMost
constexpr double kSettled = 0.01;  // change of the number of triangles by splits and collapses
constexpr int kMostRounds = 40, kMostFlips = 10;
constexpr double kFlat = 1e-3;  // of the mean thickness

/// Asked between passes over the edges. How many there will be nobody knows: each is told as a smaller part of what is left.
class Passes {
 public:
  explicit Passes(const Progress& progress) : progress_(progress) {}
  Status next() {
    constexpr double kHalf = 8;  // passes
    ++done_;
    return progress_("mid-surface: divide", done_ / (done_ + kHalf));
  }

 private:
  const Progress& progress_;
  double done_ = 0;
};

/// Edge length of `n` equilateral triangles of that area together.
double edge_for(double area, double n) { return std::sqrt(area / n * 4 / std::sqrt(3.0)); }

/// Sum of squared distances to planes, weighted by area.
struct Quadric {
  double a[6] = {}, b[3] = {}, c = 0, area = 0;
  void add_plane(Vec3 n, double d, double w) {
    const double x[3] = {n.x, n.y, n.z};
    int k = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) a[k++] += w * x[i] * x[j];
      b[i] += w * d * x[i];
    }
    c += w * d * d;
    area += w;
  }
  Quadric& operator+=(const Quadric& q) {
    for (int i = 0; i < 6; ++i) a[i] += q.a[i];
    for (int i = 0; i < 3; ++i) b[i] += q.b[i];
    c += q.c;
    area += q.area;
    return *this;
  }
  [[nodiscard]] double at(Vec3 p) const {
    return p.x * (a[0] * p.x + 2 * (a[1] * p.y + a[2] * p.z + b[0])) + p.y * (a[3] * p.y + 2 * (a[4] * p.z + b[1])) +
           p.z * (a[5] * p.z + 2 * b[2]) + c;
  }
};

/// Half-edges, one for each edge, whose length is under the limit, shortest first in 64 classes.
std::vector<std::int32_t> short_edges(const SurfaceMesh& m, double limit) {
  constexpr int kClasses = 64;
  std::vector<std::vector<std::int32_t>> classes(kClasses);
  for (std::int32_t h = 0; h < m.origin.count(); ++h) {
    if (!m.is_edge(h)) continue;
    const double length = m.length(h);
    if (length < limit) classes[static_cast<std::size_t>(kClasses * (length / limit) * 0.999999)].push_back(h);
  }
  std::vector<std::int32_t> out;
  for (const auto& c : classes) out.insert(out.end(), c.begin(), c.end());
  return out;
}

class Coarsener {
 public:
  Coarsener(SurfaceMesh& mesh, double deviation) : m_(mesh), deviation_(deviation * deviation) {
    quadric_.resize(m_.position.size());
    for (std::int32_t f = 0; f < m_.face_count(); ++f) {
      if (!m_.has_face(f)) continue;
      const Vec3 n = m_.area_vector(f), unit = normalized(n);
      const double d = -dot(unit, m_.position[m_.origin[3 * f]]), w = norm(n);
      for (int k = 0; k < 3; ++k) quadric_[m_.origin[3 * f + k]].add_plane(unit, d, w);
      for (std::int32_t h = 3 * f; h < 3 * f + 3; ++h) {  // a border keeps its place in the sheet
        if (m_.twin[h] >= 0) continue;
        const Vec3 along = m_.position[m_.to(h)] - m_.position[m_.from(h)], across = normalized(cross(along, unit));
        for (const std::int32_t v : {m_.from(h), m_.to(h)})
          quadric_[v].add_plane(across, -dot(across, m_.position[v]), dot(along, along));
      }
    }
  }

  /// Collapses edges shorter than the limit; returns how many.
  std::int32_t pass(double limit, double longest) {
    std::int32_t done = 0;
    for (const std::int32_t h : short_edges(m_, limit)) {
      if (m_.origin[h] < 0 || m_.length(h) >= limit) continue;
      done += try_collapse(h, longest);
    }
    return done;
  }

 private:
  bool try_collapse(std::int32_t h, double longest) {
    const std::int32_t a = m_.from(h), b = m_.to(h);
    Quadric q = quadric_[a];
    q += quadric_[b];
    const Vec3 pa = m_.position[a], pb = m_.position[b], places[3] = {0.5 * (pa + pb), pa, pb};
    int best = -1;
    double least = deviation_ * q.area;
    for (int i = 0; i < 3; ++i) {
      // A corner is taken instead of the middle only where it is clearly better.
      const double e = std::fabs(q.at(places[i])) * (i == 0 ? 1.0 : 1.5);
      if (e < least) {
        least = e;
        best = i;
      }
    }
    if (best < 0 || !keeps_shape(a, b, places[best], longest) || !keeps_shape(b, a, places[best], longest))
      return false;
    if (!can_collapse(m_, h, scratch_)) return false;
    collapse(m_, h);
    m_.position[b] = places[best];
    quadric_[b] = q;
    return true;
  }

  [[nodiscard]] bool keeps_shape(std::int32_t v, std::int32_t other, Vec3 place, double longest) const {
    bool good = true;
    m_.for_each_outgoing(v, [&](std::int32_t e) {
      const std::int32_t x = m_.to(e), y = m_.apex(e);
      if (!good || x == other || y == other) return;
      const Vec3 p = m_.position[x], q = m_.position[y], old = cross(p - m_.position[v], q - m_.position[v]),
                 now = cross(p - place, q - place);
      if (dot(old, now) <= kCollapseTurn * norm(old) * norm(now)) good = false;
      const double length = norm(p - place);
      if (length > longest && length > 1.1 * norm(p - m_.position[v])) good = false;
    });
    return good;
  }

  SurfaceMesh& m_;
  Column<Quadric> quadric_;
  LinkScratch scratch_;
  double deviation_;
};

Status coarsen(SurfaceMesh& m, double edge, double deviation, Passes& passes) {
  Coarsener coarsener(m, deviation);
  const double limit = kShort * edge;
  double first = limit;
  double sum = 0;
  std::size_t n = 0;
  for (std::int32_t h = 0; h < m.origin.count(); h += 7)  // a sample will do
    if (m.origin[h] >= 0) {
      sum += m.length(h);
      ++n;
    }
  while (n > 0 && first > 1.2 * sum / static_cast<double>(n)) first *= 0.5;
  for (double l = first; l < limit; l *= 2) {
    KERF_TRY(passes.next());
    coarsener.pass(l, kLong * l);
  }
  for (int round = 0; round < 5; ++round) {
    KERF_TRY(passes.next());
    if (100 * coarsener.pass(limit, kLong * edge) < m.face_count() / 100) break;
  }
  return {};
}

/// Splits every edge longer than the limit once, longest first; false if there is none.
bool split_long_edges(SurfaceMesh& m, double limit, std::size_t most_faces) {
  struct Long {
    double length;
    std::int32_t h;
  };
  std::vector<Long> edges;
  for (std::int32_t h = 0; h < m.origin.count(); ++h)
    if (m.is_edge(h) && m.length(h) > limit) edges.push_back({m.length(h), h});
  std::sort(edges.begin(), edges.end(),
            [](const Long& x, const Long& y) { return x.length != y.length ? x.length > y.length : x.h < y.h; });
  for (const Long& e : edges) {
    if (m.origin.size() >= 3 * most_faces) return false;
    // A split before this one may have changed which edge the number stands for.
    if (m.length(e.h) > limit) split(m, e.h, 0.5 * (m.position[m.from(e.h)] + m.position[m.to(e.h)]));
  }
  return !edges.empty();
}

/// Cosine of the angle at p between a and b.
double corner_cosine(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 u = a - p, v = b - p;
  return dot(u, v) / std::max(norm(u) * norm(v), 1e-300);
}

/// Turns edges whose opposite angles are together more than 180 degrees, where that moves the surface by less than `deviation`.
Status flip_flat_edges(SurfaceMesh& m, double deviation, Passes& passes) {
  for (int round = 0; round < kMostFlips; ++round) {
    KERF_TRY(passes.next());
    std::int32_t flipped = 0;
    for (std::int32_t h = 0; h < m.origin.count(); ++h) {
      if (!m.is_edge(h) || m.twin[h] < 0) continue;
      const Vec3 a = m.position[m.from(h)], b = m.position[m.to(h)], c = m.position[m.apex(h)],
                 d = m.position[m.apex(m.twin[h])];
      // The sum of the opposite angles, by their cosines; with some slack, or four points on a circle would turn for ever.
      if (!(corner_cosine(c, a, b) + corner_cosine(d, a, b) < -1e-6)) continue;
      const Vec3 along = cross(b - a, d - c), n1 = cross(d - a, c - a), n2 = cross(c - b, d - b);
      if (!(dot(n1, n2) > 0) || std::fabs(dot(c - a, along)) > deviation * norm(along) || !can_flip(m, h)) continue;
      flip(m, h);
      ++flipped;
    }
    if (flipped == 0) break;
  }
  return {};
}

Status make_coarser(WorkingMesh& work, Passes& passes) {
  const std::int32_t before = work.mesh.face_count();
  KERF_TRY(coarsen(work.mesh, work.edge, kDeviation * work.thickness, passes));
  work.mesh = compacted(work.mesh);
  work.coarsened = work.coarsened || work.mesh.face_count() < before;
  return {};
}

}  // namespace

Result<WorkingMesh> coarse_working_mesh(SurfaceMesh filtered, double thickness, const Progress& progress) {
  Passes passes(progress);
  WorkingMesh out;
  out.thickness = thickness > 0 ? thickness : mean_thickness(filtered);
  const double area = total_area(filtered);
  out.edge = std::clamp(0.5 * out.thickness, edge_for(area, kMost), edge_for(area, kFewest));
  out.mesh = std::move(filtered);
  KERF_TRY(make_coarser(out, passes));
  out.rough = out.mesh.face_count() > kTooMany * kMost;
  return out;
}

Status divide_working_mesh(WorkingMesh& out, const Progress& progress) {
  Passes passes(progress);
  std::int32_t last = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    KERF_TRY(passes.next());
    if (!split_long_edges(out.mesh, kLong * out.edge, static_cast<std::size_t>(8 * kMost))) break;
    // Halves of long slivers are slivers: unless their edges are turned, ways along edges say nothing about distances. Unless they
    // collapse, there are 3^n of them.
    KERF_TRY(flip_flat_edges(out.mesh, kFlat * out.thickness, passes));
    if (out.mesh.face_count() <= kTooMany * kMost) continue;
    KERF_TRY(make_coarser(out, passes));
    // What is split and what collapses are the same edges: on a surface so rough both would go on for ever.
    const std::int32_t now = out.mesh.face_count();
    if (std::abs(now - last) < kSettled * last) break;
    last = now;
  }
  out.rough = out.mesh.face_count() > kTooMany * kMost;
  return {};
}

Result<WorkingMesh> make_working_mesh(SurfaceMesh filtered, double thickness, const Progress& progress) {
  auto out = coarse_working_mesh(std::move(filtered), thickness, progress);
  if (out) KERF_TRY(divide_working_mesh(*out, progress));
  return out;
}

}  // namespace kerf::mid
