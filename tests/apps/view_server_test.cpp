// The server of `kerf view`, over real sockets.
#include "view_server.h"
#include "gunzip.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "kerf/base/random.h"
#include "socket_page.h"

namespace kerf::app::view_server_test {
namespace {

using namespace kerf::test;

Engine steak(std::uint64_t session = 1, EngineOptions options = {}) {
  SceneSource source;
  source.name = "steak";
  source.text =
      "[body]\nmodel = \"steak\"\n[simulation]\ntime_step = 0.01\ngravity = [0, 0, -1]\n"
      "[[fix]]\nhalf_space = { point = [0, 0.055, 0], normal = [0, 1, 0] }\n";
  options.session_id = session;
  auto engine = Engine::create(source, std::move(options));
  EXPECT_TRUE(engine.ok());
  return std::move(engine).value();
}

PageFiles files() {
  PageFiles page;
  page["/"] = page["/index.html"] = {"text/html; charset=utf-8", "<p>kerf</p>", false, false};
  // gzip of "console.log(1);" twenty times
  constexpr char kPacked[] =
      "\x1f\x8b\x08\x00\x00\x00\x00\x00\x02\x03\x4b\xce\xcf\x2b\xce\xcf\x49\xd5\xcb\xc9\x4f\xd7\x30\xd4\xb4\x4e\x1e\xe5\xe2\xe6\x02\x00"
      "\x20\xc5\x26\x65\x2c\x01\x00";
  page["/assets/a.js"] = {"text/javascript; charset=utf-8", std::string(kPacked, sizeof kPacked), true, true};
  return page;
}

/// A server in a thread of its own.
class Running {
 public:
  explicit Running(ServerOptions options = any_port(), std::uint64_t session = 1, const EngineOptions& engine = {})
      : server_(make(options, session, engine)), thread_([this] { server_.run(false); }) {}
  ~Running() {
    server_.stop();
    thread_.join();
  }
  [[nodiscard]] std::uint16_t port() const { return server_.port(); }
  static ServerOptions any_port() {
    ServerOptions options;
    options.port = 0;
    return options;
  }

 private:
  static ViewServer make(const ServerOptions& options, std::uint64_t session, const EngineOptions& engine) {
    auto server = ViewServer::create(steak(session, engine), files(), options);
    EXPECT_TRUE(server.ok()) << (server.ok() ? "" : server.error().message);
    return std::move(server).value();
  }
  ViewServer server_;
  std::thread thread_;
};

std::pair<std::string, std::string> get(std::uint16_t port, const std::string& target, const std::string& host = {},
                                        const std::string& method = "GET", const std::string& encoding = "gzip") {
  RawSocket socket(port);
  socket.send(method + " " + target +
              " HTTP/1.1\r\nHost: " + (host.empty() ? "127.0.0.1:" + std::to_string(port) : host) +
              "\r\nAccept-Encoding: " + encoding + "\r\nConnection: close\r\n\r\n");
  return socket.response();
}
bool is(const std::pair<std::string, std::string>& response, int status) {
  return response.first.rfind("HTTP/1.1 " + std::to_string(status), 0) == 0;
}

constexpr Point kEye{0.02, -0.05, 0.6};

TEST(ViewServer, ServesThePageWithItsPolicy) {
  const Running server;
  const auto page = get(server.port(), "/");
  EXPECT_TRUE(is(page, 200));
  EXPECT_EQ(page.second, "<p>kerf</p>");
  EXPECT_NE(page.first.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
  EXPECT_NE(page.first.find("X-Content-Type-Options: nosniff"), std::string::npos);
  EXPECT_NE(page.first.find("Cache-Control: no-cache"), std::string::npos);
  const auto script = get(server.port(), "/assets/a.js?x=1");
  EXPECT_TRUE(is(script, 200));
  EXPECT_NE(script.first.find("Content-Encoding: gzip"), std::string::npos);
  EXPECT_NE(script.first.find("immutable"), std::string::npos);
  // Whoever does not read gzip gets it unpacked.
  const auto plain = get(server.port(), "/assets/a.js", {}, "GET", "identity");
  EXPECT_TRUE(is(plain, 200));
  EXPECT_EQ(plain.first.find("Content-Encoding"), std::string::npos);
  std::string text;
  for (int i = 0; i < 20; ++i) text += "console.log(1);";
  EXPECT_EQ(plain.second, text);
  EXPECT_FALSE(gunzip("GIF89a, which is no gzip file").has_value());
  EXPECT_FALSE(gunzip(std::string_view("\x1f\x8b\x08\x00\x00\x00\x00\x00\x02\x03 broken off here", 30)).has_value());
  EXPECT_TRUE(is(get(server.port(), "/../../etc/passwd"), 404));
  EXPECT_TRUE(is(get(server.port(), "/assets/"), 404));
  EXPECT_TRUE(is(get(server.port(), "/", {}, "POST"), 405));
  EXPECT_TRUE(is(get(server.port(), "/engine"), 426));
  EXPECT_EQ(get(server.port(), "/", {}, "HEAD").first.rfind("HTTP/1.1 200", 0), 0u);
}

TEST(ViewServer, ForeignHostsAndOriginsAreRefused) {
  const Running server;
  const std::string port = std::to_string(server.port());
  for (const std::string& host : {"localhost:" + port, "LocalHost:" + port, "[::1]:" + port, "127.0.0.1:" + port,
                                  std::string("localhost:9000"), std::string("127.0.0.1")})  // a port that is forwarded
    EXPECT_TRUE(is(get(server.port(), "/", host), 200)) << host;
  for (const std::string& host :
       {std::string("evil.example"), "evil.example:" + port, "127.0.0.1:" + port + "x",
        "127.0.0.1.evil.example:" + port, std::string("localhost:65536"), std::string("10.0.0.7")})
    EXPECT_TRUE(is(get(server.port(), "/", host), 403)) << host;
  for (const std::string& origin : {"http://127.0.0.1:" + port, "http://localhost:" + port, std::string()})
    EXPECT_TRUE(SocketPage(server.port(), {"", origin}).open) << origin;
  for (const std::string& origin :
       {std::string("http://evil.example"), std::string("null"), "http://127.0.0.1:" + port + ".evil.example",
        std::string("http://127.0.0.1:1"), "http://evil.example:" + port}) {
    const SocketPage page(server.port(), {"", origin});
    EXPECT_FALSE(page.open) << origin;
    EXPECT_NE(page.refusal.find("403"), std::string::npos);
    EXPECT_NE(page.refusal.find("--origin"), std::string::npos);
  }
  EXPECT_FALSE(SocketPage(server.port(), {"evil.example:" + port, ""}).open);
  // Through a port that is forwarded: the page's own address, and no other page of this machine.
  EXPECT_TRUE(SocketPage(server.port(), {"localhost:9000", "http://localhost:9000"}).open);
  EXPECT_FALSE(SocketPage(server.port(), {"localhost:9000", "http://localhost:3000"}).open);
  EXPECT_FALSE(SocketPage(server.port(), {"localhost:9000", "http://evil.example:9000"}).open);
}

TEST(ViewServer, ProxiesThatAreNamedLeadToIt) {
  ServerOptions options = Running::any_port();
  options.origins = {"cut.example.org", "https://lab.example.org:8443"};
  const Running server(options);
  for (const char* host : {"cut.example.org", "Cut.Example.org:443", "lab.example.org:8443", "localhost:9000"})
    EXPECT_TRUE(is(get(server.port(), "/", host), 200)) << host;
  for (const char* host : {"example.org", "cut.example.org.evil.example", "evil.example"})
    EXPECT_TRUE(is(get(server.port(), "/", host), 403)) << host;
  const std::string own = "127.0.0.1:" + std::to_string(server.port());
  for (const std::string& host : {own, std::string("cut.example.org")})  // a proxy that names itself, or us
    for (const char* origin :
         {"https://cut.example.org", "http://cut.example.org:8080", "https://lab.example.org:8443"})
      EXPECT_TRUE(SocketPage(server.port(), {host, origin}).open) << host << " " << origin;
  for (const char* origin : {"https://lab.example.org", "http://lab.example.org:8443", "https://example.org",
                             "https://cut.example.org.evil.example"})
    EXPECT_FALSE(SocketPage(server.port(), {own, origin}).open) << origin;
}

TEST(ViewServer, RequestsThatAreNoneGetAnAnswer) {
  const Running server;
  const std::string host = "Host: 127.0.0.1:" + std::to_string(server.port()) + "\r\n";
  const auto answer = [&](const std::string& request) {
    RawSocket socket(server.port());
    socket.send(request);
    return socket.response();
  };
  for (const std::string body : {"Content-Length: 4\r\n\r\nabcd", "Content-Length: 9999999999\r\n\r\nab",
                                 "Transfer-Encoding: chunked\r\n\r\n4\r\nabcd\r\n0\r\n\r\n"}) {
    const auto got = answer("POST / HTTP/1.1\r\n" + host + body);
    EXPECT_TRUE(is(got, 405)) << got.first;
    EXPECT_NE(got.first.find("Connection: close"), std::string::npos) << got.first;
  }
  EXPECT_TRUE(is(answer("GET / HTTP/1.1\r\n" + host + host + "\r\n"), 400));
  EXPECT_TRUE(is(answer("GET / HTTP/1.1\r\n\r\n"), 400));
  EXPECT_TRUE(is(get(server.port(), "/"), 200));
}

// Other users of this machine see the command line of the browser that is opened.
TEST(ViewServer, TheAddressOfACommandLineIsGoodOnce) {
  ServerOptions options = Running::any_port();
  options.token = "0123456789abcdef";
  options.ticket = "fedcba9876543210";
  const Running server(options);
  EXPECT_TRUE(is(get(server.port(), "/?ticket=fedcba9876543211"), 200));
  const auto led = get(server.port(), "/?ticket=fedcba9876543210");
  EXPECT_TRUE(is(led, 303));
  EXPECT_NE(led.first.find("Location: /?token=0123456789abcdef\r\n"), std::string::npos) << led.first;
  EXPECT_NE(led.first.find("Cache-Control: no-store"), std::string::npos);
  const auto again = get(server.port(), "/?ticket=fedcba9876543210");
  EXPECT_TRUE(is(again, 200));
  EXPECT_EQ((again.first + again.second).find("0123456789abcdef"), std::string::npos);
}

TEST(ViewServer, ATokenIsNeeded) {
  ServerOptions options = Running::any_port();
  options.token = "0123456789abcdef";
  options.any_literal = true;
  const Running server(options);
  EXPECT_FALSE(SocketPage(server.port()).open);
  EXPECT_FALSE(SocketPage(server.port(), {"", "", "/engine?token=0123456789abcdeg"}).open);
  EXPECT_FALSE(SocketPage(server.port(), {"", "", "/engine?token=0123456789abcde"}).open);
  EXPECT_FALSE(SocketPage(server.port(), {"", "", "/engine?xtoken=0123456789abcdef"}).open);
  EXPECT_TRUE(SocketPage(server.port(), {"", "", "/engine?token=0123456789abcdef"}).open);
  // A tablet types an address, not a name that somebody else could point here.
  const std::string port = std::to_string(server.port());
  EXPECT_TRUE(is(get(server.port(), "/", "192.168.1.7:" + port), 200));
  EXPECT_TRUE(is(get(server.port(), "/", "evil.example:" + port), 403));
}

TEST(ViewServer, TwoPagesSeeOneCut) {
  const Running server;
  SocketPage a(server.port()), b(server.port());
  ASSERT_TRUE(a.open && b.open);
  a.say(page_hello());
  ASSERT_TRUE(a.until([&] { return a.page.held && a.page.frames > 0; }));
  b.say(page_hello());
  ASSERT_TRUE(b.until([&] { return b.page.bodies == 1 && b.page.clients == 2; }));
  EXPECT_FALSE(b.page.held);
  a.say(page_tool(1, 0, 0, {ray_between(kEye, {-0.005, -0.13, 0})}));
  for (int k = 1; k < 20; ++k) a.say(page_tool(1, 0, 1, {ray_between(kEye, {-0.005, -0.13 + 0.013 * k, 0})}));
  a.say(page_tool(2, 0, 2, {ray_between(kEye, {-0.005, 0.13, 0})}));
  ASSERT_TRUE(a.until([&] { return !a.page.cuts.empty(); }));
  ASSERT_TRUE(b.until([&] { return !b.page.cuts.empty(); }));
  EXPECT_EQ(b.page.cuts[0].pieces, 2u);
  EXPECT_EQ(b.page.cuts[0].invariants, 0u);
  EXPECT_EQ(a.page.body.wall, b.page.body.wall);
  EXPECT_EQ(a.page.body.version, b.page.body.version);
  a.say(page_command(3, 6));
  ASSERT_TRUE(b.until([&] { return b.page.cuts.size() == 2; }));
  EXPECT_TRUE(b.page.body.wall.empty());
}

TEST(ViewServer, APageThatUnpacksIsToldTheSame) {
  const Running server;
  SocketPage plain(server.port()), packed(server.port(), {{}, {}, "/engine?packed=1"});
  ASSERT_TRUE(plain.open && packed.open);
  plain.say(page_hello());
  ASSERT_TRUE(plain.until([&] { return plain.page.held && plain.page.frames > 0; }));
  packed.say(page_hello());
  ASSERT_TRUE(packed.until([&] { return packed.page.bodies == 1 && packed.page.frames > 0; }));
  EXPECT_EQ(plain.packed, 0u);
  EXPECT_EQ(packed.packed, 1u);
  const auto& body = packed.page.body;
  EXPECT_EQ(body.rest, plain.page.body.rest);
  EXPECT_EQ(body.normal, plain.page.body.normal);
  EXPECT_EQ(body.skin, plain.page.body.skin);
  EXPECT_EQ(body.copies, plain.page.body.copies);
  EXPECT_LT(packed.packed_bytes, (24 * body.rest.size() + 12 * body.skin.size()) * 6 / 10);
  // What a cut changes goes as it is.
  plain.say(page_tool(1, 4, 0, {ray_between(kEye, {-0.005, -0.13, 0})}));
  plain.say(page_tool(2, 4, 2, {ray_between(kEye, {-0.005, 0.13, 0})}));
  ASSERT_TRUE(plain.until([&] { return !plain.page.cuts.empty(); }));
  ASSERT_TRUE(packed.until([&] { return !packed.page.cuts.empty(); }));
  EXPECT_EQ(packed.packed, 1u);
  EXPECT_FALSE(body.wall.empty());
  EXPECT_EQ(body.wall, plain.page.body.wall);
}

TEST(ViewServer, GarbageIsAnsweredAndThenTheDoorCloses) {
  const Running server;
  SocketPage good(server.port()), bad(server.port());
  good.say(page_hello());
  bad.say(page_hello());
  ASSERT_TRUE(good.until([&] { return good.page.frames > 0; }));
  Random random(9);
  for (int i = 0; i < 120; ++i) {
    std::vector<std::byte> noise(static_cast<std::size_t>(random.index(300)));
    for (std::byte& x : noise) x = static_cast<std::byte>(random.index(256));
    if (!bad.say(noise)) break;
  }
  while (bad.listen_once()) {}
  EXPECT_FALSE(bad.open);
  EXPECT_GT(bad.page.errors.size(), 50u);
  // What the server says last may be lost with what it has not read.
  if (!bad.close_reason.empty()) {
    EXPECT_EQ(bad.close_reason, "too many bad messages");
  }
  // Frames that are no WebSocket, half a message, text instead of binary: the others go on.
  {
    SocketPage rude(server.port());
    rude.raw(std::string(5000, '\x7f'));
    SocketPage half(server.port());
    half.raw(std::string("\x82\xfe\x10", 3));
    SocketPage text(server.port());
    text.say(page_hello());
    text.say({std::byte{'h'}, std::byte{'i'}}, 1);
    EXPECT_TRUE(text.until([&] { return !text.page.errors.empty(); }));
    EXPECT_EQ(text.page.errors.front().text, "a text of 2 bytes came; messages are binary");
    SocketPage large(server.port());
    large.say(page_hello());
    large.say(std::vector<std::byte>(3u << 20));
    while (large.listen_once()) {}
    EXPECT_FALSE(large.open);
    RawSocket endless(server.port());
    endless.send("GET / HTTP/1.1\r\nHost: x\r\n");
    for (int i = 0; i < 3000; ++i)
      if (!endless.send("X-Long: aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\r\n")) break;
  }
  const std::uint32_t before = good.page.frames;
  EXPECT_TRUE(good.until([&] { return good.page.frames > before + 10; }));
  EXPECT_TRUE(good.page.errors.empty());
}

TEST(ViewServer, ASlowPageLosesFramesAndHoldsNobodyUp) {
  const Running server;
  SocketPage slow(server.port()), quick(server.port());
  slow.say(page_hello());
  quick.say(page_hello());
  ASSERT_TRUE(quick.until([&] { return quick.page.frames > 60; }));
  // Nothing was acknowledged: two frames wait in the socket, the rest was dropped.
  ASSERT_TRUE(slow.open);
  while (slow.page.dropped < 20) ASSERT_TRUE(slow.listen_once(false));
  EXPECT_EQ(slow.page.frames, 2u);
  slow.say(page_ack(slow.page.last_seq));
  while (slow.page.frames < 3) ASSERT_TRUE(slow.listen_once(false));
}

// A page that asks for more than it reads is not heard until it has read; it is not given up, and no other one waits for it.
TEST(ViewServer, APageThatOnlyAsksWaitsForItself) {
  const Running server;
  SocketPage asks(server.port()), quick(server.port());
  constexpr std::uint32_t kTimes = 2000;
  for (std::uint32_t i = 0; i < kTimes; ++i) ASSERT_TRUE(asks.say(page_hello()));
  quick.say(page_hello());
  ASSERT_TRUE(quick.until([&] { return quick.page.frames > 30; }));
  ASSERT_TRUE(asks.until([&] { return asks.page.bodies == kTimes; }));
  ASSERT_TRUE(asks.until([&] { return asks.page.frames > 3; }));
  EXPECT_TRUE(asks.page.errors.empty());
}

// What a page never reads is not kept for it, though the socket has not taken all of one message yet.
TEST(ViewServer, APageThatReadsNothingIsCutOff) {
  EngineOptions engine;
  engine.most_unread = std::size_t{1} << 20;
  const Running server(Running::any_port(), 1, engine);
  SocketPage quick(server.port()), deaf(server.port());
  quick.say(page_hello());
  ASSERT_TRUE(quick.until([&] { return quick.page.held; }));
  deaf.say(page_hello());
  ASSERT_TRUE(quick.until([&] { return quick.page.clients == 2; }));
  // The kernel takes some megabytes for it; each reset tells all pages the whole body.
  constexpr std::uint32_t kMostResets = 500;
  for (std::uint32_t i = 1; i <= kMostResets && quick.page.clients == 2; ++i) {
    quick.say(page_command(i, 5));
    ASSERT_TRUE(quick.until([&] { return quick.page.bodies > i; }));
  }
  EXPECT_TRUE(quick.until([&] { return quick.page.clients == 1; }));
  while (deaf.listen_once(false)) {}
  EXPECT_FALSE(deaf.open);
}

TEST(ViewServer, KilledAndStartedAgainOnTheSamePort) {
  MirroredPage kept;
  ServerOptions options = Running::any_port();
  {
    const Running server(options, 7);
    options.port = server.port();
    SocketPage page(server.port());
    page.say(page_hello());
    ASSERT_TRUE(page.until([&] { return page.page.frames > 3; }));
    kept = page.page;
    // The connection breaks and comes back: nothing has to be sent again.
    SocketPage again(server.port());
    again.page = kept;
    again.say(page_hello(kept.session, kept.body.body, kept.body.version));
    ASSERT_TRUE(again.until([&] { return again.page.frames > kept.frames + 3; }));
    EXPECT_EQ(again.page.bodies, kept.bodies);
  }
  EXPECT_FALSE(RawSocket(options.port).connected());
  const Running server(options, 8);
  EXPECT_EQ(server.port(), options.port);
  SocketPage page(server.port());
  page.page = kept;
  page.page.last_seq = 0;
  page.say(page_hello(kept.session, kept.body.body, kept.body.version));
  ASSERT_TRUE(page.until([&] { return page.page.frames > kept.frames + 3; }));
  EXPECT_EQ(page.page.bodies, kept.bodies + 1);  // another session: the whole body
}

/// A server that is asked for something which takes a minute, and told to end.
void end_while_busy() {
  ServerOptions options = Running::any_port();
  options.reload = [] {
    std::raise(SIGTERM);
    std::this_thread::sleep_for(std::chrono::minutes(1));
    return files();
  };
  auto server = ViewServer::create(steak(), files(), options);
  std::thread([port = server->port()] { get(port, "/"); }).detach();
  server->run();
}

TEST(ViewServerDeathTest, EndsWhenToldToWhateverIsBeingComputed) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EXIT(end_while_busy(), ::testing::ExitedWithCode(1), "without waiting");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
}

TEST(ViewServer, APortInUseGivesTheNextOrAClearError) {
  ServerOptions options = Running::any_port();
  const Running first(options);
  options.port = first.port();
  options.tries = 20;
  auto second = ViewServer::create(steak(), files(), options);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_GT(second->port(), first.port());
  EXPECT_EQ(second->address(), "http://127.0.0.1:" + std::to_string(second->port()) + "/");
  options.tries = 0;
  auto third = ViewServer::create(steak(), files(), options);
  ASSERT_FALSE(third.ok());
  EXPECT_NE(third.error().message.find("--port"), std::string::npos);
  options.address = "not an address";
  EXPECT_FALSE(ViewServer::create(steak(), files(), options).ok());
  options.address = "203.0.113.77";
  EXPECT_FALSE(ViewServer::create(steak(), files(), options).ok());
}

TEST(ViewServer, ReadsThePageFromAFolder) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "kerf_page_test";
  std::filesystem::create_directories(folder / "assets");
  std::ofstream(folder / "index.html") << "<p>there</p>";
  std::ofstream(folder / "assets/x.css") << "p{}";
  auto page = read_page(folder.string());
  ASSERT_TRUE(page.ok());
  EXPECT_EQ((*page)["/"].bytes, "<p>there</p>");
  EXPECT_EQ((*page)["/assets/x.css"].type, "text/css; charset=utf-8");
  auto none = read_page(folder.string() + "/nowhere");
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("npm"), std::string::npos);
}

}  // namespace
}  // namespace kerf::app::view_server_test
