#include "kerf/cutting/space_time_arcs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "kerf/base/at.h"
#include "kerf/base/indexed.h"
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
  Search(const CollisionMesh& mesh, std::span<const Vec3> before, std::span<const Vec3> now, const BladeMove& move)
      : mesh_(mesh), now_(now), move_(move) {
    passing_.reserve(mesh.vertex_count());
    for (std::size_t i = 0; i < mesh.vertex_count(); ++i) {
      Passing p{
          move.was.across(before[i]), {}, move.is.across(now[i]), move.was.depth(before[i]), move.is.depth(now[i])};
      p.turned = move.turn(p.was);
      p.crosses = crosses_ray(p.was, p.turned) + crosses_ray(p.turned, p.is);
      passing_.push_back(p);
    }
  }

  std::vector<BladeArc> run(std::span<const MovingFront> fronts, double near) {
    for (const F f : ids<F>(mesh_.face_count())) add(f);
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
  const Passing& passing(V v) const { return passing_[v.index()]; }
  double length(double t) const { return move_.was.length + t * (move_.is.length - move_.was.length); }
  bool in_blade(const Gate& g) const { return g.depth >= 0 && g.depth <= length(g.time); }

  // ---- through one face

  /// Where the blade crosses an edge that it crosses once: the same bits for both faces.
  Gate on_edge(H h) const {
    const bool turned = mesh_.to(h) < mesh_.from(h);
    const Passing &p = passing(turned ? mesh_.to(h) : mesh_.from(h)),
                  &q = passing(turned ? mesh_.from(h) : mesh_.to(h));
    // Both ends are in line with the blade: (1 - t)^2 first + t (1 - t) middle + t^2 last = 0.
    const double first = cross(p.turned, q.turned), last = cross(p.is, q.is),
                 middle = cross(p.turned, q.is) + cross(p.is, q.turned);
    Gate gate;
    double least = HUGE_VAL;
    for (const double t : roots(first, middle - 2 * first, first - middle + last)) {
      const double time = std::clamp(t, 0.0, 1.0);
      const Vec2 x = p.across(time), y = q.across(time), d = x - y;
      const double s = dot(d, d) > 0 ? std::clamp(dot(x, d) / dot(d, d), 0.0, 1.0) : 0.5, off = norm(lerp(x, y, s));
      if (!(off < least)) continue;
      least = off;
      gate.time = time;
      gate.fraction = s;
    }
    gate.edge = h;
    gate.depth = p.depth(gate.time) + gate.fraction * (q.depth(gate.time) - p.depth(gate.time));
    if (turned) gate.fraction = 1 - gate.fraction;
    gate.weights[at(h.value % 3)] = 1 - gate.fraction;
    gate.weights[at((h.value + 1) % 3)] = gate.fraction;
    return gate;
  }

  /// Where the blade's line goes through a face before (time 0) or now (1).
  Gate in_face(F f, Kind kind, double time) const {
    Gate gate;
    gate.kind = kind;
    gate.time = time;
    Vec2 u[3];
    for (int k = 0; k < 3; ++k) u[k] = passing(corner(f, k)).across(time);
    double area = 0, sum = 0;
    for (int k = 0; k < 3; ++k) area += gate.weights[at(k)] = cross(u[(k + 1) % 3], u[(k + 2) % 3]);
    for (double& w : gate.weights) sum += w = std::max(0.0, area < 0 ? -w : w);
    for (double& w : gate.weights) w = sum > 0 ? w / sum : 1.0 / 3;
    for (int k = 0; k < 3; ++k) gate.depth += gate.weights[at(k)] * passing(corner(f, k)).depth(time);
    return gate;
  }

  void add(F f) {
    const Passing* p[3];
    Vec2 least{HUGE_VAL, HUGE_VAL}, most{-HUGE_VAL, -HUGE_VAL};
    for (int k = 0; k < 3; ++k) {
      p[k] = &passing(corner(f, k));
      for (const Vec2 u : {p[k]->was, p[k]->turned, p[k]->is}) {
        least = {std::min(least.x, u.x), std::min(least.y, u.y)};
        most = {std::max(most.x, u.x), std::max(most.y, u.y)};
      }
    }
    if (most.x < 0 || least.x > 0 || most.y < 0 || least.y > 0) return;
    struct Through {
      Gate gate;
      bool in;
    };
    std::vector<Through> gates;
    int before = 0, now = 0;
    for (int k = 0; k < 3; ++k) {
      const Passing &a = *p[k], &b = *p[(k + 1) % 3];
      const int was = crosses_ray(a.was, b.was), is = crosses_ray(a.is, b.is);
      before += was;
      now += is;
      const int out = was + b.crosses - is - a.crosses;
      for (int n = std::abs(out); n > 0; --n) gates.push_back({on_edge(CollisionMesh::corner(f, k)), out < 0});
    }
    if (before != 0) gates.push_back({in_face(f, Kind::kWas, 0), before > 0});
    if (now != 0) gates.push_back({in_face(f, Kind::kIs, 1), now < 0});
    // As many lead in as out. In time, one of each follows the other; where rounding has mixed them up, any two do.
    std::stable_sort(gates.begin(), gates.end(),
                     [](const Through& a, const Through& b) { return a.gate.time < b.gate.time; });
    for (std::size_t i = 0; i + 1 < gates.size(); i += 2) {
      std::size_t other = i + 1;
      while (other < gates.size() && gates[other].in == gates[i].in) ++other;
      if (other == gates.size()) return;
      std::rotate(gates.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                  gates.begin() + static_cast<std::ptrdiff_t>(other),
                  gates.begin() + static_cast<std::ptrdiff_t>(other) + 1);
      const bool turned = !gates[i].in;
      clip({f, gates[i + (turned ? 1 : 0)].gate, gates[i + (turned ? 0 : 1)].gate, -1, -1});
    }
  }

  /// Adds the parts of a piece that the blade is long enough for.
  void clip(const Piece& piece) {
    const auto between = [&](double s, Kind kind) {
      Gate gate;
      gate.kind = kind;
      gate.time = piece.begin.time + s * (piece.end.time - piece.begin.time);
      for (int k = 0; k < 3; ++k) {
        gate.weights[at(k)] = piece.begin.weights[at(k)] + s * (piece.end.weights[at(k)] - piece.begin.weights[at(k)]);
        gate.depth += gate.weights[at(k)] * passing(corner(piece.face, k)).depth(gate.time);
      }
      return gate;
    };
    const Gate middle = between(0.5, Kind::kBorder);
    std::vector<std::pair<double, Kind>> cuts;
    for (const Kind kind : {Kind::kBase, Kind::kTip}) {
      const auto off = [&](const Gate& g) { return kind == Kind::kBase ? g.depth : length(g.time) - g.depth; };
      const double begin = off(piece.begin), half = off(middle), end = off(piece.end);
      const double c = 2 * (begin + end) - 4 * half, b = end - begin - c;
      if (!(b * b - 4 * begin * c >= 0)) continue;
      for (const double s : roots(begin, b, c))
        if (s > 0 && s < 1) cuts.push_back({s, kind});
    }
    std::sort(cuts.begin(), cuts.end());
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
    for (std::size_t i = 0; i <= cuts.size(); ++i) {
      const double a = i == 0 ? 0 : cuts[i - 1].first, b = i == cuts.size() ? 1 : cuts[i].first;
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
    double least = near;
    for (int i = 0; i < static_cast<int>(pieces_.size()); ++i)
      for (const bool begins : {true, false}) {
        const Gate& gate = begins ? pieces_[at(i)].begin : pieces_[at(i)].end;
        if (gate.kind != Kind::kWas) continue;
        Vec3 x;
        for (int k = 0; k < 3; ++k) x += gate.weights[at(k)] * now_[corner(pieces_[at(i)].face, k).index()];
        const double far = norm(x - front.position);
        if (far >= least) continue;
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
  std::span<const Vec3> now_;
  const BladeMove& move_;
  std::vector<Passing> passing_;
  std::vector<Piece> pieces_;
  std::vector<char> used_;
};

}  // namespace

BladeFrame frame_of(const BladeEdge& edge) {
  BladeFrame f;
  f.base = edge.base;
  f.length = norm(edge.tip - edge.base);
  f.along = (1 / f.length) * (edge.tip - edge.base);
  const Vec3 any = std::abs(f.along.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  f.aside = normalized(any - dot(any, f.along) * f.along);
  f.ahead = cross(f.along, f.aside);
  return f;
}

BladeMove BladeMove::make(const BladeFrame& from, const BladeEdge& to) {
  BladeMove m;
  m.was = from;
  m.is = frame_of(to);
  // By the shortest turn from one edge to the other; if they are opposite, there is none.
  const Vec3 sum = m.was.along + m.is.along;
  if (!(dot(sum, sum) > 0)) return m;
  const Vec3 aside = m.was.aside - (2 * dot(m.was.aside, m.is.along) / dot(sum, sum)) * sum;
  m.is.aside = normalized(aside - dot(aside, m.is.along) * m.is.along);
  m.is.ahead = cross(m.is.along, m.is.aside);
  return m;
}

void BladeMove::go_along(std::span<const Vec3> before, std::span<const Vec3> now, double reach) {
  const auto for_each = [&](auto&& fn) {
    for (std::size_t i = 0; i < before.size(); ++i) {
      const Vec2 a = was.across(before[i]), b = is.across(now[i]);
      const double near = reach * reach + dot(a, a) + dot(b, b);
      fn(a, b, 1 / (near * near));
    }
  };
  double sum = 0;
  Vec2 mean_was, mean_is;
  for_each([&](Vec2 a, Vec2 b, double weight) {
    sum += weight;
    mean_was = mean_was + weight * a;
    mean_is = mean_is + weight * b;
  });
  if (!(sum > 0)) return;
  mean_was = (1 / sum) * mean_was, mean_is = (1 / sum) * mean_is;
  // Least squares: is = turned was, about the means.
  double xx = 0, xy = 0, yy = 0;
  Vec2 x, y;
  for_each([&](Vec2 a, Vec2 b, double weight) {
    const Vec2 p = a - mean_was, q = b - mean_is;
    xx += weight * p.x * p.x, xy += weight * p.x * p.y, yy += weight * p.y * p.y;
    x = x + weight * p.x * q, y = y + weight * p.y * q;
  });
  const double area = xx * yy - xy * xy;
  if (!(area > cut::kMoveFlat * (xx + yy) * (xx + yy))) return;
  const Vec2 first = (1 / area) * (yy * x - xy * y), second = (1 / area) * (xx * y - xy * x);
  if (!(cross(first, second) > cut::kMoveSqueezes) || !(std::max(norm(first), norm(second)) * cut::kMoveSqueezes < 1))
    return;
  // What keeps still does so to the bit.
  if (std::max(norm(first - turned[0]), norm(second - turned[1])) < cut::kMoveStill) return;
  turned[0] = first, turned[1] = second;
}

std::vector<BladeArc> find_space_time_arcs(const CollisionMesh& mesh, std::span<const Vec3> before,
                                           std::span<const Vec3> now, const BladeMove& move,
                                           std::span<const MovingFront> fronts, double near) {
  return Search(mesh, before, now, move).run(fronts, near);
}

}  // namespace kerf
