// Bodies that move while they are cut: swung, shifted, pulled apart, sheared, with waves. What the blade meets of them at rest is known from where points of the
// body are at a time, and from no path. KERF_FUZZ_SECONDS=n in the environment: so long for each motion, KERF_FUZZ_SEED=s from another seed, and what goes
// wrong is printed, not failed on.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "kerf/cutting/swept_deviation.h"

#include "cutting/stroke_sets.h"

namespace kerf::moving_body_test {
namespace {

using namespace testing_support;

constexpr double kPi = std::numbers::pi;

enum class MotionKind { kShift, kSwingInPlane, kSwing, kStretch, kShear, kWave, kSag, kSway, kDrift };
constexpr const char* kMotions[] = {"shifted",
                                    "swung_in_its_plane",
                                    "swung_out_of_its_plane",
                                    "pulled_apart",
                                    "sheared",
                                    "with_a_wave",
                                    "sagging",
                                    "swaying",
                                    "drifting"};
/// So many of them leave an upright straight line of the body straight.
constexpr int kStraight = 6;

/// Where a point of the body is at a time, 0 to 1 in a stroke.
struct Motion {
  MotionKind kind = MotionKind::kShift;
  double size = 1;     ///< of the body, metres
  double amount = 0;   ///< radians, or parts of the size
  double turns = 0.5;  ///< there and back in a stroke
  double phase = 0;
  double heading = 0;  ///< radians: of the axis or the way
  Vec2 pivot;

  static Motion random(MotionKind kind, double size, double most, Random& random) {
    const auto inside = [&] { return random.uniform(-1, 1) * size; };
    return {kind,
            size,
            random.uniform(0.1, 1) * most,
            random.uniform(0.2, 2),
            random.uniform(0, 2 * kPi),
            random.uniform(0, 2 * kPi),
            {inside(), inside()}};
  }
  /// There; back with way = -1.
  [[nodiscard]] Vec3 at(Vec3 p, double t, double way = 1) const {
    const double now = amount * std::sin(2 * kPi * turns * t + phase), a = way * now, c = std::cos(heading),
                 s = std::sin(heading);
    // x along the heading, y across it.
    Vec3 q{c * (p.x - pivot.x) + s * (p.y - pivot.y), -s * (p.x - pivot.x) + c * (p.y - pivot.y), p.z};
    switch (kind) {
      case MotionKind::kShift: q += a * size * Vec3{1, 0, 0.3}; break;
      case MotionKind::kSwingInPlane:
        q = {std::cos(a) * q.x - std::sin(a) * q.y, std::sin(a) * q.x + std::cos(a) * q.y, q.z};
        break;
      case MotionKind::kSwing:
        q = {q.x, std::cos(a) * q.y - std::sin(a) * q.z, std::sin(a) * q.y + std::cos(a) * q.z};
        break;
      case MotionKind::kStretch: q.x *= way > 0 ? 1 + now : 1 / (1 + now); break;
      case MotionKind::kShear: q.x += a * q.y; break;
      case MotionKind::kWave:
        q.z += way * 0.2 * amount * size * std::sin(8 * q.x / size - 2 * kPi * turns * t - phase);
        break;
      case MotionKind::kSag: q.z -= 0.5 * a * q.x * q.x / size; break;
      case MotionKind::kDrift: q.x += way * amount * size * t; break;
      case MotionKind::kSway: q.x += 0.15 * a * size * std::sin(7 * q.y / size); break;
    }
    return {pivot.x + c * q.x - s * q.y, pivot.y + s * q.x + c * q.y, q.z};
  }
  [[nodiscard]] Vec3 back(Vec3 p, double t) const { return at(p, t, -1); }
  [[nodiscard]] BladeEdge at(const BladeEdge& e, double t) const { return {at(e.base, t), at(e.tip, t)}; }
  [[nodiscard]] BladeEdge back(const BladeEdge& e, double t) const { return {back(e.base, t), back(e.tip, t)}; }
};

/// A body whose positions are those of a motion at each pose. Between two poses nothing else is known.
struct MovingBody : StrokeBody {
  using StrokeBody::StrokeBody;
  double carried = 0;  ///< so far has it been carried over the mesh from one pose to the next, at rest, metres

  void pose(const Motion& motion, const BladeEdge& edge, double before, double t) {
    for (std::size_t i = 0; i < position.size(); ++i)
      position[i] = motion.at(body.collision.rest[CollisionVertex(i)], t);
    boxes.forget();
    for (const CollisionVertex v : ids<CollisionVertex>(body.collision.vertex_count())) {
      const Vec3 p = body.collision.rest[v], d = motion.back(motion.at(p, before), t) - p;
      carried = std::max(carried, std::hypot(d.x, d.y));
    }
    refused += move_blade(*this, edge).refused;
  }
  /// `edge_of`: of a place of the stroke at a time.
  template <class EdgeOf>
  void cut_moving(const Stroke& path, const Motion& motion, int poses, EdgeOf&& edge_of) {
    place();
    const std::size_t last = path.size() - 1;
    double before = 0;
    for (std::size_t k = 0; k < last; ++k)
      for (int i = k == 0 ? 0 : 1; i <= poses; ++i) {
        const double part = static_cast<double>(i) / poses,
                     t = (static_cast<double>(k) + part) / static_cast<double>(last);
        pose(motion, edge_of(lerp(path[k], path[k + 1], part), t), before, t);
        before = t;
      }
    lift_blade(stroke);
  }
  /// The blade is led along the stroke on the body, whatever the body does in the world.
  void cut_at_rest(const Stroke& path, const Motion& motion, int poses) {
    cut_moving(path, motion, poses, [&](Vec2 p, double t) { return motion.at(edge_at(p), t); });
  }
  void cut_in_world(const Stroke& path, const Motion& motion, int poses) {
    cut_moving(path, motion, poses, [&](Vec2 p, double) { return edge_at(p); });
  }
};

/// How many sets, from which seed on, or for how long.
struct Budget {
  explicit Budget(std::uint64_t sets, std::uint64_t first_seed = 1) : first(first_seed), sets_(sets) {
    if (seed) first = std::strtoull(seed, nullptr, 10);
  }
  [[nodiscard]] bool goes_on(std::uint64_t next) const {
    return seconds
               ? std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count() < std::atof(seconds)
               : next < first + sets_;
  }
  const char* seconds = std::getenv("KERF_FUZZ_SECONDS");
  const char* seed = std::getenv("KERF_FUZZ_SEED");
  std::uint64_t first;

 private:
  std::uint64_t sets_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Sets of strokes of all kinds, led over a sheet that moves; each in one of some numbers of poses a segment. `most`: radians or metres.
void expect_parted(int kind_of_motion, const Budget& budget, double most, std::initializer_list<int> poses_of) {
  MovingBody body("closed-sheet", 2500);
  const double edge = body.body.mean_root_edge;
  const CollisionMesh mesh = body.body.collision;
  const StrokeSets sets(mesh, 1, edge);
  int count = 0, bridged = 0, severed = 0, refused = 0, off = 0;
  for (std::uint64_t seed = budget.first; budget.goes_on(seed); ++seed) {
    Random random(1000 * seed + static_cast<std::uint64_t>(kind_of_motion));
    const int kind = random.index(static_cast<int>(std::size(kSetKinds)));
    const std::vector<Stroke> strokes = sets.make(static_cast<SetKind>(kind), random);
    const Motion motion = Motion::random(static_cast<MotionKind>(kind_of_motion), 1, most, random);
    const int poses = poses_of.begin()[random.index(static_cast<int>(poses_of.size()))];
    body.make_whole();
    body.carried = 0;
    for (const Stroke& s : strokes) body.cut_at_rest(s, motion, poses);
    const Status valid = validate_complex(body.body, body.start);
    ASSERT_TRUE(valid.ok()) << valid.error().message << text_of(strokes);
    const StrokeJudge judge{0.12 * edge, 0.9 * body.options.minimum_feature * edge};
    const auto verdict = judge.judge(body, strokes);
    const auto deviation = StrokeJudge::deviation(body, strokes);
    const bool is_off = std::max(deviation.stray, deviation.missed) >
                        (body.options.path_tolerance + body.options.minimum_feature) * edge;
    ++count;
    bridged += verdict.bridges > 0;
    severed += verdict.severed > 0;
    refused += body.refused > 0;
    off += is_off;
    if (verdict.bridges > 0 || verdict.severed > 0 || body.refused > 0 || is_off)
      printf(
          "seed %llu, %s, %d poses: %d bridges, %d severed, %d refused, %.3f and %.3f edges off, carried by %.3f:%s\n",
          static_cast<unsigned long long>(seed), kSetKinds[kind], poses, verdict.bridges, verdict.severed, body.refused,
          deviation.stray / edge, deviation.missed / edge, body.carried / edge, text_of(strokes).c_str());
  }
  if (budget.seconds) {
    printf("%s: %d sets, %d with a bridge, %d severed, %d refused, %d beside their place\n", kMotions[kind_of_motion],
           count, bridged, severed, refused, off);
    return;
  }
  EXPECT_EQ(bridged, 0);
  EXPECT_EQ(severed, 0);
  EXPECT_EQ(refused, 0);
  EXPECT_EQ(off, 0);
}

class MovingBodyOracle : public ::testing::TestWithParam<int> {};

// Pieces and walls are those of the strokes, however far the body moves between two poses.
TEST_P(MovingBodyOracle, IsPartedAsIfItKeptStill) { expect_parted(GetParam(), Budget(5), 0.6, {1, 4, 40}); }
TEST_P(MovingBodyOracle, IsPartedHoweverFarItMovesInOnePose) { expect_parted(GetParam(), Budget(5, 200), 0.6, {1}); }

// A drawn curve turned back on itself, and triangles of a path that had been taken back were divided in place of its own.
TEST(MovingBody, ACurveThatTurnsBackGivesWayToItsChord) {
  expect_parted(static_cast<int>(MotionKind::kWave), Budget(1, 5053), 0.6, {1, 4, 40});
}

INSTANTIATE_TEST_SUITE_P(Motions, MovingBodyOracle, ::testing::Range(0, kStraight),
                         [](const auto& kind) { return std::string(kMotions[kind.param]); });

/// A body that drifts along +x at a heading, so far in a stroke, metres.
Motion drift(double metres, double heading) { return {MotionKind::kDrift, 1, metres, 0, 0, heading, {}}; }

// A blade that stands while the body drifts cuts what a blade cuts that is led through a body at rest.
TEST(MovingBody, DriftsThroughABladeThatStands) {
  MovingBody still("closed-sheet", 2500), moved("closed-sheet", 2500);
  const double edge = still.body.mean_root_edge;
  const auto areas = [](const MovingBody& b) {
    const Pieces pieces = collision_pieces(b.body);
    std::vector<double> area(static_cast<std::size_t>(pieces.count));
    const CollisionMesh& m = b.body.collision;
    for (const CollisionTriangle f : ids<CollisionTriangle>(m.face_count())) {
      const CollisionHalfEdge h = CollisionMesh::corner(f, 0);
      const Vec3 a = m.rest[m.from(h)];
      area[static_cast<std::size_t>(pieces.of_face[f.index()])] +=
          0.5 * norm(cross(m.rest[m.to(h)] - a, m.rest[m.apex(h)] - a));
    }
    std::sort(area.begin(), area.end());
    return area;
  };
  Random random(21);
  for (int i = 0; i < 24; ++i) {
    const double heading = random.uniform(0, 2 * kPi);
    const Vec2 way = 1.6 * Vec2{std::cos(heading), std::sin(heading)},
               middle{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3)}, from = middle - 0.5 * way;
    constexpr int kPoses[] = {1, 4, 40};
    const int poses = kPoses[i % 3];
    const Stroke line{from, from + way};
    still.make_whole();
    moved.make_whole();
    still.cut(line, poses);
    moved.cut_in_world({from, from}, drift(-1.6, heading), poses);
    EXPECT_EQ(moved.refused, 0);
    const std::vector<double> a = areas(still), b = areas(moved);
    ASSERT_EQ(a.size(), b.size()) << text_of({line}) << ", " << poses << " poses";
    for (std::size_t k = 0; k < a.size(); ++k)
      EXPECT_NEAR(a[k], b[k], 1e-9) << text_of({line}) << ", " << poses << " poses";
    const auto deviation = StrokeJudge::deviation(moved, {line});
    EXPECT_LT(std::max(deviation.stray, deviation.missed),
              (moved.options.path_tolerance + moved.options.minimum_feature) * edge)
        << text_of({line});
  }
}

// A blade that was set into the body and goes with it cuts nothing; nor does one beside the body that the body keeps away from.
TEST(MovingBody, TakesTheBladeAlong) {
  MovingBody b("closed-sheet", 2500);
  for (const double heading : {0.0, 2.0, 4.0})
    for (const Vec2 at : {Vec2{0.1, 0.05}, Vec2{-0.6, 0}, Vec2{0.02, 0.52}})
      for (const int poses : {1, 4, 40}) {
        b.make_whole();
        b.cut_at_rest({at, at}, drift(1.3, heading), poses);
        EXPECT_TRUE(b.cut_edges().empty()) << at.x << " " << at.y << ", " << poses << " poses";
        EXPECT_EQ(b.refused, 0);
      }
}

// The body comes onto the blade from beside its way, which leads along the rim in the world. It has come over the rim where the blade was beside it, not back along
// the blade's way.
TEST(MovingBody, ComesOntoTheBladeFromBesideItsWay) {
  MovingBody b("closed-sheet", 2500);
  const double edge = b.body.mean_root_edge;
  for (const double slope : {1.2, 1.5, 1.9})
    for (const double metres : {0.3, 0.32, 0.34}) {
      const Stroke line{{-0.57, 0.2}, {-0.17, 0.2 - 0.4 * slope}};
      b.make_whole();
      b.cut_at_rest(line, drift(-metres, 0), 40);
      const auto deviation = StrokeJudge::deviation(b, {line});
      EXPECT_LT(std::max(deviation.stray, deviation.missed), b.options.minimum_feature * edge)
          << slope << " " << metres;
    }
}

/// What the edge of a stroke in the world passes of the body, at rest. `bent`: so far is it from straight between two poses, across the edge, metres.
void add_swept(const MovingBody& b, const Stroke& path, const Motion& motion, int poses, double step,
               TriangleSoup& soup, double& bent) {
  const double last = static_cast<double>(poses) * static_cast<double>(path.size() - 1);
  const auto inside = [&](Vec3 p) {
    return p.x > b.box.min.x && p.x < b.box.max.x && p.y > b.box.min.y && p.y < b.box.max.y &&
           std::abs(p.z - b.box.center().z) < b.start.size.z;
  };
  for (std::size_t k = 0; k + 1 < path.size(); ++k)
    for (int i = 0; i < poses; ++i) {
      const double first = (static_cast<double>(k) * poses + i) / last;
      const auto at = [&](double u, double w) {
        const BladeEdge e = b.edge_at(lerp(path[k], path[k + 1], (i + w) / poses));
        return motion.back(lerp(e.base, e.tip, u), first + w / last);
      };
      const auto parts = [&](double length) { return std::max(1, static_cast<int>(std::ceil(length / step))); };
      const int along = parts(2 * b.reach), onward = std::max(4, parts(norm(at(0.5, 1) - at(0.5, 0))));
      for (int m = 0; m < along; ++m)
        for (int n = 0; n < onward; ++n) {
          const double u[2] = {static_cast<double>(m) / along, (m + 1.0) / along},
                       w[2] = {static_cast<double>(n) / onward, (n + 1.0) / onward};
          const Vec3 p = at(u[0], w[0]), q = at(u[1], w[0]), r = at(u[1], w[1]), s = at(u[0], w[1]);
          soup.add(p, q, r);
          soup.add(p, r, s);
          if (!inside(r)) continue;
          const Vec3 off = r - lerp(at(u[1], 0), at(u[1], 1), w[1]), edge = normalized(at(1, w[1]) - at(0, w[1]));
          bent = std::max(bent, norm(off - dot(off, edge) * edge));
        }
    }
}

void expect_walls_where_the_blade_was(std::string_view model, MotionKind kind, int some, std::uint64_t seed) {
  MovingBody b(model, model == "closed-sheet" ? 2500 : 0);
  const double edge = b.body.mean_root_edge, thickness = b.start.size.z;
  const Vec3 size = b.box.size(), middle = b.box.center();
  b.make_whole();
  const TriangleSoup skin = skin_of(b.body);
  const Budget budget(static_cast<std::uint64_t>(some));
  double worst = 0, most_bent = 0;
  for (std::uint64_t set = budget.first; budget.goes_on(set); ++set) {
    Random random(1000 * set + seed);
    Motion motion = Motion::random(kind, std::max(size.x, size.y), 0.15, random);
    motion.pivot = motion.pivot + Vec2{middle.x, middle.y};
    std::vector<Stroke> strokes(1 + static_cast<std::size_t>(random.index(2)));
    for (Stroke& s : strokes) {
      const int last = 1 + random.index(3);
      for (int k = 0; k <= last; ++k) {
        const Vec3 p =
            motion.at(middle + Vec3{random.uniform(-0.65, 0.65) * size.x, random.uniform(-0.65, 0.65) * size.y, 0},
                      static_cast<double>(k) / last);
        s.push_back({p.x, p.y});
      }
    }
    const int poses = random.index(2) ? 4 : 40;
    b.make_whole();
    b.carried = 0;
    TriangleSoup swept;
    double bent = 0;
    for (const Stroke& s : strokes) {
      b.cut_in_world(s, motion, poses);
      add_swept(b, s, motion, poses, 0.25 * edge, swept, bent);
    }
    swept.build();
    // Walls stand upright on the mid-surface, however the blade leans in the body; triangles are flat where the body bends.
    const double lean = kind == MotionKind::kSwing ? 0.5 * thickness * std::tan(motion.amount) : 0,
                 flat = kind == MotionKind::kSway ? 0.05 * edge : 0;
    const double most = (b.options.path_tolerance + b.options.minimum_feature + 0.04) * edge + lean + flat + bent;
    const TriangleSoup walls = walls_of(b.body);
    const FarthestPlace stray = stray_of(walls, swept, 0.15 * edge),
                        missed = missed_of(swept, walls, skin, 0.15 * edge);
    const std::string what = "set " + std::to_string(set) + ", " + std::to_string(poses) + " poses" + text_of(strokes);
    EXPECT_EQ(b.refused, 0) << what;
    EXPECT_LT(stray.distance / edge, most / edge)
        << "a wall at " << stray.at.x << " " << stray.at.y << " " << stray.at.z << ", " << what;
    EXPECT_LT(missed.distance / edge, most / edge)
        << "nothing at " << missed.at.x << " " << missed.at.y << " " << missed.at.z << ", " << what;
    worst = std::max({worst, stray.distance / most, missed.distance / most});
    most_bent = std::max(most_bent, bent / edge);
  }
  if (budget.seconds)
    printf("%s: at worst %.2f of what may be, bent by up to %.3f edges\n", kMotions[static_cast<int>(kind)], worst,
           most_bent);
}
TEST(MovingBodyWalls, OfASheetThatIsShifted) {
  expect_walls_where_the_blade_was("closed-sheet", MotionKind::kShift, 2, 1);
}
TEST(MovingBodyWalls, OfASheetThatSwingsInItsPlane) {
  expect_walls_where_the_blade_was("closed-sheet", MotionKind::kSwingInPlane, 2, 2);
}
TEST(MovingBodyWalls, OfASheetThatSwings) {
  expect_walls_where_the_blade_was("closed-sheet", MotionKind::kSwing, 2, 3);
}
TEST(MovingBodyWalls, OfASheetThatIsPulledApart) {
  expect_walls_where_the_blade_was("closed-sheet", MotionKind::kStretch, 2, 4);
}
TEST(MovingBodyWalls, OfASheetWithAWave) { expect_walls_where_the_blade_was("closed-sheet", MotionKind::kWave, 2, 5); }
TEST(MovingBodyWalls, OfASheetThatSags) { expect_walls_where_the_blade_was("closed-sheet", MotionKind::kSag, 2, 6); }
TEST(MovingBodyWalls, OfASheetThatSways) { expect_walls_where_the_blade_was("closed-sheet", MotionKind::kSway, 2, 7); }
TEST(MovingBodyWalls, OfASheetThatDrifts) {
  expect_walls_where_the_blade_was("closed-sheet", MotionKind::kDrift, 2, 8);
}
TEST(MovingBodyWalls, OfASteakThatSwings) { expect_walls_where_the_blade_was("steak", MotionKind::kSwing, 2, 9); }
TEST(MovingBodyWalls, OfAMeniscusThatSwingsInItsPlane) {
  expect_walls_where_the_blade_was("meniscus", MotionKind::kSwingInPlane, 2, 10);
}

}  // namespace
}  // namespace kerf::moving_body_test
