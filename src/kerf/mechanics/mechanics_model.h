// What a body is made of, for the time step: nodes, box elements, materials, supports, springs and loads.
//
// A plain value: copy it to keep it. A cut changes it a piece at a time (set_element, remove_element,
// resize); what the time step derives from it is rebuilt before the next step, in time proportional to the
// number of elements. Mechanics knows nothing of lattices, cuts or contact: whoever changes the topology says
// what the elements are now.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/mechanics/bonds.h"
#include "kerf/mechanics/cell_springs.h"
#include "kerf/mechanics/coarse_structure.h"
#include "kerf/mechanics/element.h"
#include "kerf/mechanics/element_wht.h"
#include "kerf/mechanics/material.h"
#include "kerf/mechanics/node_matrix.h"
#include "kerf/mechanics/rigid_pieces.h"

namespace kerf {

struct SpringTag;
using SpringId = Id<SpringTag>;

/// Position in the lattice, counted in cells; nodes that a cut has doubled share it.
using GridPoint = std::array<std::int32_t, 3>;

/// The box that an element is at rest. Bodies of one model may have boxes of their own.
struct ElementCell {
  Vec3 size;  ///< m
  Mat3 axes;  ///< columns: the edges' directions in the world, a rotation
};

/// One box element. Corner order as in element.h.
struct MechanicsElement {
  std::array<NodeId, 8> nodes;
  std::int32_t material = 0;  ///< index into the materials; tells the cell too
  double young_scale = 1;     ///< multiplies Young's modulus here (regions); > 0
};

/// A spring between a weighted sum of nodes and a place: f = k (target - sum w x) - c (sum w v -
/// target_velocity). Weights that sum to 1 hold an embedded point (attachment, grasp); weights 1 and -1 tie
/// two nodes together.
struct RowSpring {
  std::array<NodeId, 8> nodes;  ///< unused places are invalid ids
  std::array<double, 8> weights{};
  Vec3 target;           ///< m
  Vec3 target_velocity;  ///< m/s
  double stiffness = 0;  ///< N/m
  double damping = 0;    ///< N s/m
};

/// A spring as it was taken: stiff springs are what hurts convergence, so attachments are capped.
struct SpringReceipt {
  SpringId id;
  double stiffness = 0;  ///< N/m, as used
  bool capped = false;
};

/// Attachments, grasps and glue are capped at this many times E h per point.
inline constexpr double kSpringCap = 10;

/// Where a symmetric matrix of an element keeps row i, column j >= i: its upper triangle by rows, kPacked numbers.
constexpr int packed_place(int i, int j) { return i * 24 - i * (i - 1) / 2 + j - i; }
inline constexpr std::size_t kPacked = 300;

class MechanicsModel {
 public:
  /// Cell 0. Check with validate().
  explicit MechanicsModel(Vec3 cell_size, const Mat3& axes = {},
                          ElementFormulation formulation = ElementFormulation::kIncompatible);

  // --- Materials
  // -------------------------------------------------------------------------------------------------
  /// Index of the new cell.
  std::int32_t add_cell(const ElementCell& cell);
  [[nodiscard]] std::span<const ElementCell> cells() const { return cells_; }
  /// Index of the new material. Elements of it are boxes like this cell.
  Result<std::int32_t> add_material(const Material& material, std::int32_t cell = 0);
  /// Takes effect for full elements at once, and for matrices that are not worked out yet. Other partly filled elements keep theirs until they are set
  /// again.
  Status set_material(std::int32_t index, const Material& material);
  [[nodiscard]] std::span<const Material> materials() const { return materials_; }
  [[nodiscard]] std::int32_t cell_of(std::int32_t material) const {
    return material_cell_[static_cast<std::size_t>(material)];
  }
  /// The box of the elements of a material.
  [[nodiscard]] const ElementCell& cell(std::int32_t material) const {
    return cells_[static_cast<std::size_t>(cell_of(material))];
  }

  // --- Nodes
  // -----------------------------------------------------------------------------------------------------
  NodeId add_node(Vec3 rest_position, GridPoint grid);
  [[nodiscard]] std::size_t node_count() const { return rest_positions_.size(); }
  [[nodiscard]] std::span<const Vec3> rest_positions() const { return rest_positions_; }
  /// Lumped mass in kg; 0 for a node that no element uses (it stays where it is).
  [[nodiscard]] double node_mass(NodeId node);
  [[nodiscard]] double total_mass();
  /// Number of pieces that elements connect.
  [[nodiscard]] std::int32_t piece_count();

  // --- Elements
  // --------------------------------------------------------------------------------------------------
  /// Adds or replaces element `id` as a full cell; ids may leave gaps. O(1).
  Status set_element(HexId id, const MechanicsElement& element);
  /// The same with corner masses (kg, >= 0) that are not those of the full cell (it carries absorbed
  /// neighbours).
  Status set_element(HexId id, const MechanicsElement& element, const std::array<double, 8>& masses);
  /// The same for a partly filled cell: its own matrix by quadrature over the material, its mass from the
  /// same points. About 5 microseconds.
  Status set_element(HexId id, const MechanicsElement& element, std::span<const MaterialPoint> points);
  /// The same with matrix (N/m, symmetric) and corner masses (kg, >= 0) given.
  Status set_element(HexId id, const MechanicsElement& element, const ElementMatrix& matrix,
                     const std::array<double, 8>& masses);
  /// The same with material at material_points_27 (m^3 each) and corner masses (kg, >= 0). The matrix is worked out when it is asked for,
  /// and only if the element's material is another than it was.
  Status set_element(HexId id, const MechanicsElement& element, const std::array<double, 27>& volumes,
                     const std::array<double, 8>& masses);
  void remove_element(HexId id);
  /// Drops the elements and nodes from these counts on (undo); no element left may use a dropped node.
  Status truncate(std::size_t nodes, std::size_t elements);
  [[nodiscard]] std::size_t element_count() const { return elements_.size(); }
  [[nodiscard]] bool has_element(HexId id) const {
    return id.valid() && id.index() < alive_.size() && alive_[id.index()];
  }
  [[nodiscard]] const MechanicsElement& element(HexId id) const { return elements_[id.index()]; }
  [[nodiscard]] bool is_partly_filled(HexId id) const { return own_slot_[id.index()] >= 0; }
  [[nodiscard]] const std::array<double, 8>& element_masses(HexId id) const { return element_masses_[id.index()]; }
  /// Stiffness at rest in the lattice frame, Young's scale included.
  [[nodiscard]] ElementMatrix element_stiffness(HexId id) const;

  // --- Supports, springs, loads
  // ----------------------------------------------------------------------------------
  /// Holds a node, or moves it with a prescribed velocity (m/s).
  void fix_node(NodeId node, Vec3 velocity = {});
  void release_node(NodeId node);
  [[nodiscard]] bool is_fixed(NodeId node) const { return fixed_[node.index()] != 0; }
  /// Ties the point with these weights in an element to a target. Stiffness above the cap is cut down, and
  /// said so.
  Result<SpringReceipt> add_attachment(HexId element, const std::array<double, 8>& weights, Vec3 target,
                                       double stiffness, double damping = 0);
  /// Pulls node b to node a (the glue of a cut's tip). The cap uses the first material.
  Result<SpringReceipt> add_node_pair(NodeId a, NodeId b, double stiffness, double damping = 0);
  /// Any row; taken as it is, without a cap.
  Result<SpringId> add_spring(const RowSpring& spring);
  void set_spring_target(SpringId id, Vec3 target, Vec3 velocity = {});
  /// Changes a live spring's stiffness (N/m, capped) without touching the structure.
  SpringReceipt set_spring_stiffness(SpringId id, double stiffness);
  void remove_spring(SpringId id);
  void clear_springs();
  [[nodiscard]] bool has_spring(SpringId id) const {
    return id.valid() && id.index() < springs_.size() && springs_[id.index()].nodes[0].valid();
  }
  [[nodiscard]] const RowSpring& spring(SpringId id) const { return springs_[id.index()]; }
  [[nodiscard]] std::size_t spring_count() const { return springs_.size(); }
  // --- Bonds
  // -----------------------------------------------------------------------------------------------------
  /// All bonds anew (bonds.h). A state keeps their damage by their number. Bad input: laws that validate() refuses, weights or areas that are not finite.
  Status set_bonds(std::vector<BondLaw> laws, std::vector<BondPoint> points);
  /// Where a point is now. Its elements may be of another number than they were; O(1).
  void set_bond_point(std::size_t number, const BondPoint& point);
  [[nodiscard]] std::span<const BondLaw> bond_laws() const { return bond_laws_; }
  [[nodiscard]] std::span<const BondPoint> bond_points() const { return bond_points_; }
  /// Before a step: pairs of elements all of whose points are torn hold nothing together any more.
  void follow_bonds(std::span<const double> damage);
  /// Does a pair of structure().bonds hold?
  [[nodiscard]] bool bond_holds(std::size_t pair) const { return bond_holds_[pair] != 0; }

  /// Constant force on a node, N; added to what is there.
  void add_load(NodeId node, Vec3 force) { loads_[node.index()] += force; }
  void clear_loads();
  [[nodiscard]] Vec3 load(NodeId node) const { return loads_[node.index()]; }

  [[nodiscard]] ElementFormulation formulation() const { return formulation_; }
  /// Everything that can be wrong with the whole: cell size, axes, an element with repeated nodes.
  [[nodiscard]] Status validate() const;

  // --- For the time step
  // ----------------------------------------------------------------------------------------- Derived data,
  // valid after refresh(). Four elements make a batch; batches of full cells come first, grouped by material;
  // every batch of partly filled cells is four slots of the pool of own matrices. The elements of a batch are boxes of
  // one cell.
  static constexpr int kLanes = 4;
  struct Batch {
    std::array<std::int32_t, kLanes> element{-1, -1, -1, -1};  ///< -1: an idle lane
    std::array<std::array<std::int32_t, kLanes>, 8> node{};    ///< [corner][lane]; idle lanes repeat a live one
    std::int32_t material = -1;                                ///< of a batch of full cells
    std::int32_t own = -1;                                     ///< block in the pool of own matrices
    std::int32_t sprung = -1;                                  ///< place among cell_springs.batches, if it is there
    std::int32_t cell = 0;                                     ///< of cells()
  };
  struct Structure {
    std::vector<Batch> batches;
    std::vector<std::int32_t> element_slot;  ///< per element: 8 (4 batch + lane), -1: no element
    /// Per node its slots: element_slot + corner, by element; then 8 slots per spring, 16 per pair of bonds. The order of the sums of forces.
    std::vector<std::int32_t> slot_begin, slots;
    /// In products full cells add to sums instead, chunk by chunk of `sum_grain` batches. A node's first chunk adds to the sum of the node's own number, any other chunk
    /// to one more sum behind those of the nodes: so chunks need not wait for each other, and the order is fixed. Per batch [corner][lane]: a sum; s where
    /// that is not the first to be added, ~s where it is.
    std::vector<std::array<std::array<std::int32_t, kLanes>, 8>> sum_of;
    std::size_t sum_grain = 1, sums = 0;
    std::vector<std::uint8_t> summed;  ///< per node: is anything added to its own sum?
    CellSprings cell_springs;
    /// Per node: its other sums, then its slots of partly filled cells, of springs that are rows and of bonds, with `sums` added.
    std::vector<std::int32_t> more_begin, more;
    std::vector<double> mass, damping_mass;   ///< per node: kg, kg/s (sum of a m)
    std::vector<double> free;                 ///< per node: 1 moves, 0 is held or unused
    std::vector<std::int32_t> springs;        ///< live springs
    std::vector<WalshHadamardMatrix> shared;  ///< per material
    std::size_t full_batches = 0, element_slots = 0;
    double total_mass = 0;
    std::size_t free_nodes = 0;
    RigidPieces rigid;
    BondStructure bonds;
  };
  /// Rebuilds the derived data if something changed since the last call.
  void refresh();
  [[nodiscard]] const Structure& structure() const { return structure_; }
  /// The same for the solver's coarse space, which not every step needs.
  void refresh_coarse();
  /// And its crossings, which not every coarse space needs.
  void refresh_crossings();
  [[nodiscard]] const CoarseStructure& coarse() const { return coarse_; }
  /// The same for the matrix put together (node_matrix.h).
  void refresh_node_matrix();
  [[nodiscard]] const NodeMatrixStructure& node_matrix() const { return node_matrix_; }
  /// One pool block: [packed_place][4 lanes].
  static constexpr std::size_t kOwnBlock = kPacked * kLanes;
  [[nodiscard]] const double* own_block(std::int32_t block) const {
    return own_matrices_.data() + kOwnBlock * static_cast<std::size_t>(block);
  }
  [[nodiscard]] std::span<const RowSpring> springs() const { return springs_; }
  [[nodiscard]] std::span<const Vec3> loads() const { return loads_; }
  [[nodiscard]] std::span<const Vec3> prescribed_velocities() const { return prescribed_; }
  [[nodiscard]] std::span<const GridPoint> grid() const { return grid_; }

  // --- For whoever writes a model down
  // -----------------------------------------------------------------------------------------
  /// Calls f with everything that a model is, in a fixed order, but given_matrices() and what follows from the rest.
  template <class F>
  void for_each_part(F&& f) {
    f(cells_), f(formulation_), f(materials_), f(material_cell_);
    f(rest_positions_), f(node_uses_), f(grid_), f(fixed_), f(prescribed_), f(loads_);
    f(elements_), f(alive_), f(element_masses_);
    f(own_slot_), f(own_element_), f(own_cell_), f(own_empty_), f(own_material_);
    f(springs_), f(spring_caps_), f(free_springs_);
    f(bond_laws_), f(bond_points_);
  }
  /// N/m: the matrices of partly filled cells that do not follow from their material as it is now, kPacked numbers each.
  [[nodiscard]] std::vector<double> given_matrices() const;
  /// After all parts have been written to: the model is as the other one was, to the bit. Bad input: parts that don't fit together; the model is then of no use.
  Status adopt_parts(std::span<const double> given_matrices);

 private:
  Status check_element(HexId id, const MechanicsElement& element) const;
  void store_element(HexId id, MechanicsElement element, std::array<double, 8> masses);
  void count_uses(HexId id, std::int32_t by);
  void refresh_sums();
  void gather_own();
  void move_own(std::size_t from, std::size_t to);
  [[nodiscard]] ElementMatrix pending_matrix(std::int32_t slot) const;
  void store_matrix(std::int32_t slot, const ElementMatrix& matrix);
  void release_own(HexId id);
  std::int32_t take_own(HexId id, std::int32_t cell);
  [[nodiscard]] std::int32_t next_own(HexId id, std::int32_t cell) const;
  Status check_masses(HexId id, const std::array<double, 8>& masses) const;
  Status store_own(HexId id, const MechanicsElement& element, const ElementMatrix& matrix,
                   const std::array<double, 8>& masses);
  [[nodiscard]] double spring_cap(std::int32_t material, double young_scale) const;

  std::vector<ElementCell> cells_;
  ElementFormulation formulation_;
  std::vector<Material> materials_;
  std::vector<std::int32_t> material_cell_;

  std::vector<Vec3> rest_positions_;
  std::vector<std::int32_t> node_uses_;  // by elements that are there
  std::vector<GridPoint> grid_;
  std::vector<std::uint8_t> fixed_;
  std::vector<Vec3> prescribed_;
  std::vector<Vec3> loads_;

  std::vector<MechanicsElement> elements_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::array<double, 8>> element_masses_;
  std::vector<std::int32_t> own_slot_;                // per element, -1: full
  std::vector<double> own_matrices_;                  // [slot / 4][300][4]
  std::vector<std::int32_t> own_element_;             // per slot, -1: empty
  std::vector<std::int32_t> own_cell_;                // per block of slots
  std::vector<std::vector<std::int32_t>> own_empty_;  // per cell: empty slots, the last is used next
  /// What the matrix in a slot was worked out from; it outlives the element.
  struct OwnMaterial {
    std::array<double, 27> volumes;
    std::int32_t material = -1;  ///< -1: from something else
    bool pending = false;        ///< it still is to be worked out
  };
  std::vector<OwnMaterial> own_material_;   // per slot
  std::vector<ElementMatrix> full_matrix_;  // per material

  std::vector<RowSpring> springs_;
  std::vector<double> spring_caps_;
  std::size_t free_springs_ = 0;  ///< removed ones, whose places new ones take

  std::vector<BondLaw> bond_laws_;
  std::vector<BondPoint> bond_points_;
  std::vector<std::uint8_t> bond_holds_;  // per pair of the structure

  Structure structure_;
  bool stale_ = true;
  CoarseStructure coarse_;
  bool coarse_stale_ = true;
  NodeMatrixStructure node_matrix_;
  bool node_matrix_stale_ = true;
  bool crossings_stale_ = true;
};

}  // namespace kerf
