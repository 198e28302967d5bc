// Bonds of a scene: where skins of two bodies face each other, and what elements hold them there now.
//
// A place is one point at rest, between both skins. It belongs to a root triangle of each body, and so to whatever triangle of that root is there now:
// cuts and undo change nothing about a place. Only its damage is state (MechanicsState::bond_damage).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/cutting/blade_edge.h"
#include "kerf/mechanics/mechanics_model.h"
#include "kerf/mechanics/step.h"
#include "kerf/scene/scene.h"
#include "kerf/session/body.h"

namespace kerf {

struct BondPlace {
  std::array<RootId, 2> root;  ///< of the lower and the upper body
  Vec3 rest;                   ///< m
  Vec3 normal;                 ///< at rest, unit, from the lower to the upper body
  double area = 0;             ///< m^2
  double reach = 0;            ///< m, to either side: a blade that goes through there severs it
  std::int32_t law = 0;
};

/// Of a scene; never changes.
struct BodyBonds {
  std::vector<BondLaw> laws;
  std::vector<std::array<std::int32_t, 2>> bodies;  ///< of each law: the lower and the upper body
  std::vector<BondPlace> places;
  double box = 0;                                                      ///< m: kBesideBond of the widest spacing
  std::unordered_map<std::uint64_t, std::vector<std::int32_t>> boxes;  ///< places by cells of that size
  [[nodiscard]] bool empty() const { return places.empty(); }
  /// Calls fn(number) for every place within `box` of a rest point, and for some beyond.
  template <class Fn>
  void for_each_near(Vec3 rest, Fn&& fn) const;
};

/// m between a place and the next ones of its triangle.
inline double spacing_of(const BondPlace& place) { return std::sqrt(2 * place.area); }

/// Bad input: a [[bond]] that names a body that is not there, binds a body to itself, or joins nothing.
Result<BodyBonds> make_bonds(const Scene& scene, const Body& body, const MechanicsModel& model,
                             std::vector<std::string>& notes);

/// Why a removal, a shaver, or a punch that takes is refused.
inline constexpr const char* kBondedStays =
    "in a scene with [[bond]] nothing is taken away or shaved; take the bonds out of the scene, or leave this out (a punch can leave out `take`)";

/// The triangles of every root, ascending.
struct RootTriangles {
  std::vector<std::int32_t> begin;
  std::vector<CollisionTriangle> triangles;
};
void list_root_triangles(const CollisionMesh& mesh, RootTriangles& out);

/// The point of the model's bonds that a place is now.
BondPoint bond_point(const Body& body, const BondPlace& place, const RootTriangles& triangles);

/// Does an edge that sweeps from one pose straight to another go through a bond? Its ends are apart + reach off each other along the normal.
bool sweeps(const BladeEdge& from, const BladeEdge& to, Vec3 lower, Vec3 upper);

inline std::uint64_t bond_box(std::int64_t x, std::int64_t y, std::int64_t z) {
  return (static_cast<std::uint64_t>(x + (1 << 20)) << 42) ^ (static_cast<std::uint64_t>(y + (1 << 20)) << 21) ^
         static_cast<std::uint64_t>(z + (1 << 20));
}

template <class Fn>
void BodyBonds::for_each_near(Vec3 rest, Fn&& fn) const {
  const auto x = static_cast<std::int64_t>(std::floor(rest.x / box)),
             y = static_cast<std::int64_t>(std::floor(rest.y / box)),
             z = static_cast<std::int64_t>(std::floor(rest.z / box));
  for (std::int64_t i = x - 1; i <= x + 1; ++i)
    for (std::int64_t j = y - 1; j <= y + 1; ++j)
      for (std::int64_t k = z - 1; k <= z + 1; ++k)
        if (const auto found = boxes.find(bond_box(i, j, k)); found != boxes.end())
          for (const std::int32_t p : found->second) fn(p);
}

}  // namespace kerf
