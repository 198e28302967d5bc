#include "kerf/contact/sunk_walls.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/contact/detect_scratch.h"
#include "kerf/contact/triangle_foot.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Faces, or borders, that a place may have moved on to since the last step.
constexpr int kMostFaces = 4;
/// What is deeper than this part of the half thickness came in some other way than its nearest one out, or can't be held: near the tip of a cut, where all hangs
/// together, or where faces are folded sharply.
constexpr double kHopeless = 0.3;
/// Places of a wall are at least so far apart along it, parts of its length: what is nearer is the same place, which slides along.
constexpr double kSamePlace = 0.06;

/// The nearest place on the way out, and where out is.
struct Exit {
  SurfacePoint foot;
  Vec3 normal;
};

/// Over a ridge or under a valley the edge between two faces is nearest of both, and the last one serves. Is it that, or is the place beside?
bool is_over_edge(const SurfaceState& body, Vec3 p, const Exit& exit) {
  const Vec3 d = p - place_of(body, exit.foot), beside = d - dot(exit.normal, d) * exit.normal;
  return norm(beside) < std::fabs(dot(exit.normal, d));
}

/// On the side of a face, or of the one that the place has moved on to; false: it is beside all of them.
bool find_exit_of_face(const SurfaceState& body, Vec3 p, WayOut& out, Exit& exit) {
  const ContactSurface& s = *body.surface;
  for (int i = 0; i < kMostFaces; ++i) {
    const F f = ContactSurface::face(out.edge);
    const auto v = s.vertices(f);
    const std::array<Vec3, 3> t{lifted_corner(body, v[0], out.side), lifted_corner(body, v[1], out.side),
                                lifted_corner(body, v[2], out.side)};
    const std::array<double, 3> weights = nearest_foot(p, t).weights();
    exit.foot = {0, {v[0], v[1], v[2]}, weights, static_cast<double>(out.side)};
    const Vec3 n = normalized(cross(t[1] - t[0], t[2] - t[0]));
    exit.normal = dot(n, body.offset[v[0].index()] + body.offset[v[1].index()] + body.offset[v[2].index()]) < 0
                      ? -out.side * n
                      : out.side * n;
    if (is_inside(weights)) return true;
    const int opposite = opposite_corner(weights);
    const H h = ContactSurface::corner(f, opposite >= 0     ? (opposite + 1) % 3
                                          : weights[0] == 1 ? 0
                                          : weights[1] == 1 ? 1
                                                            : 2);
    if (!s.twin[h].valid()) return false;
    out.edge = s.twin[h];
  }
  return is_over_edge(body, p, exit);
}

/// The border that goes on from h at its end, or leads to its beginning; none where there is no other.
H next_border(const ContactSurface& s, H h, bool at_end) {
  H next;
  s.for_each_outgoing(at_end ? s.to(h) : s.from(h), [&](H g) {
    const H candidate = at_end ? g : ContactSurface::prev(g);
    if (!s.twin[candidate].valid() && candidate != h) next = candidate;
    return !next.valid();
  });
  return next;
}

/// On the wall over a border, or over one of those that it has slid on to; false: it is beside all of them, above or below.
bool find_exit_of_wall(const SurfaceState& body, Vec3 p, WayOut& out, Exit& exit) {
  const ContactSurface& s = *body.surface;
  for (int i = 0; i < kMostFaces; ++i) {
    const V a = s.from(out.edge), b = s.to(out.edge), apex = s.from(ContactSurface::prev(out.edge));
    const Vec3 low = lifted_corner(body, a, -1), high = lifted_corner(body, b, 1);
    const TriangleFoot under = nearest_foot(p, {low, lifted_corner(body, b, -1), high}),
                       over = nearest_foot(p, {low, high, lifted_corner(body, a, 1)});
    const bool is_under = under.square <= over.square;
    const std::array<double, 3> w = is_under ? under.weights() : over.weights();
    const double along = is_under ? w[1] + w[2] : w[1], lift = is_under ? w[2] - w[0] - w[1] : w[1] + w[2] - w[0];
    if (!(std::fabs(lift) < 1)) return false;
    exit.foot = {0, {a, b, V()}, {1 - along, along, 0}, lift};
    const Vec3 n = normalized(cross(lifted_corner(body, b, lift) - lifted_corner(body, a, lift),
                                    lerp(body.offset[a.index()], body.offset[b.index()], along)));
    exit.normal =
        dot(n, lerp(body.position[a.index()], body.position[b.index()], along) - body.position[apex.index()]) < 0 ? -n
                                                                                                                  : n;
    if (along > 0 && along < 1) return true;
    const H next = next_border(s, out.edge, along >= 1);
    if (!next.valid()) return false;
    out.edge = next;
  }
  return is_over_edge(body, p, exit);
}

/// A wall has places at both of its rims.
bool is_upper(const SunkWall& wall) { return wall.lift > 0; }

/// Are both still there, and is the wall that of a cut?
bool are_there(const ContactSurface& s, const SunkWall& wall) {
  return wall.edge.index() < s.twin.size() && s.cut[wall.edge] != 0 && wall.out.edge.index() < s.twin.size() &&
         (wall.out.side != 0 || !s.twin[wall.out.edge].valid());
}

double hopeless_depth(const ContactSurface& s, H edge) {
  return kHopeless * std::max(s.radius[s.from(edge)], s.radius[s.to(edge)]);
}

/// The contact of a wall; false: there is none any more.
bool find_contact(const SurfaceState& body, double margin, SunkWall& wall, Contact& c) {
  const ContactSurface& s = *body.surface;
  if (!are_there(s, wall)) return false;
  c.a = {0, {s.from(wall.edge), s.to(wall.edge), V()}, {1 - wall.along, wall.along, 0}, wall.lift};
  const Vec3 p = place_of(body, c.a);
  Exit exit;
  if (!(wall.out.side != 0 ? find_exit_of_face(body, p, wall.out, exit) : find_exit_of_wall(body, p, wall.out, exit)))
    return false;
  c.b = exit.foot;
  c.point = place_of(body, c.b);
  c.normal = exit.normal;
  c.gap = dot(c.normal, p - c.point);
  return c.gap < margin && c.gap > -hopeless_depth(s, wall.edge) && std::fabs(dot(c.normal, c.normal) - 1) < 1e-6;
}

}  // namespace

void remember_sunk_walls(const ContactSurface& surface, std::span<const DepthSearch::Deep> deep, DetectMemory& memory) {
  for (const DepthSearch::Deep& d : deep) {
    SunkWall wall{{}, d.point.weight[1], d.point.lift, d.depth, d.out, false};
    surface.for_each_outgoing(d.point.vertex[0], [&](H h) {
      if (surface.to(h) == d.point.vertex[1] && surface.cut[h] != 0) wall.edge = h;
      return !wall.edge.valid();
    });
    if (!wall.edge.valid() || d.depth > hopeless_depth(surface, wall.edge)) continue;
    const auto is_it = [&](const SunkWall& w) {
      return w.edge == wall.edge && is_upper(w) == is_upper(wall) && std::fabs(w.along - wall.along) < kSamePlace;
    };
    if (std::any_of(memory.walls.begin(), memory.walls.end(),
                    [&](const SunkWall& w) { return is_it(w) && w.depth >= wall.depth; }))
      continue;
    // Places that are known move to where the wall is deepest by now, but it goes out as it has begun to.
    double nearest = HUGE_VAL;
    for (const SunkWall& w : memory.walls) {
      if (!is_it(w) || !w.held || !(std::fabs(w.along - wall.along) < nearest)) continue;
      nearest = std::fabs(w.along - wall.along);
      wall.out = w.out;
      wall.held = true;
    }
    std::erase_if(memory.walls, is_it);
    memory.walls.push_back(wall);
  }
}

void forget_sunk_walls(const ContactSurface& surface, std::span<const F> changed, DetectMemory& memory) {
  const auto is_gone = [&](H h) {
    const F f = ContactSurface::face(h);
    return f.index() >= surface.face_count() || std::binary_search(changed.begin(), changed.end(), f);
  };
  std::erase_if(memory.walls, [&](const SunkWall& w) { return is_gone(w.edge) || is_gone(w.out.edge); });
}

void add_sunk_walls(const SurfaceState& body, double margin, double friction, DetectMemory& memory,
                    std::vector<Contact>& contacts) {
  if (memory.walls.empty()) return;
  std::size_t kept = 0;
  for (SunkWall wall : memory.walls) {
    Contact c;
    if (!find_contact(body, margin, wall, c)) continue;
    c.friction = friction;
    const long place = 2 * std::lround(wall.along / kSamePlace) + (is_upper(wall) ? 1 : 0);
    c.key = contact_key({ContactKind::kSunkWall, static_cast<std::int32_t>(place), 0, 0, 0, wall.edge.value, 0});
    contacts.push_back(c);
    wall.depth = std::max(0.0, -c.gap);
    wall.held = true;
    memory.walls[kept++] = wall;
  }
  memory.walls.resize(kept);
  std::sort(contacts.begin(), contacts.end(), [](const Contact& a, const Contact& b) { return a.key < b.key; });
}

}  // namespace kerf
