// The inside of a Session: its state (copied for snapshots) and the memory it works in. Private to session/*.cpp.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kerf/base/journal.h"
#include "kerf/cutting/blade_sweep.h"
#include "kerf/cutting/piece_labels.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/remove_pieces.h"
#include "kerf/cutting/small_piece.h"
#include "kerf/cutting/topology_change.h"
#include "kerf/cutting/validate.h"
#include "kerf/embedding/skin.h"
#include "kerf/lattice/tip_glue.h"
#include "kerf/mechanics/speed_cap.h"
#include "kerf/scene/rigid_motion.h"
#include "kerf/session/body_bonds.h"
#include "kerf/session/body_build.h"
#include "kerf/session/body_mechanics.h"
#include "kerf/session/contact_step.h"
#include "kerf/session/cut_balance.h"
#include "kerf/session/held_skin.h"
#include "kerf/session/node_memory.h"
#include "kerf/session/piece_removal.h"
#include "kerf/session/session.h"
#include "kerf/session/surface_fade.h"

namespace kerf {

/// What the body measures: no cut changes it, shaving and taking pieces away do.
struct BodyAccount {
  ComplexMeasures measures;
  std::vector<LatticeBody> bodies;  ///< volumes that the hexahedra hold
};

/// A stroke in progress.
struct ActiveStroke {
  SceneFrame frame = SceneFrame::kWorld;
  BladeStroke blade;
  JournalMark start;         ///< of the whole body
  SurfaceFade fade;          ///< when it began
  MechanicsState before;     ///< positions, velocities, rotations when it began
  DetectMemory touching;     ///< when it began
  std::int64_t steps = 0;    ///< when it began
  std::vector<Vec3> places;  ///< of collision vertices at the last pose, but at rest, where nothing moves
  BodyAccount account;       ///< when it began
  bool shaving = false;      ///< passes of a shaver instead of poses of a blade
  bool shaved = false;       ///< one of them took something off
  SceneShave shave;          ///< of a command
  CollisionVertex shave_left, shave_until;  ///< what the last pass had no time for: ShaveOptions::first, until
  bool severed = false;                     ///< the blade went through bonds
  bool from_command = false;                ///< poses come from `command`
  bool uncut_noted = false;
  LeaningCut leaning;      ///< the most so far
  UncutPath uncut_end;     ///< at the last pose, what lies between the last edge that was crossed and the blade
  std::int32_t tool = -1;  ///< or from the edge of this tool of the scene
  SceneBlade command;
  std::string place;  ///< of that command in the scene file, for messages
  double command_began = 0;
  std::size_t next_pose = 0;
};

/// What a grasp holds on this side of an undo step and on the other, where the step makes or takes away what is held.
struct GraspSides {
  std::string id;
  std::vector<CollisionVertex> points, other_points;
  std::vector<Vec3> offset, other_offset;
};

/// One stroke that can be undone, or was.
struct UndoStep {
  JournalStep topology;
  SurfaceFade fade;          ///< as `mechanics`
  MechanicsState mechanics;  ///< undo list: as the stroke began. Redo list: as it was when it was undone
  DetectMemory touching;     ///< as `mechanics`; it holds in the same step only
  std::int64_t steps = -1;   ///< at `touching`
  std::vector<GraspSides> grasps;
  BodyAccount account;     ///< as `mechanics`
  std::size_t record = 0;  ///< the stroke's place in SessionState::strokes
  std::optional<PieceRemoval>
      removal;  ///< pieces were taken away, after the stroke if there was one; else `topology` is empty
  [[nodiscard]] std::size_t bytes() const;
};

/// Steps in their order, the latest at the back, and what they hold.
class UndoList {
 public:
  [[nodiscard]] bool empty() const { return steps_.empty(); }
  [[nodiscard]] std::size_t size() const { return steps_.size(); }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  void push(UndoStep step);
  UndoStep pop();
  void forget_oldest();
  void clear();

 private:
  std::deque<std::pair<UndoStep, std::size_t>> steps_;  ///< with the bytes of each
  std::size_t bytes_ = 0;
};

struct SessionState {
  Body body;
  MechanicsModel model{Vec3{1, 1, 1}};
  MechanicsState mechanics;
  SurfaceFade fade;
  BodyMaterials materials;
  ComplexMeasures measures;       ///< what the body should measure at rest
  Vec3 gravity;                   ///< m/s^2; step_options has the same
  double largest_tool_force = 0;  ///< N, in any step
  double time = 0;
  std::int64_t steps = 0;
  std::size_t next_command = 0;
  std::vector<Grasp> grasps;
  std::vector<std::string> lost_grasps;  ///< ids of those whose piece was taken away
  std::vector<ToolMotion> tools;         ///< one per tool of the scene; where the tools are is in `mechanics`
  std::vector<Vec3>
      seen;  ///< where tools found collision vertices last, in scenes with blades; of the first ones or all
  DetectMemory touching;                 ///< what detection remembers of contacts
  std::unique_ptr<ActiveStroke> stroke;  ///< none between strokes
  JournalMark synced;                    ///< hexahedra, embeddings and mechanics match the complex as of here
  UndoList undo, redo;
  std::vector<StrokeRecord> strokes;
  std::uint64_t topology_version = 1;

  SessionState() = default;
  SessionState(const SessionState& other);
  SessionState& operator=(const SessionState& other);
  SessionState(SessionState&&) = default;
  SessionState& operator=(SessionState&&) = default;
};

/// All bodies as they were made.
struct UncutBodies {
  std::size_t roots = 0;       ///< root triangles
  std::vector<double> volume;  ///< m^3, of each body
  std::vector<double> filled;  ///< m^3 of each material, as the hexahedra have it
};

/// What notes() says, and how often there was cause for each kind.
struct SessionNotes {
  std::vector<std::string> texts;
  int uncut = 0, leaning = 0, dust = 0;
  bool slowing = false;
};

class SessionSnapshot {
 public:
  SessionState state;
  UncutBodies uncut;
  SessionNotes said;
};

/// Vertices within `radius` of a point, at least the closest one.
std::vector<CollisionVertex> vertices_near(const std::vector<Vec3>& positions, Vec3 point, double radius);

struct SceneBodies;

struct Session::Impl {
  Scene scene;
  CutOptions cut_options;
  StepOptions step_options;
  SessionNotes said;
  TissueVolume tissue_at_start;  ///< in scenes with a lesion
  int pieces_at_start = 1;
  UncutBodies uncut;
  std::optional<ComplexRenaming> swept;  ///< ids that the dust of the last stroke to end has changed
  SessionState state;
  BodyBonds bonds;

  // memory without state
  RootTriangles root_triangles;
  std::vector<std::uint8_t> stale_roots, stale_copies;  ///< whose bonds are to be found anew
  bool bonds_stale = false, all_bonds_stale = false;
  CutScratch cut_scratch;
  LatticeScratch lattice_scratch;
  LatticeChange lattice_change;
  StepWorkspace workspace;
  StepOptions last_options;  ///< of the step that the workspace holds
  ContactStep contact;
  MechanicsState before_step;                 ///< while a step is taken in parts
  std::array<MechanicsState, 2> before_part;  ///< and a part of it, by how often that may be tried again
  DetectMemory touched_before, touched_part;
  SpeedCapWork speed_cap;
  int parts = 1;  ///< of the last step
  double detection_seconds = 0;
  std::uint64_t forces_of = 0;               ///< topology version of the step that the workspace holds
  std::vector<RigidToolResult> tool_forces;  ///< mean over the last step
  std::vector<RigidToolResult> step_impulses,
      part_impulses;  ///< N s: of the step and of the part of it that are being made
  EmbeddingScratch embedding_scratch;
  std::vector<VisualVertex> moved;
  Skin skin;  ///< derived from the embedding
  bool skin_stale = true;
  TopologyChange topology_change;
  SessionChanges watched;
  bool watching = false;
  std::vector<CollisionTriangle> to_embed;
  std::vector<VisualTriangle> changed_visual;
  NodeMemory remembered;  ///< of the cells of a provisional tip that was rolled back
  std::vector<CellId> remembered_cells;
  CutBalance balance;  ///< of a pose of the blade
  std::vector<HexId> changed_hexes;
  SurfaceMemory surface;  ///< where surface vertices were before a pose of the blade
  double size = 1;        ///< m: of the lattice's box
  std::vector<std::uint8_t> carried;
  std::vector<SpringId> hold_springs;                                        ///< of held material (hold_borders())
  std::vector<std::vector<std::pair<CollisionVertex, double>>> load_places;  ///< of each load: its share of each vertex
  std::uint64_t load_places_at = 0;                                          ///< topology version; 0: not known
  std::vector<Vec3> collision_positions;
  bool collision_positions_valid = false;
  std::vector<CollisionVertex> collision_held;  ///< of topology version collision_held_at; 0: not known
  std::vector<VisualVertex> visual_held;
  std::uint64_t collision_held_at = 0, visual_held_at = 0, contact_held_at = 0;
  std::vector<FadingVertex> visual_beside;  ///< of beside_visual()
  std::vector<Vec3> sweep_positions;        ///< where a blade meets the collision vertices
  FaceBoxes sweep_boxes;                    ///< there
  bool sweep_at_rest = false;               ///< those are positions at rest
  std::size_t sweep_known = 0;              ///< and so many of them still hold
  std::vector<Vec3> shown;                  ///< of shown_nodes()
  std::vector<TipGlue> glue;
  BodyCounts counted;  ///< of topology version counted_at
  std::uint64_t counted_at = 0;

  Status prepare(SceneBodies&& loaded, const Progress& progress);

  // session_notes.cpp
  /// Each note once: after a restore the same may happen again.
  void add_note(std::string note);
  /// Before the first step: what of the scene does nothing, or is broken off.
  void note_idle_parts();
  /// A grasp or a load whose point lies away from the body takes the nearest vertex: `points` of `positions`. `what`: who takes it.
  void note_far_point(const std::string& what, const std::vector<Vec3>& positions,
                      std::span<const CollisionVertex> points, Vec3 point, double radius, SceneFrame frame);
  /// The edge of the stroke's blade goes through material that the stroke does not cut.
  void note_passed(const BladeEdge& edge);
  /// A stroke left a path uncut.
  void note_uncut(const UncutPath& path);
  /// The stroke's blade has leaned, and its lips lie visibly beside it.
  void note_leaning();
  /// The stroke of a command is over and has changed nothing.
  void note_idle_stroke();
  /// Is an end of the edge, at some pose, nearer to the mid-surface than the material is thick?
  bool ends_in_thickness(const ActiveStroke& stroke);
  /// How a body is called in messages.
  [[nodiscard]] std::string name_of_body(std::int32_t body) const;

  // session_stroke.cpp
  Status begin_stroke(SceneFrame frame, bool through);
  Status move_blade(const BladeEdge& edge);
  Status end_stroke();
  void lift_blade();
  Status cancel_stroke();
  /// The oldest steps are forgotten when they hold too much memory.
  void add_undo(UndoStep step);
  Status undo() { return travel(state.undo, state.redo, true); }
  Status redo() { return travel(state.redo, state.undo, false); }
  /// Takes the last step of one list back (or makes it again) and puts it on the other.
  Status travel(UndoList& from, UndoList& to, bool back);
  /// Grasps let go of collision vertices that an undone cut made: their hold moves to what they were split off from.
  void keep_grasps_on(const std::vector<CollisionVertex>& ancestors);
  /// After an undo or redo: grasps hold what they held on this side of the step. `were`: on the other. Changes the sides.
  void change_sides(const std::vector<Grasp>& were, std::vector<GraspSides>& sides);
  [[nodiscard]] std::vector<CollisionVertex> grasp_ancestors() const;
  Status advance_command_stroke(double until);
  /// What is left of a command's stroke, at once: before another command that would break it off within its last step.
  Status finish_command_stroke();
  /// Whatever stroke is in progress ends, and `swept` tells what that renamed.
  Status finish_stroke();
  // session_dust.cpp
  /// Triangles of the loose pieces that the present stroke has cut off and that are to be swept up, flagged; empty: there are none. `report`: what they are.
  std::vector<std::uint8_t> dust_of_stroke(RemovalReport& report);
  [[nodiscard]] bool is_dust(const SmallPiece& piece);
  [[nodiscard]] double share_of_uncut(double volume) const;
  void note_dust(const RemovalReport& dust, const std::string& place);
  // session_remove.cpp
  /// The piece of each copy that material of a collision triangle moves with; -1: none does.
  [[nodiscard]] std::vector<std::int32_t> pieces_of_copies(const Pieces& pieces) const;
  /// kg
  [[nodiscard]] double mass_of(HexId copy) const;
  /// Kilograms in the copies of each piece.
  [[nodiscard]] std::vector<double> masses_of(const Pieces& pieces) const;
  Result<RemovalReport> take_away(const std::vector<std::uint8_t>& triangles);
  /// Takes whole pieces out of everything that knows them. `before` gets what putting them back takes.
  Result<ComplexRenaming> take_out(const std::vector<std::uint8_t>& remove, std::optional<PieceRemoval>& before);
  Result<RemovalReport> take_grasped(const std::string& id);
  Status remove(const SceneRemove& what, const std::string& place);
  Result<RemovalReport> remove_in(const SceneRegion& region, SceneFrame frame);
  /// Body, measures, supports and grasps change places with those of a removal that is undone or done again.
  Status swap_removal(PieceRemoval& removal, bool back);
  /// A new mechanical model for the present hexahedra with these supports; the mechanical state is as it is.
  Status rebuild_model(const std::vector<std::uint8_t>& fixed, const std::vector<Vec3>& prescribed);
  /// Nothing that was kept between changes of topology holds any more: ids are others.
  void forget_ids();
  /// After the whole state has been put in place of what it was: nothing that was kept of that holds any more.
  void state_is_another();
  /// Room in the body's arrays: page faults of memory touched for the first time cost more than a cut does.
  void make_room();

  // session_shave.cpp
  Result<ShaveReport> shave(const Shaver& shaver, SceneFrame frame, double smoothing, double depth);
  Status begin_shave(const SceneShave& what, const std::string& place);
  Status advance_command_shave(double until);
  [[nodiscard]] BodyAccount account() const { return {state.measures, state.body.hex.bodies}; }
  void set_account(BodyAccount account);

  // session_punch.cpp
  Result<PunchReport> punch(const Punch& punch, SceneFrame frame, double roughness);
  [[nodiscard]] std::vector<Vec2> outline_of(const ScenePunch& what) const;
  Status punch(const ScenePunch& what, const std::string& place);

  /// Hexahedra, embeddings and mechanics after the complex changed since `synced`.
  Status follow_complex(CutTimes& times);
  /// Around a cut that takes no time: the surface stays where it is, momentum and kinetic energy are put right.
  void begin_pose();
  void end_pose();
  /// The surface alone: where mass goes, its momentum goes with it.
  void let_nothing_jump();
  /// Nodes, embeddings and offsets that surface vertices have now.
  [[nodiscard]] MovingSurface surface_state() const {
    return {state.body, state.mechanics.positions, state.mechanics.velocities, state.fade};
  }
  /// Has anything ever moved? Else no vertex can jump.
  [[nodiscard]] bool moved_ever() const { return state.steps > 0; }
  const BodyCounts& counts();
  void mark_synced() { journal_mark(state.body, state.synced); }
  void rollback_to(const JournalMark& mark);

  // session_hold.cpp
  /// `place` of the commands: where they stand in the scene file, for notes.
  Status apply(const SceneCommand& command);
  /// The same in a step. What can't be done with what there is of the body is noted and skipped; what could never be done is an error.
  Status apply_due(const SceneCommand& command);
  Status grasp(const SceneGrasp& what, const std::string& place);
  Status hold(const std::string& id, std::vector<CollisionVertex> points, std::optional<double> stiffness);
  Status move(const SceneMove& what);
  Status release(const SceneRelease& what);
  /// Grasps that hold nothing any more, because their piece was taken away, go; their ids are remembered.
  void lose_empty_grasps();
  /// Was a grasp of this id lost, so that a command for it is only noted?
  bool note_lost_grasp(const std::string& id, const std::string& place, const char* what);
  Status move_tool(const SceneToolMotion& what);
  Status move_jaws(const SceneJaws& what);

  // session_tools.cpp
  /// Sharp tools cut with the edge where it is now, jaws take hold or let go. Before mechanics; `until`: the step's end.
  Status use_tools(double until);
  Status cut_with(std::size_t tool, double until);
  /// After mechanics: what edges and jaws have met, for the next step.
  void feel_tools();
  /// m that the farthest front lies behind an edge, in the plane of its blade; `reach` at most.
  [[nodiscard]] double fronts_behind(const BladeEdge& now, Vec3 into, double reach);
  /// How the material at an edge has moved since the edge was there and collision vertices were at `places`.
  MaterialMotion motion_at(const BladeEdge& was, const std::vector<Vec3>& places);
  /// m: how far an edge has gone through that material, there.
  Vec3 way_through(const BladeEdge& was, const std::vector<Vec3>& places, const BladeEdge& now);
  /// Has the edge met the mid-surface anywhere on its way in the last step?
  bool passes_material(const BladeEdge& last, const BladeEdge& now);
  Status close_on(std::size_t tool);
  /// What the edge of a tool presses against in this step, with `inside` metres of it in the material. `into`: unit, where the material is uncut.
  void resist(std::size_t tool, const BladeEdge& now, Vec3 into, double inside);
  /// After mechanics: how far edges have pressed on.
  void press_edges();
  /// What contact must leave out: an edge that cuts and what follows it, jaws that hold.
  [[nodiscard]] bool leaves_out(const Contact& c) const;
  /// Is a contact let through: left out now, or left out until what is in each other there has come out? So is, as long as the tool lets anything pass, what is
  /// deep when it is first met: it has come along with that. Notes it in `passing`.
  bool lets_pass(const Contact& c);
  std::vector<ToolContact> passing;  ///< of this part of a step: DetectMemory::passing
  /// Is a contact of a blade that cuts with material in or beside its slit? That is for its flanks.
  [[nodiscard]] bool is_near_cut(const Contact& c, const ToolSizes& sizes) const;
  std::vector<Vec3> cut_through;  ///< of this step: where the blade that cuts is in the material, in rest coordinates
  std::vector<EdgePress> edge_presses;  ///< of this step
  Status fix(const SceneRegion& region, const std::string& name);
  void unfix(const SceneRegion& region, const std::string& place);
  /// Of vertices that were held, those that are not any more go from where they were to where their nodes put them (invariant 8).
  void fade_let_go(std::span<const VisualVertex> visual, std::span<const CollisionVertex> collision);
  /// The living nodes that a region holds: those in it, or those of the cells of the collision vertices in it.
  std::vector<NodeId> nodes_in(const SceneRegion& region) const;
  /// Which cells their borders cross, ascending; whether any material is held at one.
  bool crosses_material(const HeldRegions& held, std::vector<CellId>& cells) const;
  /// Nodes, elements and borders after changes of held regions, from number `first` on. Nodes change where these say so, and where what is held of cells has changed: others may be
  /// held, or let go, by nodes alone.
  Status renew_held(std::size_t first);
  /// Borders of held regions in the body as it is.
  void trace_held();
  /// Flags of nodes that held regions hold: those in the last region that they lie in, or of cells that are held as a whole, but not where free material moves them.
  [[nodiscard]] std::vector<std::uint8_t> nodes_of_held_material() const;
  Status hold_borders();
  void note_hinge(const SceneRegion& region, const std::string& name);
  /// Springs of grasps, of borders of fixed regions and of slit tips, anew. Linear in the tips there ever were, so changes of topology only say that they are
  /// stale; whoever looks at them asks for fresh ones first.
  Status renew_springs();
  Status fresh_springs() { return springs_stale ? renew_springs() : Status{}; }
  /// N, on the body; zero for nodes that are not fixed.
  [[nodiscard]] Vec3 force_on_fixed(NodeId node) const;
  /// N: of loads, grasps and contacts, where supports hold the surface and no node carries it.
  [[nodiscard]] Vec3 force_on_held();
  bool springs_stale = false;
  /// Bonds follow what a cut has changed: those of these triangles' roots, and of copies.
  void bonds_follow(std::span<const CollisionTriangle> triangles, std::span<const HexId> copies);
  void all_bonds_follow() { bonds_stale = all_bonds_stale = !bonds.empty(); }
  void renew_bonds();
  /// Failed: bonds that are not stale hold on to what a search through the whole body would not find.
  [[nodiscard]] Status validate_bonds() const;
  /// A blade has gone from one pose straight to another: bonds that it went through are gone.
  void sever_bonds(const BladeEdge& from, const BladeEdge& to);
  /// Is a contact one of skins that are bonded there?
  [[nodiscard]] bool is_bonded(const Contact& c) const;
  /// Takes the grasp of a tool away, if there is one.
  Status let_go(std::size_t tool);
  /// What holds the body is told where it is at `until`, the end of the part of a step that is solved next: once for every part, or what
  /// is held would be at the end of the whole step in the first one.
  void aim_holds(double until);
  /// Young's modulus of the body that a copy belongs to, outside of all regions.
  [[nodiscard]] double young_at(HexId copy) const;
  void renew_loads();
  /// What supports hold of the surface, where nodes move (held_skin.h).
  std::span<const CollisionVertex> held_collision();
  [[nodiscard]] bool stays(CollisionVertex v);
  std::span<const VisualVertex> held_visual();
  /// N: of a grasp on its point i; fresh springs.
  [[nodiscard]] Vec3 pull_of(const Grasp& grasp, std::size_t i);
  Vec3 held_load;  ///< N: what loads do to places that supports hold
  /// Other vertices stay at rest.
  void forget_held() {
    collision_held_at = visual_held_at = contact_held_at = 0;
    positions_changed();
  }
  /// What visual vertices have in addition to where their nodes put them, as the surface is shown: what fades, and what is held. Ascending.
  std::span<const FadingVertex> beside_visual();

  // session_parts.cpp
  /// Tools and body up to the end of the step: one after the other, in as many parts as edges want that are fast in the material.
  Result<StepReport> advance();
  /// dt seconds in equal parts. `tools_first`: else they have cut already.
  Result<StepReport> divide_tools_and_body(double dt, int equal, bool tools_first);
  Result<StepReport> advance_tools_and_body(double h, bool tools_first, bool may_divide);
  /// No other blade is in the body.
  [[nodiscard]] bool edge_at_work(std::size_t tool) const;
  /// Half thicknesses that material near an edge will move past it in dt seconds, as far as velocities say, and has moved past it since before_step.
  [[nodiscard]] double edge_travel(double dt);
  [[nodiscard]] double edge_travelled();
  /// Adds a part of a step to the report of what came before it.
  static void add_part(const StepReport& part, StepReport& sum, bool first);
  /// What a part does to the tools, times its duration. A step's forces are means: its parts' impulses together are what moved the tool.
  static void add_forces(std::span<const RigidToolResult> forces, double times, std::vector<RigidToolResult>& sum);

  // session_contact.cpp
  /// Mechanics for dt seconds, in parts where contact wants it. On an error the state is as it was.
  Result<StepReport> advance_mechanics(double dt);
  /// Tells contact what supports hold, if that has changed.
  void hold_in_contact();
  static constexpr int kUndivided = 0;
  /// h seconds from t on, in least_parts or more, where parts of the body come together fast; or kUndivided: as one part.
  /// `tries`: how often it may be tried again in shorter parts, from `began`, the mechanics as it is now; 0: take it as it comes.
  Result<StepReport> advance_part(double t, double h, int least_parts, int tries, const MechanicsState* began);
  /// s: no part of a step that is divided again and again is shorter; and how many such parts h seconds have room for, at least one.
  [[nodiscard]] double shortest_part() const;
  [[nodiscard]] int most_parts(double h) const;
  /// After detection for h seconds: is all that moves a number, and does what hangs together stay together? Else contacts mean nothing, there are more than one can wait for, and
  /// they are sought ever farther away.
  [[nodiscard]] Status can_be_followed(double h) const;
  [[nodiscard]] int parts_of_meeting(double h) const;
  /// Where a cell turns or stretches by more than rotations frozen in a part allow.
  [[nodiscard]] int parts_of_turning(double h) const;
  /// The same of a part that is over: 1 where it turned about as its start foretold.
  [[nodiscard]] int parts_of_turned(double h) const;
  Result<StepReport> divide_part(double t, double h, int more, int tries, const MechanicsState* began);
  /// Points of a body got so much deeper into another one in the part that is over that shorter ones are worth their time.
  [[nodiscard]] bool went_too_deep() const;
  /// So, or taken by surprise: after a part of h seconds that began as `began` and may be tried again so often.
  bool must_try_again(int tries, double h, const MechanicsState& began);
  /// After a part of h seconds that began with a node as fast as `fastest`: nodes faster than that, than
  /// obstacles and tools, and than parts can follow, are slowed down.
  void cap_part(double h, double fastest, StepReport& report);
  /// Once: a note about a step in which nodes were slowed down.
  void note_slowing(const StepReport& report);
  /// In the first step: a note about bodies that were placed into something.
  void warn_of_overlap();
  /// Triangles of the collision mesh that a cut, or taking one back, has changed.
  void contact_follows(std::span<const CollisionTriangle> changed);

  const std::vector<Vec3>& deformed_collision();
  /// Fills sweep_positions. At rest only with what is new, else with everything.
  void place_for_sweep(SceneFrame frame);
  void forget_places() {
    sweep_known = 0;
    sweep_boxes.forget();
  }
  PieceLabels piece_labels;                       ///< at topology version counted_at
  std::vector<CollisionTriangle> pieces_changed;  ///< since then
  /// The complex has changed since `since` (a mark, before it is rolled back to, or a step): what was kept of it for sweeps goes.
  template <class Since>
  void sweep_follows(const Since& since, std::size_t vertices, std::size_t faces);
  /// Node positions with their offsets; until nodes or offsets change.
  std::span<const Vec3> shown_nodes();
  void positions_changed() { collision_positions_valid = false; }
};

}  // namespace kerf
