// libFuzzer: recordings from anywhere are read or refused; what is read comes back the same.
#include <cstdlib>
#include <string_view>

#include "kerf/record/recording.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto recording = kerf::parse_recording({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!recording) return 0;
  const std::string text = kerf::recording_text(*recording);
  const auto again = kerf::parse_recording(text, "fuzz");
  if (!again || kerf::recording_text(*again) != text) std::abort();
  return 0;
}
