// kerf replay: a recording again, bit for bit.
#pragma once

#include <string>

namespace kerf::app {

struct ReplayOptions {
  std::string file;
  bool quiet = false;
};

int replay_file(const ReplayOptions& options);

}  // namespace kerf::app
