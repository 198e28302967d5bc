// Bodies that are thin and bodies that are not, generated, with what is known about them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kerf/mesh/triangle_mesh.h"

namespace kerf::corpus {

struct Body {
  std::string name;
  TriangleMesh mesh;
  bool thin = true;
  std::int64_t euler = 1;  ///< of the mid-surface
  int loops = 1;
  std::size_t triangles = 0;  ///< wanted of the collision mesh, 0: whatever it needs
  /// The mid-surface densely sampled; empty: not known in closed form.
  std::vector<Vec3> middle;
};

/// A sheet of nu x nv quads with thickness. Parameters run over 0 .. 1.
struct ThickSheet {
  int nu = 40, nv = 40;
  bool closed_u = false, closed_v = false;
  std::function<Vec3(double u, double v)> middle;
  std::function<double(double u, double v)> half;
  std::function<bool(int i, int j)> hole;  ///< quads that are left out; empty: none
  int wall_rows = 2;
  bool round_rim = false;
};
TriangleMesh thicken(const ThickSheet& sheet);
/// Points of the middle on a fine grid, holes left out.
std::vector<Vec3> sample_middle(const ThickSheet& sheet);

/// A surface with parameters that run round in both directions (torus, knot).
TriangleMesh closed_tube(int nu, int nv, const std::function<Vec3(double u, double v)>& point);
/// A surface of revolution about z: profile(t) = (radius, height) for t in 0 .. 1, radius 0 at both ends.
TriangleMesh turned(int around, int along, const std::function<Vec2(double t)>& profile);
/// The outside of unit voxels times `size`, every face divided into n x n quads.
TriangleMesh voxels(const std::vector<std::string>& layers_of_rows, int columns, double size, int n);

void rotate(TriangleMesh& mesh, std::uint64_t seed);
void scale(TriangleMesh& mesh, double factor);
/// Random order of vertices and triangles.
void shuffle(TriangleMesh& mesh, std::uint64_t seed);
/// Every vertex by a random vector of this length at most.
void shake(TriangleMesh& mesh, double length, std::uint64_t seed);
/// Single vertices out along their normals.
void add_spikes(TriangleMesh& mesh, int count, double height, std::uint64_t seed);
TriangleMesh subdivided(const TriangleMesh& mesh);

/// The whole corpus; every body is small (at most about 20,000 triangles).
std::vector<Body> bodies();

}  // namespace kerf::corpus
