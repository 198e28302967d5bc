// A body against itself and against another one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>

#include "contact/bare_surface.h"
#include "kerf/contact/rest_neighbours.h"
#include "support/contact_checker.h"

namespace kerf::self_contact_test {
namespace {

using testing_support::BareSurface;
using testing_support::plain_grid_mesh;
using testing_support::PrismView;

struct SelfDetection {
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  DetectReport run(const BareSurface& body, const DetectOptions& options = {}) {
    const SurfaceState state = body.state();
    return detect(std::span(&state, 1), {}, {}, options, memory, workspace, contacts);
  }
};

void expect_consistent(const BareSurface& body, const std::vector<Contact>& contacts) {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    EXPECT_NEAR(norm(c.normal), 1, 1e-9);
    EXPECT_NEAR(dot(body.point(c.a) - body.point(c.b), c.normal), c.gap, 1e-12);
    EXPECT_NEAR(norm(body.point(c.b) - c.point), 0, 1e-12);
    if (i > 0) {
      EXPECT_LT(contacts[i - 1].key, c.key);
    }
  }
}

/// Faces that hang together with v within the distance of neighbours at rest, by flooding with plain loops.
std::vector<bool> brute_neighbours(const BareSurface& body, CollisionVertex v) {
  const ContactSurface& s = body.surface;
  const auto near = [&](CollisionTriangle f) {
    const auto c = s.vertices(f);
    const double d = testing_support::brute_triangle_distance(s.rest[v], s.rest[c[0]], s.rest[c[1]], s.rest[c[2]]);
    return d <= 1.2 * (s.radius[v] + std::max({s.radius[c[0]], s.radius[c[1]], s.radius[c[2]]}));
  };
  std::vector<bool> in(s.face_count(), false);
  std::queue<CollisionTriangle> queue;
  for (const CollisionTriangle f : ids<CollisionTriangle>(s.face_count()))
    for (const CollisionVertex c : s.vertices(f))
      if (c == v && !in[f.index()]) in[f.index()] = true, queue.push(f);
  while (!queue.empty()) {
    const CollisionTriangle f = queue.front();
    queue.pop();
    for (int i = 0; i < 3; ++i)
      if (const CollisionHalfEdge g = s.twin[ContactSurface::corner(f, i)]; g.valid())
        if (const CollisionTriangle t = ContactSurface::face(g); !in[t.index()] && near(t))
          in[t.index()] = true, queue.push(t);
  }
  return in;
}

/// The least gap of every vertex on each of its sides, over all faces.
std::map<std::pair<int, int>, double> brute_gaps(const BareSurface& body, double limit) {
  std::map<std::pair<int, int>, double> best;
  const ContactSurface& s = body.surface;
  for (const CollisionVertex v : ids<CollisionVertex>(s.vertex_count())) {
    const std::vector<bool> neighbour = brute_neighbours(body, v);
    const Vec3 x = body.position[v.index()], o = body.offset[v.index()];
    for (const CollisionTriangle f : ids<CollisionTriangle>(s.face_count())) {
      if (neighbour[f.index()]) continue;
      const auto c = s.vertices(f);
      ClosestPoint foot;
      closest_point(x, {body.position[c[0].index()], body.position[c[1].index()], body.position[c[2].index()]}, foot);
      if (!(foot.distance > 1e-9)) continue;
      const Vec3 n = (1 / foot.distance) * (x - foot.point);
      Vec3 q;
      for (std::size_t i = 0; i < 3; ++i) q += foot.barycentric[i] * body.offset[c[i].index()];
      const double gap = foot.distance - std::fabs(dot(n, o)) - std::fabs(dot(n, q));
      if (gap > limit) continue;
      const auto [at, added] = best.emplace(std::pair{v.value, dot(n, o) > 0 ? -1 : 1}, gap);
      if (!added) at->second = std::min(at->second, gap);
    }
  }
  return best;
}

void expect_equals_brute_force(const BareSurface& body, const char* what) {
  SelfDetection d;
  d.run(body);
  expect_consistent(body, d.contacts);
  const double margin = 0.2 * body.surface.largest_radius;
  const auto brute = brute_gaps(body, margin);
  std::map<std::pair<int, int>, double> found;
  for (const Contact& c : d.contacts)
    if (!c.a.vertex[1].valid()) found[{c.a.vertex[0].value, static_cast<int>(c.a.lift)}] = c.gap;
  for (const auto& [key, gap] : brute) {
    if (gap > margin - 1e-9) continue;  // on the edge of the margin either answer will do
    ASSERT_TRUE(found.contains(key)) << what << ": vertex " << key.first << " side " << key.second << " gap " << gap;
    EXPECT_NEAR(found[key], gap, 1e-9) << what << ": vertex " << key.first;
  }
  for (const auto& [key, gap] : found) EXPECT_TRUE(brute.contains(key)) << what << ": vertex " << key.first;
}

/// A sheet of 1 m rolled up about y: layers `apart` metres apart, from an inner radius.
void roll(BareSurface& sheet, double inner, double apart) {
  const double pitch = apart / (2 * 3.14159265358979323846);
  sheet.deform([&](Vec3 p) {
    const double angle = (-inner + std::sqrt(inner * inner + 2 * pitch * p.x)) / pitch, r = inner + pitch * angle;
    return Vec3{r * std::cos(angle), p.y, r * std::sin(angle)};
  });
}

TEST(SelfContact, RolledSheetEqualsBruteForce) {
  for (const double r : {0.01, 0.02, 0.03})
    for (const int grid : {12, 24}) {
      BareSurface sheet(testing_support::plain_grid_mesh(2 * grid, grid / 3, 1, 0.2), r);
      for (const double apart : {1.9, 2.05, 2.15}) {
        roll(sheet, 2 * r, apart * r);
        expect_equals_brute_force(sheet, "roll");
        SelfDetection d;
        if (apart < 2) {
          EXPECT_GT(d.run(sheet).deepest, 0.05);
        }
      }
    }
}

TEST(SelfContact, FoldedSheetsEqualBruteForce) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    BareSurface sheet(plain_grid_mesh(14, 14), random.uniform(0.005, 0.05));
    const Vec3 k{random.uniform(-12, 12), random.uniform(-12, 12), 0},
        l{random.uniform(-12, 12), random.uniform(-12, 12), 0};
    const double high = random.uniform(0.02, 0.3), across = random.uniform(0, 0.3);
    sheet.deform([&](Vec3 p) {
      return p + Vec3{across * std::sin(dot(l, p)), across * std::cos(dot(k, p)),
                      high * std::sin(dot(k, p)) + high * std::cos(dot(l, p))};
    });
    expect_equals_brute_force(sheet, "fold");
  }
}

// Half of a roll has closed by more than was foreseen: a second look at what has strayed finds all that has come to be in each other, and looks nowhere else.
TEST(SelfContact, ASecondLookFindsWhatHasStrayed) {
  for (const double r : {0.01, 0.02, 0.03})
    for (const double reached : {0.3, 0.5}) {  // how far along the roll it closes
      BareSurface sheet(plain_grid_mesh(32, 8, 1, 0.4), r);
      const std::size_t n = sheet.position.size();
      std::vector<double> part(n);
      for (const CollisionVertex v : ids<CollisionVertex>(n))
        part[v.index()] = std::clamp(1.5 - sheet.surface.rest[v].y / (0.4 * reached), 0.0, 1.0);
      // Layers this far apart where the roll closes, and side by side, with hardly anything between them, elsewhere.
      const auto rolled = [&](double apart) {
        roll(sheet, 2 * r, 2.1 * r);
        const std::vector<Vec3> position = sheet.position, offset = sheet.offset;
        roll(sheet, 2 * r, apart);
        for (std::size_t v = 0; v < n; ++v) {
          sheet.position[v] = lerp(position[v], sheet.position[v], part[v]);
          sheet.offset[v] = lerp(offset[v], sheet.offset[v], part[v]);
        }
        sheet.predicted = sheet.position;
      };
      rolled(2.5 * r);
      const std::vector<Vec3> open = sheet.position, open_offset = sheet.offset;
      SelfDetection d;
      d.run(sheet);
      const std::vector<Contact> first = d.contacts;
      rolled(1.8 * r);
      std::vector<Vec3> stray(n), turn(n);
      for (std::size_t v = 0; v < n; ++v) {
        stray[v] = sheet.position[v] - open[v];
        turn[v] = sheet.offset[v] - open_offset[v];
      }
      SelfDetection all, again;
      all.run(sheet);
      const Strayed strayed{stray, turn};
      DetectOptions options;
      options.strayed = &strayed;
      again.run(sheet, options);
      const auto has = [](const std::vector<Contact>& list, const Contact& c) {
        return std::any_of(list.begin(), list.end(),
                           [&](const Contact& x) { return x.key == c.key && x.gap == c.gap; });
      };
      int found = 0;
      for (const Contact& c : all.contacts) {
        if (!(c.gap < -0.03 * r) ||
            std::any_of(first.begin(), first.end(), [&](const Contact& x) { return x.key == c.key; }))
          continue;
        ++found;
        EXPECT_TRUE(has(again.contacts, c))
            << "gap " << c.gap / r << " r at y = " << sheet.surface.rest[c.a.vertex[0]].y;
      }
      EXPECT_GT(found, 20) << r << " " << reached;
      EXPECT_LT(again.contacts.size(), all.contacts.size());
      // Of what has gone as foreseen nothing is looked at.
      std::fill(stray.begin(), stray.end(), Vec3{1, 2, 3});
      std::fill(turn.begin(), turn.end(), Vec3{});
      again.run(sheet, options);
      EXPECT_TRUE(again.contacts.empty());
    }
}

TEST(SelfContact, FlatAndBentSheetsHaveNone) {
  BareSurface sheet(plain_grid_mesh(20, 20), 0.05);
  SelfDetection d;
  d.run(sheet);
  EXPECT_TRUE(d.contacts.empty());
  // Half a tube is far from itself.
  sheet.deform([](Vec3 p) { return Vec3{0.318 * std::cos(3.14 * p.x), p.y, 0.318 * std::sin(3.14 * p.x)}; });
  d.run(sheet);
  EXPECT_TRUE(d.contacts.empty());
}

/// Three strips above each other in one body, which hang together nowhere.
TriangleMesh three_strips(double apart) {
  TriangleMesh mesh;
  for (int k = 0; k < 3; ++k) {
    const TriangleMesh one = plain_grid_mesh(8, 3, 1, 0.3);
    const auto base = static_cast<std::int32_t>(mesh.positions.size());
    for (const Vec3 p : one.positions) mesh.positions.push_back(p + Vec3{0.01 * k, 0.013 * k, apart * k});
    for (const auto& t : one.triangles)
      mesh.triangles.push_back({VertexId(base + t[0].value), VertexId(base + t[1].value), VertexId(base + t[2].value)});
  }
  return mesh;
}

TEST(SelfContact, VertexBetweenTwoLayersTouchesBoth) {
  const double r = 0.02;
  for (const double apart : {1.98, 2.0, 2.1}) {  // at rest already: pieces are no neighbours however near
    BareSurface pile(three_strips(apart * r), r);
    SelfDetection d;
    d.run(pile);
    expect_consistent(pile, d.contacts);
    expect_equals_brute_force(pile, "pile");
    std::map<int, int> sides;
    for (const Contact& c : d.contacts) {
      // A strip's end beside the next one's is farther away.
      if (std::fabs(c.normal.z) < 0.9999) {
        EXPECT_GT(c.gap, (apart - 2) * r);
        continue;
      }
      EXPECT_NEAR(c.gap, (apart - 2) * r, 1e-9);
      if (!c.a.vertex[1].valid()) sides[c.a.vertex[0].value] |= c.a.lift > 0 ? 1 : 2;
    }
    int both = 0;
    for (const auto& [v, bits] : sides)
      if (bits == 3) ++both;
    EXPECT_GE(both, 14);  // all inner ones of the strip in the middle
  }
}

TEST(SelfContact, TwoBodiesTouchLikeOne) {
  const double r = 0.02;
  BareSurface lower(plain_grid_mesh(6, 6), r), upper(plain_grid_mesh(9, 9), r);
  upper.deform([&](Vec3 p) { return Vec3{0.9 * p.x - 0.4 * p.y, 0.4 * p.x + 0.9 * p.y, 1.99 * r}; });
  const SurfaceState states[2] = {lower.state(), upper.state()};
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  detect(states, {}, {}, {}, memory, workspace, contacts);
  int from_lower = 0, from_upper = 0, edges = 0;
  for (const Contact& c : contacts) {
    EXPECT_NE(c.a.body, c.b.body);
    if (std::fabs(c.normal.z) < 0.9999) continue;  // beside the other's border
    EXPECT_NEAR(c.gap, -0.01 * r, 1e-9);
    EXPECT_NEAR(c.normal.z, c.a.body == 1 ? 1 : -1, 1e-9);
    if (c.a.vertex[1].valid()) ++edges;
    else ++(c.a.body == 0 ? from_lower : from_upper);
  }
  EXPECT_GT(from_lower, 15);
  EXPECT_GT(from_upper, 40);
  EXPECT_GT(edges, 30);
}

// A sheet folded at rest, flat on flat: thicker than the gap it is reported, thinner it is not.
TEST(SelfContact, FoldsWithTooLittleBetweenThemAreFound) {
  constexpr double kGap = 0.012, kArc = M_PI * kGap / 2, kArm = 0.1;
  TriangleMesh fold = plain_grid_mesh(50, 10, 2 * kArm + kArc, 0.05);
  const double start = fold.positions[VertexId(0)].x;
  for (Vec3& p : fold.positions.raw()) {
    const double s = p.x - start - kArm, angle = std::clamp(s / kArc, 0.0, 1.0) * M_PI;
    const double along = s < 0 ? -s : s > kArc ? s - kArc : -0.5 * kGap * std::sin(angle);
    p = {along, p.y, -0.5 * kGap * std::cos(angle)};
  }
  const TightFolds tight = find_tight_folds(BareSurface(fold, 0.01).surface);
  EXPECT_GT(tight.vertices, 200u);
  EXPECT_NEAR(tight.overlap, 0.02 - kGap, 1e-9);
  EXPECT_EQ(find_tight_folds(BareSurface(fold, 0.0059).surface).vertices, 0u);
}

// A fold that closes: detected before it does, and never let through however fast.
TEST(SelfContact, ClosingFoldIsSeenInTime) {
  const double r = 0.01;
  BareSurface sheet(plain_grid_mesh(24, 4, 1, 0.2), r);
  const auto fold = [&](double z) {
    return [z](Vec3 p) {
      return p.x < 0.45   ? p
             : p.x > 0.55 ? Vec3{1 - p.x, p.y, z}
                          : Vec3{0.45 + 0.02 * (p.x - 0.45), p.y, z * (p.x - 0.45) / 0.1};
    };
  };
  for (const double step : {0.001, 0.01, 0.1}) {
    sheet.deform(fold(0.1));
    for (std::size_t v = 0; v < sheet.position.size(); ++v)
      if (sheet.position[v].z > 0.099) sheet.predicted[v].z -= step;
    SelfDetection d;
    d.run(sheet);
    const bool meets = step > 0.07;
    int layers = 0;
    for (const Contact& c : d.contacts) layers += std::fabs(c.normal.z) > 0.99 ? 1 : 0;
    EXPECT_EQ(layers > 20, meets) << step;
  }
}

}  // namespace
}  // namespace kerf::self_contact_test
