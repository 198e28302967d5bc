#include "kerf/embedding/embedding_validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kerf/embedding/owned_vertices.h"

namespace kerf {
namespace {

bool reproduces(const HexMesh& hex, HexId copy, Vec3 rest) {
  const std::array<double, 8> w = weights(hex, copy, rest);
  Vec3 p{};
  for (std::size_t c = 0; c < 8; ++c) p += w[c] * hex.rest(hex.nodes[copy][c]);
  const double smallest = shortest_cell_edge(hex);
  return norm(p - rest) <= 1e-9 * smallest;
}

bool hosts(const HexMesh& hex, CollisionTriangle t, HexId copy) {
  for (const Piece& p : hex.pieces_of(t))
    if (hex.host[p.copy] == copy) return true;
  return false;
}

}  // namespace

EmbeddingReach embedding_reach(const CellComplex& body, const HexMesh& hex, const Embedding& embedding) {
  EmbeddingReach reach;
  for (const VisualVertex v : ids<VisualVertex>(embedding.visual.size())) {
    const Vec3 p = hex.local(embedding.visual[v], body.visual.rest[v]);
    const double out = 0.5 * (std::fmax(std::fabs(p.x), std::fmax(std::fabs(p.y), std::fabs(p.z))) - 1);
    if (out > 1e-9) ++reach.outside;
    reach.farthest = std::fmax(reach.farthest, out);
  }
  return reach;
}

Status validate_embedding(const CellComplex& body, const HexMesh& hex, const Embedding& embedding) {
  if (embedding.visual.size() != body.visual.vertex_count() ||
      embedding.collision.size() != body.collision.vertex_count())
    return failed(fmt::format("embedding: {} visual and {} collision vertices, but the body has {} and {}",
                              embedding.visual.size(), embedding.collision.size(), body.visual.vertex_count(),
                              body.collision.vertex_count()));
  std::vector<std::uint8_t> housed(embedding.visual.size(), 0), owned(embedding.visual.size(), 0);
  std::vector<std::uint8_t> corner_housed(embedding.collision.size(), 0);
  for (const CollisionTriangle t : ids<CollisionTriangle>(body.collision.face_count())) {
    for_each_owned(body, t, [&](VisualVertex v, Ownership, CollisionHalfEdge) {
      owned[v.index()] = 1;
      if (hosts(hex, t, embedding.visual[v])) housed[v.index()] = 1;
    });
    for (int i = 0; i < 3; ++i) {
      const CollisionVertex v = body.collision.origin[CollisionMesh::corner(t, i)];
      if (hosts(hex, t, embedding.collision[v])) corner_housed[v.index()] = 1;
    }
  }
  for (const VisualVertex v : ids<VisualVertex>(embedding.visual.size())) {
    const HexId h = embedding.visual[v];
    if (!h.valid() || !hex.alive(h))
      return failed(fmt::format("embedding: visual vertex {} has no living copy", v.value));
    if (owned[v.index()] == 0) return failed(fmt::format("embedding: visual vertex {} has no owner", v.value));
    if (housed[v.index()] == 0)
      return failed(fmt::format("embedding: visual vertex {} is in copy {}, which holds nothing of its owners", v.value,
                                h.value));
    if (!reproduces(hex, h, body.visual.rest[v]))
      return failed(fmt::format("embedding: visual vertex {} is not where its copy {} puts it", v.value, h.value));
  }
  for (const CollisionVertex v : ids<CollisionVertex>(embedding.collision.size())) {
    const HexId h = embedding.collision[v];
    if (!h.valid() || !hex.alive(h))
      return failed(fmt::format("embedding: collision vertex {} has no living copy", v.value));
    if (corner_housed[v.index()] == 0)
      return failed(fmt::format("embedding: collision vertex {} is in copy {}, which holds nothing of its triangles",
                                v.value, h.value));
    if (!reproduces(hex, h, body.collision.rest[v]) ||
        norm(embedding.collision_local[v] - hex.local(h, body.collision.rest[v])) > 1e-12)
      return failed(fmt::format("embedding: collision vertex {} is not where its copy {} puts it", v.value, h.value));
  }
  return {};
}

}  // namespace kerf
