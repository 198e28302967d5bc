#include "kerf/session/body.h"

#include <array>

#include "kerf/cutting/pieces.h"

namespace kerf {
namespace {

// Member by member where a type has padding: its bytes mean nothing.
template <class T>
void add(Hash& hash, const T& item) {
  hash.add(item);
}
void add(Hash& hash, const PoolRun& r) { hash.add(std::array<std::int32_t, 3>{r.first, r.count, r.reversed ? 1 : 0}); }
void add(Hash& hash, const std::array<PoolRun, 2>& runs) {
  for (const PoolRun& r : runs) add(hash, r);
}
void add(Hash& hash, const HexMaterial& m) {
  hash.add(std::array<double, 5>{m.fill, m.volume, m.mass_volume, m.full ? 1.0 : 0.0, static_cast<double>(m.body)});
}
void add(Hash& hash, const Piece& p) {
  hash.add(std::array<std::int32_t, 5>{p.cell.value, p.copy.value, p.tip.value, p.side, p.has_moments ? 1 : 0});
  hash.add(p.volume);
}
void add(Hash& hash, const PrismCorners& c) {
  hash.add(c.minus);
  hash.add(c.plus);
  hash.add(c.root);
}
void add(Hash& hash, const TipCell& t) {
  hash.add(std::array<std::int32_t, 7>{t.vertex.value, t.cell.value, t.next_of_vertex.value, t.next_in_cell.value,
                                       t.active ? 1 : 0, t.left.value, t.right.value});
  hash.add(t.passed);
  hash.add(t.point);
  hash.add(t.normal);
  hash.add(t.along);
}

}  // namespace

Body::Body() = default;
Body::Body(const Body&) = default;
Body::Body(Body&&) noexcept = default;
Body& Body::operator=(const Body&) = default;
Body& Body::operator=(Body&&) noexcept = default;
Body::~Body() = default;

template void journal_mark(Body&, JournalMark&);
template void journal_rollback(Body&, const JournalMark&);
template bool journal_compact(Body&, const JournalMark&);
template JournalStep journal_take(Body&, const JournalMark&);
template void journal_undo(Body&, JournalStep&);
template void journal_redo(Body&, JournalStep&);

std::uint64_t body_hash(const Body& body) {
  Hash hash;
  Body& arrays = const_cast<Body&>(body);  // for_each_array hands out references; none is written to
  arrays.for_each_array([&](const auto& a) {
    hash.add(std::uint64_t{a.size()});  // std::size_t is narrower on some platforms
    for (const auto& item : a.raw()) add(hash, item);
  });
  return hash.value();
}

BodyCounts count_body(const Body& body) { return count_body(body, collision_pieces(body.complex).count); }

BodyCounts count_body(const Body& body, int pieces) {
  BodyCounts c;
  c.visual_vertices = body.complex.visual.vertex_count();
  c.visual_triangles = body.complex.visual.face_count();
  c.collision_vertices = body.complex.collision.vertex_count();
  c.collision_triangles = body.complex.collision.face_count();
  c.nodes = count_active_nodes(body.hex);
  c.hexahedra = count_alive(body.hex);
  c.pieces = pieces;
  return c;
}

}  // namespace kerf
