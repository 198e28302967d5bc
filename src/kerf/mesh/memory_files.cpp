#ifdef KERF_FILES_IN_MEMORY  // else whole_file.cpp has these functions

#include "kerf/mesh/memory_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "kerf/base/byte_count.h"
#include "kerf/base/shown_text.h"
#include "kerf/mesh/whole_file.h"

namespace kerf {
namespace {

std::map<std::string, std::string>& files() {
  static std::map<std::string, std::string> all;
  return all;
}

}  // namespace

void put_memory_file(const std::string& path, std::string_view bytes) { files()[path] = bytes; }
void remove_memory_file(const std::string& path) { files().erase(path); }

Error too_little_memory(const std::string& path) {
  return bad_input(path + ": not enough memory to read it; give a smaller file");
}

bool is_there(const std::string& path) { return files().count(path) > 0; }
bool is_regular_file(const std::string& path) { return is_there(path); }

Result<FileBytes> read_whole_file(const std::string& path, const FileKind& kind) {
  if (path.empty()) return bad_input(fmt::format("no file name given; name the file of {}", kind.what));
  const auto found = files().find(path);
  if (found == files().end()) return bad_input(fmt::format("{}: no such file; check the path", shown(path)));
  const std::string& there = found->second;
  if (there.empty()) return bad_input(fmt::format("{}: the file is empty; write it again", shown(path)));
  if (there.size() > kind.most)
    return bad_input(fmt::format("{}: the file has {}, {} has {} at most; {}", shown(path), bytes_text(there.size()),
                                 kind.what, bytes_text(kind.most), kind.otherwise));
  if (kind.look) KERF_TRY(kind.look(std::string_view(there).substr(0, kFirstBytes), path));
  FileBytes bytes;
  bytes.data.reset(new (std::nothrow) char[there.size()]);
  if (!bytes.data) return too_little_memory(path);
  std::copy(there.begin(), there.end(), bytes.data.get());
  bytes.size = there.size();
  return bytes;
}

ReplacingFile::Open::~Open() = default;
ReplacingFile::ReplacingFile(std::string path) : path_(std::move(path)) {
  if (path_.empty()) failure_ = "no file name given";
}
void ReplacingFile::write(std::string_view bytes) { buffer_ += bytes; }
Status ReplacingFile::commit() {
  if (!failure_.empty()) return failed(failure_);
  files()[path_] = std::move(buffer_);
  return {};
}

Status check_can_be_written(const std::string& path) {
  return path.empty() ? Status(bad_input("no file name given")) : Status{};
}
bool same_file(const std::string& a, const std::string& b) { return a == b; }

// Nobody else writes here, and nothing is ever half written.
void remove_unfinished(const std::string& /*path*/) {}
std::string_view name_of_unfinished(std::string_view /*name*/) { return {}; }
Result<FolderLock> FolderLock::take(const std::string& /*folder*/) { return Result<FolderLock>(FolderLock()); }
FolderLock::FolderLock(FolderLock&& /*other*/) noexcept {}
FolderLock::~FolderLock() = default;
Status keep_names(const std::string& /*folder*/) { return {}; }

Status replace_file(const std::string& path, std::string_view bytes) {
  put_memory_file(path, bytes);
  return {};
}

void remove_folder(const std::string& folder) {
  const std::string begin = folder + "/";
  std::erase_if(files(), [&](const auto& file) { return file.first.starts_with(begin); });
}

}  // namespace kerf

#endif
