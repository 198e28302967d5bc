#include "kerf/record/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

namespace kerf {
namespace {

using Json = nlohmann::ordered_json;

/// Raised when a key changes its meaning or goes.
constexpr int kReportVersion = 1;

Json json(const BodyCounts& c) {
  return {{"visual_vertices", c.visual_vertices},
          {"visual_triangles", c.visual_triangles},
          {"collision_vertices", c.collision_vertices},
          {"collision_triangles", c.collision_triangles},
          {"nodes", c.nodes},
          {"hexahedra", c.hexahedra},
          {"pieces", c.pieces}};
}

Json json(Vec3 v) { return Json::array({v.x, v.y, v.z}); }

Json json(const Quantiles& q) { return {{"median", q.median}, {"p99", q.p99}, {"worst", q.worst}}; }

Quantiles of_steps(const RunLog& log, double (*value)(const RunLog::Step&)) {
  std::vector<double> values;
  for (const RunLog::Step& s : log.steps) values.push_back(value(s));
  return quantiles(std::move(values));
}

/// Overlap that is worth a word, as a share of the largest half thickness.
constexpr double kDeep = 0.05;

double half_thickness(const Session& session) {
  double most = 0;
  const CollisionMesh& mesh = session.body().complex.collision;
  for (const CollisionVertex v : ids<CollisionVertex>(mesh.vertex_count())) most = std::max(most, norm(mesh.offset[v]));
  return most;
}

DeepestOverlap deepest_of(const Session& session, std::span<const RunLog::Step> steps) {
  DeepestOverlap out;
  for (const RunLog::Step& s : steps)
    if (s.overlap > out.metres) out.metres = s.overlap, out.time = s.time;
  const double thick = half_thickness(session);
  if (thick > 0) out.share = out.metres / thick;
  return out;
}

Json tools_json(const Session& session, const RunLog& log) {
  const std::vector<Session::ToolState> now = session.tools();
  Json out = Json::array();
  for (std::size_t i = 0; i < now.size(); ++i) {
    const RunLog::Tool most = i < log.tools.size() ? log.tools[i] : RunLog::Tool{};
    out.push_back({{"id", session.scene().tools[i].id},
                   {"largest_force", {{"newtons", most.force}, {"time", most.force_at}}},
                   {"largest_torque", {{"newton_metres", most.torque}, {"time", most.torque_at}}},
                   {"end",
                    {{"position", json(now[i].place.position)},
                     {"force", json(now[i].force)},
                     {"torque", json(now[i].torque)},
                     {"coupling_force", json(now[i].coupling_force)},
                     {"coupling_torque", json(now[i].coupling_torque)}}}});
  }
  return out;
}

Json contact_json(const Session& session, const RunLog& log) {
  int contacts = 0, pressing = 0;
  for (const RunLog::Step& s : log.steps) {
    contacts = std::max(contacts, s.contacts);
    pressing = std::max(pressing, s.pressing);
  }
  const DeepestOverlap deepest = deepest_overlap(session, log);
  std::vector<Vec3> on(session.scene().obstacles.size());
  for (const Session::ContactState& c : session.contacts())
    if (c.obstacle >= 0) on[static_cast<std::size_t>(c.obstacle)] -= c.force;
  Json obstacles = Json::array();
  for (std::size_t i = 0; i < on.size(); ++i)
    obstacles.push_back({{"name", session.scene().obstacles[i].name}, {"force_end", json(on[i])}});
  return {{"contacts_most", contacts},
          {"pressing_most", pressing},
          {"deepest_overlap",
           {{"metres", deepest.metres}, {"share_of_half_thickness", deepest.share}, {"time", deepest.time}}},
          {"obstacles", obstacles}};
}

/// What a reader must know of a run, however it went.
Json first_keys(const Scene& scene, const RunState& state) {
  static constexpr const char* kStatus[] = {"running", "complete", "failed"};
  Json report;
  report["kerf_report_version"] = kReportVersion;
  report["status"] = kStatus[static_cast<std::size_t>(state.status)];
  if (state.status == RunState::Status::kFailed) report["reason"] = state.reason;
  report["files"] = state.files;
  report["scene"] = scene.name;
  report["title"] = scene.title;
  report["simulated_seconds"] = 0.0;
  report["time_step_seconds"] = scene.simulation.time_step;
  report["notes"] = Json::array();
  return report;
}
Json first_keys(const Session& session, const RunState& state) {
  Json report = first_keys(session.scene(), state);
  report["simulated_seconds"] = session.time();
  report["time_step_seconds"] = session.time_step();
  report["notes"] = session.notes();
  return report;
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

void RunLog::add(const Session& session, const SessionStep& step) {
  const StepReport& m = step.mechanics;
  steps.push_back({session.time(), step.seconds, m.seconds_total, m.iterations, m.residual, m.cap_hit, m.factorised,
                   m.stopped_by_floor, m.inverted_elements, m.kinetic_energy, m.contacts, m.pressing, m.deepest_overlap,
                   m.slowed_nodes});
  const std::vector<Session::ToolState> now = session.tools();
  tools.resize(now.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    Tool& tool = tools[i];
    if (const double force = norm(now[i].force); force > tool.force) tool.force = force, tool.force_at = session.time();
    if (const double torque = norm(now[i].torque); torque > tool.torque)
      tool.torque = torque, tool.torque_at = session.time();
  }
}

DeepestOverlap deepest_overlap(const Session& session, const RunLog& log) { return deepest_of(session, log.steps); }

std::string overlap_note(const Session& session, const RunLog& log) {
  std::span<const RunLog::Step> later = log.steps;
  if (later.empty()) return {};
  // What started inside each other and is still being pushed apart is told of when it starts; unless it never comes out.
  const double most = kDeep * half_thickness(session);
  const auto out = std::find_if(later.begin(), later.end(), [&](const RunLog::Step& s) { return s.overlap <= most; });
  later = later.subspan(out == later.end() ? 1 : static_cast<std::size_t>(out - later.begin()));
  const DeepestOverlap deepest = deepest_of(session, later);
  if (!(deepest.share > kDeep)) return {};
  return fmt::format(
      "things were in each other by up to {:.2g} mm, {:.2g} of the largest half thickness, at {:.4g} s; take a shorter time_step, or "
      "let steps be divided more often (substeps of [contact])",
      1e3 * deepest.metres, deepest.share, deepest.time);
}

std::string short_report_json(const Session& session, const RunState& state) {
  return first_keys(session, state).dump(2) + "\n";
}

std::string short_report_json(const Scene& scene, const RunState& state) {
  return first_keys(scene, state).dump(2) + "\n";
}

std::string run_report_json(const Session& session, const RunLog& log, const RunState& state) {
  Json report = first_keys(session, state);
  if (const std::string note = overlap_note(session, log); !note.empty()) report["notes"].push_back(note);
  report["counts"] = {{"start", json(log.counts_before)}, {"final", json(session.counts())}};
  report["state_hash"] = fmt::format("{:016x}", session.hash());

  Json cuts = Json::array();
  for (const StrokeRecord& s : session.strokes()) {
    static constexpr const char* kKinds[] = {"blade", "punch", "removal", "shave"};
    cuts.push_back(
        {{"kind", kKinds[static_cast<std::size_t>(s.kind)]},
         {"began", s.began},
         {"ended", s.ended},
         {"finished", s.finished},
         {"undone", s.undone},
         {"before", json(s.before)},
         {"after", json(s.after)},
         {"triangles_walked", s.triangles},
         {"refused_steps", s.refused},
         {"retried_steps", s.retried},
         {"removed", {{"pieces", s.removed.pieces}, {"volume", s.removed.volume}, {"share", s.removed.share}}},
         {"milliseconds",
          {{"cut_and_binding_update", 1e3 * s.times.cut_and_binding},
           {"embedding_update", 1e3 * s.times.embedding},
           {"cut_surface", 1e3 * s.times.cut_surface},
           {"total", 1e3 * s.times.total}}}});
  }
  report["cuts"] = cuts;

  int most = 0, caps = 0, factorised = 0, inverted = 0, floors = 0, slowed = 0;
  double worst_residual = 0, sum = 0;
  for (const RunLog::Step& s : log.steps) {
    most = std::max(most, s.iterations);
    caps += s.cap_hit ? 1 : 0;
    factorised += s.factorised ? 1 : 0;
    inverted = std::max(inverted, s.inverted);
    slowed += s.slowed;
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
        {"steps_not_converged", caps},
        {"steps_factorised", factorised}}},
      {"inverted_elements_most", inverted},
      {"slowed_nodes", slowed},
      {"kinetic_energy_end", log.steps.empty() ? 0.0 : log.steps.back().kinetic_energy}};
  report["support_force"] = json(session.support_force());
  if (!session.scene().tools.empty()) report["tools"] = tools_json(session, log);
  if (wants_contact(session.scene())) report["contact"] = contact_json(session, log);

  if (const auto score = session.score())
    report["score"] = {{"lesion_volume", score->lesion_volume},     {"lesion_removed", score->lesion_removed},
                       {"healthy_removed", score->healthy_removed}, {"healthy_share", score->healthy_share},
                       {"loose_pieces", score->loose_pieces},       {"roughness", score->roughness},
                       {"largest_force", score->largest_force},     {"time", score->time}};

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
