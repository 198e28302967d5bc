// Corners and edges of rigid shapes against faces and edges of a body: only where its triangles are coarse, so that
// something can touch them between their vertices.
#include <algorithm>
#include <cmath>

#include "kerf/contact/detect_scratch.h"
#include "kerf/contact/segment_queries.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Most contacts of one point of a shape: layers that it lies between, from different directions.
constexpr std::size_t kMostLayers = 3;
/// The same for directions that point away from the faces of a shape.
constexpr double kAway = 0.17;

/// What all of this works on.
struct Near {
  DetectRun& run;
  const BodyView& body;
  const ShapeRef& shape;
  std::int32_t part;
  double shape_travel;

  [[nodiscard]] double reach(V v) const {
    return norm(body.offset(v)) + run.margin + kApproach * (body.frame.travel[v.index()] + shape_travel);
  }
};

void offer_point(const Near& near, F f, const std::array<Vec3, 3>& corner, double reach, const ShapePoint& point) {
  ClosestPoint foot;
  closest_point(point.p, corner, foot);
  if (!(foot.distance - point.radius < reach)) return;
  FaceCandidate c;
  c.point = point;
  c.distance = foot.distance;
  c.face = f;
  c.weight = foot.barycentric;
  c.interior = is_inside(foot.barycentric);
  if (c.interior) {
    c.direction = near.body.normal(f);
  } else {
    const int opposite = opposite_corner(foot.barycentric);
    if (opposite < 0 || !(foot.distance > 0)) return;  // a vertex: it looks for itself
    const H h = ContactSurface::corner(f, (opposite + 1) % 3), g = near.body.surface.twin[h];
    // The edge's other face has the same foot.
    if (g.valid() && g < h && near.body.surface.coarse[ContactSurface::face(g)] != 0) return;
    c.direction = (1 / foot.distance) * (foot.point - point.p);
    if (!near.body.off_faces(h, -c.direction)) return;
  }
  if (!(norm(c.direction) > 0.5)) return;  // a face without area
  near.run.scratch.faces.push_back(c);
}

/// On which side of a candidate the point lies: by the last step, else by where it is.
double side_of(const Near& near, const FaceCandidate& c, std::span<const RememberedContact* const> remembered,
               bool& known) {
  known = false;
  const auto corner = near.body.surface.vertices(c.face);
  for (const RememberedContact* r : remembered) {
    if (r == nullptr || r->feature < 0 || static_cast<std::size_t>(r->feature) >= near.body.surface.face_count()) continue;
    const auto old = near.body.surface.vertices(F(r->feature));
    const bool neighbours = std::find_first_of(corner.begin(), corner.end(), old.begin(), old.end()) != corner.end();
    const double along = dot(r->normal, c.direction);
    if (!neighbours || std::fabs(along) < 0.5) continue;
    known = true;
    return along < 0 ? -1 : 1;
  }
  if (!c.interior) return 1;
  const double along = dot(face_point(near.body, c.face, c.weight).position - c.point.p, c.direction);
  if (along == 0) return dot(c.point.outward, c.direction) < 0 ? -1 : 1;
  return along < 0 ? -1 : 1;
}

/// Contacts of one point: the nearest face, and those that it sees in clearly other directions.
void hand_out_point(const Near& near, std::span<const FaceCandidate> candidates) {
  constexpr double kOtherDirection = 0.5;  // cosine
  ContactName name{ContactKind::kFaceShape, 0, near.body.index, near.shape.other(), near.part, candidates[0].point.id, 0};
  std::array<const RememberedContact*, kMostLayers> remembered{};
  for (std::size_t i = 0; i < kMostLayers; ++i) {
    name.slot = static_cast<std::int32_t>(i);
    remembered[i] = recall_either_end(near.run, name);
  }
  std::array<Vec3, kMostLayers> taken;
  std::array<bool, kMostLayers> used{};
  std::size_t count = 0;
  for (const FaceCandidate& c : candidates) {
    bool known = false;
    const double side = side_of(near, c, remembered, known);
    const Vec3 n = side * c.direction;
    // The far side of a thin shape sees the body through the shape.
    if (!known && dot(n, c.point.outward) < -0.2) continue;
    bool other = true;
    for (std::size_t i = 0; i < count; ++i) other = other && dot(taken[i], n) < kOtherDirection;
    if (!other) continue;
    // A layer keeps its slot.
    std::size_t slot = kMostLayers;
    for (std::size_t i = 0; i < kMostLayers && slot == kMostLayers; ++i)
      if (!used[i] && remembered[i] != nullptr && dot(remembered[i]->normal, n) > kOtherDirection) slot = i;
    for (std::size_t i = 0; i < kMostLayers && slot == kMostLayers; ++i)
      if (!used[i] && remembered[i] == nullptr) slot = i;
    for (std::size_t i = 0; i < kMostLayers && slot == kMostLayers; ++i)
      if (!used[i]) slot = i;
    used[slot] = true;
    taken[count++] = n;

    const BodyPoint foot = face_point(near.body, c.face, c.weight);
    name.slot = static_cast<std::int32_t>(slot);
    hand_out_shape(near.run, name, near.shape, foot, c.point.p + c.point.radius * n, n,
                   dot(foot.position - c.point.p, n) - c.point.radius, c.face.value);
    if (count == kMostLayers) return;
  }
}

void test_edges(const Near& near, H h, const ShapeEdge& edge) {
  const V v = near.body.surface.from(h), w = near.body.surface.to(h);
  const Vec3 a = near.body.position(v), b = near.body.position(w);
  const double reach = std::max(near.reach(v), near.reach(w)) + edge.radius;
  for (int k = 0; k < 3; ++k)
    if (std::fmin(a[k], b[k]) > std::fmax(edge.a[k], edge.b[k]) + reach ||
        std::fmax(a[k], b[k]) < std::fmin(edge.a[k], edge.b[k]) - reach)
      return;
  const SegmentPair feet = closest_of_segments(a, b, edge.a, edge.b);
  if (!feet.inside()) return;  // vertices look for themselves
  const Vec3 foot = lerp(a, b, feet.s), other = lerp(edge.a, edge.b, feet.t), d = foot - other;
  const double size = norm(d);
  if (!(size < reach)) return;
  ContactName name{ContactKind::kEdgeShape, 0, near.body.index, near.shape.other(), near.part, h.value, edge.id};
  // Across both edges, whichever way the distance points: that may be nothing but rounding.
  const Vec3 across = cross(b - a, edge.b - edge.a);
  Vec3 n = size > 1e-9 * (norm(b - a) + norm(edge.b - edge.a)) ? (1 / size) * d : normalized(across);
  if (!(norm(n) > 0.5)) return;
  if (dot(edge.outward, edge.outward) > 0) {
    if (dot(n, edge.outward) < 0) n = -n;
  } else if (const RememberedContact* r = recall_either_end(near.run, name); r != nullptr && dot(r->normal, n) < 0) {
    n = -n;
  }
  if (dot(n, edge.into[0]) > kAway || dot(n, edge.into[1]) > kAway || !near.body.off_faces(h, -n)) return;
  hand_out_shape(near.run, name, near.shape, edge_point(near.body, h, feet.s), other + edge.radius * n, n,
                 dot(d, n) - edge.radius, -1);
}

bool is_coarse(const ContactSurface& s, H h) { return h.valid() && s.coarse[ContactSurface::face(h)] != 0; }

}  // namespace

void detect_features(DetectRun& run, const BodyView& body, const ShapeRef& shape, std::int32_t part,
                     const PlacedPart& placed) {
  const ContactSurface& surface = body.surface;
  const Near near{run, body, shape, part, run.options.step * greatest_speed(*shape.shape)};
  const bool mesh = placed.part->kind == PartKind::kMesh;
  ShapeFeatures& features = run.scratch.features;
  auto& faces = run.scratch.faces;
  faces.clear();
  if (!mesh) all_features(placed, features);
  if (!mesh && features.points.empty()) return;
  for (const std::uint32_t leaf : run.scratch.leaves)
    surface.tree.for_each_triangle(leaf, [&](F f) {
      const std::array<H, 3> h{ContactSurface::corner(f, 0), ContactSurface::corner(f, 1), ContactSurface::corner(f, 2)};
      const bool coarse = surface.coarse[f] != 0;
      if (!coarse && !is_coarse(surface, surface.twin[h[0]]) && !is_coarse(surface, surface.twin[h[1]]) &&
          !is_coarse(surface, surface.twin[h[2]]))
        return;
      const auto v = surface.vertices(f);
      const std::array<Vec3, 3> corner = body.corners(f);
      const double reach = std::max({near.reach(v[0]), near.reach(v[1]), near.reach(v[2])});
      if (mesh) mesh_features(placed, corner, reach, features);
      if (coarse)
        for (const ShapePoint& p : features.points) offer_point(near, f, corner, reach, p);
      for (const H e : h)
        if (surface.owns_edge(e) && (coarse || is_coarse(surface, surface.twin[e])))
          for (const ShapeEdge& edge : features.edges) test_edges(near, e, edge);
    });
  std::sort(faces.begin(), faces.end(), [](const FaceCandidate& a, const FaceCandidate& b) {
    if (a.point.id != b.point.id) return a.point.id < b.point.id;
    return a.distance != b.distance ? a.distance < b.distance : a.face < b.face;
  });
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end].point.id == faces[i].point.id) ++end;
    hand_out_point(near, std::span(faces).subspan(i, end - i));
    i = end;
  }
}

}  // namespace kerf
