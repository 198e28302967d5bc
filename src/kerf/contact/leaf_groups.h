// Leaves that come near each other, by the first of each pair: how its vertices or edges find those of the second leaves that they have to be tested with.
// Quiet ones (quiet.h) need few.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/contact/body_pair.h"

namespace kerf {

/// Pairs with the same first leaf; and, of a body with itself, what it has followed so far.
struct LeafGroup {
  std::span<const LeafPair> pairs;
  std::span<const QuietBody::Followed> followed;
  std::span<const std::uint8_t> fresh;  ///< of these
  bool any_fresh = true;
};

/// Calls visit(group) for all pairs.
template <class Visit>
void for_each_group(const BodyPair& pair, Visit&& visit) {
  const std::span<const LeafPair> pairs = pair.run.scratch.leaf_pairs;
  std::size_t at = 0;
  for (std::size_t i = 0; i < pairs.size();) {
    const std::uint32_t leaf = pairs[i][0];
    std::size_t end = i + 1;
    while (end < pairs.size() && pairs[end][0] == leaf) ++end;
    LeafGroup group{pairs.subspan(i, end - i), {}, {}};
    if (pair.quiet != nullptr) {
      QuietBody& quiet = *pair.quiet;
      const std::span<const QuietBody::Followed> followed = quiet.followed;
      while (followed[at].leaves[0] != leaf) ++at;
      std::size_t behind = at + 1;
      while (behind < followed.size() && followed[behind].leaves[0] == leaf) ++behind;
      group.followed = followed.subspan(at, behind - at);
      group.fresh = std::span<const std::uint8_t>(quiet.fresh).subspan(at, behind - at);
      quiet.unsettled.clear();
      for (const LeafPair& leaves : group.pairs)
        if (!quiet.settled(leaves[1])) quiet.unsettled.push_back(leaves);
      group.any_fresh = std::find(group.fresh.begin(), group.fresh.end(), 1) != group.fresh.end();
    }
    pair.run.scratch.partners.clear();
    visit(group);
    i = end;
  }
}

/// The second leaves of a group, eight at a time.
inline std::span<const LeafBlock> list_partners(const BodyPair& pair, const LeafGroup& group) {
  auto& blocks = pair.run.scratch.partners;
  if (!blocks.empty()) return blocks;
  blocks.resize((group.pairs.size() + 7) / 8, no_leaves());
  for (std::size_t i = 0; i < group.pairs.size(); ++i) {
    const std::uint32_t leaf = group.pairs[i][1];
    set_leaf(pair.b.frame.boxes.box[leaf], pair.b.frame.directions[leaf], i % 8, blocks[i / 8]);
  }
  return blocks;
}

/// Calls visit(pair, is it one of `some`?) for the pairs of a group whose bit select(block of partners) sets. `some` are in the order of the group.
template <class Select, class Visit>
void for_each_near_leaf(const BodyPair& pair, const LeafGroup& group, std::span<const LeafPair> some, Select&& select,
                        Visit&& visit) {
  const std::span<const LeafBlock> blocks = list_partners(pair, group);
  auto tested = some.begin();
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (unsigned bits = select(blocks[b]); bits != 0; bits &= bits - 1) {
      const std::size_t i = 8 * b + static_cast<std::size_t>(std::countr_zero(bits));
      if (i >= group.pairs.size()) break;
      const LeafPair& leaves = group.pairs[i];
      while (tested != some.end() && (*tested)[1] < leaves[1]) ++tested;
      visit(leaves, tested != some.end() && *tested == leaves);
    }
}

/// The pairs of a group that a vertex or an edge has to be tested with in this call. deform(pair of leaves, limit, most): how much it may deform
/// towards that leaf, if less than `most`; 0: test it.
template <class Deform>
std::span<const LeafPair> pairs_to_test(const BodyPair& pair, const LeafGroup& group, double approach,
                                        QuietUntil& known, Deform&& deform) {
  const std::uint32_t leaf = group.pairs[0][0];
  if (!pair.quiet->settled(leaf)) return group.pairs;
  const bool quiet = is_quiet(*pair.quiet, known, leaf, approach);
  if (!quiet || group.any_fresh) {
    if (!may_be_quiet(known)) return group.pairs;
    std::size_t& budget = pair.quiet->budget;
    if (budget == 0) {
      known.moved = -1;
      return group.pairs;
    }
    const double limit = quiet ? known.approach : quiet_limit(approach, pair.run.margin);
    QuietUntil found = quiet ? known : QuietUntil();
    double most = 0.5 * quiet_skin(pair.a);
    for (std::size_t i = 0; i < group.followed.size(); ++i) {
      const LeafPair& leaves = group.followed[i].leaves;
      const auto end = found.near.begin() + found.near_count;
      if ((quiet && group.fresh[i] == 0) || !pair.quiet->settled(leaves[1]) ||
          std::find(found.near.begin(), end, leaves[1]) != end)
        continue;
      if (budget > 0) --budget;
      if (const double d = deform(leaves, limit, most); d > 0) {
        most = d;
      } else if (found.near_count < QuietUntil::kMostNear) {
        found.near[found.near_count++] = leaves[1];
      } else {
        give_up(known);
        return group.pairs;
      }
    }
    most += pair.quiet->moved[leaf];
    known = found;
    known.moved = quiet ? std::min(known.moved, most) : most;
    known.approach = limit;
    known.leaf = leaf;
  }
  if (known.near_count == 0) return pair.quiet->unsettled;
  std::vector<LeafPair>& near = pair.quiet->near;
  near.clear();
  for (const LeafPair& leaves : group.pairs) {
    const auto end = known.near.begin() + known.near_count;
    if (!pair.quiet->settled(leaves[1]) || std::find(known.near.begin(), end, leaves[1]) != end) near.push_back(leaves);
  }
  return near;
}

}  // namespace kerf
