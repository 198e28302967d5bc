#include "batch.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <optional>
#include <string>
#include <thread>

#include "errors.h"
#include "interrupts.h"
#include "kerf/cutting/blade_edge.h"
#include "python_lock.h"

namespace nb = nanobind;

namespace kerf::python {
namespace {

std::size_t threads_for(int wanted, std::size_t sessions) {
  const std::size_t there = std::max(1u, std::thread::hardware_concurrency());
  return std::min(wanted > 0 ? static_cast<std::size_t>(wanted) : there, std::max<std::size_t>(sessions, 1));
}

Vec3 vec(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

}  // namespace

/// A batch in use by this thread.
class Batch::Use {
 public:
  explicit Use(std::atomic<bool>& busy) : busy_(busy) {
    if (busy_.exchange(true))
      throw Failure(failed("this batch is in use by another thread; give each thread a batch of its own, or a lock"));
  }
  ~Use() { busy_ = false; }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;

 private:
  std::atomic<bool>& busy_;
};

Batch::Batch(std::vector<nb::object> sessions, int threads)
    : sessions_(std::move(sessions)), threads_(threads_for(threads, sessions_.size())), workers_(threads_) {
  for (const nb::object& session : sessions_) {
    auto* live = nb::inst_ready(session) ? &nb::cast<LiveSession&>(session) : nullptr;
    if (live == nullptr) throw nb::type_error("a batch is made of sessions");
    if (std::find(lives_.begin(), lives_.end(), live) != lives_.end())
      throw nb::value_error("a session can't be in a batch twice");
    lives_.push_back(live);
  }
  hands_.resize(lives_.size());
}

std::vector<std::pair<std::size_t, std::string>> Batch::each(const Work& work) {
  const Use use(busy_);
  std::vector<std::string> messages(lives_.size());
  Interrupts interrupts;
  {
    const WithoutPythonLock release;
    std::atomic<bool> stopped = false;
    const std::function<bool()> ended = [&] {
      if (interrupts.wanted()) stopped = true;  // looks in the caller's thread alone
      return stopped.load();
    };
    workers_.each(
        lives_.size(),
        [&](std::size_t i) {
          if (ended()) return;
          try {
            work(i, ended);
          } catch (const std::exception& e) {
            messages[i] = e.what();
          }
        },
        [&] { ended(); });
  }
  interrupts.raise();
  std::vector<std::pair<std::size_t, std::string>> out;
  for (std::size_t i = 0; i < messages.size(); ++i)
    if (!messages[i].empty()) out.emplace_back(i, std::move(messages[i]));
  return out;
}

std::vector<std::pair<std::size_t, std::string>> Batch::turn(const BatchTurn& turn) {
  return each([&](std::size_t i, const std::function<bool()>& ended) {
    if (turn.takes != nullptr && turn.takes[i] == 0) return;
    Hand& hand = hands_[i];
    if (const std::uint64_t restores = lives_[i]->restores(); hand.restores != restores) {
      hand = {};
      hand.restores = restores;
    }
    SessionTurn own;
    own.steps = turn.steps;
    own.ended = ended;
    for (const auto& [id, targets] : turn.grasps)
      if (!std::isnan(targets[3 * i])) own.grasps.emplace_back(id, vec(targets + 3 * i));
    for (const auto& [id, poses] : turn.tools)
      if (!std::isnan(poses[6 * i])) own.tools.push_back({id, vec(poses + 6 * i), vec(poses + 6 * i + 3)});
    if (turn.edges != nullptr) {
      const Vec3 base = vec(turn.edges + 6 * i), tip = vec(turn.edges + 6 * i + 3);
      own.blade = true;
      own.cuts = turn.cuts == nullptr || turn.cuts[i] != 0;
      own.base = {hand.placed ? hand.base : base, base};
      own.tip = {hand.placed ? hand.tip : tip, tip};
      hand.placed = true;
      hand.base = base;
      hand.tip = tip;
    }
    lives_[i]->take_turn(own, hand.stroke);
  });
}

void Batch::place_blade(std::size_t session, Vec3 base, Vec3 tip) {
  if (session >= size()) throw nb::index_error("the batch has no session of this number");
  const Use use(busy_);
  check(check_edge({base, tip}));
  Hand& hand = hands_[session];
  if (hand.stroke != 0 && lives_[session]->stroke_is_open(hand.stroke)) lives_[session]->end_stroke(hand.stroke, true);
  hand = {true, base, tip, 0, lives_[session]->restores()};
}

void Batch::all(const Work& work) {
  const auto errors = each(work);
  if (!errors.empty())
    throw Failure(failed("session " + std::to_string(errors[0].first) + " of the batch: " + errors[0].second));
}

void Batch::places_now(const double* rest, std::size_t each_has, double* now) {
  all([&](std::size_t i, const auto&) {
    lives_[i]->places_now(rest + 3 * each_has * i, each_has, now + 3 * each_has * i);
  });
}

void Batch::places_at_rest(const double* now, std::size_t each_has, double* rest, double* distance) {
  all([&](std::size_t i, const auto&) {
    lives_[i]->places_at_rest(now + 3 * each_has * i, each_has, rest + 3 * each_has * i, distance + each_has * i);
  });
}

std::vector<BodyCounts> Batch::counts() {
  std::vector<BodyCounts> out(size());
  all([&](std::size_t i, const auto&) { out[i] = lives_[i]->body_counts(); });
  return out;
}

std::vector<double> Batch::piece_masses(std::size_t most) {
  std::vector<double> out(size() * most, 0);
  all([&](std::size_t i, const auto&) {
    const std::vector<double> masses = lives_[i]->sorted_masses().mass;
    std::copy_n(masses.begin(), std::min(masses.size(), most), out.begin() + static_cast<std::ptrdiff_t>(most * i));
  });
  return out;
}

std::vector<ToolRecord> Batch::tools(const std::string& id) {
  std::vector<ToolRecord> out(size());
  all([&](std::size_t i, const auto&) { out[i] = lives_[i]->tool(id); });
  return out;
}

std::vector<GraspRecord> Batch::grasps(const std::string& id) {
  std::vector<GraspRecord> out(size());
  all([&](std::size_t i, const auto&) { out[i] = lives_[i]->grasp(id); });
  return out;
}

}  // namespace kerf::python
