#include "kerf/contact/rest_neighbours.h"

#include <algorithm>
#include <cmath>

#include "kerf/contact/triangle_foot.h"
#include "kerf/mesh/union_find.h"

namespace kerf {
namespace {

using V = ContactSurface::V;
using H = ContactSurface::H;
using F = ContactSurface::F;

std::array<Vec3, 3> rest_corners(const ContactSurface& s, F f) {
  const auto v = s.vertices(f);
  return {s.rest[v[0]], s.rest[v[1]], s.rest[v[2]]};
}

/// Pieces of the body that don't hang together, by root triangle: the smallest root of each.
std::vector<std::int32_t> pieces(const ContactSurface& s) {
  UnionFind sets(s.root_corner.size());
  for (const H h : ids<H>(s.twin.size()))
    if (s.twin[h].valid())
      sets.join(s.root[ContactSurface::face(h)].value, s.root[ContactSurface::face(s.twin[h])].value);
  std::vector<std::int32_t> piece(s.root_corner.size());
  for (std::size_t r = 0; r < piece.size(); ++r) piece[r] = sets.root(static_cast<std::int32_t>(r));
  return piece;
}

/// Calls visit(node) for every node whose rest box comes within `distance` of a box.
template <class Visit>
void for_nodes_near(const ContactSurface& s, const TreeBox& box, double distance, Visit&& visit) {
  if (s.rest_boxes.box.empty()) return;
  std::vector<std::uint32_t> stack{0};
  const auto r = static_cast<float>(distance);
  while (!stack.empty()) {
    const std::uint32_t n = stack.back();
    stack.pop_back();
    if (!near(s.rest_boxes.box[n], box, r)) continue;
    visit(n);
    const SurfaceTreeNode node = s.tree.nodes[n];
    if (node.count > 0) continue;
    stack.push_back(node.first + 1);
    stack.push_back(node.first);
  }
}

double reach(const ContactSurface& s) { return 2 * kNeighbour * s.largest_radius + s.rest_boxes.slack; }

}  // namespace

double neighbour_distance(const ContactSurface& s, V v, F f) {
  const auto c = s.vertices(f);
  return kNeighbour * (s.radius[v] + std::max({s.radius[c[0]], s.radius[c[1]], s.radius[c[2]]}));
}

double rest_distance(const ContactSurface& s, V v, F f) {
  return std::sqrt(nearest_foot(s.rest[v], rest_corners(s, f)).square);
}

namespace {

void flood(const ContactSurface& s, V v, NeighbourSearch& search) {
  search.queue.clear();
  const auto add = [&](F f) {
    search.stamp[f.index()] = search.round;
    search.queue.push_back(f);
  };
  // Its fan, both ways round from any half-edge.
  const H start = s.outgoing[v];
  H h = start;
  do {
    add(ContactSurface::face(h));
    h = s.twin[ContactSurface::prev(h)];
  } while (h.valid() && h != start);
  if (!h.valid())
    for (H g = s.twin[start]; g.valid(); g = s.twin[g]) {
      g = ContactSurface::next(g);
      add(ContactSurface::face(g));
    }
  for (std::size_t i = 0; i < search.queue.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const H g = s.twin[ContactSurface::corner(search.queue[i], k)];
      if (!g.valid()) continue;
      const F f = ContactSurface::face(g);
      if (search.stamp[f.index()] == search.round) continue;
      if (is_clear_neighbour(s, v, f) || rest_distance(s, v, f) <= neighbour_distance(s, v, f)) add(f);
    }
}

/// Leaves out what is no longer known, when that is most of it.
void tidy(NeighbourSearch& search) {
  if (search.found.size() < 2 * search.live + 1024) return;
  search.kept.clear();
  for (NeighbourSearch::Known& known : search.known) {
    const auto begin = search.found.begin() + known.begin;
    known.begin = static_cast<std::uint32_t>(search.kept.size());
    search.kept.insert(search.kept.end(), begin, begin + known.count);
  }
  std::swap(search.kept, search.found);
}

}  // namespace

void find_neighbours(const ContactSurface& s, V v, NeighbourSearch& search) {
  if (search.vertex == v && search.surface == &s) return;
  if (search.surface != &s) {
    search.known.clear();
    search.found.clear();
    search.live = 0;
  }
  search.vertex = v;
  search.surface = &s;
  if (search.stamp.size() < s.face_count()) search.stamp.resize(s.face_count(), 0);
  if (++search.round == 0) {  // once in four thousand million
    std::fill(search.stamp.begin(), search.stamp.end(), 0u);
    search.round = 1;
  }
  if (search.known.size() < s.vertex_count()) search.known.resize(s.vertex_count());
  NeighbourSearch::Known& known = search.known[v.index()];
  const std::uint32_t leaf = s.root_leaf[s.root[ContactSurface::face(s.outgoing[v])]], changes = s.node_changes[leaf];
  if (known.count > 0 && known.leaf == leaf && known.changes == changes) {
    for (std::uint32_t i = known.begin; i < known.begin + known.count; ++i)
      search.stamp[search.found[i].index()] = search.round;
    return;
  }
  flood(s, v, search);
  search.live += search.queue.size() - known.count;
  known = {leaf, changes, static_cast<std::uint32_t>(search.found.size()),
           static_cast<std::uint32_t>(search.queue.size())};
  search.found.insert(search.found.end(), search.queue.begin(), search.queue.end());
  tidy(search);
}

bool is_clear_neighbour(const ContactSurface& s, V v, F f) {
  const double r = kNeighbour * s.radius[v];
  for (const V c : s.vertices(f)) {
    const Vec3 d = s.rest[c] - s.rest[v];
    const double near = r + kNeighbour * s.radius[c];
    if (dot(d, d) <= near * near) return true;
  }
  return false;
}

bool are_clear_neighbours(const ContactSurface& s, H h, H g) {
  for (const V v : {s.from(h), s.to(h)})
    for (const V w : {s.from(g), s.to(g)}) {
      const Vec3 d = s.rest[v] - s.rest[w];
      const double near = kNeighbour * (s.radius[v] + s.radius[w]);
      if (dot(d, d) <= near * near) return true;
    }
  return false;
}

int rest_relation(const ContactSurface& s, H h, H g, NeighbourSearch& search) {
  int relation = 0;
  const auto look = [&](V v, F f) {
    if (relation == 1 || rest_distance(s, v, f) > neighbour_distance(s, v, f)) return;
    find_neighbours(s, v, search);
    relation = is_neighbour(search, f) ? 1 : -1;
  };
  look(s.from(h), ContactSurface::face(g));
  look(s.to(h), ContactSurface::face(g));
  look(s.from(g), ContactSurface::face(h));
  look(s.to(g), ContactSurface::face(h));
  return relation;
}

TightFolds find_tight_folds(const ContactSurface& s) {
  constexpr double kTight = 0.1;  // of the half thickness: deeper, and detection takes it for something that has passed
  TightFolds folds;
  NeighbourSearch search;
  for (const V v : ids<V>(s.vertex_count())) {
    double deepest = 0;
    const TreeCorner p = to_corner(s.rest[v]);
    for_nodes_near(s, {p, p}, reach(s), [&](std::uint32_t leaf) {
      if (s.tree.nodes[leaf].count == 0) return;
      s.tree.for_each_triangle(leaf, [&](F f) {
        const auto corner = s.vertices(f);
        const TriangleFoot foot = nearest_foot(s.rest[v], {s.rest[corner[0]], s.rest[corner[1]], s.rest[corner[2]]});
        const auto weights = foot.weights();
        Vec3 at, offset;
        for (std::size_t k = 0; k < 3; ++k) {
          at += weights[k] * s.rest[corner[k]];
          offset += weights[k] * s.offset[corner[k]];
        }
        const double distance = std::sqrt(foot.square);
        if (!(distance > 0) || are_strangers(s, v, f)) return;
        const Vec3 n = (1 / distance) * (s.rest[v] - at);
        const double overlap = std::fabs(dot(n, s.offset[v])) + std::fabs(dot(n, offset)) - distance;
        if (overlap <= std::max(deepest, kTight * s.radius[v])) return;
        find_neighbours(s, v, search);
        if (!is_neighbour(search, f)) deepest = overlap;
      });
    });
    if (deepest == 0) continue;
    if (folds.vertices++ == 0) folds.first = s.rest[v];
    folds.overlap = std::max(folds.overlap, deepest);
  }
  return folds;
}

void make_rest_culling(ContactSurface& s) {
  refit(s.tree, s.origin.raw(), s.rest.raw(), s.rest_boxes);
  s.node_piece.assign(s.tree.nodes.size(), -1);
  s.node_thinnest.assign(s.tree.nodes.size(), HUGE_VALF);
  const std::vector<std::int32_t> piece = pieces(s);
  s.root_piece.raw() = piece;
  for (std::size_t n = s.tree.nodes.size(); n-- > 0;) {
    const SurfaceTreeNode node = s.tree.nodes[n];
    std::int32_t& mine = s.node_piece[n];
    float& thinnest = s.node_thinnest[n];
    if (node.count == 0) {
      thinnest = std::min(s.node_thinnest[node.first], s.node_thinnest[node.first + 1]);
      mine = s.node_piece[node.first] == s.node_piece[node.first + 1] ? s.node_piece[node.first] : -1;
    } else {
      mine = piece[s.tree.roots[node.first].index()];
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
        if (piece[s.tree.roots[i].index()] != mine) mine = -1;
      s.tree.for_each_triangle(static_cast<std::uint32_t>(n), [&](F f) {
        for (const V v : s.vertices(f)) thinnest = std::min(thinnest, static_cast<float>(s.radius[v] * (1 - 1e-6)));
      });
    }
  }
  // A leaf is open where a vertex has something close by that is no neighbour.
  NeighbourSearch search;
  std::vector<std::uint8_t> leaf_open(s.tree.nodes.size(), 0);
  for (std::size_t n = 0; n < s.tree.nodes.size(); ++n) {
    if (s.tree.nodes[n].count == 0) continue;
    s.tree.for_each_triangle(static_cast<std::uint32_t>(n), [&](F f) {
      for (int i = 0; i < 3; ++i) {
        if (!s.owns_vertex(ContactSurface::corner(f, i))) continue;
        const V v = s.origin[ContactSurface::corner(f, i)];
        bool searched = false;
        const TreeCorner p = to_corner(s.rest[v]);
        for_nodes_near(s, {p, p}, reach(s), [&](std::uint32_t leaf) {
          if (s.tree.nodes[leaf].count == 0 || (leaf_open[n] != 0 && leaf_open[leaf] != 0)) return;
          s.tree.for_each_triangle(leaf, [&](F g) {
            if (rest_distance(s, v, g) > neighbour_distance(s, v, g)) return;
            if (!searched) find_neighbours(s, v, search);
            searched = true;
            if (!is_neighbour(search, g)) leaf_open[n] = leaf_open[leaf] = 1;
          });
        });
      }
    });
  }
  for (std::size_t n = s.tree.nodes.size(); n-- > 0;) {
    const SurfaceTreeNode node = s.tree.nodes[n];
    s.node_open[n] = node.count > 0 ? leaf_open[n] : s.node_open[node.first] + s.node_open[node.first + 1];
  }
}

void count_cut_edge(ContactSurface& s, Vec3 a, Vec3 b, int change) {
  Box3 box;
  box.add(a);
  box.add(b);
  for_nodes_near(s, {to_corner(box.min), to_corner(box.max)}, reach(s), [&](std::uint32_t n) {
    s.node_open[n] += change;
    ++s.node_changes[n];
  });
}

bool hang_together(const ContactSurface& s, std::uint32_t n, std::uint32_t m) {
  return s.node_piece[n] >= 0 && s.node_piece[n] == s.node_piece[m] && (s.node_open[n] == 0 || s.node_open[m] == 0);
}

bool any_neighbours(const ContactSurface& s, std::uint32_t n, std::uint32_t m) {
  return n == m || near(s.rest_boxes.box[n], s.rest_boxes.box[m], static_cast<float>(reach(s)));
}

bool all_neighbours(const ContactSurface& s, std::uint32_t n, std::uint32_t m) {
  const float distance = static_cast<float>(kNeighbour) * (s.node_thinnest[n] + s.node_thinnest[m]);
  const TreeBox all = joined(s.rest_boxes.box[n], s.rest_boxes.box[m]);
  float diagonal = 0;
  for (std::size_t k = 0; k < 3; ++k) diagonal += (all.max.x[k] - all.min.x[k]) * (all.max.x[k] - all.min.x[k]);
  return diagonal < distance * distance;
}

}  // namespace kerf
