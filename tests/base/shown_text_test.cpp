// Names and values within messages: what is escaped, and how much is shown.
#include "kerf/base/shown_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kerf::shown_text_test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(ShownText, IsOnOneLine) {
  EXPECT_EQ(shown("a\nb\tc\r\x1b[2J\x7f"), "a\\x0ab\\x09c\\x0d\\x1b[2J\\x7f");
  EXPECT_EQ(shown(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(controls_shown("a\n\tb\x1b", true), "a\n\tb\\x1b");
}

TEST(ShownText, HiddenCharactersOfUnicodeAreShown) {
  EXPECT_EQ(shown("a\u200e\u200f\u061c"), "a\\u200e\\u200f\\u061c");
  EXPECT_EQ(shown("\u202a\u202b\u202c\u202d\u202e"), "\\u202a\\u202b\\u202c\\u202d\\u202e");
  EXPECT_EQ(shown("\u2066\u2067\u2068\u2069"), "\\u2066\\u2067\\u2068\\u2069");
  EXPECT_EQ(shown("a\u2028b\u2029"), "a\\u2028b\\u2029");
  EXPECT_EQ(shown("\u0080\u009b\u009f"), "\\u0080\\u009b\\u009f");
  EXPECT_EQ(controls_shown("\u202e", true), "\\u202e");
}

TEST(ShownText, TextStays) {
  for (const char* text :
       {"", "~/a b.obj", "\u00a0\u00fc\u3000\u65e5\u672c", "\u2010\u2027\u202f\u2065\u206a", "\xf0\x9f\x94\xaa"})
    EXPECT_EQ(shown(text), text);
  for (const char* cut_off : {"\xc2", "\xe2\x80", "\xff\xfe", "\xe2\x80x"}) EXPECT_EQ(shown(cut_off), cut_off);
}

TEST(ShownText, TheMiddleOfALongOneIsLeftOut) {
  const std::string whole(kMostShown, 'x');
  EXPECT_EQ(shown(whole), whole);
  const std::string text = shown("begin" + std::string(1000000, 'x') + "end");
  EXPECT_LT(text.size(), kMostShown + 40);
  EXPECT_TRUE(text.starts_with("beginxxx")) << text;
  EXPECT_TRUE(text.ends_with("xxxend")) << text;
  EXPECT_THAT(text, HasSubstr("... 999688 bytes ..."));
}

TEST(ShownText, CharactersAreNotCut) {
  std::string long_one = "x";
  for (int i = 0; i < 1000; ++i) long_one += "\u65e5";
  for (std::size_t most = 20; most < 32; ++most) {
    std::string text = shown(long_one, most);
    const std::size_t gap = text.find("...");
    EXPECT_EQ((gap - 1) % 3, 0u) << text;
    EXPECT_EQ((text.size() - text.rfind("...") - 3) % 3, 0u) << text;
  }
}

TEST(ShownText, LinesOfAMessageStay) {
  EXPECT_EQ(shown_lines("a\nb"), "a\nb");
  EXPECT_EQ(shown_lines("a\x1b\n\nb\n"), "a\\x1b\n\nb\n");
  const std::string text = shown_lines("short\n" + std::string(100000, 'x') + "\nend");
  EXPECT_LT(text.size(), kMostOfLine + 60);
  EXPECT_TRUE(text.starts_with("short\nx"));
  EXPECT_TRUE(text.ends_with("x\nend"));
}

}  // namespace
}  // namespace kerf::shown_text_test
