#include "kerf/lattice/lattice_frame.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

namespace kerf {
namespace {

/// A box may be this much larger than the smallest one for axes that are nicer in another way.
constexpr double kBoxSlack = 1.02;

/// Corners of all prisms.
std::vector<Vec3> prism_corners(const CollisionMesh& mesh) {
  std::vector<Vec3> points;
  points.reserve(2 * mesh.vertex_count());
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) {
    points.push_back(mesh.rest[v] - mesh.offset[v]);
    points.push_back(mesh.rest[v] + mesh.offset[v]);
  }
  return points;
}

/// Principal axes of the prisms (as a surface with thickness), smallest spread last.
Mat3 principal_axes(const CollisionMesh& mesh) {
  double area = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  auto eigen = [](Vec3 v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  std::vector<double> areas(mesh.face_count());
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    Vec3 p[3];
    for (int i = 0; i < 3; ++i) p[i] = mesh.rest[mesh.origin[CollisionMesh::corner(f, i)]];
    const double a = 0.5 * norm(cross(p[1] - p[0], p[2] - p[0]));
    areas[f.index()] = a;
    area += a;
    center += a / 3 * eigen(p[0] + p[1] + p[2]);
  }
  center /= area;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), offset = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (int i = 0; i < 3; ++i) {
      const CollisionVertex v = mesh.origin[CollisionMesh::corner(f, i)];
      const Eigen::Vector3d p = eigen(mesh.rest[v]) - center;
      squares += p * p.transpose();
      sum += p;
      offset += eigen(mesh.offset[v]) / 3;
    }
    spread += areas[f.index()] / 12 * (squares + sum * sum.transpose());
    spread += areas[f.index()] / 3 * (offset * offset.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Mat3 axes;
  for (int i = 0; i < 3; ++i) {  // Eigen sorts ascending
    const Eigen::Vector3d e = solver.eigenvectors().col(2 - i);
    axes.c[static_cast<std::size_t>(i)] = {e.x(), e.y(), e.z()};
  }
  return axes;
}

Box3 box_along(const Mat3& axes, const std::vector<Vec3>& points) {
  Box3 box;
  for (const Vec3 p : points) box.add(transposed_times(axes, p));
  return box;
}

double box_volume(const Mat3& axes, const std::vector<Vec3>& points) {
  const Vec3 size = box_along(axes, points).size();
  return size.x * size.y * size.z;
}

/// In-plane axes (x, y) turned so that the bounding rectangle is smallest; thickness axis kept.
Mat3 smallest_rectangle(const Mat3& axes, const std::vector<Vec3>& points) {
  std::vector<Vec2> flat;
  flat.reserve(points.size());
  for (const Vec3 p : points) flat.push_back({dot(axes.c[0], p), dot(axes.c[1], p)});
  std::sort(flat.begin(), flat.end(), [](Vec2 a, Vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Vec2> hull;  // Andrew's monotone chain
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const Vec2 p : flat) {
      while (hull.size() >= base + 2 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(flat.begin(), flat.end());
  }
  constexpr std::size_t kMostDirections = 360;
  const std::size_t stride = 1 + hull.size() / kMostDirections;
  double best_area = HUGE_VAL;
  Vec2 best{1, 0};
  for (std::size_t i = 0; i < hull.size(); i += stride) {
    Vec2 d = hull[(i + 1) % hull.size()] - hull[i];
    if (!(norm(d) > 0)) continue;
    d = (1 / norm(d)) * d;
    double lo_x = HUGE_VAL, hi_x = -HUGE_VAL, lo_y = HUGE_VAL, hi_y = -HUGE_VAL;
    for (const Vec2 p : hull) {
      const double x = dot(d, p), y = cross(d, p);
      lo_x = std::fmin(lo_x, x), hi_x = std::fmax(hi_x, x), lo_y = std::fmin(lo_y, y), hi_y = std::fmax(hi_y, y);
    }
    const double area = (hi_x - lo_x) * (hi_y - lo_y);
    if (area < best_area * (1 - 1e-9)) best_area = area, best = d;
  }
  Mat3 turned;
  turned.c[0] = normalized(best.x * axes.c[0] + best.y * axes.c[1]);
  turned.c[2] = axes.c[2];
  turned.c[1] = cross(turned.c[2], turned.c[0]);
  return turned;
}

/// Reorders and flips axes to lie as near as possible to the world's. `thickness` follows its axis.
Mat3 nearest_to_world(const Mat3& axes, int& thickness) {
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  double best = -1;
  int order = 0;
  for (int o = 0; o < 6; ++o) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += std::fabs(axes.c[static_cast<std::size_t>(kOrders[o][i])][i]);
    if (sum > best + 1e-9) best = sum, order = o;
  }
  Mat3 out;
  int new_thickness = thickness;
  double weakest = 2;
  int weakest_axis = 2;
  for (int i = 0; i < 3; ++i) {
    const auto to = static_cast<std::size_t>(i);
    const int from = kOrders[order][i];
    if (from == thickness) new_thickness = i;
    const Vec3 a = axes.c[static_cast<std::size_t>(from)];
    out.c[to] = a[i] < 0 ? -a : a;
    if (std::fabs(a[i]) < weakest - 1e-9) weakest = std::fabs(a[i]), weakest_axis = i;
  }
  if (dot(cross(out.c[0], out.c[1]), out.c[2]) < 0)  // flip the axis that says least about its sign
    out.c[static_cast<std::size_t>(weakest_axis)] = -out.c[static_cast<std::size_t>(weakest_axis)];
  thickness = new_thickness;
  return out;
}

Status check_count(const LatticeIndex& count) {
  double cells = 1;
  for (const int n : count) cells *= n;
  if (cells > static_cast<double>(kMaxLatticeCells))
    return bad_input(
        fmt::format("lattice: {} x {} x {} cells are too many, {} are the most; choose larger cells or fewer of them",
                    count[0], count[1], count[2], kMaxLatticeCells));
  return {};
}

Result<LatticeFrame> given_lattice(const LatticeOptions& options) {
  const Mat3& a = options.axes;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (!(std::fabs(dot(a.c[i], a.c[j]) - (i == j ? 1 : 0)) < 1e-6))
        return bad_input("lattice: the given axes are not orthonormal; give three perpendicular unit vectors");
  if (dot(cross(a.c[0], a.c[1]), a.c[2]) < 0)
    return bad_input("lattice: the given axes are left-handed; flip one of them");
  for (int i = 0; i < 3; ++i)
    if (!(options.cell[i] > 0) || !std::isfinite(options.cell[i]) || options.count[static_cast<std::size_t>(i)] < 1)
      return bad_input("lattice: given cells need a positive size and a count of at least 1 along every axis");
  if (!is_finite(options.origin)) return bad_input("lattice: the given origin is not finite");
  KERF_TRY(check_count(options.count));
  LatticeFrame frame;
  frame.origin = options.origin;
  frame.axes = options.axes;
  frame.cell = options.cell;
  frame.count = options.count;
  return frame;
}

}  // namespace

Result<LatticeFrame> choose_lattice(const CollisionMesh& mesh, const LatticeOptions& options) {
  if (mesh.face_count() == 0) return bad_input("lattice: the collision mesh has no triangles");
  const std::vector<Vec3> points = prism_corners(mesh);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!is_finite(points[i]))
      return bad_input(fmt::format("lattice: collision vertex {} has coordinates that are not finite", i / 2 + 1));
  if (options.given) return given_lattice(options);
  if (options.cells < 0 || options.layers < 0)
    return bad_input("lattice: numbers of cells and layers can't be negative");

  const Mat3 principal = principal_axes(mesh);
  const Mat3 tight = smallest_rectangle(principal, points);
  const double smallest = std::fmin(box_volume(tight, points), box_volume(principal, points));
  Mat3 axes = tight;
  int thickness = 2;
  if (box_volume(principal, points) <= kBoxSlack * smallest) axes = principal;
  if (box_volume(Mat3{}, points) <= kBoxSlack * smallest) {
    axes = Mat3{};
    const Vec3 t = principal.c[2];
    thickness = std::fabs(t.x) > std::fabs(t.y) ? (std::fabs(t.x) > std::fabs(t.z) ? 0 : 2)
                                                : (std::fabs(t.y) > std::fabs(t.z) ? 1 : 2);
  }
  axes = nearest_to_world(axes, thickness);

  const Box3 box = box_along(axes, points);
  const Vec3 size = box.size();
  const double longest = std::fmax(size.x, std::fmax(size.y, size.z));
  for (int i = 0; i < 3; ++i)
    if (!(size[i] > 1e-9 * longest))
      return bad_input("lattice: the body has no extent along one axis; give its collision mesh a thickness");

  const int u = (thickness + 1) % 3, v = (thickness + 2) % 3;
  double edge = 0;
  if (options.cells > 0) {
    edge = std::sqrt(size[u] * size[v] * std::max(options.layers, 1) / options.cells);
  } else {
    for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count()))
      edge += norm(mesh.rest[mesh.to(h)] - mesh.rest[mesh.from(h)]);
    edge /= static_cast<double>(mesh.half_edge_count());
  }
  if (options.layers == 0 && options.cells > 0 && size[thickness] > edge)  // cells across the thickness share the total
    edge = std::cbrt(size.x * size.y * size.z / options.cells);
  LatticeFrame frame;
  auto cells_along = [&](int axis) {
    return static_cast<std::int32_t>(std::clamp(std::round(size[axis] / edge), 1.0, 1e8));
  };
  frame.count[static_cast<std::size_t>(u)] = cells_along(u);
  frame.count[static_cast<std::size_t>(v)] = cells_along(v);
  frame.count[static_cast<std::size_t>(thickness)] = options.layers > 0 ? options.layers : cells_along(thickness);
  KERF_TRY(check_count(frame.count));
  frame.axes = axes;
  frame.origin = axes * box.min;
  for (int i = 0; i < 3; ++i) frame.cell[i] = size[i] / frame.count[static_cast<std::size_t>(i)];
  return frame;
}

}  // namespace kerf
