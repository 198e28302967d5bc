// libFuzzer: mesh files from anywhere are read or refused, and what is read keeps the promises of mesh_file.h. KERF_FUZZ_READER is
// one of its readers.
#include <cstdlib>

#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/surface_check.h"

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kerf;
  auto mesh = KERF_FUZZ_READER({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!mesh) {
    require(mesh.error().message.find("fuzz") != std::string::npos);
    return 0;
  }
  require(!mesh->triangles.empty() && check_writable("fuzz", *mesh).ok());
  // What may be inside the library afterwards: surfaces that are checked, or refused.
  SurfaceRequirements requirements;
  requirements.name = "fuzz";
  if (const auto checked = check_surface(*mesh, requirements); !checked) require(!checked.error().message.empty());
  return 0;
}
