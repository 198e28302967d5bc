#include "command_view.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <spawn.h>
#include <sys/random.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>

#include "exit_status.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/scene_file.h"
#include "mesh_folders.h"
#include "progress_bar.h"
#include "scene_search.h"
#include "terminal.h"
#include "view_server.h"

extern char** environ;

namespace kerf::app {
namespace {

/// Bytes that nobody can guess.
Result<std::uint64_t> random_number() {
  std::uint64_t value = 0;
  if (getrandom(&value, sizeof value, 0) != sizeof value) return failed("the system gives no random numbers");
  return value;
}

Result<std::string> random_word() {
  const auto a = random_number(), b = random_number();
  if (!a || !b) return a ? b.error() : a.error();
  return fmt::format("{:016x}{:016x}", *a, *b);
}

bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address == "::1" || address == "localhost";
}

/// Shipped scenes that can be read, with their titles: those whose meshes are missing can't. By their `tile`, then by name.
std::vector<OfferedScene> offered_scenes(const std::vector<std::filesystem::path>& meshes) {
  std::multimap<int, OfferedScene> found;
  for (const std::string& name : shipped_scenes()) {
    const auto path = find_scene(name);
    if (!path) continue;
    const auto scene = read_scene(*path, meshes);
    if (!scene) continue;
    const int tile = scene->tile > 0 ? scene->tile : std::numeric_limits<int>::max();
    found.insert({tile, {name, scene->title.empty() ? name : scene->title, path->string(), scene->goal}});
  }
  std::vector<OfferedScene> out;
  for (auto& [tile, scene] : found) out.push_back(std::move(scene));
  return out;
}

/// Opens the address in a browser if there is a display. The browser is not waited for. Other users of the machine can see the command line.
void open_browser(const std::string& address) {
  const bool display = std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
  if (!display) return;
  std::string program = "xdg-open", where = address;
  char* arguments[] = {program.data(), where.data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", 1 /* O_WRONLY */, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", 1 /* O_WRONLY */, 0);
  pid_t child = 0;
  (void)posix_spawnp(&child, "xdg-open", &files, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&files);
}

/// This machine's addresses in its networks, as they stand in an address of a page: without loopback, and without those that hold on one link alone.
std::vector<std::string> network_addresses(bool version_6_too) {
  std::vector<std::string> out;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return out;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr) continue;
    char text[INET6_ADDRSTRLEN] = {};
    if (one->ifa_addr->sa_family == AF_INET) {
      const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
      if (inet_ntop(AF_INET, &address->sin_addr, text, sizeof text) != nullptr && !is_loopback(text))
        out.emplace_back(text);
    } else if (version_6_too && one->ifa_addr->sa_family == AF_INET6) {
      const auto* address = reinterpret_cast<const sockaddr_in6*>(one->ifa_addr);
      if (IN6_IS_ADDR_LOOPBACK(&address->sin6_addr) || IN6_IS_ADDR_LINKLOCAL(&address->sin6_addr)) continue;
      if (inet_ntop(AF_INET6, &address->sin6_addr, text, sizeof text) != nullptr)
        out.push_back(fmt::format("[{}]", text));
    }
  }
  freeifaddrs(all);
  return out;
}

constexpr const char* kHowToBuildThePage =
    "the page is not built into this program. Build it once and give its folder:\n"
    "  (cd apps/viewer && npm ci && npm run build)\n"
    "  kerf view --page apps/viewer/dist\n"
    "or build kerf again after that: the page then is part of the program.";

}  // namespace

int view_scene(const ViewOptions& options) {
  const auto path = find_scene(options.scene);
  if (!path) return report(path.error());
  auto text = scene_text_in(*path);
  if (!text) return report(text.error());
  SceneSource source;
  source.text = std::move(*text);
  source.name = path->stem().string();
  source.folder = std::filesystem::absolute(*path).parent_path();
  source.mesh_folders = mesh_folders(options.meshes);

  PageFiles page;
  ServerOptions server_options;
  if (!options.page.empty()) {
    auto files = read_page(options.page);
    if (!files) return report(files.error());
    page = std::move(*files);
    const std::string folder = options.page;
    server_options.reload = [folder] {
      auto again = read_page(folder);
      return again ? std::move(*again) : PageFiles{};
    };
  } else {
    page = built_in_page();
    if (page.empty()) return report(bad_input(kHowToBuildThePage));
  }

  EngineOptions engine_options;
  engine_options.scenes = offered_scenes(source.mesh_folders);
  engine_options.mesh_folders = source.mesh_folders;
  engine_options.overrides.scripted = options.scripted;
  engine_options.overrides.time_step = options.time_step.value_or(0);
  const auto session = random_number();
  if (!session) return report(session.error());
  engine_options.session_id = *session;
  Result<Engine> engine = [&] {
    ProgressBar bar(false);
    return Engine::create(source, engine_options, bar.callback());
  }();
  if (!engine) return report(engine.error());

  server_options.address = options.listen == "localhost" ? "127.0.0.1" : options.listen;
  server_options.port = static_cast<std::uint16_t>(options.port);
  server_options.tries = options.port_given ? 0 : 20;
  server_options.origins = options.origins;
  const auto token = random_word(), ticket = random_word();
  if (!token || !ticket) return report(token ? ticket.error() : token.error());
  server_options.token = options.token.empty() ? *token : options.token;
  server_options.ticket = *ticket;
  if (!is_loopback(options.listen)) {
    server_options.any_literal = true;
    char name[256] = {};
    if (gethostname(name, sizeof name - 1) == 0) server_options.hosts = {name, std::string(name) + ".local"};
  }
  auto server = ViewServer::create(std::move(*engine), std::move(page), server_options);
  if (!server) return report(server.error());
  const std::string address = server->address();
  say("kerf view: {}\n", address);
  if (options.listen == "0.0.0.0" || options.listen == "::")
    for (const std::string& own : network_addresses(options.listen == "::"))
      say("from other machines: http://{}:{}/?token={}\n", own, server->port(), server_options.token);
  for (const std::string& origin : options.origins)
    say("through a proxy: {}{}/?token={}\n", origin.find("://") == std::string::npos ? "https://" : "",
        origin.ends_with('/') ? origin.substr(0, origin.size() - 1) : origin, server_options.token);
  say("Whoever has this address can use the session.\n");
  say("Stop with Ctrl-C.\n");
  std::fflush(stdout);
  if (!options.no_browser) open_browser(server->opening_address());
  server->run();
  say("kerf view: stopped.\n");
  return kSuccess;
}

}  // namespace kerf::app
