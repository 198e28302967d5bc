#include "kerf/cutting/pieces.h"

namespace kerf {

namespace {

template <class M>
Pieces label(const M& mesh) {
  Pieces pieces;
  pieces.of_face.assign(mesh.face_count(), -1);
  std::vector<typename M::F> stack;
  for (std::size_t seed = 0; seed < mesh.face_count(); ++seed) {
    if (pieces.of_face[seed] >= 0) continue;
    const std::int32_t piece = pieces.count++;
    pieces.of_face[seed] = piece;
    stack.assign(1, typename M::F(seed));
    while (!stack.empty()) {
      const typename M::F f = stack.back();
      stack.pop_back();
      for (int i = 0; i < 3; ++i) {
        const auto t = mesh.twin[M::corner(f, i)];
        if (!t.valid() || pieces.of_face[M::face(t).index()] >= 0) continue;
        pieces.of_face[M::face(t).index()] = piece;
        stack.push_back(M::face(t));
      }
    }
  }
  return pieces;
}

}  // namespace

Pieces collision_pieces(const CellComplex& body) { return collision_pieces(body.collision); }
Pieces collision_pieces(const CollisionMesh& mesh) { return label(mesh); }
Pieces visual_pieces(const CellComplex& body) { return label(body.visual); }

}  // namespace kerf
