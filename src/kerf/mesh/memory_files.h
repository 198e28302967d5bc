// Files in memory, where a platform has none (KERF_FILES_IN_MEMORY): the functions of whole_file.h work on them. Their names are text that
// is compared, folders are what names have in common.
#pragma once

#include <string>
#include <string_view>

namespace kerf {

/// Puts a file there, or in place of the one that is there.
void put_memory_file(const std::string& path, std::string_view bytes);
void remove_memory_file(const std::string& path);

}  // namespace kerf
