// Files that a run leaves: final meshes, animation, node positions per frame.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/mesh/glb_file.h"
#include "kerf/mesh/vtu_file.h"
#include "kerf/record/textured_surface.h"
#include "kerf/session/session.h"

namespace kerf {

/// The hexahedra as they are now, with the fields `copy` (id), `fill` and `branch` (copies of the cell) per cell and
/// `velocity` and `displacement` per point. Unused nodes are left out.
VtuMesh hexahedra_vtu(const Session& session);

/// Names of the files that write_final_meshes writes.
std::vector<std::string> final_mesh_files(const std::vector<std::string>& which);

/// Names of all files that a run leaves in its folder. positions.pvd stands for the frames of its series, too.
std::vector<std::string> result_files(const SceneOutput& output);

/// Names of results in a folder that the report there ("files") says are of an earlier run; of others than result_files gives, it says nothing.
std::vector<std::string> earlier_results(const std::filesystem::path& folder);

/// Takes away these results and, with positions.pvd, all frames of its series; and what killed writers of them left. Those in `kept`, links, and what is one of `inputs` stay.
/// Bad input: one can't be removed.
Status remove_results(const std::filesystem::path& folder, std::vector<std::string> names,
                      const std::vector<std::string>& kept, const std::vector<std::filesystem::path>& inputs);

/// visual.obj (deformed), visual_rest.obj, collision.obj, collision_rest.obj and hexahedra.vtu, those that `which` names
/// ("visual", "collision", "hexahedra").
Status write_final_meshes(Session& session, const std::vector<std::string>& which, const std::filesystem::path& folder);

/// Collects frames of a session as an animated .glb.
class Animation {
 public:
  explicit Animation(const Scene& scene);
  Status add_frame(const Session& session);
  [[nodiscard]] std::size_t frame_count() const { return builder_.frame_count(); }
  Status write(const std::filesystem::path& path) const { return builder_.write(path.string()); }

 private:
  GlbBuilder builder_;
  TexturedSurface surface_;
  std::uint64_t version_ = 0;
  std::vector<Vec3> nodes_;
  std::vector<Vec3f> positions_, normals_, frame_positions_, frame_normals_;
};

/// What the body looks like: the name of a set of colours and textures ("steak", "meniscus", "sheet").
std::string body_look(const Scene& scene);

}  // namespace kerf
