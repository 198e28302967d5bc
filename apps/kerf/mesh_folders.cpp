#include "mesh_folders.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>

namespace kerf::app {

std::vector<std::filesystem::path> mesh_folders(const std::vector<std::string>& given) {
  std::vector<std::string> names = given;
  if (const char* list = std::getenv("KERF_MESHES")) {
    std::string_view rest = list;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(':'), rest.size());
      if (end > 0) names.emplace_back(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  std::vector<std::filesystem::path> out;
  for (const std::string& name : names) {
    std::error_code code;
    const std::filesystem::path whole = std::filesystem::absolute(name, code);
    out.push_back(code ? std::filesystem::path(name) : whole);
  }
  return out;
}

}  // namespace kerf::app
