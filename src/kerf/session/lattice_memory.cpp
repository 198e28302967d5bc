#include "kerf/session/lattice_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/byte_count.h"
#include "kerf/base/memory_limit.h"
#include "kerf/base/shown_text.h"
#include "kerf/lattice/lattice_count.h"
#include "kerf/scene/scene_place.h"
#include "kerf/session/memory_tolerances.h"

namespace kerf {

LatticeMemory lattice_memory(const CollisionMesh& mesh, const LatticeFrame& frame, ScenePreconditioner preconditioner) {
  LatticeMemory out;
  out.cells = frame.cell_count();
  out.hexahedra = count_material_cells(mesh, frame);
  const auto n = static_cast<double>(out.hexahedra);
  double bytes = kBytesPerCell * static_cast<double>(out.cells) + kBytesPerHexahedron * n;
  if (preconditioner == ScenePreconditioner::kDirect) {
    const double layers = *std::min_element(frame.count.begin(), frame.count.end());
    const double columns = std::max(n / layers, 4.0);
    bytes += n * std::min(kSheetFactorBytes * (layers + 1) * (layers + 1) / layers * 0.5 * std::log2(columns),
                          kThickFactorBytes * std::cbrt(n));
  }
  out.bytes = static_cast<std::uint64_t>(bytes);
  return out;
}

Status check_model_memory(const Scene& scene) {
  const auto triangles = [](const SceneBody& b) {
    return b.model.empty() || b.loaded ? 0.0 : static_cast<double>(b.options.visual_triangles);
  };
  const SceneBody* largest = &scene.body;
  double together = triangles(scene.body);
  for (const SceneBody& body : scene.more_bodies) {
    together += triangles(body);
    if (triangles(body) > triangles(*largest)) largest = &body;
  }
  const std::uint64_t most = memory_limit();
  if (together * kBytesPerModelTriangle <= static_cast<double>(most)) return {};
  const auto need = [](double n) { return bytes_text(static_cast<std::uint64_t>(n * kBytesPerModelTriangle)); };
  const std::string whole = scene.more_bodies.empty() ? ""
                                                      : fmt::format(" ({} bodies, {} together)",
                                                                    scene.more_bodies.size() + 1, need(together));
  return at_line(scene, largest->line,
                 bad_input(fmt::format(
                     "[body]: model {} with {} visual triangles would take about {} of memory{}, and {} are the most "
                     "({}); give fewer visual_triangles, or allow more with --memory",
                     shown(largest->model), largest->options.visual_triangles, need(triangles(*largest)), whole,
                     bytes_text(most), memory_limit_is_given() ? "--memory" : "half of what is free")));
}

Status check_lattice_memory(const Scene& scene, std::span<const BodyMemory> bodies) {
  const std::uint64_t most = memory_limit();
  std::uint64_t together = 0;
  const BodyMemory* largest = nullptr;
  for (const BodyMemory& body : bodies) {
    together += body.need.bytes;
    if (largest == nullptr || body.need.bytes > largest->need.bytes) largest = &body;
  }
  if (together <= most) return {};
  const bool direct = scene.simulation.preconditioner == ScenePreconditioner::kDirect;
  const LatticeIndex n = largest->frame.count;
  const std::string whole =
      bodies.size() == 1 ? "" : fmt::format(" ({} bodies, {} together)", bodies.size(), bytes_text(together));
  return at_line(
      scene, scene.lattice.line,
      bad_input(fmt::format(
          "[lattice]: {} x {} x {} cells, about {} of them with material, would take about {} of memory{}{}, and {} are the most "
          "({}); give fewer or larger cells{}, or allow more with --memory",
          n[0], n[1], n[2], largest->need.hexahedra, bytes_text(largest->need.bytes), whole,
          direct ? " with preconditioner \"direct\"" : "", bytes_text(most),
          memory_limit_is_given() ? "--memory" : "half of what is free", direct ? " or another preconditioner" : "")));
}

std::string lack_of_memory(const Scene& scene, std::span<const BodyMemory> bodies) {
  constexpr const char* kMore = "or let the program have more (ulimit -v)";
  if (bodies.empty()) {
    const SceneBody& body = scene.body;
    const std::string what = !scene.more_bodies.empty() ? fmt::format("{} bodies", scene.more_bodies.size() + 1)
                             : !body.model.empty()      ? fmt::format("model {}", shown(body.model))
                             : !body.visual.empty()     ? shown(body.visual)
                                                        : shown(body.bound);
    return fmt::format("{}[body]: not enough memory to make a body of {}; give fewer triangles, {}",
                       scene_place(scene, body.line), what, kMore);
  }
  const BodyMemory& largest = *std::max_element(
      bodies.begin(), bodies.end(), [](const auto& a, const auto& b) { return a.need.bytes < b.need.bytes; });
  const LatticeIndex n = largest.frame.count;
  return fmt::format(
      "{}[lattice]: not enough memory to make {} x {} x {} cells, about {} of them with material, which take about {}; give fewer or "
      "larger cells, {}",
      scene_place(scene, scene.lattice.line > 0 ? scene.lattice.line : scene.body.line), n[0], n[1], n[2],
      largest.need.hexahedra, bytes_text(largest.need.bytes), kMore);
}

}  // namespace kerf
