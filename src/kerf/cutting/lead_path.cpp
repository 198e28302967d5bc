#include "kerf/cutting/lead_path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kerf/base/at.h"
#include "kerf/cutting/tolerances.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;

/// Where an edge comes nearest to the segment that is led along.
struct Nearest {
  double distance = 0, fraction = 0;
};

/// The segment from the origin to `end`, in the plane that all is seen in.
class Chord {
 public:
  Chord(const CollisionMesh& mesh, const PathPlace& from, const PathPlace& to) : mesh_(mesh), origin_(from.at) {
    Vec3 up;
    const auto add = [&](F f) {
      const H h = CollisionMesh::corner(f, 0);
      const Vec3 p = mesh.rest[mesh.from(h)];
      up += cross(mesh.rest[mesh.to(h)] - p, mesh.rest[mesh.apex(h)] - p);
    };
    if (from.face.valid()) add(from.face);
    else mesh.for_each_outgoing(from.corner, [&](H h) { return add(CollisionMesh::face(h)), true; });
    const Vec3 side = std::abs(up.x) < std::abs(up.y) ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    x_ = normalized(cross(side, up));
    y_ = normalized(cross(up, x_));
    end_ = seen(to.at);
  }

  Nearest nearest(H h) const {
    const Vec2 a = seen(mesh_.rest[mesh_.from(h)]), b = seen(mesh_.rest[mesh_.to(h)]);
    const double side_a = cross(end_, a), side_b = cross(end_, b);
    if ((side_a > 0) !=
        (side_b > 0)) {  // the line crosses the edge; the segment too, if both its ends are on different sides
      const double s = side_a / (side_a - side_b), along = dot(lerp(a, b, s), end_);
      if (along >= 0 && along <= dot(end_, end_)) return {0, s};
    }
    Nearest best{HUGE_VAL, 0};
    const auto consider = [&](double distance, double fraction) {
      if (distance < best.distance) best = {distance, fraction};
    };
    for (const Vec2 p : {Vec2{}, end_}) {
      const double s = foot(p, a, b);
      consider(norm(p - lerp(a, b, s)), s);
    }
    consider(norm(a - foot(a, {}, end_) * end_), 0);
    consider(norm(b - foot(b, {}, end_) * end_), 1);
    return best;
  }

 private:
  Vec2 seen(Vec3 p) const { return {dot(p - origin_, x_), dot(p - origin_, y_)}; }
  static double foot(Vec2 p, Vec2 a, Vec2 b) {
    const double length2 = dot(b - a, b - a);
    return length2 > 0 ? std::clamp(dot(p - a, b - a) / length2, 0.0, 1.0) : 0.0;
  }

  const CollisionMesh& mesh_;
  Vec3 origin_, x_, y_;
  Vec2 end_;
};

}  // namespace

bool lead_path(const CollisionMesh& mesh, const PathPlace& from, const PathPlace& to, double reach,
               std::vector<ArcCrossing>& way) {
  struct Node {
    F face;
    int before = -1;
    ArcCrossing over;
    double cost = 0;
    bool done = false;
  };
  way.clear();
  const Chord chord(mesh, from, to);
  const double step = cut::kLeadStep * reach;
  std::array<Node, cut::kLeadFaces> nodes;
  int count = 0;
  const auto add = [&](const Node& n) {
    if (count < cut::kLeadFaces) nodes[at(count++)] = n;
  };
  if (from.face.valid()) add({from.face, -1, {}, 0, false});
  else mesh.for_each_outgoing(from.corner, [&](H h) { return add({CollisionMesh::face(h), -1, {}, 0, false}), true; });
  const auto arrived = [&](F f) {
    if (to.face.valid()) return f == to.face;
    for (int k = 0; k < 3; ++k)
      if (mesh.from(CollisionMesh::corner(f, k)) == to.corner) return true;
    return false;
  };
  for (;;) {
    int best = -1;
    for (int i = 0; i < count; ++i)
      if (!nodes[at(i)].done && (best < 0 || nodes[at(i)].cost < nodes[at(best)].cost)) best = i;
    if (best < 0) return false;
    nodes[at(best)].done = true;
    const F face = nodes[at(best)].face;
    const double cost = nodes[at(best)].cost;
    if (arrived(face)) {
      for (int i = best; nodes[at(i)].before >= 0; i = nodes[at(i)].before) way.push_back(nodes[at(i)].over);
      std::reverse(way.begin(), way.end());
      return true;
    }
    for (int k = 0; k < 3; ++k) {
      const H near = CollisionMesh::corner(face, k), far = mesh.twin[near];
      if (!far.valid()) continue;
      const Nearest n = chord.nearest(near);
      if (n.distance > reach) continue;
      const F beyond = CollisionMesh::face(far);
      const double there = cost + n.distance + step;
      int known = 0;
      while (known < count && nodes[at(known)].face != beyond) ++known;
      const Node node{beyond, best, {near, far, n.fraction}, there, false};
      if (known == count) add(node);
      else if (!nodes[at(known)].done && there < nodes[at(known)].cost) nodes[at(known)] = node;
    }
  }
}

}  // namespace kerf
