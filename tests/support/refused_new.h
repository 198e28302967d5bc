// Memory that runs out on purpose: the n-th request from now on is refused, once. Some file of the program includes counted_new.h.
#pragma once

#include <atomic>
#include <new>

namespace kerf::test {

inline std::atomic<long> requests_until_refusal{-1};  ///< < 0: none is refused

/// Does what() with the n-th request refused, n = first, first + step and so on, until it comes through without. Calls after(refused) each time.
/// Returns how many times a request was refused.
template <class What, class After>
long with_requests_refused(long first, long step, What&& what, After&& after) {
  long refusals = 0;
  for (long n = first;; n += step) {
    requests_until_refusal = n;
    bool thrown = false;
    try {
      what();
    } catch (const std::bad_alloc&) {
      thrown = true;
    }
    const bool refused = requests_until_refusal.exchange(-1) < 0;
    after(refused, thrown);
    if (!refused) return refusals;
    ++refusals;
  }
}

/// While it lives no request is refused or counted: what a test needs for itself.
class NothingRefused {
 public:
  NothingRefused() : left_(requests_until_refusal.exchange(-1)) {}
  NothingRefused(const NothingRefused&) = delete;
  NothingRefused& operator=(const NothingRefused&) = delete;
  ~NothingRefused() { requests_until_refusal = left_; }

 private:
  long left_;
};

/// In operator new: is this the one?
inline bool refuse_request() {
  if (requests_until_refusal.load(std::memory_order_relaxed) < 0) return false;
  return requests_until_refusal.fetch_sub(1) == 0;
}

}  // namespace kerf::test
