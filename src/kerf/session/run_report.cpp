#include "kerf/session/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace kerf {
namespace {

using Json = nlohmann::ordered_json;

/// Raised when a key changes its meaning or goes.
constexpr int kReportVersion = 1;

Json json(const BodyCounts& c) {
  return {{"visual_vertices", c.visual_vertices},       {"visual_triangles", c.visual_triangles},
          {"collision_vertices", c.collision_vertices}, {"collision_triangles", c.collision_triangles},
          {"nodes", c.nodes},                           {"hexahedra", c.hexahedra},
          {"pieces", c.pieces}};
}

Json json(Vec3 v) { return Json::array({v.x, v.y, v.z}); }

Json json(const Quantiles& q) { return {{"median", q.median}, {"p99", q.p99}, {"worst", q.worst}}; }

Quantiles of_steps(const RunLog& log, double (*value)(const RunLog::Step&)) {
  std::vector<double> values;
  for (const RunLog::Step& s : log.steps) values.push_back(value(s));
  return quantiles(std::move(values));
}

}  // namespace

Quantiles quantiles(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto rank = [&](double p) {
    const auto i = static_cast<std::size_t>(std::ceil(p * static_cast<double>(values.size())));
    return values[std::clamp<std::size_t>(i, 1, values.size()) - 1];
  };
  return {rank(0.5), rank(0.99), values.back()};
}

std::string run_report_json(const Session& session, const RunLog& log) {
  Json report;
  report["kerf_report_version"] = kReportVersion;
  report["scene"] = session.scene().name;
  report["title"] = session.scene().title;
  report["simulated_seconds"] = session.time();
  report["time_step_seconds"] = session.time_step();
  report["notes"] = session.notes();
  report["counts"] = {{"start", json(log.counts_before)}, {"final", json(session.counts())}};
  report["state_hash"] = fmt::format("{:016x}", session.hash());

  Json cuts = Json::array();
  for (const StrokeRecord& s : session.strokes()) {
    static constexpr const char* kKinds[] = {"blade", "punch", "removal", "shave"};
    cuts.push_back({{"kind", kKinds[static_cast<std::size_t>(s.kind)]},
                    {"began", s.began},
                    {"ended", s.ended},
                    {"finished", s.finished},
                    {"undone", s.undone},
                    {"before", json(s.before)},
                    {"after", json(s.after)},
                    {"triangles_walked", s.triangles},
                    {"refused_steps", s.refused},
                    {"retried_steps", s.retried},
                    {"milliseconds",
                     {{"cut_and_binding_update", 1e3 * s.times.cut_and_binding},
                      {"embedding_update", 1e3 * s.times.embedding},
                      {"cut_surface", 1e3 * s.times.cut_surface},
                      {"total", 1e3 * s.times.total}}}});
  }
  report["cuts"] = cuts;

  int most = 0, caps = 0, inverted = 0, floors = 0;
  double worst_residual = 0, sum = 0;
  for (const RunLog::Step& s : log.steps) {
    most = std::max(most, s.iterations);
    caps += s.cap_hit ? 1 : 0;
    inverted = std::max(inverted, s.inverted);
    // A body at rest has next to nothing on the right-hand side; what is left of that says nothing.
    if (s.stopped_by_floor) ++floors;
    else worst_residual = std::max(worst_residual, s.residual);
    sum += s.iterations;
  }
  report["steps"] = {
      {"number", log.steps.size()},
      {"milliseconds", json(of_steps(log, [](const RunLog::Step& s) { return 1e3 * s.seconds; }))},
      {"mechanics_milliseconds", json(of_steps(log, [](const RunLog::Step& s) { return 1e3 * s.mechanics; }))},
      {"solver",
       {{"iterations_mean", log.steps.empty() ? 0.0 : sum / static_cast<double>(log.steps.size())},
        {"iterations_most", most},
        {"residual_worst", worst_residual},
        {"steps_stopped_by_floor", floors},
        {"steps_not_converged", caps}}},
      {"inverted_elements_most", inverted},
      {"kinetic_energy_end", log.steps.empty() ? 0.0 : log.steps.back().kinetic_energy}};
  report["support_force"] = json(session.support_force());

  if (const auto score = session.score())
    report["score"] = {{"lesion_volume", score->lesion_volume},   {"lesion_removed", score->lesion_removed},
                       {"healthy_removed", score->healthy_removed}, {"healthy_share", score->healthy_share},
                       {"loose_pieces", score->loose_pieces},     {"roughness", score->roughness},
                       {"largest_force", score->largest_force},   {"time", score->time}};

  Json checks = Json::array();
  bool all = true;
  for (const RunLog::Check& c : log.checks) {
    all = all && c.problem.empty();
    checks.push_back({{"time", c.time}, {"what", c.what}, {"holds", c.problem.empty()}, {"problem", c.problem}});
  }
  report["invariants"] = {{"all_hold", all}, {"checks", checks}};
  report["prepare_seconds"] = log.prepare_seconds;
  return report.dump(2) + "\n";
}

}  // namespace kerf
