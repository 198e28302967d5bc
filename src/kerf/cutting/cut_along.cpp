#include "kerf/cutting/cut_along.h"

namespace kerf {

SweepReport cut_along(std::span<const BladeEdge> edges, bool through, SweepTarget& target) {
  BladeStroke stroke;
  stroke.through = through;
  SweepReport report;
  for (const BladeEdge& edge : edges) report += lead_blade(stroke, edge, target);
  return report += make_ends(stroke, target);
}

}  // namespace kerf
