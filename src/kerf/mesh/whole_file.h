// Files read in one go, and files replaced in one go: a killed run or a power cut leaves the old file or the new one.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <string>
#include <string_view>

#include "kerf/base/result.h"
#include "kerf/mesh/file_limits.h"

namespace kerf {

/// The bytes of a file, not initialised twice and never copied.
struct FileBytes {
  std::unique_ptr<char[]> data;
  std::size_t size = 0;
  [[nodiscard]] std::string_view view() const { return {data.get(), size}; }
};

/// Reads a regular file. Missing, unreadable, a directory, empty, larger than its kind may be, or with first bytes of another kind: an
/// Error that names the path. Size and first bytes are looked at before memory is taken for the rest; a file that grows meanwhile is read
/// as far as it reached.
Result<FileBytes> read_whole_file(const std::string& path, const FileKind& kind);

/// Does a name lead to anything, and to a regular file? Symbolic links are followed.
bool is_there(const std::string& path);
bool is_regular_file(const std::string& path);

/// What is said where memory ends while a file is read.
Error too_little_memory(const std::string& path);

/// Calls what reads a file and makes a value of it. Out of memory: bad input that names the file.
template <class F>
auto within_memory(const std::string& path, F&& read) -> decltype(read()) {
  try {
    return read();
  } catch (const std::bad_alloc&) {
    return too_little_memory(path);
  }
}

/// Collects what is written in a temporary file beside the target; commit() renames it over the target.
/// Without commit() nothing of the target changes. After commit() the new file lasts: it is on its disk, and so is its name. Symbolic links stay: what they lead to is replaced. Devices, and pipes that a
/// shell made, are written in place. Pipes with a name on the disk are refused. What killed writers of the same file left beside it is removed, what living ones have is not.
/// Not copyable.
class ReplacingFile {
 public:
  explicit ReplacingFile(std::string path);
  ReplacingFile(const ReplacingFile&) = delete;
  ReplacingFile& operator=(const ReplacingFile&) = delete;

  /// Appends bytes; the first failure is kept and returned by commit().
  void write(std::string_view bytes);
  /// Puts the new file in place of the old one, on the disk. Call once. Failure: the old file is still there, or the new one is and its
  /// name may not last. Cost: two waits for the disk, a few ms each.
  Status commit();

 private:
  friend Status check_can_be_written(const std::string& path);
  void flush();
  void fail(int error_number);

  /// What is open goes with it, also where the constructor throws.
  struct Open {
    ~Open();
    std::string temporary;  ///< empty: written in place
    int descriptor = -1;
  };

  std::string path_;
  Open open_;
  std::string buffer_;
  std::string failure_;
  int error_number_ = 0;  ///< of failure_
};

/// Removes the temporary files that killed writers of a file left beside it. Those of living ones stay.
void remove_unfinished(const std::string& path);

/// The name of the file that a temporary one was to become: "a.obj" of "a.obj.kerf.part-0". Empty: it is none. A name of nearly as many bytes as the
/// disk takes is shortened.
std::string_view name_of_unfinished(std::string_view name);

/// Could a file be written there? Leaves nothing. To be asked before long work whose result goes there. Bad input: a folder,
/// a name that can't be, no permission; failure: a disk that is full.
Status check_can_be_written(const std::string& path);

/// Do two names lead to one file: the same on its disk, or, where nothing is yet, one place in one folder? Symbolic links are followed.
/// Devices and pipes keep nothing that could be lost: never.
bool same_file(const std::string& a, const std::string& b);

/// A folder that one program writes its results to at a time. The lock is on the folder itself: nothing of it lies there, and it goes
/// with its process, however that ends.
class FolderLock {
 public:
  /// Bad input: another program has it. Disks of a network that lock no folders, and folders that can't be opened, are everybody's.
  static Result<FolderLock> take(const std::string& folder);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  FolderLock() = default;
  int descriptor_ = -1;
};

/// Names made, changed or removed in a folder last once this returns. Failure: the disk says that they may not. Disks and folders that
/// can't be asked are no failure.
Status keep_names(const std::string& folder);

/// Compares bytes as they would be written with those that a file has. Not copyable.
class ComparedFile {
 public:
  explicit ComparedFile(const std::string& path);
  ComparedFile(const ComparedFile&) = delete;
  ComparedFile& operator=(const ComparedFile&) = delete;
  ~ComparedFile();

  /// Compares on from where the last call ended.
  void write(std::string_view bytes);
  /// Has the file all that was written, and no more? A file that can't be read has other bytes. Call once.
  [[nodiscard]] bool is_same();

 private:
  int descriptor_ = -1;
  bool same_ = true;
};

/// Replaces a file by these bytes.
Status replace_file(const std::string& path, std::string_view bytes);

/// Removes a folder with all that it holds; what can't be removed stays.
void remove_folder(const std::string& folder);

}  // namespace kerf
