// Two bodies, or a body and itself: what the tests of their vertices and edges share.
#pragma once

#include <array>

#include "kerf/contact/detect_scratch.h"
#include "kerf/contact/lips.h"

namespace kerf {

/// Vertices of one body against faces of another, or of the same; and edges of both.
struct BodyPair {
  DetectRun& run;
  const BodyView& a;
  const BodyView& b;
  bool self;
  double most_sway;                                ///< of the other body
  QuietBody* quiet;                                ///< of a body with itself; else null
  std::array<std::array<LipEnd, 2>, 2>& lip_ends;  ///< of the vertex at work: of its lips' feet, upper and lower

  /// How much of a gap can still matter at a vertex of a, m.
  [[nodiscard]] double approach(CollisionVertex v) const {
    return run.margin + kApproach * ((self ? a.frame.sway[v.index()] : a.frame.travel[v.index()]) + most_sway);
  }
  /// How far from its mid-surface the other one's can be and still matter, m.
  [[nodiscard]] double reach(CollisionVertex v) const {
    return a.frame.thickness[v.index()] + b.frame.greatest_offset + approach(v);
  }
};

/// A vertex against scratch.near_faces: its rims against theirs, itself against them. Has it contacts with faces?
bool test_vertex(const BodyPair& pair, CollisionVertex v);
/// An edge of a against one of b: near each other if their mid-surfaces come within `reach` metres. Of two rims, the walls as well.
void test_edges(const BodyPair& pair, CollisionHalfEdge h, CollisionHalfEdge g, double reach);

/// All pairs of leaves by the first: its vertices against the second.
void search_vertices(const BodyPair& pair);
/// The same for coarse edges; of a body with itself each two once.
void search_edges(const BodyPair& pair, double reach, double approach);

}  // namespace kerf
