// libFuzzer: whatever a page sends is decoded or refused, and what is decoded keeps the promises of protocol.h.
#include <cmath>
#include <cstdlib>

#include "kerf/engine/protocol.h"

using namespace kerf;
using namespace kerf::protocol;

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

void check(const ViewRay& ray) {
  require(is_finite(ray.origin) && std::abs(norm(ray.direction) - 1) < 1e-9);
  require(std::abs(ray.origin.x) <= kFarthest && std::abs(ray.origin.y) <= kFarthest &&
          std::abs(ray.origin.z) <= kFarthest);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data), size);
  (void)input_of(bytes);
  const auto message = decode_page_message(bytes);
  if (!message) {
    require(!message.error().message.empty());
    return 0;
  }
  if (const auto* m = std::get_if<ToolInput>(&*message)) {
    require(m->samples.size() * 64 < size);
    for (const ToolSample& s : m->samples) check(s.ray);
  } else if (const auto* r = std::get_if<RayQuery>(&*message)) {
    check(r->ray);
  } else if (const auto* c = std::get_if<Command>(&*message)) {
    for (const double v : c->value) require(std::isfinite(v));
    require(c->text.size() < size);
  } else if (const auto* u = std::get_if<Upload>(&*message)) {
    require(u->offset + u->bytes.size() <= u->total);
  }
  return 0;
}
