// What the parts of detection share during one call.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/contact/detect.h"
#include "kerf/contact/shape_features.h"

namespace kerf {

/// A body during one call.
struct BodyFrame {
  TreeBoxes boxes;
  std::vector<double> travel;   ///< per vertex: length of predicted - position, m
  double greatest_travel = 0, greatest_offset = 0;
};

/// A point of a shape near a triangle of a body.
struct FaceCandidate {
  ShapePoint point;
  double distance = 0;           ///< from the point to its foot, m
  CollisionTriangle face;
  std::array<double, 3> weight;  ///< of the foot
  bool interior = false;         ///< of the face; else of an edge
  Vec3 direction;                ///< unit, up to its sign: of the face's normal, or from the point to its foot
};

struct DetectScratch {
  std::vector<BodyFrame> bodies;
  std::vector<std::uint32_t> leaves;            ///< near a part
  std::vector<std::uint8_t> leaf_marked;        ///< per node of a tree; all 0 between uses
  std::vector<std::array<std::uint32_t, 2>> pairs;  ///< stack of traversals
  std::vector<std::uint32_t> stack;
  std::vector<Contact> found;                   ///< as they come
  std::vector<RememberedContact> remembered;    ///< in parallel
  std::vector<std::uint32_t> order;
  ShapeFeatures features;
  std::vector<FaceCandidate> faces;
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

enum class ContactKind : std::uint8_t { kVertexShape, kFaceShape, kEdgeShape, kVertexFace, kEdgeEdge, kLip };

/// Who touches whom, in one number: features by their ids, mixed so that different contacts have different keys.
struct ContactName {
  ContactKind kind = ContactKind::kVertexShape;
  std::int32_t slot = 0;              ///< tells several contacts of the same features apart
  std::int32_t body = 0, other = 0;   ///< other: body, or obstacle, or -1 - tool
  std::int32_t part = 0;
  std::int32_t feature = 0, other_feature = 0;
};
std::uint64_t contact_key(const ContactName& name);

/// What the last step knew under this key, or none.
const RememberedContact* recall(const DetectMemory& memory, std::uint64_t key);

/// A shape of the scene: an obstacle or a tool.
struct ShapeRef {
  const RigidShape* shape = nullptr;
  std::int32_t obstacle = -1, tool = -1;
  [[nodiscard]] std::int32_t other() const { return obstacle >= 0 ? obstacle : -1 - tool; }
};

/// The memory of a contact that hand_out_shape was given, by whichever end it touched; null if there is none.
const RememberedContact* recall_either_end(const DetectRun& run, ContactName name);

/// Fills scratch.leaves with the leaves of a body's tree that come within `reach` metres of a part, ascending.
void find_leaves(const SurfaceTree& tree, const TreeBoxes& boxes, const PlacedPart& part, double reach,
                 DetectScratch& scratch);

/// Vertices of a body against a part.
void detect_vertices(DetectRun& run, std::int32_t body, const ShapeRef& shape, std::int32_t part,
                     const PlacedPart& placed);

/// Corners and edges of a part against the faces and edges of coarse triangles.
void detect_features(DetectRun& run, std::int32_t body, const ShapeRef& shape, std::int32_t part,
                     const PlacedPart& placed);

/// Along the normal a contact counts with what both sides will approach by, and with this part of the rest: directions
/// change on the way.
inline constexpr double kSideways = 0.3, kApproach = 1 + kSideways;

/// Gap below which a contact is worth handing out: the margin and what both sides may approach by in this step.
inline double gap_limit(const DetectRun& run, Vec3 normal, Vec3 relative_travel) {
  const double closing = -dot(normal, relative_travel);
  return run.margin + (closing > 0 ? closing : 0) + kSideways * norm(relative_travel + closing * normal);
}

/// Hands out a contact: `contact` needs a, b, point, normal, gap.
void hand_out(DetectRun& run, std::uint64_t key, const Contact& contact, std::int32_t feature, double radius);

/// The same for a shape: fills in whose it is, velocity and friction. The slot is doubled, to tell the ends apart. The body's point is at `a`
/// with deformed offset `offset`: the end of the prism nearer to the shape is taken, or both if they are about as near.
/// `distance`: of the mid-surface point from `point` along the normal.
void hand_out_shape(DetectRun& run, ContactName name, const ShapeRef& shape, const SurfacePoint& a, Vec3 offset,
                    Vec3 travel, Vec3 point, Vec3 normal, double distance, std::int32_t feature);

}  // namespace kerf
