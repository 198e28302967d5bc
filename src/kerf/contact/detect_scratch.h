// What the parts of detection share during one call.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/contact/clearance.h"
#include "kerf/contact/detect.h"
#include "kerf/contact/edge_block.h"
#include "kerf/contact/leaf_boxes.h"
#include "kerf/contact/quiet.h"
#include "kerf/contact/rest_neighbours.h"
#include "kerf/contact/rim.h"
#include "kerf/contact/shape_features.h"

namespace kerf {

/// A body during one call.
struct BodyFrame {
  TreeBoxes boxes;
  std::vector<TreeBox> directions;  ///< per node; for contacts between bodies
  std::vector<TreeCorner> unit;     ///< per vertex: direction and length of its offset
  std::vector<Vec3> normals;        ///< per face, unit or zero; empty for a body without coarse triangles
  std::vector<double> thickness;    ///< per vertex: length of its offset, m
  std::vector<double> travel;       ///< per vertex: length of predicted - position, m
  std::vector<double> sway;         ///< the same less the body's mean motion
  mutable RimMemory rims;           ///< lips.h
  double greatest_travel = 0, greatest_sway = 0, greatest_offset = 0;
};

/// A direction counts as pointing off a face up to this cosine: the normal cone of an edge, widened by 10 degrees.
inline constexpr double kOffFaces = 0.17;

/// One body of the call, as its parts see it.
struct BodyView {
  std::int32_t index = 0;
  const SurfaceState& state;
  const ContactSurface& surface;
  const BodyFrame& frame;

  [[nodiscard]] Vec3 position(CollisionVertex v) const { return state.position[v.index()]; }
  [[nodiscard]] Vec3 offset(CollisionVertex v) const { return state.offset[v.index()]; }
  [[nodiscard]] Vec3 travel(CollisionVertex v) const { return state.predicted[v.index()] - state.position[v.index()]; }
  /// Unit, or zero for a triangle without area.
  [[nodiscard]] Vec3 normal(CollisionTriangle f) const {
    if (!frame.normals.empty()) return frame.normals[f.index()];
    const auto v = surface.vertices(f);
    return normalized(cross(position(v[1]) - position(v[0]), position(v[2]) - position(v[0])));
  }
  [[nodiscard]] std::array<Vec3, 3> corners(CollisionTriangle f) const {
    const auto v = surface.vertices(f);
    return {position(v[0]), position(v[1]), position(v[2])};
  }
  /// Unit, in its face, from edge h into the face; zero for a degenerate face.
  [[nodiscard]] Vec3 into(CollisionHalfEdge h) const {
    return normalized(cross(normal(ContactSurface::face(h)), position(surface.to(h)) - position(surface.from(h))));
  }
  /// Is a direction (unit, from a point of edge h) off both faces of the edge, or nearly?
  [[nodiscard]] bool off_faces(CollisionHalfEdge h, Vec3 direction, double most = kOffFaces) const;
};

/// A point of a body with everything that moves along.
struct BodyPoint {
  SurfacePoint where;  ///< on the mid-surface
  Vec3 position, offset, travel;
  CollisionTriangle face;  ///< that an edge's or a face's point is on; of a vertex: none
};
BodyPoint vertex_point(const BodyView& body, CollisionVertex v);
BodyPoint edge_point(const BodyView& body, CollisionHalfEdge h, double t);
BodyPoint face_point(const BodyView& body, CollisionTriangle f, const std::array<double, 3>& weight);
/// The corner opposite to which a foot with these weights lies if it is inside an edge; else -1.
int opposite_corner(const std::array<double, 3>& weight);
inline bool is_inside(const std::array<double, 3>& weight) { return weight[0] > 0 && weight[1] > 0 && weight[2] > 0; }

/// A point of a shape near a triangle of a body.
struct FaceCandidate {
  ShapePoint point;
  double distance = 0;  ///< from the point to its foot, m
  CollisionTriangle face;
  std::array<double, 3> weight;  ///< of the foot
  bool interior = false;         ///< of the face; else of an edge
  Vec3 direction;                ///< unit, up to its sign: of the face's normal, or from the point to its foot
};

/// How the vertices of a leaf strayed, and how far an offset did at most, m.
struct StrayBox {
  Vec3 least, most;
  double turn = -1;  ///< negative: not known yet
};

/// Which keys are in the memory, roughly: most that are asked for are not.
struct KeySieve {
  static constexpr std::size_t kWords = 128;
  std::array<std::uint64_t, kWords> bits{};
  void add(std::uint64_t key) { bits[key / 64 % kWords] |= std::uint64_t{1} << key % 64; }
  [[nodiscard]] bool may_have(std::uint64_t key) const { return (bits[key / 64 % kWords] >> key % 64 & 1) != 0; }
};

/// A node of one tree and a list of nodes of another.
struct TreeTask {
  std::uint32_t node, begin, end;
};

/// A vertex of a body in the frame of a mesh.
struct PlacedVertex {
  Vec3 local;
  double least = 0;        ///< the mesh is so far away at least, m
  std::uint64_t call = 0;  ///< of detect_mesh
};

/// A coarse face of a body, or one beside it, in the frame of a mesh.
struct MeshFace {
  CollisionTriangle face;
  std::array<Vec3, 3> local;     ///< corners
  std::array<double, 3> least;   ///< how far they are from the mesh at least, m
  std::array<double, 3> length;  ///< of the edges from them, m
  double reach;                  ///< m
  /// Has it nothing within reach? No place of a triangle is farther from all corners than its longest edge over the root of three.
  [[nodiscard]] bool is_clear() const {
    return std::min({least[0], least[1], least[2]}) - std::sqrt(1.0 / 3) * std::max({length[0], length[1], length[2]}) >
           reach;
  }
  [[nodiscard]] bool is_clear(std::size_t edge) const {
    return 0.5 * (least[edge] + least[(edge + 1) % 3] - length[edge]) > reach;
  }
};

struct DetectScratch {
  std::vector<BodyFrame> bodies;
  std::vector<std::uint32_t> leaves;                ///< near a part
  std::vector<std::array<std::uint32_t, 2>> pairs;  ///< stack of traversals
  std::vector<std::uint32_t> stack;
  std::vector<TreeTask> tasks;
  std::vector<Contact> found;                 ///< as they come
  std::vector<RememberedContact> remembered;  ///< in parallel
  KeySieve sieve;                             ///< of the memory that this call is given
  struct FoundKey {
    std::uint64_t key = 0;
    std::uint32_t found = 0;
  };
  std::vector<FoundKey> order;  ///< by key, and memory to sort it
  std::vector<std::uint32_t> order_begin;
  ShapeFeatures features;
  std::vector<FaceCandidate> faces;
  std::vector<LeafPair> leaf_pairs, sorted_pairs;  ///< near each other, by the first
  std::vector<StrayBox> strays;                    ///< per leaf
  std::vector<LeafPair> leaf_list;                 ///< of a mesh (the second), near a place
  NeighbourSearch neighbours;
  std::vector<QuietBody> quiet;            ///< per body
  LeafBoxes leaf_faces;                    ///< of the body whose faces are tested
  LeafEdges leaf_edges, other_leaf_edges;  ///< coarse ones, each in its owner's leaf
  std::vector<LeafBlock> partners;         ///< second leaves of the group of pairs at work; none: not listed yet
  struct NearFace {
    CollisionTriangle face;
    bool rims, test, hang_together;  ///< look for rims on it, test it, are its leaf and the vertex's neighbours
  };
  std::vector<NearFace> near_faces;   ///< of the vertex at work
  std::vector<EdgeBlock> mesh_edges;  ///< of a mesh, near a leaf
  std::vector<PointBlock> mesh_points;
  std::vector<MeshFace> mesh_faces;   ///< of the leaf at work, that may have something within reach
  std::vector<Clearance> clearances;  ///< per body and mesh, in the order that they are asked
  std::size_t meshes = 0;             ///< asked so far in this call
  std::vector<PlacedVertex> placed;   ///< of the body that a mesh is asked about
  std::uint64_t mesh_calls = 0;       ///< ever: tells what in `placed` is of this mesh
};

/// Everything one call works on.
struct DetectRun {
  std::span<const SurfaceState> bodies;
  const DetectOptions& options;
  const DetectMemory& before;
  DetectScratch& scratch;
  DetectReport& report;
  double margin = 0;  ///< m
};

enum class ContactKind : std::uint8_t {
  kVertexShape,
  kFaceShape,
  kEdgeShape,
  kVertexFace,
  kEdgeEdge,
  kLip,
  kFlank,
  kWall,
  kSunkWall,
  kSideShape
};

/// Who touches whom, in one number: features by their ids, mixed so that different contacts have different keys.
struct ContactName {
  ContactKind kind = ContactKind::kVertexShape;
  std::int32_t slot = 0;             ///< tells several contacts of the same features apart
  std::int32_t body = 0, other = 0;  ///< other: body, or obstacle, or -1 - tool
  std::int32_t part = 0;
  std::int32_t feature = 0, other_feature = 0;
};
std::uint64_t contact_key(const ContactName& name);

/// What the last step knew under this key, or none.
const RememberedContact* recall(const DetectRun& run, std::uint64_t key);

/// A shape of the scene: an obstacle or a tool.
struct ShapeRef {
  const RigidShape* shape = nullptr;
  std::int32_t obstacle = -1, tool = -1;
  [[nodiscard]] std::int32_t other() const { return obstacle >= 0 ? obstacle : -1 - tool; }
};

/// The memory of a contact that hand_out_shape was given, by whichever end it touched; null if there is none.
const RememberedContact* recall_either_end(const DetectRun& run, ContactName name);

/// Fills scratch.leaves with the leaves of a body's tree that come within `reach` metres of a part; not for meshes.
void find_leaves(const SurfaceTree& tree, const TreeBoxes& boxes, const PlacedPart& part, double reach,
                 DetectScratch& scratch);

/// Along the normal a contact counts with what both sides will approach by, and with this part of the rest: directions
/// change on the way.
inline constexpr double kSideways = 0.3, kApproach = 1 + kSideways;

/// Gap below which a contact is worth handing out: the margin and what both sides may approach by in this step.
inline double gap_limit(const DetectRun& run, Vec3 normal, Vec3 relative_travel) {
  const double closing = -dot(normal, relative_travel);
  return run.margin + (closing > 0 ? closing : 0) + kSideways * norm(relative_travel + closing * normal);
}

inline BodyView view(const DetectRun& run, std::int32_t body) {
  const auto b = static_cast<std::size_t>(body);
  return {body, run.bodies[b], *run.bodies[b].surface, run.scratch.bodies[b]};
}

/// Hands out a contact: `contact` needs a, b, point, normal, gap. `allowed`: RememberedContact::allowed, in the gap already.
void hand_out(DetectRun& run, std::uint64_t key, const Contact& contact, std::int32_t feature, double radius,
              double allowed = 0);

/// The same for a shape: fills in whose it is, velocity and friction. The slot is doubled, to tell the ends apart: the end
/// of the prism nearer to the shape is taken, or both if they are about as near. `distance`: of a's mid-surface point from
/// `point` along the normal.
void hand_out_shape(DetectRun& run, ContactName name, const ShapeRef& shape, const BodyPoint& a, Vec3 point,
                    Vec3 normal, double distance, std::int32_t feature);

/// The same for a point of a body's sides, as it is carried.
void hand_out_place(DetectRun& run, std::uint64_t key, const ShapeRef& shape, const BodyPoint& a, const SidePoint& at,
                    Vec3 place, Vec3 travel, const Proximity& nearest);

/// The same between two points of bodies: fills in b, where they touch and how far apart. Lifts as given. Nothing happens if
/// they won't come near.
void hand_out_pair(DetectRun& run, const ContactName& name, const BodyPoint& a, double lift_a, const BodyPoint& b,
                   double lift_b, Vec3 normal, std::int32_t feature);
/// How far apart two points of bodies are along n (unit, from b to a), thickness included, m.
inline double prism_gap(const BodyPoint& a, const BodyPoint& b, Vec3 n) {
  return dot(n, a.position - b.position) - std::fabs(dot(n, a.offset)) - std::fabs(dot(n, b.offset));
}

/// Orders pairs by the first, then the second.
inline bool by_first(const std::array<std::uint32_t, 2>& a, const std::array<std::uint32_t, 2>& b) {
  return (std::uint64_t{a[0]} << 32 | a[1]) < (std::uint64_t{b[0]} << 32 | b[1]);
}

/// Are two boxes of mid-surface so far to the side of each other, as seen along their offsets, that no gap between them is
/// below `limit`? A gap is |d| - |d . o| / |d| - |d . o'| / |d|, and the boxes bound every part of it.
bool side_by_side(const TreeBox& a, const TreeBox& a_directions, const TreeBox& b, const TreeBox& b_directions,
                  float limit);

/// Fills scratch.leaf_pairs with pairs of leaves (of a, of b) whose mid-surfaces come within `reach` and that may have a gap
/// below `approach`, by the first. For a body with itself both orders of every pair, without what hangs together and is hardly
/// bent.
void find_leaf_pairs(const BodyView& a, const BodyView& b, double reach, double approach, DetectScratch& scratch);

/// Leaves out of them those that have not strayed towards each other by more than `least`, m.
void leave_out_foreseen(const BodyView& body, const Strayed& strayed, double least, DetectScratch& scratch);

/// A body with itself or with another one: vertices against faces, both ways, lips of cuts, and coarse edges against each
/// other.
void detect_bodies(DetectRun& run, std::int32_t a, std::int32_t b);

}  // namespace kerf
