#include "kerf/cutting/blade_arcs.h"

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
using Kind = ArcEnd::Kind;

constexpr Kind kLines[4] = {Kind::kWas, Kind::kIs, Kind::kBase, Kind::kTip};

/// What one face has of an arc: part of the segment between the edges at which the plane crosses the face. Above is on its left.
struct Piece {
  F face;
  H in, out;
  double in_fraction = 0, out_fraction = 0;
  Vec2 q0, q1;
  bool along = false;                               // the face lies along the edge
  double from = 0, to = 1;                          // part of the segment
  Kind begin = Kind::kBorder, end = Kind::kBorder;  // kBorder: at the edge, be it a border or not
  int next = -1, before = -1;
};

class Search {
 public:
  Search(const CollisionMesh& mesh, std::span<const Vec3> position, const FaceBoxes& boxes, const Strip& strip)
      : mesh_(mesh), position_(position), boxes_(boxes), strip_(strip) {}

  std::vector<BladeArc> run(std::span<const ArcFront> fronts, double near, bool ahead_only) {
    if (!ahead_only) for_each_near([&](F face) { add(face); });
    for (const ArcFront& f : fronts)
      if (find(f.face) < 0) add_sorted({f.face});
    link();
    used_.assign(pieces_.size(), false);
    std::vector<BladeArc> arcs;
    take_fronts(fronts, near, arcs);
    for (const bool closed : {false, true})
      for (int i = 0; i < static_cast<int>(pieces_.size()); ++i)
        if (!used_[at(i)] && (closed || pieces_[at(i)].before < 0)) take_arc(i, closed, arcs);
    return arcs;
  }

 private:
  int beside(int piece, bool onward) const { return onward ? pieces_[at(piece)].next : pieces_[at(piece)].before; }

  /// What lies ahead of each front, up to the next one on the same arc.
  void take_fronts(std::span<const ArcFront> fronts, double near, std::vector<BladeArc>& arcs) {
    std::vector<int> piece_of, front_of(pieces_.size(), -1);
    std::vector<bool> onward;
    for (int i = 0; i < static_cast<int>(fronts.size()); ++i) {
      piece_of.push_back(piece_at(fronts[at(i)], near));
      onward.push_back(piece_of.back() >= 0 && goes_onward(piece_of.back(), fronts[at(i)]));
      if (piece_of.back() >= 0) front_of[at(piece_of.back())] = i;
    }
    for (int i = 0; i < static_cast<int>(fronts.size()); ++i) {
      const int piece = piece_of[at(i)];
      const bool on = onward[at(i)];
      if (piece < 0) continue;
      // Behind it nothing is left of the same arc: there the blade was.
      for (int p = beside(piece, !on); p >= 0 && p != piece && front_of[at(p)] < 0 && !used_[at(p)]; p = beside(p, !on))
        used_[at(p)] = true;
      if (used_[at(piece)]) continue;  // another front has come to it
      std::vector<int> chain{piece};
      int other = -1;
      for (int p = beside(piece, on); p >= 0 && p != piece && !used_[at(p)] && other < 0; p = beside(p, on)) {
        chain.push_back(p);
        other = front_of[at(p)];
      }
      for (const int p : chain) used_[at(p)] = true;
      if (!on) std::reverse(chain.begin(), chain.end());
      BladeArc arc = make(chain);
      if (!on) arc.reverse();
      arc.begin.kind = Kind::kFront;
      arc.begin.front = i;
      arc.begin.time = 0;
      if (other >= 0) {
        arc.end.kind = Kind::kFront;
        arc.end.front = other;
      }
      arcs.push_back(std::move(arc));
    }
  }

  /// The arc that begins with a piece, or goes round through it.
  void take_arc(int first, bool closed, std::vector<BladeArc>& arcs) {
    std::vector<int> chain;
    for (int p = first; p >= 0 && !used_[at(p)]; p = pieces_[at(p)].next) {
      chain.push_back(p);
      used_[at(p)] = true;
    }
    // What does not come back to its beginning lies beyond a front that another one has come to.
    if (closed && pieces_[at(chain.back())].next != first) return;
    BladeArc arc = make(chain);
    // Not yet begun, or passed by the move before. What lies along the blade as a whole is passed at one moment, be it the first or the last.
    const bool one_moment = arc.first > 1 - cut::kArcNow || std::max(arc.begin.time, arc.end.time) < cut::kArcNow;
    if (one_moment && extent(chain) < cut::kArcShort * strip_.length) return;
    arc.closed = closed;
    if (closed) arc.crossings.push_back(crossing(pieces_[at(chain.back())]));
    arcs.push_back(std::move(arc));
  }

  Vec3 place(V v) const { return position_[v.index()]; }

  template <class Fn>
  void for_each_near(Fn&& fn) const {
    const auto corner = [&](double x, double y) { return strip_.origin + x * strip_.along + y * strip_.motion; };
    Box3 box;
    for (const Vec3 p : {corner(0, 0), corner(strip_.length, 0), corner(strip_.base.x, strip_.base.y),
                         corner(strip_.tip.x, strip_.tip.y)})
      box.add(p);
    const double margin = cut::kArcMargin * (norm(box.min) + norm(box.max));
    box.min -= Vec3{margin, margin, margin};
    box.max += Vec3{margin, margin, margin};
    const Vec3 n = strip_.normal;
    const auto meets = [&](const Box3& b) {
      if (!boxes_meet(b, box)) return false;
      const Vec3 size = b.max - b.min;
      const double reach = 0.5 * (std::abs(n.x) * size.x + std::abs(n.y) * size.y + std::abs(n.z) * size.z) + margin;
      return std::abs(strip_.height(0.5 * (b.min + b.max))) <= reach;
    };
    boxes_.for_each(meets, fn);
  }

  /// Where the plane crosses an edge with ends on both sides, from the one above: the same bits for all who share it.
  double crossing_of(V above, V below) const {
    const double a = strip_.height(place(above)), b = strip_.height(place(below));
    return a - b > 0 ? a / (a - b) : 0.5;
  }

  void add(F face) {
    Piece piece;
    piece.face = face;
    for (int k = 0; k < 3; ++k) {
      const H h = CollisionMesh::corner(face, k);
      const bool from = strip_.height(place(mesh_.from(h))) > 0, to = strip_.height(place(mesh_.to(h))) > 0;
      if (from && !to) piece.out = h;
      if (to && !from) piece.in = h;
    }
    if (!piece.in.valid()) return;
    piece.out_fraction = crossing_of(mesh_.from(piece.out), mesh_.to(piece.out));
    const double in = crossing_of(mesh_.to(piece.in), mesh_.from(piece.in));
    piece.in_fraction = 1 - in;
    piece.q1 =
        lerp(strip_.local(place(mesh_.from(piece.out))), strip_.local(place(mesh_.to(piece.out))), piece.out_fraction);
    piece.q0 = lerp(strip_.local(place(mesh_.to(piece.in))), strip_.local(place(mesh_.from(piece.in))), in);
    piece.along = !strip_.done.empty() && lies_along(mesh_, position_, face, strip_.along, cut::kPathLeans);
    clip(piece);
  }

  bool is_done(Vec2 q) const {
    return std::any_of(strip_.done.begin(), strip_.done.end(),
                       [&](const auto& d) { return d[0].x < q.x && q.x < d[1].x && d[0].y < q.y && q.y < d[1].y; });
  }
  bool passed(const Piece& piece, double part) const {
    const Vec2 q = lerp(piece.q0, piece.q1, part);
    return strip_.passed(q) && !(piece.along && is_done(q));
  }

  /// Adds the parts of the segment that the edge has passed.
  void clip(Piece piece) {
    std::vector<std::pair<double, int>> cuts;
    for (int i = 0; i < 4; ++i) {
      const double a = strip_.side(i, piece.q0), b = strip_.side(i, piece.q1);
      if ((a > 0) != (b > 0)) cuts.push_back({a / (a - b), i});
    }
    if (piece.along)
      for (const auto& d : strip_.done)
        for (const Vec2 corner : d)
          for (const auto& [a, b] : {std::pair{piece.q0.x - corner.x, piece.q1.x - corner.x},
                                     std::pair{piece.q0.y - corner.y, piece.q1.y - corner.y}})
            if ((a > 0) != (b > 0)) cuts.push_back({a / (a - b), 0});
    std::sort(cuts.begin(), cuts.end());
    const std::size_t n = cuts.size();
    const auto nearest = [&](Vec2 q) {
      int best = 0;
      for (int i = 1; i < 4; ++i)
        if (std::abs(strip_.side(i, q)) < std::abs(strip_.side(best, q))) best = i;
      return kLines[best];
    };
    // The ends count by themselves: they are the same for the face beyond.
    bool inside = passed(piece, 0);
    piece.from = 0;
    piece.begin = Kind::kBorder;
    const auto turn = [&](bool now, double where, Kind kind) {
      if (now == inside) return;
      inside = now;
      if (now) {
        piece.from = where;
        piece.begin = kind;
      } else {
        piece.to = where;
        piece.end = kind;
        pieces_.push_back(piece);
      }
    };
    for (std::size_t i = 0; i <= n; ++i) {
      const double a = i == 0 ? 0 : cuts[i - 1].first, b = i == n ? 1 : cuts[i].first;
      turn(passed(piece, 0.5 * (a + b)), a, i == 0 ? nearest(piece.q0) : kLines[cuts[i - 1].second]);
    }
    turn(passed(piece, 1), 1, nearest(piece.q1));
    if (inside) {
      piece.to = 1;
      piece.end = Kind::kBorder;
      pieces_.push_back(piece);
    }
  }

  /// The first piece of a face, or -1. They come by rising face.
  int find(F face) const {
    const auto it =
        std::lower_bound(pieces_.begin(), pieces_.end(), face, [](const Piece& p, F f) { return p.face < f; });
    return it != pieces_.end() && it->face == face ? static_cast<int>(it - pieces_.begin()) : -1;
  }
  void add_sorted(const std::vector<F>& faces) {
    for (const F f : faces) add(f);
    std::stable_sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) { return a.face < b.face; });
  }

  void link() {
    for (std::size_t before = 0;
         before != pieces_.size();) {  // faces beyond, that were not looked for or that rounding left out
      before = pieces_.size();
      std::vector<F> beyond;
      for (const Piece& p : pieces_)
        for (const auto& [kind, edge] : {std::pair{p.begin, p.in}, std::pair{p.end, p.out}})
          if (const H t = mesh_.twin[edge];
              kind == Kind::kBorder && t.valid() && find(CollisionMesh::face(t)) < 0 &&
              std::find(beyond.begin(), beyond.end(), CollisionMesh::face(t)) == beyond.end())
            beyond.push_back(CollisionMesh::face(t));
      add_sorted(beyond);
    }
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const H t = mesh_.twin[pieces_[i].out];
      if (pieces_[i].end != Kind::kBorder || !t.valid()) continue;
      const int k = find(CollisionMesh::face(t));
      if (k < 0 || pieces_[at(k)].begin != Kind::kBorder) continue;
      pieces_[i].next = k;
      pieces_[at(k)].before = static_cast<int>(i);
    }
  }

  /// Which way along its arc a front goes on: away from where the blade was. That is the end at the last place; if both or none are, the way that its path
  /// came, where the arc crosses the blade the way that the edge moves, and else, or where the piece is too short to have a direction, away from the nearer end.
  bool goes_onward(int piece, const ArcFront& front) const {
    const Vec2 q = strip_.local(front.position);
    const auto end = [&](bool last) {
      int p = piece;
      for (int next = piece; next >= 0;) {
        p = next;
        next = beside(p, last);
        if (next == piece) break;
      }
      const Piece& it = pieces_[at(p)];
      return std::pair{(last ? it.end : it.begin) != Kind::kWas, norm(lerp(it.q0, it.q1, last ? it.to : it.from) - q)};
    };
    const auto first = end(false), last = end(true);
    const Vec2 on = pieces_[at(piece)].q1 - pieces_[at(piece)].q0;
    if (norm(on) < cut::kArcShort * strip_.length) return first <= last;
    const Vec3 way = way_at_rest(pieces_[at(piece)]);
    if (first.first == last.first && std::abs(dot(way, front.way)) > cut::kArcInLine * norm(way) * norm(front.way))
      return dot(way, front.way) > 0;
    if (first.first == last.first && std::abs(on.y) > cut::kArcInLine * norm(on)) return on.y > 0;
    return first <= last;
  }

  /// From where the plane enters a face to where it leaves it.
  Vec3 way_at_rest(const Piece& p) const {
    const auto on = [&](H h, double fraction) {
      return lerp(mesh_.rest[mesh_.from(h)], mesh_.rest[mesh_.to(h)], fraction);
    };
    return on(p.out, p.out_fraction) - on(p.in, p.in_fraction);
  }

  double distance(const Piece& p, Vec3 x) const {
    const Vec2 a = lerp(p.q0, p.q1, p.from), d = lerp(p.q0, p.q1, p.to) - a, q = strip_.local(x);
    const double s = dot(d, d) > 0 ? std::clamp(dot(q - a, d) / dot(d, d), 0.0, 1.0) : 0.0;
    return norm(q - a - s * d) + std::abs(strip_.height(x));
  }
  /// The whole arc of a piece is too short to tell from rounding: the plane only touches the faces where the edge was.
  bool is_short(int piece) const {
    const auto length = [&](int p) {
      return (pieces_[at(p)].to - pieces_[at(p)].from) * norm(pieces_[at(p)].q1 - pieces_[at(p)].q0);
    };
    const double least = cut::kArcShort * strip_.length;
    double sum = length(piece);
    for (const bool onward : {false, true})
      for (int p = beside(piece, onward); p >= 0 && p != piece && sum < least; p = beside(p, onward)) sum += length(p);
    return sum < least;
  }
  /// Where a front's arc begins: in its face; else, or if what is there is short, at the nearest end where the edge was in a face beside it.
  int piece_at(const ArcFront& front, double near) const {
    int own = find(front.face);
    for (int i = own + 1; own >= 0 && i < static_cast<int>(pieces_.size()) && pieces_[at(i)].face == front.face; ++i)
      if (distance(pieces_[at(i)], front.position) < distance(pieces_[at(own)], front.position)) own = i;
    if (own >= 0 && !is_short(own)) return own;
    const int other = piece_beside(front, near, false);
    if (other >= 0) return other;
    return own >= 0 ? own : piece_beside(front, near, true);
  }
  int piece_beside(const ArcFront& front, double near, bool short_ones) const {
    int best = -1;
    double least = near;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (is_short(static_cast<int>(i)) != short_ones) continue;
      bool touches = false;
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          touches |=
              mesh_.from(CollisionMesh::corner(pieces_[i].face, k)) == mesh_.from(CollisionMesh::corner(front.face, l));
      if (!touches) continue;
      const Vec2 q = strip_.local(front.position);
      for (const bool last : {false, true}) {
        if ((last ? pieces_[i].end : pieces_[i].begin) != Kind::kWas) continue;
        const double d = norm(lerp(pieces_[i].q0, pieces_[i].q1, last ? pieces_[i].to : pieces_[i].from) - q) +
                         std::abs(strip_.height(front.position));
        if (d >= least) continue;
        least = d;
        best = static_cast<int>(i);
      }
    }
    return best;
  }

  ArcCrossing crossing(const Piece& p) const { return {p.out, mesh_.twin[p.out], p.out_fraction}; }

  ArcEnd end(const Piece& p, bool last) const {
    ArcEnd e;
    e.kind = last ? p.end : p.begin;
    const double part = last ? p.to : p.from;
    if (e.kind == Kind::kBorder) {
      e.border = last ? p.out : p.in;
      e.fraction = last ? p.out_fraction : p.in_fraction;
    }
    e.point.face = p.face;
    e.point.weights = {};
    const auto add_to = [&](H h, double fraction, double weight) {
      e.point.weights[static_cast<std::size_t>(h.value % 3)] += weight * (1 - fraction);
      e.point.weights[static_cast<std::size_t>((h.value + 1) % 3)] += weight * fraction;
    };
    add_to(p.in, p.in_fraction, 1 - part);
    add_to(p.out, p.out_fraction, part);
    const Vec2 q = lerp(p.q0, p.q1, part);
    e.time = e.kind == Kind::kWas ? 0 : e.kind == Kind::kIs ? 1 : strip_.time(q);
    e.depth = q.x;
    return e;
  }

  /// Of the arc in its plane, from end to end, metres.
  double extent(const std::vector<int>& chain) const {
    const Piece &a = pieces_[at(chain.front())], &b = pieces_[at(chain.back())];
    return norm(lerp(b.q0, b.q1, b.to) - lerp(a.q0, a.q1, a.from));
  }

  BladeArc make(const std::vector<int>& chain) const {
    BladeArc arc;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const Piece& p = pieces_[at(chain[i])];
      arc.faces.push_back(p.face);
      if (i + 1 < chain.size()) arc.crossings.push_back(crossing(p));
      if (i + 1 < chain.size()) arc.first = std::min(arc.first, strip_.time(p.q1));
    }
    arc.begin = end(pieces_[at(chain.front())], false);
    arc.end = end(pieces_[at(chain.back())], true);
    arc.first = std::min({arc.first, arc.begin.time, arc.end.time});
    // The edge stands on a border to the last bit: a front that waits there.
    for (ArcEnd* e : {&arc.begin, &arc.end}) {
      const ArcEnd& other = e == &arc.end ? arc.begin : arc.end;
      if (e->kind == Kind::kBorder && e->time > 1 - cut::kArcNow && other.time < 1 - cut::kArcNow) e->kind = Kind::kIs;
    }
    return arc;
  }

  const CollisionMesh& mesh_;
  std::span<const Vec3> position_;
  const FaceBoxes& boxes_;
  const Strip& strip_;
  std::vector<Piece> pieces_;
  std::vector<bool> used_;
};

}  // namespace

bool lies_along(const CollisionMesh& mesh, std::span<const Vec3> position, F face, Vec3 edge, double cosine) {
  const H h = CollisionMesh::corner(face, 0);
  const auto at_corner = [&](V v) { return position[v.index()]; };
  const Vec3 a = at_corner(mesh.from(h)), normal = cross(at_corner(mesh.to(h)) - a, at_corner(mesh.apex(h)) - a);
  return std::abs(dot(normal, edge)) < cosine * norm(normal);
}

Strip Strip::make(const BladeEdge& from, const BladeEdge& to, std::span<const Vec3> fronts, double least) {
  Strip s;
  s.origin = to.base;
  s.length = norm(to.tip - to.base);
  s.along = (1 / s.length) * (to.tip - to.base);
  const auto behind = [&](Vec3 p) { return (to.base - p) + dot(p - to.base, s.along) * s.along; };
  Vec3 motion;
  for (const Vec3 p : fronts) motion += (1.0 / static_cast<double>(fronts.size())) * behind(p);
  if (!(norm(motion) > least))
    for (const Vec3 p : {0.5 * (from.base + from.tip), from.base, from.tip})
      if (norm(behind(p)) > (1 + 1e-9) * norm(motion)) motion = behind(p);
  s.stands = !(norm(motion) > least);
  if (s.stands) motion = std::abs(s.along.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  motion -= dot(motion, s.along) * s.along;
  s.motion = normalized(motion);
  s.normal = cross(s.along, s.motion);
  s.base = s.local(from.base);
  s.tip = s.local(from.tip);
  if (s.tip.x - s.base.x > 0) s.slope = (s.tip.y - s.base.y) / (s.tip.x - s.base.x);
  s.offset = s.base.y - s.slope * s.base.x;
  // As the fronts have been carried: moved, and turned if they lie apart.
  if (!fronts.empty()) {
    Vec2 mean, first{HUGE_VAL, 0}, last{-HUGE_VAL, 0};
    for (const Vec3 p : fronts) {
      const Vec2 q = s.local(p);
      mean = mean + (1.0 / static_cast<double>(fronts.size())) * q;
      if (q.x < first.x) first = q;
      if (q.x > last.x) last = q;
    }
    if (last.x - first.x > 0.1 * s.length) s.slope = (last.y - first.y) / (last.x - first.x);
    s.offset = mean.y - s.slope * mean.x;
  }
  const auto far = [&] {
    return std::max(std::abs(s.offset + s.slope * s.base.x), std::abs(s.offset + s.slope * s.tip.x));
  };
  if (!(far() > least)) s.offset -= least;
  s.base.y = s.offset + s.slope * s.base.x;
  s.tip.y = s.offset + s.slope * s.tip.x;
  return s;
}

double Strip::time(Vec2 q) const {
  const double last = ahead_of_last(q), moved = last - q.y;
  return moved != 0 ? std::clamp(last / moved, 0.0, 1.0) : 0.5;
}

bool Strip::passed(Vec2 q) const {
  if ((ahead_of_last(q) > 0) == (q.y > 0)) return false;
  const double t = time(q);
  return q.x >= (1 - t) * base.x && q.x <= (1 - t) * tip.x + t * length;
}

double Strip::side(int line, Vec2 q) const {
  if (line == 0) return ahead_of_last(q);
  if (line == 1) return q.y;
  const Vec2 a = line == 2 ? base : tip, b = line == 2 ? Vec2{0, 0} : Vec2{length, 0};
  const double far = norm(b - a);
  return far > 0 ? cross(b - a, q - a) / far : HUGE_VAL;
}

void BladeArc::reverse() {
  std::swap(begin, end);
  if (closed && !crossings.empty()) std::rotate(crossings.begin(), crossings.end() - 1, crossings.end());
  std::reverse(faces.begin(), faces.end());
  std::reverse(crossings.begin(), crossings.end());
  for (ArcCrossing& c : crossings) {
    std::swap(c.near, c.far);
    c.fraction = 1 - c.fraction;
  }
}

std::vector<BladeArc> find_arcs(const CollisionMesh& mesh, std::span<const Vec3> position, const FaceBoxes& boxes,
                                const Strip& strip, std::span<const ArcFront> fronts, double near, bool ahead_only) {
  return Search(mesh, position, boxes, strip).run(fronts, near, ahead_only);
}

}  // namespace kerf
