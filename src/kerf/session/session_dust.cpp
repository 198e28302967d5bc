// Dust: loose pieces that a stroke has left and that nobody could want. They are swept up when it ends, in its undo step.
#include <fmt/format.h>

#include <algorithm>

#include "kerf/scene/scene_shapes.h"
#include "kerf/session/session_impl.h"

namespace kerf {
namespace {

/// Strokes whose dust is noted one by one.
constexpr int kMostDustNotes = 20;

}  // namespace

std::vector<std::uint8_t> Session::Impl::dust_of_stroke(RemovalReport& report) {
  const StrokeRecord& record = state.strokes.back();
  const CollisionMesh& mesh = state.body.complex.collision;
  if (!bonds.empty()) return {};
  if (!(scene.cut.dust > 0) || record.after.pieces <= record.before.pieces) return {};
  const double most = *std::max_element(uncut.volume.begin(), uncut.volume.end());
  std::vector<SmallPiece> small =
      small_pieces(state.body.complex, changed_triangles(state.body.complex, state.stroke->start),
                   scene.cut.dust * most, cut_scratch);
  std::erase_if(small, [&](const SmallPiece& piece) { return !is_dust(piece); });
  if (small.empty()) return {};

  // What hardly anything is left of keeps its heaviest piece.
  const Pieces pieces = collision_pieces(mesh);
  const std::vector<double> masses = masses_of(pieces);
  std::vector<std::int32_t> heaviest(uncut.volume.size(), -1);
  for (const CollisionTriangle f : ids<CollisionTriangle>(mesh.face_count())) {
    const std::int32_t piece = piece_of_triangle(pieces, f);
    std::int32_t& best = heaviest[static_cast<std::size_t>(state.body.hex.body_of(mesh.root[f]))];
    if (best < 0 || masses[static_cast<std::size_t>(piece)] > masses[static_cast<std::size_t>(best)]) best = piece;
  }
  std::vector<std::uint8_t> dust;
  for (const SmallPiece& piece : small) {
    const std::int32_t number = piece_of_triangle(pieces, piece.triangles.front());
    if (std::find(heaviest.begin(), heaviest.end(), number) != heaviest.end()) continue;
    dust.resize(mesh.face_count(), 0);
    for (const CollisionTriangle f : piece.triangles) dust[f.index()] = 1;
    ++report.pieces;
    report.mass += masses[static_cast<std::size_t>(number)];
  }
  return dust;
}

bool Session::Impl::is_dust(const SmallPiece& piece) {
  const Body& body = state.body;
  const CollisionMesh& mesh = body.complex.collision;
  const auto own_body = static_cast<std::size_t>(body.hex.body_of(mesh.root[piece.triangles.front()]));
  if (!(piece.volume < scene.cut.dust * uncut.volume[own_body])) return false;

  for (const CollisionTriangle f : piece.triangles)
    for (const Piece& part : body.hex.pieces_of(f))
      if (is_held(body.hex, state.materials, state.model, body.hex.host[part.copy])) return false;

  std::vector<CollisionVertex> vertices;
  for (const CollisionTriangle f : piece.triangles)
    for (int k = 0; k < 3; ++k) vertices.push_back(mesh.from(CollisionMesh::corner(f, k)));
  for (const Grasp& g : state.grasps)
    for (const CollisionVertex v : g.points)
      if (std::find(vertices.begin(), vertices.end(), v) != vertices.end()) return false;

  // A blade that stands near stands in it.
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const ToolMotion& motion = state.tools[i];
    if (!motion.inside && !motion.in_slit) continue;
    const RigidState& at = state.mechanics.tools[i];
    const RigidPlace place{at.position, at.axes};
    const ToolBlade blade = tool_blade(scene.tools[i], motion.jaws(state.time));
    const ToolEdge edge = tool_edge(scene.tools[i], motion.jaws(state.time));
    Box3 of_blade, of_piece;
    for (const Vec3 p : {edge.base, edge.tip})
      for (const double back : {0.0, blade.width}) of_blade.add(place.to_world(p - back * edge.forward));
    for (const CollisionVertex v : vertices) {
      const double around = norm(mesh.offset[v]) + blade.thickness;
      of_piece.add(deformed_collision()[v.index()] - Vec3{around, around, around});
      of_piece.add(deformed_collision()[v.index()] + Vec3{around, around, around});
    }
    if (boxes_meet(of_blade, of_piece)) return false;
  }
  return true;
}

double Session::Impl::share_of_uncut(double volume) const {
  double sum = 0;
  for (const double v : uncut.volume) sum += v;
  return sum > 0 ? volume / sum : 0;
}

void Session::Impl::note_dust(const RemovalReport& dust, const std::string& place) {
  if (++said.dust > kMostDustNotes)
    return add_note(
        fmt::format("dust was swept up after more than {} strokes: see what their entries in the report have removed",
                    kMostDustNotes));
  add_note(fmt::format(
      "{}{} that the stroke left {} swept up as dust: {:.3g} m3, {:.2g} of the uncut body; dust = 0 in [cut] leaves every piece",
      place, dust.pieces == 1 ? "a loose piece" : fmt::format("{} loose pieces", dust.pieces),
      dust.pieces == 1 ? "was" : "were", dust.volume, dust.share));
}

}  // namespace kerf
