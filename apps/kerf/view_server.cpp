#include "view_server.h"

#include <fmt/format.h>

#include <utility>  // before Beast 1.74

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include <fcntl.h>
#include <unistd.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include "exit_status.h"
#include "gunzip.h"
#include "kerf/base/shown_text.h"
#include "kerf/base/stopwatch.h"
#include "kerf/mesh/whole_file.h"
#include "packed.h"
#include "page_origins.h"

namespace kerf::app {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::seconds kHttpTimeout{30};
constexpr std::chrono::microseconds kTick{16667};
/// A page that does something has a tick at once, but not more often than this.
constexpr std::chrono::milliseconds kLeastTick{4};
/// At most so often memory is given back to the system: that takes some milliseconds of a large heap. At half, a page that is loaded again and
/// again costs twice as many of them; at twice, the memory of pages that have gone stays a second longer.
constexpr std::chrono::seconds kMemoryEvery{1};
constexpr std::size_t kMostConnections =
    64;  ///< requests; pages, which have a limit of their own, are no requests any more
constexpr std::size_t kMostPages = 64;
constexpr std::size_t kMostRequestHeader = 16 << 10;

/// What the page may load: its own files, images that it makes, a socket to us.
constexpr const char* kPolicy =
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "worker-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors ";

constexpr std::string_view kOnlyGet = "Only GET and HEAD.";

std::string_view view(beast::string_view s) { return {s.data(), s.size()}; }

/// Takes as long whatever the guess has in common with the token.
bool same_token(std::string_view guess, std::string_view token) {
  unsigned different = guess.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < token.size(); ++i)
    different |= static_cast<unsigned char>(token[i]) ^ static_cast<unsigned char>(i < guess.size() ? guess[i] : '\0');
  return different == 0;
}

/// The value of a key in the query of a request's target.
std::string_view query_value(std::string_view target, std::string_view key) {
  const std::size_t mark = target.find('?');
  if (mark == std::string_view::npos) return {};
  std::string_view rest = target.substr(mark + 1);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view item = rest.substr(0, end);
    if (item.size() > key.size() && item.substr(0, key.size()) == key && item[key.size()] == '=')
      return item.substr(key.size() + 1);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return {};
}

/// Programs that this one starts don't have the socket too: it would stay open for as long as they run.
void keep_from_programs(int socket) { ::fcntl(socket, F_SETFD, FD_CLOEXEC); }

std::string media_type(const std::string& path) {
  static const std::pair<const char*, const char*> kTypes[] = {{".html", "text/html; charset=utf-8"},
                                                               {".js", "text/javascript; charset=utf-8"},
                                                               {".css", "text/css; charset=utf-8"},
                                                               {".svg", "image/svg+xml"},
                                                               {".jpg", "image/jpeg"},
                                                               {".json", "application/json"},
                                                               {".png", "image/png"},
                                                               {".wasm", "application/wasm"},
                                                               {".woff2", "font/woff2"},
                                                               {".ico", "image/x-icon"},
                                                               {".txt", "text/plain; charset=utf-8"}};
  for (const auto& [ending, type] : kTypes)
    if (path.size() > std::string_view(ending).size() && path.ends_with(ending)) return type;
  return "application/octet-stream";
}

}  // namespace

Result<PageFiles> read_page(const std::string& folder) {
  namespace fs = std::filesystem;
  PageFiles files;
  std::error_code code;
  for (auto it = fs::recursive_directory_iterator(folder, code); !code && it != fs::recursive_directory_iterator();
       it.increment(code)) {
    if (!it->is_regular_file(code)) continue;
    auto bytes = read_whole_file(it->path().string(), kOtherFile);
    if (!bytes) continue;
    const std::string path = "/" + fs::relative(it->path(), folder, code).generic_string();
    files[path] = {media_type(path), std::string(bytes->view()), false, path.starts_with("/assets/")};
  }
  const auto index = files.find("/index.html");
  if (index == files.end())
    return bad_input(
        fmt::format("there is no page in {}: build it with `npm ci && npm run build` in apps/viewer, and give its "
                    "folder dist",
                    shown(folder)));
  files["/"] = index->second;
  return files;
}

// -------------------------------------------------------------------------------------------------------------------

namespace {

/// Watches for signals in a thread of its own, and calls `end` in the server's at the first. When the server doesn't end within a while, or at the second, it ends the
/// process at once: a step may be under way that takes long. No file is half written then, each gets its name when it is complete.
class SignalWatch {
 public:
  SignalWatch(asio::io_context& server, std::function<void()> end)
      : server_(server), end_(std::move(end)), signals_(io_, SIGINT, SIGTERM), timer_(io_) {
    error_code ignored;
    signals_.add(SIGHUP, ignored);  // the terminal was closed
    wait();
    thread_ = std::thread([this] { io_.run(); });
  }
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  ~SignalWatch() {
    io_.stop();
    thread_.join();
  }

 private:
  static constexpr auto kPatience = std::chrono::milliseconds(1500);

  void wait() {
    signals_.async_wait([this](error_code error, int) {
      if (error) return;
      if (told_) end_process();
      told_ = true;
      asio::post(server_, end_);
      timer_.expires_after(kPatience);
      timer_.async_wait([](error_code off) {
        if (!off) end_process();
      });
      wait();
    });
  }
  [[noreturn]] static void end_process() {
    constexpr std::string_view kWhy = "kerf: stopped while a step was being computed, without waiting for its end\n";
    (void)!::write(STDERR_FILENO, kWhy.data(), kWhy.size());
    ::_exit(kRunFailed);
  }

  asio::io_context& server_;
  std::function<void()> end_;
  asio::io_context io_;
  asio::signal_set signals_;
  asio::steady_timer timer_;
  bool told_ = false;
  std::thread thread_;
};

}  // namespace

struct ViewServer::Impl {
  class Page;

  Impl(Engine e, PageFiles p, ServerOptions o)
      : engine(std::move(e)), page(std::move(p)), options(std::move(o)), acceptor(io), timer(io) {}

  class Request;
  /// Before io: requests that end with it leave the list. By age: when there are too many, those go first that say nothing.
  std::map<std::uint64_t, Request*> requests;
  std::uint64_t next_request = 0;
  asio::io_context io{1};
  Engine engine;
  PageFiles page;
  ServerOptions options;
  tcp::acceptor acceptor;
  asio::steady_timer timer;
  std::uint16_t port = 0;
  std::optional<PageOrigins> origins;  ///< from open() on
  int listening = -1;                  ///< descriptor
  std::set<std::shared_ptr<Page>> pages;
  Packer packer;
  Clock::time_point last_tick, next_tick, next_memory;
  bool stopping = false, ticking = false, memory_due = false;

  Status open();
  Status admit();
  void accept();
  void tick();
  void step_on();
  void make_room();
  void wait_for_tick();
  void tick_soon();
  void flush();
  void give_memory_back();
  void shut_down();
  /// "http://address:port/"; on all addresses: that of this machine for itself.
  [[nodiscard]] std::string root() const {
    const std::string& own = options.address;
    const bool brackets = own.find(':') != std::string::npos;
    const std::string name = own == "0.0.0.0" ? "127.0.0.1" : own == "::" ? "[::1]" : brackets ? "[" + own + "]" : own;
    return fmt::format("http://{}:{}/", name, port);
  }
  /// Is it the ticket? It then is used up.
  bool take_ticket(std::string_view ticket);
};

/// One page's socket. Reads messages, and writes one at a time: what waits, waits in the engine.
class ViewServer::Impl::Page : public std::enable_shared_from_this<Page> {
 public:
  /// `unpacks`: it wants large messages packed.
  Page(Impl& server, tcp::socket socket, bool unpacks)
      : server_(server), socket_(std::move(socket)), unpacks_(unpacks) {}

  void start(http::request<http::empty_body> request) {
    request_ = std::move(request);
    auto timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeout.idle_timeout = std::chrono::seconds(60);
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.set_option(
        websocket::stream_base::decorator([](websocket::response_type& r) { r.set(http::field::server, "kerf"); }));
    socket_.read_message_max(protocol::kMaxUploadBytes);
    socket_.auto_fragment(false);
    socket_.binary(true);
    error_code ignored;
    socket_.next_layer().set_option(tcp::no_delay(true), ignored);
    socket_.async_accept(request_, [self = shared_from_this()](error_code error) { self->accepted(error); });
  }
  void write() {
    if (!open_) return;
    if (server_.engine.overflows(client_)) return close("too slow: too much of what was sent is unread");
    if (writing_) return;
    if (server_.engine.gives_up(client_)) return close("too many bad messages");
    message_ = server_.engine.next(client_);
    if (!message_) return;
    writing_ = true;
    sent_ = unpacks_ ? server_.packer(message_) : message_;
    socket_.async_write(asio::buffer(sent_->data(), sent_->size()),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          self->writing_ = false;
                          self->message_.reset();
                          self->sent_.reset();
                          if (error) return self->gone();
                          self->write();
                          self->read_on();
                        });
  }
  /// Reads, unless what the page has been answered is to be read first.
  void read_on() {
    if (!open_ || reading_ || server_.engine.holds_back(client_)) return;
    reading_ = true;
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) { self->have_read(error); });
  }
  void close(const char* why) {
    if (!open_) return;
    // What a page has still to be told goes first (an error that says why), as far as it reads at all.
    open_ = false;
    server_.engine.disconnect(client_);
    if (!writing_) {
      socket_.async_close(websocket::close_reason(websocket::close_code::policy_error, why),
                          [self = shared_from_this()](error_code) { self->gone(); });
    } else {
      gone();
    }
  }
  /// The server ends.
  void end() {
    error_code ignored;
    open_ = false;
    socket_.next_layer().shutdown(tcp::socket::shutdown_both, ignored);
    socket_.next_layer().close(ignored);
  }

 private:
  void accepted(error_code error) {
    if (error) return gone();
    open_ = true;
    client_ = server_.engine.connect();
    server_.pages.insert(shared_from_this());
    read_on();
  }
  void have_read(error_code error) {
    reading_ = false;
    if (error || !open_) return gone();
    const auto data = buffer_.cdata();
    if (socket_.got_binary()) {
      server_.engine.receive(client_, {static_cast<const std::byte*>(data.data()), data.size()});
    } else {
      server_.engine.refuse(client_, fmt::format("a text of {} bytes came; messages are binary", data.size()));
    }
    buffer_.consume(buffer_.size());
    server_.flush();  // patches before anything else
    if (server_.engine.tick_wanted()) server_.tick_soon();
    read_on();
  }
  void gone() {
    const auto self = shared_from_this();
    if (open_) {
      open_ = false;
      server_.engine.disconnect(client_);
    }
    error_code ignored;
    socket_.next_layer().close(ignored);
    if (server_.pages.erase(self) == 0) return;
    server_.memory_due = true;
    if (!server_.stopping) server_.flush();
  }

  Impl& server_;
  websocket::stream<tcp::socket> socket_;
  http::request<http::empty_body> request_;
  beast::flat_buffer buffer_;
  protocol::Message message_, sent_;  ///< what is under way, and as it goes over the wire
  const bool unpacks_;
  std::uint32_t client_ = 0;
  bool open_ = false, writing_ = false, reading_ = false;
};

/// One HTTP connection, until it ends or becomes a page's socket.
class ViewServer::Impl::Request : public std::enable_shared_from_this<Request> {
 public:
  Request(Impl& server, tcp::socket socket)
      : server_(server), number_(server.next_request++), stream_(std::move(socket)) {
    server_.requests[number_] = this;
  }
  ~Request() { server_.requests.erase(number_); }
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

  /// Does it wait for its client to say something?
  [[nodiscard]] bool silent() const { return silent_; }
  void give_up() {
    silent_ = false;
    error_code ignored;
    stream_.socket().close(ignored);  // what it waits for ends with an error, and so does it
  }

  void read() {
    parser_.emplace();  // a parser serves one request
    parser_->body_limit(0);
    parser_->header_limit(kMostRequestHeader);
    silent_ = true;
    stream_.expires_after(kHttpTimeout);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) { self->have_read(error); });
  }

 private:
  void have_read(error_code error) {
    silent_ = false;
    const bool has_body = error == http::error::unexpected_body || error == http::error::body_limit;
    if (error && !has_body) return end();
    http::request<http::empty_body> request = parser_->release();
    if (has_body) {
      request.keep_alive(false);  // the rest of it is not read
      return refuse(request, http::status::method_not_allowed, kOnlyGet);
    }
    if (request.count(http::field::host) != 1)  // RFC 9112, 3.2
      return refuse(request, http::status::bad_request, "A request has one Host line.");
    const std::string target(view(request.target()));
    const std::string_view path = std::string_view(target).substr(0, target.find('?'));
    const std::string_view host = view(request[http::field::host]);
    if (!server_.origins->admits_host(host))
      return refuse(
          request, http::status::forbidden,
          "This name is not one that kerf view answers to. If it leads here on purpose, as that of a proxy, start kerf view with "
          "--origin and the name.");
    if (path == "/engine") {
      if (!websocket::is_upgrade(request))
        return refuse(request, http::status::upgrade_required, "This is a WebSocket.");
      if (!server_.origins->admits_origin(view(request[http::field::origin]), host))
        return refuse(
            request, http::status::forbidden,
            "Pages from elsewhere may not connect. Behind a proxy, start kerf view with --origin and its name.");
      if (!server_.options.token.empty() && !same_token(query_value(target, "token"), server_.options.token))
        return refuse(request, http::status::forbidden,
                      "The token is missing or wrong: use the address that kerf view printed.");
      if (server_.pages.size() >= kMostPages)
        return refuse(request, http::status::service_unavailable, "Too many pages watch this session.");
      stream_.expires_never();  // the socket has a time limit of its own
      const bool unpacks = query_value(target, "packed") == "1";
      return std::make_shared<Page>(server_, stream_.release_socket(), unpacks)->start(std::move(request));
    }
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return refuse(request, http::status::method_not_allowed, kOnlyGet);
    if (path == "/" && server_.take_ticket(query_value(target, "ticket"))) {
      auto response = make(request, http::status::see_other, "text/plain; charset=utf-8");
      response->set(http::field::location, "/?token=" + server_.options.token);
      response->set(http::field::cache_control, "no-store");
      return send(request, response);
    }
    if (server_.options.reload) server_.page = server_.options.reload();
    const auto found = server_.page.find(std::string(path));
    if (found == server_.page.end()) return refuse(request, http::status::not_found, "There is no such file.");
    const PageFile& file = found->second;
    const auto accepted = view(request[http::field::accept_encoding]);
    auto response = make(request, http::status::ok, file.type);
    const bool packed = file.gzip && accepted.find("gzip") != std::string_view::npos;
    if (packed) response->set(http::field::content_encoding, "gzip");
    if (file.gzip) response->set(http::field::vary, "Accept-Encoding");
    response->set(http::field::cache_control, file.immutable ? "public, max-age=31536000, immutable" : "no-cache");
    response->body() = file.gzip && !packed ? gunzip(file.bytes).value_or("") : file.bytes;
    send(request, response);
  }
  using Response = http::response<http::string_body>;
  std::shared_ptr<Response> make(const http::request<http::empty_body>& request, http::status status,
                                 const std::string& type) {
    auto response = std::make_shared<Response>(status, request.version());
    response->set(http::field::server, "kerf");
    response->set(http::field::content_type, type);
    response->set("Content-Security-Policy", kPolicy + server_.options.embedders);
    response->set("X-Content-Type-Options", "nosniff");
    response->set("Referrer-Policy", "no-referrer");  // the token stays here
    response->set("Cross-Origin-Resource-Policy", "same-origin");
    response->keep_alive(request.keep_alive());
    return response;
  }
  void refuse(const http::request<http::empty_body>& request, http::status status, std::string_view why) {
    auto response = make(request, status, "text/plain; charset=utf-8");
    response->body() = std::string(why) + "\n";
    if (status == http::status::forbidden) response->keep_alive(false);
    send(request, response);
  }
  void send(const http::request<http::empty_body>& request, const std::shared_ptr<Response>& response) {
    const std::size_t length = response->body().size();
    if (request.method() == http::verb::head) response->body().clear();
    response->content_length(length);
    auto& sent = *response;
    if (request.method() == http::verb::head) {
      auto serializer = std::make_shared<http::response_serializer<http::string_body>>(sent);
      http::async_write_header(stream_, *serializer,
                               [self = shared_from_this(), response, serializer](error_code error, std::size_t) {
                                 self->sent(error, response->keep_alive());
                               });
      return;
    }
    http::async_write(stream_, sent, [self = shared_from_this(), response](error_code error, std::size_t) {
      self->sent(error, response->keep_alive());
    });
  }
  void sent(error_code error, bool keep) {
    if (error || !keep || server_.stopping) return end();
    read();
  }
  void end() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  Impl& server_;
  std::uint64_t number_;
  bool silent_ = false;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
};

// -------------------------------------------------------------------------------------------------------------------

Status ViewServer::Impl::admit() {
  origins.emplace(options.address, port);
  for (const std::string& host : options.hosts) origins->add_host(host);
  if (options.any_literal) origins->add_all_numbers();
  for (const std::string& origin : options.origins) KERF_TRY(origins->add_origin(origin));
  return {};
}

Status ViewServer::Impl::open() {
  error_code error;
  const auto address = asio::ip::make_address(options.address, error);
  if (error)
    return bad_input(fmt::format(
        "\"{}\" is not an address; give one of this machine's, such as 0.0.0.0 for all of them", options.address));
  const int last = options.port == 0 ? 0 : options.tries;
  for (int i = 0; i <= last; ++i) {
    const int wanted = options.port + i;
    if (wanted > 65535) break;
    const tcp::endpoint endpoint(address, static_cast<std::uint16_t>(wanted));
    acceptor.close(error);
    acceptor.open(endpoint.protocol(), error);
    if (error) return failed(fmt::format("can't open a socket: {}", error.message()));
    acceptor.set_option(asio::socket_base::reuse_address(true), error);
    acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (!error) {
      port = acceptor.local_endpoint(error).port();
      listening = acceptor.native_handle();
      keep_from_programs(listening);
      return admit();
    }
    if (error != asio::error::address_in_use)
      return bad_input(fmt::format("can't listen on {} port {}: {}", options.address, wanted, error.message()));
  }
  const std::string others = last > 0 ? fmt::format(" and the {} after it are", last) : " is";
  return bad_input(fmt::format("port {}{} in use; give another with --port, or 0 for any", options.port, others));
}

void ViewServer::Impl::accept() {
  acceptor.async_accept([this](error_code error, tcp::socket socket) {
    if (stopping) return;
    if (!error) {
      keep_from_programs(socket.native_handle());
      make_room();
      std::make_shared<Request>(*this, std::move(socket))->read();
    }
    if (error && error != asio::error::connection_aborted) {
      // Out of descriptors or memory: do not spin.
      auto pause = std::make_shared<asio::steady_timer>(io, std::chrono::milliseconds(100));
      pause->async_wait([this, pause](error_code) {
        if (!stopping) accept();
      });
      return;
    }
    accept();
  });
}

/// Of many connections those go that have said nothing for longest. Those that are being answered stay; there are as many of
/// them as the machine is fast, and they have a time limit.
void ViewServer::Impl::make_room() {
  std::size_t silent = 0;
  for (const auto& [number, request] : requests) silent += request->silent() ? 1 : 0;
  if (silent < kMostConnections) return;
  for (const auto& [number, request] : requests)
    if (request->silent()) return request->give_up();
}

void ViewServer::Impl::tick() {
  const auto now = Clock::now();
  ticking = true;
  engine.begin_tick(std::chrono::duration<double>(now - last_tick).count());
  last_tick = now;
  step_on();
}

/// Step by step, so that what a page says in between need not wait for all steps of a tick.
void ViewServer::Impl::step_on() {
  if (stopping) return;
  if (engine.step_due()) return asio::post(io, [this] { step_on(); });
  engine.end_tick();
  ticking = false;
  flush();
  give_memory_back();
  next_tick += kTick;
  if (next_tick < Clock::now()) next_tick = Clock::now();  // what is late is late: no debts
  wait_for_tick();
  if (engine.tick_wanted()) tick_soon();
}

void ViewServer::Impl::tick_soon() {
  if (ticking) return;
  const auto soon = std::max(Clock::now(), last_tick + kLeastTick);
  if (soon >= next_tick) return;
  next_tick = soon;
  wait_for_tick();
}

void ViewServer::Impl::wait_for_tick() {
  timer.expires_at(next_tick);  // calls off the wait under way
  timer.async_wait([this](error_code error) {
    if (!error && !stopping) tick();
  });
}

void ViewServer::Impl::flush() {
  const std::vector<std::shared_ptr<Page>> all(pages.begin(), pages.end());
  for (const auto& one : all) {
    one->write();
    one->read_on();  // what others have read makes room
  }
}

/// What pages that have gone had still to read is the system's again; the allocator would keep it.
void ViewServer::Impl::give_memory_back() {
  if (!memory_due || Clock::now() < next_memory) return;
  memory_due = false;
  next_memory = Clock::now() + kMemoryEvery;
#if defined(__GLIBC__)
  ::malloc_trim(0);
#endif
}

void ViewServer::Impl::shut_down() {
  if (stopping) return;
  stopping = true;
  error_code ignored;
  acceptor.close(ignored);
  timer.cancel();
  for (const auto& one : pages) one->end();
  io.stop();
}

bool ViewServer::Impl::take_ticket(std::string_view ticket) {
  if (options.ticket.empty() || !same_token(ticket, options.ticket)) return false;
  options.ticket.clear();
  return true;
}

ViewServer::ViewServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ViewServer::ViewServer(ViewServer&&) noexcept = default;
ViewServer::~ViewServer() = default;

Result<ViewServer> ViewServer::create(Engine engine, PageFiles page, const ServerOptions& options) {
  auto impl = std::make_unique<Impl>(std::move(engine), std::move(page), options);
  KERF_TRY(impl->open());
  return ViewServer(std::move(impl));
}

std::uint16_t ViewServer::port() const { return impl_->port; }
std::string ViewServer::address() const {
  return impl_->root() + (impl_->options.token.empty() ? "" : "?token=" + impl_->options.token);
}
std::string ViewServer::opening_address() const {
  return impl_->options.ticket.empty() ? address() : impl_->root() + "?ticket=" + impl_->options.ticket;
}
const Engine& ViewServer::engine() const { return impl_->engine; }

void ViewServer::run(bool signals) {
  Impl& s = *impl_;
  std::optional<SignalWatch> watch;
  if (signals) {
    std::signal(SIGPIPE, SIG_IGN);  // whoever read our output has gone: no reason to go too
    watch.emplace(s.io, [&s] { s.shut_down(); });
  }
  s.last_tick = s.next_tick = Clock::now();
  s.accept();
  s.tick();
  s.io.run();
  s.pages.clear();
}

void ViewServer::expect(std::string ticket) {
  asio::post(impl_->io, [s = impl_.get(), word = std::move(ticket)] { s->options.ticket = word; });
}
void ViewServer::close_port_of_fork() { ::close(impl_->listening); }
void ViewServer::stop() {
  asio::post(impl_->io, [s = impl_.get()] { s->shut_down(); });
}

}  // namespace kerf::app
