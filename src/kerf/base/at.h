/// An index of 32 bits, as meshes hold them, as what the standard library counts with.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kerf {

[[nodiscard]] constexpr std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

}  // namespace kerf
