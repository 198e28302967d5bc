// A blade that is pushed in along its own length, and drawn out, parts nothing; a cut that goes on from there begins where it went in. KERF_FUZZ_SEED=s in the
// environment: from another seed.
#include <cmath>
#include <cstdlib>

#include "cutting/stroke_body.h"
#include "support/rotation_about.h"

namespace kerf::stab_test {
namespace {

using namespace testing_support;

constexpr int kStabs = 80;

std::uint64_t first_seed() {
  const char* seed = std::getenv("KERF_FUZZ_SEED");
  return seed ? std::strtoull(seed, nullptr, 10) : 1;
}

Vec3 random_direction(Random& random) {
  for (;;) {
    const Vec3 d{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (dot(d, d) > 0.01 && dot(d, d) < 1) return normalized(d);
  }
}

/// A turn about an axis through the origin, then a shift.
struct RigidMotion {
  Vec3 axis{0, 0, 1}, shift;
  double angle = 0;
  [[nodiscard]] Vec3 at(Vec3 p, double t) const { return rotation_about(axis, t * angle) * p + t * shift; }
  [[nodiscard]] Vec3 back(Vec3 p, double t) const {
    return transposed_times(rotation_about(axis, t * angle), p - t * shift);
  }
  [[nodiscard]] BladeEdge at(const BladeEdge& e, double t) const { return {at(e.base, t), at(e.tip, t)}; }
};

struct StabbedBody : StrokeBody {
  using StrokeBody::StrokeBody;
  std::vector<Vec3> still;  ///< positions before it moves
  std::size_t uncut_vertices = 0;

  void begin_at_rest() {
    make_whole();
    still.clear();
    posed.clear();
    uncut_vertices = body.collision.vertex_count();
    for (const Vec3& p : body.collision.rest.raw()) still.push_back(deform(p));
  }
  /// The blade goes so far along itself, metres, while the body moves from `t0` to `t1`, and the blade with it.
  void push(BladeEdge& edge, double way, int poses, const RigidMotion& motion, double t0, double t1) {
    const Vec3 along = normalized(edge.tip - edge.base);
    for (int i = 0; i <= poses; ++i) {
      const double part = static_cast<double>(i) / poses, t = t0 + part * (t1 - t0);
      move_to({edge.base + part * way * along, edge.tip + part * way * along}, motion, t);
    }
    edge = {edge.base + way * along, edge.tip + way * along};
  }
  void move_to(const BladeEdge& edge, const RigidMotion& motion, double t) {
    const CollisionMesh& mesh = body.collision;
    position.resize(mesh.vertex_count());
    for (std::size_t i = 0; i < position.size(); ++i) position[i] = motion.at(still[i], t);
    boxes.forget();
    refused += move_blade(*this, motion.at(edge, t)).refused;
    still.resize(uncut_vertices);
    for (std::size_t i = uncut_vertices; i < position.size(); ++i) still.push_back(motion.back(position[i], t));
  }
  /// Metres at rest, of what was opened.
  [[nodiscard]] double lips() const {
    double sum = 0;
    const CollisionMesh& m = body.collision;
    for (const CollisionHalfEdge h : body.wall_edge.raw()) sum += norm(m.rest[m.to(h)] - m.rest[m.from(h)]);
    return sum;
  }
};

/// A blade before a random place of a body, and how far in it goes.
struct Stab {
  BladeEdge edge;
  double way = 0;
  static Stab random(const StabbedBody& b, Random& random) {
    const CollisionMesh& mesh = b.body.collision;
    const CollisionHalfEdge h =
        CollisionMesh::corner(CollisionTriangle(random.index(static_cast<int>(mesh.face_count()))), 0);
    double w[3], sum = 0;
    for (double& x : w) sum += x = random.uniform(0, 1);
    const Vec3 place = b.deform((w[0] / sum) * mesh.rest[mesh.from(h)] + (w[1] / sum) * mesh.rest[mesh.to(h)] +
                                (w[2] / sum) * mesh.rest[mesh.apex(h)]);
    const Vec3 along = random_direction(random);
    const double mean = b.body.mean_root_edge, before = random.uniform(0.05, 1.5) * mean,
                 length = random.uniform(0.2, 4) * mean;
    const Vec3 tip = place - before * along;
    return {{tip - length * along, tip}, before + random.uniform(0.05, 1.5) * mean};
  }
};

struct Body {
  const char* name;
  const char* model;
  std::size_t triangles;
  Vec3 (*deform)(Vec3);
};
constexpr Body kBodies[] = {
    {"sheet", "closed-sheet", 2500, [](Vec3 p) { return p; }},
    {"sheet_round_a_pipe", "closed-sheet", 2500,
     [](Vec3 p) {
       return Vec3{0.35 * std::sin(p.x / 0.35), p.y, 0.35 * std::cos(p.x / 0.35) + p.z};
     }},
    {"steak", "steak", 0, [](Vec3 p) { return p; }},
    {"meniscus", "meniscus", 0, [](Vec3 p) { return p; }},
    {"tube", "tube", 0, [](Vec3 p) { return p; }},
};

class Stabs : public ::testing::TestWithParam<int> {
 protected:
  StabbedBody make() const {
    const Body& kind = kBodies[GetParam()];
    StabbedBody b(kind.model, kind.triangles);
    b.deform = kind.deform;
    return b;
  }
};

TEST_P(Stabs, PartNothing) {
  StabbedBody b = make();
  int slits = 0;
  for (std::uint64_t seed = first_seed(); seed < first_seed() + kStabs; ++seed) {
    Random random(seed);
    Stab stab = Stab::random(b, random);
    const bool moves = seed % 2 == 0, through = seed % 3 == 0, out = seed % 5 != 0;
    constexpr int kPoses[] = {1, 2, 7};
    const int poses = kPoses[random.index(3)];
    RigidMotion motion;
    if (moves) {
      motion.axis = random_direction(random);
      motion.angle = random.uniform(-0.3, 0.3);
      motion.shift = random.uniform(0, 1) * b.body.mean_root_edge * random_direction(random);
    }
    b.begin_at_rest();
    b.stroke.through = through;
    b.push(stab.edge, stab.way, poses, motion, 0, 0.5);
    if (out) b.push(stab.edge, -stab.way, poses, motion, 0.5, 1);
    lift_blade(b.stroke);
    const Status valid = validate_complex(b.body, b.start);
    ASSERT_TRUE(valid.ok()) << valid.error().message;
    EXPECT_EQ(b.refused, 0) << "seed " << seed;
    const double lips = b.lips() / b.body.mean_root_edge;
    EXPECT_EQ(lips, 0) << "seed " << seed << ", " << poses << " poses" << (moves ? ", in motion" : "")
                       << (through ? ", through" : "") << (out ? ", and out" : "");
    slits += lips > 0;
  }
  EXPECT_EQ(slits, 0) << "of " << kStabs;
}

INSTANTIATE_TEST_SUITE_P(Bodies, Stabs, ::testing::Range(0, static_cast<int>(std::size(kBodies))),
                         [](const auto& kind) { return std::string(kBodies[kind.param].name); });

// In flat bodies a cut lies where the edge went through the mid-surface.
TEST(Stab, ACutThatGoesOnFromItHasNoSpur) {
  StabbedBody b("closed-sheet", 2500);
  const double mean = b.body.mean_root_edge;
  for (std::uint64_t seed = first_seed(); seed < first_seed() + kStabs; ++seed) {
    Random random(seed);
    const Vec2 place{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
    const double heading = random.uniform(0, 6.283), far = random.uniform(0.3, 1.8) * mean;
    const Vec2 way = far * Vec2{std::cos(heading), std::sin(heading)};
    Vec3 along = random_direction(random);
    if (std::fabs(along.z) < 0.3) along = normalized(Vec3{along.x, along.y, 0.5});
    const Vec3 tip = Vec3{place.x, place.y, 0} - 1.2 * mean * along;
    BladeEdge edge{tip - 3 * mean * along, tip};
    const int poses = 1 + random.index(6);
    b.begin_at_rest();
    b.push(edge, 2 * mean, poses, {}, 0, 0);
    for (int i = 1; i <= 10; ++i) {
      const Vec3 aside = 0.1 * i * Vec3{way.x, way.y, 0};
      b.move_to({edge.base + aside, edge.tip + aside}, {}, 0);
    }
    lift_blade(b.stroke);
    const StrokeJudge::Deviation off = StrokeJudge::deviation(b, {{place, place + way}});
    EXPECT_LT(std::max(off.stray, off.missed), (b.options.path_tolerance + b.options.minimum_feature) * mean)
        << "seed " << seed;
    EXPECT_NEAR(b.lips(), 2 * far, 0.1 * mean) << "seed " << seed;
  }
}

}  // namespace
}  // namespace kerf::stab_test
