// Pictures of a session as it stands.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/picture/picture.h"
#include "kerf/picture/quick_painter.h"
#include "kerf/scene/scene.h"
#include "kerf/scene/scene_shapes.h"
#include "kerf/scene/shape_mesh.h"
#include "kerf/session/session.h"

namespace kerf {

/// Draws pictures of one session: its body, obstacles and tools. Keeps what lasts from one to the next.
class SessionPainter {
 public:
  /// Bad input: meshes of the scene's shapes can't be read.
  static Result<SessionPainter> create(const Session& session);

  /// The camera of a scene's picture of so many pixels: it has the body and obstacles of its size in view.
  PictureView fitted_view(Session& session, const SceneCamera& camera, int width, int height);

  /// One sample a pixel, no shadows (quick_painter.h). Level planes are the ground. Views are those that check_view() takes.
  void draw_quickly(Session& session, const PictureView& view, const QuickTarget& target);

  /// Soft shadows and four samples a pixel, on a ground. Without a view: the scene's camera. With output.wireframe, the edges of the three
  /// meshes too (visual black, collision orange, hexahedra in colours per copy), as in the paper's figures. stop: as of PictureOptions.
  Picture draw(Session& session, const SceneOutput& output, const std::optional<PictureView>& view = {},
               std::function<bool()> stop = {});

 private:
  /// What one obstacle looks like in its own axes.
  struct Shape {
    double plane_size = -1;  ///< metres: that its planes were made for
    ShapeMesh mesh;
  };

  SessionPainter() = default;
  void gather(Session& session);
  void gather_topology(const Session& session);
  void gather_obstacles(const Session& session, const Box3& box);
  void gather_tools(const Session& session);
  [[nodiscard]] std::vector<PictureLine> wireframe(Session& session) const;
  [[nodiscard]] PictureBody body(const Session& session) const;

  SceneShapes shapes_;
  std::vector<Shape> obstacles_;
  std::optional<std::uint64_t> version_;  ///< of the topology that these two are of
  std::vector<std::array<std::int32_t, 3>> triangles_;
  std::vector<std::uint8_t> wall_;
  std::optional<std::uint64_t> texture_version_;
  std::optional<BodyTexture> texture_;
  Look look_ = Look::kSheet;
  // As the session stands.
  std::vector<Vec3> positions_;
  std::vector<PictureThing> things_;
  std::optional<double> ground_at_;
  QuickPainter quick_;
};

}  // namespace kerf
