#include "command_replay.h"

#include <fmt/format.h>

#include "exit_status.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/session/recording.h"
#include "progress_bar.h"
#include "score_line.h"

namespace kerf::app {

int replay_file(const ReplayOptions& options) {
  auto text = read_whole_file(options.file);
  if (!text) return report(text.error());
  auto recording = parse_recording(text->view(), options.file);
  if (!recording) return report(recording.error());
  Result<ReplayReport> played = [&] {
    ProgressBar bar(options.quiet);
    return replay(*recording, bar.callback());
  }();
  if (!played) return report(played.error());
  if (played->first_difference >= 0) {
    fmt::print(stderr, "kerf: the replay differs from the recording at step {} of {} (or in the {} steps before it)\n",
               played->first_difference, recording->last_step, kHashEvery);
    if (recording->instructions != instruction_set())
      fmt::print(stderr, "kerf: it was recorded with {}, this program uses {}\n", recording->instructions, instruction_set());
    return kRunFailed;
  }
  if (!options.quiet)
    fmt::print("{}: {} steps, {} changes, {} hashes: the same bits\n", options.file, played->steps, recording->changes.size(),
               played->hashes);
  if (!options.quiet && played->score) fmt::print("  {}\n", score_line(*played->score));
  return kSuccess;
}

}  // namespace kerf::app
