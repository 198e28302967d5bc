// The jagged surface that a punch leaves (paper 5.3, figure 24): vertices of its walls stray into what was punched out.
#pragma once

#include <cstdint>
#include <span>

#include "kerf/cutting/punch.h"

namespace kerf {

/// Moves the vertices of the lips' walls outwards by up to `amplitude` (metres; less where the loose part is thin or walls meet
/// at a sharp corner), and those of the loose part with them: both keep the same surface between them. The same
/// seed and the same place give the same displacement. Walls of earlier cuts stay as they are. Closed bodies only; nothing happens to an open sheet.
void roughen_punch(CellComplex& body, const PunchCut& cut, double amplitude, std::uint64_t seed);

}  // namespace kerf
