#include "progress_bar.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace kerf::app {
namespace {

constexpr auto kPatience = std::chrono::milliseconds(400);  // shorter stages show nothing
constexpr auto kRedraw = std::chrono::milliseconds(80);
constexpr double kPlainShare = 0.25;  // without a terminal: a line every quarter
constexpr int kStageWidth = 24;

int terminal_width() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

std::string time_text(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  return fmt::format("{:.0f} min {:02.0f} s", seconds / 60 - 0.5, seconds - 60 * static_cast<int>(seconds / 60));
}

}  // namespace

ProgressBar::ProgressBar(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() { clear(); }

Progress ProgressBar::callback() {
  return [this](std::string_view stage, double fraction) { update(stage, fraction); };
}

void ProgressBar::clear() {
  if (!drawn_) return;
  std::fputs("\r\x1b[K", stderr);
  drawn_ = false;
}

void ProgressBar::update(std::string_view stage, double fraction) {
  if (quiet_) return;
  const Clock::time_point now = Clock::now();
  if (stage != stage_) {
    clear();
    stage_ = stage;
    stage_start_ = last_drawn_ = now;
    lines_ = 0;
  }
  if (now - stage_start_ < kPatience) return;
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (!terminal_) {
    if (fraction < kPlainShare * lines_ && fraction < 1) return;
    if (fraction < 1 || lines_ > 0) std::fprintf(stderr, "%s: %.0f %%\n", stage_.c_str(), 100 * fraction);
    lines_ = static_cast<int>(fraction / kPlainShare) + 1;
    if (fraction >= 1) lines_ = 1 << 20;
    return;
  }
  if (fraction >= 1) return clear();
  if (drawn_ && now - last_drawn_ < kRedraw) return;
  last_drawn_ = now;
  draw(fraction);
}

void ProgressBar::draw(double fraction) {
  const double elapsed = seconds_since(stage_start_);
  const std::string left = fraction > 0.02 ? time_text(elapsed * (1 - fraction) / fraction) + " left" : "";
  const int bar_width = std::clamp(terminal_width() - kStageWidth - 28, 8, 60);
  const int full = static_cast<int>(fraction * bar_width);
  std::string line = fmt::format("\r{:<{}.{}} [", stage_, kStageWidth, kStageWidth);
  line.append(static_cast<std::size_t>(full), '#');
  line.append(static_cast<std::size_t>(bar_width - full), '.');
  line += fmt::format("] {:3.0f} %  {}\x1b[K", 100 * fraction, left);
  std::fputs(line.c_str(), stderr);
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace kerf::app
