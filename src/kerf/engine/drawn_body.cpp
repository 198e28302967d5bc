#include "kerf/engine/drawn_body.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kerf/session/surface_fade.h"

namespace kerf {
namespace {

constexpr std::size_t kBlock = 512;  ///< records compared at once

protocol::Normal packed(Vec3f n) {
  const auto pack = [](float x) {
    return static_cast<std::int16_t>(std::lround(std::clamp(x, -1.0f, 1.0f) * 32767.0f));
  };
  return {pack(n.x), pack(n.y), pack(n.z), 0};
}

template <class T>
bool same(const T& a, const T& b) {
  // Bits, not values: what is sent must be what is held. No type here has padding.
  return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof(T)) == 0;
}
template <class T>
bool same_block(const std::vector<T>& a, const std::vector<T>& b, std::size_t first, std::size_t count) {
  return std::memcmp(a.data() + first, b.data() + first, count * sizeof(T)) == 0;
}

/// Ids below both lengths at which any of the arrays differ.
template <class... T>
void differing(std::size_t n, std::vector<std::uint32_t>& ids,
               const std::pair<const std::vector<T>*, const std::vector<T>*>&... arrays) {
  ids.clear();
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t count = std::min(kBlock, n - first);
    if ((same_block(*arrays.first, *arrays.second, first, count) && ...)) continue;
    for (std::size_t i = first; i < first + count; ++i)
      if (!(same((*arrays.first)[i], (*arrays.second)[i]) && ...)) ids.push_back(static_cast<std::uint32_t>(i));
  }
}

template <class T>
auto pair_of(const std::vector<T>& a, const std::vector<T>& b) {
  return std::pair<const std::vector<T>*, const std::vector<T>*>(&a, &b);
}

template <class T>
void gather(const std::vector<T>& from, const std::vector<std::uint32_t>& ids, std::size_t appended_from,
            std::vector<T>& out) {
  out.clear();
  for (const std::uint32_t i : ids) out.push_back(from[i]);
  out.insert(out.end(), from.begin() + static_cast<std::ptrdiff_t>(std::min(appended_from, from.size())), from.end());
}

std::uint32_t number(std::size_t n) { return static_cast<std::uint32_t>(n); }

}  // namespace

namespace {

struct DrawnVertex {
  Vec3f rest;
  protocol::Normal normal;
  std::uint32_t copy;
};
DrawnVertex drawn_vertex(const Body& body, RenderVertex r) {
  const VisualVertex v = body.surface.vertex[r];
  return {to_float(body.complex.visual.rest[v]), packed(body.surface.normal[r]),
          number(body.embedding.visual[v].index())};
}
protocol::Triangle drawn_triangle(const Body& body, VisualTriangle f) {
  protocol::Triangle t;
  for (int k = 0; k < 3; ++k)
    t[static_cast<std::size_t>(k)] = number(body.surface.corner[VisualMesh::corner(f, k)].index());
  return t;
}
protocol::Copy drawn_copy(const HexMesh& hex, HexId h) {
  protocol::Copy copy;
  copy.fill(protocol::kNoNode);
  if (hex.alive(h))
    for (std::size_t c = 0; c < 8; ++c) copy[c] = number(hex.nodes[h][c].index());
  return copy;
}
protocol::Cell drawn_cell(const HexMesh& hex, HexId h) {
  const LatticeIndex cell = hex.cell[h];
  const std::int32_t body = hex.body_at(cell);
  const LatticeIndex first = hex.frame_of_body(body).first;
  return {static_cast<std::int16_t>(cell[0] - first[0]), static_cast<std::int16_t>(cell[1] - first[1]),
          static_cast<std::int16_t>(cell[2] - first[2]), static_cast<std::int16_t>(body)};
}

/// The ids of a list of changes that exist, and all from `first_new` on; ascending, each once.
template <class Id>
void gather_ids(const std::vector<Id>& changed, std::size_t first_new, std::size_t size,
                std::vector<std::uint32_t>& out) {
  for (const Id id : changed)
    if (id.index() < std::min(first_new, size)) out.push_back(number(id.index()));
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  for (std::size_t i = first_new; i < size; ++i) out.push_back(number(i));
}

/// Puts a record where it belongs, at the end too; notes a change of one that was there `before`.
template <class T>
void put(std::vector<T>& records, std::size_t at, const T& value, std::size_t before,
         std::vector<std::uint32_t>& changed) {
  if (at == records.size()) {
    records.push_back(value);
  } else if (!same(records[at], value)) {
    records[at] = value;
    if (at < before) changed.push_back(number(at));
  }
}

}  // namespace

void DrawnBody::collect(const Body& body, Arrays& out) {
  const std::size_t nv = body.surface.size(), nc = body.hex.hex_count();
  out.rest.resize(nv);
  out.normal.resize(nv);
  out.copy.resize(nv);
  for (std::size_t i = 0; i < nv; ++i) {
    const DrawnVertex v = drawn_vertex(body, RenderVertex(i));
    out.rest[i] = v.rest;
    out.normal[i] = v.normal;
    out.copy[i] = v.copy;
  }
  const VisualMesh& mesh = body.complex.visual;
  for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count()))
    (mesh.patch[f].is_wall() ? out.wall : out.skin).push_back(drawn_triangle(body, f));
  out.copies.resize(nc);
  out.cells.resize(nc);
  for (const HexId h : ids<HexId>(nc)) {
    out.copies[h.index()] = drawn_copy(body.hex, h);
    out.cells[h.index()] = drawn_cell(body.hex, h);
  }
}

void DrawnBody::index(const Body& body) {
  set_frames(body.hex.bodies);
  place_ = body.surface.vertex.raw();
  next_.assign(place_.size(), {});
  first_.assign(body.complex.visual.vertex_count(), {});
  for (std::size_t i = 0; i < place_.size(); ++i) {
    next_[i] = first_[place_[i].index()];
    first_[place_[i].index()] = RenderVertex(i);
  }
  const std::size_t nf = body.complex.visual.face_count();
  skin_before_.resize(nf + 1);
  std::uint32_t skin = 0;
  for (std::size_t f = 0; f < nf; ++f) {
    skin_before_[f] = skin;
    skin += body.complex.visual.patch[VisualTriangle(f)].is_wall() ? 0 : 1;
  }
  skin_before_[nf] = skin;
}

void DrawnBody::reset(const Body& body) {
  now_ = {};
  collect(body, now_);
  index(body);
  changed_ = false;
}

void DrawnBody::update(const Body& body) {
  const Arrays before = std::move(now_);
  now_ = {};
  collect(body, now_);
  index(body);
  const Arrays &a = before, &b = now_;
  differing(std::min(a.rest.size(), b.rest.size()), vertex_ids_, pair_of(a.rest, b.rest), pair_of(a.normal, b.normal),
            pair_of(a.copy, b.copy));
  differing(std::min(a.skin.size(), b.skin.size()), skin_ids_, pair_of(a.skin, b.skin));
  differing(std::min(a.wall.size(), b.wall.size()), wall_ids_, pair_of(a.wall, b.wall));
  differing(std::min(a.copies.size(), b.copies.size()), copy_ids_, pair_of(a.copies, b.copies),
            pair_of(a.cells, b.cells));
  finish({a.rest.size(), a.skin.size(), a.wall.size(), a.copies.size()});
}

void DrawnBody::update(const Body& body, const SessionChanges& changes) {
  if (changes.everything) return update(body);
  const Sizes before = sizes();
  update_vertices(body, changes);
  update_triangles(body, changes);
  update_copies(body, changes);
  finish(before);
}

void DrawnBody::link(RenderVertex r, VisualVertex to) {
  place_[r.index()] = to;
  next_[r.index()] = first_[to.index()];
  first_[to.index()] = r;
}

void DrawnBody::unlink(RenderVertex r) {
  RenderVertex* at = &first_[place_[r.index()].index()];
  while (*at != r) at = &next_[at->index()];
  *at = next_[r.index()];
}

void DrawnBody::update_vertices(const Body& body, const SessionChanges& changes) {
  const std::size_t before = now_.rest.size(), size = body.surface.size();
  const std::size_t visual = body.complex.visual.vertex_count();
  vertex_ids_.clear();
  touched_.clear();
  // The lists first: what is gone or has changed its place leaves them, and joins them anew.
  first_.resize(std::max(first_.size(), visual));
  for (std::size_t i = before; i-- > size;) unlink(RenderVertex(i));
  place_.resize(size);
  next_.resize(size);
  for (const RenderVertex r : changes.render_vertices) {
    if (r.index() >= std::min(before, size) || place_[r.index()] == body.surface.vertex[r]) continue;
    unlink(r);
    link(r, body.surface.vertex[r]);
  }
  for (std::size_t i = before; i < size; ++i) link(RenderVertex(i), body.surface.vertex[RenderVertex(i)]);
  first_.resize(visual);

  for (const VisualVertex v : changes.moved) {
    if (v.index() >= visual) continue;
    for (RenderVertex r = first_[v.index()]; r.valid(); r = next_[r.index()])
      if (r.index() < before) touched_.push_back(number(r.index()));
  }
  gather_ids(changes.render_vertices, before, size, touched_);
  now_.rest.resize(size);
  now_.normal.resize(size);
  now_.copy.resize(size);
  for (const std::uint32_t i : touched_) {
    const DrawnVertex v = drawn_vertex(body, RenderVertex(static_cast<std::size_t>(i)));
    const bool other = !same(now_.rest[i], v.rest) || !same(now_.normal[i], v.normal) || now_.copy[i] != v.copy;
    if (i < before && other) vertex_ids_.push_back(i);
    now_.rest[i] = v.rest;
    now_.normal[i] = v.normal;
    now_.copy[i] = v.copy;
  }
}

void DrawnBody::update_triangles(const Body& body, const SessionChanges& changes) {
  const VisualMesh& mesh = body.complex.visual;
  const std::size_t before = skin_before_.size() - 1, size = mesh.face_count();
  const std::size_t skin = now_.skin.size(), wall = now_.wall.size();
  skin_ids_.clear();
  wall_ids_.clear();
  touched_.clear();
  gather_ids(changes.visual_triangles, before, size, touched_);
  const auto is_wall = [&](std::size_t f) { return mesh.patch[VisualTriangle(f)].is_wall(); };
  const auto was_wall = [&](std::size_t f) { return skin_before_[f] == skin_before_[f + 1]; };
  // Numbers hold as far as skin and wall follow each other as before.
  std::size_t renumbered = std::min(before, size);
  for (const std::uint32_t f : touched_) {
    if (f >= renumbered) break;
    if (is_wall(f) != was_wall(f)) renumbered = f;
  }
  const auto place = [&](std::size_t f) {
    const VisualTriangle t(f);
    if (is_wall(f)) put(now_.wall, f - skin_before_[f], drawn_triangle(body, t), wall, wall_ids_);
    else put(now_.skin, skin_before_[f], drawn_triangle(body, t), skin, skin_ids_);
  };
  for (const std::uint32_t f : touched_) {
    if (f >= renumbered) break;
    place(f);
  }
  skin_before_.resize(size + 1);
  for (std::size_t f = renumbered; f < size; ++f) {
    skin_before_[f + 1] = skin_before_[f] + (is_wall(f) ? 0 : 1);
    place(f);
  }
  now_.skin.resize(skin_before_[size]);
  now_.wall.resize(size - skin_before_[size]);
}

void DrawnBody::update_copies(const Body& body, const SessionChanges& changes) {
  const std::size_t before = now_.copies.size(), size = body.hex.hex_count();
  copy_ids_.clear();
  touched_.clear();
  gather_ids(changes.hexahedra, before, size, touched_);
  now_.copies.resize(size);
  now_.cells.resize(size);
  for (const std::uint32_t i : touched_) {
    const HexId h(static_cast<std::size_t>(i));
    const protocol::Copy copy = drawn_copy(body.hex, h);
    const protocol::Cell cell = drawn_cell(body.hex, h);
    if (i < before && !(same(now_.copies[i], copy) && same(now_.cells[i], cell))) copy_ids_.push_back(i);
    now_.copies[i] = copy;
    now_.cells[i] = cell;
  }
}

void DrawnBody::finish(const Sizes& a) {
  const Arrays& b = now_;
  gather(b.rest, vertex_ids_, a.vertices, values_.rest);
  gather(b.normal, vertex_ids_, a.vertices, values_.normal);
  gather(b.copy, vertex_ids_, a.vertices, values_.copy);
  gather(b.skin, skin_ids_, a.skin, values_.skin);
  gather(b.wall, wall_ids_, a.wall, values_.wall);
  gather(b.copies, copy_ids_, a.copies, values_.copies);
  gather(b.cells, copy_ids_, a.copies, values_.cells);
  const Sizes now = sizes();
  changed_ = !vertex_ids_.empty() || !skin_ids_.empty() || !wall_ids_.empty() || !copy_ids_.empty() ||
             a.vertices != now.vertices || a.skin != now.skin || a.wall != now.wall || a.copies != now.copies;
}

void DrawnBody::fading(std::span<const FadingVertex> fades, std::vector<std::uint32_t>& vertices,
                       std::vector<Vec3f>& offsets) const {
  vertices.clear();
  offsets.clear();
  for (const FadingVertex& f : fades)
    if (!add_drawn(static_cast<std::size_t>(f.vertex), vertices)) break;
  std::sort(vertices.begin(), vertices.end());
  for (const std::uint32_t r : vertices) offsets.push_back(to_float(kerf::fading(fades, place_[r].index())->offset));
}

void DrawnBody::drawn(std::span<const VisualVertex> visual, std::vector<std::uint32_t>& vertices) const {
  vertices.clear();
  for (const VisualVertex v : visual)
    if (!add_drawn(v.index(), vertices)) break;
  std::sort(vertices.begin(), vertices.end());
}

/// False: of a cut that is not drawn yet, as a page came in the middle of a tick.
bool DrawnBody::add_drawn(std::size_t visual, std::vector<std::uint32_t>& vertices) const {
  if (visual >= first_.size()) return false;
  for (RenderVertex r = first_[visual]; r.valid(); r = next_[r.index()]) vertices.push_back(number(r.index()));
  return true;
}

void DrawnBody::set_frames(std::span<const LatticeBody> bodies) {
  frames_.clear();
  for (const LatticeBody& body : bodies) {
    protocol::CellFrame& f = frames_.emplace_back();
    f.origin = to_float(body.frame.origin);
    for (std::size_t i = 0; i < 3; ++i) f.axes[i] = to_float(body.frame.axes.c[i]);
    f.cell = to_float(body.frame.cell);
  }
}

protocol::Body DrawnBody::body_message() const {
  protocol::Body m;
  m.frames = frames_;
  m.rest = now_.rest;
  m.normal = now_.normal;
  m.copy = now_.copy;
  m.skin = now_.skin;
  m.wall = now_.wall;
  m.copies = now_.copies;
  m.cells = now_.cells;
  return m;
}

protocol::Patch DrawnBody::patch_message() const {
  protocol::Patch m;
  m.totals.nv = number(now_.rest.size());
  m.totals.ns = number(now_.skin.size());
  m.totals.nw = number(now_.wall.size());
  m.totals.nc = number(now_.copies.size());
  m.vertex_ids = vertex_ids_;
  m.rest = values_.rest;
  m.normal = values_.normal;
  m.copy = values_.copy;
  m.skin_ids = skin_ids_;
  m.skin = values_.skin;
  m.wall_ids = wall_ids_;
  m.wall = values_.wall;
  m.copy_ids = copy_ids_;
  m.copies = values_.copies;
  m.cells = values_.cells;
  return m;
}

namespace {

/// From the plane of a root triangle to the collision mesh at rest: affine, for the plane is isometric to the root.
struct RootFrame {
  Vec2 from;
  Vec3 to, x, y;
  bool known = false;
  [[nodiscard]] Vec3 operator()(Vec2 p) const { return to + (p.x - from.x) * x + (p.y - from.y) * y; }
};

std::vector<RootFrame> root_frames(const CollisionMesh& mesh) {
  std::vector<RootFrame> out;
  std::vector<double> largest;  // of the root's triangles: slivers have no good frame
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const std::size_t root = mesh.root[f].index();
    if (out.size() <= root) out.resize(root + 1), largest.resize(root + 1, 0);
    Vec2 p[3];
    Vec3 q[3];
    for (int k = 0; k < 3; ++k) {
      const CollisionHalfEdge h = CollisionMesh::corner(f, k);
      p[k] = mesh.planar[h];
      q[k] = mesh.rest[mesh.origin[h]];
    }
    const Vec2 a = p[1] - p[0], b = p[2] - p[0];
    const double area = a.x * b.y - a.y * b.x;
    if (!(std::abs(area) > largest[root])) continue;
    largest[root] = std::abs(area);
    const Vec3 u = q[1] - q[0], v = q[2] - q[0];
    out[root] = {p[0], q[0], (1 / area) * (b.y * u - a.y * v), (1 / area) * (a.x * v - b.x * u), true};
  }
  return out;
}

void add_feet(const Body& body, OverlayArrays& out) {
  const CollisionMesh& mesh = body.complex.collision;
  const VisualMesh& visual = body.complex.visual;
  enum : std::uint32_t { kVertex, kEdge, kTriangle, kNotSeen };
  std::vector<std::uint32_t> kind(visual.vertex_count(), kNotSeen);
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count()))
    for (const VisualVertex bound : mesh.bound[v])
      if (bound.valid()) kind[bound.index()] = kVertex;
  const std::vector<RootFrame> frames = root_frames(mesh);
  std::vector<bool> done(visual.vertex_count());
  for (const VisualTriangle f : ids<VisualTriangle>(visual.face_count())) {
    const Patch patch = visual.patch[f];
    if (patch.is_wall() || patch.root().index() >= frames.size() || !frames[patch.root().index()].known) continue;
    const RootFrame& frame = frames[patch.root().index()];
    for (int k = 0; k < 3; ++k) {
      const VisualHalfEdge h = VisualMesh::corner(f, k);
      const VisualVertex v = visual.origin[h];
      const RenderVertex r = body.surface.skin[v];
      if (done[v.index()] || !r.valid()) continue;
      done[v.index()] = true;
      Vec2 p = visual.planar[h];
      if (patch.side() == Side::kMinus) p.y = -p.y;
      const std::uint32_t to = kind[v.index()] == kVertex ? kVertex : visual.free[v] != 0 ? kTriangle : kEdge;
      out.feet.push_back({number(r.index()), to});
      out.foot_rest.push_back(to_float(frame(p)));
    }
  }
}

}  // namespace

OverlayArrays overlay_arrays(const Body& body, bool with_feet) {
  const CollisionMesh& mesh = body.complex.collision;
  OverlayArrays out;
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) {
    out.rest.push_back(to_float(mesh.rest[v]));
    out.copy.push_back(number(body.embedding.collision[v].index()));
    for (const Side side : kSides) {
      const VisualVertex bound = mesh.bound[v][static_cast<std::size_t>(index(side))];
      if (!bound.valid() || (side == Side::kMinus && mesh.on_rim(v))) continue;
      const RenderVertex r = body.surface.skin[bound];
      if (r.valid()) out.links.push_back({number(v.index()), number(r.index())});
    }
  }
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    protocol::Triangle t;
    for (int k = 0; k < 3; ++k)
      t[static_cast<std::size_t>(k)] = number(mesh.origin[CollisionMesh::corner(f, k)].index());
    out.triangles.push_back(t);
  }
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count())) {
    const CollisionHalfEdge twin = mesh.twin[h];
    if (twin.valid() && twin < h) continue;  // the same edge seen from the other face
    for (const Side side : kSides) {
      const auto s = static_cast<std::size_t>(index(side));
      const PoolRun chain = mesh.chain[h][s];
      if (!chain.exists()) continue;
      RenderVertex last;
      const auto step = [&](VisualVertex v) {
        const RenderVertex r = v.valid() ? body.surface.skin[v] : RenderVertex{};
        if (last.valid() && r.valid()) out.bound.push_back({number(last.index()), number(r.index())});
        last = r;
      };
      step(mesh.bound[mesh.from(h)][s]);
      for (std::int32_t i = 0; i < chain.count; ++i) step(body.complex.chain_pool[chain.at(i)]);
      step(mesh.bound[mesh.to(h)][s]);
    }
  }
  if (with_feet) add_feet(body, out);
  return out;
}

}  // namespace kerf
