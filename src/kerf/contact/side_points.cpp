#include "kerf/contact/side_points.h"

#include <algorithm>
#include <cmath>

#include "kerf/base/hash.h"
#include "kerf/base/lanes.h"
#include "kerf/contact/tolerances.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

Vec3 in_cells(const LatticeFrame& frame, Vec3 d) {
  const Vec3 l = transposed_times(frame.axes, d);
  return {l.x / frame.cell.x, l.y / frame.cell.y, l.z / frame.cell.z};
}

/// Of a face at rest, measured in cells.
struct FaceSize {
  double area = 0, edge = 0, longest = 0;  ///< edge: of the even-sided triangle of that area
  double thickness = 0;
};
FaceSize size_of(const HexMesh& hex, const ContactSurface& s, F f) {
  const LatticeFrame& frame = hex.frame_of(s.root[f]);
  const auto v = s.vertices(f);
  const Vec3 a = in_cells(frame, s.rest[v[1]] - s.rest[v[0]]), b = in_cells(frame, s.rest[v[2]] - s.rest[v[0]]);
  FaceSize size;
  size.area = 0.5 * norm(cross(a, b));
  size.edge = std::sqrt(4 / std::sqrt(3.0) * size.area);
  size.longest = std::max({norm(a), norm(b), norm(b - a)});
  for (const V c : v) size.thickness += 2.0 / 3 * norm(in_cells(frame, s.offset[c]));
  return size;
}

const SidePoints::Wants& wants(const HexMesh& hex, const ContactSurface& s, const SidePoints& sides, F f) {
  return sides.of_body[static_cast<std::size_t>(hex.body_of(s.root[f]))];
}

/// Into how many pieces the edges of a face are divided.
std::int32_t pieces_of(const FaceSize& size) {
  const double pieces = std::max(size.edge / kSideApart, size.longest / kSideLongest);
  return static_cast<std::int32_t>(std::ceil(std::min(pieces - 1e-9, kMostSidePieces)));
}
/// And the walls over its borders, across the thickness.
std::int32_t layers_of(const FaceSize& size) {
  return std::max(1, static_cast<std::int32_t>(std::ceil(std::min(size.thickness - 1e-9, kMostSidePieces))));
}

std::int32_t pieces_at(const ContactSurface& s, const SidePoints& sides, H h) {
  const H g = s.twin[h];
  return std::max(sides.pieces[ContactSurface::face(h)], g.valid() ? sides.pieces[ContactSurface::face(g)] : 0);
}

/// Of everything that the points of a face depend on.
std::uint64_t look_of(const HexMesh& hex, const ContactSurface& s, const SidePoints& sides, F f) {
  Hash hash;
  for (int i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, i);
    const V v = s.from(h);
    hash.add(s.rest[v]);
    hash.add(s.offset[v]);
    hash.add(pieces_at(s, sides, h));
    hash.add(std::int32_t{s.owns_edge(h) ? 1 : 0} + std::int32_t{s.twin[h].valid() ? 2 : 0});
  }
  for (const Piece& p : hex.pieces_of(f)) {
    hash.add(p.cell);
    hash.add(hex.host[p.copy]);
    hash.add(hex.cell[hex.host[p.copy]]);  // a number may have been another copy's before an undo
    if (p.side == 0) continue;
    hash.add(p.side);
    hash.add(hex.tips[p.tip].point);
    hash.add(hex.tips[p.tip].normal);
  }
  return hash.value();
}

void make_points(const HexMesh& hex, const ContactSurface& s, const SidePoints& sides, F f,
                 std::vector<SidePoint>& points) {
  const auto v = s.vertices(f);
  std::int32_t number = 0;
  const auto add = [&](const std::array<double, 3>& weight, double lift, H border, std::int32_t piece = -1) {
    Vec3 rest;
    for (std::size_t i = 0; i < 3; ++i) rest += weight[i] * (s.rest[v[i]] + lift * s.offset[v[i]]);
    const EmbeddedPoint carrier = sides.holds(rest) ? EmbeddedPoint{} : embed_point(hex, f, rest);
    if (carrier.copy.valid()) points.push_back({f, number, weight, lift, border, piece, carrier});
    ++number;
  };
  if (const std::int32_t n = sides.pieces[f]; n > 2)
    for (std::int32_t i = 1; i < n; ++i)
      for (std::int32_t j = 1; i + j < n; ++j)
        for (const double lift : {-1.0, 1.0})
          add({static_cast<double>(i) / n, static_cast<double>(j) / n, static_cast<double>(n - i - j) / n}, lift, {});
  if (const std::int32_t n = sides.pieces[f]; n > 1)
    for (std::int32_t piece = 0; piece < n * n; ++piece) {
      const auto corner = side_piece(n, piece);
      std::array<double, 3> middle{};
      for (const auto& c : corner)
        for (std::size_t i = 0; i < 3; ++i) middle[i] += c[i] / 3;
      for (const double lift : {-1.0, 1.0}) add(middle, lift, {}, piece);
    }
  for (std::size_t i = 0; i < 3; ++i) {
    const H h = ContactSurface::corner(f, static_cast<int>(i));
    if (!s.owns_edge(h)) continue;
    const bool border = !s.twin[h].valid();
    const std::int32_t n = std::max(1, pieces_at(s, sides, h)),
                       layers = border && wants(hex, s, sides, f).across ? layers_of(size_of(hex, s, f)) : 1;
    for (std::int32_t k = 0; k < n; ++k) {
      std::array<double, 3> weight{};
      weight[(i + 1) % 3] = static_cast<double>(k) / n;
      weight[i] = 1 - weight[(i + 1) % 3];
      for (std::int32_t l = k > 0 ? 0 : 1; l <= (k > 0 ? layers : layers - 1); ++l)
        add(weight, 2.0 * l / layers - 1, border ? h : H());
    }
  }
}

/// Corners of the prism at a vertex that other copies hold than the one that holds the vertex.
std::array<EmbeddedPoint, 2> corners_of(const HexMesh& hex, const Embedding& embedding, const ContactSurface& s, V v,
                                        std::span<const F> around) {
  std::array<EmbeddedPoint, 2> corner{embed_point(hex, around, s.rest[v] - s.offset[v]),
                                      embed_point(hex, around, s.rest[v] + s.offset[v])};
  const HexId own = embedding.collision[v];
  if (!corner[0].copy.valid() || (corner[0].copy == own && corner[1].copy == own)) corner = {};
  return corner;
}

void renew_corners(const HexMesh& hex, const Embedding& embedding, const ContactSurface& s, SidePoints& sides) {
  const std::size_t known = std::min(sides.corner.size(), s.vertex_count());
  sides.corner.resize(s.vertex_count());
  sides.corner_from.resize(s.vertex_count());
  std::vector<F> around;
  for (const V v : ids<V>(s.vertex_count())) {
    around.clear();
    Hash hash;
    hash.add(embedding.collision[v]);
    s.for_each_outgoing(v, [&](H h) {
      around.push_back(ContactSurface::face(h));
      hash.add(sides.made_from[around.back()]);
      return true;
    });
    if (v.index() < known && sides.corner_from[v] == hash.value()) continue;
    sides.corner_from[v] = hash.value();
    sides.corner[v] = !around.empty() && wants(hex, s, sides, around[0]).across
                          ? corners_of(hex, embedding, s, v, around)
                          : std::array<EmbeddedPoint, 2>{};
  }
}

/// How far a piece of a face reaches from its middle, at most, m.
double reach_of_piece(const ContactSurface& s, const SidePoints& sides, const SidePoint& point) {
  if (point.piece < 0) return 0;
  const auto v = s.vertices(point.face);
  const auto corner = [&](std::size_t i) { return s.rest[v[i]] + point.lift * s.offset[v[i]]; };
  return 2.0 / 3 * std::max({norm(corner(1) - corner(0)), norm(corner(2) - corner(1)), norm(corner(0) - corner(2))}) /
         sides.pieces[point.face];
}

}  // namespace

std::array<std::array<double, 3>, 3> side_piece(std::int32_t n, std::int32_t piece) {
  // Rows of 2 n - 1, 2 n - 3 ... pieces, every other one upside down.
  std::int32_t row = 0, in_row = piece;
  while (in_row >= 2 * (n - row) - 1) in_row -= 2 * (n - row) - 1, ++row;
  const std::int32_t i = in_row / 2, down = in_row % 2;
  const auto at = [&](std::int32_t a, std::int32_t b) {
    return std::array{static_cast<double>(n - a - b) / n, static_cast<double>(a) / n, static_cast<double>(b) / n};
  };
  if (down == 0) return {at(i, row), at(i + 1, row), at(i, row + 1)};
  return {at(i + 1, row), at(i + 1, row + 1), at(i, row + 1)};
}

void choose_side_points(const HexMesh& hex, const ContactSurface& s, SidePoints& sides) {
  struct Sums {
    double area = 0, edges = 0, thickness = 0;
  };
  std::vector<Sums> sums(hex.bodies.size());
  for (const F f : ids<F>(s.face_count())) {
    const FaceSize size = size_of(hex, s, f);
    Sums& of_body = sums[static_cast<std::size_t>(hex.body_of(s.root[f]))];
    of_body.area += size.area;
    of_body.edges += size.area * size.edge;
    of_body.thickness += size.area * size.thickness;
  }
  sides = {};
  for (const Sums& of_body : sums) {
    const bool across = of_body.thickness > kThickBody * of_body.area;
    sides.of_body.push_back({of_body.edges > (across ? kSideApart : kLargeFaces) * of_body.area, across});
  }
}

void renew_side_points(const HexMesh& hex, const Embedding& embedding, const ContactSurface& s, SidePoints& sides) {
  if (!sides.any()) return;
  const std::size_t faces = s.face_count();
  sides.pieces.resize(faces);
  for (const F f : ids<F>(faces)) sides.pieces[f] = wants(hex, s, sides, f).between ? pieces_of(size_of(hex, s, f)) : 1;
  std::vector<SidePoint> old;
  std::swap(old, sides.points);
  const IndexedArray<F, std::uint32_t> old_end = sides.end;
  sides.points.reserve(old.size());
  sides.end.resize(faces);
  const std::size_t known = std::min(faces, sides.made_from.size());
  sides.made_from.resize(faces);
  for (const F f : ids<F>(faces)) {
    const std::uint64_t look = look_of(hex, s, sides, f);
    if (f.index() < known && look == sides.made_from[f]) {
      const auto from = f.index() == 0 ? 0 : old_end[F(f.value - 1)];
      sides.points.insert(sides.points.end(), old.begin() + from, old.begin() + old_end[f]);
    } else {
      make_points(hex, s, sides, f, sides.points);
    }
    sides.made_from[f] = look;
    sides.end[f] = static_cast<std::uint32_t>(sides.points.size());
  }
  sides.size.resize(sides.points.size());
  for (std::size_t i = 0; i < sides.points.size(); ++i) sides.size[i] = reach_of_piece(s, sides, sides.points[i]);
  if (std::any_of(sides.of_body.begin(), sides.of_body.end(), [](const SidePoints::Wants& w) { return w.across; }))
    renew_corners(hex, embedding, s, sides);
}

CarriedPlace place_of(const HexMesh& hex, const EmbeddedPoint& point, std::span<const NodeState> nodes) {
  const Vec3 l = point.local;
  const Lanes x{1 - l.x, 1 + l.x, 1 - l.x, 1 + l.x}, y{1 - l.y, 1 - l.y, 1 + l.y, 1 + l.y};
  const Lanes xy = 0.125 * (x * y), weight[2] = {(1 - l.z) * xy, (1 + l.z) * xy};
  Lanes now = all_lanes(0), next = all_lanes(0);
  const std::array<NodeId, 8>& corner = hex.nodes[point.copy];
  for (std::size_t i = 0; i < 8; ++i) {
    const NodeState& node = nodes[corner[i].index()];
    now += weight[i / 4][i % 4] * load_lanes(node.now);
    next += weight[i / 4][i % 4] * load_lanes(node.next);
  }
  return {{now[0], now[1], now[2]}, {next[0], next[1], next[2]}};
}

void place_side_points(const HexMesh& hex, const ContactSurface& s, std::span<const NodeState> nodes,
                       std::span<const Vec3> positions, std::span<const Vec3> offsets, SidePoints& sides) {
  sides.place.resize(sides.points.size());
  sides.travel.resize(sides.points.size());
  double square = 0;
  for (std::size_t i = 0; i < sides.points.size(); ++i) {
    const SidePoint& point = sides.points[i];
    const CarriedPlace at = place_of(hex, point.carrier, nodes);
    sides.place[i] = at.now;
    sides.travel[i] = at.next - at.now;
    Vec3 prism;
    const auto v = s.vertices(point.face);
    for (std::size_t k = 0; k < 3; ++k)
      prism += point.weight[k] * (positions[v[k].index()] + point.lift * offsets[v[k].index()]);
    square = std::max(square, dot(at.now - prism, at.now - prism));
  }
  sides.bulge = std::sqrt(square);
}

}  // namespace kerf
