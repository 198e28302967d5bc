// The messages between page and engine, version 7 (docs/protocol.md): encoding of everything the engine says, checked
// decoding of everything a page says. Bytes in, bytes out: no sockets, no state. A page is not trusted; whatever it
// sends is decoded or refused with a reason, and decoded messages keep every promise of the page.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"

namespace kerf::protocol {

inline constexpr std::uint16_t kVersion = 7;
inline constexpr std::size_t kHeaderBytes = 8;
/// Most bytes of a message from a page, header included; uploads have chunks of their own size.
inline constexpr std::size_t kMaxPageBytes = std::size_t{64} << 10;
inline constexpr std::size_t kMaxUploadBytes = (std::size_t{1} << 20) + 4096;  ///< a chunk of 1 MiB, name and header
/// A dead copy's node numbers.
inline constexpr std::uint32_t kNoNode = 0xffffffffu;

using Bytes = std::vector<std::byte>;
/// One encoded message, shared by all pages that it goes to.
using Message = std::shared_ptr<const Bytes>;

enum class Type : std::uint16_t {
  kHello = 1,
  kBody = 2,
  kPatch = 3,
  kFrame = 4,
  kHit = 5,
  kStats = 6,
  kCutReport = 7,
  kRole = 8,
  kError = 9,
  kOverlay = 10,
  kFile = 11,
  kLoading = 12,
  kThings = 13,
  kScore = 14,
  kFixed = 15,
  kMasses = 16,
  kPacked = 32,  ///< the server's own: another message, deflated
  kPageHello = 64,
  kAck = 65,
  kTool = 66,
  kRay = 67,
  kCommand = 68,
  kClaim = 69,
  kUpload = 70,
  kDevice = 71,
};

// --- Engine to page ------------------------------------------------------------------------------------------------

using Normal = std::array<std::int16_t, 4>;  ///< normalised; w is 0
using Triangle = std::array<std::uint32_t, 3>;
using Copy = std::array<std::uint32_t, 8>;  ///< node numbers; kNoNode eight times: dead
using Cell = std::array<std::int16_t, 4>;   ///< index among the cells of a frame, and the frame's number

/// Flag of Hello: this page may only watch.
inline constexpr std::uint32_t kOnlyWatches = 1;
struct Hello {
  std::uint64_t session = 0;
  std::uint32_t client = 0, flags = 0;  ///< flags: kOnlyWatches
  float tick = 60;                      ///< Hz
  std::string_view name, json;
};
/// Where the cells of one of the bodies lie, metres.
struct CellFrame {
  Vec3f origin;
  float unused = 0;
  std::array<Vec3f, 3> axes{};  ///< columns
  Vec3f cell;                   ///< edge lengths
};
struct Body {
  std::uint32_t body = 0, version = 0;
  std::span<const CellFrame> frames;
  std::span<const Vec3f> rest;
  std::span<const Normal> normal;
  std::span<const std::uint32_t> copy;
  std::span<const Triangle> skin, wall;
  std::span<const Copy> copies;
  std::span<const Cell> cells;
  std::span<const Vec3f> nodes;  ///< as they are shown
  std::span<const std::uint32_t>
      fading;  ///< render vertices drawn beside where their copies put them, ascending: all there are
  std::span<const Vec3f> offset;  ///< one each, metres
};
struct Totals {
  std::uint32_t nv = 0, ns = 0, nw = 0, nc = 0, nn = 0;
};
struct Patch {
  std::uint32_t body = 0, from = 0, to = 0, input = 0;
  Totals totals;  ///< new ones
  // ids: changed old records, ascending; values: those of the ids, then appended ones.
  std::span<const std::uint32_t> vertex_ids;
  std::span<const Vec3f> rest;
  std::span<const Normal> normal;
  std::span<const std::uint32_t> copy;
  std::span<const std::uint32_t> skin_ids;
  std::span<const Triangle> skin;
  std::span<const std::uint32_t> wall_ids;
  std::span<const Triangle> wall;
  std::span<const std::uint32_t> copy_ids;
  std::span<const Copy> copies;
  std::span<const Cell> cells;
  std::span<const Vec3f> nodes;
  std::span<const std::uint32_t> fading;  ///< as in Body
  std::span<const Vec3f> offset;
};
inline constexpr std::uint32_t kPlaying = 1, kInStroke = 2;
struct Grasp {
  Vec3f held, target;
};
/// Where a thing is: x y z, a unit quaternion x y z w, and how far its jaws are open (0 to 1; without jaws 1).
using Place = std::array<float, 8>;
/// Of a tool: the pose that it follows (x y z, x y z w), force (N) and torque (N m) of the body on it, 0.
using ToolForces = std::array<float, 14>;
enum class ContactWith : std::uint32_t { kObstacle = 0, kTool = 1, kBody = 2 };
inline constexpr std::uint32_t kSliding = 16;  ///< added to a contact's partner
struct ContactPoint {
  Vec3f point, normal, force;
  float gap = 0;
};
struct Frame {
  std::uint32_t body = 0, seq = 0, version = 0, input = 0;
  double time = 0;
  float step_ms = 0, speed = 1;
  std::uint32_t flags = 0, undo_depth = 0, redo_depth = 0;
  std::span<const Vec3f> nodes;
  std::span<const Grasp> grasps;
  std::span<const std::uint32_t> held;  ///< one each: a copy of what is held
  std::span<const Place> places;        ///< of the things of Things, in their order
  std::span<const ToolForces> tools;
  std::span<const ContactPoint> contacts;   ///< only when a page has asked for them
  std::span<const std::uint32_t> partners;  ///< one each: ContactWith, kSliding
  std::uint32_t touching = 0;               ///< all contacts that press
  float press = 0;                          ///< N, the sum of their normal forces
  std::span<const std::uint32_t> fading;    ///< as in Body
  std::span<const Vec3f> offset;
};
struct Hit {
  std::uint32_t input = 0;
  std::int32_t triangle = -1;
  double t = 0;
  Vec3 point;
  Vec3f normal;
  float beside = 0;              ///< metres by which the ray passes the body; only where the query allows it
  std::uint32_t copy = kNoNode;  ///< of what was hit; kNoNode: nothing
};
struct Counts {
  std::uint32_t visual_vertices = 0, visual_triangles = 0, collision_vertices = 0, collision_triangles = 0, nodes = 0,
                hexahedra = 0;
};
struct Stats {
  float step_ms = 0, step_ms_99 = 0, mechanics_ms = 0, steps_per_second = 0;
  std::uint32_t iterations = 0;
  float residual = 0;
  Counts counts;
  std::uint32_t pieces = 0, dropped = 0, bad = 0, clients = 0;
};
enum class Outcome : std::uint32_t { kCut = 0, kNothingMet = 1, kRefused = 2, kUndone = 3, kRedone = 4 };
enum class Invariants : std::uint32_t { kHold = 0, kBroken = 1, kNotChecked = 2 };
struct CutReport {
  std::uint32_t input = 0;
  Outcome outcome = Outcome::kCut;
  std::uint32_t pieces = 0, triangles = 0;
  float cut_and_binding_ms = 0, embedding_ms = 0, cut_surface_ms = 0, total_ms = 0;
  Counts counts;
  Invariants invariants = Invariants::kHold;
  std::string_view text;
};
struct Role {
  std::uint32_t holder = 0, held = 0, clients = 0;
};
enum class ErrorCode : std::uint32_t {
  kBadMessage = 1,
  kBadArgument = 2,
  kNotAllowed = 3,
  kFailed = 4,
  kBodyChanged = 5
};
struct ErrorMessage {
  std::uint32_t input = 0;
  ErrorCode code = ErrorCode::kFailed;
  std::string_view text;
};
using Pair = std::array<std::uint32_t, 2>;
struct Overlay {
  std::uint32_t body = 0, version = 0;
  std::span<const Vec3f> rest;
  std::span<const std::uint32_t> copy;
  std::span<const Triangle> triangles;
  std::span<const Pair> bound;  ///< render vertices of bound edges
  std::span<const Pair> links;  ///< collision vertex, render vertex
  std::span<const Pair> feet;   ///< render vertex of the skin, what it is bound to: 0 a vertex, 1 an edge, 2 a triangle
  std::span<const Vec3f> foot_rest;  ///< where on the collision mesh, at rest
};
struct File {
  std::uint32_t request = 0;
  std::string_view name;
  std::string_view bytes;
};

/// Obstacles and tools of the scene: parts of rigid things, in the axes of their thing.
struct Things {
  std::uint32_t body = 0;
  std::string_view json;
  std::span<const Vec3f> positions;
  std::span<const Triangle> triangles;  ///< corners counted from the part's first
};
/// How the operation stands, in scenes with a lesion.
struct Score {
  float lesion_volume = 0;    ///< m^3 at the start
  float lesion_removed = 0;   ///< share, 0 to 1
  float healthy_removed = 0;  ///< m^3
  float healthy_share = 0;
  float roughness = 0;      ///< metres
  float largest_force = 0;  ///< N
  float time = 0;           ///< s, simulated
  std::uint32_t loose_pieces = 0;
};
/// What supports hold.
struct Fixed {
  std::uint32_t body = 0;
  std::span<const std::uint32_t> nodes;  ///< ascending
  std::span<const std::uint32_t>
      vertices;  ///< render vertices in held material whose nodes are not all fixed, ascending
};
/// What the pieces weigh, kg.
struct Masses {
  std::uint32_t body = 0, version = 0;
  float uncut = 0;  ///< all of it, as it was uncut
  std::span<const float> mass;
  std::span<const std::uint32_t> copy;  ///< of each piece: one of its copies
};
enum class LoadState : std::uint32_t { kUnderWay = 0, kShown = 1, kFailed = 2, kStopped = 3 };
/// How far the scene is that comes next.
struct Loading {
  std::uint32_t input = 0;  ///< of the command that asked for it
  LoadState state = LoadState::kUnderWay;
  float fraction = 0;  ///< of the stage
  std::string_view stage;
};

/// Numbers that are not finite are sent as 0; arrays of one message that belong together must have fitting lengths
/// (asserted). Cost: one pass over the arrays.
Bytes encode(const Hello& message);
Bytes encode(const Body& message);
Bytes encode(const Patch& message);
Bytes encode(const Frame& message);
Bytes encode(const Hit& message);
Bytes encode(const Stats& message);
Bytes encode(const CutReport& message);
Bytes encode(const Role& message);
Bytes encode(const ErrorMessage& message);
Bytes encode(const Overlay& message);
Bytes encode(const File& message);
Bytes encode(const Loading& message);
Bytes encode(const Things& message);
Bytes encode(const Score& message);
Bytes encode(const Fixed& message);
Bytes encode(const Masses& message);

// --- Page to engine ------------------------------------------------------------------------------------------------

struct PageHello {
  std::uint32_t protocol = 0;
  std::uint64_t session = 0;
  std::uint32_t body = 0, version = 0;
};
struct Ack {
  std::uint32_t seq = 0;
};
enum class Tool : std::uint32_t {
  kScalpel = 0,
  kGrasp = 1,
  kFix = 2,
  kRelease = 3,
  kLine = 4,
  kPunch = 5,
  kScissors = 6,
  kShaver = 7,
  kSuction = 8,
  kTake = 9,
  kProbe = 10,
};
enum class Phase : std::uint32_t { kDown = 0, kMove = 1, kUp = 2, kCancel = 3 };
inline constexpr std::uint32_t kShift = 1, kControl = 2, kAlt = 4, kMeta = 8;
/// A view ray in world coordinates, metres; the direction is a unit vector.
struct ViewRay {
  Vec3 origin, direction;
};
struct ToolSample {
  double time_ms = 0;
  ViewRay ray;
  float pressure = 0;
};
struct ToolInput {
  std::uint32_t input = 0;
  Tool tool = Tool::kScalpel;
  Phase phase = Phase::kDown;
  std::uint32_t modifiers = 0;
  /// Metres: radius of punch, shaver and suction, length of the scissors' blades; 0: one that fits the body. Scalpel and straight cut: the
  /// reach at the rim, in parts of the distance from the eye.
  float size = 0;
  std::vector<ToolSample> samples;
};
struct RayQuery {
  std::uint32_t input = 0;
  float near = 0;  ///< metres by which a ray may pass the body and still hit
  ViewRay ray;
};
enum class CommandCode : std::uint32_t {
  kPlay = 1,
  kPause = 2,
  kStep = 3,
  kSpeed = 4,
  kReset = 5,
  kUndo = 6,
  kRedo = 7,
  kScene = 8,
  kGravity = 9,
  kMaterial = 10,
  kExport = 11,
  kRecording = 12,
  kOverlay = 13,
  kLoadUpload = 14,
  kFixAll = 15,
  kStopLoading = 16,
  kUnit = 17,
  kContacts = 18,
};
struct Command {
  std::uint32_t input = 0;
  CommandCode code = CommandCode::kPlay;
  std::array<double, 4> value{};
  std::string text;
};
struct Claim {
  bool take = false;
};
enum class UploadPart : std::uint32_t { kVisual = 0, kCollision = 1, kScene = 2 };
struct Upload {
  std::uint32_t upload = 0;
  UploadPart part = UploadPart::kVisual;
  std::uint32_t offset = 0, total = 0;
  std::string name;
  std::string bytes;
};
/// The pose that a tool of the scene shall follow.
struct Device {
  std::uint32_t input = 0, tool = 0;
  Vec3 position, rotation;  ///< metres; axis times angle, radians
  double jaws = 1;          ///< 1 open, 0 closed
};
using PageMessage = std::variant<PageHello, Ack, ToolInput, RayQuery, Command, Claim, Upload, Device>;

/// Coordinates of a view ray reach this far from the world's origin at most, metres: beyond it doubles no longer resolve
/// a body.
inline constexpr double kFarthest = 1e6;

/// Decodes a message of a page. Refused: a header that lies, a length or count that does not fit, unknown types, tools,
/// phases, codes and parts, numbers that are not finite or out of range, directions without length, texts that are
/// not UTF-8. Directions come out as unit vectors.
Result<PageMessage> decode_page_message(std::span<const std::byte> bytes);

/// The `input` field of a message that could not be decoded, as far as there is one; else 0.
std::uint32_t input_of(std::span<const std::byte> bytes);

}  // namespace kerf::protocol
