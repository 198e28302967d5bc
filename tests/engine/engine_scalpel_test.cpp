// The page's scalpel: the cut is seen under the pointer, from wherever the eye looks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "engine/engine_table.h"
#include "support/border_loops.h"

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

// It is drawn without its thickness.
TEST(EngineScalpel, LipsOfAnOpenSheetLieUnderThePointer) {
  for (const Point eye : {Point{0, 0, 3}, Point{0.4, -2, 2}}) {
    Table table({}, still("sheet"));
    const auto page = table.join();
    const Line line{{-0.9, -0.02, 0}, {0.9, 0.05, 0}};
    table.tell(page, page_tool(1, kLine, kDown, {ray_between(eye, line.from)}));
    table.tell(page, page_tool(1, kLine, kUp, {ray_between(eye, line.to)}));
    const VisualMesh& mesh = table.engine.session().body().complex.visual;
    const Vec3 normal = normalized(cross(vec(line.from) - vec(eye), vec(line.to) - vec(eye)));
    int lips = 0;
    double farthest = 0;
    for (const VisualHalfEdge h : ids<VisualHalfEdge>(mesh.half_edge_count())) {
      const Vec3 p = mesh.rest[mesh.from(h)];
      if (!mesh.is_border(h) || std::max(std::abs(p.x), std::abs(p.y)) > 0.49) continue;
      ++lips;
      farthest = std::max(farthest, std::abs(dot(p - vec(eye), normal)));
    }
    EXPECT_GT(lips, 50);
    EXPECT_LT(farthest, 0.01) << "metres, eye " << eye.y;
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

constexpr Point kEyes[] = {{0.01, -0.03, 0.7}, {-0.13, -0.45, 0.45}, {0.5, 0.1, 0.35}};
constexpr float kReach = 0.012F;  // at the body's distance some 8 mm

/// Places of the skin above the rim, with the way to the middle from there as a unit vector.
struct RimPlace {
  Vec3 at, in;
};
std::vector<RimPlace> rim_places(const Session& session) {
  const CollisionMesh& mesh = session.body().complex.collision;
  std::vector<RimPlace> places;
  int n = 0;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count())) {
    if (!mesh.is_border(h) || ++n % 2 == 0) continue;
    const auto skin = [&](CollisionVertex v) { return mesh.rest[v] + norm(mesh.offset[v]) * Vec3{0, 0, 1}; };
    const Vec3 at = 0.7 * skin(mesh.from(h)) + 0.3 * skin(mesh.to(h));
    places.push_back({at, normalized(Vec3{0, 0, at.z} - at)});
  }
  return places;
}
struct Steak {
  Point eye;
  Table table{{}, still("steak")};
  std::uint32_t page = table.join();

  PageRay seen(Vec3 p) { return ray_between(eye, {p.x, p.y, p.z}); }
  /// What there is after a stroke along a straight line of the fresh body, in eight moves.
  const Session& stroke(std::uint32_t tool, Vec3 from, Vec3 to, float reach) {
    table.tell(page, page_command(9, kReset));
    table.tell(page, page_tool(1, tool, kDown, {seen(from)}, 0, reach));
    for (int i = 1; i < 8; ++i) table.tell(page, page_tool(2, tool, kMove, {seen(lerp(from, to, i / 8.0))}, 0, reach));
    table.tell(page, page_tool(3, tool, kUp, {seen(to)}, 0, reach));
    return table.engine.session();
  }
  int loops(std::uint32_t tool, Vec3 from, Vec3 to, float reach) {
    return test::border_loops(stroke(tool, from, to, reach));
  }
};

TEST(EngineScalpel, StrokesBeginAndEndAtARimThatIsNear) {
  for (const Point eye : kEyes)
    for (const std::uint32_t tool : {kScalpel, kLine}) {
      Steak steak{eye};
      const std::vector<RimPlace> places = rim_places(steak.table.engine.session());
      ASSERT_GT(places.size(), 8u);
      int apart = 0;
      for (const RimPlace& p : places) {
        const Vec3 near = p.at + 0.6 * kReach * 0.7 * p.in, inner = p.at + 0.035 * p.in;
        EXPECT_EQ(steak.loops(tool, near, inner, kReach), 1) << near.x << " " << near.y << ", eye " << eye.x;
        EXPECT_EQ(steak.loops(tool, inner, near, kReach), 1) << near.x << " " << near.y << ", eye " << eye.x;
        apart += steak.loops(tool, near, inner, 0) - 1;
        const Vec3 far = p.at + 3.0 * kReach * 0.7 * p.in;
        EXPECT_EQ(steak.loops(tool, far, inner, kReach), 2) << "a stroke in the middle stays there";
      }
      EXPECT_GT(apart, 0) << "without a reach none of these strokes leaves a bridge";
    }
}

TEST(EngineScalpel, StrokesThatAreAtTheRimByThemselvesAreLeftAlone) {
  Steak steak{kEyes[0]};
  const BodyCounts whole = steak.table.engine.session().counts();
  for (const RimPlace& p : rim_places(steak.table.engine.session())) {
    const double reach = 0.7 * static_cast<double>(kReach);
    const Vec3 beside = p.at - 2 * reach * p.in, near = p.at + 0.5 * reach * p.in;
    for (const auto& [from, to] : {std::pair{beside, near}, std::pair{near, beside}}) {
      const std::uint64_t without = steak.stroke(kScalpel, from, to, 0).hash();
      EXPECT_EQ(steak.stroke(kScalpel, from, to, kReach).hash(), without);
    }
    EXPECT_EQ(steak.stroke(kScalpel, near, near + 0.1 * reach * p.in, kReach).counts(), whole) << "a click";
  }
}

}  // namespace
}  // namespace kerf::engine_scalpel_test
