// Where and when a benchmark ran.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace kerf::bench {

/// Names and values for people: processor, cores, memory, system, load, compiler, instructions, build, commit, date (UTC). What
/// can't be found out is left out.
std::vector<std::pair<std::string, std::string>> machine_facts();

/// Largest memory of this process so far, bytes.
double peak_memory();

}  // namespace kerf::bench
