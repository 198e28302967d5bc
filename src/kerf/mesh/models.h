// Generated bodies: the models of the paper's experiments with their very counts of vertices and triangles, and
// harder ones for tests.
//
// Every model: metres, z up, the thin direction along z where the body is flat. The collision mesh is an open surface
// at mid-thickness whose counter-clockwise normal is the + side; its border vertices lie on the rim. The visual mesh is
// counter-clockwise from outside (closed) or from the + side (open), with texture coordinates per corner in the unit
// square: on closed bodies the + side, the - side and the rim strips have areas of their own that do not overlap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"
#include "kerf/mesh/triangle_mesh.h"

namespace kerf {

/// A regular grid of box cells, axis-aligned, that fits a model: cell (i,j,k) begins at origin + (i,j,k) * cell.
struct LatticeHint {
  Vec3 origin;                 ///< metres
  Vec3 cell;                   ///< metres
  std::array<int, 3> cells{};  ///< number of cells along x, y, z
};

struct Model {
  TriangleMesh visual;                 ///< closed or open
  TriangleMesh collision;              ///< open, at mid-thickness
  std::vector<double> half_thickness;  ///< metres, one per collision vertex
  LatticeHint lattice;                 ///< recommended simulation lattice
  bool closed = true;                  ///< whether the visual mesh is closed
  double young = 0;                    ///< Young's modulus, Pa
  double poisson = 0;                  ///< Poisson's ratio
  double density = 0;                  ///< kg/m3
};

/// Zero means "the model's own default".
struct ModelOptions {
  std::uint64_t visual_triangles =
      0;  ///< exact where the paper gives counts, otherwise the nearest that the model can have
  std::uint64_t collision_triangles = 0;  ///< one of the counts that the model offers
  double rim_radius = 0;   ///< closed-sheet only: how far its rim bulges beyond its faces, metres; 0 is a sharp rim
  double bend = 0;         ///< angle, radians, by which the model is bent about the y axis (see bend())
  double bumps = 0;        ///< amplitude of smooth bumps of visual and collision mesh, metres (see add_bumps())
  double noise = 0;        ///< amplitude of noise on the visual mesh, metres (see add_noise())
  std::uint64_t seed = 1;  ///< of bumps and noise
  friend bool operator==(const ModelOptions&, const ModelOptions&) = default;
};

struct ModelName {
  std::string_view name;
  std::string_view description;  ///< one line
};

/// The names that make_model() knows, in the order to print them.
const std::vector<ModelName>& model_names();

/// Generates a model. Bad input: an unknown name (the message lists the known ones), a count that the model cannot have
/// (the message lists those it can), sizes that are negative, too large for the body or not finite. Linear in the number
/// of triangles.
Result<Model> make_model(std::string_view name, const ModelOptions& options);

/// Bends visual and collision mesh alike about an axis parallel to y: the plane z = 0 goes onto a cylinder, lengths in it
/// kept, the + side outside; the body's length along x then spans `angle` radians. Half-thicknesses stay. The lattice
/// becomes a grid of about the old cell size around the bent body. Refuses an angle over 2 pi in size or one that would
/// fold the body through its own axis.
Status bend(Model& model, double angle);

/// Moves visual and collision mesh alike along z by a smooth field of x and y: the sum of a few waves of `wavelength`
/// metres (> 0) and longer with random directions and phases, at most `amplitude` metres high. A lattice of one layer stays
/// one layer and grows with the body.
void add_bumps(Model& model, double amplitude, double wavelength, std::uint64_t seed);

/// Moves every visual vertex, and no collision vertex, by a random vector at most `amplitude` metres long. Vertices of an
/// open border stay.
void add_noise(Model& model, double amplitude, std::uint64_t seed);

}  // namespace kerf
