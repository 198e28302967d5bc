// The page's scalpel: the cut is seen under the pointer, from wherever the eye looks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/engine_table.h"

namespace kerf::engine_scalpel_test {
namespace {

using namespace test;

SceneSource still(const std::string& model) {
  SceneSource source;
  source.name = model;
  source.text = "[body]\nmodel = \"" + model + "\"\n[simulation]\ngravity = [0, 0, 0]\n";
  return source;
}

Vec3 vec(Point p) { return {p.x, p.y, p.z}; }

/// How far the lips that the eye sees lie beside the plane of the eye and two points, in mean edges: the farthest, and how many there are.
struct Beside {
  double farthest = 0;
  int lips = 0;
};
Beside beside_pointer(const Session& session, Vec3 eye, Vec3 from, Vec3 to) {
  const VisualMesh& mesh = session.body().complex.visual;
  const Vec3 normal = normalized(cross(from - eye, to - eye));
  Beside b;
  for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count()))
    for (int k = 0; k < 3; ++k) {
      const VisualHalfEdge h = VisualMesh::corner(f, k);
      if (mesh.patch[f].is_wall() || !mesh.patch[VisualMesh::face(mesh.twin[h])].is_wall()) continue;
      const Vec3 p = mesh.rest[mesh.from(h)], q = mesh.rest[mesh.to(h)], r = mesh.rest[mesh.from(VisualMesh::prev(h))];
      if (normalized(cross(q - p, r - p)).z < 0.7) continue;  // below, or on the side
      ++b.lips;
      b.farthest = std::max(b.farthest, std::abs(dot(p - eye, normal)));
    }
  b.farthest /= session.body().complex.mean_root_edge;
  return b;
}

struct Line {
  Point from, to;
};
constexpr Line kLines[] = {
    {{-0.25, 0.01, 0}, {0.25, 0.02, 0}}, {{0.01, -0.25, 0}, {-0.02, 0.25, 0}}, {{-0.2, -0.15, 0}, {0.2, 0.18, 0}}};

TEST(EngineScalpel, LipsLieUnderThePointerWhereverTheEyeIs) {
  for (const Point eye : {Point{0, 0, 0.6}, Point{0, -0.45, 0.45}, Point{0.5, 0.1, 0.3}, Point{-0.35, 0.35, 0.25}})
    for (const Line& line : kLines) {
      Table table({}, still("steak"));
      const auto page = table.join();
      constexpr int kMoves = 24;
      for (int i = 0; i < kMoves; ++i) {
        const double s = i / (kMoves - 1.0);
        const Point p{line.from.x + s * (line.to.x - line.from.x), line.from.y + s * (line.to.y - line.from.y), 0};
        table.tell(page, page_tool(1, kScalpel, i == 0 ? kDown : i + 1 == kMoves ? kUp : kMove, {ray_between(eye, p)}));
        table.tick();
      }
      const Beside b = beside_pointer(table.engine.session(), vec(eye), vec(line.from), vec(line.to));
      EXPECT_GT(b.lips, 100);
      EXPECT_LT(b.farthest, 0.15) << eye.x << " " << eye.y << " " << eye.z;
      EXPECT_EQ(table.pages[page].cuts.at(0).pieces, 2u);
    }
}

// Two rays, and skin that bends between them.
TEST(EngineScalpel, StraightCutsLieUnderTheLineOnABentBody) {
  for (const char* model : {"steak", "closed-sheet\"\noptions = {bend = 1.2, visual_triangles = 20000}\n#"})
    for (const Point eye : {Point{0, 0, 3}, Point{0.4, -2, 2}})
      for (const double x : {-0.1, 0.0, 0.03}) {
        Table table({}, still(model));
        const auto page = table.join();
        const Line line{{x - 0.9, -0.02, 0}, {x + 0.9, 0.02, 0}};
        table.tell(page, page_tool(1, kLine, kDown, {ray_between(eye, line.from)}));
        table.tell(page, page_tool(1, kLine, kUp, {ray_between(eye, line.to)}));
        table.tick();
        const Beside b = beside_pointer(table.engine.session(), vec(eye), vec(line.from), vec(line.to));
        EXPECT_GT(b.lips, 50) << model;
        EXPECT_LT(b.farthest, 0.15) << model << ", eye " << eye.y;
        EXPECT_EQ(table.pages[page].cuts.at(0).pieces, 2u) << model;
      }
}

// However the samples are put into messages.
TEST(EngineScalpel, CutsAlongEachSampleHoweverManyComeAtOnce) {
  constexpr int kSamples = 600;
  std::vector<PageRay> rays;
  for (int i = 0; i <= kSamples; ++i) {
    const double angle = 6 * (i / static_cast<double>(kSamples)), r = 0.03 + 0.0005 * (i % 2);
    rays.push_back(ray_between({0, -0.2, 0.6}, {r * std::cos(angle), r * std::sin(angle), 0}));
  }
  std::vector<std::uint64_t> hashes;
  for (const std::size_t batch : {1u, 7u, 600u}) {
    Table table({}, still("steak"));
    const auto page = table.join();
    table.tell(page, page_tool(1, kScalpel, kDown, {rays[0]}));
    for (std::size_t i = 1; i < rays.size(); i += batch) {
      const auto from = rays.begin() + static_cast<std::ptrdiff_t>(i);
      table.tell(page, page_tool(2, kScalpel, kMove,
                                 {from, from + static_cast<std::ptrdiff_t>(std::min(batch, rays.size() - i))}));
    }
    table.tell(page, page_tool(3, kScalpel, kUp, {rays.back()}));
    hashes.push_back(table.engine.session().hash());
    EXPECT_GT(table.engine.session().strokes().back().triangles, 20u);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

}  // namespace
}  // namespace kerf::engine_scalpel_test
