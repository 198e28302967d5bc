#include "kerf/picture/quick_painter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "kerf/base/parallel.h"

namespace kerf::quick_painter_test {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

struct Mesh {
  std::vector<Vec3> positions;
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<std::uint8_t> wall;
  [[nodiscard]] PictureBody body() const { return {positions, positions, triangles, wall, Look::kSheet}; }
};

struct Seen {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  std::vector<float> depth;
  [[nodiscard]] float at(int x, int y) const { return depth[static_cast<std::size_t>(y * width + x)]; }
  [[nodiscard]] int covered() const {
    return static_cast<int>(std::count_if(depth.begin(), depth.end(), [](float z) { return z < kFar; }));
  }
};

struct Size {
  int width = 160, height = 120;
};
Seen look_at(QuickPainter& painter, const QuickStage& stage, const PictureView& view, Size size = {}) {
  Seen seen{size.width, size.height, {}, {}};
  const auto pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  seen.rgb.resize(3 * pixels);
  seen.depth.resize(pixels);
  EXPECT_TRUE(check_view(view).ok());
  painter.draw(stage, view, {size.width, size.height, seen.rgb, seen.depth});
  return seen;
}
Seen look_at(const Mesh& mesh, const PictureView& view, Size size = {}) {
  const BodyTexture texture(mesh.body());
  QuickPainter painter;
  return look_at(painter, {mesh.body(), &texture, {}, {}}, view, size);
}

/// Metres along the view of one metre along a pixel's ray, and the ray: a pinhole camera by hand.
struct Ray {
  Vec3 from, along;  ///< along: one metre along the view
};
Ray ray_of(const PictureView& view, Size size, int x, int y) {
  const Vec3 ahead = normalized(view.target - view.eye), right = normalized(cross(ahead, view.up)),
             up = cross(right, ahead);
  const double tan_y = std::tan(view.field_of_view / 2), tan_x = tan_y * size.width / size.height;
  const double u = (2 * x + 1.0) / size.width - 1, v = 1 - (2 * y + 1.0) / size.height;
  return {view.eye, ahead + u * tan_x * right + v * tan_y * up};
}

/// Moeller and Trumbore; HUGE_VAL: it misses.
double meets(const Ray& ray, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 e1 = b - a, e2 = c - a, p = cross(ray.along, e2);
  const double det = dot(e1, p);
  if (det == 0) return HUGE_VAL;
  const Vec3 s = ray.from - a, q = cross(s, e1);
  const double u = dot(s, p) / det, v = dot(ray.along, q) / det, t = dot(e2, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : HUGE_VAL;
}

Mesh sphere(double radius, int rings) {
  Mesh out;
  const int sides = 2 * rings;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < sides; ++j) {
      const double a = M_PI * i / rings, b = 2 * M_PI * j / sides;
      out.positions.push_back(
          {radius * std::sin(a) * std::cos(b), radius * std::sin(a) * std::sin(b), radius * std::cos(a)});
    }
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sides; ++j) {
      const int k = (j + 1) % sides;
      const std::int32_t p = i * sides + j, q = i * sides + k, r = (i + 1) * sides + j, s = (i + 1) * sides + k;
      out.triangles.push_back({p, r, q});
      out.triangles.push_back({q, r, s});
    }
  return out;
}

/// A square of 2 m in the plane z = 0 whose inner vertices lie anywhere in their cells.
Mesh plate(int cells, std::uint32_t seed) {
  Mesh out;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-0.35, 0.35);
  for (int j = 0; j <= cells; ++j)
    for (int i = 0; i <= cells; ++i) {
      const bool inner = i > 0 && j > 0 && i < cells && j < cells;
      const double dx = jitter(random), dy = jitter(random);
      out.positions.push_back({2 * (i + (inner ? dx : 0)) / cells - 1, 2 * (j + (inner ? dy : 0)) / cells - 1, 0});
    }
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i) {
      const std::int32_t p = j * (cells + 1) + i, q = p + 1, r = p + cells + 1, s = r + 1;
      out.triangles.push_back({p, q, s});
      out.triangles.push_back({p, s, r});
    }
  return out;
}

TEST(QuickPainter, ASphereIsADiscOfTheRightSize) {
  const double radius = 0.7, distance = 5;
  const Size size{400, 300};
  const PictureView view{{3, 0, 4}, {0, 0, 0}, {0, 0, 1}, 0.5};
  const Seen seen = look_at(sphere(radius, 200), view, size);
  const double focal = 150 / std::tan(0.25), tangent = std::tan(std::asin(radius / distance));
  EXPECT_NEAR(seen.covered(), M_PI * std::pow(focal * tangent, 2), 0.004 * seen.covered());
  EXPECT_NEAR(seen.at(200, 150), distance - radius, 1e-3);
}

TEST(QuickPainter, APlateIsAsFarAsItsPlane) {
  const Size size{160, 120};
  const PictureView view{{0.1, -2.2, 0.9}, {0.05, 0.1, 0}, {0, 0, 1}, 0.5};
  const Mesh mesh = plate(20, 3);
  const Seen seen = look_at(mesh, view, size);
  int inside = 0;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const Ray ray = ray_of(view, size, x, y);
      const double t = -ray.from.z / ray.along.z;
      const Vec3 p = ray.from + t * ray.along;
      const double rim = std::max(std::abs(p.x), std::abs(p.y)) - 1;
      if (std::abs(rim) < 1e-9) continue;
      const bool on = t > 0 && rim < 0;
      inside += on ? 1 : 0;
      if (on) EXPECT_NEAR(seen.at(x, y), t, 1e-6 * t) << x << ' ' << y;
      else EXPECT_EQ(seen.at(x, y), kFar) << x << ' ' << y;
    }
  EXPECT_GT(inside, 5000);
}

TEST(QuickPainter, NoRaySlipsThroughBetweenNeighbours) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Mesh mesh = plate(40, seed);
    const PictureView view{{0.004 * seed, -0.2, 0.4}, {0, 0.003 * seed, 0}, {0.1, 0, 1}, 0.9};
    const Seen seen = look_at(mesh, view, {200, 200});
    EXPECT_EQ(seen.covered(), 200 * 200) << seed;
  }
}

TEST(QuickPainter, WhatReachesBehindTheEyeIsSeen) {
  // A hand's breadth over a plate of two triangles that lie around the eye on all sides: below the horizon is plate.
  const Mesh mesh = plate(1, 1);
  const Size size{100, 80};
  const PictureView view{{0, 0, 0.1}, {0, 0.4, 0}, {0, 0, 1}, 1.2};
  const Seen seen = look_at(mesh, view, size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const Ray ray = ray_of(view, size, x, y);
      const double t = -ray.from.z / ray.along.z;
      const Vec3 p = ray.from + t * ray.along;
      const bool on = t > 0 && std::abs(p.x) < 1 && std::abs(p.y) < 1;
      if (on) EXPECT_NEAR(seen.at(x, y), t, 1e-6 * t);
      else EXPECT_EQ(seen.at(x, y), kFar);
    }
}

TEST(QuickPainter, SeesWhatRaysMeet) {
  // Random triangles around random eyes, some through the plane of the eye, against every ray with every triangle.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1, 1);
  const Size size{40, 30};
  int hits = 0, doubtful = 0;
  for (int round = 0; round < 60; ++round) {
    Mesh mesh;
    const double reach = round % 3 == 0 ? 0.2 : 1;
    for (int t = 0; t < 40; ++t) {
      const Vec3 middle{place(random), place(random), place(random)};
      for (int k = 0; k < 3; ++k)
        mesh.positions.push_back(middle + reach * Vec3{place(random), place(random), place(random)});
      mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    const double far = round % 2 == 0 ? 3 : 0.4;
    const PictureView view{far * Vec3{place(random), place(random), place(random)},
                           {place(random), place(random), place(random)},
                           {place(random), place(random), place(random)},
                           0.3 + 0.03 * round};
    const Seen seen = look_at(mesh, view, size);
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        const Ray ray = ray_of(view, size, x, y);
        double nearest = HUGE_VAL;
        for (const auto& t : mesh.triangles)
          nearest = std::min(nearest, meets(ray, mesh.positions[static_cast<std::size_t>(t[0])],
                                            mesh.positions[static_cast<std::size_t>(t[1])],
                                            mesh.positions[static_cast<std::size_t>(t[2])]));
        const double z = static_cast<double>(seen.at(x, y));
        if (nearest < HUGE_VAL) ++hits;
        if (z == nearest || std::abs(z - nearest) <= 1e-6 * nearest) continue;
        ++doubtful;  // a ray through an edge, by a rounding error
      }
  }
  EXPECT_GT(hits, 20000);
  EXPECT_LE(doubtful, 1);
}

TEST(QuickPainter, CutSurfacesAndSkinHaveTheirColours) {
  Mesh mesh = plate(4, 2);
  const PictureView above{{0, -0.01, 3}, {0, 0, 0}, {0, 0, 1}, 0.3}, below{{0, -0.01, -3}, {0, 0, 0}, {0, 0, 1}, 0.3};
  const auto middle = [](const Seen& seen) { return seen.rgb.data() + 3 * (seen.width * 47 + 83); };
  for (const PictureView& view : {above, below}) {
    mesh.wall.assign(mesh.triangles.size(), 0);
    const Seen blue = look_at(mesh, view);
    EXPECT_GT(middle(blue)[2], middle(blue)[0] + 20);
    mesh.wall.assign(mesh.triangles.size(), 1);
    const Seen orange = look_at(mesh, view);
    EXPECT_GT(middle(orange)[0], middle(orange)[2] + 20);
  }
}

TEST(QuickPainter, TheGroundIsAPlaneWithoutEnd) {
  const Mesh mesh;
  const BodyTexture texture(mesh.body());
  QuickPainter painter;
  const Size size{90, 70};
  const PictureView view{{1, 2, 1.5}, {0, 0, 0.9}, {0, 0.1, 1}, 0.8};
  const Seen seen = look_at(painter, {mesh.body(), &texture, {}, 0.25}, view, size);
  int ground = 0;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const Ray ray = ray_of(view, size, x, y);
      const double t = (0.25 - ray.from.z) / ray.along.z;
      ground += t > 0 ? 1 : 0;
      if (t > 0) EXPECT_NEAR(seen.at(x, y), t, 1e-6 * t);
      else EXPECT_EQ(seen.at(x, y), kFar);
    }
  EXPECT_GT(ground, 2000);
  EXPECT_LT(ground, 6300);
}

TEST(QuickPainter, ThingsStandBeforeAndBehindTheBody) {
  const Mesh mesh = plate(6, 5);
  const BodyTexture texture(mesh.body());
  PictureThing before, behind;
  before.positions = {{-0.2, -0.2, 0.5}, {0.2, -0.2, 0.5}, {0, 0.3, 0.5}};
  before.triangles = {{0, 1, 2}};
  behind = before;
  for (Vec3& p : behind.positions) p.z = -0.5;
  const std::array<PictureThing, 2> things{behind, before};
  QuickPainter painter;
  const PictureView view{{0, -0.001, 4}, {0, 0, 0}, {0, 1, 0}, 0.4};
  const Seen seen = look_at(painter, {mesh.body(), &texture, things, {}}, view);
  EXPECT_NEAR(seen.at(80, 60), 3.5, 1e-2);
  EXPECT_NEAR(seen.at(80, 10), 4, 1e-2);
}

TEST(QuickPainter, SameBytesWhateverWasDrawnBefore) {
  const Mesh mesh = sphere(0.5, 40), other = plate(9, 8);
  const BodyTexture texture(mesh.body()), other_texture(other.body());
  const PictureView view{{1, 1, 1}, {0, 0, 0.1}, {0, 0, 1}, 0.6};
  QuickPainter fresh;
  const Seen first = look_at(fresh, {mesh.body(), &texture, {}, -0.5}, view);
  QuickPainter used;
  look_at(used, {other.body(), &other_texture, {}, {}}, view, {300, 200});
  look_at(used, {other.body(), &other_texture, {}, {}}, view, {3, 1});
  for (const int threads : {1, 4}) {
    const ThreadLimit limit(threads);
    const Seen again = look_at(used, {mesh.body(), &texture, {}, -0.5}, view);
    EXPECT_TRUE(again.rgb == first.rgb && again.depth == first.depth);
  }
  // Depth alone is the same depth.
  std::vector<float> depth(first.depth.size());
  used.draw({mesh.body(), nullptr, {}, -0.5}, view, {first.width, first.height, {}, depth});
  EXPECT_TRUE(depth == first.depth);
}

TEST(QuickPainter, ExtremeViewsAndBodiesAreDrawn) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> power(-9, 9), place(-1, 1);
  const auto number = [&] { return place(random) * std::pow(10, power(random)); };
  int drawn = 0;
  for (int round = 0; round < 2000; ++round) {
    Mesh mesh = sphere(std::pow(10, power(random) / 1.5), 6);
    const PictureView view{{number(), number(), number()},
                           {number(), number(), number()},
                           {number(), number(), number()},
                           0.02 + 2.48 * std::abs(place(random))};
    if (!check_view(view)) continue;
    ++drawn;
    const Seen seen = look_at(mesh, view, {17, 1 + round % 13});
    EXPECT_TRUE(std::none_of(seen.depth.begin(), seen.depth.end(), [](float z) { return std::isnan(z) || z < 0; }));
    PictureOptions options;
    options.view = view;
    options.width = 5;
    options.height = 4;
    if (round % 500 == 0) {
      EXPECT_EQ(draw_picture(mesh.body(), {}, options).rgb.size(), 60u);
    }
  }
  EXPECT_GT(drawn, 1500);
}

TEST(PictureView, WhatIsNoViewIsRefused) {
  const PictureView good{{0, -1, 1}, {0, 0, 0}, {0, 0, 1}, 0.5};
  EXPECT_TRUE(check_view(good).ok());
  const auto refusal = [&](auto&& change) {
    PictureView view = good;
    change(view);
    const Status status = check_view(view);
    EXPECT_FALSE(status.ok());
    return status.ok() ? std::string() : status.error().message;
  };
  EXPECT_EQ(refusal([](PictureView& v) { v.eye.x = NAN; }), "eye must be finite");
  EXPECT_EQ(refusal([](PictureView& v) { v.up.y = HUGE_VAL; }), "up must be finite");
  EXPECT_EQ(refusal([](PictureView& v) { v.target.z = 1e300; }), "target must be three numbers of at most 1e+09");
  EXPECT_EQ(refusal([](PictureView& v) { v.eye = v.target; }),
            "eye and target must be 1e-09 m apart or more; move one of them");
  EXPECT_EQ(refusal([](PictureView& v) { v.up = {}; }), "up must not be zero; give it a direction");
  for (const double scale : {1.0, -1e-200, 1e8})
    EXPECT_EQ(refusal([&](PictureView& v) { v.up = scale * (v.target - v.eye); }),
              "up must not be along the view from eye to target; give it another direction");
  for (const double angle : {0.0, -1.0, 3.2, static_cast<double>(NAN)})
    EXPECT_NE(refusal([&](PictureView& v) { v.field_of_view = angle; }).find("field_of_view must be 0.02 to 2.5"),
              std::string::npos);
}

}  // namespace
}  // namespace kerf::quick_painter_test
