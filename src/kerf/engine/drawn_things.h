// Obstacles and tools as pages draw them: their parts once, where they are in every frame.
#pragma once

#include <string>
#include <vector>

#include "kerf/engine/protocol.h"
#include "kerf/scene/scene_shapes.h"
#include "kerf/session/session.h"

namespace kerf {

class DrawnThings {
 public:
  /// Makes the parts of a scene's things. Bad input: meshes that can't be used. Linear in their triangles.
  static Result<DrawnThings> create(const Scene& scene, const Box3& body);
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] std::size_t tool_count() const { return tools_; }

  /// The caller fills in the body's number.
  [[nodiscard]] protocol::Things message() const;
  /// Places of all things, then what tools follow and feel, as of the session's last step.
  void place(const Session& session);
  [[nodiscard]] std::span<const protocol::Place> places() const { return places_; }
  [[nodiscard]] std::span<const protocol::ToolForces> tools() const { return forces_; }

 private:
  std::size_t count_ = 0, tools_ = 0;
  std::string json_;
  std::vector<Vec3f> positions_;
  std::vector<protocol::Triangle> triangles_;
  std::vector<protocol::Place> places_;
  std::vector<protocol::ToolForces> forces_;
};

/// What touches, ready to be encoded; how many press, and with how much in all.
struct DrawnContacts {
  std::vector<protocol::ContactPoint> points;
  std::vector<std::uint32_t> partners;
  std::uint32_t touching = 0;
  float press = 0;  ///< N
  void take(const Session& session);
};

}  // namespace kerf
