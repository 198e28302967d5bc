#ifndef KERF_FILES_IN_MEMORY  // else memory_files.cpp has these functions

#include "kerf/mesh/whole_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <limits.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "kerf/base/byte_count.h"
#include "kerf/base/hash.h"
#include "kerf/base/shown_text.h"

namespace kerf {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;  // writes of a megabyte keep system calls rare

constexpr std::size_t kPieceBytes = std::size_t{64} << 20;  // of one read

struct Descriptor {
  int value = -1;
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

std::string parent_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

constexpr int kMostLinks = 40;         // as many as the kernel follows
constexpr int kMostWriters = 1000;     // of one file at a time
constexpr int kRememberedWriters = 8;  // as many places are looked at for what killed ones left

/// The place that a path leads to over symbolic links, there or not. 0, or an error number.
int follow_links(std::string& path) {
  for (int i = 0; i < kMostLinks; ++i) {
    char target[PATH_MAX];
    const ssize_t n = ::readlink(path.c_str(), target, sizeof target);
    if (n < 0) return errno == EINVAL || errno == ENOENT ? 0 : errno;  // no link, or nothing there yet
    const std::string to(target, static_cast<std::size_t>(n));
    path = to.starts_with('/') || path.find('/') == std::string::npos ? to : fmt::format("{}/{}", parent_of(path), to);
  }
  return ELOOP;
}

constexpr long kLongestName = 255;  // bytes that every common disk takes; some say more, as they count letters

/// Bytes that a name in this folder may have.
std::size_t longest_name(const std::string& folder) {
  const long said = ::pathconf(folder.c_str(), _PC_NAME_MAX);
  return static_cast<std::size_t>(said > 0 ? std::min(said, kLongestName) : kLongestName);
}

constexpr std::string_view kUnfinished = ".kerf.part-";

/// The name of a temporary file beside a file. Where that is longer than names may be, the end of the file's own name is left out, and a
/// hash of it takes its place.
std::string temporary_name(const std::string& path, std::string_view number) {
  const std::string folder = parent_of(path);
  const std::size_t slash = path.rfind('/'), start = slash == std::string::npos ? 0 : slash + 1;
  const std::string_view name = std::string_view(path).substr(start);
  const std::string ending = fmt::format("{}{}", kUnfinished, number);
  const std::size_t most = longest_name(folder);
  if (name.size() + ending.size() <= most) return path + ending;
  Hash hash;
  hash.add_bytes(name.data(), name.size());
  const std::string mark = fmt::format("-{:016x}", hash.value());
  std::size_t kept = most - std::min(most, mark.size() + ending.size());
  while (kept > 0 && (static_cast<unsigned char>(name[kept]) & 0xC0) == 0x80) --kept;  // letters stay whole
  return fmt::format("{}{}{}{}", path.substr(0, start), name.substr(0, kept), mark, ending);
}
std::string temporary_name(const std::string& path, int number) { return temporary_name(path, fmt::to_string(number)); }

/// Does another writer, living or dead, have what could not be opened, so that the next number is to be tried?
bool taken(int error_number) { return error_number == EEXIST || error_number == EACCES || error_number == ELOOP; }
/// Not every disk of a network has locks.
bool no_locks(int error_number) {
  return error_number == ENOLCK || error_number == EOPNOTSUPP || error_number == ENOSYS;
}

/// Opens a temporary file and makes it this writer's own for as long as it is open: a lock goes with its process, so
/// that what a killed one left is free. -1: it is another's, or can't be had (errno).
int own(const std::string& path, int flags) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | flags, 0666);
  if (file < 0) return -1;
  struct stat opened {
  }, named{};
  int why = EEXIST;
  if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) why = errno;
    if (no_locks(why)) ::unlink(path.c_str());  // nobody works here by locks
  } else if (::fstat(file, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 && opened.st_ino == named.st_ino &&
             opened.st_dev == named.st_dev && S_ISREG(opened.st_mode)) {
    return file;
  }  // else its owner has renamed it meanwhile: it is a finished file
  ::close(file);
  errno = why;
  return -1;
}

/// Removes what killed writers of a file left. `mine` is the number of this writer: on disks of a network its lock holds off other processes alone.
void remove_unfinished(const std::string& path, int mine) {
  for (int i = 0; i < kRememberedWriters; ++i) {
    if (i == mine) continue;
    const std::string left = temporary_name(path, i);
    if (const Descriptor file{own(left, 0)}; file.value >= 0) ::unlink(left.c_str());
  }
}

/// Is it the machine that has no room, for this user or at all?
bool is_full(int error_number) { return error_number == ENOSPC || error_number == EDQUOT || error_number == EFBIG; }

/// Waits until what was written lies on the disk. 0, or an error number. Pipes, devices and some disks of a network can't be asked.
int wait_for_disk(int descriptor) {
  while (::fsync(descriptor) != 0) {
    if (errno == EINVAL || errno == EROFS || errno == ENOTSUP || errno == ENOSYS) return 0;
    if (errno != EINTR) return errno;
  }
  return 0;
}

/// Is it a pipe with a name on the disk (mkfifo)? Those that a shell makes (/dev/stdout, /dev/fd/63) are not.
bool is_named_pipe(std::string path) {
  struct stat info {};
  if (path.starts_with("/dev/") || path.starts_with("/proc/") || follow_links(path) != 0) return false;
  return !path.starts_with("/dev/") && !path.starts_with("/proc/") && ::lstat(path.c_str(), &info) == 0 &&
         S_ISFIFO(info.st_mode);
}

/// Where a name leads over links, without `..`; of folders that are not there yet the names count. Empty: nowhere.
std::string place_of(std::string path) {
  std::error_code code;
  if (follow_links(path) != 0) return {};
  const std::filesystem::path place = std::filesystem::weakly_canonical(std::filesystem::absolute(path, code), code);
  return code ? std::string() : place.string();
}

/// Is the file there, or will the name lead to one that is, once the folders in it are made ("new/../a")?
bool is_found(const std::string& path, const std::string& place, struct stat& info) {
  return ::stat(path.c_str(), &info) == 0 || (!place.empty() && ::stat(place.c_str(), &info) == 0);
}

struct OpenFile {
  int descriptor;
  const std::string& path;
};

/// Reads on from a byte of a file until all of `to` is filled or the file ends. How many bytes were read.
Result<std::size_t> read_up_to(OpenFile file, std::size_t from, std::span<char> to) {
  std::size_t size = 0;
  while (size < to.size()) {
    const ssize_t got = ::read(file.descriptor, to.data() + size, std::min(kPieceBytes, to.size() - size));
    if (got == 0) break;
    if (got > 0) {
      size += static_cast<std::size_t>(got);
    } else if (errno != EINTR) {
      return bad_input(fmt::format("{}: reading stopped at byte {} ({}); check the disk", shown(file.path), from + size,
                                   std::strerror(errno)));
    }
  }
  return size;
}

}  // namespace

Error too_little_memory(const std::string& path) {
  return bad_input(path +
                   ": not enough memory to read it; give a smaller file, or let the program have more (ulimit -v)");
}

Result<FileBytes> read_whole_file(const std::string& path, const FileKind& kind) {
  if (path.empty()) return bad_input(fmt::format("no file name given; name the file of {}", kind.what));
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.value < 0) {
    if (errno == ENOENT) return bad_input(fmt::format("{}: no such file; check the path", shown(path)));
    if (errno == ELOOP)
      return bad_input(fmt::format("{}: its symbolic links lead round in a circle; name a file", shown(path)));
    if (errno == ENAMETOOLONG)
      return bad_input(fmt::format("{}: the name is too long for a file; check the path", shown(path)));
    return bad_input(fmt::format("{}: can't be opened ({}); check its permissions", shown(path), std::strerror(errno)));
  }
  struct stat info {};
  if (::fstat(file.value, &info) != 0) {
    return bad_input(fmt::format("{}: can't be read ({}); check the path", shown(path), std::strerror(errno)));
  }
  if (S_ISDIR(info.st_mode)) return bad_input(fmt::format("{}: is a folder; name a file in it", shown(path)));
  if (!S_ISREG(info.st_mode)) {
    return bad_input(fmt::format("{}: is not a regular file; save the data to a file first", shown(path)));
  }
  if (info.st_size == 0) return bad_input(fmt::format("{}: the file is empty; write it again", shown(path)));

  const auto size = static_cast<std::size_t>(info.st_size);
  if (size > kind.most)
    return bad_input(fmt::format("{}: the file has {}, {} has {} at most; {}", shown(path), bytes_text(size), kind.what,
                                 bytes_text(kind.most), kind.otherwise));

  const OpenFile open{file.value, path};
  char first[kFirstBytes];
  std::size_t looked_at = 0;
  if (kind.look) {
    const auto got = read_up_to(open, 0, {first, std::min(size, kFirstBytes)});
    if (!got) return got.error();
    looked_at = *got;
    KERF_TRY(kind.look({first, looked_at}, path));
  }
  // Memory that is not written to is not taken: a file that is shorter than it says costs what it has.
  FileBytes bytes;
  bytes.data.reset(new (std::nothrow) char[size]);
  if (!bytes.data) return too_little_memory(path);
  std::copy_n(first, looked_at, bytes.data.get());
  const auto rest = read_up_to(open, looked_at, {bytes.data.get() + looked_at, size - looked_at});
  if (!rest) return rest.error();
  bytes.size = looked_at + *rest;
  return bytes;
}

bool is_there(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0;
}

bool is_regular_file(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode);
}

void remove_unfinished(const std::string& path) { remove_unfinished(path, -1); }

std::string_view name_of_unfinished(std::string_view name) {
  const std::size_t at = name.rfind(kUnfinished);
  return at == std::string_view::npos ? std::string_view() : name.substr(0, at);
}

ReplacingFile::ReplacingFile(std::string path) : path_(std::move(path)) {
  if (path_.empty()) {
    fail(ENOENT);
    return;
  }
  struct stat info {};
  if (::stat(path_.c_str(), &info) == 0 && !S_ISREG(info.st_mode)) {
    if (S_ISDIR(info.st_mode)) {
      fail(EISDIR);
      return;
    }
    if (is_named_pipe(path_)) {  // it would be waited for until somebody reads
      error_number_ = ESPIPE;
      failure_ =
          fmt::format("{}: is a pipe, not a regular file; choose another name, or write to /dev/stdout", shown(path_));
      return;
    }
    open_.descriptor = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);  // a device must not be renamed over
    if (open_.descriptor < 0) fail(errno);
    return;
  }
  // A new file takes the place of the old one: what may not be written is the folder.
  const auto fail_in_folder = [&](int error) {
    fail(error);
    if (error == EACCES || error == EPERM || error == EROFS)
      failure_ =
          fmt::format("{}: can't be written, because the folder {} takes no new files ({}); check its permissions",
                      shown(path_), shown(parent_of(path_)), std::strerror(error));
  };
  std::string target = path_;
  if (const int error = follow_links(target); error != 0) {
    fail_in_folder(error);
    return;
  }
  path_ = target;
  int number = 0;
  for (; number < kMostWriters; ++number) {
    open_.temporary = temporary_name(path_, number);
    open_.descriptor = own(open_.temporary, O_CREAT);
    if (open_.descriptor >= 0 || !taken(errno)) break;
  }
  if (open_.descriptor < 0 && no_locks(errno)) {
    open_.temporary = temporary_name(path_, fmt::format("{}-0", ::getpid()));
    open_.descriptor = ::open(open_.temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  }
  if (open_.descriptor < 0) {
    const int error = errno;
    open_.temporary.clear();
    fail_in_folder(error);
    return;
  }
  if (::ftruncate(open_.descriptor, 0) != 0) fail(errno);
  remove_unfinished(path_, number);
}

ReplacingFile::Open::~Open() {
  if (descriptor < 0) return;
  if (!temporary.empty()) ::unlink(temporary.c_str());  // while it is still this writer's own
  ::close(descriptor);
}

void ReplacingFile::fail(int error_number) {
  if (!failure_.empty()) return;
  error_number_ = error_number;
  if (path_.empty()) {
    failure_ = "no file name given; name the file to write";
  } else if (error_number == ENOENT || error_number == ENOTDIR) {
    failure_ = fmt::format("{}: can't be written, because {} is not a folder; make it first", shown(path_),
                           shown(parent_of(path_)));
  } else if (error_number == EISDIR) {
    failure_ = fmt::format("{}: is a folder; name a file in it", shown(path_));
  } else if (error_number == ELOOP) {
    failure_ = fmt::format("{}: its symbolic links lead round in a circle; name a file", shown(path_));
  } else if (error_number == ENAMETOOLONG) {
    failure_ = fmt::format("{}: the name is too long for this disk; choose a shorter one", shown(path_));
  } else {
    failure_ = fmt::format("{}: can't be written ({}); check permissions and free space", shown(path_),
                           std::strerror(error_number));
  }
}

void ReplacingFile::write(std::string_view bytes) {
  if (!failure_.empty()) return;
  buffer_.append(bytes);
  if (buffer_.size() >= kBufferBytes) flush();
}

void ReplacingFile::flush() {
  std::size_t done = 0;
  while (failure_.empty() && done < buffer_.size()) {
    const ssize_t put = ::write(open_.descriptor, buffer_.data() + done, buffer_.size() - done);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return fail(errno);
    done += static_cast<std::size_t>(put);
  }
  buffer_.clear();
}

Status ReplacingFile::commit() {
  flush();
  // The data goes before the name: a name that outlived a power cut without its data would be an empty file.
  if (failure_.empty())
    if (const int error = wait_for_disk(open_.descriptor); error != 0) fail(error);
  // Some disks say only on closing that they are full. A second descriptor is closed: the lock goes with the first, and the
  // file must be this writer's own until it has its name.
  if (const int second = open_.descriptor >= 0 ? ::dup(open_.descriptor) : -1; second >= 0 && ::close(second) != 0)
    fail(errno);
  const bool renames = !open_.temporary.empty();
  if (failure_.empty() && renames) {
    if (::rename(open_.temporary.c_str(), path_.c_str()) != 0) {
      fail(errno);
    } else {
      open_.temporary.clear();
    }
  }
  if (failure_.empty() && ::close(std::exchange(open_.descriptor, -1)) != 0) fail(errno);
  if (!failure_.empty()) return failed(failure_);
  return renames ? keep_names(parent_of(path_)) : Status{};
}

Status check_can_be_written(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0 && S_ISFIFO(info.st_mode) && !is_named_pipe(path))
    return {};  // whoever reads it would see it end
  ReplacingFile file(path);
  // A full disk makes files, but takes no byte of them. A device gets none.
  const std::size_t bytes = file.open_.temporary.empty() ? 0 : 1;
  if (file.open_.descriptor >= 0 && ::write(file.open_.descriptor, "", bytes) < 0) file.fail(errno);
  if (file.failure_.empty()) return {};
  return is_full(file.error_number_) ? failed(file.failure_) : bad_input(file.failure_);
}

bool same_file(const std::string& a, const std::string& b) {
  const std::string places[] = {place_of(a), place_of(b)};
  struct stat one {
  }, other{};
  const bool there = is_found(a, places[0], one);
  if (there != is_found(b, places[1], other)) return false;
  if (there) return S_ISREG(one.st_mode) && one.st_dev == other.st_dev && one.st_ino == other.st_ino;
  return !places[0].empty() && places[0] == places[1];
}

Result<FolderLock> FolderLock::take(const std::string& folder) {
  FolderLock lock;
  lock.descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock.descriptor_ < 0 || ::flock(lock.descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
    return Result<FolderLock>(std::move(lock));
  return bad_input(fmt::format(
      "{}: another program is writing its results there; wait for its end, or choose another folder", shown(folder)));
}

FolderLock::FolderLock(FolderLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Status keep_names(const std::string& folder) {
  const Descriptor open{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  const int error = open.value < 0 ? 0 : wait_for_disk(open.value);  // a folder that may not be listed can't be asked
  if (error == 0) return {};
  return failed(fmt::format("{}: the names of new files there may not last ({}); check the disk", shown(folder),
                            std::strerror(error)));
}

ComparedFile::ComparedFile(const std::string& path)
    : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)), same_(descriptor_ >= 0) {}

ComparedFile::~ComparedFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void ComparedFile::write(std::string_view bytes) {
  std::vector<char> there(std::min(bytes.size(), kBufferBytes));
  while (same_ && !bytes.empty()) {
    const ssize_t got = ::read(descriptor_, there.data(), std::min(bytes.size(), there.size()));
    if (got < 0 && errno == EINTR) continue;
    same_ = got > 0 && bytes.starts_with(std::string_view(there.data(), static_cast<std::size_t>(got)));
    if (same_) bytes.remove_prefix(static_cast<std::size_t>(got));
  }
}

bool ComparedFile::is_same() {
  char more = 0;
  while (same_) {
    const ssize_t got = ::read(descriptor_, &more, 1);
    if (got == 0) break;
    same_ = got < 0 && errno == EINTR;
  }
  return same_;
}

Status replace_file(const std::string& path, std::string_view bytes) {
  ReplacingFile file(path);
  file.write(bytes);
  return file.commit();
}

void remove_folder(const std::string& folder) {
  std::error_code code;
  std::filesystem::remove_all(folder, code);
}

}  // namespace kerf

#endif
