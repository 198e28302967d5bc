#include "result_folder.h"

#include <algorithm>
#include <exception>
#include <memory>

#include "exit_status.h"
#include "folder.h"
#include "kerf/record/run_outputs.h"

namespace kerf::app {
namespace {

/// Bytes that are kept for the report of a run that runs out of memory: many times what its first keys and their file take. At half
/// there is still room; at double nothing changes.
constexpr std::size_t kReportMemory = std::size_t{1} << 20;

/// Memory for the report of work that runs out of it.
class KeptMemory {
 public:
  KeptMemory() : bytes_(new volatile char[kReportMemory]) {
    bytes_[0] = 0;  // else a compiler may leave it out
  }
  void give() { bytes_.reset(); }

 private:
  std::unique_ptr<volatile char[]> bytes_;
};

std::string report_in(const std::filesystem::path& folder) { return (folder / "report.json").string(); }

/// Names of results, and of those that an earlier run has left.
std::vector<std::string> with_earlier(std::vector<std::string> files, const std::vector<std::string>& earlier) {
  for (const std::string& name : earlier)
    if (std::find(files.begin(), files.end(), name) == files.end()) files.push_back(name);
  return files;
}

std::string reason_of(const std::exception& error) {
  const char* lacks = what_lacks(error);
  return lacks ? lacks : error.what();
}

Status write_report(const ReportedWork& what, const RunState& state) {
  return replace_file(report_in(what.folder), run_report_json(what.session, what.log, state));
}

/// The report comes first and names what is still there of an earlier run, too: killed at any moment, it says so, and the next run knows
/// what to remove.
Status begin_report(const ReportedWork& what) {
  const std::vector<std::string> earlier = earlier_results(what.folder);
  KERF_TRY(write_report(what, {RunState::Status::kRunning, {}, with_earlier(what.files, earlier)}));
  return remove_results(what.folder, earlier, what.files, what.inputs);
}

Status end_report(const ReportedWork& what, const Status& done) {
  if (done) return write_report(what, {RunState::Status::kComplete, {}, what.files});
  return write_report(what, {RunState::Status::kFailed, done.error().message, what.files});
}

/// First the keys for which little memory is enough: without any, the program may end while a half-made report is taken apart.
void tell_failure(const ReportedWork& what, const std::string& why) {
  const RunState state{RunState::Status::kFailed, why, what.files};
  if (const Status told = replace_file(report_in(what.folder), short_report_json(what.session, state)); !told) return;
  (void)write_report(what, state);
}

}  // namespace

Result<FolderLock> take_result_folder(const std::filesystem::path& folder) {
  KERF_TRY(make_folder(folder));
  return FolderLock::take(folder.string());
}

Status prepare_reported(const PreparedWork& what, const std::function<Status()>& prepare) {
  KeptMemory kept;
  RunState state{RunState::Status::kFailed, {}, with_earlier(what.files, earlier_results(what.folder))};
  const auto tell = [&](const std::string& why) {
    kept.give();
    state.reason = why;
    if (const Status told = replace_file(report_in(what.folder), short_report_json(what.scene, state)); !told)
      (void)report(told.error());
  };
  try {
    Status done = prepare();
    if (!done && done.error().kind == ErrorKind::kFailed) tell(done.error().message);
    return done;
  } catch (const std::exception& error) {
    tell(reason_of(error));
    throw;
  }
}

int work_reported(const ReportedWork& what, const std::function<Status()>& work) {
  KeptMemory kept;
  Status done;
  try {
    done = begin_report(what);
    if (done) done = work();
    kept.give();
    const Status told = end_report(what, done);
    const int status = done ? kSuccess : report(done.error());
    if (told || (!done && told.error().message == done.error().message)) return status;
    const int untold = report(told.error());
    return done ? untold : status;
  } catch (const std::exception& error) {
    kept.give();
    tell_failure(what, !done ? done.error().message : reason_of(error));
    throw;
  }
}

}  // namespace kerf::app
