#include "kerf/mechanics/contact_coarse.h"

#include <algorithm>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

using Part = ContactCoarse::Part;

/// Every pressing row on the motions of the groups and tools that it touches, by descending place.
void find_parts(const MechanicsModel& model, StepWorkspace& w) {
  const CoarseStructure& s = model.coarse();
  const ContactSet& set = *w.contact.set;
  ContactCoarse& c = w.coarse.contact;
  c.parts.clear();
  c.part_begin.assign(1, 0);
  for (const std::int32_t r : w.contact.pressing) {
    const ContactRow& row = set.rows[r];
    const auto first = static_cast<std::ptrdiff_t>(c.parts.size());
    const auto part_of = [&](std::int32_t place) -> Part& {
      for (std::size_t i = static_cast<std::size_t>(first); i < c.parts.size(); ++i)
        if (c.parts[i].place == place) return c.parts[i];
      c.parts.push_back({place, 0, {}});
      return c.parts.back();
    };
    for (std::int32_t k = row.first; k < row.first + row.count; ++k) {
      const std::size_t node = set.entries[k].node.index();
      if (s.place[node] < 0) continue;
      const double weight = set.entries[k].weight;
      Part& part = part_of(s.place[node]);
      part.weight += weight;
      for (int a = 0; a < 3; ++a) part.arm[a] += weight * w.arm[node].v[a];
    }
    if (row.rigid >= 0) {
      c.parts.push_back({s.groups + row.rigid, -1, {}});
      for (int a = 0; a < 3; ++a) c.parts.back().arm[a] = -row.arm[a];
    }
    std::sort(c.parts.begin() + first, c.parts.end(), [](const Part& a, const Part& b) { return a.place > b.place; });
    c.part_begin.push_back(static_cast<std::int32_t>(c.parts.size()));
  }
}

void extend_structure(const MechanicsModel& model, StepWorkspace& w) {
  const BlockCholeskyStructure& base = model.coarse().cholesky;
  ContactCoarse& c = w.coarse.contact;
  const auto tools = static_cast<std::int32_t>(w.contact.tools.size());
  const bool same_base = c.base_order == base.order && c.base_rows == base.block_row &&
                         c.base_columns == base.column_begin && c.cholesky.rows == base.rows + tools;
  if (!same_base) {
    c.base_order = base.order;
    c.base_rows = base.block_row;
    c.base_columns = base.column_begin;
    c.extra.clear();
    c.cholesky = extended(base, tools, c.extra);
  }
  c.missing.clear();
  for (std::size_t r = 0; r + 1 < c.part_begin.size(); ++r)
    for (std::int32_t a = c.part_begin[r]; a < c.part_begin[r + 1]; ++a)
      for (std::int32_t b = a + 1; b < c.part_begin[r + 1]; ++b)
        if (c.cholesky.find_block(c.parts[a].place, c.parts[b].place) < 0)
          c.missing.emplace_back(c.parts[a].place, c.parts[b].place);
  if (!c.missing.empty()) {
    c.extra.insert(c.extra.end(), c.missing.begin(), c.missing.end());
    std::sort(c.extra.begin(), c.extra.end());
    c.extra.erase(std::unique(c.extra.begin(), c.extra.end()), c.extra.end());
    c.cholesky = extended(base, tools, c.extra);
  }
  if (same_base && c.missing.empty()) return;
  c.stored.resize(base.block_count());
  for (std::int32_t q = 0; q < base.rows; ++q) {
    c.stored[q] = q;
    for (std::int32_t b = base.column_begin[q]; b < base.column_begin[q + 1]; ++b)
      c.stored[base.rows + b] = c.cholesky.find_block(base.block_row[b], q);
  }
}

/// What a row with block P (3 x 3) feels of the six motions of a part: P (weight t + w x arm), one row of 6 and two zeros for every axis.
struct Felt {
  Lanes low[3], high[3];
};
Felt felt_of(const double (&p)[3][3], const Part& part) {
  const double w = part.weight, *a = part.arm;
  Felt out;
  for (int r = 0; r < 3; ++r) {
    const double* q = p[r];
    out.low[r] = Lanes{w * q[0], w * q[1], w * q[2], q[2] * a[1] - q[1] * a[2]};
    out.high[r] = Lanes{q[0] * a[2] - q[2] * a[0], q[1] * a[0] - q[0] * a[1], 0, 0};
  }
  return out;
}

/// block += felt' (weight t + w x arm), column by column.
void add_felt(const Felt& f, const Part& part, double* block) {
  const double w = part.weight, *a = part.arm;
  const auto add = [&](int column, double x, int r, double y, int q) {
    double* out = block + 8 * column;
    store_lanes(out, load_lanes(out) + x * f.low[r] + y * f.low[q]);
    store_lanes(out + 4, load_lanes(out + 4) + x * f.high[r] + y * f.high[q]);
  };
  for (int r = 0; r < 3; ++r) add(r, w, r, 0, r);
  add(3, -a[2], 1, a[1], 2);
  add(4, a[2], 0, -a[0], 2);
  add(5, -a[1], 0, a[0], 1);
}

}  // namespace

const BlockCholeskyStructure& coarse_cholesky(const MechanicsModel& model, const StepWorkspace& w) {
  return w.contact.set != nullptr ? w.coarse.contact.cholesky : model.coarse().cholesky;
}

void add_contacts_to_coarse(const MechanicsModel& model, StepWorkspace& w) {
  const BlockCholeskyStructure& base = model.coarse().cholesky;
  CoarseSpace& coarse = w.coarse;
  ContactCoarse& c = coarse.contact;
  find_parts(model, w);
  extend_structure(model, w);
  coarse.factored.assign(kBlockDoubles * c.cholesky.block_count(), 0.0);
  for (std::size_t b = 0; b < c.stored.size(); ++b)
    std::copy_n(coarse.blocks.data() + kBlockDoubles * b, kBlockDoubles,
                coarse.factored.data() + kBlockDoubles * static_cast<std::size_t>(c.stored[b]));
  for (std::size_t i = 0; i < w.contact.tools.size(); ++i) {
    double* block = coarse.factored.data() + kBlockDoubles * (static_cast<std::size_t>(base.rows) + i);
    for (int a = 0; a < 3; ++a) {
      block[9 * a] = w.contact.tools[i].mass;
      block[9 * (3 + a)] = w.contact.tools[i].inertia;
    }
  }
  for (std::size_t i = 0; i < w.contact.pressing.size(); ++i) {
    const double* p = w.contact.rows[w.contact.pressing[i]].block;
    const double full[3][3] = {{p[0], p[3], p[5]}, {p[3], p[1], p[4]}, {p[5], p[4], p[2]}};
    for (std::int32_t a = c.part_begin[i]; a < c.part_begin[i + 1]; ++a) {
      const Felt felt = felt_of(full, c.parts[a]);
      for (std::int32_t b = a; b < c.part_begin[i + 1]; ++b)
        add_felt(felt, c.parts[b],
                 coarse.factored.data() + kBlockDoubles * static_cast<std::size_t>(c.cholesky.find_block(
                                                              c.parts[a].place, c.parts[b].place)));
    }
  }
}

}  // namespace kerf
