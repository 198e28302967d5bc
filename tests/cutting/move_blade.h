// A blade's move with all its steps, on a body without mechanics.
#pragma once

#include "kerf/cutting/blade_sweep.h"

namespace kerf::testing_support {

/// `bench` has a body, positions, those `posed` last, boxes, scratch, options and a stroke.
template <class Bench>
SweepReport move_blade(Bench& bench, const BladeEdge& edge) {
  BladeStroke& stroke = bench.stroke;
  if (stroke.provisional) {
    journal_rollback(bench.body, stroke.mark);
    bench.position.resize(bench.body.collision.vertex_count());
    bench.boxes.forget();
    stroke.provisional = false;
  }
  bench.posed.resize(std::min(bench.posed.size(), bench.body.collision.vertex_count()));
  SweepTarget target{bench.body,    bench.position, bench.boxes,
                     bench.scratch, bench.options,  bench.posed.empty() ? nullptr : &bench.posed};
  SweepReport report = lead_blade(stroke, edge, target);
  journal_mark(bench.body, stroke.mark);
  report += make_ends(stroke, target);
  bench.posed = bench.position;
  return report;
}

}  // namespace kerf::testing_support
