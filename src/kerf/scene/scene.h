// A scene: everything a run needs, as plain data. scene_file.h reads it from TOML, a program may fill it in
// itself. Lengths in metres, times in seconds, rest coordinates (after `scale`) unless said otherwise. The
// defaults below are the defaults of the file format; scene_keys.cpp holds the words, units and ranges of
// every key.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/mesh/models.h"

namespace kerf {

/// A part of space. Only the members of its shape count.
struct SceneRegion {
  enum class Shape { kBox, kSphere, kHalfSpace };
  Shape shape = Shape::kBox;
  Vec3 min, max;      ///< box: opposite corners, min < max in each coordinate
  Vec3 center;        ///< sphere
  double radius = 0;  ///< sphere, > 0
  Vec3 point;         ///< half-space: a point of its border plane
  Vec3 normal;        ///< half-space: points into the region; any length > 0
  int line = 0;       ///< in the scene file, for messages; 0 when there is none

  /// Is p inside or on the border?
  [[nodiscard]] bool contains(Vec3 p) const {
    switch (shape) {
      case Shape::kBox:
        return p.x >= min.x && p.y >= min.y && p.z >= min.z && p.x <= max.x && p.y <= max.y && p.z <= max.z;
      case Shape::kSphere: return dot(p - center, p - center) <= radius * radius;
      case Shape::kHalfSpace: return dot(p - point, normal) >= 0;
    }
    return false;
  }
};

/// Where a thing is at a time and how it is turned: x -> position + R x, R the turn about `rotation` by its length.
struct ScenePose {
  double time = 0;  ///< s
  Vec3 position;    ///< metres
  Vec3 rotation;    ///< axis times angle, radians
};

/// What one body is made of where it differs from [material].
struct SceneBodyMaterial {
  std::optional<double> young;     ///< pascals
  std::optional<double> poisson;   ///< 1
  std::optional<double> density;   ///< kg/m3
  std::optional<Vec3> prestretch;  ///< 1: along the axes of the body's cells, lengths at rest over natural ones
};

struct SceneBodyLoaded;  // scene_body.h

/// Where a body comes from: exactly one of `model`, `visual` and `bound` is not empty.
struct SceneBody {
  std::string name;                               ///< for messages
  std::string model;                              ///< a generator: "sheet", "steak", "meniscus", ...
  ModelOptions options;                           ///< of the generator; make_model checks them
  std::string visual;                             ///< mesh file; resolved, so that it can be opened as it stands
  std::string collision;                          ///< mesh file of the mid-surface; resolved
  std::string bound;                              ///< a body saved by `kerf bind`; resolved
  std::shared_ptr<const SceneBodyLoaded> loaded;  ///< one that a program has: it is taken, and `bound` is its name
  double scale = 1;                               ///< metres per unit of the mesh files
  std::optional<double> thickness;                ///< metres; needed by an open visual sheet, ignored by a closed one
  std::optional<double> weld;                     ///< metres; corners of the mesh files this close are one; 0: none
  bool exact_paths = false;                       ///< exact geodesic paths in the pre-processing
  int collision_triangles = 0;  ///< wanted of a collision mesh that is made from `visual` alone; 0: as many as it needs
  std::optional<Vec3> size;     ///< metres along the axes: a model "closed-sheet" of this size instead of its own
  Vec3 position, rotation;      ///< as in ScenePose; coordinates at rest are those after placing
  SceneBodyMaterial material;   ///< of this body
  int line = 0;                 ///< in the scene file: of the model's options, or else of model, visual or bound
};

/// A region whose material differs; what is not given stays as in [material]. Later regions win.
struct SceneMaterialRegion {
  SceneRegion region;
  std::optional<double> young;    ///< pascals
  std::optional<double> poisson;  ///< 1
  std::optional<double> density;  ///< kg/m3
};

/// What the body is made of. Without a value the model's own counts; bodies from files have kSceneYoung and
/// so on.
struct SceneMaterial {
  std::optional<double> young;       ///< pascals
  std::optional<double> poisson;     ///< 1
  std::optional<double> density;     ///< kg/m3
  double damping_mass = 0.5;         ///< 1/s: Rayleigh's factor of the mass matrix
  double damping_stiffness = 0.002;  ///< s: Rayleigh's factor of the stiffness matrix
  std::vector<SceneMaterialRegion> regions;
};

/// Soft tissue: what a body from files is made of unless the scene says otherwise.
inline constexpr double kSceneYoung = 20e3;    ///< pascals
inline constexpr double kScenePoisson = 0.45;  ///< 1
inline constexpr double kSceneDensity = 1000;  ///< kg/m3

enum class SceneFormulation {
  kIncompatible,  ///< eight nodes and nine incompatible modes: bends as it should
  kPlain,         ///< trilinear only, as in the paper: too stiff in bending
};

/// The lattice of cells. In words: nothing given, a model's own lattice, or for bodies from files cells that
/// fit the thickness, near cubes where the body is bent; `layers`: chosen by the body with so many cells across the thickness; `cells` or
/// `cell_size`: over the body's box along `axes` (default: as chosen by the body); `origin`, `cells` and
/// `cell_size` together: exactly that lattice along `axes` (default: the world's). scene_lattice.h does it.
struct SceneLattice {
  std::optional<std::array<int, 3>> cells;  ///< along each axis
  std::optional<Vec3> cell_size;            ///< metres along each axis
  std::optional<Vec3> origin;               ///< metres: lowest corner of the lattice
  std::optional<std::array<Vec3, 3>> axes;  ///< orthonormal, right-handed
  std::optional<int> layers;                ///< cells across the thickness
  SceneFormulation formulation = SceneFormulation::kIncompatible;
  int line = 0;  ///< in the scene file: of cells, cell_size or layers
};

/// How cuts are made (CutOptions of cutting/cut_options.h). Tolerances are fractions of the mean edge length
/// of the uncut collision mesh.
struct SceneCut {
  int layers = 2;                  ///< rows of faces across the thickness of a cut surface
  double roughness = 0;            ///< how far inner vertices of a cut surface stray, part of a row's height
  double minimum_feature = 0.024;  ///< shorter path segments are left out
  std::optional<double> snap;      ///< decides nothing; scenes with it load
  double path_tolerance = 0.024;   ///< how far the cut may be from the blade's true path
  /// Share of its uncut body's volume: a loose piece below it is swept up when the stroke that cut it off ends; 0: none is. Of three times twenty strokes
  /// across a steak, 0.05 mean edges beside each other, it takes 15 to 23 slivers, a thousandth of the body, and leaves none. At half, up to 8 of those that
  /// are below it stay; at double, three times as much material goes.
  double dust = 1e-4;
  double resistance = 0;  ///< N per metre of edge inside the material, below which a tool's edge only presses
};

enum class ScenePreconditioner {
  kAdaptive,     ///< block-Jacobi, and the rigid-body modes as soon as that takes long
  kTwoLevel,     ///< block-Jacobi and rigid-body modes of aggregates, always
  kBlockJacobi,  ///< the diagonal blocks alone
  kDirect,       ///< no iterations: a sparse factorisation in every step (small bodies, checks)
};

struct SceneSimulation {
  double time_step = 0.001;   ///< s
  double duration = 1;        ///< s
  Vec3 gravity{0, 0, -9.81};  ///< m/s2
  double tolerance = 0.01;    ///< 1: residual of the linear solver relative to the right-hand side
  int max_iterations = 1000;  ///< of the linear solver in one step
  ScenePreconditioner preconditioner = ScenePreconditioner::kAdaptive;
  int threads = 0;        ///< 0: as many as there are cores; results don't depend on it
  std::int64_t seed = 1;  ///< of everything random (roughness)
};

/// Nodes in the region never move.
struct SceneFix {
  SceneRegion region;
};

/// A constant force, spread evenly over the vertices within `radius` of `point`, or at the closest place of the surface.
struct SceneLoad {
  Vec3 point;                   ///< rest coordinates
  double radius = 0;            ///< metres
  Vec3 force;                   ///< newtons, all of it, in world directions
  double from = 0;              ///< s: when it sets in
  std::optional<double> until;  ///< s: when it ends; never when absent
  int line = 0;                 ///< in the scene file: of `point`
};

/// What holds two bodies together where their skins face each other (mechanics/bonds.h), until it is torn or cut.
struct SceneBond {
  std::string lower, upper;               ///< names of bodies
  double strength = 10e3;                 ///< pascals, against opening; at most what the cells resolve
  std::optional<double> shear_strength;   ///< pascals, against sliding; as strength
  double toughness = 50;                  ///< J/m^2 that opening takes
  std::optional<double> shear_toughness;  ///< J/m^2 that sliding takes; as toughness
  std::optional<double> stiffness;        ///< Pa/m; chosen by the bodies
  std::optional<double> spacing;          ///< metres from point to point; four to a cell's edge
  std::optional<double> reach;            ///< metres: how far skins may be from each other; a tenth of the thinner body
  int line = 0;
};

// --- Contact
// -------------------------------------------------------------------------------------------------------

/// How things touch (contact/contact.h, mechanics/contact_rows.h). See wants_contact().
struct SceneContact {
  std::optional<bool> enabled;  ///< default: when the scene has a [contact], obstacles, tools or several bodies
  bool self = true;             ///< of bodies with themselves, the two lips of a cut included, and with each other
  double friction = 0.3;        ///< Coulomb's coefficient, of whatever does not say otherwise
  double stiffness = 30;        ///< 1: times the local inertia and elasticity
  double margin = 0.2;          ///< half thicknesses: contacts are watched from this gap on
  double push_speed = 1;        ///< m/s at which bodies that overlap at the start are pushed apart
  int passes = 8;               ///< linear solves of a step while contacts open and close; three times as many at most
  int substeps = 16;            ///< parts of a step at most, when a tool or an obstacle is fast
};

enum class SceneShape { kPlane, kSphere, kCapsule, kBox, kMesh };
inline constexpr std::size_t kSceneShapes = 5;

/// A rigid thing that stands still or moves as told. In its own axes: a plane is z = 0 with z outside, a capsule lies along
/// z, a box has its middle at the origin, a mesh is as it is.
struct SceneObstacle {
  std::string name;  ///< for messages and pictures
  SceneShape shape = SceneShape::kPlane;
  Vec3 position, rotation;         ///< as in ScenePose
  double radius = 0;               ///< metres: sphere, capsule
  double length = 0;               ///< metres: capsule, between the centres of its ends
  Vec3 size;                       ///< metres: box
  std::string mesh;                ///< mesh file; resolved. Or
  std::string model;               ///< a generated surface of mesh/rigid_models.h
  double scale = 1;                ///< metres per unit of the mesh file; size of a generated surface
  std::optional<double> friction;  ///< default: that of [contact]
  std::vector<ScenePose> moves;    ///< times ascend; before the first it moves there from its place
  int line = 0;                    ///< in the scene file
};

enum class SceneToolKind {
  kProbe,     ///< a rod with a hook at its end
  kGrasper,   ///< two jaws that close
  kScalpel,   ///< a sharp edge, blunt back and flanks
  kScissors,  ///< two blades that close; the closing line cuts
  kSphere,    ///< a ball
  kMesh,      ///< a rigid surface from a file
  kShaver,    ///< a rod with a round end; it smooths in a page's hand (engine_instruments.cpp), and presses
};
inline constexpr std::size_t kSceneToolKinds = 7;

/// A rigid tool that follows a given pose through a virtual coupling, and feels what it touches. In its own axes: the tip
/// (or the middle of a ball) is the origin, the shaft leads up along +z; edges and jaws lie in the plane y = 0.
/// Sizes that are not given are the kind's own (scene_shapes.h).
struct SceneRigidTool {
  std::string id;
  SceneToolKind kind = SceneToolKind::kProbe;
  Vec3 position, rotation;                  ///< where it starts; as in ScenePose
  std::optional<double> length;             ///< metres: shaft
  std::optional<double> radius;             ///< metres: of the shaft; of a ball
  std::optional<double> tip;                ///< metres: hook of a probe, jaws, edge of a scalpel, blades of scissors
  std::optional<double> width;              ///< metres: of a scalpel from edge to back, of jaws
  std::optional<double> thickness;          ///< metres: of a scalpel's or of scissors' blade
  double opening = 0.6;                     ///< radians between open jaws
  bool sharp = true;                        ///< whether the edge cuts
  std::string mesh;                         ///< mesh file; resolved
  double scale = 1;                         ///< metres per unit of the mesh file
  std::optional<double> friction;           ///< default: that of [contact]
  double mass = 0.05;                       ///< kg, of what follows the pose
  double stiffness = 2000;                  ///< N/m between the pose and what follows it
  std::optional<double> damping;            ///< N s/m; default: critical
  std::optional<double> turning_stiffness;  ///< N m/rad; default: stiffness times the square of 2 cm
  std::optional<double> turning_damping;    ///< N m s/rad; default: critical
  double max_force = 50;                    ///< N: of the coupling; 0: no limit
  double max_speed = 10;                    ///< m/s: poses that jump are followed at this speed
  int line = 0;                             ///< in the scene file
};
inline bool has_jaws(const SceneRigidTool& tool) {
  return tool.kind == SceneToolKind::kGrasper || tool.kind == SceneToolKind::kScissors;
}

// --- Commands
// ------------------------------------------------------------------------------------------------------

enum class SceneFrame {
  kWorld,  ///< where the body is now
  kRest,   ///< where the body was before anything moved; follows its deformation
};

enum class SceneTool {
  kScalpel,   ///< the edge from base to tip
  kScissors,  ///< the closing line between two jaws
  kLine,      ///< a ray from base through tip and beyond: a stroke seen from base, cutting the first layer it
              ///< meets
};

/// Where the edge of a tool is at one time.
struct SceneBladePose {
  double time = 0;  ///< s after the command's `at`
  Vec3 base, tip;   ///< ends of the edge, metres, in the command's frame; never the same point
};

/// One stroke. Between two poses the edge moves in straight lines; base-tip sweeps a ruled surface, and where
/// that meets the mid-surface the body is cut through its whole thickness. At least two poses, times strictly
/// increasing.
struct SceneBlade {
  SceneTool tool = SceneTool::kScalpel;
  SceneFrame frame = SceneFrame::kWorld;
  std::vector<SceneBladePose> poses;
  bool through = false;  ///< cut all layers the edge meets instead of the first
};

enum class ScenePunchShape { kCircle, kD, kPolygon };

/// A punch: a closed outline pressed through the body at once; what is inside it comes loose (cutting/punch.h).
struct ScenePunch {
  ScenePunchShape shape = ScenePunchShape::kCircle;
  Vec3 point;            ///< metres: middle of the circle, of the flat side of the D, origin of the polygon
  Vec3 axis{0, 0, 1};    ///< along which it is pressed
  Vec3 across{1, 0, 0};  ///< x of the outline; its part along the axis does not count
  SceneFrame frame = SceneFrame::kWorld;
  double radius = 0;            ///< metres: circle, D
  std::vector<Vec2> points;     ///< metres: polygon
  std::optional<double> reach;  ///< metres along the axis to both sides of the point; default: through everything
  double roughness = 0;         ///< metres by which the cut surface is jagged at most
  bool take = false;            ///< what comes loose is taken away at once
};

/// A shaver that moves over cut surfaces (cutting/shave.h). One undo step.
struct SceneShave {
  SceneFrame frame = SceneFrame::kWorld;
  std::vector<SceneBladePose> poses;  ///< ends of its cutting window
  double radius = 0;                  ///< metres, of the cutting window
  double smoothing = 30;              ///< 1/s: part of a bump that goes per second, at full contact
  double removal = 0.0005;            ///< m/s: how fast smooth edges move back; 0: they stay
};

/// Takes loose pieces away: those in a region (by suction), or the one that a grasp holds.
struct SceneRemove {
  SceneRegion region;
  SceneFrame frame = SceneFrame::kWorld;
  std::string grasp;  ///< id; empty: by region
};

/// Takes hold of the surface within `radius` of `point` (at least of the closest vertex) where it is now.
struct SceneGrasp {
  std::string id;
  Vec3 point;
  SceneFrame frame = SceneFrame::kRest;
  double radius = 0;                ///< metres, around `point` in the same frame
  std::optional<double> stiffness;  ///< N/m of the whole grasp; default: as stiff as the solver likes, see docs
};

/// Moves a grasp in a straight line: by a displacement, or until its centre is at `to`. Exactly one is given.
struct SceneMove {
  std::string id;
  std::optional<Vec3> by, to;  ///< metres, world
  double over = 0;             ///< s that it takes; 0: at once
};

struct SceneRelease {
  std::string id;
};
struct SceneFixCommand {
  SceneRegion region;
};
/// Frees what lies in the region, whether [[fix]] or a fix command held it.
struct SceneUnfix {
  SceneRegion region;
};
/// Where a tool's pose goes. Straight and even between poses, from where the pose is when the command is given.
struct SceneToolMotion {
  std::string id;
  std::vector<ScenePose> poses;  ///< times after the command's `at`, ascending; at least one
};
/// Closes or opens the jaws of a grasper or of scissors. Closed on tissue, a grasper holds it.
struct SceneJaws {
  std::string id;
  bool close = true;
  double over = 0.2;  ///< s that it takes
};
struct SceneUndo {
  int count = 1;  ///< strokes
};
struct SceneRedo {
  int count = 1;
};

struct SceneCommand {
  double at = 0;  ///< s
  std::variant<SceneBlade, SceneGrasp, SceneMove, SceneRelease, SceneFixCommand, SceneUnfix, SceneUndo, SceneRedo,
               SceneToolMotion, SceneJaws, ScenePunch, SceneShave, SceneRemove>
      what;
  int line = 0;  ///< in the scene file, for messages; 0 when there is none
};

// --- Outputs
// -------------------------------------------------------------------------------------------------------

/// The camera is fitted to the body.
struct SceneCamera {
  Vec3 direction{-0.45, -0.8, 0.62};  ///< from the body to the eye; any length > 0
  Vec3 up{0, 0, 1};
  double zoom = 1;             ///< > 1 comes closer
  double field_of_view = 0.5;  ///< radians, vertical
};

/// Where an arthroscope goes in, for pages that look through one.
struct SceneArthroscope {
  Vec3 entry;                          ///< metres, at rest: where it goes through the skin
  Vec3 target;                         ///< metres: what it looks at to begin with
  double angle = 0.52359877559829887;  ///< radians between its shaft and its view: 30 degrees
};

struct SceneOutput {
  double frames_per_second = 30;                                        ///< of the .glb and of positions
  std::vector<std::string> meshes{"visual", "collision", "hexahedra"};  ///< which final meshes are written
  bool animation = true;                                                ///< body.glb
  bool positions = false;            ///< node positions of every frame, positions.vtu series
  bool picture = true;               ///< picture.png
  std::optional<double> picture_at;  ///< s; default: the end of the run
  std::array<int, 2> picture_size{1600, 1000};
  bool wireframe = false;  ///< draw the meshes' edges into the picture
  SceneCamera camera;
};

/// A file that the scene names: as it is written, and where it is.
struct SceneFileUse {
  std::string written, path;
  int line = 0;
};

struct Scene {
  std::string title;
  std::string goal;
  int tile = 0;      ///< among the tiles of a page: the least first, then those with 0
  std::string name;  ///< file name without folder and ending, or whatever parse_scene was told
  std::string file;  ///< as it was named to the reader, for messages; empty for scenes that a program fills in
  SceneBody body;    ///< the first, mostly the only one
  std::vector<SceneBody> more_bodies;  ///< the others of [[body]], one after another
  SceneMaterial material;
  SceneLattice lattice;
  SceneCut cut;
  SceneSimulation simulation;
  std::vector<SceneFix> fixes;
  std::vector<SceneLoad> loads;
  std::vector<SceneBond> bonds;
  SceneContact contact;
  std::vector<SceneObstacle> obstacles;
  std::vector<SceneRigidTool> tools;
  std::optional<SceneRegion> lesion;  ///< rest coordinates: what should be taken out; for the score (session/score.h)
  std::optional<SceneArthroscope> arthroscope;
  std::vector<SceneCommand> commands;  ///< sorted by `at`; commands of the same time in the order of the file
  SceneOutput output;
  std::vector<SceneFileUse> files;  ///< of parse_scene: every file that the scene names, each once, in their order
};

/// Does anything touch anything in this scene?
inline bool wants_contact(const Scene& scene) {
  return scene.contact.enabled.value_or(!scene.obstacles.empty() || !scene.tools.empty() || !scene.more_bodies.empty());
}

}  // namespace kerf
