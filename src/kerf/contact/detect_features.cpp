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

/// A direction counts as pointing away from a face up to this cosine: both sides of an edge's normal cone, widened.
constexpr double kAway = 0.17;
/// Most contacts of one point of a shape: layers that it lies between, from different directions.
constexpr std::size_t kMostLayers = 3;

/// The pieces of one body that all of this works on.
struct Near {
  DetectRun& run;
  std::int32_t body;
  const ShapeRef& shape;
  std::int32_t part;
  const SurfaceState& state;
  const ContactSurface& surface;
  const BodyFrame& frame;
  double shape_travel;

  [[nodiscard]] Vec3 position(V v) const { return state.position[v.index()]; }
  [[nodiscard]] Vec3 offset(V v) const { return state.offset[v.index()]; }
  [[nodiscard]] Vec3 travel(V v) const { return state.predicted[v.index()] - state.position[v.index()]; }
  [[nodiscard]] double reach(V v) const {
    return norm(offset(v)) + run.margin + kApproach * (frame.travel[v.index()] + shape_travel);
  }
  [[nodiscard]] Vec3 normal(F f) const {
    const auto v = surface.vertices(f);
    return normalized(cross(position(v[1]) - position(v[0]), position(v[2]) - position(v[0])));
  }
  /// Unit, in face f, from edge h into it; zero for a degenerate face.
  [[nodiscard]] Vec3 into(H h) const {
    return normalized(cross(normal(ContactSurface::face(h)), position(surface.to(h)) - position(surface.from(h))));
  }
  /// Is the direction (unit, from a point of edge h) off both faces of the edge?
  [[nodiscard]] bool off_faces(H h, Vec3 direction) const {
    if (dot(direction, into(h)) > kAway) return false;
    const H g = surface.twin[h];
    return !g.valid() || dot(direction, into(g)) <= kAway;
  }
};

SurfacePoint face_point(const Near& near, F f, const std::array<double, 3>& weight) {
  SurfacePoint a;
  a.body = near.body;
  a.vertex = near.surface.vertices(f);
  a.weight = weight;
  return a;
}

/// The corner opposite to which the foot lies, if it lies on an edge; else -1.
int edge_of(const std::array<double, 3>& weight) {
  int zeros = 0, at = -1;
  for (int i = 0; i < 3; ++i)
    if (!(weight[static_cast<std::size_t>(i)] > 0)) ++zeros, at = i;
  return zeros == 1 ? at : -1;
}

void offer_point(const Near& near, F f, const std::array<Vec3, 3>& corner, double reach, const ShapePoint& point) {
  ClosestPoint foot;
  closest_point(point.p, corner, foot);
  if (!(foot.distance - point.radius < reach)) return;
  FaceCandidate c;
  c.point = point;
  c.distance = foot.distance;
  c.face = f;
  c.weight = foot.barycentric;
  c.interior = foot.barycentric[0] > 0 && foot.barycentric[1] > 0 && foot.barycentric[2] > 0;
  if (c.interior) {
    c.direction = near.normal(f);
  } else {
    const int opposite = edge_of(foot.barycentric);
    if (opposite < 0 || !(foot.distance > 0)) return;  // a vertex: it looks for itself
    const H h = ContactSurface::corner(f, (opposite + 1) % 3), g = near.surface.twin[h];
    // The edge's other face has the same foot.
    if (g.valid() && g < h && near.surface.coarse[ContactSurface::face(g)] != 0) return;
    c.direction = (1 / foot.distance) * (foot.point - point.p);
    if (!near.off_faces(h, -c.direction)) return;
  }
  if (!(norm(c.direction) > 0.5)) return;  // a face without area
  near.run.scratch.faces.push_back(c);
}

/// On which side of a candidate the point lies: by the last step, else by where it is.
double side_of(const Near& near, const FaceCandidate& c, std::span<const RememberedContact* const> remembered,
               bool& known) {
  known = false;
  const auto corner = near.surface.vertices(c.face);
  for (const RememberedContact* r : remembered) {
    if (r == nullptr || r->feature < 0 || static_cast<std::size_t>(r->feature) >= near.surface.face_count()) continue;
    const auto old = near.surface.vertices(F(r->feature));
    const bool neighbours = std::find_first_of(corner.begin(), corner.end(), old.begin(), old.end()) != corner.end();
    const double along = dot(r->normal, c.direction);
    if (!neighbours || std::fabs(along) < 0.5) continue;
    known = true;
    return along < 0 ? -1 : 1;
  }
  if (!c.interior) return 1;
  Vec3 foot;
  for (std::size_t i = 0; i < 3; ++i) foot += c.weight[i] * near.position(corner[i]);
  const double along = dot(foot - c.point.p, c.direction);
  if (along == 0) return dot(c.point.outward, c.direction) < 0 ? -1 : 1;
  return along < 0 ? -1 : 1;
}

/// Contacts of one point: the nearest face, and those that it sees in clearly other directions.
void hand_out_point(const Near& near, std::span<const FaceCandidate> candidates) {
  constexpr double kOtherDirection = 0.5;  // cosine
  ContactName name{ContactKind::kFaceShape, 0, near.body, near.shape.other(), near.part, candidates[0].point.id, 0};
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

    const auto v = near.surface.vertices(c.face);
    Vec3 foot, offset, travel;
    for (std::size_t i = 0; i < 3; ++i) {
      foot += c.weight[i] * near.position(v[i]);
      offset += c.weight[i] * near.offset(v[i]);
      travel += c.weight[i] * near.travel(v[i]);
    }
    name.slot = static_cast<std::int32_t>(slot);
    const double along = dot(foot - c.point.p, n);
    hand_out_shape(near.run, name, near.shape, face_point(near, c.face, c.weight), offset, travel,
                   c.point.p + c.point.radius * n, n, along - c.point.radius, c.face.value);
    if (count == kMostLayers) return;
  }
}

void test_edges(const Near& near, H h, const ShapeEdge& edge) {
  const V v = near.surface.from(h), w = near.surface.to(h);
  const Vec3 a = near.position(v), b = near.position(w);
  const double reach = std::max(near.reach(v), near.reach(w)) + edge.radius;
  for (int k = 0; k < 3; ++k)
    if (std::fmin(a[k], b[k]) > std::fmax(edge.a[k], edge.b[k]) + reach ||
        std::fmax(a[k], b[k]) < std::fmin(edge.a[k], edge.b[k]) - reach)
      return;
  const SegmentPair feet = closest_of_segments(a, b, edge.a, edge.b);
  if (!(feet.s > 0 && feet.s < 1 && feet.t > 0 && feet.t < 1)) return;  // vertices look for themselves
  const Vec3 foot = lerp(a, b, feet.s), other = lerp(edge.a, edge.b, feet.t), d = foot - other;
  const double size = norm(d);
  if (!(size < reach)) return;
  ContactName name{ContactKind::kEdgeShape, 0, near.body, near.shape.other(), near.part, h.value, edge.id};
  // Across both edges, whichever way the distance points: that may be nothing but rounding.
  const Vec3 across = cross(b - a, edge.b - edge.a);
  Vec3 n = size > 1e-9 * (norm(b - a) + norm(edge.b - edge.a)) ? (1 / size) * d : normalized(across);
  if (!(norm(n) > 0.5)) return;
  if (dot(edge.outward, edge.outward) > 0) {
    if (dot(n, edge.outward) < 0) n = -n;
  } else if (const RememberedContact* r = recall_either_end(near.run, name); r != nullptr && dot(r->normal, n) < 0) {
    n = -n;
  }
  if (dot(n, edge.into[0]) > kAway || dot(n, edge.into[1]) > kAway || !near.off_faces(h, -n)) return;
  SurfacePoint p;
  p.body = near.body;
  p.vertex = {v, w, V()};
  p.weight = {1 - feet.s, feet.s, 0};
  hand_out_shape(near.run, name, near.shape, p, lerp(near.offset(v), near.offset(w), feet.s),
                 lerp(near.travel(v), near.travel(w), feet.s), other + edge.radius * n, n, dot(d, n) - edge.radius,
                 -1);
}

bool is_coarse(const ContactSurface& s, H h) { return h.valid() && s.coarse[ContactSurface::face(h)] != 0; }

}  // namespace

void detect_features(DetectRun& run, std::int32_t body, const ShapeRef& shape, std::int32_t part,
                     const PlacedPart& placed) {
  const SurfaceState& state = run.bodies[static_cast<std::size_t>(body)];
  const ContactSurface& surface = *state.surface;
  const Near near{run, body, shape, part, state, surface, run.scratch.bodies[static_cast<std::size_t>(body)],
                  run.options.step * greatest_speed(*shape.shape)};
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
      const std::array<Vec3, 3> corner{near.position(v[0]), near.position(v[1]), near.position(v[2])};
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
