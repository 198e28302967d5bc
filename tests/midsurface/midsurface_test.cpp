// What holds whatever the body is: quality against middles known in closed form, equal bits for any number of threads,
// answers to bad input.
#include "kerf/midsurface/midsurface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "kerf/base/parallel.h"
#include "kerf/base/random.h"
#include "kerf/binding/bind.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"
#include "kerf/mesh/surface_check.h"
#include "kerf/midsurface/diagnosis_file.h"
#include "kerf/midsurface/surface_filter.h"
#include "kerf/midsurface/working_mesh.h"
#include "kerf/spatial/self_intersections.h"
#include "midsurface/corpus.h"
#include "support/source_dir.h"

namespace kerf::midsurface_test {
namespace {

using ::testing::HasSubstr;

corpus::Body body_named(const std::string& name) {
  for (corpus::Body& b : corpus::bodies())
    if (b.name == name) return b;
  ADD_FAILURE() << "no body " << name;
  return {};
}

std::string all(const std::vector<std::string>& sentences) {
  std::string out;
  for (const std::string& s : sentences) out += s + "\n";
  return out;
}

/// Distance of p to the nearest sample.
double distance(Vec3 p, const std::vector<Vec3>& samples) {
  double best = HUGE_VAL;
  for (const Vec3 q : samples) best = std::min(best, norm(p - q));
  return best;
}

// Vertices of the collision mesh lie on the true mid-surface, their half thickness is the true one.
TEST(Midsurface, VerticesLieOnTheKnownMiddle) {
  for (const char* name : {"slab", "bent", "S", "tube", "bowl", "helicoid", "saddle", "egg box", "wedge"}) {
    const corpus::Body body = body_named(name);
    const auto made = make_midsurface(body.mesh);
    ASSERT_TRUE(made.ok());
    const double h = made->quality.mean_half_thickness;
    double worst = 0, mean = 0;
    for (const Vec3 p : made->collision.positions) {
      const double d = distance(p, body.middle) / h;
      worst = std::max(worst, d);
      mean += d / static_cast<double>(made->collision.positions.size());
    }
    EXPECT_LT(mean, 0.15) << name;  // samples are a few hundredths apart
    EXPECT_LT(worst, 0.6) << name;
    EXPECT_LT(made->quality.medial_max, 0.3) << name;
    EXPECT_EQ(made->quality.good_rays, 1) << name;
    EXPECT_GT(made->quality.smallest_angle, 0.35) << name;  // 20 degrees
  }
}

TEST(Midsurface, ThicknessOfASlab) {
  const corpus::Body body = body_named("slab");
  const auto made = make_midsurface(body.mesh);
  ASSERT_TRUE(made.ok());
  for (std::size_t v = 0; v < made->half_thickness.size(); ++v)
    EXPECT_NEAR(made->half_thickness[v], 0.01, 2e-4) << "vertex " << v + 1;
  EXPECT_NEAR(made->verdict.volume_ratio, 1, 0.02);
}

/// A cylinder of radius 1 along z whose sides are slivers as long as it is, as CAD programs write rods.
TriangleMesh rod(std::size_t sides, double length) {
  TriangleMesh m;
  for (std::size_t r = 0; r < 2; ++r)
    for (std::size_t i = 0; i < sides; ++i) {
      const double a = 2 * 3.141592653589793 * static_cast<double>(i) / static_cast<double>(sides);
      m.positions.push_back({std::cos(a), std::sin(a), r == 0 ? 0.0 : length});
    }
  m.positions.push_back({0, 0, 0});
  m.positions.push_back({0, 0, length});
  const VertexId bottom(2 * sides), top(2 * sides + 1);
  for (std::size_t i = 0; i < sides; ++i) {
    const std::size_t j = (i + 1) % sides;
    const VertexId a(i), b(j), c(sides + j), d(sides + i);
    for (const auto& t : {std::array{a, b, c}, std::array{a, c, d}, std::array{bottom, b, a}, std::array{top, d, c}})
      m.triangles.push_back({t[0], t[1], t[2]});
  }
  return m;
}

// Halves of a sliver are three slivers: divided alone, these rods came to 400,000 triangles, and a probe with a hook to 155,000.
TEST(Midsurface, LongSliversDoNotMultiply) {
  for (const double length : {50.0, 200.0, 1000.0}) {
    auto surface = mid::connect(rod(48, length));
    ASSERT_TRUE(surface.ok());
    const double area = mid::total_area(*surface), volume = mid::enclosed_volume(*surface);
    const auto made_of_it = mid::make_working_mesh(std::move(*surface));
    ASSERT_TRUE(made_of_it.ok());
    const mid::WorkingMesh& work = *made_of_it;
    EXPECT_LT(work.mesh.face_count(), 76000) << length;
    EXPECT_NEAR(mid::total_area(work.mesh), area, 0.02 * area) << length;
    EXPECT_NEAR(mid::enclosed_volume(work.mesh), volume, 0.04 * volume) << length;
    for (std::int32_t h = 0; h < work.mesh.origin.count(); ++h) {
      ASSERT_GE(work.mesh.twin[h], 0);
      ASSERT_LE(work.mesh.length(h), 1.5 * work.edge * (1 + 1e-9)) << length;
    }
  }
  const auto made = make_midsurface(rod(48, 200));
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->verdict.thinness, Thinness::kNotThin);
  EXPECT_FALSE(made->verdict.reasons.empty());
}

TEST(Midsurface, TakesTheWantedNumberOfTriangles) {
  const corpus::Body body = body_named("model meniscus");
  for (const std::size_t n : {60u, 100u, 160u, 500u, 1500u}) {
    MidsurfaceOptions options;
    options.triangles = n;
    const auto made = make_midsurface(body.mesh, options);
    ASSERT_TRUE(made.ok());
    const auto got = static_cast<double>(made->collision.triangles.size()), wanted = static_cast<double>(n);
    EXPECT_NEAR(got, wanted, 0.06 * wanted + 2);
    const auto bound = bind(body.mesh, made->collision, {});
    EXPECT_TRUE(bound.ok()) << n << ": " << (bound.ok() ? "" : bound.error().message);
  }
}

TEST(Midsurface, SameBitsForAnyNumberOfThreads) {
  const corpus::Body body = body_named("model meniscus, noisy");
  const auto made_with = [&](int threads) {
    const ThreadLimit limit(threads);
    auto made = make_midsurface(body.mesh);
    EXPECT_TRUE(made.ok());
    return std::move(*made);
  };
  const Midsurface one = made_with(1), four = made_with(4);
  EXPECT_EQ(one.collision.positions, four.collision.positions);
  EXPECT_EQ(one.collision.triangles, four.collision.triangles);
  EXPECT_EQ(one.half_thickness, four.half_thickness);
  EXPECT_EQ(one.quality.to_prisms_mean, four.quality.to_prisms_mean);
}

TEST(Midsurface, FineAndCoarseInputsAgree) {
  // 12, 192 and 49,152 triangles of the same box.
  corpus::Body body = body_named("slab of 12 triangles");
  for (int i = 0; i < 7; ++i) {
    if (i % 2 == 0) {
      const auto made = make_midsurface(body.mesh);
      ASSERT_TRUE(made.ok());
      EXPECT_EQ(made->verdict.thinness, Thinness::kThin) << body.mesh.triangles.size();
      EXPECT_NEAR(made->verdict.width_over_thickness, 9, 1.5);
      EXPECT_LT(made->quality.medial_max, 0.05);
    }
    body.mesh = corpus::subdivided(body.mesh);
  }
}

TEST(Midsurface, TinyTrianglesInOneSpot) {
  // 6,561 triangles where one would do: divided around its centre eight times.
  corpus::Body body = body_named("slab");
  TriangleMesh& mesh = body.mesh;
  std::vector<std::array<VertexId, 3>> parts{mesh.triangles.raw().back()};
  mesh.triangles.raw().pop_back();
  for (int round = 0; round < 8; ++round) {
    std::vector<std::array<VertexId, 3>> next;
    for (const auto& t : parts) {
      const Vec3 centre = (1.0 / 3) * (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]);
      const VertexId m = mesh.positions.push_back(centre);
      for (std::size_t k = 0; k < 3; ++k) next.push_back({t[k], t[(k + 1) % 3], m});
    }
    parts = std::move(next);
  }
  for (const auto& t : parts) mesh.triangles.push_back(t);
  const auto made = make_midsurface(mesh);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_EQ(made->verdict.thinness, Thinness::kThin) << all(made->verdict.reasons);
}

TEST(Midsurface, RefusesOpenSurfaces) {
  const auto sheet = make_model("sheet", {});
  ASSERT_TRUE(sheet.ok());
  const auto made = make_midsurface(sheet->visual);
  ASSERT_FALSE(made.ok());
  EXPECT_THAT(made.error().message, HasSubstr("closed"));
}

// What a body is, in one sentence: not what else is odd about it for the same cause.
TEST(Midsurface, SaysOneSentenceOfWhatABodyIs) {
  struct Case {
    const char* body;
    const char* said;
  };
  for (const Case& c :
       {Case{"ball", "about as thick as it is wide"}, Case{"Moebius strip", "has one side only"},
        Case{"rod", "times as wide as thick"}, Case{"cube of 12 triangles", "times as wide as thick"}}) {
    const auto made = make_midsurface(body_named(c.body).mesh);
    ASSERT_TRUE(made.ok()) << c.body;
    ASSERT_EQ(made->verdict.reasons.size(), 1u) << c.body << ": " << all(made->verdict.reasons);
    EXPECT_THAT(made->verdict.reasons[0], HasSubstr(c.said)) << c.body;
  }
}

TEST(Midsurface, SaysWhyAndWhereABodyIsNotThin) {
  const auto cube = make_midsurface(body_named("cube of 12 triangles").mesh);
  ASSERT_TRUE(cube.ok());
  EXPECT_EQ(cube->verdict.thinness, Thinness::kNotThin);
  EXPECT_THAT(all(cube->verdict.reasons), HasSubstr("times as wide as thick"));
  const corpus::Body beam = body_named("T beam");
  const auto made = make_midsurface(beam.mesh);
  ASSERT_TRUE(made.ok());
  EXPECT_THAT(all(made->verdict.reasons), HasSubstr("branches"));
  ASSERT_FALSE(made->verdict.places.empty());
  double near = HUGE_VAL;  // the web leaves the flange at z = 0.01 and x = 0.02 and 0.04
  for (const MidsurfacePlace& p : made->verdict.places)
    near = std::min(
        {near, std::hypot(p.point.x - 0.02, p.point.z - 0.01), std::hypot(p.point.x - 0.04, p.point.z - 0.01)});
  EXPECT_LT(near, 0.004);
  // The sentence names places where the person's file has them.
  TriangleMesh moved = beam.mesh;
  for (Vec3& p : moved.positions) p += {100, 0, 0};
  const auto away = make_midsurface(moved);
  ASSERT_TRUE(away.ok());
  EXPECT_THAT(all(away->verdict.reasons), HasSubstr("(100"));
  std::size_t flagged = 0;
  for (const std::uint8_t f : made->diagnosis.flag) flagged += f;
  EXPECT_GT(flagged, 0u);
}

TEST(Midsurface, DiagnosesCanBeRead) {
  const corpus::Body beam = body_named("T beam");
  const auto made = make_midsurface(beam.mesh);
  ASSERT_TRUE(made.ok());
  const std::string path = ::testing::TempDir() + "kerf_diagnosis.ply";
  ASSERT_TRUE(write_diagnosis(path, made->diagnosis).ok());
  const auto read = read_mesh(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->triangles.size(), made->diagnosis.surface.triangles.size());
  EXPECT_FALSE(write_diagnosis("/no/such/folder/x.ply", made->diagnosis).ok());
}

TEST(Midsurface, SpikesAndCrossingsAreNoted) {
  corpus::Body body = body_named("model steak, with spikes");
  auto made = make_midsurface(body.mesh);
  ASSERT_TRUE(made.ok());
  EXPECT_THAT(all(made->notes), HasSubstr("spikes"));
  // One vertex of a slab pushed through its other side.
  body = body_named("slab");
  EXPECT_EQ(find_self_intersections(body.mesh).pairs, 0u);
  std::size_t nearest = 0;
  for (std::size_t v = 0; v < body.mesh.positions.size(); ++v)
    if (norm(body.mesh.positions.raw()[v] - Vec3{0, 0, 0.01}) <
        norm(body.mesh.positions.raw()[nearest] - Vec3{0, 0, 0.01}))
      nearest = v;
  body.mesh.positions.raw()[nearest] = {0.0007, 0.0004, -0.013};
  EXPECT_GT(find_self_intersections(body.mesh).pairs, 0u);
  made = make_midsurface(body.mesh);
  ASSERT_TRUE(made.ok());
  EXPECT_THAT(all(made->notes), HasSubstr("passes through itself"));
  // Marked there, and nowhere else.
  const MidsurfaceDiagnosis& d = made->diagnosis;
  int crossing = 0;
  for (std::size_t f = 0; f < d.flag.size(); ++f) {
    if (d.flag[f] != 2) continue;
    ++crossing;
    const auto& t = d.surface.triangles.raw()[f];
    EXPECT_LT(norm(d.surface.positions[t[0]] - Vec3{0, 0, 0}), 0.03);
  }
  EXPECT_GT(crossing, 1);
}

/// Each vertex takes the place of another one of those that `share` of them are.
TriangleMesh scrambled(const TriangleMesh& mesh, double share, std::uint64_t seed) {
  TriangleMesh out = mesh;
  Random random(seed);
  std::vector<VertexId> moved;
  for (const VertexId v : ids<VertexId>(out.positions.size())) {
    out.positions[v] +=
        1e-4 * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};  // no flat triangles
    if (random.uniform() < share) moved.push_back(v);
  }
  for (std::size_t i = moved.size(); i > 1; --i)
    std::swap(out.positions[moved[i - 1]],
              out.positions[moved[static_cast<std::size_t>(random.index(static_cast<int>(i)))]]);
  return out;
}

// Where every triangle crosses hundreds, searches, rays and nearest points took minutes, and gave another reason.
TEST(Midsurface, AScrambledSurfaceIsRefusedForThat) {
  ModelOptions fine;
  fine.visual_triangles = 26000;
  const TriangleMesh sheet = make_model("closed-sheet", fine)->visual, meniscus = make_model("meniscus", {})->visual;
  for (const std::uint64_t seed : {1u, 2u, 3u})
    for (const TriangleMesh& mesh :
         {scrambled(sheet, 1, seed), scrambled(sheet, 0.2, seed), scrambled(meniscus, 1, seed)}) {
      const auto made = make_midsurface(mesh);
      ASSERT_TRUE(made.ok()) << made.error().message;
      EXPECT_EQ(made->verdict.thinness, Thinness::kNotThin);
      ASSERT_EQ(made->verdict.reasons.size(), 1u) << seed;
      EXPECT_THAT(made->verdict.reasons[0], HasSubstr("passes through itself all over, first near ("));
      EXPECT_FALSE(made->verdict.places.empty());
      const MidsurfaceDiagnosis& d = made->diagnosis;
      EXPECT_EQ(d.surface.positions.raw(), mesh.positions.raw());
      for (const std::size_t n : {d.side.size(), d.confidence.size(), d.thickness.size(), d.flag.size()})
        EXPECT_EQ(n, mesh.triangles.size());
      EXPECT_GT(std::count(d.flag.begin(), d.flag.end(), 2), 30);
      EXPECT_TRUE(write_diagnosis(::testing::TempDir() + "scrambled.ply", d).ok());
    }
  // Some vertices astray are no scrambled surface.
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const auto made = make_midsurface(scrambled(sheet, 0.01, seed));
    ASSERT_TRUE(made.ok()) << made.error().message;
    EXPECT_THAT(all(made->verdict.reasons) + all(made->notes) + all(made->verdict.warnings),
                ::testing::AllOf(HasSubstr("passes through itself at "), ::testing::Not(HasSubstr("all over"))));
  }
}

// Of two sheets whose vertices are astray so little is left out that all of them cross: one stays too fine, one where long triangles are split.
TEST(Midsurface, ARoughSurfaceThatCrossesItselfIsRefusedBeforeSidesAreLookedFor) {
  ModelOptions fine;
  fine.visual_triangles = 190000;
  const TriangleMesh sheet = make_model("closed-sheet", fine)->visual;
  for (const auto& [share, by] : {std::pair{0.2, 0.1}, std::pair{0.1, 0.2}}) {
    TriangleMesh mesh = sheet;
    Random random(1);
    for (Vec3& p : mesh.positions)
      if (random.uniform() < share) p += by * Vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    std::map<std::string, int, std::less<>> heard;
    MidsurfaceOptions options;
    options.progress = [&](std::string_view stage, double) { ++heard[std::string(stage)]; };
    const auto made = make_midsurface(mesh, options);
    ASSERT_TRUE(made.ok()) << made.error().message;
    EXPECT_EQ(made->verdict.thinness, Thinness::kNotThin);
    EXPECT_THAT(all(made->verdict.reasons), HasSubstr("the surface passes through itself at "));
    EXPECT_EQ(made->diagnosis.flag.size(), mesh.triangles.size());
    EXPECT_EQ(heard["mid-surface: pairs"], 0) << share;
    EXPECT_LT(heard["mid-surface: divide"], 60) << "splits and collapses of the same edges took 40 rounds";
  }
}

// Each of these takes seconds of some surfaces.
TEST(Midsurface, LongStagesAreAskedToStopOnTheirWay) {
  const TriangleMesh mesh = make_model("closed-sheet", {})->visual;
  for (const std::string stage : {"mid-surface: prepare", "mid-surface: filter", "mid-surface: divide",
                                  "mid-surface: pairs", "mid-surface: sides"}) {
    std::vector<double> heard;
    bool stopped = false, heard_after = false;
    MidsurfaceOptions options;
    options.progress = Progress([&](std::string_view now, double fraction) {
      heard_after = heard_after || stopped;
      if (now == stage) heard.push_back(fraction);
      stopped = now == stage && fraction > 0;
      return !stopped;
    });
    const auto made = make_midsurface(mesh, options);
    ASSERT_FALSE(made.ok()) << stage;
    EXPECT_THAT(made.error().message, HasSubstr("stopped as asked")) << stage;
    EXPECT_GE(heard.size(), 2u) << stage;
    EXPECT_LT(heard.back(), 1) << stage;
    EXPECT_FALSE(heard_after) << stage;
  }
}

// The same bits, whatever was made of it before; and none of what is prepared is made again.
TEST(Midsurface, APreparedSurfaceServesEveryMeshOfIt) {
  ModelOptions fine;
  fine.visual_triangles = 2000;
  const TriangleMesh astray = scrambled(make_model("closed-sheet", fine)->visual, 0.02, 1);
  for (const TriangleMesh& mesh : {make_model("closed-sheet", fine)->visual, astray, body_named("T beam").mesh}) {
    const auto prepared = prepare_midsurface(mesh);
    ASSERT_TRUE(prepared.ok()) << prepared.error().message;
    for (const std::size_t triangles : {240u, 0u}) {
      MidsurfaceOptions options;
      options.triangles = triangles;
      const auto whole = make_midsurface(mesh, options);
      std::vector<std::string> stages;
      options.progress = Progress([&](std::string_view stage, double) { stages.emplace_back(stage); });
      const auto made = make_midsurface(*prepared, options);
      ASSERT_TRUE(whole.ok() && made.ok());
      for (const std::string& stage : stages)
        EXPECT_THAT(stage, ::testing::AnyOf("mid-surface: triangles", "mid-surface: middle", "mid-surface: quality"));
      EXPECT_EQ(stages.empty(), made->verdict.thinness == Thinness::kNotThin);
      EXPECT_EQ(made->collision.positions.raw(), whole->collision.positions.raw());
      EXPECT_EQ(made->collision.triangles.raw(), whole->collision.triangles.raw());
      EXPECT_EQ(made->half_thickness, whole->half_thickness);
      EXPECT_EQ(made->verdict.reasons, whole->verdict.reasons);
      EXPECT_EQ(made->verdict.warnings, whole->verdict.warnings);
      EXPECT_EQ(made->verdict.places.size(), whole->verdict.places.size());
      EXPECT_EQ(made->notes, whole->notes);
      EXPECT_EQ(made->diagnosis.flag, whole->diagnosis.flag);
    }
  }
}

TEST(Midsurface, RealMeniscus) {
  const std::string path = test::source_dir() + "/../shared/meshes/medial-meniscus.obj";
  auto mesh = read_mesh(path);
  if (!mesh.ok()) GTEST_SKIP() << "no real meshes beside the project";
  ASSERT_TRUE(check_surface(*mesh).ok());
  for (const std::size_t n : {0u, 100u, 250u, 500u}) {
    MidsurfaceOptions options;
    options.triangles = n;
    const auto made = make_midsurface(*mesh, options);
    ASSERT_TRUE(made.ok());
    EXPECT_EQ(made->verdict.thinness, Thinness::kThin) << all(made->verdict.reasons) << all(made->verdict.warnings);
    EXPECT_LT(made->quality.medial_mean, 0.1);
    EXPECT_LT(made->quality.medial_max, 0.5);  // next to the wall the sheet goes straight on
    EXPECT_GT(made->quality.smallest_angle, 0.35);
    const auto bound = bind(*mesh, made->collision, {});
    ASSERT_TRUE(bound.ok()) << n << ": " << bound.error().message;
    EXPECT_TRUE(bound->report.warnings.empty()) << n << ": " << all(bound->report.warnings);
  }
}

}  // namespace
}  // namespace kerf::midsurface_test
