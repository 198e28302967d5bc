#include "kerf/session/body_mechanics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kerf/embedding/embedding.h"

namespace kerf {
namespace {

/// Density is that of the material; absorbed neighbours weigh on their host with it.
MechanicsElement element_of(const HexMesh& hex, const BodyMaterials& materials, HexId id) {
  MechanicsElement e;
  e.nodes = hex.nodes[id];
  const LatticeIndex c = hex.cell[id];
  e.material = materials.at(hex.frame_at(c).to_world({c[0] + 0.5, c[1] + 0.5, c[2] + 0.5}), hex.material[id].body);
  return e;
}

/// The copies that `host` has absorbed, ascending: what is made of them must not hang on the order of the lists.
std::vector<HexId> guests_of(const HexMesh& hex, HexId host) {
  std::vector<HexId> guests;
  for (std::size_t i = 0; i <= guests.size(); ++i) {
    const HexId of = i == 0 ? host : guests[i - 1];
    for (HexId g = hex.first_guest[of]; g.valid(); g = hex.next_guest[g]) guests.push_back(g);
  }
  std::sort(guests.begin(), guests.end());
  return guests;
}

/// From natural coordinates of a copy's cell to those of its host's.
Vec3 shift_of(const HexMesh& hex, HexId id, HexId host) {
  const LatticeIndex at = hex.cell[id], from = hex.cell[host];
  return {2.0 * (at[0] - from[0]), 2.0 * (at[1] - from[1]), 2.0 * (at[2] - from[2])};
}

/// The material of a copy of its own, in natural coordinates of a copy `host`, whose map reaches on beyond its cell.
void add_points(const HexMesh& hex, HexId id, HexId host, std::vector<MaterialPoint>& points) {
  const HexMaterial& m = hex.material[id];
  const Vec3 cell = hex.frame_of(id).cell;
  if (m.full) {
    for (MaterialPoint p : full_cell_points(cell)) {
      p.volume *= m.volume / (cell.x * cell.y * cell.z);
      points.push_back(p);
    }
    return;
  }
  const std::array<double, 27>& weights = hex.weights[id];
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  if (!(sum > 0)) return;
  std::array<double, 27> volumes;
  for (std::size_t i = 0; i < 27; ++i) volumes[i] = m.volume / sum * weights[i];
  const Vec3 shift = shift_of(hex, id, host);
  for (MaterialPoint p : material_points_27(volumes)) {
    p.xi += shift;
    points.push_back(p);
  }
}

/// None negative, and all of them together weigh `wanted` kg.
void weigh(double wanted, std::array<double, 8>& masses) {
  const double own = std::accumulate(masses.begin(), masses.end(), 0.0);
  for (double& mass : masses) mass = own > 0 ? std::max(mass, 0.0) : wanted / 8;
  const double kept = std::accumulate(masses.begin(), masses.end(), 0.0);
  for (double& mass : masses) mass *= kept > 0 ? wanted / kept : 0;
}

/// What of a copy's material may deform: all of it, but for what a fixed region holds of a cell that its border crosses.
void add_free_points(const HexMesh& hex, const BodyMaterials& materials, HexId id, HexId host,
                     std::vector<MaterialPoint>& points) {
  const HeldPart part = materials.held.cross ? held_part(hex, materials.held, id) : HeldPart::kNone;
  if (part == HeldPart::kAll) return;
  if (part == HeldPart::kNone) return add_points(hex, id, host, points);
  const Vec3 shift = shift_of(hex, id, host);
  for (MaterialPoint p : held_material(hex, materials.held, id).free) {
    p.xi += shift;
    points.push_back(p);
  }
}

/// A copy that has absorbed others, whose slivers resist as all material does, where they are; or of which a part is held.
Status sync_parts(const HexMesh& hex, const BodyMaterials& materials, HexId id, MechanicsModel& model) {
  const MechanicsElement element = element_of(hex, materials, id);
  const Material& material = model.materials()[static_cast<std::size_t>(element.material)];
  std::vector<MaterialPoint> all, free;
  add_points(hex, id, id, all);
  add_free_points(hex, materials, id, id, free);
  for (const HexId g : guests_of(hex, id)) {
    add_points(hex, g, id, all);
    const std::size_t first = free.size();
    add_free_points(hex, materials, g, id, free);
    const double young = model.materials()[static_cast<std::size_t>(element_of(hex, materials, g).material)].young;
    for (std::size_t i = first; i < free.size(); ++i) free[i].volume *= young / material.young;
  }
  std::array<double, 8> masses = lumped_masses(material.density, all);
  weigh(material.density * hex.material[id].mass_volume, masses);
  return model.set_element(id, element,
                           partly_filled_matrix(model.formulation(), material, hex.frame_of(id).cell, free), masses);
}

/// Does a copy or one that it has absorbed lie in a cell that a border crosses, or is it held beside one?
bool is_partly_held(const HexMesh& hex, const BodyMaterials& materials, HexId id, const MechanicsModel& model) {
  if (!materials.held.cross) return false;
  const auto part = [&](HexId copy) { return held_part(hex, materials.held, copy); };
  const HeldPart own = part(id);
  if (own == HeldPart::kSome) return true;
  if (own == HeldPart::kAll) {
    const auto& nodes = hex.nodes[id];
    return std::any_of(nodes.begin(), nodes.end(), [&](NodeId n) { return !model.is_fixed(n); });
  }
  if (!hex.first_guest[id].valid()) return false;
  const std::vector<HexId> guests = guests_of(hex, id);
  return std::any_of(guests.begin(), guests.end(), [&](HexId g) { return part(g) != HeldPart::kNone; });
}

/// All values first: a joined node may be one of those that another is joined of.
void join_nodes(const LatticeChange& change, const MechanicsModel& model, MechanicsState& state, NodeFade& fade,
                std::vector<NodeMotion>& old) {
  std::vector<NodeMemory::Share> shares;
  for (const LatticeChange::NodeOrigin& o : change.joined_nodes)
    shares.push_back({o.node, o.volume, motion_of(state, fade, o.from)});
  for (std::size_t i = 0, end; i < shares.size(); i = end) {
    for (end = i; end < shares.size() && shares[end].node == shares[i].node;) ++end;
    const std::span<const NodeMemory::Share> all(shares.data() + i, end - i);
    const NodeId node = shares[i].node;
    if (model.is_fixed(node)) continue;
    move_node(node, largest_share(all).from, state, fade, old);
  }
}

}  // namespace

std::vector<HexId> hosts_of(const HexMesh& hex, std::span<const HexId> copies) {
  std::vector<HexId> hosts;
  for (const HexId id : copies)
    if (id.index() < hex.hex_count() && hex.state[id] == HexState::kAbsorbed) hosts.push_back(hex.host[id]);
  std::sort(hosts.begin(), hosts.end());
  hosts.erase(std::unique(hosts.begin(), hosts.end()), hosts.end());
  return hosts;
}

std::int32_t BodyMaterials::at(Vec3 rest, std::int32_t body) const {
  const auto first = static_cast<std::int32_t>(of(body));
  for (std::size_t i = regions.size(); i-- > 0;)
    if (regions[i].contains(rest)) return first + static_cast<std::int32_t>(i) + 1;
  return first;
}

Result<MechanicsModel> make_mechanics(const HexMesh& hex, const SceneMaterial& material, SceneFormulation formulation,
                                      BodyMaterials& materials, std::span<const SceneBodyMaterial> bodies) {
  MechanicsModel model(
      hex.bodies[0].frame.cell, hex.bodies[0].frame.axes,
      formulation == SceneFormulation::kPlain ? ElementFormulation::kPlain : ElementFormulation::kIncompatible);
  materials.regions.clear();
  for (const SceneMaterialRegion& region : material.regions) materials.regions.push_back(region.region);
  const SceneBodyMaterial one;
  for (const LatticeBody& body : std::span(hex.bodies).subspan(1)) model.add_cell({body.frame.cell, body.frame.axes});
  std::int32_t cell = 0;
  for (const SceneBodyMaterial& body : bodies.empty() ? std::span(&one, 1) : bodies) {
    Material base;
    base.young = body.young.value_or(material.young.value_or(kSceneYoung));
    base.poisson = body.poisson.value_or(material.poisson.value_or(kScenePoisson));
    base.density = body.density.value_or(material.density.value_or(kSceneDensity));
    base.prestretch = body.prestretch.value_or(Vec3{1, 1, 1});
    base.damping_mass = material.damping_mass;
    base.damping_stiffness = material.damping_stiffness;
    if (auto added = model.add_material(base, cell); !added) return added.error();
    for (const SceneMaterialRegion& region : material.regions) {
      Material other = base;
      other.young = region.young.value_or(base.young);
      other.poisson = region.poisson.value_or(base.poisson);
      other.density = region.density.value_or(base.density);
      if (auto added = model.add_material(other, cell); !added) return added.error();
    }
    ++cell;
  }
  return model;
}

bool is_held(const HexMesh& hex, const BodyMaterials& materials, const MechanicsModel& model, HexId copy) {
  if (!copy.valid()) return false;
  const auto& nodes = hex.nodes[copy];
  if (std::any_of(nodes.begin(), nodes.end(), [&](NodeId n) { return model.is_fixed(n); })) return true;
  return materials.held.cross && held_part(hex, materials.held, copy) == HeldPart::kSome &&
         !held_material(hex, materials.held, copy).held.empty();
}

Status sync_hex(const HexMesh& hex, const BodyMaterials& materials, HexId id, MechanicsModel& model) {
  if (!hex.alive(id)) {
    if (model.has_element(id)) model.remove_element(id);
    return {};
  }
  const HexMaterial& m = hex.material[id];
  if (hex.first_guest[id].valid() || is_partly_held(hex, materials, id, model))
    return sync_parts(hex, materials, id, model);
  MechanicsElement element = element_of(hex, materials, id);
  const Material& material = model.materials()[static_cast<std::size_t>(element.material)];
  const double cell_volume = hex.frame_of(id).cell_volume();
  if (m.full) {
    element.young_scale = m.volume / cell_volume;
    std::array<double, 8> masses;
    masses.fill(material.density * m.mass_volume / 8);
    return model.set_element(id, element, masses);
  }
  const std::array<double, 27>& weights = hex.weights[id];
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double scale = sum > 0 ? m.volume / sum : 0;
  std::array<double, 27> volumes;
  for (std::size_t i = 0; i < 27; ++i) volumes[i] = scale * weights[i];
  std::array<double, 8> masses = lumped_masses(material.density, volumes);
  weigh(material.density * m.mass_volume, masses);
  return model.set_element(id, element, volumes, masses);
}

Status sync_change(const HexMesh& hex, const BodyMaterials& materials, const LatticeChange& change,
                   MechanicsModel& model, MechanicsState& state, NodeFade& fade, std::vector<NodeMotion>& old) {
  for (std::size_t i = model.node_count(); i < hex.node_count(); ++i) {
    const NodeId node(i);
    const NodeId parent = hex.node_parent[node];
    const LatticeIndex corner = hex.corner[node];
    model.add_node(hex.rest(node), {corner[0], corner[1], corner[2]});
    state.positions.push_back(parent.valid() ? state.positions[parent.index()] : hex.rest(node));
    state.velocities.push_back(parent.valid() ? state.velocities[parent.index()] : Vec3{});
    if (!parent.valid()) continue;
    fade.set(node, fade.offset_of(parent), fade.velocity_of(parent));
    if (model.is_fixed(parent)) model.fix_node(node);
  }
  join_nodes(change, model, state, fade, old);
  for (std::size_t i = state.rotations.size(); i < hex.hex_count(); ++i) {
    const HexId parent = hex.parent[HexId(i)];
    state.rotations.push_back(parent.valid() && parent.index() < i ? state.rotations[parent.index()]
                                                                   : hex.frame_of(HexId(i)).axes);
  }
  for (const HexId id : change.dead_copies) KERF_TRY(sync_hex(hex, materials, id, model));
  for (const HexId id : change.changed_copies) KERF_TRY(sync_hex(hex, materials, id, model));
  for (const HexId id : change.new_copies) KERF_TRY(sync_hex(hex, materials, id, model));
  for (const auto* copies : {&change.changed_copies, &change.new_copies})
    for (const HexId host : hosts_of(hex, *copies)) KERF_TRY(sync_hex(hex, materials, host, model));
  return {};
}

void carry_unused_nodes(const HexMesh& hex, const MechanicsModel& model, MechanicsState& state,
                        std::vector<std::uint8_t>& carried) {
  carried.assign(hex.node_count(), 0);
  for (const HexId id : ids<HexId>(hex.hex_count())) {
    if (hex.state[id] != HexState::kAbsorbed) continue;
    const HexId host = hex.host[id];
    if (!host.valid() || !hex.alive(host)) continue;
    for (const NodeId n : hex.nodes[id]) {
      if (hex.active(n) || carried[n.index()]) continue;
      carried[n.index()] = 1;
      const EmbeddedPoint point{host, hex.local(host, hex.rest(n))};
      state.positions[n.index()] = point_position(hex, point, state.positions);
      state.velocities[n.index()] = point_position(hex, point, state.velocities);
    }
  }
  // Children come after their parents, so a line of them is followed in one pass.
  for (std::size_t i = hex.node_count(); i-- > 0;) {
    const NodeId n(i), parent = hex.node_parent[n];
    if (!parent.valid() || hex.active(parent) || carried[parent.index()] || !(hex.active(n) || carried[i])) continue;
    carried[parent.index()] = 1;
    state.positions[parent.index()] = state.positions[i];
    state.velocities[parent.index()] = state.velocities[i];
  }
  // Twins that a provisional tip has put together again.
  for (const NodeId n : ids<NodeId>(hex.node_count())) {
    const NodeId parent = hex.node_parent[n];
    if (!parent.valid() || hex.active(n) || carried[n.index()] || !(hex.active(parent) || carried[parent.index()]))
      continue;
    carried[n.index()] = 1;
    state.positions[n.index()] = state.positions[parent.index()];
    state.velocities[n.index()] = state.velocities[parent.index()];
  }
  hold_fixed_nodes(model, state);
}

void hold_fixed_nodes(const MechanicsModel& model, MechanicsState& state) {
  for (std::size_t i = 0; i < model.node_count(); ++i)
    if (model.is_fixed(NodeId(i))) state.velocities[i] = model.prescribed_velocities()[i];
}

Status sync_all(const HexMesh& hex, const BodyMaterials& materials, MechanicsModel& model, MechanicsState& state) {
  std::vector<HexId> all;
  for (const HexId id : ids<HexId>(hex.hex_count())) all.push_back(id);
  return sync_copies(hex, materials, all, model, state);
}

Status sync_copies(const HexMesh& hex, const BodyMaterials& materials, std::span<const HexId> changed,
                   MechanicsModel& model, MechanicsState& state) {
  const std::size_t known = std::min(model.element_count(), hex.hex_count());
  for (std::size_t i = hex.hex_count(); i < model.element_count(); ++i) model.remove_element(HexId(i));
  // Elements go before nodes do: none that is left may use a node that is dropped.
  for (const HexId id : changed) {
    if (!model.has_element(id)) continue;
    const auto& nodes = model.element(id).nodes;
    if (std::any_of(nodes.begin(), nodes.end(), [&](NodeId n) { return n.index() >= hex.node_count(); }))
      model.remove_element(id);
  }
  KERF_TRY(model.truncate(std::min(model.node_count(), hex.node_count()), known));
  state.positions.resize(std::min(state.positions.size(), hex.node_count()));
  state.velocities.resize(std::min(state.velocities.size(), hex.node_count()));
  state.rotations.resize(std::min(state.rotations.size(), hex.hex_count()));
  std::vector<NodeMotion> unused;
  NodeFade no_fade;
  KERF_TRY(sync_change(hex, materials, {}, model, state, no_fade, unused));
  for (const HexId id : changed)
    if (id.index() < known) KERF_TRY(sync_hex(hex, materials, id, model));
  for (std::size_t i = known; i < hex.hex_count(); ++i) KERF_TRY(sync_hex(hex, materials, HexId(i), model));
  for (const HexId host : hosts_of(hex, changed)) KERF_TRY(sync_hex(hex, materials, host, model));
  return {};
}

double deformation_rate(const HexMesh& hex, std::span<const Vec3> velocities, double least) {
  if (velocities.empty()) return 0;
  Box3 box;
  for (const Vec3 v : velocities) box.add(v);
  // Along each axis the rate is a mean of differences between two nodes over the edge, and no difference is longer than this.
  if (std::sqrt(3.0) * box.diagonal() < least * shortest_cell_edge(hex)) return 0;
  double most = 0;
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (!hex.alive(h)) continue;
    Vec3 mode[3];
    for (int c = 0; c < 8; ++c) {
      const Vec3 v = velocities[hex.nodes[h][static_cast<std::size_t>(c)].index()];
      for (int a = 0; a < 3; ++a) mode[a] += static_cast<double>(corner_sign(c, a)) * v;
    }
    const Vec3 cell = hex.frame_of(h).cell;
    double square = 0;
    for (int a = 0; a < 3; ++a) square += dot(mode[a], mode[a]) / (16 * cell[a] * cell[a]);
    most = std::max(most, square);
  }
  return std::sqrt(most);
}

void calm_light_nodes(const HexMesh& hex, std::span<const double> masses, double dt, MechanicsState& state) {
  for (std::size_t b = 0; b < hex.bodies.size(); ++b) {
    const auto is_its = [&](std::size_t node) {
      return hex.bodies.size() == 1 || hex.body_at(hex.corner[NodeId(node)]) == static_cast<std::int32_t>(b);
    };
    double total = 0;
    std::size_t nodes = 0;
    for (std::size_t i = 0; i < masses.size(); ++i)
      if (masses[i] > 0 && is_its(i)) {
        total += masses[i];
        ++nodes;
      }
    if (nodes == 0) continue;
    const double light = kLightNode * total / static_cast<double>(nodes);
    double fastest = 0;
    bool any = false;
    for (std::size_t i = 0; i < masses.size(); ++i) {
      if (!is_its(i)) continue;
      if (masses[i] >= light) fastest = std::max(fastest, norm(state.velocities[i]));
      else any |= masses[i] > 0;
    }
    if (!any) continue;
    const Vec3 size = hex.bodies[b].frame.cell;
    const double limit = kLightSpeed * fastest + 0.01 * std::min({size.x, size.y, size.z}) / dt;
    for (std::size_t i = 0; i < masses.size(); ++i) {
      const double speed = norm(state.velocities[i]);
      if (masses[i] <= 0 || masses[i] >= light || speed <= limit || !is_its(i)) continue;
      const Vec3 slower = (limit / speed) * state.velocities[i];
      state.positions[i] -= dt * (state.velocities[i] - slower);
      state.velocities[i] = slower;
    }
  }
}

}  // namespace kerf
