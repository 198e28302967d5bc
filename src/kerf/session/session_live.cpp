// What a person changes while the session runs: grasps by hand, gravity, material.
#include <fmt/format.h>

#include "kerf/scene/scene_body.h"
#include "kerf/session/session_impl.h"

namespace kerf {

Status Session::grasp(const std::string& id, const std::vector<CollisionVertex>& points) {
  if (points.empty()) return bad_input("a grasp needs a vertex to hold");
  for (const CollisionVertex v : points)
    if (!impl_->state.body.complex.collision.rest.contains(v))
      return bad_input(fmt::format("there is no collision vertex {} to hold", v.value));
  return impl_->hold(id, points, std::nullopt);
}

std::vector<Session::GraspState> Session::grasps() {
  std::vector<GraspState> out;
  if (impl_->state.grasps.empty()) return out;
  const std::vector<Vec3>& now = impl_->deformed_collision();
  for (const Grasp& g : impl_->state.grasps) {
    GraspState state;
    state.id = g.id;
    state.target = g.to;
    for (const CollisionVertex v : g.points)
      if (v.index() < now.size()) {
        state.points.push_back(v);
        state.held += now[v.index()];
      }
    if (state.points.empty()) state.held = g.centre;
    else state.held = (1.0 / static_cast<double>(state.points.size())) * state.held;
    out.push_back(std::move(state));
  }
  return out;
}

Status Session::set_gravity(Vec3 gravity) {
  if (!is_finite(gravity)) return bad_input("gravity must be finite, m/s^2");
  impl_->step_options.gravity = impl_->state.gravity = gravity;
  return {};
}
Vec3 Session::gravity() const { return impl_->step_options.gravity; }

Status Session::set_material(double young, double poisson, double density) {
  KERF_TRY(check_nature({young, poisson, density, {}}, "material"));
  Impl& s = *impl_;
  const std::span<const Material> all = s.state.model.materials();
  const std::vector<Material> before(all.begin(), all.end());
  std::vector<Material> after = before;
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (before[i].young == before[0].young) after[i].young = young;
    if (before[i].poisson == before[0].poisson) after[i].poisson = poisson;
    if (before[i].density == before[0].density) after[i].density = density;
    KERF_TRY(kerf::validate(after[i]));
  }
  for (std::size_t i = 0; i < after.size(); ++i)
    KERF_TRY(s.state.model.set_material(static_cast<std::int32_t>(i), after[i]));
  const HexMesh& hex = s.state.body.hex;
  for (std::size_t i = 0; i < hex.hex_count(); ++i) KERF_TRY(sync_hex(hex, s.state.materials, HexId(i), s.state.model));
  return s.renew_springs();  // the glue of slit tips goes by Young's modulus
}
Material Session::material() const { return impl_->state.model.materials()[0]; }
std::int64_t Session::step_count() const { return impl_->state.steps; }

}  // namespace kerf
