#include "kerf/scene/automatic_body.h"

#include <fmt/format.h>

#include <algorithm>

#include "kerf/midsurface/tolerances.h"
#include "kerf/scene/ways_out.h"

namespace kerf {
namespace {

constexpr int kTries = 3;
constexpr double kMore = 1.3;

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
  KERF_TRY(check_wanted_triangles(triangles, visual));
  AutomaticBody out;
  MidsurfaceOptions wanted;
  wanted.triangles = triangles;
  wanted.progress = options.progress;
  std::vector<CollisionVertex> at_fault;
  const auto prepared = prepare_midsurface(visual, options.progress);
  if (!prepared) return prepared.error();
  BindOptions binding = options;
  binding.at_fault = &at_fault;
  for (int i = 0; i < kTries; ++i) {
    auto made = make_midsurface(*prepared, wanted);
    if (!made) return made.error();
    out.midsurface = std::move(*made);
    out.refused.reset();
    if (out.midsurface.verdict.thinness == Thinness::kNotThin) return out;
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
