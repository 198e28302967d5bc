// Where the program lies that tests run as a person would.
#pragma once

#include <string>

namespace kerf::test {

/// Told to one source alone, as source_dir() is.
std::string program_path();

}  // namespace kerf::test
