// How long a vertex or an edge of a body cannot touch the body itself: found out when it is tested, good until the body has
// deformed by as much. Then what it lies beside, the other lip of a cut above all, need not be tested in every step.
//
// Where a cut goes on, that would be found out anew in every step: leaves that keep changing are tested until they have settled.
//
// No result depends on it. A gap n . (x - x') - |n . o| - |n . o'| along the distance is bounded from below for whole faces and
// edges, and so is how fast it can change; what is quiet would have been tested in vain.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kerf/base/ids.h"
#include "kerf/base/vec.h"

namespace kerf {

struct BodyView;
struct ContactSurface;
struct DetectMemory;
struct NeighbourSearch;
struct RememberedContact;
using LeafPair = std::array<std::uint32_t, 2>;

/// What is known of one vertex or edge: quiet towards all leaves but a few.
struct QuietUntil {
  static constexpr std::size_t kMostNear = 7;
  double moved = -1;          ///< quiet until QuietBody::moved of its leaf is this, m
  double approach = 0;        ///< and as long as gaps that matter are below this, m
  std::uint32_t leaf = 0;     ///< that it was tested with
  std::uint8_t touched = 0;   ///< 1: it had contacts in the last call
  std::uint8_t patience = 0;  ///< calls until it is worth another try
  std::uint8_t failures = 0;
  std::uint8_t near_count = 0;
  std::array<std::uint32_t, kMostNear> near{};  ///< leaves that it might touch
};

/// One body from call to call. Memory only.
struct QuietBody {
  std::vector<Vec3> position, offset;  ///< of the last call, per vertex
  /// Per leaf: how far any point of it and of its partners can have moved so far, but for what they have in common, and any offset have
  /// turned, m. Only grows.
  std::vector<double> moved;
  struct Motion {
    Vec3 least, most;  ///< of its vertices since the last call, m
    double turn = 0;   ///< of an offset, m
  };
  std::vector<Motion> motion;            ///< per leaf, of this call
  std::vector<QuietUntil> vertex, edge;  ///< edges by their owners
  std::vector<std::uint32_t> changes;    ///< per node: of its surface, as seen in the last call
  std::vector<std::uint8_t> calm;        ///< per leaf: calls without a change until it has settled, and one more
  /// Calls without a change after which it is worth finding out how long something is quiet, which costs as much as a few tests.
  static constexpr std::uint8_t kSettled = 4;
  [[nodiscard]] bool settled(std::uint32_t leaf) const { return calm[leaf] >= kSettled; }
  /// Pairs that things were tested with; those that are no longer near stay a while, they tend to come back. The motion of those that have
  /// settled counts.
  struct Followed {
    LeafPair leaves;
    std::uint32_t absent = 0;  ///< calls since it was among the pairs
  };
  std::vector<Followed> followed, merged;
  std::vector<std::uint8_t>
      fresh;  ///< per followed pair: 1: not followed so far, or settled in this call; never while the second leaf is unsettled
  std::size_t budget = 0;  ///< pairs of a vertex or edge with a leaf about which this call may still find out
  std::vector<std::uint8_t> has_rim;      ///< per leaf: some edge of it was made by a cut
  std::vector<LeafPair> near;             ///< of the group at work: pairs that have to be tested
  std::vector<LeafPair> unsettled;        ///< of the group at work: pairs whose second leaf has not settled
  std::vector<RememberedContact> memory;  ///< that the last call left
};

/// Before a body is tested against itself, with the pairs of leaves that are near each other: what the body has done since the last call.
/// before: the memory that this call is given; another one than that of the last call makes everything unknown.
void follow_body(const BodyView& body, std::span<const LeafPair> pairs, const DetectMemory& before, QuietBody& quiet);

/// Is it quiet in this call, towards followed pairs that are settled and not fresh?
inline bool is_quiet(const QuietBody& quiet, const QuietUntil& it, std::uint32_t leaf, double approach) {
  return quiet.moved[leaf] < it.moved && approach <= it.approach && it.leaf == leaf;
}
/// Worth finding out how long it is quiet? Not soon after that has failed, nor while it touches something.
bool may_be_quiet(QuietUntil& it);

/// A limit for gaps that will do for a while, if `approach` is that of this call: twice what things move by now, and more.
inline double quiet_limit(double approach, double margin) { return 1.05 * margin + 2 * (approach - margin); }

/// By how much the body may deform before v could come within a gap of `limit` of any face of a leaf that is no neighbour of it, if that
/// is less than `most` (QuietBody::moved counts that); 0: it might now. m.
double quiet_vertex(const BodyView& body, CollisionVertex v, const LeafPair& leaves, double limit, double most,
                    NeighbourSearch& neighbours);

/// The same for edge h and one other edge, `most` if it is more than that.
double quiet_edges(const BodyView& body, CollisionHalfEdge h, CollisionHalfEdge g, bool hang_together, double limit,
                   double most, NeighbourSearch& neighbours);

/// How far beyond the reach things are looked at: as far as they may come while something is quiet. m.
double quiet_skin(const BodyView& body);
/// What did not work is not tried again soon.
void give_up(QuietUntil& it);

}  // namespace kerf
