#include "kerf/binding/patches.h"

#include <fmt/format.h>

#include "kerf/base/at.h"
#include "kerf/base/indexed.h"

namespace kerf {

Result<PatchMap> find_patches(const SplitSurface& s, const CollisionMesh& c, const BoundVertices& vertices,
                              const PathNetwork& network, bool closed, std::vector<CollisionVertex>* at_fault) {
  using CH = CollisionHalfEdge;
  const WalledSurface& w = s.walled;
  const std::size_t patches = 2 * c.face_count();
  const auto name = [](std::size_t patch) {
    return fmt::format("collision triangle {} ({} side)", patch / 2 + 1, patch % 2 == 0 ? "+" : "-");
  };
  const auto disc_error = [&](std::size_t patch, const std::string& what) {
    if (at_fault != nullptr)
      for (int k = 0; k < 3; ++k) at_fault->push_back(c.from(CollisionMesh::corner(CollisionTriangle(patch / 2), k)));
    return failed(
        fmt::format("the region of {} is not a disc bounded by its three paths: {}; the collision mesh fits the visual "
                    "mesh badly there",
                    name(patch), what));
  };

  // The side of every chain edge that looks into the patch: + on the left, - on the right of the collision half-edge.
  PatchMap map;
  map.label.assign(at(s.face_count()), -1);
  std::vector<std::int32_t> boundary(patches, 0), stack;
  std::vector<std::uint8_t> on_chain(w.position.size(), 0);
  std::size_t chain_vertices = 0;
  for (const CH h : ids<CH>(c.half_edge_count()))
    for (std::size_t side = 0; side < (closed ? 2u : 1u); ++side) {
      const PoolRun run = network.chain[h.index()][side];
      const auto patch = static_cast<std::int32_t>(2 * (h.index() / 3) + side);
      if (!run.exists()) return disc_error(at(patch), "a path is missing");
      std::int32_t a = vertices.bound[c.from(h).index()][side];
      for (std::int32_t i = 0; i <= run.count; ++i) {
        const std::int32_t b = i < run.count ? network.pool[run.at(i).index()] : vertices.bound[c.to(h).index()][side];
        const std::int32_t e = side == 0 ? find_half_edge(w, a, b) : find_half_edge(w, b, a);
        if (e < 0 || !w.wall[at(e)])
          return disc_error(at(patch), fmt::format("its path is torn between visual vertices {} and {}", a + 1, b + 1));
        std::int32_t& label = map.label[at(e / 3)];
        if (label >= 0 && label != patch) return disc_error(at(patch), fmt::format("it overlaps {}", name(at(label))));
        if (label < 0) stack.push_back(e / 3);
        label = patch;
        ++boundary[at(patch)];
        a = b;
      }
      // Inner chain vertices belong to one chain only (one per rim, though both sides use it).
      if (!run.reversed && (side == 0 || c.twin[h].valid()))
        for (std::int32_t i = 0; i < run.count; ++i) {
          std::uint8_t& used = on_chain[at(network.pool[run.at(i).index()])];
          if (used) return disc_error(at(patch), "two of its paths touch");
          used = 1;
          ++chain_vertices;
        }
    }
  for (const auto& b : vertices.bound)
    for (std::size_t side = 0; side < 2; ++side) {
      if (b[side] < 0 || (side == 1 && b[1] == b[0])) continue;
      if (on_chain[at(b[side])]) return failed(fmt::format("visual vertex {} is bound twice", b[side] + 1));
      on_chain[at(b[side])] = 1;
      ++chain_vertices;
    }

  while (!stack.empty()) {
    const std::int32_t f = stack.back();
    stack.pop_back();
    const std::int32_t label = map.label[at(f)];
    for (std::int32_t h = 3 * f; h < 3 * f + 3; ++h) {
      if (w.wall[at(h)]) continue;
      const std::int32_t g = w.opposite(h);
      if (g < 0)
        return disc_error(at(label),
                          fmt::format("it reaches the border of the visual mesh at vertex {}", w.from(h) + 1));
      std::int32_t& other = map.label[at(g / 3)];
      if (other >= 0) {
        if (other != label) return disc_error(at(label), fmt::format("it runs into the region of {}", name(at(other))));
        continue;
      }
      other = label;
      stack.push_back(g / 3);
    }
  }

  // Faces, inner vertices and walls of every patch.
  map.first.assign(patches + 1, 0);
  std::vector<std::int32_t> inner(patches, 0), walls(patches, 0);
  for (std::size_t f = 0; f < map.label.size(); ++f) {
    const std::int32_t label = map.label[f];
    if (label < 0)
      return failed(fmt::format(
          "visual triangle {} belongs to no collision triangle: the collision mesh does not cover that part of "
          "the body (several bodies in one file?)",
          s.input_face(static_cast<std::int32_t>(f)) + 1));
    ++map.first[at(label) + 1];
    for (std::size_t h = 3 * f; h < 3 * f + 3; ++h) walls[at(label)] += w.wall[h];
  }
  std::size_t wall_vertices = 0;
  for (std::size_t v = 0; v < w.position.size(); ++v) {
    if (w.wall_vertex[v]) {
      ++wall_vertices;
      if (!on_chain[v])
        return failed(fmt::format("visual vertex {} lies on a border that no collision edge follows", v + 1));
    } else {
      ++inner[at(map.label[at(w.outgoing[v] / 3)])];
    }
  }
  if (wall_vertices != chain_vertices) return failed("a path vertex of the visual mesh is not marked as a wall");
  for (std::size_t p = 0; p < patches; p += closed ? 1 : 2) {
    if (walls[p] != boundary[p])
      return disc_error(p, fmt::format("{} wall edges instead of {}", walls[p], boundary[p]));
    const std::int32_t faces = map.first[p + 1], edges = (3 * faces + boundary[p]) / 2, points = inner[p] + boundary[p];
    if (points - edges + faces != 1) return disc_error(p, fmt::format("V - E + F = {}", points - edges + faces));
  }
  for (std::size_t p = 0; p < patches; ++p) map.first[p + 1] += map.first[p];
  map.faces.resize(map.label.size());
  std::vector<std::int32_t> cursor(map.first.begin(), map.first.end() - 1);
  for (std::size_t f = 0; f < map.label.size(); ++f)
    map.faces[at(cursor[at(map.label[f])]++)] = static_cast<std::int32_t>(f);
  return map;
}

}  // namespace kerf
