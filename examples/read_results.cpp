// Reads what comes of a scene: forces step by step, pieces and their volumes, what each stroke did.
#include <cstdio>
#include <vector>

#include "kerf/kerf.h"

namespace {

/// Volume of each piece of the drawn mesh at rest, m^3: triangles that share vertices belong together.
std::vector<double> piece_volumes(const kerf::VisualMesh& mesh) {
  std::vector<std::int32_t> piece(mesh.vertex_count());
  for (std::size_t i = 0; i < piece.size(); ++i) piece[i] = static_cast<std::int32_t>(i);
  const auto find = [&](std::int32_t i) {
    while (piece[i] != i) i = piece[i] = piece[piece[i]];
    return i;
  };
  for (const kerf::VisualTriangle f : kerf::ids<kerf::VisualTriangle>(mesh.face_count()))
    for (int k = 0; k < 3; ++k) {
      const kerf::VisualHalfEdge h = kerf::VisualMesh::corner(f, k);
      piece[find(mesh.from(h).value)] = find(mesh.to(h).value);
    }
  std::vector<double> volume(piece.size());
  for (const kerf::VisualTriangle f : kerf::ids<kerf::VisualTriangle>(mesh.face_count())) {
    kerf::Vec3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = mesh.rest[mesh.from(kerf::VisualMesh::corner(f, k))];
    volume[find(mesh.from(kerf::VisualMesh::corner(f, 0)).value)] += kerf::dot(p[0], kerf::cross(p[1], p[2])) / 6;
  }
  std::vector<double> of_pieces;
  for (const double v : volume)
    if (v != 0) of_pieces.push_back(v);
  return of_pieces;
}

}  // namespace

int main() {
  const kerf::Result<kerf::Scene> scene = kerf::parse_scene(
      "[body]\nmodel = \"steak\"\n"
      "[simulation]\ntime_step = 0.005\nduration = 0.5\n"
      "[[fix]]\nhalf_space = { point = [0, 0.05, 0], normal = [0, 1, 0] }\n"
      "[[command]]\nat = 0.1\ntype = \"blade\"\nframe = \"rest\"\nposes = [\n"
      "  { time = 0, base = [-0.12, 0, 0.05], tip = [-0.12, 0, -0.05] },\n"
      "  { time = 0.2, base = [0.12, 0.01, 0.05], tip = [0.12, 0.01, -0.05] } ]\n",
      "read_results");
  if (!scene.ok()) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  kerf::Result<kerf::Session> session = kerf::Session::create(*scene);
  if (!session.ok()) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;

  std::printf("time s, support force N, iterations, pieces\n");
  while (session->time() < scene->simulation.duration) {
    const kerf::Result<kerf::SessionStep> step = session->step();
    if (!step.ok()) return std::fprintf(stderr, "%s\n", step.error().message.c_str()), 1;
    if (session->step_count() % 20 == 0)
      std::printf("%.3f, %.3f, %d, %d\n", session->time(), kerf::norm(session->support_force()),
                  step->mechanics.iterations, session->counts().pieces);
  }
  for (const kerf::StrokeRecord& s : session->strokes())
    std::printf("stroke of %.3f s: %d triangles, cut in %.2f ms\n", s.ended - s.began, s.triangles,
                1e3 * s.times.total);
  const std::vector<double> volumes = piece_volumes(session->body().complex.visual);
  for (const double v : volumes) std::printf("a piece of %.1f cm3\n", 1e6 * v);
  return volumes.size() == 2 ? 0 : 1;
}
