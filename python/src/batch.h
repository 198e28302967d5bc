// Many sessions that take their turns in a few threads.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "live_session.h"
#include "workers.h"

namespace kerf::python {

/// What all sessions are to do; arrays hold a row for each session.
struct BatchTurn {
  std::int64_t steps = 1;
  const double* edges = nullptr;        ///< 6 each: base and tip of a blade at the end, world; null: no blade
  const std::uint8_t* cuts = nullptr;   ///< does the blade cut on its way? null: always
  const std::uint8_t* takes = nullptr;  ///< does the session take part? null: all do
  std::vector<std::pair<std::string, const double*>>
      grasps;  ///< by id: 3 each, where the grasp is at the end; NaN: it is left alone
  std::vector<std::pair<std::string, const double*>>
      tools;  ///< by id: 6 each, place and turn of the pose at the end; NaN: it is left alone
};

/// Used by one thread at a time: all below throws while another thread is in it.
class Batch {
 public:
  /// Sessions, each once. threads: 0 takes as many as there are processors.
  Batch(std::vector<nanobind::object> sessions, int threads);

  [[nodiscard]] std::size_t size() const { return lives_.size(); }
  [[nodiscard]] std::size_t threads() const { return threads_; }
  [[nodiscard]] const std::vector<nanobind::object>& sessions() const { return sessions_; }
  /// Lets go of all sessions.
  void forget() {
    lives_.clear();
    hands_.clear();
    sessions_.clear();
  }

  /// Messages of the sessions that could not do it, by number.
  std::vector<std::pair<std::size_t, std::string>> turn(const BatchTurn& turn);
  /// Where the blade of a session is, without a cut. A stroke of the batch that is open there ends.
  void place_blade(std::size_t session, Vec3 base, Vec3 tip);
  /// 3 `each` numbers for every session. Throws at the first session that has no places.
  void places_now(const double* rest, std::size_t each, double* now);
  void places_at_rest(const double* now, std::size_t each, double* rest, double* distance);
  // What each session has now. They throw at the first session that can't be asked.
  std::vector<BodyCounts> counts();
  /// kg, `most` for every session, heaviest first; 0 where there are fewer pieces.
  std::vector<double> piece_masses(std::size_t most);
  std::vector<ToolRecord> tools(const std::string& id);
  std::vector<GraspRecord> grasps(const std::string& id);

 private:
  /// work(i, ended) in the threads, without Python's lock; what it throws becomes a message. It may ask ended(), whether Python wants an end.
  using Work = std::function<void(std::size_t, const std::function<bool()>&)>;
  std::vector<std::pair<std::size_t, std::string>> each(const Work& work);
  /// The same of what all must be able to do: the first message is thrown, with the session's number.
  void all(const Work& work);

  class Use;
  struct Hand {
    bool placed = false;
    Vec3 base, tip;
    std::uint64_t stroke = 0;  ///< number of the session's stroke that is this batch's
    std::uint64_t restores =
        0;  ///< the session's number of them when the hand moved: what was restored has met no hand
  };
  std::vector<nanobind::object> sessions_;
  std::vector<LiveSession*> lives_;
  std::vector<Hand> hands_;
  std::size_t threads_;
  std::atomic<bool> busy_ = false;
  Workers workers_;
};

}  // namespace kerf::python
