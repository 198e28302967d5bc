// Corners and edges of rigid shapes against faces and edges of a body: only where its triangles are coarse, so that
// something can touch them between their vertices.
#include <algorithm>
#include <cmath>

#include "kerf/contact/near_shape.h"
#include "kerf/contact/triangle_foot.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Most contacts of one point of a shape: layers that it lies between, from different directions.
constexpr std::size_t kMostLayers = 3;
/// Faces in directions nearer to each other than this cosine are one layer.
constexpr double kOtherDirection = 0.5;
/// Faces that a point lies above on the inner side of a crease between them count on their own from this cosine on: the ball in it comes
/// down on the farther one within a step.
constexpr double kOtherFace = 0.9;
/// A point stays with the face of the last step unless another one of that layer is nearer by this part of the half
/// thickness: under a ridge two faces are equally near, and a contact that changed between them would shake the body.
constexpr double kStayWithLayer = 0.1;
/// Faces near a ball that are asked which side of them it was on. A ball with its middle farther from the mid-surface than this part of its radius is on the side where
/// its middle is, unless they say otherwise.
constexpr std::size_t kMostRemembered = 16;
constexpr double kWellOut = 0.5;
/// kOffFaces of an edge that pressed in the last step.
constexpr double kStillOffFaces = 0.3;

/// The middle of a ball or an end of a capsule, round on all sides; else a corner.
bool is_ball(const ShapePoint& p) { return p.radius > 0 && p.outward == Vec3{}; }

ContactName point_name(const NearShape& near, const ShapePoint& point) {
  return {ContactKind::kFaceShape, 0, near.body.index, near.shape.other(), near.part, point.id, 0};
}

/// What a point touched in the last step, by slot.
using Remembered = std::array<const RememberedContact*, kMostLayers>;

Remembered recall_point(const NearShape& near, const ShapePoint& point) {
  ContactName name = point_name(near, point);
  Remembered remembered{};
  for (std::size_t i = 0; i < kMostLayers; ++i) {
    name.slot = static_cast<std::int32_t>(i);
    remembered[i] = recall_either_end(near.run, name);
  }
  return remembered;
}

/// Does the body go on all round a place on the border of a face?
bool is_inner(const ContactSurface& s, F f, const std::array<double, 3>& weight) {
  if (const int opposite = opposite_corner(weight); opposite >= 0)
    return s.twin[ContactSurface::corner(f, (opposite + 1) % 3)].valid();
  bool inner = true;
  const H corner = ContactSurface::corner(f, weight[0] > 0 ? 0 : weight[1] > 0 ? 1 : 2);
  s.for_each_outgoing(s.from(corner), [&](H h) {
    inner = s.twin[h].valid() && s.twin[ContactSurface::prev(h)].valid();
    return inner;
  });
  return inner;
}

/// Does a corner that lies beside a face, within the half thickness at rest, still press on it? Where it has crushed a soft body it lies all but on the mid-surface, and
/// its nearest place on the faces round it is on an edge or a vertex, from where it lies in any direction: a contact along that would be none, or push anywhere, the body
/// slides off, and the corner goes in between. Not so beyond the body's border, which it comes against from the side.
bool still_presses(const NearShape& near, const FaceCandidate& c) {
  const ContactSurface& s = near.body.surface;
  if (is_ball(c.point) || !(c.distance < s.radius[s.vertices(c.face)[0]]) || !is_inner(s, c.face, c.weight))
    return false;
  const Remembered remembered = recall_point(near, c.point);
  return std::any_of(remembered.begin(), remembered.end(),
                     [&](const RememberedContact* r) { return r != nullptr && r->feature == c.face.value; });
}

/// From a point to its foot on an edge of a face; zero: another face or a vertex has the contact.
Vec3 direction_over_edge(const NearShape& near, const FaceCandidate& c, const std::array<Vec3, 3>& corner) {
  const int opposite = opposite_corner(c.weight);
  if (opposite < 0 || !(c.distance > 0)) return {};  // a vertex: it looks for itself
  const H h = ContactSurface::corner(c.face, (opposite + 1) % 3), g = near.body.surface.twin[h];
  // The edge's other face has the same foot.
  if (g.valid() && g < h && near.body.surface.coarse[ContactSurface::face(g)] != 0) return {};
  const Vec3 place = c.weight[0] * corner[0] + c.weight[1] * corner[1] + c.weight[2] * corner[2];
  const Vec3 direction = (1 / c.distance) * (place - c.point.p);
  return near.body.off_faces(h, -direction) ? direction : Vec3{};
}

/// Has a face no contact over its foot on the mid-surface?
bool is_beside(const FaceCandidate& c) { return c.direction == Vec3{}; }

}  // namespace

void offer_point(const NearShape& near, F f, const std::array<Vec3, 3>& corner, double reach, const ShapePoint& point) {
  const TriangleFoot foot = nearest_foot(point.p, corner);
  const double most = reach + point.radius;
  if (!(foot.square < most * most)) return;
  FaceCandidate c;
  c.point = point;
  c.distance = std::sqrt(foot.square);
  c.face = f;
  c.weight = foot.weights();
  c.interior = is_inside(c.weight) || still_presses(near, c);
  if (c.interior) {
    c.direction = near.body.normal(f);
  } else {
    c.direction = direction_over_edge(near, c, corner);
  }
  // Of a ball, a face without a direction is kept: its side may come near, if not its middle.
  if (!(norm(c.direction) > 0.5)) {
    if (!is_ball(point) || !(c.distance > kWellOut * point.radius)) return;
    c.direction = {};
  }
  near.run.scratch.faces.push_back(c);
}

namespace {

/// What slides fast leaves its triangle and the next ones in one step. The side on which the point was of faces not far off at
/// rest, if they agree; else 0.
double side_nearby(const NearShape& near, const FaceCandidate& c,
                   std::span<const RememberedContact* const> remembered) {
  const ContactSurface& s = near.body.surface;
  const auto corner = s.vertices(c.face);
  const double edge = norm(s.rest[corner[1]] - s.rest[corner[0]]);
  const double far = 2 * (c.point.radius + s.radius[corner[0]] + near.shape_travel + edge);
  double side = 0;
  for (const RememberedContact* r : remembered) {
    if (r == nullptr || r->feature < 0 || static_cast<std::size_t>(r->feature) >= s.face_count()) continue;
    if (norm(s.rest[s.vertices(F(r->feature))[0]] - s.rest[corner[0]]) > far) continue;
    const double along = dot(r->normal, c.direction), its = along < 0 ? -1 : 1;
    if (std::fabs(along) < 0.7 || (side != 0 && side != its)) return 0;
    side = its;
  }
  return side;
}

/// On which side of a candidate the point lies: by the last step, else by where it is.
double side_of(const NearShape& near, const FaceCandidate& c, std::span<const RememberedContact* const> remembered,
               bool& known) {
  known = false;
  const auto corner = near.body.surface.vertices(c.face);
  for (const RememberedContact* r : remembered) {
    if (r == nullptr || r->feature < 0 || static_cast<std::size_t>(r->feature) >= near.body.surface.face_count())
      continue;
    const auto old = near.body.surface.vertices(F(r->feature));
    const bool neighbours = std::find_first_of(corner.begin(), corner.end(), old.begin(), old.end()) != corner.end();
    const double along = dot(r->normal, c.direction);
    if (!neighbours || std::fabs(along) < 0.5) continue;
    known = true;
    return along < 0 ? -1 : 1;
  }
  if (const double side = side_nearby(near, c, remembered); side != 0) {
    known = true;
    return side;
  }
  if (!c.interior) return 1;
  const double along = dot(face_point(near.body, c.face, c.weight).position - c.point.p, c.direction);
  if (along == 0) return dot(c.point.outward, c.direction) < 0 ? -1 : 1;
  return along < 0 ? -1 : 1;
}

/// The candidate that a layer keeps to: the face of the last step in place of one that is hardly nearer.
const FaceCandidate& kept(const NearShape& near, const FaceCandidate& c, std::span<const FaceCandidate> candidates,
                          std::span<const RememberedContact* const> remembered) {
  const auto is_known = [&](const RememberedContact* r) { return r != nullptr && r->feature == c.face.value; };
  if (std::any_of(remembered.begin(), remembered.end(), is_known)) return c;
  for (const RememberedContact* r : remembered) {
    if (r == nullptr) continue;
    for (const FaceCandidate& other : candidates)
      if (other.face.value == r->feature && std::fabs(dot(other.direction, c.direction)) > kOtherDirection &&
          other.distance < c.distance + kStayWithLayer * norm(face_point(near.body, other.face, other.weight).offset))
        return other;
  }
  return c;
}

/// A face, or else a layer, keeps its slot.
std::size_t slot_of(const Remembered& remembered, const std::array<bool, kMostLayers>& used, F face, Vec3 n) {
  constexpr double kTaken = -4, kFree = -1.5, kSameFace = 2;
  const auto fits = [&](std::size_t i) {
    if (used[i]) return kTaken;
    if (remembered[i] == nullptr) return kFree;
    const double along = dot(remembered[i]->normal, n);
    if (!(along > kOtherDirection)) return 2 * kFree;
    return remembered[i]->feature == face.value ? along + kSameFace : along;
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < kMostLayers; ++i)
    if (fits(i) > fits(best)) best = i;
  return best;
}

/// The memory of a ball that lies against a face.
const RememberedContact* recall_against(const NearShape& near, ContactName name, F f) {
  name.other_feature = f.value + 1;  // 0: the nearest one of a corner
  return recall_either_end(near.run, name);
}

/// From the middle of a ball to the body.
Vec3 direction_from(const NearShape& near, const FaceCandidate& c) {
  return !c.interior || dot(face_point(near.body, c.face, c.weight).position - c.point.p, c.direction) >= 0
             ? c.direction
             : -c.direction;
}

/// Did a ball touch this face, or one beside it, from the other side, and none of them from this one?
bool came_through(const NearShape& near, const FaceCandidate& c, std::span<const RememberedContact* const> remembered) {
  const ContactSurface& s = near.body.surface;
  const auto corner = s.vertices(c.face);
  const Vec3 n = direction_from(near, c);
  bool other_side = false;
  for (const RememberedContact* r : remembered) {
    if (r == nullptr || r->feature < 0 || static_cast<std::size_t>(r->feature) >= s.face_count()) continue;
    const auto old = s.vertices(F(r->feature));
    if (std::find_first_of(corner.begin(), corner.end(), old.begin(), old.end()) == corner.end()) continue;
    const double along = dot(r->normal, n);
    if (along > kOtherDirection) return false;
    other_side = other_side || along < -kOtherDirection;
  }
  return other_side;
}

/// Contact of a ball with the side of a face that is towards it, where that comes nearest. It leans against the mid-surface where the half thickness is not the same
/// everywhere, as where the ball has pressed the body thin: over the foot on the mid-surface is not where it is nearest.
void touch_side(const NearShape& near, ContactName name, const FaceCandidate& c) {
  constexpr double kSameSide = 0.7;  // cosine
  const auto v = near.body.surface.vertices(c.face);
  const BodyPoint foot = face_point(near.body, c.face, c.weight);
  const Vec3 n = is_beside(c) ? normalized(foot.position - c.point.p) : direction_from(near, c);
  const double lift = dot(n, foot.offset) > 0 ? -1 : 1;
  const auto corner = [&](std::size_t i) { return near.body.position(v[i]) + lift * near.body.offset(v[i]); };
  const std::array<double, 3> weight = nearest_foot(c.point.p, {corner(0), corner(1), corner(2)}).weights();
  if (!is_inside(weight) && opposite_corner(weight) < 0) return;  // a vertex: it looks for itself
  const BodyPoint place = face_point(near.body, c.face, weight);
  const Vec3 d = place.position + lift * place.offset - c.point.p;
  const double size = norm(d);
  if (!(dot(d, n) > kSameSide * size)) return;
  name.slot = 1;
  name.other_feature = c.face.value + 1;
  const Vec3 out = (1 / size) * d;
  hand_out_shape(near.run, name, near.shape, place, c.point.p + c.point.radius * out, out,
                 dot(place.position - c.point.p, out) - c.point.radius, c.face.value);
}

/// Contacts of a ball that is well out of the body: every face and edge that it lies against. A body that lies round it touches it with many at once, and no one of them
/// keeps another one out. The nearest one counts twice: its other contact goes along with the ball, and remembers the side when it goes deep. False if the ball is so deep
/// that its middle does not tell on which side it is.
bool hand_out_ball(const NearShape& near, std::span<const FaceCandidate> candidates,
                   std::span<const FaceCandidate> beside, const Remembered& remembered) {
  const double radius = candidates[0].point.radius;
  if (!(candidates[0].distance > kWellOut * radius)) return false;
  ContactName name = point_name(near, candidates[0].point);
  std::array<const RememberedContact*, kMostLayers + kMostRemembered> known{};
  std::copy(remembered.begin(), remembered.end(), known.begin());
  for (std::size_t i = 0; i < std::min(candidates.size(), kMostRemembered); ++i)
    known[kMostLayers + i] = recall_against(near, name, candidates[i].face);
  if (std::any_of(candidates.begin(), candidates.end(),
                  [&](const FaceCandidate& c) { return came_through(near, c, known); }))
    return false;
  const auto touch = [&](const FaceCandidate& c, std::int32_t other_feature) {
    const Vec3 n = direction_from(near, c);
    const BodyPoint foot = face_point(near.body, c.face, c.weight);
    name.other_feature = other_feature;
    hand_out_shape(near.run, name, near.shape, foot, c.point.p + radius * n, n,
                   dot(foot.position - c.point.p, n) - radius, c.face.value);
  };
  for (const FaceCandidate& c : candidates) {
    touch(c, c.face.value + 1);
    touch_side(near, name, c);
  }
  for (const FaceCandidate& c : beside) touch_side(near, name, c);
  touch(kept(near, candidates[0], candidates, remembered), 0);
  return true;
}

/// Contacts of one point. A corner has them with the nearest face, and with those that it sees in clearly other directions.
void hand_out_point(const NearShape& near, std::span<const FaceCandidate> all) {
  const auto last = std::find_if(all.begin(), all.end(), is_beside);
  const std::span<const FaceCandidate> candidates(all.begin(), last), beside(last, all.end());
  if (candidates.empty()) {
    for (const FaceCandidate& c : beside) touch_side(near, point_name(near, c.point), c);
    return;
  }
  ContactName name = point_name(near, candidates[0].point);
  const Remembered remembered = recall_point(near, candidates[0].point);
  if (is_ball(candidates[0].point) && hand_out_ball(near, candidates, beside, remembered)) return;
  std::array<Vec3, kMostLayers> taken;
  std::array<bool, kMostLayers> above{};  ///< it lies above the face, not beside it
  std::array<bool, kMostLayers> used{};
  std::size_t count = 0;
  for (const FaceCandidate& nearest : candidates) {
    const FaceCandidate& c = kept(near, nearest, candidates, remembered);
    bool known = false;
    const double side = side_of(near, c, remembered, known);
    const Vec3 n = side * c.direction;
    // The far side of a thin shape sees the body through the shape.
    if (!known && dot(n, c.point.outward) < -0.2) continue;
    bool other = true;
    for (std::size_t i = 0; i < count; ++i)
      other = other && dot(taken[i], n) < (above[i] && c.interior ? kOtherFace : kOtherDirection);
    if (!other) continue;
    const std::size_t slot = slot_of(remembered, used, c.face, n);
    used[slot] = true;
    above[count] = c.interior;
    taken[count++] = n;

    const BodyPoint foot = face_point(near.body, c.face, c.weight);
    name.slot = static_cast<std::int32_t>(slot);
    hand_out_shape(near.run, name, near.shape, foot, c.point.p + c.point.radius * n, n,
                   dot(foot.position - c.point.p, n) - c.point.radius, c.face.value);
    if (count == kMostLayers) return;
  }
}

}  // namespace

void hand_out_points(const NearShape& near) {
  auto& faces = near.run.scratch.faces;
  std::sort(faces.begin(), faces.end(), [](const FaceCandidate& a, const FaceCandidate& b) {
    if (a.point.id != b.point.id) return a.point.id < b.point.id;
    if (is_beside(a) != is_beside(b)) return is_beside(b);
    return a.distance != b.distance ? a.distance < b.distance : a.face < b.face;
  });
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end].point.id == faces[i].point.id) ++end;
    hand_out_point(near, std::span(faces).subspan(i, end - i));
    i = end;
  }
  faces.clear();
}

/// A place on the inner side of a convex edge, by d, has gone in there, unless the other side of the shape is nearer: then it came from there, or is not in the
/// shape at all but sees the edge through it. Nor has what nobody saw coming although it is farther in than a step can take it: it is in a thin shape by
/// another way.
static bool went_in_here(const NearShape& near, H h, Vec3 place, Vec3 d) {
  const ContactSurface& s = near.body.surface;
  if (norm(d) > std::fmax(near.approach(s.from(h)), near.approach(s.to(h)))) return false;
  Proximity beyond;
  return closest_on_part(near.placed, place + d, norm(d), beyond) && beyond.distance < 0;
}

void hand_out_edges(const NearShape& near, H h, const ShapeEdge& edge, const SegmentFeet& feet) {
  const BodyPoint foot = edge_point(near.body, h, feet.s);
  const Vec3 other = lerp(edge.a, edge.b, feet.t), d = foot.position - other;
  const double size = norm(d);
  const Vec3 along = near.body.position(near.body.surface.to(h)) - near.body.position(near.body.surface.from(h));
  ContactName name{ContactKind::kEdgeShape, 0, near.body.index, near.shape.other(), near.part, h.value, edge.id};
  // Across both edges if the distance is nothing but rounding.
  Vec3 n =
      size > 1e-9 * (norm(along) + norm(edge.b - edge.a)) ? (1 / size) * d : normalized(cross(along, edge.b - edge.a));
  if (!(norm(n) > 0.5)) return;
  const RememberedContact* r = recall_either_end(near.run, name);
  if (dot(edge.outward, edge.outward) > 0) {
    if (dot(n, edge.outward) < 0) {
      if (!(r != nullptr && dot(r->normal, n) < 0) && !went_in_here(near, h, foot.position, d)) return;
      n = -n;
    }
  } else if (r != nullptr && dot(r->normal, n) < 0) {
    n = -n;
  }
  // An edge that pressed goes on to where it leans a little farther: in a body crushed all but to nothing other contacts do not take over at once.
  const double most = r != nullptr ? kStillOffFaces : kOffFaces;
  if (dot(n, edge.into[0]) > most || dot(n, edge.into[1]) > most || !near.body.off_faces(h, -n, most)) return;
  hand_out_shape(near.run, name, near.shape, foot, other + edge.radius * n, n, dot(d, n) - edge.radius, -1);
}

}  // namespace kerf
