#include "kerf/mechanics/coarse_space.h"

#include <algorithm>
#include <array>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/chunked_loop.h"
#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

constexpr std::size_t kGroupGrain = 16;
/// Nodes whose places lie beside a line by no more than this share of their mean square distance from the middle are on a line.
constexpr double kLine = 1e-3;

using Matrix6 = std::array<double, 36>;  // row-major

// T' W S with T = [I, -[a]x; 0, I] and S = [I, -[b]x; 0, I]: from motions about the element's centre to
// motions about the groups' centres, which lie at -a and -b from it. Added to a stored (column-major, padded)
// block.
void add_moved(const Matrix6& w, double sign, const double* a, const double* b, double* block) {
  Matrix6 m = w;
  for (int i = 0; i < 6; ++i) {  // row_w -= row_t x b
    double* t = &m[6 * i];
    t[3] -= t[1] * b[2] - t[2] * b[1];
    t[4] -= t[2] * b[0] - t[0] * b[2];
    t[5] -= t[0] * b[1] - t[1] * b[0];
  }
  for (int j = 0; j < 6; ++j) {  // column_w += a x column_t
    const double x = m[j], y = m[6 + j], z = m[12 + j];
    m[18 + j] += a[1] * z - a[2] * y;
    m[24 + j] += a[2] * x - a[0] * z;
    m[30 + j] += a[0] * y - a[1] * x;
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) block[8 * j + i] += sign * m[6 * i + j];
}

// diag(R, R) E diag(R, R)'
Matrix6 rotated(const Matrix6& e, const double (&r)[3][3]) {
  Matrix6 half, out;
  for (int i = 0; i < 6; ++i)
    for (int block = 0; block < 2; ++block) {
      const double* in = &e[6 * i + 3 * block];
      for (int j = 0; j < 3; ++j) half[6 * i + 3 * block + j] = in[0] * r[j][0] + in[1] * r[j][1] + in[2] * r[j][2];
    }
  for (int block = 0; block < 2; ++block)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 6; ++j)
        out[6 * (3 * block + i) + j] = r[i][0] * half[6 * (3 * block) + j] + r[i][1] * half[6 * (3 * block + 1) + j] +
                                       r[i][2] * half[6 * (3 * block + 2) + j];
  return out;
}

// Elastic part from the elements that touch several groups.
void add_elements(const MechanicsModel& model, StepWorkspace& w) {
  const CoarseStructure& s = model.coarse();
  CoarseSpace& coarse = w.coarse;
  const double inverse_length = 1 / s.length;
  const MechanicsModel::Structure& structure = model.structure();
  for (const CoarseStructure::Crossing& c : s.crossings) {
    const MechanicsModel::Batch& batch = structure.batches[c.batch];
    Lanes sum = all_lanes(0);
    for (int k = 0; k < 8; ++k) sum += load_lanes(w.position[batch.node[k][c.lane]].v);
    sum *= 0.125;
    double r[3][3];
    for (int i = 0; i < 9; ++i) r[i / 3][i % 3] = w.scaled_rotation[9 * c.batch + i].v[c.lane];
    double arm[8][3];
    for (int p = 0; p < c.parts; ++p)
      for (int a = 0; a < 3; ++a) arm[p][a] = inverse_length * (sum[a] - coarse.centre[3 * c.place[p] + a]);
    if (c.antisymmetric) {
      const Matrix6 m = rotated(s.matrices[c.matrix], r);
      add_moved(m, 1, arm[0], arm[0], coarse.blocks.data() + kBlockDoubles * s.targets[c.target]);
      add_moved(m, -1, arm[0], arm[1], coarse.blocks.data() + kBlockDoubles * s.targets[c.target + 1]);
      add_moved(m, 1, arm[1], arm[1], coarse.blocks.data() + kBlockDoubles * s.targets[c.target + 2]);
      continue;
    }
    int pair = 0;
    for (int p = 0; p < c.parts; ++p)
      for (int q = p; q < c.parts; ++q, ++pair)
        add_moved(rotated(s.matrices[c.matrix + pair], r), 1, arm[p], arm[q],
                  coarse.blocks.data() + kBlockDoubles * s.targets[c.target + pair]);
  }
}

// What a node feels of the six motions of a group: three numbers each.
struct FeltByNode {
  std::int32_t place = -1;
  Lanes column[6];
};

// block += T' felt, T the motions of the node's own group.
void add_node(const Lanes& arm, const FeltByNode& felt, double* block) {
  for (int k = 0; k < 6; ++k) {
    const Lanes f = felt.column[k], torque = cross_lanes(arm, f);
    double* out = block + 8 * k;
    store_lanes(out, load_lanes(out) + Lanes{f[0], f[1], f[2], torque[0]});
    store_lanes(out + 4, load_lanes(out + 4) + Lanes{torque[1], torque[2], 0, 0});
  }
}

// The same from the node matrix: P' A P node by node. The blocks on its diagonal are what makes translations strain nothing, so
// a node feels of its own group only how others turn about it, and of the rest what it leaves behind.
void add_node_matrix(const MechanicsModel& model, StepWorkspace& w) {
  constexpr int kMostGroups = 16;  // kept for a node; what else there is comes out as well
  const CoarseStructure& s = model.coarse();
  const NodeMatrixStructure& structure = model.node_matrix();
  double* blocks = w.coarse.blocks.data();
  FeltByNode felt[kMostGroups];
  const auto turned = [](const Lanes(&a)[3], const Lanes& arm, Lanes* turns) {
    turns[0] += arm[1] * a[2] - arm[2] * a[1];
    turns[1] += arm[2] * a[0] - arm[0] * a[2];
    turns[2] += arm[0] * a[1] - arm[1] * a[0];
  };
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    const std::int32_t place = s.place[i];
    if (place < 0) continue;
    const Lanes arm = load_lanes(w.arm[i].v);
    const auto write = [&](const FeltByNode& f) {
      add_node(arm, f, blocks + kBlockDoubles * s.cholesky.find_block(place, f.place));
    };
    int groups = 1;
    const auto begin = [&](FeltByNode& f, std::int32_t group) {
      f.place = group;
      for (Lanes& c : f.column) c = all_lanes(0);
    };
    begin(felt[0], place);
    Lanes left[3] = {all_lanes(0), all_lanes(0), all_lanes(0)};  // behind, by all who are not in the group
    for (std::int32_t k = structure.row_begin[i]; k < structure.row_begin[i + 1]; ++k) {
      const auto j = static_cast<std::size_t>(structure.column[k]);
      const std::int32_t other = s.place[j];
      Lanes a[3];
      for (int c = 0; c < 3; ++c) a[c] = node_block_column(w.node_blocks.data(), k, c);
      if (other == place) {
        turned(a, load_lanes(w.arm[j].v) - arm, felt[0].column + 3);
        continue;
      }
      for (int c = 0; c < 3; ++c) left[c] -= a[c];
      if (other < 0 || other > place) continue;
      int g = 1;
      while (g < groups && felt[g].place != other) ++g;
      if (g == groups) {
        if (groups == kMostGroups) write(felt[--g]);
        groups = g + 1;
        begin(felt[g], other);
      }
      for (int c = 0; c < 3; ++c) felt[g].column[c] += a[c];
      turned(a, load_lanes(w.arm[j].v), felt[g].column + 3);
    }
    for (int c = 0; c < 3; ++c) felt[0].column[c] += left[c];
    turned(left, arm, felt[0].column + 3);
    for (int g = 0; g < groups; ++g) write(felt[g]);
  }
}

// Nodes on a line, or alone, do not feel turns about it: what a group's matrix says of those is rounding, or what the cells' deformation leaves
// behind, and would set light nodes spinning. Holds such turns as firmly as the group's others, which nothing asks of them.
void hold_turns_about_a_line(const CoarseStructure& s, StepWorkspace& w, std::size_t g) {
  Lanes moment[3] = {all_lanes(0), all_lanes(0), all_lanes(0)};  // sum of q q'
  for (std::int32_t k = s.member_begin[g]; k < s.member_begin[g + 1]; ++k) {
    const Lanes q = load_lanes(w.arm[s.members[k]].v);
    for (int a = 0; a < 3; ++a) moment[a] += q[a] * q;
  }
  double* b = w.coarse.blocks.data() + kBlockDoubles * g;
  double firm = 0;
  for (int i = 0; i < 6; ++i) firm = std::max(firm, b[9 * i]);
  const double all = moment[0][0] + moment[1][1] + moment[2][2];
  if (!(all > 0)) {
    for (int i = 3; i < 6; ++i) b[9 * i] += firm;
    return;
  }
  int longest = 0;
  for (int a = 1; a < 3; ++a)
    if (moment[a][a] > moment[longest][longest]) longest = a;
  Lanes line = moment[longest];
  for (int sweep = 0; sweep < 2; ++sweep)
    line = (line[0] * moment[0] + line[1] * moment[1] + line[2] * moment[2]) / all;
  const double length = (line[0] * line[0] + line[1] * line[1]) + line[2] * line[2];
  if (!(length > 0)) return;
  const Lanes felt = line[0] * moment[0] + line[1] * moment[1] + line[2] * moment[2];
  const double along = ((line[0] * felt[0] + line[1] * felt[1]) + line[2] * felt[2]) / length;
  if (all - along > kLine * all) return;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) b[8 * (3 + j) + 3 + i] += firm * line[i] * line[j] / length;
}

// A row of weights times the unit matrix.
template <class Parts, std::size_t N>
void add_row(const Parts& c, const std::array<std::int32_t, N>& nodes, const std::array<double, N>& weights,
             double scale, const CoarseStructure& s, StepWorkspace& w) {
  // The row on a part's motion: weight t + w x (sum of weights times arms).
  double weight[N] = {}, arm[N][3] = {};
  for (std::size_t k = 0; k < N; ++k) {
    if (c.part[k] < 0) continue;
    weight[c.part[k]] += weights[k];
    for (int a = 0; a < 3; ++a) arm[c.part[k]][a] += weights[k] * w.arm[static_cast<std::size_t>(nodes[k])].v[a];
  }
  int pair = 0;
  for (int p = 0; p < c.parts; ++p)
    for (int q = p; q < c.parts; ++q, ++pair) {
      double rows[2][3][6];
      for (int side = 0; side < 2; ++side) {
        const int part = side == 0 ? p : q;
        const double* a = arm[part];
        const double matrix[3][6] = {{weight[part], 0, 0, 0, a[2], -a[1]},
                                     {0, weight[part], 0, -a[2], 0, a[0]},
                                     {0, 0, weight[part], a[1], -a[0], 0}};
        std::copy(&matrix[0][0], &matrix[0][0] + 18, &rows[side][0][0]);
      }
      double* block = w.coarse.blocks.data() + kBlockDoubles * s.targets[c.target + pair];
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
          for (int a = 0; a < 3; ++a) block[8 * j + i] += scale * rows[0][a][i] * rows[1][a][j];
    }
}

}  // namespace

void prepare_coarse_space(const MechanicsModel& model, StepWorkspace& w, double dt) {
  const CoarseStructure& s = model.coarse();
  CoarseSpace& coarse = w.coarse;
  const auto groups = static_cast<std::size_t>(s.groups);
  coarse.centre.resize(3 * groups);
  coarse.blocks.assign(kBlockDoubles * s.cholesky.block_count(), 0.0);
  w.arm.resize(model.node_count());
  const double inverse_length = 1 / s.length;

  for (std::size_t g = 0; g < groups; ++g) {
    const std::int32_t begin = s.member_begin[g], end = s.member_begin[g + 1];
    Lanes sum = all_lanes(0);
    for (std::int32_t k = begin; k < end; ++k) sum += load_lanes(w.position[s.members[k]].v);
    const Lanes centre = sum / static_cast<double>(end - begin);
    for (int a = 0; a < 3; ++a) coarse.centre[3 * g + a] = centre[a];
    // Mass: sum of m [I, -[q]x; [q]x, q'q I - q q'].
    double m = 0, mq[3] = {}, mqq[6] = {};
    for (std::int32_t k = begin; k < end; ++k) {
      const std::int32_t node = s.members[k];
      const Lanes q = inverse_length * (load_lanes(w.position[node].v) - centre);
      store_lanes(w.arm[node].v, q);
      const double mass = w.mass_diagonal[node];
      const double x = q[0], y = q[1], z = q[2];
      m += mass;
      mq[0] += mass * x;
      mq[1] += mass * y;
      mq[2] += mass * z;
      mqq[0] += mass * x * x;
      mqq[1] += mass * y * y;
      mqq[2] += mass * z * z;
      mqq[3] += mass * x * y;
      mqq[4] += mass * y * z;
      mqq[5] += mass * z * x;
    }
    double* b = coarse.blocks.data() + kBlockDoubles * g;
    const auto set = [&](int i, int j, double value) { b[8 * j + i] = b[8 * i + j] = value; };
    for (int a = 0; a < 3; ++a) set(a, a, m);
    set(0, 4, mq[2]);  // w x q, x component: w_y q_z - w_z q_y
    set(0, 5, -mq[1]);
    set(1, 3, -mq[2]);
    set(1, 5, mq[0]);
    set(2, 3, mq[1]);
    set(2, 4, -mq[0]);
    set(3, 3, mqq[1] + mqq[2]);
    set(4, 4, mqq[0] + mqq[2]);
    set(5, 5, mqq[0] + mqq[1]);
    set(3, 4, -mqq[3]);
    set(4, 5, -mqq[4]);
    set(3, 5, -mqq[5]);
  }

  if (w.node_matrix) add_node_matrix(model, w);
  else add_elements(model, w);

  const MechanicsModel::Structure& structure = model.structure();
  for (const CoarseStructure::SpringParts& c : s.springs) {
    const RowSpring& spring = model.springs()[structure.springs[c.spring]];
    std::array<std::int32_t, 8> nodes;
    for (std::size_t k = 0; k < 8; ++k) nodes[k] = spring.nodes[k].value;
    add_row(c, nodes, spring.weights, w.spring_scale[c.spring], s, w);
  }
  for (const CoarseStructure::BondParts& c : s.bonds) {
    const auto pair = static_cast<std::size_t>(c.pair);
    const double stiffness = w.bonds.stiffness[pair];
    if (!(stiffness > 0)) continue;
    add_row(c, structure.bonds.pairs[pair].node, middle_of_bonds(w, pair), dt * dt * stiffness, s, w);
  }

  for (std::size_t g = 0; g < groups; ++g) hold_turns_about_a_line(s, w, g);
}

void factor_coarse_space(const MechanicsModel& model, StepWorkspace& w) {
  CoarseSpace& coarse = w.coarse;
  if (w.contact.set == nullptr) {
    coarse.factored = coarse.blocks;
  } else {
    add_contacts_to_coarse(model, w);
  }
  const BlockCholeskyStructure& structure = coarse_cholesky(model, w);
  coarse.value.assign(kBlockRow * static_cast<std::size_t>(structure.rows), 0.0);
  block_cholesky_factor(structure, coarse.factored);
}

double solve_coarse(const MechanicsModel& model, StepWorkspace& w, bool parallel) {
  const CoarseStructure& s = model.coarse();
  CoarseSpace& coarse = w.coarse;
  for_each_chunk(parallel, static_cast<std::size_t>(s.groups), kGroupGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   for (std::size_t g = begin; g < end; ++g) {
                     Lanes t = all_lanes(0), torque = all_lanes(0);
                     for (std::int32_t k = s.member_begin[g]; k < s.member_begin[g + 1]; ++k) {
                       const Lanes r = load_lanes(w.residual[s.members[k]].v);
                       t += r;
                       torque += cross_lanes(load_lanes(w.arm[s.members[k]].v), r);
                     }
                     double* out = coarse.value.data() + kBlockRow * g;
                     for (int a = 0; a < 3; ++a) {
                       out[a] = t[a];
                       out[3 + a] = torque[a];
                     }
                     out[6] = out[7] = 0;
                   }
                 });
  if (w.contact.set != nullptr)
    for (std::size_t i = 0; i < w.contact.tools.size(); ++i)
      std::copy(w.contact.tools[i].residual, w.contact.tools[i].residual + 6,
                coarse.value.data() + kBlockRow * (static_cast<std::size_t>(s.groups) + i));
  w.coarse.restricted = coarse.value;
  block_cholesky_solve(coarse_cholesky(model, w), coarse.factored, coarse.value);
  double sum = 0;
  for (std::size_t i = 0; i < coarse.value.size(); ++i) sum += coarse.restricted[i] * coarse.value[i];
  return sum;
}

}  // namespace kerf
