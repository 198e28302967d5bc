// Names of files that would speak to a terminal, and numbers of the command line.
#include <gtest/gtest.h>

#include "exit_status.h"
#include "number_checks.h"
#include "terminal.h"

namespace kerf::app::terminal_test {
namespace {

TEST(Terminal, ControlCharactersAreShown) {
  EXPECT_EQ(printable("a\x1b[2Jb"), "a\\x1b[2Jb");
  EXPECT_EQ(printable("a\rb\x07\x7f"), "a\\x0db\\x07\\x7f");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\u009b31m");  // one character that begins a sequence, too
  EXPECT_EQ(printable("\xc2"), "\xc2");
}

TEST(Terminal, TextStays) {
  for (const char* text :
       {"", "note: a\n\tb\n", "\xe5\x8d\x8a\xe6\x9c\x88\xe6\x9d\xbf.obj", "\xc2\xa0\xc3\x9b", "~/a b.kerf"})
    EXPECT_EQ(printable(text), text);
}

// A name with a line end would look like a line of the program.
TEST(Terminal, ValuesStayOnOneLine) {
  testing::internal::CaptureStderr();
  warn("{} of {}\n\t{}\n", std::string("a\nkerf: b\u202e"), 3, "c\t");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "a\\x0akerf: b\\u202e of 3\n\tc\\x09\n");
  testing::internal::CaptureStdout();
  say("{}{:.2f}{}\n", std::string_view("\u2028"), 0.5, true);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "\\u20280.50true\n");
}

TEST(Terminal, LongMessagesAreCutInTheirMiddle) {
  testing::internal::CaptureStderr();
  report(bad_input("begin" + std::string(100000, 'x') + "end\nnext line"));
  const std::string text = testing::internal::GetCapturedStderr();
  EXPECT_LT(text.size(), 2100u);
  EXPECT_TRUE(text.starts_with("kerf: beginx")) << text;
  EXPECT_TRUE(text.ends_with("xend\nnext line\n")) << text;
}

TEST(NumberChecks, AreFinite) {
  for (const char* good : {"1", "0.5", "2e3", "+4", "1e308", "5e-324"}) EXPECT_EQ(is_positive(good), "") << good;
  for (const char* bad : {"0", "-1", "nan", "inf", "1e400", "", "x", "1x", "1 ", "0x10"}) {
    EXPECT_NE(is_positive(bad).find(std::string("'") + bad + "' is no number above 0"), std::string::npos) << bad;
    EXPECT_LT(is_positive(bad).size(), 80u);
  }
  EXPECT_EQ(is_not_negative("0"), "");
  EXPECT_NE(is_not_negative("-0.1"), "");
  EXPECT_NE(is_not_negative("nan"), "");
  EXPECT_EQ(is_whole("18446744073709551615"), "");
  for (const char* bad : {"-1", "1.5", "18446744073709551616", "", "1e3"}) EXPECT_NE(is_whole(bad), "") << bad;
}

}  // namespace
}  // namespace kerf::app::terminal_test
