#include "plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace kerf::app::plot_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Plot plot_of(std::vector<Vec2> points) {
  Plot plot;
  plot.title = "a < b & c";
  plot.x_label = "time (s)";
  plot.lines.push_back({"first", std::move(points), false, ""});
  return plot;
}

TEST(Plot, PointsLandWhereTheAxesSay) {
  Plot plot = plot_of({{0, 0}, {10, 5}});
  plot.title.clear();
  plot.width = 298, plot.height = 276;  // axes: 74 to 274 and 220 to 20: 20 pixels a unit across, 40 up
  const std::string svg = plot_svg(plot);
  EXPECT_THAT(svg, HasSubstr("M74.0 220.0L274.0 20.0\""));
  EXPECT_THAT(svg, HasSubstr(">10</text>"));
  EXPECT_THAT(svg, HasSubstr(">5</text>"));
}

TEST(Plot, WordsAreEscaped) { EXPECT_THAT(plot_svg(plot_of({{0, 1}})), HasSubstr("a &lt; b &amp; c")); }

TEST(Plot, GapsBreakTheLine) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string svg = plot_svg(plot_of({{0, 1}, {1, 1}, {2, nan}, {3, 1}, {4, 1}}));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  const std::size_t path = svg.find("stroke-width=\"1.8\"");
  ASSERT_NE(path, std::string::npos);
  const std::string line = svg.substr(svg.rfind("<path", path), path - svg.rfind("<path", path));
  EXPECT_EQ(std::count(line.begin(), line.end(), 'M'), 2);
}

TEST(Plot, LogarithmicAxesLeaveOutZero) {
  Plot plot = plot_of({{1, 0}, {10, 1}, {1000, 100}});
  plot.log_x = plot.log_y = true;
  const std::string svg = plot_svg(plot);
  EXPECT_THAT(svg, HasSubstr(">1000</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(Plot, NothingAndOnePointAndConstants) {
  for (const std::vector<Vec2>& points : {std::vector<Vec2>{}, std::vector<Vec2>{{3, 3}},
                                          std::vector<Vec2>{{1, 0}, {2, 0}}, std::vector<Vec2>{{1, -4}, {2, -4}}}) {
    const std::string svg = plot_svg(plot_of(points));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
    EXPECT_THAT(svg, HasSubstr("</svg>"));
  }
}

}  // namespace
}  // namespace kerf::app::plot_test
