// The estimate of what a lattice takes, beside what is then made; and refusals before it is taken.
#include "kerf/session/lattice_memory.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "kerf/base/memory_limit.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/scene_bodies.h"
#include "kerf/session/session.h"

namespace kerf::lattice_memory_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Scene scene_with(const std::string& model, const std::string& lattice, const std::string& simulation = "") {
  auto scene = parse_scene(fmt::format("[body]\nmodel = \"{}\"\n[lattice]\n{}\n[simulation]\nduration = 0.001\n{}\n",
                                       model, lattice, simulation),
                           "a.toml", SceneFolders("."));
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  return std::move(*scene);
}

LatticeMemory estimate(const Scene& scene) {
  const auto bodies = load_scene_bodies(scene);
  EXPECT_TRUE(bodies.ok()) << bodies.error().message;
  return bodies->memory[0].need;
}

TEST(LatticeMemory, HexahedraAreCountedBeforeTheyAreMade) {
  for (const char* model :
       {"steak", "meniscus", "sheet", "tube", "strip", "half-shell", "closed-sheet", "two-holed-slab"})
    for (const char* lattice : {"", "cells = [12, 12, 12]", "cells = [30, 20, 4]", "layers = 3"}) {
      const Scene scene = scene_with(model, lattice);
      const auto session = Session::create(scene);
      ASSERT_TRUE(session.ok()) << session.error().message;
      const auto made = static_cast<double>(session->counts().hexahedra);
      const auto said = static_cast<double>(estimate(scene).hexahedra);
      EXPECT_GE(said, 0.8 * made) << model << ' ' << lattice;
      EXPECT_LE(said, 2 * made + 20) << model << ' ' << lattice;
    }
}

TEST(LatticeMemory, ALatticeThatDoesNotFitIsRefusedBeforeItIsMade) {
  const Scene scene = scene_with("strip", "cells = [400, 400, 400]");
  rusage before{}, after{};
  ::getrusage(RUSAGE_SELF, &before);
  const MemoryLimit limit(std::uint64_t{4'000'000'000});
  const auto session = Session::create(scene);
  ::getrusage(RUSAGE_SELF, &after);
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(session.error().message,
              AllOf(HasSubstr("a.toml:4: [lattice]: 400 x 400 x 400 cells, about 64000000 of them with material"),
                    HasSubstr("would take about 390 GB of memory, and 4 GB are the most (--memory)"),
                    HasSubstr("give fewer or larger cells, or allow more with --memory")));
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100 << 10) << "kB";
}

TEST(LatticeMemory, AModelThatDoesNotFitIsRefusedBeforeItIsMade) {
  const auto scene_of = [](const std::string& text) {
    auto scene = parse_scene(text, "a.toml", SceneFolders("."));
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    return std::move(*scene);
  };
  const Scene large = scene_of("[body]\nmodel = \"closed-sheet\"\noptions = { visual_triangles = 10000000 }\n");
  const std::string small = "[[body]]\nmodel = \"closed-sheet\"\noptions = { visual_triangles = 100000 }\n";
  rusage before{}, after{};
  ::getrusage(RUSAGE_SELF, &before);
  const MemoryLimit limit(std::uint64_t{200'000'000});
  const auto bodies = load_scene_bodies(large);
  ASSERT_FALSE(bodies.ok());
  EXPECT_EQ(bodies.error().kind, ErrorKind::kBadInput);
  EXPECT_THAT(bodies.error().message,
              AllOf(HasSubstr("a.toml:3: [body]: model closed-sheet with 10000000 visual triangles would take about 4"),
                    HasSubstr("200 MB are the most (--memory); give fewer visual_triangles")));
  std::string many;
  for (int i = 0; i < 6; ++i) many += small;
  EXPECT_THAT(load_scene_bodies(scene_of(many)).error().message, HasSubstr("6 bodies"));
  ::getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 50 << 10) << "kB";
  EXPECT_TRUE(load_scene_bodies(scene_of(small)).ok());
}

TEST(LatticeMemory, CellsWithoutMaterialCountToo) {
  const Scene scene =
      scene_with("closed-sheet", "cells = [400, 400, 100]\ncell_size = [0.05, 0.05, 0.05]\norigin = [-2.5, -10, -2.5]");
  const LatticeMemory need = estimate(scene);
  EXPECT_LT(need.hexahedra, 2000U);
  EXPECT_GT(need.bytes, 16'000'000U * 80);
  const MemoryLimit limit(std::uint64_t{1'000'000'000});
  EXPECT_FALSE(Session::create(scene).ok());
}

TEST(LatticeMemory, AFactorisationTakesMore) {
  const Scene scene = scene_with("closed-sheet", "cells = [120, 120, 1]", "preconditioner = \"direct\"");
  const LatticeMemory need = estimate(scene);
  EXPECT_GT(need.bytes, 500'000'000U);  // 500 MB were measured
  EXPECT_LT(need.bytes, 700'000'000U);
  const MemoryLimit limit(std::uint64_t{400'000'000});
  const auto session = Session::create(scene);
  ASSERT_FALSE(session.ok());
  EXPECT_THAT(session.error().message,
              AllOf(HasSubstr("with preconditioner \"direct\""), HasSubstr("another preconditioner")));
  EXPECT_TRUE(Session::create(scene_with("closed-sheet", "cells = [120, 120, 1]")).ok());
}

}  // namespace
}  // namespace kerf::lattice_memory_test
