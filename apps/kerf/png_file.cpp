#include "png_file.h"

#include <fmt/format.h>
#include <png.h>

#include <string>

#include "kerf/base/shown_text.h"
#include "kerf/mesh/whole_file.h"

namespace kerf::app {

Status write_png(const std::filesystem::path& file, const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) != 0) {
    bytes.resize(size);
    return replace_file(file.string(), bytes);
  }
  return failed(fmt::format("can't write the picture {}: {}", shown(file.string()), image.message));
}

}  // namespace kerf::app
