#include "kerf/scene/scene_keys.h"

#include <fmt/format.h>

#include <cmath>

#include "kerf/scene/scene_limits.h"

namespace kerf {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr SceneRange kAny{};
constexpr SceneRange kPositive{0, kInfinity, true, false};
constexpr SceneRange kNotNegative{0, kInfinity, false, false};
constexpr SceneRange kPositiveFraction{0, 1, true, true};
constexpr SceneRange kPlace{-kFarthestPlace, kFarthestPlace, false, false};
constexpr SceneRange kForce{-kHardestForce, kHardestForce, false, false};
constexpr SceneRange kAcceleration{-kMostGravity, kMostGravity, false, false};
constexpr SceneRange kStiffness{kLeastYoung, kMostYoung, false, false};
constexpr SceneRange kMassPerVolume{kLeastDensity, kMostDensity, false, false};
constexpr SceneRange kTurn{-100, 100, false, false};  // 16 turns; beyond, digits of the angle are lost
constexpr SceneRange at_least_one(double max) { return {1, max, false, false}; }

constexpr std::string_view kFormulationWords[] = {"incompatible", "plain"};
constexpr std::string_view kPreconditionerWords[] = {"adaptive", "two-level", "block-jacobi", "direct"};
constexpr std::string_view kToolWords[] = {"scalpel", "scissors", "line"};
constexpr std::string_view kFrameWords[] = {"world", "rest"};
constexpr std::string_view kPunchWords[] = {"circle", "d", "polygon"};
constexpr std::string_view kShapeWords[] = {"plane", "sphere", "capsule", "box", "mesh"};
constexpr std::string_view kToolKindWords[] = {"probe", "grasper", "scalpel", "scissors", "sphere", "mesh", "shaver"};
static_assert(std::size(kShapeWords) == kSceneShapes && std::size(kToolKindWords) == kSceneToolKinds);
constexpr std::string_view kMeshWords[] = {"visual", "collision", "hexahedra"};

template <class M>
struct MemberPointer;
template <class T, class V>
struct MemberPointer<V T::*> {
  using Table = T;
  using Value = V;
};

/// How to reach a member, for example member<&SceneBody::name>().
template <auto Pointer>
auto member() {
  using P = MemberPointer<decltype(Pointer)>;
  return SceneMember<typename P::Value>{
      [](void* table) -> typename P::Value& { return static_cast<typename P::Table*>(table)->*Pointer; }};
}

template <auto Pointer>
SceneChoice choice(std::span<const std::string_view> words) {
  using P = MemberPointer<decltype(Pointer)>;
  return {words,
          [](const void* table) { return static_cast<int>(static_cast<const typename P::Table*>(table)->*Pointer); },
          [](void* table, int position) {
            static_cast<typename P::Table*>(table)->*Pointer = static_cast<typename P::Value>(position);
          }};
}

}  // namespace

std::string range_fault(std::string_view what, const SceneRange& range, double x) {
  if (!std::isfinite(x)) return fmt::format("{} must be a finite number, but is {}", what, x);
  if (range.contains(x)) return {};
  if (range.above_min ? x <= range.min : x < range.min)
    return fmt::format("{} must be {} {}, but is {}", what, range.above_min ? "more than" : "at least", range.min, x);
  return fmt::format("{} must be {} {}, but is {}", what, range.below_max ? "less than" : "at most", range.max, x);
}

std::string_view word_of(SceneShape shape) { return kShapeWords[static_cast<std::size_t>(shape)]; }
std::string_view word_of(SceneToolKind kind) { return kToolKindWords[static_cast<std::size_t>(kind)]; }

template <>
SceneKeys<Scene> scene_keys<Scene>() {
  static const SceneKey keys[] = {
      {"title", member<&Scene::title>(), "", kAny, false, "What the scene shows, for reports and pictures."},
      {"goal", member<&Scene::goal>(), "", kAny, false,
       "What a person may try in it, in one line. Scenes with a goal are tiles of the page; others stand under More."},
      {"tile", member<&Scene::tile>(), "", kNotNegative, false,
       "Where the scene stands among the tiles of the page: the least first. Those with 0 follow, by name."},
      {"body", SceneNested{"table or list of tables"}, "", kAny, true,
       "The body that is cut: a model, mesh files or a bound body. [[body]] several times: several bodies."},
      {"material", SceneNested{"table"}, "", kAny, false, "What the body is made of."},
      {"lattice", SceneNested{"table"}, "", kAny, false, "The regular lattice whose cells become hexahedra."},
      {"cut", SceneNested{"table"}, "", kAny, false, "How cuts and their surfaces are made."},
      {"simulation", SceneNested{"table"}, "", kAny, false, "Time, gravity and solver."},
      {"fix", SceneNested{"list of tables"}, "", kAny, false, "Regions whose material never moves."},
      {"load", SceneNested{"list of tables"}, "", kAny, false, "Constant forces on the surface."},
      {"bond", SceneNested{"list of tables"}, "", kAny, false,
       "What holds two bodies together where their skins face each other, until it is torn or cut."},
      {"lesion", SceneNested{"table"}, "", kAny, false,
       "A marked part of the body that should be taken out; gives the run a score."},
      {"arthroscope", SceneNested{"table"}, "", kAny, false,
       "Where an arthroscope goes in, for the page's view through one."},
      {"contact", SceneNested{"table"}, "", kAny, false, "How things touch."},
      {"obstacle", SceneNested{"list of tables"}, "", kAny, false, "Rigid things that stand still or move as told."},
      {"tool", SceneNested{"list of tables"}, "", kAny, false,
       "Rigid tools that follow given poses and feel what they touch."},
      {"command", SceneNested{"list of tables"}, "", kAny, false, "What happens when: cuts, grasps, tools, undo."},
      {"output", SceneNested{"table"}, "", kAny, false, "What a run writes beside report.json."},
  };
  return {keys};
}

template <>
SceneKeys<SceneBody> scene_keys<SceneBody>() {
  using T = SceneBody;
  static const SceneKey keys[] = {
      {"name", member<&T::name>(), "", kAny, false, "For messages. Default: number and kind of the body."},
      {"model", member<&T::model>(), "", kAny, false,
       "Name of a built-in model such as \"sheet\", \"steak\" or \"meniscus\" (see kerf make --help). Give "
       "exactly one of "
       "model, visual and bound."},
      {"options", SceneNested{"table"}, "", kAny, false,
       "Options of the model: options = { visual_triangles = 6656 }."},
      {"visual", SceneFilePath{member<&T::visual>()}, "", kAny, false,
       "Mesh file that is drawn (OBJ, PLY, STL, OFF), relative to the scene, or in a folder that --meshes or KERF_MESHES names."},
      {"collision", SceneFilePath{member<&T::collision>()}, "", kAny, false,
       "Mesh file of the mid-surface, relative to the scene. Goes with visual. Without it one is made from the "
       "visual mesh; an open one of up to 1500 triangles is its own."},
      {"collision_triangles", member<&T::collision_triangles>(), "", SceneRange{0, 100000}, false,
       "Wanted of the collision mesh that is made: at most as many as visual has, or 1500. 0: as many as it needs, 160 or more."},
      {"bound", SceneFilePath{member<&T::bound>()}, "", kAny, false,
       "A body saved by kerf bind, relative to the scene."},
      {"scale", member<&T::scale>(), "m per unit", kPositive, false,
       "Metres per unit of the files visual and collision: 0.001 for millimetres."},
      {"thickness", member<&T::thickness>(), "m", kPositive, false,
       "Thickness of the solid. An open visual mesh needs it (models bring their own); with a closed one it is not used, and "
       "a note says so; a bound body has its own."},
      {"weld", member<&T::weld>(), "m", kNotNegative, false,
       "Corners of the files visual and collision that lie this close together become one; 0: none do. By default those at one place, where "
       "the file does not keep them apart, as the lips of a slit."},
      {"exact_paths", member<&T::exact_paths>(), "", kAny, false,
       "Exact geodesics when the meshes are bound; the default straightens locally, which is faster and "
       "nearly as short. Does not go with bound."},
      {"size", member<&T::size>(), "m", kPositive, false,
       "Of model closed-sheet: along the three axes, instead of its own. Its cells become about square."},
      {"position", member<&T::position>(), "m", kPlace, false,
       "Where the origin of the body's own coordinates goes; all other rest coordinates of the scene are those "
       "after placing."},
      {"rotation", member<&T::rotation>(), "rad", kTurn, false,
       "How it is turned about that origin: axis times angle."},
      {"material", SceneNested{"table"}, "", kAny, false,
       "What this body is made of, where it differs from [material]."},
  };
  return {keys};
}

template <>
SceneKeys<ModelOptions> scene_keys<ModelOptions>() {
  using T = ModelOptions;
  static const SceneKey keys[] = {
      {"visual_triangles",
       member<&T::visual_triangles>(),
       "",
       {0, 1e8, false, false},
       false,
       "Triangles of the visual mesh; the model has a choice of counts, or takes the nearest it can have. 0: "
       "its own."},
      {"collision_triangles",
       member<&T::collision_triangles>(),
       "",
       {0, 1e8, false, false},
       false,
       "Triangles of the collision mesh, one of the counts that the model offers. 0: its own."},
      {"rim_radius", member<&T::rim_radius>(), "m", kNotNegative, false,
       "Model closed-sheet: how far its rim bulges; 0 is a sharp rim."},
      {"bend",
       member<&T::bend>(),
       "rad",
       {-6.2831853, 6.2831853, false, false},
       false,
       "Bends the body about the y axis by this angle."},
      {"bumps", member<&T::bumps>(), "m", kNotNegative, false, "Height of smooth bumps of both meshes."},
      {"noise", member<&T::noise>(), "m", kNotNegative, false,
       "Length of random displacements of the visual vertices."},
      {"seed", member<&T::seed>(), "", kNotNegative, false, "Of bumps and noise."},
  };
  return {keys};
}

template <>
SceneKeys<SceneMaterial> scene_keys<SceneMaterial>() {
  using T = SceneMaterial;
  static const SceneKey keys[] = {
      {"young", member<&T::young>(), "Pa", kStiffness, false,
       "Young's modulus: resistance to stretching. Default: the model's own, 20000 for files."},
      {"poisson",
       member<&T::poisson>(),
       "",
       {0, 0.49, false, false},
       false,
       "Poisson's ratio: 0 does not narrow when stretched, 0.49 keeps its volume. Default: the model's own, "
       "0.45 for files."},
      {"density", member<&T::density>(), "kg/m3", kMassPerVolume, false,
       "Mass per volume. Default: the model's own, 1000 for files."},
      {"damping_mass", member<&T::damping_mass>(), "1/s", kNotNegative, false,
       "Rayleigh damping of motion through space; brings free bodies to rest too."},
      {"damping_stiffness", member<&T::damping_stiffness>(), "s", kNotNegative, false,
       "Rayleigh damping of deformation."},
      {"region", SceneNested{"list of tables"}, "", kAny, false,
       "Regions of another material; later ones win. A cell is of one material, that of its middle; a region without the middle of a "
       "cell is noted."},
  };
  return {keys};
}

template <>
SceneKeys<SceneMaterialRegion> scene_keys<SceneMaterialRegion>() {
  using T = SceneMaterialRegion;
  static const SceneKey keys[] = {
      {"box", SceneNested{"table"}, "", kAny, false, "The region: a box. Give exactly one of box, sphere, half_space."},
      {"sphere", SceneNested{"table"}, "", kAny, false, "The region: a ball."},
      {"half_space", SceneNested{"table"}, "", kAny, false, "The region: one side of a plane."},
      {"young", member<&T::young>(), "Pa", kStiffness, false, "Young's modulus there; as in [material] when absent."},
      {"poisson",
       member<&T::poisson>(),
       "",
       {0, 0.49, false, false},
       false,
       "Poisson's ratio there; as in [material] when absent."},
      {"density", member<&T::density>(), "kg/m3", kMassPerVolume, false,
       "Density there; as in [material] when absent."},
  };
  return {keys};
}

template <>
SceneKeys<SceneLattice> scene_keys<SceneLattice>() {
  using T = SceneLattice;
  static const SceneKey keys[] = {
      {"cells", member<&T::cells>(), "", at_least_one(1000), false,
       "Cells along the three axes, over the whole body; each body has cells of its own. With nothing given a model brings its own lattice, "
       "and bodies "
       "from files get cells that fit their thickness. A lattice that would take more memory than --memory allows is refused."},
      {"cell_size", member<&T::cell_size>(), "m", kPositive, false,
       "Edge lengths of a cell along the three axes; the body sits in the middle of the lattice."},
      {"origin", member<&T::origin>(), "m", kPlace, false,
       "Lowest corner of the lattice; goes with both cells and cell_size, which then are the whole lattice."},
      {"axes", member<&T::axes>(), "", kAny, false,
       "Three unit vectors at right angles, right-handed; goes with cells or cell_size. Default: chosen by "
       "the body; the "
       "world's with origin."},
      {"layers", member<&T::layers>(), "", at_least_one(64), false,
       "Cells across the thickness, the lattice being chosen by the body; instead of cells and cell_size."},
      {"formulation", choice<&T::formulation>(kFormulationWords), "", kAny, false,
       "Hexahedra with incompatible modes, or plain ones as in the paper, which bend far too little."},
  };
  return {keys};
}

template <>
SceneKeys<SceneCut> scene_keys<SceneCut>() {
  using T = SceneCut;
  static const SceneKey keys[] = {
      {"layers", member<&T::layers>(), "", at_least_one(64), false,
       "Rows of faces across the thickness of a cut surface."},
      {"roughness",
       member<&T::roughness>(),
       "row heights",
       {0, 0.5, false, false},
       false,
       "How far the inner vertices of a cut surface stray sideways, as a part of a row's height."},
      {"minimum_feature",
       member<&T::minimum_feature>(),
       "mean edges",
       {0.001, 0.25, false, false},
       false,
       "Nothing shorter than this fraction of the mean collision edge is cut; a path this near to a vertex goes through it."},
      {"snap",
       member<&T::snap>(),
       "edge lengths",
       {0, 0.3, false, false},
       false,
       "Decides nothing, and stands here so that scenes with it load; `minimum_feature` decides."},
      {"path_tolerance",
       member<&T::path_tolerance>(),
       "mean edges",
       {0.001, 1, false, false},
       false,
       "How far the cut may stray from the blade's path, as a fraction of the mean collision edge."},
      {"dust",
       member<&T::dust>(),
       "",
       {0, kMostDust, false, false},
       false,
       "Share of the uncut body's volume: a loose piece below it is swept up when the stroke that cut it off ends. 0 leaves every piece. Pieces of open sheets have no volume, and stay."},
      {"resistance", member<&T::resistance>(), "N/m", kNotNegative, false,
       "Force of the material on a tool's edge while it cuts, per metre of edge inside; pressed less, the edge only "
       "pushes. Blade commands don't feel it."},
  };
  return {keys};
}

template <>
SceneKeys<SceneSimulation> scene_keys<SceneSimulation>() {
  using T = SceneSimulation;
  static const SceneKey keys[] = {
      {"time_step", member<&T::time_step>(), "s", kPositive, false,
       "Time between two states; at most the duration, and 1000 s."},
      {"duration", member<&T::duration>(), "s", kNotNegative, false, "How much time is simulated."},
      {"gravity", member<&T::gravity>(), "m/s2", kAcceleration, false, "Acceleration of free fall; z is up."},
      {"tolerance", member<&T::tolerance>(), "", kPositiveFraction, false,
       "Residual at which the linear solver stops, relative to the right-hand side. Forces of a step balance to about this share of them, and "
       "closer at rest. Lower it where forces in motion must be exact, to 1e-6 for instance."},
      {"max_iterations", member<&T::max_iterations>(), "", at_least_one(1e6), false,
       "Most iterations of the linear solver in a step."},
      {"preconditioner", choice<&T::preconditioner>(kPreconditionerWords), "", kAny, false,
       "Of the conjugate gradients; adaptive takes the cheap one while it does. direct factorises the matrix "
       "in every step "
       "instead."},
      {"threads",
       member<&T::threads>(),
       "",
       {0, 1024, false, false},
       false,
       "Threads to use; 0: all cores. Results are the same."},
      {"seed", member<&T::seed>(), "", kNotNegative, false, "Of everything random."},
  };
  return {keys};
}

template <>
SceneKeys<SceneFix> scene_keys<SceneFix>() {
  static const SceneKey keys[] = {
      {"box", SceneNested{"table"}, "", kAny, false, "The region: a box. Give exactly one of box, sphere, half_space."},
      {"sphere", SceneNested{"table"}, "", kAny, false, "The region: a ball."},
      {"half_space", SceneNested{"table"}, "", kAny, false, "The region: one side of a plane."},
  };
  return {keys};
}

template <>
SceneKeys<SceneLoad> scene_keys<SceneLoad>() {
  using T = SceneLoad;
  static const SceneKey keys[] = {
      {"point", member<&T::point>(), "m", kPlace, true,
       "Where the force acts, in rest coordinates; the closest surface point counts, and one that is far away is noted."},
      {"radius", member<&T::radius>(), "m", kNotNegative, false,
       "Vertices of the collision mesh within this distance of the point, at rest, share the force evenly. The closest place of the mesh takes it "
       "all when there are none."},
      {"force", member<&T::force>(), "N", kForce, true, "The whole force, in world directions."},
      {"from", member<&T::from>(), "s", kNotNegative, false, "When the force sets in."},
      {"until", member<&T::until>(), "s", kPositive, false, "When the force ends; it stays when absent."},
  };
  return {keys};
}

template <>
SceneKeys<SceneBond> scene_keys<SceneBond>() {
  using T = SceneBond;
  static const SceneKey keys[] = {
      {"lower", member<&T::lower>(), "", kAny, true, "Name of a body."},
      {"upper", member<&T::upper>(), "", kAny, true, "Name of another one, whose skin is sampled."},
      {"strength", member<&T::strength>(), "Pa", kPositive, false,
       "Traction that bonds bear against opening. At most what the cells resolve; a note says so. The toughness stays."},
      {"shear_strength", member<&T::shear_strength>(), "Pa", kPositive, false,
       "The same against sliding; as strength when absent."},
      {"toughness", member<&T::toughness>(), "J/m2", kPositive, false, "Energy that tearing them open takes."},
      {"shear_toughness", member<&T::shear_toughness>(), "J/m2", kPositive, false,
       "Energy that tearing them by sliding takes; as toughness when absent."},
      {"stiffness", member<&T::stiffness>(), "Pa/m", kPositive, false,
       "Traction over distance while nothing tears; by the softer body's Young's modulus over its thickness when absent. At least twice strength^2 / toughness: a lower one is raised, and a note says so. Below a quarter of that it is refused."},
      {"spacing", member<&T::spacing>(), "m", kPositive, false,
       "From point to point; four to the edge of a cell when absent. One that takes more than 500,000 points is refused."},
      {"reach", member<&T::reach>(), "m", kPositive, false,
       "How far skins may be from each other; a tenth of the thinner body when absent."},
  };
  return {keys};
}

template <>
SceneKeys<SceneBodyMaterial> scene_keys<SceneBodyMaterial>() {
  using T = SceneBodyMaterial;
  static const SceneKey keys[] = {
      {"young", member<&T::young>(), "Pa", kStiffness, false,
       "Young's modulus of this body; as in [material] when absent."},
      {"poisson",
       member<&T::poisson>(),
       "",
       {0, 0.49, false, false},
       false,
       "Poisson's ratio of this body; as in [material] when absent."},
      {"density", member<&T::density>(), "kg/m3", kMassPerVolume, false,
       "Density of this body; as in [material] when absent."},
      {"prestretch", member<&T::prestretch>(), "", SceneRange{0.5, 2, false, false}, false,
       "Lengths at rest over natural ones along the axes of the body's cells: [1.1, 1.1, 1] is pulled along two, and gapes where it is cut."},
  };
  return {keys};
}

template <>
SceneKeys<SceneContact> scene_keys<SceneContact>() {
  using T = SceneContact;
  static const SceneKey keys[] = {
      {"enabled", member<&T::enabled>(), "", kAny, false,
       "Whether things touch. Default: true when the scene has a [contact], obstacles, tools or several bodies; "
       "otherwise everything passes through everything. False in a scene with obstacles or tools is noted."},
      {"self", member<&T::self>(), "", kAny, false,
       "Whether bodies touch themselves, the two lips of a cut included, and each other."},
      {"friction",
       member<&T::friction>(),
       "",
       {0, 10, false, false},
       false,
       "Coulomb's coefficient of everything that has none of its own."},
      {"stiffness",
       member<&T::stiffness>(),
       "",
       {0.1, 1e4, false, false},
       false,
       "Of contacts, in units of the local inertia and elasticity. More: they overlap less and take longer."},
      {"margin",
       member<&T::margin>(),
       "half thicknesses",
       {0, 10, false, false},
       false,
       "Things nearer than this are watched; what moves fast is watched from farther off anyway."},
      {"push_speed", member<&T::push_speed>(), "m/s", kPositive, false,
       "At most this fast things that overlap at the start are pushed apart. What is free keeps that speed and flies off with it: place things apart, or lower it."},
      {"passes", member<&T::passes>(), "", at_least_one(64), false,
       "Linear solves of a step while contacts open and close. Where they come to no end, three times as many at most."},
      {"substeps", member<&T::substeps>(), "", at_least_one(1000), false,
       "Parts that a step is divided into at most, when a tool, an obstacle or the body moves fast."},
  };
  return {keys};
}

template <>
SceneKeys<SceneObstacle> scene_keys<SceneObstacle>() {
  using T = SceneObstacle;
  static const SceneKey keys[] = {
      {"name", member<&T::name>(), "", kAny, false,
       "For messages; `tray` is a scale in `kerf view`. Default: number and shape."},
      {"shape", choice<&T::shape>(kShapeWords), "", kAny, true,
       "In its own axes: plane: z = 0, outside above. sphere: about the origin. capsule: along z. box: about the "
       "origin. mesh: a surface from a file or a generated one, outside where its triangles run counter-clockwise."},
      {"position", member<&T::position>(), "m", kPlace, false, "Where its origin is."},
      {"rotation", member<&T::rotation>(), "rad", kTurn, false, "How it is turned: axis times angle."},
      {"radius", member<&T::radius>(), "m", kPositive, false, "Of a sphere or a capsule."},
      {"length", member<&T::length>(), "m", kNotNegative, false,
       "Of a capsule, between the middles of its round ends."},
      {"size", member<&T::size>(), "m", kPositive, false, "Of a box: its whole edges."},
      {"mesh", SceneFilePath{member<&T::mesh>()}, "", kAny, false,
       "Mesh file of shape mesh (OBJ, PLY, STL, OFF), relative to the scene; closed or open."},
      {"model", member<&T::model>(), "", kAny, false,
       "Generated surface of shape mesh: ball (168 triangles, radius 1 m) or plateau (72 x 60 mm, dished)."},
      {"scale", member<&T::scale>(), "m per unit", kPositive, false,
       "Metres per unit of the mesh file, or factor on the size of the generated surface."},
      {"friction",
       member<&T::friction>(),
       "",
       {0, 10, false, false},
       false,
       "Coulomb's coefficient; that of [contact] when absent."},
      {"moves", SceneNested{"list of tables"}, "", kAny, false,
       "Where it is when; straight and even in between, first from its place."},
  };
  return {keys};
}

template <>
SceneKeys<ScenePose> scene_keys<ScenePose>() {
  using T = ScenePose;
  static const SceneKey keys[] = {
      {"time", member<&T::time>(), "s", kNotNegative, true,
       "When; later than the pose before. In a command: after its at."},
      {"position", member<&T::position>(), "m", kPlace, true, "Where the origin is."},
      {"rotation", member<&T::rotation>(), "rad", kTurn, false,
       "How it is turned: axis times angle. Default: as in the pose before."},
  };
  return {keys};
}

template <>
SceneKeys<SceneRigidTool> scene_keys<SceneRigidTool>() {
  using T = SceneRigidTool;
  static const SceneKey keys[] = {
      {"id", member<&T::id>(), "", kAny, true, "A name for commands."},
      {"kind", choice<&T::kind>(kToolKindWords), "", kAny, true,
       "In its own axes the tip is the origin and the shaft leads up along z; hooks, jaws and edges lie in the plane "
       "y = 0. probe: a rod with a hook. grasper: two jaws. scalpel: an edge that cuts, back and flanks that press. "
       "scissors: two blades whose closing line cuts. sphere: a ball about the origin. mesh: a surface from a file. "
       "shaver: a rod with a round end, which presses while the page's shaver smooths."},
      {"position", member<&T::position>(), "m", kPlace, false, "Where its origin is at the start."},
      {"rotation", member<&T::rotation>(), "rad", kTurn, false, "How it is turned at the start: axis times angle."},
      {"length", member<&T::length>(), "m", kPositive, false, "Of the shaft. Default: 0.12."},
      {"radius", member<&T::radius>(), "m", kPositive, false,
       "Of the shaft, or of the ball. Default: 0.0015; ball 0.005."},
      {"tip", member<&T::tip>(), "m", kPositive, false,
       "Length of the hook of a probe (default 0.004), of the jaws of a grasper (0.012), of the edge of a scalpel "
       "(0.025), of the blades of scissors (0.02)."},
      {"width", member<&T::width>(), "m", kPositive, false,
       "From the edge of a blade to its back, or across a jaw. Default: 0.006; grasper 0.004."},
      {"thickness", member<&T::thickness>(), "m", kPositive, false, "Of a blade. Default: 0.0006."},
      {"opening",
       member<&T::opening>(),
       "rad",
       {0, 1.5, true, false},
       false,
       "Angle between open jaws or blades; they start open."},
      {"sharp", member<&T::sharp>(), "", kAny, false, "Whether the edge of a scalpel or of scissors cuts."},
      {"mesh", SceneFilePath{member<&T::mesh>()}, "", kAny, false,
       "Mesh file of kind mesh, or of a probe instead of the generated hook; relative to the scene."},
      {"scale", member<&T::scale>(), "m per unit", kPositive, false, "Metres per unit of the mesh file."},
      {"friction",
       member<&T::friction>(),
       "",
       {0, 10, false, false},
       false,
       "Coulomb's coefficient; that of [contact] when absent."},
      {"mass", member<&T::mass>(), "kg", kPositive, false, "Of what follows the pose."},
      {"stiffness", member<&T::stiffness>(), "N/m", kPositive, false, "Of the coupling between the tool and its pose."},
      {"damping", member<&T::damping>(), "N s/m", kNotNegative, false, "Of the coupling. Default: critical."},
      {"turning_stiffness", member<&T::turning_stiffness>(), "N m/rad", kPositive, false,
       "Of the coupling, against turns. Default: stiffness times the square of 0.02 m; 0.8 with the default stiffness."},
      {"turning_damping", member<&T::turning_damping>(), "N m s/rad", kNotNegative, false,
       "Of the coupling. Default: critical."},
      {"max_force", member<&T::max_force>(), "N", kNotNegative, false,
       "The coupling pulls no harder; 0: as hard as it likes."},
      {"max_speed", member<&T::max_speed>(), "m/s", kPositive, false, "Poses that jump are followed at this speed."},
  };
  return {keys};
}

template <>
SceneKeys<SceneToolMotion> scene_keys<SceneToolMotion>() {
  using T = SceneToolMotion;
  static const SceneKey keys[] = {
      {"id", member<&T::id>(), "", kAny, true, "The tool that moves."},
      {"poses", SceneNested{"list of tables"}, "", kAny, true,
       "Where its pose goes: straight and even from where it is now. A later command breaks off one that still leads the tool, and a note says so."},
  };
  return {keys};
}

template <>
SceneKeys<SceneJaws> scene_keys<SceneJaws>() {
  using T = SceneJaws;
  static const SceneKey keys[] = {
      {"id", member<&T::id>(), "", kAny, true, "A grasper or scissors."},
      {"over", member<&T::over>(), "s", kNotNegative, false, "How long it takes."},
  };
  return {keys};
}

template <>
SceneKeys<SceneOutput> scene_keys<SceneOutput>() {
  using T = SceneOutput;
  static const SceneKey keys[] = {
      {"frames_per_second",
       member<&T::frames_per_second>(),
       "1/s",
       {0, 10000, true, false},
       false,
       "Frames of the animation and of the node positions per simulated second."},
      {"meshes", SceneWords{kMeshWords, member<&T::meshes>()}, "", kAny, false,
       "Final meshes to write: visual.obj and visual_rest.obj, collision.obj, hexahedra.vtu."},
      {"animation", member<&T::animation>(), "", kAny, false, "Write the whole motion to a .glb file."},
      {"positions", member<&T::positions>(), "", kAny, false, "Write the node positions of every frame."},
      {"picture", member<&T::picture>(), "", kAny, false, "Draw a picture."},
      {"picture_at", member<&T::picture_at>(), "s", kNotNegative, false,
       "When the picture is taken; the end of the run when absent."},
      {"picture_size",
       member<&T::picture_size>(),
       "pixels",
       {16, 8192, false, false},
       false,
       "Width and height of the picture."},
      {"wireframe", member<&T::wireframe>(), "", kAny, false, "Draw the edges of the meshes over the picture."},
      {"camera", SceneNested{"table"}, "", kAny, false,
       "Where the picture is taken from; distance is fitted to the body."},
  };
  return {keys};
}

template <>
SceneKeys<SceneCamera> scene_keys<SceneCamera>() {
  using T = SceneCamera;
  static const SceneKey keys[] = {
      {"direction", member<&T::direction>(), "", kAny, false, "From the body towards the eye; any length."},
      {"up", member<&T::up>(), "", kAny, false, "Which way is up in the picture; any length."},
      {"zoom", member<&T::zoom>(), "", {0.05, 50, false, false}, false, "More than 1 comes closer to the body."},
      {"field_of_view",
       member<&T::field_of_view>(),
       "rad",
       {0.02, 2.5, false, false},
       false,
       "Vertical opening of the camera."},
  };
  return {keys};
}

template <>
SceneKeys<SceneCommand> scene_keys<SceneCommand>() {
  using T = SceneCommand;
  static const SceneKey keys[] = {
      {"at", member<&T::at>(), "s", kNotNegative, true, "When the command is given."},
      {"type", SceneNested{"word"}, "", kAny, true,
       "blade, punch, shave, remove, grasp, move, release, fix, unfix, undo, redo, tool, close or open; each has keys of its own."},
  };
  return {keys};
}

template <>
SceneKeys<SceneBlade> scene_keys<SceneBlade>() {
  using T = SceneBlade;
  static const SceneKey keys[] = {
      {"tool", choice<&T::tool>(kToolWords), "", kAny, false,
       "scalpel: a sharp edge from base to tip. scissors: the closing line between two jaws. line: a ray "
       "from base "
       "through tip and on, as in a stroke drawn on the screen."},
      {"frame", choice<&T::frame>(kFrameWords), "", kAny, false,
       "Coordinates of the poses: world, or rest, which follows the body's deformation."},
      {"poses", SceneNested{"list of tables"}, "", kAny, true,
       "Where the edge is when; it moves in straight lines between at least two poses."},
      {"through", member<&T::through>(), "", kAny, false,
       "Cut every layer that the edge meets instead of the first, counted from its base. Pressed on its length through a tube or a vault "
       "the edge meets two: where it goes in and where it comes out. What it goes through without cutting is noted, but for a line."},
  };
  return {keys};
}

template <>
SceneKeys<SceneBladePose> scene_keys<SceneBladePose>() {
  using T = SceneBladePose;
  static const SceneKey keys[] = {
      {"time", member<&T::time>(), "s", kNotNegative, true,
       "Seconds after the command's at; later than the pose before."},
      {"base", member<&T::base>(), "m", kPlace, true, "One end of the edge."},
      {"tip", member<&T::tip>(), "m", kPlace, true, "The other end of the edge."},
  };
  return {keys};
}

template <>
SceneKeys<ScenePunch> scene_keys<ScenePunch>() {
  using T = ScenePunch;
  static const SceneKey keys[] = {
      {"shape", choice<&T::shape>(kPunchWords), "", kAny, false,
       "Outline. d: half a disc, its flat side through the point and along the axis times across, its round side towards across."},
      {"point", member<&T::point>(), "m", kPlace, true,
       "Middle of the circle or of the D's flat side; where (0, 0) of a polygon is. A punch that cuts nothing is noted."},
      {"axis", member<&T::axis>(), "", kAny, false, "Along which it is pressed; any length."},
      {"across", member<&T::across>(), "", kAny, false,
       "Where the outline's x points; its part along the axis does not count, and it must have another: give it with an axis along x."},
      {"frame", choice<&T::frame>(kFrameWords), "", kAny, false, "Coordinates of the punch."},
      {"radius", member<&T::radius>(), "m", kPositive, false, "Of a circle or a D, which need it."},
      {"points", SceneNested{"list of [x, y]"}, "m", kAny, false,
       "Corners of a polygon, which needs them; its sides must not cross."},
      {"reach", member<&T::reach>(), "m", kPositive, false,
       "How far along the axis to both sides of the point it cuts; by default through every layer."},
      {"roughness", member<&T::roughness>(), "m", kNotNegative, false,
       "How far the cut surface is jagged at most, with the seed of [simulation]; less at sharp corners and where the loose part is thin."},
      {"take", member<&T::take>(), "", kAny, false, "Take away at once what comes loose, unless that is all there is."},
  };
  return {keys};
}

template <>
SceneKeys<SceneShave> scene_keys<SceneShave>() {
  using T = SceneShave;
  static const SceneKey keys[] = {
      {"frame", choice<&T::frame>(kFrameWords), "", kAny, false, "Coordinates of the poses."},
      {"poses", SceneNested{"list of tables"}, "", kAny, true,
       "Where the ends of its cutting window are when; it moves in straight lines between at least two poses."},
      {"radius", member<&T::radius>(), "m", kPositive, true, "Of the cutting window."},
      {"smoothing", member<&T::smoothing>(), "1/s", kNotNegative, false,
       "How fast bumps of a cut surface go where it touches."},
      {"removal", member<&T::removal>(), "m/s", kNotNegative, false,
       "How fast a smooth cut surface moves back where it touches; 0: only bumps go."},
  };
  return {keys};
}

template <>
SceneKeys<SceneRemove> scene_keys<SceneRemove>() {
  using T = SceneRemove;
  static const SceneKey keys[] = {
      {"grasp", member<&T::grasp>(), "", kAny, false, "The piece that this grasp holds. Give it or one region."},
      {"frame", choice<&T::frame>(kFrameWords), "", kAny, false, "Coordinates of the region."},
      {"box", SceneNested{"table"}, "", kAny, false,
       "Every piece that reaches into this box, but the heaviest piece and those that [[fix]] holds. Taking nothing, or all that there was of a body, is noted."},
      {"sphere", SceneNested{"table"}, "", kAny, false, "The same with a ball."},
      {"half_space", SceneNested{"table"}, "", kAny, false, "The same with one side of a plane."},
  };
  return {keys};
}

template <>
SceneKeys<SceneGrasp> scene_keys<SceneGrasp>() {
  using T = SceneGrasp;
  static const SceneKey keys[] = {
      {"id", member<&T::id>(), "", kAny, true, "A name for move and release."},
      {"point", member<&T::point>(), "m", kPlace, true,
       "What is taken hold of: the closest surface point; one that is far away is noted."},
      {"frame", choice<&T::frame>(kFrameWords), "", kAny, false, "Coordinates of the point."},
      {"radius", member<&T::radius>(), "m", kNotNegative, false, "Everything this near to the point is held too."},
      {"stiffness", member<&T::stiffness>(), "N/m", kPositive, false,
       "Of the whole grasp; by default 2 times young times the cell size per held point, which the solver "
       "likes."},
  };
  return {keys};
}

template <>
SceneKeys<SceneMove> scene_keys<SceneMove>() {
  using T = SceneMove;
  static const SceneKey keys[] = {
      {"id", member<&T::id>(), "", kAny, true, "The grasp that moves."},
      {"by", member<&T::by>(), "m", kPlace, false, "How far, in world directions. Give by or to."},
      {"to", member<&T::to>(), "m", kPlace, false, "Where the held point goes, in world coordinates."},
      {"over", member<&T::over>(), "s", kNotNegative, false, "How long the motion takes; 0: at once."},
  };
  return {keys};
}

template <>
SceneKeys<SceneRelease> scene_keys<SceneRelease>() {
  static const SceneKey keys[] = {
      {"id", member<&SceneRelease::id>(), "", kAny, true, "The grasp that lets go."},
  };
  return {keys};
}

template <>
SceneKeys<SceneFixCommand> scene_keys<SceneFixCommand>() {
  static const SceneKey keys[] = {
      {"box", SceneNested{"table"}, "", kAny, false, "What is held where it is now: a box. Give exactly one region."},
      {"sphere", SceneNested{"table"}, "", kAny, false, "What is held where it is now: a ball."},
      {"half_space", SceneNested{"table"}, "", kAny, false, "What is held where it is now: one side of a plane."},
  };
  return {keys};
}

template <>
SceneKeys<SceneUnfix> scene_keys<SceneUnfix>() {
  static const SceneKey keys[] = {
      {"box", SceneNested{"table"}, "", kAny, false, "What is let free: a box. Give exactly one region."},
      {"sphere", SceneNested{"table"}, "", kAny, false, "What is let free: a ball."},
      {"half_space", SceneNested{"table"}, "", kAny, false, "What is let free: one side of a plane."},
  };
  return {keys};
}

template <>
SceneKeys<SceneUndo> scene_keys<SceneUndo>() {
  static const SceneKey keys[] = {
      {"count", member<&SceneUndo::count>(), "", at_least_one(1e6), false,
       "How many strokes are taken back; with none left the run goes on and notes it."},
  };
  return {keys};
}

template <>
SceneKeys<SceneRedo> scene_keys<SceneRedo>() {
  static const SceneKey keys[] = {
      {"count", member<&SceneRedo::count>(), "", at_least_one(1e6), false,
       "How many strokes are done again; with none left the run goes on and notes it."},
  };
  return {keys};
}

template <>
SceneKeys<SceneArthroscope> scene_keys<SceneArthroscope>() {
  using T = SceneArthroscope;
  static const SceneKey keys[] = {
      {"entry", member<&T::entry>(), "m", kPlace, true, "Where it goes through the skin; it turns about this point."},
      {"target", member<&T::target>(), "m", kPlace, true, "What it looks at to begin with."},
      {"angle", member<&T::angle>(), "rad", SceneRange{0, 1.3}, false, "Between its shaft and its view."},
  };
  return {keys};
}

SceneKeys<SceneRegion> scene_lesion_keys() {
  static const SceneKey keys[] = {
      {"box", SceneNested{"table"}, "", kAny, false,
       "What should be taken out: a box. Give exactly one of box, sphere, half_space."},
      {"sphere", SceneNested{"table"}, "", kAny, false, "What should be taken out: a ball."},
      {"half_space", SceneNested{"table"}, "", kAny, false, "What should be taken out: one side of a plane."},
  };
  return {keys};
}

SceneKeys<SceneRegion> scene_box_keys() {
  static const SceneKey keys[] = {
      {"min", member<&SceneRegion::min>(), "m", kAny, true, "Lowest corner."},
      {"max", member<&SceneRegion::max>(), "m", kAny, true, "Highest corner."},
  };
  return {keys};
}

SceneKeys<SceneRegion> scene_sphere_keys() {
  static const SceneKey keys[] = {
      {"center", member<&SceneRegion::center>(), "m", kAny, true, "Middle of the ball."},
      {"radius", member<&SceneRegion::radius>(), "m", kPositive, true, "Radius of the ball."},
  };
  return {keys};
}

SceneKeys<SceneRegion> scene_half_space_keys() {
  static const SceneKey keys[] = {
      {"point", member<&SceneRegion::point>(), "m", kPlace, true, "A point of the plane."},
      {"normal", member<&SceneRegion::normal>(), "", kAny, true, "Points into the region; any length."},
  };
  return {keys};
}

}  // namespace kerf
