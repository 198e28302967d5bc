// What a scene's own commands do, for pages that show them: until when, and where the hand of a stroke, a shaver or a punch is.
#pragma once

#include <string>
#include <vector>

#include "kerf/scene/scene.h"

namespace kerf {

struct SceneScript {
  struct Place {
    double time = 0;  ///< s
    Vec3 point;       ///< metres, as the command has it
    Vec3 axis;        ///< unit, from the body towards the hand
  };
  struct Hand {
    const char* tool;           ///< a page's name of it: scalpel, scissors, shaver, punch
    std::vector<Place> places;  ///< in the order of their times
  };
  double ends = 0;  ///< s: nothing is commanded after that; 0: nothing is commanded at all
  std::vector<Hand> hands;
};

SceneScript scene_script(const Scene& scene);

/// {"ends": s, "hands": [{"tool": name, "places": [[time, point x y z, axis x y z], ...]}, ...]}
std::string script_json(const SceneScript& script);

}  // namespace kerf
