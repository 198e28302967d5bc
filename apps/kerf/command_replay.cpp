#include "command_replay.h"

#include <fmt/format.h>

#include <optional>

#include "exit_status.h"
#include "kerf/base/shown_text.h"
#include "kerf/record/recording.h"
#include "mesh_folders.h"
#include "progress_bar.h"
#include "score_line.h"
#include "terminal.h"

namespace kerf::app {
namespace {

/// Repeats one recording and says how it went; an exit status.
int play(const std::string& file, const Recording& recording, const ReplayOptions& options,
         std::optional<TrainerScore>& score) {
  Result<ReplayReport> played = [&] {
    ProgressBar bar(options.quiet);
    return replay(recording, bar.callback(), mesh_folders(options.meshes), file);
  }();
  if (!played) {
    Error why = played.error();
    if (const std::string name = shown(file); why.message.find(name) == std::string::npos)
      why.message = name + ": " + why.message;
    return report(why);
  }
  score = played->score;
  const std::size_t changes = recording.changes.size(), done = changes - played->refused;
  if (played->refused > 0)
    warn("kerf: {}: {} of {} changes {} refused and not done; the first is {}\n", file, played->refused, changes,
         played->refused == 1 ? "was" : "were", played->first_refused);
  if (played->first_difference >= 0) {
    warn("kerf: the replay of {} differs from the recording at step {} of {} (or in the {} steps before it)\n", file,
         played->first_difference, recording.last_step, kHashEvery);
    if (recording.instructions != instruction_set())
      warn("kerf: it was recorded with {}, this program uses {}\n", recording.instructions, instruction_set());
    return kRunFailed;
  }
  if (options.quiet) return kSuccess;
  const std::string of_all = done == changes ? std::string() : fmt::format(" of {}", changes);
  say("{}: {} steps, {}{} changes, {} hashes: the same bits\n", file, played->steps, done, of_all, played->hashes);
  if (played->score) say("  {}\n", score_line(*played->score));
  return kSuccess;
}

void print_difference(const RecordingDifference& d, const ReplayOptions& options) {
  if (d.none()) {
    say("The recordings are the same: every change, {} hashes and the end.\n", d.common_hashes);
    return;
  }
  for (const std::string& what : d.settings) say("different from the start: {}\n", what);
  if (d.first_change >= 0) {
    say("first change that differs, at step {}:\n  {}: {}\n  {}: {}\n", d.first_change, options.file, d.change_a,
        options.compare, d.change_b);
  } else {
    say("every change is the same\n");
  }
  if (d.first_hash >= 0) {
    say("first state that differs: after step {} (or in the {} steps before it)\n", d.first_hash, kHashEvery);
  } else {
    say("{} states after the same steps are the same; the end is {}\n", d.common_hashes,
        d.same_end ? "the same" : "another");
  }
}

void print_scores(const std::optional<TrainerScore>& a, const std::optional<TrainerScore>& b) {
  if (!a && !b) return;
  const auto row = [&](const char* name, const char* unit, auto value) {
    const auto cell = [&](const std::optional<TrainerScore>& s) {
      return s ? fmt::format("{:.4g} {}", value(*s), unit) : std::string("-");
    };
    say("  {:<24}{:>16}{:>16}\n", name, cell(a), cell(b));
  };
  say("score\n");
  row("lesion removed", "%", [](const TrainerScore& s) { return 100 * s.lesion_removed; });
  row("healthy tissue removed", "mm3", [](const TrainerScore& s) { return 1e9 * s.healthy_removed; });
  row("remaining roughness", "mm", [](const TrainerScore& s) { return 1e3 * s.roughness; });
  row("largest force", "N", [](const TrainerScore& s) { return s.largest_force; });
  row("loose pieces left", "", [](const TrainerScore& s) { return static_cast<double>(s.loose_pieces); });
  row("time", "s", [](const TrainerScore& s) { return s.time; });
}

}  // namespace

int replay_file(const ReplayOptions& options) {
  const auto recording = read_recording(options.file);
  if (!recording) return report(recording.error());
  std::optional<TrainerScore> score;
  if (options.compare.empty()) return play(options.file, *recording, options, score);
  const auto other = read_recording(options.compare);
  if (!other) return report(other.error());
  std::optional<TrainerScore> other_score;
  const int first = play(options.file, *recording, options, score);
  if (first == kBadInput) return first;
  const int second = play(options.compare, *other, options, other_score);
  if (second == kBadInput) return second;
  print_difference(compare(*recording, *other), options);
  print_scores(score, other_score);
  return first != kSuccess ? first : second;
}

}  // namespace kerf::app
