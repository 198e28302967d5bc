#include "session_picture.h"

#include "kerf/session/run_outputs.h"
#include "kerf/session/surface_export.h"
#include "picture.h"
#include "png_file.h"

namespace kerf::app {
namespace {

std::vector<std::array<std::int32_t, 3>> corners(const TriangleMesh& mesh) {
  std::vector<std::array<std::int32_t, 3>> out;
  out.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) out.push_back({t[0].value, t[1].value, t[2].value});
  return out;
}

void append(std::vector<PictureLine>& lines, const std::vector<PictureLine>& more) {
  lines.insert(lines.end(), more.begin(), more.end());
}

}  // namespace

Status write_picture(Session& session, const Scene& scene, const std::filesystem::path& file) {
  const Body& body = session.body();
  const TriangleMesh surface = visual_surface(body.complex, session.visual_positions());
  const auto triangles = corners(surface);
  std::vector<std::uint8_t> wall;
  for (const std::int32_t group : surface.group) wall.push_back(group == kCutGroup ? 1 : 0);

  const std::string look = body_look(scene);
  PictureBody drawn;
  drawn.positions = surface.positions.raw();
  drawn.rest = body.complex.visual.rest.raw();
  drawn.triangles = triangles;
  drawn.wall = wall;
  drawn.look = look == "steak" ? Look::kMeat : look == "meniscus" ? Look::kCartilage : Look::kSheet;

  std::vector<PictureLine> lines;
  if (scene.output.wireframe) {
    const TriangleMesh collision = collision_surface(body.complex, session.collision_positions());
    append(lines, triangle_edges(surface.positions.raw(), triangles, {0, 0, 0}, 1, 0.5f));
    append(lines, triangle_edges(collision.positions.raw(), corners(collision), {1, 0.25f, 0}, 2.5f, 1));
    std::vector<std::array<std::int32_t, 8>> hexahedra;
    for (const HexId h : ids<HexId>(body.hex.hex_count())) {
      if (!body.hex.alive(h)) continue;
      std::array<std::int32_t, 8> nodes;
      for (std::size_t c = 0; c < 8; ++c) nodes[c] = body.hex.nodes[h][c].value;
      hexahedra.push_back(nodes);
    }
    append(lines, hexahedron_edges(session.node_positions(), hexahedra, 2, 1));
  }

  PictureOptions options;
  options.width = scene.output.picture_size[0];
  options.height = scene.output.picture_size[1];
  options.direction = scene.output.camera.direction;
  options.up = scene.output.camera.up;
  options.field_of_view = scene.output.camera.field_of_view;
  options.zoom = scene.output.camera.zoom;
  options.two_sided = !body.complex.closed;
  const Picture picture = draw_picture(drawn, lines, options);
  return write_png(file, picture);
}

}  // namespace kerf::app
