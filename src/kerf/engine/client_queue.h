// What still has to go to one page. Replies, bodies and patches are never dropped and go first; of frames only the
// newest waits, and at most two are under way that the page has not drawn yet: a slow page loses frames, not memory.
#pragma once

#include <cstdint>
#include <deque>

#include "kerf/engine/protocol.h"

namespace kerf {

/// Bytes that a message takes beside its own, by the sizes of its blocks (glibc, 64 bits): 32 for the vector, 64 for its counters, 16 for a place
/// in a queue, 16 of the allocator's own. At half or twice, queues of small messages take a half more, or a half less, than their limits say.
inline constexpr std::size_t kMessageOverhead = 128;

class ClientQueue {
 public:
  /// A page that has this much unread is given up.
  explicit ClientQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void push(protocol::Message message) {
    bytes_ += message->size() + kMessageOverhead;
    reliable_.push_back(std::move(message));
  }
  /// Replaces the frame that waits; numbers ascend.
  void offer_frame(std::uint32_t seq, protocol::Message frame) {
    if (frame_) ++dropped_;
    frame_ = std::move(frame);
    frame_seq_ = seq;
  }
  /// A waiting frame of an older topology is of no use.
  void forget_frame() { frame_.reset(); }
  /// The page has drawn this frame, and so all before it.
  void acknowledge(std::uint32_t seq) {
    while (!under_way_.empty() && under_way_.front() <= seq) under_way_.pop_front();
  }
  /// What to send next; null when there is nothing to send now.
  protocol::Message next() {
    protocol::Message out;
    if (!reliable_.empty()) {
      out = std::move(reliable_.front());
      reliable_.pop_front();
      bytes_ -= out->size() + kMessageOverhead;
    } else if (frame_ && under_way_.size() < kFramesUnderWay) {
      out = std::move(frame_);
      frame_.reset();
      under_way_.push_back(frame_seq_);
    }
    return out;
  }
  /// Bytes, without the frame that waits and what is under way.
  [[nodiscard]] std::size_t unread() const { return bytes_; }
  [[nodiscard]] bool overflowed() const { return bytes_ > most_bytes_; }
  [[nodiscard]] std::uint32_t dropped_frames() const { return dropped_; }

  static constexpr std::size_t kFramesUnderWay = 2;

 private:
  std::size_t most_bytes_, bytes_ = 0;
  std::deque<protocol::Message> reliable_;
  protocol::Message frame_;
  std::uint32_t frame_seq_ = 0, dropped_ = 0;
  std::deque<std::uint32_t> under_way_;
};

}  // namespace kerf
