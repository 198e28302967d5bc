// Numbers of bytes as people write and read them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace kerf {

/// "1.2 GB", "300 bytes": three digits, powers of a thousand.
std::string bytes_text(std::uint64_t bytes);

/// "4GB", "500 MB", "1.5GiB", "300": kB, MB, GB, TB are powers of a thousand, KiB, MiB, GiB, TiB of 1024, in any case. None where it is
/// something else, negative, or beyond 2^63.
std::optional<std::uint64_t> parse_bytes(std::string_view text);

}  // namespace kerf
