#include "kerf/scene/temporary_folder.h"

#include <fmt/format.h>
#include <stdlib.h>  // NOLINT: mkdtemp is POSIX

#include <cerrno>
#include <cstring>

namespace kerf {

Result<TemporaryFolder> TemporaryFolder::create() {
  std::error_code code;
  const std::filesystem::path where = std::filesystem::temp_directory_path(code);
  if (code) return failed("there is no folder for temporary files; set TMPDIR to one");
  std::string pattern = (where / "kerf-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr)
    return failed(
        fmt::format("can't make a folder in {} ({}); set TMPDIR to another", where.string(), std::strerror(errno)));
  return TemporaryFolder(std::filesystem::path(pattern));
}

TemporaryFolder::~TemporaryFolder() {
  if (path_.empty()) return;
  std::error_code code;
  std::filesystem::remove_all(path_, code);
}

}  // namespace kerf
