#include "kerf/picture/session_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "kerf/scene/scene_file.h"

namespace kerf::session_picture_test {
namespace {

Session session_of(const std::string& text) {
  auto scene = parse_scene(text, "scene", {});
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  auto session = Session::create(*scene);
  EXPECT_TRUE(session.ok()) << session.error().message;
  return std::move(*session);
}

struct Seen {
  std::vector<std::uint8_t> rgb;
  std::vector<float> depth;
  bool operator==(const Seen&) const = default;
};
Seen look_at(SessionPainter& painter, Session& session, const PictureView& view, int width, int height) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  Seen seen;
  seen.rgb.resize(3 * pixels);
  seen.depth.resize(pixels);
  painter.draw_quickly(session, view, {width, height, seen.rgb, seen.depth});
  return seen;
}

SessionPainter painter_of(const Session& session) {
  auto painter = SessionPainter::create(session);
  EXPECT_TRUE(painter.ok());
  return std::move(*painter);
}

/// First and last column and row where something is.
struct Extent {
  int left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;
};
Extent extent_of(const Seen& seen, int width) {
  Extent out;
  for (std::size_t i = 0; i < seen.depth.size(); ++i) {
    if (!std::isfinite(seen.depth[i])) continue;
    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    out.left = std::min(out.left, x), out.right = std::max(out.right, x);
    out.top = std::min(out.top, y), out.bottom = std::max(out.bottom, y);
  }
  return out;
}

TEST(SessionPicture, TheFittedViewHasTheWholeBodyInTheMiddle) {
  Session session = session_of("[body]\nmodel = \"sheet\"\n");
  SessionPainter painter = painter_of(session);
  for (const auto& [width, height] : {std::pair{320, 200}, std::pair{200, 320}, std::pair{64, 64}}) {
    const PictureView view = painter.fitted_view(session, {}, width, height);
    ASSERT_TRUE(check_view(view).ok());
    const Extent e = extent_of(look_at(painter, session, view, width, height), width);
    const double wide = (e.right - e.left + 1.0) / width, high = (e.bottom - e.top + 1.0) / height;
    EXPECT_NEAR(std::max(wide, high), 1 / 1.1, 0.05) << width;  // the margin of a scene's camera
    EXPECT_NEAR((e.left + e.right + 1) / 2.0, width / 2.0, 0.04 * width);
    EXPECT_NEAR((e.top + e.bottom + 1) / 2.0, height / 2.0, 0.04 * height);
  }
}

TEST(SessionPicture, StatesHaveTheirPictures) {
  Session session = session_of("[body]\nmodel = \"steak\"\n");
  SessionPainter painter = painter_of(session);
  const PictureView view = painter.fitted_view(session, {}, 120, 90);
  const Seen before = look_at(painter, session, view, 120, 90);
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  ASSERT_TRUE(session.move_blade({0, -0.10, 0.05}, {0, -0.10, -0.05}).ok());
  ASSERT_TRUE(session.move_blade({0, 0.12, 0.05}, {0, 0.12, -0.05}).ok());
  ASSERT_TRUE(session.end_stroke().ok());
  ASSERT_TRUE(session.step(40).ok());
  const Seen after = look_at(painter, session, view, 120, 90);
  EXPECT_FALSE(after == before);
  SessionPainter other = painter_of(session);
  EXPECT_TRUE(look_at(other, session, view, 120, 90) == after);
  ASSERT_TRUE(session.undo().ok());
  EXPECT_TRUE(look_at(painter, session, view, 120, 90) == before);
}

TEST(SessionPicture, ObstaclesToolsAndGroundAreThere) {
  const std::string body = "[body]\nmodel = \"sheet\"\n";
  const std::string more =
      "[[obstacle]]\nshape = \"plane\"\nposition = [0, 0, -0.5]\n"
      "[[obstacle]]\nshape = \"sphere\"\nradius = 0.3\nposition = [0, 0, 1]\n"
      "[[tool]]\nid = \"probe\"\nkind = \"probe\"\nposition = [0, 0, 2]\n";
  Session plain = session_of(body), full = session_of(body + more);
  SessionPainter plain_painter = painter_of(plain), full_painter = painter_of(full);
  const PictureView down{{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 0.6};
  const int n = 101;
  const Seen a = look_at(plain_painter, plain, down, n, n), b = look_at(full_painter, full, down, n, n);
  const std::size_t corner = 0, middle = 50 * n + 50, beside = 50 * n + 54;  // 4 pixels of 31 mm at the sheet
  EXPECT_FALSE(std::isfinite(a.depth[corner]));
  EXPECT_NEAR(b.depth[corner], 5.5, 1e-5);
  EXPECT_NEAR(a.depth[beside], 5, 0.1);
  const double focal = n / 2.0 / std::tan(0.3), tangent = 4 / focal;  // of the ray beside
  const double k = 1 + tangent * tangent, sphere = (4 - std::sqrt(16 - k * (16 - 0.09))) / k;
  EXPECT_NEAR(b.depth[beside], sphere, 0.02);
  EXPECT_LT(b.depth[middle], 3.2);  // the probe, before all else
}

TEST(SessionPicture, TheDrawnPictureTakesTheSameView) {
  Session session = session_of("[body]\nmodel = \"sheet\"\n");
  SessionPainter painter = painter_of(session);
  SceneOutput output;
  output.picture_size = {60, 40};
  const PictureView view = painter.fitted_view(session, output.camera, 60, 40);
  const Picture by_scene = painter.draw(session, output), by_view = painter.draw(session, output, view);
  int unlike = 0;
  for (std::size_t i = 0; i < by_scene.rgb.size(); ++i)
    unlike += std::abs(int{by_scene.rgb[i]} - int{by_view.rgb[i]}) > 2 ? 1 : 0;
  EXPECT_LT(unlike, 72);  // of 7200
}

}  // namespace
}  // namespace kerf::session_picture_test
