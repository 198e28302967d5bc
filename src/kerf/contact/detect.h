// Which parts of bodies touch obstacles, tools, each other and themselves, or might before the step has ended.
//
// One call per (sub)step. Contacts are speculative: everything that could come together during the step is handed out with
// its gap, so that nothing tunnels as long as tools move by no more than substeps() allows. docs/contact.md has the method.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/contact/contact.h"
#include "kerf/contact/contact_surface.h"
#include "kerf/contact/rigid_shape.h"
#include "kerf/contact/side_points.h"

namespace kerf {

/// One body at the start of a step, all spans |V_c|.
struct SurfaceState {
  const ContactSurface* surface = nullptr;
  std::span<const Vec3> position;   ///< of the collision vertices, m
  std::span<const Vec3> offset;     ///< from each to the + corner of its prism, deformed, m; see surface_offsets.h
  std::span<const Vec3> predicted;  ///< where they would be at the end of the step, touching nothing, m
  /// Points of its sides besides, placed, with the lattice and its nodes; null: it has none.
  const SidePoints* sides = nullptr;
  const HexMesh* hex = nullptr;
  std::span<const NodeState> nodes = {};
};

/// What detection remembers of a contact from step to step: on which side the other one was. Part of a session's state.
struct RememberedContact {
  std::uint64_t key = 0;
  Vec3 normal;                ///< of the last step
  std::int32_t feature = -1;  ///< private
  double allowed =
      0;  ///< m: overlap beside a cut that is none, as it was there when the contact was first seen; no more than has been there ever since
  double gap = 0;  ///< m: handed out by detect(); who moves the body on writes here what has become of it
  friend bool operator==(const RememberedContact&, const RememberedContact&) = default;
};
/// And of a lip at the flank of a blade that cuts (flanks.h): how the cut runs beside the blade's plane, and how far it is opened.
struct RememberedRim {
  std::int32_t tool = 0;
  CollisionVertex vertex;
  std::int32_t side = 0;  ///< of the blade, 1 or -1; 0: it belongs to both lips
  std::int32_t end = 0;   ///< of the slit, as SlitVertex::end
  std::array<double, 2>
      beside{};  ///< m, at the - and + corner: towards +y, where it lay beyond the blade's plane, as seen from its material
  std::array<double, 2> deep{};  ///< m: how far an end of the slit lay inside the blade
  double open = 0;               ///< m
  friend bool operator==(const RememberedRim&, const RememberedRim&) = default;
};
/// What bounds material: a side of a face, or the wall over a border.
struct WayOut {
  CollisionHalfEdge edge;  ///< of a wall: the border; else the first of the face
  std::int32_t side = 0;   ///< 1 or -1: of the face; 0: the wall
  friend bool operator==(const WayOut&, const WayOut&) = default;
};
/// A contact with a tool.
struct ToolContact {
  std::uint64_t key = 0;
  std::int32_t tool = 0;
  friend bool operator==(const ToolContact&, const ToolContact&) = default;
};
/// A place of a wall that has sunk into material of its body, to be held by a contact of its own (sunk_walls.h).
struct SunkWall {
  CollisionHalfEdge edge;  ///< which the wall stands on
  double along = 0;        ///< on it, 0 to 1
  double lift = 0;         ///< SurfacePoint::lift
  double depth = 0;        ///< m
  WayOut out;              ///< of the material that it sank into
  bool held = false;       ///< by now
  friend bool operator==(const SunkWall&, const SunkWall&) = default;
};
struct DetectMemory {
  std::vector<RememberedContact> contacts;  ///< by key
  bool cut = false;                 ///< the body has been cut since: whoever cuts says so, detect() takes it back
  std::vector<RememberedRim> rims;  ///< by tool and vertex; detect() leaves them alone
  std::vector<ToolContact> flanks;  ///< of flanks that touched; detect() leaves them alone
  /// By key: left out although things are in each other there, so they may come out on either side. Whoever leaves contacts out says so, detect()
  /// leaves the list alone.
  std::vector<ToolContact> passing;
  std::vector<SunkWall> walls;  ///< detect() leaves them alone
  [[nodiscard]] std::size_t bytes() const {
    return contacts.size() * sizeof(RememberedContact) + rims.size() * sizeof(RememberedRim) +
           (flanks.size() + passing.size()) * sizeof(ToolContact) + walls.size() * sizeof(SunkWall);
  }
  friend bool operator==(const DetectMemory&, const DetectMemory&) = default;
};

/// What is remembered of a contact; null: it was none.
[[nodiscard]] const RememberedContact* remembered_contact(const DetectMemory& memory, std::uint64_t key);
[[nodiscard]] bool is_passing(const DetectMemory& memory, std::uint64_t key);

/// How the vertices of a body and their offsets came to be elsewhere than an earlier call was told, |V_c| each, m.
struct Strayed {
  std::span<const Vec3> position, offset;
};

struct DetectOptions {
  double step = 1e-3;        ///< h, s
  double margin = 0.2;       ///< contacts farther apart than this are left out; times the body's largest radius
  bool self_contact = true;  ///< a body with itself, lips of cuts included
  double body_friction = 0;  ///< between bodies and of a body with itself
  /// Not null: of a body with itself only what has strayed towards each other by more than half the margin is looked at, which is all that the earlier
  /// call can have overlooked. For one body.
  const Strayed* strayed = nullptr;
};

/// m: no place farther from the origin, at either end of a step, and no way longer in it, can be looked at. Its square is a number in single precision.
inline constexpr double kFarthest = 1e17;

/// What was seen besides contacts.
struct DetectReport {
  bool out_of_range = false;  ///< something is farther off than kFarthest, or not a number: nothing was looked at
  double sway = 0;            ///< m: how far a vertex would move in the step, less the mean of its body, at most
  double deepest = 0;         ///< most negative gap over the radius there, >= 0
  std::int32_t deep = 0;      ///< contacts that start deeper than a fifth of the radius: bodies placed into each other
};

/// Memory kept between calls; contents are private.
struct DetectScratch;
/// Owns a DetectScratch; a moved-from one is empty. Copies start empty: nothing in it is state.
class DetectWorkspace {
 public:
  DetectWorkspace();
  ~DetectWorkspace();
  DetectWorkspace(const DetectWorkspace&);
  DetectWorkspace& operator=(const DetectWorkspace&);
  DetectWorkspace(DetectWorkspace&&) noexcept;
  DetectWorkspace& operator=(DetectWorkspace&&) noexcept;
  DetectScratch& scratch();

 private:
  DetectScratch* scratch_ = nullptr;
};

/// Replaces `contacts` by all contacts, by key, keys unique; `memory` by what they are to be known by in the next step.
/// Indices of obstacles and tools are those in the spans. A contact's friction is the shape's, or body_friction.
/// Any positions and velocities will do; where they are out of range there are no contacts, and the memory stays as it is. Anything may be degenerate. Same input, same bits, with any number of threads.
DetectReport detect(std::span<const SurfaceState> bodies, std::span<const RigidShape> obstacles,
                    std::span<const RigidShape> tools, const DetectOptions& options, DetectMemory& memory,
                    DetectWorkspace& workspace, std::vector<Contact>& contacts);

/// How many parts a step of h seconds must be divided into, so that nothing tunnels: a shape moves by at most half of its
/// radius and the body's together in each (at most `most`).
int substeps(std::span<const SurfaceState> bodies, std::span<const RigidShape> shapes, double h, int most = 64);

}  // namespace kerf
