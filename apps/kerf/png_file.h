// Pictures in PNG files.
#pragma once

#include <filesystem>

#include "kerf/base/result.h"
#include "kerf/picture/picture.h"

namespace kerf::app {

/// Writes 8-bit RGB. Fails, naming the file, when it can't be written.
Status write_png(const std::filesystem::path& file, const Picture& picture);

}  // namespace kerf::app
