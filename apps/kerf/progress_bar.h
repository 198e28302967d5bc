// Progress of long work on stderr: a bar on a terminal, a few plain lines otherwise, nothing for short work.
#pragma once

#include <string>

#include "kerf/base/progress.h"
#include "kerf/base/stopwatch.h"

namespace kerf::app {

class ProgressBar {
 public:
  /// quiet: show nothing at all.
  explicit ProgressBar(bool quiet = false);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// To hand to the library; valid as long as this object.
  [[nodiscard]] Progress callback();
  /// Takes the bar off the screen, so that other text can be printed; it comes back with the next update.
  void clear();

 private:
  void update(std::string_view stage, double fraction);
  void draw(double fraction);

  bool quiet_;
  bool terminal_;
  bool drawn_ = false;
  std::string stage_;
  Clock::time_point stage_start_;
  Clock::time_point last_drawn_;
  int lines_ = 0;  ///< plain lines printed in this stage
};

}  // namespace kerf::app
