#include "bench/machine.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

#include "kerf/record/recording.h"

namespace kerf::bench {
namespace {

/// What follows the colon in the first line of a file that begins with `key`.
std::string line_of(const char* file, const std::string& key) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);)
    if (line.starts_with(key)) {
      const auto value = line.find_first_not_of(" \t", line.find(':') + 1);
      return value == std::string::npos ? "" : line.substr(value);
    }
  return "";
}

std::string output_of(const char* command) {
  FILE* pipe = popen(command, "r");
  if (!pipe) return "";
  std::array<char, 256> text{};
  std::string out;
  while (std::fgets(text.data(), text.size(), pipe)) out += text.data();
  pclose(pipe);
  while (!out.empty() && out.back() == '\n') out.pop_back();
  return out;
}

std::string date() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &parts);
  return text.data();
}

}  // namespace

double peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

std::vector<std::pair<std::string, std::string>> machine_facts() {
  std::vector<std::pair<std::string, std::string>> facts;
  const auto add = [&](const char* key, std::string value) {
    if (!value.empty()) facts.emplace_back(key, std::move(value));
  };
  add("processor", line_of("/proc/cpuinfo", "model name"));
  add("cores",
      fmt::format("{}{}", std::thread::hardware_concurrency(),
                  line_of("/proc/cpuinfo", "flags").find("hypervisor") != std::string::npos ? ", virtual" : ""));
  add("memory", fmt::format("{:.0f} GB", static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                                             static_cast<double>(sysconf(_SC_PAGE_SIZE)) / 1e9));
  utsname system{};
  if (uname(&system) == 0) add("system", fmt::format("{} {}", system.sysname, system.release));
  double load = 0;
  if (getloadavg(&load, 1) == 1)
    add("load when it ended",
        fmt::format("{:.1f} processes, this one included{}", load, load > 1.7 ? ": the machine was shared" : ""));
#if defined(__clang__)
  add("compiler", "clang " __clang_version__);
#elif defined(__GNUC__)
  add("compiler", "g++ " __VERSION__);
#endif
  add("instructions", std::string(instruction_set()));
#ifdef NDEBUG
  add("build", "release");
#else
  add("build", "with assertions: times mean nothing");
#endif
  add("version", KERF_VERSION);
  // Of the folder that the program is run in, when that is a checkout of this project.
  add("commit", output_of("test -d src/kerf && git describe --always --dirty --abbrev=10 2>/dev/null"));
  add("date", date());
  return facts;
}

}  // namespace kerf::bench
