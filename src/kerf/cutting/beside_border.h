// On which side of a path a border has run all the way since it began.
//
//     border  ----------------------
//     path    o====x====x====x          it has not come to that border, and does not end there
//
// Two cuts side by side leave a tooth between them. Its root is where they end: a path that was joined there to the cut beside it would sever the tooth.
#pragma once

#include "kerf/binding/cell_complex.h"

namespace kerf {

struct BesideBorder {
  static constexpr unsigned kLeft = 1, kRight = 2;
  unsigned sides = kLeft | kRight;  ///< on these a border was within reach at every place so far
  Vec3 way;                         ///< at rest, metres: from the place before to the last one

  static constexpr BesideBorder none() {
    BesideBorder b;
    b.sides = 0;
    return b;
  }
  /// The path comes to a place, at rest, through a face.
  void come_to(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, double reach);
  [[nodiscard]] bool is_ahead(Vec3 place) const { return dot(place - last_, way) >= 0; }
  /// Is a point, seen from a place in a face, on a side where a border has run all the way?
  [[nodiscard]] bool is_on(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, Vec3 point) const;
  /// The same, and neither ahead nor behind?
  [[nodiscard]] bool is_beside(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, Vec3 point) const;
  /// The path begins, or goes on, at another place.
  void set_place(Vec3 place) { last_ = place; }

 private:
  [[nodiscard]] unsigned sides_at(const CollisionMesh& mesh, CollisionTriangle face, Vec3 place, double reach) const;
  /// The sides, once the path has come far enough to tell.
  [[nodiscard]] unsigned there() const;

  Vec3 last_;
  double far_ = 0;  ///< reaches that the path has come
};

}  // namespace kerf
