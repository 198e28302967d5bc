// Unpacks the page's files for whoever does not read gzip.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace kerf::app {

/// The content of a gzip file with one member; nothing if it is none.
std::optional<std::string> gunzip(std::string_view packed);

}  // namespace kerf::app
