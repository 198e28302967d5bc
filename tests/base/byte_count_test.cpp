#include "kerf/base/byte_count.h"

#include <gtest/gtest.h>

namespace kerf::byte_count_test {
namespace {

TEST(ByteCount, TextHasThreeDigits) {
  EXPECT_EQ(bytes_text(0), "0 bytes");
  EXPECT_EQ(bytes_text(999), "999 bytes");
  EXPECT_EQ(bytes_text(1000), "1 kB");
  EXPECT_EQ(bytes_text(999'600), "1 MB");
  EXPECT_EQ(bytes_text(std::uint64_t{4} << 30), "4.29 GB");
  EXPECT_EQ(bytes_text(~std::uint64_t{0}), "18.4 EB");
}

TEST(ByteCount, ReadsWhatPeopleWrite) {
  EXPECT_EQ(parse_bytes("300"), 300U);
  EXPECT_EQ(parse_bytes("4GB"), 4'000'000'000U);
  EXPECT_EQ(parse_bytes("500 mb"), 500'000'000U);
  EXPECT_EQ(parse_bytes("1.5GiB"), 1'610'612'736U);
  EXPECT_EQ(parse_bytes("2kB"), 2000U);
  for (const char* bad : {"", "GB", "-1GB", "4 gallons", "nan", "inf", "1e30", "4GB "})
    EXPECT_FALSE(parse_bytes(bad)) << bad;
}

}  // namespace
}  // namespace kerf::byte_count_test
