#include "kerf/session/automatic_body.h"

#include <fmt/format.h>

namespace kerf {
namespace {

constexpr int kTries = 3;
constexpr double kMore = 1.3;

}  // namespace

std::string not_thin_message(const Midsurface& midsurface) {
  std::string out = "no collision mesh could be made: ";
  for (std::size_t i = 0; i < midsurface.verdict.reasons.size(); ++i)
    out += (i == 0 ? "" : "; ") + midsurface.verdict.reasons[i];
  for (const std::string& note : midsurface.notes) out += "; " + note;
  return out + ". Cutting is for thin bodies; kerf bind BODY --diagnose FILE.ply shows the places, and --collision takes a "
               "mesh of your own";
}

Result<AutomaticBody> make_automatic_body(const TriangleMesh& visual, std::size_t triangles, const BindOptions& options) {
  AutomaticBody out;
  MidsurfaceOptions wanted;
  wanted.triangles = triangles;
  wanted.progress = options.progress;
  Error last;
  for (int i = 0; i < kTries; ++i) {
    auto made = make_midsurface(visual, wanted);
    if (!made) return made.error();
    out.midsurface = std::move(*made);
    if (out.midsurface.verdict.thinness == Thinness::kNotThin) return out;
    auto bound = bind(visual, out.midsurface.collision, options);
    if (bound) {
      out.bound = std::move(*bound);
      return out;
    }
    last = bound.error();
    if (!out.midsurface.verdict.warnings.empty())
      last.message = fmt::format("{}; {}", fmt::join(out.midsurface.verdict.warnings, "; "), last.message);
    wanted.triangles = static_cast<std::size_t>(kMore * static_cast<double>(out.midsurface.collision.triangles.size()));
  }
  last.message = fmt::format("the collision mesh that was made does not bind ({}); ask for more triangles, or give a collision "
                             "mesh of your own", last.message);
  return last;
}

}  // namespace kerf
