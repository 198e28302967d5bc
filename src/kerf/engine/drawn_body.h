// What a page knows of a body's topology, and what of it a cut changed. A render vertex of the page is a RenderVertex, a
// copy a HexId, a node a NodeId; skin and wall triangles have numbers of their own, in the order of the visual triangles,
// so that they keep them for as long as the triangles live.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/engine/protocol.h"
#include "kerf/session/body.h"
#include "kerf/session/session.h"

namespace kerf {

class DrawnBody {
 public:
  /// Takes the body as it is and forgets what was before. Linear.
  void reset(const Body& body);
  /// Takes the body as it is and collects the differences. Linear, ten nanoseconds a triangle.
  void update(const Body& body);
  /// The same where `changes` holds what the session noted since the last reset or update; costs what they name.
  void update(const Body& body, const SessionChanges& changes);
  /// Did the last update find a difference?
  [[nodiscard]] bool changed() const { return changed_; }

  /// Messages of the body as it was at the last reset or update; they view the arrays of this object. The caller fills in
  /// numbers and nodes.
  [[nodiscard]] protocol::Body body_message() const;
  [[nodiscard]] protocol::Patch patch_message() const;

  /// Render vertices of fading visual ones (surface_fade.h) with their offsets, ascending. As of the last reset or update.
  void fading(std::span<const FadingVertex> fades, std::vector<std::uint32_t>& vertices,
              std::vector<Vec3f>& offsets) const;
  /// Render vertices of these visual ones, ascending. As of the last reset or update.
  void drawn(std::span<const VisualVertex> visual, std::vector<std::uint32_t>& vertices) const;

 private:
  struct Arrays {
    std::vector<Vec3f> rest;
    std::vector<protocol::Normal> normal;
    std::vector<std::uint32_t> copy;
    std::vector<protocol::Triangle> skin, wall;
    std::vector<protocol::Copy> copies;
    std::vector<protocol::Cell> cells;
  };
  struct Sizes {
    std::size_t vertices, skin, wall, copies;
  };
  void set_frames(std::span<const LatticeBody> bodies);
  static void collect(const Body& body, Arrays& out);
  [[nodiscard]] Sizes sizes() const {
    return {now_.rest.size(), now_.skin.size(), now_.wall.size(), now_.copies.size()};
  }
  void index(const Body& body);
  void finish(const Sizes& before);
  void update_vertices(const Body& body, const SessionChanges& changes);
  void update_triangles(const Body& body, const SessionChanges& changes);
  void update_copies(const Body& body, const SessionChanges& changes);
  bool add_drawn(std::size_t visual, std::vector<std::uint32_t>& vertices) const;
  void link(RenderVertex r, VisualVertex to);
  void unlink(RenderVertex r);

  std::vector<protocol::CellFrame> frames_;
  Arrays now_;
  Arrays values_;  ///< of the changed records, then of the appended ones
  std::vector<std::uint32_t> vertex_ids_, skin_ids_, wall_ids_, copy_ids_;
  bool changed_ = false;

  // Which render vertices a visual vertex has, used or not, as linked lists; how many skin triangles come before each.
  std::vector<VisualVertex> place_;         ///< by RenderVertex
  std::vector<RenderVertex> next_;          ///< by RenderVertex
  std::vector<RenderVertex> first_;         ///< by VisualVertex
  std::vector<std::uint32_t> skin_before_;  ///< by VisualTriangle, and one more at the end

  std::vector<std::uint32_t> touched_;  // memory without state
};

/// Collision mesh, bound edges and links of the page's overlay, ready to be encoded.
struct OverlayArrays {
  std::vector<Vec3f> rest;
  std::vector<std::uint32_t> copy;
  std::vector<protocol::Triangle> triangles;
  std::vector<protocol::Pair> bound, links, feet;
  std::vector<Vec3f> foot_rest;
};
/// Linear in the collision mesh and its chains; with feet in the visual mesh too.
OverlayArrays overlay_arrays(const Body& body, bool with_feet);

}  // namespace kerf
