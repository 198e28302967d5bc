#include "kerf/lattice/lattice_adapt.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "kerf/base/at.h"
#include "kerf/base/dense_index.h"
#include "kerf/base/hash.h"
#include "kerf/lattice/lattice_tip.h"
#include "kerf/lattice/lattice_tolerances.h"
#include "kerf/lattice/tip_glue.h"

namespace kerf {

struct LatticeScratch::Work {
  using T = CollisionTriangle;
  struct NewPiece {
    CollisionTriangle triangle;
    CellId cell;
    double volume;
  };
  struct OldPiece {
    CellId cell;
    CollisionTriangle triangle;
    HexId copy;
    TipId tip;
    std::int32_t side;
    Vec3 point, normal;
    RootId root;
    std::array<Vec2, 3> planar;
  };
  struct Element {
    CollisionTriangle triangle;
    TipId tip;
    std::int32_t side = 0;
    double volume = 0;
    HexId old_copy, copy;
    std::int32_t moments = -1;               ///< in `moments`
    PieceIndex piece;                        ///< where it was, if its triangle kept its shape
    std::array<std::int8_t, 3> edge_side{};  ///< of a split prism: which side an edge is on, 0 crossed
    std::int32_t root = 0;                   ///< union-find
  };
  struct CellElements {
    CellId cell;
    std::int32_t first = 0, count = 0;
    bool touched = false;
  };
  struct Result {
    CollisionTriangle triangle;
    CellId cell;
    std::int32_t element;
  };

  std::vector<CollisionTriangle> reshaped;
  std::vector<CollisionVertex> vertices;
  std::vector<CellId> touched;
  std::vector<NewPiece> new_pieces;
  std::vector<OldPiece> old_pieces;
  std::vector<Element> elements;
  std::vector<Moments> moments;
  std::vector<CellElements> cells;
  std::vector<Result> results;
  std::vector<CellVolume> volumes;
  std::vector<double> box;
  std::vector<std::uint64_t> triangle_stamp, cell_stamp, cell_cached, hex_stamp,
      node_stamp;  ///< per element: serial of the last visit
  std::vector<std::int32_t> triangle_slot, cell_slot;
  std::uint64_t serial = 0;
  std::vector<std::array<std::int32_t, 2>> queue;
  std::vector<HexLink> links;
  std::vector<LatticeFaceId> faces;
  std::vector<std::int32_t> corners;
  std::vector<std::pair<std::int32_t, NodeId>> corner_nodes;
  std::vector<HexId> small, dirty, hosts, stack, neighbours;
  std::vector<Piece> run;
  std::vector<Moments> run_moments;
  std::vector<std::int32_t> parent, wanted;
  struct Group {
    std::int32_t first = 0, count = 0;
    std::int32_t begin = 0;    ///< in `grouped`
    std::int32_t parts = 0;    ///< parts of split prisms
    std::int32_t newborn = 0;  ///< corners made by the cut, which are on its right
    double volume = 0;
    HexId parent, copy;
    bool same = true;  ///< nothing in it is new
  };
  struct CornerCopy {
    HexId copy;
    int corner = 0, offset = 0;  ///< its corner number; which of the 8 cells around
    std::int32_t root = 0;
    NodeId old;
    bool kept = false;
    std::int32_t of_class = -1;
    std::int32_t next = -1;  ///< the next in `around` of its class
    NodeId node;             ///< that its class gets
  };
  struct OnFace {
    std::int32_t a, b;
    CollisionHalfEdge edge;
  };
  struct Class {
    bool kept;
    HexId oldest;
    std::int32_t first, last;  ///< in `around`
    NodeId node;
  };
  std::vector<Group> groups;
  std::vector<std::int32_t> group_of;  ///< per element of a cell
  std::vector<std::int32_t> grouped;   ///< elements of a cell, group by group, ascending
  std::vector<std::pair<HexId, double>> heirs;
  std::vector<T> members, rewritten;
  std::vector<OnFace> on_face;
  std::vector<CornerCopy> around;
  std::vector<Class> classes;
  std::vector<std::pair<NodeId, std::int32_t>> uses;
  DenseIndex copies, nodes;  ///< of those around a corner or a copy
  struct Source {
    HexId copy, from;
    double volume;
  };
  std::vector<Source> sources;  ///< whose material the copies of touched cells hold
  std::vector<std::pair<NodeId, double>> shares;
  std::vector<TipCrossing> crossings;
  std::vector<CollisionHalfEdge> virtual_edges;
  std::vector<TipId> tips_here;
  std::vector<SplitTriangle> split_triangles;
  std::vector<std::int32_t> split_slot;  ///< per triangle: in `split_triangles`, if it is there
  std::vector<Element> split_elements;
  std::vector<std::int32_t> glued;        ///< per element of a cell: union-find over joints and glue
  std::vector<std::uint8_t> glued_holds;  ///< per root of those: is there material?
};

namespace {

using Work = LatticeScratch::Work;
using Element = Work::Element;
using Group = Work::Group;
using CornerCopy = Work::CornerCopy;
using Class = Work::Class;
using OnFace = Work::OnFace;
using T = CollisionTriangle;

template <class V>
void sort_unique(V& v) {
  std::sort(v.begin(), v.end());
  v.erase(std::unique(v.begin(), v.end()), v.end());
}

/// Replaces the items of a run: in place where they fit, else at the end of the pool with room to grow.
template <class Pool, class Index, class Item>
void write_run(Pool& pool, LatticeRun& run, std::span<const Item> items, Index) {
  const auto n = static_cast<std::int32_t>(items.size());
  if (n > run.capacity) {
    run.first = static_cast<std::int32_t>(pool.size());
    run.capacity = n + (run.count > 0 ? n / 2 + 2 : 0);
    pool.grow(at(run.capacity));
  }
  run.count = n;
  for (std::int32_t i = 0; i < n; ++i) pool.set(Index(run.first + i), items[at(i)]);
}

class Adapter {
 public:
  Adapter(const CollisionMesh& mesh, HexMesh& hex, Work& scratch, LatticeChange& change)
      : mesh_(mesh), hex_(hex), s_(scratch), change_(change) {}

  void run(std::span<const T> changed) {
    change_.clear();
    clear_scratch();
    grow_arrays();
    find_reshaped(changed);
    list_touched_cells();
    const std::size_t n = s_.cells.size();
    for (std::size_t i = 0; i < n; ++i) analyse_cell(i);
    write_pieces();
    update_links();
    update_nodes();
    absorb();
    change_.triangles.insert(change_.triangles.end(), changed.begin(), changed.end());
    finish();
  }

 private:
  // ---------------------------------------------------------------- set-up

  void clear_scratch() {
    s_.reshaped.clear();
    s_.touched.clear();
    s_.new_pieces.clear();
    s_.old_pieces.clear();
    s_.elements.clear();
    s_.moments.clear();
    s_.cells.clear();
    s_.results.clear();
    s_.dirty.clear();
    s_.faces.clear();
    s_.corners.clear();
    s_.corner_nodes.clear();
    s_.rewritten.clear();
    s_.sources.clear();
    auto grow = [](auto& v, std::size_t n) {
      if (v.size() < n) v.resize(n);
    };
    grow(s_.triangle_stamp, mesh_.face_count());
    grow(s_.triangle_slot, mesh_.face_count());
    grow(s_.split_slot, mesh_.face_count());
    const std::size_t cells = hex_.cell_count();
    grow(s_.cell_stamp, cells);
    grow(s_.cell_cached, cells);
    grow(s_.cell_slot, cells);
  }

  void grow_arrays() {
    old_vertex_count_ = hex_.prism_corner.size();
    for (std::size_t v = old_vertex_count_; v < mesh_.vertex_count(); ++v) {
      hex_.prism_corner.push_back(corners_of(mesh_, hex_, CollisionVertex(v)));
      hex_.vertex_tip.push_back({});
    }
    old_triangle_count_ = hex_.pieces.size();
    for (std::size_t f = old_triangle_count_; f < mesh_.face_count(); ++f) {
      hex_.pieces.push_back({});
      hex_.shape.push_back({});
    }
  }

  [[nodiscard]] CollisionVertex vertex(T t, int i) const { return mesh_.origin[CollisionMesh::corner(t, i)]; }
  [[nodiscard]] Prism prism(T t) const {
    return prism_between(hex_.prism_corner[vertex(t, 0)], hex_.prism_corner[vertex(t, 1)],
                         hex_.prism_corner[vertex(t, 2)]);
  }
  [[nodiscard]] PrismWall wall(CollisionHalfEdge h) const {
    return wall_between(hex_.prism_corner[mesh_.from(h)], hex_.prism_corner[mesh_.to(h)]);
  }

  void touch(CellId c) {
    if (s_.cell_stamp[c.index()] == touched_) return;
    s_.cell_stamp[c.index()] = touched_;
    s_.touched.push_back(c);
  }
  void reshape(T t) {
    if (s_.triangle_stamp[t.index()] == reshaped_) return;
    s_.triangle_stamp[t.index()] = reshaped_;
    s_.reshaped.push_back(t);
  }

  // ---------------------------------------------------------------- which prisms and cells have to be looked at

  [[nodiscard]] std::uint64_t shape_hash(T t) const {
    Hash hash;
    for (int i = 0; i < 3; ++i) {
      const PrismCorners& c = hex_.prism_corner[vertex(t, i)];
      hash.add(c.minus);
      hash.add(c.plus);
      hash.add(c.root);
    }
    return hash.value();
  }

  void find_reshaped(std::span<const T> changed) {
    touched_ = ++s_.serial;
    reshaped_ = ++s_.serial;
    s_.vertices.clear();
    for (const T t : changed) {
      if (t.index() >= old_triangle_count_ || shape_hash(t) != hex_.shape[t].hash) reshape(t);
      for (const Piece& p : hex_.pieces_of(t)) touch(p.cell);
      for (int i = 0; i < 3; ++i) s_.vertices.push_back(vertex(t, i));
    }
    sort_unique(s_.vertices);
    for (const CollisionVertex v : s_.vertices)
      if (update_tip(mesh_, hex_, v, [this](CellId c) { touch(c); })) change_.tips_changed = true;

    for (const T t : s_.reshaped) measure(t);
    for (const CellId c : s_.touched)
      for (const T t : hex_.members_of(c))
        if (s_.triangle_stamp[t.index()] != reshaped_) make_whole(t, c);
  }

  /// A prism that a tip had split in a cell is one there again. Its other cells are not touched.
  void make_whole(T t, CellId c) {
    bool split = false;
    for (const Piece& p : hex_.pieces_of(t)) {
      if (p.cell != c || p.side == 0) continue;
      split = true;
      s_.old_pieces.push_back(old_piece(t, p, hex_.shape[t]));
    }
    if (!split) return;
    find_volumes(t);
    for (const CellVolume& v : s_.volumes)
      if (hex_.cell_id(v.cell) == c) s_.new_pieces.push_back({t, c, v.volume});
    s_.rewritten.push_back(t);
  }

  [[nodiscard]] Work::OldPiece old_piece(T t, const Piece& p, const PrismShape& shape) const {
    Work::OldPiece old{p.cell, t, p.copy, p.tip, p.side, {}, {}, mesh_.root[t], shape.planar};
    if (p.side != 0) {
      // The tip's plane as it was when the prism was split: kept in the piece's tip until the cell is analysed.
      old.point = hex_.tips[p.tip].point;
      old.normal = hex_.tips[p.tip].normal;
    }
    return old;
  }

  /// The cells that a triangle's prism lies in, with its volumes there.
  void find_volumes(T t) {
    const Prism prism_of_t = prism(t);
    s_.volumes.clear();
    const LatticeFrame& frame = hex_.frame_of(mesh_.root[t]);
    prism_in_cells(prism_of_t, frame, s_.box, s_.volumes);
    if (!s_.volumes.empty()) return;
    // A knife edge or a sliver: a member all the same, of the cell at its middle.
    Vec3 middle{};
    for (std::size_t i = 0; i < 3; ++i) middle += (1.0 / 6) * (prism_of_t.minus[i] + prism_of_t.plus[i]);
    LatticeIndex c;
    for (int a = 0; a < 3; ++a)
      c[at(a)] = std::clamp(static_cast<int>(std::floor(middle[a])), frame.first[at(a)],
                            frame.first[at(a)] + frame.count[at(a)] - 1);
    s_.volumes.push_back({c, 0});
  }

  /// Takes a triangle's pieces away and measures it anew.
  void measure(T t) {
    PrismShape shape = hex_.shape[t];
    for (const Piece& p : hex_.pieces_of(t)) {
      touch(p.cell);
      s_.old_pieces.push_back(old_piece(t, p, shape));
    }
    find_volumes(t);
    double sum = 0;
    for (const CellVolume& v : s_.volumes) {
      const CellId c = hex_.cell_id(v.cell);
      touch(c);
      s_.new_pieces.push_back({t, c, v.volume});
      sum += v.volume;
    }
    shape.hash = shape_hash(t);
    for (int i = 0; i < 3; ++i) shape.planar[at(i)] = mesh_.planar[CollisionMesh::corner(t, i)];
    shape.scale = sum > 0 ? ruled_volume(prism(t)) / sum : 1;
    hex_.shape.set(t, shape);
  }

  void list_touched_cells() {
    std::sort(s_.touched.begin(), s_.touched.end());
    std::sort(s_.new_pieces.begin(), s_.new_pieces.end(), [](const auto& a, const auto& b) {
      return a.cell < b.cell || (a.cell == b.cell && a.triangle < b.triangle);
    });
    std::sort(s_.old_pieces.begin(), s_.old_pieces.end(), [](const auto& a, const auto& b) {
      if (a.cell != b.cell) return a.cell < b.cell;
      return a.triangle < b.triangle || (a.triangle == b.triangle && a.side > b.side);
    });
    std::size_t next = 0;
    for (const CellId c : s_.touched) {
      Work::CellElements entry{c, static_cast<std::int32_t>(s_.elements.size()), 0, true};
      for (const T t : hex_.members_of(c)) {  // two ascending lists
        for (; next < s_.new_pieces.size() && s_.new_pieces[next].cell == c && s_.new_pieces[next].triangle < t; ++next)
          add_new(s_.new_pieces[next]);
        if (next < s_.new_pieces.size() && s_.new_pieces[next].cell == c && s_.new_pieces[next].triangle == t)
          add_new(s_.new_pieces[next++]);
        else if (s_.triangle_stamp[t.index()] != reshaped_) add_old(t, c);
      }
      for (; next < s_.new_pieces.size() && s_.new_pieces[next].cell == c; ++next) add_new(s_.new_pieces[next]);
      entry.count = static_cast<std::int32_t>(s_.elements.size()) - entry.first;
      s_.cells.push_back(entry);
    }
  }

  void add_old(T t, CellId c) {
    const LatticeRun run = hex_.pieces[t];
    for (std::int32_t i = 0; i < run.count; ++i) {
      const Piece& p = hex_.piece_pool[PieceIndex(run.first + i)];
      if (p.cell != c) continue;
      Element e;
      e.triangle = t;
      e.tip = p.tip;
      e.side = p.side;
      e.volume = p.volume;
      e.old_copy = e.copy = p.copy;
      e.piece = PieceIndex(run.first + i);
      s_.elements.push_back(e);
    }
  }

  void add_new(const Work::NewPiece& p) {
    Element e;
    e.triangle = p.triangle;
    e.volume = p.volume;
    e.old_copy = copy_before(p);
    s_.elements.push_back(e);
  }

  /// The copy that this piece's material was in before: of the old piece in the same cell and root triangle that
  /// holds the middle of the new one.
  HexId copy_before(const Work::NewPiece& p) const {
    const auto less = [](const Work::OldPiece& o, CellId c) { return o.cell < c; };
    auto it = std::lower_bound(s_.old_pieces.begin(), s_.old_pieces.end(), p.cell, less);
    HexId best;
    double depth = -HUGE_VAL;
    const RootId root = mesh_.root[p.triangle];
    Vec2 middle{};
    for (int i = 0; i < 3; ++i) middle = middle + (1.0 / 3) * mesh_.planar[CollisionMesh::corner(p.triangle, i)];
    for (; it != s_.old_pieces.end() && it->cell == p.cell; ++it) {
      if (it->root != root) continue;
      double least = HUGE_VAL;
      const auto& q = it->planar;
      for (std::size_t i = 0; i < 3; ++i) least = std::fmin(least, cross(q[(i + 1) % 3] - q[i], middle - q[i]));
      if (it->side != 0) {
        const Prism shape = prism(p.triangle);
        Vec3 center{};
        for (std::size_t i = 0; i < 3; ++i) center += (1.0 / 6) * (shape.minus[i] + shape.plus[i]);
        if (it->side * dot(it->normal, center - it->point) < 0) least = std::fmin(least, 0) - 1;
      }
      if (least > depth) depth = least, best = it->copy;
    }
    return best;
  }

  // ---------------------------------------------------------------- branches of one cell

  std::int32_t find(std::int32_t e) {
    while (s_.elements[at(e)].root != e) {
      const std::int32_t up = s_.elements[at(e)].root;
      s_.elements[at(e)].root = s_.elements[at(up)].root;
      e = up;
    }
    return e;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = find(a), b = find(b);
    if (a != b) s_.elements[at(std::max(a, b))].root = std::min(a, b);
  }

  /// First element of a triangle in the cell under analysis, or -1.
  [[nodiscard]] std::int32_t element_of(T t) const {
    return s_.triangle_stamp[t.index()] == analysed_ ? s_.triangle_slot[t.index()] : -1;
  }

  void index_elements(std::int32_t first, std::int32_t count) {
    analysed_ = ++s_.serial;
    for (std::int32_t e = first + count; e-- > first;) {
      const T t = s_.elements[at(e)].triangle;
      s_.triangle_stamp[t.index()] = analysed_;
      s_.triangle_slot[t.index()] = e;
    }
  }

  void analyse_cell(std::size_t which) {
    Work::CellElements& entry = s_.cells[which];
    const CellId c = entry.cell;
    const LatticeIndex index = hex_.index_of(c);
    s_.crossings.clear();
    s_.virtual_edges.clear();
    s_.split_triangles.clear();
    s_.tips_here.clear();
    if (hex_.first_tip[c].valid()) split_at_tips(entry, index);
    index_elements(entry.first, entry.count);
    const std::int32_t end = entry.first + entry.count;
    for (std::int32_t e = entry.first; e < end; ++e) s_.elements[at(e)].root = e;

    for (std::int32_t e = entry.first; e < end; ++e) {
      const T t = s_.elements[at(e)].triangle;
      for (int i = 0; i < 3; ++i) {
        const CollisionHalfEdge h = CollisionMesh::corner(t, i), g = mesh_.twin[h];
        if (!g.valid()) continue;
        const T u = CollisionMesh::face(g);
        if (u < t) continue;  // seen from the other side
        const std::int32_t f = element_of(u);
        if (f < 0) continue;
        join_over_edge(e, h, f, g, index);
      }
    }
    if (!s_.split_triangles.empty() || !s_.virtual_edges.empty()) rejoin_islands(entry);
    assign_copies(which);
  }

  std::int32_t find_glued(std::int32_t e) {
    while (s_.glued[at(e)] != e) e = s_.glued[at(e)] = s_.glued[at(s_.glued[at(e)])];
    return e;
  }

  /// The element beside a tip, of one side; -1 if there is none in the cell.
  [[nodiscard]] std::int32_t element_beside(const TipCell& tip, T t, int side) const {
    const std::int32_t e = t.valid() ? element_of(t) : -1;
    if (e < 0 || s_.elements[at(e)].side == 0) return e;
    const TipCell& splitter = hex_.tips[s_.elements[at(e)].tip];
    if (splitter.vertex != tip.vertex) side = dot(splitter.normal, tip.point - splitter.point) >= 0 ? 1 : -1;
    return s_.elements[at(e)].side == side ? e : e + 1;
  }

  /// Continuations of tips must not cut anything off: other slits and the cell's faces may leave parts of split prisms
  /// that neither hang on to material of their side nor are glued at the tip. They stay with their other part.
  void rejoin_islands(const Work::CellElements& entry) {
    s_.glued.resize(at(entry.count));
    s_.glued_holds.assign(at(entry.count), 0);
    for (std::int32_t i = 0; i < entry.count; ++i) {
      const Element& x = s_.elements[at(entry.first + i)];
      s_.glued[at(i)] = find(entry.first + i) - entry.first;
      if (x.side == 0 || x.volume > kOverlapVolume) s_.glued_holds[at(s_.glued[at(i)])] = 1;
    }
    const auto glue = [&](std::int32_t a, std::int32_t b) {
      if (a < 0 || b < 0) return false;
      a = find_glued(a - entry.first), b = find_glued(b - entry.first);
      if (a == b) return false;
      s_.glued[at(std::max(a, b))] = std::min(a, b);
      s_.glued_holds[at(std::min(a, b))] |= s_.glued_holds[at(std::max(a, b))];
      return true;
    };
    for (const TipId id : s_.tips_here) {
      const TipCell& tip = hex_.tips[id];
      glue(element_beside(tip, tip.left, 1), element_beside(tip, tip.right, -1));
    }
    // Nothing is cut off where there is nothing: a prism that only touches this cell, on the far side of a slit in the face.
    const auto holds_material = [&](std::int32_t e) { return s_.glued_holds[at(find_glued(e - entry.first))] != 0; };
    for (std::int32_t e = entry.first; e + 1 < entry.first + entry.count; ++e) {
      const Element &a = s_.elements[at(e)], &b = s_.elements[at(e + 1)];
      if (a.side == 0 || a.triangle != b.triangle || !holds_material(e) || !holds_material(e + 1)) continue;
      if (glue(e, e + 1)) join(e, e + 1);
    }
    const LatticeIndex cell = hex_.index_of(entry.cell);
    for (std::size_t i = 0; i + 1 < s_.virtual_edges.size(); i += 2) {
      const CollisionHalfEdge h = s_.virtual_edges[i], g = s_.virtual_edges[i + 1];
      const std::int32_t e = element_of(CollisionMesh::face(h)),
                         f = g.valid() ? element_of(CollisionMesh::face(g)) : -1;
      if (e >= 0 && f >= 0 && wall_meets_cell(wall(h), cell) && glue(e, f)) join(e, f);
    }
  }

  /// Joins element e, over its edge h, with the element(s) of the triangle across (first element f, edge g).
  void join_over_edge(std::int32_t e, CollisionHalfEdge h, std::int32_t f, CollisionHalfEdge g, LatticeIndex cell) {
    const Element& a = s_.elements[at(e)];
    const Element& b = s_.elements[at(f)];
    const int own_side = a.side == 0 ? 0 : a.edge_side[at(h.value % 3)];
    const int other_side = b.side == 0 ? 0 : b.edge_side[at(g.value % 3)];
    if (a.side == 0 && b.side == 0) {
      if (find(e) == find(f) || is_virtual(h) || is_virtual(g)) return;
      if (wall_meets_cell(wall(h), cell)) join(e, f);
      return;
    }
    const bool a_crossed = a.side != 0 && own_side == 0, b_crossed = b.side != 0 && other_side == 0;
    if (a.side != 0 && !a_crossed && own_side != a.side) return;  // the other part of t has this edge
    if (a_crossed && b_crossed && a.tip == b.tip) {
      if (wall_meets_cell(part_of_wall(h, a.side), cell)) join(e, f + (b.side == a.side ? 0 : 1));
      return;
    }
    // Whole or uncrossed on both sides; where only one side is crossed the continuation ended here: both parts hang on.
    if (!wall_meets_cell(wall(h), cell)) return;
    if (b.side == 0) {
      join(e, f);
    } else if (b_crossed) {
      join(e, f);
      join(e, f + 1);
    } else {
      join(e, f + (b.side == other_side ? 0 : 1));
    }
  }

  [[nodiscard]] bool is_virtual(CollisionHalfEdge h) const {
    return std::find(s_.virtual_edges.begin(), s_.virtual_edges.end(), h) != s_.virtual_edges.end();
  }

  /// The part of a crossed wall on one side of the continuation.
  [[nodiscard]] PrismWall part_of_wall(CollisionHalfEdge h, int side) const {
    for (const TipCrossing& x : s_.crossings)
      if (x.edge == h || mesh_.twin[x.edge] == h) {
        const CollisionVertex from = mesh_.from(x.edge), to = mesh_.to(x.edge);  // x.edge runs from right to left
        const PrismCorners &a = hex_.prism_corner[from], &b = hex_.prism_corner[to];
        PrismCorners middle{lerp(a.minus, b.minus, x.t), lerp(a.plus, b.plus, x.t), CollisionVertex(INT32_MAX)};
        return wall_between(side > 0 ? b : a, middle);
      }
    return wall(h);
  }

  /// How the prism of a triangle is split in the cell under analysis, or null.
  [[nodiscard]] const SplitTriangle* split_of(T t) const {
    const auto i = at(s_.split_slot[t.index()]);
    return i < s_.split_triangles.size() && s_.split_triangles[i].triangle == t ? &s_.split_triangles[i] : nullptr;
  }

  void split_at_tips(Work::CellElements& entry, LatticeIndex cell) {
    const CellId c = entry.cell;
    s_.tips_here.clear();
    for (TipId t = hex_.first_tip[c]; t.valid(); t = hex_.tips[t].next_in_cell) s_.tips_here.push_back(t);
    std::sort(s_.tips_here.begin(), s_.tips_here.end(),
              [&](TipId a, TipId b) { return hex_.tips[a].vertex < hex_.tips[b].vertex; });
    s_.split_triangles.clear();
    index_elements(entry.first, entry.count);
    for (const TipId tip : s_.tips_here) {
      TipCell record = hex_.tips[tip];
      record.left = record.right = {};
      record.along.fill({});
      std::size_t along = 0;
      continue_tip(
          mesh_, hex_, record,
          [&](T t) {  // may the continuation enter this triangle?
            return element_of(t) >= 0 && split_of(t) == nullptr;
          },
          [&](CollisionHalfEdge h) { return wall_meets_cell(wall(h), cell); },
          [&](const SplitTriangle& split, const TipCrossing* exit) {
            s_.split_slot[split.triangle.index()] = static_cast<std::int32_t>(s_.split_triangles.size());
            s_.split_triangles.push_back(split);
            s_.split_triangles.back().tip = tip;
            if (exit != nullptr) s_.crossings.push_back(*exit);
            if (!record.left.valid()) record.left = record.right = split.triangle;
          },
          [&](CollisionHalfEdge h) {
            if (along == record.along.size()) return false;
            record.along[along++] = h;
            s_.virtual_edges.push_back(h);
            s_.virtual_edges.push_back(mesh_.twin[h]);
            if (!record.left.valid()) {
              record.left = CollisionMesh::face(h);
              record.right = CollisionMesh::face(mesh_.twin[h]);
            }
            return true;
          });
      hex_.tips.set(tip, record);
    }
    if (s_.split_triangles.empty()) return;
    change_.tips_changed = true;

    // Every split prism becomes two elements, left and right, in its place.
    s_.split_elements.assign(s_.elements.begin() + entry.first, s_.elements.begin() + entry.first + entry.count);
    const bool last = at(entry.first + entry.count) == s_.elements.size();
    if (!last) {  // the cell's elements move to the end
      entry.first = static_cast<std::int32_t>(s_.elements.size());
    } else {
      s_.elements.resize(at(entry.first));
    }
    for (const Element& whole : s_.split_elements) {
      const SplitTriangle* const split = split_of(whole.triangle);
      if (split == nullptr) {
        s_.elements.push_back(whole);
        continue;
      }
      const TipCell& record = hex_.tips[split->tip];
      Moments moments[2]{};
      const Prism p = prism(whole.triangle);
      add_prism_moments_beside(p, cell, record.point, record.normal, moments[0], moments[1]);
      const double sum = moments[0][0] + moments[1][0], fit = sum > 0 ? whole.volume / sum : 1;
      for (int part = 0; part < 2; ++part) {
        for (double& m : moments[part]) m *= fit;
        Element e = whole;
        e.tip = split->tip;
        e.side = part == 0 ? 1 : -1;
        e.volume = moments[part][0];
        e.piece = {};
        e.edge_side = split->edge_side;
        e.moments = static_cast<std::int32_t>(s_.moments.size());
        s_.moments.push_back(moments[part]);
        s_.elements.push_back(e);
      }
      s_.rewritten.push_back(whole.triangle);
    }
    entry.count = static_cast<std::int32_t>(s_.elements.size()) - entry.first;
  }

  // ---------------------------------------------------------------- copies of one cell

  void assign_copies(std::size_t which) {
    const Work::CellElements entry = s_.cells[which];
    const CellId c = entry.cell;
    s_.groups.clear();
    s_.group_of.assign(at(entry.count), -1);
    for (std::int32_t i = 0; i < entry.count; ++i) {
      const std::int32_t e = entry.first + i;
      Element& element = s_.elements[at(e)];
      // A root comes before the others of its group.
      const std::int32_t root = find(e) - entry.first;
      if (s_.group_of[at(root)] < 0) {
        s_.group_of[at(root)] = static_cast<std::int32_t>(s_.groups.size());
        s_.groups.push_back({});
        s_.groups.back().first = e;
      }
      s_.group_of[at(i)] = s_.group_of[at(root)];
      Group& group = s_.groups[at(s_.group_of[at(i)])];
      ++group.count;
      group.volume += element.volume;
      if (!element.piece.valid()) group.same = false;
      if (element.side < 0) ++group.newborn;
      if (element.side != 0) ++group.parts;
      for (int k = 0; k < 3; ++k) {
        const CollisionVertex v = vertex(element.triangle, k);
        if (v.index() >= old_vertex_count_ && mesh_.ancestor[v] != v) ++group.newborn;
      }
    }
    list_groups(entry);
    // Parts of split prisms that hold nothing only joined others; they are no copy of their own.
    s_.groups.erase(std::remove_if(s_.groups.begin(), s_.groups.end(),
                                   [](const Group& g) { return g.parts == g.count && g.volume <= kOverlapVolume; }),
                    s_.groups.end());
    for (Group& g : s_.groups) find_parent(g);

    // Old copies go to the best of their heirs; the others are new.
    for (std::size_t g = 0; g < s_.groups.size(); ++g) {
      Group& group = s_.groups[g];
      if (!group.parent.valid()) continue;
      bool wins = true;
      for (std::size_t o = 0; o < s_.groups.size(); ++o) {
        const Group& other = s_.groups[o];
        if (o == g || other.parent != group.parent) continue;
        if (other.newborn != group.newborn ? other.newborn < group.newborn
            : other.volume != group.volume ? other.volume > group.volume
                                           : o < g)
          wins = false;
      }
      if (wins) group.copy = group.parent;
    }
    // Those without an heir die.
    HexId previous;
    for (HexId h = hex_.first_copy[c]; h.valid();) {
      const HexId next = hex_.next_in_cell[h];
      const bool kept = std::any_of(s_.groups.begin(), s_.groups.end(), [&](const Group& g) { return g.copy == h; });
      if (kept) {
        previous = h;
      } else {
        if (previous.valid()) hex_.next_in_cell.set(previous, next);
        else hex_.first_copy.set(c, next);
        hex_.state.set(h, HexState::kDead);
        change_.dead_copies.push_back(h);
        s_.dirty.push_back(h);
      }
      h = next;
    }
    for (Group& g : s_.groups) {
      if (!g.copy.valid()) g.copy = new_copy(c, g.parent);
      update_material(entry, g);
      find_heirs(g);
      for (const auto& [from, volume] : s_.heirs) s_.sources.push_back({g.copy, from, volume});
    }
    for (std::int32_t e = entry.first; e < entry.first + entry.count; ++e) s_.elements[at(e)].copy = {};
    for (const Group& g : s_.groups)
      for (const std::int32_t e : members(g)) s_.elements[at(e)].copy = g.copy;
    for (std::int32_t e = entry.first; e < entry.first + entry.count; ++e) {
      const Element& element = s_.elements[at(e)];
      if (!element.copy.valid()) continue;
      s_.results.push_back({element.triangle, c, e});
      if (element.copy != element.old_copy || !element.piece.valid()) change_.triangles.push_back(element.triangle);
    }
  }

  /// Elements of the groups, by `group_of`.
  void list_groups(const Work::CellElements& entry) {
    std::int32_t begin = 0;
    for (Group& g : s_.groups) {
      g.begin = begin;
      begin += g.count;
      g.count = 0;
    }
    s_.grouped.resize(at(entry.count));
    for (std::int32_t i = 0; i < entry.count; ++i) {
      Group& g = s_.groups[at(s_.group_of[at(i)])];
      s_.grouped[at(g.begin + g.count++)] = entry.first + i;
    }
  }
  [[nodiscard]] std::span<const std::int32_t> members(const Group& g) const {
    return std::span(s_.grouped).subspan(at(g.begin), at(g.count));
  }

  /// The old copies that a group's material was in, with its volume.
  void find_heirs(const Group& g) {
    s_.heirs.clear();
    for (const std::int32_t e : members(g)) {
      const HexId old = s_.elements[at(e)].old_copy;
      if (!old.valid()) continue;
      auto it = std::find_if(s_.heirs.begin(), s_.heirs.end(), [&](const auto& h) { return h.first == old; });
      if (it == s_.heirs.end()) s_.heirs.emplace_back(old, s_.elements[at(e)].volume);
      else it->second += s_.elements[at(e)].volume;
    }
  }

  void find_parent(Group& g) {
    find_heirs(g);
    double most = -1;
    for (const auto& h : s_.heirs)
      if (h.second > most || (h.second == most && h.first < g.parent)) g.parent = h.first, most = h.second;
  }

  HexId new_copy(CellId c, HexId parent) {
    const HexId h = hex_.cell.push_back(hex_.index_of(c));
    hex_.nodes.push_back({});
    hex_.state.push_back(HexState::kAlive);
    hex_.host.push_back(h);
    hex_.parent.push_back(parent);
    hex_.material.push_back({});
    hex_.weights.push_back({});
    hex_.absorber.push_back({});
    hex_.first_guest.push_back({});
    hex_.next_guest.push_back({});
    hex_.first_piece.push_back({-1, 0});
    hex_.piece_count.push_back(0);
    hex_.next_in_cell.push_back(hex_.first_copy[c]);
    hex_.first_copy.set(c, h);
    change_.new_copies.push_back(h);
    s_.dirty.push_back(h);
    return h;
  }

  void update_material(const Work::CellElements& entry, const Group& g) {
    const HexId h = g.copy;
    const Element& first = s_.elements[at(g.first)];
    if (g.same && hex_.piece_count[h] == g.count && hex_.first_piece[h][0] == first.triangle.value &&
        hex_.first_piece[h][1] == first.side && is_old(g))
      return;
    hex_.piece_count.set(h, g.count);
    hex_.first_piece.set(h, {first.triangle.value, first.side});
    HexMaterial m = hex_.material[h];
    m.fill = g.volume;
    m.full = m.fill >= kFullFill;
    double scaled = 0;
    for (const std::int32_t e : members(g))
      scaled += hex_.shape[s_.elements[at(e)].triangle].scale * s_.elements[at(e)].volume;
    m.body = hex_.body_of(mesh_.root[first.triangle]);  // copies hold the material of one body
    const double body_scale = hex_.bodies[at(m.body)].scale;
    scaled *= body_scale;
    m.volume = scaled * hex_.frame_of_body(m.body).cell_volume();
    std::array<double, 27> weights;
    if (m.full) {
      weights = full_weights();
      for (double& w : weights) w *= scaled;
    } else {
      Moments sum{};
      const LatticeIndex cell = hex_.index_of(entry.cell);
      for (const std::int32_t e : members(g)) {
        const Moments& part = moments_of(s_.elements[at(e)], cell);
        const double scale = hex_.shape[s_.elements[at(e)].triangle].scale * body_scale;
        for (std::size_t i = 0; i < 27; ++i) sum[i] += scale * part[i];
      }
      weights = weights_of(sum);
    }
    hex_.material.set(h, m);
    hex_.weights.set(h, weights);
    s_.dirty.push_back(h);
    changed(h);
  }

  /// Are all of the group's pieces from the copy that it inherits?
  [[nodiscard]] bool is_old(const Group& g) const {
    return std::ranges::all_of(members(g), [&](std::int32_t e) { return s_.elements[at(e)].old_copy == g.copy; });
  }

  const Moments& moments_of(Element& e, LatticeIndex cell) {
    if (e.moments >= 0) return s_.moments[at(e.moments)];
    if (e.piece.valid() && hex_.piece_pool[e.piece].has_moments) return hex_.piece_moments[e.piece];
    e.moments = static_cast<std::int32_t>(s_.moments.size());
    s_.moments.push_back({});
    add_prism_moments(prism(e.triangle), cell, s_.moments.back());
    return s_.moments.back();
  }

  void changed(HexId h) {
    if (s_.hex_stamp.size() < hex_.hex_count()) s_.hex_stamp.resize(hex_.hex_count());
    change_.changed_copies.push_back(h);
  }

  // ---------------------------------------------------------------- back into the mesh

  void write_pieces() {
    // Members of the touched cells.
    for (const Work::CellElements& entry : s_.cells) {
      s_.members.clear();
      for (std::int32_t e = entry.first; e < entry.first + entry.count; ++e) {
        const T t = s_.elements[at(e)].triangle;
        if (s_.members.empty() || s_.members.back() != t) s_.members.push_back(t);
      }
      const auto old = hex_.members_of(entry.cell);
      if (std::equal(old.begin(), old.end(), s_.members.begin(), s_.members.end())) continue;
      LatticeRun run = hex_.members[entry.cell];
      write_run(hex_.member_pool, run, std::span<const T>(s_.members), LatticePoolIndex{});
      hex_.members.set(entry.cell, run);
    }
    // Pieces of the triangles: new runs for those that have other pieces, other copies in place for the rest.
    s_.rewritten.insert(s_.rewritten.end(), s_.reshaped.begin(), s_.reshaped.end());
    sort_unique(s_.rewritten);
    const std::uint64_t rewriting = ++s_.serial;
    for (const T t : s_.rewritten) s_.triangle_stamp[t.index()] = rewriting;
    for (const Work::Result& r : s_.results) {
      Element& e = s_.elements[at(r.element)];
      if (s_.triangle_stamp[r.triangle.index()] == rewriting) continue;
      Piece p = hex_.piece_pool[e.piece];
      if (e.moments >= 0) hex_.piece_moments.set(e.piece, s_.moments[at(e.moments)]);
      if (p.copy == e.copy && (p.has_moments || e.moments < 0)) continue;
      p.copy = e.copy;
      p.has_moments = p.has_moments || e.moments >= 0;
      hex_.piece_pool.set(e.piece, p);
    }
    std::sort(s_.results.begin(), s_.results.end(), [](const auto& a, const auto& b) {
      if (a.triangle != b.triangle) return a.triangle < b.triangle;
      return a.cell < b.cell || (a.cell == b.cell && a.element < b.element);
    });
    const std::uint64_t touched = ++s_.serial;
    for (const CellId c : s_.touched) s_.cell_stamp[c.index()] = touched;
    std::size_t next = 0;
    for (const T t : s_.rewritten) {
      s_.run.clear();
      s_.run_moments.clear();
      LatticeRun run = hex_.pieces[t];
      while (next < s_.results.size() && s_.results[next].triangle < t) ++next;
      std::int32_t kept = 0;
      auto keep_before = [&](CellId c) {
        for (; kept < run.count; ++kept) {
          const PieceIndex i(run.first + kept);
          const Piece& p = hex_.piece_pool[i];
          if (c.valid() && !(p.cell < c)) return;
          if (s_.cell_stamp[p.cell.index()] == touched) continue;
          s_.run.push_back(p);
          s_.run_moments.push_back(hex_.piece_moments[i]);
        }
      };
      for (; next < s_.results.size() && s_.results[next].triangle == t; ++next) {
        const Work::Result& r = s_.results[next];
        keep_before(r.cell);
        const Element& e = s_.elements[at(r.element)];
        Piece p;
        p.cell = r.cell;
        p.copy = e.copy;
        p.tip = e.side != 0 ? e.tip : TipId{};
        p.side = e.side;
        p.volume = e.volume;
        p.has_moments = true;
        if (e.moments >= 0) s_.run_moments.push_back(s_.moments[at(e.moments)]);
        else if (e.piece.valid() && hex_.piece_pool[e.piece].has_moments)
          s_.run_moments.push_back(hex_.piece_moments[e.piece]);
        else p.has_moments = false, s_.run_moments.push_back({});
        s_.run.push_back(p);
      }
      keep_before({});
      write_run(hex_.piece_pool, run, std::span<const Piece>(s_.run), PieceIndex{});
      hex_.piece_moments.grow(hex_.piece_pool.size() - hex_.piece_moments.size());
      for (std::size_t i = 0; i < s_.run.size(); ++i)
        if (s_.run[i].has_moments)
          hex_.piece_moments.set(PieceIndex(run.first + static_cast<std::int32_t>(i)), s_.run_moments[i]);
      hex_.pieces.set(t, run);
      change_.triangles.push_back(t);
    }
  }

  // ---------------------------------------------------------------- links through faces

  /// The elements of a cell, from the mesh if it was not touched.
  Work::CellElements elements_of(CellId c) {
    if (s_.cell_cached[c.index()] == cached_) return s_.cells[at(s_.cell_slot[c.index()])];
    s_.cell_cached[c.index()] = cached_;
    s_.cell_slot[c.index()] = static_cast<std::int32_t>(s_.cells.size());
    Work::CellElements entry{c, static_cast<std::int32_t>(s_.elements.size()), 0, false};
    for (const T t : hex_.members_of(c)) add_old(t, c);
    entry.count = static_cast<std::int32_t>(s_.elements.size()) - entry.first;
    s_.cells.push_back(entry);
    return entry;
  }

  void update_links() {
    cached_ = ++s_.serial;
    for (std::size_t i = 0; i < s_.cells.size(); ++i) {
      s_.cell_cached[s_.cells[i].cell.index()] = cached_;
      s_.cell_slot[s_.cells[i].cell.index()] = static_cast<std::int32_t>(i);
    }
    for (const CellId c : s_.touched) {
      const LatticeIndex index = hex_.index_of(c);
      for (int axis = 0; axis < 3; ++axis) {
        LatticeIndex below = index, above = index;
        --below[at(axis)];
        ++above[at(axis)];
        if (hex_.contains(below)) s_.faces.push_back(HexMesh::face(hex_.cell_id(below), axis));
        if (hex_.contains(above)) s_.faces.push_back(HexMesh::face(c, axis));
      }
    }
    sort_unique(s_.faces);
    for (const LatticeFaceId f : s_.faces) link_face(f);
  }

  void link_face(LatticeFaceId f) {
    const CellId a(f.value / 3);
    const int axis = f.value % 3;
    const LatticeIndex index = hex_.index_of(a);
    LatticeIndex beyond = index;
    ++beyond[at(axis)];
    const CellId b = hex_.cell_id(beyond);
    const Work::CellElements ea = elements_of(a), eb = elements_of(b);
    s_.links.clear();
    auto link = [&](HexId x, HexId y) {
      const HexLink l{x, y};
      if (std::find(s_.links.begin(), s_.links.end(), l) == s_.links.end()) s_.links.push_back(l);
    };
    // The same prism in both.
    std::int32_t j = eb.first;
    const std::int32_t end_a = ea.first + ea.count, end_b = eb.first + eb.count;
    for (std::int32_t i = ea.first; i < end_a; ++i) {
      const Element& x = s_.elements[at(i)];
      if (!x.copy.valid()) continue;
      while (j < end_b && s_.elements[at(j)].triangle < x.triangle) ++j;
      for (std::int32_t k = j; k < end_b && s_.elements[at(k)].triangle == x.triangle; ++k) {
        const Element& y = s_.elements[at(k)];
        if (!y.copy.valid()) continue;
        if (x.side != 0 && y.side != 0) {
          const CollisionVertex tip = hex_.tips[x.tip].vertex;
          if (tip == hex_.tips[y.tip].vertex && x.side != y.side &&
              (has_other_part(ea, i) || has_other_part(eb, k) || glued_at(tip, x.copy, y.copy)))
            continue;
        } else if (x.side != 0) {
          if (!reaches(x, beyond)) continue;
        } else if (y.side != 0) {
          if (!reaches(y, index)) continue;
        }
        link(x.copy, y.copy);
      }
    }
    // A wall in the face itself, with one prism on either side.
    if (ea.count > 0 && eb.count > 0) {
      index_elements(eb.first, eb.count);
      const std::uint64_t in_b = analysed_;
      s_.on_face.clear();
      for (std::int32_t i = ea.first; i < end_a; ++i) {
        const T t = s_.elements[at(i)].triangle;
        if (s_.triangle_stamp[t.index()] == in_b) continue;
        for (int k = 0; k < 3; ++k) {
          const CollisionHalfEdge g = mesh_.twin[CollisionMesh::corner(t, k)];
          if (g.valid() && s_.triangle_stamp[CollisionMesh::face(g).index()] == in_b)
            s_.on_face.push_back({i, s_.triangle_slot[CollisionMesh::face(g).index()], CollisionMesh::corner(t, k)});
        }
      }
      if (!s_.on_face.empty()) {
        index_elements(ea.first, ea.count);
        for (const OnFace& o : s_.on_face) {
          const T u = s_.elements[at(o.b)].triangle;
          if (element_of(u) >= 0 || !wall_lies_in_face(wall(o.edge), index, axis)) continue;
          for (std::int32_t k = o.b; k < end_b && s_.elements[at(k)].triangle == u; ++k) {
            const HexId x = s_.elements[at(o.a)].copy, y = s_.elements[at(k)].copy;
            if (x.valid() && y.valid() && !opened_along(o.edge, a, x, y) && !opened_along(o.edge, b, x, y)) link(x, y);
          }
        }
      }
    }
    const auto old = hex_.links_of(f);
    if (std::equal(old.begin(), old.end(), s_.links.begin(), s_.links.end())) return;
    for (int k = 0; k < 8; ++k)
      if ((k >> axis & 1) != 0) s_.corners.push_back(hex_.corner_number(LatticeFrame::corner(index, k)));
    LatticeRun run = hex_.links[f];
    write_run(hex_.link_pool, run, std::span<const HexLink>(s_.links), LatticePoolIndex{});
    hex_.links.set(f, run);
  }

  /// Does this part of a split prism reach into another cell?
  [[nodiscard]] bool reaches(const Element& e, LatticeIndex cell) const {
    const TipCell& tip = hex_.tips[e.tip];
    return prism_beside(prism(e.triangle), cell, tip.point, tip.normal, e.side);
  }

  /// Does the continuation of a tip in this cell run along the edge, between two copies that its glue holds together? What
  /// the glue does not hold must not come off.
  [[nodiscard]] bool opened_along(CollisionHalfEdge h, CellId c, HexId x, HexId y) const {
    for (TipId t = hex_.first_tip[c]; t.valid(); t = hex_.tips[t].next_in_cell) {
      const auto& along = hex_.tips[t].along;
      if (std::none_of(along.begin(), along.end(),
                       [&](CollisionHalfEdge g) { return g.valid() && (g == h || mesh_.twin[g] == h); }))
        continue;
      if (glued_at(hex_.tips[t].vertex, x, y)) return true;
    }
    return false;
  }

  /// Does the glue at a tip hold these two copies together?
  [[nodiscard]] bool glued_at(CollisionVertex tip, HexId x, HexId y) const {
    for (TipId record = hex_.vertex_tip[tip]; record.valid(); record = hex_.tips[record].next_of_vertex) {
      const TipCopies glued = tip_copies(hex_, record);
      if ((glued.left == x && glued.right == y) || (glued.left == y && glued.right == x)) return true;
    }
    return false;
  }

  /// Does the other part of this split prism hold material in the cell, too? If not, the tip's plane lies in a face of the cell (or
  /// the prism just looks over it), and its parts meet in that face alone.
  [[nodiscard]] bool has_other_part(const Work::CellElements& entry, std::int32_t e) const {
    const Element& part = s_.elements[at(e)];
    for (std::int32_t o = std::max(entry.first, e - 1); o <= std::min(entry.first + entry.count - 1, e + 1); ++o) {
      const Element& other = s_.elements[at(o)];
      if (other.triangle == part.triangle && other.side == -part.side) return other.copy.valid();
    }
    return false;
  }

  // ---------------------------------------------------------------- nodes

  void update_nodes() {
    // Corners of cells with other copies than before; link_face added those of faces with other links.
    for (const auto* copies : {&change_.new_copies, &change_.dead_copies})
      for (const HexId h : *copies)
        for (int k = 0; k < 8; ++k) s_.corners.push_back(hex_.corner_number(LatticeFrame::corner(hex_.cell[h], k)));
    sort_unique(s_.corners);
    std::sort(s_.sources.begin(), s_.sources.end(),
              [](const auto& a, const auto& b) { return a.copy != b.copy ? a.copy < b.copy : a.from < b.from; });
    // Dead copies still count for what their nodes were.
    for (const HexId h : change_.dead_copies)
      for (int k = 0; k < 8; ++k)
        s_.corner_nodes.emplace_back(hex_.corner_number(LatticeFrame::corner(hex_.cell[h], k)), hex_.nodes[h][at(k)]);
    for (const std::int32_t key : s_.corners) share_corner(key);
  }

  void share_corner(std::int32_t key) {
    const LatticeIndex q = hex_.corner_of(key);
    s_.around.clear();
    s_.copies.reset(hex_.hex_count());
    for (int k = 0; k < 8; ++k) {
      const LatticeIndex c{q[0] - (k & 1), q[1] - (k >> 1 & 1), q[2] - (k >> 2 & 1)};
      if (!hex_.contains(c)) continue;
      for (HexId h = hex_.first_copy[hex_.cell_id(c)]; h.valid(); h = hex_.next_in_cell[h]) {
        CornerCopy entry;
        entry.copy = h;
        entry.corner = k;
        entry.root = s_.copies.insert(h.value);
        entry.kept = hex_.nodes[h][at(k)].valid();
        const HexId source = entry.kept ? h : hex_.parent[h];
        if (source.valid()) entry.old = hex_.nodes[source][at(k)];
        s_.around.push_back(entry);
      }
    }
    if (s_.around.empty()) return;
    auto root_of = [&](std::int32_t i) {
      while (s_.around[at(i)].root != i) i = s_.around[at(i)].root = s_.around[at(s_.around[at(i)].root)].root;
      return i;
    };
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 8; ++k) {
        if ((k >> axis & 1) == 0) continue;  // the cell before the corner along this axis
        const LatticeIndex c{q[0] - (k & 1), q[1] - (k >> 1 & 1), q[2] - (k >> 2 & 1)};
        if (!hex_.contains(c)) continue;
        for (const HexLink& l : hex_.links_of(HexMesh::face(hex_.cell_id(c), axis))) {
          const std::int32_t i = s_.copies.find(l[0].value), j = s_.copies.find(l[1].value);
          KERF_ASSERT(i >= 0 && j >= 0);
          const std::int32_t a = root_of(i), b = root_of(j);
          if (a != b) s_.around[at(std::max(a, b))].root = std::min(a, b);
        }
      }
    // Classes, those of the oldest copies first; each takes over the first old node of its copies that is still free.
    s_.classes.clear();
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(s_.around.size()); ++i) {
      CornerCopy& entry = s_.around[at(i)];
      entry.root = root_of(i);
      if (entry.root == i) {
        entry.of_class = static_cast<std::int32_t>(s_.classes.size());
        s_.classes.push_back({entry.kept, entry.copy, i, i, {}});
        continue;
      }
      entry.of_class = s_.around[at(entry.root)].of_class;
      Class& c = s_.classes[at(entry.of_class)];
      c.last = s_.around[at(c.last)].next = i;
      if (entry.kept && (!c.kept || entry.copy < c.oldest)) c.kept = true, c.oldest = entry.copy;
      else if (entry.kept == c.kept && entry.copy < c.oldest) c.oldest = entry.copy;
    }
    std::sort(s_.classes.begin(), s_.classes.end(),
              [](const Class& a, const Class& b) { return a.kept != b.kept ? a.kept : a.oldest < b.oldest; });
    s_.nodes.reset(hex_.node_count());  // those that are taken
    for (Class& c : s_.classes) {
      NodeId parent;
      for (const bool kept : {true, false})
        for (std::int32_t i = c.first; i >= 0; i = s_.around[at(i)].next) {
          const CornerCopy& entry = s_.around[at(i)];
          if (entry.kept != kept || !entry.old.valid()) continue;
          if (!parent.valid()) parent = entry.old;
          if (s_.nodes.find(entry.old.value) < 0 && (!c.node.valid() || (kept && entry.old < c.node)))
            c.node = entry.old;
        }
      if (c.node.valid()) {
        s_.nodes.insert(c.node.value);
      } else {
        c.node = hex_.corner.push_back(q);
        hex_.node_parent.push_back(parent);
        hex_.node_uses.push_back(0);
        change_.new_nodes.push_back(c.node);
      }
      note_joined(c);
    }
    for (const Class& c : s_.classes)
      for (std::int32_t i = c.first; i >= 0; i = s_.around[at(i)].next) s_.around[at(i)].node = c.node;
    for (const CornerCopy& entry : s_.around) {
      if (entry.kept) s_.corner_nodes.emplace_back(key, entry.old);
      if (hex_.nodes[entry.copy][at(entry.corner)] == entry.node) continue;
      std::array<NodeId, 8> nodes = hex_.nodes[entry.copy];
      nodes[at(entry.corner)] = entry.node;
      hex_.nodes.set(entry.copy, nodes);
      changed(entry.copy);
    }
  }

  /// Whose material a class of corners holds, where it is of more than one old node.
  void note_joined(const Class& c) {
    s_.shares.clear();
    const auto add = [&](NodeId from, double volume) {
      if (!from.valid()) return;
      auto it = std::find_if(s_.shares.begin(), s_.shares.end(), [&](const auto& s) { return s.first == from; });
      if (it == s_.shares.end()) s_.shares.emplace_back(from, volume);
      else it->second += volume;
    };
    for (std::int32_t i = c.first; i >= 0; i = s_.around[at(i)].next) {
      const CornerCopy& entry = s_.around[at(i)];
      auto source = std::lower_bound(s_.sources.begin(), s_.sources.end(), entry.copy,
                                     [](const Work::Source& a, HexId copy) { return a.copy < copy; });
      if (source == s_.sources.end() || source->copy != entry.copy) add(entry.old, hex_.material[entry.copy].fill);
      for (; source != s_.sources.end() && source->copy == entry.copy; ++source)
        add(hex_.nodes[source->from][at(entry.corner)], source->volume);
    }
    if (s_.shares.size() < 2) return;
    std::sort(s_.shares.begin(), s_.shares.end());
    for (const auto& [from, volume] : s_.shares) change_.joined_nodes.push_back({c.node, from, volume});
  }

  // ---------------------------------------------------------------- absorption

  /// Order in which copies are given up.
  [[nodiscard]] bool before(HexId a, HexId b) const {
    const double fa = hex_.material[a].fill, fb = hex_.material[b].fill;
    if (fa != fb) return fa < fb;
    const CellId ca = hex_.cell_id(hex_.cell[a]), cb = hex_.cell_id(hex_.cell[b]);
    if (ca != cb) return ca < cb;
    return hex_.first_piece[a] < hex_.first_piece[b];
  }

  template <class Fn>
  void for_each_neighbour(HexId x, Fn&& f) {  // copies that share a node with x
    const LatticeIndex c = hex_.cell[x];
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const LatticeIndex d{c[0] + dx, c[1] + dy, c[2] + dz};
          if (!hex_.contains(d)) continue;
          for (HexId y = hex_.first_copy[hex_.cell_id(d)]; y.valid(); y = hex_.next_in_cell[y])
            if (y != x && share_a_node(x, y, {dx, dy, dz})) f(y);
        }
  }
  [[nodiscard]] bool share_a_node(HexId x, HexId y, LatticeIndex step) const {
    const auto &nx = hex_.nodes[x], &ny = hex_.nodes[y];
    for (int k = 0; k < 8; ++k) {
      int other = 0;
      bool common = true;
      for (int a = 0; a < 3; ++a) {
        const int bit = (k >> a & 1) - step[at(a)];
        if (bit < 0 || bit > 1) common = false;
        other |= bit << a;
      }
      if (common && nx[at(k)] == ny[at(other)]) return true;
    }
    return false;
  }

  template <class Fn>
  void for_each_linked(HexId x, Fn&& f) {  // copies behind the six faces of x, with the face's axis and side
    const LatticeIndex c = hex_.cell[x];
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        LatticeIndex low = c;
        low[at(axis)] -= side;
        if (!hex_.contains(low)) continue;
        for (const HexLink& l : hex_.links_of(HexMesh::face(hex_.cell_id(low), axis)))
          if (l[at(side)] == x) f(l[at(1 - side)], axis, side);
      }
  }

  /// Who absorbs copy x, given what became of the copies before it in the order; none: it stays.
  ///
  ///     +-----------+-----------+
  ///     |           |           |      x, a sliver along its lower face, hangs on what lies below:
  ///     |           |           |      there it is carried as it lies. From the right it would be
  ///     |xxxxxxxxxxx|           |      the far end of a long lever.
  ///     +-----------+-----------+
  ///     |  its host |           |
  HexId absorber_of(HexId x) {
    if (hex_.material[x].fill >= kAbsorbedFill) return {};
    const auto stays = [&](HexId y) { return !before(y, x) || !hex_.absorber[y].valid(); };
    const Vec3 centre = centre_of(hex_.weights[x]), cell = hex_.frame_of(x).cell;
    auto& near = s_.neighbours;
    near.clear();
    HexId best;
    double best_far = 0;
    for_each_linked(x, [&](HexId y, int axis, int side) {
      if (!stays(y)) return;
      near.push_back(y);
      const double far = cell[axis] * (side == 0 ? 1 - centre[axis] : 1 + centre[axis]);
      if (best.valid()) {
        const double own = hex_.material[y].fill * best_far, its = hex_.material[best].fill * far;
        if (own < its || (own == its && !before(y, best))) return;
      }
      best = y, best_far = far;
    });
    if (near.empty()) return {};
    return near.size() == 1 || are_connected_without(x, stays) ? best : HexId{};
  }

  /// Of the material with these weights, in local coordinates; the cell's where it is next to none.
  static Vec3 centre_of(const std::array<double, 27>& weights) {
    double sum = 0;
    Vec3 moment;
    for (std::size_t i = 0; i < 27; ++i) sum += weights[i], moment += weights[i] * quadrature_points()[i];
    return sum > 0 ? (1 / sum) * moment : Vec3{};
  }

  /// Do those behind the faces of x, which are in `neighbours`, hang together by copies that share a node with x and stay?
  template <class Stays>
  bool are_connected_without(HexId x, const Stays& stays) {
    auto& near = s_.neighbours;
    const std::size_t faces = near.size();
    s_.copies.reset(hex_.hex_count());
    for (const HexId y : near) s_.copies.insert(y.value);
    for_each_neighbour(x, [&](HexId y) {
      if (s_.copies.find(y.value) >= 0 || !stays(y)) return;
      s_.copies.insert(y.value);
      near.push_back(y);
    });
    s_.parent.resize(near.size());
    for (std::size_t i = 0; i < near.size(); ++i) s_.parent[i] = static_cast<std::int32_t>(i);
    auto root_of = [&](std::int32_t i) {
      while (s_.parent[at(i)] != i) i = s_.parent[at(i)] = s_.parent[at(s_.parent[at(i)])];
      return i;
    };
    const LatticeIndex c = hex_.cell[x];
    std::size_t apart = faces;
    for (int k = 0; k < 27; ++k) {  // faces within the block of cells around
      const LatticeIndex d{c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1};
      if (!hex_.contains(d)) continue;
      for (int axis = 0; axis < 3; ++axis) {
        if (d[at(axis)] == c[at(axis)] + 1) continue;
        for (const HexLink& l : hex_.links_of(HexMesh::face(hex_.cell_id(d), axis))) {
          const std::int32_t i = s_.copies.find(l[0].value), j = s_.copies.find(l[1].value);
          if (i < 0 || j < 0) continue;
          const std::int32_t a = root_of(i), b = root_of(j);
          if (a == b) continue;
          s_.parent[at(std::max(a, b))] = std::min(a, b);  // roots of those behind faces stay below `faces`
          if (at(std::max(a, b)) < faces && --apart == 1) return true;
        }
      }
    }
    return false;
  }

  void set_absorber(HexId x, HexId to) {
    const HexId old = hex_.absorber[x];
    if (old == to) return;
    if (old.valid()) {
      HexId g = hex_.first_guest[old];
      if (g == x) {
        hex_.first_guest.set(old, hex_.next_guest[x]);
      } else {
        while (hex_.next_guest[g] != x) g = hex_.next_guest[g];
        hex_.next_guest.set(g, hex_.next_guest[x]);
      }
      s_.dirty.push_back(old);
    }
    hex_.absorber.set(x, to);
    if (to.valid()) {
      hex_.next_guest.set(x, hex_.first_guest[to]);
      hex_.first_guest.set(to, x);
    }
    s_.dirty.push_back(x);
  }

  void absorb() {
    if (s_.hex_stamp.size() < hex_.hex_count()) s_.hex_stamp.resize(hex_.hex_count());
    for (const HexId h : change_.dead_copies) set_absorber(h, {});
    // Small copies of the touched cells and those of one ring further that hang or hung on them, in order; a changed mind asks those after it again.
    auto& queue = s_.small;
    queue.clear();
    const std::uint64_t queued = ++s_.serial;
    auto later = [this](HexId a, HexId b) { return before(b, a); };
    auto push = [&](HexId h) {
      if (s_.hex_stamp[h.index()] == queued || hex_.material[h].fill >= kAbsorbedFill) return;
      s_.hex_stamp[h.index()] = queued;
      queue.push_back(h);
      std::push_heap(queue.begin(), queue.end(), later);
    };
    if (s_.node_stamp.size() < hex_.node_count()) s_.node_stamp.resize(hex_.node_count());
    const std::uint64_t near = ++s_.serial;
    const auto mark = [&](NodeId n) {
      if (n.valid()) s_.node_stamp[n.index()] = near;
    };
    for (const auto& [corner, node] : s_.corner_nodes) mark(node);  // as they were
    for (const NodeId n : change_.new_nodes) mark(n);               // of copies that hung on them
    for (const CellId c : s_.touched)
      for (HexId h = hex_.first_copy[c]; h.valid(); h = hex_.next_in_cell[h])
        for (const NodeId n : hex_.nodes[h]) mark(n);
    const auto is_near = [&](HexId h) {
      return std::ranges::any_of(hex_.nodes[h], [&](NodeId n) { return s_.node_stamp[n.index()] == near; });
    };
    const std::uint64_t ring = ++s_.serial;
    for (const CellId c : s_.touched) {
      const LatticeIndex index = hex_.index_of(c);
      for (HexId h = hex_.first_copy[c]; h.valid(); h = hex_.next_in_cell[h])
        if (hex_.material[h].fill >= kAbsorbedFill) set_absorber(h, {});
      for (int k = 0; k < 27; ++k) {
        const LatticeIndex d{index[0] + k % 3 - 1, index[1] + k / 3 % 3 - 1, index[2] + k / 9 - 1};
        if (!hex_.contains(d)) continue;
        const CellId n = hex_.cell_id(d);
        if (s_.cell_stamp[n.index()] == ring) continue;
        s_.cell_stamp[n.index()] = ring;
        for (HexId h = hex_.first_copy[n]; h.valid(); h = hex_.next_in_cell[h])
          if (is_near(h)) push(h);
      }
    }
    while (!queue.empty()) {
      std::pop_heap(queue.begin(), queue.end(), later);
      const HexId x = queue.back();
      queue.pop_back();
      s_.hex_stamp[x.index()] = 0;
      const HexId to = absorber_of(x);
      const bool switched = to.valid() != hex_.absorber[x].valid();
      set_absorber(x, to);
      if (switched)
        for_each_neighbour(x, [&](HexId y) {
          if (before(x, y)) push(y);
        });
    }
  }

  // ---------------------------------------------------------------- hosts, masses, uses

  void finish() {
    sort_unique(s_.dirty);
    // Hosts: the ends of the chains of absorbers, for everything behind a changed one.
    s_.hosts.clear();
    s_.stack.assign(s_.dirty.begin(), s_.dirty.end());
    const std::uint64_t seen = ++s_.serial;
    while (!s_.stack.empty()) {
      const HexId h = s_.stack.back();
      s_.stack.pop_back();
      if (s_.hex_stamp[h.index()] == seen) continue;
      s_.hex_stamp[h.index()] = seen;
      HexId host = h;
      while (hex_.absorber[host].valid()) host = hex_.absorber[host];
      const bool dead = hex_.state[h] == HexState::kDead;
      const HexState state = dead ? HexState::kDead : host == h ? HexState::kAlive : HexState::kAbsorbed;
      const HexId new_host = dead ? HexId{} : host;
      if (hex_.host[h] != new_host || hex_.state[h] != state) {
        if (hex_.host[h].valid()) s_.hosts.push_back(hex_.host[h]);
        hex_.host.set(h, new_host);
        hex_.state.set(h, state);
        if (!dead) changed(h);
        for (int k = 0; k < 8; ++k) s_.corners.push_back(hex_.corner_number(LatticeFrame::corner(hex_.cell[h], k)));
        if (!dead)
          for (const T t : hex_.members_of(hex_.cell_id(hex_.cell[h])))
            for (const Piece& p : hex_.pieces_of(t))
              if (p.copy == h) change_.triangles.push_back(t);
      }
      s_.hosts.push_back(h);
      if (new_host.valid()) s_.hosts.push_back(new_host);
      for (HexId g = hex_.first_guest[h]; g.valid(); g = hex_.next_guest[g]) s_.stack.push_back(g);
    }
    sort_unique(s_.hosts);
    for (const HexId h : s_.hosts) {
      double sum = 0;
      if (hex_.state[h] == HexState::kAlive) {
        s_.stack.assign(1, h);
        while (!s_.stack.empty()) {
          const HexId g = s_.stack.back();
          s_.stack.pop_back();
          sum += hex_.material[g].volume;
          for (HexId n = hex_.first_guest[g]; n.valid(); n = hex_.next_guest[n]) s_.stack.push_back(n);
        }
      }
      HexMaterial m = hex_.material[h];
      if (m.mass_volume == sum) continue;
      m.mass_volume = sum;
      hex_.material.set(h, m);
      if (hex_.state[h] != HexState::kDead) changed(h);
    }
    // Uses of the nodes at all corners where something changed.
    sort_unique(s_.corners);
    std::sort(s_.corner_nodes.begin(), s_.corner_nodes.end());
    std::size_t next = 0;
    for (const std::int32_t key : s_.corners) {
      s_.uses.clear();
      s_.nodes.reset(hex_.node_count());
      auto slot = [&](NodeId n) -> std::int32_t& {
        const auto number = at(s_.nodes.insert(n.value));
        if (number == s_.uses.size()) s_.uses.emplace_back(n, 0);
        return s_.uses[number].second;
      };
      while (next < s_.corner_nodes.size() && s_.corner_nodes[next].first < key) ++next;
      for (; next < s_.corner_nodes.size() && s_.corner_nodes[next].first == key; ++next)
        if (s_.corner_nodes[next].second.valid()) slot(s_.corner_nodes[next].second);
      const LatticeIndex q = hex_.corner_of(key);
      for (int k = 0; k < 8; ++k) {
        const LatticeIndex c{q[0] - (k & 1), q[1] - (k >> 1 & 1), q[2] - (k >> 2 & 1)};
        if (!hex_.contains(c)) continue;
        for (HexId h = hex_.first_copy[hex_.cell_id(c)]; h.valid(); h = hex_.next_in_cell[h])
          slot(hex_.nodes[h][at(k)]) += hex_.alive(h) ? 1 : 0;
      }
      for (const auto& [node, uses] : s_.uses) {
        if (hex_.node_uses[node] == uses) continue;
        if ((hex_.node_uses[node] == 0) != (uses == 0)) change_.switched_nodes.push_back(node);
        hex_.node_uses.set(node, uses);
      }
    }
    sort_unique(change_.new_copies);
    sort_unique(change_.dead_copies);
    sort_unique(change_.changed_copies);
    auto& changed_copies = change_.changed_copies;
    changed_copies.erase(std::remove_if(changed_copies.begin(), changed_copies.end(),
                                        [&](HexId h) { return h.index() >= first_new_copy(); }),
                         changed_copies.end());
    sort_unique(change_.switched_nodes);
    const NodeId first_new = change_.new_nodes.empty() ? NodeId(hex_.node_count()) : change_.new_nodes.front();
    change_.switched_nodes.erase(
        std::lower_bound(change_.switched_nodes.begin(), change_.switched_nodes.end(), first_new),
        change_.switched_nodes.end());
    sort_unique(change_.triangles);
  }
  [[nodiscard]] std::size_t first_new_copy() const { return hex_.hex_count() - change_.new_copies.size(); }

  const CollisionMesh& mesh_;
  HexMesh& hex_;
  Work& s_;
  LatticeChange& change_;

  std::uint64_t touched_ = 0, reshaped_ = 0, analysed_ = 0, cached_ = 0;
  std::size_t old_vertex_count_ = 0, old_triangle_count_ = 0;
};

}  // namespace

LatticeScratch::LatticeScratch() : work(std::make_unique<Work>()) {}
LatticeScratch::~LatticeScratch() = default;
LatticeScratch::LatticeScratch(const LatticeScratch&) : LatticeScratch() {}
LatticeScratch::LatticeScratch(LatticeScratch&& other) noexcept : work(std::move(other.work)) {}
LatticeScratch& LatticeScratch::operator=(LatticeScratch other) noexcept {
  work.swap(other.work);
  return *this;
}

void LatticeChange::clear() {
  new_copies.clear();
  dead_copies.clear();
  changed_copies.clear();
  new_nodes.clear();
  joined_nodes.clear();
  switched_nodes.clear();
  triangles.clear();
  tips_changed = false;
}

void adapt_lattice(const CollisionMesh& mesh, HexMesh& hex, std::span<const CollisionTriangle> changed,
                   LatticeScratch& scratch, LatticeChange& change) {
  Adapter(mesh, hex, *scratch.work, change).run(changed);
}

void changed_triangles(const CollisionMesh& mesh, const CollisionMark& since, std::vector<CollisionTriangle>& out) {
  out.clear();
  mesh.origin.for_each_changed(since.origin, [&](CollisionHalfEdge h) { out.push_back(CollisionMesh::face(h)); });
  mesh.twin.for_each_changed(since.twin, [&](CollisionHalfEdge h) { out.push_back(CollisionMesh::face(h)); });
  for (std::size_t h = since.origin.size; h < mesh.half_edge_count(); h += 3)
    out.push_back(CollisionMesh::face(CollisionHalfEdge(h)));
  sort_unique(out);
}

}  // namespace kerf
