#include "kerf/session/held_material.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kerf/session/tolerances.h"

namespace kerf {
namespace {

/// Gauss points along a line, and their weights.
const std::array<double, 3> kPlace{-std::sqrt(0.6), 0, std::sqrt(0.6)};
constexpr std::array<double, 3> kWeight{5.0 / 9, 8.0 / 9, 5.0 / 9};

}  // namespace

/// Parts of a line along an axis of a cell, from -1 to 1, and where what is held ends.
struct HeldLine {
  std::vector<std::array<double, 2>> free;
  std::vector<double> border;
};

/// The lines that lie most across the border, and what of the cell is free along them. None: the cell is of one kind.
struct HeldLines {
  int axis = -1;
  std::array<HeldLine, 9> line;
  double free = 0;  ///< of the cell
};

struct TracedCell {
  CellId cell;
  HeldPart part = HeldPart::kNone;
  HeldLines lines;
};

namespace {

Vec3 on_line(int axis, int line, double t) {
  Vec3 xi;
  xi[axis] = t;
  xi[(axis + 1) % 3] = kPlace[static_cast<std::size_t>(line % 3)];
  xi[(axis + 2) % 3] = kPlace[static_cast<std::size_t>(line / 3)];
  return xi;
}

HeldLine line_of(const HexMesh& hex, const HeldRegions& held, LatticeIndex cell, int axis, int line) {
  const auto is_held = [&](double t) { return held.contains(rest_place(hex, cell, on_line(axis, line, t))); };
  HeldLine out;
  double from = -1, at = -1;
  bool before = is_held(at);
  for (int i = 1; i <= kLineParts; ++i) {
    const double next = -1 + 2.0 * i / kLineParts;
    const bool now = is_held(next);
    if (now != before) {
      double low = at, high = next;
      for (int k = 0; k < kHalvings; ++k) {
        const double middle = 0.5 * (low + high);
        (is_held(middle) == before ? low : high) = middle;
      }
      const double border =
          before ? low : high;  // the last place that is held: whoever asks the region for it must find it inside
      out.border.push_back(border);
      if (!before) out.free.push_back({from, border});
      from = border;
    }
    before = now;
    at = next;
  }
  if (!before) out.free.push_back({from, 1.0});
  return out;
}

double length(const HeldLine& line) {
  double sum = 0;
  for (const auto& part : line.free) sum += part[1] - part[0];
  return sum;
}

HeldLines lines_of(const HexMesh& hex, const HeldRegions& held, LatticeIndex cell) {
  HeldLines best;
  std::size_t most = 0;
  for (int axis = 0; axis < 3; ++axis) {
    HeldLines lines;
    lines.axis = axis;
    std::size_t borders = 0;
    for (int i = 0; i < 9; ++i) {
      HeldLine& line = lines.line[static_cast<std::size_t>(i)];
      line = line_of(hex, held, cell, axis, i);
      borders += line.border.size();
      lines.free += length(line) / 2 * kWeight[static_cast<std::size_t>(i % 3)] / 2 *
                    kWeight[static_cast<std::size_t>(i / 3)] / 2;
    }
    if (borders <= most) continue;
    most = borders;
    best = std::move(lines);
  }
  return best;
}

/// Is all of the cell on one side of the region's border?
bool is_plain(const SceneRegion& region, const std::array<Vec3, 8>& corners) {
  // Regions are convex.
  std::size_t inside = 0;
  for (const Vec3 x : corners) inside += region.contains(x) ? 1 : 0;
  if (inside == 8) return true;
  if (inside > 0) return false;
  Box3 box;
  for (const Vec3 x : corners) box.add(x);
  switch (region.shape) {
    case SceneRegion::Shape::kHalfSpace: return true;
    case SceneRegion::Shape::kSphere: return norm(box.center() - region.center) > region.radius + 0.5 * box.diagonal();
    case SceneRegion::Shape::kBox:
      for (int a = 0; a < 3; ++a)
        if (box.max[a] < region.min[a] || box.min[a] > region.max[a]) return true;
      return false;
  }
  return false;
}

bool is_plain(const HexMesh& hex, const HeldRegions& held, LatticeIndex cell) {
  std::array<Vec3, 8> corners;
  for (std::size_t c = 0; c < 8; ++c)
    corners[c] = rest_place(hex, cell, {c & 1 ? 1.0 : -1.0, c & 2 ? 1.0 : -1.0, c & 4 ? 1.0 : -1.0});
  return std::all_of(held.changes.begin(), held.changes.end(),
                     [&](const HeldRegions::Change& change) { return is_plain(change.region, corners); });
}

/// Null where the cell has not been traced.
const TracedCell* traced_cell(const HexMesh& hex, const HeldRegions& held, LatticeIndex cell) {
  if (held.traced == nullptr) return nullptr;
  const CellId id = hex.cell_id(cell);
  const auto it = std::lower_bound(held.traced->begin(), held.traced->end(), id,
                                   [](const TracedCell& t, CellId wanted) { return t.cell < wanted; });
  return it != held.traced->end() && it->cell == id ? &*it : nullptr;
}

HeldPart part_of(const HeldLines& lines, bool middle) {
  if (lines.axis < 0) return middle ? HeldPart::kAll : HeldPart::kNone;
  if (lines.free < kLeastShare) return HeldPart::kAll;
  return lines.free > 1 - kLeastShare ? HeldPart::kNone : HeldPart::kSome;
}

/// m^3 per unit of a line's length, at t: the polynomial with the same moments.
double density(const std::array<double, 3>& volumes, double t) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    double value = volumes[i] / kWeight[i];
    for (std::size_t k = 0; k < 3; ++k)
      if (k != i) value *= (t - kPlace[k]) / (kPlace[i] - kPlace[k]);
    sum += value;
  }
  return sum;
}

}  // namespace

std::optional<bool> HeldRegions::says(Vec3 rest) const {
  for (std::size_t i = changes.size(); i-- > 0;)
    if (changes[i].region.contains(rest)) return changes[i].held;
  return {};
}

Vec3 rest_place(const HexMesh& hex, LatticeIndex c, Vec3 xi) {
  return hex.frame_at(c).to_world({c[0] + 0.5 + 0.5 * xi.x, c[1] + 0.5 + 0.5 * xi.y, c[2] + 0.5 + 0.5 * xi.z});
}

void HeldRegions::trace(const HexMesh& hex) {
  std::vector<TracedCell> near;
  for (const CellId cell : ids<CellId>(hex.first_copy.size())) {
    const LatticeIndex at = hex.index_of(cell);
    if (!hex.first_copy[cell].valid() || is_plain(hex, *this, at)) continue;
    TracedCell& traced_cell = near.emplace_back();
    traced_cell.cell = cell;
    traced_cell.lines = lines_of(hex, *this, at);
    traced_cell.part = part_of(traced_cell.lines, contains(rest_place(hex, at, {})));
  }
  traced = std::make_shared<const std::vector<TracedCell>>(std::move(near));
}

HeldPart held_part(const HexMesh& hex, const HeldRegions& held, HexId copy) {
  const LatticeIndex cell = hex.cell[copy];
  if (const TracedCell* known = traced_cell(hex, held, cell)) return known->part;
  const bool middle = held.contains(rest_place(hex, cell, {}));
  if (is_plain(hex, held, cell)) return middle ? HeldPart::kAll : HeldPart::kNone;
  return part_of(lines_of(hex, held, cell), middle);
}

HeldMaterial held_material(const HexMesh& hex, const HeldRegions& held, HexId copy) {
  HeldMaterial out;
  const TracedCell* known = traced_cell(hex, held, hex.cell[copy]);
  const HeldLines made = known != nullptr ? HeldLines{} : lines_of(hex, held, hex.cell[copy]);
  const HeldLines& lines = known != nullptr ? known->lines : made;
  if (lines.axis < 0) return out;
  const HexMaterial& m = hex.material[copy];
  const std::array<double, 27>& weights = m.full ? full_weights() : hex.weights[copy];
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0), scale = sum > 0 ? m.volume / sum : 0;
  const double cell = hex.frame_of(copy).cell_volume();
  constexpr std::array<int, 3> kStride{1, 3, 9};
  const int along = kStride[static_cast<std::size_t>(lines.axis)],
            first = kStride[static_cast<std::size_t>((lines.axis + 1) % 3)],
            second = kStride[static_cast<std::size_t>((lines.axis + 2) % 3)];
  double left = 0;
  for (int i = 0; i < 9; ++i) {
    const HeldLine& line = lines.line[static_cast<std::size_t>(i)];
    std::array<double, 3> volumes;
    for (int k = 0; k < 3; ++k)
      volumes[static_cast<std::size_t>(k)] =
          scale * weights[static_cast<std::size_t>(k * along + i % 3 * first + i / 3 * second)];
    for (const auto& part : line.free) {
      const double half = 0.5 * (part[1] - part[0]), middle = 0.5 * (part[0] + part[1]);
      for (std::size_t k = 0; k < 3; ++k) {
        const double t = middle + half * kPlace[k], volume = half * kWeight[k] * density(volumes, t);
        if (!(volume > 0)) continue;
        out.free.push_back({on_line(lines.axis, i, t), volume});
        left += volume;
      }
    }
    for (const double t : line.border)
      if (const double area = 2 * density(volumes, t) / cell; area > 0)
        out.held.push_back({on_line(lines.axis, i, t), area});
  }
  if (!out.held.empty() && left < (1 - kLeastShare) * m.volume) {
    if (!(left > kLeastShare * m.volume)) out.free.clear();
    return out;
  }
  // Not divided: the polynomial may be anything where the copy has no material.
  out = {};
  if (!(sum > 0)) return out;
  const std::array<MaterialPoint, 27> all = material_points_27(weights);
  Vec3 middle;
  for (const MaterialPoint& p : all) middle += (p.volume / sum) * p.xi;
  if (held.contains(rest_place(hex, hex.cell[copy], middle))) {
    out.held.assign(all.begin(), all.end());
  } else {
    out.free.assign(all.begin(), all.end());
    for (MaterialPoint& p : out.free) p.volume *= scale;
  }
  return out;
}

std::vector<BorderRow> border_rows(const std::vector<std::pair<std::array<double, 8>, double>>& points) {
  // Rows r with sum r r' = W, the sum of share w w' over the points: Cholesky with pivots.
  std::array<std::array<double, 8>, 8> left{};
  for (const auto& [w, share] : points)
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t j = 0; j < 8; ++j) left[i][j] += share * w[i] * w[j];
  std::vector<BorderRow> rows;
  double most = 0;
  while (rows.size() < 8) {
    std::size_t pivot = 0;
    for (std::size_t i = 1; i < 8; ++i)
      if (left[i][i] > left[pivot][pivot]) pivot = i;
    if (rows.empty()) most = left[pivot][pivot];
    if (!(left[pivot][pivot] > kLeastRow * most)) break;
    BorderRow& row = rows.emplace_back();
    for (std::size_t i = 0; i < 8; ++i) row.weights[i] = left[i][pivot] / std::sqrt(left[pivot][pivot]);
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t j = 0; j < 8; ++j) left[i][j] -= row.weights[i] * row.weights[j];
  }
  return rows;
}

}  // namespace kerf
