// kerf replay: a recording again, bit for bit.
#pragma once

#include <string>
#include <vector>

namespace kerf::app {

struct ReplayOptions {
  std::string file;
  std::string compare;              ///< another recording; empty: none
  std::vector<std::string> meshes;  ///< folders with meshes that were too large to travel
  bool quiet = false;
};

int replay_file(const ReplayOptions& options);

}  // namespace kerf::app
