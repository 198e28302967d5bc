#include "page_origins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kerf::page_origins_test {
namespace {

using app::PageOrigins;
using ::testing::HasSubstr;

TEST(PageOrigins, NamesOfProxiesAreChecked) {
  PageOrigins origins("127.0.0.1", 8080);
  for (const char* good :
       {"localhost", "a", "cut.example.org", "cut.example.org:8443", "https://cut.example.org",
        "HTTPS://Cut.Example.org/", "http://10.0.0.7:80", "[2001:db8::1]", "https://[2001:db8::1]:8443"})
    EXPECT_TRUE(origins.add_origin(good).ok()) << good;
  for (const char* bad : {"", "https://", "https://a/b", "a/", "a b", "ftp://a", "a:b", "a:65536", ":80", "[::1", "[x]",
                          "a,b", "*", "*.example.org", "user@a", "a?b"}) {
    const Status status = origins.add_origin(bad);
    ASSERT_FALSE(status.ok()) << bad;
    EXPECT_THAT(status.error().message,
                HasSubstr("is no name that a page may come from; give one such as cut.example.org"));
  }
}

TEST(PageOrigins, NumbersCountBeyondLoopbackAlone) {
  PageOrigins loopback("127.0.0.1", 8080), all("::", 8080);
  all.add_all_numbers();
  for (const char* host : {"10.0.0.7:8080", "[2001:db8::1]:8080", "10.0.0.7"}) {
    EXPECT_FALSE(loopback.admits_host(host)) << host;
    EXPECT_TRUE(all.admits_host(host)) << host;
  }
  EXPECT_TRUE(all.admits_origin("http://10.0.0.7:8080", "10.0.0.7:8080"));
  EXPECT_FALSE(all.admits_origin("http://10.0.0.7:3000", "10.0.0.7:8080"));
  for (const char* host : {"", ":8080", "[]", "10.0.0:8080x", "name"}) EXPECT_FALSE(all.admits_host(host)) << host;
}

TEST(PageOrigins, AProxysPortIsItsSchemesUnlessItIsSaid) {
  PageOrigins origins("127.0.0.1", 8080);
  ASSERT_TRUE(origins.add_origin("https://cut.example.org").ok());
  EXPECT_TRUE(origins.admits_origin("https://cut.example.org", "127.0.0.1:8080"));
  EXPECT_TRUE(origins.admits_origin("https://cut.example.org:443", "127.0.0.1:8080"));
  EXPECT_FALSE(origins.admits_origin("https://cut.example.org:8443", "127.0.0.1:8080"));
  EXPECT_FALSE(origins.admits_origin("http://cut.example.org", "127.0.0.1:8080"));
}

}  // namespace
}  // namespace kerf::page_origins_test
