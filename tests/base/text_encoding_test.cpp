// What a file is that should be UTF-8.
#include "kerf/base/text_encoding.h"

#include <gtest/gtest.h>

#include <string>

namespace kerf::text_encoding_test {
namespace {

std::string utf16(std::string_view text, bool little, bool mark) {
  std::string out = !mark ? "" : little ? "\xFF\xFE" : "\xFE\xFF";
  for (const char c : text) {
    if (!little) out += '\0';
    out += c;
    if (little) out += '\0';
  }
  return out;
}

TEST(TextEncoding, Utf16IsToldByItsMarkOrItsZeros) {
  for (const bool little : {false, true})
    for (const bool mark : {false, true}) {
      const std::string text = utf16("v 0 0 0\nv 1 0 0\n", little, mark);
      EXPECT_TRUE(is_utf16(text)) << little << mark;
      EXPECT_TRUE(is_utf16(text.substr(0, text.size() - 1))) << "cut off";
      EXPECT_EQ(fault_of_text(text), kIsUtf16);
    }
}

TEST(TextEncoding, TextIsText) {
  for (const char* text : {"", "v", "a\tb\r\n\f", "\xEF\xBB\xBF[body]", "\xC3\xA9t\xC3\xA9", "\xE9t\xE9"}) {
    EXPECT_EQ(fault_of_text(text), "") << text;
    EXPECT_FALSE(is_utf16(text)) << text;
  }
}

TEST(TextEncoding, OtherBytesAreNoText) {
  const std::string zeros(100, '\0');
  for (const std::string& bytes :
       {zeros, "ab" + zeros, std::string("a\0b", 3), std::string("\x7f"), std::string("a\x01")}) {
    EXPECT_FALSE(is_utf16(bytes));
    EXPECT_TRUE(fault_of_text(bytes).starts_with("this is not a text file: line 1 has a byte \\x"));
  }
  EXPECT_EQ(fault_of_text("a\nb\n\x1b"), "this is not a text file: line 3 has a byte \\x1b");
}

}  // namespace
}  // namespace kerf::text_encoding_test
