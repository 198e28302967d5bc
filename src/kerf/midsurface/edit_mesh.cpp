#include "kerf/midsurface/edit_mesh.h"

namespace kerf::mid {
namespace {

void glue(SurfaceMesh& m, std::int32_t a, std::int32_t b) {
  if (a >= 0) m.twin[a] = b;
  if (b >= 0) m.twin[b] = a;
}

/// Lets v's fan begin at `h` or, at a border, where it really begins.
void set_outgoing(SurfaceMesh& m, std::int32_t v, std::int32_t h) {
  const std::int32_t start = h;
  while (m.twin[h] >= 0) {
    h = SurfaceMesh::next(m.twin[h]);
    if (h == start) break;
  }
  m.outgoing[v] = h;
}

int degree(const SurfaceMesh& m, std::int32_t v) {
  int n = 0;
  m.for_each_outgoing(v, [&](std::int32_t) { ++n; });
  return n;
}

}  // namespace

bool can_collapse(const SurfaceMesh& m, std::int32_t h, LinkScratch& s) {
  const std::int32_t a = m.from(h), b = m.to(h), t = m.twin[h];
  const bool a_border = m.on_border(a), b_border = m.on_border(b);
  if (t >= 0 && a_border && b_border) return false;
  for (const std::int32_t e : {h, t}) {
    if (e < 0) continue;
    const std::int32_t apex = m.apex(e);
    if (m.twin[SurfaceMesh::next(e)] < 0 && m.twin[SurfaceMesh::prev(e)] < 0) return false;
    if (!m.on_border(apex) && degree(m, apex) <= 3) return false;
  }
  if (t < 0) {  // a border edge: its loop must keep four edges
    int length = 1;
    for (std::int32_t e = m.outgoing[b]; e != h && length < 5; e = m.outgoing[m.to(e)]) ++length;
    if (length < 5) return false;
  }
  if (s.mark.size() < m.position.size()) s.mark.resize(m.position.size(), 0);
  ++s.stamp;
  m.for_each_neighbour(a, [&](std::int32_t v) { s.mark[v] = s.stamp; });
  int common = 0;
  m.for_each_neighbour(b, [&](std::int32_t v) { common += s.mark[v] == s.stamp; });
  return common == (t < 0 ? 1 : 2);
}

void collapse(SurfaceMesh& m, std::int32_t h) {
  const std::int32_t a = m.from(h), b = m.to(h), t = m.twin[h];
  m.for_each_outgoing(a, [&](std::int32_t e) { m.origin[e] = b; });
  std::int32_t apex[2] = {-1, -1}, apex_out[2] = {-1, -1}, b_out = -1;
  for (int k = 0; k < 2; ++k) {
    const std::int32_t e = k == 0 ? h : t;
    if (e < 0) continue;
    // Of face b c a: the outer half-edges c -> b and b -> c become twins.
    const std::int32_t n = SurfaceMesh::next(e), p = SurfaceMesh::prev(e);
    apex[k] = m.origin[p];
    const std::int32_t tn = m.twin[n], tp = m.twin[p];
    glue(m, tn, tp);
    // k == 0: tp leaves b and tn leaves c; k == 1: the same, since both faces run the same way around.
    apex_out[k] = tn >= 0 ? tn : SurfaceMesh::next(tp);
    if (b_out < 0) b_out = tp >= 0 ? tp : SurfaceMesh::next(tn);
    for (const std::int32_t x : {e, n, p}) m.origin[x] = m.twin[x] = -1;
  }
  m.outgoing[a] = -1;
  set_outgoing(m, b, b_out);
  for (int k = 0; k < 2; ++k)
    if (apex[k] >= 0) set_outgoing(m, apex[k], apex_out[k]);
}

bool can_flip(const SurfaceMesh& m, std::int32_t h) {
  const std::int32_t t = m.twin[h];
  if (t < 0) return false;
  const std::int32_t c = m.apex(h), d = m.apex(t);
  if (c == d) return false;
  bool joined = false;
  m.for_each_neighbour(c, [&](std::int32_t v) { joined = joined || v == d; });
  return !joined;
}

void flip(SurfaceMesh& m, std::int32_t h) {
  const std::int32_t t = m.twin[h], n = SurfaceMesh::next(h), p = SurfaceMesh::prev(h), n2 = SurfaceMesh::next(t),
                     p2 = SurfaceMesh::prev(t);
  const std::int32_t a = m.from(h), b = m.to(h), c = m.from(p), d = m.from(p2);
  const std::int32_t tn = m.twin[n], tp = m.twin[p], tn2 = m.twin[n2], tp2 = m.twin[p2];
  m.origin[h] = d;  // face d c a
  m.origin[n] = c;
  m.origin[p] = a;
  m.origin[t] = c;  // face c d b
  m.origin[n2] = d;
  m.origin[p2] = b;
  const auto put = [&](std::int32_t e, std::int32_t twin) {
    m.twin[e] = twin;
    if (twin >= 0) m.twin[twin] = e;
  };
  put(n, tp);
  put(p, tn2);
  put(n2, tp2);
  put(p2, tn);
  set_outgoing(m, a, p);
  set_outgoing(m, b, p2);
  set_outgoing(m, c, n);
  set_outgoing(m, d, n2);
}

std::int32_t split(SurfaceMesh& m, std::int32_t h, Vec3 place) {
  const std::int32_t t = m.twin[h], a = m.from(h), b = m.to(h);
  const auto v = m.position.count();
  m.position.push_back(place);
  m.outgoing.push_back(-1);
  std::int32_t far[2] = {-1, -1}, near[2] = {h, t};  // half-edges between v and b, and between a and v
  std::int32_t corner[2] = {-1, -1}, corner_out[2] = {-1, -1};
  for (int k = 0; k < 2; ++k) {
    const std::int32_t e = k == 0 ? h : t;
    if (e < 0) continue;
    // Face x y z with e = x -> y becomes x v z and, new, v y z.
    const std::int32_t n = SurfaceMesh::next(e), p = SurfaceMesh::prev(e), y = m.from(n), z = m.from(p), tn = m.twin[n];
    const std::int32_t k0 = m.origin.count();
    for (const std::int32_t o : {v, y, z}) m.origin.push_back(o);
    for (int i = 0; i < 3; ++i) m.twin.push_back(-1);
    m.origin[n] = v;
    glue(m, n, k0 + 2);
    m.twin[k0 + 1] = tn;
    if (tn >= 0) m.twin[tn] = k0 + 1;
    far[k] = k0;
    corner[k] = z;
    corner_out[k] = p;
  }
  if (t < 0) {
    m.twin[near[0]] = m.twin[far[0]] = -1;
  } else {
    // h now runs a -> v, far[0] v -> b; t runs b -> v, far[1] v -> a.
    glue(m, near[0], far[1]);
    glue(m, far[0], near[1]);
  }
  set_outgoing(m, a, h);
  set_outgoing(m, b, SurfaceMesh::next(far[0]));
  set_outgoing(m, v, far[0]);
  for (int k = 0; k < 2; ++k)
    if (corner[k] >= 0) set_outgoing(m, corner[k], corner_out[k]);
  return v;
}

}  // namespace kerf::mid
