#include "plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "kerf/mesh/whole_file.h"

namespace kerf::app {
namespace {

constexpr std::string_view kPalette[] = {"#0072b2", "#d55e00", "#009e73",
                                         "#cc79a7", "#e69f00", "#56b4e9"};  // Okabe and Ito

std::string escaped(std::string_view text) {
  std::string out;
  for (char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

/// One axis: from values to pixels.
struct Axis {
  bool log = false;
  double low = 0, high = 1;   ///< in log10 when log
  double start = 0, end = 1;  ///< pixels
  std::vector<double> ticks;  ///< values

  [[nodiscard]] bool shows(double x) const { return std::isfinite(x) && (!log || x > 0); }
  [[nodiscard]] double scaled(double x) const { return log ? std::log10(x) : x; }
  [[nodiscard]] double at(double x) const { return start + (scaled(x) - low) / (high - low) * (end - start); }

  void fit(std::vector<double> values, bool from_zero) {
    values.erase(std::remove_if(values.begin(), values.end(), [&](double x) { return !shows(x); }), values.end());
    if (!values.empty()) {
      low = high = scaled(values.front());
      for (double x : values) low = std::min(low, scaled(x)), high = std::max(high, scaled(x));
    }
    if (from_zero && !log) low = std::min(low, 0.0), high = std::max(high, 0.0);
    if (!(high > low)) {
      const double pad = low == 0 || log ? 1 : 0.1 * std::abs(low);
      high += pad;
      if (!from_zero || low != 0) low -= pad;
    }
    if (log) {
      low = std::floor(low), high = std::ceil(high);
      const double step = std::max(1.0, std::ceil((high - low) / 8));
      for (double t = low; t <= high + 1e-9; t += step) ticks.push_back(std::pow(10, t));
      return;
    }
    // A step of 1, 2 or 5 times a power of ten that gives four to eight ticks.
    const double raw = (high - low) / 6, power = std::pow(10, std::floor(std::log10(raw))), part = raw / power;
    const double step = power * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
    low = step * std::floor(low / step + 1e-9);
    high = step * std::ceil(high / step - 1e-9);
    for (int i = 0; low + i * step <= high + 1e-9 * step; ++i) {
      const double t = low + i * step;
      ticks.push_back(std::abs(t) < 1e-9 * step ? 0 : t);
    }
  }
};

std::string tick_text(double x) { return fmt::format("{:.6g}", x); }

}  // namespace

std::string plot_svg(const Plot& plot) {
  Axis x, y;
  x.log = plot.log_x;
  y.log = plot.log_y;
  std::vector<double> xs, ys;
  for (const PlotLine& line : plot.lines) {
    for (Vec2 p : line.points) {
      if (x.shows(p.x) && y.shows(p.y)) xs.push_back(p.x), ys.push_back(p.y);
    }
  }
  x.fit(std::move(xs), false);
  y.fit(std::move(ys), plot.from_zero);
  x.start = 74, x.end = plot.width - 24;
  y.start = plot.height - 56, y.end = plot.title.empty() ? 20 : 46;

  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      plot.width, plot.height);
  for (double t : x.ticks) {
    out += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" stroke=\"#e4e4e4\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"middle\" fill=\"#444\">{4}</text>\n",
        x.at(t), y.start, y.end, y.start + 18, tick_text(t));
  }
  for (double t : y.ticks) {
    out += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}H{2:.1f}\" stroke=\"#e4e4e4\"/><text x=\"{3:.1f}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\" fill=\"#444\">{5}</text>\n",
        x.start, y.at(t), x.end, x.start - 8, y.at(t) + 4, tick_text(t));
  }
  out += fmt::format("<path d=\"M{:.1f} {:.1f}V{:.1f}H{:.1f}\" fill=\"none\" stroke=\"#444\"/>\n", x.start, y.end,
                     y.start, x.end);
  if (!plot.title.empty()) {
    out +=
        fmt::format("<text x=\"{}\" y=\"24\" font-size=\"16\" fill=\"#111\">{}</text>\n", x.start, escaped(plot.title));
  }
  out += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\" fill=\"#222\">{}</text>\n",
                     0.5 * (x.start + x.end), plot.height - 14, escaped(plot.x_label));
  out += fmt::format(
      "<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\" fill=\"#222\">{}</text>\n",
      0.5 * (y.start + y.end), escaped(plot.y_label));

  for (std::size_t i = 0; i < plot.lines.size(); ++i) {
    const PlotLine& line = plot.lines[i];
    const std::string color = line.color.empty() ? std::string(kPalette[i % std::size(kPalette)]) : escaped(line.color);
    std::string path;
    bool pen = false;
    for (Vec2 p : line.points) {
      if (!x.shows(p.x) || !y.shows(p.y)) {
        pen = false;
        continue;
      }
      path += fmt::format("{}{:.1f} {:.1f}", pen ? "L" : "M", x.at(p.x), y.at(p.y));
      pen = true;
    }
    if (!path.empty())
      out += fmt::format(
          "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\" stroke-linejoin=\"round\"/>\n", path, color);
    if (line.markers) {
      for (Vec2 p : line.points) {
        if (x.shows(p.x) && y.shows(p.y))
          out +=
              fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", x.at(p.x), y.at(p.y), color);
      }
    }
    if (!line.name.empty()) {
      const double row = y.end + 14 + 18 * static_cast<double>(i);
      out += fmt::format(
          "<path d=\"M{:.1f} {:.1f}h22\" stroke=\"{}\" stroke-width=\"3\"/><text x=\"{:.1f}\" y=\"{:.1f}\" "
          "fill=\"#222\">{}</text>\n",
          x.start + 14, row - 4, color, x.start + 44, row, escaped(line.name));
    }
  }
  return out + "</svg>\n";
}

Status write_svg(const std::filesystem::path& file, const Plot& plot) {
  return replace_file(file.string(), plot_svg(plot));
}

}  // namespace kerf::app
