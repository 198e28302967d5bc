#include "apps/program_path.h"

namespace kerf::test {

std::string program_path() { return KERF_PROGRAM; }

}  // namespace kerf::test
