#include "kerf/picture/picture.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "kerf/base/parallel.h"
#include "kerf/mesh/models.h"

namespace kerf::picture_test {
namespace {

struct Rgb {
  int r, g, b;
};
Rgb pixel(const Picture& p, int x, int y) {
  const std::uint8_t* c = p.rgb.data() + 3 * (y * p.width + x);
  return {c[0], c[1], c[2]};
}

/// A square of 1 m in the plane z = 0, two triangles.
struct Square {
  std::vector<Vec3> positions{{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}};
  std::vector<std::array<std::int32_t, 3>> triangles{{0, 1, 2}, {0, 2, 3}};
  std::vector<std::uint8_t> wall;
  [[nodiscard]] PictureBody body() const { return {positions, positions, triangles, wall, Look::kSheet}; }
};

PictureOptions small(int width = 120, int height = 80) {
  PictureOptions options;
  options.width = width;
  options.height = height;
  return options;
}

TEST(Picture, TheBodyFillsTheMiddle) {
  const Square square;
  PictureOptions options = small();
  options.direction = {0, -0.01, 1};  // from above: the square covers 1 / 1.1 of the height
  const Picture picture = draw_picture(square.body(), {}, options);
  ASSERT_EQ(picture.rgb.size(), 3u * 120 * 80);
  const Rgb middle = pixel(picture, 60, 43);
  EXPECT_GT(middle.b, middle.r + 20);  // light blue
  int blue_rows = 0;
  for (int y = 0; y < 80; ++y) blue_rows += pixel(picture, 61, y).b > pixel(picture, 61, y).r + 20 ? 1 : 0;
  EXPECT_NEAR(blue_rows, 80 / 1.1, 3);
  const Rgb corner = pixel(picture, 2, 2);
  EXPECT_LT(std::abs(corner.b - corner.r), 20);  // the grey stage
}

TEST(Picture, IsStoppedAtAnyMoment) {
  const Square square;
  PictureOptions options = small();
  const Picture whole = draw_picture(square.body(), {}, options);
  std::atomic<int> asked = 0;
  options.stop = [&] { return ++asked < 0; };
  EXPECT_EQ(draw_picture(square.body(), {}, options).rgb, whole.rgb);
  const int often = asked;
  EXPECT_GT(often, 80);
  for (const int last : {1, 50, 100, often / 2, often - 1}) {
    asked = 0;
    options.stop = [&] { return ++asked >= last; };
    EXPECT_EQ(draw_picture(square.body(), {}, options).rgb.size(), whole.rgb.size());
    EXPECT_LT(asked, last + 64) << "threads that ask at once hear of it";
  }
}

TEST(Picture, CutSurfacesLookDifferent) {
  Square square;
  square.wall = {1, 1};
  PictureOptions options = small();
  options.direction = {0, -0.01, 1};
  const Rgb middle = pixel(draw_picture(square.body(), {}, options), 60, 43);
  EXPECT_GT(middle.r, middle.b + 20);  // orange
}

TEST(Picture, NearerTrianglesHideFartherOnes) {
  Square lower;
  Square upper = lower;
  for (Vec3 p : upper.positions) lower.positions.push_back(p + Vec3{0, 0, 0.2});
  lower.triangles.push_back({4, 5, 6});
  lower.triangles.push_back({4, 6, 7});
  for (bool wall_above : {false, true}) {
    const std::uint8_t a = wall_above ? 0 : 1, b = wall_above ? 1 : 0;
    lower.wall = {a, a, b, b};
    PictureOptions options = small();
    options.direction = {0, -0.01, 1};
    const Rgb middle = pixel(draw_picture(lower.body(), {}, options), 60, 43);
    EXPECT_EQ(middle.r > middle.b, wall_above);
  }
}

TEST(Picture, TheBodyThrowsAShadow) {
  Square square;
  for (Vec3& p : square.positions) p.z = 0.5 + (p.x > 0 ? 0.3 : 0);
  square.positions.push_back({3, 3, 0});  // the lowest point, far away, carries the ground down
  square.triangles.push_back({4, 4, 4});
  PictureOptions options = small(160, 120);
  options.zoom = 1;
  const Picture with = draw_picture(square.body(), {}, options);
  square.triangles = {{4, 4, 4}};
  const Picture without = draw_picture(square.body(), {}, options);
  int darker = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const Rgb a = pixel(with, x, y), b = pixel(without, x, y);
      if (std::abs(a.b - a.r) < 12 && a.r < b.r - 25) ++darker;  // grey, but darker than the empty stage
    }
  }
  EXPECT_GT(darker, 30);
}

TEST(Picture, LinesAreHiddenByTheBody) {
  const Square square;
  PictureOptions options = small();
  options.direction = {0, -0.01, 1};
  const Vec3f red{1, 0, 0};
  const std::vector<PictureLine> above{{{-0.3, 0.02, 0.01}, {0.3, 0.02, 0.01}, red, 3, 1}};
  const std::vector<PictureLine> below{{{-0.3, 0.02, -0.1}, {0.3, 0.02, -0.1}, red, 3, 1}};
  const auto red_pixels = [&](std::span<const PictureLine> lines) {
    const Picture picture = draw_picture(square.body(), lines, options);
    int n = 0;
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 120; ++x) n += pixel(picture, x, y).r > 200 && pixel(picture, x, y).b < 100 ? 1 : 0;
    }
    return n;
  };
  EXPECT_GT(red_pixels(above), 60);
  EXPECT_EQ(red_pixels(below), 0);
}

TEST(Picture, SameBytesWithAnyNumberOfThreads) {
  const Result<Model> model = make_model("steak", {});
  ASSERT_TRUE(model.ok());
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (const auto& t : model->visual.triangles) triangles.push_back({t[0].value, t[1].value, t[2].value});
  const std::vector<Vec3>& p = model->visual.positions.raw();
  const PictureBody body{p, p, triangles, {}, Look::kMeat};
  std::vector<std::uint8_t> first;
  for (int threads : {1, 4}) {
    const ThreadLimit limit(threads);
    const Picture picture = draw_picture(body, {}, small(160, 100));
    if (first.empty()) first = picture.rgb;
    EXPECT_TRUE(picture.rgb == first);
  }
}

TEST(Picture, EmptyBodiesGiveAnEmptyStage) {
  const Picture picture = draw_picture({}, {}, small());
  EXPECT_EQ(picture.rgb.size(), 3u * 120 * 80);
}

TEST(Picture, EdgesAreDrawnOnce) {
  const Square square;
  EXPECT_EQ(triangle_edges(square.positions, square.triangles, {0, 0, 0}, 1, 1).size(), 5u);
  std::vector<Vec3> corners;
  for (int c = 0; c < 8; ++c) corners.push_back({double(c & 1), double(c >> 1 & 1), double(c >> 2 & 1)});
  const std::vector<std::array<std::int32_t, 8>> hexahedra{{0, 1, 2, 3, 4, 5, 6, 7}};
  const std::vector<PictureLine> lines = hexahedron_edges(corners, hexahedra, 1, 1);
  ASSERT_EQ(lines.size(), 12u);
  for (const PictureLine& line : lines) EXPECT_NEAR(norm(line.b - line.a), 0.96, 1e-12);  // edges, not diagonals
}

}  // namespace
}  // namespace kerf::picture_test
