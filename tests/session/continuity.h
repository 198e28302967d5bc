// What a cut may not change: where every point of the surface is, how fast it moves, and the energy of the motion.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "kerf/session/body_mechanics.h"
#include "kerf/session/session.h"

namespace kerf::test {

/// All surface points and the motion of the nodes at one moment.
struct SurfaceMotion {
  std::vector<Vec3> visual_rest, visual, visual_velocity;
  std::vector<Vec3> collision_rest, collision, collision_velocity;
  double mass = 0, kinetic = 0, speed = 0;  ///< kg, J, m/s of the fastest node
  Vec3 momentum;
};

inline SurfaceMotion surface_motion(Session& session) {
  SurfaceMotion m;
  const Body& body = session.body();
  const std::vector<Vec3>& v = session.node_velocities();
  m.visual_rest = body.complex.visual.rest.raw();
  m.visual = session.visual_positions();
  m.visual_velocity = session.visual_velocities();
  m.collision_rest = body.complex.collision.rest.raw();
  m.collision = session.collision_positions();
  m.collision_velocity = session.collision_velocities();
  // From a mechanical model of the hexahedra as they are now, made anew.
  BodyMaterials materials;
  SceneMaterial material;
  material.young = session.material().young;
  material.poisson = session.material().poisson;
  material.density = session.material().density;
  auto model = make_mechanics(body.hex, material, SceneFormulation::kPlain, materials);
  MechanicsState state;
  if (!model.ok() || !sync_all(body.hex, materials, *model, state).ok()) return m;
  for (const NodeId n : ids<NodeId>(body.hex.node_count())) {
    if (!body.hex.active(n)) continue;
    const double mass = model->node_mass(n);
    m.mass += mass;
    m.momentum += mass * v[n.index()];
    m.kinetic += 0.5 * mass * dot(v[n.index()], v[n.index()]);
    m.speed = std::max(m.speed, norm(v[n.index()]));
  }
  return m;
}

struct SurfaceJump {
  double position = 0, velocity = 0;  ///< m, m/s: the largest of a vertex
  std::size_t vertices = 0;           ///< that moved by more than `noticed`
};

/// Vertices that are the same point of the material before and after.
inline SurfaceJump surface_jump(const SurfaceMotion& a, const SurfaceMotion& b, double noticed) {
  SurfaceJump jump;
  const auto compare = [&](const auto& rest_a, const auto& rest_b, const auto& xa, const auto& xb, const auto& va,
                           const auto& vb) {
    for (std::size_t i = 0; i < std::min(rest_a.size(), rest_b.size()); ++i) {
      if (!(rest_a[i] == rest_b[i])) continue;  // a provisional vertex that was made again elsewhere
      const double moved = norm(xb[i] - xa[i]);
      jump.position = std::max(jump.position, moved);
      jump.velocity = std::max(jump.velocity, norm(vb[i] - va[i]));
      jump.vertices += moved > noticed ? 1 : 0;
    }
  };
  compare(a.visual_rest, b.visual_rest, a.visual, b.visual, a.visual_velocity, b.visual_velocity);
  compare(a.collision_rest, b.collision_rest, a.collision, b.collision, a.collision_velocity, b.collision_velocity);
  return jump;
}

/// What may change where no time passes: rounding. Of the body's size; of the speed of the fastest node, and of the body's size per
/// second; of kinetic energy.
inline constexpr double kLargestJump = 1e-12, kLargestKick = 1e-9, kLargestGain = 1e-9;

/// Changes between two moments without a step between them, in the units of those bounds. size: m, of the body.
struct Continuity {
  double moved = 0, kicked = 0, gained = 0;
  std::string broken;  ///< empty, or what changed by too much
};
/// energy: compare kinetic energy, too (a shave takes its own away).
inline Continuity continuity(const SurfaceMotion& before, const SurfaceMotion& after, double size, bool energy = true) {
  const auto number = [](double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", x);
    return std::string(text);
  };
  Continuity c;
  const SurfaceJump jump = surface_jump(before, after, kLargestJump * size);
  c.moved = jump.position / size;
  c.kicked = jump.velocity / (before.speed + size);
  if (energy) c.gained = after.kinetic / (before.kinetic + 1e-12 * before.mass * size * size) - 1;
  double farthest = 0;
  for (const Vec3 p : after.visual) farthest = std::max(farthest, norm(p));
  if (!(c.moved <= kLargestJump))
    c.broken =
        "a vertex jumped by " + number(c.moved) + " of the body's size in a cut, " + number(farthest / size) + " away";
  else if (!(c.kicked <= kLargestKick)) c.broken = "a vertex' velocity jumped by " + number(c.kicked) + " in a cut";
  else if (!(c.gained <= kLargestGain))
    c.broken = "a cut added " + number(c.gained) + " to the kinetic energy of " + number(before.kinetic) +
               " J; mass changed by " + number(after.mass / before.mass - 1) + ", momentum by " +
               number(norm(after.momentum - before.momentum)) + " kg m/s";
  return c;
}

}  // namespace kerf::test
