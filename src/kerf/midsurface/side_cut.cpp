#include "kerf/midsurface/side_cut.h"

#include <algorithm>

namespace kerf::mid {
namespace {

constexpr double kClosest = 0.02;  // of an edge: nearer to its end the line does not cross it

}  // namespace

Result<SideSheet> cut_side(const SurfaceMesh& m, const Column<double>& field, double sign) {
  SideSheet out;
  Column<Vec3> positions;
  Column<std::int32_t> kept(m.position.size(), -1), crossing(m.origin.size(), -1);
  std::vector<std::array<std::int32_t, 3>> triangles;
  const auto inside = [&](std::int32_t v) { return sign * field[v] > 0; };
  const auto keep = [&](std::int32_t v) {
    if (kept[v] < 0) {
      kept[v] = positions.count();
      positions.push_back(m.position[v]);
    }
    return kept[v];
  };
  const auto cross_at = [&](std::int32_t h) {
    if (crossing[h] >= 0) return crossing[h];
    std::int32_t a = m.from(h), b = m.to(h);
    if (a > b) std::swap(a, b);  // the same bits from both faces and for both sides
    const double t = std::clamp(field[a] / (field[a] - field[b]), kClosest, 1 - kClosest);
    crossing[h] = positions.count();
    if (m.twin[h] >= 0) crossing[m.twin[h]] = crossing[h];
    positions.push_back(lerp(m.position[a], m.position[b], t));
    return crossing[h];
  };
  const auto add = [&](std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t f, bool whole) {
    triangles.push_back({a, b, c});
    out.parent.push_back(f);
    out.whole.push_back(whole);
  };
  for (std::int32_t f = 0; f < m.face_count(); ++f) {
    std::array<bool, 3> in{};
    int count = 0;
    for (int k = 0; k < 3; ++k) {
      in[static_cast<std::size_t>(k)] = inside(m.origin[3 * f + k]);
      count += in[static_cast<std::size_t>(k)];
    }
    if (count == 0) continue;
    const auto corner = [&](int k) { return m.origin[3 * f + k % 3]; };
    const auto edge = [&](int k) { return 3 * f + k % 3; };
    if (count == 3) {
      add(keep(corner(0)), keep(corner(1)), keep(corner(2)), f, true);
      continue;
    }
    int odd = 0;  // the corner that differs from the other two
    while (in[static_cast<std::size_t>(odd)] != (count == 1)) ++odd;
    const std::int32_t before = cross_at(edge(odd + 2)), after = cross_at(edge(odd));
    if (count == 1) {
      add(keep(corner(odd)), after, before, f, false);
      continue;
    }
    const std::int32_t b = keep(corner(odd + 1)), c = keep(corner(odd + 2));
    // The shorter diagonal.
    const auto at = [&](std::int32_t v) { return positions[v]; };
    if (norm(at(after) - at(c)) <= norm(at(b) - at(before))) {
      add(after, b, c, f, false);
      add(after, c, before, f, false);
    } else {
      add(after, b, before, f, false);
      add(b, c, before, f, false);
    }
  }
  auto connected = connect(std::move(positions), triangles);
  if (!connected) return connected.error();
  out.mesh = std::move(*connected);
  return out;
}

}  // namespace kerf::mid
