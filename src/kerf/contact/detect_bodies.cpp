// Bodies against each other and against themselves.
#include <algorithm>
#include <utility>

#include "kerf/contact/body_pair.h"

namespace kerf {
namespace {

/// What has strayed towards each other by less than this part of the margin was seen coming.
constexpr double kForeseen = 0.5;

}  // namespace

void detect_bodies(DetectRun& run, std::int32_t first, std::int32_t second) {
  const BodyView a = view(run, first), b = view(run, second);
  const bool self = first == second;
  const double sway_a = self ? a.frame.greatest_sway : a.frame.greatest_travel;
  const double sway_b = self ? sway_a : b.frame.greatest_travel;
  const double reach = a.frame.greatest_offset + b.frame.greatest_offset + run.margin + kApproach * (sway_a + sway_b);
  const double approach = run.margin + kApproach * (sway_a + sway_b);
  find_leaf_pairs(a, b, reach, approach, run.scratch);
  const Strayed* strayed = self ? run.options.strayed : nullptr;
  if (strayed != nullptr) leave_out_foreseen(a, *strayed, kForeseen * run.margin, run.scratch);
  QuietBody* quiet = self && strayed == nullptr ? &run.scratch.quiet[static_cast<std::size_t>(first)] : nullptr;
  if (quiet != nullptr) follow_body(a, run.scratch.leaf_pairs, run.before, *quiet);
  std::array<std::array<LipEnd, 2>, 2> lip_ends;
  const BodyPair pair{run, a, b, self, sway_b, quiet, lip_ends};
  if (run.scratch.leaf_pairs.empty()) return;
  search_vertices(pair);
  search_edges(pair, reach, approach);
  if (self) return;
  for (auto& [leaf, other] : run.scratch.leaf_pairs) std::swap(leaf, other);
  std::sort(run.scratch.leaf_pairs.begin(), run.scratch.leaf_pairs.end(), by_first);
  search_vertices({run, b, a, false, sway_a, nullptr, lip_ends});
}

}  // namespace kerf
