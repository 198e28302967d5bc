// Large messages from engine to page, deflated for the wire (docs/protocol.md, "Packed").
#pragma once

#include <memory>
#include <vector>

#include "kerf/engine/protocol.h"

namespace kerf::app {

/// Shorter messages go as they are. A choice: at half, the tools of the punch scene are packed too, which saves 7 KB; at twice, the steak's board and
/// table go as they are, which costs 17 KB.
inline constexpr std::size_t kLeastPacked = std::size_t{16} << 10;
/// Longer ones hold the server's thread up for too long: 8 MiB take a seventh of a second. At half, bodies of 100,000 triangles go as they are; at
/// twice, the step that is due waits twice as long.
inline constexpr std::size_t kMostPacked = std::size_t{8} << 20;

/// The message as one of type kPacked.
[[nodiscard]] protocol::Bytes packed(const protocol::Bytes& message);

/// Packs those messages that are worth it: what every page is told once, before the first picture. What a cut or a step changes goes as it is, without
/// delay. A message for several pages is packed once.
class Packer {
 public:
  [[nodiscard]] protocol::Message operator()(const protocol::Message& message);

 private:
  struct Done {
    std::weak_ptr<const protocol::Bytes> from;
    std::weak_ptr<const protocol::Bytes> to;
  };
  std::vector<Done> done_;
};

}  // namespace kerf::app
