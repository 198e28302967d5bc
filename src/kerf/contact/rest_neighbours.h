// Which parts of a body are neighbours at rest, and so no business of self-contact.
//
// A face is a neighbour of a vertex if it lies within 1.2 (r_v + r_f) of it at rest and hangs together with it through faces
// that do: across a cut, a slot or between pieces there are no neighbours, however close. Tree nodes carry what lets
// whole pairs of them be skipped: boxes at rest, connected pieces, and whether anything within that distance is not a neighbour.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/contact/contact_surface.h"

namespace kerf {

inline constexpr double kNeighbour = 1.2;

/// Memory of searches in one surface; contents are private.
struct NeighbourSearch {
  /// Neighbours found earlier, good while what is near the vertex does not change.
  struct Known {
    std::uint32_t leaf = 0, changes = 0, begin = 0, count = 0;
  };
  std::vector<std::uint32_t> stamp;  ///< per face: the search that found it
  std::uint32_t round = 0;
  std::vector<CollisionTriangle> queue;
  CollisionVertex vertex;  ///< of the last search
  const void* surface = nullptr;
  std::vector<Known> known;                    ///< per vertex
  std::vector<CollisionTriangle> found, kept;  ///< what `known` points to, and memory to tidy it up
  std::size_t live = 0;                        ///< of `found`
};

/// Finds the neighbours of v: afterwards is_neighbour() answers. Cost: the faces within the distance; of a vertex that was asked about
/// before, a look at each. Between cuts (ContactSurface::node_changes) no memory is asked for once all vertices were asked about.
void find_neighbours(const ContactSurface& surface, CollisionVertex v, NeighbourSearch& search);
inline bool is_neighbour(const NeighbourSearch& search, CollisionTriangle f) {
  return search.stamp[f.index()] == search.round;
}
/// Distance at rest within which f may be a neighbour of v, m.
double neighbour_distance(const ContactSurface& surface, CollisionVertex v, CollisionTriangle f);
/// From v to f at rest, m.
double rest_distance(const ContactSurface& surface, CollisionVertex v, CollisionTriangle f);

/// Are a vertex and a face of bodies that never hung together, or of pieces that were apart from the start?
inline bool are_strangers(const ContactSurface& s, CollisionVertex v, CollisionTriangle f) {
  return s.root_piece[s.root[ContactSurface::face(s.outgoing[v])]] != s.root_piece[s.root[f]];
}
/// Where a body is closer to itself at rest than it is thick, without hanging together there: folds with too little between them.
struct TightFolds {
  std::size_t vertices = 0;
  Vec3 first;          ///< m, at rest
  double overlap = 0;  ///< m: the most
};
/// What is deeper in each other than a tenth of the half thickness: such places have no contact with each other. O(n x neighbours).
TightFolds find_tight_folds(const ContactSurface& surface);

/// Has f a corner so near to v at rest that it must be a neighbour, if the two hang together? And edges with such ends?
bool is_clear_neighbour(const ContactSurface& surface, CollisionVertex v, CollisionTriangle f);
bool are_clear_neighbours(const ContactSurface& surface, CollisionHalfEdge h, CollisionHalfEdge g);
/// Are two edges of one body near at rest, and do they hang together there (1) or not (-1)? 0: not near.
int rest_relation(const ContactSurface& surface, CollisionHalfEdge h, CollisionHalfEdge g, NeighbourSearch& search);

/// For the whole body as it is: boxes at rest, pieces, and what lies close without being neighbours. O(n x neighbours).
void make_rest_culling(ContactSurface& surface);
/// Counts a cut edge (by its ends at rest) in, +1, or out, -1, at the leaves that it comes near.
void count_cut_edge(ContactSurface& surface, Vec3 a, Vec3 b, int change);

/// Is whatever of two nodes (or of one node) lies within the distance of neighbours indeed one?
bool hang_together(const ContactSurface& surface, std::uint32_t node, std::uint32_t other);
/// May self-contact skip a pair of nodes that hang together? If all of it are neighbours, or, for nodes that are hardly bent, some.
bool all_neighbours(const ContactSurface& surface, std::uint32_t node, std::uint32_t other);
bool any_neighbours(const ContactSurface& surface, std::uint32_t node, std::uint32_t other);

}  // namespace kerf
