#include "kerf/embedding/embedding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/prefetch.h"
#include "kerf/embedding/owned_vertices.h"

namespace kerf {
namespace {

/// Cells. A point this near to a cell is in it.
constexpr double kInside = 1e-9;

/// Metres to lattice coordinates as one matrix: the same to rounding as LatticeFrame::to_lattice, faster.
struct ToLattice {
  Vec3 row[3];
  Vec3 offset;
  LatticeIndex first, last;
  explicit ToLattice(const LatticeFrame& f) : first(f.first) {
    for (int i = 0; i < 3; ++i) {
      row[i] = (1 / f.cell[i]) * f.axes.c[static_cast<std::size_t>(i)];
      const auto a = static_cast<std::size_t>(i);
      offset[i] = first[a] - dot(row[i], f.origin);
      last[a] = first[a] + f.count[a] - 1;
    }
  }
  [[nodiscard]] Vec3 operator()(Vec3 p) const {
    return {dot(row[0], p) + offset.x, dot(row[1], p) + offset.y, dot(row[2], p) + offset.z};
  }
};

bool right_side(const HexMesh& hex, const Piece& p, Vec3 q) {
  if (p.side == 0) return true;
  const TipCell& tip = hex.tips[p.tip];
  return (dot(tip.normal, q - tip.point) >= 0) == (p.side > 0);
}

/// The living copy that a point goes with; see the rule in the header. Of prisms split at a tip only the part on the point's side
/// counts, unless there is no such part: it held nothing.
HexId find_copy(const HexMesh& hex, std::span<const CollisionTriangle> owners, Vec3 q, HexId current) {
  for (const bool any_side : {false, true}) {
    HexId best;
    CellId best_cell;
    double nearest = HUGE_VAL;
    bool current_is_theirs = false;
    for (const CollisionTriangle t : owners)
      for (const Piece& p : hex.pieces_of(t)) {
        if (!any_side && !right_side(hex, p, q)) continue;
        const HexId host = hex.host[p.copy];
        current_is_theirs = current_is_theirs || host == current;
        const LatticeIndex c = hex.index_of(p.cell);
        double d = 0;
        for (int a = 0; a < 3; ++a) {
          const double x = q[a] - c[static_cast<std::size_t>(a)], out = x < 0 ? -x : x > 1 ? x - 1 : 0;
          d += out * out;
        }
        if (d < kInside * kInside) d = 0;
        if (d < nearest || (d == nearest && (p.cell < best_cell || (p.cell == best_cell && host < best))))
          nearest = d, best = host, best_cell = p.cell;
      }
    if (nearest > 0 && current_is_theirs && current.valid()) return current;
    if (best.valid()) return best;
  }
  return {};
}

class Embedder {
 public:
  Embedder(const CellComplex& body, const HexMesh& hex, Embedding& embedding, EmbeddingScratch& scratch,
           std::vector<VisualVertex>& moved)
      : body_(body), hex_(hex), e_(embedding), s_(scratch), moved_(moved), to_lattice_(hex.bodies[0].frame) {
    // One by one: g++ 12 fills a grown array of ids through memory, at a dozen cycles each.
    while (e_.visual.size() < body.visual.vertex_count()) e_.visual.push_back({});
    const std::size_t missing = body.collision.vertex_count() - e_.collision.size();
    e_.collision.grow(missing);
    e_.collision_local.grow(missing);
    if (s_.hex_stamp.size() < hex.hex_count()) s_.hex_stamp.resize(hex.hex_count(), 0);
  }

  void embed(CollisionTriangle t) {
    ++s_.serial;
    if (const std::int32_t body = hex_.body_of(body_.collision.root[t]); body != whose_) {
      whose_ = body;
      to_lattice_ = ToLattice(hex_.frame_of_body(body));
    }
    const std::span<const Piece> pieces = hex_.pieces_of(t);
    for (const Piece& p : pieces)
      if (p.side == 0) s_.hex_stamp[hex_.host[p.copy].index()] = s_.serial;
    // With one piece there is no choice for what lies inside the triangle.
    only_ = pieces.size() == 1 && pieces[0].side == 0 ? hex_.host[pieces[0].copy] : HexId{};
    // Nearly all vertices keep their copy: those inside the triangle, the most by far, are passed over in one loop.
    for (const PoolRun& run : body_.collision.free[t]) {
      if (!run.exists()) continue;
      const std::span<const VisualVertex> inside =
          body_.free_pool.slice(static_cast<std::size_t>(run.first), static_cast<std::size_t>(run.count));
      std::array<VisualVertex, 64> strays;  // their memory is on its way while the next ones are found
      std::size_t count = 0;
      const auto place_strays = [&] {
        for (std::size_t k = 0; k < count; ++k)
          if (body_.visual.free[strays[k]] != 0)
            place(t, pieces, strays[k], Ownership::kFree, CollisionMesh::corner(t, 0));
        count = 0;
      };
      for (std::size_t i = 0; i < inside.size(); ++i) {
        if (i + kPrefetchAhead < inside.size()) prefetch(e_.visual, inside[i + kPrefetchAhead]);
        const VisualVertex v = inside[i];
        if (is_ours(e_.visual[v])) continue;
        prefetch(body_.visual.free, v);
        prefetch(body_.visual.rest, v);
        strays[count++] = v;
        if (count == strays.size()) place_strays();
      }
      place_strays();
    }
    for_each_on_edges(body_, t, [&](VisualVertex v, Ownership how, CollisionHalfEdge h) {
      if (!is_ours(e_.visual[v])) place(t, pieces, v, how, h);
    });
    for (int i = 0; i < 3; ++i) {
      const CollisionHalfEdge h = CollisionMesh::corner(t, i);
      const CollisionVertex v = body_.collision.origin[h];
      const HexId current = e_.collision[v];
      if (is_ours(current)) continue;
      const Vec3 rest = body_.collision.rest[v], q = to_lattice_(rest);
      const HexId copy = search(t, Ownership::kCorner, h, q, current);
      if (copy == current) continue;
      e_.collision.set(v, copy);
      e_.collision_local.set(v, hex_.local(copy, rest));
    }
  }

 private:
  /// Is a copy one of those of the triangle looked at?
  [[nodiscard]] bool is_ours(HexId copy) const { return copy.valid() && s_.hex_stamp[copy.index()] == s_.serial; }

  void place(CollisionTriangle t, std::span<const Piece> pieces, VisualVertex v, Ownership how, CollisionHalfEdge h) {
    const HexId current = e_.visual[v];
    HexId copy = how == Ownership::kFree ? only_ : HexId{};
    if (!copy.valid()) {
      const Vec3 q = to_lattice_(body_.visual.rest[v]);
      copy = in_own_cell(pieces, q);
      if (!copy.valid()) copy = search(t, how, h, q, current);
    }
    if (copy == current) return;
    e_.visual.set(v, copy);
    moved_.push_back(v);
  }

  /// The copy of t's material in the very cell of the point; none if t has none there.
  [[nodiscard]] HexId in_own_cell(std::span<const Piece> pieces, Vec3 q) {
    LatticeIndex c;
    for (int a = 0; a < 3; ++a)
      c[static_cast<std::size_t>(a)] =
          std::clamp(static_cast<int>(std::floor(q[a])), to_lattice_.first[static_cast<std::size_t>(a)],
                     to_lattice_.last[static_cast<std::size_t>(a)]);
    const CellId cell = hex_.cell_id(c);
    // Vertices come in neighbourhoods: mostly it is the piece of the one before.
    if (last_ < pieces.size() && pieces[last_].cell == cell && pieces[last_].side == 0)
      return beside(q, c) ? HexId{} : hex_.host[pieces[last_].copy];
    std::size_t i = 0;
    if (pieces.size() > 16)
      i = static_cast<std::size_t>(
          std::lower_bound(pieces.begin(), pieces.end(), cell, [](const Piece& p, CellId id) { return p.cell < id; }) -
          pieces.begin());
    for (; i < pieces.size(); ++i)
      if (pieces[i].cell == cell && right_side(hex_, pieces[i], q)) {
        last_ = i;
        return beside(q, c) ? HexId{} : hex_.host[pieces[i].copy];
      }
    return {};
  }
  /// Clamped: is the point beside the lattice?
  static bool beside(Vec3 q, LatticeIndex c) {
    for (int a = 0; a < 3; ++a) {
      const double x = q[a] - c[static_cast<std::size_t>(a)];
      if (x < -kInside || x > 1 + kInside) return true;
    }
    return false;
  }

  /// Over all triangles that own the vertex.
  HexId search(CollisionTriangle t, Ownership how, CollisionHalfEdge h, Vec3 q, HexId current) {
    s_.triangles.clear();
    s_.triangles.push_back(t);
    if (how == Ownership::kChain) {
      if (const CollisionHalfEdge g = body_.collision.twin[h]; g.valid())
        s_.triangles.push_back(CollisionMesh::face(g));
    } else if (how == Ownership::kCorner) {
      body_.collision.for_each_outgoing(body_.collision.origin[h], [&](CollisionHalfEdge o) {
        if (CollisionMesh::face(o) != t) s_.triangles.push_back(CollisionMesh::face(o));
        return true;
      });
    }
    return find_copy(hex_, s_.triangles, q, current);
  }

  const CellComplex& body_;
  const HexMesh& hex_;
  Embedding& e_;
  EmbeddingScratch& s_;
  std::vector<VisualVertex>& moved_;
  std::int32_t whose_ = 0;  // the body that to_lattice_ is of
  ToLattice to_lattice_;
  HexId only_;            ///< the copy of the triangle looked at, if it has but one
  std::size_t last_ = 0;  ///< piece that the last vertex was in
};

/// Four doubles in a vector register (of g++ and clang; two smaller ones where the machine has none so wide).
using Lanes = double __attribute__((vector_size(4 * sizeof(double))));

/// Sum of trilinear_weights times nodes, in the order of the corners: weights four at a time, a node's coordinates in one register.
inline Vec3 place_of(const HexMesh& hex, EmbeddedPoint point, std::span<const Vec3> nodes) {
  const double x = point.local.x, y = point.local.y, z = point.local.z;
  const Lanes flat = (0.125 * Lanes{1 - x, 1 + x, 1 - x, 1 + x}) * Lanes{1 - y, 1 - y, 1 + y, 1 + y};
  const Lanes weight[2] = {flat * (1 - z), flat * (1 + z)};
  const std::array<NodeId, 8>& n = hex.nodes[point.copy];
  Lanes sum{};
  for (std::size_t c = 0; c < 8; ++c) {
    const Vec3& p = nodes[n[c].index()];
    sum += weight[c / 4][c % 4] * Lanes{p.x, p.y, p.z, 0};
  }
  return {sum[0], sum[1], sum[2]};
}

/// Derivatives of the position by the local coordinates.
std::array<Vec3, 3> local_gradient(const HexMesh& hex, EmbeddedPoint point, std::span<const Vec3> nodes) {
  std::array<Vec3, 3> g{};
  const double f[3][2] = {{1 - point.local.x, 1 + point.local.x},
                          {1 - point.local.y, 1 + point.local.y},
                          {1 - point.local.z, 1 + point.local.z}};
  for (std::size_t c = 0; c < 8; ++c) {
    const std::size_t b[3] = {c & 1, c >> 1 & 1, c >> 2 & 1};
    const Vec3 x = nodes[hex.nodes[point.copy][c].index()];
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t u = (a + 1) % 3, v = (a + 2) % 3;
      g[a] += (b[a] != 0 ? 0.125 : -0.125) * f[u][b[u]] * f[v][b[v]] * x;
    }
  }
  return g;
}

}  // namespace

Status embed_all(const CellComplex& body, const HexMesh& hex, Embedding& embedding) {
  embedding = {};
  EmbeddingScratch scratch;
  std::vector<VisualVertex> moved;
  Embedder embedder(body, hex, embedding, scratch, moved);
  for (const CollisionTriangle t : ids<CollisionTriangle>(body.collision.face_count())) embedder.embed(t);
  for (const VisualVertex v : ids<VisualVertex>(body.visual.vertex_count()))
    if (!embedding.visual[v].valid())
      return failed(fmt::format("embedding: visual vertex {} is owned by no collision element; bind the meshes again",
                                v.value + 1));
  return {};
}

void embed_triangles(const CellComplex& body, const HexMesh& hex, std::span<const CollisionTriangle> triangles,
                     Embedding& embedding, EmbeddingScratch& scratch, std::vector<VisualVertex>& moved) {
  Embedder embedder(body, hex, embedding, scratch, moved);
  for (const CollisionTriangle t : triangles) embedder.embed(t);
}

Vec3 point_position(const HexMesh& hex, EmbeddedPoint point, std::span<const Vec3> nodes) {
  return place_of(hex, point, nodes);
}

NodeForces spread_force(const HexMesh& hex, EmbeddedPoint point, Vec3 force) {
  NodeForces out;
  out.node = hex.nodes[point.copy];
  const std::array<double, 8> w = trilinear_weights(point.local);
  for (std::size_t c = 0; c < 8; ++c) out.force[c] = w[c] * force;
  return out;
}

EmbeddedPoint embed_point(const HexMesh& hex, CollisionTriangle owner, Vec3 rest_point) {
  const CollisionTriangle owners[1] = {owner};
  return embed_point(hex, owners, rest_point);
}

EmbeddedPoint embed_point(const HexMesh& hex, std::span<const CollisionTriangle> owners, Vec3 rest_point) {
  const auto with_pieces =
      std::find_if(owners.begin(), owners.end(), [&](CollisionTriangle t) { return !hex.pieces_of(t).empty(); });
  if (with_pieces == owners.end()) return {};
  const LatticeFrame& frame = hex.frame_at(hex.index_of(hex.pieces_of(*with_pieces)[0].cell));
  const HexId copy = find_copy(hex, owners, frame.to_lattice(rest_point), {});
  return {copy, hex.local(copy, rest_point)};
}

void collision_positions(const HexMesh& hex, const Embedding& embedding, std::span<const Vec3> nodes,
                         std::span<Vec3> out) {
  KERF_ASSERT(out.size() == embedding.collision.size());
  for (const CollisionVertex v : ids<CollisionVertex>(embedding.collision.size()))
    out[v.index()] = place_of(hex, {embedding.collision[v], embedding.collision_local[v]}, nodes);
}

Mat3 deformation_gradient(const HexMesh& hex, EmbeddedPoint point, std::span<const Vec3> nodes) {
  const std::array<Vec3, 3> g = local_gradient(hex, point, nodes);
  const LatticeFrame& frame = hex.frame_of(point.copy);
  Mat3 f;
  for (int j = 0; j < 3; ++j) {  // F = sum over axes a of (2 / h_a) g_a axis_a'
    Vec3 column{};
    for (std::size_t a = 0; a < 3; ++a) column += (2 / frame.cell[static_cast<int>(a)]) * frame.axes.c[a][j] * g[a];
    f.c[static_cast<std::size_t>(j)] = column;
  }
  return f;
}

Vec3 deformed_normal(const HexMesh& hex, EmbeddedPoint point, Vec3 rest_normal, std::span<const Vec3> nodes) {
  const Mat3 f = deformation_gradient(hex, point, nodes);
  const Vec3 n = rest_normal.x * cross(f.c[1], f.c[2]) + rest_normal.y * cross(f.c[2], f.c[0]) +
                 rest_normal.z * cross(f.c[0], f.c[1]);
  return norm(n) > 1e-12 ? normalized(n) : rest_normal;
}

}  // namespace kerf
