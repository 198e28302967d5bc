#include "kerf/mechanics/contact_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/lanes.h"
#include "kerf/mechanics/contact_law.h"
#include "kerf/mechanics/node_block.h"
#include "kerf/mechanics/step.h"

namespace kerf {
namespace {

using namespace contact_law;
using Quad = StepWorkspace::Quad;

constexpr double kUnitTolerance = 1e-6;  // of a normal's length
constexpr std::size_t kSumQuads = 72, kMatrixQuads = 192;
/// Rows that may press in another way than those that the inverse was made for: an iteration or two more cost less than another factor.
constexpr int kStaleRows = 6;
/// From this pass on the secant's share in rows that slid before and after the last one is so many times as large: they only creep.
constexpr int kSettledPass = 3;
constexpr double kSettledBlend = 0.2;
/// A contact is as stiff as this many times its softer side at most: measured by a side that is a thousand times as stiff, it would throw the other one about.
constexpr double kSofter = 3;
/// What touches is so many times as heavy as the nodes at the contact, or less, when it is asked how hard it will press.
constexpr double kHeavier = 4;
/// A row is so many times as stiff at most because of what it held.
constexpr double kStiffened = 10;

inline void add_to_tool(double (&out)[6], Vec3 arm, Vec3 f, double sign) {
  const Vec3 torque = cross(arm, f);
  for (int a = 0; a < 3; ++a) {
    out[a] += sign * f[a];
    out[3 + a] += sign * torque[a];
  }
}

/// A row that would hold what it held with an overlap of more than options.unseen is stiffer, by how many times more to the power of 3/4: what is pressed for long goes in by little,
/// however long the steps. With the first power nothing would bring rows that share a load back to a share of it.
double stiffening(const ContactSet& set, const Row& row) {
  if (!(set.options.unseen > 0 && row.stiffness > 0)) return 1;
  const double times = row.force / (row.stiffness * set.options.unseen);
  return times > 1 ? std::min(std::sqrt(times * std::sqrt(times)), kStiffened) : 1;
}

/// Block and impulse of a row in its present phase; blend is theta.
void linearise(const ContactSet& set, const ContactRow& in, double h, double blend, Row& row) {
  const Vec3 n = in.normal, vo = in.other_velocity;
  if (in.limit > 0) {
    const double k = row.phase == ContactPhase::kStick ? row.stiffness : 0, hh = h * h;
    const double block[8] = {hh * k * n.x * n.x,
                             hh * k * n.y * n.y,
                             hh * k * n.z * n.z,
                             hh * k * n.x * n.y,
                             hh * k * n.y * n.z,
                             hh * k * n.z * n.x,
                             0,
                             0};
    std::copy(block, block + 8, row.block);
    row.impulse = h * (k > 0 ? -k * (row.gap - h * dot(n, vo)) : in.limit) * n;
    return;
  }
  const double k = row.stiffness, limit = in.friction * row.held;
  double ks = row.phase == ContactPhase::kStick ? friction_stiffness(set, row, limit) : 0, keep = 0;
  Vec3 t;
  if (row.phase == ContactPhase::kSlide) {
    const double length = norm(row.stretch);
    t = row.along;
    ks = length > 0 ? std::min(k, limit / length) : 0;
    keep = 1 - blend;
  }
  const double hh = h * h, kn = k - ks, kt = keep * ks;
  row.block[0] = hh * (ks + kn * n.x * n.x - kt * t.x * t.x);
  row.block[1] = hh * (ks + kn * n.y * n.y - kt * t.y * t.y);
  row.block[2] = hh * (ks + kn * n.z * n.z - kt * t.z * t.z);
  row.block[3] = hh * (kn * n.x * n.y - kt * t.x * t.y);
  row.block[4] = hh * (kn * n.y * n.z - kt * t.y * t.z);
  row.block[5] = hh * (kn * n.z * n.x - kt * t.z * t.x);
  Vec3 d = h * vo - row.slip;
  d -= dot(d, n) * n;
  d -= keep * dot(d, t) * t;
  row.impulse = h * ((-k * (row.gap - h * dot(n, vo))) * n + ks * d - (keep * limit) * t);
}

/// How fast overlap that no force explains is pushed out.
double push_speed(const ContactRow& row, const ContactOptions& options) {
  return row.push_speed > 0 ? std::min(row.push_speed, options.push_speed) : options.push_speed;
}

/// N that a row will press with, where the gap is what it would be without more than `known` N: k times the overlap would stop the nodes many times
/// over. Bodies are heavier than the nodes that touch, but by less than that.
double likely_force(const Row& row, double known, double gap) {
  const double overlap = std::max(0.0, -gap);
  return std::min(row.stiffness * overlap, known + kHeavier * row.inertia * overlap);
}

/// Of a row that gives way: kSlide where it does.
ContactPhase phase_of_limited(const ContactRow& in, const Row& row, double gap) {
  if (!(gap < 0)) return ContactPhase::kOpen;
  return -row.stiffness * gap > in.limit ? ContactPhase::kSlide : ContactPhase::kStick;
}

/// The same after a pass: from open to sliding and back only by way of the spring. In a body that gives way by more than the spring is long, the limit pushes the row open,
/// and open it is beyond its limit: taken by its gap alone it would change with every pass, and none of them would be the solution.
ContactPhase next_of_limited(const ContactRow& in, const Row& row, double gap) {
  const ContactPhase next = phase_of_limited(in, row, gap);
  return next != row.phase && row.phase != ContactPhase::kStick ? ContactPhase::kStick : next;
}

/// Stick or slide from a stretch of the friction spring and a normal force.
ContactPhase phase_of(const ContactSet& set, double friction, const Row& row) {
  const bool reversed = row.phase == ContactPhase::kSlide && dot(row.stretch, row.along) < 0;
  return norm(row.stretch) <= longest_stretch(set, row, friction * row.held) || reversed ? ContactPhase::kStick
                                                                                         : ContactPhase::kSlide;
}

void set_sliding_direction(Row& row) {
  row.along = row.phase == ContactPhase::kSlide ? normalized(row.stretch) : Vec3{};
}

void sum_rows_of_cells(const MechanicsModel& model, StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  c.cells.clear();
  c.single.clear();
  c.cell_of.resize(model.element_count(), -1);
  for (const std::int32_t r : c.pressing) {
    const ContactRow& row = set.rows[r];
    if (!row.cell.valid() || row.rigid >= 0) continue;
    std::int32_t& place = c.cell_of[row.cell.index()];
    if (place < 0) {
      place = static_cast<std::int32_t>(c.cells.size());
      c.cells.push_back({row.cell.value, 0});
    }
    ++c.cells[place].rows;
  }
  std::size_t kept = 0;
  for (const ContactWork::Cell& cell : c.cells) {
    c.cell_of[cell.element] = cell.rows >= kSummedRows ? static_cast<std::int32_t>(kept) : -1;
    if (cell.rows >= kSummedRows) c.cells[kept++] = cell;
  }
  c.cells.resize(kept);
  c.sums.assign(kSumQuads * kept, {});
  c.matrices.resize(kMatrixQuads * kept);
  for (const std::int32_t r : c.pressing) {
    const ContactRow& row = set.rows[r];
    const std::int32_t place = row.cell.valid() && row.rigid < 0 ? c.cell_of[row.cell.index()] : -1;
    if (place < 0) {
      c.single.push_back(r);
      continue;
    }
    const Lanes low = load_lanes(c.rows[r].block), high = load_lanes(c.rows[r].block + 4);
    double* out = c.sums[kSumQuads * static_cast<std::size_t>(place)].v;
    const ContactEntry* e = set.entries.data() + row.first;
    for (int i = 0; i < 8; ++i)
      for (int j = i; j < 8; ++j, out += 8) {
        const double ww = e[i].weight * e[j].weight;
        store_lanes(out, load_lanes(out) + ww * low);
        store_lanes(out + 4, load_lanes(out + 4) + ww * high);
      }
  }
  for (std::size_t place = 0; place < kept; ++place) {
    c.cell_of[c.cells[place].element] = -1;
    const double* in = c.sums[kSumQuads * place].v;
    ContactWork::Quad* m = c.matrices.data() + kMatrixQuads * place;
    const auto write = [m](int i, int j, const double* b) {  // block (i, j) of symmetric blocks
      store_lanes(m[(3 * j + 0) * 8 + i].v, Lanes{b[0], b[3], b[5], 0});
      store_lanes(m[(3 * j + 1) * 8 + i].v, Lanes{b[3], b[1], b[4], 0});
      store_lanes(m[(3 * j + 2) * 8 + i].v, Lanes{b[5], b[4], b[2], 0});
    };
    for (int i = 0; i < 8; ++i)
      for (int j = i; j < 8; ++j, in += 8) {
        write(i, j, in);
        if (i != j) write(j, i, in);
      }
  }
}

/// Rows that press in another way than those that the inverse was made for.
int changed_rows(const ContactWork& c) {
  int changed = 0;
  for (std::size_t r = 0; r < c.rows.size(); ++r)
    changed += static_cast<std::uint8_t>(c.rows[r].phase) != c.inverse.phases[r] ? 1 : 0;
  return changed;
}

/// First level of the preconditioner of what contacts touch now, and of what they touched in the pass before. Rows that slide a little farther
/// keep the one that they have.
void refresh_diagonals(const MechanicsModel& model, bool coupled, StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  const std::vector<double>& free = model.structure().free;
  if (c.pass > 1 && c.inverse.used && changed_rows(c) <= kStaleRows) return;
  c.inverse.used = coupled && choose_inverse_rows(model, w);
  c.inverse.phases.resize(c.rows.size());
  for (std::size_t r = 0; r < c.rows.size(); ++r) c.inverse.phases[r] = static_cast<std::uint8_t>(c.rows[r].phase);
  for (std::size_t i = 0; i < c.nodes.size(); ++i) c.node_block[2 * i] = c.node_block[2 * i + 1] = {};
  for (const std::int32_t r : c.pressing) {
    const ContactRow& row = set.rows[r];
    for (std::int32_t k = row.first; k < row.first + row.count; ++k) {
      const std::size_t node = set.entries[k].node.index();
      if (free[node] == 0) continue;
      std::int32_t& slot = c.node_slot[node];
      if (slot < 0) {
        slot = static_cast<std::int32_t>(c.nodes.size());
        c.nodes.push_back(static_cast<std::int32_t>(node));
        c.node_block.resize(2 * c.nodes.size());
        c.node_block[2 * slot] = c.node_block[2 * slot + 1] = {};
      }
      if (c.inverse.used && c.inverse.has[r] != 0) continue;
      const double weight = set.entries[k].weight;
      double* out = c.node_block[2 * slot].v;
      store_lanes(out, load_lanes(out) + weight * weight * load_lanes(c.rows[r].block));
      store_lanes(out + 4, load_lanes(out + 4) + weight * weight * load_lanes(c.rows[r].block + 4));
    }
  }
  for (std::size_t i = 0; i < c.nodes.size(); ++i) {
    const auto node = static_cast<std::size_t>(c.nodes[i]);
    const Lanes first = load_lanes(w.diagonal[2 * node].v) + load_lanes(c.node_block[2 * i].v);
    const Lanes second = load_lanes(w.diagonal[2 * node + 1].v) + load_lanes(c.node_block[2 * i + 1].v);
    if (c.inverse.used) store_framed_inverse(c.inverse, first, second, w.inverse_diagonal[3 * node].v);
    else store_inverse(first, second, w.inverse_diagonal[3 * node].v);
  }
  if (c.inverse.used) factor_contact_inverse(w);
}

/// The tools' 6 x 6 blocks: their own inertia and coupling, and J' P J of what presses on them.
void refresh_tool_blocks(StepWorkspace& w) {
  ContactWork& c = w.contact;
  for (ToolWork& tool : c.tools) {
    tool.touched = false;
    std::fill(tool.block, tool.block + kBlockDoubles, 0.0);
    for (int a = 0; a < 3; ++a) {
      tool.block[9 * a] = tool.mass;
      tool.block[9 * (3 + a)] = tool.inertia;
    }
  }
  for (const std::int32_t r : c.pressing) {
    const ContactRow& row = c.set->rows[r];
    if (row.rigid < 0) continue;
    double* block = c.tools[row.rigid].block;
    c.tools[row.rigid].touched = true;
    for (int j = 0; j < 6; ++j) {
      double unit[6] = {};
      unit[j] = 1;
      double column[6] = {};
      add_to_tool(column, row.arm, times(c.rows[r].block, tool_velocity(unit, row.arm)), 1);
      for (int i = 0; i < 6; ++i) block[8 * j + i] += column[i];
    }
  }
  for (ToolWork& tool : c.tools) factor_block(tool.block);
}

}  // namespace

Status check_contacts(const MechanicsModel& model, const MechanicsState& state, const ContactSet& set) {
  const ContactOptions& o = set.options;
  if (!(o.stiffness > 0) || !std::isfinite(o.stiffness))
    return bad_input(fmt::format("contacts: stiffness = {} must be positive", o.stiffness));
  if (o.passes < 1) return bad_input(fmt::format("contacts: passes = {} must be at least 1", o.passes));
  if (!(o.friction_blend >= 0 && o.friction_blend <= 1))
    return bad_input(fmt::format("contacts: friction_blend = {} must lie between 0 and 1", o.friction_blend));
  if (!(o.push_speed > 0))
    return bad_input(fmt::format("contacts: push_speed = {} m/s must be positive", o.push_speed));
  if (set.tools.size() != state.tools.size())
    return bad_input(fmt::format("contacts: {} tools, but the state has {}", set.tools.size(), state.tools.size()));
  for (std::size_t i = 0; i < set.tools.size(); ++i) KERF_TRY(check_tool(set.tools[i], state.tools[i], i));
  for (std::size_t r = 0; r < set.rows.size(); ++r) {
    const ContactRow& row = set.rows[r];
    const auto refuse = [&](const char* what) { return bad_input(fmt::format("contact {}: {}", r + 1, what)); };
    if (r > 0 && !(set.rows[r - 1].key < row.key)) return refuse("its key is not above that of the one before");
    if (row.first < 0 || row.count < 0 ||
        static_cast<std::size_t>(row.first) + static_cast<std::size_t>(row.count) > set.entries.size())
      return refuse("its entries do not exist");
    if (row.rigid >= static_cast<std::int32_t>(set.tools.size())) return refuse("its tool does not exist");
    if (!(std::abs(dot(row.normal, row.normal) - 1) < kUnitTolerance)) return refuse("its normal is not a unit vector");
    if (!std::isfinite(row.gap)) return refuse("its gap is not finite");
    if (!(row.friction >= 0) || !std::isfinite(row.friction)) return refuse("its friction must not be negative");
    if (!(row.push_speed >= 0)) return refuse("its push speed must not be negative");
    if (!(row.stiffness >= 0) || !std::isfinite(row.stiffness)) return refuse("its stiffness must not be negative");
    if (!(row.limit >= 0) || (row.limit > 0) != (row.stiffness > 0))
      return refuse("its limit must not be negative, and stiffness and limit go together");
    if (!is_finite(row.other_velocity) || !is_finite(row.arm)) return refuse("a velocity or an arm is not finite");
    for (std::int32_t k = row.first; k < row.first + row.count; ++k) {
      if (!set.entries[k].node.valid() || set.entries[k].node.index() >= model.node_count())
        return refuse("it names a node that does not exist");
      if (!std::isfinite(set.entries[k].weight)) return refuse("a weight is not finite");
    }
    if (row.cell.valid()) {
      if (!model.has_element(row.cell) || row.count != 8)
        return refuse("its cell does not exist, or its entries are not the corners");
      for (int k = 0; k < 8; ++k)
        if (set.entries[row.first + k].node != model.element(row.cell).nodes[k])
          return refuse("its entries are not the corners of its cell");
    }
  }
  return {};
}

void prepare_contacts(const MechanicsModel& model, const MechanicsState& state, const ContactSet& set, Vec3 gravity,
                      double h, StepWorkspace& w) {
  ContactWork& c = w.contact;
  c.set = &set;
  c.pass = 0;
  const std::vector<double>& free = model.structure().free;
  c.tools.resize(set.tools.size());
  for (std::size_t i = 0; i < set.tools.size(); ++i) {
    prepare_tool(set.tools[i], state.tools[i], h, c.tools[i]);
    for (int a = 0; a < 3; ++a) {  // the first guess, and the velocities that the phases start from
      c.tools[i].solution[a] = state.tools[i].velocity[a];
      c.tools[i].solution[3 + a] = state.tools[i].spin[a];
    }
  }
  c.rows.assign(set.rows.size(), {});
  c.nodes.clear();
  c.node_slot.assign(model.node_count(), -1);
  c.share.assign(model.node_count(), 0);
  const double reach = norm(gravity) * h * h;
  double asked = 0;
  auto memory = state.contacts.begin();
  for (std::size_t r = 0; r < set.rows.size(); ++r) {
    const ContactRow& in = set.rows[r];
    Row& row = c.rows[r];
    row.gap = std::max(in.gap, -push_speed(in, set.options) * h);
    while (memory != state.contacts.end() && memory->key < in.key) ++memory;
    if (memory != state.contacts.end() && memory->key == in.key) {
      row.force = row.held = memory->force;
      row.slip = memory->slip - dot(memory->slip, in.normal) * in.normal;
    }
    double stiffness = 0, moving = 0, mass = 0, of_side[2] = {}, on_side[2] = {};
    for (std::int32_t k = in.first; k < in.first + in.count; ++k) {
      const std::size_t node = set.entries[k].node.index();
      if (free[node] == 0) continue;
      const double weight = std::abs(set.entries[k].weight);
      const double* d = w.diagonal[2 * node].v;
      const double share = weight * (d[0] + d[1] + d[2]);
      const int side = set.entries[k].weight < 0 ? 1 : 0;
      stiffness += share;
      of_side[side] += share;
      on_side[side] += weight;
      mass += weight * model.structure().mass[node];
      moving += weight;
      row.weights += weight * weight;
    }
    if (moving > 0) stiffness /= 3 * moving, mass /= moving;
    for (int side = 0; side < 2; ++side)
      if (on_side[side] > 0) stiffness = std::min(stiffness, kSofter * of_side[side] / (3 * on_side[side]));
    if (in.rigid >= 0) {
      row.weights += 1;
      if (!(moving > 0)) stiffness = mass = c.tools[in.rigid].mass;
    }
    row.stiffness = stiffness / (h * h);
    row.inertia = mass / (h * h);
    row.motion = relative(set, in, w.velocity, c.tools, &ToolWork::solution);
    const Vec3 u = row.motion - in.other_velocity;
    if (in.limit > 0) {
      row.stiffness = in.stiffness;
      row.gap = in.gap;
    }
    const double ahead = row.gap + h * dot(in.normal, u);
    if (in.limit > 0) {
      row.phase = phase_of_limited(in, row, ahead);
      row.force = limited_force(in, row, ahead);
      asked += row.weights * (h * row.force) * (h * row.force);
      continue;
    }
    row.stretch = row.slip + h * (u - dot(u, in.normal) * in.normal);
    row.phase = ahead < 0 ? phase_of(set, in.friction, row) : ContactPhase::kOpen;
    if (ahead < reach || row.force > 0)
      for (std::int32_t k = in.first; k < in.first + in.count; ++k)
        c.share[set.entries[k].node.index()] += std::abs(set.entries[k].weight);
  }
  for (std::size_t r = 0; r < set.rows.size(); ++r) {
    const ContactRow& in = set.rows[r];
    Row& row = c.rows[r];
    if (in.limit > 0) continue;
    double sharing = 0;
    for (std::int32_t k = in.first; k < in.first + in.count; ++k)
      sharing += std::abs(set.entries[k].weight) * c.share[set.entries[k].node.index()];
    row.inertia /= std::max(1.0, sharing);
    row.stiffness *= set.options.stiffness / std::max(1.0, sharing);
    row.stiffness *= stiffening(set, row);
    if (row.phase != ContactPhase::kOpen) row.phase = phase_of(set, in.friction, row);
    set_sliding_direction(row);
    // What the force of the last step holds is no overlap to get rid of, however far it goes beyond what may be pushed out in a step.
    if (in.gap < 0 && row.stiffness > 0)
      row.gap = std::max(in.gap, -row.force / row.stiffness - push_speed(in, set.options) * h);
    if (row.phase == ContactPhase::kOpen) continue;
    const double impulse =
        h * likely_force(row, row.force, row.gap + h * dot(in.normal, row.motion - in.other_velocity));
    asked += row.weights * impulse * impulse;
  }
  c.asked = std::sqrt(asked);
}

void assemble_contacts(const MechanicsModel& model, double h, bool last, bool coupled, StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  const RigidPieces& pieces = model.structure().rigid;
  ++c.pass;
  c.pressing.clear();
  for (std::size_t r = 0; r < c.rows.size(); ++r) {
    if (c.rows[r].phase == ContactPhase::kOpen || !(c.rows[r].stiffness > 0)) continue;
    linearise(set, set.rows[r], h,
              last ? 1.0 : (c.rows[r].slid && c.pass >= kSettledPass ? kSettledBlend : 1) * set.options.friction_blend,
              c.rows[r]);
    c.pressing.push_back(static_cast<std::int32_t>(r));
  }
  c.touched_free.assign(pieces.free.size(), 0);
  c.any_free_touched = false;
  if (!pieces.free.empty())
    for (const std::int32_t r : c.pressing)
      for (std::int32_t k = set.rows[r].first; k < set.rows[r].first + set.rows[r].count; ++k) {
        const std::int32_t piece = pieces.piece[set.entries[k].node.index()];
        if (piece < 0 || pieces.free_index[piece] < 0) continue;
        c.touched_free[pieces.free_index[piece]] = 1;
        c.any_free_touched = true;
      }
  sum_rows_of_cells(model, w);
  refresh_diagonals(model, coupled, w);
  refresh_tool_blocks(w);
}

double multiply_contacts(const MechanicsModel& model, SystemVector which, StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  const std::vector<Quad>& p = which == SystemVector::kSearch ? w.search : w.solution;
  const ToolVector part = which == SystemVector::kSearch ? &ToolWork::search : &ToolWork::solution;
  double sum = 0;
  for (ToolWork& tool : c.tools)
    for (int a = 0; a < 6; ++a) {
      const double x = (tool.*part)[a];
      tool.product[a] = (a < 3 ? tool.mass : tool.inertia) * x;
      sum += x * tool.product[a];
    }
  Lanes work = all_lanes(0);
  for (const std::int32_t r : c.single) {
    const ContactRow& row = set.rows[r];
    Lanes at = sum_of_nodes(set, row, p);
    if (row.rigid >= 0) at -= lanes_of(tool_velocity(c.tools[row.rigid].*part, row.arm));
    const double* b = c.rows[r].block;
    const Lanes force =
        at[0] * Lanes{b[0], b[3], b[5], 0} + at[1] * Lanes{b[3], b[1], b[4], 0} + at[2] * Lanes{b[5], b[4], b[2], 0};
    for (std::int32_t k = row.first; k < row.first + row.count; ++k) {
      double* out = w.product[set.entries[k].node.index()].v;
      store_lanes(out, load_lanes(out) + set.entries[k].weight * force);
    }
    if (row.rigid >= 0) add_to_tool(c.tools[row.rigid].product, row.arm, vec_of(force), -1);
    work += at * force;
  }
  for (std::size_t place = 0; place < c.cells.size(); ++place) {
    const std::array<NodeId, 8>& nodes = model.element(HexId(c.cells[place].element)).nodes;
    const ContactWork::Quad* m = c.matrices.data() + kMatrixQuads * place;
    Lanes y[8];
    for (Lanes& v : y) v = all_lanes(0);
    for (int j = 0; j < 8; ++j) {
      const double* x = p[nodes[j].index()].v;
      for (int a = 0; a < 3; ++a, m += 8) {
        const Lanes xa = all_lanes(x[a]);
        for (int i = 0; i < 8; ++i) y[i] += xa * load_lanes(m[i].v);
      }
    }
    for (int i = 0; i < 8; ++i) {
      double* out = w.product[nodes[i].index()].v;
      store_lanes(out, load_lanes(out) + y[i]);
      work += load_lanes(p[nodes[i].index()].v) * y[i];
    }
  }
  return sum + ((work[0] + work[1]) + work[2]);
}

void add_contact_impulses(StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  for (ToolWork& tool : c.tools)
    for (int a = 0; a < 6; ++a) tool.residual[a] += tool.right[a];
  for (const std::int32_t r : c.pressing) {
    const ContactRow& row = set.rows[r];
    const Lanes impulse = lanes_of(c.rows[r].impulse);
    for (std::int32_t k = row.first; k < row.first + row.count; ++k) {
      double* out = w.residual[set.entries[k].node.index()].v;
      store_lanes(out, load_lanes(out) + set.entries[k].weight * impulse);
    }
    if (row.rigid >= 0) add_to_tool(c.tools[row.rigid].residual, row.arm, c.rows[r].impulse, -1);
  }
}

void add_impulse_changes(StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  for (std::size_t r = 0; r < c.rows.size(); ++r) {
    const ContactRow& row = set.rows[r];
    const Row& now = c.rows[r];
    if (!(now.stiffness > 0)) continue;
    const Vec3 impulse = now.phase == ContactPhase::kOpen ? Vec3{} : now.impulse - times(now.block, now.motion);
    const Vec3 change = impulse - now.used;
    if (change == Vec3{}) continue;
    const Lanes lanes = lanes_of(change);
    for (std::int32_t k = row.first; k < row.first + row.count; ++k) {
      double* out = w.residual[set.entries[k].node.index()].v;
      store_lanes(out, load_lanes(out) + set.entries[k].weight * lanes);
    }
    if (row.rigid >= 0) add_to_tool(c.tools[row.rigid].residual, row.arm, change, -1);
  }
}

double update_contacts(double h, StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  double change = 0, asked = 0;
  bool missed = false;  // light nodes overlap with forces that are nothing to the rest of the body
  for (std::size_t r = 0; r < c.rows.size(); ++r) {
    const ContactRow& in = set.rows[r];
    Row& row = c.rows[r];
    if (!(row.stiffness > 0)) continue;
    const Vec3 jv = relative(set, in, w.solution, c.tools, &ToolWork::solution), u = jv - in.other_velocity;
    row.motion = jv;
    row.used = row.phase != ContactPhase::kOpen ? row.impulse - times(row.block, jv) : Vec3{};
    const double gap = row.gap + h * dot(in.normal, u);
    if (in.limit > 0) {
      row.phase = next_of_limited(in, row, gap);
      row.force = limited_force(in, row, gap);
      const Vec3 d = (h * row.force) * in.normal - row.used;
      change += row.weights * dot(d, d);
      asked += row.weights * dot(d, d);
      continue;
    }
    missed = missed || (row.phase == ContactPhase::kOpen && gap < -set.options.unseen);
    row.force = std::max(0.0, -row.stiffness * gap);
    const ContactPhase before = row.phase;
    row.held = before == ContactPhase::kOpen ? likely_force(row, 0, gap)
                                             : std::min(row.force, std::max(0.0, dot(row.used, in.normal) / h));
    row.stretch = row.slip + h * (u - dot(u, in.normal) * in.normal);
    Vec3 wanted, owed;  // impulses: the second without what a spring that turns round would hold beyond its limit
    if (gap < 0) {
      row.phase = phase_of(set, in.friction, row);
      set_sliding_direction(row);
      row.slid = before == ContactPhase::kSlide && row.phase == ContactPhase::kSlide;
      const double limit = in.friction * row.held;
      const Vec3 spring =
          row.phase == ContactPhase::kStick ? friction_stiffness(set, row, limit) * row.stretch : limit * row.along;
      wanted = h * (row.force * in.normal - spring);
      owed = norm(spring) > limit ? h * (row.force * in.normal - (limit / norm(spring)) * spring) : wanted;
    } else {
      row.phase = ContactPhase::kOpen;
      row.along = {};
    }
    const Vec3 d = wanted - row.used, e = before == ContactPhase::kOpen ? (h * row.held) * in.normal : owed - row.used;
    change += row.weights * dot(d, d);
    asked += row.weights * dot(e, e);
  }
  c.asked = std::sqrt(asked);
  return missed && set.options.unseen > 0 ? HUGE_VAL : std::sqrt(change);
}

ContactSummary finish_contacts(double h, StepWorkspace& w) {
  ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  ContactSummary out;
  c.results.assign(set.rows.size(), {});
  c.tool_results.assign(set.tools.size(), {});
  for (ToolWork& tool : c.tools) std::fill(tool.contact, tool.contact + 6, 0.0);
  for (const std::int32_t r : c.pressing) {
    const ContactRow& in = set.rows[r];
    const Row& row = c.rows[r];
    // The force that took part in this step, not what the last iterate would ask for.
    const Vec3 impulse = row.impulse - times(row.block, relative(set, in, w.solution, c.tools, &ToolWork::solution));
    if (in.rigid >= 0) add_to_tool(c.tools[in.rigid].contact, in.arm, impulse, -1);
    c.results[r].force = (1 / h) * impulse;
    c.results[r].normal_force = std::max(0.0, dot(c.results[r].force, in.normal));
  }
  for (std::size_t r = 0; r < c.rows.size(); ++r) {
    const ContactRow& in = set.rows[r];
    const Row& row = c.rows[r];
    const Vec3 u = relative(set, in, w.solution, c.tools, &ToolWork::solution) - in.other_velocity;
    c.results[r].end_gap = in.gap + h * dot(in.normal, u);
    c.results[r].sliding = row.phase == ContactPhase::kSlide;
    if (in.limit > 0) continue;
    out.pressing += row.phase != ContactPhase::kOpen ? 1 : 0;
    out.sliding += row.phase == ContactPhase::kSlide ? 1 : 0;
    out.deepest = std::max(out.deepest, -c.results[r].end_gap);
  }
  for (std::size_t i = 0; i < c.tools.size(); ++i) forces_on_tool(set.tools[i], c.tools[i], h, c.tool_results[i]);
  return out;
}

void store_contacts(double h, const StepWorkspace& w, MechanicsState& state) {
  const ContactWork& c = w.contact;
  const ContactSet& set = *c.set;
  state.contacts.clear();
  for (std::size_t r = 0; r < c.rows.size(); ++r) {
    const Row& row = c.rows[r];
    if (row.phase == ContactPhase::kOpen || !(row.held > 0) || set.rows[r].limit > 0) continue;
    const double longest = longest_stretch(set, row, set.rows[r].friction * row.held), length = norm(row.stretch);
    state.contacts.push_back(
        {set.rows[r].key, row.held, length > longest ? (longest / length) * row.stretch : row.stretch});
  }
  for (std::size_t i = 0; i < c.tools.size(); ++i) state.tools[i] = moved_tool(state.tools[i], c.tools[i], h);
}

}  // namespace kerf
