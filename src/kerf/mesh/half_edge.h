// Half-edges over triangles, in flat journaled arrays. Half-edge h = 3 face + corner runs from origin(h) to
// origin(next(h)) with its face on the left; twin(h) is the same edge seen from the other face, or none on a
// border. outgoing(v) is any one half-edge of v's only fan.
#pragma once

#include "kerf/base/ids.h"
#include "kerf/base/journal.h"
#include "kerf/base/vec.h"

namespace kerf {

template <class Mesh>
struct HalfEdgeMesh {
  using V = typename MeshIds<Mesh>::Vertex;
  using H = typename MeshIds<Mesh>::HalfEdge;
  using F = typename MeshIds<Mesh>::Face;

  Journaled<H, V> origin;
  Journaled<H, H> twin;       ///< none on a border
  Journaled<H, Vec2> planar;  ///< per corner: where origin(h) lies in the plane of the patch that its face belongs to
  Journaled<V, H> outgoing;

  static constexpr F face(H h) { return F(h.value / 3); }
  static constexpr H corner(F f, int i) { return H(3 * f.value + i); }
  static constexpr H next(H h) { return H(h.value % 3 == 2 ? h.value - 2 : h.value + 1); }
  static constexpr H prev(H h) { return H(h.value % 3 == 0 ? h.value + 2 : h.value - 1); }

  [[nodiscard]] V from(H h) const { return origin[h]; }
  [[nodiscard]] V to(H h) const { return origin[next(h)]; }
  /// The vertex opposite to edge h in its face.
  [[nodiscard]] V apex(H h) const { return origin[prev(h)]; }
  [[nodiscard]] bool is_border(H h) const { return !twin[h].valid(); }
  [[nodiscard]] std::size_t vertex_count() const { return outgoing.size(); }
  [[nodiscard]] std::size_t face_count() const { return origin.size() / 3; }
  [[nodiscard]] std::size_t half_edge_count() const { return origin.size(); }

  /// Next outgoing half-edge around origin(h), counter-clockwise; none behind a border.
  [[nodiscard]] H ccw(H h) const { return twin[prev(h)]; }
  /// Next outgoing half-edge around origin(h), clockwise; none behind a border.
  [[nodiscard]] H cw(H h) const {
    const H t = twin[h];
    return t.valid() ? next(t) : H{};
  }
  /// The outgoing half-edge of v's fan with nothing clockwise of it (its own edge is a border), or any when v is inner.
  [[nodiscard]] H fan_start(V v) const {
    const H h0 = outgoing[v];
    for (H h = h0;;) {
      const H c = cw(h);
      if (!c.valid()) return h;
      if (c == h0) return h0;
      h = c;
    }
  }
  [[nodiscard]] bool on_border(V v) const { return is_border(fan_start(v)); }
  /// The border half-edge that ends at a vertex of a border; the one that begins there is fan_start.
  [[nodiscard]] H border_into(V v) const {
    H h = fan_start(v);
    for (H c = ccw(h); c.valid(); c = ccw(h)) h = c;
    return prev(h);
  }
  /// Calls f(h) for every outgoing half-edge of v (one per face), counter-clockwise, until f returns false.
  template <class Fn>
  void for_each_outgoing(V v, Fn&& f) const {
    const H start = fan_start(v);
    H h = start;
    do {
      if (!f(h)) return;
      h = ccw(h);
    } while (h.valid() && h != start);
  }
  /// The half-edge a -> b, or none.
  [[nodiscard]] H find_half_edge(V a, V b) const {
    H found;
    for_each_outgoing(a, [&](H h) {
      if (to(h) == b) {
        found = h;
        return false;
      }
      return true;
    });
    return found;
  }

 protected:
  template <class Fn>
  void for_each_topology_array(Fn&& f) {
    f(origin);
    f(twin);
    f(planar);
    f(outgoing);
  }
};

}  // namespace kerf
