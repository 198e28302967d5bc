// The number of connected pieces of a collision mesh, kept up to date while it is cut.
//
// What was changed falls into clusters, which grow at the same pace over the faces around until those of one piece have met or all but
// one of them have no way on: those are pieces of their own. So a cut that takes something off costs what the smaller part has, and one that
// does not costs the way around it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kerf/binding/cell_complex.h"

namespace kerf {

class PieceLabels {
 public:
  /// Nothing holds any more; the next count looks at all faces.
  void forget() { label_.clear(); }
  /// The number of pieces now. `changed`: all triangles that have other neighbours than at the last call, in any order; those with numbers
  /// that were not there then need not be told. Between two calls pieces may fall apart, but not grow together.
  std::int32_t count(const CollisionMesh& mesh, std::span<const CollisionTriangle> changed);

 private:
  struct Cluster {
    std::vector<CollisionTriangle> faces;  ///< reached so far; those from `next` on have not been looked around yet
    std::size_t next = 0;
    std::int32_t joined = 0;  ///< union-find
    std::int32_t label = -1;  ///< of the piece that it was part of; -1: nothing tells yet
    [[nodiscard]] bool open() const { return next < faces.size(); }
  };

  std::int32_t count_all(const CollisionMesh& mesh);
  std::int32_t root_of(std::int32_t cluster);
  void join(std::int32_t a, std::int32_t b);
  void look_around(const CollisionMesh& mesh, std::int32_t cluster);
  bool is_settled(std::int32_t cluster);

  std::vector<std::int32_t> label_;    ///< per triangle
  std::vector<std::int32_t> reached_;  ///< per triangle: the cluster that has reached it, or -1
  std::vector<Cluster> clusters_;
  std::size_t used_ = 0;  ///< clusters of this call
  std::vector<CollisionTriangle> seeds_;
  std::int32_t pieces_ = 0, next_label_ = 0;
};

}  // namespace kerf
