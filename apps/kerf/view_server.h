// The server behind `kerf view` and the Python package's kerf.view(): carries messages between pages and an Engine, and serves the page's files. One
// thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/base/result.h"
#include "kerf/engine/engine.h"

namespace kerf::app {

/// The page: path ("/", "/assets/x.js") to content.
struct PageFile {
  std::string type;  ///< media type
  std::string bytes;
  bool gzip = false;       ///< `bytes` are compressed
  bool immutable = false;  ///< its name changes with its content
};
using PageFiles = std::map<std::string, PageFile>;

/// Reads all files below a folder. Bad input: no index.html there.
Result<PageFiles> read_page(const std::string& folder);
/// The page that was built into the program; empty if there is none.
PageFiles built_in_page();

struct ServerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;          ///< 0: any free one
  int tries = 20;                     ///< ports after `port` that are tried when it is taken
  std::string token;                  ///< not empty: pages must know it
  std::string ticket;                 ///< not empty: leads the first page that brings it to the token
  bool any_literal = false;           ///< a Host that is a number is ours: for addresses beyond loopback
  std::vector<std::string> hosts;     ///< names that a page may reach us by, beside loopback ones and `address`
  std::vector<std::string> origins;   ///< of proxies (page_origins.h)
  std::string embedders = "'none'";   ///< origins whose pages may show this one inside (CSP's frame-ancestors)
  std::function<PageFiles()> reload;  ///< set: files are read again for every request
};

class ViewServer {
 public:
  /// Opens the port. Errors: the port (and the next ones) in use, an address that is not one of this machine.
  static Result<ViewServer> create(Engine engine, PageFiles page, const ServerOptions& options);
  ViewServer(ViewServer&&) noexcept;
  ~ViewServer();

  [[nodiscard]] std::uint16_t port() const;
  /// Address to type into a browser, token included.
  [[nodiscard]] std::string address() const;
  /// The same for a command line, which other users can see: good once.
  [[nodiscard]] std::string opening_address() const;
  /// Serves until stop(), SIGINT or SIGTERM. `signals`: watch for them.
  void run(bool signals = true);
  /// From any thread.
  void stop();
  /// From any thread: the next page that brings this ticket is led to the token, instead of one with an older ticket.
  void expect(std::string ticket);
  /// In the child of a fork: the port then is free when the parent gives it back. Nothing else may be called there.
  void close_port_of_fork();
  [[nodiscard]] const Engine& engine() const;

 private:
  struct Impl;
  explicit ViewServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf::app
