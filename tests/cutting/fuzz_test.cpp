// Random cuts, every invariant checked after each: the property test of the cut.
// KERF_FUZZ_SECONDS=n in the environment runs it longer, KERF_FUZZ_SEED=s starts from another seed.
#include <chrono>
#include <cstdlib>

#include "cutting/cut_body.h"
#include "kerf/base/random.h"

namespace kerf::fuzz_test {
namespace {

using namespace testing_support;

constexpr double kPi = 3.14159265358979323846;

Vec3 anywhere(Random& random, double margin = 0) {
  return {random.uniform(-margin, 1 + margin), random.uniform(-margin, 1 + margin), 0};
}

/// One of the kinds of cuts that the study names.
std::vector<Vec3> random_path(Random& random, const CellComplex& body, const std::vector<std::vector<Vec3>>& earlier) {
  const CollisionMesh& mesh = body.collision;
  const auto vertex = [&] {
    return mesh.rest[CollisionVertex(static_cast<std::int32_t>(random.index(static_cast<int>(mesh.vertex_count()))))];
  };
  switch (random.index(12)) {
    case 0: return {anywhere(random), anywhere(random)};
    case 1: {  // border to border
      const double a = random.uniform(-0.1, 1.1), b = random.uniform(-0.1, 1.1);
      return random.index(2) ? std::vector<Vec3>{{-0.1, a, 0}, {1.1, b, 0}}
                             : std::vector<Vec3>{{a, 1.1, 0}, {b, -0.1, 0}};
    }
    case 2: {  // arc
      auto points = circle_points(anywhere(random), random.uniform(0.05, 0.6), 24, random.uniform(0.1, 0.95));
      return points;
    }
    case 3: return circle_points(anywhere(random), random.uniform(0.02, 0.45), 24);
    case 4: {  // figure eight
      std::vector<Vec3> points;
      const Vec3 c = anywhere(random);
      const double r = random.uniform(0.1, 0.4);
      for (int i = 0; i <= 40; ++i) {
        const double t = 2 * kPi * i / 40;
        points.push_back(c + Vec3{r * std::sin(t), 0.7 * r * std::sin(2 * t), 0});
      }
      return points;
    }
    case 5: {  // random walk
      std::vector<Vec3> points{anywhere(random)};
      const int n = 3 + random.index(20);
      for (int i = 0; i < n; ++i)
        points.push_back(points.back() + Vec3{random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), 0});
      return points;
    }
    case 6: {  // tiny stab
      const Vec3 p = anywhere(random);
      const double r = std::pow(10, random.uniform(-4, -1));
      return {p, p + Vec3{random.uniform(-r, r), random.uniform(-r, r), 0}};
    }
    case 7: {  // along collision edges
      std::vector<Vec3> points;
      auto v = CollisionVertex(static_cast<std::int32_t>(random.index(static_cast<int>(mesh.vertex_count()))));
      points.push_back(mesh.rest[v]);
      for (int i = 0; i < 4; ++i) {
        const CollisionHalfEdge h = mesh.outgoing[v];
        v = mesh.to(random.index(2) ? h : CollisionMesh::next(h));
        if (mesh.rest[v] == points.back()) break;
        points.push_back(mesh.rest[v]);
      }
      if (points.size() < 2) points.push_back(anywhere(random));
      return points;
    }
    case 8: return {vertex(), vertex()};
    case 9: return {vertex(), anywhere(random, 0.1)};
    default: {  // an earlier cut again: exact, reversed, shifted, on from its end
      if (earlier.empty()) return {anywhere(random), anywhere(random)};
      auto points = earlier[static_cast<std::size_t>(random.index(static_cast<int>(earlier.size())))];
      if (random.index(2)) std::reverse(points.begin(), points.end());
      switch (random.index(3)) {
        case 0: break;
        case 1: {
          const double r = std::pow(10, random.uniform(-12, -3));
          const Vec3 shift{random.uniform(-r, r), random.uniform(-r, r), 0};
          for (Vec3& p : points) p += shift;
          break;
        }
        default: points = {points.back(), anywhere(random, 0.1)};
      }
      return points;
    }
  }
}

struct FuzzCount {
  int cuts = 0, refused = 0, invalid = 0;
  long opened = 0;
};

FuzzCount fuzz(CutBody& b, std::uint64_t seed, int cuts, double seconds, int check_every = 1) {
  FuzzCount count;
  Random random(seed);
  std::vector<std::vector<Vec3>> earlier;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < cuts; ++i) {
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() > seconds) break;
    const auto path = random_path(random, b.body, earlier);
    const int refused = b.refused;
    const PolylineCut r = b.cut(path, false);
    ++count.cuts;
    count.opened += r.opened_edges;
    if (b.refused > refused) {
      ++count.refused;
      // Between rough walls a sliver may be inside out: it is not cut off.
      if (b.options.roughness == 0) ADD_FAILURE() << "seed " << seed << " cut " << i << " refused";
    }
    if (i % check_every == 0) {
      const Status status = validate_complex(b.body, b.start);
      if (!status.ok()) {
        ++count.invalid;
        ADD_FAILURE() << "seed " << seed << " cut " << i << ": " << status.error().message;
        return count;
      }
    }
    earlier.push_back(path);
  }
  return count;
}

class Fuzz : public ::testing::TestWithParam<int> {};

TEST_P(Fuzz, EveryInvariantHoldsAfterEveryCut) {
  const int kind = GetParam();
  const char* seconds = std::getenv("KERF_FUZZ_SECONDS");
  const char* first_seed = std::getenv("KERF_FUZZ_SEED");
  const double limit = seconds ? std::atof(seconds) : 1e9;
  const std::uint64_t base = first_seed ? std::strtoull(first_seed, nullptr, 10) : 1;
  const auto begin = std::chrono::steady_clock::now();
  const auto spent = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
  FuzzCount total;
  for (std::uint64_t seed = base; seconds ? spent() < limit : seed < base + 2; ++seed) {
    SyntheticOptions o;
    o.closed = kind % 2 == 1;
    o.subdivisions = o.closed ? 2 : 3;
    o.jitter = 0.2;
    o.bump = 0.004;
    o.seed = seed;
    TriangleMesh mesh = sheet_65_mesh();
    if (kind / 2 % 2 == 1) {
      mesh = annulus_mesh(0.15, 0.5, 12, 3);
      for (Vec3& p : mesh.positions) p += Vec3{0.5, 0.5, 0};
    }
    CutBody b(mesh, o);
    b.options.flips = seed % 3 != 0;
    b.options.layers = 1 + static_cast<int>(seed % 4);
    if (seed % 4 == 2) {  // far finer than recommended
      b.options.minimum_feature = 1e-3;
      b.options.path_tolerance = 1e-3;
    }
    if (seed % 5 == 1) b.options.roughness = 0.3;
    const bool dense = seconds && seed % 7 == 3;
    const FuzzCount count = fuzz(b, 1000 * static_cast<std::uint64_t>(kind) + seed,
                                 dense     ? 500
                                 : seconds ? 60
                                           : 25,
                                 seconds ? limit - spent() : 1e9, dense ? 20 : 1);
    total.cuts += count.cuts;
    total.refused += count.refused;
    total.invalid += count.invalid;
    total.opened += count.opened;
  }
  RecordProperty("cuts", total.cuts);
  if (seconds)
    printf("kind %d: %d cuts, %ld edges opened, %d refused, %d invalid\n", kind, total.cuts, total.opened,
           total.refused, total.invalid);
}

INSTANTIATE_TEST_SUITE_P(Bodies, Fuzz, ::testing::Values(0, 1, 2, 3));

}  // namespace
}  // namespace kerf::fuzz_test
