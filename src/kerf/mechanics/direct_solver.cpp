#include "kerf/mechanics/direct_solver.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

/// J' P J and J' impulse of one pressing row, J written out as a dense 3 x m matrix.
void add_contact(const ContactRow& row, const ContactWork::Row& numbers, const StepWorkspace& w,
                 const std::vector<double>& free, int n, Eigen::VectorXd& b,
                 std::vector<Eigen::Triplet<double>>& entries) {
  const int m = 3 * row.count + (row.rigid >= 0 ? 6 : 0);
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(3, m);
  std::vector<int> unknown(static_cast<std::size_t>(m));
  Eigen::VectorXd known = Eigen::VectorXd::Zero(m);  // velocities that are given
  for (int k = 0; k < row.count; ++k) {
    const ContactEntry& e = w.contact.set->entries[row.first + k];
    for (int a = 0; a < 3; ++a) {
      j(a, 3 * k + a) = e.weight;
      unknown[3 * k + a] = free[e.node.index()] != 0 ? 3 * e.node.value + a : -1;
      if (free[e.node.index()] == 0) known[3 * k + a] = w.solution[e.node.index()].v[a];
    }
  }
  if (row.rigid >= 0)
    for (int a = 0; a < 6; ++a) {
      unknown[3 * row.count + a] = 3 * n + 6 * row.rigid + a;
      Vec3 u;
      if (a < 3) u[a] = 1;
      else {
        Vec3 axis;
        axis[a - 3] = 1;
        u = cross(axis, row.arm);
      }
      for (int i = 0; i < 3; ++i) j(i, 3 * row.count + a) = -u[i];
    }
  const double* p = numbers.block;
  Eigen::Matrix3d block;
  block << p[0], p[3], p[5], p[3], p[1], p[4], p[5], p[4], p[2];
  const Eigen::MatrixXd k = j.transpose() * block * j;
  const Eigen::VectorXd right =
      j.transpose() * Eigen::Vector3d(numbers.impulse.x, numbers.impulse.y, numbers.impulse.z) - k * known;
  for (int i = 0; i < m; ++i) {
    if (unknown[i] < 0) continue;
    b[unknown[i]] += right[i];
    for (int l = 0; l < m; ++l)
      if (unknown[l] >= 0) entries.emplace_back(unknown[i], unknown[l], k(i, l));
  }
}

}  // namespace

Status direct_solve(const MechanicsModel& model, StepWorkspace& w, double dt) {
  const MechanicsModel::Structure& s = model.structure();
  const auto n = static_cast<int>(model.node_count());
  const ContactWork& contact = w.contact;
  const int tools = contact.set != nullptr ? static_cast<int>(contact.tools.size()) : 0, size = 3 * n + 6 * tools;
  Eigen::VectorXd b(size);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a) b[3 * i + a] = s.free[i] != 0 ? w.right_side[i].v[a] : w.solution[i].v[a];
  std::vector<Eigen::Triplet<double>> entries;
  // Adds to (row node i, column node j); columns of held nodes go to the right-hand side.
  const auto add = [&](int i, int ra, int j, int cb, double value) {
    if (s.free[i] == 0) return;
    if (s.free[j] == 0) b[3 * i + ra] -= value * w.solution[j].v[cb];
    else entries.emplace_back(3 * i + ra, 3 * j + cb, value);
  };
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a) entries.emplace_back(3 * i + a, 3 * i + a, s.free[i] != 0 ? w.mass_diagonal[i] : 1.0);
  // By elements, not by batches: no sum may depend on where a matrix lies in the pool.
  for (std::size_t e = 0; e < s.element_slot.size(); ++e) {
    if (s.element_slot[e] < 0) continue;
    const auto slot = static_cast<std::size_t>(s.element_slot[e]) / 8, batch = slot / MechanicsModel::kLanes,
               lane = slot % MechanicsModel::kLanes;
    const MechanicsElement& element = model.element(HexId(e));
    const double damping = model.materials()[element.material].damping_stiffness;
    const Vec3 h = model.cell(element.material).size;
    const ElementMatrix k = model.element_stiffness(HexId(e));
    Eigen::Matrix3d r;
    for (int i = 0; i < 9; ++i) r(i / 3, i % 3) = w.rotation[9 * batch + i].v[lane];
    const double scale = dt * dt + dt * damping;
    // Tension against the spin, which is half the sum of gradient x velocity.
    const double tension = 0.25 * scale * element.young_scale * w.tension[batch].v[lane];
    Eigen::Matrix<double, 3, 8> gradient;
    for (int c = 0; c < 8; ++c)
      for (int a = 0; a < 3; ++a) gradient(a, c) = corner_sign(c, a) / (4 * h[a]);
    gradient = (r * gradient).eval();
    for (int c = 0; c < 8; ++c)
      for (int d = 0; d < 8; ++d) {
        Eigen::Matrix3d block;
        for (int i = 0; i < 9; ++i) block(i / 3, i % 3) = k[24 * (3 * c + i / 3) + 3 * d + i % 3];
        block = scale * r * block * r.transpose();
        block += tension * (gradient.col(c).dot(gradient.col(d)) * Eigen::Matrix3d::Identity() -
                            gradient.col(d) * gradient.col(c).transpose());
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
  for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i)
    for (std::size_t c = 0; c < 16; ++c)
      for (std::size_t d = 0; d < 16; ++d) {
        // A torn pair keeps its places: the order of elimination, and so the bits, go by them.
        const bool torn = !(w.bonds.stiffness[i] > 0);
        const auto block = torn ? std::array<double, 9>{} : bond_block(model, w, i, c, d, dt);
        for (int k = 0; k < 9; ++k)
          add(s.bonds.pairs[i].node[c], k / 3, s.bonds.pairs[i].node[d], k % 3, block[static_cast<std::size_t>(k)]);
      }
  for (int t = 0; t < tools; ++t)
    for (int a = 0; a < 6; ++a) {
      const int row = 3 * n + 6 * t + a;
      b[row] = contact.tools[t].right[a];
      entries.emplace_back(row, row, a < 3 ? contact.tools[t].mass : contact.tools[t].inertia);
    }
  if (contact.set != nullptr)
    for (const std::int32_t r : contact.pressing)
      add_contact(contact.set->rows[r], contact.rows[r], w, s.free, n, b, entries);
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  if (solver.info() != Eigen::Success)
    return failed("step: the direct solver found the matrix not positive definite; use conjugate gradients");
  const Eigen::VectorXd v = solver.solve(b);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a) w.solution[i].v[a] = v[3 * i + a];
  for (int t = 0; t < tools; ++t)
    for (int a = 0; a < 6; ++a) w.contact.tools[t].solution[a] = v[3 * n + 6 * t + a];
  return {};
}

}  // namespace kerf
