// Contact in a session's step: where obstacles and tools are, what touches, and the rows that mechanics is given.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "kerf/contact/depth.h"
#include "kerf/contact/detect.h"
#include "kerf/contact/flanks.h"
#include "kerf/mechanics/step.h"
#include "kerf/scene/rigid_motion.h"
#include "kerf/scene/scene_shapes.h"
#include "kerf/session/body.h"

namespace kerf {

/// What a session keeps for contact besides its state: shapes as loaded, the contact geometry of the body (derived from
/// the collision mesh), and memory.
struct ContactStep {
  bool on = false;
  SceneShapes shapes;
  ContactSurface surface;
  bool surface_stale = false;  ///< after undo, redo or a restored snapshot: all of it anew
  SidePoints sides;            ///< of the surface
  bool sides_stale = true;     ///< the body has been cut since
  /// Vertices that supports hold where nodes move (held_skin.h), ascending, and a flag for each vertex. They stay at rest, and no node carries them.
  std::vector<CollisionVertex> held;
  std::vector<std::uint8_t> is_held;

  std::vector<RigidShape> tools;
  std::vector<NodeState> nodes;
  std::vector<Vec3> positions, offsets, predicted;  // per collision vertex
  DetectWorkspace detect;
  DetectReport seen;  ///< of the last detection
  std::vector<Contact>
      contacts;  ///< of the last detection, by key; results in the workspace of mechanics are in the same order
  ContactSet set;
  std::vector<double> held_share;  ///< per row of `set`: what its force on the body acts on held vertices with, -1 to 1
  std::vector<std::int32_t> node_slot;  ///< per node, -1 between uses
  Slit slit;                            ///< of the blade that cuts

  DetectWorkspace detect_surprises;  ///< find_surprise(): what it works on
  std::vector<Vec3> strays, turns;   // per collision vertex
  DetectMemory surprise_memory;
  std::vector<Contact> surprises;
  DepthSearch depths;                   ///< and reckon_overlap()
  std::vector<DepthSearch::Deep> sunk;  ///< walls that the last find_surprise() found deep in material
};

/// Shapes, contact geometry and options of a scene. Bad input: meshes of obstacles that can't be used.
Status prepare_contact(const Scene& scene, const Body& body, std::vector<std::string>& notes, ContactStep& step);

/// The surface and its points as the body is, if they are stale.
void refresh_surface(const Body& body, ContactStep& step);

/// From the next detection on these are the vertices that no node carries.
void hold_in_contact(const Body& body, std::span<const CollisionVertex> held, ContactStep& step);
/// The same of places at rest; none: nothing is held.
void hold_sides(std::function<bool(Vec3)> is_held, ContactStep& step);

/// At the start of its motion.
RigidState tool_state(const SceneRigidTool& tool);

/// Numbers of a tool that follows a motion from time t for h seconds.
RigidTool rigid_tool(const SceneRigidTool& tool, const ToolMotion& motion, double t, double h);
/// What its coupling, what it holds and what it cuts make of the tool's motion from time t in a step of h seconds, without contacts.
RigidVelocity expected_velocity(const SceneRigidTool& tool, const ToolMotion& motion, const RigidState& now, double t,
                                double h);

/// Where an edge that cuts presses against a vertex: one-sided, up to the resistance of the material.
struct EdgePress {
  std::int32_t tool = 0;
  CollisionVertex vertex;
  double share = 1;      ///< of the edge in the material
  Vec3 local;            ///< m, in the tool's frame: the place of the edge
  Vec3 direction;        ///< unit, in the tool's frame: into the material
  Vec3 offset;           ///< m: from the vertex to where the edge would not press
  double stiffness = 0;  ///< N/m
  double limit = 0;      ///< N
};
/// m: how far its edge has pressed on from there.
Vec3 pressed(const Body& body, const MechanicsState& state, const EdgePress& press);
/// Rows of edges that cut, after those of contacts.
void add_edge_rows(const Body& body, const MechanicsState& state, std::span<const EdgePress> presses,
                   ContactStep& step);

/// How many equal parts a step of dt seconds needs so that nothing tunnels: obstacles and tools as they move at time t.
int contact_substeps(const Scene& scene, const Body& body, const MechanicsState& state,
                     const std::vector<ToolMotion>& motions, double t, double dt, ContactStep& step);

/// The two halves of find_contacts.
void detect_contacts(const Scene& scene, const Body& body, const MechanicsModel& model, const MechanicsState& state,
                     const std::vector<ToolMotion>& motions, double t, double h, Vec3 gravity, DetectMemory& memory,
                     ContactStep& step);
void make_contact_rows(const Body& body, ContactStep& step);
/// Contacts of the flanks and the back of blades in their slits between t and t + h, after detection.
void add_flanks(const Scene& scene, const Body& body, const std::vector<ToolMotion>& motions, double t, double h,
                DetectMemory& memory, ContactStep& step);

/// Did a step of h seconds, from `began` to `ended`, take points of the body so deep (m) into each other that find_contacts() had not handed out, because
/// they moved otherwise than they would have without contact and forces, or much deeper than the `results` of those say? Looks at where they ended (what is
/// linear in the step is not true of rims that turn), and only if nodes strayed far: at walls that came to be in material, and at what detection finds there.
/// `memory`: that before the step. Walls that are so deep by then, since now or before, are in step.sunk.
bool find_surprise(const Scene& scene, const Body& body, const MechanicsModel& model, const MechanicsState& began,
                   const MechanicsState& ended, const DetectMemory& memory, double h, Vec3 gravity, double deep,
                   std::span<const ContactResult> results, ContactStep& step);

/// Writes into RememberedContact::gap what a step that has been solved made of the gaps of step.contacts.
void remember_gaps(std::span<const ContactResult> results, const ContactStep& step, DetectMemory& memory);

/// m: the deepest of all contacts at the end of a step that has been solved. Two points of bodies that would overlap by more than `deep` along the normal
/// that they had when it began may have turned or slid off each other: of those, how deep they really are in the material of the other one replaces
/// their end_gap in `results`, if that is less.
double reckon_overlap(const Body& body, const MechanicsState& ended, double deep, std::span<ContactResult> results,
                      ContactStep& step);

/// What touches between t and t + h: step.contacts, without those that leave_out says, and the rows of step.set.
/// O(surface refitted + contacts).
template <class LeaveOut>
void find_contacts(const Scene& scene, const Body& body, const MechanicsModel& model, const MechanicsState& state,
                   const std::vector<ToolMotion>& motions, double t, double h, Vec3 gravity, DetectMemory& memory,
                   ContactStep& step, LeaveOut&& leave_out) {
  detect_contacts(scene, body, model, state, motions, t, h, gravity, memory, step);
  std::erase_if(step.contacts, leave_out);
  add_flanks(scene, body, motions, t, h, memory, step);
  make_contact_rows(body, step);
}

}  // namespace kerf
