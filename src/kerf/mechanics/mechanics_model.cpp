#include "kerf/mechanics/mechanics_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kerf/mechanics/tolerances.h"

namespace kerf {
namespace {

constexpr double kAxesTolerance = 1e-9;

Status check_cell(const ElementCell& cell) {
  for (int a = 0; a < 3; ++a)
    if (!(cell.size[a] > 0) || !std::isfinite(cell.size[a]))
      return bad_input(fmt::format("cell size: {} m along axis {} must be positive", cell.size[a], "xyz"[a]));
  const auto& axes = cell.axes.c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (!(std::abs(dot(axes[i], axes[j]) - (i == j ? 1 : 0)) < kAxesTolerance))
        return bad_input("lattice axes: they are not a rotation; give three orthogonal unit vectors");
  if (dot(cross(axes[0], axes[1]), axes[2]) < 0)
    return bad_input("lattice axes: they are left-handed; flip one of them");
  return {};
}

Status not_finite(HexId id) {
  return bad_input(fmt::format("element {}: its stiffness is not finite; check its material points", id.value + 1));
}

}  // namespace

MechanicsModel::MechanicsModel(Vec3 cell_size, const Mat3& axes, ElementFormulation formulation)
    : cells_{{cell_size, axes}}, formulation_(formulation), own_empty_(1) {}

std::int32_t MechanicsModel::add_cell(const ElementCell& cell) {
  cells_.push_back(cell);
  own_empty_.emplace_back();
  return static_cast<std::int32_t>(cells_.size() - 1);
}

Result<std::int32_t> MechanicsModel::add_material(const Material& material, std::int32_t cell) {
  KERF_TRY(kerf::validate(material));
  if (cell < 0 || static_cast<std::size_t>(cell) >= cells_.size())
    return bad_input(fmt::format("material: cell {} does not exist; there are {}", cell, cells_.size()));
  materials_.push_back(material);
  material_cell_.push_back(cell);
  full_matrix_.push_back(element_matrix(formulation_, material, cells_[static_cast<std::size_t>(cell)].size));
  stale_ = true;
  return static_cast<std::int32_t>(materials_.size() - 1);
}

Status MechanicsModel::set_material(std::int32_t index, const Material& material) {
  if (index < 0 || static_cast<std::size_t>(index) >= materials_.size())
    return bad_input(fmt::format("material {} does not exist; there are {}", index, materials_.size()));
  KERF_TRY(kerf::validate(material));
  const Material before = materials_[index];
  materials_[index] = material;
  full_matrix_[index] = element_matrix(formulation_, material, cell(index).size);
  for (OwnMaterial& own : own_material_)
    if (own.material == index && !own.pending) own.material = -1;  // what is pending takes the new one
  if (before.density != material.density)
    for (std::size_t e = 0; e < elements_.size(); ++e)
      if (alive_[e] && elements_[e].material == index) {
        for (double& mass : element_masses_[e]) mass *= material.density / before.density;
      }
  stale_ = true;
  return {};
}

NodeId MechanicsModel::add_node(Vec3 rest_position, GridPoint grid) {
  rest_positions_.push_back(rest_position);
  node_uses_.push_back(0);
  grid_.push_back(grid);
  fixed_.push_back(0);
  prescribed_.emplace_back();
  loads_.emplace_back();
  stale_ = true;
  return NodeId(rest_positions_.size() - 1);
}

double MechanicsModel::node_mass(NodeId node) {
  refresh();
  return structure_.mass[node.index()];
}

double MechanicsModel::total_mass() {
  refresh();
  return structure_.total_mass;
}

std::int32_t MechanicsModel::piece_count() {
  refresh();
  return structure_.rigid.pieces;
}

Status MechanicsModel::check_element(HexId id, const MechanicsElement& element) const {
  if (!id.valid()) return bad_input("element: invalid id");
  if (element.material < 0 || static_cast<std::size_t>(element.material) >= materials_.size())
    return bad_input(fmt::format("element {}: material {} does not exist; there are {}", id.value + 1, element.material,
                                 materials_.size()));
  if (!(element.young_scale > 0) || !std::isfinite(element.young_scale))
    return bad_input(fmt::format("element {}: young_scale = {} must be positive", id.value + 1, element.young_scale));
  for (int i = 0; i < 8; ++i) {
    if (!element.nodes[i].valid() || element.nodes[i].index() >= node_count())
      return bad_input(fmt::format("element {}: corner {} names node {}, but there are {} nodes", id.value + 1, i + 1,
                                   element.nodes[i].value + 1, node_count()));
    for (int j = 0; j < i; ++j)
      if (element.nodes[i] == element.nodes[j])
        return bad_input(fmt::format("element {}: corners {} and {} are the same node {}", id.value + 1, j + 1, i + 1,
                                     element.nodes[i].value + 1));
  }
  return {};
}

// By value: what is stored may be a copy of another element of this very model.
void MechanicsModel::store_element(HexId id, MechanicsElement element, std::array<double, 8> masses) {
  if (id.index() >= elements_.size()) {
    elements_.resize(id.index() + 1);
    alive_.resize(id.index() + 1, 0);
    element_masses_.resize(id.index() + 1);
    own_slot_.resize(id.index() + 1, -1);
  }
  count_uses(id, -1);
  elements_[id.index()] = element;
  alive_[id.index()] = 1;
  count_uses(id, 1);
  element_masses_[id.index()] = masses;
  stale_ = true;
}

void MechanicsModel::count_uses(HexId id, std::int32_t by) {
  if (!alive_[id.index()]) return;
  for (const NodeId n : elements_[id.index()].nodes) node_uses_[n.index()] += by;
}

void MechanicsModel::release_own(HexId id) {
  if (id.index() >= own_slot_.size() || own_slot_[id.index()] < 0) return;
  const std::int32_t slot = own_slot_[id.index()];
  own_element_[slot] = -1;
  own_empty_[own_cell_[slot / kLanes]].push_back(slot);
  own_slot_[id.index()] = -1;
}

Status MechanicsModel::set_element(HexId id, const MechanicsElement& element) {
  KERF_TRY(check_element(id, element));
  release_own(id);
  store_element(id, element, lumped_masses(materials_[element.material].density, cell(element.material).size));
  return {};
}

Status MechanicsModel::check_masses(HexId id, const std::array<double, 8>& masses) const {
  for (double m : masses)
    if (!std::isfinite(m))
      return bad_input(fmt::format(
          "element {}: a corner's mass is not finite; check the density and its material points", id.value + 1));
  return {};
}

Status MechanicsModel::set_element(HexId id, const MechanicsElement& element, const std::array<double, 8>& masses) {
  KERF_TRY(check_element(id, element));
  KERF_TRY(check_masses(id, masses));
  release_own(id);
  store_element(id, element, masses);
  return {};
}

Status MechanicsModel::set_element(HexId id, const MechanicsElement& element, std::span<const MaterialPoint> points) {
  KERF_TRY(check_element(id, element));
  const Material& material = materials_[element.material];
  return set_element(id, element, partly_filled_matrix(formulation_, material, cell(element.material).size, points),
                     lumped_masses(material.density, points));
}

Status MechanicsModel::set_element(HexId id, const MechanicsElement& element, const ElementMatrix& matrix,
                                   const std::array<double, 8>& masses) {
  KERF_TRY(check_element(id, element));
  KERF_TRY(check_masses(id, masses));
  return store_own(id, element, matrix, masses);
}

Status MechanicsModel::set_element(HexId id, const MechanicsElement& element, const std::array<double, 27>& volumes,
                                   const std::array<double, 8>& masses) {
  KERF_TRY(check_element(id, element));
  KERF_TRY(check_masses(id, masses));
  const std::int32_t slot = next_own(id, cell_of(element.material));
  if (slot >= 0 && own_material_[slot].material == element.material && own_material_[slot].volumes == volumes) {
    store_element(id, element, masses);
    take_own(id, cell_of(element.material));
    return {};
  }
  for (double v : volumes)
    if (!std::isfinite(v)) return not_finite(id);
  store_element(id, element, masses);
  own_material_[take_own(id, cell_of(element.material))] = {volumes, element.material, true};
  return {};
}

ElementMatrix MechanicsModel::pending_matrix(std::int32_t slot) const {
  const OwnMaterial& own = own_material_[slot];
  return partly_filled_matrix(formulation_, materials_[own.material], cell(own.material).size, own.volumes,
                              full_matrix_[own.material]);
}

/// The slot that take_own() will give without a new block, or -1.
std::int32_t MechanicsModel::next_own(HexId id, std::int32_t cell) const {
  const std::int32_t own = id.index() < own_slot_.size() ? own_slot_[id.index()] : -1;
  if (own >= 0 && own_cell_[own / kLanes] == cell) return own;
  return own_empty_[cell].empty() ? -1 : own_empty_[cell].back();
}

/// The element's slot, a new one if it had none among its cell's; what is in it may be of another element.
std::int32_t MechanicsModel::take_own(HexId id, std::int32_t cell) {
  std::int32_t slot = next_own(id, cell);
  if (slot >= 0 && slot == own_slot_[id.index()]) return slot;
  release_own(id);
  if (slot < 0) {
    slot = static_cast<std::int32_t>(own_element_.size());
    own_cell_.push_back(cell);
    own_element_.resize(own_element_.size() + kLanes, -1);
    own_material_.resize(own_element_.size());
    own_matrices_.resize(own_matrices_.size() + kOwnBlock, 0.0);
    for (int lane = kLanes - 1; lane > 0; --lane) own_empty_[cell].push_back(slot + lane);
  } else {
    own_empty_[cell].pop_back();
  }
  own_slot_[id.index()] = slot;
  own_element_[slot] = id.value;
  return slot;
}

Status MechanicsModel::store_own(HexId id, const MechanicsElement& element, const ElementMatrix& matrix,
                                 const std::array<double, 8>& masses) {
  for (double k : matrix)
    if (!std::isfinite(k)) return not_finite(id);
  store_element(id, element, masses);
  const std::int32_t slot = take_own(id, cell_of(element.material));
  own_material_[slot].material = -1;
  own_material_[slot].pending = false;
  store_matrix(slot, matrix);
  return {};
}

void MechanicsModel::store_matrix(std::int32_t slot, const ElementMatrix& matrix) {
  double* out = own_matrices_.data() + kOwnBlock * static_cast<std::size_t>(slot / kLanes) + slot % kLanes;
  for (int i = 0; i < 24; ++i)
    for (int j = i; j < 24; ++j, out += kLanes) *out = 0.5 * (matrix[24 * i + j] + matrix[24 * j + i]);
}

void MechanicsModel::remove_element(HexId id) {
  if (!has_element(id)) return;
  release_own(id);
  count_uses(id, -1);
  alive_[id.index()] = 0;
  stale_ = true;
}

Status MechanicsModel::truncate(std::size_t nodes, std::size_t elements) {
  const auto count_going = [&](std::int32_t by) {
    for (std::size_t e = elements; e < elements_.size(); ++e) count_uses(HexId(e), by);
  };
  count_going(-1);
  const auto going = node_uses_.begin() + static_cast<std::ptrdiff_t>(std::min(nodes, node_count()));
  if (std::any_of(going, node_uses_.end(), [](std::int32_t uses) { return uses > 0; })) {
    count_going(1);
    for (std::size_t e = 0; e < std::min(elements, elements_.size()); ++e)
      for (const NodeId n : elements_[e].nodes)
        if (alive_[e] && n.index() >= nodes)
          return bad_input(
              fmt::format("element {} still uses node {}; change it before the node goes", e + 1, n.value + 1));
  }
  for (std::size_t e = elements; e < elements_.size(); ++e) release_own(HexId(e));
  if (elements < elements_.size()) {
    elements_.resize(elements);
    alive_.resize(elements);
    element_masses_.resize(elements);
    own_slot_.resize(elements);
  }
  for (RowSpring& spring : springs_)
    for (NodeId n : spring.nodes)
      if (n.valid() && n.index() >= nodes) {
        spring.nodes.fill(NodeId());
        break;
      }
  if (nodes < node_count()) {
    rest_positions_.resize(nodes);
    node_uses_.resize(nodes);
    grid_.resize(nodes);
    fixed_.resize(nodes);
    prescribed_.resize(nodes);
    loads_.resize(nodes);
  }
  stale_ = true;
  return {};
}

ElementMatrix MechanicsModel::element_stiffness(HexId id) const {
  const MechanicsElement& e = elements_[id.index()];
  ElementMatrix k;
  if (own_slot_[id.index()] < 0) {
    k = full_matrix_[e.material];
  } else {
    const std::int32_t slot = own_slot_[id.index()];
    const bool pending = own_material_[slot].pending;
    if (pending) k = pending_matrix(slot);
    const double* in = own_block(slot / kLanes) + slot % kLanes;
    for (int i = 0; i < 24; ++i)
      for (int j = i; j < 24; ++j, in += kLanes)
        k[24 * i + j] = k[24 * j + i] = pending ? 0.5 * (k[24 * i + j] + k[24 * j + i]) : *in;
  }
  for (double& x : k) x *= e.young_scale;
  return k;
}

void MechanicsModel::fix_node(NodeId node, Vec3 velocity) {
  if (!fixed_[node.index()]) stale_ = true;
  fixed_[node.index()] = 1;
  prescribed_[node.index()] = velocity;
}

void MechanicsModel::release_node(NodeId node) {
  if (fixed_[node.index()]) stale_ = true;
  fixed_[node.index()] = 0;
  prescribed_[node.index()] = {};
}

double MechanicsModel::spring_cap(std::int32_t material, double young_scale) const {
  const Vec3 size = cell(material).size;
  const double h = std::cbrt(size.x * size.y * size.z);
  return kSpringCap * materials_[material].young * young_scale * h;
}

Result<SpringReceipt> MechanicsModel::add_attachment(HexId id, const std::array<double, 8>& weights, Vec3 target,
                                                     double stiffness, double damping) {
  if (!has_element(id)) return bad_input(fmt::format("attachment: element {} does not exist", id.value + 1));
  const MechanicsElement& e = elements_[id.index()];
  RowSpring spring;
  spring.nodes = e.nodes;
  spring.weights = weights;
  spring.target = target;
  spring.damping = damping;
  spring.stiffness = stiffness;
  const double cap = spring_cap(e.material, e.young_scale);
  const bool capped = stiffness > cap;
  if (capped) spring.stiffness = cap;
  const Result<SpringId> added = add_spring(spring);
  if (!added) return added.error();
  spring_caps_[added->index()] = cap;
  return SpringReceipt{*added, spring.stiffness, capped};
}

Result<SpringReceipt> MechanicsModel::add_node_pair(NodeId a, NodeId b, double stiffness, double damping) {
  if (materials_.empty()) return bad_input("node pair: add a material first");
  RowSpring spring;
  spring.nodes[0] = a;
  spring.nodes[1] = b;
  spring.weights[0] = 1;
  spring.weights[1] = -1;
  spring.damping = damping;
  spring.stiffness = stiffness;
  const double cap = spring_cap(0, 1);
  const bool capped = stiffness > cap;
  if (capped) spring.stiffness = cap;
  const Result<SpringId> added = add_spring(spring);
  if (!added) return added.error();
  spring_caps_[added->index()] = cap;
  return SpringReceipt{*added, spring.stiffness, capped};
}

Result<SpringId> MechanicsModel::add_spring(const RowSpring& spring) {
  if (!(spring.stiffness >= 0) || !std::isfinite(spring.stiffness))
    return bad_input(fmt::format("spring: stiffness {} N/m must not be negative", spring.stiffness));
  if (!(spring.damping >= 0) || !std::isfinite(spring.damping))
    return bad_input(fmt::format("spring: damping {} N s/m must not be negative", spring.damping));
  if (!is_finite(spring.target) || !is_finite(spring.target_velocity))
    return bad_input("spring: its target is not finite");
  RowSpring packed = spring;  // the live nodes first
  packed.nodes.fill(NodeId());
  packed.weights.fill(0);
  int used = 0;
  for (int i = 0; i < 8; ++i) {
    if (!spring.nodes[i].valid()) continue;
    if (spring.nodes[i].index() >= node_count())
      return bad_input(
          fmt::format("spring: node {} does not exist; there are {}", spring.nodes[i].value + 1, node_count()));
    if (!std::isfinite(spring.weights[i])) return bad_input("spring: a weight is not finite");
    for (int j = 0; j < used; ++j)
      if (packed.nodes[j] == spring.nodes[i])
        return bad_input(fmt::format("spring: node {} appears twice", spring.nodes[i].value + 1));
    packed.nodes[used] = spring.nodes[i];
    packed.weights[used++] = spring.weights[i];
  }
  if (used == 0) return bad_input("spring: it names no node");
  stale_ = true;
  for (std::size_t i = 0; free_springs_ > 0 && i < springs_.size(); ++i)
    if (!springs_[i].nodes[0].valid()) {
      springs_[i] = packed;
      spring_caps_[i] = HUGE_VAL;
      --free_springs_;
      return SpringId(i);
    }
  springs_.push_back(packed);
  spring_caps_.push_back(HUGE_VAL);
  return SpringId(springs_.size() - 1);
}

void MechanicsModel::set_spring_target(SpringId id, Vec3 target, Vec3 velocity) {
  springs_[id.index()].target = target;
  springs_[id.index()].target_velocity = velocity;
}

SpringReceipt MechanicsModel::set_spring_stiffness(SpringId id, double stiffness) {
  const double cap = spring_caps_[id.index()];
  const bool capped = stiffness > cap;
  springs_[id.index()].stiffness = std::max(0.0, capped ? cap : stiffness);
  return {id, springs_[id.index()].stiffness, capped};
}

void MechanicsModel::remove_spring(SpringId id) {
  if (!has_spring(id)) return;
  springs_[id.index()].nodes.fill(NodeId());
  ++free_springs_;
  stale_ = true;
}

void MechanicsModel::clear_springs() {
  springs_.clear();
  spring_caps_.clear();
  free_springs_ = 0;
  stale_ = true;
}

Status MechanicsModel::set_bonds(std::vector<BondLaw> laws, std::vector<BondPoint> points) {
  for (const BondLaw& law : laws) KERF_TRY(kerf::validate(law));
  for (const BondPoint& point : points) {
    bool finite = point.area > 0 && std::isfinite(point.area) && is_finite(point.normal);
    for (const Vec3 local : point.local) finite = finite && is_finite(local);
    if (!finite) return bad_input("bond: a point's area, normal or place is not finite, or its area is not positive");
    if (point.law < 0 || static_cast<std::size_t>(point.law) >= laws.size())
      return bad_input(fmt::format("bond: there is no law {}", point.law + 1));
  }
  bond_laws_ = std::move(laws);
  bond_points_ = std::move(points);
  stale_ = true;
  return {};
}

void MechanicsModel::set_bond_point(std::size_t number, const BondPoint& point) {
  bond_points_[number] = point;
  stale_ = true;
}

void MechanicsModel::follow_bonds(std::span<const double> damage) {
  const BondStructure& s = structure_.bonds;
  bool changed = false;
  for (std::size_t i = 0; i < s.pairs.size(); ++i) {
    const BondPair& pair = s.pairs[i];
    std::uint8_t holds = 0;
    for (std::int32_t k = pair.first; holds == 0 && k < pair.first + pair.count; ++k)
      holds = damage[static_cast<std::size_t>(s.order[static_cast<std::size_t>(k)])] < 1 ? 1 : 0;
    changed = changed || holds != bond_holds_[i];
    bond_holds_[i] = holds;
  }
  if (changed) structure_.rigid = rigid_pieces(*this);
}

void MechanicsModel::clear_loads() { std::fill(loads_.begin(), loads_.end(), Vec3{}); }

Status MechanicsModel::validate() const {
  for (const ElementCell& cell : cells_) KERF_TRY(check_cell(cell));
  for (std::size_t n = 0; n < rest_positions_.size(); ++n)
    if (!is_finite(rest_positions_[n])) return bad_input(fmt::format("node {}: its position is not finite", n + 1));
  for (std::size_t e = 0; e < elements_.size(); ++e)
    if (alive_[e]) KERF_TRY(check_element(HexId(e), elements_[e]));
  return {};
}

std::vector<double> MechanicsModel::given_matrices() const {
  std::vector<double> out;
  for (std::size_t slot = 0; slot < own_element_.size(); ++slot) {
    if (own_element_[slot] < 0 || own_material_[slot].material >= 0) continue;
    const double* in = own_block(static_cast<std::int32_t>(slot / kLanes)) + slot % kLanes;
    for (std::size_t i = 0; i < kPacked; ++i) out.push_back(in[kLanes * i]);
  }
  return out;
}

Status MechanicsModel::adopt_parts(std::span<const double> given_matrices) {
  const auto unfit = [](const char* what) {
    return bad_input(fmt::format("the parts of a mechanical model do not fit together: {}", what));
  };
  const auto is_below = [](std::int32_t i, std::size_t n) { return i >= 0 && static_cast<std::size_t>(i) < n; };
  const std::size_t nodes = node_count(), elements = elements_.size(), slots = own_element_.size();
  if (node_uses_.size() != nodes || grid_.size() != nodes || fixed_.size() != nodes || prescribed_.size() != nodes ||
      loads_.size() != nodes)
    return unfit("nodes");
  if (alive_.size() != elements || element_masses_.size() != elements || own_slot_.size() != elements)
    return unfit("elements");
  if (cells_.empty() || own_empty_.size() != cells_.size() || material_cell_.size() != materials_.size())
    return unfit("cells");
  for (const ElementCell& cell : cells_) KERF_TRY(check_cell(cell));
  for (const Material& material : materials_) KERF_TRY(kerf::validate(material));
  for (const std::int32_t cell : material_cell_)
    if (!is_below(cell, cells_.size())) return unfit("materials");
  std::vector<std::int32_t> uses(nodes, 0);
  for (std::size_t e = 0; e < elements; ++e) {
    if (own_slot_[e] >= 0 && (!is_below(own_slot_[e], slots) ||
                              own_element_[static_cast<std::size_t>(own_slot_[e])] != static_cast<std::int32_t>(e)))
      return unfit("cells of their own");
    if (!alive_[e]) continue;
    if (!is_below(elements_[e].material, materials_.size())) return unfit("materials of elements");
    for (const NodeId n : elements_[e].nodes)
      if (!is_below(n.value, nodes)) return unfit("nodes of elements");
      else ++uses[n.index()];
  }
  if (uses != node_uses_) return unfit("uses of nodes");
  if (slots % kLanes != 0 || own_cell_.size() != slots / kLanes || own_material_.size() != slots)
    return unfit("cells of their own");
  std::size_t given = 0, empty = 0;
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const std::int32_t e = own_element_[slot];
    if (!is_below(own_cell_[slot / kLanes], cells_.size()) ||
        (e >= 0 &&
         (!is_below(e, elements) || own_slot_[static_cast<std::size_t>(e)] != static_cast<std::int32_t>(slot))))
      return unfit("cells of their own");
    const OwnMaterial& own = own_material_[slot];
    if (own.material >= 0 &&
        (!is_below(own.material, materials_.size()) || cell_of(own.material) != own_cell_[slot / kLanes]))
      return unfit("materials of cells of their own");
    if (e < 0) ++empty;
    else if (own.material < 0) ++given;
  }
  std::vector<std::uint8_t> listed(slots, 0);
  for (std::size_t cell = 0; cell < own_empty_.size(); ++cell)
    for (const std::int32_t slot : own_empty_[cell]) {
      if (!is_below(slot, slots) || own_element_[static_cast<std::size_t>(slot)] >= 0 ||
          own_cell_[static_cast<std::size_t>(slot) / kLanes] != static_cast<std::int32_t>(cell) ||
          listed[static_cast<std::size_t>(slot)]++ != 0)
        return unfit("cells of their own that are empty");
      --empty;
    }
  if (empty != 0 || given_matrices.size() != given * kPacked) return unfit("cells of their own that are empty");
  if (spring_caps_.size() != springs_.size() || free_springs_ > springs_.size()) return unfit("springs");
  for (const RowSpring& spring : springs_)
    for (const NodeId n : spring.nodes)
      if (n.valid() && n.index() >= nodes) return unfit("nodes of springs");
  for (const BondLaw& law : bond_laws_) KERF_TRY(kerf::validate(law));
  for (const BondPoint& point : bond_points_)
    if (!is_below(point.law, bond_laws_.size()) ||
        std::any_of(point.element.begin(), point.element.end(),
                    [&](HexId e) { return e.valid() && e.index() >= elements; }))
      return unfit("bonds");

  full_matrix_.clear();
  for (std::size_t i = 0; i < materials_.size(); ++i)
    full_matrix_.push_back(element_matrix(formulation_, materials_[i], cell(static_cast<std::int32_t>(i)).size));
  own_matrices_.assign(slots / kLanes * kOwnBlock, 0.0);
  for (std::size_t slot = 0; slot < slots; ++slot) {
    if (own_material_[slot].material >= 0) {
      if (own_element_[slot] < 0)
        own_material_[slot] = {};  // nobody has it: it would cost more to work out than to forget
      else if (!own_material_[slot].pending)
        store_matrix(static_cast<std::int32_t>(slot), pending_matrix(static_cast<std::int32_t>(slot)));
    } else if (own_element_[slot] >= 0) {
      double* out = own_matrices_.data() + kOwnBlock * (slot / kLanes) + slot % kLanes;
      for (std::size_t i = 0; i < kPacked; ++i) out[kLanes * i] = given_matrices[i];
      given_matrices = given_matrices.subspan(kPacked);
    }
  }
  bond_holds_.clear();
  structure_ = {};
  stale_ = coarse_stale_ = node_matrix_stale_ = crossings_stale_ = true;
  return {};
}

// Cuts and undos leave cells of their own scattered over the pool, one or two to a batch: moves the last of them to empty slots before them where that
// makes fewer batches.
void MechanicsModel::gather_own() {
  std::vector<std::size_t> slots;  // of one kind of cell
  for (std::size_t cell = 0; cell < cells_.size(); ++cell) {
    slots.clear();
    std::size_t live = 0, batches = 0;
    for (std::size_t block = 0; block < own_cell_.size(); ++block) {
      if (own_cell_[block] != static_cast<std::int32_t>(cell)) continue;
      std::size_t here = 0;
      for (std::size_t slot = kLanes * block; slot < kLanes * (block + 1); ++slot) {
        slots.push_back(slot);
        if (own_element_[slot] >= 0) ++here;
      }
      live += here;
      if (here > 0) ++batches;
    }
    if (kLanes * batches < live + kLanes) continue;
    for (std::size_t to = 0, from = slots.size(); to < live; ++to) {
      if (own_element_[slots[to]] >= 0) continue;
      while (own_element_[slots[from - 1]] < 0) --from;
      move_own(slots[from - 1], slots[to]);
    }
    own_empty_[cell].clear();
    for (std::size_t i = slots.size(); i > live; --i)
      own_empty_[cell].push_back(static_cast<std::int32_t>(slots[i - 1]));
  }
}

void MechanicsModel::move_own(std::size_t from, std::size_t to) {
  const auto start = [&](std::size_t slot) {
    return own_matrices_.data() + kOwnBlock * (slot / kLanes) + slot % kLanes;
  };
  const double* in = start(from);
  double* out = start(to);
  for (std::size_t i = 0; i < kPacked; ++i) out[kLanes * i] = in[kLanes * i];
  own_material_[to] = own_material_[from];
  own_element_[to] = std::exchange(own_element_[from], -1);
  own_slot_[static_cast<std::size_t>(own_element_[to])] = static_cast<std::int32_t>(to);
}

void MechanicsModel::refresh_sums() {
  Structure& s = structure_;
  const std::size_t n = node_count();
  s.sum_grain = std::max(kLeastSumGrain, s.full_batches / kSumChunks);
  s.sum_of.resize(s.full_batches);
  s.summed.assign(n, 0);
  s.sums = n;
  // Per node: the chunk that touched it last and the sum that it has there.
  std::vector<std::array<std::int32_t, 2>> last(n, {-1, -1});
  std::vector<std::int32_t> node_of_more;  // per sum behind those of the nodes, -1: of idle lanes
  const auto one_more = [&](std::int32_t node) {
    node_of_more.push_back(node);
    return static_cast<std::int32_t>(s.sums++);
  };
  for (std::size_t b = 0; b < s.full_batches; ++b) {
    const auto chunk = static_cast<std::int32_t>(b / s.sum_grain);
    for (int lane = 0; lane < kLanes; ++lane)
      for (int c = 0; c < 8; ++c) {
        std::int32_t& to = s.sum_of[b][c][lane];
        if (s.batches[b].element[lane] < 0) {
          to = ~one_more(-1);
          continue;
        }
        const std::int32_t node = s.batches[b].node[c][lane];
        auto& [in, sum] = last[static_cast<std::size_t>(node)];
        if (in == chunk) {
          to = sum;
          continue;
        }
        sum = in < 0 ? node : one_more(node);
        in = chunk;
        s.summed[static_cast<std::size_t>(node)] = 1;
        to = ~sum;
      }
  }
  const std::size_t bonds = s.element_slots + 8 * s.springs.size();
  s.more_begin.assign(n + 1, 0);
  const auto for_each_more = [&](auto&& f) {
    for (std::size_t i = 0; i < node_of_more.size(); ++i)
      if (node_of_more[i] >= 0) f(node_of_more[i], static_cast<std::int32_t>(n + i));
    for (std::size_t i = 0; i < n; ++i)
      for (std::int32_t k = s.slot_begin[i]; k < s.slot_begin[i + 1]; ++k) {
        const auto slot = static_cast<std::size_t>(s.slots[k]);
        if (slot >= 32 * s.full_batches &&
            (slot < s.element_slots || slot >= bonds || s.cell_springs.is_row[(slot - s.element_slots) / 8] != 0))
          f(static_cast<std::int32_t>(i), static_cast<std::int32_t>(s.sums + slot));
      }
  };
  for_each_more([&](std::int32_t node, std::int32_t) { ++s.more_begin[node + 1]; });
  for (std::size_t i = 0; i < n; ++i) s.more_begin[i + 1] += s.more_begin[i];
  s.more.resize(static_cast<std::size_t>(s.more_begin[n]));
  for_each_more([&](std::int32_t node, std::int32_t what) { s.more[s.more_begin[node]++] = what; });
  for (std::size_t i = n; i > 0; --i) s.more_begin[i] = s.more_begin[i - 1];
  if (n > 0) s.more_begin[0] = 0;
}

void MechanicsModel::refresh() {
  if (!stale_) return;
  stale_ = false;
  coarse_stale_ = node_matrix_stale_ = true;
  Structure& s = structure_;
  const std::size_t n = node_count();

  gather_own();
  for (std::size_t slot = 0; slot < own_element_.size(); ++slot) {
    if (own_element_[slot] < 0 || !own_material_[slot].pending) continue;
    own_material_[slot].pending = false;
    store_matrix(static_cast<std::int32_t>(slot), pending_matrix(static_cast<std::int32_t>(slot)));
  }

  s.shared.clear();
  for (const ElementMatrix& full : full_matrix_) s.shared.push_back(walsh_hadamard(full));

  s.batches.clear();
  for (std::int32_t material = 0; material < static_cast<std::int32_t>(materials_.size()); ++material) {
    int lane = 0;
    for (std::size_t e = 0; e < elements_.size(); ++e) {
      if (!alive_[e] || own_slot_[e] >= 0 || elements_[e].material != material) continue;
      if (lane == 0) {
        s.batches.emplace_back();
        s.batches.back().material = material;
        s.batches.back().cell = cell_of(material);
      }
      s.batches.back().element[lane] = static_cast<std::int32_t>(e);
      lane = (lane + 1) % kLanes;
    }
  }
  s.full_batches = s.batches.size();
  for (std::size_t slot = 0; slot < own_element_.size(); slot += kLanes) {
    Batch batch;
    batch.own = static_cast<std::int32_t>(slot / kLanes);
    batch.cell = own_cell_[slot / kLanes];
    bool live = false;
    for (int lane = 0; lane < kLanes; ++lane) {
      batch.element[lane] = own_element_[slot + lane];
      live = live || batch.element[lane] >= 0;
    }
    if (live) s.batches.push_back(batch);
  }
  for (Batch& batch : s.batches) {
    std::int32_t model = -1;
    for (std::int32_t e : batch.element)
      if (e >= 0) {
        model = e;
        break;
      }
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::int32_t e = batch.element[lane] >= 0 ? batch.element[lane] : model;
      for (int c = 0; c < 8; ++c) batch.node[c][lane] = elements_[e].nodes[c].value;
    }
  }
  s.element_slots = s.batches.size() * kLanes * 8;

  s.springs.clear();
  for (std::size_t i = 0; i < springs_.size(); ++i)
    if (springs_[i].nodes[0].valid()) s.springs.push_back(static_cast<std::int32_t>(i));

  if (!bond_points_.empty() || !s.bonds.pairs.empty()) {
    s.bonds = bond_structure(*this);
    bond_holds_.assign(s.bonds.pairs.size(), 1);
  }

  // Each node's slots by counting, in the order of the elements' ids: the order of the sums, and so their
  // last bits, must not depend on the history of the pool.
  s.element_slot.assign(elements_.size(), -1);
  for (std::size_t b = 0; b < s.batches.size(); ++b)
    for (int lane = 0; lane < kLanes; ++lane)
      if (s.batches[b].element[lane] >= 0)
        s.element_slot[s.batches[b].element[lane]] = static_cast<std::int32_t>((b * kLanes + lane) * 8);
  s.slot_begin.assign(n + 1, 0);
  const auto for_each_slot = [&](auto&& f) {
    for (std::size_t e = 0; e < elements_.size(); ++e)
      if (alive_[e])
        for (int c = 0; c < 8; ++c) f(elements_[e].nodes[c].value, s.element_slot[e] + c);
    for (std::size_t i = 0; i < s.springs.size(); ++i)
      for (int k = 0; k < 8; ++k) {
        const NodeId node = springs_[s.springs[i]].nodes[k];
        if (node.valid()) f(node.value, static_cast<std::int32_t>(s.element_slots + 8 * i + k));
      }
    const std::size_t bonds = s.element_slots + 8 * s.springs.size();
    for (std::size_t i = 0; i < s.bonds.pairs.size(); ++i)
      for (std::size_t k = 0; k < 16; ++k) f(s.bonds.pairs[i].node[k], static_cast<std::int32_t>(bonds + 16 * i + k));
  };
  for_each_slot([&](std::int32_t node, std::int32_t) { ++s.slot_begin[node + 1]; });
  for (std::size_t i = 0; i < n; ++i) s.slot_begin[i + 1] += s.slot_begin[i];
  s.slots.resize(static_cast<std::size_t>(s.slot_begin[n]));
  for_each_slot([&](std::int32_t node, std::int32_t slot) { s.slots[s.slot_begin[node]++] = slot; });
  for (std::size_t i = n; i > 0; --i) s.slot_begin[i] = s.slot_begin[i - 1];
  if (n > 0) s.slot_begin[0] = 0;

  place_springs_in_cells(*this, s.cell_springs);
  for (std::size_t i = 0; i < s.cell_springs.batches.size(); ++i)
    s.batches[static_cast<std::size_t>(s.cell_springs.batches[i])].sprung = static_cast<std::int32_t>(i);
  refresh_sums();

  s.mass.assign(n, 0);
  s.damping_mass.assign(n, 0);
  for (std::size_t e = 0; e < elements_.size(); ++e) {
    if (!alive_[e]) continue;
    const double a = materials_[elements_[e].material].damping_mass;
    for (int c = 0; c < 8; ++c) {
      const std::size_t node = elements_[e].nodes[c].index();
      s.mass[node] += element_masses_[e][c];
      s.damping_mass[node] += a * element_masses_[e][c];
    }
  }
  s.free.resize(n);
  s.total_mass = 0;
  s.free_nodes = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const bool moves = !fixed_[i] && s.mass[i] > 0;
    s.free[i] = moves ? 1 : 0;
    s.free_nodes += moves ? 1 : 0;
    s.total_mass += s.mass[i];
  }
  s.rigid = rigid_pieces(*this);
}

void MechanicsModel::refresh_coarse() {
  refresh();
  if (!coarse_stale_) return;
  coarse_stale_ = false;
  coarse_ = coarse_structure(*this);
  crossings_stale_ = true;
}

void MechanicsModel::refresh_crossings() {
  refresh_coarse();
  if (!crossings_stale_) return;
  crossings_stale_ = false;
  add_crossings(*this, coarse_);
}

void MechanicsModel::refresh_node_matrix() {
  refresh();
  if (!node_matrix_stale_) return;
  node_matrix_stale_ = false;
  node_matrix_structure(*this, node_matrix_);
}

}  // namespace kerf
