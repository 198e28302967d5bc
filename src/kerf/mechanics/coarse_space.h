// placeholder until the second level is written
#pragma once
namespace kerf {
struct CoarseSpace {};
}  // namespace kerf
