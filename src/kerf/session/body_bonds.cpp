#include "kerf/session/body_bonds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kerf/base/shown_text.h"
#include "kerf/embedding/embedding.h"
#include "kerf/scene/scene_place.h"
#include "kerf/session/scene_bodies.h"
#include "kerf/session/tolerances.h"
#include "kerf/spatial/bvh.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

std::array<Vec3, 3> corners(const CollisionMesh& mesh, CollisionTriangle t) {
  std::array<Vec3, 3> out;
  for (int k = 0; k < 3; ++k) out[static_cast<std::size_t>(k)] = mesh.rest[mesh.origin[CollisionMesh::corner(t, k)]];
  return out;
}

Vec3 offset_at(const CollisionMesh& mesh, CollisionTriangle t, const std::array<double, 3>& weights) {
  Vec3 sum;
  for (int k = 0; k < 3; ++k)
    sum += weights[static_cast<std::size_t>(k)] * mesh.offset[mesh.origin[CollisionMesh::corner(t, k)]];
  return sum;
}

/// Bad input: no body has the name, or two have it.
Result<std::int32_t> body_named(const Scene& scene, const std::string& name) {
  std::int32_t found = -1;
  for (std::size_t i = 0; i <= scene.more_bodies.size(); ++i) {
    if ((i == 0 ? scene.body : scene.more_bodies[i - 1]).name != name) continue;
    const auto number = static_cast<std::int32_t>(i);
    if (found >= 0)
      return bad_input(fmt::format("bodies number {} and {} are both named \"{}\"; give each a name of its own",
                                   found + 1, number + 1, shown(name)));
    found = number;
  }
  if (found < 0) return bad_input(fmt::format("there is no body \"{}\"; give a [[body]] that name", shown(name)));
  return found;
}

/// Of a body: Young's modulus, mean thickness, and the longest edge of a cell along its mid-surface.
struct BondSide {
  double young = 0, thickness = 0, cell = 0;
};

BondSide side_of(const Body& body, const MechanicsModel& model, std::int32_t number) {
  const CollisionMesh& mesh = body.complex.collision;
  BondSide out;
  std::size_t count = 0;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
    if (body.hex.body_of(mesh.root[t]) != number) continue;
    out.thickness += 2 * norm(offset_at(mesh, t, {1.0 / 3, 1.0 / 3, 1.0 / 3}));
    ++count;
  }
  out.thickness /= static_cast<double>(std::max<std::size_t>(count, 1));
  Vec3 cell = body.hex.frame_of_body(number).cell;
  std::array<double, 3> edges{cell.x, cell.y, cell.z};
  std::sort(edges.begin(), edges.end());
  // The axis across is the one whose cells come nearest to the thickness; the others lie along.
  std::size_t across = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (std::abs(edges[a] - out.thickness) < std::abs(edges[across] - out.thickness)) across = a;
  for (std::size_t a = 0; a < 3; ++a)
    if (a != across) out.cell = std::max(out.cell, edges[a]);
  for (const HexId h : ids<HexId>(body.hex.hex_count()))
    if (body.hex.alive(h) && body.hex.material[h].body == number) {
      out.young = model.materials()[static_cast<std::size_t>(model.element(h).material)].young;
      break;
    }
  return out;
}

/// Bad input: numbers that make no law. Strengths are lowered to what cells resolve, and a stiffness is raised to what they take; `note` says so.
Result<BondLaw> law_of(const SceneBond& bond, const std::array<BondSide, 2>& sides, std::string& note) {
  const double cell = std::max(sides[0].cell, sides[1].cell);
  const auto bending = [](const BondSide& side) { return side.young * std::pow(side.thickness, 3); };
  const BondSide& bends = bending(sides[0]) < bending(sides[1]) ? sides[0] : sides[1];
  BondLaw law;
  law.stiffness = bond.stiffness.value_or(
      kBondFirmness * std::min(sides[0].young / sides[0].thickness, sides[1].young / sides[1].thickness));
  law.toughness = {bond.toughness, bond.shear_toughness.value_or(bond.toughness)};
  const std::array<double, 2> wanted{bond.strength, bond.shear_strength.value_or(bond.strength)};
  std::string lowered;
  double firm = 0;
  for (std::size_t mode = 0; mode < 2; ++mode) {
    law.strength[mode] =
        std::min(wanted[mode], resolved_strength(bends.young, bends.thickness, law.toughness[mode], cell));
    firm = std::max(firm, kBondRise * law.strength[mode] * law.strength[mode] / law.toughness[mode]);
    if (law.strength[mode] < wanted[mode])
      lowered += fmt::format("{}{:.3g} Pa against {}", lowered.empty() ? "" : " and ", law.strength[mode],
                             mode == 0 ? "opening" : "sliding");
  }
  if (!lowered.empty())
    note = fmt::format(
        "cells of {:.3g} m resolve the tearing of strengths up to {} at its toughness, and it has that; what tearing it takes is the same. Give smaller cells for more.",
        cell, lowered);
  if (bond.stiffness) KERF_TRY(validate(law));
  if (bond.stiffness && law.stiffness < firm)
    note += fmt::format(
        "{}its stiffness is {:.3g} Pa/m instead of {:.3g}, so that most of what tearing takes comes after the strength is passed; give that, or less strength",
        note.empty() ? "" : " ", firm, law.stiffness);
  law.stiffness = std::max(law.stiffness, firm);
  KERF_TRY(validate(law));
  return law;
}

/// Points along each side of a triangle.
double points_along(double area, double spacing) { return std::max(1.0, std::ceil(std::sqrt(2 * area) / spacing)); }

/// Refuses a spacing that takes more than kMostBondPoints on the triangles of a body, unless that is one a triangle.
Status check_points(const Body& body, std::int32_t number, double spacing) {
  const CollisionMesh& mesh = body.complex.collision;
  std::vector<double> areas;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count()))
    if (body.hex.body_of(mesh.root[t]) == number) {
      const std::array<Vec3, 3> at = corners(mesh, t);
      areas.push_back(0.5 * norm(cross(at[1] - at[0], at[2] - at[0])));
    }
  const auto points = [&](double apart) {
    double sum = 0;
    for (const double area : areas) sum += std::pow(points_along(area, apart), 2);
    return sum;
  };
  const double most = std::max(kMostBondPoints, static_cast<double>(areas.size()));
  if (points(spacing) <= most) return {};
  double enough = spacing;
  while (points(enough) > most) enough *= 1.02;
  return bad_input(fmt::format("spacing {:.3g} m takes {:.0f} points, and {:.0f} are the most; give {:.3g} m or more",
                               spacing, points(spacing), most, 1.01 * enough));
}

}  // namespace

void list_root_triangles(const CollisionMesh& mesh, RootTriangles& out) {
  std::int32_t roots = 0;
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count()))
    roots = std::max(roots, mesh.root[t].value + 1);
  out.begin.assign(static_cast<std::size_t>(roots) + 1, 0);
  out.triangles.resize(mesh.face_count());
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) ++out.begin[mesh.root[t].index() + 1];
  for (std::size_t r = 0; r < static_cast<std::size_t>(roots); ++r) out.begin[r + 1] += out.begin[r];
  std::vector<std::int32_t> next(out.begin.begin(), out.begin.end() - 1);
  for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count()))
    out.triangles[static_cast<std::size_t>(next[mesh.root[t].index()]++)] = t;
}

BondPoint bond_point(const Body& body, const BondPlace& place, const RootTriangles& roots) {
  BondPoint out;
  out.normal = place.normal;
  out.area = place.area;
  out.law = place.law;
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t root = place.root[side].index();
    if (root + 1 >= roots.begin.size()) continue;
    CollisionTriangle in;
    double nearest = HUGE_VAL;
    for (std::int32_t k = roots.begin[root]; k < roots.begin[root + 1]; ++k) {
      const CollisionTriangle t = roots.triangles[static_cast<std::size_t>(k)];
      ClosestPoint found;
      closest_point(place.rest, corners(body.complex.collision, t), found);
      if (found.distance < nearest) nearest = found.distance, in = t;
    }
    if (!in.valid()) continue;
    const EmbeddedPoint at = embed_point(body.hex, in, place.rest);
    out.element[side] = at.copy;
    out.local[side] = at.local;
  }
  return out;
}

Result<BodyBonds> make_bonds(const Scene& scene, const Body& body, const MechanicsModel& model,
                             std::vector<std::string>& notes) {
  BodyBonds out;
  const CollisionMesh& mesh = body.complex.collision;
  for (std::size_t number = 0; number < scene.bonds.size(); ++number) {
    const SceneBond& bond = scene.bonds[number];
    const std::string name = fmt::format("[[bond]] number {}", number + 1);
    std::array<std::int32_t, 2> bodies{};
    for (std::size_t side = 0; side < 2; ++side) {
      const Result<std::int32_t> named = body_named(scene, side == 0 ? bond.lower : bond.upper);
      if (!named) return at_line(scene, bond.line, bad_input(fmt::format("{}: {}", name, named.error().message)));
      bodies[side] = *named;
    }
    if (bodies[0] == bodies[1])
      return at_line(scene, bond.line,
                     bad_input(fmt::format("{} binds body \"{}\" to itself", name, shown(bond.lower))));
    const std::array<BondSide, 2> sides{side_of(body, model, bodies[0]), side_of(body, model, bodies[1])};
    const double thinner = std::min(sides[0].thickness, sides[1].thickness);
    const double reach = bond.reach.value_or(kBondReach * thinner);
    const double spacing = bond.spacing.value_or(std::min(sides[0].cell, sides[1].cell) / kPointsPerCell);

    std::string note;
    const Result<BondLaw> law = law_of(bond, sides, note);
    if (!law) return at_line(scene, bond.line, bad_input(fmt::format("{}: {}", name, law.error().message)));
    if (!note.empty()) notes.push_back(fmt::format("{}{}: {}", scene_place(scene, bond.line), name, note));
    if (const Status fits = check_points(body, bodies[1], spacing); !fits)
      return at_line(scene, bond.line, bad_input(fmt::format("{}: {}", name, fits.error().message)));
    const std::size_t before = out.places.size();
    std::vector<CollisionTriangle> other;
    std::vector<std::int32_t> its_corners;
    for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
      if (body.hex.body_of(mesh.root[t]) != bodies[0]) continue;
      other.push_back(t);
      for (int k = 0; k < 3; ++k) its_corners.push_back(mesh.origin[CollisionMesh::corner(t, k)].value);
    }
    const TriangleView its_triangles(mesh.rest.raw(), its_corners);
    const TriangleBvh tree(its_triangles);
    for (const CollisionTriangle t : ids<CollisionTriangle>(mesh.face_count())) {
      if (body.hex.body_of(mesh.root[t]) != bodies[1]) continue;
      const std::array<Vec3, 3> at = corners(mesh, t);
      const double area = 0.5 * norm(cross(at[1] - at[0], at[2] - at[0]));
      const int n = static_cast<int>(points_along(area, spacing));
      // n^2 equal triangles, each with a point in its middle.
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < 2 * (n - i) - 1; ++j) {
          const double u = (i + (j % 2 == 0 ? 1.0 / 3 : 2.0 / 3)) / n,
                       v = (j / 2 + (j % 2 == 0 ? 1.0 / 3 : 2.0 / 3)) / n;
          const std::array<double, 3> weights{1 - u - v, u, v};
          const Vec3 middle = weights[0] * at[0] + weights[1] * at[1] + weights[2] * at[2],
                     off = offset_at(mesh, t, weights);
          for (const double face : {-1.0, 1.0}) {
            const Vec3 skin = middle + face * off;
            const ClosestPoint found = tree.closest(its_triangles, skin);
            if (!found.valid()) continue;
            const CollisionTriangle in = other[static_cast<std::size_t>(found.triangle)];
            const double nearest = found.distance;
            const Vec3 from = found.barycentric[0] * corners(mesh, in)[0] +
                              found.barycentric[1] * corners(mesh, in)[1] + found.barycentric[2] * corners(mesh, in)[2];
            const Vec3 its = offset_at(mesh, in, found.barycentric);
            const double half = norm(its);
            const Vec3 way = skin - from;
            if (!(std::abs(nearest - half) <= reach) || !(nearest > 0) ||
                std::abs(dot(way, its)) < kBondFacing * nearest * half)
              continue;
            const Vec3 normal = normalized(-face * off);  // into the upper body
            if (dot(normal, way) < kBondFacing * nearest) continue;
            BondPlace place;
            place.root = {mesh.root[in], mesh.root[t]};
            place.rest = 0.5 * (skin + from + (half / nearest) * way);
            place.normal = normal;
            place.area = area / (n * n);
            place.reach = kBondSevered * thinner;
            place.law = static_cast<std::int32_t>(out.laws.size());
            out.places.push_back(place);
          }
        }
    }
    if (out.places.size() == before)
      return at_line(scene, bond.line,
                     bad_input(fmt::format(
                         "{}: no skin of \"{}\" is within {:.3g} m of \"{}\"; move them together or give it more reach",
                         name, shown(bond.upper), reach, shown(bond.lower))));
    out.laws.push_back(*law);
    out.bodies.push_back(bodies);
  }
  for (const BondPlace& place : out.places) out.box = std::max(out.box, kBesideBond * spacing_of(place));
  for (std::size_t p = 0; p < out.places.size(); ++p) {
    const Vec3 r = out.places[p].rest;
    out.boxes[bond_box(static_cast<std::int64_t>(std::floor(r.x / out.box)),
                       static_cast<std::int64_t>(std::floor(r.y / out.box)),
                       static_cast<std::int64_t>(std::floor(r.z / out.box)))]
        .push_back(static_cast<std::int32_t>(p));
  }
  return out;
}

bool sweeps(const BladeEdge& from, const BladeEdge& to, Vec3 lower, Vec3 upper) {
  const Vec3 way = upper - lower;
  const auto through = [&](Vec3 a, Vec3 b, Vec3 c) {
    const Vec3 normal = cross(b - a, c - a);
    const double along = dot(normal, way);
    if (!(std::abs(along) > 0)) return false;
    const double s = dot(normal, a - lower) / along;
    if (!(s >= 0 && s <= 1)) return false;
    const Vec3 p = lower + s * way;
    const double u = dot(cross(b - a, p - a), normal), v = dot(cross(c - b, p - b), normal),
                 w = dot(cross(a - c, p - c), normal);
    return u >= 0 && v >= 0 && w >= 0;
  };
  return through(from.base, from.tip, to.tip) || through(from.base, to.tip, to.base);
}

}  // namespace kerf
