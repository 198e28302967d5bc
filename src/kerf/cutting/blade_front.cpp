#include "kerf/cutting/blade_front.h"

#include <algorithm>
#include <utility>

#include "kerf/cutting/lead_path.h"
#include "kerf/cutting/tolerances.h"
#include "kerf/spatial/triangle_queries.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using F = CollisionTriangle;
using Stop = CutStop;

}  // namespace

FrontFinder::FrontFinder(const CellComplex& complex, const PathRounding& rounding)
    : mesh_(complex.collision), rounding_(rounding), trail_step_(cut::kTrailStep * complex.mean_root_edge),
      faces_before_(mesh_.face_count()) {}

bool FrontFinder::locate(BladeFront& f) const {
  return locate(f.end, f.start.kind == Stop::Kind::kVertex && !f.in_slit ? f.start.vertex : V{});
}

bool FrontFinder::locate(RestPoint& p, V around) const {
  if (find_face(mesh_, p, around, rounding_.outside())) return true;
  // What the move has cut may have parted its face.
  for (F part(faces_before_); part.index() < mesh_.face_count(); ++part.value) {
    RestPoint there{part, p.at};
    if (mesh_.root[part] != mesh_.root[p.face] || !find_face(mesh_, there, {}, rounding_.outside())) continue;
    p = there;
    return true;
  }
  return false;
}

bool FrontFinder::move_to(BladeFront& f, Vec3 place) const {
  const RestPoint end = f.end;
  f.end.at = planar_of(mesh_, end.face, place);
  if (locate(f)) return true;
  f.end = end;
  return false;
}

std::vector<Vec3>::const_iterator FrontFinder::least_moved(const BladeFront& f, Vec3 to, double tolerance,
                                                           double& aside) const {
  const Vec3 is = rounding_.rest(f.end);
  BladeFront there{f.start, {}, f.end, {}, f.in_slit, {}, {}};
  auto best = f.trail.end();
  for (auto p = f.trail.end(); p != f.trail.begin() && aside > 0;) {
    --p;
    const auto leaves = [&](Vec3 q) { return distance_to_segment(q, *p, to) > tolerance; };
    if (leaves(is) || std::any_of(p + 1, f.trail.end(), leaves)) break;
    there.end = f.end;
    if (!move_to(there, *p)) continue;
    if (const double moved = rounding_.moved_aside(there.end, f.start); moved < aside) aside = moved, best = p;
  }
  return best;
}

V FrontFinder::twin_towards(V v, std::size_t vertices, const RestPoint& point) const {
  const auto is_twin = [&](std::size_t i) { return mesh_.rest[V(i)] == mesh_.rest[v] && V(i) != v; };
  std::size_t first = vertices;
  while (first < mesh_.vertex_count() && !is_twin(first)) ++first;
  RestPoint p = point;
  if (first == mesh_.vertex_count() || !locate(p, v)) return v;
  std::vector<ArcCrossing> way;
  const auto reaches = [&](V u) {
    return lead_path(mesh_, {rounding_.rest(u), {}, u}, {rounding_.rest(p), p.face, {}}, rounding_.outside(), way);
  };
  if (reaches(v)) return v;
  for (std::size_t i = first; i < mesh_.vertex_count(); ++i)
    if (is_twin(i) && reaches(V(i))) return V(i);
  return v;
}

bool FrontFinder::begin_at(BladeArc& arc, const BladeFront& f) const {
  if (begins_in(f.start, arc.faces.front())) return true;
  BladeArc led = arc;
  if (led.faces.front() != f.end.face) {
    if (!rounding_.lead(led, Stop::inside(f.end), next_of(led))) return false;
  }
  if (!begins_in(f.start, f.end.face) && !rounding_.lead(led, f.start, rounding_.rest(f.end))) return false;
  arc = std::move(led);
  return true;
}

bool FrontFinder::begins_in(const Stop& s, F face) const {
  return s.kind == Stop::Kind::kVertex ? has_corner(mesh_, face, s.vertex)
                                       : CollisionMesh::face(s.border(mesh_)) == face;
}

Vec3 FrontFinder::next_of(const BladeArc& arc) const {
  return !arc.crossings.empty() ? rounding_.rest(arc.crossings[0]) : rounding_.rest(rest_point(mesh_, arc.end.point));
}

void FrontFinder::note(BladeFront& f) const {
  if (!locate(f)) return;
  const Vec3 x = rounding_.rest(f.end);
  const BorderFoot foot = rounding_.own_lip(f.start, f.end.face, x);
  f.in_slit = foot.exists();
  if (f.in_slit) {
    if (const Stop there = rounding_.on_border(foot.border, foot.fraction); rounding_.is_near(there, x))
      f.start = there;
    f.trail.clear();
    if (f.touch) f.touch->needed = false;
  } else if (f.trail.empty() || norm(x - f.trail.back()) > trail_step_) {
    f.trail.push_back(x);
  }
}

}  // namespace kerf
