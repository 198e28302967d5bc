// What somebody with a ruler and a pair of scales would ask of cuts in bodies whose shape is known: how many pieces, what each weighs, where the
// drawn walls are, whether a round hole is round. The answers are closed forms; the pieces are those of the drawn mesh.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "kerf/base/random.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/scene/scene_file.h"
#include "kerf/scene/temporary_folder.h"
#include "session/make_session.h"
#include "support/extruded_mesh.h"
#include "support/piece_volumes.h"

namespace kerf::measured_cuts_test {
namespace {

using Path = std::vector<Vec2>;

/// Of a strip's volume: what may be missing or too much. Visual vertices within a tenth of a visual edge of the blade are moved onto the cut.
constexpr double kShare = 0.025;
/// Of a mean collision edge: a wall lies no farther beside the blade.
constexpr double kPlaced = 0.03;

/// 1 x 1 x 0.1 m, or another model, at rest.
Session body(const std::string& model = "closed-sheet", const std::string& cut = "") {
  auto scene =
      parse_scene(fmt::format("[body]\nmodel = \"{}\"\n{}[cut]\n{}\n[simulation]\ngravity = [0, 0, 0]\n", model,
                              model == "closed-sheet" ? "options = {visual_triangles = 20000}\n" : "", cut),
                  "measured");
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  return test::make(*scene);
}

/// An upright blade along a path; every part of it in so many poses.
void draw(Session& session, const Path& path, int poses = 20) {
  const auto pose = [&](Vec2 p) {
    const Status done = session.move_blade({p.x, p.y, 0.2}, {p.x, p.y, -0.2});
    EXPECT_TRUE(done.ok()) << done.error().message;
  };
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, false).ok());
  pose(path.front());
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    for (int k = 1; k <= poses; ++k)
      pose(k == poses ? path[i + 1] : lerp(path[i], path[i + 1], static_cast<double>(k) / poses));
  ASSERT_TRUE(session.end_stroke().ok());
}

/// Drawn pieces, m3, ascending.
std::vector<double> weigh(const Session& session) {
  std::vector<double> volumes = testing_support::piece_volumes(session.body().complex);
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}
double edge_of(const Session& session) { return session.body().complex.mean_root_edge; }

/// Of the material on the side of a plane that its normal points to, m3: the flux of a field through the skin that grows with the height.
double volume_beyond(const VisualMesh& mesh, Vec3 point, Vec3 normal) {
  double volume = 0;
  for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count())) {
    std::vector<Vec3> corners, kept;
    for (int k = 0; k < 3; ++k) corners.push_back(mesh.rest[mesh.from(VisualMesh::corner(f, k))]);
    const auto height = [&](Vec3 p) { return dot(p - point, normal); };
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = corners[k], b = corners[(k + 1) % 3];
      if (height(a) > 0) kept.push_back(a);
      if (height(a) * height(b) < 0) kept.push_back(lerp(a, b, height(a) / (height(a) - height(b))));
    }
    for (std::size_t k = 1; k + 1 < kept.size(); ++k)
      volume += dot(0.5 * cross(kept[k] - kept[0], kept[k + 1] - kept[0]), normal) *
                (height(kept[0]) + height(kept[k]) + height(kept[k + 1])) / 3;
  }
  return volume;
}

/// How far the drawn walls are from a curve, metres.
template <class Distance>
double wall_off(const Session& session, Distance&& distance) {
  const VisualMesh& mesh = session.body().complex.visual;
  double worst = 0;
  for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count()))
    if (mesh.patch[f].is_wall())
      for (int k = 0; k < 3; ++k) {
        const Vec3 p = mesh.rest[mesh.from(VisualMesh::corner(f, k))];
        worst = std::max(worst, distance(Vec2{p.x, p.y}));
      }
  return worst;
}

/// Of one of two lips, m2.
double wall_area(const Session& session) {
  const VisualMesh& mesh = session.body().complex.visual;
  double both = 0;
  for (const VisualTriangle f : ids<VisualTriangle>(mesh.face_count())) {
    const auto corner = [&](int k) { return mesh.rest[mesh.from(VisualMesh::corner(f, k))]; };
    if (mesh.patch[f].is_wall()) both += 0.5 * norm(cross(corner(1) - corner(0), corner(2) - corner(0)));
  }
  return 0.5 * both;
}

/// What may be missing or too much: a share of every piece's volume, and of so much cut, m2, what paths may stray by.
struct Within {
  double share = kShare, cut = 0;
};
void expect_pieces(const Session& session, std::vector<double> expected, const std::string& what, Within within = {}) {
  std::sort(expected.begin(), expected.end());
  const std::vector<double> volumes = weigh(session);
  ASSERT_EQ(volumes.size(), expected.size())
      << what << fmt::format("; the smallest is {:.3g} m3 and should be {:.3g}", volumes.front(), expected.front());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(volumes[i], expected[i],
                within.share * expected[i] + within.cut * session.scene().cut.minimum_feature * edge_of(session))
        << what << ", piece " << i;
  EXPECT_NEAR(std::accumulate(volumes.begin(), volumes.end(), 0.0),
              std::accumulate(expected.begin(), expected.end(), 0.0), 1e-9)
      << what;
  EXPECT_EQ(static_cast<std::size_t>(session.counts().pieces), expected.size()) << what;
  for (const StrokeRecord& s : session.strokes())
    EXPECT_EQ(s.refused, 0) << what << (session.notes().empty() ? "; not noted" : "; " + session.notes().back());
}

TEST(MeasuredCuts, AStripWeighsWhatItIsWide) {
  for (const double x : {0.30, 0.40, 0.43, 0.45, 0.47, 0.48, 0.49})
    for (const bool along_y : {false, true}) {
      Session session = body();
      draw(session, along_y ? Path{{x, -0.6}, {x, 0.6}} : Path{{-0.6, -x}, {0.6, -x}});
      const std::string what = fmt::format("a strip of {} m, {}", 0.5 - x, along_y ? "along y" : "along x");
      expect_pieces(session, {(0.5 - x) * 0.1, (0.5 + x) * 0.1}, what);
      const double off = wall_off(session, [&](Vec2 p) { return std::abs(along_y ? p.x - x : p.y + x); });
      EXPECT_LT(off, kPlaced * edge_of(session)) << what;
    }
}

TEST(MeasuredCuts, AStripOffARoundRimWeighsWhatLiesBeyondTheBlade) {
  for (const char* model : {"steak", "meniscus"}) {
    const Session whole = body(model);
    Box3 box;
    for (const Vec3 p : whole.body().complex.visual.rest.raw()) box.add(p);
    const Vec3 middle = box.center(), size = box.max - box.min;
    for (const double part : {0.9, 0.95, 0.98}) {
      const double y = box.min.y + part * size.y;
      Session session = body(model);
      draw(session, {{middle.x - 0.6 * size.x, y}, {middle.x + 0.6 * size.x, y}}, 60);
      const double beyond = volume_beyond(whole.body().complex.visual, {0, y, 0}, {0, 1, 0});
      const std::vector<double> volumes = weigh(session);
      double off = 0;  // of all that came off at the far side
      ASSERT_GE(volumes.size(), 2U) << model << part;
      EXPECT_GT(volumes.front(), 0) << model << part;
      for (std::size_t i = 0; i + 1 < volumes.size(); ++i) off += volumes[i];
      // Of a strip that is thin beside the least feature: that feature, over all of its wall.
      const double thin = session.scene().cut.minimum_feature * edge_of(session) * wall_area(session);
      EXPECT_NEAR(off, beyond, std::max(kShare * beyond, thin)) << model << ", " << 1 - part << " of its length";
    }
  }
}

TEST(MeasuredCuts, CrossingCutsMakeFourPieces) {
  const double offset[] = {-10.0 / 21 + 1.0 / 42, -1.0 / 3, -0.25, -0.1, 0, 1.0 / 7, 0.2, 1.0 / 3};
  for (const double x : offset)
    for (const double y : offset) {
      Session session = body();
      draw(session, {{x, -0.6}, {x, 0.6}});
      draw(session, {{-0.6, y}, {0.6, y}});
      const double a = 0.5 + x, b = 0.5 + y;
      expect_pieces(session, {0.1 * a * b, 0.1 * a * (1 - b), 0.1 * (1 - a) * b, 0.1 * (1 - a) * (1 - b)},
                    fmt::format("crossing at {:.3f}, {:.3f}", x, y), {2 * kShare, 0.0024});  // of either width
    }
}

TEST(MeasuredCuts, SlantingCrossingCutsMakeFourPieces) {
  for (const double x : {-0.21, 0.0, 0.05})
    for (int degrees = 25; degrees <= 155; degrees += 10) {
      const double a = degrees * std::numbers::pi / 180;
      const Vec2 way{1.5 * std::cos(a), 1.5 * std::sin(a)};
      Session session = body();
      draw(session, {{-0.7, 0.03}, {0.7, 0.03}});
      draw(session, {Vec2{x, 0.03} - way, Vec2{x, 0.03} + way}, 60);
      const std::vector<double> volumes = weigh(session);
      ASSERT_EQ(volumes.size(), 4U) << x << ", " << degrees << " degrees";
      const VisualMesh uncut = body().body().complex.visual;
      const double upper = volume_beyond(uncut, {0, 0.03, 0}, {0, 1, 0}),
                   left = volume_beyond(uncut, {x, 0.03, 0}, {-std::sin(a), std::cos(a), 0});
      // Two of the four are above, and two to the left: some pairs of volumes must say so.
      double nearest_upper = HUGE_VAL, nearest_left = HUGE_VAL;
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t k = 0; k < i; ++k) {
          nearest_upper = std::min(nearest_upper, std::abs(volumes[i] + volumes[k] - upper));
          nearest_left = std::min(nearest_left, std::abs(volumes[i] + volumes[k] - left));
        }
      EXPECT_LT(nearest_upper, 0.002 * upper) << x << ", " << degrees << " degrees";
      EXPECT_LT(nearest_left, 0.002 * left) << x << ", " << degrees << " degrees";
      EXPECT_GT(volumes.front(), 0);
    }
}

TEST(MeasuredCuts, DiceComeApart) {
  for (const int lines : {3, 5, 7, 9}) {
    Session session = body();
    std::vector<double> expected;
    for (const bool along_y : {true, false})
      for (int i = 1; i <= lines; ++i) {
        const double x = static_cast<double>(i) / (lines + 1) - 0.5;
        draw(session, along_y ? Path{{x, -0.6}, {x, 0.6}} : Path{{-0.6, x}, {0.6, x}});
      }
    // Two corners of a square may each be a minimum feature off.
    const double share = std::max(kShare, session.scene().cut.minimum_feature * edge_of(session) * (lines + 1));
    expect_pieces(
        session,
        std::vector<double>(static_cast<std::size_t>((lines + 1) * (lines + 1)), 0.1 / ((lines + 1) * (lines + 1))),
        fmt::format("{} x {} lines", lines, lines), {share, 0});
  }
}

TEST(MeasuredCuts, AWedgeComesOut) {
  for (const double degrees : {90.0, 120.0, 135.0, 140.0, 145.0, 150.0, 160.0, 165.0})
    for (const bool one_stroke : {true, false}) {
      Session session = body();
      // In from the left to a corner, and out again, turned by the angle.
      const double a = degrees * std::numbers::pi / 180, depth = 0.15;
      const Vec2 corner{-0.5 + depth, 0.02}, in{-0.65, 0.02};
      const Vec2 out = corner + 1.2 * Vec2{std::cos(a), std::sin(a)};
      const double height = degrees > 90 ? depth * std::tan(std::numbers::pi - a) : 0;
      if (one_stroke) draw(session, {in, corner, out}, 40);
      else draw(session, {in, corner}, 40), draw(session, {corner, out}, 40);
      const std::string what = fmt::format("turned by {} degrees in {}", degrees, one_stroke ? "one stroke" : "two");
      if (degrees > 90 && 0.02 + height < 0.5) {
        const double wedge = 0.5 * depth * height * 0.1;
        expect_pieces(session, {wedge, 0.1 - wedge}, what,
                      {kShare, 0.1 * (depth + depth / std::cos(std::numbers::pi - a))});
      } else {
        EXPECT_EQ(weigh(session).size(), 2U) << what;
      }
    }
}

TEST(MeasuredCuts, NestedHexagonsAllComeLoose) {
  for (const bool inwards : {true, false}) {
    Session session = body();
    std::vector<double> radii{0.46, 0.40, 0.34, 0.28, 0.22, 0.16, 0.10, 0.04}, expected;
    if (!inwards) std::reverse(radii.begin(), radii.end());
    for (const double r : radii) {
      Path path;
      for (int i = 0; i <= 6; ++i)
        path.push_back({r * std::cos(i * std::numbers::pi / 3), r * std::sin(i * std::numbers::pi / 3)});
      draw(session, path, 8);
    }
    std::sort(radii.begin(), radii.end());
    double within = 0;
    for (const double r : radii) {
      const double volume = 1.5 * std::sqrt(3.0) * r * r * 0.1;
      expected.push_back(volume - within);
      within = volume;
    }
    expected.push_back(0.1 - within);
    expect_pieces(session, expected, inwards ? "from outside inwards" : "from inside outwards", {kShare, 0.6 * 0.46});
  }
}

/// At rest, with a collision mesh that is made by itself; nothing is swept up.
Session automatic_body(const TriangleMesh& mesh) {
  const auto folder = TemporaryFolder::create();
  EXPECT_TRUE(folder.ok());
  const std::string path = (folder->path() / "body.obj").string();
  EXPECT_TRUE(write_obj(path, mesh).ok());
  auto scene = parse_scene(
      fmt::format("[body]\nvisual = \"{}\"\n[cut]\ndust = 0\n[simulation]\ngravity = [0, 0, 0]\n", path), "measured");
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  return test::make(*scene);
}

// A blade passes a hole so that it dips into it by 0.3 or 0.6 mm, then one goes out from the hole: three pieces. Where the hole of the collision mesh has seven
// corners, a film stays between the blade and the hole.
TEST(MeasuredCuts, ABladeThatDipsIntoAHoleLeavesNoFilm) {
  using testing_support::circle;
  const testing_support::Outline plate{{0, 0, 0}, {0.12, 0, 0}, {0.12, 0.09, 0}, {0, 0.09, 0}};
  Random random(77);
  for (const double radius : {0.004, 0.01, 0.02}) {
    const Vec3 middle{0.05, 0.045, 0};
    Session session = automatic_body(testing_support::extruded(
        testing_support::cut_in_ears(plate, {circle(middle, radius, 96)}), 1, [](Vec3) { return 0.0015; }));
    int films = 0;
    for (int i = 0; i < 20; ++i) {
      while (session.undo_depth() > 0) ASSERT_TRUE(session.undo().ok());
      const double a = random.uniform(0, 2 * std::numbers::pi), depth = i % 2 == 0 ? 0.3e-3 : 0.6e-3;
      const Vec2 out{std::cos(a), std::sin(a)}, along{-out.y, out.x}, hole{middle.x, middle.y};
      const Vec2 dip = hole + (radius - depth) * out;
      draw(session, {dip - 0.2 * along, dip + 0.2 * along}, 100);
      draw(session, {hole, hole - 0.2 * out}, 50);
      films += session.counts().pieces != 3;
    }
    EXPECT_EQ(films, 0) << radius;
  }
}

/// A ring of 40 to 120 mm, 6 mm thick.
TriangleMesh ring() {
  TriangleMesh flat;
  const int around = 96, across = 6;
  for (int j = 0; j <= across; ++j)
    for (int i = 0; i < around; ++i) {
      const double a = 2 * std::numbers::pi * (i + 0.5 * (j % 2)) / around, r = 0.02 + 0.04 * j / across;
      flat.positions.push_back({r * std::cos(a), r * std::sin(a), 0});
    }
  for (int j = 0; j < across; ++j)
    for (int i = 0; i < around; ++i) {
      const int next = (i + 1) % around, a = j * around + i, b = j * around + next, c = a + around, d = b + around;
      const bool odd = j % 2 == 1;
      flat.triangles.push_back({VertexId(a), VertexId(c), VertexId(odd ? d : b)});
      flat.triangles.push_back({VertexId(odd ? a : b), VertexId(odd ? d : c), VertexId(odd ? b : d)});
    }
  return testing_support::extruded(flat, 2, [](Vec3) { return 0.003; });
}

// Two slanting strokes that run along the outer side of a ring and across each other: slivers of 5 x 20 mm come off.
TEST(MeasuredCuts, SliversAtARimHaveAVolume) {
  Session session = automatic_body(ring());
  const double whole = weigh(session).front();
  const Path strokes[] = {{{0.0002, 0.0429},
                           {-0.0166, 0.0423},
                           {-0.0331, 0.0392},
                           {-0.0489, 0.0337},
                           {-0.0553, 0.0227},
                           {-0.0595, 0.0068},
                           {-0.0590, -0.0095},
                           {-0.0543, -0.0254}},
                          {{-0.0592, 0.0052},
                           {-0.0596, -0.0004},
                           {-0.0596, -0.0057},
                           {-0.0587, -0.0110},
                           {-0.0577, -0.0163},
                           {-0.0558, -0.0213}}};
  for (const Path& stroke : strokes) draw(session, stroke, 4);
  const std::vector<double> volumes = weigh(session);
  EXPECT_EQ(static_cast<std::size_t>(session.counts().pieces), volumes.size());
  for (const double v : volumes) EXPECT_GT(v, 1e-7 * whole);
  EXPECT_NEAR(std::accumulate(volumes.begin(), volumes.end(), 0.0), whole, 1e-9 * whole);
  for (const StrokeRecord& s : session.strokes()) EXPECT_EQ(s.refused, 0);
}

}  // namespace
}  // namespace kerf::measured_cuts_test
