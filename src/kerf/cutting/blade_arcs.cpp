#include "kerf/cutting/blade_arcs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "kerf/base/at.h"
#include "kerf/cutting/tolerances.h"

namespace kerf {
namespace {

using V = CollisionVertex;
using H = CollisionHalfEdge;
using F = CollisionTriangle;
using Kind = ArcEnd::Kind;
using Weights = std::array<double, 3>;

/// Does a segment cross the ray from the origin to +x? 1: upwards, -1: downwards, the reverse of each other. A point on the ray's line counts as below it, a
/// segment through the origin as to the left: as if the origin were a little above and to the right of itself.
int crosses_ray(Vec2 p, Vec2 q) {
  if ((p.y > 0) == (q.y > 0)) return 0;
  return q.y > 0 ? (cross(p, q) > 0 ? 1 : 0) : (cross(p, q) < 0 ? -1 : 0);
}

/// The roots of a + b s + c s^2, by falling stability; HUGE_VAL for what is none.
std::array<double, 2> roots(double a, double b, double c) {
  const double square = std::sqrt(std::max(0.0, b * b - 4 * a * c)), far = -0.5 * (b + (b > 0 ? square : -square));
  return {far != 0 ? a / far : HUGE_VAL, c != 0 ? far / c : HUGE_VAL};
}

/// A vertex beside the blade's line.
struct Passing {
  Vec2 was, turned, is;
  double depth_was = 0, depth_is = 0;
  int crosses = 0;  // the ray, on the way from `was` by `turned` to `is`
  [[nodiscard]] Vec2 across(double t) const { return lerp(turned, is, t); }
  [[nodiscard]] double depth(double t) const { return depth_was + t * (depth_is - depth_was); }
};

/// Where an arc comes into a face, or leaves it.
struct Gate {
  Kind kind = Kind::kBorder;  // kBorder: over an edge, be it a border or not
  H edge;
  double fraction = 0;  // along `edge`
  double time = 0, depth = 0;
  Weights weights{};
};
/// Part of an arc within a face.
struct Piece {
  F face;
  Gate begin, end;
  int next = -1, before = -1;
};

class Search {
 public:
  Search(const CollisionMesh& mesh, const MovedMaterial& material, const BladeMove& move)
      : mesh_(mesh), material_(material), move_(move) {}

  std::vector<BladeArc> run(const FaceBoxes& boxes, std::span<const MovingFront> fronts, double near) {
    const PassedBoxes passed(move_, material_.farthest());
    boxes.for_each([&](const Box3& box) { return passed.may_pass(box); }, [&](F f) { add(f); });
    link();
    used_.assign(pieces_.size(), false);
    std::vector<BladeArc> arcs;
    take_fronts(fronts, near, arcs);
    for (const bool closed : {false, true})
      for (int i = 0; i < static_cast<int>(pieces_.size()); ++i)
        if (!used_[at(i)] && (closed || pieces_[at(i)].before < 0)) take(i, closed, arcs);
    return arcs;
  }

 private:
  V corner(F f, int k) const { return mesh_.from(CollisionMesh::corner(f, k)); }
  Passing passing(V v) const {
    const Vec3 was = material_.before[v.index()], is = material_.now[v.index()];
    Passing p{move_.was.across(was), {}, move_.is.across(is), move_.was.depth(was), move_.is.depth(is)};
    p.turned = move_.turn(p.was);
    p.crosses = crosses_ray(p.was, p.turned) + crosses_ray(p.turned, p.is);
    return p;
  }
  double length(double t) const { return move_.was.length + t * (move_.is.length - move_.was.length); }
  bool in_blade(const Gate& g) const { return g.depth >= 0 && g.depth <= length(g.time); }

  // ---- through one face

  /// Where the blade crosses an edge that it crosses once: the same bits for both faces, and for both lips of a cut.
  Gate on_edge(H h) const {
    const bool turned = is_less(mesh_.rest[mesh_.to(h)], mesh_.rest[mesh_.from(h)]);
    const Passing &from = corners_[at(h.value % 3)], &to = corners_[at((h.value + 1) % 3)], &p = turned ? to : from,
                  &q = turned ? from : to;
    // Both ends are in line with the blade: (1 - t)^2 first + t (1 - t) middle + t^2 last = 0.
    const double first = cross(p.turned, q.turned), last = cross(p.is, q.is),
                 middle = cross(p.turned, q.is) + cross(p.is, q.turned);
    Gate gate;
    double least = HUGE_VAL;
    const auto consider = [&](double t) {
      const double time = std::clamp(t, 0.0, 1.0);
      const Vec2 x = p.across(time), y = q.across(time), d = x - y;
      const double s = dot(d, d) > 0 ? std::clamp(dot(x, d) / dot(d, d), 0.0, 1.0) : 0.5, off = norm(lerp(x, y, s));
      if (!(off < least)) return;
      least = off;
      gate.time = time;
      gate.fraction = s;
    };
    for (const double t : roots(first, middle - 2 * first, first - middle + last)) consider(t);
    // An edge along the blade's way is in line with it all the time, and rounding says when: else the blade is nearest to an end of it.
    for (const Passing* end : {&p, &q}) {
      if (least < cut::kMoveAside * norm(q.is - p.is)) break;
      const Vec2 way = end->is - end->turned;
      if (dot(way, way) > 0) consider(-dot(end->turned, way) / dot(way, way));
    }
    gate.edge = h;
    gate.depth = p.depth(gate.time) + gate.fraction * (q.depth(gate.time) - p.depth(gate.time));
    gate.fraction = 1 - (1 - gate.fraction);  // so that this can be turned
    if (turned) gate.fraction = 1 - gate.fraction;
    gate.weights[at(h.value % 3)] = 1 - gate.fraction;
    gate.weights[at((h.value + 1) % 3)] = gate.fraction;
    return gate;
  }

  /// Where the blade's line goes through a face before (time 0) or now (1).
  Gate in_face(Kind kind, double time) const {
    Gate gate;
    gate.kind = kind;
    gate.time = time;
    Vec2 u[3];
    for (int k = 0; k < 3; ++k) u[k] = corners_[at(k)].across(time);
    double area = 0, sum = 0;
    for (int k = 0; k < 3; ++k) area += gate.weights[at(k)] = cross(u[(k + 1) % 3], u[(k + 2) % 3]);
    for (double& w : gate.weights) sum += w = std::max(0.0, area < 0 ? -w : w);
    for (double& w : gate.weights) w = sum > 0 ? w / sum : 1.0 / 3;
    for (int k = 0; k < 3; ++k) gate.depth += gate.weights[at(k)] * corners_[at(k)].depth(time);
    return gate;
  }

  void add(F f) {
    for (int k = 0; k < 3; ++k) corners_[at(k)] = passing(corner(f, k));
    if (!may_hold_blade()) return;
    struct Through {
      Gate gate;
      bool in;
    };
    std::array<Through, 8> gates;  // two an edge, and where it was and is
    std::size_t count = 0;
    int before = 0, now = 0;
    for (int k = 0; k < 3; ++k) {
      const Passing &a = corners_[at(k)], &b = corners_[at((k + 1) % 3)];
      const int was = crosses_ray(a.was, b.was), is = crosses_ray(a.is, b.is);
      before += was;
      now += is;
      const int out = was + b.crosses - is - a.crosses;
      for (int n = std::abs(out); n > 0; --n) gates[count++] = {on_edge(CollisionMesh::corner(f, k)), out < 0};
    }
    if (before != 0) gates[count++] = {in_face(Kind::kWas, 0), before > 0};
    if (now != 0) gates[count++] = {in_face(Kind::kIs, 1), now < 0};
    // As many lead in as out. In time, one of each follows the other; where rounding has mixed them up, any two do.
    const auto first = gates.begin(), last = first + static_cast<std::ptrdiff_t>(count);
    for (auto it = first; it != last; ++it)
      std::rotate(std::upper_bound(first, it, *it,
                                   [](const Through& a, const Through& b) { return a.gate.time < b.gate.time; }),
                  it, it + 1);
    for (auto it = first; it + 1 < last; it += 2) {
      const auto other = std::find_if(it + 1, last, [&](const Through& t) { return t.in != it->in; });
      if (other == last) return;
      std::rotate(it + 1, other, other + 1);
      clip(it->in ? Piece{f, it[0].gate, it[1].gate} : Piece{f, it[1].gate, it[0].gate});
    }
  }

  /// Is the blade's line in the hull of where the corners are, and its segment as deep?
  [[nodiscard]] bool may_hold_blade() const {
    Vec2 way;
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (const Passing& p : corners_) {
      way = way + (p.is - p.was);
      least = std::min({least, p.depth_was, p.depth_is}), most = std::max({most, p.depth_was, p.depth_is});
    }
    if (most < 0 || least > std::max(move_.was.length, move_.is.length)) return false;
    const auto holds = [&](auto&& coordinate) {
      bool above = false, below = false;
      for (const Passing& p : corners_)
        for (const Vec2 u : {p.was, p.turned, p.is}) above |= coordinate(u) >= 0, below |= coordinate(u) <= 0;
      return above && below;
    };
    return holds([&](Vec2 u) { return cross(way, u); }) && holds([](Vec2 u) { return u.x; }) &&
           holds([](Vec2 u) { return u.y; });
  }

  /// Adds the parts of a piece that the blade is long enough for.
  void clip(const Piece& piece) {
    const auto between = [&](double s, Kind kind) {
      Gate gate;
      gate.kind = kind;
      gate.time = piece.begin.time + s * (piece.end.time - piece.begin.time);
      for (int k = 0; k < 3; ++k) {
        gate.weights[at(k)] = piece.begin.weights[at(k)] + s * (piece.end.weights[at(k)] - piece.begin.weights[at(k)]);
        gate.depth += gate.weights[at(k)] * corners_[at(k)].depth(gate.time);
      }
      return gate;
    };
    const Gate middle = between(0.5, Kind::kBorder);
    std::array<std::pair<double, Kind>, 4> cuts;
    std::size_t count = 0;
    for (const Kind kind : {Kind::kBase, Kind::kTip}) {
      const auto off = [&](const Gate& g) { return kind == Kind::kBase ? g.depth : length(g.time) - g.depth; };
      const double begin = off(piece.begin), half = off(middle), end = off(piece.end);
      const double c = 2 * (begin + end) - 4 * half, b = end - begin - c;
      if (!(b * b - 4 * begin * c >= 0)) continue;
      for (const double s : roots(begin, b, c))
        if (s > 0 && s < 1) cuts[count++] = {s, kind};
    }
    std::sort(cuts.begin(), cuts.begin() + static_cast<std::ptrdiff_t>(count));
    const auto nearer = [&](const Gate& g) { return 2 * g.depth < length(g.time) ? Kind::kBase : Kind::kTip; };
    // The gates count by themselves: they are the same for the face beyond.
    bool inside = in_blade(piece.begin);
    Piece part = piece;
    const auto turn = [&](bool turns_in, double s, Kind kind) {
      if (turns_in == inside) return;
      inside = turns_in;
      (inside ? part.begin : part.end) = between(s, kind);
      if (!inside) pieces_.push_back(part);
    };
    for (std::size_t i = 0; i <= count; ++i) {
      const double a = i == 0 ? 0 : cuts[i - 1].first, b = i == count ? 1 : cuts[i].first;
      turn(in_blade(between(0.5 * (a + b), Kind::kBorder)), a, i == 0 ? nearer(piece.begin) : cuts[i - 1].second);
    }
    turn(in_blade(piece.end), 1, nearer(piece.end));
    if (!inside) return;
    part.end = piece.end;
    pieces_.push_back(part);
  }

  // ---- arcs

  void link() {
    std::vector<std::pair<H, int>> begins;
    for (int i = 0; i < static_cast<int>(pieces_.size()); ++i)
      if (pieces_[at(i)].begin.kind == Kind::kBorder) begins.push_back({pieces_[at(i)].begin.edge, i});
    std::sort(begins.begin(), begins.end());
    for (int i = 0; i < static_cast<int>(pieces_.size()); ++i) {
      if (pieces_[at(i)].end.kind != Kind::kBorder) continue;
      const H beyond = mesh_.twin[pieces_[at(i)].end.edge];
      if (!beyond.valid()) continue;
      for (auto it = std::lower_bound(begins.begin(), begins.end(), std::pair{beyond, -1});
           it != begins.end() && it->first == beyond; ++it) {
        if (pieces_[at(it->second)].before >= 0) continue;
        pieces_[at(i)].next = it->second;
        pieces_[at(it->second)].before = i;
        break;
      }
    }
  }

  std::vector<int> chain_of(int first, bool onward) {
    std::vector<int> chain;
    for (int p = first; p >= 0 && !used_[at(p)]; p = onward ? pieces_[at(p)].next : pieces_[at(p)].before) {
      chain.push_back(p);
      used_[at(p)] = true;
    }
    if (!onward) std::reverse(chain.begin(), chain.end());
    return chain;
  }

  /// The arc that begins with a piece, or goes round through it.
  void take(int first, bool closed, std::vector<BladeArc>& arcs) {
    const std::vector<int> chain = chain_of(first, true);
    BladeArc arc = make(chain);
    arc.closed = closed;
    if (closed) arc.crossings.push_back(crossing(pieces_[at(chain.back())]));
    else if (arc.end.time < arc.begin.time) arc.reverse();
    arcs.push_back(std::move(arc));
  }

  /// The nearest piece that begins (true) or ends (false) where a front is, or -1.
  std::pair<int, bool> piece_at(const MovingFront& front, double near) const {
    std::pair<int, bool> best{-1, true};
    double least = HUGE_VAL;
    for (int i = 0; i < static_cast<int>(pieces_.size()); ++i)
      for (const bool begins : {true, false}) {
        const Gate& gate = begins ? pieces_[at(i)].begin : pieces_[at(i)].end;
        if (gate.kind != Kind::kWas) continue;
        Vec3 x, rest;
        for (int k = 0; k < 3; ++k) {
          const CollisionVertex v = corner(pieces_[at(i)].face, k);
          x += gate.weights[at(k)] * material_.now[v.index()];
          rest += gate.weights[at(k)] * mesh_.rest[v];
        }
        const double far = norm(x - front.position);
        if (norm(rest - front.rest) >= near || far >= least) continue;
        least = far;
        best = {i, begins};
      }
    return best;
  }

  void take_fronts(std::span<const MovingFront> fronts, double near, std::vector<BladeArc>& arcs) {
    std::vector<std::pair<int, bool>> pieces;
    pieces.reserve(fronts.size());
    for (const MovingFront& f : fronts) pieces.push_back(piece_at(f, near));
    for (std::size_t i = 0; i < fronts.size(); ++i) {
      const auto [piece, begins] = pieces[i];
      if (piece < 0 || used_[at(piece)]) continue;  // another front has come to it
      const std::vector<int> chain = chain_of(piece, begins);
      BladeArc arc = make(chain);
      if (!begins) arc.reverse();
      arc.begin.kind = Kind::kFront;
      arc.begin.front = static_cast<int>(i);
      const std::pair<int, bool> last{begins ? chain.back() : chain.front(), !begins};
      const auto other = std::find(pieces.begin(), pieces.end(), last);
      if (other != pieces.end()) {
        arc.end.kind = Kind::kFront;
        arc.end.front = static_cast<int>(other - pieces.begin());
      }
      arcs.push_back(std::move(arc));
    }
  }

  ArcCrossing crossing(const Piece& p) const { return {p.end.edge, mesh_.twin[p.end.edge], p.end.fraction}; }
  static ArcEnd end_of(F face, const Gate& gate) {
    ArcEnd e;
    e.kind = gate.kind;
    if (e.kind == Kind::kBorder) {
      e.border = gate.edge;
      e.fraction = gate.fraction;
    }
    e.point = {face, gate.weights};
    e.time = gate.time;
    e.depth = gate.depth;
    return e;
  }
  BladeArc make(const std::vector<int>& chain) const {
    BladeArc arc;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const Piece& p = pieces_[at(chain[i])];
      arc.faces.push_back(p.face);
      arc.first = std::min({arc.first, p.begin.time, p.end.time});
      if (i + 1 < chain.size()) arc.crossings.push_back(crossing(p));
    }
    arc.begin = end_of(arc.faces.front(), pieces_[at(chain.front())].begin);
    arc.end = end_of(arc.faces.back(), pieces_[at(chain.back())].end);
    return arc;
  }

  const CollisionMesh& mesh_;
  MovedMaterial material_;
  const BladeMove& move_;
  std::array<Passing, 3> corners_;  // of the face at hand
  std::vector<Piece> pieces_;
  std::vector<char> used_;
};

}  // namespace

bool lies_along(const CollisionMesh& mesh, std::span<const Vec3> position, F face, Vec3 edge, double cosine) {
  const H h = CollisionMesh::corner(face, 0);
  const auto at_corner = [&](V v) { return position[v.index()]; };
  const Vec3 a = at_corner(mesh.from(h)), normal = cross(at_corner(mesh.to(h)) - a, at_corner(mesh.apex(h)) - a);
  return std::abs(dot(normal, edge)) < cosine * norm(normal);
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

std::vector<BladeArc> find_arcs(const CollisionMesh& mesh, const FaceBoxes& boxes, const MovedMaterial& material,
                                const BladeMove& move, std::span<const MovingFront> fronts, double near) {
  return Search(mesh, material, move).run(boxes, fronts, near);
}

}  // namespace kerf
