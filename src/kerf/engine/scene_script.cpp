#include "kerf/engine/scene_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

namespace kerf {
namespace {

constexpr double kPunchComes = 0.4, kPunchGoes = 0.25;  ///< s for which a punch is seen before and after it bites

Vec3 unit(Vec3 v) {
  const double length = norm(v);
  return length > 0 ? (1 / length) * v : Vec3{0, 0, 1};
}

SceneScript::Hand hand_of(const char* tool, double at, const std::vector<SceneBladePose>& poses) {
  SceneScript::Hand hand{tool, {}};
  for (const SceneBladePose& p : poses)
    hand.places.push_back({at + p.time, lerp(p.base, p.tip, 0.5), unit(p.base - p.tip)});
  return hand;
}

}  // namespace

SceneScript scene_script(const Scene& scene) {
  SceneScript script;
  for (const SceneCommand& c : scene.commands) {
    const double lasts = std::visit(
        [&](const auto& what) {
          using What = std::decay_t<decltype(what)>;
          if constexpr (std::is_same_v<What, SceneBlade>)
            script.hands.push_back(
                hand_of(what.tool == SceneTool::kScissors ? "scissors" : "scalpel", c.at, what.poses));
          if constexpr (std::is_same_v<What, SceneShave>) script.hands.push_back(hand_of("shaver", c.at, what.poses));
          if constexpr (std::is_same_v<What, ScenePunch>)
            script.hands.push_back({"punch",
                                    {{std::max(0.0, c.at - kPunchComes), what.point, unit(what.axis)},
                                     {c.at + kPunchGoes, what.point, unit(what.axis)}}});
          if constexpr (requires { what.poses; }) return what.poses.empty() ? 0 : what.poses.back().time;
          else if constexpr (requires { what.over; }) return what.over;
          else return 0.0;
        },
        c.what);
    script.ends = std::max(script.ends, c.at + lasts);
  }
  return script;
}

std::string script_json(const SceneScript& script) {
  std::string out = fmt::format("{{\"ends\":{},\"hands\":[", script.ends);
  for (std::size_t h = 0; h < script.hands.size(); ++h) {
    const SceneScript::Hand& hand = script.hands[h];
    out += fmt::format("{}{{\"tool\":\"{}\",\"places\":[", h > 0 ? "," : "", hand.tool);
    for (std::size_t i = 0; i < hand.places.size(); ++i) {
      const SceneScript::Place& p = hand.places[i];
      out += fmt::format("{}[{:.6g},{:.6g},{:.6g},{:.6g},{:.4g},{:.4g},{:.4g}]", i > 0 ? "," : "", p.time, p.point.x,
                         p.point.y, p.point.z, p.axis.x, p.axis.y, p.axis.z);
    }
    out += "]}";
  }
  return out + "]}";
}

}  // namespace kerf
