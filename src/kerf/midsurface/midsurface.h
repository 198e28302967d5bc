// The collision mesh of a thin closed body, made from its surface alone: the two sides and the rim are told apart on the
// surface itself, one side is moved half-way to the other, and the result is remeshed. docs/midsurface.md explains how.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

struct MidsurfaceOptions {
  std::size_t triangles = 0;  ///< wanted; 0: 160, or as many as the bends need
  Progress progress = {};
};

enum class Thinness {
  kThin,
  kDoubtful,  ///< usable, with a warning
  kNotThin,   ///< there is no mid-surface, or it would not stand for the body
};

/// Where something is odd, for people and pictures.
struct MidsurfacePlace {
  Vec3 point;  ///< metres
  std::string what;
};

struct MidsurfaceVerdict {
  Thinness thinness = Thinness::kThin;
  std::vector<std::string> reasons;   ///< why not thin, one sentence each
  std::vector<std::string> warnings;  ///< one sentence each
  std::vector<MidsurfacePlace> places;
  double width_over_thickness = 0;  ///< 2 x largest distance to the rim / mean thickness; infinite without a rim
  double narrow_share = 0;          ///< of the area: narrower than 1.5 thicknesses
  Vec3 narrowest;                   ///< the largest such part: its middle, in the person's frame
  double volume_ratio = 0;          ///< mid-surface x thickness / volume
  double branch_length = 0;         ///< of forks, in mean thicknesses
  double one_sided = 0;             ///< share of the opposite points that lie on the same side
};

/// How good the collision mesh is. Lengths in metres.
struct MidsurfaceQuality {
  double need = 0;            ///< triangles that the bends ask for
  double smallest_angle = 0;  ///< radians
  double mean_smallest_angle = 0;
  double medial_mean = 0;  ///< |d+ - d-| / (d+ + d-) of inner vertices, d the distances to both sides: 0 is medial
  double medial_max = 0;
  double thickness_mean = 0;  ///< |half thickness - (d+ + d-) / 2| over that, of inner vertices
  double thickness_max = 0;
  double good_rays = 1;       ///< share of inner vertices whose normal meets both sides
  double to_prisms_mean = 0;  ///< visual vertices to the prisms' surface
  double to_prisms_max = 0;
  double to_visual_max = 0;   ///< prisms' surface to the visual mesh: with the one above the Hausdorff distance
  double spanning_edges = 0;  ///< share of the inner edges that join two rim vertices: too few triangles there
  double mean_half_thickness = 0;
  std::size_t crossings = 0;  ///< pairs of collision triangles that pass through each other
};

struct MidsurfaceSeconds {
  double prepare = 0, working = 0, pairs = 0, labels = 0, sheet = 0, remesh = 0, relax = 0, quality = 0, total = 0;
};

/// The surface as the method saw it: for pictures of what was accepted or refused.
struct MidsurfaceDiagnosis {
  TriangleMesh surface;           ///< filtered and evenly divided
  std::vector<float> side;        ///< |F|: -1 to 1
  std::vector<float> confidence;  ///< |F|: 0 to 1
  std::vector<float> thickness;   ///< |F|, metres; 0: nothing opposite
  std::vector<std::uint8_t>
      flag;  ///< |F|: 1 where something speaks against a thin body, 2 where the surface passes through itself, 3 where the collision mesh is bad
};

struct Midsurface {
  TriangleMesh collision;              ///< oriented manifold, its border on the rim; empty if not thin
  std::vector<double> half_thickness;  ///< |V| of collision, metres; on the border half the height of the rim's wall
  MidsurfaceVerdict verdict;
  MidsurfaceQuality quality;
  MidsurfaceDiagnosis diagnosis;
  MidsurfaceSeconds seconds;
  std::vector<std::string> notes;  ///< what was filtered
  std::size_t own_crossings = 0;   ///< pairs of triangles of the surface that pass through each other
};

/// Marks what lies within `reach` (metres) of a place where the collision mesh is bad, and adds the place to the verdict's.
void mark_bad_place(Midsurface& made, Vec3 point, double reach, const std::string& what);

/// What was found of a surface that its collision mesh is made of, however many triangles that is to have: sides, middle and verdict.
class PreparedMidsurface {
 public:
  struct Parts;
  explicit PreparedMidsurface(std::unique_ptr<const Parts> parts);
  PreparedMidsurface(PreparedMidsurface&&) noexcept;
  PreparedMidsurface& operator=(PreparedMidsurface&&) noexcept;
  ~PreparedMidsurface();
  [[nodiscard]] const Parts& parts() const { return *parts_; }

 private:
  std::unique_ptr<const Parts> parts_;
};

/// The first half of make_midsurface: most of its time for large surfaces. It refers to the surface.
Result<PreparedMidsurface> prepare_midsurface(const TriangleMesh& surface, const Progress& progress = {});
/// The second half, as often as a body needs it. The same bits as from the surface itself.
Result<Midsurface> make_midsurface(const PreparedMidsurface& prepared, const MidsurfaceOptions& options = {});

/// surface: one closed body, an oriented manifold as check_surface leaves it. That a body is not thin is no error but a
/// verdict, with reasons and places. Bad input: not closed. The same bits for any number of threads. About 0.2 s for
/// small surfaces, 3 microseconds for each triangle of large ones.
Result<Midsurface> make_midsurface(const TriangleMesh& surface, const MidsurfaceOptions& options = {});

}  // namespace kerf
