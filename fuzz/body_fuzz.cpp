// libFuzzer: bound bodies from anywhere are read or refused; what is read holds every invariant of a binding. The checksum, which
// stops accidents only, is not compared in this build.
#include <cstdlib>

#include "kerf/binding/bound_body_file.h"
#include "kerf/binding/validate_binding.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto body = kerf::parse_bound_body({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!body) {
    if (body.error().message.find("fuzz") == std::string::npos) std::abort();
    return 0;
  }
  if (!kerf::validate_binding(body->complex)) std::abort();
  return 0;
}
