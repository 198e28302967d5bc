// kerf view: the session in a browser.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace kerf::app {

struct ViewOptions {
  std::string scene = "steak-on-a-board";
  int port = 8080;
  bool port_given = false;
  std::string listen = "127.0.0.1";
  std::string page;                  ///< folder of the page's files instead of the built-in ones
  std::vector<std::string> origins;  ///< of proxies
  std::string token;                 ///< that pages must know; empty: one that nobody can guess
  std::vector<std::string> meshes;   ///< folders with mesh files, beside the scenes' own
  bool no_browser = false;
  bool scripted = false;  ///< the scene's own commands too
  std::optional<double> time_step;
};

int view_scene(const ViewOptions& options);

}  // namespace kerf::app
