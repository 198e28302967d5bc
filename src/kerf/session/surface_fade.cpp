#include "kerf/session/surface_fade.h"

#include <algorithm>
#include <cmath>

#include "kerf/embedding/owned_vertices.h"

namespace kerf {
namespace {

/// Of what is negligible for a vertex, for the corners of its cell: outside of the cell weights are larger than 1.
constexpr double kCornerShare = 0.1;
/// Rounding of sums of a few numbers, relative.
constexpr double kRelative = 1e-15;

template <class Id, class T>
typename Journaled<Id, T>::Mark mark_of(const Body& body, const JournalMark& mark, const Journaled<Id, T>& array) {
  typename Journaled<Id, T>::Mark found;
  std::size_t i = 0;
  const_cast<Body&>(body).for_each_array([&](auto& a) {  // hands out references; none is written to
    if (static_cast<const void*>(&a) == &array) found = {mark.arrays[i].first, mark.arrays[i].second};
    ++i;
  });
  return found;
}

/// A point at rest in the coordinates of a cell, -1 to 1 inside.
Vec3 local_in(const LatticeFrame& frame, LatticeIndex cell, Vec3 rest) {
  const Vec3 q = frame.to_lattice(rest);
  return {2 * (q.x - cell[0]) - 1, 2 * (q.y - cell[1]) - 1, 2 * (q.z - cell[2]) - 1};
}

/// One kind of vertices: what is asked of both.
struct VisualKind {
  using Id = VisualVertex;
  static const auto& copies(const Body& b) { return b.embedding.visual; }
  static Vec3 rest(const Body& b, Id v) { return b.complex.visual.rest[v]; }
  static std::size_t count(const Body& b) { return b.complex.visual.vertex_count(); }
  static auto& seen(SurfaceMemory& m) { return m.seen_visual; }
  static std::size_t count_then(const SurfaceMemory& m) { return m.visual_count; }
  static auto& remembered(SurfaceMemory& m) { return m.visual; }
  static auto& fading(SurfaceFade& f) { return f.visual; }
};
struct CollisionKind {
  using Id = CollisionVertex;
  static const auto& copies(const Body& b) { return b.embedding.collision; }
  static Vec3 rest(const Body& b, Id v) { return b.complex.collision.rest[v]; }
  static std::size_t count(const Body& b) { return b.complex.collision.vertex_count(); }
  static auto& seen(SurfaceMemory& m) { return m.seen_collision; }
  static std::size_t count_then(const SurfaceMemory& m) { return m.collision_count; }
  static auto& remembered(SurfaceMemory& m) { return m.collision; }
  static auto& fading(SurfaceFade& f) { return f.collision; }
};

class Rememberer {
 public:
  Rememberer(const MovingSurface& now, SurfaceMemory& memory) : now_(now), body_(now.body), m_(memory) {
    if (m_.seen_copy.size() < body_.hex.hex_count()) m_.seen_copy.resize(2 * body_.hex.hex_count());
  }

  void change(const JournalMark& mark) {
    const auto nodes = mark_of(body_, mark, body_.hex.nodes);
    body_.hex.nodes.for_each_logged(nodes, [&](HexId h, const std::array<NodeId, 8>& old) {
      if (h.index() < nodes.size) touch(h, old);
    });
    old_vertices<VisualKind>(mark);
    old_vertices<CollisionKind>(mark);
  }

  void rollback(const JournalMark& mark) {
    const auto nodes = mark_of(body_, mark, body_.hex.nodes);
    body_.hex.nodes.for_each_changed(nodes, [&](HexId h) { touch(h, body_.hex.nodes[h]); });
    new_vertices<VisualKind>(mark);
    new_vertices<CollisionKind>(mark);
    // Numbers of copies that go may come again.
    for (SurfaceMemory::Copy& c : m_.copies)
      if (c.copy.valid() && c.copy.index() >= nodes.size) {
        m_.seen_copy[c.copy.index()] = {};
        c.copy = {};
      }
  }

  void moved(std::size_t first, std::size_t old_copies, NodeFade& fade) {
    for (std::size_t i = first; i < m_.nodes.size(); ++i) {
      const NodeMotion& was = m_.nodes[i];
      const NodeId n = was.node;
      const auto begin = m_.nodes.begin() + static_cast<std::ptrdiff_t>(first),
                 here = m_.nodes.begin() + static_cast<std::ptrdiff_t>(i);
      if (std::any_of(begin, here, [&](const NodeMotion& m) { return m.node == n; })) continue;  // moved twice
      const Vec3 then = was.shown_position(), now = position(n);
      if (then == now && was.shown_velocity() == velocity(n)) continue;
      double stays = 0,
             goes = 0;  // m^3 of material that the node was shown to move then, and that moved as it does now
      for_each_copy_at(n, old_copies, [&](HexId h, std::size_t corner) {
        const SurfaceMemory::Seen& seen = m_.seen_copy[h.index()];
        const bool known = seen.round == m_.round;
        const Vec3 at = known ? m_.copies[static_cast<std::size_t>(seen.place)].position[corner] : then;
        (norm(at - now) < norm(at - then) ? goes : stays) += body_.hex.material[h].volume;
      });
      if (stays > goes)
        fade.set(n, then - now_.positions[n.index()], was.shown_velocity() - now_.velocities[n.index()]);
      else for_each_copy_at(n, old_copies, [&](HexId h, std::size_t) { touch(h, body_.hex.nodes[h], m_.nodes); });
    }
  }

 private:
  [[nodiscard]] Vec3 position(NodeId n) const { return now_.positions[n.index()] + now_.fade.nodes.offset_of(n); }
  [[nodiscard]] Vec3 velocity(NodeId n) const { return now_.velocities[n.index()] + now_.fade.nodes.velocity_of(n); }

  /// Calls f(copy, corner) for living copies at a node that were there before.
  template <class Fn>
  void for_each_copy_at(NodeId n, std::size_t old_copies, Fn&& f) {
    const LatticeIndex q = body_.hex.corner[n];
    for (int k = 0; k < 8; ++k) {
      const LatticeIndex c{q[0] - (k & 1), q[1] - (k >> 1 & 1), q[2] - (k >> 2 & 1)};
      if (!body_.hex.contains(c)) continue;
      const auto corner = static_cast<std::size_t>(k);
      for (HexId h = body_.hex.first_copy[body_.hex.cell_id(c)]; h.valid(); h = body_.hex.next_in_cell[h])
        if (h.index() < old_copies && body_.hex.alive(h) && body_.hex.nodes[h][corner] == n) f(h, corner);
    }
  }

  /// Keeps what a copy is shown with, if it is not kept yet. Its place in the memory, or -1 for one that has no nodes.
  std::int32_t touch(HexId h, const std::array<NodeId, 8>& nodes, std::span<const NodeMotion> before = {}) {
    SurfaceMemory::Seen& seen = m_.seen_copy[h.index()];
    if (seen.round == m_.round) return seen.place;
    if (!nodes[0].valid()) return -1;
    seen = {m_.round, static_cast<std::int32_t>(m_.copies.size())};
    SurfaceMemory::Copy& copy = m_.copies.emplace_back();
    copy.copy = h;
    copy.cell = body_.hex.cell[h];
    for (std::size_t c = 0; c < 8; ++c) {
      // The first change of a node has the oldest value.
      const auto old =
          std::find_if(before.begin(), before.end(), [&](const NodeMotion& m) { return m.node == nodes[c]; });
      copy.position[c] = old != before.end() ? old->shown_position() : position(nodes[c]);
      copy.velocity[c] = old != before.end() ? old->shown_velocity() : velocity(nodes[c]);
    }
    return seen.place;
  }

  /// Vertices that have another copy since the mark, in the one that they had.
  template <class Kind>
  void old_vertices(const JournalMark& mark) {
    const auto& copies = Kind::copies(body_);
    const auto then = mark_of(body_, mark, copies);
    const std::size_t known = mark_of(body_, mark, body_.hex.nodes).size;
    copies.for_each_logged(then, [&](typename Kind::Id v, HexId copy) {
      if (v.index() < then.size && copy.valid() && copy.index() < known) note<Kind>(v, copy);
    });
  }
  /// Vertices that will have another copy, or be gone, in the one that they have.
  template <class Kind>
  void new_vertices(const JournalMark& mark) {
    const auto& copies = Kind::copies(body_);
    const auto then = mark_of(body_, mark, copies);
    const auto note_now = [&](typename Kind::Id v) {
      if (copies[v].valid()) note<Kind>(v, copies[v]);
    };
    copies.for_each_changed(then, note_now);
    for (std::size_t v = then.size; v < copies.size(); ++v)
      note_now(typename Kind::Id(v));  // the next walk may make it again
  }
  /// Vertices born in this pose can't jump.
  template <class Kind>
  void note(typename Kind::Id v, HexId copy) {
    auto& seen = Kind::seen(m_);
    if (v.index() >= Kind::count_then(m_) || v.index() >= Kind::count(body_) || seen[v.index()] == m_.round) return;
    seen[v.index()] = m_.round;
    const std::int32_t place = touch(copy, body_.hex.nodes[copy]);
    if (place >= 0) Kind::remembered(m_).push_back({v.value, Kind::rest(body_, v), place});
  }

  const MovingSurface& now_;
  const Body& body_;
  SurfaceMemory& m_;
};

class Holder {
 public:
  Holder(const MovingSurface& now, double negligible, SurfaceMemory& memory, SurfaceFade& fade)
      : now_(now), body_(now.body), negligible_(negligible), m_(memory), fade_(fade) {}

  void hold() {
    for (std::size_t i = 0; i < m_.copies.size(); ++i) {
      SurfaceMemory::Copy& c = m_.copies[i];
      if (!c.copy.valid() || !body_.hex.alive(c.copy)) continue;
      c.same = shown_alike(c, c.copy);
      if (!c.same) note_vertices_of(c.copy, static_cast<std::int32_t>(i));
    }
    hold_kind<VisualKind>();
    hold_kind<CollisionKind>();
  }

 private:
  [[nodiscard]] Vec3 position(NodeId n) const { return now_.positions[n.index()] + now_.fade.nodes.offset_of(n); }
  [[nodiscard]] Vec3 velocity(NodeId n) const { return now_.velocities[n.index()] + now_.fade.nodes.velocity_of(n); }

  /// Would every vertex be shown alike in both copies?
  [[nodiscard]] bool shown_alike(const SurfaceMemory::Copy& was, HexId now) const {
    if (body_.hex.cell[now] != was.cell) return false;
    const double place = kCornerShare * negligible_, speed = place * kFadeRate;
    const auto alike = [](Vec3 a, Vec3 b, double slack) { return norm(b - a) <= slack + kRelative * norm(a); };
    for (std::size_t c = 0; c < 8; ++c) {
      const NodeId n = body_.hex.nodes[now][c];
      if (!alike(was.position[c], position(n), place) || !alike(was.velocity[c], velocity(n), speed)) return false;
    }
    return true;
  }

  /// The vertices of a copy that nobody has seen yet: they have been in it since the pose began. Their owners have material in its
  /// cell, or in one of what it has absorbed.
  void note_vertices_of(HexId copy, std::int32_t place) {
    m_.queue.assign(1, copy);
    m_.cells.clear();
    for (std::size_t i = 0; i < m_.queue.size(); ++i) {
      const HexId h = m_.queue[i];
      m_.cells.push_back(body_.hex.cell_id(body_.hex.cell[h]));
      for (HexId g = body_.hex.first_guest[h]; g.valid(); g = body_.hex.next_guest[g]) m_.queue.push_back(g);
    }
    std::sort(m_.cells.begin(), m_.cells.end());
    m_.cells.erase(std::unique(m_.cells.begin(), m_.cells.end()), m_.cells.end());
    for (const CellId cell : m_.cells)
      for (const CollisionTriangle t : body_.hex.members_of(cell)) {
        for_each_owned(body_.complex, t,
                       [&](VisualVertex v, Ownership, CollisionHalfEdge) { note<VisualKind>(v, copy, place); });
        for (int i = 0; i < 3; ++i)
          note<CollisionKind>(body_.complex.collision.origin[CollisionMesh::corner(t, i)], copy, place);
      }
  }
  template <class Kind>
  void note(typename Kind::Id v, HexId copy, std::int32_t place) {
    auto& seen = Kind::seen(m_);
    if (v.index() >= Kind::count_then(m_) || seen[v.index()] == m_.round || Kind::copies(body_)[v] != copy) return;
    seen[v.index()] = m_.round;
    Kind::remembered(m_).push_back({v.value, Kind::rest(body_, v), place});
  }

  /// What vertices jump by goes to their entries; those that are not what they were lose theirs (marked by an infinite jump).
  template <class Kind>
  void hold_kind() {
    auto& list = Kind::fading(fade_);
    const std::size_t count = Kind::count(body_);
    while (!list.empty() && static_cast<std::size_t>(list.back().vertex) >= count) list.pop_back();
    m_.changes.clear();
    std::int32_t last_place = -1;
    HexId last_copy;
    bool last_alike = false;
    for (const SurfaceMemory::Vertex& v : Kind::remembered(m_)) {
      const typename Kind::Id id(v.vertex);
      if (id.index() >= count) continue;
      if (!(Kind::rest(body_, id) == v.rest)) {
        if (!list.empty()) m_.changes.push_back({v.vertex, {HUGE_VAL, 0, 0}, {}});
        continue;
      }
      const SurfaceMemory::Copy& was = m_.copies[static_cast<std::size_t>(v.copy)];
      const HexId copy = Kind::copies(body_)[id];
      if (copy != last_copy || v.copy != last_place) {
        last_copy = copy;
        last_place = v.copy;
        last_alike = copy == was.copy ? was.same : shown_alike(was, copy);
      }
      if (last_alike) continue;
      const std::array<double, 8> then = trilinear_weights(local_in(body_.hex.frame_at(was.cell), was.cell, v.rest));
      const std::array<double, 8> now = trilinear_weights(body_.hex.local(copy, v.rest));
      Vec3 then_at{}, then_moving{}, at{}, moving{};
      for (std::size_t c = 0; c < 8; ++c) {
        const NodeId n = body_.hex.nodes[copy][c];
        then_at += then[c] * was.position[c];
        then_moving += then[c] * was.velocity[c];
        at += now[c] * position(n);
        moving += now[c] * velocity(n);
      }
      m_.changes.push_back({v.vertex, then_at - at, then_moving - moving});
    }
    if (!m_.changes.empty()) merge(list);
  }

  void merge(std::vector<FadingVertex>& list) {
    std::sort(m_.changes.begin(), m_.changes.end(), [](const auto& a, const auto& b) { return a.vertex < b.vertex; });
    m_.merged.clear();
    auto old = list.begin();
    for (FadingVertex f : m_.changes) {
      for (; old != list.end() && old->vertex < f.vertex; ++old) m_.merged.push_back(*old);
      if (old != list.end() && old->vertex == f.vertex) {
        f.offset += old->offset;
        f.velocity += old->velocity;
        ++old;
      }
      if (!std::isfinite(f.offset.x)) continue;
      if (norm(f.offset) > negligible_ || norm(f.velocity) > negligible_ * kFadeRate) m_.merged.push_back(f);
    }
    m_.merged.insert(m_.merged.end(), old, list.end());
    list.swap(m_.merged);
  }

  const MovingSurface& now_;
  const Body& body_;
  double negligible_;
  SurfaceMemory& m_;
  SurfaceFade& fade_;
};

}  // namespace

std::size_t SurfaceFade::bytes() const {
  return (visual.size() + collision.size()) * sizeof(FadingVertex) + 2 * nodes.offset.size() * sizeof(Vec3);
}

void fade_offsets(SurfaceFade& fade, double dt, double negligible) {
  if (fade.empty()) return;
  const FadeStep step(dt);
  for (std::vector<FadingVertex>* list : {&fade.visual, &fade.collision}) {
    for (FadingVertex& f : *list) step(f.offset, f.velocity);
    std::erase_if(*list, [&](const FadingVertex& f) { return faded(f.offset, f.velocity, negligible); });
  }
  bool any = false;
  for (std::size_t i = 0; i < fade.nodes.offset.size(); ++i) {
    Vec3 &offset = fade.nodes.offset[i], &velocity = fade.nodes.velocity[i];
    step(offset, velocity);
    if (faded(offset, velocity, negligible)) offset = velocity = {};
    else any = true;
  }
  if (!any) fade.nodes.truncate(0);
}

const FadingVertex* fading(std::span<const FadingVertex> list, std::size_t vertex) {
  const auto v = static_cast<std::int32_t>(vertex);
  const auto it =
      std::lower_bound(list.begin(), list.end(), v, [](const FadingVertex& f, std::int32_t k) { return f.vertex < k; });
  return it != list.end() && it->vertex == v ? &*it : nullptr;
}

void begin_surface(const Body& body, SurfaceMemory& memory) {
  memory.copies.clear();
  memory.visual.clear();
  memory.collision.clear();
  memory.nodes.clear();
  ++memory.round;
  memory.visual_count = body.complex.visual.vertex_count();
  memory.collision_count = body.complex.collision.vertex_count();
  if (memory.seen_visual.size() < memory.visual_count) memory.seen_visual.resize(2 * memory.visual_count);
  if (memory.seen_collision.size() < memory.collision_count) memory.seen_collision.resize(2 * memory.collision_count);
}

void remember_rollback(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory) {
  Rememberer(state, memory).rollback(mark);
}

void remember_change(const MovingSurface& state, const JournalMark& mark, SurfaceMemory& memory) {
  Rememberer(state, memory).change(mark);
}

void remember_moved(const MovingSurface& state, std::size_t first, std::size_t old_copies, SurfaceMemory& memory,
                    NodeFade& fade) {
  Rememberer(state, memory).moved(first, old_copies, fade);
}

void hold_surface(const MovingSurface& state, double negligible, SurfaceMemory& memory, SurfaceFade& fade) {
  Holder(state, negligible, memory, fade).hold();
}

}  // namespace kerf
