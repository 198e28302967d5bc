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

std::string report_file(const ReportedWork& what) { return (what.folder / "report.json").string(); }

Status write_report(const ReportedWork& what, const RunState& state) {
  return replace_file(report_file(what), run_report_json(what.session, what.log, state));
}

/// The report comes first and names what is still there of an earlier run, too: killed at any moment, it says so, and the next run knows
/// what to remove.
Status begin_report(const ReportedWork& what) {
  const std::vector<std::string> earlier = earlier_results(what.folder);
  RunState state{RunState::Status::kRunning, {}, what.files};
  for (const std::string& name : earlier)
    if (std::find(state.files.begin(), state.files.end(), name) == state.files.end()) state.files.push_back(name);
  KERF_TRY(write_report(what, state));
  return remove_results(what.folder, earlier, what.files, what.inputs);
}

Status end_report(const ReportedWork& what, const Status& done) {
  if (done) return write_report(what, {RunState::Status::kComplete, {}, what.files});
  return write_report(what, {RunState::Status::kFailed, done.error().message, what.files});
}

/// First the keys for which little memory is enough: without any, the program may end while a half-made report is taken apart.
void tell_failure(const ReportedWork& what, const std::string& why) {
  const RunState state{RunState::Status::kFailed, why, what.files};
  if (const Status told = replace_file(report_file(what), short_report_json(what.session, state)); !told) return;
  (void)write_report(what, state);
}

}  // namespace

Result<FolderLock> take_result_folder(const std::filesystem::path& folder) {
  KERF_TRY(make_folder(folder));
  return FolderLock::take(folder.string());
}

int work_reported(const ReportedWork& what, const std::function<Status()>& work) {
  std::unique_ptr<volatile char[]> kept(new volatile char[kReportMemory]);
  kept[0] = 0;  // else a compiler may leave it out
  Status done;
  try {
    done = begin_report(what);
    if (done) done = work();
    kept.reset();
    const Status told = end_report(what, done);
    const int status = done ? kSuccess : report(done.error());
    if (told || (!done && told.error().message == done.error().message)) return status;
    const int untold = report(told.error());
    return done ? untold : status;
  } catch (const std::exception& error) {
    kept.reset();
    const char* lacks = what_lacks(error);
    tell_failure(what, !done ? done.error().message : lacks ? lacks : error.what());
    throw;
  }
}

}  // namespace kerf::app
