// A session of a model, and what can be measured of it by its meshes alone.
#pragma once

#include <string>
#include <vector>

#include "kerf/contact/surface_offsets.h"
#include "session/make_session.h"

namespace kerf::test {

/// Of `model`, with gravity along z, m/s^2, and blades that cut `layers` layers.
inline Session model_session(const std::string& model, double gravity, int layers, double time_step = 0.002) {
  Scene scene;
  scene.name = model;
  scene.body.model = model;
  scene.simulation.time_step = time_step;
  scene.simulation.gravity = {0, 0, gravity};
  scene.cut.layers = layers;
  return make(scene);
}

/// The collision surface of the first body where it is now.
struct SurfaceNow {
  ContactSurface surface;
  std::vector<Vec3> positions, offsets;  ///< per vertex: of the mid-surface, from it to the upper side; m
};
inline SurfaceNow surface_now(Session& session) {
  const Body& body = session.body();
  SurfaceNow now{make_contact_surface(body.complex.collision), session.collision_positions(), {}};
  now.offsets.resize(now.surface.vertex_count());
  surface_offsets(body.hex, body.embedding, now.surface, session.node_positions(), now.offsets);
  return now;
}

inline Box3 box_of(Session& session) {
  Box3 box;
  for (const Vec3 p : session.collision_positions()) box.add(p);
  return box;
}

/// Enclosed volume of all visual triangles at rest, m^3.
inline double enclosed_volume(const Session& session) {
  const VisualMesh& m = session.body().complex.visual;
  double v = 0;
  for (std::size_t f = 0; f < m.face_count(); ++f)
    v += dot(m.rest[m.origin[VisualHalfEdge(3 * f)]],
             cross(m.rest[m.origin[VisualHalfEdge(3 * f + 1)]], m.rest[m.origin[VisualHalfEdge(3 * f + 2)]])) /
         6;
  return v;
}

/// Length of the lips of all cuts at rest, on one side, m.
inline double cut_length(const Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  double length = 0;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count()))
    if (mesh.is_border(h) && mesh.wall[h].valid())
      length += 0.5 * norm(mesh.rest[mesh.from(h)] - mesh.rest[mesh.to(h)]);
  return length;
}

/// Of all hexahedra, kg.
inline double mass(const Session& session) {
  double m = 0;
  for (const HexMaterial& h : session.body().hex.material.raw()) m += session.material().density * h.mass_volume;
  return m;
}

}  // namespace kerf::test
