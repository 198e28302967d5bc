// Two recordings side by side.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "kerf/record/recording.h"

namespace kerf {
namespace {

bool same(const SessionChange& a, const SessionChange& b) {
  return a.step == b.step && a.kind == b.kind && a.id == b.id && a.vertices == b.vertices && a.values == b.values;
}

/// "blade at step 120 (0.1, 0.2, ...)".
std::string words(const std::vector<SessionChange>& changes, std::size_t i) {
  if (i >= changes.size()) return "nothing more";
  const SessionChange& c = changes[i];
  constexpr std::size_t kShown = 6;
  std::string out = fmt::format("{} at step {}", change_word(c.kind), c.step);
  if (!c.id.empty()) out += fmt::format(" of \"{}\"", c.id);
  if (!c.vertices.empty()) out += fmt::format(" [{}]", fmt::join(c.vertices, ", "));
  if (c.values.empty()) return out;
  const std::vector<double> first(c.values.begin(),
                                  c.values.begin() + static_cast<std::ptrdiff_t>(std::min(kShown, c.values.size())));
  return out + fmt::format(" ({:.6g}{})", fmt::join(first, ", "), c.values.size() > kShown ? ", ..." : "");
}

bool same_meshes(const SceneSource& a, const SceneSource& b) {
  const auto equal = [](const SceneSource::Mesh& x, const SceneSource::Mesh& y) {
    return x.written == y.written && x.bytes == y.bytes && x.hash == y.hash;
  };
  const auto equal_file = [](const SceneSource::File& x, const SceneSource::File& y) {
    return x.name == y.name && x.bytes == y.bytes;
  };
  return std::equal(a.meshes.begin(), a.meshes.end(), b.meshes.begin(), b.meshes.end(), equal) &&
         std::equal(a.files.begin(), a.files.end(), b.files.begin(), b.files.end(), equal_file);
}

}  // namespace

RecordingDifference compare(const Recording& a, const Recording& b) {
  RecordingDifference d;
  if (a.source.text != b.source.text)
    d.settings.push_back(a.source.name == b.source.name
                             ? "the text of the scene"
                             : fmt::format("the scene: {} and {}", a.source.name, b.source.name));
  if (!same_meshes(a.source, b.source)) d.settings.emplace_back("the mesh files");
  if (a.overrides.scripted != b.overrides.scripted) d.settings.emplace_back("whether the scene's own commands run");
  if (a.overrides.time_step != b.overrides.time_step)
    d.settings.push_back(
        fmt::format("the time step: {} and {} s (0: the scene's)", a.overrides.time_step, b.overrides.time_step));
  if (a.overrides.dust != b.overrides.dust) d.settings.emplace_back("what is swept up as dust");
  if (a.instructions != b.instructions)
    d.settings.push_back(fmt::format("the instruction set: {} and {}", a.instructions, b.instructions));

  const std::size_t n = std::min(a.changes.size(), b.changes.size());
  std::size_t i = 0;
  while (i < n && same(a.changes[i], b.changes[i])) ++i;
  if (i < std::max(a.changes.size(), b.changes.size())) {
    d.change_a = words(a.changes, i);
    d.change_b = words(b.changes, i);
    d.first_change = std::min(i < a.changes.size() ? a.changes[i].step : a.last_step,
                              i < b.changes.size() ? b.changes[i].step : b.last_step);
  }
  for (std::size_t x = 0, y = 0; x < a.hashes.size() && y < b.hashes.size();) {
    if (a.hashes[x].step != b.hashes[y].step) {
      ++(a.hashes[x].step < b.hashes[y].step ? x : y);
      continue;
    }
    ++d.common_hashes;
    if (d.first_hash < 0 && a.hashes[x].hash != b.hashes[y].hash) d.first_hash = a.hashes[x].step;
    ++x;
    ++y;
  }
  d.same_end = a.last_step == b.last_step && a.end_hash == b.end_hash;
  return d;
}

}  // namespace kerf
