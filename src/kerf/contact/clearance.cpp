#include "kerf/contact/clearance.h"

#include <cmath>

namespace kerf {
namespace {

/// Singles are exact to this part of a place's size.
constexpr double kClearanceRounding = 1e-6;

}  // namespace

void Clearance::is_of(const std::shared_ptr<const ObstacleMesh>& mesh, std::size_t vertices) {
  if (mesh != mesh_) {
    mesh_ = mesh;
    size_ = norm(mesh->box.center()) + mesh->box.diagonal();
    ball_.clear();
    nearest_.clear();
  }
  ball_.resize(vertices, {});
  nearest_.resize(vertices, -1);
}

double Clearance::least(CollisionVertex v, Vec3 local) const {
  const auto& [x, y, z, radius] = ball_[v.index()].x;
  return radius - norm(local - Vec3{x, y, z}) - kClearanceRounding * (size_ + norm(local));
}

void Clearance::set(CollisionVertex v, Vec3 local, double distance, const ObstacleLeaves::Triangle* nearest) {
  TreeCorner& ball = ball_[v.index()];
  ball = to_corner(local);
  ball.x[3] = static_cast<float>(distance);
  if (nearest != nullptr) nearest_[v.index()] = static_cast<std::int32_t>(nearest - mesh_->leaves.triangles.data());
}

}  // namespace kerf
