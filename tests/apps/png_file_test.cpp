#include "png_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cstdint>
#include <filesystem>
#include <vector>

namespace kerf::app::png_file_test {
namespace {

TEST(PngFile, ReadsBack) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "kerf_png_file_test.png";
  Picture picture{3, 2, {}};
  for (int i = 0; i < 18; ++i) picture.rgb.push_back(static_cast<std::uint8_t>(14 * i));
  ASSERT_TRUE(write_png(file, picture).ok());
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&image, file.c_str()), 0);
  EXPECT_EQ(image.width, 3u);
  EXPECT_EQ(image.height, 2u);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> read(18);
  ASSERT_NE(png_image_finish_read(&image, nullptr, read.data(), 0, nullptr), 0);
  EXPECT_EQ(read, picture.rgb);
  std::filesystem::remove(file);
  EXPECT_THAT(write_png("/nowhere/a.png", picture).error().message, ::testing::HasSubstr("/nowhere/a.png"));
}

}  // namespace
}  // namespace kerf::app::png_file_test
