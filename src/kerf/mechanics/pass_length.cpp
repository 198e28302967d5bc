#include "kerf/mechanics/pass_length.h"

#include <algorithm>
#include <cstddef>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/chunked_loop.h"
#include "kerf/mechanics/contact_law.h"
#include "kerf/mechanics/element_pass.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/tolerances.h"

namespace kerf {
namespace {

using namespace contact_law;

constexpr int kHalvings = 20;  // of the way: to a millionth of it

/// N s m/s: the residual that a pass starts with, and what it leaves, along its way.
struct AlongTheWay {
  double start = 0, end = 0;
};
AlongTheWay residual_along(const MechanicsModel& model, bool parallel, StepWorkspace& w) {
  const std::vector<double>& free = model.structure().free;
  const std::size_t n = w.solution.size();
  for_each_chunk(parallel, n, kNodeGrain, [&](std::size_t first, std::size_t last, std::size_t chunk) {
    Lanes start = all_lanes(0), end = all_lanes(0);
    for (std::size_t i = first; i < last; ++i) {
      const Lanes way = free[i] * (load_lanes(w.solution[i].v) - load_lanes(w.start_solution[i].v));
      start += way * load_lanes(w.start_residual[i].v);
      end += way * load_lanes(w.residual[i].v);
    }
    w.partial[chunk].v[0] = start[0] + start[1] + start[2];
    w.partial[chunk].v[1] = end[0] + end[1] + end[2];
  });
  AlongTheWay sum;
  for (std::size_t first = 0, chunk = 0; first < n; first += kNodeGrain, ++chunk) {
    sum.start += w.partial[chunk].v[0];
    sum.end += w.partial[chunk].v[1];
  }
  for (const ToolWork& tool : w.contact.tools)
    for (int a = 0; a < 6; ++a) {
      const double way = tool.solution[a] - tool.start_solution[a];
      sum.start += way * tool.start_residual[a];
      sum.end += way * tool.residual[a];
    }
  return sum;
}

}  // namespace

void start_pass(StepWorkspace& w) {
  w.start_solution = w.solution;
  w.start_residual = w.residual;
  for (ToolWork& tool : w.contact.tools) {
    std::copy(tool.solution, tool.solution + 6, tool.start_solution);
    std::copy(tool.residual, tool.residual + 6, tool.start_residual);
  }
}

double end_pass(const MechanicsModel& model, double h, bool parallel, StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  const AlongTheWay residual = residual_along(model, parallel, w);
  for (std::size_t r = 0; r < c.rows.size(); ++r)
    if (c.rows[r].stiffness > 0)
      c.rows[r].way = relative(set, set.rows[r], w.solution, c.tools, &ToolWork::solution) - c.rows[r].motion;
  const auto descent = [&](double t) {  // minus the slope of the energy
    double sum = (1 - t) * residual.start + t * residual.end;
    for (std::size_t r = 0; r < c.rows.size(); ++r) {
      const Row& row = c.rows[r];
      if (!(row.stiffness > 0)) continue;
      const Vec3 motion = row.motion + t * row.way;
      sum += dot(row.way, impulse_at(set, set.rows[r], row, h, motion) - linear_impulse_at(row, motion));
    }
    return sum;
  };
  const double at_start = descent(0);
  if (!(at_start > 0) || !(descent(1) < -kSteepestEnd * at_start)) return 1;
  double low = 0, high = 1;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (descent(middle) > 0 ? low : high) = middle;
  }
  for_each_chunk(parallel, w.solution.size(), kNodeGrain, [&](std::size_t first, std::size_t last, std::size_t) {
    for (std::size_t i = first; i < last; ++i) {
      const Lanes x = load_lanes(w.start_solution[i].v), r = load_lanes(w.start_residual[i].v);
      store_lanes(w.solution[i].v, x + high * (load_lanes(w.solution[i].v) - x));
      store_lanes(w.residual[i].v, r + high * (load_lanes(w.residual[i].v) - r));
    }
  });
  for (ToolWork& tool : c.tools)
    for (int a = 0; a < 6; ++a) {
      tool.solution[a] = tool.start_solution[a] + high * (tool.solution[a] - tool.start_solution[a]);
      tool.residual[a] = tool.start_residual[a] + high * (tool.residual[a] - tool.start_residual[a]);
    }
  return high;
}

}  // namespace kerf
