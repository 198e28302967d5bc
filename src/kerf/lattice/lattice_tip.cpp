#include "kerf/lattice/lattice_tip.h"

#include <cmath>

#include "kerf/lattice/lattice_tolerances.h"

namespace kerf {
namespace {

/// Cells. Reach of a tip's line, so that a line in a face between two cells is in both.
constexpr double kLineReach = 1e-9;

/// Range of t with p + t d in the closed cell; a line beside a face counts as in it up to kLineReach. False: none.
bool line_in_cell(Vec3 p, Vec3 d, LatticeIndex cell, double& t0, double& t1) {
  for (int a = 0; a < 3; ++a) {
    const double lo = cell[static_cast<std::size_t>(a)] - p[a], hi = lo + 1;
    if (std::fabs(d[a]) < 1e-9) {
      if (lo > kLineReach || hi < -kLineReach) return false;
      continue;
    }
    const double u = lo / d[a], v = hi / d[a];
    t0 = std::fmax(t0, std::fmin(u, v));
    t1 = std::fmin(t1, std::fmax(u, v));
  }
  return t0 <= t1;
}

/// Where the slit runs at its tip, lattice coordinates: from a point of its lip a little way back. The very last bit may be short
/// and put aside to keep triangles in shape, which says nothing about the way.
Vec3 slit_direction(const CollisionMesh& mesh, const HexMesh& hex, CollisionVertex tip, Vec3 point) {
  Vec3 direction{}, last = point;
  CollisionVertex v = tip;
  for (int steps = 0; steps < kTipLookBack; ++steps) {
    const CollisionHalfEdge out = mesh.fan_start(v);
    if (!mesh.is_border(out)) break;
    v = mesh.to(out);
    const PrismCorners& c = hex.prism_corner[v];
    const Vec3 here = 0.5 * (c.minus + c.plus), bit = last - here;
    if (steps > 0 && !(dot(normalized(bit), direction) > kTipSameWay)) break;  // round a bend, or out at the mouth
    direction = normalized(point - here);
    last = here;
    if (norm(point - here) >= kTipReach) break;
  }
  return direction;
}

}  // namespace

bool is_tip(const CollisionMesh& mesh, CollisionVertex v) {
  const CollisionHalfEdge out = mesh.fan_start(v);
  if (!mesh.is_border(out)) return false;
  CollisionHalfEdge last = out;
  for (CollisionHalfEdge h = mesh.ccw(out); h.valid(); h = mesh.ccw(h)) last = h;
  const Vec3 a = mesh.rest[mesh.to(out)] - mesh.rest[v], b = mesh.rest[mesh.apex(last)] - mesh.rest[v];
  return dot(a, b) > 0 && norm(cross(a, b)) <= kTipAngle * norm(a) * norm(b);
}

TipCells cells_of_tip(const CollisionMesh& mesh, const HexMesh& hex, CollisionVertex v) {
  TipCells out;
  const PrismCorners& c = hex.prism_corner[v];
  const Vec3 middle = 0.5 * (c.minus + c.plus), line = c.plus - c.minus;
  const Vec3 direction = slit_direction(mesh, hex, v, middle);
  const Vec3 normal = normalized(cross(line, direction));
  if (!(norm(direction) > 0) || !(norm(normal) > 0.5)) return out;  // a knife edge has no line
  const LatticeFrame& frame = frame_around(mesh, hex, v);
  LatticeIndex lo, hi;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const std::int32_t first = frame.first[i], last = first + frame.count[i] - 1;
    lo[i] = std::clamp(static_cast<int>(std::floor(std::fmin(c.minus[a], c.plus[a]) - kLineReach)), first, last);
    hi[i] = std::clamp(static_cast<int>(std::floor(std::fmax(c.minus[a], c.plus[a]) + kLineReach)), first, last);
  }
  for (std::int32_t z = lo[2]; z <= hi[2]; ++z)
    for (std::int32_t y = lo[1]; y <= hi[1]; ++y)
      for (std::int32_t x = lo[0]; x <= hi[0]; ++x) {
        double t0 = 0, t1 = 1;
        if (!line_in_cell(c.minus, line, {x, y, z}, t0, t1) || (t1 - t0) * norm(line) < 1e-6) continue;
        const Vec3 p = c.minus + 0.5 * (t0 + t1) * line;
        double s0 = -1e9, s1 = 1e9;
        if (!line_in_cell(p, direction, {x, y, z}, s0, s1) || !(s1 - s0 > 1e-6)) continue;
        // A tip in the far face has passed the cell: its lips would hang together by the edge ahead, which touches the cell.
        const double most = 1 - 1e-6, passed = std::fmin(-s0 / (s1 - s0), most);
        if (passed < kTipWelded || !(s1 > -kLineReach) || out.count == out.items.size()) continue;
        TipCell& record = out.items[out.count++];
        record.vertex = v;
        record.cell = hex.cell_id({x, y, z});
        record.passed = passed;
        record.point = middle;
        record.direction = direction;
        record.normal = normal;
      }
  return out;
}

}  // namespace kerf
