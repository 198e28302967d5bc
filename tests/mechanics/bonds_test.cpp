// Bonds against closed forms: layered beams, the double cantilever beam, the peel; and what holds always.
#include "kerf/mechanics/bonds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"
#include "test_bodies.h"

namespace kerf::bonds_test {
namespace {

/// A layer of box cells, m and Pa. Layers of a stack lie on each other, from z = 0 up, and have cells of their own.
struct Layer {
  double thickness = 0.005, young = 1e7;
  int nx = 40, ny = 1, nz = 1;
};

struct Stack {
  MechanicsModel model{Vec3{1, 1, 1}};
  std::vector<Layer> layers;
  std::vector<std::size_t> first_node, first_element;
  double length = 0, width = 0;

  Stack(double length_, double width_, std::vector<Layer> layers_, double density = 1000, double damping = 0)
      : layers(std::move(layers_)), length(length_), width(width_) {
    double z = 0;
    int corner = 0;
    for (std::size_t l = 0; l < layers.size(); ++l) {
      const Layer& layer = layers[l];
      const Vec3 h{length / layer.nx, width / layer.ny, layer.thickness / layer.nz};
      if (l == 0) model = MechanicsModel(h);
      const std::int32_t cell = l == 0 ? 0 : model.add_cell({h, {}});
      Material material;
      material.young = layer.young;
      material.poisson = 0;
      material.density = density;
      material.damping_mass = damping;
      const std::int32_t kind = *model.add_material(material, cell);
      const test::Grid grid{layer.nx, layer.ny, layer.nz};
      first_node.push_back(model.node_count());
      first_element.push_back(model.element_count());
      for (int k = 0; k <= grid.nz; ++k)
        for (int j = 0; j <= grid.ny; ++j)
          for (int i = 0; i <= grid.nx; ++i) model.add_node({i * h.x, j * h.y, z + k * h.z}, {corner + i, j, k});
      for (int k = 0; k < grid.nz; ++k)
        for (int j = 0; j < grid.ny; ++j)
          for (int i = 0; i < grid.nx; ++i) {
            MechanicsElement e;
            e.nodes = grid.corners(i, j, k);
            for (NodeId& n : e.nodes) n = NodeId(n.index() + first_node.back());
            e.material = kind;
            EXPECT_TRUE(model.set_element(HexId(first_element.back() + grid.cell(i, j, k).index()), e).ok());
          }
      z += layer.thickness;
      corner += grid.nx + 2;
    }
  }

  [[nodiscard]] double top_of(std::size_t l) const {
    double z = 0;
    for (std::size_t i = 0; i <= l; ++i) z += layers[i].thickness;
    return z;
  }
  [[nodiscard]] NodeId node(std::size_t l, int i, int j, int k) const {
    return NodeId(first_node[l] + test::Grid{layers[l].nx, layers[l].ny, layers[l].nz}.node(i, j, k).index());
  }
  /// Element of a layer at a place on its lower (0) or upper (1) face, and the weights there.
  void place(std::size_t l, int face, double x, double y, BondPoint& out, std::size_t side) const {
    const Layer& layer = layers[l];
    const double hx = length / layer.nx, hy = width / layer.ny;
    const int i = std::min(layer.nx - 1, static_cast<int>(x / hx)),
              j = std::min(layer.ny - 1, static_cast<int>(y / hy));
    const test::Grid grid{layer.nx, layer.ny, layer.nz};
    out.element[side] = HexId(first_element[l] + grid.cell(i, j, face == 0 ? 0 : layer.nz - 1).index());
    out.local[side] = {2 * (x / hx - i) - 1, 2 * (y / hy - j) - 1, face == 0 ? -1.0 : 1.0};
  }
  /// Points between all layers, from x = from on, a square of `spacing` each or less.
  void bond(BondLaw law, double from, double spacing, double spacing_across = 0.005) {
    std::vector<BondPoint> points;
    const int nx = static_cast<int>(std::ceil((length - from) / spacing)),
              ny = static_cast<int>(std::ceil(width / spacing_across));
    for (std::size_t l = 0; l + 1 < layers.size(); ++l)
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
          BondPoint p;
          const double x = from + (length - from) * (i + 0.5) / nx, y = width * (j + 0.5) / ny;
          place(l, 1, x, y, p, 0);
          place(l + 1, 0, x, y, p, 1);
          p.normal = {0, 0, 1};
          p.area = (length - from) * width / (nx * ny);
          points.push_back(p);
        }
    EXPECT_TRUE(model.set_bonds({law}, std::move(points)).ok());
  }
  template <class Fn>
  void for_end(std::size_t l, int i, Fn&& f) const {
    for (int j = 0; j <= layers[l].ny; ++j)
      for (int k = 0; k <= layers[l].nz; ++k) f(node(l, i, j, k));
  }
};

BondLaw strong(double stiffness) { return {stiffness, {1e9, 1e9}, {1e18, 1e18}, 2}; }

StepOptions quiet(double dt) {
  StepOptions o;
  o.dt = dt;
  o.gravity = {};
  o.tolerance = 1e-4;
  return o;
}

/// Deflection of the free end of a cantilever under a small load there, spread over all layers.
double deflection(Stack& stack, double load) {
  std::size_t ends = 0;
  for (std::size_t l = 0; l < stack.layers.size(); ++l) {
    stack.for_end(l, 0, [&](NodeId n) { stack.model.fix_node(n); });
    stack.for_end(l, stack.layers[l].nx, [&](NodeId) { ++ends; });
  }
  for (std::size_t l = 0; l < stack.layers.size(); ++l)
    stack.for_end(l, stack.layers[l].nx, [&](NodeId n) {
      stack.model.add_load(n, {0, 0, load / static_cast<double>(ends)});
    });
  MechanicsState state = rest_state(stack.model);
  StepWorkspace w;
  StepOptions o = quiet(1e3);
  o.solver = SolverKind::kDirect;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(step(stack.model, state, o, w).ok());
  double sum = 0;
  std::size_t l = 0;
  stack.for_end(l, stack.layers[l].nx,
                [&](NodeId n) { sum += state.positions[n.index()].z - stack.model.rest_positions()[n.index()].z; });
  return sum / (2.0 * (stack.layers[0].ny + 1));
}

TEST(BondLaw, TheAreaUnderTheCurveIsTheToughness) {
  const BondLaw law{1e8, {1e4, 2e4}, {20, 60}, 2};
  for (const double share : {0.0, 0.3, 0.7, 1.0}) {  // of the squares: that of shear
    const double want = 20 + (60 - 20) * share * share;
    double work = 0, last = 0, damage = 0;
    const double step = 1e-7;
    for (double l = step / 2; l < 2e-2; l += step) {
      const double now = bond_damage(law, l * std::sqrt(1 - share), l * std::sqrt(share));
      EXPECT_GE(now, damage);
      damage = now;
      work += (1 - now) * law.stiffness * l * step;
      last = (1 - now) * l;
    }
    EXPECT_EQ(last, 0);
    EXPECT_NEAR(work / want, 1, 1e-3) << share;
  }
  EXPECT_EQ(bond_damage(law, 0.99e-4, 0), 0);
  EXPECT_GT(bond_damage(law, 1.01e-4, 0), 0);
  EXPECT_EQ(bond_damage(law, 0, 1.99e-4), 0);
  EXPECT_EQ(bond_damage(law, 0, 6.1e-3), 1);
}

TEST(BondLaw, WhatCannotBeIsRefused) {
  const BondLaw good{1e8, {1e4, 1e4}, {20, 20}, 2};
  EXPECT_TRUE(validate(good).ok());
  for (const auto& change : std::vector<std::function<void(BondLaw&)>>{
           [](BondLaw& l) { l.stiffness = 0; }, [](BondLaw& l) { l.strength[1] = -1; },
           [](BondLaw& l) { l.toughness[0] = 0.4; }, [](BondLaw& l) { l.mixing = std::nan(""); }}) {
    BondLaw bad = good;
    change(bad);
    EXPECT_FALSE(validate(bad).ok());
  }
}

TEST(Bonds, TwoEqualLayersBendAsOneOfDoubleThickness) {
  const double length = 0.2, width = 0.02, h = 0.005, young = 1e7, load = 1e-4;
  const auto inertia = [&](double thickness) { return width * thickness * thickness * thickness / 12; };
  Stack apart(length, width, {{h, young, 40}, {h, young, 40}});
  EXPECT_NEAR(deflection(apart, load) / (load * std::pow(length, 3) / (3 * young * 2 * inertia(h))), 1, 0.03);
  for (const int other : {40, 26}) {  // cells of their own
    Stack stack(length, width, {{h, young, 40}, {h, young, other}});
    stack.bond(strong(10 * young / h), 0, 0.002);
    const double want = load * std::pow(length, 3) / (3 * young * inertia(2 * h));
    EXPECT_NEAR(deflection(stack, load) / want, 1, 0.03) << other;
  }
}

TEST(Bonds, LayersOfOtherModuliBendAsTheCompositeBeam) {
  const double length = 0.25, width = 0.02, load = 1e-5;
  const std::vector<Layer> layers = {{0.003, 2e5, 50}, {0.004, 1e5, 36}, {0.002, 3e5, 60}};
  Stack stack(length, width, layers);
  stack.bond(strong(10 * 2e5 / 0.002), 0, 0.002);
  double ea = 0, eaz = 0, z = 0, ei = 0;
  for (const Layer& l : layers) {
    ea += l.young * l.thickness;
    eaz += l.young * l.thickness * (z + l.thickness / 2);
    z += l.thickness;
  }
  const double neutral = eaz / ea;
  z = 0;
  for (const Layer& l : layers) {
    const double arm = z + l.thickness / 2 - neutral;
    ei += l.young * width * (std::pow(l.thickness, 3) / 12 + l.thickness * arm * arm);
    z += l.thickness;
  }
  EXPECT_NEAR(deflection(stack, load) / (load * std::pow(length, 3) / (3 * ei)), 1, 0.03);
}

/// At most a strength at which the zone that tears in a layer that is bent off is so many cells long. Stiff as the bonds of a scene are.
BondLaw tough(double strength, double toughness, double young, double thickness, double cell, double zone = 4) {
  const double s = std::min(strength, resolved_strength(young, thickness, toughness, zone * cell));
  return {std::max(young / thickness, 2 * s * s / toughness), {s, s}, {toughness, toughness}, 2};
}

struct Peel {
  double force = 0;   ///< over theory's, in the mean
  double worst = 0;   ///< largest relative error on the way
  double energy = 0;  ///< J that tearing took
  double torn = 0;    ///< m^2
};

/// Both ends at x = 0 go apart. Force against opening is that of beam theory, whatever the length of the crack.
Peel double_cantilever(int cells, double dt, double spacing, double strength = 5e3, double zone = 4) {
  const double length = 0.2, width = 0.02, h = 0.005, young = 1e7, toughness = 0.5, crack = 0.06;
  const double ei = young * width * h * h * h / 12;
  Stack stack(length, width, {{h, young, cells}, {h, young, cells}}, 1000, 10);
  const BondLaw law = tough(strength, toughness, young, h, length / cells, zone);
  stack.bond(law, crack, spacing);
  const double speed = 0.01;  // of both together
  for (std::size_t l = 0; l < 2; ++l)
    for (int j = 0; j <= 1; ++j) {
      const int k = l == 0 ? 0 : 1;
      stack.model.fix_node(stack.node(l, 0, j, k), {0, 0, l == 0 ? -speed / 2 : speed / 2});
    }
  MechanicsState state = rest_state(stack.model);
  StepWorkspace w;
  StepOptions o = quiet(dt);
  o.tolerance = 1e-3;
  Peel out;
  const double begin = 2.0 / 3 * 0.09 * 0.09 * std::sqrt(toughness * width / ei),
               end = 2.0 / 3 * 0.14 * 0.14 * std::sqrt(toughness * width / ei);
  double ratio = 0;
  int ratios = 0;
  for (double opening = 0; opening < end; opening += speed * dt) {
    const auto done = step(stack.model, state, o, w);
    EXPECT_TRUE(done.ok());
    if (!done.ok()) return out;
    double force = 0;
    for (int j = 0; j <= 1; ++j) force += reaction(stack.model, w, o, stack.node(1, 0, j, 1)).z;
    const double now = opening + speed * dt;
    if (now < begin) continue;
    const double a = std::sqrt(1.5 * now * std::sqrt(ei / (toughness * width)));
    const double want = std::sqrt(toughness * width * ei) / a;
    if (std::abs(force / want - 1) > std::abs(out.worst)) out.worst = force / want - 1;
    ratio += force / want;
    ++ratios;
  }
  for (std::size_t p = 0; p < state.bond_damage.size(); ++p)
    if (state.bond_damage[p] >= 1) out.torn += stack.model.bond_points()[p].area;
  out.energy = state.bond_dissipated;
  out.force = ratio / ratios;
  return out;
}

TEST(Bonds, DoubleCantileverBeamOpensAsBeamTheorySays) {
  for (const auto& [cells, dt] : {std::pair{40, 0.005}, {60, 0.005}, {90, 0.005}, {60, 0.001}, {60, 0.01}}) {
    const Peel peel = double_cantilever(cells, dt, 0.001);
    EXPECT_NEAR(peel.energy / peel.torn / 0.5, 1.05, 0.06);  // with what is torn in part
    EXPECT_NEAR(peel.force, 1, 0.07) << cells << " cells, " << dt << " s";
    EXPECT_NEAR(peel.worst, 0, 0.10) << cells << " cells, " << dt << " s";
  }
}

/// As bonds of a scene are: as strong as cells resolve, points four to a cell. Cells are twice as long as the beams are thick.
TEST(Bonds, AZoneOfOneCellTakesAFifthMoreThanTheory) {
  for (const double dt : {0.005, 0.01}) {
    const Peel peel = double_cantilever(20, dt, 0.0025, 1e9, 1);
    EXPECT_NEAR(peel.energy / peel.torn / 0.5, 1.03, 0.05) << dt;
    EXPECT_NEAR(peel.force, 1.2, 0.05) << dt << " s";
    EXPECT_NEAR(peel.worst, 0.3, 0.1) << dt << " s";
  }
}

/// A strip is pulled off a rigid floor at right angles.
Peel peel_off(int cells, double dt, double speed) {
  const double length = 0.16, width = 0.02, h = 0.004, young = 1e6, toughness = 5, crack = 0.03;
  Stack stack(length, width, {{h, young, 8}, {h, young, cells}}, 1000, 10);
  for (std::size_t i = 0; i < stack.first_node[1]; ++i) stack.model.fix_node(NodeId(i));
  const BondLaw law = tough(1e4, toughness, young, h, length / cells);
  stack.bond(law, crack, 0.001);
  RowSpring spring;  // pulls the end upright, wherever it goes along the floor
  std::size_t used = 0;
  stack.for_end(1, 0, [&](NodeId n) {
    spring.nodes[used] = n;
    spring.weights[used++] = 0.25;
  });
  spring.stiffness = 20;
  Vec3 end{0, width / 2, 1.5 * h};
  spring.target = end;
  const SpringId hand = *stack.model.add_spring(spring);
  MechanicsState state = rest_state(stack.model);
  StepWorkspace w;
  StepOptions o = quiet(dt);
  o.tolerance = 1e-3;
  Peel out;
  double impulse = 0, time = 0;
  for (double way = 0; way < 0.11; way += speed * dt) {
    Vec3 now;
    for (std::size_t k = 0; k < used; ++k) now += 0.25 * state.positions[spring.nodes[k].index()];
    stack.model.set_spring_target(hand, {now.x, width / 2, end.z + way + speed * dt});
    const auto done = step(stack.model, state, o, w);
    EXPECT_TRUE(done.ok());
    if (!done.ok()) return out;
    const Vec3 force = spring_force(stack.model, state, hand);
    if (way < 0.07) continue;
    impulse += dt * (norm(force) + force.x);
    time += dt;
  }
  out.force = impulse / time / width / toughness;
  for (std::size_t p = 0; p < state.bond_damage.size(); ++p)
    if (state.bond_damage[p] >= 1) out.torn += stack.model.bond_points()[p].area;
  out.energy = state.bond_dissipated;
  return out;
}

TEST(Bonds, PeelingAtRightAnglesTakesTheToughness) {
  for (const auto& [cells, dt] : {std::pair{32, 0.005}, {48, 0.005}, {64, 0.005}, {32, 0.001}, {32, 0.01}})
    EXPECT_NEAR(peel_off(cells, dt, 0.05).force, 1, 0.07) << cells << " cells, " << dt << " s";
}

/// Two slabs fly apart, spin, and tear. Whatever the step, they don't gain energy, and keep momentum and angular momentum.
TEST(Bonds, TearingGainsNoEnergyAndKeepsMomentum) {
  for (const double dt : {0.001, 0.005, 0.02})
    for (const double toughness : {0.02, 2.0, 2e3}) {
      Stack stack(0.06, 0.04, {{0.01, 1e5, 6, 4, 1}, {0.01, 5e4, 5, 3, 1}});
      const double strength = std::min(2e3, std::sqrt(toughness * 5e6));
      stack.bond({5e6, {strength, strength}, {toughness, toughness}, 2}, 0, 0.004, 0.004);
      MechanicsState state = rest_state(stack.model);
      stack.model.refresh();
      const std::vector<double>& mass = stack.model.structure().mass;
      for (std::size_t i = 0; i < stack.model.node_count(); ++i) {
        const Vec3 p = state.positions[i];
        state.velocities[i] =
            cross(Vec3{2, 3, 1}, p) + Vec3{0.1, 0, p.z > 0.0101 || i >= stack.first_node[1] ? 0.5 : -0.5};
      }
      const auto totals = [&] {
        Vec3 p, l;
        for (std::size_t i = 0; i < mass.size(); ++i) {
          p += mass[i] * state.velocities[i];
          l += mass[i] * cross(state.positions[i], state.velocities[i]);
        }
        return std::array<Vec3, 2>{p, l};
      };
      double energy = 0;
      for (std::size_t i = 0; i < mass.size(); ++i)
        energy += 0.5 * mass[i] * dot(state.velocities[i], state.velocities[i]);
      const double began = energy;
      const auto was = totals();
      StepWorkspace w;
      StepOptions o = quiet(dt);
      std::vector<double> damage = state.bond_damage;
      for (int i = 0; i < 100; ++i) {
        const auto done = step(stack.model, state, o, w);
        ASSERT_TRUE(done.ok());
        EXPECT_LE(done->kinetic_energy + bond_energy(stack.model, state), began * (1 + 1e-6)) << dt << " " << toughness;
        for (std::size_t p = 0; p < damage.size(); ++p) EXPECT_GE(state.bond_damage[p], damage[p]);
        damage = state.bond_damage;
      }
      const auto is = totals();
      EXPECT_LT(norm(is[0] - was[0]), 1e-9 * norm(was[0]));
      EXPECT_LT(norm(is[1] - was[1]), 0.02 * norm(was[1]));
      const auto torn = static_cast<std::size_t>(std::count(damage.begin(), damage.end(), 1.0));
      if (toughness < 0.1 && dt < 0.01) {  // in longer steps its strength stops them at once
        EXPECT_EQ(torn, damage.size());
      }
      if (toughness > 1e3) {
        EXPECT_EQ(torn, 0u);
      }
    }
}

/// Solvers agree, and so do products by nodes and by cells.
TEST(Bonds, IterationsFindWhatFactorisingFinds) {
  std::vector<Vec3> ends;
  for (const bool direct : {false, true}) {
    Stack stack(0.08, 0.04, {{0.01, 1e5, 8, 4, 1}, {0.006, 2e5, 7, 3, 1}});
    stack.bond({2e7, {1e4, 1e4}, {50, 50}, 2}, 0, 0.003, 0.003);
    for (std::size_t i = 0; i < stack.first_node[1]; ++i)
      if (stack.model.rest_positions()[i].z == 0) stack.model.fix_node(NodeId(i));
    stack.for_end(1, 7, [&](NodeId n) { stack.model.add_load(n, {0.1, 0, 0.3}); });
    MechanicsState state = rest_state(stack.model);
    StepWorkspace w;
    StepOptions o = quiet(0.005);
    o.tolerance = 1e-10;
    if (direct) o.solver = SolverKind::kDirect;
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(step(stack.model, state, o, w).ok());
    if (!direct) ends = state.positions;
    else
      for (std::size_t i = 0; i < ends.size(); ++i) EXPECT_LT(norm(ends[i] - state.positions[i]), 1e-7);
  }
}

}  // namespace
}  // namespace kerf::bonds_test
