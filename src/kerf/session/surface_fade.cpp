#include "kerf/session/surface_fade.h"

#include <algorithm>
#include <cmath>

#include "kerf/embedding/owned_vertices.h"

namespace kerf {
namespace {

using Mark = std::pair<std::size_t, std::size_t>;  // size and log length

Mark mark_of(const Body& body, const JournalMark& mark, const void* array) {
  Mark found;
  std::size_t i = 0;
  const_cast<Body&>(body).for_each_array([&](auto& a) {  // hands out references; none is written to
    if (static_cast<const void*>(&a) == array) found = mark.arrays[i];
    ++i;
  });
  return found;
}

/// The values that the items of an array had at a mark, for those written to since; by id, each once.
template <class Id, class T, class Out>
void values_at(const Body& body, const JournalMark& mark, const Journaled<Id, T>& array, Out& out) {
  out.clear();
  const auto [size, log] = mark_of(body, mark, &array);
  array.for_each_logged({size, log}, [&](Id id, const T& old) { out.push_back({typename Out::value_type::first_type(id.value), old}); });
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  out.erase(std::unique(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.first == b.first; }), out.end());
}

template <class List, class Key>
auto* value_of(const List& list, Key key) {
  const auto it = std::lower_bound(list.begin(), list.end(), key, [](const auto& a, Key k) { return a.first < k; });
  return it != list.end() && it->first == key ? &it->second : nullptr;
}

class Rememberer {
 public:
  Rememberer(const MovingSurface& now, SurfaceMemory& memory) : now_(now), body_(now.body), m_(memory) {
    if (m_.seen_visual.size() < body_.complex.visual.vertex_count()) m_.seen_visual.resize(2 * body_.complex.visual.vertex_count());
    if (m_.seen_collision.size() < body_.complex.collision.vertex_count())
      m_.seen_collision.resize(2 * body_.complex.collision.vertex_count());
    m_.old_visual.clear();
    m_.old_collision.clear();
    m_.old_nodes.clear();
    m_.copies.clear();
    m_.cells.clear();
  }

  /// Vertices with copies and nodes as they were at the mark; the change is done.
  void as_of(const JournalMark& mark) {
    values_at(body_, mark, body_.embedding.visual, m_.old_visual);
    values_at(body_, mark, body_.embedding.collision, m_.old_collision);
    values_at(body_, mark, body_.hex.nodes, m_.old_nodes);
    for (const auto& [v, copy] : m_.old_visual) visual(VisualVertex(v));
    for (const auto& [v, copy] : m_.old_collision) collision(CollisionVertex(v));
    for (const auto& [copy, nodes] : m_.old_nodes) {
      bool moved = false;
      for (std::size_t c = 0; c < 8; ++c) {
        const NodeId n = body_.hex.nodes[copy][c];
        moved = moved || !(old_position(nodes[c]) == now_.positions[n.index()]) || !(old_velocity(nodes[c]) == now_.velocities[n.index()]);
      }
      if (moved) m_.copies.push_back(copy);
    }
    for (const NodeMotion& n : m_.nodes) copies_around(n.node);
    all_in_copies();
    for (const FadingVertex& f : now_.fade.visual) visual(VisualVertex(f.vertex));
    for (const FadingVertex& f : now_.fade.collision) collision(CollisionVertex(f.vertex));
  }

  /// Vertices as they are now, around some nodes.
  void around(std::span<const NodeId> nodes) {
    for (const NodeId n : nodes) copies_around(n);
    std::sort(m_.copies.begin(), m_.copies.end());
    m_.copies.erase(std::unique(m_.copies.begin(), m_.copies.end()), m_.copies.end());
    all_in_copies();
  }

  /// Vertices as they are now; what has changed since the mark is about to be taken back.
  void before_rollback(const JournalMark& mark) {
    const auto& hex = body_.hex;
    std::vector<std::pair<std::int32_t, HexId>> changed;
    values_at(body_, mark, body_.embedding.visual, changed);
    for (const auto& [v, copy] : changed) visual(VisualVertex(v));
    for (std::size_t v = mark_of(body_, mark, &body_.embedding.visual).first; v < body_.embedding.visual.size(); ++v)
      visual(VisualVertex(v));  // the next walk may make it again
    values_at(body_, mark, body_.embedding.collision, changed);
    for (const auto& [v, copy] : changed) collision(CollisionVertex(v));
    for (std::size_t v = mark_of(body_, mark, &body_.embedding.collision).first; v < body_.embedding.collision.size(); ++v)
      collision(CollisionVertex(v));
    // What was moved to a copy made since is among those; here are the copies that get other nodes.
    std::vector<std::pair<HexId, std::array<NodeId, 8>>> before;
    values_at(body_, mark, hex.nodes, before);
    for (const auto& [copy, nodes] : before) {
      bool moves = false;
      for (std::size_t c = 0; c < 8; ++c) {
        const std::size_t a = nodes[c].index(), b = hex.nodes[copy][c].index();
        moves = moves || !(now_.positions[a] == now_.positions[b]) || !(now_.velocities[a] == now_.velocities[b]);
      }
      if (moves) m_.copies.push_back(copy);
    }
    all_in_copies();
    for (const FadingVertex& f : now_.fade.visual) visual(VisualVertex(f.vertex));
    for (const FadingVertex& f : now_.fade.collision) collision(CollisionVertex(f.vertex));
  }

 private:
  void copies_around(NodeId n) {
    const LatticeIndex q = body_.hex.corner[n];
    for (int k = 0; k < 8; ++k) {
      const LatticeIndex c{q[0] - (k & 1), q[1] - (k >> 1 & 1), q[2] - (k >> 2 & 1)};
      if (!body_.hex.frame.contains(c)) continue;
      for (HexId h = body_.hex.first_copy[body_.hex.frame.cell_id(c)]; h.valid(); h = body_.hex.next_in_cell[h])
        if (body_.hex.nodes[h][static_cast<std::size_t>(k)] == n) m_.copies.push_back(h);
    }
  }

  /// All vertices whose owners have material in the cells of m_.copies and of what these have absorbed.
  void all_in_copies() {
    for (std::size_t i = 0; i < m_.copies.size(); ++i) {
      const HexId h = m_.copies[i];
      m_.cells.push_back(body_.hex.frame.cell_id(body_.hex.cell[h]));
      for (HexId g = body_.hex.first_guest[h]; g.valid(); g = body_.hex.next_guest[g]) m_.copies.push_back(g);
    }
    std::sort(m_.cells.begin(), m_.cells.end());
    m_.cells.erase(std::unique(m_.cells.begin(), m_.cells.end()), m_.cells.end());
    for (const CellId cell : m_.cells)
      for (const CollisionTriangle t : body_.hex.members_of(cell)) {
        for_each_owned(body_.complex, t, [&](VisualVertex v, Ownership, CollisionHalfEdge) { visual(v); });
        for (int i = 0; i < 3; ++i) collision(body_.complex.collision.origin[CollisionMesh::corner(t, i)]);
      }
  }

  [[nodiscard]] const NodeMotion* old_node(NodeId n) const {
    for (const NodeMotion& o : m_.nodes)
      if (o.node == n) return &o;  // the first change has the oldest value
    return nullptr;
  }
  [[nodiscard]] Vec3 old_position(NodeId n) const {
    const NodeMotion* o = old_node(n);
    return o ? o->position : now_.positions[n.index()];
  }
  [[nodiscard]] Vec3 old_velocity(NodeId n) const {
    const NodeMotion* o = old_node(n);
    return o ? o->velocity : now_.velocities[n.index()];
  }

  // A vertex that no embedding knows yet is of a walk that is about to be taken back.
  void visual(VisualVertex v) {
    if (!body_.embedding.visual.contains(v) || m_.seen_visual[v.index()] == m_.round) return;
    const HexId* old = value_of(m_.old_visual, v.value);
    note(v.value, body_.complex.visual.rest[v], old ? *old : body_.embedding.visual[v], m_.seen_visual[v.index()], m_.visual);
  }
  void collision(CollisionVertex v) {
    if (!body_.embedding.collision.contains(v) || m_.seen_collision[v.index()] == m_.round) return;
    const HexId* old = value_of(m_.old_collision, v.value);
    note(v.value, body_.complex.collision.rest[v], old ? *old : body_.embedding.collision[v], m_.seen_collision[v.index()], m_.collision);
  }
  void note(std::int32_t vertex, Vec3 rest, HexId copy, std::uint32_t& seen, std::vector<SurfaceMemory::Vertex>& out) {
    if (!copy.valid()) return;  // it may be new
    seen = m_.round;
    const NodesThen* nodes = nodes_then(copy);
    if (nodes == nullptr) return;
    const std::array<double, 8> w = weights(body_.hex, copy, rest);
    SurfaceMemory::Vertex item{vertex, rest, {}, {}};
    for (std::size_t c = 0; c < 8; ++c) {
      item.position += w[c] * nodes->position[c];
      item.velocity += w[c] * nodes->velocity[c];
    }
    out.push_back(item);
  }

  /// How the nodes of a copy moved then; null for one that the change has made. Neighbours in a surface mostly share a copy, so the last
  /// few are kept.
  struct NodesThen {
    HexId copy;
    bool valid = false;
    std::array<Vec3, 8> position, velocity;
  };
  const NodesThen* nodes_then(HexId copy) {
    NodesThen& found = kept_[copy.index() % kept_.size()];
    if (found.copy != copy) {
      found.copy = copy;
      const std::array<NodeId, 8>* old = value_of(m_.old_nodes, copy);
      const std::array<NodeId, 8>& nodes = old ? *old : body_.hex.nodes[copy];
      found.valid = nodes[0].valid();
      for (std::size_t c = 0; found.valid && c < 8; ++c) {
        found.position[c] = old_position(nodes[c]);
        found.velocity[c] = old_velocity(nodes[c]);
      }
    }
    return found.valid ? &found : nullptr;
  }

  const MovingSurface& now_;
  const Body& body_;
  SurfaceMemory& m_;
  std::array<NodesThen, 16> kept_;
};

template <class RestOf, class CopyOf>
void hold(const Body& body, std::span<const Vec3> positions, std::span<const Vec3> velocities, double negligible, std::size_t count,
          RestOf&& rest_of, CopyOf&& copy_of, const std::vector<SurfaceMemory::Vertex>& memory, SurfaceMemory& scratch,
          std::vector<FadingVertex>& list) {
  auto& order = scratch.order;
  auto& merged = scratch.merged;
  order.clear();
  for (std::size_t i = 0; i < memory.size(); ++i) order.emplace_back(memory[i].vertex, static_cast<std::int32_t>(i));
  std::sort(order.begin(), order.end());
  merged.clear();
  auto old = list.begin();
  const auto keep = [&](const FadingVertex& f) {
    if (static_cast<std::size_t>(f.vertex) < count) merged.push_back(f);
  };
  for (const auto& [vertex, place] : order) {
    const SurfaceMemory::Vertex& m = memory[static_cast<std::size_t>(place)];
    Vec3 position = m.position, velocity = m.velocity;
    for (; old != list.end() && old->vertex < m.vertex; ++old) keep(*old);
    if (old != list.end() && old->vertex == m.vertex) {
      position += old->offset;
      velocity += old->velocity;
      ++old;
    }
    if (static_cast<std::size_t>(m.vertex) >= count || !(rest_of(m.vertex) == m.rest)) continue;  // gone, or another point
    const HexId copy = copy_of(m.vertex);
    const std::array<NodeId, 8>& nodes = body.hex.nodes[copy];
    const std::array<double, 8> w = weights(body.hex, copy, m.rest);
    Vec3 now{}, moving{};
    for (std::size_t c = 0; c < 8; ++c) {
      now += w[c] * positions[nodes[c].index()];
      moving += w[c] * velocities[nodes[c].index()];
    }
    const FadingVertex f{m.vertex, position - now, velocity - moving};
    if (norm(f.offset) > negligible || norm(f.velocity) > negligible * kFadeRate) merged.push_back(f);
  }
  for (; old != list.end(); ++old) keep(*old);
  list.swap(merged);
}

}  // namespace

void fade_offsets(SurfaceFade& fade, double dt, double negligible) {
  const double decay = std::exp(-kFadeRate * dt);
  for (std::vector<FadingVertex>* list : {&fade.visual, &fade.collision}) {
    for (FadingVertex& f : *list) {
      const Vec3 rate = f.velocity + kFadeRate * f.offset;
      f.offset = decay * (f.offset + dt * rate);
      f.velocity = decay * rate - kFadeRate * f.offset;
    }
    std::erase_if(*list, [&](const FadingVertex& f) { return norm(f.offset) + norm(f.velocity) / kFadeRate < negligible; });
  }
}

const FadingVertex* fading(std::span<const FadingVertex> list, std::size_t vertex) {
  const auto v = static_cast<std::int32_t>(vertex);
  const auto it = std::lower_bound(list.begin(), list.end(), v, [](const FadingVertex& f, std::int32_t k) { return f.vertex < k; });
  return it != list.end() && it->vertex == v ? &*it : nullptr;
}

void begin_surface(SurfaceMemory& memory) {
  memory.visual.clear();
  memory.collision.clear();
  memory.nodes.clear();
  ++memory.round;
}

void remember_surface(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory) {
  Rememberer(state, memory).before_rollback(mark);
}

void remember_surface_before(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory) {
  Rememberer(state, memory).as_of(mark);
}

void remember_surface_around(const MovingSurface& state, std::span<const NodeId> nodes, SurfaceMemory& memory) {
  Rememberer(state, memory).around(nodes);
}

void hold_surface(const Body& body, std::span<const Vec3> positions, std::span<const Vec3> velocities, double negligible,
                  SurfaceMemory& memory, SurfaceFade& fade) {
  hold(body, positions, velocities, negligible, body.complex.visual.vertex_count(),
       [&](std::int32_t v) { return body.complex.visual.rest[VisualVertex(v)]; },
       [&](std::int32_t v) { return body.embedding.visual[VisualVertex(v)]; }, memory.visual, memory, fade.visual);
  hold(body, positions, velocities, negligible, body.complex.collision.vertex_count(),
       [&](std::int32_t v) { return body.complex.collision.rest[CollisionVertex(v)]; },
       [&](std::int32_t v) { return body.embedding.collision[CollisionVertex(v)]; }, memory.collision, memory, fade.collision);
}

}  // namespace kerf
