#include "kerf/scene/automatic_body.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

#include "kerf/mesh/lips.h"
#include "kerf/mesh/surface_measures.h"
#include "kerf/midsurface/tolerances.h"
#include "kerf/scene/ways_out.h"

namespace kerf {
namespace {

constexpr int kTries = 3;
constexpr double kMore = 1.3;

/// Principal axes of a surface, the one of the least spread first.
Eigen::Matrix3d principal_axes(const TriangleMesh& mesh, double area) {
  const auto corner = [&](TriangleId t, std::size_t i) {
    const Vec3 p = mesh.positions[mesh.triangles[t][i]];
    return Eigen::Vector3d(p.x, p.y, p.z);
  };
  const auto area_of = [&](TriangleId t) {
    return 0.5 * (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm();
  };
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const TriangleId t : ids<TriangleId>(mesh.triangles.size()))
    center += area_of(t) / (3 * area) * (corner(t, 0) + corner(t, 1) + corner(t, 2));
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const TriangleId t : ids<TriangleId>(mesh.triangles.size())) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d p = corner(t, i) - center;
      squares += p * p.transpose();
      sum += p;
    }
    spread += area_of(t) / (12 * area) * (squares + sum * sum.transpose());
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
}

struct Stout {
  double width_over_thickness;
  const char* shape;
};
/// Of a body that is a straight rod, a bar, a block or a ball: it fills its box, and its surface has no folds, holes or
/// handles. None: it is none of those.
std::optional<Stout> stoutness(const TriangleMesh& visual) {
  const SurfaceMeasures m = surface_measures(visual);
  if (!m.closed || m.components != 1 || m.euler != 2 || !(m.area > 0)) return std::nullopt;
  const Eigen::Matrix3d axes = principal_axes(visual, m.area);
  Box3 box;
  for (const Vec3 p : visual.positions) {
    const Eigen::Vector3d q = axes.transpose() * Eigen::Vector3d(p.x, p.y, p.z);
    box.add({q.x(), q.y(), q.z()});
  }
  const Vec3 size = box.size();
  double length[] = {size.x, size.y, size.z};
  std::sort(std::begin(length), std::end(length));
  const auto [thin, wide, longest] = length;
  const double box_area = 2 * (thin * wide + wide * longest + longest * thin);
  if (!(wide < mid::kTooStout * thin) || m.area > box_area ||
      std::fabs(m.volume) < mid::kFillsItsBox * thin * wide * longest)
    return std::nullopt;
  return Stout{wide / thin, longest > mid::kTooStout * wide ? "a rod or a bar" : "a ball or a block"};
}

/// The one reason to give for a body that is no sheet by its outline, whatever else stopped its mid-surface.
void tell_stout(const TriangleMesh& visual, AutomaticBody& body) {
  MidsurfaceVerdict& verdict = body.midsurface.verdict;
  const auto stout = stoutness(visual);
  if (!stout) return;
  verdict.thinness = Thinness::kNotThin;
  verdict.reasons = {fmt::format("{}: the body is only {:.3g} times as wide as thick; below {} it is not thin",
                                 stout->shape, stout->width_over_thickness, mid::kTooStout)};
  body.refused.reset();
}

/// Marks where binding failed and says where that is.
std::string mark_fault(const std::vector<CollisionVertex>& at_fault, Midsurface& made) {
  const auto& position = made.collision.positions;
  if (at_fault.empty()) return {};
  Box3 box;
  for (const CollisionVertex v : at_fault) box.add(position[VertexId(v.value)]);
  const double reach = std::max(box.diagonal(), 2 * made.quality.mean_half_thickness);
  mark_bad_place(made, box.center(), reach, "the collision mesh does not bind");
  const Vec3 p = box.center();
  return fmt::format(", at ({:.4g}, {:.4g}, {:.4g})", p.x, p.y, p.z);
}

}  // namespace

Status check_wanted_triangles(std::size_t wanted, const TriangleMesh& visual) {
  const std::size_t has = visual.triangles.size(), most = std::max(has, static_cast<std::size_t>(mid::kMostByNeed));
  if (wanted <= most) return {};
  return bad_input(fmt::format(
      "{} collision triangles are more than the surface shows: it has {}; ask for {} at most, or give a finer surface",
      wanted, has, most));
}

std::string not_thin_message(const Midsurface& midsurface) {
  std::string out = "no collision mesh could be made: ";
  for (std::size_t i = 0; i < midsurface.verdict.reasons.size(); ++i)
    out += (i == 0 ? "" : "; ") + midsurface.verdict.reasons[i];
  for (const std::string& note : midsurface.notes) out += "; " + note;
  return fmt::format("{}. Cutting is for thin bodies; {}", out, kGiveMidsurface.command_line);
}

Result<AutomaticBody> make_automatic_body(const TriangleMesh& visual, std::size_t triangles,
                                          const BindOptions& options) {
  // A slit is a border of the mid-surface; its lips are apart for that.
  const TriangleMesh drawn_back = with_lips_drawn_back(visual);
  KERF_TRY(check_wanted_triangles(triangles, visual));
  AutomaticBody out;
  out.slits = drawn_back.positions != visual.positions;
  MidsurfaceOptions wanted;
  wanted.triangles = triangles;
  wanted.progress = options.progress;
  std::vector<CollisionVertex> at_fault;
  const auto prepared = prepare_midsurface(drawn_back, options.progress);
  if (!prepared) return prepared.error();
  BindOptions binding = options;
  binding.at_fault = &at_fault;
  for (int i = 0; i < kTries; ++i) {
    auto made = make_midsurface(*prepared, wanted);
    if (!made) return made.error();
    out.midsurface = std::move(*made);
    out.refused.reset();
    if (out.midsurface.verdict.thinness == Thinness::kNotThin) {
      tell_stout(visual, out);
      return out;
    }
    at_fault.clear();
    auto bound = bind(visual, out.midsurface.collision, binding);
    if (bound) {
      out.bound = std::move(*bound);
      return out;
    }
    out.refused = bound.error();
    // More triangles were tried against that already, or mend nothing.
    const Midsurface& m = out.midsurface;
    if (m.own_crossings > 0 || m.quality.crossings > 0 || m.quality.good_rays < 1) break;
    wanted.triangles = static_cast<std::size_t>(kMore * static_cast<double>(out.midsurface.collision.triangles.size()));
  }
  const std::string where = mark_fault(at_fault, out.midsurface);
  tell_stout(visual, out);
  if (!out.refused) return out;
  std::vector<std::string> why = out.midsurface.verdict.warnings;
  why.push_back(out.refused->message + where);
  // A part that is higher than it is wide has its mid-surface upright, whatever the rest of the body has.
  if (const MidsurfaceVerdict& v = out.midsurface.verdict; v.narrow_share > 0)
    why.push_back(fmt::format(
        "{:.2g} % of the body are narrower than 1.5 thicknesses, most of it at ({:.4g}, {:.4g}, {:.4g}): a tip like that can "
        "be widened, or cut off",
        100 * v.narrow_share, v.narrowest.x, v.narrowest.y, v.narrowest.z));
  else if (out.midsurface.quality.crossings > 0)
    why.emplace_back(
        "a body that is folded by 120 degrees and more there can be unfolded or rounded, one that passes through itself repaired");
  out.refused->message = fmt::format("the collision mesh that was made does not bind ({}); {}", fmt::join(why, "; "),
                                     kGiveCollisionMesh.command_line);
  return out;
}

}  // namespace kerf
