// Strokes from within a body out over its rim, while it moves: what they cut reaches the rim.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "engine/engine_table.h"
#include "kerf/embedding/embedding.h"
#include "support/border_loops.h"
#include "support/source_dir.h"

namespace kerf::engine_rim_test {
namespace {

using namespace test;

SceneSource shipped(const std::string& name) {
  std::ifstream file(source_dir() + "/scenes/" + name + ".toml");
  SceneSource source;
  source.name = name;
  source.text.assign(std::istreambuf_iterator<char>(file), {});
  EXPECT_FALSE(source.text.empty()) << name;
  return source;
}

/// Loops of edges with one triangle beyond one of each piece: a slit that reaches the rim is part of the rim's loop, one with a bridge has its own.
int inner_loops(const Session& session) {
  return test::border_loops(session) - static_cast<int>(session.counts().pieces);
}

struct Rim {
  CollisionVertex at, inner;
};
/// Every so many vertices of the rim, each with a vertex some way inwards.
std::vector<Rim> rim_of(const CollisionMesh& mesh, int number) {
  std::vector<CollisionVertex> rim;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(mesh.half_edge_count()))
    if (mesh.is_border(h)) rim.push_back(mesh.from(h));
  std::vector<Rim> out;
  for (int i = 0; i < number; ++i) {
    const CollisionVertex v = rim[rim.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(number)];
    const Vec3 wanted = 0.55 * mesh.rest[v];
    CollisionVertex inner;
    double least = HUGE_VAL;
    for (const CollisionVertex u : ids<CollisionVertex>(mesh.vertex_count()))
      if (norm(mesh.rest[u] - wanted) < least) least = norm(mesh.rest[u] - wanted), inner = u;
    out.push_back({v, inner});
  }
  return out;
}

Point point(Vec3 p) { return {p.x, p.y, p.z}; }

TEST(EngineRim, StrokesOutOverTheRimLeaveNoBridge) {
  constexpr int kStrokes = 25, kTicks = 40;
  constexpr Point kFrom{0.3, -1.6, 2.2};
  for (const int gap : {1, 2, 6, 20}) {
    int bridges = 0, met = 0;
    Table table({}, shipped("sheet"));
    const auto page = table.join();
    table.tick(60);
    const std::vector<Rim> rim = rim_of(table.engine.session().body().complex.collision, kStrokes);
    for (const Rim& r : rim) {
      const Body& body = table.engine.session().body();
      std::vector<Vec3> nodes, places(body.complex.collision.vertex_count());
      table.engine.session().shown_nodes(nodes);
      collision_positions(body.hex, body.embedding, nodes, places);
      const auto now = [&](CollisionVertex v) { return places[v.index()]; };
      const int before = inner_loops(table.engine.session());
      const Vec3 from = now(r.inner), over = now(r.at) + 0.4 * (now(r.at) - now(r.inner));
      table.tell(page, page_tool(1, kScalpel, kDown, {ray_between(kFrom, point(from))}, 0, 0.008F));
      for (int i = gap; i <= kTicks; i += gap) {
        table.tick(gap);
        const Vec3 p = lerp(from, over, i / static_cast<double>(kTicks));
        table.tell(page, page_tool(2, kScalpel, kMove, {ray_between(kFrom, point(p))}, 0, 0.008F));
      }
      table.tick();
      table.tell(page, page_tool(3, kScalpel, kUp, {ray_between(kFrom, point(over))}, 0, 0.008F));
      table.tick();
      met += table.engine.session().strokes().back().triangles > 0;
      const int after = inner_loops(table.engine.session());
      if (after != before) ++bridges;
      table.tell(page, page_command(9, kUndo));
      table.tick(30);
    }
    EXPECT_EQ(met, kStrokes);
    EXPECT_EQ(bridges, 0) << "a sample every " << gap << " ticks";
  }
}

}  // namespace
}  // namespace kerf::engine_rim_test
