// A blade's move with all its steps, on a body without mechanics.
#pragma once

#include "kerf/cutting/blade_sweep.h"

namespace kerf::testing_support {

/// `bench` has a body, position, boxes, scratch, options and a stroke. `still`: nothing has moved since the last pose.
template <class Bench>
SweepReport move_blade(Bench& bench, const BladeEdge& edge, bool still = false) {
  SweepTarget target{bench.body, bench.position, bench.boxes, bench.scratch, bench.options, still};
  BladeStroke& stroke = bench.stroke;
  if (stroke.provisional) {
    journal_rollback(bench.body, stroke.mark);
    bench.position.resize(bench.body.collision.vertex_count());
    bench.boxes.forget();
    stroke.provisional = false;
  }
  SweepReport report = lead_blade(stroke, edge, target);
  journal_mark(bench.body, stroke.mark);
  return report += make_ends(stroke, target);
}

}  // namespace kerf::testing_support
