#include "session_view.h"

#include <utility>

#include "kerf/engine/led_session.h"

#ifndef KERF_NO_VIEW_SERVER
#include <csignal>
#include <exception>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include "kerf/engine/engine.h"
#include "view_server.h"
#endif

namespace kerf::python {

#ifdef KERF_NO_VIEW_SERVER

struct SessionView::Impl {
  std::shared_ptr<LedSession> led;
  std::string address;
};
Result<std::shared_ptr<SessionView>> SessionView::create(Session&, const SceneSource&, const ViewRequest&) {
  return bad_input(
      "this package was built without the program, and so without its page: build it with KERF_BUILD_APPS=ON");
}
Status SessionView::start() { return {}; }
int SessionView::port() const { return 0; }
void SessionView::expect(const std::string&) {}
void SessionView::close() {}
void SessionView::abandon() {}

#else

struct SessionView::Impl {
  std::shared_ptr<LedSession> led;
  std::string address;
  int port = 0;
  std::mutex mutex;  ///< of the two
  std::optional<app::ViewServer> server;
  std::thread thread;
};

namespace {

/// The way out is a parameter here, no option of a command line.
Error as_called(Error error) {
  constexpr std::string_view kOption = "with --port";
  if (const std::size_t at = error.message.find(kOption); at != std::string::npos)
    error.message.replace(at, kOption.size(), "as port=");
  return error;
}

}  // namespace

Result<std::shared_ptr<SessionView>> SessionView::create(Session& session, const SceneSource& source,
                                                         const ViewRequest& request) {
  app::PageFiles page = app::built_in_page();
  if (page.empty())
    return bad_input(
        "this package was built without its page: run scripts/page, or npm ci && npm run build in apps/viewer, and "
        "install the package again");
  EngineOptions options;
  options.session_id = request.number;
  auto impl = std::make_unique<Impl>();
  impl->led = std::make_shared<LedSession>(session);
  auto engine = Engine::watch(impl->led, source, options);
  if (!engine) return engine.error();
  app::ServerOptions server_options;
  server_options.port = static_cast<std::uint16_t>(request.port);
  server_options.tries = 0;
  server_options.token = request.token;
  server_options.embedders = request.embedders;
  auto server = app::ViewServer::create(std::move(*engine), std::move(page), server_options);
  if (!server) return as_called(server.error());
  impl->address = server->address();
  impl->port = server->port();
  impl->server.emplace(std::move(*server));
  return std::shared_ptr<SessionView>(new SessionView(std::move(impl)));
}

Status SessionView::start() {
  // Signals are Python's.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  Status started;
  try {
    impl_->thread = std::thread([server = &*impl_->server] {
      try {
        server->run(false);
      } catch (const std::exception&) {  // no memory: pages lose their connection, Python goes on
      }
    });
  } catch (const std::exception&) {
    started = failed("no thread can be had to serve the page; let the program have more processes (ulimit -u)");
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return started;
}

int SessionView::port() const { return impl_->port; }

void SessionView::expect(const std::string& ticket) {
  const std::scoped_lock lock(impl_->mutex);
  if (impl_->server) impl_->server->expect(ticket);
}

void SessionView::close() {
  impl_->led->end();
  const std::scoped_lock lock(impl_->mutex);
  if (!impl_->server) return;
  impl_->server->stop();
  if (impl_->thread.joinable()) impl_->thread.join();
  impl_->server.reset();
}

void SessionView::abandon() {
  if (impl_->server) impl_->server->close_port_of_fork();
}

#endif

SessionView::SessionView(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SessionView::~SessionView() { close(); }
const std::shared_ptr<LedSession>& SessionView::led() const { return impl_->led; }
const std::string& SessionView::address() const { return impl_->address; }

}  // namespace kerf::python
