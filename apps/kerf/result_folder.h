// The folder that a command leaves its results in: one command at a time, and a report that says how it is getting on.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/run_report.h"

namespace kerf::app {

/// Makes the folder, and takes it for as long as the lock lives. Bad input: it can't be made, or another command writes there.
Result<FolderLock> take_result_folder(const std::filesystem::path& folder);

/// What report.json tells of before there is a session.
struct PreparedWork {
  const Scene& scene;
  const std::filesystem::path& folder;
  std::vector<std::string> files;  ///< names of the results, the report among them
};

/// Makes ready what the work needs. Bad input leaves the folder as it is. What else goes wrong, exceptions too, makes a report that says
/// "failed". It names what is still there of an earlier run. Exceptions go on to main().
Status prepare_reported(const PreparedWork& what, const std::function<Status()>& prepare);

/// What report.json tells of.
struct ReportedWork {
  const Session& session;
  const RunLog& log;
  const std::filesystem::path& folder;
  std::vector<std::string> files;             ///< names of the results, the report among them
  std::vector<std::filesystem::path> inputs;  ///< not to be removed
};

/// Does the work between the report that says "running" and the one that says "complete" or "failed". What an earlier run has left and this
/// one does not write anew goes before. Exceptions go on to main(); the report has them, too. Returns the exit status; errors are printed.
int work_reported(const ReportedWork& what, const std::function<Status()>& work);

}  // namespace kerf::app
