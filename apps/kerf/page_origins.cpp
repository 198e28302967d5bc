#include "page_origins.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <charconv>
#include <optional>

#include "kerf/base/shown_text.h"

namespace kerf::app {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }
bool same_letters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

/// "name", "name:port", "[::1]:port".
struct Authority {
  std::string_view name;
  int port = -1;  ///< -1: none is given
};
std::optional<Authority> parse_authority(std::string_view text) {
  const std::size_t bracket = text.rfind(']');
  const std::size_t colon = text.find(':', bracket == std::string_view::npos ? 0 : bracket);
  Authority out{text.substr(0, colon), -1};
  if (out.name.empty()) return std::nullopt;
  if (colon == std::string_view::npos) return out;
  const std::string_view digits = text.substr(colon + 1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), out.port);
  if (error != std::errc() || end != digits.data() + digits.size() || out.port < 0 || out.port > 65535)
    return std::nullopt;
  return out;
}

std::optional<boost::asio::ip::address> number_of(std::string_view name) {
  boost::system::error_code error;
  const bool brackets = name.size() > 2 && name.front() == '[' && name.back() == ']';
  const auto address =
      boost::asio::ip::make_address(std::string(brackets ? name.substr(1, name.size() - 2) : name), error);
  if (error) return std::nullopt;
  return address;
}

struct SchemeAndRest {
  std::string_view scheme, rest;
};
SchemeAndRest split_scheme(std::string_view text) {
  for (const std::string_view scheme : {"http", "https"})
    if (text.size() > scheme.size() + 3 && same_letters(text.substr(0, scheme.size()), scheme) &&
        text.substr(scheme.size(), 3) == "://")
      return {scheme, text.substr(scheme.size() + 3)};
  return {{}, text};
}
int port_of(std::string_view scheme, const Authority& authority) {
  return authority.port >= 0 ? authority.port : scheme == "https" ? 443 : 80;
}

}  // namespace

PageOrigins::PageOrigins(std::string address, std::uint16_t port)
    : port_(port), hosts_{"127.0.0.1", "localhost", "[::1]"} {
  const bool brackets = address.find(':') != std::string::npos;
  hosts_.push_back(brackets ? "[" + address + "]" : std::move(address));
}

Status PageOrigins::add_origin(std::string_view text) {
  const auto bad = [&] {
    return bad_input(fmt::format(
        "\"{}\" is no name that a page may come from; give one such as cut.example.org, or https://cut.example.org:8443",
        shown(std::string(text))));
  };
  auto [scheme, rest] = split_scheme(text);
  if (!scheme.empty() && rest.ends_with('/')) rest.remove_suffix(1);
  const auto authority = parse_authority(rest);
  const auto is_name = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-'; };
  if (!authority) return bad();
  const bool letters =
      std::all_of(authority->name.begin(), authority->name.end(), [&](char c) { return is_name(lower(c)); });
  if (!letters && !(authority->name.front() == '[' && number_of(authority->name))) return bad();
  origins_.push_back({std::string(scheme), std::string(authority->name),
                      scheme.empty() ? authority->port : port_of(scheme, *authority)});
  return {};
}

bool PageOrigins::is_ours(std::string_view name) const {
  const auto is_it = [&](std::string_view other) { return same_letters(name, other); };
  return std::any_of(hosts_.begin(), hosts_.end(), is_it) ||
         std::any_of(origins_.begin(), origins_.end(), [&](const Origin& o) { return is_it(o.name); }) ||
         (any_number_ && number_of(name));
}

bool PageOrigins::admits_host(std::string_view host) const {
  const auto authority = parse_authority(host);
  return authority && is_ours(authority->name);
}

bool PageOrigins::admits_origin(std::string_view origin, std::string_view host) const {
  if (origin.empty()) return true;
  const auto [scheme, rest] = split_scheme(origin);
  if (scheme.empty()) return false;
  const auto from = parse_authority(rest);
  if (!from) return false;
  const int port = port_of(scheme, *from);
  if (same_letters(rest, host) || (scheme == "http" && port == port_)) return is_ours(from->name);
  return std::any_of(origins_.begin(), origins_.end(), [&, s = scheme](const Origin& o) {
    return same_letters(from->name, o.name) && (o.scheme.empty() || o.scheme == s) && (o.port < 0 || o.port == port);
  });
}

}  // namespace kerf::app
