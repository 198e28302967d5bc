// A session: the bodies of a scene, which are simulated, held, pulled and cut. Many sessions can live in one process; a session is used
// by one thread at a time. It never prints; trouble travels as Status and Result.
//
// The order of a step (docs/step.md):
//   commands that are due -> blade (collision mesh, visual mesh, walls; then hexahedra and embeddings) -> mechanics -> time
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/base/rigid_place.h"
#include "kerf/base/vec.h"
#include "kerf/cutting/punch.h"
#include "kerf/cutting/shave.h"
#include "kerf/mechanics/material.h"
#include "kerf/mechanics/rigid_state.h"
#include "kerf/mechanics/step_report.h"
#include "kerf/scene/scene.h"
#include "kerf/session/body.h"
#include "kerf/session/fading_vertex.h"
#include "kerf/session/score.h"

namespace kerf {

/// Time (s) that the stages of a cut took; the names follow the columns of the paper's tables 2 and 4.
struct CutTimes {
  double cut_and_binding = 0;  ///< cut collision and visual mesh, update the binding
  double cut_surface = 0;      ///< add the cut surface
  double embedding = 0;        ///< adapt the hexahedra, update both embeddings
  double total = 0;            ///< all of it, blade sweep included
};

/// What was taken away.
struct RemovalReport {
  int pieces = 0;
  double mass = 0;    ///< kg
  double volume = 0;  ///< m^3 that the visual mesh enclosed at rest (open sheet: 0)
  double share = 0;   ///< that this is of the volume of all bodies when they were uncut
  double seconds = 0;
};

/// What can be undone: one stroke of a blade, from touching down to lifting off, one punch, a piece taken away, or the
/// passes of a shaver.
struct StrokeRecord {
  enum class Kind { kBlade, kPunch, kRemoval, kShave };
  Kind kind = Kind::kBlade;
  double began = 0, ended = 0;  ///< s, simulated
  bool finished = false;
  bool undone = false;
  BodyCounts before, after;
  CutTimes times;         ///< summed over the stroke
  int triangles = 0;      ///< collision triangles walked into, provisional ones included
  int refused = 0;        ///< degenerate steps that were rolled back
  int retried = 0;        ///< steps that were refused where they should have gone, and done a little beside
  RemovalReport removed;  ///< pieces that went: those of a removal, or the dust that the stroke left
};

/// What one punch did.
struct PunchReport {
  bool cut = false;                      ///< false: there was nothing to cut, and there is nothing to undo
  bool surrounds = false;                ///< nothing was cut, and material within reach lies inside the outline
  std::vector<CollisionTriangle> loose;  ///< triangles that came loose and are not dust; rising
  std::vector<CollisionHalfEdge> lips;   ///< new border half-edges on what stays; rising
  CutTimes times;
};

/// What one pass of a shaver did.
struct ShaveReport {
  int edges = 0;                                     ///< collision edges that it met
  int moved_back = 0, stuck = 0;                     ///< collision vertices that moved, and that had no room to
  double removed = 0;                                ///< m^3
  double roughness_before = 0, roughness_after = 0;  ///< metres, of the walls that it met
  double seconds = 0;
};

struct SessionStep {
  StepReport mechanics;  ///< of a step in parts: times and iterations summed, the rest of the last part, deepest of all
  int parts = 1;         ///< that mechanics was divided into, so that nothing tunnels
  double detection = 0;  ///< s, of finding contacts
  bool topology_changed = false;
  double seconds = 0;  ///< the whole step
};

/// What changes of topology touched. Ids may repeat; those at or beyond the present sizes of body() are gone, new ones
/// are the highest. Births, parents and weights are in body() (ancestor, HexMesh::parent, HexMesh::node_parent).
struct SessionChanges {
  bool everything = false;  ///< restore, pieces taken away or put back: compare all
  std::vector<CollisionTriangle> collision_triangles;
  std::vector<VisualTriangle> visual_triangles;
  std::vector<VisualVertex> moved;            ///< visual vertices that hang on another hexahedron now
  std::vector<HexId> hexahedra;               ///< new, dead or changed
  std::vector<RenderVertex> render_vertices;  ///< new ones, and those with another normal
  std::vector<NodeId> nodes;                  ///< new ones, and those that got their first use or lost their last
};

/// What the pieces of the body weigh: the mass that moves in the simulation.
struct PieceMasses {
  std::vector<double> mass;  ///< kg, piece by piece, in no order that means anything
  std::vector<HexId> copy;   ///< of each piece: one of its living hexahedra
  double uncut = 0;          ///< kg: all bodies before anything was cut or taken away, of the present materials
};

/// Complete state of a session at one moment, undo steps included. Opaque; a pointer to hand around.
class SessionSnapshot;

class Session {
 public:
  /// Loads or generates the meshes, binds them (the paper's 4.1), builds the hexahedra and embeds everything. Warnings of the
  /// pre-processing are in notes(). Bad input: a scene with values out of range, a file that can't be read or a mesh that can't be
  /// bound; the message has file, line or element, and the way out. Failed: memory ended while the bodies were made.
  static Result<Session> create(const Scene& scene, const Progress& progress = {});
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  ~Session();

  // --- Time ------------------------------------------------------------------------------------------------------
  /// One time step: the scene's commands that are due, the blade, mechanics. A punch, fix or removal that can't be done with what there is
  /// of the body is skipped, and notes() says so. On an error the step was not taken: time, positions and velocities are as before it;
  /// commands and cuts of this step that had succeeded stay.
  Result<SessionStep> step();
  /// n time steps; stops at the first error. None where n <= 0.
  Status step(int n);
  [[nodiscard]] double time() const;       ///< s
  [[nodiscard]] double time_step() const;  ///< s

  // --- Commands --------------------------------------------------------------------------------------------------
  /// Does a command now (its `at` is not looked at). A blade stroke then runs over the coming steps; a stroke in progress ends first, as
  /// for undo and redo. Errors as of that command in a scene: nothing has changed.
  Status apply(const SceneCommand& command);

  /// What is left of the scene's bonds.
  struct BondState {
    std::size_t points = 0, torn = 0;
    double area = 0;        ///< m^2, of all
    double torn_area = 0;   ///< m^2
    double stored = 0;      ///< J
    double dissipated = 0;  ///< J that tearing has taken; what a blade severs is not in it
  };
  [[nodiscard]] BondState bonds() const;
  /// Damage of each point, 0 to 1, and where they are at rest.
  [[nodiscard]] const std::vector<double>& bond_damage() const;
  [[nodiscard]] std::vector<Vec3> bond_places() const;

  /// A stroke by hand, in the world or in the shape at rest. `through`: the blade cuts every layer that it meets, else the first one from its
  /// base. A stroke in progress ends first.
  Status begin_stroke(SceneFrame frame, bool through);
  /// A pose: base and tip of the edge, metres, in the stroke's frame. The first one places the blade. Each other one cuts at once what the edge
  /// passes on its way from the last pose, through the material as it has moved since. What can't be cut is counted and noted. Bad
  /// input, nothing has changed: no stroke, a shaver's stroke, numbers that are not finite, an edge without length. Where the hexahedra can't
  /// follow, the whole stroke is rolled back and over.
  Status move_blade(Vec3 base, Vec3 tip);
  /// A stroke that has cut nothing leaves nothing to undo. Dust that it leaves is taken away in the same undo step (SceneCut::dust): then all ids change,
  /// as by remove_piece.
  Status end_stroke();
  /// Takes the blade out in the middle of a stroke: it cuts on where its next pose is. Without a stroke of a blade nothing happens.
  void lift_blade();
  /// Rolls the whole stroke back: topology, positions and velocities are as it began. Without a stroke nothing happens.
  Status cancel_stroke();
  [[nodiscard]] bool in_stroke() const;

  /// Presses a punch through the body at once: everything inside its outline comes loose (cutting/punch.h). A stroke in
  /// progress ends first. `roughness`: metres that its cut surface is jagged by at most, seeded by the scene. One undo step; one
  /// that cuts nothing leaves nothing to undo. Bad input and failures: as cut_punch; the body is as before.
  Result<PunchReport> punch(const Punch& punch, SceneFrame frame, double roughness = 0);
  /// Corners (metres) of the outline that apply() presses for this punch: a circle is a polygon, as fine as the body's mesh wants it.
  [[nodiscard]] std::vector<Vec2> outline_of(const ScenePunch& punch) const;

  /// One pass of a shaver (cutting/shave.h): takes `smoothing` (0 to 1) of the bumps off where it touches, and where the cut is
  /// smooth up to `depth` metres of material. All passes until end_stroke() are one undo step; a blade's stroke in progress ends
  /// first. Closed bodies only: an open sheet has no walls. Bad input: numbers that are not finite or out of range.
  Result<ShaveReport> shave(const Shaver& shaver, SceneFrame frame, double smoothing, double depth);
  /// How the operation stands; none in a scene without a lesion.
  [[nodiscard]] std::optional<TrainerScore> score() const;
  /// RMS distance (metres) of all cut surfaces from their smooth shapes.
  [[nodiscard]] double roughness() const;

  /// Takes the piece that this collision triangle belongs to away: collision mesh, visual mesh, hexahedra, and their memory. One undo
  /// step. All ids change; what stays keeps its order (changes say `everything`). Grasps on it let go. A stroke in progress ends first; what goes
  /// as its dust is not taken again. Bad input: no such triangle; the only piece there is. Cost: linear in the body.
  Result<RemovalReport> remove_piece(CollisionTriangle triangle);
  /// Sucks off what is loose: every piece whose collision mesh reaches into the region, but the heaviest piece and those
  /// that supports hold. Nothing there is no error.
  Result<RemovalReport> remove_pieces(const SceneRegion& region, SceneFrame frame);
  /// Do supports hold the piece that this collision triangle belongs to? False when there is no such triangle. Linear in the body.
  [[nodiscard]] bool held_by_supports(CollisionTriangle triangle) const;
  /// Takes away what a grasp holds, and the grasp. Bad input: no such grasp, or it holds the only piece.
  Result<RemovalReport> remove_grasped(const std::string& id);

  /// Takes hold of these collision vertices where they are now; apply() moves and releases the grasp by its id. Bad
  /// input: no vertices, one that does not exist, or an id that is taken.
  Status grasp(const std::string& id, const std::vector<CollisionVertex>& points);
  struct GraspState {
    std::string id;
    std::vector<CollisionVertex> points;  ///< those that exist
    Vec3 held, target;                    ///< metres: centre of the points now, and where it is pulled to
  };
  [[nodiscard]] std::vector<GraspState> grasps();

  /// From the next step on. Bad input: not finite.
  Status set_gravity(Vec3 gravity);  ///< m/s^2
  [[nodiscard]] Vec3 gravity() const;
  /// What the body is made of, from the next step on; regions follow where they had the same value. Bad input: a
  /// material that can't be simulated. Costs as much as the matrices of all partly filled cells.
  /// Pascals, 1, kg/m3. Bad input: a number that [material] of a scene may not have.
  Status set_material(double young, double poisson, double density);
  [[nodiscard]] Material material() const;
  [[nodiscard]] std::int64_t step_count() const;

  /// Undoes or redoes the last stroke, to the bit: topology, and positions and velocities as they were when it began. A stroke in progress
  /// ends first. Bad input: there is none. The oldest strokes are forgotten where they hold more than 256 MiB together.
  Status undo();
  Status redo();
  [[nodiscard]] int undo_depth() const;
  [[nodiscard]] int redo_depth() const;

  /// Time and memory of both: a copy of the body and its undo steps. `restore` takes one of this session, never null: builds with assertions
  /// look, others don't.
  [[nodiscard]] std::shared_ptr<const SessionSnapshot> snapshot() const;
  void restore(const std::shared_ptr<const SessionSnapshot>& snapshot);

  /// The state as bytes, for take_state() of a session of the same scene, in any process with the same instruction set. Undo steps are not in it, nor times
  /// that a clock measured: same scene and commands, same bytes. Bad input: a stroke is open.
  [[nodiscard]] Result<std::string> state_bytes() const;
  /// The same of the state that a snapshot holds.
  [[nodiscard]] static Result<std::string> state_bytes(const SessionSnapshot& snapshot);
  /// Goes on from there, to the bit; there is nothing to undo. Bad input, and nothing has changed: damaged bytes,
  /// a state that validate() does not hold true, or one of another scene or another body.
  Status take_state(std::string_view bytes);

  // References and spans hold until the next call that is not const.
  // --- State -----------------------------------------------------------------------------------------------------
  [[nodiscard]] const Scene& scene() const;
  [[nodiscard]] const Body& body() const;
  [[nodiscard]] BodyCounts counts() const;
  /// Pieces hang together as collision_pieces says. Cost: linear in collision mesh and hexahedra.
  [[nodiscard]] PieceMasses piece_masses() const;
  /// Grows by one with every change of topology, undo and redo included.
  [[nodiscard]] std::uint64_t topology_version() const;
  /// From now on the session notes what changes of topology touch. take_changes() hands over what has come together
  /// since the last call, for whoever keeps copies of the body's arrays.
  void watch_changes(bool on);
  SessionChanges take_changes();
  [[nodiscard]] const std::vector<Vec3>& node_positions() const;   ///< metres, by NodeId
  [[nodiscard]] const std::vector<Vec3>& node_velocities() const;  ///< m/s
  [[nodiscard]] bool is_fixed(NodeId node) const;                  ///< by a support
  /// Does a fixed region hold the material that is here at rest, where nodes may move (held_skin.h)? It stays.
  [[nodiscard]] bool stays_at_rest(Vec3 rest) const;
  /// Where nodes are shown, metres: with offsets that fade after a cut (node_fade.h). Surfaces hang on these.
  void shown_nodes(std::vector<Vec3>& positions) const;
  /// Deformed collision vertices, metres, by CollisionVertex.
  [[nodiscard]] const std::vector<Vec3>& collision_positions();
  /// Deformed visual vertices, metres, by VisualVertex, in double precision (files; drawing uses embedding/).
  [[nodiscard]] std::vector<Vec3> visual_positions() const;
  /// m/s, by vertex. Positions and velocities of the surface are continuous through a cut (surface_fade.h).
  [[nodiscard]] std::vector<Vec3> visual_velocities() const;
  [[nodiscard]] std::vector<Vec3> collision_velocities() const;
  /// Visual vertices that are not just where shown_nodes() put them, by vertex; until the next call that changes the session.
  [[nodiscard]] std::span<const FadingVertex> fading_visual() const;
  /// Visual vertices that supports hold and nodes of their hexahedra do not (held_skin.h), ascending; as long.
  [[nodiscard]] std::span<const VisualVertex> held_visual() const;
  /// The same for drawing: positions and unit normals of the skin by VisualVertex, in float, fast (the paper's 4.2.5). Allocates only
  /// when the arrays grow. Normals are those of the shown hexahedra, without what fades of single vertices.
  void visual_skin(std::vector<Vec3f>& positions, std::vector<Vec3f>& normals);
  /// Force of the supports on the body, N, of the last step: the sum, and that on one node, which is fixed or of a cell that the border of
  /// a fixed region crosses. Zero for others, and from a change of topology to the next step.
  [[nodiscard]] Vec3 support_force() const;
  [[nodiscard]] Vec3 support_force(NodeId node) const;
  /// Force of a grasp on the body, N, of the last step; zero for an unknown id.
  [[nodiscard]] Vec3 grasp_force(const std::string& id) const;
  /// What touched in the last step; empty from a change of topology to the next step.
  struct ContactState {
    Vec3 point;               ///< metres, at the start of the step (of its last part)
    Vec3 normal;              ///< unit, towards the body
    double gap = 0;           ///< metres, at the end of the step; negative: overlap
    Vec3 force;               ///< N, on the body, friction included
    double normal_force = 0;  ///< N
    bool sliding = false;
    std::int32_t obstacle = -1, tool = -1;  ///< number in the scene; both -1: the body itself
  };
  [[nodiscard]] std::vector<ContactState> contacts() const;
  /// Where a tool of the scene is, and what acts on it: N, and N m about its place, world, mean over the last step; zero from a change of
  /// topology to the next step. Force and coupling together are mass times acceleration: at rest one is the other reversed.
  struct ToolState {
    RigidState place;
    RigidPlace pose;                       ///< that it follows
    double jaws = 1;                       ///< 1 open, 0 closed
    Vec3 force, torque;                    ///< of the body: contacts, resistance to its edge, what its jaws hold
    Vec3 coupling_force, coupling_torque;  ///< of the coupling to its pose: what whoever leads it does
  };
  [[nodiscard]] std::vector<ToolState> tools() const;  ///< in the order of the scene
  [[nodiscard]] const std::vector<StrokeRecord>& strokes() const;
  [[nodiscard]] const std::vector<std::string>& notes() const;  ///< each text once

  /// All invariants of docs/invariants.md that can be checked at this moment; the first that does not hold is named.
  [[nodiscard]] Status validate() const;
  /// Hash of everything that the future depends on.
  [[nodiscard]] std::uint64_t hash() const;

 private:
  struct Impl;
  explicit Session(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf
