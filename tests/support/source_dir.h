// Where the project's sources lie: scenes, samples, and scanned meshes beside them.
#pragma once

#include <string>

namespace kerf::test {

/// Told to one source alone: a path in every test's flags would keep a clone's objects from being found again in the compiler cache.
std::string source_dir();

}  // namespace kerf::test
