// Small bodies of box cells for the tests of mechanics, and a dense-to-sparse static solver that shares no
// code with the time step.
#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/mechanics/element_pass.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"

#include "support/rotation_about.h"

namespace kerf::test {

struct Grid {
  int nx = 1, ny = 1, nz = 1;  // cells
  [[nodiscard]] NodeId node(int x, int y, int z) const {
    return NodeId(static_cast<std::int32_t>((z * (ny + 1) + y) * (nx + 1) + x));
  }
  [[nodiscard]] HexId cell(int x, int y, int z) const {
    return HexId(static_cast<std::int32_t>((z * ny + y) * nx + x));
  }
  [[nodiscard]] std::array<NodeId, 8> corners(int x, int y, int z) const {
    std::array<NodeId, 8> out;
    for (int c = 0; c < 8; ++c) out[c] = node(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2 & 1));
    return out;
  }
};

inline MechanicsModel make_box(const Grid& g, Vec3 h, const Material& material,
                               ElementFormulation formulation = ElementFormulation::kIncompatible,
                               const Mat3& axes = {}, Vec3 origin = {}) {
  MechanicsModel model(h, axes, formulation);
  const bool added = model.add_material(material).ok();
  KERF_ASSERT(added);
  (void)added;
  for (int z = 0; z <= g.nz; ++z)
    for (int y = 0; y <= g.ny; ++y)
      for (int x = 0; x <= g.nx; ++x) model.add_node(origin + axes * Vec3{x * h.x, y * h.y, z * h.z}, {x, y, z});
  for (int z = 0; z < g.nz; ++z)
    for (int y = 0; y < g.ny; ++y)
      for (int x = 0; x < g.nx; ++x) {
        const Status status = model.set_element(g.cell(x, y, z), {g.corners(x, y, z)});
        KERF_ASSERT(status.ok());
        (void)status;
      }
  return model;
}

/// Displacements under nodal forces with some freedoms held at zero: K u = f at rest, by Eigen. fixed, force:
/// 3 |nodes|.
inline std::vector<double> static_displacement(const MechanicsModel& model, const std::vector<char>& fixed,
                                               const std::vector<double>& force) {
  const auto n = static_cast<int>(3 * model.node_count());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b(n);
  for (int i = 0; i < n; ++i) {
    b[i] = fixed[i] ? 0 : force[i];
    if (fixed[i]) entries.emplace_back(i, i, 1.0);
  }
  for (std::size_t e = 0; e < model.element_count(); ++e) {
    if (!model.has_element(HexId(e))) continue;
    const ElementMatrix k = model.element_stiffness(HexId(e));
    const auto& nodes = model.element(HexId(e)).nodes;
    for (int i = 0; i < 24; ++i)
      for (int j = 0; j < 24; ++j) {
        const int row = 3 * nodes[i / 3].value + i % 3, column = 3 * nodes[j / 3].value + j % 3;
        if (!fixed[row] && !fixed[column]) entries.emplace_back(row, column, k[24 * i + j]);
      }
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd u = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(b);
  return {u.data(), u.data() + n};
}

/// (dt^2 + dt b) R K R' search, of the elements alone, as a step multiplies it cell by cell: |nodes|. Overwrites workspace.product. Slots of springs and bonds
/// count as they are. Chunks are taken backwards, as their order must not matter.
inline std::vector<Vec3> product_by_cells(const MechanicsModel& model, StepWorkspace& w) {
  const MechanicsModel::Structure& s = model.structure();
  for (std::size_t chunk = (s.full_batches + s.sum_grain - 1) / s.sum_grain; chunk-- > 0;)
    element_sum_pass(model, w, w.search, chunk * s.sum_grain, std::min(s.full_batches, (chunk + 1) * s.sum_grain));
  element_stiffness_pass(model, w, w.search, s.full_batches, s.batches.size());
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < model.node_count(); ++i) {
    const Lanes f = product_of_elements(s, w, i);
    out.push_back({f[0], f[1], f[2]});
  }
  return out;
}

using testing_support::rotation_about;

}  // namespace kerf::test
