#include "kerf/engine/engine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "kerf/base/stopwatch.h"
#include "kerf/engine/engine_impl.h"
#include "kerf/record/run_outputs.h"
#include "kerf/record/run_report.h"

namespace kerf {
namespace {

using protocol::ErrorCode;

/// Real time that a stalled engine catches up at most, s.
constexpr double kMostOwed = 0.1;
constexpr double kStatsEvery = 0.25;    ///< s
constexpr double kProgressEvery = 0.1;  ///< s
constexpr const char* kLed = "A program leads this session; pages watch.";
constexpr double kIdleFrames = 0.5;  ///< s between frames while nothing moves
/// A session that a program leads plays for so long after a step, s. At half, it seems to stop at 4 steps a second; at twice, to go on for a second.
constexpr double kStepsShown = 0.5;
constexpr std::size_t kStepWindow = 512;
/// Bodies up to this many visual triangles are hashed while a recording runs; larger ones at its end only.
constexpr std::size_t kHashedTriangles = 200'000;

}  // namespace

protocol::Counts to_message(const BodyCounts& c) {
  const auto n = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
  return {n(c.visual_vertices), n(c.visual_triangles), n(c.collision_vertices), n(c.collision_triangles),
          n(c.nodes),           n(c.hexahedra)};
}

Engine::Engine(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Engine::Engine(Engine&&) noexcept = default;
Engine& Engine::operator=(Engine&&) noexcept = default;
Engine::~Engine() = default;

Result<Engine> Engine::create(const SceneSource& scene, EngineOptions options, const Progress& progress) {
  auto impl = std::make_unique<Impl>();
  impl->options = std::move(options);
  SceneRequest request;
  request.source = scene;
  request.overrides = impl->options.overrides;
  auto loaded = load_scene(std::move(request), progress);
  if (!loaded) return loaded.error();
  impl->show(std::move(loaded).value());
  return Engine(std::move(impl));
}

Result<Engine> Engine::watch(std::shared_ptr<LedSession> led, SceneSource source, EngineOptions options) {
  auto impl = std::make_unique<Impl>();
  impl->options = std::move(options);
  auto scene = scene_of_session(led->session(), std::move(source));
  if (!scene) return scene.error();
  impl->led = std::move(led);
  impl->show(std::move(scene).value());
  impl->playing = false;
  impl->seen_steps = impl->session->step_count();
  impl->since_step = kStepsShown;
  return Engine(std::move(impl));
}

void Engine::Impl::show(std::unique_ptr<LoadedScene> scene) {
  std::swap(source, scene->source);
  std::swap(overrides, scene->overrides);
  std::swap(folder, scene->folder);
  std::swap(meshes, scene->meshes);
  std::swap(session, scene->session);
  std::swap(initial, scene->initial);
  std::swap(drawn, scene->drawn);
  std::swap(things, scene->things);
  std::swap(rest_box, scene->box);
  std::swap(script, scene->script);
  initial_gravity = session->gravity();
  start_over();
  if (scene->session) loader.dispose(std::move(scene));
}

void Engine::Impl::watch_loading(double real_seconds) {
  if (auto outcome = loader.take()) {
    const std::uint32_t client = loader.client(), input = loader.input();
    if (outcome->ok()) {
      cancel_tool();
      publish(0);
      show(std::move(*outcome).value());
      return tell_loading(protocol::LoadState::kShown, {}, 1);
    }
    const Error& trouble = outcome->error();
    tell_loading(protocol::LoadState::kFailed, {}, 0);
    return error(client, input, trouble.kind == ErrorKind::kBadInput ? ErrorCode::kBadArgument : ErrorCode::kFailed,
                 trouble.message);
  }
  if (!loader.busy()) return;
  since_progress += real_seconds;
  if (since_progress < kProgressEvery) return;
  const SceneLoader::Where where = loader.where();
  tell_loading(protocol::LoadState::kUnderWay, where.stage, where.fraction);
}

void Engine::Impl::tell_loading(protocol::LoadState state, std::string_view stage, double fraction) {
  since_progress = 0;
  protocol::Loading m;
  m.input = loader.input();
  m.state = state;
  m.fraction = static_cast<float>(fraction);
  m.stage = stage;
  broadcast(share(protocol::encode(m)));
}

void Engine::Impl::start_over() {
  tool.reset();
  line_from.reset();
  hand.reset();
  instrument.reset();
  taken_with.clear();
  jaws_closed.assign(things.tool_count(), false);
  pending_report.reset();
  changes.clear();
  hashes.clear();
  recorded_bytes = 0;
  too_long = false;
  history.clear();
  history_bytes = 0;
  owed = 0;
  times = {};
  ++body;
  version = 1;
  (void)session->take_changes();
  published_topology = session->topology_version();
  published_nodes = session->node_positions().size();
  counts = session->counts();
  counted_topology = published_topology;
  frame_due = true;
  find_fixed();
  weigh();
  for (auto& [id, client] : clients) {
    if (!client.ready) continue;
    client.queue.forget_frame();
    hello(id);
    client.queue.push(body_now());
    client.queue.push(things_now());
    client.queue.push(fixed_now());
    client.queue.push(masses_now());
  }
  send_overlay();
}

protocol::Message Engine::Impl::share(protocol::Bytes bytes) {
  const std::size_t size = bytes.capacity() + kMessageOverhead;
  auto message = std::make_unique<const protocol::Bytes>(std::move(bytes));
  *message_bytes += size;
  return {message.release(), [all = message_bytes, size](const protocol::Bytes* read) {
            *all -= size;
            delete read;
          }};
}

void Engine::Impl::send(std::uint32_t client, protocol::Bytes bytes) {
  const auto found = clients.find(client);
  if (found != clients.end()) found->second.queue.push(share(std::move(bytes)));
}

void Engine::Impl::broadcast(const protocol::Message& message) {
  for (auto& [id, client] : clients)
    if (client.ready) client.queue.push(message);
}

void Engine::Impl::error(std::uint32_t client, std::uint32_t input, ErrorCode code, std::string_view text) {
  send(client, protocol::encode(protocol::ErrorMessage{input, code, text}));
}

void Engine::Impl::hello(std::uint32_t client) {
  using Json = nlohmann::ordered_json;
  Json json;
  json["scenes"] = Json::array();
  for (const OfferedScene& s : options.scenes)
    json["scenes"].push_back({{"name", s.name}, {"title", s.title}, {"goal", s.goal}});
  const Scene& scene = session->scene();
  json["opened"] = folder.has_value();
  json["title"] = scene.title.empty() ? source.name : scene.title;
  const Material material = session->material();
  json["material"] = {{"young", material.young}, {"poisson", material.poisson}, {"density", material.density}};
  const Vec3 g = session->gravity();
  json["gravity"] = {g.x, g.y, g.z};
  json["time_step"] = session->time_step();
  json["look"] = body_look(scene);
  json["box"] = {rest_box.min.x, rest_box.min.y, rest_box.min.z, rest_box.max.x, rest_box.max.y, rest_box.max.z};
  if (meshes && meshes->bound.empty()) json["unit"] = {{"metres", meshes->unit}, {"guessed", meshes->guessed}};
  if (scene.lesion) {
    const SceneRegion& l = *scene.lesion;
    using Shape = SceneRegion::Shape;
    Json& region = json["lesion"];
    if (l.shape == Shape::kSphere) region = {{"sphere", {l.center.x, l.center.y, l.center.z, l.radius}}};
    if (l.shape == Shape::kBox) region = {{"box", {l.min.x, l.min.y, l.min.z, l.max.x, l.max.y, l.max.z}}};
    if (l.shape == Shape::kHalfSpace)
      region = {{"half_space", {l.point.x, l.point.y, l.point.z, l.normal.x, l.normal.y, l.normal.z}}};
  }
  if (scene.arthroscope) {
    const auto list = [](Vec3 v) { return Json::array({v.x, v.y, v.z}); };
    json["arthroscope"] = {{"entry", list(scene.arthroscope->entry)},
                           {"target", list(scene.arthroscope->target)},
                           {"angle", scene.arthroscope->angle}};
  }
  // Commands of files that were opened stay with those who wrote them: only offered scenes can be loaded again with them.
  if (script.ends > 0 && !folder &&
      std::any_of(options.scenes.begin(), options.scenes.end(),
                  [&](const OfferedScene& s) { return s.name == source.name; })) {
    json["script"] = Json::parse(script_json(script));
    json["script"]["runs"] = overrides.scripted;
    // Through an arthroscope it is another view.
    const Vec3 view = scene.output.camera.direction;
    if (!scene.arthroscope) json["script"]["view"] = {view.x, view.y, view.z};
  }
  json["limits"] = {{"upload_bytes", options.most_upload}};
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  protocol::Hello m;
  m.session = options.session_id;
  m.client = client;
  m.flags = led ? protocol::kOnlyWatches : 0;
  m.tick = static_cast<float>(options.tick);
  m.name = source.name;
  m.json = text;
  send(client, protocol::encode(m));
}

protocol::Message Engine::Impl::body_now() {
  return once(body_told, [&] {
    protocol::Body m = drawn.body_message();
    m.body = body;
    m.version = version;
    fill_nodes();
    m.nodes = nodes;
    m.fading = fading;
    m.offset = fading_offset;
    return protocol::encode(m);
  });
}

protocol::Message Engine::Impl::things_now() {
  return once(things_told, [&] {
    protocol::Things m = things.message();
    m.body = body;
    return protocol::encode(m);
  });
}

bool Engine::Impl::find_fixed() {
  fixed.swap(fixed_before);
  fixed.clear();
  const std::size_t n = session->node_positions().size();
  for (std::size_t i = 0; i < n; ++i)
    if (session->is_fixed(NodeId(i)) && session->body().hex.active(NodeId(i)))
      fixed.push_back(static_cast<std::uint32_t>(i));
  held_drawn.swap(held_drawn_before);
  drawn.drawn(session->held_visual(), held_drawn);
  if (fixed == fixed_before && held_drawn == held_drawn_before) return false;
  fixed_told = {};
  return true;
}

protocol::Message Engine::Impl::fixed_now() {
  return once(fixed_told, [&] { return protocol::encode(protocol::Fixed{body, fixed, held_drawn}); });
}

bool Engine::Impl::weigh() {
  const double density = session->material().density;
  const bool same =
      weighed.body == body && weighed.topology == session->topology_version() && weighed.density == density;
  if (same || (session->in_stroke() && weighed.body == body)) return false;
  weighed = {body, version, session->topology_version(), density, session->piece_masses()};
  return true;
}

protocol::Message Engine::Impl::masses_now() {
  std::vector<float> mass(weighed.masses.mass.begin(), weighed.masses.mass.end());
  std::vector<std::uint32_t> copy;
  for (const HexId h : weighed.masses.copy) copy.push_back(static_cast<std::uint32_t>(h.index()));
  return share(protocol::encode(
      protocol::Masses{weighed.body, weighed.version, static_cast<float>(weighed.masses.uncut), mass, copy}));
}

void Engine::Impl::greet(std::uint32_t id, const protocol::PageHello& m) {
  EngineClient& client = clients.at(id);
  publish(0);  // it may come between two steps: what the body message says belongs together
  hello(id);
  bool resumed = m.session == options.session_id && m.body == body && m.version <= version && m.version > 0;
  if (resumed && m.version < version) {
    const auto first =
        std::find_if(history.begin(), history.end(), [&](const OldPatch& p) { return p.from == m.version; });
    resumed = first != history.end();
    for (auto p = first; p != history.end(); ++p) client.queue.push(p->message);
  }
  const bool known = std::exchange(client.ready, true);
  if (!resumed) client.queue.push(body_now());
  client.queue.push(things_now());
  if (find_fixed()) {
    broadcast(fixed_now());
  } else {
    client.queue.push(fixed_now());
  }
  if (weigh()) broadcast(masses_now());
  else client.queue.push(masses_now());
  frame_due = true;
  told_at = 0;
  if (known && (holder != 0 || led)) return send(id, protocol::encode(role_of(id)));  // nothing new to the others
  if (holder == 0 && !led) holder = id;
  send_roles();
}

protocol::Role Engine::Impl::role_of(std::uint32_t client) const {
  const auto ready = static_cast<std::uint32_t>(
      std::count_if(clients.begin(), clients.end(), [](const auto& c) { return c.second.ready; }));
  return {holder, client == holder ? 1u : 0u, ready};
}

void Engine::Impl::send_roles() {
  for (auto& [id, client] : clients)
    if (client.ready) send(id, protocol::encode(role_of(id)));
}

protocol::Message Engine::Impl::overlay_now(bool feet) {
  return once(overlay_told[feet ? 1 : 0], [&] {
    const OverlayArrays arrays = overlay_arrays(session->body(), feet);
    return protocol::encode(protocol::Overlay{body, version, arrays.rest, arrays.copy, arrays.triangles, arrays.bound,
                                              arrays.links, arrays.feet, arrays.foot_rest});
  });
}

void Engine::Impl::send_overlay() {
  for (auto& [id, client] : clients)
    if (client.ready && client.overlay) client.queue.push(overlay_now(client.feet));
}

void Engine::Impl::pass_tools(std::uint32_t to) {
  cancel_tool();
  holder = to;
  send_roles();
}

void Engine::Impl::fill_nodes() {
  session->shown_nodes(shown_nodes);
  nodes.resize(shown_nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] = to_float(shown_nodes[i]);
  drawn.fading(session->fading_visual(), fading, fading_offset);
}

void Engine::Impl::publish(std::uint32_t input) {
  if (input != 0) last_input = input;
  frame_due = true;
  if (session->topology_version() == published_topology) return;
  published_topology = session->topology_version();
  drawn.update(session->body(), session->take_changes());
  if (!drawn.changed() && session->node_positions().size() == published_nodes) return;
  published_nodes = session->node_positions().size();
  protocol::Patch m = drawn.patch_message();
  m.body = body;
  m.from = version;
  m.to = ++version;
  m.input = input;
  m.totals.nn = static_cast<std::uint32_t>(published_nodes);
  fill_nodes();
  m.nodes = nodes;
  m.fading = fading;
  m.offset = fading_offset;
  const protocol::Message message = share(protocol::encode(m));
  history.push_back({m.from, message});
  history_bytes += message->capacity() + kMessageOverhead;
  while (history_bytes > options.patch_history && !history.empty()) {
    history_bytes -= history.front().message->capacity() + kMessageOverhead;
    history.pop_front();
  }
  for (auto& [id, client] : clients)
    if (client.ready) client.queue.forget_frame();
  broadcast(message);
  send_overlay();
}

void Engine::Impl::send_frame() {
  frame_due = false;
  since_frame = 0;
  fill_nodes();
  grasps.clear();
  held.clear();
  for (const Session::GraspState& g : session->grasps()) {
    grasps.push_back({to_float(g.held), to_float(g.target)});
    held.push_back(g.points.empty()
                       ? protocol::kNoNode
                       : static_cast<std::uint32_t>(session->body().embedding.collision[g.points.front()].index()));
  }
  protocol::Frame m;
  m.body = body;
  m.seq = ++frame_seq;
  m.version = version;
  m.input = last_input;
  m.time = session->time();
  m.step_ms = times.total.empty() ? 0.0f : static_cast<float>(1e3 * times.total.back());
  m.speed = static_cast<float>(speed);
  m.flags = (playing ? protocol::kPlaying : 0u) | (session->in_stroke() ? protocol::kInStroke : 0u);
  m.undo_depth = static_cast<std::uint32_t>(session->undo_depth());
  m.redo_depth = static_cast<std::uint32_t>(session->redo_depth());
  m.nodes = nodes;
  m.fading = fading;
  m.offset = fading_offset;
  m.grasps = grasps;
  m.held = held;
  things.place(*session);
  m.places = things.places();
  m.tools = things.tools();
  contacts.take(*session);
  m.touching = contacts.touching;
  m.press = contacts.press;
  if (std::any_of(clients.begin(), clients.end(), [](const auto& c) { return c.second.contacts; })) {
    m.contacts = contacts.points;
    m.partners = contacts.partners;
  }
  const protocol::Message message = share(protocol::encode(m));
  for (auto& [id, client] : clients)
    if (client.ready) client.queue.offer_frame(m.seq, message);
}

const BodyCounts& Engine::Impl::current_counts() {
  if (counted_topology != session->topology_version()) {
    counts = session->counts();
    counted_topology = session->topology_version();
  }
  return counts;
}

void Engine::Impl::send_stats(double real_seconds) {
  const Quantiles q = quantiles({times.total.begin(), times.total.end()});
  protocol::Stats m;
  m.step_ms = static_cast<float>(1e3 * q.median);
  m.step_ms_99 = static_cast<float>(1e3 * q.p99);
  m.mechanics_ms = static_cast<float>(1e3 * times.mechanics);
  m.steps_per_second = static_cast<float>(static_cast<double>(times.steps) / real_seconds);
  m.iterations = static_cast<std::uint32_t>(times.iterations);
  m.residual = static_cast<float>(times.residual);
  m.counts = to_message(current_counts());
  m.pieces = static_cast<std::uint32_t>(counts.pieces);
  m.clients = static_cast<std::uint32_t>(clients.size());
  times.steps = 0;
  for (auto& [id, client] : clients) {
    if (!client.ready) continue;
    m.dropped = client.queue.dropped_frames();
    m.bad = client.bad;
    send(id, protocol::encode(m));
  }
}

bool Engine::Impl::single_step() {
  const auto start = Clock::now();
  // Strokes that end in the step are the scene's own, or a tool's.
  const std::size_t ended = finished_strokes();
  auto step = session->step();
  if (!step) {
    playing = false;
    owed = 0;
    for (const auto& [id, client] : clients)
      if (client.ready)
        error(id, 0, ErrorCode::kFailed, fmt::format("The simulation stopped: {}", step.error().message));
    return false;
  }
  times.total.push_back(seconds_since(start));
  if (times.total.size() > kStepWindow) times.total.pop_front();
  times.mechanics = step->mechanics.seconds_total;
  times.iterations = step->mechanics.iterations;
  times.residual = step->mechanics.residual;
  ++times.steps;
  frame_due = true;
  if (finished_strokes() > ended) report_strokes(0, ended, session->strokes()[ended].before);
  if (recording && !too_long && session->step_count() % kHashEvery == 0 && counts.visual_triangles <= kHashedTriangles)
    hashes.push_back({session->step_count(), session->hash()});
  return true;
}

void Engine::Impl::look_at_led() {
  since_frame += tick_seconds;
  since_stats += tick_seconds;
  since_step += tick_seconds;
  const bool changed = led->changes() != seen_changes, stats_due = since_stats >= kStatsEvery;
  const bool stops = playing && since_step >= kStepsShown;
  if (!watched) {
    // What the session notes for pages is taken nevertheless, so that it doesn't pile up.
    if (!changed || !stats_due) return;
  } else if (!changed && !frame_due && !stops && !stats_due && since_frame < kIdleFrames) {
    return;
  }
  const LedSession::Look look(*led);
  if (!look) return;
  seen_changes = led->changes();
  const std::int64_t steps = session->step_count();
  if (steps != seen_steps) {
    times.steps += std::max<std::int64_t>(steps - seen_steps, 0);  // restore() goes back
    times.total.push_back(led->last_step().seconds);
    if (times.total.size() > kStepWindow) times.total.pop_front();
    times.mechanics = led->last_step().mechanics.seconds_total;
    times.iterations = led->last_step().mechanics.iterations;
    times.residual = led->last_step().mechanics.residual;
    seen_steps = steps;
    since_step = 0;
  }
  playing = since_step < kStepsShown;
  publish(0);
  if (!watched) {
    since_stats = 0;
    return;
  }
  send_frame();
  if (!stats_due) return;
  send_stats(since_stats);
  since_stats = 0;
  if (told_at == seen_changes) return;
  told_at = seen_changes;
  send_score();
  if (find_fixed()) broadcast(fixed_now());
  if (weigh()) broadcast(masses_now());
}

void Engine::Impl::begin_steps(double real_seconds) {
  left_of_budget = options.step_budget;
  steps_due = playing;
  if (playing) owed = std::min(owed + speed * real_seconds, std::max(kMostOwed * speed, session->time_step()));
}

bool Engine::Impl::step_due() {
  const double dt = session->time_step();
  if (!steps_due || !playing || owed < dt) return steps_due = false;
  owed -= dt;
  const auto start = Clock::now();
  if (!single_step()) return steps_due = false;
  left_of_budget -= seconds_since(start);
  if (left_of_budget >= 0) return true;
  owed = std::min(owed, dt);  // slower than real time: no debts
  steps_due = false;
  return true;
}

Recording Engine::Impl::make_recording() const {
  Recording r;
  r.source = source;
  r.overrides = overrides;
  r.overrides.dust = session->scene().cut.dust;
  r.instructions = instruction_set();
  r.changes = changes;
  r.hashes = hashes;
  r.last_step = session->step_count();
  r.end_hash = session->hash();
  return r;
}

void Engine::Impl::handle(std::uint32_t id, const protocol::PageMessage& message) {
  EngineClient& client = clients.at(id);
  if (const auto* m = std::get_if<protocol::PageHello>(&message)) {
    if (m->protocol != protocol::kVersion) {
      ++client.bad;
      return error(id, 0, ErrorCode::kBadMessage,
                   fmt::format("This kerf speaks protocol {}, the page {}; load the page again.", protocol::kVersion,
                               m->protocol));
    }
    return greet(id, *m);
  }
  if (!client.ready) {
    ++client.bad;
    return error(id, 0, ErrorCode::kBadMessage, "The first message of a page is Hello.");
  }
  if (const auto* m = std::get_if<protocol::Ack>(&message)) return client.queue.acknowledge(m->seq);
  if (const auto* m = std::get_if<protocol::RayQuery>(&message)) {
    protocol::Hit hit;
    hit.input = m->input;
    if (const auto picked = aim(m->ray, static_cast<double>(m->near))) {
      hit.triangle = picked->triangle.value;
      hit.t = picked->t;
      hit.point = picked->point;
      hit.normal = to_float(picked->normal);
      hit.beside = static_cast<float>(picked->beside);
      const HexMesh& hex = session->body().hex;
      for (const Piece& piece : hex.pieces_of(picked->triangle))
        hit.copy = static_cast<std::uint32_t>(hex.host[piece.copy].index());
    }
    return send(id, protocol::encode(hit));
  }
  if (const auto* m = std::get_if<protocol::Claim>(&message)) {
    if (led) return error(id, 0, ErrorCode::kNotAllowed, kLed);
    if (m->take) {
      if (holder != id) pass_tools(id);
      return;
    }
    if (holder != id) return;
    std::uint32_t to = 0;
    for (const auto& [other, c] : clients)
      if (to == 0 && other != id && c.ready) to = other;
    return pass_tools(to);
  }
  const auto* command_message = std::get_if<protocol::Command>(&message);
  const auto* tool_message = std::get_if<protocol::ToolInput>(&message);
  const auto* device_message = std::get_if<protocol::Device>(&message);
  const std::uint32_t input = command_message  ? command_message->input
                              : tool_message   ? tool_message->input
                              : device_message ? device_message->input
                                               : 0;
  // Everybody may look: the overlay and exports are for watchers too.
  const bool watching = command_message && (command_message->code == protocol::CommandCode::kOverlay ||
                                            command_message->code == protocol::CommandCode::kContacts ||
                                            command_message->code == protocol::CommandCode::kExport);
  if (holder != id && !watching)
    return error(id, input, ErrorCode::kNotAllowed, led ? kLed : "Another page holds the tools; take them first.");
  Status done;
  if (command_message) done = command(id, *command_message);
  else if (tool_message) done = use_tool(*tool_message);
  else if (device_message) done = lead_tool(*device_message);
  else if (const auto* m = std::get_if<protocol::Upload>(&message)) done = take_upload(client, *m);
  if (!done)
    error(id, input, done.error().kind == ErrorKind::kBadInput ? ErrorCode::kBadArgument : ErrorCode::kFailed,
          done.error().message);
  publish(input);
  tick_wanted = true;
  if (frame_due && !playing) send_frame();
}

std::uint32_t Engine::connect() {
  const std::uint32_t id = impl_->next_client++;
  impl_->clients.emplace(id, EngineClient(impl_->options.most_unread));
  return id;
}

void Engine::disconnect(std::uint32_t id) {
  Impl& e = *impl_;
  if (e.clients.erase(id) == 0) return;
  if (e.holder == id) {
    std::uint32_t to = 0;
    for (const auto& [other, client] : e.clients)
      if (to == 0 && client.ready) to = other;
    e.leave_tool();
    e.pass_tools(to);
    e.publish(0);
  } else {
    e.send_roles();
  }
}

void Engine::receive(std::uint32_t id, std::span<const std::byte> bytes) {
  Impl& e = *impl_;
  const auto found = e.clients.find(id);
  if (found == e.clients.end()) return;
  auto message = protocol::decode_page_message(bytes);
  if (!message) {
    ++found->second.bad;
    e.error(id, protocol::input_of(bytes), ErrorCode::kBadMessage, message.error().message);
    return;
  }
  std::optional<LedSession::Look> look;
  if (e.led && !std::holds_alternative<protocol::Ack>(*message) && !look.emplace(*e.led)) return;
  e.handle(id, *message);
}

void Engine::refuse(std::uint32_t id, const std::string& why) {
  const auto found = impl_->clients.find(id);
  if (found == impl_->clients.end()) return;
  ++found->second.bad;
  impl_->error(id, 0, ErrorCode::kBadMessage, why);
}

protocol::Message Engine::next(std::uint32_t id) {
  const auto found = impl_->clients.find(id);
  return found == impl_->clients.end() ? nullptr : found->second.queue.next();
}

bool Engine::gives_up(std::uint32_t id) const {
  const auto found = impl_->clients.find(id);
  return found == impl_->clients.end() || found->second.bad >= kMostBadMessages || overflows(id);
}

bool Engine::overflows(std::uint32_t id) const {
  const auto found = impl_->clients.find(id);
  if (found == impl_->clients.end()) return false;
  const ClientQueue& queue = found->second.queue;
  if (queue.overflowed()) return true;
  if (queue.unread() == 0 || impl_->unread() <= impl_->options.most_unread_together) return false;
  return std::all_of(impl_->clients.begin(), impl_->clients.end(),
                     [&](const auto& c) { return c.second.queue.unread() <= queue.unread(); });
}

bool Engine::holds_back(std::uint32_t id) const {
  const auto found = impl_->clients.find(id);
  if (found == impl_->clients.end()) return false;
  const std::size_t unread = found->second.queue.unread();
  return unread > impl_->options.most_answers || (unread > 0 && impl_->unread() > impl_->options.most_together);
}

void Engine::tick(double real_seconds) {
  begin_tick(real_seconds);
  while (step_due()) {}
  end_tick();
}

void Engine::begin_tick(double real_seconds) {
  Impl& e = *impl_;
  if (!(real_seconds >= 0)) real_seconds = 0;
  e.tick_wanted = false;
  e.tick_seconds = real_seconds;
  e.watch_loading(real_seconds);
  // With nobody watching nothing moves: what a page sees when it comes is what it left.
  e.watched = std::any_of(e.clients.begin(), e.clients.end(), [](const auto& c) { return c.second.ready; });
  e.steps_due = false;
  if (!e.watched || e.led) return;
  e.work_instrument(real_seconds);
  e.begin_steps(real_seconds);
}

bool Engine::step_due() { return impl_->step_due(); }

void Engine::end_tick() {
  Impl& e = *impl_;
  if (e.led) {
    e.look_at_led();
    return e.export_next();
  }
  if (!e.watched) return;
  e.publish(0);
  e.send_pending_report();
  e.since_frame += e.tick_seconds;
  e.since_stats += e.tick_seconds;
  if (e.frame_due || e.since_frame >= kIdleFrames) e.send_frame();
  if (e.since_stats >= kStatsEvery) {
    e.send_stats(e.since_stats);
    e.send_score();
    if (e.find_fixed()) e.broadcast(e.fixed_now());
    if (e.weigh()) e.broadcast(e.masses_now());
    e.since_stats = 0;
  }
  e.export_next();
}

const Session& Engine::session() const { return *impl_->session; }
bool Engine::tick_wanted() const { return impl_->tick_wanted; }
bool Engine::loading() const { return impl_->loader.busy(); }
bool Engine::playing() const { return impl_->playing; }
std::uint32_t Engine::body() const { return impl_->body; }
std::uint32_t Engine::version() const { return impl_->version; }
std::uint32_t Engine::holder() const { return impl_->holder; }
std::size_t Engine::client_count() const { return impl_->clients.size(); }
std::size_t Engine::unread() const { return impl_->unread(); }
Recording Engine::recording() const { return impl_->make_recording(); }

}  // namespace kerf
