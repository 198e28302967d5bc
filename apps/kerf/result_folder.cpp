#include "result_folder.h"

#include <algorithm>
#include <exception>

#include "exit_status.h"
#include "folder.h"
#include "kerf/record/run_outputs.h"

namespace kerf::app {
namespace {

Status write_report(const ReportedWork& what, const RunState& state) {
  return replace_file((what.folder / "report.json").string(), run_report_json(what.session, what.log, state));
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

}  // namespace

Result<FolderLock> take_result_folder(const std::filesystem::path& folder) {
  KERF_TRY(make_folder(folder));
  return FolderLock::take(folder.string());
}

int work_reported(const ReportedWork& what, const std::function<Status()>& work) {
  Status done;
  try {
    done = begin_report(what);
    if (done) done = work();
  } catch (const std::exception& error) {
    const char* lacks = what_lacks(error);
    (void)end_report(what, failed(lacks ? lacks : error.what()));
    throw;
  }
  const Status told = end_report(what, done);
  const int status = done ? kSuccess : report(done.error());
  if (told || (!done && told.error().message == done.error().message)) return status;
  const int untold = report(told.error());
  return done ? untold : status;
}

}  // namespace kerf::app
