#include "kerf/session/lattice_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/byte_count.h"
#include "kerf/base/memory_limit.h"
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

Status check_lattice_memory(const Scene& scene, const CollisionMesh& mesh, const LatticeFrame& frame) {
  const LatticeMemory need = lattice_memory(mesh, frame, scene.simulation.preconditioner);
  const std::uint64_t most = memory_limit();
  if (need.bytes <= most) return {};
  const bool direct = scene.simulation.preconditioner == ScenePreconditioner::kDirect;
  return at_line(
      scene, scene.lattice.line,
      bad_input(fmt::format(
          "[lattice]: {} x {} x {} cells, about {} of them with material, would take about {} of memory{}, and {} are the most "
          "({}); give fewer or larger cells{}, or allow more with --memory",
          frame.count[0], frame.count[1], frame.count[2], need.hexahedra, bytes_text(need.bytes),
          direct ? " with preconditioner \"direct\"" : "", bytes_text(most),
          memory_limit_is_given() ? "--memory" : "half of what is free", direct ? " or another preconditioner" : "")));
}

}  // namespace kerf
