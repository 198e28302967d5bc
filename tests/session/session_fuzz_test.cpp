// Random lives of sessions: strokes of all kinds on moving, held bodies, undo, redo, cancelled strokes, snapshots. After
// every operation all invariants hold; what must not change does not change by a bit.
//
// KERF_FUZZ_SECONDS=60 runs for so long instead of a few fixed seeds; KERF_FUZZ_SEED=n starts there. A failure is shrunk to a small
// recording, written into KERF_FUZZ_OUT. scripts/fuzz-sessions runs it for hours.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "kerf/base/parallel.h"
#include "kerf/base/random.h"
#include "kerf/session/session.h"
#include "session/continuity.h"
#include "session/recorded_session.h"

namespace kerf::session_fuzz_test {
namespace {

using test::fingerprint;

struct Tally {
  int strokes = 0, triangles = 0, refused = 0, undone = 0, most_pieces = 0;
  int compared = 0;                     ///< poses that changed something, looked at for jumps
  double jump = 0, kick = 0, gain = 0;  ///< the largest, in the units of their bounds
  int punches = 0, punches_refused = 0, passes = 0, moved_back = 0, removed = 0;
};

Scene random_scene(Random& random) {
  Scene scene;
  struct Kind {
    const char* model;
    std::size_t triangles;
    double thickness;
  };
  static constexpr Kind kinds[] = {{"sheet", 1664, 0.1},          {"closed-sheet", 800, 0.1}, {"steak", 0, 0.02},
                                   {"meniscus", 0, 0.002},        {"tube", 1000, 0.004},      {"holed-slab", 800, 0.02},
                                   {"two-holed-slab", 800, 0.02}, {"half-shell", 800, 0.004}, {"s-shape", 800, 0.006}};
  const Kind& kind = kinds[random.index(9)];
  scene.name = kind.model;
  scene.body.model = kind.model;
  scene.body.options.visual_triangles = kind.triangles;
  scene.body.options.seed = random.next() % 1000;
  if (random.index(3) == 0) scene.body.options.bumps = kind.thickness * random.uniform(0.1, 1);
  if (random.index(3) == 0) scene.body.options.noise = kind.thickness * random.uniform(0.005, 0.04);
  if (random.index(4) == 0) scene.lattice.formulation = SceneFormulation::kPlain;
  if (random.index(3) == 0) scene.cut.layers = 1 + random.index(4);
  if (random.index(3) == 0) scene.cut.roughness = 0.1 * kind.thickness;
  scene.simulation.time_step = std::pow(10, random.uniform(-3.3, -1.5));
  scene.simulation.gravity = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-10, 0)};
  scene.simulation.seed = static_cast<std::int64_t>(random.next() % 1000);
  if (scene.simulation.seed % 3 == 0) scene.cut.dust = 0.03;  // much of what comes off
  return scene;
}

/// A small body in which a cut with all its checks takes about a millisecond.
Scene small_scene(Random& random) {
  Scene scene = random_scene(random);
  struct Kind {
    const char* model;
    std::size_t triangles;
  };
  static constexpr Kind kinds[] = {
      {"closed-sheet", 500}, {"tube", 200}, {"holed-slab", 200}, {"half-shell", 200}, {"s-shape", 200}};
  const Kind& kind = kinds[random.index(5)];
  scene.name = scene.body.model = kind.model;
  scene.body.options.visual_triangles = kind.triangles;
  scene.body.options.noise = scene.body.options.bumps = 0;
  if (scene.cut.roughness > 0) scene.cut.roughness = 1e-4;
  return scene;
}

/// The scene as a recording keeps it.
std::string scene_text(const Scene& s) {
  return fmt::format(
      "[body]\nmodel = \"{}\"\noptions = {{ {}bumps = {}, noise = {}, seed = {} }}\n[lattice]\nformulation = \"{}\"\n[cut]\nlayers = {}\n"
      "roughness = {}\ndust = {}\n[simulation]\ntime_step = {}\ngravity = [{}, {}, {}]\nseed = {}\n",
      s.body.model,
      s.body.options.visual_triangles ? fmt::format("visual_triangles = {}, ", s.body.options.visual_triangles) : "",
      s.body.options.bumps, s.body.options.noise, s.body.options.seed,
      s.lattice.formulation == SceneFormulation::kPlain ? "plain" : "incompatible", s.cut.layers, s.cut.roughness,
      s.cut.dust, s.simulation.time_step, s.simulation.gravity.x, s.simulation.gravity.y, s.simulation.gravity.z,
      s.simulation.seed);
}

/// Things to touch, in every third life: the body itself and its lips, a floor, a ball that moves through it, a tool in its way.
std::string touching(std::uint64_t seed, const Scene& scene) {
  if (seed % 3 != 1) return {};
  Random random(seed * 77 + 5);
  const std::string_view model = scene.body.model;
  const double size = model == "sheet" || model == "closed-sheet" ? 1 : model == "meniscus" ? 0.045 : 0.16;
  const auto within = [&] { return size * random.uniform(-0.5, 0.5); };
  std::string text = fmt::format("[contact]\nself = {}\nfriction = {}\n", random.index(4) > 0, random.uniform(0, 0.8));
  if (random.index(2) == 0)
    text += fmt::format("[[obstacle]]\nshape = \"plane\"\nposition = [0, 0, {}]\nrotation = [{}, 0, 0]\n",
                        -size * random.uniform(0.1, 0.5), random.uniform(-0.5, 0.5));
  if (random.index(2) == 0)
    text += fmt::format(
        "[[obstacle]]\nshape = \"sphere\"\nradius = {}\nposition = [{}, {}, {}]\nmoves = [ {{ time = {}, position = [{}, {}, {}] }} ]\n",
        size * random.uniform(0.05, 0.2), within(), within(), -size, random.uniform(0.02, 1), within(), within(),
        within());
  if (random.index(2) == 0)
    text += fmt::format(
        "[[tool]]\nid = \"a\"\nkind = \"{}\"\nposition = [{}, {}, {}]\nrotation = [{}, {}, 0]\n",
        std::array{"probe", "grasper", "scalpel", "scissors", "sphere"}[static_cast<std::size_t>(random.index(5))],
        within(), within(), size * random.uniform(0, 0.3), random.uniform(-1, 1), random.uniform(-1, 1));
  return text;
}

class Life {
 public:
  Life(std::uint64_t seed, Tally& tally, bool small = false)
      : seed_(seed), random_(seed), tally_(tally), short_(small) {
    const Scene scene = small ? small_scene(random_) : random_scene(random_);
    what_ = "seed " + std::to_string(seed) + ", " + scene.name;
    auto made = test::RecordedSession::create(scene_text(scene) + (small ? "" : touching(seed, scene)), scene.name);
    if (!made.ok() && (scene.body.options.noise > 0 || scene.body.options.bumps > 0)) {
      // A body too rough to be bound is refused; that is fine, but there must be one to cut.
      Scene smooth = scene;
      smooth.body.options.noise = smooth.body.options.bumps = 0;
      made = test::RecordedSession::create(scene_text(smooth) + touching(seed, smooth), scene.name);
    }
    EXPECT_TRUE(made.ok()) << what_ << ": " << (made.ok() ? "" : made.error().message);
    if (!made.ok()) return;
    session_ = std::make_unique<test::RecordedSession>(std::move(made).value());
    for (const Vec3 p : session_->collision_positions()) box_.add(p);
    good_ = true;
    check("creation");
    if (random_.index(3) > 0) hold();
  }

  /// Hashes of all moments; stops at the first failure.
  std::vector<std::uint64_t> live(int operations) {
    std::vector<std::uint64_t> trace;
    for (int i = 0; i < operations && good_; ++i) {
      operation_ = i;
      switch (random_.index(17)) {
        case 0:
        case 1:
        case 2:
        case 3: stroke(); break;
        case 4: steps(1 + random_.index(4)); break;
        case 5: undo(); break;
        case 6: redo(); break;
        case 7: grasp_or_move(); break;
        case 8: cancelled_stroke(); break;
        case 9: replay(); break;
        case 10: hold(); break;
        case 11:
        case 12: punch(); break;
        case 13:
        case 14: shave(); break;
        case 15: remove(); break;
        default:
          undo();
          redo();
          break;
      }
      trace.push_back(session_->hash());
    }
    tally_.most_pieces = std::max(tally_.most_pieces, good_ ? session_->counts().pieces : 0);
    return trace;
  }
  /// Cuts and hardly anything else, without contact, until there are crumbs.
  void storm(int operations, int most_pieces) {
    for (int i = 0; i < operations && good_ && session_->counts().pieces < most_pieces; ++i) {
      operation_ = i;
      switch (random_.index(20)) {
        case 0: undo(); break;
        case 1: redo(); break;
        case 2: cancelled_stroke(); break;
        case 3:
        case 4: punch(); break;
        case 5: shave(); break;
        case 6: steps(1); break;
        default: stroke(); break;
      }
    }
    tally_.most_pieces = std::max(tally_.most_pieces, good_ ? session_->counts().pieces : 0);
  }
  [[nodiscard]] bool good() const { return good_; }

 private:
  void fail(const std::string& why) {
    good_ = false;
    ADD_FAILURE() << what_ << ", operation " << operation_ << ": " << why << "\n"
                  << (session_ ? test::keep_shrunk(session_->recording(), fmt::format("seed-{}", seed_)) : "");
  }
  void check(const char* after) {
    if (!good_) return;
    if (const Status valid = session_->validate(); !valid)
      fail(std::string("after ") + after + ": " + valid.error().message);
  }
  bool expect(const Status& status, const char* where) {
    if (!status) fail(std::string(where) + ": " + status.error().message);
    return status.ok();
  }

  Vec3 somewhere(double reach) {
    const Vec3 c = box_.center(), s = box_.size();
    return c + Vec3{s.x * random_.uniform(-reach, reach), s.y * random_.uniform(-reach, reach),
                    s.z * random_.uniform(-reach, reach)};
  }
  /// A point to cut through: anywhere, or just on a vertex or on an edge.
  Vec3 target(const std::vector<Vec3>& positions) {
    if (random_.index(3) > 0) return somewhere(0.65);
    const Vec3 a = positions[static_cast<std::size_t>(random_.index(static_cast<int>(positions.size())))];
    const Vec3 b = positions[static_cast<std::size_t>(random_.index(static_cast<int>(positions.size())))];
    return random_.index(2) ? a : lerp(a, b, 0.5);
  }

  std::vector<Vec3> random_path(const std::vector<Vec3>& positions) {
    const double size = box_.diagonal();
    std::vector<Vec3> path;
    const Vec3 a = target(positions), b = target(positions), c = target(positions);
    if (short_ && random_.index(16) > 0)
      return {a, a + size * random_.uniform(0.02, 0.2) * normalized(b - a + 1e-9 * size * x_)};
    switch (random_.index(8)) {
      case 0:
      case 1: path = {a, b}; break;
      case 2:  // a curve
        for (int i = 0; i <= 10; ++i) path.push_back(lerp(lerp(a, b, i / 10.0), lerp(b, c, i / 10.0), i / 10.0));
        break;
      case 3: path = {a, b, c, target(positions), target(positions)}; break;  // likely to cross itself
      case 4:
      case 5: {  // a loop, a little more than closed, or twice around
        const double radius = size * random_.uniform(0.02, 0.3), turns = random_.index(2) ? 1.15 : 2.1;
        for (int i = 0; i <= 24; ++i) {
          const double angle = 2 * std::numbers::pi * turns * i / 24;
          path.push_back(a + radius * (std::cos(angle) * x_ + std::sin(angle) * y_));
        }
        break;
      }
      case 6:  // tiny
        path = {a, a + 1e-3 * size * random_.uniform(0.01, 10) * x_, a + 1e-3 * size * y_};
        break;
      default: path = last_path_.empty() ? std::vector<Vec3>{a, b} : last_path_; break;
    }
    return path;
  }

  void choose_edge() {
    Vec3 z{0, 0, 1};
    if (random_.index(3) == 0) z = {random_.uniform(-1, 1), random_.uniform(-1, 1), random_.uniform(-1, 1)};
    if (!(norm(z) > 0.01)) z = {0, 0, 1};
    edge_ = normalized(z);
    x_ = normalized(cross(edge_, std::abs(edge_.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    y_ = cross(edge_, x_);
  }

  /// Moves the blade along a random path. `moving`: time passes meanwhile.
  void draw(bool moving) {
    const auto frame = random_.index(2) ? SceneFrame::kWorld : SceneFrame::kRest;
    choose_edge();
    const std::vector<Vec3> positions =
        frame == SceneFrame::kRest ? session_->body().complex.collision.rest.raw() : session_->collision_positions();
    std::vector<Vec3> path = random_path(positions);
    last_path_ = path;
    const double size = box_.diagonal();
    if (random_.index(8) == 0) {  // the edge comes down on its whole length, or nearly
      const Vec3 down = edge_, at = path[0];
      edge_ = normalized(x_ + random_.uniform(-0.2, 0.2) * down);
      path = {at + 0.5 * size * down, at,
              at - random_.uniform(-0.1, 0.5) * size * down + 0.1 * size * random_.uniform(-1, 1) * y_};
    }
    const double up = random_.index(4) ? 2 * size : size * random_.uniform(0, 0.1);
    const double down = random_.index(4) ? 2 * size : size * random_.uniform(0.001, 0.1);
    const bool stab = random_.index(6) == 0;
    const double turn = random_.index(4) ? 0 : random_.uniform(-0.4, 0.4);
    if (!expect(session_->begin_stroke(frame, random_.index(2) == 0), "begin")) return;
    if (stab && !expect(session_->move_blade(path[0] + 3 * size * edge_, path[0] + 2 * size * edge_), "stab")) return;
    const int parts = 1 + random_.index(short_ ? 3 : 6);
    for (std::size_t i = 0; i + 1 < path.size() && good_; ++i)
      for (int k = i == 0 ? 0 : 1; k <= parts && good_; ++k) {
        const double s = static_cast<double>(k) / parts;
        const Vec3 p = lerp(path[i], path[i + 1], s);
        const Vec3 e = normalized(edge_ + turn * (static_cast<double>(i) + s) / static_cast<double>(path.size()) * x_);
        move_blade(p + up * e, p - down * e);
        if (moving && random_.index(3) == 0) {
          check("a pose");
          if (good_) expect(session_->step(1), "step");
        }
      }
    ++tally_.strokes;
    if (good_) tally_.triangles += session_->strokes().back().triangles;
    if (good_) tally_.refused += session_->strokes().back().refused;
  }

  /// Where the surface is and how everything moves, at every third occasion; nothing may jump where no time passes.
  [[nodiscard]] std::unique_ptr<test::SurfaceMotion> look() {
    if (session_->step_count() == 0 || ++poses_ % 3 != 0) return {};
    return std::make_unique<test::SurfaceMotion>(test::surface_motion(*session_));
  }
  void compare(const test::SurfaceMotion& before, bool energy = true) {
    const test::Continuity c = test::continuity(before, test::surface_motion(*session_), box_.diagonal(), energy);
    ++tally_.compared;
    tally_.jump = std::max(tally_.jump, c.moved);
    tally_.kick = std::max(tally_.kick, c.kicked);
    tally_.gain = std::max(tally_.gain, c.gained);
    if (!c.broken.empty()) fail(c.broken);
  }
  void move_blade(Vec3 base, Vec3 tip) {
    const std::uint64_t version = session_->topology_version();
    const auto before = look();
    if (expect(session_->move_blade(base, tip), "move") && before && session_->topology_version() != version)
      compare(*before);
  }

  void stroke() {
    const bool moving = random_.index(2) == 0;
    const std::uint64_t before = fingerprint(*session_);
    const int depth = session_->undo_depth();
    draw(moving);
    if (!good_) return;
    check("a stroke");
    if (!good_ || !expect(session_->end_stroke(), "end")) return;
    check("lifting off");
    if (!good_) return;
    if (session_->undo_depth() > depth) before_.push_back(before);  // a stroke through the air leaves nothing to undo
    after_undo_.clear();
  }

  void punch() {
    const std::uint64_t before = fingerprint(*session_), hash = session_->hash();
    const int depth = session_->undo_depth();
    choose_edge();
    Punch p;
    p.centre = target(session_->collision_positions());
    p.axis = random_.index(2) ? edge_ : Vec3{0, 0, 1};
    p.across = x_ + 0.3 * y_;
    const double radius = box_.diagonal() * std::pow(10, random_.uniform(-2.5, -0.4));
    p.outline = random_.index(3) ? circle_outline(radius, 0.03 * radius) : d_outline(radius, 0.03 * radius);
    if (random_.index(2)) p.reach = radius;
    const auto before_it = look();
    const auto done = session_->punch(p, random_.index(2) ? SceneFrame::kWorld : SceneFrame::kRest,
                                      random_.index(2) ? radius * random_.uniform(0, 0.3) : 0);
    check("a punch");
    if (!good_) return;
    ++tally_.punches;
    if (!done.ok() || !done->cut) {
      if (!done.ok()) ++tally_.punches_refused;
      if (session_->hash() != hash) fail("a punch that cut nothing left something behind");
      return;
    }
    if (session_->undo_depth() != depth + 1) fail("a punch is not one undo step");
    if (before_it && session_->strokes().back().removed.pieces == 0) compare(*before_it);  // else ids are others
    before_.push_back(before);
    after_undo_.clear();
  }

  void shave() {
    const CellComplex& complex = session_->body().complex;
    if (complex.wall_edge.size() == 0) return punch();
    const std::uint64_t before = fingerprint(*session_);
    const int depth = session_->undo_depth();
    const CollisionHalfEdge h = complex.wall_edge[WallId(random_.index(static_cast<int>(complex.wall_edge.size())))];
    const Vec3 a = session_->collision_positions()[complex.collision.from(h).index()];
    const Vec3 b = session_->collision_positions()[complex.collision.to(h).index()];
    const double radius = box_.diagonal() * random_.uniform(0.005, 0.05),
                 depth_per_pass = random_.index(3) ? 0.1 * radius : 0;
    const int passes = 1 + random_.index(6);
    for (int i = 0; i < passes && good_; ++i) {
      const Vec3 at = lerp(a, b, random_.uniform(-0.2, 1.2));
      const double roughness = session_->roughness();
      const auto before_it = look();
      const auto done = session_->shave({at, at + 0.2 * radius * x_, radius}, SceneFrame::kWorld, random_.uniform(0, 1),
                                        depth_per_pass);
      if (!done.ok()) return fail("shave: " + done.error().message);
      ++tally_.passes;
      tally_.moved_back += done->moved_back;
      // A divided edge has more vertices to measure. A smooth wall is not rough by rounding.
      if (depth_per_pass == 0 && session_->roughness() > roughness * (1 + 1e-9) + 1e-15 * box_.diagonal())
        fail(fmt::format("a shave made it rougher: {} m after {} m", session_->roughness(), roughness));
      check("a shave");
      if (good_ && before_it) compare(*before_it, false);
      if (good_ && random_.index(3) == 0) steps(1);
    }
    if (!good_) return;
    if (random_.index(4) == 0) {
      if (!expect(session_->cancel_stroke(), "cancel")) return;
      check("a cancelled shave");
      if (fingerprint(*session_) != before) fail("a cancelled shave left something behind");
      after_undo_.clear();
      return;
    }
    expect(session_->end_stroke(), "end");
    check("the end of a shave");
    if (session_->undo_depth() > depth) before_.push_back(before);
    after_undo_.clear();
  }

  void remove() {
    if (session_->counts().pieces < 2) return punch();
    const std::uint64_t before = fingerprint(*session_);
    const int depth = session_->undo_depth();
    Result<RemovalReport> done = failed("");
    if (random_.index(2)) {
      const auto n = static_cast<int>(session_->body().complex.collision.face_count());
      done = session_->remove_piece(CollisionTriangle(random_.index(n)));
    } else {
      SceneRegion region;
      region.shape = SceneRegion::Shape::kSphere;
      region.center = somewhere(0.5);
      region.radius = box_.diagonal() * random_.uniform(0.05, 0.5);
      done = session_->remove_pieces(region, random_.index(2) ? SceneFrame::kRest : SceneFrame::kWorld);
    }
    if (!done.ok()) return fail("removal: " + done.error().message);
    check("a removal");
    tally_.removed += done->pieces;
    if (session_->undo_depth() == depth) return;
    before_.push_back(before);
    after_undo_.clear();
  }

  void undo() {
    if (before_.empty()) {
      if (session_->undo_depth() == 0 && session_->undo().ok()) fail("undo of nothing");
      return;
    }
    const std::uint64_t now = fingerprint(*session_);
    if (!expect(session_->undo(), "undo")) return;
    if (before_.back() != test::kNotComparable && fingerprint(*session_) != before_.back())
      fail("undo did not bring back the state before the stroke");
    check("undo");
    after_undo_.push_back({now, before_.back()});
    before_.pop_back();
    ++tally_.undone;
  }

  void redo() {
    if (after_undo_.empty()) {
      if (session_->redo_depth() == 0 && session_->redo().ok()) fail("redo of nothing");
      return;
    }
    // Redo brings back what undo found; the next undo brings back what redo found.
    const std::uint64_t now = fingerprint(*session_);
    if (!expect(session_->redo(), "redo")) return;
    const std::uint64_t wanted = after_undo_.back().first;
    if (wanted != test::kNotComparable && fingerprint(*session_) != wanted)
      fail("redo did not bring back the state before undo");
    check("redo");
    before_.push_back(now);
    after_undo_.pop_back();
  }

  void cancelled_stroke() {
    const std::uint64_t before = session_->hash();
    const int redo_depth = session_->redo_depth();
    draw(false);
    if (!good_ || !expect(session_->cancel_stroke(), "cancel")) return;
    check("a cancelled stroke");
    if (session_->hash() != before) fail("a cancelled stroke left something behind");
    if (session_->redo_depth() != redo_depth) after_undo_.clear();
  }

  void steps(int n) {
    expect(session_->step(n), "step");
    check("steps");
  }

  /// The same future twice, from a snapshot.
  void replay() {
    const auto snapshot = session_->snapshot();
    const Random random = random_;
    const std::uint64_t before = session_->hash();
    std::uint64_t end[2];
    const std::vector<Vec3> path = last_path_;
    for (int i = 0; i < 2 && good_; ++i) {
      random_ = random;
      last_path_ = path;
      draw(true);
      if (!good_) return;
      if (random_.index(2)) expect(session_->end_stroke(), "end");
      steps(2);
      if (!good_) return;
      end[i] = session_->hash();
      session_->restore(snapshot);
      check("restore");
      if (session_->hash() != before) fail("restore brought back something else");
    }
    if (good_ && end[0] != end[1]) fail("the same commands from the same snapshot came out differently");
    last_path_ = path;
  }

  void grasp_or_move() {
    SceneCommand command;
    grasped_ = !session_->grasps().empty();  // one may have gone with a piece, or come back with it
    if (!grasped_) {
      SceneGrasp grasp;
      grasp.id = "g";
      grasp.point = somewhere(0.5);
      grasp.radius = random_.index(2) ? 0 : 0.1 * box_.diagonal();
      command.what = grasp;
      grasped_ = true;
    } else if (random_.index(3) == 0) {
      command.what = SceneRelease{"g"};
      grasped_ = false;
    } else {
      SceneMove move;
      move.id = "g";
      move.by = 0.03 * (somewhere(1) - box_.center());
      move.over = random_.index(2) ? 0.01 : 0;
      command.what = move;
    }
    if (!expect(session_->apply(command), "hold")) return;
    steps(1);
  }

  void hold() {
    SceneCommand command;
    SceneRegion region;
    region.shape = SceneRegion::Shape::kSphere;
    const auto& rest = session_->body().complex.collision.rest.raw();
    region.center = rest[static_cast<std::size_t>(random_.index(static_cast<int>(rest.size())))];
    region.radius = box_.diagonal() * random_.uniform(0.05, 0.15);
    if (random_.index(4)) command.what = SceneFixCommand{region};
    else command.what = SceneUnfix{region};
    expect(session_->apply(command), "fix");
    // Undo brings back how the body moved, but a support stays what it is, and what it holds is still.
    std::fill(before_.begin(), before_.end(), test::kNotComparable);
    for (auto& [now, then] : after_undo_) now = then = test::kNotComparable;
    check("fix");
  }

  std::uint64_t seed_;
  Random random_;
  Tally& tally_;
  bool short_ = false;  ///< most cuts are short
  std::unique_ptr<test::RecordedSession> session_;
  std::string what_;
  Box3 box_;
  int operation_ = -1, poses_ = 0;
  bool good_ = false, grasped_ = false;
  Vec3 edge_, x_, y_;
  std::vector<Vec3> last_path_;
  std::vector<std::uint64_t> before_;                                // fingerprints that undo must bring back
  std::vector<std::pair<std::uint64_t, std::uint64_t>> after_undo_;  // redo must bring back; and what undo brought back
};

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// `live` from one seed after the other, `most` of them, or for KERF_FUZZ_SECONDS.
template <class Live>
int lives_of(int most, Tally& tally, const Live& live) {
  const std::uint64_t first = number_from("KERF_FUZZ_SEED", 1), seconds = number_from("KERF_FUZZ_SECONDS", 0);
  const auto start = std::chrono::steady_clock::now();
#ifdef __SANITIZE_ADDRESS__
  most = (most + 2) / 3;  // five times as slow
#endif
  int lives = 0, failed = 0;
  for (std::uint64_t seed = first;; ++seed) {
    const double passed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (seconds > 0 ? passed >= static_cast<double>(seconds) : lives >= most) break;
    ++lives;
    if (seconds > 0 && lives % 50 == 1) {  // what a run that is killed leaves behind
      std::fprintf(stderr, "at seed %llu after %d cuts\n", static_cast<unsigned long long>(seed), tally.strokes);
      std::fflush(stderr);
    }
    bool good = false;
    try {
      good = live(seed);
    } catch (const std::exception& e) {  // out of memory, most likely: no recording, but the seed
      ADD_FAILURE() << "seed " << seed << ", " << e.what();
    }
    if (!good && ++failed >= 8) break;
  }
  std::printf(
      "%d lives, %d strokes over %d triangles, %d refused steps, %d undone, up to %d pieces; in %d poses vertices "
      "jumped by up to %.2g, velocities by %.2g, energy grew by %.2g\n",
      lives, tally.strokes, tally.triangles, tally.refused, tally.undone, tally.most_pieces, tally.compared, tally.jump,
      tally.kick, tally.gain);
  std::printf("%d punches, %d of them refused, %d passes of a shaver, %d vertices moved back, %d pieces taken away\n",
              tally.punches, tally.punches_refused, tally.passes, tally.moved_back, tally.removed);
  return lives;
}

TEST(SessionFuzz, EveryLifeKeepsItsInvariants) {
  Tally tally;
  const int lives = lives_of(12, tally, [&](std::uint64_t seed) {
    Life life(seed, tally);
    if (life.good()) life.live(18);
    return life.good();
  });
  EXPECT_GT(tally.triangles, 8 * lives);
}

TEST(SessionFuzz, StormOfCuts) {
  Tally tally;
  const int lives = lives_of(2, tally, [&](std::uint64_t seed) {
    Life life(seed, tally, true);
    if (life.good()) life.storm(60, seed % 4 == 0 ? 30 : 8);  // small bodies are checked faster, crumbs are rarer
    return life.good();
  });
  EXPECT_GT(tally.strokes, 4 * lives);
}

TEST(SessionFuzz, ThreadsDoNotChangeABit) {
  for (std::uint64_t seed : {101, 102}) {
    std::vector<std::uint64_t> trace[2];
    for (int threads : {1, 2}) {
      const ThreadLimit limit(threads);
      Tally tally;
      Life life(seed, tally);
      if (life.good()) trace[threads - 1] = life.live(8);
    }
    EXPECT_EQ(trace[0], trace[1]) << "seed " << seed;
  }
}

}  // namespace
}  // namespace kerf::session_fuzz_test
