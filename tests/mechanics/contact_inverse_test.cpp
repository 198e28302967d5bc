// The inverse of diagonals and rows together, against a dense one.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "kerf/base/random.h"
#include "kerf/mechanics/contact_inverse.h"
#include "kerf/mechanics/step.h"
#include "mechanics/contact_bodies.h"

namespace kerf::contact_inverse_test {
namespace {

Eigen::Matrix3d full(const double* b) {
  Eigen::Matrix3d m;
  m << b[0], b[3], b[5], b[3], b[1], b[4], b[5], b[4], b[2];
  return m;
}
void store(const Eigen::Matrix3d& m, double* b) {
  b[0] = m(0, 0), b[1] = m(1, 1), b[2] = m(2, 2), b[3] = m(0, 1), b[4] = m(1, 2), b[5] = m(2, 0);
}

/// A box with a node held, rows at random on its cells' corners, and any diagonal blocks.
struct Touched {
  MechanicsModel model = test::make_box({3, 3, 1}, {0.01, 0.01, 0.01}, {});
  ContactSet set;
  StepWorkspace w;

  explicit Touched(int rows, std::uint64_t seed) {
    Random random(seed);
    model.fix_node(NodeId(0));
    model.refresh();
    const std::size_t n = model.node_count();
    w.diagonal.resize(2 * n);
    w.inverse_diagonal.resize(3 * n);
    w.preconditioned.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      Eigen::Matrix3d a;
      for (int k = 0; k < 9; ++k) a(k / 3, k % 3) = random.uniform(-1, 1);
      const Eigen::Matrix3d d = random.uniform(0.01, 1) * (a * a.transpose() + Eigen::Matrix3d::Identity());
      double block[8] = {};
      store(d, block);
      std::copy_n(block, 4, w.diagonal[2 * i].v);
      std::copy_n(block + 4, 4, w.diagonal[2 * i + 1].v);
    }
    w.contact.set = &set;
    w.contact.node_slot.assign(n, -1);
    for (int r = 0; r < rows; ++r) {
      ContactRow row;
      row.key = static_cast<std::uint64_t>(r);
      row.first = static_cast<std::int32_t>(set.entries.size());
      row.count = 8;
      const HexId cell(static_cast<std::size_t>(random.uniform(0, 0.999) * static_cast<double>(model.element_count())));
      for (const NodeId node : model.element(cell).nodes) set.entries.push_back({node, random.uniform(0, 0.3)});
      set.rows.push_back(row);
      ContactWork::Row& own = w.contact.rows.emplace_back();
      Eigen::Vector3d normal(random.uniform(-1, 1), random.uniform(-1, 1), 3);
      normal.normalize();
      const Eigen::Matrix3d p =
          30 * (normal * normal.transpose() +
                random.uniform(0, 1) * (Eigen::Matrix3d::Identity() - normal * normal.transpose()));
      store(p, own.block);
      w.contact.pressing.push_back(r);
    }
    for (const ContactEntry& e : set.entries) {
      if (model.is_fixed(e.node) || w.contact.node_slot[e.node.index()] >= 0) continue;
      w.contact.node_slot[e.node.index()] = static_cast<std::int32_t>(w.contact.nodes.size());
      w.contact.nodes.push_back(static_cast<std::int32_t>(e.node.index()));
    }
  }

  bool prepare() {
    if (!choose_inverse_rows(model, w)) return false;
    for (std::size_t i = 0; i < model.node_count(); ++i)
      store_framed_inverse(w.contact.inverse, load_lanes(w.diagonal[2 * i].v), load_lanes(w.diagonal[2 * i + 1].v),
                           w.inverse_diagonal[3 * i].v);
    factor_contact_inverse(w);
    return true;
  }

  /// r -> M^-1 r as the solver has it, for the nodes that rows touch; how far the returned change of r' z is off, too.
  Eigen::VectorXd solved(const Eigen::VectorXd& r, double& wrong) {
    double before = 0;
    for (std::size_t s = 0; s < w.contact.nodes.size(); ++s) {
      const auto node = static_cast<std::size_t>(w.contact.nodes[s]);
      for (int a = 0; a < 3; ++a) {
        double z = 0;
        for (int b = 0; b < 3; ++b)
          z += w.inverse_diagonal[3 * node + static_cast<std::size_t>(b)].v[a] * r(3 * static_cast<long>(s) + b);
        w.preconditioned[node].v[a] = z;
        before += z * r(3 * static_cast<long>(s) + a);
      }
    }
    const double change = apply_contact_inverse(w);
    Eigen::VectorXd z(r.size());
    for (std::size_t s = 0; s < w.contact.nodes.size(); ++s)
      for (int a = 0; a < 3; ++a)
        z(3 * static_cast<long>(s) + a) = w.preconditioned[static_cast<std::size_t>(w.contact.nodes[s])].v[a];
    wrong = std::abs(before + change - r.dot(z)) / before;
    return z;
  }

  /// M with D and P diagonal in the frame.
  Eigen::MatrixXd dense() const {
    const ContactInverse& c = w.contact.inverse;
    Eigen::Matrix3d q;
    for (int a = 0; a < 3; ++a) q.col(a) << c.axes[a].x, c.axes[a].y, c.axes[a].z;
    const auto framed = [&](const Eigen::Matrix3d& m) -> Eigen::Matrix3d {
      return q * (q.transpose() * m * q).diagonal().asDiagonal() * q.transpose();
    };
    const auto n = static_cast<long>(3 * w.contact.nodes.size());
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t s = 0; s < w.contact.nodes.size(); ++s)
      m.block<3, 3>(3 * static_cast<long>(s), 3 * static_cast<long>(s)) =
          framed(full(w.diagonal[2 * static_cast<std::size_t>(w.contact.nodes[s])].v));
    for (std::size_t r = 0; r < set.rows.size(); ++r)
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j) {
          const ContactEntry &a = set.entries[static_cast<std::size_t>(set.rows[r].first + i)],
                             &b = set.entries[static_cast<std::size_t>(set.rows[r].first + j)];
          const long k = w.contact.node_slot[a.node.index()], l = w.contact.node_slot[b.node.index()];
          if (k >= 0 && l >= 0)
            m.block<3, 3>(3 * k, 3 * l) += a.weight * b.weight * framed(full(w.contact.rows[r].block));
        }
    return m;
  }
};

TEST(ContactInverse, IsTheInverseOfDiagonalsAndRows) {
  for (const int rows : {1, 3, 8, 17, 40, 128}) {
    Touched t(rows, 7 + static_cast<std::uint64_t>(rows));
    ASSERT_TRUE(t.prepare());
    const Eigen::MatrixXd m = t.dense();
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(m.rows(), -1, 2);
    double wrong = 0;
    EXPECT_LT((t.solved(m * x, wrong) - x).norm(), 1e-3 * x.norm())
        << rows;  // single precision times the condition of M
    EXPECT_LT(wrong, 1e-6) << rows;
  }
}

TEST(ContactInverse, IsPositiveDefinite) {
  Touched t(60, 3);
  ASSERT_TRUE(t.prepare());
  const auto n = static_cast<long>(3 * t.w.contact.nodes.size());
  Eigen::MatrixXd m(n, n);
  double wrong = 0;
  for (long i = 0; i < n; ++i) m.col(i) = t.solved(Eigen::VectorXd::Unit(n, i), wrong);
  EXPECT_LT((m - m.transpose()).norm(), 1e-4 * m.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(m).eigenvalues()(0), 0);
}

TEST(ContactInverse, FrictionlessRowsOnASlopeNeedNoOtherFrame) {
  Touched t(12, 9);
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 3).normalized();
  for (ContactWork::Row& row : t.w.contact.rows) store(30 * normal * normal.transpose(), row.block);
  ASSERT_TRUE(t.prepare());
  double most = 0;
  for (const Vec3 q : t.w.contact.inverse.axes) {
    EXPECT_NEAR(norm(q), 1, 1e-12);
    most = std::max(most, std::abs(Eigen::Vector3d(q.x, q.y, q.z).dot(normal)));
  }
  EXPECT_NEAR(most, 1, 1e-9);
}

TEST(ContactInverse, LeavesTooManyRowsAndTooStiffOnesToTheDiagonals) {
  Touched many(static_cast<int>(kMostInverseRows) + 1, 5);
  EXPECT_FALSE(many.prepare());
  Touched stiff(4, 5);
  for (double& x : stiff.w.contact.rows[2].block) x *= 1e6;
  ASSERT_TRUE(stiff.prepare());
  EXPECT_EQ(stiff.w.contact.inverse.rows, (std::vector<std::int32_t>{0, 1, 3}));
  for (ContactWork::Row& row : stiff.w.contact.rows)
    for (double& x : row.block) x *= 1e12;
  EXPECT_FALSE(stiff.prepare());
}

}  // namespace
}  // namespace kerf::contact_inverse_test
