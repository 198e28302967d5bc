#include "kerf/session/held_skin.h"

#include <algorithm>

#include "kerf/embedding/owned_vertices.h"

namespace kerf {
namespace {

/// Calls f(copy) for the copies of a cell and of those around it.
template <class Fn>
void for_each_copy_around(const HexMesh& hex, CellId cell, Fn&& f) {
  const LatticeIndex c = hex.index_of(cell);
  const LatticeFrame& frame = hex.frame_at(c);
  for (int k = 0; k < 27; ++k) {
    const LatticeIndex at{c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1};
    if (!frame.contains(at)) continue;
    for (HexId h = hex.first_copy[hex.cell_id(at)]; h.valid(); h = hex.next_in_cell[h]) f(h);
  }
}

/// Flags of living copies that carry held material and have a node that moves: of cells that a border crosses, or beside one.
std::vector<std::uint8_t> moving_copies(const HexMesh& hex, const HeldRegions& held, const MechanicsModel& model) {
  std::vector<std::uint8_t> moving(hex.hex_count(), 0);
  for (const CellId cell : held.cells)
    for_each_copy_around(hex, cell, [&](HexId h) {
      const HexId host = hex.host[h];
      if (!host.valid() || moving[host.index()] != 0 || held_part(hex, held, h) == HeldPart::kNone) return;
      const auto& nodes = hex.nodes[host];
      const bool fixed = std::all_of(nodes.begin(), nodes.end(), [&](NodeId n) { return model.is_fixed(n); });
      moving[host.index()] = fixed ? 0 : 1;
    });
  return moving;
}

template <class Vertex>
void add(const HexMesh& hex, ShownNodes nodes, std::span<const Vertex> held, const Journaled<Vertex, Vec3>& rest,
         const Journaled<Vertex, HexId>& copies, std::span<const FadingVertex> fades, std::vector<FadingVertex>& out) {
  out.clear();
  auto fade = fades.begin();
  for (const Vertex v : held) {
    for (; fade != fades.end() && fade->vertex < v.value; ++fade) out.push_back(*fade);
    if (fade != fades.end() && fade->vertex == v.value) ++fade;
    const EmbeddedPoint point{copies[v], hex.local(copies[v], rest[v])};
    out.push_back({v.value, rest[v] - point_position(hex, point, nodes.positions),
                   -1.0 * point_position(hex, point, nodes.velocities)});
  }
  out.insert(out.end(), fade, fades.end());
}

}  // namespace

void find_held_vertices(const Body& body, const HeldRegions& held, const MechanicsModel& model,
                        std::vector<CollisionVertex>& out) {
  out.clear();
  if (!held.cross) return;
  const std::vector<std::uint8_t> moving = moving_copies(body.hex, held, model);
  const CollisionMesh& mesh = body.complex.collision;
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
    if (const HexId copy = body.embedding.collision[v];
        copy.valid() && moving[copy.index()] != 0 && held.contains(mesh.rest[v]))
      out.push_back(v);
}

void find_held_vertices(const Body& body, const HeldRegions& held, const MechanicsModel& model,
                        std::vector<VisualVertex>& out) {
  out.clear();
  if (!held.cross) return;
  const std::vector<std::uint8_t> moving = moving_copies(body.hex, held, model);
  const auto moves = [&](HexId copy) { return copy.valid() && moving[copy.index()] != 0; };
  for (const CollisionTriangle t : ids<CollisionTriangle>(body.complex.collision.face_count())) {
    const std::span<const Piece> pieces = body.hex.pieces_of(t);
    if (std::none_of(pieces.begin(), pieces.end(), [&](const Piece& p) { return moves(body.hex.host[p.copy]); }))
      continue;
    for_each_owned(body.complex, t, [&](VisualVertex v, Ownership, CollisionHalfEdge) {
      if (moves(body.embedding.visual[v]) && held.contains(body.complex.visual.rest[v])) out.push_back(v);
    });
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
}

void add_held(const Body& body, ShownNodes nodes, std::span<const VisualVertex> held,
              std::span<const FadingVertex> fades, std::vector<FadingVertex>& out) {
  add(body.hex, nodes, held, body.complex.visual.rest, body.embedding.visual, fades, out);
}

void add_held(const Body& body, ShownNodes nodes, std::span<const CollisionVertex> held,
              std::span<const FadingVertex> fades, std::vector<FadingVertex>& out) {
  add(body.hex, nodes, held, body.complex.collision.rest, body.embedding.collision, fades, out);
}

}  // namespace kerf
