// A body to punch and shave, and whether its surface crosses itself.
#pragma once

#include <optional>

#include "cutting/cut_body.h"
#include "kerf/cutting/punch.h"
#include "kerf/cutting/wall_points.h"

namespace kerf::testing_support {

struct PunchBody : CutBody {
  std::vector<Vec3> position;
  std::string last_error;
  using CutBody::CutBody;
  explicit PunchBody(CutBody b) : CutBody(std::move(b)) {}

  std::optional<PunchCut> punch(const Punch& p, bool check = true) {
    position = body.collision.rest.raw();
    JournalMark mark;
    journal_mark(body, mark);
    auto cut = cut_punch(body, position, p, options, scratch);
    if (!cut) {
      journal_rollback(body, mark);
      ++refused;
      last_error = cut.error().message;
      return std::nullopt;
    }
    EXPECT_EQ(position.size(), body.collision.vertex_count());
    if (check) expect_valid();
    return *cut;
  }
  [[nodiscard]] double area(const std::vector<CollisionTriangle>& faces) const {
    double sum = 0;
    for (const CollisionTriangle f : faces) {
      Vec3 p[3];
      for (int i = 0; i < 3; ++i) p[i] = body.collision.rest[body.collision.origin[CollisionMesh::corner(f, i)]];
      sum += 0.5 * norm(cross(p[1] - p[0], p[2] - p[0]));
    }
    return sum;
  }
};

inline Punch circle(Vec2 centre, double radius, double tolerance = 0.005) {
  Punch p;
  p.centre = {centre.x, centre.y, 0};
  p.outline = circle_outline(radius, tolerance);
  return p;
}

/// The outline in the world's x and y.
inline std::vector<Vec2> placed(const Punch& p) {
  const Vec3 z = normalized(p.axis), x = normalized(p.across - dot(p.across, z) * z), y = cross(z, x);
  std::vector<Vec2> outline;
  for (const Vec2 q : p.outline) {
    const Vec3 w = p.centre + q.x * x + q.y * y;
    outline.push_back({w.x, w.y});
  }
  return outline;
}

/// Do two triangles without a common vertex cross? Brute force, by edges through triangles.
inline bool triangles_cross(const Vec3* a, const Vec3* b) {
  const auto pierces = [](Vec3 p, Vec3 q, const Vec3* t) {
    const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
    const double hp = dot(n, p - t[0]), hq = dot(n, q - t[0]);
    if ((hp > 0) == (hq > 0)) return false;
    const Vec3 x = lerp(p, q, hp / (hp - hq));
    const double tolerance = 1e-9 * dot(n, n);
    for (int i = 0; i < 3; ++i)
      if (dot(n, cross(t[(i + 1) % 3] - t[i], x - t[i])) < tolerance) return false;
    return true;
  };
  for (int i = 0; i < 3; ++i)
    if (pierces(a[i], a[(i + 1) % 3], b) || pierces(b[i], b[(i + 1) % 3], a)) return true;
  return false;
}

/// Where two visual triangles of the largest piece cross each other, at least one of them of a wall: between their middles. (A loose part that is
/// punched again may be cut through the dents that an earlier punch left in it.)
inline std::vector<Vec3> crossing_places(const CellComplex& body) {
  const VisualMesh& m = body.visual;
  const Pieces pieces = visual_pieces(body);
  const std::size_t n = m.face_count();
  std::vector<std::array<Vec3, 3>> t(n);
  std::vector<Box3> box(n);
  for (std::size_t f = 0; f < n; ++f)
    for (std::size_t i = 0; i < 3; ++i) {
      t[f][i] = m.rest[m.origin[VisualHalfEdge(3 * f + i)]];
      box[f].add(t[f][i]);
    }
  std::vector<int> size(static_cast<std::size_t>(pieces.count), 0);
  for (const std::int32_t p : pieces.of_face) ++size[static_cast<std::size_t>(p)];
  const auto largest = static_cast<std::int32_t>(std::max_element(size.begin(), size.end()) - size.begin());
  std::vector<Vec3> places;
  for (std::size_t f = 0; f < n; ++f) {
    if (pieces.of_face[f] != largest) continue;
    if (!m.patch[VisualTriangle(f)].is_wall()) continue;
    for (std::size_t g = 0; g < n; ++g) {
      if (g == f || pieces.of_face[f] != pieces.of_face[g] || (g < f && m.patch[VisualTriangle(g)].is_wall())) continue;
      if (box[f].min.x > box[g].max.x || box[g].min.x > box[f].max.x || box[f].min.y > box[g].max.y ||
          box[g].min.y > box[f].max.y || box[f].min.z > box[g].max.z || box[g].min.z > box[f].max.z)
        continue;
      bool shares = false;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          shares = shares || m.origin[VisualHalfEdge(3 * f + i)] == m.origin[VisualHalfEdge(3 * g + j)];
      if (!shares && triangles_cross(t[f].data(), t[g].data()))
        places.push_back((1.0 / 6) * (t[f][0] + t[f][1] + t[f][2] + t[g][0] + t[g][1] + t[g][2]));
    }
  }
  return places;
}
inline int crossing_pairs(const CellComplex& body) { return static_cast<int>(crossing_places(body).size()); }

inline std::vector<WallId> walls_of(const CellComplex& body, const std::vector<CollisionHalfEdge>& lips) {
  std::vector<WallId> walls;
  for (const CollisionHalfEdge h : lips) walls.push_back(body.collision.wall[h]);
  return walls;
}

}  // namespace kerf::testing_support
