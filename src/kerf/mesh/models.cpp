#include "kerf/mesh/models.h"

#include <fmt/format.h>

#include <cmath>

#include "kerf/base/shown_text.h"
#include "kerf/mesh/models_planar.h"

namespace kerf {

const std::vector<ModelName>& model_names() {
  static const std::vector<ModelName> names{
      {"sheet",
       "open sheet 1 x 1 x 0.1 m; 1664, 6656, 26624 or 106496 visual triangles, 104, 500 or 1500 collision triangles"},
      {"closed-sheet",
       "closed sheet 1 x 1 x 0.1 m of 500 to 10000000 visual triangles, sharp or rounded rim; 104, 500, 1500 or 2 n^2 collision triangles"},
      {"steak", "rib-eye steak 200 x 160 x 20 mm; 5278 visual triangles, 67 or 137 collision triangles"},
      {"meniscus", "crescent wedge 45 mm across, 1 to 4 mm thick; 5760 visual triangles, 160 collision triangles"},
      {"holed-slab", "slab 160 x 160 x 20 mm with a square hole"},
      {"two-holed-slab", "slab 260 x 160 x 20 mm with two square holes"},
      {"tube", "thin-walled tube, 60 mm across, 100 mm long, wall 4 mm: inner and outer wall, open ends"},
      {"half-shell", "strip 160 x 60 x 4 mm bent to a half cylinder"},
      {"s-shape", "flat S, 24 mm wide and 6 mm thick"},
      {"strip", "strip 200 x 24 x 3 mm"},
      {"mat", "square mat 200 x 200 x 3 mm, soft enough to drape"},
  };
  return names;
}

namespace {

Result<Model> make_plain(std::string_view name, const ModelOptions& options) {
  if (name == "sheet") return models::make_sheet(options);
  if (name == "closed-sheet") return models::make_closed_sheet(options);
  if (name == "steak") return models::make_steak(options);
  if (name == "meniscus") return models::make_meniscus(options);
  if (name == "holed-slab") return models::make_holed_slab(options, 1);
  if (name == "two-holed-slab") return models::make_holed_slab(options, 2);
  if (name == "tube") return models::make_tube(options);
  if (name == "half-shell") return models::make_half_shell(options);
  if (name == "s-shape") return models::make_s_shape(options);
  if (name == "strip") return models::make_strip(options);
  if (name == "mat") return models::make_mat(options);
  std::string known;
  for (const ModelName& n : model_names()) known += (known.empty() ? "" : ", ") + std::string(n.name);
  return bad_input(fmt::format("there is no model \"{}\"; the models are {}", shown(name), known));
}

}  // namespace

Result<Model> make_model(std::string_view name, const ModelOptions& options) {
  for (const double v : {options.rim_radius, options.bend, options.bumps, options.noise})
    if (!std::isfinite(v)) return bad_input("rim radius, bend, bumps and noise must be finite numbers");
  if (options.bumps < 0 || options.noise < 0) return bad_input("bumps and noise are lengths in metres, 0 or more");
  if (options.rim_radius != 0 && name != "closed-sheet")
    return bad_input(fmt::format("model {} has no rim radius, only closed-sheet has", name));
  Result<Model> model = make_plain(name, options);
  if (!model) return model;
  // Waves as long as a third of the body: bumps, not folds, at any amplitude that makes sense.
  const Vec3 size = models::bounding_box(model->visual).size();
  const double length = std::fmax(size.x, size.y);
  if (options.bumps > 0.2 * length)
    return bad_input(fmt::format("bumps of {} m are too high for a body of {} m", options.bumps, length));
  if (options.noise > length)
    return bad_input(fmt::format("noise of {} m moves vertices farther than the body of {} m is long; give less",
                                 options.noise, length));
  add_bumps(*model, options.bumps, length / 3, options.seed);
  KERF_TRY(bend(*model, options.bend));
  add_noise(*model, options.noise, options.seed);
  return model;
}

}  // namespace kerf
