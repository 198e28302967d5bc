#include "kerf/mechanics/node_matrix.h"

#include <cstring>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

using Structure = MechanicsModel::Structure;
constexpr int kLanes = NodeMatrixStructure::kLanes;
static_assert(kLanes == MechanicsModel::kLanes);

using Four = float __attribute__((vector_size(16)));
using Eight = float __attribute__((vector_size(32)));

template <class T>
inline T load_floats(const float* p) {
  T v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
template <class T>
inline void store_floats(float* p, const T& v) {
  std::memcpy(p, &v, sizeof v);
}

/// Where column `k` of a block is.
inline float* column_of(NodeBlockPair* blocks, std::int32_t block, int k) {
  return blocks[block / 2].v[k] + 4 * (block % 2);
}

/// Four columns of numbers side by side: [row][lane] -> per lane (a, b, c, 0), added to column `k` of a block.
inline void add_columns(const Lanes& a, const Lanes& b, const Lanes& c, const std::int32_t* target, int k,
                        NodeBlockPair* blocks) {
  const Four x = __builtin_convertvector(a, Four), y = __builtin_convertvector(b, Four),
             z = __builtin_convertvector(c, Four), none = {};
  const Four xy_low = __builtin_shufflevector(x, y, 0, 4, 1, 5), xy_high = __builtin_shufflevector(x, y, 2, 6, 3, 7);
  const Four z_low = __builtin_shufflevector(z, none, 0, 4, 1, 5),
             z_high = __builtin_shufflevector(z, none, 2, 6, 3, 7);
  const Four column[kLanes] = {
      __builtin_shufflevector(xy_low, z_low, 0, 1, 4, 5), __builtin_shufflevector(xy_low, z_low, 2, 3, 6, 7),
      __builtin_shufflevector(xy_high, z_high, 0, 1, 4, 5), __builtin_shufflevector(xy_high, z_high, 2, 3, 6, 7)};
  for (int lane = 0; lane < kLanes; ++lane) {
    float* out = column_of(blocks, target[lane], k);
    store_floats(out, load_floats<Four>(out) + column[lane]);
  }
}

/// The block of a pair of nodes, or -1.
std::int32_t block_of(const NodeMatrixStructure& s, NodeId row, NodeId column) {
  for (std::int32_t k = s.row_begin[row.index()]; k < s.row_begin[row.index() + 1]; ++k)
    if (s.column[k] == column.value) return k;
  return -1;
}

void place_springs(const MechanicsModel& model, NodeMatrixStructure& out) {
  out.springs.clear();
  out.rows.clear();
  const std::vector<std::int32_t>& live = model.structure().springs;
  for (std::size_t i = 0; i < live.size(); ++i) {
    const RowSpring& spring = model.springs()[live[i]];
    NodeMatrixStructure::Spring placed;
    placed.spring = static_cast<std::int32_t>(i);
    bool all = true;
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b) {
        const bool pair = a != b && spring.nodes[a].valid() && spring.nodes[b].valid();
        placed.block[a][b] = pair ? block_of(out, spring.nodes[a], spring.nodes[b]) : -1;
        all = all && (!pair || placed.block[a][b] >= 0);
      }
    if (all) out.springs.push_back(placed);
    else out.rows.push_back(placed.spring);
  }
}

}  // namespace

void node_matrix_structure(const MechanicsModel& model, NodeMatrixStructure& out) {
  const Structure& s = model.structure();
  const std::size_t n = model.node_count();
  out.row_begin.assign(n + 1, 0);
  out.column.clear();
  out.fours.clear();
  int lane = 0;
  std::vector<std::int32_t> place(s.element_slots / 8, -1);  // of an element's slots in the list
  for (std::size_t e = 0; e < s.element_slot.size(); ++e) {
    if (s.element_slot[e] < 0) continue;
    if (lane == 0) {
      out.fours.emplace_back();
      out.fours.back().lane.fill(-1);
    }
    const std::int32_t slot = s.element_slot[e] / 8;
    place[slot] = static_cast<std::int32_t>(kLanes * (out.fours.size() - 1)) + lane;
    out.fours.back().batch[lane] = slot / kLanes;
    out.fours.back().lane[lane] = slot % kLanes;
    lane = (lane + 1) % kLanes;
  }
  out.target.assign(2 * kCornerPairs * kLanes * out.fours.size(), 0);
  std::array<std::array<std::size_t, 8>, 8> pair;
  std::size_t next = 0;
  for (std::size_t c = 0; c < 8; ++c)
    for (std::size_t d = c + 1; d < 8; ++d, ++next) {
      pair[c][d] = next;
      pair[d][c] = next + kCornerPairs;
    }
  std::vector<std::int32_t> block(n, -1);  // of a column in the row at hand
  for (std::size_t i = 0; i < n; ++i) {
    const auto begin = static_cast<std::int32_t>(out.column.size());
    out.row_begin[i] = begin;
    for (std::int32_t k = s.slot_begin[i]; k < s.slot_begin[i + 1]; ++k) {
      const auto slot = static_cast<std::size_t>(s.slots[k]);
      if (slot >= s.element_slots) continue;
      const auto at = static_cast<std::size_t>(place[slot / 8]);
      const MechanicsModel::Batch& batch = s.batches[slot / (8 * kLanes)];
      for (std::size_t d = 0; d < 8; ++d) {
        if (d == slot % 8) continue;
        const std::int32_t j = batch.node[d][slot / 8 % kLanes];
        if (block[j] < begin) {
          block[j] = static_cast<std::int32_t>(out.column.size());
          out.column.push_back(j);
        }
        out.target[(2 * kCornerPairs * (at / kLanes) + pair[slot % 8][d]) * kLanes + at % kLanes] = block[j];
      }
    }
    if (out.column.size() % 2 != 0) out.column.push_back(static_cast<std::int32_t>(i));
  }
  out.row_begin[n] = static_cast<std::int32_t>(out.column.size());
  place_springs(model, out);
  out.full.resize(s.full_batches > 0 ? s.shared.size() : 0);
  for (std::size_t m = 0; m < out.full.size(); ++m) {
    const ElementMatrix k = dense(s.shared[m]);
    for (int i = 0; i < 24; ++i)
      for (int j = i; j < 24; ++j) {
        const int from = 24 * i + j, to = packed_place(i, j);
        out.full[m][static_cast<std::size_t>(to)] = k[static_cast<std::size_t>(from)];
      }
  }
}

void assemble_node_matrix(const MechanicsModel& model, StepWorkspace& w) {
  const Structure& s = model.structure();
  const NodeMatrixStructure& structure = model.node_matrix();
  w.node_blocks.assign(structure.column.size() / 2, {});
  NodeBlockPair* blocks = w.node_blocks.data();
  for (std::size_t f = 0; f < structure.fours.size(); ++f) {
    const NodeMatrixStructure::Four& four = structure.fours[f];
    // Numbers of the four elements: an idle lane reads those of the first, turned into nothing.
    const double* number[kLanes];
    int stride[kLanes];
    Lanes r[3][3], q[3], tension = all_lanes(0);  // q: -1 / (4 h)
    for (int i = 0; i < 9; ++i) r[i / 3][i % 3] = all_lanes(0);
    for (int lane = 0; lane < kLanes; ++lane) {
      const bool live = four.lane[lane] >= 0;
      const std::size_t b = live ? four.batch[lane] : four.batch[0];
      const int from = live ? four.lane[lane] : four.lane[0];
      const MechanicsModel::Batch& batch = s.batches[b];
      for (int a = 0; a < 3; ++a) q[a][lane] = -0.25 / model.cells()[batch.cell].size[a];
      number[lane] = batch.own < 0 ? structure.full[batch.material].data() : model.own_block(batch.own) + from;
      stride[lane] = batch.own < 0 ? 1 : kLanes;
      if (!live) continue;
      for (int i = 0; i < 9; ++i) r[i / 3][i % 3][lane] = w.scaled_rotation[9 * b + i].v[from];
      tension[lane] = w.tension[b].v[from];
    }
    const bool taut = tension[0] != 0 || tension[1] != 0 || tension[2] != 0 || tension[3] != 0;
    const std::int32_t* target = structure.target.data() + 2 * kCornerPairs * kLanes * f;
    const auto at = [&](int i, int j) {
      const int p = packed_place(i, j);
      return Lanes{number[0][p * stride[0]], number[1][p * stride[1]], number[2][p * stride[2]],
                   number[3][p * stride[3]]};
    };
    for (int c = 0; c < 7; ++c)
      for (int d = c + 1; d < 8; ++d, target += kLanes) {
        Lanes k[3][3];
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b) k[a][b] = at(3 * c + a, 3 * d + b);
        if (taut)  // the spin's three patterns of forces, as turn_back() of the element pass has them
          for (int t = 0; t < 3; ++t) {
            const int i = (t + 1) % 3, j = (t + 2) % 3;
            Lanes gc[3] = {}, gd[3] = {};
            gc[j] = (c >> i & 1) != 0 ? -q[i] : q[i];
            gc[i] = (c >> j & 1) != 0 ? q[j] : -q[j];
            gd[j] = (d >> i & 1) != 0 ? -q[i] : q[i];
            gd[i] = (d >> j & 1) != 0 ? q[j] : -q[j];
            for (int a = 0; a < 3; ++a)
              for (int b = 0; b < 3; ++b) k[a][b] += (0.25 * gc[a] * gd[b]) * tension;
          }
        Lanes kr[3][3], m[3][3];  // K R', R K R'
        for (int a = 0; a < 3; ++a)
          for (int j = 0; j < 3; ++j) kr[a][j] = k[a][0] * r[j][0] + k[a][1] * r[j][1] + k[a][2] * r[j][2];
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) m[i][j] = r[i][0] * kr[0][j] + r[i][1] * kr[1][j] + r[i][2] * kr[2][j];
        for (int j = 0; j < 3; ++j) add_columns(m[0][j], m[1][j], m[2][j], target, j, blocks);
        for (int i = 0; i < 3; ++i) add_columns(m[i][0], m[i][1], m[i][2], target + kCornerPairs * kLanes, i, blocks);
      }
  }
}

void add_springs_to_node_matrix(const MechanicsModel& model, StepWorkspace& w) {
  w.node_diagonal = w.mass_diagonal;
  for (const NodeMatrixStructure::Spring& placed : model.node_matrix().springs) {
    const RowSpring& spring = model.springs()[model.structure().springs[placed.spring]];
    const double scale = w.spring_scale[placed.spring];
    double sum = 0;
    for (const double weight : spring.weights) sum += weight;
    for (std::size_t a = 0; a < 8; ++a) {
      if (!spring.nodes[a].valid()) continue;
      w.node_diagonal[spring.nodes[a].index()] += scale * spring.weights[a] * sum;
      for (std::size_t b = 0; b < 8; ++b)
        if (placed.block[a][b] >= 0)
          for (int k = 0; k < 3; ++k)
            column_of(w.node_blocks.data(), placed.block[a][b], k)[k] +=
                static_cast<float>(scale * spring.weights[a] * spring.weights[b]);
    }
  }
}

double multiply_node_matrix(const MechanicsModel& model, StepWorkspace& w, std::size_t begin, std::size_t end) {
  const NodeMatrixStructure& s = model.node_matrix();
  const NodeBlockPair* block = w.node_blocks.data() + s.row_begin[begin] / 2;
  Lanes dot = all_lanes(0);
  for (std::size_t i = begin; i < end; ++i) {
    const Four own = load_floats<Four>(w.single[i].v);
    const Eight here = __builtin_shufflevector(own, own, 0, 1, 2, 3, 4, 5, 6, 7);
    Eight x = {}, y = {}, z = {};
    for (std::int32_t k = s.row_begin[i]; k < s.row_begin[i + 1]; k += 2, ++block) {
      const Four a = load_floats<Four>(w.single[s.column[k]].v), b = load_floats<Four>(w.single[s.column[k + 1]].v);
      const Eight d = Eight(__builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7)) - here;
      x += __builtin_shufflevector(d, d, 0, 0, 0, 0, 4, 4, 4, 4) * load_floats<Eight>(block->v[0]);
      y += __builtin_shufflevector(d, d, 1, 1, 1, 1, 5, 5, 5, 5) * load_floats<Eight>(block->v[1]);
      z += __builtin_shufflevector(d, d, 2, 2, 2, 2, 6, 6, 6, 6) * load_floats<Eight>(block->v[2]);
    }
    const Eight sum = (x + y) + z;
    const Four force =
        Four(__builtin_shufflevector(sum, sum, 0, 1, 2, 3)) + Four(__builtin_shufflevector(sum, sum, 4, 5, 6, 7));
    const Lanes p = load_lanes(w.search[i].v);
    const Lanes out = w.node_diagonal[i] * p + __builtin_convertvector(force, Lanes);
    store_lanes(w.product[i].v, out);
    dot += p * out;
  }
  return (dot[0] + dot[1]) + dot[2];
}

void narrow_search(StepWorkspace& w) {
  w.single.resize(w.search.size());
  for (std::size_t i = 0; i < w.search.size(); ++i)
    store_floats(w.single[i].v, __builtin_convertvector(load_lanes(w.search[i].v), Four));
}

}  // namespace kerf
