// A page made of plain sockets: HTTP and WebSocket by hand, so that nothing of the server's library tests itself.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <zlib.h>

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "engine/page_messages.h"

namespace kerf::test {

/// Longest that a test waits for an answer; no result depends on it.
constexpr int kPatienceMs = 20'000;

class RawSocket {
 public:
  explicit RawSocket(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  RawSocket(const RawSocket&) = delete;
  RawSocket& operator=(const RawSocket&) = delete;
  ~RawSocket() { ::close(fd_); }
  [[nodiscard]] bool connected() const { return connected_; }
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  /// Waits until at least n bytes have come; false when the other side is gone or silent.
  bool need(std::size_t n) {
    while (buffer_.size() < n) {
      pollfd wait{fd_, POLLIN, 0};
      if (::poll(&wait, 1, kPatienceMs) <= 0) return false;
      char block[65536];
      const ssize_t got = ::recv(fd_, block, sizeof block, 0);
      if (got <= 0) return false;
      buffer_.append(block, static_cast<std::size_t>(got));
    }
    return true;
  }
  std::string take(std::size_t n) {
    std::string out = buffer_.substr(0, n);
    buffer_.erase(0, n);
    return out;
  }
  /// One HTTP response: head and body.
  std::pair<std::string, std::string> response() {
    std::size_t end = 0;
    while ((end = buffer_.find("\r\n\r\n")) == std::string::npos)
      if (!need(buffer_.size() + 1)) return {take(buffer_.size()), ""};
    std::string head = take(end + 4);
    std::size_t length = 0;
    const std::size_t field = head.find("Content-Length: ");
    if (field != std::string::npos) length = std::stoul(head.substr(field + 16));
    if (head.rfind("HTTP/1.1 101", 0) == 0) length = 0;
    if (!need(length)) return {head, take(buffer_.size())};
    return {head, take(length)};
  }

 private:
  int fd_;
  bool connected_ = false;
  std::string buffer_;
};

struct PageDoor {
  std::string host, origin, target = "/engine";
};

/// The message inside one of type 32; empty when it is damaged.
inline std::string unpacked(const std::string& message) {
  const auto number = [&](std::size_t at) {
    std::size_t n = 0;
    for (std::size_t k = 4; k-- > 0;) n = n << 8 | static_cast<unsigned char>(message[at + k]);
    return n;
  };
  if (message.size() < 16 || number(4) != message.size() || (number(12) + 3) / 4 * 4 + 16 != message.size()) return {};
  std::string out(number(8), '\0'), in = message.substr(16, number(12));
  z_stream stream{};
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return {};
  const bool whole = inflate(&stream, Z_FINISH) == Z_STREAM_END && stream.avail_in == 0 && stream.avail_out == 0;
  inflateEnd(&stream);
  return whole ? out : std::string();
}

class SocketPage {
 public:
  MirroredPage page;
  std::size_t packed_bytes = 0, packed = 0;  ///< messages that came packed, and their bytes
  std::string refusal;                       ///< head of the response when the handshake was refused

  explicit SocketPage(std::uint16_t port, PageDoor door = {}) : socket_(port) {
    if (door.host.empty()) door.host = "127.0.0.1:" + std::to_string(port);
    std::string request = "GET " + door.target + " HTTP/1.1\r\nHost: " + door.host +
                          "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    if (!door.origin.empty()) request += "Origin: " + door.origin + "\r\n";
    socket_.send(request + "\r\n");
    const auto [head, body] = socket_.response();
    open = head.rfind("HTTP/1.1 101", 0) == 0;
    if (open) {
      EXPECT_NE(head.find("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), std::string::npos);
    } else {
      refusal = head + body;
    }
  }
  bool open = false;
  std::string close_reason;  ///< what the server said when it closed

  bool say(const std::vector<std::byte>& message, unsigned char opcode = 2) {
    std::string frame;
    frame += static_cast<char>(0x80 | opcode);
    const std::size_t n = message.size();
    if (n < 126) {
      frame += static_cast<char>(0x80 | n);
    } else if (n < 65536) {
      frame += static_cast<char>(0x80 | 126);
      frame += static_cast<char>(n >> 8 & 255);
      frame += static_cast<char>(n & 255);
    } else {
      frame += static_cast<char>(0x80 | 127);
      for (int k = 7; k >= 0; --k) frame += static_cast<char>(n >> (8 * k) & 255);
    }
    const char mask[4] = {0x12, 0x34, 0x56, 0x78};
    frame.append(mask, 4);
    for (std::size_t i = 0; i < n; ++i) frame += static_cast<char>(static_cast<char>(message[i]) ^ mask[i & 3]);
    return socket_.send(frame);
  }
  bool raw(std::string_view bytes) { return socket_.send(bytes); }

  /// Reads one message; false when the server closed the connection.
  bool listen_once(bool acknowledge = true) {
    std::string message;
    for (;;) {
      if (!socket_.need(2)) return open = false;
      const std::string start = socket_.take(2);
      const unsigned opcode = static_cast<unsigned char>(start[0]) & 15u;
      std::size_t n = static_cast<unsigned char>(start[1]) & 127u;
      if (n >= 126) {
        const std::size_t more = n == 126 ? 2 : 8;
        if (!socket_.need(more)) return open = false;
        n = 0;
        for (const char c : socket_.take(more)) n = n << 8 | static_cast<unsigned char>(c);
      }
      if (!socket_.need(n)) return open = false;
      message += socket_.take(n);
      if (opcode == 8) {
        close_reason = message.size() > 2 ? message.substr(2) : "";  // after its number
        return open = false;
      }
      if (opcode == 9 || opcode == 10) {
        message.clear();
        continue;
      }
      if (static_cast<unsigned char>(start[0]) & 0x80u) break;
    }
    if (message.size() > 1 && message[0] == 32 && message[1] == 0) {
      ++packed;
      packed_bytes += message.size();
      message = unpacked(message);
      EXPECT_FALSE(message.empty()) << "a packed message is damaged";
    }
    const std::uint32_t seq = page.last_seq;
    page.hear({reinterpret_cast<const std::byte*>(message.data()), message.size()});
    if (acknowledge && page.last_seq != seq) say(page_ack(page.last_seq));
    return true;
  }
  /// Listens until the condition holds; false when it never does.
  template <class Condition>
  bool until(Condition&& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(kPatienceMs);
    while (!condition())
      if (!listen_once() || std::chrono::steady_clock::now() > end) return false;
    return true;
  }

 private:
  RawSocket socket_;
};

}  // namespace kerf::test
