// Who may come to a server of the page: by the address that a request names (Host), and by the page that it comes from (Origin).
//
// A browser sends the name that it was told. So a page from elsewhere can't give its own name to this machine (DNS rebinding), whatever port it
// knows. Ports may differ from the server's, as forwarded ones do.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/base/result.h"

namespace kerf::app {

class PageOrigins {
 public:
  /// A server at this address and port: it answers to that, and to this machine's own names.
  PageOrigins(std::string address, std::uint16_t port);
  /// Answers to this name too. `name`: without a port.
  void add_host(std::string name) { hosts_.push_back(std::move(name)); }
  /// Answers to all numbers: for addresses beyond loopback. No name, so nobody else can have pointed it here.
  void add_all_numbers() { any_number_ = true; }
  /// A proxy in front of the server: "name", "name:port", or an origin, "https://name" or "http://name:port". Bad input: anything else.
  Status add_origin(std::string_view text);

  /// May a request come to this Host: "name", "name:port", "[::1]:port"?
  [[nodiscard]] bool admits_host(std::string_view host) const;
  /// May a page of this Origin connect, in a request to that Host? It is the server's own page, or one of a proxy. None: no browser.
  [[nodiscard]] bool admits_origin(std::string_view origin, std::string_view host) const;

 private:
  struct Origin {
    std::string scheme;  ///< "http" or "https"; empty: both
    std::string name;
    int port = -1;  ///< -1: the scheme's own, or any where no scheme is given
  };
  [[nodiscard]] bool is_ours(std::string_view name) const;

  std::uint16_t port_ = 0;
  bool any_number_ = false;
  std::vector<std::string> hosts_;
  std::vector<Origin> origins_;
};

}  // namespace kerf::app
