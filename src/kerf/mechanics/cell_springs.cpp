#include "kerf/mechanics/cell_springs.h"

#include <algorithm>

#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

using Structure = MechanicsModel::Structure;
using Batch = MechanicsModel::Batch;
constexpr std::size_t kLanes = MechanicsModel::kLanes;

/// The spring's weights by corner of the cell in this lane, or false: it has other nodes, too.
bool weigh_corners(const RowSpring& spring, const Batch& batch, std::size_t lane, std::array<double, 8>& by_corner) {
  by_corner.fill(0);
  for (std::size_t k = 0; k < 8; ++k) {
    if (!spring.nodes[k].valid()) continue;
    std::size_t c = 0;
    while (c < 8 && batch.node[c][lane] != spring.nodes[k].value) ++c;
    if (c == 8) return false;
    by_corner[c] += spring.weights[k];
  }
  return true;
}

}  // namespace

void place_springs_in_cells(const MechanicsModel& model, CellSprings& out) {
  const Structure& s = model.structure();
  out.springs.clear();
  out.cells.clear();
  out.batches.clear();
  out.rows.clear();
  out.is_row.assign(s.springs.size(), 0);
  struct Found {
    std::size_t slot = 0;  // of the cell
    CellSprings::Spring spring;
  };
  std::vector<Found> all;
  for (std::size_t i = 0; i < s.springs.size(); ++i) {
    const RowSpring& spring = model.springs()[static_cast<std::size_t>(s.springs[i])];
    Found found;
    found.spring.spring = static_cast<std::int32_t>(i);
    bool is_found = false;
    const std::size_t node = spring.nodes[0].index();
    for (auto k = static_cast<std::size_t>(s.slot_begin[node]); k < static_cast<std::size_t>(s.slot_begin[node + 1]);
         ++k) {
      const auto slot = static_cast<std::size_t>(s.slots[k]);
      if (slot >= s.element_slots) break;
      const std::size_t batch = slot / (8 * kLanes);
      found.slot = slot / 8;
      is_found = batch >= s.full_batches &&
                 weigh_corners(spring, s.batches[batch], found.slot % kLanes, found.spring.by_corner);
      if (is_found) break;
    }
    if (is_found) {
      all.push_back(found);
    } else {
      out.rows.push_back(static_cast<std::int32_t>(i));
      out.is_row[i] = 1;
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Found& a, const Found& b) { return a.slot < b.slot; });
  std::size_t last = s.element_slots;
  for (const Found& found : all) {
    const auto batch = static_cast<std::int32_t>(found.slot / kLanes);
    if (out.batches.empty() || out.batches.back() != batch) out.batches.push_back(batch);
    if (found.slot != last)
      out.cells.push_back({static_cast<std::int32_t>(out.batches.size() - 1),
                           static_cast<std::int32_t>(found.slot % kLanes),
                           static_cast<std::int32_t>(out.springs.size()), 0});
    last = found.slot;
    ++out.cells.back().count;
    out.springs.push_back(found.spring);
  }
}

void add_springs_to_cells(const MechanicsModel& model, StepWorkspace& w, double dt) {
  const Structure& s = model.structure();
  const CellSprings& all = s.cell_springs;
  constexpr std::size_t kBlock = MechanicsModel::kOwnBlock;
  w.sprung.resize(kBlock * all.batches.size());
  for (std::size_t b = 0; b < all.batches.size(); ++b) {
    const double* own = model.own_block(s.batches[static_cast<std::size_t>(all.batches[b])].own);
    std::copy(own, own + kBlock, w.sprung.data() + kBlock * b);
  }
  for (const CellSprings::Cell& cell : all.cells) {
    const auto block = static_cast<std::size_t>(cell.block), lane = static_cast<std::size_t>(cell.lane);
    const std::int32_t e = s.batches[static_cast<std::size_t>(all.batches[block])].element[lane];
    const MechanicsElement& element = model.element(HexId(e));
    const double damping = model.materials()[static_cast<std::size_t>(element.material)].damping_stiffness;
    const double square = (dt * dt + dt * damping) * element.young_scale;
    if (!(square > 0)) continue;  // no time passes
    double sum[8][8] = {};
    for (std::int32_t i = cell.first; i < cell.first + cell.count; ++i) {
      const CellSprings::Spring& spring = all.springs[static_cast<std::size_t>(i)];
      const double scale = w.spring_scale[static_cast<std::size_t>(spring.spring)] / square;
      for (std::size_t c = 0; c < 8; ++c)
        for (std::size_t d = 0; d < 8; ++d) sum[c][d] += (scale * spring.by_corner[c]) * spring.by_corner[d];
    }
    double* out = w.sprung.data() + kBlock * block + lane;
    for (int c = 0; c < 8; ++c)
      for (int d = c; d < 8; ++d)
        for (int axis = 0; axis < 3; ++axis)
          out[kLanes * static_cast<std::size_t>(packed_place(3 * c + axis, 3 * d + axis))] += sum[c][d];
  }
}

}  // namespace kerf
