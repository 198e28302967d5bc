// The engine behind the viewer, without sockets: what pages send, and what a page that knows only the protocol makes of the
// answers.
#include "kerf/engine/engine.h"
#include "kerf/scene/ways_out.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "engine_table.h"
#include "kerf/base/memory_limit.h"
#include "kerf/base/random.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/session/body.h"
#include "support/source_dir.h"

namespace kerf::engine_test {
namespace {

using namespace kerf::test;

/// Where a page draws its vertices, and where the library has them: the largest difference, metres.
double drawn_beside(const MirroredPage& page, const Session& session) {
  const std::vector<Vec3> positions = session.visual_positions();
  const RenderSurface& surface = session.body().surface;
  EXPECT_EQ(page.body.rest.size(), surface.size());
  double most = 0;
  for (std::size_t v = 0; v < std::min(page.body.rest.size(), surface.size()); ++v) {
    const F3 drawn = page.body.drawn(v);
    const Vec3 p = positions[surface.vertex[RenderVertex(v)].index()];
    most = std::max(most, norm(Vec3{drawn[0], drawn[1], drawn[2]} - p));
  }
  return most;
}

TEST(Engine, APageSeesTheBodyWhereItIs) {
  Table table;
  const auto page = table.join();
  table.tick(5);
  const MirroredPage& p = table.pages[page];
  EXPECT_EQ(p.name, "steak");
  EXPECT_EQ(p.bodies, 1u);
  EXPECT_TRUE(p.held);
  EXPECT_GE(p.frames, 5u);
  EXPECT_GT(p.time, 0.05);
  table.expect_mirrored(page);
  // What the page draws is what the library computes.
  EXPECT_LT(drawn_beside(p, table.engine.session()), 2e-7);
}

/// KERF_PAGE_SAMPLE=FILE writes what a page heard, and where the library had its vertices after each message, for the page's own
/// tests (apps/viewer/tests/samples/fading.json; after a change of the protocol it is made anew).
void keep_sample(const std::vector<protocol::Message>& messages, const std::vector<std::vector<float>>& positions) {
  const char* file = std::getenv("KERF_PAGE_SAMPLE");
  if (!file) return;
  const auto hex = [](const void* data, std::size_t n) {
    std::string out;
    for (std::size_t i = 0; i < n; ++i) out += fmt::format("{:02x}", static_cast<const unsigned char*>(data)[i]);
    return out;
  };
  std::ofstream out(file);
  out << "{\"messages\":[";
  for (std::size_t i = 0; i < messages.size(); ++i)
    out << (i ? ",\n\"" : "\n\"") << hex(messages[i]->data(), messages[i]->size()) << '"';
  out << "],\n\"positions\":[";
  for (std::size_t i = 0; i < positions.size(); ++i)
    out << (i ? ",\n\"" : "\n\"") << hex(positions[i].data(), positions[i].size() * sizeof(float)) << '"';
  out << "]}\n";
}

// In a body under tension vertices that a cut hangs on other nodes would jump; their offsets travel with the nodes.
TEST(Engine, APageDrawsTheSurfaceThatDoesNotJump) {
  SceneSource sheet;
  sheet.name = "sheet";
  sheet.text =
      "[body]\nmodel = \"closed-sheet\"\noptions = { visual_triangles = 500 }\n[simulation]\ntime_step = 0.005\ngravity = [0, 0, 0]\n"
      "[[fix]]\nhalf_space = { point = [0, -0.4, 0], normal = [0, -1, 0] }\n";
  Table table({}, sheet);
  const auto page = table.join();
  const MirroredPage& p = table.pages[page];
  const Session& session = table.engine.session();
  const Point eye{0.02, -0.05, 4};
  table.tell(page, page_tool(1, kGrasp, kDown, {ray_between(eye, {0, 0.45, 0})}));
  for (int k = 1; k <= 30; ++k) {
    table.tell(page, page_tool(1, kGrasp, kMove, {ray_between(eye, {0.004 * k, 0.45 + 0.01 * k, 0.005 * k})}));
    table.tick();
  }
  table.tell(page, page_tool(1, kGrasp, kUp, {}, 1));  // with Shift it stays held
  double worst = drawn_beside(p, session), largest = 0;
  std::size_t most = 0;
  std::vector<std::vector<float>> sample;
  std::uint32_t second = 0;
  const auto look = [&] {
    ASSERT_TRUE(p.errors.empty()) << p.errors[0].text;
    worst = std::max(worst, drawn_beside(p, session));
    for (const auto& [v, offset] : p.body.offsets)
      largest = std::max(largest, norm(Vec3{offset[0], offset[1], offset[2]}));
    most = std::max(most, p.body.offsets.size());
  };
  const auto sampled = [&](bool last) {
    auto& heard = table.kept[second];
    std::erase_if(heard, [](const protocol::Message& m) {
      const auto type = std::to_integer<int>((*m)[0]);
      return type != 2 && type != 3 && type != 4;
    });
    const std::vector<Vec3> positions = session.visual_positions();
    std::vector<float> now;
    for (const VisualVertex v : session.body().surface.vertex.raw())
      for (int k = 0; k < 3; ++k) now.push_back(static_cast<float>(positions[v.index()][k]));
    while (sample.size() < heard.size()) sample.push_back(now);
    if (last) keep_sample(heard, sample);
  };
  for (int k = 0; k <= 40; ++k) {
    // A page that comes in the middle: what it hears from now on is the sample.
    if (k == 20) {
      second = table.engine.connect();
      table.pages[second];
      table.kept[second];
      table.tell(second, page_hello());
    }
    if (k == 20) {
      sampled(false);
      EXPECT_EQ(table.pages[second].frames, 0u);
      EXPECT_GT(table.pages[second].body.offsets.size(), 10u);
      EXPECT_LT(drawn_beside(table.pages[second], session), 1e-6) << "a page that has just come";
    }
    const Point to{-0.6 + 0.03 * k, 0.1 + 0.05 * std::sin(0.3 * k), 0};
    table.tell(page, page_tool(2, kScalpel, k == 0 ? kDown : kMove, {ray_between(eye, to)}));
    look();
    if (second != 0 && k < 22) sampled(false);
    table.tick();
    look();
    if (second != 0 && k < 22) sampled(k == 21);
  }
  table.tell(page, page_tool(2, kScalpel, kUp, {ray_between(eye, {0.65, 0.1, 0})}));
  look();
  table.tick(12);  // 200 ms
  look();
  std::printf("%zu vertices beside their copies at most, by up to %.3g m; the page draws within %.3g m\n", most,
              largest, worst);
  EXPECT_LT(worst, 1e-6);
  EXPECT_GT(most, 10u);
  EXPECT_GT(largest, 1e-3);
  const Body& body = session.body();
  for (const auto& [v, offset] : p.body.offsets)  // all else has faded
    EXPECT_TRUE(session.stays_at_rest(body.complex.visual.rest[body.surface.vertex[RenderVertex(std::size_t{v})]]))
        << v;
  table.expect_mirrored(page);
}

TEST(Engine, WhatAPageDoesWantsATickAtOnceWhatItSeesDoesNot) {
  Table table;
  const auto page = table.join();
  table.tick(3);
  EXPECT_FALSE(table.engine.tick_wanted());
  table.tell(page, page_ray(7, ray_between(kEye, {0, 0, 0})));
  EXPECT_FALSE(table.engine.tick_wanted());
  table.tell(page, page_tool(8, kGrasp, kDown, {ray_between(kEye, {0, 0, 0})}));
  EXPECT_TRUE(table.engine.tick_wanted());
  table.tick();
  EXPECT_FALSE(table.engine.tick_wanted());
}

TEST(Engine, AStrokeCutsTheSteakInTwoAndUndoTakesItBack) {
  Table table;
  const auto page = table.join();
  table.tick(2);
  const std::uint64_t before = body_hash(table.engine.session().body());
  const MirroredBody intact = table.pages[page].body;
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.13, 0}});
  MirroredPage& p = table.pages[page];
  ASSERT_TRUE(p.errors.empty()) << p.errors.front().text;
  ASSERT_EQ(p.cuts.size(), 1u);
  EXPECT_EQ(p.cuts[0].outcome, 0u);
  EXPECT_EQ(p.cuts[0].pieces, 2u);
  EXPECT_EQ(p.cuts[0].input, 100u);
  EXPECT_EQ(p.cuts[0].invariants, 0u) << p.cuts[0].text;
  EXPECT_GT(p.cuts[0].triangles, 10u);
  EXPECT_GT(p.body.wall.size(), 100u);
  EXPECT_GT(p.body.rest.size(), intact.rest.size());
  EXPECT_EQ(p.undo_depth, 1u);
  table.expect_mirrored(page);

  const std::uint64_t cut = body_hash(table.engine.session().body());
  const MirroredBody halves = p.body;
  table.tell(page, page_command(101, kUndo));
  table.tick();
  EXPECT_EQ(body_hash(table.engine.session().body()), before);
  EXPECT_EQ(p.body.rest, intact.rest);
  EXPECT_EQ(p.body.copy, intact.copy);
  EXPECT_EQ(p.body.skin, intact.skin);
  EXPECT_EQ(p.body.wall, intact.wall);
  EXPECT_EQ(p.body.copies, intact.copies);
  EXPECT_EQ(p.body.nodes.size(), intact.nodes.size());
  ASSERT_EQ(p.cuts.size(), 2u);
  EXPECT_EQ(p.cuts[1].outcome, 3u);
  EXPECT_EQ(p.cuts[1].pieces, 1u);
  table.tell(page, page_command(102, kRedo));
  table.tick();
  EXPECT_EQ(body_hash(table.engine.session().body()), cut);
  EXPECT_EQ(p.body.wall, halves.wall);
  EXPECT_EQ(p.bodies, 1u);  // all of it in patches
  table.expect_mirrored(page);
}

Vec3 vec(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

double away_from_segment(Vec3 p, Vec3 a, Vec3 b) {
  const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
  return norm(p - (a + t * (b - a)));
}
double distance_to_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 n = cross(b - a, c - a);
  const auto inside = [&](Vec3 u, Vec3 v) { return dot(cross(v - u, p - u), n) >= 0; };
  if (inside(a, b) && inside(b, c) && inside(c, a)) return std::abs(dot(p - a, n)) / norm(n);
  return std::min({away_from_segment(p, a, b), away_from_segment(p, b, c), away_from_segment(p, c, a)});
}

// Every vertex of the skin has one foot; it lies on the collision mesh, on an edge of it or at the vertex it is linked to.
TEST(Engine, FeetLieOnWhatVerticesAreBoundTo) {
  constexpr double kClose = 1e-6;  // m: single precision of the messages
  Table table;
  const auto page = table.join();
  table.tell(page, page_command(1, kOverlay, {1}));
  EXPECT_TRUE(table.pages[page].overlay.feet.empty());  // nobody asked
  table.tell(page, page_command(2, kOverlay, {2}));
  for (int round = 0; round < 2; ++round) {
    const MirroredPage& p = table.pages[page];
    const auto& o = p.overlay;
    std::set<std::uint32_t> skin, seen;
    for (const auto& t : p.body.skin) skin.insert(t.begin(), t.end());
    std::map<std::uint32_t, std::vector<Vec3>> linked;
    for (const auto& link : o.links) linked[link[1]].push_back(vec(o.rest[link[0]]));
    std::array<int, 3> count{};
    for (std::size_t i = 0; i < o.feet.size(); ++i) {
      const auto [vertex, kind] = std::pair(o.feet[i][0], o.feet[i][1]);
      EXPECT_TRUE(seen.insert(vertex).second);
      ASSERT_LT(kind, 3u);
      ++count[kind];
      const Vec3 foot = vec(o.foot_rest[i]);
      double away = HUGE_VAL;
      if (kind == 0)
        for (const Vec3 q : linked[vertex]) away = std::min(away, norm(q - foot));
      else
        for (const auto& t : o.triangles) {
          const Vec3 a = vec(o.rest[t[0]]), b = vec(o.rest[t[1]]), c = vec(o.rest[t[2]]);
          away = std::min(away, kind == 2 ? distance_to_triangle(foot, a, b, c)
                                          : std::min({away_from_segment(foot, a, b), away_from_segment(foot, b, c),
                                                      away_from_segment(foot, c, a)}));
        }
      EXPECT_LT(away, kClose) << "round " << round << " vertex " << vertex << " kind " << kind;
    }
    EXPECT_EQ(seen, skin);
    for (const int n : count) EXPECT_GT(n, 80) << "round " << round;
    if (round == 0) {
      table.cut(page, {{0, -0.1, 0}, {0.01, 0.02, 0}});
      table.tick();
      ASSERT_EQ(p.cuts.size(), 1u);
    }
  }
}

TEST(Engine, MirrorsSurviveRandomStrokes) {
  Table table;
  const auto page = table.join();
  table.tell(page, page_command(1, kOverlay, {1}));
  Random random(11);
  for (int round = 0; round < 25; ++round) {
    const int what = random.index(10);
    const auto place = [&] { return Point{random.uniform(-0.12, 0.12), random.uniform(-0.1, 0.1), 0}; };
    if (what < 6) {
      std::vector<Point> points{place(), place()};
      if (what < 3) points.push_back(place());
      table.cut(page, points, what % 2 == 0);
    } else if (what == 6) {
      table.tell(page, page_command(2, kUndo));
    } else if (what == 7) {
      table.tell(page, page_command(2, kRedo));
    } else if (what == 8) {  // a stroke that is called off
      table.tell(page, page_tool(3, kScalpel, kDown, {ray_between(kEye, place())}));
      table.tell(page, page_tool(3, kScalpel, kMove, {ray_between(kEye, place())}));
      table.tell(page, page_tool(3, kScalpel, kCancel, {}));
    } else {  // pull something
      table.tell(page, page_tool(4, kGrasp, kDown, {ray_between(kEye, place())}));
      for (int k = 0; k < 5; ++k) {
        table.tell(page, page_tool(4, kGrasp, kMove, {ray_between(kEye, place())}));
        table.tick();
      }
      table.tell(page, page_tool(4, kGrasp, kUp, {}));
    }
    table.tick(2);
    table.expect_mirrored(page);
    const Status valid = table.engine.session().validate();
    ASSERT_TRUE(valid.ok()) << "round " << round << ": " << valid.error().message;
  }
  const MirroredPage& p = table.pages[page];
  EXPECT_EQ(p.bodies, 1u);
  EXPECT_GT(p.patches, 50u);
  EXPECT_GT(p.overlays, 20u);
  for (const auto& cut : p.cuts) EXPECT_EQ(cut.invariants, 0u) << cut.text;
}

TEST(Engine, StraightCutsAndStrokesThroughTheAir) {
  Table table;
  const auto page = table.join();
  table.tell(page, page_tool(7, kLine, kDown, {ray_between(kEye, {-0.13, 0.01, 0})}));
  table.tell(page, page_tool(8, kLine, kUp, {ray_between(kEye, {0.13, 0.02, 0})}));
  table.tick();
  MirroredPage& p = table.pages[page];
  ASSERT_EQ(p.cuts.size(), 1u);
  EXPECT_EQ(p.cuts[0].pieces, 2u);
  EXPECT_EQ(p.cuts[0].input, 8u);
  table.cut(page, {{0.3, 0.3, 0}, {0.3, -0.3, 0}});
  ASSERT_EQ(p.cuts.size(), 2u);
  EXPECT_EQ(p.cuts[1].outcome, 1u);
  EXPECT_EQ(p.undo_depth, 1u);  // nothing to undo came of it
  EXPECT_EQ(p.flags & 2u, 0u);
}

TEST(Engine, ABodyThatMovesOntoAWaitingBladeIsCutFromItsRim) {
  Table table;
  const auto page = table.join();
  const MirroredPage& p = table.pages[page];
  const Point eye{0, -0.0815, 0.6};
  table.tell(page, page_tool(1, kScalpel, kDown, {ray_between(eye, {0, -0.0815, 0})}));  // just beside the rim
  table.tell(page, page_command(2, kGravity, {0, -20, 0}));
  table.tick(60);
  table.tell(page, page_ray(3, ray_between(eye, {0, -0.0815, 0})));
  ASSERT_GE(p.hits.at(0).triangle, 0) << "the body has not reached the blade: the test tests nothing";
  for (double y = -0.07; y < 0.13; y += 0.01)
    table.tell(page, page_tool(4, kScalpel, kMove, {ray_between(eye, {0, y, 0})}));
  table.tell(page, page_tool(5, kScalpel, kUp, {}));
  table.tick();
  ASSERT_EQ(p.cuts.size(), 1u);
  EXPECT_EQ(p.cuts[0].pieces, 2u);
  EXPECT_EQ(p.undo_depth, 1u);
  table.expect_mirrored(page);
}

TEST(Engine, RaysFindTheBody) {
  Table table;
  const auto page = table.join();
  table.tell(page, page_ray(3, ray_between(kEye, {0.01, -0.02, 0})));
  table.tell(page, page_ray(4, ray_between(kEye, {0.5, 0.5, 0})));
  const MirroredPage& p = table.pages[page];
  ASSERT_EQ(p.hits.size(), 2u);
  EXPECT_GE(p.hits[0].triangle, 0);
  // On the skin: about 1 cm above the middle.
  EXPECT_NEAR(p.hits[0].point[2], 0.01, 0.004);
  EXPECT_NEAR(p.hits[0].t,
              std::sqrt(std::pow(p.hits[0].point[0] - kEye.x, 2) + std::pow(p.hits[0].point[1] - kEye.y, 2) +
                        std::pow(p.hits[0].point[2] - kEye.z, 2)),
              1e-9);
  EXPECT_NEAR(std::abs(p.hits[0].normal[2]), 1, 0.1);
  EXPECT_EQ(p.hits[1].triangle, -1);
}

TEST(Engine, PullingMovesTheBodyAndShiftLeavesItHeld) {
  Table table;
  const auto page = table.join();
  const MirroredPage& p = table.pages[page];
  const auto height = [&] {
    double top = -1;
    for (const F3& n : p.body.nodes) top = std::max(top, static_cast<double>(n[2]));
    return top;
  };
  const Point side{0.02, -0.6, 0.1};  // seen from the side: pulling up is up
  table.tell(page, page_ray(1, ray_between(side, {0, -0.03, 0})));
  ASSERT_GE(p.hits.at(0).triangle, 0);
  const double before = height();
  table.tell(page, page_tool(2, kGrasp, kDown, {ray_between(side, {0, -0.03, 0})}));
  for (int k = 1; k <= 60; ++k) {
    table.tell(page, page_tool(2, kGrasp, kMove, {ray_between(side, {0, -0.03, 0.001 * k})}));
    table.tick();
  }
  EXPECT_EQ(p.grasps, 1u);
  EXPECT_GT(height(), before + 0.03);
  table.tell(page, page_tool(3, kGrasp, kUp, {}, 1));  // with Shift
  table.tick(30);
  EXPECT_EQ(p.grasps, 1u);
  EXPECT_GT(height(), before + 0.02);
  table.tell(page, page_tool(4, kRelease, kDown, {ray_between({0, -0.06, 0.6}, {0, -0.05, 0.05})}));
  table.tell(page, page_tool(4, kRelease, kUp, {}));
  // However it was hit: releasing all over the body lets it go.
  for (double y = -0.09; y < 0.09; y += 0.01) {
    table.tell(page, page_tool(5, kRelease, kDown, {ray_between({0, y, 0.6}, {0, y, 0})}));
    table.tell(page, page_tool(5, kRelease, kUp, {}));
  }
  table.tick();
  EXPECT_EQ(p.grasps, 0u);
  EXPECT_TRUE(p.errors.empty());
}

/// Which piece a copy of the page belongs to: the place in the list of masses of one that it hangs together with by nodes.
std::size_t piece_of(const MirroredPage& p, std::uint32_t copy) {
  std::vector<std::size_t> parent(p.body.nodes.size());
  for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = i;
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& c : p.body.copies)
    if (c[0] < parent.size())
      for (const auto n : c) parent[root(n)] = root(c[0]);
  for (std::size_t i = 0; i < p.mass_copies.size(); ++i)
    if (root(p.body.copies.at(p.mass_copies[i])[0]) == root(p.body.copies.at(copy)[0])) return i;
  return p.mass_copies.size();
}

TEST(Engine, PagesKnowWhatPiecesWeigh) {
  Table table;
  const auto page = table.join();
  const MirroredPage& p = table.pages[page];
  ASSERT_EQ(p.masses.size(), 1u);
  const float whole = p.uncut_mass;
  EXPECT_GT(whole, 0.2f);
  EXPECT_FLOAT_EQ(p.masses[0], whole);
  table.tick(40);
  EXPECT_EQ(p.weighings, 1u);  // nothing is said twice

  // Not in a stroke, soon after it.
  for (int k = 0; k <= 40; ++k) {
    table.tell(page, page_tool(2, kScalpel, k == 0 ? kDown : kMove, {ray_between(kEye, {-0.03, 0.12 - 0.006 * k, 0})}));
    table.tick();
  }
  EXPECT_EQ(p.weighings, 1u);
  table.tell(page, page_tool(2, kScalpel, kUp, {ray_between(kEye, {-0.03, -0.12, 0})}));
  table.tick(20);
  ASSERT_EQ(p.masses.size(), 2u);
  EXPECT_EQ(p.masses_version, p.body.version);
  EXPECT_NEAR(p.masses[0] + p.masses[1], whole, 1e-5f * whole);

  // What the pointer meets, and what the forceps hold, is of the piece that lies there: the larger one to the right.
  const std::size_t larger = p.masses[0] > p.masses[1] ? 0 : 1;
  table.tell(page, page_ray(3, ray_between(kEye, {0.05, 0, 0})));
  table.tell(page, page_ray(4, ray_between(kEye, {-0.07, 0, 0})));
  table.tell(page, page_ray(5, ray_between(kEye, {0.5, 0, 0})));
  ASSERT_EQ(p.hits.size(), 3u);
  EXPECT_EQ(piece_of(p, p.hits[0].copy), larger);
  EXPECT_EQ(piece_of(p, p.hits[1].copy), 1 - larger);
  EXPECT_EQ(p.hits[2].copy, 0xffffffffu);
  table.tell(page, page_tool(6, kGrasp, kDown, {ray_between(kEye, {-0.07, 0, 0})}));
  table.tick();
  ASSERT_EQ(p.grasp_copies.size(), 1u);
  EXPECT_EQ(piece_of(p, p.grasp_copies[0]), 1 - larger);
  table.tell(page, page_tool(6, kGrasp, kUp, {}));

  // A page that comes later knows too; so do all when the material is another, and when the cut is undone.
  const auto late = table.join();
  EXPECT_EQ(table.pages[late].masses, p.masses);
  const Material m = table.engine.session().material();
  table.tell(page, page_command(7, kMaterial, {m.young, m.poisson, 2 * m.density}));
  table.tick(20);
  EXPECT_FLOAT_EQ(p.uncut_mass, 2 * whole);
  table.tell(page, page_command(8, kUndo));
  table.tick(20);
  ASSERT_EQ(p.masses.size(), 1u);
  EXPECT_FLOAT_EQ(p.masses[0], p.uncut_mass);
  EXPECT_EQ(table.pages[late].masses, p.masses);
}

TEST(Engine, PagesKnowWhatIsFixed) {
  Table table;
  const auto page = table.join();
  // The scene holds everything beyond y = 0.055 m; nothing of that moves, all else may.
  const auto right = [&](const MirroredPage& p) {
    std::vector<std::uint32_t> wanted;
    for (std::uint32_t i = 0; i < p.body.nodes.size(); ++i) {
      const NodeId n(std::size_t{i});
      if (table.engine.session().is_fixed(n) && table.engine.session().body().hex.active(n)) wanted.push_back(i);
    }
    return p.fixed == wanted;
  };
  // Vertices beyond the border whose hexahedra have nodes that move.
  const auto right_vertices = [](const MirroredPage& p, bool held) {
    std::size_t count = 0;
    for (std::uint32_t v = 0; v < p.body.rest.size(); ++v) {
      const double y = p.body.rest[v][1];
      if (std::abs(y - 0.055) < 1e-6) continue;
      bool moves = false;
      for (const std::uint32_t n : p.body.copies.at(p.body.copy[v]))
        moves = moves || !std::binary_search(p.fixed.begin(), p.fixed.end(), n);
      const bool wanted = held && moves && y > 0.055;
      EXPECT_EQ(std::binary_search(p.held_vertices.begin(), p.held_vertices.end(), v), wanted) << "vertex " << v;
      count += wanted ? 1 : 0;
    }
    return count;
  };
  EXPECT_GT(right_vertices(table.pages[page], true), 50u);
  const std::vector<std::uint32_t> rim = table.pages[page].fixed;
  ASSERT_FALSE(rim.empty());
  const auto start = table.pages[page].body.nodes;
  for (const std::uint32_t i : rim) EXPECT_GT(start[i][1], 0.054f);
  table.tick(40);
  for (const std::uint32_t i : rim) EXPECT_EQ(table.pages[page].body.nodes[i], start[i]);
  EXPECT_TRUE(right(table.pages[page]));
  table.tell(page, page_command(1, kFixAll, {0}));
  table.tick(20);
  EXPECT_TRUE(table.pages[page].fixed.empty());
  right_vertices(table.pages[page], false);
  table.tell(page, page_command(2, kFixAll, {1}));
  const auto late = table.join();
  EXPECT_TRUE(!table.pages[late].fixed.empty() && right(table.pages[late]) && right(table.pages[page]));
  // Cuts through what is held, and undo, give and take nodes.
  table.tell(page, page_command(3, kReset));
  table.tell(page, page_tool(4, kLine, kDown, {ray_between(kEye, {-0.02, 0.09, 0})}));
  table.tell(page, page_tool(4, kLine, kUp, {ray_between(kEye, {0.02, -0.09, 0})}));
  table.tick(20);
  EXPECT_GT(table.pages[page].fixed.size(), rim.size());
  EXPECT_TRUE(right(table.pages[page]) && right(table.pages[late]));
  EXPECT_GT(right_vertices(table.pages[page], true), 50u);
  EXPECT_EQ(table.pages[late].held_vertices, table.pages[page].held_vertices);
  table.tell(page, page_command(5, kUndo));
  table.tick(20);
  EXPECT_EQ(table.pages[page].fixed, rim);
  EXPECT_TRUE(table.pages[page].errors.empty());
}

TEST(Engine, FixHoldsAndReleaseLetsFall) {
  SceneSource loose = steak();
  loose.text = "[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.01\ngravity = [0, 0, -5]\n";
  Table table({}, loose);
  const auto page = table.join();
  const auto lowest = [&] {
    double z = 1;
    for (const F3& n : table.pages[page].body.nodes) z = std::min(z, static_cast<double>(n[2]));
    return z;
  };
  table.tell(page, page_command(1, kFixAll, {1}));
  table.tick(60);
  const double held = lowest();
  EXPECT_GT(held, -0.25);
  table.tell(page, page_command(2, kFixAll, {0}));
  table.tick(60);
  EXPECT_LT(lowest(), held - 0.5);
  table.tell(page, page_command(3, kReset));
  for (double y = -0.05; y <= 0.05; y += 0.02) {
    table.tell(page, page_tool(4, kFix, kDown, {ray_between({0, y, 0.6}, {0, y, 0})}));
    table.tell(page, page_tool(4, kFix, kUp, {}));
  }
  table.tick(60);
  EXPECT_GT(lowest(), -0.25);
  EXPECT_TRUE(table.pages[page].errors.empty());
}

TEST(Engine, AHoldOnACutEdgeSurvivesUndoAndRedo) {
  Table table;
  const auto page = table.join();
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.13, 0}});
  for (const double x : {-0.012, 0.002, -0.03}) {
    table.tell(page, page_tool(2, kGrasp, kDown, {ray_between({x, -0.05, 0.6}, {x, -0.06, 0})}));
    for (int k = 1; k <= 10; ++k) {
      table.tell(page, page_tool(2, kGrasp, kMove, {ray_between({x, -0.05, 0.6}, {x + 0.002 * k, -0.06, 0})}));
      table.tick();
    }
    table.tell(page, page_tool(3, kGrasp, kUp, {}, 1));
  }
  for (int k = 0; k < 3; ++k) {
    table.tell(page, page_command(4, kUndo));
    table.tick(10);
    table.tell(page, page_command(5, kRedo));
    table.tick(10);
    table.expect_mirrored(page);
  }
  table.tell(page, page_command(4, kUndo));
  table.tick(30);
  EXPECT_TRUE(table.engine.playing());
  for (const auto& e : table.pages[page].errors) ADD_FAILURE() << e.text;
  for (double x = -0.1; x < 0.1; x += 0.01) {
    table.tell(page, page_tool(5, kRelease, kDown, {ray_between({x, -0.06, 0.6}, {x, -0.06, 0})}));
    table.tell(page, page_tool(5, kRelease, kUp, {}));
  }
  table.tick(5);
}

TEST(Engine, GravityAndMaterialChangeLive) {
  Table table;
  const auto page = table.join();
  table.tell(page, page_command(1, kGravity, {0, 0, 0}));
  table.tell(page, page_command(2, kMaterial, {50e3, 0.3, 900}));
  EXPECT_EQ(table.engine.session().gravity(), (Vec3{0, 0, 0}));
  EXPECT_EQ(table.engine.session().material().young, 50e3);
  table.tick(3);
  EXPECT_TRUE(table.engine.session().validate().ok()) << table.engine.session().validate().error().message;
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.13, 0}});
  EXPECT_TRUE(table.engine.session().validate().ok());
  EXPECT_EQ(table.pages[page].cuts.at(0).invariants, 0u);
  table.tell(page, page_command(3, kMaterial, {-1, 0.3, 900}));
  table.tell(page, page_command(4, kMaterial, {1e4, 0.7, 900}));
  table.tell(page, page_command(5, kGravity, {0, 0, 1e9}));
  ASSERT_EQ(table.pages[page].errors.size(), 3u);
  EXPECT_EQ(table.pages[page].errors[0].code, 2u);
  EXPECT_EQ(table.engine.session().material().young, 50e3);
  // Numbers that nothing can be computed with: the range is said.
  const auto refused = [&](const std::vector<double>& values, const char* range) {
    table.tell(page, page_command(6, kMaterial, values));
    EXPECT_EQ(table.pages[page].errors.back().input, 6u);
    EXPECT_NE(table.pages[page].errors.back().text.find(range), std::string::npos)
        << table.pages[page].errors.back().text;
    table.pages[page].errors.back().input = 0;
  };
  refused({1e-300, 0.3, 900}, "young must be at least 0.001, but is 1e-300");
  refused({1e300, 0.3, 900}, "young must be at most 1");
  refused({50e3, 0.3, 1e300}, "density must be at most 1000000, but is 1e+300");
  EXPECT_EQ(table.engine.session().material().young, 50e3);
  // The recording has none of them: it could not be read.
  const auto recording = parse_recording(recording_text(table.engine.recording()), "test");
  ASSERT_TRUE(recording.ok()) << recording.error().message;
}

TEST(Engine, ValuesOfCommandsThatMeanNothingAreRefused) {
  Table table;
  const auto page = table.join();
  table.tell(page, page_command(1, kPause));
  const std::int64_t steps = table.engine.session().step_count();
  std::uint32_t input = 1;
  const auto refused = [&](std::uint32_t code, double value, const char* range) {
    const std::size_t before = table.pages[page].errors.size();
    table.tell(page, page_command(++input, code, {value}));
    ASSERT_EQ(table.pages[page].errors.size(), before + 1) << code << ' ' << value;
    EXPECT_EQ(table.pages[page].errors.back().code, 2u);
    EXPECT_NE(table.pages[page].errors.back().text.find(range), std::string::npos)
        << table.pages[page].errors.back().text;
  };
  for (const double value : {1e18, -5.0, 1.5, 0.0, 1001.0}) refused(kStep, value, "from 1 to 1000");
  for (const double value : {7.0, -1.0, 0.5}) refused(kOverlay, value, "from 0 to 2");
  for (const std::uint32_t code : {static_cast<std::uint32_t>(kFixAll), static_cast<std::uint32_t>(kContacts),
                                   static_cast<std::uint32_t>(kRecording)})
    for (const double value : {7.0, 1e300, -1.0}) refused(code, value, "from 0 to 1");
  EXPECT_EQ(table.engine.session().step_count(), steps);
}

TEST(Engine, PauseStepAndSpeed) {
  Table table;
  const auto page = table.join();
  table.tick(6);
  const double running = table.pages[page].time;
  EXPECT_NEAR(running, 0.1, 0.006);  // real time
  table.tell(page, page_command(1, kPause));
  EXPECT_EQ(table.pages[page].flags & 1u, 0u);
  table.tick(10);
  EXPECT_EQ(table.pages[page].time, running);
  table.tell(page, page_command(2, kStep, {3}));
  EXPECT_NEAR(table.pages[page].time, running + 0.015, 1e-12);
  table.tell(page, page_command(3, 1));
  table.tell(page, page_command(4, 4, {0.5}));
  const double before = table.pages[page].time;
  table.tick(60);
  EXPECT_NEAR(table.pages[page].time - before, 0.5, 0.011);
  table.tell(page, page_command(5, 4, {0}));
  EXPECT_EQ(table.pages[page].errors.size(), 1u);
}

TEST(Engine, APageThatComesBetweenTwoStepsSeesOneBody) {
  SceneSource scripted = steak();
  scripted.text +=
      "[[command]]\nat = 0.01\ntype = \"blade\"\nframe = \"rest\"\nposes = [\n"
      "  { time = 0.00, base = [0.0, -0.09, 0.05], tip = [0.0, -0.09, -0.05] },\n"
      "  { time = 0.20, base = [0.0, 0.09, 0.05], tip = [0.0, 0.09, -0.05] },\n]\n";
  EngineOptions options;
  options.overrides.scripted = true;
  Table table(options, scripted);
  (void)table.join();
  table.tick();
  int came = 0;
  for (int tick = 0; tick < 10; ++tick) {
    table.engine.begin_tick(1.0 / 60);
    while (table.engine.step_due()) {
      const auto late = table.join();
      // Vertices, copies and nodes fit each other (page_messages.h); where they are comes with the next frame.
      EXPECT_EQ(table.pages[late].body.version, table.engine.version());
      EXPECT_EQ(table.pages[late].bodies, 1u);
      ++came;
    }
    table.engine.end_tick();
    table.deliver();
  }
  EXPECT_GT(came, 20);
  EXPECT_GT(table.pages[1].patches, 5u);
  for (const auto& [id, page] : table.pages) {
    EXPECT_TRUE(page.errors.empty()) << page.errors[0].text;
    table.expect_mirrored(id);
  }
}

TEST(Engine, ToolsBelongToOnePage) {
  Table table;
  const auto first = table.join(), second = table.join();
  EXPECT_TRUE(table.pages[first].held);
  EXPECT_FALSE(table.pages[second].held);
  EXPECT_EQ(table.pages[second].clients, 2u);
  table.tell(second, page_command(5, kUndo));
  table.tell(second, page_tool(6, kScalpel, kDown, {ray_between(kEye, {0, 0, 0})}));
  ASSERT_EQ(table.pages[second].errors.size(), 2u);
  EXPECT_EQ(table.pages[second].errors[1].code, 3u);
  EXPECT_EQ(table.pages[second].errors[1].input, 6u);
  table.tell(second, page_command(7, kOverlay, {1}));  // watching is free
  EXPECT_EQ(table.pages[second].overlays, 1u);
  EXPECT_EQ(table.pages[first].overlays, 0u);

  // A stroke that is under way is taken back when the tools pass on.
  const std::uint64_t whole = body_hash(table.engine.session().body());
  table.tell(first, page_tool(8, kScalpel, kDown, {ray_between(kEye, {-0.13, 0, 0})}));
  table.tell(first, page_tool(9, kScalpel, kMove, {ray_between(kEye, {0.02, 0, 0})}));
  EXPECT_NE(body_hash(table.engine.session().body()), whole);
  table.tell(second, page_claim(true));
  EXPECT_TRUE(table.pages[second].held);
  EXPECT_FALSE(table.pages[first].held);
  EXPECT_EQ(body_hash(table.engine.session().body()), whole);
  table.tick();
  table.expect_mirrored(first);
  table.expect_mirrored(second);

  table.cut(second, {{-0.005, -0.13, 0}, {-0.005, 0.13, 0}});
  EXPECT_EQ(table.pages[first].cuts.size(), 1u);  // everybody sees it
  table.expect_mirrored(first);
  table.tell(second, page_tool(10, kScalpel, kDown, {ray_between(kEye, {-0.13, 0.03, 0})}));
  table.tell(second, page_tool(11, kScalpel, kMove, {ray_between(kEye, {0.02, 0.03, 0})}));
  // That of a page that is gone ends where it is.
  const std::uint64_t drawn = body_hash(table.engine.session().body());
  table.engine.disconnect(second);
  table.deliver();
  EXPECT_TRUE(table.pages[first].held);
  EXPECT_FALSE(table.engine.session().in_stroke());
  EXPECT_EQ(table.engine.session().undo_depth(), 2);
  EXPECT_EQ(body_hash(table.engine.session().body()), drawn);
  table.expect_mirrored(first);
  table.tell(first, page_claim(false));
  EXPECT_EQ(table.engine.holder(), 0u);
}

TEST(Engine, APageThatComesBackGetsWhatItMissed) {
  EngineOptions options;
  options.session_id = 42;
  Table table(options);
  const auto page = table.join();
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.0, 0}});
  MirroredPage kept = table.pages[page];
  table.engine.disconnect(page);
  table.pages.erase(page);
  const auto other = table.join();
  table.cut(other, {{0.04, -0.13, 0}, {0.04, 0.13, 0}});
  table.tell(other, page_command(1, kUndo));
  // Back again, with what it knew.
  const std::uint32_t id = table.engine.connect();
  table.pages[id] = kept;
  table.pages[id].last_seq = 0;
  const std::uint32_t bodies = kept.bodies, patches = kept.patches;
  table.tell(id, page_hello(42, kept.body.body, kept.body.version));
  table.tick();
  EXPECT_EQ(table.pages[id].bodies, bodies);
  EXPECT_GT(table.pages[id].patches, patches);
  table.expect_mirrored(id);
  // Another session, or a version that is not in the history: everything.
  EXPECT_EQ(table.pages[table.join(41, 1, 1)].bodies, 1u);
  EXPECT_EQ(table.pages[table.join(42, 1, 9999)].bodies, 1u);
  EXPECT_EQ(table.pages[table.join(42, 2, 1)].bodies, 1u);
}

TEST(Engine, PatchHistoryIsBounded) {
  EngineOptions options;
  options.session_id = 42;
  options.patch_history = 20'000;
  Table table(options);
  const auto page = table.join();
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.13, 0}});
  const auto late = table.join(42, 1, 1);
  EXPECT_EQ(table.pages[late].bodies, 1u);  // too old: everything
  table.expect_mirrored(late);
}

TEST(Engine, SlowPagesLoseFramesOnly) {
  Table table;
  const std::uint32_t slow = table.engine.connect();
  table.engine.receive(slow, page_hello());
  MirroredPage page;
  const auto carry = [&] {
    while (const auto m = table.engine.next(slow)) page.hear(*m);
  };
  carry();
  for (int i = 0; i < 50; ++i) {
    table.engine.tick(1.0 / 60);
    carry();
  }
  EXPECT_EQ(page.frames, 2u);  // never more than two that it has not drawn
  EXPECT_GT(page.dropped, 30u);
  table.engine.receive(slow, page_ack(page.last_seq));
  table.engine.tick(1.0 / 60);
  carry();
  EXPECT_EQ(page.frames, 3u + 0u) << "the newest one, at once";
  EXPECT_NEAR(page.time, 51.0 / 60, 0.02);
}

TEST(Engine, APageThatReadsNothingIsGivenUp) {
  EngineOptions options;
  options.most_unread = 600'000;
  Table table(options);
  const std::uint32_t dead = table.engine.connect();
  table.engine.receive(dead, page_hello());
  EXPECT_FALSE(table.engine.gives_up(dead));
  for (int i = 0; i < 3; ++i) table.engine.receive(dead, page_command(1, kReset));
  EXPECT_TRUE(table.engine.gives_up(dead));
}

// However often pages ask, they have one body to read, and it goes with the last of them.
TEST(Engine, PagesThatDoNotReadHaveOneBodyToRead) {
  Table table;
  const std::uint32_t a = table.engine.connect(), b = table.engine.connect();
  table.engine.receive(a, page_hello());
  const std::size_t one = table.engine.unread();
  for (int i = 0; i < 20; ++i) {
    table.engine.receive(a, page_hello());
    table.engine.receive(b, page_hello());
    table.engine.receive(b, page_command(1, kOverlay, {1}));
    table.engine.tick(1.0 / 60);
  }
  EXPECT_LT(table.engine.unread(), 3 * one) << "a body, an overlay, 41 greetings";
  std::set<const void*> large;
  std::size_t times = 0;
  for (const std::uint32_t page : {a, b})
    while (const protocol::Message m = table.engine.next(page))
      if (m->size() > one / 2) large.insert(m.get()), ++times;
  EXPECT_EQ(times, 41u);
  EXPECT_EQ(large.size(), 1u);
  // What comes after a cut is another one.
  table.engine.receive(a, page_hello());
  table.engine.receive(a, page_command(1, kReset));
  table.engine.receive(a, page_hello());
  for (large.clear(); const protocol::Message m = table.engine.next(a);)
    if (m->size() > one / 2) large.insert(m.get());
  EXPECT_EQ(large.size(), 2u);
  table.engine.receive(a, page_hello());
  table.engine.disconnect(a);
  table.engine.disconnect(b);
  EXPECT_LT(table.engine.unread(), one / 2) << "nobody has anything to read";
}

TEST(Engine, APageIsListenedToAgainOnceItHasRead) {
  EngineOptions options;
  options.most_answers = 4000;
  Table table(options);
  const std::uint32_t slow = table.engine.connect(), quick = table.join();
  EXPECT_FALSE(table.engine.holds_back(slow));
  table.engine.receive(slow, page_hello());
  EXPECT_TRUE(table.engine.holds_back(slow));
  EXPECT_FALSE(table.engine.holds_back(quick));
  while (table.engine.next(slow)) {}
  EXPECT_FALSE(table.engine.holds_back(slow));
  EXPECT_FALSE(table.engine.holds_back(999));
}

TEST(Engine, AllPagesTogetherHaveOnlySoMuchToRead) {
  EngineOptions options;
  options.most_together = 4000;
  Table table(options);
  const std::uint32_t slow = table.engine.connect(), other = table.engine.connect(), quick = table.join();
  table.engine.receive(slow, page_hello());
  EXPECT_TRUE(table.engine.holds_back(slow));
  EXPECT_FALSE(table.engine.holds_back(other)) << "it has been asked nothing and owes nothing";
  table.tell(quick, page_command(5, kExport, {}, "obj"));
  ASSERT_EQ(table.pages[quick].errors.size(), 1u);
  EXPECT_NE(table.pages[quick].errors[0].text.find("still on their way"), std::string::npos);
  while (table.engine.next(slow)) {}
  EXPECT_FALSE(table.engine.holds_back(slow));
  table.tell(quick, page_command(6, kExport, {}, "obj"));
  EXPECT_EQ(table.pages[quick].errors.size(), 1u);
}

// Exports take time of all: each page has one at a time, and pages take turns.
TEST(Engine, OneExportIsMadeInATickAndOneIsPendingForAPage) {
  Table table;
  const std::uint32_t many = table.join(), one = table.join();
  table.tell(many, page_command(1, kPause));
  for (std::uint32_t i = 0; i < 20; ++i) table.tell(many, page_command(5 + i, kExport, {}, "obj"));
  table.tell(one, page_command(50, kExport, {}, "vtu"));
  EXPECT_TRUE(table.pages[many].files.empty()) << "a message waits for no export";
  ASSERT_EQ(table.pages[many].errors.size(), 19u);
  EXPECT_NE(table.pages[many].errors[0].text.find("ask again when its files have come"), std::string::npos);
  table.tick();
  EXPECT_EQ(table.pages[many].files.size(), 2u);
  EXPECT_TRUE(table.pages[one].files.empty());
  // The other one is next, however soon the first asks again.
  table.tell(many, page_command(60, kExport, {}, "obj"));
  EXPECT_EQ(table.pages[many].errors.size(), 19u);
  table.pages[many].files.clear();
  for (int i = 0; i < 6000 && table.pages[one].files.empty(); ++i) table.tick();
  EXPECT_EQ(table.pages[one].files.size(), 1u);
  EXPECT_TRUE(table.pages[many].files.empty());
  for (int i = 0; i < 6000 && table.pages[many].files.empty(); ++i) table.tick();
  EXPECT_EQ(table.pages[many].files.size(), 2u);
  // A page that leaves takes its wish along.
  table.tell(one, page_command(70, kExport, {}, "vtu"));
  table.engine.disconnect(one);
  table.tick(10);
}

// What one page does is told to all: many small messages, of many pages that read none, come to an end, too.
TEST(Engine, OfPagesThatDoNotReadTheOneWithMostIsGivenUp) {
  constexpr std::size_t kRoom = 100'000;
  EngineOptions options;
  {
    Table table;
    for (const std::uint32_t page : {table.engine.connect(), table.engine.connect()})
      table.engine.receive(page, page_hello());
    options.most_unread_together = table.engine.unread() + kRoom;
  }
  Table table(options);
  const std::uint32_t quick = table.join(), silent = table.engine.connect(), worse = table.engine.connect();
  for (const std::uint32_t page : {silent, worse, worse}) table.engine.receive(page, page_hello());
  int times = 0;
  for (; times < 5000 && !table.engine.overflows(worse); ++times) {
    ASSERT_FALSE(table.engine.overflows(silent));
    table.tell(quick, page_claim(times % 2 == 1));
  }
  EXPECT_GT(times, 100);
  EXPECT_LT(times, 1000)
      << "two messages of about 150 bytes each time: counted without what they take beside their own 24, they were 2000";
  EXPECT_TRUE(table.engine.gives_up(worse));
  EXPECT_FALSE(table.engine.gives_up(silent));
  EXPECT_FALSE(table.engine.gives_up(quick));
  table.engine.disconnect(worse);
  EXPECT_FALSE(table.engine.overflows(silent)) << "there is room again";
}

TEST(Engine, BadMessagesAreAnsweredAndCounted) {
  Table table;
  const auto page = table.join();
  const auto good = table.join();
  for (int i = 0; i < 99; ++i) table.tell(page, {std::byte{1}, std::byte{2}});
  EXPECT_FALSE(table.engine.gives_up(page));
  EXPECT_EQ(table.pages[page].errors.size(), 99u);
  EXPECT_EQ(table.pages[page].errors[0].code, 1u);
  std::vector<std::byte> tool = page_tool(77, 0, 0, {ray_between(kEye, {0, 0, 0})});
  tool[12] = std::byte{99};  // no such tool
  table.tell(page, tool);
  EXPECT_EQ(table.pages[page].errors.back().input, 77u);
  EXPECT_TRUE(table.engine.gives_up(page));
  EXPECT_FALSE(table.engine.gives_up(good));
  // Before its Hello a page says nothing else.
  const std::uint32_t rude = table.engine.connect();
  table.pages[rude];
  table.tell(rude, page_command(1, kReset));
  EXPECT_EQ(table.pages[rude].errors.at(0).code, 1u);
  EXPECT_EQ(table.engine.body(), 1u);
  table.engine.receive(999, page_hello());  // nobody
  table.engine.disconnect(999);
}

TEST(Engine, OddToolMessagesDoNoHarm) {
  Table table;
  const auto page = table.join();
  Random random(3);
  for (int i = 0; i < 600; ++i) {
    const auto tool = static_cast<std::uint32_t>(random.index(11)), phase = static_cast<std::uint32_t>(random.index(4));
    std::vector<PageRay> rays;
    const int n = phase == 0 ? 1 + random.index(3) : random.index(3);
    for (int k = 0; k < n; ++k) {
      const auto any = [&](double r) {
        return Point{random.uniform(-r, r), random.uniform(-r, r), random.uniform(-r, r)};
      };
      // Eyes far away, inside the body, and rays that miss.
      PageRay ray = ray_between(any(random.index(4) == 0 ? 0.02 : random.index(8) == 0 ? 9e5 : 0.5), any(0.1));
      rays.push_back(ray);
    }
    table.tell(page,
               page_tool(static_cast<std::uint32_t>(i), tool, phase, rays, static_cast<std::uint32_t>(random.index(16)),
                         random.index(3) == 0 ? 0 : static_cast<float>(std::pow(10.0, random.uniform(-4, 1)))));
    if (random.index(20) == 0) table.tell(page, page_command(1, random.index(2) == 0 ? kUndo : kRedo));
    if (random.index(4) == 0) table.tick();
  }
  table.tick();
  table.expect_mirrored(page);
  for (const Vec3 x : table.engine.session().node_positions()) ASSERT_TRUE(is_finite(x));
}

TEST(Engine, ResetScenesAndExport) {
  const std::string folder = testing::TempDir();
  std::ofstream(folder + "/sheet_for_engine.toml") << "title = \"A sheet\"\n[body]\nmodel = \"sheet\"\n";
  std::ofstream(folder + "/broken_for_engine.toml") << "[body]\nmodel = \"shet\"\n";
  EngineOptions options;
  options.scenes = {{"sheet", "A sheet", folder + "/sheet_for_engine.toml"},
                    {"broken", "Broken", folder + "/broken_for_engine.toml"}};
  Table table(options);
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  const std::uint64_t start = table.engine.session().hash();
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.13, 0}});
  table.tell(page, page_command(1, kGravity, {0, 0, 3}));
  table.tell(page, page_command(2, kReset));
  EXPECT_EQ(table.engine.session().hash(), start);
  EXPECT_EQ(table.engine.session().gravity().z, -1);
  EXPECT_EQ(p.body.body, 2u);
  table.expect_mirrored(page);
  table.load(page, page_command(3, kScene, {}, "broken"));
  ASSERT_EQ(p.errors.size(), 1u);
  EXPECT_NE(p.errors[0].text.find("sheet"), std::string::npos);  // did you mean
  EXPECT_EQ(p.name, "steak");
  table.load(page, page_command(4, kScene, {}, "../../etc/passwd"));
  EXPECT_EQ(p.errors.size(), 2u);
  table.load(page, page_command(5, kScene, {}, "sheet"));
  EXPECT_EQ(p.name, "sheet");
  EXPECT_NE(p.json.find("\"A sheet\""), std::string::npos);
  table.tick(2);
  table.expect_mirrored(page);
  for (const char* kind : {"obj", "vtu", "scene"}) {
    table.tell(page, page_command(6, kExport, {}, kind));
    table.tick(600);
  }
  EXPECT_EQ(p.files.count("sheet_visual.obj"), 1u);
  EXPECT_EQ(p.files.count("sheet_collision.obj"), 1u);
  EXPECT_NE(p.files["sheet_hexahedra.vtu"].find("VTKFile"), std::string::npos);
  EXPECT_NE(p.files["sheet.toml"].find("model = \"sheet\""), std::string::npos);
  table.tell(page, page_command(7, kExport, {}, "exe"));
  EXPECT_EQ(p.errors.size(), 3u);
}

// Shown, a scene does to the bit what it does when it is run; else its commands wait.
TEST(Engine, AScenesOwnCommandsAreShownOnRequest) {
  const std::string text =
      "title = \"Halves\"\n[body]\nmodel = \"sheet\"\n[simulation]\ntime_step = 0.005\n"
      "[[fix]]\nhalf_space = { point = [0, 0.4, 0], normal = [0, 1, 0] }\n"
      "[[command]]\nat = 0.02\ntype = \"blade\"\nframe = \"rest\"\nposes = ["
      "{ time = 0, base = [0.1, -0.6, 0.1], tip = [0.1, -0.6, -0.1] }, "
      "{ time = 0.1, base = [0.1, 0.1, 0.1], tip = [0.1, 0.1, -0.1] } ]\n"
      "[[command]]\nat = 0.2\ntype = \"grasp\"\nid = \"g\"\npoint = [0.3, -0.4, 0]\nradius = 0.05\n"
      "[[command]]\nat = 0.2\ntype = \"move\"\nid = \"g\"\nby = [0.1, 0, 0]\nover = 0.1\n";
  const std::string file = (std::filesystem::temp_directory_path() / "shown_for_engine.toml").string();
  std::ofstream(file) << text;
  EngineOptions options;
  options.scenes = {{"shown", "Halves", file}};
  Table table(options);
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  table.load(page, page_command(1, kScene, {}, "shown"));
  EXPECT_NE(p.json.find("\"script\":{\"ends\":0.3"), std::string::npos) << p.json;
  EXPECT_NE(p.json.find("\"runs\":false"), std::string::npos);
  EXPECT_NE(p.json.find("\"hands\":[{\"tool\":\"scalpel\",\"places\":[[0.02,0.1,-0.6,0,0,0,1],[0.12,"),
            std::string::npos)
      << p.json;
  while (table.engine.session().time() < 0.4) table.tick();
  EXPECT_TRUE(table.engine.session().strokes().empty());
  table.load(page, page_command(2, kScene, {1}, "shown"));
  EXPECT_NE(p.json.find("\"runs\":true"), std::string::npos);
  while (table.engine.session().time() < 0.4) table.tick();
  for (const auto& e : p.errors) ADD_FAILURE() << e.text;
  ASSERT_EQ(table.engine.session().strokes().size(), 1u);
  table.expect_mirrored(page);
  ASSERT_EQ(p.cuts.size(), 1u) << "the page learns what it took";
  EXPECT_EQ(p.cuts[0].input, 0u);
  EXPECT_EQ(p.cuts[0].outcome, 0u);
  EXPECT_EQ(p.cuts[0].triangles, static_cast<std::uint32_t>(table.engine.session().strokes()[0].triangles));
  EXPECT_GT(p.cuts[0].total_ms, 0);

  auto scene = parse_scene(text, "shown");
  ASSERT_TRUE(scene.ok());
  auto run = Session::create(*scene);
  ASSERT_TRUE(run.ok());
  while (run->time() < table.engine.session().time()) ASSERT_TRUE(run->step().ok());
  EXPECT_EQ(run->hash(), table.engine.session().hash());
  const auto again = replay(table.engine.recording());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_LT(again->first_difference, 0);

  table.load(page, page_command(3, kScene, {0}, "shown"));
  EXPECT_NE(p.json.find("\"runs\":false"), std::string::npos);
  table.load(page, page_command(4, kScene, {2}, "shown"));
  EXPECT_EQ(p.errors.size(), 1u);
}

// --scripted runs the scene that the program begins with; to start it again without its commands is a page's choice.
TEST(Engine, AScriptedSceneIsHandedOver) {
  EngineOptions options;
  options.overrides.scripted = true;
  options.scenes = {{"strips", "Strips", source_dir() + "/scenes/crossing-strips.toml"}};
  Table table(options);
  const auto page = table.join();
  table.load(page, page_command(1, kScene, {0}, "strips"));
  EXPECT_NE(table.pages[page].json.find("\"runs\":false"), std::string::npos);
  table.load(page, page_command(2, kScene, {1}, "strips"));
  EXPECT_NE(table.pages[page].json.find("\"runs\":true"), std::string::npos);
}

// The second begins in the very step that ends the first.
TEST(Engine, EachOfTheScenesOwnStrokesIsTold) {
  SceneSource source = steak();
  for (const double x : {-0.05, 0.05})
    source.text += fmt::format(
        "[[command]]\nat = {}\ntype = \"blade\"\nframe = \"rest\"\nposes = [\n"
        "  {{ time = 0.0, base = [{}, -0.09, 0.05], tip = [{}, -0.09, -0.05] }},\n"
        "  {{ time = 0.1, base = [{}, 0.09, 0.05], tip = [{}, 0.09, -0.05] }},\n]\n",
        x < 0 ? 0.01 : 0.11, x, x, x, x);
  EngineOptions options;
  options.overrides.scripted = true;
  Table table(options, source);
  const auto page = table.join();
  while (table.engine.session().time() < 0.3) table.tick();
  ASSERT_EQ(table.engine.session().strokes().size(), 2u);
  ASSERT_EQ(table.pages[page].cuts.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_EQ(table.pages[page].cuts[k].triangles,
              static_cast<std::uint32_t>(table.engine.session().strokes()[k].triangles));
}

TEST(Engine, ObstaclesAndToolsAreShownAndLed) {
  SceneSource source;
  source.name = "board";
  source.text =
      "[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.005\n"
      "[[obstacle]]\nshape = \"box\"\nname = \"board\"\nsize = [0.4, 0.4, 0.02]\nposition = [0, 0, -0.0215]\n"
      "[[tool]]\nid = \"ball\"\nkind = \"sphere\"\nradius = 0.01\nposition = [0.01, 0, 0.05]\n"
      "[[tool]]\nid = \"grip\"\nkind = \"grasper\"\nposition = [0, 0, 0.2]\n";
  Table table({}, source);
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  EXPECT_NE(p.things.find("\"name\":\"board\""), std::string::npos) << p.things;
  EXPECT_NE(p.things.find("\"shape\":\"grasper\""), std::string::npos);
  EXPECT_EQ(p.thing_triangles.size() > 100, true);
  Box3 board;
  for (std::size_t i = 0; i < 8; ++i)
    board.add({p.thing_positions[i][0], p.thing_positions[i][1], p.thing_positions[i][2]});
  EXPECT_NEAR(board.size().x, 0.4, 1e-6);
  EXPECT_NEAR(board.size().z, 0.02, 1e-6);
  table.tick(60);
  ASSERT_EQ(p.places.size(), 3u);
  ASSERT_EQ(p.tools.size(), 2u);
  EXPECT_NEAR(p.places[0][2], -0.0215, 1e-7);
  EXPECT_NEAR(p.places[1][0], 0.01, 1e-3);
  EXPECT_EQ(p.places[2][7], 1);  // jaws open
  // The steak lies on the board: its weight is carried; nobody has asked for the points.
  EXPECT_GT(p.touching, 5u);
  EXPECT_TRUE(p.contacts.empty());
  table.tell(page, page_command(1, kContacts, {1}));
  table.tick();
  ASSERT_GT(p.contacts.size(), 5u);
  double sum = 0;
  for (std::size_t i = 0; i < p.contacts.size(); ++i) {
    EXPECT_EQ(p.partners[i] & 15u, 0u);  // with the board
    EXPECT_NEAR(p.contacts[i][5], 1, 0.2);
    sum += p.contacts[i][8];
  }
  EXPECT_GT(sum, 0);
  const double resting = p.press;
  // A ball that is pressed down feels it, as the board does.
  for (int k = 0; k <= 40; ++k) {
    table.tell(page, page_device(2, 0, {0.01, 0, 0.05 - 0.0009 * k}, {}, 1));
    table.tick();
  }
  for (const auto& e : p.errors) ADD_FAILURE() << e.text;
  EXPECT_NEAR(p.tools[0][2], 0.014, 1e-3);   // where it is led
  EXPECT_GT(p.places[1][2], p.tools[0][2]);  // it is held up
  EXPECT_GT(p.tools[0][9], 0.05f);           // N, upwards
  EXPECT_GT(p.press, resting);
  EXPECT_TRUE(std::any_of(p.partners.begin(), p.partners.end(), [](std::uint32_t with) { return (with & 15u) == 1; }));
  // Jaws close.
  table.tell(page, page_device(3, 1, {0, 0, 0.2}, {0, 0.5, 0}, 0));
  table.tick(30);
  EXPECT_NEAR(p.places[2][7], 0, 1e-6);
  EXPECT_NEAR(2 * std::atan2(p.places[2][4], p.places[2][6]), 0.5, 0.05);
  table.tell(page, page_device(4, 7, {0, 0, 0.2}, {}, 1));
  ASSERT_EQ(p.errors.size(), 1u);
  // All of it can be repeated.
  auto again = replay(table.engine.recording());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->first_difference, -1);
}

TEST(Engine, WhatIsTooLongToBeRecordedIsSaid) {
  EngineOptions options;
  options.most_recorded = 20'000;
  Table table(options);
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  table.tell(page, page_command(1, kRecording, {1}));
  for (int i = 0; i < 300; ++i) table.tell(page, page_command(2, kGravity, {0, 0, -1.0 - 0.001 * i}));
  table.tell(page, page_command(3, kRecording, {0}));
  ASSERT_EQ(p.errors.size(), 1u);
  EXPECT_TRUE(p.files.empty());
  EXPECT_TRUE(table.engine.recording().changes.empty());
  table.tell(page, page_command(4, kReset));
  table.tell(page, page_command(5, kRecording, {1}));
  table.tell(page, page_command(6, kGravity, {0, 0, -2}));
  table.tell(page, page_command(7, kRecording, {0}));
  EXPECT_EQ(p.files.size(), 1u);
}

TEST(Engine, AnotherSceneIsLoadedInTheBackground) {
  const std::string folder = testing::TempDir();
  std::ofstream(folder + "/large_for_engine.toml")
      << "[body]\nmodel = \"closed-sheet\"\noptions = { visual_triangles = 400000, collision_triangles = 500 }\n";
  std::ofstream(folder + "/small_for_engine.toml") << "[body]\nmodel = \"meniscus\"\n";
  EngineOptions options;
  options.scenes = {{"large", "", folder + "/large_for_engine.toml"}, {"small", "", folder + "/small_for_engine.toml"}};
  Table table(options);
  const auto page = table.join(), watcher = table.join();
  MirroredPage& p = table.pages[page];
  table.tell(page, page_command(5, kScene, {}, "large"));
  ASSERT_TRUE(table.engine.loading());
  // The old scene goes on, and can be cut.
  EXPECT_EQ(p.name, "steak");
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.13, 0}});
  EXPECT_EQ(p.cuts.size(), 1u);
  EXPECT_EQ(p.name, "steak");
  // Stopped, it stays.
  table.tell(page, page_command(6, kStopLoading));
  EXPECT_FALSE(table.engine.loading());
  EXPECT_EQ(p.loadings.back().state, 3u);
  table.tick(5);
  EXPECT_EQ(p.name, "steak");
  EXPECT_EQ(p.bodies, 1u);
  // The newest wish counts; everybody hears of it.
  table.tell(page, page_command(7, kScene, {}, "large"));
  table.tell(page, page_command(8, kScene, {}, "small"));
  table.until_loaded();
  for (const auto id : {page, watcher}) {
    EXPECT_EQ(table.pages[id].name, "small");
    EXPECT_EQ(table.pages[id].bodies, 2u);
    EXPECT_EQ(table.pages[id].loadings.back().state, 1u);
    EXPECT_EQ(table.pages[id].loadings.back().input, 8u);
  }
  EXPECT_TRUE(p.errors.empty());
  table.tick(2);
  table.expect_mirrored(page);
  // It can end while it loads.
  table.tell(page, page_command(9, kScene, {}, "large"));
}

/// A square sheet as OBJ text: an open surface of n x n squares of side 1/n at height z.
std::string square(int n, double z) {
  std::string out;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      out +=
          "v " + std::to_string(double(i) / n) + " " + std::to_string(double(j) / n) + " " + std::to_string(z) + "\n";
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i + 1, b = a + 1, c = a + n + 1, d = c + 1;
      out += "f " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(d) + "\n";
      out += "f " + std::to_string(a) + " " + std::to_string(d) + " " + std::to_string(c) + "\n";
    }
  return out;
}

// Names of files have up to 255 bytes in any script; that of the scene ends with a whole character.
TEST(Engine, UploadedMeshesMayHaveLongNamesInAnyScript) {
  Table table;
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  const std::string visual = square(12, 0);
  std::uint32_t number = 0;
  for (const std::string letter : {"\xe5\x8d\x8a", "\xd0\xb6", "\xf0\x9f\xa5\xa9", "x\x7f"})
    for (const char* before : {"", "a", "ab", "abc"}) {
      std::string name = before;
      while (name.size() + letter.size() + 4 <= 255) name += letter;
      table.tell(page, page_upload(++number, 0, name + ".obj", 0, static_cast<std::uint32_t>(visual.size()), visual));
      table.load(page, page_command(number, kLoadUpload, {static_cast<double>(number)}, "0.05"));
      for (const auto& e : p.errors) ADD_FAILURE() << name << ": " << e.text;
      p.errors.clear();
      EXPECT_LE(p.name.size(), 80u);
      EXPECT_GT(p.name.size(), 76u);
      EXPECT_TRUE(letter[0] == 'x' || name.starts_with(p.name)) << p.name;
    }
}

TEST(Engine, UploadedMeshesAreLoaded) {
  Table table;
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  const std::string visual = square(12, 0), collision = square(4, 0);
  const auto upload = [&](std::uint32_t number, std::uint32_t part, const std::string& name, const std::string& bytes) {
    for (std::size_t at = 0; at == 0 || at < bytes.size(); at += 1000)
      table.tell(page, page_upload(number, part, name, static_cast<std::uint32_t>(at),
                                   static_cast<std::uint32_t>(bytes.size()), bytes.substr(at, 1000)));
  };
  upload(1, 0, "cloth.obj", visual);
  table.load(page, page_command(1, kLoadUpload, {1}, "0.05"));
  upload(2, 0, "my \"cloth\".OBJ", visual);
  upload(2, 1, "mid.obj", collision);
  table.load(page, page_command(2, kLoadUpload, {2}, "0.05"));
  for (const auto& e : p.errors) ADD_FAILURE() << e.text;
  EXPECT_EQ(p.name, "my _cloth_");
  table.tick(3);
  table.expect_mirrored(page);
  EXPECT_EQ(p.body.skin.size(), 288u);
  EXPECT_NE(p.json.find("\"unit\":{\"metres\":1.0,\"guessed\":true}"), std::string::npos) << p.json;
  EXPECT_EQ(table.engine.session().gravity(), (Vec3{0, 0, -9.81}));
  const double thickness = p.body.frames[0][15];
  // In millimetres, when it is told so, or when it would be larger than 5 m.
  table.load(page, page_command(21, kUnit, {1e-3}));
  EXPECT_NE(p.json.find("\"unit\":{\"metres\":0.001,\"guessed\":false}"), std::string::npos) << p.json;
  EXPECT_NEAR(p.body.frames[0][15], 1e-3 * thickness, 1e-9);
  table.load(page, page_command(22, kUnit, {0}));
  ASSERT_EQ(p.errors.size(), 1u);
  p.errors.clear();
  std::string large;
  for (int i = 0; i < 4; ++i)
    large += "v " + std::to_string(45 * (i % 2)) + " " + std::to_string(20 * (i / 2)) + " 0\n";
  upload(14, 0, "large.obj", large + "f 1 2 4\nf 1 4 3\n");
  table.load(page, page_command(23, kLoadUpload, {14}, "2"));
  for (const auto& e : p.errors) ADD_FAILURE() << e.text;
  EXPECT_NE(p.json.find("\"unit\":{\"metres\":0.001,\"guessed\":true}"), std::string::npos) << p.json;
  EXPECT_NE(p.json.find("\"box\":[0.0,0.0,0.0,0.045,0.02,0.0]"), std::string::npos) << p.json;

  // What can't be loaded leaves everything as it is.
  const std::uint32_t body = table.engine.body();
  table.load(page, page_command(3, kLoadUpload, {7}));
  upload(8, 0, "x.exe", "MZ");
  table.load(page, page_command(4, kLoadUpload, {8}));
  upload(9, 0, "x.obj", "v 0 0");
  table.load(page, page_command(5, kLoadUpload, {9}, "0.1"));
  upload(10, 0, "x.obj", visual);
  table.load(page, page_command(6, kLoadUpload, {10}, "-3"));
  upload(11, 2, "s.toml", "[body]\nvisual = \"/etc/hostname\"\ncollision = \"/etc/hostname\"\n");
  table.load(page, page_command(7, kLoadUpload, {11}));
  table.tell(page, page_upload(12, 0, "x.obj", 100, 2000, "v 0 0 0"));  // no beginning
  EXPECT_EQ(p.errors.size(), 6u);
  // Messages name what was opened, not where it lies for the moment.
  EXPECT_TRUE(p.errors[2].text.starts_with("x.obj")) << p.errors[2].text;
  for (const auto& e : p.errors) EXPECT_EQ(e.text.find("/tmp"), std::string::npos) << e.text;
  EXPECT_NE(p.json.find("\"opened\":true"), std::string::npos);
  EXPECT_EQ(table.engine.body(), body);
  upload(13, 2, "s.toml", "[body]\nmodel = \"meniscus\"\n");
  table.load(page, page_command(8, kLoadUpload, {13}));
  EXPECT_EQ(p.errors.size(), 6u) << p.errors.back().text;
  EXPECT_EQ(p.name, "s");
}

// A few bytes could take all memory of the server's machine.
TEST(Engine, AnUploadedSceneWithTooLargeALatticeIsRefused) {
  Table table;
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  const std::string scene = "[body]\nmodel = \"strip\"\n[lattice]\ncells = [400, 400, 400]\n";
  table.tell(page, page_upload(1, 2, "large.toml", 0, static_cast<std::uint32_t>(scene.size()), scene));
  const MemoryLimit limit(std::uint64_t{1} << 30);
  const std::uint32_t body = table.engine.body();
  table.load(page, page_command(1, kLoadUpload, {1}));
  ASSERT_EQ(p.errors.size(), 1u);
  EXPECT_NE(p.errors[0].text.find("64000000"), std::string::npos) << p.errors[0].text;
  EXPECT_EQ(table.engine.body(), body);
}

// A page has fields and a dialog, no command line.
TEST(Engine, WhyMeshesCanNotBeOpenedIsSaidInThePagesWords) {
  Table table;
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  std::uint32_t number = 0;
  const auto open = [&](const std::string& mesh, const std::string& thickness) {
    table.tell(page, page_upload(++number, 0, "own.obj", 0, static_cast<std::uint32_t>(mesh.size()), mesh));
    table.load(page, page_command(number, kLoadUpload, {static_cast<double>(number)}, thickness));
    const std::string why = p.errors.empty() ? "" : p.errors[0].text;
    p.errors.clear();
    for (const char* word : {"--", "[body]", "kerf ", "visual.obj"})
      EXPECT_EQ(why.find(word), std::string::npos) << why;
    return why;
  };
  const std::string cube =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
      "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  EXPECT_NE(open(cube, "").find("its collision mesh"), std::string::npos);
  EXPECT_NE(open(square(12, 0), "").find("Thickness"), std::string::npos);
  for (const char* thickness : {"%", "2 %", "-2%", "0%", "2%%", "1e12%", "nan%"})
    EXPECT_NE(open(square(12, 0), thickness).find("a positive number"), std::string::npos) << thickness;
  for (const Advice& way : kWaysOut)
    for (const char* word : {"--", "[body]", "kerf "}) EXPECT_EQ(way.page.find(word), std::string::npos) << way.page;
  // A share of the size: the square's side is 1, its diagonal 1.414.
  EXPECT_EQ(open(square(12, 0), "2%"), "");
  const double by_share = p.body.frames[0][15];
  EXPECT_EQ(open(square(12, 0), "0.028284271247461901"), "");
  EXPECT_NEAR(p.body.frames[0][15], by_share, 1e-12);
}

// Whether there is a file on this machine, what it is and where the server works are nobody's business.
TEST(Engine, AnUploadedSceneLearnsNothingOfTheMachine) {
  Table table;
  const auto page = table.join();
  std::set<std::string> answers;
  std::uint32_t number = 0;
  for (const char* path : {"/etc/passwd", "/etc", "/nonexistent", "x.obj", "../x.obj", "../../etc/passwd", ".",
                           "/dev/null", "/proc/self/mem"})
    for (const std::string& scene :
         {"[body]\nvisual = \"" + std::string(path) + "\"\n", "[body]\nbound = \"" + std::string(path) + "\"\n",
          "[body]\nmodel = \"sheet\"\ncollision = \"" + std::string(path) + "\"\n",
          "[body]\nmodel = \"sheet\"\n[[obstacle]]\nshape = \"mesh\"\nmesh = \"" + std::string(path) + "\"\n",
          "[body]\nmodel = \"sheet\"\n[[tool]]\nid = \"t\"\nkind = \"mesh\"\nmesh = \"" + std::string(path) + "\"\n"}) {
      table.tell(page, page_upload(++number, 2, "s.toml", 0, static_cast<std::uint32_t>(scene.size()), scene));
      const std::size_t before = table.pages[page].errors.size();
      table.load(page, page_command(number, kLoadUpload, {static_cast<double>(number)}));
      ASSERT_GT(table.pages[page].errors.size(), before) << scene;
      const std::string& text = table.pages[page].errors.back().text;
      EXPECT_NE(text.find("can't name files"), std::string::npos) << text;
      EXPECT_EQ(text.find("looked for"), std::string::npos) << text;
      answers.insert(text);
    }
  EXPECT_EQ(answers.size(), 5u) << "one for each key, whatever the path";
}

// An instrument dropped as a body: a rod with a hook, of long slivers. It is told why it can't be cut, and what was shown stays.
TEST(Engine, AnInstrumentDroppedAsABodyIsRefused) {
  const std::filesystem::path file = std::filesystem::path(test::source_dir()) / "../shared/meshes/hook-probe.obj";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no ../shared/meshes beside the source";
  Table table;
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  const auto bytes = read_whole_file(file.string(), kOtherFile);
  ASSERT_TRUE(bytes.ok());
  const std::string text(bytes->view());
  for (std::size_t at = 0; at < text.size(); at += 100000)
    table.tell(page, page_upload(1, 0, "hook.obj", static_cast<std::uint32_t>(at),
                                 static_cast<std::uint32_t>(text.size()), text.substr(at, 100000)));
  const std::uint32_t body = table.engine.body();
  table.load(page, page_command(1, kLoadUpload, {1}));
  ASSERT_EQ(p.errors.size(), 1u);
  for (const char* said : {"hook.obj: no collision mesh could be made: ", "the body branches"})
    EXPECT_NE(p.errors[0].text.find(said), std::string::npos) << p.errors[0].text;
  EXPECT_EQ(table.engine.body(), body);
}

TEST(Engine, WhatWasRecordedReplaysToTheBit) {
  Table table;
  const auto page = table.join();
  MirroredPage& p = table.pages[page];
  table.tell(page, page_command(1, kRecording, {1}));
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.05, 0}, {0.04, 0.05, 0}});
  table.tell(page, page_command(2, kUndo));
  table.cut(page, {{0.01, -0.13, 0}, {-0.02, 0.13, 0}});
  table.tell(page, page_tool(4, kGrasp, kDown, {ray_between(kEye, {-0.04, -0.03, 0})}));
  for (int k = 0; k < 20; ++k) {
    table.tell(page, page_tool(4, kGrasp, kMove, {ray_between(kEye, {-0.04 - 0.001 * k, -0.03, 0})}));
    table.tick();
  }
  table.tell(page, page_tool(4, kGrasp, kUp, {}, 1));
  while (table.engine.session().step_count() % 100 != 0) table.tell(page, page_command(9, kStep, {1}));
  table.tell(page, page_command(5, kGravity, {0, 1, -2}));
  table.cut(page, {{-0.13, -0.02, 0}, {0.0, -0.02, 0}}, false);
  table.tell(page, page_command(6, kMaterial, {30e3, 0.4, 1100}));
  table.tell(page, page_tool(5, kFix, kDown, {ray_between(kEye, {-0.05, 0, 0})}));
  table.tell(page, page_tool(5, kFix, kUp, {}));
  table.tick(60);
  table.tell(page, page_command(7, kRecording, {0}));
  ASSERT_EQ(p.files.count("steak.kerfrec"), 1u);
  ASSERT_TRUE(p.errors.empty()) << p.errors[0].text;
  auto recording = parse_recording(p.files["steak.kerfrec"], "test");
  ASSERT_TRUE(recording.ok()) << recording.error().message;
  EXPECT_GT(recording->hashes.size(), 3u);
  EXPECT_GT(recording->changes.size(), 40u);
  auto played = replay(*recording);
  ASSERT_TRUE(played.ok()) << played.error().message;
  EXPECT_EQ(played->first_difference, -1);
  EXPECT_EQ(played->steps, table.engine.session().step_count());
  // Changes fall on the very steps that are hashed, too.
  EXPECT_TRUE(std::any_of(recording->changes.begin(), recording->changes.end(), [&](const SessionChange& c) {
    return std::any_of(recording->hashes.begin(), recording->hashes.end(),
                       [&](const StateHash& h) { return h.step == c.step; });
  }));
  // A change that is missing is seen.
  Recording other = *recording;
  std::erase_if(other.changes, [](const SessionChange& c) { return c.kind == SessionChange::Kind::kGravity; });
  auto differs = replay(other);
  ASSERT_TRUE(differs.ok());
  EXPECT_GE(differs->first_difference, 0);
  // After a reset a recording starts from the scene again.
  table.tell(page, page_command(8, kReset));
  table.cut(page, {{-0.005, -0.13, 0}, {-0.005, 0.05, 0}});
  table.tick(20);
  auto again = replay(table.engine.recording());
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->first_difference, -1);
}

TEST(Engine, DroppedFilesTravelInTheRecording) {
  Recording made;
  {
    Table table;
    const auto page = table.join();
    const std::string visual = square(8, 0), collision = square(4, 0);
    table.tell(page, page_upload(2, 0, "a.obj", 0, static_cast<std::uint32_t>(visual.size()), visual));
    table.tell(page, page_upload(2, 1, "b.obj", 0, static_cast<std::uint32_t>(collision.size()), collision));
    table.load(page, page_command(2, kLoadUpload, {2}, "0.05"));
    ASSERT_TRUE(table.pages[page].errors.empty()) << table.pages[page].errors[0].text;
    table.cut(page, {{-0.2, 0.5, 0}, {0.6, 0.4, 0}});
    EXPECT_EQ(table.pages[page].cuts.at(0).outcome, 0u);
    made = table.engine.recording();
  }
  auto parsed = parse_recording(recording_text(made), "test");
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  auto played = replay(*parsed);  // the engine and its folder are gone
  ASSERT_TRUE(played.ok()) << played.error().message;
  EXPECT_EQ(played->first_difference, -1);
}

}  // namespace
}  // namespace kerf::engine_test
