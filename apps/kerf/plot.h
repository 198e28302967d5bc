// Line plots as SVG, for reports and the documentation.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/base/vec.h"

namespace kerf::app {

struct PlotLine {
  std::string name;
  std::vector<Vec2> points;  ///< in the order of drawing; points that are not finite break the line
  bool markers = false;      ///< a dot at every point
  std::string color;         ///< "#rrggbb"; empty: the next of a palette that the colour-blind can tell apart
};

struct Plot {
  std::string title, x_label, y_label;
  std::vector<PlotLine> lines;
  bool log_x = false, log_y = false;  ///< values <= 0 are left out
  bool from_zero = true;              ///< the y axis starts at 0 (not with log_y)
  int width = 720, height = 420;      ///< pixels
};

/// The plot as an SVG file's text: axes with round numbers, grid, legend. Plots without points get empty
/// axes.
std::string plot_svg(const Plot& plot);

Status write_svg(const std::filesystem::path& file, const Plot& plot);

}  // namespace kerf::app
