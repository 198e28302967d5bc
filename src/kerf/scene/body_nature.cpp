#include "kerf/scene/body_nature.h"

#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <utility>

#include "kerf/scene/scene_keys.h"

namespace kerf {

Status check_nature(const BodyNature& nature, const std::string& name) {
  const std::pair<std::string_view, const std::optional<double>*> said[] = {
      {"young", &nature.young}, {"poisson", &nature.poisson}, {"density", &nature.density}};
  for (const SceneKey& key : scene_keys<SceneMaterial>().all)
    for (const auto& [what, number] : said) {
      if (key.name != what || !*number) continue;
      if (const std::string fault = range_fault(what, key.range, **number); !fault.empty())
        return bad_input(fmt::format("{}: {}", name, fault));
    }
  return {};
}

}  // namespace kerf
