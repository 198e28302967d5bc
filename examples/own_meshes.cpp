// Cuts a mesh of one's own: a disc is written as OBJ, read back as a body, bound, and halved.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "kerf/kerf.h"

namespace {

constexpr int kRound = 48, kRings = 8;
constexpr double kRadius = 0.05, kHalf = 0.004;  // metres

/// A closed disc: two faces of rings of triangles, and the side between them.
kerf::TriangleMesh disc() {
  kerf::TriangleMesh mesh;
  const auto vertex = [](int side, int ring, int k) {
    const int faces = 1 + kRings * kRound;
    return kerf::VertexId(side * faces + (ring == 0 ? 0 : 1 + (ring - 1) * kRound + k % kRound));
  };
  for (const double z : {kHalf, -kHalf}) {
    mesh.positions.push_back({0, 0, z});
    for (int ring = 1; ring <= kRings; ++ring)
      for (int k = 0; k < kRound; ++k) {
        const double radius = kRadius * ring / kRings, angle = 2 * std::numbers::pi * k / kRound;
        mesh.positions.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
      }
  }
  const auto add = [&](kerf::VertexId a, kerf::VertexId b, kerf::VertexId c) { mesh.triangles.push_back({a, b, c}); };
  for (int k = 0; k < kRound; ++k) {
    for (int ring = 0; ring < kRings; ++ring) {
      add(vertex(0, ring, k), vertex(0, ring + 1, k), vertex(0, ring + 1, k + 1));
      add(vertex(1, ring, k), vertex(1, ring + 1, k + 1), vertex(1, ring + 1, k));
      if (ring == 0) continue;
      add(vertex(0, ring, k), vertex(0, ring + 1, k + 1), vertex(0, ring, k + 1));
      add(vertex(1, ring, k), vertex(1, ring, k + 1), vertex(1, ring + 1, k + 1));
    }
    add(vertex(0, kRings, k), vertex(1, kRings, k), vertex(1, kRings, k + 1));
    add(vertex(0, kRings, k), vertex(1, kRings, k + 1), vertex(0, kRings, k + 1));
  }
  return mesh;
}

int fail(const kerf::Error& error) { return std::fprintf(stderr, "%s\n", error.message.c_str()), 1; }

}  // namespace

int main() {
  if (const kerf::Status written = kerf::write_obj("disc.obj", disc()); !written.ok()) return fail(written.error());

  // The collision mesh is made from the visual one. A scene may name one of its own: scene.body.collision.
  kerf::Scene scene;
  scene.body.visual = "disc.obj";
  scene.material.young = 2e4;  // pascals
  scene.simulation.gravity = {};
  kerf::Result<kerf::Session> session = kerf::Session::create(scene);
  if (!session.ok()) return fail(session.error());
  for (const std::string& note : session->notes()) std::printf("note: %s\n", note.c_str());

  kerf::Status done = session->begin_stroke(kerf::SceneFrame::kRest, false);
  for (const double x : {-2 * kRadius, 2 * kRadius})
    if (done.ok()) done = session->move_blade({x, 0.003, 0.1}, {x, 0.003, -0.1});
  if (done.ok()) done = session->end_stroke();
  if (done.ok()) done = session->validate();
  if (!done.ok()) return fail(done.error());
  std::printf("%d pieces\n", session->counts().pieces);
  return session->counts().pieces == 2 ? 0 : 1;
}
