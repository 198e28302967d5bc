// Lips may have come apart since they were cut. A rollback that joins them puts their vertex midway between them.
//
//      ___     ___              ___ ___
//     |   a   b   |      ->    |   x   |      b: the vertex that stays
//     |    \ /    |            |   |   |
//        end                      end
//
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kerf/base/vec.h"
#include "kerf/binding/cell_complex.h"

namespace kerf {

/// A vertex that gets corners back from twins.
struct JoinedLips {
  CollisionVertex vertex;
  Vec3 other;  ///< mean place of its twins
};

/// Before a rollback. `origin` is the mark of the mesh's array of that name, `vertices` the number of vertices then; `position` holds metres, one a
/// vertex.
std::vector<JoinedLips> find_joined_lips(const CollisionMesh& mesh, decltype(CollisionMesh::origin)::Mark origin,
                                         std::size_t vertices, std::span<const Vec3> position);

/// After it: moves the vertices midway between their lips.
void place_joined_lips(std::span<const JoinedLips> lips, std::span<Vec3> position);

}  // namespace kerf
