#include "kerf/binding/bound_body_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "kerf/base/random.h"
#include "kerf/mesh/models.h"
#include "support/source_dir.h"

namespace kerf::bound_body_file_test {
namespace {

class BoundBodyFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / fmt::format("kerf_bound_body_{}", ::getpid());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  static BoundBody body(std::string_view model, double thickness) {
    auto m = make_model(model, {});
    auto b = bind(m->visual, m->collision, {.thickness = thickness});
    EXPECT_TRUE(b.ok());
    return std::move(*b);
  }
  static std::vector<char> read(const std::filesystem::path& p) {
    std::ifstream in(p, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void write(const std::filesystem::path& p, const std::vector<char>& bytes) {
    std::ofstream(p, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  std::filesystem::path folder_;
};

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}
bool same(PoolRun a, PoolRun b) { return a.first == b.first && a.count == b.count && a.reversed == b.reversed; }

TEST_F(BoundBodyFile, RoundTripIsExact) {
  for (const auto model : {"steak", "sheet", "tube"}) {
    const BoundBody a = body(model, 0.1);
    ASSERT_TRUE(save_bound_body(a, folder_ / "a.body").ok());
    const auto b = load_bound_body(folder_ / "a.body");
    ASSERT_TRUE(b.ok()) << b.error().message;
    const VisualMesh &va = a.complex.visual, &vb = b->complex.visual;
    EXPECT_TRUE(same_bits(va.origin.raw(), vb.origin.raw()));
    EXPECT_TRUE(same_bits(va.twin.raw(), vb.twin.raw()));
    EXPECT_TRUE(same_bits(va.planar.raw(), vb.planar.raw()));
    EXPECT_TRUE(same_bits(va.texture.raw(), vb.texture.raw()));
    EXPECT_TRUE(same_bits(va.rest.raw(), vb.rest.raw()));
    EXPECT_TRUE(same_bits(va.normal.raw(), vb.normal.raw()));
    EXPECT_TRUE(same_bits(va.patch.raw(), vb.patch.raw()));
    EXPECT_TRUE(same_bits(va.free.raw(), vb.free.raw()));
    EXPECT_TRUE(same_bits(va.barrier.raw(), vb.barrier.raw()));
    const CollisionMesh &ca = a.complex.collision, &cb = b->complex.collision;
    EXPECT_TRUE(same_bits(ca.rest.raw(), cb.rest.raw()));
    EXPECT_TRUE(same_bits(ca.offset.raw(), cb.offset.raw()));
    EXPECT_TRUE(same_bits(ca.bound.raw(), cb.bound.raw()));
    ASSERT_EQ(ca.chain.size(), cb.chain.size());
    for (std::size_t h = 0; h < ca.chain.size(); ++h)
      for (std::size_t side = 0; side < 2; ++side) EXPECT_TRUE(same(ca.chain.raw()[h][side], cb.chain.raw()[h][side]));
    for (std::size_t f = 0; f < ca.free.size(); ++f)
      for (std::size_t side = 0; side < 2; ++side) EXPECT_TRUE(same(ca.free.raw()[f][side], cb.free.raw()[f][side]));
    EXPECT_TRUE(same_bits(a.complex.chain_pool.raw(), b->complex.chain_pool.raw()));
    EXPECT_TRUE(same_bits(a.complex.free_pool.raw(), b->complex.free_pool.raw()));
    EXPECT_EQ(a.complex.mean_root_edge, b->complex.mean_root_edge);
    EXPECT_EQ(a.complex.closed, b->complex.closed);
    EXPECT_EQ(a.report.path_length, b->report.path_length);
    EXPECT_EQ(a.report.warnings, b->report.warnings);
    // Writing again gives the same file.
    ASSERT_TRUE(save_bound_body(*b, folder_ / "b.body").ok());
    EXPECT_EQ(read(folder_ / "a.body"), read(folder_ / "b.body"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.body.part"));
  }
}

// How long it took is no part of a body: builds compare files, caches go by their hashes.
TEST_F(BoundBodyFile, TheSameMeshesGiveTheSameBytes) {
  for (const auto model : {"steak", "sheet"}) {
    ASSERT_TRUE(save_bound_body(body(model, 0.1), folder_ / "a.body").ok());
    BoundBody again = body(model, 0.1);
    again.report.seconds.total += 1;
    ASSERT_TRUE(save_bound_body(again, folder_ / "b.body").ok());
    EXPECT_EQ(read(folder_ / "a.body"), read(folder_ / "b.body")) << model;
  }
}

TEST_F(BoundBodyFile, BytesInMemoryAreThoseOfTheFile) {
  const BoundBody a = body("steak", 0.1);
  BodyNature nature;
  nature.density = 1050;
  ASSERT_TRUE(save_bound_body(a, folder_ / "a.body", nature).ok());
  const std::vector<char> file = read(folder_ / "a.body");
  const std::string bytes = bound_body_bytes(a, nature);
  EXPECT_EQ(bytes, std::string(file.begin(), file.end()));
  BodyNature back;
  const auto again = parse_bound_body(bytes, "memory", &back);
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(back.density, nature.density);
  EXPECT_EQ(bound_body_bytes(*again, back), bytes);
}

TEST_F(BoundBodyFile, MaterialAndLatticeComeBack) {
  const BoundBody a = body("sheet", 0.1);
  BodyNature nature, back;
  nature.young = 4.5e3;
  nature.poisson = -0.2;
  nature.lattice = LatticeHint{{-1, 2, 3.5}, {0.1, 0.2, 0.3}, {9, 8, 1}};
  ASSERT_TRUE(save_bound_body(a, folder_ / "a.body", nature).ok());
  const auto b = load_bound_body(folder_ / "a.body", &back);
  ASSERT_TRUE(b.ok()) << b.error().message;
  EXPECT_EQ(back.young, nature.young);
  EXPECT_EQ(back.poisson, nature.poisson);
  EXPECT_FALSE(back.density);
  ASSERT_TRUE(back.lattice);
  EXPECT_EQ(back.lattice->origin, nature.lattice->origin);
  EXPECT_EQ(back.lattice->cell, nature.lattice->cell);
  EXPECT_EQ(back.lattice->cells, nature.lattice->cells);
  ASSERT_TRUE(save_bound_body(a, folder_ / "a.body").ok());
  ASSERT_TRUE(load_bound_body(folder_ / "a.body", &back).ok());
  EXPECT_FALSE(back.young || back.poisson || back.density || back.lattice);
  // What can't be is refused, whoever wrote it.
  for (const int what : {0, 1, 2, 3, 4}) {
    BodyNature wrong = nature;
    if (what == 0) wrong.young = -1;
    if (what == 1) wrong.poisson = 0.5;
    if (what == 2) wrong.density = std::nan("");
    if (what == 3) wrong.lattice->cell.y = 0;
    if (what == 4) wrong.lattice->cells[2] = 0;
    ASSERT_TRUE(save_bound_body(a, folder_ / "w.body", wrong).ok());
    const auto r = load_bound_body(folder_ / "w.body");
    ASSERT_FALSE(r.ok()) << what;
    EXPECT_NE(r.error().message.find("can't be"), std::string::npos) << r.error().message;
  }
}

TEST_F(BoundBodyFile, ReadsVersionOne) {
  BodyNature nature;
  nature.young = 1;
  const auto body =
      load_bound_body(std::filesystem::path(test::source_dir()) / "tests/binding/samples/body-version-1.kerf", &nature);
  ASSERT_TRUE(body.ok()) << body.error().message;
  EXPECT_EQ(body->complex.collision.face_count(), 2u);
  EXPECT_EQ(body->report.input_triangles, 8u);
  EXPECT_FALSE(nature.young || nature.poisson || nature.density || nature.lattice);
}

TEST_F(BoundBodyFile, DamagedFilesAreRefusedByName) {
  const std::filesystem::path good = folder_ / "good.body", bad = folder_ / "bad.body";
  ASSERT_TRUE(save_bound_body(body("sheet", 0.1), good).ok());
  const std::vector<char> bytes = read(good);
  const auto expect_refused = [&](const std::vector<char>& content, const std::string& reason) {
    write(bad, content);
    const auto r = load_bound_body(bad);
    ASSERT_FALSE(r.ok()) << reason;
    EXPECT_NE(r.error().message.find("bad.body"), std::string::npos) << r.error().message;
    EXPECT_NE(r.error().message.find(reason), std::string::npos) << r.error().message;
  };
  expect_refused({}, "empty");
  expect_refused({'K', 'E', 'R', 'F'}, "not a bound body");
  expect_refused(std::vector<char>(1000, 'x'), "not a bound body");
  for (const double part : {0.001, 0.1, 0.5, 0.999}) {
    std::vector<char> cut(bytes.begin(),
                          bytes.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(bytes.size())));
    expect_refused(cut, "truncated");
  }
  auto longer = bytes;
  longer.push_back(0);
  expect_refused(longer, "damaged");
  auto newer = bytes;
  newer[8] = 9;
  expect_refused(newer, "version 9");
  Random random(3);
  for (int i = 0; i < 200; ++i) {  // any single damaged byte
    auto damaged = bytes;
    const auto at = static_cast<std::size_t>(12 + random.index(static_cast<int>(bytes.size()) - 12));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 + random.index(255)));
    expect_refused(damaged, "damaged");
  }
  for (int i = 0; i < 40; ++i) {  // a damaged count near the start: nothing huge may be allocated
    auto damaged = bytes;
    damaged[static_cast<std::size_t>(24 + i % 8)] = static_cast<char>(0x7f - i);
    expect_refused(damaged, "damaged");
  }
}

// A file whose checksum is right but whose contents are not (written by something else) must not get through either.
TEST_F(BoundBodyFile, ContentsAreValidated) {
  const BoundBody good = body("sheet", 0.1);
  const auto refused = [&](auto&& damage) {
    BoundBody b = good;
    damage(b.complex);
    EXPECT_TRUE(save_bound_body(b, folder_ / "x.body").ok());
    const auto r = load_bound_body(folder_ / "x.body");
    EXPECT_FALSE(r.ok());
    if (r) return;
    EXPECT_NE(r.error().message.find("x.body: bound body: "), std::string::npos) << r.error().message;
  };
  refused([](CellComplex& x) { x.visual.origin.set(VisualHalfEdge(100), VisualVertex(1 << 30)); });
  refused([](CellComplex& x) { x.visual.origin.set(VisualHalfEdge(100), VisualVertex(-5)); });
  refused([](CellComplex& x) { x.visual.twin.set(VisualHalfEdge(100), VisualHalfEdge(1 << 30)); });
  refused([](CellComplex& x) { x.visual.outgoing.set(VisualVertex(10), VisualHalfEdge(-1)); });
  refused([](CellComplex& x) { x.visual.patch.set(VisualTriangle(10), Patch{1 << 20}); });
  refused([](CellComplex& x) { x.collision.chain.set(CollisionHalfEdge(5), {PoolRun{1 << 30, 5, false}, PoolRun{}}); });
  refused([](CellComplex& x) { x.collision.free.set(CollisionTriangle(5), {PoolRun{0, 1 << 30, false}, PoolRun{}}); });
  refused([](CellComplex& x) { x.collision.bound.set(CollisionVertex(5), {VisualVertex(1 << 30), VisualVertex()}); });
  refused([](CellComplex& x) { x.collision.root.set(CollisionTriangle(5), RootId(1 << 30)); });
  refused([](CellComplex& x) { x.chain_pool.set(PoolIndex(0), VisualVertex(1 << 30)); });
  refused([](CellComplex& x) { x.visual.rest.set(VisualVertex(0), {NAN, 0, 0}); });
  refused([](CellComplex& x) { x.collision.planar.set(CollisionHalfEdge(4), {NAN, 0}); });
  refused([](CellComplex& x) { x.visual.texture.set(VisualHalfEdge(100), {NAN, 0}); });
  refused([](CellComplex& x) { x.visual.texture.set(VisualHalfEdge(3), {0, -HUGE_VALF}); });
  refused([](CellComplex& x) { x.visual.texture.set(VisualHalfEdge(0), {3.4e38f, 0}); });
  refused([](CellComplex& x) { x.mean_root_edge = NAN; });
  refused([](CellComplex& x) { x.visual.planar.grow(1); });
}

// A place at 1e290 m is finite, but its square is not.
TEST_F(BoundBodyFile, LimitsAreThoseOfMeshes) {
  const BoundBody good = body("steak", 0);
  const std::string path = (folder_ / "far.body").string();
  const auto refused = [&](auto&& damage, const std::string& why) {
    BoundBody b = good;
    BodyNature nature;
    damage(b.complex, nature);
    EXPECT_TRUE(save_bound_body(b, path, nature).ok());
    const auto r = load_bound_body(path);
    ASSERT_FALSE(r.ok()) << why;
    EXPECT_EQ(r.error().message.find(path), 0U) << r.error().message;
    EXPECT_NE(r.error().message.find(why), std::string::npos) << r.error().message;
    EXPECT_NE(r.error().message.find("bind the body again"), std::string::npos) << r.error().message;
  };
  for (const double far : {1e290, -1e290, 2e6}) {
    refused([&](CellComplex& x, BodyNature&) { x.visual.rest.set(VisualVertex(7), {0, far, 0}); }, "m across");
    refused([&](CellComplex& x, BodyNature&) { x.collision.rest.set(CollisionVertex(7), {0, 0, far}); }, "m across");
    refused([&](CellComplex& x, BodyNature&) { x.collision.offset.set(CollisionVertex(7), {far, 0, 0}); }, "m across");
  }
  const auto moved = [](double by, double scale) {
    return [=](CellComplex& x, BodyNature&) {
      for (VisualVertex v : ids<VisualVertex>(x.visual.vertex_count()))
        x.visual.rest.set(v, scale * x.visual.rest[v] + Vec3{by, by, by});
      for (CollisionVertex v : ids<CollisionVertex>(x.collision.vertex_count())) {
        x.collision.rest.set(v, scale * x.collision.rest[v] + Vec3{by, by, by});
        x.collision.offset.set(v, scale * x.collision.offset[v]);
      }
    };
  };
  refused(moved(1e8, 1), "from the origin");
  refused(moved(0, 1e-9), "m across");
  refused([&](CellComplex& x, BodyNature&) { x.mean_root_edge = 1e290; }, "mean edge");
  const Vec3 one{1, 1, 1};
  refused([&](CellComplex&, BodyNature& n) { n.lattice = LatticeHint{1e290 * one, one, {1, 1, 1}}; }, "lattice");
  refused([&](CellComplex&, BodyNature& n) { n.lattice = LatticeHint{one, 1e290 * one, {1, 1, 1}}; }, "lattice");
}

TEST_F(BoundBodyFile, PlacesThatCannotBeUsed) {
  EXPECT_FALSE(load_bound_body(folder_ / "missing.body").ok());
  EXPECT_FALSE(load_bound_body(folder_).ok());
  const Status s = save_bound_body(body("sheet", 0.1), folder_ / "no" / "such" / "folder.body");
  ASSERT_FALSE(s.ok());
  EXPECT_NE(s.error().message.find("folder.body"), std::string::npos);
}

}  // namespace
}  // namespace kerf::bound_body_file_test
