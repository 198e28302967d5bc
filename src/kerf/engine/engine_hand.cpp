// A hand that takes hold of the body under the pointer, and follows it.
//
//   what supports hold is pulled,         what lies free is carried,
//   in the plane across the view          level, and lifted a little
//
//     eye                                   eye
//       \  `.      /                          \  `.          o  to
//        \    `.  /                            \    `.       |  lift
//         \      /  to                          \      `.    |
//          held /                               held ---- `--+   level
//              /  plane
//
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "kerf/engine/engine_impl.h"
#include "kerf/engine/tolerances.h"

namespace kerf {
namespace {

using protocol::Phase;
using protocol::Tool;
using protocol::ViewRay;
using Kind = SessionChange::Kind;

double size_of(const Body& body) {
  Box3 box;
  for (const Vec3 p : body.complex.collision.rest.raw()) box.add(p);
  return box.diagonal();
}

}  // namespace

Status Engine::Impl::take_hold(const ViewRay& ray, bool to_take_away) {
  const auto picked = pick_ray(ray);
  if (!picked && to_take_away) return bad_input("There is nothing here to take away.");
  if (!picked) return {};
  SessionChange grasp;
  grasp.kind = Kind::kGrasp;
  grasp.id = fmt::format("hand{}", ++grasp_number);
  const CollisionMesh& mesh = session->body().complex.collision;
  // All corners of the triangle: they hang together, whatever lies beside it across a cut.
  for (int k = 0; k < 3; ++k) grasp.vertices.push_back(mesh.origin[CollisionMesh::corner(picked->triangle, k)].value);
  HandGrasp h;
  h.id = grasp.id;
  h.plane_point = picked->middle;
  h.plane_normal = ray.direction;
  h.size = size_of(session->body());
  const Vec3 gravity = session->gravity(), down = norm(gravity) > 0 ? normalized(gravity) : Vec3{};
  if (dot(ray.direction, down) > kFromAbove && !session->held_by_supports(picked->triangle)) {
    h.plane_normal = down;
    h.lift = -kCarryHeight * h.size * down;
  }
  KERF_TRY(perform(std::move(grasp)));
  for (const Session::GraspState& g : session->grasps())
    if (g.id == h.id) h.start = g.target;
  hand = std::move(h);
  return {};
}

Status Engine::Impl::lead_hand(const ViewRay& ray) {
  const double along = dot(ray.direction, hand->plane_normal);
  if (!(along > kAlongThePlane)) return {};  // there the plane is out of reach, or behind the eye
  const double t = dot(hand->plane_point - ray.origin, hand->plane_normal) / along;
  Vec3 pulled = ray.origin + t * ray.direction - hand->plane_point;
  const double way = norm(pulled), most = kFarthestPull * hand->size;
  if (way > most) pulled = (most / way) * pulled;
  if (const double height = norm(hand->lift); height > 0) pulled += std::min(1.0, way / height) * hand->lift;
  const Vec3 to = hand->start + pulled;
  SessionChange move;
  move.kind = Kind::kMove;
  move.id = hand->id;
  move.values = {to.x, to.y, to.z, speed / options.tick};  // as long as a tick: no jumps
  return perform(std::move(move));
}

Status Engine::Impl::let_go(const protocol::ToolInput& input) {
  const bool takes = input.tool == Tool::kTake;
  const CollisionTriangle taken = takes ? held_triangle() : CollisionTriangle{};
  SessionChange release;
  release.kind = Kind::kRelease;
  release.id = hand->id;
  const bool there = holds(hand->id);
  hand.reset();
  if (takes || !(input.modifiers & protocol::kShift)) {  // Shift leaves it held
    // The piece goes without the grasp: undo brings back a piece that nothing holds.
    if (there) KERF_TRY(perform(std::move(release)));
  }
  return takes ? take_away(taken, input.input) : Status{};
}

CollisionTriangle Engine::Impl::held_triangle() {
  const CollisionMesh& mesh = session->body().complex.collision;
  for (const Session::GraspState& g : session->grasps())
    if (g.id == hand->id && !g.points.empty()) return CollisionMesh::face(mesh.outgoing[g.points.front()]);
  return {};
}

Status Engine::Impl::pull(const protocol::ToolInput& input) {
  if (input.phase == Phase::kDown) KERF_TRY(take_hold(input.samples.front().ray, input.tool == Tool::kTake));
  if (!hand) return {};
  if (!input.samples.empty()) KERF_TRY(lead_hand(input.samples.back().ray));
  if (input.phase == Phase::kUp) return let_go(input);
  return {};
}

}  // namespace kerf
