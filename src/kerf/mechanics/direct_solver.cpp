#include "kerf/mechanics/direct_solver.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "kerf/mechanics/step.h"

namespace kerf {

Status direct_solve(const MechanicsModel& model, StepWorkspace& w, double dt) {
  const MechanicsModel::Structure& s = model.structure();
  const auto n = static_cast<int>(model.node_count());
  Eigen::VectorXd b(3 * n);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a) b[3 * i + a] = s.free[i] != 0 ? w.right_side[i].v[a] : w.solution[i].v[a];
  std::vector<Eigen::Triplet<double>> entries;
  // Adds to (row node i, column node j); columns of held nodes go to the right-hand side.
  const auto add = [&](int i, int ra, int j, int cb, double value) {
    if (s.free[i] == 0) return;
    if (s.free[j] == 0)
      b[3 * i + ra] -= value * w.solution[j].v[cb];
    else
      entries.emplace_back(3 * i + ra, 3 * j + cb, value);
  };
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a)
      entries.emplace_back(3 * i + a, 3 * i + a, s.free[i] != 0 ? w.mass_diagonal[i] : 1.0);
  for (std::size_t batch = 0; batch < s.batches.size(); ++batch)
    for (int lane = 0; lane < MechanicsModel::kLanes; ++lane) {
      const std::int32_t e = s.batches[batch].element[lane];
      if (e < 0) continue;
      const MechanicsElement& element = model.element(HexId(e));
      const double damping = model.materials()[element.material].damping_stiffness;
      const ElementMatrix k = model.element_stiffness(HexId(e));
      Eigen::Matrix3d r;
      for (int i = 0; i < 9; ++i) r(i / 3, i % 3) = w.rotation[9 * batch + i].v[lane];
      for (int c = 0; c < 8; ++c)
        for (int d = 0; d < 8; ++d) {
          Eigen::Matrix3d block;
          for (int i = 0; i < 9; ++i) block(i / 3, i % 3) = k[24 * (3 * c + i / 3) + 3 * d + i % 3];
          block = (dt * dt + dt * damping) * r * block * r.transpose();
          for (int i = 0; i < 9; ++i)
            add(element.nodes[c].value, i / 3, element.nodes[d].value, i % 3, block(i / 3, i % 3));
        }
    }
  for (std::size_t i = 0; i < s.springs.size(); ++i) {
    const RowSpring& spring = model.springs()[s.springs[i]];
    for (int c = 0; c < 8; ++c)
      for (int d = 0; d < 8; ++d)
        if (spring.nodes[c].valid() && spring.nodes[d].valid())
          for (int a = 0; a < 3; ++a)
            add(spring.nodes[c].value, a, spring.nodes[d].value, a,
                w.spring_scale[i] * spring.weights[c] * spring.weights[d]);
  }
  Eigen::SparseMatrix<double> matrix(3 * n, 3 * n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  if (solver.info() != Eigen::Success)
    return failed("step: the direct solver found the matrix not positive definite; use conjugate gradients");
  const Eigen::VectorXd v = solver.solve(b);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a) w.solution[i].v[a] = v[3 * i + a];
  return {};
}

}  // namespace kerf
