// Long work reports how far it is; the caller decides what to show. The library never prints.
#pragma once

#include <functional>
#include <string_view>

namespace kerf {

/// stage: what is being done ("paths", "parameters"); fraction: 0 to 1 of that stage.
using Progress = std::function<void(std::string_view stage, double fraction)>;

}  // namespace kerf
