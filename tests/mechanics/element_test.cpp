#include "kerf/mechanics/element.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "kerf/mechanics/element_wht.h"
#include "mechanics/test_bodies.h"

namespace kerf::element_test {
namespace {

using test::Grid;

constexpr ElementFormulation kBoth[] = {ElementFormulation::kIncompatible, ElementFormulation::kPlain};

enum class Load { kBending, kTorsion, kInPlane };

// Compliance of a clamped strip relative to Timoshenko's or St. Venant's. Thickness 1, length and width in
// cells.
double strip_compliance(ElementFormulation formulation, Vec3 h, int nx, int ny, double poisson, Load load) {
  Material material;
  material.young = 1000;
  material.poisson = poisson;
  const Grid g{nx, ny, 1};
  const MechanicsModel model = test::make_box(g, h, material, formulation);
  const double length = nx * h.x, width = ny * h.y, thick = h.z;
  std::vector<char> fixed(3 * model.node_count(), 0);
  std::vector<double> force(3 * model.node_count(), 0);
  double total_radius = 0;
  for (int y = 0; y <= ny; ++y)
    for (int z = 0; z <= 1; ++z) {
      for (int a = 0; a < 3; ++a) fixed[3 * g.node(0, y, z).index() + a] = 1;
      const double weight = (y == 0 || y == ny ? 0.5 : 1.0) / ny / 2;
      const Vec3 p{0, y * h.y - width / 2, z * h.z - thick / 2};
      double* f = &force[3 * g.node(nx, y, z).index()];
      if (load == Load::kBending) f[2] = weight;
      if (load == Load::kInPlane) f[1] = weight;
      if (load == Load::kTorsion) {
        f[1] = -weight * p.z;
        f[2] = weight * p.y;
        total_radius += weight * (p.y * p.y + p.z * p.z);
      }
    }
  if (load == Load::kTorsion)
    for (double& f : force) f /= total_radius;
  const std::vector<double> u = test::static_displacement(model, fixed, force);
  double compliance = 0;
  for (std::size_t i = 0; i < u.size(); ++i) compliance += u[i] * force[i];
  const double shear = lame_mu(material);
  if (load == Load::kTorsion) {
    double series = 0;
    for (int k = 1; k < 60; k += 2) series += std::tanh(k * M_PI * width / (2 * thick)) / std::pow(k, 5);
    const double j = width * std::pow(thick, 3) / 3 * (1 - 192 / std::pow(M_PI, 5) * thick / width * series);
    return compliance / (length / (shear * j));
  }
  const double depth = load == Load::kBending ? thick : width, breadth = load == Load::kBending ? width : thick;
  const double inertia = breadth * std::pow(depth, 3) / 12;
  const double beam =
      std::pow(length, 3) / (3 * material.young * inertia) + length / (5.0 / 6 * shear * breadth * depth);
  return compliance / beam;
}

TEST(Element, StripsMatchCalculix) {
  // CalculiX ccx: C3D8 for plain, C3D8I for incompatible modes, to three digits.
  struct Row {
    Vec3 h;
    int nx, ny;
    double poisson;
    Load load;
    double plain, incompatible;
  };
  const Vec3 cube{1, 1, 1}, flat{4, 4, 1};
  const Row rows[] = {
      {cube, 5, 4, .3, Load::kBending, .617, .940},   {cube, 20, 4, .3, Load::kBending, .639, .983},
      {cube, 48, 4, .45, Load::kBending, .533, .984}, {cube, 20, 4, .3, Load::kTorsion, .898, .907},
      {cube, 20, 4, .45, Load::kInPlane, .881, .964}, {flat, 2, 2, .3, Load::kBending, .134, .871},
      {flat, 12, 2, .45, Load::kBending, .119, .943}, {flat, 2, 2, .3, Load::kTorsion, .413, .601},
      {flat, 12, 2, .3, Load::kTorsion, .842, .880},
  };
  for (const Row& r : rows) {
    EXPECT_NEAR(strip_compliance(ElementFormulation::kPlain, r.h, r.nx, r.ny, r.poisson, r.load), r.plain, 1e-3)
        << r.h.x << " x " << r.nx << " load " << static_cast<int>(r.load);
    EXPECT_NEAR(strip_compliance(ElementFormulation::kIncompatible, r.h, r.nx, r.ny, r.poisson, r.load), r.incompatible,
                1e-3)
        << r.h.x << " x " << r.nx << " load " << static_cast<int>(r.load);
  }
}

TEST(Element, WalshHadamardFormEqualsTheDenseMatrix) {
  Material material;
  for (ElementFormulation formulation : kBoth)
    for (double poisson : {0.0, 0.3, 0.49}) {
      material.poisson = poisson;
      const ElementMatrix k = element_matrix(formulation, material, {0.005, 0.004, 0.002});
      EXPECT_LT(walsh_hadamard_defect(k), 1e-13);
      const ElementMatrix back = dense(walsh_hadamard(k));
      const double largest = *std::max_element(k.begin(), k.end());
      for (std::size_t i = 0; i < k.size(); ++i) ASSERT_NEAR(back[i], k[i], 1e-12 * largest);
    }
}

TEST(Element, EnergyOfALinearFieldIsExactAndRigidMotionsAreFree) {
  Material material;
  material.young = 3;
  material.poisson = 0.4;
  const Vec3 h{0.7, 1.1, 0.4};
  Random random(4);
  for (ElementFormulation formulation : kBoth) {
    const ElementMatrix k = element_matrix(formulation, material, h);
    const Eigen::Map<const Eigen::Matrix<double, 24, 24, Eigen::RowMajor>> matrix(k.data());
    Eigen::Matrix3d gradient;
    for (int i = 0; i < 9; ++i) gradient(i / 3, i % 3) = random.uniform(-1, 1);
    const auto field = [&](const Eigen::Matrix3d& a) {
      Eigen::Matrix<double, 24, 1> u;
      for (int c = 0; c < 8; ++c)
        u.segment<3>(3 * c) =
            a * (0.5 * Eigen::Vector3d(corner_sign(c, 0) * h.x, corner_sign(c, 1) * h.y, corner_sign(c, 2) * h.z)) +
            Eigen::Vector3d(1, 2, 3);
      return u;
    };
    const Eigen::Matrix3d strain = 0.5 * (gradient + gradient.transpose());
    const double density =
        0.5 * lame_lambda(material) * std::pow(strain.trace(), 2) + lame_mu(material) * strain.squaredNorm();
    const Eigen::Matrix<double, 24, 1> u = field(gradient);
    EXPECT_NEAR(0.5 * u.dot(matrix * u), density * h.x * h.y * h.z, 1e-12);
    EXPECT_LT((matrix * field(gradient - gradient.transpose())).norm(), 1e-12);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
    EXPECT_NEAR(eigen.eigenvalues()[5], 0, 1e-12);
    EXPECT_GT(eigen.eigenvalues()[6], 1e-3);
  }
}

TEST(Element, FullMaterialPointsGiveTheFullCell) {
  const Material material;
  const Vec3 h{0.005, 0.004, 0.003};
  std::array<double, 27> volumes;
  const double w[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (int i = 0; i < 27; ++i) volumes[i] = h.x * h.y * h.z * w[i % 3] * w[i / 3 % 3] * w[i / 9];
  const auto points = material_points_27(volumes);
  for (ElementFormulation formulation : kBoth) {
    const ElementMatrix full = element_matrix(formulation, material, h);
    const ElementMatrix own = partly_filled_matrix(formulation, material, h, points, 0);
    for (std::size_t i = 0; i < full.size(); ++i) ASSERT_NEAR(own[i], full[i], 1e-11 * full[0]);
  }
  const auto masses = lumped_masses(1000, points);
  for (double m : masses) EXPECT_NEAR(m, 1000 * h.x * h.y * h.z / 8, 1e-15);
}

// Strain displacement matrices at every point, summed up; the incompatible modes condensed with Eigen.
Eigen::MatrixXd dense_stiffness(ElementFormulation formulation, const Material& material, Vec3 h,
                                std::span<const MaterialPoint> points) {
  const double lambda = lame_lambda(material), mu = lame_mu(material);
  Eigen::Matrix<double, 6, 6> c = Eigen::Matrix<double, 6, 6>::Zero();
  c.topLeftCorner<3, 3>().setConstant(lambda);
  c.diagonal() += Eigen::Matrix<double, 6, 1>{2 * mu, 2 * mu, 2 * mu, mu, mu, mu};
  double volume = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const MaterialPoint& p : points) {
    volume += p.volume;
    mean += p.volume * Eigen::Vector3d(p.xi.x, p.xi.y, p.xi.z);
  }
  mean /= volume;
  const int strain[9] = {0, 1, 2, 3, 3, 4, 4, 5, 5}, along[9] = {0, 1, 2, 0, 1, 1, 2, 0, 2};
  Eigen::Matrix<double, 33, 33> k = Eigen::Matrix<double, 33, 33>::Zero();
  for (const MaterialPoint& p : points) {
    Eigen::Matrix<double, 6, 33> b = Eigen::Matrix<double, 6, 33>::Zero();
    for (int n = 0; n < 8; ++n) {
      double g[3];
      for (int a = 0; a < 3; ++a) {
        const int u = (a + 1) % 3, v = (a + 2) % 3;
        g[a] = corner_sign(n, a) * (1 + corner_sign(n, u) * p.xi[u]) * (1 + corner_sign(n, v) * p.xi[v]) / (4 * h[a]);
      }
      for (int a = 0; a < 3; ++a) {
        b(a, 3 * n + a) = g[a];
        b(3 + a, 3 * n + a) = g[(a + 1) % 3];  // xy, yz, zx
        b(3 + a, 3 * n + (a + 1) % 3) = g[a];
      }
    }
    for (int r = 0; r < 9; ++r) b(strain[r], 24 + r) = p.xi[along[r]] - mean[along[r]];
    k += p.volume * b.transpose() * c * b;
  }
  Eigen::MatrixXd kuu = k.topLeftCorner<24, 24>();
  if (formulation == ElementFormulation::kIncompatible)
    kuu -= k.topRightCorner<24, 9>() * k.bottomRightCorner<9, 9>().ldlt().solve(k.bottomLeftCorner<9, 24>());
  return kuu;
}

TEST(Element, PartlyFilledMatrixIsThatOfStrainsSummedOverThePoints) {
  Material material;
  material.young = 5;
  material.poisson = 0.4;
  const Vec3 h{0.7, 1.1, 0.4};
  Random random(12);
  for (ElementFormulation formulation : kBoth)
    for (int round = 0; round < 20; ++round) {
      std::array<double, 27> volumes;
      for (double& v : volumes) v = random.uniform(0.001, 0.01);
      const auto points = material_points_27(volumes);
      const Eigen::MatrixXd expected = dense_stiffness(formulation, material, h, points);
      const ElementMatrix k = partly_filled_matrix(formulation, material, h, points, 0);
      const ElementMatrix full = element_matrix(formulation, material, h);
      const ElementMatrix with_floor = partly_filled_matrix(formulation, material, h, volumes, full);
      const double largest = expected.cwiseAbs().maxCoeff();
      for (int i = 0; i < 24; ++i)
        for (int j = 0; j < 24; ++j) {
          const auto at = static_cast<std::size_t>(24 * i + j);
          EXPECT_NEAR(k[at], expected(i, j), 1e-11 * largest);
          EXPECT_NEAR(with_floor[at], expected(i, j) + kStiffnessFloor * full[at], 1e-11 * largest);
        }
      const auto masses = lumped_masses(1000, volumes);
      for (int c = 0; c < 8; ++c) {
        double mass = 0;
        for (const MaterialPoint& p : points)
          mass += 1000 * p.volume * shape_functions(p.xi)[static_cast<std::size_t>(c)];
        EXPECT_NEAR(masses[static_cast<std::size_t>(c)], mass, 1e-12 * mass);
      }
    }
}

// Gauss points of the part of a cell between natural coordinates lo and hi.
std::vector<MaterialPoint> box_part(Vec3 h, Vec3 lo, Vec3 hi) {
  std::vector<MaterialPoint> points;
  const double g[3] = {-std::sqrt(0.6), 0, std::sqrt(0.6)}, w[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  const Vec3 s = hi - lo;
  const double volume = h.x * h.y * h.z * s.x * s.y * s.z / 8;
  for (int i = 0; i < 27; ++i) {
    const Vec3 t{(1 + g[i % 3]) / 2, (1 + g[i / 3 % 3]) / 2, (1 + g[i / 9]) / 2};
    points.push_back(
        {{lo.x + t.x * s.x, lo.y + t.y * s.y, lo.z + t.z * s.z}, volume * w[i % 3] * w[i / 3 % 3] * w[i / 9]});
  }
  return points;
}

TEST(Element, PatchOfPartlyFilledCellsCarriesALinearFieldExactly) {
  // 3 x 3 x 1 cells filled to different heights and depths: the energy of a linear field is that of the
  // material, and without mean-free modes it would be far less.
  Material material;
  material.young = 2;
  material.poisson = 0.3;
  const Vec3 h{1, 0.8, 0.6};
  Random random(3);
  for (ElementFormulation formulation : kBoth)
    for (int round = 0; round < 20; ++round) {
      const Vec3 lo{random.uniform(-1, 0.5), random.uniform(-1, 0.5), random.uniform(-1, 0.5)};
      const Vec3 hi{lo.x + random.uniform(0.01, 0.5), lo.y + random.uniform(0.1, 0.5), lo.z + random.uniform(0.1, 0.5)};
      const std::vector<MaterialPoint> points = box_part(h, lo, hi);
      double volume = 0;
      for (const MaterialPoint& p : points) volume += p.volume;
      const ElementMatrix k = partly_filled_matrix(formulation, material, h, points, 0);
      Eigen::Matrix3d gradient;
      for (int i = 0; i < 9; ++i) gradient(i / 3, i % 3) = random.uniform(-1, 1);
      Eigen::Matrix<double, 24, 1> u;
      for (int c = 0; c < 8; ++c)
        u.segment<3>(3 * c) = gradient * Eigen::Vector3d(corner_sign(c, 0) * h.x / 2, corner_sign(c, 1) * h.y / 2,
                                                         corner_sign(c, 2) * h.z / 2);
      const Eigen::Map<const Eigen::Matrix<double, 24, 24, Eigen::RowMajor>> matrix(k.data());
      const Eigen::Matrix3d strain = 0.5 * (gradient + gradient.transpose());
      const double density =
          0.5 * lame_lambda(material) * std::pow(strain.trace(), 2) + lame_mu(material) * strain.squaredNorm();
      EXPECT_NEAR(0.5 * u.dot(matrix * u), density * volume, 1e-12);
      // The forces are those of the constant stress over the material, too.
      const Eigen::Matrix3d stress =
          lame_lambda(material) * strain.trace() * Eigen::Matrix3d::Identity() + 2 * lame_mu(material) * strain;
      const Eigen::Matrix<double, 24, 1> f = matrix * u;
      for (int c = 0; c < 8; ++c) {
        Eigen::Vector3d expected = Eigen::Vector3d::Zero();
        for (const MaterialPoint& p : points) {
          const double n[3] = {1 + corner_sign(c, 0) * p.xi.x, 1 + corner_sign(c, 1) * p.xi.y,
                               1 + corner_sign(c, 2) * p.xi.z};
          const Eigen::Vector3d g(corner_sign(c, 0) * n[1] * n[2] / (4 * h.x),
                                  corner_sign(c, 1) * n[0] * n[2] / (4 * h.y),
                                  corner_sign(c, 2) * n[0] * n[1] / (4 * h.z));
          expected += p.volume * stress * g;
        }
        EXPECT_LT((f.segment<3>(3 * c) - expected).norm(), 1e-12);
      }
    }
}

TEST(Element, HalfFilledAlignedStripBendsLikeTheHalf) {
  // Thickness 1 in cells of 2: the material fills the lower half of one layer.
  Material material;
  material.young = 1000;
  material.poisson = 0.3;
  const Vec3 h{2, 2, 2};
  const Grid g{12, 2, 1};
  MechanicsModel model = test::make_box(g, h, material);
  const std::vector<MaterialPoint> half = box_part(h, {-1, -1, -1}, {1, 1, 0});
  for (std::int32_t e = 0; e < 24; ++e) {
    const MechanicsElement element = model.element(HexId(e));
    ASSERT_TRUE(model.set_element(HexId(e), element, half).ok());
  }
  EXPECT_NEAR(model.total_mass(), 24 * 4 * 1000.0, 1e-9);  // the floor of the stiffness adds no mass
  std::vector<char> fixed(3 * model.node_count(), 0);
  std::vector<double> force(3 * model.node_count(), 0);
  for (int y = 0; y <= 2; ++y)
    for (int z = 0; z <= 1; ++z) {
      for (int a = 0; a < 3; ++a) fixed[3 * g.node(0, y, z).index() + a] = 1;
      // The load acts at the middle of the material, a quarter up the cell.
      force[3 * g.node(12, y, z).index() + 2] = (y == 1 ? 0.5 : 0.25) * (z == 0 ? 0.75 : 0.25);
    }
  const std::vector<double> u = test::static_displacement(model, fixed, force);
  double compliance = 0;
  for (std::size_t i = 0; i < u.size(); ++i) compliance += u[i] * force[i];
  const double beam = std::pow(24, 3) / (3 * 1000 * 4 / 12.0) + 24 / (5.0 / 6 * lame_mu(material) * 4);
  EXPECT_NEAR(compliance / beam, 0.97, 0.03);
}

TEST(Element, MatrixIsWorkedOutAnewWhereMaterialIsAnother) {
  Material one, other;
  other.young = 3 * one.young;
  const Vec3 h{0.1, 0.2, 0.3};
  MechanicsModel model = test::make_box({2, 1, 1}, h, one);
  ASSERT_TRUE(model.add_material(other).ok());
  std::array<double, 27> volumes[2];
  Random random(5);
  for (auto& set : volumes)
    for (double& v : set) v = random.uniform(1e-6, 1e-5);
  const std::array<double, 8> masses{1, 1, 1, 1, 1, 1, 1, 1};
  // Material of each element; none where it is full, or its material was changed after it was set.
  const std::array<double, 27>* material_of[2] = {};
  const auto change_a_material = [&] {
    const auto index = static_cast<std::int32_t>(random.next() % 2);
    Material changed = model.materials()[static_cast<std::size_t>(index)];
    changed.young *= random.next() % 2 == 0 ? 1.5 : 1 / 1.5;
    ASSERT_TRUE(model.set_material(index, changed).ok());
    for (std::size_t k = 0; k < 2; ++k)
      if (model.element(HexId(k)).material == index) material_of[k] = nullptr;
  };
  // Elements come and go, so that they take each other's places in the pool of matrices.
  int compared = 0;
  for (int round = 0; round < 200; ++round) {
    const auto e = static_cast<std::size_t>(random.next() % 2);
    const HexId id(e);
    MechanicsElement element = model.element(id);
    if (random.next() % 3 == 0) model.remove_element(id);
    element.material = static_cast<std::int32_t>(random.next() % 2);
    const auto& set = volumes[random.next() % 2];
    if (random.next() % 5 == 0) change_a_material();
    ASSERT_TRUE(model.set_element(id, element, set, masses).ok());
    material_of[e] = &set;
    if (random.next() % 5 == 0) change_a_material();
    if (round % 3 == 0) model.refresh();
    for (std::size_t k = 0; k < 2; ++k) {
      const ElementMatrix stored = model.element_stiffness(HexId(k));
      if (material_of[k] == nullptr) continue;
      const Material& material = model.materials()[static_cast<std::size_t>(model.element(HexId(k)).material)];
      const ElementMatrix expected =
          partly_filled_matrix(model.formulation(), material, h, material_points_27(*material_of[k]));
      ++compared;
      for (std::size_t i = 0; i < 576; ++i)
        ASSERT_NEAR(stored[i], expected[i], 1e-11 * expected[0]) << "round " << round << ", element " << k;
    }
  }
  EXPECT_GT(compared, 200);
}

// A material that changes before a step has worked out what was set: its matrix is of the new one.
TEST(Element, AMaterialMayChangeBeforeAMatrixIsWorkedOut) {
  const Vec3 h{0.1, 0.2, 0.3};
  MechanicsModel model = test::make_box({1, 1, 1}, h, {});
  std::array<double, 27> volumes;
  volumes.fill(1e-5);
  ASSERT_TRUE(model.set_element(HexId(0), model.element(HexId(0)), volumes, {1, 1, 1, 1, 1, 1, 1, 1}).ok());
  Material stiff;
  stiff.young *= 3;
  ASSERT_TRUE(model.set_material(0, stiff).ok());
  const ElementMatrix expected = partly_filled_matrix(model.formulation(), stiff, h, material_points_27(volumes));
  for (int round = 0; round < 2; ++round) {
    const ElementMatrix stored = model.element_stiffness(HexId(0));
    for (std::size_t i = 0; i < 576; ++i) ASSERT_NEAR(stored[i], expected[i], 1e-11 * expected[0]);
    model.refresh();
  }
}

TEST(Material, RejectsWhatCannotBeSimulated) {
  Material m;
  EXPECT_TRUE(validate(m).ok());
  m.young = -1;
  EXPECT_NE(validate(m).error().message.find("young"), std::string::npos);
  m = {};
  m.poisson = 0.5;
  EXPECT_NE(validate(m).error().message.find("0.49"), std::string::npos);
  m = {};
  m.density = std::nan("");
  EXPECT_FALSE(validate(m).ok());
  m = {};
  m.damping_stiffness = -1e-3;
  EXPECT_FALSE(validate(m).ok());
}

}  // namespace
}  // namespace kerf::element_test
