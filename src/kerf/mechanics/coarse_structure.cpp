#include "kerf/mechanics/coarse_structure.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mesh/union_find.h"

namespace kerf {
namespace {

// Lattice block of each node that moves, -1 else.
std::vector<std::int32_t> lattice_blocks(const MechanicsModel& model, int width) {
  const MechanicsModel::Structure& s = model.structure();
  GridPoint low, high;
  low.fill(std::numeric_limits<std::int32_t>::max());
  high.fill(std::numeric_limits<std::int32_t>::min());
  for (std::size_t i = 0; i < model.node_count(); ++i)
    if (s.free[i] != 0)
      for (int a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], model.grid()[i][a]);
        high[a] = std::max(high[a], model.grid()[i][a]);
      }
  std::array<std::int64_t, 3> nodes{}, blocks{};
  for (int a = 0; a < 3; ++a) {
    nodes[a] = std::int64_t{high[a]} - low[a] + 1;
    blocks[a] = std::max<std::int64_t>(1, (nodes[a] + width / 2) / width);
  }
  std::vector<std::int32_t> block(model.node_count(), -1);
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    if (s.free[i] == 0) continue;
    std::int64_t index = 0;
    for (int a = 2; a >= 0; --a) index = index * blocks[a] + (model.grid()[i][a] - low[a]) * blocks[a] / nodes[a];
    block[i] = static_cast<std::int32_t>(index);
  }
  return block;
}

// Rigid motions of a cell about its centre, lengths over `length`: [dof][motion], w x X.
using RigidModes = std::array<std::array<double, 8>, 24>;

RigidModes rigid_modes(Vec3 h, double length) {
  RigidModes modes{};
  for (int c = 0; c < 8; ++c) {
    const double x = corner_sign(c, 0) * h.x / 2 / length, y = corner_sign(c, 1) * h.y / 2 / length,
                 z = corner_sign(c, 2) * h.z / 2 / length;
    for (int a = 0; a < 3; ++a) modes[3 * c + a][a] = 1;
    modes[3 * c + 0][4] = z;
    modes[3 * c + 0][5] = -y;
    modes[3 * c + 1][3] = -z;
    modes[3 * c + 1][5] = x;
    modes[3 * c + 2][3] = y;
    modes[3 * c + 2][4] = -x;
  }
  return modes;
}

// K times the rigid motions of some corners, [dof][motion].
RigidModes moved_rigidly(const ElementMatrix& k, const RigidModes& modes, unsigned columns) {
  RigidModes out;
  for (std::size_t i = 0; i < 24; ++i) {
    Lanes low = all_lanes(0), high = all_lanes(0);
    for (std::size_t d = 0; d < 8; ++d) {
      if ((columns >> d & 1u) == 0) continue;
      for (std::size_t j = 3 * d; j < 3 * d + 3; ++j) {
        low += k[24 * i + j] * load_lanes(modes[j].data());
        high += k[24 * i + j] * load_lanes(modes[j].data() + 4);
      }
    }
    store_lanes(out[i].data(), low);
    store_lanes(out[i].data() + 4, high);
  }
  return out;
}

// What the rigid motions of some corners feel of that. Of the six motions a displacement along x is part of three: itself and turns about y and z.
std::array<double, 36> felt(const RigidModes& force, const RigidModes& modes, unsigned rows) {
  Lanes low[6], high[6];
  for (int l = 0; l < 6; ++l) low[l] = high[l] = all_lanes(0);
  for (int c = 0; c < 8; ++c) {
    if ((rows >> c & 1u) == 0) continue;
    for (int a = 0; a < 3; ++a) {
      const int i = 3 * c + a, l = 3 + (a + 1) % 3, m = 3 + (a + 2) % 3;
      const Lanes f = load_lanes(force[i].data()), g = load_lanes(force[i].data() + 4);
      low[a] += f, high[a] += g;
      low[l] += modes[i][l] * f, high[l] += modes[i][l] * g;
      low[m] += modes[i][m] * f, high[m] += modes[i][m] * g;
    }
  }
  std::array<double, 36> out{};
  for (std::size_t l = 0; l < 6; ++l) {
    for (std::size_t m = 0; m < 4; ++m) out[6 * l + m] = low[l][m];
    for (std::size_t m = 4; m < 6; ++m) out[6 * l + m] = high[l][m - 4];
  }
  return out;
}

// Storage blocks of the pairs of some places, behind those that are there.
template <std::size_t N>
std::int32_t add_targets(std::int32_t parts, const std::array<std::int32_t, N>& place, CoarseStructure& out) {
  const auto first = static_cast<std::int32_t>(out.targets.size());
  for (int p = 0; p < parts; ++p)
    for (int q = p; q < parts; ++q)
      out.targets.push_back(out.cholesky.block(out.cholesky.order[place[p]], out.cholesky.order[place[q]]));
  return first;
}

}  // namespace

CoarseStructure coarse_structure(const MechanicsModel& model) {
  const MechanicsModel::Structure& s = model.structure();
  const std::size_t n = model.node_count();
  const int width = group_width(s.free_nodes);
  CoarseStructure out;
  out.length = 0;
  for (const ElementCell& cell : model.cells())
    out.length = std::max(out.length, 0.5 * width * std::cbrt(cell.size.x * cell.size.y * cell.size.z));

  const std::vector<std::int32_t> block = lattice_blocks(model, width);
  UnionFind joined(n);
  for (std::size_t e = 0; e < model.element_count(); ++e) {
    if (s.element_slot[e] < 0) continue;
    const std::array<NodeId, 8>& nodes = model.element(HexId(e)).nodes;
    std::array<std::int32_t, 8> of;
    for (int c = 0; c < 8; ++c) of[c] = block[nodes[c].index()];
    for (int c = 0; c < 8; ++c)
      for (int d = 0; d < c; ++d) {
        if (of[c] < 0 || of[c] != of[d]) continue;
        joined.join(nodes[c].value, nodes[d].value);
        break;  // the others hang on that one
      }
  }
  out.group.assign(n, -1);
  for (std::size_t i = 0; i < n; ++i) {
    if (block[i] < 0) continue;
    const std::int32_t root = joined.root(static_cast<std::int32_t>(i));
    if (out.group[root] < 0) out.group[root] = out.groups++;
    out.group[i] = out.group[root];
  }

  // Pairs of groups that elements and springs connect.
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  std::vector<std::uint64_t> there(static_cast<std::size_t>(out.groups),
                                   0);  // per group, those among the first 64 that it has a pair with
  const auto connect = [&](std::span<const NodeId> nodes) {
    std::array<std::int32_t, 16> groups;  // of the nodes, each once
    auto end = groups.begin();
    for (const NodeId node : nodes) {
      const std::int32_t group = node.valid() ? out.group[node.index()] : -1;
      if (group >= 0 && std::find(groups.begin(), end, group) == end) *end++ = group;
    }
    for (auto a = groups.begin(); a != end; ++a)
      for (auto b = groups.begin(); b != a; ++b) {
        const std::pair pair(std::min(*a, *b), std::max(*a, *b));
        if (pair.second < 64) {
          const std::uint64_t bit = std::uint64_t{1} << pair.second;
          if ((there[pair.first] & bit) != 0) continue;
          there[pair.first] |= bit;
        }
        if (pairs.empty() || pairs.back() != pair) pairs.push_back(pair);
      }
  };
  for (std::size_t e = 0; e < model.element_count(); ++e)
    if (s.element_slot[e] >= 0) connect(model.element(HexId(e)).nodes);
  for (std::int32_t spring : s.springs) connect(model.springs()[spring].nodes);
  for (const BondPair& pair : s.bonds.pairs) {
    std::array<NodeId, 16> nodes;
    for (std::size_t k = 0; k < 16; ++k) nodes[k] = NodeId(pair.node[k]);
    connect(nodes);
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  out.cholesky = block_cholesky_structure(out.groups, pairs);

  out.place.assign(n, -1);
  out.member_begin.assign(static_cast<std::size_t>(out.groups) + 1, 0);
  for (std::size_t i = 0; i < n; ++i)
    if (out.group[i] >= 0) {
      out.place[i] = out.cholesky.position[out.group[i]];
      ++out.member_begin[out.place[i] + 1];
    }
  for (std::int32_t g = 0; g < out.groups; ++g) out.member_begin[g + 1] += out.member_begin[g];
  out.members.resize(static_cast<std::size_t>(out.member_begin[out.groups]));
  std::vector<std::int32_t> next = out.member_begin;
  for (std::size_t i = 0; i < n; ++i)
    if (out.place[i] >= 0) out.members[next[out.place[i]]++] = static_cast<std::int32_t>(i);

  for (std::size_t i = 0; i < s.springs.size(); ++i) {
    const RowSpring& spring = model.springs()[s.springs[i]];
    CoarseStructure::SpringParts parts;
    parts.spring = static_cast<std::int32_t>(i);
    std::array<std::int32_t, 8> place, sorted;
    for (int k = 0; k < 8; ++k) place[k] = spring.nodes[k].valid() ? out.place[spring.nodes[k].index()] : -1;
    sorted = place;
    std::sort(sorted.begin(), sorted.end(), std::greater<>());
    for (int k = 0; k < 8; ++k)
      if (sorted[k] >= 0 && (k == 0 || sorted[k] != sorted[k - 1])) parts.place[parts.parts++] = sorted[k];
    parts.part.fill(-1);
    for (int k = 0; k < 8; ++k)
      for (int p = 0; p < parts.parts; ++p)
        if (place[k] == parts.place[p]) parts.part[k] = p;
    parts.target = add_targets(parts.parts, parts.place, out);
    out.springs.push_back(parts);
  }
  for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i) {
    CoarseStructure::BondParts parts;
    parts.pair = static_cast<std::int32_t>(i);
    std::array<std::int32_t, 16> place, sorted;
    for (std::size_t k = 0; k < 16; ++k) place[k] = out.place[static_cast<std::size_t>(s.bonds.pairs[i].node[k])];
    sorted = place;
    std::sort(sorted.begin(), sorted.end(), std::greater<>());
    for (std::size_t k = 0; k < 16; ++k)
      if (sorted[k] >= 0 && (k == 0 || sorted[k] != sorted[k - 1])) parts.place[parts.parts++] = sorted[k];
    parts.part.fill(-1);
    for (std::size_t k = 0; k < 16; ++k)
      for (int p = 0; p < parts.parts; ++p)
        if (place[k] == parts.place[p]) parts.part[k] = p;
    parts.target = add_targets(parts.parts, parts.place, out);
    out.bonds.push_back(parts);
  }
  return out;
}

void add_crossings(const MechanicsModel& model, CoarseStructure& out) {
  const MechanicsModel::Structure& s = model.structure();
  // Full cells of one material that are split alike share their matrices.
  std::map<std::pair<std::int32_t, std::array<unsigned, 8>>, std::int32_t> known;
  std::vector<RigidModes> modes;
  for (const ElementCell& cell : model.cells()) modes.push_back(rigid_modes(cell.size, out.length));
  std::vector<ElementMatrix> full;
  for (const WalshHadamardMatrix& k : s.shared) full.push_back(dense(k));
  // By elements, not by batches: no sum may depend on where a matrix lies in the pool.
  for (const std::int32_t slot : s.element_slot) {
    if (slot < 0) continue;
    const std::int32_t b = slot / (8 * MechanicsModel::kLanes);
    const int lane = slot / 8 % MechanicsModel::kLanes;
    CoarseStructure::Crossing crossing;
    crossing.batch = b;
    crossing.lane = lane;
    std::array<std::int32_t, 8> place;
    bool held = false;
    for (int c = 0; c < 8; ++c) {
      place[c] = out.place[s.batches[b].node[c][lane]];
      held = held || place[c] < 0;
    }
    std::array<std::int32_t, 8> sorted = place;
    std::sort(sorted.begin(), sorted.end(), std::greater<>());
    for (int c = 0; c < 8; ++c)
      if (sorted[c] >= 0 && (c == 0 || sorted[c] != sorted[c - 1])) crossing.place[crossing.parts++] = sorted[c];
    if (crossing.parts == 0 || (crossing.parts == 1 && !held)) continue;
    std::array<unsigned, 8> corners{};
    for (int p = 0; p < crossing.parts; ++p)
      for (int c = 0; c < 8; ++c)
        if (place[c] == crossing.place[p]) corners[p] |= 1u << c;
    crossing.antisymmetric = crossing.parts == 2 && !held;
    crossing.target = add_targets(crossing.parts, crossing.place, out);
    const auto fresh = [&](const ElementMatrix& k) {
      const auto first = static_cast<std::int32_t>(out.matrices.size());
      out.matrices.resize(out.matrices.size() +
                          (crossing.antisymmetric ? 1 : crossing.parts * (crossing.parts + 1) / 2));
      for (int q = 0; q < crossing.parts; ++q) {
        const RigidModes force = moved_rigidly(k, modes[s.batches[b].cell], corners[q]);
        for (int p = 0; p <= q; ++p)  // pair (p, q) by rows of the upper triangle
          out.matrices[first + p * crossing.parts - p * (p - 1) / 2 + q - p] =
              felt(force, modes[s.batches[b].cell], corners[p]);
        if (crossing.antisymmetric) break;  // one is enough
      }
      return first;
    };
    if (s.batches[b].own < 0) {
      const auto [at, added] = known.try_emplace({s.batches[b].material, corners}, 0);
      if (added) at->second = fresh(full[s.batches[b].material]);
      crossing.matrix = at->second;
    } else {
      ElementMatrix k;
      const double* in = model.own_block(s.batches[b].own) + lane;
      for (int i = 0; i < 24; ++i)
        for (int j = i; j < 24; ++j, in += MechanicsModel::kLanes) k[24 * i + j] = k[24 * j + i] = *in;
      crossing.matrix = fresh(k);
    }
    out.crossings.push_back(crossing);
  }
}

}  // namespace kerf
