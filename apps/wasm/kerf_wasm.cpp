// The engine of the page as a module of WebAssembly: a page's worker gives it files and messages (docs/protocol.md), calls it in time and
// carries away what it has to say. One engine a module, one page an engine. What fails is said by text(); what ends the module (memory that runs
// out) traps, and the worker tells its page.
#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>

#include "kerf/engine/engine.h"
#include "kerf/mesh/memory_files.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/recording.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/scene_file.h"

#define KERF_EXPORT(name) extern "C" __attribute__((export_name(name)))

namespace {

using namespace kerf;

std::optional<Engine> engine;
EngineOptions options;
protocol::Message message;  ///< the one that was given last; it lives until the next
std::string text;

std::string string_at(const char* bytes, std::uint32_t size) { return {bytes, size}; }

int said(std::string words) {
  text = std::move(words);
  return 1;
}

}  // namespace

// The library catches what the standard library throws where memory ends. Here nothing is caught: the module ends.
extern "C" {
void* __cxa_allocate_exception(std::size_t /*size*/) noexcept { __builtin_trap(); }
void __cxa_throw(void* /*thrown*/, void* /*type*/, void (* /*destroy*/)(void*)) { __builtin_trap(); }
void __cxa_free_exception(void* /*thrown*/) noexcept {}
}

KERF_EXPORT("allocate") void* kerf_allocate(std::uint32_t size) { return std::malloc(size); }
KERF_EXPORT("release") void kerf_release(void* bytes) { std::free(bytes); }

/// What is wrong, after a call that failed: its bytes, and how many.
KERF_EXPORT("text") const char* kerf_text() { return text.data(); }
KERF_EXPORT("text_size") std::uint32_t kerf_text_size() { return static_cast<std::uint32_t>(text.size()); }

/// A file for scenes to name.
KERF_EXPORT("put_file")
void kerf_put_file(const char* path, std::uint32_t path_size, const char* bytes, std::uint32_t size) {
  put_memory_file(string_at(path, path_size), {bytes, size});
}
/// A scene to be chosen from: a file that was put there. One that can't be read is left out. 0: it is offered.
KERF_EXPORT("offer_scene") int kerf_offer_scene(const char* path, std::uint32_t path_size) {
  const std::string where = string_at(path, path_size);
  const auto scene = read_scene(where, {});
  if (!scene) return said(scene.error().message);
  const std::string name = std::filesystem::path(where).stem().string();
  options.scenes.push_back({name, scene->title.empty() ? name : scene->title, where, scene->goal});
  return 0;
}
/// Makes the engine with a scene that was put there. 0: it is there.
KERF_EXPORT("start") int kerf_start(const char* path, std::uint32_t path_size, double session_id) {
  const std::string where = string_at(path, path_size);
  auto scene = scene_text_in(where);
  if (!scene) return said(scene.error().message);
  SceneSource source;
  source.text = std::move(*scene);
  source.name = std::filesystem::path(where).stem().string();
  source.folder = std::filesystem::path(where).parent_path();
  options.session_id = static_cast<std::uint64_t>(session_id);
  auto made = Engine::create(source, options);
  if (!made) return said(made.error().message);
  engine.emplace(std::move(*made));
  return 0;
}

KERF_EXPORT("connect") std::uint32_t kerf_connect() { return engine->connect(); }
KERF_EXPORT("disconnect") void kerf_disconnect(std::uint32_t client) { engine->disconnect(client); }
KERF_EXPORT("receive") void kerf_receive(std::uint32_t client, const std::byte* bytes, std::uint32_t size) {
  engine->receive(client, {bytes, size});
}
/// The next message for a page, whose bytes live until the next call; null: none now.
KERF_EXPORT("next") const void* kerf_next(std::uint32_t client) {
  message = engine->next(client);
  return message ? message->data() : nullptr;
}
KERF_EXPORT("next_size") std::uint32_t kerf_next_size() {
  return message ? static_cast<std::uint32_t>(message->size()) : 0;
}
KERF_EXPORT("gives_up") int kerf_gives_up(std::uint32_t client) { return engine->gives_up(client) ? 1 : 0; }

KERF_EXPORT("begin_tick") void kerf_begin_tick(double seconds) { engine->begin_tick(seconds); }
KERF_EXPORT("step_due") int kerf_step_due() { return engine->step_due() ? 1 : 0; }
KERF_EXPORT("end_tick") void kerf_end_tick() { engine->end_tick(); }
KERF_EXPORT("tick_wanted") int kerf_tick_wanted() { return engine->tick_wanted() ? 1 : 0; }

/// Repeats a recording that was put there, without an engine. 0: the same bits; 1: it can't be repeated; 2: other bits. text() says how it went.
KERF_EXPORT("replay") int kerf_replay(const char* path, std::uint32_t path_size) {
  const std::string where = string_at(path, path_size);
  const auto recording = read_recording(where);
  if (!recording) return said(recording.error().message);
  const auto played = replay(*recording, {}, {}, where);
  if (!played) return said(played.error().message);
  text = played->first_difference < 0
             ? fmt::format("{} steps, {} hashes: the same bits", played->steps, played->hashes)
             : fmt::format("differs at step {} of {}", played->first_difference, recording->last_step);
  return played->first_difference < 0 ? 0 : 2;
}
