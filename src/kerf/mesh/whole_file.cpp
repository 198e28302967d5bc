#include "kerf/mesh/whole_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

namespace kerf {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;  // writes of a megabyte keep system calls rare

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

}  // namespace

Result<FileBytes> read_whole_file(const std::string& path) {
  if (path.empty()) return bad_input("no file name given; name a mesh file");
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.value < 0) {
    if (errno == ENOENT) return bad_input(fmt::format("{}: no such file; check the path", path));
    return bad_input(
        fmt::format("{}: can't be opened ({}); check its permissions", path, std::strerror(errno)));
  }
  struct stat info {};
  if (::fstat(file.value, &info) != 0) {
    return bad_input(fmt::format("{}: can't be read ({}); check the path", path, std::strerror(errno)));
  }
  if (S_ISDIR(info.st_mode)) return bad_input(fmt::format("{}: is a folder; name a file in it", path));
  if (!S_ISREG(info.st_mode)) {
    return bad_input(fmt::format("{}: is not a regular file; save the data to a file first", path));
  }
  if (info.st_size == 0) return bad_input(fmt::format("{}: the file is empty; write it again", path));

  FileBytes bytes;
  const auto size = static_cast<std::size_t>(info.st_size);
  bytes.data = std::make_unique_for_overwrite<char[]>(size);
  while (bytes.size < size) {
    const ssize_t got = ::read(file.value, bytes.data.get() + bytes.size, size - bytes.size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      return bad_input(fmt::format("{}: reading stopped at byte {} ({}); check the disk", path, bytes.size,
                                   std::strerror(errno)));
    }
    if (got == 0) break;  // the file shrank meanwhile: what is there decides
    bytes.size += static_cast<std::size_t>(got);
  }
  return bytes;
}

ReplacingFile::ReplacingFile(std::string path) : path_(std::move(path)) {
  struct stat info {};
  if (::stat(path_.c_str(), &info) == 0 && !S_ISREG(info.st_mode)) {
    if (S_ISDIR(info.st_mode)) {
      fail(EISDIR);
      return;
    }
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);  // a device must not be renamed over
    if (descriptor_ < 0) fail(errno);
    return;
  }
  for (int attempt = 0; attempt < 1000; ++attempt) {
    temporary_ = fmt::format("{}.part-{}-{}", path_, ::getpid(), attempt);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0 || errno != EEXIST) break;
  }
  if (descriptor_ < 0) {
    temporary_.clear();
    fail(errno);
  }
}

ReplacingFile::~ReplacingFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void ReplacingFile::fail(int error_number) {
  if (!failure_.empty()) return;
  if (error_number == ENOENT || error_number == ENOTDIR) {
    failure_ = fmt::format("{}: can't be written, because {} is not a folder; make it first", path_,
                           parent_of(path_));
  } else if (error_number == EISDIR) {
    failure_ = fmt::format("{}: is a folder; name a file in it", path_);
  } else {
    failure_ = fmt::format("{}: can't be written ({}); check permissions and free space", path_,
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
    const ssize_t put = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return fail(errno);
    done += static_cast<std::size_t>(put);
  }
  buffer_.clear();
}

Status ReplacingFile::commit() {
  flush();
  if (descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0) fail(errno);
  if (failure_.empty() && !temporary_.empty()) {
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) {
      fail(errno);
    } else {
      temporary_.clear();
    }
  }
  if (!failure_.empty()) return failed(failure_);
  return {};
}

Status replace_file(const std::string& path, std::string_view bytes) {
  ReplacingFile file(path);
  file.write(bytes);
  return file.commit();
}

}  // namespace kerf
