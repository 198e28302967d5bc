#include "kerf/scene/temporary_folder.h"

#include "kerf/mesh/whole_file.h"

#ifdef KERF_FILES_IN_MEMORY

namespace kerf {

/// Nobody else has files here: a number that was not given yet makes a name.
Result<TemporaryFolder> TemporaryFolder::create() {
  static int given = 0;
  return TemporaryFolder("/tmp/" + std::to_string(++given), -1);
}

TemporaryFolder::~TemporaryFolder() {
  if (!path_.empty()) remove_folder(path_.string());
}

}  // namespace kerf

#else

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>  // NOLINT: mkdtemp is POSIX
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>

namespace kerf {
namespace {

/// Long enough to be nobody else's: folders of this name are removed.
constexpr std::string_view kPrefix = "kerf-temporary-";
/// A new folder that another program takes for one that is left over is given up for the next. At 1 two programs that start at once can
/// refuse each other.
constexpr int kMostTries = 100;

/// Locks a folder of this user's. < 0: it is not there any more, is no such folder, or another program has it (errno).
int lock_folder(const std::string& path) {
  const int folder = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder < 0) return -1;
  struct stat held {
  }, there{};
  int error = ::flock(folder, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
  if (error == 0 && (::fstat(folder, &held) != 0 || ::stat(path.c_str(), &there) != 0)) error = errno;
  if (error == 0 && (held.st_ino != there.st_ino || held.st_dev != there.st_dev)) error = ENOENT;  // removed meanwhile
  if (error == 0 && held.st_uid != ::geteuid()) error = EPERM;
  if (error == 0) return folder;
  ::close(folder);
  errno = error;
  return -1;
}

void remove_left_over(const std::filesystem::path& where) {
  std::error_code code;
  for (auto it = std::filesystem::directory_iterator(where, code); !code && it != std::filesystem::directory_iterator();
       it.increment(code)) {
    if (!it->path().filename().string().starts_with(kPrefix)) continue;
    const int lock = lock_folder(it->path().string());
    if (lock < 0) continue;
    std::error_code ignored;
    std::filesystem::remove_all(it->path(), ignored);
    ::close(lock);
  }
}

bool taken(int error) { return error == ENOENT || error == EWOULDBLOCK; }

}  // namespace

Result<TemporaryFolder> TemporaryFolder::create() {
  std::error_code code;
  const std::filesystem::path where = std::filesystem::temp_directory_path(code);
  if (code) return failed("there is no folder for temporary files; set TMPDIR to one");
  remove_left_over(where);
  for (int i = 0; i < kMostTries; ++i) {
    std::string pattern = (where / kPrefix).string() + "XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) break;
    const int lock = lock_folder(pattern);
    if (lock >= 0) return TemporaryFolder(std::filesystem::path(pattern), lock);
    if (taken(errno)) continue;
    const int error = errno;
    ::rmdir(pattern.c_str());
    errno = error;
    break;
  }
  return failed(
      fmt::format("can't make a folder in {} ({}); set TMPDIR to another", where.string(), std::strerror(errno)));
}

TemporaryFolder::~TemporaryFolder() {
  if (!path_.empty()) remove_folder(path_.string());
  if (lock_ >= 0) ::close(lock_);
}

}  // namespace kerf

#endif
